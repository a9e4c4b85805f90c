/* Procedural signed distance fields: the check of a tree, its distance and its box.
 *
 * Shapes: I. Quilez, "distance functions" (2008 …) and "exact SDF of a capped cone" (2018); all of them are
 * true distances, inside too. min, max(a, b) and max(a, -b) change no faster than their operands, so every
 * tree changes by at most 1 per unit; so does the quadratic smooth minimum ("smooth minimum", 2013), whose
 * gradient is a mean of its operands'. */
#include "sdf/sdf.h"

#include "base/error.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "sdf/shapes.h"

#include <stdlib.h>

enum { MAX_NODES = 65536 };

/* Which fields a shape reads, in the order of vsh_sdf_node. */
enum {
    SIZE_X = 1,
    SIZE_Y = 2,
    SIZE_Z = 4,
    RADIUS = 8,
    MINOR = 16,
    MINOR_OR_ZERO = 32,
    ROUNDING = 64,
    SMOOTHING = 128,
    OPERANDS = 256
};

static const struct {
    const char *name;
    unsigned reads;
} shapes[] = {
    [VSH_SDF_SPHERE] = {"sphere", RADIUS},
    [VSH_SDF_BOX] = {"box", SIZE_X | SIZE_Y | SIZE_Z | ROUNDING},
    [VSH_SDF_TORUS] = {"torus", RADIUS | MINOR},
    [VSH_SDF_PLANE] = {"plane", SIZE_X | SIZE_Y | SIZE_Z},
    [VSH_SDF_CAPSULE] = {"capsule", SIZE_Y | RADIUS},
    [VSH_SDF_CYLINDER] = {"cylinder", SIZE_Y | RADIUS},
    [VSH_SDF_CONE] = {"cone", SIZE_Y | RADIUS | MINOR_OR_ZERO},
    [VSH_SDF_UNION] = {"union", OPERANDS},
    [VSH_SDF_INTERSECTION] = {"intersection", OPERANDS},
    [VSH_SDF_SUBTRACTION] = {"subtraction", OPERANDS},
    [VSH_SDF_SMOOTH_UNION] = {"smooth union", OPERANDS | SMOOTHING},
};

enum { SHAPE_COUNT = sizeof shapes / sizeof shapes[0] };

static vsh_result check_lengths(const vsh_sdf_node *node, size_t index, vsh_error *error) {
    const struct {
        unsigned flag;
        const char *name;
        double value;
        bool may_be_zero;
    } fields[] = {
        {SIZE_X, "size[0]", node->size[0], false},
        {SIZE_Y, "size[1]", node->size[1], false},
        {SIZE_Z, "size[2]", node->size[2], false},
        {RADIUS, "radius", node->radius, false},
        {MINOR, "minor_radius", node->minor_radius, false},
        {MINOR_OR_ZERO, "minor_radius", node->minor_radius, true},
        {ROUNDING, "rounding", node->rounding, true},
        {SMOOTHING, "smoothing", node->smoothing, false},
        {~0u, "scale", node->scale, false},
    };
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i) {
        const double value = fields[i].value;
        if ((shapes[node->shape].reads & fields[i].flag) != 0 &&
            !(isfinite(value) && (value > 0.0 || (value == 0.0 && fields[i].may_be_zero)))) {
            return vshi_fail(error, VSH_ERROR_INPUT, "sdf node %zu (%s): %s %g: expected %s 0 and finite",
                             index, shapes[node->shape].name, fields[i].name, value,
                             fields[i].may_be_zero ? "≥" : ">");
        }
    }
    return VSH_OK;
}

static vsh_result check_placement(const vsh_sdf_node *node, size_t index, vsh_error *error) {
    const double *q = node->rotation;
    const double squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(isfinite(squared) && squared > 0.0)) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "sdf node %zu (%s): rotation %g, %g, %g, %g: expected a quaternion of finite length "
                         "above 0",
                         index, shapes[node->shape].name, q[0], q[1], q[2], q[3]);
    }
    if (!vshi_finite(vshi_vec_of(node->translation))) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "sdf node %zu (%s): translation %g, %g, %g: expected finite values", index,
                         shapes[node->shape].name, node->translation[0], node->translation[1],
                         node->translation[2]);
    }
    return VSH_OK;
}

/* Checks the operands of node `index`, and notes its depth; a depth of 0 marks a node that is used. */
static vsh_result check_operands(const vsh_sdf *sdf, size_t index, int32_t *depth, vsh_error *error) {
    const vsh_sdf_node *node = &sdf->nodes[index];
    if (!vshi_sdf_is_operation(node)) {
        depth[index] = 1;
        return VSH_OK;
    }
    const int32_t operands[2] = {node->left, node->right};
    static const char *const names[2] = {"left", "right"};
    for (int i = 0; i < 2; ++i) {
        if (operands[i] < 0 || (size_t)operands[i] >= index) {
            return vshi_fail(error, VSH_ERROR_INPUT, "sdf node %zu (%s): %s %d: expected 0 … %zd", index,
                             shapes[node->shape].name, names[i], operands[i], (ptrdiff_t)index - 1);
        }
        if (depth[operands[i]] == 0) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "sdf node %zu (%s): %s %d: that node is an operand already; a tree uses each "
                             "node once",
                             index, shapes[node->shape].name, names[i], operands[i]);
        }
        depth[index] = depth[index] > depth[operands[i]] + 1 ? depth[index] : depth[operands[i]] + 1;
        depth[operands[i]] = 0;
    }
    if (depth[index] > VSHI_SDF_DEPTH) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "sdf node %zu (%s): the tree is more than %d nodes deep; combine halves instead of "
                         "adding one by one",
                         index, shapes[node->shape].name, VSHI_SDF_DEPTH);
    }
    return VSH_OK;
}

/* `depth`: one of 0 for each node. */
static vsh_result check_tree(const vsh_sdf *sdf, int32_t *depth, vsh_error *error) {
    for (size_t i = 0; i < sdf->node_count; ++i) {
        const vsh_sdf_node *node = &sdf->nodes[i];
        if (node->shape < 0 || node->shape >= SHAPE_COUNT) {
            return vshi_fail(error, VSH_ERROR_INPUT, "sdf node %zu: shape %d: expected 0 … %d", i,
                             node->shape, SHAPE_COUNT - 1);
        }
        VSHI_TRY(check_lengths(node, i, error));
        VSHI_TRY(check_placement(node, i, error));
        VSHI_TRY(check_operands(sdf, i, depth, error));
    }
    for (size_t i = 0; i + 1 < sdf->node_count; ++i) {
        if (depth[i] != 0) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "sdf node %zu (%s): no operation uses it, and only the last node (%zu) is the "
                             "root",
                             i, shapes[sdf->nodes[i].shape].name, sdf->node_count - 1);
        }
    }
    double low[3], high[3];
    vsh_sdf_bounds(sdf, low, high);
    return vshi_finite(vshi_vec_of(low)) && vshi_finite(vshi_vec_of(high))
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "sdf: its box is not finite: sizes too large");
}

vsh_result vsh_sdf_check(const vsh_sdf *sdf, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(sdf);
    if (sdf->nodes == NULL || sdf->node_count < 1 || sdf->node_count > MAX_NODES) {
        return vshi_fail(error, VSH_ERROR_INPUT, "sdf: %zu nodes: expected 1 … %d",
                         sdf->nodes == NULL ? (size_t)0 : sdf->node_count, MAX_NODES);
    }
    int32_t *depth;
    VSHI_TRY(vshi_allocate((void **)&depth, sdf->node_count, sizeof *depth, "sdf check", error));
    const vsh_result result = check_tree(sdf, depth, error);
    free(depth);
    return result;
}

static double node_distance(const vsh_sdf_node *nodes, int32_t index, vshi_vec p) {
    const vsh_sdf_node *node = &nodes[index];
    p = vshi_sdf_to_node(node, p);
    const double distance = !vshi_sdf_is_operation(node)
                                ? vshi_sdf_shape_distance(node->shape, node, p)
                                : vshi_sdf_combine(node->shape, node, node_distance(nodes, node->left, p),
                                                   node_distance(nodes, node->right, p));
    return distance * node->scale;
}

double vshi_sdf_distance_at(const vsh_sdf *sdf, vshi_vec position) {
    return vshi_finite(position) ? node_distance(sdf->nodes, (int32_t)sdf->node_count - 1, position) : NAN;
}

double vsh_sdf_distance(const vsh_sdf *sdf, const double position[3]) {
    VSHI_FLOATS;
    return vshi_sdf_distance_at(sdf, vshi_vec_of(position));
}

/* A distance, and how far rounding may have moved it. */
typedef struct rounded {
    double distance, error;
} rounded;

/* `radius` in the units of the node's parent. Where operands differ by more than both can change within the
 * radius, and by what rounding may do, the same one decides all over: a tree is narrowed to the shapes that
 * matter in a box (T. Duff, "Interval arithmetic and recursive subdivision for implicit functions", 1992). */
static rounded narrow(const vsh_sdf_node *nodes, int32_t index, vshi_vec p, double radius, uint8_t *keep) {
    const double ROUNDED = 1e-12; /* of the lengths that meet: a few thousand times what doubles are off */
    const double LARGEST = 1e100; /* whose squares are far from overflow */
    const vsh_sdf_node *node = &nodes[index];
    const double lengths = vshi_length(p) + vshi_length(vshi_vec_of(node->translation));
    p = vshi_sdf_to_node(node, p);
    radius /= node->scale;
    rounded here;
    keep[index] = VSHI_SDF_KEEP_BOTH;
    if (!vshi_sdf_is_operation(node)) {
        here.distance = vshi_sdf_shape_distance(node->shape, node, p);
        here.error = ROUNDED * (fabs(node->size[0]) + fabs(node->size[1]) + fabs(node->size[2]) +
                                fabs(node->radius) + fabs(node->minor_radius) + fabs(node->rounding));
    } else {
        const rounded left = narrow(nodes, node->left, p, radius, keep);
        const rounded right = narrow(nodes, node->right, p, radius, keep);
        here = (rounded){vshi_sdf_combine(node->shape, node, left.distance, right.distance),
                         left.error + right.error};
        /* how much more the left one counts than the right one */
        const double more = node->shape == VSH_SDF_UNION          ? right.distance - left.distance
                            : node->shape == VSH_SDF_INTERSECTION ? left.distance - right.distance
                            : node->shape == VSH_SDF_SUBTRACTION  ? left.distance + right.distance
                                                                  : 0.0;
        if (fabs(more) > 2.0 * (radius * (1.0 + ROUNDED) + here.error) && fabs(more) < LARGEST) {
            keep[index] = more > 0.0 ? VSHI_SDF_KEEP_LEFT : VSHI_SDF_KEEP_RIGHT;
        }
    }
    here.error = node->scale * here.error + ROUNDED * (lengths + node->scale * fabs(here.distance));
    here.distance *= node->scale;
    return here;
}

void vshi_sdf_narrow(const vsh_sdf *sdf, const double position[3], double radius, uint8_t *keep) {
    VSHI_FLOATS;
    narrow(sdf->nodes, (int32_t)sdf->node_count - 1, vshi_vec_of(position), radius, keep);
}

bool vshi_sdf_exact(const vsh_sdf *sdf) {
    for (size_t i = 0; i < sdf->node_count; ++i) {
        if (vshi_sdf_is_operation(&sdf->nodes[i]) && sdf->nodes[i].shape != VSH_SDF_UNION) {
            return false;
        }
    }
    return true;
}

/* Where a node stands in the world: x → scale · (x · axis[0], x · axis[1], x · axis[2]) + origin, with the
 * axes being the rows of a rotation. */
typedef struct placement {
    vshi_vec axis[3];
    vshi_vec origin;
    double scale;
} placement;

static vshi_vec place(const placement *at, vshi_vec p) {
    return (vshi_vec){at->scale * vshi_dot(at->axis[0], p) + at->origin.x,
                      at->scale * vshi_dot(at->axis[1], p) + at->origin.y,
                      at->scale * vshi_dot(at->axis[2], p) + at->origin.z};
}

static placement place_node(const placement *parent, const vsh_sdf_node *node) {
    placement at;
    at.origin = place(parent, vshi_vec_of(node->translation));
    at.scale = parent->scale * node->scale;
    for (int i = 0; i < 3; ++i) { /* row · R = Rᵀ applied to the row */
        at.axis[i] = vshi_sdf_rotate(node->rotation, -1.0, parent->axis[i]);
    }
    return at;
}

/* How far a shape reaches along a unit direction: its support function. */
static double shape_extent(const vsh_sdf_node *node, vshi_vec along) {
    const double across = sqrt(along.x * along.x + along.z * along.z);
    switch (node->shape) {
    case VSH_SDF_SPHERE:
        return node->radius;
    case VSH_SDF_BOX:
        return fabs(along.x) * node->size[0] + fabs(along.y) * node->size[1] + fabs(along.z) * node->size[2] +
               node->rounding;
    case VSH_SDF_TORUS:
        return across * node->radius + node->minor_radius;
    case VSH_SDF_PLANE:
        return fabs(along.x) * node->size[0] + vshi_larger(-along.y, 0.0) * node->size[1] +
               fabs(along.z) * node->size[2];
    case VSH_SDF_CAPSULE:
        return fabs(along.y) * node->size[1] + node->radius;
    case VSH_SDF_CYLINDER:
        return fabs(along.y) * node->size[1] + across * node->radius;
    default: /* VSH_SDF_CONE */
        return vshi_larger(across * node->radius - along.y * node->size[1],
                           across * node->minor_radius + along.y * node->size[1]);
    }
}

static void node_bounds(const vsh_sdf_node *nodes, int32_t index, const placement *parent, double low[3],
                        double high[3]) {
    const vsh_sdf_node *node = &nodes[index];
    const placement at = place_node(parent, node);
    const double origin[3] = {at.origin.x, at.origin.y, at.origin.z};
    if (!vshi_sdf_is_operation(node)) {
        for (int i = 0; i < 3; ++i) {
            low[i] = origin[i] - at.scale * shape_extent(node, vshi_scale(at.axis[i], -1.0));
            high[i] = origin[i] + at.scale * shape_extent(node, at.axis[i]);
        }
        return;
    }
    double low2[3], high2[3];
    node_bounds(nodes, node->left, &at, low, high);
    if (node->shape == VSH_SDF_SUBTRACTION) {
        return;
    }
    node_bounds(nodes, node->right, &at, low2, high2);
    /* The smooth minimum lies at most a quarter of its blend below the minimum. */
    const double grown = node->shape == VSH_SDF_SMOOTH_UNION ? 0.25 * node->smoothing * at.scale : 0.0;
    for (int i = 0; i < 3; ++i) {
        if (node->shape == VSH_SDF_INTERSECTION) {
            low[i] = vshi_larger(low[i], low2[i]);
            high[i] = vshi_larger(
                low[i], vshi_smaller(high[i], high2[i])); /* nothing in common: flat, not inverted */
        } else {
            low[i] = vshi_smaller(low[i], low2[i]) - grown;
            high[i] = vshi_larger(high[i], high2[i]) + grown;
        }
    }
}

void vsh_sdf_bounds(const vsh_sdf *sdf, double bounds_min[3], double bounds_max[3]) {
    VSHI_FLOATS;
    const placement world = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, {0.0, 0.0, 0.0}, 1.0};
    node_bounds(sdf->nodes, (int32_t)sdf->node_count - 1, &world, bounds_min, bounds_max);
}
