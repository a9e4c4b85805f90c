/* Distances of a leaf's voxels to triangles. */
#pragma once

#include "base/error.h"

#include <stddef.h>
#include <stdint.h>

VSH_BEGIN_C

/* A triangle as seven linear functions of a place (x, y, z) relative to the middle of a region: row[0] x +
 * row[1] y + row[2] z + row[3]. HEIGHT is the height over its plane. BESIDE, for each edge, is the distance
 * from the edge's line within the plane, positive outside. ALONG is the place along the edge, which reaches
 * from `low` to `high`; its row[3] is 0. */
enum {
    VSHI_FRAME_HEIGHT = 0,
    VSHI_FRAME_BESIDE = 1,
    VSHI_FRAME_ALONG = 4,
    VSHI_FRAME_ROWS = 7,
    VSHI_LEAF_VOXELS = 512,
    VSHI_REGION_LEAVES = 64
};

typedef struct vshi_frame {
    float row[VSHI_FRAME_ROWS][4];
    float low[3];
    float high[3];
} vshi_frame;

typedef struct vshi_leaf_kernel {
    /* Measures the distance of a leaf's 8³ voxels (stored x · 64 + y · 8 + z) to the nearest of `count`
     * triangles frames[list[i]], voxels, at most `reach`. `middle` is the leaf's, relative to the region's.
     * Returns whether a distance is below `reach`. Exact to 1e-4 of a voxel. */
    int (*measure)(const vshi_frame *frames, const uint32_t *list, size_t count, const float middle[3],
                   float reach, float distances[VSHI_LEAF_VOXELS]);
    /* Measures the distances of the middles of a region's 4³ leaves (stored x · 16 + y · 4 + z) to one
     * triangle. */
    void (*middles)(const vshi_frame *frame, float distances[VSHI_REGION_LEAVES]);
} vshi_leaf_kernel;

/* One source (leaf.inc), built for each instruction set; all give the same bits. Thread safe. */
extern VSHI_SHARED const vshi_leaf_kernel vshi_leaf_base;
#if defined(__x86_64__)
extern VSHI_SHARED const vshi_leaf_kernel vshi_leaf_avx2;
extern VSHI_SHARED const vshi_leaf_kernel vshi_leaf_avx512;
#endif

VSH_END_C
