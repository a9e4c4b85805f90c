/* Shadow and ambient occlusion of spheres in closed form: what a layer asks for. */
#ifndef VSHI_ANALYTIC_SPHERES_H
#define VSHI_ANALYTIC_SPHERES_H

#include "base/vec.h"

#include <vdbshade/light.h>
#include <vdbshade/method.h>
#include <vdbshade/points.h>
#include <vdbshade/spheres.h>

/* Share of a light (checked before) that the spheres leave free, of what of it is above a point's own horizon
 * (all of it without normals), at points begin … end - 1 into visibility[end - begin]; 1 for points turned
 * away. VSH_SHADOW_HARD, or a light of no size: its centre, 0 or 1; VSH_SHADOW_CLASSIC: the nearest miss (I.
 * Quilez, "sphere soft shadow", 2014); every other method is one: the part of the disc that spheres cover.
 * Points are first moved `lift` world units along their normals; those within a sphere are dark, invalid
 * ones NaN. Thread safe. */
void vshi_spheres_shadow(const vsh_spheres *spheres, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats);

/* Cosine-weighted fraction of the hemisphere that the spheres leave free within a distance, likewise;
 * points->normals must be given. `bent` [end - begin][3], where not NULL, receives the integral of the free
 * directions so weighted, in world space: two thirds of the normal under an open sky, NaN for invalid points.
 * `up` (unit, world space), where not NULL, limits AO to directions above its horizon; `bent` is NULL then.
 */
void vshi_spheres_ao(const vsh_spheres *spheres, double ao_distance, const vshi_vec *up,
                     const vsh_points *points, size_t begin, size_t end, double lift, float *ao, float *bent,
                     vsh_shade_stats *stats);

/* Point i lifted, and its unit normal (zero where there are none); false where it is not finite or has no
 * normal where normals are given. */
bool vshi_spheres_origin(const vsh_points *points, size_t i, double lift, double origin[3], vshi_vec *normal);

/* Whether a world position is within a sphere, deeper than receivers may be off. */
bool vshi_spheres_hold(const vsh_spheres *spheres, const double position[3]);

#endif
