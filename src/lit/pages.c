/* Primitives on several pages. */
#include "lit/work.h"

#include <stdlib.h>

uint32_t vshi_lit_only_page(const vshi_lit_work *work, const vsh_lit_mesh *mesh) {
    uint32_t only = VSH_LIT_NO_CHART;
    for (size_t t = 0; mesh->charts != NULL && t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_lit_page(work, mesh, t);
        if (page != VSH_LIT_NO_CHART && only != VSH_LIT_NO_CHART && page != only) {
            return VSH_LIT_NO_CHART;
        }
        only = page != VSH_LIT_NO_CHART ? page : only;
    }
    /* one that has no place anywhere is dark on all */
    return mesh->charts == NULL ? mesh->page : only == VSH_LIT_NO_CHART ? 0 : only;
}

static vsh_result add(vshi_lit_work *work, const json_t *made, size_t indices, uint32_t page, size_t set,
                      json_t *list, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    json_t *primitive = vshi_gltf_copy(made);
    if (primitive == NULL || json_array_append_new(list, primitive) != 0) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_set(document, primitive, "indices", json_integer((json_int_t)indices), error));
    return vshi_lit_mark_primitive(work, primitive, page, set, NULL, error);
}

/* Triangles of a page, and (on the first) those that have none: corners of them into chosen[]. */
static size_t choose(const vshi_lit_work *work, const vsh_lit_mesh *mesh, const uint32_t *corners,
                     uint32_t page, bool first, uint32_t *chosen) {
    size_t count = 0;
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t own = vshi_lit_page(work, mesh, t);
        if (own == page || (first && own == VSH_LIT_NO_CHART)) {
            for (size_t k = 0; k < 3; ++k) {
                chosen[count++] = corners[3 * t + k];
            }
        }
    }
    return count;
}

static vsh_result split(vshi_lit_work *work, const json_t *made, const vsh_lit_mesh *mesh,
                        const uint32_t *corners, size_t vertex_count, size_t set, bool *used,
                        uint32_t *chosen, json_t *list, vsh_error *error) {
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        const uint32_t page = vshi_lit_page(work, mesh, t);
        if (page != VSH_LIT_NO_CHART) {
            used[page] = true;
        }
    }
    bool first = true;
    for (size_t page = 0; page < work->page_count; ++page) {
        if (!used[page]) {
            continue;
        }
        const size_t count = choose(work, mesh, corners, (uint32_t)page, first, chosen);
        size_t indices;
        first = false;
        VSHI_TRY(vshi_lit_add_indices(&work->document, chosen, count, vertex_count, &indices, error));
        VSHI_TRY(add(work, made, indices, (uint32_t)page, set, list, error));
    }
    return VSH_OK;
}

vsh_result vshi_lit_pages_make(vshi_lit_work *work, const json_t *made, const vsh_lit_mesh *mesh,
                               const uint32_t *corners, size_t vertex_count, size_t set, size_t *whole,
                               json_t *list, vsh_error *error) {
    vshi_lit_document *document = &work->document;
    const uint32_t only = vshi_lit_only_page(work, mesh);
    if (only != VSH_LIT_NO_CHART) {
        if (*whole == SIZE_MAX) {
            VSHI_TRY(vshi_lit_add_indices(document, corners, 3 * mesh->triangle_count, vertex_count, whole,
                                          error));
        }
        return add(work, made, *whole, only, set, list, error);
    }
    uint32_t *chosen = NULL;
    bool *used = NULL;
    vsh_result result;
    const double held = document->gltf.bytes_held;
    VSHI_TRY_DONE(vshi_gltf_allocate(&document->gltf, (void **)&used, work->page_count, sizeof *used, error));
    VSHI_TRY_DONE(
        vshi_gltf_take(&document->gltf, (void **)&chosen, mesh->triangle_count, 3 * sizeof *chosen, error));
    document->gltf.bytes_held = held;
    VSHI_TRY_DONE(split(work, made, mesh, corners, vertex_count, set, used, chosen, list, error));
done:
    free(chosen);
    free(used);
    return result;
}
