/* Shadow values from rays over the light's disc: all of them (rays), or as many as a cone leaves open
 * (adaptive, on the field; exact, on the triangles). */
#include "shade/interpolation.h"
#include "shade/shadow_cast.h"

#include <math.h>
#include <string.h>

enum { FIRST_ROUND = 8 };

/* The points whose rays tell what to expect of a point's: so many before and after it, no farther than this,
 * voxels. */
enum { AROUND = 4 };
static const double APART = 4.0;

/* Cones whose lowest side rises less than this over the receiver's plane are not proved: bumps of a tenth of
 * a voxel reach into them. */
static const double GRAZING = 0.1;

/* How far a march may go that saves rays on triangles, voxels. */
static const double NEAR = 24.0;

/* What the rays of the points around an open point say of it: how many are lit, of how many. */
typedef struct around {
    double lit, taken;
} around;

static around look_around(const vshi_ray_batch *batch, size_t owner) {
    const vshi_open_point *open = batch->open, *p = &open[owner];
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

/* The deviation of an open point, its share expected to be that of the rays of the points around it (smoothed
 * by Laplace's rule of succession), or a half where none is near. */
static double deviation_of(const vshi_ray_batch *batch, size_t owner) {
    const vshi_open_point *p = &batch->open[owner];
    const around a = look_around(batch, owner);
    const double deviation =
        vshi_rays_deviation(batch->task->options->sampler, p->lit, p->taken, (a.lit + 1.0) / (a.taken + 2.0));
    return a.taken > 0.0 ? VSHI_BORROWED * deviation : deviation;
}

/* The same, as it is said, and as errors below VSHI_COARSE are kept: the other leaves more unseen at the ends
 * of penumbrae than such an error. */
static double error_of(const vshi_ray_batch *batch, size_t owner) {
    const vshi_open_point *p = &batch->open[owner];
    const around a = look_around(batch, owner);
    return vshi_rays_error(batch->task->options->sampler, p->lit, p->taken, a.lit, a.taken);
}

/* Casts rays for some open points, twice as many in each round for those that are not known well enough, by
 * then: what is found of one tells of those around it. */
static void cast_fine(vshi_ray_batch *batch, const size_t *some, size_t count, int32_t most) {
    const vsh_shade_options *options = batch->task->options;
    size_t unsettled[VSHI_PIECE], left = count;
    vshi_shadow_cast_all(batch, some, count, FIRST_ROUND < most ? FIRST_ROUND : most);
    while (left > 0) {
        left = 0;
        for (size_t i = 0; i < count; ++i) {
            const int32_t taken = batch->open[some[i]].taken;
            if (taken < most && error_of(batch, some[i]) > options->max_error) {
                unsettled[left++] = some[i];
            }
        }
        vshi_shadow_cast_double(batch, unsettled, left, most);
    }
}

/* Casts rays for some open points, all up to the first target, then twice as many in each round for those
 * that are not settled. */
static void cast_rounds(vshi_ray_batch *batch, const size_t *some, size_t count) {
    const vsh_shade_options *options = batch->task->options;
    const bool refining = options->method != VSH_SHADOW_RAYS;
    const bool hard = vshi_shadow_is_hard(batch->task);
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
        vshi_shadow_cast_all(batch, unsettled, count, target);
        size_t left = 0;
        for (size_t i = 0; i < count; ++i) {
            const size_t o = unsettled[i];
            vshi_open_point *p = &batch->open[o];
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

static void settle(vshi_ray_batch *batch, size_t point, float value, float deviation) {
    vshi_shadow_settle(batch->task, point, value, deviation);
    vshi_stats_add_error(batch->stats, (double)deviation);
}

/* What is said of a point whose rays were cast. Down to VSHI_COARSE rays end by deviation_of(), which knows
 * the ends of penumbrae too well: where all rays agree, of points that others may be interpolated from and of
 * samplers that leave more, the larger of the two is said, of the latter at most what was asked for. */
static double said_of(const vshi_ray_batch *batch, size_t owner) {
    const vsh_shade_options *options = batch->task->options;
    const vshi_open_point *p = &batch->open[owner];
    if (options->method == VSH_SHADOW_RAYS || vshi_shadow_is_hard(batch->task)) {
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

static void settle_cast(vshi_ray_batch *batch, const size_t *some, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        vshi_open_point *p = &batch->open[some[i]];
        p->deviation = said_of(batch, some[i]);
        settle(batch, p->point, (float)p->lit / (float)p->taken, (float)p->deviation);
    }
}

/* Casts rays for those of the open points, which `some` lists, that the others can be interpolated from,
 * interpolates these, and leaves the rest in `some`. Returns their number. */
static size_t cast_shared(vshi_ray_batch *batch, size_t begin, size_t end, size_t *some) {
    const vshi_shadow_task *task = batch->task;
    vshi_interpolation interp = {.points = task->points,
                                 .begin = begin,
                                 .count = end - begin,
                                 .max_error = task->options->max_error,
                                 .sampler = task->options->sampler,
                                 .rays = vshi_interpolation_rays(task->options->max_error)};
    for (size_t k = 0; k < interp.count; ++k) {
        interp.value[k] = task->visibility[begin + k];
        interp.deviation[k] = 0.0f;
        interp.state[k] =
            (uint8_t)(isnan(interp.value[k]) ? VSHI_INTERPOLATION_GONE : VSHI_INTERPOLATION_KNOWN);
    }
    vshi_shadow_cast_all(batch, some, batch->open_count, interp.rays);
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
            const vshi_open_point *p = &batch->open[some[i]];
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

/* Proves cones free or full, and drops those points. */
static void prove(vshi_ray_batch *batch, vshi_facing *facing) {
    const vshi_shadow_task *task = batch->task;
    for (size_t i = 0; i < facing->count; ++i) {
        vshi_cone *cone = &facing->cone[i];
        /* the receiver's own plane is taken for free only where the ball above it is: a part thinner than a
         * voxel beside the receiver, or over it, looks like the plane along the cone. Without this 10 of a
         * million proofs on the cloister were wrong, all by something less than half a voxel away */
        const double horizon = cone->horizon;
        if (cone->begin <= 0.0) {
            cone->horizon = INFINITY;
        }
        /* nothing to prove where the receiver's own plane hides a part of the light, or nearly does; and
         * where no block around the point was, a few rays on triangles cost less than a long march */
        const bool promising =
            isfinite(cone->sine) && (task->options->method != VSH_SHADOW_EXACT || !facing->gathered[i] ||
                                     cone->end < cone->begin + NEAR);
        if (promising && horizon >= cone->sine + GRAZING &&
            !vshi_chunk_add(&batch->chunk, task->field, cone, (uint32_t)i, batch->stats)) {
            vshi_shadow_settle(task, facing->point[i], 1.0f, 0.0f);
            facing->settled[i] = true;
            ++batch->stats->certified;
        }
    }
    vshi_march_stats work = {0, 0};
    task->kernel->march(task->field, &batch->chunk.rays, VSHI_MARCH_PROOF, task->options->max_steps, &work);
    batch->stats->samples += work.samples;
    for (size_t r = 0; r < batch->chunk.rays.count; ++r) {
        const size_t i = batch->chunk.owner[r];
        const uint8_t proof = (uint8_t)batch->chunk.rays.proof[r];
        /* what fills the cone around a shape may stand behind a part of it */
        const bool is_full = proof == VSHI_PROVED_FULL && !task->leaky && task->place.shape == NULL;
        if (proof == VSHI_PROVED_FREE || is_full) {
            vshi_shadow_settle(task, facing->point[i], proof == VSHI_PROVED_FREE ? 1.0f : 0.0f, 0.0f);
            facing->settled[i] = true;
            ++batch->stats->certified;
        }
    }
    vshi_chunk_clear(&batch->chunk);
}

void vshi_shadow_by_rays(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_shadow_task *task = user;
    vshi_facing facing;
    vshi_open_point open[VSHI_PIECE];
    vshi_ray_batch batch;
    batch.task = task;
    batch.open = open;
    batch.open_count = batch.traced_count = 0;
    batch.stats = stats;
    vshi_shadow_gather(task, begin, end, &facing, &batch.chunk, stats);
    if (task->options->method != VSH_SHADOW_RAYS) {
        prove(&batch, &facing);
    }
    for (size_t i = 0; i < facing.count; ++i) {
        if (facing.settled[i]) {
            continue;
        }
        vshi_open_point_begin(task, facing.point[i], &facing.cone[i], facing.normal[i],
                              &open[batch.open_count++]);
    }
    size_t some[VSHI_PIECE], count = batch.open_count;
    for (size_t o = 0; o < count; ++o) {
        some[o] = o;
    }
    batch.shared = task->options->method != VSH_SHADOW_RAYS &&
                   vshi_shadow_most_rays(task->options) > vshi_interpolation_rays(task->options->max_error) &&
                   !vshi_shadow_is_hard(task) && !task->scattered && vshi_interpolation_can(task->points);
    if (batch.shared) {
        count = cast_shared(&batch, begin, end, some);
    }
    cast_rounds(&batch, some, count);
    settle_cast(&batch, some, count);
    stats->refined += batch.open_count;
}
