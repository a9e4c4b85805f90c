/* Comparing estimates: noise that is known of is no fault, and hides none that is larger. */
#include "compared.h"
#include "testing.h"

enum { SIDE = 128, COUNT = SIDE * SIDE };

/* Nearly normal, of a standard error of 1: the sum of twelve uniform values. */
static double normal(uint32_t counter) {
    double sum = 0.0;
    for (uint32_t i = 0; i < 12; ++i) {
        sum += 0.5 * noise(12 * counter + i);
    }
    return sum;
}

/* Round shadows, soft at their edges. */
typedef struct picture {
    double radius, soft, shift;
    int shadows;
} picture;

static const picture usual = {14.0, 5.0, 0.0, 4};

static double picture_at(const void *user, double x, double y, double z) {
    const picture *p = user;
    double lit = 1.0;
    for (int i = 0; i < p->shadows; ++i) {
        const double dx = x - 32.0 - 64.0 * (i % 2) - p->shift, dy = y - 32.0 - 64.0 * (double)(i / 2);
        lit = fmin(lit, 0.5 + (sqrt(dx * dx + dy * dy) - p->radius) / p->soft);
    }
    return 0.1 + 0.8 * fmax(0.0, lit);
}

static const double error = 0.02; /* between the two */

/* Compares two planes, frees them, and returns the measures that fail with limits that allow for noise. */
static uint32_t judge(plane golden, plane values, double allowed, vsh_measures *m) {
    vsh_limits limits = vsh_limits_default();
    vsh_limits_allow_noise(&limits, allowed);
    const vsh_compared c = pair_of(&golden, &values, NULL);
    assert_ok(vsh_compare(&c, &limits.options, NULL, m, &failure));
    free(golden.values);
    free(values.values);
    return vsh_compare_judge(m, &limits);
}

/* What fails where the picture is the usual one and the other was estimated with noise, and limits allow for
 * some of it. */
static uint32_t failures(picture other, double made, double allowed) {
    plane golden = make_plane(SIDE, SIDE, 1, picture_at, &usual),
          values = make_plane(SIDE, SIDE, 1, picture_at, &other);
    for (uint32_t i = 0; i < COUNT; ++i) {
        golden.values[i] += (float)(made * sqrt(0.5) * normal(i));
        values.values[i] += (float)(made * sqrt(0.5) * normal(i + COUNT));
    }
    vsh_measures m;
    return judge(golden, values, allowed, &m);
}

static bool has(uint32_t failed, int measure) {
    return (failed >> measure & 1) != 0;
}

TEST(estimates_are_alike_within_their_errors_and_not_beyond) {
    assert_int_equal(failures(usual, error, error), 0);
    assert_int_equal(failures(usual, 0.0, 0.0), 0);
    const uint32_t strict = failures(usual, error, 0.0), twice = failures(usual, 2.0 * error, error);
    assert_true(has(strict, VSH_MEASURE_RMSE) && has(strict, VSH_MEASURE_P99));
    assert_true(has(twice, VSH_MEASURE_RMSE) && has(twice, VSH_MEASURE_P99));
}

TEST(faults_are_told_through_the_noise) {
    picture moved = usual, softer = usual, lost = usual;
    moved.shift = 1.0;
    softer.soft *= 1.1;
    lost.shadows = 3;
    assert_true(has(failures(moved, error, error), VSH_MEASURE_SHIFT));
    assert_true(has(failures(softer, error, error), VSH_MEASURE_PENUMBRA));
    assert_true(has(failures(lost, error, error), VSH_MEASURE_LOST));
}

/* Measures that say what became of a shadow. */
static const uint32_t shapes =
    1u << VSH_MEASURE_PENUMBRA | 1u << VSH_MEASURE_SHIFT | 1u << VSH_MEASURE_LOST | 1u << VSH_MEASURE_GAINED;

TEST(noise_that_is_not_allowed_is_no_change_of_a_shadow) {
    const double softs[] = {2.5, 5.0, 12.0, 30.0};
    for (int s = 0; s < 4; ++s) {
        for (int where = 0; where < 3; ++where) { /* everywhere, cut off at 0.1 and 0.9, in penumbrae alone */
            picture p = usual;
            p.soft = softs[s];
            plane golden = make_plane(SIDE, SIDE, 1, picture_at, &p),
                  values = make_plane(SIDE, SIDE, 1, picture_at, &p);
            for (uint32_t i = 0; i < COUNT; ++i) {
                const double v = (double)golden.values[i], noisy = v + 0.05 * normal(i);
                const bool penumbra = v > 0.101 && v < 0.899;
                values.values[i] = (float)(where == 0               ? noisy
                                           : where == 1 || penumbra ? fmin(fmax(noisy, 0.1), 0.9)
                                                                    : v);
            }
            vsh_measures m;
            const uint32_t failed = judge(golden, values, 0.0, &m);
            assert_true(has(failed, VSH_MEASURE_RMSE) && has(failed, VSH_MEASURE_P99));
            assert_int_equal(failed & shapes, 0);
            assert_true(m.noise_share > 0.6);
        }
    }
}

/* The usual picture, by v^gamma times `gain`; `shadows` of it are left. */
static uint32_t toned(double gamma, double gain, int shadows, double soft, vsh_measures *m) {
    picture p = usual, q = usual;
    p.soft = q.soft = soft;
    q.shadows = shadows;
    plane golden = make_plane(SIDE, SIDE, 1, picture_at, &p),
          values = make_plane(SIDE, SIDE, 1, picture_at, &q);
    for (uint32_t i = 0; i < COUNT; ++i) {
        values.values[i] = (float)(gain * pow((double)values.values[i], gamma));
    }
    return judge(golden, values, 0.0, m);
}

TEST(a_curve_over_the_values_is_no_change_of_a_shadow) {
    const double tones[][2] = {{2.2, 1.0}, {1.0 / 2.2, 1.0}, {1.1, 1.0}, {1.0, 0.8}, {1.0, 1.1}};
    for (size_t i = 0; i < sizeof tones / sizeof tones[0]; ++i) {
        for (double soft = 2.5; soft < 25.0; soft *= 2.0) {
            vsh_measures m;
            const uint32_t failed = toned(tones[i][0], tones[i][1], 4, soft, &m);
            assert_true(has(failed, VSH_MEASURE_RMSE));
            assert_int_equal(failed & shapes, 0);
            assert_near(m.curve[1][0], 0.5, 1e-3);
            assert_near(m.curve[1][1], tones[i][1] * pow(0.5, tones[i][0]), 0.01);
        }
    }
    vsh_measures m;
    assert_true(has(toned(1.0 / 2.2, 1.0, 3, 5.0, &m), VSH_MEASURE_LOST));
    picture softer = usual;
    softer.soft *= 0.8; /* a curve, too: what is light gets lighter and what is dark darker */
    const uint32_t narrower = judge(make_plane(SIDE, SIDE, 1, picture_at, &usual),
                                    make_plane(SIDE, SIDE, 1, picture_at, &softer), 0.0, &m);
    assert_true(has(narrower, VSH_MEASURE_PENUMBRA) && m.curve[2][0] == 0.0);
}

/* Texels of a patch that got lighter by so much. */
static double lost_by(double off, double allowed) {
    const double grey = 0.5;
    FREED_BY(free_plane)
    plane golden = make_plane(SIDE, SIDE, 1, flat, &grey), values = make_plane(SIDE, SIDE, 1, flat, &grey);
    for (size_t i = 0; i < 9; ++i) {
        values.values[(40 + i / 3) * SIDE + 50 + i % 3] += (float)off;
    }
    vsh_compare_options options = vsh_compare_options_default();
    options.noise = allowed;
    const vsh_compared c = pair_of(&golden, &values, NULL);
    vsh_measures m;
    assert_ok(vsh_compare(&c, &options, NULL, &m, &failure));
    return m.value[VSH_MEASURE_LOST];
}

TEST(what_noise_makes_is_no_lost_caster) {
    assert_true(lost_by(0.15, 0.0) == 9.0 && lost_by(0.15, error) == 0.0 && lost_by(0.16, error) == 9.0);
}

TEST(limits_are_widened_as_documented) {
    const vsh_limits before = vsh_limits_default();
    vsh_limits limits = before;
    vsh_limits_allow_noise(&limits, 0.0);
    assert_memory_equal(limits.value, before.value, sizeof before.value);
    vsh_limits_allow_noise(&limits, 0.03);
    assert_true(limits.options.noise == 0.03);
    assert_near(limits.value[VSH_MEASURE_RMSE], sqrt(0.004 * 0.004 + 0.03 * 0.03), 1e-15);
    assert_near(limits.value[VSH_MEASURE_MAX], 0.25 + 0.15, 1e-15);
    assert_near(limits.value[VSH_MEASURE_P99], 0.02 + 0.078, 1e-15);
    assert_near(limits.value[VSH_MEASURE_PENUMBRA], 0.03 + 0.0375, 1e-15);
    const int kept[] = {VSH_MEASURE_SHIFT, VSH_MEASURE_LOST, VSH_MEASURE_GAINED};
    for (size_t i = 0; i < sizeof kept / sizeof kept[0]; ++i) {
        assert_true(limits.value[kept[i]] == before.value[kept[i]]);
    }
}

TEST(noise_is_a_share_of_the_range) {
    FREED_BY(free_plane) plane golden = make_plane(SIDE, SIDE, 1, picture_at, &usual);
    const vsh_compared c = pair_of(&golden, &golden, NULL);
    const double wrong[] = {-1e-9, 1.001, NAN, INFINITY};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        vsh_compare_options options = vsh_compare_options_default();
        options.noise = wrong[i];
        vsh_measures m;
        assert_fails(vsh_compare(&c, &options, NULL, &m, &failure), VSH_ERROR_ARGUMENT, "noise of");
    }
}

/* --- values that hardly reach a mark: dark, a plateau that nearly is light from 20 to 100, dark, light from
 * 110 */

typedef struct step {
    double plateau, slope; /* its middle, and how much more it is at the right end of it */
} step;

static double step_at(const void *user, double x, double y, double z) {
    const step *s = user;
    return x < 20.0 ? 0.0 : x < 100.0 ? s->plateau + s->slope * (x - 60.0) / 40.0 : x < 110.0 ? 0.0 : 1.0;
}

static vsh_measures compare_steps(step golden, step values) {
    FREED_BY(free_plane)
    plane a = make_plane(SIDE, SIDE, 1, step_at, &golden), b = make_plane(SIDE, SIDE, 1, step_at, &values);
    const vsh_measures m = measure(&a, &b, NULL);
    return m;
}

TEST(a_width_that_hangs_on_the_mark_is_not_measured) {
    const step crawls = {0.9, 0.01}, jumps = {0.95, 0.0};
    const vsh_measures m = compare_steps(crawls, crawls), sharp = compare_steps(jumps, jumps);
    assert_int_equal(m.pairs, 2 * SIDE); /* not the one from 19 to 60 */
    assert_int_equal(sharp.pairs, 3 * SIDE);
}
