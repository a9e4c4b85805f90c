/* Light maps of a plane. */
#pragma once

#include <vdbshade/picture.h>

/* Bakes the light map of `casters` (NULL: none). Errors: as vsh_flat_bake(). */
vsh_result vshi_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
                          const vsh_flat_options *options, const vsh_run *run, const vsh_flat_map *map,
                          vsh_error *error);
