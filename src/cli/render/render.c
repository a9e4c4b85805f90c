/* vdbshade render: pictures of a scene, to look at what bake makes of it. */
#include "render.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
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
    KEY_LIGHTMAP
};

static const cli_option options[] = {
    {0, NULL, NULL, "Picture"},
    {CLI_TEXT(render_settings, bake.output), "output", "OUT",
     "image to write: .exr has linear R G B, A, Z and N.X N.Y\nN.Z; others are sRGB of 8 bits"},
    {KEY_SIZE, "size", "W[xH]", "pixels, 1 to 16384 (1280x720)"},
    {KEY_SAMPLES, "samples", "N", "N x N rays a pixel, 1 to 16 (3)"},
    {KEY_EXPOSURE, "exposure", "STOPS", "colours of 8-bit pictures times 2^STOPS, -20 to 20 (0)"},
    CLI_STATS_OPTION(render_settings, bake.stats),
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
     "the scene's\nnext receivers"},
    {CLI_TEXT(render_settings, pack), "lightmap-pack", "PACK",
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
    double *background = s->options.background;
    s->transparent = strcmp(value, "none") == 0;
    if (s->transparent) {
        memset(background, 0, sizeof s->options.background);
        return CLI_OK;
    }
    return cli_parse_color(name, value, background);
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
    vsh_render_options *o = &s->options;
    double degrees;
    switch (key) {
    case KEY_CAMERA:
        s->has_camera = true;
        return cli_parse_point(name, value, o->camera.position);
    case KEY_LOOK_AT:
        s->has_look_at = true;
        return cli_parse_point(name, value, o->camera.target);
    case KEY_UP:
        return cli_parse_vector(name, value, o->camera.up);
    case KEY_FOV:
        CLI_TRY(cli_parse_number(name, value, 0.1, 170.0, &degrees));
        o->camera.fov = degrees * CLI_DEGREE;
        return CLI_OK;
    case KEY_ORBIT:
        return cli_parse_number(name, value, -1e6, 1e6, &s->orbit_deg);
    case KEY_SIZE:
        return cli_parse_size(name, value, &o->width, &o->height);
    case KEY_SAMPLES:
        return cli_parse_integer(name, value, 1, 16, &o->samples);
    case KEY_SKY:
        s->has_sky = true;
        return cli_parse_color(name, value, o->sky);
    case KEY_BACKGROUND:
        return parse_background(s, name, value);
    case KEY_EXPOSURE:
        return cli_parse_number(name, value, -20.0, 20.0, &s->exposure);
    case KEY_SHAFTS:
        return cli_parse_number(name, value, 0.0, 100.0, &o->shafts);
    case KEY_SHAFT_STEPS:
        return cli_parse_integer(name, value, 1, 64, &o->shaft_steps);
    case KEY_LIGHTMAP:
        return add_lightmap(s, value);
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
    const uint64_t pixels = (uint64_t)s->options.width * (uint64_t)s->options.height;
    return pixels * (FLOATS + ENCODED + (is_linear(s->bake.output) ? PLANES : 0)) * sizeof(float);
}

static vsh_picture view_picture(float *memory, size_t pixels) {
    return (vsh_picture){.color = memory,
                         .alpha = memory + 3 * pixels,
                         .depth = memory + 4 * pixels,
                         .normal = memory + 5 * pixels};
}

/* The file's options and, but for the planes, what it holds. */
static vsh_image describe_image(const render_settings *s, vsh_image_options *as) {
    const bool linear = is_linear(s->bake.output);
    *as = vsh_image_options_default();
    as->bits = linear ? 0 : 8;
    as->color_space = linear ? VSH_COLOR_AUTO : VSH_COLOR_ENCODED;
    const int32_t channels = linear && cli_has_ending(s->bake.output, "exr") ? FLOATS
                             : linear || s->transparent                      ? 4
                                                                             : 3;
    return (vsh_image){s->options.width, s->options.height, channels, plane_names, NULL, NULL};
}

static int write_image(const render_settings *s, const float *const *planes, const cli_provenance *origin) {
    vsh_image_options as;
    vsh_image image = describe_image(s, &as);
    image.planes = planes;
    as.attributes = origin->attributes;
    as.attribute_count = origin->count;
    vsh_error error;
    return cli_check(vsh_image_write(s->bake.output, &image, &as, &error), &error);
}

/* Splits the triples of colour and normal into the planes of a file. */
static int write_linear(const render_settings *s, const vsh_picture *p, const cli_provenance *origin) {
    const size_t pixels = (size_t)s->options.width * (size_t)s->options.height;
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
    const int code = write_image(s, planes, origin);
    free(memory);
    return code;
}

static int write_encoded(const render_settings *s, const vsh_picture *p, float *encoded,
                         const cli_provenance *origin) {
    const size_t pixels = (size_t)s->options.width * (size_t)s->options.height;
    float *planes[ENCODED];
    for (size_t c = 0; c < ENCODED; ++c) {
        planes[c] = encoded + c * pixels;
    }
    vsh_error error;
    CLI_TRY(cli_check(vsh_picture_encode(p, s->options.width, s->options.height, s->exposure, planes,
                                         s->transparent ? planes[3] : NULL, &error),
                      &error));
    return write_image(s, (const float *const *)planes, origin);
}

/* --- checks */

/* Refuses options that contradict each other, and an output that no picture can go to. */
static int check_options(const render_settings *s) {
    const vsh_render_options *o = &s->options;
    vsh_error error;
    if (s->bake.output == NULL) {
        return cli_usage("render: no output; give -o OUT");
    }
    if (s->has_look_at && !s->has_camera) {
        return cli_usage("--look-at: there is no --camera");
    }
    if (s->transparent && o->shafts > 0.0) {
        return cli_usage("--background none: not with --shafts, which lie before it");
    }
    if (s->pack != NULL && s->lightmap_count == 0) {
        return cli_usage("--lightmap-pack: there is no --lightmap");
    }
    if (o->width > VSH_MAX_PICTURE_SIZE || o->height > VSH_MAX_PICTURE_SIZE) {
        return cli_usage("--size %dx%d: expected at most %d pixels a side", o->width, o->height,
                         VSH_MAX_PICTURE_SIZE);
    }
    if (s->has_camera && s->has_look_at) {
        CLI_TRY(cli_check(vsh_camera_check(&o->camera, &error), &error));
    }
    for (size_t i = 0; i < s->lightmap_count; ++i) {
        if (cli_same_file(s->bake.output, s->lightmaps[i])) {
            return cli_usage("%s: the output is also a lightmap", s->bake.output);
        }
    }
    vsh_image_options as;
    const vsh_image image = describe_image(s, &as);
    return cli_check(vsh_image_check(s->bake.output, &image, &as, &error), &error);
}

/* Refuses what the scene tells before its files are read. */
static int check_files(const render_settings *s, const vsh_scene *scene) {
    CLI_TRY(cli_bake_check_files(&s->bake, scene));
    if (scene->light_count == 0 && !scene->ao && s->lightmap_count == 0) {
        return cli_usage("%s: no lights and no ao; give --sun X,Y,Z or --ao DISTANCE, or both",
                         s->bake.input);
    }
    const uint64_t limit = cli_given.memory_limit, bytes = count_picture_bytes(s);
    if (limit > 0 && bytes > limit) {
        char all[32], most[32];
        cli_say("%s: a picture of %d × %d needs %s, over the memory limit of %s", s->bake.output,
                s->options.width, s->options.height, vshi_bytes_text(bytes, all, sizeof all),
                vshi_bytes_text(limit, most, sizeof most));
        return CLI_LIMIT;
    }
    return CLI_OK;
}

/* --- the command */

typedef struct render_work {
    const render_settings *settings;
    cli_shading shading;
    render_shown shown;
    vsh_render_options options;
    float *memory; /* of the picture */
} render_work;

static int load(render_work *work) {
    CLI_TRY(cli_shading_load(&work->shading));
    const double start = vshi_seconds();
    CLI_TRY(render_read_lightmaps(work->settings, &work->shading, &work->shown));
    cli_stats_stage(&work->shading.stats, CLI_STAGE_LOAD, start);
    return CLI_OK;
}

static int make_occluders(render_work *work) {
    vsh_scene_occluders_options what = vsh_scene_occluders_options_default();
    what.voxels = render_shows_fields(work->shading.scene, work->shading.assets);
    CLI_TRY(cli_shading_cast(&work->shading, &what));
    const double start = vshi_seconds();
    const int code = render_add_casters(&work->shading, &work->shown);
    cli_stats_stage(&work->shading.stats, CLI_STAGE_FIELD, start);
    return code;
}

static int set_options(render_work *work) {
    const render_settings *s = work->settings;
    const vsh_scene *scene = work->shading.scene;
    vsh_render_options *o = &work->options;
    *o = s->options;
    o->ao = scene->ao;
    for (int c = 0; c < 3 && !s->has_sky; ++c) {
        o->sky[c] = scene->has_ambient        ? scene->ambient[c]
                    : scene->light_count == 0 ? 1.0 /* all the light there is */
                                              : o->sky[c];
    }
    o->tint = scene->tint;
    o->shade = scene->shade;
    if (!scene->ao) {
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
    cli_shading *shading = &work->shading;
    const vsh_scene *scene = shading->scene;
    const size_t pixels = (size_t)s->options.width * (size_t)s->options.height;
    work->memory = calloc(pixels * (FLOATS + ENCODED), sizeof *work->memory);
    if (work->memory == NULL) {
        return cli_out_of_memory("picture");
    }
    const vsh_picture picture = view_picture(work->memory, pixels);
    double start = vshi_seconds();
    vsh_error error;
    const vsh_result result =
        vsh_render(shown->surfaces, shown->count, shading->occluders, scene->lights, scene->light_count,
                   &work->options, &shading->run, &picture, &shading->stats.shade, &error);
    start = cli_stats_stage(&shading->stats, CLI_STAGE_BAKE, start);
    if (result != VSH_OK) {
        return cli_fail_of(lightmap_named(s, error.message), &error);
    }
    shading->stats.points += (uint64_t)pixels * (uint64_t)(s->options.samples * s->options.samples);
    const int code = is_linear(s->bake.output)
                         ? write_linear(s, &picture, &shading->origin)
                         : write_encoded(s, &picture, work->memory + FLOATS * pixels, &shading->origin);
    cli_stats_stage(&shading->stats, CLI_STAGE_WRITE, start);
    return code;
}

/* Lightmaps and the file of --lights are inputs too. */
static int find_origin(render_work *work) {
    const render_settings *s = work->settings;
    cli_shading *shading = &work->shading;
    const char *files[2 + RENDER_MOST_LIGHTMAPS] = {s->bake.input, cli_bake_lights(&s->bake)};
    memcpy(files + 2, s->lightmaps, s->lightmap_count * sizeof *files);
    return cli_provenance_make(shading->scene, files, 2 + s->lightmap_count, &shading->stats.casters,
                               &shading->run, &shading->origin);
}

static void say_results(const render_work *work) {
    const cli_stats *stats = &work->shading.stats;
    const vsh_render_options *o = &work->options;
    if (stats->shade.unfinished > 0) {
        cli_warn("%" PRIu64 " rays ran out of steps; use larger voxels", stats->shade.unfinished);
    }
    const double *at = o->camera.position, *to = o->camera.target;
    cli_say("%s: %d × %d, camera %.5g,%.5g,%.5g looking at %.5g,%.5g,%.5g", work->settings->bake.output,
            o->width, o->height, at[0], at[1], at[2], to[0], to[1], to[2]);
    cli_stats_say(stats);
}

static int run_render(const render_settings *s, vsh_scene *scene) {
    render_work work = {.settings = s, .shading = cli_shading_begin(scene, CLI_STATS_POINTS)};
    work.shading.run.memory_held += count_picture_bytes(s);
    int code;
    CLI_TRY_DONE(load(&work));
    CLI_TRY_DONE(make_occluders(&work));
    CLI_TRY_DONE(set_options(&work));
    CLI_TRY_DONE(find_origin(&work));
    CLI_TRY_DONE(draw_picture(&work));
    CLI_TRY_DONE(cli_stats_finish(&work.shading.stats, &work.shading.run, s->bake.stats));
    if (!cli_given.quiet) {
        say_results(&work);
    }
done:
    free(work.memory);
    render_free_shown(&work.shown);
    cli_shading_free(&work.shading);
    return code;
}

static int render_main(int argc, char **argv) {
    render_settings s = {.options = vsh_render_options_default()};
    for (int c = 0; c < 3; ++c) { /* grey, so that no light or shadow looks coloured */
        s.options.sky[c] = 0.3;
        s.options.background[c] = 0.1;
    }
    CLI_TRY(cli_parse(&cli_render, argc, argv, parse_option, &s, &s.bake.input));
    CLI_TRY(cli_patch_check(&s.bake.patch));
    CLI_TRY(check_options(&s));
    cli_bake_scene made;
    int code;
    CLI_TRY_DONE(cli_bake_scene_for_points(&s.bake, &made));
    if (s.lightmap_count > 0) {
        CLI_TRY_DONE(cli_bake_scene_receivers(&s.bake, &made));
    }
    CLI_TRY_DONE(check_files(&s, &made.scene));
    cli_signals_watch();
    code = run_render(&s, &made.scene);
done:
    cli_bake_scene_free(&made);
    return code;
}
