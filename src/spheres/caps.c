#include "spheres/caps.h"

#include "base/elementary.h"

static const double PI = 3.14159265358979323846;
/* So near to the surface, in radii, a point is on it: receivers are made of floats. */
static const double ON_SURFACE = 1e-4;
/* Caps that reach nearer than 7° to the plane across the axis have no ellipse for an image, or one that is
 * out of all proportion. */
static const double MOST_ANGLE = 1.45;
/* Circles so many times as large as the disc are straight edges: they are off by a 400th of the radius at
 * the ends of a chord. */
static const double STRAIGHT = 200.0;

vshi_cap_kind vshi_cap_of(const double sphere[4], const double origin[3], double far, vshi_cap *cap) {
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(origin));
    const double distance = vshi_length(to), radius = sphere[3];
    if (distance < radius * (1.0 - ON_SURFACE)) {
        return VSHI_CAP_INSIDE;
    }
    if (distance - radius >= far) {
        return VSHI_CAP_NONE;
    }
    cap->centre = vshi_scale(to, 1.0 / distance);
    cap->touching = distance <= radius * (1.0 + ON_SURFACE);
    const double sine = fmin(radius / distance, 1.0), square = (distance - radius) * (distance + radius);
    if (!(square > far * far)) { /* the circle where rays touch the sphere is within reach */
        cap->sine = sine;
        cap->cosine = sqrt((1.0 - sine) * (1.0 + sine));
    } else {
        cap->cosine = fmin((square + far * far) / (2.0 * distance * far), 1.0);
        cap->sine = sqrt((1.0 - cap->cosine) * (1.0 + cap->cosine));
    }
    return VSHI_CAP_SEEN;
}

/* Area of a circle's segment beyond a line at a distance from its centre. */
static double segment(double radius, double distance) {
    const double x = fmin(fmax(distance / radius, -1.0), 1.0);
    return radius * radius * (vshi_acos(x) - x * sqrt((1.0 - x) * (1.0 + x)));
}

/* Area that circles of radii a and b, `distance` apart, have in common. */
static double lens(double a, double b, double distance) {
    if (distance >= a + b) {
        return 0.0;
    }
    if (distance <= fabs(a - b)) {
        const double smaller = fmin(a, b);
        return PI * smaller * smaller;
    }
    const double from_a = ((distance - b) * (distance + b) + a * a) / (2.0 * distance);
    return segment(a, from_a) + segment(b, distance - from_a);
}

double vshi_cap_over_disc(double angle, double half, double radius) {
    const double disc = PI * radius * radius, near = vshi_tan(angle - half);
    if (near >= radius) {
        return 0.0;
    }
    double circle, centre;
    const bool ellipse = angle + half < MOST_ANGLE;
    const double beyond = ellipse ? vshi_tan(angle + half) : INFINITY;
    const double along = 0.5 * (beyond - near);
    if (ellipse && along < radius) {
        const double across = vshi_sin(half) / sqrt(vshi_cos(angle + half) * vshi_cos(angle - half));
        if (beyond <= radius) {
            return along * across / (radius * radius);
        }
        circle = sqrt(along * across);
        centre = 0.5 * (near + beyond);
    } else {
        circle = half < MOST_ANGLE ? vshi_tan(half) : INFINITY; /* that of the ellipse's near end */
        centre = near + circle;
    }
    const double share =
        circle > STRAIGHT * radius ? segment(radius, near) / disc : lens(radius, circle, fabs(centre)) / disc;
    return fmin(fmax(share, 0.0), 1.0);
}

double vshi_cap_over_hemisphere(double cosine, double sine) {
    if (cosine >= sine) {
        return sine * sine * cosine;
    }
    if (cosine <= -sine) {
        return 0.0;
    }
    const double square = sine * sine,
                 flat = (1.0 - sine) * (1.0 + sine); /* the half angle's cosine, squared */
    const double up = (1.0 - cosine) * (1.0 + cosine), cut = fmax(square - cosine * cosine, 0.0);
    /* the horizon cuts the cap's rim at two points; `turn` is half the angle between them, around its centre
     */
    const double turn = vshi_acos(fmin(fmax(-cosine * sqrt(flat / (square * up)), -1.0), 1.0));
    const double share = square * cosine * turn - sqrt(cut * flat) + vshi_atan2(sqrt(cut), sqrt(flat));
    return fmin(fmax(share / PI, 0.0), 1.0);
}
