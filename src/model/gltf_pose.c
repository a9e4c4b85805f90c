/* The rest pose: morph targets at their default weights (glTF 2.0, 3.7.2.2), then skins, which move vertices
 * by their joints and leave the node's own transform out (3.7.3.3). */
#include "model/gltf.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>

static vsh_result add_target(vshi_gltf *gltf, const json_t *target, const char *name, double weight,
                             const char *where, size_t vertex_count, float *values, vsh_error *error) {
    float *moves = NULL;
    VSHI_TRY(vshi_gltf_read_attribute(gltf, target, name, 3, vertex_count, where, &moves, error));
    for (size_t i = 0; moves != NULL && i < 3 * vertex_count; ++i) {
        values[i] = (float)((double)values[i] + weight * (double)moves[i]);
    }
    free(moves);
    return VSH_OK;
}

static vsh_result morph(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                        const char *where, vshi_model_shape *shape, vsh_error *error) {
    const json_t *targets = json_object_get(primitive, "targets");
    const size_t count = shape->vertex_count;
    for (size_t i = 0; i < json_array_size(targets) && i < pose->weight_count; ++i) {
        const json_t *target = json_array_get(targets, i);
        const double weight = pose->weights[i];
        if (weight == 0.0) {
            continue;
        }
        VSHI_TRY(add_target(gltf, target, "POSITION", weight, where, count, shape->positions, error));
        if (shape->normals != NULL) {
            VSHI_TRY(add_target(gltf, target, "NORMAL", weight, where, count, shape->normals, error));
        }
    }
    return VSH_OK;
}

static vsh_result add_joints(vshi_gltf *gltf, const vshi_gltf_pose *pose, size_t index, const float *weights,
                             const char *where, size_t vertex_count, vshi_model_blend *blends,
                             vsh_error *error) {
    vshi_gltf_accessor accessor;
    VSHI_TRY(vshi_gltf_accessor_open(gltf, index, &accessor, error));
    if (accessor.components != 4 || (accessor.type != VSHI_GLTF_UBYTE && accessor.type != VSHI_GLTF_USHORT) ||
        accessor.count != vertex_count) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its joints are no four bytes or shorts for each of %zu vertices", where,
                              vertex_count);
    }
    uint32_t *joints = NULL;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&joints, vertex_count, sizeof(uint32_t[4]), error));
    vshi_gltf_accessor_integers(&accessor, joints);
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < 4 * vertex_count; ++i) {
        const double weight = (double)weights[i];
        if (weight == 0.0) {
            continue;
        }
        if (joints[i] >= pose->joint_count) {
            result = vshi_gltf_fail(gltf, error, "%s: vertex %zu uses joint %u, but its skin has only %zu",
                                    where, i / 4, joints[i], pose->joint_count);
            goto done;
        }
        vshi_model_blend_add(&blends[i / 4], weight, pose->joints[joints[i]]);
    }
done:
    free(joints);
    return result;
}

static vsh_result add_sets(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                           const char *where, size_t vertex_count, vshi_model_blend *blends,
                           vsh_error *error) {
    const json_t *attributes = json_object_get(primitive, "attributes");
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        char name[32];
        size_t index;
        float *weights;
        snprintf(name, sizeof name, "JOINTS_%d", set);
        VSHI_TRY(vshi_gltf_index(gltf, attributes, name, "accessors", where, &index, error));
        if (index == SIZE_MAX) {
            break;
        }
        snprintf(name, sizeof name, "WEIGHTS_%d", set);
        VSHI_TRY(vshi_gltf_read_attribute(gltf, attributes, name, 4, vertex_count, where, &weights, error));
        if (weights == NULL) {
            continue;
        }
        const vsh_result result = add_joints(gltf, pose, index, weights, where, vertex_count, blends, error);
        free(weights);
        VSHI_TRY(result);
    }
    return VSH_OK;
}

/* A vertex without weights follows the first joint. */
static vsh_result skin(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                       const char *where, vshi_model_shape *shape, vsh_error *error) {
    vshi_model_blend *blends = NULL;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&blends, shape->vertex_count, sizeof *blends, error));
    vsh_result result;
    VSHI_TRY_DONE(add_sets(gltf, primitive, pose, where, shape->vertex_count, blends, error));
    vshi_model_blend_move(shape, blends, pose->joints[0]);
done:
    free(blends);
    return result;
}

vsh_result vshi_gltf_apply_pose(vshi_gltf *gltf, const json_t *primitive, const vshi_gltf_pose *pose,
                                const char *where, vshi_model_shape *shape, vsh_error *error) {
    VSHI_TRY(morph(gltf, primitive, pose, where, shape, error));
    return pose->joints != NULL && pose->joint_count > 0 ? skin(gltf, primitive, pose, where, shape, error)
                                                         : VSH_OK;
}
