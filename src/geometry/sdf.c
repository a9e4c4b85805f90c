/* Procedural signed distance fields: the check of a tree, its distance and its box.
 *
 * Shapes are after I. Quilez, "distance functions" (2008 …) and "exact SDF of a capped cone" (2018). All are
 * true distances, inside too. min, max(a, b) and max(a, -b) change no faster than their operands, so every
 * tree changes by at most 1 per unit. The gradient of the quadratic smooth minimum ("smooth minimum", 2013)
 * is a mean of its operands'. */
#include "geometry/sdf.h"

#include "base/error.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/vec.h"

#include <stdlib.h>

enum { MAX_NODES = 65536 };

/* The deciding operands of an operation. */
enum { KEEP_BOTH, KEEP_LEFT, KEEP_RIGHT };

static inline bool is_operation(const vsh_sdf_node *node) {
    return node->shape >= VSH_SDF_UNION;
}

/* Turns v by the quaternion (`direction` 1), or back (-1). Most shapes are not turned, and cost nothing. */
static inline vshi_vec rotate(const double q[4], double direction, vshi_vec v) {
    if (q[0] == 0.0 && q[1] == 0.0 && q[2] == 0.0) {
        return v;
    }
    const double scale = 1.0 / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const vshi_vec axis = {q[0] * scale * direction, q[1] * scale * direction, q[2] * scale * direction};
    const vshi_vec twice = vshi_scale(vshi_cross(axis, v), 2.0);
    return vshi_add(vshi_add(v, vshi_scale(twice, q[3] * scale)), vshi_cross(axis, twice));
}

/* Comparisons run for every voxel, so they are no calls of fmin() and fmax(), which handle NaN. A NaN
 * position still gives NaN through the lengths. */
static inline double larger(double a, double b) {
    return a > b ? a : b;
}
static inline double smaller(double a, double b) {
    return a < b ? a : b;
}
static inline double clamp(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

static inline double box_distance(vshi_vec p, double x, double y, double z) {
    const vshi_vec q = {fabs(p.x) - x, fabs(p.y) - y, fabs(p.z) - z};
    const double deepest = larger(q.x, larger(q.y, q.z));
    if (deepest <= 0.0) {
        return deepest;
    }
    return vshi_length((vshi_vec){larger(q.x, 0.0), larger(q.y, 0.0), larger(q.z, 0.0)});
}

static inline double cone_distance(vshi_vec p, double half_height, double base, double top) {
    const double r = sqrt(p.x * p.x + p.z * p.z);
    const double cap_r = r - smaller(r, p.y < 0.0 ? base : top);
    const double cap_y = fabs(p.y) - half_height;
    const double slope_r = top - base;
    const double slope_y = 2.0 * half_height;
    const double along =
        clamp(((top - r) * slope_r + (half_height - p.y) * slope_y) / (slope_r * slope_r + slope_y * slope_y),
              0.0, 1.0);
    const double side_r = r - top + slope_r * along;
    const double side_y = p.y - half_height + slope_y * along;
    const double squared = smaller(cap_r * cap_r + cap_y * cap_y, side_r * side_r + side_y * side_y);
    return side_r < 0.0 && cap_y < 0.0 ? -sqrt(squared) : sqrt(squared);
}

static inline double shape_distance(const vsh_sdf_node *node, vshi_vec p) {
    switch (node->shape) {
    case VSH_SDF_SPHERE:
        return vshi_length(p) - node->radius;
    case VSH_SDF_BOX:
        return box_distance(p, node->size[0], node->size[1], node->size[2]) - node->rounding;
    case VSH_SDF_TORUS: {
        const double ring = sqrt(p.x * p.x + p.z * p.z) - node->radius;
        return sqrt(ring * ring + p.y * p.y) - node->minor_radius;
    }
    case VSH_SDF_PLANE: {
        const double half = 0.5 * node->size[1];
        p.y += half;
        return box_distance(p, node->size[0], half, node->size[2]);
    }
    case VSH_SDF_CAPSULE:
        p.y -= clamp(p.y, -node->size[1], node->size[1]);
        return vshi_length(p) - node->radius;
    case VSH_SDF_CYLINDER: {
        const double r = sqrt(p.x * p.x + p.z * p.z) - node->radius;
        const double y = fabs(p.y) - node->size[1];
        if (r <= 0.0 || y <= 0.0) {
            return larger(r, y);
        }
        return sqrt(r * r + y * y);
    }
    default: /* VSH_SDF_CONE */
        return cone_distance(p, node->size[1], node->radius, node->minor_radius);
    }
}

static inline double combine(const vsh_sdf_node *node, double a, double b) {
    switch (node->shape) {
    case VSH_SDF_INTERSECTION:
        return larger(a, b);
    case VSH_SDF_SUBTRACTION:
        return larger(a, -b);
    case VSH_SDF_SMOOTH_UNION: {
        const double overlap = larger(node->smoothing - fabs(a - b), 0.0) / node->smoothing;
        return smaller(a, b) - 0.25 * node->smoothing * overlap * overlap;
    }
    default: /* VSH_SDF_UNION */
        return smaller(a, b);
    }
}

static inline vshi_vec to_node(const vsh_sdf_node *node, vshi_vec p) {
    p = rotate(node->rotation, -1.0, vshi_sub(p, vshi_vec_of(node->translation)));
    return node->scale != 1.0 ? vshi_scale(p, 1.0 / node->scale) : p;
}

/* Fields that a shape reads, in the order of vsh_sdf_node. */
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

/* Checks the operands of node `index`, and sets its depth. A depth of 0 marks a used node. */
static vsh_result check_operands(const vsh_sdf *sdf, size_t index, int32_t *depth, vsh_error *error) {
    const vsh_sdf_node *node = &sdf->nodes[index];
    if (!is_operation(node)) {
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

/* depth[node_count] is all 0. */
static vsh_result check_tree(const vsh_sdf *sdf, int32_t *depth, vsh_error *error) {
    for (size_t i = 0; i < sdf->node_count; ++i) {
        const vsh_sdf_node *node = &sdf->nodes[i];
        if ((uint32_t)node->shape >= SHAPE_COUNT) {
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
    vshi_sdf_bounds(sdf, low, high);
    return vshi_finite(vshi_vec_of(low)) && vshi_finite(vshi_vec_of(high))
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "sdf: its box is not finite: sizes too large");
}

vsh_result vshi_sdf_check(const vsh_sdf *sdf, vsh_error *error) {
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

/* `keep`: the deciding operands; NULL: both. */
static double node_distance(const vsh_sdf_node *nodes, const uint8_t *keep, int32_t index, vshi_vec p) {
    const vsh_sdf_node *node = &nodes[index];
    const int kept = keep != NULL ? keep[index] : KEEP_BOTH;
    double distance;
    p = to_node(node, p);
    if (!is_operation(node)) {
        distance = shape_distance(node, p);
    } else if (kept == KEEP_BOTH) {
        distance = combine(node, node_distance(nodes, keep, node->left, p),
                           node_distance(nodes, keep, node->right, p));
    } else {
        distance = node_distance(nodes, keep, kept == KEEP_LEFT ? node->left : node->right, p);
        distance = node->shape == VSH_SDF_SUBTRACTION && kept == KEEP_RIGHT ? -distance : distance;
    }
    return distance * node->scale;
}

double vshi_sdf_distance_at(const vsh_sdf *sdf, vshi_vec position) {
    return vshi_finite(position) ? node_distance(sdf->nodes, NULL, (int32_t)sdf->node_count - 1, position)
                                 : NAN;
}

void vshi_sdf_distances_within(const vsh_sdf *sdf, const uint8_t *keep, size_t count,
                               const double (*positions)[3], double *distances) {
    VSHI_FLOATS;
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_vec_of(positions[i]);
        distances[i] =
            vshi_finite(p) ? node_distance(sdf->nodes, keep, (int32_t)sdf->node_count - 1, p) : NAN;
    }
}

double vshi_sdf_distance(const vsh_sdf *sdf, const double position[3]) {
    VSHI_FLOATS;
    return vshi_sdf_distance_at(sdf, vshi_vec_of(position));
}

/* A distance, and the largest error by rounding. */
typedef struct rounded {
    double distance, error;
} rounded;

/* Narrows a tree to the shapes that decide within `radius`, in the units of the node's parent (T. Duff,
 * "Interval arithmetic and recursive subdivision for implicit functions", 1992). If operands differ by more
 * than both can change within the radius, rounding included, the same one decides everywhere. */
static rounded narrow(const vsh_sdf_node *nodes, int32_t index, vshi_vec p, double radius, uint8_t *keep) {
    const double ROUNDED = 1e-12; /* share of the lengths: a few thousand times a double's rounding */
    const double LARGEST = 1e100; /* its square is far from overflow */
    const vsh_sdf_node *node = &nodes[index];
    const double lengths = vshi_length(p) + vshi_length(vshi_vec_of(node->translation));
    p = to_node(node, p);
    radius /= node->scale;
    rounded here;
    keep[index] = KEEP_BOTH;
    if (!is_operation(node)) {
        here.distance = shape_distance(node, p);
        here.error = ROUNDED * (fabs(node->size[0]) + fabs(node->size[1]) + fabs(node->size[2]) +
                                fabs(node->radius) + fabs(node->minor_radius) + fabs(node->rounding));
    } else {
        const rounded left = narrow(nodes, node->left, p, radius, keep);
        const rounded right = narrow(nodes, node->right, p, radius, keep);
        here = (rounded){combine(node, left.distance, right.distance), left.error + right.error};
        /* positive: the left operand decides */
        const double more = node->shape == VSH_SDF_UNION          ? right.distance - left.distance
                            : node->shape == VSH_SDF_INTERSECTION ? left.distance - right.distance
                            : node->shape == VSH_SDF_SUBTRACTION  ? left.distance + right.distance
                                                                  : 0.0;
        if (fabs(more) > 2.0 * (radius * (1.0 + ROUNDED) + here.error) && fabs(more) < LARGEST) {
            keep[index] = more > 0.0 ? KEEP_LEFT : KEEP_RIGHT;
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
        if (is_operation(&sdf->nodes[i]) && sdf->nodes[i].shape != VSH_SDF_UNION) {
            return false;
        }
    }
    return true;
}

/* A node's place in the world: x → scale · (x · axis[0], x · axis[1], x · axis[2]) + origin. The axes are the
 * rows of a rotation. */
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
        at.axis[i] = rotate(node->rotation, -1.0, parent->axis[i]);
    }
    return at;
}

/* The support function of a shape: its extent along a unit direction. */
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
        return fabs(along.x) * node->size[0] + larger(-along.y, 0.0) * node->size[1] +
               fabs(along.z) * node->size[2];
    case VSH_SDF_CAPSULE:
        return fabs(along.y) * node->size[1] + node->radius;
    case VSH_SDF_CYLINDER:
        return fabs(along.y) * node->size[1] + across * node->radius;
    default: /* VSH_SDF_CONE */
        return larger(across * node->radius - along.y * node->size[1],
                      across * node->minor_radius + along.y * node->size[1]);
    }
}

static void node_bounds(const vsh_sdf_node *nodes, int32_t index, const placement *parent, double low[3],
                        double high[3]) {
    const vsh_sdf_node *node = &nodes[index];
    const placement at = place_node(parent, node);
    const double origin[3] = {at.origin.x, at.origin.y, at.origin.z};
    if (!is_operation(node)) {
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
            low[i] = larger(low[i], low2[i]);
            high[i] = larger(low[i], smaller(high[i], high2[i])); /* disjoint boxes: flat, not inverted */
        } else {
            low[i] = smaller(low[i], low2[i]) - grown;
            high[i] = larger(high[i], high2[i]) + grown;
        }
    }
}

void vshi_sdf_bounds(const vsh_sdf *sdf, double bounds_min[3], double bounds_max[3]) {
    VSHI_FLOATS;
    const placement world = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}, {0.0, 0.0, 0.0}, 1.0};
    node_bounds(sdf->nodes, (int32_t)sdf->node_count - 1, &world, bounds_min, bounds_max);
}
