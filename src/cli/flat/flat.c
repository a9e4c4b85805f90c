/* vdbshade flat: light maps of a plane, for 2D games. */
#include "base/clock.h"
#include "base/memory.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/patch.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/temporary.h"
#include "cli/warnings.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct flat_settings {
    const char *input, *output, *stats;
    cli_patch patch; /* over the scene */
} flat_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(flat_settings, output), "output", "OUT", "image to write; formats as of bake (the scene's)"},
    CLI_SETTINGS(VSH_SETTINGS_FLAT_IMAGE),
    CLI_STATS_OPTION(flat_settings, stats),
    {0, NULL, NULL, "Texels"},
    CLI_SETTINGS(VSH_SETTINGS_FLAT_TEXELS),
    CLI_COMMON_OPTIONS,
};

static int take(void *settings, int key, const char *name, const char *value) {
    return cli_patch_take(&((flat_settings *)settings)->patch, key, name, value);
}

/* --- channels: irradiance.R, .G and .B, then the shadows, then A */

typedef struct flat_planes {
    const char **names;
    int32_t *holds;
    float **planes; /* [count], in one piece of memory */
    size_t count;
    vsh_image image;
} flat_planes;

static void name_planes(const vsh_flat_scene *scene, flat_planes *p) {
    p->count = scene->light_count + 4;
    p->names = calloc(p->count, sizeof *p->names);
    p->holds = calloc(p->count, sizeof *p->holds);
    p->planes = calloc(p->count, sizeof *p->planes);
    for (size_t i = 0; i < p->count; ++i) {
        if (i < 3) {
            p->names[i] = cli_keep_text("irradiance.%c", "RGB"[i]);
            p->holds[i] = VSH_CHANNEL_LIGHT;
        } else if (i + 1 < p->count) {
            p->names[i] = cli_keep_text("shadow.%s", scene->lights[i - 3].name);
        } else {
            p->names[i] = "A";
        }
    }
    p->image = (vsh_image){scene->options.width,
                           scene->options.height,
                           (int32_t)p->count,
                           p->names,
                           (const float *const *)p->planes,
                           p->holds};
}

static int allocate_planes(const vsh_flat_scene *scene, const vsh_image_options *image, const vsh_run *run,
                           flat_planes *p) {
    const size_t texels = (size_t)scene->options.width * (size_t)scene->options.height;
    const double bytes = (double)texels * sizeof(float) * (double)p->count +
                         (double)vsh_image_writer_bytes(scene->output, &p->image, image);
    vsh_error error;
    CLI_TRY(cli_check(vshi_check_limit(run, bytes, scene->output, &error), &error));
    p->planes[0] = calloc(texels * p->count, sizeof(float));
    for (size_t i = 1; i < p->count; ++i) {
        p->planes[i] = p->planes[0] + i * texels;
    }
    return CLI_OK;
}

static void free_planes(flat_planes *p) {
    free(p->planes[0]);
    free(p->planes);
    free(p->holds);
    free(p->names);
}

/* --- the work */

static int check_output(const flat_settings *s, const vsh_flat_scene *scene, const char *output) {
    CLI_TRY(cli_check_apart(output, s->input, "the input"));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        CLI_TRY(cli_check_apart(output, scene->casters[i].path, "also a caster's file"));
    }
    return CLI_OK;
}

/* What can be refused before anything is read. */
static int check_files(const flat_settings *s, const vsh_flat_scene *scene, const vsh_image *image,
                       const vsh_image_options *options_of_image) {
    CLI_TRY(check_output(s, scene, scene->output));
    if (s->output == NULL) {
        CLI_TRY(cli_check_links(s->input, scene->output));
    }
    if (s->stats != NULL) {
        if (cli_same_file(scene->output, s->stats)) {
            return cli_usage("%s: both the output and the --stats file", s->stats);
        }
        CLI_TRY(check_output(s, scene, s->stats));
        CLI_TRY(cli_temporary_check(s->stats));
    }
    vsh_error error;
    return cli_check(vsh_image_check(scene->output, image, options_of_image, &error), &error);
}

/* Inputs are the scene's file and those that it names. */
static int make_origin(const flat_settings *s, const vsh_flat_scene *scene, const vsh_run *run,
                       cli_provenance *origin) {
    const size_t count = 1 + scene->caster_count;
    const char **files = calloc(count, sizeof *files);
    *origin = (cli_provenance){.count = 0};
    files[0] = s->input;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        files[1 + i] = scene->casters[i].path;
    }
    const int code = cli_provenance_make(NULL, files, count, NULL, run, origin);
    free(files);
    return code;
}

/* Writes the image, and warns where light over 1 was cut. */
static int write_map(const flat_settings *s, const vsh_flat_scene *scene, const flat_planes *planes,
                     const vsh_image_options *image, const vsh_run *run) {
    cli_provenance origin;
    vsh_image_options told = *image;
    vsh_image_writer *writer = NULL;
    vsh_image_clipping cut;
    vsh_error error;
    int code;
    CLI_TRY_DONE(make_origin(s, scene, run, &origin));
    told.attributes = origin.attributes;
    told.attribute_count = origin.count;
    if (vsh_image_writer_create(scene->output, &planes->image, &told, &writer, &error) != VSH_OK ||
        vsh_image_writer_add(writer, planes->image.height, planes->image.planes, &error) != VSH_OK ||
        vsh_image_writer_get_clipping(writer, &cut, &error) != VSH_OK) {
        vsh_image_writer_abandon(writer);
        code = cli_fail(&error);
        goto done;
    }
    CLI_TRY_DONE(cli_check(vsh_image_writer_finish(writer, &error), &error));
    if (cut.clipped > 0) {
        cli_warn(
            "%s: %.3g %% of the texels are brighter than 1, up to %.3g, and cut to 1; write .exr, or floats "
            "(--bits 32) where the format has them, or dim the lights",
            scene->output, 100.0 * (double)cut.clipped / (double)cut.texels, (double)cut.largest);
    }
done:
    cli_provenance_free(&origin);
    return code;
}

static int bake(const flat_settings *s, const vsh_flat_scene *scene, const flat_planes *planes,
                const vsh_image_options *image, const vsh_run *run, cli_stats *stats) {
    vsh_outline *casters = NULL;
    vsh_error error;
    double now = vshi_seconds();
    CLI_TRY(cli_check_result(vsh_flat_scene_casters(scene, run, &casters, &error), &error));
    now = cli_stats_stage(stats, CLI_STAGE_LOAD, now);
    const vsh_flat_map map = {planes->planes + 3, planes->planes, planes->planes[planes->count - 1]};
    const vsh_result result =
        vsh_flat_bake(casters, scene->lights, scene->light_count, &scene->options, run, &map, &error);
    now = cli_stats_stage(stats, CLI_STAGE_BAKE, now);
    vsh_outline_free(casters);
    CLI_TRY(cli_check_result(result, &error));
    CLI_TRY(cli_begin_writing());
    CLI_TRY(write_map(s, scene, planes, image, run));
    cli_stats_stage(stats, CLI_STAGE_WRITE, now);
    return CLI_OK;
}

static void say_summary(const vsh_flat_scene *scene, const cli_stats *stats) {
    const double *seconds = stats->seconds;
    cli_say("%s: %d × %d, %zu light%s; load %.2f s, bake %.2f s, write %.2f s", scene->output,
            scene->options.width, scene->options.height, scene->light_count,
            scene->light_count == 1 ? "" : "s", seconds[CLI_STAGE_LOAD], seconds[CLI_STAGE_BAKE],
            seconds[CLI_STAGE_WRITE]);
}

static int run_flat(const flat_settings *s, const vsh_flat_scene *scene, const vsh_run *run) {
    vsh_image_options image = vsh_image_options_default();
    image.bits = scene->bits;
    image.pack = scene->pack;
    image.color_space = scene->color_space;
    flat_planes planes = {.count = 0};
    cli_stats stats = cli_stats_begin(CLI_STATS_TEXELS, run->threads);
    stats.texels = (uint64_t)scene->options.width * (uint64_t)scene->options.height;
    int code;
    name_planes(scene, &planes);
    CLI_TRY_DONE(check_files(s, scene, &planes.image, &image));
    CLI_TRY_DONE(allocate_planes(scene, &image, run, &planes));
    cli_signals_watch();
    CLI_TRY_DONE(bake(s, scene, &planes, &image, run, &stats));
    CLI_TRY_DONE(cli_stats_finish(&stats, run, s->stats));
    if (!cli_given.quiet) {
        say_summary(scene, &stats);
    }
done:
    free_planes(&planes);
    return code;
}

static int flat_main(int argc, char **argv) {
    flat_settings s = {.output = NULL};
    CLI_TRY(cli_parse(&cli_flat, argc, argv, take, &s, &s.input));
    const vsh_run run = cli_make_run();
    vsh_flat_scene *scene = NULL;
    vsh_error error;
    int code;
    CLI_TRY_DONE(cli_check(vsh_flat_scene_read(s.input, &run, &scene, &error), &error));
    scene->output = s.output != NULL ? s.output : scene->output;
    if (scene->output == NULL) {
        code = cli_usage("%s: no output; give -o OUT", s.input);
        goto done;
    }
    CLI_TRY_DONE(cli_patch_flat(&s.patch, scene));
    code = run_flat(&s, scene, &run);
done:
    vsh_flat_scene_free(scene);
    return code;
}

const cli_command cli_flat = {
    "flat",
    "SCENE.json -o OUT [options]",
    "Bakes a light map of a plane, for 2D games: for each light the share of it that is seen, soft\n"
    "shadows of areas, images and text included, the irradiance by all, and where solids are. The\n"
    "scene's file is one of its own kind: docs/flat.md. Defaults are in brackets; the scene can\n"
    "set others.",
    options,
    sizeof options / sizeof options[0],
    flat_main};
