#include "bake/baking.h"
#include "bake/part.h"
#include "bake/planes.h"
#include "bake/pull_push.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/field.h"
#include "shade/layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is shaded by the rays of AO, and needs what AO does. */
enum { NEEDS_ANY_AO = VSHI_NEEDS_AO | VSHI_NEEDS_OPEN };

static bool needs(const vshi_baking *bake, uint32_t any) {
    return (bake->needs & any) != 0;
}

/* How far invalid texels are filled from other charts, texels. */
static int32_t invalid_radius(const vsh_texels *texels) {
    const int32_t least = VSHI_LEAST_INVALID_RADIUS;
    return texels->padding > least ? texels->padding : least;
}

static double fields_bytes(const vshi_baking *bake) {
    vsh_field_info info;
    vsh_field_get_info(bake->occluders->field, &info);
    double bytes = (double)info.bytes;
    for (size_t i = 0; i < bake->occluders->layer_count; ++i) {
        bytes += vshi_layer_bytes(&bake->occluders->layers[i]);
    }
    return bytes;
}

/* Of a part, what is known of its own texels before they are shaded. */
static void note_texels(const vshi_baking *bake) {
    const vsh_texels *texels = bake->texels;
    const vshi_band *band = &texels->band;
    const size_t own = (size_t)(band->own_first - band->first) * (size_t)texels->info.width;
    const size_t first = texels->row_start[band->own_begin - band->held_begin];
    const size_t last = texels->row_start[band->own_end - band->held_begin];
    memset(bake->known, 0, (size_t)band->own_rows * (size_t)texels->info.width * sizeof *bake->known);
    for (size_t i = last; i > first; --i) { /* the mesh is that of the first sample */
        const size_t texel = vshi_sample_held(texels, i - 1);
        bake->known[texel - own] = (vshi_sample_mesh(texels, i - 1) + 1) |
                                   (bake->state[texel] == VSHI_TEXEL_VALID ? VSHI_PART_SHADEABLE : 0);
    }
}

/* A vshi_origins_keep: which texels are valid, where the others take their values from, and which rows beside
 * the band's own are needed: all that are in reach of padding, and of others those that are taken from. */
static vsh_result find_needed(void *user, const vshi_origins *origins, uint8_t *rows, vsh_error *error) {
    vshi_baking *bake = user;
    const vsh_texels *texels = bake->texels;
    const vshi_band *band = &texels->band;
    const size_t count = band->held_end - band->held_begin;
    (void)origins;
    VSHI_TRY(vshi_baking_average(bake, NULL, 0, NULL, error));
    if (bake->known != NULL) {
        note_texels(bake);
    } else {
        VSHI_TRY(vshi_spread_find(texels, bake->state, &bake->spread, error));
    }
    uint8_t *taken = NULL;
    VSHI_TRY(vshi_allocate((void **)&taken, count, 1, "lightmap rows", error));
    vshi_spread_mark(&bake->spread, texels, taken);
    const size_t padded = ((size_t)invalid_radius(texels) + VSHI_TILE - 1) / VSHI_TILE;
    const size_t near = bake->known != NULL ? 0 : padded;
    for (size_t row = 0; row < count; ++row) {
        const size_t at = row + band->held_begin;
        taken[row] = taken[row] || (at + near >= band->own_begin && at < band->own_end + near);
    }
    const bool shared = vshi_baking_shares(bake) && needs(bake, NEEDS_ANY_AO);
    memset(rows, bake->keep.memory != NULL ? VSHI_ROW_BESIDE : VSHI_ROW_LEFT_OUT, count);
    for (size_t row = 0; row < count; ++row) {
        size_t begin = row + band->held_begin, end = begin + 1;
        if (shared) {
            vshi_ao_rows(texels->ao_spacing, band->held_end, &begin, &end);
        }
        begin = begin > band->held_begin ? begin - band->held_begin : 0;
        if (taken[row]) {
            memset(rows + begin, VSHI_ROW_BESIDE, end - band->held_begin - begin);
        }
    }
    for (size_t row = 0; row < count; ++row) {
        rows[row] = taken[row] ? VSHI_ROW_WANTED : rows[row];
    }
    free(taken);
    return VSH_OK;
}

static vsh_result bake_planes(vshi_baking *bake, vsh_error *error) {
    for (size_t i = 0; i < bake->light_count; ++i) {
        if (vshi_planes_need_of_light(bake->lightmap, i) != 0) {
            VSHI_TRY(vshi_bake_light(bake, i, error));
        }
    }
    if (needs(bake, VSHI_NEEDS_AO)) {
        VSHI_TRY(vshi_bake_ao(bake, error));
    }
    size_t count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + count; ++kind) {
        float *plane = kind->fill != NULL ? vshi_plane_of(bake->lightmap, kind, 0) : NULL;
        if (plane != NULL && (bake->needs & kind->needs) == kind->needs) {
            VSHI_TRY(kind->fill(bake, plane, error));
        }
    }
    return VSH_OK;
}

static vsh_result pad(vshi_baking *bake, size_t invalid, vsh_error *error) {
    const vsh_texels *texels = bake->texels;
    const int32_t radius[VSHI_TEXEL_KINDS] = {
        [VSHI_TEXEL_EMPTY] = texels->padding,
        [VSHI_TEXEL_INVALID] = invalid > 0 ? invalid_radius(texels) : 0,
    };
    vshi_spread_copy(&bake->spread, bake->state, bake->work.planes, bake->work.padded);
    uint8_t *filled = NULL;
    vsh_result result;
    if (texels->fills) {
        VSHI_TRY(vshi_allocate((void **)&filled, vshi_texels_held(texels), 1, "padding", error));
    }
    VSHI_TRY_DONE(vshi_padding_fill(&bake->run, texels->info.width, texels->band.rows, bake->state, radius,
                                    bake->work.planes, bake->work.padded, filled, error));
    if (texels->fills) {
        result = vshi_pull_push(&bake->run, texels->info.width, texels->band.rows, filled, bake->work.planes,
                                bake->work.padded, error);
    }
done:
    free(filled);
    return result;
}

static vsh_result check_limit(const vshi_baking *bake, vsh_error *error) {
    const vsh_texels *texels = bake->texels;
    const vshi_bake_need need = {.samples = (double)texels->count,
                                 .width = texels->info.width,
                                 .rows = texels->band.rows,
                                 .traced = vshi_baking_traces_shadow(bake) || vshi_baking_traces_ao(bake),
                                 .smooth = texels->smooth,
                                 .values = needs(bake, VSHI_NEEDS_LIGHTS | NEEDS_ANY_AO),
                                 .errors = needs(bake, VSHI_NEEDS_DEVIATION | VSHI_NEEDS_LIGHTS),
                                 .irradiance = needs(bake, VSHI_NEEDS_IRRADIANCE),
                                 .bent = needs(bake, VSHI_NEEDS_BENT),
                                 .tint = needs(bake, VSHI_NEEDS_TINT),
                                 .windows = needs(bake, NEEDS_ANY_AO) && vshi_baking_shares(bake),
                                 .fills = texels->fills,
                                 .threads = bake->run.threads};
    const double bytes =
        fields_bytes(bake) + (double)texels->info.bytes + vshi_bake_bytes(&need) +
        vshi_work_planes_bytes(texels, bake->lightmap, bake->light_count) +
        (vshi_baking_holds(bake) ? (double)VSHI_FIELD_ERROR_MOST * VSHI_FIELD_ERROR_BYTES : 0.0);
    return vshi_check_limit(&bake->run, bytes, "lightmap", error);
}

/* Memory for what `any` of needs of each sample. */
static vsh_result hold(const vshi_baking *bake, uint32_t any, size_t floats, float **samples,
                       vsh_error *error) {
    return vshi_allocate((void **)samples, needs(bake, any) ? bake->origins.count : 0, floats * sizeof(float),
                         "lightmap", error);
}

/* The options' layers for points that start_offset and surface_offset have lifted off `field`: what their own
 * voxels need beyond that is left. *layers [occluders->layer_count], which the caller frees also after an
 * error; *ao: whether any takes part in AO. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_MEMORY. */
static vsh_result lift_layers(const vsh_occluders *occluders, const vsh_shade_options *shade,
                              vsh_layer **layers, bool *ao, vsh_error *error) {
    const double lifted = shade->start_offset * occluders->field->voxel_size + shade->surface_offset;
    *ao = false;
    VSHI_TRY(vshi_allocate((void **)layers, occluders->layer_count, sizeof **layers, "layers", error));
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        vsh_layer *layer = &(*layers)[i];
        *layer = occluders->layers[i];
        *ao = *ao || layer->ao != 0;
        if (layer->field != NULL) {
            const vsh_field *own = layer->field;
            const double offset = layer->start_offset < 0.0 ? shade->start_offset : layer->start_offset;
            const double height =
                offset * own->voxel_size + 0.5 * own->shell_thickness + shade->surface_offset;
            layer->start_offset = fmin(16.0, fmax(0.0, (height - lifted) / own->voxel_size));
        }
    }
    return VSH_OK;
}

/* --- which texels have values */

/* Writes the planes `coverage` and `invalid` of a lightmap whose rows are those held, where it has them, and
 * counts the band's texels, those without a value by the mesh of their first sample. */
static void write_coverage(const vsh_texels *texels, const uint8_t *state, const vsh_lightmap *lightmap,
                           vsh_bake_stats *stats) {
    const vshi_band *band = &texels->band;
    const size_t first = texels->row_start[band->own_begin - band->held_begin];
    const size_t last = texels->row_start[band->own_end - band->held_begin];
    size_t invalid = 0;
    for (size_t i = first; i < last; ++i) {
        if (i > first && texels->texel[i] == texels->texel[i - 1]) {
            continue;
        }
        const size_t texel = vshi_sample_held(texels, i);
        if (state[texel] == VSHI_TEXEL_INVALID) {
            ++invalid;
            if (lightmap->invalid != NULL) {
                lightmap->invalid[texel] = 1.0f;
            }
            if (stats->invalid_by_mesh != NULL) {
                ++stats->invalid_by_mesh[vshi_sample_mesh(texels, i)];
            }
        } else if (lightmap->coverage != NULL) {
            lightmap->coverage[texel] = 1.0f;
        }
    }
    stats->texels = texels->info.covered;
    stats->invalid_texels = invalid;
}

static vsh_result run_bake(vshi_baking *bake, vsh_error *error) {
    const vsh_texels *texels = bake->texels;
    vsh_result result;
    VSHI_TRY_DONE(lift_layers(bake->occluders, &bake->shade, &bake->layers, &bake->layered_ao, error));
    bake->lifted = *bake->occluders;
    bake->lifted.layers = bake->layers;
    bake->lifted.lifted = bake->shade.start_offset * bake->occluders->field->voxel_size;
    VSHI_TRY_DONE(check_limit(bake, error));
    VSHI_TRY_DONE(vshi_work_planes_open(texels, bake->lightmap, bake->light_count, &bake->work, error));
    bake->lightmap = &bake->work.lightmap;
    VSHI_TRY_DONE(vshi_allocate((void **)&bake->state, vshi_texels_held(texels), 1, "lightmap", error));
    const vshi_origins_for what = {needs(bake, VSHI_NEEDS_LIGHTS), needs(bake, NEEDS_ANY_AO)};
    VSHI_TRY_DONE(vshi_origins_create(bake->occluders, texels, &bake->shade, what, find_needed, bake,
                                      &bake->run, &bake->origins, error));
    VSHI_TRY_DONE(hold(bake, VSHI_NEEDS_LIGHTS | NEEDS_ANY_AO, 1, &bake->values, error));
    VSHI_TRY_DONE(hold(bake, VSHI_NEEDS_DEVIATION | VSHI_NEEDS_LIGHTS, 1, &bake->deviation, error));
    VSHI_TRY_DONE(hold(bake, VSHI_NEEDS_IRRADIANCE, 3, &bake->irradiance, error));
    VSHI_TRY_DONE(hold(bake, VSHI_NEEDS_BENT, 3, &bake->bent, error));
    VSHI_TRY_DONE(hold(bake, VSHI_NEEDS_TINT, 3, &bake->tinted, error));
    if (vshi_baking_holds(bake)) {
        VSHI_TRY_DONE(vshi_baking_choose_held(bake, error));
    }
    VSHI_TRY_DONE(bake_planes(bake, error));
    write_coverage(texels, bake->state, bake->lightmap, &bake->stats);
    if (bake->known == NULL) {
        VSHI_TRY_DONE(pad(bake, bake->stats.invalid_texels, error));
        VSHI_TRY_DONE(vshi_baking_add_filled(bake, error));
    }
    vshi_work_planes_copy_back(texels, &bake->work);
done:
    free(bake->layers);
    free(bake->tinted);
    free(bake->bent);
    free(bake->irradiance);
    free(bake->deviation);
    free(bake->values);
    free(bake->state);
    vshi_field_error_free(&bake->held);
    vshi_spread_free(&bake->spread);
    vshi_origins_free(&bake->origins);
    vshi_work_planes_close(&bake->work);
    return result;
}

/* Checks planes, tint, ambient light and lights. */
static vsh_result check(const vsh_lightmap *lightmap, const vsh_texels *texels, const vsh_light *lights,
                        size_t light_count, vsh_error *error) {
    const bool turns = texels->tangent != NULL || texels->count == 0; /* rows without a chart have none */
    if (lightmap->bent != NULL && lightmap->bent_space != VSH_BENT_WORLD &&
        (lightmap->bent_space != VSH_BENT_TANGENT || !turns)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "bent_space %d: expected %d, or %d with texels that have tangents",
                         lightmap->bent_space, VSH_BENT_WORLD, VSH_BENT_TANGENT);
    }
    VSHI_TRY(vsh_tint_check(&lightmap->tint_by, error));
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

static vsh_result bake_texels(const vsh_occluders *occluders, const vsh_texels *texels,
                              const vsh_light *lights, size_t light_count, const vsh_shade_options *options,
                              const vsh_run *run, const vsh_lightmap *lightmap, uint32_t *known, void *kept,
                              vsh_bake_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(texels);
    VSHI_NEEDS(lightmap);
    VSHI_NEEDS_OF(light_count, lights);
    vshi_baking bake = {.occluders = occluders,
                        .texels = texels,
                        .lights = lights,
                        .light_count = light_count,
                        .lightmap = lightmap,
                        .known = known,
                        .keep = {.cut = &texels->cut, .memory = kept},
                        .needs = vshi_planes_need(lightmap, light_count),
                        .stats = vsh_bake_stats_zero()};
    VSHI_TRY(vshi_shade_options_resolve(options != NULL ? options : &texels->shade, &bake.shade, error));
    VSHI_TRY(vshi_run_resolve(run, &bake.run, error));
    VSHI_TRY(vshi_options_resolve(stats, &bake.stats, sizeof bake.stats, "vsh_bake_stats", error));
    bake.quiet = bake.run;
    bake.quiet.progress = NULL;
    VSHI_TRY(check(lightmap, texels, lights, light_count, error));
    for (size_t m = 0; bake.stats.invalid_by_mesh != NULL && m < texels->mesh_count; ++m) {
        bake.stats.invalid_by_mesh[m] = 0;
    }
    bake.keep.width = texels->info.width;
    bake.keep.first = texels->band.own_first;
    bake.keep.end = texels->band.own_first + texels->band.own_rows;
    vshi_ao_keep_clear(&bake.keep);
    bake.worst = bake.stats.shade.worst_error;
    bake.stats.shade.worst_error = 0.0;
    VSHI_TRY(run_bake(&bake, error));
    bake.stats.shade.worst_error = fmax(bake.stats.shade.worst_error, bake.worst);
    if (stats != NULL) {
        memcpy(stats, &bake.stats, stats->struct_size);
    }
    return VSH_OK;
}

vsh_result vsh_bake_lightmap(const vsh_occluders *occluders, const vsh_texels *texels,
                             const vsh_light *lights, size_t light_count, const vsh_shade_options *options,
                             const vsh_run *run, const vsh_lightmap *lightmap, vsh_bake_stats *stats,
                             vsh_error *error) {
    return bake_texels(occluders, texels, lights, light_count, options, run, lightmap, NULL, NULL, stats,
                       error);
}

vsh_result vshi_bake_part(const vsh_occluders *occluders, const vsh_texels *texels, const vsh_light *lights,
                          size_t light_count, const vsh_shade_options *options, const vsh_run *run,
                          const vsh_lightmap *lightmap, uint32_t *known, void *kept, vsh_bake_stats *stats,
                          vsh_error *error) {
    VSHI_NEEDS(known);
    return bake_texels(occluders, texels, lights, light_count, options, run, lightmap, known, kept, stats,
                       error);
}
