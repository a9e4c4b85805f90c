/* Volumes: voxels are shaded block by block, then what is inside solids is filled. */
#include "base/decimal.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "light/light.h"
#include "shade/layers.h"
#include "volume/volume_blocks.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Share of the progress: filling what is inside costs little. */
enum { SHADE_UNITS = 15, FILL_UNITS = 1 };

static void fill_blocks(void *user, size_t begin, size_t end) {
    vshi_volume_bake *bake = user;
    for (size_t b = begin; b < end && !atomic_load(&bake->out_of_memory); ++b) {
        if (!vshi_fill_block(&bake->fill, b)) {
            atomic_store(&bake->out_of_memory, true);
        }
    }
}

static void settle_blocks(void *user, size_t begin, size_t end) {
    vshi_volume_bake *bake = user;
    for (size_t b = begin; b < end; ++b) {
        uint64_t active[VSHI_MASK_WORDS];
        if (vshi_fill_active(&bake->fill, b, active)) {
            vshi_volume_settle(bake->volume, b, active);
        }
    }
}

/* --- the whole */

static vsh_result check_memory(vshi_volume_bake *bake, vsh_result result, vsh_error *error) {
    return result == VSH_OK && atomic_load(&bake->out_of_memory)
               ? vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory")
               : result;
}

static vsh_result shade(vshi_volume_bake *bake, const vsh_light *lights, vshi_job *job, vsh_error *error) {
    vsh_shade_options options = bake->options.shade;
    if (bake->options.ao == 0) {
        options.ao_method = VSH_AO_CONES; /* not asked for: it may want what is not there */
    }
    const bool around = !bake->normals && bake->options.ao != 0; /* AO over all directions */
    VSHI_TRY(
        vshi_query_create(bake->occluders, lights, bake->light_count, &options, around, &bake->query, error));
    const vsh_result result = vshi_parallel_for(job, bake->block_count, VSHI_VOLUME_GRAIN, SHADE_UNITS,
                                                vshi_volume_shade_blocks, bake, error);
    vsh_query_free(bake->query);
    bake->query = NULL;
    return check_memory(bake, result, error);
}

/* Fills and settles all blocks, and closes the volume. */
static vsh_result finish(vshi_volume_bake *bake, vshi_job *job, vsh_error *error) {
    static vshi_range_fn *const passes[] = {fill_blocks, settle_blocks};
    for (size_t i = 0; i < sizeof passes / sizeof passes[0]; ++i) {
        VSHI_TRY(vshi_parallel_for(job, bake->block_count, VSHI_VOLUME_GRAIN, i == 0 ? FILL_UNITS : 0,
                                   passes[i], bake, error));
    }
    VSHI_TRY(check_memory(bake, VSH_OK, error));
    const vsh_volume_info counts = vshi_fill_counts(&bake->fill);
    return vshi_volume_close(bake->volume, &counts, error);
}

static void find_half_axes(vshi_volume_bake *bake) {
    double centre[3], next[3];
    const int32_t *index = bake->blocks[0].origin;
    vsh_voxels_centre(bake->voxels, index, centre);
    for (int axis = 0; axis < 3; ++axis) {
        int32_t beside[3] = {index[0], index[1], index[2]};
        ++beside[axis];
        vsh_voxels_centre(bake->voxels, beside, next);
        for (int k = 0; k < 3; ++k) {
            bake->half_axis[axis][k] = 0.5 * (next[k] - centre[k]);
        }
    }
}

static vshi_channel *next_of(vshi_channel **next, const vshi_volume_bake *bake, const char *method) {
    vshi_channel *channel = (*next)++;
    *channel = (vshi_channel){.method = method, .caster_voxel_size = bake->caster_voxel_size};
    return channel;
}

static void describe_shadow(const vshi_volume_bake *bake, const vsh_light *lights, bool error,
                            vshi_channel **next) {
    const vsh_shade_options *shade = &bake->options.shade;
    const char *method = vsh_get_name(
        VSH_NAMES_SHADOW, vsh_shadow_method_resolve(shade->method, bake->occluders->triangles != NULL));
    for (size_t l = 0; l < bake->light_count; ++l) {
        const vsh_light *light = &lights[l];
        vshi_channel *c = next_of(next, bake, method);
        snprintf(c->name, sizeof c->name, "%s.%s", error ? "error" : "shadow", light->name);
        snprintf(c->description, sizeof c->description, "%s light '%s', 1 lit, 0 dark",
                 error ? "standard error of the visible fraction of" : "visible fraction of", light->name);
        vsh_light_text(light, c->light, sizeof c->light);
    }
}

static void describe_ao(const vshi_volume_bake *bake, bool error, vshi_channel **next) {
    const vsh_shade_options *shade = &bake->options.shade;
    const int32_t method = vsh_ao_method_resolve(shade->ao_method, bake->occluders->triangles != NULL);
    vshi_channel *c = next_of(next, bake, vsh_get_name(VSH_NAMES_AO, method));
    snprintf(c->name, sizeof c->name, "%s", error ? "error.ao" : "ao");
    snprintf(c->description, sizeof c->description, "%s within %g, 1 open, 0 closed",
             error ? "standard error of ambient occlusion" : "ambient occlusion", shade->ao_distance);
}

/* Fills a channel for each grid, in the order of vsh_volume. */
static void describe(const vshi_volume_bake *bake, const vsh_light *lights, vshi_channel *channels) {
    VSHI_NUMBERS;
    vshi_channel *next = channels;
    describe_shadow(bake, lights, false, &next);
    if (bake->options.ao != 0) {
        describe_ao(bake, false, &next);
    }
    if (bake->shadow_error) {
        describe_shadow(bake, lights, true, &next);
    }
    if (bake->ao_error) {
        describe_ao(bake, true, &next);
    }
}

/* Begins the volume and its filling. Errors: as vshi_volume_begin(). End it with vshi_fill_end(), and free
 * the volume, also then. */
static vsh_result begin(vshi_volume_bake *bake, const vsh_light *lights, const vsh_run *run,
                        vsh_error *error) {
    vshi_channel *channels = NULL;
    VSHI_TRY(vshi_allocate((void **)&channels, bake->channel_count, sizeof *channels, "volume", error));
    describe(bake, lights, channels);
    const double held = bake->held + 2.0 * (double)bake->block_count * sizeof *bake->fill.shaded;
    const vsh_result result =
        vshi_volume_begin(bake->voxels, channels, bake->channel_count, run, held, &bake->volume, error);
    free(channels);
    VSHI_TRY(result);
    return vshi_fill_begin(&bake->fill, &bake->solid, bake->voxels, bake->volume, bake->channel_count,
                           bake->options.inside == VSH_INSIDE_NEAREST, error);
}

static vsh_result bake_all(vshi_volume_bake *bake, const vsh_light *lights, const vsh_run *run,
                           vsh_error *error) {
    const size_t blocks = bake->block_count;
    vshi_job *job = vshi_job_begin(run, "volume", (SHADE_UNITS + FILL_UNITS) * blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(begin(bake, lights, run, error));
    VSHI_TRY_DONE(shade(bake, lights, job, error));
    result = finish(bake, job, error);
done:
    vshi_fill_end(&bake->fill);
    vshi_job_end(job);
    return result;
}

static vsh_result check(const vsh_light *lights, const vshi_volume_bake *bake, vsh_error *error) {
    const vsh_volume_options *options = &bake->options;
    if (vsh_get_name(VSH_NAMES_INSIDE, options->inside) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "inside %d: expected %d … %d", options->inside, 0,
                         VSH_INSIDE_OFF);
    }
    if (bake->light_count == 0 && options->ao == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "volume: nothing to bake: no lights and no AO");
    }
    for (size_t l = 0; l < bake->light_count; ++l) {
        vsh_error why;
        const vsh_result result = vsh_light_check(&lights[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
        if (lights[l].name[0] == '\0') {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: no name, which its grid is named after",
                             l);
        }
        for (size_t k = 0; k < l; ++k) {
            if (strcmp(lights[k].name, lights[l].name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "lights %zu and %zu are both named '%s'", k, l,
                                 lights[l].name);
            }
        }
    }
    return VSH_OK;
}

static void take_casters(vshi_volume_bake *bake, const vsh_occluders *occluders) {
    vsh_field_info info;
    vsh_field_get_info(occluders->field, &info);
    bake->solid = vshi_solid_of(occluders);
    bake->caster_voxel_size = info.voxel_size;
    bake->held = (double)info.bytes +
                 (occluders->triangles != NULL ? (double)vsh_triangles_bytes(occluders->triangles) : 0.0);
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        bake->held += vshi_layer_bytes(&occluders->layers[i]);
    }
}

/* Checks what there is to bake, and takes it; `options` and `run` may be NULL. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result set_up(vshi_volume_bake *bake, const vsh_occluders *occluders, const vsh_voxels *voxels,
                         const vsh_light *lights, size_t light_count, const vsh_volume_options *options,
                         const vsh_run *run, vsh_run *full, vsh_error *error) {
    *bake = (vshi_volume_bake){.occluders = occluders,
                               .voxels = voxels,
                               .light_count = light_count,
                               .options = vsh_volume_options_default(),
                               .one = vsh_run_default(),
                               .lock = PTHREAD_MUTEX_INITIALIZER,
                               .stats = vsh_shade_stats_zero()};
    take_casters(bake, occluders);
    vsh_shade_options shade;
    VSHI_TRY(
        vshi_options_resolve(options, &bake->options, sizeof bake->options, "vsh_volume_options", error));
    VSHI_TRY(vshi_shade_options_resolve(&bake->options.shade, &shade, error));
    bake->options.shade = shade;
    VSHI_TRY(vshi_run_resolve(run, full, error));
    VSHI_TRY(check(lights, bake, error));
    if (occluders->field->unknown) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "volume: the occluders have no voxels, which tell what is inside");
    }
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    bake->normals = info.has_normals != 0;
    bake->blocks = vshi_voxels_blocks(voxels, &bake->block_count);
    bake->shadow_error = bake->options.error != 0 && light_count > 0 && vshi_shadow_has_rays(&shade);
    bake->ao_error = bake->options.error != 0 && bake->options.ao != 0 && vshi_ao_has_rays(&shade);
    bake->channel_count =
        light_count * (bake->shadow_error ? 2 : 1) + (bake->options.ao != 0) + bake->ao_error;
    bake->one.threads = 1;
    bake->one.isa = full->isa;
    find_half_axes(bake);
    return VSH_OK;
}

vsh_result vsh_bake_volume(const vsh_occluders *occluders, const vsh_voxels *voxels, const vsh_light *lights,
                           size_t light_count, const vsh_volume_options *options, const vsh_run *run,
                           vsh_volume **volume, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(volume);
    *volume = NULL;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(voxels);
    VSHI_NEEDS_OF(light_count, lights);
    vsh_run full;
    vshi_volume_bake bake;
    VSHI_TRY(set_up(&bake, occluders, voxels, lights, light_count, options, run, &full, error));
    const vsh_result result = bake_all(&bake, lights, &full, error);
    if (stats != NULL) {
        vshi_shade_stats_add(stats, &bake.stats);
    }
    if (result != VSH_OK) {
        vsh_volume_free(bake.volume);
        return result;
    }
    *volume = bake.volume;
    return VSH_OK;
}
