/* Whether a flat chart lies over itself. Three tests, because none finds everything. A hole that is turned
 * inside out runs the wrong way. Borders that cross are found by a sweep along u: a chart without flipped
 * triangles that overlaps has such borders, unless they meet only in corners and along each other, as on
 * regular grids. A raster, about as fine as the triangles, finds the latter: each of its points lies in one
 * triangle at most. */
#include "unwrap/charts.h"

#include "base/memory.h"

#include <stdlib.h>

static const char what[] = "looking for overlap";

static const double TOUCH = 1e-7;   /* of the chart's size: closer borders touch */
static const double OFFSET = 0.371; /* of the raster's points: off the lines that charts are modelled on */

/* Pairs of sides to compare, about a minute: only slivers across the whole square make more. */
static const uint64_t MOST_PAIRS = UINT64_C(1) << 36;

enum { LEAST_SIDE = 64, MOST_SIDE = 2048, POINTS = 8 /* of the raster to a triangle */ };

typedef struct frame {
    double low[2], size;
} frame;

/* --- the raster */

/* Where an edge crosses a row; the same for both triangles beside it. */
static double cross_row(const double *a, const double *b, double y) {
    const double *low = a[1] < b[1] ? a : b, *high = a[1] < b[1] ? b : a;
    return low[0] + (high[0] - low[0]) * ((y - low[1]) / (high[1] - low[1]));
}

/* Marks the points in a triangle; false if one is marked already. Points on a left or lower edge are inside.
 */
static bool mark_points(uint64_t *marked, size_t side, const double at[3][2]) {
    double least = at[0][1], most = at[0][1];
    for (int k = 1; k < 3; ++k) {
        least = at[k][1] < least ? at[k][1] : least;
        most = at[k][1] > most ? at[k][1] : most;
    }
    for (double y = ceil(least); y < most; y += 1.0) {
        double ends[3];
        int found = 0;
        for (int k = 0; k < 3; ++k) {
            const double *a = at[k], *b = at[(k + 1) % 3];
            if ((a[1] <= y) != (b[1] <= y)) {
                ends[found++] = cross_row(a, b, y);
            }
        }
        if (found != 2) {
            continue;
        }
        const double begin = ends[0] < ends[1] ? ends[0] : ends[1],
                     end = ends[0] < ends[1] ? ends[1] : ends[0];
        for (double x = ceil(begin); x < end; x += 1.0) {
            const size_t bit = (size_t)y * side + (size_t)x;
            if ((marked[bit / 64] >> (bit % 64) & 1) != 0) {
                return false;
            }
            marked[bit / 64] |= (uint64_t)1 << (bit % 64);
        }
    }
    return true;
}

static vsh_result raster_overlaps(const vshi_patch *p, const frame *f, bool *overlaps, vsh_error *error) {
    const double wanted = sqrt((double)POINTS * p->count);
    const size_t side = wanted < LEAST_SIDE ? LEAST_SIDE : wanted > MOST_SIDE ? MOST_SIDE : (size_t)wanted;
    const double scale = (double)(side - 1) / f->size;
    uint64_t *marked = NULL;
    VSHI_TRY(vshi_allocate((void **)&marked, (side * side + 63) / 64, sizeof *marked, what, error));
    for (uint32_t i = 0; i < p->count && !*overlaps; ++i) {
        double at[3][2];
        for (int k = 0; k < 3; ++k) {
            const double *uv = p->uv[p->corner[i][k]];
            for (int d = 0; d < 2; ++d) {
                at[k][d] = (uv[d] - f->low[d]) * scale + OFFSET;
            }
        }
        *overlaps = !mark_points(marked, side, at);
    }
    free(marked);
    return VSH_OK;
}

/* --- borders */

/* A side of the border, and its box. */
typedef struct border_side {
    double low[2], high[2];
    uint32_t side;
} border_side;

typedef struct borders {
    const vshi_patch *patch;
    frame frame;
    border_side *sides; /* [count] */
    uint32_t count;
} borders;

static void find_ends(const borders *b, uint32_t i, const double *end[2]) {
    const uint32_t side = b->sides[i].side;
    end[0] = b->patch->uv[b->patch->corner[side / 3][side % 3]];
    end[1] = b->patch->uv[b->patch->corner[side / 3][(side + 1) % 3]];
}

/* Distance of c to the left of the line from a to b. */
static double left_of(const double *a, const double *b, const double *c) {
    const double x = b[0] - a[0], y = b[1] - a[1], length = sqrt(x * x + y * y);
    return length > 0.0 ? (x * (c[1] - a[1]) - y * (c[0] - a[0])) / length : 0.0;
}

static bool parted(double a, double b, double least) {
    return (a > least && b < -least) || (a < -least && b > least);
}

static bool crosses(const borders *b, uint32_t i, uint32_t k) {
    const double *a[2], *c[2], least = TOUCH * b->frame.size;
    find_ends(b, i, a);
    find_ends(b, k, c);
    return parted(left_of(a[0], a[1], c[0]), left_of(a[0], a[1], c[1]), least) &&
           parted(left_of(c[0], c[1], a[0]), left_of(c[0], c[1], a[1]), least);
}

/* Holes run clockwise. A hole that runs anticlockwise has been turned inside out, and lies over its
 * surroundings without crossing another border. */
static vsh_result holes_overlap(const borders *b, bool *overlaps, vsh_error *error) {
    const vshi_patch *p = b->patch;
    uint32_t *out = NULL, found = 0; /* [vertex_count]: the side of the border that leaves a vertex, + 1 */
    VSHI_TRY(vshi_allocate((void **)&out, p->vertex_count, sizeof *out, what, error));
    for (uint32_t i = 0; i < b->count; ++i) {
        const uint32_t side = b->sides[i].side;
        out[p->corner[side / 3][side % 3]] = side + 1;
    }
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        double doubled = 0.0;
        for (uint32_t at = v; out[at] != 0;) {
            const uint32_t side = out[at] - 1, next = p->corner[side / 3][(side + 1) % 3];
            const double *from = p->uv[at], *to = p->uv[next], *first = p->uv[v];
            doubled += (from[0] - first[0]) * (to[1] - first[1]) - (from[1] - first[1]) * (to[0] - first[0]);
            out[at] = 0;
            at = next;
        }
        found += doubled > TOUCH * b->frame.size * b->frame.size;
    }
    free(out);
    *overlaps = found > 1;
    return VSH_OK;
}

static int compare_sides(const void *a, const void *b) {
    const border_side *x = a, *y = b;
    return (x->low[0] > y->low[0]) - (x->low[0] < y->low[0]);
}

/* Compares each side with those whose boxes touch its own. */
static bool any_crosses(borders *b) {
    if (b->count > 0) {
        qsort(b->sides, b->count, sizeof *b->sides, compare_sides);
    }
    uint64_t pairs = 0;
    for (uint32_t i = 0; i < b->count; ++i) {
        const border_side *one = &b->sides[i];
        uint32_t k = i + 1;
        for (; k < b->count && b->sides[k].low[0] <= one->high[0]; ++k) {
            const border_side *other = &b->sides[k];
            if (other->low[1] <= one->high[1] && one->low[1] <= other->high[1] && crosses(b, i, k)) {
                return true;
            }
        }
        pairs += k - i;
        if (pairs > MOST_PAIRS) {
            return true;
        }
    }
    return false;
}

static vsh_result borders_overlap(const vshi_patch *p, const frame *f, bool *overlaps, vsh_error *error) {
    borders b = {.patch = p, .frame = *f};
    size_t count = 0;
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        count += p->beyond[side] == VSHI_NONE;
    }
    vsh_result result = VSH_OK;
    VSHI_TRY(vshi_allocate((void **)&b.sides, count, sizeof *b.sides, what, error));
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] == VSHI_NONE) {
            const double *end[2];
            b.sides[b.count].side = side;
            find_ends(&b, b.count, end);
            for (int d = 0; d < 2; ++d) {
                b.sides[b.count].low[d] = fmin(end[0][d], end[1][d]);
                b.sides[b.count].high[d] = fmax(end[0][d], end[1][d]);
            }
            ++b.count;
        }
    }
    if (!p->kept) {
        result = holes_overlap(&b, overlaps, error);
    }
    *overlaps = *overlaps || any_crosses(&b);
    free(b.sides);
    return result;
}

vsh_result vshi_patch_overlaps(const vshi_patch *p, bool *overlaps, vsh_error *error) {
    *overlaps = false;
    frame f;
    double high[2];
    vshi_patch_box(p, (const double[2]){1.0, 0.0}, f.low, high);
    f.size = high[0] - f.low[0] > high[1] - f.low[1] ? high[0] - f.low[0] : high[1] - f.low[1];
    if (!(f.size > 0.0) || !isfinite(f.size)) {
        return VSH_OK;
    }
    VSHI_TRY(borders_overlap(p, &f, overlaps, error));
    return *overlaps ? VSH_OK : raster_overlaps(p, &f, overlaps, error);
}
