#include "bake/ambient.h"
#include "bake/ao_texels.h"
#include "bake/average.h"
#include "bake/bend.h"
#include "bake/coverage.h"
#include "bake/field_share.h"
#include "bake/halo.h"
#include "bake/lattice.h"
#include "bake/layers_lifted.h"
#include "bake/lift.h"
#include "bake/origins.h"
#include "bake/spread.h"
#include "bake/take.h"
#include "bake/wanted.h"
#include "base/floats.h"
#include "base/parallel.h"
#include "shade/layers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct baking {
    const vsh_occluders *occluders;
    const vsh_texels *texels;
    const vsh_light *lights;
    size_t light_count;
    vsh_shade_options shade;
    vsh_run run;
    vsh_run quiet; /* for steps of milliseconds that come once a plane: no stage of their own */
    const vsh_lightmap *lightmap; /* planes of all rows that the texels hold */
    vshi_halo halo;
    vshi_origins origins;
    vshi_spread spread;
    uint8_t *state;       /* [rows held][width]: VSHI_TEXEL_… */
    float *values;        /* [origins.count]: of one light, or AO */
    float *deviation;     /* [origins.count]: of the same; NULL where no plane is for it */
    float *irradiance;    /* [origins.count][3] */
    float *bent;          /* [origins.count][3] */
    float *tinted;        /* [origins.count][3]: of one light */
    vsh_layer *layers;    /* the occluders', of points that are lifted already; NULL: none */
    vsh_occluders lifted; /* with them */
    bool layered_ao;
    vshi_origins_for wanted;
    vshi_field_share held; /* samples that are held against the casters; none where that is not wanted */
    vsh_bake_stats stats;
} baking;

/* How far invalid texels are filled from other charts, texels. */
static int32_t invalid_radius(const vsh_texels *texels) {
    const int32_t least = VSHI_LEAST_INVALID_RADIUS;
    return texels->padding > least ? texels->padding : least;
}

/* Whether AO need not be shaded at every texel. `rays` are for those who want just them, taps cost no more;
 * what is near in a layer is not looked at. */
static bool interpolates(const baking *bake) {
    const int32_t method = bake->shade.ao_method;
    return bake->texels->ao_spacing > 1 && !bake->layered_ao &&
           (method == VSH_AO_CONES || (vsh_ao_method_traits(method) & VSH_METHOD_KEEPS_ERROR) != 0);
}

static bool traces_shadow(const baking *bake) {
    return vshi_shadow_traces(&bake->shade, bake->occluders->triangles);
}

static bool traces_ao(const baking *bake) {
    return vshi_ao_traces(&bake->shade, bake->occluders->triangles);
}

static bool shares(const baking *bake) {
    return interpolates(bake) && traces_ao(bake);
}

static double fields_bytes(const baking *bake) {
    vsh_field_info info;
    vsh_field_get_info(bake->occluders->field, &info);
    double bytes = (double)info.bytes;
    for (size_t i = 0; i < bake->occluders->layer_count; ++i) {
        bytes += vshi_layer_bytes(&bake->occluders->layers[i]);
    }
    return bytes;
}

/* Where rays begin: lifted already, but for methods that trace triangles. Those know the surface better than
 * any voxel does, and lift their cones themselves. */
static vsh_points points_of(const baking *bake, bool traced, vsh_shade_options *shade,
                            const vsh_occluders **occluders) {
    const vshi_origins *origins = &bake->origins;
    *shade = bake->shade;
    *occluders = traced ? bake->occluders : &bake->lifted;
    if (!traced) {
        shade->start_offset = 0.0;
        shade->surface_offset = 0.0;
    }
    return (vsh_points){origins->count, traced ? origins->surface : origins->position, origins->normal,
                        origins->texel};
}

/* Averages samples over texels: of deviations not into the state. */
static vsh_result average(baking *bake, const float *values, size_t channels, float *plane,
                          vsh_error *error) {
    const vshi_average task = {.texels = bake->texels,
                               .origins = &bake->origins,
                               .values = values,
                               .channels = channels,
                               .deviation = values != NULL && values == bake->deviation,
                               .plane = plane,
                               .state = bake->state};
    return vshi_average_run(&task, &bake->quiet, error);
}

/* --- the planes */

typedef struct lighting {
    baking *bake;
    const vsh_light *light;
} lighting;

static void add_irradiance(void *user, size_t begin, size_t end) {
    const lighting *l = user;
    baking *bake = l->bake;
    const vsh_points points = {end - begin, bake->origins.position + 3 * begin,
                               bake->origins.normal + 3 * begin, NULL};
    vshi_shade_irradiance(&points, NULL, l->light, bake->values + begin, &bake->lightmap->tint_by,
                          bake->irradiance + 3 * begin);
}

static void tint(void *user, size_t begin, size_t end) {
    const lighting *l = user;
    vsh_shade_tint(end - begin, l->bake->values + begin, &l->bake->lightmap->tint_by,
                   l->bake->tinted + 3 * begin);
}

/* Runs a step over all samples. */
static vsh_result over_samples(baking *bake, const char *what, vshi_range_fn *step, void *user,
                               vsh_error *error) {
    vshi_job *job = vshi_job_begin(&bake->quiet, what, bake->origins.count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
    }
    const vsh_result result = vshi_parallel_for(job, bake->origins.count, 4096, 1, step, user, error);
    vshi_job_end(job);
    return result;
}

/* --- what is known of their errors */

static bool keeps_error(const baking *bake, const vsh_light *light) {
    const uint32_t traits = light != NULL ? vsh_shadow_method_traits(bake->shade.method)
                                          : vsh_ao_method_traits(bake->shade.ao_method);
    return (traits & VSH_METHOD_KEEPS_ERROR) != 0;
}

/* Whether samples are to be held against the casters. */
static bool holds(const baking *bake) {
    const vsh_occluders *casters = bake->occluders;
    const bool estimates = (bake->wanted.lights && keeps_error(bake, bake->lights)) ||
                           (bake->wanted.ao && keeps_error(bake, NULL));
    return bake->stats.errors != NULL && (casters->true_triangles != NULL || casters->true_solids != NULL) &&
           casters->layer_count == 0 && estimates;
}

static vsh_result choose_held(baking *bake, vsh_error *error) {
    const vshi_truth truth = vshi_field_share_truth(bake->occluders, &bake->shade);
    const bool traced =
        (!bake->wanted.lights || traces_shadow(bake)) && (!bake->wanted.ao || traces_ao(bake));
    return vshi_field_share_choose(bake->texels, &bake->origins, bake->state, &truth, traced, &bake->quiet,
                                   &bake->held, error);
}

static vsh_bake_error *error_of(const baking *bake, const vsh_light *light) {
    return &bake->stats.errors[light != NULL ? (size_t)(light - bake->lights) : bake->light_count];
}

/* Adds a channel's error, of a light or (NULL) of AO; `square` is what the stats held before it. */
static vsh_result add_error(baking *bake, const vsh_light *light, double square, vsh_error *error) {
    if (bake->stats.errors == NULL || !keeps_error(bake, light)) {
        return VSH_OK;
    }
    const vshi_point_rows *rows = &bake->origins.rows;
    vsh_bake_error *sum = error_of(bake, light);
    sum->values += (double)(rows->start[rows->last] - rows->start[rows->first]);
    sum->square_error += bake->stats.shade.square_error - square;
    return bake->held.count > 0 ? vshi_field_share_add(&bake->held, light, &bake->shade, bake->values, NULL,
                                                       &bake->quiet, sum, error)
                                : VSH_OK;
}

/* Adds what is filled, once it is: of the planes that there are. */
static vsh_result add_filled(baking *bake, vsh_error *error) {
    const vsh_lightmap *lightmap = bake->lightmap;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i <= bake->light_count && result == VSH_OK && bake->held.count > 0; ++i) {
        const vsh_light *light = i < bake->light_count ? &bake->lights[i] : NULL;
        const float *plane = light == NULL              ? lightmap->ao
                             : lightmap->shadow != NULL ? lightmap->shadow[i]
                                                        : NULL;
        if (plane != NULL && keeps_error(bake, light)) {
            result = vshi_field_share_add(&bake->held, light, &bake->shade, NULL, plane, &bake->quiet,
                                          error_of(bake, light), error);
        }
    }
    return result;
}

static vsh_result bake_light(baking *bake, size_t index, vsh_error *error) {
    const vsh_lightmap *lightmap = bake->lightmap;
    vsh_shade_options shade;
    const vsh_occluders *occluders;
    const vsh_points points = points_of(bake, traces_shadow(bake), &shade, &occluders);
    const double square = bake->stats.shade.square_error;
    float *shadow = lightmap->shadow != NULL ? lightmap->shadow[index] : NULL;
    float *errors = lightmap->shadow_error != NULL ? lightmap->shadow_error[index] : NULL;
    vsh_result result =
        vshi_lift_for(bake->texels, &bake->lights[index], &bake->quiet, &bake->origins, error);
    if (result == VSH_OK) {
        result = vshi_shade_shadow(occluders, &points, &bake->origins.rows, &bake->lights[index], &shade,
                                   &bake->run, bake->values, errors != NULL ? bake->deviation : NULL,
                                   &bake->stats.shade, error);
    }
    if (result == VSH_OK && errors != NULL) {
        result = average(bake, bake->deviation, 1, errors, error);
    }
    if (result == VSH_OK && shadow != NULL) {
        result = average(bake, bake->values, 1, shadow, error);
    }
    if (result == VSH_OK) {
        result = add_error(bake, &bake->lights[index], square, error);
    }
    lighting l = {bake, &bake->lights[index]};
    if (result == VSH_OK && vshi_tint_of(lightmap, index) != NULL) {
        result = over_samples(bake, "tint", tint, &l, error);
        result =
            result == VSH_OK ? average(bake, bake->tinted, 3, vshi_tint_of(lightmap, index), error) : result;
    }
    if (result != VSH_OK || lightmap->irradiance == NULL) {
        return result;
    }
    return over_samples(bake, "irradiance", add_irradiance, &l, error);
}

static vsh_result bake_bent(baking *bake, vsh_error *error) {
    float *plane = bake->lightmap->bent;
    vsh_result result =
        vshi_bend(bake->texels, &bake->origins, bake->lightmap->bent_space, &bake->quiet, bake->bent, error);
    if (result == VSH_OK) {
        result = average(bake, bake->bent, 3, plane, error);
    }
    if (result == VSH_OK) {
        vshi_bend_again(vshi_texels_held(bake->texels), plane);
    }
    return result;
}

/* A vshi_origins_keep: which texels are valid, where the others take their values from, and which rows beside
 * the band's own are needed: all that are in reach of padding, and of others those that are taken from. */
static vsh_result find_needed(void *user, const vshi_origins *origins, uint8_t *rows, vsh_error *error) {
    baking *bake = user;
    const vsh_texels *texels = bake->texels;
    const vshi_band *band = &texels->band;
    const size_t count = band->held_end - band->held_begin;
    (void)origins;
    vsh_result result = average(bake, NULL, 0, NULL, error);
    if (result == VSH_OK) {
        result = vshi_spread_find(texels, bake->state, &bake->spread, error);
    }
    uint8_t *taken = vshi_take(count, 1, "lightmap rows", &result, error);
    if (result != VSH_OK) {
        return result;
    }
    vshi_spread_mark(&bake->spread, texels, taken);
    const size_t near = ((size_t)invalid_radius(texels) + VSHI_TILE - 1) / VSHI_TILE;
    for (size_t row = 0; row < count; ++row) {
        const size_t at = row + band->held_begin;
        taken[row] = taken[row] || (at + near >= band->own_begin && at < band->own_end + near);
    }
    const bool shared = interpolates(bake) && vshi_ao_wanted(bake->lightmap);
    const size_t above = shared ? VSHI_AO_ABOVE : 0, below = shared ? VSHI_AO_BELOW : 0;
    for (size_t row = 0; row < count; ++row) {
        rows[row] = 0;
        for (size_t other = row > below ? row - below : 0; other <= row + above && other < count; ++other) {
            rows[row] = rows[row] || taken[other];
        }
    }
    free(taken);
    return VSH_OK;
}

static vsh_result bake_planes(baking *bake, vsh_error *error) {
    const vsh_lightmap *lightmap = bake->lightmap;
    const vsh_texels *texels = bake->texels;
    vsh_result result = VSH_OK;
    for (size_t i = 0; result == VSH_OK && i < bake->light_count; ++i) {
        if (vshi_light_wanted(lightmap, i)) {
            result = bake_light(bake, i, error);
        }
    }
    if (result == VSH_OK && vshi_ao_wanted(lightmap)) {
        vsh_shade_options shade;
        const vsh_occluders *occluders;
        const vsh_points points = points_of(bake, traces_ao(bake), &shade, &occluders);
        const double square = bake->stats.shade.square_error;
        float *deviation = lightmap->ao_error != NULL ? bake->deviation : NULL;
        result = vshi_lift_for(texels, NULL, &bake->quiet, &bake->origins, error);
        if (result == VSH_OK) {
            result =
                shares(bake) ? vshi_ao_texels(occluders, texels, &bake->origins, &points, &shade, &bake->run,
                                              bake->values, deviation, bake->bent, &bake->stats.shade, error)
                : interpolates(bake)
                    ? vshi_lattice_ao(occluders, texels, &bake->origins, &points, &shade, &bake->run,
                                      bake->values, deviation, bake->bent, &bake->stats.shade, error)
                    : vshi_shade_ao(occluders, &points, &bake->origins.rows, &shade, &bake->run, bake->values,
                                    deviation, bake->bent, NULL, &bake->stats.shade, error);
        }
        if (result == VSH_OK && lightmap->ao_error != NULL) {
            result = average(bake, bake->deviation, 1, lightmap->ao_error, error);
        }
        if (result == VSH_OK && lightmap->ao != NULL) {
            result = average(bake, bake->values, 1, lightmap->ao, error);
        }
        if (result == VSH_OK) {
            result = add_error(bake, NULL, square, error);
        }
        if (result == VSH_OK && lightmap->bent != NULL) {
            result = bake_bent(bake, error);
        }
    }
    if (result == VSH_OK && lightmap->irradiance != NULL && bake->light_count > 0) {
        result = average(bake, bake->irradiance, 3, lightmap->irradiance, error);
        if (result == VSH_OK) {
            vshi_ambient_add(texels, bake->state, lightmap);
        }
    }
    return result;
}

static vsh_result pad(baking *bake, size_t invalid, vsh_error *error) {
    const vsh_texels *texels = bake->texels;
    const int32_t radius[VSHI_TEXEL_KINDS] = {
        [VSHI_TEXEL_EMPTY] = texels->padding,
        [VSHI_TEXEL_INVALID] = invalid > 0 ? invalid_radius(texels) : 0,
    };
    vshi_spread_copy(&bake->spread, bake->state, bake->halo.planes, bake->halo.padded);
    return vshi_padding_fill(&bake->run, texels->info.width, texels->band.rows, bake->state, radius,
                             bake->halo.planes, bake->halo.padded, error);
}

static vsh_result run_bake(baking *bake, bool values, bool irradiance, vsh_error *error) {
    const vsh_texels *texels = bake->texels;
    const bool errors = vshi_errors_wanted(bake->lightmap, bake->light_count);
    const bool ao = vshi_ao_wanted(bake->lightmap);
    const vshi_bake_need need = {.samples = (double)texels->count,
                                 .texels = (double)vshi_texels_held(texels),
                                 .traced = traces_shadow(bake) || traces_ao(bake),
                                 .values = values,
                                 .errors = errors,
                                 .irradiance = irradiance,
                                 .bent = bake->lightmap->bent != NULL,
                                 .tint = vshi_tint_wanted(bake->lightmap, bake->light_count),
                                 .lattice = ao && interpolates(bake) && !shares(bake),
                                 .windows = ao && shares(bake),
                                 .threads = bake->run.threads};
    vsh_result result =
        vshi_lift_layers(bake->occluders, &bake->shade, &bake->layers, &bake->layered_ao, error);
    if (result != VSH_OK) {
        free(bake->layers);
        return result;
    }
    bake->lifted = *bake->occluders;
    bake->lifted.layers = bake->layers;
    const double bytes = fields_bytes(bake) + (double)texels->info.bytes + vshi_bake_bytes(&need) +
                         vshi_halo_bytes(texels, bake->lightmap, bake->light_count) +
                         (holds(bake) ? (double)VSHI_FIELD_SHARE_MOST * VSHI_FIELD_SHARE_BYTES : 0.0);
    result = vshi_check_limit(&bake->run, bytes, "lightmap", error);
    if (result != VSH_OK) {
        free(bake->layers);
        return result;
    }
    result = vshi_halo_open(texels, bake->lightmap, bake->light_count, &bake->halo, error);
    bake->lightmap = &bake->halo.lightmap;
    bake->state = vshi_take(vshi_texels_held(texels), 1, "lightmap", &result, error);
    if (result == VSH_OK) {
        result = vshi_origins_create(bake->occluders, texels, &bake->shade, bake->wanted, find_needed, bake,
                                     &bake->run, &bake->origins, error);
    }
    const size_t count = bake->origins.count;
    bake->values = vshi_take(values ? count : 0, sizeof(float), "lightmap", &result, error);
    bake->deviation = vshi_take(errors ? count : 0, sizeof(float), "lightmap", &result, error);
    bake->irradiance = vshi_take(irradiance ? count : 0, 3 * sizeof(float), "lightmap", &result, error);
    bake->bent =
        vshi_take(bake->lightmap->bent != NULL ? count : 0, 3 * sizeof(float), "lightmap", &result, error);
    bake->tinted = vshi_take(need.tint ? count : 0, 3 * sizeof(float), "lightmap", &result, error);
    if (result == VSH_OK && holds(bake)) {
        result = choose_held(bake, error);
    }
    if (result == VSH_OK) {
        result = bake_planes(bake, error);
    }
    if (result == VSH_OK) {
        vshi_coverage_write(texels, &bake->origins, bake->state, bake->lightmap, &bake->stats);
        result = pad(bake, bake->stats.invalid_texels, error);
    }
    if (result == VSH_OK) {
        result = add_filled(bake, error);
    }
    if (result == VSH_OK) {
        vshi_halo_give(texels, &bake->halo);
    }
    free(bake->layers);
    free(bake->tinted);
    free(bake->bent);
    free(bake->irradiance);
    free(bake->deviation);
    free(bake->values);
    free(bake->state);
    vshi_field_share_free(&bake->held);
    vshi_spread_free(&bake->spread);
    vshi_origins_free(&bake->origins);
    vshi_halo_close(&bake->halo);
    return result;
}

vsh_result vsh_bake_lightmap(const vsh_occluders *occluders, const vsh_texels *texels,
                             const vsh_light *lights, size_t light_count, const vsh_shade_options *options,
                             const vsh_run *run, const vsh_lightmap *lightmap, vsh_bake_stats *stats,
                             vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(texels);
    VSHI_NEEDS(lightmap);
    VSHI_NEEDS_OF(light_count, lights);
    baking bake = {.occluders = occluders,
                   .texels = texels,
                   .lights = lights,
                   .light_count = light_count,
                   .lightmap = lightmap,
                   .stats = vsh_bake_stats_zero()};
    vsh_result result =
        vshi_shade_options_resolve(options != NULL ? options : &texels->shade, &bake.shade, error);
    if (result == VSH_OK) {
        result = vshi_run_resolve(run, &bake.run, error);
    }
    if (result == VSH_OK) {
        result = vshi_options_resolve(stats, &bake.stats, sizeof bake.stats, "vsh_bake_stats", error);
    }
    bake.quiet = bake.run;
    bake.quiet.progress = NULL;
    bool light = false;
    if (result == VSH_OK) {
        result = vshi_wanted_check(lightmap, texels, lights, light_count, &light, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    bake.wanted = (vshi_origins_for){light, vshi_ao_wanted(lightmap)};
    for (size_t m = 0; bake.stats.invalid_by_mesh != NULL && m < texels->mesh_count; ++m) {
        bake.stats.invalid_by_mesh[m] = 0;
    }
    result = run_bake(&bake, light || vshi_ao_wanted(lightmap), light && lightmap->irradiance != NULL, error);
    if (stats != NULL && result == VSH_OK) {
        memcpy(stats, &bake.stats, stats->struct_size);
    }
    return result;
}
