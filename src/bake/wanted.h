/* What is asked of a lightmap, and whether it can be. */
#ifndef VSHI_BAKE_WANTED_H
#define VSHI_BAKE_WANTED_H

#include "bake/texels.h"

/* The plane of light `light`'s tint, or NULL. */
float *vshi_tint_of(const vsh_lightmap *lightmap, size_t light);

/* Whether any light's tint is asked for; whether anything of a light is; AO, or what comes with it; any plane
 * of errors. */
bool vshi_tint_wanted(const vsh_lightmap *lightmap, size_t light_count);
bool vshi_light_wanted(const vsh_lightmap *lightmap, size_t light);
bool vshi_ao_wanted(const vsh_lightmap *lightmap);
bool vshi_errors_wanted(const vsh_lightmap *lightmap, size_t light_count);

/* Checks planes, tint, ambient light and lights; *light: whether anything of any light is asked for. Errors:
 * VSH_ERROR_ARGUMENT. */
vsh_result vshi_wanted_check(const vsh_lightmap *lightmap, const vsh_texels *texels, const vsh_light *lights,
                             size_t light_count, bool *light, vsh_error *error);

#endif
