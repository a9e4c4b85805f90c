#include "bake_scene/seams.h"

#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>

/* Bytes of planes that are held for stitching where there is no limit: a dozen lightmaps of 2048² with AO
 * and the irradiance of a light. */
static const uint64_t MOST_HELD = UINT64_C(2) << 30;

bool vshi_fixes_seams(const vsh_receiver *receiver) {
    return receiver->seams == VSH_SEAMS_FIX && receiver->type == VSH_RECEIVER_MESH;
}

bool vshi_is_fixed_whole(const vshi_lightmap_work *w) {
    return vshi_fixes_seams(&w->target->receiver) && w->input.bands.count == 1 && w->job->options.shard == 0;
}

/* --- one */

/* Of what casts, which is not there where parts are put together. */
static uint64_t casters_bytes(const vsh_bake_job *job) {
    return job->parts != NULL ? 0 : job->report.occluders.field_bytes + job->report.occluders.triangles_bytes;
}

/* Bytes of texels that are kept. */
static uint64_t kept_bytes(const vshi_lightmap_work *w) {
    vsh_texels_info kept = {.bytes = 0};
    if (w->input.kept != NULL) {
        vsh_texels_get_info(w->input.kept, &kept);
    }
    return kept.bytes;
}

static uint64_t planes_bytes(const vsh_job_lightmap *lightmap, const vshi_channels *channels, bool invalid) {
    const uint64_t texels = (uint64_t)lightmap->width * (uint64_t)lightmap->height;
    const uint64_t floats =
        (uint64_t)channels->image.channel_count + 3 * (uint64_t)channels->triple_count + (invalid ? 1 : 0);
    return texels * floats * sizeof(float);
}

static uint64_t own_planes_bytes(const vshi_lightmap_work *w) {
    return planes_bytes(w->lightmap, &w->channels, w->channels.invalid != NULL);
}

/* What is baked stays where there is no memory to make it better. */
static vsh_result keep_without_memory(const vshi_lightmap_work *w, vsh_result result, const char *kept,
                                      vsh_error *error) {
    if (result != VSH_ERROR_LIMIT) {
        return vshi_name_file(w->target->receiver.path, result, error);
    }
    vshi_warn(w->run, "%s: %s are not fixed for lack of memory; raise --memory-limit",
              w->target->receiver.path, kept);
    return VSH_OK;
}

vsh_result vshi_fill_hidden(const vshi_lightmap_work *w, const vsh_texels *texels, vsh_error *error) {
    vsh_run run = *w->run;
    run.memory_held += casters_bytes(w->job) + own_planes_bytes(w) + w->held;
    const vsh_result result =
        vsh_lightmap_fill_hidden(texels, &w->channels.lightmap, w->job->scene.light_count, &run, NULL, error);
    return keep_without_memory(w, result, "hidden charts", error);
}

/* Of `count` lightmaps in a row. */
static vsh_result stitch(const vshi_lightmap_work *w, size_t count, vsh_error *error) {
    const vsh_bake_job *job = w->job;
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = job->scene.shade.max_error;
    vsh_run run = *w->run;
    vsh_stitch_page *pages = NULL;
    VSHI_TRY(vshi_allocate((void **)&pages, count, sizeof *pages, "seams", error));
    run.memory_held += casters_bytes(job) + kept_bytes(w);
    for (size_t i = 0; i < count; ++i) {
        pages[i] = (vsh_stitch_page){w[i].input.charts, &w[i].channels.lightmap};
        run.memory_held += own_planes_bytes(&w[i]);
    }
    const vsh_result result =
        vsh_lightmaps_stitch(pages, count, job->scene.light_count, &options, &run, NULL, error);
    free(pages);
    return keep_without_memory(w, result, "seams", error);
}

vsh_result vshi_stitch_alone(const vshi_lightmap_work *w, vsh_error *error) {
    return stitch(w, 1, error);
}

/* --- several */

static vsh_result find_planes(const vsh_bake_job *job, size_t index, uint64_t *bytes, vsh_error *error) {
    const vshi_target *target = &job->targets.list[index];
    const bool invalid = job->options.invalid_picture != NULL || job->scene.planes.invalid != 0;
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(
        vshi_channels_name(&job->scene, target->receiver.width, target->receiver.height, &channels, error));
    *bytes = planes_bytes(&job->lightmaps[index], &channels, invalid);
done:
    vshi_channels_free(&channels);
    return result;
}

/* Bytes that a lightmap holds until all of them are stitched: its planes, its charts. */
static vsh_result find_held(const vsh_bake_job *job, size_t index, const vsh_run *run, uint64_t *held,
                            vsh_error *error) {
    vsh_charts *charts = NULL;
    vsh_charts_info info;
    VSHI_TRY(find_planes(job, index, held, error));
    VSHI_TRY(vshi_target_charts(&job->scene, &job->targets.list[index], job->options.allow_overlap != 0,
                                false, run, &charts, error));
    vsh_charts_get_info(charts, &info);
    vsh_charts_free(charts);
    *held += info.bytes;
    return VSH_OK;
}

/* Lightmaps in a row whose seams are fixed, which are whole by themselves. */
static size_t count_fixed(const vsh_bake_job *job, size_t first, bool one_receiver) {
    size_t end = first;
    while (end < job->targets.count && vshi_fixes_seams(&job->targets.list[end].receiver) &&
           job->lightmaps[end].bands == 1 &&
           (!one_receiver || job->targets.list[end].index == job->targets.list[first].index)) {
        ++end;
    }
    return end > first ? end - first : 1;
}

/* Whether lightmaps are few and small enough to be held where nobody has set a limit. */
static vsh_result are_small(const vsh_bake_job *job, size_t first, size_t count, bool *small,
                            vsh_error *error) {
    uint64_t all = 0;
    for (size_t i = first; i < first + count && all <= MOST_HELD; ++i) {
        uint64_t bytes = 0;
        VSHI_TRY(find_planes(job, i, &bytes, error));
        all += bytes;
    }
    *small = all <= MOST_HELD;
    return VSH_OK;
}

/* Whether each can be baked whole beside what the others hold. */
static vsh_result fit_together(const vsh_bake_job *job, size_t first, size_t count, const uint64_t *held,
                               const vsh_run *run, bool *fit, vsh_error *error) {
    if (run->memory_limit == 0) {
        return are_small(job, first, count, fit, error);
    }
    uint64_t all = casters_bytes(job);
    for (size_t i = 0; i < count; ++i) {
        all += held[i];
    }
    *fit = true;
    for (size_t i = first; i < first + count && *fit; ++i) {
        vshi_bands bands;
        vsh_charts *charts = NULL;
        VSHI_TRY(vshi_target_charts(&job->scene, &job->targets.list[i], job->options.allow_overlap != 0,
                                    false, run, &charts, error));
        const vsh_result result = vshi_job_plan(job, i, charts, all - held[i - first], run, &bands, error);
        vsh_charts_free(charts);
        *fit = result == VSH_OK && bands.count == 1;
        VSHI_TRY(result == VSH_ERROR_LIMIT ? VSH_OK : result);
    }
    return VSH_OK;
}

vsh_result vshi_count_together(vsh_bake_job *job, size_t first, const vsh_run *run, size_t *count,
                               vsh_error *error) {
    const size_t most = count_fixed(job, first, false), own = count_fixed(job, first, true);
    uint64_t *held = NULL;
    bool fit = false;
    vsh_result result;
    *count = 1;
    if (most == 1 || first < job->apart) {
        return VSH_OK;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&held, most, sizeof *held, "seams", error));
    for (size_t i = 0; i < most && run->memory_limit > 0; ++i) {
        VSHI_TRY_DONE(find_held(job, first + i, run, &held[i], error));
    }
    VSHI_TRY_DONE(fit_together(job, first, most, held, run, &fit, error));
    *count = fit ? most : 1;
    if (!fit && own > 1 && own < most) {
        VSHI_TRY_DONE(fit_together(job, first, own, held, run, &fit, error));
        *count = fit ? own : 1;
    }
    if (!fit) {
        job->apart = first + (own > 1 ? own : most);
        vshi_warn(
            run,
            "%s: seams between lightmaps are not fixed: no memory holds %zu at once; raise --memory-limit",
            job->lightmaps[first].path, own > 1 ? own : most);
    }
done:
    free(held);
    return result;
}

/* Bakes those of the group one by one, and keeps them. */
static vsh_result bake_all(vsh_bake_job *job, size_t first, size_t count, const vsh_run *run,
                           vshi_lightmap_work *works, vsh_charts **charts, size_t *begun, vsh_error *error) {
    for (size_t i = 0; i < count; ++i) {
        const double start = vshi_seconds();
        const vshi_target *target = &job->targets.list[first + i];
        VSHI_TRY(vshi_target_charts(&job->scene, target, job->options.allow_overlap != 0, false, run,
                                    &charts[i], error));
        job->report.bake_s += vshi_seconds() - start;
        const vshi_lightmap_input input = {
            .charts = charts[i],
            .bands = {.end = target->receiver.height, .rows = target->receiver.height, .count = 1}};
        vshi_lightmap_begin(job, first + i, &input, run, &works[i]);
        ++*begun;
        for (size_t k = 0; k < i; ++k) {
            vsh_charts_info info;
            vsh_charts_get_info(charts[k], &info);
            works[i].held += own_planes_bytes(&works[k]) + info.bytes;
        }
        VSHI_TRY(vshi_lightmap_bake_whole(&works[i], error));
    }
    return VSH_OK;
}

vsh_result vshi_bake_together(vsh_bake_job *job, size_t first, size_t count, const vsh_run *run,
                              vsh_error *error) {
    vshi_lightmap_work *works = NULL;
    vsh_charts **charts = NULL;
    size_t begun = 0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&works, count, sizeof *works, "lightmaps", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&charts, count, sizeof *charts, "lightmaps", error));
    VSHI_TRY_DONE(bake_all(job, first, count, run, works, charts, &begun, error));
    VSHI_TRY_DONE(stitch(works, count, error));
done:
    for (size_t i = 0; i < begun; ++i) {
        if (result == VSH_OK) {
            result = vshi_lightmap_write_whole(&works[i], error);
        }
        result = vshi_lightmap_end(&works[i], result, error);
        if (job->options.done != NULL) {
            job->options.done(job->options.user, &job->lightmaps[first + i], result);
        }
    }
    for (size_t i = 0; charts != NULL && i < count; ++i) {
        vsh_charts_free(charts[i]);
    }
    free(charts);
    free(works);
    return result;
}
