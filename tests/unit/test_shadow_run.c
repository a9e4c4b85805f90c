/* How shadows are computed: the same bits however they are run, work that is counted, bad input. */
#include "previews.h"
#include "shading.h"

#include <stdlib.h>

enum { SIDE = 64, COUNT = SIDE * SIDE, METHODS = 5 };

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static double positions[3 * COUNT];
static float normals[3 * COUNT];

/* Floor texels, points in the air and inside solids, with normals all around. */
static void fill_points(void) {
    uint64_t counter = 9;
    floor_texels(SIDE, positions, normals);
    for (size_t i = 0; i < COUNT; i += 3) {
        double n[3];
        random_direction(&counter, n);
        for (size_t axis = 0; axis < 3; ++axis) {
            positions[3 * i + axis] = axis == 1 ? between(&counter, -1.0, 3.0) : between(&counter, -4.0, 4.0);
            normals[3 * i + axis] = (float)n[axis];
        }
    }
}

static void neither_threads_nor_neighbours_show_in_the_bits(void **state) {
    (void)state;
    static float first[COUNT], other[COUNT];
    fill_points();
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const double place[3] = {1.0, 1.5, 1.0};
    const vsh_light lights[2] = {sun(truth_seeds_sun, 0.2), lamp(place, 0.2)};
    for (int l = 0; l < 2; ++l) {
        for (int32_t method = 0; method < METHODS; ++method) {
            vsh_shade_options options = preview_options();
            options.method = method;
            const vsh_points points = {COUNT, positions, normals, NULL};
            const int32_t threads[] = {1, 2, 5};
            vsh_shade_stats stats[3];
            for (int i = 0; i < 3; ++i) {
                vsh_run run = vsh_run_default();
                run.threads = threads[i];
                stats[i] = vsh_shade_stats_zero();
                assert_int_equal(vsh_shade_shadow(occluders_of(field), &points, &lights[l], &options, &run,
                                                  i == 0 ? first : other, NULL, &stats[i], NULL),
                                 VSH_OK);
                if (i > 0) {
                    assert_memory_equal(first, other, sizeof first);
                    assert_memory_equal(&stats[0], &stats[i], sizeof stats[0]);
                }
            }
            for (size_t i = 0; i < COUNT; i += 61) { /* one at a time */
                const float v = shadow_at(field, &lights[l], method, positions + 3 * i, normals + 3 * i);
                assert_int_equal(bits_of(v), bits_of(first[i]));
            }
        }
    }
    vsh_field_free(field);
}

static void a_scene_scaled_by_a_power_of_two_has_the_same_bits(void **state) {
    (void)state;
    static float visible[3][COUNT];
    static double scaled[3 * COUNT];
    fill_points();
    const double scales[3] = {1.0, 1024.0, 1.0 / 1024.0}, nowhere[3] = {0.0, 0.0, 0.0};
    vsh_field *fields[3];
    for (int s = 0; s < 3; ++s) {
        fields[s] = field_of_grid(grid_of_moved(truth_seeds(), 0.03125, scales[s], nowhere), scales[s] * 8.0);
    }
    for (int l = 0; l < 2; ++l) {
        for (int32_t method = 0; method < METHODS; ++method) {
            for (int s = 0; s < 3; ++s) {
                for (size_t i = 0; i < 3 * COUNT; ++i) {
                    scaled[i] = scales[s] * positions[i];
                }
                const double place[3] = {scales[s], 1.5 * scales[s], scales[s]};
                const vsh_light light = l == 0 ? sun(truth_seeds_sun, 0.2) : lamp(place, 0.25 * scales[s]);
                shadows(fields[s], &light, method, COUNT, scaled, normals, visible[s]);
                assert_memory_equal(visible[0], visible[s], sizeof visible[0]);
            }
        }
    }
    for (int s = 0; s < 3; ++s) {
        vsh_field_free(fields[s]);
    }
}

static void every_point_is_marched_skipped_certified_or_invalid(void **state) {
    (void)state;
    static float visible[COUNT];
    fill_points();
    positions[0] = (double)NAN;
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    for (int32_t method = 0; method < METHODS; ++method) {
        const vsh_shade_stats stats = shadows(field, &light, method, COUNT, positions, normals, visible);
        size_t zero = 0, nan = 0;
        for (size_t i = 0; i < COUNT; ++i) {
            zero += visible[i] == 0.0f;
            nan += isnan(visible[i]);
        }
        assert_int_equal(stats.invalid, 1);
        assert_int_equal(nan, 1);
        assert_true(stats.skipped > 0 && stats.skipped <= zero);
        assert_true(stats.marches > COUNT / 4);
        const uint64_t done = stats.marches + stats.skipped + stats.invalid;
        assert_true(done <= COUNT);
        /* what misses the casters' bounds is neither marched nor skipped */
        assert_true(COUNT - done < COUNT / 3);
        assert_true(stats.samples >= stats.marches);
        assert_int_equal(stats.unfinished, 0);
        assert_int_equal(stats.beyond_reach, 0);
        if (method == VSH_SHADOW_CONE) {
            assert_true(stats.certified > COUNT / 3 &&
                        stats.certified <= COUNT - stats.skipped - stats.invalid);
        }
    }
    /* calls add to what is there */
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_stats sum = vsh_shade_stats_zero();
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, NULL, NULL, visible, NULL, &sum, NULL),
        VSH_OK);
    const vsh_shade_stats once = sum;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, NULL, NULL, visible, NULL, &sum, NULL),
        VSH_OK);
    assert_int_equal(sum.marches, 2 * once.marches);
    assert_int_equal(sum.samples, 2 * once.samples);
    assert_int_equal(sum.certified, 2 * once.certified);
    vsh_field_free(field);
}

static void points_turned_away_are_0_and_skipped_not_marched(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const double p[3] = {0.0, 5.0, 0.0};
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const float away[3] = {0.5f, -0.6f, 0.6f};
    for (int32_t method = 0; method < METHODS; ++method) {
        float v = -1.0f;
        const vsh_shade_stats stats = shadows(field, &light, method, 1, p, away, &v);
        assert_true(v == 0.0f);
        assert_int_equal(stats.skipped, 1);
        assert_int_equal(stats.marches, 0);
        assert_int_equal(stats.invalid, 0);
    }
    vsh_field_free(field);
}

static void points_without_place_or_normal_are_nan_and_counted(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.1, 0.0);
    const double nan = (double)NAN, inf = (double)INFINITY;
    const double p[6][3] = {{nan, 0.0, 0.0}, {0.0, inf, 0.0}, {0.0, 0.0, -inf},
                            {0.0, 5.0, 0.0}, {0.0, 5.0, 0.0}, {0.0, 5.0, 0.0}};
    const float n[6][3] = {{0.0f, 1.0f, 0.0f}, {0.0f, 1.0f, 0.0f},       {0.0f, 1.0f, 0.0f},
                           {0.0f, 0.0f, 0.0f}, {0.0f, (float)NAN, 0.0f}, {(float)INFINITY, 0.0f, 0.0f}};
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    for (int32_t method = 0; method < METHODS; ++method) {
        float v[6];
        vsh_shade_stats stats = shadows(field, &light, method, 6, &p[0][0], &n[0][0], v);
        assert_int_equal(stats.invalid, 6);
        assert_int_equal(stats.marches, 0);
        for (int i = 0; i < 6; ++i) {
            assert_true(isnan(v[i]));
        }
        stats = shadows(field, &light, method, 6, &p[0][0], NULL, v);
        assert_int_equal(stats.invalid, 3);
        for (int i = 0; i < 6; ++i) {
            assert_int_equal(isnan(v[i]) != 0, i < 3);
        }
    }
    vsh_field_free(field);
}

static void running_out_of_steps_is_counted_and_stays_in_range(void **state) {
    (void)state;
    static float visible[COUNT];
    floor_texels(SIDE, positions, normals);
    vsh_field *field = field_of(truth_seeds(), 0.02, 0.0);
    const double low[3] = {-1.0, 0.02, -0.3}; /* along the floor, where steps are short */
    const vsh_light light = sun(low, 0.01);
    vsh_shade_options options = preview_options();
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_stats few = vsh_shade_stats_zero(), many = vsh_shade_stats_zero();
    options.max_steps = 16;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, visible, NULL, &few, NULL),
        VSH_OK);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(visible[i] >= 0.0f && visible[i] <= 1.0f);
    }
    options.max_steps = 65536;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, visible, NULL, &many, NULL),
        VSH_OK);
    print_message("of %d grazing rays, %d out of 16 steps\n", COUNT, (int)few.unfinished);
    assert_true(few.unfinished > 100);
    assert_true(few.samples <= 16 * few.marches);
    assert_int_equal(many.unfinished, 0);
    vsh_field_free(field);
}

static void cones_wider_than_the_reach_are_counted(void **state) {
    (void)state;
    static float visible[COUNT];
    floor_texels(SIDE, positions, normals);
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.2);
    const vsh_light wide = sun(truth_seeds_sun, RADIANS(60.0)), narrow = sun(truth_seeds_sun, RADIANS(0.5));
    vsh_shade_stats stats = shadows(field, &wide, VSH_SHADOW_CONE, COUNT, positions, normals, visible);
    assert_true(stats.beyond_reach > 0 && stats.beyond_reach <= stats.marches);
    stats = shadows(field, &narrow, VSH_SHADOW_CONE, COUNT, positions, normals, visible);
    assert_int_equal(stats.beyond_reach, 0);
    vsh_field_free(field);
}

static int32_t stop_at(void *user, const char *stage, double fraction) {
    assert_string_equal(stage, "shadow.sun");
    return fraction >= *(const double *)user;
}

static void options_lights_and_cancelling_have_their_codes(void **state) {
    (void)state;
    static float visible[COUNT];
    floor_texels(SIDE, positions, normals);
    vsh_field *field = field_of(truth_seeds(), 0.2, 1.0);
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_light light = sun(truth_seeds_sun, 0.2);
    vsh_error error = {VSH_OK, ""};
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_AUTO + 1;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, visible, NULL, NULL, &error),
        VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "method"));
    options = preview_options();
    options.max_steps = 15;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, visible, NULL, NULL, &error),
        VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "max_steps"));
    const double offsets[] = {-0.1, 17.0, (double)NAN};
    for (int i = 0; i < 3; ++i) {
        options = preview_options();
        options.start_offset = offsets[i];
        assert_int_equal(vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, visible, NULL,
                                          NULL, &error),
                         VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "start_offset"));
    }
    options = preview_options();
    options.struct_size = 3;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, visible, NULL, NULL, &error),
        VSH_ERROR_ARGUMENT);
    light.angle = -1.0;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, NULL, NULL, visible, NULL, NULL, &error),
        VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "angle"));

    light.angle = 0.2;
    const double stops[] = {0.0, 0.1, 0.5};
    for (int i = 0; i < 3; ++i) {
        double stop = stops[i];
        vsh_run run = vsh_run_default();
        run.progress = stop_at;
        run.user = &stop;
        assert_int_equal(
            vsh_shade_shadow(occluders_of(field), &points, &light, NULL, &run, visible, NULL, NULL, &error),
            VSH_ERROR_CANCELLED);
    }
    const vsh_points none = {0, NULL, NULL, NULL};
    assert_int_equal(vsh_shade_shadow(occluders_of(field), &none, &light, NULL, NULL, NULL, NULL, NULL, NULL),
                     VSH_OK);
    assert_true(shadow_at(field, &light, VSH_SHADOW_CONE, (const double[]){0.0, 9.0, 0.0}, UP) == 1.0f);
    vsh_field_free(field);
}

/* --- How far `cone` is off under lights of any width where one thick caster hides them: a box over the
 * points, the light straight above it, so that one straight edge of it crosses the light's disc. README has
 * the bounds. */

enum { POINTS = 241 };

/* Visible share of a disc light that is hidden by a half plane as far from its centre, in its radii. */
static double segment(double x) {
    x = fmin(1.0, fmax(-1.0, x));
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / PI;
}

/* The worst of the points that lie across the penumbra of a box from `low` to `low + thick` over them. */
static double worst(double low, double thick, double degrees) {
    const truth_solid box = {TRUTH_BOX, {-4.0, low + 0.5 * thick, 0.0}, {4.0, 0.5 * thick, 8.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&box, 1}, 0.1, 16.0);
    const double towards[3] = {0.0, 1.0, 0.0}, w = tan(0.5 * RADIANS(degrees));
    const vsh_light light = sun(towards, RADIANS(degrees));
    static double across[3 * POINTS];
    static float upward[3 * POINTS], visible[POINTS];
    for (size_t i = 0; i < POINTS; ++i) {
        const double t = 1.2 * (-1.0 + 2.0 * (double)i / (POINTS - 1));
        across[3 * i] = w * t * (t < 0.0 ? low : low + thick); /* its lower edge, or its upper one */
        upward[3 * i + 1] = 1.0f;
    }
    shadows(field, &light, VSH_SHADOW_CONE, POINTS, across, upward, visible);
    double off = 0.0;
    for (size_t i = 0; i < POINTS; ++i) {
        const double x = across[3 * i];
        off = fmax(off, fabs((double)visible[i] - segment(x / w / (x < 0.0 ? low : low + thick))));
    }
    vsh_field_free(field);
    return off;
}

static void one_thick_caster_is_right_under_narrow_lights_and_less_so_under_wide_ones(void **unused) {
    (void)unused;
    static const double boxes[][2] = {{1.0, 4.0}, {1.0, 2.0}, {0.5, 4.0}};
    static const struct {
        double degrees, most;
    } lights[] = {{1.0, 0.05}, {5.0, 0.05}, {10.0, 0.05}, {20.0, 0.07}, {60.0, 0.18}};
    for (size_t b = 0; b < sizeof boxes / sizeof boxes[0]; ++b) {
        for (size_t i = 0; i < sizeof lights / sizeof lights[0]; ++i) {
            const double off = worst(boxes[b][0], boxes[b][1], lights[i].degrees);
            if (!(off <= lights[i].most)) {
                fail_msg("box %g thick, %g above, light of %g°: %.3f off, said %.3f", boxes[b][1],
                         boxes[b][0], lights[i].degrees, off, lights[i].most);
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(neither_threads_nor_neighbours_show_in_the_bits),
        cmocka_unit_test(a_scene_scaled_by_a_power_of_two_has_the_same_bits),
        cmocka_unit_test(every_point_is_marched_skipped_certified_or_invalid),
        cmocka_unit_test(points_turned_away_are_0_and_skipped_not_marched),
        cmocka_unit_test(points_without_place_or_normal_are_nan_and_counted),
        cmocka_unit_test(running_out_of_steps_is_counted_and_stays_in_range),
        cmocka_unit_test(cones_wider_than_the_reach_are_counted),
        cmocka_unit_test(options_lights_and_cancelling_have_their_codes),
        cmocka_unit_test(one_thick_caster_is_right_under_narrow_lights_and_less_so_under_wide_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
