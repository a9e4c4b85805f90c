/* Every allocation of our C code fails in turn, alone or with all that follow it: each time the call says so,
 * leaks nothing, leaves outputs unchanged, and works when it is called again. */
#include "scenarios.h"

#include <inttypes.h>
#include <jansson.h>

enum { MOST = 20000, STEP = 5 };

static vsh_run one_thread(void) {
    return run_on(1); /* so that the n-th allocation is the same one each time */
}

static void check_failure(const scenario *s, uint64_t n, int all, vsh_result result, const vsh_error *error) {
    const size_t size = strlen(error->message);
    assert_that(result == VSH_ERROR_MEMORY && error->code == result && size != 0 &&
                    strchr(error->message, '\n') == NULL,
                "%s: allocation %" PRIu64 "%s: %s (%s) '%s'", s->name, n, all ? " and all others" : "",
                vsh_result_name(result), vsh_result_name(error->code), error->message);
}

/* Returns the number of allocations, to within `step`. */
static uint64_t fail_each(const scenario *s, int all, uint64_t step) {
    const vsh_run run = one_thread();
    for (uint64_t n = 1; n < MOST; n += step) {
        const uint64_t before = faults_live();
        vsh_error error = {-1, ""};
        uint64_t failed;
        faults_begin(n, all);
        const vsh_result result = s->run(&run, &error);
        faults_end(&failed);
        if (failed == 0) {
            assert_int_equal(result, VSH_OK);
            return n - 1;
        }
        check_failure(s, n, all, result, &error);
        assert_that(faults_live() == before,
                    "%s: allocation %" PRIu64 ": %" PRIu64 " blocks before, %" PRIu64 " after", s->name, n,
                    before, faults_live());
        assert_that(scenarios_untouched(), "%s: allocation %" PRIu64 ": files are not as they were", s->name,
                    n);
    }
    fail_msg("%s: more than %d allocations", s->name, MOST);
    return 0;
}

TEST(every_allocation_may_fail) {
    const vsh_run run = one_thread();
    for (size_t i = 0; i < scenario_count; ++i) {
        const scenario *s = &scenarios[i];
        vsh_error error = {0};
        for (int pass = 0; pass < 2; ++pass) { /* twice, because libraries set things up once */
            assert_that(s->run(&run, &error) == VSH_OK, "%s: %s", s->name, error.message);
        }
        scenarios_untouched(); /* restores the outputs that it has written */
        const uint64_t alone = fail_each(s, 0, 1);
        scenarios_untouched();
        const uint64_t all = fail_each(s, 1, STEP);
        scenarios_untouched();
        assert_true(all >= alone && all < alone + STEP);
        assert_true(alone > 0);
        assert_that(s->run(&run, &error) == VSH_OK, "%s afterwards: %s", s->name, error.message);
        scenarios_untouched();
    }
}

int main(void) {
    json_set_alloc_funcs(malloc, free); /* wrapped as in our objects */
    return run_all_tests(scenarios_begin, scenarios_end);
}
