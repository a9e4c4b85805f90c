/* Shadow of spheres: each covers a part of the light's disc that is known in closed form. Where several
 * meet, or the receiver's horizon cuts the disc, how much of their sum is of one place is counted on chords
 * of the disc: what they cover together is the sum times (counted together / counted one by one). It is exact
 * for one sphere and for spheres apart, and the counts' error, a thousandth or so, where all is covered
 * twice. */
#include "base/elementary.h"
#include "light/view.h"
#include "spheres/caps.h"
#include "spheres/sphere_tree.h"
#include "spheres/spheres.h"

#include <float.h>

enum { CHORDS = 32, BITS = 64 };

static const double PI = 3.14159265358979323846;
/* Discs of up to 11° around their axis have closed forms for caps that they cut. */
static const double LARGEST_DISC = 0.2;
/* A sphere that a point stands on is below its horizon where normals are so near to the sphere's. */
static const double SAME_NORMAL = 0.999;

/* Chords of the unit disc: where they are across it, half their length, and their share of it a sample. */
typedef struct chords {
    double at[CHORDS], half[CHORDS], share[CHORDS];
} chords;

static void set_chords(chords *c) {
    double total = 0.0;
    for (int k = 0; k < CHORDS; ++k) {
        const double angle = PI * (k + 1) / (CHORDS + 1);
        c->at[k] = vshi_cos(angle);
        c->half[k] = vshi_sin(angle);
        c->share[k] = c->half[k] * c->half[k] / BITS;
        total += c->share[k] * BITS;
    }
    for (int k = 0; k < CHORDS; ++k) {
        c->share[k] /= total;
    }
}

/* One light from one point, as spheres are found before it. */
typedef struct covering {
    const chords *chords;
    double origin[3];
    vshi_vec axis, u, v;
    vshi_vec normal; /* zero: none */
    double radius;   /* of the disc, a unit away; 0: hard */
    double half;     /* its half angle */
    double far;
    bool classic;
    bool cut;      /* the horizon cuts the disc */
    bool counting; /* caps are sampled from here on */
    vshi_cap first;
    size_t caps;
    double sum;               /* of shares */
    double counted;           /* of samples' shares, one by one */
    double all;               /* of what is above the horizon */
    uint64_t above[CHORDS];   /* samples above the horizon */
    uint64_t covered[CHORDS]; /* of these */
    double visible;           /* hard and classic; 0 where all is covered */
} covering;

/* Samples of chord k from y0 to y1, in the plane a unit away. */
static uint64_t samples_between(const covering *c, int k, double y0, double y1) {
    const double half = c->chords->half[k] * c->radius;
    const double first = ceil((y0 / half + 1.0) * (0.5 * BITS) - 0.5),
                 last = floor((y1 / half + 1.0) * (0.5 * BITS) - 0.5);
    const int from = first > 0.0 ? first < BITS ? (int)first : BITS : 0;
    const int to = last < BITS - 1 ? last >= 0.0 ? (int)last : -1 : BITS - 1;
    if (from > to) {
        return 0;
    }
    const uint64_t upto = to == BITS - 1 ? UINT64_MAX : (UINT64_C(1) << (to + 1)) - 1;
    return upto & ~((UINT64_C(1) << from) - 1);
}

static double y_of(const covering *c, int k, int bit) {
    return ((2.0 * bit + 1.0) / BITS - 1.0) * c->chords->half[k] * c->radius;
}

/* Samples of chord k in a cap, whose centre is given in the disc's frame: those where (centre · p)² is at
 * least cos² |p|², and centre · p over 0, which is a quadratic along the chord. */
static uint64_t samples_in_cap(const covering *c, int k, vshi_vec centre, double cosine) {
    const double x = c->chords->at[k] * c->radius, n = 1.0 + x * x, m = centre.x * x + centre.z;
    const double a = centre.y * centre.y - cosine * cosine, b = centre.y * m, d = m * m - cosine * cosine * n;
    if (a < -1e-9) {
        const double root = b * b - a * d;
        if (!(root > 0.0) || !(m - centre.y * b / a > 0.0)) {
            return 0;
        }
        const double width = sqrt(root) / -a, middle = -b / a;
        return samples_between(c, k, middle - width, middle + width);
    }
    uint64_t in = 0; /* a hyperbola's branch, or what is nearly one: the sphere is beside the point */
    for (int bit = 0; bit < BITS; ++bit) {
        const double y = y_of(c, k, bit);
        in |= (uint64_t)(m + centre.y * y >= cosine * sqrt(n + y * y)) << bit;
    }
    return in;
}

static double count(const covering *c, const uint64_t samples[CHORDS]) {
    double sum = 0.0;
    for (int k = 0; k < CHORDS; ++k) {
        sum += c->chords->share[k] * __builtin_popcountll(samples[k]);
    }
    return sum;
}

/* Counts a cap; returns its share of what is above the horizon. */
static double sample(covering *c, const vshi_cap *cap) {
    const vshi_vec centre = {vshi_dot(cap->centre, c->u), vshi_dot(cap->centre, c->v),
                             vshi_dot(cap->centre, c->axis)};
    uint64_t samples[CHORDS];
    for (int k = 0; k < CHORDS; ++k) {
        samples[k] = samples_in_cap(c, k, centre, cap->cosine) & c->above[k];
        c->covered[k] |= samples[k];
    }
    const double counted = count(c, samples);
    c->counted += counted;
    return counted / c->all;
}

static bool meets_disc(void *user, const double sphere[4]) {
    covering *c = user;
    vshi_cap cap;
    switch (vshi_cap_of(sphere, c->origin, c->far, &cap)) {
    case VSHI_CAP_NONE:
        return true;
    case VSHI_CAP_INSIDE:
        c->visible = 0.0;
        return false;
    case VSHI_CAP_SEEN:
        break;
    }
    if (cap.touching && vshi_dot(c->normal, cap.centre) < -SAME_NORMAL) {
        return true;
    }
    const double across = vshi_length(vshi_cross(cap.centre, c->axis));
    const double angle = vshi_atan2(across, vshi_dot(cap.centre, c->axis)),
                 half = vshi_atan2(cap.sine, cap.cosine);
    if (angle >= half + c->half) {
        return true;
    }
    if (angle + c->half <= half) {
        c->visible = 0.0;
        return false;
    }
    ++c->caps;
    const double beyond = vshi_atan(c->radius);
    const bool within = angle + half <= beyond;
    const bool closed = !c->cut && (within || c->radius <= LARGEST_DISC);
    const double share = closed ? vshi_cap_over_disc(angle, half, c->radius) : 0.0;
    if (closed && c->caps == 1) {
        c->first = cap;
        c->sum = share;
        return true;
    }
    if (!c->counting && c->caps > 1) {
        sample(c, &c->first);
    }
    c->counting = true;
    const double counted = sample(c, &cap);
    c->sum += closed ? share : counted;
    return true;
}

/* The ray to the light's centre, or how near spheres come to it, against the light's size there. */
static bool meets_ray(void *user, const double sphere[4]) {
    covering *c = user;
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(c->origin));
    const double along = vshi_dot(to, c->axis), miss = vshi_length(vshi_cross(to, c->axis)) - sphere[3];
    vshi_cap cap;
    const vshi_cap_kind kind = vshi_cap_of(sphere, c->origin, c->far, &cap);
    if (kind == VSHI_CAP_INSIDE) {
        c->visible = 0.0;
        return false;
    }
    if (kind == VSHI_CAP_NONE || !(along > 0.0) ||
        (cap.touching && vshi_dot(c->normal, cap.centre) < -SAME_NORMAL)) {
        return true;
    }
    const double seen = miss < 0.0 ? 0.0 : c->radius > 0.0 ? miss / (c->radius * along) : 1.0;
    c->visible = fmin(c->visible, seen);
    return c->visible > 0.0;
}

/* Samples above the plane of the normal; false where there are none. */
static bool set_above(covering *c) {
    const vshi_vec n = {vshi_dot(c->normal, c->u), vshi_dot(c->normal, c->v), vshi_dot(c->normal, c->axis)};
    const double sine = vshi_sin(c->half);
    c->all = 1.0;
    c->cut = vshi_dot(c->normal, c->normal) > 0.0 && n.z < sine;
    for (int k = 0; k < CHORDS; ++k) {
        c->covered[k] = 0;
        c->above[k] = UINT64_MAX;
        if (!c->cut) {
            continue;
        }
        const double level = n.x * c->chords->at[k] * c->radius + n.z;
        const double edge = fabs(n.y) > DBL_MIN ? -level / n.y : 0.0, most = c->radius;
        c->above[k] = n.y > DBL_MIN    ? samples_between(c, k, edge, most)
                      : n.y < -DBL_MIN ? samples_between(c, k, -most, edge)
                      : level > 0.0    ? UINT64_MAX
                                       : 0;
    }
    if (c->cut) {
        c->all = count(c, c->above);
    }
    return c->all > 0.0;
}

static float shade_point(const vsh_spheres *spheres, covering *c, vsh_shade_stats *stats) {
    const bool ray = c->classic || !(c->radius > 0.0);
    c->visible = 1.0;
    c->caps = 0;
    c->counting = false;
    c->sum = c->counted = 0.0;
    if (!ray && !set_above(c)) {
        return 1.0f;
    }
    const vshi_ball_cone cone = {{c->origin[0], c->origin[1], c->origin[2]},
                                 {c->axis.x, c->axis.y, c->axis.z},
                                 vshi_sin(c->half),
                                 vshi_cos(c->half),
                                 c->far};
    ++stats->marches;
    stats->samples += vshi_sphere_tree_search(spheres, &cone, ray ? meets_ray : meets_disc, c);
    if (ray || c->visible <= 0.0) {
        return (float)c->visible;
    }
    double hidden = c->sum;
    if (c->counting && c->counted > 0.0) {
        const double together = count(c, c->covered);
        hidden = together >= c->all ? 1.0 : c->sum * together / c->counted;
    }
    stats->certified += hidden <= 0.0 || hidden >= 1.0;
    return (float)(1.0 - fmin(hidden, 1.0));
}

/* Where a light stands, as the point sees it. */
static vshi_light_side aim(covering *c, const vshi_light_place *place, bool hard) {
    vshi_light_view view;
    const vshi_light_side side = vshi_light_look(place, vshi_vec_of(c->origin), hard, &view);
    if (side != VSHI_LIGHT_SEEN) {
        return side;
    }
    c->axis = view.axis;
    c->half = hard ? 0.0 : place->parallel ? place->half : vshi_asin(view.sine);
    c->far = vshi_light_end(&view);
    c->radius = vshi_tan(c->half);
    vshi_frame(c->axis, &c->u, &c->v);
    return side;
}

void vshi_spheres_shadow(const vsh_spheres *spheres, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats) {
    chords of_disc;
    set_chords(&of_disc);
    const vshi_light_place place = vshi_light_in_world(light);
    covering c = {.chords = &of_disc, .classic = method == VSH_SHADOW_CLASSIC};
    for (size_t i = begin; i < end; ++i) {
        float *value = &visibility[i - begin];
        if (!vshi_spheres_origin(points, i, lift, c.origin, &c.normal)) {
            *value = NAN;
            continue;
        }
        const vshi_light_side side = aim(&c, &place, method == VSH_SHADOW_HARD);
        *value = side == VSHI_LIGHT_SEEN ? shade_point(spheres, &c, stats)
                                         : (side == VSHI_LIGHT_WITHIN ? 1.0f : 0.0f);
    }
}

static bool is_outside(void *user, const double sphere[4]) {
    covering *c = user;
    vshi_cap cap;
    c->visible = vshi_cap_of(sphere, c->origin, INFINITY, &cap) == VSHI_CAP_INSIDE ? 0.0 : 1.0;
    return c->visible > 0.0;
}

bool vshi_spheres_hold(const vsh_spheres *spheres, const double position[3]) {
    covering c = {.origin = {position[0], position[1], position[2]}, .visible = 1.0};
    /* whatever bound the point is in, as all directions begin there */
    const vshi_ball_cone here = {{position[0], position[1], position[2]}, {1.0, 0.0, 0.0}, 1.0, 0.0, 0.0};
    vshi_sphere_tree_search(spheres, &here, is_outside, &c);
    return c.visible <= 0.0;
}
