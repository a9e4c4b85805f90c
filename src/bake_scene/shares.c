#include "bake_scene/shares.h"

#include "bake/part.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

/* Squares of texels that share AO rays, one above the other, that a shard has at least if it ends between
 * them. Texels of a square that an end divides are traced by both shards. */
enum { SQUARES_APART = 16 };

vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, vsh_error *error) {
    if (job->shares == NULL) {
        VSHI_TRY(
            vshi_allocate((void **)&job->shares, job->targets.count, sizeof *job->shares, "shares", error));
    }
    vshi_share_rows *share = &job->shares[index];
    share->count = charts->sorted.rows;
    share->spacing = charts->ao_spacing;
    VSHI_TRY(vshi_allocate((void **)&share->samples, share->count, sizeof *share->samples, "shares", error));
    for (size_t row = 0; row < share->count; ++row) {
        share->samples[row] = charts->rows[row].samples;
    }
    return VSH_OK;
}

vsh_result vshi_shares_leave(const vsh_bake_job *job, vsh_error *error) {
    const vsh_lightmap planes = vshi_channels_shape(&job->scene);
    for (size_t i = 0; i < job->targets.count; ++i) {
        vshi_share_rows *share = &job->shares[i];
        VSHI_TRY(vshi_part_spacing(job->occluders, &job->scene.shade, &planes, share->spacing, &share->left,
                                   error));
    }
    return VSH_OK;
}

/* Rows of tiles that stay together. */
static size_t step_of(const vshi_share_rows *share, int32_t shards) {
    size_t step = 1;
    while (step < (size_t)share->left && share->count / (2 * step * SQUARES_APART) >= (size_t)shards) {
        step *= 2;
    }
    return step;
}

static void add_rows(vshi_part_piece *pieces, uint64_t *count, size_t lightmap, size_t begin, size_t end,
                     int32_t height) {
    const int32_t first = (int32_t)begin * VSHI_TILE;
    const int32_t behind = (int32_t)end * VSHI_TILE < height ? (int32_t)end * VSHI_TILE : height;
    vshi_part_piece *last = *count > 0 ? &pieces[*count - 1] : NULL;
    if (last != NULL && last->lightmap == lightmap) {
        last->rows = behind - last->first;
    } else {
        pieces[(*count)++] = (vshi_part_piece){lightmap, first, behind - first};
    }
}

vsh_result vshi_shares_list(const vsh_bake_job *job, vshi_part_piece **pieces, uint64_t *piece_count,
                            vsh_error *error) {
    const int32_t shard = job->options.shard, count = job->options.shard_count;
    double all = 0.0, before = 0.0;
    *piece_count = 0;
    VSHI_TRY(vshi_allocate((void **)pieces, job->targets.count, sizeof **pieces, "shares", error));
    for (size_t i = 0; i < job->targets.count; ++i) {
        for (size_t row = 0; row < job->shares[i].count; ++row) {
            all += (double)job->shares[i].samples[row];
        }
    }
    for (size_t i = 0; i < job->targets.count; ++i) {
        const vshi_share_rows *share = &job->shares[i];
        const size_t step = step_of(share, count);
        for (size_t row = 0; row < share->count; row += step) {
            const size_t next = row + step < share->count ? row + step : share->count;
            double samples = 0.0;
            for (size_t k = row; k < next; ++k) {
                samples += (double)share->samples[k];
            }
            const double place = (before + 0.5 * samples) / (all > 0.0 ? all : 1.0) * count;
            const int32_t owner = place < count ? 1 + (int32_t)place : count;
            if (owner == shard) {
                add_rows(*pieces, piece_count, i, row, next, job->lightmaps[i].height);
            }
            before += samples;
        }
    }
    return VSH_OK;
}

void vshi_shares_free(vsh_bake_job *job) {
    for (size_t i = 0; job->shares != NULL && i < job->targets.count; ++i) {
        free(job->shares[i].samples);
    }
    free(job->shares);
    job->shares = NULL;
}
