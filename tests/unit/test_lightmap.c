/* What a lightmap holds: a wall that stands on a floor, a coarse smooth sphere, an open sheet. */
#include "lightmaps.h"

static void a_floor_under_open_sky_is_exactly_lit(void **state) {
    (void)state;
    vsh_field *field = floor_field(0);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(0.3, 1.0, 0.2, 0.2);
    planes *p = new_planes();
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake(field, texels, &light, &p->all, &stats, 0);
    for (int i = 0; i < TEXELS; ++i) {
        assert_true(p->shadow[i] == 1.0f);
        assert_true(p->coverage[i] == 1.0f);
    }
    assert_int_equal(stats.texels, TEXELS);
    assert_int_equal(stats.invalid_texels, 0);
    free(p);
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static void texels_under_a_wall_are_invalid_and_nothing_leaks_on_either_side(void **state) {
    (void)state;
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *p = new_planes();
    uint64_t invalid_by_mesh[1] = {77};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    stats.invalid_by_mesh = invalid_by_mesh;
    bake(field, texels, &light, &p->all, &stats, 0);
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
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static void padding_copies_dark_and_lit_texels_and_leaves_coverage(void **state) {
    (void)state;
    enum { PADDING = 3 };
    vsh_field *field = floor_field(1);
    /* The part x < -0.5 of the floor, all of it in shadow, and a chart around it. */
    const float positions[12] = {-1, 0, 1, -0.5f, 0, 1, -0.5f, 0, -1, -1, 0, -1};
    const float uvs[8] = {0.25f, 0.25f, 0.75f, 0.25f, 0.75f, 0.75f, 0.25f, 0.75f};
    vsh_mesh mesh = floor_mesh();
    mesh.positions = positions;
    mesh.uvs = uvs;
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, PADDING);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.05);
    planes *p = new_planes();
    bake(field, texels, &light, &p->all, NULL, 0);
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
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static void a_texel_is_the_mean_of_its_valid_samples(void **state) {
    (void)state;
    enum { N = 3, SMALL = 16 };
    vsh_field *field = floor_field(1);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, SMALL, N, 0);
    vsh_texels *fine = make_texels(&mesh, 1, SMALL * N, 1, 0);
    const vsh_light light = sun(1.0, 1.0, 0.0, 0.3);
    planes *p = new_planes(), *q = new_planes();
    bake(field, texels, &light, &p->all, NULL, 0);
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
    vsh_texels_free(fine);
    vsh_texels_free(texels);
    vsh_field_free(field);
}

static void a_lightmap_of_one_texel_is_the_value_at_its_middle(void **state) {
    (void)state;
    vsh_field *field = floor_field(0);
    const vsh_mesh mesh = floor_mesh();
    vsh_texels *texels = make_texels(&mesh, 1, 1, 1, 4);
    const vsh_light light = sun(0.0, 1.0, 0.0, 0.1);
    planes *p = new_planes();
    bake(field, texels, &light, &p->all, NULL, 0);
    assert_true(p->shadow[0] == 1.0f);
    assert_true(p->coverage[0] == 1.0f);
    assert_true(isnan(p->coverage[1]));
    free(p);
    vsh_texels_free(texels);
    vsh_field_free(field);
}

/* A UV sphere, smooth, of `ROWS` × 2 `ROWS` cells, as receiver and caster. */
static void a_coarse_smooth_sphere_has_no_dark_terminator_and_no_acne(void **state) {
    (void)state;
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
    vsh_error error = {0};
    if (vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error) != VSH_OK ||
        vsh_field_create(grid, NULL, NULL, &field, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(0.3, 0.9, 0.2, 0.01);
    const double length = sqrt(0.09 + 0.81 + 0.04);
    planes *p = new_planes();
    vsh_bake_stats stats = vsh_bake_stats_zero();
    bake(field, texels, &light, &p->all, &stats, 0);
    assert_int_equal(stats.invalid_texels, 0);
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
    vsh_field_free(field);
    vsh_grid_free(grid);
}

static void an_open_sheet_does_not_shade_itself(void **state) {
    (void)state;
    const vsh_mesh mesh = floor_mesh();
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = VOXEL;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_error error = {0};
    if (vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error) != VSH_OK ||
        vsh_field_create(grid, NULL, NULL, &field, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_texels *texels = make_texels(&mesh, 1, SIZE, 1, 0);
    const vsh_light light = sun(0.5, 0.8, 0.1, 0.1);
    planes *p = new_planes();
    bake(field, texels, &light, &p->all, NULL, 0);
    for (int i = 0; i < TEXELS; ++i) {
        assert_true(p->coverage[i] == 1.0f);
        assert_true(p->shadow[i] == 1.0f);
    }
    free(p);
    vsh_texels_free(texels);
    vsh_field_free(field);
    vsh_grid_free(grid);
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
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
