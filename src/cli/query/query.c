/* vdbshade query: shadow, AO and distance at points of a file or a pipe. */
#include "base/memory.h"
#include "cli/bake/bake.h"
#include "points.h"

typedef struct query_settings {
    cli_bake_settings bake; /* the scene */
    const char *points;
    int32_t format, points_format; /* VSHI_TABLE_…; -1: not given */
    int32_t normals;               /* as in cli_points_open() */
    bool distance, gradient, answers_only, strict;
    int32_t batch; /* rows; 0: not given */
    double within; /* 0: not given */
} query_settings;

/* The kinds of answers, and the answers of a batch. */
typedef struct query_answers {
    size_t lights;
    const vsh_light *light;
    bool ao, distance, gradient;
    bool shadow_error, ao_error;  /* standard errors, if the method knows them */
    float **visibility, **errors; /* [lights] */
    vsh_query_output output;
    cli_points_answers rows;
} query_answers;

static const cli_option options[] = {
    {.help = "Points and output"},
    {"points", "FILE",
     "points: .csv .tsv .txt .xyz, .ply, or .raw .f32 .bin of floats (32 bits, little endian); - is standard "
     "input",
     CLI_VALUE(TEXT, query_settings, points)},
    {"points-format", "csv|ply|raw", "their format, whatever the ending",
     CLI_VALUE(WORD, query_settings, points_format)},
    {"output", "OUT", "file to write, by the same endings; - is standard output",
     CLI_VALUE(TEXT, query_settings, bake.output)},
    {"format", "csv|ply|raw", "its format, whatever the ending (for -, as the points)",
     CLI_VALUE(WORD, query_settings, format)},
    {"normals", "no|yes",
     "whether normals are read (csv and ply: if there are any; raw: no, rows of 3 floats; yes: of 6)",
     CLI_VALUE(WORD, query_settings, normals)},
    {"answers-only", NULL,
     "write only answers; else they follow each row as it came, or (formats differ) x y z nx ny nz",
     CLI_VALUE(FLAG, query_settings, answers_only)},
    {"strict", NULL, "end at the first bad row, with code 2", CLI_VALUE(FLAG, query_settings, strict)},
    {"batch", "N",
     "rows answered and written at a time, 1 to 1048576 (1048576, or as many as --memory-limit allows)",
     CLI_RANGE(INTEGER, query_settings, batch, 1, VSH_QUERY_BATCH)},
    CLI_STATS_OPTION(query_settings, bake.stats),
    {.help = "Answers"},
    CLI_LIGHT_OPTIONS,
    {"distance", NULL,
     "also distance: to the nearest surface, scene units, negative inside; far away a lower bound",
     CLI_VALUE(FLAG, query_settings, distance)},
    {"gradient", NULL,
     "also gradient.x, .y, .z: unit, the way that distance grows; next to a surface its normal",
     CLI_VALUE(FLAG, query_settings, gradient)},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    {"within", "DISTANCE",
     "wide lights are right for points up to this distance from the casters' box (four times its diagonal)",
     CLI_VALUE(POSITIVE, query_settings, within)},
    CLI_COMMON_OPTIONS,
};

/* --- options */

static bool is_standard(const char *path) {
    return strcmp(path, "-") == 0;
}

/* Returns the format of a path by its ending; -1 if it is unknown. */
static int32_t format_of(const char *path) {
    static const char *const endings[] = {
        [VSHI_TABLE_CSV] = "csv tsv txt xyz", [VSHI_TABLE_PLY] = "ply", [VSHI_TABLE_RAW] = "raw f32 bin"};
    for (int32_t i = 0; i < (int32_t)CLI_COUNT(endings); ++i) {
        if (cli_has_ending(path, endings[i])) {
            return i;
        }
    }
    return -1;
}

/* Chooses the formats that no option names. */
static int find_formats(query_settings *s) {
    CLI_REFUSE_IF(s->points == NULL, "query: no points; give --points FILE, or - for standard input");
    CLI_REFUSE_IF(s->bake.output == NULL, "query: no output; give -o OUT, or - for standard output");
    s->points_format = s->points_format < 0 ? format_of(s->points) : s->points_format;
    CLI_REFUSE_IF(s->points_format < 0,
                  "--points '%s': unknown extension for a file of points (.csv .tsv .txt .xyz, .ply, .raw "
                  ".f32 .bin); %s",
                  s->points,
                  cli_has_ending(s->points, "obj gltf glb fbx stl dae x3d 3ds blend off")
                      ? "export the mesh's vertices as .ply, with normals for --ao"
                      : "choose one by --points-format csv, ply or raw");
    if (s->format < 0) {
        s->format = is_standard(s->bake.output) ? s->points_format : format_of(s->bake.output);
    }
    return s->format >= 0 ? CLI_OK : cli_usage("-o '%s': give --format csv, ply or raw", s->bake.output);
}

/* --- the work */

typedef struct query_work {
    const query_settings *settings;
    cli_shading shading;
    vsh_query *query;
    cli_points_reader reader;
    query_answers answers;
    double begin, share; /* of the batch, as parts of the file */
} query_work;

/* --- batches of VSH_QUERY_BATCH rows, which give the bits of one call for all points, or of as many rows as
 * the memory limit allows */

enum {
    ORDER_BYTES = 16, /* for a point in vsh_query_points() */
    TEXT_BYTES = 256, /* for a kept row of text; longer rows make batches smaller */
    LEAST_ROWS = 1024 /* smaller batches are slow */
};

/* Returns the number of floats that answer a point. */
static size_t count_floats(const query_answers *a) {
    return a->lights * (a->shadow_error ? 2 : 1) + (a->ao ? a->ao_error ? 2 : 1 : 0) + (a->distance ? 1 : 0) +
           (a->gradient ? 3 : 0);
}

static float *add_column(query_answers *a, const char *kind, const char *name) {
    cli_points_answers *rows = &a->rows;
    snprintf(rows->names[rows->width], sizeof *rows->names, "%s%s", kind, name);
    return rows->values + rows->width++;
}

static void create_answers(query_answers *a, size_t room) {
    const size_t floats = count_floats(a);
    a->rows.values = malloc(room * floats * sizeof *a->rows.values);
    a->rows.names = calloc(floats, sizeof *a->rows.names);
    a->visibility = calloc(a->lights + 1, sizeof *a->visibility);
    a->errors = calloc(a->lights + 1, sizeof *a->errors);
    a->output = vsh_query_output_default();
    a->output.stride = floats * sizeof(float);
    a->output.visibility = a->visibility;
    a->output.shadow_error = a->errors;
    for (size_t l = 0; l < a->lights; ++l) {
        a->visibility[l] = add_column(a, "shadow.", a->light[l].name);
    }
    a->output.ao = a->ao ? add_column(a, "ao", "") : NULL;
    for (size_t l = 0; a->shadow_error && l < a->lights; ++l) {
        a->errors[l] = add_column(a, "error.", a->light[l].name);
    }
    a->output.ao_error = a->ao && a->ao_error ? add_column(a, "error.", "ao") : NULL;
    a->output.distance = a->distance ? add_column(a, "distance", "") : NULL;
    if (a->gradient) {
        a->output.gradient = add_column(a, "gradient", ".x");
        add_column(a, "gradient", ".y");
        add_column(a, "gradient", ".z");
    }
}

/* Chooses the rows of a batch, and the most of their own bytes that it holds. */
static int plan_batch(const query_work *work, bool keep, size_t *rows, size_t *most_kept) {
    const int32_t asked = work->settings->batch;
    const vsh_occluders_info *casters = &work->shading.stats.casters;
    const char *name = work->reader.table.source.name;
    vsh_run run = cli_run;
    run.memory_held += casters->field_bytes + casters->triangles_bytes;
    const size_t row_size = work->reader.table.row_size; /* 0: text */
    /* twice, because room grows by doubling */
    const size_t own = !keep ? 0 : row_size > 0 ? 2 * row_size : TEXT_BYTES;
    const size_t each = sizeof(double[3]) + (work->reader.has_normals ? sizeof(float[3]) : 0) +
                        sizeof(uint32_t) + (keep ? sizeof(size_t) : 0) + ORDER_BYTES + own +
                        count_floats(&work->answers) * sizeof(float);
    const size_t least = asked > 0 && asked < LEAST_ROWS ? (size_t)asked : LEAST_ROWS;
    *rows = asked > 0 ? (size_t)asked : VSH_QUERY_BATCH;
    while (*rows / 2 >= least && vshi_check_limit(&run, (double)*rows * (double)each, name, NULL) != VSH_OK) {
        *rows /= 2;
    }
    CLI_TRY(cli_check(vshi_check_limit(&run, (double)*rows * (double)each, name, &cli_error)));
    *most_kept = *rows * own / 2;
    return CLI_OK;
}

/* Shows a batch's progress as a part of the file. */
static int32_t report_progress(void *user, const char *stage, double fraction) {
    const query_work *work = user;
    return cli_run.progress(cli_run.user, stage, work->begin + work->share * fraction);
}

static int answer_batch(query_work *work, const cli_points *points) {
    const vshi_source *source = &work->reader.table.source;
    const double done = source->size > 0 ? (double)source->taken / (double)source->size : 1.0;
    work->begin = source->size > 0 ? work->begin + work->share : 0.0;
    work->share = fmin(done, 1.0) - work->begin;
    vsh_run run = cli_run;
    run.progress = report_progress;
    run.user = work;
    const vsh_points view = {points->count, points->positions, points->normals, points->texels};
    CLI_TRY(cli_check_input(vsh_query_points(work->query, &view, NULL, &run, &work->answers.output,
                                             &work->shading.stats.shade, &cli_error)));
    cli_stats_lap(&work->shading.stats, CLI_STAGE_BAKE);
    return CLI_OK;
}

static int answer_rows(query_work *work, size_t most_kept, cli_points *points, cli_points_writer *writer) {
    cli_stats *stats = &work->shading.stats;
    for (;;) {
        CLI_TRY(cli_points_read(&work->reader, most_kept, points));
        cli_stats_lap(stats, CLI_STAGE_LOAD);
        if (points->count == 0) {
            break;
        }
        CLI_TRY(answer_batch(work, points));
        CLI_TRY(cli_points_write(writer, points));
        cli_stats_lap(stats, CLI_STAGE_WRITE);
    }
    CLI_TRY(cli_points_writer_commit(writer, &work->reader));
    cli_stats_lap(stats, CLI_STAGE_WRITE);
    stats->points = work->reader.table.rows;
    stats->bad_rows = work->reader.bad;
    return CLI_OK;
}

/* Reads, answers and writes until the points end. */
static int answer_points(query_work *work) {
    const query_settings *s = work->settings;
    cli_points_reader *reader = &work->reader;
    cli_points points = {0};
    cli_points_writer writer = {0};
    size_t rows = 0, most_kept = 0;
    const bool keep = !s->answers_only && s->format == s->points_format && cli_points_can_keep(reader);
    int code = CLI_OK;
    CLI_TRY_DONE(plan_batch(work, keep, &rows, &most_kept));
    points = cli_points_create(rows, reader->has_normals, keep);
    create_answers(&work->answers, rows);
    CLI_TRY_DONE(cli_points_writer_open(s->bake.output, s->format, s->answers_only, reader,
                                        &work->answers.rows, &writer));
    CLI_TRY_DONE(answer_rows(work, most_kept, &points, &writer));
done:
    cli_points_writer_free(&writer);
    cli_points_free(&points);
    return code;
}

/* --- the command */

/* Chooses the answers by the scene, the options and the points' normals. */
static int choose_answers(query_work *work) {
    const query_settings *s = work->settings;
    query_answers *a = &work->answers;
    vsh_scene *scene = work->shading.scene;
    if (scene->ao && !work->reader.has_normals) {
        CLI_REFUSE_IF(cli_was_given("ao"), "%s: no normals, which --ao needs",
                      work->reader.table.source.name);
        cli_warn("%s: the points have no normals, so AO is left out", work->reader.table.source.name);
        scene->ao = 0;
    }
    *a = (query_answers){.lights = scene->light_count,
                         .light = scene->lights,
                         .ao = scene->ao != 0,
                         .distance = s->distance,
                         .gradient = s->gradient};
    a->shadow_error = scene->error && scene->light_count > 0 &&
                      (vsh_method_traits(VSH_NAMES_SHADOW, scene->shade.method) & VSH_METHOD_RAYS) != 0;
    a->ao_error = scene->error && scene->ao &&
                  (vsh_method_traits(VSH_NAMES_AO, scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
    CLI_REFUSE_IF(count_floats(a) == 0,
                  "%s: nothing to answer: no lights and no ao; give --sun, --ao, --distance or --gradient",
                  s->bake.input);
    return CLI_OK;
}

static int make_query(query_work *work) {
    const vsh_scene *scene = work->shading.scene;
    CLI_TRY(cli_shading_load(&work->shading));
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.within = work->settings->within;
    what.voxels = work->settings->distance || work->settings->gradient;
    CLI_TRY(cli_shading_cast(&work->shading, &what));
    vsh_shade_options shade = scene->shade;
    if (!scene->ao) {
        shade.ao_method = VSH_AO_AUTO; /* the scene's method may need triangles that were not made */
    }
    return cli_check_input(vsh_query_create(work->shading.occluders, scene->lights, scene->light_count,
                                            &shade, &work->query, &cli_error));
}

static int run_query(const query_settings *s, query_work *work) {
    cli_shading *shading = &work->shading;
    const char *points = is_standard(s->points) ? NULL : s->points;
    const char *output = is_standard(s->bake.output) ? NULL : s->bake.output;
    const char *const inputs[] = {s->bake.input, cli_bake_lights(&s->bake), points};
    const char *const outputs[] = {output, s->bake.stats};
    CLI_TRY(cli_shading_begin(shading, &s->bake, CLI_STATS_POINTS));
    CLI_TRY(cli_check_outputs(outputs, CLI_COUNT(outputs), inputs, CLI_COUNT(inputs), shading->scene));
    cli_signals_watch();
    CLI_TRY(cli_points_open(s->points, s->points_format, s->normals, s->strict, &work->reader));
    CLI_TRY(choose_answers(work));
    CLI_TRY(make_query(work));
    CLI_TRY(answer_points(work));
    CLI_TRY(cli_stats_finish(&shading->stats, s->bake.stats));
    const cli_stats *stats = &shading->stats;
    if (stats->bad_rows > 0) {
        cli_say("%s: %" PRIu64 " of %" PRIu64 " rows are bad; their answers are nan",
                work->reader.table.source.name, stats->bad_rows, stats->points);
    }
    if (stats->shade.beyond_reach > 0) {
        cli_warn("%" PRIu64
                 " cones are wider than the field reaches, so far shadows may be too dark; raise --within",
                 stats->shade.beyond_reach);
    }
    cli_inform("%s: %" PRIu64 " points", s->bake.output, stats->points);
    cli_stats_say(stats);
    return CLI_OK;
}

static int query_main(int argc, char **argv) {
    query_settings s = {.format = -1, .points_format = -1, .normals = -1};
    query_work work = {.settings = &s};
    CLI_TRY(cli_parse(&cli_query, argc, argv, &s, &s.bake.input));
    CLI_TRY(find_formats(&s));
    const int code = run_query(&s, &work);
    free(work.answers.rows.values);
    free(work.answers.rows.names);
    free(work.answers.visibility);
    free(work.answers.errors);
    vsh_query_free(work.query);
    cli_shading_free(&work.shading);
    cli_points_close(&work.reader);
    return code;
}

const cli_command cli_query = {
    "query", "INPUT --points FILE -o OUT [options]",
    "shadow, AO, distance at points of a CSV, a PLY or raw floats",
    "Answers at points: the shadow of each light, ambient occlusion, and the distance. INPUT is a mesh\n"
    "file, a level set (FILE.vdb, FILE.vdb:GRID) or a scene file (.json; its lights and ao, not its\n"
    "receivers). Bad rows are reported by number and answered nan. Formats and columns: docs/query.md.\n"
    "Numbers in brackets are defaults.",
    CLI_ENDING(options, query_main)};
