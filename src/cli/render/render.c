/* vdbshade render: pictures of a scene, to look at what bake makes of it. */
#include "render.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/message.h"
#include "cli/options.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/stats.h"
#include "cli/temporary.h"
#include "cli/warnings.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    KEY_CAMERA = 0x2000,
    KEY_LOOK_AT,
    KEY_UP,
    KEY_FOV,
    KEY_ORBIT,
    KEY_SIZE,
    KEY_SAMPLES,
    KEY_SKY,
    KEY_BACKGROUND,
    KEY_EXPOSURE,
    KEY_SHAFTS,
    KEY_SHAFT_STEPS,
    KEY_LIGHTMAP,
    KEY_LIGHTMAP_PACK,
    KEY_STATS
};

static const cli_option options[] = {
    {0, NULL, NULL, "Picture"},
    {'o', "output", "OUT",
     "image to write: .exr has linear R G B, A, Z and N.X N.Y\nN.Z; others are sRGB of 8 bits"},
    {KEY_SIZE, "size", "W[xH]", "pixels, 1 to 16384 (1280x720)"},
    {KEY_SAMPLES, "samples", "N", "N x N rays a pixel, 1 to 16 (3)"},
    {KEY_EXPOSURE, "exposure", "STOPS", "colours of 8-bit pictures times 2^STOPS, -20 to 20 (0)"},
    {KEY_STATS, "stats", "FILE.json", "write times, counts and peak memory as JSON"},
    {0, NULL, NULL, "Camera"},
    {KEY_CAMERA, "camera", "X,Y,Z", "where it stands (where all casters are in view)"},
    {KEY_LOOK_AT, "look-at", "X,Y,Z", "the point it looks at (the middle of the casters' box)"},
    {KEY_UP, "up", "X,Y,Z", "the way up (0,1,0)"},
    {KEY_FOV, "fov", "DEG", "angle over the picture's height, 0.1 to 170 (35)"},
    {KEY_ORBIT, "orbit", "DEG", "turn it so far around what it looks at (0)"},
    {0, NULL, NULL, "Light"},
    CLI_LIGHT_OPTIONS,
    {KEY_SKY, "sky", "R,G,B",
     "light of the open sky, linear (the scene's ambient, or\n0.3,0.3,0.3; 1,1,1 where there are no lights)"},
    {KEY_BACKGROUND, "background", "R,G,B", "where nothing is, linear (0.1,0.1,0.1); none:\ntransparent"},
    {KEY_SHAFTS, "shafts", "STRENGTH",
     "light shafts: thickness of a fog around the casters,\n0 to 100 (0: none; 0.3 is much)"},
    {KEY_SHAFT_STEPS, "shaft-steps", "N", "points a ray that they are taken at, 1 to 64 (8)"},
    {KEY_LIGHTMAP, "lightmap", "FILE",
     "show the receiver with this lightmap, whose values then\nstand in place of computed ones; again for "
     "the "
     "scene's\nnext receivers"},
    {KEY_LIGHTMAP_PACK, "lightmap-pack", "PACK",
     "the channels of lightmaps that do not name them, as\n--pack of bake: \"R=shadow.sun,G=ao\""},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

static int render_main(int argc, char **argv);

const cli_command cli_render = {
    "render",
    "INPUT -o OUT [options]",
    "Draws a picture of INPUT, a mesh file, a level set (FILE.vdb, FILE.vdb:GRID) or a scene (.json),\n"
    "with the shadows and AO that bake would give: for looking at a scene or a lightmap. No materials but\n"
    "a caster's color; docs/render.md says more. Numbers in brackets are the defaults.",
    options,
    sizeof options / sizeof options[0],
    render_main};

static int parse_background(render_settings *s, const char *name, const char *value) {
    s->transparent = strcmp(value, "none") == 0;
    if (s->transparent) {
        memset(s->background, 0, sizeof s->background);
        return CLI_OK;
    }
    return cli_parse_color(name, value, s->background);
}

static int add_lightmap(render_settings *s, const char *value) {
    if (s->lightmap_count == RENDER_MOST_LIGHTMAPS) {
        return cli_usage("--lightmap '%s': at most %d are taken", value, RENDER_MOST_LIGHTMAPS);
    }
    s->lightmaps[s->lightmap_count++] = value;
    return CLI_OK;
}

static int parse_option(void *settings, int key, const char *name, const char *value) {
    render_settings *s = settings;
    switch (key) {
    case 'o':
        s->bake.output = value;
        return CLI_OK;
    case KEY_STATS:
        s->bake.stats = value;
        return CLI_OK;
    case KEY_CAMERA:
        s->has_camera = true;
        return cli_parse_point(name, value, s->camera);
    case KEY_LOOK_AT:
        s->has_look_at = true;
        return cli_parse_point(name, value, s->look_at);
    case KEY_UP:
        return cli_parse_vector(name, value, s->up);
    case KEY_FOV:
        return cli_parse_number(name, value, 0.1, 170.0, &s->fov_deg);
    case KEY_ORBIT:
        return cli_parse_number(name, value, -1e6, 1e6, &s->orbit_deg);
    case KEY_SIZE:
        return cli_parse_size(name, value, &s->width, &s->height);
    case KEY_SAMPLES:
        return cli_parse_integer(name, value, 1, 16, &s->samples);
    case KEY_SKY:
        s->has_sky = true;
        return cli_parse_color(name, value, s->sky);
    case KEY_BACKGROUND:
        return parse_background(s, name, value);
    case KEY_EXPOSURE:
        return cli_parse_number(name, value, -20.0, 20.0, &s->exposure);
    case KEY_SHAFTS:
        return cli_parse_number(name, value, 0.0, 100.0, &s->shafts);
    case KEY_SHAFT_STEPS:
        return cli_parse_integer(name, value, 1, 64, &s->shaft_steps);
    case KEY_LIGHTMAP:
        return add_lightmap(s, value);
    case KEY_LIGHTMAP_PACK:
        s->pack = value;
        return CLI_OK;
    default:
        return cli_shared_parse(&s->bake, key, name, value);
    }
}

/* --- the picture and its file */

/* Floats of a pixel: colour, alpha, depth, normal; and R, G, B, A of a file of 8 bits. */
enum { FLOATS = 8, ENCODED = 4 };
/* Planes of a file of floats that are made of colour and normal. */
enum { PLANES = 6 };

static const char *const plane_names[FLOATS] = {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z"};

/* Formats of floats have linear values; all others are for the eye. */
static bool is_linear(const char *path) {
    return cli_has_ending_of(path, "exr hdr rgbe");
}

static uint64_t count_picture_bytes(const render_settings *s) {
    const uint64_t pixels = (uint64_t)s->width * (uint64_t)s->height;
    return pixels * (FLOATS + ENCODED + (is_linear(s->bake.output) ? PLANES : 0)) * sizeof(float);
}

static vsh_picture view_picture(float *memory, size_t pixels) {
    return (vsh_picture){.color = memory,
                         .alpha = memory + 3 * pixels,
                         .depth = memory + 4 * pixels,
                         .normal = memory + 5 * pixels};
}

static int write_image(const render_settings *s, int32_t channels, const float *const *planes,
                       const cli_provenance *origin) {
    const vsh_image image = {s->width, s->height, channels, plane_names, planes, NULL};
    const bool linear = is_linear(s->bake.output);
    vsh_image_options wanted = vsh_image_options_default();
    wanted.bits = linear ? 0 : 8;
    wanted.color_space = linear ? VSH_COLOR_AUTO : VSH_COLOR_ENCODED;
    wanted.attributes = origin->attributes;
    wanted.attribute_count = origin->count;
    vsh_error error;
    return vsh_image_write(s->bake.output, &image, &wanted, &error) == VSH_OK ? CLI_OK : cli_fail(&error);
}

/* Splits the triples of colour and normal into the planes of a file. */
static int write_linear(const render_settings *s, const vsh_picture *p, const cli_provenance *origin) {
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    float *memory = malloc(PLANES * pixels * sizeof *memory);
    if (memory == NULL) {
        return cli_out_of_memory("picture");
    }
    for (size_t i = 0; i < pixels; ++i) {
        for (size_t c = 0; c < 3; ++c) {
            memory[c * pixels + i] = p->color[3 * i + c];
            memory[(3 + c) * pixels + i] = p->normal[3 * i + c];
        }
    }
    const float *planes[FLOATS] = {memory,   memory + pixels,     memory + 2 * pixels, p->alpha,
                                   p->depth, memory + 3 * pixels, memory + 4 * pixels, memory + 5 * pixels};
    const int code = write_image(s, cli_has_ending(s->bake.output, "exr") ? FLOATS : 4, planes, origin);
    free(memory);
    return code;
}

static int write_encoded(const render_settings *s, const vsh_picture *p, float *encoded,
                         const cli_provenance *origin) {
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    float *planes[ENCODED];
    for (size_t c = 0; c < ENCODED; ++c) {
        planes[c] = encoded + c * pixels;
    }
    vsh_error error;
    if (vsh_picture_encode(p, s->width, s->height, s->exposure, planes, s->transparent ? planes[3] : NULL,
                           &error) != VSH_OK) {
        return cli_fail(&error);
    }
    return write_image(s, s->transparent ? 4 : 3, (const float *const *)planes, origin);
}

/* --- checks */

static int check_output(const render_settings *s) {
    const char *path = s->bake.output;
    for (size_t i = 0; i < s->lightmap_count; ++i) {
        if (cli_same_file(path, s->lightmaps[i])) {
            return cli_usage("%s: the output is also a lightmap", path);
        }
    }
    if (s->bake.stats != NULL && cli_same_file(path, s->bake.stats)) {
        return cli_usage("%s: both the output and the --stats file", path);
    }
    const bool linear = is_linear(path);
    const vsh_image image = {s->width, s->height, s->transparent || linear ? 4 : 3, plane_names, NULL, NULL};
    vsh_image_options wanted = vsh_image_options_default();
    wanted.bits = linear ? 0 : 8;
    vsh_error error;
    return vsh_image_check(path, &image, &wanted, &error) == VSH_OK ? cli_temporary_check(path)
                                                                    : cli_fail(&error);
}

/* Refuses options that contradict each other, and an output that no picture can go to. */
static int check_options(const render_settings *s) {
    if (s->bake.output == NULL) {
        return cli_usage("render: no output; give -o OUT");
    }
    if (s->has_look_at && !s->has_camera) {
        return cli_usage("--look-at: there is no --camera");
    }
    if (s->transparent && s->shafts > 0.0) {
        return cli_usage("--background none: not with --shafts, which lie before it");
    }
    if (s->pack != NULL && s->lightmap_count == 0) {
        return cli_usage("--lightmap-pack: there is no --lightmap");
    }
    if (s->width > VSH_MAX_PICTURE_SIZE || s->height > VSH_MAX_PICTURE_SIZE) {
        return cli_usage("--size %dx%d: expected at most %d pixels a side", s->width, s->height,
                         VSH_MAX_PICTURE_SIZE);
    }
    if (s->has_camera && s->has_look_at) {
        vsh_camera camera = vsh_camera_default();
        memcpy(camera.position, s->camera, sizeof camera.position);
        memcpy(camera.target, s->look_at, sizeof camera.target);
        memcpy(camera.up, s->up, sizeof camera.up);
        vsh_error error;
        if (vsh_camera_check(&camera, &error) != VSH_OK) {
            return cli_fail(&error);
        }
    }
    return check_output(s);
}

static int parse(int argc, char **argv, render_settings *s, bool *help) {
    const vsh_render_options defaults = vsh_render_options_default();
    /* grey sky and background, so that no light or shadow looks coloured */
    *s = (render_settings){.bake.common = cli_common_default(),
                           .up = {0.0, 1.0, 0.0},
                           .fov_deg = 35.0,
                           .width = defaults.width,
                           .height = defaults.height,
                           .samples = defaults.samples,
                           .shaft_steps = defaults.shaft_steps,
                           .sky = {0.3, 0.3, 0.3},
                           .background = {0.1, 0.1, 0.1}};
    CLI_TRY(cli_parse(&cli_render, argc, argv, parse_option, s, "INPUT", &s->bake.input, help));
    if (*help) {
        return CLI_OK;
    }
    CLI_TRY(cli_patch_check(&s->bake.patch));
    return check_options(s);
}

/* Refuses what the scene tells before its files are read. */
static int check_files(const render_settings *s, const vsh_scene *scene) {
    const char *const outputs[] = {s->bake.output, s->bake.stats};
    for (size_t i = 0; i < 2 && outputs[i] != NULL; ++i) {
        CLI_TRY(cli_bake_check_output(&s->bake, scene, outputs[i]));
        CLI_TRY(cli_bake_check_inputs(&s->bake, scene, &outputs[i], 1));
    }
    if (scene->light_count == 0 && !scene->ao && s->lightmap_count == 0) {
        return cli_usage("%s: no lights and no ao; give --sun X,Y,Z or --ao DISTANCE, or both",
                         s->bake.input);
    }
    const uint64_t limit = s->bake.common.memory_limit, bytes = count_picture_bytes(s);
    if (limit > 0 && bytes > limit) {
        char all[32], most[32];
        cli_say("%s: a picture of %d × %d needs %s, over the memory limit of %s", s->bake.output, s->width,
                s->height, vshi_bytes_text(bytes, all, sizeof all),
                vshi_bytes_text(limit, most, sizeof most));
        return CLI_LIMIT;
    }
    return CLI_OK;
}

/* --- the command */

typedef struct render_work {
    const render_settings *settings;
    vsh_scene *scene;
    vsh_run run;
    vsh_assets *assets;
    vsh_occluders *occluders;
    render_shown shown;
    vsh_render_options options;
    cli_provenance origin;
    float *memory; /* of the picture */
    cli_stats stats;
} render_work;

static int load(render_work *work) {
    const double start = vshi_seconds();
    vsh_error error;
    CLI_TRY(cli_check_result(vsh_assets_load(work->scene, &work->run, &work->assets, &error), &error));
    CLI_TRY(render_read_lightmaps(work->settings, work->scene, work->assets, &work->run, &work->shown));
    cli_stats_stage(&work->stats, CLI_STAGE_LOAD, start);
    return CLI_OK;
}

static int make_occluders(render_work *work) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = render_shows_fields(work->scene, work->assets);
    vsh_error error;
    CLI_TRY(cli_check_result(
        vsh_scene_occluders(work->scene, work->assets, &what, &work->run, &work->occluders, &error), &error));
    vsh_occluders_info casters;
    vsh_occluders_get_info(work->occluders, &casters);
    cli_stats_casters(&work->stats, work->scene, &casters);
    const double start = vshi_seconds();
    const int code = render_add_casters(work->scene, work->assets, work->occluders, &work->run, &work->shown);
    cli_stats_stage(&work->stats, CLI_STAGE_FIELD, start);
    return code;
}

static int set_options(render_work *work) {
    const render_settings *s = work->settings;
    vsh_render_options *o = &work->options;
    *o = vsh_render_options_default();
    o->width = s->width;
    o->height = s->height;
    o->samples = s->samples;
    o->ao = work->scene->ao;
    memcpy(o->sky, s->has_sky || !work->scene->has_ambient ? s->sky : work->scene->ambient, sizeof o->sky);
    for (int c = 0; c < 3 && work->scene->light_count == 0 && !s->has_sky && !work->scene->has_ambient; ++c) {
        o->sky[c] = 1.0; /* all the light there is */
    }
    o->tint = work->scene->tint;
    memcpy(o->background, s->background, sizeof o->background);
    o->shafts = s->shafts;
    o->shaft_steps = s->shaft_steps;
    o->shade = work->scene->shade;
    if (!work->scene->ao) {
        o->shade.ao_method = VSH_AO_AUTO; /* no rays are cast: exact may lack its triangles */
    }
    o->lit = work->shown.lit;
    o->lit_count = work->shown.lit_count;
    return render_place_camera(s, &work->shown, &o->camera);
}

/* The file of a message that begins with "lightmap N: ", as vsh_render() counts them; else NULL. */
static const char *lightmap_named(const render_settings *s, const char *message) {
    size_t index;
    return sscanf(message, "lightmap %zu: ", &index) == 1 && index < s->lightmap_count ? s->lightmaps[index]
                                                                                       : NULL;
}

static int draw_picture(render_work *work) {
    const render_settings *s = work->settings;
    const render_shown *shown = &work->shown;
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    work->memory = calloc(pixels * (FLOATS + ENCODED), sizeof *work->memory);
    if (work->memory == NULL) {
        return cli_out_of_memory("picture");
    }
    const vsh_picture picture = view_picture(work->memory, pixels);
    double start = vshi_seconds();
    vsh_error error;
    const vsh_result result = vsh_render(shown->surfaces, shown->count, work->occluders, work->scene->lights,
                                         work->scene->light_count, &work->options, &work->run, &picture,
                                         &work->stats.shade, &error);
    start = cli_stats_stage(&work->stats, CLI_STAGE_BAKE, start);
    if (result != VSH_OK) {
        return cli_fail_of(lightmap_named(s, error.message), &error);
    }
    work->stats.points += (uint64_t)pixels * (uint64_t)(s->samples * s->samples);
    const int code = is_linear(s->bake.output)
                         ? write_linear(s, &picture, &work->origin)
                         : write_encoded(s, &picture, work->memory + FLOATS * pixels, &work->origin);
    cli_stats_stage(&work->stats, CLI_STAGE_WRITE, start);
    return code;
}

/* Lightmaps and the file of --lights are inputs too. */
static int find_origin(render_work *work) {
    const render_settings *s = work->settings;
    const char *files[2 + RENDER_MOST_LIGHTMAPS] = {s->bake.input, cli_bake_lights(&s->bake)};
    memcpy(files + 2, s->lightmaps, s->lightmap_count * sizeof *files);
    return cli_provenance_make(work->scene, files, 2 + s->lightmap_count, &work->stats.casters, &work->run,
                               &work->origin);
}

static void say_results(const render_work *work) {
    const render_settings *s = work->settings;
    if (s->bake.common.quiet) {
        return;
    }
    if (work->stats.shade.unfinished > 0) {
        cli_warn("%" PRIu64 " rays ran out of steps; use larger voxels", work->stats.shade.unfinished);
    }
    const double *at = work->options.camera.position, *to = work->options.camera.target;
    cli_say("%s: %d × %d, camera %.5g,%.5g,%.5g looking at %.5g,%.5g,%.5g", s->bake.output, s->width,
            s->height, at[0], at[1], at[2], to[0], to[1], to[2]);
    cli_stats_say(&work->stats);
}

static int run_render(const render_settings *s, vsh_scene *scene) {
    render_work work = {.settings = s, .scene = scene, .run = cli_common_run(&s->bake.common)};
    work.run.memory_held += count_picture_bytes(s);
    work.stats = cli_stats_begin(CLI_STATS_POINTS, work.run.threads);
    int code;
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(make_occluders(&work));
    CLI_TRY_DONE(set_options(&work));
    CLI_TRY_DONE(find_origin(&work));
    CLI_TRY_DONE(draw_picture(&work));
    CLI_TRY_DONE(cli_stats_finish(&work.stats, &work.run, s->bake.stats));
    say_results(&work);
done:
    free(work.memory);
    cli_provenance_free(&work.origin);
    render_free_shown(&work.shown);
    vsh_occluders_free(work.occluders);
    vsh_assets_free(work.assets);
    return code;
}

static int render_main(int argc, char **argv) {
    render_settings s;
    bool help;
    int code = parse(argc, argv, &s, &help);
    if (code != CLI_OK || help) {
        return code;
    }
    cli_progress_begin(s.bake.common.progress, s.bake.common.quiet);
    cli_bake_scene made;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    if (s.lightmap_count > 0) {
        CLI_TRY_DONE(cli_bake_scene_receivers(&s.bake, &made));
    }
    CLI_TRY_DONE(check_files(&s, &made.scene));
    cli_signals_watch();
    code = run_render(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    cli_progress_end();
    return code;
}
