/* vdbshade unwrap: a mesh file's meshes get lightmap UVs. */
#include "base/clock.h"
#include "base/utf8.h"
#include "cli/commands.h"
#include "cli/message.h"
#include "cli/paths.h"
#include "cli/signals.h"
#include "cli/temporary.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum {
    KEY_ATLAS = 0x2000,
    KEY_SIZE,
    KEY_MAX_SIZE,
    KEY_PAGES,
    KEY_DENSITY,
    KEY_PADDING,
    KEY_STRETCH,
    KEY_KEEP
};

typedef struct unwrap_settings {
    const char *input;
    const char *output;
    bool has_size;
    int32_t max_size; /* 0: not given */
    vsh_unwrap_options options;
    cli_densities densities;
} unwrap_settings;

static const cli_option options[] = {
    {0, NULL, NULL, "Output"},
    {CLI_TEXT(unwrap_settings, output), "output", "OUT",
     "mesh file to write, with the UVs that were made: .glb or\n.gltf, the input with one more set; .obj, "
     "its meshes "
     "in\nthe world with that set alone"},
    {0, NULL, NULL, "Atlas"},
    {KEY_ATLAS, "atlas", "WHAT",
     "objects: each has a page of its own; shared: all lie on the\nsame (shared)"},
    {KEY_SIZE, "size", "N|WxH", "texels of each page (1024)"},
    {KEY_MAX_SIZE, "max-size", "N",
     "with --texels-per-unit, instead of --size: pages are as\nsmall as the charts allow, with sides that "
     "are powers of\ntwo up to N"},
    {KEY_PAGES, "pages", "N", "pages at most, 1 to 1024 (1)"},
    {CLI_POSITIVE(unwrap_settings, options.texels_per_unit), "texels-per-unit", "X",
     "density, texels along a unit of length (the greatest that\nfits)"},
    {KEY_DENSITY, "density", "PATTERN=X",
     "factor of it for the objects that PATTERN means;\nrepeatable, the last that means one holds (1)"},
    {KEY_PADDING, "padding", "N", "free texels between charts, 0 to 4096 (4)"},
    {0, NULL, NULL, "Charts"},
    {KEY_STRETCH, "max-stretch", "X", "L2 stretch that no chart exceeds, from 1.01 on (1.3)"},
    {KEY_KEEP, "keep", NULL, "meshes whose UVs can serve keep their charts, which are\nonly packed"},
    CLI_COMMON_OPTIONS,
};

static int take(void *settings, int key, const char *name, const char *value) {
    unwrap_settings *s = settings;
    vsh_unwrap_options *o = &s->options;
    switch (key) {
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
    case KEY_DENSITY:
        return cli_density_take(&s->densities, name, value);
    case KEY_PADDING:
        return cli_parse_integer(name, value, 0, 4096, &o->padding);
    case KEY_STRETCH:
        return cli_parse_number(name, value, 1.01, 1e9, &o->max_stretch);
    default: /* --keep */
        o->keep_uvs = VSH_UNWRAP_KEEP;
        return CLI_OK;
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

/* Refuses outputs before anything is read. */
static int check_files(const unwrap_settings *s) {
    if (!vsh_lit_is_output(s->output)) {
        return cli_usage("%s: give -o OUT.obj, .glb or .gltf", s->output != NULL ? s->output : s->input);
    }
    CLI_TRY(cli_check_apart(s->output, s->input, "the input"));
    return cli_temporary_check(s->output);
}

/* --- the mesh file */

enum { NAME_BYTES = 120 }; /* of a page's */

/* The name of a mesh's object as a page may have it; NULL: none, or one that names of files cannot have. */
static const char *page_name(const vsh_mesh *mesh) {
    const char *name = mesh->object_name != NULL ? mesh->object_name : mesh->name;
    const size_t size = name != NULL ? strlen(name) : 0;
    bool good = size > 0 && size <= NAME_BYTES;
    for (size_t i = 0, length; i < size && good; i += length) {
        length = vshi_utf8_length(name + i);
        good = length > 0 && (unsigned char)name[i] >= ' ' && strchr("/\\\x7f", name[i]) == NULL;
    }
    return good ? name : NULL;
}

/* Gives each page the name of the object on it, unless an earlier page has it. */
static void name_pages(const vsh_mesh *meshes, const vsh_atlas *atlas, const char **names) {
    const vsh_atlas_chart *charts = vsh_atlas_charts(atlas);
    for (size_t i = 0; i < vsh_atlas_mesh_count(atlas); ++i) {
        const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, i);
        const char *name = page_name(&meshes[i]);
        size_t t = 0;
        while (t < placed.triangle_count && placed.charts[t] == VSH_NO_CHART) {
            ++t;
        }
        if (t < placed.triangle_count && name != NULL) {
            const uint32_t page = charts[placed.charts[t]].page;
            bool taken = names[page] != NULL;
            for (size_t p = 0; p < vsh_atlas_page_count(atlas) && !taken; ++p) {
                taken = names[p] != NULL && strcmp(names[p], name) == 0;
            }
            names[page] = taken ? names[page] : name;
        }
    }
}

/* Writes the model, whose meshes have places in the atlas. Pages have the names of the objects on them where
 * each object has its own. */
static int write_model(const unwrap_settings *s, const vsh_model *model, const vsh_mesh *meshes,
                       const vsh_atlas *atlas, const vsh_run *run) {
    vsh_lit_options lit = vsh_lit_options_default();
    vsh_lit_mesh *places = calloc(vsh_atlas_mesh_count(atlas) + 1, sizeof *places);
    const char **names = calloc(vsh_atlas_page_count(atlas) + 1, sizeof *names);
    uint32_t *pages = calloc(vsh_atlas_chart_count(atlas) + 1, sizeof *pages);
    for (size_t i = 0; i < vsh_atlas_mesh_count(atlas); ++i) {
        const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, i);
        places[i] = (vsh_lit_mesh){.uvs = placed.uvs,
                                   .sources = placed.sources,
                                   .indices = placed.indices,
                                   .charts = placed.charts,
                                   .vertex_count = placed.vertex_count,
                                   .triangle_count = placed.triangle_count};
    }
    if (s->options.atlas == VSH_ATLAS_OBJECTS) {
        name_pages(meshes, atlas, names);
        lit.page_names = names;
        lit.page_count = vsh_atlas_page_count(atlas);
    }
    lit.chart_pages = pages;
    lit.chart_count = vsh_atlas_chart_count(atlas);
    for (size_t i = 0; i < lit.chart_count; ++i) {
        pages[i] = vsh_atlas_charts(atlas)[i].page;
    }
    vsh_error error;
    const vsh_result result = vsh_lit_write(s->input, model, places, &lit, s->output, run, &error);
    free(pages);
    free((void *)names);
    free(places);
    return cli_check_result(result, &error);
}

/* --- the command */

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
    const vsh_run run = cli_make_run();
    vsh_model *model = NULL;
    vsh_atlas *atlas = NULL;
    vsh_mesh *meshes = NULL;
    double *density = NULL;
    vsh_error error;
    int code;
    CLI_TRY_DONE(cli_check_result(vsh_model_read(s->input, &run, &model, &error), &error));
    const size_t count = vsh_model_mesh_count(model);
    meshes = calloc(count, sizeof *meshes);
    density = calloc(count, sizeof *density);
    for (size_t m = 0; m < count; ++m) {
        meshes[m] = vsh_model_mesh(model, m, -1);
    }
    s->options.density = density;
    CLI_TRY_DONE(cli_check_result(
        vsh_model_densities(model, s->input, s->densities.list, s->densities.count, density, &error),
        &error));
    CLI_TRY_DONE(cli_check_result(vsh_unwrap(meshes, count, &s->options, &run, &atlas, &error), &error));
    CLI_TRY_DONE(write_model(s, model, meshes, atlas, &run));
    cli_signals_end(CLI_OK);
    if (!cli_given.quiet) {
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
    unwrap_settings s = {.options = vsh_unwrap_options_default()};
    CLI_TRY(cli_parse(&cli_unwrap, argc, argv, take, &s, &s.input));
    CLI_TRY(check_atlas(&s));
    CLI_TRY(check_files(&s));
    cli_signals_watch();
    return unwrap(&s);
}

const cli_command cli_unwrap = {
    "unwrap",
    "INPUT -o OUT [options]",
    "Cuts the meshes of a file into charts, lays them out flat, and packs them into an atlas:\n"
    "lightmap UVs for meshes that have none. Numbers in brackets are what holds without the\n"
    "option.",
    options,
    sizeof options / sizeof options[0],
    unwrap_main};
