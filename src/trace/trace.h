/* Values at single points by rays against the casters themselves. */
#ifndef VSHI_TRACE_H
#define VSHI_TRACE_H

#include "light/view.h"
#include "trace/sampler.h"

#include <stdbool.h>
#include <vdbshade/trace.h>

/* Rays that every point takes, each time; where they all say what is expected it takes no more. */
enum { VSHI_TRUTH_FIRST = 16 };

typedef struct vshi_truth {
    const vsh_triangles *triangles; /* one of these may be NULL */
    const vsh_solids *solids;
    const vsh_light *light; /* NULL: AO */
    vshi_light_place place; /* of the light, in world space */
    double distance;        /* of AO */
    const vshi_vec *up;     /* of AO: over this horizon alone; NULL: none */
    double lift;            /* of rays' beginnings along the normal, world units */
    const vshi_sampler *sampler;
    int32_t rays; /* that a point takes at most, each time, and the sampler's */
} vshi_truth;

/* Whether all of both sets' first rays were alike. */
enum { VSHI_TRUTH_EVEN_HIDDEN = -1, VSHI_TRUTH_UNEVEN = 0, VSHI_TRUTH_EVEN_FREE = 1 };

/* vshi_truth_twice() of a value that is not known yet: how many of all rays are free, and VSHI_TRUTH_… of
 * the first ones. */
bool vshi_truth_count(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, int32_t free[2], int32_t *even);

/* What vshi_truth_twice() would have told of it. */
void vshi_truth_settle(int32_t rays, const int32_t free[2], int32_t even, double expected, double seen[2]);

/* The value at a point, by two sets of rays that are independent of each other and of those that shading
 * casts: (f - seen[0]) (f - seen[1]) is the squared error of f on average, without the rays' own. False where
 * there is no value: no normal, a position that is not finite. Thread safe. */
bool vshi_truth_twice(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, double expected, double seen[2]);

#endif
