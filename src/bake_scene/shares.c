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

/* Adds rows of tiles begin … end - 1 of a lightmap. */
static void add_rows(vshi_part_piece *pieces, uint64_t *count, size_t lightmap, size_t begin, size_t end,
                     int32_t height) {
    const int32_t first = (int32_t)begin * VSHI_TILE;
    const int32_t behind = (int32_t)end * VSHI_TILE < height ? (int32_t)end * VSHI_TILE : height;
    vshi_part_piece *last = *count > 0 ? &pieces[*count - 1] : NULL;
    if (last != NULL && last->lightmap == lightmap && last->first + last->rows == first) {
        last->rows = behind - last->first;
    } else {
        pieces[(*count)++] = (vshi_part_piece){lightmap, first, behind - first};
    }
}

vsh_result vshi_shares_list(const vsh_bake_job *job, int32_t shard, int32_t count, vshi_part_piece **pieces,
                            uint64_t *piece_count, vsh_error *error) {
    double before = 0.0, all = 0.0;
    *piece_count = 0;
    VSHI_TRY(vshi_allocate((void **)pieces, job->targets.count + 1, sizeof **pieces, "shares", error));
    for (size_t i = 0; i < job->targets.count; ++i) {
        all += (double)job->shares[i].samples;
    }
    for (size_t i = 0; i < job->targets.count; ++i) {
        const struct vshi_share_rows *share = &job->shares[i];
        for (size_t row = 0; row < share->count; row += share->step) {
            double samples = 0.0;
            const size_t next = row + share->step < share->count ? row + share->step : share->count;
            for (size_t k = row; k < next; ++k) {
                samples += (double)share->row[k];
            }
            if (shard_of(before, samples, all > 0.0 ? all : 1.0, count) == shard) {
                add_rows(*pieces, piece_count, i, row, next, job->lightmaps[i].height);
            }
            before += samples;
        }
    }
    return VSH_OK;
}

void vshi_shares_free(vsh_bake_job *job) {
    for (size_t i = 0; job->shares != NULL && i < job->targets.count; ++i) {
        free(job->shares[i].row);
    }
    free(job->shares);
    job->shares = NULL;
}
