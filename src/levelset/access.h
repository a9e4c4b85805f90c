/* Access to level sets and volumes for other rooms. */
#pragma once

#include "io/reader/reader.h"

#include <vdbshade/grid.h>
#include <vdbshade/volume.h>

VSH_BEGIN_C

/* Copies size[0] × size[1] × size[2] voxels from `index_min` on of a .vdb file's grid of numbers, or mask, x
 * fastest. `values` gets their values: the background for those that are not active. `active` gets 1 for
 * active ones, 0 for others. Either may be NULL. `name` is as of vsh_voxels_from_vdb(). Errors:
 * - VSH_ERROR_ARGUMENT: a size below 1, indices beyond 32 bits, more than 2^31 - 1 voxels, run;
 * - VSH_ERROR_READ: as vsh_grid_read();
 * - VSH_ERROR_INPUT: no grids, no grid of that name, or no numbers in it;
 * - VSH_ERROR_LIMIT: the grid passes run->memory_limit or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_vdb_copy(const char *path, const char *name, const int32_t index_min[3],
                         const int32_t size[3], const vsh_run *run, float *values, float *active,
                         vsh_error *error);

/* --- level sets, for the field */

/* A leaf of the grid's tree: 8³ values at index-space origin + (x, y, z), stored at x·64 + y·8 + z. Values
 * are in world units, negative inside, ± background beyond the half width. A view into the grid. */
typedef struct vshi_leaf {
    int32_t origin[3];
    const float *values; /* [512] */
} vshi_leaf;

/* Returns the number of leaves, and lists up to `capacity` of them by origin (x, then y, then z). Thread
 * safe. */
size_t vshi_grid_leaves(const vsh_grid *grid, vshi_leaf *leaves, size_t capacity);

/* Sets the signs of size[0] × size[1] × size[2] blocks of 8³ voxels (z fastest) from index-space voxel
 * `origin` (multiples of 8): -1 if the block's first voxel is inside the solid, else +1. Thread safe. */
void vshi_grid_block_signs(const vsh_grid *grid, const int32_t origin[3], const int32_t size[3],
                           int8_t *signs);

/* --- voxels to shade, and the volume of their values */

enum { VSHI_BLOCK_VOXELS = 512, VSHI_MASK_WORDS = 8 };

/* A block of 8³ voxels, a leaf of the trees. Voxel (x, y, z) from its index-space origin is bit y·8 + z of
 * word x, and value x·64 + y·8 + z. */
typedef struct vshi_block {
    int32_t origin[3]; /* multiples of 8 */
    uint64_t mask[VSHI_MASK_WORDS];
} vshi_block;

struct vsh_voxels {
    const vshi_block *blocks; /* [info.blocks], sorted by origin (x, then y, then z) */
    double matrix[12];        /* from index space to the world: three rows of four */
    vsh_voxels_info info;
};

/* World position of a voxel's centre, where it is shaded. */
static inline void vshi_voxels_centre(const struct vsh_voxels *voxels, const int32_t index[3],
                                      double centre[3]) {
    for (int row = 0; row < 3; ++row) {
        const double *m = voxels->matrix + 4 * row;
        centre[row] = m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3];
    }
}

/* Name and metadata of one grid of a volume. Strings are copied. */
typedef struct vshi_channel {
    char name[80];
    char description[200];
    const char *method;
    char light[384]; /* empty: none */
    double caster_voxel_size;
} vshi_channel;

/* Begins a volume; `held` bytes are in use. Errors: VSH_ERROR_LIMIT, for all leaves of all grids;
 * VSH_ERROR_MEMORY. */
vsh_result vshi_volume_begin(const vsh_voxels *voxels, const vshi_channel *channels, size_t count,
                             const vsh_run *run, double held, vsh_volume **volume, vsh_error *error);

/* The values [512] of a block, background at first; NULL without memory. Threads may use different blocks. */
float *vshi_volume_values(vsh_volume *volume, size_t channel, size_t block);

/* Gives all voxels of a block one value, without memory for them. */
void vshi_volume_set_tile(vsh_volume *volume, size_t channel, size_t block, float value);

/* A value of a block that has values or a tile. */
float vshi_volume_value(const vsh_volume *volume, size_t channel, size_t block, int voxel);

/* Sets a block's active voxels once its values are final. A block of one value, all active, frees its memory.
 * Threads may use different blocks. */
void vshi_volume_settle(vsh_volume *volume, size_t block, const uint64_t mask[VSHI_MASK_WORDS]);

/* Makes the trees of settled blocks. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_volume_close(vsh_volume *volume, const vsh_volume_info *counts, vsh_error *error);

/* --- requests to a reader for .vdb files */

vshi_serve_fn vshi_serve_grid, vshi_serve_list, vshi_serve_voxels, vshi_serve_copy;

VSH_END_C
