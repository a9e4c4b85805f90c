/* Dense copies of grids in files: values and active voxels, as OpenVDB reads them back. */
#include "volumes.h"

#include <stdio.h>
#include <unistd.h>

static char path[64];

static int make_file(void **state) {
    (void)state;
    strcpy(path, "copy-XXXXXX");
    const int file = mkstemp(path);
    return file < 0 || close(file) != 0;
}

static int remove_file(void **state) {
    (void)state;
    return unlink(path);
}

/* A level set of a ball, written as `surface`: its distances are known. */
static void write_ball(double voxel) {
    vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf tree = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_from_sdf(&tree, &options, NULL, &grid, NULL), VSH_OK);
    assert_int_equal(vsh_grid_write(grid, path, NULL, NULL, 0, NULL), VSH_OK);
    vsh_grid_free(grid);
}

static void a_balls_distances_are_where_they_belong_and_active_within_the_band(void **unused) {
    (void)unused;
    const double voxel = 0.125, half = 3.0 * voxel;
    write_ball(voxel);
    const int32_t low[3] = {-12, -11, -13}, size[3] = {25, 21, 27}; /* not the same along any two axes */
    const size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    float *values = malloc(count * sizeof *values), *active = malloc(count * sizeof *active);
    assert_true(values != NULL && active != NULL);
    vsh_error error = {VSH_OK, ""};
    if (vsh_vdb_copy(path, "surface", low, size, NULL, values, active, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    size_t within = 0;
    for (size_t i = 0; i < count; ++i) {
        const double x = voxel * (low[0] + (double)(i % 25)), y = voxel * (low[1] + (double)(i / 25 % 21));
        const double z = voxel * (low[2] + (double)(i / 25 / 21)), truth = sqrt(x * x + y * y + z * z) - 1.0;
        const double expected = fmin(half, fmax(-half, truth));
        assert_true(fabs((double)values[i] - expected) < 0.02 * voxel);
        assert_true(active[i] == 0.0f || active[i] == 1.0f);
        if (fabs(fabs(truth) - half) > 0.1 * voxel) { /* at its very edge either will do */
            assert_true((active[i] == 1.0f) == (fabs(truth) < half));
            within += active[i] == 1.0f;
        }
    }
    assert_true(within > 1000);
    /* each alone, and by the first grid's name */
    float one = 7.0f;
    const int32_t middle[3] = {0, 0, 8}, single[3] = {1, 1, 1};
    assert_int_equal(vsh_vdb_copy(path, NULL, middle, single, NULL, &one, NULL, NULL), VSH_OK);
    assert_true(fabs((double)one) < 0.02 * voxel);
    assert_int_equal(vsh_vdb_copy(path, NULL, middle, single, NULL, NULL, &one, NULL), VSH_OK);
    assert_true(one == 1.0f);
    free(values);
    free(active);
}

static void bad_calls_and_files_are_refused(void **unused) {
    (void)unused;
    write_ball(0.25);
    const int32_t low[3] = {0, 0, 0}, one[3] = {1, 1, 1}, none[3] = {1, 0, 1}, most[3] = {65536, 65536, 2};
    const int32_t far[3] = {INT32_MAX, 0, 0}, two[3] = {2, 1, 1};
    float value;
    vsh_error error;
    assert_int_equal(vsh_vdb_copy(path, NULL, low, none, NULL, &value, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "along y"));
    assert_int_equal(vsh_vdb_copy(path, NULL, low, most, NULL, &value, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_vdb_copy(path, NULL, far, two, NULL, &value, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_vdb_copy(path, "density", low, one, NULL, &value, NULL, &error), VSH_ERROR_INPUT);
    assert_non_null(strstr(error.message, "density"));
    assert_int_equal(vsh_vdb_copy("no/such.vdb", NULL, low, one, NULL, &value, NULL, &error), VSH_ERROR_READ);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000;
    assert_int_equal(vsh_vdb_copy(path, NULL, low, one, &run, &value, NULL, &error), VSH_ERROR_LIMIT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_balls_distances_are_where_they_belong_and_active_within_the_band),
        cmocka_unit_test(bad_calls_and_files_are_refused),
    };
    return cmocka_run_group_tests(tests, make_file, remove_file);
}
