/* Distances to an outline on a grid: what the classic estimate marches through. */
#ifndef VSHI_FLAT_DISTANCES_H
#define VSHI_FLAT_DISTANCES_H

#include "outline/outline.h"

#include <vdbshade/light.h>

/* --- the exact share of a light that a point of the plane sees */

/* A light as a point sees it. */
typedef struct vshi_flat_view {
    vshi_point point;
    vshi_point towards; /* unit, to the light's centre */
    double distance;    /* to the centre; infinite for a directional light */
    double radius;
    double slope; /* tangent of half the angle that the light is seen under; 0: a hard light */
} vshi_flat_view;

/* False where the point is in the light's disc, and sees all of it. */
bool vshi_flat_look(const vsh_light *light, vshi_point point, vshi_flat_view *view);

/* Share of the light's angle that no part of the outline hides, 0 … 1; of a hard light 0 or 1. Takes 4 KB of
 * the stack. Thread safe. */
double vshi_flat_visible(const vsh_outline *casters, const vshi_flat_view *view);

/* Whether nothing lies between the point and the light's centre. */
bool vshi_flat_centre_visible(const vsh_outline *casters, const vshi_flat_view *view);

/* --- the classic method on a grid */

typedef struct vshi_flat_grid {
    double low[2], high[2]; /* world rectangle */
    double cell;            /* world units */
    size_t columns, rows;
    float *values; /* [rows][columns], signed, world units */
} vshi_flat_grid;

/* Bytes that it takes for an outline's box grown by `margin`; more than 2^31 values are infinitely many. */
double vshi_flat_grid_bytes(const vsh_outline *outline, double margin, double cell);

/* Free the values with free(). Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_flat_grid_make(const vsh_outline *outline, double margin, double cell, const vsh_run *run,
                               vshi_flat_grid *grid, vsh_error *error);

/* Technique "soft shadows in raymarched SDFs" (Quilez, 2010) in the plane, as 2D lighting uses it (Kaplan):
 * the least h/(s t) along the ray to the light's centre, 0 where it meets something. */
double vshi_flat_classic(const vshi_flat_grid *grid, const vshi_flat_view *view, int32_t max_steps);

#endif
