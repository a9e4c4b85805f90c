/* Ambient occlusion against closed forms and ray-traced truth. */
#include "previews.h"
#include "shading.h"
#include "testing.h"

static const float UP[3] = {0.0f, 1.0f, 0.0f};

static vsh_shade_stats ao_of(const vsh_field *field, int32_t method, int32_t cones, double distance,
                             size_t count, const double *positions, const float *normals, float *ao) {
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    options.ao_cones = cones;
    options.ao_distance = distance;
    const vsh_points points = {count, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_ao(occluders_of(field), &points, &options, NULL, ao, NULL, NULL, &stats, &failure));
    return stats;
}

static float ao_at(const vsh_field *field, int32_t method, int32_t cones, double distance,
                   const double position[3], const float normal[3]) {
    float ao = -1.0f;
    ao_of(field, method, cones, distance, 1, position, normal, &ao);
    return ao;
}

TEST(an_open_plate_is_exactly_1) {
    const truth_solid plate = {TRUTH_BOX, {0.0, -0.517, 0.0}, {4.0, 0.517, 4.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&plate, 1}, 0.04, 0.0);
    uint64_t counter = 1;
    for (double distance = 0.1; distance < 30.0; distance *= 3.0) {
        for (int sample = 0; sample < 50; ++sample) {
            const double p[3] = {between(&counter, -4.0, 4.0), sample % 2 ? 0.0 : 1e-3,
                                 between(&counter, -4.0, 4.0)};
            for (int32_t cones = 1; cones <= 64; cones += cones < 16 ? 1 : 16) {
                const float ao = ao_at(field, VSH_AO_CONES, cones, distance, p, UP);
                if (ao != 1.0f) {
                    fail_msg("%d cones, distance %g, (%g, %g, %g): %.9g", cones, distance, p[0], p[1], p[2],
                             (double)ao);
                }
            }
            const float ao = ao_at(field, VSH_AO_TAPS, 1, distance, p, UP);
            if (ao != 1.0f) {
                fail_msg("taps, distance %g, (%g, %g, %g): %.9g", distance, p[0], p[1], p[2], (double)ao);
            }
        }
    }
    vsh_field_free(field);
}

TEST(a_wall_hides_half_of_the_sky_from_its_foot) {
    const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0},
                                  {TRUTH_BOX, {-1.0, 1.0, 0.0}, {1.0, 2.0, 3.0}, 0.0, 0.0}};
    vsh_field *field = field_of((truth_scene){solids, 2}, 0.02, 0.0);
    for (double away = 0.01; away < 0.05; away += 0.01) {
        for (int32_t cones = 8; cones <= 64; cones *= 2) {
            const double p[3] = {away, 0.001, 0.1};
            const double ao = (double)ao_at(field, VSH_AO_CONES, cones, 1.0, p, UP);
            print_message("%g from the wall, %d cones: %.3f\n", away, cones, ao);
            assert_true(fabs(ao - 0.5) < 0.06);
        }
    }
    vsh_field_free(field);
}

/* Mean and largest error over points around a sphere that rests on a plate, or hovers over it. */
TEST(under_a_sphere_ao_is_near_the_truth) {
    const double heights[] = {0.5, 0.8, 1.2};
    for (int i = 0; i < 3; ++i) {
        const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.25, 0.0}, {3.0, 0.25, 3.0}, 0.0, 0.0},
                                      {TRUTH_SPHERE, {0.0, heights[i], 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0}};
        const truth_scene scene = {solids, 2};
        vsh_field *field = field_of(scene, 0.02, 0.0);
        const double normal[3] = {0.0, 1.0, 0.0};
        double worst = 0.0, bias = 0.0, worst_fine = 0.0;
        int count = 0;
        for (double x = 0.18; x < 2.0; x += 0.06) {
            for (double distance = 0.5; distance < 3.0; distance *= 2.0) {
                const double p[3] = {x * 0.8, 0.001, x * 0.6};
                const double truth = truth_ao(scene, p, normal, distance, 4096);
                const double error = (double)ao_at(field, VSH_AO_CONES, 16, distance, p, UP) - truth;
                worst = fmax(worst, fabs(error));
                worst_fine =
                    fmax(worst_fine, fabs((double)ao_at(field, VSH_AO_CONES, 64, distance, p, UP) - truth));
                bias += error;
                ++count;
            }
        }
        /* nearer to the foot of the resting sphere the cleft is lower than a voxel */
        print_message("sphere at %g: 16 cones worst %.4f, bias %+.4f; 64 cones worst %.4f\n", heights[i],
                      worst, bias / count, worst_fine);
        assert_true(worst < 0.06);
        assert_true(worst_fine < 0.06);
        vsh_field_free(field);
    }
}

/* A cone's ball at its end reaches farther than its centre by the sine of its half angle; the taps ask for
 * twice the distance along the normal. */
TEST(what_is_beyond_the_distance_hides_nothing) {
    const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.25, 0.0}, {3.0, 0.25, 3.0}, 0.0, 0.0},
                                  {TRUTH_BOX, {0.0, 1.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0}};
    vsh_field *field = field_of((truth_scene){solids, 2}, 0.04, 0.0); /* a ceiling, 1 over the floor */
    const double p[3] = {0.1, 0.0, 0.2};
    for (int32_t cones = 1; cones <= 64; cones *= 2) {
        const double sine = fmin(sqrt(0.5), sqrt(1.0 - (1.0 - 1.0 / cones) * (1.0 - 1.0 / cones)));
        assert_true(ao_at(field, VSH_AO_CONES, cones, 0.95 / (1.0 + sine), p, UP) == 1.0f);
        assert_true(ao_at(field, VSH_AO_CONES, cones, 3.0, p, UP) < 0.5f);
    }
    assert_true(ao_at(field, VSH_AO_TAPS, 1, 0.4, p, UP) == 1.0f);
    assert_true(ao_at(field, VSH_AO_TAPS, 1, 1.0, p, UP) < 1.0f);
    vsh_field_free(field);
}

TEST(a_closed_cavity_is_dark) {
    vsh_field *field = hollow_box(0.04, 2.0);
    uint64_t counter = 2;
    float brightest[2] = {0.0f, 0.0f};
    for (int i = 0; i < 200; ++i) {
        const double p[3] = {between(&counter, -0.95, 0.95), -0.999, between(&counter, -0.95, 0.95)};
        for (int fine = 0; fine < 2; ++fine) {
            brightest[fine] = fmaxf(brightest[fine], ao_at(field, VSH_AO_CONES, fine ? 64 : 16, 10.0, p, UP));
        }
    }
    print_message("brightest in the cavity: 16 cones %.4f, 64 cones %.4f\n", (double)brightest[0],
                  (double)brightest[1]);
    assert_true(brightest[0] < 0.05f);
    assert_true(brightest[1] < 0.01f);
    vsh_field_free(field);
}

/* No cone finds a wall deep that is thinner than it is wide, but none finds it open either. */
TEST(a_room_of_thin_walls_is_dark) {
    const double walls[] = {0.1, 0.2, 0.5};
    const double bounds[3][2] = {{0.12, 0.03}, {0.02, 0.001}, {0.001, 0.001}};
    for (int w = 0; w < 3; ++w) {
        vsh_field *field = hollow_box(0.04, walls[w]);
        for (int fine = 0; fine < 2; ++fine) {
            uint64_t counter = 2;
            double mean = 0.0;
            for (int i = 0; i < 100; ++i) {
                const double p[3] = {between(&counter, -0.95, 0.95), -0.999, between(&counter, -0.95, 0.95)};
                mean += 0.01 * (double)ao_at(field, VSH_AO_CONES, fine ? 64 : 16, 10.0, p, UP);
            }
            print_message("walls of %g, %d cones: %.4f\n", walls[w], fine ? 64 : 16, mean);
            assert_true(mean < bounds[w][fine]);
        }
        vsh_field_free(field);
    }
}

/* None of these scenes took part in the fit of the cones' table. */
TEST(on_the_seeds_floor_cones_are_near_the_truth) {
    enum { COUNT = 1500 };
    const double normal[3] = {0.0, 1.0, 0.0}, voxel = 0.02;
    const int32_t cones[] = {4, 8, 16, 64};
    const double bounds[][2] = {{0.042, 0.011}, {0.027, 0.008}, {0.018, 0.005}, {0.007, 0.003}};
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], truth[COUNT], ao[COUNT];
    uint64_t counter = 11;
    for (size_t i = 0; i < COUNT;) {
        const double at[3] = {between(&counter, -2.4, 2.4), 0.001, between(&counter, -2.4, 2.4)};
        const double above[3] = {at[0], voxel, at[2]};
        if (truth_distance(truth_seeds(), above) < 0.9 * voxel) {
            continue;
        }
        memcpy(positions + 3 * i, at, sizeof at);
        memcpy(normals + 3 * i, UP, sizeof UP);
        truth[i++] = (float)truth_ao(truth_seeds(), at, normal, 1.0, 2048);
    }
    vsh_field *field = field_of(truth_seeds(), voxel, 0.0);
    for (int n = 0; n < 4; ++n) {
        double squares = 0.0, bias = 0.0;
        ao_of(field, VSH_AO_CONES, cones[n], 1.0, COUNT, positions, normals, ao);
        for (size_t i = 0; i < COUNT; ++i) {
            const double error = (double)ao[i] - (double)truth[i];
            squares += error * error / COUNT;
            bias += error / COUNT;
        }
        print_message("%d cones: RMSE %.4f, bias %+.4f\n", cones[n], sqrt(squares), bias);
        assert_true(sqrt(squares) < bounds[n][0] && fabs(bias) < bounds[n][1]);
    }
    vsh_field_free(field);
}

TEST(farther_distances_hide_more) {
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    uint64_t counter = 3;
    float rise = 0.0f;
    for (int i = 0; i < 200; ++i) {
        const double p[3] = {between(&counter, -2.5, 2.5), 0.001, between(&counter, -2.5, 2.5)};
        float last = 1.0f;
        for (double distance = 0.1; distance < 10.0; distance *= 1.3) {
            const float ao = ao_at(field, VSH_AO_CONES, 16, distance, p, UP);
            rise = fmaxf(rise, ao - last);
            last = ao;
        }
    }
    print_message("AO rises by %.5f at most\n", (double)rise);
    assert_true(rise <= 3e-3f); /* samples of a longer cone fall elsewhere */
    vsh_field_free(field);
}

TEST(bad_points_are_nan_and_counted_and_others_are_not_touched) {
    vsh_field *field = field_of(truth_seeds(), 0.1, 0.0);
    enum { COUNT = 7 };
    const double nan = (double)NAN, inf = (double)INFINITY;
    const double positions[3 * COUNT] = {0.0, 0.001, 2.0,   nan, 0.0, 0.0,   0.0, inf, 0.0,   0.0, 0.001,
                                         2.0, 0.0,   0.001, 2.0, 0.0, 0.001, 2.0, 0.0, 0.001, 2.0};
    const float normals[3 * COUNT] = {0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f,       0.0f, 1.0f, 0.0f,
                                      0.0f, 0.0f, 0.0f, 0.0f, 1.0f, (float)NAN, 0.0f, 2.0f, (float)INFINITY,
                                      0.0f, 2.5f, 0.0f};
    for (int32_t method = VSH_AO_TAPS; method <= VSH_AO_CONES; ++method) {
        float ao[COUNT];
        const vsh_shade_stats stats = ao_of(field, method, 16, 1.0, COUNT, positions, normals, ao);
        assert_int_equal(stats.invalid, 5);
        for (int i = 0; i < COUNT; ++i) {
            assert_int_equal(isnan(ao[i]) != 0, i != 0 && i != 6);
        }
        assert_int_equal(bits_of(ao[0]), bits_of(ao[6])); /* normals of any length */
    }
    vsh_field_free(field);
}

TEST(options_out_of_range_are_named) {
    vsh_field *field = field_of(truth_seeds(), 0.2, 1.0);
    const double p[3] = {0.0, 0.001, 2.0};
    const vsh_points points = {1, p, UP, NULL}, bare = {1, p, NULL, NULL};
    float ao = -1.0f;
    assert_fails(vsh_shade_ao(occluders_of(field), &bare, NULL, NULL, &ao, NULL, NULL, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "normals");
    const int32_t counts[] = {0, -1, 257};
    for (int i = 0; i < 3; ++i) {
        vsh_shade_options options = preview_options();
        options.ao_cones = counts[i];
        assert_fails(
            vsh_shade_ao(occluders_of(field), &points, &options, NULL, &ao, NULL, NULL, NULL, &failure),
            VSH_ERROR_ARGUMENT, "ao_cones");
    }
    const double distances[] = {0.0, -1.0, (double)NAN, (double)INFINITY};
    for (int i = 0; i < 4; ++i) {
        vsh_shade_options options = preview_options();
        options.ao_distance = distances[i];
        assert_fails(
            vsh_shade_ao(occluders_of(field), &points, &options, NULL, &ao, NULL, NULL, NULL, &failure),
            VSH_ERROR_ARGUMENT, "ao_distance");
    }
    vsh_shade_options options = preview_options();
    options.ao_method = VSH_AO_AUTO + 1;
    assert_fails(vsh_shade_ao(occluders_of(field), &points, &options, NULL, &ao, NULL, NULL, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "ao_method");
    assert_true(ao == -1.0f);
    vsh_field_free(field);
}

TEST(no_points_need_no_normals) {
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.0};
    vsh_field *field = field_of((truth_scene){&ball, 1}, 0.2, 0.0);
    const double position[3] = {0.0, 2.0, 0.0};
    for (size_t count = 0; count < 2; ++count) {
        const vsh_points points = {count, count > 0 ? position : NULL, NULL, NULL};
        float ao[1], bent[3];
        const vsh_result expected = count > 0 ? VSH_ERROR_ARGUMENT : VSH_OK;
        assert_int_equal(vsh_shade_ao(occluders_of(field), &points, NULL, NULL, ao, NULL, NULL, NULL, NULL),
                         expected);
        assert_int_equal(vsh_shade_ao(occluders_of(field), &points, NULL, NULL, ao, NULL, bent, NULL, NULL),
                         expected);
    }
    vsh_field_free(field);
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
