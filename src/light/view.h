/* A light as a point sees it: which way, how wide, how far. The one place that knows what shape a light has;
 * whoever marches or traces towards lights asks here. */
#ifndef VSHI_LIGHT_VIEW_H
#define VSHI_LIGHT_VIEW_H

#include "base/elementary.h"
#include "base/vec.h"

#include <math.h>
#include <stdbool.h>
#include <vdbshade/light.h>

struct vshi_light_shape;

/* Sine of a half angle below which a light counts as a point: floats hold its edge to a sixteenth of that,
 * and its square is far from underflow. */
#define VSHI_LEAST_SINE 0x1p-20

/* The largest sine of a half angle, with its tangent and angle. At 1 the cone would be a half space. */
#define VSHI_LARGEST_SINE (1.0 - 1e-9)
#define VSHI_LARGEST_TANGENT 22360.68
#define VSHI_LARGEST_HALF (0.5 * 3.14159265358979323846 - 4.4721359e-5)

static inline double vshi_light_sine(double sine) {
    return sine < VSHI_LEAST_SINE ? 0.0 : fmin(sine, VSHI_LARGEST_SINE);
}

/* Where a light is and how large. */
typedef struct vshi_light_place {
    bool parallel;    /* directional: seen alike from everywhere */
    vshi_vec towards; /* parallel: unit */
    double half;      /* parallel: its half angle, */
    double sine;      /* the angle's sine, */
    double tangent;   /* and tangent; else 0 */
    vshi_vec centre;  /* else: its middle, */
    double radius;    /* and that of the sphere around it which holds all of it; 0 where parallel */
    const struct vshi_light_shape *shape; /* NULL: a sun or a sphere, which is seen as a disc */
    vshi_vec x, y, normal;                /* rectangle: unit, along its sides, and the way it shines */
    double half_width, half_height;       /* rectangle: of its sides */
    bool two_sided;                       /* rectangle: shines the other way too */
} vshi_light_place;

/* In world space. */
vshi_light_place vshi_light_in_world(const vsh_light *light);

/* The same after a transform that turns and scales alike in all directions, by 1 / unit. */
vshi_light_place vshi_light_moved(const vshi_light_place *place, const double matrix[12], double unit);

/* What a point sees of a light where nothing is in the way. */
typedef enum vshi_light_side {
    VSHI_LIGHT_WITHIN, /* the point is in the light: all of it */
    VSHI_LIGHT_AWAY,   /* the light does not shine to this side: nothing of it */
    VSHI_LIGHT_SEEN
} vshi_light_side;

/* A rectangle as a point sees it, for rays: see light/rectangle.c. */
typedef struct vshi_light_patch {
    double x[2], y[2], height;
    vshi_vec down;
    double angle; /* steradians; 0: too small for rays to tell from an area */
    double b0, b1, k;
} vshi_light_patch;

/* A light as a point sees it. To methods of one march it is a sphere: the light itself, or of a shape the
 * sphere of the same solid angle, at a distance where its cone ends before the shape. To proofs it is a cone
 * that holds all of the light. */
typedef struct vshi_light_view {
    vshi_vec axis;   /* unit, to the light's middle as the point sees it */
    double distance; /* of the sphere's centre; INFINITY where parallel */
    double sine;     /* of the sphere's half angle */
    double bound;    /* of proofs: sine of the half angle of a cone around all of the light; INFINITY: none */
    double end;      /* of proofs and rays: how far along the axis the last of them end, */
    double near;     /* and the first */
    vshi_light_patch patch; /* of rectangles */
} vshi_light_view;

/* What must be known of a light that is not seen as a disc. */
typedef struct vshi_light_shape {
    /* Takes along what a place has beside its centre and radius: see vshi_light_moved(). */
    void (*move)(vshi_light_place *place, const double matrix[12], double unit);
    /* Fills *view where the light is seen; `hard`: as a point in its centre, of no size. */
    vshi_light_side (*look)(const vshi_light_place *place, vshi_vec from, bool hard, vshi_light_view *view);
    /* The way from the point of a view to the light's place that stands for one of the unit disc: what is
     * uniform on the disc is uniform in solid angle. It ends a hair before the light. */
    vshi_vec (*ray)(const vshi_light_place *place, const vshi_light_view *view, const double disc[2]);
    /* Fraction of the light's solid angle over the plane of a normal. */
    double (*above)(const vshi_light_place *place, vshi_vec from, vshi_vec normal);
    /* Whether every point of a ball may see the light. */
    bool (*faces)(const vshi_light_place *place, vshi_vec centre, double radius);
} vshi_light_shape;

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

/* How far along the axis one march goes: to the circle where the cone touches the sphere. */
static inline double vshi_light_end(const vshi_light_view *view) {
    return isfinite(view->distance) ? view->distance * (1.0 - view->sine * view->sine) : INFINITY;
}

/* How a point sees the light; unless it does, the view holds nothing of use. A disc is the same whether it is
 * looked at as `hard` or not: whoever wants no size takes a sine of 0. */
static inline vshi_light_side vshi_light_look(const vshi_light_place *place, vshi_vec from, bool hard,
                                              vshi_light_view *view) {
    if (place->shape != NULL) {
        return place->shape->look(place, from, hard, view);
    }
    view->distance = view->near = view->end = vshi_light_towards(place, from, &view->axis);
    view->sine = view->bound = place->sine;
    if (place->parallel) {
        return VSHI_LIGHT_SEEN;
    }
    if (!(view->distance > place->radius)) {
        return VSHI_LIGHT_WITHIN;
    }
    view->sine = view->bound = vshi_light_sine(place->radius / view->distance);
    view->near = view->distance - place->radius;
    view->end = vshi_light_end(view);
    return VSHI_LIGHT_SEEN;
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
