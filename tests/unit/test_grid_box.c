/* Level sets that are read in part. */
#include "images.h"

#include <vdbshade/vdbshade.h>

/* A row of balls of radius 1, their middles at x = 0, 10, 20 … 70, in voxels of 0.1. */
enum { BALLS = 8 };

static void write_row(void) {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.radius = 1.0;
    const vsh_sdf ball = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.1;
    vsh_error error;
    vsh_grid *one, *row;
    assert_int_equal(vsh_grid_from_sdf(&ball, &options, NULL, &one, &error), VSH_OK);
    double places[BALLS][12];
    vsh_grid_instance instances[BALLS];
    for (int i = 0; i < BALLS; ++i) {
        for (int k = 0; k < 12; ++k) {
            places[i][k] = k % 5 == 0 ? 1.0 : k == 3 ? 10.0 * i : 0.0;
        }
        instances[i] = (vsh_grid_instance){one, places[i]};
    }
    assert_int_equal(vsh_grid_unite(instances, BALLS, &options, NULL, &row, &error), VSH_OK);
    assert_int_equal(vsh_grid_write(row, at("row.vdb"), NULL, NULL, 0, &error), VSH_OK);
    vsh_grid_free(row);
    vsh_grid_free(one);
}

static vsh_grid *read_row(void) {
    vsh_grid *grid;
    vsh_error error;
    assert_int_equal(vsh_grid_read(at("row.vdb"), NULL, NULL, &grid, &error), VSH_OK);
    return grid;
}

static vsh_grid *read_part(const double low[3], const double high[3], const vsh_run *run) {
    vsh_grid *grid;
    vsh_error error;
    if (vsh_grid_read_box(at("row.vdb"), NULL, low, high, run, &grid, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return grid;
}

/* Distances of a voxel's column around a point of the world: 20³ voxels. */
enum { SIDE = 20 };
static void copy_around(const vsh_grid *grid, double x, float values[SIDE * SIDE * SIDE]) {
    const int32_t first[3] = {(int32_t)lround(10.0 * x) - SIDE / 2, -SIDE / 2, -SIDE / 2},
                  size[3] = {SIDE, SIDE, SIDE};
    vsh_error error;
    assert_int_equal(vsh_grid_copy(grid, first, size, values, &error), VSH_OK);
}

static void a_part_has_the_values_of_the_whole_and_no_others(const vsh_run *run) {
    static float whole[SIDE * SIDE * SIDE], part[SIDE * SIDE * SIDE];
    vsh_grid *all = read_row(), *some = read_part((double[]){18, -2, -2}, (double[]){32, 2, 2}, run);
    vsh_grid_info of_all, of_some;
    vsh_grid_get_info(all, &of_all);
    vsh_grid_get_info(some, &of_some);
    assert_true(fabs((double)of_some.active_voxels / (double)of_all.active_voxels - 2.0 / BALLS) < 0.02);
    assert_true(of_some.bounds_min[0] > 18.0 && of_some.bounds_max[0] < 32.0);
    for (double x = 20.0; x <= 30.0; x += 10.0) {
        copy_around(all, x, whole);
        copy_around(some, x, part);
        assert_memory_equal(whole, part, sizeof whole);
    }
    copy_around(some, 40.0, part); /* nothing is there any more */
    for (int i = 0; i < SIDE * SIDE * SIDE; ++i) {
        assert_true(part[i] > 0.0f);
    }
    vsh_grid_free(all);
    vsh_grid_free(some);
}

static void a_part_is_read_here(void **state) {
    (void)state;
    write_row();
    a_part_has_the_values_of_the_whole_and_no_others(NULL);
}

static void a_part_is_read_by_a_reader(void **state) {
    (void)state;
    write_row();
    vsh_run run = vsh_run_default();
    run.reader = "/proc/self/exe"; /* see main() */
    a_part_has_the_values_of_the_whole_and_no_others(&run);
}

static void a_ball_that_the_box_cuts_is_right_where_it_is_left(void **state) {
    (void)state;
    static float whole[SIDE * SIDE * SIDE], part[SIDE * SIDE * SIDE];
    write_row();
    vsh_grid *all = read_row(), *half = read_part((double[]){-2, -2, -2}, (double[]){0.0, 2, 2}, NULL);
    copy_around(all, 0.0, whole);
    copy_around(half, 0.0, part);
    for (int i = 0; i < SIDE * SIDE * SIDE; ++i) {
        if (i % SIDE < SIDE / 2) { /* x < 0 */
            assert_true(part[i] == whole[i]);
        }
    }
    vsh_grid_free(all);
    vsh_grid_free(half);
}

static void a_box_of_nothing_gives_what_is_near(void **state) {
    (void)state;
    write_row();
    vsh_grid *near = read_part((double[]){53.5, -0.5, -0.5}, (double[]){54.0, 0.5, 0.5}, NULL);
    vsh_grid_info info;
    vsh_grid_get_info(near, &info);
    assert_true(info.active_voxels > 0);
    assert_true(info.bounds_min[0] > 40.0 && info.bounds_max[0] < 65.0);
    vsh_grid_free(near);
}

static void a_part_passes_a_limit_that_the_whole_does_not(void **state) {
    (void)state;
    write_row();
    vsh_grid *all = read_row();
    vsh_grid_info info;
    vsh_grid_get_info(all, &info);
    vsh_grid_free(all);
    vsh_run run = vsh_run_default();
    run.memory_limit = info.bytes / 2;
    vsh_error error;
    assert_int_equal(vsh_grid_read(at("row.vdb"), NULL, &run, &all, &error), VSH_ERROR_LIMIT);
    vsh_grid_free(read_part((double[]){18, -2, -2}, (double[]){22, 2, 2}, &run));
    run.memory_limit = info.bytes / 40;
    assert_int_equal(vsh_grid_read_box(at("row.vdb"), NULL, (double[]){18, -2, -2}, (double[]){22, 2, 2},
                                       &run, &all, &error),
                     VSH_ERROR_LIMIT);
}

static void a_box_that_is_none_is_refused(void **state) {
    (void)state;
    write_row();
    static const double boxes[][6] = {{0, 0, 0, 0, 1, 1},
                                      {0, 2, 0, 1, 1, 1},
                                      {(double)NAN, 0, 0, 1, 1, 1},
                                      {0, 0, 0, 1, 1, (double)INFINITY}};
    for (size_t i = 0; i < sizeof boxes / sizeof boxes[0]; ++i) {
        vsh_grid *grid = (vsh_grid *)1;
        vsh_error error;
        assert_int_equal(vsh_grid_read_box(at("row.vdb"), NULL, boxes[i], boxes[i] + 3, NULL, &grid, &error),
                         VSH_ERROR_ARGUMENT);
        assert_null(grid);
        assert_non_null(strstr(error.message, "row.vdb"));
    }
    vsh_grid_free(read_part((double[]){-1e300, -1e300, -1e300}, (double[]){1e300, 1e300, 1e300}, NULL));
}

int main(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], VSH_READER_ARGUMENT) == 0) {
        return vsh_reader_serve(argc, argv);
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_part_is_read_here),
        cmocka_unit_test(a_part_is_read_by_a_reader),
        cmocka_unit_test(a_ball_that_the_box_cuts_is_right_where_it_is_left),
        cmocka_unit_test(a_box_of_nothing_gives_what_is_near),
        cmocka_unit_test(a_part_passes_a_limit_that_the_whole_does_not),
        cmocka_unit_test(a_box_that_is_none_is_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
