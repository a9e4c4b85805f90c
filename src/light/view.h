/* A light as a point sees it: which way, how wide, how far. The one place that knows what shape a light has;
 * whoever marches or traces towards lights asks here. */
#ifndef VSHI_LIGHT_VIEW_H
#define VSHI_LIGHT_VIEW_H

#include "base/elementary.h"
#include "base/vec.h"

#include <math.h>
#include <stdbool.h>
#include <vdbshade/light.h>

/* Where a light is and how large. */
typedef struct vshi_light_place {
    bool parallel;    /* directional: seen alike from everywhere */
    vshi_vec towards; /* parallel: unit */
    double half;      /* parallel: its half angle, */
    double sine;      /* the angle's sine, */
    double tangent;   /* and tangent; else 0 */
    vshi_vec centre;  /* else: its middle, */
    double radius;    /* and radius; 0 where parallel */
} vshi_light_place;

/* In world space. */
vshi_light_place vshi_light_in_world(const vsh_light *light);

/* The same after a transform that turns and scales alike in all directions, by 1 / unit. */
vshi_light_place vshi_light_moved(const vshi_light_place *place, const double matrix[12], double unit);

/* A light as a point sees it: a cone around an axis. */
typedef struct vshi_light_view {
    vshi_vec axis;   /* unit, to the light's centre */
    double distance; /* of the centre; INFINITY where parallel */
    double sine;     /* of the cone's half angle */
} vshi_light_view;

/* Unit vector to the light's centre, and how far that is (INFINITY where parallel). */
static inline double vshi_light_towards(const vshi_light_place *place, vshi_vec from, vshi_vec *axis) {
    if (place->parallel) {
        *axis = place->towards;
        return INFINITY;
    }
    const vshi_vec to = vshi_sub(place->centre, from);
    *axis = vshi_unit(to);
    return vshi_length(to);
}

/* False where the point is within the light: the view then holds nothing of use. */
static inline bool vshi_light_seen(const vshi_light_place *place, vshi_vec from, vshi_light_view *view) {
    view->distance = vshi_light_towards(place, from, &view->axis);
    if (place->parallel) {
        view->sine = place->sine;
        return true;
    }
    if (!(view->distance > place->radius)) {
        return false;
    }
    view->sine = place->radius / view->distance;
    return true;
}

/* How far along the axis the light is: the circle where the cone touches the sphere. */
static inline double vshi_light_end(const vshi_light_view *view) {
    return isfinite(view->distance) ? view->distance * (1.0 - view->sine * view->sine) : INFINITY;
}

/* Tangent of the cone's half angle. */
static inline double vshi_light_tangent(const vshi_light_place *place, const vshi_light_view *view) {
    return place->parallel ? place->tangent : view->sine / sqrt((1.0 - view->sine) * (1.0 + view->sine));
}

/* Whether one ray sees all of the light there is. */
static inline bool vshi_light_is_point(const vshi_light_place *place) {
    return !(place->half > 0.0 || place->radius > 0.0);
}

#endif
