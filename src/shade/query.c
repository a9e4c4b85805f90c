/* Shades points in pieces: few as they come, many in the order of a curve. */
#include <vdbshade/query.h>

#include "base/floats.h"
#include "base/memory.h"
#include "field/level.h"
#include "shade/layers.h"
#include "shade/query.h"

#include <stdlib.h>
#include <string.h>

/* Points that are shaded on the calling thread: starting others costs as much as some dozens of marches. */
enum { FEW = 64 };

typedef struct query_call {
    const vsh_query *query;
    vshi_view view;
    const float *faces; /* [points][3] or NULL, as of vshi_ao_task */
    const vsh_query_output *output;
    const vshi_kernel *kernel;
    size_t first;          /* of the points that are under way */
    const uint64_t *order; /* vshi_order_points(), or NULL: as they come */
} query_call;

static inline float *array_of(float *const *arrays, size_t light) {
    return arrays != NULL ? arrays[light] : NULL;
}

/* Distances and, where not NULL, gradients of positions [count][3]. */
static void measure(const query_call *call, size_t count, const double *positions, float *distances,
                    float *gradients) {
    const vsh_field *field = call->query->ao.task.field;
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_to_field(field, positions + 3 * i);
        const bool finite = vshi_finite(p);
        const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
        float slope[3];
        const float h = vshi_field_lower_bound(field, at, gradients != NULL ? slope : NULL);
        if (distances != NULL) {
            distances[i] = finite ? (float)((double)h * field->voxel_size) : NAN;
        }
        if (gradients != NULL) {
            const vshi_vec g =
                finite ? vshi_direction_to_world(field, vshi_vec_off(slope)) : (vshi_vec){NAN, NAN, NAN};
            gradients[3 * i] = (float)g.x;
            gradients[3 * i + 1] = (float)g.y;
            gradients[3 * i + 2] = (float)g.z;
        }
    }
}

/* Points from anywhere, brought together. */
typedef struct gathered {
    double positions[VSHI_PIECE][3];
    float normals[VSHI_PIECE][3], faces[VSHI_PIECE][3];
    uint32_t texels[VSHI_PIECE];
    float values[VSHI_PIECE], deviations[VSHI_PIECE];
    float gradients[VSHI_PIECE][3];
} gathered;

/* Numbers of the points of a piece. */
typedef struct piece {
    const query_call *call;
    size_t begin, count;
    size_t stride; /* of the output, bytes; 0: packed */
} piece;

static inline size_t number_of(const piece *p, size_t i) {
    const query_call *call = p->call;
    return call->first + (call->order != NULL ? call->order[p->begin + i] & VSHI_ORDER_POINT : p->begin + i);
}

static void scatter(const piece *p, size_t width, const float *values, float *to) {
    const size_t stride = p->stride != 0 ? p->stride : width * sizeof *to;
    for (size_t i = 0; to != NULL && i < p->count; ++i) {
        memcpy((char *)to + number_of(p, i) * stride, values + width * i, width * sizeof *to);
    }
}

static void gather(const piece *p, gathered *g) {
    enum { AHEAD = 16 }; /* what comes next, from anywhere in memory, is asked for so early */
    const vshi_view *all = &p->call->view;
    for (size_t i = 0; i < p->count; ++i) {
        const size_t next = number_of(p, i + AHEAD < p->count ? i + AHEAD : i);
        const size_t point = number_of(p, i);
        __builtin_prefetch(all->positions + next * all->position_stride);
        vshi_view_position(all, point, g->positions[i]);
        if (all->normals != NULL) {
            __builtin_prefetch(all->normals + next * all->normal_stride);
            memcpy(g->normals[i], all->normals + point * all->normal_stride, sizeof g->normals[i]);
        }
        if (p->call->faces != NULL) {
            memcpy(g->faces[i], p->call->faces + 3 * point, sizeof g->faces[i]);
        }
        g->texels[i] = (uint32_t)point;
        if (all->texels != NULL) {
            memcpy(&g->texels[i], all->texels + point * all->texel_stride, sizeof g->texels[i]);
        }
    }
}

/* Shades a piece: gathers its points, then scatters the values. */
static void shade_piece(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const query_call *call = user;
    const vsh_query_output *output = call->output;
    const piece p = {call, begin, end - begin, output->stride};
    gathered g;
    gather(&p, &g);
    const vsh_points points = {p.count, &g.positions[0][0],
                               call->view.normals != NULL ? &g.normals[0][0] : NULL, g.texels};
    for (size_t l = 0; output->visibility != NULL && l < call->query->light_count; ++l) {
        if (output->visibility[l] != NULL) {
            float *deviation = array_of(output->deviation, l);
            vshi_shadow_task task = call->query->shadow[l].task;
            task.kernel = call->kernel;
            task.points = &points;
            task.scattered = call->view.texels == NULL;
            task.visibility = g.values;
            task.deviation = deviation != NULL ? g.deviations : NULL;
            vshi_shadow_shade(&task, 0, p.count, stats);
            scatter(&p, 1, g.values, output->visibility[l]);
            scatter(&p, 1, g.deviations, deviation);
        }
    }
    if (output->ao != NULL) {
        vshi_ao_task task = call->query->ao.task;
        task.kernel = call->kernel;
        task.points = &points;
        task.faces = call->faces != NULL ? &g.faces[0][0] : NULL;
        task.ao = g.values;
        task.deviation = output->ao_deviation != NULL ? g.deviations : NULL;
        vshi_ao_shade(&task, 0, p.count, stats);
        scatter(&p, 1, g.values, output->ao);
        scatter(&p, 1, g.deviations, output->ao_deviation);
    }
    if (output->distance != NULL || output->gradient != NULL) {
        measure(call, p.count, points.positions, g.values,
                output->gradient != NULL ? &g.gradients[0][0] : NULL);
        scatter(&p, 1, g.values, output->distance);
        scatter(&p, 3, &g.gradients[0][0], output->gradient);
    }
}

/* VSH_QUERY_BATCH points at a time, so that calls for so many each give the same bits. */
static vsh_result shade_many(query_call *call, const vsh_run *run, vshi_job *job, vsh_shade_stats *stats,
                             vsh_error *error) {
    const vsh_field *field = call->query->ao.task.field;
    const size_t count = call->view.count;
    const size_t most = count < VSH_QUERY_BATCH ? count : VSH_QUERY_BATCH;
    uint64_t *order = NULL;
    vsh_result result = VSH_OK;
    for (; call->first < count; call->first += most) {
        const size_t left = count - call->first;
        const size_t now = left < most ? left : most;
        const bool ordered = vshi_order_pays(field, &call->view, call->first, now);
        call->order = NULL;
        if (ordered && order == NULL) {
            VSHI_TRY_DONE(vshi_check_limit(run, vshi_field_bytes(field) + (double)most * 2.0 * sizeof *order,
                                           "query", error));
            VSHI_TRY_DONE(vshi_allocate((void **)&order, most, 2 * sizeof *order, "order of points", error));
        }
        if (ordered) {
            VSHI_TRY_DONE(vshi_order_points(job, field, &call->view, call->first, now, order, error));
            call->order = order;
        }
        VSHI_TRY_DONE(vshi_shade_pieces(job, now, VSHI_PIECE, shade_piece, call, stats, error));
    }
done:
    free(order);
    return result;
}

/* Whether anything is asked for. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result check_output(const vsh_query *query, const vshi_view *view, const vsh_query_output *output,
                               bool *any, vsh_error *error) {
    *any = output->ao != NULL || output->distance != NULL || output->gradient != NULL;
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
    if ((output->distance != NULL || output->gradient != NULL) && query->ao.task.field->unknown) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "output: distance or gradient, of occluders without voxels, which have them");
    }
    const size_t least = (output->gradient != NULL ? 3 : 1) * sizeof(float);
    if (output->stride != 0 && (output->stride < least || output->stride % sizeof(float) != 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "output: stride %zu: expected 0 or bytes, %zu, %zu …",
                         output->stride, least, least + sizeof(float));
    }
    return output->ao != NULL && view->normals == NULL && !query->ao.task.sphere
               ? vshi_ao_check_points(&(vsh_points){.count = view->count}, error)
               : VSH_OK;
}

/* 0 becomes `packed`. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result resolve_stride(const char *name, size_t unit, size_t packed, size_t *stride,
                                 vsh_error *error) {
    if (*stride != 0 && (*stride < packed || *stride % unit != 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "points: %s %zu: expected 0 or bytes, %zu, %zu …", name,
                         *stride, packed, packed + unit);
    }
    *stride = *stride != 0 ? *stride : packed;
    return VSH_OK;
}

/* Points as they stand in memory. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result view_points(const vsh_points *points, const vsh_point_layout *layout, vshi_view *view,
                              const float **faces, vsh_error *error) {
    vsh_point_layout l = vsh_point_layout_default();
    VSHI_TRY(vshi_options_resolve(layout, &l, sizeof l, "vsh_point_layout", error));
    const bool floats = l.float_positions != NULL;
    if (points->count > 0 && floats == (points->positions != NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "points: expected one of positions and float_positions");
    }
    const size_t unit = floats ? sizeof(float) : sizeof(double);
    VSHI_TRY(resolve_stride("position_stride", unit, 3 * unit, &l.position_stride, error));
    VSHI_TRY(resolve_stride("normal_stride", sizeof(float), 3 * sizeof(float), &l.normal_stride, error));
    VSHI_TRY(resolve_stride("texel_stride", sizeof(uint32_t), sizeof(uint32_t), &l.texel_stride, error));
    *view = (vshi_view){points->count,
                        floats ? (const char *)l.float_positions : (const char *)points->positions,
                        (const char *)points->normals,
                        (const char *)points->texels,
                        l.position_stride,
                        l.normal_stride,
                        l.texel_stride,
                        floats};
    *faces = l.face_normals;
    return VSH_OK;
}

vsh_result vsh_query_points(const vsh_query *query, const vsh_points *points, const vsh_point_layout *layout,
                            const vsh_run *run, const vsh_query_output *output, vsh_shade_stats *stats,
                            vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(query);
    VSHI_NEEDS(points);
    VSHI_NEEDS(output);
    vsh_run full_run;
    vsh_query_output full = vsh_query_output_default();
    vshi_view view;
    const float *faces = NULL;
    bool any = false;
    VSHI_TRY(view_points(points, layout, &view, &faces, error));
    VSHI_TRY(vshi_run_resolve(run, &full_run, error));
    VSHI_TRY(vshi_options_resolve(output, &full, sizeof full, "vsh_query_output", error));
    VSHI_TRY(check_output(query, &view, &full, &any, error));
    if (!any || view.count == 0) {
        return VSH_OK;
    }
    query_call call = {.query = query,
                       .view = view,
                       .faces = faces,
                       .output = &full,
                       .kernel = vshi_kernel_of(full_run.isa)};
    if (view.count <= FEW) {
        vsh_shade_stats own = vsh_shade_stats_zero();
        shade_piece(&call, 0, view.count, stats != NULL ? stats : &own);
        return VSH_OK;
    }
    vshi_job *job = vshi_job_begin(&full_run, "query", view.count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "query: the system refused memory");
    }
    const vsh_result result = shade_many(&call, &full_run, job, stats, error);
    vshi_job_end(job);
    return result;
}

/* --- the handle */

void vsh_query_free(vsh_query *query) {
    if (query == NULL) {
        return;
    }
    for (size_t l = 0; query->shadow != NULL && l < query->light_count; ++l) {
        vshi_shadow_close(&query->shadow[l]);
    }
    vshi_ao_close(&query->ao);
    free(query->shadow);
    free(query->lights);
    free(query);
}

static vsh_result prepare(vsh_query *q, const vsh_occluders *occluders, const vsh_light *lights,
                          const vsh_shade_options *options, bool sphere, vsh_error *error) {
    static const char what[] = "lights of a query";
    VSHI_TRY(vshi_allocate((void **)&q->lights, q->light_count, sizeof *q->lights, what, error));
    VSHI_TRY(vshi_allocate((void **)&q->shadow, q->light_count, sizeof *q->shadow, what, error));
    for (size_t l = 0; l < q->light_count; ++l) {
        vsh_error why;
        q->lights[l] = lights[l];
        const vsh_result result =
            vshi_shadow_open(occluders, &q->lights[l], options, VSH_ISA_BEST, &q->shadow[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
    }
    return vshi_ao_open(occluders, options, (vshi_ao_shading){.sphere = sphere}, VSH_ISA_BEST, &q->ao, error);
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
    vsh_shade_options full;
    *query = NULL;
    VSHI_TRY(vshi_shade_options_resolve(options, &full, error));
    VSHI_TRY(vshi_allocate((void **)&q, 1, sizeof *q, "query", error));
    q->light_count = light_count;
    const vsh_result result = prepare(q, occluders, lights, &full, sphere, error);
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
    vshi_shadow_task task = query->shadow[light].task;
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
