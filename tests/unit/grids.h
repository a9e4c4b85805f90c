/* The values of grids, and closed forms that they are compared with. */
#pragma once

#include "handles.h"

#include <stdatomic.h>

#include "levelset/access.h"

typedef struct leaves {
    vshi_leaf *leaf;
    size_t count;
    vsh_grid_info info;
} leaves;

static inline void free_leaves(leaves *all) {
    free(all->leaf);
}

static inline leaves leaves_of(const vsh_grid *grid) {
    leaves all;
    all.count = vshi_grid_leaves(grid, NULL, 0);
    all.leaf = malloc((all.count + 1) * sizeof *all.leaf);
    assert_non_null(all.leaf);
    assert_int_equal(vshi_grid_leaves(grid, all.leaf, all.count), all.count);
    all.info = grid_info(grid);
    return all;
}

static inline void voxel_position(const leaves *all, size_t leaf, int voxel, double position[3]) {
    const int32_t *origin = all->leaf[leaf].origin;
    const double index[3] = {origin[0] + (voxel >> 6), origin[1] + ((voxel >> 3) & 7),
                             origin[2] + (voxel & 7)};
    for (int row = 0; row < 3; ++row) {
        const double *m = all->info.transform + 4 * row;
        position[row] = m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3];
    }
}

/* The value and the place of a voxel, by its number: 512 in each leaf. */
static inline double value_at(const leaves *all, size_t voxel, double position[3]) {
    voxel_position(all, voxel / 512, (int)(voxel % 512), position);
    return (double)all->leaf[voxel / 512].values[voxel % 512];
}

typedef double truth_fn(const double position[3]);

/* Largest error, in voxels, over voxels with a true distance of -inside … outside voxels. Checks the signs of
 * all other voxels in leaves. */
static inline double worst_error(const vsh_grid *grid, truth_fn *truth, double inside, double outside) {
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    const double background = all.info.half_width * all.info.voxel_size;
    double worst = 0.0;
    size_t compared = 0;
    for (size_t i = 0; i < 512 * all.count; ++i) {
        double p[3];
        const double value = value_at(&all, i, p), expected = truth(p);
        assert_true(fabs(value) <= background * (1.0 + 1e-6));
        if (expected > -inside * all.info.voxel_size && expected < outside * all.info.voxel_size) {
            worst = fmax(worst, fabs(value - expected) / all.info.voxel_size);
            ++compared;
        } else {
            assert_int_equal(value < 0.0, expected < 0.0);
        }
    }
    assert_true(compared > 1000);
    return worst;
}

/* Share of blocks over the whole box whose sign is not the truth's, away from the surface. */
static inline size_t wrong_blocks(const vsh_grid *grid, truth_fn *truth, int32_t reach) {
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    const int32_t origin[3] = {-8 * reach, -8 * reach, -8 * reach};
    const int32_t size[3] = {2 * reach, 2 * reach, 2 * reach};
    const size_t count = (size_t)8 * (size_t)(reach * reach) * (size_t)reach;
    FREED int8_t *signs = malloc(count);
    assert_non_null(signs);
    vshi_grid_block_signs(grid, origin, size, signs);
    size_t wrong = 0;
    for (size_t i = 0; i < count; ++i) {
        const int32_t side = 2 * reach, n = (int32_t)i;
        vshi_leaf block = {{origin[0] + 8 * (n / (side * side)), origin[1] + 8 * (n / side % side),
                            origin[2] + 8 * (n % side)},
                           NULL};
        leaves one = all;
        one.leaf = &block;
        double p[3];
        voxel_position(&one, 0, 0, p);
        const double expected = truth(p);
        wrong += fabs(expected) > 0.5 * all.info.voxel_size && (expected < 0.0) != (signs[i] < 0);
    }
    return wrong;
}

static inline void assert_same_leaves(const vsh_grid *a, const vsh_grid *b, float tolerance) {
    FREED_BY(free_leaves) leaves left = leaves_of(a), right = leaves_of(b);
    assert_int_equal(left.count, right.count);
    for (size_t i = 0; i < left.count; ++i) {
        assert_memory_equal(left.leaf[i].origin, right.leaf[i].origin, sizeof left.leaf[i].origin);
        if (tolerance == 0.0f) {
            assert_memory_equal(left.leaf[i].values, right.leaf[i].values, 512 * sizeof(float));
        }
        for (int v = 0; v < 512; ++v) {
            assert_true(fabsf(left.leaf[i].values[v] - right.leaf[i].values[v]) <= tolerance);
        }
    }
}

typedef struct sphere {
    double centre[3];
    double radius;
    atomic_size_t calls;
} sphere;

static inline double sphere_distance(void *user, const double p[3]) {
    sphere *s = user;
    atomic_fetch_add(&s->calls, 1);
    const double x = p[0] - s->centre[0], y = p[1] - s->centre[1], z = p[2] - s->centre[2];
    return sqrt(x * x + y * y + z * z) - s->radius;
}

static inline vsh_distance sphere_field(sphere *s) {
    vsh_distance field = {sphere_distance, s, 1.0, 1, {0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < 3; ++i) {
        field.bounds_min[i] = s->centre[i] - s->radius;
        field.bounds_max[i] = s->centre[i] + s->radius;
    }
    return field;
}

static inline double to_box(const double p[3], double half) {
    double out = 0.0, in = -INFINITY;
    for (int k = 0; k < 3; ++k) {
        const double d = fabs(p[k]) - half;
        out += d > 0.0 ? d * d : 0.0;
        in = fmax(in, d);
    }
    return out > 0.0 ? sqrt(out) : in;
}

static inline double unit_cube(const double p[3]) {
    return to_box(p, 1.0);
}

static inline double unit_sphere(const double p[3]) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 1.0;
}

static inline vsh_sdf hollow_sphere(void) {
    static vsh_sdf_node nodes[3];
    nodes[0] = nodes[1] = vsh_sdf_node_default();
    nodes[1].radius = 0.6;
    nodes[2] = operation_node(VSH_SDF_SUBTRACTION, 0, 1);
    return (vsh_sdf){nodes, 3};
}

static inline double hollow_truth(const double p[3]) {
    const double d = unit_sphere(p);
    return fmax(d, -(d + 0.4));
}

static inline double room_with_a_ball(const double p[3]) {
    const double q[3] = {p[0] * 5.0, p[1] * 5.0, p[2] * 5.0};
    return fmin(hollow_truth(p), 0.2 * unit_sphere(q));
}
