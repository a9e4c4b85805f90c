/* The command line of `vdbshade render`. */
#include "cli/message.h"
#include "cli/paths.h"
#include "render.h"

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
    {KEY_LOOK_AT, "look-at", "X,Y,Z", "what it looks at (the middle of the casters' box)"},
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
     "what lightmaps hold that do not name channels, as --pack\nof bake: \"R=shadow.sun,G=ao\""},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    CLI_COMMON_OPTIONS,
};

const cli_command cli_render = {
    "render",
    "INPUT -o OUT [options]",
    "Draws a picture of INPUT, a mesh file, a level set (FILE.vdb, FILE.vdb:GRID) or a scene (.json),\n"
    "with the shadows and AO that bake would give: for looking at a scene or a lightmap. No materials but\n"
    "a caster's color; docs/render.md says more. Numbers in brackets are the defaults.",
    options,
    sizeof options / sizeof options[0],
    cli_render_main};

static int take_background(render_settings *s, const char *name, const char *value) {
    s->transparent = strcmp(value, "none") == 0;
    if (s->transparent) {
        memset(s->background, 0, sizeof s->background);
        return CLI_OK;
    }
    return cli_parse_color(name, value, s->background);
}

static int take_lightmap(render_settings *s, const char *value) {
    if (s->lightmap_count == RENDER_MOST_LIGHTMAPS) {
        return cli_usage("--lightmap '%s': at most %d are taken", value, RENDER_MOST_LIGHTMAPS);
    }
    s->lightmaps[s->lightmap_count++] = value;
    return CLI_OK;
}

static int take(void *settings, int key, const char *name, const char *value) {
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
        return take_background(s, name, value);
    case KEY_EXPOSURE:
        return cli_parse_number(name, value, -20.0, 20.0, &s->exposure);
    case KEY_SHAFTS:
        return cli_parse_number(name, value, 0.0, 100.0, &s->shafts);
    case KEY_SHAFT_STEPS:
        return cli_parse_integer(name, value, 1, 64, &s->shaft_steps);
    case KEY_LIGHTMAP:
        return take_lightmap(s, value);
    case KEY_LIGHTMAP_PACK:
        s->pack = value;
        return CLI_OK;
    default:
        break;
    }
    return cli_shared_parse(&s->bake, key, name, value);
}

/* What does not go together. */
static int check(render_settings *s) {
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
    return render_output_check(s);
}

int render_parse(int argc, char **argv, render_settings *s, bool *help) {
    const vsh_render_options defaults = vsh_render_options_default();
    memset(s, 0, sizeof *s);
    s->bake.common = cli_common_default();
    s->up[1] = 1.0;
    s->fov_deg = 35.0;
    s->width = defaults.width;
    s->height = defaults.height;
    s->samples = defaults.samples;
    s->shaft_steps = defaults.shaft_steps;
    for (int c = 0; c < 3; ++c) { /* grey, so that no light or shadow is taken for a colour */
        s->sky[c] = 0.3;
        s->background[c] = 0.1;
    }
    int code = cli_parse(&cli_render, argc, argv, take, s, "INPUT", &s->bake.input, help);
    if (code != CLI_OK || *help) {
        return code;
    }
    code = cli_patch_check(&s->bake.patch);
    return code == CLI_OK ? check(s) : code;
}
