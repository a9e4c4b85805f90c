#include "lit/topology.h"

#include "base/memory.h"

#include <stdlib.h>
#include <string.h>

/* The elements that a primitive draws, in its order, in new memory. */
static vsh_result read_order(vshi_lit_document *document, const json_t *primitive, size_t element_count,
                             const char *where, uint32_t **order, size_t *count, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    vshi_gltf_accessor accessor = {.count = element_count};
    size_t index;
    VSHI_TRY(vshi_gltf_index(gltf, primitive, "indices", "accessors", where, &index, error));
    if (index != SIZE_MAX) {
        VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
        if (accessor.components != 1 ||
            (accessor.type != VSHI_GLTF_UBYTE && accessor.type != VSHI_GLTF_USHORT &&
             accessor.type != VSHI_GLTF_UINT)) {
            return vshi_gltf_fail(gltf, error, "%s: its indices are no unsigned numbers", where);
        }
    }
    *count = accessor.count;
    VSHI_TRY(vshi_gltf_take(gltf, (void **)order, accessor.count, sizeof **order, error));
    if (index != SIZE_MAX) {
        vshi_gltf_accessor_integers(&accessor, *order);
    }
    for (size_t i = 0; i < accessor.count; ++i) {
        (*order)[i] = index == SIZE_MAX ? (uint32_t)i : (*order)[i];
        if ((*order)[i] >= element_count) {
            return vshi_gltf_fail(gltf, error, "%s: index %zu is %u, but there are only %zu vertices", where,
                                  i, (*order)[i], element_count);
        }
    }
    return VSH_OK;
}

/* Triangle i (glTF 2.0, 3.7.2.1). */
static void pick(size_t mode, const uint32_t *order, size_t i, uint32_t corner[3]) {
    if (mode == VSHI_LIT_STRIP) {
        corner[0] = order[i];
        corner[1] = order[i + 1 + i % 2];
        corner[2] = order[i + 2 - i % 2];
    } else if (mode == VSHI_LIT_FAN) {
        corner[0] = order[i + 1];
        corner[1] = order[i + 2];
        corner[2] = order[0];
    } else {
        memcpy(corner, order + 3 * i, 3 * sizeof *corner);
    }
}

/* The triangles that the order draws, as corners[*count][3], over the order itself: those of strips that have
 * fewer than three vertices are left out, as the model leaves them out. */
static vsh_result list_triangles(vshi_lit_document *document, size_t mode, size_t drawn, uint32_t **order,
                                 size_t *count, vsh_error *error) {
    if (mode == VSHI_LIT_TRIANGLES) {
        *count = drawn / 3;
        return VSH_OK;
    }
    const size_t most = drawn >= 3 ? drawn - 2 : 0;
    uint32_t *corners = NULL;
    *count = 0;
    VSHI_TRY(vshi_gltf_allocate(&document->gltf, (void **)&corners, most + 1, 3 * sizeof *corners, error));
    for (size_t i = 0; i < most; ++i) {
        uint32_t corner[3];
        pick(mode, *order, i, corner);
        if (corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0]) {
            memcpy(corners + 3 * (*count)++, corner, sizeof corner);
        }
    }
    free(*order);
    *order = corners;
    return VSH_OK;
}

static vsh_result fail_other(const vshi_lit_document *document, const char *where, vsh_error *error) {
    return vshi_gltf_fail(&document->gltf, error,
                          "%s: is not what the model was made of: the file has changed since", where);
}

/* Vertices of the model are the elements that triangles use, in their order: the others are not kept. */
static vsh_result match(vshi_lit_document *document, const uint32_t *corners, size_t count, const char *where,
                        const vsh_mesh *mesh, vshi_lit_topology *topology, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    if (count != mesh->triangle_count || mesh->vertex_count > topology->element_count) {
        return fail_other(document, where, error);
    }
    bool *used = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_allocate(gltf, (void **)&used, topology->element_count, sizeof *used, error));
    VSHI_TRY_DONE(vshi_gltf_take(gltf, (void **)&topology->elements, mesh->vertex_count,
                                 sizeof *topology->elements, error));
    for (size_t i = 0; i < 3 * count; ++i) {
        used[corners[i]] = true;
    }
    size_t vertices = 0;
    for (size_t e = 0; e < topology->element_count; ++e) {
        if (used[e] && vertices < mesh->vertex_count) {
            topology->elements[vertices] = (uint32_t)e;
        }
        vertices += used[e];
    }
    bool equal = vertices == mesh->vertex_count;
    for (size_t i = 0; equal && i < 3 * count; ++i) {
        equal = mesh->indices[i] < vertices && topology->elements[mesh->indices[i]] == corners[i];
    }
    topology->vertex_count = vertices;
    result = equal ? VSH_OK : fail_other(document, where, error);
done:
    free(used);
    return result;
}

static vsh_result find_plain(vshi_lit_document *document, const json_t *primitive, const char *where,
                             const vsh_mesh *mesh, vshi_lit_topology *topology, vsh_error *error) {
    vshi_gltf *gltf = &document->gltf;
    size_t index, drawn = 0, count = 0;
    vshi_gltf_accessor positions;
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), "POSITION", "accessors", where,
                             &index, error));
    if (index == SIZE_MAX) {
        return fail_other(document, where, error);
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &positions, error));
    topology->element_count = positions.count;
    uint32_t *order = NULL;
    vsh_result result;
    VSHI_TRY_DONE(read_order(document, primitive, positions.count, where, &order, &drawn, error));
    VSHI_TRY_DONE(list_triangles(document, topology->mode, drawn, &order, &count, error));
    VSHI_TRY_DONE(match(document, order, count, where, mesh, topology, error));
done:
    free(order);
    return result;
}

vsh_result vshi_lit_topology_find(vshi_lit_document *document, const json_t *primitive, const char *where,
                                  const vshi_lit_draco *draco, const vsh_mesh *mesh,
                                  vshi_lit_topology *topology, vsh_error *error) {
    *topology = (vshi_lit_topology){.draco = draco};
    if (!vshi_gltf_count(primitive, "mode", VSHI_LIT_TRIANGLES, &topology->mode) ||
        topology->mode < VSHI_LIT_TRIANGLES || topology->mode > VSHI_LIT_FAN) {
        return fail_other(document, where, error);
    }
    if (draco == NULL) {
        return find_plain(document, primitive, where, mesh, topology, error);
    }
    topology->mode = VSHI_LIT_TRIANGLES; /* whatever the primitive says: Draco's are lists */
    topology->element_count = draco->vertex_count;
    return match(document, draco->indices, draco->triangle_count, where, mesh, topology, error);
}

void vshi_lit_topology_free(vshi_lit_topology *topology) {
    free(topology->elements);
    topology->elements = NULL;
}
