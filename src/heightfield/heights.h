/* Shadows of a heightfield that is marched as it is, for layers. */
#ifndef VSHI_HEIGHTS_H
#define VSHI_HEIGHTS_H

#include "base/vec.h"

#include <vdbshade/heights.h>
#include <vdbshade/light.h>
#include <vdbshade/method.h>
#include <vdbshade/points.h>

#include <stdbool.h>

/* Marches from points begin … end - 1 to a light that was checked before. Writes its visible share into
 * visibility[end - begin]: for VSH_SHADOW_HARD 0 or 1, for any other method that of VSH_SHADOW_CLASSIC.
 * Points are first moved `lift` world units along their normals. Points within the solid are dark, invalid
 * points NaN. Thread safe. */
void vshi_heights_shadow(const vsh_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats);

/* World units of a layer's start offset, which is in cells; -1 stands for 0. */
double vshi_heights_lift(const vsh_heights *heights, double start_offset);

/* Whether a world position is within the solid, deeper than receivers may be off. */
bool vshi_heights_hold(const vsh_heights *heights, const double position[3]);

#endif
