/* Ambient occlusion over texels: shaded where it varies, interpolated between texels where it cannot. */
#ifndef VSHI_BAKE_LATTICE_H
#define VSHI_BAKE_LATTICE_H

#include "bake/origins.h"

/* As vsh_shade_ao() at the origins' points, `points`, of a lightmap of one sample a texel. Texels of a
 * lattice of the texels' ao_spacing (1, 2, 4 or 8) are shaded; those between are interpolated where nothing
 * is near enough to change within a cell, else the lattice is halved there (irradiance caching: Ward,
 * Rubinstein and Clear, 1988). Values of rows that are wanted alone are those of the whole. `deviation` and
 * `bent`, as of vshi_ao_task, may be NULL. */
vsh_result vshi_lattice_ao(const vsh_occluders *occluders, const vsh_texels *texels,
                           const vshi_origins *origins, const vsh_points *points,
                           const vsh_shade_options *options, const vsh_run *run, float *values,
                           float *deviation, float *bent, vsh_shade_stats *stats, vsh_error *error);

/* Bytes that it takes at most for so many samples and texels, beside the origins. */
double vshi_lattice_bytes(double samples, double texels, bool bent, bool smooth);

#endif
