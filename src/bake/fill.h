/* Voxels inside solids: they take the value of the nearest voxel that was shaded. */
#ifndef VSHI_BAKE_FILL_H
#define VSHI_BAKE_FILL_H

#include "levelset/access.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <vdbshade/occluders.h>

/* --- the casters of a field and of the layers beside it as one solid */

typedef struct vshi_solid {
    const vsh_field *fields[VSH_MAX_LAYERS + 1];
    const vsh_spheres *spheres[VSH_MAX_LAYERS];
    const vsh_heights *heights[VSH_MAX_LAYERS];
    size_t field_count, spheres_count, heights_count;
    double voxel_size; /* the largest, world units */
} vshi_solid;

enum { VSHI_SOLID_MOST = 512 }; /* positions at a time */

vshi_solid vshi_solid_of(const vsh_occluders *occluders);

/* Signed distance, world units, to whichever field or sphere is nearest; at most
 * VSHI_SOLID_MOST positions [count][3]. Heights have none. */
void vshi_solid_sample(const vshi_solid *solid, size_t count, const double *positions, float *distances);

/* The same, or less: no more than the distance to the box of any heights, 0 within it. */
void vshi_solid_bound(const vshi_solid *solid, size_t count, const double *positions, float *distances);

/* Whether a position is within heights. */
bool vshi_solid_buries(const vshi_solid *solid, const double position[3]);

/* --- filling */

/* A place in reach of a voxel. */
typedef struct vshi_fill_step {
    int8_t by[3];
    uint8_t square; /* of its length, voxels */
} vshi_fill_step;

enum { VSHI_FILL_REACH = 4, VSHI_FILL_STEPS = 256 }; /* voxels; places within them */

typedef struct vshi_fill {
    const vshi_solid *solid;
    const vsh_voxels *voxels;
    const vshi_block *blocks;
    vsh_volume *volume;
    size_t block_count, channel_count;
    bool fills;
    uint64_t (*shaded)[VSHI_MASK_WORDS];                   /* [block_count]: set by who shades them */
    uint64_t (*filled)[VSHI_MASK_WORDS];                   /* [block_count] */
    vshi_fill_step steps[VSHI_FILL_STEPS];                 /* the nearest first */
    int first_step[VSHI_FILL_REACH * VSHI_FILL_REACH + 1]; /* whose length's square is this at least */
    double longest;                                        /* axis of a voxel, world units */
    double distance_error;                                 /* world units */
    _Atomic uint64_t shaded_count, filled_count, off_count;
} vshi_fill;

/* Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_fill_begin(vshi_fill *fill, const vshi_solid *solid, const vsh_voxels *voxels,
                           vsh_volume *volume, size_t channel_count, bool fills, vsh_error *error);
void vshi_fill_end(vshi_fill *fill);

/* Fills a block's voxels that were not shaded, where one within reach was; all blocks are shaded by then.
 * Different blocks on different threads. False where memory is short. */
bool vshi_fill_block(vshi_fill *fill, size_t block);

/* The block's active voxels, shaded and filled; false where it was final before the filling. */
bool vshi_fill_active(const vshi_fill *fill, size_t block, uint64_t active[VSHI_MASK_WORDS]);

/* shaded, filled and off of what was filled. */
vsh_volume_info vshi_fill_counts(const vshi_fill *fill);

#endif
