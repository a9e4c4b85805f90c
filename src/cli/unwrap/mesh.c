/* The mesh file that is written. */
#include "cli/signals.h"
#include "cli/try.h"
#include "unwrap.h"

#include <stdlib.h>

static void place_all(const vsh_atlas *atlas, vsh_lit_mesh *meshes) {
    for (size_t i = 0; i < vsh_atlas_mesh_count(atlas); ++i) {
        const vsh_atlas_mesh placed = vsh_atlas_mesh_view(atlas, i);
        meshes[i] = (vsh_lit_mesh){.uvs = placed.uvs,
                                   .sources = placed.sources,
                                   .indices = placed.indices,
                                   .charts = placed.charts,
                                   .vertex_count = placed.vertex_count,
                                   .triangle_count = placed.triangle_count};
    }
}

int cli_unwrap_write_mesh(const char *input, const char *path, const vsh_model *model, const vsh_atlas *atlas,
                          const vsh_run *run) {
    vsh_lit_options options = vsh_lit_options_default();
    vsh_lit_mesh *meshes = calloc(vsh_atlas_mesh_count(atlas), sizeof *meshes);
    uint32_t *pages = calloc(vsh_atlas_chart_count(atlas) + 1, sizeof *pages);
    int code = CLI_OK;
    if (meshes == NULL || pages == NULL) {
        code = cli_out_of_memory(path);
        goto done;
    }
    place_all(atlas, meshes);
    options.chart_pages = pages;
    options.chart_count = vsh_atlas_chart_count(atlas);
    for (size_t i = 0; i < options.chart_count; ++i) {
        pages[i] = vsh_atlas_charts(atlas)[i].page;
    }
    vsh_error error;
    cli_signals_writing(path);
    if (vsh_lit_write(input, model, meshes, &options, path, run, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
    }
    cli_signals_writing(NULL);
done:
    free(pages);
    free(meshes);
    return code;
}
