/* Charts of every kind of mesh: no triangle without a place, none flipped, none over another, no texel of two
 * charts, none nearer than the padding, and no chart stretched beyond the limit. */
#include "unwraps.h"

#ifndef VSH_ASSETS
#error "the folder of sample assets"
#endif

static const double ORIGIN[3] = {0, 0, 0};

/* Unwraps a shape into 256² and 64² and frees it; tells of the larger. */
static vsh_atlas_info unwrap_shape(shape *s, const char *name) {
    const vsh_mesh mesh = shape_mesh(s, name);
    const vsh_unwrap_options large = unwrap_into(256);
    vsh_unwrap_options small = unwrap_into(64);
    small.padding = 1;
    unwrap_well(&mesh, 1, &small, NULL);
    const vsh_atlas_info info = unwrap_well(&mesh, 1, &large, NULL);
    free(s);
    return info;
}

static void a_cube_has_six_charts_of_stretch_1(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_box(s, (double[3]){-1, -1, -1}, (double[3]){1, 1, 1}, ALL_SIDES);
    const vsh_atlas_info info = unwrap_shape(s, "cube");
    assert_int_equal(info.charts, 6);
    assert_true(info.stretch < 1.0001 && info.worst_stretch < 1.0001);
    assert_true(info.covered > 0.6);
}

/* Corners of a box that are shared by its sides: nothing but creases parts them. */
static void a_cube_of_eight_vertices_is_cut_along_its_edges(void **state) {
    (void)state;
    shape *s = shape_new();
    for (int i = 0; i < 8; ++i) {
        shape_vertex(s, i & 1, i >> 1 & 1, i >> 2);
    }
    static const uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (int i = 0; i < 6; ++i) {
        shape_quad(s, quads[i][0], quads[i][1], quads[i][2], quads[i][3]);
    }
    assert_int_equal(unwrap_shape(s, "cube").charts, 6);
}

static void cylinders_and_cones_unroll_without_stretch(void **state) {
    (void)state;
    static const double tube[2][2] = {{1, -2}, {1, 2}}, cone[3][2] = {{2, 0}, {1, 2}, {0.01, 3.98}};
    for (int i = 0; i < 2; ++i) {
        shape *s = shape_new();
        shape_turned(s, ORIGIN, i == 0 ? tube : cone, i == 0 ? 2 : 3, 64);
        const vsh_atlas_info info = unwrap_shape(s, i == 0 ? "tube" : "cone");
        assert_true(info.charts <= 6);
        assert_true(info.stretch < 1.0005 && info.worst_stretch < 1.005);
    }
}

/* Bars of few sides without ends: what shading rounds is one chart, what it does not is cut along its edges.
 */
static void bars_are_cut_along_edges_that_shading_shows(void **state) {
    (void)state;
    for (uint32_t sides = 3; sides <= 6; ++sides) {
        for (int rounded = 0; rounded < 3; ++rounded) {
            shape *s = shape_new();
            float normals[4 * 6 + 4][3];
            for (uint32_t i = 0; i < sides; ++i) { /* each side has vertices of its own */
                for (uint32_t k = 0; k < 4; ++k) {
                    const double turn = 6.283185307179586 / sides, at = turn * (i + (k == 1 || k == 2)),
                                 facing = rounded == 1 ? at : turn * (i + 0.5);
                    shape_vertex(s, 0.1 * cos(at), 0.1 * sin(at), k >= 2 ? 3 : 0);
                    normals[4 * i + k][0] = (float)cos(facing);
                    normals[4 * i + k][1] = (float)sin(facing);
                    normals[4 * i + k][2] = 0;
                }
                shape_quad(s, 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3);
            }
            for (uint32_t k = 0; k < 4; ++k) { /* beside a floor, of which they are a small part */
                shape_vertex(s, 10.0 * (k == 1 || k == 2), 10.0 * (k >= 2), -9);
                normals[4 * sides + k][0] = normals[4 * sides + k][1] = 0;
                normals[4 * sides + k][2] = 1;
            }
            shape_quad(s, 4 * sides, 4 * sides + 1, 4 * sides + 2, 4 * sides + 3);
            vsh_mesh mesh = shape_mesh(s, "bar");
            mesh.normals = rounded == 2 ? NULL : &normals[0][0];
            const vsh_unwrap_options o = unwrap_into(128);
            const vsh_atlas_info info = unwrap_well(&mesh, 1, &o, NULL);
            if (info.charts != 1 + (rounded == 1 ? 1 : sides)) {
                fail_msg("%u sides, %d: %d charts", sides, rounded, (int)info.charts);
            }
            assert_true(info.stretch < 1.01);
            free(s);
        }
    }
}

/* Two leaves of a hinge that is nearly shut, whatever its shading says. */
static void what_is_folded_onto_itself_is_cut(void **state) {
    (void)state;
    for (int shut = 0; shut < 2; ++shut) {
        shape *s = shape_new();
        const double angle = shut ? 2.6 : 2.0, c = -cos(angle), d = sin(angle); /* normals are so far apart */
        shape_quad(s, shape_vertex(s, 0, 0, 0), shape_vertex(s, 0, 0, 1), shape_vertex(s, 1, 0, 1),
                   shape_vertex(s, 1, 0, 0));
        shape_quad(s, shape_vertex(s, 0, 0, 1), shape_vertex(s, 0, 0, 0), shape_vertex(s, c, d, 0),
                   shape_vertex(s, c, d, 1));
        float normals[8][3] = {{0}};
        for (int v = 0; v < 8; ++v) {
            normals[v][0] = 1;
        }
        vsh_mesh mesh = shape_mesh(s, "hinge");
        mesh.normals = &normals[0][0];
        const vsh_unwrap_options o = unwrap_into(64);
        assert_int_equal(unwrap_well(&mesh, 1, &o, NULL).charts, 1 + shut);
        free(s);
    }
}

static void a_sphere_has_few_charts_of_little_stretch(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 3.0, -1.0, 1.0, 64);
    const vsh_atlas_info info = unwrap_shape(s, "ball");
    assert_in_range(info.charts, 2, 24);
    assert_true(info.stretch < 1.05 && info.worst_stretch < 1.1);
}

static void a_torus_is_cut_open(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_grid(s, torus_at, 48, 32, 1, 1, 0);
    const vsh_atlas_info info = unwrap_shape(s, "torus");
    assert_in_range(info.charts, 2, 32);
    assert_true(info.stretch < 1.05);
}

static void a_moebius_strip_is_cut_open(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_grid(s, moebius_at, 60, 6, 1, 0, 1);
    assert_in_range(unwrap_shape(s, "strip").charts, 1, 12);
}

/* Twelve cards around one edge. */
static void a_fan_of_triangles_at_one_edge_has_places(void **state) {
    (void)state;
    shape *s = shape_new();
    const uint32_t a = shape_vertex(s, 0, 0, 0), b = shape_vertex(s, 0, 0, 2);
    for (int i = 0; i < 12; ++i) {
        const uint32_t c = shape_vertex(s, cos(0.5 * i), sin(0.5 * i), 1);
        shape_triangle(s, i % 2 ? a : b, i % 2 ? b : a, c);
    }
    unwrap_shape(s, "fan");
}

/* One vertex with all of a wavy cone's triangles: eliminated too early, it would fill the equations. */
static void a_tip_of_thousands_of_triangles_takes_no_time(void **state) {
    (void)state;
    enum { AROUND = 30000 };
    shape *s = shape_new();
    const uint32_t tip = shape_vertex(s, 0, 0, 1);
    for (int i = 0; i < AROUND; ++i) {
        const double angle = 6.283185307179586 * i / AROUND;
        shape_vertex(s, cos(angle), sin(angle), 0.1 * sin(7 * angle));
    }
    for (uint32_t i = 0; i < AROUND; ++i) {
        shape_triangle(s, tip, 1 + i, 1 + (i + 1) % AROUND);
    }
    const vsh_mesh mesh = shape_mesh(s, "tip");
    const vsh_unwrap_options o = unwrap_into(256);
    vsh_run run = vsh_run_default();
    run.memory_limit = 100000000;
    vsh_atlas *atlas = NULL;
    vsh_error error = {0};
    if (vsh_unwrap(&mesh, 1, &o, &run, &atlas, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    assert_in_range(vsh_atlas_chart_count(atlas), 1, 16);
    vsh_atlas_free(atlas);
    free(s);
}

/* Three copies of a bent sheet, one of which looks the other way: each hangs together by itself. */
static void copies_of_triangles_have_places_of_their_own(void **state) {
    (void)state;
    shape *s = shape_new();
    for (int copy = 0; copy < 3; ++copy) {
        const size_t first = s->triangles;
        for (uint32_t y = 0; y <= 8; ++y) {
            for (uint32_t x = 0; x <= 8; ++x) {
                shape_vertex(s, x, y, 0.05 * x * x);
            }
        }
        const uint32_t base = (uint32_t)copy * 81;
        for (uint32_t y = 0; y < 8; ++y) {
            for (uint32_t x = 0; x < 8; ++x) {
                const uint32_t v = base + 9 * y + x;
                shape_quad(s, v, v + 1, v + 10, v + 9);
            }
        }
        if (copy == 1) {
            shape_turn(s, first);
        }
    }
    assert_int_equal(unwrap_shape(s, "copies").charts, 3);
}

static void a_soup_of_random_triangles_has_places(void **state) {
    (void)state;
    shape *s = shape_new();
    uint64_t seed = 5;
    for (uint32_t i = 0; i < 120; ++i) { /* few vertices, so that they meet in every way */
        shape_vertex(s, next_number(&seed), next_number(&seed), next_number(&seed));
    }
    for (int i = 0; i < 400; ++i) {
        const uint32_t v[3] = {(uint32_t)(120 * next_number(&seed)), (uint32_t)(120 * next_number(&seed)),
                               (uint32_t)(120 * next_number(&seed))};
        shape_triangle(s, v[0], v[1], v[2]);
    }
    const vsh_mesh mesh = shape_mesh(s, "soup");
    vsh_unwrap_options o = unwrap_into(512);
    o.padding = 2;
    assert_true(unwrap_well(&mesh, 1, &o, NULL).charts > 100);
    free(s);
}

/* So rough that many an edge is a crease that ends within a chart: a slit that must not open inside out. */
static void rough_balls_lie_over_themselves_nowhere(void **state) {
    (void)state;
    for (uint64_t seed = 1; seed <= 6; ++seed) {
        uint64_t random = seed;
        shape *s = shape_new();
        shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 60);
        for (size_t v = 0; v < s->vertices; ++v) {
            const float k = 1.0F + (0.01F + 0.004F * (float)seed) * (float)next_number(&random);
            for (int i = 0; i < 3; ++i) {
                s->positions[v][i] *= k;
            }
        }
        const vsh_mesh mesh = shape_mesh(s, "rough");
        const vsh_unwrap_options o = unwrap_into(512);
        assert_true(unwrap_well(&mesh, 1, &o, NULL).stretch < 1.05);
        free(s);
    }
}

/* Points, lines, slivers of a millionth of their length, and a triangle among them. */
static void triangles_without_area_have_no_chart_and_slivers_have_one(void **state) {
    (void)state;
    shape *s = shape_new();
    const uint32_t a = shape_vertex(s, 0, 0, 0), b = shape_vertex(s, 1, 0, 0), c = shape_vertex(s, 0, 1, 0),
                   middle = shape_vertex(s, 0.5, 0, 0), thin = shape_vertex(s, 0.3, 1e-6, 0);
    shape_triangle(s, a, b, c);
    shape_triangle(s, a, a, a);
    shape_triangle(s, a, middle, b);
    shape_triangle(s, b, a, b);
    shape_triangle(s, a, b, thin);
    shape_triangle(s, c, thin, b);
    const vsh_mesh mesh = shape_mesh(s, "slivers");
    const vsh_unwrap_options o = unwrap_into(128);
    assert_int_equal(unwrap_well(&mesh, 1, &o, NULL).flat_triangles, 3);
    free(s);
}

static void a_triangle_alone_fills_half_of_its_page(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_triangle(s, shape_vertex(s, 0, 0, 0), shape_vertex(s, 1, 0, 0), shape_vertex(s, 0, 1, 0));
    const vsh_atlas_info info = unwrap_shape(s, "triangle");
    assert_int_equal(info.charts, 1);
    assert_true(info.covered > 0.48);
}

/* Sizes from 1e-30 to 1e30 units, and far from the origin. */
static void units_do_not_matter(void **state) {
    (void)state;
    for (int i = 0; i < 5; ++i) {
        static const double sizes[5] = {1e-30, 1e-3, 1, 1e6, 1e30};
        const double k = sizes[i], transform[12] = {k, 0, 0, 5 * k, 0, k, 0, 0, 0, 0, k, -7 * k};
        shape *s = shape_new();
        shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 24);
        vsh_mesh mesh = shape_mesh(s, "ball");
        mesh.transform = transform;
        const vsh_unwrap_options o = unwrap_into(128);
        const vsh_atlas_info info = unwrap_well(&mesh, 1, &o, NULL);
        mesh.transform = NULL;
        const vsh_atlas_info one = unwrap_well(&mesh, 1, &o, NULL);
        assert_int_equal(info.charts, one.charts);
        assert_true(fabs(info.texels_per_unit * k / one.texels_per_unit - 1) < 0.05);
        free(s);
    }
}

/* Counts the quads whose triangles are in two charts. */
static size_t count_parted_quads(const shape *s) {
    const vsh_mesh mesh = shape_mesh(s, "torus");
    const vsh_unwrap_options o = unwrap_into(256);
    vsh_atlas *atlas = NULL;
    unwrap_well(&mesh, 1, &o, &atlas);
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, 0);
    size_t apart = 0, borders = 0;
    for (size_t q = 0; q < mesh.triangle_count / 2; ++q) {
        apart += m.charts[2 * q] != m.charts[2 * q + 1];
        borders += q > 0 && m.charts[2 * q] != m.charts[2 * q - 2];
    }
    assert_true(borders > 0);
    vsh_atlas_free(atlas);
    return apart;
}

static void triangles_of_a_quad_stay_together(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_grid(s, torus_at, 40, 24, 1, 1, 0);
    assert_int_equal(count_parted_quads(s), 0);
    free(s);
}

/* Modellers often write faces with vertices of their own. A bend below a crease never splits a quad,
 * whichever diagonal it has. */
static void quads_with_vertices_of_their_own_stay_together(void **state) {
    (void)state;
    shape *s = shape_new(), *faces = shape_new();
    uint64_t random = 3;
    shape_grid(s, torus_at, 40, 24, 1, 1, 0);
    for (size_t v = 0; v < s->vertices; ++v) {
        for (int i = 0; i < 3; ++i) {
            s->positions[v][i] += 0.08F * (float)next_number(&random);
        }
    }
    for (size_t q = 0; q < s->triangles / 2; ++q) {
        const uint32_t *a = s->indices[2 * q], *b = s->indices[2 * q + 1], of[4] = {a[0], a[1], a[2], b[2]};
        const uint32_t first = (uint32_t)faces->vertices;
        for (int k = 0; k < 4; ++k) {
            const float *p = s->positions[of[k]];
            shape_vertex(faces, (double)p[0], (double)p[1], (double)p[2]);
        }
        shape_quad(faces, first, first + 1, first + 2, first + 3);
    }
    assert_int_equal(count_parted_quads(faces), 0);
    free(faces);
    free(s);
}

/* A rectangle's borders are a tenth of a texel beyond centres of texels: what is read within it is nearly all
 * of its own texels, and no texel's centre is on an edge of the surface. */
static void borders_of_rectangles_are_just_beyond_centres_of_texels(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_box(s, (double[3]){0, 0, 0}, (double[3]){1, 2, 3.3}, ALL_SIDES);
    const vsh_mesh mesh = shape_mesh(s, "box");
    const vsh_unwrap_options o = unwrap_into(128);
    vsh_atlas *atlas = NULL;
    unwrap_well(&mesh, 1, &o, &atlas);
    const vsh_atlas_mesh m = vsh_atlas_mesh_view(atlas, 0);
    for (size_t i = 0; i < 2 * m.vertex_count; ++i) {
        const double texel = (double)m.uvs[i] * 128 - 0.5;
        assert_true(fabs(fabs(texel - floor(texel + 0.5)) - 0.1) < 1e-4);
    }
    vsh_atlas_free(atlas);
    free(s);
}

static void the_sample_assets_unwrap(void **state) {
    (void)state;
    static const struct {
        const char *name;
        int32_t size;
        double covered;
    } assets[] = {{"cloister.glb", 1024, 0.70},
                  {"smooth.glb", 512, 0.60},
                  {"thin.glb", 512, 0.50},
                  {"seeds_floor.obj", 256, 0.5}};
    for (size_t a = 0; a < sizeof assets / sizeof assets[0]; ++a) {
        char path[512];
        snprintf(path, sizeof path, VSH_ASSETS "/%s", assets[a].name);
        vsh_model *model = NULL;
        vsh_error error = {0};
        if (vsh_model_read(path, NULL, &model, &error) != VSH_OK) {
            fail_msg("%s", error.message);
        }
        const size_t count = vsh_model_mesh_count(model);
        vsh_mesh *meshes = calloc(count, sizeof *meshes);
        assert_non_null(meshes);
        for (size_t m = 0; m < count; ++m) {
            meshes[m] = vsh_model_mesh(model, m, -1);
        }
        const vsh_unwrap_options o = unwrap_into(assets[a].size);
        const vsh_atlas_info info = unwrap_well(meshes, count, &o, NULL);
        if (info.covered < assets[a].covered || info.stretch > 1.05) {
            fail_msg("%s: %g covered, stretch %g", path, info.covered, info.stretch);
        }
        free(meshes);
        vsh_model_free(model);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cube_has_six_charts_of_stretch_1),
        cmocka_unit_test(a_cube_of_eight_vertices_is_cut_along_its_edges),
        cmocka_unit_test(cylinders_and_cones_unroll_without_stretch),
        cmocka_unit_test(bars_are_cut_along_edges_that_shading_shows),
        cmocka_unit_test(what_is_folded_onto_itself_is_cut),
        cmocka_unit_test(a_sphere_has_few_charts_of_little_stretch),
        cmocka_unit_test(a_torus_is_cut_open),
        cmocka_unit_test(a_moebius_strip_is_cut_open),
        cmocka_unit_test(a_fan_of_triangles_at_one_edge_has_places),
        cmocka_unit_test(a_tip_of_thousands_of_triangles_takes_no_time),
        cmocka_unit_test(copies_of_triangles_have_places_of_their_own),
        cmocka_unit_test(a_soup_of_random_triangles_has_places),
        cmocka_unit_test(rough_balls_lie_over_themselves_nowhere),
        cmocka_unit_test(triangles_without_area_have_no_chart_and_slivers_have_one),
        cmocka_unit_test(a_triangle_alone_fills_half_of_its_page),
        cmocka_unit_test(units_do_not_matter),
        cmocka_unit_test(triangles_of_a_quad_stay_together),
        cmocka_unit_test(quads_with_vertices_of_their_own_stay_together),
        cmocka_unit_test(borders_of_rectangles_are_just_beyond_centres_of_texels),
        cmocka_unit_test(the_sample_assets_unwrap),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
