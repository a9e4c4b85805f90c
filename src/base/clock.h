/* Seconds on a clock that only goes forward. */
#pragma once

#include <time.h>

static inline double vshi_seconds(void) {
    struct timespec now = {0, 0};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
