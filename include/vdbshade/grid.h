/* Narrow-band level sets: OpenVDB grids made of meshes, procedural SDFs, callbacks and .vdb files.
 *
 *     vsh_sdf_node ball = vsh_sdf_node_default(); // a unit sphere at the origin
 *     vsh_sdf tree = {&ball, 1};
 *     vsh_grid_options options = vsh_grid_options_default();
 *     options.voxel_size = 0.05;
 *     vsh_grid *grid;
 *     vsh_grid_from_sdf(&tree, &options, &run, &grid, &error);
 *     vsh_grid_write(grid, "ball.vdb", NULL, NULL, 0, &error);
 *     vsh_grid_free(grid);
 *
 * vsh_occluders_from_grid() turns a grid into something that casts. */
#pragma once

#include "mesh.h"

VSH_BEGIN_C

/* An OpenVDB level set of floats. Immutable; threads may share it. Free it with vsh_grid_free(). */
typedef struct vsh_grid vsh_grid;

/* How a level set is made. */
typedef struct vsh_grid_options {
    size_t struct_size;
    double voxel_size;  /* edge of a voxel, world units, 1e-12 … 1e12; 0: by `resolution` */
    int32_t resolution; /* voxels along the longest side of the bounds, 2 … 65536, if voxel_size is 0 */
    double half_width;  /* of the narrow band, voxels, 3 … 100. Many triangles lower this limit, but never
                           below 12 */
    double shell_thickness; /* of sheets and walls, voxels, 1 … 50 */
} vsh_grid_options;

static inline vsh_grid_options vsh_grid_options_default(void) {
    vsh_grid_options options = {sizeof(vsh_grid_options), 0.0, 256, 3.0, 2.0};
    return options;
}

/* Makes the union of meshes, by their solidity (vsh_mesh.solidity): solids, closed over their holes, minus
 * the rooms in them; walls of shell_thickness behind faces that look inwards; shells of shell_thickness
 * around sheets. Notes report closed holes, sheets and faces that look the wrong way. Errors:
 * - VSH_ERROR_ARGUMENT: no meshes, options out of range, run, and as vsh_mesh_check();
 * - VSH_ERROR_INPUT: as vsh_mesh_check(); no triangle with area;
 * - VSH_ERROR_LIMIT: memory beyond run->memory_limit or the machine's; a voxel size outside 1e-12 … 1e12;
 *   more than 2^29 voxels along a side or 1e12 from the origin; more than 2^31 - 1 triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_meshes(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                        vsh_error *error);

/* Makes a level set of a procedural SDF. If the tree is no true distance, distances are computed again from
 * its zero surface. Errors:
 * - VSH_ERROR_ARGUMENT: options out of range, run;
 * - VSH_ERROR_INPUT: a node out of range, a bad tree, a tree without a surface;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_sdf(const vsh_sdf *sdf, const vsh_grid_options *options, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);

/* Extrudes an outline from z = -thickness / 2 to thickness / 2, with true distances. `transform` [12], local
 * to world, three rows of four: rotation, translation, mirroring and uniform scale (to 1e-6); NULL: identity.
 * Errors:
 * - VSH_ERROR_ARGUMENT: outline or grid NULL, thickness (local units, > 0 … 1e15), another transform,
 *   options out of range, run;
 * - VSH_ERROR_INPUT: a solid too thin for the voxels;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_outline(const vsh_outline *outline, double thickness,
                                         const double *transform, const vsh_grid_options *options,
                                         const vsh_run *run, vsh_grid **grid, vsh_error *error);

/* Returns the signed distance at a world position, negative inside. Many threads call it at once, also for
 * positions outside the bounds. Equal positions must give equal values. */
typedef double vsh_distance_fn(void *user, const double position[3]);

/* A distance field given by a callback. A view. */
typedef struct vsh_distance {
    vsh_distance_fn *distance; /* the callback */
    void *user;                /* passed to the callback */
    double lipschitz; /* bound on |distance(a) - distance(b)| / |a - b|, > 0; 1 for a true distance. A value
                         that is too low loses parts of the surface */
    int32_t exact;    /* nonzero: a true distance near the surface; 0: distances are computed again */
    double bounds_min[3]; /* world box around the whole surface, finite */
    double bounds_max[3]; /* the other corner */
} vsh_distance;

/* Makes a level set of a callback. Errors:
 * - VSH_ERROR_ARGUMENT: field or callback NULL, lipschitz or bounds, options out of range, run;
 * - VSH_ERROR_INPUT: the callback returns a value that is not finite; there is no surface; the bounds are a
 *   point and options give a resolution;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_distance(const vsh_distance *field, const vsh_grid_options *options,
                                          const vsh_run *run, vsh_grid **grid, vsh_error *error);

/* Writes the signed distances of `count` world positions [count][3] to distances[count]. */
typedef void vsh_distances_fn(void *user, size_t count, const double *positions, double *distances);

/* As vsh_grid_from_distance(), with a callback that takes 8 or 64 positions at a time, for languages in which
 * a call is slow. field->distance is not called. If distances are computed again, it also gets single
 * positions. */
VSH_API vsh_result vsh_grid_from_distances(const vsh_distance *field, vsh_distances_fn *distances,
                                           const vsh_grid_options *options, const vsh_run *run,
                                           vsh_grid **grid, vsh_error *error);

/* Reads level set `name` of a .vdb file. NULL: the first level set with a surface that can cast; a warning
 * names the others. Transforms may translate, rotate, mirror and scale uniformly, with voxels of 1e-5 … 1e12
 * world units. If values are no distances or the band is narrower than 3 voxels, distances are computed again
 * from the zero surface, with a warning. Use run->reader for files from strangers. Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_READ: no such file, no permission, no .vdb file, cut short, a newer format, damaged;
 * - VSH_ERROR_INPUT: no grids; none of that name; a grid that is no level set of floats or doubles, is
 *   scaled unevenly, sheared, inside out, without a surface, or has values that are not finite;
 * - VSH_ERROR_LIMIT: memory beyond run->memory_limit or the machine's;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                                 vsh_error *error);

/* Writes a .vdb file with the grid as `name` (NULL: "surface") and attributes [attribute_count] as its
 * metadata. Equal grids give equal bytes. Atomic: the file is renamed into place when it is complete. Errors:
 * - VSH_ERROR_ARGUMENT: path NULL or empty, bad attributes;
 * - VSH_ERROR_LIMIT: voxels below 1.45e-5 world units, which OpenVDB cannot write;
 * - VSH_ERROR_WRITE: no such folder, no permission, a folder or device in the way, disk full;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_grid_write(const vsh_grid *grid, const char *path, const char *name,
                                  const vsh_attribute *attributes, size_t attribute_count, vsh_error *error);

/* A grid and its place, for vsh_grid_unite(). A view. */
typedef struct vsh_grid_instance {
    const vsh_grid *grid;    /* instances may share it */
    const double *transform; /* [12], from the grid's world to world, three rows of four: rotation,
                                translation, mirroring and uniform scale (to 1e-6); NULL: identity */
} vsh_grid_instance;

/* Makes the union of grids, with voxels of options->voxel_size (0: the finest of the grids; `resolution` is
 * ignored) and options->half_width. Grids on another lattice or with a narrower band are meshed and measured
 * again. With a voxel_size of 0, a single untransformed grid is shared as it is. Errors:
 * - VSH_ERROR_ARGUMENT: no grids, a NULL grid, another transform, options out of range, run;
 * - VSH_ERROR_INPUT: a grid to be measured again has no surface;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_unite(const vsh_grid_instance *instances, size_t instance_count,
                                  const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                  vsh_error *error);

/* Size and place of a level set. */
typedef struct vsh_grid_info {
    double voxel_size;      /* world units */
    double half_width;      /* voxels */
    double bounds_min[3];   /* world box of the voxels inside the surface and next to it */
    double bounds_max[3];   /* the other corner */
    double shell_thickness; /* of sheets, world units; 0: there are none */
    uint64_t active_voxels; /* of the band */
    uint64_t bytes;         /* in memory */
    int32_t index_min[3];   /* box of the band's voxels, inclusive */
    int32_t index_max[3];   /* the other corner */
    double transform[12];   /* from a voxel's centre (x, y, z) to world: three rows of four */
} vsh_grid_info;

/* Fills *info. Cannot fail. */
VSH_API void vsh_grid_get_info(const vsh_grid *grid, vsh_grid_info *info);

/* Copies the distances of size[0] × size[1] × size[2] voxels from `index_min` on into values, x fastest,
 * world units, negative inside; beyond the band ± its half width. Runs on the calling thread. Errors:
 * VSH_ERROR_ARGUMENT (a size below 1, indices beyond 32 bits). */
VSH_API vsh_result vsh_grid_copy(const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3],
                                 float *values, vsh_error *error);
VSH_API void vsh_grid_free(vsh_grid *grid); /* NULL does nothing */

/* C++ programs call vdbshade::grid_from_openvdb() and vdbshade::grid_to_openvdb() (volume.h) instead.
 * `level_set` points to an openvdb::FloatGrid::ConstPtr; `version` and `abi` are the caller's
 * OPENVDB_LIBRARY_VERSION_NUMBER and OPENVDB_ABI_VERSION_NUMBER. */
VSH_API vsh_result vsh_grid_from_openvdb(const void *level_set, uint32_t version, uint32_t abi,
                                         const vsh_run *run, vsh_grid **grid, vsh_error *error);
VSH_API vsh_result vsh_grid_to_openvdb(const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set,
                                       vsh_error *error);

/* A grid of a .vdb file, of any kind. Texts that do not fit are cut. */
typedef struct vsh_vdb_entry {
    char name[128];         /* may be empty; several grids may share it */
    char type[64];          /* "Tree_float_5_4_3" */
    char grid_class[32];    /* "level set", "fog volume", … */
    double voxel_size[3];   /* world units along the grid's own axes */
    double background;      /* 0 if values are neither floats nor doubles */
    int32_t index_min[3];   /* box of the active voxels; 0 if there are none */
    int32_t index_max[3];   /* the other corner */
    uint64_t active_voxels; /* including those of tiles */
    uint64_t bytes;         /* in memory */
    char problem[256];      /* why it cannot cast, or what is odd about it; empty: nothing */
    char attributes[8192];  /* metadata that vdbshade wrote: lines "NAME: VALUE", each with a newline */
    int32_t mended;         /* nonzero: it can cast, because vsh_grid_read() repairs `problem` */
} vsh_vdb_entry;

/* Lists up to `capacity` grids of a .vdb file into `entries` (may be NULL if that is 0) and sets *count to
 * their number, which may be larger (0 on failure). It reads and checks one grid at a time, as
 * vsh_grid_read(). A grid beyond run->memory_limit or the machine's memory gets a background of 0 and that as
 * its problem. Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_READ: as vsh_grid_read();
 * - VSH_ERROR_LIMIT: the reader takes more than run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_vdb_list(const char *path, const vsh_run *run, vsh_vdb_entry *entries, size_t capacity,
                                size_t *count, vsh_error *error);

VSH_END_C
