/* Voxels that are shaded, and the sparse OpenVDB grids of their values. */
#ifndef VDBSHADE_VOXELS_H
#define VDBSHADE_VOXELS_H

#include "grid.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- where: which voxels of which lattice */

/* Voxels to be shaded, and where they lie in the world; their values belong to their centres. */
typedef struct vsh_voxels vsh_voxels;

/* The narrow band of a level set, on its own lattice: the voxels within `band` voxels of the surface, on both
 * sides of it (0: all of the grid's band). They have normals: shadow has a horizon, and AO is that of the
 * surface. The grid need not outlive the call. Free with vsh_voxels_free(). Errors:
 * - VSH_ERROR_ARGUMENT: band negative, not finite or wider than the grid's, run;
 * - VSH_ERROR_INPUT: no voxel is so near to the surface;
 * - VSH_ERROR_LIMIT: run->memory_limit, or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_voxels_from_grid(const vsh_grid *grid, double band, const vsh_run *run,
                                        vsh_voxels **voxels, vsh_error *error);

/* A box of cubes of voxel_size, as many along each axis as cover it from box_min on (a millionth of a voxel
 * is no reason for one more): voxel (i, j, k), from 0, has its centre at box_min + voxel_size × (i + 1/2, j +
 * 1/2, k + 1/2). Errors:
 * - VSH_ERROR_ARGUMENT: bounds that are not finite, box_max not above box_min, voxel_size not finite or not
 *   above 0, run;
 * - VSH_ERROR_LIMIT: voxels below 1.45e-5 world units, which OpenVDB cannot write, more than 2^28 along a
 *   side or 1e12 from the origin; run->memory_limit, or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_voxels_from_box(const double box_min[3], const double box_max[3], double voxel_size,
                                       const vsh_run *run, vsh_voxels **voxels, vsh_error *error);

/* The active voxels of a grid of numbers (or a mask) in a .vdb file, those of active tiles too, on its own
 * lattice, whatever its transform. `name` NULL: the file's first such grid. Files from strangers are
 * for run->reader (base.h). Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_READ: as vsh_grid_read();
 * - VSH_ERROR_INPUT: no grids, none of that name, one that holds no numbers (vectors, points, text), has no
 *   active voxels, a voxel beyond ±2^28 or a transform that is not finite;
 * - VSH_ERROR_LIMIT: the grid, or its tiles' voxels, pass run->memory_limit or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_voxels_from_vdb(const char *path, const char *name, const vsh_run *run,
                                       vsh_voxels **voxels, vsh_error *error);
VSH_API void vsh_voxels_free(vsh_voxels *voxels); /* NULL does nothing */

/* What voxels come to. */
typedef struct vsh_voxels_info {
    uint64_t count;       /* voxels */
    uint64_t blocks;      /* of 8³ voxels that hold them */
    int32_t index_min[3]; /* of the voxels, both inclusive */
    int32_t index_max[3];
    double bounds_min[3]; /* world box of their centres, for vsh_scene_reach() */
    double bounds_max[3];
    double voxel_size[3]; /* world units along the lattice's own axes; of a frustum, at its middle */
    int32_t has_normals;  /* 1: the band of a surface; 0: free space */
    uint64_t bytes;       /* in memory */
} vsh_voxels_info;

/* Cannot fail. */
VSH_API void vsh_voxels_get_info(const vsh_voxels *voxels, vsh_voxels_info *info);

/* World position of a voxel's centre: where it is shaded, bit by bit. Cannot fail. */
VSH_API void vsh_voxels_centre(const vsh_voxels *voxels, const int32_t index[3], double centre[3]);

/* --- their values */

/* The grids of a bake: shadow.NAME of each light, then ao, then error.NAME of each light, then error.ao,
 * where asked for. Floats, background 1 (what was not shaded is not dark), uniform regions as tiles. */
typedef struct vsh_volume vsh_volume;

VSH_API void vsh_volume_free(vsh_volume *volume); /* NULL does nothing */

/* What a volume comes to. */
typedef struct vsh_volume_info {
    size_t grids;    /* how many */
    uint64_t shaded; /* voxels whose values were found at their centres */
    uint64_t filled; /* inside ones that took the nearest */
    uint64_t off;    /* inside ones that were left off */
    uint64_t bytes;  /* in memory, all grids */
} vsh_volume_info;

/* One grid of a volume. */
typedef struct vsh_volume_grid {
    char name[80];          /* "shadow.sun", "ao", … */
    uint64_t active_voxels; /* with those of tiles */
    uint64_t leaves;        /* of 8³ values */
    uint64_t tiles;         /* active ones: regions of 8³ voxels and more that have one value */
} vsh_volume_grid;

/* Cannot fail; of a grid beyond the last, an empty name and zeros. */
VSH_API void vsh_volume_get_info(const vsh_volume *volume, vsh_volume_info *info);
VSH_API void vsh_volume_get_grid(const vsh_volume *volume, size_t grid, vsh_volume_grid *info);

/* Values of a grid at `count` world positions ([count][3]) into values[count], interpolated between the
 * eight voxels around each, as renderers do; the background where there are none, NaN for positions that are
 * not finite, or beyond ±2^31 voxels. Runs on the calling thread. Errors: VSH_ERROR_ARGUMENT (no such grid).
 */
VSH_API vsh_result vsh_volume_sample(const vsh_volume *volume, size_t grid, size_t count,
                                     const double *positions, float *values, vsh_error *error);

/* A dense copy: the values of size[0] × size[1] × size[2] voxels from `index_min` on into values, x fastest;
 * the background where they are not active. Runs on the calling thread. Errors: VSH_ERROR_ARGUMENT (no such
 * grid, a size below 1, indices beyond 32 bits). */
VSH_API vsh_result vsh_volume_copy(const vsh_volume *volume, size_t grid, const int32_t index_min[3],
                                   const int32_t size[3], float *values, vsh_error *error);

/* For <vdbshade/openvdb.h>, as vsh_grid_to_openvdb(). */
VSH_API vsh_result vsh_volume_to_openvdb(const vsh_volume *volume, size_t grid, uint32_t version,
                                         uint32_t abi, void *values, vsh_error *error);

/* Writes all grids as one .vdb file, `half` (nonzero) as 16-bit floats, with attributes [attribute_count] as
 * metadata of every grid (may be NULL where that is 0); the same volume gives the same bytes. Metadata tell
 * method, light and voxel size, too (docs/query.md). Atomic, as vsh_grid_write(). Errors: VSH_ERROR_ARGUMENT
 * (path NULL or empty, attributes other than vsh_attribute says), VSH_ERROR_LIMIT (as vsh_grid_write()),
 * VSH_ERROR_WRITE, VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_volume_write(const vsh_volume *volume, const char *path, int32_t half,
                                    const vsh_attribute *attributes, size_t attribute_count,
                                    vsh_error *error);

/* --- what is in a file */

/* A dense copy of a grid of numbers (or a mask) of a .vdb file: the values of size[0] × size[1] × size[2]
 * voxels from `index_min` on into values, x fastest; the background where they are not active. And 1 for the
 * active ones, 0 for the others, into active, in the same order. Either may be NULL. `name` as of
 * vsh_voxels_from_vdb(); vsh_vdb_list() tells names and the box of the active voxels. Errors:
 * - VSH_ERROR_ARGUMENT: a size below 1, indices beyond 32 bits, more than 2^31 - 1 voxels, run;
 * - VSH_ERROR_READ: as vsh_grid_read();
 * - VSH_ERROR_INPUT: no grids, none of that name, one that holds no numbers;
 * - VSH_ERROR_LIMIT: the grid passes run->memory_limit or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_vdb_copy(const char *path, const char *name, const int32_t index_min[3],
                                const int32_t size[3], const vsh_run *run, float *values, float *active,
                                vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
