#include "shade/shadow_cast.h"

#include <math.h>

enum { PACKET_POINTS = 64 };

/* Rays on triangles begin this part of the casters' size off the surface: above the rounding of floats, below
 * what shows. */
static const double TRACE_LIFT = 0x1p-18;

/* What rays are traced against: in world space, or a field's surface in its own. */
static const vsh_triangles *traced_of(const vshi_shadow_task *task) {
    return task->options->method == VSH_SHADOW_EXACT ? task->triangles : task->field->surface;
}

/* Where a point's traced rays begin, in the space of these. */
static vshi_vec begin_of(const vshi_shadow_task *task, const vshi_open_point *p) {
    return task->options->method == VSH_SHADOW_EXACT ? p->start : p->origin;
}

static void flush(vshi_ray_batch *batch) {
    const vshi_shadow_task *task = batch->task;
    vshi_march_stats work = {0, 0};
    task->kernel->march(task->field, &batch->chunk.rays, VSHI_MARCH_PLAIN, task->options->max_steps, &work);
    batch->stats->samples += work.samples;
    batch->stats->unfinished += work.unfinished;
    for (size_t r = 0; r < batch->chunk.rays.count; ++r) {
        batch->open[batch->chunk.owner[r]].lit += batch->chunk.rays.close[r] > 0.0f;
    }
    vshi_chunk_clear(&batch->chunk);
    if (batch->traced_count > 0) {
        vshi_triangles_blocked(traced_of(task), batch->traced, batch->traced_count, batch->blocked);
        for (size_t r = 0; r < batch->traced_count; ++r) {
            batch->open[batch->traced_owner[r]].lit += !batch->blocked[r];
        }
        batch->traced_count = 0;
    }
}

/* Turns an open point to world space, off its surface by TRACE_LIFT. */
static void turn_to_world(const vshi_shadow_task *task, vshi_open_point *p) {
    const double tangent = vshi_length(p->u);
    const double *at = task->points->positions + 3 * p->point;
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = task->field->world_max[axis] - task->field->world_min[axis];
        size = side > size ? side : size;
    }
    const double lift = TRACE_LIFT * size + task->options->surface_offset;
    p->normal = vshi_direction_to_world(task->field, p->normal);
    p->axis = vshi_direction_to_world(task->field, p->axis);
    p->u = vshi_scale(vshi_direction_to_world(task->field, p->u), tangent);
    p->v = vshi_scale(vshi_direction_to_world(task->field, p->v), tangent);
    p->start = vshi_add(vshi_vec_of(at), vshi_scale(p->normal, lift));
    vshi_light_view view;
    p->end = vshi_light_look(&task->world, p->start, false, &view) == VSHI_LIGHT_SEEN ? view.end : 0.0;
}

/* Looks at a light that is no disc, in the space of the rays. */
static void look_at_shape(const vshi_shadow_task *task, vshi_open_point *p) {
    const double *at = task->points->positions + 3 * p->point;
    const bool traced = task->options->method == VSH_SHADOW_EXACT;
    const vshi_vec from = traced ? vshi_vec_of(at) : vshi_to_field(task->field, at);
    vshi_light_look(traced ? &task->world : &task->place, from, false, &p->view);
    p->off = vshi_sub(traced ? p->start : p->origin, from);
}

/* Unit direction of the ray to a place on the unit disc, and how far it goes; false below the horizon. */
static bool direct(const vshi_shadow_task *task, const vshi_open_point *p, const double disc[2], vshi_vec *d,
                   double *end) {
    const bool horizon = task->points->normals != NULL;
    const vshi_light_shape *shape = task->place.shape;
    *end = p->end;
    if (shape == NULL) {
        *d = vshi_unit(vshi_add(p->axis, vshi_add(vshi_scale(p->u, disc[0]), vshi_scale(p->v, disc[1]))));
        return !(horizon && vshi_dot(*d, p->normal) <= 0.0);
    }
    const bool traced = task->options->method == VSH_SHADOW_EXACT;
    const vshi_vec way = shape->ray(traced ? &task->world : &task->place, &p->view, disc);
    const vshi_vec to = vshi_sub(way, p->off);
    const double length = vshi_length(to), ahead = vshi_dot(to, p->axis);
    *d = vshi_unit(to);
    /* what is proved free ends the cone early, at a depth along its axis */
    *end = !traced && ahead > p->end ? length * p->end / ahead : length;
    return !(horizon && vshi_dot(way, p->normal) <= 0.0);
}

static uint32_t texel_of(const vshi_shadow_task *task, const vshi_open_point *p) {
    return task->points->texels != NULL ? task->points->texels[p->point] : (uint32_t)p->point;
}

/* Rays taken … target - 1 of an open point. */
static void cast(vshi_ray_batch *batch, size_t owner, int32_t target) {
    const vshi_shadow_task *task = batch->task;
    vshi_open_point *p = &batch->open[owner];
    const uint32_t texel = texel_of(task, p);
    double disc[64][2];
    while (p->taken < target) {
        const int32_t count = target - p->taken < 64 ? target - p->taken : 64;
        vshi_sampler_disc(task->sampler, texel, task->purpose, p->taken, count, disc);
        p->taken += count;
        batch->stats->rays += (uint64_t)count;
        for (int32_t i = 0; i < count; ++i) {
            vshi_vec d;
            double end;
            if (!direct(task, p, disc[i], &d, &end)) {
                continue;
            }
            if (batch->chunk.rays.count == VSHI_CHUNK || batch->traced_count == VSHI_CHUNK) {
                flush(batch);
            }
            if (p->traced) {
                const vshi_vec from = begin_of(task, p);
                batch->traced[batch->traced_count] = (vshi_segment_ray){
                    .origin = {from.x, from.y, from.z}, .direction = {d.x, d.y, d.z}, .far = end};
                batch->traced_owner[batch->traced_count++] = (uint16_t)owner;
                continue;
            }
            const vshi_cone ray = {
                .origin = p->origin, .direction = d, .end = end, .sine = 0.0, .close = 1.0};
            p->lit += !vshi_chunk_add(&batch->chunk, task->field, &ray, (uint32_t)owner, batch->stats);
        }
    }
}

/* Whether the rays of open points are traced in packets of several points each: discs, and the sampler's
 * blocks. */
static bool in_packets(const vshi_shadow_task *task) {
    return task->place.shape == NULL && task->options->sampler == VSH_SAMPLER_SOBOL &&
           !vshi_shadow_is_hard(task);
}

/* Rays first … last - 1 of open points that have `first`. */
static void cast_packets(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t first,
                         int32_t last) {
    const vshi_shadow_task *task = batch->task;
    vshi_disc discs[PACKET_POINTS];
    int32_t lit[PACKET_POINTS];
    for (size_t begin = 0; begin < count; begin += PACKET_POINTS) {
        const size_t points = count - begin < PACKET_POINTS ? count - begin : PACKET_POINTS;
        for (size_t i = 0; i < points; ++i) {
            const vshi_open_point *p = &batch->open[some[begin + i]];
            const vshi_vec from = begin_of(task, p);
            discs[i] = (vshi_disc){.origin = {from.x, from.y, from.z},
                                   .axis = p->axis,
                                   .u = p->u,
                                   .v = p->v,
                                   .normal = p->normal,
                                   .far = p->end};
            vshi_sampler_shift(task->sampler, texel_of(task, p), task->purpose, discs[i].shift);
            lit[i] = 0;
        }
        vshi_triangles_discs(traced_of(task), task->sampler, false, discs, points, first, last, lit);
        for (size_t i = 0; i < points; ++i) {
            vshi_open_point *p = &batch->open[some[begin + i]];
            p->lit += lit[i];
            p->taken = last;
        }
        batch->stats->rays += points * (uint64_t)(last - first);
    }
}

void vshi_open_point_begin(const vshi_shadow_task *task, size_t point, const vshi_cone *cone, vshi_vec normal,
                           vshi_open_point *p) {
    const double tangent = cone->sine / sqrt(1.0 - cone->sine * cone->sine);
    *p = (vshi_open_point){
        .point = point, .origin = cone->origin, .normal = normal, .axis = cone->direction, .end = cone->end};
    vshi_frame(cone->direction, &p->u, &p->v);
    p->u = vshi_scale(p->u, tangent);
    p->v = vshi_scale(p->v, tangent);
    p->traced = task->options->method == VSH_SHADOW_EXACT ||
                (task->options->method == VSH_SHADOW_ADAPTIVE && vshi_shade_traces(task->field, p->origin));
    if (task->options->method == VSH_SHADOW_EXACT) {
        turn_to_world(task, p);
    }
    if (p->traced) {
        const vshi_vec from = begin_of(task, p);
        p->near = vshi_triangles_sees(traced_of(task), (double[]){from.x, from.y, from.z});
    }
    if (task->place.shape != NULL) {
        look_at_shape(task, p);
    }
}

/* Of some open points the most rays that one has below `limit`; -1: none has. */
static int32_t most_below(const vshi_ray_batch *batch, const size_t *some, size_t count, int32_t limit) {
    int32_t most = -1;
    for (size_t i = 0; i < count; ++i) {
        const int32_t taken = batch->open[some[i]].taken;
        most = taken < limit && taken > most ? taken : most;
    }
    return most;
}

/* Rays up to `target` of those of some open points that have `taken`. */
static void cast_alike(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t taken,
                       int32_t target) {
    const bool packets = in_packets(batch->task) && vshi_sampler_is_blocks(taken, target);
    size_t alike[VSHI_PIECE], same = 0;
    for (size_t i = 0; i < count; ++i) {
        const vshi_open_point *p = &batch->open[some[i]];
        if (p->taken == taken && packets && p->traced && p->near) {
            alike[same++] = some[i];
        } else if (p->taken == taken) {
            cast(batch, some[i], target);
        }
    }
    cast_packets(batch, alike, same, taken, target);
}

void vshi_shadow_cast_all(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t target) {
    int32_t taken = target;
    while ((taken = most_below(batch, some, count, taken)) >= 0) {
        cast_alike(batch, some, count, taken, target);
    }
    flush(batch);
}

/* Twice as many rays as they have for some open points, up to `most`. */
void vshi_shadow_cast_double(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t most) {
    int32_t taken = most;
    while ((taken = most_below(batch, some, count, taken)) >= 0) {
        cast_alike(batch, some, count, taken, 2 * taken < most ? 2 * taken : most);
    }
    flush(batch);
}
