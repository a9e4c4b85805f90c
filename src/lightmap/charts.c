/* Charts: triangles checked, sorted into tiles, and counted. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "geometry/mesh_set.h"
#include "lightmap/texels.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MAX_PADDING = 4096,
    AUTO_PADDING = 16,     /* texels: more than half of the gap that four mip levels keep between charts */
    POLL_TRIANGLES = 65536 /* between two looks at the cancel flag: a few ms */
};

/* A coordinate may leave the unit square by this much, for its rounding. */
static const double OUTSIDE_TOLERANCE = 1e-6;

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

/* Finds the columns of tiles first … last that a triangle reaches in a row of tiles, with the cells around
 * both. False: none. */
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

/* Counts a triangle in the tiles that it reaches, or (`fill`) adds it there. */
static void add_triangle(vshi_charts *charts, const vshi_uv_triangle *triangle, size_t number, bool fill) {
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

/* Counts or (`fill`) stores the triangles of each tile. While it fills, tile_start[t] is the end of the
 * triangles that tile t - 1 holds so far: the caller has shifted it by one. */
static vsh_result sort_triangles(vshi_charts *charts, bool fill, vshi_job *job, vsh_uv_report *reports,
                                 vsh_error *error) {
    for (size_t m = 0; m < charts->mesh_count; ++m) {
        const vsh_mesh *mesh = &charts->meshes[m];
        for (size_t i = 0; i < mesh->triangle_count; ++i) {
            VSHI_TRY(i % POLL_TRIANGLES == 0 ? vshi_job_step(job, 0, error) : VSH_OK);
            vshi_uv_triangle triangle;
            const bool used = vshi_charts_triangle(charts, m, i, &triangle);
            if (!fill) {
                const bool solid = used || !vshi_mesh_degenerate(mesh, i);
                reports[m].degenerate_triangles += solid && !used;
                reports[m].outside_triangles += solid && is_outside(mesh, i);
            }
            if (used) {
                add_triangle(charts, &triangle, charts->first[m] + i, fill);
            }
        }
    }
    return VSH_OK;
}

/* Sorts the triangles into tiles, and counts outside and degenerate ones. Errors: VSH_ERROR_INPUT,
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
static vsh_result sort_charts(vsh_charts *made, const vsh_run *run, vshi_job *job, vsh_uv_report *reports,
                              vsh_error *error) {
    vshi_charts *charts = &made->sorted;
    const size_t mesh_count = charts->mesh_count;
    const bool points = charts->raster.width == 0;
    VSHI_TRY(vshi_allocate((void **)&charts->first, mesh_count + 1, sizeof *charts->first, "tiles", error));
    for (size_t m = 0; m < mesh_count; ++m) {
        const vsh_mesh *mesh = &charts->meshes[m];
        VSHI_TRY(points ? VSH_OK : check_uvs(mesh, m, error));
        if (mesh->triangle_count > UINT32_MAX - 1 - charts->first[m]) {
            return vshi_fail(error, VSH_ERROR_LIMIT, "%s: triangle %zu of the receiver, over the limit of %u",
                             vshi_mesh_label(mesh, m).text, charts->first[m] + mesh->triangle_count,
                             UINT32_MAX - 1);
        }
        charts->first[m + 1] = charts->first[m] + mesh->triangle_count;
    }
    VSHI_TRY(points ? vshi_points_spread(made, error) : VSH_OK);
    charts->columns = ((size_t)charts->raster.width + VSHI_TILE - 1) / VSHI_TILE;
    charts->rows = ((size_t)charts->raster.height + VSHI_TILE - 1) / VSHI_TILE;
    const size_t tiles = vshi_charts_tiles(charts);
    /* one more than the starts: filling moves each start on to its end, which is the next one's start */
    VSHI_TRY(
        vshi_allocate((void **)&charts->tile_start, tiles + 2, sizeof *charts->tile_start, "tiles", error));
    if (points) {
        charts->bytes = (charts->first[mesh_count] + tiles) * sizeof(size_t);
        return VSH_OK;
    }
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

size_t vshi_charts_mesh(const vshi_charts *charts, size_t triangle, size_t *local) {
    const size_t mesh = vshi_find_group(charts->first, charts->mesh_count, triangle);
    *local = triangle - charts->first[mesh];
    return mesh;
}

/* --- counting */

typedef struct counting {
    vsh_charts *charts;
    vshi_overlaps overlaps;
    _Atomic uint64_t covered;
} counting;

/* Rasterizes a tile to count texels that triangles cover twice, and its samples unless a mesh is watched. */
static vsh_result count_tile(void *user, size_t number, vsh_error *error) {
    counting *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    const size_t side = (size_t)VSHI_CELL * (size_t)sorted->raster.supersample;
    vshi_tile tile;
    if (all->charts->points != NULL) {
        all->charts->samples[number] = vshi_points_in_tile(all->charts, number);
        atomic_fetch_add(&all->covered, all->charts->samples[number]);
        return VSH_OK;
    }
    const vsh_result result = vshi_tile_open(sorted, number, &tile, error);
    for (int32_t k = 0; result == VSH_OK && k < VSHI_TILE_CELLS * VSHI_TILE_CELLS; ++k) {
        if (!vshi_tile_rasterize(sorted, &tile, k % VSHI_TILE_CELLS, k / VSHI_TILE_CELLS, &all->overlaps) ||
            all->overlaps.watched != SIZE_MAX) {
            continue;
        }
        uint64_t samples = (uint64_t)__builtin_popcountll(tile.cell.border);
        for (size_t i = 0; i < side * side; ++i) {
            samples += tile.cell.owner[i] != 0;
        }
        all->charts->samples[number] += samples;
        atomic_fetch_add(&all->covered, (uint64_t)__builtin_popcountll(tile.cell.border | tile.cell.covered));
    }
    vshi_tile_close(&tile);
    return result;
}

/* --- overlaps */

/* Finds the mesh whose texels the worst overlapping mesh covers again. It rasterizes again, since counts for
 * all pairs of meshes would be too many. */
static vsh_result find_owners(counting *all, vshi_job *job, vsh_uv_report *reports, vsh_error *error) {
    const vshi_charts *sorted = &all->charts->sorted;
    const _Atomic size_t *owners = all->overlaps.owners;
    size_t worst = 0, owner = 0;
    for (size_t m = 0; m < sorted->mesh_count; ++m) {
        reports[m].other_mesh = SIZE_MAX;
        worst = reports[m].other_texels > reports[worst].other_texels ? m : worst;
    }
    if (reports[worst].other_texels == 0) {
        return VSH_OK;
    }
    all->overlaps.watched = worst;
    VSHI_TRY(vshi_parallel_each(job, vshi_charts_tiles(sorted), 1, 1, count_tile, all, error));
    for (size_t m = 0; m < sorted->mesh_count; ++m) {
        owner = owners[m] > owners[owner] ? m : owner;
    }
    reports[worst].other_mesh = owner;
    reports[worst].other_mesh_texels = owners[owner];
    return VSH_OK;
}

void vshi_warn_mesh_uvs(const char *file, const vsh_mesh *mesh, size_t index, const vsh_uv_report *uv,
                        const vsh_run *run) {
    const vshi_mesh_name label = vshi_mesh_label(mesh, index);
    const char *name = label.text, *colon = file[0] != '\0' ? ": " : "";
    if (uv->overlap_texels > uv->other_texels) {
        vshi_warn(run,
                  "%s%s%s: %zu texels of %zu triangles lie over other charts of the same object; "
                  "unwrap it anew",
                  file, colon, name, uv->overlap_texels - uv->other_texels, uv->overlap_triangles);
    }
    if (uv->other_texels > 0) {
        vshi_warn(run, "%s%s%s: %zu texels lie over charts of other objects; use --per-object or one atlas",
                  file, colon, name, uv->other_texels);
    }
    if (uv->outside_triangles > 0) {
        vshi_warn(run,
                  "%s%s%s: %zu triangles leave the UV square; the parts outside are not baked; "
                  "--uv-set N chooses another set",
                  file, colon, name, uv->outside_triangles);
    }
    if (uv->degenerate_triangles > 0) {
        vshi_warn(run, "%s%s%s: %zu triangles have no area in the UV set and are not baked; unwrap them",
                  file, colon, name, uv->degenerate_triangles);
    }
}

/* Finds the triangles that are sheets: as known for all casters, else of these meshes alone. */
static vsh_result find_sheets(vsh_charts *charts, vshi_mesh_set *set, vshi_job *job, const vsh_run *run,
                              vsh_error *error) {
    bool known = true;
    for (size_t m = 0; m < set->count; ++m) {
        known = known && vshi_mesh_sides(&set->meshes[m]) != NULL;
    }
    if (!known) {
        VSHI_TRY(vshi_mesh_set_solve(set, run, error));
    }
    const size_t *first = charts->sorted.first;
    VSHI_TRY(vshi_allocate((void **)&charts->sheet, first[set->count], 1, "texels", error));
    for (size_t m = 0; m < set->count; ++m) {
        const uint8_t *sides = vshi_mesh_sides(&set->meshes[m]);
        for (size_t i = 0; i < set->meshes[m].triangle_count; ++i) {
            charts->sheet[first[m] + i] = sides[i] == VSHI_SIDE_SHEET;
        }
        VSHI_TRY(vshi_job_step(job, 0, error));
    }
    return VSH_OK;
}

static void find_bounds(vsh_charts *charts) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t m = 0; m < charts->sorted.mesh_count; ++m) {
        const vsh_mesh *mesh = &charts->sorted.meshes[m];
        for (size_t v = 0; v < mesh->vertex_count; ++v) {
            vshi_grow_box(low, high, vshi_mesh_place(mesh, v));
        }
    }
    for (int k = 0; k < 3 && low[0] <= high[0]; ++k) {
        charts->centre[k] = 0.5 * (low[k] + high[k]);
        charts->info.bounds_min[k] = low[k];
        charts->info.bounds_max[k] = high[k];
    }
}

static vsh_result check_options(const vsh_lightmap_options *options, vsh_error *error) {
    const vshi_range ranges[] = {
        {"lightmap width", options->width, 1, VSH_MAX_LIGHTMAP_SIZE},
        {"lightmap height", options->height, 1, VSH_MAX_LIGHTMAP_SIZE},
        {"lightmap supersample", options->supersample, 1, VSHI_MAX_SUPERSAMPLE},
        {"lightmap padding", options->padding, VSH_PADDING_AUTO, MAX_PADDING},
    };
    VSHI_TRY(vshi_check_ranges(ranges, sizeof ranges / sizeof ranges[0], error));
    const int32_t spacing = options->ao_spacing;
    if (spacing != 1 && spacing != 2 && spacing != 4 && spacing != 8) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap ao_spacing %d: expected 1, 2, 4 or 8", spacing);
    }
    return VSH_OK;
}

static vsh_result make(vsh_charts *charts, const vsh_run *run, vshi_job *job, vsh_uv_report *reports,
                       vsh_error *error) {
    counting all = {.charts = charts, .overlaps = {.watched = SIZE_MAX}};
    vshi_charts *sorted = &charts->sorted;
    vshi_overlaps *overlaps = &all.overlaps;
    const size_t mesh_count = sorted->mesh_count;
    vshi_mesh_set set;
    vsh_result result;
    VSHI_TRY_DONE(vshi_mesh_set_create(sorted->meshes, mesh_count, &set, error));
    VSHI_TRY_DONE(sort_charts(charts, run, job, reports, error));
    VSHI_TRY_DONE(find_sheets(charts, &set, job, run, error));
    find_bounds(charts);
    const size_t tiles = vshi_charts_tiles(sorted), triangles = sorted->first[mesh_count];
    charts->info.bytes =
        sizeof *charts + charts->tight.bytes + sorted->bytes + triangles + tiles * sizeof *charts->samples;
    const vshi_array arrays[] = {
        {(void *)&overlaps->texels, mesh_count, sizeof *overlaps->texels},
        {(void *)&overlaps->others, mesh_count, sizeof *overlaps->others},
        {(void *)&overlaps->owners, mesh_count, sizeof *overlaps->owners},
        {(void *)&overlaps->triangles, triangles, sizeof *overlaps->triangles},
    };
    VSHI_TRY_DONE(VSHI_ALLOCATE(charts->samples, tiles, "texels", error));
    VSHI_TRY_DONE(VSHI_ALLOCATE_BLOCK(arrays, "texels", error));
    VSHI_TRY_DONE(vshi_check_limit(
        run, (double)(charts->info.bytes + triangles) + vshi_tile_bytes(sorted, run->threads), "texels",
        error));
    VSHI_TRY_DONE(vshi_parallel_each(job, tiles, 1, 1, count_tile, &all, error));
    charts->info.covered = atomic_load(&all.covered);
    for (size_t tile = 0; tile < tiles; ++tile) {
        charts->info.samples += charts->samples[tile];
    }
    for (size_t m = 0; m < mesh_count; ++m) {
        reports[m].overlap_texels = overlaps->texels[m];
        reports[m].other_texels = overlaps->others[m];
        for (size_t i = sorted->first[m]; i < sorted->first[m + 1]; ++i) {
            reports[m].overlap_triangles += overlaps->triangles[i];
        }
    }
    VSHI_TRY_DONE(find_owners(&all, job, reports, error));
    for (size_t m = 0; m < mesh_count; ++m) {
        vshi_warn_mesh_uvs("", &sorted->meshes[m], m, &reports[m], run);
    }
done:
    vshi_mesh_set_free(&set);
    free(overlaps->texels); /* the block's first array */
    return result;
}

vsh_result vshi_charts_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                              const vsh_run *run, vsh_uv_report *uv_reports, vsh_charts **charts,
                              vsh_error *error) {
    vsh_uv_report *reports = NULL;
    vsh_charts *made = NULL;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&reports, mesh_count, sizeof *reports, "UV reports", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "texels", error));
    const size_t columns = (size_t)options->width / VSHI_TILE + 1,
                 rows = (size_t)options->height / VSHI_TILE + 1;
    VSHI_TRY_DONE(vshi_job_open(&job, run, "charts", columns * rows, "charts", error));
    made->info.width = options->width;
    made->info.height = options->height;
    VSHI_TRY_DONE(vshi_meshes_tighten(meshes, mesh_count, &made->tight, error));
    made->sorted.meshes = made->tight.meshes;
    made->sorted.mesh_count = mesh_count;
    made->sorted.raster = (vshi_raster){options->width, options->height, options->supersample};
    made->fills = options->padding == VSH_PADDING_AUTO;
    made->padding = made->fills ? AUTO_PADDING : options->padding;
    made->ao_spacing = options->supersample == 1 ? options->ao_spacing : 1;
    made->tangents = options->tangents != 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        made->smooth = made->smooth || meshes[m].normals != NULL;
    }
    made->shade = options->shade;
    VSHI_TRY_DONE(make(made, run, job, reports, error));
    if (uv_reports != NULL) {
        memcpy(uv_reports, reports, mesh_count * sizeof *reports);
    }
    *charts = made;
    made = NULL;
done:
    vsh_charts_free(made);
    free(reports);
    vshi_job_end(job);
    return result;
}

vsh_result vsh_charts_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                             const vsh_run *run, vsh_uv_report *uv_reports, vsh_charts **charts,
                             vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(charts);
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full_run;
    VSHI_TRY(vshi_run_resolve(run, &full_run, error));
    vsh_lightmap_options full = vsh_lightmap_options_default();
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_lightmap_options", error));
    VSHI_TRY(check_options(&full, error));
    if (mesh_count == 0 || mesh_count > VSHI_MOST_MESHES) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap of %zu meshes: expected 1 … %d", mesh_count,
                         VSHI_MOST_MESHES);
    }
    return vshi_charts_create(meshes, mesh_count, &full, &full_run, uv_reports, charts, error);
}

void vsh_charts_free(vsh_charts *charts) {
    if (charts == NULL) {
        return;
    }
    free(charts->points);
    free(charts->sheet);
    free(charts->samples);
    free(charts->sorted.tile_triangle);
    free(charts->sorted.tile_start);
    free(charts->sorted.first);
    free(charts->tight.memory);
    free(charts);
}

void vsh_charts_get_info(const vsh_charts *charts, vsh_charts_info *info) {
    *info = charts->info;
}
