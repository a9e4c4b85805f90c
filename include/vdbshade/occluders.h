/* What casts, as one handle: points, lightmaps, volumes, pictures and distances are asked of it. */
#ifndef VDBSHADE_OCCLUDERS_H
#define VDBSHADE_OCCLUDERS_H

#include "field.h"
#include "layer.h"
#include "trace.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A field, triangles for exact methods, layers beside them, and what errors are measured against. Immutable;
 * may be shared by threads. Made from meshes or a level set here, from parts of the caller's own, or from a
 * scene (vsh_scene_occluders()). Free it with vsh_occluders_free(). */
typedef struct vsh_occluders vsh_occluders;

/* How occluders are made of meshes. */
typedef struct vsh_occluders_options {
    size_t struct_size;
    double reach;          /* as in vsh_field_options */
    int32_t triangles;     /* nonzero: keep the triangles where the library has Embree: exact methods can then
                              be asked for, auto is exact, and errors are measured against them. 0: voxels
                              alone, some 100 bytes less a triangle */
    vsh_grid_options grid; /* of the voxels. A resolution and a voxel size of 0: none where triangles are
                              kept, so that only auto and exact can be asked for, and no distances; else a
                              resolution of 256 */
} vsh_occluders_options;

static inline vsh_occluders_options vsh_occluders_options_default(void) {
    vsh_occluders_options options = {sizeof(vsh_occluders_options), 0.0, 1, vsh_grid_options_default()};
    options.grid.resolution = 0;
    return options;
}

/* Meshes as what casts: their triangles kept, and where voxels are asked for, voxelised and a field made of
 * them. The meshes need not outlive the call. Errors:
 * - VSH_ERROR_ARGUMENT: no meshes, options out of range, run, and as vsh_mesh_check();
 * - VSH_ERROR_INPUT, VSH_ERROR_LIMIT: as vsh_grid_from_meshes(), vsh_field_create() and
 *   vsh_triangles_create();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_occluders_create(const vsh_mesh *meshes, size_t mesh_count,
                                        const vsh_occluders_options *options, const vsh_run *run,
                                        vsh_occluders **occluders, vsh_error *error);

/* A level set as what casts: that of a .vdb file, a callback or a procedural tree, or a union of them
 * (grid.h). NULL options stand for their default. The grid need not outlive the call. Errors: as
 * vsh_field_create(). */
VSH_API vsh_result vsh_occluders_from_grid(const vsh_grid *grid, const vsh_field_options *options,
                                           const vsh_run *run, vsh_occluders **occluders, vsh_error *error);

/* What a handle is made of, for casters that are in none of these: heights, spheres, groups that are shaded
 * each in its own way, a field with triangles of another shape. A view; nothing is owned. */
typedef struct vsh_occluder_parts {
    size_t struct_size;
    const vsh_field *field; /* casters in no layer; NULL: they are known by their triangles alone, which auto
                               and exact trace, or all casters are in layers */
    const vsh_triangles *triangles; /* of the same casters, for exact methods; NULL: none */
    const vsh_layer
        *layers;        /* [layer_count]: casters beside those; may be NULL. Each has the same struct_size */
    size_t layer_count; /* 0 … VSH_MAX_LAYERS */
    const vsh_triangles *true_triangles; /* these two: the casters themselves, which stand for the truth where
                                            a bake is asked for its errors (vsh_bake_stats). Together they are
                                            all casters; not with layers. Both NULL: nothing is measured */
    const vsh_solids *true_solids;
    double voxel_size; /* what start offsets are measured in where there is no field, world units, 1e-12 …
                        * 1e12; 0: 1/96 of the triangles' longest side, else that of the finest layer's field,
                        * or 1e-5 of the first layer's longest side */
} vsh_occluder_parts;

static inline vsh_occluder_parts vsh_occluder_parts_default(void) {
    vsh_occluder_parts parts = {sizeof(vsh_occluder_parts), NULL, NULL, NULL, 0, NULL, NULL, 0.0};
    return parts;
}

/* Parts as what casts. The layers are copied; what they and the parts refer to must outlive the handle.
 * Errors: VSH_ERROR_ARGUMENT (neither field nor triangles nor layers nor a voxel size; more layers than
 * VSH_MAX_LAYERS; a layer that is out of range, its number and member in the message), VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_occluders_from_parts(const vsh_occluder_parts *parts, vsh_occluders **occluders,
                                            vsh_error *error);
VSH_API void vsh_occluders_free(vsh_occluders *occluders); /* NULL does nothing */

/* What a handle is made of: views into it. `field` is never NULL; it holds nothing where all casters are in
 * layers, and knows no distances (NaN) of casters without voxels. Cannot fail. */
VSH_API void vsh_occluders_get_parts(const vsh_occluders *occluders, vsh_occluder_parts *parts);

/* What occluders come to. */
typedef struct vsh_occluders_info {
    double voxel_size;        /* of the first field, world units: that of casters in no layer where there are
                                 such; 0: nothing is voxelised */
    int32_t levels;           /* of the same */
    size_t layer_count;       /* those that have casters */
    uint64_t active_voxels;   /* of all level sets */
    uint64_t grid_bytes;      /* of the same, in memory while they were there; 0 of parts */
    uint64_t bricks;          /* these two of all fields */
    uint64_t field_bytes;     /* in memory */
    uint64_t triangles_bytes; /* in memory, the true ones too */
    int32_t has_triangles;    /* 1: of casters in no layer; auto is exact for them */
    double voxelize_s;        /* seconds that these took to make; 0 of parts */
    double field_s;           /* the same, of the field */
    double triangles_s;       /* the same, of what rays are traced in */
} vsh_occluders_info;

/* Cannot fail. */
VSH_API void vsh_occluders_get_info(const vsh_occluders *occluders, vsh_occluders_info *info);

#ifdef __cplusplus
}
#endif
#endif
