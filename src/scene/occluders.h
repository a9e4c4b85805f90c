/* The parts of a scene's occluders. */
#ifndef VSHI_SCENE_OCCLUDERS_H
#define VSHI_SCENE_OCCLUDERS_H

#include "scene/assets.h"

#include <vdbshade/field.h>

/* vsh_scene_triangles() of one caster alone, for the AO of casters that are shaded without voxels. */
vsh_result vshi_scene_caster_triangles(const vsh_scene *scene, const vsh_assets *assets, size_t caster,
                                       const vsh_run *run, vsh_triangles **triangles, vsh_error *error);

/* Whether a bake's values are to be held against the casters themselves: not where no method keeps an error,
 * where layers cast, or where rays cannot meet all casters. */
bool vshi_scene_wants_truth(const vsh_scene *scene);

/* Whether the scene or the layer names its voxels. */
bool vshi_scene_voxels_named(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether a layer's only caster, or (NULL) that in none, is a level set; and whether it keeps its voxels, as
 * nobody named others. */
bool vshi_scene_is_level_set(const vsh_scene *scene, const vsh_scene_layer *layer);
bool vshi_scene_keeps_voxels(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether a method that a layer's casters, or (NULL) those in none, are shaded with has all of `traits`,
 * VSH_METHOD_…, or (`has` false) lacks one: of shadows where there are lights, of AO where it is baked. */
bool vshi_scene_method_is(const vsh_scene *scene, const vsh_scene_layer *layer, uint32_t traits, bool has);

/* About how many rays adaptive casts on the field of a layer's casters, or (NULL) of those in none, from each
 * point that is shaded. */
double vshi_scene_field_rays(const vsh_scene *scene, const vsh_scene_layer *layer);

/* Whether a caster has triangles, or is made of voxels among a layer's, or (NULL) those in none. */
bool vshi_caster_has_triangles(const vsh_caster *caster);
bool vshi_caster_has_voxels(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer);

#endif
