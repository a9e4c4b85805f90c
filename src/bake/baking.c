#include "bake/baking.h"
#include "bake/shadow_smooth.h"

#include "bake/ao_texels.h"
#include "bake/average.h"
#include "bake/bent_normals.h"
#include "bake/planes.h"
#include "base/try.h"
#include "shade/ao.h"
#include "shade/shadow.h"

#include <math.h>

bool vshi_baking_traces_shadow(const vshi_baking *bake) {
    return vshi_shadow_traces(&bake->shade, bake->occluders->triangles);
}

bool vshi_baking_traces_ao(const vshi_baking *bake) {
    return vshi_ao_traces(&bake->shade, bake->occluders->triangles);
}

bool vshi_ao_is_shared(const vsh_shade_options *shade, int32_t spacing, bool layered_ao) {
    return spacing > 1 && !layered_ao &&
           (vsh_ao_method_traits(shade->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
}

bool vshi_baking_shares(const vshi_baking *bake) {
    return vshi_ao_is_shared(&bake->shade, bake->texels->ao_spacing, bake->layered_ao);
}

/* Finds where the rays to a light, or of AO (NULL), begin. Marched ones have their start offset already;
 * traced ones begin on the triangles, and shading adds the offset. */
static vsh_result place_points(vshi_baking *bake, const vsh_light *light, bool traced,
                               vsh_shade_options *shade, const vsh_occluders **occluders, vsh_points *points,
                               vsh_error *error) {
    vshi_origins *origins = &bake->origins;
    *occluders = traced ? bake->occluders : &bake->lifted;
    if (!traced) {
        shade->start_offset = 0.0;
        shade->surface_offset = 0.0;
    }
    *points = (vsh_points){origins->count, origins->start, origins->normal, origins->texel};
    if (!traced && !bake->texels->smooth) { /* nothing is lifted */
        points->positions = origins->position;
        return VSH_OK;
    }
    const vshi_lifter lifter = vshi_lifter_open(bake->occluders, light);
    return vshi_origins_lift(&lifter, bake->texels, traced, &bake->quiet, origins, error);
}

vsh_result vshi_baking_average(vshi_baking *bake, const float *values, size_t components, float *plane,
                               vsh_error *error) {
    const vshi_average task = {.texels = bake->texels,
                               .origins = &bake->origins,
                               .values = values,
                               .channels = components,
                               .deviation = values != NULL && values == bake->deviation,
                               .plane = plane,
                               .state = bake->state};
    return vshi_average_run(&task, &bake->quiet, error);
}

vsh_result vshi_baking_step(vshi_baking *bake, const char *what, vshi_range_fn *step, void *user,
                            vsh_error *error) {
    vshi_job *job = vshi_job_begin(&bake->quiet, what, bake->origins.count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
    }
    const vsh_result result = vshi_parallel_for(job, bake->origins.count, 4096, 1, step, user, error);
    vshi_job_end(job);
    return result;
}

/* --- lights */

typedef struct lighting {
    vshi_baking *bake;
    const vsh_light *light;
} lighting;

static void add_irradiance(void *user, size_t begin, size_t end) {
    const lighting *l = user;
    vshi_baking *bake = l->bake;
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

vsh_result vshi_bake_light(vshi_baking *bake, size_t index, vsh_error *error) {
    const vsh_lightmap *lightmap = bake->lightmap;
    const vsh_light *light = &bake->lights[index];
    vsh_shade_options shade = bake->shade;
    const vsh_occluders *occluders;
    vsh_points points;
    const double square = bake->stats.shade.square_error;
    float *shadow = lightmap->shadow != NULL ? lightmap->shadow[index] : NULL;
    float *errors = lightmap->shadow_error != NULL ? lightmap->shadow_error[index] : NULL;
    float *tinted = lightmap->tint != NULL ? lightmap->tint[index] : NULL;
    VSHI_TRY(place_points(bake, light, vshi_baking_traces_shadow(bake), &shade, &occluders, &points, error));
    vshi_point_rows rows = bake->origins.rows;
    rows.only = bake->known != NULL; /* nothing is copied from the others */
    VSHI_TRY(vshi_shade_shadow(occluders, &points, &rows, light, &shade, &bake->run, bake->values,
                               bake->deviation, &bake->stats.shade, error));
    if (shade.max_error >= VSHI_COARSE) { /* finer values are smooth by themselves */
        VSHI_TRY(vshi_shadow_smooth(&bake->origins, &bake->quiet, bake->values, bake->deviation, error));
    }
    if (errors != NULL) {
        VSHI_TRY(vshi_baking_average(bake, bake->deviation, 1, errors, error));
    }
    if (shadow != NULL) {
        VSHI_TRY(vshi_baking_average(bake, bake->values, 1, shadow, error));
    }
    VSHI_TRY(vshi_baking_add_error(bake, index, square, error));
    lighting l = {bake, light};
    if (tinted != NULL) {
        VSHI_TRY(vshi_baking_step(bake, "tint", tint, &l, error));
        VSHI_TRY(vshi_baking_average(bake, bake->tinted, 3, tinted, error));
    }
    return lightmap->irradiance != NULL ? vshi_baking_step(bake, "irradiance", add_irradiance, &l, error)
                                        : VSH_OK;
}

/* --- AO */

vsh_result vshi_baking_open(vshi_baking *bake, bool sky, float *deviation, float *bent, vsh_error *error) {
    vsh_shade_options shade = vshi_baking_options(bake, sky);
    const vsh_occluders *occluders;
    vsh_points points;
    VSHI_TRY(place_points(bake, NULL, vshi_baking_traces_ao(bake), &shade, &occluders, &points, error));
    if (!vshi_baking_shares(bake)) {
        return vshi_shade_ao(occluders, &points, bake->origins.face, &bake->origins.rows, &shade, &bake->run,
                             bake->values, deviation, bent, NULL, &bake->stats.shade, error);
    }
    bake->keep.sky = sky;
    return vshi_ao_texels(occluders, bake->texels, &bake->origins, &points, &shade, &bake->run, &bake->keep,
                          bake->values, deviation, bent, &bake->stats.shade, error);
}

vsh_result vshi_bake_ao(vshi_baking *bake, vsh_error *error) {
    const vsh_lightmap *lightmap = bake->lightmap;
    const double square = bake->stats.shade.square_error;
    VSHI_TRY(vshi_baking_open(bake, false, lightmap->ao_error != NULL ? bake->deviation : NULL, bake->bent,
                              error));
    if (lightmap->ao_error != NULL) {
        VSHI_TRY(vshi_baking_average(bake, bake->deviation, 1, lightmap->ao_error, error));
    }
    if (lightmap->ao != NULL) {
        VSHI_TRY(vshi_baking_average(bake, bake->values, 1, lightmap->ao, error));
    }
    VSHI_TRY(vshi_baking_add_error(bake, bake->light_count, square, error));
    if (lightmap->bent != NULL) {
        VSHI_TRY(vshi_bent_normals(bake->texels, &bake->origins, lightmap->bent_space, &bake->keep,
                                   &bake->quiet, bake->bent, error));
        VSHI_TRY(vshi_baking_average(bake, bake->bent, 3, lightmap->bent, error));
        vshi_bent_normals_again(vshi_texels_held(bake->texels), lightmap->bent);
    }
    return VSH_OK;
}

/* --- what is known of their errors */

static bool keeps_error(const vshi_baking *bake, bool of_light) {
    const uint32_t traits =
        of_light ? vsh_shadow_method_traits(bake->shade.method) : vsh_ao_method_traits(bake->shade.ao_method);
    return (traits & VSH_METHOD_KEEPS_ERROR) != 0;
}

bool vshi_baking_holds(const vshi_baking *bake) {
    const vsh_occluders *casters = bake->occluders;
    const bool estimates =
        ((bake->needs & VSHI_NEEDS_LIGHTS) != 0 && keeps_error(bake, true)) ||
        ((bake->needs & (VSHI_NEEDS_AO | VSHI_NEEDS_OPEN)) != 0 && keeps_error(bake, false));
    return bake->stats.errors != NULL && (casters->true_triangles != NULL || casters->true_solids != NULL) &&
           casters->layer_count == 0 && estimates;
}

vsh_result vshi_baking_choose_held(vshi_baking *bake, vsh_error *error) {
    const vshi_truth truth = vshi_field_error_truth(bake->occluders, &bake->shade);
    const bool traced =
        ((bake->needs & VSHI_NEEDS_LIGHTS) == 0 || vshi_baking_traces_shadow(bake)) &&
        ((bake->needs & (VSHI_NEEDS_AO | VSHI_NEEDS_OPEN)) == 0 || vshi_baking_traces_ao(bake));
    return vshi_field_error_choose(bake->texels, &bake->origins, bake->state, bake->occluders, &truth, traced,
                                   &bake->quiet, &bake->held, error);
}

/* Channels in the order of their errors: lights, AO, the sky. */
static const float *plane_of(const vshi_baking *bake, size_t channel) {
    const vsh_lightmap *lightmap = bake->lightmap;
    if (channel < bake->light_count) {
        return lightmap->shadow != NULL ? lightmap->shadow[channel] : NULL;
    }
    return channel == bake->light_count ? lightmap->ao : lightmap->sky;
}

/* Holds the samples chosen against the casters; `values` and `filled` as of vshi_field_error_add(). */
static vsh_result hold_channel(vshi_baking *bake, size_t channel, const float *values, const float *filled,
                               vsh_error *error) {
    const vsh_light *light = channel < bake->light_count ? &bake->lights[channel] : NULL;
    const vsh_shade_options options = vshi_baking_options(bake, channel > bake->light_count);
    return vshi_field_error_add(&bake->held, light, &options, values, filled,
                                light == NULL ? &bake->keep : NULL, &bake->quiet,
                                &bake->stats.errors[channel], error);
}

vsh_result vshi_baking_add_error(vshi_baking *bake, size_t channel, double square, vsh_error *error) {
    if (bake->stats.errors == NULL || !keeps_error(bake, channel < bake->light_count)) {
        return VSH_OK;
    }
    const vshi_point_rows *rows = &bake->origins.rows;
    vsh_bake_error *sum = &bake->stats.errors[channel];
    sum->values += (double)(rows->start[rows->last] - rows->start[rows->first]);
    sum->square_error += bake->stats.shade.square_error - square;
    sum->worst = fmax(sum->worst, bake->stats.shade.worst_error);
    bake->worst = fmax(bake->worst, bake->stats.shade.worst_error);
    bake->stats.shade.worst_error = 0.0; /* of the next channel */
    return bake->held.count > 0 ? hold_channel(bake, channel, bake->values, NULL, error) : VSH_OK;
}

vsh_result vshi_baking_add_filled(vshi_baking *bake, vsh_error *error) {
    for (size_t i = 0; i < bake->light_count + 2 && bake->held.count > 0; ++i) {
        const float *plane = plane_of(bake, i);
        if (plane != NULL && keeps_error(bake, i < bake->light_count)) {
            VSHI_TRY(hold_channel(bake, i, NULL, plane, error));
        }
    }
    return VSH_OK;
}
