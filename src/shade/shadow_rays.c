/* Shadow values from rays over the light's disc: a fixed number (rays), or as many as a cone leaves open
 * (adaptive, on the field; exact, on the triangles). */
#include "shade/shadow.h"
#include "trace/trace.h"

#include <math.h>
#include <string.h>

enum { PACKET_POINTS = 64 };

/* --- points with rays, and their rays, which are marched, or traced against triangles or the field's
 * surface, alone or in packets of several points */

/* A point whose value needs rays. */
typedef struct open_point {
    size_t point;
    vshi_vec origin, normal; /* field space; no normal: zero */
    vshi_vec axis, u, v;  /* towards the light, and over its disc at a distance of 1; exact: in world space */
    vshi_vec start;       /* exact: of its rays, world space */
    vshi_light_view view; /* of a rectangle, from the point itself */
    vshi_vec off;         /* from that point to where its rays begin, in the rays' space */
    double end;
    bool traced; /* its rays meet triangles or the field's surface; else they are marched */
    int32_t lit, taken;
    bool near; /* traced: near enough to the triangles for packets */
    double deviation;
} open_point;

typedef struct ray_batch {
    const vshi_shadow_task *task;
    size_t open_count;
    open_point open[VSHI_PIECE];
    vshi_chunk chunk;
    vshi_segment_ray traced[VSHI_CHUNK];
    bool blocked[VSHI_CHUNK];
    uint16_t traced_owner[VSHI_CHUNK];
    size_t traced_count;
    bool shared; /* points share their rays */
    vsh_shade_stats *stats;
} ray_batch;

/* Whether all rays of a point are the same. */
static bool is_hard(const vshi_shadow_task *task) {
    return vshi_light_is_point(&task->place);
}

/* Height of the origins of rays on triangles, as a share of the casters' size: above the rounding of floats,
 * below what is visible. */
static const double TRACE_OFFSET = 0x1p-18;

/* The triangles that rays meet: the casters' in world space, or the field's surface in its own. */
static const vshi_triangles *traced_of(const vshi_shadow_task *task) {
    return task->options.method == VSH_SHADOW_EXACT ? task->triangles : task->field->surface;
}

/* The origin of a point's traced rays, in the space of these triangles. */
static vshi_vec begin_of(const vshi_shadow_task *task, const open_point *p) {
    return task->options.method == VSH_SHADOW_EXACT ? p->start : p->origin;
}

static void flush(ray_batch *batch) {
    const vshi_shadow_task *task = batch->task;
    vshi_chunk_march(&batch->chunk, task->kernel, task->field, VSHI_MARCH_PLAIN, task->options.max_steps,
                     batch->stats);
    for (size_t r = 0; r < batch->chunk.count; ++r) {
        batch->open[batch->chunk.owner[r]].lit += batch->chunk.close[r] > 0.0f;
    }
    batch->chunk.count = 0;
    if (batch->traced_count > 0) {
        vshi_triangles_blocked(traced_of(task), batch->traced, batch->traced_count, batch->blocked);
        for (size_t r = 0; r < batch->traced_count; ++r) {
            batch->open[batch->traced_owner[r]].lit += !batch->blocked[r];
        }
        batch->traced_count = 0;
    }
}

/* Turns an open point to world space, off its surface by TRACE_OFFSET. */
static void turn_to_world(const vshi_shadow_task *task, open_point *p) {
    const double tangent = vshi_length(p->u);
    const double *at = task->points->positions + 3 * p->point;
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = task->field->world_max[axis] - task->field->world_min[axis];
        size = side > size ? side : size;
    }
    const double offset = TRACE_OFFSET * size + task->options.surface_offset;
    p->normal = vshi_direction_to_world(task->field, p->normal);
    p->axis = vshi_direction_to_world(task->field, p->axis);
    p->u = vshi_scale(vshi_direction_to_world(task->field, p->u), tangent);
    p->v = vshi_scale(vshi_direction_to_world(task->field, p->v), tangent);
    p->start = vshi_add(vshi_vec_of(at), vshi_scale(p->normal, offset));
    vshi_light_view view;
    p->end = vshi_light_look(&task->world, p->start, false, &view) == VSHI_LIGHT_SEEN ? view.end : 0.0;
}

/* Finds the direction of the ray to a place on the unit disc, and its length. False below the horizon. */
static bool direct(const vshi_shadow_task *task, const open_point *p, const double disc[2], vshi_vec *d,
                   double *end) {
    const bool horizon = task->points->normals != NULL;
    *end = p->end;
    if (task->place.shape == NULL) {
        *d = vshi_unit(vshi_add(p->axis, vshi_add(vshi_scale(p->u, disc[0]), vshi_scale(p->v, disc[1]))));
        return !(horizon && vshi_dot(*d, p->normal) <= 0.0);
    }
    const bool traced = task->options.method == VSH_SHADOW_EXACT;
    const vshi_vec way = task->place.shape->ray(traced ? &task->world : &task->place, &p->view, disc);
    const vshi_vec to = vshi_sub(way, p->off);
    const double length = vshi_length(to), ahead = vshi_dot(to, p->axis);
    *d = vshi_unit(to);
    /* a proof ends the cone early, by depth along its axis */
    *end = !traced && ahead > p->end ? length * p->end / ahead : length;
    return !(horizon && vshi_dot(way, p->normal) <= 0.0);
}

static uint32_t texel_of(const vshi_shadow_task *task, const open_point *p) {
    return task->points->texels != NULL ? task->points->texels[p->point] : (uint32_t)p->point;
}

/* Casts rays taken … target - 1 of an open point. */
static void cast(ray_batch *batch, size_t owner, int32_t target) {
    const vshi_shadow_task *task = batch->task;
    open_point *p = &batch->open[owner];
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
            if (batch->chunk.count == VSHI_CHUNK || batch->traced_count == VSHI_CHUNK) {
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

/* Casts rays first … last - 1 of open points that have `first`. */
static void cast_packets(ray_batch *batch, const size_t *some, size_t count, int32_t first, int32_t last) {
    const vshi_shadow_task *task = batch->task;
    vshi_disc discs[PACKET_POINTS];
    int32_t lit[PACKET_POINTS];
    for (size_t begin = 0; begin < count; begin += PACKET_POINTS) {
        const size_t points = count - begin < PACKET_POINTS ? count - begin : PACKET_POINTS;
        for (size_t i = 0; i < points; ++i) {
            const open_point *p = &batch->open[some[begin + i]];
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
            open_point *p = &batch->open[some[begin + i]];
            p->lit += lit[i];
            p->taken = last;
        }
        batch->stats->rays += points * (uint64_t)(last - first);
    }
}

/* Sets *p to point `point`, whose cone is not proved. `normal` is zero without normals. */
static void begin_open_point(const vshi_shadow_task *task, size_t point, const vshi_cone *cone,
                             vshi_vec normal, open_point *p) {
    const double tangent = cone->sine / sqrt(1.0 - cone->sine * cone->sine);
    *p = (open_point){
        .point = point, .origin = cone->origin, .normal = normal, .axis = cone->direction, .end = cone->end};
    vshi_frame(cone->direction, &p->u, &p->v);
    p->u = vshi_scale(p->u, tangent);
    p->v = vshi_scale(p->v, tangent);
    p->traced = task->options.method == VSH_SHADOW_EXACT ||
                (task->options.method == VSH_SHADOW_ADAPTIVE && vshi_shade_traces(task->field, p->origin));
    if (task->options.method == VSH_SHADOW_EXACT) {
        turn_to_world(task, p);
    }
    if (p->traced) {
        const vshi_vec from = begin_of(task, p);
        p->near = vshi_triangles_sees(traced_of(task), (double[]){from.x, from.y, from.z});
    }
    if (task->place.shape != NULL) {
        const bool exact = task->options.method == VSH_SHADOW_EXACT;
        const double *at = task->points->positions + 3 * p->point;
        const vshi_vec from = exact ? vshi_vec_of(at) : vshi_to_field(task->field, at);
        vshi_light_look(exact ? &task->world : &task->place, from, false, &p->view);
        p->off = vshi_sub(exact ? p->start : p->origin, from);
    }
}

/* Casts rays up to `target` for the open points that have `taken`: in packets of several points if the light
 * is a disc, and the rays are whole blocks of Sobol's sequence. */
static void cast_alike(ray_batch *batch, const size_t *some, size_t count, int32_t taken, int32_t target) {
    const vshi_shadow_task *task = batch->task;
    const bool packets = task->place.shape == NULL && task->options.sampler == VSH_SAMPLER_SOBOL &&
                         !is_hard(task) && vshi_sampler_is_blocks(taken, target);
    size_t alike[VSHI_PIECE], same = 0;
    for (size_t i = 0; i < count; ++i) {
        const open_point *p = &batch->open[some[i]];
        if (p->taken == taken && packets && p->traced && p->near) {
            alike[same++] = some[i];
        } else if (p->taken == taken) {
            cast(batch, some[i], target);
        }
    }
    cast_packets(batch, alike, same, taken, target);
}

/* Casts rays for the listed open points until each has `most`, or, if `doubling`, twice its rays, at most
 * `most`. Points with the most rays come first. */
static void cast_all(ray_batch *batch, const size_t *some, size_t count, int32_t most, bool doubling) {
    for (int32_t limit = most, taken; limit >= 0; limit = taken) {
        taken = -1;
        for (size_t i = 0; i < count; ++i) {
            const int32_t own = batch->open[some[i]].taken;
            taken = own < limit && own > taken ? own : taken;
        }
        if (taken >= 0) {
            cast_alike(batch, some, count, taken, doubling && 2 * taken < most ? 2 * taken : most);
        }
    }
    flush(batch);
}

/* --- the number of rays of each point */

enum { FIRST_ROUND = 8 };

/* Neighbours whose rays predict a point's share: this many before and after it, at most APART voxels away. */
enum { AROUND = 4 };
static const double APART = 4.0;

/* Cones whose lowest side rises less than this above the receiver's plane are not proved: bumps of a tenth of
 * a voxel reach into them. */
static const double GRAZING = 0.1;

/* A longer march, voxels, costs more than the rays on triangles that it saves. */
static const double NEAR = 24.0;

/* Sums of the rays around an open point. */
typedef struct around {
    double lit, taken;
} around;

static around sum_around(const ray_batch *batch, size_t owner) {
    const open_point *open = batch->open, *p = &open[owner];
    const size_t first = owner > AROUND ? owner - AROUND : 0;
    const size_t last = owner + AROUND < batch->open_count ? owner + AROUND : batch->open_count - 1;
    around a = {0.0, 0.0};
    for (size_t o = first; o <= last; ++o) {
        const vshi_vec off = vshi_sub(open[o].origin, p->origin);
        if (o != owner && vshi_dot(off, off) < APART * APART) {
            a.lit += open[o].lit;
            a.taken += open[o].taken;
        }
    }
    return a;
}

/* The deviation of an open point. Its expected share is that of the rays around (smoothed by Laplace's rule
 * of succession), or a half without neighbours. */
static double deviation_of(const ray_batch *batch, size_t owner) {
    const open_point *p = &batch->open[owner];
    const around a = sum_around(batch, owner);
    const double deviation =
        vshi_rays_deviation(batch->task->options.sampler, p->lit, p->taken, (a.lit + 1.0) / (a.taken + 2.0));
    return a.taken > 0.0 ? VSHI_BORROWED * deviation : deviation;
}

/* The error of an open point as reported, and as kept for errors below VSHI_COARSE. deviation_of() leaves
 * more than such an error unseen at the ends of penumbrae. */
static double error_of(const ray_batch *batch, size_t owner) {
    const open_point *p = &batch->open[owner];
    const around a = sum_around(batch, owner);
    return vshi_rays_error(batch->task->options.sampler, p->lit, p->taken, a.lit, a.taken);
}

/* Casts rays for some open points. Each round doubles the rays of points whose error is too large by then, as
 * the rays of one point inform its neighbours. */
static void cast_fine(ray_batch *batch, const size_t *some, size_t count, int32_t most) {
    const vsh_shade_options *options = &batch->task->options;
    size_t unsettled[VSHI_PIECE], left = count;
    cast_all(batch, some, count, FIRST_ROUND < most ? FIRST_ROUND : most, false);
    while (left > 0) {
        left = 0;
        for (size_t i = 0; i < count; ++i) {
            const int32_t taken = batch->open[some[i]].taken;
            if (taken < most && error_of(batch, some[i]) > options->max_error) {
                unsettled[left++] = some[i];
            }
        }
        cast_all(batch, unsettled, left, most, true);
    }
}

/* Casts rays for some open points up to the first target, then doubles the rays of unsettled points in each
 * round. */
static void cast_rounds(ray_batch *batch, const size_t *some, size_t count) {
    const vsh_shade_options *options = &batch->task->options;
    const bool refining = options->method != VSH_SHADOW_RAYS;
    const bool hard = is_hard(batch->task);
    const int32_t most = hard ? 1 : vshi_shadow_most_rays(options);
    int32_t target = refining ? FIRST_ROUND : options->early_rays > 0 ? options->early_rays : most;
    size_t unsettled[VSHI_PIECE];
    if (refining && !hard && options->max_error < VSHI_COARSE) {
        cast_fine(batch, some, count, most);
        return;
    }
    memcpy(unsettled, some, count * sizeof *some);
    while (count > 0) {
        target = target < most ? target : most;
        cast_all(batch, unsettled, count, target, false);
        size_t left = 0;
        for (size_t i = 0; i < count; ++i) {
            const size_t o = unsettled[i];
            open_point *p = &batch->open[o];
            p->deviation = hard ? 0.0 : deviation_of(batch, o);
            const bool settled =
                refining ? p->deviation <= options->max_error : p->lit == 0 || p->lit == p->taken;
            if (!settled && target < most) {
                unsettled[left++] = o;
            }
        }
        count = left;
        target = refining ? 2 * target : most;
    }
}

static void settle(ray_batch *batch, size_t point, float value, float deviation) {
    const double error = (double)deviation;
    vshi_shadow_settle(batch->task, point, value, deviation);
    batch->stats->square_error += error * error;
    batch->stats->worst_error = error > batch->stats->worst_error ? error : batch->stats->worst_error;
}

/* The reported error of a point with rays. Down to VSHI_COARSE rays end by deviation_of(), which is too
 * confident at the ends of penumbrae. So the larger of the two estimates, at most the error asked for, is
 * reported where all rays agree, for anchors, and for samplers other than Sobol's. */
static double said_of(const ray_batch *batch, size_t owner) {
    const vsh_shade_options *options = &batch->task->options;
    const open_point *p = &batch->open[owner];
    if (options->method == VSH_SHADOW_RAYS || is_hard(batch->task)) {
        return p->deviation;
    }
    if (options->max_error < VSHI_COARSE) {
        return error_of(batch, owner);
    }
    const bool agree = p->lit == 0 || p->lit == p->taken;
    return agree || batch->shared || options->sampler != VSH_SAMPLER_SOBOL
               ? fmax(p->deviation, fmin(error_of(batch, owner), options->max_error))
               : p->deviation;
}

static void settle_cast(ray_batch *batch, const size_t *some, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        open_point *p = &batch->open[some[i]];
        p->deviation = said_of(batch, some[i]);
        settle(batch, p->point, (float)p->lit / (float)p->taken, (float)p->deviation);
    }
}

/* Casts rays for the anchors among the open points in `some`, interpolates others from them, and leaves the
 * rest in `some`. Returns their number. */
static size_t cast_shared(ray_batch *batch, size_t begin, size_t end, size_t *some) {
    const vshi_shadow_task *task = batch->task;
    vshi_interpolation interp = {.points = task->points,
                                 .begin = begin,
                                 .count = end - begin,
                                 .max_error = task->options.max_error,
                                 .sampler = task->options.sampler,
                                 .rays = vshi_interpolation_rays(task->options.max_error)};
    for (size_t k = 0; k < interp.count; ++k) {
        interp.value[k] = task->visibility[begin + k];
        interp.deviation[k] = 0.0f;
        interp.state[k] = (uint8_t)(isnan(interp.value[k]) || !vshi_shadow_reaches(task, begin + k)
                                        ? VSHI_INTERPOLATION_GONE
                                        : VSHI_INTERPOLATION_KNOWN);
    }
    cast_all(batch, some, batch->open_count, interp.rays, false);
    for (size_t o = 0; o < batch->open_count; ++o) {
        const size_t k = batch->open[o].point - begin;
        interp.state[k] = VSHI_INTERPOLATION_OPEN;
        interp.lit[k] = (uint16_t)batch->open[o].lit;
    }
    bool anchor[VSHI_PIECE] = {false};
    vshi_interpolation_begin(&interp);
    for (int level = 0; level < VSHI_INTERPOLATION_LEVELS; ++level) {
        size_t wanted = 0;
        if (vshi_interpolation_pick(&interp, level)) {
            for (size_t o = 0; o < batch->open_count; ++o) {
                if (interp.state[batch->open[o].point - begin] == VSHI_INTERPOLATION_WANTED) {
                    some[wanted++] = o;
                }
            }
        }
        cast_rounds(batch, some, wanted);
        settle_cast(batch, some, wanted);
        for (size_t i = 0; i < wanted; ++i) {
            const open_point *p = &batch->open[some[i]];
            const size_t k = p->point - begin;
            anchor[some[i]] = true;
            interp.state[k] = VSHI_INTERPOLATION_KNOWN;
            interp.value[k] = task->visibility[p->point];
            interp.deviation[k] = (float)p->deviation;
        }
        vshi_interpolation_fill(&interp, level);
    }
    size_t left = 0;
    for (size_t o = 0; o < batch->open_count; ++o) {
        const size_t point = batch->open[o].point, k = point - begin;
        if (interp.state[k] == VSHI_INTERPOLATION_OPEN) {
            some[left++] = o;
        } else if (!anchor[o]) {
            settle(batch, point, interp.value[k], interp.deviation[k]);
        }
    }
    return left;
}

/* Proves cones free or full, and settles their points. */
static void prove(ray_batch *batch, vshi_facing *facing) {
    const vshi_shadow_task *task = batch->task;
    for (size_t i = 0; i < facing->count; ++i) {
        vshi_cone *cone = &facing->cone[i];
        /* The march treats the receiver's own plane as free only inside the ball above it. A part thinner
         * than a voxel beside or above the receiver looks like the plane along the cone. Without this 10 of a
         * million proofs on the cloister were wrong, all by something less than half a voxel away. */
        const double horizon = cone->horizon;
        if (cone->begin <= 0.0) {
            cone->horizon = INFINITY;
        }
        /* A proof is hopeless if the receiver's own plane hides a part of the light, or nearly does. If no
         * block around the point was proved, a few rays on triangles cost less than a long march. */
        const bool promising =
            isfinite(cone->sine) && (task->options.method != VSH_SHADOW_EXACT || !facing->gathered[i] ||
                                     cone->end < cone->begin + NEAR);
        if (promising && horizon >= cone->sine + GRAZING &&
            !vshi_chunk_add(&batch->chunk, task->field, cone, (uint32_t)i, batch->stats)) {
            vshi_shadow_settle(task, facing->point[i], 1.0f, 0.0f);
            facing->settled[i] = true;
            ++batch->stats->certified;
        }
    }
    vshi_chunk_march(&batch->chunk, task->kernel, task->field, VSHI_MARCH_PROOF, task->options.max_steps,
                     batch->stats);
    for (size_t r = 0; r < batch->chunk.count; ++r) {
        const size_t i = batch->chunk.owner[r];
        const uint8_t proof = (uint8_t)batch->chunk.proof[r];
        /* a solid in the cone may stand behind a part of the rectangle */
        const bool is_full = proof == VSHI_PROVED_FULL && !task->leaky && task->place.shape == NULL;
        if (proof == VSHI_PROVED_FREE || is_full) {
            vshi_shadow_settle(task, facing->point[i], proof == VSHI_PROVED_FREE ? 1.0f : 0.0f, 0.0f);
            facing->settled[i] = true;
            ++batch->stats->certified;
        }
    }
    batch->chunk.count = 0;
}

void vshi_shadow_by_rays(const vshi_shadow_task *task, size_t begin, size_t end, vsh_shade_stats *stats) {
    vshi_facing facing;
    ray_batch batch;
    batch.task = task;
    batch.open_count = batch.traced_count = 0;
    batch.stats = stats;
    vshi_shadow_gather(task, begin, end, &facing, &batch.chunk, stats);
    if (task->options.method != VSH_SHADOW_RAYS) {
        prove(&batch, &facing);
    }
    for (size_t i = 0; i < facing.count; ++i) {
        if (facing.settled[i]) {
            continue;
        }
        begin_open_point(task, facing.point[i], &facing.cone[i], facing.normal[i],
                         &batch.open[batch.open_count++]);
    }
    size_t some[VSHI_PIECE], count = batch.open_count;
    for (size_t o = 0; o < count; ++o) {
        some[o] = o;
    }
    batch.shared = task->options.method != VSH_SHADOW_RAYS &&
                   vshi_shadow_most_rays(&task->options) > vshi_interpolation_rays(task->options.max_error) &&
                   !is_hard(task) && !task->scattered && task->points->texels != NULL &&
                   task->points->normals != NULL;
    if (batch.shared) {
        count = cast_shared(&batch, begin, end, some);
    }
    cast_rounds(&batch, some, count);
    settle_cast(&batch, some, count);
    stats->refined += batch.open_count;
}
