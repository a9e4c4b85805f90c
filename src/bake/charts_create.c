/* Charts: checked, sorted into tiles, and counted. */
#include "bake/texels.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "mesh/mesh.h"
#include "mesh/mesh_set.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    MAX_PADDING = 4096,
    AUTO_PADDING = 16 /* texels: half of the gap between charts that four mip levels keep apart, and more */
};

static vsh_result check_range(int32_t value, int32_t low, int32_t high, const char *name, vsh_error *error) {
    if (value < low || value > high) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap %s %d: expected %d … %d", name, value, low,
                         high);
    }
    return VSH_OK;
}

static vsh_result check_options(const vsh_lightmap_options *options, vsh_error *error) {
    VSHI_TRY(check_range(options->width, 1, VSH_MAX_LIGHTMAP_SIZE, "width", error));
    VSHI_TRY(check_range(options->height, 1, VSH_MAX_LIGHTMAP_SIZE, "height", error));
    VSHI_TRY(check_range(options->supersample, 1, VSHI_MAX_SUPERSAMPLE, "supersample", error));
    VSHI_TRY(check_range(options->padding, VSH_PADDING_AUTO, MAX_PADDING, "padding", error));
    const int32_t spacing = options->ao_spacing;
    if (spacing != 1 && spacing != 2 && spacing != 4 && spacing != 8) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap ao_spacing %d: expected 1, 2, 4 or 8", spacing);
    }
    return VSH_OK;
}

/* --- counting */

typedef struct counting {
    vsh_charts *charts;
    vshi_overlaps overlaps;
    _Atomic uint64_t covered;
} counting;

static void count_cell(const counting *all, const vshi_cell *cell, size_t number, uint64_t *covered) {
    const size_t side = (size_t)VSHI_CELL * (size_t)all->charts->sorted.raster.supersample;
    uint64_t samples = (uint64_t)__builtin_popcountll(cell->border);
    for (size_t i = 0; i < side * side; ++i) {
        samples += cell->owner[i] != 0;
    }
    all->charts->samples[number] += samples;
    *covered += (uint64_t)__builtin_popcountll(cell->border | cell->covered);
}

/* Rasterizes a tile to count texels that triangles cover twice, and its samples unless `owners` are wanted.
 */
static vsh_result count_tile(void *user, size_t number, vsh_error *error) {
    counting *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    vshi_tile tile;
    uint64_t covered = 0;
    const vsh_result result = vshi_tile_open(sorted, number, &tile, error);
    for (int32_t k = 0; result == VSH_OK && k < VSHI_TILE_CELLS * VSHI_TILE_CELLS; ++k) {
        if (vshi_tile_rasterize(sorted, &tile, k % VSHI_TILE_CELLS, k / VSHI_TILE_CELLS, &all->overlaps) &&
            all->overlaps.owners == NULL) {
            count_cell(all, &tile.cell, number, &covered);
        }
    }
    atomic_fetch_add(&all->covered, covered);
    vshi_tile_close(&tile);
    return result;
}

static vsh_result count_all(counting *all, vshi_job *job, vsh_error *error) {
    return vshi_parallel_each(job, vshi_charts_tiles(&all->charts->sorted), 1, 1, count_tile, all, error);
}

static vsh_result count(counting *all, const vsh_run *run, vshi_job *job, vsh_error *error) {
    vsh_charts *charts = all->charts;
    const vshi_charts *sorted = &charts->sorted;
    const double triangles = (double)sorted->first[sorted->mesh_count];
    VSHI_TRY(vshi_check_limit(run,
                              (double)charts->info.bytes + triangles + vshi_tile_bytes(sorted, run->threads),
                              "texels", error));
    VSHI_TRY(count_all(all, job, error));
    for (size_t tile = 0; tile < vshi_charts_tiles(sorted); ++tile) {
        charts->info.samples += charts->samples[tile];
    }
    charts->info.covered = atomic_load(&all->covered);
    return VSH_OK;
}

/* --- overlaps */

/* Finds whose texels are covered again by the mesh that overlaps other objects most. Rasterises again, since
 * counts for all pairs of meshes would be too many. */
static vsh_result find_owners(counting *all, vshi_job *job, vsh_uv_report *reports, vsh_error *error) {
    const size_t count = all->charts->sorted.mesh_count;
    size_t worst = 0, owner = 0;
    for (size_t m = 0; m < count; ++m) {
        reports[m].other_mesh = SIZE_MAX;
        worst = reports[m].other_texels > reports[worst].other_texels ? m : worst;
    }
    if (reports[worst].other_texels == 0) {
        return VSH_OK;
    }
    vsh_result result;
    counting again = {.charts = all->charts, .overlaps = {.watched = worst}};
    VSHI_TRY_DONE(vshi_allocate((void *)&again.overlaps.owners, count, sizeof *again.overlaps.owners,
                                "overlaps", error));
    VSHI_TRY_DONE(count_all(&again, job, error));
    for (size_t m = 0; m < count; ++m) {
        owner = again.overlaps.owners[m] > again.overlaps.owners[owner] ? m : owner;
    }
    reports[worst].other_mesh = owner;
    reports[worst].other_mesh_texels = again.overlaps.owners[owner];
done:
    free(again.overlaps.owners);
    return result;
}

static void take_overlaps(const counting *all, vsh_uv_report *reports) {
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t m = 0; m < sorted->mesh_count; ++m) {
        vsh_uv_report *report = &reports[m];
        report->overlap_texels = atomic_load(&all->overlaps.texels[m]);
        report->other_texels = atomic_load(&all->overlaps.others[m]);
        for (size_t i = sorted->first[m]; i < sorted->first[m + 1]; ++i) {
            report->overlap_triangles += atomic_load(&all->overlaps.triangles[i]);
        }
    }
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

/* Which triangles are sheets: as was found where all casters are known, else of these meshes alone. */
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
        VSHI_TRY(vshi_job_advance(job, 0) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    return VSH_OK;
}

static void find_bounds(vsh_charts *charts) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t m = 0; m < charts->sorted.mesh_count; ++m) {
        const vsh_mesh *mesh = &charts->sorted.meshes[m];
        for (size_t v = 0; v < mesh->vertex_count; ++v) {
            const vshi_vec p = vshi_transform_point(mesh->transform, vshi_vec_off(mesh->positions + 3 * v));
            const double at[3] = {p.x, p.y, p.z};
            for (int k = 0; k < 3; ++k) {
                low[k] = fmin(low[k], at[k]);
                high[k] = fmax(high[k], at[k]);
            }
        }
    }
    for (int k = 0; k < 3 && low[0] <= high[0]; ++k) {
        charts->centre[k] = 0.5 * (low[k] + high[k]);
        charts->info.bounds_min[k] = low[k];
        charts->info.bounds_max[k] = high[k];
    }
}

static vsh_result make(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                       const vsh_run *run, vshi_job *job, vsh_uv_report *reports, vsh_charts *charts,
                       vsh_error *error) {
    counting all = {.charts = charts};
    const vshi_raster raster = {options->width, options->height, options->supersample};
    vshi_charts *sorted = &charts->sorted;
    vshi_mesh_set set;
    vsh_result result;
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, mesh_count, &set, error));
    VSHI_TRY_DONE(vshi_charts_create(meshes, mesh_count, raster, run, job, reports, sorted, error));
    VSHI_TRY_DONE(find_sheets(charts, &set, job, run, error));
    find_bounds(charts);
    const size_t tiles = vshi_charts_tiles(sorted);
    VSHI_TRY_DONE(vshi_allocate((void **)&charts->samples, tiles, sizeof *charts->samples, "texels", error));
    charts->info.bytes =
        sizeof *charts + sorted->bytes + sorted->first[mesh_count] + tiles * sizeof *charts->samples;
    VSHI_TRY_DONE(vshi_allocate((void *)&all.overlaps.texels, mesh_count, sizeof *all.overlaps.texels,
                                "overlaps", error));
    VSHI_TRY_DONE(vshi_allocate((void *)&all.overlaps.others, mesh_count, sizeof *all.overlaps.others,
                                "overlaps", error));
    VSHI_TRY_DONE(vshi_allocate((void *)&all.overlaps.triangles, sorted->first[mesh_count],
                                sizeof *all.overlaps.triangles, "overlaps", error));
    VSHI_TRY_DONE(count(&all, run, job, error));
    take_overlaps(&all, reports);
    VSHI_TRY_DONE(find_owners(&all, job, reports, error));
    for (size_t m = 0; m < mesh_count; ++m) {
        vshi_warn_mesh_uvs("", &meshes[m], m, &reports[m], run);
    }
done:
    vshi_mesh_set_free(&set);
    free(all.overlaps.triangles);
    free(all.overlaps.others);
    free(all.overlaps.texels);
    return result;
}

static vsh_result create(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                         const vsh_run *run, vsh_uv_report *uv_reports, vsh_charts **charts,
                         vsh_error *error) {
    *charts = NULL;
    vsh_lightmap_options full = vsh_lightmap_options_default();
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_lightmap_options", error));
    VSHI_TRY(check_options(&full, error));
    if (mesh_count == 0 || mesh_count > VSHI_MOST_MESHES) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap of %zu meshes: expected 1 … %d", mesh_count,
                         VSHI_MOST_MESHES);
    }
    vsh_uv_report *reports = NULL;
    vsh_charts *made = NULL;
    vshi_job *job = vshi_job_begin(
        run, "charts", ((size_t)full.width / VSHI_TILE + 1) * ((size_t)full.height / VSHI_TILE + 1));
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&reports, mesh_count, sizeof *reports, "UV reports", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "texels", error));
    made->info.width = full.width;
    made->info.height = full.height;
    made->fills = full.padding == VSH_PADDING_AUTO;
    made->padding = made->fills ? AUTO_PADDING : full.padding;
    made->ao_spacing = full.supersample == 1 ? full.ao_spacing : 1;
    made->tangents = full.tangents != 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        made->smooth = made->smooth || meshes[m].normals != NULL;
    }
    made->shade = full.shade;
    VSHI_TRY_DONE(make(meshes, mesh_count, &full, run, job, reports, made, error));
    if (uv_reports != NULL && mesh_count > 0) {
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
    VSHI_NEEDS(charts);
    *charts = NULL;
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return create(meshes, mesh_count, options, &full, uv_reports, charts, error);
}

void vsh_charts_free(vsh_charts *charts) {
    if (charts == NULL) {
        return;
    }
    free(charts->sheet);
    free(charts->samples);
    vshi_charts_free(&charts->sorted);
    free(charts);
}

void vsh_charts_get_info(const vsh_charts *charts, vsh_charts_info *info) {
    *info = charts->info;
}
