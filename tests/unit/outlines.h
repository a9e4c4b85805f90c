/* Outlines for their tests, and rays against their segments one by one. */
#pragma once

#include "testing.h"

#define PI 3.14159265358979323846

/* Of the package fonts-dejavu-core. */
#define FONT "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf"

static inline vsh_outline *polygons(const double *points, const size_t *counts, size_t count) {
    vsh_outline *outline = NULL;
    assert_ok(vsh_outline_from_polygons(points, counts, count, NULL, &outline, &failure));
    return outline;
}

static inline vsh_outline *polygon(const double *points, size_t count) {
    return polygons(points, &count, 1);
}

static inline vsh_outline *box(double x0, double y0, double x1, double y1) {
    const double points[8] = {x0, y0, x1, y0, x1, y1, x0, y1};
    return polygon(points, 4);
}

/* Lines of text with a height of 1. */
static inline vsh_outline *lines_of(const char *letters, int32_t align) {
    vsh_text_options options = vsh_text_options_default();
    options.height = 1.0;
    options.align = align;
    vsh_outline *outline = NULL;
    assert_ok(vshi_outline_from_text(letters, FONT, &options, NULL, &outline, &failure));
    return outline;
}

static inline vshi_outline_info info_of(const vsh_outline *outline) {
    vshi_outline_info info;
    vshi_outline_get_info(outline, &info);
    return info;
}

/* The points of contour `index`, [*count][2]; NULL and 0 beyond the last. */
static inline const double *contour_of(const vsh_outline *o, size_t index, size_t *count) {
    *count = index < o->contour_count ? o->starts[index + 1] - o->starts[index] - 1 : 0;
    return *count > 0 ? &o->points[o->starts[index]].x : NULL;
}

/* Signed distance at a point, negative inside. */
static inline double distance_to(const vsh_outline *o, const double point[2]) {
    const vshi_point p = {point[0], point[1]};
    const double distance = sqrt(vshi_outline_square(o, p, INFINITY));
    return vshi_outline_winding(o, p) != 0 ? -distance : distance;
}

/* A random number between 0 and 1, the same in every run. */
static inline double any(uint64_t i) {
    i = (i ^ (i >> 30)) * UINT64_C(0xbf58476d1ce4e5b9) + UINT64_C(0x9e3779b97f4a7c15);
    i = (i ^ (i >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (double)((i ^ (i >> 31)) >> 11) * 0x1p-53;
}

/* --- truth: every segment, one by one */

static inline double truth_square(const vsh_outline *o, double x, double y) {
    double least = INFINITY;
    size_t count;
    const double *p;
    for (size_t c = 0; (p = contour_of(o, c, &count)) != NULL; ++c) {
        for (size_t i = 0; i < count; ++i) {
            const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % count);
            const double dx = b[0] - a[0], dy = b[1] - a[1];
            double t = ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy);
            t = fmin(1.0, fmax(0.0, t));
            const double ex = x - a[0] - t * dx, ey = y - a[1] - t * dy;
            least = fmin(least, ex * ex + ey * ey);
        }
    }
    return least;
}

static inline bool truth_inside(const vsh_outline *o, double x, double y) {
    double angle = 0.0; /* sum of the angles under which the point sees the segments */
    size_t count;
    const double *p;
    for (size_t c = 0; (p = contour_of(o, c, &count)) != NULL; ++c) {
        for (size_t i = 0; i < count; ++i) {
            const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % count);
            const double ax = a[0] - x, ay = a[1] - y, bx = b[0] - x, by = b[1] - y;
            angle += atan2(ax * by - ay * bx, ax * bx + ay * by);
        }
    }
    return fabs(angle) > PI;
}

/* Whether a ray from a point in a direction meets a segment before `far`. */
static inline bool truth_hit(const vsh_outline *o, double x, double y, double dx, double dy, double far) {
    size_t count;
    const double *p;
    for (size_t c = 0; (p = contour_of(o, c, &count)) != NULL; ++c) {
        for (size_t i = 0; i < count; ++i) {
            const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % count);
            const double ex = b[0] - a[0], ey = b[1] - a[1], px = a[0] - x, py = a[1] - y;
            const double determinant = dx * ey - dy * ex;
            const double t = (px * ey - py * ex) / determinant, s = (px * dy - py * dx) / determinant;
            if (determinant != 0.0 && s >= 0.0 && s <= 1.0 && t > 0.0 && t < far) {
                return true;
            }
        }
    }
    return false;
}

/* Visible share of the light's angle, by one ray in the middle of each of its parts. */
static inline double truth_visibility(const vsh_outline *o, const vsh_light *light, double x, double y,
                                      int rays) {
    double middle, half, distance = INFINITY;
    if (light->type == VSH_LIGHT_DIRECTIONAL) {
        middle = atan2(light->direction[1], light->direction[0]);
        half = 0.5 * light->angle;
    } else {
        const double lx = light->position[0] - x, ly = light->position[1] - y;
        distance = hypot(lx, ly);
        if (distance <= light->radius) {
            return 1.0;
        }
        middle = atan2(ly, lx);
        half = asin(light->radius / distance);
    }
    int seen = 0;
    for (int i = 0; i < rays; ++i) {
        const double off = half * (2.0 * (i + 0.5) / rays - 1.0);
        double far = INFINITY;
        if (isfinite(distance)) { /* where the ray enters the disc */
            const double beside = distance * sin(off);
            far = distance * cos(off) - sqrt(fmax(0.0, light->radius * light->radius - beside * beside));
        }
        seen += !truth_hit(o, x, y, cos(middle + off), sin(middle + off), far);
    }
    return (double)seen / rays;
}

static inline vsh_light lamp(double x, double y, double radius) {
    vsh_light light = vsh_light_default();
    light.type = VSH_LIGHT_SPHERE;
    light.position[0] = x;
    light.position[1] = y;
    light.radius = radius;
    return light;
}

static inline vsh_light flat_sun(double x, double y, double angle) {
    vsh_light light = vsh_light_default();
    light.direction[0] = x;
    light.direction[1] = y;
    light.angle = angle;
    return light;
}
