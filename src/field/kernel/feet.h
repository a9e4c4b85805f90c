/* Nearest points of the surface (feet) of a block's voxels, among feet that other voxels know. */
#pragma once

#include "field/field.h"

#include <stddef.h>
#include <stdint.h>

/* Feet are within a band and a voxel and a half, which VSHI_FOOT_UNKNOWN exceeds. */
#define VSHI_FOOT_STEPS 4096.0f
#define VSHI_FOOT_UNKNOWN INT16_MIN

enum {
    VSHI_FEET_LANES = 16, /* points compared together */
    /* most voxels around a block from which points are gathered: enough for a finest band of 3 */
    VSHI_FEET_MARGIN = 7,
    VSHI_FEET_MOST = 10656 /* points, at most: (8 + 2 · 7)³, to a multiple of the lanes */
};

/* Points in steps from the block's first voxel: whole numbers, exact in floats. */
typedef struct vshi_feet {
    size_t count;
    float x[VSHI_FEET_MOST], y[VSHI_FEET_MOST], z[VSHI_FEET_MOST];
} vshi_feet;

/* Finds, for each wanted voxel of a block of 8³ (word x, bit y · 8 + z), the nearest point nearer than `most`
 * steps, and writes it, relative to the voxel, to feet[3][512]. Of equal ones the first wins. Other feet
 * stay. */
typedef void vshi_nearest_fn(const vshi_feet *points, const uint64_t wanted[8], float most, int16_t *feet);

/* One source (feet.inc), built for each instruction set; all give the same bits. Thread safe. */
extern vshi_nearest_fn vshi_feet_base;
#if defined(__x86_64__)
extern vshi_nearest_fn vshi_feet_avx2, vshi_feet_avx512;
#endif
