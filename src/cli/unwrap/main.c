/* vdbshade unwrap: a mesh file's meshes get lightmap UVs. */
#include "base/clock.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/options.h"
#include "cli/paths.h"
#include "cli/progress.h"
#include "cli/signals.h"
#include "cli/temporary.h"
#include "unwrap.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    KEY_PICTURE = 0x2000,
    KEY_ATLAS,
    KEY_SIZE,
    KEY_MAX_SIZE,
    KEY_PAGES,
    KEY_TEXELS,
    KEY_DENSITY,
    KEY_PADDING,
    KEY_STRETCH,
    KEY_KEEP
};

typedef struct unwrap_settings {
    const char *input;
    const char *output;
    const char *picture;
    bool has_size;
    int32_t max_size; /* 0: not given */
    vsh_unwrap_options options;
    cli_densities densities;
    cli_common common;
} unwrap_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {'o', "output", "OUT",
     "mesh file to write, with the UVs that were made: .glb or\n.gltf, the input with one more set; .obj, "
     "its meshes "
     "in\nthe world with that set alone"},
    {KEY_PICTURE, "picture", "FILE", "picture of the charts to write, PNG or another image"},
    {0, NULL, NULL, "Atlas"},
    {KEY_ATLAS, "atlas", "WHAT",
     "objects: each has a page of its own; shared: all lie on the\nsame (shared)"},
    {KEY_SIZE, "size", "N|WxH", "texels of each page (1024)"},
    {KEY_MAX_SIZE, "max-size", "N",
     "with --texels-per-unit, instead of --size: pages are as\nsmall as what lies on them allows, their "
     "sides powers\nof two up to N"},
    {KEY_PAGES, "pages", "N", "pages at most, 1 to 1024 (1)"},
    {KEY_TEXELS, "texels-per-unit", "X", "density, texels along a unit of length (the greatest that\nfits)"},
    {KEY_DENSITY, "density", "PATTERN=X",
     "factor of it for the objects that PATTERN means;\nrepeatable, the last that means one holds (1)"},
    {KEY_PADDING, "padding", "N", "free texels between charts, 0 to 4096 (4)"},
    {0, NULL, NULL, "Charts"},
    {KEY_STRETCH, "max-stretch", "X", "L2 stretch that no chart exceeds, from 1.01 on (1.3)"},
    {KEY_KEEP, "keep", NULL, "meshes whose UVs can serve keep their charts, which are\nonly packed"},
    CLI_COMMON_OPTIONS,
};

static int unwrap_main(int argc, char **argv);

const cli_command cli_unwrap = {
    "unwrap",
    "INPUT -o OUT [options]",
    "Cuts the meshes of a file into charts, lays them out flat, and packs them into an atlas:\n"
    "lightmap UVs for meshes that have none. Numbers in brackets are what holds without the\n"
    "option.",
    options,
    sizeof options / sizeof options[0],
    unwrap_main};

static int take(void *settings, int key, const char *name, const char *value) {
    unwrap_settings *s = settings;
    vsh_unwrap_options *o = &s->options;
    switch (key) {
    case 'o':
        s->output = value;
        return CLI_OK;
    case KEY_PICTURE:
        s->picture = value;
        return CLI_OK;
    case KEY_ATLAS:
        return cli_parse_name(name, value, VSH_NAMES_ATLAS, &o->atlas);
    case KEY_SIZE:
        s->has_size = true;
        return cli_parse_size(name, value, &o->width, &o->height);
    case KEY_MAX_SIZE:
        o->fit_pages = 1;
        return cli_parse_integer(name, value, 1, VSH_MAX_PAGE_SIZE, &s->max_size);
    case KEY_PAGES:
        return cli_parse_integer(name, value, 1, VSH_MAX_PAGES, &o->max_pages);
    case KEY_TEXELS:
        return cli_parse_positive(name, value, &o->texels_per_unit);
    case KEY_DENSITY:
        return cli_density_take(&s->densities, name, value);
    case KEY_PADDING:
        return cli_parse_integer(name, value, 0, 4096, &o->padding);
    case KEY_STRETCH:
        return cli_parse_number(name, value, 1.01, 1e9, &o->max_stretch);
    case KEY_KEEP:
        o->keep_uvs = VSH_UNWRAP_KEEP;
        return CLI_OK;
    default: {
        bool taken;
        return cli_common_parse(&s->common, key, name, value, &taken);
    }
    }
}

static int check_atlas(unwrap_settings *s) {
    vsh_unwrap_options *o = &s->options;
    if (s->max_size > 0 && (s->has_size || o->texels_per_unit == 0.0)) {
        return s->has_size ? cli_usage("--max-size and --size: give one of the two")
                           : cli_usage("--max-size: there is no --texels-per-unit, and any size is filled");
    }
    if (o->atlas == VSH_ATLAS_OBJECTS && o->max_pages > 1) {
        return cli_usage("--pages: with --atlas objects each object has one");
    }
    o->width = s->max_size > 0 ? s->max_size : o->width;
    o->height = s->max_size > 0 ? s->max_size : o->height;
    return CLI_OK;
}

/* What can be refused before anything is read. */
static int check_files(const unwrap_settings *s) {
    if (!vsh_lit_is_output(s->output)) {
        return cli_usage("%s: give -o OUT.obj, .glb or .gltf", s->output != NULL ? s->output : s->input);
    }
    if (cli_same_file(s->output, s->input)) {
        return cli_usage("%s: the output is the input", s->output);
    }
    if (s->picture != NULL && (cli_same_file(s->picture, s->input) || cli_same_file(s->picture, s->output))) {
        return cli_usage("%s: the picture is the %s", s->picture,
                         cli_same_file(s->picture, s->input) ? "input" : "output");
    }
    if (s->picture != NULL) {
        static const char *const names[3] = {"R", "G", "B"};
        const vsh_image image = {
            .width = s->options.width, .height = s->options.height, .channel_count = 3, .names = names};
        vsh_image_options as = vsh_image_options_default();
        vsh_error error;
        as.bits = 8;
        if (vsh_image_check(s->picture, &image, &as, &error) != VSH_OK) {
            return cli_fail(&error);
        }
    }
    return cli_temporary_check(s->output);
}

static void say_summary(const unwrap_settings *s, const vsh_atlas *atlas, double seconds) {
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    cli_say("%s: %" PRIu64
            " charts on %u page%s of %s%d × %d, %.1f %% covered, %.4g texels a unit, stretch %.3f (worst "
            "%.3f), %.2f s",
            s->output, info.charts, info.pages, info.pages == 1 ? "" : "s",
            s->options.fit_pages && info.pages > 1 ? "up to " : "", info.width, info.height,
            100.0 * info.covered, info.texels_per_unit, info.stretch, info.worst_stretch, seconds);
    if (info.kept > 0 || info.shared > 0) {
        cli_say("%s: %" PRIu64 " mesh%s kept their UVs, %" PRIu64 " share the layout of another", s->output,
                info.kept, info.kept == 1 ? "" : "es", info.shared);
    }
}

static int unwrap(unwrap_settings *s) {
    const double start = vshi_seconds();
    const vsh_run run = cli_common_run(&s->common);
    vsh_model *model = NULL;
    vsh_atlas *atlas = NULL;
    vsh_mesh *meshes = NULL;
    double *density = NULL;
    vsh_error error;
    int code;
    if (vsh_model_read(s->input, &run, &model, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
        goto done;
    }
    const size_t count = vsh_model_mesh_count(model);
    meshes = calloc(count, sizeof *meshes);
    density = calloc(count, sizeof *density);
    if (meshes == NULL || density == NULL) {
        code = cli_out_of_memory(s->input);
        goto done;
    }
    for (size_t m = 0; m < count; ++m) {
        meshes[m] = vsh_model_mesh(model, m, -1);
    }
    s->options.density = density;
    if (vsh_model_densities(model, s->input, s->densities.list, s->densities.count, density, &error) !=
            VSH_OK ||
        vsh_unwrap(meshes, count, &s->options, &run, &atlas, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
        goto done;
    }
    if (s->picture != NULL) {
        CLI_TRY_DONE(cli_unwrap_write_picture(s->picture, atlas));
    }
    CLI_TRY_DONE(cli_unwrap_write_mesh(s->input, s->output, model, meshes, atlas,
                                       s->options.atlas == VSH_ATLAS_OBJECTS, &run));
    cli_signals_end(CLI_OK);
    if (!s->common.quiet) {
        say_summary(s, atlas, vshi_seconds() - start);
    }
done:
    vsh_atlas_free(atlas);
    free(density);
    free(meshes);
    vsh_model_free(model);
    return code;
}

static int unwrap_main(int argc, char **argv) {
    static unwrap_settings s; /* of the process's one command */
    memset(&s, 0, sizeof s);
    s.options = vsh_unwrap_options_default();
    s.common = cli_common_default();
    bool help;
    int code = cli_parse(&cli_unwrap, argc, argv, take, &s, "INPUT", &s.input, &help);
    if (code != CLI_OK || help) {
        goto done;
    }
    cli_progress_begin(s.common.progress, s.common.quiet);
    CLI_TRY_DONE(check_atlas(&s));
    CLI_TRY_DONE(check_files(&s));
    cli_signals_watch();
    code = unwrap(&s);
done:
    cli_densities_free(&s.densities);
    cli_progress_end();
    return code;
}
