/* The transfer curve of sRGB, IEC 61966-2-1. */
#ifndef VSHI_SRGB_H
#define VSHI_SRGB_H

#include "base/elementary.h"

#include <math.h>

/* 0 … 1 from a linear value; what is not above 0 (NaN too) is 0. */
static inline double vshi_to_srgb(double linear) {
    if (!(linear > 0.0)) {
        return 0.0;
    }
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * vshi_pow(fmin(linear, 1.0), 1.0 / 2.4) - 0.055;
}

/* Its inverse, of 0 … 1. */
static inline double vshi_from_srgb(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : vshi_pow((encoded + 0.055) / 1.055, 2.4);
}

#endif
