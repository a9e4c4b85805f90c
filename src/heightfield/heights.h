/* Shadow and ambient occlusion of a heightfield that is marched as it is: what a layer asks for. */
#ifndef VSHI_ANALYTIC_HEIGHTS_H
#define VSHI_ANALYTIC_HEIGHTS_H

#include "base/vec.h"

#include <vdbshade/heights.h>
#include <vdbshade/light.h>
#include <vdbshade/method.h>
#include <vdbshade/points.h>

#include <stdbool.h>

/* Share of a light (checked before) that the heightfield leaves free, of what of it is above a point's own
 * horizon (all of it without normals), at points begin … end - 1 into visibility[end - begin]; 1 for points
 * turned away. VSH_SHADOW_HARD, or a light of no size: its centre, 0 or 1; every other method is one:
 * slices of the disc, each above its horizon. Points are first moved `lift` world units along their
 * normals; one up to a quarter of a cell under the surface is taken for one on it, one deeper is dark.
 * Invalid points are NaN. Thread safe. */
void vshi_heights_shadow(const vsh_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats);

/* Cosine-weighted fraction of the hemisphere that the heightfield leaves free within a distance, likewise;
 * points->normals must be given. `bent` [end - begin][3], where not NULL, takes the integral of the free
 * directions so weighted, world space: two thirds of the normal under an open sky; NaN where the point is
 * invalid. `up` (unit, world space), where not NULL: of what is over its horizon, without `bent`. */
void vshi_heights_ao(const vsh_heights *heights, double ao_distance, const vshi_vec *up,
                     const vsh_points *points, size_t begin, size_t end, double lift, float *ao, float *bent,
                     vsh_shade_stats *stats);

/* World units that a layer's start offset is, in cells; -1 stands for 0. */
double vshi_heights_lift(const vsh_heights *heights, double start_offset);

/* Whether a world position is within the solid, deeper than receivers may be off. */
bool vshi_heights_hold(const vsh_heights *heights, const double position[3]);

#endif
