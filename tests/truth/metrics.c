#include "metrics.h"

#include <math.h>
#include <stdlib.h>

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Nearest rank: the smallest error that a share of all errors does not pass. */
static double percentile(const double *sorted, size_t count, double share) {
    const size_t rank = (size_t)ceil(share * (double)count);
    return sorted[rank > 0 ? rank - 1 : 0];
}

truth_metrics truth_compare(size_t count, const float *values, const float *truth, const float *mask) {
    truth_metrics metrics = {0};
    double *errors = malloc((count > 0 ? count : 1) * sizeof *errors);
    if (errors == NULL) {
        return metrics;
    }
    double squares = 0.0, penumbra_squares = 0.0, sum = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (mask != NULL && !(mask[i] > 0.0F)) {
            continue;
        }
        const double difference = (double)values[i] - (double)truth[i];
        const double error = isfinite(difference) ? fabs(difference) : INFINITY;
        if (metrics.count == 0 || error > metrics.max) {
            metrics.max = error;
            metrics.worst = i;
        }
        errors[metrics.count++] = error;
        squares += error * error;
        sum += isfinite(difference) ? difference : INFINITY;
        if (truth[i] >= 0.02F && truth[i] <= 0.98F) {
            metrics.penumbra++;
            penumbra_squares += error * error;
        }
    }
    if (metrics.count > 0) {
        qsort(errors, metrics.count, sizeof *errors, compare);
        metrics.rmse = sqrt(squares / (double)metrics.count);
        metrics.bias = sum / (double)metrics.count;
        metrics.p95 = percentile(errors, metrics.count, 0.95);
        metrics.p99 = percentile(errors, metrics.count, 0.99);
        if (metrics.penumbra > 0) {
            metrics.penumbra_rmse = sqrt(penumbra_squares / (double)metrics.penumbra);
        }
    }
    free(errors);
    return metrics;
}
