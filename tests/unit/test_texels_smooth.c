/* Texels of meshes with smooth normals, mirrored ones: where samples are lifted to, and which way they face.
 */
#include "bake/texels.h"
#include "texels_of.h"

static double length_of(const double p[3]) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
}

static void samples_of_a_coarse_smooth_sphere_are_lifted_to_within_its_sag(void **state) {
    (void)state;
    enum { ROWS = 6 };
    const double radius = 2.0;
    sphere s;
    make_sphere(&s, ROWS, radius);
    vsh_charts *lifted = create(&s.mesh, 1, size_of(64, 32, 1), NULL);
    vsh_mesh flat = s.mesh;
    flat.normals = NULL;
    vsh_charts *facets = create(&flat, 1, size_of(64, 32, 1), NULL);
    vsh_texels *lifted_texels = rasterize(lifted), *facet_texels = rasterize(facets);
    const vsh_texel_samples a = vsh_texels_samples(lifted_texels), b = vsh_texels_samples(facet_texels);
    assert_int_equal(a.count, b.count);
    /* The deepest point of a facet lies under the middle of a cell's diagonal: cos of half its angle, which
     * is at most that of the sides' angles together. */
    double sag = 0.0, worst = 0.0, before = 0.0;
    for (size_t i = 0; i < b.count; ++i) {
        sag = fmax(sag, radius - length_of(b.positions + 3 * i));
    }
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
        assert_true(fabs(unit - 1.0) < 1e-6);
        worst = fmax(worst, fabs(length_of(p) - radius));
        before += radius - length_of(q);
    }
    assert_true(before > 0.0);
    assert_true(worst <= sag * 1.05);
    vsh_texels_free(facet_texels);
    vsh_texels_free(lifted_texels);
    vsh_charts_free(facets);
    vsh_charts_free(lifted);
    free_sphere(&s);
}

static void the_inside_of_a_smooth_sphere_is_not_lifted(void **state) {
    (void)state;
    sphere s;
    make_sphere(&s, 6, 1.0);
    for (size_t i = 0; i < s.mesh.triangle_count; ++i) {
        const uint32_t first = s.indices[3 * i];
        s.indices[3 * i] = s.indices[3 * i + 1];
        s.indices[3 * i + 1] = first;
    }
    for (size_t v = 0; v < 3 * s.mesh.vertex_count; ++v) {
        s.normals[v] = -s.normals[v];
    }
    vsh_charts *smooth = create(&s.mesh, 1, size_of(32, 16, 1), NULL);
    s.mesh.normals = NULL;
    vsh_charts *flat = create(&s.mesh, 1, size_of(32, 16, 1), NULL);
    vsh_texels *smooth_texels = rasterize(smooth), *flat_texels = rasterize(flat);
    const vsh_texel_samples a = vsh_texels_samples(smooth_texels), b = vsh_texels_samples(flat_texels);
    assert_int_equal(a.count, b.count);
    for (size_t i = 0; i < 3 * a.count; ++i) {
        assert_true(fabs(a.positions[i] - b.positions[i]) < 1e-6);
    }
    vsh_texels_free(flat_texels);
    vsh_texels_free(smooth_texels);
    vsh_charts_free(flat);
    vsh_charts_free(smooth);
    free_sphere(&s);
}

static void normals_that_are_flat_or_broken_lift_nothing(void **state) {
    (void)state;
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
        vsh_charts *charts = create(&q.mesh, 1, size_of(8, 8, 1), NULL);
        vsh_texels *texels = rasterize(charts);
        const vsh_texel_samples samples = vsh_texels_samples(texels);
        assert_int_equal(samples.count, 64);
        for (size_t i = 0; i < samples.count; ++i) {
            assert_true(samples.positions[3 * i + 2] == 0.0);
            assert_true(samples.normals[3 * i + 2] == 1.0f);
        }
        vsh_texels_free(texels);
        vsh_charts_free(charts);
    }
}

static void a_cube_with_averaged_normals_is_shaded_smooth_but_stays_in_its_place(void **state) {
    (void)state;
    const float positions[] = {-1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1}; /* one face; normals of the corners */
    const float uvs[] = {0, 0, 1, 0, 1, 1, 0, 1};
    const vsh_mesh mesh = {.positions = positions,
                           .normals = positions,
                           .uvs = uvs,
                           .indices = QUAD_INDICES,
                           .vertex_count = 4,
                           .triangle_count = 2};
    vsh_charts *charts = create(&mesh, 1, size_of(16, 16, 1), NULL);
    vsh_texels *texels = rasterize(charts);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    for (size_t i = 0; i < samples.count; ++i) {
        assert_true(samples.positions[3 * i + 2] == 1.0);
        assert_true(samples.normals[3 * i + 2] > 0.5f);
    }
    vsh_texels_free(texels);
    vsh_charts_free(charts);
}

static void a_mirrored_transform_keeps_normals_outward(void **state) {
    (void)state;
    const double transforms[][12] = {{-1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0},
                                     {2, 0, 0, 5, 0, 0, 3, 0, 0, 1, 0, 0},
                                     {0.5, 0.25, 0, 5, 0, 2, 0, 0, 0, 0, 3, 0},
                                     {-1, 0, 0, 5, 0, -2, 0, 0, 0, 0, -1, 0}};
    for (size_t t = 0; t < 4; ++t) {
        for (int smooth = 0; smooth < 2; ++smooth) {
            sphere s;
            make_sphere(&s, 8, 1.0);
            s.mesh.transform = transforms[t];
            if (!smooth) {
                s.mesh.normals = NULL;
            }
            vsh_charts *charts = create(&s.mesh, 1, size_of(32, 16, 1), NULL);
            vsh_texels *texels = rasterize(charts);
            const vsh_texel_samples samples = vsh_texels_samples(texels);
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
            vsh_texels_free(texels);
            vsh_charts_free(charts);
            free_sphere(&s);
        }
    }
}

static void a_mirrored_transform_keeps_uvs_on_their_corners(void **state) {
    (void)state;
    const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    quad q;
    make_quad(&q, 0.0f, 0.0f, 1.0f, 1.0f);
    q.mesh.transform = mirror;
    vsh_charts *charts = create(&q.mesh, 1, size_of(8, 8, 1), NULL);
    vsh_texels *texels = rasterize(charts);
    const vsh_texel_samples samples = vsh_texels_samples(texels);
    for (size_t i = 0; i < samples.count; ++i) {
        assert_true(fabs(samples.positions[3 * i] + 2.0 * (vsh_texel_column(samples.texels[i]) + 0.5) / 8) <
                    1e-12);
        assert_true(fabs(samples.positions[3 * i + 1] -
                         3.0 * (1.0 - (vsh_texel_row(samples.texels[i]) + 0.5) / 8)) < 1e-12);
    }
    vsh_texels_free(texels);
    vsh_charts_free(charts);
}

/* Some tiles are looked at first: they have no samples, some, or all. */
static void bounds_of_charts_are_those_of_their_texels(void **state) {
    (void)state;
    sphere s;
    make_sphere(&s, 12, 1.0);
    static const int32_t sizes[][2] = {{8, 8}, {256, 128}, {64, 1024}, {1024, 1016}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        for (int32_t samples = 1; samples <= 2; ++samples) {
            const vsh_lightmap_options options = size_of(sizes[i][0], sizes[i][1], samples);
            vsh_charts *charts = create(&s.mesh, 1, options, NULL);
            vsh_texels *texels = rasterize(charts);
            const vsh_texel_samples all = vsh_texels_samples(texels);
            double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
            double found_low[3], found_high[3];
            for (size_t k = 0; k < 3 * all.count; ++k) {
                low[k % 3] = fmin(low[k % 3], all.positions[k]);
                high[k % 3] = fmax(high[k % 3], all.positions[k]);
            }
            assert_int_equal(vsh_charts_bounds(charts, NULL, found_low, found_high, NULL), VSH_OK);
            assert_memory_equal(found_low, low, sizeof low);
            assert_memory_equal(found_high, high, sizeof high);
            vsh_texels_free(texels);
            vsh_charts_free(charts);
        }
    }
    free_sphere(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_of_a_coarse_smooth_sphere_are_lifted_to_within_its_sag),
        cmocka_unit_test(the_inside_of_a_smooth_sphere_is_not_lifted),
        cmocka_unit_test(normals_that_are_flat_or_broken_lift_nothing),
        cmocka_unit_test(a_cube_with_averaged_normals_is_shaded_smooth_but_stays_in_its_place),
        cmocka_unit_test(a_mirrored_transform_keeps_normals_outward),
        cmocka_unit_test(a_mirrored_transform_keeps_uvs_on_their_corners),
        cmocka_unit_test(bounds_of_charts_are_those_of_their_texels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
