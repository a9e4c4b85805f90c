/* Distances to an outline on a grid: what the classic estimate marches through. */
#ifndef VSHI_FLAT_DISTANCES_H
#define VSHI_FLAT_DISTANCES_H

#include "flat/visible.h"

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
