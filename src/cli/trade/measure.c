/* Bakes the scene in every way that is worth a look, and takes the time. */
#include "cli/message.h"
#include "cli/progress.h"
#include "cli/try.h"
#include "trade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* The world box of the receivers' samples; empty, min > max, where there are none. */
static void find_box(const trade_work *work, double min[3], double max[3]) {
    for (int axis = 0; axis < 3; ++axis) {
        min[axis] = INFINITY;
        max[axis] = -INFINITY;
        for (size_t r = 0; r < work->receiver_count; ++r) {
            const trade_receiver *receiver = &work->receivers[r];
            const bool any = receiver->info.samples > 0;
            min[axis] = any ? fmin(min[axis], receiver->low[axis]) : min[axis];
            max[axis] = any ? fmax(max[axis], receiver->high[axis]) : max[axis];
        }
    }
}

/* A scene's, with its triangles and as many voxels as pay for its receivers, or (`voxels`) its voxels alone.
 */
static int make_occluders(const trade_work *work, const vsh_scene *scene, int32_t voxels,
                          vsh_occluders **occluders, double *seconds) {
    const double start = trade_now(work);
    double min[3], max[3];
    find_box(work, min, max);
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.receivers_min = min;
    options.receivers_max = max;
    options.voxels = voxels;
    options.triangles = voxels == 0; /* else the same for all resolutions */
    for (size_t r = 0; r < work->receiver_count; ++r) {
        options.points += (double)work->receivers[r].info.samples;
    }
    vsh_error error;
    const vsh_result result =
        vsh_scene_occluders(scene, work->assets, &options, &work->run, occluders, &error);
    *seconds = trade_now(work) - start;
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

int trade_make_occluders(trade_work *work, int32_t resolution, vsh_occluders **occluders, double *seconds) {
    vsh_scene scene = *work->scene;
    scene.grid.resolution = resolution;
    scene.grid.voxel_size = 0.0;
    return make_occluders(work, &scene, 1, occluders, seconds);
}

int trade_add_triangles(const trade_work *work, trade_field *field) {
    vsh_occluder_parts parts;
    vsh_occluders_get_parts(field->occluders, &parts);
    parts.triangles = work->meshes ? work->triangles : NULL;
    vsh_error error;
    return vsh_occluders_from_parts(&parts, &field->traced, &error) == VSH_OK ? CLI_OK
                                                                              : cli_fail_of(NULL, &error);
}

void trade_name_run(const trade_work *work, trade_run *run) {
    const trade_task *task = &work->tasks[run->task];
    const bool ao = work->subjects[task->subject].ao;
    const char *flag = ao ? "--ao-method" : "--method";
    const bool rays = ao ? task->method == VSH_AO_RAYS : task->method == VSH_SHADOW_RAYS;
    const size_t room = sizeof run->options;
    char more[64] = "";
    if (task->kind == TRADE_EMBREE) {
        run->method = "embree";
        run->embree = true;
        snprintf(run->options, room, "%d ray%s a texel", task->number, task->number == 1 ? "" : "s");
        return;
    }
    if (task->kind == TRADE_AUTO) {
        run->method = "auto";
        snprintf(run->options, room, "--max-error %g", task->max_error);
        return;
    }
    run->method =
        ao ? vsh_get_name(VSH_NAMES_AO, task->method) : vsh_get_name(VSH_NAMES_SHADOW, task->method);
    run->resolution = work->fields[task->field].resolution;
    if (task->max_error > 0.0) {
        snprintf(more, sizeof more, " --max-error %g", task->max_error);
    } else if (task->number > 0) {
        snprintf(more, sizeof more, " %s %d", rays ? "--rays" : "--ao-cones", task->number);
    }
    snprintf(run->options, room, "%s %s%s --resolution %d", flag, run->method, more, run->resolution);
}

/* A task's options, for the library. */
static vsh_shade_options shade_of(const trade_work *work, const trade_task *task) {
    vsh_shade_options shade = work->scene->shade;
    shade.early_rays = 0;
    if (work->subjects[task->subject].ao) {
        const bool cones = task->method != VSH_AO_RAYS && task->number > 0;
        shade.ao_method = task->method;
        shade.ao_cones = cones ? task->number : shade.ao_cones;
        shade.rays = task->method == VSH_AO_RAYS ? task->number : shade.rays;
    } else {
        shade.method = task->method;
        shade.rays = task->method == VSH_SHADOW_RAYS ? task->number : shade.rays;
    }
    if (task->max_error > 0.0) {
        shade.max_error = task->max_error;
        shade.rays = 0; /* as many as that takes */
    }
    return shade;
}

/* Share of the subject's values that a cone proved. */
static double certified_share(const trade_subject *subject, size_t valid, const vsh_shade_options *shade,
                              const vsh_shade_stats *stats) {
    const int32_t method = subject->ao ? shade->ao_method : shade->method;
    const int32_t rays = subject->ao ? (int32_t)VSH_AO_RAYS : (int32_t)VSH_SHADOW_RAYS;
    if (method == rays || (subject->ao && method == VSH_AO_TAPS)) {
        return NAN;
    }
    double values = (double)(subject->planes * valid);
    double proved = (double)(stats->certified + stats->skipped);
    if (method > rays) {
        proved = values - (double)stats->refined;
    } else if (subject->ao) {
        values *= (double)shade->ao_cones;
    }
    return fmax(0.0, fmin(1.0, proved / values));
}

int trade_bake(const trade_work *work, const vsh_occluders *occluders, const vsh_shade_options *shade,
               float *shadow, float *ao, float *coverage, vsh_shade_stats *stats) {
    const size_t lights = shadow != NULL ? work->scene->light_count : 0;
    float **planes = calloc(lights + 1, sizeof *planes);
    if (planes == NULL) {
        return cli_out_of_memory("planes");
    }
    vsh_bake_stats baked = vsh_bake_stats_zero();
    int code = CLI_OK;
    for (size_t r = 0; r < work->receiver_count; ++r) {
        const size_t first = work->receivers[r].first;
        for (size_t i = 0; i < lights; ++i) {
            planes[i] = shadow + i * work->texels + first;
        }
        const vsh_lightmap lightmap = {.shadow = lights > 0 ? planes : NULL,
                                       .ao = ao != NULL ? ao + first : NULL,
                                       .coverage = coverage != NULL ? coverage + first : NULL};
        vsh_error error;
        if (vsh_bake_lightmap(occluders, work->receivers[r].charts, work->scene->lights, lights, shade,
                              &work->run, &lightmap, &baked, &error) != VSH_OK) {
            code = cli_fail_of(NULL, &error);
            goto done;
        }
    }
    if (stats != NULL) {
        *stats = baked.shade;
    }
done:
    free(planes);
    return code;
}

/* Every receiver's lightmap of every plane is one of its own: no penumbra goes on in the next. */
static int compare(const trade_work *work, const trade_subject *subject, const float *values,
                   const uint8_t *mask, vsh_accuracy *accuracy) {
    const size_t count = subject->planes * work->receiver_count;
    vsh_compared *planes = calloc(count, sizeof *planes);
    if (planes == NULL) {
        return cli_out_of_memory("planes");
    }
    for (size_t i = 0; i < count; ++i) {
        const trade_receiver *receiver = &work->receivers[i % work->receiver_count];
        const size_t first = i / work->receiver_count * work->texels + receiver->first;
        planes[i] = (vsh_compared){{receiver->info.width, receiver->info.height, 1},
                                   subject->truth + first,
                                   values + first,
                                   mask + receiver->first};
    }
    vsh_error error;
    const vsh_result result = vsh_compare_accuracy(planes, count, &work->run, accuracy, &error);
    free(planes);
    return result == VSH_OK ? CLI_OK : cli_fail_of(NULL, &error);
}

/* On the texels that all runs have, and on all of its own. */
static int compare_both(const trade_work *work, trade_run *run) {
    const trade_task *task = &work->tasks[run->task];
    const trade_subject *subject = &work->subjects[task->subject];
    const uint8_t *mask = task->kind == TRADE_METHOD   ? work->fields[task->field].mask
                          : task->kind == TRADE_EMBREE ? work->any
                                                       : run->mask;
    vsh_accuracy valid;
    CLI_TRY(compare(work, subject, run->values, mask, &valid));
    run->valid_rmse = valid.rmse;
    return compare(work, subject, run->values, work->common, &run->metrics);
}

static void say(const trade_work *work, const trade_run *run) {
    char line[256];
    if (work->settings->bake.common.quiet) {
        return;
    }
    snprintf(line, sizeof line, "%s%s: RMSE %.4f, %.3f s", run->embree ? "Embree, " : "", run->options,
             run->metrics.rmse, run->bake_s);
    cli_progress_line(line);
}

int trade_add(trade_work *work, trade_run *run) {
    trade_subject *subject = &work->subjects[work->tasks[run->task].subject];
    run->rate = 1e6 * run->bake_s / (double)(subject->planes * run->valid);
    CLI_TRY(compare_both(work, run));
    trade_run *more = realloc(subject->runs, (subject->run_count + 1) * sizeof *more);
    if (more == NULL) {
        return cli_out_of_memory("runs");
    }
    subject->runs = more;
    more[subject->run_count++] = *run;
    say(work, run);
    return CLI_OK;
}

/* Bakes the run's values, several times where it is quick. */
static int bake(const trade_work *work, const trade_subject *subject, const vsh_occluders *occluders,
                const vsh_shade_options *shade, trade_run *run, vsh_shade_stats *stats) {
    trade_clock clock = {.count = 0};
    int code = CLI_OK;
    do {
        const double start = trade_now(work);
        code = trade_bake(work, occluders, shade, subject->ao ? NULL : run->values,
                          subject->ao ? run->values : NULL, NULL, stats);
        clock.times[clock.count++] = trade_now(work) - start;
    } while (code == CLI_OK && trade_again(&clock));
    run->bake_s = trade_median(&clock);
    return code;
}

/* A guess: what the method took last time, or several times that where the plan asks for more. */
static double expected(const trade_subject *subject, const trade_run *run, bool first) {
    double seconds = 0.0;
    for (size_t i = 0; i < subject->run_count; ++i) {
        if (subject->runs[i].method == run->method) {
            seconds = subject->runs[i].bake_s;
        }
    }
    return first ? 4.0 * seconds : seconds;
}

static int run_method(trade_work *work, const trade_task *task) {
    const trade_field *on = &work->fields[task->field];
    const trade_subject *subject = &work->subjects[task->subject];
    trade_run run = {.task = (size_t)(task - work->tasks), .build_s = on->build_s, .valid = on->valid};
    const vsh_shade_options shade = shade_of(work, task);
    const bool exact =
        subject->ao ? task->method == (int32_t)VSH_AO_EXACT : task->method == (int32_t)VSH_SHADOW_EXACT;
    trade_name_run(work, &run);
    if (trade_left(work) < expected(subject, &run, on == work->fields)) {
        ++work->skipped;
        return CLI_OK;
    }
    run.values = calloc(subject->planes * work->texels, sizeof *run.values);
    if (run.values == NULL) {
        return cli_out_of_memory("values");
    }
    vsh_occluders_info info;
    vsh_occluders_get_info(on->occluders, &info);
    run.bytes = info.field_bytes + (exact ? vsh_triangles_bytes(work->triangles) : 0);
    run.build_s += exact ? work->triangles_s : 0.0;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    int code = bake(work, subject, on->traced, &shade, &run, &stats);
    run.certified = certified_share(subject, run.valid, &shade, &stats);
    code = code == CLI_OK ? trade_add(work, &run) : code;
    if (code != CLI_OK) {
        free(run.values);
    }
    return code;
}

/* What `bake` makes of an error with nothing else said: what casts is made for each, as it depends on it. */
static int run_auto(trade_work *work, const trade_task *task) {
    const trade_subject *subject = &work->subjects[task->subject];
    trade_run run = {.task = (size_t)(task - work->tasks), .certified = NAN};
    vsh_scene scene = *work->scene;
    scene.ao = subject->ao ? scene.ao : 0;
    scene.light_count = subject->ao ? 0 : scene.light_count;
    scene.shade.method = VSH_SHADOW_AUTO;
    scene.shade.ao_method = VSH_AO_AUTO;
    scene.shade.max_error = task->max_error;
    scene.shade.rays = 0;
    trade_name_run(work, &run);
    if (trade_left(work) < expected(subject, &run, false)) {
        ++work->skipped;
        return CLI_OK;
    }
    vsh_occluders *occluders = NULL;
    float *coverage = calloc(work->texels, sizeof *coverage);
    run.mask = calloc(work->texels, 1);
    run.values = calloc(subject->planes * work->texels, sizeof *run.values);
    vsh_shade_stats stats = vsh_shade_stats_zero();
    int code = CLI_OK;
    if (run.mask == NULL || coverage == NULL || run.values == NULL) {
        code = cli_out_of_memory("values");
        goto done;
    }
    CLI_TRY_DONE(make_occluders(work, &scene, 0, &occluders, &run.build_s));
    CLI_TRY_DONE(trade_bake(work, occluders, &scene.shade, NULL, NULL, coverage, NULL));
    for (size_t i = 0; i < work->texels; ++i) {
        run.valid += coverage[i] > 0.0f;
        run.mask[i] = coverage[i] > 0.0f && work->any[i]; /* where the truth was looked for */
    }
    vsh_occluders_info info;
    vsh_occluders_get_info(occluders, &info);
    run.bytes = info.field_bytes + info.triangles_bytes;
    CLI_TRY_DONE(bake(work, subject, occluders, &scene.shade, &run, &stats));
    CLI_TRY_DONE(trade_add(work, &run));
    run.values = NULL;
    run.mask = NULL;
done:
    vsh_occluders_free(occluders);
    free(run.values);
    free(run.mask);
    free(coverage);
    return code;
}

int trade_measure(trade_work *work, const trade_task *task) {
    return task->kind == TRADE_AUTO ? run_auto(work, task) : run_method(work, task);
}
