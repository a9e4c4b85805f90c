/* vdbshade bake: from files to lightmaps. */
#include "bake.h"

/* --- options */

static bool is_length(double value) {
    return value >= 1e-12 && value <= 1e12;
}

static int parse_world(void *at, const char *name, const char *value) {
    double *world = at;
    const bool both = strchr(value, ',') != NULL;
    return cli_read_numbers(value, both ? 2 : 1, world) && is_length(world[0]) &&
                   (!both || is_length(world[1]))
               ? CLI_OK
               : cli_usage("%s '%s': expected W or W,D, each from 1e-12 to 1e12", name, value);
}

int cli_parse_floor(void *at, const char *name, const char *value) {
    double *floor = at;
    const bool good =
        cli_read_numbers(value, 5, floor) || cli_read_numbers(value, 2, memset(floor, 0, 5 * sizeof *floor));
    return good && floor[0] > 0.0 && floor[0] <= 1e12 && floor[1] > 0.0 && floor[1] <= 1e12
               ? CLI_OK
               : cli_usage("%s '%s': expected W,D or W,D,X,Y,Z: sizes along x and z, above 0, and the middle",
                           name, value);
}

static int parse_shard(void *at, const char *name, const char *value) {
    enum { MOST = 10000 };
    int32_t *shard = at;
    const char *rest;
    const bool good = cli_read_integer(value, &shard[0], &rest) && *rest == '/' &&
                      cli_read_integer(rest + 1, &shard[1], &rest) && *rest == '\0';
    return good && shard[0] >= 1 && shard[0] <= shard[1] && shard[1] <= MOST
               ? CLI_OK
               : cli_usage(
                     "%s '%s': expected I/N, the number of the part and how many there are, at most %d; "
                     "1/3, for example",
                     name, value, MOST);
}

static const cli_option options[] = {
    {.help = "Most used"},
    {"output", "OUT",
     "image to write: .exr with named channels, or .png .tif .tga .bmp .hdr .ppm .jpg .webp; what each "
     "can hold, and what is not written: docs/formats.md; .glb .gltf .obj: the input with its light in its "
     "materials (docs/lit.md); FOLDER/: the outputs that a scene's file names, in that folder, which is made",
     CLI_VALUE(TEXT, cli_bake_settings, output)},
    CLI_SUN_OPTIONS,
    {"ao", CLI_SETTING},
    {"irradiance", CLI_SETTING},
    {"size", CLI_SETTING},
    {"unwrap", CLI_SETTING},
    {"per-object", NULL,
     "an image for each object: FOLDER/NAME.exr with -o FOLDER/, else OUT.NAME.exr, or where OUT has %s",
     CLI_VALUE(FLAG, cli_bake_settings, per_object)},
    {"max-error", CLI_SETTING},
    {"view", "PAGE.html", "also a page that shows the bake in a browser: docs/view.md",
     CLI_VALUE(TEXT, cli_bake_settings, view)},
    {"dry-run", NULL, "bake nothing: print texels, voxels and memory",
     CLI_VALUE(FLAG, cli_bake_settings, dry_run)},
    {.help = "Output"},
    {CLI_SETTINGS(VSH_SETTINGS_IMAGE)},
    {"preview", NULL,
     "into a .glb or .gltf: the light as unlit base colour, which every viewer shows, instead of textures",
     CLI_VALUE(FLAG, cli_bake_settings, preview)},
    {"exr", "FILE.exr", "also an EXR of all channels beside a .glb or .gltf",
     CLI_VALUE(TEXT, cli_bake_settings, exr)},
    {"invalid", "FILE.png",
     "also a picture of the lightmap: charts grey, texels inside solids or behind walls red; "
     "FILE.N.OUT.png if there are several outputs",
     CLI_VALUE(TEXT, cli_bake_settings, invalid_picture)},
    CLI_STATS_OPTION(cli_bake_settings, stats),
    {"shard", "I/N",
     "bake part I of N into OUT.I-of-N.part: on any machine, in any order, again where it failed; 'vdbshade "
     "merge OUT' joins all parts to the bits of one bake",
     CLI_PARSED(cli_bake_settings, shard, parse_shard)},
    {.help = "Light and occlusion"},
    CLI_LAMP_OPTIONS,
    {CLI_SETTINGS(VSH_SETTINGS_CHANNELS)},
    CLI_ACCURACY_OPTIONS,
    {.help = "Objects"},
    {"receive", "NAME",
     "only objects of this name receive, all cast; * and ? match as in a shell; may be repeated",
     CLI_RANGE(LIST, cli_bake_settings, receive, 0, CLI_MOST_ITEMS)},
    {"no-receive", "NAME",
     "objects of this name only cast, or if there are none, those of materials of this name; may be repeated",
     CLI_RANGE(LIST, cli_bake_settings, no_receive, 0, CLI_MOST_ITEMS)},
    {"no-cast", "NAME",
     "objects of this name only receive, or if there are none, those of materials; may be repeated",
     CLI_RANGE(LIST, cli_bake_settings, no_cast, 0, CLI_MOST_ITEMS)},
    CLI_FLOOR_OPTION,
    {.help = "Terrain"},
    {"height", "H", "height of white in INPUT, an image of heights; scene units",
     CLI_RANGE(NUMBER, cli_bake_settings, height, -1e12, 1e12)},
    {"size-world", "W[,D]", "length of its longer side, or of both: along x, then along z; scene units",
     CLI_PARSED(cli_bake_settings, world, parse_world)},
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    {.help = "Texels"},
    {CLI_SETTINGS(VSH_SETTINGS_TEXELS)},
    {"density", "PATTERN=X",
     "factor of --texels-per-unit, or of the density that fits, for objects of that name; repeatable, the "
     "last matching pattern wins (1)",
     CLI_PARSED(cli_bake_settings, densities, cli_parse_density)},
    CLI_COMMON_OPTIONS,
};

int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings) {
    *settings = (cli_bake_settings){.words = (const char *const *)argv, .word_count = (size_t)argc};
    CLI_TRY(cli_parse(&cli_bake, argc, argv, settings, &settings->input));
    const size_t length = settings->output != NULL ? strlen(settings->output) : 0;
    if (length > 0 && settings->output[length - 1] == '/' && !settings->per_object &&
        cli_has_ending(settings->input, "json")) {
        settings->output_folder = cli_end_path(settings->output, "");
        settings->output = NULL;
    }
    return CLI_OK;
}

static int bake_main(int argc, char **argv) {
    cli_bake_settings settings;
    CLI_TRY(cli_bake_parse(argc, argv, &settings));
    return cli_bake_by(&settings);
}

const cli_command cli_bake = {
    "bake", "INPUT -o OUT [options]", "lightmap of a mesh or a scene (.json)",
    "Bakes soft shadows and ambient occlusion into a lightmap. INPUT is a mesh file with lightmap UVs\n"
    "(OBJ, glTF, GLB, PLY, FBX …), which casts and receives, an image of heights (with --height), or a\n"
    "scene file (.json), whose values the options override. Numbers in brackets are defaults.",
    CLI_ENDING(options, bake_main)};

/* --- checks before anything is read */

/* Refuses a path without the ending. NULL: the option was not given. */
static int check_ending(const char *option, const char *path, const char *ending) {
    return path == NULL || cli_has_ending(path, ending)
               ? CLI_OK
               : cli_usage("--%s '%s': expected a name that ends in .%s", option, path, ending);
}

/* Refuses options that are for other kinds of outputs. */
static int check_kinds(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *for_assets = s->preview ? "preview" : s->exr != NULL ? "exr" : NULL;
    const char *for_whole = s->invalid_picture != NULL ? "invalid"
                            : s->view != NULL          ? "view"
                            : s->exr != NULL           ? "exr"
                                                       : NULL;
    CLI_REFUSE_IF(s->shard[0] > 0 && for_whole != NULL,
                  "--%s: not together with --shard; give it to 'vdbshade merge'", for_whole);
    CLI_REFUSE_IF(s->merged != NULL && s->output == NULL &&
                      strcmp(s->merged, scene->receivers[0].output) != 0,
                  "%s: these are parts of %s; run 'vdbshade merge %s'", s->merged, s->input,
                  scene->receivers[0].output);
    CLI_TRY(check_ending("invalid", s->invalid_picture, "png"));
    CLI_TRY(check_ending("exr", s->exr, "exr"));
    CLI_TRY(check_ending("view", s->view, "html"));
    static const char *const of_lightmaps[] = {
        "size",    "unwrap",      "per-object", "pages", "padding", "seams", "texels-per-unit",
        "density", "supersample", "uv-set",     "exr",   "invalid"};
    size_t assets = 0, colored = 0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        assets += vsh_lit_is_output(scene->receivers[i].output) != 0;
        colored += scene->receivers[i].vertex_colors != NULL;
    }
    for (size_t i = 0; i < CLI_COUNT(of_lightmaps); ++i) {
        CLI_REFUSE_IF(colored > 0 && colored == scene->receiver_count && cli_was_given(of_lightmaps[i]),
                      "--%s: is for lightmaps, not for vertex colours", of_lightmaps[i]);
    }
    CLI_REFUSE_IF(for_assets != NULL && assets == 0, "--%s: is for outputs that end in .glb, .gltf or .obj",
                  for_assets);
    CLI_REFUSE_IF(s->exr != NULL && scene->receiver_count != 1, "--exr '%s': is for one output", s->exr);
    return CLI_OK;
}

/* Refuses a page of --view that cannot show the output. */
static int check_view(const cli_bake_settings *s, const vsh_scene *scene) {
    const vsh_receiver *receiver = &scene->receivers[0];
    const bool asset = vsh_lit_is_output(receiver->output);
    if (s->view == NULL) {
        return CLI_OK;
    }
    CLI_REFUSE_IF((s->per_object && !asset) || scene->receiver_count != 1 ||
                      receiver->type != VSH_RECEIVER_MESH,
                  "--view '%s': shows one lightmap of one mesh; 'vdbshade view' shows others", s->view);
    CLI_REFUSE_IF(!asset && (receiver->unwrap == VSH_RECEIVER_UNWRAP_AUTO ||
                             receiver->unwrap == VSH_RECEIVER_UNWRAP_ALWAYS),
                  "--view '%s': an image cannot store the new UVs; bake a .glb", s->view);
    return cli_has_ending(receiver->output, "obj")
               ? cli_usage("--view '%s': shows the light of a .glb, a .gltf or an image, not of an .obj",
                           s->view)
               : CLI_OK;
}

static int check_files(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *const others[] = {s->stats, s->exr, s->view};
    const bool makes = s->output_folder != NULL || s->per_object;
    CLI_TRY(check_kinds(s, scene));
    CLI_TRY(check_view(s, scene));
    CLI_TRY(cli_check_outputs(others, CLI_COUNT(others), NULL, 0, NULL));
    for (size_t i = 0; i < scene->receiver_count && !(makes && s->dry_run); ++i) {
        const char *output = scene->receivers[i].output;
        CLI_TRY(makes ? cli_make_folder_of(output) : cli_check_folder(output));
        if (vsh_receiver_check(scene, i, &cli_error) != VSH_OK) {
            return s->output == NULL && cli_error.code == VSH_ERROR_ARGUMENT
                       ? cli_usage("%s: receivers[%zu]: output %s", s->input, i, cli_error.message)
                       : cli_check(cli_error.code);
        }
    }
    return CLI_OK;
}

/* --- callbacks */

enum { MOST_LINES = 8 }; /* lightmaps that get a line each */

typedef struct bake_run {
    const cli_bake_settings *settings;
    const vsh_scene *scene;
    const char *parts; /* the name before ".I-of-N.part" */
    size_t count;      /* lightmaps */
    int code;          /* exit code of check_loaded() */
    bool files_known;  /* the files are read, but their warnings are not printed yet */
} bake_run;

/* Checks the outputs again: only now are the names of objects' outputs and of models' textures known. */
static int check_lightmaps(const bake_run *b, const vsh_scene_lightmap *lightmaps, size_t count) {
    const cli_bake_settings *s = b->settings;
    const char *const others[] = {s->stats, s->exr, s->view, s->invalid_picture};
    const char **outputs = calloc(count + CLI_COUNT(others), sizeof *outputs);
    size_t used = 0;
    int code;
    for (; used < count; ++used) {
        outputs[used] = lightmaps[used].output;
        CLI_TRY_DONE(cli_bake_check_output(s, outputs[used]));
    }
    for (size_t i = 0; i < CLI_COUNT(others); ++i) {
        outputs[used] = others[i];
        used += others[i] != NULL;
    }
    code = cli_check(vsh_scene_check_outputs(b->scene, outputs, used, &cli_run, &cli_error));
done:
    free(outputs);
    return code;
}

static vsh_result check_loaded(void *user, const vsh_scene_lightmap *lightmaps, size_t count,
                               vsh_error *error) {
    bake_run *b = user;
    (void)error; /* check_lightmaps() has printed it */
    b->count = count;
    b->files_known = true;
    b->code = check_lightmaps(b, lightmaps, count);
    return b->code == CLI_OK ? VSH_OK : VSH_ERROR_CANCELLED;
}

/* Prints the warnings about files before the long work. */
static int32_t report_progress(void *user, const char *stage, double fraction) {
    bake_run *b = user;
    if (b->files_known && strcmp(stage, "bake") == 0) {
        b->files_known = false;
        cli_print_warnings();
    }
    return cli_report_progress(NULL, stage, fraction);
}

static bool has_lines(const bake_run *b) {
    return b->settings->shard[0] == 0 && (b->count <= MOST_LINES || cli_given.verbose);
}

static void say_lightmap(void *user, const vsh_scene_lightmap *lightmap) {
    const bake_run *b = user;
    if (has_lines(b) && b->scene->receivers[lightmap->receiver].vertex_colors != NULL) {
        cli_inform("%s: vertex colours by %" PRIu64 " points, %" PRIu64
                   " of them hidden; RMSE between the vertices of the worst mesh %.2g",
                   lightmap->output, lightmap->covered, lightmap->invalid_texels, lightmap->vertex_error);
    } else if (has_lines(b)) {
        cli_inform("%s: %d × %d, %" PRIu64 " texels, %" PRIu64 " of them invalid", lightmap->output,
                   lightmap->width, lightmap->height, lightmap->covered, lightmap->invalid_texels);
    }
}

/* --- reports */

/* Writes the page of --view. */
static int write_view(const cli_bake_settings *s, const vsh_receiver *receiver) {
    vsh_view_bake bake = vsh_view_bake_default();
    if (s->view == NULL) {
        return CLI_OK;
    }
    if (cli_has_ending(receiver->output, "glb gltf")) {
        bake.model = receiver->output; /* contains its own light */
    } else {
        bake.model = receiver->path;
        bake.planes = (const char *const *)&receiver->output;
        bake.plane_count = 1;
        bake.uv_set = receiver->uv_set;
    }
    return cli_check_input(vsh_view_write(s->view, &bake, NULL, &cli_run, &cli_error));
}

static int report_bake(const bake_run *b, const vsh_bake_report *report) {
    const cli_bake_settings *s = b->settings;
    const vsh_scene *scene = b->scene;
    cli_stats stats = cli_stats_begin(CLI_STATS_TEXELS);
    stats.texels = report->texels;
    stats.invalid_texels = report->invalid_texels;
    stats.shade = report->shade;
    stats.errors = report->errors;
    stats.lights = scene->lights;
    stats.light_count = scene->light_count;
    stats.seconds[CLI_STAGE_LOAD] = report->load_s;
    stats.seconds[CLI_STAGE_BAKE] = report->bake_s;
    stats.seconds[CLI_STAGE_WRITE] = report->write_s;
    cli_stats_casters(&stats, scene, &report->occluders);
    cli_say_auto_ao(scene, report->ao_distance);
    cli_stats_warn(&stats, scene);
    CLI_TRY(write_view(s, &scene->receivers[0]));
    CLI_TRY(cli_stats_finish(&stats, s->stats));
    cli_print_warnings();
    if (s->shard[0] > 0) {
        cli_inform("%s.%d-of-%d.part: %" PRIu64 " texels, %" PRIu64
                   " of them invalid; 'vdbshade merge %s' once all parts are there",
                   b->parts, s->shard[0], s->shard[1], report->texels, report->invalid_texels, b->parts);
    } else if (!has_lines(b)) {
        cli_inform("%zu lightmaps: %" PRIu64 " texels, %" PRIu64 " of them invalid; --verbose lists each",
                   b->count, report->texels, report->invalid_texels);
    }
    if (b->count > 0) {
        cli_stats_say(&stats);
    }
    return CLI_OK;
}

static int print_forecast(const bake_run *b, const vsh_bake_options *how, const vsh_run *run) {
    vsh_bake_forecast f;
    const vsh_result result = vsh_forecast_scene(b->scene, how, run, &f, &cli_error);
    CLI_TRY(b->code != CLI_OK ? b->code : cli_check_input(result));
    cli_stats stats = {.of = CLI_STATS_TEXELS};
    cli_say_auto_ao(b->scene, f.ao_distance);
    cli_stats_methods(&stats, b->scene, f.has_triangles);
    printf("methods       %s\n", cli_stats_methods_text(&stats));
    printf("texels        %" PRIu64 " in %zu lightmap%s, %" PRIu64 " samples\n", f.texels, f.lightmap_count,
           f.lightmap_count == 1 ? "" : "s", f.samples);
    if (f.voxels == 0.0) {
        printf("voxels        none\n");
    } else {
        printf("voxels        about %.3g of %.4g, %.4g along the longest side\n", f.voxels, f.voxel_size,
               f.resolution);
    }
    printf("memory        about %s at most: level set %s, field %s\n", cli_bytes_text((uint64_t)f.peak_bytes),
           cli_bytes_text((uint64_t)f.grid_bytes), cli_bytes_text((uint64_t)f.field_bytes));
    return CLI_OK;
}

/* Bakes a checked scene, merges its parts, or forecasts the bake. */
static int bake_scene(const cli_bake_settings *s, const vsh_scene *scene) {
    const char *output = s->output != NULL ? s->output : scene->receivers[0].output;
    bake_run b = {.settings = s, .scene = scene};
    b.parts = s->merged != NULL ? s->merged : cli_end_path(output, ""); /* may be a folder of objects */
    vsh_run run = cli_run;
    run.progress = report_progress;
    run.user = &b;
    const char *const files[] = {s->input, cli_bake_lights(s)};
    vsh_bake_options o = vsh_bake_options_default();
    o.invalid_picture = s->invalid_picture;
    o.lit_preview = s->preview;
    o.lit_exr = s->exr;
    o.command = cli_parsed.command;
    o.files = files;
    o.file_count = s->lights != NULL ? 2 : 1;
    o.shard = s->dry_run ? 0 : s->shard[0]; /* a forecast is of the whole bake */
    o.shard_count = s->shard[1];
    o.parts = b.parts;
    o.words = s->words;
    o.word_count = s->word_count;
    o.loaded = check_loaded;
    o.done = say_lightmap;
    o.user = &b;
    if (s->dry_run) {
        return print_forecast(&b, &o, &run);
    }
    vsh_bake_report report = {.errors = calloc(scene->light_count + 2, sizeof *report.errors)};
    const vsh_result result =
        (s->merged != NULL ? vsh_merge_scene : vsh_bake_scene)(scene, &o, &run, &report, &cli_error);
    const int code = b.code != CLI_OK   ? b.code
                     : result == VSH_OK ? report_bake(&b, &report)
                                        : cli_check_input(result);
    free(report.errors);
    return code;
}

int cli_bake_by(const cli_bake_settings *settings) {
    int code;
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_make(settings, &made));
    CLI_TRY_DONE(check_files(settings, &made.scene));
    cli_signals_watch();
    code = bake_scene(settings, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}
