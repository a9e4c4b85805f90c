/* Shadow values from rays over the light's disc: all of them (rays), or as many as a cone leaves open
 * (adaptive, on the field; exact, on the triangles). */
#include "shade/shadow.h"
#include "shim/embree.h"

#include <math.h>

enum { FIRST_ROUND = 8 };

/* Rays on triangles begin this part of the casters' size off the surface: above the rounding of floats, below
 * what shows. */
static const double TRACE_LIFT = 0x1p-18;

/* Cones whose lowest side rises less than this over the receiver's plane are not proved: bumps of a tenth of
 * a voxel reach into them. */
static const double GRAZING = 0.1;

/* A proof takes the receiver's own plane for free while it is near. Where the field does not rise with the
 * height over it, as it does by this many voxels up to this much, there is more: a part thinner than a voxel
 * beside the receiver, or over it, which the samples along the cone cannot tell from the plane. Without this
 * test 10 of a million certified points of the cloister were wrong, all by something less than half a voxel
 * away. */
static const double ALONE_HEIGHT = 1.75, ALONE_SHORT = 0.1;

/* A point whose value takes rays. */
typedef struct open_point {
    size_t point;
    vshi_vec origin, normal; /* field space; no normal: zero */
    vshi_vec axis, u, v;     /* towards the light, and over its disc a unit away; exact: in world space */
    vshi_vec start;          /* exact: of its rays, world space */
    double end;
    int32_t lit, taken;
} open_point;

typedef struct ray_batch {
    const vshi_shadow_task *task;
    open_point *open;
    size_t open_count;
    vshi_chunk chunk;
    vshi_segment_ray traced[VSHI_CHUNK];
    bool blocked[VSHI_CHUNK];
    size_t traced_count;
    vsh_shade_stats *stats;
} ray_batch;

static void flush(ray_batch *batch) {
    const vshi_shadow_task *task = batch->task;
    vshi_march_stats work = {0, 0};
    task->march(task->field, &batch->chunk.rays, VSHI_MARCH_PLAIN, task->options->max_steps, &work);
    batch->stats->samples += work.samples;
    batch->stats->unfinished += work.unfinished;
    for (size_t r = 0; r < batch->chunk.rays.count; ++r) {
        batch->open[batch->chunk.owner[r]].lit += batch->chunk.rays.close[r] > 0.0f;
    }
    vshi_chunk_clear(&batch->chunk, false);
    if (batch->traced_count > 0) {
        vshi_triangles_blocked(task->options->triangles, batch->traced, batch->traced_count, batch->blocked);
        for (size_t r = 0; r < batch->traced_count; ++r) {
            batch->open[batch->chunk.owner[r]].lit += !batch->blocked[r];
        }
        batch->traced_count = 0;
    }
}

/* Points and directions back from field space. */
static vshi_vec to_world_direction(const vsh_field *field, vshi_vec d) {
    const double *m =
        field->to_field; /* a rotation over the voxel size: its inverse is its transpose times the square */
    return vshi_unit((vshi_vec){m[0] * d.x + m[4] * d.y + m[8] * d.z, m[1] * d.x + m[5] * d.y + m[9] * d.z,
                                m[2] * d.x + m[6] * d.y + m[10] * d.z});
}

/* Turns an open point to world space, off its surface by TRACE_LIFT. */
static void turn_to_world(const vshi_shadow_task *task, open_point *p) {
    const double tangent = vshi_length(p->u);
    const double *at = task->points->positions + 3 * p->point;
    double size = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = task->field->world_max[axis] - task->field->world_min[axis];
        size = side > size ? side : size;
    }
    const double lift = TRACE_LIFT * size + task->options->surface_offset;
    p->normal = to_world_direction(task->field, p->normal);
    p->axis = to_world_direction(task->field, p->axis);
    p->u = vshi_scale(to_world_direction(task->field, p->u), tangent);
    p->v = vshi_scale(to_world_direction(task->field, p->v), tangent);
    p->start = vshi_add(vshi_vec_of(at), vshi_scale(p->normal, lift));
    p->end *= task->field->voxel_size;
}

/* Rays taken … target - 1 of an open point. */
static void cast(ray_batch *batch, size_t owner, int32_t target) {
    const vshi_shadow_task *task = batch->task;
    open_point *p = &batch->open[owner];
    const uint32_t texel = task->points->texels != NULL ? task->points->texels[p->point] : (uint32_t)p->point;
    double disc[64][2];
    while (p->taken < target) {
        const int32_t count = target - p->taken < 64 ? target - p->taken : 64;
        vshi_sampler_disc(task->sampler, texel, task->purpose, p->taken, count, disc);
        p->taken += count;
        batch->stats->rays += (uint64_t)count;
        for (int32_t i = 0; i < count; ++i) {
            const vshi_vec d = vshi_unit(
                vshi_add(p->axis, vshi_add(vshi_scale(p->u, disc[i][0]), vshi_scale(p->v, disc[i][1]))));
            if (task->points->normals != NULL && vshi_dot(d, p->normal) <= 0.0) {
                continue;
            }
            if (batch->chunk.rays.count == VSHI_CHUNK || batch->traced_count == VSHI_CHUNK) {
                flush(batch);
            }
            if (task->options->method == VSH_SHADOW_EXACT) {
                batch->traced[batch->traced_count] =
                    (vshi_segment_ray){.origin = {p->start.x, p->start.y, p->start.z},
                                       .direction = {d.x, d.y, d.z},
                                       .far = p->end};
                batch->chunk.owner[batch->traced_count++] = (uint32_t)owner;
                continue;
            }
            const vshi_cone ray = {
                .origin = p->origin, .direction = d, .end = p->end, .sine = 0.0, .close = 1.0};
            p->lit += !vshi_chunk_add(&batch->chunk, task->field, &ray, (uint32_t)owner, batch->stats);
        }
    }
}

double vshi_rays_deviation(int32_t sampler, int32_t lit, int32_t taken) {
    /* the share is smoothed (Jeffreys' prior), so that a few rays that agree prove nothing */
    const double n = taken, p = (lit + 0.5) / (n + 1.0);
    const double root = sqrt(n);
    const double white = 1.0 / root, low = 1.0 / (root * sqrt(root));
    const double spread = sampler == VSH_SAMPLER_WHITE ? white
                          : sampler == VSH_SAMPLER_BLUE
                              ? (1.6 * low > 0.56 * white ? 1.6 * low : 0.56 * white)
                              : 1.04 * low;
    return spread * sqrt(p * (1.0 - p));
}

/* Casts rays for the open points, all up to `first`, then twice as many in each round for those that are not
 * settled. */
static void cast_rounds(ray_batch *batch) {
    const vsh_shade_options *options = batch->task->options;
    const bool refining = options->method != VSH_SHADOW_RAYS;
    const bool hard = batch->task->sine <= 0.0 && batch->task->radius <= 0.0; /* all rays are the same */
    const int32_t most = hard ? 1 : options->rays;
    int32_t target = refining ? FIRST_ROUND : options->early_rays > 0 ? options->early_rays : most;
    size_t unsettled = batch->open_count;
    for (size_t o = 0; options->method == VSH_SHADOW_EXACT && o < unsettled; ++o) {
        turn_to_world(batch->task, &batch->open[o]);
    }
    while (unsettled > 0) {
        target = target < most ? target : most;
        for (size_t o = 0; o < unsettled; ++o) {
            cast(batch, o, target);
        }
        flush(batch);
        size_t left = 0;
        for (size_t o = 0; o < unsettled && target < most; ++o) {
            const open_point p = batch->open[o];
            const bool settled =
                refining ? vshi_rays_deviation(options->sampler, p.lit, p.taken) <= options->max_error
                         : p.lit == 0 || p.lit == p.taken;
            if (!settled) { /* to the front, so that the others stay behind */
                batch->open[o] = batch->open[left];
                batch->open[left++] = p;
            }
        }
        unsettled = left;
        target = refining ? 2 * target : most;
    }
    for (size_t o = 0; o < batch->open_count; ++o) {
        const open_point *p = &batch->open[o];
        const double deviation = hard ? 0.0 : vshi_rays_deviation(options->sampler, p->lit, p->taken);
        batch->task->visibility[p->point] = (float)p->lit / (float)p->taken;
        if (batch->task->deviation != NULL) {
            batch->task->deviation[p->point] = (float)deviation;
        }
        batch->stats->square_error += deviation * deviation;
    }
    batch->stats->refined += batch->open_count;
}

static void settle(const vshi_shadow_task *task, size_t point, float value, float deviation) {
    task->visibility[point] = value;
    if (task->deviation != NULL) {
        task->deviation[point] = deviation;
    }
}

/* Proves cones free or full, and leaves the others open. */
static void prove(ray_batch *batch) {
    const vshi_shadow_task *task = batch->task;
    vshi_march_stats work = {0, 0};
    task->march(task->field, &batch->chunk.rays, VSHI_MARCH_PROOF, task->options->max_steps, &work);
    batch->stats->samples += work.samples;
    for (size_t r = 0; r < batch->chunk.rays.count; ++r) {
        open_point *p = &batch->open[batch->chunk.owner[r]];
        if (batch->chunk.rays.proof[r] != VSHI_UNPROVED) {
            settle(task, p->point, batch->chunk.rays.proof[r] == VSHI_PROVED_FREE ? 1.0f : 0.0f, 0.0f);
            p->taken = -1;
            ++batch->stats->certified;
        }
    }
    size_t left = 0;
    for (size_t o = 0; o < batch->open_count; ++o) {
        if (batch->open[o].taken == 0) {
            batch->open[left++] = batch->open[o];
        }
    }
    batch->open_count = left;
}

static double distance_at(const vsh_field *field, vshi_vec p) {
    const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
    return (double)vshi_field_distance(field, at);
}

/* Whether the receiver's own surface is all that there is around it. */
static bool alone(const vsh_field *field, vshi_vec origin, vshi_vec normal, vsh_shade_stats *stats) {
    stats->samples += 2;
    return distance_at(field, vshi_add(origin, vshi_scale(normal, ALONE_HEIGHT))) >=
           distance_at(field, origin) + ALONE_HEIGHT - ALONE_SHORT;
}

void vshi_shadow_by_rays(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_shadow_task *task = user;
    const bool proving = task->options->method != VSH_SHADOW_RAYS;
    open_point open[VSHI_RAY_GRAIN];
    ray_batch batch = {.task = task, .open = open, .stats = stats};
    vshi_chunk_clear(&batch.chunk, proving);
    for (size_t i = begin; i < end; ++i) {
        vshi_cone cone;
        vshi_vec origin, normal;
        if (!vshi_shade_origin(task->field, task->points, i, task->options->start_offset,
                               task->options->surface_offset, &origin, &normal)) {
            settle(task, i, NAN, NAN);
            ++stats->invalid;
            continue;
        }
        if (!vshi_shadow_aim(task, i, origin, &cone)) {
            settle(task, i, 1.0f, 0.0f);
            continue;
        }
        const bool oriented = task->points->normals != NULL;
        cone.horizon = oriented ? vshi_dot(normal, cone.direction) : INFINITY;
        if (cone.horizon <= -cone.sine) {
            settle(task, i, 0.0f, 0.0f);
            ++stats->skipped;
            continue;
        }
        const double tangent = cone.sine / sqrt(1.0 - cone.sine * cone.sine);
        open_point *p = &open[batch.open_count];
        *p = (open_point){
            .point = i, .origin = origin, .normal = normal, .axis = cone.direction, .end = cone.end};
        vshi_frame(cone.direction, &p->u, &p->v);
        p->u = vshi_scale(p->u, tangent);
        p->v = vshi_scale(p->v, tangent);
        /* nothing to prove where the receiver's own plane hides a part of the light, or nearly does; and
         * without a plane nothing near is taken for free */
        const bool clear = cone.horizon >= cone.sine + GRAZING;
        if (proving && clear && oriented && !alone(task->field, origin, normal, stats)) {
            cone.horizon = INFINITY;
        }
        if (proving && clear &&
            !vshi_chunk_add(&batch.chunk, task->field, &cone, (uint32_t)batch.open_count, stats)) {
            settle(task, i, 1.0f, 0.0f);
            ++stats->certified;
            continue;
        }
        ++batch.open_count;
    }
    if (proving) {
        prove(&batch);
        vshi_chunk_clear(&batch.chunk, false);
    }
    cast_rounds(&batch);
}
