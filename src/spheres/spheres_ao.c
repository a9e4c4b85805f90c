/* Ambient occlusion by spheres: the cosine-weighted share of each is known in closed form, horizon and
 * distance heeded. What several cover together is their sum times (counted together / counted one by one), on
 * directions of the same density. */
#include "base/elementary.h"
#include "spheres/caps.h"
#include "spheres/sphere_tree.h"
#include "spheres/spheres.h"

#include <string.h>

enum { DIRECTIONS = 512 };

static const double PI = 3.14159265358979323846, TURN = 0.38196601125010515;
static const double SAME_NORMAL = 0.999;

typedef struct sky {
    float x[DIRECTIONS], y[DIRECTIONS], z[DIRECTIONS]; /* around z; density as the cosine */
    int32_t covered[DIRECTIONS];
    double origin[3];
    vshi_vec normal, u, v;
    double distance;
    size_t caps;
    vshi_cap first;
    double sum;
    size_t counted;
    bool inside;
    bool all;           /* sample the first sphere too: directions are asked for */
    const vshi_vec *up; /* of what is over its horizon; NULL: of all */
} sky;

/* Vogel's spiral ("A better way to construct the sunflower head", 1979) raised to the hemisphere. */
static void set_directions(sky *s) {
    for (int i = 0; i < DIRECTIONS; ++i) {
        const double square = (i + 0.5) / DIRECTIONS, angle = 2.0 * PI * fmod(i * TURN, 1.0);
        s->x[i] = (float)(sqrt(square) * vshi_cos(angle));
        s->y[i] = (float)(sqrt(square) * vshi_sin(angle));
        s->z[i] = (float)sqrt(1.0 - square);
    }
}

static void sample(sky *s, const vshi_cap *cap) {
    const float x = (float)vshi_dot(cap->centre, s->u), y = (float)vshi_dot(cap->centre, s->v),
                z = (float)vshi_dot(cap->centre, s->normal), least = (float)cap->cosine;
    int32_t counted = 0;
    for (int i = 0; i < DIRECTIONS; ++i) {
        const int32_t in = s->x[i] * x + s->y[i] * y + s->z[i] * z >= least;
        counted += in;
        s->covered[i] |= in;
    }
    s->counted += (size_t)counted;
}

static bool meets(void *user, const double sphere[4]) {
    sky *s = user;
    vshi_cap cap;
    switch (vshi_cap_of(sphere, s->origin, s->distance, &cap)) {
    case VSHI_CAP_NONE:
        return true;
    case VSHI_CAP_INSIDE:
        s->inside = true;
        return false;
    case VSHI_CAP_SEEN:
        break;
    }
    const double cosine = vshi_dot(cap.centre, s->normal);
    const double share =
        cap.touching && cosine < -SAME_NORMAL ? 0.0 : vshi_cap_over_hemisphere(cosine, cap.sine);
    if (!(share > 0.0)) {
        return true;
    }
    s->sum += share;
    if (++s->caps == 1) {
        s->first = cap;
        if (!s->all) {
            return true;
        }
    }
    if (s->caps == 2 && !s->all) {
        sample(s, &s->first);
    }
    sample(s, &cap);
    return true;
}

/* The integral of free directions: two thirds of the normal, less the mean of those that are covered, at
 * the length that the exact share has. */
static void put_bent(const sky *s, double hidden, float *bent) {
    double sum[3] = {0.0, 0.0, 0.0};
    int32_t covered = 0;
    for (int i = 0; i < DIRECTIONS; ++i) {
        sum[0] += s->covered[i] * (double)s->x[i];
        sum[1] += s->covered[i] * (double)s->y[i];
        sum[2] += s->covered[i] * (double)s->z[i];
        covered += s->covered[i];
    }
    vshi_vec mean = s->first.centre; /* too small a sphere to be met */
    if (covered > 0) {
        mean = vshi_add(vshi_add(vshi_scale(s->u, sum[0]), vshi_scale(s->v, sum[1])),
                        vshi_scale(s->normal, sum[2]));
        mean = vshi_scale(mean, 1.0 / covered);
    }
    const vshi_vec open = vshi_sub(vshi_scale(s->normal, 2.0 / 3.0), vshi_scale(mean, hidden));
    bent[0] = (float)open.x;
    bent[1] = (float)open.y;
    bent[2] = (float)open.z;
}

/* What is hidden of what is over the horizon, where `hidden` is of the hemisphere: the share that sampled
 * directions tell. */
static double over_horizon(const sky *s, double hidden) {
    const double x = vshi_dot(s->u, *s->up), y = vshi_dot(s->v, *s->up), z = vshi_dot(s->normal, *s->up);
    const double whole = 0.5 * (1.0 + z);
    int32_t covered = 0, over = 0;
    for (int i = 0; i < DIRECTIONS; ++i) {
        const bool above = x * (double)s->x[i] + y * (double)s->y[i] + z * (double)s->z[i] > 0.0;
        covered += s->covered[i];
        over += above ? s->covered[i] : 0;
    }
    double part = vshi_dot(s->first.centre, *s->up) > 0.0 ? 1.0 : 0.0; /* too small a sphere to be met */
    if (covered > 0) {
        part = (double)over / covered;
    }
    return whole > 0.0 ? hidden * part / whole : 0.0;
}

static float shade_point(const vsh_spheres *spheres, sky *s, float *bent, vsh_shade_stats *stats) {
    s->caps = s->counted = 0;
    s->sum = 0.0;
    s->inside = false;
    memset(s->covered, 0, sizeof s->covered);
    vshi_frame(s->normal, &s->u, &s->v);
    const vshi_ball_cone hemisphere = {{s->origin[0], s->origin[1], s->origin[2]},
                                       {s->normal.x, s->normal.y, s->normal.z},
                                       1.0,
                                       0.0,
                                       s->distance};
    ++stats->marches;
    stats->samples += vshi_sphere_tree_search(spheres, &hemisphere, meets, s);
    if (s->inside) {
        if (bent != NULL) {
            bent[0] = bent[1] = bent[2] = 0.0f;
        }
        return 0.0f;
    }
    double hidden = s->sum;
    if (s->counted > 0) {
        size_t together = 0;
        for (int i = 0; i < DIRECTIONS; ++i) {
            together += (size_t)s->covered[i];
        }
        hidden = together == DIRECTIONS ? 1.0 : s->sum * (double)together / (double)s->counted;
    }
    if (bent != NULL) {
        put_bent(s, s->caps > 0 ? fmin(hidden, 1.0) : 0.0, bent);
    }
    if (s->up != NULL) {
        hidden = over_horizon(s, fmin(hidden, 1.0));
    }
    return (float)(1.0 - fmin(hidden, 1.0));
}

void vshi_spheres_ao(const vsh_spheres *spheres, double ao_distance, const vshi_vec *up,
                     const vsh_points *points, size_t begin, size_t end, double lift, float *ao, float *bent,
                     vsh_shade_stats *stats) {
    sky s;
    set_directions(&s);
    s.distance = ao_distance;
    s.first.centre = (vshi_vec){0.0, 0.0, 0.0};
    s.up = up;
    s.all = bent != NULL || up != NULL;
    for (size_t i = begin; i < end; ++i) {
        float *direction = bent != NULL ? bent + 3 * (i - begin) : NULL;
        if (vshi_spheres_origin(points, i, lift, s.origin, &s.normal)) {
            ao[i - begin] = shade_point(spheres, &s, direction, stats);
            continue;
        }
        ao[i - begin] = NAN;
        if (direction != NULL) {
            direction[0] = direction[1] = direction[2] = NAN;
        }
    }
}
