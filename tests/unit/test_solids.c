/* Rays against procedural solids: closed forms, rays against the same solids by other code, other places and
 * sizes, triangles beside them, bad input. */
#include "shading.h"

#include "truth/directions.h"

#include <vdbshade/trace.h>

#define NEAR(value, expected, tolerance)                                                                     \
    do {                                                                                                     \
        const double value_ = (value), expected_ = (expected);                                               \
        if (!(fabs(value_ - expected_) <= (tolerance))) {                                                    \
            fail_msg("%s: %.9g is not within %g of %.9g", #value, value_, (double)(tolerance), expected_);   \
        }                                                                                                    \
    } while (0)

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double ORIGIN[3] = {0.0, 0.0, 0.0}, OVERHEAD[3] = {0.0, 1.0, 0.0};

static vsh_sdf_node shape_at(int32_t shape, double x, double y, double z) {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.shape = shape;
    node.translation[0] = x;
    node.translation[1] = y;
    node.translation[2] = z;
    return node;
}

static vsh_sdf_node box_at(double x, double y, double z, double a, double b, double c) {
    vsh_sdf_node node = shape_at(VSH_SDF_BOX, x, y, z);
    node.size[0] = a;
    node.size[1] = b;
    node.size[2] = c;
    return node;
}

/* Solids of one tree under a transform (NULL: none). */
static vsh_solids *solids_of(const vsh_sdf_node *nodes, size_t count, const double *transform) {
    const vsh_sdf sdf = {nodes, count};
    vsh_solids *solids = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_solids_create(&sdf, transform, 1, &solids, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return solids;
}

static float seen(const vsh_solids *solids, const double *position, const float *normal,
                  const vsh_light *light, int32_t rays) {
    float value = -1.0f;
    assert_int_equal(
        vsh_trace_shadow(NULL, solids, 1, position, normal, 0.0, light, rays, NULL, &value, NULL), VSH_OK);
    return value;
}

static void a_straight_edge_leaves_the_circular_segment(void **state) {
    (void)state;
    const double x[] = {-1.01, -0.7, -0.3, 0.0, 0.25, 0.8, 1.01}, half = 0.2;
    for (size_t i = 0; i < sizeof x / sizeof x[0]; ++i) {
        /* a sheet of a millionth whose lower edge decides */
        const vsh_sdf_node sheet = box_at(x[i] * tan(half) * 5.0 + 50.0, 5.0, 0.0, 50.0, 1e-6, 50.0);
        vsh_solids *solids = solids_of(&sheet, 1, NULL);
        const double place[3] = {0.0, 20.0, 0.0};
        const vsh_light lights[2] = {sun(OVERHEAD, 2.0 * half), lamp(place, 20.0 * sin(half))};
        for (int l = 0; l < 2; ++l) {
            NEAR(seen(solids, ORIGIN, UP, &lights[l], 8192), truth_disc_share(x[i]), 0.003);
        }
        vsh_solids_free(solids);
    }
}

static void a_hole_in_a_slab_lets_its_share_of_the_disc_through(void **state) {
    (void)state;
    vsh_sdf_node nodes[3] = {box_at(0.0, 3.0, 0.0, 20.0, 0.5, 20.0),
                             shape_at(VSH_SDF_CYLINDER, 0.0, 3.0, 0.0),
                             shape_at(VSH_SDF_SUBTRACTION, 0.0, 0.0, 0.0)};
    nodes[1].size[1] = 2.0;
    nodes[1].radius = 0.35;
    nodes[2].left = 0;
    nodes[2].right = 1;
    vsh_solids *solids = solids_of(nodes, 3, NULL);
    /* the hole's upper rim is the narrower one: 0.35 at a height of 3.5, a tangent of 0.1 */
    const double tangents[] = {0.05, 0.099, 0.15, 0.2, 0.4};
    for (size_t i = 0; i < sizeof tangents / sizeof tangents[0]; ++i) {
        const double w = tangents[i];
        const vsh_light light = sun(OVERHEAD, 2.0 * atan(w));
        NEAR(seen(solids, ORIGIN, UP, &light, 8192), fmin(1.0, 0.01 / (w * w)), 0.002);
    }
    vsh_solids_free(solids);
}

static void ambient_occlusion_of_a_sphere_is_its_share_of_the_cosine(void **state) {
    (void)state;
    const vsh_sdf_node ball = shape_at(VSH_SDF_SPHERE, 0.0, 2.0, 0.0);
    vsh_solids *solids = solids_of(&ball, 1, NULL);
    float ao = -1.0f;
    /* a cap of half angle 30° around the normal holds sin² of it */
    assert_int_equal(vsh_trace_ao(NULL, solids, 1, ORIGIN, UP, 0.0, 10.0, 8192, NULL, &ao, NULL), VSH_OK);
    NEAR(ao, 0.75, 0.003);
    /* rays of 1.2 meet the ball where 2 cos a - √(4 cos² a - 3) ≤ 1.2, that is cos a ≥ 4.44 / 4.8 */
    assert_int_equal(vsh_trace_ao(NULL, solids, 1, ORIGIN, UP, 0.0, 1.2, 8192, NULL, &ao, NULL), VSH_OK);
    NEAR(ao, 4.44 / 4.8 * 4.44 / 4.8, 0.003);
    assert_int_equal(vsh_trace_ao(NULL, solids, 1, ORIGIN, UP, 0.0, 0.9, 64, NULL, &ao, NULL), VSH_OK);
    NEAR(ao, 1.0, 0.0);
    vsh_solids_free(solids);
}

/* The seeds' scene as trees of one shape each. */
static vsh_solids *seeds(void) {
    vsh_sdf_node nodes[5] = {shape_at(VSH_SDF_PLANE, 0.0, 0.0, 0.0), shape_at(VSH_SDF_SPHERE, 0.0, 0.8, 0.0),
                             box_at(-1.2, 0.7, 0.5, 0.3, 0.3, 0.3), shape_at(VSH_SDF_TORUS, 1.2, 0.6, -0.3),
                             box_at(0.3, 1.0, 1.5, 0.05, 1.0, 0.05)};
    nodes[0].size[0] = nodes[0].size[2] = 3.0;
    nodes[0].size[1] = 0.5;
    nodes[1].radius = 0.5;
    nodes[2].rounding = 0.05;
    nodes[3].radius = 0.4;
    nodes[3].minor_radius = 0.08;
    vsh_sdf sdfs[5];
    for (size_t i = 0; i < 5; ++i) {
        sdfs[i] = (vsh_sdf){&nodes[i], 1};
    }
    vsh_solids *solids = NULL;
    assert_int_equal(vsh_solids_create(sdfs, NULL, 5, &solids, NULL), VSH_OK);
    return solids;
}

static void every_floor_texel_sees_what_rays_against_the_solids_say(void **state) {
    (void)state;
    enum { SIZE = 64, COUNT = SIZE * SIZE, RAYS = 128 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], values[COUNT], truth[COUNT];
    floor_texels(SIZE, positions, normals);
    vsh_solids *solids = seeds();
    vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    assert_int_equal(
        vsh_trace_shadow(NULL, solids, COUNT, positions, normals, 0.0, &light, RAYS, NULL, values, NULL),
        VSH_OK);
    assert_int_equal(truth_lights(truth_seeds(), COUNT, positions, NULL, truth_seeds_sun, truth_seeds_w,
                                  INFINITY, RAYS, truth),
                     0);
    int penumbra = 0, dark = 0;
    for (int i = 0; i < COUNT; ++i) {
        /* the spiral may be turned: a ray or two on the edge */
        NEAR((double)values[i], (double)truth[i], 0.05);
        NEAR((double)values[i], (double)truth[i], truth[i] == 0.0f || truth[i] == 1.0f ? 2.0 / RAYS : 0.05);
        penumbra += truth[i] > 0.02f && truth[i] < 0.98f;
        dark += truth[i] == 0.0f;
    }
    assert_in_range(penumbra, 200, COUNT);
    assert_in_range(dark, 100, COUNT);
    /* and a lamp among them, its rays ending at its near side */
    const double place[3] = {0.6, 2.0, 0.4};
    light = lamp(place, 0.3);
    for (int i = 0; i < COUNT; i += 7) {
        const double *p = positions + 3 * (size_t)i;
        const double to[3] = {place[0] - p[0], place[1] - p[1], place[2] - p[2]};
        const double far = sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
        const double w = tan(asin(0.3 / far));
        NEAR(seen(solids, p, NULL, &light, RAYS), truth_light(truth_seeds(), p, NULL, to, w, far - 0.3, RAYS),
             0.05);
    }
    vsh_solids_free(solids);
}

static void what_lies_beyond_a_lamp_does_not_hide_it(void **state) {
    (void)state;
    const vsh_sdf_node slab = box_at(0.0, 6.0, 0.0, 20.0, 1.0, 20.0);
    vsh_solids *solids = solids_of(&slab, 1, NULL);
    const double below[3] = {0.0, 4.0, 0.0}, within[3] = {0.0, 5.5, 0.0};
    const vsh_light under = lamp(below, 0.9), inside = lamp(within, 0.3);
    NEAR(seen(solids, ORIGIN, UP, &under, 256), 1.0, 0.0);
    NEAR(seen(solids, ORIGIN, UP, &inside, 256), 0.0, 0.0);
    NEAR(seen(solids, within, UP, &under, 256), 0.0, 0.0); /* from inside nothing is seen */
    vsh_solids_free(solids);
}

static void transforms_move_what_rays_meet(void **state) {
    (void)state;
    vsh_sdf_node nodes[3] = {box_at(0.3, 2.0, 0.1, 0.5, 0.2, 0.4), shape_at(VSH_SDF_TORUS, -0.5, 2.5, 0.3),
                             shape_at(VSH_SDF_SMOOTH_UNION, 0.0, 0.0, 0.0)};
    nodes[2].left = 0;
    nodes[2].right = 1;
    nodes[2].smoothing = 0.3;
    vsh_solids *plain = solids_of(nodes, 3, NULL);
    /* mirrored in x, turned by a right angle about y, four times as large, and far away */
    const double m[12] = {0.0, 0.0, 4.0, 1000.0, 0.0, 4.0, 0.0, -200.0, 4.0, 0.0, 0.0, 30.0};
    vsh_solids *moved = solids_of(nodes, 3, m);
    const double towards[3] = {0.2, 1.0, 0.1}, turned[3] = {0.1, 1.0, 0.2};
    const vsh_light here = sun(towards, 0.3), there = sun(turned, 0.3);
    int between_both = 0;
    for (int i = 0; i < 200; ++i) {
        const double p[3] = {-2.0 + 0.2 * (i % 20), 0.0, -1.0 + 0.2 * (i / 20)};
        const double q[3] = {4.0 * p[2] + 1000.0, 4.0 * p[1] - 200.0, 4.0 * p[0] + 30.0};
        const double value = seen(plain, p, UP, &here, 1024);
        NEAR(seen(moved, q, UP, &there, 1024), value, 0.01);
        NEAR(vsh_solids_distance(moved, q), 4.0 * vsh_solids_distance(plain, p), 1e-9);
        between_both += value > 0.02 && value < 0.98;
    }
    assert_in_range(between_both, 20, 200);
    vsh_solids_free(plain);
    vsh_solids_free(moved);
}

static void the_size_of_the_scene_does_not_show(void **state) {
    (void)state;
    vsh_sdf_node nodes[3] = {box_at(0.3, 2.0, 0.1, 0.5, 0.2, 0.4), shape_at(VSH_SDF_CONE, -0.5, 2.5, 0.3),
                             shape_at(VSH_SDF_UNION, 0.0, 0.25, 0.0)};
    nodes[2].left = 0;
    nodes[2].right = 1;
    nodes[2].rotation[1] = 0.5;
    float here[64], there[64];
    const double scales[] = {1.0, 0x1p-100, 0x1p-20, 0x1p20, 0x1p100}, towards[3] = {0.2, 1.0, 0.1};
    const vsh_light light = sun(towards, 0.4);
    for (size_t s = 0; s < sizeof scales / sizeof scales[0]; ++s) {
        const double k = scales[s], m[12] = {k, 0.0, 0.0, 0.0, 0.0, k, 0.0, 0.0, 0.0, 0.0, k, 0.0};
        vsh_solids *solids = solids_of(nodes, 3, m);
        int between_both = 0;
        for (int i = 0; i < 64; ++i) {
            const double p[3] = {k * (-1.5 + 0.4 * (i % 8)), 0.0, k * (-1.5 + 0.4 * (i / 8))};
            (s == 0 ? here : there)[i] = seen(solids, p, UP, &light, 256);
            between_both += here[i] > 0.0f && here[i] < 1.0f;
        }
        assert_in_range(between_both, 10, 64);
        assert_true(s == 0 || memcmp(here, there, sizeof here) == 0);
        vsh_solids_free(solids);
    }
}

static void a_ray_is_hidden_that_meets_either_solids_or_triangles(void **state) {
    (void)state;
    if (!vsh_triangles_available()) {
        skip();
    }
    /* a triangle plate over x > 0.1, a solid one over x < -0.1: a slit of the light is left */
    static const float corners[12] = {0.1f,   5.0f, -100.0f, 100.0f, 5.0f, -100.0f,
                                      100.0f, 5.0f, 100.0f,  0.1f,   5.0f, 100.0f};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh mesh = {.positions = corners, .indices = indices, .vertex_count = 4, .triangle_count = 2};
    const vsh_sdf_node sheet = box_at(-50.1, 5.0, 0.0, 50.0, 1e-6, 50.0);
    vsh_triangles *triangles = NULL;
    assert_int_equal(vsh_triangles_create(&mesh, 1, NULL, &triangles, NULL), VSH_OK);
    vsh_solids *solids = solids_of(&sheet, 1, NULL);
    const double half = 0.1, x = 0.1 / (5.0 * tan(half));
    const vsh_light light = sun(OVERHEAD, 2.0 * half);
    float both = -1.0f, one = -1.0f;
    assert_int_equal(vsh_trace_shadow(triangles, solids, 1, ORIGIN, UP, 0.0, &light, 8192, NULL, &both, NULL),
                     VSH_OK);
    assert_int_equal(vsh_trace_shadow(triangles, NULL, 1, ORIGIN, UP, 0.0, &light, 8192, NULL, &one, NULL),
                     VSH_OK);
    NEAR(one, truth_disc_share(x), 0.003);
    NEAR(both, 2.0 * truth_disc_share(x) - 1.0, 0.003);
    vsh_solids_free(solids);
    vsh_triangles_free(triangles);
}

static void threads_change_no_bit(void **state) {
    (void)state;
    enum { COUNT = 4096 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], first[COUNT], other[COUNT];
    floor_texels(64, positions, normals);
    vsh_solids *solids = seeds();
    for (int32_t threads = 1; threads <= 5; threads += 2) {
        vsh_run run = vsh_run_default();
        run.threads = threads;
        assert_int_equal(vsh_trace_ao(NULL, solids, COUNT, positions, normals, 0.0, 0.6, 16, &run,
                                      threads == 1 ? first : other, NULL),
                         VSH_OK);
        assert_true(threads == 1 || memcmp(first, other, sizeof first) == 0);
    }
    vsh_solids_free(solids);
}

static void no_solids_hide_nothing(void **state) {
    (void)state;
    vsh_solids *solids = NULL;
    assert_int_equal(vsh_solids_create(NULL, NULL, 0, &solids, NULL), VSH_OK);
    const vsh_light light = sun(OVERHEAD, 0.5);
    NEAR(seen(solids, ORIGIN, UP, &light, 64), 1.0, 0.0);
    assert_true(isinf(vsh_solids_distance(solids, ORIGIN)));
    const double nowhere[3] = {NAN, 0.0, 0.0};
    assert_true(isnan(vsh_solids_distance(solids, nowhere)));
    assert_true(isnan(seen(solids, nowhere, UP, &light, 4)));
    vsh_solids_free(solids);
    vsh_solids_free(NULL);
}

static void bad_input_is_refused(void **state) {
    (void)state;
    vsh_sdf_node ball = vsh_sdf_node_default();
    const vsh_sdf sdf = {&ball, 1};
    vsh_solids *solids = (vsh_solids *)&ball;
    vsh_error error;
    assert_int_equal(vsh_solids_create(NULL, NULL, 1, &solids, &error), VSH_ERROR_ARGUMENT);
    assert_null(solids);
    assert_int_equal(vsh_solids_create(&sdf, NULL, 1, NULL, &error), VSH_ERROR_ARGUMENT);
    const double uneven[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    assert_int_equal(vsh_solids_create(&sdf, uneven, 1, &solids, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "unevenly"));
    ball.radius = -1.0;
    assert_int_equal(vsh_solids_create(&sdf, NULL, 1, &solids, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "radius"));
    float value;
    const vsh_light light = vsh_light_default();
    assert_int_equal(vsh_trace_shadow(NULL, NULL, 1, ORIGIN, UP, 0.0, &light, 4, NULL, &value, &error),
                     VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "solids"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_edge_leaves_the_circular_segment),
        cmocka_unit_test(a_hole_in_a_slab_lets_its_share_of_the_disc_through),
        cmocka_unit_test(ambient_occlusion_of_a_sphere_is_its_share_of_the_cosine),
        cmocka_unit_test(every_floor_texel_sees_what_rays_against_the_solids_say),
        cmocka_unit_test(what_lies_beyond_a_lamp_does_not_hide_it),
        cmocka_unit_test(transforms_move_what_rays_meet),
        cmocka_unit_test(the_size_of_the_scene_does_not_show),
        cmocka_unit_test(a_ray_is_hidden_that_meets_either_solids_or_triangles),
        cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(no_solids_hide_nothing),
        cmocka_unit_test(bad_input_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
