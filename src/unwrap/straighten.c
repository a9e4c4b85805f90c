/* The least box around a chart: one of its sides runs along the convex hull (Freeman and Shapira,
 * "Determining the minimum-area encasing rectangle for an arbitrary closed curve", 1975). */
#include "base/memory.h"
#include "base/try.h"
#include "unwrap/mask.h"

#include <stdlib.h>

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

/* Direction of the least box's lower side: rotating calipers (Toussaint, 1983). */
static point find_direction(const point *hull, size_t count) {
    point best = {1.0, 0.0};
    double least = INFINITY;
    size_t right = 0, top = 0, left = 0;
    for (size_t i = 0; i < count; ++i) {
        const point a = hull[i], b = hull[(i + 1) % count];
        const double length = sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
        if (!(length > 0.0)) {
            continue;
        }
        const double x = (b.x - a.x) / length, y = (b.y - a.y) / length;
        right = right < i + 1 ? i + 1 : right;
        while (right < i + count &&
               dot_along(hull[(right + 1) % count], x, y) > dot_along(hull[right % count], x, y)) {
            ++right;
        }
        top = top < right ? right : top;
        while (top < i + count &&
               dot_along(hull[(top + 1) % count], -y, x) > dot_along(hull[top % count], -y, x)) {
            ++top;
        }
        left = left < top ? top : left;
        while (left < i + count &&
               dot_along(hull[(left + 1) % count], x, y) < dot_along(hull[left % count], x, y)) {
            ++left;
        }
        const double width = dot_along(hull[right % count], x, y) - dot_along(hull[left % count], x, y);
        const double height = dot_along(hull[top % count], -y, x) - dot_along(a, -y, x);
        if (width * height <
            least * 0.9999) { /* of boxes that are alike, the first: rounding tells nothing */
            least = width * height;
            best = (point){x, y};
        }
    }
    return best;
}

static void turn(vshi_patch *p, point along, double size[2]) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        const point at = {p->uv[v][0], p->uv[v][1]};
        p->uv[v][0] = dot_along(at, along.x, along.y);
        p->uv[v][1] = dot_along(at, -along.y, along.x);
        for (int k = 0; k < 2; ++k) {
            low[k] = p->uv[v][k] < low[k] ? p->uv[v][k] : low[k];
            high[k] = p->uv[v][k] > high[k] ? p->uv[v][k] : high[k];
        }
    }
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        p->uv[v][0] -= low[0];
        p->uv[v][1] -= low[1];
    }
    size[0] = high[0] - low[0];
    size[1] = high[1] - low[1];
}

vsh_result vshi_patch_straighten(vshi_patch *p, double size[2], vsh_error *error) {
    point *points = NULL, *hull = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&points, p->vertex_count, sizeof *points, "a chart's box", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&hull, 2 * (size_t)p->vertex_count + 2, sizeof *hull, "a chart's box", error));
    for (uint32_t v = 0; v < p->vertex_count; ++v) {
        points[v] = (point){p->uv[v][0], p->uv[v][1]};
    }
    qsort(points, p->vertex_count, sizeof *points, compare_points);
    turn(p, find_direction(hull, find_hull(points, p->vertex_count, hull)), size);
    if (size[1] > size[0]) {
        turn(p, (point){0.0, 1.0}, size);
    }
done:
    free(hull);
    free(points);
    return result;
}
