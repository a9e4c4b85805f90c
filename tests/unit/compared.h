/* Pictures of known content, compared, for the tests of the measures. */
#ifndef TESTS_COMPARED_H
#define TESTS_COMPARED_H

#include "testing.h"

#define PI 3.14159265358979323846

/* A plane of two or three dimensions. */
typedef struct plane {
    int32_t size[3];
    size_t count;
    float *values;
} plane;

static inline void free_plane(plane *p) {
    free(p->values);
}

/* Value at a place, texels; `user` is the test's own. */
typedef double plane_fn(const void *user, double x, double y, double z);

static inline plane make_plane(int32_t width, int32_t height, int32_t depth, plane_fn *fn, const void *user) {
    plane p = {{width, height, depth}, (size_t)width * (size_t)height * (size_t)depth, NULL};
    p.values = malloc(p.count * sizeof *p.values);
    assert_non_null(p.values);
    for (size_t i = 0; i < p.count; ++i) {
        const size_t x = i % (size_t)width, y = i / (size_t)width % (size_t)height;
        p.values[i] = (float)fn(user, (double)x, (double)y, (double)(i / (size_t)width / (size_t)height));
    }
    return p;
}

static inline double flat(const void *user, double x, double y, double z) {
    return *(const double *)user;
}

static inline vsh_compared pair_of(const plane *golden, const plane *values, const uint8_t *mask) {
    assert_memory_equal(golden->size, values->size, sizeof golden->size);
    vsh_compared c = {{0}, golden->values, values->values, mask};
    memcpy(c.size, golden->size, sizeof c.size);
    return c;
}

/* Also checks that the number of threads changes no bit. */
static inline vsh_measures measure(const plane *golden, const plane *values, const uint8_t *mask) {
    const vsh_compared c = pair_of(golden, values, mask);
    const vsh_run one = run_on(1), four = run_on(4);
    vsh_measures m = {0}, other = {0};
    assert_ok(vsh_compare(&c, NULL, &one, &m, &failure));
    assert_ok(vsh_compare(&c, NULL, &four, &other, &failure));
    assert_memory_equal(&m, &other, sizeof m);
    return m;
}

/* Compares two pictures that one function draws from `golden` and `values`. */
static inline vsh_measures measure_as(int32_t width, int32_t height, int32_t depth, plane_fn *fn,
                                      const void *golden, const void *values) {
    FREED_BY(free_plane)
    plane a = make_plane(width, height, depth, fn, golden), b = make_plane(width, height, depth, fn, values);
    const vsh_measures m = measure(&a, &b, NULL);
    return m;
}

/* -1 … 1, the same for the same counter. */
static inline double noise(uint32_t counter) {
    uint32_t x = counter * 2654435761u + 1u;
    x ^= x >> 15;
    x *= 2246822519u;
    x ^= x >> 13;
    return (double)x / 2147483647.5 - 1.0;
}

#endif
