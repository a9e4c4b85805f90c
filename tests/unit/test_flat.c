/* Flat light maps against closed forms and against rays that meet every segment of the outline in turn; files
 * of flat scenes. */
#include "folder.h"
#include "handles.h"
#include "outlines.h"

enum { SIZE = 96 };

typedef struct map {
    float shadow[2][SIZE * SIZE], rgb[3][SIZE * SIZE], coverage[SIZE * SIZE];
} map;

static vsh_flat_options make_options(void) {
    vsh_flat_options options = vsh_flat_options_default();
    options.width = options.height = SIZE;
    options.region_min[0] = options.region_min[1] = -2.0;
    options.region_max[0] = options.region_max[1] = 2.0;
    options.padding = 0;
    return options;
}

static void bake(const vsh_outline *casters, const vsh_light *lights, size_t count,
                 const vsh_flat_options *options, const vsh_run *run, map *m) {
    float *shadow[2] = {m->shadow[0], m->shadow[1]}, *rgb[3] = {m->rgb[0], m->rgb[1], m->rgb[2]};
    const vsh_flat_map view = {shadow, rgb, m->coverage};
    assert_ok(vshi_flat_bake(casters, lights, count, options, run, &view, &failure));
}

static void texel_point(size_t i, double p[2]) {
    p[0] = -2.0 + 4.0 * ((double)(i % SIZE) + 0.5) / SIZE;
    p[1] = 2.0 - 4.0 * ((double)(i / SIZE) + 0.5) / SIZE;
}

TEST(a_map_holds_the_light_that_its_texels_see) {
    static map m;
    OWNED(vsh_outline) *letters = lines_of("flat", VSH_ALIGN_CENTER);
    vsh_light lights[2] = {lamp(0.3, 1.5, 0.2), flat_sun(1.0, 0.5, 0.3)};
    lights[0].falloff = VSH_FALLOFF_QUADRATIC;
    lights[0].reach = 2.5;
    const double color[3] = {1.0, 0.5, 0.25};
    memcpy(lights[0].color, color, sizeof color);
    const vsh_flat_options options = make_options();
    bake(letters, lights, 2, &options, NULL, &m);
    double square = 0.0;
    size_t outside = 0, dark = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        double p[2];
        texel_point(i, p);
        const bool inside = truth_inside(letters, p[0], p[1]);
        assert_true((double)m.coverage[i] == (inside ? 0.0 : 1.0));
        if (inside) {
            assert_true(m.shadow[0][i] == 0.0f && m.rgb[0][i] == 0.0f);
            continue;
        }
        const double distance = hypot(p[0] - 0.3, p[1] - 1.5);
        const double seen = (double)m.shadow[0][i], far = (double)m.shadow[1][i];
        const double fade = pow(1.0 - fmin(1.0, fmax(distance, 0.2) / 2.5), 2.0);
        assert_true(distance > 0.2 || seen == 1.0);
        assert_true(distance < 2.5 || seen == 0.0);
        for (int c = 0; c < 3; ++c) {
            assert_less(fabs((double)m.rgb[c][i] - (seen * fade * color[c] + far)), 1e-5);
        }
        if (i % 7 == 0) { /* the inner half of each penumbra is dark */
            const double truth = truth_visibility(letters, &lights[1], p[0], p[1], 400);
            assert_true(truth > 0.0 || far == 0.0);
            square += (far - truth) * (far - truth);
            ++outside;
            dark += truth == 0.0;
        }
    }
    assert_less(sqrt(square / (double)outside), 0.12);
    assert_true(dark > 50);
}

TEST(a_light_of_no_size_is_seen_or_not) {
    static map m;
    OWNED(vsh_outline) *letters = lines_of("vdb", VSH_ALIGN_CENTER);
    const vsh_light lights[] = {lamp(0.3, 1.9, 0.0), flat_sun(1.0, 0.3, 0.0)};
    const vsh_flat_options options = make_options();
    bake(letters, lights, 2, &options, NULL, &m);
    for (size_t l = 0; l < 2; ++l) {
        int dark = 0, lit = 0, wrong = 0;
        for (size_t i = 0; i < SIZE * SIZE; ++i) {
            double p[2];
            texel_point(i, p);
            if (m.coverage[i] == 0.0f) {
                continue;
            }
            const double value = (double)m.shadow[l][i];
            wrong += value != truth_visibility(letters, &lights[l], p[0], p[1], 1);
            dark += value == 0.0;
            lit += value == 1.0;
        }
        assert_true(dark > 500 && lit > 500);
        assert_true(wrong < SIZE * SIZE / 100); /* at edges, which the grid rounds */
    }
}

TEST(a_map_without_casters_is_lit) {
    static map m;
    const vsh_light light = lamp(0.5, 0.0, 0.3);
    const vsh_flat_options options = make_options();
    bake(NULL, &light, 1, &options, NULL, &m);
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        assert_true(m.shadow[0][i] == 1.0f && m.coverage[i] == 1.0f);
    }
}

/* Its outer half is the estimate's own: h/t over the sine of half the angle, at an edge that is b beyond the
 * light's centre sin b / sin a; the inner half is dark. */
TEST(a_shadow_has_the_outer_half_of_its_penumbra) {
    static map m;
    OWNED(vsh_outline) *wall = box(-1.9, 0.5, 0.0, 0.7);
    const vsh_light sun = flat_sun(0.0, 1.0, 0.5);
    const vsh_flat_options options = make_options();
    bake(wall, &sun, 1, &options, NULL, &m);
    double worst = 0.0;
    int between = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        double p[2];
        texel_point(i, p);
        if (p[1] < 0.0 && fabs(p[0]) < 1.0) {
            const double edge = fmin(atan2(p[0], 0.5 - p[1]), atan2(p[0], 0.7 - p[1]));
            const double expected = p[0] < 0.0 ? 0.0 : fmin(1.0, sin(edge) / sin(0.25));
            worst = fmax(worst, fabs((double)m.shadow[0][i] - expected));
            between += expected > 0.0 && expected < 1.0;
        }
    }
    assert_true(worst < 0.1 && between > 100);
}

TEST(a_scene_of_twice_the_size_is_the_same) {
    static map a, b;
    OWNED(vsh_outline) *letters = lines_of("flat", VSH_ALIGN_CENTER), *larger = NULL;
    const double twice[6] = {2.0, 0.0, 0.0, 0.0, 2.0, 0.0};
    const vshi_outline_instance instance = {letters, twice};
    assert_ok(vshi_outline_unite(&instance, 1, NULL, &larger, &failure));
    const vsh_light light = lamp(0.3, 1.5, 0.2), far = lamp(0.6, 3.0, 0.4);
    vsh_flat_options options = make_options();
    bake(letters, &light, 1, &options, NULL, &a);
    for (int axis = 0; axis < 2; ++axis) {
        options.region_min[axis] *= 2.0;
        options.region_max[axis] *= 2.0;
    }
    bake(larger, &far, 1, &options, NULL, &b);
    assert_memory_equal(a.shadow[0], b.shadow[0], sizeof a.shadow[0]); /* by a power of two: the same bits */
}

TEST(supersampling_averages_samples_outside_of_casters) {
    static map m;
    OWNED(vsh_outline) *wall = box(-0.98, -1.0, 0.013, 0.5);
    vsh_light light = lamp(-1.9, 0.0, 0.0);
    light.falloff = VSH_FALLOFF_QUADRATIC;
    light.reach = 6.0;
    vsh_flat_options options = make_options();
    options.supersample = 4;
    bake(wall, &light, 1, &options, NULL, &m);
    const double texel = 4.0 / SIZE;
    int parts = 0, sides = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        double p[2], fade = 0.0;
        int count = 0;
        texel_point(i, p);
        for (int s = 0; s < 16; ++s) {
            const double q[2] = {p[0] + texel * ((s % 4 + 0.5) / 4.0 - 0.5),
                                 p[1] - texel * ((s / 4 + 0.5) / 4.0 - 0.5)};
            if (!(q[0] > -0.98 && q[0] < 0.013 && q[1] > -1.0 && q[1] < 0.5)) {
                fade += pow(1.0 - hypot(q[0] + 1.9, q[1]) / 6.0, 2.0);
                ++count;
            }
        }
        assert_less(fabs((double)m.coverage[i] - count / 16.0), 1e-6);
        parts += count > 0 && count < 16;
        if (p[0] < -0.95 && fabs(p[1]) < 0.4 && count > 0) { /* the lamp's side of the wall */
            assert_true(m.shadow[0][i] == 1.0f);
            assert_near((double)m.rgb[0][i], fade / count, 1e-6);
            sides += count < 16;
        }
    }
    assert_true(parts > 20 && sides > 10);
}

TEST(padding_grows_values_and_not_coverage) {
    static map m, padded;
    OWNED(vsh_outline) *wall = box(-1.0, -1.0, 0.0, 0.5);
    const vsh_light light = lamp(0.3, 1.5, 0.2);
    vsh_flat_options options = make_options();
    bake(wall, &light, 1, &options, NULL, &m);
    options.padding = 2;
    bake(wall, &light, 1, &options, NULL, &padded);
    assert_memory_equal(m.coverage, padded.coverage, sizeof m.coverage);
    const size_t row = SIZE / 2, last = SIZE / 2 - 1; /* the column left of x = 0 */
    assert_true(m.coverage[row * SIZE + last] == 0.0f && m.shadow[0][row * SIZE + last] == 0.0f);
    assert_true(padded.shadow[0][row * SIZE + last] == m.shadow[0][row * SIZE + last + 1]);
    assert_true(m.shadow[0][row * SIZE + last + 1] > 0.0f);
    assert_true(padded.shadow[0][row * SIZE + last - 2] == 0.0f);
}

/* --- what is refused */

TEST(bad_options_and_small_limits_are_refused) {
    static map m;
    OWNED(vsh_outline) *wall = box(-1.0, -1.0, 0.0, 0.5);
    float *shadow[1] = {m.shadow[0]};
    const vsh_flat_map view = {shadow, NULL, NULL};
    const vsh_light light = lamp(0.3, 1.5, 0.2);
    const vsh_flat_options good = make_options();
#define REFUSED(field, value, part)                                                                          \
    do {                                                                                                     \
        vsh_flat_options bad = good;                                                                         \
        bad.field = value;                                                                                   \
        assert_fails(vshi_flat_bake(wall, &light, 1, &bad, NULL, &view, &failure), VSH_ERROR_ARGUMENT,       \
                     part);                                                                                  \
    } while (0)
    REFUSED(struct_size, sizeof good + 8, "struct_size");
    REFUSED(width, 0, "width 0");
    REFUSED(height, 65537, "height 65537");
    REFUSED(supersample, 17, "supersample 17");
    REFUSED(padding, -1, "padding -1");
    REFUSED(region_max[0], -2.0, "region");
    REFUSED(region_min[1], NAN, "region");
#undef REFUSED
    vsh_light bad = light;
    bad.radius = -1.0;
    assert_fails(vshi_flat_bake(wall, &bad, 1, &good, NULL, &view, &failure), VSH_ERROR_ARGUMENT, "radius");
    bad = flat_sun(0.0, 0.0, 0.1);
    bad.direction[2] = 1.0;
    assert_fails(vshi_flat_bake(wall, &bad, 1, &good, NULL, &view, &failure), VSH_ERROR_ARGUMENT, "plane");
    const vsh_run run = run_within(5000);
    assert_fails(vshi_flat_bake(wall, &light, 1, &good, &run, &view, &failure), VSH_ERROR_LIMIT, "limit");
    OWNED(vsh_outline) *far = box(-3000.0, -3000.0, 0.0, 0.5);
    assert_fails(vshi_flat_bake(far, &light, 1, &good, NULL, &view, &failure), VSH_ERROR_LIMIT, "distances");
}

/* --- files of flat scenes: their keys, what is refused, and the outline that they make */

static vsh_flat_scene *read_scene(const char *text) {
    vsh_flat_scene *scene = NULL;
    write_string(at("scene.json"), text);
    assert_ok(vsh_flat_scene_read(at("scene.json"), NULL, &scene, &failure));
    return scene;
}

#define REGION "\"region\":[-1,-2,3,4]"
#define LAMP "{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2]}"
#define LIGHTS "\"lights\":[" LAMP "]"

TEST(every_key_lands_in_its_field) {
    vsh_flat_scene *scene = read_scene(
        "{" REGION ",\"size\":[300,200],\"supersample\":3,\"padding\":7,"
        "\"output\":\"o.png\",\"bits\":8,\"pack\":\"R=shadow.a\",\"lights\":["
        "{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2],\"radius\":0.5,\"reach\":9,\"color\":[1,2,3]},"
        "{\"name\":\"b\",\"type\":\"directional\",\"direction\":[3,4],\"angle_deg\":180e-1},"
        "{\"name\":\"c\",\"type\":\"spot\",\"position\":[5,6],\"direction\":[0,-1],\"inner_deg\":0,\"outer_"
        "deg\":90}],"
        "\"casters\":["
        "{\"mask\":\"m.png\",\"size\":[2,3],\"channel\":\"red\",\"threshold\":0.25,\"invert\":true},"
        "{\"mask\":\"/m.png\",\"size\":4,\"translate\":[1,2],\"rotate_deg\":90,\"scale\":2},"
        "{\"text\":\"a\\nb\",\"font\":\"f.ttf\",\"height\":2,\"line_spacing\":1.5,\"align\":\"right\"},"
        "{\"shape\":\"box\",\"half_size\":[1,2]}]}");
    assert_int_equal(scene->caster_count, 4);
    assert_int_equal(scene->light_count, 3);
    const vsh_flat_options *o = &scene->options;
    assert_true(o->width == 300 && o->height == 200 && o->supersample == 3);
    assert_true(o->padding == 7);
    assert_true(o->region_min[0] == -1.0 && o->region_min[1] == -2.0 && o->region_max[0] == 3.0 &&
                o->region_max[1] == 4.0);
    assert_string_equal(scene->output, at("o.png")); /* relative to the scene */
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
    assert_string_equal(c[0].path, at("m.png"));
    assert_true(c[1].mask.height == 0.0 && c[1].mask.threshold == 0.5 && c[1].mask.channel == NULL);
    const double turned[6] = {0, -2, 1, 2, 0, 2};
    for (int i = 0; i < 6; ++i) {
        assert_true(fabs(c[1].transform[i] - turned[i]) < 1e-15);
    }
    assert_true(c[2].type == VSH_FLAT_TEXT && c[2].letters.height == 2.0 && c[2].letters.line_spacing == 1.5);
    assert_true(c[2].letters.align == VSH_ALIGN_RIGHT && c[2].transform[0] == 1.0);
    assert_string_equal(c[2].text, "a\nb");
    assert_true(c[3].type == VSH_FLAT_BOX && c[3].half_size[1] == 2.0);
    vsh_flat_scene_free(scene);
    scene = read_scene("\xef\xbb\xbf{" REGION "," LIGHTS "}");
    assert_true(scene->caster_count == 0 && scene->output == NULL && scene->options.supersample == 1);
    vsh_flat_scene_free(scene);
}

#define WITH(caster) "{" REGION "," LIGHTS ",\"casters\":[" caster "]}"
#define LIT(light) "{" REGION ",\"lights\":[" light "]}"

/* An @ stands before the place that the message must name, and is taken out of the text. test_scene.c has
 * more faults that the same parser finds. */
static const struct {
    const char *text, *message;
} bad[] = {
    {"@{}", "key \"region\" is missing: a flat scene needs it; 'vdbshade bake' bakes scenes with receivers"},
    {"{" LIGHTS ",\"region\":@[0,0,0,1]}", "region: is empty: expected [left, bottom, right, top]"},
    {"{" REGION "," LIGHTS ",\"size\":[8,@2147483648]}", "size[1]: 2.14748365e+09 is out of range 1 … 65536"},
    {"{" REGION "," LIGHTS ",@\"resolution\":64}", "resolution: unknown key"},
    {"{" REGION ",\"lights\":@[]}", "lights: has 0 items, out of range 1 … 252"},
    {LIT("{\"name\":\"a\",\"type\":@\"sphere\"}"),
     "lights[0].type: \"sphere\" is none of directional, disc, spot"},
    {LIT("{\"name\":\"a\",\"type\":\"directional\",\"direction\":@[0,0]}"),
     "lights[0].direction: is zero, and so points nowhere"},
    {LIT("{\"name\":\"a\",\"type\":\"spot\",\"position\":[1,2],\"direction\":[0,1],\"inner_deg\":@50,"
         "\"outer_deg\":40}"),
     "lights[0].inner_deg: 50 is over outer_deg, 40"},
    {LIT("{\"name\":\"a\",\"type\":\"disc\",\"position\":[1,2],\"reach\":@0}"),
     "lights[0].reach: 0 is out of range 0 (excluded) … 1e+15"},
    {WITH("@{}"), "casters[0]: key \"mask\", \"text\" or \"shape\" is missing"},
    {WITH("{\"mask\":\"m\",\"size\":@0}"), "casters[0].size: 0 is out of range 0 (excluded) … 1e+15"},
    {WITH("{\"text\":\"a\",\"align\":@\"middle\"}"),
     "casters[0].align: \"middle\" is none of left, center, right"},
    {WITH("{\"shape\":\"box\",@\"threshold\":0.5}"), "casters[0].threshold: is no key of a box"},
};

TEST(bad_scenes_are_refused_with_their_place) {
    vsh_flat_scene *scene = NULL;
    for (size_t i = 0; i < COUNT_OF(bad); ++i) {
        char text[1024], expected[1024];
        const size_t place = strcspn(bad[i].text, "@");
        snprintf(text, sizeof text, "%.*s%s", (int)place, bad[i].text, bad[i].text + place + 1);
        snprintf(expected, sizeof expected, "%s:1:%zu: %s", at("scene.json"), place + 1, bad[i].message);
        write_string(at("scene.json"), text);
        assert_fails(vsh_flat_scene_read(at("scene.json"), NULL, &scene, &failure), VSH_ERROR_INPUT,
                     expected);
        assert_int_equal(strlen(failure.message), strlen(expected));
        assert_null(scene);
    }
    assert_fails(vsh_flat_scene_read("none.json", NULL, &scene, &failure), VSH_ERROR_READ, "none.json");
}

TEST(casters_become_one_outline) {
    vsh_flat_scene *scene =
        read_scene(WITH("{\"shape\":\"box\",\"half_size\":[2,2],\"translate\":[5,0],\"scale\":0.5},"
                        "{\"shape\":\"box\",\"half_size\":[1,2],\"rotate_deg\":90},"
                        "{\"shape\":\"box\",\"half_size\":[0.5,0.5],\"translate\":[0,6]},"
                        "{\"text\":\"l\",\"font\":\"" FONT "\",\"height\":2048,"
                        "\"translate\":[0,100]}"));
    vsh_outline *outline = NULL;
    assert_ok(vshi_flat_scene_casters(scene, NULL, &outline, &failure));
    const vshi_outline_info info = info_of(outline);
    assert_int_equal(info.contours, 4);
    assert_true(fabs(info.area - (4.0 + 8.0 + 1.0 + 184.0 * 1556.0)) < 1e-9);
    const struct {
        double p[2], distance;
    } cases[] = {{{5.0, 1.5}, 0.5}, {{0.0, 3.0}, 2.0}, {{0.25, 6.0}, -0.25}, {{0.0, 0.0}, -1.0}};
    for (size_t i = 0; i < 4; ++i) {
        assert_near(distance_to(outline, cases[i].p), cases[i].distance, 1e-12);
    }
    vsh_outline_free(outline);
    vsh_flat_scene_free(scene);
    scene = read_scene("{" REGION "," LIGHTS "}");
    assert_ok(vshi_flat_scene_casters(scene, NULL, &outline, &failure));
    assert_null(outline);
    vsh_flat_scene_free(scene);
    scene = read_scene(
        WITH("{\"shape\":\"box\",\"half_size\":[1,1]},{\"text\":\"l\",\"font\":\"none.ttf\",\"height\":1}"));
    assert_fails(vshi_flat_scene_casters(scene, NULL, &outline, &failure), VSH_ERROR_READ, at("none.ttf"));
    vsh_flat_scene_free(scene);
}

FIXTURE(make_folder, remove_folder)
