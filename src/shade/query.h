/* A query: shadow, AO and distances at points by a prepared handle. */
#pragma once

#include "shade/ao.h"
#include "shade/shadow.h"

#include <stdbool.h>
#include <vdbshade/light.h>

struct vsh_query {
    size_t light_count;
    vsh_light *lights;        /* [light_count] */
    vshi_shadow_task *shadow; /* [light_count] */
    vshi_ao_task ao;
};

/* As vsh_query_create(). `sphere`: AO is the free share of all directions around a point, and needs no
 * normals. Errors: VSH_ERROR_ARGUMENT, also for taps, which need a normal. */
vsh_result vshi_query_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                             const vsh_shade_options *options, bool sphere, vsh_query **query,
                             vsh_error *error);

enum { VSHI_QUERY_BALLS = 64 };

/* Proves one light for all points of `count` balls of free space, world units, at most VSHI_QUERY_BALLS:
 * VSHI_PROVED_FREE if a query without normals answers 1 at each, VSHI_PROVED_FULL if it answers 0, else
 * VSHI_UNPROVED. */
void vshi_query_prove(const vsh_query *query, int32_t isa, size_t light, size_t count,
                      const double (*centre)[3], const double *radius, int8_t *proof, vsh_shade_stats *stats);
