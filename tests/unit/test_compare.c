/* Comparing values: what the formulas say, what is refused, and what never passes. */
#include "compared.h"
#include "testing.h"

enum { WIDTH = 40, HEIGHT = 25, COUNT = WIDTH * HEIGHT };

static double wavy(const void *user, double x, double y, double z) {
    return 0.5 + 0.3 * sin(0.4 * x) * cos(0.3 * y) + 0.1 * noise((uint32_t)(y * WIDTH + x));
}

static plane waves(void) {
    return make_plane(WIDTH, HEIGHT, 1, wavy, NULL);
}

TEST(differences_are_summed_as_their_formulas_say) {
    const double half = 0.5;
    FREED_BY(free_plane)
    plane golden = make_plane(WIDTH, HEIGHT, 1, flat, &half),
          values = make_plane(WIDTH, HEIGHT, 1, flat, &half);
    for (size_t i = 0; i < 30; ++i) { /* 30 of 1000 values are off, by 1/64 to 30/64 */
        values.values[31 * i + 7] += (float)(i + 1) / 64.0f;
    }
    const vsh_measures m = measure(&golden, &values, NULL);
    double squares = 0.0;
    for (int i = 1; i <= 30; ++i) {
        squares += i / 64.0 * i / 64.0;
    }
    assert_int_equal(m.count, COUNT);
    assert_true(m.range == 1.0);
    assert_near(m.value[VSH_MEASURE_RMSE], sqrt(squares / COUNT), 1e-12);
    assert_true(m.value[VSH_MEASURE_MAX] == 30.0 / 64.0);
    assert_int_equal(m.worst, 31 * 29 + 7);
    assert_true(m.worst_value[0] == 0.5 && m.worst_value[1] == 0.5 + 30.0 / 64.0);
    assert_true(m.value[VSH_MEASURE_P99] == 20.0 / 64.0); /* ten of the thousand are larger */
}

TEST(masked_values_count_for_nothing) {
    FREED_BY(free_plane)
    plane golden = make_plane(WIDTH, HEIGHT, 1, wavy, NULL),
          values = make_plane(WIDTH, HEIGHT, 1, wavy, NULL);
    uint8_t mask[COUNT];
    for (size_t i = 0; i < COUNT; ++i) {
        mask[i] = i % WIDTH < 20;
        values.values[i] += mask[i] ? 0.0f : 0.5f;
    }
    const vsh_measures m = measure(&golden, &values, mask);
    assert_int_equal(m.count, 20 * HEIGHT);
    assert_true(m.value[VSH_MEASURE_MAX] == 0.0 && m.value[VSH_MEASURE_RMSE] == 0.0);
    assert_true(m.value[VSH_MEASURE_LOST] == 0.0 && m.value[VSH_MEASURE_SHIFT] == 0.0);
    const vsh_limits limits = vsh_limits_default();
    assert_int_equal(vsh_compare_judge(&m, &limits), 0);
}

TEST(values_past_one_are_taken_by_the_largest_golden_one) {
    FREED_BY(free_plane)
    plane golden = make_plane(WIDTH, HEIGHT, 1, wavy, NULL),
          values = make_plane(WIDTH, HEIGHT, 1, wavy, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        values.values[i] = (float)(values.values[i] + 0.01 * noise((uint32_t)(i + 5000)));
    }
    golden.values[0] = values.values[0] = 1.0f;
    const vsh_measures one = measure(&golden, &values, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        golden.values[i] *= 8.0f;
        values.values[i] *= 8.0f;
    }
    const vsh_measures eight = measure(&golden, &values, NULL);
    assert_true(eight.range == 8.0);
    assert_memory_equal(one.value, eight.value, sizeof one.value);
}

/* --- what never passes */

TEST(a_value_that_is_not_finite_never_passes) {
    vsh_limits limits = vsh_limits_default();
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        limits.value[i] = INFINITY;
    }
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t k = 0; k < 12; ++k) {
        FREED_BY(free_plane)
        plane golden = make_plane(WIDTH, HEIGHT, 1, wavy, NULL),
              values = make_plane(WIDTH, HEIGHT, 1, wavy, NULL);
        plane *one = k % 2 == 0 ? &golden : &values;
        uint8_t mask[COUNT];
        memset(mask, 1, sizeof mask);
        mask[123] = k < 6; /* in padding, too */
        one->values[123] = one->values[700] = bad[k / 2 % 3];
        const vsh_measures m = measure(&golden, &values, mask);
        assert_int_equal(m.nonfinite[k % 2], 2);
        assert_int_equal(m.nonfinite[1 - k % 2], 0);
        assert_int_equal(m.nonfinite_first[k % 2], 123);
        assert_int_equal(m.count, COUNT - 2);
        assert_true(m.value[VSH_MEASURE_RMSE] == 0.0);
        assert_int_equal(vsh_compare_judge(&m, &limits), 1 << VSH_MEASURE_NONFINITE);
    }
}

TEST(nothing_compared_is_nothing_held) {
    FREED_BY(free_plane) plane golden = waves();
    uint8_t mask[COUNT] = {0};
    const vsh_measures m = measure(&golden, &golden, mask);
    const vsh_limits limits = vsh_limits_default();
    assert_int_equal(m.count, 0);
    assert_true(vsh_compare_judge(&m, &limits) != 0);
}

TEST(each_measure_is_held_to_its_own_limit) {
    const vsh_limits limits = vsh_limits_default();
    vsh_measures m = {.count = 1};
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        m.value[i] = limits.value[i]; /* what comes just to the limit holds */
    }
    assert_int_equal(vsh_compare_judge(&m, &limits), 0);
    for (int i = 1; i < VSH_MEASURE_COUNT; ++i) {
        vsh_measures off = m;
        off.value[i] = nextafter(limits.value[i], INFINITY);
        assert_int_equal(vsh_compare_judge(&off, &limits), 1 << i);
        off.value[i] = NAN; /* does not apply */
        assert_int_equal(vsh_compare_judge(&off, &limits), 0);
        assert_int_equal(vsh_find_name(VSH_NAMES_MEASURE, vsh_get_name(VSH_NAMES_MEASURE, i)), i);
    }
    assert_int_equal(vsh_find_name(VSH_NAMES_MEASURE, "rmse"), VSH_MEASURE_RMSE);
    assert_int_equal(vsh_find_name(VSH_NAMES_MEASURE, "rms"), -1);
    assert_null(vsh_get_name(VSH_NAMES_MEASURE, VSH_MEASURE_COUNT));
}

/* --- coverage */

TEST(coverage_is_counted_and_becomes_a_mask) {
    const float golden[6] = {1, 1, 1, 0, 0, 0.5f}, values[6] = {1, 0, 1, 1, 0, 0.75f};
    uint8_t mask[6];
    vsh_coverage c;
    vsh_compare_coverage(6, golden, values, mask, &c);
    assert_int_equal(c.golden, 3);
    assert_int_equal(c.values, 4);
    assert_int_equal(c.both, 2);
    assert_int_equal(c.differs, 3);
    assert_int_equal(c.first, 1);
    assert_near(c.share, 3.0 / 5.0, 1e-15);
    assert_memory_equal(mask, ((const uint8_t[6]){1, 0, 1, 0, 0, 0}), 6);
    vsh_compare_coverage(6, NULL, NULL, mask, &c);
    assert_true(c.both == 6 && c.differs == 0 && c.first == 6 && c.share == 0.0);
}

/* --- calls */

static int32_t stop(void *user, const char *stage, double fraction) {
    *(int *)user += strcmp(stage, "compare") == 0;
    return 1;
}

TEST(bad_calls_are_refused_by_name) {
    FREED_BY(free_plane) plane golden = waves();
    const vsh_compared good = pair_of(&golden, &golden, NULL);
    vsh_measures m;
    const struct {
        double step;
        int32_t reach, side;
        bool lacks;
        const char *word;
    } cases[] = {{0.0, 2, WIDTH, false, "step"},   {NAN, 2, WIDTH, false, "step"},
                 {0.1, -1, WIDTH, false, "reach"}, {0.1, 17, WIDTH, false, "reach"},
                 {0.1, 2, 0, false, "0 × "},       {0.1, 2, INT32_MAX, false, "2147483647 × "},
                 {0.1, 2, WIDTH, true, "NULL"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        vsh_compared c = good;
        c.size[0] = cases[i].side;
        c.values = cases[i].lacks ? NULL : c.values;
        vsh_compare_options options = vsh_compare_options_default();
        options.step = cases[i].step;
        options.reach = cases[i].reach;
        assert_fails(vsh_compare(&c, &options, NULL, &m, &failure), VSH_ERROR_ARGUMENT, cases[i].word);
    }
    vsh_run run = run_within(COUNT * 20);
    assert_int_equal(vsh_compare(&good, NULL, &run, &m, &failure), VSH_ERROR_LIMIT);
    int asked = 0;
    run = run_watched(stop, &asked);
    assert_int_equal(vsh_compare(&good, NULL, &run, &m, &failure), VSH_ERROR_CANCELLED);
    assert_int_equal(asked, 1);
}

/* --- Displacements: one is told where it is seen, and none along edges that tell nothing of it. */

enum { SIDE = 96 };

static vsh_measures compare(plane_fn *fn, const void *golden, const void *values) {
    return measure_as(SIDE, SIDE, 1, fn, golden, values);
}

/* A straight edge of a width and a slope, moved along y. */
typedef struct straight {
    double width, slope, moved;
} straight;

static double straight_at(const void *user, double x, double y, double z) {
    const straight *e = user;
    const double up = y - 48.1 - e->moved - e->slope * (x - 47.3);
    return fmin(1.0, fmax(0.0, 0.5 + up / sqrt(1.0 + e->slope * e->slope) / e->width));
}

TEST(an_edge_moves_across_itself_alone) {
    const double slopes[] = {0.0175, 0.1, 0.3, -0.5, 0.8, 1.4}, widths[] = {1e-6, 0.5, 1.0, 3.0, 8.0},
                 lengths[] = {0.02, 0.3};
    for (size_t i = 0; i < 6 * 5 * 2; ++i) {
        const double slope = slopes[i % 6], width = widths[i / 6 % 5], moved = lengths[i / 30];
        const straight golden = {width, slope, 0.0}, values = {width, slope, moved};
        const vsh_measures m = compare(straight_at, &golden, &values);
        const double across = moved / sqrt(1.0 + slope * slope);
        assert_true(m.value[VSH_MEASURE_SHIFT] <= across + (width < 0.1 ? 0.25 : 0.03)); /* hard ones jump */
        if (width >= 3.0) {
            assert_near(m.shift[0], -across * slope / sqrt(1.0 + slope * slope), 0.015);
            assert_near(m.shift[1], across / sqrt(1.0 + slope * slope), 0.015);
        }
    }
}

/* In space: a plane tells of one direction, two planes of two. */
static double planes_at(const void *user, double x, double y, double z) {
    const double *p = user; /* moved along x, y, z; whether there is a second plane */
    const double a = (y - p[1] - 9.3) - 0.1 * (x - p[0] - 11.0) - 0.2 * (z - p[2] - 8.0);
    const double b = p[3] > 0.0 ? x - p[0] - 11.4 : 9.0;
    return 0.5 + 0.5 * tanh(fmin(a, b) / 1.2);
}

TEST(what_planes_in_space_do_not_tell_is_no_displacement) {
    for (int second = 0; second < 2; ++second) {
        const double still[] = {0.0, 0.0, 0.0, second}, moved[] = {0.0, 0.4, 0.7, second};
        const vsh_measures m = measure_as(24, 20, 16, planes_at, still, moved);
        assert_near(m.shift[0], second ? 0.0 : -0.1 * 0.26 / 1.05, 0.01);
        assert_near(m.shift[1], second ? 0.25 : 0.26 / 1.05, 0.01);
        assert_near(m.shift[2], second ? -0.05 : -0.2 * 0.26 / 1.05, 0.005);
    }
}

/* The shadow of a tall thin box whose foot is hidden: two edges that soften with the distance from it. It is
 * turned by 1 degree, and leans to the side by so much a texel. */
static double tall_at(const void *user, double x, double y, double z) {
    const double lean = *(const double *)user, width = 0.6 + 0.02 * y;
    const double middle = 48.2 + (0.0175 + lean) * y;
    return 0.5 + 0.5 * tanh((fabs(x - middle) - 10.1) / width);
}

TEST(a_sun_that_hardly_moved_is_alike) {
    const vsh_limits limits = vsh_limits_default();
    const double none = 0.0;
    for (double lean = 2e-5; lean < 5e-4; lean *= 2.0) {
        const vsh_measures m = compare(tall_at, &none, &lean);
        assert_true(m.value[VSH_MEASURE_RMSE] > lean);
        assert_near(m.value[VSH_MEASURE_SHIFT], 48.0 * lean, 0.02);
        assert_int_equal(vsh_compare_judge(&m, &limits), 0);
    }
}

static double long_at(const void *user, double x, double y, double z) {
    const double moved = *(const double *)user;
    return 0.5 + 0.5 * tanh(fmax(fabs(x - 48.0 - moved) - 30.0, fabs(y - 44.0) - 5.0) / 1.5);
}

TEST(a_shadow_six_times_as_long_as_wide_is_seen_to_move_along_itself) {
    const double still = 0.0, moved = 0.7;
    const vsh_measures m = compare(long_at, &still, &moved);
    assert_near(m.shift[0], 0.7, 0.02);
    assert_near(m.shift[1], 0.0, 0.02);
}

/* A ramp at the left border, and a soft edge; both move by three texels. */
static double border_at(const void *user, double x, double y, double z) {
    const double at = x - *(const double *)user;
    return 0.5 + 0.5 * tanh((at - 60.0) / 6.0) - 0.5 * fmax(0.0, (8.0 - at) / 8.0);
}

TEST(what_comes_from_outside_is_not_explained) {
    const double still = 0.0, moved = -3.0;
    const vsh_measures m = compare(border_at, &still, &moved);
    double inside = 0.0,
           all = 0.0; /* squared differences of a row, of all values and of those that are moved back */
    for (int x = 1; x < SIDE - 1; ++x) {
        const double d = border_at(&moved, x, 0.0, 0.0) - border_at(&still, x, 0.0, 0.0);
        all += d * d;
        inside += x > 3 ? d * d : 0.0;
    }
    assert_near(m.shift[0], -3.0, 0.01);
    assert_near(m.explained, inside / all, 0.02);
    assert_true(inside / all < 0.9);
}
