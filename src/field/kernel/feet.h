/* Nearest points of the surface (feet) of a block's voxels, among those that other voxels know. */
#ifndef VSHI_FEET_KERNEL_H
#define VSHI_FEET_KERNEL_H

#include "field/field.h"

#include <stddef.h>
#include <stdint.h>

enum {
    VSHI_FEET_LANES = 16, /* points that are looked at together */
    /* voxels around a block among which points are looked for, at most: what a finest band of 3 takes */
    VSHI_FEET_MARGIN = 7,
    VSHI_FEET_MOST = 10656 /* points, at most: (8 + 2 · 7)³, to a multiple of the lanes */
};

/* Points in steps (field/level.h) from the block's first voxel: whole numbers, which floats hold. */
typedef struct vshi_feet {
    size_t count;
    float x[VSHI_FEET_MOST], y[VSHI_FEET_MOST], z[VSHI_FEET_MOST];
} vshi_feet;

/* For each wanted voxel of a block of 8³ (word x, bit y · 8 + z) the nearest of the points that are nearer
 * than `most` steps, the first of several: from the voxel on, as feet[3][512]. Others are not touched. */
typedef void vshi_nearest_fn(const vshi_feet *points, const uint64_t wanted[8], float most, int16_t *feet);

/* One source (feet.inc), built for each instruction set; all give the same bits. Thread safe. */
extern vshi_nearest_fn vshi_feet_base;
#if defined(__x86_64__)
extern vshi_nearest_fn vshi_feet_avx2, vshi_feet_avx512;
#endif

#endif
