/* Points whose values take rays over the light's disc, and those rays on their way: marched, or traced
 * against triangles or the field's surface, alone or in packets of several points. */
#ifndef VSHI_SHADOW_CAST_H
#define VSHI_SHADOW_CAST_H

#include "shade/shadow.h"
#include "trace/embree.h"

/* A point whose value takes rays. */
typedef struct vshi_open_point {
    size_t point;
    vshi_vec origin, normal; /* field space; no normal: zero */
    vshi_vec axis, u, v;     /* towards the light, and over its disc a unit away; exact: in world space */
    vshi_vec start;          /* exact: of its rays, world space */
    vshi_light_view view;    /* of a shape: from the point itself, */
    vshi_vec off;            /* from which rays begin so far off, in the rays' space */
    double end;
    bool traced; /* its rays, against triangles or the field's surface; else they are marched */
    int32_t lit, taken;
    bool near; /* traced: to what they are traced against */
    double deviation;
} vshi_open_point;

typedef struct vshi_ray_batch {
    const vshi_shadow_task *task;
    vshi_open_point *open;
    size_t open_count;
    vshi_chunk chunk;
    vshi_segment_ray traced[VSHI_CHUNK];
    bool blocked[VSHI_CHUNK];
    uint16_t traced_owner[VSHI_CHUNK];
    size_t traced_count;
    bool shared; /* points share their rays */
    vsh_shade_stats *stats;
} vshi_ray_batch;

/* Whether all rays of a point are the same. */
static inline bool vshi_shadow_is_hard(const vshi_shadow_task *task) {
    return vshi_light_is_point(&task->place);
}

/* Sets *open to point `point` of the task, whose cone is not proved; without a normal that is zero. */
void vshi_open_point_begin(const vshi_shadow_task *task, size_t point, const vshi_cone *cone, vshi_vec normal,
                           vshi_open_point *open);

/* Casts rays for those of the open points that some[count] lists, until each has `target`, or twice as many
 * as it has, `most` at most. */
void vshi_shadow_cast_all(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t target);
void vshi_shadow_cast_double(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t most);

#endif
