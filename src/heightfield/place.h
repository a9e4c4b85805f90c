/* Points of a call as a heightfield sees them, and what holds at all of them. */
#ifndef VSHI_ANALYTIC_PLACE_H
#define VSHI_ANALYTIC_PLACE_H

#include "heightfield/height_pyramid.h"
#include "heightfield/heights.h"

/* The walk of the best instruction set here. */
vshi_walk_fn *vshi_walk_of_machine(void);

typedef enum vshi_stand {
    VSHI_STAND_FREE,    /* above the surface, beside the solid or beneath it */
    VSHI_STAND_BURIED,  /* within the solid */
    VSHI_STAND_INVALID, /* not finite, or a normal of no length */
} vshi_stand;

/* Where point i stands, in cells; normal: unit, zero where there is none. */
vshi_stand vshi_heights_stand(const vsh_heights *heights, const vsh_points *points, size_t i, double lift,
                              double at[3], vshi_vec *normal);

/* A world direction in the heightfield's axes, unit. */
vshi_vec vshi_heights_direction(const vsh_heights *heights, vshi_vec direction);

/* The slope below which a direction along the ground passes under the solid; -INFINITY where none does. */
double vshi_heights_under(const vshi_height_pyramid *relief, const double at[3], double x, double z);

#endif
