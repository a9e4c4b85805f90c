/* Ambient occlusion over texels, by rays that texels share: each value is the best estimate that its own rays
 * and those of the texels around it allow. */
#ifndef VSHI_BAKE_AO_TEXELS_H
#define VSHI_BAKE_AO_TEXELS_H

#include "bake/ao_kept.h"
#include "bake/origins.h"

/* As vsh_shade_ao() at the origins' points, `points`, of a lightmap of one sample a texel, by a method that
 * keeps an error. Values of rows that are wanted alone are those of the whole. `deviation` and `bent`, as of
 * vshi_ao_task, may be NULL. Fills the memory of `keep` for texels that have rays, but for its tangents and
 * its comparison with the casters. Values that are left to merging are 0. */
vsh_result vshi_ao_texels(const vsh_occluders *occluders, const vsh_texels *texels,
                          const vshi_origins *origins, const vsh_points *points,
                          const vsh_shade_options *options, const vsh_run *run, const vshi_ao_keep *keep,
                          float *values, float *deviation, float *bent, vsh_shade_stats *stats,
                          vsh_error *error);

/* Bytes that it takes at most for so many samples in so many texels, beside the origins. */
double vshi_ao_texels_bytes(double samples, int32_t width, int32_t rows, int32_t threads, bool bent);

#endif
