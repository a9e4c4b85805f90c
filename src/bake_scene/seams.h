/* Seams of lightmaps that are baked whole: of one, or of several together. */
#ifndef VSHI_BAKE_SCENE_SEAMS_H
#define VSHI_BAKE_SCENE_SEAMS_H

#include "bake_scene/lightmap.h"

bool vshi_fixes_seams(const vsh_receiver *receiver);

/* Whether they are fixed, as nothing is baked in bands. */
bool vshi_is_fixed_whole(const vshi_lightmap_work *work);

/* Both of a lightmap as it is baked; it stays so, with a warning, where there is no memory to make it better.
 * Errors: as vsh_lightmap_fill_hidden() and vsh_lightmap_stitch(). */
vsh_result vshi_fill_hidden(const vshi_lightmap_work *work, const vsh_texels *texels, vsh_error *error);
vsh_result vshi_stitch_alone(const vshi_lightmap_work *work, vsh_error *error);

/* How many lightmaps from `first` on are stitched together: all in a row whose seams are fixed, or those of
 * its receiver, as far as memory lets them be held at once; 1: it goes alone. Warns where it could not be
 * more. Errors: as vsh_charts_create(). */
vsh_result vshi_count_together(vsh_bake_job *job, size_t first, const vsh_run *run, size_t *count,
                               vsh_error *error);

/* Bakes so many, stitches them together, and writes them. Errors: as vsh_bake_job_run(). */
vsh_result vshi_bake_together(vsh_bake_job *job, size_t first, size_t count, const vsh_run *run,
                              vsh_error *error);

#endif
