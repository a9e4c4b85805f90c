/* Fields of analytic scenes, for the tests of the field and the shading. */
#pragma once

#include "handles.h"
#include "truth/analytic.h"

enum { MAX_SOLIDS = 16 };

/* The scene as a tree of unions, moved by `offset` and scaled by `scale` (in that order). */
static inline vsh_grid *grid_of_moved(truth_scene scene, double voxel, double scale, const double offset[3]) {
    vsh_sdf_node nodes[2 * MAX_SOLIDS];
    size_t count = 0;
    int32_t last = -1;
    assert_true(scene.count > 0 && scene.count <= MAX_SOLIDS);
    for (size_t i = 0; i < scene.count; ++i) {
        const truth_solid *solid = &scene.solids[i];
        vsh_sdf_node node = vsh_sdf_node_default();
        node.shape = solid->shape == TRUTH_SPHERE ? VSH_SDF_SPHERE
                     : solid->shape == TRUTH_BOX  ? VSH_SDF_BOX
                                                  : VSH_SDF_TORUS;
        node.radius = solid->radius;
        node.minor_radius = solid->minor_radius;
        node.rounding = solid->shape == TRUTH_BOX ? solid->radius : 0.0;
        node.scale = scale;
        for (int axis = 0; axis < 3; ++axis) {
            node.size[axis] = solid->half[axis];
            node.translation[axis] = scale * (solid->center[axis] + offset[axis]);
        }
        nodes[count++] = node;
        if (last >= 0) {
            const int32_t right = (int32_t)count - 1;
            nodes[count++] = operation_node(VSH_SDF_UNION, last, right);
        }
        last = (int32_t)count - 1;
    }
    const vsh_sdf sdf = {nodes, count};
    return grid_from_sdf(&sdf, scale * voxel);
}

static inline vsh_grid *grid_of(truth_scene scene, double voxel) {
    const double nowhere[3] = {0.0, 0.0, 0.0};
    return grid_of_moved(scene, voxel, 1.0, nowhere);
}

static inline vsh_field *field_of(truth_scene scene, double voxel, double reach) {
    return field_of_grid(grid_of(scene, voxel), reach);
}

/* A number in [0, 1), counted, not drawn: the same in each run and on each machine (splitmix64). */
static inline double uniform(uint64_t *counter) {
    uint64_t z = (*counter += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static inline double between(uint64_t *counter, double low, double high) {
    return low + (high - low) * uniform(counter);
}

static inline uint32_t bits_of(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}
