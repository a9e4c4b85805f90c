/* Borders are drawn, and what lies between them is filled, however many triangles that are. */
#include "unwrap/mask.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

static const char what[] = "texels of a chart";

static const double ROOM =
    1e-4; /* texels: what is so near to a texel's border is on it; 32-bit UVs know no better */

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

/* The ends of a side, as a triangle without area: what it touches is told as of one. */
static void place_side(const vshi_patch *p, const vshi_fit *fit, uint32_t side, double at[3][2]) {
    for (int k = 0; k < 2; ++k) {
        const double *uv = p->uv[p->corner[side / 3][(side + (uint32_t)k) % 3]];
        for (int d = 0; d < 2; ++d) {
            at[k][d] = uv[0] * fit->matrix[d][0] + uv[1] * fit->matrix[d][1] + fit->offset[d];
        }
    }
    at[2][0] = at[1][0];
    at[2][1] = at[1][1];
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

/* Where borders cross the middle lines of rows. */
typedef struct crossings {
    uint32_t *row; /* [height + 1] in `at` */
    double *at;
} crossings;

static int compare_crossings(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Counts, or lists, the rows whose middle a side crosses: from one end's on, to before the other's. */
static void cross(crossings *c, const double at[3][2], int32_t height, bool list) {
    const double *low = at[0][1] < at[1][1] ? at[0] : at[1], *high = at[0][1] < at[1][1] ? at[1] : at[0];
    const int32_t first = clamp(ceil(low[1] - 0.5), height), end = clamp(ceil(high[1] - 0.5), height);
    for (int32_t y = first; y < end; ++y) {
        if (list) {
            c->at[c->row[y]++] = low[0] + (high[0] - low[0]) * ((y + 0.5 - low[1]) / (high[1] - low[1]));
        } else {
            ++c->row[y + 1];
        }
    }
}

/* Sets what lies between borders. */
static void fill_between(crossings *c, uint64_t *bits, size_t words, const vshi_mask *mask) {
    for (int32_t y = 0; y < mask->height; ++y) {
        const uint32_t begin = y > 0 ? c->row[y - 1] : 0, end = c->row[y]; /* begins have become ends */
        if (end > begin) {
            qsort(c->at + begin, end - begin, sizeof *c->at, compare_crossings);
        }
        for (uint32_t i = begin; i + 1 < end; i += 2) {
            const int32_t from = clamp(floor(c->at[i] + ROOM), mask->width),
                          until = clamp(ceil(c->at[i + 1] - ROOM), mask->width);
            set_bits(bits + words * (size_t)y, from, until);
        }
    }
}

/* Sets the texels that borders touch, and counts where they cross the rows. */
static void draw_borders(const vshi_patch *p, const vshi_fit *fit, const vshi_mask *mask, uint64_t *bits,
                         size_t words, crossings *c) {
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] != VSHI_NONE) {
            continue;
        }
        double at[3][2];
        int32_t first, last;
        place_side(p, fit, side, at);
        rows_of(at, mask->height, &first, &last);
        for (int32_t y = first; y <= last; ++y) {
            const vshi_run run = touched_in(at, y, mask->width);
            set_bits(bits + words * (size_t)y, run.begin, run.end);
        }
        cross(c, at, mask->height, false);
    }
}

vsh_result vshi_mask_make(const vshi_patch *p, const vshi_fit *fit, vshi_mask *mask, vsh_error *error) {
    *mask = (vshi_mask){.width = fit->width, .height = fit->height};
    const size_t words = ((size_t)mask->width + 63) / 64;
    uint64_t *bits = NULL;
    crossings c = {NULL, NULL};
    vsh_result result;
    VSHI_TRY_DONE(
        vshi_allocate((void **)&mask->row, (size_t)mask->height + 1, sizeof *mask->row, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&c.row, (size_t)mask->height + 1, sizeof *c.row, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bits, words * (size_t)mask->height, sizeof *bits, what, error));
    draw_borders(p, fit, mask, bits, words, &c);
    for (int32_t y = 0; y < mask->height; ++y) {
        c.row[y + 1] += c.row[y];
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&c.at, c.row[mask->height], sizeof *c.at, what, error));
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] == VSHI_NONE) {
            double at[3][2];
            place_side(p, fit, side, at);
            cross(&c, at, mask->height, true);
        }
    }
    fill_between(&c, bits, words, mask);
    read_runs(bits, words, mask, false);
    VSHI_TRY_DONE(
        vshi_allocate((void **)&mask->runs, mask->row[mask->height], sizeof *mask->runs, what, error));
    read_runs(bits, words, mask, true);
done:
    free(bits);
    free(c.at);
    free(c.row);
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

/* Swaps bit y of word x and bit x of word y, block by block (Warren, "Hacker's Delight", 2002). */
static void transpose(uint64_t words[64]) {
    uint64_t pick = UINT64_C(0x00000000ffffffff);
    for (int width = 32; width > 0; width /= 2, pick ^= pick << width) {
        for (int i = 0; i < 64; i = (i + width + 1) & ~width) {
            const uint64_t swap = (words[i] >> width ^ words[i + width]) & pick;
            words[i] ^= swap << width;
            words[i + width] ^= swap;
        }
    }
}

/* Texel (x, y) goes to (y, x). */
static void transpose_bits(const uint64_t *from, size_t from_words, int32_t height, uint64_t *to,
                           size_t to_words, int32_t width) {
    for (int32_t by = 0; by < height; by += 64) {
        for (int32_t bx = 0; bx < width; bx += 64) {
            uint64_t block[64];
            for (int32_t i = 0; i < 64; ++i) {
                block[i] = by + i < height ? from[from_words * (size_t)(by + i) + (size_t)bx / 64] : 0;
            }
            transpose(block);
            for (int32_t i = 0; i < 64 && bx + i < width; ++i) {
                to[to_words * (size_t)(bx + i) + (size_t)by / 64] = block[i];
            }
        }
    }
}

/* Anticlockwise, (x, y) goes to (height - 1 - y, x); clockwise to (y, width - 1 - x). Both are (y, x) with
 * its rows or its columns the other way. */
static vsh_result quarter_turn(const vshi_mask *mask, bool clockwise, vshi_mask *to, vsh_error *error) {
    *to = (vshi_mask){.width = mask->height, .height = mask->width};
    const size_t from_words = ((size_t)mask->width + 63) / 64, to_words = ((size_t)mask->height + 63) / 64;
    uint64_t *from = NULL, *bits = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&to->row, (size_t)to->height + 1, sizeof *to->row, what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&from, from_words * (size_t)mask->height, sizeof *from, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bits, to_words * (size_t)to->height, sizeof *bits, what, error));
    for (int32_t y = 0; y < mask->height; ++y) {
        const int32_t row = clockwise ? y : mask->height - 1 - y;
        for (uint32_t i = mask->row[row]; i < mask->row[row + 1]; ++i) {
            vshi_run run = mask->runs[i];
            if (clockwise) {
                run = (vshi_run){mask->width - run.end, mask->width - run.begin};
            }
            set_bits(from + from_words * (size_t)y, run.begin, run.end);
        }
    }
    transpose_bits(from, from_words, mask->height, bits, to_words, mask->width);
    read_runs(bits, to_words, to, false);
    VSHI_TRY_DONE(vshi_allocate((void **)&to->runs, to->row[to->height], sizeof *to->runs, what, error));
    read_runs(bits, to_words, to, true);
done:
    free(bits);
    free(from);
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
    const double x = uv[0] * fit->matrix[0][0] + uv[1] * fit->matrix[0][1] + fit->offset[0],
                 y = uv[0] * fit->matrix[1][0] + uv[1] * fit->matrix[1][1] + fit->offset[1];
    const double turned[4][2] = {
        {x, y}, {fit->height - y, x}, {fit->width - x, fit->height - y}, {y, fit->width - x}};
    at[0] = turned[quarters][0];
    at[1] = turned[quarters][1];
}
