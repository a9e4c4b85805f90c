/* Layers beside the field: what they hide, and how it is combined. */
#include "field/field.h"
#include "previews.h"
#include "shading.h"
#include "testing.h"

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

static vsh_field *nothing(double voxel) {
    vsh_field *field = NULL;
    assert_int_equal(vshi_field_create_empty(voxel, &field, NULL), VSH_OK);
    return field;
}

static void shade(const vsh_occluders *occluders, const vsh_light *light, int32_t method, float *values,
                  float *deviation) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_options options = preview_options();
    options.method = method;
    assert_ok(vsh_shade_shadow(occluders, &points, light, &options, NULL, values, deviation, NULL, &failure));
}

/* By one cone a point. */
static void shade_plainly(const vsh_occluders *occluders, const vsh_light *light, float *values) {
    shade(occluders, light, VSH_SHADOW_CONE, values, NULL);
}

static void shade_ao(const vsh_occluders *occluders, float *values) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    const vsh_shade_options options = preview_options();
    assert_ok(vsh_shade_ao(occluders, &points, &options, NULL, values, NULL, NULL, NULL, &failure));
}

static void assert_all(const float *values, double expected, double tolerance) {
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(values[i], expected, tolerance);
    }
}

static void assert_same(const float *values, const float *others, double tolerance) {
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(values[i], others[i], tolerance);
    }
}

static vsh_layer layer_of(const vsh_field *field) {
    vsh_layer layer = vsh_layer_default();
    layer.field = field;
    return layer;
}

TEST(where_nothing_casts_all_light_arrives_that_the_horizon_lets_through) {
    OWNED(vsh_field) *empty = nothing(0.05);
    const vsh_light above = sun(towards, 0.2);
    const vsh_light low = sun((const double[]){1.0, 0.0, 0.0}, 0.2); /* half of it below the horizon */
    float values[COUNT];
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_SMOOTH, VSH_SHADOW_CONE, VSH_SHADOW_RAYS,
                               VSH_SHADOW_ADAPTIVE};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; ++m) {
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
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05), *empty = nothing(0.05);
    const vsh_layer layer = layer_of(field);
    const vsh_light lights[2] = {sun(towards, 0.2), sun((const double[]){1.0, 0.05, 0.2}, 0.2)};
    float alone[COUNT], layered[COUNT];
    for (int l = 0; l < 2; ++l) {
        shade_plainly(occluders_of(field), &lights[l], alone);
        shade_plainly(occluders_with(empty, &layer, 1), &lights[l], layered);
        assert_same(layered, alone, 2e-6);
        float least = 1.0f;
        for (size_t i = 0; i < COUNT; ++i) {
            least = fminf(least, layered[i]);
        }
        assert_true(least < 0.8f);
    }
}

/* Two balls whose shadows do not meet: the product of their layers is the shadow of both. The truth is the
 * union in one field. Where their discs overlap in the sky, the product is that of independent shares. */
TEST(layers_whose_shadows_do_not_meet_are_as_their_union) {
    OWNED(vsh_field) *a = field_of_ball(-1.0, 0.6, -0.6, 0.3, 0.025),
                     *b = field_of_ball(1.0, 0.6, 0.6, 0.3, 0.025);
    const truth_solid both[2] = {ball(-1.0, 0.6, -0.6, 0.3), ball(1.0, 0.6, 0.6, 0.3)};
    OWNED(vsh_field) *all = field_of((truth_scene){both, 2}, 0.025, 4.0);
    const vsh_light light = sun(towards, 0.2);
    const vsh_layer layer = layer_of(b);
    float united[COUNT], layered[COUNT];
    shade_plainly(occluders_of(all), &light, united);
    shade_plainly(occluders_with(a, &layer, 1), &light, layered);
    size_t dark = 0;
    double square = 0.0;
    for (size_t i = 0; i < COUNT; ++i) {
        dark += united[i] < 0.1f;
        square += (double)((layered[i] - united[i]) * (layered[i] - united[i]));
    }
    assert_true(dark > 40);
    assert_true(sqrt(square / COUNT) < 2e-3);
}

/* The darker of both is the field alone, bit by bit, the product its square. */
TEST(a_layer_that_repeats_the_field_is_combined_as_it_says) {
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05);
    const vsh_light light = sun(towards, 0.2);
    vsh_layer layer = layer_of(field);
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
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05), *empty = nothing(0.05);
    const vsh_light full = sun(towards, 2.0 * atan(0.1)), half = sun(towards, 2.0 * atan(0.05));
    vsh_layer layer = layer_of(field);
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

TEST(a_layer_casts_for_the_lights_it_names_and_in_ao_where_it_says_so) {
    OWNED(vsh_field) *field = field_of_ball(0.0, 0.4, 0.0, 0.4, 0.05), *empty = nothing(0.05);
    vsh_light light = sun(towards, 0.2);
    const char *const names[] = {"moon", "sun"};
    vsh_layer layer = layer_of(field);
    layer.lights = names;
    layer.light_count = 1;
    float values[COUNT], ao[COUNT], alone[COUNT];
    shade_plainly(occluders_with(empty, &layer, 1), &light, values);
    assert_all(values, 1.0, 0.0);
    layer.light_count = 2;
    shade_plainly(occluders_with(empty, &layer, 1), &light, values);
    float least = 1.0f;
    for (size_t i = 0; i < COUNT; ++i) {
        least = fminf(least, values[i]);
    }
    assert_true(least < 0.01f);

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
    vsh_layer layer = layer_of(b);
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

static void bake_floor(const vsh_field *field, const vsh_layer *layers, size_t layer_count,
                       floor_bake *baked) {
    static const float corners[12] = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1},
                       uvs[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh mesh = {.name = "floor",
                           .positions = corners,
                           .uvs = uvs,
                           .indices = indices,
                           .vertex_count = 4,
                           .triangle_count = 2};
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.padding = 0;
    options.ao_spacing = 1;
    OWNED(vsh_charts) *texels = NULL;
    assert_int_equal(vsh_charts_create(&mesh, 1, &options, NULL, NULL, &texels, NULL), VSH_OK);
    const double over[3] = {-1.0, 0.7, 0.1};
    const vsh_light light = sun(over, 0.2);
    const vsh_shade_options shade = preview_options();
    float *planes[1] = {baked->shadow};
    const vsh_lightmap lightmap = {.shadow = planes, .ao = baked->ao};
    baked->stats = vsh_bake_stats_zero();
    assert_ok(vsh_bake_lightmap(occluders_with(field, layers, layer_count), texels, &light, 1, &shade, NULL,
                                &lightmap, &baked->stats, &failure));
}

/* A wall of [-0.2, 0.2] × [0, 1] across the floor's slab: as one field, in a layer of its own, and all of it
 * in a layer of voxels four times as large as those that start offsets are measured in. The receiver must not
 * shade itself, and what is under the wall is invalid and filled in each way. */
TEST(lightmaps_are_the_same_however_casters_are_layered) {
    const truth_solid slab = {.shape = TRUTH_BOX, .center = {0.0, -0.25, 0.0}, .half = {1.5, 0.25, 1.5}};
    const truth_solid wall = {.shape = TRUTH_BOX, .center = {0.0, 0.4, 0.0}, .half = {0.2, 0.6, 1.5}};
    const truth_solid both[2] = {slab, wall};
    OWNED(vsh_field) *united = field_of((truth_scene){both, 2}, 0.04, 4.0);
    OWNED(vsh_field) *ground = field_of((truth_scene){&slab, 1}, 0.04, 4.0);
    OWNED(vsh_field) *alone = field_of((truth_scene){&wall, 1}, 0.04, 4.0), *empty = nothing(0.01);
    const vsh_layer of_wall = layer_of(alone), of_all = layer_of(united);
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

TEST(layers_out_of_range_are_refused) {
    OWNED(vsh_field) *empty = nothing(0.05);
    const vsh_light light = sun(towards, 0.2);
    const vsh_points points = {1, positions, normals, NULL};
    float value;
    const struct {
        const char *message;
        vsh_layer layer;
    } cases[] = {
        {"layer 0: none of field, heights and spheres: expected one", vsh_layer_default()},
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
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        vsh_layer layer = cases[i].layer;
        layer.struct_size = sizeof layer;
        vsh_occluder_parts parts = vsh_occluder_parts_default();
        parts.field = empty;
        parts.layers = &layer;
        parts.layer_count = 1;
        OWNED(vsh_occluders) *made = NULL;
        vsh_result result = vsh_occluders_from_parts(&parts, &made, &failure);
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
