/* Shadow values where the light, and where it stands, decide: without size, far away, inside a caster, around
 * a point, behind the horizon. */
#include "shading.h"

#include "previews.h"
#include "truth/directions.h"
#include "truth/metrics.h"

#include <stdio.h>
#include <stdlib.h>

static const float UP[3] = {0.0f, 1.0f, 0.0f};

static void a_light_without_size_is_hard_in_every_method(void **state) {
    (void)state;
    enum { COUNT = 64 * 64 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], hard[COUNT], soft[COUNT];
    floor_texels(64, positions, normals);
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const double over[3] = {1.0, 3.0, 1.0};
    const vsh_light lights[2] = {sun(truth_seeds_sun, 0.0), lamp(over, 0.0)};
    for (int l = 0; l < 2; ++l) {
        for (int with_normals = 0; with_normals < 2; ++with_normals) {
            const float *n = with_normals ? normals : NULL;
            shadows(field, &lights[l], VSH_SHADOW_HARD, COUNT, positions, n, hard);
            size_t dark = 0;
            for (size_t i = 0; i < COUNT; ++i) {
                assert_true(hard[i] == 0.0f || hard[i] == 1.0f);
                dark += hard[i] == 0.0f;
            }
            assert_true(dark > COUNT / 50 && dark < COUNT / 2);
            for (int32_t method = VSH_SHADOW_CLASSIC; method <= VSH_SHADOW_CONE; ++method) {
                shadows(field, &lights[l], method, COUNT, positions, n, soft);
                assert_memory_equal(hard, soft, sizeof hard);
            }
            /* and `hard` does not see a size */
            vsh_light sized = lights[l];
            sized.angle = 0.2;
            sized.radius = 0.3;
            shadows(field, &sized, VSH_SHADOW_HARD, COUNT, positions, n, soft);
            assert_memory_equal(hard, soft, sizeof hard);
        }
    }
    vsh_field_free(field);
}

static void a_far_sphere_light_is_a_directional_one(void **state) {
    (void)state;
    enum { COUNT = 64 * 64 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], far[COUNT], directional[COUNT];
    floor_texels(64, positions, normals);
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const double half = atan(truth_seeds_w), away = 1e6;
    const double length = sqrt(0.25 + 0.36 + 0.36);
    double place[3];
    for (int axis = 0; axis < 3; ++axis) {
        place[axis] = away * truth_seeds_sun[axis] / length;
    }
    const vsh_light s = sun(truth_seeds_sun, 2.0 * half), l = lamp(place, away * sin(half));
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        shadows(field, &s, method, COUNT, positions, normals, directional);
        shadows(field, &l, method, COUNT, positions, normals, far);
        for (size_t i = 0; i < COUNT; ++i) {
            assert_true(fabsf(far[i] - directional[i]) <= 1e-3f);
        }
    }
    vsh_field_free(field);
}

static void a_light_inside_a_caster_lights_nothing(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const double places[2][3] = {{0.0, 0.8, 0.0}, {-1.2, 0.7, 0.5}}; /* in the sphere, in the rounded box */
    uint64_t counter = 4;
    for (int place = 0; place < 2; ++place) {
        for (double radius = 0.0; radius < 0.25; radius += 0.08) {
            const vsh_light light = lamp(places[place], radius);
            for (int i = 0; i < 200; ++i) {
                const double p[3] = {between(&counter, -2.5, 2.5), 0.001, between(&counter, -2.5, 2.5)};
                for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
                    assert_true(shadow_at(field, &light, method, p, UP) == 0.0f);
                }
            }
        }
    }
    vsh_field_free(field);
}

static void a_point_inside_a_sphere_light_sees_all_of_it(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const double place[3] = {1.0, 1.2, 1.0};
    const vsh_light light = lamp(place, 0.5);
    const double points[3][3] = {{1.0, 1.2, 1.0}, {1.0, 1.0, 1.3}, {1.0, 1.2 - 0.499, 1.0}};
    for (int i = 0; i < 3; ++i) {
        for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
            assert_true(shadow_at(field, &light, method, points[i], NULL) == 1.0f);
        }
    }
    vsh_field_free(field);
}

static void the_horizon_cuts_the_light_like_a_straight_edge(void **state) {
    (void)state;
    const truth_solid plate = {TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&plate, 1}, 0.04, 0.0);
    const double ws[] = {0.01, 0.1, 0.5};
    /* in free space, where only the normal says so, and on the plate's middle */
    const double points[2][3] = {{0.0, 50.0, 0.0}, {0.01, 0.0, 0.02}};
    for (int i = 0; i < 3; ++i) {
        for (int place = 0; place < 2; ++place) {
            for (int k = -12; k <= 12; ++k) {
                const double elevation = atan(0.1 * k * ws[i]);
                double towards[3];
                direction_at(elevation, 0.3, towards);
                const vsh_light light = sun(towards, 2.0 * atan(ws[i]));
                const double v = (double)shadow_at(field, &light, VSH_SHADOW_CONE, points[place], UP);
                const double expected = truth_disc_share(0.1 * k);
                if (fabs(v - expected) > 1e-3) {
                    fail_msg("place %d, w %g, %g of the disc's radius over the horizon: %.6f, not %.6f",
                             place, ws[i], 0.1 * k, v, expected);
                }
                if (k == 0) {
                    assert_float_equal(v, 0.5, 1e-6);
                }
            }
        }
    }
    vsh_field_free(field);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_light_without_size_is_hard_in_every_method),
        cmocka_unit_test(a_far_sphere_light_is_a_directional_one),
        cmocka_unit_test(a_light_inside_a_caster_lights_nothing),
        cmocka_unit_test(a_point_inside_a_sphere_light_sees_all_of_it),
        cmocka_unit_test(the_horizon_cuts_the_light_like_a_straight_edge),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
