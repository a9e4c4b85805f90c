/* Points that see only the inner sides of solids that lack a side are hidden. */
#include "kinds.h"
#include "testing.h"

#include "shade/inside.h"
#include "trace/embree.h"

static const double ORIGIN[3] = {0, 0, 0};
static const double CUP[][2] = {{0, 0}, {1, 0}, {1, 2}};

/* Whether points that look up are hidden among the triangles of a mesh. */
static void assert_mesh_hides(const vsh_mesh *mesh, const double at[][3], size_t count, bool hidden) {
    OWNED(vsh_triangles) *triangles = NULL;
    assert_ok(vsh_triangles_create(mesh, 1, NULL, &triangles, &failure));
    for (size_t i = 0; i < count; ++i) {
        uint8_t where;
        vshi_inside(triangles, 1, at[i], (const float[]){0, 0, 1}, NULL, NULL, NULL, &where);
        assert_that((where == VSHI_INSIDE) == hidden, "%s: point (%g, %g, %g) is %s", mesh->name, at[i][0],
                    at[i][1], at[i][2], hidden ? "not hidden" : "hidden");
    }
}

/* Among those of a shape, which is emptied. */
static void assert_hidden(shape *s, const char *what, const double at[][3], size_t count, bool hidden) {
    const vsh_mesh mesh = shape_mesh(s, what);
    assert_mesh_hides(&mesh, at, count, hidden);
    s->vertices = s->triangles = 0;
}

static void add_ground(shape *s, double thickness) {
    const double low[3] = {-4, -4, -thickness}, high[3] = {4, 4, 0};
    shape_box(s, low, high, thickness > 0.0 ? ALL_SIDES : TOP);
}

static void add_box(shape *s, double low, double high, unsigned sides) {
    const double from[3] = {-1, -1, low}, to[3] = {1, 1, high};
    shape_box(s, from, to, sides);
}

/* A house without its bottom on ground. */
static void add_house(shape *s, double thickness, double sunk) {
    add_ground(s, thickness);
    add_box(s, -sunk, 2.0, ALL_SIDES & ~BOTTOM);
}

static const double BELOW[][3] = {
    {0, 0, 0}, {0.6, 0.3, 0}, {-0.97, 0.1, 0}, {0.9, -0.95, 0}, {0.999, 0.4, 0}};
static const double BESIDE[][3] = {{1.001, 0, 0}, {-1.02, 0.4, 0}, {1.5, -1.2, 0}, {0, 3, 0}};
enum { POINTS_BELOW = 5, POINTS_BESIDE = 4 };

TEST(floors_below_houses_without_floors_are_hidden) {
    static const double THICKNESS[] = {0.0, 0.004, 0.01, 0.05, 0.1, 1.0}, SUNK[] = {0.0, 0.01, 0.3};
    FREED shape *s = shape_new();
    for (size_t i = 0; i < sizeof THICKNESS / sizeof *THICKNESS; ++i) {
        for (size_t k = 0; k < sizeof SUNK / sizeof *SUNK; ++k) {
            char what[80];
            snprintf(what, sizeof what, "ground of thickness %g, house sunk by %g", THICKNESS[i], SUNK[k]);
            add_house(s, THICKNESS[i], SUNK[k]);
            assert_hidden(s, what, BELOW, POINTS_BELOW, true);
            add_house(s, THICKNESS[i], SUNK[k]);
            assert_hidden(s, what, BESIDE, POINTS_BESIDE, false);
        }
    }
    static const double mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    add_house(s, 0.0, 0.3);
    vsh_mesh mesh = shape_mesh(s, "mirrored house");
    mesh.transform = mirror;
    assert_mesh_hides(&mesh, BELOW, POINTS_BELOW, true);
}

/* Ground in a house that lacks a wall sees out by that side. */
TEST(walls_below_a_roof_hide_the_floor_and_a_pen_or_three_walls_do_not) {
    const double low[3] = {-1.5, -1.5, 1.8}, high[3] = {1.5, 1.5, 2.0};
    FREED shape *s = shape_new();
    add_ground(s, 0.0);
    add_box(s, -0.3, 2.0, ALL_SIDES & ~BOTTOM & ~TOP);
    shape_box(s, low, high, ALL_SIDES & ~BOTTOM);
    assert_hidden(s, "walls below a roof", BELOW, POINTS_BELOW, true);
    add_ground(s, 0.0);
    add_box(s, -0.3, 1.0, ALL_SIDES & ~BOTTOM & ~TOP);
    assert_hidden(s, "a pen", BELOW, POINTS_BELOW, false);
    add_ground(s, 0.0);
    add_box(s, -0.3, 2.0, ALL_SIDES & ~BOTTOM & ~FRONT);
    assert_hidden(s, "a house without a front", BELOW, POINTS_BELOW, false);
}

TEST(contents_of_cups_are_seen) {
    static const double fruit[3] = {0.1, 0, 0.7}, top[][3] = {{0.1, 0, 1.3}},
                        coffee[][2] = {{0.99, 1.5}, {0, 1.5}};
    static const double surface[][3] = {{0, 0, 1.5}, {0.7, 0.2, 1.5}},
                        bottom[][3] = {{0, 0, 0.01}, {0.5, 0, 0.01}};
    static const double over[][2] = {{1, 0}, {1, 2}, {0, 2}}, on_table[][3] = {{0, 0, 0}, {0.9, 0, 0}};
    FREED shape *s = shape_new();
    shape_turned(s, ORIGIN, CUP, 3, 32);
    shape_ball(s, fruit, 0.6, -1.0, 1.0, 16);
    assert_hidden(s, "fruit in a cup", top, 1, false);
    shape_turned(s, ORIGIN, CUP, 3, 32);
    shape_turned(s, ORIGIN, coffee, 2, 32);
    assert_hidden(s, "coffee in a cup", surface, 2, false);
    shape_turned(s, ORIGIN, CUP, 3, 32);
    assert_hidden(s, "the bottom of a cup", bottom, 2, false);
    add_ground(s, 0.1);
    shape_turned(s, ORIGIN, over, 3, 32);
    assert_hidden(s, "a table below a cup upside down", on_table, 2, true);
}

TEST(sheets_by_name_hide_nothing) {
    FREED shape *s = shape_new();
    add_house(s, 0.0, 0.3);
    vsh_mesh mesh = shape_mesh(s, "house");
    mesh.solidity = VSH_SOLIDITY_SHELL;
    OWNED(vshi_solidity) *found = solidity_of(&mesh, 1);
    const uint8_t *holed = vshi_solidity_holed(found, 0);
    for (size_t i = 0; i < mesh.triangle_count; ++i) {
        assert_int_equal(holed[i], VSHI_SIDE_SHEET);
    }
}
