/* Level sets of meshes, against closed forms: solids, open meshes, meshes that nobody should make, and the
 * band voxel by voxel. */
#include "geometry/mesh.h"
#include "grids.h"
#include "shapes.h"

static const double VOXEL = 0.05;
static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

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

/* Within `bound` voxels of the truth, and of its sign everywhere; inside down to `inside` voxels. Frees the
 * grid. */
static void assert_is(vsh_grid *grid, truth_fn *truth, double inside, double bound) {
    assert_less(worst_error(grid, truth, inside, 2.95), bound);
    assert_int_equal(wrong_blocks(grid, truth, 10), 0);
    vsh_grid_free(grid);
}

/* --- closed solids */

TEST(a_fine_mesh_of_a_sphere_is_the_sphere) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 254);
    vsh_mesh mesh = shape_mesh(s, "ball");
    assert_is(grid_of(&mesh, 1, with_voxel(0.03)), unit_sphere, 2.95, 0.1);
    shape_turn(s, 0);
    mesh.solidity = VSH_SOLIDITY_SOLID;
    assert_is(grid_of(&mesh, 1, with_voxel(0.03)), unit_sphere, 2.95, 0.1);
    shape_turn(s, 0);
    shape_turn(s, s->triangles - 2000);
    mesh.solidity = VSH_SOLIDITY_AUTO;
    assert_is(grid_of(&mesh, 1, with_voxel(0.03)), unit_sphere, 2.95, 0.1);
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

TEST(a_sky_dome_keeps_its_contents_and_one_that_looks_outwards_holds_air) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 3.0, -1.0, 1.0, 128);
    const size_t dome = s->triangles;
    shape_box(s, LOW, HIGH, ALL_SIDES);
    assert_is(grid_of_shape(s, VOXEL), dome_of_sheets, 0.9, 0.1);
    shape_turn(s, 0);
    shape_turn(s, dome);
    vsh_grid *grid = grid_of_shape(s, VOXEL);
    assert_true(grid_info(grid).shell_thickness == 0.0);
    assert_is(grid, dome_and_cube, 0.9, 0.1);
}

static double house(const double p[3]) {
    return fmin(fmax(to_box(p, 2.0), -to_box(p, 1.0)), to_box(p, 0.5));
}

TEST(houses_have_rooms_with_furniture_in_one_mesh_or_many) {
    static const double half[3] = {0.5, 1.0, 2.0}, mirrored[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0};
    FREED shape *one = shape_new(), *two = shape_new(), *three = shape_new();
    for (int i = 0; i < 4; ++i) {
        const int split = i % 2;
        shape *const parts[3] = {one, split ? two : one, split ? three : one};
        vsh_mesh meshes[3];
        one->vertices = one->triangles = two->vertices = two->triangles = three->vertices = three->triangles =
            0;
        for (int k = 0; k < 3; ++k) {
            const double low[3] = {-half[k], -half[k], -half[k]}, high[3] = {half[k], half[k], half[k]};
            const size_t first = parts[k]->triangles;
            shape_box(parts[k], low, high, ALL_SIDES);
            shape_turn(parts[k], k == 1 ? first : parts[k]->triangles);
            meshes[k] = shape_mesh(parts[k], "part");
            meshes[k].transform = i < 2 ? NULL : mirrored;
        }
        meshes[0].triangle_count = one->triangles;
        meshes[0].vertex_count = one->vertices;
        assert_is(grid_of(meshes, split ? 3 : 1, with_voxel(VOXEL)), house, 2.9, 0.05);
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
    assert_is(grid_of(&mesh, 1, with_voxel(VOXEL)), room, 0.9, 0.02);
    mesh.solidity = VSH_SOLIDITY_SOLID;
    assert_is(grid_of(&mesh, 1, with_voxel(VOXEL)), unit_cube, 2.9, 0.02);
}

TEST(the_door_of_a_room_stays_open) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES & ~FRONT);
    shape_turn(s, 0);
    OWNED(vsh_grid) *grid = grid_of_shape(s, VOXEL);
    assert_true(grid_info(grid).shell_thickness == 0.0);
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
    FREED shape *s = shape_new();
    vsh_mesh walls[6];
    for (int i = 0; i < 6; ++i) {
        const size_t first = s->triangles;
        shape_box(s, LOW, HIGH, 1U << i);
        walls[i] = shape_mesh(s, "wall");
        walls[i].indices += 3 * first;
        walls[i].triangle_count -= first;
    }
    vsh_grid *grid = grid_of(walls, 6, with_voxel(VOXEL));
    assert_true(grid_info(grid).shell_thickness > 0.0);
    assert_is(grid, room_of_sheets, 0.9, 0.1);
    vsh_mesh box = shape_mesh(s, "box");
    box.solidity = VSH_SOLIDITY_SHELL;
    assert_is(grid_of(&box, 1, with_voxel(VOXEL)), room_of_sheets, 0.9, 0.1);
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
    assert_near(grid_info(grid).shell_thickness, 0.08, 1e-12);
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

TEST(a_solid_with_holes_is_as_deep_as_without_and_reported) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 128);
    static const char *const told[] = {"3 open edges around 1 hole in 1 of 1 component", "around 2 holes"};
    s->indices[1500][1] = s->indices[1500][0]; /* a hole of one triangle; then another one, of four */
    for (int holes = 1; holes <= 2; ++holes) {
        for (int i = 0; holes == 2 && i < 4; ++i) {
            s->indices[6000 + i][1] = s->indices[6000 + i][0];
        }
        vsh_grid *grid = grid_of_shape(s, VOXEL);
        assert_true(grid_info(grid).shell_thickness == 0.0);
        assert_warned_once(told[holes - 1]);
        assert_warned_once("closed over the holes");
        assert_is(grid, unit_sphere, 2.9, 0.1);
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
    assert_true(grid_info(grid).shell_thickness > 0.0);
    assert_is(grid, mixed, 0.9, 0.05);
}

/* --- meshes that nobody should make */

TEST(duplicate_faces_and_triangles_without_area_change_nothing) {
    static const uint32_t degenerate[6] = {3, 3, 3, 0, 1, 0};
    static const size_t counts[] = {13, 24, 26};
    uint32_t indices[78];
    vsh_mesh mesh = cube();
    memcpy(indices, mesh.indices, 36 * sizeof *indices);
    memcpy(indices + 36, mesh.indices, 36 * sizeof *indices);
    memcpy(indices + 72, degenerate, sizeof degenerate);
    mesh.indices = indices;
    for (int i = 0; i < 3; ++i) {
        mesh.triangle_count = counts[i];
        assert_is(grid_of(&mesh, 1, with_voxel(0.1)), unit_cube, 2.9, 0.02);
    }
}

TEST(faces_that_disagree_are_reported_and_make_the_same_solid) {
    uint32_t some_turned[36];
    vsh_mesh mesh = cube();
    for (size_t i = 0; i < 36; ++i) {
        some_turned[i] = mesh.indices[i % 9 == 1 ? i + 1 : i % 9 == 2 ? i - 1 : i];
    }
    mesh.indices = some_turned;
    assert_is(grid_of(&mesh, 1, with_voxel(0.1)), unit_cube, 2.9, 0.02);
    assert_non_null(strstr(warned, "4 triangles that face the other way"));
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
    mesh.indices = (const uint32_t[3]){0, 1, 8};
    mesh.triangle_count = 1;
    assert_refused(mesh, defaults, 0, VSH_ERROR_INPUT, "there are only 8");
    mesh.triangle_count = 0;
    assert_refused(mesh, defaults, 0, VSH_ERROR_INPUT, "without a triangle");
    vsh_grid *grid = NULL;
    assert_fails(vsh_grid_from_meshes(NULL, 0, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT, "no meshes");
}

TEST(vertices_out_of_the_world_are_refused) {
    static const float values[] = {1e30f, -3e38f, NAN, -INFINITY};
    const vsh_grid_options options[2] = {with_voxel(0.1), vsh_grid_options_default()};
    float bad[24];
    for (size_t i = 0; i < 2 * COUNT_OF(values); ++i) {
        const bool finite = isfinite(values[i / 2]);
        const vsh_mesh mesh = box_mesh(bad, LOW, HIGH);
        bad[14] = values[i / 2];
        assert_refused(mesh, options[i % 2], 0, finite ? VSH_ERROR_LIMIT : VSH_ERROR_INPUT,
                       finite ? "" : "vertex 4");
    }
    /* and all of it out there: its voxels would be too large */
    const double far = 1e30;
    const vsh_mesh mesh = box_mesh(bad, (double[3]){-far, -far, -far}, (double[3]){far, far, far});
    assert_refused(mesh, options[1], 0, VSH_ERROR_LIMIT, "voxel size");
}

/* --- the band, voxel by voxel: distances against every triangle, sides against counted crossings */

#define ERROR_MOST 1e-3 /* voxels */

static double to_segment(vshi_vec p, vshi_vec a, vshi_vec b) {
    const vshi_vec ab = vshi_sub(b, a), ap = vshi_sub(p, a);
    const double length = vshi_dot(ab, ab);
    const double t = length > 0.0 ? fmin(fmax(vshi_dot(ap, ab) / length, 0.0), 1.0) : 0.0;
    return vshi_length(vshi_sub(ap, vshi_scale(ab, t)));
}

/* Solves for the foot of p on the plane; if that is outside the triangle, an edge is the nearest. */
static double to_triangle(vshi_vec p, const vshi_vec corner[3]) {
    const vshi_vec u = vshi_sub(corner[1], corner[0]), v = vshi_sub(corner[2], corner[0]),
                   w = vshi_sub(p, corner[0]), normal = vshi_cross(u, v);
    const double area = vshi_dot(normal, normal), b = vshi_dot(vshi_cross(u, w), normal),
                 c = vshi_dot(vshi_cross(w, v), normal);
    if (area > 0.0 && b >= 0.0 && c >= 0.0 && b + c <= area) {
        return fabs(vshi_dot(w, normal)) / sqrt(area);
    }
    return fmin(to_segment(p, corner[0], corner[1]),
                fmin(to_segment(p, corner[1], corner[2]), to_segment(p, corner[2], corner[0])));
}

static double to_shape(const double p[3], const shape *s) {
    const vsh_mesh mesh = shape_mesh(s, "shape");
    double least = DBL_MAX;
    for (size_t i = 0; i < s->triangles; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(&mesh, i, corner);
        least = fmin(least, to_triangle(vshi_vec_of(p), corner));
    }
    return least;
}

/* Whether a ray from p crosses an odd number of triangles. */
static int is_inside(const double p[3], const shape *s) {
    const vshi_vec direction = {0.331662, 0.712317, 0.618583};
    const vsh_mesh mesh = shape_mesh(s, "shape");
    int odd = 0;
    for (size_t i = 0; i < s->triangles; ++i) {
        vshi_vec corner[3];
        vshi_mesh_triangle(&mesh, i, corner);
        const vshi_vec u = vshi_sub(corner[1], corner[0]), v = vshi_sub(corner[2], corner[0]),
                       w = vshi_sub(vshi_vec_of(p), corner[0]), wu = vshi_cross(w, u),
                       dv = vshi_cross(direction, v);
        const double scale = 1.0 / vshi_dot(u, dv), a = scale * vshi_dot(w, dv),
                     b = scale * vshi_dot(direction, wu);
        odd ^= a >= 0.0 && b >= 0.0 && a + b <= 1.0 && scale * vshi_dot(v, wu) > 0.0;
    }
    return odd;
}

/* A closed surface with bumps and hollows. It has no folds narrower than a voxel, which hold no voxel and
 * would be closed. */
static shape *bumpy(int rows, double amplitude) {
    shape *s = shape_new();
    const int columns = 2 * rows;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column < (row == 0 || row == rows ? 1 : columns); ++column) {
            const double polar = 3.14159265358979 * row / rows, around = 3.14159265358979 * column / rows;
            const double x = sin(polar) * cos(around), y = cos(polar), z = sin(polar) * sin(around);
            const double r = 1.0 + amplitude * (sin(7.0 * x + 3.0 * y) + sin(9.0 * y + 2.0 * z) +
                                                sin(11.0 * z + 5.0 * x) + 0.5 * sin(31.0 * x * y + 23.0 * z));
            shape_vertex(s, r * x, r * y, r * z);
        }
    }
    const uint32_t last = (uint32_t)s->vertices - 1;
    for (int row = 0; row < rows; ++row) {
        for (int column = 0; column < columns; ++column) {
            const int next = (column + 1) % columns;
            const uint32_t up = (uint32_t)(1 + (row - 1) * columns), down = (uint32_t)(1 + row * columns);
            if (row > 0) {
                shape_triangle(s, up + (uint32_t)column, up + (uint32_t)next,
                               row == rows - 1 ? last : down + (uint32_t)column);
            }
            if (row < rows - 1) {
                shape_triangle(s, row == 0 ? 0 : up + (uint32_t)next, down + (uint32_t)next,
                               down + (uint32_t)column);
            }
        }
    }
    return s;
}

static vsh_grid *band_of(const shape *s, double voxel, double half_width, int32_t solidity) {
    vsh_mesh mesh = shape_mesh(s, "mesh");
    mesh.solidity = solidity;
    vsh_grid_options options = with_voxel(voxel);
    options.half_width = half_width;
    return grid_of(&mesh, 1, options);
}

/* Some `count` voxels of all leaves, against the triangles. Voxels farther than the half width have it. */
static void compare(const shape *s, const vsh_grid *grid, size_t count) {
    FREED_BY(free_leaves) leaves all = leaves_of(grid);
    const double voxel = all.info.voxel_size;
    const size_t step = all.count * 512 / count | 1;
    double worst = 0.0;
    size_t wrong = 0, near = 0;
    for (size_t i = 0; i < all.count * 512; i += step) {
        double p[3];
        const double value = value_at(&all, i, p) / voxel;
        const double truth = fmin(to_shape(p, s) / voxel, all.info.half_width);
        worst = fmax(worst, fabs(fabs(value) - truth));
        wrong += truth > ERROR_MOST && (value < 0.0) != is_inside(p, s);
        near += truth < all.info.half_width;
    }
    assert_true(near > count / 4);
    assert_less(worst, ERROR_MOST);
    assert_int_equal(wrong, 0);
}

TEST(distances_are_to_the_nearest_triangle_and_sides_by_crossings) {
    const struct {
        int rows;
        double amplitude, voxel, half_width;
    } cases[] = {
        {6, 0.02, 0.02, 3.0},  /* triangles of many voxels */
        {24, 0.05, 0.03, 3.0}, /* of some */
        {70, 0.06, 0.06, 3.0}, /* of less than one */
        {40, 0.08, 0.06, 3.0}, /* with folds */
        {24, 0.05, 0.05, 20.0} /* a wide band */
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        FREED shape *s = bumpy(cases[i].rows, cases[i].amplitude);
        OWNED(vsh_grid) *grid = band_of(s, cases[i].voxel, cases[i].half_width, VSH_SOLIDITY_SOLID);
        compare(s, grid, 1500);
    }
}

/* A box whose faces are fans of needles around a point near one of their edges. */
static shape *needles(void) {
    enum { ACROSS = 400 };
    shape *s = shape_new();
    for (int face = 0; face < 6; ++face) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const uint32_t first = (uint32_t)s->vertices;
        for (int i = 0; i <= 4 * ACROSS; ++i) {
            const int side = i / ACROSS % 4;
            const double t = -1.0 + 2.0 * (i % ACROSS) / ACROSS;
            const double along[4][2] = {{t, -1.0}, {1.0, t}, {-t, 1.0}, {-1.0, -t}};
            double p[3];
            p[axis] = face % 2 == 0 ? -1.0 : 1.0;
            p[u] = i == 4 * ACROSS ? 0.3 : along[side][0];
            p[v] = i == 4 * ACROSS ? -0.9999 : along[side][1];
            shape_vertex(s, p[0], p[1], p[2]);
        }
        for (uint32_t i = 0; i < 4 * ACROSS; ++i) {
            shape_triangle(s, first + i, first + (i + 1) % (4 * ACROSS), first + 4 * ACROSS);
        }
    }
    return s;
}

TEST(needles_are_as_exact_as_others) {
    FREED shape *s = needles();
    const double voxels[] = {0.031, 0.11, 0.007};
    for (size_t i = 0; i < COUNT_OF(voxels); ++i) {
        OWNED(vsh_grid) *grid = band_of(s, voxels[i], 3.0, VSH_SOLIDITY_SOLID);
        assert_less(worst_error(grid, unit_cube, 2.99, 2.99), ERROR_MOST);
    }
}

/* Needles alone in space, as sheets, along the voxels' middles: beyond their ends is nothing. */
TEST(a_lone_needle_ends_where_it_ends) {
    const double heights[] = {1e-1, 1e-3, 1e-5, 1e-6}; /* voxels */
    const double voxel = 1.0 / 128.0;
    for (size_t k = 0; k < COUNT_OF(heights); ++k) {
        FREED shape *s = shape_new();
        const double height = heights[k] * voxel;
        shape_triangle(s, shape_vertex(s, -0.3125, -0.3125, 0.0), shape_vertex(s, 0.3125, 0.3125, 0.0),
                       shape_vertex(s, 0.01 - height, 0.01 + height, 0.0));
        OWNED(vsh_grid) *grid = band_of(s, voxel, 3.0, VSH_SOLIDITY_SHELL);
        FREED_BY(free_leaves) leaves all = leaves_of(grid);
        const double background = all.info.half_width * voxel, half = 0.5 * all.info.shell_thickness;
        double worst = 0.0;
        for (size_t i = 0; i < all.count * 512; ++i) {
            double p[3];
            const double value = value_at(&all, i, p);
            const double truth = fmin(fmax(to_shape(p, s) - half, -background), background);
            worst = fmax(worst, fabs(value - truth) / voxel);
        }
        assert_less(worst, ERROR_MOST);
    }
}

/* Two boxes that overlap to a cube: faces within it do not count, though depth may be less near their ends.
 */
TEST(depth_is_to_the_surface_of_the_union) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, (const double[3]){0.43, 1, 1}, ALL_SIDES);
    shape_box(s, (const double[3]){-0.31, -1, -1}, HIGH, ALL_SIDES);
    assert_is(band_of(s, VOXEL, 6.0, VSH_SOLIDITY_SOLID), unit_cube, 5.9, 2.0);
}
