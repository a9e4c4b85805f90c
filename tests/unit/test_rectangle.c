/* Rectangular area lights against brute force: every part of the rectangle, weighed by the solid angle that
 * it is seen under, and segments to it against boxes in closed form. Shares no code with the library. */
#include "rectangles.h"
#include "testing.h"

static void find_truth(const vsh_light *light, double truth[COUNT]) {
    for (size_t i = 0; i < COUNT; ++i) {
        truth[i] = look(light, positions + 3 * i, normals + 3 * i, true, NULL);
    }
}

/* Rays on the field see edges as it rounds them off, which a narrow light shows most: half as much with
 * voxels half as large. What exact says of its error holds. */
TEST(rays_of_every_kind_see_what_brute_force_sees) {
    const casting *c = *state;
    static const int32_t METHODS[] = {VSH_SHADOW_RAYS, VSH_SHADOW_ADAPTIVE, VSH_SHADOW_EXACT};
    static const double MOST[3][LIGHTS] = {
        {0.01, 0.01, 0.035, 0.01, 0.02}, {0.012, 0.012, 0.035, 0.012, 0.02}, {0.01, 0.01, 0.01, 0.01, 0.01}};
    double truth[COUNT];
    float values[COUNT], said[COUNT];
    for (int l = 0; l < LIGHTS; ++l) {
        const vsh_light light = light_of(l);
        double darkest = 1.0;
        find_truth(&light, truth);
        for (size_t i = 0; i < COUNT; ++i) {
            darkest = fmin(darkest, truth[i]);
        }
        assert_true(darkest < 0.35);
        for (size_t m = 0; m < (c->triangles != NULL ? 3 : 2); ++m) {
            const vsh_shade_options options = options_of(METHODS[m]);
            shade(c, &light, &options, values, said);
            double square = 0.0;
            for (size_t i = 0; i < COUNT; ++i) {
                square += (double)said[i] * (double)said[i] / COUNT;
            }
            const difference d = compare(values, truth);
            const bool exact = METHODS[m] == VSH_SHADOW_EXACT;
            assert_that(
                d.root_mean_square < MOST[m][l] &&
                    (!exact || (fabs(d.bias) < 0.001 && d.root_mean_square < 1.1 * sqrt(square) + 1e-3)),
                "light %d, %s: off by %g, %g is said, on average %g, at most %g", l,
                vsh_get_name(VSH_NAMES_SHADOW, METHODS[m]), d.root_mean_square, sqrt(square), d.bias,
                d.largest);
        }
        if (c->triangles != NULL) {
            assert_ok(vsh_trace_shadow(c->triangles, NULL, COUNT, positions, normals, 0.0, &light, 4096, NULL,
                                       values, &failure));
            const difference d = compare(values, truth);
            assert_that(d.root_mean_square < 0.003 && d.largest < 0.02,
                        "light %d, traced: off by %g, at most %g", l, d.root_mean_square, d.largest);
        }
    }
}

/* As near as one disc can be to two thirds as high as wide, and one edge to a table's corners. */
TEST(one_march_takes_the_disc_of_equal_solid_angle) {
    const casting *c = *state;
    double truth[COUNT];
    float values[COUNT];
    for (int l = 0; l < 2; ++l) {
        const vsh_light light = light_of(l);
        find_truth(&light, truth);
        for (int32_t method = VSH_SHADOW_SMOOTH; method <= VSH_SHADOW_CONE; ++method) {
            const vsh_shade_options options = options_of(method);
            shade(c, &light, &options, values, NULL);
            const difference d = compare(values, truth);
            assert_that(d.root_mean_square < 0.12, "light %d, %s: off by %g", l,
                        vsh_get_name(VSH_NAMES_SHADOW, method), d.root_mean_square);
        }
    }
    /* far away a square is a ball */
    const double u[3] = {8e3, 0.0, 0.0}, v[3] = {0.0, 0.0, 8e3}, high[3] = {0.0, 1e5, 0.0};
    const vsh_light square = panel(high, u, v);
    double solid;
    look(&square, (const double[]){0.0, 0.0, 0.0}, NULL, false, &solid);
    const double half = acos(1.0 - solid / (2.0 * PI));
    const vsh_light ball = lamp(high, 1e5 * sin(half));
    float of_ball[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
        const vsh_shade_options options = options_of(method);
        shade(c, &square, &options, values, NULL);
        shade(c, &ball, &options, of_ball, NULL);
        for (size_t i = 0; i < COUNT; ++i) {
            assert_that(fabsf(values[i] - of_ball[i]) < 1e-6f, "%s, point %zu: %g, the ball %g",
                        vsh_get_name(VSH_NAMES_SHADOW, method), i, (double)values[i], (double)of_ball[i]);
        }
    }
}

TEST(a_tiny_rectangle_is_a_point) {
    const casting *c = *state;
    const double centre[3] = {0.37, 2.1, -0.23}, u[3] = {1e-9, 0.0, 0.0}, v[3] = {0.0, 0.0, 2e-9};
    const vsh_light tiny = panel(centre, u, v), point = lamp(centre, 0.0);
    float values[COUNT], of_point[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method < SHADOW_METHODS; ++method) {
        const vsh_shade_options options = options_of(method);
        shade(c, &tiny, &options, values, NULL);
        shade(c, &point, &options, of_point, NULL);
        for (size_t i = 0; i < COUNT; ++i) {
            assert_that(values[i] == of_point[i], "%s, point %zu: %g, not %g",
                        vsh_get_name(VSH_NAMES_SHADOW, method), i, (double)values[i], (double)of_point[i]);
        }
    }
}

TEST(behind_a_one_sided_one_is_nothing_and_two_sides_are_alike) {
    const casting *c = *state;
    float front[COUNT], values[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method < SHADOW_METHODS; ++method) {
        const vsh_shade_options options = options_of(method);
        vsh_light light = light_of(0);
        light.two_sided = 0;
        shade(c, &light, &options, front, NULL);
        light.two_sided = 1;
        shade(c, &light, &options, values, NULL);
        assert_memory_equal(values, front, sizeof values);
        for (int axis = 0; axis < 3; ++axis) {
            light.edge_u[axis] = -light.edge_u[axis]; /* turned away */
        }
        light.two_sided = 0;
        shade(c, &light, &options, values, NULL);
        float rgb[3 * COUNT] = {0.0f};
        const vsh_points points = {COUNT, positions, normals, NULL};
        vsh_shade_irradiance(&points, NULL, &light, front, rgb);
        for (size_t i = 0; i < COUNT; ++i) {
            assert_true(values[i] == 0.0f && front[i] >= 0.0f && rgb[3 * i] == 0.0f);
        }
    }
    /* blocks of voxels above and below it; nothing casts */
    OWNED(vsh_field) *nothing = NULL;
    assert_int_equal(vshi_field_create_empty(0.1, &nothing, NULL), VSH_OK);
    vsh_light light = light_of(0);
    light.two_sided = 0;
    light.position[1] = 0.015;
    OWNED(vsh_voxels) *voxels = cube_of(1.6, 0.1);
    vsh_volume_options options = vsh_volume_options_default();
    options.shade.method = VSH_SHADOW_ADAPTIVE;
    OWNED(vsh_volume) *volume = bake(occluders_of(nothing), voxels, &light, 1, &options, NULL);
    const dense d = copy_of(volume, 0, voxels);
    for (size_t i = 0; i < d.count; ++i) {
        const int32_t y = (int32_t)(i / (size_t)d.size[2] % (size_t)d.size[1]);
        assert_true(d.values[i] == (2 * y >= d.size[1] ? 0.0f : 1.0f));
    }
    free(d.values);
}

/* In the plane of the rectangle: beside it, and within it. */
TEST(edge_on_is_a_share_all_the_same) {
    const casting *c = *state;
    const double places[][3] = {{-2.0, 1.5, 0.0}, {2.0, 1.5, 2.0}, {0.8, 1.5, 0.0},
                                {0.1, 1.5, 0.1},  {0.0, 1.5, 0.0}, {0.8, 1.5, 0.4}};
    const double centre[3] = {0.0, 1.5, 0.0}, u[3] = {1.6, 0.0, 0.0}, v[3] = {0.0, 0.0, 0.8};
    const float up[3] = {0.0f, 1.0f, 0.0f}, aside[3] = {1.0f, 0.0f, 0.0f};
    for (int32_t method = VSH_SHADOW_HARD; method < SHADOW_METHODS; ++method) {
        for (size_t p = 0; p < sizeof places / sizeof places[0]; ++p) {
            for (int lifted = -2; lifted <= 2; ++lifted) {
                const double at[3] = {places[p][0], places[p][1] + 1e-7 * lifted, places[p][2]};
                vsh_light light = panel(centre, u, v);
                const float one = cast_shadow_at(c, &light, method, at, NULL);
                light.two_sided = 1;
                const float both = cast_shadow_at(c, &light, method, at, NULL);
                const float over = cast_shadow_at(c, &light, method, at, up);
                const float beside = cast_shadow_at(c, &light, method, at, aside);
                assert_true(one == (lifted < 0 ? 1.0f : 0.0f));
                assert_true(both == 1.0f);
                assert_true(over >= 0.0f && over <= 1.0f && beside >= 0.0f && beside <= 1.0f);
            }
        }
    }
}

FIXTURE(set_up, tear_down)
