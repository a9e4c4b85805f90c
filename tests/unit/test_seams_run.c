/* vsh_lightmap_stitch() as every call: threads, memory, cancelling, options, which planes it changes, what it
 * tells. */
#include "seams.h"

static vsh_result stitch_noise(const charts_mesh *m, const vsh_run *run, float *ao, float *light,
                               vsh_error *error) {
    uint32_t seed = 11;
    for (size_t i = 0; i < TEXELS; ++i) {
        ao[i] = random_value(&seed);
        for (size_t c = 0; c < 3; ++c) {
            light[3 * i + c] = random_value(&seed);
        }
    }
    vsh_charts *charts = charts_of(&m->mesh, 1);
    const vsh_lightmap map = {.ao = ao, .irradiance = light};
    const vsh_result result = vsh_lightmap_stitch(charts, &map, 0, NULL, run, NULL, error);
    vsh_charts_free(charts);
    return result;
}

static void any_number_of_threads_gives_the_same_bits(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao[2] = {new_plane(0.0f), new_plane(0.0f)}, *light[2];
    for (int32_t threads = 1; threads <= 8; ++threads) {
        const int own = threads > 1;
        vsh_run run = vsh_run_default();
        run.threads = threads;
        light[own] = threads <= 2 ? malloc(3 * TEXELS * sizeof **light) : light[own];
        assert_int_equal(stitch_noise(m, &run, ao[own], light[own], NULL), VSH_OK);
        assert_memory_equal(ao[own], ao[0], TEXELS * sizeof **ao);
        assert_memory_equal(light[own], light[0], 3 * TEXELS * sizeof **light);
    }
    for (int i = 0; i < 2; ++i) {
        free(light[i]);
        free(ao[i]);
    }
    free(m);
}

static void the_memory_limit_is_held_before_anything_moves(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light), *before = new_plane(0.0f);
    float *other = malloc(3 * TEXELS * sizeof *other);
    vsh_error error = {0};
    vsh_run run = vsh_run_default();
    run.threads = 1;
    uint64_t refused = 0, most = 0;
    for (run.memory_limit = 64; most == 0; run.memory_limit *= 2) {
        const vsh_result result = stitch_noise(m, &run, ao, light, &error);
        most = result == VSH_OK ? run.memory_limit : 0;
        assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT);
        refused += result == VSH_ERROR_LIMIT;
        uint32_t seed = 11;
        for (size_t i = 0; result != VSH_OK && i < TEXELS; ++i) {
            assert_true(ao[i] == random_value(&seed));
            for (size_t c = 0; c < 3; ++c) {
                assert_true(light[3 * i + c] == random_value(&seed));
            }
        }
    }
    vsh_run four = vsh_run_default();
    four.threads = 4;
    for (four.memory_limit = most / 2; stitch_noise(m, &four, ao, light, &error) != VSH_OK;) {
        four.memory_limit += most / 64; /* vectors of four channels are larger than all else */
    }
    assert_true(four.memory_limit > most + most / 4);
    assert_true(refused > 4 && most < 1000000); /* charts, marks, unknowns, vectors: each is looked at */
    assert_non_null(strstr(error.message, "seams"));
    charts_mesh *many = new_mesh(); /* what edges are found by is most where there are no seams */
    for (int i = 0; i < MOST_VERTICES / 4; ++i) {
        add_square(many, 2.0 * i, (const double[]){1.0 + 3.5 * (i % 16), 4.0 + 3.5 * (i / 16)}, 2.5, 0.0,
                   1.0);
    }
    run.memory_limit = 20000;
    assert_int_equal(stitch_noise(many, &run, before, other, &error), VSH_ERROR_LIMIT);
    free(many);
    run.memory_limit = most;
    run.memory_held = most;
    assert_int_equal(stitch_noise(m, &run, before, other, &error), VSH_ERROR_LIMIT);
    free(other);
    free(before);
    free(light);
    free(ao);
    free(m);
}

typedef struct stopping {
    double at;
    double last;
    int calls;
} stopping;

static int stop_at(void *user, const char *stage, double fraction) {
    stopping *s = user;
    assert_string_equal(stage, "seams");
    assert_true(fraction >= s->last && fraction <= 1.0);
    s->last = fraction;
    ++s->calls;
    return fraction >= s->at;
}

/* The same differences, as AO and as light. */
static void differences_of_light_are_told_in_parts_of_the_brightest(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light);
    for (size_t i = 0; i < TEXELS; ++i) {
        ao[i] = is_first(i) ? 0.98f : 1.0f;
        light[3 * i] = light[3 * i + 1] = light[3 * i + 2] = 50.0f * ao[i];
    }
    const vsh_lightmap dim = {.ao = ao}, bright = {.irradiance = light};
    const vsh_stitch_report of_ao = stitch(&m->mesh, 1, &dim, 0, 0.02);
    const vsh_stitch_report of_light = stitch(&m->mesh, 1, &bright, 0, 0.02);
    assert_true(fabs(of_ao.before - 0.02) < 1e-6 && fabs(of_light.before - 0.02) < 1e-6);
    assert_true(of_ao.after < 0.0004 && of_light.after < 0.0004);
    assert_true(of_light.places == of_ao.places && of_light.texels == of_ao.texels);
    free(light);
    free(ao);
    free(m);
}

static void it_is_cancelled_wherever_it_is_and_tells_how_far_it_is(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.0f), *light = malloc(3 * TEXELS * sizeof *light);
    const double at[] = {0.0, 0.2, 0.5, 2.0};
    for (size_t i = 0; i < sizeof at / sizeof at[0]; ++i) {
        stopping s = {at[i], 0.0, 0};
        vsh_error error = {0};
        vsh_run run = vsh_run_default();
        run.threads = 1;
        run.progress = stop_at;
        run.user = &s;
        const vsh_result result = stitch_noise(m, &run, ao, light, &error);
        assert_int_equal(result, at[i] > 1.0 ? VSH_OK : VSH_ERROR_CANCELLED);
        assert_true(s.calls > 0 && (at[i] < 1.0 || s.last == 1.0));
    }
    free(light);
    free(ao);
    free(m);
}

static void options_out_of_range_are_refused(void **state) {
    (void)state;
    charts_mesh *m = two_squares(0.0, 1.0);
    vsh_charts *charts = charts_of(&m->mesh, 1);
    float *ao = new_plane(0.5f);
    const vsh_lightmap map = {.ao = ao};
    for (int i = 0; i < 8; ++i) {
        vsh_stitch_options options = vsh_stitch_options_default();
        double *const members[] = {&options.max_change, &options.max_angle, &options.keep,
                                   &options.max_change};
        const double values[] = {-1e-9, -1.0, 0.0, 1.001, NAN, 181.0, 1.5, INFINITY};
        vsh_error error = {0};
        *members[i % 4] = values[i];
        assert_int_equal(vsh_lightmap_stitch(charts, &map, 0, &options, NULL, NULL, &error),
                         VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "vsh_stitch_options."));
    }
    free(ao);
    vsh_charts_free(charts);
    free(m);
}

static void what_is_no_value_of_light_is_left(void **state) {
    (void)state;
    charts_mesh *m = two_squares(37.0, 1.0);
    float *ao = new_plane(0.5f), *bent = malloc(3 * TEXELS * sizeof *bent), *error = new_plane(0.0f);
    float *invalid = new_plane(0.0f), *coverage = new_plane(1.0f), *shadow = new_plane(0.0f),
          *tint = malloc(3 * TEXELS * sizeof *tint);
    float *copy = malloc(3 * TEXELS * sizeof *copy);
    uint32_t seed = 3;
    for (size_t i = 0; i < TEXELS; ++i) {
        error[i] = shadow[i] = random_value(&seed);
        invalid[i] = error[i] < 0.5f ? 0.0f : 1.0f;
        ao[i] = is_first(i) ? 0.5f : NAN; /* of which nothing is known */
        for (size_t c = 0; c < 3; ++c) {
            bent[3 * i + c] = tint[3 * i + c] = random_value(&seed);
        }
    }
    memcpy(copy, bent, 3 * TEXELS * sizeof *bent);
    float *const shadows[] = {shadow, NULL}, *const errors[] = {error, error}, *const tints[] = {NULL, tint};
    const vsh_lightmap map = {.shadow = shadows,
                              .ao = ao,
                              .bent = bent,
                              .shadow_error = errors,
                              .ao_error = error,
                              .tint = tints,
                              .invalid = invalid,
                              .coverage = coverage};
    const vsh_stitch_report report = stitch(&m->mesh, 1, &map, 2, 0.02);
    assert_true(report.after < report.before);
    assert_memory_equal(bent, copy, 3 * TEXELS * sizeof *bent);
    assert_memory_not_equal(tint, copy, 3 * TEXELS * sizeof *tint);
    seed = 3;
    size_t moved = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const float first = random_value(&seed);
        assert_true(error[i] == first && invalid[i] == (first < 0.5f ? 0.0f : 1.0f) && coverage[i] == 1.0f);
        assert_true(is_first(i) ? ao[i] == 0.5f : isnan(ao[i]) != 0);
        moved += shadow[i] != first;
        for (size_t c = 0; c < 3; ++c) {
            random_value(&seed);
        }
    }
    assert_true(moved > 20);
    free(copy);
    free(tint);
    free(shadow);
    free(coverage);
    free(invalid);
    free(error);
    free(bent);
    free(ao);
    free(m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
        cmocka_unit_test(the_memory_limit_is_held_before_anything_moves),
        cmocka_unit_test(differences_of_light_are_told_in_parts_of_the_brightest),
        cmocka_unit_test(what_is_no_value_of_light_is_left),
        cmocka_unit_test(it_is_cancelled_wherever_it_is_and_tells_how_far_it_is),
        cmocka_unit_test(options_out_of_range_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
