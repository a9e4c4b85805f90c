/* Rectangular area lights, measured by solid angle. Rays are uniform over the rectangle's projection on the
 * sphere of directions (C. Urena, M. Fajardo and A. King, "An area-preserving parametrization for spherical
 * rectangles", 2013). Methods of one march use the disc of the same solid angle (A. van Oosterom and J.
 * Strackee, "The solid angle of a plane triangle", 1983). */
#include "light/light.h"

#include "base/error.h"

#include <stdio.h>

static const double PI = 3.14159265358979323846;

/* Lengths of sides, world units; the largest cosine between the sides. */
static const double SHORTEST = 1e-15, LONGEST = 1e15, SKEW = 1e-3;

/* A softness of 0 scales by this. */
static const double LEAST_FACTOR = 0x1p-20;

/* Rays omit this part of the way, so that a surface under the light does not hide it. */
static const double HAIR = 0x1p-14;

/* Proofs leave out cones whose rim has a smaller cosine: such wide cones hardly ever prove anything. */
static const double WIDEST = 0.09;

/* Proofs use cones wider by this part, against rounding. */
static const double ROOM = 1e-6;

/* Below this angle, steradians, rays are uniform in area. Distances and cosines then agree to 3e-4, and
 * doubles no longer hold the angles of the projected sides. */
static const double SMALL = 1e-7;

/* --- solid angles, with the point `height` over the rectangle's plane */

typedef struct flat_point {
    double x, y; /* in the plane, from the foot of the point */
} flat_point;

static double triangle_angle(double height, flat_point a, flat_point b, flat_point c) {
    const double square = height * height;
    const double la = sqrt(a.x * a.x + a.y * a.y + square), lb = sqrt(b.x * b.x + b.y * b.y + square),
                 lc = sqrt(c.x * c.x + c.y * c.y + square);
    const double ab = a.x * b.x + a.y * b.y + square, bc = b.x * c.x + b.y * c.y + square,
                 ca = c.x * a.x + c.y * a.y + square;
    const double volume = height * fabs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
    return 2.0 * vshi_atan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb);
}

static double polygon_angle(double height, const flat_point *points, int count) {
    double sum = 0.0;
    for (int i = 2; i < count; ++i) {
        sum += triangle_angle(height, points[0], points[i - 1], points[i]);
    }
    return sum;
}

static double polygon_area(const flat_point *points, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; ++i) {
        const flat_point a = points[i], b = points[(i + 1) % count];
        sum += 0.5 * (a.x * b.y - a.y * b.x);
    }
    return fabs(sum);
}

/* The patch without its constants. *over is the point's height above the plane, negative behind the light. */
static vshi_light_patch see(const vshi_light_place *place, vshi_vec from, double *over) {
    const vshi_vec to = vshi_sub(place->centre, from);
    const double x = vshi_dot(to, place->x), y = vshi_dot(to, place->y);
    *over = -vshi_dot(to, place->normal);
    return (vshi_light_patch){.x = {x - place->half_width, x + place->half_width},
                              .y = {y - place->half_height, y + place->half_height},
                              .height = fabs(*over),
                              .down = vshi_scale(place->normal, *over < 0.0 ? 1.0 : -1.0)};
}

static void corners_of(const vshi_light_patch *s, flat_point corners[4]) {
    for (int i = 0; i < 4; ++i) { /* around */
        corners[i] = (flat_point){s->x[i == 1 || i == 2], s->y[i >= 2]};
    }
}

/* The vector from the point to a place on the plane. */
static vshi_vec turn(const vshi_light_place *place, const vshi_light_patch *s, flat_point p) {
    return vshi_add(vshi_add(vshi_scale(place->x, p.x), vshi_scale(place->y, p.y)),
                    vshi_scale(s->down, s->height));
}

/* Sets the constants of Urena and others for a point above the plane. */
static void set_constants(vshi_light_patch *p) {
    const double x0 = p->x[0], x1 = p->x[1], y0 = p->y[0], y1 = p->y[1], square = p->height * p->height;
    const double n[4] = {-y0 / sqrt(square + y0 * y0), x1 / sqrt(square + x1 * x1),
                         y1 / sqrt(square + y1 * y1), -x0 / sqrt(square + x0 * x0)};
    double g[4];
    for (int i = 0; i < 4; ++i) {
        g[i] = vshi_acos(fmin(fmax(-n[i] * n[(i + 1) % 4], -1.0), 1.0));
    }
    p->b0 = n[0];
    p->b1 = n[2];
    p->k = 2.0 * PI - g[2] - g[3];
    p->angle = g[0] + g[1] - p->k;
}

/* Finds a cone around all four corners, about the mean direction to them. */
static void bound(const vshi_light_place *place, const vshi_light_patch *s, const flat_point corners[4],
                  vshi_light_view *view) {
    vshi_vec way[4], sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < 4; ++i) {
        way[i] = turn(place, s, corners[i]);
        sum = vshi_add(sum, vshi_unit(way[i]));
    }
    view->axis = vshi_unit(sum);
    if (!(vshi_dot(view->axis, s->down) > 0.0) && s->height > 0.0) {
        view->axis = s->down;
    }
    double sine = 0.0, cosine = 1.0;
    view->near = INFINITY;
    view->end = 0.0;
    for (int i = 0; i < 4; ++i) {
        const double along = vshi_dot(way[i], view->axis), length = vshi_length(way[i]);
        view->near = fmin(view->near, along);
        view->end = fmax(view->end, along);
        cosine = fmin(cosine, along / length);
        sine = fmax(sine, vshi_length(vshi_cross(vshi_unit(way[i]), view->axis)));
    }
    view->bound = cosine > WIDEST ? sine * (1.0 + ROOM) : INFINITY;
}

static vshi_light_side look(const vshi_light_place *place, vshi_vec from, bool hard, vshi_light_view *view) {
    double over;
    const vshi_light_patch s = see(place, from, &over);
    if (!place->two_sided && !(over > 0.0)) {
        return VSHI_LIGHT_AWAY;
    }
    if (hard) {
        const vshi_vec to = vshi_sub(place->centre, from);
        const double end = vshi_length(to) * (1.0 - HAIR);
        *view = (vshi_light_view){.axis = vshi_unit(to), .distance = end, .near = end, .end = end};
        return end > 0.0 ? VSHI_LIGHT_SEEN : VSHI_LIGHT_WITHIN;
    }
    const bool within = s.x[0] < 0.0 && s.x[1] > 0.0 && s.y[0] < 0.0 && s.y[1] > 0.0;
    if (s.height <= 0.0 && within) {
        return VSHI_LIGHT_WITHIN;
    }
    flat_point corners[4];
    corners_of(&s, corners);
    *view = (vshi_light_view){.axis = {0.0, 0.0, 0.0}};
    bound(place, &s, corners, view);
    /* the disc of the same solid angle; its cone ends at the plane of the rectangle */
    const double solid = polygon_angle(s.height, corners, 4), part = solid / (2.0 * PI);
    view->sine = vshi_light_sine(sqrt(part * (2.0 - part)));
    const double towards = vshi_dot(view->axis, s.down);
    const double end = s.height > 0.0 ? s.height / (towards + view->sine) : view->near;
    view->distance = end / (1.0 - view->sine * view->sine);
    view->patch = s;
    if (solid > SMALL) {
        set_constants(&view->patch);
    }
    return VSHI_LIGHT_SEEN;
}

/* --- rays */

/* Maps the unit disc to the unit square, the inverse of Shirley and Chiu (trace/sampler.c). It keeps areas.
 */
static void to_square(const double disc[2], double square[2]) {
    const double radius = sqrt(disc[0] * disc[0] + disc[1] * disc[1]);
    double x = 0.0, y = 0.0;
    if (fabs(disc[0]) > fabs(disc[1])) {
        x = disc[0] > 0.0 ? radius : -radius;
        y = x * (4.0 / PI) * vshi_atan(disc[1] / disc[0]);
    } else if (radius > 0.0) {
        y = disc[1] > 0.0 ? radius : -radius;
        x = y * (4.0 / PI) * vshi_atan(disc[0] / disc[1]);
    }
    square[0] = fmin(fmax(0.5 * (x + 1.0), 0.0), 1.0);
    square[1] = fmin(fmax(0.5 * (y + 1.0), 0.0), 1.0);
}

static double mix(const double ends[2], double part) {
    return ends[0] + part * (ends[1] - ends[0]);
}

static double clamp(double value, const double ends[2]) {
    return fmin(fmax(value, ends[0]), ends[1]); /* NaN becomes ends[0] */
}

/* Finds a place on the rectangle, uniform in solid angle. */
static flat_point place_by_angle(const vshi_light_patch *p, const double square[2]) {
    const double turned = square[0] * p->angle + p->k, z = p->height;
    const double f = (vshi_cos(turned) * p->b0 - p->b1) / vshi_sin(turned);
    const double cosine = (f > 0.0 ? 1.0 : -1.0) / sqrt(f * f + p->b0 * p->b0);
    const double across = 1.0 - cosine * cosine;
    const double x = clamp(cosine * z / sqrt(fmax(across, 1e-30)), p->x);
    const double d = sqrt(x * x + z * z);
    const double ends[2] = {p->y[0] / sqrt(d * d + p->y[0] * p->y[0]),
                            p->y[1] / sqrt(d * d + p->y[1] * p->y[1])};
    const double h = mix(ends, square[1]);
    return (flat_point){x, clamp(h * d / sqrt(fmax(1.0 - h * h, 1e-30)), p->y)};
}

static vshi_vec aim_ray(const vshi_light_place *place, const vshi_light_view *view, const double disc[2]) {
    const vshi_light_patch *p = &view->patch;
    double square[2];
    to_square(disc, square);
    flat_point at = {mix(p->x, square[0]), mix(p->y, square[1])};
    if (p->angle > 0.0) {
        at = place_by_angle(p, square);
    }
    return vshi_scale(turn(place, p, at), 1.0 - HAIR);
}

/* --- horizons and sides */

/* Clips the rectangle to the positive side of a line, at `level` from each corner. */
static int clip(const flat_point corners[4], const double level[4], flat_point kept[5]) {
    int count = 0;
    for (int i = 0; i < 4; ++i) {
        const int next = (i + 1) % 4;
        if (level[i] > 0.0) {
            kept[count++] = corners[i];
        }
        if ((level[i] > 0.0) != (level[next] > 0.0)) {
            const double t = level[i] / (level[i] - level[next]);
            kept[count++] = (flat_point){corners[i].x + t * (corners[next].x - corners[i].x),
                                         corners[i].y + t * (corners[next].y - corners[i].y)};
        }
    }
    return count;
}

static double share_above(const vshi_light_place *place, vshi_vec from, vshi_vec normal) {
    double over, level[4];
    const vshi_light_patch s = see(place, from, &over);
    flat_point corners[4], kept[5];
    corners_of(&s, corners);
    for (int i = 0; i < 4; ++i) {
        level[i] = vshi_dot(turn(place, &s, corners[i]), normal);
    }
    const int count = clip(corners, level, kept);
    if (count < 3) {
        return 0.0;
    }
    const double all = polygon_angle(s.height, corners, 4);
    const double part = all > 0.0 ? polygon_angle(s.height, kept, count) / all
                                  : polygon_area(kept, count) / polygon_area(corners, 4);
    return fmin(part, 1.0);
}

static bool faces(const vshi_light_place *place, vshi_vec centre, double radius) {
    return place->two_sided || vshi_dot(vshi_sub(centre, place->centre), place->normal) > radius;
}

static void move(vshi_light_place *place, const double matrix[12], double unit) {
    place->x = vshi_unit(vshi_transform_vector(matrix, place->x));
    place->y = vshi_unit(vshi_transform_vector(matrix, place->y));
    place->normal = vshi_unit(vshi_transform_vector(matrix, place->normal));
    place->half_width /= unit;
    place->half_height /= unit;
}

/* --- the table's row */

static const vshi_light_shape shape = {look, aim_ray, share_above, faces, move};

static void set_place(const vsh_light *light, vshi_light_place *place) {
    const vshi_vec u = vshi_vec_of(light->edge_u), v = vshi_vec_of(light->edge_v), x = vshi_unit(u);
    const vshi_vec y = vshi_unit(vshi_sub(v, vshi_scale(x, vshi_dot(v, x))));
    *place = (vshi_light_place){.centre = vshi_vec_of(light->position),
                                .shape = &shape,
                                .x = x,
                                .y = y,
                                .normal = vshi_cross(x, y),
                                .half_width = 0.5 * vshi_length(u),
                                .half_height = 0.5 * vshi_length(v),
                                .two_sided = light->two_sided != 0};
    place->radius = sqrt(place->half_width * place->half_width + place->half_height * place->half_height);
}

/* A plane surface shines by the cosine. The inverse square, integrated over its parts, is the solid angle
 * over the area. */
static double find_gain(const vsh_light *light, vshi_vec to_light, double distance) {
    vshi_light_place place;
    set_place(light, &place);
    const double cosine = -vshi_dot(to_light, place.normal), facing = place.two_sided ? fabs(cosine) : cosine;
    if (!(facing > 0.0)) {
        return 0.0;
    }
    if (light->falloff != VSH_FALLOFF_INVERSE_SQUARE) {
        return facing * vshi_light_falloff(light, distance);
    }
    double over;
    const vshi_light_patch s = see(&place, vshi_sub(place.centre, vshi_scale(to_light, distance)), &over);
    flat_point corners[4];
    corners_of(&s, corners);
    return polygon_angle(s.height, corners, 4) / (4.0 * place.half_width * place.half_height);
}

static int describe(const vsh_light *light, char *text, size_t size) {
    const double *p = light->position, *u = light->edge_u, *v = light->edge_v;
    return snprintf(text, size, "rectangle at %.9g %.9g %.9g, sides %.9g %.9g %.9g and %.9g %.9g %.9g, %s",
                    p[0], p[1], p[2], u[0], u[1], u[2], v[0], v[1], v[2],
                    light->two_sided != 0 ? "two-sided" : "one-sided");
}

static void resize(vsh_light *light, double factor) {
    const double by = fmax(factor, LEAST_FACTOR);
    for (int axis = 0; axis < 3; ++axis) {
        light->edge_u[axis] *= by;
        light->edge_v[axis] *= by;
    }
}

static vsh_result check(const vsh_light *light, vsh_error *error) {
    const vshi_vec u = vshi_vec_of(light->edge_u), v = vshi_vec_of(light->edge_v);
    const double lengths[2] = {vshi_length(u), vshi_length(v)};
    for (int i = 0; i < 2; ++i) {
        if (!(lengths[i] >= SHORTEST && lengths[i] <= LONGEST)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "light '%s': %s has the length %.9g, out of range %g … %g", light->name,
                             i == 0 ? "edge_u" : "edge_v", lengths[i], SHORTEST, LONGEST);
        }
    }
    const double cosine = vshi_dot(vshi_unit(u), vshi_unit(v));
    if (!(fabs(cosine) <= SKEW)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "light '%s': edge_u and edge_v are not at right angles: the cosine between them is "
                         "%.9g, of at most %g",
                         light->name, cosine, SKEW);
    }
    return VSH_OK;
}

const vshi_light_type vshi_rectangle_type = {"rectangle", true,   set_place, find_gain,
                                             describe,    resize, check};
