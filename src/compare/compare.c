/* Compares two planes: coverage, values, and regions that lost or gained a shadow.
 *
 * Regions: a texel is off by how far its new value lies outside the range of nearby golden values, or its
 * golden value outside that of nearby new ones (flat dilation and erosion: Serra, "Image Analysis and
 * Mathematical Morphology", 1982). The first finds new shadows, the second lost ones, even one texel wide.
 * Shadows that moved within the reach, or got a little softer, have like values nearby. Touching texels
 * (corners count) that are off by a step or more to one side are a region. Limits: fainter shadows are not
 * seen, and penumbrae that change by many texels are off, too. */
#include "compare/compare.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_VALUES = INT32_MAX, REGIONS_SCRATCH = 8 /* bytes a value */ };

void vshi_compare_coverage(uint64_t count, const float *golden, const float *values, uint8_t *mask,
                           vsh_coverage *coverage) {
    vsh_coverage c = {0, 0, 0, 0, count, 0.0};
    for (uint64_t i = 0; i < count; ++i) {
        const int a = golden == NULL || golden[i] > 0.5f, b = values == NULL || values[i] > 0.5f;
        c.golden += (uint64_t)a;
        c.values += (uint64_t)b;
        c.both += (uint64_t)(a && b);
        c.differs += (uint64_t)(a != b);
        c.first = a != b && c.first == count ? i : c.first;
        if (mask != NULL) {
            mask[i] = a && b;
        }
    }
    const uint64_t either = c.golden + c.values - c.both;
    c.share = either > 0 ? (double)c.differs / (double)either : 0.0;
    *coverage = c;
}

/* --- pairs */

static vsh_result check_pair(const vsh_compared *compared, double *values, vsh_error *error) {
    if (compared->golden == NULL || compared->values == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "comparison: the %s values are NULL",
                         compared->golden == NULL ? "golden" : "new");
    }
    double count = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        count *= compared->size[axis] > 0 ? (double)compared->size[axis] : 0.0;
    }
    if (!(count >= 1.0 && count <= (double)MOST_VALUES)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "comparison of %d × %d × %d values: expected 1 … 2^31 - 1", compared->size[0],
                         compared->size[1], compared->size[2]);
    }
    *values = count;
    return VSH_OK;
}

/* Makes a pair with `mask` [count] as its mask, and fills the measures' count, range and nonfinite values.
 * The other measures become NaN or 0. */
static void make_pair(const vsh_compared *compared, uint8_t *mask, vshi_pair *pair, vsh_measures *m) {
    *m = (vsh_measures){.width = {NAN, NAN}};
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        m->value[i] = NAN;
    }
    *pair = (vshi_pair){.count = 1, .plane = {compared->golden, compared->values}, .mask = mask};
    for (int axis = 0; axis < 3; ++axis) {
        pair->size[axis] = (size_t)compared->size[axis];
        pair->stride[axis] = pair->count;
        pair->count *= pair->size[axis];
    }
    double range = 1.0;
    for (size_t i = 0; i < pair->count; ++i) {
        bool finite = true;
        for (int which = 0; which < 2; ++which) {
            if (!isfinite(pair->plane[which][i])) {
                finite = false;
                m->nonfinite_first[which] = m->nonfinite[which] == 0 ? i : m->nonfinite_first[which];
                ++m->nonfinite[which];
            }
        }
        mask[i] = finite && (compared->mask == NULL || compared->mask[i] != 0);
        if (mask[i]) {
            ++m->count;
            range = fmax(range, fabs((double)pair->plane[VSHI_GOLDEN][i]));
        }
    }
    pair->scale = 1.0 / range;
    m->range = range;
    m->value[VSH_MEASURE_NONFINITE] = (double)(m->nonfinite[0] + m->nonfinite[1]);
}

/* --- differences */

enum { BINS = 1 << 16 };

/* Histograms use 16 bits at a time: floats that are not negative sort like their bits. */
static uint32_t bits_of(double difference) {
    const float value = (float)fabs(difference);
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* Finds the bin of element `rank` (from 0), and turns `rank` into the rank within that bin. */
static uint32_t find_bin(const uint64_t *bins, uint64_t *rank) {
    uint32_t bin = 0;
    while (bin + 1 < BINS && *rank >= bins[bin]) {
        *rank -= bins[bin++];
    }
    return bin;
}

/* Sums over the differences of one or several pairs. */
typedef struct tally {
    uint64_t count;
    double squares, worst;
    size_t worst_at; /* index within its pair */
    uint64_t *bins;  /* [BINS] by upper halves, then [BINS] of scratch for find_percentile() */
} tally;

static void add_differences(const vshi_pair *pair, tally *t) {
    for (size_t i = 0; i < pair->count; ++i) {
        if (!pair->mask[i]) {
            continue;
        }
        const double difference = vshi_difference_at(pair, i);
        ++t->count;
        t->squares += difference * difference;
        ++t->bins[bits_of(difference) >> 16];
        if (fabs(difference) > t->worst) {
            t->worst = fabs(difference);
            t->worst_at = i;
        }
    }
}

/* Finds the exact percentile by nearest rank: first the upper half of its bits, then the lower one. */
static double find_percentile(const vshi_pair *pairs, size_t pair_count, const tally *t, double share) {
    uint64_t rank = (uint64_t)ceil(share * (double)t->count) - 1;
    const uint32_t high = find_bin(t->bins, &rank);
    uint64_t *bins = t->bins + BINS;
    memset(bins, 0, BINS * sizeof *bins);
    for (size_t k = 0; k < pair_count; ++k) {
        for (size_t i = 0; i < pairs[k].count; ++i) {
            const uint32_t bits = pairs[k].mask[i] ? bits_of(vshi_difference_at(&pairs[k], i)) : 0;
            bins[bits & 0xffff] += pairs[k].mask[i] && bits >> 16 == high;
        }
    }
    const uint32_t bits = high << 16 | find_bin(bins, &rank);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

static vsh_result measure_values(const vshi_pair *pair, vsh_measures *m, vsh_error *error) {
    tally t = {.worst = -1.0};
    VSHI_TRY(vshi_allocate((void **)&t.bins, (size_t)2 * BINS, sizeof *t.bins, "comparison", error));
    add_differences(pair, &t);
    m->value[VSH_MEASURE_RMSE] = sqrt(t.squares / (double)t.count);
    m->value[VSH_MEASURE_MAX] = t.worst;
    m->value[VSH_MEASURE_P99] = find_percentile(pair, 1, &t, 0.99);
    m->worst = t.worst_at;
    m->worst_value[VSHI_GOLDEN] = (double)pair->plane[VSHI_GOLDEN][m->worst];
    m->worst_value[VSHI_NEW] = (double)pair->plane[VSHI_NEW][m->worst];
    free(t.bins);
    return VSH_OK;
}

/* --- against a truth */

static void measure_accuracy(const vshi_pair *pairs, size_t pair_count, tally *t, vsh_accuracy *a) {
    for (size_t k = 0; k < pair_count; ++k) {
        add_differences(&pairs[k], t);
    }
    a->count = t->count;
    if (t->count > 0) {
        a->rmse = sqrt(t->squares / (double)t->count);
        a->p99 = find_percentile(pairs, pair_count, t, 0.99);
        a->max = t->worst;
    }
}

vsh_result vsh_compare_accuracy(const vsh_compared *planes, size_t plane_count, const vsh_run *run,
                                vsh_accuracy *accuracy, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(planes, accuracy);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    double values = 0.0;
    for (size_t i = 0; i < plane_count; ++i) {
        double count = 0.0;
        VSHI_TRY(check_pair(&planes[i], &count, error));
        values += count;
    }
    /* the caller's values and masks, then our masks */
    VSHI_TRY(vshi_check_limit(&full, values * (9.0 + 1.0), "comparison", error));
    vshi_pair *pairs;
    uint8_t *mask;
    tally t = {.worst = -1.0};
    const vshi_array arrays[] = {VSHI_ARRAY(pairs, plane_count), VSHI_ARRAY(mask, (size_t)values),
                                 VSHI_ARRAY(t.bins, (size_t)2 * BINS)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "comparison", error));
    for (size_t i = 0; i < plane_count; ++i) {
        vsh_measures unused;
        make_pair(&planes[i], mask, &pairs[i], &unused);
        pairs[i].scale = 1.0;
        mask += pairs[i].count;
    }
    *accuracy = (vsh_accuracy){.count = 0};
    measure_accuracy(pairs, plane_count, &t, accuracy);
    free(pairs);
    return VSH_OK;
}

/* --- regions */

/* Finds how far a value of plane `one` lies outside the range of the other plane within `reach`. */
static double find_excess(const vshi_pair *pair, int one, size_t i, size_t reach) {
    const double value = vshi_value_at(pair, one, i);
    double low = vshi_value_at(pair, 1 - one, i), high = low;
    size_t place[3], first[3], last[3];
    vshi_find_place(pair, i, place);
    for (int axis = 0; axis < 3; ++axis) {
        first[axis] = place[axis] > reach ? place[axis] - reach : 0;
        last[axis] = place[axis] + reach < pair->size[axis] ? place[axis] + reach : pair->size[axis] - 1;
    }
    for (size_t z = first[2]; z <= last[2]; ++z) {
        for (size_t y = first[1]; y <= last[1]; ++y) {
            for (size_t x = first[0]; x <= last[0] && (value < low || value > high); ++x) {
                const size_t at = x + y * pair->stride[1] + z * pair->stride[2];
                if (pair->mask[at]) {
                    low = fmin(low, vshi_value_at(pair, 1 - one, at));
                    high = fmax(high, vshi_value_at(pair, 1 - one, at));
                }
            }
        }
    }
    return fmax(0.0, value - high) + fmin(0.0, value - low);
}

/* Measures the region of texel `start`, and clears it in `off`. */
static vsh_region extract_region(const vshi_pair *pair, float *off, uint32_t *stack, size_t start,
                                 double step) {
    const double sign = off[start] > 0.0f ? 1.0 : -1.0;
    vsh_region region = {.worst = start, .by = (double)off[start]};
    size_t height = 0;
    stack[height++] = (uint32_t)start;
    off[start] = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        region.min[axis] = INT32_MAX;
        region.max[axis] = INT32_MIN;
    }
    while (height > 0) {
        const size_t at = stack[--height];
        size_t place[3];
        vshi_find_place(pair, at, place);
        ++region.count;
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t p = (int32_t)place[axis];
            region.min[axis] = p < region.min[axis] ? p : region.min[axis];
            region.max[axis] = p > region.max[axis] ? p : region.max[axis];
        }
        for (int k = 0; k < 27; ++k) {
            const int offset[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
            size_t to;
            if (vshi_find_offset(pair, place, offset, &to) && sign * (double)off[to] >= step) {
                if (fabs((double)off[to]) > fabs(region.by)) {
                    region.by = (double)off[to];
                    region.worst = to;
                }
                off[to] = 0.0f;
                stack[height++] = (uint32_t)to;
            }
        }
    }
    return region;
}

/* Finds lost and gained regions. */
static void measure_regions(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                            vsh_measures *m) {
    float *off = scratch;
    uint32_t *stack = (uint32_t *)(off + pair->count); /* holds no texel twice */
    const double step = options->step + VSHI_NOISE_P99 * options->noise;
    for (size_t i = 0; i < pair->count; ++i) {
        const size_t reach = (size_t)options->reach;
        const double came = pair->mask[i] ? find_excess(pair, VSHI_NEW, i, reach) : 0.0;
        const double went = pair->mask[i] ? -find_excess(pair, VSHI_GOLDEN, i, reach) : 0.0;
        off[i] = (float)(fabs(went) > fabs(came) ? went : came);
    }
    for (size_t i = 0; i < pair->count; ++i) {
        if (fabs((double)off[i]) >= step) {
            vsh_region *largest = off[i] > 0.0f ? &m->lost : &m->gained;
            const vsh_region region = extract_region(pair, off, stack, i, step);
            if (region.count > largest->count) {
                *largest = region;
            }
        }
    }
    m->value[VSH_MEASURE_LOST] = (double)m->lost.count;
    m->value[VSH_MEASURE_GAINED] = (double)m->gained.count;
}

/* --- all measures */

static vsh_result check_options(const vsh_compare_options *options, vsh_error *error) {
    if (!(options->step > 0.0 && options->step <= 1.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "step of %g: expected 0 (excluded) … 1", options->step);
    }
    if (options->reach < 0 || options->reach > VSHI_MOST_REACH) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "reach of %d texels: expected 0 … %d", options->reach,
                         VSHI_MOST_REACH);
    }
    if (!(options->noise >= 0.0 && options->noise <= 1.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "noise of %g: expected 0 … 1", options->noise);
    }
    return VSH_OK;
}

static vsh_result measure_all(const vshi_pair *pair, const vsh_compare_options *options, vshi_job *job,
                              void *scratch, vsh_measures *m, vsh_error *error) {
    VSHI_TRY(measure_values(pair, m, error));
    VSHI_TRY(vshi_job_step(job, 1, error));
    vshi_measure_shift(pair, scratch, m);
    VSHI_TRY(vshi_job_step(job, 1, error));
    VSHI_TRY(vshi_measure_penumbrae(pair, options->noise, m, error));
    VSHI_TRY(vshi_job_step(job, 1, error));
    measure_regions(pair, options, scratch, m);
    return vshi_job_step(job, 1, error);
}

vsh_result vsh_compare(const vsh_compared *compared, const vsh_compare_options *options, const vsh_run *run,
                       vsh_measures *measures, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(compared, measures);
    vsh_run full;
    vsh_compare_options chosen = vsh_compare_options_default();
    double values = 0.0;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(check_pair(compared, &values, error));
    VSHI_TRY(vshi_options_resolve(options, &chosen, sizeof chosen, "options", error));
    VSHI_TRY(check_options(&chosen, error));
    /* the caller's values and mask, then our mask and scratch */
    VSHI_TRY(vshi_check_limit(&full, values * (9.0 + 1.0 + REGIONS_SCRATCH), "comparison", error));
    const size_t count = (size_t)values;
    uint8_t *mask = NULL;
    void *scratch = NULL;
    vshi_job *job = NULL;
    const vshi_array arrays[] = {VSHI_ARRAY(mask, count), {&scratch, count, REGIONS_SCRATCH}};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "comparison", error));
    vshi_pair pair;
    vsh_measures m;
    make_pair(compared, mask, &pair, &m);
    if (m.count > 0) {
        VSHI_TRY_DONE(vshi_job_open(&job, &full, "compare", 4, "comparison", error));
        VSHI_TRY_DONE(measure_all(&pair, &chosen, job, scratch, &m, error));
    }
    *measures = m;
done:
    vshi_job_end(job);
    free(scratch);
    free(mask);
    return result;
}
