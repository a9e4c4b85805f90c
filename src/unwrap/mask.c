/* Which texels a chart touches. Its borders are drawn and filled, so triangles inside cost nothing. */
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

/* The ends of a side, as a triangle without area. */
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

/* Marks where a side crosses the middle lines of rows. The patch lies between pairs of marks of a row. */
static void mark_crossings(const double at[3][2], const vshi_mask *mask, size_t words, uint64_t *marks) {
    const double *low = at[0][1] < at[1][1] ? at[0] : at[1], *high = at[0][1] < at[1][1] ? at[1] : at[0];
    const int32_t first = clamp(ceil(low[1] - 0.5), mask->height),
                  end = clamp(ceil(high[1] - 0.5), mask->height);
    for (int32_t y = first; y < end; ++y) {
        const double x = low[0] + (high[0] - low[0]) * ((y + 0.5 - low[1]) / (high[1] - low[1]));
        const int32_t column = clamp(floor(x + ROOM), mask->width);
        marks[words * (size_t)y + (size_t)column / 64] ^= (uint64_t)1 << (column % 64);
    }
}

/* Sets the texels that borders touch. */
static void draw_borders(const vshi_patch *p, const vshi_fit *fit, const vshi_mask *mask, size_t words,
                         uint64_t *bits, uint64_t *marks) {
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
            vshi_bits_set(bits + words * (size_t)y, run.begin, run.end);
        }
        mark_crossings((const double(*)[2])at, mask, words, marks);
    }
}

vsh_result vshi_mask_make(const vshi_patch *p, const vshi_fit *fit, vshi_mask *mask, vsh_error *error) {
    *mask = (vshi_mask){.width = fit->width, .height = fit->height};
    const size_t words = (size_t)mask->width / 64 + 1, count = words * (size_t)mask->height;
    uint64_t *bits, *marks;
    const vshi_array arrays[] = {VSHI_ARRAY(bits, count), VSHI_ARRAY(marks, count)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    draw_borders(p, fit, mask, words, bits, marks);
    for (size_t i = 0, within = 0; i < count; ++i) { /* an even number of marks ends each row outside */
        uint64_t inside = marks[i];
        for (int shift = 1; shift < 64; shift *= 2) {
            inside ^= inside << shift;
        }
        inside = within != 0 ? ~inside : inside;
        within = inside >> 63;
        bits[i] |= inside;
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
    const double x = uv[0] * fit->matrix[0][0] + uv[1] * fit->matrix[0][1] + fit->offset[0],
                 y = uv[0] * fit->matrix[1][0] + uv[1] * fit->matrix[1][1] + fit->offset[1];
    const double turned[4][2] = {
        {x, y}, {fit->height - y, x}, {fit->width - x, fit->height - y}, {y, fit->width - x}};
    at[0] = turned[quarters][0];
    at[1] = turned[quarters][1];
}

/* Cosines and sines of the angles. */
static const double TURNS[VSHI_ANGLES][2] = {{1.0, 0.0},
                                             {0.92387953251128676, 0.38268343236508977},
                                             {0.70710678118654752, 0.70710678118654752},
                                             {0.38268343236508977, 0.92387953251128676}};

/* --- the smallest box around a chart: one of its sides runs along the convex hull (Freeman and Shapira,
 * "Determining the minimum-area encasing rectangle for an arbitrary closed curve", 1975) */

typedef struct point {
    double x, y;
} point;

static int compare_points(const void *a, const void *b) {
    const point *p = a, *q = b;
    if (p->x != q->x) {
        return p->x < q->x ? -1 : 1;
    }
    return p->y != q->y ? (p->y < q->y ? -1 : 1) : 0;
}

static double left_turn(point a, point b, point c) {
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/* Convex hull of sorted points, anticlockwise (Andrew, 1979); `hull` has room for 2 count. */
static size_t find_hull(const point *points, size_t count, point *hull) {
    size_t size = 0;
    for (int half = 0; half < 2; ++half) {
        const size_t first = size;
        for (size_t i = 0; i < count; ++i) {
            const point p = half == 0 ? points[i] : points[count - 1 - i];
            while (size >= first + 2 && left_turn(hull[size - 2], hull[size - 1], p) <= 0.0) {
                --size;
            }
            hull[size++] = p;
        }
        --size; /* begins the other half */
    }
    return size;
}

static double dot_along(point p, double x, double y) {
    return p.x * x + p.y * y;
}

/* Direction of the smallest box's lower side. */
static point find_direction(const point *hull, size_t count) {
    point best = {1.0, 0.0};
    double least = INFINITY;
    for (size_t i = 0; i < count; ++i) {
        const point a = hull[i], b = hull[(i + 1) % count];
        const double length = sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
        if (!(length > 0.0)) {
            continue;
        }
        const double x = (b.x - a.x) / length, y = (b.y - a.y) / length;
        double low = INFINITY, high = -INFINITY, top = -INFINITY;
        for (size_t k = 0; k < count; ++k) {
            const double along = dot_along(hull[k], x, y), up = dot_along(hull[k], -y, x);
            low = along < low ? along : low;
            high = along > high ? along : high;
            top = up > top ? up : top;
        }
        const double width = high - low, height = top - dot_along(a, -y, x);
        if (width * height < least * 0.9999) { /* the first of equal boxes, whatever the rounding */
            least = width * height;
            best = (point){x, y};
        }
    }
    return best;
}

/* Turns uv so that `along` is u, and moves their box to 0. Returns whether it is higher than wide. */
static bool turn(vshi_patch *p, point along) {
    double low[2], high[2];
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        const point at = {p->uv[v][0], p->uv[v][1]};
        p->uv[v][0] = dot_along(at, along.x, along.y);
        p->uv[v][1] = dot_along(at, -along.y, along.x);
    }
    vshi_patch_box(p, TURNS[0], low, high);
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        p->uv[v][0] -= low[0];
        p->uv[v][1] -= low[1];
    }
    return high[1] - low[1] > high[0] - low[0];
}

vsh_result vshi_patch_straighten(vshi_patch *p, vsh_error *error) {
    point *points, *hull;
    const vshi_array arrays[] = {VSHI_ARRAY(points, p->vertex_count),
                                 VSHI_ARRAY(hull, 2 * (size_t)p->vertex_count + 2)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, what, error));
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        points[v] = (point){p->uv[v][0], p->uv[v][1]};
    }
    qsort(points, p->vertex_count, sizeof *points, compare_points);
    if (turn(p, find_direction(hull, find_hull(points, p->vertex_count, hull)))) {
        turn(p, (point){0.0, 1.0});
    }
    for (int a = 0; a < VSHI_ANGLES; ++a) {
        double high[2];
        vshi_patch_box(p, TURNS[a], p->low[a], high);
        p->size[a][0] = high[0] - p->low[a][0];
        p->size[a][1] = high[1] - p->low[a][1];
    }
    free(points);
    return VSH_OK;
}

/* --- fits to texels */

static int32_t whole(double x) {
    return x < 1.0 ? 1 : x > FARTHEST ? FARTHEST : (int32_t)x;
}

bool vshi_patch_is_box(const vshi_patch *p) {
    return p->area > BOX * p->size[0][0] * p->size[0][1];
}

vshi_fit vshi_mask_fit(const vshi_patch *p, int angle, double density, double max_stretch) {
    vshi_fit fit = {.uneven = 1.0};
    double factor[2];
    int32_t texels[2];
    bool fits = angle == 0 && !p->kept && vshi_patch_is_box(p);
    for (int k = 0; k < 2; ++k) {
        const double length = p->size[angle][k] * density;
        texels[k] = whole(floor(length + 0.5));
        factor[k] = (texels[k] + 2.0 * BEYOND) / length;
        fits = fits && factor[k] < MOST_FIT && factor[k] > 1.0 / MOST_FIT;
    }
    const double uneven = factor[0] / factor[1];
    fits = fits && p->stretch * sqrt(0.5 * (uneven + 1.0 / uneven)) < max_stretch;
    fit.uneven = fits ? uneven : 1.0;
    int32_t *sides[2] = {&fit.width, &fit.height};
    for (int k = 0; k < 2; ++k) {
        const double length = p->size[angle][k] * density, scale = fits ? density * factor[k] : density;
        *sides[k] = fits ? texels[k] + 1 : whole(ceil(length - SLACK));
        fit.offset[k] = (fits ? 0.5 - BEYOND : 0.5 * (*sides[k] - length)) - scale * p->low[angle][k];
        fit.matrix[k][0] = scale * TURNS[angle][k];
        fit.matrix[k][1] = scale * (k == 0 ? -TURNS[angle][1] : TURNS[angle][0]);
    }
    return fit;
}
