/* Level sets of meshes that are not one closed solid, against closed forms. */
#include "grids.h"
#include "shapes.h"
#include "testing.h"

static const double VOXEL = 0.05;
static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

static vsh_grid *grid_of(const vsh_mesh *meshes, size_t count, double voxel) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_meshes(meshes, count, &options, NULL, &grid, &failure));
    return grid;
}

static vsh_grid *grid_of_shape(const shape *s, double voxel) {
    const vsh_mesh mesh = shape_mesh(s, "mesh");
    return grid_of(&mesh, 1, voxel);
}

static double box(const double p[3], double half) {
    double out = 0.0, in = -INFINITY;
    for (int k = 0; k < 3; ++k) {
        const double d = fabs(p[k]) - half;
        out += d > 0.0 ? d * d : 0.0;
        in = fmax(in, d);
    }
    return out > 0.0 ? sqrt(out) : in;
}

static double ball(const double p[3], double radius) {
    return sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - radius;
}

static bool has_sheets(const vsh_grid *grid) {
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    return info.shell_thickness > 0.0;
}

/* Within `bound` voxels of the truth, and of its sign everywhere; inside down to `inside` voxels. */
static void assert_is(vsh_grid *grid, truth_fn *truth, double inside, double bound, const char *what) {
    const double worst = worst_error(grid, truth, inside, 2.9);
    const size_t wrong = wrong_blocks(grid, truth, 4);
    print_message("%s: worst %.3f voxels, %zu blocks of the wrong sign\n", what, worst, wrong);
    assert_true(worst < bound);
    assert_int_equal(wrong, 0);
    vsh_grid_free(grid);
}

static double dome_and_cube(const double p[3]) {
    const double d = ball(p, 3.0);
    return fmin(fmax(-d, d - 2.0 * VOXEL), box(p, 1.0));
}

TEST(a_sky_dome_leaves_what_it_holds) {
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 3.0, -1.0, 1.0, 128);
    shape_turn(s, 0);
    shape_box(s, LOW, HIGH, ALL_SIDES);
    vsh_grid *grid = grid_of_shape(s, VOXEL);
    assert_false(has_sheets(grid));
    assert_is(grid, dome_and_cube, 0.9, 0.1, "sky dome");
    free(s);
}

static double house(const double p[3]) {
    return fmin(fmax(box(p, 2.0), -box(p, 1.0)), box(p, 0.5));
}

TEST(houses_have_rooms_with_furniture_in_one_mesh_or_many) {
    shape *s[3];
    vsh_mesh meshes[3];
    for (int split = 0; split < 2; ++split) {
        const double half[3] = {0.5, 1.0, 2.0};
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
        assert_is(grid_of(meshes, split ? 3 : 1, VOXEL), house, 2.9, 0.05,
                  split ? "three meshes" : "one mesh");
        for (int i = 0; i < (split ? 3 : 1); ++i) {
            free(s[i]);
        }
    }
}

static double crossing(const double p[3]) {
    const double q[3] = {p[0] - 1.013, p[1] - 1.013, p[2] - 1.013};
    return fmin(box(p, 1.0), box(q, 1.0));
}

/* Signs are the union's half a voxel off its surface; distances inside may be to faces that lie within. */
TEST(boxes_that_cross_in_one_mesh_are_their_union) {
    shape *s = shape_new();
    const double low[3] = {0.013, 0.013, 0.013}, high[3] = {2.013, 2.013, 2.013};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, low, high, ALL_SIDES);
    OWNED(vsh_grid) *grid = grid_of_shape(s, 0.047);
    leaves all = leaves_of(grid);
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            if (fabs(crossing(p)) > 0.5 * 0.047) {
                assert_int_equal(all.leaf[i].values[v] < 0.0f, crossing(p) < 0.0);
            }
        }
    }
    free(all.leaf);
    assert_int_equal(wrong_blocks(grid, crossing, 4), 0);
    free(s);
}

static double unit_ball(const double p[3]) {
    return ball(p, 1.0);
}

static double capped_ball(const double p[3]) { /* without what is above 0.9 */
    const double d = ball(p, 1.0);
    return fmax(d, p[2] - 0.9);
}

TEST(a_solid_with_holes_is_as_deep_as_without) {
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 128);
    for (int i = 0; i < 4; ++i) { /* a hole of four triangles, and one of one */
        s->indices[6000 + i][1] = s->indices[6000 + i][0];
    }
    s->indices[1500][1] = s->indices[1500][0];
    vsh_grid *grid = grid_of_shape(s, VOXEL);
    assert_false(has_sheets(grid));
    assert_is(grid, unit_ball, 2.9, 0.1, "ball with holes");
    s->vertices = s->triangles = 0;
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.9, 128);
    grid = grid_of_shape(s, VOXEL);
    assert_int_equal(wrong_blocks(grid, capped_ball, 4), 0);
    vsh_grid_free(grid);
    free(s);
}

static double room_with_door(const double p[3]) {
    /* walls of two voxels around a cube without its front's lower middle; far from the door */
    const double d = box(p, 1.0);
    return fmax(-d, d - 2.0 * VOXEL);
}

TEST(the_door_of_a_room_stays_open) {
    shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES & ~FRONT);
    shape_turn(s, 0);
    OWNED(vsh_grid) *grid = grid_of_shape(s, VOXEL);
    assert_false(has_sheets(grid));
    leaves all = leaves_of(grid);
    size_t compared = 0;
    for (size_t i = 0; i < all.count; ++i) {
        for (int v = 0; v < 512; ++v) {
            double p[3];
            voxel_position(&all, i, v, p);
            const double value = (double)all.leaf[i].values[v];
            if (fabs(p[0]) < 0.8 && fabs(p[2]) < 0.8 && p[1] < -0.5) { /* the doorway */
                assert_true(value > 0.0);
                ++compared;
            }
            if (box(p, 1.0) < -0.01 * VOXEL) { /* the air within is not touched */
                assert_true(value > 0.0);
                ++compared;
            }
            const double truth = room_with_door(p);
            if (p[1] > -0.7 && fabs(truth) < 0.9 * VOXEL) {
                assert_true(fabs(value - truth) < 0.1 * VOXEL);
                ++compared;
            }
        }
    }
    assert_true(compared > 10000);
    free(all.leaf);
    free(s);
}

static double mixed(const double p[3]) {
    const double q[3] = {p[0] - 4.0, p[1], p[2]};
    const double x = fmax(fabs(q[0]) - 1.0, 0.0), y = fmax(fabs(q[1]) - 1.0, 0.0);
    const double card = sqrt(x * x + y * y + (q[2] - 1.0) * (q[2] - 1.0)) - VOXEL;
    return fmin(box(p, 1.0), card);
}

TEST(a_card_in_a_solid_s_mesh_leaves_it_solid) {
    shape *s = shape_new();
    const double low[3] = {3, -1, -1}, high[3] = {5, 1, 1};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, low, high, TOP);
    vsh_grid *grid = grid_of_shape(s, VOXEL);
    assert_true(has_sheets(grid));
    assert_is(grid, mixed, 0.9, 0.05, "box and card");
    free(s);
}

TEST(a_face_turned_over_changes_nothing) {
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 128);
    shape_turn(s, s->triangles - 2000);
    assert_is(grid_of_shape(s, VOXEL), unit_ball, 2.9, 0.1, "ball with turned faces");
    free(s);
}

static double room_of_sheets(const double p[3]) {
    return fabs(box(p, 1.0)) - VOXEL;
}

TEST(rooms_of_separate_walls_hold_air) {
    shape *s[6];
    vsh_mesh meshes[6];
    for (int i = 0; i < 6; ++i) {
        s[i] = shape_new();
        shape_box(s[i], LOW, HIGH, 1U << i);
        meshes[i] = shape_mesh(s[i], "wall");
    }
    vsh_grid *grid = grid_of(meshes, 6, VOXEL);
    assert_true(has_sheets(grid));
    assert_is(grid, room_of_sheets, 0.9, 0.1, "six walls");
    shape_box(s[0], LOW, HIGH, ALL_SIDES & ~LEFT);
    meshes[0] = shape_mesh(s[0], "box");
    meshes[0].solidity = VSH_SOLIDITY_SHELL;
    assert_is(grid_of(meshes, 1, VOXEL), room_of_sheets, 0.9, 0.1, "a box that is to be a shell");
    for (int i = 0; i < 6; ++i) {
        free(s[i]);
    }
}

static double dome_of_sheets(const double p[3]) {
    return fmin(fabs(ball(p, 3.0)) - VOXEL, box(p, 1.0));
}

TEST(a_dome_that_looks_outwards_holds_air) {
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 3.0, -1.0, 1.0, 128);
    shape_box(s, LOW, HIGH, ALL_SIDES);
    assert_is(grid_of_shape(s, VOXEL), dome_of_sheets, 0.9, 0.1, "dome");
    free(s);
}

int main(void) {
    return run_all_tests(NULL, NULL);
}
