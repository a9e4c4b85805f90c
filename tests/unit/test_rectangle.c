/* Rectangular area lights against brute force: every part of the rectangle, weighed by the solid angle that
 * it is seen under, and segments to it against boxes in closed form. Shares no code with the library. */
#include "field/field.h"
#include "traced.h"
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

static void place_receivers(void) {
    for (size_t i = 0; i < COUNT; ++i) {
        positions[3 * i] = -2.0 + 4.0 * ((double)(i % EDGE) + 0.5) / EDGE;
        positions[3 * i + 1] = 0.0;
        positions[3 * i + 2] = -2.0 + 4.0 * ((double)(i / EDGE) + 0.5) / EDGE;
        normals[3 * i] = normals[3 * i + 2] = 0.0f;
        normals[3 * i + 1] = 1.0f;
    }
}

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

/* Fraction of the light's solid angle that a point sees, in *solid all of it. */
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

static vsh_shade_options options_of(int32_t method) {
    vsh_shade_options options = vsh_shade_options_default();
    options.method = method;
    options.rays = 256;
    return options;
}

static void shade_by(const vsh_occluders *occluders, const vsh_light *light, const vsh_shade_options *options,
                     float *values, float *deviation) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_error error = {VSH_OK, ""};
    if (vsh_shade_shadow(occluders, &points, light, options, NULL, values, deviation, NULL, &error) !=
        VSH_OK) {
        fail_msg("%s", error.message);
    }
}

static void shade(const caster *c, const vsh_light *light, const vsh_shade_options *options, float *values,
                  float *deviation) {
    shade_by(occluders_of_caster(c), light, options, values, deviation);
}

typedef struct difference {
    double root_mean_square, largest, bias;
} difference;

static difference compare(const float *values, const double *truth) {
    difference d = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < COUNT; ++i) {
        const double off = (double)values[i] - truth[i];
        d.root_mean_square += off * off / COUNT;
        d.bias += off / COUNT;
        d.largest = fmax(d.largest, fabs(off));
    }
    d.root_mean_square = sqrt(d.root_mean_square);
    return d;
}

/* Rays on the field see edges as it rounds them off, which a narrow light shows most: half as much with
 * voxels half as large. */
static void rays_of_every_kind_see_what_brute_force_sees(void **state) {
    const caster *c = *state;
    static const int32_t METHODS[] = {VSH_SHADOW_RAYS, VSH_SHADOW_ADAPTIVE, VSH_SHADOW_EXACT};
    static const double MOST[3][LIGHTS] = {
        {0.01, 0.01, 0.035, 0.01, 0.02}, {0.012, 0.012, 0.035, 0.012, 0.02}, {0.01, 0.01, 0.01, 0.01, 0.01}};
    double truth[COUNT];
    float values[COUNT];
    for (int l = 0; l < LIGHTS; ++l) {
        const vsh_light light = light_of(l);
        double darkest = 1.0;
        for (size_t i = 0; i < COUNT; ++i) {
            truth[i] = look(&light, positions + 3 * i, normals + 3 * i, true, NULL);
            darkest = fmin(darkest, truth[i]);
        }
        assert_true(darkest < 0.35);
        for (size_t m = 0; m < 3; ++m) {
            if (METHODS[m] == VSH_SHADOW_EXACT && c->triangles == NULL) {
                continue;
            }
            const vsh_shade_options options = options_of(METHODS[m]);
            shade(c, &light, &options, values, NULL);
            const difference d = compare(values, truth);
            if (!(d.root_mean_square < MOST[m][l]) || (m == 2 && !(fabs(d.bias) < 0.001))) {
                fail_msg("light %d, %s: off by %g, on average %g, at most %g", l,
                         vsh_shadow_method_name(METHODS[m]), d.root_mean_square, d.bias, d.largest);
            }
        }
        if (c->triangles != NULL) {
            vsh_error error;
            assert_int_equal(vsh_trace_shadow(c->triangles, NULL, COUNT, positions, normals, 0.0, &light,
                                              4096, NULL, values, &error),
                             VSH_OK);
            const difference d = compare(values, truth);
            if (!(d.root_mean_square < 0.003 && d.largest < 0.02)) {
                fail_msg("light %d, traced: off by %g, at most %g", l, d.root_mean_square, d.largest);
            }
        }
    }
}

static void what_is_said_of_the_error_holds(void **state) {
    const caster *c = *state;
    double truth[COUNT];
    float values[COUNT], said[COUNT];
    if (c->triangles == NULL) {
        skip();
    }
    for (int l = 0; l < LIGHTS; ++l) {
        const vsh_light light = light_of(l);
        for (size_t i = 0; i < COUNT; ++i) {
            truth[i] = look(&light, positions + 3 * i, normals + 3 * i, true, NULL);
        }
        const vsh_shade_options options = options_of(VSH_SHADOW_EXACT);
        shade(c, &light, &options, values, said);
        double square = 0.0;
        for (size_t i = 0; i < COUNT; ++i) {
            square += (double)said[i] * (double)said[i] / COUNT;
        }
        const difference d = compare(values, truth);
        if (!(d.root_mean_square < 1.1 * sqrt(square) + 1e-3)) {
            fail_msg("light %d: off by %g, %g is said", l, d.root_mean_square, sqrt(square));
        }
    }
}

/* As near as one disc can be to two thirds as high as wide, and one edge to a table's corners. */
static void one_march_takes_the_disc_of_equal_solid_angle(void **state) {
    const caster *c = *state;
    double truth[COUNT];
    float values[COUNT];
    for (int l = 0; l < 2; ++l) {
        const vsh_light light = light_of(l);
        for (size_t i = 0; i < COUNT; ++i) {
            truth[i] = look(&light, positions + 3 * i, normals + 3 * i, true, NULL);
        }
        for (int32_t method = VSH_SHADOW_SMOOTH; method <= VSH_SHADOW_CONE; ++method) {
            const vsh_shade_options options = options_of(method);
            shade(c, &light, &options, values, NULL);
            const difference d = compare(values, truth);
            if (!(d.root_mean_square < 0.12)) {
                fail_msg("light %d, %s: off by %g", l, vsh_shadow_method_name(method), d.root_mean_square);
            }
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
            /* a search goes on from what rounding has left of the direction */
            if (!(fabsf(values[i] - of_ball[i]) < (method == VSH_SHADOW_CONE ? 1e-5f : 1e-6f))) {
                fail_msg("%s, point %zu: %g, the ball %g", vsh_shadow_method_name(method), i,
                         (double)values[i], (double)of_ball[i]);
            }
        }
    }
}

static void a_tiny_rectangle_is_a_point(void **state) {
    const caster *c = *state;
    const double centre[3] = {0.37, 2.1, -0.23}, u[3] = {1e-9, 0.0, 0.0}, v[3] = {0.0, 0.0, 2e-9};
    const vsh_light tiny = panel(centre, u, v), point = lamp(centre, 0.0);
    float values[COUNT], of_point[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method < shadow_methods(); ++method) {
        const vsh_shade_options options = options_of(method);
        shade(c, &tiny, &options, values, NULL);
        shade(c, &point, &options, of_point, NULL);
        for (size_t i = 0; i < COUNT; ++i) {
            if (values[i] != of_point[i]) {
                fail_msg("%s, point %zu: %g, not %g", vsh_shadow_method_name(method), i, (double)values[i],
                         (double)of_point[i]);
            }
        }
    }
}

static void behind_a_one_sided_one_is_nothing_and_two_sides_are_alike(void **state) {
    const caster *c = *state;
    float front[COUNT], values[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method < shadow_methods(); ++method) {
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
    vsh_field *nothing = NULL;
    assert_int_equal(vshi_field_create_empty(0.1, &nothing, NULL), VSH_OK);
    vsh_light light = light_of(0);
    light.two_sided = 0;
    light.position[1] = 0.015;
    vsh_voxels *voxels = cube_of(1.6, 0.1);
    vsh_volume_options options = vsh_volume_options_default();
    options.shade.method = VSH_SHADOW_ADAPTIVE;
    vsh_volume *volume = bake(occluders_of(nothing), voxels, &light, 1, &options, NULL);
    const dense d = copy_of(volume, 0, voxels);
    for (size_t i = 0; i < d.count; ++i) {
        const int32_t y = (int32_t)(i / (size_t)d.size[2] % (size_t)d.size[1]);
        assert_true(d.values[i] == (2 * y >= d.size[1] ? 0.0f : 1.0f));
    }
    free(d.values);
    vsh_volume_free(volume);
    vsh_voxels_free(voxels);
    vsh_field_free(nothing);
}

/* In the plane of the rectangle: beside it, and within it. */
static void edge_on_is_a_share_all_the_same(void **state) {
    const caster *c = *state;
    const double places[][3] = {{-2.0, 1.5, 0.0}, {2.0, 1.5, 2.0}, {0.8, 1.5, 0.0},
                                {0.1, 1.5, 0.1},  {0.0, 1.5, 0.0}, {0.8, 1.5, 0.4}};
    const double centre[3] = {0.0, 1.5, 0.0}, u[3] = {1.6, 0.0, 0.0}, v[3] = {0.0, 0.0, 0.8};
    const float up[3] = {0.0f, 1.0f, 0.0f}, aside[3] = {1.0f, 0.0f, 0.0f};
    for (int32_t method = VSH_SHADOW_HARD; method < shadow_methods(); ++method) {
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

static void the_horizon_cuts_it_by_solid_angle(void **state) {
    (void)state;
    vsh_field *nothing = NULL;
    assert_int_equal(vshi_field_create_empty(0.1, &nothing, NULL), VSH_OK);
    vsh_layer layer = vsh_layer_default();
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
        assert_int_equal(vsh_shade_shadow(occluders_of(nothing), &points, &light, &options, NULL, &alone,
                                          NULL, NULL, NULL),
                         VSH_OK);
        assert_true(fabs((double)alone - truth) < 0.01);
        /* of a layer's share nothing is lost below the horizon twice */
        assert_int_equal(vsh_shade_shadow(occluders_with(nothing, &layer, 1), &points, &light, &options, NULL,
                                          &layered, NULL, NULL, NULL),
                         VSH_OK);
        assert_true(fabs((double)layered - truth) < 0.02);
    }
    vsh_field_free(nothing);
}

static void layers_and_casters_without_voxels_know_it(void **state) {
    const caster *c = *state;
    static const double BALLS[2][4] = {{0.2, 0.8, 0.0, 0.3}, {-0.8, 0.5, 0.6, 0.25}};
    vsh_spheres *spheres = NULL;
    vsh_field *nothing = NULL;
    assert_int_equal(vshi_field_create_empty(0.1, &nothing, NULL), VSH_OK);
    assert_int_equal(vsh_spheres_create(&BALLS[0][0], 2, NULL, NULL, &spheres, NULL), VSH_OK);
    const vsh_light light = light_of(0);
    vsh_layer layer = vsh_layer_default();
    layer.field = c->field;
    vsh_shade_options options = options_of(VSH_SHADOW_RAYS);
    float whole[COUNT], layered[COUNT];
    shade(c, &light, &options, whole, NULL);
    shade_by(occluders_with(nothing, &layer, 1), &light, &options, layered, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(fabsf(layered[i] - whole[i]) < 0.08f); /* by other rays */
    }
    /* without size it is hard */
    layer.softness = 0.0;
    shade_by(occluders_with(nothing, &layer, 1), &light, &options, layered, NULL);
    vsh_light point = lamp(light.position, 0.0);
    shade(c, &point, &options, whole, NULL);
    size_t others = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(layered[i] == 0.0f || layered[i] == 1.0f);
        others += layered[i] != whole[i];
    }
    assert_true(others <= 2);
    /* spheres: the disc, against rays to the rectangle */
    const truth_solid solids[2] = {{.shape = TRUTH_SPHERE, .center = {0.2, 0.8, 0.0}, .radius = 0.3},
                                   {.shape = TRUTH_SPHERE, .center = {-0.8, 0.5, 0.6}, .radius = 0.25}};
    caster balls = caster_of((truth_scene){solids, 2}, 0.03, 2.0);
    options = options_of(VSH_SHADOW_RAYS);
    shade(&balls, &light, &options, whole, NULL);
    vsh_layer analytic = vsh_layer_default();
    analytic.spheres = spheres;
    shade_by(occluders_with(nothing, &analytic, 1), &light, &options, layered, NULL);
    double square = 0.0;
    for (size_t i = 0; i < COUNT; ++i) {
        square += pow((double)layered[i] - (double)whole[i], 2.0) / COUNT;
    }
    assert_true(sqrt(square) < 0.04);
    caster_free(&balls);
    vsh_spheres_free(spheres);
    vsh_field_free(nothing);
}

static void threads_and_instruction_sets_give_the_same_bits(void **state) {
    const caster *c = *state;
    const vsh_points points = {COUNT, positions, normals, NULL};
    float values[COUNT], others[COUNT];
    for (int32_t method = VSH_SHADOW_HARD; method < shadow_methods(); ++method) {
        const vsh_light light = light_of(method % LIGHTS);
        const vsh_shade_options options = options_of(method);
        vsh_run run = vsh_run_default();
        run.threads = 1;
        run.isa = VSH_ISA_BASE;
        assert_int_equal(vsh_shade_shadow(occluders_of_caster(c), &points, &light, &options, &run, values,
                                          NULL, NULL, NULL),
                         VSH_OK);
        run.threads = 3;
        run.isa = VSH_ISA_BEST;
        assert_int_equal(vsh_shade_shadow(occluders_of_caster(c), &points, &light, &options, &run, others,
                                          NULL, NULL, NULL),
                         VSH_OK);
        assert_memory_equal(values, others, sizeof values);
    }
}

static float red_at(const vsh_light *light, const double *at) {
    const float up[3] = {0.0f, 1.0f, 0.0f}, one = 1.0f;
    const vsh_points points = {1, at, up, NULL};
    float rgb[3] = {0.0f, 0.0f, 0.0f};
    vsh_shade_irradiance(&points, NULL, light, &one, rgb);
    return rgb[0];
}

static void irradiance_has_the_cosine_at_which_it_shines(void **state) {
    (void)state;
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

static void refuses(const vsh_light *light, const char *message) {
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_light_check(light, &error), VSH_ERROR_ARGUMENT);
    assert_string_equal(error.message, message);
}

static void what_is_no_rectangle_is_refused(void **state) {
    (void)state;
    vsh_light light = light_of(0);
    assert_int_equal(vsh_light_check(&light, NULL), VSH_OK);
    memset(light.edge_u, 0, sizeof light.edge_u);
    refuses(&light, "light 'panel': edge_u (0, 0, 0): expected a length over 0");
    light.edge_u[0] = 1e-20;
    refuses(&light, "light 'panel': edge_u has the length 1e-20, out of range 1e-15 … 1e+15");
    light = light_of(0);
    light.edge_v[2] = 1e200;
    refuses(&light, "light 'panel': edge_v has the length inf, out of range 1e-15 … 1e+15");
    light = light_of(0);
    light.edge_v[1] = NAN;
    refuses(&light, "light 'panel': edge_v[1] nan is out of range -inf (excluded) … inf (excluded)");
    light = light_of(0);
    memcpy(light.edge_v, (const double[]){1.0, 0.0, 1.0}, sizeof light.edge_v);
    refuses(&light, "light 'panel': edge_u and edge_v are not at right angles: the cosine between them is "
                    "0.707106781, of at most 0.001");
    light = light_of(0);
    light.two_sided = 2;
    refuses(&light, "light 'panel': two_sided 2 is out of range 0 … 1");
    light = light_of(0);
    light.position[2] = INFINITY;
    refuses(&light, "light 'panel': position[2] inf is out of range -inf (excluded) … inf (excluded)");
    light = light_of(0);
    light.falloff = VSH_FALLOFF_QUADRATIC;
    light.reach = 0.0;
    refuses(&light, "light 'panel': reach 0 is out of range 0 (excluded) … inf (excluded)");
    char text[200];
    light = light_of(0);
    vsh_light_text(&light, text, sizeof text);
    assert_string_equal(text, "rectangle at 0.2 2.4 -0.3, sides 1.2 0 0 and 0 0 0.8, two-sided");
}

static int set_up(void **state) {
    static caster c;
    place_receivers();
    c = caster_of(SCENE, VOXEL, 3.0);
    *state = &c;
    return 0;
}

static int tear_down(void **state) {
    caster_free(*state);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_of_every_kind_see_what_brute_force_sees),
        cmocka_unit_test(what_is_said_of_the_error_holds),
        cmocka_unit_test(one_march_takes_the_disc_of_equal_solid_angle),
        cmocka_unit_test(a_tiny_rectangle_is_a_point),
        cmocka_unit_test(behind_a_one_sided_one_is_nothing_and_two_sides_are_alike),
        cmocka_unit_test(edge_on_is_a_share_all_the_same),
        cmocka_unit_test(the_horizon_cuts_it_by_solid_angle),
        cmocka_unit_test(layers_and_casters_without_voxels_know_it),
        cmocka_unit_test(threads_and_instruction_sets_give_the_same_bits),
        cmocka_unit_test(irradiance_has_the_cosine_at_which_it_shines),
        cmocka_unit_test(what_is_no_rectangle_is_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
