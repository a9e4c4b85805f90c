/* What rays to an error are expected to take. */
#ifndef VSHI_RAYS_EXPECTED_H
#define VSHI_RAYS_EXPECTED_H

#include <math.h>

/* The error that what is expected is fitted to. */
#define VSHI_COMMON_ERROR 0.02

/* How many times as much rays take to another. */
static inline double vshi_rays_expected(double max_error) {
    const double finer = VSHI_COMMON_ERROR / fmax(max_error, 1e-4);
    return finer > 1.0 ? finer * sqrt(finer) : finer;
}

#endif
