/* Values of AO of texels that share rays: each is the best estimate that its own rays and those of the texels
 * around it allow. */
#ifndef VSHI_BAKE_AO_ESTIMATE_H
#define VSHI_BAKE_AO_ESTIMATE_H

#include "bake/page.h"

/* The plane that a window fits at its texel (slopes a texel of the page), and its error. */
typedef struct vshi_ao_plane {
    float slope[2], deviation, curved;
} vshi_ao_plane;

/* Sets values and planes [height][width] of all texels with a level and, unless it is NULL, bent
 * [height][width][3], the mean of their open directions. Adds what is known of them to *stats. Errors:
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_ao_estimate(const vshi_page *page, const vshi_shots *shots, float *values,
                            vshi_ao_plane *planes, float *bent, const vsh_run *run, vsh_shade_stats *stats,
                            vsh_error *error);

#endif
