/* Ambient light in a lightmap's irradiance. */
#ifndef VSHI_BAKE_AMBIENT_H
#define VSHI_BAKE_AMBIENT_H

#include "bake/padding.h"
#include "bake/texels.h"

/* Adds what AO lets through of it to the irradiance of lights, where texels are valid; without ambient light
 * AO dims the lights instead. Planes and state are of the texels that are held. */
void vshi_ambient_add(const vsh_texels *texels, const uint8_t *state, const vsh_lightmap *lightmap);

#endif
