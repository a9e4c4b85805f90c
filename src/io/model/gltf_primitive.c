/* Reads a mesh's primitive: vertices, triangles of lists, strips and fans, and its pose. */
#include "io/model/gltf.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- accessors of a primitive */

vsh_result vshi_gltf_read_attribute(vshi_gltf *gltf, const json_t *attributes, const char *name,
                                    int components, size_t vertex_count, const char *where, float **values,
                                    vsh_error *error) {
    vshi_gltf_accessor accessor;
    *values = NULL;
    VSHI_TRY(vshi_gltf_accessor_find(gltf, attributes, name, where, &accessor, error));
    if (accessor.count == 0) {
        return VSH_OK;
    }
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
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)values, accessor.count, size, error));
    vshi_gltf_accessor_floats(&accessor, *values);
    return VSH_OK;
}

static vsh_result check_indices(const char *path, const char *where, const uint32_t *indices, size_t count,
                                size_t vertex_count, vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        if (indices[i] >= vertex_count) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: %s: index %zu of %zu is %u, but there are only %zu vertices", path, where,
                             i, count, indices[i], vertex_count);
        }
    }
    return VSH_OK;
}

/* Reads the order in which a primitive draws its vertices: *count of them. */
static vsh_result read_order(vshi_gltf *gltf, const json_t *primitive, size_t vertex_count, const char *where,
                             uint32_t **order, size_t *count, vsh_error *error) {
    vshi_gltf_accessor accessor;
    VSHI_TRY(vshi_gltf_accessor_find(gltf, primitive, "indices", where, &accessor, error));
    const bool given = accessor.count > 0;
    if (given &&
        (accessor.components != 1 || (accessor.type != VSHI_GLTF_UBYTE && accessor.type != VSHI_GLTF_USHORT &&
                                      accessor.type != VSHI_GLTF_UINT))) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its indices have %d components of type %d, expected one of "
                              "type 5121, 5123 or 5125",
                              where, accessor.components, accessor.type);
    }
    *count = given ? accessor.count : vertex_count;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)order, *count, sizeof **order, error));
    if (given) {
        vshi_gltf_accessor_integers(&accessor, *order);
    }
    for (size_t i = 0; i < *count && !given; ++i) {
        (*order)[i] = (uint32_t)i;
    }
    return check_indices(gltf->path, where, *order, *count, vertex_count, error);
}

/* Finds triangle i of a strip or a fan (glTF 2.0, 3.7.2.1). */
static void find_triangle(size_t mode, const uint32_t *order, size_t i, uint32_t corner[3]) {
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
        find_triangle(mode, *corners, i, corner);
        if (corner[0] != corner[1] && corner[1] != corner[2] && corner[2] != corner[0]) {
            memcpy(triangles + 3 * (*triangle_count)++, corner, sizeof corner);
        }
    }
    free(*corners);
    *corners = triangles;
    return VSH_OK;
}

/* --- Draco */

vsh_result vshi_gltf_draco_indices(vshi_gltf *gltf, const vshi_draco *mesh, const char *where,
                                   uint32_t **indices, vsh_error *error) {
    const size_t count = mesh->triangle_count;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)indices, count, sizeof(uint32_t[3]), error));
    vshi_importers()->draco_indices(mesh, *indices);
    return check_indices(gltf->path, where, *indices, 3 * count, mesh->vertex_count, error);
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

/* --- vertices */

/* A primitive that becomes a shape. */
typedef struct primitive {
    vshi_gltf *gltf;
    const json_t *given, *attributes;
    const vshi_draco *draco; /* the source of vertices; NULL: accessors */
    const vshi_gltf_pose *pose;
    const char *where;
    vshi_model_shape *shape;
} primitive;

static vsh_result read_array(const primitive *p, const char *name, int components, float **array,
                             vsh_error *error) {
    const size_t count = p->shape->vertex_count;
    size_t id;
    if (p->draco == NULL) {
        return vshi_gltf_read_attribute(p->gltf, p->attributes, name, components, count, p->where, array,
                                        error);
    }
    if (!vshi_gltf_count(p->attributes, name, SIZE_MAX, &id)) {
        return vshi_gltf_fail(p->gltf, error, "%s: its compressed %s is no index", p->where, name);
    }
    if (id == SIZE_MAX) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_allocate(p->gltf, (void **)array, count, (size_t)components * sizeof **array, error));
    return id <= UINT32_MAX && vshi_importers()->draco_elements(p->draco, (uint32_t)id, VSHI_GLTF_FLOAT,
                                                                components, *array)
               ? VSH_OK
               : vshi_gltf_fail(p->gltf, error, "%s: its Draco data has no attribute %zu of %d components",
                                p->where, id, components);
}

/* Reads positions, normals and sets of UVs. */
static vsh_result read_vertices(const primitive *p, vsh_error *error) {
    vshi_model_shape *shape = p->shape;
    VSHI_TRY(read_array(p, "POSITION", 3, &shape->positions, error));
    VSHI_TRY(read_array(p, "NORMAL", 3, &shape->normals, error));
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        char name[32];
        snprintf(name, sizeof name, "TEXCOORD_%d", set);
        VSHI_TRY(read_array(p, name, 2, &shape->uvs[set], error));
        shape->uv_sets = shape->uvs[set] != NULL ? set + 1 : shape->uv_sets;
    }
    return VSH_OK;
}

/* Reads the alpha of vertex colours, unless all are 1 (3.7.2.1: COLOR_0 multiplies the base colour). */
static vsh_result read_alphas(const primitive *p, vsh_error *error) {
    const size_t count = p->shape->vertex_count;
    vshi_gltf_accessor accessor;
    float *colors = NULL;
    bool whole = true;
    if (p->shape->alpha == VSH_ALPHA_OPAQUE) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_accessor_find(p->gltf, p->attributes, "COLOR_0", p->where, &accessor, error));
    if (accessor.components != 4) {
        return VSH_OK;
    }
    VSHI_TRY(read_array(p, "COLOR_0", 4, &colors, error));
    for (size_t v = 0; v < count; ++v) {
        colors[v] = colors[4 * v + 3];
        whole = whole && colors[v] >= 1.0F;
    }
    if (whole) {
        free(colors);
        return VSH_OK;
    }
    float *alphas = realloc(colors, count * sizeof *colors);
    p->shape->alphas = alphas != NULL ? alphas : colors;
    return VSH_OK;
}

/* Reads positions, normals, UVs and indices of KHR_draco_mesh_compression. */
static vsh_result read_draco(primitive *p, const json_t *extension, vsh_error *error) {
    vshi_draco *mesh = NULL;
    vsh_result result;
    VSHI_TRY(vshi_gltf_decode_draco(p->gltf, extension, p->where, &mesh, error));
    p->draco = mesh;
    p->attributes = json_object_get(extension, "attributes");
    p->shape->vertex_count = mesh->vertex_count;
    VSHI_TRY_DONE(read_vertices(p, error));
    if (p->shape->positions == NULL) {
        VSHI_TRY_DONE(vshi_gltf_fail(p->gltf, error, "%s: its Draco data has no positions", p->where));
    }
    p->shape->triangle_count = mesh->triangle_count;
    result = vshi_gltf_draco_indices(p->gltf, mesh, p->where, &p->shape->indices, error);
done:
    vshi_importers()->draco_free(mesh);
    return result;
}

static vsh_result read_plain(const primitive *p, size_t mode, vsh_error *error) {
    vshi_model_shape *shape = p->shape;
    vshi_gltf_accessor accessor;
    VSHI_TRY(vshi_gltf_accessor_find(p->gltf, p->attributes, "POSITION", p->where, &accessor, error));
    if (accessor.count == 0) {
        return VSH_OK; /* primitives without positions are invisible (3.7.2.1) */
    }
    shape->vertex_count = accessor.count;
    VSHI_TRY(vshi_gltf_read_triangles(p->gltf, p->given, mode, accessor.count, p->where, &shape->indices,
                                      &shape->triangle_count, error));
    if (shape->triangle_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(read_vertices(p, error));
    return read_alphas(p, error);
}

/* --- the rest pose: morph targets at their default weights (glTF 2.0, 3.7.2.2), then skins, which move
 * vertices by joints instead of the node's transform (3.7.3.3) */

static vsh_result add_target(const primitive *p, const json_t *target, const char *name, double weight,
                             float *values, vsh_error *error) {
    const size_t count = p->shape->vertex_count;
    float *moves = NULL;
    if (values == NULL) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_read_attribute(p->gltf, target, name, 3, count, p->where, &moves, error));
    for (size_t i = 0; moves != NULL && i < 3 * count; ++i) {
        values[i] = (float)((double)values[i] + weight * (double)moves[i]);
    }
    free(moves);
    return VSH_OK;
}

static vsh_result morph(const primitive *p, vsh_error *error) {
    const json_t *targets = json_object_get(p->given, "targets");
    for (size_t i = 0; i < json_array_size(targets) && i < p->pose->weight_count; ++i) {
        const json_t *target = json_array_get(targets, i);
        const double weight = p->pose->weights[i];
        if (weight != 0.0) {
            VSHI_TRY(add_target(p, target, "POSITION", weight, p->shape->positions, error));
            VSHI_TRY(add_target(p, target, "NORMAL", weight, p->shape->normals, error));
        }
    }
    return VSH_OK;
}

static vsh_result add_joints(const primitive *p, const vshi_gltf_accessor *accessor, const float *weights,
                             vshi_model_blend *blends, vsh_error *error) {
    const size_t count = p->shape->vertex_count;
    if (accessor->components != 4 ||
        (accessor->type != VSHI_GLTF_UBYTE && accessor->type != VSHI_GLTF_USHORT) ||
        accessor->count != count) {
        return vshi_gltf_fail(p->gltf, error,
                              "%s: its joints are no four bytes or shorts for each of %zu vertices", p->where,
                              count);
    }
    uint32_t *joints = NULL;
    VSHI_TRY(vshi_gltf_allocate(p->gltf, (void **)&joints, count, sizeof(uint32_t[4]), error));
    vshi_gltf_accessor_integers(accessor, joints);
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < 4 * count && result == VSH_OK; ++i) {
        const double weight = (double)weights[i];
        if (weight != 0.0 && joints[i] < p->pose->joint_count) {
            vshi_model_blend_add(&blends[i / 4], weight, p->pose->joints[joints[i]]);
        } else if (weight != 0.0) {
            result = vshi_gltf_fail(p->gltf, error, "%s: vertex %zu uses joint %u, but its skin has only %zu",
                                    p->where, i / 4, joints[i], p->pose->joint_count);
        }
    }
    free(joints);
    return result;
}

static vsh_result add_sets(const primitive *p, vshi_model_blend *blends, vsh_error *error) {
    const json_t *attributes = json_object_get(p->given, "attributes");
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        char name[32];
        vshi_gltf_accessor joints;
        float *weights;
        snprintf(name, sizeof name, "JOINTS_%d", set);
        VSHI_TRY(vshi_gltf_accessor_find(p->gltf, attributes, name, p->where, &joints, error));
        if (joints.count == 0) {
            break;
        }
        snprintf(name, sizeof name, "WEIGHTS_%d", set);
        VSHI_TRY(vshi_gltf_read_attribute(p->gltf, attributes, name, 4, p->shape->vertex_count, p->where,
                                          &weights, error));
        const vsh_result result = weights != NULL ? add_joints(p, &joints, weights, blends, error) : VSH_OK;
        free(weights);
        VSHI_TRY(result);
    }
    return VSH_OK;
}

/* Moves positions and normals by the pose. A vertex without weights follows the first joint. */
static vsh_result apply_pose(const primitive *p, vsh_error *error) {
    VSHI_TRY(morph(p, error));
    if (p->pose->joints == NULL || p->pose->joint_count == 0) {
        return VSH_OK;
    }
    vshi_model_blend *blends = NULL;
    VSHI_TRY(vshi_gltf_allocate(p->gltf, (void **)&blends, p->shape->vertex_count, sizeof *blends, error));
    const vsh_result result = add_sets(p, blends, error);
    if (result == VSH_OK) {
        vshi_model_blend_move(p->shape, blends, p->pose->joints[0]);
    }
    free(blends);
    return result;
}

/* --- the finished shape */

/* Keeps only used vertices: many primitives may share one large accessor. */
static vsh_result drop_unused(const char *path, vshi_model_shape *shape, vsh_error *error) {
    static const uint32_t unused = UINT32_MAX;
    uint32_t *place, count = 0;
    VSHI_TRY(VSHI_ALLOCATE(place, shape->vertex_count, path, error));
    for (size_t i = 0; i < 3 * shape->triangle_count; ++i) {
        place[shape->indices[i]] = 1;
    }
    for (size_t v = 0; v < shape->vertex_count; ++v) {
        place[v] = place[v] > 0 ? count++ : unused;
    }
    for (size_t i = 0; i < 3 * shape->triangle_count; ++i) {
        shape->indices[i] = place[shape->indices[i]];
    }
    for (int k = 0; k < VSHI_MODEL_ARRAYS && count < shape->vertex_count; ++k) {
        const vshi_model_array array = vshi_model_array_of(shape, k);
        char *values = *array.at;
        for (size_t v = 0; v < array.count && values != NULL && k != VSHI_MODEL_INDICES; ++v) {
            if (place[v] != unused) {
                memmove(values + array.size * place[v], values + array.size * v, array.size);
            }
        }
    }
    free(place);
    shape->vertex_count = count;
    return VSH_OK;
}

/* Restores UVs that a packer stored as integers, and turns v of all up, which points down in glTF. */
static void convert_uvs(const vshi_gltf *gltf, vshi_model_shape *shape) {
    static const vshi_gltf_unpacking none = {.uvs = VSHI_GLTF_UVS_PLAIN};
    for (int set = 0; set < shape->uv_sets; ++set) {
        const vshi_gltf_unpacking *u =
            gltf->unpackings != NULL && shape->material > 0
                ? &gltf->unpackings[((size_t)shape->material - 1) * VSH_MAX_UV_SETS + (size_t)set]
                : &none;
        float *uv = shape->uvs[set];
        const double *t = u->transform;
        shape->packed |= u->uvs != VSHI_GLTF_UVS_PLAIN && uv != NULL ? 1U << set : 0;
        for (size_t v = 0; v < shape->vertex_count && uv != NULL; ++v, uv += 2) {
            const double x = (double)uv[0], y = (double)uv[1];
            if (u->uvs == VSHI_GLTF_UVS_PACKED) {
                uv[0] = (float)(t[0] * x + t[1] * y + t[2]);
                uv[1] = (float)(t[3] * x + t[4] * y + t[5]);
            }
            uv[1] = 1.0F - uv[1];
        }
    }
}

size_t vshi_gltf_material(const vshi_gltf *gltf, const json_t *given) {
    const size_t count = gltf->model->material_count;
    size_t material;
    return vshi_gltf_count(given, "material", SIZE_MAX, &material) &&
                   material < (count < INT32_MAX ? count : INT32_MAX)
               ? material
               : SIZE_MAX;
}

vsh_result vshi_gltf_read_primitive(vshi_gltf *gltf, const json_t *given, const vshi_gltf_pose *pose,
                                    const char *where, vshi_model_shape *shape, vsh_error *error) {
    primitive p = {.gltf = gltf,
                   .given = given,
                   .attributes = json_object_get(given, "attributes"),
                   .pose = pose,
                   .where = where,
                   .shape = shape};
    size_t mode;
    if (!vshi_gltf_count(given, "mode", VSHI_GLTF_TRIANGLES, &mode) || mode > VSHI_GLTF_FAN) {
        return vshi_gltf_fail(gltf, error, "%s: its mode is unknown", where);
    }
    if (mode < VSHI_GLTF_TRIANGLES) {
        return VSH_OK; /* points or lines */
    }
    const json_t *draco = vshi_gltf_extension(given, "KHR_draco_mesh_compression");
    const size_t material = vshi_gltf_material(gltf, given);
    if (material != SIZE_MAX) {
        shape->material = (int32_t)material + 1;
        shape->alpha = gltf->model->materials[material].values.alpha;
    }
    VSHI_TRY(draco != NULL ? read_draco(&p, draco, error) : read_plain(&p, mode, error));
    if (shape->triangle_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(apply_pose(&p, error));
    VSHI_TRY(drop_unused(gltf->path, shape, error));
    VSHI_TRY(vshi_model_check_positions(gltf->path, where, shape->positions, shape->vertex_count, error));
    vshi_model_check_normals(gltf->path, gltf->run, where, shape);
    convert_uvs(gltf, shape);
    return VSH_OK;
}
