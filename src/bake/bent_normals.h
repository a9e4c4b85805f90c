/* Bent normals of a lightmap, from the mean open directions of its samples. */
#ifndef VSHI_BAKE_BENT_NORMALS_H
#define VSHI_BAKE_BENT_NORMALS_H

#include "bake/ao_kept.h"
#include "bake/origins.h"

/* Makes the samples' directions, bent[origins->count][3] as of vshi_ao_task, unit, in space VSH_BENT_…;
 * tangent space wants texels with tangents, of which those are set that `keep` has memory for. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_bent_normals(const vsh_texels *texels, const vshi_origins *origins, int32_t space,
                             const vshi_ao_keep *keep, const vsh_run *run, float *bent, vsh_error *error);

/* The same of one texel that has one sample, its mean with it: normal [3]; tangent [4], NULL: world space. */
void vshi_bent_normal(const float *normal, const float *tangent, float *bent);

/* Makes the means of texels' samples, plane[count][3], unit again; what is 0 stays. */
void vshi_bent_normals_again(size_t count, float *plane);

#endif
