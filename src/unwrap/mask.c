#include "unwrap/mask.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

static const char what[] = "texels of a chart";

static const double BOX = 0.9;      /* share of its box that a chart fills at least to be fitted to texels */
static const double MOST_FIT = 1.3; /* factor by which that may change a side */
static const double ROOM = 1e-9;    /* texels: a border that is so near to a texel's is on it */

enum { FARTHEST = 1 << 24 }; /* texels: no page is so large */

static int32_t whole(double x) {
    return x < 1.0 ? 1 : x > FARTHEST ? FARTHEST : (int32_t)x;
}

vshi_fit vshi_mask_fit(const vshi_patch *p, const double size[2], double density, double max_stretch) {
    vshi_fit fit;
    double factor[2];
    int32_t texels[2];
    bool fits = !p->kept && p->area > BOX * size[0] * size[1];
    for (int k = 0; k < 2; ++k) {
        const double length = size[k] * density;
        texels[k] = whole(floor(length + 0.5));
        factor[k] = texels[k] / length;
        fits = fits && factor[k] < MOST_FIT && factor[k] > 1.0 / MOST_FIT;
    }
    const double uneven = factor[0] / factor[1]; /* isometric but for this it stretches by the root of … */
    fits = fits && p->stretch * sqrt(0.5 * (uneven + 1.0 / uneven)) < max_stretch;
    int32_t *sides[2] = {&fit.width, &fit.height};
    for (int k = 0; k < 2; ++k) {
        const double length = size[k] * density;
        if (fits) {
            fit.scale[k] = density * factor[k];
            fit.offset[k] = 0.5;
            *sides[k] = texels[k] + 1;
        } else {
            fit.scale[k] = density;
            *sides[k] = whole(ceil(length - ROOM));
            fit.offset[k] = 0.5 * (*sides[k] - length);
        }
    }
    return fit;
}

static int32_t clamp(double x, int32_t most) {
    return x < 0.0 ? 0 : x > most ? most : (int32_t)x;
}

/* The columns that a triangle touches in a row. */
static vshi_run touched_in(const double at[3][2], int32_t row, int32_t width) {
    double left = INFINITY, right = -INFINITY;
    const double low = row, high = row + 1;
    for (int k = 0; k < 3; ++k) {
        const double *a = at[k], *b = at[(k + 1) % 3];
        if (a[1] >= low && a[1] <= high) {
            left = a[0] < left ? a[0] : left;
            right = a[0] > right ? a[0] : right;
        }
        const double line[2] = {low, high};
        for (int i = 0; i < 2; ++i) {
            if ((a[1] < line[i]) != (b[1] < line[i])) {
                const double x = a[0] + (b[0] - a[0]) * ((line[i] - a[1]) / (b[1] - a[1]));
                left = x < left ? x : left;
                right = x > right ? x : right;
            }
        }
    }
    vshi_run run = {clamp(floor(left + ROOM), width - 1), clamp(ceil(right - ROOM), width)};
    run.end = run.end > run.begin ? run.end : run.begin + 1;
    return run;
}

static void rows_of(const double at[3][2], int32_t height, int32_t *first, int32_t *last) {
    double low = at[0][1], high = at[0][1];
    for (int k = 1; k < 3; ++k) {
        low = at[k][1] < low ? at[k][1] : low;
        high = at[k][1] > high ? at[k][1] : high;
    }
    *first = clamp(floor(low + ROOM), height - 1);
    *last = clamp(ceil(high - ROOM), height) - 1;
    *last = *last > *first ? *last : *first;
}

static void place_corners(const vshi_patch *p, const vshi_fit *fit, uint32_t i, double at[3][2]) {
    for (int k = 0; k < 3; ++k) {
        for (int d = 0; d < 2; ++d) {
            at[k][d] = p->uv[p->corner[i][k]][d] * fit->scale[d] + fit->offset[d];
        }
    }
}

/* Sets bits begin … end - 1. */
static void set_bits(uint64_t *row, int32_t begin, int32_t end) {
    for (int32_t x = begin; x < end;) {
        const int32_t until = (x / 64 + 1) * 64 < end ? (x / 64 + 1) * 64 : end;
        row[x / 64] |= until - x == 64 ? ~(uint64_t)0 : (((uint64_t)1 << (until - x)) - 1) << (x % 64);
        x = until;
    }
}

/* The first bit from x on that is `value`; `width` where there is none. */
static int32_t next_bit(const uint64_t *row, int32_t x, int32_t width, bool value) {
    while (x < width) {
        const uint64_t word = (value ? row[x / 64] : ~row[x / 64]) >> (x % 64);
        if (word != 0) {
            x += __builtin_ctzll(word);
            return x < width ? x : width;
        }
        x = (x / 64 + 1) * 64;
    }
    return width;
}

/* Counts the runs of each row of bits, or lists them. */
static void read_runs(const uint64_t *bits, size_t words, vshi_mask *mask, bool list) {
    uint32_t at = 0;
    for (int32_t y = 0; y < mask->height; ++y) {
        const uint64_t *row = bits + words * (size_t)y;
        mask->row[y] = at;
        for (int32_t begin = next_bit(row, 0, mask->width, true), end; begin < mask->width;
             begin = next_bit(row, end, mask->width, true), ++at) {
            end = next_bit(row, begin, mask->width, false);
            if (list) {
                mask->runs[at] = (vshi_run){begin, end};
                mask->touched += (uint64_t)(end - begin);
            }
        }
    }
    mask->row[mask->height] = at;
}

vsh_result vshi_mask_make(const vshi_patch *p, const vshi_fit *fit, vshi_mask *mask, vsh_error *error) {
    *mask = (vshi_mask){.width = fit->width, .height = fit->height};
    const size_t words = ((size_t)mask->width + 63) / 64;
    uint64_t *bits = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&mask->row, (size_t)mask->height + 1, sizeof *mask->row, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bits, words * (size_t)mask->height, sizeof *bits, what, error));
    for (uint32_t i = 0; i < p->count; ++i) {
        double at[3][2];
        int32_t first, last;
        place_corners(p, fit, i, at);
        rows_of(at, mask->height, &first, &last);
        for (int32_t y = first; y <= last; ++y) {
            const vshi_run run = touched_in(at, y, mask->width);
            set_bits(bits + words * (size_t)y, run.begin, run.end);
        }
    }
    read_runs(bits, words, mask, false);
    VSHI_TRY_DONE(vshi_allocate((void **)&mask->runs, mask->row[mask->height], sizeof *mask->runs, what, error));
    read_runs(bits, words, mask, true);
done:
    free(bits);
    return result;
}

void vshi_mask_free(vshi_mask *mask) {
    free(mask->runs);
    free(mask->row);
    *mask = (vshi_mask){0};
}

/* --- quarter turns */

static vsh_result copy_runs(const vshi_mask *mask, vshi_mask *to, vsh_error *error) {
    *to = (vshi_mask){.width = mask->width, .height = mask->height, .touched = mask->touched};
    VSHI_TRY(vshi_allocate((void **)&to->row, (size_t)to->height + 1, sizeof *to->row, what, error));
    VSHI_TRY(vshi_allocate((void **)&to->runs, mask->row[mask->height], sizeof *to->runs, what, error));
    return VSH_OK;
}

static vsh_result half_turn(const vshi_mask *mask, vshi_mask *to, vsh_error *error) {
    VSHI_TRY(copy_runs(mask, to, error));
    uint32_t at = 0;
    for (int32_t y = 0; y < mask->height; ++y) {
        const int32_t from = mask->height - 1 - y;
        to->row[y] = at;
        for (uint32_t i = mask->row[from + 1]; i-- > mask->row[from];) {
            to->runs[at++] = (vshi_run){mask->width - mask->runs[i].end, mask->width - mask->runs[i].begin};
        }
    }
    to->row[mask->height] = at;
    return VSH_OK;
}

/* Column x of the mask, from below, becomes row x of the other, from the left; a half turn more and it is a
 * quarter turn anticlockwise, or with `up` clockwise. Runs open and close as columns go over the rows. */
static vsh_result quarter_turn(const vshi_mask *mask, bool clockwise, vshi_mask *to, vsh_error *error) {
    *to = (vshi_mask){.width = mask->height, .height = mask->width, .touched = mask->touched};
    int32_t *open = NULL; /* [mask width]: row where the column's run began; -1: none */
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&to->row, (size_t)to->height + 1, sizeof *to->row, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&open, (size_t)mask->width, sizeof *open, what, error));
    uint32_t total = 0;
    for (int pass = 0; pass < 2; ++pass) {
        for (int32_t x = 0; x < mask->width; ++x) {
            open[x] = -1;
        }
        for (int32_t k = 0; k <= mask->height; ++k) {
            /* anticlockwise, (x, y) goes to (height - 1 - y, x): from the last row on; clockwise to (y, width
             * - 1 - x) */
            const int32_t y = clockwise ? k : mask->height - 1 - k;
            int32_t x = 0;
            const uint32_t begin = k < mask->height ? mask->row[y] : 0,
                           end = k < mask->height ? mask->row[y + 1] : 0;
            for (uint32_t i = begin; i <= end; ++i) {
                const int32_t from = i < end ? mask->runs[i].begin : mask->width,
                              until = i < end ? mask->runs[i].end : mask->width;
                for (; x < from; ++x) { /* not touched in this row */
                    if (open[x] >= 0) {
                        const int32_t row = clockwise ? mask->width - 1 - x : x;
                        if (pass == 0) {
                            ++to->row[row + 1];
                        } else {
                            to->runs[to->row[row]++] = (vshi_run){open[x], k};
                        }
                        open[x] = -1;
                    }
                }
                for (; x < until; ++x) {
                    open[x] = open[x] >= 0 ? open[x] : k;
                }
            }
        }
        if (pass == 0) {
            for (int32_t r = 0; r < to->height; ++r) {
                to->row[r + 1] += to->row[r];
            }
            total = to->row[to->height];
            VSHI_TRY_DONE(vshi_allocate((void **)&to->runs, total, sizeof *to->runs, what, error));
        }
    }
    for (int32_t r = to->height; r > 0; --r) { /* begins have become ends */
        to->row[r] = to->row[r - 1];
    }
    to->row[0] = 0;
done:
    free(open);
    return result;
}

vsh_result vshi_mask_turn(const vshi_mask *mask, int quarters, vshi_mask *turned, vsh_error *error) {
    if (quarters == 0) {
        VSHI_TRY(copy_runs(mask, turned, error));
        memcpy(turned->row, mask->row, ((size_t)mask->height + 1) * sizeof *mask->row);
        memcpy(turned->runs, mask->runs, mask->row[mask->height] * sizeof *mask->runs);
        return VSH_OK;
    }
    return quarters == 2 ? half_turn(mask, turned, error) : quarter_turn(mask, quarters == 3, turned, error);
}

void vshi_fit_turn(const vshi_fit *fit, int quarters, const double uv[2], double at[2]) {
    const double x = uv[0] * fit->scale[0] + fit->offset[0], y = uv[1] * fit->scale[1] + fit->offset[1];
    const double turned[4][2] = {
        {x, y}, {fit->height - y, x}, {fit->width - x, fit->height - y}, {y, fit->width - x}};
    at[0] = turned[quarters][0];
    at[1] = turned[quarters][1];
}
