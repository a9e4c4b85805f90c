/* What is taken for a room, and what it is cut out of; walls, and what is a sheet because neither fits. */
#include "kinds.h"
#include "testing.h"
#include "traced.h"

static const double ORIGIN[3] = {0, 0, 0};
static const double LOW[3] = {-1, -1, -1}, HIGH[3] = {1, 1, 1};

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
    size_t count;
    const vshi_cut *cut = vshi_solidity_cuts(solidity, &count);
    for (size_t i = 0; i < count; ++i) {
        const size_t used = strlen(cuts);
        snprintf(cuts + used, sizeof cuts - used, "%u<%u ", (unsigned)cut[i].solid, (unsigned)cut[i].room);
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

TEST(rooms_are_cut_out_of_what_they_lie_in) {
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

static casting caster_of_mesh(const vsh_mesh *mesh, double voxel) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    vsh_triangles *triangles = NULL;
    assert_ok(vsh_grid_from_meshes(mesh, 1, &options, NULL, &grid, &failure));
    assert_ok(vsh_triangles_create(mesh, 1, NULL, &triangles, &failure));
    return (casting){field_of_grid(grid, 0.0), triangles};
}

/* From 8 × 8 places `step` apart that look along z, which are proved together. */
static void assert_all_see(const vsh_mesh *mesh, double voxel, const double towards[3], const double first[3],
                           const double step[2]) {
    FREED_BY(caster_free) casting c = caster_of_mesh(mesh, voxel);
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
    for (int i = 0; i < 64; ++i) {
        assert_true(seen[i] == 1.0f);
    }
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
    const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh sheet = {
        .name = "sheet", .positions = corners, .indices = indices, .vertex_count = 4, .triangle_count = 2};
    assert_all_see(&sheet, 0.1, (const double[]){1, 0, 1}, (const double[]){0.005, 0.0, 0.0},
                   (const double[]){0.01, 0.02});
}

/* A room whose faces look inwards, and the floor of it. */
TEST(the_floor_of_an_inward_room_has_the_ao_of_a_room) {
    FREED shape *s = shape_new();
    shape_box(s, LOW, HIGH, ALL_SIDES);
    shape_turn(s, 0);
    const vsh_mesh mesh = shape_mesh(s, "room");
    FREED_BY(caster_free) casting c = caster_of_mesh(&mesh, 0.02);
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
