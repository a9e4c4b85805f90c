#include "outline/outline.h"

#include "base/floats.h"
#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const size_t MAX_POINTS = (size_t)1 << 31;
/* Bytes that an outline takes while it is made, for each of its points: points, tree, and what is cut. */
static const double BYTES_PER_POINT = 96.0;

/* --- contours */

void vshi_contours_free(vshi_contours *c) {
    free(c->points);
    free(c->starts);
    c->points = NULL;
    c->starts = NULL;
    c->point_count = c->point_capacity = c->contour_count = c->contour_capacity = 0;
}

static bool fails(vshi_contours *c, vsh_result result) {
    c->result = c->result == VSH_OK ? result : c->result;
    return result != VSH_OK;
}

bool vshi_contours_reserve(vshi_contours *c, void *array, size_t size, size_t count, size_t *capacity,
                           double bytes) {
    if (count < *capacity) {
        return true;
    }
    const size_t grown = *capacity == 0 ? 1024 : 2 * *capacity;
    if (grown > 2 * MAX_POINTS) {
        fails(c, vshi_fail(c->error, VSH_ERROR_LIMIT, "outline: more than %zu points", MAX_POINTS));
        return false;
    }
    if (fails(c, vshi_check_limit(c->run, bytes * (double)grown, "outline", c->error))) {
        return false;
    }
    void **place = array;
    void *memory = realloc(*place, grown * size);
    if (memory == NULL) {
        fails(c,
              vshi_fail(c->error, VSH_ERROR_MEMORY, "outline: the system refused %zu bytes", grown * size));
        return false;
    }
    *place = memory;
    *capacity = grown;
    return true;
}

static size_t contour_begin(const vshi_contours *c) {
    return c->contour_count > 0 ? c->starts[c->contour_count] : 0;
}

void vshi_contours_add(vshi_contours *c, double x, double y) {
    if (c->result != VSH_OK || !vshi_contours_reserve(c, &c->points, sizeof *c->points, c->point_count,
                                                      &c->point_capacity, BYTES_PER_POINT)) {
        return;
    }
    if (!(fabs(x) <= VSHI_OUTLINE_LARGEST && fabs(y) <= VSHI_OUTLINE_LARGEST)) {
        fails(c, vshi_fail(c->error, VSH_ERROR_INPUT,
                           "outline: a point at (%.9g, %.9g): expected at most %g in size", x, y,
                           VSHI_OUTLINE_LARGEST));
        return;
    }
    if (c->point_count > contour_begin(c)) {
        const vshi_point last = c->points[c->point_count - 1];
        if (last.x == x && last.y == y) {
            return;
        }
    }
    c->points[c->point_count++] = (vshi_point){x, y};
}

void vshi_contours_close(vshi_contours *c) {
    const size_t begin = contour_begin(c);
    if (c->result != VSH_OK || c->point_count == begin) {
        return;
    }
    const vshi_point start = c->points[begin], last = c->points[c->point_count - 1];
    const bool closed = start.x == last.x && start.y == last.y;
    if (c->point_count - begin - (closed ? 1 : 0) < 3) {
        c->point_count = begin;
        return;
    }
    if (!closed) {
        vshi_contours_add(c, start.x, start.y);
    }
    if (c->result != VSH_OK || !vshi_contours_reserve(c, &c->starts, sizeof *c->starts, c->contour_count + 1,
                                                      &c->contour_capacity, BYTES_PER_POINT)) {
        return;
    }
    c->starts[0] = 0;
    c->starts[++c->contour_count] = (uint32_t)c->point_count;
    if (c->point_count > MAX_POINTS) {
        fails(c, vshi_fail(c->error, VSH_ERROR_LIMIT, "outline: more than %zu points", MAX_POINTS));
    }
}

/* --- outlines */

/* Twice the area, measured from the contour's first point so that little is lost far from the origin. */
static double contour_area(const vshi_point *points, size_t count) {
    double sum = 0.0;
    for (size_t i = 1; i + 1 < count; ++i) {
        const vshi_point o = points[0], a = points[i], b = points[i + 1];
        sum += (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
    }
    return sum;
}

static double area_of(const vsh_outline *o) {
    double sum = 0.0;
    for (size_t c = 0; c < o->contour_count; ++c) {
        sum += contour_area(o->points + o->starts[c], o->starts[c + 1] - o->starts[c]);
    }
    return 0.5 * sum;
}

/* The area to the left of every contour, where the contours agree in it. */
static void orient(vsh_outline *o) {
    o->area = area_of(o);
    if (o->area >= 0.0) {
        return;
    }
    o->area = -o->area;
    for (size_t c = 0; c < o->contour_count; ++c) {
        for (size_t i = o->starts[c], k = o->starts[c + 1] - 1; i < k; ++i, --k) {
            const vshi_point swapped = o->points[i];
            o->points[i] = o->points[k];
            o->points[k] = swapped;
        }
    }
}

/* Takes the contours over, and plants the tree; *outline stays NULL where there are none. */
static vsh_result make(vshi_contours *c, vsh_outline **outline) {
    vsh_outline *made = NULL;
    vsh_result result;
    VSHI_TRY_DONE(c->result);
    if (c->contour_count == 0) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "outline", c->error));
    made->points = c->points;
    made->starts = c->starts;
    made->contour_count = c->contour_count;
    c->points = NULL;
    c->starts = NULL;
    orient(made);
    VSHI_TRY_DONE(vshi_outline_grow_tree(made, c->error));
    *outline = made;
    made = NULL;
done:
    vsh_outline_free(made);
    vshi_contours_free(c);
    return result;
}

/* Puts an outline whose contours neither cross nor overlap in the place of one, unless rounding left no such.
 */
static vsh_result resolve(vshi_contours *c, vsh_outline **outline) {
    vshi_contours resolved = {.run = c->run, .error = c->error};
    const bool fits = vshi_outline_resolve(*outline, &resolved);
    if (resolved.result == VSH_OK && !fits) {
        vshi_contours_free(&resolved);
        return VSH_OK;
    }
    vsh_outline_free(*outline);
    *outline = NULL;
    return make(&resolved, outline);
}

vsh_result vshi_contours_finish(vshi_contours *c, bool clean, const char *what, vsh_outline **outline) {
    *outline = NULL;
    VSHI_TRY(make(c, outline));
    if (*outline != NULL && !clean) {
        VSHI_TRY(resolve(c, outline));
    }
    if (*outline == NULL || !((*outline)->area > 0.0)) {
        vsh_outline_free(*outline);
        *outline = NULL;
        return vshi_fail(c->error, VSH_ERROR_INPUT, "%s: has no outline: nothing in it is solid", what);
    }
    return VSH_OK;
}

void vsh_outline_free(vsh_outline *o) {
    if (o == NULL) {
        return;
    }
    free(o->nodes);
    free(o->starts);
    free(o->points);
    free(o);
}

vsh_result vsh_outline_from_polygons(const double *points, const size_t *counts, size_t contour_count,
                                     const vsh_run *run, vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(outline);
    *outline = NULL;
    VSHI_NEEDS_OF(contour_count, points);
    VSHI_NEEDS_OF(contour_count, counts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_contours contours = {.run = &full, .error = error};
    for (size_t c = 0; c < contour_count; ++c) {
        for (size_t i = 0; i < counts[c]; ++i, points += 2) {
            vshi_contours_add(&contours, points[0], points[1]);
        }
        vshi_contours_close(&contours);
    }
    return vshi_contours_finish(&contours, false, "polygons", outline);
}

vsh_result vsh_outline_unite(const vsh_outline_instance *instances, size_t instance_count, const vsh_run *run,
                             vsh_outline **outline, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(outline);
    *outline = NULL;
    if (instances == NULL || instance_count == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_outline_unite: no instances");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    static const double identity[6] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    vshi_contours contours = {.run = &full, .error = error};
    for (size_t i = 0; i < instance_count; ++i) {
        const vsh_outline *o = instances[i].outline;
        const double *m = instances[i].transform != NULL ? instances[i].transform : identity;
        const double determinant = m[0] * m[4] - m[1] * m[3];
        if (o == NULL || !isfinite(determinant) || determinant == 0.0 || !isfinite(m[2]) || !isfinite(m[5])) {
            vshi_contours_free(&contours);
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_outline_unite: instance %zu: %s", i,
                             o == NULL ? "no outline" : "a transform that flattens or is not finite");
        }
        for (size_t c = 0; c < o->contour_count; ++c) {
            /* a mirrored contour runs backwards, so that what it bounds winds the same way as the others */
            const size_t begin = o->starts[c], end = o->starts[c + 1] - 1;
            for (size_t k = begin; k < end; ++k) {
                const vshi_point p = o->points[determinant > 0.0 ? k : end - (k - begin)];
                vshi_contours_add(&contours, m[0] * p.x + m[1] * p.y + m[2], m[3] * p.x + m[4] * p.y + m[5]);
            }
            vshi_contours_close(&contours);
        }
    }
    return vshi_contours_finish(&contours, instance_count == 1, "outlines", outline);
}

void vsh_outline_get_info(const vsh_outline *o, vsh_outline_info *info) {
    const size_t points = o->starts[o->contour_count];
    vsh_outline_info found = {.contours = o->contour_count,
                              .points = points - o->contour_count,
                              .area = o->area,
                              .bytes = points * sizeof *o->points + o->node_count * sizeof *o->nodes +
                                       (o->contour_count + 1) * sizeof *o->starts + sizeof *o};
    memcpy(found.bounds_min, o->nodes[0].low, sizeof found.bounds_min);
    memcpy(found.bounds_max, o->nodes[0].high, sizeof found.bounds_max);
    *info = found;
}

_Static_assert(sizeof(vshi_point) == 2 * sizeof(double), "points are handed out as pairs of doubles");

const double *vsh_outline_contour(const vsh_outline *o, size_t index, size_t *count) {
    const bool there = index < o->contour_count;
    *count = there ? o->starts[index + 1] - o->starts[index] - 1 : 0;
    return there ? &o->points[o->starts[index]].x : NULL;
}

double vsh_outline_distance(const vsh_outline *o, const double point[2]) {
    VSHI_FLOATS;
    const vshi_point p = {point[0], point[1]};
    if (!isfinite(p.x) || !isfinite(p.y)) {
        return NAN;
    }
    const double distance = sqrt(vshi_outline_square(o, p, INFINITY));
    return vshi_outline_winding(o, p) != 0 ? -distance : distance;
}
