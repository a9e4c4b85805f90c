/* Meshes that nobody should make: each becomes the right solid, with a warning where there is a doubt, or is
 * refused with the reason. */
#include "grids.h"
#include "testing.h"

static const float positions[24] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1,
                                    -1, -1, 1,  1, -1, 1,  1, 1, 1,  -1, 1, 1};
static const uint32_t outward[36] = {0, 3, 2, 0, 2, 1, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                     3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5};

enum { MANY = 1000000 };

static char warned[4096];

static void keep_warning(void *user, const char *message) {
    snprintf(warned + strlen(warned), sizeof warned - strlen(warned), "%s\n", message);
}

static vsh_mesh cube_of(const float *at, const uint32_t *indices, size_t triangles) {
    return (vsh_mesh){
        .name = "cube", .positions = at, .indices = indices, .vertex_count = 8, .triangle_count = triangles};
}

static vsh_grid *grid_of(const vsh_mesh *mesh) {
    const vsh_grid_options options = with_voxel(0.1);
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    warned[0] = '\0';
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(mesh, 1, &options, &run, &grid, &failure));
    return grid;
}

static double cube_truth(const double p[3]) {
    double outside = 0.0, inside = -INFINITY;
    for (int i = 0; i < 3; ++i) {
        const double d = fabs(p[i]) - 1.0;
        outside += d > 0.0 ? d * d : 0.0;
        inside = fmax(inside, d);
    }
    return outside > 0.0 ? sqrt(outside) : inside;
}

/* The cube's own field, to a fraction of a voxel. */
static void assert_cube(const vsh_grid *grid) {
    assert_true(worst_error(grid, cube_truth, 2.9, 2.9) < 0.02);
    assert_int_equal(wrong_blocks(grid, cube_truth, 4), 0);
}

TEST(faces_given_twice_or_one_of_them_change_nothing) {
    uint32_t twice[72];
    memcpy(twice, outward, sizeof outward);
    memcpy(twice + 36, outward, sizeof outward);
    for (size_t triangles = 13; triangles <= 24; triangles += 11) {
        const vsh_mesh mesh = cube_of(positions, twice, triangles);
        OWNED(vsh_grid) *grid = grid_of(&mesh);
        assert_cube(grid);
    }
}

static double room_truth(const double p[3]) { /* walls of 0.2 around the cube */
    const double d = cube_truth(p);
    return fmax(-d, d - 0.2);
}

TEST(an_inverted_mesh_is_a_room_or_the_same_solid_if_asked) {
    uint32_t inward[36];
    for (size_t t = 0; t < 12; ++t) {
        const uint32_t *from = outward + 3 * t;
        memcpy(inward + 3 * t, (uint32_t[3]){from[0], from[2], from[1]}, sizeof(uint32_t[3]));
    }
    vsh_mesh mesh = cube_of(positions, inward, 12);
    OWNED(vsh_grid) *grid = grid_of(&mesh);
    assert_true(worst_error(grid, room_truth, 0.9, 2.9) < 0.02);
    assert_int_equal(wrong_blocks(grid, room_truth, 4), 0);
    mesh.solidity = VSH_SOLIDITY_SOLID;
    OWNED(vsh_grid) *solid = grid_of(&mesh);
    assert_cube(solid);
}

TEST(faces_that_disagree_are_told_and_are_the_same_solid) {
    uint32_t mixed[36];
    memcpy(mixed, outward, sizeof mixed);
    for (size_t t = 0; t < 12; t += 3) {
        mixed[3 * t + 1] = outward[3 * t + 2];
        mixed[3 * t + 2] = outward[3 * t + 1];
    }
    const vsh_mesh mesh = cube_of(positions, mixed, 12);
    OWNED(vsh_grid) *grid = grid_of(&mesh);
    assert_cube(grid);
    assert_non_null(strstr(warned, "4 triangles that face the other way"));
}

TEST(missing_faces_are_told_and_make_a_shell) {
    const vsh_mesh mesh = cube_of(positions, outward, 10);
    OWNED(vsh_grid) *grid = grid_of(&mesh);
    assert_non_null(strstr(warned, "open edges"));
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_true(info.shell_thickness > 0.0);
}

TEST(a_million_triangles_without_area_change_nothing) {
    FREED uint32_t *indices = calloc(MANY * 3 + 36, sizeof *indices);
    assert_non_null(indices);
    memcpy(indices, outward, sizeof outward);
    for (size_t t = 0; t < MANY; ++t) { /* points, and edges there and back */
        const uint32_t a = (uint32_t)t % 8;
        memcpy(indices + 36 + 3 * t, (uint32_t[3]){a, a, t % 2 != 0 ? a : (a + 1) % 8}, sizeof(uint32_t[3]));
    }
    const vsh_mesh mesh = cube_of(positions, indices, MANY + 12);
    vsh_mesh_report report;
    assert_ok(vsh_mesh_check(&mesh, &report, &failure));
    assert_int_equal(report.degenerate_triangles, MANY);
    assert_int_equal(report.open_edges, 0);
    OWNED(vsh_grid) *grid = grid_of(&mesh);
    assert_cube(grid);
}

TEST(vertices_out_of_the_world_are_refused) {
    static const struct {
        float value;
        vsh_result expected;
    } cases[] = {{1e30f, VSH_ERROR_LIMIT}, {-1e30f, VSH_ERROR_LIMIT},   {3e38f, VSH_ERROR_LIMIT},
                 {NAN, VSH_ERROR_INPUT},   {INFINITY, VSH_ERROR_INPUT}, {-INFINITY, VSH_ERROR_INPUT}};
    const vsh_grid_options fixed = with_voxel(0.1), resolved = vsh_grid_options_default();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        for (size_t v = 0; v < 24; v += 7) {
            float bad[24];
            memcpy(bad, positions, sizeof bad);
            bad[v] = cases[i].value;
            const vsh_mesh mesh = cube_of(bad, outward, 12);
            for (int k = 0; k < 2; ++k) {
                vsh_grid *grid = NULL;
                const vsh_result result =
                    vsh_grid_from_meshes(&mesh, 1, k == 0 ? &fixed : &resolved, NULL, &grid, &failure);
                assert_int_equal(result, cases[i].expected);
                assert_null(grid);
            }
        }
    }
    /* and all of it out there: a cube of 1e30, whose voxels would be too large */
    float large[24];
    for (size_t v = 0; v < 24; ++v) {
        large[v] = 1e30f * positions[v];
    }
    const vsh_mesh mesh = cube_of(large, outward, 12);
    vsh_grid *grid = NULL;
    assert_fails(vsh_grid_from_meshes(&mesh, 1, &resolved, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size");
}

TEST(indices_out_of_range_are_refused) {
    static const uint32_t bad[] = {8, 9, 1u << 20, 1u << 31, UINT32_MAX};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        for (size_t k = 0; k < 36; k += 5) {
            uint32_t indices[36];
            memcpy(indices, outward, sizeof indices);
            indices[k] = bad[i];
            const vsh_mesh mesh = cube_of(positions, indices, 12);
            vsh_grid *grid = NULL;
            assert_fails(vsh_grid_from_meshes(&mesh, 1, NULL, NULL, &grid, &failure), VSH_ERROR_INPUT,
                         "there are only 8");
        }
    }
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
