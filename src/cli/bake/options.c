#include "options.h"

#include "cli/message.h"

#include <stdio.h>
#include <string.h>

enum {
    KEY_STATS = 0x2000,
    KEY_DRY_RUN,
    KEY_OUTPUT_FOLDER,
    KEY_RECEIVE,
    KEY_NO_RECEIVE,
    KEY_PER_OBJECT,
    KEY_INVALID,
    KEY_PREVIEW,
    KEY_EXR,
    KEY_VIEW,
    KEY_DENSITY,
    KEY_HEIGHT,
    KEY_SIZE_WORLD
};

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT",
     "image to write: .exr with named channels, or\n"
     ".png .tif .dpx .jp2 .tga .bmp .hdr .ppm .pgm .jpg\n"
     ".webp .gif; what each can hold, and what is not\nwritten: docs/formats.md;\n"
     ".glb .gltf .obj: the input with its light in its\nmaterials (docs/lit.md)"},
    {KEY_OUTPUT_FOLDER, "output-folder", "FOLDER",
     "write there what a scene's file says is written, under\nthe same names; it is made where it is not "
     "there"},
    CLI_SETTINGS(VSH_SETTINGS_IMAGE),
    {KEY_INVALID, "invalid", "FILE.png",
     "also a picture of the lightmap: charts grey, texels\ninside solids or behind walls red; FILE.OUT.png "
     "where\nthere are several outputs"},
    {KEY_PREVIEW, "preview", NULL,
     "into a .glb or .gltf: the light as unlit base colour,\nwhich every viewer shows, in place of textures"},
    {KEY_EXR, "exr", "FILE.exr", "also an EXR of all channels beside a .glb or .gltf"},
    {KEY_VIEW, "view", "PAGE.html", "also a page to look at it in a browser: docs/view.md"},
    {KEY_STATS, "stats", "FILE.json", "write times, counts and peak memory as JSON"},
    {KEY_DRY_RUN, "dry-run", NULL, "bake nothing: print texels, voxels and memory"},
    CLI_SHARD_OPTION("bake part I of N into OUT.I-of-N.part: on any machine, in\nany order, again where it "
                     "failed; 'vdbshade merge OUT' puts\nall parts together to the bits of one bake"),
    {0, NULL, NULL, "Objects"},
    {KEY_RECEIVE, "receive", "NAME",
     "only objects of this name receive, all cast; * and ?\nmatch as in a shell; may be repeated"},
    {KEY_NO_RECEIVE, "no-receive", "NAME",
     "objects of this name only cast, or where there are\nnone, those of materials of this name; may be "
     "repeated"},
    CLI_FLOOR_OPTION,
    CLI_NO_CAST_OPTION,
    {KEY_PER_OBJECT, "per-object", NULL,
     "an image for each object: FOLDER/NAME.exr with\n-o FOLDER/, else OUT.NAME.exr, or where OUT has %s"},
    {0, NULL, NULL, "Terrain"},
    {KEY_HEIGHT, "height", "H", "height of white in INPUT, an image of heights; scene\nunits"},
    {KEY_SIZE_WORLD, "size-world", "W[,D]",
     "length of its longer side, or of both: along x, then\nalong z; scene units"},
    {0, NULL, NULL, "Light and occlusion"},
    CLI_LIGHT_OPTIONS,
    CLI_SETTINGS(VSH_SETTINGS_CHANNELS),
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    {0, NULL, NULL, "Texels"},
    CLI_SETTINGS(VSH_SETTINGS_TEXELS),
    {KEY_DENSITY, "density", "PATTERN=X",
     "factor of --texels-per-unit, or of the density that\nfits, for objects of that name; repeatable, the "
     "last\nthat means one holds (1)"},
    CLI_COMMON_OPTIONS,
};

const cli_command cli_bake = {
    "bake",
    "INPUT -o OUT [options]",
    "Bakes soft shadows and ambient occlusion into a lightmap. INPUT is a mesh file with lightmap UVs\n"
    "(OBJ, glTF, GLB, PLY, FBX …), which casts and receives, an image of heights (with --height), or a\n"
    "scene file (.json), whose values the options override. Numbers in brackets are what holds without\n"
    "the option.",
    options,
    sizeof options / sizeof options[0],
    cli_bake_main};

/* W or W,D */
static int parse_world(const char *name, const char *value, double world[2]) {
    const char *comma = strchr(value, ',');
    char first[64];
    const size_t length = comma != NULL ? (size_t)(comma - value) : strlen(value);
    if (length >= sizeof first) {
        return cli_usage("%s '%s': expected W or W,D", name, value);
    }
    memcpy(first, value, length);
    first[length] = '\0';
    world[1] = 0.0;
    CLI_TRY(cli_parse_number(name, first, 1e-12, 1e12, &world[0]));
    return comma != NULL ? cli_parse_number(name, comma + 1, 1e-12, 1e12, &world[1]) : CLI_OK;
}

static int take_caster(cli_bake_settings *s, const char *name, const char *value) {
    if (s->caster_count == CLI_MAX_EXTRA_CASTERS) {
        return cli_usage("%s '%s': more than %d casters; put them into a scene file", name, value,
                         CLI_MAX_EXTRA_CASTERS);
    }
    s->casters[s->caster_count++] = value;
    return CLI_OK;
}

static int take_pattern(cli_patterns *patterns, const char *name, const char *value) {
    if (value[0] == '\0') {
        return cli_usage("%s: expected the name of an object or a material, or a pattern such as 'floor*'",
                         name);
    }
    if (patterns->count == CLI_MAX_PATTERNS) {
        return cli_usage("%s '%s': given more than %d times", name, value, CLI_MAX_PATTERNS);
    }
    patterns->list[patterns->count++] = value;
    return CLI_OK;
}

int cli_shared_parse(cli_bake_settings *s, int key, const char *name, const char *value) {
    bool taken;
    int code;
    switch (key) {
    case CLI_KEY_SUN:
        s->has_sun = true;
        return cli_parse_vector(name, value, s->sun);
    case CLI_KEY_SUN_ANGLE:
        s->has_sun_angle = true;
        return cli_parse_number(name, value, 0.0, 179.0, &s->sun_angle_deg);
    case CLI_KEY_LIGHTS:
        s->lights = value;
        return CLI_OK;
    case CLI_KEY_LIGHT_RADIUS:
        s->has_light_radius = true;
        return cli_parse_number(name, value, 0.0, 1e12, &s->light_radius);
    case CLI_KEY_CASTER:
        return take_caster(s, name, value);
    case CLI_KEY_FLOOR:
        return cli_parse_floor(name, value, s->floor_size, s->floor_center);
    case CLI_KEY_NO_CAST:
        return take_pattern(&s->no_cast, name, value);
    default:
        code = cli_patch_take(&s->patch, key, name, value, &taken);
        return taken ? code : cli_common_parse(&s->common, key, name, value, &taken);
    }
}

static int take(void *settings, int key, const char *name, const char *value) {
    cli_bake_settings *s = settings;
    switch (key) {
    case 'o':
        s->output = value;
        return CLI_OK;
    case KEY_OUTPUT_FOLDER:
        s->output_folder = value;
        return CLI_OK;
    case KEY_RECEIVE:
        return take_pattern(&s->receive, name, value);
    case KEY_NO_RECEIVE:
        return take_pattern(&s->no_receive, name, value);
    case KEY_HEIGHT:
        CLI_TRY(cli_parse_number(name, value, -1e12, 1e12, &s->height));
        return s->height != 0.0 ? CLI_OK
                                : cli_usage("%s '%s': a terrain without height casts nothing", name, value);
    case KEY_SIZE_WORLD:
        return parse_world(name, value, s->world);
    case KEY_DENSITY:
        return cli_density_take(&s->densities, name, value);
    case KEY_PER_OBJECT:
        s->per_object = true;
        return CLI_OK;
    case KEY_INVALID:
        s->invalid_picture = value;
        return CLI_OK;
    case KEY_PREVIEW:
        s->preview = true;
        return CLI_OK;
    case KEY_EXR:
        s->exr = value;
        return CLI_OK;
    case KEY_VIEW:
        s->view = value;
        return CLI_OK;
    case KEY_STATS:
        s->stats = value;
        return CLI_OK;
    case KEY_DRY_RUN:
        s->dry_run = true;
        return CLI_OK;
    case CLI_KEY_SHARD:
        return cli_parse_shard(name, value, &s->shard, &s->shard_count);
    default:
        break;
    }
    return cli_shared_parse(s, key, name, value);
}

int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings, bool *help) {
    memset(settings, 0, sizeof *settings);
    settings->common = cli_common_default();
    settings->words = (const char *const *)argv;
    settings->word_count = (size_t)argc;
    const int code = cli_parse(&cli_bake, argc, argv, take, settings, "INPUT", &settings->input, help);
    return code != CLI_OK || *help ? code : cli_patch_check(&settings->patch);
}
