/* The truth that the other tests compare with, against closed forms. */
#include "analytic.h"
#include "directions.h"
#include "embree.h"
#include "metrics.h"
#include "testing.h"

OWNER(truth_mesh)

static const double pi = 3.14159265358979323846;
static const double up[3] = {0.0, 1.0, 0.0};
static const double origin[3] = {0.0, 0.0, 0.0};

static void near_value(double value, double expected, double tolerance, const char *what) {
    assert_that(fabs(value - expected) <= tolerance, "%s: %.9g is not within %g of %.9g", what, value,
                tolerance, expected);
}

static truth_scene one(const truth_solid *solid) {
    return (truth_scene){solid, 1};
}

/* Area that discs of radii a and b, d apart, share, over that of the first. */
static double lens(double a, double b, double d) {
    if (d >= a + b) {
        return 0.0;
    }
    if (d <= fabs(a - b)) {
        return a <= b ? 1.0 : b * b / (a * a);
    }
    const double x = (d * d + a * a - b * b) / (2.0 * d);
    const double y = d - x;
    const double part =
        a * a * acos(x / a) - x * sqrt(a * a - x * x) + b * b * acos(y / b) - y * sqrt(b * b - y * y);
    return part / (pi * a * a);
}

/* Numbers in 0 … 1 without state: the fractional parts of multiples of an irrational. */
static double number(size_t i, double irrational) {
    return fmod((double)(i + 1) * irrational, 1.0);
}

TEST(a_light_under_open_sky_is_seen_whole) {
    const double point[3] = {2.9, 0.001, -2.9};
    const double away[3] = {0.5, 0.6, -0.6};
    near_value(truth_light(truth_seeds(), point, up, away, 0.1, INFINITY, 256), 1.0, 0.0, "sky");
}

TEST(a_sphere_in_front_of_a_disc_leaves_one_less_the_lens) {
    /* Small angles, so that the sphere's outline on the disc's plane is a circle to 1e-4. */
    const double w = 0.02;
    for (int i = 0; i <= 10; i++) {
        for (int j = 1; j <= 3; j++) {
            const double apart = 0.004 * i;
            const double outline = 0.008 * j;
            const double height = 10.0;
            const truth_solid sphere = {TRUTH_SPHERE,
                                        {height * sin(apart), height * cos(apart), 0.0},
                                        {0.0, 0.0, 0.0},
                                        height * sin(outline),
                                        0.0};
            const double seen = truth_light(one(&sphere), origin, up, up, w, INFINITY, 4096);
            near_value(seen, 1.0 - lens(w, outline, apart), 4e-3, "sphere before a disc");
        }
    }
}

TEST(a_straight_edge_leaves_the_circular_segment) {
    const double w = 0.3;
    for (int i = -5; i <= 5; i++) {
        const double x = i / 5.0;
        /* A thin slab at height 2 with its edge at x radii of the disc that is seen there. */
        const truth_solid slab = {
            TRUTH_BOX, {2.0 * w * x + 50.0, 2.0005, 0.0}, {50.0, 0.0005, 50.0}, 0.0, 0.0};
        const double seen = truth_light(one(&slab), origin, up, up, w, INFINITY, 4096);
        near_value(seen, truth_disc_share(x), 4e-3, "straight edge");
    }
    near_value(truth_disc_share(0.0), 0.5, 0.0, "half");
    near_value(truth_disc_share(1.0), 1.0, 1e-15, "whole");
    near_value(truth_disc_share(-1.0), 0.0, 1e-15, "none");
}

TEST(a_torus_seen_along_its_axis_hides_a_ring) {
    const double depth = 3.0;
    const double ring = 0.5;
    const double tube = 0.1;
    const double w = 0.3;
    const truth_solid torus = {TRUTH_TORUS, {0.0, depth, 0.0}, {0.0, 0.0, 0.0}, ring, tube};
    const double middle = atan2(ring, depth);
    const double half = asin(tube / hypot(ring, depth));
    const double inner = tan(middle - half) / w;
    const double outer = tan(middle + half) / w;
    const double seen = truth_light(one(&torus), origin, NULL, up, w, INFINITY, 16384);
    near_value(seen, 1.0 - outer * outer + inner * inner, 1e-3, "torus");
}

/* Least distance along a ray, by walking it with the distance function and refining around the best point. */
static double least_distance(const truth_solid *solid, const double from[3], const double direction[3]) {
    double best = INFINITY;
    double best_t = 0.0;
    for (int pass = 0; pass < 3; pass++) {
        const double width = pass == 0 ? 6.0 : pass == 1 ? 0.02 : 1e-4;
        const double start = pass == 0 ? 0.0 : fmax(0.0, best_t - width / 2.0);
        for (int i = 0; i <= 1000; i++) {
            const double t = start + width * i / 1000.0;
            const double p[3] = {from[0] + t * direction[0], from[1] + t * direction[1],
                                 from[2] + t * direction[2]};
            const double h = truth_solid_distance(solid, p);
            if (h < best) {
                best = h;
                best_t = t;
            }
        }
    }
    return best;
}

TEST(rays_hit_exactly_where_the_distance_along_them_falls_below_zero) {
    const truth_scene scene = truth_seeds();
    size_t hits = 0;
    size_t misses = 0;
    for (size_t i = 0; i < 2000; i++) {
        const truth_solid *solid = &scene.solids[i % scene.count];
        double from[3];
        double direction[3];
        double square = 0.0;
        const double turn[3] = {0.6180339887498949, 0.7548776662466927, 0.5698402909980532};
        for (int k = 0; k < 3; k++) {
            from[k] = solid->center[k] + 4.0 * (number(i, turn[k]) - 0.5);
            const double aim = solid->center[k] + 1.2 * (number(i, turn[k] * 1.4142135623730951) - 0.5);
            direction[k] = aim - from[k];
            square += direction[k] * direction[k];
        }
        for (int k = 0; k < 3; k++) {
            direction[k] /= sqrt(square);
        }
        const double least = least_distance(solid, from, direction);
        if (fabs(least) < 1e-4) {
            continue; /* grazes: the walk is too coarse to tell */
        }
        const bool hit = truth_solid_hit(solid, from, direction, INFINITY);
        assert_that(hit == (least < 0.0), "solid %zu, ray %zu: hit %d, but the least distance is %g",
                    i % scene.count, i, hit, least);
        hits += hit ? 1 : 0;
        misses += hit ? 0 : 1;
    }
    assert_true(hits > 500 && misses > 200);
}

/* Tangents just under and just over every rounded corner, edge and face of a box. */
TEST(a_rounded_box_is_as_round_as_it_says_everywhere) {
    const truth_solid box = {TRUTH_BOX, {0.1, 0.2, 0.3}, {0.4, 0.3, 0.5}, 0.25, 0.0};
    for (int side = 0; side < 27; side++) {
        const int sign[3] = {side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1};
        const double out[3] = {sign[0], sign[1], sign[2]};
        if (side == 13) {
            continue; /* the middle */
        }
        const truth_frame frame = truth_frame_around(out);
        for (int i = 0; i < 8; i++) {
            double direction[3];
            truth_to_world(&frame, (double[]){cos(0.4 + i), sin(0.4 + i), 0.0}, direction);
            for (int over = 0; over < 2; over++) {
                double from[3];
                for (int k = 0; k < 3; k++) {
                    from[k] = box.center[k] + sign[k] * box.half[k] +
                              frame.n[k] * box.radius * (over != 0 ? 1.001 : 0.999) - 3.0 * direction[k];
                }
                assert_that(truth_solid_hit(&box, from, direction, INFINITY) == (over == 0),
                            "side %d %d %d, tangent %d, over %d", sign[0], sign[1], sign[2], i, over);
            }
        }
    }
}

TEST(rays_end_at_their_limit_and_begin_at_their_origin) {
    const truth_solid solids[] = {
        {TRUTH_SPHERE, {0.0, 2.0, 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0},
        {TRUTH_BOX, {0.0, 2.0, 0.0}, {0.5, 0.5, 0.5}, 0.0, 0.0},
        {TRUTH_BOX, {0.0, 2.0, 0.0}, {0.4, 0.4, 0.4}, 0.1, 0.0},
        {TRUTH_TORUS, {-1.0, 2.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.5},
    };
    const double down[3] = {0.0, -1.0, 0.0};
    for (size_t i = 0; i < sizeof solids / sizeof solids[0]; i++) {
        assert_true(truth_solid_hit(&solids[i], origin, up, 1.5001));
        assert_false(truth_solid_hit(&solids[i], origin, up, 1.4999));
        assert_false(truth_solid_hit(&solids[i], origin, down, INFINITY));
        assert_true(truth_solid_hit(
            &solids[i], solids[i].shape == TRUTH_TORUS ? (double[]){0.0, 2.0, 0.0} : solids[i].center, down,
            INFINITY));
    }
}

TEST(distances_of_the_seeds_are_right_by_hand) {
    static const struct {
        const char *what;
        double at[3], distance;
    } cases[] = {
        {"middle of the sphere", {0.0, 0.8, 0.0}, -0.5},  {"between plate and sphere", {0.0, 0.1, 0.0}, 0.1},
        {"in the torus", {1.6, 0.6, -0.3}, -0.08},        {"in its hole", {1.2, 0.6, -0.3}, 0.32},
        {"over the rounded box", {-1.2, 1.25, 0.5}, 0.2}, {"off its edge", {-1.8, 1.4, 0.5}, 0.45},
        {"in the post", {0.3, 1.0, 1.5}, -0.05}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        near_value(truth_distance(truth_seeds(), cases[i].at), cases[i].distance, 1e-15, cases[i].what);
    }
}

TEST(ao_beside_a_wall_is_a_half_and_fades_with_distance) {
    const truth_solid wall = {TRUTH_BOX, {51.0, 0.0, 0.0}, {50.0, 1000.0, 1000.0}, 0.0, 0.0};
    near_value(truth_ao(one(&wall), (double[]){1.0, 0.0, 0.0}, up, 2.0, 4096), 0.5, 2e-3, "in the corner");
    /* Rays reach the wall, 1 away, within D where their share along x is above 1 / D: a disc's segment. */
    for (int i = 1; i <= 5; i++) {
        const double distance = 0.7 * i;
        near_value(truth_ao(one(&wall), origin, up, distance, 4096), truth_disc_share(1.0 / distance), 3e-3,
                   "wall within a distance");
    }
}

TEST(ao_under_a_sphere_is_one_less_its_form_factor) {
    const truth_solid sphere = {TRUTH_SPHERE, {0.0, 2.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.0};
    near_value(truth_ao(one(&sphere), origin, up, INFINITY, 4096), 0.75, 1e-3, "sphere overhead");
    const double tilted[3] = {sin(0.4), cos(0.4), 0.0}; /* the form factor of a sphere: cos × (r / d)² */
    near_value(truth_ao(one(&sphere), origin, tilted, INFINITY, 4096), 1.0 - 0.25 * cos(0.4), 2e-3,
               "sphere aside");
}

TEST(what_lies_below_the_horizon_is_hidden) {
    const truth_scene empty = {NULL, 0};
    const double level[3] = {1.0, 0.0, 0.0};
    near_value(truth_light(empty, origin, up, level, 0.1, INFINITY, 4096), 0.5, 2e-3, "half set");
    near_value(truth_light(empty, origin, NULL, level, 0.1, INFINITY, 4096), 1.0, 0.0, "no horizon");
}

TEST(culling_changes_nothing) {
    const truth_scene scene = truth_seeds();
    const truth_frame frame = truth_frame_around(truth_seeds_sun);
    double penumbra = 0.0;
    for (size_t i = 0; i < 400; i++) {
        const double point[3] = {5.0 * (number(i, 0.7548776662466927) - 0.5), 0.001,
                                 5.0 * (number(i, 0.5698402909980532) - 0.5)};
        size_t seen = 0;
        for (size_t ray = 0; ray < 64; ray++) {
            double direction[3];
            truth_light_direction(&frame, truth_seeds_w, ray, 64, direction);
            seen += truth_hit(scene, point, direction, INFINITY) ? 0 : 1;
        }
        const double value = truth_light(scene, point, up, truth_seeds_sun, truth_seeds_w, INFINITY, 64);
        assert_true(value == (double)seen / 64.0);
        penumbra += value > 0.02 && value < 0.98 ? 1.0 : 0.0;
    }
    assert_true(penumbra > 10.0);
}

/* A box of triangles, -1 … 1. */
static vsh_mesh turned_box(const double *transform) {
    static float corners[24];
    vsh_mesh mesh = box_mesh(corners, (const double[]){-1.0, -1.0, -1.0}, (const double[]){1.0, 1.0, 1.0});
    mesh.transform = transform;
    return mesh;
}

enum { POINTS = 600, RAYS = 256 };

typedef struct receivers {
    double positions[3 * POINTS];
    float normals[3 * POINTS];
} receivers;

static void place(receivers *points, const double shift[3]) {
    for (size_t i = 0; i < POINTS; i++) {
        points->positions[3 * i] = shift[0] + 4.0 * (number(i, 0.7548776662466927) - 0.5);
        points->positions[3 * i + 1] = shift[1];
        points->positions[3 * i + 2] = shift[2] + 4.0 * (number(i, 0.5698402909980532) - 0.5);
        points->normals[3 * i] = 0.0F;
        points->normals[3 * i + 1] = 1.0F;
        points->normals[3 * i + 2] = 0.0F;
    }
}

/* Boxes at one place in three ways: as they are, mirrored, and a million units away. */
TEST(mesh_and_analytic_truth_agree_on_a_box) {
    static receivers points;
    static float light[POINTS], ao[POINTS], backs[POINTS], light_truth[POINTS], ao_truth[POINTS];
    for (int variant = 0; variant < 3; variant++) {
        const double mirror = variant == 1 ? -1.0 : 1.0;
        const double far = variant == 2 ? 1048576.0 : 0.0;
        const double shift[3] = {far, 0.0, -far};
        const double transform[12] = {0.5 * mirror, 0.0, 0.0, far, 0.0, 0.4, 0.0, 1.0, 0.0, 0.0, 0.3, -far};
        const vsh_mesh mesh = turned_box(transform);
        OWNED(truth_mesh) *truth = truth_mesh_create(&mesh, 1);
        assert_non_null(truth);
        place(&points, shift);
        assert_int_equal(truth_mesh_light(truth, POINTS, points.positions, points.normals, truth_seeds_sun,
                                          0.2, RAYS, 2, light),
                         0);
        assert_int_equal(truth_mesh_ao(truth, POINTS, points.positions, points.normals, 1.5, RAYS, 2, ao), 0);
        assert_int_equal(truth_mesh_backs(truth, POINTS, points.positions, points.normals, RAYS, 2, backs),
                         0);
        const truth_solid box = {TRUTH_BOX, {far, 1.0, -far}, {0.5, 0.4, 0.3}, 0.0, 0.0};
        for (size_t i = 0; i < POINTS; i++) {
            const double *p = &points.positions[3 * i];
            light_truth[i] = (float)truth_light(one(&box), p, up, truth_seeds_sun, 0.2, INFINITY, RAYS);
            ao_truth[i] = (float)truth_ao(one(&box), p, up, 1.5, RAYS);
            near_value(backs[i], 0.0, 0.0, "backs outside of a box");
        }
        const truth_metrics lit = truth_compare(POINTS, light, light_truth, NULL);
        const truth_metrics open = truth_compare(POINTS, ao, ao_truth, NULL);
        assert_true(lit.penumbra > 20);
        near_value(lit.max, 0.0, 2.5 / RAYS, "light"); /* floats may turn a ray or two that graze */
        near_value(open.max, 0.0, 2.5 / RAYS, "ao");

        const double inside[3] = {far + 0.1, 1.1, -far};
        const float side[3] = {0.6F, 0.0F, 0.8F};
        float seen = 0.0F;
        assert_int_equal(truth_mesh_backs(truth, 1, inside, side, RAYS, 1, &seen), 0);
        near_value(seen, 1.0, 0.0, "backs inside of a box");
    }
}

TEST(metrics_are_right_by_hand) {
    float values[100], truth[100], mask[100];
    for (int i = 0; i < 100; i++) {
        truth[i] = i < 20 ? 0.5F : 1.0F;
        values[i] = truth[i];
        mask[i] = 1.0F;
    }
    values[3] = 0.75F;  /* +0.25, in the penumbra */
    values[50] = 0.5F;  /* -0.5 */
    values[99] = -9.0F; /* masked away */
    mask[99] = 0.0F;
    const truth_metrics metrics = truth_compare(100, values, truth, mask);
    assert_int_equal(metrics.count, 99);
    assert_int_equal(metrics.penumbra, 20);
    assert_int_equal(metrics.worst, 50);
    near_value(metrics.rmse, sqrt((0.0625 + 0.25) / 99.0), 1e-12, "rmse");
    near_value(metrics.penumbra_rmse, sqrt(0.0625 / 20.0), 1e-12, "penumbra");
    near_value(metrics.bias, -0.25 / 99.0, 1e-12, "bias");
    near_value(metrics.p95, 0.0, 0.0, "p95");
    near_value(metrics.p99, 0.5, 0.0, "p99: rank 99 of 99");
    near_value(metrics.max, 0.5, 0.0, "max");
    values[7] = NAN;
    const truth_metrics broken = truth_compare(100, values, truth, mask);
    assert_true(isinf(broken.max) && isinf(broken.rmse) && broken.worst == 7);
    assert_int_equal(truth_compare(0, values, truth, NULL).count, 0);
}
