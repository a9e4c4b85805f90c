/* Proofs for blocks of points.
 *
 * The cones of all points of a ball of radius r towards one light lie in a beam: the cone of the same half
 * angle whose radius at the ball's centre is r, or for lamps the hull of the ball and the lamp. If free balls
 * cover the beam up to the light, they cover each cone. If a solid ball is as wide as the beam, it hides
 * every ray.
 *
 * Near its points, a beam contains the points' own surface. There each point uses the ball that touches
 * its tangent plane. This ball contains the rays of the point's cone up to where the beam is clear of the
 * surface. */
#include "shade/shadow.h"

#include <math.h>

enum { SIZES = 3, SMALLEST = 4 };
static const size_t SIZE[SIZES] = {64, 16, SMALLEST}; /* points of a block */

/* Wider beams, voxels, contain too much geometry for proofs. */
static const double WIDEST = 24.0;
/* For cones this short, voxels, smaller blocks are worth a try. */
static const double SHORT = 48.0;
/* Height of the centre of the ball above a point, voxels: as much as the finest level's band holds. The
 * radius is less by NEAR_LACK, and rays enter the ball by then. */
static const double NEAR_HEIGHT = 1.95, NEAR_LACK = 0.05;

/* See vshi_chunk.deeper: a march may pass the deepest place of its cone by a quarter of its radius before the
 * next sample. This sample may read up to 0.7 voxels of its level less deep. */
static const double DEEPER = 0.25, READ = 0.71;

/* --- the ball above each point */

/* Tests every point, whatever its neighbours prove: the samples of a march depend on where it begins.
 * `improved` depends most on its first samples, and begins at the surface. */
static void prove_near(const vshi_shadow_task *task, vshi_facing *facing, vsh_shade_stats *stats) {
    static const double LEAST_SINE = 0.1; /* of the cone's lowest ray over the plane */
    float centres[3][VSHI_PIECE];
    bool is_free[VSHI_PIECE];
    uint32_t owner[VSHI_PIECE];
    size_t count = 0;
    if (task->options.method == VSH_SHADOW_IMPROVED || task->field->unknown) {
        return;
    }
    for (size_t i = 0; i < facing->count; ++i) {
        const vshi_cone *cone = &facing->cone[i];
        if (cone->horizon > cone->sine + LEAST_SINE && cone->horizon <= 1.0) {
            centres[0][count] = (float)(cone->origin.x + NEAR_HEIGHT * facing->normal[i].x);
            centres[1][count] = (float)(cone->origin.y + NEAR_HEIGHT * facing->normal[i].y);
            centres[2][count] = (float)(cone->origin.z + NEAR_HEIGHT * facing->normal[i].z);
            owner[count++] = (uint32_t)i;
        }
    }
    float *const places[3] = {centres[0], centres[1], centres[2]};
    task->kernel->balls(task->field, count, places, (float)(NEAR_HEIGHT - NEAR_LACK), is_free);
    stats->samples += count;
    const double lack = NEAR_HEIGHT * NEAR_HEIGHT - (NEAR_HEIGHT - NEAR_LACK) * (NEAR_HEIGHT - NEAR_LACK);
    for (size_t b = 0; b < count; ++b) {
        if (is_free[b]) {
            vshi_cone *cone = &facing->cone[owner[b]];
            /* The lowest ray leaves the ball here, along the axis. Its sine is the axis's less at most the
             * cone's. */
            const double rise = NEAR_HEIGHT * (cone->horizon - cone->sine);
            const double square = rise * rise - lack, cosine = sqrt(1.0 - cone->sine * cone->sine);
            cone->begin = square > 0.0 ? cosine * (rise + sqrt(square)) : 0.0;
        }
    }
}

/* --- beams */

typedef struct block {
    size_t first, count;
    vshi_cone beam;
    double distance; /* to a lamp's middle; 0 for suns */
    double ends;     /* with one march a point: the nearest end of a cone, along the beam */
    double tilt;     /* sine of the largest angle between a cone's axis and the beam's */
} block;

static inline double least(double a, double b) {
    return a < b ? a : b;
}

/* The height of the cones' origins above the points, voxels. */
static double below(const vshi_shadow_task *task) {
    return vshi_shade_offset(task->field, &task->options);
}

/* With one march a point: where a cone begins along its beam, and how far the cone goes while its beam goes
 * by 1. A lamp's beam and cones are equally far on their way. */
static double along_of(const vshi_shadow_task *task, const block *b, const vshi_cone *cone) {
    return b->distance > 0.0 ? 0.0 : vshi_dot(vshi_sub(cone->origin, b->beam.origin), task->place.towards);
}

static double pace_of(const vshi_shadow_task *task, const block *b, const vshi_cone *cone) {
    return b->distance > 0.0
               ? (vshi_length(vshi_sub(task->place.centre, cone->origin)) + below(task)) / b->distance
               : 1.0;
}

/* Aims a beam at the light, a lamp of `radius`. Sets the distance, 0 for suns. False if the beam is as wide
 * as its way is long. */
static bool aim_at(const vshi_shadow_task *task, double radius, vshi_cone *beam, double *distance) {
    *distance = 0.0;
    if (task->place.parallel) {
        beam->direction = task->place.towards;
        beam->sine = task->options.method == VSH_SHADOW_HARD ? 0.0 : task->place.sine;
        return true;
    }
    /* one march aims at the rectangle's disc, not at the sphere around the rectangle */
    const bool hard = task->options.method == VSH_SHADOW_HARD;
    if (task->place.shape != NULL && !hard && !vshi_shadow_has_rays(&task->options)) {
        return false;
    }
    const vshi_vec to = vshi_sub(task->place.centre, beam->origin);
    const double length = vshi_length(to);
    if (!(length > radius + 4.0 * beam->wide)) {
        return false;
    }
    beam->direction = vshi_scale(to, 1.0 / length);
    beam->sine = fmax(0.0, (radius - beam->wide) / length);
    *distance = length;
    return true;
}

static double tilt_of(const vshi_shadow_task *task, const vshi_facing *facing, const block *b) {
    if (task->place.shape == NULL) {
        return b->beam.wide / b->distance;
    }
    double square = 0.0;
    for (size_t i = b->first; i < b->first + b->count; ++i) {
        const vshi_vec across = vshi_cross(facing->cone[i].direction, b->beam.direction);
        square = fmax(square, vshi_dot(across, across));
    }
    return sqrt(square);
}

/* Aims the beam around the cones of a block's points. False if it is not worth a march. */
static bool aim_beam(const vshi_shadow_task *task, const vshi_facing *facing, block *b) {
    const size_t last = b->first + b->count;
    vshi_vec low = facing->cone[b->first].origin, high = low;
    for (size_t i = b->first + 1; i < last; ++i) {
        const vshi_vec p = facing->cone[i].origin;
        low = (vshi_vec){least(low.x, p.x), least(low.y, p.y), least(low.z, p.z)};
        high = (vshi_vec){-least(-high.x, -p.x), -least(-high.y, -p.y), -least(-high.z, -p.z)};
    }
    const vshi_vec centre = vshi_scale(vshi_add(low, high), 0.5);
    double square = 0.0;
    for (size_t i = b->first; i < last; ++i) {
        const vshi_vec off = vshi_sub(facing->cone[i].origin, centre);
        square = -least(-square, -vshi_dot(off, off));
    }
    vshi_cone *beam = &b->beam;
    *beam = (vshi_cone){.origin = centre, .wide = sqrt(square) + 1e-3};
    b->tilt = b->distance = 0.0;
    if (!(beam->wide <= WIDEST)) {
        return false;
    }
    const bool hard = task->options.method == VSH_SHADOW_HARD;
    /* lamps are seen from the points, below the origins of the cones */
    const double radius = (hard ? 0.0 : task->place.radius) + below(task);
    if (!aim_at(task, radius, beam, &b->distance)) {
        return false;
    }
    if (b->distance > 0.0) {
        b->tilt = tilt_of(task, facing, b);
    }
    /* from where the first cone begins to where the last one ends */
    beam->begin = b->ends = INFINITY;
    beam->end = -INFINITY;
    if (!vshi_shadow_has_rays(&task->options)) {
        /* The result of one march is the value. If the widened beam is free from a place on, so are the balls
         * of the cones, which are wider there by the cosine of the half angle. */
        const double sine = beam->sine, wider = 1.0 / sqrt(1.0 - sine * sine);
        beam->wide *= wider;
        beam->sine = sine * wider;
        beam->deeper = DEEPER * (1.0 + sine) + READ;
        for (size_t i = b->first; i < last; ++i) {
            const vshi_cone *cone = &facing->cone[i];
            const double along = along_of(task, b, cone);
            double begins = cone->begin, ends = cone->end, whole = cone->whole;
            if (b->distance > 0.0) {
                const double pace = pace_of(task, b, cone), slowest = pace - 2.0 * below(task) / b->distance;
                begins /= pace;
                ends = slowest > 0.0 ? ends / slowest : INFINITY;
                whole /= pace;
            }
            beam->begin = least(beam->begin, along + begins);
            beam->end = -least(-beam->end, -(along + ends));
            b->ends = least(b->ends, along + whole);
        }
        if (b->distance > 0.0) { /* the balls of the cones extend beyond their ends */
            beam->end = least(beam->end, b->distance) * (1.0 + radius / b->distance);
        }
        return beam->begin < beam->end;
    }
    const double aside = (radius + beam->wide) * b->tilt, ahead = 1.0 - b->tilt * b->tilt;
    for (size_t i = b->first; i < last; ++i) {
        const vshi_cone *cone = &facing->cone[i];
        const double along = vshi_dot(vshi_sub(cone->origin, centre), beam->direction);
        beam->begin = least(beam->begin, along + ahead * cone->begin - aside);
        beam->end = -least(-beam->end, -(along + cone->end + aside));
    }
    return beam->begin < beam->end;
}

/* Ends the cones of a block where its beam is free from `clear` on. */
static void shorten(const vshi_shadow_task *task, vshi_facing *facing, const block *b, double clear) {
    const bool marched = !vshi_shadow_has_rays(&task->options);
    const double aside = (task->place.radius + below(task) + b->beam.wide) * b->tilt,
                 ahead = 1.0 - b->tilt * b->tilt;
    for (size_t i = b->first; i < b->first + b->count; ++i) {
        vshi_cone *cone = &facing->cone[i];
        if (marched) {
            const double from = clear - along_of(task, b, cone);
            cone->end = least(from > 0.0 ? from * pace_of(task, b, cone) : 0.0, cone->end);
            continue;
        }
        const double along = vshi_dot(vshi_sub(cone->origin, b->beam.origin), b->beam.direction);
        const double own = (clear > along ? clear - along : 0.0) / ahead + aside;
        cone->end = least(own, cone->end);
    }
}

/* Whether every cone of a block meets a solid ball around its beam's `t` before it ends. */
static bool hides_all(const vshi_shadow_task *task, const block *b, double t) {
    if (vshi_shadow_has_rays(&task->options)) {
        /* a solid in the beam may stand behind a part of the rectangle */
        return task->place.shape == NULL || t <= b->distance - task->place.radius - below(task);
    }
    return t + DEEPER * fmax(1.0, b->beam.sine * t) <= b->ends;
}

static void prove_size(const vshi_shadow_task *task, vshi_facing *facing, int s, vshi_chunk *chunk,
                       vsh_shade_stats *stats) {
    const size_t size = SIZE[s];
    block blocks[VSHI_PIECE / SMALLEST];
    size_t count = 0;
    chunk->count = 0;
    for (size_t first = 0; first < facing->count; first += size) {
        block *b = &blocks[count];
        const size_t left = facing->count - first;
        *b = (block){.first = first, .count = left < size ? left : size};
        if (2 * b->count <= size || !aim_beam(task, facing, b)) {
            continue;
        }
        if (s > 0 && !vshi_shadow_has_rays(&task->options) && !(b->beam.end < SHORT)) {
            continue; /* smaller blocks pay for short cones, or if a point needs several marches */
        }
        if (vshi_chunk_add(chunk, task->field, &b->beam, (uint32_t)count, stats)) {
            ++count;
        } else {
            shorten(task, facing, b, b->beam.begin);
        }
    }
    vshi_chunk_march(chunk, task->kernel, task->field, VSHI_MARCH_BEAM, task->options.max_steps, stats);
    for (size_t r = 0; r < chunk->count; ++r) {
        block *b = &blocks[chunk->owner[r]];
        const double clear = (double)chunk->clear[r];
        if (chunk->proof[r] == VSHI_PROVED_FULL) {
            const bool hidden = !task->leaky && hides_all(task, b, clear);
            for (size_t i = b->first; hidden && i < b->first + b->count; ++i) {
                facing->settled[i] = true;
                vshi_shadow_settle(task, facing->point[i], 0.0f, 0.0f);
            }
            stats->certified += hidden ? b->count : 0;
        } else if (clear < (double)chunk->end[r]) {
            shorten(task, facing, b, clear > (double)chunk->begin[r] ? clear : b->beam.begin);
        }
        for (size_t i = b->first; i < b->first + b->count; ++i) {
            facing->gathered[i] = true;
        }
    }
}

/* Drops settled points. */
static void keep_open(vshi_facing *facing) {
    size_t left = 0;
    for (size_t i = 0; i < facing->count; ++i) {
        if (!facing->settled[i]) {
            facing->point[left] = facing->point[i];
            facing->normal[left] = facing->normal[i];
            facing->cone[left] = facing->cone[i];
            facing->settled[left] = false;
            facing->gathered[left++] = facing->gathered[i];
        }
    }
    facing->count = left;
}

void vshi_blocks_prove(const vshi_shadow_task *task, vshi_facing *facing, vshi_chunk *chunk,
                       vsh_shade_stats *stats) {
    for (int s = 0; s < SIZES; ++s) {
        if (2 * facing->count > SIZE[s]) {
            prove_size(task, facing, s, chunk, stats);
            keep_open(facing);
        }
        if (s == 0) {
            prove_near(task, facing, stats);
        }
    }
    chunk->count = 0;
}

/* --- balls of free space */

/* Aims the beam around the cones of all points of a ball. False if it is not worth a march. */
static bool aim_ball(const vshi_shadow_task *task, vshi_vec centre, double radius, vshi_cone *beam) {
    const bool hard = task->options.method == VSH_SHADOW_HARD;
    *beam = (vshi_cone){.origin = centre, .wide = radius + 1e-3, .end = INFINITY};
    if (task->place.shape != NULL && !task->place.shape->faces(&task->place, centre, beam->wide)) {
        return false;
    }
    double distance;
    if (!(beam->wide <= WIDEST) || !aim_at(task, hard ? 0.0 : task->place.radius, beam, &distance)) {
        return false;
    }
    if (distance > 0.0) {
        /* no cone extends beyond the lamp's middle, or the end of a rectangle */
        beam->end = distance + beam->wide + (task->place.shape != NULL ? task->place.radius : 0.0);
    }
    return true;
}

void vshi_blocks_prove_balls(const vshi_shadow_task *task, size_t count, const vshi_vec *centre,
                             const double *radius, int8_t *proof, vsh_shade_stats *stats) {
    vshi_chunk chunk;
    chunk.count = 0;
    const bool parallel = task->place.parallel;
    for (size_t i = 0; i < count; ++i) {
        vshi_cone beam;
        const vshi_light_part part = vshi_light_covers(&task->place, centre[i], radius[i]);
        proof[i] = part == VSHI_LIGHT_NO_PART ? VSHI_PROVED_FULL : VSHI_UNPROVED;
        if (part == VSHI_LIGHT_ALL && aim_ball(task, centre[i], radius[i], &beam) &&
            !vshi_chunk_add(&chunk, task->field, &beam, (uint32_t)i, stats)) {
            proof[i] = VSHI_PROVED_FREE;
        }
    }
    vshi_chunk_march(&chunk, task->kernel, task->field, VSHI_MARCH_BEAM, task->options.max_steps, stats);
    for (size_t r = 0; r < chunk.count; ++r) {
        if (chunk.proof[r] == VSHI_PROVED_FULL) {
            /* the occluder may stand behind the lamp as seen from some points */
            proof[chunk.owner[r]] = parallel && !task->leaky ? VSHI_PROVED_FULL : VSHI_UNPROVED;
        } else if (chunk.clear[r] <= chunk.begin[r]) {
            proof[chunk.owner[r]] = VSHI_PROVED_FREE;
        }
    }
}
