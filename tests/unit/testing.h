/* Every test includes this: the C library, the public headers, and checks of results and numbers. Tests list
 * themselves, and variables free their memory. A test is TEST(claim) { … }. main.c runs the tests of a
 * program; a main() of its own returns run_all_tests(). */
#ifndef TESTS_TESTING_H
#define TESTS_TESTING_H

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifdef __cplusplus
extern "C" {
#endif
#include <cmocka.h>

/* Runs what the program lists; main.c calls it. */
__attribute__((weak)) int run_listed_tests(void);
#ifdef __cplusplus
}
#endif

#include <vdbshade/vdbshade.h>

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

static inline int run_all_tests(CMFixtureFunction begin, CMFixtureFunction end) {
    return _cmocka_run_group_tests("tests", listed_tests, listed_count, begin, end);
}

static CMFixtureFunction listed_begin, listed_end;

/* Calls `begin` before the first test and `end` after the last one. */
#define FIXTURE(begin, end)                                                                                  \
    __attribute__((constructor)) static void list_fixture(void) {                                            \
        listed_begin = begin;                                                                                \
        listed_end = end;                                                                                    \
    }

int run_listed_tests(void) {
    return run_all_tests(listed_begin, listed_end);
}

/* --- checks */

/* Calls that assert_ok() and assert_fails() check fill this one. */
static __attribute__((unused)) vsh_error failure;

static inline void check_result(vsh_result result, vsh_result expected, const char *part, const char *file,
                                int line) {
    if (result != expected || (result != VSH_OK && strstr(failure.message, part) == NULL)) {
        print_error("%s '%s', expected %s '%s'\n", vsh_result_name(result), failure.message,
                    vsh_result_name(expected), part);
        _fail(file, line);
    }
}

static inline void check_near(double value, double expected, double tolerance, const char *file, int line) {
    if (!(fabs(value - expected) <= tolerance)) {
        print_error("%.9g is not within %g of %.9g\n", value, tolerance, expected);
        _fail(file, line);
    }
}

static inline void check_below(double value, double limit, int or_equal, const char *file, int line) {
    if (!(or_equal ? value <= limit : value < limit)) {
        print_error("%.9g, limit %.9g\n", value, limit);
        _fail(file, line);
    }
}

/* A message is of the call itself, never of one before. */
#define assert_ok(call) check_result((failure.message[0] = '\0', (call)), VSH_OK, "", __FILE__, __LINE__)

/* The call fails with this code, and its message has this part. */
#define assert_fails(call, code, part)                                                                       \
    check_result((failure.message[0] = '\0', (call)), code, part, __FILE__, __LINE__)

/* Fails with a formatted message unless the condition holds. */
#define assert_that(condition, ...)                                                                          \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            fail_msg(__VA_ARGS__);                                                                           \
        }                                                                                                    \
    } while (0)

#define assert_near(value, expected, tolerance) check_near(value, expected, tolerance, __FILE__, __LINE__)

#define assert_less(value, limit) check_below((double)(value), (double)(limit), 0, __FILE__, __LINE__)
#define assert_at_most(value, limit) check_below((double)(value), (double)(limit), 1, __FILE__, __LINE__)

static inline vsh_run run_on(int32_t threads) {
    vsh_run run = vsh_run_default();
    run.threads = threads;
    return run;
}

static inline vsh_run run_within(uint64_t memory_limit) {
    vsh_run run = vsh_run_default();
    run.memory_limit = memory_limit;
    return run;
}

static inline vsh_run run_watched(vsh_progress_fn *progress, void *user) {
    vsh_run run = vsh_run_default();
    run.progress = progress;
    run.user = user;
    return run;
}

/* --- memory */

/* These variables free what they hold where their block ends:
 *     OWNED(vsh_field) *field = field_of(…);    by vsh_field_free(field)
 *     FREED float *values = malloc(…);          by free(values)
 *     FREED_BY(free_baked) baked b = bake(…);   by free_baked(&b) */
#define FREED_BY(function) __attribute__((cleanup(function)))
#define FREED FREED_BY(free_memory)
#define OWNED(type) FREED_BY(type##_release) type

static inline void free_memory(void *pointer) {
    void *memory;
    memcpy(&memory, pointer, sizeof memory);
    free(memory);
}

/* Lets OWNED(type) call type_free(). */
#define OWNER(type)                                                                                          \
    static inline void type##_release(type **object) {                                                       \
        type##_free(*object);                                                                                \
    }

OWNER(vsh_assets)
OWNER(vsh_atlas)
OWNER(vsh_charts)
OWNER(vsh_comparison)
OWNER(vsh_field)
OWNER(vsh_flat_scene)
OWNER(vsh_grid)
OWNER(vsh_heights)
OWNER(vsh_model)
OWNER(vsh_occluders)
OWNER(vsh_outline)
OWNER(vsh_query)
OWNER(vsh_scene)
OWNER(vsh_solids)
OWNER(vsh_spheres)
OWNER(vsh_texels)
OWNER(vsh_tolerances)
OWNER(vsh_triangles)
OWNER(vsh_volume)
OWNER(vsh_voxels)

static inline void vsh_image_file_release(vsh_image_file **file) {
    vsh_image_free(*file);
}

/* --- meshes and grids */

static inline vsh_grid_options with_voxel(double size) {
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = size;
    return options;
}

/* A box as a mesh of 12 triangles, which face outwards. */
static inline vsh_mesh box_mesh(float corners[24], const double low[3], const double high[3]) {
    static const uint32_t sides[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    for (size_t i = 0; i < 24; ++i) {
        corners[i] = (float)((i / 3) >> (i % 3) & 1 ? high[i % 3] : low[i % 3]);
    }
    vsh_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.name = "box";
    mesh.positions = corners;
    mesh.indices = sides;
    mesh.vertex_count = 8;
    mesh.triangle_count = 12;
    return mesh;
}

#endif
