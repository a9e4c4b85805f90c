/* Lights: directional with an angular diameter, sphere, spot, rectangle. */
#ifndef VDBSHADE_LIGHT_H
#define VDBSHADE_LIGHT_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum {
    VSH_LIGHT_DIRECTIONAL = 0, /* direction, angle */
    VSH_LIGHT_SPHERE = 1,      /* position, radius */
    VSH_LIGHT_SPOT = 2,        /* position, radius, axis, inner_angle, outer_angle */
    VSH_LIGHT_RECTANGLE = 3    /* position, edge_u, edge_v, two_sided */
};

enum {
    VSH_FALLOFF_NONE = 0,
    VSH_FALLOFF_INVERSE_SQUARE = 1, /* 1 / d² */
    VSH_FALLOFF_QUADRATIC = 2       /* (1 - d / reach)², 0 beyond the reach */
};

/* A light. Only its shape and place enter shadow values; falloff, colour, a spot's edge and cosines enter
 * irradiance only. A size (angle, radius) of 0 is a hard light, and so is one whose half angle has a sine
 * below 1e-6. All numbers are finite; what a type does not name is ignored.
 *
 * Of a rectangle the visible fraction is that of its solid angle. VSH_SHADOW_RAYS, ADAPTIVE and EXACT cast
 * rays over it as it is; VSH_SHADOW_HARD takes its centre; the other methods, and heights and spheres without
 * voxels, take a disc of the same solid angle, without the part of the way where its cone would reach the
 * rectangle's plane. Points behind a one-sided rectangle, or in its plane, see nothing of it (0). Irradiance
 * has the cosine at which it shines to a point as well; by VSH_FALLOFF_INVERSE_SQUARE that and the distance
 * are of each of its parts, which comes to its solid angle over its area. */
typedef struct vsh_light {
    int32_t type;        /* VSH_LIGHT_… */
    int32_t falloff;     /* VSH_FALLOFF_…; not directional */
    double direction[3]; /* directional: towards the light. Any length but 0 */
    double position[3];  /* of the centre, world units */
    double angle;        /* directional: angular diameter, radians, 0 … π (excluded) */
    double radius;       /* sphere, spot: world units, ≥ 0 */
    double axis[3];      /* spot: the way it shines, away from it. Any length but 0 */
    double inner_angle;  /* spot: half angle of full light, radians, 0 … outer_angle */
    double outer_angle;  /* spot: half angle where light ends, radians, > 0 … π */
    double reach;        /* with VSH_FALLOFF_QUADRATIC, not directional: world units, > 0 */
    double color[3]; /* linear RGB times intensity, ≥ 0; irradiance at normal incidence before falloff */
    char name[64]; /* "sun": its channel is shadow.sun. At most 63 of A … Z, a … z, 0 … 9, _ and -; may
                      be empty where no channel is named after it */
    double edge_u[3];  /* rectangle: its sides from end to end, world units, of lengths 1e-15 … 1e15 and at
                          right */
    double edge_v[3];  /* angles (a cosine of at most 0.001). It shines the way of edge_u × edge_v */
    int32_t two_sided; /* rectangle: 1: it shines the other way too; 0: it does not */
} vsh_light;

/* A white sun of half a degree overhead (+y), named "sun". */
static inline vsh_light vsh_light_default(void) {
    vsh_light light = {VSH_LIGHT_DIRECTIONAL,
                       VSH_FALLOFF_NONE,
                       {0.0, 1.0, 0.0},
                       {0.0, 0.0, 0.0},
                       0.00925,
                       0.0,
                       {0.0, -1.0, 0.0},
                       0.35,
                       0.5,
                       1.0,
                       {1.0, 1.0, 1.0},
                       "sun",
                       {1.0, 0.0, 0.0},
                       {0.0, 0.0, 1.0},
                       0};
    return light;
}

/* Checks a light against the ranges above. Errors: VSH_ERROR_ARGUMENT (light NULL, too), naming the light,
 * the field, the value and the limit. */
VSH_API vsh_result vsh_light_check(const vsh_light *light, vsh_error *error);

/* Type, place and size in words, colour and falloff where they are not the plain ones: one line, cut to
 * `size` bytes with its end. The light is a checked one. */
VSH_API void vsh_light_text(const vsh_light *light, char *text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
