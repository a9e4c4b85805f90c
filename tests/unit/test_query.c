/* Points asked for by a handle: the values of vsh_shade_shadow() and vsh_shade_ao(), whatever their order and
 * number. */
#include "previews.h"
#include "testing.h"
#include "traced.h"

#include <pthread.h>

/* MANY: enough to be put in order. */
enum { SIDE = 256, MANY = SIDE * SIDE, FEW = 1000, LIGHTS = 2 };

static double positions[3 * MANY], shuffled_positions[3 * MANY];
static float normals[3 * MANY], shuffled_normals[3 * MANY];
static uint32_t texels[MANY], from[MANY];
static float expected[MANY], expected_deviation[MANY];
static float values[LIGHTS + 1][MANY], deviations[LIGHTS + 1][MANY];

static vsh_light lights[LIGHTS];

static void shuffle(void) {
    for (size_t i = 0; i < MANY; ++i) {
        memcpy(shuffled_positions + 3 * i, positions + 3 * from[i], 3 * sizeof(double));
        memcpy(shuffled_normals + 3 * i, normals + 3 * from[i], 3 * sizeof(float));
    }
}

/* The seeds' floor, with texels that are not the points' numbers, and the same in no order. */
static int fill_points(void **state) {
    uint64_t counter = 3;
    lights[0] = sun(truth_seeds_sun, 0.2);
    lights[1] = lamp((const double[]){1.0, 1.5, 1.0}, 0.2);
    floor_texels(SIDE, positions, normals);
    for (uint32_t i = 0; i < MANY; ++i) {
        texels[i] = i * 3u + 7u;
        from[i] = i;
    }
    for (uint32_t i = MANY - 1; i > 0; --i) {
        const uint32_t j = (uint32_t)(uniform(&counter) * (i + 1.0)), kept = from[i];
        from[i] = from[j];
        from[j] = kept;
    }
    shuffle();
    return 0;
}

/* Shades `points` for all lights and AO, which is the last, into values and deviations. */
static vsh_shade_stats ask(const vsh_query *query, const vsh_points *points, int32_t threads) {
    float *const visibility[LIGHTS] = {values[0], values[1]};
    float *const deviation[LIGHTS] = {deviations[0], deviations[1]};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = visibility;
    output.shadow_error = deviation;
    output.ao = values[LIGHTS];
    output.ao_error = deviations[LIGHTS];
    vsh_run run = run_on(threads);
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_query_points(query, points, NULL, &run, &output, &stats, &failure));
    return stats;
}

/* Fills `expected` with the values of vsh_shade_…() for light l, or of AO. */
static void expect(const casting *c, const vsh_points *points, int l, const vsh_shade_options *options) {
    assert_ok(l < LIGHTS ? vsh_shade_shadow(occluders_of_caster(c), points, &lights[l], options, NULL,
                                            expected, expected_deviation, NULL, &failure)
                         : vsh_shade_ao(occluders_of_caster(c), points, options, NULL, expected,
                                        expected_deviation, NULL, NULL, &failure));
}

TEST(queries_give_the_values_and_deviations_of_shade_calls) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const int32_t methods = SHADOW_METHODS > AO_METHODS ? SHADOW_METHODS : AO_METHODS;
    for (int32_t method = 0; method < methods; ++method) {
        vsh_shade_options options = preview_options();
        options.method = method < SHADOW_METHODS ? method : VSH_SHADOW_CONE;
        options.ao_method = method < AO_METHODS ? method : VSH_AO_TAPS;
        options.rays = 16;
        OWNED(vsh_query) *query = query_of(occluders_of_caster(&c), lights, LIGHTS, &options);
        const size_t counts[] = {1, 2, 64, 65, FEW};
        for (size_t n = 0; n < COUNT_OF(counts); ++n) {
            const vsh_points points = {counts[n], positions + 3 * 9000, normals, texels};
            ask(query, &points, 2);
            for (int l = 0; l <= LIGHTS; ++l) {
                expect(&c, &points, l, &options);
                assert_memory_equal(expected, values[l], counts[n] * sizeof expected[0]);
                assert_memory_equal(expected_deviation, deviations[l], counts[n] * sizeof expected[0]);
            }
        }
    }
}

TEST(shuffled_points_keep_their_values_on_any_number_of_threads) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_CONE, VSH_SHADOW_RAYS};
    for (size_t m = 0; m < COUNT_OF(methods); ++m) {
        vsh_shade_options options = preview_options();
        options.method = methods[m];
        options.ao_method = m == 2 ? VSH_AO_RAYS : VSH_AO_TAPS;
        options.rays = 4;
        OWNED(vsh_query) *query = query_of(occluders_of(c.field), lights, LIGHTS, &options);
        static float in_order[LIGHTS + 1][MANY];
        const vsh_points points = {MANY, positions, normals, NULL};
        ask(query, &points, 2);
        memcpy(in_order, values, sizeof values);
        const vsh_points shuffled = {MANY, shuffled_positions, shuffled_normals, from}; /* as in order */
        for (int32_t threads = 1; threads <= 3; threads += 2) {
            memset(values, 0, sizeof values);
            ask(query, &shuffled, threads);
            for (int l = 0; l <= LIGHTS; ++l) {
                for (size_t i = 0; i < MANY; ++i) {
                    assert_int_equal(bits_of(values[l][i]), bits_of(in_order[l][from[i]]));
                }
            }
        }
    }
}

TEST(invalid_points_are_nan_and_change_no_others) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    const vsh_shade_options preview = preview_options(); /* rays of adaptive are shared with neighbours */
    OWNED(vsh_query) *query = query_of(occluders_of(field), lights, LIGHTS, &preview);
    static float before[LIGHTS + 1][MANY];
    const vsh_points all = {MANY, shuffled_positions, shuffled_normals, NULL};
    const size_t bad[] = {0, 31000, 31001, MANY - 1};
    ask(query, &all, 2);
    memcpy(before, values, sizeof values);
    shuffled_positions[3 * bad[0]] = (double)NAN;
    shuffled_positions[3 * bad[1] + 1] = (double)INFINITY;
    shuffled_normals[3 * bad[2] + 1] = 0.0f;
    shuffled_positions[3 * bad[3] + 2] = -(double)INFINITY;
    const vsh_shade_stats stats = ask(query, &all, 2);
    assert_int_equal(stats.invalid, (LIGHTS + 1) * COUNT_OF(bad));
    for (int l = 0; l <= LIGHTS; ++l) {
        size_t different = 0;
        for (size_t i = 0; i < MANY; ++i) {
            different += bits_of(values[l][i]) != bits_of(before[l][i]);
        }
        assert_int_equal(different, COUNT_OF(bad));
        for (size_t i = 0; i < COUNT_OF(bad); ++i) {
            assert_true(isnan(values[l][bad[i]]));
        }
    }
    shuffle();
}

TEST(outputs_that_are_not_requested_are_not_marched) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    OWNED(vsh_query) *query = query_of(occluders_of(field), lights, LIGHTS, NULL);
    const vsh_points points = {FEW, positions, normals, NULL};
    vsh_query_output output = vsh_query_output_default();
    vsh_shade_stats none = vsh_shade_stats_zero(), one = none, alone = none;
    assert_ok(vsh_query_points(query, &points, NULL, NULL, &output, &none, &failure));
    assert_true(none.marches == 0 && none.samples == 0 && none.skipped == 0);
    float *const second[LIGHTS] = {NULL, values[1]};
    output.visibility = second;
    assert_ok(vsh_query_points(query, &points, NULL, NULL, &output, &one, &failure));
    assert_ok(vsh_shade_shadow(occluders_of(field), &points, &lights[1], NULL, NULL, expected, NULL, &alone,
                               &failure));
    assert_memory_equal(&one, &alone, sizeof one);
    assert_memory_equal(expected, values[1], FEW * sizeof expected[0]);
    /* nor is anything of no points, which need no arrays */
    const vsh_points nothing = {0, NULL, NULL, NULL};
    assert_ok(vsh_query_points(query, &nothing, NULL, NULL, &output, &none, &failure));
    assert_int_equal(none.marches, 0);
}

typedef struct asker {
    const vsh_query *query;
    float value[500];
} asker;

static void *ask_alone(void *user) {
    asker *a = user;
    for (size_t i = 0; i < 500; ++i) {
        const vsh_points one = {1, positions + 3 * (i * 131), normals, NULL};
        float *const visibility[1] = {&a->value[i]};
        vsh_query_output output = vsh_query_output_default();
        output.visibility = visibility;
        if (vsh_query_points(a->query, &one, NULL, NULL, &output, NULL, NULL) != VSH_OK) {
            a->value[i] = -1.0f;
        }
    }
    return NULL;
}

TEST(a_handle_is_shared_by_threads) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_ADAPTIVE;
    OWNED(vsh_query) *query = query_of(occluders_of(field), &light, 1, &options);
    static asker askers[5];
    pthread_t threads[4];
    for (int i = 0; i < 5; ++i) {
        askers[i].query = query;
    }
    for (int i = 0; i < 4; ++i) {
        assert_int_equal(pthread_create(&threads[i], NULL, ask_alone, &askers[i]), 0);
    }
    ask_alone(&askers[4]);
    for (int i = 0; i < 4; ++i) {
        pthread_join(threads[i], NULL);
        assert_memory_equal(askers[i].value, askers[4].value, sizeof askers[4].value);
    }
}

TEST(the_memory_limit_is_held) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    OWNED(vsh_query) *query = query_of(occluders_of(field), lights, LIGHTS, NULL);
    float *const visibility[LIGHTS] = {values[0], NULL};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = visibility;
    const vsh_points shuffled = {MANY, shuffled_positions, shuffled_normals, NULL};
    const vsh_field_info info = field_info(field);
    vsh_run run = run_within(info.bytes + 16 * MANY - 4096);
    assert_fails(vsh_query_points(query, &shuffled, NULL, &run, &output, NULL, &failure), VSH_ERROR_LIMIT,
                 "query");
    run.memory_limit = info.bytes + 16 * MANY + 4096;
    assert_ok(vsh_query_points(query, &shuffled, NULL, &run, &output, NULL, &failure));
}

TEST(bad_arguments_are_refused_by_name) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.2, 1.0);
    vsh_query *query = NULL;
    const vsh_light none[LIGHTS] = {lights[0], lamp(truth_seeds_sun, -1.0)};
    vsh_shade_options traced = preview_options(), traced_ao = traced, rays = traced;
    traced.method = VSH_SHADOW_EXACT;
    traced_ao.ao_method = VSH_AO_EXACT;
    rays.rays = 4097;
    const struct {
        const vsh_light *lights;
        size_t count;
        const vsh_shade_options *options;
        const char *part;
    } cases[] = {{none, LIGHTS, NULL, "light 1"},
                 {lights, LIGHTS, &traced, "triangles"},
                 {NULL, 0, &traced_ao, "triangles"},
                 {NULL, 0, &rays, "rays"}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        assert_fails(vsh_query_create(occluders_of(field), cases[i].lights, cases[i].count, cases[i].options,
                                      &query, &failure),
                     VSH_ERROR_ARGUMENT, cases[i].part);
        assert_null(query);
    }
    vsh_query_free(query_of(occluders_of(field), NULL, 0, &traced)); /* of no light's shadow */

    OWNED(vsh_query) *good = query_of(occluders_of(field), lights, LIGHTS, NULL);
    const vsh_points bare = {FEW, positions, NULL, NULL};
    float *const deviation[LIGHTS] = {NULL, values[0]};
    vsh_query_output outputs[4];
    static const char *const parts[4] = {"normals", "ao_error", "light 1", ""};
    outputs[0] = outputs[1] = outputs[2] = outputs[3] = vsh_query_output_default();
    outputs[0].ao = values[0];
    outputs[1].ao_error = values[0];
    outputs[2].shadow_error = deviation;
    outputs[3].struct_size = 0;
    for (int i = 0; i < 4; ++i) {
        assert_fails(vsh_query_points(good, &bare, NULL, NULL, &outputs[i], NULL, &failure),
                     VSH_ERROR_ARGUMENT, parts[i]);
    }
}

/* --- strides, floats, answers with gaps; distance and gradient */

/* A vertex as engines store it in memory. */
typedef struct vertex {
    float position[3];
    uint8_t colour[4];
    float normal[3];
    uint32_t texel;
    double place[3];
    float visibility, deviation, ao, distance, gradient[3];
} vertex;

static vertex vertices[MANY];
static double places[3 * MANY];
static float ups[3 * MANY];
static uint32_t numbers[MANY];
static float visibility[MANY], errors[MANY], open[MANY], distance[MANY], gradient[3 * MANY];

/* Points all over the seeds' scene whose coordinates are floats, in no order. */
static void fill_vertices(void) {
    uint64_t count = 5;
    for (uint32_t i = 0; i < MANY; ++i) {
        double n[3];
        random_direction(&count, n);
        for (size_t axis = 0; axis < 3; ++axis) {
            vertices[i].position[axis] =
                (float)between(&count, axis == 1 ? 0.01 : -2.5, axis == 1 ? 2.0 : 2.5);
            ups[3 * i + axis] = vertices[i].normal[axis] = (float)n[axis];
        }
        numbers[i] = vertices[i].texel = 5u * i + 1u;
    }
    for (uint32_t i = 0; i < 3 * MANY; ++i) {
        const float *value = &vertices[i / 3].position[i % 3];
        places[i] = vertices[i / 3].place[i % 3] = (double)*value;
        assert_true((double)(float)places[i] == places[i]);
    }
}

static vsh_query_output packed_output(void) {
    static float *const shadow[1] = {visibility}, *const error[1] = {errors};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = shadow;
    output.shadow_error = error;
    output.ao = open;
    output.distance = distance;
    output.gradient = gradient;
    return output;
}

static void ask_packed(const vsh_query *query, size_t count, const double *at,
                       const vsh_query_output *output) {
    const bool all = output->ao != NULL; /* distances need neither ups nor numbers */
    const vsh_points points = {count, at, all ? ups : NULL, all ? numbers : NULL};
    assert_ok(vsh_query_points(query, &points, NULL, NULL, output, NULL, &failure));
}

TEST(strides_floats_and_gaps_give_the_bits_of_packed_arrays) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    fill_vertices();
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_RAYS;
    options.ao_method = VSH_AO_TAPS;
    options.rays = 8;
    OWNED(vsh_query) *query = query_of(occluders_of(field), &light, 1, &options);
    const size_t counts[] = {1, 64, 65, 1000, MANY};
    for (size_t n = 0; n < COUNT_OF(counts); ++n) {
        const size_t count = counts[n];
        const vsh_query_output packed = packed_output();
        ask_packed(query, count, places, &packed);
        for (int floats = 0; floats < 2; ++floats) {
            for (size_t i = 0; i < count; ++i) {
                memset(&vertices[i].visibility, 0xff, 7 * sizeof(float)); /* the answers: NaN */
            }
            const vsh_points points = {count, floats ? NULL : vertices[0].place, vertices[0].normal,
                                       &vertices[0].texel};
            vsh_point_layout layout = vsh_point_layout_default();
            layout.float_positions = floats ? vertices[0].position : NULL;
            layout.position_stride = layout.normal_stride = layout.texel_stride = sizeof vertices[0];
            float *const shadow[1] = {&vertices[0].visibility}, *const error[1] = {&vertices[0].deviation};
            vsh_query_output output = vsh_query_output_default();
            output.visibility = shadow;
            output.shadow_error = error;
            output.ao = &vertices[0].ao;
            output.distance = &vertices[0].distance;
            output.gradient = vertices[0].gradient;
            output.stride = sizeof vertices[0];
            assert_ok(vsh_query_points(query, &points, &layout, NULL, &output, NULL, &failure));
            for (size_t i = 0; i < count; ++i) {
                assert_int_equal(bits_of(vertices[i].visibility), bits_of(visibility[i]));
                /* of rays in an order, deviations depend on it; it is the same one */
                assert_int_equal(bits_of(vertices[i].deviation), bits_of(errors[i]));
                assert_int_equal(bits_of(vertices[i].ao), bits_of(open[i]));
                assert_int_equal(bits_of(vertices[i].distance), bits_of(distance[i]));
                assert_memory_equal(vertices[i].gradient, gradient + 3 * i, 3 * sizeof(float));
                assert_true(vertices[i].place[0] == places[3 * i]);
            }
        }
    }
    /* and without gaps, by strides of 0, at places that are packed */
    const vsh_points points = {1000, places, ups, numbers};
    const vsh_point_layout layout = vsh_point_layout_default();
    const vsh_query_output packed = packed_output();
    static float kept[1000];
    vsh_field_sample(field, 1000, places, kept);
    assert_memory_equal(kept, distance, sizeof kept);
    ask_packed(query, 1000, places, &packed);
    memcpy(kept, visibility, sizeof kept);
    memset(visibility, 0, sizeof kept);
    assert_ok(vsh_query_points(query, &points, &layout, NULL, &packed, NULL, &failure));
    assert_memory_equal(kept, visibility, sizeof kept);
}

TEST(gradients_are_unit_and_point_away_from_the_sphere) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .center = {0.3, -0.2, 0.1}, .radius = 1.0};
    const truth_scene scene = {&ball, 1};
    const double voxel = 0.05;
    OWNED(vsh_field) *field = field_of(scene, voxel, 0.0);
    OWNED(vsh_query) *query = query_of(occluders_of(field), NULL, 0, NULL);
    enum { COUNT = 5000 };
    uint64_t count = 9;
    for (size_t i = 0; i < COUNT; ++i) {
        double away[3];
        random_direction(&count, away);
        const double radius = between(&count, 0.9, 12.0);
        go_along(ball.center, radius, away, places + 3 * i);
    }
    vsh_query_output output = vsh_query_output_default();
    output.gradient = gradient;
    ask_packed(query, COUNT, places, &output);
    double worst_near = 1.0, worst = 1.0;
    for (size_t i = 0; i < COUNT; ++i) {
        const float *at = gradient + 3 * i;
        const double g[3] = {(double)at[0], (double)at[1], (double)at[2]};
        double off[3];
        go_along(places + 3 * i, -1.0, ball.center, off);
        const double radius = length3(off), cosine = dot3(g, off) / radius;
        assert_true(fabs(dot3(g, g) - 1.0) < 1e-6);
        worst = fmin(worst, cosine);
        worst_near = fabs(radius - 1.0) < 2.0 * voxel ? fmin(worst_near, cosine) : worst_near;
    }
    /* A trilinear cell's gradient turns by up to half of its diagonal over the distance to the centre: 0.87 ×
     * 0.05, or 2.5°. At the end of the reach corners of cells are clamped. */
    assert_that(worst_near > cos(RADIANS(2.5)) && worst > cos(RADIANS(8.0)), "off by %g and %g degrees",
                acos(worst_near) / RADIANS(1.0), acos(worst) / RADIANS(1.0));
}

TEST(gradients_are_zero_beyond_the_reach_and_nan_at_invalid_points) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .radius = 1.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&ball, 1}, 0.05, 1.0);
    OWNED(vsh_query) *query = query_of(occluders_of(field), NULL, 0, NULL);
    const double spots[4][3] = {
        {1e6, 0.0, 0.0}, {(double)NAN, 0.0, 0.0}, {0.0, (double)INFINITY, 0.0}, {1.1, 0.0, 0.0}};
    vsh_query_output output = vsh_query_output_default();
    output.gradient = gradient;
    output.distance = distance;
    ask_packed(query, 4, spots[0], &output);
    assert_true(gradient[0] == 0.0f && gradient[1] == 0.0f && gradient[2] == 0.0f);
    assert_true(distance[0] > 0.0f);
    for (size_t i = 3; i < 9; ++i) {
        assert_true(isnan(gradient[i]));
    }
    assert_true(isnan(distance[1]) && isnan(distance[2]));
    assert_true(gradient[9] > 0.99f);
}

TEST(bad_strides_are_refused_by_name) {
    const truth_solid ball = {.shape = TRUTH_SPHERE, .radius = 1.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&ball, 1}, 0.1, 1.0);
    OWNED(vsh_query) *query = query_of(occluders_of(field), NULL, 0, NULL);
    const vsh_points good = {2, places, ups, numbers};
    const struct {
        vsh_point_layout layout;
        size_t stride; /* of the output */
        const char *word;
    } cases[] = {
        {{.position_stride = 3}, 0, "position_stride 3"},
        {{.position_stride = 28}, 0, "position_stride 28"},
        {{.normal_stride = 8}, 0, "normal_stride"},
        {{.texel_stride = 6}, 0, "texel_stride"},
        {{.float_positions = ups}, 0, "float_positions"},
        {{0}, 2, "stride 2"},
        {{0}, 8, ""}, /* too near for a gradient */
    };
    vsh_query_output output = vsh_query_output_default();
    output.distance = distance;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
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
    layout.struct_size = 0;
    assert_fails(vsh_query_points(query, &good, &layout, NULL, &output, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "vsh_point_layout");
}

FIXTURE(fill_points, NULL)
