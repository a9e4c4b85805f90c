/* Shadows of spheres in closed form, as the methods hard and classic see them. */
#ifndef VSHI_ANALYTIC_SPHERES_H
#define VSHI_ANALYTIC_SPHERES_H

#include "base/vec.h"

#include <vdbshade/light.h>
#include <vdbshade/method.h>
#include <vdbshade/points.h>
#include <vdbshade/spheres.h>

/* Writes the share of a light (checked before) that the spheres leave free at points begin ... end - 1 to
 * visibility[end - begin]. VSH_SHADOW_HARD: 0 or 1, by the ray to the light's centre. VSH_SHADOW_CLASSIC: the
 * nearest miss (I. Quilez, "sphere soft shadow", 2014). Points turned away get 1, points within a sphere 0,
 * invalid ones NaN. Thread safe. */
void vshi_spheres_shadow(const vsh_spheres *spheres, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, float *visibility,
                         vsh_shade_stats *stats);

/* Whether a world position is within a sphere, deeper than receivers may be off. */
bool vshi_spheres_hold(const vsh_spheres *spheres, const double position[3]);

#endif
