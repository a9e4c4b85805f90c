#include "bake/page.h"
#include "bake/planes.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "field/field.h"
#include "shade/layers.h"

#include <math.h>
#include <string.h>

double vshi_occluders_bytes(const vsh_occluders *occluders) {
    vsh_field_info info;
    vsh_field_get_info(occluders->field, &info);
    double bytes = (double)info.bytes;
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        bytes += vshi_layer_bytes(&occluders->layers[i]);
    }
    return bytes;
}

vsh_result vshi_lightmap_check(const vsh_lightmap *lightmap, const vsh_charts *charts,
                               const vsh_light *lights, size_t light_count, vsh_error *error) {
    if (lightmap->bent != NULL && lightmap->bent_space != VSH_BENT_WORLD &&
        (lightmap->bent_space != VSH_BENT_TANGENT || !charts->tangents)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "bent_space %d: expected %d, or %d with charts that have tangents",
                         lightmap->bent_space, VSH_BENT_WORLD, VSH_BENT_TANGENT);
    }
    const int32_t up = lightmap->asked.sky;
    if (lightmap->sky != NULL && (up <= VSH_UP_NONE || up > VSH_UP_MINUS_Z)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "lightmap asked.sky %d: expected %d … %d", up, VSH_UP_X,
                         VSH_UP_MINUS_Z);
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

static void clear_planes(const vsh_lightmap *lightmap, size_t light_count, size_t texels) {
    size_t kind_count;
    const vshi_plane_kind *kinds = vshi_plane_kinds(&kind_count);
    for (const vshi_plane_kind *kind = kinds; kind < kinds + kind_count; ++kind) {
        for (size_t i = 0; i < (kind->per_light ? light_count : 1); ++i) {
            float *plane = vshi_plane_of(lightmap, kind, i);
            if (plane != NULL) {
                memset(plane, 0, texels * vshi_plane_components(kind) * sizeof *plane);
            }
        }
    }
}

/* Bakes into planes that are all zeros. */
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
    job = vshi_job_begin(run, "bake", tiles);
    if (job == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "lightmap: the system refused memory");
        goto done;
    }
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
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(charts);
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
    vshi_tracer *tracer = NULL;
    VSHI_TRY(vshi_tracer_create(occluders, lights, light_count, &shade, lightmap, sum.errors != NULL, &full,
                                &tracer, error));
    clear_planes(lightmap, light_count, (size_t)charts->info.width * (size_t)charts->info.height);
    const vsh_result result = bake(tracer, charts, lightmap, light_count, &shade, &full, &sum, error);
    vshi_tracer_free(tracer);
    if (result == VSH_OK && stats != NULL) {
        memcpy(stats, &sum, stats->struct_size);
    }
    return result;
}
