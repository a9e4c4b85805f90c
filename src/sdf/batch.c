/* Distances of many positions: each node is asked once for all of them, in loops that compilers make vectors
 * of, where sdf.c asks all nodes for one. The numbers are the same, to the bit. */
#include "base/floats.h"
#include "sdf/sdf.h"
#include "sdf/shapes.h"

/* Positions at a time; nodes below each other whose places are held at once, 2 KB each: deeper ones are asked
 * one position after the other. */
enum { LANES = 64, DEEP = 32 };

typedef struct places {
    double x[LANES], y[LANES], z[LANES];
} places;

typedef struct asked {
    const vsh_sdf_node *nodes;
    const uint8_t *keep;
    size_t count; /* 1 … LANES */
} asked;

static double distance_of(const asked *a, int32_t index, vshi_vec p) {
    const vsh_sdf_node *node = &a->nodes[index];
    double distance;
    p = vshi_sdf_to_node(node, p);
    if (!vshi_sdf_is_operation(node)) {
        distance = vshi_sdf_shape_distance(node->shape, node, p);
    } else if (a->keep[index] == VSHI_SDF_KEEP_BOTH) {
        distance = vshi_sdf_combine(node->shape, node, distance_of(a, node->left, p),
                                    distance_of(a, node->right, p));
    } else {
        distance = distance_of(a, a->keep[index] == VSHI_SDF_KEEP_LEFT ? node->left : node->right, p);
        distance = node->shape == VSH_SDF_SUBTRACTION && a->keep[index] == VSHI_SDF_KEEP_RIGHT ? -distance
                                                                                               : distance;
    }
    return distance * node->scale;
}

/* Whether a node has its places where its parent has them, as most operations do. */
static bool is_in_place(const vsh_sdf_node *node) {
    const double *q = node->rotation, *t = node->translation;
    return q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0 && t[0] == 0.0 && t[1] == 0.0 && t[2] == 0.0 &&
           !signbit(t[0]) && !signbit(t[1]) && !signbit(t[2]) && node->scale == 1.0;
}

static void place_all(const vsh_sdf_node *node, const places *from, size_t count, places *to) {
    const vsh_sdf_node own = *node; /* which nothing below can change */
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_sdf_to_node(&own, (vshi_vec){from->x[i], from->y[i], from->z[i]});
        to->x[i] = p.x;
        to->y[i] = p.y;
        to->z[i] = p.z;
    }
}

/* A loop for each shape, which is then a constant in it. */
#define EACH_PLACE(name)                                                                                     \
    case name:                                                                                               \
        for (size_t i = 0; i < count; ++i) {                                                                 \
            distances[i] = vshi_sdf_shape_distance(name, &own, (vshi_vec){at->x[i], at->y[i], at->z[i]});    \
        }                                                                                                    \
        break

static void measure_all(const vsh_sdf_node *node, const places *at, size_t count, double *distances) {
    const vsh_sdf_node own = *node;
    switch (own.shape) {
        EACH_PLACE(VSH_SDF_SPHERE);
        EACH_PLACE(VSH_SDF_BOX);
        EACH_PLACE(VSH_SDF_TORUS);
        EACH_PLACE(VSH_SDF_PLANE);
        EACH_PLACE(VSH_SDF_CAPSULE);
        EACH_PLACE(VSH_SDF_CYLINDER);
    default:
        EACH_PLACE(VSH_SDF_CONE);
    }
}

#define EACH_PAIR(name)                                                                                      \
    case name:                                                                                               \
        for (size_t i = 0; i < count; ++i) {                                                                 \
            left[i] = vshi_sdf_combine(name, &own, left[i], right[i]);                                       \
        }                                                                                                    \
        break

static void combine_all(const vsh_sdf_node *node, double *restrict left, const double *restrict right,
                        size_t count) {
    const vsh_sdf_node own = *node;
    switch (own.shape) {
        EACH_PAIR(VSH_SDF_INTERSECTION);
        EACH_PAIR(VSH_SDF_SUBTRACTION);
        EACH_PAIR(VSH_SDF_SMOOTH_UNION);
    default:
        EACH_PAIR(VSH_SDF_UNION);
    }
}

static void ask_all(const asked *a, int32_t index, const places *from, int depth, double *distances) {
    const vsh_sdf_node *node = &a->nodes[index];
    const size_t count = a->count;
    if (depth == DEEP) {
        for (size_t i = 0; i < count; ++i) {
            distances[i] = distance_of(a, index, (vshi_vec){from->x[i], from->y[i], from->z[i]});
        }
        return;
    }
    places own;
    const places *at = from;
    if (!is_in_place(node)) {
        place_all(node, from, count, &own);
        at = &own;
    }
    if (!vshi_sdf_is_operation(node)) {
        measure_all(node, at, count, distances);
    } else if (a->keep[index] == VSHI_SDF_KEEP_BOTH) {
        double right[LANES];
        ask_all(a, node->left, at, depth + 1, distances);
        ask_all(a, node->right, at, depth + 1, right);
        combine_all(node, distances, right, count);
    } else {
        ask_all(a, a->keep[index] == VSHI_SDF_KEEP_LEFT ? node->left : node->right, at, depth + 1, distances);
        const bool turned = node->shape == VSH_SDF_SUBTRACTION && a->keep[index] == VSHI_SDF_KEEP_RIGHT;
        for (size_t i = 0; i < count && turned; ++i) {
            distances[i] = -distances[i];
        }
    }
    for (size_t i = 0; i < count; ++i) {
        distances[i] *= node->scale;
    }
}

void vshi_sdf_distances_within(const vsh_sdf *sdf, const uint8_t *keep, size_t count,
                               const double (*positions)[3], double *distances) {
    VSHI_FLOATS;
    for (size_t first = 0; first < count; first += LANES) {
        const asked a = {sdf->nodes, keep, count - first < LANES ? count - first : LANES};
        places world;
        for (size_t i = 0; i < a.count; ++i) {
            world.x[i] = positions[first + i][0];
            world.y[i] = positions[first + i][1];
            world.z[i] = positions[first + i][2];
        }
        ask_all(&a, (int32_t)sdf->node_count - 1, &world, 0, distances + first);
        for (size_t i = 0; i < a.count; ++i) {
            if (!vshi_finite(vshi_vec_of(positions[first + i]))) {
                distances[first + i] = NAN;
            }
        }
    }
}
