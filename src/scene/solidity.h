/* What a scene's meshes are taken for: as its user says, or as is found. */
#ifndef VSHI_SCENE_SOLIDITY_H
#define VSHI_SCENE_SOLIDITY_H

#include "mesh/mesh_set.h"

#include <vdbshade/scene.h>

/* Views of meshes that stand somewhere. */
typedef struct vshi_mesh_list {
    vsh_mesh *meshes;
    size_t count;
    const vsh_model *model; /* of mesh casters; else NULL */
    const char *path;
} vshi_mesh_list;

/* Applies the rules of solidity to the casters' meshes, makes one set of them all and finds what they are,
 * together; their views know it then, and so do those of receivers that are one of them: the same triangles
 * in the same place. Lists are as the scene's. Free the set also after a failure. Errors: VSH_ERROR_ARGUMENT
 * (a pattern that is NULL, no VSH_SOLIDITY_…), VSH_ERROR_INPUT (a pattern that matches nothing, as
 * vsh_mesh_check()), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_solidity_settle(const vsh_scene *scene, const vshi_mesh_list *casters,
                                const vshi_mesh_list *receivers, const vsh_run *run, vshi_mesh_set *set,
                                vsh_error *error);

#endif
