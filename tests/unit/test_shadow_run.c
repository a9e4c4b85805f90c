/* How shadows are computed: work that is counted, and bad input. */
#include "previews.h"
#include "shading.h"
#include "testing.h"

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

static vsh_result shade(const vsh_field *field, const vsh_light *light, const vsh_shade_options *options,
                        const vsh_run *run, float *values, vsh_shade_stats *stats) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    return vsh_shade_shadow(occluders_of(field), &points, light, options, run, values, NULL, stats, &failure);
}

TEST(every_point_is_marched_skipped_certified_or_invalid) {
    static float visible[COUNT];
    fill_points();
    positions[0] = (double)NAN;
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
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
    vsh_shade_stats sum = vsh_shade_stats_zero();
    assert_ok(shade(field, &light, NULL, NULL, visible, &sum));
    const vsh_shade_stats once = sum;
    assert_ok(shade(field, &light, NULL, NULL, visible, &sum));
    assert_int_equal(sum.marches, 2 * once.marches);
    assert_int_equal(sum.samples, 2 * once.samples);
    assert_int_equal(sum.certified, 2 * once.certified);
}

TEST(points_turned_away_are_0_and_skipped_not_marched) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
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
}

TEST(running_out_of_steps_is_counted_and_stays_in_range) {
    static float visible[COUNT];
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    const double low[3] = {-1.0, 0.02, -0.3}; /* along the floor, where steps are short */
    const vsh_light light = sun(low, 0.01);
    vsh_shade_options options = preview_options();
    vsh_shade_stats few = vsh_shade_stats_zero(), many = vsh_shade_stats_zero();
    options.max_steps = 16;
    assert_ok(shade(field, &light, &options, NULL, visible, &few));
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(visible[i] >= 0.0f && visible[i] <= 1.0f);
    }
    options.max_steps = 65536;
    assert_ok(shade(field, &light, &options, NULL, visible, &many));
    assert_true(few.unfinished > 100);
    assert_at_most(few.samples, 16 * few.marches);
    assert_int_equal(many.unfinished, 0);
}

TEST(cones_wider_than_the_reach_are_counted) {
    static float visible[COUNT];
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.2);
    const vsh_light wide = sun(truth_seeds_sun, RADIANS(60.0)), narrow = sun(truth_seeds_sun, RADIANS(0.5));
    vsh_shade_stats stats = shadows(field, &wide, VSH_SHADOW_CONE, COUNT, positions, normals, visible);
    assert_true(stats.beyond_reach > 0 && stats.beyond_reach <= stats.marches);
    stats = shadows(field, &narrow, VSH_SHADOW_CONE, COUNT, positions, normals, visible);
    assert_int_equal(stats.beyond_reach, 0);
}

TEST(bad_options_and_lights_are_refused) {
    static float visible[COUNT];
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.2, 1.0);
    vsh_light light = sun(truth_seeds_sun, 0.2), inverted = sun(truth_seeds_sun, -1.0);
    vsh_shade_options o[6];
    const char *const parts[6] = {"method", "max_steps", "start_offset", "start_offset", "start_offset", ""};
    for (int i = 0; i < 6; ++i) {
        o[i] = preview_options();
    }
    o[0].method = VSH_SHADOW_AUTO + 1;
    o[1].max_steps = 15;
    o[2].start_offset = -0.1;
    o[3].start_offset = 17.0;
    o[4].start_offset = (double)NAN;
    o[5].struct_size = 3;
    for (int i = 0; i < 6; ++i) {
        assert_fails(shade(field, &light, &o[i], NULL, visible, NULL), VSH_ERROR_ARGUMENT, parts[i]);
    }
    assert_fails(shade(field, &inverted, NULL, NULL, visible, NULL), VSH_ERROR_ARGUMENT, "angle");
    const vsh_points none = {0, NULL, NULL, NULL};
    assert_ok(vsh_shade_shadow(occluders_of(field), &none, &light, NULL, NULL, NULL, NULL, NULL, &failure));
    assert_true(shadow_at(field, &light, VSH_SHADOW_CONE, (const double[]){0.0, 9.0, 0.0}, UP) == 1.0f);
}
