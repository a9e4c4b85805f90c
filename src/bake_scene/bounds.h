/* Where the samples of a job's lightmaps are. */
#ifndef VSHI_BAKE_BOUNDS_H
#define VSHI_BAKE_BOUNDS_H

#include "bake_scene/job.h"

/* The world box of the samples of lightmap `index`, of those that are counted the last: looked at in passing,
 * or (`whole`) all of them are made, as *texels. Where nothing asks for it, as all casters are traced and no
 * field is made that has to reach the samples, no more is looked at, and the box is empty (low > high).
 * Errors: as vsh_charts_bounds(). */
vsh_result vshi_job_bounds(const vsh_bake_job *job, size_t index, const vsh_charts *charts,
                           const vshi_bands *bands, bool whole, const vsh_run *run, vsh_texels **texels,
                           double low[3], double high[3], vsh_error *error);

#endif
