/* Rectangular area lights among horizons, layers, casters without voxels, and irradiance; and what is no
 * rectangle. */
#include "rectangles.h"
#include "testing.h"

TEST(the_horizon_cuts_it_by_solid_angle) {
    OWNED(vsh_field) *nothing = NULL;
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
}

TEST(layers_know_it) {
    const casting *c = *state;
    OWNED(vsh_field) *nothing = NULL;
    assert_int_equal(vshi_field_create_empty(0.1, &nothing, NULL), VSH_OK);
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
}

static float red_at(const vsh_light *light, const double *at) {
    const float up[3] = {0.0f, 1.0f, 0.0f}, one = 1.0f;
    const vsh_points points = {1, at, up, NULL};
    float rgb[3] = {0.0f, 0.0f, 0.0f};
    vsh_shade_irradiance(&points, NULL, light, &one, rgb);
    return rgb[0];
}

TEST(irradiance_has_the_cosine_at_which_it_shines) {
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

TEST(what_is_no_rectangle_is_refused) {
    vsh_light light;
    const struct {
        double *field, value;
        const char *message;
    } cases[] = {
        {&light.edge_u[0], 0.0, "edge_u (0, 0, 0): expected a length over 0"},
        {&light.edge_u[0], 1e-20, "edge_u has the length 1e-20, out of range 1e-15 … 1e+15"},
        {&light.edge_v[2], 1e200, "edge_v has the length inf, out of range 1e-15 … 1e+15"},
        {&light.edge_v[1], NAN, "edge_v[1] nan is out of range -inf (excluded) … inf (excluded)"},
        {&light.edge_v[0], 0.8,
         "edge_u and edge_v are not at right angles: the cosine between them is 0.707106781, of at most "
         "0.001"},
        {&light.position[2], INFINITY, "position[2] inf is out of range -inf (excluded) … inf (excluded)"},
        {&light.reach, 0.0, "reach 0 is out of range 0 (excluded) … inf (excluded)"},
    };
    char text[200];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        light = light_of(0);
        assert_int_equal(vsh_light_check(&light, NULL), VSH_OK);
        light.falloff = VSH_FALLOFF_QUADRATIC;
        *cases[i].field = cases[i].value;
        snprintf(text, sizeof text, "light 'panel': %s", cases[i].message);
        assert_fails(vsh_light_check(&light, &failure), VSH_ERROR_ARGUMENT, "");
        assert_string_equal(failure.message, text);
    }
    light = light_of(0);
    light.two_sided = 2;
    assert_fails(vsh_light_check(&light, &failure), VSH_ERROR_ARGUMENT, "");
    assert_string_equal(failure.message, "light 'panel': two_sided 2 is out of range 0 … 1");
    light = light_of(0);
    vsh_light_text(&light, text, sizeof text);
    assert_string_equal(text, "rectangle at 0.2 2.4 -0.3, sides 1.2 0 0 and 0 0 0.8, two-sided");
}

FIXTURE(set_up, tear_down)
