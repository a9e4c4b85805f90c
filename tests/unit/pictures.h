/* A pinhole camera by other means than the library's, and short ways to small pictures. */
#ifndef TESTS_PICTURES_H
#define TESTS_PICTURES_H

#include "testing.h"

#include "previews.h"
#include "shading.h"

enum { WIDE = 64, HIGH = 48, PIXELS = WIDE * HIGH };

static float color[3 * PIXELS], alpha[PIXELS], depth[PIXELS], normal[3 * PIXELS];
static const vsh_picture picture = {color, alpha, depth, normal};

/* --- the same pinhole, by other means */

typedef struct pinhole {
    double eye[3], forward[3], right[3], up[3], pixel;
} pinhole;

static inline void normalise(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; ++i) {
        v[i] /= length;
    }
}

static inline void cross(const double a[3], const double b[3], double c[3]) {
    for (int i = 0; i < 3; ++i) {
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    }
}

static inline double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline pinhole pinhole_of(const vsh_camera *camera) {
    pinhole p;
    memcpy(p.eye, camera->position, sizeof p.eye);
    for (int i = 0; i < 3; ++i) {
        p.forward[i] = camera->target[i] - camera->position[i];
    }
    normalise(p.forward);
    cross(p.forward, camera->up, p.right);
    normalise(p.right);
    cross(p.right, p.forward, p.up);
    p.pixel = 2.0 * tan(0.5 * camera->fov) / HIGH;
    return p;
}

/* Through the middle of a pixel; 1 along the axis. */
static inline void ray_of(const pinhole *p, int x, int y, double ray[3]) {
    for (int i = 0; i < 3; ++i) {
        ray[i] = p->forward[i] +
                 p->pixel * ((x + 0.5 - 0.5 * WIDE) * p->right[i] - (y + 0.5 - 0.5 * HIGH) * p->up[i]);
    }
}

static inline vsh_camera camera_at(double x, double y, double z, double tx, double ty, double tz,
                                   double fov_deg) {
    vsh_camera camera = vsh_camera_default();
    const double position[3] = {x, y, z}, target[3] = {tx, ty, tz};
    memcpy(camera.position, position, sizeof position);
    memcpy(camera.target, target, sizeof target);
    camera.fov = RADIANS(fov_deg);
    return camera;
}

static inline vsh_render_options small(vsh_camera camera, int32_t samples) {
    vsh_render_options o = preview_render_options();
    o.camera = camera;
    o.width = WIDE;
    o.height = HIGH;
    o.samples = samples;
    return o;
}

static inline void render(const vsh_surface *surfaces, size_t count, const vsh_field *field,
                          const vsh_light *light, const vsh_render_options *options, const vsh_run *run) {
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_render(surfaces, count, occluders_of(field), light, light != NULL, options, run, &picture,
                         &stats, &failure));
    assert_int_equal(stats.unfinished, 0);
}

static inline vsh_field *ball(double x, double y, double z, double radius, double voxel) {
    const truth_solid solid = {.shape = TRUTH_SPHERE, .center = {x, y, z}, .radius = radius};
    return field_of((truth_scene){&solid, 1}, voxel, 0.0);
}

#endif
