/* Lists the runs, in the order of the table's rows. */
#include "cli/message.h"
#include "cli/try.h"
#include "trade.h"

#include <stdlib.h>

typedef struct plan {
    int32_t method;
    int32_t number;   /* rays or cones; 0: none */
    double max_error; /* 0: none */
} plan;

static const plan shadow_plans[] = {
    {VSH_SHADOW_HARD, 0, 0.0},      {VSH_SHADOW_CLASSIC, 0, 0.0},   {VSH_SHADOW_IMPROVED, 0, 0.0},
    {VSH_SHADOW_SMOOTH, 0, 0.0},    {VSH_SHADOW_CONE, 0, 0.0},      {VSH_SHADOW_RAYS, 4, 0.0},
    {VSH_SHADOW_ADAPTIVE, 0, 0.05}, {VSH_SHADOW_EXACT, 0, 0.05},    {VSH_SHADOW_ADAPTIVE, 0, 0.02},
    {VSH_SHADOW_EXACT, 0, 0.02},    {VSH_SHADOW_ADAPTIVE, 0, 0.01}, {VSH_SHADOW_EXACT, 0, 0.01},
    {VSH_SHADOW_RAYS, 16, 0.0},     {VSH_SHADOW_EXACT, 0, 0.005},   {VSH_SHADOW_ADAPTIVE, 0, 0.005},
    {VSH_SHADOW_RAYS, 64, 0.0},
};

static const plan ao_plans[] = {
    {VSH_AO_TAPS, 0, 0.0},      {VSH_AO_CONES, 4, 0.0},     {VSH_AO_CONES, 16, 0.0},
    {VSH_AO_RAYS, 4, 0.0},      {VSH_AO_ADAPTIVE, 0, 0.05}, {VSH_AO_EXACT, 0, 0.05},
    {VSH_AO_ADAPTIVE, 0, 0.02}, {VSH_AO_EXACT, 0, 0.02},    {VSH_AO_RAYS, 16, 0.0},
    {VSH_AO_ADAPTIVE, 0, 0.01}, {VSH_AO_EXACT, 0, 0.01},    {VSH_AO_RAYS, 64, 0.0},
    {VSH_AO_CONES, 64, 0.0},    {VSH_AO_EXACT, 0, 0.005},   {VSH_AO_ADAPTIVE, 0, 0.005},
};

enum { SHADOW_PLANS = sizeof shadow_plans / sizeof shadow_plans[0] };
enum { AO_PLANS = sizeof ao_plans / sizeof ao_plans[0] };

/* What auto is measured at. */
static const double errors[] = {0.05, 0.02, 0.01, 0.005};
enum { ERRORS = sizeof errors / sizeof errors[0] };

/* Embree's curve ends at so many rays, or at half of the truth's. */
enum { CURVE_RAYS = 256 };

static void add(trade_work *work, trade_task task) {
    work->tasks[work->task_count++] = task;
}

static void add_truth(trade_work *work) {
    if (!vsh_scene_has_truth(work->scene)) { /* one bake */
        add(work, (trade_task){.kind = TRADE_TRUTH, .subject = work->subject_count});
        return;
    }
    for (size_t s = 0; s < work->subject_count; ++s) {
        add(work, (trade_task){.kind = TRADE_TRUTH, .subject = s});
    }
}

static void add_embree(trade_work *work) {
    for (size_t s = 0; s < work->subject_count && work->meshes; ++s) {
        for (int32_t rays = 1; rays <= CURVE_RAYS && 2 * rays <= work->settings->truth_rays; rays *= 2) {
            add(work, (trade_task){.kind = TRADE_EMBREE, .subject = s, .number = rays});
        }
    }
}

static void add_auto(trade_work *work) {
    for (size_t e = 0; e < ERRORS; ++e) {
        for (size_t s = 0; s < work->subject_count; ++s) {
            add(work, (trade_task){.kind = TRADE_AUTO, .subject = s, .max_error = errors[e]});
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
                add(work, (trade_task){TRADE_METHOD, s, f, p->method, p->number, p->max_error});
            }
        }
    }
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
    return CLI_OK;
}
