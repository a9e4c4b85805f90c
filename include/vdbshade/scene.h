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

#ifdef __cplusplus
}
#endif
#endif
