/* Rays against triangles: closed forms, the same scene elsewhere and in another size, bad input. */
#include "shading.h"

#include "trace/embree.h"
#include "truth/directions.h"

#include <pthread.h>
#include <stdlib.h>
#include <vdbshade/trace.h>

#define NEAR(value, expected, tolerance)                                                                     \
    do {                                                                                                     \
        const double value_ = (value), expected_ = (expected);                                               \
        if (!(fabs(value_ - expected_) <= (tolerance))) {                                                    \
            fail_msg("%s: %.9g is not within %g of %.9g", #value, value_, (double)(tolerance), expected_);   \
        }                                                                                                    \
    } while (0)

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double ORIGIN[3] = {0.0, 0.0, 0.0};

static vsh_triangles *triangles_of(const vsh_mesh *meshes, size_t count) {
    vsh_triangles *triangles = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_triangles_create(meshes, count, NULL, &triangles, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return triangles;
}

static float seen(const vsh_triangles *triangles, const double *position, const float *normal,
                  const vsh_light *light, int32_t rays) {
    float value = -1.0f;
    assert_int_equal(
        vsh_trace_shadow(triangles, NULL, 1, position, normal, 0.0, light, rays, NULL, &value, NULL), VSH_OK);
    return value;
}

/* A plate of x from `edge` to 1000, `height` above the origin. */
static vsh_mesh plate(float edge, float height, float positions[12]) {
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const float made[12] = {edge,    height, -1000.0f, 1000.0f, height, -1000.0f,
                            1000.0f, height, 1000.0f,  edge,    height, 1000.0f};
    memcpy(positions, made, sizeof made);
    return (vsh_mesh){.positions = positions, .indices = indices, .vertex_count = 4, .triangle_count = 2};
}

enum { RINGS = 128, SECTORS = 256, BALL_TRIANGLES = 2 * RINGS * SECTORS };

/* A ball of latitudes and longitudes around `centre`. */
static vsh_mesh ball(const double centre[3], double radius) {
    static float positions[3 * (RINGS + 1) * SECTORS];
    static uint32_t indices[3 * BALL_TRIANGLES];
    for (size_t ring = 0; ring <= RINGS; ++ring) {
        for (size_t sector = 0; sector < SECTORS; ++sector) {
            double d[3];
            direction_at(PI * ((double)ring / RINGS - 0.5), 2.0 * PI * (double)sector / SECTORS, d);
            for (size_t axis = 0; axis < 3; ++axis) {
                positions[3 * (ring * SECTORS + sector) + axis] = (float)(centre[axis] + radius * d[axis]);
            }
        }
    }
    size_t at = 0;
    for (uint32_t ring = 0; ring < RINGS; ++ring) {
        for (uint32_t sector = 0; sector < SECTORS; ++sector) {
            const uint32_t a = ring * SECTORS + sector, b = ring * SECTORS + (sector + 1) % SECTORS;
            const uint32_t corners[6] = {a, b, a + SECTORS, b, b + SECTORS, a + SECTORS};
            memcpy(indices + at, corners, sizeof corners);
            at += 6;
        }
    }
    return (vsh_mesh){.positions = positions,
                      .indices = indices,
                      .vertex_count = (RINGS + 1) * SECTORS,
                      .triangle_count = BALL_TRIANGLES};
}

static void a_straight_edge_leaves_the_circular_segment(void **state) {
    (void)state;
    const double x[] = {-1.01, -0.7, -0.3, 0.0, 0.25, 0.8, 1.01};
    for (size_t i = 0; i < sizeof x / sizeof x[0]; ++i) {
        const double half = 0.2;
        float positions[12];
        const vsh_mesh mesh = plate((float)(x[i] * tan(half) * 5.0), 5.0f, positions);
        vsh_triangles *triangles = triangles_of(&mesh, 1);
        const double overhead[3] = {0.0, 1.0, 0.0}, place[3] = {0.0, 20.0, 0.0};
        const vsh_light lights[2] = {sun(overhead, 2.0 * half), lamp(place, 20.0 * sin(half))};
        for (int l = 0; l < 2; ++l) {
            NEAR(seen(triangles, ORIGIN, UP, &lights[l], 8192), truth_disc_share(x[i]), 0.003);
        }
        vsh_light spot = lights[1];
        spot.type = VSH_LIGHT_SPOT;
        spot.axis[0] = 1.0; /* where it shines to does not matter */
        NEAR(seen(triangles, ORIGIN, UP, &spot, 8192), truth_disc_share(x[i]), 0.003);
        vsh_triangles_free(triangles);
    }
}

static void the_receivers_own_horizon_is_an_edge(void **state) {
    (void)state;
    vsh_triangles *triangles = triangles_of(NULL, 0);
    const double low[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(low, 0.5);
    NEAR(seen(triangles, ORIGIN, UP, &light, 4096), 0.5, 0.002);
    NEAR(seen(triangles, ORIGIN, NULL, &light, 4096), 1.0, 0.0);
    vsh_triangles_free(triangles);
}

static void a_sphere_hides_what_rays_against_the_solid_say(void **state) {
    (void)state;
    const double centre[3] = {0.3, 3.0, 0.1}, towards[3] = {0.2, 1.0, 0.1};
    const vsh_mesh mesh = ball(centre, 1.0);
    const truth_solid solid = {TRUTH_SPHERE, {0.3, 3.0, 0.1}, {0.0, 0.0, 0.0}, 1.0, 0.0};
    const vsh_light light = sun(towards, 0.4);
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    int penumbra = 0;
    for (int i = 0; i < 400; ++i) {
        const double point[3] = {-3.0 + 0.3 * (i % 20), 0.0, -3.0 + 0.3 * (i / 20)};
        const double up[3] = {0.0, 1.0, 0.0};
        const double truth =
            truth_light((truth_scene){&solid, 1}, point, up, towards, tan(0.2), INFINITY, 1024);
        NEAR(seen(triangles, point, UP, &light, 1024), truth, 0.01);
        penumbra += truth > 0.02 && truth < 0.98;
    }
    assert_true(penumbra > 30);
    vsh_triangles_free(triangles);
}

static void ambient_occlusion_of_a_sphere_is_its_share_of_the_cosine(void **state) {
    (void)state;
    const double centre[3] = {0.0, 2.0, 0.0};
    const vsh_mesh mesh = ball(centre, 1.0);
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    float ao = -1.0f;
    /* a cap of half angle 30° around the normal holds sin² of it */
    assert_int_equal(vsh_trace_ao(triangles, NULL, 1, ORIGIN, UP, 0.0, 10.0, 8192, NULL, &ao, NULL), VSH_OK);
    NEAR(ao, 0.75, 0.003);
    /* and nothing is as near as 0.9 */
    assert_int_equal(vsh_trace_ao(triangles, NULL, 1, ORIGIN, UP, 0.0, 0.9, 1024, NULL, &ao, NULL), VSH_OK);
    NEAR(ao, 1.0, 0.0);
    vsh_triangles_free(triangles);
}

static void rays_stop_at_the_light_and_both_sides_block(void **state) {
    (void)state;
    float positions[12];
    const vsh_mesh mesh = plate(-1000.0f, 5.0f, positions);
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    const double below[3] = {0.0, 4.0, 0.0}, above[3] = {0.0, 7.0, 0.0}, under[3] = {0.0, 10.0, 0.0};
    const vsh_light near = lamp(below, 0.5), far = lamp(above, 0.5);
    const float down[3] = {0.0f, -1.0f, 0.0f};
    NEAR(seen(triangles, ORIGIN, UP, &near, 64), 1.0, 0.0);
    NEAR(seen(triangles, ORIGIN, UP, &far, 64), 0.0, 0.0);
    NEAR(seen(triangles, under, down, &near, 64), 0.0, 0.0);
    NEAR(seen(triangles, below, UP, &near, 64), 1.0, 0.0); /* within the light */
    vsh_triangles_free(triangles);
}

/* The ball's scene, moved and scaled; values of a row of points under it. */
static void scene_values(double scale, double shift, float values[40]) {
    const double centre[3] = {0.25, 3.0, 0.125}, towards[3] = {0.25, 1.0, 0.125};
    const double transform[12] = {scale, 0.0, 0.0, shift, 0.0, scale, 0.0, shift, 0.0, 0.0, scale, shift};
    vsh_mesh mesh = ball(centre, 1.0);
    mesh.transform = transform;
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    const vsh_light light = sun(towards, 0.4);
    for (int i = 0; i < 40; ++i) {
        const double point[3] = {scale * (-2.5 + 0.125 * i) + shift, shift, shift};
        values[i] = seen(triangles, point, UP, &light, 256);
    }
    vsh_triangles_free(triangles);
}

static void neither_place_nor_size_of_the_scene_shows(void **state) {
    (void)state;
    float here[40], other[40];
    scene_values(1.0, 0.0, here);
    const double scales[] = {0x1p-100, 0x1p-20, 0x1p20, 0x1p100};
    for (size_t s = 0; s < sizeof scales / sizeof scales[0]; ++s) {
        scene_values(scales[s], 0.0, other);
        assert_memory_equal(here, other, sizeof here);
    }
    scene_values(1.0, 0x1p24, other); /* 16.7 million units away */
    for (int i = 0; i < 40; ++i) {
        NEAR(other[i], here[i], 0.01);
    }
}

static void points_far_from_the_casters_keep_their_precision(void **state) {
    (void)state;
    const double centre[3] = {0.0, 0.0, 0.0}, up[3] = {0.0, 1.0, 0.0};
    const vsh_mesh mesh = ball(centre, 1.0);
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    const vsh_light hard = sun(up, 0.0);
    const double inside[3] = {0.99, -1e8, 0.0}, outside[3] = {1.01, -1e8, 0.0}, beyond[3] = {0.0, 1e8, 0.0};
    NEAR(seen(triangles, inside, UP, &hard, 1), 0.0, 0.0);
    NEAR(seen(triangles, outside, UP, &hard, 1), 1.0, 0.0);
    NEAR(seen(triangles, beyond, UP, &hard, 1), 1.0, 0.0);
    vsh_triangles_free(triangles);
}

/* A box of half side 1, scaled, seen from `distance` half sides away: straight below it, beside that, and
 * from a slant; also from where its own shadow is thrown away from. */
static void see_from_afar(double scale, double distance) {
    static const uint32_t indices[36] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                         2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    float corners[24];
    for (int i = 0; i < 24; ++i) {
        corners[i] = (i / 3) >> (i % 3) & 1 ? 1.0f : -1.0f;
    }
    const double transform[12] = {scale, 0.0, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, 0.0, scale, 0.0};
    const vsh_mesh mesh = {.positions = corners,
                           .indices = indices,
                           .vertex_count = 8,
                           .triangle_count = 12,
                           .transform = transform};
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    const double far = scale * distance, overhead[3] = {0.0, 1.0, 0.0}, slanted[3] = {0.6, 0.48, 0.64};
    const double below[3] = {0.25 * scale, -far, 0.25 * scale}, above[3] = {0.25 * scale, far, 0.0};
    const double beside[3] = {far, -far, 0.25 * scale}, everywhere[3] = {-far, -far, far};
    const vsh_light hard = sun(overhead, 0.0), soft = sun(slanted, 0.1), near = lamp(ORIGIN, 0.5 * scale);
    const vsh_light behind = lamp(above, 0.0);
    NEAR(seen(triangles, below, UP, &hard, 1), 0.0, 0.0);
    NEAR(seen(triangles, above, UP, &hard, 1), 1.0, 0.0);
    NEAR(seen(triangles, beside, UP, &hard, 1), 1.0, 0.0);
    NEAR(seen(triangles, everywhere, UP, &hard, 1), 1.0, 0.0);
    NEAR(seen(triangles, below, NULL, &soft, 64), 1.0, 0.0);
    NEAR(seen(triangles, everywhere, NULL, &soft, 64), 1.0, 0.0);
    NEAR(seen(triangles, below, UP, &behind, 1), 0.0, 0.0);
    if (distance < 1e6) { /* beyond, doubles do not tell which ray meets it */
        NEAR(seen(triangles, below, NULL, &near, 64), 0.0, 0.0);
        NEAR(seen(triangles, everywhere, NULL, &near, 64), 0.0, 0.0);
    } else {
        assert_in_range(64.0 * (double)seen(triangles, everywhere, NULL, &near, 64), 0, 64);
    }
    const double *from[] = {below, above, beside, everywhere};
    for (int i = 0; i < 4; ++i) {
        float ao = -1.0f;
        assert_int_equal(vsh_trace_ao(triangles, NULL, 1, from[i], UP, 0.0, 2.0 * far, 64, NULL, &ao, NULL),
                         VSH_OK);
        NEAR(ao, 1.0, distance < 1e3 ? 0.25 : 0.0);
    }
    vsh_triangles_free(triangles);
}

/* Embree itself ends the process at a coordinate beyond 1.8e18 of its own. */
static void no_distance_is_too_far_for_rays(void **state) {
    (void)state;
    for (double scale = 1e-30; scale < 1e31; scale *= 1e5) {
        for (double distance = 10.0; distance < 1e61; distance *= distance < 1e5 ? 10.0 : 1e3) {
            see_from_afar(scale, distance);
        }
        see_from_afar(scale, 1.7e18);
        see_from_afar(scale, 1e19);
        see_from_afar(scale, 1e250);
    }
}

/* Who called back, and in which environment. */
typedef struct witness {
    pthread_t thread;
    size_t calls, others;
} witness;

static int32_t note_thread(void *user, const char *stage, double fraction) {
    witness *w = user;
    (void)stage;
    (void)fraction;
    ++w->calls;
    w->others += !pthread_equal(w->thread, pthread_self());
    return 0;
}

/* A tree is made by many threads, or by the caller's alone. */
static void trees_are_made_by_the_threads_that_were_given(void **state) {
    (void)state;
    const double centre[3] = {0.0, 0.0, 0.0};
    const vsh_mesh mesh = ball(centre, 1.0);
    for (int i = 0; i < 5; ++i) {
        witness w = {pthread_self(), 0, 0};
        vsh_run run = vsh_run_default();
        run.threads = 1;
        run.progress = note_thread;
        run.user = &w;
        vsh_triangles *triangles = NULL;
        assert_int_equal(vsh_triangles_create(&mesh, 1, &run, &triangles, NULL), VSH_OK);
        vsh_triangles_free(triangles);
        assert_true(w.calls > 2); /* from within the making too */
        assert_int_equal(w.others, 0);
    }
}

static void threads_and_packets_change_no_bit(void **state) {
    (void)state;
    enum { COUNT = 4096 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], first[COUNT], other[COUNT];
    floor_texels(64, positions, normals);
    const double centre[3] = {0.3, 1.2, 0.1}, place[3] = {0.0, 4.0, 0.0};
    const vsh_mesh mesh = ball(centre, 1.0);
    vsh_triangles *triangles = triangles_of(&mesh, 1);
    const vsh_light light = lamp(place, 0.7);
    for (int32_t threads = 1; threads <= 5; threads += 2) {
        vsh_run run = vsh_run_default();
        run.threads = threads;
        float *values = threads == 1 ? first : other;
        assert_int_equal(vsh_trace_shadow(triangles, NULL, COUNT, positions, normals, 0.001, &light, 13, &run,
                                          values, NULL),
                         VSH_OK);
        assert_true(threads == 1 || memcmp(first, other, sizeof first) == 0);
    }
    vshi_segment_ray rays[100];
    bool together[100], alone;
    uint64_t counter = 5;
    for (int i = 0; i < 100; ++i) {
        rays[i].far = 10.0;
        random_direction(&counter, rays[i].direction);
        memset(rays[i].origin, 0, sizeof rays[i].origin);
    }
    vshi_triangles_blocked(triangles, rays, 100, together);
    int hits = 0;
    for (int i = 0; i < 100; ++i) {
        vshi_triangles_blocked(triangles, &rays[i], 1, &alone);
        assert_int_equal(alone, together[i]);
        hits += alone;
    }
    assert_in_range(hits, 10, 90);
    vsh_triangles_free(triangles);
}

static void points_that_are_no_points_are_nan(void **state) {
    (void)state;
    vsh_triangles *triangles = triangles_of(NULL, 0);
    const double nowhere[3] = {NAN, 0.0, 0.0};
    const float none[3] = {0.0f, 0.0f, 0.0f};
    const vsh_light light = vsh_light_default();
    assert_true(isnan(seen(triangles, nowhere, UP, &light, 4)));
    assert_true(isnan(seen(triangles, ORIGIN, none, &light, 4)));
    vsh_triangles_free(triangles);
}

static int32_t cancel(void *user, const char *stage, double fraction) {
    (void)stage, (void)fraction;
    return ++*(int *)user > 1;
}

static void bad_input_is_refused(void **state) {
    (void)state;
    const double centre[3] = {0.0, 0.0, 0.0};
    vsh_mesh mesh = ball(centre, 1.0);
    vsh_triangles *triangles = (vsh_triangles *)&mesh;
    vsh_error error;
    assert_int_equal(vsh_triangles_create(NULL, 1, NULL, &triangles, &error), VSH_ERROR_ARGUMENT);
    assert_null(triangles);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1 << 20;
    assert_int_equal(vsh_triangles_create(&mesh, 1, &run, &triangles, &error), VSH_ERROR_LIMIT);
    int calls = 0;
    run = vsh_run_default();
    run.progress = cancel;
    run.user = &calls;
    assert_int_equal(vsh_triangles_create(&mesh, 1, &run, &triangles, &error), VSH_ERROR_CANCELLED);
    uint32_t wrong[3] = {0, 1, 99};
    float corners[9] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    const vsh_mesh bad = {.positions = corners, .indices = wrong, .vertex_count = 3, .triangle_count = 1};
    assert_int_equal(vsh_triangles_create(&bad, 1, NULL, &triangles, &error), VSH_ERROR_INPUT);
    assert_null(triangles);

    triangles = triangles_of(&mesh, 1);
    float value = 0.0f;
    vsh_light light = vsh_light_default();
    const struct {
        double lift;
        int32_t rays;
        double distance;
    } cases[] = {{-1.0, 4, 1.0}, {NAN, 4, 1.0}, {0.0, 0, 1.0}, {0.0, 65537, 1.0}, {0.0, 4, 0.0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        assert_int_equal(vsh_trace_ao(triangles, NULL, 1, ORIGIN, UP, cases[i].lift, cases[i].distance,
                                      cases[i].rays, NULL, &value, &error),
                         VSH_ERROR_ARGUMENT);
    }
    assert_int_equal(vsh_trace_ao(triangles, NULL, 1, ORIGIN, NULL, 0.0, 1.0, 4, NULL, &value, &error),
                     VSH_ERROR_ARGUMENT);
    light.angle = -1.0;
    assert_int_equal(vsh_trace_shadow(triangles, NULL, 1, ORIGIN, UP, 0.0, &light, 4, NULL, &value, &error),
                     VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_trace_shadow(NULL, NULL, 1, ORIGIN, UP, 0.0, &light, 4, NULL, &value, &error),
                     VSH_ERROR_ARGUMENT);
    vsh_triangles_free(triangles);
}

static void without_embree_triangles_are_unsupported(void **state) {
    (void)state;
    vsh_triangles *triangles = NULL;
    vsh_error error;
    assert_int_equal(vsh_triangles_create(NULL, 0, NULL, &triangles, &error), VSH_ERROR_UNSUPPORTED);
    assert_null(triangles);
    assert_non_null(strstr(error.message, "Embree"));
}

int main(void) {
    const struct CMUnitTest without[] = {cmocka_unit_test(without_embree_triangles_are_unsupported)};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_edge_leaves_the_circular_segment),
        cmocka_unit_test(the_receivers_own_horizon_is_an_edge),
        cmocka_unit_test(a_sphere_hides_what_rays_against_the_solid_say),
        cmocka_unit_test(ambient_occlusion_of_a_sphere_is_its_share_of_the_cosine),
        cmocka_unit_test(rays_stop_at_the_light_and_both_sides_block),
        cmocka_unit_test(neither_place_nor_size_of_the_scene_shows),
        cmocka_unit_test(points_far_from_the_casters_keep_their_precision),
        cmocka_unit_test(no_distance_is_too_far_for_rays),
        cmocka_unit_test(trees_are_made_by_the_threads_that_were_given),
        cmocka_unit_test(threads_and_packets_change_no_bit),
        cmocka_unit_test(points_that_are_no_points_are_nan),
        cmocka_unit_test(bad_input_is_refused),
    };
    return vsh_triangles_available() ? cmocka_run_group_tests(tests, NULL, NULL)
                                     : cmocka_run_group_tests(without, NULL, NULL);
}
