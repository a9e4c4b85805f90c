/* Scenes: casters, lights and receivers as one description, read from a JSON file (docs/scene.md). */
#ifndef VDBSHADE_SCENE_H
#define VDBSHADE_SCENE_H

#include "bake.h"
#include "grid.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_CASTER_MESH = 0, VSH_CASTER_SDF = 1, VSH_CASTER_VDB = 2 };

typedef struct vsh_caster {
    int32_t type;         /* VSH_CASTER_… */
    const char *path;     /* mesh, vdb: file */
    const char *grid;     /* vdb: name of the grid, or NULL */
    vsh_sdf sdf;          /* sdf: tree */
    double transform[12]; /* local to world, three rows of four; sdf and vdb: without shear or uneven scale */
} vsh_caster;

typedef struct vsh_receiver {
    const char *path;     /* mesh file */
    double transform[12]; /* local to world */
    int32_t uv_set;       /* from 0; -1: the second where there is one, else the first */
    int32_t width;        /* texels */
    int32_t height;
    int32_t supersample;
    int32_t padding;
    const char *output; /* image file */
    int32_t bits;       /* as in vsh_image_options */
    const char *pack;   /* as in vsh_image_options, or NULL */
} vsh_receiver;

/* A whole scene. Paths are as the system takes them (the reader has put the scene file's folder in front). */
typedef struct vsh_scene {
    const vsh_caster *casters;
    size_t caster_count;
    const vsh_light *lights;
    size_t light_count;
    const vsh_receiver *receivers;
    size_t receiver_count;
    vsh_grid_options grid;
    vsh_shade_options shade;
    int32_t ao;         /* nonzero: bake AO */
    int32_t irradiance; /* nonzero: bake irradiance */
} vsh_scene;

/* Reads a scene file. The scene and all it points to belong to *scene; free it with vsh_scene_free(). Errors:
 * VSH_ERROR_READ; VSH_ERROR_INPUT with line and column. Thread safe. */
VSH_API vsh_result vsh_scene_read(const char *path, vsh_scene **scene, vsh_error *error);
VSH_API void vsh_scene_free(vsh_scene *scene); /* NULL does nothing */

/* What a scene's files hold, each file read once, however many casters and receivers use it. Immutable; may
 * be shared by threads. */
typedef struct vsh_assets vsh_assets;

/* Reads the models and level sets that `scene` names and puts them in their places. The scene need not outlive the call. Errors: as
 * vsh_model_read() and vsh_grid_read(); VSH_ERROR_ARGUMENT (caster without type or path); VSH_ERROR_INPUT (a
 * receiver's mesh without the UV set asked for). Free the result with vsh_assets_free(). */
VSH_API vsh_result vsh_assets_load(const vsh_scene *scene, const vsh_run *run, vsh_assets **assets,
                                   vsh_error *error);
VSH_API void vsh_assets_free(vsh_assets *assets); /* NULL does nothing */

/* The meshes of receiver (caster) `index`, transforms composed, UVs of the receiver's set; views that belong
 * to the assets. NULL and a count of 0 for an index beyond the scene's, and for a caster that is no mesh. */
VSH_API const vsh_mesh *vsh_assets_receiver(const vsh_assets *assets, size_t index, size_t *mesh_count);
VSH_API const vsh_mesh *vsh_assets_caster(const vsh_assets *assets, size_t index, size_t *mesh_count);

/* The union of a scene's casters as one level set of scene->grid's voxel size; without one, of the longest
 * side of the box around all casters over scene->grid.resolution. `assets` are those loaded for this scene.
 * Errors: VSH_ERROR_INPUT (no casters; an sdf or vdb caster whose transform shears or scales unevenly); as
 * the vsh_grid_… calls. Free the grid with vsh_grid_free(). */
VSH_API vsh_result vsh_scene_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                     vsh_grid **grid, vsh_error *error);

/* Reach, world units > 0, that a field of `grid` needs for the scene's lights and AO at receivers within a
 * world box: see vsh_field_options. Directional lights count up to a half angle of 60°. Thread safe. */
VSH_API double vsh_scene_reach(const vsh_scene *scene, const vsh_grid *grid, const double receivers_min[3],
                               const double receivers_max[3]);

#ifdef __cplusplus
}
#endif
#endif
