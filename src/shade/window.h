/* Values of texels that are known with noise, and the best estimate of one from those around it.
 *
 * Around a texel there are windows, rectangles of texels that hang together, of growing sizes: square, wide
 * and tall. In each a plane is fitted by least squares. A window's estimate has less noise the larger it is,
 * and is taken for as long as it agrees with those of the smaller ones in it to within their noise: local
 * polynomial approximation with the intersection of confidence intervals (Goldenshluger and Nemirovski, "On
 * spatially adaptive estimation of nonparametric regression", 1997; Katkovnik, "A new method for varying
 * adaptive bandwidth selection", 1999). Sums over windows are integers in summed-area tables (Crow, 1984), so
 * that no bit depends on where a table begins. */
#ifndef VSHI_WINDOW_H
#define VSHI_WINDOW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    VSHI_WINDOW_REACH = 7, /* texels that a window goes beyond its texel at most */
    VSHI_WINDOW_SUMS = 6
};

/* A share of rays that are free. `rays` 0: there is no such texel. */
typedef struct vshi_window_texel {
    float value;         /* 0 … 1 */
    float spread;        /* variance of a value near p, over p (1 - p) */
    int32_t rays;        /* that it is of */
    float step[2];       /* vshi_links_find()'s */
    uint8_t left, above; /* 1 where it hangs together with the texel there; both have values */
    uint8_t run[4];      /* texels that hang together left, right, up and down, VSHI_WINDOW_REACH at most: set
                          * by vshi_windows_sum() */
} vshi_window_texel;

/* Over all texels left of and above a corner. */
typedef struct vshi_window_sums {
    uint64_t of[VSHI_WINDOW_SUMS];
    uint32_t breaks; /* squares of 2 × 2 that do not hang together */
} vshi_window_sums;

/* A rectangle of texels. */
typedef struct vshi_windows {
    int32_t width, height;
    vshi_window_texel *texels; /* [height][width] */
    vshi_window_sums *sums;    /* [height + 1][width + 1] */
} vshi_windows;

typedef struct vshi_window_estimate {
    double value;     /* 0 … 1 */
    double deviation; /* its standard error */
    double centred;   /* the same, were the texel in the middle of the window */
    /* square of what bends in the window and is no plane, as by a smaller one: with the noise of its own,
     * which is below zero as often as above, and means something only in sums over many texels */
    double curved;
    double slope[2];    /* of the plane, a column and a row on */
    int32_t x[2], y[2]; /* first and last column and row of the window */
} vshi_window_estimate;

/* Fills runs and sums. */
void vshi_windows_sum(vshi_windows *windows);

/* Of texel (x, y), which has rays. Estimates that differ by a tenth of `max_error` agree. Windows lie in the
 * square of `tile` texels that the texel is in, from a multiple of it on; 0: anywhere. */
vshi_window_estimate vshi_windows_estimate(const vshi_windows *windows, int32_t x, int32_t y,
                                           double max_error, int32_t tile);

/* The weight of texel (column, row) in the estimate of texel (x, y) from a window. */
double vshi_window_weight(const vshi_window_estimate *estimate, int32_t x, int32_t y, int32_t column,
                          int32_t row);

#endif
