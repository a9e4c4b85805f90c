/* Texels: places in UV space, coverage, what is refused and counted, and what normals do. */
#include "bake/texels.h"
#include "testing.h"
#include "texels_of.h"

/* The charts of meshes, their texels and samples. */
typedef struct sampled {
    vsh_charts *charts;
    vsh_charts_info info;
    vsh_texels *texels;
    vsh_texel_samples samples;
} sampled;

static sampled sample(const vsh_mesh *meshes, size_t count, vsh_lightmap_options options,
                      vsh_uv_report *reports) {
    sampled s = {.charts = create(meshes, count, options, reports)};
    vsh_charts_get_info(s.charts, &s.info);
    s.texels = rasterize(s.charts);
    s.samples = vsh_texels_samples(s.texels);
    return s;
}

static void free_sampled(sampled *s) {
    vsh_texels_free(s->texels);
    vsh_charts_free(s->charts);
}

TEST(a_quad_over_the_unit_square_puts_every_texel_at_its_analytic_place) {
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    const int32_t sizes[][3] = {{16, 16, 1}, {37, 11, 1}, {1, 1, 1}, {8, 24, 2}, {13, 9, 3}, {3, 2, 16}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; ++s) {
        const int32_t w = sizes[s][0], h = sizes[s][1], n = sizes[s][2];
        vsh_uv_report report;
        FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(w, h, n), &report);
        assert_int_equal(made.info.covered, w * h);
        assert_int_equal(made.info.samples, w * h * n * n);
        assert_int_equal(report.overlap_texels, 0);
        assert_int_equal(report.overlap_triangles, 0);
        assert_int_equal(report.outside_triangles, 0);
        assert_int_equal(report.degenerate_triangles, 0);
        const vsh_texel_samples samples = made.samples;
        FREED double *sum = calloc((size_t)(w * h), 2 * sizeof *sum);
        FREED int *count = calloc((size_t)(w * h), sizeof *count);
        for (size_t i = 0; i < samples.count; ++i) {
            const size_t texel = vsh_texel_place(samples.texels[i], w);
            const double *p = samples.positions + 3 * i;
            ++count[texel];
            sum[2 * texel] += p[0];
            sum[2 * texel + 1] += p[1];
            assert_true(p[2] == 0.0);
            assert_true(samples.normals[3 * i + 2] == 1.0f);
            assert_true(samples.geometric_normals[3 * i + 2] == 1.0f);
            const double column = vsh_texel_column(samples.texels[i]), row = vsh_texel_row(samples.texels[i]);
            assert_true(p[0] > 2.0 * column / w && p[0] < 2.0 * (column + 1) / w);
            assert_true(p[1] < 3.0 * (1.0 - row / h) && p[1] > 3.0 * (1.0 - (row + 1) / h));
        }
        for (int32_t texel = 0; texel < w * h; ++texel) {
            assert_int_equal(count[texel], n * n);
            assert_true(fabs(sum[2 * texel] / (n * n) - 2.0 * (texel % w + 0.5) / w) < 1e-12);
            /* Row 0 lies at v = 1. */
            assert_true(fabs(sum[2 * texel + 1] / (n * n) - 3.0 * (1.0 - (texel / w + 0.5) / h)) < 1e-12);
        }
    }
}

TEST(neighbouring_samples_come_cell_by_cell) {
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(24, 16, 1), NULL);
    const vsh_texel_samples samples = made.samples;
    for (size_t i = 0; i < samples.count; ++i) {
        const size_t column = vsh_texel_column(samples.texels[i]), row = vsh_texel_row(samples.texels[i]);
        assert_int_equal(row / 8 * 3 + column / 8, i / 64);
    }
}

/* A fan around a point that lies on a texel centre, and many that do not. */
TEST(triangles_that_share_edges_and_corners_leave_no_gap_and_no_overlap) {
    enum { SPOKES = 17 };
    for (int variant = 0; variant < 8; ++variant) {
        float positions[3 * (SPOKES + 1)] = {0}, uvs[2 * (SPOKES + 1)];
        uint32_t indices[3 * SPOKES];
        uvs[0] = variant % 2 == 0 ? 8.5f / 16.0f : 0.47f + 0.01f * (float)variant;
        uvs[1] = variant % 2 == 0 ? 8.5f / 16.0f : 0.53f;
        for (int k = 0; k < SPOKES; ++k) {
            /* Corners on a large square around the unit square, so that the fan covers all of it. */
            const double angle = 6.283185307179586 * (k + 0.1 * variant) / SPOKES;
            uvs[2 * k + 2] = (float)(0.5 + 1.5 * cos(angle));
            uvs[2 * k + 3] = (float)(0.5 + 1.5 * sin(angle));
            indices[3 * k] = 0;
            indices[3 * k + 1] = (uint32_t)(k + 1);
            indices[3 * k + 2] = (uint32_t)((k + 1) % SPOKES + 1);
        }
        for (int k = 0; k <= SPOKES; ++k) {
            positions[3 * k] = uvs[2 * k];
            positions[3 * k + 1] = uvs[2 * k + 1];
        }
        const vsh_mesh mesh = {.name = "fan",
                               .positions = positions,
                               .uvs = uvs,
                               .indices = indices,
                               .vertex_count = SPOKES + 1,
                               .triangle_count = SPOKES};
        vsh_uv_report report;
        FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(16, 16, 3), &report);
        assert_int_equal(made.info.samples, 16 * 16 * 9);
        assert_int_equal(report.overlap_texels, 0);
        assert_int_equal(report.overlap_triangles, 0);
        assert_int_equal(report.outside_triangles, SPOKES);
    }
}

TEST(a_chart_that_does_not_fit_has_border_texels_near_and_inside_it) {
    const int32_t supersample[] = {1, 2};
    quad q;
    make_quad(&q, 4.0f / 16.0f, 4.0f / 16.0f, 12.0f / 16.0f, 12.0f / 16.0f);
    sampled fits = sample(&q.mesh, 1, size_of(16, 16, 1), NULL);
    assert_int_equal(fits.info.covered, 64);
    free_sampled(&fits);
    /* From 4.8 to 11.2 of 16: the texels 4 and 11 are touched, their centres and samples (n = 2) are not. */
    make_quad(&q, 0.3f, 0.3f, 0.7f, 0.7f);
    for (size_t s = 0; s < 2; ++s) {
        FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(16, 16, supersample[s]), NULL);
        const vsh_texel_samples samples = made.samples;
        assert_int_equal(made.info.covered, 64);
        int border = 0;
        for (size_t i = 0; i < samples.count; ++i) {
            const double low = (double)0.3f, high = (double)0.7f;
            const double u = (vsh_texel_column(samples.texels[i]) + 0.5) / 16.0,
                         v = 1.0 - (vsh_texel_row(samples.texels[i]) + 0.5) / 16;
            if (u > low && u < high && v > low && v < high) {
                continue;
            }
            if (s == 0) {
                ++border;
                /* a quarter of a texel inside along sides, a sixth at corners, where a triangle is half a
                 * square */
                const double texel = 1.0 / 16.0, x = samples.positions[3 * i] / 2.0,
                             y = samples.positions[3 * i + 1] / 3.0;
                assert_true(fabs(x - fmin(fmax(u, low), high)) < 0.5 * texel);
                assert_true(fabs(y - fmin(fmax(v, low), high)) < 0.5 * texel);
                assert_true(fmin(fmin(x - low, high - x), fmin(y - low, high - y)) > 0.16 * texel);
            }
        }
        assert_int_equal(border, s == 0 ? 28 : 0);
        for (size_t i = 0; i < samples.count; ++i) {
            assert_true(samples.positions[3 * i] >= 2.0 * (double)0.3f - 1e-7);
            assert_true(samples.positions[3 * i] <= 2.0 * (double)0.7f + 1e-7);
        }
    }
}

TEST(a_triangle_smaller_than_a_texel_still_has_one) {
    const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const float uvs[] = {0.51f, 0.51f, 0.512f, 0.51f, 0.51f, 0.512f};
    const uint32_t indices[] = {0, 1, 2};
    const vsh_mesh mesh = {
        .positions = positions, .uvs = uvs, .indices = indices, .vertex_count = 3, .triangle_count = 1};
    FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(8, 8, 1), NULL);
    const vsh_texel_samples samples = made.samples;
    assert_int_equal(samples.count, 1);
    assert_int_equal(samples.texels[0], vsh_texel(4, 3));
    const double *p = samples.positions;
    assert_true(p[0] >= 0.0 && p[1] >= 0.0 && p[0] + p[1] <= 1.0 + 1e-12);
}

TEST(the_first_triangle_keeps_a_texel_that_two_cover) {
    quad q[2];
    make_quad(&q[0], 0.0f, 0.0f, 1.0f, 1.0f);
    make_quad(&q[1], 0.0f, 0.0f, 1.0f, 1.0f);
    for (int k = 0; k < 4; ++k) {
        q[1].positions[3 * k + 2] = 7.0f;
    }
    for (int first = 0; first < 2; ++first) {
        const vsh_mesh meshes[] = {q[first].mesh, q[1 - first].mesh};
        FREED_BY(free_sampled) sampled made = sample(meshes, 2, size_of(9, 9, 1), NULL);
        const vsh_texel_samples samples = made.samples;
        assert_int_equal(samples.count, 81);
        for (size_t i = 0; i < samples.count; ++i) {
            assert_true(samples.positions[3 * i + 2] == (first == 0 ? 0.0 : 7.0));
        }
    }
}

TEST(any_number_of_threads_gives_the_same_bits) {
    sphere s[2];
    make_sphere(&s[0], 40, 1.0);
    make_sphere(&s[1], 13, 1.0); /* the same chart: everything overlaps */
    const vsh_mesh meshes[] = {s[0].mesh, s[1].mesh};
    const int32_t threads[] = {1, 2, 5};
    vsh_charts *charts[3];
    vsh_texels *texels[3];
    vsh_uv_report reports[3][2];
    for (int t = 0; t < 3; ++t) {
        const vsh_run run = run_on(threads[t]);
        const vsh_lightmap_options options = size_of(301, 203, 2);
        memset(reports[t], 0, sizeof reports[t]);
        assert_ok(vsh_charts_create(meshes, 2, &options, &run, reports[t], &charts[t], &failure));
        assert_ok(vsh_texels_create(charts[t], &run, &texels[t], &failure));
    }
    const vsh_texel_samples a = vsh_texels_samples(texels[0]);
    for (int t = 1; t < 3; ++t) {
        const vsh_texel_samples b = vsh_texels_samples(texels[t]);
        assert_int_equal(a.count, b.count);
        assert_memory_equal(a.positions, b.positions, a.count * 3 * sizeof(double));
        assert_memory_equal(a.normals, b.normals, a.count * 3 * sizeof(float));
        assert_memory_equal(a.geometric_normals, b.geometric_normals, a.count * 3 * sizeof(float));
        assert_memory_equal(a.texels, b.texels, a.count * sizeof(uint32_t));
        assert_memory_equal(reports[0], reports[t], sizeof reports[0]);
    }
    assert_true(reports[0][1].overlap_texels > 301 * 203 / 2);
    for (int t = 0; t < 3; ++t) {
        vsh_texels_free(texels[t]);
        vsh_charts_free(charts[t]);
    }
    free_sphere(&s[1]);
    free_sphere(&s[0]);
}

TEST(huge_uvs_are_clipped_and_counted) {
    const float huge[] = {1e30f, 3e38f, 1e10f, 1e6f, 300.0f, 1.1f};
    for (size_t k = 0; k < sizeof huge / sizeof huge[0]; ++k) {
        const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        const float uvs[] = {-huge[k], -huge[k], huge[k], -huge[k], 0.5f, huge[k]};
        const uint32_t indices[] = {0, 1, 2};
        const vsh_mesh mesh = {
            .positions = positions, .uvs = uvs, .indices = indices, .vertex_count = 3, .triangle_count = 1};
        vsh_uv_report report;
        FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(64, 32, 2), &report);
        assert_int_equal(report.outside_triangles, 1);
        const vsh_texel_samples samples = made.samples;
        assert_true(samples.count > 0 && samples.count <= 64 * 32 * 4);
        for (size_t i = 0; i < samples.count; ++i) {
            const double *p = samples.positions + 3 * i;
            assert_true(vsh_texel_column(samples.texels[i]) < 64 && vsh_texel_row(samples.texels[i]) < 32);
            assert_true(p[0] >= 0.0 && p[1] >= 0.0 && p[0] + p[1] <= 1.0 + 1e-9 && p[2] == 0.0);
        }
    }
}

TEST(triangles_without_area_are_skipped_and_those_of_uv_space_counted) {
    const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0};
    const float uvs[] = {0, 0, 1, 0, 0, 1, 0.5f, 0.5f};
    /* A good one; no area in the world; no area in UV space (corners 1, 2 and 3 lie on a line there). */
    const uint32_t indices[] = {0, 1, 2, 0, 1, 3, 1, 3, 2, 0, 0, 0};
    const vsh_mesh mesh = {
        .positions = positions, .uvs = uvs, .indices = indices, .vertex_count = 4, .triangle_count = 4};
    vsh_uv_report report;
    FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(8, 8, 1), &report);
    assert_int_equal(report.degenerate_triangles, 1);
    assert_int_equal(report.overlap_texels, 0);
}

/* The message has both words. */
static void assert_refused(const vsh_mesh *mesh, vsh_lightmap_options options, vsh_result code,
                           const char *value, const char *limit) {
    vsh_charts *charts = NULL;
    assert_fails(vsh_charts_create(mesh, 1, &options, NULL, NULL, &charts, &failure), code, value);
    assert_null(charts);
    assert_int_equal(failure.code, code);
    assert_non_null(strstr(failure.message, limit));
}

TEST(bad_sizes_and_uvs_are_refused_with_the_value_and_the_limit) {
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    vsh_lightmap_options good = size_of(8, 8, 1), padded = good, narrowed = good;
    padded.padding = 4097;
    narrowed.padding = -2; /* -1 is VSH_PADDING_AUTO */
    assert_refused(&q.mesh, size_of(0, 8, 1), VSH_ERROR_ARGUMENT, "width 0", "65536");
    assert_refused(&q.mesh, size_of(8, 1000000, 1), VSH_ERROR_ARGUMENT, "height 1000000", "65536");
    assert_refused(&q.mesh, size_of(8, -1, 1), VSH_ERROR_ARGUMENT, "height -1", "");
    assert_refused(&q.mesh, size_of(8, 8, 17), VSH_ERROR_ARGUMENT, "supersample 17", "16");
    assert_refused(&q.mesh, padded, VSH_ERROR_ARGUMENT, "padding 4097", "4096");
    assert_refused(&q.mesh, narrowed, VSH_ERROR_ARGUMENT, "padding -2", "");
    q.uvs[5] = NAN;
    assert_refused(&q.mesh, good, VSH_ERROR_INPUT, "mesh 'quad'", "vertex 2");
    q.uvs[5] = -INFINITY;
    assert_refused(&q.mesh, good, VSH_ERROR_INPUT, "mesh 'quad'", "vertex 2");
    q.mesh.uvs = NULL;
    assert_refused(&q.mesh, good, VSH_ERROR_INPUT, "mesh 'quad'", "no lightmap UVs");
}

TEST(the_memory_limit_is_passed_by_no_lightmap) {
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    vsh_run run = vsh_run_default();
    vsh_charts *charts = NULL;
    const vsh_lightmap_options small = size_of(64, 64, 1), large = size_of(65536, 65536, 16);
    run.memory_limit = 1000000;
    assert_ok(vsh_charts_create(&q.mesh, 1, &small, &run, NULL, &charts, &failure));
    vsh_charts_info info;
    vsh_charts_get_info(charts, &info);
    assert_true(info.bytes <= run.memory_limit);
    vsh_charts_free(charts);
    assert_int_equal(vsh_charts_create(&q.mesh, 1, &large, &run, NULL, &charts, &failure), VSH_ERROR_LIMIT);
    assert_null(charts);
    assert_non_null(strstr(failure.message, "limit"));
}

static void count_warning(void *user, const char *message) {
    assert_null(strchr(message, '\n'));
    ++*(int *)user;
}

TEST(overlaps_tell_own_charts_from_those_of_other_objects_and_name_the_worst_pair) {
    enum { COUNT = 5 };
    quad q[COUNT];
    make_quad(&q[0], 0.0f, 0.0f, 0.5f, 0.5f);
    make_quad(&q[1], 0.0f, 0.0f, 0.5f, 0.25f); /* over the first, of the same object */
    make_quad(&q[2], 0.5f, 0.0f, 1.0f, 1.0f);
    make_quad(&q[3], 0.25f, 0.0f, 1.0f,
              0.5f); /* 16 × 32 texels over the first object, 32 × 32 over the third */
    make_quad(&q[4], 0.9375f, 0.9375f, 1.0f, 1.0f); /* 4 × 4 over the third */
    vsh_mesh meshes[COUNT];
    for (size_t i = 0; i < COUNT; ++i) {
        meshes[i] = q[i].mesh;
    }
    meshes[0].object = meshes[1].object = 7;
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = 64;
    for (int n = 1; n <= 2; ++n) {
        options.supersample = n;
        vsh_uv_report reports[COUNT];
        OWNED(vsh_charts) *charts = create(meshes, COUNT, options, reports);
        vsh_charts_info info;
        vsh_charts_get_info(charts, &info);
        assert_int_equal(info.samples, (32 * 32 + 32 * 64) * n * n);
        assert_int_equal(reports[2].overlap_texels, 0); /* it shares an edge with the first */
        assert_int_equal(reports[4].overlap_triangles, 2);
        assert_int_equal(reports[1].overlap_texels, 32 * 16);
        assert_int_equal(reports[1].other_texels, 0);
        assert_int_equal(reports[3].overlap_texels, (16 + 32) * 32);
        assert_int_equal(reports[3].other_texels, (16 + 32) * 32);
        assert_int_equal(reports[3].other_mesh, 2);
        assert_int_equal(reports[3].other_mesh_texels, 32 * 32);
        assert_int_equal(reports[4].other_texels, 4 * 4);
        assert_true(reports[4].other_mesh == SIZE_MAX && reports[4].other_mesh_texels == 0);
    }
}

TEST(overlaps_are_warned_of_by_mesh) {
    quad q[2];
    make_quad(&q[0], 0.0f, 0.0f, 1.0f, 1.0f);
    make_quad(&q[1], 0.0f, 0.0f, 2.0f, 1.0f);
    const vsh_mesh meshes[] = {q[0].mesh, q[1].mesh};
    int warnings = 0;
    vsh_run run = vsh_run_default();
    run.warning = count_warning;
    run.user = &warnings;
    OWNED(vsh_charts) *charts = NULL;
    const vsh_lightmap_options options = size_of(16, 16, 1);
    assert_ok(vsh_charts_create(meshes, 2, &options, &run, NULL, &charts, &failure));
    assert_int_equal(warnings, 2); /* overlap and outside, both of the second mesh */
}

/* --- smooth normals and mirrors: where samples are lifted to, and which way they face */

static double length_of(const double p[3]) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
}

/* Samples of a sphere with and without its smooth normals. */
static void sample_both(sphere *s, int32_t size, sampled both[2]) {
    vsh_mesh flat = s->mesh;
    flat.normals = NULL;
    both[0] = sample(&s->mesh, 1, size_of(size, size / 2, 1), NULL);
    both[1] = sample(&flat, 1, size_of(size, size / 2, 1), NULL);
    assert_int_equal(both[0].samples.count, both[1].samples.count);
}

TEST(samples_of_a_coarse_smooth_sphere_are_lifted_to_within_its_sag) {
    const double radius = 2.0;
    FREED_BY(free_sphere) sphere s;
    sampled both[2];
    make_sphere(&s, 6, radius);
    sample_both(&s, 64, both);
    const vsh_texel_samples a = both[0].samples, b = both[1].samples;
    /* A facet is deepest below the middle of its cell's diagonal. */
    double sag = 0.0, worst = 0.0, before = 0.0;
    for (size_t i = 0; i < a.count; ++i) {
        const double *p = a.positions + 3 * i, *q = b.positions + 3 * i;
        const float *n = a.normals + 3 * i, *g = b.normals + 3 * i;
        double height = 0.0, cosine = 0.0, unit = 0.0;
        for (int k = 0; k < 3; ++k) {
            height += (p[k] - q[k]) * (double)g[k];
            cosine += (double)n[k] * p[k] / length_of(p);
            unit += (double)n[k] * (double)n[k];
        }
        assert_true(height > -1e-6);
        assert_true(cosine > 0.98);
        assert_near(unit, 1.0, 1e-6);
        sag = fmax(sag, radius - length_of(q));
        worst = fmax(worst, fabs(length_of(p) - radius));
        before += radius - length_of(q);
    }
    assert_true(before > 0.0);
    assert_true(worst <= sag * 1.05);
    free_sampled(&both[0]);
    free_sampled(&both[1]);
}

TEST(the_inside_of_a_smooth_sphere_is_not_lifted) {
    FREED_BY(free_sphere) sphere s;
    sampled both[2];
    make_sphere(&s, 6, 1.0);
    for (size_t i = 0; i < s.mesh.triangle_count; ++i) {
        const uint32_t first = s.indices[3 * i];
        s.indices[3 * i] = s.indices[3 * i + 1];
        s.indices[3 * i + 1] = first;
    }
    for (size_t v = 0; v < 3 * s.mesh.vertex_count; ++v) {
        s.normals[v] = -s.normals[v];
    }
    sample_both(&s, 32, both);
    for (size_t i = 0; i < 3 * both[0].samples.count; ++i) {
        assert_near(both[0].samples.positions[i], both[1].samples.positions[i], 1e-6);
    }
    free_sampled(&both[0]);
    free_sampled(&both[1]);
}

TEST(normals_that_are_flat_or_broken_lift_nothing) {
    const float normals[][3] = {{0, 0, 1}, {0, 0, 5},        {0, 0, 0},        {NAN, 0, 1},   {0, 0, -1},
                                {1, 0, 0}, {1e-5f, 0, 1.0f}, {INFINITY, 0, 1}, {0, 0, 1e-38f}};
    for (size_t c = 0; c < sizeof normals / sizeof normals[0]; ++c) {
        quad q;
        make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
        float all[12];
        for (int k = 0; k < 4; ++k) {
            memcpy(all + 3 * k, normals[c], sizeof normals[c]);
        }
        q.mesh.normals = all;
        FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(8, 8, 1), NULL);
        const vsh_texel_samples samples = made.samples;
        assert_int_equal(samples.count, 64);
        for (size_t i = 0; i < samples.count; ++i) {
            assert_true(samples.positions[3 * i + 2] == 0.0);
            assert_true(samples.normals[3 * i + 2] == 1.0f);
        }
    }
}

TEST(a_cube_with_averaged_normals_is_shaded_smooth_but_stays_in_its_place) {
    const float positions[] = {-1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1}; /* one face; normals of the corners */
    const float uvs[] = {0, 0, 1, 0, 1, 1, 0, 1};
    const vsh_mesh mesh = {.positions = positions,
                           .normals = positions,
                           .uvs = uvs,
                           .indices = QUAD_INDICES,
                           .vertex_count = 4,
                           .triangle_count = 2};
    FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(16, 16, 1), NULL);
    const vsh_texel_samples samples = made.samples;
    for (size_t i = 0; i < samples.count; ++i) {
        assert_true(samples.positions[3 * i + 2] == 1.0);
        assert_true(samples.normals[3 * i + 2] > 0.5f);
    }
}

TEST(a_mirrored_transform_keeps_normals_outward) {
    const double transforms[][12] = {{-1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0},
                                     {2, 0, 0, 5, 0, 0, 3, 0, 0, 1, 0, 0},
                                     {0.5, 0.25, 0, 5, 0, 2, 0, 0, 0, 0, 3, 0},
                                     {-1, 0, 0, 5, 0, -2, 0, 0, 0, 0, -1, 0}};
    for (size_t t = 0; t < 4; ++t) {
        for (int smooth = 0; smooth < 2; ++smooth) {
            FREED_BY(free_sphere) sphere s;
            make_sphere(&s, 8, 1.0);
            s.mesh.transform = transforms[t];
            if (!smooth) {
                s.mesh.normals = NULL;
            }
            FREED_BY(free_sampled) sampled made = sample(&s.mesh, 1, size_of(32, 16, 1), NULL);
            const vsh_texel_samples samples = made.samples;
            assert_true(samples.count >= 512 - 32);
            for (size_t i = 0; i < samples.count; ++i) {
                double geometric = 0.0, deciding = 0.0;
                for (size_t k = 0; k < 3; ++k) {
                    const double outward = samples.positions[3 * i + k] - (k == 0 ? 5.0 : 0.0);
                    geometric += outward * (double)samples.geometric_normals[3 * i + k];
                    deciding +=
                        (double)samples.normals[3 * i + k] * (double)samples.geometric_normals[3 * i + k];
                }
                assert_true(geometric > 0.0);
                assert_true(deciding > 0.0);
            }
        }
    }
}

TEST(a_mirrored_transform_keeps_uvs_on_their_corners) {
    const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    q.mesh.transform = mirror;
    FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(8, 8, 1), NULL);
    const vsh_texel_samples samples = made.samples;
    for (size_t i = 0; i < samples.count; ++i) {
        assert_true(fabs(samples.positions[3 * i] + 2.0 * (vsh_texel_column(samples.texels[i]) + 0.5) / 8) <
                    1e-12);
        assert_true(fabs(samples.positions[3 * i + 1] -
                         3.0 * (1.0 - (vsh_texel_row(samples.texels[i]) + 0.5) / 8)) < 1e-12);
    }
}

TEST(bounds_of_charts_are_those_of_their_meshes) {
    quad q[2];
    make_quad(&q[0], 0.0f, 0.0f, 0.5f, 1.0f);
    make_quad(&q[1], 0.5f, 0.0f, 1.0f, 1.0f);
    const double moved[12] = {1, 0, 0, 5, 0, 2, 0, -1, 0, 0, 1, 0};
    q[1].mesh.transform = moved;
    const vsh_mesh meshes[2] = {q[0].mesh, q[1].mesh};
    FREED_BY(free_sampled) sampled made = sample(meshes, 2, size_of(8, 8, 1), NULL);
    vsh_charts_info info;
    vsh_charts_get_info(made.charts, &info);
    const double low[3] = {0.0, -1.0, 0.0}, high[3] = {7.0, 5.0, 0.0};
    assert_memory_equal(info.bounds_min, low, sizeof low);
    assert_memory_equal(info.bounds_max, high, sizeof high);
}
