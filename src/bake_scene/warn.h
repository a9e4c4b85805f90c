/* What is odd about a lightmap, as warnings and as errors: its UVs, its texels, its file. */
#ifndef VSHI_WARN_H
#define VSHI_WARN_H

#include "bake_scene/pages.h"

/* Warns of faults in the target's UVs, one line for each mesh and kind. Warns of charts that lie too close
 * for the size, and of charts that cover few texels. */
void vshi_warn_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                   const vsh_run *run);

/* Charts that cover no texel's centre, or objects that lie over each other on more than VSH_LARGEST_OVERLAP
 * of the texels: VSH_ERROR_INPUT, with why. */
vsh_result vshi_refuse_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                           vsh_error *error);

/* A lightmap without one valid texel is no lightmap: VSH_ERROR_INPUT. */
vsh_result vshi_refuse_invalid(const vshi_target *target, const vsh_bake_stats *baked, vsh_error *error);

/* Notes texels that are not valid, and warns of marches that did not end or widened too far. */
void vshi_warn_baked(const vsh_scene *scene, const vshi_target *target, const vsh_bake_stats *baked,
                     const vsh_run *run);

/* Notes which lights, and whether the sky, reach the meshes of a baked page. */
void vshi_note_lit(const vshi_scene_page *page);

/* Warns of lights, and of the sky, that one object hides from all other objects of a bake. */
void vshi_warn_hidden_lights(const vshi_scene_bake *bake, const vsh_run *run);

/* Warns of light that the file's integers cut. */
void vshi_warn_clipping(const char *output, const vsh_image_clipping *cut, const vsh_run *run);

#endif
