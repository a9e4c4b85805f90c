/* Visibility of lights and of the sky from points, by rays against the casters, without a field. */
#include "trace/trace.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/vec.h"
#include "light/light.h"
#include "trace/embree.h"
#include "trace/solids.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_RAYS = 65536, AT_ONCE = 256, GRAIN = 64 };

/* A call whose points all shoot the same rays. */
typedef struct tracing {
    vshi_truth truth;
    const double *positions;
    const float *normals;
    double (*disc)[2]; /* [truth.rays] */
    float *values;
} tracing;

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

/* Places points along Vogel's spiral ("A better way to construct the sunflower head", 1979). Radii √((i + ½)
 * / n) spread them evenly over the disc. */
static void place_disc(tracing *task) {
    static const double PI = 3.14159265358979323846, TURN = 0.38196601125010515;
    const int32_t rays = task->truth.rays;
    for (int32_t i = 0; i < rays; ++i) {
        const double radius = sqrt((i + 0.5) / rays), angle = 2.0 * PI * fmod(i * TURN, 1.0);
        task->disc[i][0] = radius * vshi_cos(angle);
        task->disc[i][1] = radius * vshi_sin(angle);
    }
}

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
    if (truth->place.is_rectangle) { /* a light that is no disc */
        const vshi_vec way = vshi_rectangle_ray(&truth->place, &t->view, disc);
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
    ray->direction[0] = d.x;
    ray->direction[1] = d.y;
    ray->direction[2] = d.z;
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
    if (!truth->place.is_rectangle) {
        return vshi_solids_cone(truth->solids, from, axis, t->radius, t->distance - t->size, t->distance);
    }
    return isfinite(bound) ? vshi_solids_cone(truth->solids, from, axis, bound / sqrt(1.0 - bound * bound),
                                              t->view.near, t->view.end)
                           : VSHI_CONE_UNKNOWN;
}

/* The origin and the target of a point's rays. */
typedef struct viewpoint {
    vshi_vec origin, normal; /* no normal: zero */
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
    *from = (viewpoint){.origin = vshi_vec_of(position)};
    if (normal != NULL) {
        from->normal = vshi_unit(vshi_vec_off(normal));
        if (!(vshi_dot(from->normal, from->normal) > 0.5)) {
            *value = NAN;
            return false;
        }
        const vshi_vec up = face != NULL ? vshi_vec_off(face) : from->normal;
        from->origin = vshi_add(from->origin, vshi_scale(up, truth->lift));
    }
    if (!vshi_finite(from->origin)) {
        *value = NAN;
        return false;
    }
    from->target = (target){.axis = from->normal, .radius = 1.0, .lean = VSHI_WHOLE_DOME};
    if (truth->light == NULL) {
        aim_dome(truth, face != NULL ? vshi_vec_off(face) : from->normal, &from->target);
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
    from->over = truth->light == NULL ? truth->up : normal != NULL ? &from->normal : NULL;
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

static float trace_point(const tracing *task, size_t point) {
    viewpoint from;
    double value;
    const float *normal = task->normals != NULL ? task->normals + 3 * point : NULL;
    if (!place_point(&task->truth, task->positions + 3 * point, normal, NULL, &from, &value)) {
        return (float)value;
    }
    const int32_t rays = task->truth.rays;
    const int32_t free = count_free(&task->truth, &from, (const double(*)[2])task->disc, rays);
    return (float)((double)free / (double)rays);
}

/* Whether rays agree with an expected value. Few rays that agree with each other only are not enough: they
 * miss small casters, always to one side. */
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

static void trace_points(void *user, size_t begin, size_t end) {
    const tracing *task = user;
    for (size_t i = begin; i < end; ++i) {
        task->values[i] = trace_point(task, i);
    }
}

static vsh_result trace(tracing *task, size_t count, const vsh_run *run, vsh_error *error) {
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(
        vshi_allocate((void **)&task->disc, (size_t)task->truth.rays, sizeof *task->disc, "trace", error));
    place_disc(task);
    vshi_job *job = vshi_job_begin(&full, "trace", count);
    const vsh_result result = job == NULL
                                  ? vshi_fail(error, VSH_ERROR_MEMORY, "trace: the system refused memory")
                                  : vshi_parallel_for(job, count, GRAIN, 1, trace_points, task, error);
    vshi_job_end(job);
    free(task->disc);
    return result;
}

static vsh_result check(const tracing *task, size_t count, const char *call, vsh_error *error) {
    const bool nothing = task->truth.triangles == NULL && task->truth.solids == NULL;
    if (nothing || (count > 0 && (task->positions == NULL || task->values == NULL))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s NULL", call,
                         nothing                   ? "both triangles and solids are"
                         : task->positions == NULL ? "positions is"
                                                   : "the result's array is");
    }
    if (task->truth.rays < 1 || task->truth.rays > MAX_RAYS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: rays %d is out of range 1 … %d", call,
                         task->truth.rays, MAX_RAYS);
    }
    if (!(task->truth.lift >= 0.0 && isfinite(task->truth.lift))) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: lift %g: expected a finite number, at least 0", call,
                         task->truth.lift);
    }
    return VSH_OK;
}

vsh_result vshi_trace_shadow(const vshi_triangles *triangles, const vshi_solids *solids, size_t count,
                             const double *positions, const float *normals, double lift,
                             const vsh_light *light, int32_t rays, const vsh_run *run, float *visibility,
                             vsh_error *error) {
    VSHI_FLOATS;
    tracing task = {
        .truth = {.triangles = triangles, .solids = solids, .lift = lift, .light = light, .rays = rays},
        .positions = positions,
        .normals = normals,
        .values = visibility};
    VSHI_TRY(check(&task, count, "vshi_trace_shadow", error));
    VSHI_TRY(vsh_light_check(light, error));
    task.truth.place = vshi_light_in_world(light);
    /* all rays to a point are the same */
    task.truth.rays = vshi_light_is_point(&task.truth.place) ? 1 : rays;
    return trace(&task, count, run, error);
}

vsh_result vshi_trace_ao(const vshi_triangles *triangles, const vshi_solids *solids, size_t count,
                         const double *positions, const float *normals, double lift, double distance,
                         int32_t rays, const vsh_run *run, float *ao, vsh_error *error) {
    VSHI_FLOATS;
    tracing task = {
        .truth = {.triangles = triangles, .solids = solids, .lift = lift, .distance = distance, .rays = rays},
        .positions = positions,
        .normals = normals,
        .values = ao};
    VSHI_TRY(check(&task, count, "vshi_trace_ao", error));
    VSHI_NEEDS_OF(count, normals);
    if (!(distance > 0.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vshi_trace_ao: distance %g: expected more than 0",
                         distance);
    }
    return trace(&task, count, run, error);
}
