/* What a lightmap holds: a wall that stands on a floor, a coarse smooth sphere, an open sheet. */
#include "expect.h"
#include "lightmaps.h"
#include "previews.h"

static void a_floor_under_open_sky_is_exactly_lit(void **state) {
    vsh_field *field = floor_field(0);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(0.3, 1.0, 0.2, 0.2);
    planes *p = new_planes();
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake(field, charts, &light, &p->all, &stats, 0);
    for (int i = 0; i < TEXELS; ++i) {
        assert_true(p->shadow[i] == 1.0f);
        assert_true(p->coverage[i] == 1.0f);
    }
    assert_int_equal(stats.texels, TEXELS);
    assert_int_equal(stats.invalid_texels, 0);
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static void texels_under_a_wall_are_invalid_and_nothing_leaks_on_either_side(void **state) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *p = new_planes();
    uint64_t invalid_by_mesh[1] = {77};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    stats.invalid_by_mesh = invalid_by_mesh;
    bake(field, charts, &light, &p->all, &stats, 0);
    uint64_t invalid = 0;
    for (uint32_t i = 0; i < TEXELS; ++i) {
        const double x = texel_x(i);
        invalid += p->coverage[i] == 0.0f;
        if (fabs(x) < WALL - VOXEL) {
            assert_true(p->coverage[i] == 0.0f);
        } else if (fabs(x) > WALL + VOXEL) {
            assert_true(p->coverage[i] == 1.0f);
        }
        /* The shadow of a wall of height 1 at 45° ends beyond the floor's edge. */
        if (x < -WALL) {
            assert_true(p->shadow[i] < 0.01f);
        } else if (x > WALL + VOXEL) {
            assert_true(p->shadow[i] > 0.99f);
        }
    }
    assert_int_equal(invalid, stats.invalid_texels);
    assert_int_equal(invalid, invalid_by_mesh[0]);
    assert_int_equal(stats.texels, TEXELS);
    /* Invalid texels take the value of the nearest valid one, dark or lit. */
    for (uint32_t i = 0; i < TEXELS; ++i) {
        const double x = texel_x(i);
        if (fabs(x) < WALL - VOXEL && fabs(x) > WALL - 6.0 * 2.0 / SIZE) {
            assert_true(x < 0.0 ? p->shadow[i] < 0.01f : p->shadow[i] > 0.9f);
        }
    }
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static void padding_copies_dark_and_lit_texels_and_leaves_coverage(void **state) {
    enum { PADDING = 3 };
    vsh_field *field = floor_field(1);
    /* The part x < -0.5 of the floor, all of it in shadow, and a chart around it. */
    const float positions[12] = {-1, 0, 1, -0.5f, 0, 1, -0.5f, 0, -1, -1, 0, -1};
    const float uvs[8] = {0.25f, 0.25f, 0.75f, 0.25f, 0.75f, 0.75f, 0.25f, 0.75f};
    vsh_mesh mesh = floor_mesh();
    mesh.positions = positions;
    mesh.uvs = uvs;
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, PADDING);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *p = new_planes();
    bake(field, charts, &light, &p->all, NULL, 0);
    for (int i = 0; i < TEXELS; ++i) {
        const int x = i % SIZE, y = i / SIZE;
        const int dx = x < 16 ? 16 - x : x > 47 ? x - 47 : 0, dy = y < 16 ? 16 - y : y > 47 ? y - 47 : 0;
        const int inside = dx == 0 && dy == 0;
        assert_true(p->coverage[i] == (inside ? 1.0f : 0.0f));
        if (dx * dx + dy * dy > PADDING * PADDING) {
            assert_true(p->ao[i] == 0.0f);
        } else {
            assert_true(p->ao[i] > 0.0f);
            const int source = (y < 16 ? 16 : y > 47 ? 47 : y) * SIZE + (x < 16 ? 16 : x > 47 ? 47 : x);
            assert_true(p->ao[i] == p->ao[source]);
        }
        assert_true(p->shadow[i] < 0.01f);
    }
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static void a_texel_is_the_mean_of_its_valid_samples(void **state) {
    enum { N = 3, SMALL = 16 };
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SMALL, N, 0);
    vsh_charts *fine = make_texels(&mesh, 1, SMALL * N, 1, 0);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.3);
    planes *p = new_planes(), *q = new_planes();
    bake(field, charts, &light, &p->all, NULL, 0);
    bake(field, fine, &light, &q->all, NULL, 0);
    for (int i = 0; i < SMALL * SMALL; ++i) {
        double sum = 0.0, count = 0.0;
        for (int s = 0; s < N * N; ++s) {
            const int at = (i / SMALL * N + s / N) * SMALL * N + i % SMALL * N + s % N;
            sum += q->coverage[at] > 0.0f ? (double)q->shadow[at] : 0.0;
            count += (double)q->coverage[at];
        }
        assert_true(p->coverage[i] == (count > 0.0 ? 1.0f : 0.0f));
        if (count > 0.0) {
            assert_true(fabs((double)p->shadow[i] - sum / count) < 1e-4);
        }
    }
    free(q);
    free(p);
    vsh_charts_free(fine);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static void a_lightmap_of_one_texel_is_the_value_at_its_middle(void **state) {
    vsh_field *field = floor_field(0);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, 1, 1, 4);
    const vsh_light light = sun(0.0, 1.0, 0.0, 0.1);
    planes *p = new_planes();
    bake(field, charts, &light, &p->all, NULL, 0);
    assert_true(p->shadow[0] == 1.0f);
    assert_true(p->coverage[0] == 1.0f);
    assert_true(isnan(p->coverage[1]));
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

/* A UV sphere, smooth, of `ROWS` × 2 `ROWS` cells, as receiver and caster. */
static void a_coarse_smooth_sphere_has_no_dark_terminator_and_no_acne(void **state) {
    enum { ROWS = 8, COLUMNS = 2 * ROWS, VERTICES = (ROWS + 1) * (COLUMNS + 1) };
    float positions[3 * VERTICES], uvs[2 * VERTICES];
    uint32_t indices[6 * ROWS * COLUMNS];
    size_t v = 0, i = 0;
    for (uint32_t r = 0; r <= ROWS; ++r) {
        for (uint32_t c = 0; c <= COLUMNS; ++c, ++v) {
            const double polar = 3.141592653589793 * r / ROWS, ring = r % ROWS == 0 ? 0.0 : sin(polar);
            const double around = 6.283185307179586 * (c % COLUMNS) / COLUMNS;
            positions[3 * v] = (float)(ring * cos(around));
            positions[3 * v + 1] = (float)cos(polar);
            positions[3 * v + 2] = (float)(-ring * sin(around));
            uvs[2 * v] = (float)c / COLUMNS;
            uvs[2 * v + 1] = 1.0f - (float)r / ROWS;
            if (r < ROWS && c < COLUMNS) {
                const uint32_t a = (uint32_t)v, b = a + COLUMNS + 1;
                const uint32_t cell[6] = {a, b, b + 1, a, b + 1, a + 1};
                memcpy(indices + i, cell, sizeof cell);
                i += 6;
            }
        }
    }
    const vsh_mesh mesh = {.name = "ball",
                           .positions = positions,
                           .normals = positions,
                           .uvs = uvs,
                           .indices = indices,
                           .vertex_count = VERTICES,
                           .triangle_count = i / 3};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.02;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    expect_ok(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &failure));
    expect_ok(vsh_field_create(grid, NULL, NULL, &field, &failure));
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(0.3, 0.9, 0.2, 0.01);
    const double length = sqrt(0.09 + 0.81 + 0.04);
    planes *p = new_planes();
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake(field, charts, &light, &p->all, &stats, 0);
    assert_int_equal(stats.invalid_texels, 0);
    vsh_texels *texels = NULL;
    assert_int_equal(vsh_texels_create(charts, NULL, &texels, NULL), VSH_OK);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    for (size_t s = 0; s < samples.count; ++s) {
        const float *n = samples.normals + 3 * s;
        const double cosine = ((double)n[0] * 0.3 + (double)n[1] * 0.9 + (double)n[2] * 0.2) / length;
        const float value = p->shadow[vsh_texel_place(samples.texels[s], SIZE)];
        if (cosine > 0.15) {
            assert_true(value > 0.98f);
        } else if (cosine < -0.01) {
            assert_true(value == 0.0f);
        }
    }
    free(p);
    vsh_texels_free(texels);
    vsh_charts_free(charts);
    vsh_field_free(field);
    vsh_grid_free(grid);
}

static void an_open_sheet_does_not_shade_itself(void **state) {
    const vsh_mesh mesh = floor_mesh();
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = VOXEL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    expect_ok(vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &failure));
    expect_ok(vsh_field_create(grid, NULL, NULL, &field, &failure));
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(0.5, 0.8, 0.1, 0.1);
    planes *p = new_planes();
    bake(field, charts, &light, &p->all, NULL, 0);
    for (int i = 0; i < TEXELS; ++i) {
        assert_true(p->coverage[i] == 1.0f);
        assert_true(p->shadow[i] == 1.0f);
    }
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
    vsh_grid_free(grid);
}

/* --- How a lightmap is baked: its planes, their errors, threads, options, limits. */

static void irradiance_is_visibility_times_colour_times_cosine_times_ao(void **state) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 0);
    vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    light.color[0] = 2.0;
    light.color[1] = 0.5;
    light.color[2] = 0.0;
    planes *p = new_planes();
    bake(field, charts, &light, &p->all, NULL, 0);
    for (size_t i = 0; i < TEXELS; ++i) {
        const double expected = (double)p->shadow[i] * sqrt(0.5) * (double)p->ao[i];
        assert_true(fabs((double)p->irradiance[3 * i] - 2.0 * expected) < 1e-5);
        assert_true(fabs((double)p->irradiance[3 * i + 1] - 0.5 * expected) < 1e-5);
        assert_true(p->irradiance[3 * i + 2] == 0.0f);
    }
    planes *alone = new_planes();
    alone->all = (vsh_lightmap){.irradiance = alone->irradiance};
    bake(field, charts, &light, &alone->all, NULL, 0);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(fabs((double)alone->irradiance[3 * i] - 2.0 * sqrt(0.5) * (double)p->shadow[i]) < 1e-5);
    }
    free(alone);
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static void planes_that_are_not_asked_for_cost_nothing_and_change_nothing(void **state) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 2);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *all = new_planes(), *some = new_planes();
    bake(field, charts, &light, &all->all, NULL, 0);

    vsh_bake_stats stats = vsh_bake_stats_zero();
    const vsh_lightmap coverage = {.coverage = some->coverage};
    bake(field, charts, &light, &coverage, &stats, 0);
    assert_int_equal(stats.shade.marches, 0);
    assert_int_equal(stats.shade.samples, 0);
    assert_memory_equal(some->coverage, all->coverage, sizeof all->coverage);

    const vsh_lightmap ao = {.ao = some->ao};
    bake(field, charts, NULL, &ao, NULL, 0);
    assert_memory_equal(some->ao, all->ao, sizeof all->ao);
    const vsh_lightmap shadow = {.shadow = some->lights};
    bake(field, charts, &light, &shadow, NULL, 0);
    assert_memory_equal(some->shadow, all->shadow, sizeof all->shadow);
    free(some);
    free(all);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static void any_number_of_threads_gives_the_same_bits(void **state) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 3, 4);
    const vsh_light light = sun(1.0, 0.7, 0.3, 0.2);
    planes *p[3];
    const int32_t threads[3] = {1, 2, 5};
    for (int t = 0; t < 3; ++t) {
        p[t] = new_planes();
        bake(field, charts, &light, &p[t]->all, NULL, threads[t]);
        assert_memory_equal(p[t]->shadow, p[0]->shadow, sizeof p[0]->shadow);
        assert_memory_equal(p[t]->ao, p[0]->ao, sizeof p[0]->ao);
        assert_memory_equal(p[t]->irradiance, p[0]->irradiance, sizeof p[0]->irradiance);
        assert_memory_equal(p[t]->coverage, p[0]->coverage, sizeof p[0]->coverage);
    }
    for (int t = 0; t < 3; ++t) {
        free(p[t]);
    }
    vsh_charts_free(charts);
    vsh_field_free(field);
}

static int32_t stop_in_bake(void *user, const char *stage, double fraction) {
    return strcmp(stage, "bake") == 0 && fraction > 0.0;
}

static void bad_options_limits_and_cancelling_are_reported(void **state) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 1, 0);
    vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *p = new_planes();
    vsh_shade_options options = preview_options();
    options.start_offset = NAN;
    expect_error(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &options, NULL, &p->all, NULL, &failure),
        VSH_ERROR_ARGUMENT, "start_offset");
    options = preview_options();
    options.surface_offset = -1.0;
    expect_error(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &options, NULL, &p->all, NULL, &failure),
        VSH_ERROR_ARGUMENT, "");
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000;
    expect_error(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, NULL, &run, &p->all, NULL, &failure),
        VSH_ERROR_LIMIT, "");
    run = vsh_run_default();
    run.progress = stop_in_bake;
    expect_error(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, NULL, &run, &p->all, NULL, &failure),
        VSH_ERROR_CANCELLED, "");
    light.angle = -1.0;
    expect_error(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, NULL, NULL, &p->all, NULL, &failure),
        VSH_ERROR_ARGUMENT, "");
    free(p);
    vsh_charts_free(charts);
    vsh_field_free(field);
}

/* Bakes the floor under a wall by `method` into planes of values and errors. */
static vsh_bake_stats bake_errors(int32_t method, float *shadow, float *shadow_error, float *ao_error) {
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_charts *charts = make_texels(&mesh, 1, SIZE, 2, 4);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.5);
    vsh_shade_options shade = preview_options();
    shade.method = method;
    float *shadows[1] = {shadow}, *errors[1] = {shadow_error};
    const vsh_lightmap lightmap = {
        .shadow = shadow != NULL ? shadows : NULL, .shadow_error = errors, .ao_error = ao_error};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    expect_ok(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &shade, NULL, &lightmap, &stats, &failure));
    vsh_charts_free(charts);
    vsh_field_free(field);
    return stats;
}

static void errors_are_baked_where_the_method_knows_them(void **state) {
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
        cmocka_unit_test(a_floor_under_open_sky_is_exactly_lit),
        cmocka_unit_test(texels_under_a_wall_are_invalid_and_nothing_leaks_on_either_side),
        cmocka_unit_test(padding_copies_dark_and_lit_texels_and_leaves_coverage),
        cmocka_unit_test(a_texel_is_the_mean_of_its_valid_samples),
        cmocka_unit_test(a_lightmap_of_one_texel_is_the_value_at_its_middle),
        cmocka_unit_test(a_coarse_smooth_sphere_has_no_dark_terminator_and_no_acne),
        cmocka_unit_test(an_open_sheet_does_not_shade_itself),
        cmocka_unit_test(errors_are_baked_where_the_method_knows_them),
        cmocka_unit_test(irradiance_is_visibility_times_colour_times_cosine_times_ao),
        cmocka_unit_test(planes_that_are_not_asked_for_cost_nothing_and_change_nothing),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
        cmocka_unit_test(bad_options_limits_and_cancelling_are_reported),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
