/* vsh_light_check() and names of constants. */
#include "fields.h"
#include "light/light.h"
#include "testing.h"

static vsh_light sun(void) {
    return vsh_light_default();
}

static vsh_light lamp(void) {
    vsh_light light = vsh_light_default();
    light.type = VSH_LIGHT_SPHERE;
    light.radius = 0.25;
    strcpy(light.name, "lamp");
    return light;
}

static vsh_light spot(void) {
    vsh_light light = lamp();
    light.type = VSH_LIGHT_SPOT;
    strcpy(light.name, "spot");
    return light;
}

static vsh_light fading(void) {
    vsh_light light = lamp();
    light.falloff = VSH_FALLOFF_QUADRATIC;
    return light;
}

static vsh_light area(void) {
    vsh_light light = fading();
    light.type = VSH_LIGHT_RECTANGLE;
    light.edge_u[0] = 1.2;
    light.edge_u[1] = light.edge_u[2] = light.edge_v[0] = light.edge_v[1] = 0.0;
    light.edge_v[2] = 0.8;
    strcpy(light.name, "area");
    return light;
}

static void accepts(const vsh_light *light) {
    failure.message[0] = '\0';
    assert_ok(vsh_light_check(light, &failure));
    assert_string_equal(failure.message, "");
}

/* `message` follows "light 'NAME': ", unless it begins with "light" itself. */
static void refuses(const vsh_light *light, const char *message) {
    char whole[200];
    snprintf(whole, sizeof whole, "light '%s': ", light != NULL ? light->name : "");
    strcat(whole, message);
    const char *expected = strncmp(message, "light", 5) == 0 ? message : whole;
    assert_fails(vsh_light_check(light, &failure), VSH_ERROR_ARGUMENT, expected);
    assert_int_equal(failure.code, VSH_ERROR_ARGUMENT);
    assert_string_equal(failure.message, expected);
    assert_int_equal(vsh_light_check(light, NULL), VSH_ERROR_ARGUMENT);
}

TEST(defaults_zero_sizes_and_fields_of_other_types_pass) {
    vsh_light lights[8] = {sun(), lamp(), spot(), sun(), lamp(), sun(), lamp(), area()};
    lights[3].angle = lights[4].radius = 0.0;
    vsh_light *light = &lights[5];
    light->radius = -1.0;
    light->position[0] = light->inner_angle = NAN;
    light->outer_angle = 9.0;
    light->falloff = VSH_FALLOFF_QUADRATIC;
    light->reach = 0.0;
    ++light;
    light->angle = light->reach = -1.0;
    memset(light->direction, 0, sizeof light->direction);
    for (size_t i = 0; i < COUNT_OF(lights); ++i) {
        accepts(&lights[i]);
    }
}

TEST(the_ends_of_angles_are_in_range) {
    const double pi = 3.14159265358979323846;
    vsh_light light = sun();
    light.angle = nextafter(pi, 0.0);
    accepts(&light);
    light = spot();
    light.outer_angle = light.inner_angle = 2.0 * pi;
    accepts(&light);
}

TEST(bad_values_are_named_with_field_and_limit) {
    vsh_light light;
    const struct {
        vsh_light (*make)(void);
        double *field, value;
        const char *message;
    } cases[] = {
        {sun, &light.angle, -0.5, "angle -0.5 is out of range 0 … 3.14159265 (excluded)"},
        {sun, &light.angle, 3.14159265358979323846,
         "angle 3.14159265 is out of range 0 … 3.14159265 (excluded)"},
        {sun, &light.direction[1], 0.0, "direction (0, 0, 0): expected a length over 0"},
        {sun, &light.direction[2], INFINITY,
         "direction[2] inf is out of range -inf (excluded) … inf (excluded)"},
        {sun, &light.color[1], -1.0, "color[1] -1 is out of range 0 … inf (excluded)"},
        {lamp, &light.radius, -2.0, "radius -2 is out of range 0 … inf (excluded)"},
        {lamp, &light.position[2], NAN, "position[2] nan is out of range -inf (excluded) … inf (excluded)"},
        {fading, &light.reach, 0.0, "reach 0 is out of range 0 (excluded) … inf (excluded)"},
        {area, &light.edge_u[0], 0.0, "edge_u (0, 0, 0): expected a length over 0"},
        {area, &light.edge_u[0], 1e-20, "edge_u has the length 1e-20, out of range 1e-15 … 1e+15"},
        {area, &light.edge_v[2], 1e200, "edge_v has the length inf, out of range 1e-15 … 1e+15"},
        {area, &light.edge_v[1], NAN, "edge_v[1] nan is out of range -inf (excluded) … inf (excluded)"},
        {area, &light.edge_v[0], 0.8,
         "edge_u and edge_v are not at right angles: the cosine between them is 0.707106781, of at most "
         "0.001"},
        {spot, &light.axis[1], 0.0, "axis (0, 0, 0): expected a length over 0"},
        {spot, &light.axis[0], NAN, "axis[0] nan is out of range -inf (excluded) … inf (excluded)"},
        {spot, &light.inner_angle, 1.75, "inner_angle 1.75 is out of range 0 … outer_angle 1"},
        {spot, &light.outer_angle, 0.0, "outer_angle 0 is out of range 0 (excluded) … 6.28318531"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        light = cases[i].make();
        *cases[i].field = cases[i].value;
        refuses(&light, cases[i].message);
    }
    light = sun();
    light.type = VSH_LIGHT_RECTANGLE + 1;
    refuses(&light, "type 4 is out of range 0 … 3");
    light = area();
    light.two_sided = 2;
    refuses(&light, "two_sided 2 is out of range 0 … 1");
    light.two_sided = 1;
    light.falloff = VSH_FALLOFF_NONE;
    char text[200];
    vsh_light_text(&light, text, sizeof text);
    assert_string_equal(text, "rectangle at 0 0 0, sides 1.2 0 0 and 0 0 0.8, two-sided");
    light = sun();
    light.falloff = -1;
    refuses(&light, "falloff -1 is out of range 0 … 2");
    refuses(NULL, "light: is NULL");
}

TEST(lights_have_names_that_a_channel_can_hold) {
    static const char *const good[] = {"key-Light_2", "",
                                       "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx"};
    vsh_light light = sun();
    for (size_t i = 0; i < 3; ++i) {
        strcpy(light.name, good[i]);
        accepts(&light);
    }
    light.name[63] = 'x'; /* without an end */
    assert_int_equal(vsh_light_check(&light, NULL), VSH_ERROR_ARGUMENT);
    strcpy(light.name, "a.b");
    refuses(&light, "light: name 'a.b': expected at most 63 letters, digits, '_' and '-'");
}

/* test_reach.py compares names with the constants of the headers. */
TEST(constants_and_names_find_each_other) {
    enum { KINDS = VSH_NAMES_MEASURE + 1 };
    static const int32_t counts[KINDS] = {4, 10, 6, 3, 3, 4, 3, 2, 2, 3, 2, 7, 3, 2, 3, 4, 8};
    for (int32_t kind = 0; kind < KINDS; ++kind) {
        for (int32_t value = 0; value < counts[kind]; ++value) {
            const char *name = vsh_get_name(kind, value);
            assert_non_null(name);
            assert_int_equal(vsh_find_name(kind, name), value);
        }
        assert_null(vsh_get_name(kind, counts[kind]));
        assert_null(vsh_get_name(kind, -1));
        assert_null(vsh_get_name(kind, INT32_MAX));
        assert_int_equal(vsh_find_name(kind, ""), -1);
        assert_int_equal(vsh_find_name(kind, NULL), -1);
    }
    assert_string_equal(vsh_get_name(VSH_NAMES_FLAT_LIGHT, VSH_LIGHT_SPHERE), "disc");
    assert_int_equal(vsh_find_name(VSH_NAMES_SHADOW, "Cone"), -1);
    assert_int_equal(vsh_find_name(VSH_NAMES_AO, "cone"), -1);
    for (int32_t kind = -1; kind <= KINDS; kind += KINDS + 1) {
        assert_null(vsh_get_name(kind, 0));
        assert_int_equal(vsh_find_name(kind, "none"), -1);
    }
}

/* Against points spread over the ball. */
TEST(a_ball_that_a_light_covers_has_covered_points_alone) {
    enum { BALLS = 3000, POINTS = 200 };
    uint64_t counter = 1;
    size_t parts[3] = {0};
    for (int ball = 0; ball < BALLS; ++ball) {
        vsh_light light = ball % 2 != 0 ? spot() : lamp();
        light.falloff = ball % 3 != 0 ? VSH_FALLOFF_QUADRATIC : VSH_FALLOFF_NONE;
        light.reach = between(&counter, 0.5, 3.0);
        light.inner_angle = 0.1;
        light.outer_angle = between(&counter, 0.1, 3.1);
        double matrix[12] = {0.0, 2.0, 0.0, 1.0, -2.0, 0.0, 0.0, 3.0, 0.0, 0.0, 2.0, -5.0};
        const vshi_light_place world = vshi_light_in_world(&light);
        const vshi_light_place moved = vshi_light_moved(&world, matrix, 0.5);
        const vshi_vec centre = {between(&counter, -2.0, 2.0), between(&counter, -2.0, 2.0),
                                 between(&counter, -2.0, 2.0)};
        const double radius = between(&counter, 0.01, 1.5);
        const vshi_light_part part = vshi_light_covers(&world, centre, radius);
        ++parts[part];
        assert_int_equal(vshi_light_covers(&moved, vshi_transform_point(matrix, centre), radius / 0.5), part);
        for (int i = 0; i < POINTS; ++i) {
            const vshi_vec off = {between(&counter, -1.0, 1.0), between(&counter, -1.0, 1.0),
                                  between(&counter, -1.0, 1.0)};
            if (vshi_length(off) > 1.0) {
                continue;
            }
            const vshi_vec at = vshi_add(centre, vshi_scale(off, radius));
            vshi_vec to;
            const double distance = vshi_light_towards(&world, at, &to);
            const bool lit = vshi_light_lights(&world, at);
            assert_true(part == VSHI_LIGHT_SOME_PART || lit == (part == VSHI_LIGHT_ALL));
            assert_true(lit == (vshi_light_gain(&light, to, distance) > 0.0));
        }
    }
    assert_true(parts[0] > 100 && parts[1] > 100 && parts[2] > 100);
}
