/* Ambient occlusion by rays: fixed numbers of them, and until an error is reached. */
#include "previews.h"
#include "shading.h"
#include "testing.h"
#include "truth/metrics.h"

enum { TEXELS = 1500 };

static const float UP[3] = {0.0f, 1.0f, 0.0f};

static vsh_shade_options options_of(int32_t method, int32_t rays, double distance) {
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    options.rays = rays;
    options.ao_distance = distance;
    return options;
}

static vsh_shade_stats shade(const vsh_field *field, const vsh_shade_options *options, size_t count,
                             const double *positions, const float *normals, float *ao, float *deviation) {
    const vsh_points points = {count, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(
        vsh_shade_ao(occluders_of(field), &points, options, NULL, ao, deviation, NULL, &stats, &failure));
    return stats;
}

/* Points of the seeds' floor that lie on it: a voxel and more from what stands there, where the field says
 * what it knows. */
typedef struct floor_points {
    vsh_field *field;
    double positions[3 * TEXELS];
    float normals[3 * TEXELS];
    float truth[TEXELS];
} floor_points;

static const double DISTANCE = 1.0;

static floor_points *seeds(void) {
    static floor_points p;
    if (p.field != NULL) {
        return &p;
    }
    const double voxel = 0.02, normal[3] = {0.0, 1.0, 0.0};
    p.field = field_of(truth_seeds(), voxel, 0.0);
    uint64_t counter = 11;
    for (size_t i = 0; i < TEXELS;) {
        const double x = between(&counter, -2.4, 2.4), z = between(&counter, -2.4, 2.4);
        const double above[3] = {x, voxel, z};
        if (truth_distance(truth_seeds(), above) < 0.9 * voxel) {
            continue;
        }
        const double at[3] = {x, 0.001, z};
        memcpy(p.positions + 3 * i, at, sizeof at);
        memcpy(p.normals + 3 * i, UP, sizeof UP);
        p.truth[i++] = (float)truth_ao(truth_seeds(), at, normal, DISTANCE, 2048);
    }
    return &p;
}

static double rmse(const float *values, const float *truth, double *bias) {
    double squares = 0.0, sum = 0.0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const double e = (double)values[i] - (double)truth[i];
        squares += e * e;
        sum += e;
    }
    *bias = sum / TEXELS;
    return sqrt(squares / TEXELS);
}

TEST(an_open_plate_is_exactly_1) {
    const truth_solid plate = {TRUTH_BOX, {0.0, -0.517, 0.0}, {4.0, 0.517, 4.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&plate, 1}, 0.04, 0.0);
    uint64_t counter = 1;
    enum { COUNT = 100 };
    double positions[3 * COUNT];
    float normals[3 * COUNT], ao[COUNT];
    for (int i = 0; i < COUNT; ++i) {
        const double p[3] = {between(&counter, -4.0, 4.0), i % 2 ? 0.0 : 1e-3, between(&counter, -4.0, 4.0)};
        memcpy(positions + 3 * i, p, sizeof p);
        memcpy(normals + 3 * i, UP, sizeof UP);
    }
    for (double distance = 0.1; distance < 30.0; distance *= 3.0) {
        for (int32_t method = VSH_AO_RAYS; method <= VSH_AO_ADAPTIVE; ++method) {
            for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
                vsh_shade_options options = options_of(method, 64, distance);
                options.sampler = sampler;
                shade(field, &options, COUNT, positions, normals, ao, NULL);
                for (int i = 0; i < COUNT; ++i) {
                    if (ao[i] != 1.0f) {
                        fail_msg("method %d, distance %g, (%g, %g, %g): %.9g", method, distance,
                                 positions[3 * i], positions[3 * i + 1], positions[3 * i + 2], (double)ao[i]);
                    }
                }
            }
        }
    }
    vsh_field_free(field);
}

TEST(a_closed_room_is_dark_however_thin_its_walls) {
    const double walls[] = {0.1, 0.5};
    for (int w = 0; w < 2; ++w) {
        vsh_field *field = hollow_box(0.04, walls[w]);
        uint64_t counter = 2;
        for (int i = 0; i < 100; ++i) {
            const double p[3] = {between(&counter, -0.95, 0.95), -0.999, between(&counter, -0.95, 0.95)};
            for (int32_t method = VSH_AO_RAYS; method <= VSH_AO_ADAPTIVE; ++method) {
                const vsh_shade_options options = options_of(method, 256, 10.0);
                float ao = -1.0f;
                shade(field, &options, 1, p, UP, &ao, NULL);
                assert_true(ao == 0.0f);
            }
        }
        vsh_field_free(field);
    }
}

TEST(more_rays_come_nearer_to_the_truth) {
    const floor_points *p = seeds();
    const double bounds[3][3] = {{0.045, 0.018, 0.0085}, {0.066, 0.033, 0.017}, {0.052, 0.022, 0.011}};
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        for (int step = 0; step < 3; ++step) {
            vsh_shade_options options = options_of(VSH_AO_RAYS, 16 << (2 * step), DISTANCE);
            options.sampler = sampler;
            static float ao[TEXELS];
            shade(p->field, &options, TEXELS, p->positions, p->normals, ao, NULL);
            double bias;
            const double error = rmse(ao, p->truth, &bias);
            print_message("%s, %d rays: RMSE %.4f, bias %+.4f\n", vsh_get_name(VSH_NAMES_SAMPLER, sampler),
                          options.rays, error, bias);
            assert_true(error < bounds[sampler][step]);
            /* best candidates crowd the disc's rim */
            assert_true(fabs(bias) < (sampler == VSH_SAMPLER_BLUE ? 0.025 : 0.004));
        }
    }
}

/* Frames are independent: the mean of four of them is nearer than each. */
TEST(frames_may_be_averaged) {
    const floor_points *p = seeds();
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        static float ao[TEXELS], mean[TEXELS];
        memset(mean, 0, sizeof mean);
        double bias, single = 0.0;
        for (int32_t f = 0; f < 4; ++f) {
            vsh_shade_options options = options_of(VSH_AO_RAYS, 16, DISTANCE);
            options.sampler = sampler;
            options.frame = f;
            shade(p->field, &options, TEXELS, p->positions, p->normals, ao, NULL);
            single += 0.25 * rmse(ao, p->truth, &bias);
            for (size_t i = 0; i < TEXELS; ++i) {
                mean[i] += 0.25f * ao[i];
            }
        }
        const double averaged = rmse(mean, p->truth, &bias);
        print_message("%s: one frame %.4f, four %.4f\n", vsh_get_name(VSH_NAMES_SAMPLER, sampler), single,
                      averaged);
        /* a turned copy of the same points is less than another set */
        assert_true(averaged < (sampler == VSH_SAMPLER_BLUE ? 0.9 : 0.6) * single);
    }
}

TEST(rays_that_agree_early_end_a_point) {
    const floor_points *p = seeds();
    static float all[TEXELS], early[TEXELS];
    vsh_shade_options options = options_of(VSH_AO_RAYS, 64, DISTANCE);
    const vsh_shade_stats full = shade(p->field, &options, TEXELS, p->positions, p->normals, all, NULL);
    options.early_rays = 16;
    const vsh_shade_stats less = shade(p->field, &options, TEXELS, p->positions, p->normals, early, NULL);
    double bias, size = rmse(early, all, &bias);
    print_message("16 of 64 rays agree: bias %+.5f, RMS %.5f, marches %.2f of all\n", bias, size,
                  (double)less.marches / (double)full.marches);
    assert_true(less.marches < full.marches);
    assert_true(fabs(bias) < 0.006);
    for (size_t i = 0; i < TEXELS; ++i) {
        /* what has not agreed takes them all, and the same */
        assert_true(early[i] == all[i] || early[i] == 0.0f || early[i] == 1.0f);
    }
}

/* Against many rays on the same field. */
TEST(the_error_left_is_what_was_asked_for_and_said) {
    const floor_points *p = seeds();
    static float truth[TEXELS], ao[TEXELS], deviation[TEXELS];
    const vsh_shade_options many = options_of(VSH_AO_RAYS, 4096, DISTANCE);
    shade(p->field, &many, TEXELS, p->positions, p->normals, truth, NULL);
    const double errors[] = {0.05, 0.02, 0.01};
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        uint64_t last = 0;
        for (int e = 0; e < 3; ++e) {
            vsh_shade_options options = options_of(VSH_AO_ADAPTIVE, 4096, DISTANCE);
            options.max_error = errors[e];
            options.sampler = sampler;
            const vsh_shade_stats stats =
                shade(p->field, &options, TEXELS, p->positions, p->normals, ao, deviation);
            double bias, said = 0.0;
            const double error = rmse(ao, truth, &bias);
            for (size_t i = 0; i < TEXELS; ++i) {
                assert_true(deviation[i] >= 0.0f && (double)deviation[i] <= errors[e] * 1.000001);
                said += (double)deviation[i] * (double)deviation[i];
            }
            print_message("%s, asked %g: said %.4f, is %.4f; %.1f marches a point\n",
                          vsh_get_name(VSH_NAMES_SAMPLER, sampler), errors[e], sqrt(said / TEXELS), error,
                          (double)stats.marches / TEXELS);
            assert_true(error <= 1.1 * sqrt(said / TEXELS));
            assert_true(fabs(stats.square_error - said) < 1e-4 * said + 1e-9);
            assert_true(fabs(bias) < (sampler == VSH_SAMPLER_BLUE ? 0.5 : 0.25) * errors[e]);
            assert_true(stats.marches > last);
            last = stats.marches;
        }
    }
}

TEST(rays_end_the_refinement_where_the_error_does_not) {
    const floor_points *p = seeds();
    static float ao[TEXELS], same[TEXELS], deviation[TEXELS];
    vsh_shade_options options = options_of(VSH_AO_ADAPTIVE, 24, DISTANCE);
    options.max_error = 1e-4;
    const vsh_shade_stats stats = shade(p->field, &options, TEXELS, p->positions, p->normals, ao, deviation);
    assert_int_equal(stats.refined, TEXELS);
    const vsh_shade_options fixed = options_of(VSH_AO_RAYS, 24, DISTANCE);
    shade(p->field, &fixed, TEXELS, p->positions, p->normals, same, NULL);
    assert_memory_equal(ao, same, sizeof ao);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true((double)deviation[i] > 1e-4);
    }
}

TEST(threads_and_the_order_of_points_do_not_show) {
    const floor_points *p = seeds();
    static float first[TEXELS], other[TEXELS];
    static uint32_t texels[TEXELS];
    for (uint32_t i = 0; i < TEXELS; ++i) {
        texels[i] = (i / 40) << 16 | i % 40;
    }
    for (int32_t method = VSH_AO_TAPS; method <= VSH_AO_ADAPTIVE; ++method) {
        for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
            vsh_shade_options options = options_of(method, 60, DISTANCE);
            options.ao_cones = 7; /* pieces of the kernel's lanes end in the middle of points */
            options.sampler = sampler;
            const vsh_points points = {TEXELS, p->positions, p->normals, texels};
            const int32_t threads[] = {1, 2, 5};
            vsh_shade_stats stats[3];
            for (int i = 0; i < 3; ++i) {
                const vsh_run run = run_on(threads[i]);
                stats[i] = vsh_shade_stats_zero();
                assert_ok(vsh_shade_ao(occluders_of(p->field), &points, &options, &run,
                                       i == 0 ? first : other, NULL, NULL, &stats[i], &failure));
                if (i > 0) {
                    assert_memory_equal(first, other, sizeof first);
                    assert_memory_equal(&stats[0], &stats[i], sizeof stats[0]);
                }
            }
            for (size_t i = 0; i < TEXELS; i += 97) { /* one at a time: the texel tells points apart */
                const vsh_points one = {1, p->positions + 3 * i, p->normals + 3 * i, &texels[i]};
                float ao = -1.0f;
                assert_ok(
                    vsh_shade_ao(occluders_of(p->field), &one, &options, NULL, &ao, NULL, NULL, NULL, NULL));
                assert_int_equal(bits_of(ao), bits_of(first[i]));
            }
        }
    }
}

TEST(bad_points_are_nan_with_nan_deviation) {
    const floor_points *p = seeds();
    const double positions[9] = {0.0, 0.001, 2.0, (double)NAN, 0.0, 0.0, 0.0, 0.001, 2.0};
    const float normals[9] = {0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    for (int32_t method = VSH_AO_TAPS; method <= VSH_AO_ADAPTIVE; ++method) {
        const vsh_shade_options options = options_of(method, 16, DISTANCE);
        float ao[3], deviation[3];
        const vsh_shade_stats stats = shade(p->field, &options, 3, positions, normals, ao, deviation);
        assert_int_equal(stats.invalid, 2);
        assert_true(isnan(ao[1]) && isnan(ao[2]) && isnan(deviation[1]) && isnan(deviation[2]));
        assert_false(isnan(ao[0]));
        assert_int_equal(isnan(deviation[0]) != 0, method < VSH_AO_RAYS);
    }
}

/* A slatted roof over a floor: nothing but convex edges, which trilinear samples cut. What rays are to see
 * through it they see to a hundredth. */
TEST(edges_hide_as_much_as_their_casters) {
    enum { SLATS = 7, COUNT = 40 };
    truth_solid slats[SLATS];
    for (int i = 0; i < SLATS; ++i) {
        slats[i] = (truth_solid){TRUTH_BOX, {0.4 * (i - 3), 0.6, 0.0}, {0.1, 0.1, 1.5}, 0.0, 0.0};
    }
    const truth_scene scene = {slats, SLATS};
    const double up[3] = {0.0, 1.0, 0.0};
    double places[3 * COUNT];
    float ups[3 * COUNT] = {0}, open[COUNT], expected[COUNT];
    for (int i = 0; i < COUNT; ++i) {
        places[3 * i] = -0.8 + 0.04 * i;
        places[3 * i + 1] = 0.0;
        places[3 * i + 2] = 0.013 * i - 0.2;
        ups[3 * i + 1] = 1.0f;
        expected[i] = (float)truth_ao(scene, places + 3 * i, up, 1.0, 4096);
    }
    vsh_field *field = field_of(scene, 0.06, 0.0);
    vsh_shade_options options = preview_options();
    options.ao_method = VSH_AO_RAYS;
    options.rays = 1024;
    options.ao_distance = 1.0;
    const vsh_points points = {COUNT, places, ups, NULL};
    assert_ok(vsh_shade_ao(occluders_of(field), &points, &options, NULL, open, NULL, NULL, NULL, &failure));
    const truth_metrics m = truth_compare(COUNT, open, expected, NULL);
    print_message("slats of 3.3 voxels: rmse %.4f, bias %+.4f\n", m.rmse, m.bias);
    assert_true(fabs(m.bias) < 0.01);
    vsh_field_free(field);
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
