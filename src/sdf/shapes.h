/* Shapes and operations of a tree: what sdf.c and batch.c share, so that both come to the same bits. */
#ifndef VSHI_SDF_SHAPES_H
#define VSHI_SDF_SHAPES_H

#include "base/vec.h"

#include <vdbshade/sdf.h>

/* vsh_sdf_distance() within a call that has seen to the floating-point environment. */
double vshi_sdf_distance_at(const vsh_sdf *sdf, vshi_vec position);

static inline bool vshi_sdf_is_operation(const vsh_sdf_node *node) {
    return node->shape >= VSH_SDF_UNION;
}

/* v turned by the quaternion, or back. Shapes are mostly not turned at all, and that is free. */
static inline vshi_vec vshi_sdf_rotate(const double q[4], double direction, vshi_vec v) {
    if (q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0) {
        return v;
    }
    const double scale = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const vshi_vec axis = {q[0] * scale * direction, q[1] * scale * direction, q[2] * scale * direction};
    const vshi_vec twice = vshi_scale(vshi_cross(axis, v), 2.0);
    return vshi_add(vshi_add(v, vshi_scale(twice, q[3] * scale)), vshi_cross(axis, twice));
}

/* max, min and clamp as comparisons: fmin and fmax are calls where NaN must be minded, and these run for
 * every voxel; a NaN position still gives NaN through the lengths. */
static inline double vshi_larger(double a, double b) {
    return a > b ? a : b;
}
static inline double vshi_smaller(double a, double b) {
    return a < b ? a : b;
}
static inline double vshi_clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

static inline double vshi_sdf_box_distance(vshi_vec p, double x, double y, double z) {
    const vshi_vec q = {fabs(p.x) - x, fabs(p.y) - y, fabs(p.z) - z};
    const double deepest = vshi_larger(q.x, vshi_larger(q.y, q.z));
    if (deepest <= 0.0) {
        return deepest;
    }
    return vshi_length((vshi_vec){vshi_larger(q.x, 0.0), vshi_larger(q.y, 0.0), vshi_larger(q.z, 0.0)});
}

static inline double vshi_sdf_cone_distance(vshi_vec p, double half_height, double base, double top) {
    const double r = sqrt(p.x * p.x + p.z * p.z);
    const double cap_r = r - vshi_smaller(r, p.y < 0.0 ? base : top);
    const double cap_y = fabs(p.y) - half_height;
    const double slope_r = top - base;
    const double slope_y = 2.0 * half_height;
    const double along = vshi_clamp(((top - r) * slope_r + (half_height - p.y) * slope_y) /
                                        (slope_r * slope_r + slope_y * slope_y),
                                    0.0, 1.0);
    const double side_r = r - top + slope_r * along;
    const double side_y = p.y - half_height + slope_y * along;
    const double squared = vshi_smaller(cap_r * cap_r + cap_y * cap_y, side_r * side_r + side_y * side_y);
    return side_r < 0.0 && cap_y < 0.0 ? -sqrt(squared) : sqrt(squared);
}

static inline double vshi_sdf_shape_distance(int32_t shape, const vsh_sdf_node *node, vshi_vec p) {
    switch (shape) {
    case VSH_SDF_SPHERE:
        return vshi_length(p) - node->radius;
    case VSH_SDF_BOX:
        return vshi_sdf_box_distance(p, node->size[0], node->size[1], node->size[2]) - node->rounding;
    case VSH_SDF_TORUS: {
        const double ring = sqrt(p.x * p.x + p.z * p.z) - node->radius;
        return sqrt(ring * ring + p.y * p.y) - node->minor_radius;
    }
    case VSH_SDF_PLANE: {
        const double half = 0.5 * node->size[1];
        p.y += half;
        return vshi_sdf_box_distance(p, node->size[0], half, node->size[2]);
    }
    case VSH_SDF_CAPSULE:
        p.y -= vshi_clamp(p.y, -node->size[1], node->size[1]);
        return vshi_length(p) - node->radius;
    case VSH_SDF_CYLINDER: {
        const double r = sqrt(p.x * p.x + p.z * p.z) - node->radius;
        const double y = fabs(p.y) - node->size[1];
        if (r <= 0.0 || y <= 0.0) {
            return vshi_larger(r, y);
        }
        return sqrt(r * r + y * y);
    }
    default: /* VSH_SDF_CONE */
        return vshi_sdf_cone_distance(p, node->size[1], node->radius, node->minor_radius);
    }
}

static inline double vshi_sdf_combine(int32_t shape, const vsh_sdf_node *node, double a, double b) {
    switch (shape) {
    case VSH_SDF_INTERSECTION:
        return vshi_larger(a, b);
    case VSH_SDF_SUBTRACTION:
        return vshi_larger(a, -b);
    case VSH_SDF_SMOOTH_UNION: {
        const double overlap = vshi_larger(node->smoothing - fabs(a - b), 0.0) / node->smoothing;
        return vshi_smaller(a, b) - 0.25 * node->smoothing * overlap * overlap;
    }
    default: /* VSH_SDF_UNION */
        return vshi_smaller(a, b);
    }
}

/* The operands of an operation that decide. */
enum { VSHI_SDF_KEEP_BOTH, VSHI_SDF_KEEP_LEFT, VSHI_SDF_KEEP_RIGHT };

static inline vshi_vec vshi_sdf_to_node(const vsh_sdf_node *node, vshi_vec p) {
    p = vshi_sdf_rotate(node->rotation, -1.0, vshi_sub(p, vshi_vec_of(node->translation)));
    return node->scale != 1.0 ? vshi_scale(p, 1.0 / node->scale) : p;
}

#endif
