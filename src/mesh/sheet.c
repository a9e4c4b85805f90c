/* A sheet that hangs together cuts a beam where none of its borders is within the beam and the beam's axis
 * crosses it an odd number of times: moving a ray of the beam onto its axis, within the beam, takes it across
 * no border, so the number of its crossings stays odd (the degree modulo 2 of a map; Milnor, "Topology from
 * the differentiable viewpoint", 1965). The sheet need be neither flat nor closed. */
#include "mesh/sheet.h"

#include "base/memory.h"
#include "base/try.h"
#include "mesh/weld.h"

#include <math.h>
#include <stdlib.h>

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

vsh_result vshi_sheet_join(vshi_sheet *sheet, vsh_error *error) {
    const size_t count = 3 * sheet->triangle_count;
    vshi_sorted_sides sides = {sheet->corners, sheet->triangle_count, sheet->vertex_count, NULL};
    const vsh_result result = vshi_sort_sides(&sides, error);
    for (size_t i = 0, end; result == VSH_OK && i < count; i = end) {
        const uint32_t *side = sides.sorted + i;
        end = vshi_next_edge(&sides, i);
        for (size_t k = i; k < end; ++k) {
            sheet->neighbours[sides.sorted[k]] = VSHI_SHEET_BORDER;
        }
        uint32_t ends[2];
        vshi_side_ends(sheet->corners, side[0], ends);
        if (end - i == 2 && ends[0] != ends[1]) {
            sheet->neighbours[side[0]] = side[1] / 3;
            sheet->neighbours[side[1]] = side[0] / 3;
        }
    }
    free(sides.sorted);
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
