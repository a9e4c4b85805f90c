/* Cameras: their checks, and views that show a box or points. */
#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/vec.h"
#include "render/render.h"

#include <vdbshade/picture.h>

static const double FOV_LEAST = 0.001, FOV_MOST = 3.0;
/* Smallest sine of the angle between view and up. */
static const double PARALLEL = 1e-6;
/* Size of the picture over that of a framed box, and of framed points. */
static const double MARGIN = 1.06, POINTS_MARGIN = 1.16;

static vsh_result check_vector(const char *name, const double v[3], vsh_error *error) {
    return vshi_finite(vshi_vec_of(v))
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: %s (%g, %g, %g) is not finite", name, v[0],
                           v[1], v[2]);
}

/* Checks the members other than position and target. */
static vsh_result check_lens(const vsh_camera *camera, vsh_error *error) {
    const double *up = camera->up;
    VSHI_TRY(check_vector("up", up, error));
    if (up[0] == 0.0 && up[1] == 0.0 && up[2] == 0.0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: up is (0, 0, 0)");
    }
    if (!(camera->fov >= FOV_LEAST && camera->fov <= FOV_MOST)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: fov %g is out of range %g … %g", camera->fov,
                         FOV_LEAST, FOV_MOST);
    }
    return VSH_OK;
}

/* Copies the caller's struct over defaults. */
static vsh_result resolve(const vsh_camera *camera, vsh_camera *full, vsh_error *error) {
    *full = vsh_camera_default();
    return camera == NULL ? vshi_fail(error, VSH_ERROR_ARGUMENT, "camera is NULL")
                          : vshi_options_resolve(camera, full, sizeof *full, "vsh_camera", error);
}

vsh_result vshi_camera_check(const vsh_camera *camera, vsh_error *error) {
    vsh_camera full;
    VSHI_TRY(resolve(camera, &full, error));
    VSHI_TRY(check_vector("position", full.position, error));
    VSHI_TRY(check_vector("target", full.target, error));
    VSHI_TRY(check_lens(&full, error));
    const vshi_vec view = vshi_unit(vshi_sub(vshi_vec_of(full.target), vshi_vec_of(full.position)));
    if (!(vshi_dot(view, view) > 0.5)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: position and target are both (%g, %g, %g)",
                         full.position[0], full.position[1], full.position[2]);
    }
    const vshi_vec across = vshi_cross(view, vshi_unit(vshi_vec_of(full.up)));
    if (!(vshi_length(across) > PARALLEL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: up (%g, %g, %g) lies along the view", full.up[0],
                         full.up[1], full.up[2]);
    }
    return VSH_OK;
}

/* Unit axes of a view: to the right, up, and back towards the eye. */
typedef struct view_axes {
    vshi_vec across, over, back;
} view_axes;

static view_axes find_axes(const vsh_camera *camera, double azimuth, double elevation) {
    const vshi_vec up = vshi_unit(vshi_vec_of(camera->up));
    const vshi_vec wish =
        fabs(up.z) < 0.9 ? (vshi_vec){0.0, 0.0, 1.0} : (vshi_vec){0.0, -1.0, 0.0}; /* azimuth 0 */
    const vshi_vec front = vshi_unit(vshi_sub(wish, vshi_scale(up, vshi_dot(wish, up))));
    const vshi_vec right = vshi_cross(up, front);
    const vshi_vec level =
        vshi_add(vshi_scale(front, vshi_cos(azimuth)), vshi_scale(right, vshi_sin(azimuth)));
    view_axes axes;
    axes.back = vshi_add(vshi_scale(level, vshi_cos(elevation)), vshi_scale(up, vshi_sin(elevation)));
    axes.across = vshi_unit(vshi_cross(up, axes.back));
    axes.over = vshi_cross(axes.back, axes.across);
    return axes;
}

/* Resolves and checks a camera that is about to be placed, and finds its axes. */
static vsh_result begin_frame(const vsh_camera *camera, double azimuth, double elevation, double aspect,
                              vsh_camera *full, view_axes *axes, vsh_error *error) {
    VSHI_TRY(resolve(camera, full, error));
    VSHI_TRY(check_lens(full, error));
    if (!(isfinite(azimuth) && fabs(elevation) <= 1.57 && aspect > 0.0 && isfinite(aspect))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "camera: azimuth %g, elevation %g, aspect %g: expected a number, -1.57 … 1.57 and a "
                         "number above 0",
                         azimuth, elevation, aspect);
    }
    *axes = find_axes(full, azimuth, elevation);
    return VSH_OK;
}

/* A point with coordinates `across` and `back` is visible if |across - eye's across| <= tangent × (eye's back
 * - back). So the nearest eye that sees all points lies where the largest across + tangent × back meets the
 * largest tangent × back - across. The same holds for `over`. */
vsh_result vsh_camera_frame_points(vsh_camera *camera, size_t count, const double *points, double azimuth,
                                   double elevation, double aspect, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(points);
    vsh_camera full;
    view_axes axes;
    VSHI_TRY(begin_frame(camera, azimuth, elevation, aspect, &full, &axes, error));
    const double tangent[2] = {aspect * vshi_tan(0.5 * full.fov) / POINTS_MARGIN,
                               vshi_tan(0.5 * full.fov) / POINTS_MARGIN};
    double high[2] = {-INFINITY, -INFINITY}, low[2] = {-INFINITY, -INFINITY};
    double near = -INFINITY, far = INFINITY, size = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_vec_of(points + 3 * i);
        if (!vshi_finite(p)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: point %zu (%g, %g, %g) is not finite", i,
                             p.x, p.y, p.z);
        }
        const double at[2] = {vshi_dot(p, axes.across), vshi_dot(p, axes.over)},
                     back = vshi_dot(p, axes.back);
        for (int axis = 0; axis < 2; ++axis) {
            high[axis] = fmax(high[axis], at[axis] + tangent[axis] * back);
            low[axis] = fmax(low[axis], -at[axis] + tangent[axis] * back);
        }
        near = fmax(near, back);
        far = fmin(far, back);
        size = fmax(size, vshi_length(vshi_sub(p, vshi_vec_of(points))));
    }
    if (!(size > 0.0) || !isfinite(size)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: %zu points without extent", count);
    }
    const double away =
        fmax(fmax((high[0] + low[0]) / (2.0 * tangent[0]), (high[1] + low[1]) / (2.0 * tangent[1])),
             near + 0.01 * size);
    const vshi_vec middle = vshi_add(vshi_scale(axes.across, 0.5 * (high[0] - low[0])),
                                     vshi_scale(axes.over, 0.5 * (high[1] - low[1])));
    vshi_vec_to_doubles(vshi_add(middle, vshi_scale(axes.back, away)), camera->position);
    vshi_vec_to_doubles(vshi_add(middle, vshi_scale(axes.back, 0.5 * (near + far))), camera->target);
    return VSH_OK;
}

vsh_result vsh_camera_frame(vsh_camera *camera, const double bounds_min[3], const double bounds_max[3],
                            double azimuth, double elevation, double aspect, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(bounds_min, bounds_max);
    vsh_camera full;
    view_axes axes;
    VSHI_TRY(begin_frame(camera, azimuth, elevation, aspect, &full, &axes, error));
    const vshi_vec low = vshi_vec_of(bounds_min), high = vshi_vec_of(bounds_max);
    const vshi_vec size = vshi_sub(high, low);
    if (!vshi_finite(low) || !vshi_finite(high) || !vshi_finite(size) || size.x < 0.0 || size.y < 0.0 ||
        size.z < 0.0 || !(vshi_length(size) > 0.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "camera: the box from (%g, %g, %g) to (%g, %g, %g) has no size", low.x, low.y, low.z,
                         high.x, high.y, high.z);
    }
    const double tangent = vshi_tan(0.5 * full.fov) / MARGIN;
    double away = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const vshi_vec c = {(corner & 1 ? 0.5 : -0.5) * size.x, (corner & 2 ? 0.5 : -0.5) * size.y,
                            (corner & 4 ? 0.5 : -0.5) * size.z};
        const double tall = fabs(vshi_dot(c, axes.over)), wide = fabs(vshi_dot(c, axes.across)) / aspect;
        away = fmax(away, vshi_dot(c, axes.back) + fmax(tall, wide) / tangent);
    }
    const vshi_vec middle = vshi_add(low, vshi_scale(size, 0.5));
    vshi_vec_to_doubles(vshi_add(middle, vshi_scale(axes.back, away)), camera->position);
    vshi_vec_to_doubles(middle, camera->target);
    return VSH_OK;
}

/* Rodrigues' rotation. */
vsh_result vsh_camera_orbit(vsh_camera *camera, double angle, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_TRY(vshi_camera_check(camera, error));
    if (!isfinite(angle)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "camera: angle %g: expected a number", angle);
    }
    if (angle == 0.0) {
        return VSH_OK;
    }
    const vshi_vec axis = vshi_unit(vshi_vec_of(camera->up)), target = vshi_vec_of(camera->target);
    const vshi_vec arm = vshi_sub(vshi_vec_of(camera->position), target);
    const double c = vshi_cos(angle), s = vshi_sin(angle);
    const vshi_vec turned = vshi_add(vshi_add(vshi_scale(arm, c), vshi_scale(vshi_cross(axis, arm), s)),
                                     vshi_scale(axis, vshi_dot(axis, arm) * (1.0 - c)));
    vshi_vec_to_doubles(vshi_add(target, turned), camera->position);
    return VSH_OK;
}
