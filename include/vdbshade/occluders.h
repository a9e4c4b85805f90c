/* Occluders: everything that casts, as one handle. Points, lightmaps, volumes and pictures are shaded against
 * it.
 *
 *     vsh_occluders *occluders;
 *     vsh_occluders_options options = vsh_occluders_options_default();
 *     options.grid.resolution = 256; // voxels too, for methods that march and for distances
 *     vsh_occluders_create(meshes, mesh_count, &options, &run, &occluders, &error);
 *     double point[3] = {0.0, 1.0, 0.0};
 *     float distance;
 *     vsh_field_sample(vsh_occluders_get_field(occluders, NULL), 1, point, &distance);
 *     vsh_occluders_free(occluders);
 *
 * vsh_scene_occluders() makes them of a scene, with layers, heightfields and spheres. */
#pragma once

#include "grid.h"

VSH_BEGIN_C

/* The triangles and voxels of all casters. Immutable; threads may share it. Free it with
 * vsh_occluders_free(). */
typedef struct vsh_occluders vsh_occluders;

/* How occluders are made. */
typedef struct vsh_occluders_options {
    size_t struct_size;
    double reach; /* largest distance from a surface that the voxels must resolve, world units: the tangent of
                     the widest light's half angle times the longest ray, or the AO distance. 0: four times
                     the diagonal of the casters' box */
    double grown; /* voxels that casters are grown by for rays, 0 … 1 (0.15). A trilinear sample over a convex
                     edge is too large, so voxelized casters seem smaller than they are. 0: the voxels define
                     the caster */
    int32_t triangles; /* nonzero: keep the triangles if the library has Embree. Then methods can be exact,
                          auto is exact, and bakes can measure their error. 0: voxels alone, about 100 bytes
                          less for each triangle */
    vsh_grid_options grid; /* of the voxels. If resolution and voxel_size are 0 and triangles are kept, there
                              are no voxels: methods are auto or exact, and distances are unknown. If both
                              are 0 without triangles, the resolution is 256 */
} vsh_occluders_options;

static inline vsh_occluders_options vsh_occluders_options_default(void) {
    vsh_occluders_options options = {sizeof(vsh_occluders_options), 0.0, 0.15, 1, vsh_grid_options_default()};
    options.grid.resolution = 0;
    return options;
}

/* Makes occluders of meshes, which need not outlive the call. Errors:
 * - VSH_ERROR_ARGUMENT: no meshes, options out of range, run, and as vsh_mesh_check();
 * - VSH_ERROR_UNSUPPORTED: Embree cannot be loaded;
 * - VSH_ERROR_INPUT, VSH_ERROR_LIMIT: as vsh_grid_from_meshes();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_occluders_create(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_occluders_options *options, const vsh_run *run,
                                        vsh_occluders **occluders, vsh_error *error);

/* Makes occluders of a level set, which need not outlive the call. Only the options `reach` and `grown`
 * apply. Time and memory follow the area of the surface. Errors:
 * - VSH_ERROR_ARGUMENT: options out of range, run;
 * - VSH_ERROR_INPUT: a grid without a surface;
 * - VSH_ERROR_LIMIT: run->memory_limit; more than 2^31 blocks or 2.9 million bricks of 8³ voxels;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_occluders_from_grid(const vsh_grid *grid, const vsh_occluders_options *options,
                                           const vsh_run *run, vsh_occluders **occluders, vsh_error *error);
VSH_API void vsh_occluders_free(vsh_occluders *occluders); /* NULL does nothing */

/* Size and cost of occluders. */
typedef struct vsh_occluders_info {
    double voxel_size;  /* world units, of the casters in no layer, else of the first layer; 0: no voxels */
    int32_t levels;     /* of the field with that voxel size */
    size_t layer_count; /* layers that have casters */
    uint64_t active_voxels;   /* of all level sets */
    uint64_t grid_bytes;      /* memory of the level sets while occluders were made */
    uint64_t bricks;          /* of 8³ cells, of all fields */
    uint64_t field_bytes;     /* memory of all fields */
    uint64_t triangles_bytes; /* memory of triangles and their trees */
    int32_t has_triangles;    /* 1: casters in no layer have triangles, so auto is exact for them */
    double voxelize_s;        /* seconds to make the level sets */
    double field_s;           /* seconds to make the fields */
    double triangles_s;       /* seconds to make the trees of triangles */
} vsh_occluders_info;

/* Fills *info. Cannot fail. */
VSH_API void vsh_occluders_get_info(const vsh_occluders *occluders, vsh_occluders_info *info);

/* How the visibility of a scene's layer is combined with that of the others. */
typedef enum vsh_combine {
    VSH_COMBINE_MULTIPLY = 0, /* product: layers hide independent parts of a light */
    VSH_COMBINE_MIN = 1       /* minimum: layers hide the same part of it */
} vsh_combine;

/* --- the field: a pyramid of narrow bands that shadows are marched through
 *
 * Levels have voxels of 1, 2, 4, … times the size, and each has its own band. */

/* Belongs to its occluders. */
typedef struct vsh_field vsh_field;

/* The field of the casters in no layer (`layer` NULL), or in the scene's layer of that name. NULL if that
 * layer has no voxels. The field of casters that are only traced has no distances: they are NaN. Cannot fail.
 */
VSH_API const vsh_field *vsh_occluders_get_field(const vsh_occluders *occluders, const char *layer);

/* Writes signed distances, world units, negative inside, at `count` world positions [count][3] to
 * distances[count]. Within the finest band they are trilinear samples of the level set. Beyond it they never
 * exceed the true distance, so that rays can step by them; within the reach they are 0.7 to 0.95 of it. NaN
 * for positions that are not finite. Runs on the calling thread. */
VSH_API void vsh_field_sample(const vsh_field *field, size_t count, const double *positions,
                              float *distances);

/* Size of a field. */
typedef struct vsh_field_info {
    double voxel_size;      /* of the finest level, world units */
    double reach;           /* distance that the coarsest level resolves, world units */
    double bounds_min[3];   /* world box of the casters */
    double bounds_max[3];   /* the other corner */
    double shell_thickness; /* of sheets, world units; 0: there are none */
    int32_t levels;         /* of the pyramid, with the finest */
    uint64_t bricks;        /* of 8³ cells, over all levels */
    uint64_t bytes;         /* in memory */
    uint64_t active_voxels; /* of the level set that it was made of */
} vsh_field_info;

/* Fills *info. Cannot fail. */
VSH_API void vsh_field_get_info(const vsh_field *field, vsh_field_info *info);

VSH_END_C
