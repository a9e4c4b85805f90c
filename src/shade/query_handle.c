/* What queries of the same field, lights and options share. */
#include "base/floats.h"
#include "base/memory.h"
#include "shade/blocks.h"
#include "shade/query.h"

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
    vsh_result result =
        vshi_allocate((void **)&q->lights, light_count, sizeof *q->lights, "lights of a query", error);
    if (result == VSH_OK) {
        result =
            vshi_allocate((void **)&q->shadow, light_count, sizeof *q->shadow, "lights of a query", error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&q->layers, light_count + 1, sizeof *q->layers, "lights of a query",
                               error);
    }
    q->light_count = result == VSH_OK ? light_count : 0;
    for (size_t l = 0; result == VSH_OK && l < light_count; ++l) {
        vsh_error why;
        q->lights[l] = lights[l];
        result = vsh_light_check(&q->lights[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
        result = vshi_layers_prepare(occluders, &q->options, &q->lights[l], &q->layers[l], error);
    }
    if (result == VSH_OK) {
        result = vshi_layers_prepare(occluders, &q->options, NULL, &q->layers[light_count], error);
    }
    vshi_shade_options_settle(&q->options, occluders->triangles);
    for (size_t l = 0; result == VSH_OK && l < light_count; ++l) {
        vsh_error why;
        result = vshi_shadow_prepare(occluders, &q->lights[l], &q->options, &q->shadow[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
        q->shadow[l].layers = q->layers[l];
    }
    if (result == VSH_OK) {
        result = vshi_ao_prepare(occluders, &q->options, &q->cones, &q->ao, error);
        q->ao.layers = q->layers[light_count];
    }
    const bool shadow = light_count > 0 && vshi_shadow_has_rays(&q->options);
    if (result == VSH_OK && (shadow || vshi_ao_has_rays(&q->options))) {
        const int32_t own = shadow ? vshi_shadow_most_rays(&q->options) : 0;
        const int32_t ao = vshi_ao_has_rays(&q->options) ? vshi_ao_most_rays(&q->options) : 0;
        result = vshi_shade_sampler(&q->options, own > ao ? own : ao, "query", &q->sampler, error);
    }
    for (size_t l = 0; l < q->light_count; ++l) {
        q->shadow[l].sampler = q->sampler;
    }
    q->ao.sampler = q->sampler;
    return result;
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
    vsh_result result = vshi_allocate((void **)&q, 1, sizeof *q, "query", error);
    if (result == VSH_OK) {
        result = vshi_shade_options_resolve(options, &q->options, error);
    }
    if (result == VSH_OK) {
        result = prepare(q, occluders, lights, light_count, error);
    }
    if (result == VSH_OK && sphere) {
        result = vshi_ao_prepare_sphere(&q->cones, &q->ao, error);
    }
    if (result == VSH_OK && sphere) {
        result = vshi_layers_prepare_sphere(q->layers[light_count], error);
    }
    if (result != VSH_OK) {
        vsh_query_free(q);
        return result;
    }
    *query = q;
    return VSH_OK;
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
