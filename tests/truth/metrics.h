/* Differences of values from the truth. RMSE alone hides lost penumbrae, so there are other measures. */
#pragma once

#include <stddef.h>

typedef struct truth_metrics {
    size_t count;         /* compared */
    size_t penumbra;      /* compared values with a truth of 0.02 … 0.98 */
    double rmse;          /* over all; INFINITY, like the others, if a value is not finite */
    double penumbra_rmse; /* over the penumbra; 0 where there is none */
    double bias;          /* mean of value - truth */
    double p95;           /* of |value - truth|, nearest rank */
    double p99;
    double max;
    size_t worst; /* index of the largest error */
} truth_metrics;

/* Compares values with mask > 0 (NULL: all values). All members are 0 if nothing is compared or memory is
 * short. */
truth_metrics truth_compare(size_t count, const float *values, const float *truth, const float *mask);
