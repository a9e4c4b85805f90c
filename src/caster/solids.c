/* Sphere tracing (J. C. Hart, "Sphere tracing: a geometric method for the antialiased ray tracing of implicit
 * surfaces", 1996) of procedural solids: a tree's distance never passes the true one and changes by at most 1
 * per unit (caster/sdf.c), so a step of that length meets nothing. */
#include "caster/solids.h"

#include "base/floats.h"
#include "base/memory.h"
#include "base/similarity.h"
#include "base/vec.h"

#include <stdlib.h>
#include <string.h>

/* Of the diagonal of the box around all solids: a ray that comes this near has met one. Far above the
 * rounding of doubles, far below what a texel shows; a ray that only grazes a solid takes some 10^4 steps. */
static const double HIT = 1e-9;
enum { MOST_STEPS = 100000, CONE_STEPS = 96 };
/* Of the diagonal: the least step of a cone that looks for a solid to be covered by. */
static const double CONE_STEP = 1e-3;

typedef struct placed {
    vsh_sdf_node *nodes; /* owned */
    vsh_sdf sdf;
    double inverse[12]; /* world to local */
    double scale;       /* local to world */
} placed;

struct vsh_solids {
    size_t count;
    placed *solids;
    vshi_vec low, high; /* box around all; inside out where there is none */
    double size;        /* its diagonal */
};

static void invert(const double *m, double inverse[12]) {
    const double by = 1.0 / vshi_transform_determinant(m);
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            const int a = (column + 1) % 3, b = (column + 2) % 3, c = (row + 1) % 3, d = (row + 2) % 3;
            inverse[4 * row + column] = by * (m[4 * a + c] * m[4 * b + d] - m[4 * a + d] * m[4 * b + c]);
        }
    }
    const vshi_vec moved = vshi_transform_vector(inverse, (vshi_vec){m[3], m[7], m[11]});
    inverse[3] = -moved.x;
    inverse[7] = -moved.y;
    inverse[11] = -moved.z;
}

static void grow(vsh_solids *solids, const vsh_sdf *sdf, const double *transform) {
    double min[3], max[3];
    vsh_sdf_bounds(sdf, min, max);
    if (!(min[0] <= max[0] && min[1] <= max[1] && min[2] <= max[2])) {
        return;
    }
    for (int corner = 0; corner < 8; ++corner) {
        const vshi_vec p = vshi_transform_point(transform, (vshi_vec){corner & 1 ? max[0] : min[0],
                                                                      corner & 2 ? max[1] : min[1],
                                                                      corner & 4 ? max[2] : min[2]});
        solids->low =
            (vshi_vec){fmin(solids->low.x, p.x), fmin(solids->low.y, p.y), fmin(solids->low.z, p.z)};
        solids->high =
            (vshi_vec){fmax(solids->high.x, p.x), fmax(solids->high.y, p.y), fmax(solids->high.z, p.z)};
    }
}

static vsh_result add(vsh_solids *solids, const vsh_sdf *sdf, const double *transform, vsh_error *error) {
    static const double identity[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    vsh_result result = vsh_sdf_check(sdf, error);
    if (result != VSH_OK) {
        return result;
    }
    transform = transform != NULL ? transform : identity;
    placed *solid = &solids->solids[solids->count];
    solid->scale = vshi_similarity_scale(transform);
    if (!(solid->scale > 0.0)) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "solid %zu: the transform of an sdf must neither shear nor scale unevenly",
                         solids->count);
    }
    void *nodes;
    result = vshi_allocate(&nodes, sdf->node_count, sizeof *sdf->nodes, "sdf nodes", error);
    if (result != VSH_OK) {
        return result;
    }
    memcpy(nodes, sdf->nodes, sdf->node_count * sizeof *sdf->nodes);
    solid->nodes = nodes;
    solid->sdf = (vsh_sdf){nodes, sdf->node_count};
    invert(transform, solid->inverse);
    grow(solids, sdf, transform);
    ++solids->count;
    return VSH_OK;
}

vsh_result vsh_solids_create(const vsh_sdf *sdfs, const double *transforms, size_t count, vsh_solids **solids,
                             vsh_error *error) {
    VSHI_FLOATS;
    if (solids != NULL) {
        *solids = NULL;
    }
    if (solids == NULL || (sdfs == NULL && count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_solids_create: %s is NULL",
                         solids == NULL ? "solids" : "sdfs");
    }
    void *memory = NULL, *places = NULL;
    vsh_result result = vshi_allocate(&memory, 1, sizeof **solids, "solids", error);
    if (result == VSH_OK) {
        result = vshi_allocate(&places, count, sizeof(placed), "solids", error);
    }
    if (result != VSH_OK) {
        free(memory);
        return result;
    }
    vsh_solids *made = memory;
    made->solids = places;
    made->low = (vshi_vec){INFINITY, INFINITY, INFINITY};
    made->high = (vshi_vec){-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < count && result == VSH_OK; ++i) {
        result = add(made, &sdfs[i], transforms != NULL ? transforms + 12 * i : NULL, error);
    }
    if (result != VSH_OK) {
        vsh_solids_free(made);
        return result;
    }
    made->size = made->low.x <= made->high.x ? vshi_length(vshi_sub(made->high, made->low)) : 0.0;
    *solids = made;
    return VSH_OK;
}

void vsh_solids_free(vsh_solids *solids) {
    if (solids == NULL) {
        return;
    }
    for (size_t i = 0; i < solids->count; ++i) {
        free(solids->solids[i].nodes);
    }
    free(solids->solids);
    free(solids);
}

static double distance_at(const vsh_solids *solids, vshi_vec p) {
    double nearest = INFINITY;
    for (size_t i = 0; i < solids->count; ++i) {
        const placed *solid = &solids->solids[i];
        const vshi_vec local = vshi_transform_point(solid->inverse, p);
        const double at[3] = {local.x, local.y, local.z};
        const double distance = solid->scale * vsh_sdf_distance(&solid->sdf, at);
        nearest = distance < nearest ? distance : nearest;
    }
    return nearest;
}

double vsh_solids_distance(const vsh_solids *solids, const double position[3]) {
    VSHI_FLOATS;
    const vshi_vec p = vshi_vec_of(position);
    return vshi_finite(p) ? distance_at(solids, p) : NAN;
}

/* The part of a ray within the box around all solids; false where there is none. */
static bool clip(const vsh_solids *solids, const vshi_segment_ray *ray, double *begin, double *end) {
    const double low[3] = {solids->low.x, solids->low.y, solids->low.z};
    const double high[3] = {solids->high.x, solids->high.y, solids->high.z};
    *begin = 0.0;
    *end = ray->far;
    for (int axis = 0; axis < 3; ++axis) {
        const double o = ray->origin[axis], d = ray->direction[axis];
        if (d == 0.0) {
            if (!(o >= low[axis] && o <= high[axis])) {
                return false;
            }
            continue;
        }
        const double a = (low[axis] - o) / d, b = (high[axis] - o) / d;
        *begin = fmax(*begin, fmin(a, b));
        *end = fmin(*end, fmax(a, b));
    }
    return *begin <= *end;
}

static bool meets(const vsh_solids *solids, const vshi_segment_ray *ray) {
    double t, end;
    if (!clip(solids, ray, &t, &end)) {
        return false;
    }
    const vshi_vec origin = vshi_vec_of(ray->origin), direction = vshi_vec_of(ray->direction);
    for (int step = 0; step < MOST_STEPS; ++step) {
        if (t > end) {
            return false;
        }
        const double distance = distance_at(solids, vshi_add(origin, vshi_scale(direction, t)));
        if (distance <= HIT * solids->size) {
            return true;
        }
        t += distance;
    }
    return true; /* it has not got away from the surface */
}

void vshi_solids_blocked(const vsh_solids *solids, const vshi_segment_ray *rays, size_t count,
                         bool *blocked) {
    for (size_t i = 0; i < count; ++i) {
        blocked[i] = blocked[i] || meets(solids, &rays[i]);
    }
}

/* Where along the axis the box around all solids ends. */
static double last_of(const vsh_solids *solids, vshi_vec origin, vshi_vec axis) {
    const vshi_vec to = {axis.x > 0.0 ? solids->high.x : solids->low.x,
                         axis.y > 0.0 ? solids->high.y : solids->low.y,
                         axis.z > 0.0 ? solids->high.z : solids->low.z};
    return vshi_dot(vshi_sub(to, origin), axis);
}

/* The ball of radius |distance| around a point of the axis holds the cone's disc there, or does not reach it:
 * all of the disc is then inside one solid, or free; and distances change by at most 1 per unit, which says
 * for how much of the axis that goes on. */
vshi_cone_state vshi_solids_cone(const vsh_solids *solids, const double origin[3], const double axis[3],
                                 double tangent, double near, double far) {
    const vshi_vec from = vshi_vec_of(origin), along = vshi_vec_of(axis);
    const double hit = HIT * solids->size, last = last_of(solids, from, along);
    bool free_so_far = true;
    double t = 0.0;
    for (int step = 0; step < CONE_STEPS; ++step) {
        if (!(t <= last)) {
            return free_so_far ? VSHI_CONE_FREE : VSHI_CONE_UNKNOWN;
        }
        const double distance = distance_at(solids, vshi_add(from, vshi_scale(along, t)));
        const double width = tangent * t;
        if (t > 0.0 && t < near && distance < -width - hit) {
            return VSHI_CONE_COVERED;
        }
        double ahead = (distance - width - hit) / (1.0 + tangent);
        if (!(ahead > hit)) {
            free_so_far = false;
            ahead = (distance + width) / (1.0 + tangent);
            ahead = fmax(ahead, CONE_STEP * solids->size);
        }
        t += ahead;
        if (free_so_far && t > far) {
            return VSHI_CONE_FREE;
        }
    }
    return VSHI_CONE_UNKNOWN;
}
