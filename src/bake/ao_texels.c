#include "bake/ao_texels.h"

#include "bake/ao_estimate.h"
#include "bake/raster.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "shade/ao.h"

#include <stdlib.h>
#include <string.h>

typedef struct sharing {
    const vsh_texels *texels;
    const vshi_origins *origins;
    const vshi_ao_keep *keep; /* NULL: all is estimated */
    vshi_ao_estimates e;
} sharing;

/* A vshi_range_fn: where each origin is in the map. */
static void map_origins(void *user, size_t begin, size_t end) {
    const sharing *s = user;
    for (size_t i = begin; i < end; ++i) {
        const uint32_t texel = s->origins->texel[i];
        const size_t row = vsh_texel_row(texel) - (size_t)s->texels->band.first;
        s->e.at[row * (size_t)s->texels->info.width + vsh_texel_column(texel)] = (uint32_t)i + 1;
    }
}

/* What is kept of a texel; its value, where it is left, is none yet. */
static void keep_texel(const sharing *s, const vshi_ao_kept *kept, size_t column, size_t i, bool left) {
    const vshi_ao_estimates *e = &s->e;
    vshi_ao_shot *shot = &(s->keep->sky ? kept->sky : kept->ao)[column];
    memcpy(kept->position + VSHI_KEPT_POSITION * column, e->points->positions + 3 * i, VSHI_KEPT_POSITION);
    memcpy(kept->normal + 3 * column, e->points->normals + 3 * i, 3 * sizeof *kept->normal);
    shot->level = e->share.level[i];
    shot->rays = e->share.rays[i];
    shot->shot = shot->rays > 0 ? e->shot[i] : 0.0f;
    if (e->open != NULL && shot->rays > 0) {
        memcpy(kept->open + 3 * column, e->open + 3 * i, 3 * sizeof *kept->open);
    }
    if (!left || !vshi_ao_is_left(shot)) {
        return;
    }
    e->values[i] = 0.0f;
    if (e->deviation != NULL) {
        e->deviation[i] = 0.0f;
    }
    if (e->bent != NULL) {
        memset(e->bent + 3 * i, 0, 3 * sizeof *e->bent);
    }
}

/* A vshi_range_fn over the band's own rows of texels. */
static void keep_rows(void *user, size_t begin, size_t end) {
    const sharing *s = user;
    for (size_t k = begin; k < end; ++k) {
        const int32_t row = s->keep->first + (int32_t)k;
        const bool left = vshi_ao_cut_leaves(s->keep->cut, row / VSHI_TILE);
        vshi_ao_kept kept;
        if (!vshi_ao_keep_row(s->keep, row, &kept)) {
            continue;
        }
        for (int32_t column = 0; column < s->keep->width; ++column) {
            const uint32_t at = vshi_texel_at(&s->e.share.map, column, row - s->texels->band.first);
            if (at > 0) {
                keep_texel(s, &kept, (size_t)column, (size_t)at - 1, left);
            }
        }
    }
}

double vshi_ao_texels_bytes(double samples, int32_t width, int32_t rows, int32_t threads, bool bent) {
    return samples * (bent ? 3.0 : 0.0) * sizeof(float) +
           vshi_ao_estimates_bytes(samples, width, rows, threads);
}

/* Which rows' values are wanted, and what is to shoot for them, and for those that are left. */
static vsh_result open_reach(sharing *s, vsh_error *error) {
    vshi_ao_reach *reach = &s->e.reach;
    const vshi_band *band = &s->texels->band;
    VSHI_TRY(vshi_allocate((void **)&reach->lattices, reach->rows, reach->columns, "AO texels", error));
    for (size_t row = 0; row < reach->rows; ++row) {
        const bool left =
            s->keep != NULL && vshi_ao_cut_leaves(s->keep->cut, (int32_t)(row + band->held_begin));
        reach->wanted[row] = s->origins->needed[row] == VSHI_ROW_WANTED && !left;
    }
    vshi_ao_reach_first(reach, s->texels->ao_spacing);
    if (s->keep != NULL) {
        vshi_ao_reach_own(reach, s->texels->ao_spacing, band->own_begin - band->held_begin,
                          band->own_end - band->held_begin);
    }
    s->e.share.lattices = reach->lattices;
    return VSH_OK;
}

static vsh_result shoot(sharing *s, const vsh_occluders *occluders, const vsh_run *run, vsh_error *error) {
    vshi_ao_estimates *e = &s->e;
    vsh_run quiet = *run;
    quiet.progress = NULL;
    VSHI_TRY(vshi_shade_ao(occluders, e->points, s->origins->face, NULL, e->options, run, e->shot, NULL,
                           e->open, &e->share, NULL, error));
    return vshi_ao_reach_further(&e->reach, &e->share)
               ? vshi_shade_ao(occluders, e->points, s->origins->face, NULL, e->options, &quiet, e->shot,
                               NULL, e->open, &e->share, NULL, error)
               : VSH_OK;
}

vsh_result vshi_ao_texels(const vsh_occluders *occluders, const vsh_texels *texels,
                          const vshi_origins *origins, const vsh_points *points,
                          const vsh_shade_options *options, const vsh_run *run, const vshi_ao_keep *keep,
                          float *values, float *deviation, float *bent, vsh_shade_stats *stats,
                          vsh_error *error) {
    const size_t count = origins->count;
    sharing s = {
        .texels = texels,
        .origins = origins,
        .keep = keep->memory != NULL ? keep : NULL,
        .e = {.points = points,
              .options = options,
              .rows = &origins->rows,
              .share = {.map = {NULL, texels->info.width, texels->band.rows}, .spacing = texels->ao_spacing},
              .values = values,
              .deviation = deviation,
              .bent = bent}};
    vsh_run quiet = *run;
    quiet.progress = NULL;
    vshi_job *job = vshi_job_begin(&quiet, "ao", count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "ao: the system refused memory");
    }
    s.e.reach.rows = origins->rows.count;
    s.e.reach.columns = ((size_t)texels->info.width + VSHI_TILE - 1) / VSHI_TILE;
    vsh_result result;
    VSHI_TRY_DONE(vshi_ao_estimates_open(&s.e, count, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&s.e.open, bent != NULL ? count : 0, 3 * sizeof *s.e.open,
                                "AO texels", error));
    VSHI_TRY_DONE(open_reach(&s, error));
    if (count > 0) {
        VSHI_TRY_DONE(vshi_parallel_for(job, count, 4096, 0, map_origins, &s, error));
        VSHI_TRY_DONE(shoot(&s, occluders, run, error));
        VSHI_TRY_DONE(vshi_ao_estimate(&s.e, job, error));
    }
    if (s.keep != NULL) {
        VSHI_TRY_DONE(vshi_parallel_for(job, (size_t)(keep->end - keep->first), 16, 0, keep_rows, &s, error));
    }
    if (stats != NULL) {
        vshi_ao_estimate_add(&s.e, stats);
    }
done:
    free(s.e.reach.lattices);
    free(s.e.open);
    vshi_ao_estimates_close(&s.e);
    vshi_job_end(job);
    return result;
}
