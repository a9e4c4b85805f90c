#include "bench.h"

#include <stdlib.h>
#include <time.h>
#include <unistd.h>

double bench_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

double bench_wall(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int32_t bench_cores(void) {
    const long cores = sysconf(_SC_NPROCESSORS_ONLN);
    return cores > 1 ? (int32_t)cores : 1;
}

void *bench_take(size_t bytes) {
    void *memory = malloc(bytes > 0 ? bytes : 1);
    if (memory == NULL) {
        fputs("bench: the system refused memory\n", stderr);
        exit(4);
    }
    return memory;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double bench_median(double *seconds, size_t count) {
    qsort(seconds, count, sizeof *seconds, ascending);
    return seconds[count / 2];
}

void bench_check(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fprintf(stderr, "bench: %s: %s\n", vsh_result_name(result), error->message);
        exit(2);
    }
}

vsh_texels *bench_texels(const vsh_charts *charts) {
    vsh_texels *texels;
    vsh_error error;
    bench_check(vsh_texels_create(charts, NULL, &texels, &error), &error);
    return texels;
}
