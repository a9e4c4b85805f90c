/* A mesh's primitive: its vertices, and its triangles from lists, strips and fans. */
#include "model/gltf.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

vsh_result vshi_gltf_read_attribute(vshi_gltf *gltf, const json_t *attributes, const char *name,
                                    int components, size_t vertex_count, const char *where, float **values,
                                    vsh_error *error) {
    size_t index;
    vshi_gltf_accessor accessor;
    *values = NULL;
    VSHI_TRY(vshi_gltf_index(gltf, attributes, name, "accessors", where, &index, error));
    if (index == SIZE_MAX) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    if (accessor.components != components || accessor.type == VSHI_GLTF_UINT) {
        return vshi_gltf_fail(gltf, error,
                              "%s: %s has %d components of type %d, expected %d of type 5120 to 5123 or 5126",
                              where, name, accessor.components, accessor.type, components);
    }
    if (accessor.count != vertex_count) {
        return vshi_gltf_fail(gltf, error, "%s: %s has %zu elements for %zu vertices", where, name,
                              accessor.count, vertex_count);
    }
    const size_t size = (size_t)components * sizeof(float);
    VSHI_TRY(vshi_gltf_take(gltf, (void **)values, accessor.count, size, error));
    vshi_gltf_accessor_floats(&accessor, *values);
    return VSH_OK;
}

/* Whether its material lets light through, where that is told. */
static bool is_opaque(const vshi_gltf *gltf, const json_t *primitive) {
    size_t material;
    return !vshi_gltf_count(primitive, "material", SIZE_MAX, &material) ||
           material >= gltf->model->material_count ||
           gltf->model->materials[material].told.alpha == VSH_ALPHA_OPAQUE;
}

/* Whether its vertices have colours with alpha (3.7.2.1: COLOR_0 multiplies the base colour). */
static vsh_result has_alpha(vshi_gltf *gltf, const json_t *primitive, const char *where, bool *has,
                            vsh_error *error) {
    vshi_gltf_accessor accessor;
    size_t index;
    *has = false;
    if (is_opaque(gltf, primitive)) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), "COLOR_0", "accessors", where,
                             &index, error));
    if (index != SIZE_MAX) {
        VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
        *has = accessor.components == 4;
    }
    return VSH_OK;
}

static vsh_result read_alphas(vshi_gltf *gltf, const json_t *primitive, const char *where,
                              vshi_model_shape *shape, vsh_error *error) {
    const json_t *attributes = json_object_get(primitive, "attributes");
    const size_t count = shape->vertex_count;
    float *colors;
    bool has, whole = true;
    VSHI_TRY(has_alpha(gltf, primitive, where, &has, error));
    if (!has) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_read_attribute(gltf, attributes, "COLOR_0", 4, count, where, &colors, error));
    for (size_t v = 0; v < count; ++v) {
        colors[v] = colors[4 * v + 3];
        whole = whole && colors[v] >= 1.0F;
    }
    if (whole) {
        free(colors);
        return VSH_OK;
    }
    float *alphas = realloc(colors, count * sizeof *colors);
    shape->alphas = alphas != NULL ? alphas : colors;
    return VSH_OK;
}

static vsh_result read_vertices(vshi_gltf *gltf, const json_t *primitive, const char *where,
                                vshi_model_shape *shape, vsh_error *error) {
    const json_t *attributes = json_object_get(primitive, "attributes");
    const size_t count = shape->vertex_count;
    VSHI_TRY(
        vshi_gltf_read_attribute(gltf, attributes, "POSITION", 3, count, where, &shape->positions, error));
    VSHI_TRY(vshi_gltf_read_attribute(gltf, attributes, "NORMAL", 3, count, where, &shape->normals, error));
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        char name[32];
        snprintf(name, sizeof name, "TEXCOORD_%d", set);
        VSHI_TRY(vshi_gltf_read_attribute(gltf, attributes, name, 2, count, where, &shape->uvs[set], error));
        shape->uv_sets = shape->uvs[set] != NULL ? set + 1 : shape->uv_sets;
    }
    return read_alphas(gltf, primitive, where, shape, error);
}

/* The vertices in the order that a primitive draws them in: *order, *count of them. */
static vsh_result read_order(vshi_gltf *gltf, const json_t *primitive, size_t vertex_count, const char *where,
                             uint32_t **order, size_t *count, vsh_error *error) {
    size_t index;
    vshi_gltf_accessor accessor = {.count = vertex_count};
    VSHI_TRY(vshi_gltf_index(gltf, primitive, "indices", "accessors", where, &index, error));
    if (index != SIZE_MAX) {
        VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    }
    if (index != SIZE_MAX &&
        (accessor.components != 1 || (accessor.type != VSHI_GLTF_UBYTE && accessor.type != VSHI_GLTF_USHORT &&
                                      accessor.type != VSHI_GLTF_UINT))) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its indices have %d components of type %d, expected one of "
                              "type 5121, 5123 or 5125",
                              where, accessor.components, accessor.type);
    }
    *count = accessor.count;
    VSHI_TRY(vshi_gltf_take(gltf, (void **)order, accessor.count, sizeof **order, error));
    if (index != SIZE_MAX) {
        vshi_gltf_accessor_integers(&accessor, *order);
    }
    for (size_t i = 0; i < accessor.count && index == SIZE_MAX; ++i) {
        (*order)[i] = (uint32_t)i;
    }
    return vshi_model_check_indices(gltf->path, where, *order, accessor.count, vertex_count, error);
}

/* Triangle i of a strip or a fan (glTF 2.0, 3.7.2.1). */
static void pick(size_t mode, const uint32_t *order, size_t i, uint32_t corner[3]) {
    if (mode == VSHI_GLTF_STRIP) {
        corner[0] = order[i];
        corner[1] = order[i + 1 + i % 2];
        corner[2] = order[i + 2 - i % 2];
    } else {
        corner[0] = order[i + 1];
        corner[1] = order[i + 2];
        corner[2] = order[0];
    }
}

vsh_result vshi_gltf_read_triangles(vshi_gltf *gltf, const json_t *primitive, size_t mode,
                                    size_t vertex_count, const char *where, uint32_t **corners,
                                    size_t *triangle_count, vsh_error *error) {
    size_t count = 0;
    uint32_t *triangles;
    VSHI_TRY(read_order(gltf, primitive, vertex_count, where, corners, &count, error));
    *triangle_count = mode == VSHI_GLTF_TRIANGLES ? count / 3 : 0;
    if (mode == VSHI_GLTF_TRIANGLES || count < 3) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&triangles, count, sizeof(uint32_t[3]), error));
    for (size_t i = 0; i + 2 < count; ++i) {
        uint32_t corner[3];
        pick(mode, *corners, i, corner);
        if (corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0]) {
            memcpy(triangles + 3 * (*triangle_count)++, corner, sizeof corner);
        }
    }
    free(*corners);
    *corners = triangles;
    return VSH_OK;
}

static vsh_result read_plain(vshi_gltf *gltf, const json_t *primitive, size_t mode, const char *where,
                             vshi_model_shape *shape, vsh_error *error) {
    size_t index;
    vshi_gltf_accessor accessor;
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), "POSITION", "accessors", where,
                             &index, error));
    if (index == SIZE_MAX) {
        return VSH_OK; /* without positions there is nothing to see (3.7.2.1) */
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    shape->vertex_count = accessor.count;
    VSHI_TRY(vshi_gltf_read_triangles(gltf, primitive, mode, accessor.count, where, &shape->indices,
                                      &shape->triangle_count, error));
    return shape->triangle_count > 0 ? read_vertices(gltf, primitive, where, shape, error) : VSH_OK;
}

/* Finds the transform of a packed set. NULL: the set is not packed. */
static const vshi_gltf_unpacking *find_unpacking(const vshi_gltf *gltf, const json_t *primitive, int set) {
    size_t material;
    if (gltf->unpackings == NULL || !vshi_gltf_count(primitive, "material", SIZE_MAX, &material) ||
        material >= gltf->model->material_count) {
        return NULL;
    }
    const vshi_gltf_unpacking *u = &gltf->unpackings[material * VSH_MAX_UV_SETS + (size_t)set];
    return u->uvs != VSHI_GLTF_UVS_PLAIN ? u : NULL;
}

/* --- shapes that are left in the file */

/* Whether a pose moves anything of a primitive. */
static bool is_posed(const json_t *primitive, const vshi_gltf_pose *pose) {
    bool moved = pose->joints != NULL && pose->joint_count > 0;
    const size_t targets = json_array_size(json_object_get(primitive, "targets"));
    for (size_t i = 0; i < targets && i < pose->weight_count; ++i) {
        moved = moved || pose->weights[i] != 0.0;
    }
    return moved;
}

/* Where an accessor's elements lie in the mapped file, plain; NULL where there is no such accessor, or *plain
 * becomes false where they do not. */
static vsh_result find_plain(vshi_gltf *gltf, const json_t *object, const char *key, int components, int type,
                             const char *where, size_t *count, void *array, bool *plain, vsh_error *error) {
    size_t index;
    vshi_gltf_accessor accessor;
    VSHI_TRY(vshi_gltf_index(gltf, object, key, "accessors", where, &index, error));
    if (index == SIZE_MAX) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    const uintptr_t at = (uintptr_t)accessor.at, file = (uintptr_t)gltf->mapped.at;
    if (!vshi_gltf_accessor_plain(&accessor, components, type) || at < file ||
        at - file >= gltf->mapped.size || at % 4 != 0 || (*count != SIZE_MAX && *count != accessor.count)) {
        *plain = false;
        return VSH_OK;
    }
    *count = accessor.count;
    memcpy(array, &accessor.at, sizeof accessor.at);
    return vshi_gltf_hold(gltf, (double)accessor.count * 4.0 * components, error);
}

static vsh_result find_vertices(vshi_gltf *gltf, const json_t *primitive, const char *where,
                                vshi_model_shape *shape, bool *plain, vsh_error *error) {
    const json_t *attributes = json_object_get(primitive, "attributes");
    size_t count = SIZE_MAX;
    VSHI_TRY(find_plain(gltf, attributes, "POSITION", 3, VSHI_GLTF_FLOAT, where, &count, &shape->positions,
                        plain, error));
    VSHI_TRY(find_plain(gltf, attributes, "NORMAL", 3, VSHI_GLTF_FLOAT, where, &count, &shape->normals, plain,
                        error));
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        char name[32];
        snprintf(name, sizeof name, "TEXCOORD_%d", set);
        VSHI_TRY(find_plain(gltf, attributes, name, 2, VSHI_GLTF_FLOAT, where, &count, &shape->uvs[set],
                            plain, error));
        shape->uv_sets = shape->uvs[set] != NULL ? set + 1 : shape->uv_sets;
        *plain = *plain && (shape->uvs[set] == NULL || find_unpacking(gltf, primitive, set) == NULL);
    }
    shape->vertex_count = count;
    return VSH_OK;
}

/* Where all of a list of triangles lies in the mapped file as a model has it, and is not moved, it stays
 * there, and nothing of it is looked at here; else the shape stays all 0. */
static vsh_result leave_raw(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                            const char *where, vshi_model_shape *shape, vsh_error *error) {
    enum { LEAST = 1 << 14 /* corners; what a shape of fewer takes is not its copy */ };
    vshi_model_shape found = {.raw = NULL};
    size_t corners = SIZE_MAX;
    const double held = gltf->bytes_held;
    bool plain = gltf->mapped.at != NULL && !is_posed(primitive, pose), colored = false;
    if (plain) {
        VSHI_TRY(has_alpha(gltf, primitive, where, &colored, error));
        plain = !colored;
    }
    if (plain) {
        VSHI_TRY(find_plain(gltf, primitive, "indices", 1, VSHI_GLTF_UINT, where, &corners, &found.indices,
                            &plain, error));
    }
    if (!plain || found.indices == NULL || corners < LEAST || corners % 3 != 0) {
        gltf->bytes_held = held;
        return VSH_OK;
    }
    VSHI_TRY(find_vertices(gltf, primitive, where, &found, &plain, error));
    if (!plain || found.positions == NULL) {
        gltf->bytes_held = held;
        return VSH_OK;
    }
    found.triangle_count = corners / 3;
    const size_t size = strlen(where) + 1;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&found.raw, size, 1, error));
    memcpy(found.raw, where, size);
    *shape = found;
    return VSH_OK;
}

/* Turns a packer's integers into UVs. */
static void unpack_uvs(const vshi_gltf *gltf, const json_t *primitive, vshi_model_shape *shape) {
    for (int set = 0; set < shape->uv_sets; ++set) {
        const vshi_gltf_unpacking *u = find_unpacking(gltf, primitive, set);
        float *uvs = shape->uvs[set];
        if (u == NULL || uvs == NULL) {
            continue;
        }
        shape->packed |= 1U << set;
        const double *t = u->transform;
        for (size_t v = 0; v < shape->vertex_count && u->uvs == VSHI_GLTF_UVS_PACKED; ++v) {
            const double x = (double)uvs[2 * v], y = (double)uvs[2 * v + 1];
            uvs[2 * v] = (float)(t[0] * x + t[1] * y + t[2]);
            uvs[2 * v + 1] = (float)(t[3] * x + t[4] * y + t[5]);
        }
    }
}

/* One that is not there is none. */
static void set_material(const vshi_gltf *gltf, const json_t *primitive, vshi_model_shape *shape) {
    size_t material;
    if (vshi_gltf_count(primitive, "material", SIZE_MAX, &material) &&
        material < gltf->model->material_count && material < INT32_MAX) {
        shape->material = (int32_t)material + 1;
        shape->alpha = gltf->model->materials[material].told.alpha;
    }
}

vsh_result vshi_gltf_read_primitive(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                                    const char *where, vshi_model_shape *shape, vsh_error *error) {
    size_t mode;
    if (!vshi_gltf_count(primitive, "mode", VSHI_GLTF_TRIANGLES, &mode) || mode > VSHI_GLTF_FAN) {
        return vshi_gltf_fail(gltf, error, "%s: its mode is none", where);
    }
    if (mode < VSHI_GLTF_TRIANGLES) {
        return VSH_OK; /* points or lines */
    }
    const json_t *draco = vshi_gltf_extension(primitive, "KHR_draco_mesh_compression");
    if (draco == NULL && mode == VSHI_GLTF_TRIANGLES) {
        VSHI_TRY(leave_raw(gltf, primitive, pose, where, shape, error));
    }
    if (shape->raw == NULL) {
        VSHI_TRY(draco != NULL ? vshi_gltf_read_draco(gltf, draco, where, shape, error)
                               : read_plain(gltf, primitive, mode, where, shape, error));
    }
    if (shape->triangle_count == 0) {
        return VSH_OK;
    }
    set_material(gltf, primitive, shape);
    if (shape->raw != NULL) {
        return VSH_OK;
    }
    unpack_uvs(gltf, primitive, shape);
    VSHI_TRY(vshi_gltf_apply_pose(gltf, primitive, pose, where, shape, error));
    return vshi_model_finish(gltf->path, gltf->run, where, shape, error);
}
