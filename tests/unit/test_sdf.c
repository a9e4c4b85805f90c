/* Procedural shapes: their distances against surfaces found by brute force, and the promises of the tree. */
#include "fields.h"
#include "testing.h"

#include "geometry/sdf.h"

static uint64_t counter = 1;

static void random_point(double reach, double p[3]) {
    for (int i = 0; i < 3; ++i) {
        p[i] = between(&counter, -reach, reach);
    }
}

static double norm(double x, double y, double z) {
    return sqrt(x * x + y * y + z * z);
}

static vsh_sdf_node shape_of(int32_t shape) {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.shape = shape;
    node.size[0] = 0.7;
    node.size[1] = 0.4;
    node.size[2] = 0.9;
    node.radius = shape == VSH_SDF_TORUS || shape == VSH_SDF_CONE ? 0.8 : 0.5;
    node.minor_radius = 0.2;
    return node;
}

/* Membership by the shapes' definitions, with nothing in common with their distances. */
static int holds(const vsh_sdf_node *n, double x, double y, double z) {
    const double r = sqrt(x * x + z * z);
    switch (n->shape) {
    case VSH_SDF_SPHERE:
        return norm(x, y, z) < n->radius;
    case VSH_SDF_BOX:
        return fabs(x) < n->size[0] && fabs(y) < n->size[1] && fabs(z) < n->size[2];
    case VSH_SDF_TORUS:
        return (r - n->radius) * (r - n->radius) + y * y < n->minor_radius * n->minor_radius;
    case VSH_SDF_PLANE:
        return fabs(x) < n->size[0] && y < 0.0 && y > -n->size[1] && fabs(z) < n->size[2];
    case VSH_SDF_CAPSULE:
        return (fabs(y) < n->size[1] && r < n->radius) || norm(x, y - n->size[1], z) < n->radius ||
               norm(x, y + n->size[1], z) < n->radius;
    case VSH_SDF_CYLINDER:
        return fabs(y) < n->size[1] && r < n->radius;
    default: {
        const double up = (y + n->size[1]) / (2.0 * n->size[1]);
        return up > 0.0 && up < 1.0 && r < n->radius + (n->minor_radius - n->radius) * up;
    }
    }
}

/* Distance to the nearest point of a fine lattice on the other side: an upper bound of the distance, and one
 * that is high by at most the lattice's diagonal. */
static double brute_force(const vsh_sdf_node *n, const double p[3], double pitch) {
    const int inside = holds(n, p[0], p[1], p[2]);
    double nearest = INFINITY;
    for (double x = -1.5; x <= 1.5; x += pitch) {
        for (double y = -1.5; y <= 1.5; y += pitch) {
            for (double z = -1.5; z <= 1.5; z += pitch) {
                const double d = norm(x - p[0], y - p[1], z - p[2]);
                if (d < nearest && holds(n, x, y, z) != inside) {
                    nearest = d;
                }
            }
        }
    }
    return inside ? -nearest : nearest;
}

TEST(every_shape_gives_the_distance_to_its_surface) {
    const double pitch = 0.03;
    for (int32_t shape = VSH_SDF_SPHERE; shape <= VSH_SDF_CONE; ++shape) {
        const vsh_sdf_node node = shape_of(shape);
        const vsh_sdf sdf = {&node, 1};
        for (int i = 0; i < 30; ++i) {
            double p[3];
            random_point(1.2, p);
            const double d = vshi_sdf_distance(&sdf, p);
            const double truth = brute_force(&node, p, pitch);
            assert_that(fabs(d) <= fabs(truth) + 1e-9 && fabs(d) >= fabs(truth) - 1.8 * pitch &&
                            (d < 0.0) == (truth < 0.0),
                        "shape %d at %g, %g, %g: %g, brute force %g", shape, p[0], p[1], p[2], d, truth);
        }
    }
}

TEST(closed_forms_hold) {
    static const struct {
        int32_t shape;
        double rounding, minor_radius, at[3], distance;
    } cases[] = {
        {VSH_SDF_BOX, 0.0, 0.2, {1.0, 0.8, 1.3}, 0.64031242374328485}, /* √(0.3² + 0.4² + 0.4²) */
        {VSH_SDF_BOX, 0.1, 0.2, {1.0, 0.8, 1.3}, 0.54031242374328485},
        {VSH_SDF_CONE, 0.0, 0.0, {0.0, 1.0, 0.0}, 0.6},
        {VSH_SDF_TORUS, 0.0, 0.2, {0.0, 0.0, 0.0}, 0.6},
        {VSH_SDF_PLANE, 0.0, 0.2, {0.1, 2.0, 0.1}, 2.0},
        {VSH_SDF_PLANE, 0.0, 0.2, {NAN, 0.0, 0.0}, NAN},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        vsh_sdf_node node = shape_of(cases[i].shape);
        node.rounding = cases[i].rounding;
        node.minor_radius = cases[i].minor_radius;
        const double distance = vshi_sdf_distance(&(vsh_sdf){&node, 1}, cases[i].at);
        assert_true(isnan(cases[i].distance) ? isnan(distance) : fabs(distance - cases[i].distance) < 1e-12);
    }
}

/* Turns, moves and scales a node, moving it by at most `reach` along each axis. */
static void place_somehow(vsh_sdf_node *node, double reach) {
    for (int i = 0; i < 4; ++i) {
        node->rotation[i] = between(&counter, -1.0, 1.0);
    }
    random_point(reach, node->translation);
    node->scale = between(&counter, 0.5, 2.0);
}

/* An operation over two shapes, all placed somehow. */
static void make_tree(vsh_sdf_node nodes[3], int32_t a, int32_t b, int32_t operation) {
    nodes[0] = shape_of(a);
    nodes[1] = shape_of(b);
    nodes[2] = operation_node(operation, 0, 1);
    nodes[2].smoothing = 0.3;
    for (int i = 0; i < 3; ++i) {
        place_somehow(&nodes[i], 0.5);
    }
}

TEST(no_tree_changes_by_more_than_one_per_unit) {
    for (int32_t operation = VSH_SDF_UNION; operation <= VSH_SDF_SMOOTH_UNION; ++operation) {
        for (int32_t pair = 0; pair < 49; ++pair) {
            vsh_sdf_node nodes[3];
            make_tree(nodes, pair / 7, pair % 7, operation);
            const vsh_sdf sdf = {nodes, 3};
            assert_ok(vshi_sdf_check(&sdf, &failure));
            for (int i = 0; i < 200; ++i) {
                const double reach = i % 2 == 0 ? 3.0 : 0.01;
                double a[3], b[3];
                for (int j = 0; j < 3; ++j) {
                    a[j] = between(&counter, -2.0, 2.0);
                    b[j] = a[j] + between(&counter, -reach, reach);
                }
                const double change = fabs(vshi_sdf_distance(&sdf, a) - vshi_sdf_distance(&sdf, b));
                assert_true(change <= norm(a[0] - b[0], a[1] - b[1], a[2] - b[2]) + 1e-12);
            }
        }
    }
}

TEST(the_box_holds_the_surface_and_touches_it_for_shapes) {
    for (int round = 0; round < 60; ++round) {
        vsh_sdf_node nodes[3];
        const int32_t operation = VSH_SDF_UNION + round % 4;
        make_tree(nodes, round % 7, (round / 7) % 7, operation);
        vsh_sdf sdf = {nodes, 3};
        double low[3], high[3];
        vshi_sdf_bounds(&sdf, low, high);
        for (int i = 0; i < 2000; ++i) {
            double p[3];
            random_point(4.0, p);
            if (vshi_sdf_distance(&sdf, p) < 0.0) {
                for (int j = 0; j < 3; ++j) {
                    assert_true(p[j] >= low[j] && p[j] <= high[j]);
                }
            }
        }
        sdf.node_count = 1;
        vshi_sdf_bounds(&sdf, low, high);
        for (int axis = 0; axis < 3; ++axis) { /* the face of the box must come near the shape somewhere */
            double nearest = INFINITY;
            for (int i = 0; i < 80 * 80; ++i) {
                double p[3];
                p[axis] = high[axis];
                const int u = (axis + 1) % 3, v = (axis + 2) % 3;
                p[u] = low[u] + (high[u] - low[u]) * (i % 80 + 0.5) / 80.0;
                p[v] = low[v] + (high[v] - low[v]) * (floor(i / 80.0) + 0.5) / 80.0;
                nearest = fmin(nearest, vshi_sdf_distance(&sdf, p));
            }
            assert_true(nearest > -1e-9 && nearest < 0.06);
        }
    }
}

TEST(operations_are_the_sets_operations) {
    for (int round = 0; round < 49; ++round) {
        vsh_sdf_node nodes[3];
        make_tree(nodes, round / 7, round % 7, VSH_SDF_UNION);
        nodes[2] = operation_node(VSH_SDF_UNION, 0, 1);
        nodes[2].smoothing = 0.3;
        const vsh_sdf both = {nodes, 3}, left = {&nodes[0], 1}, right = {&nodes[1], 1};
        for (int i = 0; i < 300; ++i) {
            double p[3];
            random_point(2.0, p);
            const bool a = vshi_sdf_distance(&left, p) < 0.0, b = vshi_sdf_distance(&right, p) < 0.0;
            nodes[2].shape = VSH_SDF_UNION;
            const double united = vshi_sdf_distance(&both, p);
            assert_int_equal(united < 0.0, a || b);
            nodes[2].shape = VSH_SDF_INTERSECTION;
            assert_int_equal(vshi_sdf_distance(&both, p) < 0.0, a && b);
            nodes[2].shape = VSH_SDF_SUBTRACTION;
            assert_int_equal(vshi_sdf_distance(&both, p) < 0.0, a && !b);
            nodes[2].shape = VSH_SDF_SMOOTH_UNION;
            const double smooth = vshi_sdf_distance(&both, p);
            assert_true(smooth <= united && smooth >= united - 0.25 * nodes[2].smoothing);
        }
    }
}

TEST(a_turned_scaled_shape_is_the_shape_seen_from_elsewhere) {
    vsh_sdf_node node = shape_of(VSH_SDF_BOX);
    const vsh_sdf sdf = {&node, 1};
    const double h = sqrt(0.5);
    const double quarter[4] = {0.0, 3.0 * h, 0.0,
                               3.0 * h}; /* 90° about y, not of unit length: x goes to -z */
    memcpy(node.rotation, quarter, sizeof quarter);
    node.scale = 2.0;
    node.translation[0] = 10.0;
    const double end[3] = {10.0, 0.0, -2.4};
    assert_float_equal(vshi_sdf_distance(&sdf, end), 1.0, 1e-12);
    double low[3], high[3];
    vshi_sdf_bounds(&sdf, low, high);
    assert_float_equal(low[0], 10.0 - 1.8, 1e-12);
    assert_float_equal(high[2], 1.4, 1e-12);
}

static void refused(const vsh_sdf_node *nodes, size_t count, const char *part) {
    const vsh_sdf sdf = {nodes, count};
    assert_fails(vshi_sdf_check(&sdf, &failure), VSH_ERROR_INPUT, part);
}

TEST(bad_nodes_are_refused_by_name) {
    vsh_sdf_node nodes[3];
    make_tree(nodes, VSH_SDF_SPHERE, VSH_SDF_CONE, VSH_SDF_SMOOTH_UNION);
    refused(nodes, 0, "0 nodes");
    refused(NULL, 1, "nodes");
    refused(nodes, 2, "node 0 (sphere): no operation uses it");
    vsh_sdf_node *const leaf = &nodes[0], *const root = &nodes[2];
    const struct {
        double *field;
        double value;
        const char *part;
    } cases[] = {
        {&leaf->radius, 0.0, "node 0 (sphere): radius 0"},
        {&leaf->radius, NAN, "radius"},
        {&leaf->scale, -1.0, "scale -1"},
        {&leaf->translation[1], INFINITY, "translation"},
        {&nodes[1].minor_radius, -0.1, "node 1 (cone): minor_radius -0.1"},
        {&root->smoothing, 0.0, "node 2 (smooth union): smoothing 0"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const double old = *cases[i].field;
        *cases[i].field = cases[i].value;
        refused(nodes, 3, cases[i].part);
        *cases[i].field = old;
    }
    root->left = 2;
    refused(nodes, 3, "left 2: expected 0 … 1");
    root->left = 1;
    refused(nodes, 3, "right 1: that node is an operand already");
    root->left = 0;
    memset(root->rotation, 0, sizeof root->rotation);
    refused(nodes, 3, "rotation");
    root->shape = 11;
    refused(nodes, 3, "node 2: shape 11");
}

TEST(a_tree_too_deep_to_recurse_is_refused_and_a_deep_one_works) {
    enum { SHAPES = 3000 };
    FREED vsh_sdf_node *nodes = malloc((2 * SHAPES - 1) * sizeof *nodes);
    size_t count = 0;
    for (int i = 0; i < SHAPES; ++i) {
        nodes[count] = vsh_sdf_node_default();
        nodes[count++].translation[0] = i;
        if (i > 0) {
            nodes[count] = operation_node(VSH_SDF_UNION, (int32_t)count - 2, (int32_t)count - 1);
            ++count;
        }
    }
    const vsh_sdf deep = {nodes, 2 * 2000 - 1};
    assert_ok(vshi_sdf_check(&deep, &failure));
    const double p[3] = {1500.0, 3.0, 0.0};
    assert_float_equal(vshi_sdf_distance(&deep, p), 2.0, 1e-12);
    refused(nodes, count, "deep");
}

/* A tree over `count` shapes of all kinds, placed somehow and joined by any operations. */
static size_t random_tree(vsh_sdf_node *nodes, int count, bool unions) {
    size_t used = 0;
    int32_t last = -1;
    for (int i = 0; i < count; ++i) {
        nodes[used] = shape_of((int32_t)between(&counter, VSH_SDF_SPHERE, VSH_SDF_CONE + 0.999));
        place_somehow(&nodes[used], 4.0);
        const int32_t here = (int32_t)used++;
        if (last >= 0) {
            const double most = unions ? VSH_SDF_UNION : VSH_SDF_SMOOTH_UNION;
            const int32_t kind = (int32_t)between(&counter, VSH_SDF_UNION, most + 0.999);
            vsh_sdf_node operation =
                i % 2 == 0 ? operation_node(kind, last, here) : operation_node(kind, here, last);
            operation.smoothing = 0.3;
            operation.translation[i % 3] = between(&counter, -0.2, 0.2);
            operation.rotation[1] = between(&counter, -0.2, 0.2);
            operation.scale = between(&counter, 0.9, 1.1);
            nodes[used++] = operation;
        }
        last = (int32_t)used - 1;
    }
    return used;
}

TEST(a_tree_narrowed_to_a_ball_has_the_same_bits_in_it) {
    enum { SHAPES = 12, TREES = 200, PLACES = 20, POINTS = 70 };
    vsh_sdf_node nodes[2 * SHAPES];
    uint8_t keep[2 * SHAPES];
    size_t left_out = 0, operations = 0;
    for (int t = 0; t < TREES; ++t) {
        const vsh_sdf sdf = {nodes, random_tree(nodes, SHAPES, t % 2 == 0)};
        assert_ok(vshi_sdf_check(&sdf, &failure));
        for (int i = 0; i < PLACES; ++i) {
            const double radius = pow(10.0, between(&counter, -3.0, 0.5));
            double middle[3];
            random_point(6.0, middle);
            vshi_sdf_narrow(&sdf, middle, radius, keep);
            for (size_t n = 0; n < sdf.node_count; ++n) {
                operations += nodes[n].shape >= VSH_SDF_UNION;
                left_out += keep[n] != 0;
            }
            double p[POINTS][3], less[POINTS];
            for (int k = 0; k < POINTS; ++k) { /* on the ball's surface, where they change most, and in it */
                double way[3];
                random_point(1.0, way);
                const double length = norm(way[0], way[1], way[2]);
                const double far = (k % 2 == 0 ? radius : between(&counter, 0.0, radius)) / length;
                go_along(middle, far, way, p[k]);
            }
            vshi_sdf_distances_within(&sdf, keep, POINTS, (const double(*)[3])p, less);
            for (int k = 0; k < POINTS; ++k) {
                const double whole = vshi_sdf_distance(&sdf, p[k]);
                assert_memory_equal(&whole, &less[k], sizeof whole);
            }
        }
    }
    assert_true(left_out > operations / 2); /* else it does not narrow */
}
