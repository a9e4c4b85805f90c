/* Grids of meshes. */
#include "grids.h"
#include "testing.h"

typedef struct model {
    float *positions;
    uint32_t *indices;
    vsh_mesh mesh;
} model;

/* A sphere of `rows` × 2 `rows` quads, halved; outward, or inward where `inverted`. */
static model make_sphere(int rows, double radius, int inverted) {
    const int columns = 2 * rows;
    const size_t vertices = (size_t)(rows - 1) * (size_t)columns + 2;
    const size_t triangles = 2 * (size_t)(rows - 1) * (size_t)columns;
    model m = {malloc(vertices * 3 * sizeof(float)), malloc(triangles * 3 * sizeof(uint32_t)), {0}};
    assert_non_null(m.positions);
    assert_non_null(m.indices);
    float *p = m.positions;
    for (int row = 1; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const double polar = 3.14159265358979 * row / rows;
            const double around = 3.14159265358979 * column / rows;
            *p++ = (float)(radius * sin(polar) * cos(around));
            *p++ = (float)(radius * cos(polar));
            *p++ = (float)(radius * sin(polar) * sin(around));
        }
    }
    const float poles[6] = {0, (float)radius, 0, 0, (float)-radius, 0};
    memcpy(p, poles, sizeof poles);
    const uint32_t top = (uint32_t)vertices - 2, bottom = (uint32_t)vertices - 1;
    uint32_t *t = m.indices;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const uint32_t next = (uint32_t)((column + 1) % columns), here = (uint32_t)column;
            const uint32_t up = (uint32_t)((row - 1) * columns), down = (uint32_t)(row * columns);
            const uint32_t quad[4] = {row == 0 ? top : up + here, row == 0 ? top : up + next,
                                      row == rows - 1 ? bottom : down + next,
                                      row == rows - 1 ? bottom : down + here};
            if (row > 0) {
                *t++ = quad[0];
                *t++ = quad[inverted ? 2 : 1];
                *t++ = quad[inverted ? 1 : 2];
            }
            if (row < rows - 1) {
                *t++ = quad[0];
                *t++ = quad[inverted ? 3 : 2];
                *t++ = quad[inverted ? 2 : 3];
            }
        }
    }
    m.mesh = (vsh_mesh){.name = "ball",
                        .positions = m.positions,
                        .indices = m.indices,
                        .vertex_count = vertices,
                        .triangle_count = triangles};
    return m;
}

static void free_model(model *m) {
    free(m->positions);
    free(m->indices);
}

static vsh_grid *grid_of(const vsh_mesh *meshes, size_t count, double voxel, const vsh_run *run) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(meshes, count, &options, run, &grid, &failure));
    return grid;
}

static char last_warning[1024];

static void keep_warning(void *user, const char *message) {
    ++*(int *)user;
    snprintf(last_warning, sizeof last_warning, "%s", message);
}

TEST(a_fine_mesh_of_a_sphere_is_the_sphere) {
    for (int inverted = 0; inverted < 2; ++inverted) {
        model ball = make_sphere(150, 1.0, inverted);
        ball.mesh.solidity = inverted ? VSH_SOLIDITY_SOLID : VSH_SOLIDITY_AUTO;
        vsh_grid *grid = grid_of(&ball.mesh, 1, 0.03, NULL);
        const double worst = worst_error(grid, unit_sphere, 2.95, 2.95);
        print_message("mesh of a sphere: worst error %.3f voxels\n", worst);
        assert_true(worst < 0.1);
        assert_int_equal(wrong_blocks(grid, unit_sphere, 10), 0);
        vsh_grid_free(grid);
        free_model(&ball);
    }
}

static double unit_cube(const double p[3]) {
    const double x = fabs(p[0]) - 1.0, y = fabs(p[1]) - 1.0, z = fabs(p[2]) - 1.0;
    const double a = fmax(x, 0.0), b = fmax(y, 0.0), c = fmax(z, 0.0);
    return sqrt(a * a + b * b + c * c) + fmin(fmax(x, fmax(y, z)), 0.0);
}

static const float cube_positions[24] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                         -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};

static const uint32_t cube_indices[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                          3, 6, 2, 3, 7, 6, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};

static const vsh_mesh cube = {.name = "cube",
                              .positions = cube_positions,
                              .indices = cube_indices,
                              .vertex_count = 8,
                              .triangle_count = 12};

TEST(few_large_triangles_are_exact) {
    OWNED(vsh_grid) *grid = grid_of(&cube, 1, 0.03, NULL);
    assert_true(worst_error(grid, unit_cube, 2.95, 2.95) < 0.02);
    assert_int_equal(wrong_blocks(grid, unit_cube, 8), 0);
}

TEST(a_mesh_far_away_and_mirrored_is_the_same) {
    const double far_away[12] = {-1, 0, 0, 1e7, 0, 1, 0, 0, 0, 0, 1, -4e6};
    vsh_mesh moved = cube;
    moved.transform = far_away;
    OWNED(vsh_grid) *here = grid_of(&cube, 1, 0.03125, NULL);
    OWNED(vsh_grid) *there = grid_of(&moved, 1, 0.03125, NULL);
    assert_same_leaves(here, there, 1e-6f);
}

static double sheet(const double p[3]) {
    return fabs(p[2]) - 0.04;
}

TEST(an_open_quad_becomes_a_shell_with_a_warning) {
    static const float positions[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh quad = {
        .name = "sail", .positions = positions, .indices = indices, .vertex_count = 4, .triangle_count = 2};
    int warnings = 0;
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    run.user = &warnings;
    OWNED(vsh_grid) *grid = NULL;
    vsh_grid_options options = with_voxel(0.02);
    options.shell_thickness = 4.0;
    assert_ok(vsh_grid_from_meshes(&quad, 1, &options, &run, &grid, &failure));
    assert_int_equal(warnings, 1);
    assert_non_null(
        strstr(last_warning, "note: mesh 'sail' (1 of 1): 4 open edges: baked as a shell 4 voxels"));
    leaves all = leaves_of(grid);
    assert_float_equal(all.info.shell_thickness, 0.08, 1e-12);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            if (fabs(p[0]) < 0.99 && fabs(p[1]) < 0.99) {
                const double expected = fmin(sheet(p), 0.06);
                assert_true(fabs((double)all.leaf[i].values[v] - expected) < 0.01 * 0.02);
            }
        }
    }
    free(all.leaf);
}

TEST(a_crack_is_closed_and_told) {
    model ball = make_sphere(200, 1.0, 0);
    --ball.mesh.triangle_count;
    int warnings = 0;
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    run.user = &warnings;
    vsh_grid *grid = grid_of(&ball.mesh, 1, 0.03, &run);
    assert_true(worst_error(grid, unit_sphere, 2.95, 2.95) < 0.1);
    assert_int_equal(wrong_blocks(grid, unit_sphere, 8), 0);
    assert_int_equal(warnings, 1);
    assert_non_null(
        strstr(last_warning, "note: mesh 'ball' (1 of 1): 3 open edges around 1 hole in 1 of 1 component"));
    assert_non_null(strstr(last_warning, "closed over the holes"));
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_true(info.shell_thickness == 0.0);
    vsh_grid_free(grid);
    free_model(&ball);
}

static double two_balls(const double p[3]) {
    const double q[3] = {p[0] - 0.8, p[1], p[2]};
    return fmin(unit_sphere(p), unit_sphere(q));
}

TEST(overlapping_meshes_are_one_solid) {
    model ball = make_sphere(100, 1.0, 0);
    static const double aside[12] = {1, 0, 0, 0.8, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_mesh both[2] = {ball.mesh, ball.mesh};
    both[1].transform = aside;
    vsh_grid *grid = grid_of(both, 2, 0.03, NULL);
    leaves all = leaves_of(grid);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            const double expected = two_balls(p);
            /* Along the seam the conversion signs a voxel by the nearer triangle: a groove of half a voxel.
             */
            const double q[3] = {p[0] - 0.8, p[1], p[2]};
            const int seam = fabs(unit_sphere(p)) < 0.03 && fabs(unit_sphere(q)) < 0.03;
            if (fabs(expected) > (seam ? 0.5 : 0.1) * 0.03) {
                assert_int_equal(all.leaf[i].values[v] < 0.0f, expected < 0.0);
            }
            if (expected > 0.0 && expected < 2.9 * 0.03) {
                assert_true(fabs((double)all.leaf[i].values[v] - expected) < (seam ? 0.5 : 0.1) * 0.03);
            }
        }
    }
    free(all.leaf);
    vsh_grid_free(grid);
    free_model(&ball);
}

TEST(a_room_in_a_mesh_stays_open_and_keeps_its_furniture) {
    /* One mesh of three shells: a ball, a room in it that faces inward, and a ball in the room. */
    model shells[3] = {make_sphere(100, 1.0, 0), make_sphere(100, 0.6, 1), make_sphere(40, 0.2, 0)};
    for (int turned = 0; turned < 2; ++turned) {
        size_t vertices = 0, indices = 0;
        model all = {malloc(50000 * 3 * sizeof(float)), malloc(100000 * 3 * sizeof(uint32_t)), {0}};
        assert_non_null(all.positions);
        assert_non_null(all.indices);
        for (int i = 0; i < 3; ++i) {
            const vsh_mesh *m = &shells[turned ? 2 - i : i].mesh;
            memcpy(all.positions + 3 * vertices, m->positions, m->vertex_count * 3 * sizeof(float));
            for (size_t j = 0; j < 3 * m->triangle_count; ++j) {
                all.indices[indices++] = m->indices[j] + (uint32_t)vertices;
            }
            vertices += m->vertex_count;
        }
        const double mirrored[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0};
        all.mesh = (vsh_mesh){.name = "house",
                              .positions = all.positions,
                              .indices = all.indices,
                              .vertex_count = vertices,
                              .triangle_count = indices / 3,
                              .transform = turned ? mirrored : NULL};
        vsh_grid *grid = grid_of(&all.mesh, 1, 0.03, NULL);
        assert_true(worst_error(grid, room_with_a_ball, 2.9, 2.9) < 0.1);
        assert_int_equal(wrong_blocks(grid, room_with_a_ball, 8), 0);
        vsh_grid_free(grid);
        free_model(&all);
    }
    for (int i = 0; i < 3; ++i) {
        free_model(&shells[i]);
    }
}

TEST(threads_do_not_show_in_meshes) {
    model fine = make_sphere(100, 0.7, 0);
    model coarse = make_sphere(5, 1.0, 0);
    const vsh_mesh sets[2][2] = {{fine.mesh, coarse.mesh}, {coarse.mesh, cube}};
    const int32_t threads[4] = {1, 2, 5, 0};
    for (int set = 0; set < 2; ++set) {
        vsh_grid *first = NULL;
        for (int i = 0; i < 4; ++i) {
            const vsh_run run = run_on(threads[i]);
            vsh_grid *grid = grid_of(sets[set], 2, 0.03, &run);
            if (first == NULL) {
                first = grid;
            } else {
                assert_same_leaves(first, grid, 0.0f);
                vsh_grid_free(grid);
            }
        }
        vsh_grid_free(first);
    }
    free_model(&fine);
    free_model(&coarse);
}

TEST(bad_meshes_are_refused_with_the_reason) {
    vsh_grid *grid = NULL;
    float positions[24];
    uint32_t indices[36];
    vsh_mesh bad = cube;
    bad.positions = positions;
    bad.indices = indices;
    memcpy(positions, cube_positions, sizeof positions);
    memcpy(indices, cube_indices, sizeof indices);
    positions[4] = NAN;
    assert_fails(vsh_grid_from_meshes(&bad, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT, "vertex 1");
    positions[4] = 0.0f;
    indices[7] = 8;
    assert_fails(vsh_grid_from_meshes(&bad, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT, "vertex 8");
    bad = cube;
    bad.triangle_count = 0;
    assert_fails(vsh_grid_from_meshes(&bad, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT,
                 "without a triangle");
    assert_fails(vsh_grid_from_meshes(NULL, 0, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT, "no meshes");
    vsh_grid_options options = with_voxel(1e-9);
    assert_fails(vsh_grid_from_meshes(&cube, 1, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size 1e-09");
    options = with_voxel(2e-5);
    assert_fails(vsh_grid_from_meshes(&cube, 1, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "this machine's memory");
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000000;
    assert_fails(vsh_grid_from_meshes(&cube, 1, NULL, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "limit of 1 MB");
    assert_null(grid);
}

TEST(meshes_can_be_cancelled) {
    model ball = make_sphere(100, 1.0, 0);
    const double stops[] = {0.0, 0.1, 0.5, 0.9};
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i], 0};
        vsh_run run = run_on(2);
        run.progress = watch_progress;
        run.user = &w;
        vsh_grid *grid = NULL;
        const vsh_grid_options options = with_voxel(0.04);
        assert_fails(vsh_grid_from_meshes(&ball.mesh, 1, &options, &run, &grid, &failure),
                     VSH_ERROR_CANCELLED, "cancelled");
        assert_null(grid);
    }
    free_model(&ball);
}

static int32_t count_down(void *left, const char *stage, double fraction) {
    (void)stage;
    (void)fraction;
    return --*(int32_t *)left < 0;
}

/* Sorting triangles, filling from outside and cutting where solids overlap all ask. */
TEST(solids_that_overlap_can_be_cancelled_whenever_progress_is_told) {
    model ball = make_sphere(100, 1.0, 0);
    const vsh_mesh meshes[] = {ball.mesh, cube};
    const vsh_grid_options options = with_voxel(0.2);
    enum { LAST = 60 }; /* calls, which are those of this stage */
    int32_t all = INT32_MAX;
    for (int i = 0; i <= LAST; i += i < 2 ? 1 : 5) {
        int32_t left = i == 0 ? INT32_MAX : all - i;
        vsh_run run = run_on(1);
        run.progress = count_down;
        run.user = &left;
        OWNED(vsh_grid) *grid = NULL;
        const vsh_result result = vsh_grid_from_meshes(meshes, 2, &options, &run, &grid, &failure);
        if (i == 0) {
            all -= left;
            assert_true(all > LAST);
        }
        if (i > 1) { /* the last call says that all is done */
            assert_int_equal(result, VSH_ERROR_CANCELLED);
            assert_int_equal(left, -1); /* and nobody asks again */
        }
        assert_true((grid == NULL) == (result == VSH_ERROR_CANCELLED));
    }
    free_model(&ball);
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
