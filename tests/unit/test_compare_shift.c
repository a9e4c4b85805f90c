/* Displacements: one is told where it is seen, and none along edges that tell nothing of it. */
#include "compared.h"

enum { SIDE = 96 };

static vsh_measures compare(plane_fn *fn, const void *golden, const void *values) {
    plane a = make_plane(SIDE, SIDE, 1, fn, golden), b = make_plane(SIDE, SIDE, 1, fn, values);
    const vsh_measures m = measure(&a, &b, NULL);
    free(a.values);
    free(b.values);
    return m;
}

/* A straight edge of a width and a slope, moved along y. */
typedef struct straight {
    double width, slope, moved;
} straight;

static double straight_at(const void *user, double x, double y, double z) {
    const straight *e = user;
    (void)z;
    const double up = y - 48.1 - e->moved - e->slope * (x - 47.3);
    return fmin(1.0, fmax(0.0, 0.5 + up / sqrt(1.0 + e->slope * e->slope) / e->width));
}

static void an_edge_moves_across_itself_alone(void **unused) {
    (void)unused;
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

static void what_planes_in_space_do_not_tell_is_no_displacement(void **unused) {
    (void)unused;
    for (int second = 0; second < 2; ++second) {
        const double still[] = {0.0, 0.0, 0.0, second}, moved[] = {0.0, 0.4, 0.7, second};
        plane a = make_plane(24, 20, 16, planes_at, still), b = make_plane(24, 20, 16, planes_at, moved);
        const vsh_measures m = measure(&a, &b, NULL);
        assert_near(m.shift[0], second ? 0.0 : -0.1 * 0.26 / 1.05, 0.01);
        assert_near(m.shift[1], second ? 0.25 : 0.26 / 1.05, 0.01);
        assert_near(m.shift[2], second ? -0.05 : -0.2 * 0.26 / 1.05, 0.005);
        free(a.values);
        free(b.values);
    }
}

/* The shadow of a tall thin box whose foot is hidden: two edges that soften with the distance from it. It is
 * turned by 1 degree, and leans to the side by so much a texel. */
static double tall_at(const void *user, double x, double y, double z) {
    const double lean = *(const double *)user, width = 0.6 + 0.02 * y;
    const double middle = 48.2 + (0.0175 + lean) * y;
    (void)z;
    return 0.5 + 0.5 * tanh((fabs(x - middle) - 10.1) / width);
}

static void a_sun_that_hardly_moved_is_alike(void **unused) {
    (void)unused;
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
    (void)z;
    return 0.5 + 0.5 * tanh(fmax(fabs(x - 48.0 - moved) - 30.0, fabs(y - 44.0) - 5.0) / 1.5);
}

static void a_shadow_six_times_as_long_as_wide_is_seen_to_move_along_itself(void **unused) {
    (void)unused;
    const double still = 0.0, moved = 0.7;
    const vsh_measures m = compare(long_at, &still, &moved);
    assert_near(m.shift[0], 0.7, 0.02);
    assert_near(m.shift[1], 0.0, 0.02);
}

/* A ramp at the left border, and a soft edge; both move by three texels. */
static double border_at(const void *user, double x, double y, double z) {
    const double at = x - *(const double *)user;
    (void)y;
    (void)z;
    return 0.5 + 0.5 * tanh((at - 60.0) / 6.0) - 0.5 * fmax(0.0, (8.0 - at) / 8.0);
}

static void what_comes_from_outside_is_not_explained(void **unused) {
    (void)unused;
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_edge_moves_across_itself_alone),
        cmocka_unit_test(what_planes_in_space_do_not_tell_is_no_displacement),
        cmocka_unit_test(a_sun_that_hardly_moved_is_alike),
        cmocka_unit_test(a_shadow_six_times_as_long_as_wide_is_seen_to_move_along_itself),
        cmocka_unit_test(what_comes_from_outside_is_not_explained),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
