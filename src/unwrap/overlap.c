/* Three looks, as none sees everything. Holes that are turned inside out are found by how they run; borders
 * that cross are found by a grid of cells over them: where no triangle flips, a chart that lies over itself
 * has such borders, unless they meet only in corners and along each other, as those of regular grids do. A
 * raster, about as fine as the triangles, sees these: each of its points is of one triangle at most. */
#include "unwrap/patch.h"

#include "base/memory.h"

#include <stdlib.h>

static const char what[] = "looking for overlap";

static const double TOUCH = 1e-7; /* of the chart's size: borders that are so near touch */
static const double OFFSET =
    0.371; /* of a point of the raster: so that none lies on lines that charts are drawn on */

enum { LEAST_SIDE = 64, MOST_SIDE = 2048, POINTS = 8 /* of the raster to a triangle */ };

typedef struct frame {
    double low[2], size;
} frame;

/* --- the raster */

/* Where the edge crosses a row; the same for both triangles beside it. */
static double cross_row(const double *a, const double *b, double y) {
    const double *low = a[1] < b[1] ? a : b, *high = a[1] < b[1] ? b : a;
    return low[0] + (high[0] - low[0]) * ((y - low[1]) / (high[1] - low[1]));
}

/* Marks the points in a triangle; false where one is marked already. A point is in where edges to its left
 * and below are at most as far as it. */
static bool mark(uint64_t *marked, size_t side, const double at[3][2]) {
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
        *overlaps = !mark(marked, side, at);
    }
    free(marked);
    return VSH_OK;
}

/* --- borders */

typedef struct borders {
    const vshi_patch *patch;
    frame frame;
    uint32_t *sides; /* of the border */
    uint32_t count;
    uint32_t cells;  /* along each side of the grid */
    uint32_t *begin; /* [cells² + 1] in `list` */
    uint32_t *list;  /* numbers of sides */
} borders;

static void ends_of(const borders *b, uint32_t i, const double *end[2]) {
    const uint32_t side = b->sides[i];
    end[0] = b->patch->uv[b->patch->corner[side / 3][side % 3]];
    end[1] = b->patch->uv[b->patch->corner[side / 3][(side + 1) % 3]];
}

/* How far c is to the left of the line from a to b. */
static double left_of(const double *a, const double *b, const double *c) {
    const double x = b[0] - a[0], y = b[1] - a[1], length = sqrt(x * x + y * y);
    return length > 0.0 ? (x * (c[1] - a[1]) - y * (c[0] - a[0])) / length : 0.0;
}

static bool parted(double a, double b, double least) {
    return (a > least && b < -least) || (a < -least && b > least);
}

static bool crosses(const borders *b, uint32_t i, uint32_t k) {
    const double *a[2], *c[2], least = TOUCH * b->frame.size;
    ends_of(b, i, a);
    ends_of(b, k, c);
    return parted(left_of(a[0], a[1], c[0]), left_of(a[0], a[1], c[1]), least) &&
           parted(left_of(c[0], c[1], a[0]), left_of(c[0], c[1], a[1]), least);
}

static uint32_t cell_of(const borders *b, double x) {
    const double cell = x / b->frame.size * b->cells;
    return cell <= 0.0 ? 0 : cell >= b->cells ? b->cells - 1 : (uint32_t)cell;
}

/* Counts a side in each cell that it passes, row by row of cells, or lists it there. */
static size_t file_side(borders *b, uint32_t i, bool list) {
    const double *end[2];
    ends_of(b, i, end);
    const double ax = end[0][0] - b->frame.low[0], ay = end[0][1] - b->frame.low[1],
                 bx = end[1][0] - b->frame.low[0], by = end[1][1] - b->frame.low[1];
    const uint32_t first = cell_of(b, ay < by ? ay : by), last = cell_of(b, ay < by ? by : ay);
    const double height = b->frame.size / b->cells;
    size_t passed = 0;
    for (uint32_t row = first; row <= last; ++row) {
        double x0 = ax, x1 = bx;
        if (first != last) { /* the part in this row, with room for rounding */
            const double t0 = ((double)row * height - ay) / (by - ay),
                         t1 = ((double)(row + 1) * height - ay) / (by - ay);
            double begin = t0 < t1 ? t0 : t1, finish = t0 < t1 ? t1 : t0;
            begin = begin > 0.0 ? begin : 0.0;
            finish = finish < 1.0 ? finish : 1.0;
            x0 = ax + (bx - ax) * begin;
            x1 = ax + (bx - ax) * finish;
        }
        const double room = 1e-6 * height;
        const uint32_t from = cell_of(b, (x0 < x1 ? x0 : x1) - room),
                       to = cell_of(b, (x0 < x1 ? x1 : x0) + room);
        for (uint32_t column = from; column <= to; ++column) {
            const size_t cell = (size_t)row * b->cells + column;
            if (list) {
                b->list[b->begin[cell]++] = i;
            } else {
                ++b->begin[cell + 1];
            }
            ++passed;
        }
    }
    return passed;
}

/* Holes run clockwise, as what they bound is outside of them. One that runs the other way has been turned
 * inside out, and lies over what is around it without a border that crosses another. */
static vsh_result holes_overlap(const borders *b, bool *overlaps, vsh_error *error) {
    const vshi_patch *p = b->patch;
    uint32_t *out = NULL, found = 0; /* [vertex_count]: the side of the border that leaves a vertex, + 1 */
    VSHI_TRY(vshi_allocate((void **)&out, p->vertex_count, sizeof *out, what, error));
    for (uint32_t i = 0; i < b->count; ++i) {
        out[p->corner[b->sides[i] / 3][b->sides[i] % 3]] = b->sides[i] + 1;
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

static bool any_crosses(const borders *b) {
    const size_t cells = (size_t)b->cells * b->cells;
    for (size_t cell = 0, begin = 0; cell < cells; begin = b->begin[cell++]) {
        for (uint32_t i = (uint32_t)begin; i < b->begin[cell]; ++i) {
            for (uint32_t k = i + 1; k < b->begin[cell]; ++k) {
                if (crosses(b, b->list[i], b->list[k])) {
                    return true;
                }
            }
        }
    }
    return false;
}

static vsh_result borders_overlap(const vshi_patch *p, const frame *f, bool *overlaps, vsh_error *error) {
    borders b = {.patch = p, .frame = *f};
    size_t passed = 0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&b.sides, 3 * (size_t)p->count, sizeof *b.sides, what, error));
    for (uint32_t side = 0; side < 3 * p->count; ++side) {
        if (p->beyond[side] == VSHI_NONE) {
            b.sides[b.count++] = side;
        }
    }
    if (!p->kept) {
        VSHI_TRY_DONE(holes_overlap(&b, overlaps, error));
        if (*overlaps) {
            goto done;
        }
    }
    b.cells = (uint32_t)sqrt((double)b.count) + 1;
    const size_t cells = (size_t)b.cells * b.cells;
    VSHI_TRY_DONE(vshi_allocate((void **)&b.begin, cells + 1, sizeof *b.begin, what, error));
    for (uint32_t i = 0; i < b.count; ++i) {
        passed += file_side(&b, i, false);
    }
    if (passed >= UINT32_MAX) { /* nothing that is laid out is like this */
        *overlaps = true;
        goto done;
    }
    for (size_t cell = 0; cell < cells; ++cell) {
        b.begin[cell + 1] += b.begin[cell];
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&b.list, passed, sizeof *b.list, what, error));
    for (uint32_t i = 0; i < b.count; ++i) {
        file_side(&b, i, true);
    }
    *overlaps = any_crosses(&b);
done:
    free(b.list);
    free(b.begin);
    free(b.sides);
    return result;
}

vsh_result vshi_patch_overlaps(const vshi_patch *p, bool *overlaps, vsh_error *error) {
    *overlaps = false;
    frame f;
    double high[2];
    vshi_patch_box(p, f.low, high);
    f.size = high[0] - f.low[0] > high[1] - f.low[1] ? high[0] - f.low[0] : high[1] - f.low[1];
    if (!(f.size > 0.0) || !isfinite(f.size)) {
        return VSH_OK;
    }
    VSHI_TRY(borders_overlap(p, &f, overlaps, error));
    return *overlaps ? VSH_OK : raster_overlaps(p, &f, overlaps, error);
}
