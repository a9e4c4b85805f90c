/* How fields are made: the same bits for any number of threads, limits, progress, bad input. */
#include "fields.h"
#include "testing.h"

#include "field/field.h"

#define VOXEL 0.04

TEST(the_memory_limit_covers_every_level) {
    OWNED(vsh_grid) *grid = grid_of(truth_seeds(), VOXEL);
    vsh_field *field = NULL;
    assert_ok(vsh_field_create(grid, NULL, NULL, &field, &failure));
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    vsh_field_free(field);

    vsh_run run = vsh_run_default();
    vsh_grid_info from;
    vsh_grid_get_info(grid, &from);
    run.memory_limit = from.bytes + info.bytes - 1; /* what is given and what comes of it would pass it */
    assert_int_equal(vsh_field_create(grid, NULL, &run, &field, &failure), VSH_ERROR_LIMIT);
    assert_null(field);
    assert_int_equal(failure.code, VSH_ERROR_LIMIT);
    assert_non_null(strstr(failure.message, "memory limit"));
    assert_null(strchr(failure.message, '\n'));
    run.memory_limit = 1000;
    assert_int_equal(vsh_field_create(grid, NULL, &run, &field, NULL), VSH_ERROR_LIMIT);
    assert_null(field);
    run.memory_limit = 1u << 30;
    assert_ok(vsh_field_create(grid, NULL, &run, &field, &failure));
    vsh_field_free(field);
}

typedef struct progress_log {
    double limit; /* asks to stop from this fraction on */
    double last;
    size_t calls, after_stop;
    bool falls, stopped, misnamed;
} progress_log;

static int32_t watch(void *user, const char *stage, double fraction) {
    progress_log *log = user;
    ++log->calls;
    log->falls = log->falls || !(fraction >= log->last && fraction >= 0.0 && fraction <= 1.0);
    log->after_stop += log->stopped;
    log->misnamed = log->misnamed || strcmp(stage, "field") != 0;
    log->last = fraction;
    log->stopped = log->stopped || fraction >= log->limit;
    return log->stopped;
}

TEST(progress_rises_from_0_to_1_and_can_cancel_anywhere) {
    OWNED(vsh_grid) *grid = grid_of(truth_seeds(), VOXEL);
    vsh_run run = vsh_run_default();
    run.progress = watch;
    const double limits[] = {2.0, 0.0, 0.1, 0.5};
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; ++i) {
        for (int32_t threads = 1; threads <= 5; threads += 4) {
            progress_log log = {.limit = limits[i], .last = 0.0};
            OWNED(vsh_field) *field = NULL;
            run.user = &log;
            run.threads = threads;
            const vsh_result result = vsh_field_create(grid, NULL, &run, &field, &failure);
            assert_false(log.falls);
            assert_false(log.misnamed);
            assert_int_equal(log.after_stop, 0);
            if (limits[i] > 1.0) {
                assert_ok(result);
                assert_non_null(field);
                assert_true(log.last >= 1.0);
                assert_true(log.calls > 3);
            } else {
                assert_int_equal(result, VSH_ERROR_CANCELLED);
                assert_int_equal(failure.code, VSH_ERROR_CANCELLED);
                assert_null(field);
            }
        }
    }
    /* at 1 nothing is left to stop: either answer is true, and neither leaks nor lies */
    progress_log log = {.limit = 1.0, .last = 0.0};
    OWNED(vsh_field) *field = NULL;
    run.user = &log;
    const vsh_result result = vsh_field_create(grid, NULL, &run, &field, NULL);
    assert_true(result == VSH_OK ? field != NULL : result == VSH_ERROR_CANCELLED && field == NULL);
    assert_true(log.last >= 1.0);
}

TEST(options_and_runs_are_checked) {
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.0};
    OWNED(vsh_grid) *grid = grid_of((truth_scene){&ball, 1}, 0.1);
    vsh_field *field = NULL;
    assert_ok(vsh_field_create(grid, NULL, NULL, &field, &failure));
    assert_non_null(field);
    vsh_field_free(field);

    const double reaches[] = {-1.0, (double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 4; ++i) {
        vsh_field_options options = vsh_field_options_default();
        options.reach = reaches[i];
        assert_int_equal(vsh_field_create(grid, &options, NULL, &field, &failure), VSH_ERROR_ARGUMENT);
        assert_null(field);
        assert_non_null(strstr(failure.message, "reach"));
        assert_int_equal(vsh_field_create(grid, &options, NULL, &field, NULL), VSH_ERROR_ARGUMENT);
    }
    /* the last ends within a member: half a pointer would be called */
    const size_t sizes[] = {0, sizeof(size_t), sizeof(vsh_field_options) + 8, SIZE_MAX,
                            offsetof(vsh_run, progress) + 2};
    for (int i = 0; i < 5; ++i) {
        vsh_field_options options = vsh_field_options_default();
        options.struct_size = sizes[i];
        assert_fails(vsh_field_create(grid, &options, NULL, &field, &failure), VSH_ERROR_ARGUMENT,
                     "vsh_field_options");
        vsh_run run = vsh_run_default();
        run.struct_size = i == 2 ? sizeof run + 8 : sizes[i];
        assert_fails(vsh_field_create(grid, NULL, &run, &field, &failure), VSH_ERROR_ARGUMENT, "vsh_run");
    }
    vsh_run run = run_on(-1);
    assert_int_equal(vsh_field_create(grid, NULL, &run, &field, &failure), VSH_ERROR_ARGUMENT);
    run.threads = 1025;
    assert_int_equal(vsh_field_create(grid, NULL, &run, &field, &failure), VSH_ERROR_ARGUMENT);
    vsh_field_free(NULL);
}

/* A reach beyond anything must not make levels without end. */
TEST(a_huge_reach_is_refused_or_met) {
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.0};
    OWNED(vsh_grid) *grid = grid_of((truth_scene){&ball, 1}, 0.1);
    const double reaches[] = {1e3, 1e6, 1e12, 1e300};
    for (int i = 0; i < 4; ++i) {
        vsh_field_options options = vsh_field_options_default();
        options.reach = reaches[i];
        OWNED(vsh_field) *field = NULL;
        const vsh_result result = vsh_field_create(grid, &options, NULL, &field, NULL);
        if (result == VSH_OK) {
            vsh_field_info info;
            vsh_field_get_info(field, &info);
            print_message("reach %g: %d levels, %g, %.1f MB\n", reaches[i], info.levels, info.reach,
                          (double)info.bytes / 1e6);
            assert_true(info.levels <= VSHI_MAX_LEVELS);
            assert_true(info.reach >= reaches[i] || info.levels == VSHI_MAX_LEVELS);
            const double far[3] = {0.5 * fmin(reaches[i], 1e12), 0.0, 0.0}, centre[3] = {0.0, 0.0, 0.0};
            float h;
            vsh_field_sample(field, 1, far, &h);
            assert_true(fabs((double)h - (far[0] - 1.0)) <= 0.2 * far[0]);
            vsh_field_sample(field, 1, centre, &h);
            assert_true(h < -0.8f);
        } else {
            assert_true(result == VSH_ERROR_LIMIT || result == VSH_ERROR_ARGUMENT);
        }
    }
}
