/* Volumes: voxels inside solids, sparseness, limits, and what is refused. */
#include "previews.h"
#include "testing.h"
#include "volumes.h"

#include <sys/stat.h>

static const double UP[3] = {0.0, 1.0, 0.0};

static char vdb_path[64];

static int make_file(void **state) {
    strcpy(vdb_path, "copy-XXXXXX");
    const int file = mkstemp(vdb_path);
    return file < 0 || close(file) != 0;
}

static int remove_file(void **state) {
    return unlink(vdb_path);
}

static truth_scene ball(void) {
    static const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 1.0};
    return (truth_scene){&solid, 1};
}

/* --- inside */

/* On the lit side of a ball a renderer that interpolates between voxels sees what the surface's own points
 * see; it does not where inside voxels are dark. */
TEST(interpolating_at_the_surface_darkens_nothing) {
    vsh_grid *grid = grid_of(ball(), 0.05);
    OWNED(vsh_voxels) *voxels = band_of(grid, 0.0);
    OWNED(vsh_field) *field = field_of_grid(grid, 1.0);
    const vsh_light light = sun(UP, RADIANS(5.0));
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    uint64_t counter = 5;
    size_t lit = 0, dark = 0;
    for (int i = 0; i < 4000; ++i) {
        double p[3];
        float value;
        random_direction(&counter, p);
        assert_ok(vsh_volume_sample(volume, 0, 1, p, &value, &failure));
        if (p[1] > 0.2) { /* beyond the voxels that the terminator passes */
            assert_true(value == 1.0f);
            ++lit;
        } else if (p[1] < -0.2) {
            assert_true(value == 0.0f);
            ++dark;
        }
    }
    assert_true(lit > 1000 && dark > 1000);
}

/* By looking at every voxel within five: what a filled one holds is held by one of the nearest outside. */
TEST(inside_voxels_take_the_nearest_outside_value_or_are_off) {
    const double low[3] = {-1.4, -1.4, -1.4}, high[3] = {1.4, 1.4, 1.4};
    vsh_grid *grid = grid_of(ball(), 0.05);
    vsh_voxels *all[2] = {band_of(grid, 0.0), box_of(low, high, 0.07)};
    OWNED(vsh_field) *field = field_of_grid(grid, 2.0);
    const double towards[3] = {0.4, 1.0, 0.1};
    const vsh_light light = sun(towards, RADIANS(60.0));
    for (int v = 0; v < 2; ++v) {
        vsh_volume_options options = preview_volume_options();
        OWNED(vsh_volume) *nearest = bake(occluders_of(field), all[v], &light, 1, &options, NULL);
        options.inside = VSH_INSIDE_OFF;
        OWNED(vsh_volume) *off = bake(occluders_of(field), all[v], &light, 1, &options, NULL);
        vsh_volume_info filled, left;
        vsh_volume_get_info(nearest, &filled);
        vsh_volume_get_info(off, &left);
        vsh_volume_grid grids[2];
        vsh_volume_get_grid(nearest, 0, &grids[0]);
        vsh_volume_get_grid(off, 0, &grids[1]);
        assert_true(filled.filled > 1000 && filled.shaded == left.shaded && left.filled == 0);
        assert_true(left.off == filled.filled + filled.off);
        assert_true(grids[0].active_voxels == filled.shaded + filled.filled);
        assert_true(grids[1].active_voxels == left.shaded);
        FREED_BY(free_dense) dense d = copy_of(nearest, 0, all[v]), e = copy_of(off, 0, all[v]);
        FREED double *centre = centres_of(&d, all[v]);
        FREED float *distance = distances_of(field, d.count, centre);
        size_t checked = 0;
        for (size_t i = 0; i < d.count; ++i) {
            if (!(distance[i] < 0.0f && distance[i] > -0.14f)) {
                continue;
            }
            assert_true(e.values[i] == 1.0f); /* the background */
            int32_t at[3];
            index_of(&d, i, at);
            int best = INT32_MAX;
            bool found = false;
            for (int k = 0; k < 11 * 11 * 11; ++k) {
                const int step[3] = {k / 121 - 5, k / 11 % 11 - 5, k % 11 - 5};
                size_t n = 0;
                bool within = true;
                for (int axis = 2; axis >= 0; --axis) {
                    const int32_t place = at[axis] - d.low[axis] + step[axis];
                    within = within && place >= 0 && place < d.size[axis];
                    n = n * (size_t)d.size[axis] + (size_t)place;
                }
                const int square = step[0] * step[0] + step[1] * step[1] + step[2] * step[2];
                if (!within || distance[n] < 0.0f || (v == 0 && distance[n] > 0.1499f) || square > best) {
                    continue;
                }
                found = (square == best && found) || d.values[n] == d.values[i];
                best = square;
            }
            assert_true(best > 16 || found);
            checked += best <= 16;
        }
        assert_true(checked > 1000);
    }
    vsh_voxels_free(all[1]);
    vsh_voxels_free(all[0]);
}

TEST(a_narrower_band_holds_only_voxels_so_near) {
    vsh_grid *grid = grid_of(ball(), 0.05);
    OWNED(vsh_voxels) *whole = band_of(grid, 0.0), *narrow = band_of(grid, 1.0), *widest = band_of(grid, 3.0);
    vsh_voxels_info info[3];
    vsh_voxels_get_info(whole, &info[0]);
    vsh_voxels_get_info(narrow, &info[1]);
    vsh_voxels_get_info(widest, &info[2]);
    vsh_grid_info of_grid;
    vsh_grid_get_info(grid, &of_grid);
    assert_true(info[0].count == of_grid.active_voxels && info[2].count == info[0].count);
    const double shell = 4.0 * PI * 400.0; /* voxel² of the surface */
    assert_true(fabs((double)info[1].count - 2.0 * shell) < 0.1 * shell);
    assert_true(info[0].has_normals == 1);
    OWNED(vsh_field) *field = field_of_grid(grid, 1.0);
    const vsh_light light = sun(UP, 0.1);
    OWNED(vsh_volume) *volume = bake(occluders_of(field), narrow, &light, 1, NULL, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, narrow);
    vsh_volume_grid made;
    vsh_volume_get_grid(volume, 0, &made);
    assert_true(made.active_voxels == info[1].count);
}

/* --- sparse, and the same */

TEST(uniform_regions_are_tiles) {
    const double low[3] = {-6.4, -6.4, -6.4}, high[3] = {6.4, 6.4, 6.4};
    OWNED(vsh_field) *field = field_of(ball(), 0.05, 4.0);
    OWNED(vsh_voxels) *voxels = box_of(low, high, 0.1);
    const vsh_light light = sun(UP, RADIANS(3.0));
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    vsh_volume_grid grid;
    vsh_volume_info info;
    vsh_volume_get_grid(volume, 0, &grid);
    vsh_volume_get_info(volume, &info);
    const uint64_t solid = 128 * 128 * 128;
    assert_true(grid.active_voxels + info.off == solid);
    assert_true(grid.tiles > 1000 && grid.leaves < 700); /* of 4096 blocks */
    assert_true(info.bytes < solid * sizeof(float) / 3);
    assert_string_equal(grid.name, "shadow.sun");
    vsh_volume_get_grid(volume, 1, &grid);
    assert_true(grid.name[0] == '\0' && grid.active_voxels == 0);
}

/* --- values read back */

TEST(samples_are_interpolated_between_voxels) {
    OWNED(vsh_field) *field = field_of(ball(), 0.1, 4.0);
    OWNED(vsh_voxels) *voxels = cube_of(2.0, 0.25);
    const vsh_light light = sun(UP, RADIANS(40.0));
    OWNED(vsh_volume) *volume = bake(occluders_of(field), voxels, &light, 1, NULL, NULL);
    FREED_BY(free_dense) dense d = copy_of(volume, 0, voxels);
    assert_true(d.size[0] == 16 && d.size[1] == 16 && d.size[2] == 16);
    float value;
    for (size_t i = 0; i + 1 < d.count; i += 7) {
        int32_t index[3], next[3];
        double a[3], b[3];
        index_of(&d, i, index);
        vsh_voxels_centre(voxels, index, a);
        for (int axis = 0; axis < 3; ++axis) {
            assert_true(fabs(a[axis] - (-2.0 + 0.25 * (index[axis] + 0.5))) < 1e-12);
        }
        vsh_volume_sample(volume, 0, 1, a, &value, NULL);
        assert_true(fabsf(value - d.values[i]) < 1e-6f);
        if (i % 16 == 15) {
            continue;
        }
        memcpy(next, index, sizeof next);
        ++next[0];
        vsh_voxels_centre(voxels, next, b);
        const double between_them[3] = {0.75 * a[0] + 0.25 * b[0], a[1], a[2]};
        vsh_volume_sample(volume, 0, 1, between_them, &value, NULL);
        assert_true(fabsf(value - (0.75f * d.values[i] + 0.25f * d.values[i + 1])) < 1e-6f);
    }
    const double outside[3][3] = {{50.0, 0.0, 0.0}, {NAN, 0.0, 0.0}, {0.0, 1e300, 0.0}};
    float values[3];
    vsh_volume_sample(volume, 0, 3, &outside[0][0], values, NULL);
    assert_true(values[0] == 1.0f && isnan(values[1]) && isnan(values[2]));
    assert_fails(vsh_volume_sample(volume, 1, 1, outside[0], &value, &failure), VSH_ERROR_ARGUMENT, "grid 1");
    const int32_t zero[3] = {4, 0, 4}, last[3] = {INT32_MAX, 0, 0}, two[3] = {2, 1, 1};
    assert_fails(vsh_volume_copy(volume, 0, d.low, zero, &value, &failure), VSH_ERROR_ARGUMENT, "along y");
    assert_fails(vsh_volume_copy(volume, 0, last, two, values, &failure), VSH_ERROR_ARGUMENT, "along x");
}

/* --- limits, bad input */

typedef struct watch {
    double last, stop;
} watch;

static int32_t watch_progress(void *user, const char *stage, double fraction) {
    watch *w = user;
    assert_string_equal(stage, "volume");
    assert_true(fraction >= w->last && fraction <= 1.0);
    w->last = fraction;
    return fraction >= w->stop;
}

TEST(progress_goes_to_one_and_cancels_anywhere) {
    OWNED(vsh_field) *field = field_of(ball(), 0.1, 4.0);
    OWNED(vsh_voxels) *voxels = cube_of(2.0, 0.05);
    const vsh_light light = sun(UP, 0.1);
    const double stops[] = {2.0, 0.0, 0.3, 0.97, 1.0};
    for (size_t i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        watch w = {0.0, stops[i]};
        vsh_run run = run_watched(watch_progress, &w);
        run.threads = 2;
        OWNED(vsh_volume) *volume = NULL;
        vsh_shade_stats stats = vsh_shade_stats_zero();
        const vsh_result result =
            vsh_bake_volume(occluders_of(field), voxels, &light, 1, NULL, &run, &volume, &stats, &failure);
        if (i == 0) {
            assert_int_equal(result, VSH_OK);
            assert_true(w.last == 1.0 && stats.samples > 0);
        } else {
            assert_int_equal(result, VSH_ERROR_CANCELLED);
            assert_non_null(strstr(failure.message, "volume"));
            assert_null(volume);
        }
    }
}

TEST(memory_is_estimated_before_it_is_taken) {
    vsh_grid *grid = grid_of(ball(), 0.1);
    vsh_run run = run_within(1000000);
    OWNED(vsh_voxels) *voxels = NULL;
    const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    assert_fails(vsh_voxels_from_box(low, high, 0.001, &run, &voxels, &failure), VSH_ERROR_LIMIT,
                 "box of 1000 x 1000 x 1000 voxels");
    assert_non_null(strstr(failure.message, "limit"));
    run.memory_limit = 1000;
    assert_fails(vsh_voxels_from_grid(grid, 0.0, &run, &voxels, &failure), VSH_ERROR_LIMIT, "band");
    voxels = cube_of(2.0, 0.05);
    OWNED(vsh_field) *field = field_of_grid(grid, 4.0);
    vsh_light lights[2] = {sun(UP, 0.1), sun(UP, 0.2)};
    strcpy(lights[1].name, "moon");
    vsh_volume *volume = NULL;
    run.memory_limit = 1600000; /* 1000 blocks: enough for the one, not for its values */
    assert_fails(vsh_bake_volume(occluders_of(field), voxels, lights, 2, NULL, &run, &volume, NULL, &failure),
                 VSH_ERROR_LIMIT, "2 grids of 512000 voxels");
    run.memory_limit = 0;
    /* 2^31 voxels and more: refused by memory, or by what indices hold, wherever it runs */
    run.memory_limit = (uint64_t)4 << 30;
    vsh_voxels *none = NULL;
    assert_fails(vsh_voxels_from_box(low, high, 1.0 / 1291.0, &run, &none, &failure), VSH_ERROR_LIMIT,
                 "1291 x 1291 x 1291");
    const double far_away[3] = {1e5, 1.0, 1.0};
    assert_fails(vsh_voxels_from_box(low, far_away, 1e-4, &run, &none, &failure), VSH_ERROR_LIMIT, "along x");
    assert_null(none);
}

TEST(bad_boxes_bands_and_options_are_refused) {
    static const struct {
        double low[3], high[3], voxel;
        vsh_result code;
        const char *part;
    } boxes[] = {
        {{0, 0, 0}, {1, 1, 0}, 0.1, VSH_ERROR_ARGUMENT, "along z"},
        {{0, 2, 0}, {1, 1, 1}, 0.1, VSH_ERROR_ARGUMENT, "2 … 1 along y"},
        {{NAN, 0, 0}, {1, 1, 1}, 0.1, VSH_ERROR_ARGUMENT, "along x"},
        {{0, 0, 0}, {INFINITY, 1, 1}, 0.1, VSH_ERROR_ARGUMENT, "along x"},
        {{0, 0, 0}, {1, 1, 1}, 0.0, VSH_ERROR_ARGUMENT, "voxel size 0"},
        {{0, 0, 0}, {1, 1, 1}, -1.0, VSH_ERROR_ARGUMENT, "voxel size -1"},
        {{0, 0, 0}, {1, 1, 1}, NAN, VSH_ERROR_ARGUMENT, "voxel size"},
        {{0, 0, 0}, {1e-5, 1e-5, 1e-5}, 1e-6, VSH_ERROR_LIMIT, "voxel size 1e-06"},
        {{1e15, 0, 0}, {1.1e15, 1, 1}, 100.0, VSH_ERROR_LIMIT, "from the origin"},
    };
    OWNED(vsh_voxels) *voxels = NULL;
    for (size_t i = 0; i < sizeof boxes / sizeof boxes[0]; ++i) {
        assert_fails(
            vsh_voxels_from_box(boxes[i].low, boxes[i].high, boxes[i].voxel, NULL, &voxels, &failure),
            boxes[i].code, boxes[i].part);
        assert_null(voxels);
    }
    vsh_grid *grid = grid_of(ball(), 0.1);
    const double bands[] = {-1.0, 3.5, NAN, INFINITY};
    for (int i = 0; i < 4; ++i) {
        assert_fails(vsh_voxels_from_grid(grid, bands[i], NULL, &voxels, &failure), VSH_ERROR_ARGUMENT,
                     "0 … 3");
    }
    voxels = cube_of(0.3, 0.1);
    OWNED(vsh_field) *field = field_of_grid(grid, 1.0);
    const vsh_occluders *occluders = occluders_of(field);
    OWNED(vsh_volume) *volume = NULL;
    vsh_volume_options inside = preview_volume_options(), rays = inside, taps = inside;
    inside.inside = 7;
    rays.shade.rays = 4097;
    taps.ao = 1;
    taps.shade.ao_method = VSH_AO_TAPS;
    vsh_light suns[2] = {sun(UP, 0.1), sun(UP, 0.2)}, nameless[2] = {suns[0], suns[0]},
              inverted = sun(UP, -1.0);
    nameless[1].name[0] = '\0';
    const struct {
        const vsh_light *lights;
        size_t count;
        const vsh_volume_options *options;
        const char *part;
    } bakes[] = {{NULL, 0, NULL, "nothing to bake"},
                 {suns, 2, NULL, "both named 'sun'"},
                 {nameless, 2, NULL, "light 1: no name"},
                 {&inverted, 1, NULL, "light 0"},
                 {suns, 1, &inside, "inside 7"},
                 {suns, 1, &rays, "rays 4097"},
                 {suns, 1, &taps, "taps"}};
    for (size_t i = 0; i < sizeof bakes / sizeof bakes[0]; ++i) {
        assert_fails(vsh_bake_volume(occluders, voxels, bakes[i].lights, bakes[i].count, bakes[i].options,
                                     NULL, &volume, NULL, &failure),
                     VSH_ERROR_ARGUMENT, bakes[i].part);
        assert_null(volume);
    }
    taps.ao = 0; /* the method of AO that is not baked does not matter */
    volume = bake(occluders, voxels, suns, 1, &taps, NULL);
    assert_fails(vsh_volume_write(volume, "/nowhere/at/all/x.vdb", 0, NULL, 0, &failure), VSH_ERROR_WRITE,
                 "/nowhere");
}

/* --- dense copies of grids in files, as OpenVDB reads them back */

/* A level set of a ball, written as `surface`: its distances are known. */
static void write_ball(double voxel) {
    vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf tree = {&node, 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    OWNED(vsh_grid) *grid = NULL;
    assert_ok(vsh_grid_from_sdf(&tree, &options, NULL, &grid, &failure));
    assert_ok(vsh_grid_write(grid, vdb_path, NULL, NULL, 0, &failure));
}

TEST(a_balls_distances_are_where_they_belong_and_active_within_the_band) {
    const double voxel = 0.125, half = 3.0 * voxel;
    write_ball(voxel);
    const int32_t low[3] = {-12, -11, -13}, size[3] = {25, 21, 27}; /* not the same along any two axes */
    const size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    FREED float *values = malloc(count * sizeof *values), *active = malloc(count * sizeof *active);
    assert_true(values != NULL && active != NULL);
    assert_ok(vsh_vdb_copy(vdb_path, "surface", low, size, NULL, values, active, &failure));
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
    assert_ok(vsh_vdb_copy(vdb_path, NULL, middle, single, NULL, &one, NULL, &failure));
    assert_true(fabs((double)one) < 0.02 * voxel);
    assert_ok(vsh_vdb_copy(vdb_path, NULL, middle, single, NULL, NULL, &one, &failure));
    assert_true(one == 1.0f);
}

TEST(bad_copies_are_refused) {
    write_ball(0.25);
    const int32_t low[3] = {0, 0, 0}, one[3] = {1, 1, 1}, none[3] = {1, 0, 1}, most[3] = {65536, 65536, 2};
    const int32_t far[3] = {INT32_MAX, 0, 0}, two[3] = {2, 1, 1};
    float value;
    assert_fails(vsh_vdb_copy(vdb_path, NULL, low, none, NULL, &value, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "along y");
    assert_int_equal(vsh_vdb_copy(vdb_path, NULL, low, most, NULL, &value, NULL, &failure),
                     VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_vdb_copy(vdb_path, NULL, far, two, NULL, &value, NULL, &failure),
                     VSH_ERROR_ARGUMENT);
    assert_fails(vsh_vdb_copy(vdb_path, "density", low, one, NULL, &value, NULL, &failure), VSH_ERROR_INPUT,
                 "density");
    assert_int_equal(vsh_vdb_copy("no/such.vdb", NULL, low, one, NULL, &value, NULL, &failure),
                     VSH_ERROR_READ);
    vsh_run run = run_within(1000);
    assert_int_equal(vsh_vdb_copy(vdb_path, NULL, low, one, &run, &value, NULL, &failure), VSH_ERROR_LIMIT);
}

FIXTURE(make_file, remove_file)
