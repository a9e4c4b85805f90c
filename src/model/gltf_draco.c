/* Primitives whose vertices are compressed by Draco. */
#include "model/gltf.h"

#include "base/memory.h"
#include "extern/draco.h"

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
    const size_t count = vshi_draco_vertex_count(mesh), size = (size_t)components * sizeof **values;
    vsh_result result = vshi_gltf_hold(gltf, (double)(count * size), error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)values, count, size, gltf->path, error);
    }
    if (result == VSH_OK &&
        (id > UINT32_MAX || !vshi_draco_attribute(mesh, (uint32_t)id, components, *values))) {
        result = vshi_gltf_fail(gltf, error, "%s: its Draco data has no attribute %zu of %d components",
                                where, id, components);
    }
    return result;
}

static vsh_result take_indices(vshi_gltf *gltf, const vshi_draco *mesh, const char *where,
                               vshi_model_shape *shape, vsh_error *error) {
    const size_t count = vshi_draco_triangle_count(mesh);
    vsh_result result = vshi_gltf_hold(gltf, (double)count * sizeof(uint32_t[3]), error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&shape->indices, count, sizeof(uint32_t[3]), gltf->path, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    vshi_draco_indices(mesh, shape->indices);
    for (size_t i = 0; i < 3 * count; ++i) {
        if (shape->indices[i] >= shape->vertex_count) {
            return vshi_gltf_fail(gltf, error, "%s: its Draco data uses vertex %u of %zu", where,
                                  shape->indices[i], shape->vertex_count);
        }
    }
    shape->triangle_count = count;
    return VSH_OK;
}

vsh_result vshi_gltf_read_draco(vshi_gltf *gltf, const json_t *extension, const char *where,
                                vshi_model_shape *shape, vsh_error *error) {
    const json_t *attributes = json_object_get(extension, "attributes");
    vshi_draco *mesh = NULL;
    vshi_gltf_bytes bytes;
    size_t view, stride;
    vsh_result result = vshi_gltf_index(gltf, extension, "bufferView", "bufferViews", where, &view, error);
    if (result == VSH_OK && view == SIZE_MAX) {
        result = vshi_gltf_fail(gltf, error, "%s: its Draco data has no buffer view", where);
    }
    if (result == VSH_OK) {
        result = vshi_gltf_view(gltf, view, &bytes, &stride, error);
    }
    if (result == VSH_OK) {
        result = vshi_draco_decode(bytes.at, bytes.size, gltf->path, &mesh, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    shape->vertex_count = vshi_draco_vertex_count(mesh);
    result = take_attribute(gltf, mesh, attributes, "POSITION", 3, where, &shape->positions, error);
    if (result == VSH_OK && shape->positions == NULL) {
        result = vshi_gltf_fail(gltf, error, "%s: its Draco data has no positions", where);
    }
    if (result == VSH_OK) {
        result = take_attribute(gltf, mesh, attributes, "NORMAL", 3, where, &shape->normals, error);
    }
    for (int set = 0; set < VSH_MAX_UV_SETS && result == VSH_OK; ++set) {
        char name[32];
        snprintf(name, sizeof name, "TEXCOORD_%d", set);
        result = take_attribute(gltf, mesh, attributes, name, 2, where, &shape->uvs[set], error);
        shape->uv_sets = shape->uvs[set] != NULL ? set + 1 : shape->uv_sets;
    }
    if (result == VSH_OK) {
        result = take_indices(gltf, mesh, where, shape, error);
    }
    vshi_draco_free(mesh);
    return result;
}
