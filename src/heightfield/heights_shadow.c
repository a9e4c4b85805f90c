/* Shadow of a heightfield by slices of the light's disc: what is over a heightfield's surface in one azimuth
 * is free from its horizon upwards, so that each slice is cut once, at the steepest slope of the terrain's
 * profile (N. Max, "Horizon mapping: shadows for bump-mapped surfaces", 1988). Exact but for the number of
 * slices. A hard light is one ray, which the march of I. Quilez, "terrain raymarching" (2002 …), would take
 * in steps of its height over the ground; here a step is a block whose maximum stays under the ray, and what
 * it meets is exact. */
#include "base/elementary.h"
#include "heightfield/heights.h"
#include "heightfield/place.h"
#include "heightfield/slices.h"
#include "light/view.h"

/* Slopes of a slice's directions over the plane of a normal: from low to high. */
typedef struct span {
    double low, high;
} span;

static span over_plane(const vshi_slices *s, int k, vshi_vec normal) {
    const vshi_slice *slice = &s->slice[k];
    const double along = normal.x * s->x[k] + normal.z * s->z[k];
    span p = {slice->bottom, slice->top};
    if (normal.y > 0.0) {
        p.low = fmax(p.low, -along / normal.y);
    } else if (normal.y < 0.0) {
        p.high = fmin(p.high, -along / normal.y);
    } else if (along < 0.0) { /* a zero normal, which has no plane, comes to 0 */
        p.high = p.low;
    }
    return p;
}

/* Share of a slice between two slopes. */
static double between(const vshi_slices *s, int k, double low, double high) {
    return high > low ? vshi_slice_above(s, k, low) - vshi_slice_above(s, k, high) : 0.0;
}

/* What the solid leaves of a span: all but what is between passing under it and its horizon. */
static double open_share(const vsh_heights *heights, const vshi_slices *s, int k, span p, double horizon,
                         const double at[3]) {
    const double under = vshi_heights_under(&heights->relief, at, s->x[k], s->z[k]);
    return under >= horizon
               ? between(s, k, p.low, p.high)
               : between(s, k, fmax(p.low, horizon), p.high) + between(s, k, p.low, fmin(p.high, under));
}

static float shade_hard(const vsh_heights *heights, vshi_walk_fn *walk, const vshi_slices *s,
                        const double at[3], vsh_shade_stats *stats) {
    vshi_fan fan = s->fan;
    stats->samples += walk(&heights->relief, at, &fan);
    const double under = vshi_heights_under(&heights->relief, at, s->x[0], s->z[0]);
    return fan.slope[0] > s->fan.slope[0] && s->slice[0].bottom > under ? 0.0f : 1.0f;
}

static float shade_soft(const vsh_heights *heights, vshi_walk_fn *walk, const vshi_slices *s,
                        const double at[3], vshi_vec normal, vsh_shade_stats *stats) {
    vshi_fan fan = s->fan;
    span spans[VSHI_FAN];
    float least[VSHI_FAN];
    for (int k = 0; k < VSHI_FAN; ++k) {
        spans[k] = over_plane(s, k, normal);
        fan.slope[k] = least[k] = (float)spans[k].low;
        fan.enough[k] = (float)spans[k].high;
        fan.far[k] = spans[k].high > spans[k].low ? fan.far[k] : -1.0f;
    }
    stats->samples += walk(&heights->relief, at, &fan);
    double open = 0.0, all = 0.0;
    bool met = false;
    for (int k = 0; k < VSHI_FAN; ++k) {
        const double full = between(s, k, spans[k].low, spans[k].high), weight = s->slice[k].weight;
        const bool raised = fan.slope[k] > least[k];
        all += weight * full;
        open += weight * (raised ? open_share(heights, s, k, spans[k], (double)fan.slope[k], at) : full);
        met = met || raised;
    }
    const float visible = !met || !(all > 0.0) || open >= all ? 1.0f : (float)(open / all);
    stats->certified += visible == 0.0f || visible == 1.0f;
    return visible;
}

/* Slices of a lamp as a point sees it. */
static vshi_light_side aim(const vshi_light_place *place, bool hard, const double at[3], vshi_slices *s) {
    vshi_light_view view;
    const vshi_light_side side = vshi_light_look(place, vshi_vec_of(at), hard, &view);
    if (side != VSHI_LIGHT_SEEN) {
        return side;
    }
    /* up to the circle where the cone touches the lamp: vshi_light_end(), but for rounding */
    const double square = (1.0 - view.sine) * (1.0 + view.sine);
    vshi_slices_make(view.axis, hard ? 0.0 : vshi_light_tangent(place, &view), view.distance * square, s);
    return side;
}

void vshi_heights_shadow(const vsh_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats) {
    vshi_walk_fn *walk = vshi_walk_of_machine();
    const bool hard = method == VSH_SHADOW_HARD;
    vshi_light_place place = vshi_light_in_world(light);
    vshi_slices slices;
    if (place.parallel) { /* the same for all points */
        place.towards = vshi_heights_direction(heights, vshi_vec_of(light->direction));
        vshi_slices_make(place.towards, hard ? 0.0 : place.tangent, INFINITY, &slices);
    } else {
        place = vshi_light_moved(&place, heights->to_relief, heights->unit);
    }
    for (size_t i = begin; i < end; ++i) {
        float *value = &visibility[i - begin];
        double at[3];
        vshi_vec normal;
        switch (vshi_heights_stand(heights, points, i, lift, at, &normal)) {
        case VSHI_STAND_INVALID:
            *value = NAN;
            continue;
        case VSHI_STAND_BURIED:
            *value = 0.0f;
            continue;
        case VSHI_STAND_FREE:
            break;
        }
        const vshi_light_side side = place.parallel ? VSHI_LIGHT_SEEN : aim(&place, hard, at, &slices);
        if (side != VSHI_LIGHT_SEEN) {
            *value = side == VSHI_LIGHT_WITHIN ? 1.0f : 0.0f;
            continue;
        }
        ++stats->marches;
        *value = slices.hard ? shade_hard(heights, walk, &slices, at, stats)
                             : shade_soft(heights, walk, &slices, at, normal, stats);
    }
}
