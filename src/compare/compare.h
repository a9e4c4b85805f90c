/* Golden and new values on one lattice, and the measures taken of them. */
#ifndef VSHI_COMPARE_H
#define VSHI_COMPARE_H

#include <vdbshade/compare.h>

#include <stdbool.h>

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

/* Bytes of scratch for each value. */
enum { VSHI_SHIFT_SCRATCH = 5, VSHI_REGIONS_SCRATCH = 8 };

/* Each function fills its own members of the measures. */
void vshi_measure_shift(const vshi_pair *pair, void *scratch, vsh_measures *measures);
void vshi_measure_noise(const vshi_pair *pair, vsh_measures *measures);

/* Lost and gained regions, excusing the larger of measured and allowed noise. */
void vshi_measure_regions(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                          vsh_measures *measures);

/* `allowed` is the noise that the limits already allow for. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_measure_penumbrae(const vshi_pair *pair, double allowed, vsh_measures *measures,
                                  vsh_error *error);

/* Fits the curve that takes golden values to new ones. If it explains the difference, replaces the pair's
 * golden plane by mapped[count] with the curve applied, fills measures->curve, and returns true. */
bool vshi_follow_curve(vshi_pair *pair, float *mapped, vsh_measures *measures);

/* Adds up golden's penumbra widths and the new values' deviation from them, for vsh_accuracy.width_error. */
void vshi_add_widths(const vshi_pair *pair, double *golden, double *off);

/* Overwrites limits, and *coverage (may be NULL), with those that are given. */
void vshi_apply_options(const vsh_compare_files_options *given, vsh_limits *limits, double *coverage);

#endif
