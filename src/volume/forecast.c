/* What a volume will take, found out by shading some of its blocks. */
#include "base/clock.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "volume/volume_blocks.h"

#include <math.h>

/* Pieces of work that are tried, from all over the volume. */
enum { PIECES = 64 };
/* Of a block's values in a grid, with its node's share of the tree; and of what is known of its voxels: two
 * masks, and how far those inside reach. */
static const double GRID_BYTES = 2200.0, BLOCK_BYTES = 640.0;

/* Pieces with as many between them as leave no more than PIECES. */
typedef struct trial {
    vshi_volume_bake *bake;
    size_t step;
} trial;

static void shade_some(void *user, size_t begin, size_t end) {
    const trial *t = user;
    for (size_t i = begin; i < end; ++i) {
        const size_t first = i * t->step * VSHI_VOLUME_GRAIN, all = t->bake->block_count;
        const size_t behind = all - first > VSHI_VOLUME_GRAIN ? first + VSHI_VOLUME_GRAIN : all;
        vshi_volume_shade_blocks(t->bake, first, behind);
    }
}

static vsh_result measure(vshi_volume_bake *bake, const vsh_light *lights, const vsh_run *run,
                          vsh_volume_forecast *f, vsh_error *error) {
    const size_t pieces = (bake->block_count + VSHI_VOLUME_GRAIN - 1) / VSHI_VOLUME_GRAIN;
    trial t = {bake, (pieces + PIECES - 1) / PIECES};
    const size_t tried = (pieces + t.step - 1) / t.step;
    const double held = (double)vshi_peak_bytes();
    vshi_job *job = vshi_job_begin(run, "volume", tried);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_volume_open(bake, lights, run, error));
    const double start = vshi_seconds();
    VSHI_TRY_DONE(vshi_volume_shade_by(bake, lights, tried, 1, shade_some, &t, job, 1, error));
    f->bake_s = (vshi_seconds() - start) * (double)pieces / (double)tried;
    f->peak_bytes =
        held + (double)bake->block_count * (BLOCK_BYTES + GRID_BYTES * (double)bake->channel_count);
done:
    vshi_fill_end(&bake->fill);
    vsh_volume_free(bake->volume);
    vshi_job_end(job);
    return result;
}

vsh_result vsh_bake_volume_forecast_sized(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                          const vsh_light *lights, size_t light_count,
                                          const vsh_volume_options *options, const vsh_run *run,
                                          vsh_volume_forecast *forecast, size_t forecast_size,
                                          vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(voxels);
    VSHI_NEEDS_OF(light_count, lights);
    VSHI_NEEDS(forecast);
    vsh_run full;
    vshi_volume_bake bake;
    VSHI_TRY(vshi_volume_set_up(&bake, occluders, voxels, lights, light_count, options, run, &full, error));
    vsh_volume_forecast f = {.grids = (int32_t)bake.channel_count};
    VSHI_TRY(measure(&bake, lights, &full, &f, error));
    vshi_give(forecast, forecast_size, &f, sizeof f);
    return VSH_OK;
}
