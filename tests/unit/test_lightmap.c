/* What a lightmap holds: a wall that stands on a floor, a coarse smooth sphere, an open sheet. */
#include "lightmaps.h"
#include "previews.h"
#include "testing.h"

/* Most tests bake these: a field, the charts of a mesh, planes. */
typedef struct stage {
    vsh_field *field;
    vsh_charts *charts;
    planes *p;
    vsh_bake_stats stats;
} stage;

static stage begin(vsh_field *field, const vsh_mesh *mesh, int32_t size, int32_t supersample,
                   int32_t padding) {
    return (stage){field, make_texels(mesh, 1, size, supersample, padding), new_planes(),
                   vsh_bake_stats_zero()};
}

/* The floor, with a wall on it or without. */
static stage begin_floor(int wall, int32_t size, int32_t supersample, int32_t padding) {
    static vsh_mesh mesh; /* charts refer to it */
    mesh = floor_mesh();
    return begin(floor_field(wall), &mesh, size, supersample, padding);
}

static void bake_stage(stage *s, const vsh_light *light) {
    bake(s->field, s->charts, light, &s->p->all, &s->stats, 0);
}

static void end(stage *s) {
    free(s->p);
    vsh_charts_free(s->charts);
    vsh_field_free(s->field);
}

TEST(a_floor_under_open_sky_is_exactly_lit) {
    const vsh_light light = sun(0.3, 1.0, 0.2, 0.2);
    static const int32_t sizes[][2] = {{SIZE, 0}, {1, 4}}; /* with their padding */
    for (int k = 0; k < 2; ++k) {
        FREED_BY(end) stage s = begin_floor(0, sizes[k][0], 1, sizes[k][1]);
        bake_stage(&s, &light);
        const size_t texels = (size_t)(sizes[k][0] * sizes[k][0]);
        for (size_t i = 0; i < texels; ++i) {
            assert_true(s.p->shadow[i] == 1.0f);
            assert_true(s.p->coverage[i] == 1.0f);
        }
        assert_true(texels == TEXELS || isnan(s.p->coverage[texels]));
        assert_int_equal(s.stats.texels, texels);
        assert_int_equal(s.stats.invalid_texels, 0);
    }
}

TEST(texels_under_a_wall_are_invalid_and_nothing_leaks_on_either_side) {
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    uint64_t invalid_by_mesh[1] = {77}, invalid = 0;
    FREED_BY(end) stage s = begin_floor(1, SIZE, 1, 0);
    s.stats.invalid_by_mesh = invalid_by_mesh;
    bake_stage(&s, &light);
    for (uint32_t i = 0; i < TEXELS; ++i) {
        const double x = texel_x(i);
        const float shadow = s.p->shadow[i];
        invalid += s.p->coverage[i] == 0.0f;
        assert_true(fabs(x) >= WALL - VOXEL || s.p->coverage[i] == 0.0f);
        assert_true(fabs(x) <= WALL + VOXEL || s.p->coverage[i] == 1.0f);
        /* The shadow of a wall of height 1 at 45° ends beyond the floor's edge. */
        assert_true(x >= -WALL || shadow < 0.01f);
        assert_true(x <= WALL + VOXEL || shadow > 0.99f);
        /* Invalid texels take the value of the nearest valid one, dark or lit. */
        if (fabs(x) < WALL - VOXEL && fabs(x) > WALL - 6.0 * 2.0 / SIZE) {
            assert_true(x < 0.0 ? shadow < 0.01f : shadow > 0.9f);
        }
    }
    assert_int_equal(invalid, s.stats.invalid_texels);
    assert_int_equal(invalid, invalid_by_mesh[0]);
    assert_int_equal(s.stats.texels, TEXELS);
}

TEST(padding_copies_dark_and_lit_texels_and_leaves_coverage) {
    enum { PADDING = 3 };
    /* The part x < -0.5 of the floor, all of it in shadow, and a chart around it. */
    const float positions[12] = {-1, 0, 1, -0.5f, 0, 1, -0.5f, 0, -1, -1, 0, -1};
    const float uvs[8] = {0.25f, 0.25f, 0.75f, 0.25f, 0.75f, 0.75f, 0.25f, 0.75f};
    vsh_mesh mesh = floor_mesh();
    mesh.positions = positions;
    mesh.uvs = uvs;
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    FREED_BY(end) stage s = begin(floor_field(1), &mesh, SIZE, 1, PADDING);
    bake_stage(&s, &light);
    const planes *p = s.p;
    for (int i = 0; i < TEXELS; ++i) {
        const int x = i % SIZE, y = i / SIZE;
        const int dx = x < 16 ? 16 - x : x > 47 ? x - 47 : 0, dy = y < 16 ? 16 - y : y > 47 ? y - 47 : 0;
        assert_true(p->coverage[i] == (dx == 0 && dy == 0 ? 1.0f : 0.0f));
        if (dx * dx + dy * dy > PADDING * PADDING) {
            assert_true(p->ao[i] == 0.0f);
        } else {
            const int source = (y < 16 ? 16 : y > 47 ? 47 : y) * SIZE + (x < 16 ? 16 : x > 47 ? 47 : x);
            assert_true(p->ao[i] > 0.0f && p->ao[i] == p->ao[source]);
        }
        assert_true(p->shadow[i] < 0.01f);
    }
}

TEST(a_texel_is_the_mean_of_its_valid_samples) {
    enum { N = 3, SMALL = 16 };
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.3);
    stage coarse = begin_floor(1, SMALL, N, 0), fine = begin_floor(1, SMALL * N, 1, 0);
    bake_stage(&coarse, &light);
    bake_stage(&fine, &light);
    const planes *p = coarse.p, *q = fine.p;
    for (int i = 0; i < SMALL * SMALL; ++i) {
        double sum = 0.0, count = 0.0;
        for (int s = 0; s < N * N; ++s) {
            const int at = (i / SMALL * N + s / N) * SMALL * N + i % SMALL * N + s % N;
            sum += q->coverage[at] > 0.0f ? (double)q->shadow[at] : 0.0;
            count += (double)q->coverage[at];
        }
        assert_true(p->coverage[i] == (count > 0.0 ? 1.0f : 0.0f));
        assert_true(count == 0.0 || fabs((double)p->shadow[i] - sum / count) < 1e-4);
    }
    end(&fine);
    end(&coarse);
}

/* A UV sphere, smooth, of `ROWS` × 2 `ROWS` cells, as receiver and caster. */
TEST(a_coarse_smooth_sphere_has_no_dark_terminator_and_no_acne) {
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
    const vsh_light light = sun(0.3, 0.9, 0.2, 0.01);
    const double length = sqrt(0.09 + 0.81 + 0.04);
    FREED_BY(end) stage s = begin(field_of_mesh(&mesh, 0.02), &mesh, SIZE, 1, 0);
    bake_stage(&s, &light);
    assert_int_equal(s.stats.invalid_texels, 0);
    vsh_texels *texels = NULL;
    assert_ok(vsh_texels_create(s.charts, NULL, &texels, &failure));
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    for (size_t k = 0; k < samples.count; ++k) {
        const float *n = samples.normals + 3 * k;
        const double cosine = ((double)n[0] * 0.3 + (double)n[1] * 0.9 + (double)n[2] * 0.2) / length;
        const float value = s.p->shadow[vsh_texel_place(samples.texels[k], SIZE)];
        assert_true(cosine <= 0.15 || value > 0.98f);
        assert_true(cosine >= -0.01 || value == 0.0f);
    }
    vsh_texels_free(texels);
}

TEST(an_open_sheet_does_not_shade_itself) {
    const vsh_mesh mesh = floor_mesh();
    const vsh_light light = sun(0.5, 0.8, 0.1, 0.1);
    FREED_BY(end) stage s = begin(field_of_mesh(&mesh, VOXEL), &mesh, SIZE, 1, 0);
    bake_stage(&s, &light);
    for (int i = 0; i < TEXELS; ++i) {
        assert_true(s.p->coverage[i] == 1.0f);
        assert_true(s.p->shadow[i] == 1.0f);
    }
}

/* --- How a lightmap is baked: its planes, their errors, threads, options, limits. */

TEST(irradiance_is_visibility_times_colour_times_cosine_times_ao) {
    vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    light.color[0] = 2.0;
    light.color[1] = 0.5;
    light.color[2] = 0.0;
    FREED_BY(end) stage s = begin_floor(1, SIZE, 1, 0);
    bake_stage(&s, &light);
    planes *p = s.p, *alone = new_planes();
    alone->all = (vsh_lightmap){.irradiance = alone->irradiance};
    bake(s.field, s.charts, &light, &alone->all, NULL, 0);
    for (size_t i = 0; i < TEXELS; ++i) {
        const double lit = (double)p->shadow[i] * sqrt(0.5), expected = lit * (double)p->ao[i];
        assert_true(fabs((double)p->irradiance[3 * i] - 2.0 * expected) < 1e-5);
        assert_true(fabs((double)p->irradiance[3 * i + 1] - 0.5 * expected) < 1e-5);
        assert_true(p->irradiance[3 * i + 2] == 0.0f);
        assert_true(fabs((double)alone->irradiance[3 * i] - 2.0 * lit) < 1e-5);
    }
    free(alone);
}

TEST(planes_that_are_not_asked_for_cost_nothing_and_change_nothing) {
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    FREED_BY(end) stage s = begin_floor(1, SIZE, 1, 2);
    bake_stage(&s, &light);
    planes *some = new_planes();
    const vsh_lightmap coverage = {.coverage = some->coverage}, ao = {.ao = some->ao},
                       shadow = {.shadow = some->lights};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake(s.field, s.charts, &light, &coverage, &stats, 0);
    assert_int_equal(stats.shade.marches, 0);
    assert_int_equal(stats.shade.samples, 0);
    bake(s.field, s.charts, NULL, &ao, NULL, 0);
    bake(s.field, s.charts, &light, &shadow, NULL, 0);
    assert_memory_equal(some->coverage, s.p->coverage, sizeof some->coverage);
    assert_memory_equal(some->ao, s.p->ao, sizeof some->ao);
    assert_memory_equal(some->shadow, s.p->shadow, sizeof some->shadow);
    free(some);
}

TEST(any_number_of_threads_gives_the_same_bits) {
    const vsh_light light = sun(1.0, 0.7, 0.3, 0.2);
    FREED_BY(end) stage s = begin_floor(1, SIZE, 3, 4);
    bake(s.field, s.charts, &light, &s.p->all, NULL, 1);
    static const int32_t threads[] = {2, 5};
    for (int t = 0; t < 2; ++t) {
        FREED planes *p = new_planes();
        bake(s.field, s.charts, &light, &p->all, NULL, threads[t]);
        assert_memory_equal(p->shadow, s.p->shadow, sizeof p->shadow);
        assert_memory_equal(p->ao, s.p->ao, sizeof p->ao);
        assert_memory_equal(p->irradiance, s.p->irradiance, sizeof p->irradiance);
        assert_memory_equal(p->coverage, s.p->coverage, sizeof p->coverage);
    }
}

TEST(bad_options_and_limits_are_reported) {
    const struct {
        double start_offset, surface_offset, angle;
        uint64_t memory_limit;
        vsh_result code;
        const char *part;
    } cases[] = {{NAN, 0.0, 0.05, 0, VSH_ERROR_ARGUMENT, "start_offset"},
                 {1.0, -1.0, 0.05, 0, VSH_ERROR_ARGUMENT, ""},
                 {1.0, 0.0, 0.05, 1000, VSH_ERROR_LIMIT, ""},
                 {1.0, 0.0, -1.0, 0, VSH_ERROR_ARGUMENT, ""}};
    FREED_BY(end) stage s = begin_floor(1, SIZE, 1, 0);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        const vsh_light light = sun(1.0, 1.0, 0.0, cases[i].angle);
        vsh_shade_options options = preview_options();
        options.start_offset = cases[i].start_offset;
        options.surface_offset = cases[i].surface_offset;
        const vsh_run run = run_within(cases[i].memory_limit);
        assert_fails(vsh_bake_lightmap(occluders_of(s.field), s.charts, &light, 1, &options, &run, &s.p->all,
                                       NULL, &failure),
                     cases[i].code, cases[i].part);
    }
}

/* Bakes the floor under a wall by `method` into planes of values and errors. */
static vsh_bake_stats bake_errors(int32_t method, float *shadow, float *shadow_error, float *ao_error) {
    OWNED(vsh_field) *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    OWNED(vsh_charts) *charts = make_texels(&mesh, 1, SIZE, 2, 4);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.5);
    vsh_shade_options shade = preview_options();
    shade.method = method;
    float *shadows[1] = {shadow}, *errors[1] = {shadow_error};
    const vsh_lightmap lightmap = {
        .shadow = shadow != NULL ? shadows : NULL, .shadow_error = errors, .ao_error = ao_error};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    assert_ok(
        vsh_bake_lightmap(occluders_of(field), charts, &light, 1, &shade, NULL, &lightmap, &stats, &failure));
    return stats;
}

TEST(errors_are_baked_where_the_method_knows_them) {
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
