/* The loaded casters and receivers of a scene: meshes, level sets, outlines, spheres. */
#ifndef VSHI_ASSETS_H
#define VSHI_ASSETS_H

#include "mesh/mesh_set.h"
#include "scene/unwrapped.h"

#include <stdbool.h>
#include <string.h>
#include <vdbshade/scene.h>

/* Whether a caster is in a layer, or (NULL) in none. */
static inline bool vshi_caster_in_layer(const vsh_caster *caster, const vsh_scene_layer *layer) {
    return caster->layer == NULL ? layer == NULL : layer != NULL && strcmp(caster->layer, layer->name) == 0;
}

/* Whether a caster stays out of level sets: spheres and direct heightfields, if shadows are `hard` or
 * `classic` and AO, if there is any, is traced. */
bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster);

/* One caster or receiver. Its transform is in front of its meshes' own. */
typedef struct vshi_asset_place {
    vsh_mesh *meshes;
    double *transforms; /* [count][12] */
    size_t *numbers;    /* [count]: of each in its model */
    size_t count;
    struct vshi_asset_file *file; /* of mesh casters and receivers; belongs to the assets, as the next two */
    const vsh_model *model;       /* that of the file */
    const vsh_grid *grid;         /* vdb casters */
    vsh_outline *outline;         /* mask and text casters */
    vsh_model *made;              /* of heightfields; its meshes are this place's */
    vsh_heights *heights;         /* of direct heightfields, beside `made` */
    vsh_spheres *spheres;         /* voxelised or not */
    bool direct;
    vshi_mesh_set set; /* these two of a receiver */
    vshi_unwrapped unwrapped;
} vshi_asset_place;

/* A caster; all zero beyond the last. */
const vshi_asset_place *vshi_assets_caster(const vsh_assets *assets, size_t index);

/* Meshes of all casters. */
size_t vshi_assets_mesh_count(const vsh_assets *assets);

#endif
