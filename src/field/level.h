/* Making the levels of a field. */
#ifndef VSHI_FIELD_LEVEL_H
#define VSHI_FIELD_LEVEL_H

#include "base/job.h"
#include "field/field.h"
#include "shim/openvdb.h"

/* Half width of the bands of the coarser levels, in their own voxels. The finest level has the grid's own.
 * Six keeps a cone's radius above 2.5 voxels of the level it is sampled from; three lets it fall to one,
 * where the trilinear error of edges shows (docs/numerics.md). */
#define VSHI_COARSE_BAND 6.0f

/* A level under construction: 8³ values a block, before they become bricks. */
typedef struct vshi_blocks {
    int32_t origin[3]; /* lattice coordinates of the first block; multiples of 8 */
    int32_t size[3];   /* blocks along each axis; z fastest */
    size_t count;      /* of blocks with values */
    int32_t *map;      /* [size[0] × size[1] × size[2]]: number of the block, or -1 */
    int8_t *signs;     /* same shape: of blocks without values */
    float *values;     /* [count][512], finest voxels */
    float scale;
    float band;
} vshi_blocks;

/* Points on the surface nearest to a level's voxels: [brick][512][3], field space; NaN where none is known.
 */
typedef struct vshi_feet {
    float *points;
} vshi_feet;

void vshi_level_blocks_free(vshi_blocks *blocks);

/* The finest level's blocks out of a grid. */
vsh_result vshi_level_blocks_read(const vsh_grid *grid, float band, const vsh_run *run, vshi_blocks *blocks,
                                  vsh_error *error);

/* Appends a level of bricks to the field. With `block_feet` [count][512][3], those of the bricks kept go into
 * *feet (freed by the caller). */
vsh_result vshi_level_append(vsh_field *field, const vshi_blocks *blocks, const float *block_feet,
                             vshi_job *job, vshi_feet *feet, vsh_error *error);

/* Appends the level above the field's coarsest one; *feet holds that one's (none for the finest) and is
 * replaced. */
vsh_result vshi_level_derive(vsh_field *field, vshi_feet *feet, vshi_job *job, vsh_error *error);

#endif
