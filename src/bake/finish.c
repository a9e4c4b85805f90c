/* Finishes a page whose tiles are all traced: AO between texels, fills, padding, statistics. */
#include "bake/padding.h"
#include "bake/page.h"
#include "bake/planes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- statistics of the tiles */

void vshi_bake_error_add(vsh_bake_error *sum, const vsh_bake_error *more) {
    sum->values += more->values;
    sum->square_error += more->square_error;
    sum->held += more->held;
    sum->held_square_error += more->held_square_error;
    sum->worst = fmax(sum->worst, more->worst);
}

/* In the order of the tiles, so that no order of work shows. */
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

/* --- AO that texels share */

/* Puts a texel's value into its planes. */
static void put_ao(const vshi_page *page, size_t i, float value, const vshi_ao_plane *plane, float *bent) {
    const vsh_lightmap *planes = &page->lightmap;
    if (planes->ao != NULL) {
        planes->ao[i] = 0.0f + value; /* -0 becomes 0 */
    }
    if (planes->ao_error != NULL) {
        planes->ao_error[i] = plane->deviation;
    }
    if (bent != NULL) {
        vshi_bent_normal(page->normal + 3 * i, page->tangent != NULL ? page->tangent + 4 * i : NULL,
                         bent + 3 * i);
        for (size_t axis = 0; axis < 3; ++axis) {
            planes->bent[3 * i + axis] = 0.0f + bent[3 * i + axis];
        }
        vshi_bent_normalize(planes->bent + 3 * i);
    }
}

static void put_values(const vshi_page *page, const vshi_shots *shots, float *values,
                       const vshi_ao_plane *planes, float *bent) {
    const bool sky = shots == &page->sky;
    double up[3] = {0.0, 0.0, 0.0};
    if (sky) {
        vshi_sky_up(page->lightmap.asked.sky, up);
    }
    for (size_t i = 0; i < vshi_page_texels(page); ++i) {
        if (shots->level[i] == 0) {
            continue;
        }
        if (isnan(values[i])) {
            page->state[i] = VSHI_TEXEL_INVALID;
        } else if (sky) {
            values[i] = vshi_sky_weighed(page->normal + 3 * i, up, values[i]);
            page->lightmap.sky[i] = 0.0f + values[i];
        } else {
            put_ao(page, i, values[i], &planes[i], bent);
        }
    }
}

static void settle_held(const vshi_page *page, const vshi_shots *shots, const float *values,
                        vsh_bake_error *sum) {
    for (size_t tile = 0; tile < vshi_charts_tiles(&page->charts->sorted); ++tile) {
        for (size_t k = 0; k < shots->held[tile].count; ++k) {
            const vshi_held_texel *held = &shots->held[tile].list[k];
            vshi_field_error_settle(held, page->shade.max_error, values[vshi_page_place(page, held->texel)],
                                    sum);
        }
    }
}

static vsh_result estimate(vshi_page *page, const vshi_shots *shots, size_t index, const vsh_run *run,
                           vsh_bake_stats *stats, vsh_error *error) {
    const size_t texels = vshi_page_texels(page);
    const char *what = "AO texels";
    float *values = NULL, *bent = NULL;
    vshi_ao_plane *planes = NULL;
    VSHI_TRY(vshi_store_take(page->store, (void **)&values, texels, sizeof *values, what, error));
    VSHI_TRY(vshi_store_take(page->store, (void **)&planes, texels, sizeof *planes, what, error));
    VSHI_TRY(vshi_store_take(page->store, (void **)&bent, shots->open != NULL ? texels : 0, 3 * sizeof *bent,
                             what, error));
    vsh_shade_stats own = vsh_shade_stats_zero();
    VSHI_TRY(vshi_ao_estimate(page, shots, values, planes, bent, run, &own, error));
    vshi_shade_stats_add(&stats->shade, &own);
    put_values(page, shots, values, planes, bent);
    if (stats->errors != NULL) {
        stats->errors[index].square_error += own.square_error;
        stats->errors[index].worst = fmax(stats->errors[index].worst, own.worst_error);
        settle_held(page, shots, values, &stats->errors[index]);
    }
    vshi_store_give(page->store, bent);
    vshi_store_give(page->store, planes);
    vshi_store_give(page->store, values);
    return VSH_OK;
}

/* --- planes that are put together */

/* Adds what AO lets through to the irradiance of lights, where texels are valid. Without ambient light AO
 * dims the lights instead. */
static void add_ambient(const vshi_page *page) {
    const vsh_lightmap *planes = &page->lightmap;
    for (size_t i = 0; planes->irradiance != NULL && i < vshi_page_texels(page); ++i) {
        if (page->state[i] == VSHI_TEXEL_VALID) {
            for (size_t c = 0; c < 3; ++c) {
                float *value = &planes->irradiance[3 * i + c];
                *value = vshi_irradiance_open(*value, planes->ambient, c,
                                              planes->ao != NULL ? planes->ao[i] : 1.0f);
            }
        }
    }
}

/* Planes that tell of validity, and how many texels are not valid. */
static void put_coverage(const vshi_page *page, vsh_bake_stats *stats) {
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

/* Lists the planes that are padded: values, not their errors and not the coverage. `list` has room for all.
 */
static size_t list_padded(const vshi_page *page, vshi_plane *list) {
    size_t kind_count, count = 0;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + kind_count; ++kind) {
        for (size_t i = 0; kind->padded && i < (kind->per_light ? page->light_count : 1); ++i) {
            float *plane = vshi_plane_of(&page->lightmap, kind, i);
            list[count] = (vshi_plane){plane, vshi_plane_components(kind)};
            count += plane != NULL;
        }
    }
    return count;
}

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
    size_t kind_count;
    vshi_plane_kinds(&kind_count);
    const uint64_t invalid = stats->invalid_texels;
    add_tiles(page, stats);
    if (page->ao.share != NULL) {
        VSHI_TRY(estimate(page, &page->ao, page->light_count, run, stats, error));
    }
    if (page->sky.share != NULL) {
        VSHI_TRY(estimate(page, &page->sky, page->light_count + 1, run, stats, error));
    }
    add_ambient(page);
    put_coverage(page, stats);
    vshi_plane *planes = calloc(kind_count * (page->light_count + 1), sizeof *planes);
    if (planes == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "padding: the system refused memory");
    }
    const size_t count = list_padded(page, planes);
    const vsh_result result = pad(page, stats->invalid_texels - invalid, planes, count, run, error);
    free(planes);
    return result;
}
