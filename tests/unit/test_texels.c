/* Texels: places in UV space, coverage, what is refused and counted, and what normals do. */
#include "lightmap/texels.h"
#include "testing.h"
#include "texels_of.h"

/* The charts of meshes, their texels and samples. */
typedef struct sampled {
    vsh_charts *charts;
    vsh_charts_info info;
    texel_list *texels;
    texel_samples samples;
} sampled;

static sampled sample(const vsh_mesh *meshes, size_t count, vsh_lightmap_options options,
                      vsh_uv_report *reports) {
    sampled s = {.charts = NULL};
    assert_ok(vsh_charts_create(meshes, count, &options, NULL, reports, &s.charts, &failure));
    vsh_charts_get_info(s.charts, &s.info);
    s.texels = texels_from(s.charts);
    s.samples = samples_of(s.texels);
    return s;
}

/* One triangle, whose corners are 0, 1 and 2. */
static vsh_mesh triangle_mesh(const float positions[9], const float uvs[6]) {
    return mesh_of_arrays(NULL, positions, uvs, 3, QUAD_INDICES, 1);
}

static void free_sampled(sampled *s) {
    texel_list_free(s->texels);
    vsh_charts_free(s->charts);
}

TEST(a_quad_over_the_unit_square_puts_every_texel_at_its_analytic_place) {
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    const int32_t sizes[][3] = {{16, 16, 1}, {37, 11, 1}, {1, 1, 1}, {8, 24, 2}, {13, 9, 3}, {3, 2, 16}};
    static const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (size_t s = 0; s < 2 * COUNT_OF(sizes); ++s) {
        const int32_t w = sizes[s / 2][0], h = sizes[s / 2][1], n = sizes[s / 2][2];
        const double side = s % 2 ? -1.0 : 1.0;
        q.mesh.transform = s % 2 ? mirror : NULL;
        vsh_uv_report report;
        FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(w, h, n), &report);
        assert_int_equal(made.info.covered, w * h);
        assert_int_equal(made.info.samples, w * h * n * n);
        assert_true(report.overlap_texels == 0 && report.overlap_triangles == 0);
        assert_true(report.outside_triangles == 0 && report.degenerate_triangles == 0);
        FREED double *sum = calloc((size_t)(w * h), 2 * sizeof *sum);
        FREED int *count = calloc((size_t)(w * h), sizeof *count);
        for (size_t i = 0; i < made.samples.count; ++i) {
            const size_t texel = vsh_texel_place(made.samples.texels[i], w);
            const double *at = made.samples.positions + 3 * i, p[3] = {side * at[0], at[1], at[2]};
            ++count[texel];
            sum[2 * texel] += p[0];
            sum[2 * texel + 1] += p[1];
            assert_true(p[2] == 0.0 && made.samples.normals[3 * i + 2] == 1.0f);
            assert_true(made.samples.geometric_normals[3 * i + 2] == 1.0f);
            const double column = vsh_texel_column(made.samples.texels[i]),
                         row = vsh_texel_row(made.samples.texels[i]);
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
            const uint32_t corners[3] = {0, (uint32_t)(k + 1), (uint32_t)((k + 1) % SPOKES + 1)};
            memcpy(indices + 3 * k, corners, sizeof corners);
        }
        for (int k = 0; k <= SPOKES; ++k) {
            positions[3 * k] = uvs[2 * k];
            positions[3 * k + 1] = uvs[2 * k + 1];
        }
        const vsh_mesh mesh = mesh_of_arrays("fan", positions, uvs, SPOKES + 1, indices, SPOKES);
        vsh_uv_report report;
        FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(16, 16, 3), &report);
        assert_int_equal(made.info.samples, 16 * 16 * 9);
        assert_true(report.overlap_texels == 0 && report.overlap_triangles == 0);
        assert_int_equal(report.outside_triangles, SPOKES);
    }
}

TEST(a_chart_that_does_not_fit_has_border_texels_near_and_inside_it) {
    const double low = (double)0.3f, high = (double)0.7f, texel = 1.0 / 16.0;
    quad q;
    make_quad(&q, 4.0f / 16.0f, 4.0f / 16.0f, 12.0f / 16.0f, 12.0f / 16.0f);
    FREED_BY(free_sampled) sampled fits = sample(&q.mesh, 1, size_of(16, 16, 1), NULL);
    assert_int_equal(fits.info.covered, 64);
    /* From 4.8 to 11.2 of 16: the texels 4 and 11 are touched, their centres and samples (n = 2) are not. */
    make_quad(&q, 0.3f, 0.3f, 0.7f, 0.7f);
    for (int32_t supersample = 1; supersample <= 2; ++supersample) {
        FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(16, 16, supersample), NULL);
        assert_int_equal(made.info.covered, 64);
        int border = 0;
        for (size_t i = 0; i < made.samples.count; ++i) {
            const double x = made.samples.positions[3 * i] / 2.0, y = made.samples.positions[3 * i + 1] / 3.0;
            const double u = (vsh_texel_column(made.samples.texels[i]) + 0.5) / 16.0,
                         v = 1.0 - (vsh_texel_row(made.samples.texels[i]) + 0.5) / 16;
            assert_true(x >= low - 1e-7 && x <= high + 1e-7);
            if (supersample == 1 && !(u > low && u < high && v > low && v < high)) {
                ++border;
                /* a quarter of a texel inside along sides, a sixth at corners, where a triangle is half a
                 * square */
                assert_true(fabs(x - fmin(fmax(u, low), high)) < 0.5 * texel);
                assert_true(fabs(y - fmin(fmax(v, low), high)) < 0.5 * texel);
                assert_true(fmin(fmin(x - low, high - x), fmin(y - low, high - y)) > 0.16 * texel);
            }
        }
        assert_int_equal(border, supersample == 1 ? 28 : 0);
    }
}

TEST(a_triangle_smaller_than_a_texel_still_has_one) {
    const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const float uvs[] = {0.51f, 0.51f, 0.512f, 0.51f, 0.51f, 0.512f};
    const vsh_mesh mesh = triangle_mesh(positions, uvs);
    FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(8, 8, 1), NULL);
    assert_int_equal(made.samples.count, 1);
    assert_int_equal(made.samples.texels[0], vsh_texel(4, 3));
    const double *p = made.samples.positions;
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
        assert_int_equal(made.samples.count, 81);
        for (size_t i = 0; i < made.samples.count; ++i) {
            assert_true(made.samples.positions[3 * i + 2] == (first == 0 ? 0.0 : 7.0));
        }
    }
}

TEST(huge_uvs_are_clipped_and_counted) {
    const float huge[] = {1e30f, 3e38f, 1e10f, 1e6f, 300.0f, 1.1f};
    for (size_t k = 0; k < COUNT_OF(huge); ++k) {
        const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
        const float uvs[] = {-huge[k], -huge[k], huge[k], -huge[k], 0.5f, huge[k]};
        const vsh_mesh mesh = triangle_mesh(positions, uvs);
        vsh_uv_report report;
        FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(64, 32, 2), &report);
        assert_int_equal(report.outside_triangles, 1);
        assert_true(made.samples.count > 0 && made.samples.count <= 64 * 32 * 4);
        for (size_t i = 0; i < made.samples.count; ++i) {
            const double *p = made.samples.positions + 3 * i;
            assert_true(vsh_texel_column(made.samples.texels[i]) < 64 &&
                        vsh_texel_row(made.samples.texels[i]) < 32);
            assert_true(p[0] >= 0.0 && p[1] >= 0.0 && p[0] + p[1] <= 1.0 + 1e-9 && p[2] == 0.0);
        }
    }
}

TEST(triangles_without_area_are_skipped_and_counted_in_uv_space) {
    const float positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0, 0};
    const float uvs[] = {0, 0, 1, 0, 0, 1, 0.5f, 0.5f};
    /* A good one; no area in the world; no area in UV space (corners 1, 2 and 3 lie on a line there). */
    const uint32_t indices[] = {0, 1, 2, 0, 1, 3, 1, 3, 2, 0, 0, 0};
    const vsh_mesh mesh = mesh_of_arrays(NULL, positions, uvs, 4, indices, 4);
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
    assert_refused(&q.mesh, size_of(0, 8, 1), VSH_ERROR_ARGUMENT, "width 0 is out of range", "65536");
    assert_refused(&q.mesh, size_of(8, 1000000, 1), VSH_ERROR_ARGUMENT, "height 1e+06 is out of range",
                   "65536");
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

/* Of any number of samples and threads. */
TEST(overlaps_within_and_between_objects_are_counted_and_the_worst_pair_is_named) {
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
    for (int n = 1; n <= 4; ++n) {
        const vsh_lightmap_options options = size_of(64, 64, 1 + n % 2);
        const vsh_run run = run_on(n);
        vsh_uv_report r[COUNT];
        OWNED(vsh_charts) *charts = NULL;
        assert_ok(vsh_charts_create(meshes, COUNT, &options, &run, r, &charts, &failure));
        vsh_charts_info info;
        vsh_charts_get_info(charts, &info);
        assert_int_equal(info.samples, (32 * 32 + 32 * 64) * options.supersample * options.supersample);
        assert_true(r[1].overlap_texels == 32 * 16 && r[1].other_texels == 0);
        assert_int_equal(r[2].overlap_texels, 0); /* it shares an edge with the first */
        assert_true(r[3].overlap_texels == (16 + 32) * 32 && r[3].other_texels == (16 + 32) * 32);
        assert_true(r[3].other_mesh == 2 && r[3].other_mesh_texels == 32 * 32);
        assert_true(r[4].overlap_triangles == 2 && r[4].other_texels == 4 * 4);
        assert_true(r[4].other_mesh == SIZE_MAX && r[4].other_mesh_texels == 0);
    }
}

/* --- smooth normals and mirrors: where samples are lifted to, and which way they face */

static void free_both(sampled both[2]) {
    free_sampled(&both[0]);
    free_sampled(&both[1]);
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
    const texel_samples a = both[0].samples, b = both[1].samples;
    /* A facet is deepest below the middle of its cell's diagonal. */
    double sag = 0.0, worst = 0.0, before = 0.0;
    for (size_t i = 0; i < a.count; ++i) {
        const double *p = a.positions + 3 * i, *q = b.positions + 3 * i;
        const float *n = a.normals + 3 * i, *g = b.normals + 3 * i;
        double height = 0.0, cosine = 0.0, unit = 0.0;
        for (int k = 0; k < 3; ++k) {
            height += (p[k] - q[k]) * (double)g[k];
            cosine += (double)n[k] * p[k] / length3(p);
            unit += (double)n[k] * (double)n[k];
        }
        assert_true(height > -1e-6);
        assert_true(cosine > 0.98);
        assert_near(unit, 1.0, 1e-6);
        sag = fmax(sag, radius - length3(q));
        worst = fmax(worst, fabs(length3(p) - radius));
        before += radius - length3(q);
    }
    assert_true(before > 0.0);
    assert_true(worst <= sag * 1.05);
    free_both(both);
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
    free_both(both);
}

TEST(normals_that_are_flat_or_broken_lift_nothing) {
    const float normals[][3] = {{0, 0, 1}, {0, 0, 5},        {0, 0, 0},        {NAN, 0, 1},   {0, 0, -1},
                                {1, 0, 0}, {1e-5f, 0, 1.0f}, {INFINITY, 0, 1}, {0, 0, 1e-38f}};
    for (size_t c = 0; c < COUNT_OF(normals); ++c) {
        quad q;
        make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
        float all[12];
        for (int k = 0; k < 4; ++k) {
            memcpy(all + 3 * k, normals[c], sizeof normals[c]);
        }
        q.mesh.normals = all;
        FREED_BY(free_sampled) sampled made = sample(&q.mesh, 1, size_of(8, 8, 1), NULL);
        assert_int_equal(made.samples.count, 64);
        for (size_t i = 0; i < made.samples.count; ++i) {
            assert_true(made.samples.positions[3 * i + 2] == 0.0);
            assert_true(made.samples.normals[3 * i + 2] == 1.0f);
        }
    }
}

TEST(a_cube_with_averaged_normals_is_shaded_smooth_but_stays_in_its_place) {
    const float positions[] = {-1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1}; /* one face; normals of the corners */
    vsh_mesh mesh = quad_mesh("face", positions, QUAD_UVS);
    mesh.normals = positions;
    FREED_BY(free_sampled) sampled made = sample(&mesh, 1, size_of(16, 16, 1), NULL);
    for (size_t i = 0; i < made.samples.count; ++i) {
        assert_true(made.samples.positions[3 * i + 2] == 1.0);
        assert_true(made.samples.normals[3 * i + 2] > 0.5f);
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
            assert_true(made.samples.count >= 512 - 32);
            for (size_t i = 0; i < made.samples.count; ++i) {
                double geometric = 0.0, deciding = 0.0;
                for (size_t k = 0; k < 3; ++k) {
                    const double outward = made.samples.positions[3 * i + k] - (k == 0 ? 5.0 : 0.0);
                    geometric += outward * (double)made.samples.geometric_normals[3 * i + k];
                    deciding += (double)made.samples.normals[3 * i + k] *
                                (double)made.samples.geometric_normals[3 * i + k];
                }
                assert_true(geometric > 0.0);
                assert_true(deciding > 0.0);
            }
        }
    }
}

TEST(charts_have_the_bounds_of_their_meshes) {
    quad q[2];
    make_quad(&q[0], 0.0f, 0.0f, 0.5f, 1.0f);
    make_quad(&q[1], 0.5f, 0.0f, 1.0f, 1.0f);
    const double moved[12] = {1, 0, 0, 5, 0, 2, 0, -1, 0, 0, 1, 0};
    q[1].mesh.transform = moved;
    const vsh_mesh meshes[2] = {q[0].mesh, q[1].mesh};
    FREED_BY(free_sampled) sampled made = sample(meshes, 2, size_of(8, 8, 1), NULL);
    const double low[3] = {0.0, -1.0, 0.0}, high[3] = {7.0, 5.0, 0.0};
    assert_memory_equal(made.info.bounds_min, low, sizeof low);
    assert_memory_equal(made.info.bounds_max, high, sizeof high);
}
