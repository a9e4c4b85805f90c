/* Ambient occlusion of a heightfield: in each azimuth the sky is free from the horizon upwards, and its
 * cosine-weighted share has a closed form (L. Bavoil, M. Sainz, R. Dimitrov, "Image-space horizon-based
 * ambient occlusion", 2008; J. Jimenez and others, "Practical realtime strategies for accurate indirect
 * occlusion", 2016; there around the view direction, here around the ground's). */
#include "base/elementary.h"
#include "heightfield/heights.h"
#include "heightfield/place.h"

enum { WALKS = 2, AZIMUTHS = WALKS * VSHI_FAN };

static const double PI = 3.14159265358979323846;
static const double STEEP = 1e18;
static const double OPEN = 2.0 / 3.0; /* the mean cosine over a hemisphere, so weighted */

/* A direction of the heightfield's axes in the world: the transform is a similarity, whose inverse's rows
 * these are. */
static void put_bent(const vsh_heights *heights, vshi_vec d, float *bent) {
    const double *m = heights->to_relief, unit = heights->unit;
    for (int axis = 0; axis < 3; ++axis) {
        bent[axis] = (float)(unit * (m[axis] * d.x + m[4 + axis] * d.y + m[8 + axis] * d.z));
    }
}

/* A direction of the world in the heightfield's axes. */
static vshi_vec to_heights(const vsh_heights *heights, vshi_vec d) {
    const double *m = heights->to_relief, unit = heights->unit;
    return (vshi_vec){unit * (m[0] * d.x + m[1] * d.y + m[2] * d.z),
                      unit * (m[4] * d.x + m[5] * d.y + m[6] * d.z),
                      unit * (m[8] * d.x + m[9] * d.y + m[10] * d.z)};
}

/* Integral of the cosine to a normal (along the azimuth, up) over elevations, per azimuth. */
static double light_between(double along, double up, double from, double to) {
    if (!(to > from)) {
        return 0.0;
    }
    const double a = vshi_sin(from), b = vshi_sin(to);
    return 0.5 * (along * (to - from + b * vshi_cos(to) - a * vshi_cos(from)) + up * (b * b - a * a));
}

/* Integral of the same times the direction, along the azimuth and up. */
static void directions_between(double along, double up, double from, double to, double sum[2]) {
    if (!(to > from)) {
        return;
    }
    const double s0 = vshi_sin(from), s1 = vshi_sin(to), c0 = vshi_cos(from), c1 = vshi_cos(to);
    const double cubes = (s1 * s1 * s1 - s0 * s0 * s0) / 3.0, mixed = (c0 * c0 * c0 - c1 * c1 * c1) / 3.0;
    sum[0] += along * (s1 - s0 - cubes) + up * mixed;
    sum[1] += along * mixed + up * cubes;
}

/* One azimuth over a normal: elevations on its lit side. */
typedef struct half_plane {
    double along, up;
    double low, high;
} half_plane;

static half_plane over(vshi_vec normal, double x, double z) {
    half_plane p = {normal.x * x + normal.z * z, normal.y, -0.5 * PI, 0.5 * PI};
    if (p.up > 0.0) {
        p.low = vshi_atan(-p.along / p.up);
    } else if (p.up < 0.0) {
        p.high = vshi_atan(-p.along / p.up);
    } else if (p.along <= 0.0) {
        p.high = p.low;
    }
    return p;
}

/* The same, above a horizon: `up` is zero where there is none. */
static half_plane over_both(vshi_vec normal, vshi_vec up, double x, double z) {
    half_plane p = over(normal, x, z);
    if (vshi_dot(up, up) > 0.0) {
        const half_plane sky = over(up, x, z);
        p.low = fmax(p.low, sky.low);
        p.high = fmin(p.high, sky.high);
    }
    return p;
}

static double slope_of(double elevation) {
    return elevation <= -0.5 * PI ? -STEEP : elevation >= 0.5 * PI ? STEEP : vshi_tan(elevation);
}

static float shade_point(const vsh_heights *heights, vshi_walk_fn *walk, double distance, const double at[3],
                         vshi_vec normal, vshi_vec up, vshi_vec *bent, vsh_shade_stats *stats) {
    double open = 0.0, all = 0.0;
    vshi_vec hidden = {0.0, 0.0, 0.0};
    for (int w = 0; w < WALKS; ++w) {
        vshi_fan fan;
        half_plane planes[VSHI_FAN];
        double x[VSHI_FAN], z[VSHI_FAN];
        float least[VSHI_FAN];
        fan.range = (float)distance;
        for (int k = 0; k < VSHI_FAN; ++k) {
            const double azimuth = 2.0 * PI * (w * VSHI_FAN + k + 0.5) / AZIMUTHS;
            x[k] = vshi_cos(azimuth);
            z[k] = vshi_sin(azimuth);
            planes[k] = over_both(normal, up, x[k], z[k]);
            vshi_fan_set(&fan, k, x[k], z[k]);
            fan.slope[k] = least[k] = (float)slope_of(planes[k].low);
            fan.enough[k] = (float)slope_of(planes[k].high);
            fan.far[k] = planes[k].high > planes[k].low ? (float)distance : -1.0f;
        }
        stats->samples += walk(&heights->relief, at, &fan);
        for (int k = 0; k < VSHI_FAN; ++k) {
            const half_plane *p = &planes[k];
            const double full = light_between(p->along, p->up, p->low, p->high);
            all += full;
            if (!(fan.slope[k] > least[k])) {
                open += full;
                continue;
            }
            const double horizon = vshi_atan((double)fan.slope[k]);
            const double under = vshi_atan(vshi_heights_under(&heights->relief, at, x[k], z[k]));
            if (bent != NULL && under < horizon) {
                double sum[2] = {0.0, 0.0};
                directions_between(p->along, p->up, fmax(under, p->low), fmin(horizon, p->high), sum);
                hidden = vshi_add(hidden, (vshi_vec){sum[0] * x[k], sum[1], sum[0] * z[k]});
            }
            open += under >= horizon ? full
                                     : light_between(p->along, p->up, fmax(horizon, p->low), p->high) +
                                           light_between(p->along, p->up, p->low, fmin(under, p->high));
        }
    }
    ++stats->marches;
    if (bent != NULL) {
        *bent = vshi_sub(vshi_scale(normal, OPEN), vshi_scale(hidden, 1.0 / all));
    }
    return all > 0.0 ? (float)fmin(fmax(open / all, 0.0), 1.0) : 1.0f;
}

void vshi_heights_ao(const vsh_heights *heights, double ao_distance, const vshi_vec *up,
                     const vsh_points *points, size_t begin, size_t end, double lift, float *ao, float *bent,
                     vsh_shade_stats *stats) {
    vshi_walk_fn *walk = vshi_walk_of_machine();
    const double distance = fmin(ao_distance / heights->unit, 1e12); /* its square is a float */
    const vshi_vec sky = up != NULL ? to_heights(heights, *up) : (vshi_vec){0.0, 0.0, 0.0};
    for (size_t i = begin; i < end; ++i) {
        double at[3];
        vshi_vec normal, direction = {NAN, NAN, NAN};
        switch (vshi_heights_stand(heights, points, i, lift, at, &normal)) {
        case VSHI_STAND_INVALID:
            ao[i - begin] = NAN;
            break;
        case VSHI_STAND_BURIED:
            ao[i - begin] = 0.0f;
            direction = (vshi_vec){0.0, 0.0, 0.0};
            break;
        case VSHI_STAND_FREE:
            ao[i - begin] = shade_point(heights, walk, distance, at, normal, sky,
                                        bent != NULL ? &direction : NULL, stats);
            break;
        }
        if (bent != NULL) {
            put_bent(heights, direction, bent + 3 * (i - begin));
        }
    }
}
