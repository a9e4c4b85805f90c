/* Links between neighbouring texels, and the best estimate of a noisy texel from those around it.
 *
 * Around a texel there are windows: rectangles of linked texels, of growing sizes, square, wide and tall. In
 * each, a plane is fitted by least squares. A larger window has less noise. It counts as long as it agrees
 * with the smaller ones to within their noise: local polynomial approximation with the intersection of
 * confidence intervals (Goldenshluger and Nemirovski, "On spatially adaptive estimation of nonparametric
 * regression", 1997; Katkovnik, "A new method for varying adaptive bandwidth selection", 1999). Sums over
 * windows are integers in summed-area tables (Crow, 1984), so no bit depends on where a table begins. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
    VSHI_WINDOW_REACH = 7, /* texels that a window extends beyond its texel, at most */
    VSHI_WINDOW_SUMS = 8   /* a line of the cache */
};

/* A share of rays that are free. `rays` 0: there is no such texel. */
typedef struct vshi_window_texel {
    float value;         /* 0 … 1 */
    float spread;        /* variance of a value near p, over p (1 - p) */
    int32_t rays;        /* behind the value */
    float step[2];       /* world length of the step to the texel on the left, and above; INFINITY: no link */
    float shortest;      /* of the steps from the texel */
    uint8_t left, above; /* 1: linked to the texel there; both have values */
    uint8_t run[4];      /* linked texels left, right, up and down, at most VSHI_WINDOW_REACH: set by
                          * vshi_windows_sum() */
} vshi_window_texel;

/* --- links: which neighbouring texels lie next to each other in the world too */

/* Texels [height][width] with their places and normals. */
typedef struct vshi_texel_map {
    int32_t width, height;
    const uint32_t *at;    /* [height][width]: number of the texel's point, + 1; 0: none. NULL: points are
                              numbered as texels */
    const uint8_t *level;  /* without `at`, [height][width]: 0 if there is no point */
    const float *position; /* [points][3], from any one place, world units */
    const float *normal;   /* [points][3], unit */
} vshi_texel_map;

/* The number of a texel's point, + 1; 0: there is none. */
static inline size_t vshi_texel_at(const vshi_texel_map *map, int32_t column, int32_t row) {
    if (column < 0 || row < 0 || column >= map->width || row >= map->height) {
        return 0;
    }
    const size_t place = (size_t)row * (size_t)map->width + (size_t)column;
    return map->at != NULL ? map->at[place] : map->level[place] != 0 ? place + 1 : 0;
}

/* A rectangle of every `spacing`th texel of every `spacing`th row. */
typedef struct vshi_texel_lattice {
    int32_t left, top, spacing, width, height;
} vshi_texel_lattice;

/* Sets `left`, `above` and `step` of a lattice's texels [height][width]. Two of its texels are linked if all
 * texels between them are. */
void vshi_links_find(const vshi_texel_map *map, const vshi_texel_lattice *lattice, vshi_window_texel *texels);

/* Whether the square of `spacing` + 1 texels from (column, row) on is complete and lies in a plane. */
bool vshi_links_whole(const vshi_texel_map *map, int32_t column, int32_t row, int32_t spacing);

/* Whether links lead from one texel to another, along the first one's row and then the other's column. */
bool vshi_links_lead(const vshi_texel_map *map, const int32_t from[2], const int32_t to[2]);

/* --- windows */

/* Sums: of values, also times columns (X) and rows (Y), of squared values, spreads and rays, and of breaks:
 * squares of 2 × 2 texels that are not linked. */
enum { VSHI_SUM_V, VSHI_SUM_VX, VSHI_SUM_VY, VSHI_SUM_VV, VSHI_SUM_SPREADS, VSHI_SUM_RAYS, VSHI_SUM_BREAKS };

/* Values and spreads are summed as multiples of these. */
#define VSHI_WINDOW_UNIT 0x1p-24
#define VSHI_WINDOW_SPREAD_UNIT 0x1p-40

/* Sums over all texels left of and above a corner. */
typedef struct vshi_window_sums {
    _Alignas(64) uint64_t of[VSHI_WINDOW_SUMS];
} vshi_window_sums;

/* A rectangle of texels. */
typedef struct vshi_windows {
    int32_t width, height;
    vshi_window_texel *texels; /* [height][width] */
    vshi_window_sums *sums;    /* [height + 1][width + 1] */
    int32_t isa;               /* VSH_ISA_…, for estimates; every one gives the same bits */
} vshi_windows;

typedef struct vshi_window_estimate {
    double value;     /* 0 … 1 */
    double deviation; /* standard error of the value */
    double centred;   /* standard error if the texel were in the middle of the window */
    /* square of the bend that the plane misses, from a smaller window. It is noisy and often below zero, so
     * only sums over many texels mean something */
    double curved;
    double slope[2];    /* of the plane, for each column and row */
    int32_t x[2], y[2]; /* first and last column and row of the window */
} vshi_window_estimate;

/* Fills runs and sums. */
void vshi_windows_sum(vshi_windows *windows);

/* Estimates texels (places in [height][width]) that have rays. Estimates that differ by a tenth of
 * `max_error` agree. Windows stay in the texel's square of `tile` × `tile` texels, aligned to multiples of
 * `tile`; 0: anywhere. Thread safe. */
typedef void vshi_windows_fn(const vshi_windows *windows, const uint16_t *texels, size_t count,
                             double max_error, int32_t tile, vshi_window_estimate *estimates);
vshi_windows_fn vshi_windows_estimate;

/* One source (windows.inc), built for each instruction set. */
extern vshi_windows_fn vshi_windows_base;
#if defined(__x86_64__)
extern vshi_windows_fn vshi_windows_avx2, vshi_windows_avx512;
#endif

/* The weight of texel (column, row) in a window's estimate of texel (x, y). */
double vshi_window_weight(const vshi_window_estimate *estimate, int32_t x, int32_t y, int32_t column,
                          int32_t row);
