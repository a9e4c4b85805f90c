/* Narrow-band level sets: OpenVDB grids made from meshes, procedural SDFs, callbacks and .vdb files. */
#ifndef VDBSHADE_GRID_H
#define VDBSHADE_GRID_H

#include "base.h"
#include "mesh.h"
#include "outline.h"
#include "sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An OpenVDB level set of floats. Free it with vsh_grid_free(). */
typedef struct vsh_grid vsh_grid;

/* How a level set is made. */
typedef struct vsh_grid_options {
    size_t struct_size;
    double voxel_size;  /* edge of a voxel, world units, 1e-12 … 1e12; 0: from `resolution` */
    int32_t resolution; /* voxels along the longest side of the bounds, 2 … 65536, where voxel_size is 0 */
    double
        half_width; /* of the narrow band, voxels, 3 … 100. Many triangles lower the limit, to 12 at least */
    double shell_thickness; /* of sheets and walls, voxels, 1 … 50 */
} vsh_grid_options;

static inline vsh_grid_options vsh_grid_options_default(void) {
    vsh_grid_options options = {sizeof(vsh_grid_options), 0.0, 256, 3.0, 2.0};
    return options;
}

/* The union of what the meshes are taken for (vsh_mesh.solidity): solids (closed over their holes, with a
 * note) less the rooms in them; walls of shell_thickness behind faces that look inwards; shells of
 * shell_thickness around sheets, with a note. Faces that look the other way than those around are noted
 * too. Errors:
 * - VSH_ERROR_ARGUMENT: no meshes, options out of range, run, and as vsh_mesh_check();
 * - VSH_ERROR_INPUT: as vsh_mesh_check(); no triangle of any area;
 * - VSH_ERROR_LIMIT: the estimated memory passes run->memory_limit or the machine's, a voxel size outside
 *   1e-12 … 1e12, more than 2^29 voxels along a side or 1e12 from the origin, more than 2^31 - 1
 *   triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_meshes(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                        vsh_error *error);

/* A procedural tree, voxelised where its surface is; one that is no true distance (vsh_sdf_distance()) is
 * re-distanced. Errors:
 * - VSH_ERROR_ARGUMENT: options out of range, run;
 * - VSH_ERROR_INPUT: as vsh_sdf_check(); the tree has no surface, such as an intersection of what does not
 *   meet;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes(), but for triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_sdf(const vsh_sdf *sdf, const vsh_grid_options *options, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);

/* The solid that the outline makes between z = -thickness / 2 and z = +thickness / 2, with its true distance.
 * `transform` [12], local to world, three rows of four: any of rotation, translation, mirroring and one scale
 * (to 1e-6); NULL: identity. Errors:
 * - VSH_ERROR_ARGUMENT: outline or grid NULL, thickness (local units, > 0 … 1e15), a transform other than
 * those, options out of range, run;
 * - VSH_ERROR_INPUT: a solid too thin for the voxels;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes(), but for triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_outline(const vsh_outline *outline, double thickness,
                                         const double *transform, const vsh_grid_options *options,
                                         const vsh_run *run, vsh_grid **grid, vsh_error *error);

/* Signed distance at a world position, negative inside. Called by many threads at once, for positions outside
 * the bounds too; must return, and the same value for the same position. */
typedef double vsh_distance_fn(void *user, const double position[3]);

/* A field given by a callback. A view; nothing is owned. */
typedef struct vsh_distance {
    vsh_distance_fn *distance; /* the callback */
    void *user;                /* handed to it */
    double lipschitz;     /* bound on |distance(a) - distance(b)| / |a - b|, > 0; 1 for a true distance. Less
                             than the truth loses parts of the surface */
    int32_t exact;        /* nonzero: a true distance near the surface, taken as it is; 0: re-distanced */
    double bounds_min[3]; /* world box that holds the whole surface, finite */
    double bounds_max[3];
} vsh_distance;

/* A field given by a callback, voxelised where its surface is. Errors:
 * - VSH_ERROR_ARGUMENT: field or callback NULL, lipschitz or bounds, options out of range, run;
 * - VSH_ERROR_INPUT: the callback returns a value that is not finite, or shows no surface; bounds without
 *   any size where the voxel size is to follow from the resolution;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes(), but for triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_from_distance(const vsh_distance *field, const vsh_grid_options *options,
                                          const vsh_run *run, vsh_grid **grid, vsh_error *error);

/* Signed distances at `count` world positions [count][3] into distances[count]: as vsh_distance_fn, 8 or 64
 * positions at a time where there are so many. */
typedef void vsh_distances_fn(void *user, size_t count, const double *positions, double *distances);

/* The same level set as of vsh_grid_from_distance(), of a callback that is asked for many positions at once:
 * `distances` in place of field->distance, which is not called. For callers to whom a call is dear. A field
 * that is re-distanced is asked for single positions, too. Errors: as there. */
VSH_API vsh_result vsh_grid_from_distances(const vsh_distance *field, vsh_distances_fn *distances,
                                           const vsh_grid_options *options, const vsh_run *run,
                                           vsh_grid **grid, vsh_error *error);

/* Reads level set `name` of a .vdb file; NULL: the first grid of class level set that has a surface and can
 * cast, with a warning that names the others. Translated, rotated,
 * mirrored and uniformly scaled transforms are kept, with voxels of 1e-5 … 1e12 world units. Where the
 * values are no distances, or the band is narrower than 3 voxels, distances are made anew from the zero
 * surface, with a warning; one is given, too, where values show damage. OpenVDB's reader can crash on damaged
 * files: those from strangers are for run->reader (base.h). Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_READ: no such file, no permission, no .vdb file, cut short, of a newer format, damaged;
 * - VSH_ERROR_INPUT: no grids, none of that name, or, with the reason, a grid that is no level set of
 *   floats or doubles, is scaled unevenly, sheared, inside out or without a surface, or holds values that
 *   are not finite;
 * - VSH_ERROR_LIMIT: the grid, or making its distances anew, passes run->memory_limit or the machine's
 * memory;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                                 vsh_error *error);

/* Writes one .vdb file with the grid as `name` (NULL: "surface") and attributes [attribute_count] as its
 * metadata (may be NULL where that is 0); the same grid gives the same bytes. Atomic: written beside `path`
 * and renamed, so a failure leaves an old file alone. Errors: VSH_ERROR_ARGUMENT (path NULL or empty,
 * attributes other than vsh_attribute says), VSH_ERROR_LIMIT (voxels below 1.45e-5 world units, which OpenVDB
 * cannot write), VSH_ERROR_WRITE (no such folder, no permission, a folder or device in the way, disk full),
 * VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_grid_write(const vsh_grid *grid, const char *path, const char *name,
                                  const vsh_attribute *attributes, size_t attribute_count, vsh_error *error);

/* A caster for vsh_grid_unite(): a grid and where it stands. A view; nothing is owned. */
typedef struct vsh_grid_instance {
    const vsh_grid *grid;    /* in a place of its own, or in several */
    const double *transform; /* [12], grid's world to world, three rows of four: any of rotation, translation,
                                mirroring and one scale (to 1e-6); NULL: as it is */
} vsh_grid_instance;

/* The union of grids as one level set of options->voxel_size (0: the finest of them, whatever `resolution`
 * says) and options->half_width. Grids on another lattice, or with a narrower band, are meshed and measured
 * again; one alone that stands as it is, with a voxel_size of 0, is shared as it is, band included. Errors:
 * - VSH_ERROR_ARGUMENT: no grids, one that is NULL, a transform other than those above, options out of
 *   range, run;
 * - VSH_ERROR_INPUT: a grid to be measured again that has no surface;
 * - VSH_ERROR_LIMIT: as vsh_grid_from_meshes(), but for triangles;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_unite(const vsh_grid_instance *instances, size_t instance_count,
                                  const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                  vsh_error *error);

/* What a level set comes to. */
typedef struct vsh_grid_info {
    double voxel_size;    /* world units */
    double half_width;    /* voxels */
    double bounds_min[3]; /* world box of the voxels inside the surface or next to it */
    double bounds_max[3];
    double shell_thickness; /* world units, of sheets in it; 0: none */
    uint64_t active_voxels; /* of the band */
    uint64_t bytes;         /* in memory */
    int32_t index_min[3];   /* box of the band's voxels, inclusive */
    int32_t index_max[3];
    double transform[12]; /* voxel (x, y, z), its centre, to world: three rows of four */
} vsh_grid_info;

/* Cannot fail. */
VSH_API void vsh_grid_get_info(const vsh_grid *grid, vsh_grid_info *info);

/* A dense copy: the distances of size[0] × size[1] × size[2] voxels from `index_min` on into values, x
 * fastest (base.h), world units, negative inside; beyond the band ± its half width. Runs on the calling
 * thread. Errors: VSH_ERROR_ARGUMENT (a size below 1, indices beyond 32 bits). */
VSH_API vsh_result vsh_grid_copy(const vsh_grid *grid, const int32_t index_min[3], const int32_t size[3],
                                 float *values, vsh_error *error);
VSH_API void vsh_grid_free(vsh_grid *grid); /* NULL does nothing */

/* For <vdbshade/openvdb.h>, whose functions call these: `level_set` points to an
 * openvdb::FloatGrid::ConstPtr, `version` and `abi` are the caller's OPENVDB_LIBRARY_VERSION_NUMBER and
 * OPENVDB_ABI_VERSION_NUMBER. */
VSH_API vsh_result vsh_grid_from_openvdb(const void *level_set, uint32_t version, uint32_t abi,
                                         const vsh_run *run, vsh_grid **grid, vsh_error *error);
VSH_API vsh_result vsh_grid_to_openvdb(const vsh_grid *grid, uint32_t version, uint32_t abi, void *level_set,
                                       vsh_error *error);

/* One grid of a .vdb file, of any kind. Texts that do not fit are cut. */
typedef struct vsh_vdb_entry {
    char name[128];       /* may be empty, and of several grids the same */
    char type[64];        /* "Tree_float_5_4_3" */
    char grid_class[32];  /* "level set", "fog volume", … */
    double voxel_size[3]; /* world units along the grid's own axes */
    double background;    /* 0 where the values are not floats or doubles */
    int32_t index_min[3]; /* of the active voxels; 0 where there are none */
    int32_t index_max[3];
    uint64_t active_voxels; /* with those of tiles */
    uint64_t bytes;         /* in memory */
    char problem[256];      /* why it cannot cast shadows, or what is odd about it; empty: nothing */
    char attributes[8192];  /* metadata that vdbshade wrote: lines "NAME: VALUE", each with a newline */
    int32_t mended; /* nonzero: it can cast, as vsh_grid_read() makes its distances anew for `problem` */
} vsh_vdb_entry;

/* Lists up to `capacity` grids of a .vdb file into `entries` (may be NULL where that is 0), and their
 * number into *count, which may be larger (0 on failure). Grids are read one at a time and looked at as by
 * vsh_grid_read(); one that passes run->memory_limit or the machine's memory is described by what its file
 * says of it, with a background of 0 and that as its problem. Errors:
 * - VSH_ERROR_ARGUMENT: run;
 * - VSH_ERROR_READ: as vsh_grid_read();
 * - VSH_ERROR_LIMIT: a streamed file, which can only be read whole, that passes run->memory_limit;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_vdb_list(const char *path, const vsh_run *run, vsh_vdb_entry *entries, size_t capacity,
                                size_t *count, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
