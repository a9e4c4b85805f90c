/* What casts as one handle: from meshes, from parts and from a scene. */
#include "fields.h"
#include "scenes.h"
#include "shading.h"
#include "testing.h"

/* A square plate of 2 × 2 at y = 1, and of 0.2 thick. */
static vsh_mesh plate(void) {
    static float corners[24];
    return box_mesh(corners, (const double[]){-1.0, 0.8, -1.0}, (const double[]){1.0, 1.0, 1.0});
}

TEST(meshes_make_the_field_and_triangles_that_their_parts_make) {
    const vsh_mesh mesh = plate();
    vsh_occluders_options options = vsh_occluders_options_default();
    options.grid.resolution = 64;
    options.reach = 2.0;
    OWNED(vsh_occluders) *made = NULL, *bare = NULL;
    assert_ok(vsh_occluders_create(&mesh, 1, &options, NULL, &made, &failure));
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(&mesh, 1, &options.grid, NULL, &grid, &failure));
    OWNED(vsh_field) *field = field_of_grid(grid, options.reach);
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(made, &parts);
    assert_int_equal(parts.struct_size, sizeof parts);
    assert_non_null(parts.triangles);
    assert_ptr_equal(parts.triangles, parts.true_triangles);
    uint64_t counter = 7;
    for (int i = 0; i < 200; ++i) {
        const double at[3] = {between(&counter, -2, 2), between(&counter, -2, 2), between(&counter, -2, 2)};
        float ours, theirs;
        vsh_field_sample(parts.field, 1, at, &ours);
        vsh_field_sample(field, 1, at, &theirs);
        assert_int_equal(bits_of(ours), bits_of(theirs));
    }
    vsh_field_info of_field;
    vsh_field_get_info(field, &of_field);
    vsh_occluders_info info;
    vsh_occluders_get_info(made, &info);
    assert_true(info.field_bytes == of_field.bytes && info.bricks == of_field.bricks);
    assert_true(info.voxel_size == of_field.voxel_size && info.levels == of_field.levels);
    assert_true(info.grid_bytes > 0 && info.voxelize_s > 0.0 && info.field_s > 0.0);
    assert_true(info.has_triangles);

    options.triangles = 0;
    assert_ok(vsh_occluders_create(&mesh, 1, &options, NULL, &bare, &failure));
    vsh_occluders_get_info(bare, &info);
    assert_true(info.has_triangles == 0 && info.triangles_bytes == 0);
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
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        vsh_mesh mesh = plate();
        mesh.vertex_count = cases[i].vertex_count;
        vsh_occluders *made = (vsh_occluders *)&failure;
        assert_fails(
            vsh_occluders_create(&mesh, cases[i].count, cases[i].options, cases[i].run, &made, &failure),
            cases[i].code, "");
        assert_null(made);
    }
}

static void expect_refused(const vsh_occluder_parts *parts, const char *text) {
    vsh_occluders *made = (vsh_occluders *)&failure;
    assert_fails(vsh_occluders_from_parts(parts, &made, &failure), VSH_ERROR_ARGUMENT, text);
    assert_null(made);
}

TEST(parts_that_are_none_are_refused_by_name) {
    const double ball[] = {0, 0, 0, 1};
    OWNED(vsh_spheres) *spheres = NULL;
    assert_ok(vsh_spheres_create(ball, 1, NULL, NULL, &spheres, &failure));
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    expect_refused(&parts, "neither a field nor triangles nor layers");
    parts.voxel_size = -1.0;
    expect_refused(&parts, "voxel_size");
    parts = vsh_occluder_parts_default();
    parts.layer_count = (size_t)1 << 40; /* is no reason to ask for memory */
    expect_refused(&parts, "1099511627776 layers at NULL: expected at most 128");
    vsh_layer layers[2] = {vsh_layer_default(), vsh_layer_default()};
    layers[0].spheres = spheres;
    parts.layers = layers;
    parts.layer_count = VSH_MAX_LAYERS + 1;
    expect_refused(&parts, "expected at most 128");
    parts.layer_count = 2;
    expect_refused(&parts, "layer 1: none of field, heights and spheres");
}

TEST(layers_alone_say_what_offsets_are_measured_in) {
    const double ball[] = {0, 0, 0, 1};
    OWNED(vsh_spheres) *spheres = NULL;
    assert_ok(vsh_spheres_create(ball, 1, NULL, NULL, &spheres, &failure));
    const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 0.5};
    OWNED(vsh_field) *field = field_of((truth_scene){&solid, 1}, 0.125, 1.0);
    vsh_layer layers[2] = {vsh_layer_default(), vsh_layer_default()};
    layers[0].spheres = spheres;
    layers[1].field = field;
    const struct {
        size_t layers;
        double given, expected;
    } cases[] = {{1, 0.0, 2e-5}, {2, 0.0, 0.125}, {2, 0.5, 0.5}, {0, 3.0, 3.0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        vsh_occluder_parts parts = vsh_occluder_parts_default();
        parts.layers = layers;
        parts.layer_count = cases[i].layers;
        parts.voxel_size = cases[i].given;
        OWNED(vsh_occluders) *made = NULL;
        assert_ok(vsh_occluders_from_parts(&parts, &made, &failure));
        vsh_occluder_parts views;
        vsh_occluders_get_parts(made, &views);
        assert_int_equal(views.layer_count, cases[i].layers);
        vsh_field_info info;
        vsh_field_get_info(views.field, &info);
        assert_true(info.voxel_size == cases[i].expected);
        vsh_occluders_info counted; /* the field of nothing is none */
        vsh_occluders_get_info(made, &counted);
        assert_true((counted.field_bytes > 0) == (cases[i].layers == 2));
        assert_true(counted.voxel_size == (cases[i].layers == 2 ? 0.125 : 0.0));
    }
}

TEST(a_level_set_makes_the_field_that_vsh_field_create_makes) {
    const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 0.5};
    vsh_grid *grid = grid_of((truth_scene){&solid, 1}, 0.125);
    vsh_field_options options = vsh_field_options_default();
    options.reach = -1.0;
    OWNED(vsh_occluders) *made = (vsh_occluders *)&failure;
    assert_fails(vsh_occluders_from_grid(grid, &options, NULL, &made, &failure), VSH_ERROR_ARGUMENT, "");
    assert_null(made);
    options.reach = 3.0;
    assert_ok(vsh_occluders_from_grid(grid, &options, NULL, &made, &failure));
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(made, &parts);
    assert_true(parts.triangles == NULL && parts.layer_count == 0);
    OWNED(vsh_field) *field = field_of_grid(grid, 3.0);
    vsh_field_info ours, theirs;
    vsh_field_get_info(parts.field, &ours);
    vsh_field_get_info(field, &theirs);
    assert_memory_equal(&ours, &theirs, sizeof ours);
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
    const vsh_mesh mesh = plate();
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
    vsh_occluders_info info;
    if (made != NULL) { /* no layer of these scenes refers to scene or assets */
        vsh_occluders_get_info(made, &info);
    }
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
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        options.truth = cases[i].truth;
        OWNED(vsh_occluders) *made = of_scene(cases[i].text, &options, VSH_OK);
        vsh_occluder_parts parts;
        vsh_occluders_get_parts(made, &parts);
        assert_int_equal(parts.true_solids != NULL, cases[i].kept);
        assert_null(parts.true_triangles);
        assert_null(parts.triangles);
    }
    options.receivers_min = (const double[]){0, 0, 0}; /* a box without its other half */
    assert_null(of_scene(cases[2].text, &options, VSH_ERROR_ARGUMENT));
}

TEST(more_layers_than_can_be_are_refused) {
    const double ball[4] = {0, 0, 0, 1};
    vsh_caster casters[VSH_MAX_LAYERS + 1] = {{.type = VSH_CASTER_SPHERES}};
    for (size_t i = 0; i <= VSH_MAX_LAYERS; ++i) {
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
        scene.caster_count = VSH_MAX_LAYERS + more;
        OWNED(vsh_assets) *assets = NULL;
        OWNED(vsh_occluders) *made = NULL;
        assert_ok(vsh_assets_load(&scene, NULL, &assets, &failure));
        const vsh_result result = vsh_scene_occluders(&scene, assets, NULL, NULL, &made, &failure);
        assert_int_equal(result, more ? VSH_ERROR_INPUT : VSH_OK);
    }
    assert_string_equal(failure.message,
                        "0 layers and 129 casters that are not voxelised: at most 128 together");
}

TEST(a_default_caster_stands_where_its_file_says_and_a_zeroed_transform_is_named) {
    enum { COUNT = 2 };
    vsh_caster casters[COUNT] = {vsh_caster_default(), vsh_caster_default()};
    vsh_receiver receiver = vsh_receiver_default();
    const vsh_scene scene = {.casters = casters,
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
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
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

TEST(what_voxels_lose_is_told_where_they_decide_unless_they_are_a_trial) {
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
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
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
