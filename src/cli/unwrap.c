/* vdbshade unwrap: lightmap UVs for the meshes of a file. */
#include "base/clock.h"
#include "cli.h"

typedef struct unwrap_settings {
    const char *input;
    const char *output;
    int32_t size[2];
    int32_t max_size; /* 0: not given */
    bool keep;
    vsh_unwrap_options options;
    cli_densities densities;
} unwrap_settings;

static const cli_option options[] = {
    {.help = "Output"},
    {"output", "OUT",
     "mesh file to write, with the new UVs: .glb or .gltf, the input with one more set; .obj, its meshes in "
     "the "
     "world with that set alone",
     CLI_VALUE(TEXT, unwrap_settings, output)},
    {.help = "Atlas"},
    {"atlas", "WHAT", "objects: each has its own page; shared: all share the pages (shared)",
     CLI_RANGE(NAME, unwrap_settings, options.atlas, VSH_NAMES_ATLAS, 0)},
    {"size", "N|WxH", "texels of each page (1024)", CLI_VALUE(SIZE, unwrap_settings, size)},
    {"max-size", "N",
     "with --texels-per-unit, instead of --size: pages are as small as the charts allow, with sides that are "
     "powers of two up to N",
     CLI_RANGE(INTEGER, unwrap_settings, max_size, 1, VSH_MAX_PAGE_SIZE)},
    {"pages", "N", "pages at most, 1 to 1024 (1)",
     CLI_RANGE(INTEGER, unwrap_settings, options.max_pages, 1, VSH_MAX_PAGES)},
    {"texels-per-unit", "X", "density, texels along a unit of length (the greatest that fits)",
     CLI_VALUE(POSITIVE, unwrap_settings, options.texels_per_unit)},
    {"density", "PATTERN=X",
     "factor of the density for objects of that name; repeatable, the last matching pattern wins (1)",
     CLI_PARSED(unwrap_settings, densities, cli_parse_density)},
    {"padding", "N", "free texels between charts, 0 to 4096 (4)",
     CLI_RANGE(INTEGER, unwrap_settings, options.padding, 0, 4096)},
    {.help = "Charts"},
    {"max-stretch", "X", "L2 stretch that no chart exceeds, from 1.01 on (1.3)",
     CLI_RANGE(NUMBER, unwrap_settings, options.max_stretch, 1.01, 1e9)},
    {"keep", NULL, "meshes with usable UVs keep their charts, which are only packed",
     CLI_VALUE(FLAG, unwrap_settings, keep)},
    CLI_COMMON_OPTIONS,
};

/* Refuses options that contradict each other, and sets what follows from them. */
static int set_options(unwrap_settings *s) {
    vsh_unwrap_options *o = &s->options;
    CLI_REFUSE_IF(s->max_size > 0 && cli_was_given("size"), "--max-size and --size: give one of the two");
    CLI_REFUSE_IF(s->max_size > 0 && o->texels_per_unit == 0.0,
                  "--max-size: needs --texels-per-unit; without it charts fill pages of any size");
    CLI_REFUSE_IF(o->atlas == VSH_ATLAS_OBJECTS && o->max_pages > 1,
                  "--pages: not with --atlas objects, which gives each object one page");
    o->fit_pages = s->max_size > 0;
    o->width = s->max_size > 0 ? s->max_size : s->size[0];
    o->height = s->max_size > 0 ? s->max_size : s->size[1];
    o->keep_uvs = s->keep ? VSH_UNWRAP_KEEP : o->keep_uvs;
    return CLI_OK;
}

/* --- the mesh file */

/* Writes the model with the UVs of the atlas. */
static int write_model(const unwrap_settings *s, const vsh_model *model, const vsh_atlas *atlas) {
    vsh_lit_options lit = vsh_lit_options_default();
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    vsh_lit_mesh *places = calloc(info.meshes + 1, sizeof *places);
    uint32_t *pages = calloc(info.charts + 1, sizeof *pages);
    for (size_t i = 0; i < info.meshes; ++i) {
        const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, i);
        places[i] = (vsh_lit_mesh){.uvs = placed.uvs,
                                   .sources = placed.sources,
                                   .indices = placed.indices,
                                   .charts = placed.charts,
                                   .vertex_count = placed.vertex_count,
                                   .triangle_count = placed.triangle_count};
    }
    lit.chart_pages = pages;
    lit.chart_count = (size_t)info.charts;
    for (size_t i = 0; i < lit.chart_count; ++i) {
        pages[i] = vsh_atlas_charts(atlas)[i].page;
    }
    const vsh_result result = vsh_lit_write(s->input, model, places, &lit, s->output, &cli_run, &cli_error);
    free(pages);
    free(places);
    return cli_check_input(result);
}

/* --- the command */

static int unwrap(unwrap_settings *s) {
    const double start = vshi_seconds();
    vsh_model *model = NULL;
    vsh_atlas *atlas = NULL;
    vsh_mesh *meshes = NULL;
    double *density = NULL;
    int code;
    CLI_TRY_DONE(cli_check_input(vsh_model_read(s->input, &cli_run, &model, &cli_error)));
    const size_t count = vsh_model_mesh_count(model);
    meshes = calloc(count, sizeof *meshes);
    density = calloc(count, sizeof *density);
    for (size_t m = 0; m < count; ++m) {
        meshes[m] = vsh_model_mesh(model, m, -1);
    }
    s->options.density = density;
    CLI_TRY_DONE(cli_check_input(
        vsh_model_densities(model, s->input, s->densities.list, s->densities.count, density, &cli_error)));
    CLI_TRY_DONE(cli_check_input(vsh_unwrap(meshes, count, &s->options, &cli_run, &atlas, &cli_error)));
    CLI_TRY_DONE(write_model(s, model, atlas));
    cli_signals_end(CLI_OK);
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    cli_inform(
        "%s: %" PRIu64 " charts on %u page%s of %s%d × %d, %.1f %% covered, %.4g texels a unit, stretch %.3f "
        "(worst %.3f), %.2f s",
        s->output, info.charts, info.pages, info.pages == 1 ? "" : "s",
        s->options.fit_pages && info.pages > 1 ? "up to " : "", info.width, info.height, 100.0 * info.covered,
        info.texels_per_unit, info.stretch, info.worst_stretch, vshi_seconds() - start);
    if (info.kept > 0 || info.shared > 0) {
        cli_inform("%s: %" PRIu64 " mesh%s kept their UVs, %" PRIu64 " share the layout of another",
                   s->output, info.kept, info.kept == 1 ? "" : "es", info.shared);
    }
done:
    vsh_atlas_free(atlas);
    free(density);
    free(meshes);
    vsh_model_free(model);
    return code;
}

static int unwrap_main(int argc, char **argv) {
    unwrap_settings s = {.size = {1024, 1024}, .options = vsh_unwrap_options_default()};
    CLI_TRY(cli_parse(&cli_unwrap, argc, argv, &s, &s.input));
    CLI_TRY(set_options(&s));
    CLI_REFUSE_IF(!vsh_lit_is_output(s.output), "%s: give -o OUT.obj, .glb or .gltf",
                  s.output != NULL ? s.output : s.input);
    CLI_TRY(cli_check_outputs(&s.output, 1, &s.input, 1, NULL));
    cli_signals_watch();
    return unwrap(&s);
}

const cli_command cli_unwrap = {
    "unwrap", "INPUT -o OUT [options]", "lightmap UVs for meshes that have none",
    "Cuts the meshes of a file into charts, flattens them, and packs them into an atlas: lightmap UVs for\n"
    "meshes that have none. Numbers in brackets are defaults.",
    CLI_ENDING(options, unwrap_main)};
