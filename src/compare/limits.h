/* The table of measures. */
#ifndef VSHI_LIMITS_H
#define VSHI_LIMITS_H

#include <vdbshade/compare.h>

#include <stdbool.h>

typedef struct vshi_limit {
    const char *name;
    int32_t at_least; /* 1: the limit is the least that will do */
    double value;     /* what holds without another */
} vshi_limit;

extern const vshi_limit vshi_limits[VSH_MEASURE_COUNT];

#endif
