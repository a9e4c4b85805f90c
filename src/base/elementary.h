/* Elementary functions that give the same bits on every machine. The C library's do not: glibc's choose code
 * with or without fused multiply-add by the processor, and the last bit differs. SLEEF's deterministic
 * variants (N. Shibata and F. Petrogalli, "SLEEF: a portable vectorized library of C standard mathematical
 * functions", 2020) are within 1 ulp and take 1 to 2.5 times as long. sqrt(), fmod() and ldexp() are exact
 * everywhere. */
#pragma once

#include <math.h>
#include <sleef.h>

#define VSHI_ELEMENTARY(name, variant)                                                                       \
    static inline double vshi_##name(double x) {                                                             \
        return Sleef_cinz_##name##d1_##variant##purec(x);                                                    \
    }
#define VSHI_ELEMENTARY_2(name, variant)                                                                     \
    static inline double vshi_##name(double x, double y) {                                                   \
        return Sleef_cinz_##name##d1_##variant##purec(x, y);                                                 \
    }

VSHI_ELEMENTARY(sin, u10)
VSHI_ELEMENTARY(cos, u10)
VSHI_ELEMENTARY(tan, u10)
VSHI_ELEMENTARY(asin, u10)
VSHI_ELEMENTARY(acos, u10)
VSHI_ELEMENTARY(atan, u10)
VSHI_ELEMENTARY(exp, u10)
VSHI_ELEMENTARY(exp2, u10)
VSHI_ELEMENTARY(cbrt, u10)
VSHI_ELEMENTARY_2(atan2, u10)
VSHI_ELEMENTARY_2(pow, u10)
VSHI_ELEMENTARY_2(hypot, u05)

#undef VSHI_ELEMENTARY
#undef VSHI_ELEMENTARY_2

/* --- the transfer curve of sRGB, IEC 61966-2-1 */

/* Returns 0 … 1 for a linear value; 0 for NaN and values below 0. */
static inline double vshi_to_srgb(double linear) {
    if (!(linear > 0.0)) {
        return 0.0;
    }
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * vshi_pow(fmin(linear, 1.0), 1.0 / 2.4) - 0.055;
}

/* The inverse, for 0 … 1. */
static inline double vshi_from_srgb(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : vshi_pow((encoded + 0.055) / 1.055, 2.4);
}
