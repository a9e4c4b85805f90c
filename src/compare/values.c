/* Differences value by value: RMSE, bias, maximum, 99th percentile, share past a threshold. */
#include "compare/pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BINS = 1 << 16 };

/* Differences are counted by the halves of their bits: a float that is not negative sorts like its bits. */
static uint32_t bits_of(double difference) {
    const float value = (float)fabs(difference);
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* The bin that holds element `rank` (from 0), which becomes its rank within the bin. */
static uint32_t find_bin(const uint64_t *bins, uint64_t *rank) {
    uint32_t bin = 0;
    while (bin + 1 < BINS && *rank >= bins[bin]) {
        *rank -= bins[bin++];
    }
    return bin;
}

static double difference_at(const vshi_pair *pair, size_t i) {
    return vshi_value_at(pair, VSHI_NEW, i) - vshi_value_at(pair, VSHI_GOLDEN, i);
}

/* Nearest rank, exactly: first the upper half of its bits, then the lower one. */
static double percentile(const vshi_pair *pair, uint64_t *bins, uint64_t rank) {
    const uint32_t high = find_bin(bins, &rank);
    memset(bins, 0, BINS * sizeof *bins);
    for (size_t i = 0; i < pair->count; ++i) {
        const uint32_t bits = pair->mask[i] ? bits_of(difference_at(pair, i)) : 0;
        bins[bits & 0xffff] += pair->mask[i] && bits >> 16 == high;
    }
    const uint32_t bits = high << 16 | find_bin(bins, &rank);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

bool vshi_measure_values(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                         vsh_measures *m) {
    (void)scratch;
    uint64_t *bins = calloc(BINS, sizeof *bins);
    if (bins == NULL) {
        return false;
    }
    double sum = 0.0, squares = 0.0, worst = -1.0;
    uint64_t past = 0;
    const double threshold = vshi_no_difference(options->threshold, options);
    for (size_t i = 0; i < pair->count; ++i) {
        if (!pair->mask[i]) {
            continue;
        }
        const double difference = difference_at(pair, i);
        sum += difference;
        squares += difference * difference;
        past += fabs(difference) > threshold;
        ++bins[bits_of(difference) >> 16];
        if (fabs(difference) > worst) {
            worst = fabs(difference);
            m->worst = i;
        }
    }
    const double count = (double)m->count;
    m->bias = sum / count;
    m->value[VSH_MEASURE_RMSE] = sqrt(squares / count);
    m->value[VSH_MEASURE_BIAS] = fabs(m->bias);
    m->value[VSH_MEASURE_MAX] = worst;
    m->value[VSH_MEASURE_SHARE] = (double)past / count;
    m->value[VSH_MEASURE_P99] = percentile(pair, bins, (uint64_t)ceil(0.99 * count) - 1);
    m->worst_value[0] = (double)pair->plane[VSHI_GOLDEN][m->worst];
    m->worst_value[1] = (double)pair->plane[VSHI_NEW][m->worst];
    free(bins);
    return true;
}
