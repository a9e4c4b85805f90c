/* What is taken for solid, for a room, for a wall, for a sheet. Sides are compared with winding numbers that
 * are summed over all triangles here. */
#include "shapes.h"

#include "caster/solidity.h"

static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

static vshi_solidity *solidity_of(const vsh_mesh *meshes, size_t count) {
    vshi_solidity *made = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vshi_solidity_create(meshes, count, NULL, &made, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return made;
}

/* The kinds of all components in their order: "S" solid, "R" room, "W" wall, "-" sheet. */
static void assert_kinds(const vsh_mesh *meshes, size_t count, const char *kinds) {
    vshi_solidity *s = solidity_of(meshes, count);
    size_t all;
    const vshi_component *c = vshi_solidity_components(s, &all);
    char found[32] = "";
    for (size_t i = 0; i < all && i + 1 < sizeof found; ++i) {
        found[i] = "-SRW"[c[i].kind];
    }
    if (strcmp(found, kinds) != 0) {
        fail_msg("%s: %s, expected %s (encloses %g)", meshes->name, found, kinds, c[0].enclosed);
    }
    vshi_solidity_free(s);
}

static void assert_kinds_of(shape *s, const char *what, const char *kinds) {
    const vsh_mesh mesh = shape_mesh(s, what);
    assert_kinds(&mesh, 1, kinds);
    s->vertices = s->triangles = 0;
}

/* All triangles of a mesh have this side. */
static void assert_sides(const vshi_solidity *s, size_t mesh, const vsh_mesh *of, uint8_t side) {
    const uint8_t *sides = vshi_solidity_sides(s, mesh);
    for (size_t i = 0; i < of->triangle_count; ++i) {
        if (sides[i] != side) {
            fail_msg("%s: triangle %zu: side %d, expected %d", of->name, i, sides[i], side);
        }
    }
}

static void closed_surfaces_that_look_outwards_are_solid(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    const vsh_mesh box = shape_mesh(s, "box");
    vshi_solidity *found = solidity_of(&box, 1);
    assert_sides(found, 0, &box, VSHI_SIDE_BEHIND);
    size_t count;
    const vshi_component *c = vshi_solidity_components(found, &count);
    assert_int_equal(count, 1);
    assert_float_equal(c->volume, 8.0, 1e-12);
    assert_float_equal(c->area, 24.0, 1e-12);
    assert_true(c->enclosed == 1.0 && c->open_edges == 0 && c->holes == 0);
    vshi_solidity_free(found);
    free(s);
}

static void a_mirrored_mesh_looks_the_same_way(void **state) {
    (void)state;
    shape *s = shape_new();
    static const double mirror[12] = {-2, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    vsh_mesh box = shape_mesh(s, "mirrored box");
    box.transform = mirror;
    vshi_solidity *found = solidity_of(&box, 1);
    size_t count;
    const vshi_component *c = vshi_solidity_components(found, &count);
    assert_true(count == 1 && c->kind == VSHI_KIND_SOLID && !c->inward);
    assert_float_equal(c->volume, 16.0, 1e-12);
    assert_sides(found, 0, &box, VSHI_SIDE_BEHIND);
    vshi_solidity_free(found);
    free(s);
}

static void faces_that_look_the_wrong_way_are_turned(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 24);
    for (size_t i = 0; i < s->triangles; i += 5) {
        const uint32_t kept = s->indices[i][0];
        s->indices[i][0] = s->indices[i][1];
        s->indices[i][1] = kept;
    }
    const vsh_mesh ball = shape_mesh(s, "mixed ball");
    vshi_solidity *found = solidity_of(&ball, 1);
    const uint8_t *sides = vshi_solidity_sides(found, 0);
    size_t count;
    const vshi_component *c = vshi_solidity_components(found, &count);
    assert_true(count == 1 && c->kind == VSHI_KIND_SOLID);
    assert_int_equal(c->turned, (ball.triangle_count + 4) / 5);
    for (size_t i = 0; i < ball.triangle_count; ++i) {
        assert_int_equal(sides[i], i % 5 == 0 ? VSHI_SIDE_BEFORE : VSHI_SIDE_BEHIND);
    }
    vshi_solidity_free(found);
    free(s);
}

static void rooms_and_domes_are_walls_around_air(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 0);
    assert_kinds_of(s, "room", "W");
    shape_ball(s, ORIGIN, 10.0, -1.0, 1.0, 24);
    shape_turn(s, 0);
    shape_box(s, LOW, HIGH, ALL_SIDES);
    assert_kinds_of(s, "sky dome around a cube", "WS");
    const double floor_low[3] = {-5, -5, -1}, floor_high[3] = {5, 5, -1.5};
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_box(s, floor_low, floor_high, TOP);
    shape_ball(s, ORIGIN, 10.0, -1.0, 1.0, 24);
    assert_kinds_of(s, "sky dome that looks outwards around a cube and a card", "S--");
    shape_box(s, LOW, HIGH, ALL_SIDES & ~FRONT);
    shape_turn(s, 0);
    assert_kinds_of(s, "room without its fourth wall", "W");
    /* a floor, and walls of four quads each with a door between them */
    const double door_low[3] = {-0.2, -1, -1}, door_high[3] = {0.2, -1, 0.2};
    shape_box(s, LOW, HIGH, ALL_SIDES & ~FRONT);
    const double strips[3][2][3] = {{{-1, -1, -1}, {door_low[0], 1, 1}},
                                    {{door_high[0], -1, -1}, {1, 1, 1}},
                                    {{door_low[0], -1, door_high[2]}, {door_high[0], 1, 1}}};
    for (int i = 0; i < 3; ++i) {
        shape_box(s, strips[i][0], strips[i][1], FRONT);
    }
    shape_turn(s, 0);
    assert_kinds_of(s, "room with a door, its lintel apart", "W-");
    free(s);
}

/* A house of 6 with a room of 2 in it and a table of 1 in that. */
static void build_house(shape *s, shape *room, shape *table) {
    const double wide_low[3] = {-3, -3, -3}, wide_high[3] = {3, 3, 3};
    const double table_low[3] = {-0.5, -0.5, -1}, table_high[3] = {0.5, 0.5, 0};
    shape_box(s, wide_low, wide_high, ALL_SIDES);
    const size_t first = room->triangles;
    shape_box(room, LOW, HIGH, ALL_SIDES);
    shape_turn(room, first);
    shape_box(table, table_low, table_high, ALL_SIDES);
}

static void rooms_are_cut_out_of_houses(void **state) {
    (void)state;
    shape *s = shape_new(), *room = shape_new(), *table = shape_new();
    build_house(s, s, s);
    assert_kinds_of(s, "house in one mesh", "SRS");
    build_house(s, room, table);
    const vsh_mesh meshes[3] = {shape_mesh(table, "table"), shape_mesh(room, "room"), shape_mesh(s, "house")};
    assert_kinds(meshes, 3, "SRS");
    vshi_solidity *found = solidity_of(meshes, 3);
    size_t cuts;
    const vshi_cut *cut = vshi_solidity_cuts(found, &cuts);
    assert_true(cuts == 1 && cut->room == 1 && cut->solid == 2);
    for (size_t m = 0; m < 3; ++m) {
        assert_sides(found, m, &meshes[m], VSHI_SIDE_BEHIND);
    }
    vshi_solidity_free(found);
    free(table);
    free(room);
    free(s);
}

static void rooms_in_rooms_are_cut_out_of_what_they_lie_in(void **state) {
    (void)state;
    shape *s = shape_new();
    const double half[5] = {5, 4, 3, 2, 1}; /* house, room, safe, room in it, gold */
    for (int i = 0; i < 5; ++i) {
        const double low[3] = {-half[i], -half[i], -half[i]}, high[3] = {half[i], half[i], half[i]};
        const size_t first = s->triangles;
        shape_box(s, low, high, ALL_SIDES);
        if (i % 2 == 1) {
            shape_turn(s, first);
        }
    }
    const vsh_mesh mesh = shape_mesh(s, "house with a safe");
    assert_kinds(&mesh, 1, "SRSRS");
    vshi_solidity *found = solidity_of(&mesh, 1);
    size_t cuts;
    const vshi_cut *cut = vshi_solidity_cuts(found, &cuts);
    /* out of the house both: the outer one holds the inner */
    assert_int_equal(cuts, 3);
    assert_true(cut[0].solid == 0 && cut[0].room == 1 && cut[1].solid == 0 && cut[1].room == 3);
    assert_true(cut[2].solid == 2 && cut[2].room == 3);
    vshi_solidity_free(found);
    free(s);
}

static void a_pillar_that_reaches_into_a_room_is_not_cut(void **state) {
    (void)state;
    shape *s = shape_new();
    build_house(s, s, s);
    s->triangles -= 12;
    const double low[3] = {-0.1, -0.1, -2.9}, high[3] = {0.1, 0.1, 0.0};
    shape_box(s, low, high, ALL_SIDES);
    const vsh_mesh mesh = shape_mesh(s, "pillar");
    assert_kinds(&mesh, 1, "SRS");
    vshi_solidity *found = solidity_of(&mesh, 1);
    size_t cuts;
    const vshi_cut *cut = vshi_solidity_cuts(found, &cuts);
    assert_true(cuts == 1 && cut->solid == 0);
    vshi_solidity_free(found);
    free(s);
}

static void small_holes_do_not_make_a_solid_hollow(void **state) {
    (void)state;
    shape *s = shape_new();
    shape_ball(s, ORIGIN, 1.0, -1.0, 1.0, 48);
    s->indices[700][1] = s->indices[700][0]; /* three holes */
    s->indices[300][1] = s->indices[300][0];
    s->indices[301][1] = s->indices[301][0];
    const vsh_mesh ball = shape_mesh(s, "ball with holes");
    vshi_solidity *found = solidity_of(&ball, 1);
    size_t count;
    const vshi_component *c = vshi_solidity_components(found, &count);
    assert_true(count == 1 && c->kind == VSHI_KIND_SOLID && c->enclosed > 0.99);
    assert_true(c->holes == 2 && c->open_edges == 7);
    vshi_solidity_free(found);
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
    free(s);
}

static void vessels_cloth_and_cards_are_sheets(void **state) {
    (void)state;
    shape *s = shape_new();
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
    free(s);
}

static void rooms_of_separate_quads_are_sheets_and_never_nothing(void **state) {
    (void)state;
    shape *s[6];
    vsh_mesh meshes[6];
    for (int i = 0; i < 6; ++i) {
        s[i] = shape_new();
        const double low[3] = {-1 - 0.01 * i, -1, -1}; /* corners that do not meet exactly */
        shape_box(s[i], low, HIGH, 1U << i);
        shape_turn(s[i], 0);
        meshes[i] = shape_mesh(s[i], "wall");
    }
    assert_kinds(meshes, 6, "------");
    /* parts of one object are one surface */
    for (int i = 0; i < 6; ++i) {
        s[i]->vertices = s[i]->triangles = 0;
        shape_box(s[i], LOW, HIGH, 1U << i);
        meshes[i] = shape_mesh(s[i], "side");
        meshes[i].object = 7;
    }
    assert_kinds(meshes, 6, "S");
    vshi_solidity *found = solidity_of(meshes, 6);
    for (size_t i = 0; i < 6; ++i) {
        assert_sides(found, i, &meshes[i], VSHI_SIDE_BEHIND);
    }
    vshi_solidity_free(found);
    for (int i = 0; i < 6; ++i) {
        free(s[i]);
    }
}

static void an_open_room_in_an_open_house_closes_neither(void **state) {
    (void)state;
    shape *s = shape_new();
    const double wide_low[3] = {-1.2, -1.2, -1.2}, wide_high[3] = {1.2, 1.2, 1.2};
    shape_ball(s, ORIGIN, 1.3, -1.0, 0.95, 48);
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.95, 48);
    shape_turn(s, s->triangles / 2);
    assert_kinds_of(s, "hut with a hole in its roof", "WW");
    shape_box(s, wide_low, wide_high, ALL_SIDES);
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.95, 48);
    shape_turn(s, 12);
    assert_kinds_of(s, "open room in a closed house", "SR");
    free(s);
}

static void boxes_that_share_an_edge_or_a_face_are_boxes(void **state) {
    (void)state;
    shape *s = shape_new();
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
    free(s);
}

static void what_is_asked_overrules_what_is_found(void **state) {
    (void)state;
    shape *s = shape_new();
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
    vshi_solidity *found = solidity_of(&mesh, 1); /* inward, though its faces look outwards */
    assert_sides(found, 0, &mesh, VSHI_SIDE_BEFORE);
    vshi_solidity_free(found);
    s->vertices = s->triangles = 0;
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 0);
    mesh = shape_mesh(s, "inside out");
    mesh.solidity = VSH_SOLIDITY_SOLID;
    assert_kinds(&mesh, 1, "S");
    found = solidity_of(&mesh, 1);
    assert_sides(found, 0, &mesh, VSHI_SIDE_BEFORE);
    vshi_solidity_free(found);
    free(s);
}

/* Solid angle by Oosterom and Strackee, over the whole sphere's. */
static double winding(const vsh_mesh *mesh, const double p[3]) {
    double sum = 0.0;
    for (size_t i = 0; i < mesh->triangle_count; ++i) {
        double v[3][3], l[3];
        for (int k = 0; k < 3; ++k) {
            const float *at = mesh->positions + 3 * (size_t)mesh->indices[3 * i + (size_t)k];
            for (int axis = 0; axis < 3; ++axis) {
                v[k][axis] = (double)at[axis] - p[axis];
            }
            l[k] = sqrt(v[k][0] * v[k][0] + v[k][1] * v[k][1] + v[k][2] * v[k][2]);
        }
        const double over = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                            v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                            v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        double under = l[0] * l[1] * l[2];
        for (int k = 0; k < 3; ++k) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            under += (v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2]) * l[k];
        }
        sum += 2.0 * atan2(over, under);
    }
    return sum / 12.566370614359172;
}

/* What a surface lacks of enclosing is told from its caps; truth is how far the winding number just behind
 * its faces is from a whole one. */
static void enclosing_is_the_winding_number_behind_the_faces(void **state) {
    (void)state;
    shape *s = shape_new();
    for (int kind = 0; kind < 6; ++kind) {
        s->vertices = s->triangles = 0;
        const double tube[][2] = {{1, 0}, {1, 3}}, vase[][2] = {{0, 0}, {1, 0}, {1.5, 1}, {0.4, 3}};
        switch (kind) {
        case 0:
            shape_ball(s, ORIGIN, 1.0, -0.9, 1.0, 40);
            break;
        case 1:
            shape_ball(s, ORIGIN, 1.0, -0.2, 1.0, 40);
            break;
        case 2:
            shape_turned(s, ORIGIN, tube, 2, 40);
            break;
        case 3:
            shape_turned(s, ORIGIN, vase, 4, 40);
            break;
        case 4:
            shape_box(s, LOW, HIGH, ALL_SIDES & ~TOP);
            break;
        default:
            shape_box(s, LOW, HIGH, LEFT | TOP | FRONT);
            break;
        }
        const vsh_mesh mesh = shape_mesh(s, "open");
        vshi_solidity *found = solidity_of(&mesh, 1);
        size_t count;
        const vshi_component *c = vshi_solidity_components(found, &count);
        double mean = 0.0, area = 0.0;
        for (size_t i = 0; i < mesh.triangle_count; ++i) {
            double corner[3][3], e[2][3], n[3], own = 0.0;
            for (int k = 0; k < 9; ++k) {
                corner[k / 3][k % 3] =
                    (double)mesh.positions[3 * mesh.indices[3 * i + (size_t)(k / 3)] + (uint32_t)(k % 3)];
            }
            for (int k = 0; k < 6; ++k) {
                e[k / 3][k % 3] = corner[1 + k / 3][k % 3] - corner[0][k % 3];
            }
            for (int k = 0; k < 3; ++k) {
                n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
                own += n[k] * n[k];
            }
            own = 0.5 * sqrt(own);
            const int steps = kind >= 4 ? 24 : 3; /* over large triangles */
            for (int a = 0; a < steps; ++a) {
                for (int b = 0; b < steps - a; ++b) {
                    const double u = (a + 0.33) / steps, v = (b + 0.33) / steps;
                    double p[3];
                    for (int k = 0; k < 3; ++k) {
                        p[k] = corner[0][k] + u * e[0][k] + v * e[1][k] - 1e-7 * n[k] / (2.0 * own);
                    }
                    const double w = winding(&mesh, p), share = own / (0.5 * steps * (steps + 1));
                    mean += share * fabs(w - floor(w + 0.5));
                    area += share;
                }
            }
        }
        print_message("kind %d: encloses %.4f, winding numbers %.4f\n", kind, c->enclosed, 1.0 - mean / area);
        assert_int_equal(count, 1);
        assert_float_equal(c->enclosed, 1.0 - mean / area, 0.01);
        vshi_solidity_free(found);
    }
    free(s);
}

/* Moebius strips, nothing, faces without area, edges of hundreds of triangles: never a crash, and the same
 * twice. */
static void odd_meshes_are_something(void **state) {
    (void)state;
    shape *s = shape_new();
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
    vshi_solidity *one = solidity_of(&fan, 1), *other = solidity_of(&fan, 1);
    assert_memory_equal(vshi_solidity_sides(one, 0), vshi_solidity_sides(other, 0), fan.triangle_count);
    vshi_solidity_free(one);
    vshi_solidity_free(other);
    s->vertices = s->triangles = 0;
    shape_vertex(s, 0, 0, 0);
    shape_triangle(s, 0, 0, 0);
    assert_kinds_of(s, "a point", "");
    const vsh_mesh nothing = {.name = "nothing"};
    assert_kinds(&nothing, 1, "");
    assert_kinds(&nothing, 0, "");
    free(s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_surfaces_that_look_outwards_are_solid),
        cmocka_unit_test(a_mirrored_mesh_looks_the_same_way),
        cmocka_unit_test(faces_that_look_the_wrong_way_are_turned),
        cmocka_unit_test(rooms_and_domes_are_walls_around_air),
        cmocka_unit_test(rooms_are_cut_out_of_houses),
        cmocka_unit_test(rooms_in_rooms_are_cut_out_of_what_they_lie_in),
        cmocka_unit_test(a_pillar_that_reaches_into_a_room_is_not_cut),
        cmocka_unit_test(small_holes_do_not_make_a_solid_hollow),
        cmocka_unit_test(vessels_cloth_and_cards_are_sheets),
        cmocka_unit_test(rooms_of_separate_quads_are_sheets_and_never_nothing),
        cmocka_unit_test(an_open_room_in_an_open_house_closes_neither),
        cmocka_unit_test(boxes_that_share_an_edge_or_a_face_are_boxes),
        cmocka_unit_test(what_is_asked_overrules_what_is_found),
        cmocka_unit_test(enclosing_is_the_winding_number_behind_the_faces),
        cmocka_unit_test(odd_meshes_are_something),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
