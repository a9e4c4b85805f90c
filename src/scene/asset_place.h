/* The meshes of a model, put where a caster or receiver stands. */
#ifndef VSHI_ASSET_PLACE_H
#define VSHI_ASSET_PLACE_H

#include "mesh/mesh_set.h"
#include "scene/masks.h"
#include "scene/unwrapped.h"

#include <vdbshade/scene.h>

/* One caster or receiver: the file's meshes with its transform in front of theirs. */
typedef struct vshi_asset_place {
    vsh_mesh *meshes;
    double *transforms; /* [count][12] */
    size_t *numbers;    /* [count]: of each in its model */
    size_t count;
    const vsh_model *model; /* of meshes; belongs to the assets' models */
    const vsh_grid *grid;   /* vdb casters; belongs to the assets' grids */
    vsh_outline *outline;   /* mask and text casters */
    vsh_model *made;        /* of heightfields; its meshes are this place's */
    vsh_heights *heights;   /* of direct heightfields, beside `made` */
    vsh_spheres *spheres;
    bool direct;
    vshi_mesh_set set; /* these two of a receiver */
    vshi_unwrapped unwrapped;
} vshi_asset_place;

/* Puts the meshes of the model that are `chosen` there; NULL: all. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_place_chosen(vshi_asset_place *place, const vsh_model *model, const unsigned char *chosen,
                             int32_t uv_set, double unit, const double transform[12], vsh_error *error);

/* Adds the meshes of place->model that a mesh caster takes, as they cast. `masks` are the model's. `parts` is
 * a receiver that has unwrapped meshes of the model, or NULL. Warns of blended meshes that do not cast.
 * Errors: VSH_ERROR_INPUT (a pattern matches nothing, nothing is left), those of vshi_masks_cast(). */
vsh_result vshi_place_casting(vshi_asset_place *place, const vsh_scene *scene, const vsh_caster *caster,
                              vshi_masks *masks, const vshi_asset_place *parts, const vsh_run *run,
                              vsh_error *error);

#endif
