/* Polygons cut into triangles. */
#ifndef VSHI_CASTER_POLYGON_H
#define VSHI_CASTER_POLYGON_H

#include "base/job.h"

/* Memory that is used again from polygon to polygon. Begin with all 0. */
typedef struct vshi_polygon_cutter {
    size_t capacity;
    struct vshi_polygon_corner *corners;
    uint32_t *reflex; /* corners that others must stay clear of, along `axis` */
} vshi_polygon_cutter;

/* Cuts the polygon of `count` corners (at least 3), vertices of `positions`, into triangles with its own
 * winding, at most count - 2: *made of them, three vertices each, in `triangles`. The corners should lie in
 * one plane, nearly. Every simple polygon is covered exactly, also one whose holes are joined to its outline
 * by bridges, one with corners on a line or twice at a place; no triangle is flipped, and none without area
 * is made. Of a polygon without area a fan is made, which has none either. *simple: whether all this held;
 * where edges cross, some triangles are made. Positions are finite. Errors: VSH_ERROR_MEMORY,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_polygon_cut(vshi_polygon_cutter *cutter, const float *positions, const uint32_t *vertices,
                            size_t count, vshi_job *job, uint32_t *triangles, size_t *made, bool *simple,
                            vsh_error *error);

void vshi_polygon_free(vshi_polygon_cutter *cutter);

#endif
