/* Queries: shades points in pieces, few points in their order, many in the order of a curve. */
#include <vdbshade/light.h>

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "field/field.h"
#include "shade/query.h"

#include <stdlib.h>
#include <string.h>

/* --- points of a caller's arrays, packed or strided, of doubles or floats, behind one interface */

typedef struct point_view {
    size_t count;
    const char *positions, *normals, *texels; /* the last two may be NULL */
    size_t position_stride, normal_stride, texel_stride;
    bool floats; /* positions are floats */
} point_view;

static void view_position(const point_view *view, size_t i, double position[3]) {
    const char *at = view->positions + i * view->position_stride;
    if (view->floats) {
        float p[3];
        memcpy(p, at, sizeof p);
        for (int axis = 0; axis < 3; ++axis) {
            position[axis] = (double)p[axis];
        }
    } else {
        memcpy(position, at, 3 * sizeof *position);
    }
}

typedef struct query_call {
    const vsh_query *query;
    point_view view;
    const float *faces; /* [points][3] or NULL, as of vshi_ao_task */
    const vsh_query_output *output;
    const vshi_kernel *kernel;
    size_t first;          /* of the current points */
    const uint64_t *order; /* order_points(), or NULL: as they come */
} query_call;

/* --- points sorted along Morton's curve. Hilbert's, which never jumps, saves a hundredth of the samples of a
 * million random points and takes 30 ns more a point to compute. */

enum {
    ORDER_POINT = VSH_QUERY_BATCH - 1,
    BITS = 14, /* of the curve, along each edge */
    LAST = (1 << BITS) - 1,
    SHIFT = 20, /* VSH_QUERY_BATCH is 1 << SHIFT */
    DIGIT = 11,
    PASSES = 4,
    PIECE = 4096
};

_Static_assert(VSH_QUERY_BATCH == 1 << SHIFT, "points are numbered by the lowest bits");

/* The curve fills the casters' box, grown by this many diagonals. Points outside count as on its sides. */
static const double FAR = 4.0;

typedef struct ordering {
    const query_call *call;
    double low[3];
    double scale; /* cells are cubes */
    uint64_t *order;
} ordering;

/* Bits with two zeros between each. */
static inline uint64_t spread(uint64_t x) {
    x = (x | x << 16) & 0x0000ff0000ffu;
    x = (x | x << 8) & 0x00f00f00f00fu;
    x = (x | x << 4) & 0x0c30c30c30c3u;
    return (x | x << 2) & 0x249249249249u;
}

static uint64_t curve_place(const ordering *o, const double p[3]) {
    uint64_t place = 0;
    bool finite = true;
    for (int axis = 0; axis < 3; ++axis) {
        const double cell = (p[axis] - o->low[axis]) * o->scale;
        finite = finite && isfinite(p[axis]);
        place = place << 1 | spread((uint64_t)(cell > 0.0 ? cell < LAST ? cell : LAST : 0.0));
    }
    return finite ? place : UINT64_MAX >> SHIFT;
}

static void make_keys(void *user, size_t begin, size_t end) {
    const ordering *o = user;
    for (size_t i = begin; i < end; ++i) {
        double p[3];
        view_position(&o->call->view, o->call->first + i, p);
        o->order[i] = curve_place(o, p) << SHIFT | i;
    }
}

/* Sorts by the places, which are the higher bits; the points' numbers are the lower ones. After an even
 * number of passes the result is in `order`. */
static void sort(uint64_t *order, uint64_t *spare, size_t count) {
    for (int shift = SHIFT; shift < SHIFT + PASSES * DIGIT; shift += DIGIT) {
        uint32_t at[1 << DIGIT] = {0}, sum = 0;
        for (size_t i = 0; i < count; ++i) {
            ++at[order[i] >> shift & ((1 << DIGIT) - 1)];
        }
        for (int value = 0; value < 1 << DIGIT; ++value) {
            const uint32_t own = at[value];
            at[value] = sum;
            sum += own;
        }
        for (size_t i = 0; i < count; ++i) {
            spare[at[order[i] >> shift & ((1 << DIGIT) - 1)]++] = order[i];
        }
        uint64_t *const sorted = spare;
        spare = order;
        order = sorted;
    }
}

/* Orders the next `count` points of a call, at most VSH_QUERY_BATCH, on the job's threads. The lowest bits of
 * order[i], ORDER_POINT, are a point's number from the first. Points in one place keep their order, and
 * points that are not finite come last. `order` has room for twice as many. Errors: VSH_ERROR_CANCELLED,
 * VSH_ERROR_MEMORY, VSH_ERROR_INTERNAL. */
static vsh_result order_points(const query_call *call, size_t count, uint64_t *order, vshi_job *job,
                               vsh_error *error) {
    const vsh_field *field = call->query->ao.field;
    ordering o = {.call = call, .order = order};
    const vshi_vec sides = vshi_sub(vshi_vec_of(field->world_max), vshi_vec_of(field->world_min));
    const double diagonal = vshi_length(sides), longest = fmax(sides.x, fmax(sides.y, sides.z));
    for (int axis = 0; axis < 3; ++axis) {
        o.low[axis] = field->world_min[axis] - FAR * diagonal;
    }
    o.scale = (1 << BITS) / (longest + 2.0 * FAR * diagonal);
    VSHI_TRY(vshi_parallel_for(job, count, PIECE, 0, make_keys, &o, error));
    sort(order, order + count, count);
    return VSH_OK;
}

/* --- whether sorting pays: a million random points on the sample asset take 0.59 µs each by cone as they
 * come and 0.38 in order, a hundred thousand 0.59 and 0.49, ten thousand 0.63 and 0.67 */

/* Whether shading the next `count` points in the curve's order pays, by a few of them: most points that
 * follow each other are too far apart to share proofs. */
static bool order_pays(const query_call *call, size_t count) {
    enum { LEAST = 32768, TOGETHER = 16, LOOKS = 256 };
    static const double SPREAD = 8.0; /* voxels: side of the box of TOGETHER points that share little */
    if (count < LEAST) {
        return false;
    }
    size_t apart = 0;
    for (size_t look = 0; look < LOOKS; ++look) {
        const size_t begin = call->first + (count - TOGETHER) / (LOOKS - 1) * look;
        double low[3], high[3], side = 0.0;
        view_position(&call->view, begin, low);
        memcpy(high, low, sizeof high);
        for (size_t i = 1; i < TOGETHER; ++i) {
            double p[3];
            view_position(&call->view, begin + i, p);
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = fmin(low[axis], p[axis]);
                high[axis] = fmax(high[axis], p[axis]);
            }
        }
        for (int axis = 0; axis < 3; ++axis) {
            side = fmax(side, high[axis] - low[axis]);
        }
        apart += side > SPREAD * call->query->ao.field->voxel_size;
    }
    return apart > LOOKS / 4;
}

/* --- shading */

/* Fewer points are shaded on the calling thread: starting others costs some dozens of marches. */
enum { FEW = 64 };

static inline float *array_of(float *const *arrays, size_t light) {
    return arrays != NULL ? arrays[light] : NULL;
}

/* Writes distances and, unless NULL, gradients of positions [count][3]. */
static void measure(const query_call *call, size_t count, const double *positions, float *distances,
                    float *gradients) {
    const vsh_field *field = call->query->ao.field;
    for (size_t i = 0; i < count; ++i) {
        const vshi_vec p = vshi_to_field(field, positions + 3 * i);
        const bool finite = vshi_finite(p);
        const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
        float slope[3];
        const float h = vshi_field_lower_bound(field, at, gradients != NULL ? slope : NULL);
        distances[i] = finite ? (float)((double)h * field->voxel_size) : NAN;
        if (gradients != NULL) {
            const vshi_vec g =
                finite ? vshi_direction_to_world(field, vshi_vec_off(slope)) : (vshi_vec){NAN, NAN, NAN};
            vshi_vec_to_floats(g, gradients + 3 * i);
        }
    }
}

/* A piece of points, gathered from the caller's arrays. */
typedef struct piece {
    const query_call *call;
    size_t begin, count;
    double positions[VSHI_PIECE][3];
    float normals[VSHI_PIECE][3], faces[VSHI_PIECE][3];
    uint32_t texels[VSHI_PIECE];
    float values[VSHI_PIECE], deviations[VSHI_PIECE];
    float gradients[VSHI_PIECE][3];
} piece;

static inline size_t number_of(const piece *p, size_t i) {
    const query_call *call = p->call;
    return call->first + (call->order != NULL ? call->order[p->begin + i] & ORDER_POINT : p->begin + i);
}

static void scatter(const piece *p, size_t width, const float *values, float *to) {
    const size_t stride = p->call->output->stride != 0 ? p->call->output->stride : width * sizeof *to;
    for (size_t i = 0; to != NULL && i < p->count; ++i) {
        memcpy((char *)to + number_of(p, i) * stride, values + width * i, width * sizeof *to);
    }
}

static void gather(piece *p) {
    enum { AHEAD = 16 }; /* points that are prefetched, as they may lie anywhere in memory */
    const point_view *all = &p->call->view;
    for (size_t i = 0; i < p->count; ++i) {
        const size_t next = number_of(p, i + AHEAD < p->count ? i + AHEAD : i);
        const size_t point = number_of(p, i);
        __builtin_prefetch(all->positions + next * all->position_stride);
        view_position(all, point, p->positions[i]);
        if (all->normals != NULL) {
            __builtin_prefetch(all->normals + next * all->normal_stride);
            memcpy(p->normals[i], all->normals + point * all->normal_stride, sizeof p->normals[i]);
        }
        if (p->call->faces != NULL) {
            memcpy(p->faces[i], p->call->faces + 3 * point, sizeof p->faces[i]);
        }
        p->texels[i] = (uint32_t)point;
        if (all->texels != NULL) {
            memcpy(&p->texels[i], all->texels + point * all->texel_stride, sizeof p->texels[i]);
        }
    }
}

/* Gathers the points of a piece, shades them, and scatters the values. */
static void shade_piece(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const query_call *call = user;
    const vsh_query_output *output = call->output;
    piece p;
    p.call = call;
    p.begin = begin;
    p.count = end - begin;
    gather(&p);
    const vsh_points points = {p.count, &p.positions[0][0],
                               call->view.normals != NULL ? &p.normals[0][0] : NULL, p.texels};
    for (size_t l = 0; output->visibility != NULL && l < call->query->light_count; ++l) {
        if (output->visibility[l] != NULL) {
            float *deviation = array_of(output->shadow_error, l);
            vshi_shadow_task task = call->query->shadow[l];
            task.kernel = call->kernel;
            task.points = &points;
            task.scattered = call->view.texels == NULL;
            task.visibility = p.values;
            task.deviation = deviation != NULL ? p.deviations : NULL;
            vshi_shadow_shade(&task, 0, p.count, stats);
            scatter(&p, 1, p.values, output->visibility[l]);
            scatter(&p, 1, p.deviations, deviation);
        }
    }
    if (output->ao != NULL) {
        vshi_ao_task task = call->query->ao;
        task.kernel = call->kernel;
        task.points = &points;
        task.faces = call->faces != NULL ? &p.faces[0][0] : NULL;
        task.values.ao = p.values;
        task.values.deviation = output->ao_error != NULL ? p.deviations : NULL;
        vshi_ao_shade(&task, 0, p.count, stats);
        scatter(&p, 1, p.values, output->ao);
        scatter(&p, 1, p.deviations, output->ao_error);
    }
    if (output->distance != NULL || output->gradient != NULL) {
        measure(call, p.count, points.positions, p.values,
                output->gradient != NULL ? &p.gradients[0][0] : NULL);
        scatter(&p, 1, p.values, output->distance);
        scatter(&p, 3, &p.gradients[0][0], output->gradient);
    }
}

/* Shades VSH_QUERY_BATCH points at a time, so that calls for as many each give the same bits. */
static vsh_result shade_many(query_call *call, const vsh_run *run, vshi_job *job, vsh_shade_stats *stats,
                             vsh_error *error) {
    const size_t count = call->view.count, most = count < VSH_QUERY_BATCH ? count : VSH_QUERY_BATCH;
    const double bytes = vshi_field_bytes(call->query->ao.field) + (double)most * 2.0 * sizeof(uint64_t);
    uint64_t *order = NULL;
    vsh_result result = VSH_OK;
    for (; call->first < count; call->first += most) {
        const size_t left = count - call->first, now = left < most ? left : most;
        call->order = NULL;
        if (order_pays(call, now)) {
            if (order == NULL) {
                VSHI_TRY_DONE(vshi_check_limit(run, bytes, "query", error));
                VSHI_TRY_DONE(
                    vshi_allocate((void **)&order, most, 2 * sizeof *order, "order of points", error));
            }
            VSHI_TRY_DONE(order_points(call, now, order, job, error));
            call->order = order;
        }
        VSHI_TRY_DONE(vshi_shade_pieces(job, now, VSHI_PIECE, shade_piece, call, stats, error));
    }
done:
    free(order);
    return result;
}

/* Checks the output. *any: some array is not NULL. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result check_output(const vsh_query *query, const point_view *view, const vsh_query_output *output,
                               bool *any, vsh_error *error) {
    *any = output->ao != NULL || output->distance != NULL || output->gradient != NULL;
    for (size_t l = 0; l < query->light_count; ++l) {
        const bool asked = array_of(output->visibility, l) != NULL;
        if (!asked && array_of(output->shadow_error, l) != NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "output: shadow_error of light %zu without visibility", l);
        }
        *any = *any || asked;
    }
    if (output->ao == NULL && output->ao_error != NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "output: ao_error without ao");
    }
    if ((output->distance != NULL || output->gradient != NULL) && query->ao.field->unknown) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "output: distance or gradient, of occluders without voxels, which have them");
    }
    const size_t least = (output->gradient != NULL ? 3 : 1) * sizeof(float);
    if (output->stride != 0 && (output->stride < least || output->stride % sizeof(float) != 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "output: stride %zu: expected 0 or bytes, %zu, %zu …",
                         output->stride, least, least + sizeof(float));
    }
    if (output->ao != NULL && view->normals == NULL && view->count > 0 && !query->ao.sphere) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "AO needs normals: vsh_points.normals is NULL");
    }
    return VSH_OK;
}

/* Replaces a stride of 0 by `packed`. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result resolve_stride(const char *name, size_t unit, size_t packed, size_t *stride,
                                 vsh_error *error) {
    if (*stride != 0 && (*stride < packed || *stride % unit != 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "points: %s %zu: expected 0 or bytes, %zu, %zu …", name,
                         *stride, packed, packed + unit);
    }
    *stride = *stride != 0 ? *stride : packed;
    return VSH_OK;
}

/* Describes the caller's arrays. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result view_points(const vsh_points *points, const vsh_point_layout *layout, point_view *view,
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
    *view = (point_view){points->count,
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
    VSHI_NEEDS_BOTH(query, points);
    VSHI_NEEDS(output);
    vsh_run full_run;
    vsh_query_output full = vsh_query_output_default();
    point_view view;
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
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, &full_run, "query", view.count, "query", error));
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
    VSHI_MAKES(query);
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
