/* Light maps of a plane. */
#pragma once

#include <vdbshade/picture.h>

/* Bakes the light map of `casters` (NULL: none). Errors: as vsh_flat_bake(). */
vsh_result vshi_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
                          const vsh_flat_options *options, const vsh_run *run, const vsh_flat_map *map,
                          vsh_error *error);

/* The share of a light that a point [2] sees, by VSH_FLAT_EXACT and without its reach: 0 … 1; NaN if the
 * point is not finite, or the light has no place in a plane. The light must have passed vsh_light_check(). */
double vshi_flat_visibility(const vsh_outline *casters, const vsh_light *light, const double point[2]);
