/* What a scene's meshes are taken for: as its user says, or as is found. */
#ifndef VSHI_SCENE_SOLIDITY_H
#define VSHI_SCENE_SOLIDITY_H

#include <vdbshade/scene.h>

/* Views of meshes that stand somewhere. */
typedef struct vshi_mesh_list {
    vsh_mesh *meshes;
    size_t count;
    const vsh_model *model; /* of mesh casters; else NULL */
    const char *path;
} vshi_mesh_list;

typedef struct vshi_solidity vshi_solidity;

/* Applies the rules of solidity to the casters' meshes, finds what they are, together, and sets their
 * `sides`; also those of receivers that are one of them: the same triangles in the same place. Lists are as
 * the scene's. Errors: VSH_ERROR_ARGUMENT (a pattern that is NULL, no VSH_SOLIDITY_…), VSH_ERROR_INPUT (a
 * pattern that matches nothing, as vsh_mesh_check()), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_solidity_settle(const vsh_scene *scene, const vshi_mesh_list *casters,
                                const vshi_mesh_list *receivers, const vsh_run *run, vshi_solidity **found,
                                vsh_error *error);

#endif
