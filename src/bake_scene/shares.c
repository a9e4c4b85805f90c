#include "bake_scene/shares.h"

#include "bake/texels.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

/* What shading is expected to take, of each row of tiles: samples. */
struct vshi_share_rows {
    size_t count; /* rows of tiles */
    size_t step;  /* that stay together */
    uint64_t samples;
    uint32_t *row; /* [count]: samples of each */
};

vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, vsh_error *error) {
    if (job->shares == NULL) {
        VSHI_TRY(
            vshi_allocate((void **)&job->shares, job->targets.count, sizeof *job->shares, "shares", error));
    }
    struct vshi_share_rows *share = &job->shares[index];
    free(share->row);
    *share = (struct vshi_share_rows){.count = charts->sorted.rows, .step = (size_t)charts->ao_spacing};
    VSHI_TRY(vshi_allocate((void **)&share->row, share->count, sizeof *share->row, "shares", error));
    for (size_t row = 0; row < share->count; ++row) {
        share->row[row] = (uint32_t)charts->rows[row].samples; /* 2^27 at most */
        share->samples += charts->rows[row].samples;
    }
    return VSH_OK;
}

/* The shard that rows belong to which have so many samples, behind so many of all. */
static int32_t shard_of(double before, double samples, double all, int32_t count) {
    const double at = (before + 0.5 * samples) / all * (double)count;
    return at >= (double)count ? count : 1 + (int32_t)at;
}

void vshi_shares_rows(const vsh_bake_job *job, int32_t shard, int32_t count, size_t index, int32_t *first,
                      int32_t *end) {
    double before = 0.0, all = 0.0;
    for (size_t i = 0; i < job->targets.count; ++i) {
        before += i < index ? (double)job->shares[i].samples : 0.0;
        all += (double)job->shares[i].samples;
    }
    const struct vshi_share_rows *share = &job->shares[index];
    const int32_t height = job->lightmaps[index].height;
    *first = *end = height;
    for (size_t row = 0; row < share->count; row += share->step) {
        double samples = 0.0;
        const size_t next = row + share->step < share->count ? row + share->step : share->count;
        for (size_t k = row; k < next; ++k) {
            samples += (double)share->row[k];
        }
        const int32_t here = shard_of(before, samples, all > 0.0 ? all : 1.0, count);
        const int32_t at = (int32_t)row * VSHI_TILE;
        *first = here >= shard && at < *first ? at : *first;
        *end = here > shard && at < *end ? at : *end;
        before += samples;
    }
}

void vshi_shares_free(vsh_bake_job *job) {
    for (size_t i = 0; job->shares != NULL && i < job->targets.count; ++i) {
        free(job->shares[i].row);
    }
    free(job->shares);
    job->shares = NULL;
}
