/* Spheres from a CSV file, and their shadows by the closest approach of the ray to the light (I. Quilez,
 * "sphere soft shadow", 2014). */
#include "spheres/spheres.h"

#include "base/decimal.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "light/view.h"
#include "table/table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- shadows */

/* A point within this many radii of a sphere's surface lies on it: receivers are made of floats. */
static const double ON_SURFACE = 1e-4;
/* Cosine beyond which the normal at a point on a sphere is the sphere's own: the sphere is below its horizon.
 */
static const double SAME_NORMAL = 0.999;

/* One light, seen from one point. */
typedef struct view {
    double origin[3];
    vshi_vec axis;
    vshi_vec normal; /* zero: none */
    double radius;   /* of the light's disc, a unit away; 0: a hard light */
    double far;
    double visible;
} view;

static bool is_inside(const double sphere[4], double distance) {
    return distance < sphere[3] * (1.0 - ON_SURFACE);
}

static bool meet_ray(void *user, const double sphere[4]) {
    view *v = user;
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(v->origin));
    const double distance = vshi_length(to), along = vshi_dot(to, v->axis);
    if (is_inside(sphere, distance)) {
        v->visible = 0.0;
        return false;
    }
    const bool stands_on =
        distance <= sphere[3] * (1.0 + ON_SURFACE) && vshi_dot(v->normal, to) < -SAME_NORMAL * distance;
    if (stands_on || !(along > 0.0) || distance - sphere[3] >= v->far) {
        return true;
    }
    const double miss = vshi_length(vshi_cross(to, v->axis)) - sphere[3];
    const double seen = miss < 0.0 ? 0.0 : v->radius > 0.0 ? miss / (v->radius * along) : 1.0;
    v->visible = fmin(v->visible, seen);
    return v->visible > 0.0;
}

/* False where the point is not finite, or has no normal where normals are given. */
static bool set_origin(view *v, const vsh_points *points, size_t i) {
    const double *position = points->positions + 3 * i;
    memcpy(v->origin, position, sizeof v->origin);
    if (points->normals != NULL) {
        v->normal = vshi_unit(vshi_vec_off(points->normals + 3 * i));
        if (!(vshi_dot(v->normal, v->normal) > 0.5)) {
            return false;
        }
    }
    return vshi_finite(vshi_vec_of(position));
}

void vshi_spheres_shadow(const vsh_spheres *spheres, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, float *visibility,
                         vsh_shade_stats *stats) {
    const bool hard = method == VSH_SHADOW_HARD;
    const vshi_light_place place = vshi_light_in_world(light);
    for (size_t i = begin; i < end; ++i) {
        float *value = &visibility[i - begin];
        view v = {.visible = 1.0};
        if (!set_origin(&v, points, i)) {
            *value = NAN;
            continue;
        }
        vshi_light_view seen;
        const vshi_light_side side = vshi_light_look(&place, vshi_vec_of(v.origin), hard, &seen);
        if (side != VSHI_LIGHT_SEEN) {
            *value = side == VSHI_LIGHT_WITHIN ? 1.0f : 0.0f;
            continue;
        }
        const double half = hard ? 0.0 : place.parallel ? place.half : vshi_asin(seen.sine);
        v.axis = seen.axis;
        v.far = vshi_light_end(&seen);
        v.radius = vshi_tan(half);
        const vshi_ball_cone cone = {{v.origin[0], v.origin[1], v.origin[2]},
                                     {v.axis.x, v.axis.y, v.axis.z},
                                     vshi_sin(half),
                                     vshi_cos(half),
                                     v.far};
        ++stats->marches;
        stats->samples += vshi_sphere_tree_search(spheres, &cone, meet_ray, &v);
        *value = (float)v.visible;
    }
}

static bool is_outside(void *user, const double sphere[4]) {
    view *v = user;
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(v->origin));
    v->visible = is_inside(sphere, vshi_length(to)) ? 0.0 : 1.0;
    return v->visible > 0.0;
}

bool vshi_spheres_hold(const vsh_spheres *spheres, const double position[3]) {
    view v = {.origin = {position[0], position[1], position[2]}, .visible = 1.0};
    /* a half space of no depth, so every bound around the point is searched */
    const vshi_ball_cone here = {{position[0], position[1], position[2]}, {1.0, 0.0, 0.0}, 1.0, 0.0, 0.0};
    vshi_sphere_tree_search(spheres, &here, is_outside, &v);
    return v.visible <= 0.0;
}

/* --- files */

enum { SHOWN = 47 }; /* bytes of a bad line */

/* The largest file that is read: 16 GiB. The list of its spheres is checked against the memory limit. */
static const uint64_t MOST_BYTES = (uint64_t)1 << 34;

typedef struct list {
    double *values;
    size_t count, capacity; /* of spheres */
} list;

/* Four numbers; false where the line is anything else. */
static bool read_row(const char *line, size_t size, double numbers[4]) {
    const char *at = line, *end = line + size;
    for (int k = 0; k < 4; ++k) {
        const vshi_field f = at <= end ? vshi_field_next(&at, end, VSHI_BETWEEN_ANY) : (vshi_field){end, end};
        if (!vshi_decimal_read(f.text, f.end, &numbers[k]) || isnan(numbers[k])) {
            return false;
        }
    }
    return at > end;
}

static vsh_result add(list *l, const double numbers[4], const char *path, const vsh_run *run,
                      vsh_error *error) {
    if (l->count == l->capacity) {
        const size_t capacity = l->capacity == 0 ? 1024 : 2 * l->capacity;
        void *grown = NULL;
        VSHI_TRY(vshi_check_limit(run, 48.0 * (double)capacity, path, error));
        VSHI_TRY(vshi_allocate(&grown, capacity, 4 * sizeof *l->values, path, error));
        if (l->count > 0) {
            memcpy(grown, l->values, l->count * 4 * sizeof *l->values);
        }
        free(l->values);
        l->values = grown;
        l->capacity = capacity;
    }
    memcpy(l->values + 4 * l->count++, numbers, 4 * sizeof *numbers);
    return VSH_OK;
}

/* Whether a line that is no sphere may name the columns. */
static bool is_header(char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '"';
}

static vsh_result read_rows(vshi_source *from, const vsh_run *run, list *l, vsh_error *error) {
    bool first = true;
    VSHI_TRY(vshi_source_pass_mark(from, error));
    for (size_t row = 1;; ++row) {
        const char *line;
        size_t size;
        double numbers[4];
        VSHI_TRY(vshi_source_line(from, &line, &size, error));
        if (line == NULL) {
            break;
        }
        if (vshi_line_is_empty(line, size)) {
            continue;
        }
        if (read_row(line, size, numbers)) {
            VSHI_TRY(vshi_sphere_check(numbers, from->name, row, error));
            VSHI_TRY(add(l, numbers, from->name, run, error));
        } else if (!first || !is_header(line[strspn(line, " \t")])) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s:%zu: '%.*s': expected four numbers: x, y, z, radius",
                             from->name, row, size < SHOWN ? (int)size : SHOWN, line);
        }
        first = false;
    }
    return l->count > 0 ? VSH_OK : vshi_fail(error, VSH_ERROR_INPUT, "%s: no spheres", from->name);
}

vsh_result vsh_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                            vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NUMBERS;
    VSHI_NEEDS(spheres);
    *spheres = NULL;
    VSHI_NEEDS(path);
    VSHI_NEEDS(count);
    *count = 0;
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vshi_source from;
    vshi_job *job = NULL;
    list l = {NULL, 0, 0};
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_source_open(path, MOST_BYTES, &from, error));
    from.job = job = vshi_job_begin(&full, "load", (size_t)from.size + 1);
    if (job == NULL) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path));
    }
    VSHI_TRY_DONE(read_rows(&from, &full, &l, error));
    if (vshi_job_advance(job, 1)) {
        VSHI_TRY_DONE(vshi_job_fail_cancelled(job, error));
    }
    *spheres = l.values;
    *count = l.count;
    l.values = NULL;
done:
    free(l.values);
    vshi_job_end(job);
    vshi_source_close(&from);
    return result;
}

void vsh_spheres_list_free(double *spheres) {
    free(spheres);
}
