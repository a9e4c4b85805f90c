/* What components are taken for by themselves: solids and sheets. How much they enclose is compared with
 * winding numbers that are summed over all triangles here. */
#include "kinds.h"
#include "testing.h"

#include "mesh/edges.h"

static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

static const vshi_component *only_component(const vshi_solidity *s) {
    size_t count;
    const vshi_component *c = vshi_solidity_components(s, &count);
    assert_int_equal(count, 1);
    return c;
}

TEST(closed_surfaces_that_look_outwards_are_solid) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    const vsh_mesh box = shape_mesh(s, "box");
    OWNED(vshi_solidity) *found = solidity_of(&box, 1);
    assert_sides(found, 0, &box, VSHI_SIDE_BEHIND);
    const vshi_component *c = only_component(found);
    assert_float_equal(c->volume, 8.0, 1e-12);
    assert_float_equal(c->area, 24.0, 1e-12);
    assert_true(c->enclosed == 1.0 && c->open_edges == 0 && c->holes == 0);
}

/* An edge of three triangles, of which others are given again and again: what goes on in what, and what is
 * open, is as if they were not. */
TEST(triangles_given_thrice_at_an_edge_of_three_change_nothing) {
    static const float corners[] = {0, 0, 0, 0, 0, 1, 1, 0, 0, -1, 0.5f, 0, -1, -0.5f, 0};
    static const uint32_t fan[] = {0, 1, 2, 0, 1, 3, 1, 0, 4, 0, 1, 2, 0, 1,
                                   2, 0, 1, 3, 1, 0, 4, 1, 0, 4, 1, 0, 4};
    vsh_mesh mesh = {.positions = corners, .vertex_count = 5, .indices = fan, .triangle_count = 3};
    vshi_components once, again;
    assert_ok(vshi_components_find(&mesh, 0, &once, &failure));
    assert_int_equal(once.rim_count, 7); /* six outer edges, and what ends at the one of three */
    mesh.triangle_count = sizeof fan / sizeof *fan / 3;
    vshi_edges edges;
    assert_ok(vshi_edges_find(&mesh, 0, false, &edges, &failure));
    for (uint32_t side = 0; side < 9; ++side) {
        const uint32_t partner = edges.partner[side];
        assert_true(partner == VSHI_NO_PARTNER || (partner != side && edges.partner[partner] == side));
    }
    assert_int_equal(edges.open, 7);
    vshi_edges_free(&edges);
    assert_ok(vshi_components_find(&mesh, 0, &again, &failure));
    assert_int_equal(again.count, once.count);
    assert_int_equal(again.rim_count, once.rim_count);
    assert_memory_equal(again.rims, once.rims, once.rim_count * sizeof *once.rims);
    vshi_components_free(&once);
    vshi_components_free(&again);
}

TEST(a_mirrored_mesh_looks_the_same_way) {
    FREED shape *s = shape_new();
    static const double mirror[12] = {-2, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    vsh_mesh box = shape_mesh(s, "mirrored box");
    box.transform = mirror;
    OWNED(vshi_solidity) *found = solidity_of(&box, 1);
    const vshi_component *c = only_component(found);
    assert_true(c->kind == VSHI_KIND_SOLID && !c->inward);
    assert_float_equal(c->volume, 16.0, 1e-12);
    assert_sides(found, 0, &box, VSHI_SIDE_BEHIND);
}

TEST(faces_that_look_the_wrong_way_are_turned) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 24);
    for (size_t i = 0; i < s->triangles; i += 5) {
        const uint32_t kept = s->indices[i][0];
        s->indices[i][0] = s->indices[i][1];
        s->indices[i][1] = kept;
    }
    const vsh_mesh ball = shape_mesh(s, "mixed ball");
    OWNED(vshi_solidity) *found = solidity_of(&ball, 1);
    const uint8_t *sides = vshi_solidity_sides(found, 0);
    const vshi_component *c = only_component(found);
    assert_true(c->kind == VSHI_KIND_SOLID);
    assert_int_equal(c->turned, (ball.triangle_count + 4) / 5);
    for (size_t i = 0; i < ball.triangle_count; ++i) {
        assert_int_equal(sides[i], i % 5 == 0 ? VSHI_SIDE_BEFORE : VSHI_SIDE_BEHIND);
    }
}

TEST(small_holes_do_not_make_a_solid_hollow) {
    FREED shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 48);
    s->indices[700][1] = s->indices[700][0]; /* three holes */
    s->indices[300][1] = s->indices[300][0];
    s->indices[301][1] = s->indices[301][0];
    const vsh_mesh ball = shape_mesh(s, "ball with holes");
    OWNED(vshi_solidity) *found = solidity_of(&ball, 1);
    const vshi_component *c = only_component(found);
    assert_true(c->kind == VSHI_KIND_SOLID && c->enclosed > 0.99);
    assert_true(c->holes == 2 && c->open_edges == 7);
    shape_turn(s, 0);
    assert_kinds_of(s, "the same inwards", "W");
    shape_ball(s, ORIGIN, 1.0, -0.9, 0.9, 48);
    assert_kinds_of(s, "ball open above and below", "S");
    const double head[][2] = {{0.22, 0}, {0.22, 0.15}, {0.35, 0.3}, {0.4, 0.5}, {0.3, 0.7}, {0, 0.75}};
    shape_turned(s, ORIGIN, head, 6, 48);
    assert_kinds_of(s, "head open at its neck", "S");
    const double trunk[][2] = {{0.3, 0}, {0.2, 4}};
    shape_turned(s, ORIGIN, trunk, 2, 24);
    assert_kinds_of(s, "trunk", "S");
}

/* Of many meshes, on any number of threads, each is found to be what it is alone, and is closed by its own
 * caps. */
TEST(meshes_with_holes_are_each_what_they_are_alone) {
    enum { MESHES = 9 };
    shape *shapes[MESHES];
    vsh_mesh meshes[MESHES];
    vshi_solidity *alone[MESHES], *together;
    size_t all_caps = 0;
    for (int m = 0; m < MESHES; ++m) { /* balls far apart, some closed, others open more or less */
        shapes[m] = shape_new();
        shape_ball(shapes[m], (double[]){10.0 * m, 0, 0}, 1.0 + 0.1 * m, m % 3 == 0 ? -1.0 : -0.9 + 0.05 * m,
                   1.0, 12 + 4 * m);
        meshes[m] = shape_mesh(shapes[m], "ball");
        alone[m] = solidity_of(&meshes[m], 1);
    }
    for (int32_t threads = 1; threads <= 3; threads += 2) {
        const vsh_run run = run_on(threads);
        assert_ok(vshi_solidity_create(meshes, MESHES, &run, &together, &failure));
        for (size_t m = 0; m < MESHES; ++m) {
            size_t own, other;
            const vshi_component *a = vshi_solidity_of_whole(alone[m], 0, &own);
            const vshi_component *b = vshi_solidity_of_whole(together, m, &other);
            assert_true(own == 1 && other == 1 && a->kind == b->kind && a->open_edges == b->open_edges);
            assert_true(a->enclosed == b->enclosed && a->volume == b->volume && a->holes == b->holes);
            for (size_t k = 0; k < a->open_edges; ++k) {
                assert_memory_equal(a->cap[k], b->cap[k], sizeof a->cap[k]);
            }
            all_caps += a->open_edges;
        }
        vshi_solidity_free(together);
    }
    assert_true(all_caps > 100);
    for (int m = 0; m < MESHES; ++m) {
        vshi_solidity_free(alone[m]);
        free(shapes[m]);
    }
}

TEST(vessels_cloth_and_cards_are_sheets) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES & ~TOP);
    assert_kinds_of(s, "box without its lid", "-");
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.0, 48);
    assert_kinds_of(s, "bowl", "-");
    const double cup[][2] = {{0, 0}, {1, 0}, {1, 2}};
    shape_turned(s, ORIGIN, cup, 3, 48);
    assert_kinds_of(s, "cup", "-");
    const double tube[][2] = {{1, 0}, {1, 4}};
    shape_turned(s, ORIGIN, tube, 2, 48);
    assert_kinds_of(s, "short tube", "-");
    shape_box(s, LOW, HIGH, TOP);
    assert_kinds_of(s, "card", "-");
    shape_box(s, LOW, HIGH, TOP);
    shape_box(s, LOW, HIGH, TOP);
    shape_turn(s, 2);
    assert_kinds_of(s, "card of two sides", "-");
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 12);
    assert_kinds_of(s, "box of two sides", "--");
    uint32_t v[21][2];
    for (int i = 0; i < 21; ++i) {
        for (int k = 0; k < 2; ++k) {
            v[i][k] = shape_vertex(s, 0.1 * i, 0.3 * sin(0.9 * i), 2.0 * k);
        }
    }
    for (int i = 0; i < 20; ++i) {
        shape_quad(s, v[i][0], v[i + 1][0], v[i + 1][1], v[i][1]);
    }
    assert_kinds_of(s, "curtain", "-");
}

TEST(boxes_that_share_an_edge_or_a_face_are_boxes) {
    FREED shape *s = shape_new();
    const double low[3] = {1, 1, -1}, high[3] = {3, 3, 1}, beside_low[3] = {1, -1, -1},
                 beside_high[3] = {3, 1, 1};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, low, high, ALL_SIDES);
    assert_kinds_of(s, "boxes that share an edge", "SS");
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, beside_low, beside_high, ALL_SIDES);
    assert_kinds_of(s, "boxes that share a face", "SS");
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, LOW, HIGH, ALL_SIDES);
    assert_kinds_of(s, "a box given twice", "S");
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_quad(s, shape_vertex(s, -1, 1, -1), shape_vertex(s, -1, 1, 1), shape_vertex(s, -2, 2, 1),
               shape_vertex(s, -2, 2, -1));
    assert_kinds_of(s, "a box with a fin", "S-");
}

TEST(what_is_asked_overrules_what_is_found) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES & ~TOP);
    vsh_mesh mesh = shape_mesh(s, "crate");
    static const struct {
        int32_t asked;
        const char *kinds;
    } cases[] = {{VSH_SOLIDITY_AUTO, "-"},
                 {VSH_SOLIDITY_SOLID, "S"},
                 {VSH_SOLIDITY_SHELL, "-"},
                 {VSH_SOLIDITY_INWARD, "W"}};
    for (size_t i = 0; i < 4; ++i) {
        mesh.solidity = cases[i].asked;
        assert_kinds(&mesh, 1, cases[i].kinds);
    }
    OWNED(vshi_solidity) *inward = solidity_of(&mesh, 1); /* though its faces look outwards */
    assert_sides(inward, 0, &mesh, VSHI_SIDE_BEFORE);
    s->vertices = s->triangles = 0;
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 0);
    mesh = shape_mesh(s, "inside out");
    mesh.solidity = VSH_SOLIDITY_SOLID;
    assert_kinds(&mesh, 1, "S");
    OWNED(vshi_solidity) *solid = solidity_of(&mesh, 1);
    assert_sides(solid, 0, &mesh, VSHI_SIDE_BEFORE);
}

/* Solid angle by Oosterom and Strackee, over the whole sphere's. */
static double winding(const vsh_mesh *mesh, vshi_vec p) {
    double sum = 0.0;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        vshi_vec v[3];
        double l[3];
        vshi_mesh_triangle(mesh, i, v);
        for (int k = 0; k < 3; ++k) {
            v[k] = vshi_sub(v[k], p);
            l[k] = vshi_length(v[k]);
        }
        double under = l[0] * l[1] * l[2];
        for (int k = 0; k < 3; ++k) {
            under += vshi_dot(v[(k + 1) % 3], v[(k + 2) % 3]) * l[k];
        }
        sum += 2.0 * atan2(vshi_dot(v[0], vshi_cross(v[1], v[2])), under);
    }
    return sum / 12.566370614359172;
}

/* What a surface lacks of enclosing is told from its caps; truth is how far the winding number just behind
 * its faces is from a whole one. */
TEST(enclosing_is_the_winding_number_behind_the_faces) {
    FREED shape *s = shape_new();
    for (int kind = 0; kind < 6; ++kind) {
        s->vertices = s->triangles = 0;
        const double tube[][2] = {{1, 0}, {1, 3}}, vase[][2] = {{0, 0}, {1, 0}, {1.5, 1}, {0.4, 3}};
        if (kind < 2) {
            shape_ball(s, ORIGIN, 1.0, kind == 0 ? -0.9 : -0.2, 1.0, 40);
        } else if (kind < 4) {
            shape_turned(s, ORIGIN, kind == 2 ? tube : vase, kind == 2 ? 2 : 4, 40);
        } else {
            shape_box(s, LOW, HIGH, kind == 4 ? ALL_SIDES & ~TOP : LEFT | TOP | FRONT);
        }
        const vsh_mesh mesh = shape_mesh(s, "open");
        OWNED(vshi_solidity) *found = solidity_of(&mesh, 1);
        const vshi_component *c = only_component(found);
        double mean = 0.0, area = 0.0;
        for (size_t i = 0; i < mesh.triangle_count; ++i) {
            vshi_vec corner[3];
            vshi_mesh_triangle(&mesh, i, corner);
            const vshi_vec e = vshi_sub(corner[1], corner[0]), f = vshi_sub(corner[2], corner[0]),
                           n = vshi_cross(e, f);
            const vshi_vec behind = vshi_sub(corner[0], vshi_scale(vshi_unit(n), 1e-7));
            const int steps = kind >= 4 ? 24 : 3; /* over large triangles */
            for (int a = 0; a < steps; ++a) {
                for (int b = 0; b < steps - a; ++b) {
                    const double u = (a + 0.33) / steps, v = (b + 0.33) / steps;
                    const double w =
                        winding(&mesh, vshi_add(behind, vshi_add(vshi_scale(e, u), vshi_scale(f, v))));
                    const double share = vshi_length(n) / (steps * (steps + 1));
                    mean += share * fabs(w - floor(w + 0.5));
                    area += share;
                }
            }
        }
        assert_near(c->enclosed, 1.0 - mean / area, 0.01);
    }
}

/* Moebius strips, nothing, faces without area, edges of hundreds of triangles: never a crash, and the same
 * twice. */
TEST(odd_meshes_are_something) {
    FREED shape *s = shape_new();
    uint32_t v[17][2];
    for (int i = 0; i < 16; ++i) {
        const double turn = 6.283185307179586 * i / 16;
        for (int k = 0; k < 2; ++k) {
            const double r = 2.0 + (k - 0.5) * cos(0.5 * turn);
            v[i][k] = shape_vertex(s, r * cos(turn), r * sin(turn), (k - 0.5) * sin(0.5 * turn));
        }
    }
    v[16][0] = v[0][1];
    v[16][1] = v[0][0];
    for (int i = 0; i < 16; ++i) {
        shape_quad(s, v[i][0], v[i][1], v[i + 1][1], v[i + 1][0]);
    }
    assert_kinds_of(s, "Moebius strip", "-");
    const uint32_t a = shape_vertex(s, 0, 0, 0), b = shape_vertex(s, 0, 0, 1);
    for (int i = 0; i < 333; ++i) {
        shape_triangle(s, i % 2 ? a : b, i % 2 ? b : a, shape_vertex(s, cos(0.1 * i), sin(0.1 * i), 0.5));
    }
    const vsh_mesh fan = shape_mesh(s, "fan");
    OWNED(vshi_solidity) *one = solidity_of(&fan, 1), *other = solidity_of(&fan, 1);
    assert_memory_equal(vshi_solidity_sides(one, 0), vshi_solidity_sides(other, 0), fan.triangle_count);
    s->vertices = s->triangles = 0;
    shape_vertex(s, 0, 0, 0);
    shape_triangle(s, 0, 0, 0);
    assert_kinds_of(s, "a point", "");
    const vsh_mesh nothing = {.name = "nothing"};
    assert_kinds(&nothing, 1, "");
    assert_kinds(&nothing, 0, "");
}
