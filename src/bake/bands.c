/* Charts that are counted once, and cut into bands of rows. */
#include "bake/ao_texels.h"
#include "bake/nearest_valid.h"
#include "bake/origins.h"
#include "bake/padding.h"
#include "bake/planes.h"
#include "bake/pull_push.h"
#include "bake/rows.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "mesh/mesh_set.h"
#include "shade/layers.h"

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
    uint64_t most_samples;         /* that the memory limit allows */
    _Atomic uint64_t samples;      /* counted so far */
    _Atomic vsh_result row_result; /* of the rows that failed */
} counting;

/* Texels of a tile beside those given. */
static uint64_t beside(uint64_t texels) {
    static const uint64_t FIRST_COLUMN = UINT64_C(0x0101010101010101);
    return texels << VSHI_TILE | texels >> VSHI_TILE | (texels & ~(FIRST_COLUMN << 7)) << 1 |
           (texels & ~FIRST_COLUMN) >> 1;
}

static void count_rows(void *user, size_t begin, size_t end) {
    counting *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    const size_t side = (size_t)VSHI_TILE * (size_t)sorted->raster.supersample;
    for (size_t row = begin; row < end; ++row) {
        vshi_tile_row *total = &all->charts->rows[row];
        vshi_row work;
        if (atomic_load(&all->samples) > all->most_samples) {
            atomic_store(&all->row_result, VSH_ERROR_LIMIT);
            continue;
        }
        const vsh_result result = vshi_row_open(sorted, row, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&all->row_result, result);
            vshi_row_close(&work);
            continue;
        }
        for (size_t column = 0; column < work.tiles; ++column) {
            if (work.tile_start[column] == work.tile_start[column + 1]) {
                continue;
            }
            vshi_row_tile(sorted, &work, column, &all->overlaps);
            size_t samples = (size_t)__builtin_popcountll(work.tile.border);
            for (size_t i = 0; i < side * side; ++i) {
                samples += work.tile.owner[i] != 0;
            }
            total->samples += samples;
            const uint64_t covered = work.tile.border | work.tile.covered;
            total->texels += (size_t)__builtin_popcountll(covered);
            total->edges += (size_t)__builtin_popcountll(covered & beside(~covered));
        }
        vshi_row_close(&work);
        atomic_fetch_add(&all->samples, total->samples);
    }
}

/* Texels that the triangles would cover if none overlapped, at most the whole image: for the message. */
static double estimate_samples(const vshi_charts *sorted) {
    const vshi_raster *raster = &sorted->raster;
    const double image = (double)raster->width * raster->height;
    double area = 0.0;
    for (size_t i = 0; i < sorted->row_start[sorted->rows]; ++i) {
        size_t local;
        const size_t mesh = vshi_charts_mesh(sorted, sorted->row_triangle[i], &local);
        vshi_uv_triangle t;
        vshi_charts_triangle(sorted, mesh, local, &t);
        const double across = fmin(fmax(t.x[0], fmax(t.x[1], t.x[2])), raster->width) -
                              fmax(fmin(t.x[0], fmin(t.x[1], t.x[2])), 0.0);
        area += across * VSHI_TILE;
    }
    return fmin(area, image) * raster->supersample * raster->supersample;
}

/* Rasterises every row of tiles, for its samples and for what is covered twice. */
static vsh_result count(counting *all, const vsh_run *run, bool limited, vshi_job *job, vsh_error *error) {
    vsh_charts *charts = all->charts;
    vshi_charts *sorted = &charts->sorted;
    const size_t triangles = sorted->first[sorted->mesh_count];
    const double held = (double)charts->info.bytes + (double)triangles + vshi_row_bytes(sorted, run->threads);
    const double sample = (double)vshi_sample_bytes(charts->tangents);
    VSHI_TRY(vshi_check_limit(run, held, "texels", error));
    all->most_samples = !limited || run->memory_limit == 0
                            ? UINT64_MAX
                            : (uint64_t)(((double)run->memory_limit - held) / sample);
    VSHI_TRY(vshi_parallel_for(job, sorted->rows, 1, 1, count_rows, all, error));
    for (size_t row = 0; row < sorted->rows; ++row) {
        charts->info.samples += charts->rows[row].samples;
        charts->info.covered += charts->rows[row].texels;
    }
    const vsh_result result =
        charts->info.samples > all->most_samples ? VSH_ERROR_LIMIT : atomic_load(&all->row_result);
    if (result == VSH_ERROR_LIMIT) {
        const double samples = fmax(estimate_samples(sorted), (double)all->most_samples + 1.0);
        return vshi_check_limit(run, held + samples * sample, "texels", error);
    }
    return result == VSH_OK ? VSH_OK
                            : vshi_fail(error, result, "texels: the system refused memory for a row");
}

/* --- what is covered twice */

static void count_owners(void *user, size_t begin, size_t end) {
    counting *all = user;
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t row = begin; row < end; ++row) {
        vshi_row work;
        const vsh_result result = vshi_row_open(sorted, row, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&all->row_result, result);
            vshi_row_close(&work);
            continue;
        }
        for (size_t column = 0; column < work.tiles; ++column) {
            if (work.tile_start[column] != work.tile_start[column + 1]) {
                vshi_row_tile(sorted, &work, column, &all->overlaps);
            }
        }
        vshi_row_close(&work);
    }
}

/* Whose texels the mesh with the most of other objects' has: rasterised again for it alone, as a count for
 * each pair of meshes would be too many. */
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
    VSHI_TRY_DONE(vshi_parallel_for(job, all->charts->sorted.rows, 1, 0, count_owners, &again, error));
    if ((result = atomic_load(&again.row_result)) != VSH_OK) {
        vshi_fail(error, result, "texels: the system refused memory for a row");
        goto done;
    }
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

static void warn(const counting *all, const vsh_run *run, const vsh_uv_report *reports) {
    const vshi_charts *sorted = &all->charts->sorted;
    for (size_t m = 0; m < sorted->mesh_count; ++m) {
        const vsh_uv_report *report = &reports[m];
        const vshi_mesh_name label = vshi_mesh_label(&sorted->meshes[m], m);
        const char *name = label.text;
        if (report->overlap_texels > 0) {
            vshi_warn(
                run,
                "%s: %zu texels of %zu triangles overlap other charts, %zu of them those of other objects; "
                "the first triangle keeps its texels",
                name, report->overlap_texels, report->overlap_triangles, report->other_texels);
        }
        if (report->outside_triangles > 0) {
            vshi_warn(run, "%s: %zu triangles leave the UV square; the parts outside are not baked", name,
                      report->outside_triangles);
        }
        if (report->degenerate_triangles > 0) {
            vshi_warn(run, "%s: %zu triangles have no area in the lightmap UVs and are not baked", name,
                      report->degenerate_triangles);
        }
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

static vsh_result make(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                       const vsh_run *run, bool limited, vshi_job *job, vsh_uv_report *reports,
                       vsh_charts *charts, vsh_error *error) {
    counting all = {.charts = charts};
    const vshi_raster raster = {options->width, options->height, options->supersample};
    vshi_charts *sorted = &charts->sorted;
    vshi_mesh_set set;
    vsh_result result;
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, mesh_count, &set, error));
    VSHI_TRY_DONE(vshi_charts_create(meshes, mesh_count, raster, run, job, reports, sorted, error));
    VSHI_TRY_DONE(find_sheets(charts, &set, job, run, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&charts->rows, sorted->rows, sizeof *charts->rows, "texels", error));
    charts->info.bytes =
        sizeof *charts + sorted->bytes + sorted->first[mesh_count] + sorted->rows * sizeof *charts->rows;
    VSHI_TRY_DONE(vshi_allocate((void *)&all.overlaps.texels, mesh_count, sizeof *all.overlaps.texels,
                                "overlaps", error));
    VSHI_TRY_DONE(vshi_allocate((void *)&all.overlaps.others, mesh_count, sizeof *all.overlaps.others,
                                "overlaps", error));
    VSHI_TRY_DONE(vshi_allocate((void *)&all.overlaps.triangles, sorted->first[mesh_count],
                                sizeof *all.overlaps.triangles, "overlaps", error));
    VSHI_TRY_DONE(count(&all, run, limited, job, error));
    take_overlaps(&all, reports);
    VSHI_TRY_DONE(find_owners(&all, job, reports, error));
    warn(&all, run, reports);
done:
    vshi_mesh_set_free(&set);
    free(all.overlaps.triangles);
    free(all.overlaps.others);
    free(all.overlaps.texels);
    return result;
}

vsh_result vshi_charts_make(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                            const vsh_run *run, bool limited, vsh_uv_report *uv_reports, vsh_charts **charts,
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
    vshi_job *job = vshi_job_begin(run, "charts", ((size_t)full.height + VSHI_TILE - 1) / VSHI_TILE);
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
    VSHI_TRY_DONE(make(meshes, mesh_count, &full, run, limited, job, reports, made, error));
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
    return vshi_charts_make(meshes, mesh_count, options, &full, false, uv_reports, charts, error);
}

void vsh_charts_free(vsh_charts *charts) {
    if (charts == NULL) {
        return;
    }
    free(charts->sheet);
    free(charts->rows);
    vshi_charts_free(&charts->sorted);
    free(charts);
}

void vsh_charts_get_info(const vsh_charts *charts, vsh_charts_info *info) {
    *info = charts->info;
}

/* --- bands */

double vshi_bake_bytes(const vshi_bake_need *need) {
    const double texels = (double)need->width * need->rows;
    double sample = vshi_origins_sample_bytes(need->traced, need->smooth);
    const int floats = (need->values ? 1 : 0) + (need->errors ? 1 : 0) + (need->irradiance ? 3 : 0) +
                       (need->bent ? 3 : 0) + (need->tint ? 3 : 0);
    sample += (double)floats * sizeof(float);
    return need->samples * sample + texels * (1.0 + VSHI_PADDING_TEXEL_BYTES + VSHI_SPREAD_TEXEL_BYTES) +
           (need->fills ? vshi_pull_push_bytes(need->width, need->rows) : 0.0) +
           (need->windows
                ? vshi_ao_texels_bytes(need->samples, need->width, need->rows, need->threads, need->bent)
                : 0.0);
}

/* Floats a texel of all planes that are there. */
static double floats_of(const vsh_lightmap *planes, size_t light_count) {
    size_t kind_count, floats = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        if (vshi_plane_given(planes, &kinds[k])) {
            floats += vshi_plane_components(&kinds[k]) * (kinds[k].per_light ? light_count : 1);
        }
    }
    return (double)floats;
}

uint64_t vshi_charts_band_bytes(const vsh_charts *charts, int32_t first_row, int32_t rows,
                                const vshi_ao_cut *cut, const vsh_lightmap *lightmap, size_t light_count) {
    vshi_band band;
    if (charts == NULL || lightmap == NULL ||
        vshi_band_set(charts, first_row, rows, cut, &band, NULL) != VSH_OK) {
        return 0;
    }
    const double width = charts->info.width;
    vsh_shade_options shade = charts->shade;
    shade.method = vsh_shadow_method_resolve(shade.method, 1); /* the triangles may not be there yet */
    shade.ao_method = vsh_ao_method_resolve(shade.ao_method, 1);
    const bool keeps_error = (vsh_ao_method_traits(shade.ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
    vshi_bake_need need = {.width = charts->info.width,
                           .rows = band.rows,
                           .traced = vshi_shadow_traces(&shade, NULL) || vshi_ao_traces(&shade, NULL),
                           .smooth = charts->smooth,
                           .values = true,
                           .errors = lightmap->shadow_error != NULL || lightmap->ao_error != NULL,
                           .irradiance = lightmap->irradiance != NULL,
                           .bent = lightmap->bent != NULL,
                           .tint = lightmap->tint != NULL,
                           .windows = charts->ao_spacing > 1 && keeps_error,
                           .fills = charts->fills && rows == charts->info.height && cut == NULL};
    for (size_t row = band.laid_begin; row < band.laid_end; ++row) {
        need.samples += (double)charts->rows[row].samples;
    }
    const bool beside = band.rows > rows;
    const double planes =
        width * (rows + (beside ? band.rows : 0)) * floats_of(lightmap, light_count) * sizeof(float);
    return (uint64_t)(need.samples * (double)vshi_sample_bytes(charts->tangents) + vshi_bake_bytes(&need) +
                      planes);
}

uint64_t vsh_charts_band_bytes(const vsh_charts *charts, int32_t first_row, int32_t rows,
                               const vsh_lightmap *lightmap, size_t light_count) {
    return vshi_charts_band_bytes(charts, first_row, rows, NULL, lightmap, light_count);
}
