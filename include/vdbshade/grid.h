/* Narrow-band level sets: OpenVDB grids made from meshes, procedural SDFs, callbacks and .vdb files. */
#ifndef VDBSHADE_GRID_H
#define VDBSHADE_GRID_H

#include "base.h"
#include "mesh.h"
#include "sdf.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An OpenVDB level set of floats. Immutable; may be shared by threads. Free it with vsh_grid_free(). */
typedef struct vsh_grid vsh_grid;

typedef struct vsh_grid_options {
    size_t struct_size;
    double voxel_size; /* edge of a voxel, world units, > 0; 0: from `resolution` */
    int32_t
        resolution; /* voxels along the longest side of the bounds, 2 … 65536; used where voxel_size is 0 */
    double half_width;      /* of the narrow band, voxels, 3 … 100 */
    double shell_thickness; /* of the solid that an open mesh becomes, voxels, 1 … 50 */
} vsh_grid_options;

static inline vsh_grid_options vsh_grid_options_default(void) {
    vsh_grid_options options = {sizeof(vsh_grid_options), 0.0, 256, 3.0, 2.0};
    return options;
}

/* The union of the meshes' solids. An open mesh (vsh_mesh_report.open_edges) becomes a shell of
 * shell_thickness around its triangles, with a warning. Errors: as vsh_mesh_check(); VSH_ERROR_ARGUMENT;
 * VSH_ERROR_LIMIT when the estimated voxels pass run->memory_limit or the index range; VSH_ERROR_CANCELLED.
 */
VSH_API vsh_result vsh_grid_from_meshes(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                        vsh_error *error);

/* A procedural tree, voxelised where its surface is. Errors: as vsh_sdf_check() and above. */
VSH_API vsh_result vsh_grid_from_sdf(const vsh_sdf *sdf, const vsh_grid_options *options, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);

/* Signed distance at a world position, negative inside; called by many threads at once. */
typedef double vsh_distance_fn(void *user, const double position[3]);

/* A field given by a callback. */
typedef struct vsh_distance {
    vsh_distance_fn *distance;
    void *user;
    double lipschitz;     /* bound on |distance(a) - distance(b)| / |a - b|, > 0; 1 for a true distance */
    int32_t exact;        /* nonzero: a true distance near the surface, taken as it is; 0: re-distanced */
    double bounds_min[3]; /* world box that holds the whole surface */
    double bounds_max[3];
} vsh_distance;

/* Errors: as above; VSH_ERROR_INPUT where the callback returns a value that is not finite, or shows no
 * surface. */
VSH_API vsh_result vsh_grid_from_distance(const vsh_distance *field, const vsh_grid_options *options,
                                          const vsh_run *run, vsh_grid **grid, vsh_error *error);

/* Reads level set `name` of a .vdb file; NULL: the first. Translated, rotated, mirrored and uniformly scaled
 * transforms are kept. Errors: VSH_ERROR_READ; VSH_ERROR_INPUT with the reason for a grid that is no level
 * set of floats or doubles, is scaled unevenly, sheared or empty, or holds values that are not finite. */
VSH_API vsh_result vsh_grid_read(const char *path, const char *name, const vsh_run *run, vsh_grid **grid,
                                 vsh_error *error);

/* Writes one .vdb file with the grid as `name` (NULL: "surface"). Atomic: a failure leaves an old file alone.
 */
VSH_API vsh_result vsh_grid_write(const vsh_grid *grid, const char *path, const char *name, vsh_error *error);

/* A caster for vsh_grid_unite(): a grid and where it stands (three rows of four; NULL: as it is). The
 * transform must be a rotation, translation, mirroring or uniform scale. */
typedef struct vsh_grid_instance {
    const vsh_grid *grid;
    const double *transform;
} vsh_grid_instance;

/* The union of grids as one level set of voxel size `options->voxel_size` (0: the finest of them); those with
 * another lattice are resampled. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_LIMIT, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_grid_unite(const vsh_grid_instance *instances, size_t instance_count,
                                  const vsh_grid_options *options, const vsh_run *run, vsh_grid **grid,
                                  vsh_error *error);

typedef struct vsh_grid_info {
    double voxel_size;    /* world units */
    double half_width;    /* voxels */
    double bounds_min[3]; /* world box of the voxels inside the surface or next to it */
    double bounds_max[3];
    double shell_thickness; /* world units, of open meshes in it; 0: none */
    uint64_t active_voxels;
    uint64_t bytes;
} vsh_grid_info;

VSH_API void vsh_grid_get_info(const vsh_grid *grid, vsh_grid_info *info);
VSH_API void vsh_grid_free(vsh_grid *grid); /* NULL does nothing */

/* One entry of a .vdb file, of any kind. */
typedef struct vsh_vdb_entry {
    char name[128];
    char type[64];        /* "Tree_float_5_4_3" */
    char grid_class[32];  /* "level set", "fog volume", … */
    double voxel_size[3]; /* world units along the grid's own axes */
    double background;    /* 0 where the values are no scalars */
    int32_t index_min[3]; /* of the active voxels */
    int32_t index_max[3];
    uint64_t active_voxels;
    uint64_t bytes;
    char problem[256]; /* why it cannot cast shadows, or what is odd about it; empty: nothing */
} vsh_vdb_entry;

/* Lists up to `capacity` grids of a .vdb file into `entries`, and their number into *count (which may be
 * larger). Errors: VSH_ERROR_READ, VSH_ERROR_INPUT. */
VSH_API vsh_result vsh_vdb_list(const char *path, vsh_vdb_entry *entries, size_t capacity, size_t *count,
                                vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
