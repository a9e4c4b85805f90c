/* What the field reads of a grid. */
#ifndef VSHI_OPENVDB_H
#define VSHI_OPENVDB_H

#include <vdbshade/grid.h>

#ifdef __cplusplus
extern "C" {
#endif

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

/* Index space to world: three rows of four; the linear part is a rotation (perhaps mirrored) times the voxel
 * size. */
const double *vshi_grid_transform(const vsh_grid *grid);

#ifdef __cplusplus
}
#endif
#endif
