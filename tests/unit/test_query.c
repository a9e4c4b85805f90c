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

static vsh_query *query_of(const vsh_occluders *occluders, const vsh_light *given, size_t count,
                           const vsh_shade_options *options) {
    vsh_query *query = NULL;
    assert_ok(vsh_query_create(occluders, given, count, options, &query, &failure));
    return query;
}

/* Everything of `points`, into values and deviations; AO is the last. */
static vsh_shade_stats ask(const vsh_query *query, const vsh_points *points, int32_t threads) {
    float *const visibility[LIGHTS] = {values[0], values[1]};
    float *const deviation[LIGHTS] = {deviations[0], deviations[1]};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = visibility;
    output.deviation = deviation;
    output.ao = values[LIGHTS];
    output.ao_deviation = deviations[LIGHTS];
    vsh_run run = run_on(threads);
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_query_points(query, points, NULL, &run, &output, &stats, &failure));
    return stats;
}

/* What vsh_shade_…() give for light l, or AO. */
static void expect(const casting *c, const vsh_points *points, int l, const vsh_shade_options *options) {
    assert_ok(l < LIGHTS ? vsh_shade_shadow(occluders_of_caster(c), points, &lights[l], options, NULL,
                                            expected, expected_deviation, NULL, &failure)
                         : vsh_shade_ao(occluders_of_caster(c), points, options, NULL, expected,
                                        expected_deviation, NULL, NULL, &failure));
}

TEST(values_and_deviations_are_those_of_the_shade_calls) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const int32_t methods = SHADOW_METHODS > AO_METHODS ? SHADOW_METHODS : AO_METHODS;
    for (int32_t method = 0; method < methods; ++method) {
        vsh_shade_options options = preview_options();
        options.method = method < SHADOW_METHODS ? method : VSH_SHADOW_CONE;
        options.ao_method = method < AO_METHODS ? method : VSH_AO_TAPS;
        options.rays = 16;
        OWNED(vsh_query) *query = query_of(occluders_of_caster(&c), lights, LIGHTS, &options);
        const size_t counts[] = {1, 2, 64, 65, FEW};
        for (size_t n = 0; n < sizeof counts / sizeof counts[0]; ++n) {
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

TEST(values_follow_points_that_are_shuffled_on_any_number_of_threads) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_CONE, VSH_SHADOW_RAYS};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; ++m) {
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

TEST(points_that_are_invalid_are_nan_and_leave_the_others_alone) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    const vsh_shade_options preview = preview_options(); /* rays of adaptive are shared with neighbours */
    OWNED(vsh_query) *query = query_of(occluders_of(field), lights, LIGHTS, &preview);
    static float before[LIGHTS + 1][MANY];
    const vsh_points all = {MANY, shuffled_positions, shuffled_normals, NULL};
    const size_t bad[] = {0, 31000, 31001, MANY - 1};
    const size_t counts[] = {60, MANY};
    for (int n = 0; n < 2; ++n) {
        shuffle();
        vsh_points points = all;
        points.count = counts[n];
        ask(query, &points, 2);
        memcpy(before, values, sizeof values);
        shuffled_positions[3 * bad[0]] = (double)NAN;
        shuffled_positions[3 * bad[1] + 1] = (double)INFINITY;
        shuffled_normals[3 * bad[2] + 1] = 0.0f;
        shuffled_positions[3 * bad[3] + 2] = -(double)INFINITY;
        const vsh_shade_stats stats = ask(query, &points, 2);
        const size_t expected_bad = n == 0 ? 1 : 4;
        assert_int_equal(stats.invalid, (LIGHTS + 1) * expected_bad);
        for (int l = 0; l <= LIGHTS; ++l) {
            size_t different = 0;
            for (size_t i = 0; i < points.count; ++i) {
                different += bits_of(values[l][i]) != bits_of(before[l][i]);
            }
            for (size_t i = 0; i < expected_bad; ++i) {
                assert_true(isnan(values[l][bad[i]]));
            }
            assert_true(different <= expected_bad);
        }
    }
    shuffle();
}

TEST(one_point_has_the_value_that_it_has_among_many) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_CLASSIC, VSH_SHADOW_IMPROVED, VSH_SHADOW_CONE,
                               VSH_SHADOW_RAYS};
    for (size_t m = 0; m < sizeof methods / sizeof methods[0]; ++m) {
        vsh_shade_options options = preview_options();
        options.method = methods[m];
        options.rays = 8;
        OWNED(vsh_query) *query = query_of(occluders_of(field), lights, LIGHTS, &options);
        const vsh_points points = {MANY, positions, normals, texels};
        static float among[LIGHTS + 1][MANY];
        ask(query, &points, 2);
        memcpy(among, values, sizeof values);
        for (size_t i = 0; i < MANY; i += 97) {
            const vsh_points one = {1, positions + 3 * i, normals + 3 * i, texels + i};
            ask(query, &one, 1);
            for (int l = 0; l <= LIGHTS; ++l) {
                assert_int_equal(bits_of(values[l][0]), bits_of(among[l][i]));
            }
        }
    }
}

TEST(what_is_not_asked_for_is_not_marched) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    OWNED(vsh_query) *query = query_of(occluders_of(field), lights, LIGHTS, NULL);
    const vsh_points points = {FEW, positions, normals, NULL};
    vsh_query_output output = vsh_query_output_default();
    vsh_shade_stats none = vsh_shade_stats_zero(), one = none, alone = none;
    assert_int_equal(vsh_query_points(query, &points, NULL, NULL, &output, &none, NULL), VSH_OK);
    assert_true(none.marches == 0 && none.samples == 0 && none.skipped == 0);
    float *const second[LIGHTS] = {NULL, values[1]};
    output.visibility = second;
    assert_int_equal(vsh_query_points(query, &points, NULL, NULL, &output, &one, NULL), VSH_OK);
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &lights[1], NULL, NULL, expected, NULL, &alone, NULL),
        VSH_OK);
    assert_memory_equal(&one, &alone, sizeof one);
    assert_memory_equal(expected, values[1], FEW * sizeof expected[0]);
    /* nor is anything of no points, which need no arrays */
    const vsh_points nothing = {0, NULL, NULL, NULL};
    assert_int_equal(vsh_query_points(query, &nothing, NULL, NULL, &output, &none, NULL), VSH_OK);
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
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    vsh_run run = run_within(info.bytes + 16 * MANY - 4096);
    assert_fails(vsh_query_points(query, &shuffled, NULL, &run, &output, NULL, &failure), VSH_ERROR_LIMIT,
                 "query");
    run.memory_limit = info.bytes + 16 * MANY + 4096;
    assert_ok(vsh_query_points(query, &shuffled, NULL, &run, &output, NULL, &failure));
}

TEST(bad_arguments_are_refused_by_name) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.2, 1.0);
    OWNED(vsh_query) *query = NULL;
    const vsh_light none[LIGHTS] = {lights[0], lamp(truth_seeds_sun, -1.0)};
    assert_fails(vsh_query_create(occluders_of(field), none, LIGHTS, NULL, &query, &failure),
                 VSH_ERROR_ARGUMENT, "light 1");
    assert_null(query);
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_EXACT;
    assert_fails(vsh_query_create(occluders_of(field), lights, LIGHTS, &options, &query, &failure),
                 VSH_ERROR_ARGUMENT, "triangles");
    vsh_query_free(query_of(occluders_of(field), NULL, 0, &options)); /* of no light's shadow */
    options.ao_method = VSH_AO_EXACT;
    assert_fails(vsh_query_create(occluders_of(field), NULL, 0, &options, &query, &failure),
                 VSH_ERROR_ARGUMENT, "");
    options = preview_options();
    options.rays = 4097;
    assert_fails(vsh_query_create(occluders_of(field), NULL, 0, &options, &query, &failure),
                 VSH_ERROR_ARGUMENT, "rays");

    query = query_of(occluders_of(field), lights, LIGHTS, NULL);
    const vsh_points bare = {FEW, positions, NULL, NULL};
    vsh_query_output output = vsh_query_output_default();
    output.ao = values[0];
    assert_fails(vsh_query_points(query, &bare, NULL, NULL, &output, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "normals");
    output.ao = NULL;
    output.ao_deviation = values[0];
    assert_fails(vsh_query_points(query, &bare, NULL, NULL, &output, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "ao_deviation");
    float *const deviation[LIGHTS] = {NULL, values[0]};
    output = vsh_query_output_default();
    output.deviation = deviation;
    assert_fails(vsh_query_points(query, &bare, NULL, NULL, &output, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "light 1");
    output = vsh_query_output_default();
    output.struct_size = 0;
    assert_fails(vsh_query_points(query, &bare, NULL, NULL, &output, NULL, &failure), VSH_ERROR_ARGUMENT, "");
}

FIXTURE(fill_points, NULL)
