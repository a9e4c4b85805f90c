#include "bake/charts.h"
#include "base/memory.h"
#include "base/try.h"
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

/* Counts (fill false) or stores the triangles of each row. While it fills, row_start[r] is the end of what
 * row r - 1 … has been given so far; the caller has shifted it by one. */
static vsh_result sort_rows(vshi_charts *charts, bool fill, vshi_job *job, vsh_uv_report *reports,
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
            size_t begin, end;
            if (!used || !vshi_uv_tile_rows(&charts->raster, &triangle, &begin, &end)) {
                continue;
            }
            for (size_t row = begin; row < end; ++row) {
                const size_t place = charts->row_start[row + 1]++;
                if (fill) {
                    charts->row_triangle[place] = (uint32_t)(charts->first[m] + i);
                }
            }
        }
    }
    return VSH_OK;
}

vsh_result vshi_charts_create(const vsh_mesh *meshes, size_t mesh_count, vshi_raster raster,
                              const vsh_run *run, vshi_job *job, vsh_uv_report *reports, vshi_charts *charts,
                              vsh_error *error) {
    *charts = (vshi_charts){.meshes = meshes, .mesh_count = mesh_count, .raster = raster};
    charts->rows = ((size_t)raster.height + VSHI_TILE - 1) / VSHI_TILE;
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
    VSHI_TRY(vshi_allocate((void **)&charts->row_start, charts->rows + 2, sizeof *charts->row_start,
                           "tile rows", error));
    VSHI_TRY(sort_rows(charts, false, job, reports, error));
    size_t total = 0;
    for (size_t row = 0; row <= charts->rows; ++row) {
        const size_t count = charts->row_start[row + 1];
        charts->row_start[row + 1] = total;
        total += row < charts->rows ? count : 0;
    }
    charts->bytes = (mesh_count + charts->rows + 3) * sizeof(size_t) + total * sizeof *charts->row_triangle;
    VSHI_TRY(vshi_check_limit(run, (double)charts->bytes, "lightmap triangles", error));
    VSHI_TRY(vshi_allocate((void **)&charts->row_triangle, total, sizeof *charts->row_triangle,
                           "lightmap triangles", error));
    return sort_rows(charts, true, job, reports, error);
}

void vshi_charts_free(vshi_charts *charts) {
    free(charts->row_triangle);
    free(charts->row_start);
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
