/* Shadow of a heightfield by slices of the light's disc: what is over a heightfield's surface in one azimuth
 * is free from its horizon upwards, so that each slice is cut once, at the steepest slope of the terrain's
 * profile (horizon mapping: N. Max, "Horizon mapping: shadows for bump-mapped surfaces", 1988). Exact but for
 * the number of slices: for a hard light (I. Quilez, "terrain raymarching", 2002 …, marches it) exact. */
#include "analytic/heights.h"
#include "analytic/place.h"
#include "analytic/slices.h"

/* What the solid leaves of a slice: all but what is between passing under it and its horizon. */
static double open_share(const vsh_heights *heights, const vshi_slices *s, const vshi_fan *fan, int k,
                         const double at[3]) {
    const vshi_slice *slice = &s->slice[k];
    const double slope = (double)fan->slope[k];
    if (!(fan->slope[k] > s->fan.slope[k])) {
        return 1.0; /* nothing was in the way */
    }
    const double under = vshi_heights_under(&heights->relief, at, s->x[k], s->z[k]);
    if (s->hard) {
        return slice->bottom <= under ? 1.0 : 0.0;
    }
    if (under >= slope) {
        return 1.0;
    }
    return vshi_slice_above(s, k, slope) + 1.0 - vshi_slice_above(s, k, under);
}

static float shade_point(const vsh_heights *heights, vshi_walk_fn *walk, const vshi_slices *s,
                         const double at[3], vsh_shade_stats *stats) {
    vshi_fan fan = s->fan;
    stats->samples += walk(&heights->relief, at, &fan);
    ++stats->marches;
    double open = 0.0;
    for (int k = 0; k < VSHI_FAN; ++k) {
        open += s->slice[k].weight * open_share(heights, s, &fan, k, at);
        if (s->hard) {
            break;
        }
    }
    /* weights add up to 1 but for rounding */
    const float visible = open >= 1.0 - 1e-7 ? 1.0f : open <= 1e-7 ? 0.0f : (float)open;
    stats->certified += !s->hard && (visible == 0.0f || visible == 1.0f);
    return visible;
}

/* Slices of a lamp as a point sees it; false where the point is within the lamp. */
static bool aim(const vsh_heights *heights, const vsh_light *light, double softness, const double at[3],
                vshi_slices *s) {
    const vshi_vec centre = vshi_transform_point(heights->to_relief, vshi_vec_of(light->position));
    const vshi_vec to = vshi_sub(centre, vshi_vec_of(at));
    const double distance = vshi_length(to), radius = light->radius * softness / heights->unit;
    if (!(distance > radius)) {
        return false;
    }
    const double sine = radius / distance, square = (1.0 - sine) * (1.0 + sine);
    /* up to the circle where the cone touches the lamp */
    vshi_slices_make(vshi_unit(to), sine / sqrt(square), distance * square, s);
    return true;
}

void vshi_heights_shadow(const vsh_heights *heights, const vsh_light *light, double softness, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats) {
    vshi_walk_fn *walk = vshi_walk_of_machine();
    const bool lamp = light->type != VSH_LIGHT_DIRECTIONAL;
    softness = method == VSH_SHADOW_HARD ? 0.0 : softness;
    vshi_slices slices;
    if (!lamp) {
        const vshi_vec axis = vshi_heights_direction(heights, vshi_vec_of(light->direction));
        vshi_slices_make(axis, softness * tan(0.5 * light->angle), INFINITY, &slices);
    }
    for (size_t i = begin; i < end; ++i) {
        float *value = &visibility[i - begin];
        double at[3];
        vshi_vec normal;
        switch (vshi_heights_stand(heights, points, i, lift, at, &normal)) {
        case VSHI_STAND_INVALID:
            *value = NAN;
            break;
        case VSHI_STAND_BURIED:
            *value = 0.0f;
            break;
        case VSHI_STAND_FREE:
            *value = lamp && !aim(heights, light, softness, at, &slices)
                         ? 1.0f
                         : shade_point(heights, walk, &slices, at, stats);
            break;
        }
    }
}
