/* Directions towards a disc light and over a hemisphere, the same for analytic and mesh truth. */
#pragma once

#include <stddef.h>

/* A right-handed orthonormal frame whose third axis is `direction` (any length but 0). */
typedef struct truth_frame {
    double u[3], v[3], n[3];
} truth_frame;
truth_frame truth_frame_around(const double direction[3]);

/* Turns a direction from the frame's axes to the world. */
void truth_to_world(const truth_frame *frame, const double local[3], double direction[3]);

/* Unit direction `index` of `count` towards a disc of radius w, a unit away along the frame's axis. */
void truth_light_direction(const truth_frame *frame, double w, size_t index, size_t count,
                           double direction[3]);

/* Unit direction `index` of `count` over the hemisphere, density proportional to the cosine (Malley's method:
 * the disc's points raised to the sphere). */
void truth_cosine_direction(const truth_frame *frame, size_t index, size_t count, double direction[3]);

/* Visible share of a disc that a straight edge covers. The edge is at x from the disc's centre, radii, -1 …
 * 1. */
double truth_disc_share(double x);
