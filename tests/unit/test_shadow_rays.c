/* Shadows by rays: the reference on the field, and what proves its way past them. */
#include "shading.h"
#include "testing.h"

#include "previews.h"
#include "shade/shadow.h"
#include "truth/metrics.h"

static const double OVERHEAD[3] = {0.0, 1.0, 0.0};

enum { SIDE = 128, TEXELS = SIDE * SIDE };
static double positions[3 * TEXELS];
static float normals[3 * TEXELS], visible[TEXELS], truth[TEXELS], reference[TEXELS];

static vsh_shade_stats shade(const vsh_field *field, const vsh_light *light, const vsh_shade_options *options,
                             size_t count, float *values, float *errors) {
    const vsh_points points = {count, positions, normals, NULL};
    return shade_points(occluders_of(field), &points, light, options, NULL, values, errors);
}

static vsh_shade_options options_of(int32_t method, int32_t rays, double max_error) {
    vsh_shade_options options = preview_options();
    options.method = method;
    options.rays = rays;
    options.max_error = max_error;
    return options;
}

/* Compares a method with the truth at points in a row, under a light straight above. */
static truth_metrics compare_across(truth_scene scene, double w, double from, double step, size_t count,
                                    vsh_shade_options options) {
    OWNED(vsh_field) *field = field_of(scene, 0.02, 0.0);
    const vsh_light light = sun(OVERHEAD, 2.0 * atan(w));
    for (size_t i = 0; i < count; ++i) {
        put_point(positions, normals, i, from + step * (double)i, 0.0, 0.1);
        truth[i] =
            (float)truth_light(scene, positions + 3 * i, OVERHEAD, OVERHEAD, w, (double)INFINITY, 4096);
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
    assert_less((double)early.rays, 0.4 * (double)all.rays);
    assert_true(m.rmse > 0.0 && m.rmse < 0.012);
    assert_less(fabs(m.bias), 0.001);
}

/* --- rays that texels share: what is interpolated, what is not, and what that costs of the error */

enum { SQUARE = 8, POINTS = SQUARE * SQUARE };

static double square[3 * POINTS];
static float square_normals[3 * POINTS];
static uint32_t texels[POINTS];

/* A level square of texels at (8, 16), all open. */
static void lay_square(vshi_interpolation *share) {
    static const vsh_points points = {POINTS, square, square_normals, texels};
    *share = (vshi_interpolation){
        .points = &points, .count = POINTS, .max_error = 0.02, .sampler = VSH_SAMPLER_SOBOL, .rays = 8};
    for (uint32_t k = 0; k < POINTS; ++k) {
        const uint32_t column = k % SQUARE, row = k / SQUARE;
        square[3 * k] = 0.1 * column;
        square[3 * k + 1] = 0.0;
        square[3 * k + 2] = 0.1 * row;
        square_normals[3 * k] = square_normals[3 * k + 2] = 0.0f;
        square_normals[3 * k + 1] = 1.0f;
        texels[k] = (column + 8) + 65536 * (row + 16);
        share->state[k] = VSHI_INTERPOLATION_OPEN;
    }
}

static float known_within = 0.01f;

typedef double light_fn(double column, double row);

/* Answers the wanted points by `light`. Returns their number. */
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

/* Interpolates a light on both levels. Returns the number of points that are left. */
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
TEST(only_predictable_light_is_shared) {
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
    for (size_t c = 0; c < COUNT_OF(cases); ++c) {
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
            const double seen = cases[c].light((double)(k % SQUARE), (double)(k / SQUARE));
            const double most = cases[c].off + cases[c].deviations * (double)share.deviation[k];
            good = good && (share.state[k] != VSHI_INTERPOLATION_KNOWN ||
                            fabs((double)share.value[k] - seen) <= most);
            good = good && (c > 0 || (share.deviation[k] > 0.004f && share.deviation[k] <= 0.0101f));
        }
        assert_that(good, "%s: %d and %d wanted, %d open", cases[c].name, wanted[0], wanted[1], open);
    }
    known_within = 0.01f;
}

TEST(bent_or_missing_neighbours_share_no_rays) {
    static vshi_interpolation share;
    int wanted[VSHI_INTERPOLATION_LEVELS];
    lay_square(&share);
    for (size_t k = 0; k < POINTS; ++k) { /* a step in the middle of the lower right quarter */
        square[3 * k + 1] = k % SQUARE > 5 && k / SQUARE > 5 ? 0.2 : 0.0;
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

enum { FLOOR_SIDE = 256, FLOOR = FLOOR_SIDE * FLOOR_SIDE };
static double places[3 * FLOOR], rows[3 * FLOOR];
static float ups[3 * FLOOR], shared_light[FLOOR], said[FLOOR], traced[FLOOR];
static uint32_t numbers[FLOOR];

/* The seeds' floor in squares of eight. */
static void place_squares(void) {
    size_t next = 0;
    floor_texels(FLOOR_SIDE, rows, ups);
    for (uint32_t tile = 0; tile < FLOOR / POINTS; ++tile) {
        for (uint32_t k = 0; k < POINTS; ++k, ++next) {
            const uint32_t column = tile % (FLOOR_SIDE / SQUARE) * SQUARE + k % SQUARE;
            const uint32_t row = tile / (FLOOR_SIDE / SQUARE) * SQUARE + k / SQUARE;
            memcpy(places + 3 * next, rows + 3 * ((size_t)row * FLOOR_SIDE + column), 3 * sizeof *places);
            numbers[next] = column + 65536 * row;
        }
    }
}

/* Rays of one sun over the floor. */
static vsh_shade_stats shade_floor(const vsh_field *field, const vsh_light *light, const uint32_t *at,
                                   int32_t method, double max_error, float *values, float *errors) {
    const vsh_points points = {FLOOR, places, ups, at};
    const vsh_shade_options options = options_of(method, 1024, max_error);
    return shade_points(occluders_of(field), &points, light, &options, NULL, values, errors);
}

/* Adaptive on a field keeps and states the requested error, with shared rays and without. Sharing needs at
 * most `most_rays` of the rays. */
static void keep_the_error(const vsh_field *field, const vsh_light *light, double most_rays) {
    const double asked[] = {0.05, 0.02, 0.01};
    place_squares();
    shade_floor(field, light, numbers, VSH_SHADOW_RAYS, 0.02, traced, NULL);
    for (int e = 0; e < 3; ++e) {
        vsh_shade_stats stats[2];
        for (int shared = 0; shared < 2; ++shared) {
            stats[shared] = shade_floor(field, light, shared ? numbers : NULL, VSH_SHADOW_ADAPTIVE, asked[e],
                                        shared_light, said);
            const truth_metrics m = truth_compare(FLOOR, shared_light, traced, NULL);
            const double estimate = sqrt(stats[shared].square_error / FLOOR);
            assert_true(m.rmse < 1.25 * estimate && m.rmse > 0.4 * estimate);
            assert_at_most(m.penumbra_rmse, asked[e]);
            for (size_t i = 0; i < FLOOR; ++i) {
                assert_true(said[i] >= 0.0f && said[i] <= 1.001 * asked[e]);
                assert_true(said[i] > 0.0f || shared_light[i] == traced[i]);
            }
        }
        assert_less((double)stats[1].rays, most_rays * (double)stats[0].rays);
        assert_int_equal(stats[1].refined, stats[0].refined);
    }
}

TEST(sharing_saves_rays_and_keeps_the_stated_error) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.02, 0.0);
    const vsh_light lights[] = {sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w)),
                                lamp((const double[]){-0.5, 2.5, -0.8}, 0.3)};
    keep_the_error(field, &lights[0], 0.7);
    keep_the_error(field, &lights[1], 0.9);
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
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    keep_the_error(field, &light, 1.1);
}
