/* Layers beside the field: what they hide, and how it is combined. */
#include "expect.h"
#include "field/field.h"
#include "previews.h"
#include "shading.h"

#include <stdlib.h>
#include <vdbshade/bake.h>

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

static void shade(const vsh_occluders *occluders, const vsh_light *light, const vsh_shade_options *options,
                  float *values, float *deviation) {
    const vsh_points points = {COUNT, positions, normals, NULL};
    expect_ok(vsh_shade_shadow(occluders, &points, light, options, NULL, values, deviation, NULL, &failure));
}

static vsh_layer layer_of(const vsh_field *field) {
    vsh_layer layer = vsh_layer_default();
    layer.field = field;
    return layer;
}

/* Where nothing casts, all light arrives that the receiver's horizon lets through. */
static void test_nothing_hides(void **state) {
    vsh_field *empty = nothing(0.05);
    const vsh_light above = sun(towards, 0.2);
    const double level[3] = {1.0, 0.0, 0.0}; /* half of it below the horizon */
    const vsh_light low = sun(level, 0.2);
    float values[COUNT];
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_SMOOTH, VSH_SHADOW_CONE, VSH_SHADOW_RAYS,
                               VSH_SHADOW_ADAPTIVE};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; ++m) {
        vsh_shade_options options = preview_options();
        options.method = methods[m];
        shade(occluders_of(empty), &above, &options, values, NULL);
        for (size_t i = 0; i < COUNT; ++i) {
            assert_float_equal(values[i], 1.0f, 0.0f);
        }
        if (methods[m] != VSH_SHADOW_HARD) {
            shade(occluders_of(empty), &low, &options, values, NULL);
            for (size_t i = 0; i < COUNT; ++i) {
                assert_float_equal(values[i], 0.5f, 0.05f);
            }
        }
    }
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_options options = preview_options();
    assert_int_equal(
        vsh_shade_ao(occluders_of(empty), &points, &options, NULL, values, NULL, NULL, NULL, NULL), VSH_OK);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(values[i], 1.0f, 1e-6f);
    }
    vsh_field_free(empty);
}

/* All casters in a layer over an empty field: as in the field itself. Light from so low that the horizon cuts
 * into it, which is not to count twice. */
static void test_layer_alone(void **state) {
    vsh_field *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05), *empty = nothing(0.05);
    const vsh_layer layer = layer_of(field);
    const double low[3] = {1.0, 0.05, 0.2};
    const vsh_light lights[2] = {sun(towards, 0.2), sun(low, 0.2)};
    float alone[COUNT], layered[COUNT];
    const vsh_shade_options plain = preview_options();
    for (int l = 0; l < 2; ++l) {
        shade(occluders_of(field), &lights[l], &plain, alone, NULL);
        shade(occluders_with(empty, &layer, 1), &lights[l], &plain, layered, NULL);
        double most = 0.0, dark = 0.0;
        for (size_t i = 0; i < COUNT; ++i) {
            most = fmax(most, fabs((double)(layered[i] - alone[i])));
            dark = fmax(dark, 1.0 - (double)layered[i]);
        }
        assert_true(dark > 0.2);
        assert_true(most < 2e-6);
    }
    vsh_field_free(field);
    vsh_field_free(empty);
}

/* Two balls whose shadows do not meet: the product of their layers is the shadow of both. The truth is the
 * union in one field. Where their discs overlap in the sky, the product is that of independent shares. */
static void test_product(void **state) {
    vsh_field *a = field_of_ball(-1.0, 0.6, -0.6, 0.3, 0.025), *b = field_of_ball(1.0, 0.6, 0.6, 0.3, 0.025);
    const truth_solid both[2] = {ball(-1.0, 0.6, -0.6, 0.3), ball(1.0, 0.6, 0.6, 0.3)};
    vsh_field *all = field_of((truth_scene){both, 2}, 0.025, 4.0);
    const vsh_light light = sun(towards, 0.2);
    const vsh_layer layer = layer_of(b);
    const vsh_shade_options plain = preview_options();
    float united[COUNT], layered[COUNT];
    shade(occluders_of(all), &light, &plain, united, NULL);
    shade(occluders_with(a, &layer, 1), &light, &plain, layered, NULL);
    size_t dark = 0;
    double square = 0.0;
    for (size_t i = 0; i < COUNT; ++i) {
        dark += united[i] < 0.1f;
        square += (double)((layered[i] - united[i]) * (layered[i] - united[i]));
    }
    assert_true(dark > 40);
    assert_true(sqrt(square / COUNT) < 2e-3);
    vsh_field_free(a);
    vsh_field_free(b);
    vsh_field_free(all);
}

/* A layer that repeats the field: the darker of both is the field alone, bit by bit, the product its square.
 */
static void test_combinations(void **state) {
    vsh_field *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05);
    const vsh_light light = sun(towards, 0.2);
    vsh_layer layer = layer_of(field);
    const vsh_shade_options plain = preview_options();
    float alone[COUNT], combined[COUNT];
    shade(occluders_of(field), &light, &plain, alone, NULL);
    layer.combine = VSH_COMBINE_MIN;
    shade(occluders_with(field, &layer, 1), &light, &plain, combined, NULL);
    assert_memory_equal(alone, combined, sizeof alone);
    layer.combine = VSH_COMBINE_MULTIPLY;
    shade(occluders_with(field, &layer, 1), &light, &plain, combined, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(combined[i], alone[i] * alone[i], 1e-6);
    }
    layer.combine = VSH_COMBINE_MIN;
    layer.remap[0] = 0.25;
    layer.remap[1] = 0.75;
    shade(occluders_with(field, &layer, 1), &light, &plain, combined, NULL);
    size_t between_edges = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        const double x = fmin(1.0, fmax(0.0, ((double)alone[i] - 0.25) / 0.5));
        assert_float_equal(combined[i], fmin((double)alone[i], x * x * (3.0 - 2.0 * x)), 1e-6);
        between_edges += x > 0.0 && x < 1.0;
    }
    assert_true(between_edges > 20);
    vsh_field_free(field);
}

/* Half the softness is half the light. */
static void test_softness(void **state) {
    vsh_field *field = field_of_ball(0.0, 0.8, 0.0, 0.5, 0.05), *empty = nothing(0.05);
    const vsh_light full = sun(towards, 2.0 * atan(0.1)), half = sun(towards, 2.0 * atan(0.05));
    vsh_layer layer = layer_of(field);
    layer.softness = 0.5;
    const vsh_shade_options plain = preview_options();
    float smaller[COUNT], layered[COUNT];
    shade(occluders_of(field), &half, &plain, smaller, NULL);
    shade(occluders_with(empty, &layer, 1), &full, &plain, layered, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(layered[i], smaller[i], 1e-6);
    }
    layer.softness = 0.0;
    shade(occluders_with(empty, &layer, 1), &full, &plain, layered, NULL);
    size_t dark = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        assert_true(layered[i] == 0.0f || layered[i] == 1.0f);
        dark += layered[i] == 0.0f;
    }
    assert_true(dark > 50);
    vsh_field_free(field);
    vsh_field_free(empty);
}

/* A layer casts for the lights it names, and takes part in AO where it says so. */
static void test_where_it_counts(void **state) {
    vsh_field *field = field_of_ball(0.0, 0.4, 0.0, 0.4, 0.05), *empty = nothing(0.05);
    vsh_light light = sun(towards, 0.2);
    const char *const names[] = {"moon", "sun"};
    vsh_layer layer = layer_of(field);
    layer.lights = names;
    layer.light_count = 1;
    const vsh_shade_options plain = preview_options();
    float values[COUNT], ao[COUNT], alone[COUNT];
    shade(occluders_with(empty, &layer, 1), &light, &plain, values, NULL);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(values[i], 1.0f, 0.0f);
    }
    layer.light_count = 2;
    shade(occluders_with(empty, &layer, 1), &light, &plain, values, NULL);
    float least = 1.0f;
    for (size_t i = 0; i < COUNT; ++i) {
        least = fminf(least, values[i]);
    }
    assert_true(least < 0.01f);

    const vsh_points points = {COUNT, positions, normals, NULL};
    assert_int_equal(
        vsh_shade_ao(occluders_with(empty, &layer, 1), &points, &plain, NULL, ao, NULL, NULL, NULL, NULL),
        VSH_OK);
    assert_int_equal(vsh_shade_ao(occluders_of(field), &points, &plain, NULL, alone, NULL, NULL, NULL, NULL),
                     VSH_OK);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(ao[i], alone[i], 1e-6);
    }
    /* a remap is of shadows */
    layer.remap[0] = 0.4;
    layer.remap[1] = 0.6;
    assert_int_equal(
        vsh_shade_ao(occluders_with(empty, &layer, 1), &points, &plain, NULL, ao, NULL, NULL, NULL, NULL),
        VSH_OK);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(ao[i], alone[i], 1e-6);
    }
    layer.ao = 0;
    assert_int_equal(
        vsh_shade_ao(occluders_with(empty, &layer, 1), &points, &plain, NULL, ao, NULL, NULL, NULL, NULL),
        VSH_OK);
    for (size_t i = 0; i < COUNT; ++i) {
        assert_float_equal(ao[i], 1.0f, 1e-6f);
    }
    vsh_field_free(field);
    vsh_field_free(empty);
}

/* Deviations of independent values add up. */
static void test_deviation(void **state) {
    vsh_field *a = field_of_ball(-0.2, 0.8, 0.0, 0.5, 0.05), *b = field_of_ball(0.2, 0.9, 0.1, 0.5, 0.05);
    const vsh_light light = sun(towards, 0.3);
    vsh_layer layer = layer_of(b);
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_RAYS;
    float va[COUNT], vb[COUNT], both[COUNT], da[COUNT], db[COUNT], dboth[COUNT];
    shade(occluders_of(a), &light, &options, va, da);
    shade(occluders_of(b), &light, &options, vb, db);
    shade(occluders_with(a, &layer, 1), &light, &options, both, dboth);
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
    vsh_field_free(a);
    vsh_field_free(b);
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
    vsh_charts *texels = NULL;
    assert_int_equal(vsh_charts_create(&mesh, 1, &options, NULL, NULL, &texels, NULL), VSH_OK);
    const double over[3] = {-1.0, 0.7, 0.1};
    const vsh_light light = sun(over, 0.2);
    const vsh_shade_options shade = preview_options();
    float *planes[1] = {baked->shadow};
    const vsh_lightmap lightmap = {.shadow = planes, .ao = baked->ao};
    baked->stats = vsh_bake_stats_zero();
    expect_ok(vsh_bake_lightmap(occluders_with(field, layers, layer_count), texels, &light, 1, &shade, NULL,
                                &lightmap, &baked->stats, &failure));
    vsh_charts_free(texels);
}

/* A wall of [-0.2, 0.2] × [0, 1] across the floor's slab: as one field, in a layer of its own, and all of it
 * in a layer of voxels four times as large as those that start offsets are measured in. The receiver must not
 * shade itself, and what is under the wall is invalid and filled in each way. */
static void test_bake(void **state) {
    const truth_solid slab = {.shape = TRUTH_BOX, .center = {0.0, -0.25, 0.0}, .half = {1.5, 0.25, 1.5}};
    const truth_solid wall = {.shape = TRUTH_BOX, .center = {0.0, 0.4, 0.0}, .half = {0.2, 0.6, 1.5}};
    const truth_solid both[2] = {slab, wall};
    vsh_field *united = field_of((truth_scene){both, 2}, 0.04, 4.0);
    vsh_field *ground = field_of((truth_scene){&slab, 1}, 0.04, 4.0);
    vsh_field *alone = field_of((truth_scene){&wall, 1}, 0.04, 4.0), *empty = nothing(0.01);
    floor_bake *plain = malloc(sizeof *plain), *layered = malloc(sizeof *layered);
    bake_floor(united, NULL, 0, plain);
    assert_in_range(plain->stats.invalid_texels, SIZE * SIZE / 6, SIZE * SIZE / 4);

    const vsh_layer of_wall = layer_of(alone), of_all = layer_of(united);
    const struct {
        const vsh_field *field;
        const vsh_layer *layer;
    } ways[2] = {{ground, &of_wall}, {empty, &of_all}};
    for (int w = 0; w < 2; ++w) {
        bake_floor(ways[w].field, ways[w].layer, 1, layered);
        assert_int_equal(layered->stats.invalid_texels, plain->stats.invalid_texels);
        double shadow = 0.0, ao = 0.0;
        for (size_t i = 0; i < COUNT; ++i) {
            shadow = fmax(shadow, fabs((double)(layered->shadow[i] - plain->shadow[i])));
            ao = fmax(ao, fabs((double)(layered->ao[i] - plain->ao[i])));
        }
        assert_true(shadow < 0.05);
        assert_true(ao < 0.05);
    }
    free(plain);
    free(layered);
    vsh_field_free(united);
    vsh_field_free(ground);
    vsh_field_free(alone);
    vsh_field_free(empty);
}

static void test_refused(void **state) {
    vsh_field *empty = nothing(0.05);
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
        vsh_occluders *made = NULL;
        vsh_result result = vsh_occluders_from_parts(&parts, &made, &failure);
        if (result == VSH_OK) { /* only the call knows the method */
            result = vsh_shade_shadow(made, &points, &light, NULL, NULL, &value, NULL, NULL, &failure);
        }
        assert_int_equal(result, VSH_ERROR_ARGUMENT);
        assert_string_equal(failure.message, cases[i].message);
        vsh_occluders_free(made);
    }
    vsh_field_free(empty);
}

static int fill(void **state) {
    floor_texels(SIZE, positions, normals);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nothing_hides), cmocka_unit_test(test_layer_alone),
        cmocka_unit_test(test_product),       cmocka_unit_test(test_combinations),
        cmocka_unit_test(test_softness),      cmocka_unit_test(test_where_it_counts),
        cmocka_unit_test(test_deviation),     cmocka_unit_test(test_bake),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, fill, NULL);
}
