/* Making the levels of a field. */
#pragma once

#include "field/field.h"

#include <math.h>

/* Half width of the bands of the coarser levels, in their own voxels. The finest level has the grid's own.
 * Six keeps a cone's radius above 2.5 voxels of its level. Four shows the trilinear error of edges: on the
 * seeds' scene an RMSE of 0.0297 instead of 0.0278 (at a start offset of one voxel). Seven is no better. */
#define VSHI_COARSE_BAND 6.0f

/* A level under construction: 8³ values a block, before they become bricks. */
typedef struct vshi_blocks {
    int32_t origin[3]; /* lattice coordinates of the first block; multiples of 8 */
    int32_t size[3];   /* blocks along each axis; z fastest */
    size_t count;      /* of blocks with values */
    int32_t *map;      /* [size[0] × size[1] × size[2]]: number of the block, or -1 */
    int8_t *signs;     /* same shape, for blocks without values */
    int16_t *values;   /* [count][512], multiples of `quantum`, at most ± `most` */
    int16_t most;
    float scale;
    float band;    /* finest voxels: quantum × most */
    float quantum; /* finest voxels, a power of two */
} vshi_blocks;

/* Data of the field's coarsest level from which the next one is derived: places of the surface in its bricks,
 * and the points of the surface nearest to its voxels (feet). The finest level has no feet. */
typedef struct vshi_below {
    size_t brick_count;
    int32_t *bricks; /* each one's block */
    int8_t *boxes; /* [brick_count][6]: the box of possible corners of the surface's cells, low x, y, z, then
                    * high; high < low if there are none */
    size_t count;
    int32_t *map;  /* of the blocks with feet: number, or -1 */
    int16_t *feet; /* [count][3][512], relative to the voxel, VSHI_FOOT_STEPS a voxel of the level; all three
                    * VSHI_FOOT_UNKNOWN if unknown */
} vshi_below;

/* Sets band, quantum and most; the band becomes the nearest multiple of the quantum. */
static inline void vshi_blocks_set_band(vshi_blocks *blocks, float band) {
    int exponent;
    (void)frexpf(band / VSHI_VALUE_MOST, &exponent);
    blocks->quantum = ldexpf(1.0f, exponent);
    blocks->most = (int16_t)lrintf(band / blocks->quantum);
    blocks->band = blocks->quantum * (float)blocks->most;
}

/* Appends the finest level, read from a grid. *below then has its bricks, and no feet. */
vsh_result vshi_level_read(vsh_field *field, const vsh_grid *grid, float band, vshi_field_budget budget,
                           vshi_job *job, vshi_below *below, vsh_error *error);

/* Appends the level above the field's coarsest one. *below belongs to that one, and then to the new one. */
vsh_result vshi_level_derive(vsh_field *field, vshi_below *below, vshi_field_budget budget, vshi_job *job,
                             vsh_error *error);

void vshi_below_free(vshi_below *below);
