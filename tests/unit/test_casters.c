/* Terrains and spheres through the public calls: as layers of a field, and from scene files to lightmaps. */
#include "field/field.h"
#include "terrain.h"
#include "testing.h"
#include "truth/analytic.h"
#include "truth/directions.h"

#include "previews.h"
#include "scene/scene.h"

enum { SIDE = 65, POINTS = 1000 };

static vsh_field *empty_field(void) {
    vsh_field *field = NULL;
    assert_ok(vshi_field_create_empty(1e-5, &field, &failure));
    return field;
}

TEST(a_layer_of_heights_is_marched_by_hard_and_classic_and_by_no_other_method) {
    static double positions[3 * POINTS];
    static float normals[3 * POINTS], values[POINTS], other[POINTS];
    FREED float *samples = hills(SIDE, SIDE);
    const vsh_heights_source source = source_of(samples, SIDE, SIDE, 10.0, 1.5);
    OWNED(vsh_model) *model = model_of(&source, VSH_HEIGHTS_SOLID);
    OWNED(vsh_heights) *heights = heights_of(&source);
    OWNED(vsh_field) *empty = empty_field();
    const vsh_mesh mesh = vsh_model_mesh(model, 0, -1);
    uint64_t counter = 2;
    for (size_t i = 0; i < POINTS; ++i) {
        const size_t face = (size_t)between(&counter, 0.0, 2.0 * (SIDE - 1) * (SIDE - 1) - 0.01);
        stand_on(&mesh, face, 1.0 / 3.0, 1.0 / 3.0, i, positions, normals);
    }
    vsh_layer layer = vsh_layer_default();
    layer.heights = heights;
    static const double towards[3] = {-0.8, 0.3, 0.4};
    const vsh_light light = sun(towards, RADIANS(30.0));
    const vsh_occluders *const casters = occluders_with(empty, &layer, 1);
    const vsh_shade_options options = preview_options();
    const vsh_points points = {POINTS, positions, normals, NULL};
    for (layer.method = 0; layer.method <= VSH_SHADOW_AUTO; ++layer.method) {
        const bool marched = layer.method == VSH_SHADOW_HARD || layer.method == VSH_SHADOW_CLASSIC;
        assert_fails(vsh_shade_shadow(casters, &points, &light, &options, NULL, values, NULL, NULL, &failure),
                     marched ? VSH_OK : VSH_ERROR_ARGUMENT,
                     "layer 0: heights and spheres are shaded by the methods hard and classic");
    }
    /* a light of no size is hard */
    layer.softness = 0.0;
    layer.method = VSH_SHADOW_CLASSIC;
    shadows_by(casters, &light, VSH_SHADOW_CONE, POINTS, positions, normals, values);
    layer.softness = 1.0;
    layer.method = VSH_SHADOW_HARD;
    shadows_by(casters, &light, VSH_SHADOW_CONE, POINTS, positions, normals, other);
    assert_memory_equal(values, other, sizeof values);
    /* another light's layer casts nothing, and heights have no AO by themselves */
    static const char *const lamp_name[] = {"lamp"};
    layer.lights = lamp_name;
    layer.light_count = 1;
    shadows_by(casters, &light, VSH_SHADOW_CONE, POINTS, positions, normals, values);
    shadows(empty, &light, VSH_SHADOW_CONE, POINTS, positions, normals, other);
    assert_memory_equal(values, other, sizeof values);
    assert_ok(vsh_shade_ao(casters, &points, &options, NULL, values, NULL, NULL, NULL, &failure));
    for (size_t i = 0; i < POINTS; ++i) {
        assert_true(values[i] == 1.0f);
    }
}

/* Bakes the floor under casters given as JSON; coverage of its texels. */
static void bake_floor(const char *casters, float *shadow, float *coverage, int32_t side) {
    char text[1024];
    snprintf(text, sizeof text,
             "{\"casters\":[%s],\"method\":\"hard\",\"lights\":[{\"name\":\"sun\",\"type\":\"directional\","
             "\"direction\":[0,1,0]}],"
             "\"receivers\":[{\"mesh\":\"seeds_floor.obj\",\"output\":\"none.exr\"}]}",
             casters);
    OWNED(vsh_scene) *scene = NULL;
    OWNED(vsh_assets) *assets = NULL;
    assert_ok(vshi_scene_parse(VSH_ASSETS "/scene.json", text, strlen(text), NULL, &scene, &failure) !=
                  VSH_OK ||
              vsh_assets_load(scene, NULL, &assets, &failure));
    vsh_layer layer = vsh_layer_default();
    layer.heights = vsh_assets_heights(assets, 0);
    layer.spheres = vsh_assets_spheres(assets, 0);
    layer.method = VSH_SHADOW_HARD;
    vsh_shade_options shade = preview_options();
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = side;
    options.padding = 0;
    size_t count = 0;
    const vsh_mesh *meshes = vsh_assets_receiver(assets, 0, &count);
    OWNED(vsh_charts) *texels = NULL;
    assert_ok(vsh_charts_create(meshes, count, &options, NULL, NULL, &texels, &failure));
    static const double high[3] = {0.0, 1.0, 0.0};
    const vsh_light light = sun(high, 0.1);
    float *const planes[1] = {shadow};
    vsh_lightmap lightmap = {.shadow = planes, .coverage = coverage};
    OWNED(vsh_field) *empty = empty_field();
    assert_ok(vsh_bake_lightmap(occluders_with(empty, &layer, 1), texels, &light, 1, &shade, NULL, &lightmap,
                                NULL, &failure));
}

TEST(texels_within_a_sphere_or_a_terrain_are_not_valid) {
    enum { TEXELS = 64 };
    static float shadow[TEXELS * TEXELS], coverage[TEXELS * TEXELS];
    /* a ball through the floor: its section is a disc of radius 1 of the floor's 5 × 5 */
    bake_floor("{\"spheres\":[[0,0.75,0,1.25]]}", shadow, coverage, TEXELS);
    size_t invalid = 0, dark = 0;
    for (size_t i = 0; i < TEXELS * TEXELS; ++i) {
        invalid += coverage[i] == 0.0f;
        dark += coverage[i] == 1.0f && shadow[i] == 0.0f;
    }
    const double texel = 25.0 / (TEXELS * TEXELS);
    assert_less(fabs((double)invalid * texel - PI), 0.1);
    /* under the middle of the sun a ball's hard shadow is as wide as the ball */
    assert_less(fabs((double)(dark + invalid) * texel - PI * 1.25 * 1.25), 0.05);
    /* a terrain that is higher than the floor all over one side of it */
    bake_floor("{\"heightfield\":\"terrain.png\",\"size\":[5,20],\"height\":1,\"direct\":true,"
               "\"transform\":{\"translate\":[2.5,-0.05,0]}}",
               shadow, coverage, TEXELS);
    invalid = 0;
    for (size_t i = 0; i < TEXELS * TEXELS; ++i) {
        invalid += coverage[i] == 0.0f;
    }
    assert_true(invalid > TEXELS * TEXELS * 2 / 5 && invalid < TEXELS * TEXELS * 3 / 5);
}
