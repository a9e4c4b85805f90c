/* KHR_lights_punctual: where lights stand, what they are as lights of a scene, and what is refused; in the
 * process itself and by a reader, which is this test. */
#define _GNU_SOURCE

#include "gltf_maker.h"
#include "served.h"
#include "testing.h"

static const char *lit_json(const char *nodes, const char *lights) {
    char rest[4096];
    FREED maker *m = begin();
    snprintf(rest, sizeof rest,
             "\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"mesh\":0},%s],\"extensions\":{"
             "\"KHR_lights_punctual\":{\"lights\":[%s]}}," MESH("\"POSITION\":0", ""),
             nodes, lights);
    return text_of(m, rest);
}

#define CARRIES(light) "\"extensions\":{\"KHR_lights_punctual\":{\"light\":" light "}}"

static const char nodes[] =
    /* turned by 90° about y: its -z is -x; three times as large; children 2 and 3 of it */
    "{\"name\":\"key\",\"translation\":[1,2,3],\"rotation\":[0,0.70710678118654752,0,0.70710678118654752],"
    "\"scale\":[3,3,3],\"children\":[2,3]," CARRIES("0") "},"
                                                         "{\"translation\":[0,0,-1]," CARRIES(
                                                             "1") "},{\"name\":\"a\\nb\"," CARRIES("2") "}";
static const char lights[] =
    "{\"type\":\"directional\",\"name\":\"unused\",\"color\":[1,0.5,0.25],\"intensity\":4},"
    "{\"type\":\"point\",\"name\":\"lamp\",\"range\":7},"
    "{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":0.125,\"outerConeAngle\":0.5},\"intensity\":2}";

static void assert_vector(const double *given, double x, double y, double z) {
    const double expected[3] = {x, y, z};
    for (int i = 0; i < 3; ++i) {
        if (!(fabs(given[i] - expected[i]) <= 1e-6)) {
            fail_msg("component %d is %.9g, expected %.9g", i, given[i], expected[i]);
        }
    }
}

TEST(lights_stand_where_their_nodes_do) {
    for (int reader = 0; reader < 2; ++reader) {
        OWNED(vsh_model) *model = read_gltf_by(reader != 0, lit_json(nodes, lights));
        assert_int_equal(vsh_model_light_count(model), 3);
        const vsh_model_light sun = vsh_model_get_light(model, 0), lamp = vsh_model_get_light(model, 1);
        const vsh_model_light spot = vsh_model_get_light(model, 2);
        assert_string_equal(sun.name, "key");
        assert_int_equal(sun.type, VSH_MODEL_LIGHT_DIRECTIONAL);
        assert_vector(sun.direction, -1, 0, 0);
        assert_vector(sun.color, 1, 0.5, 0.25);
        assert_true(sun.intensity == 4.0 && sun.range == 0.0 && sun.outer_angle == 0.0);
        assert_string_equal(lamp.name, "lamp"); /* its node has none */
        assert_int_equal(lamp.type, VSH_MODEL_LIGHT_POINT);
        assert_vector(lamp.position, 1 - 3, 2, 3); /* a unit in front of it, thrice as large */
        assert_vector(lamp.direction, 0, 0, 0);
        assert_vector(lamp.color, 1, 1, 1);
        assert_true(lamp.intensity == 1.0 && lamp.range == 7.0);
        assert_string_equal(spot.name, "a?b");
        assert_int_equal(spot.type, VSH_MODEL_LIGHT_SPOT);
        assert_vector(spot.position, 1, 2, 3);
        assert_vector(spot.direction, -1, 0, 0);
        assert_true(spot.inner_angle == 0.125 && spot.outer_angle == 0.5 && spot.intensity == 2.0);
    }
    OWNED(vsh_model) *model = read_text("a.obj", quad_obj);
    assert_int_equal(vsh_model_light_count(model), 0);
}

TEST(as_a_scenes_they_have_names_sizes_and_falloff) {
    vsh_light *made = NULL;
    size_t count = 0;
    OWNED(vsh_model) *model = read_gltf_by(
        false, lit_json("{\"name\":\"Key light\",\"translation\":[1,2,3],\"children\":[2,3]," CARRIES(
                            "0") "},"
                                 "{\"name\":\"Key_light\"," CARRIES("1") "},{" CARRIES("2") "}",
                        lights));
    assert_ok(vsh_lights_from_model(model, 0.25, 0.5, 0.01, &made, &count, &failure));
    assert_int_equal(count, 3);
    assert_string_equal(made[0].name, "Key_light");
    assert_string_equal(made[1].name, "Key_light_2");
    assert_string_equal(made[2].name, "light");
    assert_int_equal(made[0].type, VSH_LIGHT_DIRECTIONAL);
    assert_vector(made[0].direction, 0, 0, 1); /* towards it */
    assert_vector(made[0].color, 4, 2, 1);
    assert_true(made[0].angle == 0.25 && made[0].falloff == VSH_FALLOFF_NONE);
    assert_int_equal(made[1].type, VSH_LIGHT_SPHERE);
    assert_vector(made[1].position, 0.01, 0.02, 0.03); /* metres read as centimetres */
    assert_true(made[1].radius == 0.5 && made[1].falloff == VSH_FALLOFF_INVERSE_SQUARE);
    assert_int_equal(made[2].type, VSH_LIGHT_SPOT);
    assert_vector(made[2].axis, 0, 0, -1);
    assert_true(made[2].inner_angle == 0.125 && made[2].outer_angle == 0.5);
    vsh_lights_free(made);
    assert_int_equal(vsh_lights_from_model(model, 4.0, 0.5, 0.0, &made, &count, &failure),
                     VSH_ERROR_ARGUMENT);
    assert_null(made);
    assert_int_equal(vsh_lights_from_model(model, 0.1, -1.0, 0.0, &made, &count, &failure),
                     VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_lights_from_model(model, 0.1, 0.0, -1.0, &made, &count, &failure),
                     VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_lights_from_model(NULL, 0.1, 0.0, 0.0, &made, &count, &failure), VSH_ERROR_ARGUMENT);
}

TEST(wrong_lights_are_refused_by_their_number) {
    static const struct {
        const char *light, *part;
    } bad[] = {
        {"{\"type\":\"point\",\"intensity\":-1}", "its intensity is -1"},
        {"{\"type\":\"point\",\"intensity\":\"x\"}", "its intensity is no number"},
        {"{\"type\":\"point\",\"range\":-2}", "its range is -2"},
        {"{\"type\":\"point\",\"color\":[1,-1,1]}", "its color is no three numbers"},
        {"{\"type\":\"point\",\"color\":[1,\"red\"]}", "its color is no three numbers"},
        {"{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":2}}", "its outerConeAngle is 2"},
        {"{\"type\":\"spot\",\"spot\":{\"outerConeAngle\":0}}", "its outerConeAngle is 0"},
        {"{\"type\":\"spot\",\"spot\":{\"innerConeAngle\":1}}",
         "its innerConeAngle is 1, expected a number of 0 to "
         "0.785398"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        refused("a.gltf", lit_json("{" CARRIES("0") "}", bad[i].light), VSH_ERROR_INPUT, bad[i].part,
                "lights[0] of KHR_lights_punctual");
    }
    refused("a.gltf", lit_json("{" CARRIES("3") "}", lights), VSH_ERROR_INPUT, "none of the 3", "nodes[1]");
    refused("a.gltf", lit_json("{" CARRIES("-1") "}", lights), VSH_ERROR_INPUT, "none of the 3", "nodes[1]");
    refused("a.gltf", lit_json("{" CARRIES("{}") "}", lights), VSH_ERROR_INPUT, "none of the 3", "nodes[1]");
}

TEST(what_points_nowhere_or_is_not_known_is_left_out_with_a_warning) {
    vsh_model *model = read_text("a.gltf", lit_json("{\"scale\":[1,1,0]," CARRIES("0") "}", lights));
    assert_int_equal(vsh_model_light_count(model), 0);
    assert_non_null(strstr(warnings, "the light of nodes[1] is left out"));
    vsh_model_free(model);
    model = read_text("a.gltf", lit_json("{" CARRIES("0") "}", "{\"type\":\"area\"}"));
    assert_int_equal(vsh_model_light_count(model), 0);
    assert_non_null(strstr(warnings, "lights[0] of KHR_lights_punctual is left out"));
    vsh_model_free(model);
    model = read_text("a.gltf", lit_json("{\"scale\":[0,0,0]," CARRIES("0") "}",
                                         "{\"type\":\"point\"}")); /* which points nowhere anyway */
    assert_int_equal(vsh_model_light_count(model), 1);
    vsh_model_free(model);
}

static void look_at_lights(const vsh_model *model) {
    vsh_light *made = NULL;
    size_t count;
    for (size_t i = 0; i < vsh_model_light_count(model); ++i) {
        const vsh_model_light light = vsh_model_get_light(model, i);
        assert_in_range(light.type, 0, VSH_MODEL_LIGHT_SPOT);
        assert_true(light.inner_angle <= light.outer_angle && light.outer_angle <= 1.5708);
        assert_true(light.intensity >= 0.0 && isfinite(light.intensity) && light.range >= 0.0);
    }
    if (vsh_lights_from_model(model, 0.1, 0.1, 0.0, &made, &count, &failure) == VSH_OK) {
        vsh_lights_free(made);
    }
}

TEST(what_a_reader_tells_of_lights_is_refused_or_in_range) {
    const char *json = lit_json(nodes, lights);
    write_bytes("a.gltf", json, strlen(json));
    tell_wrong("a.gltf", wrong_words, WRONG_WORDS, look_at_lights, 200, 20);
    assert_int_equal(unlink(path_of("a.gltf").text), 0);
}

FIXTURE(make_folder, remove_folder)
