/* Shadow of one light at points: what its estimators (shadow.c) and its rays (shadow_rays.c) share. */
#ifndef VSHI_SHADOW_H
#define VSHI_SHADOW_H

#include "shade/sampler.h"
#include "shade/shade.h"

enum { VSHI_RAY_GRAIN = 256 }; /* points a piece */

/* A light as the points of one field see it. */
typedef struct vshi_shadow_task {
    const vsh_field *field;
    const vsh_points *points;
    const vsh_light *light;
    const vsh_shade_options *options;
    const vshi_sampler *sampler; /* of rays; else NULL */
    vshi_march_fn *march;
    float *visibility;
    float *deviation; /* or NULL */
    vshi_vec towards; /* directional: unit, field space */
    vshi_vec centre;  /* positional: field space */
    double sine;      /* directional: of the half angle */
    double radius;    /* positional: finest voxels */
    uint32_t purpose; /* of the sampler: lights of other names have other sequences */
} vshi_shadow_task;

/* The cone of point i, which begins at `origin`, without what its estimate needs; false where the point is
 * within the light. Where a lamp stands, and whether it is over the horizon, is seen from the point itself:
 * one that is nearer than the start offset would else be below it. */
bool vshi_shadow_aim(const vshi_shadow_task *task, size_t i, vshi_vec origin, vshi_cone *cone);

/* rays, adaptive and exact: a vshi_shade_fn of a vshi_shadow_task. */
void vshi_shadow_by_rays(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

#endif
