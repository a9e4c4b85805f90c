/* A tree of spheres in blocks of eight bounding spheres, and the shadows of spheres in closed form, by the
 * methods hard and classic. */
#ifndef VSHI_SPHERES_H
#define VSHI_SPHERES_H

#include "base/vec.h"

#include <stdint.h>
#include <vdbshade/light.h>
#include <vdbshade/method.h>
#include <vdbshade/points.h>
#include <vdbshade/spheres.h>

/* --- the tree (sphere_tree.c) */

enum { VSHI_BALLS = 8, VSHI_BALL_DEPTH = 40 };

/* Centres are counted from the middle of all spheres; radii have room for floats' rounding. A lane that is
 * not used has a radius of -INFINITY. */
typedef struct vshi_ball_block {
    float x[VSHI_BALLS], y[VSHI_BALLS], z[VSHI_BALLS], radius[VSHI_BALLS];
    int32_t below[VSHI_BALLS]; /* ≥ 0: the block within; else ~number of the sphere itself */
} vshi_ball_block;

struct vsh_spheres {
    double (*sphere)[4];    /* world */
    vshi_ball_block *block; /* [0]: the uppermost */
    size_t block_count;
    double middle[3];
    vsh_spheres_info info;
};

/* A cone from a point, up to a distance. */
typedef struct vshi_ball_cone {
    double origin[3];
    double axis[3];      /* unit */
    double sine, cosine; /* its half angle is < 90°, or 90°: all above the plane */
    double far;
} vshi_ball_cone;

/* Told of a sphere (its numbers) that may be in the cone; false ends the search. */
typedef bool vshi_ball_fn(void *user, const double sphere[4]);

/* Calls fn() for every sphere that touches the cone, and maybe for some that pass close by. Returns how many
 * bounds it looked at. */
uint64_t vshi_sphere_tree_search(const vsh_spheres *spheres, const vshi_ball_cone *cone, vshi_ball_fn *fn,
                                 void *user);

/* Whether a sphere's numbers are within their ranges. Errors: VSH_ERROR_INPUT, of row `number` of the file
 * `path`, or (NULL) of sphere `number`. */
vsh_result vshi_sphere_check(const double sphere[4], const char *path, size_t number, vsh_error *error);

/* Signed distance to the nearest sphere, world units, negative within one: true outside of all. */
double vshi_sphere_tree_distance(const vsh_spheres *spheres, const double position[3]);

/* --- shadows (spheres.c) */

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
