/* Short ways to bake volumes, for their tests. */
#pragma once

#include "shading.h"
#include "testing.h"

#include <vdbshade/light.h>

static inline vsh_voxels *box_of(const double low[3], const double high[3], double voxel) {
    vsh_voxels *voxels = NULL;
    assert_ok(vsh_voxels_from_box(low, high, voxel, NULL, &voxels, &failure));
    return voxels;
}

static inline vsh_voxels *cube_of(double half, double voxel) {
    const double low[3] = {-half, -half, -half}, high[3] = {half, half, half};
    return box_of(low, high, voxel);
}

static inline vsh_voxels *band_of(const vsh_grid *grid, double band) {
    vsh_voxels *voxels = NULL;
    assert_ok(vsh_voxels_from_grid(grid, band, NULL, &voxels, &failure));
    return voxels;
}

static inline vsh_volume *bake(const vsh_occluders *occluders, const vsh_voxels *voxels,
                               const vsh_light *lights, size_t count, const vsh_volume_options *options,
                               const vsh_run *run) {
    vsh_volume *volume = NULL;
    assert_ok(vsh_bake_volume(occluders, voxels, lights, count, options, run, &volume, NULL, &failure));
    return volume;
}

/* A grid's values over the voxels' box, x fastest, and the centres of its voxels, [count][3]. */
typedef struct dense {
    int32_t low[3], size[3];
    size_t count;
    float *values;
    double *centre;
} dense;

/* Index of the i-th value. */
static inline void index_of(const dense *d, size_t i, int32_t index[3]) {
    const size_t row = (size_t)d->size[0], plane = row * (size_t)d->size[1];
    index[0] = d->low[0] + (int32_t)(i % row);
    index[1] = d->low[1] + (int32_t)(i % plane / row);
    index[2] = d->low[2] + (int32_t)(i / plane);
}

static inline dense copy_of(const vsh_volume *volume, size_t grid, const vsh_voxels *voxels) {
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    dense d = {.count = 1};
    for (int axis = 0; axis < 3; ++axis) {
        d.low[axis] = info.index_min[axis];
        d.size[axis] = info.index_max[axis] - info.index_min[axis] + 1;
        d.count *= (size_t)d.size[axis];
    }
    d.values = malloc(d.count * sizeof *d.values);
    d.centre = malloc(3 * d.count * sizeof *d.centre);
    assert_ok(vsh_volume_copy(volume, grid, d.low, d.size, d.values, &failure));
    for (size_t i = 0; i < d.count; ++i) {
        int32_t index[3];
        index_of(&d, i, index);
        vshi_voxels_centre(voxels, index, d.centre + 3 * i);
    }
    return d;
}

/* The value at a point, interpolated between the eight voxels around it; beyond the box it is 1, lit. The
 * voxels are cubes along the world's axes. */
static inline float sample_dense(const dense *d, const double p[3]) {
    const double voxel = d->centre[3] - d->centre[0];
    float value[8];
    for (int corner = 0; corner < 8; ++corner) {
        size_t at = 0, stride = 1;
        bool inside = true;
        for (int axis = 0; axis < 3; ++axis) {
            const double place = floor((p[axis] - d->centre[axis]) / voxel) + (corner >> axis & 1);
            inside = inside && place >= 0.0 && place < d->size[axis];
            at += inside ? (size_t)place * stride : 0;
            stride *= (size_t)d->size[axis];
        }
        value[corner] = inside ? d->values[at] : 1.0f;
    }
    for (int axis = 0, count = 4; axis < 3; ++axis, count /= 2) {
        const double index = (p[axis] - d->centre[axis]) / voxel;
        for (int i = 0; i < count; ++i) {
            value[i] = value[2 * i] + (float)(index - floor(index)) * (value[2 * i + 1] - value[2 * i]);
        }
    }
    return value[0];
}

static inline void free_dense(dense *d) {
    free(d->values);
    free(d->centre);
}

static inline float *distances_of(const vsh_field *field, size_t count, const double *positions) {
    float *distances = malloc(count * sizeof *distances);
    vsh_field_sample(field, count, positions, distances);
    return distances;
}
