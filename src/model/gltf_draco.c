/* Primitives whose vertices are compressed by Draco. */
#include "model/gltf.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>

static vsh_result take_attribute(vshi_gltf *gltf, const vshi_draco *mesh, const json_t *attributes,
                                 const char *name, int components, const char *where, float **values,
                                 vsh_error *error) {
    size_t id;
    if (!vshi_gltf_count(attributes, name, SIZE_MAX, &id)) {
        return vshi_gltf_fail(gltf, error, "%s: its compressed %s is no index", where, name);
    }
    if (id == SIZE_MAX) {
        return VSH_OK;
    }
    const size_t count = mesh->vertex_count, size = (size_t)components * sizeof **values;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)values, count, size, error));
    if (id > UINT32_MAX ||
        !vshi_importers()->draco_elements(mesh, (uint32_t)id, VSHI_DRACO_FLOAT, components, *values)) {
        return vshi_gltf_fail(gltf, error, "%s: its Draco data has no attribute %zu of %d components", where,
                              id, components);
    }
    return VSH_OK;
}

vsh_result vshi_gltf_draco_indices(vshi_gltf *gltf, const vshi_draco *mesh, const char *where,
                                   uint32_t **indices, vsh_error *error) {
    const size_t count = mesh->triangle_count;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)indices, count, sizeof(uint32_t[3]), error));
    if (count > 0) {
        vshi_importers()->draco_indices(mesh, *indices);
    }
    for (size_t i = 0; i < 3 * count; ++i) {
        if ((*indices)[i] >= mesh->vertex_count) {
            return vshi_gltf_fail(gltf, error, "%s: its Draco data uses vertex %u of %zu", where,
                                  (*indices)[i], mesh->vertex_count);
        }
    }
    return VSH_OK;
}

static vsh_result take_mesh(vshi_gltf *gltf, const vshi_draco *mesh, const json_t *attributes,
                            const char *where, vshi_model_shape *shape, vsh_error *error) {
    shape->vertex_count = mesh->vertex_count;
    VSHI_TRY(take_attribute(gltf, mesh, attributes, "POSITION", 3, where, &shape->positions, error));
    if (shape->positions == NULL) {
        return vshi_gltf_fail(gltf, error, "%s: its Draco data has no positions", where);
    }
    VSHI_TRY(take_attribute(gltf, mesh, attributes, "NORMAL", 3, where, &shape->normals, error));
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        char name[32];
        snprintf(name, sizeof name, "TEXCOORD_%d", set);
        VSHI_TRY(take_attribute(gltf, mesh, attributes, name, 2, where, &shape->uvs[set], error));
        shape->uv_sets = shape->uvs[set] != NULL ? set + 1 : shape->uv_sets;
    }
    shape->triangle_count = mesh->triangle_count;
    return vshi_gltf_draco_indices(gltf, mesh, where, &shape->indices, error);
}

vsh_result vshi_gltf_decode_draco(vshi_gltf *gltf, const json_t *extension, const char *where,
                                  vshi_draco **mesh, vsh_error *error) {
    vshi_gltf_bytes bytes;
    size_t view, stride;
    VSHI_TRY(vshi_gltf_index(gltf, extension, "bufferView", "bufferViews", where, &view, error));
    if (view == SIZE_MAX) {
        return vshi_gltf_fail(gltf, error, "%s: its Draco data has no buffer view", where);
    }
    VSHI_TRY(vshi_gltf_view(gltf, view, &bytes, &stride, error));
    VSHI_TRY(vshi_importers_load(error));
    return vshi_importers()->draco_decode(bytes.at, bytes.size, gltf->path, mesh, error);
}

vsh_result vshi_gltf_read_draco(vshi_gltf *gltf, const json_t *extension, const char *where,
                                vshi_model_shape *shape, vsh_error *error) {
    vshi_draco *mesh = NULL;
    VSHI_TRY(vshi_gltf_decode_draco(gltf, extension, where, &mesh, error));
    const vsh_result result =
        take_mesh(gltf, mesh, json_object_get(extension, "attributes"), where, shape, error);
    vshi_importers()->draco_free(mesh);
    return result;
}
