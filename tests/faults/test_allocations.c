/* Every allocation of our C code fails in turn, alone or with all that follow it: each time the call says so,
 * leaks nothing, leaves outputs as they were, and works when it is asked again. */
#include "faults.h"
#include "scenarios.h"

#include <inttypes.h>
#include <jansson.h>
#include <unistd.h>

enum { MOST = 20000, STEP = 5 };

static vsh_run one_thread(void) {
    vsh_run run = vsh_run_default();
    run.threads = 1; /* so that the n-th allocation is the same one each time */
    return run;
}

static void check_failure(const scenario *s, uint64_t n, int all, vsh_result result, const vsh_error *error) {
    const size_t size = strlen(error->message);
    if (result != VSH_ERROR_MEMORY || error->code != result || size == 0 ||
        strchr(error->message, '\n') != NULL) {
        fail_msg("%s: allocation %" PRIu64 "%s: %s (%s) '%s'", s->name, n, all ? " and all others" : "",
                 vsh_result_name(result), vsh_result_name(error->code), error->message);
    }
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
        if (faults_live() != before) {
            fail_msg("%s: allocation %" PRIu64 ": %" PRIu64 " blocks before, %" PRIu64 " after", s->name, n,
                     before, faults_live());
        }
        if (!scenarios_untouched()) {
            fail_msg("%s: allocation %" PRIu64 ": files are not as they were", s->name, n);
        }
    }
    fail_msg("%s: more than %d allocations", s->name, MOST);
    return 0;
}

static void every_allocation_may_fail(void **state) {
    const vsh_run run = one_thread();
    uint64_t sum = 0;
    for (size_t i = 0; i < scenario_count; ++i) {
        const scenario *s = &scenarios[i];
        vsh_error error = {0};
        for (int pass = 0; pass < 2; ++pass) { /* what libraries set up once */
            if (s->run(&run, &error) != VSH_OK) {
                fail_msg("%s: %s", s->name, error.message);
            }
        }
        scenarios_untouched(); /* no: it has written */
        const uint64_t alone = fail_each(s, 0, 1);
        scenarios_untouched();
        const uint64_t all = fail_each(s, 1, STEP);
        scenarios_untouched();
        print_message("%-24s %6" PRIu64 " allocations\n", s->name, alone);
        assert_true(all >= alone && all < alone + STEP);
        assert_true(alone > 0);
        sum += alone;
        if (s->run(&run, &error) != VSH_OK) {
            fail_msg("%s afterwards: %s", s->name, error.message);
        }
        scenarios_untouched();
    }
    print_message("%" PRIu64 " allocations in all\n", sum);
}

int main(void) {
    json_set_alloc_funcs(malloc, free); /* wrapped as in our objects */
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, scenarios_begin, scenarios_end);
}
