/* Comparing two planes: what is asked is checked, and the measures are taken side by side. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "compare/pair.h"

#include <math.h>
#include <stdlib.h>

enum { MOST_VALUES = INT32_MAX, MOST_REACH = 16 };

void vsh_compare_coverage(uint64_t count, const float *golden, const float *values, uint8_t *mask,
                          vsh_coverage *coverage) {
    VSHI_FLOATS;
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

/* --- beforehand */

vsh_result vshi_pair_check(const vsh_compared *compared, double *values, vsh_error *error) {
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

static vsh_result check(const vsh_compared *compared, const vsh_compare_options *given, const vsh_run *run,
                        vsh_compare_options *options, vsh_error *error) {
    double count;
    VSHI_TRY(vshi_pair_check(compared, &count, error));
    *options = vsh_compare_options_default();
    if (given != NULL) {
        VSHI_TRY(vshi_options_resolve(given, options, sizeof *options, "options", error));
    }
    if (!(options->threshold >= 0.0 && options->threshold <= 1.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "threshold of %g: expected 0 … 1", options->threshold);
    }
    if (!(options->step > 0.0 && options->step <= 1.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "step of %g: expected 0 (excluded) … 1", options->step);
    }
    if (options->reach < 0 || options->reach > MOST_REACH) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "reach of %d texels: expected 0 … %d", options->reach,
                         MOST_REACH);
    }
    if (!(options->noise >= 0.0 && options->noise <= 1.0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "noise of %g: expected 0 … 1", options->noise);
    }
    /* the caller's values and mask, then ours */
    const double bytes = count * (9.0 + 1.0 + VSHI_CURVE_SCRATCH + VSHI_SHIFT_SCRATCH + VSHI_REGIONS_SCRATCH);
    return vshi_check_limit(run, bytes, "comparison", error);
}

/* Leaves out of the mask what is not finite, counts it, and finds the range. */
void vshi_pair_make(const vsh_compared *compared, uint8_t *mask, vshi_pair *pair, vsh_measures *m) {
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

/* --- the measures, each a piece of the work */

typedef struct work {
    const vshi_pair *pair, *shapes; /* the latter with golden on the curve of causes.c */
    const vsh_compare_options *options;
    vsh_measures *measures;
    uint8_t *scratch;
    vsh_result results[8];
} work;

static const struct {
    vshi_measure_fn *take;
    size_t scratch;
    bool shapes; /* it compares shapes, whatever the curve over the values */
} parts[] = {{vshi_measure_regions, VSHI_REGIONS_SCRATCH, true},
             {vshi_measure_shift, VSHI_SHIFT_SCRATCH, true},
             {vshi_measure_ssim, 0, false},
             {vshi_measure_edges, 0, true},
             {vshi_measure_values, 0, false}};
enum { PARTS = sizeof parts / sizeof parts[0] };

static void take_parts(void *user, size_t begin, size_t end) {
    work *w = user;
    for (size_t i = begin; i < end; ++i) {
        size_t before = 0;
        for (size_t k = 0; k < i; ++k) {
            before += parts[k].scratch * w->pair->count;
        }
        const vshi_pair *pair = parts[i].shapes ? w->shapes : w->pair;
        w->results[i] =
            parts[i].take(pair, w->options, w->scratch + before, w->measures) ? VSH_OK : VSH_ERROR_MEMORY;
    }
}

static vsh_result take_all(work *w, const vsh_run *run, vsh_error *error) {
    vshi_job *job = vshi_job_begin(run, "compare", PARTS);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "comparison: the system refused memory");
    }
    const vsh_result result = vshi_parallel_for(job, PARTS, 1, 1, take_parts, w, error);
    vshi_job_end(job);
    VSHI_TRY(result);
    for (size_t i = 0; i < PARTS; ++i) {
        if (w->results[i] != VSH_OK) {
            return vshi_fail(error, w->results[i], "comparison: the system refused memory");
        }
    }
    return VSH_OK;
}

vsh_result vsh_compare(const vsh_compared *compared, const vsh_compare_options *options, const vsh_run *run,
                       vsh_measures *measures, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(compared);
    VSHI_NEEDS(measures);
    vsh_run full;
    vsh_compare_options chosen;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(check(compared, options, &full, &chosen, error));
    const size_t count = (size_t)compared->size[0] * (size_t)compared->size[1] * (size_t)compared->size[2];
    void *mask = NULL, *scratch = NULL, *mapped = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate(&mask, count, 1, "comparison", error));
    VSHI_TRY_DONE(
        vshi_allocate(&scratch, count, VSHI_SHIFT_SCRATCH + VSHI_REGIONS_SCRATCH, "comparison", error));
    VSHI_TRY_DONE(vshi_allocate(&mapped, count, VSHI_CURVE_SCRATCH, "comparison", error));
    vshi_pair pair;
    vsh_measures m;
    vshi_pair_make(compared, mask, &pair, &m);
    vshi_pair shapes = pair;
    work w = {&pair, &shapes, &chosen, &m, scratch, {VSH_OK}};
    if (m.count > 0) {
        vshi_find_noise(&pair, &m);
        vshi_follow_curve(&shapes, mapped, scratch, &m);
        VSHI_TRY_DONE(take_all(&w, &full, error));
    }
    *measures = m;
done:
    free(mapped);
    free(scratch);
    free(mask);
    return result;
}
