/* Comparing values: what the formulas say, penumbrae, displacements, lost shadows and noise of known size,
 * what is refused, and what never passes. */
#include "handles.h"
#include "truth/metrics.h"

#define PI 3.14159265358979323846

/* A plane of two or three dimensions. */
typedef struct plane {
    int32_t size[3];
    size_t count;
    float *values;
} plane;

static void free_plane(plane *p) {
    free(p->values);
}

/* Value at a place, texels; `user` is the test's own. */
typedef double plane_fn(const void *user, double x, double y, double z);

static plane make_plane(int32_t width, int32_t height, int32_t depth, plane_fn *fn, const void *user) {
    plane p = {{width, height, depth}, (size_t)width * (size_t)height * (size_t)depth, NULL};
    p.values = malloc(p.count * sizeof *p.values);
    assert_non_null(p.values);
    for (size_t i = 0; i < p.count; ++i) {
        const size_t x = i % (size_t)width, y = i / (size_t)width % (size_t)height;
        p.values[i] = (float)fn(user, (double)x, (double)y, (double)(i / (size_t)width / (size_t)height));
    }
    return p;
}

static double flat(const void *user, double x, double y, double z) {
    return *(const double *)user;
}

static vsh_compared pair_of(const plane *golden, const plane *values, const uint8_t *mask) {
    assert_memory_equal(golden->size, values->size, sizeof golden->size);
    vsh_compared c = {{0}, golden->values, values->values, mask};
    memcpy(c.size, golden->size, sizeof c.size);
    return c;
}

/* Also checks that the number of threads changes no bit. */
static vsh_measures measure(const plane *golden, const plane *values, const uint8_t *mask) {
    const vsh_compared c = pair_of(golden, values, mask);
    const vsh_run one = run_on(1), four = run_on(4);
    vsh_measures m = {0}, other = {0};
    assert_ok(vsh_compare(&c, NULL, &one, &m, &failure));
    assert_ok(vsh_compare(&c, NULL, &four, &other, &failure));
    assert_memory_equal(&m, &other, sizeof m);
    return m;
}

/* Compares two pictures that one function draws from `golden` and `values`. */
static vsh_measures measure_as(int32_t width, int32_t height, int32_t depth, plane_fn *fn, const void *golden,
                               const void *values) {
    FREED_BY(free_plane)
    plane a = make_plane(width, height, depth, fn, golden), b = make_plane(width, height, depth, fn, values);
    const vsh_measures m = measure(&a, &b, NULL);
    return m;
}

/* -1 … 1, the same for the same counter. */
static double noise(uint32_t counter) {
    uint32_t x = counter * 2654435761u + 1u;
    x ^= x >> 15;
    x *= 2246822519u;
    x ^= x >> 13;
    return (double)x / 2147483647.5 - 1.0;
}

static uint32_t judge(const vsh_measures *m) {
    const vsh_limits limits = vshi_limits_default();
    return vshi_compare_judge(m, &limits);
}

static bool has(uint32_t failed, int measured) {
    return (failed >> measured & 1) != 0;
}

/* --- differences */

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
    double squares = 0.0;
    for (size_t i = 1; i <= 30; ++i) { /* 30 of 1000 values are off, by 1/64 to 30/64 */
        values.values[31 * (i - 1) + 7] += (float)i / 64.0f;
        squares += (double)(i * i) / (64.0 * 64.0);
    }
    const vsh_measures m = measure(&golden, &values, NULL);
    assert_int_equal(m.count, COUNT);
    assert_true(m.range == 1.0);
    assert_near(m.value[VSH_MEASURE_RMSE], sqrt(squares / COUNT), 1e-12);
    assert_true(m.value[VSH_MEASURE_MAX] == 30.0 / 64.0);
    assert_int_equal(m.worst, 31 * 29 + 7);
    assert_true(m.worst_value[0] == 0.5 && m.worst_value[1] == 0.5 + 30.0 / 64.0);
    assert_true(m.value[VSH_MEASURE_P99] == 20.0 / 64.0); /* ten of the thousand are larger */
}

TEST(masked_values_count_for_nothing) {
    FREED_BY(free_plane) plane golden = waves(), values = waves();
    uint8_t mask[COUNT];
    for (size_t i = 0; i < COUNT; ++i) {
        mask[i] = i % WIDTH < 20;
        values.values[i] += mask[i] ? 0.0f : 0.5f;
    }
    const vsh_measures m = measure(&golden, &values, mask);
    assert_int_equal(m.count, 20 * HEIGHT);
    assert_true(m.value[VSH_MEASURE_MAX] == 0.0 && m.value[VSH_MEASURE_RMSE] == 0.0);
    assert_true(m.value[VSH_MEASURE_LOST] == 0.0 && m.value[VSH_MEASURE_SHIFT] == 0.0);
    assert_int_equal(judge(&m), 0);
}

TEST(values_past_one_are_divided_by_the_largest_golden_value) {
    FREED_BY(free_plane) plane golden = waves(), values = waves();
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
    vsh_limits limits = vshi_limits_default();
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        limits.value[i] = INFINITY;
    }
    const float bad[] = {NAN, INFINITY, -INFINITY};
    for (size_t k = 0; k < 12; ++k) {
        FREED_BY(free_plane) plane golden = waves(), values = waves();
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
        assert_int_equal(vshi_compare_judge(&m, &limits), 1 << VSH_MEASURE_NONFINITE);
    }
}

TEST(a_comparison_of_no_values_never_passes) {
    FREED_BY(free_plane) plane golden = waves();
    uint8_t mask[COUNT] = {0};
    const vsh_measures m = measure(&golden, &golden, mask);
    assert_int_equal(m.count, 0);
    assert_true(judge(&m) != 0);
}

TEST(each_measure_has_its_own_limit) {
    const vsh_limits limits = vshi_limits_default();
    vsh_measures m = {.count = 1};
    memcpy(m.value, limits.value, sizeof m.value); /* a value at its limit passes */
    assert_int_equal(judge(&m), 0);
    for (int i = 1; i < VSH_MEASURE_COUNT; ++i) {
        vsh_measures off = m;
        off.value[i] = nextafter(limits.value[i], INFINITY);
        assert_int_equal(judge(&off), 1 << i);
        off.value[i] = NAN; /* does not apply */
        assert_int_equal(judge(&off), 0);
    }
}

/* --- calls */

TEST(coverage_is_counted_and_becomes_a_mask) {
    const float golden[6] = {1, 1, 1, 0, 0, 0.5f}, values[6] = {1, 0, 1, 1, 0, 0.75f};
    uint8_t mask[6];
    vsh_coverage c;
    vshi_compare_coverage(6, golden, values, mask, &c);
    assert_true(c.golden == 3 && c.values == 4 && c.both == 2 && c.differs == 3 && c.first == 1);
    assert_near(c.share, 3.0 / 5.0, 1e-15);
    assert_memory_equal(mask, ((const uint8_t[6]){1, 0, 1, 0, 0, 0}), 6);
    vshi_compare_coverage(6, NULL, NULL, mask, &c);
    assert_true(c.both == 6 && c.differs == 0 && c.first == 6 && c.share == 0.0);
}

TEST(bad_calls_are_refused_by_name) {
    FREED_BY(free_plane) plane golden = waves();
    const vsh_compared good = pair_of(&golden, &golden, NULL);
    vsh_measures m;
    const struct {
        double step, noise;
        int32_t reach, side;
        const char *word;
    } cases[] = {{0.0, 0.0, 2, WIDTH, "step"},       {NAN, 0.0, 2, WIDTH, "step"},
                 {0.1, 0.0, -1, WIDTH, "reach"},     {0.1, 0.0, 17, WIDTH, "reach"},
                 {0.1, 0.0, 2, 0, "0 × "},           {0.1, 0.0, 2, INT32_MAX, "2147483647 × "},
                 {0.1, -1e-9, 2, WIDTH, "noise of"}, {0.1, 1.001, 2, WIDTH, "noise of"},
                 {0.1, NAN, 2, WIDTH, "noise of"}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        vsh_compared c = good;
        c.size[0] = cases[i].side;
        vsh_compare_options options = vsh_compare_options_default();
        options.step = cases[i].step;
        options.noise = cases[i].noise;
        options.reach = cases[i].reach;
        assert_fails(vsh_compare(&c, &options, NULL, &m, &failure), VSH_ERROR_ARGUMENT, cases[i].word);
    }
    const vsh_run run = run_within(COUNT * 17);
    assert_fails(vsh_compare(&good, NULL, &run, &m, &failure), VSH_ERROR_LIMIT, "");
}

/* --- displacements: those that edges show, and no others */

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

/* In space: a plane shows one direction, two planes show two. */
static double planes_at(const void *user, double x, double y, double z) {
    const double *p = user; /* moved along x, y, z; whether there is a second plane */
    const double a = (y - p[1] - 9.3) - 0.1 * (x - p[0] - 11.0) - 0.2 * (z - p[2] - 8.0);
    const double b = p[3] > 0.0 ? x - p[0] - 11.4 : 9.0;
    return 0.5 + 0.5 * tanh(fmin(a, b) / 1.2);
}

TEST(a_displacement_that_planes_do_not_show_is_none) {
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
    const double none = 0.0;
    for (double lean = 2e-5; lean < 5e-4; lean *= 2.0) {
        const vsh_measures m = compare(tall_at, &none, &lean);
        assert_true(m.value[VSH_MEASURE_RMSE] > lean);
        assert_near(m.value[VSH_MEASURE_SHIFT], 48.0 * lean, 0.02);
        assert_int_equal(judge(&m), 0);
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

TEST(a_displacement_does_not_explain_shadows_from_outside) {
    const double still = 0.0, moved = -3.0;
    const vsh_measures m = compare(border_at, &still, &moved);
    double inside = 0.0, all = 0.0; /* squared differences of a row: of values moved back, and of all */
    for (int x = 1; x < SIDE - 1; ++x) {
        const double d = border_at(&moved, x, 0.0, 0.0) - border_at(&still, x, 0.0, 0.0);
        all += d * d;
        inside += x > 3 ? d * d : 0.0;
    }
    assert_near(m.shift[0], -3.0, 0.01);
    assert_near(m.explained, inside / all, 0.02);
    assert_true(inside / all < 0.9);
}

/* A soft ball. */
typedef struct ball {
    double middle[3], radius, soft;
} ball;

static const ball usual_ball = {{40.0, 45.0, 0.0}, 18.0, 2.5};

static double ball_at(const void *user, double x, double y, double z) {
    const ball *b = user;
    const double dx = x - b->middle[0], dy = y - b->middle[1], dz = z - b->middle[2];
    return 0.5 + 0.5 * tanh((sqrt(dx * dx + dy * dy + dz * dz) - b->radius) / b->soft);
}

TEST(a_displacement_is_found_with_its_direction_in_planes_and_in_space) {
    static const ball small_ball = {{15.0, 14.0, 12.0}, 7.0, 2.0};
    static const struct {
        double shift[3], soft;
        bool space;
    } cases[] = {{{1.0, 0.0, 0.0}, 2.5, false},  {{0.0, -1.0, 0.0}, 2.5, false},
                 {{0.3, -0.7, 0.0}, 2.5, false}, {{0.1, 0.05, 0.0}, 2.5, false},
                 {{-2.0, 1.5, 0.0}, 2.5, false}, {{1.0, 0.0, 0.0}, 0.01, false},
                 {{0.5, -1.0, 0.25}, 2.0, true}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const double *shift = cases[i].shift;
        const bool space = cases[i].space, soft = cases[i].soft > 1.0;
        ball golden = space ? small_ball : usual_ball, moved;
        golden.soft = cases[i].soft;
        moved = golden;
        for (int k = 0; k < 3; ++k) {
            moved.middle[k] += shift[k];
        }
        const vsh_measures m =
            space ? measure_as(32, 28, 24, ball_at, &golden, &moved) : compare(ball_at, &golden, &moved);
        assert_near(m.shift[0], shift[0], soft ? 0.02 : 0.1);
        assert_near(m.shift[1], shift[1], soft ? 0.02 : 0.05);
        assert_near(m.shift[2], shift[2], space ? 0.02 : 0.0);
        assert_true(soft || (m.lost.count == 0 && m.gained.count == 0));
        if (soft && !space) {
            assert_near(m.value[VSH_MEASURE_SHIFT], hypot(shift[0], shift[1]), 0.03);
            assert_true(m.explained > 0.95);
            assert_near(m.value[VSH_MEASURE_PENUMBRA], 0.0, 0.02);
        }
    }
}

TEST(a_larger_shadow_is_no_displacement) {
    ball larger = usual_ball;
    larger.radius = 18.6;
    const vsh_measures m = compare(ball_at, &usual_ball, &larger);
    assert_true(m.value[VSH_MEASURE_RMSE] > 0.01);
    assert_near(m.value[VSH_MEASURE_SHIFT], 0.0, 0.05);
}

/* The nearest number of 11 bits, as a half float holds it; of values down to 2^-14. */
static float as_half(float value) {
    int exponent;
    const double mantissa = frexp((double)value, &exponent);
    return (float)ldexp(nearbyint(ldexp(mantissa, 11)), exponent - 11);
}

TEST(bakes_that_differ_by_rounding_are_alike) {
    for (double soft = 0.01; soft < 10.0; soft *= 4.0) { /* from hard edges to wide ones */
        const ball golden = {{40.0, 45.0, 0.0}, 18.0, soft};
        FREED_BY(free_plane)
        plane a = make_plane(SIDE, SIDE, 1, ball_at, &golden),
              b = make_plane(SIDE, SIDE, 1, ball_at, &golden);
        for (int half = 0; half < 2; ++half) {
            for (uint32_t i = 0; i < SIDE * SIDE; ++i) {
                b.values[i] =
                    half ? as_half(b.values[i]) : nextafterf(b.values[i], noise(i) > 0.0 ? 2.0f : -2.0f);
            }
            const vsh_measures m = measure(&a, &b, NULL);
            assert_true(m.value[VSH_MEASURE_MAX] > (!half ? 0.0 : soft >= 1.0 ? 1e-4 : -1.0));
            assert_int_equal(judge(&m), 0);
        }
    }
}

/* --- penumbrae: a linear ramp from 0 to 1 over `width` texels, across an edge at `angle` */

typedef struct ramp {
    double width, angle, noise;
} ramp;

static double ramp_at(const void *user, double x, double y, double z) {
    const ramp *r = user;
    const double across = (x - 0.5 * SIDE + 0.3) * cos(r->angle) + (y - 0.5 * SIDE) * sin(r->angle);
    const double off = r->noise > 0.0 ? r->noise * noise((uint32_t)(y * SIDE + x)) : 0.0;
    return fmin(1.0, fmax(0.0, 0.5 + across / r->width)) + off;
}

static const double angles[] = {0.0, 0.3, PI / 4.0, 1.1, PI / 2.0, 2.5, PI, 4.0, 5.7};

TEST(a_ramp_is_as_wide_as_it_is_in_every_direction) {
    for (size_t i = 0; i < COUNT_OF(angles); ++i) {
        for (double width = 6.0; width <= 24.0; width *= 2.0) {
            const ramp r = {width, angles[i], 0.0};
            const vsh_measures m = compare(ramp_at, &r, &r);
            assert_true(m.pairs >= SIDE / 2);
            assert_true(angles[i] != 0.3 || m.pairs == SIDE); /* rows cross it, columns do not count */
            assert_near(m.width[0], 0.8 * width, 0.2);        /* from 10 % to 90 % */
            assert_true(m.value[VSH_MEASURE_PENUMBRA] == 0.0);
        }
    }
}

TEST(wider_and_narrower_penumbrae_are_measured_and_noise_does_not_change_them) {
    static const struct {
        double width, factor, noise, tolerance, shift;
    } cases[] = {{10.0, 0.5, 0.0, 0.04, 0.1},
                 {10.0, 0.9, 0.0, 0.04, 0.1},
                 {10.0, 1.1, 0.0, 0.04, 0.1},
                 {10.0, 2.0, 0.0, 0.04, 0.1},
                 {12.0, 1.0, 0.04, 0.03, 0.05}};
    for (size_t i = 0; i < COUNT_OF(angles) * COUNT_OF(cases); ++i) {
        const double angle = angles[i / COUNT_OF(cases)], width = cases[i % COUNT_OF(cases)].width,
                     factor = cases[i % COUNT_OF(cases)].factor, off = cases[i % COUNT_OF(cases)].noise;
        const ramp golden = {width, angle, 0.0}, values = {width * factor, angle, off};
        const vsh_measures m = compare(ramp_at, &golden, &values);
        assert_true(off > 0.0 || fabs(m.width[1] / m.width[0] - factor) <= 0.02);
        assert_near(m.value[VSH_MEASURE_PENUMBRA], fmax(factor, 1.0 / factor) - 1.0,
                    cases[i % COUNT_OF(cases)].tolerance);
        assert_near(m.value[VSH_MEASURE_SHIFT], 0.0, cases[i % COUNT_OF(cases)].shift);
    }
}

TEST(an_edge_that_is_cut_off_is_no_edge) {
    const ramp r = {30.0, 0.0, 0.0};
    FREED_BY(free_plane)
    plane golden = make_plane(SIDE, SIDE, 1, ramp_at, &r), values = make_plane(SIDE, SIDE, 1, ramp_at, &r);
    uint8_t mask[SIDE * SIDE];
    for (size_t i = 0; i < SIDE * SIDE; ++i) {
        mask[i] = i % SIDE < SIDE / 2 || i / SIDE < 8; /* up to the middle of the ramp, but for eight rows */
    }
    const vsh_measures m = measure(&golden, &values, mask);
    assert_int_equal(m.pairs, 8);
    assert_true(isnan(m.value[VSH_MEASURE_PENUMBRA])); /* too few to say anything */
}

/* Compares three planes with the tests' own formulas over all their values in a row. */
TEST(accuracy_is_the_measure_of_the_tests) {
    enum { PLANES = 3, ALL = PLANES * COUNT };
    static float truth[ALL], values[ALL], masked[ALL];
    static uint8_t mask[ALL];
    vsh_compared planes[PLANES];
    for (uint32_t i = 0; i < ALL; ++i) {
        truth[i] = (float)fmin(1.0, fmax(0.0, 0.5 + 0.7 * noise(i)));
        values[i] = (float)((double)truth[i] + 0.05 + 0.3 * noise(i + ALL));
        mask[i] = i % 7 != 0;
        masked[i] = mask[i];
    }
    for (size_t k = 0; k < PLANES; ++k) {
        planes[k] =
            (vsh_compared){{WIDTH, HEIGHT, 1}, truth + k * COUNT, values + k * COUNT, mask + k * COUNT};
    }
    vsh_accuracy a;
    assert_ok(vsh_compare_accuracy(planes, PLANES, NULL, &a, &failure));
    const truth_metrics expected = truth_compare(ALL, values, truth, masked);
    assert_true(a.count == expected.count);
    assert_near(a.rmse, expected.rmse, 1e-12);
    assert_near(a.p99, expected.p99, 1e-7);
    assert_near(a.max, expected.max, 1e-12);
    const vsh_run tight = run_within(10 * ALL - 1);
    assert_fails(vsh_compare_accuracy(planes, PLANES, &tight, &a, &failure), VSH_ERROR_LIMIT, "");
    values[1] = NAN;
    assert_ok(vsh_compare_accuracy(planes, 1, NULL, &a, &failure));
    assert_int_equal(a.count, COUNT - (COUNT + 6) / 7 - 1);
    assert_ok(vsh_compare_accuracy(planes, 0, NULL, &a, &failure));
    assert_true(a.count == 0 && a.rmse == 0.0);
}

/* --- lost shadows: a bar, `wide` texels from x = 30 on, 20 long from y = 40 on */

typedef struct bar {
    double wide, dark, moved;
} bar;

static double bar_at(const void *user, double x, double y, double z) {
    const bar *b = user;
    const bool within = x >= 30.0 + b->moved && x < 30.0 + b->moved + b->wide && y >= 40.0 && y < 60.0;
    const bool other = x + y < 40.0; /* another shadow, that stays */
    return within ? b->dark : other ? 0.0 : 1.0;
}

static void check_region(const vsh_region *region, int wide, double by) {
    const int32_t min[3] = {30, 40, 0}, max[3] = {30 + wide - 1, 59, 0};
    assert_int_equal(region->count, 20 * wide);
    assert_memory_equal(region->min, min, sizeof min);
    assert_memory_equal(region->max, max, sizeof max);
    assert_near(region->by, by, 1e-6);
}

TEST(a_lost_bar_is_a_lost_region_of_its_size_however_thin) {
    for (int wide = 1; wide <= 12; ++wide) {
        const bar there = {wide, 0.25, 0.0}, gone = {0.0, 0.25, 0.0};
        const vsh_measures lost = compare(bar_at, &there, &gone), gained = compare(bar_at, &gone, &there);
        check_region(&lost.lost, wide, 0.75);
        check_region(&gained.gained, wide, -0.75);
        assert_true(lost.gained.count == 0 && gained.lost.count == 0);
        assert_true(lost.value[VSH_MEASURE_LOST] == 20.0 * wide);
        assert_near(lost.value[VSH_MEASURE_SHIFT], 0.0, 0.02);
    }
}

TEST(a_bar_that_moved_within_reach_or_is_fainter_than_the_step_is_not_lost) {
    for (double moved = 0.0; moved <= 4.0; moved += 1.0) {
        const vsh_measures m = compare(bar_at, &(bar){2.0, 0.0, 0.0}, &(bar){2.0, 0.0, moved});
        const double far = moved > 2.0 ? moved < 4.0 ? moved - 2.0 : 2.0 : 0.0; /* columns past the reach */
        assert_int_equal(m.lost.count, 20 * far);
        assert_int_equal(m.gained.count, 20 * far);
    }
    const bar gone = {0.0, 1.0, 0.0};
    assert_int_equal(compare(bar_at, &(bar){3.0, 0.92, 0.0}, &gone).lost.count, 0);
    assert_int_equal(compare(bar_at, &(bar){3.0, 0.88, 0.0}, &gone).lost.count, 60);
}

TEST(faults_of_the_promised_size_fail) {
    ball shifted = usual_ball, wider = usual_ball;
    shifted.middle[0] += 0.25;
    wider.soft = 2.75;
    FREED_BY(free_plane)
    plane lit = make_plane(SIDE, SIDE, 1, ball_at, &usual_ball),
          spot = make_plane(SIDE, SIDE, 1, ball_at, &usual_ball);
    for (size_t i = 0; i < 4; ++i) { /* a shadow of four texels, in the lit corner */
        spot.values[(90 + i / 2) * SIDE + 90 + i % 2] = 0.0f;
    }
    const vsh_measures moved = compare(ball_at, &usual_ball, &shifted),
                       widened = compare(ball_at, &usual_ball, &wider), lost = measure(&spot, &lit, NULL);
    assert_true(has(judge(&moved), VSH_MEASURE_SHIFT) && has(judge(&widened), VSH_MEASURE_PENUMBRA));
    assert_true(has(judge(&lost), VSH_MEASURE_LOST));
}

static double ball_in_a_corner(const void *user, double x, double y, double z) {
    return x * x + y * y + z * z < 16.0 ? 0.0 : 1.0;
}

TEST(a_region_in_space_is_counted_in_voxels) {
    const double lit = 1.0;
    FREED_BY(free_plane)
    plane a = make_plane(12, 11, 10, ball_in_a_corner, NULL), b = make_plane(12, 11, 10, flat, &lit);
    const vsh_measures m = measure(&a, &b, NULL);
    uint64_t voxels = 0;
    for (size_t i = 0; i < a.count; ++i) {
        voxels += a.values[i] == 0.0f;
    }
    assert_int_equal(m.lost.count, voxels);
    assert_memory_equal(m.lost.max, ((const int32_t[3]){3, 3, 3}), sizeof m.lost.max);
}

/* --- estimates: known noise is no fault, and hides none that is larger */

enum { WIDE = 128, TEXELS = WIDE * WIDE };

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

static plane draw(picture p) {
    return make_plane(WIDE, WIDE, 1, picture_at, &p);
}

static const double error = 0.02; /* between the two */

/* Compares two planes and returns the measures that fail with limits that allow for noise. */
static uint32_t judge_noisy(const plane *golden, const plane *values, double allowed, vsh_measures *m) {
    vsh_limits limits = vshi_limits_default();
    vshi_limits_allow_noise(&limits, allowed);
    const vsh_compared c = pair_of(golden, values, NULL);
    assert_ok(vsh_compare(&c, &limits.options, NULL, m, &failure));
    return vshi_compare_judge(m, &limits);
}

/* The measures that fail between the usual picture and a noisy estimate of another one. Limits allow for a
 * part of the noise. */
static uint32_t failures(picture other, double made, double allowed) {
    FREED_BY(free_plane) plane golden = draw(usual), values = draw(other);
    for (uint32_t i = 0; i < TEXELS; ++i) {
        golden.values[i] += (float)(made * sqrt(0.5) * normal(i));
        values.values[i] += (float)(made * sqrt(0.5) * normal(i + TEXELS));
    }
    vsh_measures m;
    return judge_noisy(&golden, &values, allowed, &m);
}

TEST(estimates_are_alike_within_their_errors_and_not_beyond) {
    assert_int_equal(failures(usual, error, error), 0);
    assert_int_equal(failures(usual, 0.0, 0.0), 0);
    const uint32_t strict = failures(usual, error, 0.0), twice = failures(usual, 2.0 * error, error);
    assert_true(has(strict, VSH_MEASURE_RMSE) && has(strict, VSH_MEASURE_P99));
    assert_true(has(twice, VSH_MEASURE_RMSE) && has(twice, VSH_MEASURE_P99));
}

TEST(faults_are_found_in_noise) {
    picture moved = usual, softer = usual, lost = usual;
    moved.shift = 1.0;
    softer.soft *= 1.1;
    lost.shadows = 3;
    assert_true(has(failures(moved, error, error), VSH_MEASURE_SHIFT));
    assert_true(has(failures(softer, error, error), VSH_MEASURE_PENUMBRA));
    assert_true(has(failures(lost, error, error), VSH_MEASURE_LOST));
}

/* Texels of a patch that got lighter by so much. */
static double lost_by(double off, double allowed) {
    const double grey = 0.5;
    FREED_BY(free_plane)
    plane golden = make_plane(WIDE, WIDE, 1, flat, &grey), values = make_plane(WIDE, WIDE, 1, flat, &grey);
    for (size_t i = 0; i < 9; ++i) {
        values.values[(40 + i / 3) * WIDE + 50 + i % 3] += (float)off;
    }
    vsh_measures m;
    judge_noisy(&golden, &values, allowed, &m);
    return m.value[VSH_MEASURE_LOST];
}

TEST(noise_makes_no_lost_caster) {
    assert_true(lost_by(0.15, 0.0) == 9.0 && lost_by(0.15, error) == 0.0 && lost_by(0.16, error) == 9.0);
}

TEST(limits_are_widened_as_documented) {
    const vsh_limits before = vshi_limits_default();
    vsh_limits limits = before, expected = before;
    vshi_limits_allow_noise(&limits, 0.0);
    assert_memory_equal(limits.value, before.value, sizeof before.value);
    vshi_limits_allow_noise(&limits, 0.03);
    assert_true(limits.options.noise == 0.03);
    expected.value[VSH_MEASURE_RMSE] = sqrt(0.004 * 0.004 + 0.03 * 0.03);
    expected.value[VSH_MEASURE_MAX] = 0.25 + 0.15;
    expected.value[VSH_MEASURE_P99] = 0.02 + 0.078;
    expected.value[VSH_MEASURE_PENUMBRA] = 0.03 + 0.0375;
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        assert_near(limits.value[i], expected.value[i], 1e-15);
    }
}

/* Values that hardly reach a mark: dark, a plateau that nearly is light from 20 to 100, dark, light from 110.
 */
static double step_at(const void *user, double x, double y, double z) {
    const double *s = user; /* the plateau's middle, and how much more it is at the right end of it */
    return x < 20.0 ? 0.0 : x < 100.0 ? s[0] + s[1] * (x - 60.0) / 40.0 : x < 110.0 ? 0.0 : 1.0;
}

TEST(a_width_that_depends_on_the_mark_is_not_measured) {
    const double crawls[] = {0.9, 0.01}, jumps[] = {0.95, 0.0};
    /* not the pair from 19 to 60 */
    assert_int_equal(measure_as(WIDE, WIDE, 1, step_at, crawls, crawls).pairs, 2 * WIDE);
    assert_int_equal(measure_as(WIDE, WIDE, 1, step_at, jumps, jumps).pairs, 3 * WIDE);
}
