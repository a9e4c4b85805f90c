/* Scenes that are wrong, damaged, too large or not there. */
#include "scenes.h"

#include "base/error.h"
#include "scene/parts.h"
#include "shade/shade.h"

#include <vdbshade/settings.h>

#include <unistd.h>

/* A scene around one part, so that the table below can be short. */
#define CASTERS "{\"casters\":[{\"mesh\":\"a\"}],"

#define SDF(node) "{\"casters\":[{\"sdf\":" node "}]}"

#define LAYER(layer) CASTERS "\n\"layers\":[" layer "]}"

#define LIGHT(light) CASTERS "\n\"lights\":[" light "]}"

#define RECEIVER(receiver) CASTERS "\n\"receivers\":[{\"mesh\":\"m\",\"output\":\"o\"}," receiver "]}"

/* An @ stands before the place that the message must tell, and is taken out of the text. */
static const struct {
    const char *text;
    const char *message; /* behind "s.json:", or where there is an @, behind its line and column */
} bad[] = {
    /* not JSON */
    {"", "1:1: '[' or '{' expected near end of file"},
    {"{\n \"casters\": [nope]}", "2:17: invalid token near 'nope'"},
    {"{\"casters\": 1,\n \"casters\": 2}", "2:10: duplicate object key near '\"casters\"'"},
    {"{\"voxel_size\": NaN}", "1:18: invalid token near 'NaN'"},
    {"{\"voxel_size\": 1e999}", "1:20: real number overflow near '1e999'"},
    {"{} {}", "1:4: end of file expected near '{'"},
    /* the whole */
    {"@[]", "expected an object, found an array"},
    {" @{}", "key \"casters\" is missing: a scene needs it"},
    {"{\"casters\":@[]}", "casters: has 0 items, out of range 1 … 65536"},
    {"{\"casters\":@{}}", "casters: expected an array, found an object"},
    {"{\n\t@\"castors\": []}", "castors: unknown key; did you mean \"casters\"?"},
    {CASTERS "@\"é\":1,\"xyzzy\":1}", "é: unknown key"},
    {CASTERS "\"method\":@\"ré\",\"xyzzy\":1}",
     "method: \"ré\" is none of hard, classic, practical, improved, smooth, cone, rays, adaptive, "
     "exact, auto"},
    {CASTERS "\"method\":\"cone\",@\"xyzzy\":1}", "xyzzy: unknown key"},
    {"{\"receivers\":[],\"\\u0061o\":{\"distance\":1,@\"cone\":1}}",
     "ao.cone: unknown key; did you mean \"cones\"?"},
    {CASTERS "\"voxel_size\":@0}", "voxel_size: 0 is out of range 1e-12 … 1e+12"},
    {CASTERS "\"voxel_size\":@-1}", "voxel_size: -1 is out of range 1e-12 … 1e+12"},
    {CASTERS "\"voxel_size\":@1e13}", "voxel_size: 1e+13 is out of range 1e-12 … 1e+12"},
    {LAYER("{\"name\":\"a\",\"voxel_size\":@1e-13}"),
     "layers[0].voxel_size: 1e-13 is out of range 1e-12 … 1e+12"},
    {CASTERS "\"ao\":{\"distance\":@5e-324}}", "ao.distance: 4.94065646e-324 is out of range 1e-12 … 1e+15"},
    {CASTERS "\"voxel_size\":@\"1\"}", "voxel_size: expected a number, found a string"},
    {CASTERS "\"voxel_size\":1,@\"resolution\":9}", "resolution: cannot stand beside \"voxel_size\""},
    {CASTERS "\"resolution\":@1}", "resolution: 1 is out of range 2 … 65536"},
    {CASTERS "\"resolution\":@99999999999999999999}", "resolution: 1e+20 is out of range 2 … 65536"},
    {CASTERS "\"resolution\":@2.5}", "resolution: 2.5 is not a whole number"},
    {CASTERS "\"half_width\":@2}", "half_width: 2 is out of range 3 … 100"},
    {CASTERS "\"shell_thickness\":@51}", "shell_thickness: 51 is out of range 1 … 50"},
    {CASTERS "\"max_steps\":@15}", "max_steps: 15 is out of range 16 … 65536"},
    {CASTERS "\"start_offset\":@17}", "start_offset: 17 is out of range 0 … 16"},
    /* layers */
    {LAYER("@{}"), "layers[0]: key \"name\" is missing: a layer needs it"},
    {LAYER("{\"name\":\"a\"},{\"name\":@\"a\"}"), "layers[1].name: \"a\" is the name of layers[0] too"},
    {LAYER("{\"name\":\"a\",\"remap\":@[0.5,0.5]}"),
     "layers[0].remap: expected two numbers that rise, found 0.5 and 0.5"},
    {LAYER("{\"name\":\"a\",\"softness\":@-1}"), "layers[0].softness: -1 is out of range 0 … 1000"},
    {LAYER("{\"name\":\"a\",\"combine\":@\"max\"}"), "layers[0].combine: \"max\" is none of multiply, min"},
    {LAYER("{\"name\":\"a\",\"lights\":[@\"sun\"]}"),
     "layers[0].lights[0]: \"sun\" is none of the scene's lights"},
    {LAYER("{\"name\":\"a\",\"voxel_size\":1,@\"resolution\":9}"),
     "layers[0].resolution: cannot stand beside \"voxel_size\""},
    {LIGHT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":[0,1,0],\"layers\":[@\"b\"]}"),
     "lights[0].layers[0]: \"b\" is none of the scene's layers"},
    {LIGHT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":[0,1,0],\"layers\":@\"b\"}"),
     "lights[0].layers: expected an array, found a string"},
    {"{\"casters\":[{\"mesh\":\"a\",\"layer\":@\"b\"}],\"layers\":[{\"name\":\"a\"}]}",
     "casters[0].layer: \"b\" is none of the scene's layers"},
    {CASTERS "\"irradiance\":@1}", "irradiance: expected true or false, found a number"},
    {CASTERS "\"irradiance\":@null}", "irradiance: expected true or false, found null"},
    {CASTERS "\"ao\":@{}}", "ao: key \"distance\" is missing: ao needs it"},
    {CASTERS "\"ao\":{\"distance\":@0}}", "ao.distance: 0 is out of range 1e-12 … 1e+15"},
    {CASTERS "\"ao\":{\"distance\":1,\"cones\":@257}}", "ao.cones: 257 is out of range 1 … 256"},
    {CASTERS "\"ao\":{@\"cones\":8,\"method\":\"taps\",\"distance\":1}}",
     "ao.cones: is no key of ao by taps"},
    {CASTERS "\"ao\":{\"method\":@\"ray\"}}",
     "ao.method: \"ray\" is none of taps, cones, rays, adaptive, exact, auto"},
    {CASTERS "\"ao\":{@\"cones\":8,\"method\":\"rays\",\"distance\":1}}",
     "ao.cones: is no key of ao by rays"},
    {CASTERS "\"rays\":@0}", "rays: 0 is out of range 1 … 4096"},
    {CASTERS "\"rays\":@4097}", "rays: 4097 is out of range 1 … 4096"},
    {CASTERS "\"sampler\":@\"green\"}", "sampler: \"green\" is none of sobol, white, blue"},
    {CASTERS "\"frame\":@-1}", "frame: -1 is out of range 0 … 2.14748365e+09"},
    {CASTERS "\"early_rays\":@4097}", "early_rays: 4097 is out of range 0 … 4096"},
    {CASTERS "\"max_error\":@0}", "max_error: 0 is out of range 0.0001 … 1"},
    {CASTERS "\"error\":@1}", "error: expected true or false, found a number"},
    /* casters */
    {"{\"casters\":[{\"mesh\":\"a\"},@7]}", "casters[1]: expected an object, found a number"},
    {"{\"casters\":[@{}]}", "casters[0]: key \"mesh\", \"sdf\", \"vdb\", \"heightfield\", \"spheres\", "
                            "\"mask\" or \"text\" is missing"},
    {"{\"casters\":[@{\"mask\":\"a\",\"size\":1}]}",
     "casters[0]: key \"thickness\" is missing: a mask caster needs it"},
    {"{\"casters\":[{\"mask\":\"a\",\"size\":@0,\"thickness\":1}]}",
     "casters[0].size: 0 is out of range 0 (excluded) … 1e+15"},
    {"{\"casters\":[{\"mask\":\"a\",\"size\":1,\"thickness\":@0}]}",
     "casters[0].thickness: 0 is out of range 0 (excluded) … 1e+15"},
    {"{\"casters\":[{\"mesh\":\"a\",@\"thickness\":1}]}", "casters[0].thickness: is no key of a mesh caster"},
    {"{\"casters\":[{\"mask\":\"a\",@\"font\":\"f\"}]}", "casters[0].font: is no key of a mask caster"},
    {"{\"casters\":[@{\"text\":\"a\",\"thickness\":1,\"height\":1}]}",
     "casters[0]: key \"font\" is missing: a text caster needs it"},
    {"{\"casters\":[{\"text\":\"a\",\"transform\":@{\"scale\":[1,1,2]},\"font\":\"f\",\"height\":1,"
     "\"thickness\":1}]}",
     "casters[0].transform: shears or scales unevenly, which a text caster cannot"},
    {"{\"casters\":[{@\"mush\":\"a\"}]}", "casters[0].mush: unknown key; did you mean \"mesh\"?"},
    {"{\"casters\":[{\"mesh\":@\"\"}]}", "casters[0].mesh: is empty"},
    {"{\"casters\":[{\"vdb\":\"a\",@\"mesh\":\"a\"}]}", "casters[0].mesh: cannot stand beside \"vdb\""},
    {"{\"casters\":[{\"mesh\":\"a\",@\"grid\":\"g\"}]}", "casters[0].grid: is no key of a mesh caster"},
    {"{\"casters\":[{\"vdb\":\"a\",\"transform\":@{\"scale\":[1,1,2]}}]}",
     "casters[0].transform: shears or scales unevenly, which a vdb caster cannot"},
    {"{\"casters\":[{\"vdb\":\"a\",\"transform\":@{\"matrix\":[1,1,0,0,0,1,0,0,0,0,1,0]}}]}",
     "casters[0].transform: shears or scales unevenly, which a vdb caster cannot"},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"scale\":@0}}]}",
     "casters[0].transform.scale: 0 is out of range 1e-06 … 1000000"},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"matrix\":@[1,1,0,0,1,1,0,0,0,0,1,0]}}]}",
     "casters[0].transform.matrix: flattens: the determinant of its first three columns is 0"},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"matrix\":@[1,0,0]}}]}",
     "casters[0].transform.matrix: expected 12 numbers, found 3"},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"rotate_quat\":@[0,0,0,0]}}]}",
     "casters[0].transform.rotate_quat: is zero, and so points nowhere"},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"rotate_deg\":[0,0,1],@\"rotate_quat\":[0,0,0,1]}}]}",
     "casters[0].transform.rotate_quat: cannot stand beside \"rotate_deg\""},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"matrix\":[1,0,0,0,0,1,0,0,0,0,1,0],@\"scale\":2}}]}",
     "casters[0].transform.scale: cannot stand beside \"matrix\""},
    {"{\"casters\":[{\"mesh\":\"a\",\"transform\":{\"translate\":[0,\n@\"\",0]}}]}",
     "casters[0].transform.translate[1]: expected a number, found a string"},
    /* SDF trees */
    {SDF("@{}"), "casters[0].sdf: key \"shape\" or \"op\" is missing"},
    {SDF("{\"shape\":@\"cube\"}"),
     "casters[0].sdf.shape: \"cube\" is none of sphere, box, torus, plane, capsule, cylinder, cone"},
    {SDF("{\"op\":@\"xor\"}"),
     "casters[0].sdf.op: \"xor\" is none of union, intersection, subtraction, smooth_union"},
    {SDF("{\"op\":\"union\",@\"shape\":\"box\"}"), "casters[0].sdf.shape: cannot stand beside \"op\""},
    {SDF("@{\"shape\":\"sphere\"}"), "casters[0].sdf: key \"radius\" is missing: a sphere needs it"},
    {SDF("{\"shape\":\"sphere\",\"radius\":@0}"),
     "casters[0].sdf.radius: 0 is out of range 0 (excluded) … 1e+15"},
    {SDF("{\"shape\":\"sphere\",\"radius\":1,@\"rounding\":1}"),
     "casters[0].sdf.rounding: is no key of a sphere"},
    {SDF("{\"shape\":\"box\",\"half_size\":[1,1,@-1]}"),
     "casters[0].sdf.half_size[2]: -1 is out of range 0 (excluded) … 1e+15"},
    {SDF("{\"shape\":\"plane\",\"thickness\":1,\"half_size\":@[1,1,1]}"),
     "casters[0].sdf.half_size: expected 2 numbers, found 3"},
    {SDF("@{\"op\":\"union\"}"), "casters[0].sdf: key \"of\" is missing: a union needs it"},
    {SDF("{\"op\":\"union\",\"of\":@[{\"shape\":\"sphere\",\"radius\":1}]}"),
     "casters[0].sdf.of: has 1 items, out of range 2 … 65536"},
    {SDF("{\"op\":\"union\",@\"smoothing\":1,\"of\":[]}"), "casters[0].sdf.smoothing: is no key of a union"},
    {SDF("{\"op\":\"union\",\"of\":[{\"shape\":\"sphere\",\"radius\":1},\n  "
         "{\"shape\":\"sphere\",\n@\"radus\":1}]}"),
     "casters[0].sdf.of[1].radus: unknown key; did you mean \"radius\"?"},
    {SDF("{\"shape\":\"sphere\",\"radius\":1,\"scale\":@0}"),
     "casters[0].sdf.scale: 0 is out of range 1e-06 … 1000000"},
    {SDF("{\"shape\":\"sphere\",\"radius\":1,\"scale\":@[1,1,1]}"),
     "casters[0].sdf.scale: expected a number, found an array"},
    /* lights */
    {LIGHT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":[0,1,0],\"angle_deg\":@400}"),
     "lights[0].angle_deg: 400 is out of range 0 … 180 (excluded)"},
    {LIGHT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":[0,1,0],\"angle_deg\":@180}"),
     "lights[0].angle_deg: 180 is out of range 0 … 180 (excluded)"},
    {LIGHT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":@[0,0,-0.0]}"),
     "lights[0].direction: is zero, and so points nowhere"},
    {LIGHT("{\"name\":\"a\",\"type\":\"directional\",@\"radius\":1}"),
     "lights[0].radius: is no key of a directional light"},
    {LIGHT("{\"name\":\"a\",@\"typ\":\"spot\"}"), "lights[0].typ: unknown key; did you mean \"type\"?"},
    {LIGHT("@{\"name\":\"a\",\"radius\":1}"), "lights[0]: key \"type\" is missing: a light needs it"},
    {LIGHT("{\"name\":\"a\",\"type\":@\"sun\"}"),
     "lights[0].type: \"sun\" is none of directional, sphere, spot, rectangle, file"},
    {LIGHT("@{\"type\":\"sphere\",\"position\":[0,0,0]}"),
     "lights[0]: key \"name\" is missing: a sphere light needs it"},
    {LIGHT("@{\"name\":\"a\",\"type\":\"sphere\"}"),
     "lights[0]: key \"position\" is missing: a sphere light needs it"},
    {LIGHT("{\"name\":@\"a b\",\"type\":\"sphere\"}"),
     "lights[0].name: \"a b\" is no light's name: 1 … 63 of A … Z, a … z, 0 … 9, _ and -"},
    {LIGHT("{\"name\":\"a\",\"type\":\"sphere\",\"position\":[0,0,0]},{\"name\":@\"a\",\"type\":\"sphere\","
           "\"position\":[0,0,0]}"),
     "lights[1].name: \"a\" is the name of lights[0] too"},
    {LIGHT("@{\"name\":\"a\",\"type\":\"sphere\",\"position\":[0,0,0],\"falloff\":\"quadratic\"}"),
     "lights[0]: key \"reach\" is missing: falloff \"quadratic\" needs it"},
    {LIGHT("{\"name\":\"a\",\"type\":\"sphere\",\"position\":[0,0,0],@\"reach\":1}"),
     "lights[0].reach: is of no use without falloff \"quadratic\""},
    {LIGHT("{\"name\":\"a\",\"type\":\"spot\",\"position\":[0,0,0],\"direction\":[0,1,0],\"inner_deg\":@9,"
           "\"outer_deg\":8}"),
     "lights[0].inner_deg: 9 is over outer_deg, 8"},
    {LIGHT("{\"name\":\"a\",\"type\":\"sphere\",\"position\":[0,0,0],\"color\":[1,@-1,1]}"),
     "lights[0].color[1]: -1 is out of range 0 … 1e+15"},
    {LIGHT("@{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[0,0,0],\"edge_u\":[1,0,0]}"),
     "lights[0]: key \"edge_v\" is missing: a rectangle light needs it"},
    {LIGHT("{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[0,0,0],@\"radius\":1}"),
     "lights[0].radius: is no key of a rectangle light"},
    {LIGHT("{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[0,0,0],\"edge_u\":@[0,0,0]}"),
     "lights[0].edge_u: is zero, and so points nowhere"},
    {LIGHT("{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[0,0,0],\"two_sided\":@1}"),
     "lights[0].two_sided: expected true or false, found a number"},
    {LIGHT("@{\"name\":\"a\",\"type\":\"rectangle\",\"position\":[0,0,0],\"edge_u\":[1,0,0],"
           "\"edge_v\":[1,1,0]}"),
     "lights[0]: light 'a': edge_u and edge_v are not at right angles: the cosine between them is "
     "0.707106781, "
     "of at most 0.001"},
    {LIGHT("{\"name\":\"a\",\"type\":\"sphere\",\"position\":[0,0,0],@\"edge_u\":[1,0,0]}"),
     "lights[0].edge_u: is no key of a sphere light"},
    /* heightfields */
    {"{\"casters\":[@{\"heightfield\":\"a\",\"height\":1}]}",
     "casters[0]: key \"extent\" is missing: a heightfield caster needs it"},
    {"{\"casters\":[@{\"heightfield\":\"a\",\"size\":[1,1]}]}",
     "casters[0]: key \"height\" is missing: a heightfield caster needs it"},
    {"{\"casters\":[{\"heightfield\":\"a\",\"height\":1,\"size\":[1,@0]}]}",
     "casters[0].size[1]: 0 is out of range 1e-12 … 1e+12"},
    {"{\"casters\":[{\"heightfield\":\"a\",\"height\":1,\"size\":[1,1],\"base\":@0}]}",
     "casters[0].base: 0 is out of range 0 (excluded) … 1e+12"},
    {"{\"casters\":[{\"mesh\":\"a\",@\"height\":1}]}", "casters[0].height: is no key of a mesh caster"},
    {"{\"casters\":[{\"heightfield\":\"a\",\"height\":1,\"size\":[1,1],\"transform\":@{\"scale\":[1,1,2]}}]}",
     "casters[0].transform: shears or scales unevenly, which a heightfield caster cannot"},
    {"{\"casters\":[{\"heightfield\":\"a\",\"height\":1,\"size\":[1,1],\"direct\":@1}]}",
     "casters[0].direct: expected true or false, found a number"},
    {"{\"casters\":[{\"heightfield\":\"a\",\"height\":1,\"size\":[1,1],@\"voxelised\":true}]}",
     "casters[0].voxelised: is no key of a heightfield caster"},
    /* spheres */
    {"{\"casters\":[{\"spheres\":@7}]}",
     "casters[0].spheres: expected a file's name or an array of [x, y, z, radius]"},
    {"{\"casters\":[{\"spheres\":@[]}]}", "casters[0].spheres: is empty"},
    {"{\"casters\":[{\"spheres\":@\"\"}]}", "casters[0].spheres: is empty"},
    {"{\"casters\":[{\"spheres\":[[1,2,3,4],@[1,2,3]]}]}",
     "casters[0].spheres[1]: expected 4 numbers, found 3"},
    {"{\"casters\":[{\"spheres\":[[1,2,3,@-4]]}]}",
     "casters[0].spheres[0][3]: -4 is out of range 0 (excluded) … 1e+15"},
    {"{\"casters\":[{\"spheres\":[[1,2,@1e16,4]]}]}",
     "casters[0].spheres[0][2]: 1e+16 is out of range -1e+15 … 1e+15"},
    {"{\"casters\":[{\"spheres\":[[1,2,3,4]],\"transform\":@{\"scale\":[1,1,2]}}]}",
     "casters[0].transform: shears or scales unevenly, which a caster of spheres cannot"},
    {RECEIVER("{\"mesh\":\"m\",@\"heightfield\":\"h\"}"),
     "receivers[1].heightfield: cannot stand beside \"mesh\""},
    {RECEIVER("{\"heightfield\":\"h\",@\"uv_set\":0}"),
     "receivers[1].uv_set: is no key of a heightfield receiver"},
    {RECEIVER("@{\"heightfield\":\"h\",\"height\":1,\"output\":\"p\"}"),
     "receivers[1]: key \"extent\" is missing: a heightfield receiver needs it"},
    {RECEIVER("{\"mesh\":\"m\",@\"plane\":{}}"), "receivers[1].plane: cannot stand beside \"mesh\""},
    {RECEIVER("{\"plane\":@{},\"output\":\"p\"}"),
     "receivers[1].plane: key \"size\" is missing: a plane needs it"},
    {RECEIVER("{\"plane\":{\"size\":[1,1],\"normal\":@[0,0,0]},\"output\":\"p\"}"),
     "receivers[1].plane.normal: is zero, and so points nowhere"},
    {RECEIVER("{\"plane\":{},@\"uv_set\":1}"), "receivers[1].uv_set: is no key of a plane receiver"},
    {"{\"region\":@[0,0,1,1]}", "region: belongs to flat scenes, which 'vdbshade flat' bakes"},
    /* receivers */
    {RECEIVER("@{}"), "receivers[1]: key \"mesh\" is missing: a receiver needs it"},
    {RECEIVER("@{\"mesh\":\"m\"}"), "receivers[1]: key \"output\" is missing: a receiver needs it"},
    {RECEIVER("{\"output\":@\"o\",\"mesh\":\"m\"}"),
     "receivers[1].output: \"o\" is the output of receivers[0] too"},
    {RECEIVER("{\"size\":@0}"), "receivers[1].size: 0 is out of range 1 … 65536"},
    {RECEIVER("{\"size\":@1000000}"), "receivers[1].size: 1000000 is out of range 1 … 65536"},
    {RECEIVER("{\"size\":@[1]}"), "receivers[1].size: expected 2 numbers, found 1"},
    {RECEIVER("{\"size\":[1,@0]}"), "receivers[1].size[1]: 0 is out of range 1 … 65536"},
    {RECEIVER("{\"uv_set\":@8}"), "receivers[1].uv_set: 8 is out of range 0 … 7"},
    {RECEIVER("{\"supersample\":@17}"), "receivers[1].supersample: 17 is out of range 1 … 16"},
    {RECEIVER("{\"padding\":@-1}"), "receivers[1].padding: -1 is out of range 0 … 4096"},
    {RECEIVER("{\"bits\":@12}"), "receivers[1].bits: 12 is none of 0, 8, 16, 32"},
    {RECEIVER("{\"pack\":@\"\"}"), "receivers[1].pack: is empty"},
};

static void expect_at(const char *marked, const char *message, char *text, size_t text_size, char *expected,
                      size_t expected_size) {
    const char *mark = strchr(marked, '@');
    if (mark == NULL) {
        snprintf(text, text_size, "%s", marked);
        snprintf(expected, expected_size, "s.json:%s", message);
        return;
    }
    assert_true(strlen(marked) < text_size);
    snprintf(text, text_size, "%.*s%s", (int)(mark - marked), marked, mark + 1);
    int line = 1, column = 1;
    for (const char *c = marked; c < mark; ++c) {
        column = *c == '\n' ? 1 : column + ((*c & 0xc0) != 0x80);
        line += *c == '\n';
    }
    snprintf(expected, expected_size, "s.json:%d:%d: %s", line, column, message);
}

static void what_is_wrong_is_told_with_line_column_and_key(void **state) {
    (void)state;
    size_t wrong = 0;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        vsh_scene *scene = NULL;
        vsh_error error = {VSH_OK, ""};
        char text[512];
        char expected[sizeof error.message];
        expect_at(bad[i].text, bad[i].message, text, sizeof text, expected, sizeof expected);
        const vsh_result result = vshi_scene_parse("s.json", text, strlen(text), NULL, &scene, &error);
        if (result != VSH_ERROR_INPUT || scene != NULL || strcmp(error.message, expected) != 0) {
            print_error("%s\n  expected %s\n  found    %s\n", bad[i].text, expected, error.message);
            ++wrong;
        }
        vsh_scene_free(scene);
        assert_int_equal(vshi_scene_parse("s.json", text, strlen(text), NULL, &scene, NULL), result);
    }
    assert_int_equal(wrong, 0);
}

/* Jansson takes a byte of 0 behind a number for the end of what it has read so far, and goes on. */
static void bytes_of_zero_are_told_with_their_place(void **state) {
    (void)state;
    static const char text[] = "{\"casters\": [],\n \"resolution\": 6\0, \"ck\": 0}";
    vsh_scene *scene = NULL;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vshi_scene_parse("s.json", text, sizeof text - 1, NULL, &scene, &error),
                     VSH_ERROR_INPUT);
    assert_string_equal(error.message, "s.json:2:17: a byte of 0, expected text");
    assert_null(scene);
}

static void a_seeds_scene_cut_anywhere_is_an_error(void **state) {
    (void)state;
    size_t size;
    char *text = read_text(seeds_path, &size);
    const size_t end = (size_t)(strrchr(text, '}') - text);
    for (size_t cut = 0; cut <= end; ++cut) {
        char *piece = malloc(cut + 1); /* of just this size, so that a sanitizer sees a read behind it */
        assert_non_null(piece);
        memcpy(piece, text, cut);
        vsh_scene *scene = NULL;
        vsh_error error = {VSH_OK, ""};
        assert_int_equal(vshi_scene_parse("s", piece, cut, NULL, &scene, &error), VSH_ERROR_INPUT);
        assert_null(scene);
        assert_true(strncmp(error.message, "s:", 2) == 0);
        free(piece);
    }
    free(text);
}

static void a_scene_with_any_byte_changed_is_read_or_refused(void **state) {
    (void)state;
    static const char bytes[] = "{}[]\",:0-\\ \n\xff"
                                "e9";
    char text[sizeof full_scene];
    for (size_t i = 0; i + 1 < sizeof full_scene; ++i) {
        for (size_t b = 0; b < sizeof bytes; ++b) { /* the ending zero too */
            memcpy(text, full_scene, sizeof text);
            text[i] = bytes[b];
            vsh_scene *scene = NULL;
            vsh_error error = {VSH_OK, ""};
            const vsh_result result = vshi_scene_parse("s", text, sizeof text - 1, NULL, &scene, &error);
            assert_true(result == VSH_OK || result == VSH_ERROR_INPUT);
            assert_true((result == VSH_OK) == (scene != NULL));
            assert_true((result == VSH_OK) == (error.message[0] == '\0'));
            vsh_scene_free(scene);
        }
    }
}

/* `levels` operations within each other, around a sphere. */
static char *nested(int levels) {
    static const char open[] = "{\"op\":\"union\",\"of\":[{\"shape\":\"sphere\",\"radius\":1},";
    char *text = malloc((size_t)levels * (sizeof open + 2) + 128);
    assert_non_null(text);
    char *at = text + sprintf(text, "{\"casters\":[{\"sdf\":");
    for (int i = 0; i < levels; ++i) {
        at += sprintf(at, "%s", open);
    }
    at += sprintf(at, "{\"shape\":\"sphere\",\"radius\":1}");
    for (int i = 0; i < levels; ++i) {
        at += sprintf(at, "]}");
    }
    sprintf(at, "}]}");
    return text;
}

static void trees_nest_64_levels_and_no_more(void **state) {
    (void)state;
    char *text = nested(63);
    vsh_scene *scene = parse("s", text);
    assert_int_equal(scene->casters[0].sdf.node_count, 2 * 63 + 1);
    vsh_scene_free(scene);
    free(text);
    static const int levels[] = {64, 200, 1000, 5000};
    for (size_t i = 0; i < sizeof levels / sizeof levels[0]; ++i) {
        text = nested(levels[i]);
        assert_int_equal(vshi_scene_parse("s", text, strlen(text), NULL, &scene, NULL), VSH_ERROR_INPUT);
        free(text);
    }
}

static void trees_have_65536_nodes_and_no_more(void **state) {
    (void)state;
    static const char leaf[] = ",{\"shape\":\"sphere\",\"radius\":1}";
    for (size_t leaves = 32768; leaves <= 32769; ++leaves) { /* n leaves make 2 n - 1 nodes */
        char *text = malloc(leaves * sizeof leaf + 128);
        assert_non_null(text);
        char *at = text + sprintf(text, "{\"casters\":[{\"sdf\":{\"op\":\"union\",\"of\":[%s", leaf + 1);
        for (size_t i = 1; i < leaves; ++i) {
            memcpy(at, leaf, sizeof leaf);
            at += sizeof leaf - 1;
        }
        strcpy(at, "]}}]}");
        vsh_scene *scene = NULL;
        vsh_error error = {VSH_OK, ""};
        const vsh_result result = vshi_scene_parse("s", text, strlen(text), NULL, &scene, &error);
        if (leaves == 32768) {
            assert_int_equal(result, VSH_OK);
            assert_int_equal(scene->casters[0].sdf.node_count, 65535);
        } else {
            assert_int_equal(result, VSH_ERROR_INPUT);
            assert_non_null(
                strstr(error.message, "of[32768]: is node 65537 of its tree, out of range 1 … 65536"));
        }
        vsh_scene_free(scene);
        free(text);
    }
}

static void scales_of_nested_nodes_cannot_run_away(void **state) {
    (void)state;
    vsh_error error = {VSH_OK, ""};
    vsh_scene *scene = NULL;
    static const char text[] =
        SDF("{\"op\":\"union\",\"scale\":1e6,\"of\":[{\"op\":\"union\",\"scale\":1e6,\"of\":["
            "{\"shape\":\"sphere\",\"radius\":1,\"scale\":1e6},{\"shape\":\"sphere\",\"radius\":1}]},"
            "{\"shape\":\"sphere\",\"radius\":1}]}");
    assert_int_equal(vshi_scene_parse("s", text, strlen(text), NULL, &scene, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "casters[0].sdf.of[0].of[0]: the scales of all levels make 1e+18"));
}

static void a_byte_order_mark_is_passed_over(void **state) {
    (void)state;
    vsh_scene_free(parse("s", "\xef\xbb\xbf{\"casters\":[{\"mesh\":\"a\"}]}"));
}

static void keys_with_escapes_are_the_keys_they_spell(void **state) {
    (void)state;
    vsh_scene *scene = parse("s", "{\"c\\u0061sters\":[{\"mesh\":\"\\\"\\\\\\u00e9\"}]}");
    assert_string_equal(scene->casters[0].path, "\"\\é");
    vsh_scene_free(scene);
}

static void messages_stay_one_line_whatever_the_key(void **state) {
    (void)state;
    char text[4096];
    char key[2048];
    memset(key, 'k', sizeof key - 1);
    key[sizeof key - 1] = '\0';
    snprintf(text, sizeof text, "{\"casters\":[{\"mesh\":\"a\"}],\"a\\nb%s\":1}", key);
    vsh_error error = {VSH_OK, ""};
    vsh_scene *scene = NULL;
    assert_int_equal(vshi_scene_parse("s", text, strlen(text), NULL, &scene, &error), VSH_ERROR_INPUT);
    assert_null(strpbrk(error.message, "\r\n"));
    assert_non_null(strstr(error.message, "s:1:27: a?bkkk"));
    assert_non_null(strstr(error.message, "…: unknown key"));
}

/* Otherwise the library would refuse a number of a scene file later, without line and key. */
static void what_a_table_of_keys_takes_the_library_takes(void **state) {
    (void)state;
    const vshi_table tables[] = {vshi_scene_table, vshi_ao_table};
    size_t tried = 0;
    for (size_t t = 0; t < 2; ++t) {
        for (size_t k = 0; k < tables[t].key_count; ++k) {
            const vshi_key *key = &tables[t].keys[k];
            if (key->kind != VSHI_NUMBER && key->kind != VSHI_INTEGER) {
                continue;
            }
            for (int end = 0; end < 2; ++end) {
                const double value = end ? key->highest : key->lowest;
                vsh_scene scene = vsh_scene_default();
                vsh_shade_options full;
                vsh_error error = {VSH_OK, ""};
                if (key->kind == VSHI_NUMBER) {
                    *(double *)((char *)&scene + key->offset) = value;
                } else {
                    *(int32_t *)((char *)&scene + key->offset) = (int32_t)value;
                }
                assert_int_equal(key->flags & (VSHI_ABOVE | VSHI_BELOW), 0);
                if (vshi_shade_options_resolve(&scene.shade, &full, &error) != VSH_OK) {
                    fail_msg("%s %g: %s", key->name, value, error.message);
                }
                ++tried;
            }
        }
    }
    assert_true(tried >= 20);
}

static void bytes_that_are_no_text_do_not_reach_messages(void **state) {
    (void)state;
    vsh_error error = {VSH_OK, ""};
    vshi_fail(&error, VSH_ERROR_INPUT, "%s: type '%s' × %.4s", "caf\xe9.json", "\xff\xc0\x80 é", "abc…");
    assert_string_equal(error.message, "caf?.json: type '??? é' × abc?");
}

static void a_file_that_is_not_there_or_is_a_folder_cannot_be_read(void **state) {
    (void)state;
    vsh_scene *scene = NULL;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_scene_read("no/such.json", NULL, &scene, &error), VSH_ERROR_READ);
    assert_string_equal(error.message, "no/such.json: cannot be read: No such file or directory");
    assert_null(scene);
    assert_int_equal(vsh_scene_read(VSH_ASSETS, NULL, &scene, &error), VSH_ERROR_READ);
    assert_int_equal(vsh_scene_read(NULL, NULL, &scene, NULL), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_scene_read("x", NULL, NULL, NULL), VSH_ERROR_ARGUMENT);
    vsh_scene_free(NULL);
}

static void a_device_is_no_scene_and_a_large_file_over_the_limit(void **state) {
    (void)state;
    vsh_scene *scene = NULL;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_scene_read("/dev/zero", NULL, &scene, &error), VSH_ERROR_READ);
    assert_string_equal(error.message, "/dev/zero: cannot be read: it is no regular file");
    char path[] = "scene-XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0 && ftruncate(file, (off_t)1 << 36) == 0);
    close(file);
    assert_int_equal(vsh_scene_read(path, NULL, &scene, &error), VSH_ERROR_LIMIT);
    assert_non_null(strstr(error.message, ": is larger than the 67108864 bytes that a scene may have"));
    assert_null(scene);
    unlink(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_wrong_is_told_with_line_column_and_key),
        cmocka_unit_test(bytes_of_zero_are_told_with_their_place),
        cmocka_unit_test(a_seeds_scene_cut_anywhere_is_an_error),
        cmocka_unit_test(a_scene_with_any_byte_changed_is_read_or_refused),
        cmocka_unit_test(trees_nest_64_levels_and_no_more),
        cmocka_unit_test(trees_have_65536_nodes_and_no_more),
        cmocka_unit_test(scales_of_nested_nodes_cannot_run_away),
        cmocka_unit_test(a_byte_order_mark_is_passed_over),
        cmocka_unit_test(keys_with_escapes_are_the_keys_they_spell),
        cmocka_unit_test(messages_stay_one_line_whatever_the_key),
        cmocka_unit_test(what_a_table_of_keys_takes_the_library_takes),
        cmocka_unit_test(bytes_that_are_no_text_do_not_reach_messages),
        cmocka_unit_test(a_file_that_is_not_there_or_is_a_folder_cannot_be_read),
        cmocka_unit_test(a_device_is_no_scene_and_a_large_file_over_the_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
