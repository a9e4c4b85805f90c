/* Visibility of lights and of the sky from points, by rays against the casters, without a field. */
#include "trace/trace.h"
#include "base/vec.h"
#include "light/light.h"

#include <string.h>

enum { AT_ONCE = 256 };

/* A light as a disc a unit away, or a dome. */
typedef struct target {
    vshi_vec axis, u, v;
    double radius;   /* of the disc */
    vshi_lean lean;  /* of AO */
    vshi_vec mirror; /* of AO over a horizon: vshi_dome_mirror() */
    double distance; /* of the light's centre; infinite for a directional light */
    double size;     /* of the sphere */
    vshi_light_view view;
} target;

/* Aims at the light from a point. */
static vshi_light_side aim(const vshi_light_place *place, vshi_vec from, target *t) {
    vshi_light_view view;
    const vshi_light_side side = vshi_light_look(place, from, false, &view);
    if (side == VSHI_LIGHT_SEEN) {
        *t = (target){.axis = view.axis,
                      .lean = VSHI_WHOLE_DOME,
                      .radius = vshi_light_tangent(place, &view),
                      .distance = view.distance,
                      .size = place->radius,
                      .view = view};
        vshi_frame(t->axis, &t->u, &t->v);
    }
    return side;
}

/* The length of a ray at `cosine` to the axis: up to the sphere's near side. */
static double find_length(const target *t, double cosine) {
    if (!isfinite(t->distance)) {
        return INFINITY;
    }
    const double across = t->size * t->size - t->distance * t->distance * (1.0 - cosine * cosine);
    return t->distance * cosine - (across > 0.0 ? sqrt(across) : 0.0);
}

/* Aims a ray at a place on the unit disc; false below the horizon of `normal` (NULL: none). */
static bool aim_ray(const vshi_truth *truth, const target *t, const double disc[2], const vshi_vec *normal,
                    vshi_segment_ray *ray) {
    vshi_vec d;
    if (truth->place.shape != NULL) { /* a light that is no disc */
        const vshi_vec way = truth->place.shape->ray(&truth->place, &t->view, disc);
        d = vshi_unit(way);
        ray->far = vshi_length(way);
    } else {
        double place[2] = {disc[0] * t->radius, disc[1] * t->radius}, up, scale = 1.0;
        if (truth->light != NULL) {
            scale = 1.0 / sqrt(1.0 + place[0] * place[0] + place[1] * place[1]);
            up = scale;
            ray->far = find_length(t, up);
        } else {
            vshi_dome_place(&t->lean, place);
            const double square = 1.0 - place[0] * place[0] - place[1] * place[1];
            up = square > 0.0 ? sqrt(square) : 0.0;
            ray->far = truth->distance;
        }
        const vshi_vec across =
            vshi_add(vshi_scale(t->u, scale * place[0]), vshi_scale(t->v, scale * place[1]));
        d = vshi_dome_mirror(vshi_add(across, vshi_scale(t->axis, up)), t->mirror);
    }
    vshi_vec_to_doubles(d, ray->direction);
    return normal == NULL || vshi_dot(d, *normal) > 0.0;
}

/* Proves whether the solids hide all rays to a target, or none. */
static vshi_cone_state prove(const vshi_truth *truth, vshi_vec origin, const target *t) {
    const double from[3] = {origin.x, origin.y, origin.z};
    if (truth->solids == NULL) {
        return VSHI_CONE_FREE;
    }
    if (truth->light == NULL) {
        return vshi_solids_distance(truth->solids, from) > truth->distance ? VSHI_CONE_FREE
                                                                           : VSHI_CONE_UNKNOWN;
    }
    const double axis[3] = {t->axis.x, t->axis.y, t->axis.z}, bound = t->view.bound;
    if (truth->place.shape == NULL) {
        return vshi_solids_cone(truth->solids, from, axis, t->radius, t->distance - t->size, t->distance);
    }
    return isfinite(bound) ? vshi_solids_cone(truth->solids, from, axis, bound / sqrt(1.0 - bound * bound),
                                              t->view.near, t->view.end)
                           : VSHI_CONE_UNKNOWN;
}

/* The origin and the target of a point's rays. */
typedef struct viewpoint {
    vshi_vec origin, normal;
    target target;
    const vshi_vec *over;      /* rays below this plane count as hidden; NULL: none */
    const vshi_solids *solids; /* that rays may meet */
} viewpoint;

/* Limits AO to the directions above the point's face. Over a horizon it mirrors directions below the face
 * instead. */
static void aim_dome(const vshi_truth *truth, vshi_vec face, target *t) {
    vshi_frame(t->axis, &t->u, &t->v);
    if (!(vshi_dot(face, t->axis) < VSHI_ONE_NORMAL)) {
        return;
    }
    if (truth->up != NULL) {
        t->mirror = face;
    } else {
        t->lean = vshi_dome_lean(face, (vshi_vec[]){t->u, t->v, t->axis});
    }
}

/* Returns false if the point's value needs no rays, and is in *value. `face` is of AO; NULL: the normal. */
static bool place_point(const vshi_truth *truth, const double position[3], const float *normal,
                        const float *face, viewpoint *from, double *value) {
    const vshi_vec unit = vshi_unit(vshi_vec_off(normal)), up = face != NULL ? vshi_vec_off(face) : unit;
    *from =
        (viewpoint){.origin = vshi_add(vshi_vec_of(position), vshi_scale(up, truth->offset)), .normal = unit};
    if (!(vshi_dot(unit, unit) > 0.5 && vshi_finite(from->origin))) {
        *value = NAN;
        return false;
    }
    from->target = (target){.axis = from->normal, .radius = 1.0, .lean = VSHI_WHOLE_DOME};
    if (truth->light == NULL) {
        aim_dome(truth, up, &from->target);
    } else {
        const vshi_light_side side = aim(&truth->place, from->origin, &from->target);
        if (side != VSHI_LIGHT_SEEN) {
            *value = side == VSHI_LIGHT_WITHIN ? 1.0 : 0.0;
            return false;
        }
    }
    const vshi_cone_state state = prove(truth, from->origin, &from->target);
    if (state == VSHI_CONE_COVERED) {
        *value = 0.0;
        return false;
    }
    from->solids = state == VSHI_CONE_FREE ? NULL : truth->solids;
    from->over = truth->light == NULL ? truth->up : &from->normal;
    return true;
}

/* Counts the rays to places [count] on the disc that meet nothing. */
static int32_t count_free(const vshi_truth *truth, const viewpoint *from, const double (*disc)[2],
                          int32_t count) {
    const vshi_vec o = from->origin;
    vshi_segment_ray rays[AT_ONCE];
    bool blocked[AT_ONCE];
    size_t waiting = 0;
    int32_t free = 0;
    for (int32_t i = 0; i < count; ++i) {
        vshi_segment_ray *ray = &rays[waiting];
        *ray = (vshi_segment_ray){{o.x, o.y, o.z}, {0.0, 0.0, 0.0}, 0.0};
        waiting += aim_ray(truth, &from->target, disc[i], from->over, ray);
        if (waiting == AT_ONCE || (i + 1 == count && waiting > 0)) {
            memset(blocked, 0, waiting * sizeof *blocked);
            if (truth->triangles != NULL) {
                vshi_triangles_blocked(truth->triangles, rays, waiting, blocked);
            }
            if (from->solids != NULL) {
                vshi_solids_blocked(from->solids, rays, waiting, blocked);
            }
            for (size_t r = 0; r < waiting; ++r) {
                free += !blocked[r];
            }
            waiting = 0;
        }
    }
    return free;
}

/* Whether rays agree with an expected value. It is not enough that a few rays agree with each other: all may
 * miss a small caster, which always errs to the same side. */
static bool agrees(double free, double count, double expected) {
    static const double ENOUGH = 1e-3;
    return fabs(free - expected * count) < ENOUGH * count;
}

/* Shoots two sets of rays until they agree with the expected value, and counts the free ones. Returns each
 * set's number of rays, or 0 if the point needs none. *even: VSHI_TRUTH_… of the first rays. */
static int32_t count_twice(const vshi_truth *truth, const double position[3], const float normal[3],
                           const float *face, uint32_t texel, double expected, int32_t free[2], int32_t *even,
                           double *value) {
    static const uint32_t PURPOSE[2] = {0x7e570001u, 0x7e570002u};
    viewpoint from;
    free[0] = free[1] = 0;
    *even = VSHI_TRUTH_UNEVEN;
    if (!place_point(truth, position, normal, face, &from, value)) {
        return 0;
    }
    int32_t taken = 0;
    while (taken < truth->rays) {
        double disc[VSHI_TRUTH_FIRST][2];
        const int32_t left = truth->rays - taken, count = left < VSHI_TRUTH_FIRST ? left : VSHI_TRUTH_FIRST;
        for (int k = 0; k < 2; ++k) {
            vshi_sampler_disc(truth->sampler, texel, PURPOSE[k], taken, count, disc);
            free[k] += count_free(truth, &from, (const double(*)[2])disc, count);
        }
        taken += count;
        const bool alike = (free[0] == 0 || free[0] == taken) && free[0] == free[1];
        if (alike && taken == count) {
            *even = free[0] == 0 ? VSHI_TRUTH_EVEN_HIDDEN : VSHI_TRUTH_EVEN_FREE;
        }
        if (alike && agrees(free[0], taken, expected)) {
            break;
        }
    }
    return taken;
}

bool vshi_truth_twice(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, double expected, double seen[2]) {
    int32_t free[2], even;
    const int32_t taken = count_twice(truth, position, normal, face, texel, expected, free, &even, &seen[0]);
    if (taken == 0) {
        seen[1] = seen[0];
        return !isnan(seen[0]);
    }
    for (int k = 0; k < 2; ++k) {
        seen[k] = (double)free[k] / (double)taken;
    }
    return true;
}

bool vshi_truth_count(const vshi_truth *truth, const double position[3], const float normal[3],
                      const float *face, uint32_t texel, int32_t free[2], int32_t *even) {
    double value;
    if (count_twice(truth, position, normal, face, texel, NAN, free, even, &value) == 0) {
        free[0] = free[1] = value > 0.5 ? truth->rays : 0;
        return !isnan(value);
    }
    return true;
}

void vshi_truth_settle(int32_t rays, const int32_t free[2], int32_t even, double expected, double seen[2]) {
    const int32_t first = rays < VSHI_TRUTH_FIRST ? rays : VSHI_TRUTH_FIRST;
    const int32_t all = even == VSHI_TRUTH_EVEN_FREE ? first : 0;
    const bool ends = even != VSHI_TRUTH_UNEVEN && agrees(all, first, expected);
    for (int k = 0; k < 2; ++k) {
        seen[k] = ends ? (double)all / (double)first : (double)free[k] / (double)rays;
    }
}
