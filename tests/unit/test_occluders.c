/* Occluders from meshes, from parts and from a scene. */
#include "scenes.h"
#include "shading.h"
#include "testing.h"
#include "truth/metrics.h"

TEST(occluders_have_the_field_that_their_grid_makes) {
    const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 0.5};
    const vsh_mesh mesh = plate_mesh();
    vsh_occluders_options options = vsh_occluders_options_default();
    options.grid.resolution = 64;
    options.reach = 2.0;
    for (int meshes = 0; meshes < 2; ++meshes) {
        OWNED(vsh_occluders) *made = NULL;
        vsh_grid *grid = NULL;
        if (meshes) {
            assert_ok(vsh_grid_from_meshes(&mesh, 1, &options.grid, NULL, &grid, &failure));
            assert_ok(vsh_occluders_create(&mesh, 1, &options, NULL, &made, &failure));
        } else {
            grid = grid_of((truth_scene){&solid, 1}, 0.125);
            assert_ok(vsh_occluders_from_grid(grid, &options, NULL, &made, &failure));
        }
        OWNED(vsh_field) *field = field_of_grid(grid, options.reach);
        const vshi_occluder_parts parts = parts_of(made);
        const vsh_field_info ours = field_info(parts.field), theirs = field_info(field);
        assert_memory_equal(&ours, &theirs, sizeof ours);
        assert_true((parts.triangles != NULL) == meshes && parts.layer_count == 0);
        assert_true(!meshes || parts.triangles == parts.true_triangles);
        const vsh_occluders_info info = occluders_info(made);
        assert_true(info.field_bytes == ours.bytes && info.bricks == ours.bricks);
        assert_true(info.voxel_size == ours.voxel_size && info.levels == ours.levels);
        assert_true(!meshes || (info.grid_bytes > 0 && info.voxelize_s > 0.0 && info.field_s > 0.0));
        assert_true(info.has_triangles == meshes && (info.triangles_bytes > 0) == meshes);
    }
}

TEST(bad_meshes_and_options_are_refused_with_nothing_made) {
    vsh_occluders_options options = vsh_occluders_options_default(), coarse = options, behind = options;
    coarse.grid.resolution = 1;
    behind.reach = -1.0;
    vsh_run run = run_within(1000);
    const struct {
        size_t vertex_count, count;
        const vsh_occluders_options *options;
        const vsh_run *run;
        vsh_result code;
    } cases[] = {{5, 1, NULL, NULL, VSH_ERROR_INPUT}, /* indices beyond */
                 {8, 0, NULL, NULL, VSH_ERROR_ARGUMENT},
                 {8, 1, &coarse, NULL, VSH_ERROR_ARGUMENT},
                 {8, 1, &behind, NULL, VSH_ERROR_ARGUMENT},
                 {8, 1, NULL, &run, VSH_ERROR_LIMIT}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        vsh_mesh mesh = plate_mesh();
        mesh.vertex_count = cases[i].vertex_count;
        vsh_occluders *made = (vsh_occluders *)&failure;
        assert_fails(
            vsh_occluders_create(&mesh, cases[i].count, cases[i].options, cases[i].run, &made, &failure),
            cases[i].code, "");
        assert_null(made);
    }
}

TEST(layers_without_a_field_define_the_unit_of_offsets) {
    OWNED(vshi_spheres) *spheres = NULL;
    assert_ok(vshi_spheres_create((const double[]){0, 0, 0, 1}, 1, NULL, NULL, &spheres, &failure));
    const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 0.5};
    OWNED(vsh_field) *field = field_of((truth_scene){&solid, 1}, 0.125, 1.0);
    vshi_layer layers[2] = {vshi_layer_default(), vshi_layer_default()};
    layers[0].spheres = spheres;
    layers[1].field = field;
    for (size_t count = 1; count <= 2; ++count) {
        const vshi_occluder_parts parts = {.layers = layers, .layer_count = count};
        OWNED(vsh_occluders) *made = NULL;
        assert_ok(vshi_occluders_make(&parts, NULL, &made, &failure));
        const vshi_occluder_parts views = parts_of(made);
        assert_int_equal(views.layer_count, count);
        assert_true(field_info(views.field).voxel_size == (count == 2 ? 0.125 : 2e-5));
        const vsh_occluders_info counted = occluders_info(made); /* the field of nothing is none */
        assert_true((counted.field_bytes > 0) == (count == 2));
        assert_true(counted.voxel_size == (count == 2 ? 0.125 : 0.0));
    }
}

/* A point under the plate, half in its shadow. */
static float lit_under(const vsh_occluders *occluders, int32_t method, vsh_result expected) {
    const double at[3] = {1.0, 0.0, 0.0};
    const float up[3] = {0.0f, 1.0f, 0.0f};
    const vsh_points points = {1, at, up, NULL};
    vsh_light light = vsh_light_default();
    light.angle = 0.3;
    vsh_shade_options options = vsh_shade_options_default();
    options.method = method;
    float lit = -1.0f;
    assert_int_equal(vsh_shade_shadow(occluders, &points, &light, &options, NULL, &lit, NULL, NULL, &failure),
                     expected);
    return lit;
}

TEST(auto_is_exact_where_triangles_are_kept_and_adaptive_where_not) {
    const vsh_mesh mesh = plate_mesh();
    for (int32_t kept = 0; kept < 2; ++kept) {
        vsh_occluders_options options = vsh_occluders_options_default();
        options.grid.resolution = 16;
        options.triangles = kept;
        OWNED(vsh_occluders) *made = NULL;
        assert_ok(vsh_occluders_create(&mesh, 1, &options, NULL, &made, &failure));
        const int32_t method = kept ? VSH_SHADOW_EXACT : VSH_SHADOW_ADAPTIVE;
        const float lit = lit_under(made, VSH_SHADOW_AUTO, VSH_OK);
        assert_true(lit > 0.3f && lit < 0.7f);
        assert_int_equal(bits_of(lit), bits_of(lit_under(made, method, VSH_OK)));
        if (!kept) {
            lit_under(made, VSH_SHADOW_EXACT, VSH_ERROR_ARGUMENT);
            assert_non_null(strstr(failure.message, "the occluders have no triangles"));
        }
    }
}

static vsh_occluders *of_scene(const char *text, const vsh_scene_occluders_options *options,
                               vsh_result expected) {
    OWNED(vsh_scene) *scene = parse("/scene.json", text);
    OWNED(vsh_assets) *assets = NULL;
    vsh_occluders *made = NULL;
    assert_ok(vsh_assets_load(scene, NULL, &assets, &failure));
    assert_int_equal(vsh_scene_occluders(scene, assets, options, NULL, &made, &failure), expected);
    return made;
}

#define SCENE(casters, more)                                                                                 \
    "{\"casters\": [" casters "], \"resolution\": 32, \"lights\": [{\"name\": \"sun\", \"type\": "           \
    "\"directional\", \"direction\": [0, 1, 0]}], \"receivers\": [], " more "}"
#define BALL "{\"sdf\": {\"shape\": \"sphere\", \"radius\": 1}}"

TEST(a_scene_keeps_the_truth_only_where_an_error_is_kept) {
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    static const struct {
        const char *text;
        int32_t truth;
        bool kept;
    } cases[] = {{SCENE(BALL, "\"method\": \"adaptive\""), 1, true},
                 {SCENE(BALL, "\"method\": \"adaptive\""), 0, false},
                 {SCENE(BALL, "\"method\": \"cone\""), 1, false}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        options.truth = cases[i].truth;
        OWNED(vsh_occluders) *made = of_scene(cases[i].text, &options, VSH_OK);
        const vshi_occluder_parts parts = parts_of(made);
        assert_int_equal(parts.true_solids != NULL, cases[i].kept);
        assert_null(parts.true_triangles);
        assert_null(parts.triangles);
    }
    options.receivers_min = (const double[]){0, 0, 0}; /* a box without its other half */
    assert_null(of_scene(cases[2].text, &options, VSH_ERROR_ARGUMENT));
}

TEST(more_than_128_layers_are_refused) {
    const double ball[4] = {0, 0, 0, 1};
    vsh_caster casters[VSHI_MAX_LAYERS + 1] = {{.type = VSH_CASTER_SPHERES}};
    for (size_t i = 0; i <= VSHI_MAX_LAYERS; ++i) {
        casters[i] = (vsh_caster){.type = VSH_CASTER_SPHERES, .spheres = ball, .sphere_count = 1};
        casters[i].transform[0] = casters[i].transform[5] = casters[i].transform[10] = 1.0;
    }
    const double up[3] = {0, 1, 0};
    const vsh_light light = sun(up, 0.1);
    vsh_scene scene = {.casters = casters,
                       .grid = vsh_grid_options_default(),
                       .shade = vsh_shade_options_default(),
                       .lights = &light,
                       .light_count = 1};
    scene.shade.method = VSH_SHADOW_HARD;
    for (size_t more = 0; more < 2; ++more) {
        scene.caster_count = VSHI_MAX_LAYERS + more;
        OWNED(vsh_assets) *assets = NULL;
        OWNED(vsh_occluders) *made = NULL;
        assert_ok(vsh_assets_load(&scene, NULL, &assets, &failure));
        const vsh_result result = vsh_scene_occluders(&scene, assets, NULL, NULL, &made, &failure);
        assert_int_equal(result, more ? VSH_ERROR_INPUT : VSH_OK);
    }
    assert_string_equal(failure.message,
                        "0 layers and 129 casters that are not voxelised: at most 128 together");
}

TEST(default_transforms_are_the_identity_and_zeroed_ones_are_refused) {
    enum { COUNT = 2 };
    vsh_caster casters[COUNT] = {vsh_caster_default(), vsh_caster_default()};
    vsh_receiver receiver = vsh_receiver_default();
    vsh_scene scene = {.casters = casters,
                       .caster_count = COUNT,
                       .receivers = &receiver,
                       .receiver_count = 1,
                       .grid = vsh_grid_options_default()};
    receiver.path = casters[0].path = casters[1].path = VSH_ASSETS "/thin.glb";
    vsh_assets *assets = NULL;
    assert_ok(vsh_assets_load(&scene, NULL, &assets, &failure));
    vsh_assets_free(assets);
    const struct {
        double *at, value;
        const char *message;
    } cases[] = {
        {&casters[1].transform[5], 0.0,
         "casters[1].transform flattens everything (determinant 0); vsh_caster_default() gives the identity"},
        {&receiver.transform[0], 0.0,
         "receivers[0].transform flattens everything (determinant 0); vsh_receiver_default() gives the "
         "identity"},
        {&casters[0].transform[3], NAN, "casters[0].transform[3] is nan: expected a finite number"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const double before = *cases[i].at;
        *cases[i].at = cases[i].value;
        assert_int_equal(vsh_assets_load(&scene, NULL, &assets, &failure), VSH_ERROR_ARGUMENT);
        assert_string_equal(failure.message, cases[i].message);
        *cases[i].at = before;
    }
    casters[0] = (vsh_caster){.type = VSH_CASTER_MESH, .path = casters[1].path};
    assert_int_equal(vsh_assets_load(&scene, NULL, &assets, &failure), VSH_ERROR_ARGUMENT);
    assert_memory_equal(failure.message, "casters[0].transform flattens", 29);
}

static void count_lost(void *user, const char *message) {
    *(int *)user += strstr(message, "and casts nothing") != NULL;
}

TEST(casters_that_voxels_lose_get_a_warning_where_voxels_decide) {
    static const struct {
        int32_t method, silent;
        bool told;
    } cases[] = {{VSH_SHADOW_CONE, 0, true}, {VSH_SHADOW_CONE, 1, false}, {VSH_SHADOW_EXACT, 0, false}};
    vsh_caster caster = vsh_caster_default();
    caster.path = VSH_ASSETS "/thin.glb";
    const vsh_light light = vsh_light_default();
    vsh_scene scene = {.casters = &caster,
                       .caster_count = 1,
                       .lights = &light,
                       .light_count = 1,
                       .grid = vsh_grid_options_default(),
                       .shade = vsh_shade_options_default()};
    scene.grid.resolution = 32;
    OWNED(vsh_assets) *assets = NULL;
    assert_ok(vsh_assets_load(&scene, NULL, &assets, &failure));
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        int told = 0;
        vsh_run run = vsh_run_default();
        run.warning = count_lost;
        run.user = &told;
        scene.shade.method = cases[i].method;
        vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
        options.silent_voxels = cases[i].silent;
        OWNED(vsh_occluders) *made = NULL;
        assert_ok(vsh_scene_occluders(&scene, assets, &options, &run, &made, &failure));
        assert_int_equal(told > 0, cases[i].told);
    }
}

/* --- layers beside the field: what they hide, and how it is combined */

enum { SIZE = 64, COUNT = SIZE * SIZE };

/* The seeds' floor; its solids one by one, and all of them. */
static const double towards[3] = {-0.5, 0.6, -0.6};
static double positions[3 * COUNT];
static float normals[3 * COUNT];

static truth_solid ball(double x, double y, double z, double radius) {
    return (truth_solid){.shape = TRUTH_SPHERE, .center = {x, y, z}, .radius = radius};
}

static vsh_field *field_of_ball(double x, double y, double z, double radius, double voxel) {
    const truth_solid solid = ball(x, y, z, radius);
    return field_of((truth_scene){&solid, 1}, voxel, 4.0);
}

static void shade(const vsh_occluders *occluders, const vsh_light *light, int32_t method, float *values,
                  float *deviation) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_options options = preview_options();
    options.method = method;
    shade_points(occluders, &points, light, &options, NULL, values, deviation);
}

/* By one cone a point. */
static void shade_plainly(const vsh_occluders *occluders, const vsh_light *light, float *values) {
    shade(occluders, light, VSH_SHADOW_CONE, values, NULL);
}

static void shade_ao(const vsh_occluders *occluders, float *values) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    const vsh_shade_options options = preview_options();
    shade_ao_points(occluders, &points, &options, NULL, values, NULL);
}

static void assert_all(const float *values, double expected, double tolerance) {
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(values[i], expected, tolerance);
    }
}

static float least_of(const float *values) {
    float least = 1.0f;
    for (size_t i = 0; i < COUNT; ++i) {
        least = fminf(least, values[i]);
    }
    return least;
}

static void assert_same(const float *values, const float *others, double tolerance) {
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(values[i], others[i], tolerance);
    }
}

static vshi_layer layer_of(const vsh_field *field) {
    vshi_layer layer = vshi_layer_default();
    layer.field = field;
    return layer;
}

TEST(where_nothing_casts_all_light_arrives_that_the_horizon_lets_through) {
    OWNED(vsh_field) *empty = field_of_nothing(0.05);
    const vsh_light above = sun(towards, 0.2);
    const vsh_light low = sun((const double[]){1.0, 0.0, 0.0}, 0.2); /* half of it below the horizon */
    float values[COUNT];
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_SMOOTH, VSH_SHADOW_CONE, VSH_SHADOW_RAYS,
                               VSH_SHADOW_ADAPTIVE};
    for (size_t m = 0; m < COUNT_OF(methods); ++m) {
        shade(occluders_of(empty), &above, methods[m], values, NULL);
        assert_all(values, 1.0, 0.0);
        if (methods[m] != VSH_SHADOW_HARD) {
            shade(occluders_of(empty), &low, methods[m], values, NULL);
            assert_all(values, 0.5, 0.05);
        }
    }
    shade_ao(occluders_of(empty), values);
    assert_all(values, 1.0, 1e-6);
}

/* Light from so low that the horizon cuts into it, which is not to count twice. */
TEST(a_layer_over_nothing_is_as_the_field_itself) {
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05), *empty = field_of_nothing(0.05);
    const vshi_layer layer = layer_of(field);
    const vsh_light lights[2] = {sun(towards, 0.2), sun((const double[]){1.0, 0.05, 0.2}, 0.2)};
    float alone[COUNT], layered[COUNT];
    for (int l = 0; l < 2; ++l) {
        shade_plainly(occluders_of(field), &lights[l], alone);
        shade_plainly(occluders_with(empty, &layer, 1), &lights[l], layered);
        assert_same(layered, alone, 2e-6);
        assert_true(least_of(layered) < 0.8f);
    }
}

/* Two balls whose shadows do not meet: the product of their layers is the shadow of both. The truth is the
 * union in one field. Where their discs overlap in the sky, the product is that of independent shares. */
TEST(layers_whose_shadows_do_not_meet_shade_like_their_union) {
    OWNED(vsh_field) *a = field_of_ball(-1.0, 0.6, -0.6, 0.3, 0.025),
                     *b = field_of_ball(1.0, 0.6, 0.6, 0.3, 0.025);
    const truth_solid both[2] = {ball(-1.0, 0.6, -0.6, 0.3), ball(1.0, 0.6, 0.6, 0.3)};
    OWNED(vsh_field) *all = field_of((truth_scene){both, 2}, 0.025, 4.0);
    const vsh_light light = sun(towards, 0.2);
    const vshi_layer layer = layer_of(b);
    float united[COUNT], layered[COUNT];
    shade_plainly(occluders_of(all), &light, united);
    shade_plainly(occluders_with(a, &layer, 1), &light, layered);
    size_t dark = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        dark += united[i] < 0.1f;
    }
    assert_true(dark > 40);
    assert_less(truth_compare(COUNT, layered, united, NULL).rmse, 2e-3);
}

/* The darker of both is the field alone, bit by bit, the product its square. */
TEST(layers_are_combined_by_product_or_minimum) {
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05);
    const vsh_light light = sun(towards, 0.2);
    vshi_layer layer = layer_of(field);
    float alone[COUNT], darker[COUNT], product[COUNT], remapped[COUNT];
    shade_plainly(occluders_of(field), &light, alone);
    layer.combine = VSH_COMBINE_MULTIPLY;
    shade_plainly(occluders_with(field, &layer, 1), &light, product);
    layer.combine = VSH_COMBINE_MIN;
    shade_plainly(occluders_with(field, &layer, 1), &light, darker);
    layer.remap[0] = 0.25;
    layer.remap[1] = 0.75;
    shade_plainly(occluders_with(field, &layer, 1), &light, remapped);
    assert_memory_equal(alone, darker, sizeof alone);
    size_t between_edges = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        const double x = fmin(1.0, fmax(0.0, ((double)alone[i] - 0.25) / 0.5));
        assert_float_equal(product[i], alone[i] * alone[i], 1e-6);
        assert_float_equal(remapped[i], fmin((double)alone[i], x * x * (3.0 - 2.0 * x)), 1e-6);
        between_edges += x > 0.0 && x < 1.0;
    }
    assert_true(between_edges > 20);
}

TEST(half_the_softness_is_half_the_light) {
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05), *empty = field_of_nothing(0.05);
    const vsh_light full = sun(towards, 2.0 * atan(0.1)), half = sun(towards, 2.0 * atan(0.05));
    vshi_layer layer = layer_of(field);
    layer.softness = 0.5;
    float smaller[COUNT], layered[COUNT];
    shade_plainly(occluders_of(field), &half, smaller);
    shade_plainly(occluders_with(empty, &layer, 1), &full, layered);
    assert_same(layered, smaller, 1e-6);
    layer.softness = 0.0;
    shade_plainly(occluders_with(empty, &layer, 1), &full, layered);
    size_t dark = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(layered[i] == 0.0f || layered[i] == 1.0f);
        dark += layered[i] == 0.0f;
    }
    assert_true(dark > 50);
}

TEST(layers_cast_for_the_lights_they_name_and_in_ao_by_option) {
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.4, 0.0, 0.4, 0.05), *empty = field_of_nothing(0.05);
    vsh_light light = sun(towards, 0.2);
    const char *const names[] = {"moon", "sun"};
    vshi_layer layer = layer_of(field);
    layer.lights = names;
    layer.light_count = 1;
    float values[COUNT], ao[COUNT], alone[COUNT];
    shade_plainly(occluders_with(empty, &layer, 1), &light, values);
    assert_all(values, 1.0, 0.0);
    layer.light_count = 2;
    shade_plainly(occluders_with(empty, &layer, 1), &light, values);
    assert_true(least_of(values) < 0.01f);

    shade_ao(occluders_of(field), alone);
    for (int remapped = 0; remapped < 2; ++remapped) {
        layer.remap[0] = remapped ? 0.4 : 0.0; /* which is of shadows */
        layer.remap[1] = remapped ? 0.6 : 1.0;
        shade_ao(occluders_with(empty, &layer, 1), ao);
        assert_same(ao, alone, 1e-6);
    }
    layer.ao = 0;
    shade_ao(occluders_with(empty, &layer, 1), ao);
    assert_all(ao, 1.0, 1e-6);
}

TEST(deviations_of_independent_values_add_up) {
    OWNED(vsh_field) *a = field_of_ball(-0.2, 0.8, 0.0, 0.5, 0.05),
                     *b = field_of_ball(0.2, 0.9, 0.1, 0.5, 0.05);
    const vsh_light light = sun(towards, 0.3);
    vshi_layer layer = layer_of(b);
    float va[COUNT], vb[COUNT], both[COUNT], da[COUNT], db[COUNT], dboth[COUNT];
    shade(occluders_of(a), &light, VSH_SHADOW_RAYS, va, da);
    shade(occluders_of(b), &light, VSH_SHADOW_RAYS, vb, db);
    shade(occluders_with(a, &layer, 1), &light, VSH_SHADOW_RAYS, both, dboth);
    size_t open = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        if (va[i] > 0.0f && va[i] < 1.0f && vb[i] > 0.0f && vb[i] < 1.0f) {
            /* the layer's rays are others than those of the field's own bake: their errors are not */
            assert_float_equal(dboth[i], hypot((double)(da[i] * vb[i]), (double)(va[i] * db[i])), 0.02);
            assert_true(dboth[i] > 0.0f);
            ++open;
        }
    }
    assert_true(open > 10);
}

/* A lightmap of the floor y = 0 over [-1, 1]², u along x, v along -z. */
typedef struct floor_bake {
    float shadow[COUNT], ao[COUNT];
    vsh_bake_stats stats;
} floor_bake;

static void bake_floor(const vsh_field *field, const vshi_layer *layers, size_t layer_count,
                       floor_bake *baked) {
    const vsh_mesh mesh = floor_mesh(NULL);
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.padding = 0;
    options.ao_spacing = 1;
    OWNED(vsh_charts) *texels = charts_from(&mesh, 1, &options);
    const double over[3] = {-1.0, 0.7, 0.1};
    const vsh_light light = sun(over, 0.2);
    const vsh_shade_options shade = preview_options();
    float *planes[1] = {baked->shadow};
    const vsh_lightmap lightmap = {.shadow = planes, .ao = baked->ao};
    baked->stats = vsh_bake_stats_zero();
    assert_ok(vsh_bake_lightmap(occluders_with(field, layers, layer_count), texels, &light, 1, &shade, NULL,
                                &lightmap, &baked->stats, &failure));
}

/* A wall of [-0.2, 0.2] × [0, 1] across the floor's slab: in one field, in a layer of its own, and all in a
 * layer. The layer's voxels are then four times as large as the unit of start offsets. The receiver must not
 * shade itself. Texels under the wall are invalid and filled in each way. */
TEST(lightmaps_are_the_same_however_casters_are_layered) {
    const truth_solid slab = {.shape = TRUTH_BOX, .center = {0.0, -0.25, 0.0}, .half = {1.5, 0.25, 1.5}};
    const truth_solid wall = {.shape = TRUTH_BOX, .center = {0.0, 0.4, 0.0}, .half = {0.2, 0.6, 1.5}};
    const truth_solid both[2] = {slab, wall};
    OWNED(vsh_field) *united = field_of((truth_scene){both, 2}, 0.04, 4.0);
    OWNED(vsh_field) *ground = field_of((truth_scene){&slab, 1}, 0.04, 4.0);
    OWNED(vsh_field) *alone = field_of((truth_scene){&wall, 1}, 0.04, 4.0), *empty = field_of_nothing(0.01);
    const vshi_layer of_wall = layer_of(alone), of_all = layer_of(united);
    static floor_bake plain, layered;
    bake_floor(united, NULL, 0, &plain);
    assert_in_range(plain.stats.invalid_texels, SIZE * SIZE / 6, SIZE * SIZE / 4);
    for (int w = 0; w < 2; ++w) {
        bake_floor(w == 0 ? ground : empty, w == 0 ? &of_wall : &of_all, 1, &layered);
        assert_int_equal(layered.stats.invalid_texels, plain.stats.invalid_texels);
        assert_same(layered.shadow, plain.shadow, 0.05);
        assert_same(layered.ao, plain.ao, 0.05);
    }
}

TEST(bad_layers_are_refused_by_name) {
    OWNED(vsh_field) *empty = field_of_nothing(0.05);
    const vsh_light light = sun(towards, 0.2);
    const vsh_points points = {1, positions, normals, NULL};
    float value;
    const struct {
        const char *message;
        vshi_layer layer;
    } cases[] = {
        {"layer 0: softness -1 is out of range 0 … 1000", {.softness = -1.0}},
        {"layer 0: softness nan is out of range 0 … 1000", {.softness = NAN}},
        {"layer 0: method 10 is out of range -1 … 9", {.method = 10}},
        {"layer 0: combine 2 is out of range 0 … 1", {.combine = 2}},
        {"layer 0: remap[1] 0.25 is out of range 0.5 … 1", {.remap = {0.5, 0.25}}},
        {"layer 0: remap from 0.5 to 0.5: expected a rise", {.remap = {0.5, 0.5}}},
        {"layer 0: start_offset 17 is out of range -1 … 16", {.start_offset = 17.0}},
        {"layer 0: method exact: the occluders have no triangles, which it traces",
         {.field = empty, .method = VSH_SHADOW_EXACT}},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        vshi_layer layer = cases[i].layer;
        vshi_occluder_parts parts = {.field = NULL};
        parts.field = empty;
        parts.layers = &layer;
        parts.layer_count = 1;
        OWNED(vsh_occluders) *made = NULL;
        vsh_result result = vshi_occluders_make(&parts, NULL, &made, &failure);
        if (result == VSH_OK) { /* only the call knows the method */
            result = vsh_shade_shadow(made, &points, &light, NULL, NULL, &value, NULL, NULL, &failure);
        }
        assert_int_equal(result, VSH_ERROR_ARGUMENT);
        assert_string_equal(failure.message, cases[i].message);
    }
}

static int fill(void **state) {
    floor_texels(SIZE, positions, normals);
    return 0;
}

FIXTURE(fill, NULL)
