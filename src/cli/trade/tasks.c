/* What is measured, in the order of the rows, and which part of a shared trade does what of it: each task
 * goes to the part that has least to do, the costliest first (longest processing time first; Graham, 1969).
 * What they cost is said by constants, so that all parts come to the same. */
#include "cli/message.h"
#include "cli/try.h"
#include "trade.h"

#include <stdlib.h>

/* Microseconds that a value takes, roughly: means of bench/results/curve-cloister.csv and curve-seeds.csv.
 * Only how even the parts are hangs on it. */
typedef struct plan {
    int32_t method;
    int32_t number;   /* rays or cones; 0: none */
    double max_error; /* 0: none */
    double microseconds;
} plan;

static const plan shadow_plans[] = {
    {VSH_SHADOW_HARD, 0, 0.0, 0.4},       {VSH_SHADOW_CLASSIC, 0, 0.0, 0.4},
    {VSH_SHADOW_IMPROVED, 0, 0.0, 0.4},   {VSH_SHADOW_SMOOTH, 0, 0.0, 0.4},
    {VSH_SHADOW_CONE, 0, 0.0, 0.5},       {VSH_SHADOW_RAYS, 4, 0.0, 0.8},
    {VSH_SHADOW_ADAPTIVE, 0, 0.05, 0.9},  {VSH_SHADOW_EXACT, 0, 0.05, 1.0},
    {VSH_SHADOW_ADAPTIVE, 0, 0.02, 1.5},  {VSH_SHADOW_EXACT, 0, 0.02, 1.2},
    {VSH_SHADOW_ADAPTIVE, 0, 0.01, 3.3},  {VSH_SHADOW_EXACT, 0, 0.01, 2.0},
    {VSH_SHADOW_RAYS, 16, 0.0, 1.7},      {VSH_SHADOW_EXACT, 0, 0.005, 3.2},
    {VSH_SHADOW_ADAPTIVE, 0, 0.005, 7.0}, {VSH_SHADOW_RAYS, 64, 0.0, 5.5},
};

static const plan ao_plans[] = {
    {VSH_AO_TAPS, 0, 0.0, 0.5},      {VSH_AO_CONES, 4, 0.0, 0.6},     {VSH_AO_CONES, 16, 0.0, 1.1},
    {VSH_AO_RAYS, 4, 0.0, 0.8},      {VSH_AO_ADAPTIVE, 0, 0.05, 2.2}, {VSH_AO_EXACT, 0, 0.05, 2.1},
    {VSH_AO_ADAPTIVE, 0, 0.02, 5.5}, {VSH_AO_EXACT, 0, 0.02, 4.3},    {VSH_AO_RAYS, 16, 0.0, 1.6},
    {VSH_AO_ADAPTIVE, 0, 0.01, 14.}, {VSH_AO_EXACT, 0, 0.01, 8.0},    {VSH_AO_RAYS, 64, 0.0, 5.0},
    {VSH_AO_CONES, 64, 0.0, 3.2},    {VSH_AO_EXACT, 0, 0.005, 22.0},  {VSH_AO_ADAPTIVE, 0, 0.005, 35.0},
};

enum { SHADOW_PLANS = sizeof shadow_plans / sizeof shadow_plans[0] };
enum { AO_PLANS = sizeof ao_plans / sizeof ao_plans[0] };

/* What auto is measured at. */
static const double errors[] = {0.05, 0.02, 0.01, 0.005};
enum { ERRORS = sizeof errors / sizeof errors[0] };

/* Embree's curve ends at so many rays, or at half of the truth's. */
enum { CURVE_RAYS = 256 };

/* Of a ray: Embree's of shadow and of AO, one that is sphere traced or marched. */
static const double shadow_ray = 0.015, ao_ray = 0.033, other_ray = 0.085;
/* Seconds that the voxels take which auto has made for itself. */
static const double voxels_s = 0.2;

size_t trade_task_planes(const trade_work *work, const trade_task *task) {
    if (task->subject < work->subject_count) {
        return work->subjects[task->subject].planes;
    }
    size_t planes = 0;
    for (size_t s = 0; s < work->subject_count; ++s) {
        planes += work->subjects[s].planes;
    }
    return planes;
}

/* --- what it takes */

static double microseconds_of_rays(const trade_work *work, size_t subject, double rays) {
    const bool embree = work->solids == NULL && work->triangles != NULL;
    const bool ao = subject < work->subject_count && work->subjects[subject].ao;
    return 0.15 + rays * (!embree ? other_ray : ao ? ao_ray : shadow_ray);
}

static double seconds_of(const trade_work *work, const trade_task *task, double microseconds) {
    const double values = (double)trade_task_planes(work, task) * (double)work->covered;
    const double seconds = 1e-6 * microseconds * values;
    return task->kind != TRADE_TRUTH && seconds < TRADE_SHORT_SECONDS ? TRADE_REPEATS * seconds : seconds;
}

/* --- the list */

static void add(trade_work *work, trade_task task, double microseconds) {
    task.expected = seconds_of(work, &task, microseconds);
    work->tasks[work->task_count++] = task;
}

static void add_truth(trade_work *work) {
    const double rays = work->settings->truth_rays;
    if (!vsh_scene_has_truth(work->scene)) { /* one bake */
        add(work, (trade_task){.kind = TRADE_TRUTH, .subject = work->subject_count}, rays * other_ray);
        return;
    }
    for (size_t s = 0; s < work->subject_count; ++s) {
        add(work, (trade_task){.kind = TRADE_TRUTH, .subject = s}, microseconds_of_rays(work, s, rays));
    }
}

static void add_embree(trade_work *work) {
    for (size_t s = 0; s < work->subject_count && work->meshes; ++s) {
        for (int32_t rays = 1; rays <= CURVE_RAYS && 2 * rays <= work->settings->truth_rays; rays *= 2) {
            add(work, (trade_task){.kind = TRADE_EMBREE, .subject = s, .number = rays},
                microseconds_of_rays(work, s, rays));
        }
    }
}

/* As the method that it will come to. */
static void add_auto(trade_work *work) {
    for (size_t e = 0; e < ERRORS; ++e) {
        for (size_t s = 0; s < work->subject_count; ++s) {
            const bool ao = work->subjects[s].ao;
            const int32_t method = ao             ? work->meshes ? VSH_AO_EXACT : VSH_AO_ADAPTIVE
                                   : work->meshes ? VSH_SHADOW_EXACT
                                                  : VSH_SHADOW_ADAPTIVE;
            const plan *plans = ao ? ao_plans : shadow_plans;
            double microseconds = 0.0;
            for (size_t i = 0; i < (ao ? AO_PLANS : SHADOW_PLANS); ++i) {
                const bool like = plans[i].method == method && plans[i].max_error == errors[e];
                microseconds = like ? plans[i].microseconds : microseconds;
            }
            add(work, (trade_task){.kind = TRADE_AUTO, .subject = s, .max_error = errors[e]}, microseconds);
            work->tasks[work->task_count - 1].expected += work->meshes ? 0.0 : voxels_s;
        }
    }
}

/* The first plans of all, on every field: where the budget ends, it is the dear ones that are missing. */
static void add_methods(trade_work *work) {
    for (size_t i = 0; i < SHADOW_PLANS || i < AO_PLANS; ++i) {
        for (size_t s = 0; s < work->subject_count; ++s) {
            const bool ao = work->subjects[s].ao;
            if (i >= (ao ? AO_PLANS : SHADOW_PLANS)) {
                continue;
            }
            const plan *p = ao ? &ao_plans[i] : &shadow_plans[i];
            if (!work->meshes && p->method == (ao ? (int32_t)VSH_AO_EXACT : (int32_t)VSH_SHADOW_EXACT)) {
                continue;
            }
            for (size_t f = 0; f < work->field_count; ++f) {
                add(work, (trade_task){TRADE_METHOD, s, f, p->method, p->number, p->max_error, 0.0, 0},
                    p->microseconds);
            }
        }
    }
}

/* --- whose it is */

static size_t least_of(const double *load, size_t count) {
    size_t least = 0;
    for (size_t i = 1; i < count; ++i) {
        least = load[i] < load[least] ? i : least;
    }
    return least;
}

static int share_out(trade_work *work) {
    const size_t parts = (size_t)work->settings->bake.shard_count;
    double *load = calloc(parts + 1, sizeof *load);
    if (load == NULL) {
        return cli_out_of_memory("parts");
    }
    for (size_t done = 0; done < work->task_count && parts > 0; ++done) {
        trade_task *next = NULL;
        for (size_t i = 0; i < work->task_count; ++i) {
            trade_task *task = &work->tasks[i];
            next = task->shard == 0 && (next == NULL || task->expected > next->expected) ? task : next;
        }
        const size_t part = least_of(load, parts);
        next->shard = (int32_t)part + 1;
        load[part] += next->expected;
    }
    free(load);
    return CLI_OK;
}

int trade_list_tasks(trade_work *work) {
    const size_t most = 2 * (1 + CURVE_RAYS + ERRORS + (SHADOW_PLANS + AO_PLANS) * work->field_count);
    work->tasks = calloc(most, sizeof *work->tasks);
    if (work->tasks == NULL) {
        return cli_out_of_memory("runs");
    }
    add_truth(work);
    add_embree(work);
    add_auto(work);
    add_methods(work);
    return share_out(work);
}
