/* Every test includes this: the C library, the public headers, and checks of results and numbers. Tests list
 * themselves, and variables free their memory. A test is TEST(claim) { … }. main.c runs the tests of a
 * program; a main() of its own returns run_all_tests(). */
#pragma once

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

#include <vdbshade/vdbshade.h>

VSH_BEGIN_C
#include <cmocka.h>

/* Runs what the program lists; main.c calls it. */
__attribute__((weak)) int run_listed_tests(void);
VSH_END_C

#ifndef __cplusplus
#include "base/job.h"
#include "bindings/bindings.h"
#include "compare/compare.h"
#include "field/field.h"
#include "flat/flat.h"
#include "geometry/mesh.h"
#include "geometry/sdf.h"
#include "io/image/image.h"
#include "io/lit/work.h"
#include "io/model/model.h"
#include "levelset/access.h"
#include "lightmap/planes.h"
#include "lightmap/texels.h"
#include "scene/assets.h"
#include "scene/scene.h"
#include "shade/occluders.h"
#include "shade/shade.h"
#include "shapes/heights.h"
#include "shapes/outline.h"
#include "shapes/spheres.h"
#include "trace/trace.h"
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

/* Clears the message first, so that a report never shows an earlier call's message. */
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
 *     OWNED(vsh_field) *field = field_of(…);    by vshi_field_free(field)
 *     FREED float *values = malloc(…);          by free(values)
 *     FREED_BY(free_baked) baked b = bake(…);   by free_baked(&b) */
#define FREED_BY(function) __attribute__((cleanup(function), unused))
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
OWNER(vsh_flat_scene)
OWNER(vsh_grid)
OWNER(vsh_model)
OWNER(vsh_occluders)
OWNER(vsh_outline)
OWNER(vsh_query)
OWNER(vsh_scene)
OWNER(vsh_volume)
OWNER(vsh_voxels)

#ifndef __cplusplus
OWNER(vshi_heights)
OWNER(vshi_solids)
OWNER(vshi_spheres)
OWNER(vshi_tolerances)
OWNER(vshi_triangles)
static inline void vsh_field_release(vsh_field **field) {
    vshi_field_free(*field);
}
#endif
static inline void vsh_image_file_release(vsh_image_file **file) {
    vsh_image_free(*file);
}

/* --- vectors and arrays */

#define COUNT_OF(array) (sizeof(array) / sizeof((array)[0]))

static inline double dot3(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double length3(const double v[3]) {
    return sqrt(dot3(v, v));
}

/* to = from + t d */
static inline void go_along(const double from[3], double t, const double d[3], double to[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        to[axis] = from[axis] + t * d[axis];
    }
}

/* Returns the next of a sequence of numbers in [0, 1). */
static inline double next_random(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return (double)(*state >> 8) * 0x1p-24;
}

static inline void assert_all_equal(const float *values, size_t count, float expected) {
    for (size_t i = 0; i < count; ++i) {
        assert_that(values[i] == expected, "value %zu is %.9g, not %.9g", i, (double)values[i],
                    (double)expected);
    }
}

/* Two triangles over the corners 0 … 3 of a quad, and UVs that fill the square. */
static __attribute__((unused)) const uint32_t QUAD_INDICES[6] = {0, 1, 2, 0, 2, 3};
static __attribute__((unused)) const float QUAD_UVS[8] = {0, 0, 1, 0, 1, 1, 0, 1};

/* --- handles and their parts */

#ifndef __cplusplus
static inline vshi_occluder_parts parts_of(const vsh_occluders *occluders) {
    return (vshi_occluder_parts){.field = occluders->field,
                                 .triangles = occluders->triangles,
                                 .layers = occluders->layers,
                                 .layer_count = occluders->layer_count,
                                 .true_triangles = occluders->true_triangles,
                                 .true_solids = occluders->true_solids};
}
#endif

static inline vsh_atlas_info atlas_info(const vsh_atlas *atlas) {
    vsh_atlas_info info;
    vsh_atlas_get_info(atlas, &info);
    return info;
}

/* Stitches one lightmap. */
static inline vsh_result stitch_one(const vsh_charts *charts, const vsh_lightmap *lightmap, size_t lights,
                                    const vsh_stitch_options *options, const vsh_run *run,
                                    vsh_stitch_report *report, vsh_error *error) {
    const vsh_stitch_page page = {charts, lightmap};
    return vsh_lightmaps_stitch(&page, 1, lights, options, run, report, error);
}

/* --- meshes and grids */

static inline vsh_grid_options with_voxel(double size) {
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = size;
    return options;
}

static inline vsh_grid *grid_of_tree(const vsh_sdf_node *nodes, size_t count, vsh_grid_options options) {
    const vsh_sdf tree = {nodes, count};
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_sdf(&tree, &options, NULL, &grid, &failure));
    return grid;
}

/* `uvs` NULL: none. */
static inline vsh_mesh mesh_of_arrays(const char *name, const float *positions, const float *uvs,
                                      size_t vertices, const uint32_t *indices, size_t triangles) {
    vsh_mesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.name = name;
    mesh.positions = positions;
    mesh.uvs = uvs;
    mesh.indices = indices;
    mesh.vertex_count = vertices;
    mesh.triangle_count = triangles;
    return mesh;
}

static inline vsh_mesh quad_mesh(const char *name, const float positions[12], const float uvs[8]) {
    return mesh_of_arrays(name, positions, uvs, 4, QUAD_INDICES, 2);
}

/* A box as a mesh of 12 triangles, which face outwards. */
static inline vsh_mesh box_mesh(float corners[24], const double low[3], const double high[3]) {
    static const uint32_t sides[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    for (size_t i = 0; i < 24; ++i) {
        corners[i] = (float)((i / 3) >> (i % 3) & 1 ? high[i % 3] : low[i % 3]);
    }
    return mesh_of_arrays("box", corners, NULL, 8, sides, 12);
}
