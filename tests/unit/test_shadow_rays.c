/* Shadows by rays: the reference on the field, and what proves its way past them. */
#include "shading.h"
#include "testing.h"

#include "previews.h"
#include "truth/metrics.h"

static const float UP[3] = {0.0f, 1.0f, 0.0f};

enum { SIDE = 128, TEXELS = SIDE * SIDE };
static double positions[3 * TEXELS];
static float normals[3 * TEXELS], visible[TEXELS], deviation[TEXELS], truth[TEXELS], reference[TEXELS];
static float outside[TEXELS]; /* 1: the texel is not inside one of the solids that stand on the floor */

static vsh_shade_stats shade(const vsh_field *field, const vsh_light *light, const vsh_shade_options *options,
                             size_t count, float *values, float *errors) {
    const vsh_points points = {count, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_shadow(occluders_of(field), &points, light, options, NULL, values, errors, &stats,
                               &failure));
    return stats;
}

static void place_floor(void) {
    floor_texels(SIDE, positions, normals);
    for (size_t i = 0; i < TEXELS; ++i) {
        outside[i] = truth_distance(truth_seeds(), positions + 3 * i) > 0.0 ? 1.0f : 0.0f;
    }
}

static vsh_shade_options options_of(int32_t method, int32_t rays, double max_error) {
    vsh_shade_options options = preview_options();
    options.method = method;
    options.rays = rays;
    options.max_error = max_error;
    return options;
}

TEST(rays_close_in_on_the_truth) {
    const double normal[3] = {0.0, 1.0, 0.0};
    place_floor();
    assert_int_equal(truth_lights(truth_seeds(), TEXELS, positions, normal, truth_seeds_sun, truth_seeds_w,
                                  (double)INFINITY, 1024, truth),
                     0);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const double bounds[] = {0.020, 0.011, 0.009};
    double last = 1.0;
    for (int i = 0; i < 3; ++i) {
        const vsh_shade_options options = options_of(VSH_SHADOW_RAYS, 16 << (2 * i), 0.02);
        shade(field, &light, &options, TEXELS, visible, NULL);
        const truth_metrics m = truth_compare(TEXELS, visible, truth, outside);
        truth_metrics_print("rays", &m);
        assert_true(m.rmse < bounds[i]);
        assert_true(m.rmse < last * 1.01);
        last = m.rmse;
    }
}

TEST(adaptive_keeps_the_error_asked_for_and_says_what_it_kept) {
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    const double place[3] = {-0.5, 2.5, -0.8};
    const vsh_light lights[] = {sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w)), lamp(place, 0.3)};
    for (int l = 0; l < 2; ++l) {
        vsh_shade_options options = options_of(VSH_SHADOW_RAYS, 1024, 0.02);
        shade(field, &lights[l], &options, TEXELS, reference, NULL);
        const double errors[] = {0.05, 0.02, 0.01};
        for (int e = 0; e < 3; ++e) {
            options = options_of(VSH_SHADOW_ADAPTIVE, 1024, errors[e]);
            const vsh_shade_stats stats = shade(field, &lights[l], &options, TEXELS, visible, deviation);
            const truth_metrics m = truth_compare(TEXELS, visible, reference, NULL);
            const double estimate = sqrt(stats.square_error / TEXELS);
            assert_at_most(m.rmse, errors[e]);
            assert_at_most(m.penumbra_rmse, errors[e]);
            assert_true(m.rmse < 1.15 * estimate && m.rmse > 0.4 * estimate);
            assert_true(stats.certified > 0.7 * TEXELS);
            for (size_t i = 0; i < TEXELS; ++i) {
                assert_true(deviation[i] >= 0.0f && deviation[i] <= 1.001 * errors[e]);
            }
        }
    }
}

/* What a cone proved is so of the casters themselves, not only of the field. */
TEST(no_proof_is_wrong) {
    const double normal[3] = {0.0, 1.0, 0.0};
    place_floor();
    const double widths[] = {0.01, 0.1, 0.4};
    for (int coarse = 0; coarse < 2; ++coarse) {
        OWNED(vsh_field) *field = field_of(truth_seeds(), coarse ? 0.05 : 0.02, 0.0);
        for (int w = 0; w < 3; ++w) {
            assert_int_equal(truth_lights(truth_seeds(), TEXELS, positions, normal, truth_seeds_sun,
                                          widths[w], (double)INFINITY, 512, truth),
                             0);
            const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(widths[w]));
            const vsh_shade_options options = options_of(VSH_SHADOW_ADAPTIVE, 8, 1.0);
            shade(field, &light, &options, TEXELS, visible, deviation);
            size_t proved = 0, decided = 0;
            for (size_t i = 0; i < TEXELS; ++i) {
                if (!(outside[i] > 0.0f)) {
                    continue;
                }
                decided += truth[i] == 0.0f || truth[i] == 1.0f;
                if (deviation[i] == 0.0f) {
                    ++proved;
                    assert_true(visible[i] == truth[i]);
                }
            }
            assert_true((double)proved > (coarse ? 0.7 : 0.85) * (double)decided);
        }
    }
}

/* Points across what casters do to a light straight above, by their truth; what a method is off. */
static truth_metrics compare_across(truth_scene scene, double w, double from, double step, size_t count,
                                    vsh_shade_options options) {
    OWNED(vsh_field) *field = field_of(scene, 0.02, 0.0);
    const double up[3] = {0.0, 1.0, 0.0};
    const vsh_light light = sun(up, 2.0 * atan(w));
    for (size_t i = 0; i < count; ++i) {
        const double p[3] = {from + step * (double)i, 0.0, 0.1};
        memcpy(positions + 3 * i, p, sizeof p);
        memcpy(normals + 3 * i, UP, sizeof UP);
        truth[i] = (float)truth_light(scene, p, up, up, w, (double)INFINITY, 4096);
    }
    shade(field, &light, &options, count, visible, NULL);
    return truth_compare(count, visible, truth, NULL);
}

/* A sheet above the floor, a quarter as thick as the cone is wide there: one cone looks at one of its edges
 * and is off where it sees two. */
TEST(a_sheet_thinner_than_the_cone_is_dark) {
    const double height = 2.0, w = 0.1, thickness = 0.25 * 2.0 * w * height;
    const truth_solid sheet = {TRUTH_BOX, {0.0, height, 0.0}, {1.5, 0.5 * thickness, 1.5}, 0.0, 0.0};
    const truth_scene scene = {&sheet, 1};
    const truth_metrics cone =
        compare_across(scene, w, -0.8, 0.015, 161, options_of(VSH_SHADOW_CONE, 64, 0.02));
    const truth_metrics adaptive =
        compare_across(scene, w, -0.8, 0.015, 161, options_of(VSH_SHADOW_ADAPTIVE, 1024, 0.01));
    assert_true(cone.max > 0.05); /* 0.12: else there is nothing here that rays were better at */
    assert_less(adaptive.max, 0.25 * cone.max);
    assert_less(adaptive.rmse, 0.25 * cone.rmse);
    assert_less(adaptive.rmse, 0.01);
    assert_less(adaptive.p95, 0.02);
}

/* Slats that share the disc: the nearest is not all that hides. */
TEST(several_casters_share_the_disc) {
    truth_solid slats[8];
    for (int i = 0; i < 8; ++i) {
        slats[i] = (truth_solid){TRUTH_BOX, {-0.7 + 0.2 * i, 2.0, 0.0}, {0.05, 0.05, 1.5}, 0.0, 0.0};
    }
    const truth_metrics m = compare_across((truth_scene){slats, 8}, 0.15, -0.5, 0.01, 101,
                                           options_of(VSH_SHADOW_ADAPTIVE, 1024, 0.01));
    assert_less(m.rmse, 0.015);
}

/* Where the first rays agree, the rest are taken to: cheaper by far, and a thin shadow is sometimes missed.
 */
TEST(early_ends_save_rays_and_cost_little) {
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    vsh_shade_options options = options_of(VSH_SHADOW_RAYS, 64, 0.02);
    const vsh_shade_stats all = shade(field, &light, &options, TEXELS, reference, NULL);
    options.early_rays = 8;
    const vsh_shade_stats early = shade(field, &light, &options, TEXELS, visible, NULL);
    const truth_metrics m = truth_compare(TEXELS, visible, reference, NULL);
    truth_metrics_print("early", &m);
    assert_less((double)early.rays, 0.4 * (double)all.rays);
    assert_true(m.rmse > 0.0 && m.rmse < 0.012);
    assert_less(fabs(m.bias), 0.001);
}

TEST(threads_and_order_do_not_show) {
    floor_texels(64, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.3);
    static uint32_t texels[64 * 64];
    for (uint32_t i = 0; i < 64 * 64; ++i) {
        texels[i] = i % 64 + ((i / 64) << 16);
    }
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        vsh_shade_options options = options_of(VSH_SHADOW_ADAPTIVE, 64, 0.05);
        options.sampler = sampler;
        vsh_shade_stats stats[3];
        for (int i = 0; i < 3; ++i) {
            const vsh_run run = run_on(i == 0 ? 1 : i == 1 ? 2 : 5);
            stats[i] = vsh_shade_stats_zero();
            const vsh_points points = {64 * 64, positions, normals, texels};
            assert_ok(vsh_shade_shadow(occluders_of(field), &points, &light, &options, &run,
                                       i == 0 ? reference : visible, deviation, &stats[i], &failure));
            assert_memory_equal(reference, i == 0 ? reference : visible, sizeof visible[0] * 64 * 64);
            assert_memory_equal(&stats[0], &stats[i], sizeof stats[0]);
        }
        /* one point alone has the rays that it has among the others: as many with rays; with adaptive so many
         * that its error keeps to what was asked for, whatever its neighbours show */
        for (int32_t method = VSH_SHADOW_RAYS; method <= VSH_SHADOW_ADAPTIVE; ++method) {
            options.method = method;
            const vsh_points points = {64 * 64, positions, normals, texels};
            assert_ok(vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, reference, NULL,
                                       NULL, &failure));
            for (size_t i = 100; i < 4096; i += 397) {
                const vsh_points one = {1, positions + 3 * i, normals + 3 * i, texels + i};
                float value;
                assert_ok(vsh_shade_shadow(occluders_of(field), &one, &light, &options, NULL, &value, NULL,
                                           NULL, &failure));
                const double room = method == VSH_SHADOW_RAYS ? 0.0 : 3.0 * options.max_error;
                assert_true(fabs((double)value - (double)reference[i]) <= room);
            }
        }
    }
}
