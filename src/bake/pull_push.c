/* Pull and push (Gortler, Grzeszczuk, Szeliski and Cohen, "The lumigraph", 1996), with means for weights:
 * levels half as large hold the mean of those of four texels that have a value; from the coarsest on what has
 * none takes that of the texel above it. A texel is never blended with those beside it: what is filled then
 * leaves the means of the levels above as they are. */
#include "bake/pull_push.h"

#include "base/parallel.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum {
    MOST_LEVELS = 34, /* 2^32 texels on a side */
    MOST_CHANNELS = 4,
    GRAIN = 16 /* rows */
};

/* A plane, halved. */
typedef struct level {
    size_t width, height;
    float *values; /* [height][width][channels] */
    const uint8_t *filled;
} level;

typedef struct filling {
    level levels[MOST_LEVELS];
    int count;
    int at; /* the level that is filled from the one below it, or gives to it */
    size_t channels;
    uint8_t *masks; /* of all levels but the finest */
    float *memory;  /* the same */
} filling;

static size_t half(size_t size) {
    return (size + 1) / 2;
}

/* Texels of all levels but the finest. */
static size_t coarse_texels(size_t width, size_t height) {
    size_t total = 0;
    while (width > 1 || height > 1) {
        width = half(width);
        height = half(height);
        total += width * height;
    }
    return total;
}

/* The mean of up to four, in the order of the image. */
static void pull_rows(void *user, size_t begin, size_t end) {
    const filling *f = user;
    const level *fine = &f->levels[f->at - 1], *coarse = &f->levels[f->at];
    uint8_t *mask = f->masks + (coarse->filled - f->masks);
    for (size_t y = begin; y < end; ++y) {
        for (size_t x = 0; x < coarse->width; ++x) {
            float sum[MOST_CHANNELS] = {0.0f};
            int count = 0;
            for (size_t k = 0; k < 4; ++k) {
                const size_t column = 2 * x + k % 2, row = 2 * y + k / 2, at = row * fine->width + column;
                if (column >= fine->width || row >= fine->height || fine->filled[at] == 0) {
                    continue;
                }
                ++count;
                for (size_t c = 0; c < f->channels; ++c) {
                    sum[c] += fine->values[at * f->channels + c];
                }
            }
            const size_t to = y * coarse->width + x;
            mask[to] = count > 0;
            for (size_t c = 0; c < f->channels && count > 0; ++c) {
                coarse->values[to * f->channels + c] = sum[c] / (float)count;
            }
        }
    }
}

static void push_rows(void *user, size_t begin, size_t end) {
    const filling *f = user;
    const level *fine = &f->levels[f->at - 1], *coarse = &f->levels[f->at];
    for (size_t y = begin; y < end; ++y) {
        for (size_t x = 0; x < fine->width; ++x) {
            const size_t to = y * fine->width + x, from = y / 2 * coarse->width + x / 2;
            if (fine->filled[to] == 0) {
                memcpy(fine->values + to * f->channels, coarse->values + from * f->channels,
                       f->channels * sizeof(float));
            }
        }
    }
}

/* Begins with the plane itself. */
static void lay_out(filling *f, size_t width, size_t height, const uint8_t *filled) {
    f->count = 1;
    f->levels[0] = (level){width, height, NULL, filled};
    size_t at = 0;
    while (width > 1 || height > 1) {
        width = half(width);
        height = half(height);
        f->levels[f->count++] = (level){width, height, f->memory + at * MOST_CHANNELS, f->masks + at};
        at += width * height;
    }
}

static vsh_result fill_plane(filling *f, const vshi_plane *plane, vshi_job *job, vsh_error *error) {
    f->levels[0].values = plane->values;
    f->channels = plane->channels;
    for (f->at = 1; f->at < f->count; ++f->at) {
        VSHI_TRY(vshi_parallel_for(job, f->levels[f->at].height, GRAIN, 0, pull_rows, f, error));
    }
    if (f->levels[f->count - 1].filled[0] == 0) {
        return VSH_OK;
    }
    for (f->at = f->count - 1; f->at > 0; --f->at) {
        VSHI_TRY(vshi_parallel_for(job, f->levels[f->at - 1].height, GRAIN, f->at == 1 ? 1 : 0, push_rows, f,
                                   error));
    }
    return VSH_OK;
}

vsh_result vshi_pull_push(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                          const uint8_t *filled, const vshi_plane *planes, size_t plane_count,
                          vsh_error *error) {
    filling f = {.count = 0};
    if (plane_count == 0) {
        return VSH_OK;
    }
    const size_t coarse = coarse_texels((size_t)width, (size_t)height);
    vshi_job *job = vshi_job_begin(run, "padding", (size_t)height * plane_count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "padding: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_store_take(store, (void **)&f.masks, coarse, 1, "padding", error));
    VSHI_TRY_DONE(
        vshi_store_take(store, (void **)&f.memory, coarse, MOST_CHANNELS * sizeof(float), "padding", error));
    lay_out(&f, (size_t)width, (size_t)height, filled);
    for (size_t p = 0; p < plane_count && result == VSH_OK; ++p) {
        result = fill_plane(&f, &planes[p], job, error);
    }
done:
    vshi_store_give(store, f.memory);
    vshi_store_give(store, f.masks);
    vshi_job_end(job);
    return result;
}
