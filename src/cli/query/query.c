/* vdbshade query: shadow, AO and distance at points of a file or a pipe. */
#include "base/clock.h"
#include "base/memory.h"
#include "cli/bake/options.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/warnings.h"
#include "points.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct query_settings {
    cli_bake_settings bake; /* the scene, with the options that `bake` has too */
    const char *points;
    int32_t format, points_format; /* VSHI_TABLE_…; -1: not given */
    int normals;                   /* as of cli_points_open() */
    bool distance, gradient, answers_only, strict;
    int32_t batch; /* rows; 0: not given */
    double within; /* 0: not given */
} query_settings;

/* The kinds of answers, and the answers of a batch. */
typedef struct query_answers {
    size_t lights;
    const vsh_light *light;
    bool ao, distance, gradient;
    bool shadow_error, ao_error;     /* standard errors, if the method knows them */
    float **visibility, **deviation; /* [lights] */
    vsh_query_output output;
    cli_points_answers rows;
} query_answers;

enum { KEY_POINTS_FORMAT = 0x2000, KEY_FORMAT, KEY_NORMALS, KEY_BATCH };

static const cli_option options[] = {
    {0, NULL, NULL, "Points and output"},
    {CLI_TEXT(query_settings, points), "points", "FILE",
     "points: .csv .tsv .txt .xyz, .ply, or .raw .f32 .bin of\nfloats (32 bits, little endian); - is "
     "standard input"},
    {KEY_POINTS_FORMAT, "points-format", "csv|ply|raw", "what they are, whatever the ending"},
    {CLI_TEXT(query_settings, bake.output), "output", "OUT",
     "file to write, by the same endings; - is standard output"},
    {KEY_FORMAT, "format", "csv|ply|raw", "what it is, whatever the ending (for -, as the points)"},
    {KEY_NORMALS, "normals", "yes|no",
     "whether normals are read (csv and ply: if there are any,\na PLY mesh has those of its faces; raw: no, "
     "rows "
     "of 3\nfloats; yes: of 6)"},
    {CLI_FLAG(query_settings, answers_only), "answers-only", NULL,
     "write answers alone; else behind each row as it came,\nor (formats differ) behind x y z nx ny nz"},
    {CLI_FLAG(query_settings, strict), "strict", NULL, "end at the first bad row, with code 2"},
    {KEY_BATCH, "batch", "N",
     "rows answered and written at a time, 1 to 1048576\n(1048576, or as many as --memory-limit allows)"},
    CLI_STATS_OPTION(query_settings, bake.stats),
    {0, NULL, NULL, "What is answered"},
    CLI_LIGHT_OPTIONS,
    {CLI_FLAG(query_settings, distance), "distance", NULL,
     "also distance: to the nearest surface, scene units,\nnegative inside; far away a lower bound"},
    {CLI_FLAG(query_settings, gradient), "gradient", NULL,
     "also gradient.x, .y, .z: unit, the way that distance\ngrows; next to a surface its normal"},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    {CLI_POSITIVE(query_settings, within), "within", "DISTANCE",
     "how far from the casters' box points may be for wide\nlights to be right there (four times its "
     "diagonal)"},
    CLI_COMMON_OPTIONS,
};

static int query_main(int argc, char **argv);

const cli_command cli_query = {
    "query",
    "INPUT --points FILE -o OUT [options]",
    "Answers at points what a light's shadow, ambient occlusion and the distance are there. INPUT is a\n"
    "mesh file, a level set (FILE.vdb, FILE.vdb:GRID) or a scene file (.json; its lights and ao, not its\n"
    "receivers). Bad rows are reported by number and answered nan. Formats and columns: docs/query.md.\n"
    "Numbers in brackets are the defaults.",
    options,
    sizeof options / sizeof options[0],
    query_main};

/* --- options */

static int parse_option(void *settings, int key, const char *name, const char *value) {
    query_settings *s = settings;
    switch (key) {
    case KEY_POINTS_FORMAT:
        return cli_points_parse_format(name, value, &s->points_format);
    case KEY_FORMAT:
        return cli_points_parse_format(name, value, &s->format);
    case KEY_NORMALS:
        s->normals = strcmp(value, "yes") == 0;
        return s->normals == 1 || strcmp(value, "no") == 0
                   ? CLI_OK
                   : cli_usage("%s '%s': expected yes or no", name, value);
    case KEY_BATCH:
        return cli_parse_integer(name, value, 1, VSH_QUERY_BATCH, &s->batch);
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
}

static bool is_standard(const char *path) {
    return strcmp(path, "-") == 0;
}

/* Chooses the formats that no option names. */
static int find_formats(query_settings *s) {
    if (s->points == NULL) {
        return cli_usage("query: no points; give --points FILE, or - for standard input");
    }
    if (s->bake.output == NULL) {
        return cli_usage("query: no output; give -o OUT, or - for standard output");
    }
    if (s->points_format < 0) {
        s->points_format = cli_points_format_of_path(s->points);
    }
    if (s->points_format < 0) {
        return cli_usage(
            "--points '%s': is called as no file of points (.csv .tsv .txt .xyz, .ply, .raw .f32 "
            ".bin); %s",
            s->points,
            cli_is_model(s->points) ? "export the mesh's vertices as .ply, with normals for --ao"
                                    : "--points-format csv, ply or raw says which of these it holds");
    }
    if (s->format < 0) {
        s->format =
            is_standard(s->bake.output) ? s->points_format : cli_points_format_of_path(s->bake.output);
    }
    if (s->format < 0) {
        return cli_usage("-o '%s': give --format csv, ply or raw", s->bake.output);
    }
    return CLI_OK;
}

/* Refuses an output before anything is read. */
static int check_files(const query_settings *s, const vsh_scene *scene) {
    cli_bake_settings outputs = s->bake;
    outputs.output = is_standard(s->bake.output) ? NULL : s->bake.output;
    const char *points = is_standard(s->points) ? NULL : s->points;
    CLI_TRY(cli_check_apart(outputs.output, points, "also the points' file"));
    CLI_TRY(cli_check_apart(outputs.stats, points, "also the points' file"));
    return cli_bake_check_files(&outputs, scene);
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

/* --- batches: VSH_QUERY_BATCH rows, so that the bits are those of one call for all points, or as many as the
 * memory limit allows */

enum {
    ORDER_BYTES = 16, /* of vsh_query_points(), a point */
    TEXT_BYTES = 256, /* room for a kept row of text; longer rows make batches smaller */
    LEAST_ROWS = 1024 /* smaller batches are not worth it */
};

/* Floats that the answers take for a point. */
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
    a->deviation = calloc(a->lights + 1, sizeof *a->deviation);
    a->output = vsh_query_output_default();
    a->output.stride = floats * sizeof(float);
    a->output.visibility = a->visibility;
    a->output.deviation = a->deviation;
    for (size_t l = 0; l < a->lights; ++l) {
        a->visibility[l] = add_column(a, "shadow.", a->light[l].name);
    }
    a->output.ao = a->ao ? add_column(a, "ao", "") : NULL;
    for (size_t l = 0; a->shadow_error && l < a->lights; ++l) {
        a->deviation[l] = add_column(a, "error.", a->light[l].name);
    }
    a->output.ao_deviation = a->ao && a->ao_error ? add_column(a, "error.", "ao") : NULL;
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
    vsh_run run = work->shading.run;
    run.memory_held += casters->field_bytes + casters->triangles_bytes +
                       work->reader.face_vertices * (uint64_t)sizeof(float[6]);
    const size_t row_size = work->reader.table.row_size; /* 0: text */
    /* twice, because room grows by doubling */
    const size_t own = !keep ? 0 : row_size > 0 ? 2 * row_size : TEXT_BYTES;
    const size_t each = cli_points_bytes(work->reader.has_normals, keep) + ORDER_BYTES + own +
                        count_floats(&work->answers) * sizeof(float);
    const size_t least = asked > 0 && asked < LEAST_ROWS ? (size_t)asked : LEAST_ROWS;
    *rows = asked > 0 ? (size_t)asked : VSH_QUERY_BATCH;
    while (*rows / 2 >= least && vshi_check_limit(&run, (double)*rows * (double)each, name, NULL) != VSH_OK) {
        *rows /= 2;
    }
    vsh_error error;
    CLI_TRY(cli_check(vshi_check_limit(&run, (double)*rows * (double)each, name, &error), &error));
    *most_kept = *rows * own / 2;
    return CLI_OK;
}

/* Shows a batch's progress as a part of the file. */
static int32_t report_progress(void *user, const char *stage, double fraction) {
    const query_work *work = user;
    return work->shading.run.progress(work->shading.run.user, stage, work->begin + work->share * fraction);
}

static int answer_batch(query_work *work, const cli_points *points) {
    const double start = vshi_seconds();
    const vshi_source *source = &work->reader.table.source;
    const double done = source->size > 0 ? (double)source->taken / (double)source->size : 1.0;
    work->begin = source->size > 0 ? work->begin + work->share : 0.0;
    work->share = fmin(done, 1.0) - work->begin;
    vsh_run run = work->shading.run;
    run.progress = report_progress;
    run.user = work;
    const vsh_points view = {points->count, points->positions, points->normals, points->texels};
    vsh_error error;
    const vsh_result result = vsh_query_points(work->query, &view, NULL, &run, &work->answers.output,
                                               &work->shading.stats.shade, &error);
    cli_stats_stage(&work->shading.stats, CLI_STAGE_BAKE, start);
    return cli_check_result(result, &error);
}

static int answer_rows(query_work *work, size_t most_kept, cli_points *points, cli_points_writer *writer) {
    for (;;) {
        double start = vshi_seconds();
        CLI_TRY(cli_points_read(&work->reader, most_kept, points));
        cli_stats_stage(&work->shading.stats, CLI_STAGE_LOAD, start);
        if (points->count == 0) {
            break;
        }
        CLI_TRY(answer_batch(work, points));
        start = vshi_seconds();
        CLI_TRY(cli_points_write(writer, points));
        cli_stats_stage(&work->shading.stats, CLI_STAGE_WRITE, start);
    }
    const double start = vshi_seconds();
    CLI_TRY(cli_points_writer_commit(writer, &work->reader));
    cli_stats_stage(&work->shading.stats, CLI_STAGE_WRITE, start);
    work->shading.stats.points = work->reader.table.rows;
    work->shading.stats.bad_rows = work->reader.bad;
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
static int choose_answers(query_work *work, const char *why) {
    const query_settings *s = work->settings;
    query_answers *a = &work->answers;
    vsh_scene *scene = work->shading.scene;
    if (scene->ao && !work->reader.has_normals) {
        if (cli_patch_has(&s->bake.patch, "--ao")) {
            return cli_usage("%s: no normals, which --ao needs%s%s", work->reader.table.source.name,
                             why[0] != '\0' ? ": " : "", why);
        }
        cli_warn("%s: the points have no normals, so AO is left out", work->reader.table.source.name);
        scene->ao = 0;
    }
    *a = (query_answers){.lights = scene->light_count,
                         .light = scene->lights,
                         .ao = scene->ao != 0,
                         .distance = s->distance,
                         .gradient = s->gradient};
    a->shadow_error = scene->error && scene->light_count > 0 &&
                      (vsh_shadow_method_traits(scene->shade.method) & VSH_METHOD_RAYS) != 0;
    a->ao_error =
        scene->error && scene->ao && (vsh_ao_method_traits(scene->shade.ao_method) & VSH_METHOD_RAYS) != 0;
    if (count_floats(a) == 0) {
        return cli_usage(
            "%s: nothing to answer: no lights and no ao; give --sun, --ao, --distance or --gradient",
            s->bake.input);
    }
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
        shade.ao_method = VSH_AO_AUTO; /* not asked for, and it may need triangles that are not there */
    }
    vsh_error error;
    return cli_check_result(vsh_query_create(work->shading.occluders, scene->lights, scene->light_count,
                                             &shade, &work->query, &error),
                            &error);
}

static void say_results(const query_work *work) {
    const cli_stats *stats = &work->shading.stats;
    if (stats->bad_rows > 0) {
        cli_say("%s: %" PRIu64 " of %" PRIu64 " rows are bad; their answers are nan",
                work->reader.table.source.name, stats->bad_rows, stats->points);
    }
    if (cli_given.quiet) {
        return;
    }
    if (stats->shade.beyond_reach > 0) {
        cli_warn("%" PRIu64 " cones are wider than the field reaches, so far shadows may be too dark; "
                 "raise --within",
                 stats->shade.beyond_reach);
    }
    cli_say("%s: %" PRIu64 " points", work->settings->bake.output, stats->points);
    cli_stats_say(stats);
}

static int run_query(const query_settings *s, vsh_scene *scene) {
    query_work work = {.settings = s, .shading = cli_shading_begin(scene, CLI_STATS_POINTS)};
    int code = CLI_OK;
    CLI_TRY_DONE(cli_points_open(s->points, s->points_format, s->normals, s->strict, &work.reader));
    vsh_error why = {VSH_OK, ""};
    if (s->normals != 0) {
        cli_points_take_faces(s->points, &work.shading.run, &work.reader, &why);
    }
    CLI_TRY_DONE(choose_answers(&work, why.message));
    CLI_TRY_DONE(make_query(&work));
    CLI_TRY_DONE(answer_points(&work));
    CLI_TRY_DONE(cli_stats_finish(&work.shading.stats, &work.shading.run, s->bake.stats));
    say_results(&work);
done:
    free(work.answers.rows.values);
    free(work.answers.rows.names);
    free(work.answers.visibility);
    free(work.answers.deviation);
    vsh_query_free(work.query);
    cli_shading_free(&work.shading);
    cli_points_close(&work.reader);
    return code;
}

static int query_main(int argc, char **argv) {
    query_settings s = {.format = -1, .points_format = -1, .normals = -1};
    CLI_TRY(cli_parse(&cli_query, argc, argv, parse_option, &s, &s.bake.input));
    CLI_TRY(cli_patch_check(&s.bake.patch));
    CLI_TRY(find_formats(&s));
    int code;
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    CLI_TRY_DONE(check_files(&s, &made.scene));
    cli_signals_watch();
    code = run_query(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}
