/* What the measures are called, what they may come to, and whether they do. */
#include "compare/pair.h"

#include "base/floats.h"
#include "base/memory.h"

#include <math.h>
#include <string.h>

/* The table of measures. */
static const struct {
    const char *name;
    int32_t at_least; /* 1: the limit is the least that will do */
    double value;     /* what holds without another */
} table[VSH_MEASURE_COUNT] = {
    [VSH_MEASURE_NONFINITE] = {"nonfinite", 0, 0.0},
    [VSH_MEASURE_RMSE] = {"rmse", 0, 0.004},
    [VSH_MEASURE_BIAS] = {"bias", 0, 0.002},
    [VSH_MEASURE_MAX] = {"max", 0, 0.25},
    [VSH_MEASURE_P99] = {"p99", 0, 0.02},
    [VSH_MEASURE_SHARE] = {"share", 0, 0.01},
    [VSH_MEASURE_SSIM] = {"ssim", 1, 0.98},
    [VSH_MEASURE_PENUMBRA] = {"penumbra", 0, 0.03},
    [VSH_MEASURE_WIDTHS] = {"widths", 0, 0.05},
    [VSH_MEASURE_EDGES] = {"edges", 0, 0.02},
    [VSH_MEASURE_SHIFT] = {"shift", 0, 0.1},
    [VSH_MEASURE_LOST] = {"lost", 0, 3.0},
    [VSH_MEASURE_GAINED] = {"gained", 0, 3.0},
};

int32_t vsh_measure(const char *name) {
    for (int32_t i = 0; name != NULL && i < VSH_MEASURE_COUNT; ++i) {
        if (strcmp(table[i].name, name) == 0) {
            return i;
        }
    }
    return -1;
}

const char *vsh_measure_name(int32_t measure) {
    return measure >= 0 && measure < VSH_MEASURE_COUNT ? table[measure].name : NULL;
}

int32_t vsh_measure_at_least(int32_t measure) {
    return measure >= 0 && measure < VSH_MEASURE_COUNT ? table[measure].at_least : 0;
}

vsh_limits vsh_limits_default(void) {
    vsh_limits known = {.struct_size = sizeof known, .options = vsh_compare_options_default()};
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        known.value[i] = table[i].value;
    }
    return known;
}

/* Differences within the limits, and independent noise on top of them. Squares of errors add; the largest of
 * a million normal values is 5 of their standard errors away, the 99th percentile of their sizes 2.6. A fifth
 * of the noise may be bias, as of texels that share rays (the seeds' scene under a sun of 25°: 0.2). */
void vsh_limits_allow_noise(vsh_limits *limits, double noise) {
    VSHI_FLOATS;
    double *limit = limits->value;
    limits->options.noise = noise;
    limit[VSH_MEASURE_RMSE] = sqrt(limit[VSH_MEASURE_RMSE] * limit[VSH_MEASURE_RMSE] + noise * noise);
    limit[VSH_MEASURE_BIAS] += 0.2 * noise;
    limit[VSH_MEASURE_MAX] += 5.0 * noise;
    limit[VSH_MEASURE_P99] += 2.6 * noise;
    limit[VSH_MEASURE_SSIM] *= vshi_ssim_of_noise(noise);
    limit[VSH_MEASURE_PENUMBRA] += VSHI_NOISY_WIDTH * noise;
    limit[VSH_MEASURE_WIDTHS] += VSHI_NOISY_EDGE * noise;
}

uint32_t vsh_compare_judge(const vsh_measures *measures, const vsh_limits *limits) {
    VSHI_FLOATS;
    if (measures->count == 0) {
        return (UINT32_C(1) << VSH_MEASURE_COUNT) - 1;
    }
    uint32_t failed = measures->nonfinite[0] + measures->nonfinite[1] > 0 ? 1 << VSH_MEASURE_NONFINITE : 0;
    for (int i = 0; i < VSH_MEASURE_COUNT; ++i) {
        const double value = measures->value[i], limit = limits->value[i];
        const bool holds = table[i].at_least ? value >= limit : value <= limit;
        if (i != VSH_MEASURE_NONFINITE && !isnan(value) && !holds) {
            failed |= UINT32_C(1) << i;
        }
    }
    return failed;
}
