/* The content of level sets and volumes, for other rooms. */
#ifndef VSHI_LEVELSET_ACCESS_H
#define VSHI_LEVELSET_ACCESS_H

#include "sandbox/reader.h"

#include <vdbshade/grid.h>
#include <vdbshade/voxels.h>

#ifdef __cplusplus
extern "C" {
#endif

/* --- level sets, for the field */

/* A leaf of the grid's tree: 8³ values at index-space origin + (x, y, z), stored at x·64 + y·8 + z, in world
 * units, negative inside; ± background where |value| reaches the half width. A view into the grid. */
typedef struct vshi_leaf {
    int32_t origin[3];
    const float *values; /* [512] */
} vshi_leaf;

/* Number of leaves; fills up to `capacity` of them, sorted by origin (x, then y, then z). Thread safe. */
size_t vshi_grid_leaves(const vsh_grid *grid, vshi_leaf *leaves, size_t capacity);

/* For blocks of 8³ voxels, size[0] × size[1] × size[2] of them (z fastest) from index-space voxel `origin`
 * (multiples of 8): -1 where the block's first voxel is inside the solid, else +1. Thread safe. */
void vshi_grid_block_signs(const vsh_grid *grid, const int32_t origin[3], const int32_t size[3],
                           int8_t *signs);

/* --- voxels to shade, and the volume of their values */

enum { VSHI_BLOCK_VOXELS = 512, VSHI_MASK_WORDS = 8 };

/* A block of 8³ voxels, which is a leaf of the trees: voxel index-space origin + (x, y, z) is bit y·8 + z of
 * word x, and value x·64 + y·8 + z. */
typedef struct vshi_block {
    int32_t origin[3]; /* multiples of 8 */
    uint64_t mask[VSHI_MASK_WORDS];
} vshi_block;

/* The blocks of the voxels, sorted by origin (x, then y, then z). */
const vshi_block *vshi_voxels_blocks(const vsh_voxels *voxels, size_t *count);

/* Number of the block with this origin; SIZE_MAX where there is none. Thread safe, as what follows. */
size_t vshi_voxels_find(const vsh_voxels *voxels, const int32_t origin[3]);

/* Longest axis of a voxel, world units; infinite where it is not the same everywhere. */
double vshi_voxels_longest_axis(const vsh_voxels *voxels);

/* A ball that holds the centres of all voxels of a block. */
void vshi_voxels_ball(const vsh_voxels *voxels, size_t block, double centre[3], double *radius);

/* Centres of `count` voxels of a block, by their numbers in it. */
void vshi_voxels_centres(const vsh_voxels *voxels, size_t block, size_t count, const uint16_t *voxel,
                         double (*centres)[3]);

/* One grid of a volume that is made: what its name and metadata say. Strings are copied. */
typedef struct vshi_channel {
    char name[80];
    char description[200];
    const char *method;
    char light[384]; /* empty: none */
    double caster_voxel_size;
} vshi_channel;

/* Begins a volume; `held` bytes are taken already. Errors: VSH_ERROR_LIMIT, for all leaves of all grids;
 * VSH_ERROR_MEMORY. */
vsh_result vshi_volume_begin(const vsh_voxels *voxels, const vshi_channel *channels, size_t count,
                             const vsh_run *run, double held, vsh_volume **volume, vsh_error *error);

/* The values [512] of a block in a grid that is made; background at first. NULL where memory is short.
 * Different blocks on different threads. */
float *vshi_volume_values(vsh_volume *volume, size_t channel, size_t block);

/* Gives all voxels of a block one value, without memory for them. */
void vshi_volume_set_tile(vsh_volume *volume, size_t channel, size_t block, float value);

/* A value that is there, also once it was settled. */
float vshi_volume_value(const vsh_volume *volume, size_t channel, size_t block, int voxel);

/* The block's values are final, and these its active voxels: where all are active and one value, memory goes
 * back. Different blocks on different threads. */
void vshi_volume_settle(vsh_volume *volume, size_t block, const uint64_t mask[VSHI_MASK_WORDS]);

/* Makes the trees of what was settled. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_volume_close(vsh_volume *volume, const vsh_volume_info *counts, vsh_error *error);

/* --- a reader's requests for .vdb files */

vshi_serve_fn vshi_serve_grid, vshi_serve_list, vshi_serve_voxels, vshi_serve_copy;

#ifdef __cplusplus
}
#endif
#endif
