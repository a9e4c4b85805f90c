/* Irradiance: visibility × colour × falloff × cosine, each against its closed form. */
#include "shading.h"
#include "testing.h"

static const double ORIGIN[3] = {0.0, 0.0, 0.0};
static const float UP[3] = {0.0f, 1.0f, 0.0f};

/* Of one point at the origin, fully lit. */
static void lit(const vsh_light *light, const float normal[3], float rgb[3]) {
    const vsh_points points = {1, ORIGIN, normal, NULL};
    const float one = 1.0f;
    rgb[0] = rgb[1] = rgb[2] = 0.0f;
    vsh_shade_irradiance(&points, NULL, light, &one, rgb);
}

static float red(const vsh_light *light) {
    float rgb[3];
    lit(light, UP, rgb);
    return rgb[0];
}

TEST(the_cosine_to_the_light_weighs_it) {
    for (int degrees = 0; degrees <= 180; degrees += 5) {
        double towards[3];
        direction_at(RADIANS(degrees - 90), 0.7, towards);
        for (int axis = 0; axis < 3; ++axis) {
            towards[axis] *= 17.0; /* of any length */
        }
        const vsh_light light = sun(towards, 0.1);
        assert_float_equal(red(&light), fmax(0.0, sin(RADIANS(degrees - 90))), 1e-6);
    }
    /* normals of any length */
    const vsh_light light = sun((const double[]){1.0, 1.0, 0.0}, 0.1);
    float rgb[3];
    lit(&light, (const float[]){0.0f, 1e-3f, 0.0f}, rgb);
    assert_float_equal(rgb[0], sqrt(0.5), 1e-6);
}

TEST(shading_normals_stand_in_for_geometric_ones) {
    const vsh_points points = {1, ORIGIN, UP, NULL};
    const float one = 1.0f, sideways[3] = {1.0f, 0.0f, 0.0f};
    const vsh_light light = sun((const double[]){1.0, 0.0, 0.0}, 0.1);
    float rgb[3] = {0.0f, 0.0f, 0.0f};
    vsh_shade_irradiance(&points, NULL, &light, &one, rgb);
    assert_true(rgb[0] == 0.0f);
    vsh_shade_irradiance(&points, sideways, &light, &one, rgb);
    assert_float_equal(rgb[0], 1.0, 1e-6);
}

TEST(falloffs_follow_their_formulas) {
    for (double d = 0.3; d < 20.0; d *= 1.4) {
        vsh_light light = lamp((const double[]){0.0, d, 0.0}, 0.25);
        assert_float_equal(red(&light), 1.0, 1e-6);
        light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
        assert_true(fabs((double)red(&light) * d * d - 1.0) < 1e-6);
        light.falloff = VSH_FALLOFF_QUADRATIC;
        light.reach = 8.0;
        const double left = d < 8.0 ? 1.0 - d / 8.0 : 0.0;
        assert_float_equal(red(&light), left * left, 1e-6);
    }
}

TEST(a_point_at_the_light_gets_no_infinity) {
    const double distances[] = {0.0, 1e-300, 1e-30, 1e-3, 0.2};
    for (size_t i = 0; i < sizeof distances / sizeof distances[0]; ++i) {
        vsh_light light = lamp((const double[]){0.0, distances[i], 0.0}, 0.25);
        light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
        const float value = red(&light);
        assert_true(value >= 0.0f && value <= 16.0f + 1e-4f); /* as on the light's own surface */
    }
}

/* The red irradiance below a spot whose axis leans by `degrees` from the direction to the point. */
static float red_leaning(vsh_light light, double degrees) {
    light.axis[0] = 3.0 * sin(RADIANS(degrees));
    light.axis[1] = -3.0 * cos(RADIANS(degrees));
    light.axis[2] = 0.0;
    return red(&light);
}

TEST(a_spot_fades_smoothly_between_its_angles) {
    vsh_light light = lamp((const double[]){0.0, 2.0, 0.0}, 0.1);
    light.type = VSH_LIGHT_SPOT;
    light.inner_angle = RADIANS(20.0);
    light.outer_angle = RADIANS(40.0);
    float last = 2.0f;
    for (double degrees = 0.0; degrees <= 90.0; degrees += 0.5) {
        const float value = red_leaning(light, degrees);
        const double t = (cos(RADIANS(degrees)) - cos(light.outer_angle)) /
                         (cos(light.inner_angle) - cos(light.outer_angle));
        const double s = fmin(1.0, fmax(0.0, t));
        assert_float_equal(value, s * s * (3.0 - 2.0 * s), 1e-6);
        assert_true(value <= last);
        last = value;
    }
    /* without a soft edge */
    light.inner_angle = light.outer_angle;
    assert_true(red_leaning(light, 39.0) == 1.0f && red_leaning(light, 41.0) == 0.0f);
    /* as wide as can be, it is a sphere */
    light.outer_angle = light.inner_angle = PI;
    assert_true(red_leaning(light, 180.0) == 1.0f);
}

TEST(colour_and_visibility_multiply_and_lights_add) {
    enum { COUNT = 5 };
    const double positions[3 * COUNT] = {0.0};
    float normals[3 * COUNT], rgb[3 * COUNT];
    for (int i = 0; i < 3 * COUNT; ++i) {
        normals[i] = UP[i % 3];
        rgb[i] = 10.0f;
    }
    const float visible[COUNT] = {0.0f, 0.25f, 1.0f, (float)NAN, 0.5f};
    vsh_light light = sun((const double[]){0.0, 1.0, 0.0}, 0.1);
    memcpy(light.color, (const double[]){2.0, 0.5, 0.0}, sizeof light.color);
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_irradiance(&points, NULL, &light, visible, rgb);
    vsh_shade_irradiance(&points, NULL, &light, visible, rgb);
    for (int i = 0; i < COUNT; ++i) {
        const float v = isnan(visible[i]) ? 0.0f : visible[i];
        for (int c = 0; c < 3; ++c) {
            assert_float_equal(rgb[3 * i + c], 10.0 + 2.0 * (double)v * light.color[c], 1e-5);
        }
    }
    assert_true(rgb[9] == 10.0f); /* NaN adds nothing */
}

TEST(what_has_no_place_or_normal_adds_nothing) {
    const double positions[6] = {(double)NAN, 0.0, 0.0, 0.0, (double)INFINITY, 0.0};
    const float normals[6] = {0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    const float visible[2] = {1.0f, 1.0f};
    const vsh_light light = lamp((const double[]){0.0, 1.0, 0.0}, 0.1);
    const vsh_points points = {2, positions, normals, NULL};
    float rgb[6] = {0.0f};
    vsh_shade_irradiance(&points, NULL, &light, visible, rgb);
    const double here[6] = {0.0};
    const float bad[6] = {0.0f, 0.0f, 0.0f, (float)NAN, 1.0f, 0.0f};
    const vsh_points without = {2, here, bad, NULL};
    vsh_shade_irradiance(&without, NULL, &light, visible, rgb);
    for (int i = 0; i < 6; ++i) {
        assert_true(rgb[i] == 0.0f);
    }
    const vsh_points none = {0, NULL, NULL, NULL};
    vsh_shade_irradiance(&none, NULL, &light, NULL, NULL);
}
