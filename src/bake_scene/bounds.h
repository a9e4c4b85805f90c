/* Where the samples of a job's lightmaps are. */
#ifndef VSHI_BAKE_BOUNDS_H
#define VSHI_BAKE_BOUNDS_H

#include "bake_scene/job.h"

/* The world box of the samples of lightmap `index`, of those that are counted the last. It is empty (low >
 * high) where nothing asks for it: all casters are traced, and no field is made that has to reach the
 * samples. Errors: as vsh_charts_bounds(). */
vsh_result vshi_job_bounds(const vsh_bake_job *job, size_t index, const vsh_run *run, double low[3],
                           double high[3], vsh_error *error);

#endif
