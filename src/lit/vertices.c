/* The vertices of a lit primitive: which elements of its accessors they are, copies of these, and new
 * sets of UVs. */
#include "base/memory.h"
#include "lit/work.h"

#include <stdlib.h>
#include <string.h>

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
    size_t index, count = 0;
    vshi_gltf_accessor positions;
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), "POSITION", "accessors", where,
                             &index, error));
    if (index == SIZE_MAX) {
        return fail_other(document, where, error);
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &positions, error));
    topology->element_count = positions.count;
    uint32_t *corners = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_read_triangles(gltf, primitive, topology->mode, positions.count, where, &corners,
                                           &count, error));
    VSHI_TRY_DONE(match(document, corners, count, where, mesh, topology, error));
done:
    free(corners);
    return result;
}

vsh_result vshi_lit_topology_find(vshi_lit_document *document, const json_t *primitive, const char *where,
                                  const vshi_lit_draco *draco, const vsh_mesh *mesh,
                                  vshi_lit_topology *topology, vsh_error *error) {
    *topology = (vshi_lit_topology){.draco = draco};
    if (!vshi_gltf_count(primitive, "mode", VSHI_GLTF_TRIANGLES, &topology->mode) ||
        topology->mode < VSHI_GLTF_TRIANGLES || topology->mode > VSHI_GLTF_FAN) {
        return fail_other(document, where, error);
    }
    if (draco == NULL) {
        return find_plain(document, primitive, where, mesh, topology, error);
    }
    topology->mode =
        VSHI_GLTF_TRIANGLES; /* Draco's triangles are lists, even if the primitive has another mode */
    topology->element_count = draco->vertex_count;
    return match(document, draco->indices, draco->triangle_count, where, mesh, topology, error);
}

void vshi_lit_topology_free(vshi_lit_topology *topology) {
    free(topology->elements);
    topology->elements = NULL;
}

void vshi_lit_gathered_free(vshi_lit_gathered *gathered) {
    free(gathered->list);
    *gathered = (vshi_lit_gathered){.list = NULL};
}

/* A sparse accessor becomes dense, in new memory. */
static vsh_result make_dense(vshi_lit_document *document, vshi_gltf_accessor *accessor, size_t size,
                             unsigned char **dense, vsh_error *error) {
    VSHI_TRY(vshi_gltf_allocate(&document->gltf, (void **)dense, accessor->count, size, error));
    for (size_t i = 0; i < accessor->count && accessor->at != NULL; ++i) {
        memcpy(*dense + i * size, accessor->at + i * accessor->stride, size);
    }
    const size_t index_size = vshi_gltf_component_size(accessor->sparse_type);
    for (size_t i = 0; i < accessor->sparse_count; ++i) {
        const size_t index =
            vshi_gltf_integer_at(accessor->sparse_at + i * index_size, accessor->sparse_type);
        memcpy(*dense + index * size, accessor->sparse_values + i * size, size);
    }
    accessor->at = *dense;
    accessor->stride = size;
    return VSH_OK;
}

static vsh_result find_elements(vshi_lit_document *document, size_t index, size_t element_count,
                                const vshi_lit_draco_attribute *draco, const char *where,
                                vshi_gltf_accessor *found, unsigned char **dense, vsh_error *error) {
    VSHI_TRY(vshi_gltf_accessor_open(&document->gltf, index, found, error));
    const size_t size = (size_t)found->components * vshi_gltf_component_size(found->type);
    if (draco != NULL) {
        found->at = draco->values;
        found->stride = size;
        return draco->type == found->type && draco->components == found->components
                   ? VSH_OK
                   : vshi_gltf_fail(&document->gltf, error, "%s: accessors[%zu] is not what was decompressed",
                                    where, index);
    }
    if (found->count != element_count) {
        return vshi_gltf_fail(&document->gltf, error, "%s: accessors[%zu] has %zu elements for %zu vertices",
                              where, index, found->count, element_count);
    }
    return found->sparse_count > 0 ? make_dense(document, found, size, dense, error) : VSH_OK;
}

static vsh_result copy(vshi_lit_document *document, size_t index, const vshi_gltf_accessor *from,
                       const uint32_t *chosen, size_t count, bool bounds, size_t *accessor,
                       vsh_error *error) {
    const size_t size = (size_t)from->components * vshi_gltf_component_size(from->type);
    const size_t stride = (size + 3) & ~(size_t)3; /* of vertex attributes: a multiple of 4 */
    size_t bytes, view, offset;
    if (__builtin_mul_overflow(count, stride, &bytes)) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_add_view(document, NULL, bytes, VSHI_LIT_VERTICES, stride != size ? stride : 0, &view,
                               &offset, error));
    unsigned char *to = document->added.at + offset;
    for (size_t i = 0; i < count && from->at != NULL; ++i) {
        memcpy(to + i * stride, from->at + chosen[i] * from->stride, size);
    }
    json_t *made = vshi_gltf_copy(vshi_gltf_element(&document->gltf, "accessors", index));
    VSHI_TRY(vshi_lit_append(document, "accessors", made, accessor, error));
    json_object_del(made, "byteOffset");
    json_object_del(made, "sparse");
    VSHI_TRY(vshi_lit_set_number(document, made, "bufferView", view, error));
    VSHI_TRY(vshi_lit_set_number(document, made, "count", count, error));
    const bool had = json_object_get(made, "min") != NULL || json_object_get(made, "max") != NULL;
    const vshi_gltf_accessor copied = {
        .count = count, .components = from->components, .type = from->type, .at = to, .stride = stride};
    return (bounds || had) && count > 0 ? vshi_lit_set_bounds(document, made, &copied, error) : VSH_OK;
}

vsh_result vshi_lit_gather(vshi_lit_document *document, size_t index, size_t element_count,
                           const vshi_lit_draco_attribute *draco, const uint32_t *chosen, size_t count,
                           bool bounds, const char *where, vshi_lit_gathered *gathered, size_t *accessor,
                           vsh_error *error) {
    for (size_t i = 0; i < gathered->count; ++i) {
        if (gathered->list[i].from == index) {
            *accessor = gathered->list[i].to;
            return VSH_OK;
        }
    }
    vshi_gltf_accessor from;
    unsigned char *dense = NULL;
    vsh_result result;
    VSHI_TRY_DONE(find_elements(document, index, element_count, draco, where, &from, &dense, error));
    VSHI_TRY_DONE(copy(document, index, &from, chosen, count, bounds, accessor, error));
    VSHI_TRY_DONE(vshi_lit_grow(document, &gathered->list, gathered->count, &gathered->capacity,
                                sizeof *gathered->list, error));
    gathered->list[gathered->count++] = (vshi_lit_copy){index, *accessor};
done:
    free(dense);
    return result;
}

void vshi_lit_uv_pool_free(vshi_lit_uv_pool *pool) {
    for (size_t i = 0; i < pool->count; ++i) {
        free(pool->list[i].set);
    }
    free(pool->list);
    *pool = (vshi_lit_uv_pool){.list = NULL};
}

static unsigned char *place(const vshi_lit_document *document, const vshi_lit_uvs *uvs, uint32_t element) {
    return document->added.at + uvs->offset + (size_t)element * sizeof(float[2]);
}

static bool fits(const vshi_lit_document *document, const vshi_lit_uvs *uvs, const uint32_t *elements,
                 const float (*values)[2], size_t count) {
    for (size_t i = 0; i < count; ++i) {
        if (uvs->set[elements[i]] &&
            memcmp(place(document, uvs, elements[i]), values[i], sizeof values[i]) != 0) {
            return false;
        }
    }
    return true;
}

static vsh_result add(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                      size_t element_count, vsh_error *error) {
    VSHI_TRY(vshi_lit_grow(document, &pool->list, pool->count, &pool->capacity, sizeof *pool->list, error));
    vshi_lit_uvs *made = &pool->list[pool->count];
    *made = (vshi_lit_uvs){.positions = positions, .count = element_count};
    VSHI_TRY(
        vshi_gltf_allocate(&document->gltf, (void **)&made->set, element_count, sizeof *made->set, error));
    ++pool->count;
    return vshi_lit_add_floats(document, NULL, element_count, 2, false, &made->accessor, &made->offset,
                               error);
}

vsh_result vshi_lit_uv_pool_put(vshi_lit_document *document, vshi_lit_uv_pool *pool, size_t positions,
                                size_t element_count, const uint32_t *elements, const float (*values)[2],
                                size_t count, size_t *accessor, vsh_error *error) {
    size_t found = 0;
    while (found < pool->count &&
           (pool->list[found].positions != positions || pool->list[found].count != element_count ||
            !fits(document, &pool->list[found], elements, values, count))) {
        ++found;
    }
    if (found == pool->count) {
        VSHI_TRY(add(document, pool, positions, element_count, error));
    }
    const vshi_lit_uvs *uvs = &pool->list[found];
    for (size_t i = 0; i < count; ++i) {
        memcpy(place(document, uvs, elements[i]), values[i], sizeof values[i]);
        uvs->set[elements[i]] = true;
    }
    *accessor = uvs->accessor;
    return VSH_OK;
}
