/* Lists of spheres: a hierarchy of bounding spheres, shadows by the closest approach of the ray to the light
 * (I. Quilez, "sphere soft shadow", 2014), and files.
 *
 * A set is halved at the median along the longest side of its centres' box, until a block has eight parts, or
 * parts of at most eight spheres. */
#include "shapes/spheres.h"

#include "base/decimal.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/vec.h"
#include "io/table.h"
#include "light/light.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* --- the tree */

enum { BALLS = 8, DEPTH = 40 };

/* Centres are relative to the middle of all spheres; radii have room for floats' rounding. An unused lane has
 * a radius of -INFINITY. */
struct vshi_ball_block {
    float x[BALLS], y[BALLS], z[BALLS], radius[BALLS];
    int32_t below[BALLS]; /* ≥ 0: the block within; else ~number of the sphere itself */
};

/* A cone from a point, up to a distance. */
typedef struct ball_cone {
    double origin[3];
    double axis[3];      /* unit */
    double sine, cosine; /* its half angle is < 90°, or 90°: all above the plane */
    double far;
} ball_cone;

static const double LARGEST = 1e15;
static const size_t MOST = (size_t)1 << 30;
/* Relative rounding of a float's centre and of its squares, with room. */
static const double ROUNDING = 1e-6;

typedef struct part {
    size_t begin, end;
} part;

/* The box of a part's centres, with `radii` times their radii around them. */
static void find_box(double (*sphere)[4], part p, double radii, double low[3], double high[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = INFINITY;
        high[axis] = -INFINITY;
        for (size_t i = p.begin; i < p.end; ++i) {
            low[axis] = fmin(low[axis], sphere[i][axis] - radii * sphere[i][3]);
            high[axis] = fmax(high[axis], sphere[i][axis] + radii * sphere[i][3]);
        }
    }
}

static int longest_axis(double (*sphere)[4], part p) {
    double low[3], high[3];
    int longest = 0;
    find_box(sphere, p, 0.0, low, high);
    for (int axis = 1; axis < 3; ++axis) {
        longest = high[axis] - low[axis] > high[longest] - low[longest] ? axis : longest;
    }
    return longest;
}

static void swap(double *a, double *b) {
    double kept[4];
    memcpy(kept, a, sizeof kept);
    memcpy(a, b, sizeof kept);
    memcpy(b, kept, sizeof kept);
}

/* Moves the spheres that come first along the axis before `nth` (C. A. R. Hoare, "Find", 1961). */
static void part_at(double (*sphere)[4], part p, size_t nth, int axis) {
    ptrdiff_t low = (ptrdiff_t)p.begin, high = (ptrdiff_t)p.end - 1, at = (ptrdiff_t)nth;
    while (low < high) {
        const double pivot = sphere[low + (high - low) / 2][axis];
        ptrdiff_t i = low, j = high;
        while (i <= j) {
            for (; sphere[i][axis] < pivot; ++i) {
            }
            for (; sphere[j][axis] > pivot; --j) {
            }
            if (i <= j) {
                swap(sphere[i++], sphere[j--]);
            }
        }
        low = at > j ? i : low;
        high = at < i ? j : high;
    }
}

/* Cuts a range into at most BALLS parts; returns their number. */
static size_t cut(double (*sphere)[4], part all, part parts[BALLS]) {
    size_t count = 1;
    parts[0] = all;
    if (all.end - all.begin <= BALLS) {
        for (size_t i = all.begin; i < all.end; ++i) {
            parts[i - all.begin] = (part){i, i + 1};
        }
        return all.end - all.begin;
    }
    while (count < BALLS) {
        size_t largest = 0;
        for (size_t i = 1; i < count; ++i) {
            largest = parts[i].end - parts[i].begin > parts[largest].end - parts[largest].begin ? i : largest;
        }
        const part p = parts[largest];
        const size_t size = p.end - p.begin;
        if (size <= BALLS) {
            break;
        }
        /* whole blocks to the left, so that hardly any is half empty */
        const size_t left = size <= 2 * BALLS ? BALLS : (size / 2 + BALLS - 1) / BALLS * BALLS;
        part_at(sphere, p, p.begin + left, longest_axis(sphere, p));
        parts[largest] = (part){p.begin, p.begin + left};
        parts[count++] = (part){p.begin + left, p.end};
    }
    return count;
}

/* Bounds a part by a sphere around the middle of its box. `rounding` is in world units. */
static void bound(const vshi_spheres *made, double rounding, part p, vshi_ball_block *block, size_t lane) {
    double(*sphere)[4] = made->sphere;
    double low[3], high[3];
    find_box(sphere, p, 1.0, low, high);
    const vshi_vec centre = {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])};
    double radius = 0.0;
    for (size_t i = p.begin; i < p.end; ++i) {
        radius = fmax(radius, vshi_length(vshi_sub(vshi_vec_of(sphere[i]), centre)) + sphere[i][3]);
    }
    block->x[lane] = (float)(centre.x - made->middle[0]);
    block->y[lane] = (float)(centre.y - made->middle[1]);
    block->z[lane] = (float)(centre.z - made->middle[2]);
    block->radius[lane] = (float)(radius * (1.0 + ROUNDING) + rounding);
}

/* Builds the block of a part, and those below. Depth is log8 of the count. */
static vsh_result build(vshi_spheres *made, double rounding, part p, size_t *index, vsh_error *error) {
    part parts[BALLS];
    const size_t count = cut(made->sphere, p, parts);
    VSHI_TRY(vshi_make_room((void **)&made->block, made->block_count, &made->block_capacity,
                            sizeof *made->block, "spheres", error));
    *index = made->block_count++;
    for (size_t lane = 0; lane < BALLS; ++lane) {
        if (lane >= count) {
            made->block[*index].radius[lane] = -INFINITY;
            continue;
        }
        bound(made, rounding, parts[lane], &made->block[*index], lane);
        int32_t below = ~(int32_t)parts[lane].begin;
        if (parts[lane].end - parts[lane].begin > 1) {
            size_t child = 0;
            VSHI_TRY(build(made, rounding, parts[lane], &child, error));
            below = (int32_t)child;
        }
        made->block[*index].below[lane] = below;
    }
    return VSH_OK;
}

/* Checks a sphere's numbers. Messages name row `number` of the file `path`, or (NULL) sphere `number`. */
static vsh_result check_sphere(const double sphere[4], const char *path, size_t number, vsh_error *error) {
    static const char *const names[] = {"x", "y", "z", "radius"};
    for (int k = 0; k < 4; ++k) {
        if (!(fabs(sphere[k]) <= LARGEST) || (k == 3 && !(sphere[k] > 0.0))) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s%s%zu: %s %g is out of range %g%s … %g",
                             path != NULL ? path : "sphere", path != NULL ? ":" : " ", number, names[k],
                             sphere[k], k == 3 ? 0.0 : -LARGEST, k == 3 ? " (excluded)" : "", LARGEST);
        }
    }
    return VSH_OK;
}

static vsh_result check(const double *spheres, size_t count, const double *transform, double *scale,
                        vsh_error *error) {
    if (count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "spheres: there are none");
    }
    if (count > MOST) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "spheres: %zu are more than %zu", count, MOST);
    }
    VSHI_TRY(vshi_similarity_check(transform, "spheres", scale, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(check_sphere(spheres + 4 * i, NULL, i, error));
    }
    return VSH_OK;
}

static void place(vshi_spheres *made, const double *spheres, const double *transform, double scale) {
    vshi_spheres_info *info = &made->info;
    for (size_t i = 0; i < info->count; ++i) {
        double *s = made->sphere[i];
        vshi_vec_to_doubles(vshi_transform_point(transform, vshi_vec_of(spheres + 4 * i)), s);
        s[3] = scale * spheres[4 * i + 3];
    }
    find_box(made->sphere, (part){0, info->count}, 1.0, info->bounds_min, info->bounds_max);
    for (int axis = 0; axis < 3; ++axis) {
        made->middle[axis] = 0.5 * (info->bounds_min[axis] + info->bounds_max[axis]);
    }
}

static vsh_result make(vshi_spheres *made, const double *spheres, const double *transform, double scale,
                       vsh_error *error) {
    made->block_capacity = made->info.count / 5 + 4;
    VSHI_TRY(vshi_allocate((void **)&made->sphere, made->info.count, sizeof *made->sphere, "spheres", error));
    VSHI_TRY(
        vshi_allocate((void **)&made->block, made->block_capacity, sizeof *made->block, "spheres", error));
    place(made, spheres, transform, scale);
    double extent = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        extent = fmax(extent, made->info.bounds_max[axis] - made->info.bounds_min[axis]);
    }
    size_t top = 0;
    VSHI_TRY(build(made, ROUNDING * extent, (part){0, made->info.count}, &top, error));
    made->info.bytes =
        sizeof *made + made->info.count * sizeof *made->sphere + made->block_capacity * sizeof *made->block;
    return VSH_OK;
}

vsh_result vshi_spheres_create(const double *spheres, size_t count, const double *transform,
                               const vsh_run *run, vshi_spheres **made, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(made);
    VSHI_NEEDS_OF(count, spheres);
    double scale = 1.0;
    vshi_spheres *own = NULL;
    VSHI_TRY(check(spheres, count, transform, &scale, error));
    VSHI_TRY(vshi_check_limit(run, 100.0 * (double)count, "spheres", error));
    VSHI_TRY(vshi_allocate((void **)&own, 1, sizeof *own, "spheres", error));
    own->info.count = count;
    const vsh_result result = make(own, spheres, transform, scale, error);
    if (result != VSH_OK) {
        vshi_spheres_free(own);
        own = NULL;
    }
    *made = own;
    return result;
}

void vshi_spheres_free(vshi_spheres *spheres) {
    if (spheres != NULL) {
        free(spheres->block);
        free(spheres->sphere);
        free(spheres);
    }
}

void vshi_spheres_get_info(const vshi_spheres *spheres, vshi_spheres_info *info) {
    *info = spheres->info;
}

/* Handles a sphere that may be in the cone; false ends the search. */
typedef bool sphere_fn(void *user, const double sphere[4]);

/* Calls fn() for every sphere that touches the cone, and maybe for some that pass close by. Returns how many
 * bounds it has tested. */
static uint64_t search_cone(const vshi_spheres *spheres, const ball_cone *cone, sphere_fn *fn, void *user) {
    const float ox = (float)(cone->origin[0] - spheres->middle[0]),
                oy = (float)(cone->origin[1] - spheres->middle[1]),
                oz = (float)(cone->origin[2] - spheres->middle[2]);
    const float ax = (float)cone->axis[0], ay = (float)cone->axis[1], az = (float)cone->axis[2];
    const float sine = (float)cone->sine, cosine = (float)cone->cosine;
    const float far = (float)fmin(cone->far, 1e18);
    /* room for the rounding of the cone's origin */
    const float room = (float)ROUNDING * (fabsf(ox) + fabsf(oy) + fabsf(oz));
    int32_t stack[BALLS * DEPTH];
    int waiting = 0;
    uint64_t tested = 0;
    stack[waiting++] = 0;
    while (waiting > 0) {
        const vshi_ball_block *b = &spheres->block[stack[--waiting]];
        int32_t met[BALLS];
        tested += BALLS;
        for (int k = 0; k < BALLS; ++k) {
            const float x = b->x[k] - ox, y = b->y[k] - oy, z = b->z[k] - oz;
            const float along = x * ax + y * ay + z * az;
            const float cx = y * az - z * ay, cy = z * ax - x * az, cz = x * ay - y * ax;
            const float square = x * x + y * y + z * z, across = sqrtf(cx * cx + cy * cy + cz * cz);
            const float radius = b->radius[k] + room, reach = far + radius;
            met[k] = (across * cosine - along * sine <= radius + 1e-6f * across) & (along >= -radius) &
                     (square <= reach * reach) & (radius > 0.0f);
        }
        for (int k = 0; k < BALLS; ++k) {
            if (met[k] == 0) {
                continue;
            }
            if (b->below[k] >= 0) {
                stack[waiting++] = b->below[k];
            } else if (!fn(user, spheres->sphere[~b->below[k]])) {
                return tested;
            }
        }
    }
    return tested;
}

double vshi_spheres_distance(const vshi_spheres *spheres, const double position[3]) {
    struct {
        double bound;
        int32_t block;
    } stack[BALLS * DEPTH];
    int waiting = 0;
    double nearest = INFINITY;
    stack[waiting].bound = -INFINITY;
    stack[waiting++].block = 0;
    const vshi_vec p = vshi_sub(vshi_vec_of(position), vshi_vec_of(spheres->middle));
    while (waiting > 0) {
        --waiting;
        if (stack[waiting].bound >= nearest) {
            continue;
        }
        const vshi_ball_block *b = &spheres->block[stack[waiting].block];
        const int first = waiting;
        for (int k = 0; k < BALLS; ++k) {
            const vshi_vec to = {(double)b->x[k] - p.x, (double)b->y[k] - p.y, (double)b->z[k] - p.z};
            /* wide enough for the rounding of floats; infinite for an unused lane */
            const double bound = vshi_length(to) - (double)b->radius[k];
            if (bound >= nearest) {
                continue;
            }
            if (b->below[k] < 0) {
                const double *s = spheres->sphere[~b->below[k]];
                nearest = fmin(nearest, vshi_length(vshi_sub(vshi_vec_of(s), vshi_vec_of(position))) - s[3]);
                continue;
            }
            int at = waiting++; /* nearest on top */
            for (; at > first && stack[at - 1].bound < bound; --at) {
                stack[at] = stack[at - 1];
            }
            stack[at].bound = bound;
            stack[at].block = b->below[k];
        }
    }
    return nearest;
}

/* --- shadows */

/* A point within this many radii of a sphere's surface lies on it, as receivers are floats. */
static const double ON_SURFACE = 1e-4;
/* Cosine beyond which the normal at a point on a sphere is the sphere's: the sphere is below its horizon. */
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

/* Returns false for a point that is not finite, or lacks a given normal. */
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

void vshi_spheres_shadow(const vshi_spheres *spheres, const vsh_light *light, int32_t method,
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
        const ball_cone cone = {{v.origin[0], v.origin[1], v.origin[2]},
                                {v.axis.x, v.axis.y, v.axis.z},
                                vshi_sin(half),
                                vshi_cos(half),
                                v.far};
        ++stats->marches;
        stats->samples += search_cone(spheres, &cone, meet_ray, &v);
        *value = (float)v.visible;
    }
}

static bool is_outside(void *user, const double sphere[4]) {
    view *v = user;
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(v->origin));
    v->visible = is_inside(sphere, vshi_length(to)) ? 0.0 : 1.0;
    return v->visible > 0.0;
}

bool vshi_spheres_hold(const vshi_spheres *spheres, const double position[3]) {
    view v = {.origin = {position[0], position[1], position[2]}, .visible = 1.0};
    /* a half space of no depth: tests every bound around the point */
    const ball_cone here = {{position[0], position[1], position[2]}, {1.0, 0.0, 0.0}, 1.0, 0.0, 0.0};
    search_cone(spheres, &here, is_outside, &v);
    return v.visible <= 0.0;
}

/* --- files */

enum { SHOWN = 47 }; /* bytes of a bad line */

/* The largest file: 16 GiB. The list of its spheres is checked against the memory limit. */
static const uint64_t MOST_BYTES = (uint64_t)1 << 34;

typedef struct list {
    double (*values)[4];
    size_t count, capacity;
} list;

/* Reads four numbers; false if the line is anything else. */
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
    if (l->count == l->capacity) { /* with the old list while it is copied */
        VSHI_TRY(vshi_check_limit(run, 1.5 * sizeof *l->values * 2.0 * (double)l->capacity, path, error));
    }
    VSHI_TRY(vshi_make_room((void **)&l->values, l->count, &l->capacity, sizeof *l->values, path, error));
    memcpy(l->values[l->count++], numbers, sizeof *l->values);
    return VSH_OK;
}

/* Whether a line that is no sphere may name the columns. */
static bool is_header(char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '"';
}

static vsh_result read_rows(vshi_source *from, const vsh_run *run, list *l, vsh_error *error) {
    bool first = true;
    VSHI_TRY(vshi_source_skip_mark(from, error));
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
            VSHI_TRY(check_sphere(numbers, from->name, row, error));
            VSHI_TRY(add(l, numbers, from->name, run, error));
        } else if (!first || !is_header(line[strspn(line, " \t")])) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s:%zu: '%.*s': expected four numbers: x, y, z, radius",
                             from->name, row, size < SHOWN ? (int)size : SHOWN, line);
        }
        first = false;
    }
    return l->count > 0 ? VSH_OK : vshi_fail(error, VSH_ERROR_INPUT, "%s: no spheres", from->name);
}

vsh_result vshi_spheres_read(const char *path, const vsh_run *run, double **spheres, size_t *count,
                             vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NUMBERS;
    *spheres = NULL;
    *count = 0;
    vshi_source from;
    vshi_job *job = NULL;
    list l = {NULL, 0, 0};
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_source_open(path, MOST_BYTES, &from, error));
    VSHI_TRY_DONE(vshi_job_open(&job, run, "load", (size_t)from.size + 1, path, error));
    from.job = job;
    VSHI_TRY_DONE(read_rows(&from, run, &l, error));
    VSHI_TRY_DONE(vshi_job_step(job, 1, error));
    *spheres = l.values[0];
    *count = l.count;
    l.values = NULL;
done:
    free(l.values);
    vshi_job_end(job);
    vshi_source_close(&from);
    return result;
}
