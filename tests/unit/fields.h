/* Fields of analytic scenes, for the tests of the field and the shading. */
#pragma once

#include "handles.h"
#include "truth/analytic.h"

enum { MAX_SOLIDS = 16 };

/* The scene as a tree of unions, moved by `offset` and scaled by `scale` (in that order). */
static inline vsh_sdf tree_of_moved(truth_scene scene, double scale, const double offset[3],
                                    vsh_sdf_node nodes[2 * MAX_SOLIDS]) {
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
    return (vsh_sdf){nodes, count};
}

static inline vsh_grid *grid_of_moved(truth_scene scene, double voxel, double scale, const double offset[3]) {
    vsh_sdf_node nodes[2 * MAX_SOLIDS];
    const vsh_sdf sdf = tree_of_moved(scene, scale, offset, nodes);
    return grid_from_sdf(&sdf, scale * voxel);
}

static inline vsh_grid *grid_of(truth_scene scene, double voxel) {
    const double nowhere[3] = {0.0, 0.0, 0.0};
    return grid_of_moved(scene, voxel, 1.0, nowhere);
}

static inline vsh_field *field_of(truth_scene scene, double voxel, double reach) {
    return field_of_grid(grid_of(scene, voxel), reach);
}

/* Turns v by an angle about an axis: Rodrigues' formula. */
static inline void turn_about(const double axis[3], double angle, const double v[3], double out[3]) {
    const double length = length3(axis), c = cos(angle), s = sin(angle), along = dot3(axis, v) / length;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        out[i] = c * v[i] + (s * (axis[j] * v[k] - axis[k] * v[j]) + (1.0 - c) * along * axis[i]) / length;
    }
}

/* The transform that turns by an angle about an axis, and then moves. */
static inline void make_turn(const double axis[3], double angle, const double by[3], double transform[12]) {
    for (int column = 0; column < 3; ++column) {
        const double unit[3] = {column == 0, column == 1, column == 2};
        double v[3];
        turn_about(axis, angle, unit, v);
        for (int row = 0; row < 3; ++row) {
            transform[4 * row + column] = v[row];
        }
        transform[4 * column + 3] = by[column];
    }
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
