/* What the library's parts share about lights. */
#ifndef VSHI_LIGHT_H
#define VSHI_LIGHT_H

#include "base/vec.h"

#include <vdbshade/light.h>

#include <stdbool.h>
#include <stddef.h>

/* Whether a name can be part of a channel's name and of a packing ("R=shadow.sun,A=A"): letters, digits, '_'
 * and '-', 1 … 63 of them. */
bool vshi_light_name_valid(const char *name);

/* What reaches a point of the light's colour, but for visibility and cosine: falloff at a distance, and a
 * spot's edge towards it. `to_light` is unit, to the light's centre. */
double vshi_light_gain(const vsh_light *light, vshi_vec to_light, double distance);

/* What is left at a distance > 0 by the light's falloff alone. */
double vshi_light_falloff(const vsh_light *light, double distance);

/* A light that is so many times as large, as a point sees it. */
vsh_light vshi_light_resized(const vsh_light *light, double factor);

#endif
