/* Files of flat scenes: what they say, what is wrong with them, and the outline that they make. */
#include "outlines.h"
#include "testing.h"

static char path[] = "vsh-flat-XXXXXX.json";

static void write_scene(const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static vsh_flat_scene *read_scene(const char *text) {
    vsh_flat_scene *scene = NULL;
    write_scene(text);
    assert_ok(vsh_flat_scene_read(path, NULL, &scene, &failure));
    return scene;
}

#define REGION "\"region\":[-1,-2,3,4]"
#define LAMP "{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2]}"
#define LIGHTS "\"lights\":[" LAMP "]"

TEST(every_key_lands_in_its_field) {
    vsh_flat_scene *scene = read_scene(
        "{" REGION
        ",\"size\":[300,200],\"method\":\"classic\",\"supersample\":3,\"padding\":7,\"max_steps\":99,"
        "\"output\":\"o.png\",\"bits\":8,\"pack\":\"R=shadow.a\",\"lights\":["
        "{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2],\"radius\":0.5,\"reach\":9,\"color\":[1,2,3]},"
        "{\"name\":\"b\",\"type\":\"directional\",\"direction\":[3,4],\"angle_deg\":180e-1},"
        "{\"name\":\"c\",\"type\":\"spot\",\"position\":[5,6],\"direction\":[0,-1],\"inner_deg\":0,\"outer_"
        "deg\":90}],"
        "\"casters\":["
        "{\"mask\":\"m.png\",\"size\":[2,3],\"channel\":\"red\",\"threshold\":0.25,\"invert\":true},"
        "{\"mask\":\"/m.png\",\"size\":4,\"translate\":[1,2],\"rotate_deg\":90,\"scale\":2},"
        "{\"text\":\"a\\nb\",\"font\":\"f.ttf\",\"height\":2,\"line_spacing\":1.5,\"align\":\"right\"},"
        "{\"shape\":\"circle\",\"radius\":2},{\"shape\":\"box\",\"half_size\":[1,2]},"
        "{\"shape\":\"polygon\",\"points\":[[0,0],[1,0],[0,1],[-1,0.5]]}]}");
    assert_int_equal(scene->caster_count, 6);
    assert_int_equal(scene->light_count, 3);
    const vsh_flat_options *o = &scene->options;
    assert_true(o->width == 300 && o->height == 200 && o->method == VSH_FLAT_CLASSIC && o->supersample == 3);
    assert_true(o->padding == 7 && o->max_steps == 99);
    assert_true(o->region_min[0] == -1.0 && o->region_min[1] == -2.0 && o->region_max[0] == 3.0 &&
                o->region_max[1] == 4.0);
    assert_string_equal(scene->output, "o.png");
    assert_string_equal(scene->pack, "R=shadow.a");
    assert_int_equal(scene->bits, 8);
    const vsh_light *l = scene->lights;
    assert_true(l[0].type == VSH_LIGHT_SPHERE && l[0].position[0] == 1.0 && l[0].position[1] == 2.0);
    assert_true(l[0].radius == 0.5 && l[0].falloff == VSH_FALLOFF_QUADRATIC && l[0].reach == 9.0);
    assert_true(l[0].color[2] == 3.0);
    assert_true(l[1].type == VSH_LIGHT_DIRECTIONAL && l[1].direction[0] == 3.0 && l[1].direction[1] == 4.0);
    assert_true(l[1].direction[2] == 0.0 && fabs(l[1].angle - 0.1 * PI) < 1e-15);
    assert_true(l[2].type == VSH_LIGHT_SPOT && l[2].falloff == VSH_FALLOFF_NONE);
    assert_true(l[2].axis[0] == 0.0 && l[2].axis[1] == -1.0 && l[2].axis[2] == 0.0);
    assert_true(l[2].direction[1] == 0.0);
    const vsh_flat_caster *c = scene->casters;
    assert_true(c[0].type == VSH_FLAT_MASK && c[0].mask.width == 2.0 && c[0].mask.height == 3.0);
    assert_true(c[0].mask.threshold == 0.25 && c[0].mask.invert);
    assert_string_equal(c[0].mask.channel, "red");
    assert_string_equal(c[0].path, "m.png");
    assert_true(c[1].mask.height == 0.0 && c[1].mask.threshold == 0.5 && c[1].mask.channel == NULL);
    const double turned[6] = {0, -2, 1, 2, 0, 2};
    for (int i = 0; i < 6; ++i) {
        assert_true(fabs(c[1].transform[i] - turned[i]) < 1e-15);
    }
    assert_true(c[2].type == VSH_FLAT_TEXT && c[2].letters.height == 2.0 && c[2].letters.line_spacing == 1.5);
    assert_true(c[2].letters.align == VSH_ALIGN_RIGHT && c[2].transform[0] == 1.0);
    assert_string_equal(c[2].text, "a\nb");
    assert_true(c[3].type == VSH_FLAT_CIRCLE && c[3].radius == 2.0);
    assert_true(c[4].type == VSH_FLAT_BOX && c[4].half_size[1] == 2.0);
    assert_true(c[5].type == VSH_FLAT_POLYGON && c[5].point_count == 4 && c[5].points[7] == 0.5);
    vsh_flat_scene_free(scene);
    scene = read_scene("\xef\xbb\xbf{" REGION "," LIGHTS "}");
    assert_true(scene->caster_count == 0 && scene->output == NULL && scene->options.method == VSH_FLAT_EXACT);
    vsh_flat_scene_free(scene);
}

#define WITH(caster) "{" REGION "," LIGHTS ",\"casters\":[" caster "]}"
#define LIT(light) "{" REGION ",\"lights\":[" light "]}"

/* An @ stands before the place that the message must tell, and is taken out of the text. */
static const struct {
    const char *text, *message;
} bad[] = {
    {"@{}", "key \"region\" is missing: a flat scene needs it; 'vdbshade bake' bakes scenes with receivers"},
    {"@{" LIGHTS "}",
     "key \"region\" is missing: a flat scene needs it; 'vdbshade bake' bakes scenes with receivers"},
    {"{" LIGHTS ",\"region\":@[0,0,0,1]}", "region: is empty: expected [left, bottom, right, top]"},
    {"{" LIGHTS ",\"region\":@[0,0,1]}", "region: expected 4 numbers, found 3"},
    {"{" LIGHTS ",\"region\":[0,@1e16,1,1]}", "region[1]: 1e+16 is out of range -1e+15 … 1e+15"},
    {"{" REGION "," LIGHTS ",\"size\":@0}", "size: 0 is out of range 1 … 65536"},
    {"{" REGION "," LIGHTS ",\"size\":[8,@2147483648]}", "size[1]: 2.14748365e+09 is out of range 1 … 65536"},
    {"{" REGION "," LIGHTS ",@\"resolution\":64}", "resolution: unknown key"},
    {"{" REGION "," LIGHTS ",\"method\":@\"cone\"}", "method: \"cone\" is none of hard, classic, exact"},
    {"{" REGION ",\"lights\":@[]}", "lights: has 0 items, out of range 1 … 252"},
    {LIT("{\"name\":\"a\",\"type\":@\"sphere\"}"),
     "lights[0].type: \"sphere\" is none of directional, disc, spot"},
    {LIT("{\"name\":\"a\",\"type\":\"disc\",\"position\":@[1,2,3]}"),
     "lights[0].position: expected 2 numbers, found 3"},
    {LIT("@{\"name\":\"a\",\"type\":\"disc\"}"),
     "lights[0]: key \"position\" is missing: a disc light needs it"},
    {LIT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":@[0,0]}"),
     "lights[0].direction: is zero, and so points nowhere"},
    {LIT("{\"name\":\"a\",\"type\":\"spot\",\"position\":[1,2],\"direction\":[0,1],\"inner_deg\":@50,"
         "\"outer_deg\":40}"),
     "lights[0].inner_deg: 50 is over outer_deg, 40"},
    {LIT("{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2],\"reach\":@0}"),
     "lights[0].reach: 0 is out of range 0 (excluded) … 1e+15"},
    {LIT("{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2],@\"falloff\":\"none\"}"),
     "lights[0].falloff: unknown key"},
    {LIT(LAMP ",{\"name\":@\"a\",\"type\":\"disc\",\"position\":[1,2]}"),
     "lights[1].name: \"a\" is the name of lights[0] too"},
    {WITH("@{}"), "casters[0]: key \"mask\", \"text\" or \"shape\" is missing"},
    {WITH("{@\"mesh\":\"a.obj\"}"), "casters[0].mesh: unknown key; did you mean \"mask\"?"},
    {WITH("{\"mask\":\"m\",@\"text\":\"t\"}"), "casters[0].text: cannot stand beside \"mask\""},
    {WITH("@{\"mask\":\"m\"}"), "casters[0]: key \"size\" is missing: a mask needs it"},
    {WITH("{\"mask\":\"m\",\"size\":@0}"), "casters[0].size: 0 is out of range 0 (excluded) … 1e+15"},
    {WITH("{\"mask\":\"m\",\"size\":[1,@-1]}"),
     "casters[0].size[1]: -1 is out of range 0 (excluded) … 1e+15"},
    {WITH("{\"mask\":\"m\",\"size\":1,@\"thickness\":1}"), "casters[0].thickness: unknown key"},
    {WITH("{\"mask\":\"m\",\"size\":1,\"invert\":@1}"),
     "casters[0].invert: expected true or false, found a number"},
    {WITH("@{\"text\":\"m\",\"height\":1}"), "casters[0]: key \"font\" is missing: a text needs it"},
    {WITH("{\"text\":@\"\",\"height\":1}"), "casters[0].text: is empty"},
    {WITH("{\"text\":\"a\",\"align\":@\"middle\"}"),
     "casters[0].align: \"middle\" is none of left, center, right"},
    {WITH("{\"shape\":@\"star\"}"), "casters[0].shape: \"star\" is none of circle, box, polygon"},
    {WITH("{\"shape\":\"circle\",@\"half_size\":[1,1]}"), "casters[0].half_size: is no key of a circle"},
    {WITH("{\"shape\":\"polygon\",\"points\":@[[0,0],[1,1]]}"),
     "casters[0].points: has 2 points, out of range 3 … 1048576"},
    {WITH("{\"shape\":\"polygon\",\"points\":[[0,0],@[1],[1,1]]}"),
     "casters[0].points[1]: expected 2 numbers, found 1"},
    {WITH("{\"shape\":\"circle\",\"radius\":1,\"scale\":@[1,2]}"),
     "casters[0].scale: expected a number, found an array"},
};

TEST(errors_tell_their_place) {
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        char text[1024], expected[1024];
        const char *at = strchr(bad[i].text, '@');
        assert_non_null(at);
        const size_t place = (size_t)(at - bad[i].text);
        snprintf(text, sizeof text, "%.*s%s", (int)place, bad[i].text, at + 1);
        snprintf(expected, sizeof expected, "%s:1:%zu: %s", path, place + 1, bad[i].message);
        write_scene(text);
        vsh_flat_scene *scene = NULL;
        assert_int_equal(vsh_flat_scene_read(path, NULL, &scene, &failure), VSH_ERROR_INPUT);
        assert_string_equal(failure.message, expected);
        assert_null(scene);
    }
    vsh_flat_scene *scene = NULL;
    assert_fails(vsh_flat_scene_read("none.json", NULL, &scene, &failure), VSH_ERROR_READ, "none.json");
}

TEST(casters_become_one_outline) {
    vsh_flat_scene *scene =
        read_scene(WITH("{\"shape\":\"circle\",\"radius\":2,\"translate\":[5,0],\"scale\":0.5},"
                        "{\"shape\":\"box\",\"half_size\":[1,2],\"rotate_deg\":90},"
                        "{\"shape\":\"polygon\",\"points\":[[0,5],[0,6],[1,5]]},"
                        "{\"text\":\"l\",\"font\":\"" FONT "\",\"height\":2048,"
                        "\"translate\":[0,100]}"));
    vsh_outline *outline = NULL;
    assert_ok(vsh_flat_scene_casters(scene, NULL, &outline, &failure));
    const vsh_outline_info info = info_of(outline);
    assert_int_equal(info.contours, 4);
    assert_true(fabs(info.area - (PI + 8.0 + 0.5 + 184.0 * 1556.0)) < 1e-9);
    const struct {
        double p[2], distance;
    } cases[] = {
        {{5.0, 1.5}, 0.5}, {{0.0, 3.0}, 2.0}, {{0.25, 5.5}, -0.25 * sqrt(0.5) * 1.0}, {{0.0, 0.0}, -1.0}};
    for (size_t i = 0; i < 4; ++i) { /* the circle's sides are within 1e-4 of it */
        assert_true(fabs(vsh_outline_distance(outline, cases[i].p) - cases[i].distance) < 2e-4);
    }
    vsh_outline_free(outline);
    vsh_flat_scene_free(scene);
    scene = read_scene("{" REGION "," LIGHTS "}");
    assert_ok(vsh_flat_scene_casters(scene, NULL, &outline, &failure));
    assert_null(outline);
    vsh_flat_scene_free(scene);
    scene = read_scene(
        WITH("{\"shape\":\"circle\",\"radius\":2},{\"text\":\"l\",\"font\":\"none.ttf\",\"height\":1}"));
    assert_fails(vsh_flat_scene_casters(scene, NULL, &outline, &failure), VSH_ERROR_READ,
                 "casters[1]: none.ttf");
    vsh_flat_scene_free(scene);
}

static int name_file(void **state) {
    const int file = mkstemps(path, 5);
    return file < 0 || close(file) != 0;
}

static int remove_file(void **state) {
    return unlink(path);
}

FIXTURE(name_file, remove_file)
