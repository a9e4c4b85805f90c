#include "bake/rows.h"
#include "bake/take.h"

#include <stdlib.h>

double vshi_row_bytes(const vshi_charts *charts, int32_t threads) {
    const double all_cores = 64.0; /* threads == 0: how many there are is the pool's business */
    const double each = sizeof(vshi_uv_triangle) + 2.0 * sizeof(uint32_t);
    size_t most = 0;
    for (size_t row = 0; row < charts->rows; ++row) {
        const size_t count = charts->row_start[row + 1] - charts->row_start[row];
        most = count > most ? count : most;
    }
    const double at_work = (threads > 0 ? threads : all_cores) * (double)most;
    const double total = (double)charts->row_start[charts->rows];
    return each * (at_work < total ? at_work : total);
}

vsh_result vshi_row_open(const vshi_charts *charts, size_t row, vshi_row *work, vsh_error *error) {
    const vshi_raster *raster = &charts->raster;
    *work = (vshi_row){.row = row, .tiles = ((size_t)raster->width + VSHI_TILE - 1) / VSHI_TILE};
    const uint32_t *number =
        charts->row_triangle != NULL ? charts->row_triangle + charts->row_start[row] : NULL;
    const size_t count = charts->row_start[row + 1] - charts->row_start[row];
    const size_t side = (size_t)VSHI_TILE * (size_t)raster->supersample;
    const char *what = "row of texels";
    vsh_result result = VSH_OK;
    work->triangle = vshi_take(count, sizeof *work->triangle, what, &result, error);
    work->mesh = vshi_take(count, sizeof *work->mesh, what, &result, error);
    work->local = vshi_take(count, sizeof *work->local, what, &result, error);
    work->tile_start = vshi_take(work->tiles + 2, sizeof *work->tile_start, what, &result, error);
    work->tile.owner = vshi_take(side * side, sizeof *work->tile.owner, what, &result, error);
    if (result != VSH_OK) {
        return result;
    }
    size_t begin, end;
    for (size_t i = 0; i < count; ++i) {
        size_t local;
        const size_t mesh = vshi_charts_mesh(charts, number[i], &local);
        work->mesh[i] = (uint32_t)mesh;
        work->local[i] = (uint32_t)local;
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
    work->tile_triangle = vshi_take(total, sizeof *work->tile_triangle, what, &result, error);
    if (result != VSH_OK) {
        return result;
    }
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
    free(work->local);
    free(work->mesh);
    free(work->triangle);
    *work = (vshi_row){0};
}

static void count_overlap(const vshi_overlaps *overlaps, size_t mesh, uint64_t texels) {
    if (texels != 0) {
        atomic_fetch_add_explicit(&overlaps->texels[mesh], (size_t)__builtin_popcountll(texels),
                                  memory_order_relaxed);
    }
}

void vshi_row_tile(const vshi_charts *charts, vshi_row *work, size_t column, const vshi_overlaps *overlaps) {
    const uint32_t *slot = work->tile_triangle + work->tile_start[column];
    const size_t count = work->tile_start[column + 1] - work->tile_start[column];
    vshi_tile_begin(&charts->raster, column, work->row, &work->tile);
    size_t mesh = 0;
    uint64_t doubled = 0; /* texels that this mesh covers again, each counted once */
    for (size_t i = 0; i < count; ++i) {
        const uint32_t s = slot[i];
        const uint64_t overlap = vshi_tile_cover(&charts->raster, &work->triangle[s], s + 1, &work->tile);
        if (overlaps == NULL || overlap == 0) {
            continue;
        }
        if (work->mesh[s] != mesh) {
            count_overlap(overlaps, mesh, doubled);
            mesh = work->mesh[s];
            doubled = 0;
        }
        doubled |= overlap;
        atomic_store_explicit(&overlaps->triangles[charts->first[mesh] + work->local[s]], 1,
                              memory_order_relaxed);
    }
    if (overlaps != NULL) {
        count_overlap(overlaps, mesh, doubled);
    }
    for (size_t i = 0; i < count; ++i) {
        const uint32_t s = slot[i];
        vshi_tile_touch(&charts->raster, &work->triangle[s], s + 1, &work->tile);
    }
}
