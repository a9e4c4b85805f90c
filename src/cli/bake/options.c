/* The command line of `vdbshade bake`, and the options that other commands share with it. */
#include "options.h"

#include "cli/message.h"

#include <stdio.h>
#include <string.h>

enum { KEY_RECEIVE = 0x2000, KEY_NO_RECEIVE, KEY_DENSITY, KEY_HEIGHT, KEY_SIZE_WORLD, KEY_SHARD };

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(cli_bake_settings, output), "output", "OUT",
     "image to write: .exr with named channels, or\n"
     ".png .tif .dpx .jp2 .tga .bmp .hdr .ppm .pgm .jpg\n"
     ".webp .gif; what each can hold, and what is not\nwritten: docs/formats.md;\n"
     ".glb .gltf .obj: the input with its light in its\nmaterials (docs/lit.md)"},
    {CLI_TEXT(cli_bake_settings, output_folder), "output-folder", "FOLDER",
     "write there what a scene's file says is written, under\nthe same names; it is made where it is not "
     "there"},
    CLI_SETTINGS(VSH_SETTINGS_IMAGE),
    {CLI_TEXT(cli_bake_settings, invalid_picture), "invalid", "FILE.png",
     "also a picture of the lightmap: charts grey, texels\ninside solids or behind walls red; FILE.OUT.png "
     "where\nthere are several outputs"},
    {CLI_FLAG(cli_bake_settings, preview), "preview", NULL,
     "into a .glb or .gltf: the light as unlit base colour,\nwhich every viewer shows, in place of textures"},
    {CLI_TEXT(cli_bake_settings, exr), "exr", "FILE.exr",
     "also an EXR of all channels beside a .glb or .gltf"},
    {CLI_TEXT(cli_bake_settings, view), "view", "PAGE.html",
     "also a page to look at it in a browser: docs/view.md"},
    CLI_STATS_OPTION(cli_bake_settings, stats),
    {CLI_FLAG(cli_bake_settings, dry_run), "dry-run", NULL, "bake nothing: print texels, voxels and memory"},
    {KEY_SHARD, "shard", "I/N",
     "bake part I of N into OUT.I-of-N.part: on any machine, in\nany order, again where it "
     "failed; 'vdbshade merge OUT' puts\nall parts together to the bits of one bake"},
    {0, NULL, NULL, "Objects"},
    {KEY_RECEIVE, "receive", "NAME",
     "only objects of this name receive, all cast; * and ?\nmatch as in a shell; may be repeated"},
    {KEY_NO_RECEIVE, "no-receive", "NAME",
     "objects of this name only cast, or where there are\nnone, those of materials of this name; may be "
     "repeated"},
    CLI_FLOOR_OPTION,
    CLI_NO_CAST_OPTION,
    {CLI_FLAG(cli_bake_settings, per_object), "per-object", NULL,
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

/* W or W,D */
static int parse_world(const char *name, const char *value, double world[2]) {
    char first[64];
    const size_t length = strcspn(value, ",");
    if (length >= sizeof first) {
        return cli_usage("%s '%s': expected W or W,D", name, value);
    }
    snprintf(first, sizeof first, "%.*s", (int)length, value);
    world[1] = 0.0;
    CLI_TRY(cli_parse_number(name, first, 1e-12, 1e12, &world[0]));
    return value[length] != '\0' ? cli_parse_number(name, value + length + 1, 1e-12, 1e12, &world[1])
                                 : CLI_OK;
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
    switch (key) {
    case CLI_KEY_SUN:
        s->has_sun = true;
        return cli_parse_vector(name, value, s->sun);
    case CLI_KEY_SUN_ANGLE:
        s->has_sun_angle = true;
        return cli_parse_number(name, value, 0.0, 179.0, &s->sun_angle_deg);
    case CLI_KEY_LIGHT_RADIUS:
        s->has_light_radius = true;
        return cli_parse_number(name, value, 0.0, 1e12, &s->light_radius);
    case CLI_KEY_CASTER:
        if (s->caster_count == CLI_MAX_EXTRA_CASTERS) {
            return cli_usage("%s '%s': more than %d casters; put them into a scene file", name, value,
                             CLI_MAX_EXTRA_CASTERS);
        }
        s->casters[s->caster_count++] = value;
        return CLI_OK;
    case CLI_KEY_FLOOR:
        return cli_parse_floor(name, value, s->floor_size, s->floor_center);
    case CLI_KEY_NO_CAST:
        return take_pattern(&s->no_cast, name, value);
    default:
        return cli_patch_take(&s->patch, key, name, value);
    }
}

static int take(void *settings, int key, const char *name, const char *value) {
    cli_bake_settings *s = settings;
    switch (key) {
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
    case KEY_SHARD:
        return cli_parse_shard(name, value, &s->shard, &s->shard_count);
    default:
        return cli_shared_parse(s, key, name, value);
    }
}

int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings) {
    *settings = (cli_bake_settings){.words = (const char *const *)argv, .word_count = (size_t)argc};
    CLI_TRY(cli_parse(&cli_bake, argc, argv, take, settings, &settings->input));
    return cli_patch_check(&settings->patch);
}

static int bake_main(int argc, char **argv) {
    cli_bake_settings settings;
    CLI_TRY(cli_bake_parse(argc, argv, &settings));
    return cli_bake_by(&settings);
}

const cli_command cli_bake = {
    "bake",
    "INPUT -o OUT [options]",
    "Bakes soft shadows and ambient occlusion into a lightmap. INPUT is a mesh file with lightmap UVs\n"
    "(OBJ, glTF, GLB, PLY, FBX …), which casts and receives, an image of heights (with --height), or a\n"
    "scene file (.json), whose values the options override. Numbers in brackets are what holds without\n"
    "the option.",
    options,
    sizeof options / sizeof options[0],
    bake_main};
