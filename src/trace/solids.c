/* Sphere tracing of procedural solids (J. C. Hart, "Sphere tracing: a geometric method for the antialiased
 * ray tracing of implicit surfaces", 1996). A tree's distance is at most the true one and changes by at most
 * 1 per unit (geometry/sdf.c). So a step of that length meets nothing. */
#include "trace/trace.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/vec.h"
#include "geometry/sdf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A ray this near to a solid has met it. Share of the diagonal of the box around all solids: far above the
 * rounding of doubles, far below a texel. A ray that grazes a solid needs some 10^4 steps. */
static const double HIT = 1e-9;
enum { MOST_STEPS = 100000, CONE_STEPS = 96 };
/* Least step of a cone inside of solids, share of the diagonal. */
static const double CONE_STEP = 1e-3;

/* An operand of the unions at a tree's root. A ray that meets a union meets one of its operands, whose boxes
 * most rays miss. */
typedef struct member {
    vsh_sdf sdf;            /* its nodes belong to the solids */
    double inverse[12];     /* world to local */
    double scale;           /* local to world */
    double low[3], high[3]; /* box, world; low > high if it is empty */
    vshi_vec centre;        /* these two of a sphere, world; else the radius is 0 */
    double radius;
} member;

struct vshi_solids {
    vsh_sdf_node **nodes; /* [tree_count] */
    size_t tree_count;
    member *members;
    size_t count;
    double low[3], high[3]; /* box around all; low > high if there is none */
    double size;            /* its diagonal */
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

/* The transform of a node. */
static void node_transform(const vsh_sdf_node *node, double m[12]) {
    const double *q = node->rotation;
    const double by = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]), s = node->scale;
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double rows[12] = {s * (1.0 - by * (y * y + z * z)), s * by * (x * y - w * z),
                             s * by * (x * z + w * y),         node->translation[0],
                             s * by * (x * y + w * z),         s * (1.0 - by * (x * x + z * z)),
                             s * by * (y * z - w * x),         node->translation[1],
                             s * by * (x * z - w * y),         s * by * (y * z + w * x),
                             s * (1.0 - by * (x * x + y * y)), node->translation[2]};
    memcpy(m, rows, sizeof rows);
}

/* Adds the subtree under node `root` of a tree; `transform` moves the tree to the world. */
static void add_members(vshi_solids *solids, const vsh_sdf_node *nodes, int32_t root,
                        const double *transform) {
    const vsh_sdf_node *node = &nodes[root];
    if (node->shape == VSH_SDF_UNION) {
        double own[12], below[12];
        node_transform(node, own);
        vshi_transform_compose(transform, own, below);
        add_members(solids, nodes, node->left, below);
        add_members(solids, nodes, node->right, below);
        return;
    }
    member *m = &solids->members[solids->count++];
    m->sdf = (vsh_sdf){nodes, (size_t)root + 1};
    m->scale = vshi_cbrt(fabs(vshi_transform_determinant(transform)));
    vshi_empty_box(m->low, m->high);
    invert(transform, m->inverse);
    double min[3], max[3];
    vshi_sdf_bounds(&m->sdf, min, max);
    if (!(min[0] <= max[0] && min[1] <= max[1] && min[2] <= max[2])) {
        return;
    }
    vshi_grow_box_by(m->low, m->high, transform, min, max);
    vshi_grow_box(solids->low, solids->high, vshi_vec_of(m->low));
    vshi_grow_box(solids->low, solids->high, vshi_vec_of(m->high));
    if (node->shape == VSH_SDF_SPHERE) {
        m->centre = vshi_transform_point(transform, vshi_vec_of(node->translation));
        m->radius = m->scale * node->scale * node->radius;
    }
}

/* Copies a checked tree. There is room for all of its nodes as members. */
static vsh_result add_tree(vshi_solids *solids, const vsh_sdf *sdf, const double *transform,
                           vsh_error *error) {
    void *nodes;
    VSHI_TRY(vshi_allocate(&nodes, sdf->node_count, sizeof *sdf->nodes, "sdf nodes", error));
    memcpy(nodes, sdf->nodes, sdf->node_count * sizeof *sdf->nodes);
    solids->nodes[solids->tree_count++] = nodes;
    add_members(solids, nodes, (int32_t)sdf->node_count - 1, transform);
    return VSH_OK;
}

/* Checks all trees and counts their nodes. */
static vsh_result check(const vsh_sdf *sdfs, const double *transforms, size_t count, size_t *nodes,
                        vsh_error *error) {
    *nodes = 0;
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(vshi_sdf_check(&sdfs[i], error));
        if (!(vshi_similarity_scale(transforms + 12 * i) > 0.0)) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "solid %zu: the transform of an sdf must neither shear nor scale unevenly", i);
        }
        *nodes += sdfs[i].node_count;
    }
    return VSH_OK;
}

vsh_result vshi_solids_create(const vsh_sdf *sdfs, const double *transforms, size_t count,
                              vshi_solids **solids, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(solids);
    size_t nodes;
    vshi_solids *made;
    vsh_result result;
    VSHI_TRY(check(sdfs, transforms, count, &nodes, error));
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "solids", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made->nodes, count, sizeof *made->nodes, "solids", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made->members, nodes, sizeof *made->members, "solids", error));
    vshi_empty_box(made->low, made->high);
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(add_tree(made, &sdfs[i], transforms + 12 * i, error));
    }
    made->size = made->low[0] <= made->high[0]
                     ? vshi_length(vshi_sub(vshi_vec_of(made->high), vshi_vec_of(made->low)))
                     : 0.0;
    *solids = made;
    made = NULL;
done:
    vshi_solids_free(made);
    return result;
}

void vshi_solids_free(vshi_solids *solids) {
    if (solids == NULL) {
        return;
    }
    for (size_t i = 0; i < solids->tree_count; ++i) {
        free(solids->nodes[i]);
    }
    free(solids->members);
    free(solids->nodes);
    free(solids);
}

static double member_distance(const member *m, vshi_vec p) {
    return m->scale * vshi_sdf_distance_at(&m->sdf, vshi_transform_point(m->inverse, p));
}

static double distance_at(const vshi_solids *solids, vshi_vec p) {
    double nearest = INFINITY;
    for (size_t i = 0; i < solids->count; ++i) {
        const double distance = member_distance(&solids->members[i], p);
        nearest = distance < nearest ? distance : nearest;
    }
    return nearest;
}

double vshi_solids_distance(const vshi_solids *solids, const double position[3]) {
    VSHI_FLOATS;
    const vshi_vec p = vshi_vec_of(position);
    return vshi_finite(p) ? distance_at(solids, p) : NAN;
}

/* The part of a ray within a member's box; false if there is none. */
static bool clip(const member *m, const vshi_segment_ray *ray, double *begin, double *end) {
    *begin = 0.0;
    *end = ray->far;
    for (int axis = 0; axis < 3; ++axis) {
        vshi_clip_axis(ray->origin[axis], ray->direction[axis], m->low[axis], m->high[axis], begin, end);
    }
    return *begin <= *end;
}

static double meet_sphere(const member *m, const vshi_segment_ray *ray, double hit) {
    const vshi_vec to = vshi_sub(m->centre, vshi_vec_of(ray->origin)), d = vshi_vec_of(ray->direction);
    const double along = vshi_dot(to, d), radius = m->radius + hit;
    const vshi_vec miss = vshi_sub(to, vshi_scale(d, along));
    const double half = radius * radius - vshi_dot(miss, miss);
    if (vshi_dot(to, to) <= radius * radius) {
        return 0.0;
    }
    const double t = half >= 0.0 ? along - sqrt(half) : INFINITY;
    return t >= 0.0 && t <= ray->far ? t : INFINITY;
}

/* The distance at which the ray meets the member; infinite if it does not. */
static double meet(const member *m, const vshi_segment_ray *ray, double hit) {
    double t, end;
    if (m->radius > 0.0) {
        return meet_sphere(m, ray, hit);
    }
    if (!clip(m, ray, &t, &end)) {
        return INFINITY;
    }
    const vshi_vec origin = vshi_vec_of(ray->origin), direction = vshi_vec_of(ray->direction);
    for (int step = 0; step < MOST_STEPS; ++step) {
        if (t > end) {
            return INFINITY;
        }
        const double distance = member_distance(m, vshi_add(origin, vshi_scale(direction, t)));
        if (distance <= hit) {
            break;
        }
        t += distance;
    }
    return t; /* after the last step it is still near the surface */
}

size_t vshi_solids_part_count(const vshi_solids *solids) {
    return solids->count;
}

void vshi_solids_part_box(const vshi_solids *solids, size_t part, double low[3], double high[3]) {
    memcpy(low, solids->members[part].low, sizeof solids->members[part].low);
    memcpy(high, solids->members[part].high, sizeof solids->members[part].high);
}

double vshi_solids_part_meet(const vshi_solids *solids, size_t part, const vshi_segment_ray *ray) {
    return meet(&solids->members[part], ray, HIT * solids->size);
}

void vshi_solids_blocked(const vshi_solids *solids, const vshi_segment_ray *rays, size_t count,
                         bool *blocked) {
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < solids->count && !blocked[i]; ++k) {
            blocked[i] = isfinite(vshi_solids_part_meet(solids, k, &rays[i]));
        }
    }
}

/* The depth along the axis at which the box around all solids ends. */
static double find_last(const vshi_solids *solids, vshi_vec origin, vshi_vec axis) {
    const double *low = solids->low, *high = solids->high;
    const vshi_vec to = {axis.x > 0.0 ? high[0] : low[0], axis.y > 0.0 ? high[1] : low[1],
                         axis.z > 0.0 ? high[2] : low[2]};
    return vshi_dot(vshi_sub(to, origin), axis);
}

/* If the ball of radius |distance| around a point of the axis holds the cone's disc there, all of the disc is
 * inside one solid, or free. Distances change by at most 1 per unit, which gives the length of the axis for
 * which that remains true. */
vshi_cone_state vshi_solids_cone(const vshi_solids *solids, const double origin[3], const double axis[3],
                                 double tangent, double near, double far) {
    const vshi_vec from = vshi_vec_of(origin), along = vshi_vec_of(axis);
    const double hit = HIT * solids->size, last = find_last(solids, from, along);
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
