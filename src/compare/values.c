/* Differences value by value: RMSE, bias, maximum, percentiles, share past a threshold. */
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
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

/* What differences of one or several pairs add up to. */
typedef struct tally {
    uint64_t count;
    double sum, squares, worst; /* worst: -1 where there is none */
    size_t worst_at;            /* of the last pair that was added and has it */
    double threshold;
    uint64_t past;  /* differences of more than the threshold */
    uint64_t *bins; /* [BINS], and BINS for percentile() to work in */
} tally;

static void add(const vshi_pair *pair, tally *t) {
    for (size_t i = 0; i < pair->count; ++i) {
        if (!pair->mask[i]) {
            continue;
        }
        const double difference = difference_at(pair, i);
        ++t->count;
        t->sum += difference;
        t->squares += difference * difference;
        t->past += fabs(difference) > t->threshold;
        ++t->bins[bits_of(difference) >> 16];
        if (fabs(difference) > t->worst) {
            t->worst = fabs(difference);
            t->worst_at = i;
        }
    }
}

/* Nearest rank, exactly: the smallest difference that a share of all does not pass. First the upper half of
 * its bits, then the lower one. */
static double percentile(const vshi_pair *pairs, size_t pair_count, const tally *t, double share) {
    uint64_t rank = (uint64_t)ceil(share * (double)t->count) - 1;
    const uint32_t high = find_bin(t->bins, &rank);
    uint64_t *bins = t->bins + BINS;
    memset(bins, 0, BINS * sizeof *bins);
    for (size_t k = 0; k < pair_count; ++k) {
        for (size_t i = 0; i < pairs[k].count; ++i) {
            const uint32_t bits = pairs[k].mask[i] ? bits_of(difference_at(&pairs[k], i)) : 0;
            bins[bits & 0xffff] += pairs[k].mask[i] && bits >> 16 == high;
        }
    }
    const uint32_t bits = high << 16 | find_bin(bins, &rank);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

bool vshi_measure_values(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                         vsh_measures *m) {
    (void)scratch;
    tally t = {.worst = -1.0, .threshold = vshi_no_difference(options->threshold, options->noise)};
    t.bins = calloc((size_t)2 * BINS, sizeof *t.bins);
    if (t.bins == NULL) {
        return false;
    }
    add(pair, &t);
    const double count = (double)t.count;
    m->bias = t.sum / count;
    m->value[VSH_MEASURE_RMSE] = sqrt(t.squares / count);
    m->value[VSH_MEASURE_BIAS] = fabs(m->bias);
    m->value[VSH_MEASURE_MAX] = t.worst;
    m->value[VSH_MEASURE_SHARE] = (double)t.past / count;
    m->value[VSH_MEASURE_P99] = percentile(pair, 1, &t, 0.99);
    m->worst = t.worst_at;
    m->worst_value[0] = (double)pair->plane[VSHI_GOLDEN][m->worst];
    m->worst_value[1] = (double)pair->plane[VSHI_NEW][m->worst];
    free(t.bins);
    return true;
}

/* --- against a truth */

static const double DARK = 0.02, LIGHT = 0.98; /* what lies between is a penumbra */

static void add_penumbra(const vshi_pair *pair, double *squares, uint64_t *count) {
    for (size_t i = 0; i < pair->count; ++i) {
        const double truth = vshi_value_at(pair, VSHI_GOLDEN, i);
        if (pair->mask[i] && truth >= DARK && truth <= LIGHT) {
            const double difference = difference_at(pair, i);
            *squares += difference * difference;
            ++*count;
        }
    }
}

static void measure_accuracy(const vshi_pair *pairs, size_t pair_count, tally *t, vsh_accuracy *a) {
    double squares = 0.0, width = 0.0, off = 0.0;
    for (size_t k = 0; k < pair_count; ++k) {
        add(&pairs[k], t);
        add_penumbra(&pairs[k], &squares, &a->penumbra);
        vshi_add_widths(&pairs[k], &width, &off);
    }
    a->count = t->count;
    a->width_error = width > 0.0 ? off / width : NAN;
    if (t->count > 0) {
        a->rmse = sqrt(t->squares / (double)t->count);
        a->bias = t->sum / (double)t->count;
        a->p95 = percentile(pairs, pair_count, t, 0.95);
        a->p99 = percentile(pairs, pair_count, t, 0.99);
        a->max = t->worst;
        a->penumbra_rmse = a->penumbra > 0 ? sqrt(squares / (double)a->penumbra) : 0.0;
    }
}

vsh_result vsh_compare_accuracy(const vsh_compared *planes, size_t plane_count, const vsh_run *run,
                                vsh_accuracy *accuracy, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(planes);
    VSHI_NEEDS(accuracy);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    double values = 0.0;
    for (size_t i = 0; i < plane_count; ++i) {
        double count;
        VSHI_TRY(vshi_pair_check(&planes[i], &count, error));
        values += count;
    }
    /* the caller's values and masks, then ours */
    VSHI_TRY(vshi_check_limit(&full, values * (9.0 + 1.0), "comparison", error));
    void *pair_memory = NULL, *mask_memory = NULL, *bins = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate(&pair_memory, plane_count, sizeof(vshi_pair), "comparison", error));
    VSHI_TRY_DONE(vshi_allocate(&mask_memory, (size_t)values, 1, "comparison", error));
    VSHI_TRY_DONE(vshi_allocate(&bins, (size_t)2 * BINS, sizeof(uint64_t), "comparison", error));
    vshi_pair *pairs = pair_memory;
    uint8_t *mask = mask_memory;
    for (size_t i = 0; i < plane_count; ++i) {
        vsh_measures unused;
        vshi_pair_make(&planes[i], mask, &pairs[i], &unused);
        pairs[i].scale = 1.0;
        mask += pairs[i].count;
    }
    tally t = {.worst = -1.0, .threshold = INFINITY, .bins = bins};
    vsh_accuracy made = {.count = 0};
    measure_accuracy(pairs, plane_count, &t, &made);
    *accuracy = made;
done:
    free(bins);
    free(mask_memory);
    free(pair_memory);
    return result;
}
