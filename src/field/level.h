/* Making the levels of a field. */
#ifndef VSHI_FIELD_LEVEL_H
#define VSHI_FIELD_LEVEL_H

#include "base/job.h"
#include "field/field.h"
#include "shim/openvdb.h"

#include <math.h>

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

/* Points on the surface nearest to a level's voxels. */
typedef struct vshi_feet {
    size_t count;
    int32_t *map;  /* of the level's blocks: number, or -1 */
    float *points; /* [count][512][3], field space; NaN where none is known */
} vshi_feet;

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

/* A distance in finest voxels as a value. */
static inline int16_t vshi_blocks_value(const vshi_blocks *blocks, float distance) {
    const float value = distance / blocks->quantum, most = (float)blocks->most;
    return (int16_t)lrintf(value > most ? most : value < -most ? -most : value);
}

void vshi_level_blocks_free(vshi_blocks *blocks);

/* The finest level's blocks out of a grid. */
vsh_result vshi_level_blocks_read(const vsh_grid *grid, float band, vshi_budget budget, vshi_blocks *blocks,
                                  vsh_error *error);

/* Appends a level of bricks to the field. */
vsh_result vshi_level_append(vsh_field *field, const vshi_blocks *blocks, vshi_budget budget, vshi_job *job,
                             vsh_error *error);

/* Appends the level above the field's coarsest one; *feet holds that one's (none for the finest) and is
 * replaced. */
vsh_result vshi_level_derive(vsh_field *field, vshi_feet *feet, vshi_budget budget, vshi_job *job,
                             vsh_error *error);

void vshi_feet_free(vshi_feet *feet);

#endif
