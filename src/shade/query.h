/* Shadow, AO and distances at points, by a handle that is made once for a field, lights and options. */
#ifndef VSHI_QUERY_H
#define VSHI_QUERY_H

#include "shade/ao.h"
#include "shade/layers.h"
#include "shade/shadow.h"

#include <stdbool.h>
#include <vdbshade/query.h>

struct vsh_query {
    size_t light_count;
    vsh_light *lights;          /* [light_count] */
    vshi_shadow_shader *shadow; /* [light_count] */
    vshi_ao_shader ao;
};

/* vsh_query_create(), or (sphere) a query whose AO is the free share of all directions around a point, each
 * counting alike, and takes no normals. Errors: VSH_ERROR_ARGUMENT, also for taps, which go along a normal.
 */
vsh_result vshi_query_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                             const vsh_shade_options *options, bool sphere, vsh_query **query,
                             vsh_error *error);

enum { VSHI_QUERY_BALLS = 64 };

/* What is known of one light at all points of `count` balls of free space, world units, at most
 * VSHI_QUERY_BALLS: VSHI_PROVED_FREE where a query without normals answers 1 at each, VSHI_PROVED_FULL where
 * it answers 0, else VSHI_UNPROVED. */
void vshi_query_prove(const vsh_query *query, int32_t isa, size_t light, size_t count,
                      const double (*centre)[3], const double *radius, int8_t *proof, vsh_shade_stats *stats);

#endif
