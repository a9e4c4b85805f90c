#include "bake/texels.h"
#include "bake/part.h"
#include "bake/rows.h"
#include "bake/smooth_surface.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

/* Box of positions. */
typedef struct box {
    double low[3], high[3];
} box;

typedef struct creation {
    const vsh_charts *charts;
    size_t first;                  /* tile row */
    vsh_texels *texels;            /* NULL: only the boxes are found */
    box *boxes;                    /* [tile rows]; NULL: they are not asked for */
    const double (*within)[3];     /* low, high: tiles whose samples lie in it are left out; NULL: none are */
    _Atomic vsh_result row_result; /* of the rows that failed */
} creation;

/* Writes samples one after the other; neighbours are nearly always of one triangle, which stays set up. */
typedef struct writer {
    const creation *all;
    const vshi_row *work;
    box *box;
    size_t next;
    uint32_t number; /* triangle + 1 that is set up; 0: none */
    vshi_surface surface;
    float tangent[4]; /* of it, where they are asked for */
} writer;

static void set_tangent(writer *w, const vsh_mesh *mesh, size_t triangle) {
    double handedness;
    const vshi_vec t = vshi_surface_tangent(mesh, triangle, &handedness);
    w->tangent[0] = (float)t.x;
    w->tangent[1] = (float)t.y;
    w->tangent[2] = (float)t.z;
    w->tangent[3] = (float)handedness;
}

static void write_sample(writer *w, uint32_t number, uint32_t texel, const double weight[3], bool border) {
    vsh_texels *texels = w->all->texels;
    const uint32_t mesh = w->work->mesh[number - 1];
    if (number != w->number) {
        const vsh_mesh *of = &w->all->charts->sorted.meshes[mesh];
        vshi_surface_set(of, w->work->local[number - 1], &w->surface);
        if (texels != NULL && texels->tangent != NULL) {
            set_tangent(w, of, w->work->local[number - 1]);
        }
        w->number = number;
    }
    vshi_vec position, normal, lift;
    vshi_surface_at(&w->surface, weight, &position, &normal, &lift);
    const double p[3] = {position.x, position.y, position.z};
    const double n[3] = {normal.x, normal.y, normal.z};
    const double up[3] = {lift.x, lift.y, lift.z};
    const double g[3] = {w->surface.geometric.x, w->surface.geometric.y, w->surface.geometric.z};
    for (size_t k = 0; w->box != NULL && k < 3; ++k) {
        w->box->low[k] = p[k] < w->box->low[k] ? p[k] : w->box->low[k];
        w->box->high[k] = p[k] > w->box->high[k] ? p[k] : w->box->high[k];
    }
    if (texels == NULL) {
        return;
    }
    const size_t i = w->next++;
    for (size_t k = 0; k < 3; ++k) {
        texels->position[3 * i + k] = p[k];
        texels->normal[3 * i + k] = (float)n[k];
        texels->geometric[3 * i + k] = (float)g[k];
        texels->lift[3 * i + k] = (float)up[k];
    }
    texels->texel[i] = texel;
    const vsh_charts *charts = w->all->charts;
    const bool sheet = charts->sheet[charts->sorted.first[mesh] + w->work->local[number - 1]] != 0;
    texels->mesh[i] = mesh | (sheet ? VSHI_SAMPLE_SHEET : 0) | (border ? VSHI_SAMPLE_BORDER : 0);
    if (texels->tangent != NULL) {
        memcpy(texels->tangent + 4 * i, w->tangent, sizeof w->tangent);
    }
}

/* Every second bit of a number of six. */
static size_t even_bits(size_t number) {
    return (number & 1) | (number >> 1 & 2) | (number >> 2 & 4);
}

/* `most` samples at most of a texel of a tile; returns how many there are. */
static size_t write_texel(writer *w, size_t x, size_t y, uint32_t texel, size_t most) {
    const vshi_tile *tile = &w->work->tile;
    const size_t n = (size_t)w->all->charts->sorted.raster.supersample, side = VSHI_TILE * n;
    const size_t column = tile->column * VSHI_TILE + x, row = tile->row * VSHI_TILE + y;
    const size_t bit = VSHI_TILE * y + x;
    double weight[3];
    if ((tile->border >> bit) & 1) {
        const uint32_t number = tile->nearest[bit];
        vshi_uv_nearest(&w->work->triangle[number - 1], (double)column + 0.5, (double)row + 0.5, weight);
        write_sample(w, number, texel, weight, true);
        return 1;
    }
    size_t count = 0;
    for (size_t s = 0; ((tile->covered >> bit) & 1) != 0 && s < n * n && count < most; ++s) {
        const size_t sx = s % n, sy = s / n;
        const uint32_t number = tile->owner[(y * n + sy) * side + x * n + sx];
        if (number != 0) {
            vshi_uv_barycentric(&w->work->triangle[number - 1],
                                (double)column + ((double)sx + 0.5) / (double)n,
                                (double)row + ((double)sy + 0.5) / (double)n, weight);
            write_sample(w, number, texel, weight, false);
            ++count;
        }
    }
    return count;
}

/* The texels of a tile in Morton's order, so that 4, 16 or all 64 that follow each other are a square. */
static void write_tile(writer *w) {
    const vshi_tile *tile = &w->work->tile;
    for (size_t place = 0; place < (size_t)VSHI_TILE * VSHI_TILE; ++place) {
        const size_t x = even_bits(place), y = even_bits(place >> 1);
        const size_t column = tile->column * VSHI_TILE + x, row = tile->row * VSHI_TILE + y;
        write_texel(w, x, y, vsh_texel((uint32_t)column, (uint32_t)row), SIZE_MAX);
    }
}

/* Whether all samples of a tile lie in the box that is left out. */
static bool is_within(const creation *all, const vshi_row *work, size_t column) {
    bool within = all->within != NULL;
    for (size_t i = work->tile_start[column]; within && i < work->tile_start[column + 1]; ++i) {
        const uint32_t slot = work->tile_triangle[i];
        within = vshi_surface_is_within(&all->charts->sorted.meshes[work->mesh[slot]], work->local[slot],
                                        all->within[0], all->within[1]);
    }
    return within;
}

static void write_rows(void *user, size_t begin, size_t end) {
    creation *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t row = begin; row < end; ++row) {
        const size_t *start = all->texels != NULL ? all->texels->row_start + row : NULL;
        all->boxes[row] = (box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
        if (start != NULL && start[0] == start[1]) {
            continue;
        }
        vshi_row work;
        const vsh_result result = vshi_row_open(sorted, all->first + row, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&all->row_result, result);
            vshi_row_close(&work);
            continue;
        }
        writer w = {.all = all, .work = &work, .box = &all->boxes[row], .next = start != NULL ? *start : 0};
        for (size_t column = 0; column < work.tiles; ++column) {
            if (work.tile_start[column] != work.tile_start[column + 1] && !is_within(all, &work, column)) {
                vshi_row_tile(sorted, &work, column, NULL);
                write_tile(&w);
            }
        }
        vshi_row_close(&work);
    }
}

/* Rasterises `rows` rows of tiles. */
static vsh_result rasterise(creation *all, size_t rows, const vsh_run *run, vsh_error *error) {
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "texels", rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&all->boxes, rows, sizeof *all->boxes, "texels", error));
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
static void join(const box *boxes, size_t begin, size_t end, bool zeros, double low[3], double high[3]) {
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

vsh_result vshi_charts_bounds_beyond(const vsh_charts *charts, const double (*within)[3], const vsh_run *run,
                                     double low[3], double high[3], vsh_error *error) {
    creation all = {.charts = charts, .within = within};
    const size_t rows = charts->sorted.rows;
    vsh_result result;
    VSHI_TRY_DONE(rasterise(&all, rows, run, error));
    join(all.boxes, 0, rows, within == NULL, low, high);
done:
    free(all.boxes);
    return result;
}

vsh_result vsh_charts_bounds(const vsh_charts *charts, const vsh_run *run, double bounds_min[3],
                             double bounds_max[3], vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(charts);
    VSHI_NEEDS(bounds_min);
    VSHI_NEEDS(bounds_max);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return vshi_charts_bounds_beyond(charts, NULL, &full, bounds_min, bounds_max, error);
}

static vsh_result take_samples(vsh_texels *texels, bool tangents, vsh_error *error) {
    const char *what = "texels";
    VSHI_TRY(vshi_allocate((void **)&texels->position, texels->count, 3 * sizeof(double), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->normal, texels->count, 3 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->geometric, texels->count, 3 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->lift, texels->count, 3 * sizeof(float), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->texel, texels->count, sizeof(uint32_t), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->mesh, texels->count, sizeof(uint32_t), what, error));
    VSHI_TRY(vshi_allocate((void **)&texels->tangent, tangents ? texels->count : 0, 4 * sizeof(float), what,
                           error));
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
    creation all = {.charts = charts, .first = band->held_begin, .texels = texels};
    VSHI_TRY(take_samples(texels, charts->tangents, error));
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

vsh_result vsh_texels_create_sized(const vsh_mesh *meshes, size_t mesh_count,
                                   const vsh_lightmap_options *options, const vsh_run *run,
                                   vsh_uv_report *uv_reports, size_t uv_reports_size, vsh_texels **texels,
                                   vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(texels);
    *texels = NULL;
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_charts *charts = NULL;
    VSHI_TRY(vshi_charts_make(meshes, mesh_count, options, &full, true, uv_reports, uv_reports_size, &charts,
                              error));
    const vsh_result result = create(charts, 0, charts->info.height, false, &full, texels, error);
    vsh_charts_free(charts);
    return result;
}

/* --- sparse */

typedef struct sparse {
    creation all;
    size_t step;    /* tiles */
    uint8_t *taken; /* [columns × rows, up to whole tiles]: by place, 1 where there is a sample */
} sparse;

/* Texels of whole tiles before one of a sparse lightmap: its place among all, were all of them there. */
static size_t sparse_place(size_t columns, size_t column, size_t row) {
    const size_t tiles = (columns + VSHI_TILE - 1) / VSHI_TILE, side = VSHI_TILE;
    return ((row / side * tiles + column / side) * side + row % side) * side + column % side;
}

/* Rows of the sparse lightmap, each by itself. */
static void write_sparse(void *user, size_t begin, size_t end) {
    sparse *some = user;
    const vshi_charts *sorted = &some->all.charts->sorted;
    const size_t columns = (size_t)some->all.texels->info.width;
    for (size_t row = begin; row < end; ++row) {
        vshi_row work;
        const vsh_result result = vshi_row_open(sorted, row * some->step + some->step / 2, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&some->all.row_result, result);
        }
        writer w = {.all = &some->all, .work = &work};
        for (size_t column = 0; column < columns && result == VSH_OK; ++column) {
            const size_t of = column * some->step + some->step / 2;
            if (of < work.tiles && work.tile_start[of] != work.tile_start[of + 1]) {
                const size_t place = sparse_place(columns, column, row);
                w.next = place;
                vshi_row_tile(sorted, &work, of, NULL);
                const uint32_t texel = vsh_texel((uint32_t)column, (uint32_t)row);
                some->taken[place] = write_texel(&w, 0, 0, texel, 1) > 0;
            }
        }
        vshi_row_close(&work);
    }
}

/* Moves the samples that there are together, and counts those of each row of tiles. */
static void pack_sparse(const uint8_t *taken, size_t places, vsh_texels *texels) {
    const size_t tiles = ((size_t)texels->info.width + VSHI_TILE - 1) / VSHI_TILE;
    const size_t of_row = tiles * VSHI_TILE * VSHI_TILE;
    size_t next = 0;
    for (size_t i = 0; i < places; ++i) {
        if (taken[i]) {
            memmove(texels->position + 3 * next, texels->position + 3 * i, 3 * sizeof(double));
            memmove(texels->normal + 3 * next, texels->normal + 3 * i, 3 * sizeof(float));
            memmove(texels->geometric + 3 * next, texels->geometric + 3 * i, 3 * sizeof(float));
            memmove(texels->lift + 3 * next, texels->lift + 3 * i, 3 * sizeof(float));
            texels->texel[next] = texels->texel[i];
            texels->mesh[next++] = texels->mesh[i];
        }
        if ((i + 1) % of_row == 0) {
            texels->row_start[(i + 1) / of_row] = next;
        }
    }
    texels->count = next;
    texels->whole = next;
    texels->info.covered = next;
    texels->info.samples = next;
}

vsh_result vshi_texels_create_sparse(const vsh_charts *charts, int32_t step, const vsh_run *run,
                                     vsh_texels **texels, vsh_error *error) {
    const size_t columns = ((size_t)charts->info.width + (size_t)step / 2 - 1) / (size_t)step;
    const size_t rows = ((size_t)charts->info.height + (size_t)step / 2 - 1) / (size_t)step;
    const size_t tiles = (columns + VSHI_TILE - 1) / VSHI_TILE,
                 tile_rows = (rows + VSHI_TILE - 1) / VSHI_TILE;
    sparse some = {.all = {.charts = charts}, .step = (size_t)step / VSHI_TILE};
    vsh_texels *made = NULL;
    *texels = NULL;
    if (columns == 0 || rows == 0) {
        return VSH_OK;
    }
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "texels", rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "texels", error));
    made->count = tiles * tile_rows * VSHI_TILE * VSHI_TILE;
    made->info.width = (int32_t)columns;
    made->info.height = (int32_t)rows;
    made->band = (vshi_band){
        .own_end = tile_rows, .held_end = tile_rows, .own_rows = (int32_t)rows, .rows = (int32_t)rows};
    made->ao_spacing = 1;
    made->shade = charts->shade;
    made->mesh_count = charts->sorted.mesh_count;
    VSHI_TRY_DONE(vshi_check_limit(run,
                                   (double)charts->info.bytes +
                                       vshi_row_bytes(&charts->sorted, run->threads) +
                                       (double)made->count * (double)vshi_sample_bytes(false),
                                   "texels", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&made->row_start, tile_rows + 1, sizeof *made->row_start, "texels", error));
    VSHI_TRY_DONE(take_samples(made, false, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&some.taken, made->count, 1, "texels", error));
    some.all.texels = made;
    VSHI_TRY_DONE(vshi_parallel_for(job, rows, 1, 1, write_sparse, &some, error));
    if (atomic_load(&some.all.row_result) != VSH_OK) {
        result = vshi_fail(error, some.all.row_result, "texels: the system refused memory for a row");
        goto done;
    }
    pack_sparse(some.taken, made->count, made);
    *texels = made;
    made = NULL;
done:
    free(some.taken);
    vsh_texels_free(made);
    vshi_job_end(job);
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

void vsh_texels_get_info_sized(const vsh_texels *texels, vsh_texels_info *info, size_t info_size) {
    vshi_give(info, info_size, &texels->info, sizeof texels->info);
}

void vsh_texels_samples_sized(const vsh_texels *texels, vsh_texel_samples *samples, size_t samples_size) {
    const vshi_band *band = &texels->band;
    const size_t first = texels->row_start[band->own_begin - band->held_begin];
    const size_t last = texels->row_start[band->own_end - band->held_begin];
    const vsh_texel_samples own = {last - first, texels->position + 3 * first, texels->normal + 3 * first,
                                   texels->geometric + 3 * first, texels->texel + first};
    vshi_give(samples, samples_size, &own, sizeof own);
}
