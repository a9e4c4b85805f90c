/* Shadows of spheres by the closest approach of the ray to the light (I. Quilez, "sphere soft shadow", 2014).
 */
#include "base/elementary.h"
#include "light/view.h"
#include "spheres/sphere_tree.h"
#include "spheres/spheres.h"

#include <string.h>

/* A point within this many radii of a sphere's surface lies on it: receivers are made of floats. */
static const double ON_SURFACE = 1e-4;
/* Cosine beyond which the normal at a point on a sphere is the sphere's own: the sphere is below its horizon.
 */
static const double SAME_NORMAL = 0.999;

/* One light, seen from one point. */
typedef struct view {
    double origin[3];
    vshi_vec axis;
    vshi_vec normal; /* zero: none */
    double radius;   /* of the light's disc, a unit away; 0: a hard light */
    double far;
    double visible;
} view;

static bool is_inside(const double sphere[4], double distance) {
    return distance < sphere[3] * (1.0 - ON_SURFACE);
}

static bool meet_ray(void *user, const double sphere[4]) {
    view *v = user;
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(v->origin));
    const double distance = vshi_length(to), along = vshi_dot(to, v->axis);
    if (is_inside(sphere, distance)) {
        v->visible = 0.0;
        return false;
    }
    const bool stands_on =
        distance <= sphere[3] * (1.0 + ON_SURFACE) && vshi_dot(v->normal, to) < -SAME_NORMAL * distance;
    if (stands_on || !(along > 0.0) || distance - sphere[3] >= v->far) {
        return true;
    }
    const double miss = vshi_length(vshi_cross(to, v->axis)) - sphere[3];
    const double seen = miss < 0.0 ? 0.0 : v->radius > 0.0 ? miss / (v->radius * along) : 1.0;
    v->visible = fmin(v->visible, seen);
    return v->visible > 0.0;
}

/* False where the point is not finite, or has no normal where normals are given. */
static bool set_origin(view *v, const vsh_points *points, size_t i) {
    const double *position = points->positions + 3 * i;
    memcpy(v->origin, position, sizeof v->origin);
    if (points->normals != NULL) {
        v->normal = vshi_unit(vshi_vec_off(points->normals + 3 * i));
        if (!(vshi_dot(v->normal, v->normal) > 0.5)) {
            return false;
        }
    }
    return vshi_finite(vshi_vec_of(position));
}

void vshi_spheres_shadow(const vsh_spheres *spheres, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, float *visibility,
                         vsh_shade_stats *stats) {
    const bool hard = method == VSH_SHADOW_HARD;
    const vshi_light_place place = vshi_light_in_world(light);
    for (size_t i = begin; i < end; ++i) {
        float *value = &visibility[i - begin];
        view v = {.visible = 1.0};
        if (!set_origin(&v, points, i)) {
            *value = NAN;
            continue;
        }
        vshi_light_view seen;
        const vshi_light_side side = vshi_light_look(&place, vshi_vec_of(v.origin), hard, &seen);
        if (side != VSHI_LIGHT_SEEN) {
            *value = side == VSHI_LIGHT_WITHIN ? 1.0f : 0.0f;
            continue;
        }
        const double half = hard ? 0.0 : place.parallel ? place.half : vshi_asin(seen.sine);
        v.axis = seen.axis;
        v.far = vshi_light_end(&seen);
        v.radius = vshi_tan(half);
        const vshi_ball_cone cone = {{v.origin[0], v.origin[1], v.origin[2]},
                                     {v.axis.x, v.axis.y, v.axis.z},
                                     vshi_sin(half),
                                     vshi_cos(half),
                                     v.far};
        ++stats->marches;
        stats->samples += vshi_sphere_tree_search(spheres, &cone, meet_ray, &v);
        *value = (float)v.visible;
    }
}

static bool is_outside(void *user, const double sphere[4]) {
    view *v = user;
    const vshi_vec to = vshi_sub(vshi_vec_of(sphere), vshi_vec_of(v->origin));
    v->visible = is_inside(sphere, vshi_length(to)) ? 0.0 : 1.0;
    return v->visible > 0.0;
}

bool vshi_spheres_hold(const vsh_spheres *spheres, const double position[3]) {
    view v = {.origin = {position[0], position[1], position[2]}, .visible = 1.0};
    /* a half space of no depth, so every bound around the point is searched */
    const vshi_ball_cone here = {{position[0], position[1], position[2]}, {1.0, 0.0, 0.0}, 1.0, 0.0, 0.0};
    vshi_sphere_tree_search(spheres, &here, is_outside, &v);
    return v.visible <= 0.0;
}
