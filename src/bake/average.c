#include "bake/average.h"
#include "base/parallel.h"

#include <math.h>

/* The texel whose first sample is *sample, the *next of the valid ones; moves both on to the next texel's. */
static void average_texel(const vshi_average *a, size_t *sample, size_t *next) {
    const vsh_texels *texels = a->texels;
    const size_t first = *sample;
    double sum[3] = {0.0, 0.0, 0.0};
    size_t count = 0, i = first;
    for (; i < texels->count && texels->texel[i] == texels->texel[first]; ++i) {
        if (!a->origins->valid[i]) {
            continue;
        }
        const float *value = a->values != NULL ? a->values + *next * a->channels : NULL;
        ++*next;
        if (value != NULL && isnan(value[0])) {
            continue;
        }
        for (size_t c = 0; value != NULL && c < a->channels; ++c) {
            sum[c] += (double)value[c];
        }
        ++count;
    }
    *sample = i;
    const size_t at = vshi_sample_held(texels, first);
    if (a->values == NULL) {
        a->state[at] = count > 0 ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
    } else if (count == 0 && !a->deviation) {
        a->state[at] = VSHI_TEXEL_INVALID;
    } else if (count > 0) {
        for (size_t c = 0; c < a->channels; ++c) {
            a->plane[at * a->channels + c] = (float)(sum[c] / (double)count);
        }
    }
}

/* Texels whose samples begin in a block belong to it, also where they go on beyond its end. */
static void average_blocks(void *user, size_t begin, size_t end) {
    const vshi_average *a = user;
    const vsh_texels *texels = a->texels;
    for (size_t block = begin; block < end; ++block) {
        size_t i = block * VSHI_ORIGIN_BLOCK, next = a->origins->before[block];
        size_t last = i + VSHI_ORIGIN_BLOCK;
        last = last < texels->count ? last : texels->count;
        for (; i > 0 && i < last && texels->texel[i] == texels->texel[i - 1]; ++i) {
            next += a->origins->valid[i];
        }
        while (i < last) {
            average_texel(a, &i, &next);
        }
    }
}

vsh_result vshi_average_run(const vshi_average *average, const vsh_run *run, vsh_error *error) {
    vshi_average task = *average;
    vshi_job *job = vshi_job_begin(run, "resolve", average->origins->blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "resolve: the system refused memory");
    }
    const vsh_result result =
        vshi_parallel_for(job, average->origins->blocks, 1, 1, average_blocks, &task, error);
    vshi_job_end(job);
    return result;
}
