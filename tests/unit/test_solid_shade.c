/* Shadow and AO where solids are closed over holes, and in rooms. */
#include "shapes.h"
#include "traced.h"

static const double ORIGIN[3] = {0, 0, 0};

/* A tube of 8, open at both ends, through whose length the sun is seen. */
static void no_ray_through_two_holes_is_proved_hidden(void **state) {
    (void)state;
    if (!vsh_triangles_available()) {
        skip();
    }
    const double rings[][2] = {{0.25, -4}, {0.25, 4}}, towards[3] = {0.0, 0.0, 1.0};
    shape *s = shape_new();
    shape_turned(s, ORIGIN, rings, 2, 64);
    const vsh_mesh mesh = shape_mesh(s, "tube");
    vsh_solidity_report report;
    vsh_error error = {VSH_OK, ""};
    assert_int_equal(vsh_mesh_solidity(&mesh, 1, NULL, &report, &error), VSH_OK);
    assert_true(report.solids == 1 && report.closed_over == 1 && report.holes == 2);
    assert_int_equal(report.open_edges, 128);
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.02;
    vsh_grid *grid = NULL;
    vsh_triangles *triangles = NULL;
    if (vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error) != VSH_OK ||
        vsh_triangles_create(&mesh, 1, NULL, &triangles, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    caster c = {field_of_grid(grid, 0.0), triangles};
    const vsh_light narrow = sun(towards, RADIANS(1.0));
    double at[3 * 64];
    float up[3 * 64], seen[64];
    for (int i = 0; i < 64; ++i) { /* within 0.11 of the axis, where all of the sun is in the opening */
        const double p[3] = {0.02 * (i % 8 - 3.5), 0.02 * (i / 8 - 3.5), -5.0};
        const float n[3] = {0.0f, 0.0f, 1.0f};
        memcpy(at + 3 * i, p, sizeof p);
        memcpy(up + 3 * i, n, sizeof n);
    }
    cast_shadows(&c, &narrow, VSH_SHADOW_EXACT, 64, at, up, seen);
    for (int i = 0; i < 64; ++i) {
        assert_true(seen[i] == 1.0f);
    }
    caster_free(&c);
    free(s);
}

/* A room whose faces look inwards, and the floor of it. */
static void the_floor_of_an_inward_room_has_the_ao_of_a_room(void **state) {
    (void)state;
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    shape *s = shape_new();
    shape_box(s, low, high, ALL_SIDES);
    shape_turn(s, 0);
    const vsh_mesh mesh = shape_mesh(s, "room");
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.02;
    vsh_grid *grid = NULL;
    vsh_triangles *triangles = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error) != VSH_OK ||
        (vsh_triangles_available() && vsh_triangles_create(&mesh, 1, NULL, &triangles, &error) != VSH_OK)) {
        fail_msg("%s", error.message);
    }
    caster c = {field_of_grid(grid, 0.0), triangles};
    const double at[6] = {0.013, 0.021, -1.0, 0.9, 0.0, -1.0};
    const float up[6] = {0, 0, 1, 0, 0, 1};
    for (int32_t method = 0; method < ao_methods(); ++method) {
        float near[2], far[2];
        cast_ao(&c, method, 0.5, 2, at, up, near);
        cast_ao(&c, method, 6.0, 2, at, up, far);
        print_message("AO %s: %.3f and %.3f within 0.5, %.3f and %.3f within 6\n", vsh_ao_method_name(method),
                      (double)near[0], (double)near[1], (double)far[0], (double)far[1]);
        assert_true(near[0] > 0.98f);
        /* a wall at 0.1 hides half of the hemisphere but for what is farther than 0.5 along it */
        assert_true(method == VSH_AO_TAPS || (near[1] > 0.5f && near[1] < 0.75f));
        assert_true(method < VSH_AO_RAYS ||
                    (far[0] < 0.02f && far[1] < 0.02f)); /* cones see past thin walls */
    }
    caster_free(&c);
    free(s);
}

/* Points nearer to a sheet than half of the thickness that it has as a shell in the voxels, on the sun's side
 * of it. */
static void no_ray_is_proved_hidden_by_the_thickness_of_a_sheet(void **state) {
    (void)state;
    if (!vsh_triangles_available()) {
        skip();
    }
    const float corners[12] = {0, -2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2};
    const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const vsh_mesh mesh = {
        .name = "sheet", .positions = corners, .indices = indices, .vertex_count = 4, .triangle_count = 2};
    const double towards[3] = {1.0, 0.0, 1.0};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.1;
    vsh_grid *grid = NULL;
    vsh_triangles *triangles = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_grid_from_meshes(&mesh, 1, &options, NULL, &grid, &error) != VSH_OK ||
        vsh_triangles_create(&mesh, 1, NULL, &triangles, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    caster c = {field_of_grid(grid, 0.0), triangles};
    const vsh_light narrow = sun(towards, RADIANS(1.0));
    double at[3 * 64];
    float up[3 * 64], seen[64];
    for (int i = 0; i < 64; ++i) {
        const double p[3] = {0.005 + 0.01 * (i % 8), 0.02 * (i / 8), 0.0};
        const float n[3] = {0.0f, 0.0f, 1.0f};
        memcpy(at + 3 * i, p, sizeof p);
        memcpy(up + 3 * i, n, sizeof n);
    }
    cast_shadows(&c, &narrow, VSH_SHADOW_EXACT, 64, at, up, seen);
    for (int i = 0; i < 64; ++i) {
        assert_true(seen[i] == 1.0f);
    }
    caster_free(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_ray_through_two_holes_is_proved_hidden),
        cmocka_unit_test(no_ray_is_proved_hidden_by_the_thickness_of_a_sheet),
        cmocka_unit_test(the_floor_of_an_inward_room_has_the_ao_of_a_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
