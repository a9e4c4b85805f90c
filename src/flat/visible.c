/* The union of the angles that an outline hides from a point.
 *
 * Seen from the point, with x towards the light's centre, a direction is its slope y/x, and the light is the
 * range -w … w of slopes. Whatever part of the outline lies before the light hides an interval of them. A
 * piece of contour that is before the light as a whole hides all that lies between its two ends, however it
 * gets from one to the other: so a walk down the tree takes the ends of a piece first, and goes on only into
 * those halves whose box reaches beyond what is hidden already. That finds a contour's extremes in a time
 * with the logarithm of its length. What is left at the end are intervals, and the sum of their angles is
 * exact. */
#include "flat/visible.h"

#include "base/elementary.h"
#include "light/view.h"

#include <math.h>
#include <string.h>

enum { MAX_INTERVALS = 64, MAX_HALVINGS = 48 };

typedef struct interval {
    double low, high;
} interval;

typedef struct hiding {
    const vsh_outline *casters;
    const vshi_flat_view *view;
    double low, high;               /* slopes that are looked at */
    double sure2;                   /* squared distance up to which everything lies before the light */
    double tangent2;                /* squared length of the tangents to the light's disc */
    vshi_point above;               /* normal, world, of the direction `high`, away from the cone */
    vshi_point below;               /* the same of `low` */
    interval hidden[MAX_INTERVALS]; /* sorted, apart */
    size_t count;
    bool overflow;
} hiding;

/* A point in the light's frame. */
static vshi_point local(const vshi_flat_view *v, vshi_point p) {
    const double x = p.x - v->point.x, y = p.y - v->point.y;
    return (vshi_point){x * v->towards.x + y * v->towards.y, y * v->towards.x - x * v->towards.y};
}

static vshi_point unit_normal(const vshi_flat_view *v, double slope, double sign) {
    const double length = sqrt(1.0 + slope * slope);
    const double x = -sign * slope / length, y = sign / length; /* in the light's frame */
    return (vshi_point){x * v->towards.x - y * v->towards.y, x * v->towards.y + y * v->towards.x};
}

/* The same limits as in 3D (light/view.h). */
static double slope_of(double tangent) {
    return tangent < VSHI_LEAST_SINE ? 0.0 : fmin(tangent, VSHI_LARGEST_TANGENT);
}

bool vshi_flat_look(const vsh_light *light, vshi_point point, vshi_flat_view *view) {
    view->point = point;
    if (light->type == VSH_LIGHT_DIRECTIONAL) {
        const double length = vshi_hypot(light->direction[0], light->direction[1]);
        view->towards = (vshi_point){light->direction[0] / length, light->direction[1] / length};
        view->distance = INFINITY;
        view->radius = 0.0;
        view->slope = slope_of(vshi_tan(0.5 * light->angle));
        return true;
    }
    const double x = light->position[0] - point.x, y = light->position[1] - point.y;
    view->distance = vshi_hypot(x, y);
    view->radius = light->radius;
    if (!(view->distance > light->radius)) {
        view->towards = (vshi_point){0.0, 0.0};
        view->slope = INFINITY;
        return false;
    }
    view->towards = (vshi_point){x / view->distance, y / view->distance};
    /* (d - r)(d + r) keeps what d² - r² loses next to the light */
    view->slope =
        slope_of(light->radius / sqrt((view->distance - light->radius) * (view->distance + light->radius)));
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
    size_t last = first; /* those that it touches are first … last - 1 */
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

/* b itself at its end, as the next segment has it. */
static vshi_point along(vshi_point a, vshi_point b, double t) {
    return t >= 1.0 ? b : (vshi_point){a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
}

/* A part of a segment: from where to where along it, and the slopes there where they are the cone's edges. */
typedef struct part {
    double from, to;
    double from_slope, to_slope; /* NAN: to be found */
} part;

/* Hides what a part does, which is wholly in the cone and outside the light's disc. */
static void hide_part(hiding *h, vshi_point a, vshi_point b, part w) {
    const vshi_point middle = along(a, b, 0.5 * (w.from + w.to));
    const vshi_point p = along(a, b, w.from), q = along(a, b, w.to);
    if (!(w.from < w.to) || dot(middle, middle) >= h->tangent2 || !(p.x > 0.0 && q.x > 0.0)) {
        return; /* behind the light; or the point is on the segment, which hides nothing of one side */
    }
    const double s = isnan(w.from_slope) ? p.y / p.x : w.from_slope;
    const double e = isnan(w.to_slope) ? q.y / q.x : w.to_slope;
    hide(h, s < e ? s : e, s < e ? e : s);
}

/* Clips a part to where what is at_a and at_b at the segment's ends is not over 0; it is 0 at the cone's edge
 * of that slope. */
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
    const vshi_flat_view *v = h->view;
    const vshi_point a = local(v, from), b = local(v, to);
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

/* What a node's box may still hide. */
typedef enum reach {
    NOTHING,
    PARTS,
    WHOLE /* of the box: before the point, and before the light */
} reach;

static reach look_at_box(const hiding *h, const vshi_outline_node *node) {
    const vshi_flat_view *v = h->view;
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

static void walk(hiding *h) {
    const vsh_outline *o = h->casters;
    uint32_t stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top++] = 0;
    while (top > 0 && !h->overflow) {
        const vshi_outline_node *node = &o->nodes[stack[--top]];
        const reach reached = look_at_box(h, node);
        if (reached == NOTHING) {
            continue;
        }
        if (node->count > 0 && reached == WHOLE) {
            const vshi_point a = local(h->view, o->points[node->first]);
            const vshi_point b = local(h->view, o->points[node->first + node->count]);
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

/* Angle between low and high that nothing hides. */
static double free_angle(hiding *h, double low, double high, int halvings) {
    h->low = low;
    h->high = high;
    h->above = unit_normal(h->view, high, 1.0);
    h->below = unit_normal(h->view, low, -1.0);
    h->count = 0;
    h->overflow = false;
    walk(h);
    const double from = vshi_atan(low), to = vshi_atan(high);
    if (h->overflow && halvings < MAX_HALVINGS) {
        const double middle = vshi_tan(0.5 * (from + to));
        return free_angle(h, low, middle, halvings + 1) + free_angle(h, middle, high, halvings + 1);
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

double vshi_flat_visible(const vsh_outline *casters, const vshi_flat_view *view) {
    if (casters == NULL) {
        return 1.0;
    }
    if (!(view->slope > 0.0)) {
        return vshi_flat_centre_visible(casters, view) ? 1.0 : 0.0;
    }
    const double before = view->distance - view->radius;
    hiding h = {.casters = casters,
                .view = view,
                .sure2 = before * before,
                .tangent2 = before * (view->distance + view->radius)};
    const double share = free_angle(&h, -view->slope, view->slope, 0) / (2.0 * vshi_atan(view->slope));
    return share < 1.0 ? share : 1.0;
}

bool vshi_flat_centre_visible(const vsh_outline *casters, const vshi_flat_view *view) {
    if (casters == NULL) {
        return true;
    }
    const vsh_outline *o = casters;
    const vshi_point beside = {-view->towards.y, view->towards.x};
    uint32_t stack[VSHI_OUTLINE_STACK];
    size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const vshi_outline_node *node = &o->nodes[stack[--top]];
        const vshi_point half = {0.5 * (node->high[0] - node->low[0]), 0.5 * (node->high[1] - node->low[1])};
        const vshi_point middle = {node->low[0] + half.x - view->point.x,
                                   node->low[1] + half.y - view->point.y};
        const double x = dot(middle, view->towards), y = dot(middle, beside);
        const double depth = half.x * fabs(view->towards.x) + half.y * fabs(view->towards.y);
        const double breadth = half.x * fabs(beside.x) + half.y * fabs(beside.y);
        if (fabs(y) > breadth || x + depth <= 0.0 || x - depth >= view->distance) {
            continue;
        }
        if (node->children != 0) {
            stack[top++] = node->children + 1;
            stack[top++] = node->children;
            continue;
        }
        for (uint32_t i = node->first; i < node->first + node->count; ++i) {
            const vshi_point a = local(view, o->points[i]), b = local(view, o->points[i + 1]);
            if ((a.y <= 0.0) == (b.y <= 0.0)) {
                continue;
            }
            const double meeting = a.x + (b.x - a.x) * (a.y / (a.y - b.y));
            if (meeting > 0.0 && meeting < view->distance) {
                return false;
            }
        }
    }
    return true;
}
