/* Rays and cones against procedural solids. Thread safe. */
#pragma once

#include "base/vec.h"

#include "trace/trace.h"
#include <stdbool.h>

/* The solids are the union of parts. A part's world box has low > high if it is empty. */
size_t vshi_solids_part_count(const vshi_solids *solids);
void vshi_solids_part_box(const vshi_solids *solids, size_t part, double low[3], double high[3]);

/* The distance at which a ray (unit direction to within 1e-6) meets a part; infinite if it does not. */
double vshi_solids_part_meet(const vshi_solids *solids, size_t part, const vshi_segment_ray *ray);

/* Sets blocked[i] if ray i meets a solid. Skips rays whose blocked[i] is set already. */
void vshi_solids_blocked(const vshi_solids *solids, const vshi_segment_ray *rays, size_t count,
                         bool *blocked);

typedef enum vshi_cone_state {
    VSHI_CONE_UNKNOWN,
    VSHI_CONE_FREE,   /* no ray of the cone meets a solid */
    VSHI_CONE_COVERED /* every ray does */
} vshi_cone_state;

/* Proves a state of all rays from `origin` within `tangent` of the unit `axis`. The rays end at depths along
 * the axis between `near` and `far`. */
vshi_cone_state vshi_solids_cone(const vshi_solids *solids, const double origin[3], const double axis[3],
                                 double tangent, double near, double far);
