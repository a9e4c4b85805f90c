/* The exact share of a light that a point of the plane sees. */
#ifndef VSHI_FLAT_VISIBLE_H
#define VSHI_FLAT_VISIBLE_H

#include "outline/outline.h"

#include <vdbshade/light.h>

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

#endif
