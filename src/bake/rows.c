#include "bake/rows.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

double vshi_row_bytes(const vshi_charts *charts, int32_t threads) {
    const double all_cores = 64.0; /* threads == 0: how many there are is the pool's business */
    const double each = sizeof(vshi_uv_triangle) + 2.0 * sizeof(uint32_t) + sizeof(uint64_t);
    size_t most = 0;
    for (size_t row = 0; row < charts->rows; ++row) {
        const size_t count = charts->row_start[row + 1] - charts->row_start[row];
        most = count > most ? count : most;
    }
    const double at_work = (threads > 0 ? threads : all_cores) * (double)most;
    const double total = (double)charts->row_start[charts->rows];
    return each * (at_work < total ? at_work : total);
}

/* Those without a number are objects of their own: theirs begin above all that meshes can have. */
static uint64_t object_of(const vsh_mesh *mesh, size_t index) {
    return mesh->object > 0 ? mesh->object : (uint64_t)UINT32_MAX + 1 + index;
}

vsh_result vshi_row_open(const vshi_charts *charts, size_t row, vshi_row *work, vsh_error *error) {
    const vshi_raster *raster = &charts->raster;
    *work = (vshi_row){.row = row, .tiles = ((size_t)raster->width + VSHI_TILE - 1) / VSHI_TILE};
    const uint32_t *number =
        charts->row_triangle != NULL ? charts->row_triangle + charts->row_start[row] : NULL;
    const size_t count = charts->row_start[row + 1] - charts->row_start[row];
    const size_t side = (size_t)VSHI_TILE * (size_t)raster->supersample;
    const char *what = "row of texels";
    VSHI_TRY(vshi_allocate((void **)&work->triangle, count, sizeof *work->triangle, what, error));
    VSHI_TRY(vshi_allocate((void **)&work->mesh, count, sizeof *work->mesh, what, error));
    VSHI_TRY(vshi_allocate((void **)&work->local, count, sizeof *work->local, what, error));
    VSHI_TRY(vshi_allocate((void **)&work->object, count, sizeof *work->object, what, error));
    VSHI_TRY(
        vshi_allocate((void **)&work->tile_start, work->tiles + 2, sizeof *work->tile_start, what, error));
    VSHI_TRY(vshi_allocate((void **)&work->tile.owner, side * side, sizeof *work->tile.owner, what, error));
    size_t begin, end;
    for (size_t i = 0; i < count; ++i) {
        size_t local;
        const size_t mesh = vshi_charts_mesh(charts, number[i], &local);
        work->mesh[i] = (uint32_t)mesh;
        work->local[i] = (uint32_t)local;
        work->object[i] = object_of(&charts->meshes[mesh], mesh);
        vshi_charts_triangle(charts, mesh, local, &work->triangle[i]);
        vshi_uv_tiles(raster, &work->triangle[i], row, &begin, &end);
        for (size_t column = begin; column < end; ++column) {
            ++work->tile_start[column + 1];
        }
    }
    size_t total = 0;
    for (size_t column = 0; column <= work->tiles; ++column) {
        const size_t here = work->tile_start[column + 1];
        work->tile_start[column + 1] = total;
        total += here;
    }
    VSHI_TRY(vshi_allocate((void **)&work->tile_triangle, total, sizeof *work->tile_triangle, what, error));
    for (size_t i = 0; i < count; ++i) {
        vshi_uv_tiles(raster, &work->triangle[i], row, &begin, &end);
        for (size_t column = begin; column < end; ++column) {
            work->tile_triangle[work->tile_start[column + 1]++] = (uint32_t)i;
        }
    }
    return VSH_OK;
}

void vshi_row_close(vshi_row *work) {
    free(work->tile_triangle);
    free(work->tile.owner);
    free(work->tile_start);
    free(work->object);
    free(work->local);
    free(work->mesh);
    free(work->triangle);
    *work = (vshi_row){0};
}

/* Texels that a mesh covers again, each counted once. */
static void count_overlap(const vshi_overlaps *overlaps, size_t mesh, const vshi_tile_overlap *taken) {
    if (overlaps->texels != NULL && taken->texels != 0) {
        atomic_fetch_add_explicit(&overlaps->texels[mesh], (size_t)__builtin_popcountll(taken->texels),
                                  memory_order_relaxed);
        atomic_fetch_add_explicit(&overlaps->others[mesh], (size_t)__builtin_popcountll(taken->others),
                                  memory_order_relaxed);
    }
}

/* Whose the texels are: of several samples' owners, that of the first that is no part of the same object. */
static void count_owners(const vshi_charts *charts, const vshi_row *work, uint32_t triangle, uint64_t texels,
                         const vshi_overlaps *overlaps) {
    const size_t n = (size_t)charts->raster.supersample, side = VSHI_TILE * n;
    for (uint64_t left = texels; left != 0; left &= left - 1) {
        const size_t bit = (size_t)__builtin_ctzll(left);
        const uint32_t *sample = work->tile.owner + bit / VSHI_TILE * n * side + bit % VSHI_TILE * n;
        for (size_t k = 0; k < n * n; ++k) {
            const uint32_t owner = sample[k / n * side + k % n];
            if (owner != 0 && work->object[owner - 1] != work->object[triangle]) {
                atomic_fetch_add_explicit(&overlaps->owners[work->mesh[owner - 1]], 1, memory_order_relaxed);
                break;
            }
        }
    }
}

void vshi_row_tile(const vshi_charts *charts, vshi_row *work, size_t column, const vshi_overlaps *overlaps) {
    const uint32_t *slot = work->tile_triangle + work->tile_start[column];
    const size_t count = work->tile_start[column + 1] - work->tile_start[column];
    vshi_tile_begin(&charts->raster, column, work->row, &work->tile);
    size_t mesh = 0;
    vshi_tile_overlap again = {0, 0};
    for (size_t i = 0; i < count; ++i) {
        const uint32_t s = slot[i];
        const vshi_tile_overlap taken = vshi_tile_cover(&charts->raster, &work->triangle[s], s + 1,
                                                        overlaps != NULL ? work->object : NULL, &work->tile);
        if (overlaps == NULL || taken.texels == 0) {
            continue;
        }
        if (work->mesh[s] != mesh) {
            count_overlap(overlaps, mesh, &again);
            mesh = work->mesh[s];
            again = (vshi_tile_overlap){0, 0};
        }
        if (overlaps->owners != NULL && mesh == overlaps->watched) {
            count_owners(charts, work, s, taken.others & ~again.others, overlaps);
        }
        again.texels |= taken.texels;
        again.others |= taken.others;
        if (overlaps->triangles != NULL) {
            atomic_store_explicit(&overlaps->triangles[charts->first[mesh] + work->local[s]], 1,
                                  memory_order_relaxed);
        }
    }
    if (overlaps != NULL) {
        count_overlap(overlaps, mesh, &again);
    }
    for (size_t i = 0; i < count; ++i) {
        const uint32_t s = slot[i];
        vshi_tile_touch(&charts->raster, &work->triangle[s], s + 1, &work->tile);
    }
}
