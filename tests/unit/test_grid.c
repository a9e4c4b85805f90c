/* Grids of distance callbacks and trees, and unions of grids. test_grid_mesh.c has meshes. */
#include "grids.h"
#include "testing.h"

#include <sys/resource.h>

TEST(a_sphere_is_exact_and_a_dense_copy_has_every_distance) {
    sphere s = {{0.3, 0, 0}, 1.0, 0};
    const vsh_distance field = sphere_field(&s);
    const vsh_grid_options options = with_voxel(0.05);
    OWNED(vsh_grid) *grid = NULL;
    assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure));
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_float_equal(info.voxel_size, 0.05, 1e-12);
    assert_float_equal(info.half_width, 3.0, 1e-6);
    int32_t size[3], low[3];
    for (int i = 0; i < 3; ++i) {
        const double centre = i == 0 ? 0.3 : 0.0;
        assert_true(info.bounds_min[i] > centre - 1.1 && info.bounds_min[i] < centre - 1.0 + 1e-9);
        assert_true(info.bounds_max[i] < centre + 1.1 && info.bounds_max[i] > centre + 1.0 - 1e-9);
        low[i] = info.index_min[i] - 1;
        size[i] = info.index_max[i] - low[i] + 2;
        assert_in_range(size[i], 2.0 / 0.05 + 4, 2.0 / 0.05 + 9);
    }
    FREED float *values = malloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2] * sizeof *values);
    assert_ok(vsh_grid_copy(grid, low, size, values, &failure));
    const float band = (float)(info.half_width * info.voxel_size);
    size_t at = 0;
    uint64_t active = 0;
    for (int32_t z = 0; z < size[2]; ++z) {
        for (int32_t y = 0; y < size[1]; ++y) {
            for (int32_t x = 0; x < size[0]; ++x, ++at) {
                const double index[3] = {low[0] + x, low[1] + y, low[2] + z};
                double p[3];
                for (int row = 0; row < 3; ++row) {
                    const double *m = info.transform + 4 * row;
                    p[row] = m[0] * index[0] + m[1] * index[1] + m[2] * index[2] + m[3];
                }
                const double truth = sqrt((p[0] - 0.3) * (p[0] - 0.3) + p[1] * p[1] + p[2] * p[2]) - 1.0;
                assert_float_equal(values[at], fmax(-band, fmin(band, truth)), 5e-7);
                const int edge =
                    x == 0 || y == 0 || z == 0 || x == size[0] - 1 || y == size[1] - 1 || z == size[2] - 1;
                assert_true(!edge || values[at] == band);
                active += fabsf(values[at]) < band;
            }
        }
    }
    assert_int_equal(active, info.active_voxels);
    const int32_t none[3] = {1, 0, 1}, last[3] = {INT32_MAX, 0, 0}, two[3] = {2, 1, 1};
    assert_int_equal(vsh_grid_copy(grid, low, none, values, &failure), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_grid_copy(grid, last, two, values, &failure), VSH_ERROR_ARGUMENT);
}

TEST(the_work_follows_the_area) {
    size_t calls[2];
    for (int i = 0; i < 2; ++i) {
        sphere s = {{0, 0, 0}, 1.0, 0};
        const vsh_distance field = sphere_field(&s);
        const vsh_grid_options options = with_voxel(i == 0 ? 0.02 : 0.01);
        vsh_grid *grid = NULL;
        assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure));
        vsh_grid_free(grid);
        calls[i] = s.calls;
    }
    const double voxels = 4.0 * 3.14159265 / (0.01 * 0.01);
    assert_less((double)calls[1], 20.0 * voxels);          /* layers of voxels, of which the band has 6 */
    assert_less((double)calls[1], 4.4 * (double)calls[0]); /* 4: area, 8: volume */
}

TEST(far_from_the_origin_nothing_changes) {
    const vsh_grid_options options = with_voxel(0.03125);
    vsh_grid *grids[2];
    vsh_grid_info infos[2];
    for (int i = 0; i < 2; ++i) {
        sphere s = {{0, 0, 0}, 1.0, 0};
        s.centre[0] = i * 1e7;
        s.centre[2] = i * -3e6;
        const vsh_distance field = sphere_field(&s);
        assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grids[i], &failure));
        vsh_grid_get_info(grids[i], &infos[i]);
    }
    assert_same_leaves(grids[0], grids[1], 1e-7f);
    assert_float_equal(infos[1].transform[3] - infos[0].transform[3], 1e7, 0.0);
    vsh_grid_free(grids[0]);
    vsh_grid_free(grids[1]);
}

TEST(a_room_inside_a_solid_stays_a_room) {
    const vsh_sdf sdf = hollow_sphere();
    const vsh_grid_options options = with_voxel(0.03);
    OWNED(vsh_grid) *grid = NULL;
    assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure));
    const double worst = worst_error(grid, hollow_truth, 2.9, 2.9);
    assert_less(worst, 0.15);
    assert_int_equal(wrong_blocks(grid, hollow_truth, 10), 0);
}

/* A bound that is too small by a third, and a cube root's worth of bend: only its zero can be trusted. */
static double squashed(void *user, const double p[3]) {
    const double d = unit_sphere(p);
    return 0.6 * d / (1.0 + fabs(d));
}

TEST(a_bound_becomes_a_distance) {
    const vsh_distance field = {squashed, NULL, 0.6, 0, {-1, -1, -1}, {1, 1, 1}};
    vsh_grid_options options = with_voxel(0.03);
    options.half_width = 5.0;
    OWNED(vsh_grid) *grid = NULL;
    assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure));
    const double worst = worst_error(grid, unit_sphere, 4.9, 4.9);
    assert_less(worst, 0.15);
    assert_int_equal(wrong_blocks(grid, unit_sphere, 10), 0);
}

static double hole_in_the_middle(void *user, const double p[3]) {
    const double d = unit_sphere(p);
    return d < -0.02 && d > -0.03 ? NAN : d;
}

static double nowhere_near(void *user, const double p[3]) {
    return 5.0 + 0.1 * p[0];
}

TEST(bad_fields_and_options_are_refused_with_the_reason) {
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance good = sphere_field(&s);
    vsh_distance field = good;
    vsh_grid_options options = vsh_grid_options_default();
    vsh_grid *grid = NULL;
    field.lipschitz = 0.0;
    assert_fails(vsh_grid_from_distance(&field, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                 "lipschitz 0");
    field = good;
    field.bounds_max[1] = NAN;
    assert_fails(vsh_grid_from_distance(&field, NULL, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                 "bounds[1]");
    field = good;
    field.distance = hole_in_the_middle;
    options.resolution = 100;
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_INPUT,
                 "nan at (");
    field.distance = nowhere_near;
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_INPUT,
                 "no surface");
    const struct {
        double voxel, half_width, shell;
        int32_t resolution;
        const char *part;
    } cases[] = {
        {-1.0, 3.0, 2.0, 256, "voxel_size -1"},    {NAN, 3.0, 2.0, 256, "voxel_size nan"},
        {INFINITY, 3.0, 2.0, 256, "voxel_size"},   {0.0, 3.0, 2.0, 1, "resolution 1"},
        {0.0, 2.5, 2.0, 256, "half_width 2.5"},    {0.0, NAN, 2.0, 256, "half_width"},
        {0.0, 3.0, 0.5, 256, "shell_thickness 0"}, {0.0, 101.0, 2.0, 256, "half_width 101"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        options.voxel_size = cases[i].voxel;
        options.half_width = cases[i].half_width;
        options.shell_thickness = cases[i].shell;
        options.resolution = cases[i].resolution;
        assert_fails(vsh_grid_from_distance(&good, &options, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                     cases[i].part);
    }
    options = vsh_grid_options_default();
    options.struct_size = 4000;
    assert_fails(vsh_grid_from_distance(&good, &options, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                 "struct_size");
    assert_null(grid);
}

TEST(too_small_a_voxel_is_refused_before_memory_is_taken) {
    sphere s = {{0, 0, 0}, 1.0, 0};
    const vsh_distance field = sphere_field(&s);
    OWNED(vsh_grid) *grid = NULL;
    struct rusage before;
    assert_int_equal(getrusage(RUSAGE_SELF, &before), 0);
    vsh_grid_options options = with_voxel(1e-9);
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size 1e-09");
    options = with_voxel(1e-6);
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "voxel size 1e-06");
    options = with_voxel(1.6e-5);
    assert_fails(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT,
                 "this machine's memory");
    assert_less(s.calls, 100000);
    struct rusage after;
    assert_int_equal(getrusage(RUSAGE_SELF, &after), 0);
    assert_less(after.ru_maxrss - before.ru_maxrss, 50000); /* KB */
    options = with_voxel(0.005);
    vsh_run run = run_within(10000000);
    assert_fails(vsh_grid_from_distance(&field, &options, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "over the memory limit of 10 MB");
    run.memory_limit = 500000000;
    assert_ok(vsh_grid_from_distance(&field, &options, &run, &grid, &failure));
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    assert_less(info.bytes, run.memory_limit);
}

/* The megabytes that a limit of one byte is told. */
static double foretold(const vsh_sdf *sdf, const vsh_grid_instance *instance,
                       const vsh_grid_options *options) {
    vsh_run run = run_within(1);
    vsh_grid *grid = NULL;
    const vsh_result result = sdf != NULL ? vsh_grid_from_sdf(sdf, options, &run, &grid, &failure)
                                          : vsh_grid_unite(instance, 1, options, &run, &grid, &failure);
    assert_int_equal(result, VSH_ERROR_LIMIT);
    const char *need = strstr(failure.message, "): about ");
    assert_non_null(need);
    return atof(need + 9);
}

TEST(re_distancing_is_foretold_with_the_band_that_it_makes) {
    const vsh_sdf sdf = hollow_sphere();
    vsh_grid_options options = with_voxel(0.02);
    OWNED(vsh_grid) *source = NULL;
    assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &source, &failure));
    const double turned[12] = {0.6, -0.8, 0, 0, 0.8, 0.6, 0, 0, 0, 0, 1, 0};
    const vsh_grid_instance instance = {source, turned};
    const double half_widths[] = {3.0, 10.0};
    for (int anew = 0; anew < 2; ++anew) { /* a tree that is no distance, a grid that is turned */
        for (size_t i = 0; i < sizeof half_widths / sizeof half_widths[0]; ++i) {
            options.half_width = half_widths[i];
            const double need = foretold(anew ? &sdf : NULL, &instance, &options);
            for (int over = 0; over < 2; ++over) {
                vsh_run run = run_within((uint64_t)(need * 1e6 * (over ? 1.2 : 0.95)));
                OWNED(vsh_grid) *grid = NULL;
                failure.message[0] = '\0';
                const vsh_result result = anew
                                              ? vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure)
                                              : vsh_grid_unite(&instance, 1, &options, &run, &grid, &failure);
                assert_int_equal(result, over ? VSH_OK : VSH_ERROR_LIMIT);
                if (!over) {
                    assert_non_null(strstr(failure.message, "over the memory limit"));
                    continue;
                }
                vsh_grid_info info;
                vsh_grid_get_info(grid, &info);
                /* distances, and the leaves that are made of them */
                assert_true(need * 1e6 > 2.0 * (double)info.bytes);
                assert_less(need * 1e6, 9.0 * (double)info.bytes);
            }
        }
    }
}

TEST(progress_rises_to_one_and_can_cancel) {
    const vsh_sdf sdf = hollow_sphere();
    const double stops[] = {2.0, 0.0, 0.1, 0.5, 0.9};
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i], 0};
        vsh_run run = run_on(2);
        run.progress = watch_progress;
        run.user = &w;
        vsh_grid *grid = NULL;
        const vsh_grid_options options = with_voxel(0.04);
        if (i == 0) {
            assert_ok(vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure));
            assert_float_equal(w.last, 1.0, 0.0);
            assert_true(w.calls > 10);
            vsh_grid_free(grid);
        } else {
            assert_fails(vsh_grid_from_sdf(&sdf, &options, &run, &grid, &failure), VSH_ERROR_CANCELLED,
                         "cancelled");
            assert_null(grid);
        }
    }
}

/* --- unions */

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
    assert_less(worst_error(same, unit_sphere, 2.95, 2.95), 1e-4);
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
        assert_less(worst, 0.15);
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
    assert_less(worst_error(both, room_with_a_ball, 2.9, 2.9), 0.15);
    assert_int_equal(wrong_blocks(both, room_with_a_ball, 8), 0);
}

TEST(threads_do_not_show_in_unions) {
    OWNED(vsh_grid) *ball = ball_grid(0.0, 1.0, 0.05), *one = NULL, *five = NULL;
    const double turned[12] = {0.6, -0.8, 0, 0.5, 0.8, 0.6, 0, 0, 0, 0, 1, 0.1};
    const vsh_grid_instance instances[2] = {{ball, NULL}, {ball, turned}};
    const vsh_run alone = run_on(1), many = run_on(5);
    assert_ok(vsh_grid_unite(instances, 2, NULL, &alone, &one, &failure));
    assert_ok(vsh_grid_unite(instances, 2, NULL, &many, &five, &failure));
    assert_same_leaves(one, five, 0.0f);
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
    vsh_run run = run_within(1000000);
    instances[1] = instances[0];
    assert_fails(vsh_grid_unite(instances, 2, NULL, &run, &both, &failure), VSH_ERROR_LIMIT, "limit of 1 MB");
    assert_null(both);
}
