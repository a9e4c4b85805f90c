/* The lowest layer: arrays that lie in files, and the error of elements that fail in parallel. */
#include "base/job.h"
#include "base/parallel.h"
#include "base/store.h"
#include "testing.h"

enum { MEBIBYTE = 1 << 20 };

/* Takes so many bytes, and returns how many of them are in memory. */
static uint64_t hold(vsh_run *run, const char *folder, size_t bytes) {
    char *copy = folder != NULL ? strdup(folder) : NULL;
    vshi_store store = {.run = run, .folder = copy};
    unsigned char *memory = NULL;
    assert_ok(vshi_store_take(&store, (void **)&memory, bytes, 1, "planes", &failure));
    assert_int_equal(memory[0] + memory[bytes - 1], 0);
    memory[bytes - 1] = 1;
    const uint64_t held = store.held;
    vshi_store_close(&store);
    return held;
}

TEST(planes_leave_an_eighth_of_the_limit_if_they_can_lie_in_a_file) {
    vsh_run run = vsh_run_default();
    run.memory_limit = 8 * MEBIBYTE;
    assert_int_equal(hold(&run, ".", 7 * MEBIBYTE), 7 * MEBIBYTE);
    assert_int_equal(hold(&run, ".", 7 * MEBIBYTE + 4096), 0);
    assert_int_equal(hold(&run, NULL, 8 * MEBIBYTE), 8 * MEBIBYTE);
}

enum { ELEMENTS = 64, FIRST_FAILURE = 17 };

static vsh_result fail_late(void *user, size_t index, vsh_error *error) {
    (void)user;
    return index < FIRST_FAILURE ? VSH_OK : vshi_fail(error, VSH_ERROR_INPUT, "element %zu", index);
}

TEST(the_error_is_that_of_the_lowest_element_that_failed) {
    for (int32_t threads = 1; threads <= 8; threads *= 2) {
        vsh_run run = vsh_run_default();
        run.threads = threads;
        vshi_job *job = vshi_job_begin(&run, "elements", ELEMENTS);
        assert_non_null(job);
        assert_int_equal(vshi_parallel_each(job, ELEMENTS, 1, 1, fail_late, NULL, &failure), VSH_ERROR_INPUT);
        assert_string_equal(failure.message, "element 17");
        vshi_job_end(job);
    }
}
