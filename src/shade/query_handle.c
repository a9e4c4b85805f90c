/* What queries of the same field, lights and options share. */
#include "base/floats.h"
#include "base/memory.h"
#include "base/try.h"
#include "shade/query.h"
#include "shade/shadow.h"

#include <stdlib.h>

void vsh_query_free(vsh_query *query) {
    if (query == NULL) {
        return;
    }
    for (size_t i = 0; query->layers != NULL && i <= query->light_count; ++i) {
        vshi_layers_free(query->layers[i]);
    }
    vshi_sampler_free(query->sampler);
    free(query->layers);
    free(query->shadow);
    free(query->lights);
    free(query);
}

static vsh_result prepare(vsh_query *q, const vsh_occluders *occluders, const vsh_light *lights,
                          size_t light_count, vsh_error *error) {
    static const char what[] = "lights of a query";
    VSHI_TRY(vshi_allocate((void **)&q->lights, light_count, sizeof *q->lights, what, error));
    VSHI_TRY(vshi_allocate((void **)&q->shadow, light_count, sizeof *q->shadow, what, error));
    VSHI_TRY(vshi_allocate((void **)&q->layers, light_count + 1, sizeof *q->layers, what, error));
    q->light_count = light_count;
    for (size_t l = 0; l < light_count; ++l) {
        vsh_error why;
        q->lights[l] = lights[l];
        const vsh_result result = vsh_light_check(&q->lights[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
        VSHI_TRY(vshi_layers_prepare(occluders, &q->options, &q->lights[l], &q->layers[l], error));
    }
    VSHI_TRY(vshi_layers_prepare(occluders, &q->options, NULL, &q->layers[light_count], error));
    vshi_shade_options_settle(&q->options, occluders->triangles);
    for (size_t l = 0; l < light_count; ++l) {
        vsh_error why;
        const vsh_result result =
            vshi_shadow_prepare(occluders, &q->lights[l], &q->options, &q->shadow[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
        q->shadow[l].layers = q->layers[l];
    }
    VSHI_TRY(vshi_ao_prepare(occluders, &q->options, &q->cones, &q->ao, error));
    q->ao.layers = q->layers[light_count];
    const bool shadow = light_count > 0 && vshi_shadow_has_rays(&q->options);
    if (shadow || vshi_ao_has_rays(&q->options)) {
        const int32_t own = shadow ? vshi_shadow_most_rays(&q->options) : 0;
        const int32_t ao = vshi_ao_has_rays(&q->options) ? vshi_ao_most_rays(&q->options) : 0;
        VSHI_TRY(vshi_shade_sampler(&q->options, own > ao ? own : ao, "query", &q->sampler, error));
    }
    for (size_t l = 0; l < q->light_count; ++l) {
        q->shadow[l].sampler = q->sampler;
    }
    q->ao.sampler = q->sampler;
    return VSH_OK;
}

vsh_result vsh_query_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                            const vsh_shade_options *options, vsh_query **query, vsh_error *error) {
    VSHI_NEEDS(query);
    *query = NULL;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS_OF(light_count, lights);
    return vshi_query_create(occluders, lights, light_count, options, false, query, error);
}

vsh_result vshi_query_create(const vsh_occluders *occluders, const vsh_light *lights, size_t light_count,
                             const vsh_shade_options *options, bool sphere, vsh_query **query,
                             vsh_error *error) {
    VSHI_FLOATS;
    vsh_query *q = NULL;
    *query = NULL;
    VSHI_TRY(vshi_allocate((void **)&q, 1, sizeof *q, "query", error));
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_shade_options_resolve(options, &q->options, error));
    VSHI_TRY_DONE(prepare(q, occluders, lights, light_count, error));
    if (sphere) {
        VSHI_TRY_DONE(vshi_ao_prepare_sphere(&q->cones, &q->ao, error));
        VSHI_TRY_DONE(vshi_layers_prepare_sphere(q->layers[light_count], error));
    }
    *query = q;
    q = NULL;
done:
    vsh_query_free(q);
    return result;
}

void vshi_query_prove(const vsh_query *query, int32_t isa, size_t light, size_t count,
                      const double (*centre)[3], const double *radius, int8_t *proof,
                      vsh_shade_stats *stats) {
    vshi_shadow_task task = query->shadow[light];
    task.kernel = vshi_kernel_of(isa);
    vshi_vec at[VSHI_QUERY_BALLS];
    double voxels[VSHI_QUERY_BALLS];
    for (size_t i = 0; i < count; ++i) {
        at[i] = vshi_to_field(task.field, centre[i]);
        voxels[i] = radius[i] / task.field->voxel_size;
    }
    vshi_blocks_prove_balls(&task, count, at, voxels, proof, stats);
    for (size_t i = 0; i < count && task.layers != NULL; ++i) {
        proof[i] = proof[i] == VSHI_PROVED_FREE ? VSHI_UNPROVED : proof[i]; /* layers may hide the light */
    }
}
