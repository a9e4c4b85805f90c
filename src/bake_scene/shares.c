#include "bake_scene/shares.h"

#include "bake/part.h"
#include "bake_scene/lit_sink.h"
#include "bake_scene/work.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>

/* Texels between those that are looked at: at most one in 256 of a lightmap's, and no more than so many,
 * which take some tens of milliseconds. */
enum { FEW_STEP = 16, FEW_MOST = 16384 };

/* Times that shards go through a lightmap there and back: at most, and such that the borders they add take no
 * more than this share of all work. Errors of what is expected of rows that lie apart even out. */
enum { MOST_ROUNDS = 8 };
static const double BORDERS = 0.01;

/* Lattices' tiles that a shard should have one above the other for its ends to be at the ends of one, where
 * texels share AO: what an end divides is shot by both. Of so many, half of one is little. */
enum { TILES_APART = 16 };

/* Rows of tiles that stay together. */
static size_t step_of(const vshi_share_rows *share, int32_t shards) {
    size_t step = 1;
    while (step < (size_t)share->left && share->count / (2 * step * TILES_APART) >= (size_t)shards) {
        step *= 2;
    }
    return step;
}

/* Rows that are laid out and shot beside a border, on both sides together, as whole ones: where AO is left,
 * those that windows reach are kept, and what is shot twice are some tiles of lattices. */
static double border_rows(const vshi_share_rows *share) {
    return share->left > 1 ? VSHI_SHARED_ROWS * share->left : 1.0;
}

static double few_of(int32_t width, int32_t height, int32_t step) {
    return (double)width / step * ((double)height / step);
}

static int32_t few_step(int32_t width, int32_t height) {
    int32_t step = FEW_STEP;
    while (few_of(width, height, step) > FEW_MOST) {
        step *= 2;
    }
    return step;
}

vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, const vsh_run *run,
                            vsh_error *error) {
    if (job->shares == NULL) {
        VSHI_TRY(
            vshi_allocate((void **)&job->shares, job->targets.count, sizeof *job->shares, "shares", error));
    }
    vshi_share_rows *share = &job->shares[index];
    share->count = charts->sorted.rows;
    share->spacing = charts->ao_spacing;
    share->few_step = few_step(charts->info.width, charts->info.height);
    VSHI_TRY(vshi_allocate((void **)&share->row, share->count, sizeof *share->row, "shares", error));
    VSHI_TRY(vshi_allocate((void **)&share->work, share->count, sizeof *share->work, "shares", error));
    for (size_t row = 0; row < share->count; ++row) { /* 2^27 at most, and the triangles of the receiver */
        const size_t *start = charts->sorted.row_start;
        share->row[row] =
            (vshi_share_row){(uint32_t)charts->rows[row].samples, (uint32_t)charts->rows[row].edges,
                             (uint32_t)(start[row + 1] - start[row])};
    }
    return vshi_texels_create_sparse(charts, share->few_step, run, &share->few, error);
}

vsh_result vshi_shares_leave(const vsh_bake_job *job, vsh_error *error) {
    const vsh_lightmap planes = vshi_channels_shape(&job->scene);
    for (size_t i = 0; i < job->targets.count; ++i) {
        vshi_share_rows *share = &job->shares[i];
        VSHI_TRY(vshi_part_spacing(job->occluders, &job->scene.shade, &planes, share->spacing, &share->left,
                                   error));
        share->spacing = share->left;
    }
    return VSH_OK;
}

/* --- how many have rows */

int32_t vsh_bake_job_shards(const vsh_scene *scene, const vsh_bake_job_options *options) {
    VSHI_FLOATS;
    vsh_bake_job_options own = vsh_bake_job_options_default();
    if (scene == NULL || options == NULL ||
        vshi_options_resolve(options, &own, sizeof own, "vsh_bake_job_options", NULL) != VSH_OK) {
        return 0;
    }
    vsh_scene baked = *scene;
    if (own.sink == NULL) {
        vshi_lit_sink_scene(&baked);
    }
    const bool known = own.per_object == 0 && own.shard_least > 0.0;
    const double most = known ? floor(vshi_shares_most(&baked, own.shard_least)) : INFINITY;
    return most >= own.shard_count ? own.shard_count : most > 1.0 ? (int32_t)most : 1;
}

/* --- cutting */

/* All shares, and how they are cut. */
typedef struct cutting {
    uint64_t all;  /* work */
    int32_t count; /* shards */
    int32_t rounds;
} cutting;

/* The shard of work that lies so far behind the beginning. */
static int32_t shard_of(const cutting *c, double at) {
    const int32_t all = c->rounds * c->count;
    const double place = at / (double)c->all * (double)all;
    const int32_t number = place >= (double)all ? all - 1 : (int32_t)place;
    const int32_t round = number / c->count, of = number % c->count;
    return 1 + (round % 2 == 0 ? of : c->count - 1 - of);
}

/* Rounds there and back; one through several lightmaps, whose charts are counted again for each piece. */
static int32_t count_rounds(const vsh_bake_job *job, int32_t count) {
    if (job->targets.count != 1 || count < 2) {
        return 1;
    }
    const vshi_share_rows *share = &job->shares[0];
    const double border = border_rows(share) / (8.0 * (double)share->count);
    const double more = BORDERS / (border * (count - 1));
    return more >= MOST_ROUNDS - 1 ? MOST_ROUNDS : 1 + (int32_t)more;
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

vsh_result vshi_shares_list(const vsh_bake_job *job, int32_t shard, int32_t count, const vsh_run *run,
                            vshi_part_piece **pieces, uint64_t *piece_count, vsh_error *error) {
    cutting cut = {.count = count, .rounds = count_rounds(job, count)};
    *pieces = NULL;
    *piece_count = 0;
    for (size_t i = 0; i < job->targets.count; ++i) {
        VSHI_TRY(vshi_shares_weigh(job, &job->shares[i], run, error));
        cut.all += job->shares[i].all;
    }
    cut.all = cut.all > 0 ? cut.all : 1;
    const size_t most = job->targets.count + (size_t)cut.rounds + 1;
    VSHI_TRY(vshi_allocate((void **)pieces, most, sizeof **pieces, "shares", error));
    uint64_t before = 0;
    for (size_t i = 0; i < job->targets.count; ++i) {
        const vshi_share_rows *share = &job->shares[i];
        const size_t step = step_of(share, count);
        for (size_t row = 0; row < share->count; row += step) {
            uint64_t work = 0;
            const size_t next = row + step < share->count ? row + step : share->count;
            for (size_t k = row; k < next; ++k) {
                work += share->work[k];
            }
            if (shard_of(&cut, (double)before + 0.5 * (double)work) == shard) {
                add_rows(*pieces, piece_count, i, row, next, job->lightmaps[i].height);
            }
            before += work;
        }
    }
    return VSH_OK;
}

void vshi_shares_free(vsh_bake_job *job) {
    for (size_t i = 0; job->shares != NULL && i < job->targets.count; ++i) {
        vsh_texels_free(job->shares[i].few);
        free(job->shares[i].work);
        free(job->shares[i].row);
    }
    free(job->shares);
    job->shares = NULL;
}
