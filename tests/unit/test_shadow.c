/* Shadow values against closed forms and ray-traced truth. */
#include "shading.h"
#include "testing.h"

#include "previews.h"
#include "truth/directions.h"
#include "truth/metrics.h"

enum { SIDE = 64, COUNT = SIDE * SIDE, FINE = 128 * 128, FINEST = 256 * 256, MARCHES = 5 };

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double OVERHEAD[3] = {0.0, 1.0, 0.0};
static double positions[3 * FINEST];
static float normals[3 * FINEST];

/* Every method of one march gives a point exactly this value. */
static void assert_marched(const vsh_field *field, const vsh_light *light, const double p[3],
                           const float *normal, float expected) {
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        const float v = shadow_at(field, light, method, p, normal);
        assert_that(v == expected, "(%g, %g, %g), sun of %g degrees towards (%g, %g, %g), %s: %.9g, not %g",
                    p[0], p[1], p[2], light->angle / RADIANS(1.0), light->direction[0], light->direction[1],
                    light->direction[2], vsh_get_name(VSH_NAMES_SHADOW, method), (double)v, (double)expected);
    }
}

TEST(the_seeds_floor_is_as_near_to_the_truth_as_promised) {
    static float truth[FINEST], visible[FINEST];
    floor_texels(256, positions, normals);
    truth_lights(truth_seeds(), FINEST, positions, OVERHEAD, truth_seeds_sun, truth_seeds_w, (double)INFINITY,
                 256, truth);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const struct {
        int32_t method;
        double rmse;
    } cases[] = {{VSH_SHADOW_CONE, 0.022},
                 {VSH_SHADOW_SMOOTH, 0.022},
                 {VSH_SHADOW_CLASSIC, 0.16},
                 {VSH_SHADOW_PRACTICAL, 0.16},
                 {VSH_SHADOW_IMPROVED, 0.16}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const vsh_shade_stats stats =
            shadows(field, &light, cases[i].method, FINEST, positions, normals, visible);
        const truth_metrics m = truth_compare(FINEST, visible, truth, NULL);
        assert_at_most(m.rmse, cases[i].rmse);
        assert_true(stats.unfinished == 0 && stats.invalid == 0 && stats.beyond_reach == 0);
    }
}

static const double ANGLES[] = {0.0, 0.5, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0};
enum { ANGLE_COUNT = COUNT_OF(ANGLES) };

TEST(open_sky_is_exactly_1_at_any_distance_and_size_of_light) {
    const truth_solid solids[] = {{TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.0},
                                  {TRUTH_BOX, {0.0, 0.0, 0.0}, {0.9, 0.02, 0.05}, 0.0, 0.0}};
    const double sizes[] = {1.0, 0.90161}; /* radii of the balls around them */
    for (int shape = 0; shape < 2; ++shape) {
        OWNED(vsh_field) *field =
            field_of((truth_scene){&solids[shape], 1}, 0.05 / (shape == 1 ? 2.5 : 1.0), 0.0);
        uint64_t counter = 1;
        for (double away = 1e-3; away < 2e4; away *= 3.1) {
            for (int i = 0; i < 40 * ANGLE_COUNT; ++i) {
                double out[3], side[3], towards[3], position[3];
                random_direction(&counter, out);
                const double distance = sizes[shape] + away;
                go_along((double[3]){0}, distance, out, position);
                /* beyond the caster's side by a cone's width and a tenth more, or away from it */
                const double half = RADIANS(0.5 * ANGLES[i / 40]);
                const double least = asin(sizes[shape] / distance) + half * 1.1 + 0.02;
                if (least > PI) {
                    continue;
                }
                const double apart = i % 2 ? least : between(&counter, least, PI);
                const truth_frame frame = truth_frame_around(out);
                const double turn = between(&counter, 0.0, 2.0 * PI);
                for (int axis = 0; axis < 3; ++axis) {
                    side[axis] = cos(turn) * frame.u[axis] + sin(turn) * frame.v[axis];
                    towards[axis] = -cos(apart) * out[axis] + sin(apart) * side[axis];
                }
                const vsh_light light = sun(towards, 2.0 * half);
                assert_marched(field, &light, position, NULL, 1.0f);
            }
        }
    }
}

TEST(the_middle_of_a_wide_umbra_is_exactly_0_at_any_depth) {
    const double half = 2.0, voxel = 0.05, room = 0.1 * half;
    const truth_solid block = {TRUTH_BOX, {0.0, 0.0, 0.0}, {half, half, half}, 0.0, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&block, 1}, voxel, 0.0);
    const double angles[] = {0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0};
    uint64_t counter = 3;
    double deepest = 0.0;
    for (size_t l = 0; l < COUNT_OF(angles); ++l) {
        const vsh_light light = sun(OVERHEAD, RADIANS(angles[l]));
        for (double depth = 0.1; depth < 20000.0; depth *= 1.5) { /* voxels under the block */
            /* the cone's ball at the block's centre fills at most 7/10 of it */
            const double distance = half + depth * voxel;
            if (distance * sin(0.5 * light.angle) > 0.7 * half) {
                break;
            }
            for (int sample = 0; sample < 10; ++sample) {
                const double p[3] = {between(&counter, -room, room), -distance,
                                     between(&counter, -room, room)};
                assert_marched(field, &light, p, UP, 0.0f);
                assert_marched(field, &light, p, NULL, 0.0f);
            }
            deepest = fmax(deepest, depth);
        }
    }
    assert_true(deepest > 5000);
}

/* Returns the worst error of `cone` below a slab that ends at x = 0. The light is straight above, and the
 * slab `thick` units high. From (x, -depth), the slab's lower edge cuts the disc in the umbra's half, and its
 * upper edge in the other. */
static double worst_across_edge(double thick, double depth, double w, double voxel) {
    const truth_solid slab = {TRUTH_BOX, {-4.0, 0.5 * thick, 0.0}, {4.0, 0.5 * thick, 8.0}, 0.0, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&slab, 1}, voxel, 0.0);
    const vsh_light light = sun(OVERHEAD, 2.0 * atan(w));
    double worst = 0.0;
    for (int k = -120; k <= 120; ++k) {
        const double edge = k < 0 ? depth : depth + thick, t = 0.01 * k * w;
        const double p[3] = {t * edge, -depth, 0.013};
        if (k != 0) { /* else it is along the very face */
            const double seen = (double)shadow_at(field, &light, VSH_SHADOW_CONE, p, UP);
            worst = fmax(worst, fabs(seen - truth_disc_share(0.01 * k)));
        }
    }
    return worst;
}

TEST(a_straight_edge_casts_the_penumbra_of_a_disc) {
    /* A depth h shows h behind the edge, so x becomes x / (1 + w x) in the umbra's half. That is 0.011 for
     * the wider light. The lattice rounds the edge, which is the rest. `lights` has the bounds for lights
     * of degrees. */
    const double ws[] = {0.02, 0.05}, depths[] = {1.0, 2.0, 5.0, 10.0, 30.0};
    for (int i = 0; i < 10; ++i) {
        if (ws[i / 5] * depths[i % 5] <= 1.0) { /* the cone is no wider than the slab is thick */
            assert_true(worst_across_edge(2.0, depths[i % 5], ws[i / 5], 0.04) <= (i < 5 ? 0.02 : 0.03));
        }
    }
    static const double boxes[][2] = {{1.0, 4.0}, {1.0, 2.0}, {0.5, 4.0}};
    static const struct {
        double degrees, most;
    } lights[] = {{1.0, 0.05}, {5.0, 0.05}, {10.0, 0.05}, {20.0, 0.07}, {60.0, 0.18}};
    for (size_t b = 0; b < COUNT_OF(boxes); ++b) {
        for (size_t i = 0; i < COUNT_OF(lights); ++i) {
            const double w = tan(0.5 * RADIANS(lights[i].degrees));
            assert_true(worst_across_edge(boxes[b][1], boxes[b][0], w, 0.1) <= lights[i].most);
        }
    }
}

/* Values along a line across the penumbra of a box's edge under a sun of w 0.1, from the umbra to the open,
 * at steps of a hundredth of its half width; expected: the closed form. The box is on the left of the edge
 * and above it, and the sun `tilt` radians to the right of straight above: rays of the inner half go in
 * through its bottom and out through its side. */
enum { LINE = 47 };

static void across_an_edge(int32_t method, double tilt, double *values, double *expected) {
    const double w = 0.1, depth = 2.0;
    const truth_solid box = {TRUTH_BOX, {-2.0, 2.0, 0.0}, {2.0, 2.0, 4.0}, 0.0, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&box, 1}, 0.04, 0.0);
    const double towards[3] = {sin(tilt), cos(tilt), 0.0};
    const vsh_light light = sun(towards, 2.0 * atan(w));
    for (int i = 0; i < LINE; ++i) {
        const double x = 0.05 * (i - LINE / 2), angle = tilt - atan(x * w);
        const double p[3] = {-depth * tan(angle), -depth, 0.013};
        values[i] = (double)shadow_at(field, &light, method, p, NULL);
        expected[i] = truth_disc_share(x);
    }
}

static double second_differences(const double *v) {
    double squares = 0.0;
    for (int i = 1; i + 1 < LINE; ++i) {
        const double second = v[i - 1] - 2.0 * v[i] + v[i + 1];
        squares += second * second;
    }
    return sqrt(squares / (LINE - 2));
}

typedef struct edge_errors {
    double rmse, bands; /* bands: second differences over those of the truth */
} edge_errors;

static edge_errors errors_across_an_edge(int32_t method, double tilt) {
    double values[LINE], expected[LINE], squares = 0.0;
    across_an_edge(method, tilt, values, expected);
    for (int i = 0; i < LINE; ++i) {
        squares += (values[i] - expected[i]) * (values[i] - expected[i]) / LINE;
        assert_true(i == 0 || values[i - 1] - values[i] < 1e-4);
    }
    const edge_errors errors = {sqrt(squares), second_differences(values) / second_differences(expected)};
    return errors;
}

/* Both methods read a caster's depth for the distance to its edge. The segment of `cone` is steeper there. */
TEST(cone_has_no_more_bands_than_smooth_and_a_third_more_error) {
    const double tilts[] = {0.25, 0.5, 0.7854, 1.1};
    for (size_t t = 0; t < COUNT_OF(tilts); ++t) {
        const edge_errors smooth = errors_across_an_edge(VSH_SHADOW_SMOOTH, tilts[t]);
        const edge_errors cone = errors_across_an_edge(VSH_SHADOW_CONE, tilts[t]);
        assert_true(smooth.rmse < 0.07);
        assert_true(cone.rmse < 1.33 * smooth.rmse && cone.bands <= smooth.bands);
    }
}

TEST(a_point_near_the_shadow_sees_less_of_larger_lights) {
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&ball, 1}, 0.02, 0.0);
    for (int32_t method = VSH_SHADOW_CLASSIC; method <= VSH_SHADOW_CONE; ++method) {
        float rise = 0.0f;
        for (double x = 0.51; x < 1.2; x += 0.06) {
            const double p[3] = {x, -2.0, 0.0};
            float last = 1.0f;
            for (double angle = 0.0; angle <= 60.0; angle += 0.5) {
                const vsh_light light = sun(OVERHEAD, RADIANS(angle));
                const float v = shadow_at(field, &light, method, p, NULL);
                rise = fmaxf(rise, v - last);
                last = v;
            }
            assert_true(last < 1.0f);
        }
        /* samples of a ray lie h apart, so how near they come to the least h / t changes with the angle */
        assert_true(rise <=
                    (method == VSH_SHADOW_IMPROVED || method == VSH_SHADOW_PRACTICAL ? 0.025f : 0.015f));
    }
}

/* `practical` is `classic` through a smoothstep, except where its march ends earlier. */
TEST(practical_is_classic_smoothed) {
    static float classic[COUNT], practical[COUNT];
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const vsh_shade_stats a = shadows(field, &light, VSH_SHADOW_CLASSIC, COUNT, positions, normals, classic);
    const vsh_shade_stats b =
        shadows(field, &light, VSH_SHADOW_PRACTICAL, COUNT, positions, normals, practical);
    size_t between_ends = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        const double x = (double)classic[i];
        assert_float_equal(practical[i], x < 0.004 ? 0.0 : x * x * (3.0 - 2.0 * x), 1e-5);
        between_ends += x > 0.1 && x < 0.9;
    }
    assert_true(between_ends > 20);
    assert_true(b.samples <= a.samples);
}

/* Shorter steps find what lies between the samples of whole ones: values change from texel to texel, by a
 * part that another frame changes again, and never for a worse error. */
TEST(jittered_steps_leave_grain) {
    static float truth[FINE], plain[FINE], jittered[FINE], again[FINE], other[FINE];
    floor_texels(128, positions, normals);
    truth_lights(truth_seeds(), FINE, positions, OVERHEAD, truth_seeds_sun, truth_seeds_w, (double)INFINITY,
                 64, truth);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_SMOOTH; /* `cone` looks again where the steps came closest */
    const vsh_points points = {FINE, positions, normals, NULL};
    const vsh_shade_stats whole =
        shade_points(occluders_of(field), &points, &light, &options, NULL, plain, NULL);
    options.jitter = 0.5;
    const vsh_shade_stats shorter =
        shade_points(occluders_of(field), &points, &light, &options, NULL, jittered, NULL);
    const vsh_run one = run_on(1);
    shade_points(occluders_of(field), &points, &light, &options, &one, again, NULL);
    assert_memory_equal(jittered, again, sizeof again);
    options.frame = 1;
    shade_points(occluders_of(field), &points, &light, &options, NULL, other, NULL);
    size_t changed = 0, moved = 0, grey = 0;
    for (size_t i = 0; i < FINE; ++i) {
        grey += plain[i] > 0.05f && plain[i] < 0.95f;
        changed += jittered[i] != plain[i];
        moved += jittered[i] != other[i];
        assert_true(fabsf(jittered[i] - plain[i]) < 0.1f);
    }
    assert_true(changed > grey / 2 && moved > grey / 2);
    assert_true(shorter.samples > whole.samples);
    const truth_metrics before = truth_compare(FINE, plain, truth, NULL);
    const truth_metrics after = truth_compare(FINE, jittered, truth, NULL);
    assert_at_most(after.rmse, before.rmse);
}

/* --- where the light, and where it stands, decide */

TEST(a_light_without_size_is_hard_in_every_method) {
    static float hard[COUNT], soft[COUNT];
    floor_texels(SIDE, positions, normals);
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
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
            for (int32_t method = VSH_SHADOW_CLASSIC; method <= VSH_SHADOW_ADAPTIVE; ++method) {
                const vsh_shade_stats stats = shadows(field, &lights[l], method, COUNT, positions, n, soft);
                assert_memory_equal(hard, soft, sizeof hard);
                assert_true(stats.square_error == 0.0);
                assert_true(method < VSH_SHADOW_RAYS || stats.rays <= COUNT); /* one is enough */
            }
            /* and `hard` does not see a size */
            vsh_light sized = lights[l];
            sized.angle = 0.2;
            sized.radius = 0.3;
            shadows(field, &sized, VSH_SHADOW_HARD, COUNT, positions, n, soft);
            assert_memory_equal(hard, soft, sizeof hard);
        }
    }
}

TEST(the_horizon_cuts_the_light_like_a_straight_edge) {
    const truth_solid plate = {TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&plate, 1}, 0.04, 0.0);
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
                assert_that(fabs(v - expected) <= 1e-3,
                            "place %d, w %g, %g of the disc's radius over the horizon: %.6f, not %.6f", place,
                            ws[i], 0.1 * k, v, expected);
                if (k == 0) {
                    assert_float_equal(v, 0.5, 1e-6);
                }
            }
        }
    }
}

/* --- how shadows are computed: work that is counted, and bad input */

static vsh_result shade(const vsh_field *field, const vsh_light *light, const vsh_shade_options *options,
                        const vsh_run *run, float *values, vsh_shade_stats *stats) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    return vsh_shade_shadow(occluders_of(field), &points, light, options, run, values, NULL, stats, &failure);
}

TEST(every_point_is_marched_skipped_certified_or_invalid) {
    static float visible[COUNT];
    scattered_texels(SIDE, 9, positions, normals);
    positions[0] = (double)NAN;
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    for (int32_t method = 0; method < MARCHES; ++method) {
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
        /* rays that miss the casters' bounds are neither marched nor skipped */
        assert_true(COUNT - done < COUNT / 3);
        assert_true(stats.samples >= stats.marches);
        assert_int_equal(stats.unfinished, 0);
        assert_int_equal(stats.beyond_reach, 0);
        if (method == VSH_SHADOW_CONE) {
            assert_true(stats.certified > COUNT / 3 &&
                        stats.certified <= COUNT - stats.skipped - stats.invalid);
        }
    }
    /* calls add to the statistics */
    vsh_shade_stats sum = vsh_shade_stats_zero();
    assert_ok(shade(field, &light, NULL, NULL, visible, &sum));
    const vsh_shade_stats once = sum;
    assert_ok(shade(field, &light, NULL, NULL, visible, &sum));
    assert_int_equal(sum.marches, 2 * once.marches);
    assert_int_equal(sum.samples, 2 * once.samples);
    assert_int_equal(sum.certified, 2 * once.certified);
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
