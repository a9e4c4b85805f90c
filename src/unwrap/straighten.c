/* The least box around a chart: one of its sides runs along the convex hull (Freeman and Shapira,
 * "Determining the minimum-area encasing rectangle for an arbitrary closed curve", 1975). */
#include "base/memory.h"
#include "base/try.h"
#include "unwrap/mask.h"

#include <stdlib.h>

static const double BOX = 0.9;      /* share of its box that a chart fills at least to be fitted to texels */
static const double MOST_FIT = 1.3; /* factor by which that may change a side */
/* Texels by which the borders of such a chart lie beyond the centres of its outermost texels: rays that began
 * on the very border would begin on what stands there. */
static const double BEYOND = 0.1;
static const double ROOM = 1e-9; /* texels: a border that is so near to a texel's is on it */

enum { FARTHEST = 1 << 24 }; /* texels: no page is so large */

static int32_t whole(double x) {
    return x < 1.0 ? 1 : x > FARTHEST ? FARTHEST : (int32_t)x;
}

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

/* Cosines and sines of the angles. */
static const double TURNS[VSHI_ANGLES][2] = {{1.0, 0.0},
                                             {0.98078528040323043, 0.19509032201612828},
                                             {0.92387953251128676, 0.38268343236508977},
                                             {0.83146961230254524, 0.55557023301960218},
                                             {0.70710678118654752, 0.70710678118654752},
                                             {0.55557023301960218, 0.83146961230254524},
                                             {0.38268343236508977, 0.92387953251128676},
                                             {0.19509032201612828, 0.98078528040323043}};

static void measure_boxes(const vshi_patch *p, vshi_boxes *boxes) {
    for (int a = 0; a < VSHI_ANGLES; ++a) {
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (uint32_t v = 0; v < p->vertex_count; ++v) {
            const double *uv = p->uv[v];
            const double at[2] = {TURNS[a][0] * uv[0] - TURNS[a][1] * uv[1],
                                  TURNS[a][1] * uv[0] + TURNS[a][0] * uv[1]};
            for (int k = 0; k < 2; ++k) {
                low[k] = at[k] < low[k] ? at[k] : low[k];
                high[k] = at[k] > high[k] ? at[k] : high[k];
            }
        }
        for (int k = 0; k < 2; ++k) {
            boxes->low[a][k] = low[k];
            boxes->size[a][k] = high[k] - low[k];
        }
    }
}

vsh_result vshi_patch_straighten(vshi_patch *p, vshi_boxes *boxes, vsh_error *error) {
    point *points = NULL, *hull = NULL;
    double size[2];
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
    measure_boxes(p, boxes);
done:
    free(hull);
    free(points);
    return result;
}

bool vshi_patch_is_box(const vshi_patch *p, const vshi_boxes *boxes) {
    return p->area > BOX * boxes->size[0][0] * boxes->size[0][1];
}

vshi_fit vshi_mask_fit(const vshi_patch *p, const vshi_boxes *boxes, int angle, double density,
                       double max_stretch) {
    vshi_fit fit = {.uneven = 1.0};
    double factor[2];
    int32_t texels[2];
    bool fits = angle == 0 && !p->kept && vshi_patch_is_box(p, boxes);
    for (int k = 0; k < 2; ++k) {
        const double length = boxes->size[angle][k] * density;
        texels[k] = whole(floor(length + 0.5));
        factor[k] = (texels[k] + 2.0 * BEYOND) / length;
        fits = fits && factor[k] < MOST_FIT && factor[k] > 1.0 / MOST_FIT;
    }
    const double uneven = factor[0] / factor[1]; /* isometric but for this it stretches by the root of … */
    fits = fits && p->stretch * sqrt(0.5 * (uneven + 1.0 / uneven)) < max_stretch;
    fit.uneven = fits ? uneven : 1.0;
    int32_t *sides[2] = {&fit.width, &fit.height};
    for (int k = 0; k < 2; ++k) {
        const double length = boxes->size[angle][k] * density, scale = fits ? density * factor[k] : density;
        *sides[k] = fits ? texels[k] + 1 : whole(ceil(length - ROOM));
        fit.offset[k] = (fits ? 0.5 - BEYOND : 0.5 * (*sides[k] - length)) - scale * boxes->low[angle][k];
        fit.matrix[k][0] = scale * TURNS[angle][k];
        fit.matrix[k][1] = scale * (k == 0 ? -TURNS[angle][1] : TURNS[angle][0]);
    }
    return fit;
}
