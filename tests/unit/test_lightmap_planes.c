/* How a lightmap is baked: its planes, their errors, threads, options, limits. */
#include "lightmaps.h"
#include "previews.h"

static void irradiance_is_visibility_times_colour_times_cosine_times_ao(void **state) {
    (void)state;
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 0);
    vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    light.color[0] = 2.0;
    light.color[1] = 0.5;
    light.color[2] = 0.0;
    planes *p = new_planes();
    bake(field, texels, &light, &p->all, NULL, 0);
    for (size_t i = 0; i < TEXELS; ++i) {
        const double expected = (double)p->shadow[i] * sqrt(0.5) * (double)p->ao[i];
        assert_true(fabs((double)p->irradiance[3 * i] - 2.0 * expected) < 1e-5);
        assert_true(fabs((double)p->irradiance[3 * i + 1] - 0.5 * expected) < 1e-5);
        assert_true(p->irradiance[3 * i + 2] == 0.0f);
    }
    planes *alone = new_planes();
    alone->all = (vsh_lightmap){.irradiance = alone->irradiance};
    bake(field, texels, &light, &alone->all, NULL, 0);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(fabs((double)alone->irradiance[3 * i] - 2.0 * sqrt(0.5) * (double)p->shadow[i]) < 1e-5);
    }
    free(alone);
    free(p);
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static void planes_that_are_not_asked_for_cost_nothing_and_change_nothing(void **state) {
    (void)state;
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 2);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *all = new_planes(), *some = new_planes();
    bake(field, texels, &light, &all->all, NULL, 0);

    vsh_bake_stats stats = vsh_bake_stats_zero();
    const vsh_lightmap coverage = {.coverage = some->coverage};
    bake(field, texels, &light, &coverage, &stats, 0);
    assert_int_equal(stats.shade.marches, 0);
    assert_int_equal(stats.shade.samples, 0);
    assert_memory_equal(some->coverage, all->coverage, sizeof all->coverage);

    const vsh_lightmap ao = {.ao = some->ao};
    bake(field, texels, NULL, &ao, NULL, 0);
    assert_memory_equal(some->ao, all->ao, sizeof all->ao);
    const vsh_lightmap shadow = {.shadow = some->lights};
    bake(field, texels, &light, &shadow, NULL, 0);
    assert_memory_equal(some->shadow, all->shadow, sizeof all->shadow);
    free(some);
    free(all);
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static void any_number_of_threads_gives_the_same_bits(void **state) {
    (void)state;
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 3, 4);
    const vsh_light light = sun(1.0, 0.7, 0.3, 0.2);
    planes *p[3];
    const int32_t threads[3] = {1, 2, 5};
    for (int t = 0; t < 3; ++t) {
        p[t] = new_planes();
        bake(field, texels, &light, &p[t]->all, NULL, threads[t]);
        assert_memory_equal(p[t]->shadow, p[0]->shadow, sizeof p[0]->shadow);
        assert_memory_equal(p[t]->ao, p[0]->ao, sizeof p[0]->ao);
        assert_memory_equal(p[t]->irradiance, p[0]->irradiance, sizeof p[0]->irradiance);
        assert_memory_equal(p[t]->coverage, p[0]->coverage, sizeof p[0]->coverage);
    }
    for (int t = 0; t < 3; ++t) {
        free(p[t]);
    }
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static int32_t stop_in_shadow(void *user, const char *stage, double fraction) {
    (void)user;
    return strcmp(stage, "shadow.sun") == 0 && fraction > 0.0;
}

static void bad_options_limits_and_cancelling_are_reported(void **state) {
    (void)state;
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 0);
    vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *p = new_planes();
    vsh_error error = {0};
    vsh_shade_options options = preview_options();
    options.start_offset = NAN;
    assert_int_equal(
        vsh_bake_lightmap(occluders_of(field), texels, &light, 1, &options, NULL, &p->all, NULL, &error),
        VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "start_offset"));
    options = preview_options();
    options.surface_offset = -1.0;
    assert_int_equal(
        vsh_bake_lightmap(occluders_of(field), texels, &light, 1, &options, NULL, &p->all, NULL, &error),
        VSH_ERROR_ARGUMENT);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000;
    assert_int_equal(
        vsh_bake_lightmap(occluders_of(field), texels, &light, 1, NULL, &run, &p->all, NULL, &error),
        VSH_ERROR_LIMIT);
    run = vsh_run_default();
    run.progress = stop_in_shadow;
    assert_int_equal(
        vsh_bake_lightmap(occluders_of(field), texels, &light, 1, NULL, &run, &p->all, NULL, &error),
        VSH_ERROR_CANCELLED);
    light.angle = -1.0;
    assert_int_equal(
        vsh_bake_lightmap(occluders_of(field), texels, &light, 1, NULL, NULL, &p->all, NULL, &error),
        VSH_ERROR_ARGUMENT);
    free(p);
    vsh_texels_free(texels);
    vsh_field_free(field);
}

/* Bakes the floor under a wall by `method` into planes of values and errors. */
static vsh_bake_stats bake_errors(int32_t method, float *shadow, float *shadow_error, float *ao_error) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 2, 4);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.5);
    vsh_shade_options shade = preview_options();
    shade.method = method;
    float *shadows[1] = {shadow}, *errors[1] = {shadow_error};
    const vsh_lightmap lightmap = {
        .shadow = shadow != NULL ? shadows : NULL, .shadow_error = errors, .ao_error = ao_error};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    vsh_error error = {0};
    if (vsh_bake_lightmap(occluders_of(field), texels, &light, 1, &shade, NULL, &lightmap, &stats, &error) !=
        VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_texels_free(texels);
    vsh_field_free(field);
    return stats;
}

static void errors_are_baked_where_the_method_knows_them(void **state) {
    (void)state;
    static float shadow[TEXELS], errors[TEXELS], alone[TEXELS], ao[TEXELS];
    const vsh_bake_stats stats = bake_errors(VSH_SHADOW_ADAPTIVE, shadow, errors, ao);
    size_t some = 0, none = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        /* a mean of standard errors, none of which passes what was asked for by more than its last round */
        assert_true(errors[i] >= 0.0f && errors[i] <= 0.05f);
        assert_true(ao[i] == 0.0f); /* cones know nothing of it */
        some += errors[i] > 0.0f;
        none += errors[i] == 0.0f;
    }
    assert_true(some > TEXELS / 50 && none > TEXELS / 2);
    assert_true(stats.shade.refined > 0 && stats.shade.square_error > 0.0);
    bake_errors(VSH_SHADOW_ADAPTIVE, NULL, alone, NULL); /* without the values */
    assert_memory_equal(errors, alone, sizeof errors);
    bake_errors(VSH_SHADOW_CONE, shadow, errors, NULL);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(errors[i] == 0.0f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_are_baked_where_the_method_knows_them),
        cmocka_unit_test(irradiance_is_visibility_times_colour_times_cosine_times_ao),
        cmocka_unit_test(planes_that_are_not_asked_for_cost_nothing_and_change_nothing),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
        cmocka_unit_test(bad_options_limits_and_cancelling_are_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
