/* Grids that are unions of grids. */
#include "grids.h"
#include "testing.h"

static vsh_grid *ball_grid(double x, double radius, double voxel) {
    sphere s = {{x, 0, 0}, radius, 0};
    const vsh_distance field = sphere_field(&s);
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure));
    return grid;
}

TEST(one_grid_alone_is_shared_as_it_is) {
    vsh_grid *ball = ball_grid(0.0, 1.0, 0.03);
    const vsh_grid_instance instance = {ball, NULL};
    OWNED(vsh_grid) *same = NULL;
    assert_ok(vsh_grid_unite(&instance, 1, NULL, NULL, &same, &failure));
    vsh_grid *const given = ball;
    assert_same_leaves(given, same, 0.0f);
    vsh_grid_free(given);
    assert_true(worst_error(same, unit_sphere, 2.95, 2.95) < 1e-4);
}

/* Shifts by whole voxels that are no whole leaves: the values are those of the closed form. */
TEST(grids_on_one_lattice_are_shifted_and_keep_their_values) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.03);
    const double aside[12] = {1, 0, 0, 27 * 0.03, 0, 1, 0, 0, 0, 0, 1, 0};
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, aside}};
    OWNED(vsh_grid) *both = NULL;
    assert_ok(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure));
    FREED_BY(free_leaves) leaves all = leaves_of(both);
    for (size_t i = 0; i < 512 * all.count; ++i) {
        double p[3];
        const double value = value_at(&all, i, p), q[3] = {p[0] - 27 * 0.03, p[1], p[2]};
        assert_near(value, fmax(-0.09, fmin(0.09, fmin(unit_sphere(p), unit_sphere(q)))), 1e-6);
    }
}

static double moved_sphere(const double p[3]) { /* twice as large, its middle at 1, 2, 3 */
    const double q[3] = {0.5 * (p[0] - 1.0), 0.5 * (p[1] - 2.0), 0.5 * (p[2] - 3.0)};
    return 2.0 * unit_sphere(q);
}

TEST(a_turned_mirrored_scaled_grid_is_measured_anew) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.03);
    const double c = 2.0 * cos(0.5), s = 2.0 * sin(0.5);
    const double turned[12] = {-c, s, 0, 1, s, c, 0, 2, 0, 0, 2, 3};
    const vsh_grid_instance instance = {ball, turned};
    const double voxels[] = {0.0, 0.045, 0.09};
    for (int i = 0; i < 3; ++i) {
        OWNED(vsh_grid) *moved = NULL;
        const vsh_grid_options options = with_voxel(voxels[i]);
        assert_ok(vsh_grid_unite(&instance, 1, &options, NULL, &moved, &failure));
        vsh_grid_info info;
        vsh_grid_get_info(moved, &info);
        assert_float_equal(info.voxel_size, i == 0 ? 0.06 : voxels[i], 1e-9);
        const double worst = worst_error(moved, moved_sphere, 2.9, 2.9);
        print_message("resampled sphere, voxel %g: worst error %.3f voxels\n", info.voxel_size, worst);
        assert_true(worst < 0.15);
        assert_int_equal(wrong_blocks(moved, moved_sphere, 10), 0);
    }
}

TEST(rooms_stay_open_in_a_union_of_different_lattices) {
    const vsh_sdf sdf = hollow_sphere();
    const vsh_grid_options options = with_voxel(0.03);
    OWNED(vsh_grid) *room = NULL;
    assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &room, &failure));
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.05);
    const double turned[12] = {0.12, -0.16, 0, 0, 0.16, 0.12, 0, 0, 0, 0, 0.2, 0};
    const vsh_grid_instance instances[2] = {{ball, turned}, {room, NULL}};
    OWNED(vsh_grid) *both = NULL;
    assert_ok(vsh_grid_unite(instances, 2, &options, NULL, &both, &failure));
    assert_true(worst_error(both, room_with_a_ball, 2.9, 2.9) < 0.15);
    assert_int_equal(wrong_blocks(both, room_with_a_ball, 8), 0);
}

TEST(threads_do_not_show_in_unions) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.05);
    const double turned[12] = {0.6, -0.8, 0, 0.5, 0.8, 0.6, 0, 0, 0, 0, 1, 0.1};
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, turned}};
    vsh_grid *first = NULL;
    const int32_t threads[3] = {1, 2, 5};
    for (int i = 0; i < 3; ++i) {
        const vsh_run run = run_on(threads[i]);
        vsh_grid *both = NULL;
        assert_ok(vsh_grid_unite(instances, 2, NULL, &run, &both, &failure));
        if (first != NULL) {
            assert_same_leaves(first, both, 0.0f);
            vsh_grid_free(both);
        } else {
            first = both;
        }
    }
    vsh_grid_free(first);
}

TEST(bad_unions_are_refused_with_the_reason) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.05);
    const double uneven[12] = {1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0};
    const double sheared[12] = {1, 0.3, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const double lost[12] = {1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0};
    const double far_away[12] = {1, 0, 0, 1e9, 0, 1, 0, 0, 0, 0, 1, 0};
    vsh_grid *both = NULL;
    vsh_grid_instance instances[2] = {{ball, NULL}, {ball, uneven}};
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT,
                 "length 1, 2, 1");
    instances[1].transform = sheared;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "instance 1");
    instances[1].transform = lost;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "instance 1");
    instances[1].transform = far_away;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_LIMIT, "longest side");
    instances[1].grid = NULL;
    assert_fails(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "no grid");
    assert_fails(vsh_grid_unite(NULL, 0, NULL, NULL, &both, &failure), VSH_ERROR_ARGUMENT, "no grids");
    const vsh_grid_options options = with_voxel(2e-5);
    assert_fails(vsh_grid_unite(instances, 1, &options, NULL, &both, &failure), VSH_ERROR_LIMIT, "memory");
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000000;
    instances[1] = instances[0];
    assert_fails(vsh_grid_unite(instances, 2, NULL, &run, &both, &failure), VSH_ERROR_LIMIT, "limit of 1 MB");
    assert_null(both);
}
