/* The mesh file that is written. */
#include "base/utf8.h"
#include "cli/message.h"
#include "unwrap.h"

#include <stdlib.h>
#include <string.h>

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

int cli_unwrap_write_mesh(const char *input, const char *path, const vsh_model *model, const vsh_mesh *meshes,
                          const vsh_atlas *atlas, bool objects, const vsh_run *run) {
    vsh_lit_options options = vsh_lit_options_default();
    vsh_lit_mesh *places = calloc(vsh_atlas_mesh_count(atlas) + 1, sizeof *places);
    const char **names = calloc(vsh_atlas_page_count(atlas) + 1, sizeof *names);
    uint32_t *pages = calloc(vsh_atlas_chart_count(atlas) + 1, sizeof *pages);
    int code = CLI_OK;
    if (places == NULL || names == NULL || pages == NULL) {
        code = cli_out_of_memory(path);
        goto done;
    }
    place_all(atlas, places);
    if (objects) {
        name_pages(meshes, atlas, names);
        options.page_names = names;
        options.page_count = vsh_atlas_page_count(atlas);
    }
    options.chart_pages = pages;
    options.chart_count = vsh_atlas_chart_count(atlas);
    for (size_t i = 0; i < options.chart_count; ++i) {
        pages[i] = vsh_atlas_charts(atlas)[i].page;
    }
    vsh_error error;
    if (vsh_lit_write(input, model, places, &options, path, run, &error) != VSH_OK) {
        code = cli_fail_of(NULL, &error);
    }
done:
    free(pages);
    free((void *)names);
    free(places);
    return code;
}
