/* Helpers of the benchmarks in this folder. */
#pragma once

#include <stdio.h>
#include <stdlib.h>
#include <vdbshade/vdbshade.h>

/* Allocates memory, or ends the program. */
static inline void *bench_take(size_t bytes) {
    void *memory = malloc(bytes > 0 ? bytes : 1);
    if (memory == NULL) {
        fputs("bench: the system refused memory\n", stderr);
        exit(4);
    }
    return memory;
}

/* Ends the program with the error if a call failed. */
static inline void bench_check(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fprintf(stderr, "bench: %s: %s\n", vsh_result_name(result), error->message);
        exit(2);
    }
}
