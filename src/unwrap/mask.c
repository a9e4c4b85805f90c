/* Which texels a chart touches. */
#include "unwrap/charts.h"

#include "base/memory.h"

#include <stdlib.h>

static const char what[] = "texels of a chart";

static const double BOX = 0.9;      /* least share of its box that a chart fills to be fitted to texels */
static const double MOST_FIT = 1.3; /* factor by which fitting may change a side */
/* Texels from the centres of such a chart's outermost texels to its borders: rays that began right at a
 * border would hit what stands there. */
static const double BEYOND = 0.1;
static const double SLACK = 1e-9; /* texels: rounding of a border's place */

enum { FARTHEST = 1 << 24 };     /* texels: larger than any page */
static const double ROOM = 1e-4; /* texels: rounding of 32-bit UVs */

/* --- bits */

void vshi_bits_set(uint64_t *row, int32_t begin, int32_t end) {
    for (int32_t x = begin; x < end;) {
        const int32_t until = (x / 64 + 1) * 64 < end ? (x / 64 + 1) * 64 : end;
        row[x / 64] |= until - x == 64 ? ~(uint64_t)0 : (((uint64_t)1 << (until - x)) - 1) << (x % 64);
        x = until;
    }
}

int32_t vshi_bits_next(const uint64_t *row, int32_t x, int32_t width, bool value) {
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

/* Fills a mask from its bits, `words` to a row. */
static vsh_result list_runs(const uint64_t *bits, size_t words, vshi_mask *mask, vsh_error *error) {
    VSHI_TRY(vshi_allocate((void **)&mask->row, (size_t)mask->height + 1, sizeof *mask->row, what, error));
    for (int pass = 0; pass < 2; ++pass) {
        uint32_t at = 0;
        for (int32_t y = 0; y < mask->height; ++y) {
            const uint64_t *row = bits + words * (size_t)y;
            for (int32_t begin = vshi_bits_next(row, 0, mask->width, true), end; begin < mask->width;
                 begin = vshi_bits_next(row, end, mask->width, true), ++at) {
                end = vshi_bits_next(row, begin, mask->width, false);
                if (pass == 1) {
                    mask->runs[at] = (vshi_run){begin, end};
                    mask->touched += (uint64_t)(end - begin);
                }
            }
            mask->row[y + 1] = at;
        }
        if (pass == 0) {
            VSHI_TRY(vshi_allocate((void **)&mask->runs, at, sizeof *mask->runs, what, error));
        }
    }
    return VSH_OK;
}

/* --- patches drawn */

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

vsh_result vshi_mask_make(const vshi_patch *p, const vshi_fit *fit, vshi_mask *mask, vsh_error *error) {
    *mask = (vshi_mask){.width = fit->width, .height = fit->height};
    const size_t words = ((size_t)mask->width + 63) / 64;
    uint64_t *bits = NULL;
    VSHI_TRY(vshi_allocate((void **)&bits, words * (size_t)mask->height, sizeof *bits, what, error));
    for (uint32_t i = 0; i < p->count; ++i) {
        double at[3][2];
        int32_t first, last;
        for (int k = 0; k < 3; ++k) {
            for (int d = 0; d < 2; ++d) {
                at[k][d] = p->uv[p->corner[i][k]][d] * fit->scale[d] + fit->offset[d];
            }
        }
        rows_of(at, mask->height, &first, &last);
        for (int32_t y = first; y <= last; ++y) {
            const vshi_run run = touched_in(at, y, mask->width);
            vshi_bits_set(bits + words * (size_t)y, run.begin, run.end);
        }
    }
    const vsh_result result = list_runs(bits, words, mask, error);
    free(bits);
    return result;
}

void vshi_mask_free(vshi_mask *mask) {
    free(mask->runs);
    free(mask->row);
    *mask = (vshi_mask){0};
}

/* --- quarter turns */

/* Anticlockwise, (x, y) moves to (height - 1 - y, x); clockwise to (y, width - 1 - x); by half a turn to
 * (width - 1 - x, height - 1 - y). */
vsh_result vshi_mask_turn(const vshi_mask *mask, int quarters, vshi_mask *to, vsh_error *error) {
    const bool exchanged = quarters != 2;
    *to = (vshi_mask){.width = exchanged ? mask->height : mask->width,
                      .height = exchanged ? mask->width : mask->height};
    const size_t words = ((size_t)to->width + 63) / 64;
    uint64_t *bits = NULL;
    VSHI_TRY(vshi_allocate((void **)&bits, words * (size_t)to->height, sizeof *bits, what, error));
    for (int32_t y = 0; y < mask->height; ++y) {
        const int32_t row = quarters <= 2 ? mask->height - 1 - y : y;
        for (uint32_t i = mask->row[y]; i < mask->row[y + 1]; ++i) {
            const vshi_run run = mask->runs[i];
            const int32_t begin = quarters >= 2 ? mask->width - run.end : run.begin,
                          end = quarters >= 2 ? mask->width - run.begin : run.end;
            if (!exchanged) {
                vshi_bits_set(bits + words * (size_t)row, begin, end);
            }
            for (int32_t x = begin; exchanged && x < end; ++x) {
                bits[words * (size_t)x + (size_t)row / 64] |= (uint64_t)1 << (row % 64);
            }
        }
    }
    const vsh_result result = list_runs(bits, words, to, error);
    free(bits);
    return result;
}

void vshi_fit_turn(const vshi_fit *fit, int quarters, const double uv[2], double at[2]) {
    const double x = uv[0] * fit->scale[0] + fit->offset[0], y = uv[1] * fit->scale[1] + fit->offset[1];
    const double turned[4][2] = {
        {x, y}, {fit->height - y, x}, {fit->width - x, fit->height - y}, {y, fit->width - x}};
    at[0] = turned[quarters][0];
    at[1] = turned[quarters][1];
}

/* --- the smallest box around a chart: one of its sides mostly runs along a border (Freeman and Shapira,
 * "Determining the minimum-area encasing rectangle for an arbitrary closed curve", 1975) */

/* Direction of the smallest box's lower side, among those of some sides of the border. */
static void find_direction(const vshi_patch *p, double best[2]) {
    enum { MOST = 64 };
    uint32_t borders = 0, seen = 0;
    double least = INFINITY;
    best[0] = 1.0;
    best[1] = 0.0;
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        borders += p->beyond[side] == VSHI_NONE;
    }
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] != VSHI_NONE || seen++ % (1 + borders / MOST) != 0) {
            continue;
        }
        const double *a = p->uv[p->corner[side / 3][side % 3]],
                     *b = p->uv[p->corner[side / 3][(side + 1) % 3]];
        const double x = b[0] - a[0], y = b[1] - a[1], length = sqrt(x * x + y * y);
        double low[2], high[2];
        if (!(length > 0.0)) {
            continue;
        }
        const double along[2] = {x / length, y / length};
        vshi_patch_box(p, along, low, high);
        const double area = (high[0] - low[0]) * (high[1] - low[1]);
        if (area < least * 0.9999) { /* the first of equal boxes, whatever the rounding */
            least = area;
            memcpy(best, along, sizeof along);
        }
    }
}

/* Turns uv so that `along` is u, and moves their box to 0. */
static void turn(vshi_patch *p, const double along[2]) {
    double low[2], high[2];
    vshi_patch_box(p, along, low, high);
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        const double uv[2] = {p->uv[v][0], p->uv[v][1]};
        p->uv[v][0] = uv[0] * along[0] + uv[1] * along[1] - low[0];
        p->uv[v][1] = uv[1] * along[0] - uv[0] * along[1] - low[1];
    }
    p->size[0] = high[0] - low[0];
    p->size[1] = high[1] - low[1];
}

void vshi_patch_straighten(vshi_patch *p) {
    double along[2];
    find_direction(p, along);
    turn(p, along);
    if (p->size[1] > p->size[0]) {
        turn(p, (const double[2]){0.0, 1.0});
    }
}

/* --- fits to texels */

static int32_t whole(double x) {
    return x < 1.0 ? 1 : x > FARTHEST ? FARTHEST : (int32_t)x;
}

vshi_fit vshi_mask_fit(const vshi_patch *p, double density, double max_stretch) {
    vshi_fit fit = {.uneven = 1.0};
    double factor[2];
    int32_t texels[2];
    bool fits = !p->kept && p->area > BOX * p->size[0] * p->size[1];
    for (int k = 0; k < 2; ++k) {
        const double length = p->size[k] * density;
        texels[k] = whole(floor(length + 0.5));
        factor[k] = (texels[k] + 2.0 * BEYOND) / length;
        fits = fits && factor[k] < MOST_FIT && factor[k] > 1.0 / MOST_FIT;
    }
    const double uneven = factor[0] / factor[1];
    fits = fits && p->stretch * sqrt(0.5 * (uneven + 1.0 / uneven)) < max_stretch;
    fit.uneven = fits ? uneven : 1.0;
    int32_t *sides[2] = {&fit.width, &fit.height};
    for (int k = 0; k < 2; ++k) {
        const double length = p->size[k] * density;
        *sides[k] = fits ? texels[k] + 1 : whole(ceil(length - SLACK));
        fit.offset[k] = fits ? 0.5 - BEYOND : 0.5 * (*sides[k] - length);
        fit.scale[k] = fits ? density * factor[k] : density;
    }
    return fit;
}
