/* What a scene's values are: rays against its casters themselves, or, where some caster is only a level set,
 * rays against a field finer than all that are measured. And Embree's own curve, which every method has to
 * beat. */
#include "cli/message.h"
#include "cli/try.h"
#include "trade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* Traces the subject's planes into `values`; `seconds` is of the library's call alone. */
static int trace(const trade_work *work, const trade_subject *subject, int32_t rays, float *values,
                 double *seconds) {
    float *packed = calloc(work->points, sizeof *packed);
    if (packed == NULL) {
        return cli_out_of_memory("rays");
    }
    int code = CLI_OK;
    *seconds = 0.0;
    for (size_t plane = 0; plane < subject->planes; ++plane) {
        const double start = trade_now(work);
        vsh_error error;
        const vsh_result result =
            subject->ao
                ? vsh_trace_ao(work->triangles, work->solids, work->points, work->positions, work->normals,
                               0.0, work->scene->shade.ao_distance, rays, &work->run, packed, &error)
                : vsh_trace_shadow(work->triangles, work->solids, work->points, work->positions,
                                   work->normals, 0.0, &work->scene->lights[plane], rays, &work->run, packed,
                                   &error);
        *seconds += trade_now(work) - start;
        if (result != VSH_OK) {
            code = cli_fail_of(NULL, &error);
            goto done;
        }
        for (size_t i = 0; i < work->points; ++i) {
            values[plane * work->texels + work->texel[i]] = packed[i];
        }
    }
done:
    free(packed);
    return code;
}

/* Of a scene whose casters rays cannot meet: rays against a field of twice the finest resolution. */
static int32_t truth_resolution(const trade_work *work) {
    const int32_t finest = work->fields[0].resolution;
    return finest <= 32768 ? 2 * finest : finest;
}

static int32_t marched_rays(const trade_work *work) {
    return work->settings->truth_rays < 4096 ? work->settings->truth_rays : 4096;
}

static int march(trade_work *work) {
    vsh_occluders *occluders = NULL;
    double seconds;
    CLI_TRY(trade_make_occluders(work, truth_resolution(work), &occluders, &seconds));
    vsh_shade_options shade = work->scene->shade;
    shade.method = VSH_SHADOW_RAYS;
    shade.ao_method = VSH_AO_RAYS;
    shade.rays = marched_rays(work);
    shade.early_rays = 0;
    float *shadow = NULL, *ao = NULL;
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        *(subject->ao ? &ao : &shadow) = subject->truth;
    }
    const int code = trade_bake(work, occluders, &shade, shadow, ao, NULL, NULL);
    vsh_occluders_free(occluders);
    return code;
}

void trade_describe_truth(trade_work *work) {
    static const char *const whats[] = {
        "procedural casters themselves (sphere tracing in double precision)",
        "triangles (Embree)",
        "triangles (Embree) and procedural casters (sphere tracing in double precision), hidden by either",
    };
    if (vsh_scene_has_truth(work->scene)) {
        const char *what = whats[work->triangles == NULL ? 0 : work->solids == NULL ? 1 : 2];
        snprintf(work->truth_text, sizeof work->truth_text,
                 "%d rays a texel, from just above it, against the %s", work->settings->truth_rays, what);
        return;
    }
    snprintf(work->truth_text, sizeof work->truth_text,
             "%d rays a texel marched against a field of %d voxels along the longest side, as %s",
             marched_rays(work), truth_resolution(work),
             vsh_triangles_available() ? "a caster is neither a mesh nor procedural"
                                       : "this build has no Embree");
}

int trade_take_truth(trade_work *work, const trade_task *task) {
    const double start = trade_now(work);
    double seconds;
    for (size_t s = 0; s < work->subject_count; ++s) {
        trade_subject *subject = &work->subjects[s];
        if (task->subject != s && task->subject != work->subject_count) {
            continue;
        }
        subject->truth = calloc(subject->planes * work->texels, sizeof *subject->truth);
        if (subject->truth == NULL) {
            return cli_out_of_memory("truth");
        }
    }
    if (task->subject == work->subject_count) {
        CLI_TRY(march(work));
    } else {
        trade_subject *subject = &work->subjects[task->subject];
        CLI_TRY(trace(work, subject, work->settings->truth_rays, subject->truth, &seconds));
    }
    work->truth_s += trade_now(work) - start;
    return CLI_OK;
}

int trade_measure_embree(trade_work *work, const trade_task *task) {
    const trade_subject *subject = &work->subjects[task->subject];
    trade_run run = {.task = (size_t)(task - work->tasks),
                     .build_s = work->triangles_s,
                     .bytes = vsh_triangles_bytes(work->triangles),
                     .certified = NAN,
                     .valid = work->points,
                     .values = calloc(subject->planes * work->texels, sizeof *run.values)};
    if (run.values == NULL) {
        return cli_out_of_memory("values");
    }
    trade_name_run(work, &run);
    trade_clock clock = {.count = 0};
    int code;
    do {
        CLI_TRY_DONE(trace(work, subject, task->number, run.values, &clock.times[clock.count++]));
    } while (trade_again(&clock));
    run.bake_s = trade_median(&clock);
    CLI_TRY_DONE(trade_add(work, &run));
    return CLI_OK;
done:
    free(run.values);
    return code;
}
