/* Rays that texels share: what is interpolated, what is not, and what that costs of the error. */
#include "shade/interpolation.h"
#include "shading.h"
#include "testing.h"

#include "previews.h"
#include "truth/metrics.h"

enum { SQUARE = 8, POINTS = SQUARE * SQUARE };

static double positions[3 * POINTS];
static float normals[3 * POINTS];
static uint32_t texels[POINTS];

/* A level square of texels at (8, 16), all open. */
static void lay_square(vshi_interpolation *share) {
    static const vsh_points points = {POINTS, positions, normals, texels};
    *share = (vshi_interpolation){
        .points = &points, .count = POINTS, .max_error = 0.02, .sampler = VSH_SAMPLER_SOBOL, .rays = 8};
    for (uint32_t k = 0; k < POINTS; ++k) {
        const uint32_t column = k % SQUARE, row = k / SQUARE;
        positions[3 * k] = 0.1 * column;
        positions[3 * k + 1] = 0.0;
        positions[3 * k + 2] = 0.1 * row;
        normals[3 * k] = normals[3 * k + 2] = 0.0f;
        normals[3 * k + 1] = 1.0f;
        texels[k] = (column + 8) + 65536 * (row + 16);
        share->state[k] = VSHI_INTERPOLATION_OPEN;
    }
}

static float known_within = 0.01f;

typedef double light_fn(double column, double row);

/* Finds what is wanted by `light`; how many. */
static int answer(vshi_interpolation *share, light_fn *light) {
    int wanted = 0;
    for (size_t k = 0; k < POINTS; ++k) {
        if (share->state[k] == VSHI_INTERPOLATION_WANTED) {
            share->state[k] = VSHI_INTERPOLATION_KNOWN;
            share->value[k] = (float)light((double)(k % SQUARE), (double)(k / SQUARE));
            share->deviation[k] = known_within;
            ++wanted;
        }
    }
    return wanted;
}

static int still_open(const vshi_interpolation *share) {
    int open = 0;
    for (size_t k = 0; k < POINTS; ++k) {
        open += share->state[k] == VSHI_INTERPOLATION_OPEN;
    }
    return open;
}

/* Shares by a light at both levels; how many are left. */
static int run(vshi_interpolation *share, light_fn *light, int wanted[VSHI_INTERPOLATION_LEVELS]) {
    for (size_t k = 0; k < POINTS; ++k) {
        const double seen = light((double)(k % SQUARE), (double)(k / SQUARE));
        share->lit[k] = (uint16_t)lround(share->rays * seen);
    }
    vshi_interpolation_begin(share);
    for (int level = 0; level < VSHI_INTERPOLATION_LEVELS; ++level) {
        vshi_interpolation_pick(share, level);
        wanted[level] = answer(share, light);
        vshi_interpolation_fill(share, level);
    }
    return still_open(share);
}

static double ramp(double column, double row) {
    return 0.3 + 0.03 * column + 0.02 * row;
}

/* Bent, so that only small squares follow it. */
static double bend(double column, double row) {
    return 0.3 + 0.007 * (column - 3.0) * (column - 3.0);
}

static double edge(double column, double row) {
    return column + row > 7.0 ? 0.9 : 0.2;
}

/* Seen by none of the corners. */
static double spot(double column, double row) {
    return column > 2.0 && column < 6.0 && row > 2.0 && row < 6.0 ? 0.3 : 0.5;
}

static double slight_bend(double column, double row) {
    return 0.3 + 0.0015 * (row - 3.5) * (row - 3.5);
}

/* An edge that all anchors of the large square agree on. */
static double straight(double column, double row) {
    return row < 4.0 ? 0.95 : row > 4.0 ? 0.05 : 0.95 - 0.9 * 4.0 / 7.0;
}

/* A line that none of the anchors is on. */
static double line(double column, double row) {
    return row == 5.0 ? 0.0 : 1.0;
}

/* Shared values are as near to the light as their deviation says. Edges, lines and spots stay open. */
TEST(only_light_that_anchors_foretell_is_shared) {
    static const struct {
        const char *name;
        light_fn *light;
        float known_within;
        int wanted[VSHI_INTERPOLATION_LEVELS]; /* -1: any number */
        int least_open, most_open;
        double off, deviations; /* most, both together */
    } cases[] = {
        {"ramp", ramp, 0.01f, {9, 0}, 0, 0, 1e-6, 0.0},
        {"bend", bend, 0.01f, {9, 11}, 0, 0, 1e-6, 2.5},
        {"slight bend", slight_bend, 0.0f, {-1, 0}, 0, 0, 1e-6, 2.5},
        {"straight edge", straight, 0.01f, {-1, -1}, 1, POINTS, 0.01, 0.0},
        {"line", line, 0.01f, {-1, -1}, 2 * (16 - 5), 2 * (16 - 5), 0.0, 0.0},
        {"edge", edge, 0.01f, {-1, -1}, 2 * (16 - 5), 2 * (16 - 5), 1.0, 0.0}, /* it crosses two quarters */
        {"spot", spot, 0.01f, {-1, -1}, 1, POINTS, 0.07, 0.0},
    };
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; ++c) {
        static vshi_interpolation share;
        int wanted[VSHI_INTERPOLATION_LEVELS];
        lay_square(&share);
        known_within = cases[c].known_within;
        const int open = run(&share, cases[c].light, wanted);
        bool good = open >= cases[c].least_open && open <= cases[c].most_open;
        for (int level = 0; level < VSHI_INTERPOLATION_LEVELS; ++level) {
            good = good && (cases[c].wanted[level] < 0 || wanted[level] == cases[c].wanted[level]);
        }
        for (size_t k = 0; k < POINTS; ++k) {
            const double truth = cases[c].light((double)(k % SQUARE), (double)(k / SQUARE));
            const double most = cases[c].off + cases[c].deviations * (double)share.deviation[k];
            good = good && (share.state[k] != VSHI_INTERPOLATION_KNOWN ||
                            fabs((double)share.value[k] - truth) <= most);
            good = good && (c > 0 || (share.deviation[k] > 0.004f && share.deviation[k] <= 0.0101f));
        }
        assert_that(good, "%s: %d and %d wanted, %d open", cases[c].name, wanted[0], wanted[1], open);
    }
    known_within = 0.01f;
}

TEST(what_is_bent_or_missing_is_not_shared) {
    static vshi_interpolation share;
    int wanted[VSHI_INTERPOLATION_LEVELS];
    lay_square(&share);
    for (size_t k = 0; k < POINTS; ++k) { /* a step in the middle of the lower right quarter */
        positions[3 * k + 1] = k % SQUARE > 5 && k / SQUARE > 5 ? 0.2 : 0.0;
    }
    assert_int_equal(run(&share, ramp, wanted), 16);
    assert_int_equal(wanted[0], 0);
    lay_square(&share);
    share.state[0] = VSHI_INTERPOLATION_GONE;
    assert_int_equal(run(&share, ramp, wanted), 15);
    lay_square(&share);
    texels[5] = texels[4];
    assert_int_equal(run(&share, ramp, wanted), POINTS);
    lay_square(&share);
    for (size_t k = 0; k < POINTS; ++k) { /* every other one is of another square */
        texels[k] += k & 1 ? 0 : 8;
    }
    assert_int_equal(run(&share, ramp, wanted), POINTS);
}

/* --- on a field */

enum { SIDE = 256, FLOOR = SIDE * SIDE };
static double places[3 * FLOOR], rows[3 * FLOOR];
static float ups[3 * FLOOR], visible[FLOOR], deviation[FLOOR], reference[FLOOR];
static uint32_t numbers[FLOOR];

/* The seeds' floor in squares of eight. */
static void place_floor(void) {
    size_t next = 0;
    floor_texels(SIDE, rows, ups);
    for (uint32_t tile = 0; tile < FLOOR / POINTS; ++tile) {
        for (uint32_t k = 0; k < POINTS; ++k, ++next) {
            const uint32_t column = tile % (SIDE / SQUARE) * SQUARE + k % SQUARE;
            const uint32_t row = tile / (SIDE / SQUARE) * SQUARE + k / SQUARE;
            memcpy(places + 3 * next, rows + 3 * ((size_t)row * SIDE + column), 3 * sizeof *places);
            numbers[next] = column + 65536 * row;
        }
    }
}

static vsh_shade_stats shade(const vsh_field *field, const uint32_t *at, int32_t method, double max_error,
                             float *values, float *errors) {
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const vsh_points points = {FLOOR, places, ups, at};
    vsh_shade_options options = preview_options();
    options.method = method;
    options.rays = 1024;
    options.max_error = max_error;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, values, errors, &stats,
                               &failure));
    return stats;
}

/* Adaptive on a field, whose points share rays, keeps what is asked and said; for at most so much of the rays
 * that it takes when none are shared. */
static void keep_the_error(const vsh_field *field, double most_rays) {
    const double asked[] = {0.05, 0.02, 0.01};
    place_floor();
    shade(field, numbers, VSH_SHADOW_RAYS, 0.02, reference, NULL);
    for (int e = 0; e < 3; ++e) {
        const vsh_shade_stats alone = shade(field, NULL, VSH_SHADOW_ADAPTIVE, asked[e], visible, NULL);
        const vsh_shade_stats shared =
            shade(field, numbers, VSH_SHADOW_ADAPTIVE, asked[e], visible, deviation);
        const truth_metrics m = truth_compare(FLOOR, visible, reference, NULL);
        const double estimate = sqrt(shared.square_error / FLOOR);
        assert_at_most(m.rmse, 1.25 * estimate);
        assert_at_most(m.penumbra_rmse, asked[e]);
        assert_less((double)shared.rays, most_rays * (double)alone.rays);
        assert_int_equal(shared.refined, alone.refined);
        size_t wrong = 0;
        for (size_t i = 0; i < FLOOR; ++i) {
            wrong += deviation[i] == 0.0f && visible[i] != reference[i];
        }
        assert_int_equal(wrong, 0);
    }
}

TEST(rays_are_saved_and_the_error_is_as_said) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    keep_the_error(field, 0.7);
}

/* Rails close over the floor, whose shadows are a texel or two wide and pass between anchors. */
TEST(narrow_shadows_are_not_lost) {
    enum { RAILS = 16 };
    truth_solid rails[RAILS];
    for (int i = 0; i < RAILS; ++i) {
        rails[i] = (truth_solid){
            .shape = TRUTH_BOX, .half = {2.0, 0.015, 0.015}, .center = {0.0, 0.12, -0.6 + 0.17 * i}};
    }
    OWNED(vsh_field) *field = field_of((truth_scene){rails, RAILS}, 0.015, 0.0);
    keep_the_error(field, 1.1);
}
