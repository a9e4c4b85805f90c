#include "bake/texels.h"
#include "bake/part.h"
#include "bake/samples.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TRIANGLES = 1024 }; /* looked at together */

typedef struct creation {
    const vsh_charts *charts;
    size_t first, step;            /* tile rows: where they begin, and how far they are apart */
    vsh_texels *texels;            /* NULL: only the boxes are found */
    vshi_sample_box *boxes;        /* [tile rows]; NULL: they are not asked for */
    const double (*box)[3];        /* low, high: tiles whose samples lie in it are left out; NULL: none are */
    bool *within;                  /* [triangles]: it holds all samples of the triangle; NULL: no box */
    _Atomic vsh_result row_result; /* of the rows that failed */
} creation;

/* Every second bit of a number of six. */
static size_t even_bits(size_t number) {
    return (number & 1) | (number >> 1 & 2) | (number >> 2 & 4);
}

/* The texels of a tile in Morton's order, so that 4, 16 or all 64 that follow each other are a square. */
static void write_tile(vshi_sample_writer *w) {
    const vshi_tile *tile = &w->work->tile;
    for (size_t place = 0; place < (size_t)VSHI_TILE * VSHI_TILE; ++place) {
        const size_t x = even_bits(place), y = even_bits(place >> 1);
        const size_t column = tile->column * VSHI_TILE + x, row = tile->row * VSHI_TILE + y;
        vshi_samples_write(w, x, y, vsh_texel((uint32_t)column, (uint32_t)row), SIZE_MAX);
    }
}

/* --- what is left out */

static void find_within(void *user, size_t begin, size_t end) {
    const creation *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t triangle = begin; triangle < end; ++triangle) {
        size_t local;
        const size_t mesh = vshi_charts_mesh(sorted, triangle, &local);
        all->within[triangle] =
            vshi_surface_is_within(&sorted->meshes[mesh], local, all->box[0], all->box[1]);
    }
}

static bool is_row_within(const creation *all, size_t row) {
    const vshi_charts *sorted = &all->charts->sorted;
    bool within = all->within != NULL;
    for (size_t i = sorted->row_start[row]; within && i < sorted->row_start[row + 1]; ++i) {
        within = all->within[sorted->row_triangle[i]];
    }
    return within;
}

static bool is_tile_within(const creation *all, const vshi_row *work, size_t column) {
    const size_t *first = all->charts->sorted.first;
    bool within = all->within != NULL;
    for (size_t i = work->tile_start[column]; within && i < work->tile_start[column + 1]; ++i) {
        const uint32_t slot = work->tile_triangle[i];
        within = all->within[first[work->mesh[slot]] + work->local[slot]];
    }
    return within;
}

static void write_rows(void *user, size_t begin, size_t end) {
    creation *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t row = begin; row < end; ++row) {
        const size_t *start = all->texels != NULL ? all->texels->row_start + row : NULL;
        all->boxes[row] =
            (vshi_sample_box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        const size_t of = all->first + row * all->step;
        if ((start != NULL && start[0] == start[1]) || is_row_within(all, of)) {
            continue;
        }
        vshi_row work;
        const vsh_result result = vshi_row_open(sorted, of, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&all->row_result, result);
            vshi_row_close(&work);
            continue;
        }
        vshi_sample_writer w = {.charts = all->charts,
                                .texels = all->texels,
                                .work = &work,
                                .box = &all->boxes[row],
                                .next = start != NULL ? *start : 0};
        for (size_t column = 0; column < work.tiles; ++column) {
            if (work.tile_start[column] != work.tile_start[column + 1] &&
                !is_tile_within(all, &work, column)) {
                vshi_row_tile(sorted, &work, column, NULL);
                write_tile(&w);
            }
        }
        vshi_row_close(&work);
    }
}

/* Rasterises `rows` rows of tiles, or those of them that are `step` apart. */
static vsh_result rasterise(creation *all, size_t rows, const vsh_run *run, vsh_error *error) {
    vsh_result result;
    rows = (rows + all->step - 1) / all->step;
    vshi_job *job = vshi_job_begin(run, "texels", rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&all->boxes, rows, sizeof *all->boxes, "texels", error));
    if (all->box != NULL) {
        const vshi_charts *sorted = &all->charts->sorted;
        const size_t triangles = sorted->first[sorted->mesh_count];
        VSHI_TRY_DONE(vshi_allocate((void **)&all->within, triangles, sizeof *all->within, "texels", error));
        VSHI_TRY_DONE(vshi_parallel_for(job, triangles, TRIANGLES, 0, find_within, all, error));
    }
    VSHI_TRY_DONE(vshi_parallel_for(job, rows, 1, 1, write_rows, all, error));
    if (atomic_load(&all->row_result) != VSH_OK) {
        result =
            vshi_fail(error, atomic_load(&all->row_result), "texels: the system refused memory for a row");
    }
done:
    vshi_job_end(job);
    return result;
}

/* Box of the boxes begin … end - 1, empty where there are no samples, or zeros. */
static void join(const vshi_sample_box *boxes, size_t begin, size_t end, bool zeros, double low[3],
                 double high[3]) {
    for (int k = 0; k < 3; ++k) {
        double least = INFINITY, most = -INFINITY;
        for (size_t row = begin; row < end; ++row) {
            least = fmin(least, boxes[row].low[k]);
            most = fmax(most, boxes[row].high[k]);
        }
        low[k] = zeros && least > most ? 0.0 : least;
        high[k] = zeros && least > most ? 0.0 : most;
    }
}

static vsh_result find_bounds(const vsh_charts *charts, const double (*within)[3], size_t step,
                              const vsh_run *run, double low[3], double high[3], vsh_error *error) {
    creation all = {.charts = charts, .step = step, .box = within};
    const size_t rows = charts->sorted.rows;
    vsh_result result;
    VSHI_TRY_DONE(rasterise(&all, rows, run, error));
    join(all.boxes, 0, (rows + step - 1) / step, false, low, high);
done:
    free(all.within);
    free(all.boxes);
    return result;
}

/* A few rows tell of most triangles that all their samples lie within the box of what is found. */
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
    double few[2][3], low[3], high[3];
    VSHI_TRY(find_bounds(charts, NULL, FEW, &quiet, few[0], few[1], error));
    VSHI_TRY(find_bounds(charts, (const double(*)[3])few, 1, &full, low, high, error));
    for (int k = 0; k < 3; ++k) {
        bounds_min[k] = fmin(few[0][k], low[k]);
        bounds_max[k] = fmax(few[1][k], high[k]);
        if (bounds_min[k] > bounds_max[k]) { /* there are no samples */
            bounds_min[k] = bounds_max[k] = 0.0;
        }
    }
    return VSH_OK;
}

static vsh_result make_band(const vsh_charts *charts, const vsh_run *run, vsh_texels *texels,
                            vsh_error *error) {
    const vshi_band *band = &texels->band;
    const size_t rows = band->held_end - band->held_begin;
    VSHI_TRY(
        vshi_allocate((void **)&texels->row_start, rows + 1, sizeof *texels->row_start, "texels", error));
    for (size_t row = 0; row < rows; ++row) {
        const vshi_tile_row *counted = &charts->rows[band->held_begin + row];
        const size_t at = band->held_begin + row;
        const bool own = at >= band->own_begin && at < band->own_end;
        const bool laid = at >= band->laid_begin && at < band->laid_end;
        texels->row_start[row + 1] = texels->row_start[row] + (laid ? counted->samples : 0);
        texels->info.covered += own ? counted->texels : 0;
        texels->info.samples += own ? counted->samples : 0;
    }
    texels->count = texels->row_start[rows];
    const size_t sample = vshi_sample_bytes(charts->tangents);
    const double samples = (double)texels->count * (double)sample;
    const double held = (double)charts->info.bytes + vshi_row_bytes(&charts->sorted, run->threads);
    VSHI_TRY(vshi_check_limit(run, held + samples, "texels", error));
    texels->info.bytes = sizeof *texels + texels->count * sample + (rows + 1) * sizeof *texels->row_start;
    creation all = {.charts = charts, .first = band->held_begin, .step = 1, .texels = texels};
    VSHI_TRY(vshi_samples_take(texels, charts->tangents, error));
    vsh_result result;
    VSHI_TRY_DONE(rasterise(&all, rows, run, error));
    join(all.boxes, band->own_begin - band->held_begin, band->own_end - band->held_begin, true,
         texels->info.bounds_min, texels->info.bounds_max);
done:
    free(all.boxes);
    return result;
}

static vsh_result create(const vsh_charts *charts, int32_t first_row, int32_t rows, const vshi_ao_cut *cut,
                         const vsh_run *run, vsh_texels **texels, vsh_error *error) {
    vshi_band band;
    vsh_texels *made = NULL;
    VSHI_TRY(vshi_band_set(charts, first_row, rows, cut, &band, error));
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "texels", error));
    made->band = band;
    made->cut = cut != NULL ? *cut : (vshi_ao_cut){.spacing = 1};
    made->info.width = charts->info.width;
    made->info.height = charts->info.height;
    made->padding = charts->padding;
    made->fills = charts->fills && rows == charts->info.height && cut == NULL;
    made->ao_spacing = charts->ao_spacing;
    made->shade = charts->shade;
    made->smooth = charts->smooth;
    made->whole = charts->info.samples;
    made->mesh_count = charts->sorted.mesh_count;
    const vsh_result result = make_band(charts, run, made, error);
    if (result != VSH_OK) {
        vsh_texels_free(made);
        return result;
    }
    *texels = made;
    return VSH_OK;
}

vsh_result vsh_texels_create_band(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                  const vsh_run *run, vsh_texels **texels, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(texels);
    *texels = NULL;
    VSHI_NEEDS(charts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return create(charts, first_row, rows, NULL, &full, texels, error);
}

vsh_result vshi_texels_create_part(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                   const vshi_ao_cut *cut, const vsh_run *run, vsh_texels **texels,
                                   vsh_error *error) {
    VSHI_FLOATS;
    *texels = NULL;
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return create(charts, first_row, rows, cut, &full, texels, error);
}

vsh_result vsh_texels_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                             const vsh_run *run, vsh_uv_report *uv_reports, vsh_texels **texels,
                             vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(texels);
    *texels = NULL;
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_charts *charts = NULL;
    VSHI_TRY(vshi_charts_make(meshes, mesh_count, options, &full, true, uv_reports, &charts, error));
    const vsh_result result = create(charts, 0, charts->info.height, false, &full, texels, error);
    vsh_charts_free(charts);
    return result;
}

void vsh_texels_free(vsh_texels *texels) {
    if (texels == NULL) {
        return;
    }
    free(texels->tangent);
    free(texels->mesh);
    free(texels->texel);
    free(texels->lift);
    free(texels->geometric);
    free(texels->normal);
    free(texels->position);
    free(texels->row_start);
    free(texels);
}

void vsh_texels_get_info(const vsh_texels *texels, vsh_texels_info *info) {
    *info = texels->info;
}

vsh_texel_samples vsh_texels_samples(const vsh_texels *texels) {
    const vshi_band *band = &texels->band;
    const size_t first = texels->row_start[band->own_begin - band->held_begin];
    const size_t last = texels->row_start[band->own_end - band->held_begin];
    const vsh_texel_samples own = {last - first, texels->position + 3 * first, texels->normal + 3 * first,
                                   texels->geometric + 3 * first, texels->texel + first};
    return own;
}
