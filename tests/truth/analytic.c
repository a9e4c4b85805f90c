#include "analytic.h"

#include "directions.h"

#include <math.h>
#include <stdlib.h>

enum { CULLED_SOLIDS = 64 };

static const double pi = 3.14159265358979323846;

const double truth_seeds_sun[3] = {-0.5, 0.6, -0.6};
const double truth_seeds_w = 0.1;

truth_scene truth_seeds(void) {
    static const truth_solid solids[] = {
        {TRUTH_BOX, {0.0, -0.25, 0.0}, {3.0, 0.25, 3.0}, 0.0, 0.0},
        {TRUTH_SPHERE, {0.0, 0.8, 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0},
        {TRUTH_BOX, {-1.2, 0.7, 0.5}, {0.3, 0.3, 0.3}, 0.05, 0.0},
        {TRUTH_TORUS, {1.2, 0.6, -0.3}, {0.0, 0.0, 0.0}, 0.40, 0.08},
        {TRUTH_BOX, {0.3, 1.0, 1.5}, {0.05, 1.0, 0.05}, 0.0, 0.0},
    };
    return (truth_scene){solids, sizeof solids / sizeof solids[0]};
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double truth_solid_distance(const truth_solid *solid, const double point[3]) {
    double p[3];
    for (int i = 0; i < 3; i++) {
        p[i] = point[i] - solid->center[i];
    }
    switch (solid->shape) {
    case TRUTH_SPHERE:
        return sqrt(dot(p, p)) - solid->radius;
    case TRUTH_TORUS:
        return hypot(hypot(p[0], p[2]) - solid->radius, p[1]) - solid->minor_radius;
    default: {
        double outside = 0.0, inside = -INFINITY;
        for (int i = 0; i < 3; i++) {
            const double q = fabs(p[i]) - solid->half[i];
            outside += q > 0.0 ? q * q : 0.0;
            inside = fmax(inside, q);
        }
        return (inside > 0.0 ? sqrt(outside) : inside) - solid->radius;
    }
    }
}

double truth_distance(truth_scene scene, const double point[3]) {
    double nearest = INFINITY;
    for (size_t i = 0; i < scene.count; i++) {
        nearest = fmin(nearest, truth_solid_distance(&scene.solids[i], point));
    }
    return nearest;
}

/* Whether 0 < t < limit meets the open interval (enter, leave). */
static bool meets(double enter, double leave, double limit) {
    return enter < leave && leave > 0.0 && enter < limit;
}

/* Points whose distance to p + t d is below `radius`: |q|² + 2 t q·d + t² < r². */
static bool hit_sphere(const double q[3], const double d[3], double radius, double limit) {
    const double b = dot(q, d);
    /* The discriminant from the perpendicular, which loses no digits for small spheres far away. */
    double off[3];
    for (int i = 0; i < 3; i++) {
        off[i] = q[i] - b * d[i];
    }
    const double square = radius * radius - dot(off, off);
    if (square <= 0.0) {
        return false;
    }
    const double root = sqrt(square);
    return meets(-b - root, -b + root, limit);
}

static bool hit_box(const double q[3], const double d[3], const double half[3], double limit) {
    double enter = -INFINITY, leave = INFINITY;
    for (int i = 0; i < 3; i++) {
        if (d[i] == 0.0) {
            if (fabs(q[i]) >= half[i]) {
                return false;
            }
            continue;
        }
        const double a = (-half[i] - q[i]) / d[i], b = (half[i] - q[i]) / d[i];
        enter = fmax(enter, fmin(a, b));
        leave = fmin(leave, fmax(a, b));
    }
    return meets(enter, leave, limit);
}

/* A cylinder along `axis` about the origin of q, without caps beyond ±half: they lie inside other parts. */
static bool hit_cylinder(const double q[3], const double d[3], int axis, double half, double radius,
                         double limit) {
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double a = d[j] * d[j] + d[k] * d[k];
    double enter = -INFINITY, leave = INFINITY;
    if (a > 0.0) {
        const double b = q[j] * d[j] + q[k] * d[k], cross = q[j] * d[k] - q[k] * d[j];
        const double square = radius * radius * a - cross * cross;
        if (square <= 0.0) {
            return false;
        }
        const double root = sqrt(square);
        enter = (-b - root) / a;
        leave = (-b + root) / a;
    } else if (q[j] * q[j] + q[k] * q[k] >= radius * radius) {
        return false;
    }
    if (d[axis] == 0.0) {
        return fabs(q[axis]) < half && meets(enter, leave, limit);
    }
    const double s = (-half - q[axis]) / d[axis], t = (half - q[axis]) / d[axis];
    return meets(fmax(enter, fmin(s, t)), fmin(leave, fmax(s, t)), limit);
}

/* A box grown by a radius is the union of three boxes, twelve cylinders and eight spheres: no iteration. */
static bool hit_rounded_box(const double q[3], const double d[3], const double half[3], double radius,
                            double limit) {
    const double grown[3] = {half[0] + radius, half[1] + radius, half[2] + radius};
    if (!hit_box(q, d, grown, limit)) {
        return false;
    }
    bool hit = false;
    for (int axis = 0; axis < 3 && !hit; axis++) {
        double part[3] = {half[0], half[1], half[2]};
        part[axis] = grown[axis];
        hit = hit_box(q, d, part, limit);
    }
    for (int i = 0; i < 12 && !hit; i++) {
        double from[3] = {q[0], q[1], q[2]};
        const int axis = i / 4, j = (axis + 1) % 3, k = (axis + 2) % 3;
        from[j] -= (i & 1) != 0 ? half[j] : -half[j];
        from[k] -= (i & 2) != 0 ? half[k] : -half[k];
        hit = hit_cylinder(from, d, axis, half[axis], radius, limit);
    }
    for (int corner = 0; corner < 8 && !hit; corner++) {
        double from[3];
        for (int i = 0; i < 3; i++) {
            from[i] = q[i] - (((corner >> i) & 1) != 0 ? half[i] : -half[i]);
        }
        hit = hit_sphere(from, d, radius, limit);
    }
    return hit;
}

/* Real roots of t³ + a t² + b t + c, by the trigonometric and Cardano forms (Press and others, "Numerical
 * recipes", 5.6), each bettered by Newton steps. */
static int cubic_roots(double a, double b, double c, double roots[3]) {
    const double q = (a * a - 3.0 * b) / 9.0, r = (2.0 * a * a * a - 9.0 * a * b + 27.0 * c) / 54.0;
    int count = 1;
    if (r * r < q * q * q) {
        const double angle = acos(fmin(1.0, fmax(-1.0, r / sqrt(q * q * q))));
        count = 3;
        for (int i = 0; i < 3; i++) {
            roots[i] = -2.0 * sqrt(q) * cos((angle + 2.0 * pi * (i - 1)) / 3.0) - a / 3.0;
        }
    } else {
        const double s = -copysign(cbrt(fabs(r) + sqrt(fmax(0.0, r * r - q * q * q))), r);
        roots[0] = s + (s != 0.0 ? q / s : 0.0) - a / 3.0;
    }
    for (int i = 0; i < count; i++) {
        for (int step = 0; step < 3; step++) {
            const double t = roots[i], slope = (3.0 * t + 2.0 * a) * t + b;
            roots[i] -= slope != 0.0 ? (((t + a) * t + b) * t + c) / slope : 0.0;
        }
    }
    return count;
}

/* f = (|p|² + R² - r²)² - 4 R² (x² + z²) is negative inside the torus and a quartic along a ray. The ray
 * enters where f's least value is negative, and that lies at an end or where the cubic f' is 0: an error in t
 * there hardly moves f, so grazing rays need no care. */
static bool hit_torus(const double q[3], const double d[3], double ring, double tube, double limit) {
    const double middle = -dot(q, d); /* t is 0 nearest to the centre: small coefficients */
    double o[3];
    for (int i = 0; i < 3; i++) {
        o[i] = q[i] + middle * d[i];
    }
    const double square = (ring + tube) * (ring + tube) - dot(o, o);
    if (square <= 0.0) {
        return false;
    }
    const double low = fmax(-middle, -sqrt(square)), high = fmin(limit - middle, sqrt(square));
    if (low >= high) {
        return false;
    }
    /* |p|² = k + t², as o·d = 0. */
    const double g = dot(o, o) + ring * ring - tube * tube, four = 4.0 * ring * ring;
    const double c2 = 2.0 * g - four * (d[0] * d[0] + d[2] * d[2]);
    const double c1 = -2.0 * four * (o[0] * d[0] + o[2] * d[2]);
    const double c0 = g * g - four * (o[0] * o[0] + o[2] * o[2]);
    double at[5] = {low, high};
    const int count = cubic_roots(0.0, c2 / 2.0, c1 / 4.0, at + 2);
    for (int i = 0; i < 2 + count; i++) {
        const double t = at[i];
        if (t >= low && t <= high && ((t * t + c2) * t + c1) * t + c0 < 0.0) {
            return true;
        }
    }
    return false;
}

bool truth_solid_hit(const truth_solid *solid, const double origin[3], const double direction[3],
                     double limit) {
    double q[3];
    for (int i = 0; i < 3; i++) {
        q[i] = origin[i] - solid->center[i];
    }
    switch (solid->shape) {
    case TRUTH_SPHERE:
        return hit_sphere(q, direction, solid->radius, limit);
    case TRUTH_TORUS:
        return hit_torus(q, direction, solid->radius, solid->minor_radius, limit);
    default:
        return solid->radius > 0.0 ? hit_rounded_box(q, direction, solid->half, solid->radius, limit)
                                   : hit_box(q, direction, solid->half, limit);
    }
}

bool truth_hit(truth_scene scene, const double origin[3], const double direction[3], double limit) {
    for (size_t i = 0; i < scene.count; i++) {
        if (truth_solid_hit(&scene.solids[i], origin, direction, limit)) {
            return true;
        }
    }
    return false;
}

/* Whether the cone around unit `axis` of half angle `angle`, up to `limit`, may meet a solid: it does not if
 * it misses the sphere around the solid. */
static bool cone_meets(const truth_solid *solid, const double point[3], const double axis[3], double angle,
                       double limit) {
    double to[3];
    for (int i = 0; i < 3; i++) {
        to[i] = solid->center[i] - point[i];
    }
    const double length = sqrt(dot(to, to)),
                 radius = solid->radius + solid->minor_radius + sqrt(dot(solid->half, solid->half));
    return length <= radius ||
           (length - radius < limit &&
            acos(fmin(1.0, fmax(-1.0, dot(to, axis) / length))) <= angle + asin(radius / length) + 1e-9);
}

static truth_scene cull(truth_scene scene, const double point[3], const double axis[3], double angle,
                        double limit, truth_solid kept[CULLED_SOLIDS]) {
    if (scene.count > CULLED_SOLIDS) {
        return scene;
    }
    size_t count = 0;
    for (size_t i = 0; i < scene.count; i++) {
        if (cone_meets(&scene.solids[i], point, axis, angle, limit)) {
            kept[count++] = scene.solids[i];
        }
    }
    return (truth_scene){kept, count};
}

/* The share of `directions` [rays][3] that is free, all of them within the cone of tangent w around `axis`.
 */
static double free_share(truth_scene scene, const double point[3], const double *normal, const double axis[3],
                         double w, double limit, const double *directions, size_t rays) {
    truth_solid kept[CULLED_SOLIDS];
    const truth_scene near = cull(scene, point, axis, atan(w), limit, kept);
    const bool risen = normal == NULL || dot(normal, axis) > w * sqrt(dot(normal, normal));
    if (near.count == 0 && risen) {
        return 1.0;
    }
    size_t seen = 0;
    for (size_t i = 0; i < rays; i++) {
        const double *direction = &directions[3 * i];
        seen += (risen || dot(normal, direction) > 0.0) && !truth_hit(near, point, direction, limit);
    }
    return (double)seen / (double)rays;
}

int truth_lights(truth_scene scene, size_t count, const double *points, const double *normal,
                 const double towards[3], double w, double limit, size_t rays, float *visible) {
    double *directions = calloc(rays, 3 * sizeof *directions);
    if (directions == NULL) {
        return -1;
    }
    const truth_frame frame = truth_frame_around(towards);
    for (size_t i = 0; i < rays; i++) {
        truth_light_direction(&frame, w, i, rays, &directions[3 * i]);
    }
    for (size_t i = 0; i < count; i++) {
        visible[i] = (float)free_share(scene, &points[3 * i], normal, frame.n, w, limit, directions, rays);
    }
    free(directions);
    return 0;
}

double truth_light(truth_scene scene, const double point[3], const double *normal, const double towards[3],
                   double w, double limit, size_t rays) {
    float visible = NAN;
    truth_lights(scene, 1, point, normal, towards, w, limit, rays, &visible);
    return (double)visible;
}

double truth_ao(truth_scene scene, const double point[3], const double normal[3], double distance,
                size_t rays) {
    const truth_frame frame = truth_frame_around(normal);
    truth_solid kept[CULLED_SOLIDS];
    const truth_scene near = cull(scene, point, frame.n, pi / 2.0, distance, kept);
    if (near.count == 0) {
        return 1.0;
    }
    size_t open = 0;
    for (size_t i = 0; i < rays; i++) {
        double direction[3];
        truth_cosine_direction(&frame, i, rays, direction);
        open += !truth_hit(near, point, direction, distance);
    }
    return (double)open / (double)rays;
}
