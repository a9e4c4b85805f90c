#include "bake/texels.h"
#include "bake/rows.h"
#include "bake/surface.h"
#include "bake/take.h"
#include "base/floats.h"
#include "base/parallel.h"
#include "caster/mesh.h"

#include <stdlib.h>
#include <string.h>

enum { MAX_PADDING = 4096 };

static const size_t SAMPLE_BYTES = 3 * sizeof(double) + 6 * sizeof(float) + 2 * sizeof(uint32_t);

/* What a row of tiles comes to. */
typedef struct row_total {
    size_t samples; /* then: where the row's samples begin */
    size_t texels;
    double low[3], high[3]; /* box of the positions */
} row_total;

typedef struct creation {
    vshi_charts charts;
    const vshi_overlaps *overlaps;
    row_total *rows;
    vsh_texels *texels;
    uint64_t most_samples;         /* that the memory limit allows */
    _Atomic uint64_t samples;      /* counted so far */
    _Atomic vsh_result row_result; /* of the rows that failed */
} creation;

static vsh_result check_range(int32_t value, int32_t low, int32_t high, const char *name, vsh_error *error) {
    if (value < low || value > high) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap %s %d: expected %d … %d", name, value, low,
                         high);
    }
    return VSH_OK;
}

static vsh_result check_options(const vsh_lightmap_options *options, vsh_error *error) {
    vsh_result result = check_range(options->width, 1, VSH_MAX_LIGHTMAP_SIZE, "width", error);
    if (result == VSH_OK) {
        result = check_range(options->height, 1, VSH_MAX_LIGHTMAP_SIZE, "height", error);
    }
    if (result == VSH_OK) {
        result = check_range(options->supersample, 1, VSHI_MAX_SUPERSAMPLE, "supersample", error);
    }
    if (result == VSH_OK) {
        result = check_range(options->padding, 0, MAX_PADDING, "padding", error);
    }
    const int32_t spacing = options->ao_spacing;
    if (result == VSH_OK && spacing != 1 && spacing != 2 && spacing != 4 && spacing != 8) {
        result =
            vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap ao_spacing %d: expected 1, 2, 4 or 8", spacing);
    }
    return result;
}

static void count_rows(void *user, size_t begin, size_t end) {
    creation *all = user;
    const size_t side = (size_t)VSHI_TILE * (size_t)all->charts.raster.supersample;
    for (size_t row = begin; row < end; ++row) {
        vshi_row work;
        const bool over = atomic_load(&all->samples) > all->most_samples;
        const vsh_result result = over ? VSH_ERROR_LIMIT : vshi_row_open(&all->charts, row, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&all->row_result, result);
        }
        for (size_t column = 0; result == VSH_OK && column < work.tiles; ++column) {
            if (work.tile_start[column] == work.tile_start[column + 1]) {
                continue;
            }
            vshi_row_tile(&all->charts, &work, column, all->overlaps);
            size_t samples = (size_t)__builtin_popcountll(work.tile.border);
            for (size_t i = 0; i < side * side; ++i) {
                samples += work.tile.owner[i] != 0;
            }
            all->rows[row].samples += samples;
            all->rows[row].texels += (size_t)__builtin_popcountll(work.tile.border | work.tile.covered);
        }
        if (!over) {
            vshi_row_close(&work);
        }
        atomic_fetch_add(&all->samples, all->rows[row].samples);
    }
}

/* Writes samples one after the other; neighbours are nearly always of one triangle, which stays set up. */
typedef struct writer {
    const creation *all;
    const vshi_row *work;
    row_total *total;
    size_t next;
    uint32_t number; /* triangle + 1 that is set up; 0: none */
    vshi_surface surface;
} writer;

static void write_sample(writer *w, uint32_t number, uint32_t texel, const double weight[3]) {
    vsh_texels *texels = w->all->texels;
    const uint32_t mesh = w->work->mesh[number - 1];
    if (number != w->number) {
        vshi_surface_set(&w->all->charts.meshes[mesh], w->work->local[number - 1], &w->surface);
        w->number = number;
    }
    vshi_vec position, normal;
    vshi_surface_at(&w->surface, weight, &position, &normal);
    const double p[3] = {position.x, position.y, position.z};
    const double n[3] = {normal.x, normal.y, normal.z};
    const double g[3] = {w->surface.geometric.x, w->surface.geometric.y, w->surface.geometric.z};
    const size_t i = w->next++;
    for (size_t k = 0; k < 3; ++k) {
        texels->position[3 * i + k] = p[k];
        texels->normal[3 * i + k] = (float)n[k];
        texels->geometric[3 * i + k] = (float)g[k];
        w->total->low[k] = p[k] < w->total->low[k] ? p[k] : w->total->low[k];
        w->total->high[k] = p[k] > w->total->high[k] ? p[k] : w->total->high[k];
    }
    texels->texel[i] = texel;
    texels->mesh[i] = mesh;
}

/* Every second bit of a number of six. */
static size_t even_bits(size_t number) {
    return (number & 1) | (number >> 1 & 2) | (number >> 2 & 4);
}

/* The texels of a tile in Morton's order, so that 4, 16 or all 64 that follow each other are a square. */
static void write_tile(writer *w) {
    const vshi_raster *raster = &w->all->charts.raster;
    const vshi_tile *tile = &w->work->tile;
    const size_t n = (size_t)raster->supersample, side = VSHI_TILE * n;
    for (size_t place = 0; place < (size_t)VSHI_TILE * VSHI_TILE; ++place) {
        const size_t x = even_bits(place), y = even_bits(place >> 1), bit = VSHI_TILE * y + x;
        const size_t column = tile->column * VSHI_TILE + x, row = tile->row * VSHI_TILE + y;
        const uint32_t texel = (uint32_t)(row * (size_t)raster->width + column);
        double weight[3];
        if ((tile->border >> bit) & 1) {
            const uint32_t number = tile->nearest[bit];
            vshi_uv_nearest(&w->work->triangle[number - 1], (double)column + 0.5, (double)row + 0.5, weight);
            write_sample(w, number, texel, weight);
        } else if ((tile->covered >> bit) & 1) {
            for (size_t s = 0; s < n * n; ++s) {
                const size_t sx = s % n, sy = s / n;
                const uint32_t number = tile->owner[(y * n + sy) * side + x * n + sx];
                if (number != 0) {
                    vshi_uv_barycentric(&w->work->triangle[number - 1],
                                        (double)column + ((double)sx + 0.5) / (double)n,
                                        (double)row + ((double)sy + 0.5) / (double)n, weight);
                    write_sample(w, number, texel, weight);
                }
            }
        }
    }
}

static void write_rows(void *user, size_t begin, size_t end) {
    creation *all = user;
    for (size_t row = begin; row < end; ++row) {
        row_total *total = &all->rows[row];
        for (int k = 0; k < 3; ++k) {
            total->low[k] = INFINITY;
            total->high[k] = -INFINITY;
        }
        vshi_row work;
        const vsh_result result = vshi_row_open(&all->charts, row, &work, NULL);
        if (result != VSH_OK) {
            atomic_store(&all->row_result, result);
        }
        writer w = {.all = all, .work = &work, .total = total, .next = total->samples};
        for (size_t column = 0; result == VSH_OK && column < work.tiles; ++column) {
            if (work.tile_start[column] != work.tile_start[column + 1]) {
                vshi_row_tile(&all->charts, &work, column, NULL);
                write_tile(&w);
            }
        }
        vshi_row_close(&work);
    }
}

/* Texels that the triangles would cover if none overlapped, at most the whole image: for the message. */
static double estimate_samples(const creation *all) {
    const vshi_raster *raster = &all->charts.raster;
    const double image = (double)raster->width * raster->height;
    double area = 0.0;
    for (size_t i = 0; i < all->charts.row_start[all->charts.rows]; ++i) {
        size_t local;
        const size_t mesh = vshi_charts_mesh(&all->charts, all->charts.row_triangle[i], &local);
        vshi_uv_triangle t;
        vshi_charts_triangle(&all->charts, mesh, local, &t);
        const double across = fmin(fmax(t.x[0], fmax(t.x[1], t.x[2])), raster->width) -
                              fmax(fmin(t.x[0], fmin(t.x[1], t.x[2])), 0.0);
        area += across * VSHI_TILE;
    }
    return fmin(area, image) * raster->supersample * raster->supersample;
}

static vsh_result rows_result(const creation *all, const vsh_run *run, double held, vsh_error *error) {
    const vsh_result result = atomic_load(&all->row_result);
    if (result == VSH_ERROR_LIMIT) {
        const double least = (double)all->most_samples + 1.0;
        return vshi_check_limit(run, held + fmax(estimate_samples(all), least) * (double)SAMPLE_BYTES,
                                "texels", error);
    }
    return result == VSH_OK ? VSH_OK
                            : vshi_fail(error, result, "texels: the system refused memory for a row");
}

/* Counts samples, takes memory for them, and fills it. */
static vsh_result rasterise(creation *all, const vsh_run *run, vshi_job *job, double held, vsh_error *error) {
    vsh_texels *texels = all->texels;
    const size_t rows = all->charts.rows;
    vsh_result result = VSH_OK;
    all->rows = vshi_take(rows, sizeof *all->rows, "texels", &result, error);
    if (result != VSH_OK) {
        return result;
    }
    held += vshi_row_bytes(&all->charts, run->threads);
    if ((result = vshi_check_limit(run, held, "texels", error)) != VSH_OK) {
        return result;
    }
    all->most_samples = run->memory_limit == 0
                            ? UINT64_MAX
                            : (uint64_t)(((double)run->memory_limit - held) / (double)SAMPLE_BYTES);
    if ((result = vshi_parallel_for(job, rows, 1, 1, count_rows, all, error)) != VSH_OK) {
        return result;
    }
    size_t count = 0;
    for (size_t row = 0; row < rows; ++row) {
        const size_t samples = all->rows[row].samples;
        all->rows[row].samples = count;
        count += samples;
        texels->info.covered += all->rows[row].texels;
    }
    if (count > all->most_samples) {
        atomic_store(&all->row_result, VSH_ERROR_LIMIT);
    }
    if ((result = rows_result(all, run, held, error)) != VSH_OK) {
        return result;
    }
    texels->position = vshi_take(count, 3 * sizeof(double), "texels", &result, error);
    texels->normal = vshi_take(count, 3 * sizeof(float), "texels", &result, error);
    texels->geometric = vshi_take(count, 3 * sizeof(float), "texels", &result, error);
    texels->texel = vshi_take(count, sizeof(uint32_t), "texels", &result, error);
    texels->mesh = vshi_take(count, sizeof(uint32_t), "texels", &result, error);
    if (result != VSH_OK) {
        return result;
    }
    texels->count = count;
    texels->info.samples = count;
    texels->info.bytes = sizeof *texels + count * SAMPLE_BYTES + texels->mesh_count;
    if ((result = vshi_parallel_for(job, rows, 1, 1, write_rows, all, error)) != VSH_OK) {
        return result;
    }
    if (count > 0) {
        for (int k = 0; k < 3; ++k) {
            double low = INFINITY, high = -INFINITY;
            for (size_t row = 0; row < rows; ++row) {
                low = fmin(low, all->rows[row].low[k]);
                high = fmax(high, all->rows[row].high[k]);
            }
            texels->info.bounds_min[k] = low;
            texels->info.bounds_max[k] = high;
        }
    }
    return rows_result(all, run, held, error);
}

static void finish_reports(const creation *all, const vsh_run *run, vsh_uv_report *reports) {
    for (size_t m = 0; m < all->charts.mesh_count; ++m) {
        vsh_uv_report *report = &reports[m];
        report->overlap_texels = atomic_load(&all->overlaps->texels[m]);
        for (size_t i = all->charts.first[m]; i < all->charts.first[m + 1]; ++i) {
            report->overlap_triangles += atomic_load(&all->overlaps->triangles[i]);
        }
        const vshi_mesh_name label = vshi_mesh_label(&all->charts.meshes[m], m);
        const char *name = label.text;
        if (report->overlap_texels > 0) {
            vshi_warn(run,
                      "%s: lightmap UVs overlap: %zu texels of %zu triangles are covered already; the first "
                      "triangle keeps them",
                      name, report->overlap_texels, report->overlap_triangles);
        }
        if (report->outside_triangles > 0) {
            vshi_warn(run,
                      "%s: lightmap UVs of %zu triangles leave the unit square; what is outside is not baked",
                      name, report->outside_triangles);
        }
        if (report->degenerate_triangles > 0) {
            vshi_warn(run, "%s: %zu triangles have no area in the lightmap UVs and are not baked", name,
                      report->degenerate_triangles);
        }
    }
}

static vsh_result find_open(const vsh_mesh *meshes, vsh_texels *texels, vshi_job *job, vsh_error *error) {
    vsh_result result = VSH_OK;
    texels->open = vshi_take(texels->mesh_count, 1, "texels", &result, error);
    for (size_t m = 0; result == VSH_OK && m < texels->mesh_count; ++m) {
        vsh_mesh_report report;
        result = vsh_mesh_check(&meshes[m], &report, error);
        if (result == VSH_OK) {
            texels->open[m] = report.open_edges > 0;
            result = vshi_job_advance(job, 0) ? vshi_job_fail_cancelled(job, error) : VSH_OK;
        }
    }
    return result;
}

static vsh_result create(const vsh_mesh *meshes, const vsh_lightmap_options *options, const vsh_run *run,
                         vshi_job *job, vsh_uv_report *reports, vsh_texels *texels, vsh_error *error) {
    creation all = {.texels = texels};
    vshi_overlaps overlaps = {NULL, NULL};
    const vshi_raster raster = {options->width, options->height, options->supersample};
    vsh_result result =
        vshi_charts_create(meshes, texels->mesh_count, raster, run, job, reports, &all.charts, error);
    if (result != VSH_OK) {
        goto done;
    }
    if ((result = find_open(meshes, texels, job, error)) != VSH_OK) {
        goto done;
    }
    const size_t triangles = all.charts.first[texels->mesh_count];
    overlaps.texels = vshi_take(texels->mesh_count, sizeof *overlaps.texels, "overlaps", &result, error);
    overlaps.triangles = vshi_take(triangles, sizeof *overlaps.triangles, "overlaps", &result, error);
    if (result != VSH_OK) {
        goto done;
    }
    all.overlaps = &overlaps;
    result = rasterise(&all, run, job, (double)all.charts.bytes + (double)triangles, error);
    if (result == VSH_OK) {
        finish_reports(&all, run, reports);
    }
done:
    free(overlaps.triangles);
    free(overlaps.texels);
    free(all.rows);
    vshi_charts_free(&all.charts);
    return result;
}

vsh_result vsh_texels_create(const vsh_mesh *meshes, size_t mesh_count, const vsh_lightmap_options *options,
                             const vsh_run *run, vsh_uv_report *uv_reports, vsh_texels **texels,
                             vsh_error *error) {
    VSHI_FLOATS;
    if (texels == NULL || (meshes == NULL && mesh_count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_texels_create: %s is NULL",
                         texels == NULL ? "texels" : "meshes");
    }
    *texels = NULL;
    vsh_lightmap_options full = vsh_lightmap_options_default();
    vsh_run full_run;
    vsh_result result = vshi_options_resolve(options, &full, sizeof full, "vsh_lightmap_options", error);
    if (result == VSH_OK) {
        result = check_options(&full, error);
    }
    if (result == VSH_OK) {
        result = vshi_run_resolve(run, &full_run, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    if (mesh_count == 0 || mesh_count > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap of %zu meshes: expected 1 … %u", mesh_count,
                         UINT32_MAX);
    }
    vsh_uv_report *reports = NULL;
    vsh_texels *made = NULL;
    const size_t tile_rows = ((size_t)full.height + VSHI_TILE - 1) / VSHI_TILE;
    vshi_job *job = vshi_job_begin(&full_run, "texels", 2 * tile_rows);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "texels: the system refused memory");
    }
    reports = vshi_take(mesh_count, sizeof *reports, "UV reports", &result, error);
    made = vshi_take(1, sizeof *made, "texels", &result, error);
    if (result != VSH_OK) {
        goto done;
    }
    made->info.width = full.width;
    made->info.height = full.height;
    made->padding = full.padding;
    made->ao_spacing = full.supersample == 1 ? full.ao_spacing : 1;
    made->shade = full.shade;
    made->mesh_count = mesh_count;
    if ((result = create(meshes, &full, &full_run, job, reports, made, error)) != VSH_OK) {
        goto done;
    }
    if (uv_reports != NULL) {
        memcpy(uv_reports, reports, mesh_count * sizeof *reports);
    }
    *texels = made;
    made = NULL;
done:
    vsh_texels_free(made);
    free(reports);
    vshi_job_end(job);
    return result;
}

void vsh_texels_free(vsh_texels *texels) {
    if (texels == NULL) {
        return;
    }
    free(texels->open);
    free(texels->mesh);
    free(texels->texel);
    free(texels->geometric);
    free(texels->normal);
    free(texels->position);
    free(texels);
}

void vsh_texels_get_info(const vsh_texels *texels, vsh_texels_info *info) {
    *info = texels->info;
}

vsh_texel_samples vsh_texels_samples(const vsh_texels *texels) {
    return (vsh_texel_samples){texels->count, texels->position, texels->normal, texels->geometric,
                               texels->texel};
}
