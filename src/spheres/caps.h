/* A sphere as the cap of directions that it fills, seen from a point. */
#ifndef VSHI_CAPS_H
#define VSHI_CAPS_H

#include "base/vec.h"

typedef enum vshi_cap_kind {
    VSHI_CAP_NONE, /* out of reach */
    VSHI_CAP_SEEN,
    VSHI_CAP_INSIDE, /* the point is within the sphere */
} vshi_cap_kind;

typedef struct vshi_cap {
    vshi_vec centre;     /* unit */
    double sine, cosine; /* of the half angle, up to 90° */
    bool touching;       /* the point is on the sphere */
} vshi_cap;

/* The directions in which a sphere is met within a distance. */
vshi_cap_kind vshi_cap_of(const double sphere[4], const double origin[3], double far, vshi_cap *cap);

/* Share of a disc of radius `radius`, a unit away in the plane across its axis, that a cap at an angle from
 * the axis, of half angle `half`, covers. Exact for a cap within the disc; else the cap's image, an
 * ellipse, is taken for a circle, to 2e-3 for discs of up to 11° around their axis. */
double vshi_cap_over_disc(double angle, double half, double radius);

/* Cosine-weighted share of the hemisphere around a normal that a cap covers, `cosine` that of the angle from
 * its centre to the normal: exact, the part below the horizon left out (J. Snyder, "Area light sources for
 * real-time graphics", 1996; I. Quilez, "sphere ambient occlusion", 2006 …). */
double vshi_cap_over_hemisphere(double cosine, double sine_of_half);

#endif
