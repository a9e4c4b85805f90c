/* How long the rest of a command takes, by what its stages were expected to take and did. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

/* The command line's sources are no library. */
#include "cli/estimate.c"

#include <math.h>
#include <stdlib.h>

typedef struct expectation {
    const char *name;
    int kind;
    double seconds;
} expectation;

typedef struct report {
    const char *name;
    double fraction, at;
} report;

typedef struct trace {
    const char *name;
    const expectation *expected;
    size_t expected_count;
    const report *reports;
    size_t count;
    double total;
} trace;

#define TRACE(name, total)                                                                                   \
    {                                                                                                        \
#name, name##_expected, sizeof name##_expected / sizeof *name##_expected, name##_reports,            \
            sizeof name##_reports / sizeof *name##_reports, total                                            \
    }

#include "traces.inc"

static cli_estimate e;

static void expect(const char *name, double seconds) {
    cli_estimate_expect(&e, name, CLI_ESTIMATE_SHADE, seconds);
}

static bool near(double a, double b) {
    return fabs(a - b) <= 1e-9;
}

static void what_is_as_expected_is_foretold(void **state) {
    (void)state;
    cli_estimate_begin(&e, 10.0);
    expect("field", 3.0);
    expect("shadow.sun", 2.0);
    expect("ao", 5.0);
    assert_true(near(cli_estimate_left(&e, 10.0), 10.0));
    for (double t = 0.0; t <= 10.0; t += 0.125) {
        const char *stage = t < 3.0 ? "field" : t < 5.0 ? "shadow.sun" : "ao";
        const double fraction = t < 3.0 ? t / 3.0 : t < 5.0 ? (t - 3.0) / 2.0 : (t - 5.0) / 5.0;
        cli_estimate_report(&e, stage, fraction, 10.0 + t);
        assert_true(near(cli_estimate_left(&e, 10.0 + t), 10.0 - t));
        assert_true(near(cli_estimate_share(&e, 10.0 + t), t / 10.0));
    }
}

static void the_long_stage_behind_the_short_one_counts(void **state) {
    (void)state;
    cli_estimate_begin(&e, 0.0);
    expect("shadow.sun", 2.0);
    expect("ao", 300.0);
    cli_estimate_report(&e, "shadow.sun", 0.0, 0.0);
    cli_estimate_report(&e, "shadow.sun", 0.5, 1.0);
    const double left = cli_estimate_left(&e, 1.0);
    assert_true(left > 250.0 && left < 350.0);
}

static void a_slow_machine_is_noticed_by_its_first_stages(void **state) {
    (void)state;
    cli_estimate_begin(&e, 0.0);
    expect("texels", 1.0);
    expect("shadow.sun", 2.0);
    expect("ao", 5.0);
    cli_estimate_report(&e, "texels", 0.0, 0.0);
    cli_estimate_report(&e, "shadow.sun", 0.0, 4.0); /* took four times as long */
    const double left = cli_estimate_left(&e, 4.0);
    assert_true(left > 21.0 && left < 28.1);
}

static void stages_that_are_left_out_or_come_unasked_are_no_harm(void **state) {
    (void)state;
    cli_estimate_begin(&e, 0.0);
    assert_true(cli_estimate_left(&e, 1.0) < 0.0); /* nobody knows */
    expect("a", 5.0);
    expect("b", 5.0);
    cli_estimate_report(&e, "unheard of", 0.5, 0.0);
    assert_true(near(cli_estimate_left(&e, 0.0), 10.0));
    cli_estimate_report(&e, "b", 0.0, 1.0);
    assert_true(near(cli_estimate_left(&e, 1.0), 5.0));
    cli_estimate_report(&e, "b", 1.0, 6.0);
    assert_true(near(cli_estimate_left(&e, 6.0), 0.0));
    for (int i = 0; i < 2 * CLI_ESTIMATE_STAGES; ++i) {
        expect("more", 1.0);
    }
    assert_int_equal(e.count, CLI_ESTIMATE_STAGES);
}

static void rounds_of_one_stage_are_told_apart(void **state) {
    (void)state;
    cli_estimate_begin(&e, 0.0);
    for (int i = 0; i < 3; ++i) {
        expect("validate", 1.0);
        expect("ao", 3.0);
    }
    for (int i = 0; i < 3; ++i) {
        cli_estimate_report(&e, "validate", 0.0, 4.0 * i);
        assert_true(near(cli_estimate_left(&e, 4.0 * i), 12.0 - 4.0 * i));
        cli_estimate_report(&e, "validate", 1.0, 4.0 * i + 1.0);
        cli_estimate_report(&e, "ao", 0.0, 4.0 * i + 1.0);
        cli_estimate_report(&e, "ao", 1.0, 4.0 * i + 4.0);
    }
    assert_true(near(cli_estimate_left(&e, 12.0), 0.0));
}

static void a_stage_that_was_over_before_it_was_expected_tells_the_pace(void **state) {
    (void)state;
    cli_estimate_begin(&e, 0.0);
    cli_estimate_report(&e, "texels", 0.0, 0.0);
    cli_estimate_report(&e, "charts", 0.0, 5.0);
    expect("texels", 1.0);
    expect("charts", 1.0);
    expect("ao", 10.0);
    cli_estimate_report(&e, "ao", 0.0, 10.0);
    const double left = cli_estimate_left(&e, 10.0);
    assert_true(left > 45.0 && left < 50.1);
}

static void the_share_never_falls(void **state) {
    (void)state;
    cli_estimate_begin(&e, 0.0);
    expect("a", 1.0);
    expect("b", 1.0);
    cli_estimate_report(&e, "a", 0.0, 0.0);
    cli_estimate_report(&e, "a", 0.9, 0.9);
    const double before = cli_estimate_share(&e, 0.9);
    cli_estimate_report(&e, "a", 0.91, 20.0);
    assert_true(cli_estimate_share(&e, 20.0) >= before && cli_estimate_share(&e, 20.0) <= 1.0);
}

/* Of the whole time, which elapsed seconds and those that are left make up. */
static void recorded_bakes_are_foretold_to_a_third_from_the_second_second_on(void **state) {
    (void)state;
    int failures = 0;
    for (size_t k = 0; k < sizeof traces / sizeof *traces; ++k) {
        const trace *t = &traces[k];
        bool expected = false;
        double worst = 0.0, when = 0.0;
        cli_estimate_begin(&e, 0.0);
        for (size_t i = 0; i < t->count; ++i) {
            const report *r = &t->reports[i];
            if (!expected && strcmp(r->name, "load") != 0 && strcmp(r->name, "charts") != 0 &&
                strcmp(r->name, "texels") != 0) {
                expected = true; /* when the receivers are counted */
                for (size_t s = 0; s < t->expected_count; ++s) {
                    cli_estimate_expect(&e, t->expected[s].name, t->expected[s].kind, t->expected[s].seconds);
                }
            }
            cli_estimate_report(&e, r->name, r->fraction, r->at);
            const double off = (r->at + cli_estimate_left(&e, r->at)) / t->total - 1.0;
            if (r->at >= 2.0 && fabs(off) > fabs(worst)) {
                worst = off;
                when = r->at;
            }
        }
        if (getenv("VSH_SHOW") != NULL) {
            print_message("%s: %.1f s, at worst %+.0f %% off, at %.1f s\n", t->name, t->total, 100.0 * worst,
                          when);
        }
        failures += !(fabs(worst) <= 1.0 / 3.0);
    }
    assert_int_equal(failures, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_as_expected_is_foretold),
        cmocka_unit_test(the_long_stage_behind_the_short_one_counts),
        cmocka_unit_test(a_slow_machine_is_noticed_by_its_first_stages),
        cmocka_unit_test(stages_that_are_left_out_or_come_unasked_are_no_harm),
        cmocka_unit_test(rounds_of_one_stage_are_told_apart),
        cmocka_unit_test(a_stage_that_was_over_before_it_was_expected_tells_the_pace),
        cmocka_unit_test(the_share_never_falls),
        cmocka_unit_test(recorded_bakes_are_foretold_to_a_third_from_the_second_second_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
