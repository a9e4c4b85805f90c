/* Points asked for by a handle: few as they are, many in the order of a curve. */
#include <vdbshade/query.h>

#include "base/floats.h"
#include "base/memory.h"
#include "field/level.h"
#include "shade/ao.h"
#include "shade/order.h"
#include "shade/shadow.h"

#include <stdlib.h>
#include <string.h>

/* Points that are shaded on the calling thread: starting others costs as much as some dozens of marches. */
enum { FEW = 64 };

struct vsh_query {
    vsh_shade_options options;
    size_t light_count;
    vsh_light *lights;        /* [light_count] */
    vshi_shadow_task *shadow; /* [light_count] */
    vshi_ao_task ao;
    vshi_ao_cones cones;
    vshi_sampler *sampler; /* NULL where no method takes one */
};

void vsh_query_free(vsh_query *query) {
    if (query == NULL) {
        return;
    }
    vshi_sampler_free(query->sampler);
    free(query->shadow);
    free(query->lights);
    free(query);
}

static vsh_result prepare(vsh_query *q, const vsh_field *field, const vsh_light *lights, size_t light_count,
                          vsh_error *error) {
    vsh_result result =
        vshi_allocate((void **)&q->lights, light_count, sizeof *q->lights, "lights of a query", error);
    if (result == VSH_OK) {
        result =
            vshi_allocate((void **)&q->shadow, light_count, sizeof *q->shadow, "lights of a query", error);
    }
    for (; result == VSH_OK && q->light_count < light_count; ++q->light_count) {
        const size_t l = q->light_count;
        vsh_error why;
        q->lights[l] = lights[l];
        result = vshi_shadow_prepare(field, &q->lights[l], &q->options, &q->shadow[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
    }
    if (result == VSH_OK) {
        result = vshi_ao_prepare(field, &q->options, &q->cones, &q->ao, error);
    }
    if (result == VSH_OK &&
        ((light_count > 0 && vshi_shadow_has_rays(&q->options)) || vshi_ao_has_rays(&q->options))) {
        result = vshi_shade_sampler(&q->options, "query", &q->sampler, error);
    }
    for (size_t l = 0; l < q->light_count; ++l) {
        q->shadow[l].sampler = q->sampler;
    }
    q->ao.sampler = q->sampler;
    return result;
}

vsh_result vsh_query_create(const vsh_field *field, const vsh_light *lights, size_t light_count,
                            const vsh_shade_options *options, vsh_query **query, vsh_error *error) {
    VSHI_FLOATS;
    vsh_query *q = NULL;
    *query = NULL;
    vsh_result result = vshi_allocate((void **)&q, 1, sizeof *q, "query", error);
    if (result == VSH_OK) {
        result = vshi_shade_options_resolve(options, &q->options, error);
    }
    if (result == VSH_OK) {
        result = prepare(q, field, lights, light_count, error);
    }
    if (result != VSH_OK) {
        vsh_query_free(q);
        return result;
    }
    *query = q;
    return VSH_OK;
}

/* --- points */

typedef struct query_call {
    const vsh_query *query;
    const vsh_points *points;
    const vsh_query_output *output;
    const vshi_kernel *kernel;
    size_t first;          /* of the points in `order` */
    const uint32_t *order; /* numbers from `first` on */
} query_call;

static inline float *array_of(float *const *arrays, size_t light) {
    return arrays != NULL ? arrays[light] : NULL;
}

static void shade_light(const query_call *call, size_t light, const vsh_points *points, size_t begin,
                        size_t end, float *visibility, float *deviation, vsh_shade_stats *stats) {
    vshi_shadow_task task = call->query->shadow[light];
    task.kernel = call->kernel;
    task.points = points;
    task.visibility = visibility;
    task.deviation = deviation;
    vshi_shadow_shade(&task, begin, end, stats);
}

static void shade_sky(const query_call *call, const vsh_points *points, size_t begin, size_t end, float *ao,
                      float *deviation, vsh_shade_stats *stats) {
    vshi_ao_task task = call->query->ao;
    task.kernel = call->kernel;
    task.points = points;
    task.ao = ao;
    task.deviation = deviation;
    vshi_ao_shade(&task, begin, end, stats);
}

/* Points begin … end - 1, at most VSHI_PIECE of them, as they stand. */
static void shade_in_place(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const query_call *call = user;
    const vsh_query_output *output = call->output;
    for (size_t l = 0; output->visibility != NULL && l < call->query->light_count; ++l) {
        if (output->visibility[l] != NULL) {
            shade_light(call, l, call->points, begin, end, output->visibility[l],
                        array_of(output->deviation, l), stats);
        }
    }
    if (output->ao != NULL) {
        shade_sky(call, call->points, begin, end, output->ao, output->ao_deviation, stats);
    }
}

/* Points of the order, brought together. */
typedef struct gathered {
    double positions[VSHI_PIECE][3];
    float normals[VSHI_PIECE][3];
    uint32_t texels[VSHI_PIECE];
    float values[VSHI_PIECE], deviations[VSHI_PIECE];
} gathered;

static void scatter(const uint32_t *order, size_t count, const float *values, float *to) {
    for (size_t i = 0; i < count; ++i) {
        to[order[i]] = values[i];
    }
}

/* The same of the order's begin … end - 1. */
static void shade_in_order(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    enum { AHEAD = 16 }; /* what comes next, from anywhere in memory, is asked for so early */
    const query_call *call = user;
    const vsh_query_output *output = call->output;
    const vsh_points *all = call->points;
    const uint32_t *order = call->order + begin;
    const size_t count = end - begin;
    gathered g;
    for (size_t i = 0; i < count; ++i) {
        const size_t next = call->first + order[i + AHEAD < count ? i + AHEAD : i];
        const size_t point = call->first + order[i];
        __builtin_prefetch(all->positions + 3 * next);
        memcpy(g.positions[i], all->positions + 3 * point, sizeof g.positions[i]);
        if (all->normals != NULL) {
            __builtin_prefetch(all->normals + 3 * next);
            memcpy(g.normals[i], all->normals + 3 * point, sizeof g.normals[i]);
        }
        g.texels[i] = all->texels != NULL ? all->texels[point] : (uint32_t)point;
    }
    const vsh_points points = {count, &g.positions[0][0], all->normals != NULL ? &g.normals[0][0] : NULL,
                               g.texels};
    for (size_t l = 0; output->visibility != NULL && l < call->query->light_count; ++l) {
        if (output->visibility[l] == NULL) {
            continue;
        }
        float *deviation = array_of(output->deviation, l);
        shade_light(call, l, &points, 0, count, g.values, deviation != NULL ? g.deviations : NULL, stats);
        scatter(order, count, g.values, output->visibility[l] + call->first);
        if (deviation != NULL) {
            scatter(order, count, g.deviations, deviation + call->first);
        }
    }
    if (output->ao != NULL) {
        shade_sky(call, &points, 0, count, g.values, output->ao_deviation != NULL ? g.deviations : NULL,
                  stats);
        scatter(order, count, g.values, output->ao + call->first);
        if (output->ao_deviation != NULL) {
            scatter(order, count, g.deviations, output->ao_deviation + call->first);
        }
    }
}

static vsh_result shade_ordered(query_call *call, const vsh_run *run, vshi_job *job, vsh_shade_stats *stats,
                                vsh_error *error) {
    const vsh_field *field = call->query->ao.field;
    const size_t count = call->points->count;
    const size_t most = count < VSHI_ORDER_MOST ? count : VSHI_ORDER_MOST;
    vshi_order order = {NULL, NULL, 0};
    vsh_result result =
        vshi_check_limit(run, vshi_field_bytes(field) + (double)most * VSHI_ORDER_BYTES, "query", error);
    if (result == VSH_OK) {
        result = vshi_order_create(most, &order, error);
    }
    for (; result == VSH_OK && call->first < count; call->first += most) {
        const size_t left = count - call->first;
        const size_t now = left < most ? left : most;
        result = vshi_order_points(job, field, call->points, call->first, now, &order, error);
        if (result == VSH_OK) {
            call->order = order.point;
            result = vshi_shade_pieces(job, now, NULL, VSHI_PIECE, shade_in_order, call, stats, error);
        }
    }
    vshi_order_free(&order);
    return result;
}

/* Whether anything is asked for. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result check_output(const vsh_query *query, const vsh_points *points,
                               const vsh_query_output *output, bool *any, vsh_error *error) {
    *any = output->ao != NULL;
    for (size_t l = 0; l < query->light_count; ++l) {
        const bool asked = array_of(output->visibility, l) != NULL;
        if (!asked && array_of(output->deviation, l) != NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "output: deviation of light %zu without visibility",
                             l);
        }
        *any = *any || asked;
    }
    if (output->ao == NULL && output->ao_deviation != NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "output: ao_deviation without ao");
    }
    return output->ao != NULL ? vshi_ao_check_points(points, error) : VSH_OK;
}

vsh_result vsh_query_points(const vsh_query *query, const vsh_points *points, const vsh_run *run,
                            const vsh_query_output *output, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    vsh_run full_run;
    vsh_query_output full = vsh_query_output_default();
    bool any = false;
    vsh_result result = vshi_run_resolve(run, &full_run, error);
    if (result == VSH_OK) {
        result = vshi_options_resolve(output, &full, sizeof full, "vsh_query_output", error);
    }
    if (result == VSH_OK) {
        result = check_output(query, points, &full, &any, error);
    }
    if (result != VSH_OK || !any || points->count == 0) {
        return result;
    }
    query_call call = {
        .query = query, .points = points, .output = &full, .kernel = vshi_kernel_of(full_run.isa)};
    if (points->count <= FEW) {
        vsh_shade_stats own = vsh_shade_stats_zero();
        shade_in_place(&call, 0, points->count, stats != NULL ? stats : &own);
        return VSH_OK;
    }
    vshi_job *job = vshi_job_begin(&full_run, "query", points->count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "query: the system refused memory");
    }
    result =
        vshi_order_pays(query->ao.field, points)
            ? shade_ordered(&call, &full_run, job, stats, error)
            : vshi_shade_pieces(job, points->count, NULL, VSHI_PIECE, shade_in_place, &call, stats, error);
    vshi_job_end(job);
    return result;
}
