/* Making the levels of a field. */
#ifndef VSHI_FIELD_LEVEL_H
#define VSHI_FIELD_LEVEL_H

#include "base/job.h"
#include "field/field.h"
#include "levelset/access.h"

#include <math.h>
#include <stdbool.h>

/* Half width of the bands of the coarser levels, in their own voxels. The finest level has the grid's own.
 * Six keeps a cone's radius above 2.5 voxels of the level it is sampled from; at four the trilinear error of
 * edges shows: on the seeds' scene an RMSE of 0.0297 instead of 0.0278 (at a start offset of one voxel), at
 * seven it gains no more. */
#define VSHI_COARSE_BAND 6.0f

/* A level under construction: 8³ values a block, before they become bricks. */
typedef struct vshi_blocks {
    int32_t origin[3]; /* lattice coordinates of the first block; multiples of 8 */
    int32_t size[3];   /* blocks along each axis; z fastest */
    size_t count;      /* of blocks with values */
    int32_t *map;      /* [size[0] × size[1] × size[2]]: number of the block, or -1 */
    int8_t *signs;     /* same shape: of blocks without values */
    int16_t *values;   /* [count][512], multiples of `quantum`, ± `most` where the band ends */
    int16_t most;
    float scale;
    float band;    /* finest voxels: quantum × most */
    float quantum; /* finest voxels, a power of two */
} vshi_blocks;

/* What is kept of the field's coarsest level to derive the next one from: where its bricks hold the surface,
 * and the points of the surface that are nearest to its voxels (none of the finest). */
typedef struct vshi_below {
    size_t brick_count;
    int32_t *bricks; /* each one's block */
    int8_t *boxes;   /* [brick_count][6]: of its values that may be corners of cells of the surface the lowest
                      * places along x, y and z, then the highest, which are lower where there are none */
    size_t count;
    int32_t *map;  /* of the blocks with feet: number, or -1 */
    int16_t *feet; /* [count][3][512], from the voxel on; VSHI_FOOT_STEPS are a voxel of the level. All three
                    * VSHI_FOOT_UNKNOWN: none is known */
} vshi_below;

/* Feet are within a band and a voxel and a half. The unknown are farther, with a step along any axis too. */
#define VSHI_FOOT_STEPS 4096.0f
#define VSHI_FOOT_UNKNOWN INT16_MIN

/* What a call may hold, and what it holds already: the grid, the field so far, what the caller took. */
typedef struct vshi_budget {
    const vsh_run *run;
    double held; /* bytes */
} vshi_budget;

/* Bytes of the field's bricks and indices. */
static inline double vshi_field_bytes(const vsh_field *field) {
    double bytes = sizeof *field + (double)field->value_count * sizeof *field->values;
    for (int32_t l = 0; l < field->level_count; ++l) {
        const int32_t *size = field->levels[l].size;
        bytes += (double)size[0] * size[1] * size[2] * sizeof *field->index;
    }
    return bytes;
}

/* Sets band, quantum and most; the band becomes the nearest multiple of the quantum. */
static inline void vshi_blocks_set_band(vshi_blocks *blocks, float band) {
    int exponent;
    (void)frexpf(band / VSHI_VALUE_MOST, &exponent);
    blocks->quantum = ldexpf(1.0f, exponent);
    blocks->most = (int16_t)lrintf(band / blocks->quantum);
    blocks->band = blocks->quantum * (float)blocks->most;
}

/* To the nearest integer; `x` is within 16 bits. */
static inline int16_t vshi_round(float x) {
    return (int16_t)(int32_t)(x + (x < 0.0f ? -0.5f : 0.5f));
}

/* A distance in finest voxels as a value. */
static inline int16_t vshi_blocks_value(const vshi_blocks *blocks, float distance) {
    const float most = (float)blocks->most, value = distance / blocks->quantum;
    const float within = value > most ? most : value < -most ? -most : value;
    return vshi_round(within);
}

void vshi_level_blocks_free(vshi_blocks *blocks);

/* The finest level's blocks out of a grid. */
vsh_result vshi_level_blocks_read(const vsh_grid *grid, float band, vshi_budget budget, vshi_job *job,
                                  vshi_blocks *blocks, vsh_error *error);

/* Appends a level of bricks to the field; *below has its bricks then, and no feet. */
vsh_result vshi_level_append(vsh_field *field, const vshi_blocks *blocks, vshi_budget budget, vshi_job *job,
                             vshi_below *below, vsh_error *error);

/* Lattice coordinates of a block's first value. */
static inline void vshi_block_corner(const int32_t origin[3], const int32_t size[3], size_t block,
                                     int32_t corner[3]) {
    const size_t plane = (size_t)size[1] * (size_t)size[2];
    corner[0] = origin[0] + 8 * (int32_t)(block / plane);
    corner[1] = origin[1] + 8 * (int32_t)(block % plane / (size_t)size[2]);
    corner[2] = origin[2] + 8 * (int32_t)(block % (size_t)size[2]);
}

/* Appends the level above the field's coarsest one; *below is of that one, and then of the new. */
vsh_result vshi_level_derive(vsh_field *field, vshi_below *below, vshi_budget budget, vshi_job *job,
                             vsh_error *error);

void vshi_below_free(vshi_below *below);

#endif
