/* Points with strides, in floats, and answers with gaps; distance and gradient; batches. */
#include "previews.h"
#include "testing.h"
#include "traced.h"

enum { SIDE = 256, MANY = SIDE * SIDE };

/* As an engine's vertices stand in memory. */
typedef struct vertex {
    float position[3];
    uint8_t colour[4];
    float normal[3];
    uint32_t texel;
    double place[3];
    float visibility, deviation, ao, distance, gradient[3];
} vertex;

static double positions[3 * MANY];
static float normals[3 * MANY];
static uint32_t texels[MANY];
static vertex vertices[MANY];
static float visibility[MANY], deviation[MANY], ao[MANY], distance[MANY], gradient[3 * MANY];

/* Points all over the seeds' scene whose coordinates are floats, in no order. */
static void fill_points(void) {
    uint64_t count = 5;
    for (uint32_t i = 0; i < MANY; ++i) {
        double n[3];
        random_direction(&count, n);
        for (size_t axis = 0; axis < 3; ++axis) {
            vertices[i].position[axis] =
                (float)between(&count, axis == 1 ? 0.01 : -2.5, axis == 1 ? 2.0 : 2.5);
            normals[3 * i + axis] = vertices[i].normal[axis] = (float)n[axis];
        }
        texels[i] = vertices[i].texel = 5u * i + 1u;
    }
    for (uint32_t i = 0; i < 3 * MANY; ++i) {
        const float *from = &vertices[i / 3].position[i % 3];
        positions[i] = vertices[i / 3].place[i % 3] = (double)*from;
        assert_true((double)(float)positions[i] == positions[i]);
    }
}

static vsh_query *query_of(const vsh_field *field, const vsh_light *light, int32_t method) {
    vsh_query *query = NULL;
    vsh_shade_options options = preview_options();
    options.method = method;
    options.ao_method = VSH_AO_TAPS;
    options.rays = method == VSH_SHADOW_ADAPTIVE ? 64 : 8;
    assert_ok(
        vsh_query_create(occluders_of(field), light, light != NULL ? 1 : 0, &options, &query, &failure));
    return query;
}

static vsh_query_output packed_output(void) {
    static float *const shadow[1] = {visibility}, *const error[1] = {deviation};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = shadow;
    output.deviation = error;
    output.ao = ao;
    output.distance = distance;
    output.gradient = gradient;
    return output;
}

static void ask(const vsh_query *query, size_t count, const double *at, const vsh_query_output *output) {
    const bool all = output->ao != NULL; /* distances need neither normals nor texels */
    const vsh_points points = {count, at, all ? normals : NULL, all ? texels : NULL};
    assert_ok(vsh_query_points(query, &points, NULL, NULL, output, NULL, &failure));
}

TEST(strides_floats_and_gaps_give_the_bits_of_packed_arrays) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    fill_points();
    OWNED(vsh_query) *query = query_of(field, &light, VSH_SHADOW_RAYS);
    const size_t counts[] = {1, 64, 65, 1000, MANY};
    for (size_t n = 0; n < sizeof counts / sizeof counts[0]; ++n) {
        const size_t count = counts[n];
        const vsh_query_output packed = packed_output();
        ask(query, count, positions, &packed);
        for (int floats = 0; floats < 2; ++floats) {
            for (size_t i = 0; i < count; ++i) {
                vertices[i].visibility = vertices[i].deviation = vertices[i].ao = vertices[i].distance =
                    -7.0f;
                vertices[i].gradient[0] = vertices[i].gradient[1] = vertices[i].gradient[2] = -7.0f;
            }
            const vsh_points points = {count, floats ? NULL : vertices[0].place, vertices[0].normal,
                                       &vertices[0].texel};
            vsh_point_layout layout = vsh_point_layout_default();
            layout.float_positions = floats ? vertices[0].position : NULL;
            layout.position_stride = layout.normal_stride = layout.texel_stride = sizeof vertices[0];
            float *const shadow[1] = {&vertices[0].visibility}, *const error[1] = {&vertices[0].deviation};
            vsh_query_output output = vsh_query_output_default();
            output.visibility = shadow;
            output.deviation = error;
            output.ao = &vertices[0].ao;
            output.distance = &vertices[0].distance;
            output.gradient = vertices[0].gradient;
            output.stride = sizeof vertices[0];
            assert_ok(vsh_query_points(query, &points, &layout, NULL, &output, NULL, &failure));
            for (size_t i = 0; i < count; ++i) {
                assert_int_equal(bits_of(vertices[i].visibility), bits_of(visibility[i]));
                /* of rays in an order, deviations depend on it; it is the same one */
                assert_int_equal(bits_of(vertices[i].deviation), bits_of(deviation[i]));
                assert_int_equal(bits_of(vertices[i].ao), bits_of(ao[i]));
                assert_int_equal(bits_of(vertices[i].distance), bits_of(distance[i]));
                assert_memory_equal(vertices[i].gradient, gradient + 3 * i, 3 * sizeof(float));
                assert_true(vertices[i].place[0] == positions[3 * i]);
            }
        }
    }
    /* and without gaps, by strides of 0, at positions that are packed */
    const vsh_points points = {1000, positions, normals, texels};
    const vsh_point_layout layout = vsh_point_layout_default();
    const vsh_query_output packed = packed_output();
    static float kept[1000];
    ask(query, 1000, positions, &packed);
    memcpy(kept, visibility, sizeof kept);
    memset(visibility, 0, sizeof kept);
    assert_ok(vsh_query_points(query, &points, &layout, NULL, &packed, NULL, &failure));
    assert_memory_equal(kept, visibility, sizeof kept);
}

TEST(distance_is_the_fields_and_near_the_truth) {
    const double voxel = 0.04;
    OWNED(vsh_field) *field = field_of(truth_seeds(), voxel, 0.0);
    fill_points();
    OWNED(vsh_query) *query = query_of(field, NULL, VSH_SHADOW_CONE);
    vsh_query_output output = vsh_query_output_default();
    output.distance = distance;
    ask(query, MANY, positions, &output);
    vsh_field_sample(field, MANY, positions, ao);
    assert_memory_equal(distance, ao, sizeof distance);
    for (size_t i = 0; i < MANY; ++i) {
        const double true_distance = truth_distance(truth_seeds(), positions + 3 * i);
        if (true_distance > 0.0) { /* within solids that touch, the scene's is none */
            const double excess = ((double)distance[i] - true_distance) / fmax(voxel, true_distance);
            assert_that(excess > -0.4 && excess < 0.3, "distance %g, expected %g", (double)distance[i],
                        true_distance);
        }
    }
}

TEST(gradients_are_unit_and_point_away_from_the_sphere) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .center = {0.3, -0.2, 0.1}, .radius = 1.0};
    const truth_scene scene = {&ball, 1};
    const double voxel = 0.05;
    OWNED(vsh_field) *field = field_of(scene, voxel, 0.0);
    OWNED(vsh_query) *query = query_of(field, NULL, VSH_SHADOW_CONE);
    enum { COUNT = 5000 };
    uint64_t count = 9;
    for (size_t i = 0; i < COUNT; ++i) {
        double away[3];
        random_direction(&count, away);
        const double radius = between(&count, 0.9, 12.0);
        for (size_t axis = 0; axis < 3; ++axis) {
            positions[3 * i + axis] = ball.center[axis] + radius * away[axis];
        }
    }
    vsh_query_output output = vsh_query_output_default();
    output.gradient = gradient;
    ask(query, COUNT, positions, &output);
    double worst_near = 1.0, worst = 1.0;
    for (size_t i = 0; i < COUNT; ++i) {
        double length = 0.0, along = 0.0, radius = 0.0;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double from = positions[3 * i + axis] - ball.center[axis],
                         g = (double)gradient[3 * i + axis];
            length += g * g;
            along += g * from;
            radius += from * from;
        }
        radius = sqrt(radius);
        assert_true(fabs(length - 1.0) < 1e-6);
        worst = fmin(worst, along / radius);
        if (fabs(radius - 1.0) < 2.0 * voxel) {
            worst_near = fmin(worst_near, along / radius);
        }
    }
    /* A trilinear cell's gradient turns by up to half of its diagonal over the distance to the centre: 0.87 ×
     * 0.05, or 2.5°. At the end of the reach corners of cells are clamped. */
    assert_that(worst_near > cos(RADIANS(2.5)) && worst > cos(RADIANS(8.0)), "off by %g and %g degrees",
                acos(worst_near) / RADIANS(1.0), acos(worst) / RADIANS(1.0));
}

TEST(there_is_no_gradient_beyond_the_reach_nor_where_nothing_is) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .radius = 1.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&ball, 1}, 0.05, 1.0);
    OWNED(vsh_query) *query = query_of(field, NULL, VSH_SHADOW_CONE);
    const double places[4][3] = {
        {1e6, 0.0, 0.0}, {(double)NAN, 0.0, 0.0}, {0.0, (double)INFINITY, 0.0}, {1.1, 0.0, 0.0}};
    vsh_query_output output = vsh_query_output_default();
    output.gradient = gradient;
    output.distance = distance;
    ask(query, 4, places[0], &output);
    assert_true(gradient[0] == 0.0f && gradient[1] == 0.0f && gradient[2] == 0.0f);
    assert_true(distance[0] > 0.0f);
    for (size_t i = 3; i < 9; ++i) {
        assert_true(isnan(gradient[i]));
    }
    assert_true(isnan(distance[1]) && isnan(distance[2]));
    assert_true(gradient[9] > 0.99f);
}

TEST(calls_for_a_batch_each_give_the_bits_of_one_call) {
    enum { ALL = VSH_QUERY_BATCH + 40000 };
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.1);
    OWNED(vsh_query) *query = query_of(field, &light, VSH_SHADOW_ADAPTIVE);
    FREED double *at = malloc((size_t)ALL * 3 * sizeof *at);
    FREED float *one = malloc((size_t)ALL * sizeof *one), *parts = malloc((size_t)ALL * sizeof *parts);
    FREED uint32_t *numbers = malloc((size_t)ALL * sizeof *numbers);
    assert_true(at != NULL && one != NULL && parts != NULL && numbers != NULL);
    uint64_t count = 2;
    for (uint32_t i = 0; i < ALL; ++i) {
        /* the first batch in no order, the second in rows: each is looked at by itself */
        at[3 * i] = i < VSH_QUERY_BATCH ? between(&count, -2.5, 2.5) : -2.5 + 5.0 * (i % 200) / 200.0;
        at[3 * i + 1] = 0.3;
        at[3 * i + 2] =
            i < VSH_QUERY_BATCH ? between(&count, -2.5, 2.5) : -2.5 + 5.0 * (i / 200 % 200) / 200.0;
        numbers[i] = i;
    }
    float *const all[1] = {one};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = all;
    const vsh_points points = {ALL, at, NULL, NULL};
    assert_int_equal(vsh_query_points(query, &points, NULL, NULL, &output, NULL, NULL), VSH_OK);
    for (size_t first = 0; first < ALL; first += VSH_QUERY_BATCH) {
        float *const part[1] = {parts + first};
        output.visibility = part;
        const size_t left = ALL - first;
        const vsh_points some = {left < VSH_QUERY_BATCH ? left : VSH_QUERY_BATCH, at + 3 * first, NULL,
                                 numbers + first};
        assert_int_equal(vsh_query_points(query, &some, NULL, NULL, &output, NULL, NULL), VSH_OK);
    }
    size_t between_them = 0; /* whose rays depend on the points around them */
    for (size_t i = VSH_QUERY_BATCH; i < ALL; ++i) {
        between_them += one[i] > 0.0f && one[i] < 1.0f;
    }
    assert_true(between_them > 1000);
    assert_memory_equal(parts, one, (size_t)ALL * sizeof *one);
}

TEST(strides_that_are_none_are_refused_by_name) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .radius = 1.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&ball, 1}, 0.1, 1.0);
    OWNED(vsh_query) *query = query_of(field, NULL, VSH_SHADOW_CONE);
    const vsh_points good = {2, positions, normals, texels};
    const struct {
        vsh_point_layout layout;
        size_t stride; /* of the output */
        const char *word;
    } cases[] = {
        {{.position_stride = 3}, 0, "position_stride 3"},
        {{.position_stride = 28}, 0, "position_stride 28"},
        {{.normal_stride = 8}, 0, "normal_stride"},
        {{.texel_stride = 6}, 0, "texel_stride"},
        {{.float_positions = normals}, 0, "float_positions"},
        {{0}, 2, "stride 2"},
        {{0}, 8, ""}, /* too near for a gradient */
    };
    vsh_query_output output = vsh_query_output_default();
    output.distance = distance;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        vsh_point_layout layout = cases[i].layout;
        layout.struct_size = sizeof layout;
        output.stride = cases[i].stride;
        output.gradient = cases[i].stride == 8 ? gradient : NULL;
        assert_fails(vsh_query_points(query, &good, &layout, NULL, &output, NULL, &failure),
                     VSH_ERROR_ARGUMENT, cases[i].word);
    }
    output = vsh_query_output_default();
    output.distance = distance;
    vsh_point_layout layout = vsh_point_layout_default();
    const vsh_points nowhere = {2, NULL, normals, texels};
    assert_fails(vsh_query_points(query, &nowhere, &layout, NULL, &output, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "float_positions");
    layout.struct_size = 0;
    assert_fails(vsh_query_points(query, &good, &layout, NULL, &output, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "vsh_point_layout");
}
