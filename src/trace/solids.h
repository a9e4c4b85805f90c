/* Rays and cones against procedural solids. Thread safe. */
#ifndef VSHI_SOLIDS_H
#define VSHI_SOLIDS_H

#include "base/vec.h"

#include <stdbool.h>
#include <vdbshade/trace.h>

/* The parts that all solids are the union of, and the world box of one, inside out where it is empty. */
size_t vshi_solids_part_count(const vsh_solids *solids);
void vshi_solids_part_box(const vsh_solids *solids, size_t part, double low[3], double high[3]);

/* How far a ray (unit direction to within 1e-6) goes until it meets a part; infinite where it does not. */
double vshi_solids_part_meet(const vsh_solids *solids, size_t part, const vshi_segment_ray *ray);

/* Sets blocked[i] where ray i meets a solid; leaves it as it is elsewhere, and does not look where it is set.
 */
void vshi_solids_blocked(const vsh_solids *solids, const vshi_segment_ray *rays, size_t count, bool *blocked);

typedef enum vshi_cone_state {
    VSHI_CONE_UNKNOWN,
    VSHI_CONE_FREE,   /* no ray of the cone meets a solid */
    VSHI_CONE_COVERED /* every ray does */
} vshi_cone_state;

/* What can be proved of all rays from `origin` within `tangent` of the unit `axis`, which end at depths along
 * it between `near` and `far`. */
vshi_cone_state vshi_solids_cone(const vsh_solids *solids, const double origin[3], const double axis[3],
                                 double tangent, double near, double far);

#endif
