#include "bake/charts.h"
#include "base/memory.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdlib.h>

/* Room for a coordinate's rounding before it counts as outside the unit square. */
static const double OUTSIDE_TOLERANCE = 1e-6;

enum { POLL_TRIANGLES = 65536 }; /* between two looks at the cancel flag: a few ms */

static vsh_result check_uvs(const vsh_mesh *mesh, size_t index, vsh_error *error) {
    if (mesh->triangle_count == 0) {
        return VSH_OK;
    }
    if (mesh->uvs == NULL) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s has no lightmap UVs: choose a UV set that it has, or unwrap it",
                         vshi_mesh_label(mesh, index).text);
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v) {
        const float *uv = mesh->uvs + 2 * v;
        if (!isfinite(uv[0]) || !isfinite(uv[1])) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: vertex %zu: UV (%g, %g) is not finite",
                             vshi_mesh_label(mesh, index).text, v, (double)uv[0], (double)uv[1]);
        }
    }
    return VSH_OK;
}

static void uvs_of(const vsh_mesh *mesh, size_t local, const float *uv[3]) {
    for (int k = 0; k < 3; ++k) {
        uv[k] = mesh->uvs + 2 * (size_t)mesh->indices[3 * local + (size_t)k];
    }
}

bool vshi_charts_triangle(const vshi_charts *charts, size_t mesh, size_t local, vshi_uv_triangle *triangle) {
    const float *uv[3];
    uvs_of(&charts->meshes[mesh], local, uv);
    return vshi_uv_triangle_set(&charts->raster, uv, triangle) &&
           !vshi_mesh_degenerate(&charts->meshes[mesh], local);
}

static bool is_outside(const vsh_mesh *mesh, size_t local) {
    const float *uv[3];
    uvs_of(mesh, local, uv);
    for (int k = 0; k < 6; ++k) {
        const double x = uv[k / 2][k % 2];
        if (x < -OUTSIDE_TOLERANCE || x > 1.0 + OUTSIDE_TOLERANCE) {
            return true;
        }
    }
    return false;
}

/* Columns of tiles first … last that a triangle reaches in a row of tiles, with the cells around both; false:
 * none. */
static bool find_columns(const vshi_charts *charts, const vshi_uv_triangle *triangle, size_t row,
                         const size_t cell_rows[2], size_t columns[2]) {
    const size_t begin = row * VSHI_TILE_CELLS, end = begin + VSHI_TILE_CELLS + 1;
    size_t left = SIZE_MAX, right = 0;
    for (size_t y = begin > cell_rows[0] + 1 ? begin - 1 : cell_rows[0]; y < end && y < cell_rows[1]; ++y) {
        size_t first, last;
        vshi_uv_cells(&charts->raster, triangle, y, &first, &last);
        left = first < last && first < left ? first : left;
        right = first < last && last > right ? last : right;
    }
    if (left >= right) {
        return false;
    }
    columns[0] = left > 0 ? (left - 1) / VSHI_TILE_CELLS : 0;
    columns[1] = right / VSHI_TILE_CELLS;
    columns[1] = columns[1] < charts->columns ? columns[1] : charts->columns - 1;
    return true;
}

/* Counts a triangle in the tiles that it reaches, or (`fill`) puts it there. */
static void put_triangle(vshi_charts *charts, const vshi_uv_triangle *triangle, size_t number, bool fill) {
    size_t cells[2], columns[2];
    if (!vshi_uv_cell_rows(&charts->raster, triangle, &cells[0], &cells[1])) {
        return;
    }
    const size_t first = cells[0] > 0 ? (cells[0] - 1) / VSHI_TILE_CELLS : 0;
    for (size_t row = first; row <= cells[1] / VSHI_TILE_CELLS && row < charts->rows; ++row) {
        if (!find_columns(charts, triangle, row, cells, columns)) {
            continue;
        }
        for (size_t column = columns[0]; column <= columns[1]; ++column) {
            const size_t place = charts->tile_start[row * charts->columns + column + 1]++;
            if (fill) {
                charts->tile_triangle[place] = (uint32_t)number;
            }
        }
    }
}

/* Counts (fill false) or stores the triangles of each tile. While it fills, tile_start[t] is the end of the
 * triangles that tile t - 1 holds so far; the caller has shifted it by one. */
static vsh_result sort_triangles(vshi_charts *charts, bool fill, vshi_job *job, vsh_uv_report *reports,
                                 vsh_error *error) {
    for (size_t m = 0; m < charts->mesh_count; ++m) {
        const vsh_mesh *mesh = &charts->meshes[m];
        for (size_t i = 0; i < mesh->triangle_count; ++i) {
            if (i % POLL_TRIANGLES == 0 && vshi_job_advance(job, 0)) {
                return vshi_job_fail_cancelled(job, error);
            }
            vshi_uv_triangle triangle;
            const bool used = vshi_charts_triangle(charts, m, i, &triangle);
            if (!fill) {
                const bool solid = used || !vshi_mesh_degenerate(mesh, i);
                reports[m].degenerate_triangles += solid && !used;
                reports[m].outside_triangles += solid && is_outside(mesh, i);
            }
            if (used) {
                put_triangle(charts, &triangle, charts->first[m] + i, fill);
            }
        }
    }
    return VSH_OK;
}

vsh_result vshi_charts_create(const vsh_mesh *meshes, size_t mesh_count, vshi_raster raster,
                              const vsh_run *run, vshi_job *job, vsh_uv_report *reports, vshi_charts *charts,
                              vsh_error *error) {
    *charts = (vshi_charts){.meshes = meshes, .mesh_count = mesh_count, .raster = raster};
    charts->columns = ((size_t)raster.width + VSHI_TILE - 1) / VSHI_TILE;
    charts->rows = ((size_t)raster.height + VSHI_TILE - 1) / VSHI_TILE;
    const size_t tiles = vshi_charts_tiles(charts);
    VSHI_TRY(
        vshi_allocate((void **)&charts->first, mesh_count + 1, sizeof *charts->first, "mesh list", error));
    for (size_t m = 0; m < mesh_count; ++m) {
        VSHI_TRY(check_uvs(&meshes[m], m, error));
        if (meshes[m].triangle_count > UINT32_MAX - 1 - charts->first[m]) {
            return vshi_fail(error, VSH_ERROR_LIMIT, "%s: triangle %zu of the receiver, over the limit of %u",
                             vshi_mesh_label(&meshes[m], m).text, charts->first[m] + meshes[m].triangle_count,
                             UINT32_MAX - 1);
        }
        charts->first[m + 1] = charts->first[m] + meshes[m].triangle_count;
    }
    /* One more than the starts: filling moves each start on to its end, which is the next one's start. */
    VSHI_TRY(
        vshi_allocate((void **)&charts->tile_start, tiles + 2, sizeof *charts->tile_start, "tiles", error));
    VSHI_TRY(sort_triangles(charts, false, job, reports, error));
    size_t total = 0;
    for (size_t tile = 0; tile <= tiles; ++tile) {
        const size_t count = charts->tile_start[tile + 1];
        charts->tile_start[tile + 1] = total;
        total += tile < tiles ? count : 0;
    }
    charts->bytes = (mesh_count + tiles + 3) * sizeof(size_t) + total * sizeof *charts->tile_triangle;
    VSHI_TRY(vshi_check_limit(run, (double)charts->bytes, "lightmap triangles", error));
    VSHI_TRY(vshi_allocate((void **)&charts->tile_triangle, total, sizeof *charts->tile_triangle,
                           "lightmap triangles", error));
    return sort_triangles(charts, true, job, reports, error);
}

void vshi_charts_free(vshi_charts *charts) {
    free(charts->tile_triangle);
    free(charts->tile_start);
    free(charts->first);
    *charts = (vshi_charts){0};
}

size_t vshi_charts_mesh(const vshi_charts *charts, size_t triangle, size_t *local) {
    size_t low = 0, high = charts->mesh_count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (charts->first[middle] <= triangle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    *local = triangle - charts->first[low];
    return low;
}
