/* Fields of a scene's casters that a file keeps. */
#ifndef VSHI_SCENE_KEPT_FIELD_H
#define VSHI_SCENE_KEPT_FIELD_H

#include "scene/recipe.h"

#include <vdbshade/field_file.h>

/* Whether a layer's casters, or (NULL) those in none, have any voxels. */
bool vshi_layer_is_voxelised(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Where the scene takes its fields from a file, looks at the casters and whether it is of them, whatever its
 * voxels. Errors: as vshi_caster_prints_make(); VSH_ERROR_INPUT: it is stale. */
vsh_result vshi_kept_field_check(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                 vshi_caster_prints *prints, vsh_error *error);

/* The number in scene->field of the field of a layer's casters, or (NULL) of those in none, of as many voxels
 * as vsh_scene_resolution() said; *info is what its level set was, which takes no bytes. Errors:
 * VSH_ERROR_INPUT: it is not there, or stale. */
vsh_result vshi_kept_field_find(const vsh_scene *scene, const vshi_caster_prints *prints,
                                const vsh_scene_layer *layer, int32_t resolution, size_t *index,
                                vsh_grid_info *info, vsh_error *error);

/* Adds the attribute that vsh_scene_use_field() looks for, where the scene names voxels. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_kept_field_name_voxels(const vsh_scene *scene, vshi_attributes *attributes, vsh_error *error);

#endif
