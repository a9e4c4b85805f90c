/* Volumes: shadow and AO on voxels, as OpenVDB grids.
 *
 *     vsh_voxels *voxels; // the band of a level set; or a box, or the voxels of a fog
 *     vsh_voxels_from_grid(grid, 0.0, &run, &voxels, &error);
 *     vsh_volume_options options = vsh_volume_options_default();
 *     options.ao = 1;
 *     vsh_volume *volume;
 *     vsh_bake_volume(occluders, voxels, &sun, 1, &options, &run, &volume, NULL, &error);
 *     vsh_volume_write(volume, "light.vdb", 0, NULL, 0, &error);
 *     vsh_volume_free(volume);
 *     vsh_voxels_free(voxels);
 */
#pragma once

#include "light.h"

VSH_BEGIN_C

/* --- voxels: where to shade */

/* Voxels and their place in the world. Values belong to their centres. Immutable; threads may share it. */
typedef struct vsh_voxels vsh_voxels;

/* Takes the voxels of a level set within `band` voxels of the surface, on both sides (0: its whole band).
 * They have normals: shadow has a horizon, and AO is that of the surface. The grid need not outlive the call.
 * Free the result with vsh_voxels_free(). Errors:
 * - VSH_ERROR_ARGUMENT: band negative, not finite or wider than the grid's, run;
 * - VSH_ERROR_INPUT: no voxel is that near to the surface;
 * - VSH_ERROR_LIMIT: run->memory_limit, or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_voxels_from_grid(const vsh_grid *grid, double band, const vsh_run *run,
                                        vsh_voxels **voxels, vsh_error *error);

/* Fills a box with cubes of voxel_size, as many as cover it from box_min on (to a millionth of a voxel). The
 * centre of voxel (i, j, k), from 0, is box_min + voxel_size × (i + 1/2, j + 1/2, k + 1/2). Errors:
 * - VSH_ERROR_ARGUMENT: bounds that are not finite, box_max not above box_min, voxel_size not above 0, run;
 * - VSH_ERROR_LIMIT: voxels below 1.45e-5 world units, which OpenVDB cannot write, more than 2^28 along a
 *   side or 1e12 from the origin; run->memory_limit, or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_voxels_from_box(const double box_min[3], const double box_max[3], double voxel_size,
                                       const vsh_run *run, vsh_voxels **voxels, vsh_error *error);

/* Takes the active voxels of a grid of numbers (or a mask) in a .vdb file, with those of tiles. `name` NULL:
 * the first such grid. Use run->reader for files from strangers. Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_READ: as vsh_grid_read();
 * - VSH_ERROR_INPUT: no grids, none of that name, one without numbers (vectors, points, text) or active
 *   voxels, a voxel beyond ±2^28, a transform that is not linear (a frustum) or not finite;
 * - VSH_ERROR_LIMIT: memory beyond run->memory_limit or the machine's;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_voxels_from_vdb(const char *path, const char *name, const vsh_run *run,
                                       vsh_voxels **voxels, vsh_error *error);
VSH_API void vsh_voxels_free(vsh_voxels *voxels); /* NULL does nothing */

/* Size and place of voxels. */
typedef struct vsh_voxels_info {
    uint64_t count;       /* voxels */
    uint64_t blocks;      /* of 8³ voxels that hold them */
    int32_t index_min[3]; /* of the voxels, inclusive */
    int32_t index_max[3]; /* the other corner */
    double bounds_min[3]; /* world box of their centres */
    double bounds_max[3]; /* the other corner */
    double voxel_size[3]; /* world units along the lattice's own axes */
    int32_t has_normals;  /* 1: the band of a surface; 0: free space */
    uint64_t bytes;       /* in memory */
} vsh_voxels_info;

/* Fills *info. Cannot fail. */
VSH_API void vsh_voxels_get_info(const vsh_voxels *voxels, vsh_voxels_info *info);

/* --- baking */

/* The grids of a bake: shadow.NAME of each light, then ao, error.NAME of each light, and error.ao, as asked
 * for. Floats with background 1 (unshaded voxels are not dark). Uniform regions are tiles. Immutable; threads
 * may share it. */
typedef struct vsh_volume vsh_volume;

/* Voxels whose centre lies inside a solid. */
typedef enum vsh_inside {
    VSH_INSIDE_NEAREST = 0, /* up to four voxels deep, take the value of the nearest shaded voxel, so that
                               interpolation at the surface does not darken; deeper ones are inactive */
    VSH_INSIDE_OFF = 1      /* inactive, background */
} vsh_inside;

/* How voxels are shaded. */
typedef struct vsh_volume_options {
    size_t struct_size;
    vsh_inside inside; /* how voxels inside solids are filled */
    int32_t ao; /* nonzero: AO within shade.ao_distance. In free space it is the open share of all directions
                   (the ambient light of a fog), by cones or rays over the sphere; not by VSH_AO_TAPS, nor
                   with layers of heights and spheres */
    int32_t error;           /* nonzero: also the standard error left in each value, if the method knows it */
    vsh_shade_options shade; /* start_offset and surface_offset count in a band only */
} vsh_volume_options;

static inline vsh_volume_options vsh_volume_options_default(void) {
    vsh_volume_options options = {sizeof(vsh_volume_options), VSH_INSIDE_NEAREST, 0, 0,
                                  vsh_shade_options_default()};
    return options;
}

/* Shades voxels at their centres, as vsh_query_points(): without normals in free space; in a band, normals
 * are central differences of the field over half a voxel on each side. Voxels with a negative distance are
 * inside, and so are those without a normal, between two walls. Values of adaptive and exact agree with
 * single points within their error. Stage: "volume"; `stats` are added to. Free the result with
 * vsh_volume_free(). Errors:
 * - VSH_ERROR_ARGUMENT: occluders or voxels NULL; lights NULL with a count above 0; nothing to bake; lights
 *   without names or with equal ones; options out of range; AO by taps, or with layers of heights or
 *   spheres, in free space; run; and as vsh_query_create();
 * - VSH_ERROR_LIMIT: occluders, voxels and grids beyond run->memory_limit or the machine's memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_bake_volume(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                   const vsh_light *lights, size_t light_count,
                                   const vsh_volume_options *options, const vsh_run *run, vsh_volume **volume,
                                   vsh_shade_stats *stats, vsh_error *error);
VSH_API void vsh_volume_free(vsh_volume *volume); /* NULL does nothing */

/* Size of a volume. */
typedef struct vsh_volume_info {
    size_t grids;    /* number of grids */
    uint64_t shaded; /* voxels shaded at their centres */
    uint64_t filled; /* inside voxels that took the nearest value */
    uint64_t off;    /* inside voxels that are inactive */
    uint64_t bytes;  /* in memory, all grids */
} vsh_volume_info;

/* A grid of a volume. */
typedef struct vsh_volume_grid {
    char name[80];          /* "shadow.sun", "ao", … */
    uint64_t active_voxels; /* with those of tiles */
    uint64_t leaves;        /* of 8³ values */
    uint64_t tiles;         /* active ones: regions of 8³ voxels and more with one value */
} vsh_volume_grid;

/* Fill *info. Cannot fail; beyond the last grid, the name is empty and the rest 0. */
VSH_API void vsh_volume_get_info(const vsh_volume *volume, vsh_volume_info *info);
VSH_API void vsh_volume_get_grid(const vsh_volume *volume, size_t grid, vsh_volume_grid *info);

/* Copies size[0] × size[1] × size[2] voxels from `index_min` on into values, x fastest; inactive ones are the
 * background. Runs on the calling thread. Errors: VSH_ERROR_ARGUMENT (no such grid, a size below 1, indices
 * beyond 32 bits). */
VSH_API vsh_result vsh_volume_copy(const vsh_volume *volume, size_t grid, const int32_t index_min[3],
                                   const int32_t size[3], float *values, vsh_error *error);

/* C++ programs call vdbshade::volume_to_openvdb() instead. Arguments as vsh_grid_to_openvdb(). */
VSH_API vsh_result vsh_volume_to_openvdb(const vsh_volume *volume, size_t grid, uint32_t version,
                                         uint32_t abi, void *values, vsh_error *error);

/* Writes all grids to one .vdb file, as 16-bit floats if `half` is nonzero. Attributes [attribute_count]
 * become metadata of every grid, beside method, light and voxel size (docs/query.md). Equal volumes give
 * equal bytes. Atomic. Errors: as vsh_grid_write(). */
VSH_API vsh_result vsh_volume_write(const vsh_volume *volume, const char *path, int32_t half,
                                    const vsh_attribute *attributes, size_t attribute_count,
                                    vsh_error *error);

VSH_END_C

/* C++ programs that include OpenVDB's headers before this one also get these functions. */
#if defined(__cplusplus) && defined(OPENVDB_LIBRARY_VERSION_NUMBER)
namespace vdbshade {

/* Copies a level set into a handle. The rules of vsh_grid_read() for transforms and distances apply. Errors:
 * - VSH_ERROR_UNSUPPORTED: this program was compiled against another version or ABI of OpenVDB than
 *   vdbshade;
 * - VSH_ERROR_ARGUMENT: no grid, run;
 * - VSH_ERROR_INPUT, VSH_ERROR_LIMIT: as vsh_grid_read();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
inline vsh_result grid_from_openvdb(const openvdb::FloatGrid::ConstPtr &level_set, const vsh_run *run,
                                    vsh_grid **grid, vsh_error *error) {
    return vsh_grid_from_openvdb(&level_set, OPENVDB_LIBRARY_VERSION_NUMBER, OPENVDB_ABI_VERSION_NUMBER, run,
                                 grid, error);
}

/* Gets the level set of a handle, named "surface". The values are shared and live as long as the pointer.
 * Errors: VSH_ERROR_UNSUPPORTED as above; VSH_ERROR_MEMORY. */
inline vsh_result grid_to_openvdb(const vsh_grid *grid, openvdb::FloatGrid::ConstPtr &level_set,
                                  vsh_error *error) {
    return vsh_grid_to_openvdb(grid, OPENVDB_LIBRARY_VERSION_NUMBER, OPENVDB_ABI_VERSION_NUMBER, &level_set,
                               error);
}

/* Gets a grid of a volume with its name and metadata. The values are shared. Errors: VSH_ERROR_ARGUMENT (no
 * such grid), VSH_ERROR_UNSUPPORTED as above; VSH_ERROR_MEMORY. */
inline vsh_result volume_to_openvdb(const vsh_volume *volume, size_t grid,
                                    openvdb::FloatGrid::ConstPtr &values, vsh_error *error) {
    return vsh_volume_to_openvdb(volume, grid, OPENVDB_LIBRARY_VERSION_NUMBER, OPENVDB_ABI_VERSION_NUMBER,
                                 &values, error);
}

} // namespace vdbshade
#endif
