/* A sheet that hangs together cuts a beam where none of its borders is within the beam and the beam's axis
 * crosses it an odd number of times: moving a ray of the beam onto its axis, within the beam, takes it across
 * no border, so the number of its crossings stays odd (the degree modulo 2 of a map; Milnor, "Topology from
 * the differentiable viewpoint", 1965). The sheet need be neither flat nor closed. */
#include "mesh/sheet.h"

#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Room for the rounding of floats and for what rays are lifted off a surface, in a scene of half size 1. */
static const double ROUNDING = 0x1p-16;

vsh_result vshi_sheet_allocate(vshi_sheet *sheet, size_t vertex_count, size_t triangle_count,
                               vsh_error *error) {
    const char *what = "triangles' neighbours";
    *sheet = (vshi_sheet){.vertex_count = vertex_count, .triangle_count = triangle_count};
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&sheet->vertices, vertex_count, sizeof(float[3]), what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&sheet->corners, triangle_count, sizeof(uint32_t[3]), what, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&sheet->neighbours, triangle_count, sizeof(uint32_t[3]), what, error));
done:
    if (result != VSH_OK) {
        vshi_sheet_free(sheet);
    }
    return result;
}

void vshi_sheet_free(vshi_sheet *sheet) {
    free(sheet->vertices);
    free(sheet->corners);
    free(sheet->neighbours);
    *sheet = (vshi_sheet){0};
}

double vshi_sheet_bytes(double vertex_count, double triangle_count) {
    return vertex_count * 3.0 * sizeof(float) + triangle_count * 6.0 * sizeof(uint32_t);
}

/* Edge k of triangle t is number 3 t + k: its vertices, the lower one first. */
static void ends_of(const vshi_sheet *sheet, uint32_t edge, uint32_t ends[2]) {
    const uint32_t *corners = sheet->corners + edge / 3 * (size_t)3;
    const uint32_t a = corners[edge % 3], b = corners[(edge + 1) % 3];
    ends[0] = a < b ? a : b;
    ends[1] = a < b ? b : a;
}

/* Sorts edges by one of their ends, and leaves those alike in order; `from` NULL: as they are numbered.
 * Vertices near each other in a mesh mostly have numbers near each other, so that memory is gone through in
 * order, which a hash table's is not. */
static void sort_by_end(const vshi_sheet *sheet, int end, const uint32_t *from, uint32_t *first,
                        uint32_t *sorted) {
    const uint32_t count = (uint32_t)(3 * sheet->triangle_count);
    uint32_t ends[2];
    memset(first, 0, (sheet->vertex_count + 1) * sizeof *first);
    for (uint32_t edge = 0; edge < count; ++edge) {
        ends_of(sheet, edge, ends);
        ++first[ends[end] + (size_t)1];
    }
    for (size_t v = 0; v < sheet->vertex_count; ++v) {
        first[v + 1] += first[v];
    }
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t edge = from != NULL ? from[i] : i;
        ends_of(sheet, edge, ends);
        sorted[first[ends[end]]++] = edge;
    }
}

/* Edges that are alone between their vertices are borders, and so are those where more than two meet. */
static void join_edges(vshi_sheet *sheet, const uint32_t *sorted) {
    const uint32_t count = (uint32_t)(3 * sheet->triangle_count);
    for (uint32_t i = 0, next; i < count; i = next) {
        uint32_t ends[2], other[2];
        ends_of(sheet, sorted[i], ends);
        for (next = i + 1; next < count; ++next) {
            ends_of(sheet, sorted[next], other);
            if (other[0] != ends[0] || other[1] != ends[1]) {
                break;
            }
        }
        if (next - i == 2 && ends[0] != ends[1]) {
            sheet->neighbours[sorted[i]] = sorted[i + 1] / 3;
            sheet->neighbours[sorted[i + 1]] = sorted[i] / 3;
        }
    }
}

vsh_result vshi_sheet_join(vshi_sheet *sheet, vsh_error *error) {
    const char *what = "triangles' neighbours";
    const size_t edges = 3 * sheet->triangle_count;
    if (edges == 0) {
        return VSH_OK;
    }
    memset(sheet->neighbours, 0xff, edges * sizeof *sheet->neighbours);
    uint32_t *first = NULL, *by_end = NULL, *sorted = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&first, sheet->vertex_count + 1, sizeof *first, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&by_end, edges, sizeof *by_end, what, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&sorted, edges, sizeof *sorted, what, error));
    sort_by_end(sheet, 1, NULL, first, by_end);
    sort_by_end(sheet, 0, by_end, first, sorted);
    join_edges(sheet, sorted);
done:
    free(sorted);
    free(by_end);
    free(first);
    return result;
}

/* --- cutting beams */

/* A point as the beam sees it: along its axis, and beside it. */
typedef struct seen {
    double along, x, y;
} seen;

typedef struct view {
    const vshi_sheet *sheet;
    vshi_vec origin, axis, u, v;
    double radius;      /* of the beam, as far as it is looked at */
    double first, last; /* along the axis: where the sheet may be within the beam */
} view;

static seen look(const view *w, uint32_t vertex) {
    const float *p = w->sheet->vertices + 3 * (size_t)vertex;
    const vshi_vec off = vshi_sub(vshi_vec_off(p), w->origin);
    return (seen){vshi_dot(off, w->axis), vshi_dot(off, w->u), vshi_dot(off, w->v)};
}

/* Squared distance of the axis from the edge between two points, beside it. */
static double edge_distance(seen a, seen b) {
    const double x = b.x - a.x, y = b.y - a.y, square = x * x + y * y;
    double part = square > 0.0 ? -(a.x * x + a.y * y) / square : 0.0;
    part = part < 0.0 ? 0.0 : part > 1.0 ? 1.0 : part;
    const double px = a.x + part * x, py = a.y + part * y;
    return px * px + py * py;
}

/* Whether the edge crosses the half line from the axis along u; the same for both triangles that share it. */
static bool edge_crosses(seen a, seen b) {
    if ((a.y > 0.0) == (b.y > 0.0)) {
        return false;
    }
    const seen low = a.y < b.y ? a : b, high = a.y < b.y ? b : a;
    return low.x + (high.x - low.x) * (-low.y / (high.y - low.y)) > 0.0;
}

/* Whether the part of a triangle that is within the beam keeps between the beam's ends. */
static bool between_ends(const view *w, const seen p[3]) {
    double low = fmin(p[0].along, fmin(p[1].along, p[2].along));
    double high = fmax(p[0].along, fmax(p[1].along, p[2].along));
    if (low > w->first && high < w->last) {
        return true;
    }
    const double ax = p[1].x - p[0].x, ay = p[1].y - p[0].y, az = p[1].along - p[0].along;
    const double bx = p[2].x - p[0].x, by = p[2].y - p[0].y, bz = p[2].along - p[0].along;
    const double nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
    if (nz != 0.0) { /* its plane: along = middle + slope × what is beside the axis */
        const double slope = sqrt(nx * nx + ny * ny) / fabs(nz);
        const double middle = p[0].along + (nx * p[0].x + ny * p[0].y) / nz;
        low = fmax(low, middle - slope * w->radius);
        high = fmin(high, middle + slope * w->radius);
    }
    return low > w->first && high < w->last;
}

bool vshi_sheet_cuts(const vshi_sheet *sheet, const vshi_sheet_beam *beam, uint32_t triangle, double distance,
                     int most) {
    view w = {.sheet = sheet, .origin = beam->origin, .axis = beam->axis};
    vshi_frame(beam->axis, &w.u, &w.v);
    const double room = ROUNDING * (distance + 1.0);
    w.first = beam->wide + room;
    w.last = fmin(beam->end, 1.5 * distance + 4.0 * beam->wide) - beam->wide - room;
    w.radius = beam->wide + (w.last + beam->wide) * beam->tangent + room;
    uint32_t found[VSHI_SHEET_MOST];
    int count = 1;
    bool crossings = false;
    found[0] = triangle;
    most = most < VSHI_SHEET_MOST ? most : VSHI_SHEET_MOST;
    for (int i = 0; i < count; ++i) {
        const uint32_t *corner = sheet->corners + 3 * (size_t)found[i];
        const uint32_t *beyond = sheet->neighbours + 3 * (size_t)found[i];
        const seen p[3] = {look(&w, corner[0]), look(&w, corner[1]), look(&w, corner[2])};
        if (!between_ends(&w, p)) {
            return false;
        }
        if (i == 0) { /* so many of its size would have to cover the beam */
            const double area =
                0.5 * fabs((p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y));
            if (area * most < w.radius * w.radius) {
                return false;
            }
        }
        for (int k = 0; k < 3; ++k) {
            const seen a = p[k], b = p[(k + 1) % 3];
            crossings ^= edge_crosses(a, b);
            if (edge_distance(a, b) > w.radius * w.radius) {
                continue;
            }
            bool known = beyond[k] == VSHI_SHEET_BORDER;
            if (known) {
                return false;
            }
            for (int j = 0; !known && j < count; ++j) {
                known = found[j] == beyond[k];
            }
            if (!known && count == most) {
                return false;
            }
            if (!known) {
                found[count++] = beyond[k];
            }
        }
    }
    return crossings;
}
