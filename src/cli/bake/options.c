#include "options.h"

#include "cli/message.h"

#include <stdio.h>
#include <string.h>

enum {
    KEY_IRRADIANCE = 0x2000,
    KEY_AMBIENT,
    KEY_TINT,
    KEY_BENT,
    KEY_SKY,
    KEY_SIZE,
    KEY_UV_SET,
    KEY_SUPERSAMPLE,
    KEY_PADDING,
    KEY_AO_SPACING,
    KEY_BAND_ROWS,
    KEY_BITS,
    KEY_PACK,
    KEY_COLOR_SPACE,
    KEY_STATS,
    KEY_DRY_RUN,
    KEY_RESUME,
    KEY_OUTPUT_FOLDER,
    KEY_RECEIVE,
    KEY_NO_RECEIVE,
    KEY_NO_CAST,
    KEY_PER_OBJECT,
    KEY_ALLOW_OVERLAP,
    KEY_INVALID,
    KEY_INVALID_CHANNEL
};

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT",
     "image to write: .exr with named channels, or\n"
     ".png .tif .dpx .sgi .jp2 .tga .bmp .ico .iff .rla\n"
     ".hdr .ppm .pgm .jpg .webp .heic .avif .gif; what each\n"
     "can hold, and what is not written: docs/formats.md"},
    {KEY_OUTPUT_FOLDER, "output-folder", "FOLDER",
     "write there what a scene's file says is written, under\nthe same names; it is made where it is not "
     "there"},
    {KEY_SIZE, "size", "W[xH]", "texels of the lightmap, 1 to 65536 (1024)"},
    {KEY_BITS, "bits", "N",
     "8, 16 or 32 bits a channel (32 for EXR, else 16\nwhere the format has it, else 8)"},
    {KEY_PACK, "pack", "R=NAME,…",
     "what goes where in formats that cannot name channels:\n"
     "R=shadow.sun,G=ao,A=A; 0 and 1 are constants; rgb:\n"
     "the irradiance, or shadow * ao in grey (irradiance or\n"
     "the first three but A to R, G, B; A to A; EXR: all by\n"
     "name and the picture; channels: without the picture)"},
    {KEY_INVALID, "invalid", "FILE.png",
     "also a picture of the lightmap: charts grey, texels\ninside solids or behind walls red, those of them "
     "in\nplain sight yellow; FILE.OUT.png where there are\nseveral outputs"},
    {KEY_INVALID_CHANNEL, "invalid-channel", NULL, "also the channel invalid: 1 for such texels, else 0"},
    {KEY_COLOR_SPACE, "color-space", "SPACE",
     "of R, G, B in 8 and 16 bits: srgb or linear (auto:\n"
     "srgb for irradiance and tints, linear for the rest)"},
    {KEY_STATS, "stats", "FILE.json", "write times, counts and peak memory as JSON"},
    {KEY_DRY_RUN, "dry-run", NULL,
     "bake nothing: print texels, voxels, memory and\nexpected time, found by a small bake"},
    {KEY_RESUME, "resume", NULL,
     "keep finished rows in OUT.resume until all are there,\nand go on from them where a bake with this "
     "option was\nended; the result is the same, bit by bit"},
    {0, NULL, NULL, "Objects"},
    {KEY_RECEIVE, "receive", "NAME",
     "only objects of this name receive, all cast; * and ?\nmatch as in a shell; may be repeated"},
    {KEY_NO_RECEIVE, "no-receive", "NAME", "objects of this name only cast; may be repeated"},
    {KEY_NO_CAST, "no-cast", "NAME", "objects of this name only receive; may be repeated"},
    {KEY_PER_OBJECT, "per-object", NULL,
     "an image for each object: FOLDER/NAME.exr with\n-o FOLDER/, else OUT.NAME.exr, or where OUT has %s"},
    {KEY_ALLOW_OVERLAP, "allow-overlap", NULL,
     "bake objects that lie over each other in the lightmap,\ntoo: the first keeps the texels"},
    {0, NULL, NULL, "Light and occlusion"},
    CLI_LIGHT_OPTIONS,
    {KEY_IRRADIANCE, "irradiance", NULL,
     "also irradiance.R, .G, .B: visibility × colour ×\nfalloff × cosine, summed, × AO where baked"},
    {KEY_AMBIENT, "ambient", "R,G,B",
     "light from all around, linear: irradiance is then that\nof the lights + ambient × AO"},
    {KEY_TINT, "tint", "TINT",
     "also tint.NAME.R, .G, .B of each light, its penumbra\ncoloured: quadratic (V, V²/2 + V/2, V²) or "
     "powers\n"
     "of V such as 1,1.2,1.5; irradiance takes it too"},
    {KEY_BENT, "bent-normals", "SPACE",
     "with --ao also bent.X, .Y, .Z: the mean direction that\nis open, in world or tangent space; -1 to 1, "
     "in\n"
     "integer formats (1 + x) / 2"},
    {KEY_SKY, "sky", "AXIS",
     "also sky: what of an even sky is seen, however far the\ncasters; up is x, y, z, -x, -y or -z"},
    CLI_ACCURACY_OPTIONS,
    CLI_CASTER_OPTIONS,
    CLI_GRID_OPTIONS,
    {0, NULL, NULL, "Texels"},
    {KEY_UV_SET, "uv-set", "N",
     "UV set of the lightmap, from 0 (the second where\nthere is one, else the first)"},
    {KEY_SUPERSAMPLE, "supersample", "N", "N × N samples a texel, 1 to 16 (1)"},
    {KEY_PADDING, "padding", "N", "texels that charts are grown by, 0 to 4096 (4)"},
    {KEY_AO_SPACING, "ao-spacing", "N",
     "1, 2, 4 or 8 texels: AO by cones or adaptive is\ninterpolated between texels so far apart where "
     "casters\nare far; texels share the rays of exact AO; 1: neither\n(4)"},
    {KEY_BAND_ROWS, "band-rows", "N",
     "rows baked and written at a time, 1 to 65536,\nrounded up to eights; changes no value (all, or as\n"
     "many as --memory-limit allows)"},
    CLI_COMMON_OPTIONS,
    CLI_ISA_OPTION,
};

const cli_command cli_bake = {
    "bake",
    "INPUT -o OUT [options]",
    "Bakes soft shadows and ambient occlusion into a lightmap. INPUT is a mesh file with lightmap UVs\n"
    "(OBJ, glTF, GLB, PLY, FBX …), which casts and receives, or a scene file (.json), whose values the\n"
    "options override. Numbers in brackets are what holds without the option.",
    options,
    sizeof options / sizeof options[0],
    cli_bake_main};

static int take_tint(const char *name, const char *value, vsh_tint *tint) {
    tint->type = vsh_tint_type(value);
    if (tint->type == VSH_TINT_NONE || tint->type == VSH_TINT_QUADRATIC) {
        return CLI_OK;
    }
    tint->type = VSH_TINT_POWER;
    vsh_error error;
    const int code = cli_take_vector(name, value, tint->power);
    return code != CLI_OK || vsh_tint_check(tint, &error) == VSH_OK
               ? code
               : cli_usage("%s '%s': %s", name, value, error.message);
}

static int take_ambient(const char *name, const char *value, double ambient[3]) {
    const int code = cli_take_vector(name, value, ambient);
    const bool dark = ambient[0] < 0.0 || ambient[1] < 0.0 || ambient[2] < 0.0;
    return code == CLI_OK && dark ? cli_usage("%s '%s': expected three numbers of at least 0", name, value)
                                  : code;
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
        return cli_usage("%s: expected an object's name, or a pattern such as 'floor*'", name);
    }
    if (patterns->count == CLI_MAX_PATTERNS) {
        return cli_usage("%s '%s': given more than %d times", name, value, CLI_MAX_PATTERNS);
    }
    patterns->list[patterns->count++] = value;
    return CLI_OK;
}

static int take_shade(cli_bake_settings *s, int key, const char *name, const char *value, bool *taken) {
    *taken = true;
    switch (key) {
    case CLI_KEY_SUN:
        s->has_sun = true;
        return cli_take_vector(name, value, s->sun);
    case CLI_KEY_SUN_ANGLE:
        s->has_sun_angle = true;
        return cli_take_number(name, value, 0.0, 179.0, &s->sun_angle_deg);
    case CLI_KEY_AO:
        s->has_ao = true;
        return cli_take_positive(name, value, &s->ao_distance);
    case CLI_KEY_AO_METHOD:
        s->has_ao_method = true;
        return cli_take_name(name, value, vsh_ao_method, vsh_ao_method_name, &s->ao_method);
    case CLI_KEY_AO_CONES:
        s->has_ao_cones = true;
        return cli_take_integer(name, value, 1, 256, &s->ao_cones);
    case CLI_KEY_METHOD:
        s->has_method = true;
        return cli_take_name(name, value, vsh_shadow_method, vsh_shadow_method_name, &s->method);
    case CLI_KEY_RAYS:
        s->has_rays = true;
        return cli_take_integer(name, value, 1, 4096, &s->rays);
    case CLI_KEY_SAMPLER:
        s->has_sampler = true;
        return cli_take_name(name, value, vsh_sampler, vsh_sampler_name, &s->sampler);
    case CLI_KEY_FRAME:
        s->has_frame = true;
        return cli_take_integer(name, value, 0, INT32_MAX, &s->frame);
    case CLI_KEY_EARLY_RAYS:
        s->has_early_rays = true;
        return cli_take_integer(name, value, 0, 4096, &s->early_rays);
    case CLI_KEY_JITTER:
        s->has_jitter = true;
        return cli_take_number(name, value, 0.0, 1.0, &s->jitter);
    case CLI_KEY_MAX_ERROR:
        s->has_max_error = true;
        return cli_take_number(name, value, 1e-4, 1.0, &s->max_error);
    case CLI_KEY_ERROR:
        s->error = true;
        return CLI_OK;
    case CLI_KEY_CASTER:
        return take_caster(s, name, value);
    default:
        *taken = false;
        return CLI_OK;
    }
}

int cli_shared_take(cli_bake_settings *s, int key, const char *name, const char *value) {
    bool taken;
    int code = take_shade(s, key, name, value, &taken);
    code = taken ? code : cli_grid_take(&s->grid, key, name, value, &taken);
    return taken ? code : cli_common_take(&s->common, key, name, value, &taken);
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
    case KEY_NO_CAST:
        return take_pattern(&s->no_cast, name, value);
    case KEY_PER_OBJECT:
        s->per_object = true;
        return CLI_OK;
    case KEY_ALLOW_OVERLAP:
        s->allow_overlap = true;
        return CLI_OK;
    case KEY_INVALID:
        s->invalid_picture = value;
        return CLI_OK;
    case KEY_INVALID_CHANNEL:
        s->planes.invalid = 1;
        return CLI_OK;
    case KEY_SKY:
        return cli_take_name(name, value, vsh_up, vsh_up_name, &s->planes.sky);
    case KEY_STATS:
        s->stats = value;
        return CLI_OK;
    case KEY_DRY_RUN:
        s->dry_run = true;
        return CLI_OK;
    case KEY_RESUME:
        s->resume = true;
        return CLI_OK;
    case KEY_IRRADIANCE:
        s->irradiance = true;
        return CLI_OK;
    case KEY_AMBIENT:
        s->has_ambient = s->irradiance = true;
        return take_ambient(name, value, s->ambient);
    case KEY_TINT:
        s->has_tint = true;
        return take_tint(name, value, &s->tint);
    case KEY_BENT: {
        int32_t space = 0;
        const int code = cli_take_name(name, value, vsh_bent_space, vsh_bent_space_name, &space);
        s->bent = 1 + space;
        return code;
    }
    case KEY_SIZE:
        s->has_size = true;
        return cli_take_size(name, value, &s->width, &s->height);
    case KEY_UV_SET:
        s->has_uv_set = true;
        return cli_take_integer(name, value, 0, VSH_MAX_UV_SETS - 1, &s->uv_set);
    case KEY_SUPERSAMPLE:
        s->has_supersample = true;
        return cli_take_integer(name, value, 1, 16, &s->supersample);
    case KEY_AO_SPACING:
        s->has_ao_spacing = true;
        return cli_take_integer(name, value, 1, 8, &s->ao_spacing);
    case KEY_PADDING:
        s->has_padding = true;
        return cli_take_integer(name, value, 0, 4096, &s->padding);
    case KEY_BAND_ROWS:
        return cli_take_integer(name, value, 1, VSH_MAX_LIGHTMAP_SIZE, &s->band_rows);
    case KEY_BITS:
        s->has_bits = true;
        return cli_take_bits(name, value, &s->bits);
    case KEY_PACK:
        s->pack = value;
        return CLI_OK;
    case KEY_COLOR_SPACE:
        s->has_color_space = true;
        return cli_take_color_space(name, value, &s->color_space);
    default:
        break;
    }
    return cli_shared_take(s, key, name, value);
}

int cli_bake_parse(int argc, char **argv, cli_bake_settings *settings, bool *help) {
    memset(settings, 0, sizeof *settings);
    settings->common = cli_common_default();
    settings->grid.options = vsh_grid_options_default();
    const int code = cli_parse(&cli_bake, argc, argv, take, settings, "INPUT", &settings->input, help);
    return code != CLI_OK || *help ? code : cli_grid_check(&settings->grid);
}
