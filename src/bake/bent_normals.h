/* Bent normals of a lightmap, from the mean open directions of its samples. */
#ifndef VSHI_BAKE_BENT_NORMALS_H
#define VSHI_BAKE_BENT_NORMALS_H

#include "bake/origins.h"

/* Makes the samples' directions, bent[origins->count][3] as of vshi_ao_task, unit, in space VSH_BENT_…;
 * tangent space wants texels with tangents. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_bent_normals(const vsh_texels *texels, const vshi_origins *origins, int32_t space,
                             const vsh_run *run, float *bent, vsh_error *error);

/* Makes the means of texels' samples, plane[count][3], unit again; what is 0 stays. */
void vshi_bent_normals_again(size_t count, float *plane);

#endif
