/* Pictures: rows of samples, in tiles over threads, under the film's filter. */
#include "render/render.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "field/level.h"
#include "shade/layers.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>

/* Samples that are in memory at once. */
enum { BAND_SAMPLES = 1 << 18, MOST_SIDE = 65000 };
static const double FOG_AROUND = 0.25; /* diagonals */
/* Voxels: triangles, and casters that are not voxelised, lie that far over what is seen of them, about. */
static const double LIFT = 0.5;

static vsh_result check_colors(const char *name, const double color[3], double most, vsh_error *error) {
    for (int c = 0; c < 3; ++c) {
        if (!(color[c] >= 0.0 && color[c] <= most)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s (%g, %g, %g) is out of range 0 … %g", name,
                             color[0], color[1], color[2], most);
        }
    }
    return VSH_OK;
}

static vsh_result check_options(const vsh_render_options *o, size_t light_count, vsh_error *error) {
    static const double BRIGHTEST = 1e15;
    const struct {
        const char *name;
        double value, least, most;
    } numbers[] = {{"width", o->width, 1, VSH_MAX_PICTURE_SIZE},
                   {"height", o->height, 1, VSH_MAX_PICTURE_SIZE},
                   {"samples", o->samples, 1, 16},
                   {"shafts", o->shafts, 0.0, 100.0},
                   {"shaft_steps", o->shaft_steps, 1, 64},
                   {"light_count", (double)light_count, 0, VSHI_MOST_LIGHTS}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i) {
        if (!(numbers[i].value >= numbers[i].least && numbers[i].value <= numbers[i].most)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s %g is out of range %g … %g", numbers[i].name,
                             numbers[i].value, numbers[i].least, numbers[i].most);
        }
    }
    const int32_t side = o->width > o->height ? o->width : o->height;
    if ((side + 2) * o->samples > MOST_SIDE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "samples %d: %d pixels a side take at most %d",
                         o->samples, side, MOST_SIDE / (side + 2));
    }
    VSHI_TRY(check_colors("sky", o->sky, BRIGHTEST, error));
    VSHI_TRY(check_colors("background", o->background, BRIGHTEST, error));
    VSHI_TRY(vshi_lit_check(o, error));
    for (size_t i = 0; i < o->lit_count; ++i) {
        VSHI_TRY(check_colors("color of lit meshes", o->lit[i].color, 1.0, error));
    }
    VSHI_TRY(vsh_tint_check(&o->tint, error));
    return vsh_camera_check(&o->camera, error);
}

static vsh_result check_surfaces(const vsh_surface *surfaces, size_t count, vsh_error *error) {
    if (count > VSH_MAX_SURFACES || (surfaces == NULL && count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%zu surfaces: NULL, or more than %d", count,
                         VSH_MAX_SURFACES);
    }
    for (size_t i = 0; i < count; ++i) {
        if (surfaces[i].field == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "surface %zu: field is NULL", i);
        }
        VSHI_TRY(check_colors("color of a surface", surfaces[i].color, 1.0, error));
    }
    return VSH_OK;
}

/* --- the work */

typedef struct rendering {
    vshi_scenery scenery;
    vshi_sample_grid grid;
    vshi_film film;
    vshi_rows rows;
    size_t tiles_across;
    vsh_shade_stats *stats; /* of each tile of the rows */
    vsh_result *results;
} rendering;

static void render_tiles(void *user, size_t begin, size_t end) {
    rendering *r = user;
    for (size_t tile = begin; tile < end; ++tile) {
        const int32_t column = (int32_t)(tile % r->tiles_across) * VSHI_TILE;
        const int32_t row = r->rows.first + (int32_t)(tile / r->tiles_across) * VSHI_TILE;
        r->stats[tile] = vsh_shade_stats_zero();
        r->results[tile] = vshi_tile_render(&r->scenery, &r->rows, column, row, &r->stats[tile], NULL);
    }
}

static void raster_strips(void *user, size_t begin, size_t end) {
    const rendering *r = user;
    for (size_t strip = begin; strip < end; ++strip) {
        vshi_lit_raster(r->scenery.lit, &r->rows.lit, strip);
    }
}

static int32_t rows_at_once(const vshi_sample_grid *grid) {
    const int32_t rows = BAND_SAMPLES / grid->columns / VSHI_TILE * VSHI_TILE;
    return rows > VSHI_TILE ? rows : VSHI_TILE;
}

static double bytes_of(const rendering *r) {
    const double samples = (double)rows_at_once(&r->grid) * r->grid.columns;
    return samples * (sizeof(vshi_seen) + 12.0) +
           samples / VSHI_TILE_SAMPLES * (sizeof(vsh_shade_stats) + sizeof(vsh_result));
}

static vsh_result allocate(rendering *r, vsh_error *error) {
    const size_t rows = (size_t)rows_at_once(&r->grid), columns = (size_t)r->grid.columns;
    r->tiles_across = (columns + VSHI_TILE - 1) / VSHI_TILE;
    const size_t tiles = r->tiles_across * (rows / VSHI_TILE);
    VSHI_TRY(vshi_allocate((void **)&r->rows.seen, rows * columns, sizeof *r->rows.seen, "samples", error));
    VSHI_TRY(vshi_allocate((void **)&r->stats, tiles, sizeof *r->stats, "tiles", error));
    VSHI_TRY(vshi_allocate((void **)&r->results, tiles, sizeof *r->results, "tiles", error));
    if (r->scenery.lit != NULL) {
        VSHI_TRY(
            vshi_allocate((void **)&r->rows.lit.depth, rows * columns, sizeof(double), "samples", error));
        VSHI_TRY(vshi_allocate((void **)&r->rows.lit.triangle, rows * columns, sizeof(uint32_t), "samples",
                               error));
    }
    return VSH_OK;
}

static void release(rendering *r) {
    free(r->rows.lit.triangle);
    free(r->rows.lit.depth);
    free(r->results);
    free(r->stats);
    free(r->rows.seen);
}

static vsh_result render_rows(rendering *r, vshi_job *job, vsh_shade_stats *stats, vsh_error *error) {
    const size_t tiles = r->tiles_across * (size_t)((r->rows.count + VSHI_TILE - 1) / VSHI_TILE);
    r->rows.lit.first_row = r->rows.first;
    r->rows.lit.rows = r->rows.count;
    if (r->scenery.lit != NULL) {
        const size_t strips = ((size_t)r->grid.columns + VSHI_LIT_STRIP - 1) / VSHI_LIT_STRIP;
        VSHI_TRY(vshi_parallel_for(job, strips, 1, 0, raster_strips, r, error));
    }
    VSHI_TRY(vshi_parallel_for(job, tiles, 4, 1, render_tiles, r, error));
    for (size_t i = 0; i < tiles; ++i) {
        if (r->results[i] != VSH_OK) {
            return vshi_fail(error, r->results[i], "render: tile %zu", i);
        }
        vshi_shade_stats_add(stats, &r->stats[i]);
    }
    return vshi_film_add(&r->film, r->rows.seen, r->rows.first, r->rows.count, job, error);
}

static vsh_result render_picture(rendering *r, const vsh_picture *picture, vsh_shade_stats *stats,
                                 vsh_error *error) {
    VSHI_TRY(allocate(r, error));
    const size_t rows = ((size_t)r->grid.rows + VSHI_TILE - 1) / VSHI_TILE;
    vshi_job *job = vshi_job_begin(&r->scenery.run, "render", rows * r->tiles_across);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "render: the system refused memory");
    }
    vsh_result result = VSH_OK;
    vshi_film_begin(&r->film, &r->grid, picture);
    const int32_t most = rows_at_once(&r->grid);
    for (r->rows.first = 0; r->rows.first < r->grid.rows; r->rows.first += most) {
        const int32_t left = r->grid.rows - r->rows.first;
        r->rows.count = left < most ? left : most;
        VSHI_TRY_DONE(render_rows(r, job, stats, error));
    }
    vshi_film_end(&r->film);
done:
    vshi_job_end(job);
    return result;
}

/* The fog's box: around all that can be seen. */
static bool place_fog(rendering *r) {
    const vshi_scenery *s = &r->scenery;
    vshi_vec low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < s->surface_count; ++i) {
        vsh_field_info info;
        vsh_field_get_info(s->surfaces[i].field, &info);
        if (info.bricks > 0 && info.active_voxels > 0) {
            low = (vshi_vec){fmin(low.x, info.bounds_min[0]), fmin(low.y, info.bounds_min[1]),
                             fmin(low.z, info.bounds_min[2])};
            high = (vshi_vec){fmax(high.x, info.bounds_max[0]), fmax(high.y, info.bounds_max[1]),
                              fmax(high.z, info.bounds_max[2])};
        }
    }
    vshi_lit_grow_box(s->lit, &low, &high);
    const double diagonal = vshi_length(vshi_sub(high, low)), around = FOG_AROUND * diagonal;
    const vshi_vec margin = {around, around, around};
    r->scenery.shafts.low = vshi_sub(low, margin);
    r->scenery.shafts.high = vshi_add(high, margin);
    r->scenery.shafts.extinction = low.x <= high.x && diagonal > 0.0 ? s->options->shafts / diagonal : 0.0;
    return r->scenery.shafts.extinction > 0.0;
}

static vsh_result check_memory(const rendering *r, const vsh_surface *surfaces, size_t count,
                               const vsh_field *field, vsh_error *error) {
    double bytes = bytes_of(r) + vshi_lit_bytes(r->scenery.options) + vshi_field_bytes(field);
    for (size_t i = 0; i < count; ++i) {
        bytes += surfaces[i].field != field ? vshi_field_bytes(surfaces[i].field) : 0.0;
    }
    return vshi_check_limit(&r->scenery.run, bytes, "render", error);
}

/* Whether light is asked of something else than the fields that are seen. */
static bool needs_lift(const vshi_scenery *s, const vsh_occluders *occluders) {
    bool lift = (s->light_count > 0 && s->traces_shadow) || (s->options->ao && s->traces_ao);
    for (size_t i = 0; i < occluders->layer_count && !lift; ++i) {
        lift = occluders->layers[i].field == NULL;
    }
    return lift;
}

vsh_result vsh_render(const vsh_surface *surfaces, size_t surface_count, const vsh_occluders *occluders,
                      const vsh_light *lights, size_t light_count, const vsh_render_options *options,
                      const vsh_run *run, const vsh_picture *picture, vsh_shade_stats *stats,
                      vsh_error *error) {
    VSHI_FLOATS;
    vsh_render_options o = vsh_render_options_default();
    rendering r = {.tiles_across = 0};
    vsh_query *query = NULL;
    vshi_lit *lit = NULL;
    vshi_sampler *sampler = NULL;
    vsh_shade_stats own = vsh_shade_stats_zero();
    VSHI_NEEDS(picture);
    VSHI_NEEDS(occluders);
    VSHI_NEEDS_OF(light_count, lights);
    VSHI_TRY(vshi_options_resolve(options, &o, sizeof o, "vsh_render_options", error));
    VSHI_TRY(vshi_run_resolve(run, &r.scenery.run, error));
    VSHI_TRY(check_options(&o, light_count, error));
    VSHI_TRY(check_surfaces(surfaces, surface_count, error));
    r.grid = vshi_sample_grid_of(&o);
    r.scenery.options = &o;
    r.scenery.grid = &r.grid;
    r.scenery.surfaces = surfaces;
    r.scenery.surface_count = surface_count;
    r.scenery.lights = lights;
    r.scenery.light_count = light_count;
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(check_memory(&r, surfaces, surface_count, occluders->field, error));
    VSHI_TRY_DONE(vsh_query_create(occluders, lights, light_count, &o.shade, &query, error));
    VSHI_TRY_DONE(vshi_lit_create(&o, lights, light_count, &r.grid, &lit, error));
    r.scenery.query = query;
    r.scenery.occluders = occluders;
    r.scenery.traces_shadow = vshi_shadow_traces(&o.shade, occluders->triangles);
    r.scenery.traces_ao = vshi_ao_traces(&o.shade, occluders->triangles);
    r.scenery.lift = needs_lift(&r.scenery, occluders) ? LIFT : 0.0;
    r.scenery.lit = lit;
    if (o.shafts > 0.0 && light_count > 0 && place_fog(&r)) {
        sampler = vshi_sampler_create(VSH_SAMPLER_BLUE, 1, o.shade.frame);
        if (sampler == NULL) {
            VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_MEMORY, "render: the system refused memory"));
        }
        r.scenery.shafts.sampler = sampler;
    }
    result = render_picture(&r, picture, stats != NULL ? stats : &own, error);
done:
    release(&r);
    vshi_sampler_free(sampler);
    vshi_lit_free(lit);
    vsh_query_free(query);
    return result;
}
