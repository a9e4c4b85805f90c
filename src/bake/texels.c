/* The samples of all texels, and the box around them. */
#include "bake/texels.h"

#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TRIANGLES = 1024 }; /* that are looked at together */

/* A box of samples' positions: low, high. */
typedef struct box {
    double low[3], high[3];
} box;

static const box EMPTY = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

typedef struct rasterization {
    const vsh_charts *charts;
    vshi_samples *samples; /* of all tiles; NULL: finds boxes only */
    size_t *start;         /* [tiles]: where a tile's samples begin */
    size_t step;           /* between tiles */
    box *boxes;            /* [tiles / step]; NULL: not asked for */
    const box *within;     /* tiles whose samples all lie in it are left out; NULL: none are */
    bool *is_within;       /* [triangles]: all samples of the triangle are */
    _Atomic vsh_result result;
} rasterization;

static void find_within(void *user, size_t begin, size_t end) {
    const rasterization *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t triangle = begin; triangle < end; ++triangle) {
        size_t local;
        const size_t mesh = vshi_charts_mesh(sorted, triangle, &local);
        all->is_within[triangle] =
            vshi_surface_is_within(&sorted->meshes[mesh], local, all->within->low, all->within->high);
    }
}

static bool is_tile_within(const rasterization *all, size_t number) {
    const vshi_charts *sorted = &all->charts->sorted;
    bool within = all->is_within != NULL;
    for (size_t i = sorted->tile_start[number]; within && i < sorted->tile_start[number + 1]; ++i) {
        within = all->is_within[sorted->tile_triangle[i]];
    }
    return within;
}

static void add_to_box(const vshi_samples *samples, box *b) {
    for (size_t i = 0; i < 3 * samples->count; ++i) {
        const double p = samples->position[i];
        b->low[i % 3] = fmin(b->low[i % 3], p);
        b->high[i % 3] = fmax(b->high[i % 3], p);
    }
}

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

/* Rows of cells one after the other, so that supersampled tiles take little memory. */
static vsh_result rasterize_tile(rasterization *all, size_t number, vshi_tile *tile) {
    const vsh_charts *charts = all->charts;
    const size_t row_samples = (size_t)VSHI_TILE * VSHI_CELL * (size_t)charts->sorted.raster.supersample *
                               (size_t)charts->sorted.raster.supersample;
    vshi_samples own = {.count = 0};
    vsh_result result = vshi_tile_open(&charts->sorted, number, tile, NULL);
    if (result == VSH_OK && all->samples != NULL) {
        own = part_of(all->samples, all->start[number], (size_t)charts->samples[number]);
    } else if (result == VSH_OK) {
        result = vshi_samples_allocate(&own, row_samples, false, NULL);
    }
    vshi_sample_writer writer = {.charts = charts, .tile = tile, .samples = &own};
    for (int32_t row = 0; result == VSH_OK && row < VSHI_TILE_CELLS; ++row) {
        own.count = all->samples != NULL ? own.count : 0;
        vshi_samples_write_rows(&writer, tile, row, row + 1);
        if (all->boxes != NULL) {
            add_to_box(&own, &all->boxes[number / all->step]);
        }
    }
    if (all->samples == NULL) {
        vshi_samples_free(&own);
    }
    vshi_tile_close(tile);
    return result;
}

static void rasterize_tiles(void *user, size_t begin, size_t end) {
    rasterization *all = user;
    for (size_t i = begin; i < end; ++i) {
        const size_t number = i * all->step;
        if (all->boxes != NULL) {
            all->boxes[i] = EMPTY;
        }
        if (all->charts->samples[number] == 0 || is_tile_within(all, number)) {
            continue;
        }
        vshi_tile tile;
        const vsh_result result = rasterize_tile(all, number, &tile);
        if (result != VSH_OK) {
            atomic_store(&all->result, result);
        }
    }
}

/* Rasterizes the tiles that are `step` apart. */
static vsh_result rasterize(rasterization *all, const vsh_run *run, vsh_error *error) {
    const vshi_charts *sorted = &all->charts->sorted;
    const size_t tiles = vshi_charts_tiles(sorted), triangles = sorted->first[sorted->mesh_count];
    const size_t count = (tiles + all->step - 1) / all->step;
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "texels", count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    if (all->within != NULL) {
        VSHI_TRY_DONE(
            vshi_allocate((void **)&all->is_within, triangles, sizeof *all->is_within, "texels", error));
        VSHI_TRY_DONE(vshi_parallel_for(job, triangles, TRIANGLES, 0, find_within, all, error));
    }
    VSHI_TRY_DONE(vshi_parallel_for(job, count, 1, 1, rasterize_tiles, all, error));
    if (atomic_load(&all->result) != VSH_OK) {
        result = vshi_fail(error, atomic_load(&all->result), "texels: the system refused memory for a tile");
    }
done:
    free(all->is_within);
    vshi_job_end(job);
    return result;
}

/* The box of all samples of tiles that are `step` apart, but for those that lie within another. */
static vsh_result find_box(const vsh_charts *charts, const box *within, size_t step, const vsh_run *run,
                           box *found, vsh_error *error) {
    rasterization all = {.charts = charts, .step = step, .within = within};
    const size_t count = (vshi_charts_tiles(&charts->sorted) + step - 1) / step;
    VSHI_TRY(vshi_allocate((void **)&all.boxes, count, sizeof *all.boxes, "texels", error));
    const vsh_result result = rasterize(&all, run, error);
    *found = EMPTY;
    for (size_t i = 0; result == VSH_OK && i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
            found->low[k] = fmin(found->low[k], all.boxes[i].low[k]);
            found->high[k] = fmax(found->high[k], all.boxes[i].high[k]);
        }
    }
    free(all.boxes);
    return result;
}

/* A first look at a few tiles gives a box; triangles inside it need no samples. */
vsh_result vsh_charts_bounds(const vsh_charts *charts, const vsh_run *run, double bounds_min[3],
                             double bounds_max[3], vsh_error *error) {
    enum { FEW = 16 };
    VSHI_FLOATS;
    VSHI_NEEDS(charts);
    VSHI_NEEDS(bounds_min);
    VSHI_NEEDS(bounds_max);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_run quiet = full;
    quiet.progress = NULL;
    box few, rest;
    VSHI_TRY(find_box(charts, NULL, FEW, &quiet, &few, error));
    VSHI_TRY(find_box(charts, &few, 1, &full, &rest, error));
    for (int k = 0; k < 3; ++k) {
        bounds_min[k] = fmin(few.low[k], rest.low[k]);
        bounds_max[k] = fmax(few.high[k], rest.high[k]);
        if (bounds_min[k] > bounds_max[k]) { /* there are no samples */
            bounds_min[k] = bounds_max[k] = 0.0;
        }
    }
    return VSH_OK;
}

static vsh_result make(const vsh_charts *charts, const vsh_run *run, vsh_texels *texels, vsh_error *error) {
    rasterization all = {.charts = charts, .samples = &texels->samples, .step = 1};
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
