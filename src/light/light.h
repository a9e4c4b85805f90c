/* Lights: the table of their types, and a light as a point sees it. */
#pragma once

#include "base/elementary.h"
#include "base/vec.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <vdbshade/light.h>

/* Sine of a half angle below which a light counts as a point. Floats resolve its edge to a sixteenth of this,
 * and its square is far from underflow. */
#define VSHI_LEAST_SINE 0x1p-20

/* The largest sine of a half angle, with its angle. At 1 the cone would be a half space. */
#define VSHI_LARGEST_SINE (1.0 - 1e-9)
#define VSHI_LARGEST_HALF (0.5 * 3.14159265358979323846 - 4.4721359e-5)

static inline double vshi_light_sine(double sine) {
    return sine < VSHI_LEAST_SINE ? 0.0 : fmin(sine, VSHI_LARGEST_SINE);
}

typedef struct vshi_light_shape vshi_light_shape;

/* A light's place and size. Only directional lights have the members `towards` to `tangent`. */
typedef struct vshi_light_place {
    bool parallel;                  /* directional: the same from everywhere */
    vshi_vec towards;               /* unit */
    double half;                    /* the half angle */
    double sine;                    /* of the half angle */
    double tangent;                 /* of the half angle */
    vshi_vec centre;                /* not directional */
    double radius;                  /* of the sphere around the whole light; 0 for directional lights */
    double reach;                   /* infinite without a quadratic falloff */
    vshi_vec beam;                  /* spot: unit, the way it shines */
    double outer;                   /* spot: half angle of its cone; else infinite */
    double rim;                     /* its cosine; else -infinite */
    const vshi_light_shape *shape;  /* NULL: every point sees a disc */
    vshi_vec x, y, normal;          /* rectangle: unit, along its sides, and the way it shines */
    double half_width, half_height; /* rectangle: half of its sides */
    bool two_sided;                 /* rectangle: shines both ways */
} vshi_light_place;

/* The place of a light in world space. */
vshi_light_place vshi_light_in_world(const vsh_light *light);

/* The place after a transform that turns, and scales evenly by 1 / unit. */
vshi_light_place vshi_light_moved(const vshi_light_place *place, const double matrix[12], double unit);

/* The part of a ball, in the place's space, that is within the light's reach and cone. A ball without radius
 * is all or none of it, and none where the light's gain is 0 (vshi_light_gain()). */
typedef enum vshi_light_part { VSHI_LIGHT_NO_PART, VSHI_LIGHT_SOME_PART, VSHI_LIGHT_ALL } vshi_light_part;
vshi_light_part vshi_light_covers(const vshi_light_place *place, vshi_vec centre, double radius);

/* Whether a point is within the light's reach and cone. */
static inline bool vshi_light_lights(const vshi_light_place *place, vshi_vec at) {
    return vshi_light_covers(place, at, 0.0) == VSHI_LIGHT_ALL;
}

/* --- a light as a point sees it */

/* A point's view of a light if nothing is in the way. */
typedef enum vshi_light_side {
    VSHI_LIGHT_WITHIN, /* the point is in the light and sees all of it */
    VSHI_LIGHT_AWAY,   /* the light does not shine to this side */
    VSHI_LIGHT_SEEN
} vshi_light_side;

/* A rectangle as a point sees it, for rays: see rectangle.c. */
typedef struct vshi_light_patch {
    double x[2], y[2], height;
    vshi_vec down;
    double angle; /* steradians; 0: too small to sample by solid angle */
    double b0, b1, k;
} vshi_light_patch;

/* Methods of one march see a sphere: the light itself, or for another shape the sphere of the same solid
 * angle whose cone ends before the light. Proofs see a cone around the whole light. */
typedef struct vshi_light_view {
    vshi_vec axis;          /* unit, towards the light's middle */
    double distance;        /* of the sphere's centre; INFINITY for directional lights */
    double sine;            /* of the sphere's half angle */
    double bound;           /* sine of the half angle of the proofs' cone; INFINITY: there is no cone */
    double end;             /* distance along the axis where the last rays end */
    double near;            /* distance along the axis where the first rays end */
    vshi_light_patch patch; /* of rectangles */
} vshi_light_view;

/* A shape that is no disc, as points see it. */
struct vshi_light_shape {
    /* Finds the view. `hard`: a point at the light's centre. The view is set only if the light is seen. */
    vshi_light_side (*look)(const vshi_light_place *place, vshi_vec from, bool hard, vshi_light_view *view);
    /* The vector from the point of a view to a place on the light. It maps the unit disc to the light,
     * uniform in solid angle, and ends a hair before the light. */
    vshi_vec (*ray)(const vshi_light_place *place, const vshi_light_view *view, const double disc[2]);
    /* Fraction of the light's solid angle above the plane with a normal. */
    double (*above)(const vshi_light_place *place, vshi_vec from, vshi_vec normal);
    /* Whether every point of a ball may see the light. */
    bool (*faces)(const vshi_light_place *place, vshi_vec centre, double radius);
    /* Moves the shape's own members: see vshi_light_moved(). */
    void (*move)(vshi_light_place *place, const double matrix[12], double unit);
};

/* Unit vector to the light's centre, and the distance (INFINITY for directional lights). */
static inline double vshi_light_towards(const vshi_light_place *place, vshi_vec from, vshi_vec *axis) {
    if (place->parallel) {
        *axis = place->towards;
        return INFINITY;
    }
    const vshi_vec to = vshi_sub(place->centre, from);
    *axis = vshi_unit(to);
    return vshi_length(to);
}

/* Length of one march along the axis: up to the circle where the cone touches the sphere. */
static inline double vshi_light_end(const vshi_light_view *view) {
    return isfinite(view->distance) ? view->distance * (1.0 - view->sine * view->sine) : INFINITY;
}

/* Finds the light's view. It is set only if the light is seen. `hard` does not apply to discs: callers who
 * want one without size use a sine of 0. */
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

/* Whether a single ray sees the whole light. */
static inline bool vshi_light_is_point(const vshi_light_place *place) {
    return !(place->half > 0.0 || place->radius > 0.0);
}

/* --- brightness and size */

/* The light at a point without visibility and cosine: falloff, and the edge of a spot. `to_light` is unit,
 * towards the light's centre. */
double vshi_light_gain(const vsh_light *light, vshi_vec to_light, double distance);

/* The falloff at a distance > 0. */
double vshi_light_falloff(const vsh_light *light, double distance);

/* The light with its size, as a point sees it, multiplied by a factor. */
vsh_light vshi_light_resized(const vsh_light *light, double factor);

/* --- the table of types */

/* Whether a name can be part of a channel's name and of a packing ("R=shadow.sun,A=A"): 1 to 63 letters,
 * digits, '_' and '-'. */
bool vshi_light_name_valid(const char *name);

typedef struct vshi_light_type {
    const char *name; /* in scene files */
    bool falls_off;   /* has `falloff` and `reach` */
    /* Sets place and size in world space. */
    void (*place)(const vsh_light *light, vshi_light_place *place);
    /* See vshi_light_gain(). */
    double (*gain)(const vsh_light *light, vshi_vec to_light, double distance);
    /* Writes type, place and size in words. */
    int (*describe)(const vsh_light *light, char *text, size_t size);
    /* Multiplies the size that a point sees. */
    void (*resize)(vsh_light *light, double factor);
    /* Checks relations between members; NULL: there are none. */
    vsh_result (*check)(const vsh_light *light, vsh_error *error);
} vshi_light_type;

extern const vshi_light_type vshi_rectangle_type; /* rectangle.c */

/* NULL: there is no such type. */
const vshi_light_type *vshi_light_type_of(int32_t type);

/* The bits, 1 << type, of the types with falloff, and of the types in a plane. */
uint32_t vshi_light_types_falling(void);
uint32_t vshi_light_types_flat(void);

typedef enum vshi_light_kind {
    VSHI_LIGHT_NUMBER, /* double */
    VSHI_LIGHT_ANGLE,  /* double, radians; degrees in files */
    VSHI_LIGHT_VECTOR, /* double[3]; two numbers in a plane */
    VSHI_LIGHT_SWITCH  /* int32_t, 0 or 1 */
} vshi_light_kind;

/* A member of vsh_light that some types have. */
typedef struct vshi_light_member {
    const char *name; /* in C, for messages */
    const char *key;  /* in scene files */
    vshi_light_kind kind;
    uint32_t types;         /* bits */
    uint32_t required;      /* bits of the types whose files must give it */
    size_t offset;          /* in vsh_light */
    double lowest, highest; /* an excluded infinity allows any finite value */
    bool above, below;      /* whether `lowest` and `highest` are excluded */
    bool nonzero;           /* of vectors: not all numbers may be 0 */
    bool half;              /* of angles: files give half the angle */
    bool apart;             /* the type's check() checks the range, which depends on another member */
} vshi_light_member;

extern const vshi_light_member vshi_light_members[];
extern const size_t vshi_light_member_count;
