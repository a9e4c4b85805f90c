/* Open components that others close: what stands on something, or runs into it, and what does not. */
#include "kinds.h"

#include "mesh/face_tree.h"

static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};
static const double CUP[][2] = {{0, 0}, {1, 0}, {1, 2}};

/* A slab of 6 × 6 × 1, its top at z = 0. */
static void build_table(shape *s) {
    const double low[3] = {-3, -3, -1}, high[3] = {3, 3, 0};
    shape_box(s, low, high, ALL_SIDES);
}

/* A ground that is a sheet, at z = 0. */
static void build_ground(shape *s) {
    const double low[3] = {-5, -5, -1}, high[3] = {5, 5, 0};
    shape_box(s, low, high, TOP);
}

static void build_box(shape *s, double low, double high, unsigned sides) {
    const double from[3] = {-1, -1, low}, to[3] = {1, 1, high};
    shape_box(s, from, to, sides);
}

static void half_balls_on_a_plate_are_solid(void **state) {
    (void)state;
    shape *s = shape_new();
    static const double heights[] = {0.0, -0.1, 0.02};
    for (int i = 0; i < 3; ++i) {
        const double at[3] = {0.3, 0.1, heights[i]};
        build_table(s);
        shape_ball(s, at, 1.0, 0.0, 1.0, 24);
        assert_kinds_of(s, "half a ball on a table", "SS");
        shape_ball(s, at, 1.0, 0.0, 1.0, 24);
        build_ground(s);
        assert_kinds_of(s, "half a ball on the ground", "S-");
    }
    const double above[3] = {0.3, 0.1, 0.3}, beside[3] = {2.9, 0, 0};
    build_table(s);
    shape_ball(s, above, 1.0, 0.0, 1.0, 24);
    assert_kinds_of(s, "half a ball above a table", "S-");
    build_table(s);
    shape_ball(s, beside, 1.0, 0.0, 1.0, 24);
    assert_kinds_of(s, "half a ball over the edge of a table", "SS");
    shape_ball(s, ORIGIN, 1.0, 0.0, 1.0, 24);
    assert_kinds_of(s, "half a ball by itself", "-");
    free(s);
}

static void boxes_that_lack_the_side_they_stand_on_are_solid(void **state) {
    (void)state;
    shape *s = shape_new(), *other = shape_new();
    build_ground(s);
    build_box(s, -0.3, 2.0, ALL_SIDES & ~BOTTOM);
    assert_kinds_of(s, "house in the ground", "-S");
    const double wall_low[3] = {-5, 1, -5}, wall_high[3] = {5, 2, 5};
    shape_box(s, wall_low, wall_high, FRONT);
    shape_box(s, LOW, HIGH, ALL_SIDES & ~BACK);
    assert_kinds_of(s, "cabinet against a wall", "-S");
    shape_box(s, wall_low, wall_high, FRONT);
    shape_turn(s, 0);
    shape_box(s, LOW, HIGH, ALL_SIDES & ~BACK);
    assert_kinds_of(s, "cabinet behind a wall's back", "--");
    static const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    build_ground(s);
    build_box(other, -0.3, 2.0, ALL_SIDES & ~BOTTOM);
    vsh_mesh meshes[2] = {shape_mesh(s, "ground"), shape_mesh(other, "house")};
    meshes[0].transform = meshes[1].transform = mirror;
    assert_kinds(meshes, 2, "-S");
    meshes[1].solidity = VSH_SOLIDITY_SHELL;
    assert_kinds(meshes, 2, "--");
    free(other);
    free(s);
}

/* The probe reaches 0.08 below a hole of 2 × 2. */
static void houses_are_solid_on_slabs_of_any_thickness(void **state) {
    (void)state;
    static const double THICKNESS[] = {0.004, 0.01, 0.02, 0.05, 0.07, 0.08, 0.09, 0.1, 0.3, 1.0};
    static const double SUNK[] = {0.0, 0.01, 0.06};
    shape *s = shape_new();
    for (size_t i = 0; i < sizeof THICKNESS / sizeof *THICKNESS; ++i) {
        for (size_t k = 0; k < sizeof SUNK / sizeof *SUNK; ++k) {
            const double low[3] = {-4, -4, -THICKNESS[i]}, high[3] = {4, 4, 0}, at[3] = {0.2, 0.1, -SUNK[k]};
            char what[64];
            snprintf(what, sizeof what, "sunk by %g into a slab of %g", SUNK[k], THICKNESS[i]);
            shape_box(s, low, high, ALL_SIDES);
            build_box(s, -SUNK[k], 2.0, ALL_SIDES & ~BOTTOM);
            assert_kinds_of(s, what, "SS");
            shape_box(s, low, high, ALL_SIDES);
            shape_ball(s, at, 1.0, 0.0, 1.0, 24);
            assert_kinds_of(s, what, "SS");
            shape_box(s, low, high, ALL_SIDES);
            shape_turned(s, ORIGIN, CUP, 3, 32);
            assert_kinds_of(s, what, "S-");
        }
    }
    free(s);
}

static void vessels_that_stand_upright_are_sheets(void **state) {
    (void)state;
    shape *s = shape_new();
    build_table(s);
    shape_turned(s, ORIGIN, CUP, 3, 32);
    assert_kinds_of(s, "cup on a table", "S-");
    const double over[][2] = {{1, 0}, {1, 2}, {0, 2}};
    build_table(s);
    shape_turned(s, ORIGIN, over, 3, 32);
    assert_kinds_of(s, "cup upside down", "SS");
    build_table(s);
    shape_turned(s, ORIGIN, CUP, 3, 32);
    const double fruit[3] = {0.1, 0, 0.7}, other_fruit[3] = {0, 0.2, 1.3};
    shape_ball(s, fruit, 0.6, -1.0, 1.0, 16);
    shape_ball(s, other_fruit, 0.6, -1.0, 1.0, 16);
    assert_kinds_of(s, "cup of fruit", "S-SS");
    const double coffee[][2] = {{0.99, 1.97}, {0, 1.97}};
    shape_turned(s, ORIGIN, CUP, 3, 32);
    shape_turned(s, ORIGIN, coffee, 2, 32);
    assert_kinds_of(s, "cup of coffee", "--");
    const double heaped[3] = {0.1, 0, 2.0};
    build_table(s);
    shape_turned(s, ORIGIN, CUP, 3, 32);
    shape_ball(s, heaped, 0.8, -1.0, 1.0, 16);
    assert_kinds_of(s, "cup with a ball that sticks out of it", "S-S");
    const double shelf_low[3] = {-3, -3, 2.2}, shelf_high[3] = {3, 3, 2.4};
    build_table(s);
    shape_turned(s, ORIGIN, CUP, 3, 32);
    shape_box(s, shelf_low, shelf_high, ALL_SIDES);
    assert_kinds_of(s, "cup below a shelf", "S-S");
    free(s);
}

static void what_holds_something_is_a_sheet(void **state) {
    (void)state;
    shape *s = shape_new();
    const double low[3] = {-0.5, -0.5, 0}, high[3] = {0.5, 0.5, 0.7};
    build_ground(s);
    build_box(s, -0.3, 2.0, ALL_SIDES & ~BOTTOM);
    shape_box(s, low, high, ALL_SIDES);
    assert_kinds_of(s, "house with a table in it", "--S");
    const double cloth[][2] = {{1.2, 0.01}, {0.9, 0.3}, {0.8, 0.72}, {0, 0.72}};
    build_table(s);
    shape_turned(s, ORIGIN, cloth, 4, 32);
    shape_box(s, low, high, ALL_SIDES);
    assert_kinds_of(s, "cloth over a box", "S-S");
    free(s);
}

static void walls_without_floor_and_ceiling_are_solid_below_a_roof(void **state) {
    (void)state;
    shape *s = shape_new();
    const double chimney_low[3] = {-0.3, -0.3, -0.2}, chimney_high[3] = {0.3, 0.3, 1.5};
    build_ground(s);
    build_box(s, -0.3, 1.0, ALL_SIDES & ~BOTTOM & ~TOP);
    assert_kinds_of(s, "pen", "--");
    build_ground(s);
    shape_box(s, chimney_low, chimney_high, ALL_SIDES & ~BOTTOM & ~TOP);
    assert_kinds_of(s, "chimney", "-S");
    build_ground(s);
    build_box(s, -0.3, 1.8, ALL_SIDES & ~BOTTOM & ~TOP);
    uint32_t v[6];
    for (int i = 0; i < 6; ++i) {
        v[i] = shape_vertex(s, i % 2 ? 1.3 : -1.3,
                            i / 2 == 0   ? -1.3
                            : i / 2 == 1 ? 0.0
                                         : 1.3,
                            i / 2 == 1 ? 2.6 : 1.7);
    }
    shape_quad(s, v[0], v[1], v[3], v[2]);
    shape_quad(s, v[2], v[3], v[5], v[4]);
    assert_kinds_of(s, "house of walls and a roof", "-S-");
    const double arch[][2] = {{1, -4}, {1, 4}}, across[12] = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0};
    shape *tunnel = shape_new();
    build_ground(s);
    shape_turned(tunnel, ORIGIN, arch, 2, 32);
    vsh_mesh meshes[2] = {shape_mesh(s, "ground"), shape_mesh(tunnel, "arches")};
    size_t kept = 0;
    for (size_t i = 0; i < tunnel->triangles; ++i) { /* the upper half of a tube that lies */
        const uint32_t *t = tunnel->indices[i];
        const float y = tunnel->positions[t[0]][1] + tunnel->positions[t[1]][1] + tunnel->positions[t[2]][1];
        if (y < 0.0F) {
            memcpy(tunnel->indices[kept++], t, sizeof tunnel->indices[0]);
        }
    }
    meshes[1].triangle_count = kept;
    meshes[1].transform = across;
    assert_kinds(meshes, 2, "--");
    free(tunnel);
    free(s);
}

static void what_touches_only_by_its_edge_does_not_stand(void **state) {
    (void)state;
    shape *s = shape_new();
    const double low[3] = {2.8, -1, 0}, high[3] = {4.8, 1, 4};
    build_table(s);
    shape_box(s, low, high, ALL_SIDES & ~BOTTOM);
    assert_kinds_of(s, "tower with a tenth of its foot on a table", "S-");
    const double in_low[3] = {0.8, -1, 0}, in_high[3] = {2.8, 1, 4};
    build_table(s);
    shape_box(s, in_low, in_high, ALL_SIDES & ~BOTTOM);
    assert_kinds_of(s, "tower on a table", "SS");
    free(s);
}

static void roofs_cover_what_is_near_below_their_backs(void **state) {
    (void)state;
    shape *s = shape_new();
    static const struct {
        const char *name, *kinds;
        double height, half;
        unsigned sides;
    } cases[] = {{"pen below the back of a sheet", "-S-", 1.1, 1.5, TOP},
                 {"pen below its front", "---", 1.1, 1.5, BOTTOM},
                 {"pen far below its back", "---", 6.0, 15.0, TOP}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        const double half = cases[i].half, z = cases[i].height;
        const double low[3] = {-half, -half, z}, high[3] = {half, half, z};
        build_ground(s);
        build_box(s, -0.3, 1.0, ALL_SIDES & ~BOTTOM & ~TOP);
        shape_box(s, low, high, cases[i].sides);
        assert_kinds_of(s, cases[i].name, cases[i].kinds);
    }
    free(s);
}

static void what_is_sunk_into_a_solid_stands_in_it(void **state) {
    (void)state;
    shape *s = shape_new();
    build_table(s);
    build_box(s, -0.9, 0.1, ALL_SIDES & ~BOTTOM);
    assert_kinds_of(s, "box sunk into a table", "SS");
    free(s);
}

static void what_is_mostly_outside_is_not_held(void **state) {
    (void)state;
    shape *s = shape_new();
    const double low[3] = {0.45, 0.45, 0.01}, high[3] = {0.95, 0.95, 0.5};
    build_table(s);
    shape_ball(s, ORIGIN, 1.0, 0.0, 1.0, 24);
    shape_box(s, low, high, ALL_SIDES);
    assert_kinds_of(s, "half a ball with a box in its side", "SSS");
    free(s);
}

static void face_corners(const void *user, vshi_face face, vshi_vec corner[3]) {
    const vshi_vec(*corners)[3] = user;
    memcpy(corner, corners[face.number], 3 * sizeof *corner);
}

/* By solving for the point in the triangle's own axes. */
static bool segment_meets(vshi_vec from, vshi_vec to, const vshi_vec corner[3], double *at, int *out) {
    const vshi_vec u = vshi_sub(corner[1], corner[0]), v = vshi_sub(corner[2], corner[0]);
    const vshi_vec along = vshi_sub(to, from), off = vshi_sub(from, corner[0]);
    const vshi_vec p = vshi_cross(along, v), q = vshi_cross(off, u);
    const double det = vshi_dot(u, p), a = vshi_dot(off, p) / det, b = vshi_dot(along, q) / det;
    *at = vshi_dot(v, q) / det;
    *out = det < 0.0 ? 1 : -1;
    return a >= 0.0 && b >= 0.0 && a + b <= 1.0 && *at >= 0.0 && *at <= 1.0;
}

/* Random triangles, by what a loop over all their faces says. */
static void a_tree_of_faces_finds_what_a_loop_finds(void **state) {
    (void)state;
    enum { FACES = 700, SEGMENTS = 400, MOST = 64 };
    static vshi_vec corner[FACES][3];
    static vshi_face faces[FACES];
    uint32_t seed = 1;
    for (size_t i = 0; i < FACES; ++i) {
        double at[6];
        for (int k = 0; k < 6; ++k) {
            seed = 1664525U * seed + 1013904223U;
            at[k] = (double)(seed >> 8) / 16777216.0;
        }
        corner[i][0] = (vshi_vec){at[0], at[1], at[2]};
        corner[i][1] = (vshi_vec){at[0] + 0.3 * at[3], at[1], at[2] + 0.2 * at[4]};
        corner[i][2] = (vshi_vec){at[0], at[1] + 0.3 * at[5], at[2] - 0.1 * at[4]};
        faces[i] = (vshi_face){(uint32_t)i, (uint32_t)i};
    }
    vshi_face_tree *tree = NULL;
    vsh_error error;
    assert_int_equal(vshi_face_tree_create(faces, FACES, face_corners, corner, &tree, &error), VSH_OK);
    size_t crossed = 0;
    for (int i = 0; i < SEGMENTS; ++i) {
        double at[6];
        for (int k = 0; k < 6; ++k) {
            seed = 1664525U * seed + 1013904223U;
            at[k] = (double)(seed >> 8) / 16777216.0;
        }
        const vshi_vec from = {at[0], at[1], at[2]}, to = {at[3], at[4], at[5]};
        vshi_face_crossing found[MOST];
        const size_t count = vshi_face_tree_cross(tree, from, to, found, MOST);
        size_t expected = 0;
        for (uint32_t f = 0; f < FACES; ++f) {
            double where;
            int out;
            if (!segment_meets(from, to, corner[f], &where, &out)) {
                continue;
            }
            ++expected;
            bool told = false;
            for (size_t k = 0; k < count; ++k) {
                told = told ||
                       (found[k].component == f && found[k].out == out && fabs(found[k].at - where) < 1e-9);
            }
            assert_true(told);
        }
        assert_int_equal(count, expected);
        for (size_t k = 1; k < count; ++k) {
            assert_true(found[k - 1].at <= found[k].at);
        }
        crossed += count;
    }
    assert_true(crossed > SEGMENTS);
    vshi_face_tree_free(tree);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_balls_on_a_plate_are_solid),
        cmocka_unit_test(boxes_that_lack_the_side_they_stand_on_are_solid),
        cmocka_unit_test(houses_are_solid_on_slabs_of_any_thickness),
        cmocka_unit_test(vessels_that_stand_upright_are_sheets),
        cmocka_unit_test(what_holds_something_is_a_sheet),
        cmocka_unit_test(walls_without_floor_and_ceiling_are_solid_below_a_roof),
        cmocka_unit_test(what_touches_only_by_its_edge_does_not_stand),
        cmocka_unit_test(roofs_cover_what_is_near_below_their_backs),
        cmocka_unit_test(what_is_sunk_into_a_solid_stands_in_it),
        cmocka_unit_test(what_is_mostly_outside_is_not_held),
        cmocka_unit_test(a_tree_of_faces_finds_what_a_loop_finds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
