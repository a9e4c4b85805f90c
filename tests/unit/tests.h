/* Tests that list themselves: TEST(claim) { … }, and a main() that returns run_all_tests(). */
#ifndef TESTS_TESTS_H
#define TESTS_TESTS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#include <cmocka.h>
#ifdef __cplusplus
}
#endif

enum { MOST_TESTS = 64 };

static struct CMUnitTest listed_tests[MOST_TESTS];
static int listed_lines[MOST_TESTS];
static size_t listed_count;

/* Keeps tests in the order of their lines: that of constructors is not specified. */
static inline void list_test(const char *claim, CMUnitTestFunction test, int line) {
    size_t i = listed_count++;
    for (; i > 0 && listed_lines[i - 1] > line; --i) {
        listed_tests[i] = listed_tests[i - 1];
        listed_lines[i] = listed_lines[i - 1];
    }
    listed_tests[i].name = claim;
    listed_tests[i].test_func = test;
    listed_lines[i] = line;
}

#define TEST(claim)                                                                                          \
    static void claim(void **state);                                                                         \
    __attribute__((constructor)) static void list_##claim(void) {                                            \
        list_test(#claim, claim, __LINE__);                                                                  \
    }                                                                                                        \
    static void claim(void **state)

static inline int run_all_tests(CMFixtureFunction set_up, CMFixtureFunction tear_down) {
    return _cmocka_run_group_tests("tests", listed_tests, listed_count, set_up, tear_down);
}

#endif
