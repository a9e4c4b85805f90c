/* Rectangular area lights against brute force: every part of the rectangle, weighed by the solid angle that
 * it is seen under, and segments to it against boxes in closed form. Shares no code with the library. */
#include "field/field.h"
#include "rays.h"
#include "testing.h"
#include "traced.h"
#include "truth/metrics.h"
#include "volumes.h"

enum { EDGE = 24, COUNT = EDGE * EDGE, PARTS = 96 };

/* A table's top and a block beside it, over the receivers' plane y = 0. */
static const truth_solid SOLIDS[] = {
    {.shape = TRUTH_BOX, .center = {0.1, 0.9, 0.0}, .half = {0.5, 0.1, 0.35}},
    {.shape = TRUTH_BOX, .center = {-0.9, 0.35, 0.6}, .half = {0.2, 0.35, 0.3}},
};
static const truth_scene SCENE = {SOLIDS, 2};
static const double VOXEL = 0.02;

static double positions[3 * COUNT];
static float normals[3 * COUNT];

static vsh_light panel(const double centre[3], const double u[3], const double v[3]) {
    vsh_light light = vsh_light_default();
    light.type = VSH_LIGHT_RECTANGLE;
    memcpy(light.position, centre, sizeof light.position);
    memcpy(light.edge_u, u, sizeof light.edge_u);
    memcpy(light.edge_v, v, sizeof light.edge_v);
    strcpy(light.name, "panel");
    return light;
}

/* On a ceiling, leaning, a tube close over the table, a wall that reaches below the floor (by whole parts), a
 * large one close over the table. */
static vsh_light light_of(int which) {
    static const double DATA[][9] = {
        {0.2, 2.4, -0.3, 1.2, 0.0, 0.0, 0.0, 0.0, 0.8},   {-1.2, 2.0, 0.4, 0.6, 0.6, 0.0, 0.0, 0.0, 1.0},
        {0.0, 1.3, 0.1, 2.4, 0.0, 0.0, 0.0, 0.0, 0.1},    {2.2, 0.75, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0},
        {-0.2, 1.15, 0.05, 1.6, 0.0, 0.0, 0.0, 0.0, 1.2},
    };
    const double *d = DATA[which];
    vsh_light light = panel(d, d + 3, d + 6);
    light.two_sided = 1;
    return light;
}
enum { LIGHTS = 5 };

/* Whether the segment from a to b meets the inside of a solid of the scene. */
static bool is_cut(const double a[3], const double b[3]) {
    for (size_t s = 0; s < SCENE.count; ++s) {
        double first = 0.0, last = 1.0;
        for (int axis = 0; axis < 3; ++axis) {
            const double low = SOLIDS[s].center[axis] - SOLIDS[s].half[axis] - a[axis];
            const double high = SOLIDS[s].center[axis] + SOLIDS[s].half[axis] - a[axis];
            const double way = b[axis] - a[axis];
            if (way == 0.0) {
                last = low > 0.0 || high < 0.0 ? -1.0 : last;
                continue;
            }
            first = fmax(first, fmin(low / way, high / way));
            last = fmin(last, fmax(low / way, high / way));
        }
        if (first < last) {
            return true;
        }
    }
    return false;
}

/* Fraction of the light's solid angle that a point sees. *solid is the whole solid angle. */
static double look(const vsh_light *light, const double *from, const float *normal, bool in_the_way,
                   double *solid) {
    double n[3], all = 0.0, seen = 0.0;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = light->edge_u[j] * light->edge_v[k] - light->edge_u[k] * light->edge_v[j]; /* of its area */
    }
    for (int i = 0; i < PARTS * PARTS; ++i) {
        const double u = (i % PARTS + 0.5) / PARTS - 0.5, v = ((double)(i / PARTS) + 0.5) / PARTS - 0.5;
        double at[3], square = 0.0, across = 0.0, up = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            at[axis] = light->position[axis] + u * light->edge_u[axis] + v * light->edge_v[axis];
            const double way = at[axis] - from[axis];
            square += way * way;
            across -= way * n[axis];
            up += normal != NULL ? way * (double)normal[axis] : 1.0;
        }
        const double weight = fabs(across) / (square * sqrt(square) * PARTS * PARTS);
        all += weight;
        seen += (across > 0.0 || light->two_sided) && up > 0.0 && !(in_the_way && is_cut(from, at)) ? weight
                                                                                                    : 0.0;
    }
    if (solid != NULL) {
        *solid = all;
    }
    return seen / all;
}

static void shade(const vsh_occluders *occluders, const vsh_light *light, int32_t method, float *values,
                  float *deviation) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_options options = vsh_shade_options_default();
    options.method = method;
    options.rays = 256;
    shade_points(occluders, &points, light, &options, NULL, values, deviation);
}

static void find_truth(const vsh_light *light, float truth[COUNT]) {
    for (size_t i = 0; i < COUNT; ++i) {
        truth[i] = (float)look(light, positions + 3 * i, normals + 3 * i, true, NULL);
    }
}

/* The field rounds edges off, which rays of a narrow light show most: half as much with voxels half as large.
 * Exact keeps the error that it states. */
TEST(rays_of_every_kind_match_brute_force) {
    const casting *c = *state;
    static const int32_t METHODS[] = {VSH_SHADOW_RAYS, VSH_SHADOW_ADAPTIVE, VSH_SHADOW_EXACT};
    static const double MOST[3][LIGHTS] = {
        {0.01, 0.01, 0.035, 0.01, 0.02}, {0.012, 0.012, 0.035, 0.012, 0.02}, {0.01, 0.01, 0.01, 0.01, 0.01}};
    float values[COUNT], said[COUNT], truth[COUNT];
    for (int l = 0; l < LIGHTS; ++l) {
        const vsh_light light = light_of(l);
        double darkest = 1.0;
        find_truth(&light, truth);
        for (size_t i = 0; i < COUNT; ++i) {
            darkest = fmin(darkest, (double)truth[i]);
        }
        assert_true(darkest < 0.35);
        for (size_t m = 0; m < (c->triangles != NULL ? 3 : 2); ++m) {
            shade(occluders_of_caster(c), &light, METHODS[m], values, said);
            double square = 0.0;
            for (size_t i = 0; i < COUNT; ++i) {
                square += (double)said[i] * (double)said[i] / COUNT;
            }
            const truth_metrics d = truth_compare(COUNT, values, truth, NULL);
            const bool exact = METHODS[m] == VSH_SHADOW_EXACT;
            assert_that(d.rmse < MOST[m][l] &&
                            (!exact || (fabs(d.bias) < 0.001 && d.rmse < 1.1 * sqrt(square) + 1e-3)),
                        "light %d, %s: off by %g, %g is said, on average %g, at most %g", l,
                        vsh_get_name(VSH_NAMES_SHADOW, METHODS[m]), d.rmse, sqrt(square), d.bias, d.max);
        }
        if (c->triangles != NULL) {
            see_light(c->triangles, NULL, COUNT, positions, normals, 0.0, &light, 4096, values);
            const truth_metrics d = truth_compare(COUNT, values, truth, NULL);
            assert_that(d.rmse < 0.003 && d.max < 0.02, "light %d, traced: off by %g, at most %g", l, d.rmse,
                        d.max);
        }
    }
}

/* As near as one disc can be to two thirds as high as wide, and one edge to a table's corners. */
TEST(one_march_takes_the_disc_of_equal_solid_angle) {
    const casting *c = *state;
    float values[COUNT], truth[COUNT];
    for (int l = 0; l < 2; ++l) {
        const vsh_light light = light_of(l);
        find_truth(&light, truth);
        for (int32_t method = VSH_SHADOW_SMOOTH; method <= VSH_SHADOW_CONE; ++method) {
            shade(occluders_of_caster(c), &light, method, values, NULL);
            const truth_metrics d = truth_compare(COUNT, values, truth, NULL);
            assert_that(d.rmse < 0.12, "light %d, %s: off by %g", l, vsh_get_name(VSH_NAMES_SHADOW, method),
                        d.rmse);
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
        shade(occluders_of_caster(c), &square, method, values, NULL);
        shade(occluders_of_caster(c), &ball, method, of_ball, NULL);
        for (size_t i = 0; i < COUNT; ++i) {
            assert_that(fabsf(values[i] - of_ball[i]) < 1e-6f, "%s, point %zu: %g, the ball %g",
                        vsh_get_name(VSH_NAMES_SHADOW, method), i, (double)values[i], (double)of_ball[i]);
        }
    }
}

TEST(a_tiny_rectangle_shades_like_a_point) {
    const casting *c = *state;
    const double centre[3] = {0.37, 2.1, -0.23}, u[3] = {1e-9, 0.0, 0.0}, v[3] = {0.0, 0.0, 2e-9};
    const vsh_light tiny = panel(centre, u, v), point = lamp(centre, 0.0);
    float values[COUNT], of_point[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method < SHADOW_METHODS; ++method) {
        shade(occluders_of_caster(c), &tiny, method, values, NULL);
        shade(occluders_of_caster(c), &point, method, of_point, NULL);
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
        vsh_light light = light_of(0);
        light.two_sided = 0;
        shade(occluders_of_caster(c), &light, method, front, NULL);
        light.two_sided = 1;
        shade(occluders_of_caster(c), &light, method, values, NULL);
        assert_memory_equal(values, front, sizeof values);
        for (int axis = 0; axis < 3; ++axis) {
            light.edge_u[axis] = -light.edge_u[axis]; /* turned away */
        }
        light.two_sided = 0;
        shade(occluders_of_caster(c), &light, method, values, NULL);
        assert_all_equal(values, COUNT, 0.0f);
        float rgb[3 * COUNT] = {0.0f};
        const vsh_points points = {COUNT, positions, normals, NULL};
        vsh_shade_irradiance(&points, NULL, &light, front, rgb);
        assert_all_equal(rgb, 3 * COUNT, 0.0f);
    }
    /* blocks of voxels above and below it; nothing casts */
    OWNED(vsh_field) *nothing = field_of_nothing(0.1);
    vsh_light light = light_of(0);
    light.two_sided = 0;
    light.position[1] = 0.015;
    OWNED(vsh_voxels) *voxels = cube_of(1.6, 0.1);
    vsh_volume_options options = vsh_volume_options_default();
    options.shade.method = VSH_SHADOW_ADAPTIVE;
    OWNED(vsh_volume) *volume = bake(occluders_of(nothing), voxels, &light, 1, &options, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    for (size_t i = 0; i < d.count; ++i) {
        const int32_t y = (int32_t)(i / (size_t)d.size[2] % (size_t)d.size[1]);
        assert_true(d.values[i] == (2 * y >= d.size[1] ? 0.0f : 1.0f));
    }
}

/* In the plane of the rectangle: beside it, and within it. */
TEST(a_rectangle_seen_edge_on_has_a_visible_share) {
    const casting *c = *state;
    const double places[][3] = {{-2.0, 1.5, 0.0}, {2.0, 1.5, 2.0}, {0.8, 1.5, 0.0},
                                {0.1, 1.5, 0.1},  {0.0, 1.5, 0.0}, {0.8, 1.5, 0.4}};
    const double centre[3] = {0.0, 1.5, 0.0}, u[3] = {1.6, 0.0, 0.0}, v[3] = {0.0, 0.0, 0.8};
    const float up[3] = {0.0f, 1.0f, 0.0f}, aside[3] = {1.0f, 0.0f, 0.0f};
    for (int32_t method = VSH_SHADOW_HARD; method < SHADOW_METHODS; ++method) {
        for (size_t p = 0; p < COUNT_OF(places); ++p) {
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

/* --- horizons, layers and irradiance */

TEST(the_horizon_cuts_it_by_solid_angle) {
    OWNED(vsh_field) *nothing = field_of_nothing(0.1);
    vshi_layer layer = vshi_layer_default();
    layer.field = nothing;
    uint64_t counter = 5;
    for (int i = 0; i < 40; ++i) {
        double n[3];
        random_direction(&counter, n);
        const float normal[3] = {(float)n[0], (float)n[1], (float)n[2]};
        const double at[3] = {between(&counter, -2.0, 2.0), 0.0, between(&counter, -2.0, 2.0)};
        const vsh_light light = light_of(i % LIGHTS);
        const double truth = look(&light, at, normal, false, NULL);
        vsh_shade_options options = vsh_shade_options_default();
        options.method = VSH_SHADOW_RAYS;
        options.rays = 1024;
        const vsh_points points = {1, at, normal, NULL};
        float alone, layered;
        shade_points(occluders_of(nothing), &points, &light, &options, NULL, &alone, NULL);
        shade_points(occluders_with(nothing, &layer, 1), &points, &light, &options, NULL, &layered, NULL);
        assert_true(fabs((double)alone - truth) < 0.01);
        /* the horizon does not cut a layer's share twice */
        assert_true(fabs((double)layered - truth) < 0.02);
    }
}

TEST(layers_know_it) {
    const casting *c = *state;
    OWNED(vsh_field) *nothing = field_of_nothing(0.1);
    const vsh_light light = light_of(0);
    vshi_layer layer = vshi_layer_default();
    layer.field = c->field;
    float whole[COUNT], layered[COUNT];
    shade(occluders_of_caster(c), &light, VSH_SHADOW_RAYS, whole, NULL);
    shade(occluders_with(nothing, &layer, 1), &light, VSH_SHADOW_RAYS, layered, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(fabsf(layered[i] - whole[i]) < 0.08f); /* by other rays */
    }
    /* without size it is hard */
    layer.softness = 0.0;
    shade(occluders_with(nothing, &layer, 1), &light, VSH_SHADOW_RAYS, layered, NULL);
    vsh_light point = lamp(light.position, 0.0);
    shade(occluders_of_caster(c), &point, VSH_SHADOW_RAYS, whole, NULL);
    size_t others = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(layered[i] == 0.0f || layered[i] == 1.0f);
        others += layered[i] != whole[i];
    }
    assert_true(others <= 2);
}

static float red_at(const vsh_light *light, const double *at) {
    const float up[3] = {0.0f, 1.0f, 0.0f}, one = 1.0f;
    const vsh_points points = {1, at, up, NULL};
    float rgb[3] = {0.0f, 0.0f, 0.0f};
    vsh_shade_irradiance(&points, NULL, light, &one, rgb);
    return rgb[0];
}

TEST(irradiance_has_the_cosine_of_the_rectangles_side) {
    const double centre[3] = {0.0, 2.0, 0.0}, u[3] = {1.0, 0.0, 0.0}, v[3] = {0.0, 0.0, 0.6};
    vsh_light light = panel(centre, u, v);
    for (double x = 0.0; x < 6.0; x += 0.7) {
        const double at[3] = {x, 0.0, 0.3}, square = x * x + 4.0 + 0.09, cosine = 2.0 / sqrt(square);
        light.falloff = VSH_FALLOFF_NONE;
        assert_float_equal(red_at(&light, at), cosine * cosine, 1e-6);
        light.falloff = VSH_FALLOFF_QUADRATIC;
        light.reach = 5.0;
        const double left = fmax(0.0, 1.0 - sqrt(square) / 5.0);
        assert_float_equal(red_at(&light, at), left * left * cosine * cosine, 1e-6);
        light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
        double solid;
        look(&light, at, NULL, false, &solid);
        assert_float_equal(red_at(&light, at), solid / 0.6 * cosine, 1e-4);
    }
    /* far away it is a point's, at the light finite */
    const double far[3] = {0.0, -998.0, 0.0}, here[3] = {0.0, 2.0, 0.0}, close[3] = {0.0, 2.0 - 1e-6, 0.0};
    assert_float_equal(red_at(&light, far) * 1e6f, 1.0, 1e-4);
    assert_true(red_at(&light, here) == 0.0f);
    assert_float_equal(red_at(&light, close), 2.0 * PI / 0.6, 1e-3);
    light.two_sided = 1;
    assert_true(isfinite(red_at(&light, here)));
}

static int set_up(void **state) {
    static casting c;
    put_square(EDGE, 2.0, 0.0, positions, normals);
    c = caster_of(SCENE, VOXEL, 3.0);
    *state = &c;
    return 0;
}

static int tear_down(void **state) {
    caster_free(*state);
    return 0;
}

FIXTURE(set_up, tear_down)
