/* Nearest points of the surface (feet) of a block's voxels: the nearest of those that other voxels know, and
 * how they slide along the surface. */
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

/* A gradient shorter than this has no direction to follow: a crease of the medial axis. */
#define VSHI_MIN_GRADIENT 0.25f
/* A foot that ends farther off the finest level's zero, in its voxels, has slid off the surface. */
#define VSHI_MAX_RESIDUE 0.5f

/* Some of a block's voxels with their feet, in finest voxels. */
typedef struct vshi_slides {
    size_t count;
    float place[3][512], foot[3][512];
    float residue[512]; /* the finest level's value at the foot */
    uint16_t voxel[512];
} vshi_slides;

typedef struct vshi_feet_kernel {
    /* For each wanted voxel of a block of 8³ (word x, bit y · 8 + z) the nearest of the points that are
     * nearer than `most` steps, the first of several: from the voxel on, as feet[3][512]. Others are not
     * touched. */
    void (*nearest)(const vshi_feet *points, const uint64_t wanted[8], float most, int16_t *feet);
    /* Slides feet along the finest level's surface until they face their voxels, by no more than a voxel of
     * the level of `scale` at a time, and tells their residues. */
    void (*slide)(const vsh_field *field, float scale, vshi_slides *slides);
} vshi_feet_kernel;

/* One source (feet.inc), built for each instruction set; all give the same bits. Thread safe. */
extern const vshi_feet_kernel vshi_feet_base;
#if defined(__x86_64__)
extern const vshi_feet_kernel vshi_feet_avx2;
extern const vshi_feet_kernel vshi_feet_avx512;
#endif

/* That of a VSH_ISA_…. */
const vshi_feet_kernel *vshi_feet_kernel_of(int32_t isa);

#endif
