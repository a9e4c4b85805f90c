/* What a volume will take, and how many of several machines there is work for. */
#include "previews.h"
#include "volumes.h"

static const double UP[3] = {0.0, 1.0, 0.0};

static vsh_error failure;

static truth_scene ball(void) {
    static const truth_solid solid = {.shape = TRUTH_SPHERE, .radius = 1.0};
    return (truth_scene){&solid, 1};
}

static vsh_volume_forecast forecast_of(const vsh_field *field, const vsh_voxels *voxels,
                                       const vsh_volume_options *options) {
    const vsh_light light = sun(UP, RADIANS(20.0));
    vsh_run run = vsh_run_default();
    run.threads = 1;
    vsh_volume_forecast f = {.grids = -1};
    if (vsh_bake_volume_forecast(occluders_of(field), voxels, &light, 1, options, &run, &f, &failure) !=
        VSH_OK) {
        fail_msg("%s", failure.message);
    }
    return f;
}

static size_t blocks_of(const vsh_voxels *voxels) {
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    return (size_t)info.blocks;
}

/* Of 64 times the blocks as many are tried, so that what they take is told as more: by a factor of 8 at
 * least, whatever else the machine does. */
static void what_is_tried_stands_for_all(void **state) {
    (void)state;
    vsh_field *field = field_of(ball(), 0.1, 4.0);
    const vsh_volume_options options = preview_volume_options();
    vsh_voxels *small = cube_of(2.0, 4.0 / 80.0), *large = cube_of(2.0, 4.0 / 320.0);
    assert_int_equal(blocks_of(large), 64 * blocks_of(small));
    const vsh_volume_forecast few = forecast_of(field, small, &options);
    const vsh_volume_forecast many = forecast_of(field, large, &options);
    assert_true(few.bake_s > 0.0 && many.bake_s > 8.0 * few.bake_s);
    vsh_voxels_free(large);
    vsh_voxels_free(small);
    vsh_field_free(field);
}

/* A ball at either end of a long box is as much work; its blocks are the first, or the last. */
static void pieces_from_all_over_are_tried(void **state) {
    (void)state;
    static const double low[2][3] = {{-1.5, -1.5, -1.5}, {-22.5, -1.5, -1.5}},
                        high[2][3] = {{22.5, 1.5, 1.5}, {1.5, 1.5, 1.5}};
    vsh_field *field = field_of(ball(), 0.1, 24.0);
    const vsh_volume_options options = preview_volume_options();
    double s[2];
    for (int end = 0; end < 2; ++end) {
        vsh_voxels *voxels = box_of(low[end], high[end], 0.03);
        s[end] = forecast_of(field, voxels, &options).bake_s;
        vsh_voxels_free(voxels);
    }
    print_message("ball first %.4f s, last %.4f s\n", s[0], s[1]);
    assert_true(s[0] < 4.0 * s[1] && s[1] < 4.0 * s[0]);
    vsh_field_free(field);
}

/* All values of all grids are within what memory is told, and little else. */
static void memory_and_grids_are_those_of_the_volume(void **state) {
    (void)state;
    vsh_field *field = field_of(ball(), 0.1, 4.0);
    vsh_voxels *voxels = cube_of(2.0, 4.0 / 160.0);
    vsh_volume_options options = preview_volume_options();
    const double values = (double)blocks_of(voxels) * 512.0 * sizeof(float);
    double before = 0.0;
    for (int32_t grids = 1; grids <= 2; ++grids) {
        options.ao = grids - 1;
        options.shade.ao_distance = 0.5;
        options.shade.ao_method = VSH_AO_CONES;
        const vsh_volume_forecast f = forecast_of(field, voxels, &options);
        assert_int_equal(f.grids, grids);
        assert_true(f.peak_bytes > grids * values);
        if (grids == 2) { /* one more grid; what trials leave in memory is little */
            assert_true(f.peak_bytes - before > values && f.peak_bytes - before < 1.5 * values);
        }
        before = f.peak_bytes;
    }
    vsh_voxels_free(voxels);
    vsh_field_free(field);
}

static void fewer_blocks_than_are_tried_are_tried_once(void **state) {
    (void)state;
    vsh_field *field = field_of(ball(), 0.1, 4.0);
    static const double sizes[] = {1.0, 0.4, 0.05, 0.04};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        vsh_voxels *voxels = cube_of(2.0, sizes[i]);
        const vsh_volume_options options = preview_volume_options();
        assert_int_equal(forecast_of(field, voxels, &options).grids, 1);
        vsh_voxels_free(voxels);
    }
    vsh_field_free(field);
}

static int32_t stop(void *user, const char *stage, double fraction) {
    (void)fraction;
    assert_string_equal(stage, "volume");
    ++*(int *)user;
    return 1;
}

static void what_a_bake_would_refuse_is_refused(void **state) {
    (void)state;
    vsh_field *field = field_of(ball(), 0.1, 4.0);
    vsh_voxels *voxels = cube_of(2.0, 0.05);
    const vsh_light light = sun(UP, 0.1);
    vsh_volume_options options = preview_volume_options();
    vsh_volume_forecast f;
    const vsh_occluders *casters = occluders_of(field);
#define FORECAST(casters, voxels, lights, count, run, to)                                                    \
    vsh_bake_volume_forecast(casters, voxels, lights, count, &options, run, to, &failure)
    assert_int_equal(FORECAST(NULL, voxels, &light, 1, NULL, &f), VSH_ERROR_ARGUMENT);
    assert_int_equal(FORECAST(casters, NULL, &light, 1, NULL, &f), VSH_ERROR_ARGUMENT);
    assert_int_equal(FORECAST(casters, voxels, NULL, 1, NULL, &f), VSH_ERROR_ARGUMENT);
    assert_int_equal(FORECAST(casters, voxels, NULL, 0, NULL, &f), VSH_ERROR_ARGUMENT); /* nothing to bake */
    assert_int_equal(FORECAST(casters, voxels, &light, 1, NULL, NULL), VSH_ERROR_ARGUMENT);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1 << 20;
    assert_int_equal(FORECAST(casters, voxels, &light, 1, &run, &f), VSH_ERROR_LIMIT);
    int calls = 0;
    run = vsh_run_default();
    run.progress = stop;
    run.user = &calls;
    assert_int_equal(FORECAST(casters, voxels, &light, 1, &run, &f), VSH_ERROR_CANCELLED);
    assert_true(calls > 0);
    vsh_voxels_free(voxels);
    vsh_field_free(field);
}

static void shards_have_as_much_work_as_was_asked_for(void **state) {
    (void)state;
    vsh_volume_options options = vsh_volume_options_default();
    const int32_t one = vsh_volume_shards(1e7, 1, &options, 0.1, 10000);
    assert_true(one > 1 && one < 10000);
    assert_in_range(vsh_volume_shards(2e7, 1, &options, 0.1, 10000), 2 * one, 2 * one + 1);
    assert_in_range(vsh_volume_shards(1e7, 1, &options, 0.05, 10000), 2 * one, 2 * one + 1);
    assert_true(vsh_volume_shards(1e7, 2, &options, 0.1, 10000) > one);
    options.shade.max_error = 0.002f;
    assert_true(vsh_volume_shards(1e7, 1, &options, 0.1, 10000) > one);
    options = vsh_volume_options_default();
    options.ao = 1;
    assert_true(vsh_volume_shards(1e7, 1, &options, 0.1, 10000) > 2 * one);
    assert_int_equal(vsh_volume_shards(1e7, 1, NULL, 0.1, 10000), one);
    assert_int_equal(vsh_volume_shards(1e7, 1, &options, 0.1, 3), 3);
    assert_int_equal(vsh_volume_shards(0.0, 1, &options, 0.1, 7), 1);
    assert_int_equal(vsh_volume_shards(1.0, 0, &options, 1e9, 7), 1);
    static const double no_least[] = {0.0, -1.0, NAN};
    for (size_t i = 0; i < 3; ++i) {
        assert_int_equal(vsh_volume_shards(1e7, 1, &options, no_least[i], 64), 64);
    }
    assert_int_equal(vsh_volume_shards(INFINITY, 1, &options, 0.1, 64), 64); /* not known */
    assert_int_equal(vsh_volume_shards(NAN, 1, &options, 0.1, 64), 64);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_tried_stands_for_all),
        cmocka_unit_test(pieces_from_all_over_are_tried),
        cmocka_unit_test(memory_and_grids_are_those_of_the_volume),
        cmocka_unit_test(fewer_blocks_than_are_tried_are_tried_once),
        cmocka_unit_test(what_a_bake_would_refuse_is_refused),
        cmocka_unit_test(shards_have_as_much_work_as_was_asked_for),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
