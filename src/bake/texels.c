/* The samples of all texels. */
#include "bake/texels.h"

#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"

#include <stdlib.h>

typedef struct rasterization {
    const vsh_charts *charts;
    vshi_samples *samples; /* of all tiles */
    size_t *start;         /* [tiles]: where a tile's samples begin */
} rasterization;

/* A view of a tile's part of all samples. */
static vshi_samples part_of(const vshi_samples *all, size_t first, size_t room) {
    return (vshi_samples){.room = room,
                          .position = all->position + 3 * first,
                          .normal = all->normal + 3 * first,
                          .geometric = all->geometric + 3 * first,
                          .lift = all->lift + 3 * first,
                          .texel = all->texel + first,
                          .mesh = all->mesh + first,
                          .tangent = all->tangent != NULL ? all->tangent + 4 * first : NULL};
}

static vsh_result write_tile(void *user, size_t number, vsh_error *error) {
    const rasterization *all = user;
    const vsh_charts *charts = all->charts;
    if (charts->samples[number] == 0) {
        return VSH_OK;
    }
    vshi_tile tile;
    vshi_samples own = part_of(all->samples, all->start[number], (size_t)charts->samples[number]);
    vshi_sample_writer writer = {.charts = charts, .tile = &tile, .samples = &own};
    const vsh_result result = vshi_tile_open(&charts->sorted, number, &tile, error);
    if (result == VSH_OK) {
        vshi_samples_write_rows(&writer, &tile, 0, VSHI_TILE_CELLS);
    }
    vshi_tile_close(&tile);
    return result;
}

static vsh_result rasterize(rasterization *all, const vsh_run *run, vsh_error *error) {
    const size_t tiles = vshi_charts_tiles(&all->charts->sorted);
    vshi_job *job = vshi_job_begin(run, "texels", tiles);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    const vsh_result result = vshi_parallel_each(job, tiles, 1, 1, write_tile, all, error);
    vshi_job_end(job);
    return result;
}

static vsh_result make(const vsh_charts *charts, const vsh_run *run, vsh_texels *texels, vsh_error *error) {
    rasterization all = {.charts = charts, .samples = &texels->samples};
    const size_t tiles = vshi_charts_tiles(&charts->sorted), count = (size_t)charts->info.samples;
    const double bytes = (double)count * (double)vshi_sample_bytes(charts->tangents);
    VSHI_TRY(vshi_check_limit(run, (double)charts->info.bytes + bytes, "texels", error));
    VSHI_TRY(vshi_samples_allocate(&texels->samples, count, charts->tangents, error));
    VSHI_TRY(vshi_allocate((void **)&all.start, tiles + 1, sizeof *all.start, "texels", error));
    for (size_t i = 0; i < tiles; ++i) {
        all.start[i + 1] = all.start[i] + (size_t)charts->samples[i];
    }
    texels->samples.count = count;
    const vsh_result result = rasterize(&all, run, error);
    free(all.start);
    return result;
}

vsh_result vsh_texels_create(const vsh_charts *charts, const vsh_run *run, vsh_texels **texels,
                             vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(texels);
    *texels = NULL;
    VSHI_NEEDS(charts);
    vsh_run full;
    vsh_texels *made = NULL;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "texels", error));
    const vsh_result result = make(charts, &full, made, error);
    if (result != VSH_OK) {
        vsh_texels_free(made);
        return result;
    }
    *texels = made;
    return VSH_OK;
}

void vsh_texels_free(vsh_texels *texels) {
    if (texels != NULL) {
        vshi_samples_free(&texels->samples);
        free(texels);
    }
}

vsh_texel_samples vsh_texels_samples(const vsh_texels *texels) {
    const vshi_samples *s = &texels->samples;
    return (vsh_texel_samples){s->count, s->position, s->normal, s->geometric, s->texel};
}
