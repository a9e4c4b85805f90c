/* A mesh's primitive: its vertices, and its triangles from lists, strips and fans. */
#include "model/gltf.h"

#include "base/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MODE_TRIANGLES = 4, MODE_STRIP = 5, MODE_FAN = 6 };

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
    return VSH_OK;
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
    uint32_t highest = 0;
    for (size_t i = 0; i < accessor.count; ++i) {
        highest = (*order)[i] > highest ? (*order)[i] : highest;
    }
    for (size_t i = 0; highest >= vertex_count && i < accessor.count; ++i) {
        if ((*order)[i] >= vertex_count) {
            return vshi_gltf_fail(gltf, error, "%s: index %zu of %zu is %u, but there are only %zu vertices",
                                  where, i, accessor.count, (*order)[i], vertex_count);
        }
    }
    return VSH_OK;
}

/* Triangle i of a strip or a fan (glTF 2.0, 3.7.2.1). */
static void pick(size_t mode, const uint32_t *order, size_t i, uint32_t corner[3]) {
    if (mode == MODE_STRIP) {
        corner[0] = order[i];
        corner[1] = order[i + 1 + i % 2];
        corner[2] = order[i + 2 - i % 2];
    } else {
        corner[0] = order[i + 1];
        corner[1] = order[i + 2];
        corner[2] = order[0];
    }
}

/* Strips and fans, whose `count` indices become those of triangles; triangles of fewer than three vertices,
 * by which strips are joined, are left out. */
static vsh_result unroll(vshi_gltf *gltf, size_t mode, size_t count, vshi_model_shape *shape,
                         vsh_error *error) {
    uint32_t *triangles;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&triangles, count, sizeof(uint32_t[3]), error));
    for (size_t i = 0; i + 2 < count; ++i) {
        uint32_t corner[3];
        pick(mode, shape->indices, i, corner);
        if (corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0]) {
            memcpy(triangles + 3 * shape->triangle_count++, corner, sizeof corner);
        }
    }
    free(shape->indices);
    shape->indices = triangles;
    return VSH_OK;
}

static vsh_result read_plain(vshi_gltf *gltf, const json_t *primitive, size_t mode, const char *where,
                             vshi_model_shape *shape, vsh_error *error) {
    size_t index;
    vshi_gltf_accessor accessor;
    size_t count = 0;
    VSHI_TRY(vshi_gltf_index(gltf, json_object_get(primitive, "attributes"), "POSITION", "accessors", where,
                             &index, error));
    if (index == SIZE_MAX) {
        return VSH_OK; /* without positions there is nothing to see (3.7.2.1) */
    }
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    shape->vertex_count = accessor.count;
    VSHI_TRY(read_order(gltf, primitive, accessor.count, where, &shape->indices, &count, error));
    if (mode == MODE_TRIANGLES) {
        shape->triangle_count = count / 3;
    } else if (count >= 3) {
        VSHI_TRY(unroll(gltf, mode, count, shape, error));
    }
    return shape->triangle_count > 0 ? read_vertices(gltf, primitive, where, shape, error) : VSH_OK;
}

/* Many primitives may share one large accessor, of which each uses a part: only that is kept. */
static vsh_result drop_unused(const vshi_gltf *gltf, vshi_model_shape *shape, vsh_error *error) {
    uint32_t *place = NULL;
    VSHI_TRY(vshi_allocate((void **)&place, shape->vertex_count, sizeof *place, gltf->path, error));
    for (size_t i = 0; i < 3 * shape->triangle_count; ++i) {
        place[shape->indices[i]] = 1;
    }
    uint32_t used = 0;
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        used += place[v];
    }
    const bool all = used == shape->vertex_count;
    used = all ? used : 0;
    for (size_t v = 0; !all && v < shape->vertex_count; ++v) {
        const bool keep = place[v] != 0;
        place[v] = used;
        if (keep && used < v) {
            memcpy(shape->positions + 3 * (size_t)used, shape->positions + 3 * v, sizeof(float[3]));
            if (shape->normals != NULL) {
                memcpy(shape->normals + 3 * (size_t)used, shape->normals + 3 * v, sizeof(float[3]));
            }
            for (int set = 0; set < shape->uv_sets; ++set) {
                if (shape->uvs[set] != NULL) {
                    memcpy(shape->uvs[set] + 2 * (size_t)used, shape->uvs[set] + 2 * v, sizeof(float[2]));
                }
            }
        }
        used += keep;
    }
    for (size_t i = 0; !all && i < 3 * shape->triangle_count; ++i) {
        shape->indices[i] = place[shape->indices[i]];
    }
    shape->vertex_count = used;
    free(place);
    return VSH_OK;
}

/* Directions that are not finite become zero, which no direction is: flat there. */
static void check_normals(const vshi_gltf *gltf, const char *where, const vshi_model_shape *shape) {
    size_t bad = 0;
    for (size_t v = 0; v < shape->vertex_count && shape->normals != NULL; ++v) {
        float *n = shape->normals + 3 * v;
        if (!isfinite(n[0]) || !isfinite(n[1]) || !isfinite(n[2])) {
            memset(n, 0, sizeof(float[3]));
            ++bad;
        }
    }
    if (bad > 0) {
        vshi_warn(gltf->run, "%s: %s: %zu normals are not finite: flat there", gltf->path, where, bad);
    }
}

static vsh_result check_vertices(const vshi_gltf *gltf, const char *where, const vshi_model_shape *shape,
                                 vsh_error *error) {
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        const float *p = shape->positions + 3 * v;
        if (!isfinite(p[0]) || !isfinite(p[1]) || !isfinite(p[2])) {
            return vshi_gltf_fail(gltf, error,
                                  "%s: vertex %zu of %zu lies at (%g, %g, %g), expected finite numbers",
                                  where, v, shape->vertex_count, (double)p[0], (double)p[1], (double)p[2]);
        }
    }
    return VSH_OK;
}

static int32_t alpha_of(const vshi_gltf *gltf, const json_t *primitive) {
    size_t material;
    if (!vshi_gltf_count(primitive, "material", SIZE_MAX, &material) || material == SIZE_MAX) {
        return VSH_ALPHA_OPAQUE;
    }
    const char *mode =
        json_string_value(json_object_get(vshi_gltf_element(gltf, "materials", material), "alphaMode"));
    return mode != NULL && strcmp(mode, "BLEND") == 0  ? VSH_ALPHA_BLENDED
           : mode != NULL && strcmp(mode, "MASK") == 0 ? VSH_ALPHA_MASKED
                                                       : VSH_ALPHA_OPAQUE;
}

vsh_result vshi_gltf_read_primitive(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                                    const char *where, vshi_model_shape *shape, vsh_error *error) {
    size_t mode;
    if (!vshi_gltf_count(primitive, "mode", MODE_TRIANGLES, &mode) || mode > MODE_FAN) {
        return vshi_gltf_fail(gltf, error, "%s: its mode is none", where);
    }
    if (mode < MODE_TRIANGLES) {
        return VSH_OK; /* points or lines */
    }
    const json_t *draco = vshi_gltf_extension(primitive, "KHR_draco_mesh_compression");
    VSHI_TRY(draco != NULL ? vshi_gltf_read_draco(gltf, draco, where, shape, error)
                           : read_plain(gltf, primitive, mode, where, shape, error));
    if (shape->triangle_count == 0) {
        return VSH_OK;
    }
    shape->alpha = alpha_of(gltf, primitive);
    VSHI_TRY(vshi_gltf_apply_pose(gltf, primitive, pose, where, shape, error));
    VSHI_TRY(drop_unused(gltf, shape, error));
    VSHI_TRY(check_vertices(gltf, where, shape, error));
    check_normals(gltf, where, shape);
    for (int set = 0; set < shape->uv_sets; ++set) {
        for (size_t v = 0; v < shape->vertex_count && shape->uvs[set] != NULL; ++v) {
            shape->uvs[set][2 * v + 1] = 1.0F - shape->uvs[set][2 * v + 1]; /* v points down in glTF */
        }
    }
    return VSH_OK;
}
