/* How fields are made: the same bits for any number of threads, limits, progress, bad input. */
#include "fields.h"
#include "testing.h"

#include "field/field.h"

#define VOXEL 0.04

static void random_point(uint64_t *counter, double margin, double p[3]) {
    p[0] = between(counter, -3.0 - margin, 3.0 + margin);
    p[1] = between(counter, -0.5 - margin, 2.0 + margin);
    p[2] = between(counter, -3.0 - margin, 3.0 + margin);
}

static void assert_same_fields(const vsh_field *a, const vsh_field *b) {
    vsh_field_info x, y;
    vsh_field_get_info(a, &x);
    vsh_field_get_info(b, &y);
    assert_int_equal(x.levels, y.levels);
    assert_int_equal(x.bricks, y.bricks);
    assert_int_equal(x.bytes, y.bytes);
    size_t blocks = 0;
    for (int32_t l = 0; l < a->level_count; ++l) {
        const int32_t *size = a->levels[l].size;
        assert_memory_equal(a->levels[l].origin, b->levels[l].origin, sizeof a->levels[l].origin);
        assert_memory_equal(size, b->levels[l].size, sizeof a->levels[l].size);
        assert_int_equal(a->levels[l].brick_count, b->levels[l].brick_count);
        blocks += (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    }
    assert_memory_equal(a->index, b->index, blocks * sizeof *a->index);
    assert_int_equal(a->value_count, b->value_count);
    assert_memory_equal(a->values, b->values, (size_t)a->value_count * sizeof *a->values);
    assert_memory_equal(a->bounds_min, b->bounds_min, sizeof a->bounds_min);
    assert_memory_equal(a->bounds_max, b->bounds_max, sizeof a->bounds_max);
}

TEST(any_number_of_threads_makes_the_same_bits) {
    OWNED(vsh_grid) *grid = grid_of(truth_seeds(), VOXEL);
    const int32_t threads[] = {1, 2, 5};
    vsh_field *fields[3];
    for (int i = 0; i < 3; ++i) {
        const vsh_run run = run_on(threads[i]);
        assert_ok(vsh_field_create(grid, NULL, &run, &fields[i], &failure));
        assert_same_fields(fields[0], fields[i]);
    }
    enum { COUNT = 100000 };
    FREED double *positions = malloc(3 * COUNT * sizeof *positions);
    FREED float *values = malloc(3 * COUNT * sizeof *values);
    assert_non_null(positions);
    assert_non_null(values);
    uint64_t counter = 1;
    for (size_t i = 0; i < COUNT; ++i) {
        random_point(&counter, 1.0, positions + 3 * i);
    }
    for (int i = 0; i < 3; ++i) {
        vsh_field_sample(fields[i], COUNT, positions, values + i * COUNT);
        assert_memory_equal(values, values + i * COUNT, COUNT * sizeof *values);
    }
    for (int i = 0; i < 3; ++i) {
        vsh_field_free(fields[i]);
    }
}

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

int main(void) {
    return run_all_tests(NULL, NULL);
}
