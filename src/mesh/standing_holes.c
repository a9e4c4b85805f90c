/* How far the holes of a vessel are closed by others.
 *
 * A segment from just beyond the hole into the component tells: the hole is closed if the segment leaves
 * another component that it begins in, or enters within the gap around the hole. So a cup that stands upside
 * down is closed, on a thick table and on a thin board. A cup that holds fruit or coffee is open, because the
 * segment enters those deeper inside; so is a cup below a shelf, which is farther off than the gap. */
#include "mesh/standing.h"

/* Of the points of a hole that are looked at, and of those of its rim: fewer that are closed do not close any
 * of it. A rock without its underside may lie on bumps, or reach over an edge. */
static const double LEAST_CLOSED = 1.0 / 3.0, LEAST_RIM = 1.0 / 8.0;
/* Of the square root of a hole's area: what covers it at a distance, a roof, is no farther. */
static const double COVERS_WITHIN = 1.0;
/* The least cosine of a segment with the hole's normal that it is lengthened for, so as to reach the gap. */
static const double LEAST_COSINE = 0.25;
/* Segments end this much of their length before a surface of their own component: others may touch it. */
static const double SHORT_OF = 1e-3;

enum {
    POINTS = 16,   /* of a hole that are looked at */
    AIMS = 6,      /* segments from a point, at most: each the best of */
    TRIED = 8,     /* by their cosine */
    SPREAD = 27,   /* targets from one to the next: those that follow each other are neighbours */
    CROSSINGS = 64 /* of a segment that are looked at, the nearest */
};

static vshi_vec cross_of(const vshi_vec cap[3]) {
    return vshi_scale(vshi_cross(vshi_sub(cap[1], cap[0]), vshi_sub(cap[2], cap[0])), 0.5);
}

/* Whether the segment from `point` to `target` in the vessel leaves a component that it begins in, or that it
 * enters in its first part, `gap` of its length. A thin slab may lie entirely in the gap. */
static bool is_behind(const vshi_vessel *v, vshi_vec point, vshi_vec target, double gap, bool by_solids) {
    vshi_face_crossing crossings[CROSSINGS];
    const size_t count = vshi_face_tree_cross(v->tree, point, target, crossings, CROSSINGS);
    double end = 1.0;
    for (size_t i = count; i > 0; --i) {
        end = crossings[i - 1].component == v->number ? crossings[i - 1].at : end;
    }
    int left = 0;
    for (size_t i = 0; i < count && crossings[i].at < end - SHORT_OF; ++i) {
        const vshi_component *c = &v->s->components[crossings[i].component];
        if (!by_solids || c->kind != VSHI_KIND_SHEET) {
            left += crossings[i].out;
        }
        if (left < 0 && crossings[i].at <= gap) {
            left = 0;
        }
        if (left > 0) {
            return true;
        }
    }
    return false;
}

/* Whether another component closes a cap at a point. The first segment decides, unless it lies entirely in a
 * solid. The other segments then meet the faces of that solid. */
static bool is_closed(const vshi_vessel *v, vshi_vec at, vshi_vec normal, size_t number, double gap) {
    for (size_t aim = 0; aim < AIMS; ++aim) {
        double best = 0.0;
        vshi_vec target = at, along = {0.0, 0.0, 0.0};
        for (size_t k = 0; k < TRIED; ++k) {
            const vshi_vec one = v->targets[(number + SPREAD * (aim * TRIED + k)) % VSHI_VESSEL_TARGETS];
            const vshi_vec out = vshi_unit(vshi_sub(at, one));
            if (vshi_dot(out, normal) > best) {
                best = vshi_dot(out, normal);
                target = one;
                along = out;
            }
        }
        const double off = gap / fmax(best, LEAST_COSINE);
        const vshi_vec beyond = vshi_add(at, vshi_scale(along, off));
        const double length = vshi_length(vshi_sub(target, beyond));
        if (best > 0.0 && is_behind(v, beyond, target, 2.0 * off / length, aim > 0)) {
            return true;
        }
    }
    return false;
}

/* Whether the back of something is beyond a point of a hole, seen from within. */
static bool is_covered(const vshi_vessel *v, vshi_vec at, size_t number, double reach) {
    vshi_face_crossing crossings[CROSSINGS];
    const vshi_vec along = vshi_unit(vshi_sub(at, v->targets[number % VSHI_VESSEL_TARGETS]));
    const vshi_vec to = vshi_add(at, vshi_scale(along, reach));
    const size_t count = vshi_face_tree_cross(v->tree, at, to, crossings, CROSSINGS);
    for (size_t i = 0; i < count; ++i) {
        if (crossings[i].component != v->number) {
            return crossings[i].out > 0;
        }
    }
    return false;
}

/* The points of a hole that are looked at, and for what. */
typedef enum points {
    ALL_OVER,  /* it: whether they are closed */
    ALONG_RIM, /* its rim: likewise. A ball that sticks out of a cup does not touch that */
    SEEN       /* all over it: whether they are covered */
} points;

/* What a cap counts for: its length along the rim, or its area as it is seen along the hole's axis, which is
 * not more where the rim is jagged. */
static double weight_of(const vshi_vec cap[3], vshi_vec axis, points which) {
    return which == ALONG_RIM ? vshi_length(vshi_sub(cap[1], cap[0]))
                              : fmax(0.0, vshi_dot(cross_of(cap), vshi_unit(axis)));
}

/* In the middle of a cap's edge of the rim, a hair within. */
static vshi_vec point_at_rim(const vshi_vec cap[3]) {
    static const double HAIR = 0.02;
    return vshi_add(vshi_scale(vshi_add(cap[0], cap[1]), 0.5 * (1.0 - HAIR)), vshi_scale(cap[2], HAIR));
}

/* The share of a hole's points that are open; 1 also where the closed ones are too few to count. */
static double open_share(const vshi_vessel *v, uint32_t hole, points which) {
    const vshi_component *c = v->component;
    const vshi_vec axis = v->axes[hole];
    const double size = sqrt(vshi_length(axis));
    double all = 0.0, reached = 0.0;
    for (size_t k = 0; k < c->open_edges; ++k) {
        all += v->hole_of[k] == hole ? weight_of(c->cap[k], axis, which) : 0.0;
    }
    size_t next = 0, open = 0;
    for (size_t k = 0; k < c->open_edges && next < POINTS; ++k) {
        if (v->hole_of[k] != hole) {
            continue;
        }
        const vshi_vec *cap = c->cap[k];
        const vshi_vec normal = vshi_unit(cross_of(cap));
        reached += weight_of(cap, axis, which);
        for (; next < POINTS && reached >= all * ((double)next + 0.5) / POINTS; ++next) {
            const vshi_vec at = which == ALONG_RIM ? point_at_rim(cap) : vshi_point_in(cap, next);
            open += which == SEEN ? !is_covered(v, at, next, COVERS_WITHIN * size)
                                  : !is_closed(v, at, normal, next, VSHI_STANDING_GAP * size);
            if (which != SEEN &&
                (double)open > (1.0 - (which == ALONG_RIM ? LEAST_RIM : LEAST_CLOSED)) * POINTS) {
                return 1.0;
            }
        }
    }
    return all > 0.0 ? (double)open / POINTS : 1.0;
}

static double share_not_closed(const vshi_vessel *v, uint32_t hole) {
    const double share = open_share(v, hole, ALL_OVER);
    return share < 1.0 && open_share(v, hole, ALONG_RIM) == 1.0 ? 1.0 : share;
}

bool vshi_vessel_begin(vshi_vessel *v, const vshi_solidity *s, const vshi_face_tree *tree,
                       uint32_t component) {
    const vshi_component *c = &s->components[component];
    v->s = s;
    v->tree = tree;
    v->component = c;
    v->number = component;
    v->hole_of = s->hole_of + (c->cap - (const vshi_vec(*)[3])s->caps);
    if (c->holes > VSHI_VESSEL_HOLES) {
        return false;
    }
    const vshi_surface_part part = vshi_component_part(s, c);
    vshi_part_samples(&part, c->area, VSHI_VESSEL_TARGETS, v->targets);
    for (size_t k = 0; k < c->holes; ++k) {
        v->axes[k] = (vshi_vec){0.0, 0.0, 0.0};
    }
    for (size_t k = 0; k < c->open_edges; ++k) {
        v->axes[v->hole_of[k]] = vshi_add(v->axes[v->hole_of[k]], cross_of(c->cap[k]));
    }
    return true;
}

bool vshi_vessel_find_closed(vshi_vessel *v) {
    bool found = false;
    for (uint32_t k = 0; k < v->component->holes; ++k) {
        v->open[k] = share_not_closed(v, k);
        found = found || v->open[k] < 1.0;
    }
    return found;
}

void vshi_vessel_find_covered(vshi_vessel *v) {
    for (uint32_t k = 0; k < v->component->holes; ++k) {
        if (v->open[k] == 1.0) {
            v->open[k] = open_share(v, k, SEEN);
        }
    }
}
