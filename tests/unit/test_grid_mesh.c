/* Level sets of meshes, against closed forms: solids, what is open, and meshes that nobody should make. */
#include "grids.h"
#include "shapes.h"
#include "testing.h"

static const double VOXEL = 0.05;
static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

enum { MANY = 1000000 };

static char warned[4096];

static void keep_warning(void *user, const char *message) {
    snprintf(warned + strlen(warned), sizeof warned - strlen(warned), "%s\n", message);
}

static void assert_warned_once(const char *part) {
    assert_non_null(strstr(warned, part));
    assert_ptr_equal(strchr(warned, '\n'), warned + strlen(warned) - 1);
}

static vsh_grid *grid_of(const vsh_mesh *meshes, size_t count, vsh_grid_options options) {
    vsh_run run = vsh_run_default();
    run.warning = keep_warning;
    run.notes = 1;
    warned[0] = '\0';
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(meshes, count, &options, &run, &grid, &failure));
    return grid;
}

static vsh_grid *grid_of_shape(const shape *s, double voxel) {
    const vsh_mesh mesh = shape_mesh(s, "mesh");
    return grid_of(&mesh, 1, with_voxel(voxel));
}

/* From -1 to 1, of eight vertices. */
static vsh_mesh cube(void) {
    static float corners[24];
    return box_mesh(corners, LOW, HIGH);
}

static double ball(const double p[3], double radius) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - radius;
}

static double shell_thickness(const vsh_grid *grid) {
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    return info.shell_thickness;
}

/* Within `bound` voxels of the truth, and of its sign everywhere; inside down to `inside` voxels. Frees the
 * grid. */
static void assert_is(vsh_grid *grid, truth_fn *truth, double inside, double bound, const char *what) {
    const double worst = worst_error(grid, truth, inside, 2.95);
    const size_t wrong = wrong_blocks(grid, truth, 10);
    assert_less(worst, bound);
    assert_int_equal(wrong, 0);
    vsh_grid_free(grid);
}

/* --- closed solids */

TEST(a_fine_mesh_of_a_sphere_is_the_sphere) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 254);
    vsh_mesh mesh = shape_mesh(s, "ball");
    assert_is(grid_of(&mesh, 1, with_voxel(0.03)), unit_sphere, 2.95, 0.1, "ball");
    shape_turn(s, 0);
    mesh.solidity = VSH_SOLIDITY_SOLID;
    assert_is(grid_of(&mesh, 1, with_voxel(0.03)), unit_sphere, 2.95, 0.1, "ball, turned inside out");
    shape_turn(s, 0);
    shape_turn(s, s->triangles - 2000);
    mesh.solidity = VSH_SOLIDITY_AUTO;
    assert_is(grid_of(&mesh, 1, with_voxel(0.03)), unit_sphere, 2.95, 0.1, "ball with turned faces");
}

TEST(a_mesh_far_away_and_mirrored_is_the_same) {
    const double far_away[12] = {-1, 0, 0, 1e7, 0, 1, 0, 0, 0, 0, 1, -4e6};
    vsh_mesh mesh = cube();
    OWNED(vsh_grid) *here = grid_of(&mesh, 1, with_voxel(0.03125));
    mesh.transform = far_away;
    OWNED(vsh_grid) *there = grid_of(&mesh, 1, with_voxel(0.03125));
    assert_same_leaves(here, there, 1e-6f);
}

static double beside(const double p[3]) {
    const double q[3] = {p[0] - 1.013, p[1] - 1.013, p[2] - 1.013};
    return to_box(q, 1.0);
}

/* Half a voxel off the surface signs are those of the union. Distances are its own outside; inside they may
 * be to faces that lie within. Along the seam a voxel is signed by the nearer triangle: a groove of half a
 * voxel. */
TEST(boxes_that_cross_in_one_mesh_or_two_are_their_union) {
    const double low[3] = {0.013, 0.013, 0.013}, high[3] = {2.013, 2.013, 2.013}, voxel = 0.047;
    FREED shape *s[2] = {shape_new()};
    FREED shape *other = shape_new();
    for (int split = 0; split < 2; ++split) {
        s[1] = split ? other : s[0];
        s[0]->vertices = s[0]->triangles = 0;
        shape_box(s[0], LOW, HIGH, ALL_SIDES);
        shape_box(s[1], low, high, ALL_SIDES);
        const vsh_mesh meshes[2] = {shape_mesh(s[0], "one"), shape_mesh(s[1], "other")};
        OWNED(vsh_grid) *grid = grid_of(meshes, split ? 2 : 1, with_voxel(voxel));
        FREED_BY(free_leaves) leaves all = leaves_of(grid);
        for (size_t n = 0; n < 512 * all.count; ++n) {
            double p[3];
            const double value = value_at(&all, n, p), a = to_box(p, 1.0), b = beside(p), truth = fmin(a, b);
            assert_true(fabs(truth) <= 0.5 * voxel || (value < 0.0) == (truth < 0.0));
            const double bound = fabs(a) < voxel && fabs(b) < voxel ? 0.5 : 0.1;
            assert_true(truth <= 0.0 || truth >= 2.9 * voxel || fabs(value - truth) < bound * voxel);
        }
    }
}

/* --- meshes inside others */

static double dome_and_cube(const double p[3]) {
    const double d = ball(p, 3.0);
    return fmin(fmax(-d, d - 2.0 * VOXEL), to_box(p, 1.0));
}

static double dome_of_sheets(const double p[3]) {
    return fmin(fabs(ball(p, 3.0)) - VOXEL, to_box(p, 1.0));
}

TEST(a_sky_dome_leaves_what_it_holds_and_one_that_looks_outwards_holds_air) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 3.0, -1.0, 1.0, 128);
    const size_t dome = s->triangles;
    shape_box(s, LOW, HIGH, ALL_SIDES);
    assert_is(grid_of_shape(s, VOXEL), dome_of_sheets, 0.9, 0.1, "dome");
    shape_turn(s, 0);
    shape_turn(s, dome);
    vsh_grid *grid = grid_of_shape(s, VOXEL);
    assert_true(shell_thickness(grid) == 0.0);
    assert_is(grid, dome_and_cube, 0.9, 0.1, "sky dome");
}

static double house(const double p[3]) {
    return fmin(fmax(to_box(p, 2.0), -to_box(p, 1.0)), to_box(p, 0.5));
}

TEST(houses_have_rooms_with_furniture_in_one_mesh_or_many) {
    static const double half[3] = {0.5, 1.0, 2.0}, mirrored[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0};
    for (int split = 0; split < 2; ++split) {
        shape *s[3];
        vsh_mesh meshes[3];
        for (int i = 0; i < 3; ++i) {
            const double low[3] = {-half[i], -half[i], -half[i]}, high[3] = {half[i], half[i], half[i]};
            s[i] = i == 0 || split ? shape_new() : s[0];
            const size_t first = s[i]->triangles;
            shape_box(s[i], low, high, ALL_SIDES);
            if (i == 1) {
                shape_turn(s[i], first);
            }
            meshes[i] = shape_mesh(s[i], "part");
        }
        meshes[0] = shape_mesh(s[0], "house");
        for (int turned = 0; turned < 2; ++turned) {
            for (int i = 0; i < 3; ++i) {
                meshes[i].transform = turned ? mirrored : NULL;
            }
            assert_is(grid_of(meshes, split ? 3 : 1, with_voxel(VOXEL)), house, 2.9, 0.05, "house");
        }
        for (int i = 0; i < (split ? 3 : 1); ++i) {
            free(s[i]);
        }
    }
}

static double room(const double p[3]) { /* walls of two voxels around the cube */
    const double d = to_box(p, 1.0);
    return fmax(-d, d - 2.0 * VOXEL);
}

TEST(an_inverted_mesh_is_a_room_or_the_same_solid_if_asked) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 0);
    vsh_mesh mesh = shape_mesh(s, "cube");
    assert_is(grid_of(&mesh, 1, with_voxel(VOXEL)), room, 0.9, 0.02, "room");
    mesh.solidity = VSH_SOLIDITY_SOLID;
    assert_is(grid_of(&mesh, 1, with_voxel(VOXEL)), unit_cube, 2.9, 0.02, "solid");
}

TEST(the_door_of_a_room_stays_open) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES & ~FRONT);
    shape_turn(s, 0);
    OWNED(vsh_grid) *grid = grid_of_shape(s, VOXEL);
    assert_true(shell_thickness(grid) == 0.0);
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    size_t compared = 0;
    for (size_t n = 0; n < 512 * all.count; ++n) {
        double p[3];
        const double value = value_at(&all, n, p), truth = room(p);
        const bool doorway = fabs(p[0]) < 0.8 && fabs(p[2]) < 0.8 && p[1] < -0.5;
        const bool air = to_box(p, 1.0)<-0.01 * VOXEL, wall = p[1]> - 0.7 && fabs(truth) < 0.9 * VOXEL;
        assert_true(!(doorway || air) || value > 0.0);
        assert_true(!wall || fabs(value - truth) < 0.1 * VOXEL);
        compared += doorway || air || wall;
    }
    assert_true(compared > 8000);
}

static double room_of_sheets(const double p[3]) {
    return fabs(to_box(p, 1.0)) - VOXEL;
}

TEST(rooms_of_separate_walls_hold_air) {
    shape *s[6];
    vsh_mesh meshes[6];
    for (int i = 0; i < 6; ++i) {
        s[i] = shape_new();
        shape_box(s[i], LOW, HIGH, 1U << i);
        meshes[i] = shape_mesh(s[i], "wall");
    }
    vsh_grid *grid = grid_of(meshes, 6, with_voxel(VOXEL));
    assert_true(shell_thickness(grid) > 0.0);
    assert_is(grid, room_of_sheets, 0.9, 0.1, "six walls");
    shape_box(s[0], LOW, HIGH, ALL_SIDES & ~LEFT);
    meshes[0] = shape_mesh(s[0], "box");
    meshes[0].solidity = VSH_SOLIDITY_SHELL;
    assert_is(grid_of(meshes, 1, with_voxel(VOXEL)), room_of_sheets, 0.9, 0.1, "a box that is to be a shell");
    for (int i = 0; i < 6; ++i) {
        free(s[i]);
    }
}

/* --- what is open */

static double sheet(const double p[3]) {
    return fabs(p[2]) - 0.04;
}

TEST(an_open_quad_becomes_a_shell_with_a_warning) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, (const double[3]){1, 1, 0}, TOP);
    const vsh_mesh quad = shape_mesh(s, "sail");
    vsh_grid_options options = with_voxel(0.02);
    options.shell_thickness = 4.0;
    OWNED(vsh_grid) *grid = grid_of(&quad, 1, options);
    assert_warned_once("note: mesh 'sail' (1 of 1): 4 open edges: baked as a shell 4 voxels");
    assert_near(shell_thickness(grid), 0.08, 1e-12);
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    for (size_t n = 0; n < 512 * all.count; ++n) {
        double p[3];
        const double value = value_at(&all, n, p);
        if (fabs(p[0]) < 0.99 && fabs(p[1]) < 0.99) {
            assert_near(value, fmin(sheet(p), 0.06), 0.01 * 0.02);
        }
    }
}

static double capped_ball(const double p[3]) { /* without what is above 0.9 */
    return fmax(ball(p, 1.0), p[2] - 0.9);
}

TEST(a_solid_with_holes_is_as_deep_as_without_and_told) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 128);
    s->indices[1500][1] = s->indices[1500][0];
    for (int i = -1; i < 4; ++i) { /* a hole of one triangle; then another one, of four */
        if (i >= 0) {
            s->indices[6000 + i][1] = s->indices[6000 + i][0];
        }
        if (i == -1 || i == 3) {
            vsh_grid *grid = grid_of_shape(s, VOXEL);
            assert_true(shell_thickness(grid) == 0.0);
            assert_warned_once(i < 0 ? "3 open edges around 1 hole in 1 of 1 component" : "around 2 holes");
            assert_warned_once("closed over the holes");
            assert_is(grid, unit_sphere, 2.9, 0.1, "ball with holes");
        }
    }
    s->vertices = s->triangles = 0;
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.9, 128);
    OWNED(vsh_grid) *grid = grid_of_shape(s, VOXEL);
    assert_int_equal(wrong_blocks(grid, capped_ball, 10), 0);
}

static double mixed(const double p[3]) {
    const double q[3] = {p[0] - 4.0, p[1], p[2]};
    const double x = fmax(fabs(q[0]) - 1.0, 0.0), y = fmax(fabs(q[1]) - 1.0, 0.0);
    const double card = sqrt(x * x + y * y + (q[2] - 1.0) * (q[2] - 1.0)) - VOXEL;
    return fmin(to_box(p, 1.0), card);
}

TEST(a_card_in_a_solid_s_mesh_leaves_it_solid) {
    FREED shape *s = shape_new();
    const double low[3] = {3, -1, -1}, high[3] = {5, 1, 1};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, low, high, TOP);
    vsh_grid *grid = grid_of_shape(s, VOXEL);
    assert_true(shell_thickness(grid) > 0.0);
    assert_is(grid, mixed, 0.9, 0.05, "box and card");
}

/* --- meshes that nobody should make */

TEST(faces_given_twice_or_one_of_them_change_nothing) {
    uint32_t twice[72];
    vsh_mesh mesh = cube();
    memcpy(twice, mesh.indices, sizeof twice / 2);
    memcpy(twice + 36, mesh.indices, sizeof twice / 2);
    mesh.indices = twice;
    for (mesh.triangle_count = 13; mesh.triangle_count <= 24; mesh.triangle_count += 11) {
        assert_is(grid_of(&mesh, 1, with_voxel(0.1)), unit_cube, 2.9, 0.02, "cube given twice");
    }
}

TEST(faces_that_disagree_are_told_and_are_the_same_solid) {
    uint32_t some_turned[36];
    vsh_mesh mesh = cube();
    for (size_t i = 0; i < 36; ++i) {
        some_turned[i] = mesh.indices[i % 9 == 1 ? i + 1 : i % 9 == 2 ? i - 1 : i];
    }
    mesh.indices = some_turned;
    assert_is(grid_of(&mesh, 1, with_voxel(0.1)), unit_cube, 2.9, 0.02, "cube with turned faces");
    assert_non_null(strstr(warned, "4 triangles that face the other way"));
}

TEST(a_million_triangles_without_area_change_nothing) {
    FREED uint32_t *indices = calloc(MANY * 3 + 36, sizeof *indices);
    assert_non_null(indices);
    vsh_mesh mesh = cube();
    memcpy(indices, mesh.indices, 36 * sizeof *indices);
    for (size_t t = 0; t < MANY; ++t) { /* points, and edges there and back */
        const uint32_t a = (uint32_t)t % 8;
        memcpy(indices + 36 + 3 * t, (uint32_t[3]){a, a, t % 2 != 0 ? a : (a + 1) % 8}, sizeof(uint32_t[3]));
    }
    mesh.indices = indices;
    mesh.triangle_count += MANY;
    vsh_mesh_report report;
    assert_ok(vsh_mesh_check(&mesh, &report, &failure));
    assert_int_equal(report.degenerate_triangles, MANY);
    assert_int_equal(report.open_edges, 0);
    assert_is(grid_of(&mesh, 1, with_voxel(0.1)), unit_cube, 2.9, 0.02, "cube and degenerate triangles");
}

/* --- what is refused */

static void assert_refused(vsh_mesh mesh, vsh_grid_options options, uint64_t memory_limit, vsh_result code,
                           const char *part) {
    vsh_grid *grid = NULL;
    const vsh_run run = run_within(memory_limit);
    assert_fails(vsh_grid_from_meshes(&mesh, 1, &options, &run, &grid, &failure), code, part);
    assert_null(grid);
}

TEST(bad_meshes_are_refused_with_the_reason) {
    const vsh_grid_options defaults = vsh_grid_options_default();
    vsh_mesh mesh = cube();
    assert_refused(mesh, with_voxel(1e-9), 0, VSH_ERROR_LIMIT, "voxel size 1e-09");
    assert_refused(mesh, with_voxel(2e-5), 0, VSH_ERROR_LIMIT, "this machine's memory");
    assert_refused(mesh, defaults, 1000000, VSH_ERROR_LIMIT, "limit of 1 MB");
    const uint32_t beyond[3] = {0, 1, 8};
    mesh.indices = beyond;
    mesh.triangle_count = 1;
    assert_refused(mesh, defaults, 0, VSH_ERROR_INPUT, "there are only 8");
    mesh.triangle_count = 0;
    assert_refused(mesh, defaults, 0, VSH_ERROR_INPUT, "without a triangle");
    vsh_grid *grid = NULL;
    assert_fails(vsh_grid_from_meshes(NULL, 0, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT, "no meshes");
}

TEST(vertices_out_of_the_world_are_refused) {
    static const struct {
        float value;
        vsh_result expected;
    } cases[] = {{1e30f, VSH_ERROR_LIMIT}, {-1e30f, VSH_ERROR_LIMIT},   {3e38f, VSH_ERROR_LIMIT},
                 {NAN, VSH_ERROR_INPUT},   {INFINITY, VSH_ERROR_INPUT}, {-INFINITY, VSH_ERROR_INPUT}};
    const vsh_grid_options resolved = vsh_grid_options_default();
    float bad[24];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        for (size_t v = 0; v < 24; v += 7) {
            vsh_mesh mesh = box_mesh(bad, LOW, HIGH);
            bad[v] = cases[i].value;
            char vertex[32];
            snprintf(vertex, sizeof vertex, "vertex %zu", v / 3);
            const char *part = cases[i].expected == VSH_ERROR_INPUT ? vertex : "";
            assert_refused(mesh, with_voxel(0.1), 0, cases[i].expected, part);
            assert_refused(mesh, resolved, 0, cases[i].expected, part);
        }
    }
    /* and all of it out there: its voxels would be too large */
    const double far = 1e30;
    const vsh_mesh mesh = box_mesh(bad, (double[3]){-far, -far, -far}, (double[3]){far, far, far});
    assert_refused(mesh, resolved, 0, VSH_ERROR_LIMIT, "voxel size");
}

typedef struct countdown {
    int32_t left;
    double last;
} countdown;

static int32_t count_down(void *user, const char *stage, double fraction) {
    countdown *c = user;
    assert_string_equal(stage, "voxelize");
    assert_true(fraction >= c->last && fraction <= 1.0);
    c->last = fraction;
    return --c->left < 0;
}

/* Sorting triangles, filling from outside and cutting where solids overlap all ask. */
TEST(solids_that_overlap_can_be_cancelled_whenever_progress_is_told) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 200);
    const vsh_mesh meshes[] = {shape_mesh(s, "ball"), cube()};
    const vsh_grid_options options = with_voxel(0.2);
    enum { LAST = 60 }; /* calls, which are those of this stage */
    int32_t all = INT32_MAX;
    for (int i = 0; i <= LAST; i += i < 2 ? 1 : 5) {
        countdown c = {.left = i == 0 ? INT32_MAX : all - i};
        vsh_run run = run_watched(count_down, &c);
        run.threads = 1;
        OWNED(vsh_grid) *grid = NULL;
        const vsh_result result = vsh_grid_from_meshes(meshes, 2, &options, &run, &grid, &failure);
        if (i == 0) {
            all -= c.left;
            assert_true(all > LAST);
        }
        if (i > 1) { /* the last call says that all is done */
            assert_int_equal(result, VSH_ERROR_CANCELLED);
            assert_int_equal(c.left, -1); /* and nobody asks again */
        }
        assert_true((grid == NULL) == (result == VSH_ERROR_CANCELLED));
    }
}
