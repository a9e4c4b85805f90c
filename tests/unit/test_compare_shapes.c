/* Comparing shapes: penumbrae of known width, displacements of known length, shadows that are gone. */
#include "compared.h"
#include "testing.h"
#include "truth/metrics.h"

enum { SIDE = 96 };

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

static vsh_measures compare_ramps(ramp golden, ramp values) {
    return measure_as(SIDE, SIDE, 1, ramp_at, &golden, &values);
}

static const double angles[] = {0.0, 0.3, PI / 4.0, 1.1, PI / 2.0, 2.5, PI, 4.0, 5.7};
enum { ANGLES = sizeof angles / sizeof angles[0] };

TEST(a_ramp_is_as_wide_as_it_is_in_every_direction) {
    for (size_t i = 0; i < ANGLES; ++i) {
        for (double width = 6.0; width <= 24.0; width *= 2.0) {
            const vsh_measures m =
                compare_ramps((ramp){width, angles[i], 0.0}, (ramp){width, angles[i], 0.0});
            assert_true(m.pairs >= SIDE / 2);
            assert_true(angles[i] != 0.3 || m.pairs == SIDE); /* rows cross it, columns do not count */
            assert_near(m.width[0], 0.8 * width, 0.2);        /* from 10 % to 90 % */
            assert_true(m.value[VSH_MEASURE_PENUMBRA] == 0.0);
        }
    }
}

TEST(wider_and_narrower_penumbrae_are_told_by_how_much) {
    const double factors[] = {0.5, 0.9, 1.1, 2.0};
    for (size_t i = 0; i < ANGLES; ++i) {
        for (size_t k = 0; k < sizeof factors / sizeof factors[0]; ++k) {
            const ramp golden = {10.0, angles[i], 0.0}, values = {10.0 * factors[k], angles[i], 0.0};
            const vsh_measures m = compare_ramps(golden, values);
            const double ratio = factors[k] > 1.0 ? factors[k] : 1.0 / factors[k];
            assert_near(m.width[1] / m.width[0], factors[k], 0.02);
            assert_near(m.value[VSH_MEASURE_PENUMBRA], ratio - 1.0, 0.04);
            assert_near(m.value[VSH_MEASURE_SHIFT], 0.0, 0.1);
        }
    }
}

/* Of three planes together, by the tests' own formulas over all their values in a row. */
TEST(accuracy_is_what_the_tests_measure_by) {
    enum { PLANES = 3, WIDTH = 40, HEIGHT = 25, COUNT = WIDTH * HEIGHT, ALL = PLANES * COUNT };
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
    assert_int_equal(a.count, expected.count);
    assert_int_equal(a.penumbra, expected.penumbra);
    assert_true(a.penumbra > 0 && a.penumbra < a.count);
    assert_near(a.rmse, expected.rmse, 1e-12);
    assert_near(a.penumbra_rmse, expected.penumbra_rmse, 1e-12);
    assert_near(a.bias, expected.bias, 1e-12);
    assert_near(a.p95, expected.p95, 1e-7);
    assert_near(a.p99, expected.p99, 1e-7);
    assert_near(a.max, expected.max, 1e-12);
    const vsh_run tight = {.struct_size = sizeof tight, .memory_limit = 10 * ALL - 1};
    assert_int_equal(vsh_compare_accuracy(planes, PLANES, &tight, &a, &failure), VSH_ERROR_LIMIT);
    values[1] = NAN;
    assert_ok(vsh_compare_accuracy(planes, 1, NULL, &a, &failure));
    assert_int_equal(a.count, COUNT - (COUNT + 6) / 7 - 1);
    assert_ok(vsh_compare_accuracy(planes, 0, NULL, &a, &failure));
    assert_true(a.count == 0 && a.rmse == 0.0 && isnan(a.width_error));
}

/* A penumbra of 30 texels from 0 to 1: 24 of them between 0.1 and 0.9. */
TEST(a_penumbra_that_is_gone_is_off_by_all_of_its_width) {
    const ramp r = {30.0, 0.0, 0.0};
    const double lit = 1.0, factors[] = {1.0, 0.5, 1.2};
    const plane truth = make_plane(SIDE, SIDE, 1, ramp_at, &r);
    vsh_accuracy a;
    for (size_t i = 0; i <= sizeof factors / sizeof factors[0]; ++i) {
        const bool gone = i == sizeof factors / sizeof factors[0];
        const ramp other = {30.0 * (gone ? 1.0 : factors[i]), 0.0, 0.0};
        const plane values =
            gone ? make_plane(SIDE, SIDE, 1, flat, &lit) : make_plane(SIDE, SIDE, 1, ramp_at, &other);
        const vsh_compared compared = pair_of(&truth, &values, NULL);
        assert_ok(vsh_compare_accuracy(&compared, 1, NULL, &a, &failure));
        assert_near(a.width_error, gone ? 1.0 : fabs(factors[i] - 1.0), 1e-4);
        free(values.values);
    }
    free(truth.values);
}

TEST(noise_does_not_change_a_penumbras_width) {
    for (size_t i = 0; i < ANGLES; ++i) {
        const vsh_measures m = compare_ramps((ramp){12.0, angles[i], 0.0}, (ramp){12.0, angles[i], 0.04});
        assert_near(m.value[VSH_MEASURE_PENUMBRA], 0.0, 0.03);
        assert_near(m.value[VSH_MEASURE_SHIFT], 0.0, 0.05);
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

/* --- displacement: a soft ball */

typedef struct ball {
    double middle[3], radius, soft;
} ball;

static double ball_at(const void *user, double x, double y, double z) {
    const ball *b = user;
    const double off =
        sqrt((x - b->middle[0]) * (x - b->middle[0]) + (y - b->middle[1]) * (y - b->middle[1]) +
             (z - b->middle[2]) * (z - b->middle[2]));
    return 0.5 + 0.5 * tanh((off - b->radius) / b->soft);
}

static vsh_measures compare_balls(ball golden, ball values) {
    return measure_as(SIDE, SIDE, 1, ball_at, &golden, &values);
}

TEST(a_displacement_is_found_with_its_direction) {
    const double shifts[][2] = {{1.0, 0.0}, {0.0, -1.0}, {0.3, -0.7}, {0.1, 0.05}, {-2.0, 1.5}};
    for (size_t i = 0; i < sizeof shifts / sizeof shifts[0]; ++i) {
        const ball golden = {{40.0, 45.0, 0.0}, 18.0, 2.5};
        const ball moved = {{40.0 + shifts[i][0], 45.0 + shifts[i][1], 0.0}, 18.0, 2.5};
        const vsh_measures m = compare_balls(golden, moved);
        assert_near(m.shift[0], shifts[i][0], 0.02);
        assert_near(m.shift[1], shifts[i][1], 0.02);
        assert_true(m.shift[2] == 0.0);
        assert_near(m.value[VSH_MEASURE_SHIFT], hypot(shifts[i][0], shifts[i][1]), 0.03);
        assert_true(m.explained > 0.95);
        assert_near(m.value[VSH_MEASURE_PENUMBRA], 0.0, 0.02);
    }
}

TEST(a_displacement_is_found_in_space) {
    const ball golden = {{15.0, 14.0, 12.0}, 7.0, 2.0}, moved = {{15.5, 13.0, 12.25}, 7.0, 2.0};
    const vsh_measures m = measure_as(32, 28, 24, ball_at, &golden, &moved);
    assert_near(m.shift[0], 0.5, 0.02);
    assert_near(m.shift[1], -1.0, 0.02);
    assert_near(m.shift[2], 0.25, 0.02);
}

TEST(hard_edges_are_found_to_have_moved_by_a_texel) {
    const ball golden = {{40.0, 45.0, 0.0}, 18.0, 0.01}, moved = {{41.0, 45.0, 0.0}, 18.0, 0.01};
    const vsh_measures m = compare_balls(golden, moved);
    assert_near(m.shift[0], 1.0, 0.1);
    assert_near(m.shift[1], 0.0, 0.05);
    assert_true(m.lost.count == 0 && m.gained.count == 0);
}

TEST(a_larger_shadow_is_no_displacement) {
    const ball golden = {{40.0, 45.0, 0.0}, 18.0, 2.5}, larger = {{40.0, 45.0, 0.0}, 18.6, 2.5};
    const vsh_measures m = compare_balls(golden, larger);
    assert_true(m.value[VSH_MEASURE_RMSE] > 0.01);
    assert_near(m.value[VSH_MEASURE_SHIFT], 0.0, 0.05);
}

/* --- rounding */

/* The nearest number of 11 bits, as a half float holds it; of values down to 2^-14. */
static float as_half(float value) {
    int exponent;
    const double mantissa = frexp((double)value, &exponent);
    return (float)ldexp(nearbyint(ldexp(mantissa, 11)), exponent - 11);
}

TEST(bakes_that_differ_by_rounding_are_alike) {
    const vsh_limits limits = vsh_limits_default();
    for (double soft = 0.01; soft < 10.0; soft *= 4.0) { /* from hard edges to wide ones */
        const ball golden = {{40.0, 45.0, 0.0}, 18.0, soft};
        FREED_BY(free_plane)
        plane a = make_plane(SIDE, SIDE, 1, ball_at, &golden),
              b = make_plane(SIDE, SIDE, 1, ball_at, &golden);
        for (uint32_t i = 0; i < SIDE * SIDE; ++i) {
            b.values[i] = nextafterf(b.values[i], noise(i) > 0.0 ? 2.0f : -2.0f);
        }
        vsh_measures m = measure(&a, &b, NULL);
        assert_true(m.value[VSH_MEASURE_MAX] > 0.0);
        assert_int_equal(vsh_compare_judge(&m, &limits), 0);
        for (uint32_t i = 0; i < SIDE * SIDE; ++i) {
            b.values[i] = as_half(b.values[i]);
        }
        m = measure(&a, &b, NULL);
        assert_true(soft < 1.0 || m.value[VSH_MEASURE_MAX] > 1e-4);
        assert_int_equal(vsh_compare_judge(&m, &limits), 0);
    }
}

/* --- what is gone: a bar of shadow, `wide` texels from x = 30 on, 20 long from y = 40 on */

typedef struct bar {
    double wide, dark, moved;
} bar;

static double bar_at(const void *user, double x, double y, double z) {
    const bar *b = user;
    const bool within = x >= 30.0 + b->moved && x < 30.0 + b->moved + b->wide && y >= 40.0 && y < 60.0;
    const bool other = x + y < 40.0; /* another shadow, that stays */
    return within ? b->dark : other ? 0.0 : 1.0;
}

static vsh_measures compare_bars(bar golden, bar values) {
    return measure_as(SIDE, SIDE, 1, bar_at, &golden, &values);
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
        const vsh_measures lost = compare_bars(there, gone), gained = compare_bars(gone, there);
        check_region(&lost.lost, wide, 0.75);
        assert_int_equal(lost.gained.count, 0);
        assert_true(lost.value[VSH_MEASURE_LOST] == 20.0 * wide);
        check_region(&gained.gained, wide, -0.75);
        assert_int_equal(gained.lost.count, 0);
        assert_near(lost.value[VSH_MEASURE_SHIFT], 0.0, 0.02);
    }
}

TEST(what_moved_within_reach_is_not_lost) {
    for (double moved = 0.0; moved <= 4.0; moved += 1.0) {
        const vsh_measures m = compare_bars((bar){2.0, 0.0, 0.0}, (bar){2.0, 0.0, moved});
        const double far = moved > 2.0 ? moved < 4.0 ? moved - 2.0 : 2.0 : 0.0; /* columns past the reach */
        assert_int_equal(m.lost.count, 20 * far);
        assert_int_equal(m.gained.count, 20 * far);
    }
}

TEST(a_shadow_below_the_step_is_not_seen) {
    const bar gone = {0.0, 1.0, 0.0};
    assert_int_equal(compare_bars((bar){3.0, 0.92, 0.0}, gone).lost.count, 0);
    assert_int_equal(compare_bars((bar){3.0, 0.88, 0.0}, gone).lost.count, 60);
}

TEST(faults_of_the_promised_size_fail) {
    const vsh_limits limits = vsh_limits_default();
    const ball still = {{40.0, 45.0, 0.0}, 18.0, 2.5}, shifted = {{40.25, 45.0, 0.0}, 18.0, 2.5};
    const ball wider = {{40.0, 45.0, 0.0}, 18.0, 2.75};
    assert_true(
        vsh_compare_judge((vsh_measures[]){compare_balls(still, shifted)}, &limits) >> VSH_MEASURE_SHIFT & 1);
    assert_true(vsh_compare_judge((vsh_measures[]){compare_balls(still, wider)}, &limits) >>
                    VSH_MEASURE_PENUMBRA &
                1);
    FREED_BY(free_plane)
    plane lit = make_plane(SIDE, SIDE, 1, ball_at, &still), spot = make_plane(SIDE, SIDE, 1, ball_at, &still);
    for (size_t i = 0; i < 4; ++i) { /* a shadow of four texels, in the lit corner */
        spot.values[(90 + i / 2) * SIDE + 90 + i % 2] = 0.0f;
    }
    assert_true(vsh_compare_judge((vsh_measures[]){measure(&spot, &lit, NULL)}, &limits) >> VSH_MEASURE_LOST &
                1);
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
