/* vsh_mesh_check() against solids whose edges, area and bounds are known. */
#include "geometry/mesh.h"
#include "handles.h"
#include "testing.h"

/* The unit cube, anticlockwise from outside: corner i is at (i & 1, i >> 1 & 1, i >> 2). The last two
 * triangles are its top (z = 1). */
static const float cube_positions[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                           {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
static const uint32_t cube_indices[12][3] = {{0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                                             {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2},
                                             {1, 3, 7}, {1, 7, 5}, {4, 5, 7}, {4, 7, 6}};

static vsh_mesh cube(void) {
    return mesh_of_arrays("cube", cube_positions[0], NULL, 8, cube_indices[0], 12);
}

static vsh_mesh_report check(const vsh_mesh *mesh) {
    vsh_mesh_report report;
    assert_ok(vsh_mesh_check(mesh, &report, &failure));
    return report;
}

enum { MOST = 36 };

/* Vertices and triangles that a case adds to or changes in those of the cube. */
typedef struct shape {
    float positions[MOST][3];
    uint32_t indices[MOST][3];
    size_t vertices, triangles;
} shape;

static void keep(shape *s) {}

static void take_off_top(shape *s) {
    s->triangles = 10;
}

static void flip_top(shape *s) {
    for (int i = 10; i < 12; ++i) {
        s->indices[i][1] = cube_indices[i][2];
        s->indices[i][2] = cube_indices[i][1];
    }
}

/* Every triangle with vertices of its own, every other zero negative. */
static void split(shape *s) {
    for (uint32_t i = 0; i < 36; ++i) {
        for (int k = 0; k < 3; ++k) {
            const float value = cube_positions[cube_indices[i / 3][i % 3]][k];
            s->positions[i][k] = value == 0.0F && i % 2 == 1 ? -0.0F : value;
        }
        s->indices[i / 3][i % 3] = i;
    }
    s->vertices = 36;
}

/* Another cube that shares the edge x = y = 1: four triangles meet there, two each way. */
static void touch(shape *s) {
    for (int i = 0; i < 24; ++i) {
        s->positions[8 + i / 3][i % 3] = cube_positions[i / 3][i % 3] + (i % 3 < 2 ? 1.0F : 0.0F);
    }
    for (int i = 0; i < 36; ++i) {
        s->indices[12 + i / 3][i % 3] = cube_indices[i / 3][i % 3] + 8;
    }
    s->vertices = 16;
    s->triangles = 24;
}

/* Far away on a line, an edge there and back, a point. */
static void add_degenerate(shape *s) {
    static const uint32_t flat[3][3] = {{8, 9, 10}, {3, 3, 5}, {7, 7, 7}};
    s->positions[8][0] = 10.0F;
    s->positions[9][0] = 10.1F;
    s->positions[10][0] = 2.0F * s->positions[9][0] - s->positions[8][0];
    memcpy(s->indices + 12, flat, sizeof flat);
    s->vertices = 11;
    s->triangles = 15;
}

/* The top's front edge is cut at (1/2, 0, 1), that of the front is not. */
static void cut_edge(shape *s) {
    static const uint32_t top[3][3] = {{4, 8, 7}, {8, 5, 7}, {4, 7, 6}};
    memcpy(s->positions[8], (float[3]){0.5F, 0.0F, 1.0F}, sizeof s->positions[8]);
    memcpy(s->indices + 10, top, sizeof top);
    s->vertices = 9;
    s->triangles = 13;
}

static void cut_edge_and_join(shape *s) {
    cut_edge(s);
    memcpy(s->indices[s->triangles++], (uint32_t[3]){4, 5, 8}, sizeof s->indices[0]);
}

TEST(edges_area_and_bounds_of_cubes_are_right) {
    static const struct {
        const char *name;
        void (*change)(shape *s);
        size_t open_edges, flipped_edges, degenerate_triangles;
        double area, far;
    } cases[] = {
        {"a cube", keep, 0, 0, 0, 6.0, 1.0},
        {"without its top", take_off_top, 4, 0, 0, 5.0, 1.0},
        {"with its top flipped", flip_top, 0, 4, 0, 6.0, 1.0},
        {"of split vertices", split, 0, 0, 0, 6.0, 1.0},
        {"touching another", touch, 0, 0, 0, 12.0, 2.0},
        {"with degenerate triangles", add_degenerate, 0, 0, 3, 6.0, 1.0},
        {"with a cut edge", cut_edge, 3, 0, 0, 6.0, 1.0},
        {"with a cut edge that a flat triangle joins", cut_edge_and_join, 0, 0, 1, 6.0, 1.0},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        shape s = {.vertices = 8, .triangles = 12};
        memcpy(s.positions, cube_positions, sizeof cube_positions);
        memcpy(s.indices, cube_indices, sizeof cube_indices);
        cases[i].change(&s);
        const vsh_mesh mesh =
            mesh_of_arrays(NULL, s.positions[0], NULL, s.vertices, s.indices[0], s.triangles);
        const vsh_mesh_report report = check(&mesh);
        assert_int_equal(report.open_edges, cases[i].open_edges);
        assert_int_equal(report.flipped_edges, cases[i].flipped_edges);
        assert_int_equal(report.degenerate_triangles, cases[i].degenerate_triangles);
        assert_near(report.area, cases[i].area, 0.0);
        for (int k = 0; k < 3; ++k) {
            assert_near(report.bounds_min[k], 0.0, 0.0);
            assert_near(report.bounds_max[k], k < 2 ? cases[i].far : 1.0, 0.0);
        }
    }
}

TEST(an_empty_mesh_has_empty_bounds) {
    vsh_mesh mesh = cube();
    mesh.triangle_count = 0;
    const vsh_mesh_report report = check(&mesh);
    assert_true(report.bounds_min[0] > report.bounds_max[0]);
    assert_int_equal(report.open_edges, 0);
    const vsh_mesh nothing = {0};
    assert_true(check(&nothing).bounds_min[2] > check(&nothing).bounds_max[2]);
}

/* A quarter turn about z, scaled by (2, 3, 4), moved by (100, 200, 300). */
static const double turned[12] = {0, -3, 0, 100, 2, 0, 0, 200, 0, 0, 4, 300};

TEST(area_and_bounds_are_of_the_world) {
    vsh_mesh mesh = cube();
    mesh.transform = turned;
    const vsh_mesh_report report = check(&mesh);
    assert_near(report.area, 2.0 * (6.0 + 12.0 + 8.0), 1e-12);
    const double lowest[3] = {97, 200, 300}, highest[3] = {100, 202, 304};
    for (int k = 0; k < 3; ++k) {
        assert_near(report.bounds_min[k], lowest[k], 0.0);
        assert_near(report.bounds_max[k], highest[k], 0.0);
    }
}

/* Sum of a · (b × c) / 6 over the triangles: the volume, positive where they are anticlockwise from outside.
 */
static double volume(const vsh_mesh *mesh) {
    double sum = 0.0;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(mesh, i, corner);
        sum += vshi_dot(corner[0], vshi_cross(corner[1], corner[2])) / 6.0;
    }
    return sum;
}

TEST(a_mirrored_transform_keeps_the_outside_outside) {
    const double mirrored[12] = {-2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0};
    vsh_mesh mesh = cube();
    assert_near(volume(&mesh), 1.0, 1e-12);
    mesh.transform = mirrored;
    assert_near(volume(&mesh), 24.0, 1e-12);
    vshi_vec corner[3];
    uint32_t vertex[3];
    vshi_mesh_triangle_of(&mesh, 2, corner, vertex);
    for (int k = 0; k < 3; ++k) {
        assert_near(corner[k].x, -2.0 * (double)cube_positions[vertex[k]][0], 0.0);
    }
    assert_int_equal(check(&mesh).flipped_edges, 0);
}

static void refused(const vsh_mesh *mesh, vsh_result code, const char *part, const char *other) {
    vsh_mesh_report report = {.open_edges = 77};
    assert_int_equal(vsh_mesh_check(mesh, &report, &failure), code);
    assert_int_equal(failure.code, code);
    assert_int_equal(report.open_edges, 77);
    assert_that(strstr(failure.message, part) != NULL && strstr(failure.message, other) != NULL,
                "'%s' does not name %s and %s", failure.message, part, other);
}

TEST(bad_vertices_indices_and_transforms_are_refused_by_number) {
    float positions[8][3];
    uint32_t indices[12][3];
    double transform[12];
    vsh_mesh mesh = cube();
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    mesh.positions = positions[0];
    for (size_t i = 0; i < 3; ++i) {
        memcpy(positions, cube_positions, sizeof positions);
        positions[6][i] = bad[i];
        refused(&mesh, VSH_ERROR_INPUT, "'cube'", "vertex 6");
    }
    mesh.positions = NULL;
    refused(&mesh, VSH_ERROR_ARGUMENT, "'cube'", "positions");
    mesh = cube();
    mesh.indices = indices[0];
    memcpy(indices, cube_indices, sizeof indices);
    indices[7][2] = 99;
    refused(&mesh, VSH_ERROR_INPUT, "triangle 7", "99");
    indices[7][2] = UINT32_MAX;
    refused(&mesh, VSH_ERROR_INPUT, "triangle 7", "4294967295");
    mesh.indices = NULL;
    refused(&mesh, VSH_ERROR_ARGUMENT, "'cube'", "indices");
    mesh = cube();
    mesh.transform = transform;
    memcpy(transform, turned, sizeof transform);
    transform[3] = NAN;
    refused(&mesh, VSH_ERROR_INPUT, "transform", "row 0 column 3");
    memcpy(transform, turned, sizeof transform);
    transform[10] = 0.0;
    refused(&mesh, VSH_ERROR_INPUT, "'cube'", "flattens");
    memcpy(transform, turned, sizeof transform);
    transform[3] = 1e300;
    transform[1] = -1e30;
    check(&mesh); /* far and stretched, but a transform */
    for (int i = 0; i < 12; ++i) {
        transform[i] = turned[i] * 1e-30;
    }
    check(&mesh); /* small is not flat */
}

TEST(labels_have_name_or_number_in_whole_characters) {
    vsh_mesh mesh = {.name = "sail"};
    assert_string_equal(vshi_mesh_label(&mesh, 3).text, "mesh 'sail'");
    mesh.name = "";
    assert_string_equal(vshi_mesh_label(&mesh, 3).text, "mesh 3");
    mesh.name = NULL;
    assert_string_equal(vshi_mesh_label(&mesh, VSHI_MESH_ALONE).text, "mesh");
    for (size_t shift = 0; shift < 2; ++shift) {
        char name[400] = "a";
        for (size_t i = shift; i + 2 < sizeof name; i += 2) {
            memcpy(name + i, "é", 2);
        }
        mesh.name = name;
        const vshi_mesh_name label = vshi_mesh_label(&mesh, 0);
        const char *tail = label.text + strlen(label.text) - strlen("é…'");
        assert_string_equal(tail, "é…'");
    }
}

TEST(names_match_patterns_as_in_a_shell) {
    static const struct {
        const char *name, *pattern;
        int match;
    } cases[] = {
        {"floor", "floor", 1},
        {"floor", "flo", 0},
        {"floor", "FLOOR", 0},
        {"floor", "*", 1},
        {"floor", "*oo*", 1},
        {"floor", "*o?", 1},
        {"floor", "f??????", 0},
        {"a/b c", "a*c", 1},
        {"wände", "w?nde", 1},
        {"wände", "w??nde", 0},
        {"part7", "part[0-9]", 1},
        {"partx", "part[0-9]", 0},
        {"partx", "part[!0-9]", 1},
        {"a]", "a[]]", 1},
        {"a[1]", "a[1]", 1},
        {"a1", "a[1]", 1},
        {"a[", "a[", 1},
        {"a*", "a\\*", 1},
        {"ab", "a\\*", 0},
        {"", "*", 1},
        {"", "?", 0},
        {"aab", "*a*b", 1},
        {"abcabd", "*abd", 1},
        {"abcabd", "*abc", 0},
        {"a-", "a[b-]", 1},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        const vsh_mesh mesh = {.name = cases[i].name};
        assert_that(vshi_mesh_matches(&mesh, cases[i].pattern) == cases[i].match, "'%s' by '%s': expected %d",
                    cases[i].name, cases[i].pattern, cases[i].match);
    }
    const vsh_mesh part = {.name = "Wall/Cube.003", .object_name = "Wall"};
    assert_true(vshi_mesh_matches(&part, "Wall") && vshi_mesh_matches(&part, "Cube.*"));
    assert_true(vshi_mesh_matches(&part, "Wall/Cube.003"));
    assert_false(vshi_mesh_matches(&part, "all") || vshi_mesh_matches(&part, "003"));
    const vsh_mesh nameless = {0};
    assert_true(vshi_mesh_matches(&nameless, "*"));
    assert_false(vshi_mesh_matches(&nameless, "?") || vshi_mesh_matches(&part, NULL) ||
                 vshi_mesh_matches(NULL, "*"));
}

TEST(a_pattern_of_many_stars_is_fast) {
    char name[4001], pattern[2002];
    memset(name, 'a', sizeof name - 1);
    name[sizeof name - 1] = '\0';
    for (size_t i = 0; i < 1000; ++i) {
        memcpy(pattern + 2 * i, "*a", 2);
    }
    strcpy(pattern + 2000, "b");
    const vsh_mesh mesh = {.name = name};
    assert_false(vshi_mesh_matches(&mesh, pattern));
}

/* --- strides and 16-bit indices */

enum { SIDE = 9, CORNERS = SIDE * SIDE, FACES = 2 * (SIDE - 1) * (SIDE - 1), SIZE = 32 };

/* A vertex as engines have it. */
typedef struct vertex {
    float uv[2];
    uint32_t color;
    float position[3], normal[3];
} vertex;

/* Waves, once in arrays and once interleaved. */
typedef struct waves {
    vsh_model *model;
    vertex vertices[CORNERS];
    uint16_t indices[3 * FACES];
    vsh_mesh tight, loose;
} waves;

static void free_waves(waves *w) {
    vsh_model_free(w->model);
}

static void make_waves(waves *w) {
    float heights[CORNERS];
    for (int i = 0; i < CORNERS; ++i) {
        heights[i] = sinf((float)(i % SIDE) + 0.3f * (float)(i / SIDE));
    }
    const vsh_heights_source source = {
        .name = "waves", .columns = SIDE, .rows = SIDE, .values = heights, .size = {4, 4}, .height = 0.2};
    w->model = NULL;
    assert_ok(vsh_model_from_heights(&source, VSH_HEIGHTS_SURFACE, NULL, &w->model, &failure));
    w->tight = vsh_model_mesh(w->model, 0, 0);
    assert_true(w->tight.vertex_count == CORNERS && w->tight.triangle_count == FACES);
    for (size_t i = 0; i < CORNERS; ++i) {
        vertex *v = &w->vertices[i];
        memcpy(v->position, w->tight.positions + 3 * i, sizeof v->position);
        memcpy(v->normal, w->tight.normals + 3 * i, sizeof v->normal);
        memcpy(v->uv, w->tight.uvs + 2 * i, sizeof v->uv);
        v->color = UINT32_MAX; /* as a float, this is NaN */
    }
    for (size_t i = 0; i < 3 * FACES; ++i) {
        w->indices[i] = (uint16_t)w->tight.indices[i];
    }
    w->loose = (vsh_mesh){.name = "waves",
                          .positions = w->vertices[0].position,
                          .normals = w->vertices[0].normal,
                          .uvs = w->vertices[0].uv,
                          .indices16 = w->indices,
                          .vertex_count = CORNERS,
                          .triangle_count = FACES,
                          .position_stride = sizeof(vertex),
                          .normal_stride = sizeof(vertex),
                          .uv_stride = sizeof(vertex)};
}

/* All results of the library for a mesh under a cube. */
typedef struct outcome {
    vsh_mesh_report report;
    vsh_solidity_report solidity[2];
    vsh_uvs_measures measures;
    vsh_uv_report uvs;
    vsh_grid_info grid;
    vsh_atlas_info atlas;
    float distances[SIZE], shadow[SIZE * SIZE], ao[SIZE * SIZE], unwrapped[3 * FACES][2];
} outcome;

static void make_outcome(const vsh_mesh *mesh, outcome *o) {
    static const double aside[12] = {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1};
    vsh_mesh meshes[2] = {*mesh, cube()};
    meshes[1].transform = aside;
    memset(o, 0, sizeof *o);
    o->report = check(mesh);
    assert_ok(vsh_mesh_solidity(meshes, 2, NULL, o->solidity, &failure));
    assert_ok(vsh_uvs_measure(mesh, SIZE, SIZE, &o->measures, &failure));

    vsh_grid *grid = grid_from_meshes(meshes, 2, 0.1);
    vsh_grid_get_info(grid, &o->grid);
    assert_ok(vsh_grid_copy(grid, (const int32_t[3]){4, 8, 15}, (const int32_t[3]){SIZE, 1, 1}, o->distances,
                            &failure));
    vsh_grid_free(grid);

    vsh_atlas *atlas = NULL;
    assert_ok(vsh_unwrap(mesh, 1, NULL, NULL, &atlas, &failure));
    vsh_atlas_get_info(atlas, &o->atlas);
    const vsh_atlas_mesh view = vsh_atlas_mesh_view(atlas, 0);
    assert_true(view.vertex_count <= COUNT_OF(o->unwrapped));
    memcpy(o->unwrapped, view.uvs, view.vertex_count * sizeof o->unwrapped[0]);
    vsh_atlas_free(atlas);

    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIZE;
    vsh_occluders *occluders = NULL;
    vsh_charts *charts = NULL;
    vsh_light sun = vsh_light_default();
    sun.direction[0] = 0.5;
    float *planes[1] = {o->shadow};
    const vsh_lightmap lightmap = {.shadow = planes, .ao = o->ao};
    assert_ok(vsh_occluders_create(meshes, 2, NULL, NULL, &occluders, &failure));
    assert_ok(vsh_charts_create(mesh, 1, &options, NULL, &o->uvs, &charts, &failure));
    assert_ok(vsh_bake_lightmap(occluders, charts, &sun, 1, NULL, NULL, &lightmap, NULL, &failure));
    vsh_charts_free(charts);
    vsh_occluders_free(occluders);
}

TEST(an_interleaved_mesh_of_16_bit_indices_gives_the_bits_of_a_tight_one) {
    FREED_BY(free_waves) waves w;
    static outcome tight, loose;
    make_waves(&w);
    make_outcome(&w.tight, &tight);
    make_outcome(&w.loose, &loose);
    assert_true(tight.report.area > 0.0 && tight.grid.active_voxels > 0 && tight.atlas.charts > 0);
    assert_true(tight.shadow[0] > 0.0f || tight.shadow[SIZE] > 0.0f);
    assert_memory_equal(&tight, &loose, sizeof tight);
}

TEST(strides_out_of_range_are_refused_by_mesh_value_and_limit) {
    FREED_BY(free_waves) waves w;
    make_waves(&w);
    vsh_mesh mesh;
    const struct {
        size_t *stride, value;
        const char *message;
    } cases[] = {
        {&mesh.position_stride, 8,
         "mesh 'waves': position_stride 8: expected 0, or a multiple of 4 from 12 to 65536"},
        {&mesh.normal_stride, 14,
         "mesh 'waves': normal_stride 14: expected 0, or a multiple of 4 from 12 to 65536"},
        {&mesh.uv_stride, 65540,
         "mesh 'waves': uv_stride 65540: expected 0, or a multiple of 4 from 8 to 65536"},
        {NULL, 0, "mesh 'waves': both indices and indices16: expected one of them"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        mesh = w.loose;
        if (cases[i].stride != NULL) {
            *cases[i].stride = cases[i].value;
        } else {
            mesh.indices = w.tight.indices;
        }
        vsh_mesh_report report;
        vsh_solidity_report solidity;
        vsh_uvs_measures measures;
        vsh_occluders *occluders;
        vsh_charts *charts;
        vsh_atlas *atlas;
        vsh_grid *grid;
        const vsh_result results[] = {vsh_mesh_check(&mesh, &report, &failure),
                                      vsh_mesh_solidity(&mesh, 1, NULL, &solidity, &failure),
                                      vsh_uvs_measure(&mesh, SIZE, SIZE, &measures, &failure),
                                      vsh_occluders_create(&mesh, 1, NULL, NULL, &occluders, &failure),
                                      vsh_charts_create(&mesh, 1, NULL, NULL, NULL, &charts, &failure),
                                      vsh_grid_from_meshes(&mesh, 1, NULL, NULL, &grid, &failure),
                                      vsh_unwrap(&mesh, 1, NULL, NULL, &atlas, &failure)};
        for (size_t k = 0; k < COUNT_OF(results); ++k) {
            assert_int_equal(results[k], VSH_ERROR_ARGUMENT);
        }
        assert_fails(vsh_unwrap(&mesh, 1, NULL, NULL, &atlas, &failure), VSH_ERROR_ARGUMENT,
                     cases[i].message);
    }
}
