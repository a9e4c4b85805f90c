/* Light maps of a plane, texel by texel, and the exact share of a light that a point sees.
 *
 * In the light's frame, x points from the point to the light's centre. A direction is its slope y/x, and the
 * light covers the slopes -w … w. Every piece of the outline before the light hides an interval of slopes:
 * all between its two ends, whatever its shape. So a walk down the outline's tree hides the ends of each
 * piece first, and then enters only halves whose box reaches beyond the hidden slopes. It finds a contour's
 * extremes in logarithmic time. The share is the sum of the angles between the hidden intervals, so it is
 * exact. */
#include "flat/flat.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "light/light.h"
#include "lightmap/padding.h"
#include "shapes/outline.h"

#include <vdbshade/picture.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_SIZE = 65536, MAX_SUPERSAMPLE = 16, MAX_SAMPLES = MAX_SUPERSAMPLE * MAX_SUPERSAMPLE };
enum { MAX_INTERVALS = 64, MAX_HALVINGS = 48 };

/* A light as seen from a point. */
typedef struct view {
    vshi_point point;
    vshi_point towards; /* unit, to the light's centre */
    double distance;    /* to the centre; infinite for a directional light */
    double radius;
    double slope; /* tangent of half the light's angle; 0: a hard light */
} view;

typedef struct interval {
    double low, high;
} interval;

typedef struct hiding {
    const vsh_outline *casters;
    const view *view;
    double low, high;               /* slopes to examine */
    double sure2;                   /* squared distance up to which everything lies before the light */
    double tangent2;                /* squared length of the tangents to the light's disc */
    vshi_point above, below;        /* normals, world, of the directions `high` and `low`, out of the cone */
    interval hidden[MAX_INTERVALS]; /* sorted, disjoint */
    size_t count;
    bool overflow;
} hiding;

/* Moves a point into the light's frame. */
static vshi_point to_light(const view *v, vshi_point p) {
    const double x = p.x - v->point.x, y = p.y - v->point.y;
    return (vshi_point){x * v->towards.x + y * v->towards.y, y * v->towards.x - x * v->towards.y};
}

static vshi_point unit_normal(const view *v, double slope, double sign) {
    const double length = sqrt(1.0 + slope * slope);
    const double x = -sign * slope / length, y = sign / length; /* in the light's frame */
    return (vshi_point){x * v->towards.x - y * v->towards.y, x * v->towards.y + y * v->towards.x};
}

/* The same limits as in 3D (light/light.h). */
static double limit_slope(double tangent) {
    return tangent < VSHI_LEAST_SINE ? 0.0 : fmin(tangent, VSHI_LARGEST_TANGENT);
}

/* False if the point is in the light's disc, and sees all of it. */
static bool find_view(const vsh_light *light, vshi_point point, view *v) {
    v->point = point;
    if (light->type == VSH_LIGHT_DIRECTIONAL) {
        const double length = vshi_hypot(light->direction[0], light->direction[1]);
        v->towards = (vshi_point){light->direction[0] / length, light->direction[1] / length};
        v->distance = INFINITY;
        v->radius = 0.0;
        v->slope = limit_slope(vshi_tan(0.5 * light->angle));
        return true;
    }
    const double x = light->position[0] - point.x, y = light->position[1] - point.y;
    const double d = v->distance = vshi_hypot(x, y), r = v->radius = light->radius;
    if (!(d > r)) {
        v->towards = (vshi_point){0.0, 0.0};
        v->slope = INFINITY;
        return false;
    }
    v->towards = (vshi_point){x / d, y / d};
    v->slope = limit_slope(r / sqrt((d - r) * (d + r))); /* d² - r² would cancel next to the light */
    return true;
}

/* --- intervals */

static bool is_hidden(const hiding *h, double low, double high) {
    for (size_t i = 0; i < h->count; ++i) {
        if (h->hidden[i].high >= high) {
            return h->hidden[i].low <= low;
        }
    }
    return false;
}

static bool all_hidden(const hiding *h) {
    return h->count == 1 && h->hidden[0].low <= h->low && h->hidden[0].high >= h->high;
}

static void hide(hiding *h, double low, double high) {
    low = low > h->low ? low : h->low;
    high = high < h->high ? high : h->high;
    if (!(low < high)) {
        return;
    }
    size_t first = 0;
    while (first < h->count && h->hidden[first].high < low) {
        ++first;
    }
    size_t last = first; /* it touches the intervals first … last - 1 */
    while (last < h->count && h->hidden[last].low <= high) {
        low = h->hidden[last].low < low ? h->hidden[last].low : low;
        high = h->hidden[last].high > high ? h->hidden[last].high : high;
        ++last;
    }
    if (first == last && h->count == MAX_INTERVALS) {
        h->overflow = true;
        return;
    }
    memmove(h->hidden + first + 1, h->hidden + last, (h->count - last) * sizeof *h->hidden);
    h->count = h->count + 1 - (last - first);
    h->hidden[first] = (interval){low, high};
}

/* --- pieces of the outline */

static double dot(vshi_point a, vshi_point b) {
    return a.x * b.x + a.y * b.y;
}

/* Interpolates from a to b. At 1 it is exactly b, where the next segment begins. */
static vshi_point interpolate(vshi_point a, vshi_point b, double t) {
    return t >= 1.0 ? b : (vshi_point){a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
}

/* A part of a segment, by places along it. */
typedef struct part {
    double from, to;
    double from_slope, to_slope; /* of the cone's edges; NAN: not at an edge */
} part;

/* Hides a part that is wholly in the cone and outside the light's disc. */
static void hide_part(hiding *h, vshi_point a, vshi_point b, part w) {
    const vshi_point middle = interpolate(a, b, 0.5 * (w.from + w.to));
    const vshi_point p = interpolate(a, b, w.from), q = interpolate(a, b, w.to);
    if (!(w.from < w.to) || dot(middle, middle) >= h->tangent2 || !(p.x > 0.0 && q.x > 0.0)) {
        return; /* behind the light, or the point is on the segment */
    }
    const double s = isnan(w.from_slope) ? p.y / p.x : w.from_slope;
    const double e = isnan(w.to_slope) ? q.y / q.x : w.to_slope;
    hide(h, s < e ? s : e, s < e ? e : s);
}

/* Clips a part to one side of the cone's edge with this slope. at_a and at_b are the signed heights of the
 * segment's ends over the edge: positive is outside. */
static bool clip(double at_a, double at_b, double slope, part *w) {
    if (at_a > 0.0 && at_b > 0.0) {
        return false;
    }
    const double t = at_a / (at_a - at_b);
    if (at_a > 0.0 && t > w->from) {
        w->from = t;
        w->from_slope = slope;
    } else if (at_b > 0.0 && t < w->to) {
        w->to = t;
        w->to_slope = slope;
    }
    return w->from < w->to;
}

static void hide_segment(hiding *h, vshi_point from, vshi_point to) {
    const view *v = h->view;
    const vshi_point a = to_light(v, from), b = to_light(v, to);
    part whole = {0.0, 1.0, NAN, NAN};
    if (!clip(a.y - h->high * a.x, b.y - h->high * b.x, h->high, &whole) ||
        !clip(h->low * a.x - a.y, h->low * b.x - b.y, h->low, &whole)) {
        return;
    }
    if (dot(a, a) < h->sure2 && dot(b, b) < h->sure2) {
        hide_part(h, a, b, whole);
        return;
    }
    /* without the part in the light's disc: |a + t d - c|² = r² */
    const vshi_point d = {b.x - a.x, b.y - a.y}, c = {a.x - v->distance, a.y};
    const double dd = dot(d, d), dc = dot(d, c), rest = dot(c, c) - v->radius * v->radius;
    const double root2 = dc * dc - dd * rest;
    if (!(dd > 0.0) || !(root2 > 0.0)) {
        hide_part(h, a, b, whole);
        return;
    }
    const double root = sqrt(root2), enters = (-dc - root) / dd, leaves = (-dc + root) / dd;
    const bool before = enters<whole.to, after = leaves> whole.from;
    hide_part(
        h, a, b,
        (part){whole.from, before ? enters : whole.to, whole.from_slope, before ? NAN : whole.to_slope});
    hide_part(h, a, b,
              (part){after ? leaves : whole.from, whole.to, after ? NAN : whole.from_slope, whole.to_slope});
}

/* Slopes that a node's box may still hide. */
typedef enum reach {
    NOTHING,
    PARTS,
    WHOLE /* the whole box lies before the point and before the light */
} reach;

static reach classify_box(const hiding *h, const vshi_outline_node *node) {
    const view *v = h->view;
    const vshi_point half = {0.5 * (node->high[0] - node->low[0]), 0.5 * (node->high[1] - node->low[1])};
    const vshi_point middle = {node->low[0] + half.x - v->point.x, node->low[1] + half.y - v->point.y};
    const double up = half.x * fabs(h->above.x) + half.y * fabs(h->above.y);
    const double down = half.x * fabs(h->below.x) + half.y * fabs(h->below.y);
    if (dot(middle, h->above) - up >= 0.0 || dot(middle, h->below) - down >= 0.0) {
        return NOTHING;
    }
    const double nearx = fmax(fabs(middle.x) - half.x, 0.0), neary = fmax(fabs(middle.y) - half.y, 0.0);
    if (nearx * nearx + neary * neary >= h->tangent2) {
        return NOTHING;
    }
    const double x = dot(middle, v->towards);
    const double depth = half.x * fabs(v->towards.x) + half.y * fabs(v->towards.y);
    if (x + depth <= 0.0) {
        return NOTHING;
    }
    if (!(x - depth > 0.0)) {
        return PARTS;
    }
    const vshi_point along_x = {half.x * v->towards.x, -half.x * v->towards.y};
    const vshi_point along_y = {half.y * v->towards.y, half.y * v->towards.x};
    const double y = middle.y * v->towards.x - middle.x * v->towards.y;
    double low = INFINITY, high = -INFINITY;
    for (int corner = 0; corner < 4; ++corner) {
        const double sx = corner & 1 ? 1.0 : -1.0, sy = corner & 2 ? 1.0 : -1.0;
        const double slope = (y + sx * along_x.y + sy * along_y.y) / (x + sx * along_x.x + sy * along_y.x);
        low = slope < low ? slope : low;
        high = slope > high ? slope : high;
    }
    if (is_hidden(h, low > h->low ? low : h->low, high < h->high ? high : h->high)) {
        return NOTHING;
    }
    const double farx = fabs(middle.x) + half.x, fary = fabs(middle.y) + half.y;
    return farx * farx + fary * fary < h->sure2 ? WHOLE : PARTS;
}

static void hide_outline(hiding *h) {
    const vsh_outline *o = h->casters;
    uint32_t stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top++] = 0;
    while (top > 0 && !h->overflow) {
        const vshi_outline_node *node = &o->nodes[stack[--top]];
        const reach reached = classify_box(h, node);
        if (reached == NOTHING) {
            continue;
        }
        if (node->count > 0 && reached == WHOLE) {
            const vshi_point a = to_light(h->view, o->points[node->first]);
            const vshi_point b = to_light(h->view, o->points[node->first + node->count]);
            const double s = a.y / a.x, e = b.y / b.x;
            hide(h, s < e ? s : e, s < e ? e : s);
        }
        if (node->children != 0) {
            stack[top++] = node->children + 1;
            stack[top++] = node->children;
        } else {
            for (uint32_t i = node->first; i < node->first + node->count; ++i) {
                hide_segment(h, o->points[i], o->points[i + 1]);
            }
        }
        if (all_hidden(h)) {
            return;
        }
    }
}

/* Finds the free angle between the slopes low and high. */
static double find_free_angle(hiding *h, double low, double high, int halvings) {
    h->low = low;
    h->high = high;
    h->above = unit_normal(h->view, high, 1.0);
    h->below = unit_normal(h->view, low, -1.0);
    h->count = 0;
    h->overflow = false;
    hide_outline(h);
    const double from = vshi_atan(low), to = vshi_atan(high);
    if (h->overflow && halvings < MAX_HALVINGS) {
        const double middle = vshi_tan(0.5 * (from + to));
        return find_free_angle(h, low, middle, halvings + 1) + find_free_angle(h, middle, high, halvings + 1);
    }
    if (h->count == 0) {
        return to - from;
    }
    double sum = 0.0, at = from;
    for (size_t i = 0; i < h->count; ++i) {
        sum += fmax(0.0, vshi_atan(h->hidden[i].low) - at);
        at = vshi_atan(h->hidden[i].high);
    }
    return sum + fmax(0.0, to - at);
}

/* Whether nothing lies between the point and the light's centre. */
static bool sees_centre(const vsh_outline *casters, const view *v) {
    if (casters == NULL) {
        return true;
    }
    const vshi_point beside = {-v->towards.y, v->towards.x};
    uint32_t stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const vshi_outline_node *node = &casters->nodes[stack[--top]];
        const vshi_point half = {0.5 * (node->high[0] - node->low[0]), 0.5 * (node->high[1] - node->low[1])};
        const vshi_point middle = {node->low[0] + half.x - v->point.x, node->low[1] + half.y - v->point.y};
        const double x = dot(middle, v->towards), y = dot(middle, beside);
        const double depth = half.x * fabs(v->towards.x) + half.y * fabs(v->towards.y);
        const double breadth = half.x * fabs(beside.x) + half.y * fabs(beside.y);
        if (fabs(y) > breadth || x + depth <= 0.0 || x - depth >= v->distance) {
            continue;
        }
        if (node->children != 0) {
            stack[top++] = node->children + 1;
            stack[top++] = node->children;
            continue;
        }
        for (uint32_t i = node->first; i < node->first + node->count; ++i) {
            const vshi_point a = to_light(v, casters->points[i]), b = to_light(v, casters->points[i + 1]);
            if ((a.y <= 0.0) == (b.y <= 0.0)) {
                continue;
            }
            const double meeting = a.x + (b.x - a.x) * (a.y / (a.y - b.y));
            if (meeting > 0.0 && meeting < v->distance) {
                return false;
            }
        }
    }
    return true;
}

/* Finds the visible share of the light's angle, 0 … 1; of a hard light 0 or 1. Takes 4 KB of the stack. */
static double find_visible(const vsh_outline *casters, const view *v) {
    if (casters == NULL) {
        return 1.0;
    }
    if (!(v->slope > 0.0)) {
        return sees_centre(casters, v) ? 1.0 : 0.0;
    }
    const double before = v->distance - v->radius;
    hiding h = {.casters = casters,
                .view = v,
                .sure2 = before * before,
                .tangent2 = before * (v->distance + v->radius)};
    const double share = find_free_angle(&h, -v->slope, v->slope, 0) / (2.0 * vshi_atan(v->slope));
    return share < 1.0 ? share : 1.0;
}

/* --- the classic method, on a grid */

/* Signed distances to the outline on a grid. World units. */
typedef struct grid {
    const vsh_outline *outline;
    double low[2], high[2];
    double cell;
    size_t columns, rows;
    float *values; /* [rows][columns] */
} grid;

static const double MAX_VALUES = 0x1p31;
/* In cells: the distance of a hit, and the shortest step, which moves rays on along walls. */
static const double MET = 0.01, SHORTEST_STEP = 0.1;

static void fill_grid_rows(void *user, size_t begin, size_t end) {
    const grid *g = user;
    for (size_t row = begin; row < end; ++row) {
        double bound = INFINITY; /* a neighbour's distance and a step bound the next one's */
        for (size_t column = 0; column < g->columns; ++column) {
            const vshi_point p = {g->low[0] + (double)column * g->cell, g->low[1] + (double)row * g->cell};
            const double distance = sqrt(vshi_outline_square(g->outline, p, bound * bound));
            bound = distance * (1.0 + 1e-9) + 1.001 * g->cell;
            g->values[row * g->columns + column] =
                (float)(vshi_outline_winding(g->outline, p) != 0 ? -distance : distance);
        }
    }
}

/* Interpolates the grid bilinearly. */
static double sample(const grid *g, vshi_point p) {
    const double x = fmin(fmax((p.x - g->low[0]) / g->cell, 0.0), (double)(g->columns - 1));
    const double y = fmin(fmax((p.y - g->low[1]) / g->cell, 0.0), (double)(g->rows - 1));
    const size_t i = x < (double)(g->columns - 2) ? (size_t)x : g->columns - 2;
    const size_t k = y < (double)(g->rows - 2) ? (size_t)y : g->rows - 2;
    const double u = x - (double)i, v = y - (double)k;
    const float *at = g->values + k * g->columns + i, *above = at + g->columns;
    return (1.0 - v) * ((1.0 - u) * (double)at[0] + u * (double)at[1]) +
           v * ((1.0 - u) * (double)above[0] + u * (double)above[1]);
}

/* Clips the ray to the grid's rectangle; false if it misses. */
static bool clip_ray(const grid *g, const view *v, double *from, double *to) {
    const double origin[2] = {v->point.x, v->point.y}, direction[2] = {v->towards.x, v->towards.y};
    for (int axis = 0; axis < 2; ++axis) {
        if (direction[axis] == 0.0) {
            if (origin[axis] < g->low[axis] || origin[axis] > g->high[axis]) {
                return false;
            }
            continue;
        }
        const double a = (g->low[axis] - origin[axis]) / direction[axis];
        const double b = (g->high[axis] - origin[axis]) / direction[axis];
        *from = fmax(*from, fmin(a, b));
        *to = fmin(*to, fmax(a, b));
    }
    return *from < *to;
}

/* Technique "soft shadows in raymarched SDFs" (Quilez, 2010) in the plane, as 2D lighting uses it (Kaplan):
 * the least h/(s t) along the ray to the light's centre, 0 if it hits the outline. */
static double find_classic(const grid *g, const view *v, int32_t max_steps) {
    double t = g->cell, end = v->distance;
    if (!clip_ray(g, v, &t, &end)) {
        return 1.0;
    }
    const double sine =
        isinf(v->distance) ? v->slope / sqrt(1.0 + v->slope * v->slope) : v->radius / v->distance;
    double least = 1.0;
    for (int32_t step = 0; step < max_steps && t < end; ++step) {
        const double h =
            sample(g, (vshi_point){v->point.x + t * v->towards.x, v->point.y + t * v->towards.y});
        if (h < MET * g->cell) {
            return 0.0;
        }
        least = h < least * sine * t ? h / (sine * t) : least;
        t += fmax(h, SHORTEST_STEP * g->cell);
    }
    return least;
}

/* --- checks */

static vsh_result check_options(const vsh_flat_options *o, vsh_error *error) {
    const struct {
        const char *name;
        int32_t value, least, most;
    } integers[] = {{"width", o->width, 1, MAX_SIZE},
                    {"height", o->height, 1, MAX_SIZE},
                    {"method", (int32_t)o->method, 0, VSH_FLAT_EXACT},
                    {"supersample", o->supersample, 1, MAX_SUPERSAMPLE},
                    {"padding", o->padding, 0, VSHI_MAX_PADDING},
                    {"max_steps", o->max_steps, 16, 65536}};
    for (size_t i = 0; i < sizeof integers / sizeof integers[0]; ++i) {
        if (integers[i].value < integers[i].least || integers[i].value > integers[i].most) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "flat: %s %d: expected %d … %d", integers[i].name,
                             integers[i].value, integers[i].least, integers[i].most);
        }
    }
    for (int axis = 0; axis < 2; ++axis) {
        const double low = o->region_min[axis], high = o->region_max[axis];
        if (!(fabs(low) <= VSHI_OUTLINE_LARGEST && fabs(high) <= VSHI_OUTLINE_LARGEST && low < high)) {
            return vshi_fail(
                error, VSH_ERROR_ARGUMENT,
                "flat: region %.9g … %.9g along %s: expected two numbers of at most %g in size, the "
                "lower first",
                low, high, axis == 0 ? "x" : "y", VSHI_OUTLINE_LARGEST);
        }
    }
    return VSH_OK;
}

static vsh_result check_lights(const vsh_light *lights, size_t count, vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        vsh_error reason;
        if (vsh_light_check(&lights[i], &reason) != VSH_OK) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: %.900s", i, reason.message);
        }
        if (vsh_get_name(VSH_NAMES_FLAT_LIGHT, lights[i].type) == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: '%s': a plane has no %s lights", i,
                             lights[i].name, vshi_light_type_of(lights[i].type)->name);
        }
        const double *way = lights[i].type == VSH_LIGHT_SPOT ? lights[i].axis : lights[i].direction;
        if (lights[i].type != VSH_LIGHT_SPHERE && !(vshi_hypot(way[0], way[1]) > 0.0)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "light %zu: '%s': its direction has no length in the plane", i, lights[i].name);
        }
    }
    return VSH_OK;
}

/* --- texels */

typedef struct bake {
    const vsh_outline *casters;
    const vsh_light *lights;
    size_t light_count;
    vsh_flat_options options;
    const vsh_flat_map *map;
    grid grid;       /* of the classic method */
    double texel[2]; /* size, world units */
    uint8_t *state;  /* [height][width], for padding; or NULL */
} bake;

static float *plane(float *const *planes, size_t index) {
    return planes != NULL ? planes[index] : NULL;
}

/* Finds the share of a light that a point sees, 0 beyond its reach, and the gain of the light's colour. */
static double shade_point(const bake *b, const vsh_light *light, vshi_point p, double *gain) {
    view v;
    const bool outside = find_view(light, p, &v);
    *gain = 1.0;
    if (light->type != VSH_LIGHT_DIRECTIONAL) {
        const vshi_vec to = {v.towards.x, v.towards.y, 0.0};
        /* inside the lamp, falloff is that of its rim, and spots shine everywhere */
        vsh_light flat = *light;
        flat.axis[2] = 0.0;
        flat.type = outside ? light->type : VSH_LIGHT_SPHERE;
        *gain = vshi_light_gain(&flat, to, fmax(v.distance, fmax(light->radius, 1e-30)));
        if (light->falloff == VSH_FALLOFF_QUADRATIC && v.distance >= light->reach) {
            return 0.0;
        }
    }
    if (!outside) {
        return 1.0;
    }
    if (b->options.method == VSH_FLAT_EXACT) {
        return find_visible(b->casters, &v);
    }
    if (b->options.method == VSH_FLAT_CLASSIC && b->grid.values != NULL) {
        return find_classic(&b->grid, &v, b->options.max_steps);
    }
    return sees_centre(b->casters, &v) ? 1.0 : 0.0;
}

static void bake_texel(const bake *b, size_t row, size_t column) {
    const int32_t n = b->options.supersample;
    const size_t at = row * (size_t)b->options.width + column;
    vshi_point samples[MAX_SAMPLES]; /* outside solids */
    size_t count = 0;
    for (int32_t i = 0; i < n * n; ++i) {
        const double x = (double)column + (i % n + 0.5) / n, y = (double)row + ((double)(i / n) + 0.5) / n;
        const vshi_point p = {b->options.region_min[0] + x * b->texel[0],
                              b->options.region_max[1] - y * b->texel[1]};
        if (b->casters == NULL || vshi_outline_winding(b->casters, p) == 0) {
            samples[count++] = p;
        }
    }
    if (b->map->coverage != NULL) {
        b->map->coverage[at] = (float)((double)count / (n * n));
    }
    if (b->state != NULL) {
        b->state[at] = count > 0 ? VSHI_TEXEL_VALID : VSHI_TEXEL_EMPTY;
    }
    double rgb[3] = {0.0, 0.0, 0.0};
    for (size_t l = 0; l < b->light_count; ++l) {
        double seen = 0.0, lit = 0.0;
        for (size_t i = 0; i < count; ++i) {
            double gain;
            const double share = shade_point(b, &b->lights[l], samples[i], &gain);
            seen += share;
            lit += share * gain;
        }
        float *shadow = plane(b->map->shadow, l);
        if (shadow != NULL) {
            shadow[at] = (float)(count > 0 ? seen / (double)count : 0.0);
        }
        for (int c = 0; c < 3 && count > 0; ++c) {
            rgb[c] += lit / (double)count * b->lights[l].color[c];
        }
    }
    for (size_t c = 0; c < 3; ++c) {
        float *irradiance = plane(b->map->irradiance, c);
        if (irradiance != NULL) {
            irradiance[at] = (float)rgb[c];
        }
    }
}

static void bake_rows(void *user, size_t begin, size_t end) {
    const bake *b = user;
    for (size_t row = begin; row < end; ++row) {
        for (size_t column = 0; column < (size_t)b->options.width; ++column) {
            bake_texel(b, row, column);
        }
    }
}

/* Fills texels in solids from their neighbours. */
static vsh_result pad(const bake *b, const vsh_run *run, vsh_error *error) {
    const int32_t radius[VSHI_TEXEL_KINDS] = {[VSHI_TEXEL_EMPTY] = b->options.padding};
    vshi_plane *planes;
    size_t count = 0;
    VSHI_TRY(vshi_allocate((void **)&planes, b->light_count + 3, sizeof *planes, "planes", error));
    for (size_t i = 0; i < b->light_count + 3; ++i) {
        float *values =
            i < b->light_count ? plane(b->map->shadow, i) : plane(b->map->irradiance, i - b->light_count);
        if (values != NULL) {
            planes[count++] = (vshi_plane){values, 1};
        }
    }
    vshi_store store = {.run = run};
    const vsh_result result = vshi_padding_fill(&store, run, b->options.width, b->options.height, b->state,
                                                radius, planes, count, NULL, error);
    vshi_store_close(&store);
    free(planes);
    return result;
}

/* Finds the width around the outline in which distances matter: the widest cone's radius. */
static double find_margin(const bake *b) {
    const vshi_outline_node *root = &b->casters->nodes[0];
    double sides[2], margin = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = fmax(root->high[axis], b->options.region_max[axis]) -
                      fmin(root->low[axis], b->options.region_min[axis]);
    }
    for (size_t i = 0; i < b->light_count; ++i) {
        const vsh_light *light = &b->lights[i];
        margin = fmax(margin, light->type == VSH_LIGHT_DIRECTIONAL
                                  ? vshi_sin(0.5 * light->angle) * vshi_hypot(sides[0], sides[1])
                                  : light->radius);
    }
    return margin;
}

/* Places the grid of the classic method. */
static vsh_result place_grid(bake *b, vsh_error *error) {
    const vshi_outline_node *root = &b->casters->nodes[0];
    const double margin = find_margin(b), cell = fmin(b->texel[0], b->texel[1]);
    double sides[2];
    b->grid.outline = b->casters;
    b->grid.cell = cell;
    for (int axis = 0; axis < 2; ++axis) {
        sides[axis] = ceil((root->high[axis] - root->low[axis] + 2.0 * margin) / cell) + 2.0;
        b->grid.low[axis] = root->low[axis] - margin - 0.5 * cell;
        b->grid.high[axis] = b->grid.low[axis] + (sides[axis] - 1.0) * cell;
    }
    if (!(sides[0] * sides[1] <= MAX_VALUES)) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "flat: method classic: more than 2^31 distances: the outline and the lights' widths "
                         "are too large for texels of %g",
                         cell);
    }
    b->grid.columns = (size_t)sides[0];
    b->grid.rows = (size_t)sides[1];
    return VSH_OK;
}

/* Runs fn over rows as a job of its own. */
static vsh_result run_rows(const vsh_run *run, const char *stage, size_t rows, size_t units,
                           vshi_range_fn *fn, void *user, vsh_error *error) {
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, stage, rows * units, "flat", error));
    const vsh_result result = vshi_parallel_for(job, rows, 1, units, fn, user, error);
    vshi_job_end(job);
    return result;
}

/* Takes the memory of padding and of the classic method, and fills the latter's grid. */
static vsh_result prepare(bake *b, const vsh_run *run, vsh_error *error) {
    if (b->casters == NULL) {
        return VSH_OK;
    }
    const size_t texels = (size_t)b->options.width * (size_t)b->options.height;
    const bool padded = b->options.padding > 0;
    vshi_outline_info info;
    vshi_outline_get_info(b->casters, &info);
    double bytes = (double)info.bytes + (padded ? (double)texels * (1.0 + sizeof(int16_t)) : 0.0);
    if (b->options.method == VSH_FLAT_CLASSIC) {
        VSHI_TRY(place_grid(b, error));
        bytes += (double)b->grid.columns * (double)b->grid.rows * sizeof(float);
    }
    VSHI_TRY(vshi_check_limit(run, bytes, "flat", error));
    VSHI_TRY(vshi_allocate((void **)&b->state, padded ? texels : 0, 1, "padding", error));
    const size_t values = b->grid.columns * b->grid.rows;
    VSHI_TRY(vshi_allocate((void **)&b->grid.values, values, sizeof(float), "distances", error));
    return values > 0 ? run_rows(run, "field", b->grid.rows, 1, fill_grid_rows, &b->grid, error) : VSH_OK;
}

vsh_result vshi_flat_bake(const vsh_outline *casters, const vsh_light *lights, size_t light_count,
                          const vsh_flat_options *options, const vsh_run *run, const vsh_flat_map *map,
                          vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(map);
    VSHI_NEEDS_OF(light_count, lights);
    bake b = {.casters = casters,
              .lights = lights,
              .light_count = light_count,
              .options = vsh_flat_options_default(),
              .map = map};
    vsh_run full;
    VSHI_TRY(vshi_options_resolve(options, &b.options, sizeof b.options, "vsh_flat_options", error));
    VSHI_TRY(check_options(&b.options, error));
    VSHI_TRY(check_lights(lights, light_count, error));
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    b.texel[0] = (b.options.region_max[0] - b.options.region_min[0]) / b.options.width;
    b.texel[1] = (b.options.region_max[1] - b.options.region_min[1]) / b.options.height;
    vsh_result result;
    VSHI_TRY_DONE(prepare(&b, &full, error));
    VSHI_TRY_DONE(
        run_rows(&full, "flat", (size_t)b.options.height, (size_t)b.options.width, bake_rows, &b, error));
    result = b.state != NULL ? pad(&b, &full, error) : VSH_OK;
done:
    free(b.grid.values);
    free(b.state);
    return result;
}

double vshi_flat_visibility(const vsh_outline *casters, const vsh_light *light, const double point[2]) {
    VSHI_FLOATS;
    const vshi_point p = {point[0], point[1]};
    view v;
    if (!isfinite(p.x) || !isfinite(p.y) || vsh_get_name(VSH_NAMES_FLAT_LIGHT, light->type) == NULL) {
        return NAN;
    }
    return find_view(light, p, &v) ? find_visible(casters, &v) : 1.0;
}
