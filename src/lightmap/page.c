/* A lightmap's page: memory, the passes over all its tiles, and the bake of one lightmap. */
#include "lightmap/page.h"

#include "base/floats.h"
#include "base/memory.h"
#include "lightmap/planes.h"
#include "shade/ao.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- memory */

bool vshi_ao_is_shared(const vsh_shade_options *shade, int32_t spacing, bool layered_ao) {
    return spacing > 1 && !layered_ao &&
           (vsh_method_traits(VSH_NAMES_AO, shade->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
}

vsh_result vshi_page_take(const vshi_page *page, const vshi_array *arrays, size_t count, const char *what,
                          vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(
            vshi_store_take(page->store, arrays[i].memory, arrays[i].count, arrays[i].size, what, error));
    }
    return VSH_OK;
}

vsh_result vshi_page_open(const vsh_charts *charts, const vsh_lightmap *lightmap, size_t light_count,
                          const vsh_shade_options *shade, bool shared, vshi_store *store, vshi_page *page,
                          vsh_error *error) {
    *page = (vshi_page){.charts = charts,
                        .lightmap = *lightmap,
                        .light_count = light_count,
                        .shade = *shade,
                        .store = store,
                        .width = (size_t)charts->info.width,
                        .height = (size_t)charts->info.height,
                        .error_count = light_count + 2};
    const size_t texels = vshi_page_texels(page), tiles = vshi_charts_tiles(&charts->sorted);
    const uint32_t needs = vshi_planes_need(lightmap);
    const bool ao = shared && (needs & VSHI_NEEDS_AO) != 0, sky = shared && (needs & VSHI_NEEDS_OPEN) != 0;
    const bool tangents = ao && lightmap->bent != NULL && lightmap->bent_space == VSH_BENT_TANGENT;
    const vshi_array arrays[] = {
        VSHI_ARRAY(page->state, texels),
        VSHI_ARRAY(page->mesh, texels),
        VSHI_ARRAY(page->stats, tiles),
        VSHI_ARRAY(page->errors, tiles * page->error_count),
        VSHI_ARRAY(page->position, ao || sky ? 3 * texels : 0),
        VSHI_ARRAY(page->normal, ao || sky ? 3 * texels : 0),
        VSHI_ARRAY(page->tangent, tangents ? 4 * texels : 0),
    };
    VSHI_TRY(vshi_page_take(page, arrays, sizeof arrays / sizeof *arrays, "lightmap", error));
    if (ao) {
        VSHI_TRY(vshi_shots_open(page, &page->ao, error));
    }
    return sky ? vshi_shots_open(page, &page->sky, error) : VSH_OK;
}

double vshi_lightmap_bytes(const vsh_charts *charts, const vsh_lightmap *planes, size_t light_count,
                           bool shared) {
    const uint32_t need = vshi_planes_need(planes);
    size_t kind_count, floats = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (size_t k = 0; k < kind_count; ++k) {
        if (vshi_plane_given(planes, &kinds[k])) {
            floats += vshi_plane_components(&kinds[k]) * (kinds[k].per_light ? light_count : 1);
        }
    }
    const bool ao = shared && (need & VSHI_NEEDS_AO) != 0, sky = shared && (need & VSHI_NEEDS_OPEN) != 0;
    const double own = 1.0 + sizeof(uint32_t) + vshi_shots_bytes(planes, ao, sky);
    const double filling =
        2.0 + 1.0 + sizeof(uint32_t) + 17.0 / 3.0; /* padding, invalid texels, mip levels */
    const double texels = (double)charts->info.width * (double)charts->info.height;
    return texels * ((double)floats * sizeof(float) + fmax(own, 1.0 + sizeof(uint32_t) + filling));
}

void vshi_page_close_shots(vshi_page *page) {
    vshi_shots_close(page, &page->sky);
    vshi_shots_close(page, &page->ao);
    vshi_store_give(page->store, page->tangent);
    vshi_store_give(page->store, page->normal);
    vshi_store_give(page->store, page->position);
    page->tangent = page->normal = page->position = NULL;
}

void vshi_page_close(vshi_page *page) {
    if (page->store != NULL) {
        vshi_page_close_shots(page); /* the store frees its other arrays */
    }
}

void vshi_page_note(vshi_page *page, const vshi_samples *samples, size_t i) {
    const size_t place = vshi_page_place(page, samples->texel[i]);
    const vshi_vec at = vshi_sub(vshi_sample_foot(samples, i), vshi_vec_of(page->charts->centre));
    vshi_vec_to_floats(at, page->position + 3 * place);
    memcpy(page->normal + 3 * place, samples->normal + 3 * i, 3 * sizeof *page->normal);
    if (page->tangent != NULL) {
        memcpy(page->tangent + 4 * place, samples->tangent + 4 * i, 4 * sizeof *page->tangent);
    }
}

/* Sets what vshi_trace_tiles() would set: the meshes of texels, and places and normals of those that shot
 * shared rays. The first sample of a texel decides. */
static void note_samples(void *user, const vshi_samples *samples) {
    vshi_page *page = user;
    for (size_t i = samples->count; i-- > 0;) {
        const size_t place = vshi_page_place(page, samples->texel[i]);
        page->mesh[place] = vshi_sample_mesh(samples, i) + 1;
        if ((page->ao.level != NULL && page->ao.level[place] != 0) ||
            (page->sky.level != NULL && page->sky.level[place] != 0)) {
            vshi_page_note(page, samples, i);
        }
    }
}

vsh_result vshi_page_rasterize(vshi_page *page, size_t number, vsh_error *error) {
    return vshi_tile_visit(page->charts, number, page->charts->tangents, note_samples, page, error);
}

/* --- statistics of the tiles */

void vshi_bake_error_add(vsh_bake_error *sum, const vsh_bake_error *more) {
    sum->values += more->values;
    sum->square_error += more->square_error;
    sum->compared += more->compared;
    sum->compared_square_error += more->compared_square_error;
    sum->worst = fmax(sum->worst, more->worst);
}

/* Adds in the order of the tiles, so that the order of work does not change the sums. */
static void add_tiles(const vshi_page *page, vsh_bake_stats *stats) {
    for (size_t tile = 0; tile < vshi_charts_tiles(&page->charts->sorted); ++tile) {
        vshi_shade_stats_add(&stats->shade, &page->stats[tile]);
        for (size_t i = 0; stats->errors != NULL && i < page->error_count; ++i) {
            if (i <= page->light_count || page->lightmap.sky != NULL) {
                vshi_bake_error_add(&stats->errors[i], &page->errors[tile * page->error_count + i]);
            }
        }
    }
}

/* --- planes that are put together */

/* Adds ambient light, times AO, to the irradiance of valid texels. Without ambient light AO dims the lights
 * instead. */
static void add_ambient(const vshi_page *page) {
    const vsh_lightmap *planes = &page->lightmap;
    for (size_t i = 0; planes->irradiance != NULL && i < vshi_page_texels(page); ++i) {
        if (page->state[i] == VSHI_TEXEL_VALID) {
            for (size_t c = 0; c < 3; ++c) {
                float *value = &planes->irradiance[3 * i + c];
                const float open = planes->ao != NULL ? planes->ao[i] : 1.0f;
                *value = planes->ambient == NULL ? *value * open : *value + (float)planes->ambient[c] * open;
            }
        }
    }
}

/* Sets the planes of validity, and counts texels that are not valid. */
static void set_coverage(const vshi_page *page, vsh_bake_stats *stats) {
    const vsh_lightmap *planes = &page->lightmap;
    for (size_t i = 0; i < vshi_page_texels(page); ++i) {
        if (page->state[i] == VSHI_TEXEL_INVALID) {
            ++stats->invalid_texels;
            if (planes->invalid != NULL) {
                planes->invalid[i] = 1.0f;
            }
            if (stats->invalid_by_mesh != NULL && page->mesh[i] > 0) {
                ++stats->invalid_by_mesh[page->mesh[i] - 1];
            }
        } else if (planes->coverage != NULL && page->state[i] == VSHI_TEXEL_VALID) {
            planes->coverage[i] = 1.0f;
        }
    }
    stats->texels += page->charts->info.covered;
}

/* --- padding */

static vsh_result pad(vshi_page *page, uint64_t invalid, const vshi_plane *planes, size_t plane_count,
                      const vsh_run *run, vsh_error *error) {
    const int32_t padding = page->charts->padding, width = (int32_t)page->width,
                  height = (int32_t)page->height, least = VSHI_LEAST_INVALID_RADIUS;
    const int32_t radius[VSHI_TEXEL_KINDS] = {
        [VSHI_TEXEL_EMPTY] = padding,
        [VSHI_TEXEL_INVALID] = invalid == 0      ? 0
                               : padding > least ? padding
                                                 : least,
    };
    vshi_spread spread;
    uint8_t *filled = NULL;
    VSHI_TRY(
        vshi_spread_find(page->store, page->width, page->height, page->mesh, page->state, &spread, error));
    vshi_spread_copy(&spread, page->state, planes, plane_count);
    vshi_spread_free(page->store, &spread);
    if (page->charts->fills) {
        VSHI_TRY(vshi_store_take(page->store, (void **)&filled, vshi_page_texels(page), 1, "padding", error));
    }
    VSHI_TRY(vshi_padding_fill(page->store, run, width, height, page->state, radius, planes, plane_count,
                               filled, error));
    if (page->charts->fills) {
        VSHI_TRY(vshi_pull_push(page->store, run, width, height, filled, planes, plane_count, error));
    }
    vshi_store_give(page->store, filled);
    return VSH_OK;
}

vsh_result vshi_page_finish(vshi_page *page, const vsh_run *run, vsh_bake_stats *stats, vsh_error *error) {
    size_t kind_count, count = 0;
    vshi_plane_kinds(&kind_count);
    const uint64_t invalid = stats->invalid_texels;
    add_tiles(page, stats);
    if (page->ao.own.ao != NULL) {
        VSHI_TRY(vshi_ao_estimate(page, &page->ao, page->light_count, run, stats, error));
    }
    if (page->sky.own.ao != NULL) {
        VSHI_TRY(vshi_ao_estimate(page, &page->sky, page->light_count + 1, run, stats, error));
    }
    add_ambient(page);
    set_coverage(page, stats);
    vshi_plane *padded = NULL;
    VSHI_TRY(vshi_allocate((void **)&padded, kind_count * (page->light_count + 1), sizeof *padded, "padding",
                           error));
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(&page->lightmap, page->light_count, &c);) {
        if (c.kind->padded) {
            padded[count++] = (vshi_plane){c.values, vshi_plane_components(c.kind)};
        }
    }
    const vsh_result result = pad(page, stats->invalid_texels - invalid, padded, count, run, error);
    free(padded);
    return result;
}

/* --- the bake of one lightmap */

vsh_result vshi_lightmap_check(const vsh_lightmap *lightmap, const vsh_charts *charts,
                               const vsh_light *lights, size_t light_count, vsh_error *error) {
    if (lightmap->bent != NULL && lightmap->bent_space != VSH_BENT_WORLD &&
        (lightmap->bent_space != VSH_BENT_TANGENT || !charts->tangents)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "bent_space %d: expected %d, or %d with charts that have tangents",
                         lightmap->bent_space, VSH_BENT_WORLD, VSH_BENT_TANGENT);
    }
    VSHI_TRY(vshi_plane_row_check(lightmap, charts->info.width, error));
    const int32_t up = lightmap->asked.sky;
    if (lightmap->sky != NULL && (up <= VSH_UP_NONE || up > VSH_UP_MINUS_Z)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap asked.sky %d: expected %d … %d", up, VSH_UP_X,
                         VSH_UP_MINUS_Z);
    }
    VSHI_TRY(vshi_tint_check(&lightmap->tint_by, error));
    for (int c = 0; lightmap->ambient != NULL && c < 3; ++c) {
        if (!(lightmap->ambient[c] >= 0.0 && isfinite(lightmap->ambient[c]))) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "ambient[%d] %g: expected a finite number, at least 0", c, lightmap->ambient[c]);
        }
    }
    for (size_t i = 0; i < light_count; ++i) {
        VSHI_TRY(vsh_light_check(&lights[i], error));
    }
    return VSH_OK;
}

/* Bakes into zeroed planes. */
static vsh_result bake(const vshi_tracer *tracer, const vsh_charts *charts, const vsh_lightmap *lightmap,
                       size_t light_count, const vsh_shade_options *shade, const vsh_run *run,
                       vsh_bake_stats *stats, vsh_error *error) {
    const size_t tiles = vshi_charts_tiles(&charts->sorted);
    vshi_store store = {.run = run};
    vshi_page page;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_page_open(charts, lightmap, light_count, shade,
                                 vshi_tracer_shares(tracer, charts->ao_spacing), &store, &page, error));
    VSHI_TRY_DONE(vshi_job_open(&job, run, "bake", tiles, "bake", error));
    VSHI_TRY_DONE(vshi_trace_tiles(tracer, &page, NULL, tiles, job, error));
    result = vshi_page_finish(&page, run, stats, error);
done:
    vshi_job_end(job);
    vshi_page_close(&page);
    vshi_store_close(&store);
    return result;
}

vsh_result vsh_bake_lightmap(const vsh_occluders *occluders, const vsh_charts *charts,
                             const vsh_light *lights, size_t light_count, const vsh_shade_options *options,
                             const vsh_run *run, const vsh_lightmap *lightmap, vsh_bake_stats *stats,
                             vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(occluders, charts);
    VSHI_NEEDS(lightmap);
    VSHI_NEEDS_OF(light_count, lights);
    vsh_shade_options shade;
    vsh_run full;
    vsh_bake_stats sum = vsh_bake_stats_zero();
    VSHI_TRY(vshi_shade_options_resolve(options != NULL ? options : &charts->shade, &shade, error));
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_options_resolve(stats, &sum, sizeof sum, "vsh_bake_stats", error));
    VSHI_TRY(vshi_lightmap_check(lightmap, charts, lights, light_count, error));
    const double held =
        vshi_occluders_bytes(occluders) + (double)charts->info.bytes + vshi_trace_bytes(charts, full.threads);
    VSHI_TRY(vshi_check_limit(&full, held, "lightmap", error));
    full.memory_held += (uint64_t)held;
    sum.texels = sum.invalid_texels = 0;
    for (size_t m = 0; sum.invalid_by_mesh != NULL && m < charts->sorted.mesh_count; ++m) {
        sum.invalid_by_mesh[m] = 0;
    }
    const size_t width = (size_t)charts->info.width, height = (size_t)charts->info.height;
    vsh_lightmap tight;
    void *memory;
    vshi_tracer *tracer = NULL;
    vsh_result result;
    VSHI_TRY(vshi_planes_tighten(lightmap, light_count, width, height, &full, &tight, &memory, error));
    VSHI_TRY_DONE(vshi_tracer_create(occluders, lights, light_count, &shade, &tight, sum.errors != NULL,
                                     &full, &tracer, error));
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(&tight, light_count, &c);) {
        memset(c.values, 0, width * height * vshi_plane_components(c.kind) * sizeof *c.values);
    }
    VSHI_TRY_DONE(bake(tracer, charts, &tight, light_count, &shade, &full, &sum, error));
    if (memory != NULL) {
        vshi_planes_copy_rows(&tight, lightmap, light_count, width, height);
    }
    if (stats != NULL) {
        memcpy(stats, &sum, stats->struct_size);
    }
done:
    vshi_tracer_free(tracer);
    free(memory);
    return result;
}
