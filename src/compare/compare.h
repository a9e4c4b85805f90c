/* Golden and new values on one lattice, and the measures taken of them. */
#pragma once

#include <vdbshade/compare.h>

#include <stdbool.h>

/* Returns limits that pass rounding (another compiler, 16-bit files), and fail penumbrae a tenth wider, a
 * shift of a quarter of a texel, and a lost caster of four texels. */
vsh_limits vshi_limits_default(void);

/* Returns bits: bit i is set if measure i fails. A measure that does not apply passes. If no value was
 * compared, all fail. */
uint32_t vshi_compare_judge(const vsh_measures *measures, const vsh_limits *limits);

/* Compares two planes of coverage [count]. Texels above 1/2 are covered (NULL: all are). Writes 1 into
 * mask[count] (may be NULL) where both are covered, else 0. Cannot fail. */
void vshi_compare_coverage(uint64_t count, const float *golden, const float *values, uint8_t *mask,
                           vsh_coverage *coverage);

/* Widens limits, and sets options.noise, for bakes made by sampling: standard errors a and b make noise of
 * √(a² + b²), in units of the range, 0 … 1. docs/pipeline.md has the formulas. Set strict limits after
 * this call. Cannot fail. */
void vshi_limits_allow_noise(vsh_limits *limits, double noise);

/* Limits from a JSON file (docs/pipeline.md): for all channels, and for single ones. */
typedef struct vshi_tolerances vshi_tolerances;

/* Reads such a file. Free it with vshi_tolerances_free(). Errors: VSH_ERROR_READ, VSH_ERROR_INPUT (no JSON,
 * unknown keys, values out of range, with the place), VSH_ERROR_LIMIT (the parsed file may take over 64 MiB).
 */
vsh_result vshi_tolerances_read(const char *path, vshi_tolerances **tolerances, vsh_error *error);
void vshi_tolerances_free(vshi_tolerances *tolerances); /* NULL does nothing */

/* Overwrites *limits with the file's limits for a channel, and *coverage (may be NULL) with the share of
 * covered texels that may differ. Other limits stay. Does nothing if tolerances is NULL.
 * Cannot fail. */
void vshi_tolerances_apply(const vshi_tolerances *tolerances, const char *channel, vsh_limits *limits,
                           double *coverage);

enum { VSHI_GOLDEN, VSHI_NEW };

typedef struct vshi_pair {
    size_t size[3];
    size_t stride[3]; /* from a value to the next along an axis */
    size_t count;
    const float *plane[2]; /* golden, new */
    const uint8_t *mask;   /* 1: compared, and finite in both */
    double scale;          /* 1 / range */
} vshi_pair;

static inline double vshi_value_at(const vshi_pair *pair, int which, size_t i) {
    return (double)pair->plane[which][i] * pair->scale;
}

static inline double vshi_difference_at(const vshi_pair *pair, size_t i) {
    return vshi_value_at(pair, VSHI_NEW, i) - vshi_value_at(pair, VSHI_GOLDEN, i);
}

/* Finds x, y, z of a value. */
static inline void vshi_find_place(const vshi_pair *pair, size_t i, size_t place[3]) {
    place[0] = i % pair->size[0];
    place[1] = i / pair->stride[1] % pair->size[1];
    place[2] = i / pair->stride[2];
}

/* Finds the value at an offset from a place; false if it lies outside. */
static inline bool vshi_find_offset(const vshi_pair *pair, const size_t place[3], const int offset[3],
                                    size_t *at) {
    *at = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const ptrdiff_t p = (ptrdiff_t)place[axis] + offset[axis];
        if (p < 0 || p >= (ptrdiff_t)pair->size[axis]) {
            return false;
        }
        *at += (size_t)p * pair->stride[axis];
    }
    return true;
}

/* 99 of 100 normal values lie within so many standard errors. The 99th percentile of sizes is there, too. */
#define VSHI_NOISE_P99 2.6

/* Change of one penumbra's width, as a share, for noise of a standard error of 1. Both ends move by
 * noise / slope, and a steady edge (penumbra.c) has at least half the mean slope there. */
#define VSHI_NOISE_WIDTH 5.0

enum { VSHI_MOST_REACH = 16 }; /* of vsh_compare_options.reach */

/* Fills the measures' shift. `scratch`: 5 bytes a value. */
void vshi_measure_shift(const vshi_pair *pair, void *scratch, vsh_measures *measures);

/* Fills the measures of penumbrae. `noise` is that which the limits allow for. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_measure_penumbrae(const vshi_pair *pair, double noise, vsh_measures *measures,
                                  vsh_error *error);
