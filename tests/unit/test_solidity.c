/* Components are solids, rooms or sheets, with what they hide and cut out. */
#include "geometry/edges.h"
#include "geometry/solidity.h"
#include "shade/shade.h"
#include "shapes.h"
#include "testing.h"
#include "trace/trace.h"
#include "traced.h"

OWNER(vshi_solidity)

static vshi_solidity *solidity_of(const vsh_mesh *meshes, size_t count) {
    vshi_solidity *made = NULL;
    assert_ok(vshi_solidity_create(meshes, count, NULL, &made, &failure));
    return made;
}

/* The kinds of all components in their order: "S" solid, "R" room, "W" wall, "-" sheet. */
static void assert_kinds(const vsh_mesh *meshes, size_t count, const char *kinds) {
    OWNED(vshi_solidity) *s = solidity_of(meshes, count);
    char found[32] = "";
    for (size_t i = 0; i < s->count && i + 1 < sizeof found; ++i) {
        found[i] = "-SRW"[s->components[i].kind];
    }
    assert_that(strcmp(found, kinds) == 0, "%s: %s, expected %s (encloses %g)", meshes->name, found, kinds,
                s->components[0].enclosed);
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
        assert_that(sides[i] == side, "%s: triangle %zu: side %d, expected %d", of->name, i, sides[i], side);
    }
}

static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

static const vshi_component *only_component(const vshi_solidity *s) {
    assert_int_equal(s->count, 1);
    return s->components;
}

TEST(closed_surfaces_that_look_outwards_are_solid_mirrored_or_not) {
    static const double mirror[12] = {-2, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    vsh_mesh box = shape_mesh(s, "box");
    for (int mirrored = 0; mirrored < 2; ++mirrored) {
        box.transform = mirrored ? mirror : NULL;
        OWNED(vshi_solidity) *found = solidity_of(&box, 1);
        assert_sides(found, 0, &box, VSHI_SIDE_BEHIND);
        const vshi_component *c = only_component(found);
        assert_float_equal(c->volume, mirrored ? 16.0 : 8.0, 1e-12);
        assert_float_equal(c->area, mirrored ? 40.0 : 24.0, 1e-12);
        assert_true(c->kind == VSHI_KIND_SOLID && !c->inward);
        assert_true(c->enclosed == 1.0 && c->open_edges == 0 && c->holes == 0);
    }
}

TEST(triangles_given_thrice_at_an_edge_of_three_change_nothing) {
    static const float corners[] = {0, 0, 0, 0, 0, 1, 1, 0, 0, -1, 0.5f, 0, -1, -0.5f, 0};
    static const uint32_t fan[] = {0, 1, 2, 0, 1, 3, 1, 0, 4, 0, 1, 2, 0, 1,
                                   2, 0, 1, 3, 1, 0, 4, 1, 0, 4, 1, 0, 4};
    vsh_mesh mesh = {.positions = corners, .vertex_count = 5, .indices = fan};
    for (int times = 1; times <= 3; times += 2) {
        vshi_components found;
        mesh.triangle_count = 3 * (size_t)times;
        assert_ok(vshi_components_find(&mesh, 0, &found, &failure));
        assert_int_equal(found.count, 2);
        assert_int_equal(found.rim_count, 7); /* six outer edges, and what ends at the one of three */
        vshi_components_free(&found);
    }
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

/* Among many meshes, on any number of threads, each mesh has the kind that it has alone, and is closed by its
 * own caps. */
TEST(meshes_with_holes_do_not_change_each_other) {
    enum { MESHES = 9 };
    shape *shapes[MESHES];
    vsh_mesh meshes[MESHES];
    vshi_solidity *alone[MESHES], *together;
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
            const vshi_component *a = only_component(alone[m]);
            const vshi_component *b = together->components + together->first[m];
            assert_int_equal(together->first[m + 1] - together->first[m], 1);
            assert_true(a->kind == b->kind && a->open_edges == b->open_edges);
            assert_true(a->enclosed == b->enclosed && a->volume == b->volume && a->holes == b->holes);
        }
        vshi_solidity_free(together);
    }
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

TEST(the_users_choice_overrules_the_detected_kind) {
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

/* --- rooms, and what they are cut out of */

TEST(rooms_and_domes_are_walls_around_air) {
    FREED shape *s = shape_new();
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

/* `expected`: "solid<room" of each cut. */
static void assert_cuts(const vshi_solidity *solidity, const char *expected) {
    char cuts[64] = "";
    for (size_t i = 0; i < solidity->cut_count; ++i) {
        const vshi_cut *cut = &solidity->cuts[i];
        const size_t used = strlen(cuts);
        snprintf(cuts + used, sizeof cuts - used, "%u<%u ", (unsigned)cut->solid, (unsigned)cut->room);
    }
    assert_string_equal(cuts, expected);
}

static void assert_cuts_of(shape *s, const char *what, const char *kinds, const char *cuts) {
    const vsh_mesh mesh = shape_mesh(s, what);
    assert_kinds(&mesh, 1, kinds);
    OWNED(vshi_solidity) *found = solidity_of(&mesh, 1);
    assert_cuts(found, cuts);
    s->vertices = s->triangles = 0;
}

TEST(rooms_are_cut_out_of_the_solid_around_them) {
    FREED shape *s = shape_new(), *room = shape_new(), *table = shape_new();
    build_house(s, s, s);
    assert_kinds_of(s, "house in one mesh", "SRS");
    build_house(s, room, table);
    const vsh_mesh meshes[3] = {shape_mesh(table, "table"), shape_mesh(room, "room"), shape_mesh(s, "house")};
    assert_kinds(meshes, 3, "SRS");
    OWNED(vshi_solidity) *found = solidity_of(meshes, 3);
    assert_cuts(found, "2<1 ");
    for (size_t m = 0; m < 3; ++m) {
        assert_sides(found, m, &meshes[m], VSHI_SIDE_BEHIND);
    }
    s->vertices = s->triangles = 0;
    /* house, room, safe, room in it, gold; out of the house both: the outer one holds the inner */
    for (int i = 0; i < 5; ++i) {
        const double half = 5.0 - i, low[3] = {-half, -half, -half}, high[3] = {half, half, half};
        const size_t first = s->triangles;
        shape_box(s, low, high, ALL_SIDES);
        if (i % 2 == 1) {
            shape_turn(s, first);
        }
    }
    assert_cuts_of(s, "house with a safe", "SRSRS", "0<1 0<3 2<3 ");
    /* solids that reach into a room are not cut */
    build_house(s, s, s);
    s->triangles -= 12;
    const double low[3] = {-0.1, -0.1, -2.9}, high[3] = {0.1, 0.1, 0.0};
    shape_box(s, low, high, ALL_SIDES);
    assert_cuts_of(s, "pillar", "SRS", "0<1 ");
}

TEST(rooms_of_separate_quads_are_sheets_and_never_nothing) {
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
    OWNED(vshi_solidity) *found = solidity_of(meshes, 6);
    for (size_t i = 0; i < 6; ++i) {
        assert_sides(found, i, &meshes[i], VSHI_SIDE_BEHIND);
    }
    for (int i = 0; i < 6; ++i) {
        free(s[i]);
    }
}

TEST(an_open_room_in_an_open_house_closes_neither) {
    FREED shape *s = shape_new();
    const double wide_low[3] = {-1.2, -1.2, -1.2}, wide_high[3] = {1.2, 1.2, 1.2};
    shape_ball(s, ORIGIN, 1.3, -1.0, 0.95, 48);
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.95, 48);
    shape_turn(s, s->triangles / 2);
    assert_kinds_of(s, "hut with a hole in its roof", "WW");
    shape_box(s, wide_low, wide_high, ALL_SIDES);
    shape_ball(s, ORIGIN, 1.0, -1.0, 0.95, 48);
    shape_turn(s, 12);
    assert_kinds_of(s, "open room in a closed house", "SR");
}

/* --- Shadow and AO where solids are closed over holes, and in rooms. */

/* From 8 × 8 places `step` apart that look along z, which are proved together. */
static void assert_all_see(const vsh_mesh *mesh, double voxel, const double towards[3], const double first[3],
                           const double step[2]) {
    FREED_BY(caster_free) casting c = caster_of_meshes(mesh, 1, voxel, 0.0);
    const vsh_light narrow = sun(towards, RADIANS(1.0));
    double at[3 * 64];
    float up[3 * 64] = {0.0f}, seen[64];
    for (int i = 0; i < 64; ++i) {
        at[3 * i] = first[0] + step[0] * (i % 8);
        at[3 * i + 1] = first[1] + step[1] * (i / 8);
        at[3 * i + 2] = first[2];
        up[3 * i + 2] = 1.0f;
    }
    cast_shadows(&c, &narrow, VSH_SHADOW_EXACT, 64, at, up, seen);
    assert_all_equal(seen, 64, 1.0f);
}

/* A tube of 8, open at both ends, through whose length the sun is seen; within 0.11 of the axis all of it.
 * And points on the sun's side of a sheet, nearer than half of the thickness that it has as a shell in the
 * voxels.
 */
TEST(no_ray_is_proved_hidden_through_two_holes_or_by_the_thickness_of_a_sheet) {
    const double rings[][2] = {{0.25, -4}, {0.25, 4}};
    FREED shape *s = shape_new();
    shape_turned(s, ORIGIN, rings, 2, 64);
    const vsh_mesh tube = shape_mesh(s, "tube");
    vsh_solidity_report report;
    assert_ok(vsh_mesh_solidity(&tube, 1, NULL, &report, &failure));
    assert_true(report.solids == 1 && report.closed_over == 1 && report.holes == 2);
    assert_int_equal(report.open_edges, 128);
    assert_all_see(&tube, 0.02, (const double[]){0, 0, 1}, (const double[]){-0.07, -0.07, -5.0},
                   (const double[]){0.02, 0.02});
    const float corners[12] = {0, -2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2};
    const vsh_mesh sheet = quad_mesh("sheet", corners, NULL);
    assert_all_see(&sheet, 0.1, (const double[]){1, 0, 1}, (const double[]){0.005, 0.0, 0.0},
                   (const double[]){0.01, 0.02});
}

/* A room whose faces look inwards, and the floor of it. */
TEST(the_floor_of_an_inward_room_has_the_ao_of_a_room) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 0);
    const vsh_mesh mesh = shape_mesh(s, "room");
    FREED_BY(caster_free) casting c = caster_of_meshes(&mesh, 1, 0.02, 0.0);
    const double at[6] = {0.013, 0.021, -1.0, 0.9, 0.0, -1.0};
    const float up[6] = {0, 0, 1, 0, 0, 1};
    for (int32_t method = 0; method < AO_METHODS; ++method) {
        float near[2], far[2];
        cast_ao(&c, method, 0.5, 2, at, up, near);
        cast_ao(&c, method, 6.0, 2, at, up, far);
        assert_true(near[0] > 0.98f);
        /* a wall at 0.1 hides half of the hemisphere but for what is farther than 0.5 along it */
        assert_true(method == VSH_AO_TAPS || (near[1] > 0.5f && near[1] < 0.75f));
        /* cones see past thin walls */
        assert_true(method < VSH_AO_RAYS || (far[0] < 0.02f && far[1] < 0.02f));
    }
}

/* --- points that see only the inner sides of solids that lack a side are hidden */

static const double CUP[][2] = {{0, 0}, {1, 0}, {1, 2}};

/* Whether points that look up are hidden among the triangles of a mesh. */
static void assert_mesh_hides(const vsh_mesh *mesh, const double at[][3], size_t count, bool hidden) {
    OWNED(vshi_triangles) *triangles = triangles_from(mesh, 1);
    for (size_t i = 0; i < count; ++i) {
        uint8_t where;
        vshi_inside(triangles, 1, at[i], (const float[]){0, 0, 1}, NULL, NULL, &where);
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
    for (size_t i = 0; i < COUNT_OF(THICKNESS); ++i) {
        for (size_t k = 0; k < COUNT_OF(SUNK); ++k) {
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
