/* vdbshade flat: light maps of a plane, for 2D games. */
#include "base/memory.h"
#include "cli.h"

typedef struct flat_settings {
    const char *input, *output, *stats;
} flat_settings;

static const cli_option options[] = {
    {.help = "Output"},
    {"output", "OUT", "image to write; formats as of bake (the scene's)",
     CLI_VALUE(TEXT, flat_settings, output)},
    {CLI_SETTINGS(VSH_SETTINGS_FLAT_IMAGE)},
    CLI_STATS_OPTION(flat_settings, stats),
    {.help = "Texels"},
    {CLI_SETTINGS(VSH_SETTINGS_FLAT_TEXELS)},
    CLI_COMMON_OPTIONS,
};

/* A flat scene, its files and its image. */
typedef struct flat_work {
    const flat_settings *settings;
    const vsh_flat_scene *scene;
    const char **files; /* [file_count]: the scene's file, then those of its casters */
    size_t file_count;
    const char *
        *names; /* [plane_count], as the next two: irradiance.R, .G and .B, then the shadows, then A */
    vsh_channel_kind *holds;
    float **planes; /* in one piece of memory */
    size_t plane_count;
    vsh_image image;
    vsh_image_options options;
    cli_stats stats;
} flat_work;

static void describe_image(flat_work *w) {
    const vsh_flat_scene *scene = w->scene;
    w->plane_count = scene->light_count + 4;
    w->names = calloc(w->plane_count, sizeof *w->names);
    w->holds = calloc(w->plane_count, sizeof *w->holds);
    w->planes = calloc(w->plane_count, sizeof *w->planes);
    for (size_t i = 0; i < w->plane_count; ++i) {
        w->holds[i] = i < 3 ? VSH_CHANNEL_LIGHT : w->holds[i];
        w->names[i] = i < 3                    ? cli_keep_text("irradiance.%c", "RGB"[i])
                      : i + 1 < w->plane_count ? cli_keep_text("shadow.%s", scene->lights[i - 3].name)
                                               : "A";
    }
    w->image = (vsh_image){scene->options.width,
                           scene->options.height,
                           (int32_t)w->plane_count,
                           w->names,
                           (const float *const *)w->planes,
                           w->holds};
    w->options = vsh_image_options_default();
    w->options.bits = scene->bits;
    w->options.pack = scene->pack;
    w->options.color_space = scene->color_space;
}

static int allocate_planes(flat_work *w) {
    const size_t texels = (size_t)w->image.width * (size_t)w->image.height;
    const double bytes = (double)texels * sizeof(float) * (double)w->plane_count;
    CLI_TRY(cli_check(vshi_check_limit(&cli_run, bytes, w->scene->output, &cli_error)));
    w->planes[0] = calloc(texels * w->plane_count, sizeof(float));
    for (size_t i = 1; i < w->plane_count; ++i) {
        w->planes[i] = w->planes[0] + i * texels;
    }
    return CLI_OK;
}

/* Writes the image, and warns if light over 1 was cut. */
static int write_image(flat_work *w, const cli_provenance *origin) {
    const char *output = w->scene->output;
    vsh_image_clipping cut;
    w->options.attributes = origin->attributes;
    w->options.attribute_count = origin->count;
    w->options.clipping = &cut;
    CLI_TRY(cli_check(vsh_image_write(output, &w->image, &w->options, &cli_error)));
    if (cut.clipped > 0) {
        cli_warn(
            "%s: %.3g %% of the texels are brighter than 1, up to %.3g, and cut to 1; write .exr, or floats "
            "(--bits 32) where the format has them, or dim the lights",
            output, 100.0 * (double)cut.clipped / (double)cut.texels, (double)cut.largest);
    }
    return CLI_OK;
}

static int bake(flat_work *w) {
    const vsh_flat_scene *scene = w->scene;
    cli_provenance origin;
    const vsh_flat_map map = {w->planes + 3, w->planes, w->planes[w->plane_count - 1]};
    CLI_TRY(cli_check_input(vsh_flat_bake(scene, &cli_run, &map, &cli_error)));
    cli_stats_lap(&w->stats, CLI_STAGE_BAKE);
    CLI_TRY(cli_begin_writing());
    int code = cli_provenance_make(NULL, w->files, w->file_count, NULL, &origin);
    code = code == CLI_OK ? write_image(w, &origin) : code;
    cli_provenance_free(&origin);
    cli_stats_lap(&w->stats, CLI_STAGE_WRITE);
    return code;
}

static int run_flat(flat_work *w) {
    const flat_settings *s = w->settings;
    const vsh_flat_scene *scene = w->scene;
    const char *const outputs[] = {scene->output, s->stats};
    w->stats = cli_stats_begin(CLI_STATS_TEXELS);
    w->stats.texels = (uint64_t)scene->options.width * (uint64_t)scene->options.height;
    w->files = calloc(1 + scene->caster_count, sizeof *w->files);
    w->files[w->file_count++] = s->input;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        w->files[w->file_count++] = scene->casters[i].path;
    }
    describe_image(w);
    CLI_TRY(cli_check_apart(outputs, CLI_COUNT(outputs), w->files, w->file_count, NULL));
    CLI_TRY(s->output == NULL ? cli_check_links(s->input, scene->output) : CLI_OK);
    CLI_TRY(s->stats != NULL ? cli_temporary_check(s->stats) : CLI_OK);
    CLI_TRY(cli_check(vsh_image_check(scene->output, &w->image, &w->options, &cli_error)));
    CLI_TRY(allocate_planes(w));
    cli_signals_watch();
    CLI_TRY(bake(w));
    CLI_TRY(cli_stats_finish(&w->stats, s->stats));
    const double *seconds = w->stats.seconds;
    cli_inform("%s: %d × %d, %zu light%s; load %.2f s, bake %.2f s, write %.2f s", scene->output,
               scene->options.width, scene->options.height, scene->light_count,
               scene->light_count == 1 ? "" : "s", seconds[CLI_STAGE_LOAD], seconds[CLI_STAGE_BAKE],
               seconds[CLI_STAGE_WRITE]);
    return CLI_OK;
}

static int flat_main(int argc, char **argv) {
    flat_settings s = {.output = NULL};
    CLI_TRY(cli_parse(&cli_flat, argc, argv, &s, &s.input));
    vsh_flat_scene *scene = NULL;
    CLI_TRY(cli_check(vsh_flat_scene_read(s.input, &cli_run, &scene, &cli_error)));
    scene->output = s.output != NULL ? s.output : scene->output;
    flat_work work = {.settings = &s, .scene = scene};
    int code = cli_apply_settings(VSH_SETTING_OF_FLAT, scene);
    if (scene->output == NULL) {
        code = cli_usage("%s: no output; give -o OUT", s.input);
    }
    code = code == CLI_OK ? run_flat(&work) : code;
    if (work.planes != NULL) {
        free(work.planes[0]);
    }
    free(work.planes);
    free(work.holds);
    free(work.names);
    free(work.files);
    vsh_flat_scene_free(scene);
    return code;
}

const cli_command cli_flat = {
    "flat", "SCENE.json -o OUT [options]", "light map of a plane, for 2D games",
    "Bakes a light map of a plane, for 2D games: the visible share of each light, with soft shadows of\n"
    "shapes, images and text, the irradiance by all lights, and where solids are. The scene's file is of\n"
    "its own kind: docs/flat.md. Numbers in brackets are defaults; the scene can set others.",
    CLI_ENDING(options, flat_main)};
