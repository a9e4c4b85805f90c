/* Ambient occlusion by cosine-weighted rays, marched against the field or traced against triangles, in
 * rounds: a point takes part until it has its rays, or its error is small enough.
 *
 * No cones go before them. Sixteen that prove their part of the sky free or hidden (VSHI_MARCH_PROOF) cost as
 * much as 16 marched or 50 traced rays and decide a fifth of the rays that follow: near the receiver nothing
 * is proved. At an error of 0.01 on the cloister that saved a fifth of the rays and no time. */
#include "shade/ao_rays.h"
#include "shade/inside.h"

#include <math.h>
#include <string.h>

/* The samplers' sequence for AO; lights have others. */
static const uint32_t PURPOSE = 0xa0;
/* Rays of the first round of adaptive and exact; each further one doubles them: a Sobol sequence is best at
 * powers of two. */
static const int32_t FIRST_ROUND = 16;

/* What no caster is nearer to than this, voxels, and that the field calls outside, is no point to look at
 * closer. */
static const double OPEN = 1.0;

enum { AT_ONCE = 64, EDGE = 10, KEYS = EDGE * EDGE + 2 * EDGE };

static void add_free(vshi_ao_point *point, vshi_vec direction) {
    ++point->free;
    point->open = vshi_add(point->open, direction);
}

/* Rays that go alike follow each other: they meet the same boxes and triangles. */
static void order(const vshi_ao_piece *b, uint16_t of[VSHI_CHUNK]) {
    uint16_t start[KEYS + 1] = {0};
    for (size_t r = 0; r < b->traced; ++r) {
        ++start[b->key[r] + 1];
    }
    for (size_t k = 0; k < KEYS; ++k) {
        start[k + 1] = (uint16_t)(start[k + 1] + start[k]);
    }
    for (size_t r = 0; r < b->traced; ++r) {
        of[start[b->key[r]]++] = (uint16_t)r;
    }
}

static void trace(vshi_ao_piece *b) {
    uint16_t of[VSHI_CHUNK];
    vshi_segment_ray sorted[VSHI_CHUNK];
    bool blocked[VSHI_CHUNK];
    order(b, of);
    for (size_t r = 0; r < b->traced; ++r) {
        const vshi_ao_point *point = &b->points[b->owner[of[r]]];
        const vshi_vec d = b->directions[of[r]];
        const double begin = b->begin[of[r]];
        const vshi_vec o =
            vshi_add(b->exact ? point->world_origin : point->frame.origin, vshi_scale(d, begin));
        const double far = b->exact ? b->task->options->ao_distance : b->task->distance;
        sorted[r] =
            (vshi_segment_ray){.origin = {o.x, o.y, o.z}, .direction = {d.x, d.y, d.z}, .far = far - begin};
    }
    vshi_triangles_blocked(b->exact ? b->task->triangles : b->task->field->surface, sorted, b->traced,
                           blocked);
    for (size_t r = 0; r < b->traced; ++r) {
        vshi_ao_point *point = &b->points[b->owner[of[r]]];
        point->free += !blocked[r];
        if (!blocked[r] && b->task->bent != NULL) {
            point->open = vshi_add(point->open, vshi_vec_of(sorted[r].direction));
        }
    }
}

static void flush(vshi_ao_piece *b, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    if (b->traced > 0) {
        trace(b);
        stats->rays += b->traced;
        b->traced = 0;
    }
    if (b->chunk.rays.count == 0) {
        return;
    }
    vshi_chunk_march(&b->chunk, task->kernel, task->field, VSHI_MARCH_GROWN, task->options->max_steps, stats);
    stats->rays += b->chunk.rays.count;
    for (size_t r = 0; r < b->chunk.rays.count; ++r) {
        if (b->chunk.rays.close[r] > 0.0f) {
            float *const *d = b->chunk.rays.direction;
            add_free(&b->points[b->chunk.owner[r]],
                     (vshi_vec){(double)d[0][r], (double)d[1][r], (double)d[2][r]});
        }
    }
    vshi_chunk_clear(&b->chunk);
}

/* Free balls up the normal that hold the origin: rays leave the surface through them, and are known up to
 * where they come out. Those of an open plane reach its points at the AO distance in every direction but the
 * lowest. */
static void find_balls(const vshi_ao_task *task, vshi_ao_point *point, vsh_shade_stats *stats) {
    static const double LEAST = 2.0; /* voxels: a smaller ball saves no step */
    point->balls = 0;
    double height = task->distance;
    for (int i = 1; i < VSHI_AO_BALLS; ++i) {
        height *= 0.5;
    }
    for (int i = 0; i < VSHI_AO_BALLS; ++i, height *= 2.0) {
        if (height < LEAST) {
            continue;
        }
        const vshi_vec p = vshi_add(point->frame.origin, vshi_scale(point->frame.axes[2], height));
        const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
        const double h = vshi_field_distance(task->field, at);
        ++stats->samples;
        if (h >= height) {
            point->ball[point->balls++] = (vshi_ao_ball){height, h * h};
        }
    }
}

/* How far a ray of this height over the plane is free by the balls. */
static double free_up_to(const vshi_ao_point *point, double z) {
    double end = 0.0;
    for (int32_t i = 0; i < point->balls; ++i) {
        const double middle = point->ball[i].height * z;
        const double out = middle + sqrt(point->ball[i].square -
                                         (point->ball[i].height - middle) * (point->ball[i].height + middle));
        end = out > end ? out : end;
    }
    return end;
}

/* The cell of a direction, row by row there and back. */
static uint8_t key_of(vshi_vec local) {
    const int x = (int)(0.5 * EDGE * (local.x + 1.0)), y = (int)(0.5 * EDGE * (local.y + 1.0));
    return (uint8_t)(y * EDGE + (y & 1 ? EDGE - 1 - x : x));
}

/* A ray that is traced from `begin` on. */
static void trace_ray(vshi_ao_piece *b, uint32_t owner, vshi_vec local, vshi_vec direction, double begin,
                      vsh_shade_stats *stats) {
    if (b->traced == VSHI_CHUNK) {
        flush(b, stats);
    }
    b->directions[b->traced] = direction;
    b->begin[b->traced] = begin;
    b->key[b->traced] = b->tiled ? key_of(local) : 0;
    b->owner[b->traced++] = (uint16_t)owner;
}

/* A ray on the field: traced against its surface where that is there, and as much grown as the point's rays
 * are to meet it. */
static void field_ray(vshi_ao_piece *b, uint32_t owner, vshi_vec local, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    vshi_ao_point *point = &b->points[owner];
    const double begin = free_up_to(point, local.z);
    const vshi_vec direction = vshi_ao_direction(point->frame.axes, local);
    if (begin >= task->distance) {
        add_free(point, direction);
        return;
    }
    if (point->traced) {
        trace_ray(b, owner, local, direction, begin, stats);
        return;
    }
    if (b->chunk.rays.count == VSHI_CHUNK) {
        flush(b, stats);
    }
    const vshi_cone ray = {.origin = point->frame.origin,
                           .direction = direction,
                           .end = task->distance,
                           .sine = 0.0,
                           .close = 1.0,
                           .stop = 0.0,
                           .wide = point->frame.grown};
    if (!vshi_chunk_add(&b->chunk, task->field, &ray, owner, stats)) {
        add_free(point, direction);
        return;
    }
    float *start = &b->chunk.rays.begin[b->chunk.rays.count - 1];
    *start = (float)begin > *start ? (float)begin : *start;
}

/* From a place on the disc: by its cosine over the hemisphere (Malley), or evenly over the sphere (Lambert's
 * azimuthal projection, 1772). */
static vshi_vec direction_of(const vshi_ao_task *task, const vshi_lean *lean, double disc[2]) {
    vshi_dome_place(lean, disc);
    const double x = disc[0], y = disc[1];
    const double square = 1.0 - x * x - y * y;
    const double height = sqrt(square > 0.0 ? square : 0.0);
    return task->sphere ? (vshi_vec){2.0 * height * x, 2.0 * height * y, 2.0 * square - 1.0}
                        : (vshi_vec){x, y, height};
}

static void shoot(vshi_ao_piece *b, uint32_t owner, vsh_shade_stats *stats) {
    vshi_ao_point *point = &b->points[owner];
    double disc[AT_ONCE][2];
    while (point->taken < point->next) {
        const int32_t left = point->next - point->taken;
        const int32_t count = left < AT_ONCE ? left : AT_ONCE;
        vshi_sampler_disc(b->task->sampler, point->texel, PURPOSE, point->taken, count, disc);
        for (int32_t i = 0; i < count; ++i) {
            const vshi_vec local =
                vshi_dome_mirror(direction_of(b->task, &point->lean, disc[i]), point->mirror);
            if (b->task->bent != NULL) {
                point->all = vshi_add(point->all, local);
            }
            if (b->exact) {
                trace_ray(b, owner, local, vshi_ao_direction(point->world_axes, local), 0.0, stats);
            } else {
                field_ray(b, owner, local, stats);
            }
        }
        point->taken += count;
    }
}

/* Limits the point's directions to those above the horizon, or above its face if there is no horizon. With
 * both, the few directions below the face are mirrored at it. */
static void limit_dome(const vshi_ao_task *task, vshi_ao_point *point, vshi_vec up, vshi_vec face,
                       const vshi_vec axes[3]) {
    const bool smooth = vshi_dot(face, axes[2]) < VSHI_ONE_NORMAL;
    if (vshi_ao_has_horizon(task)) {
        point->lean = vshi_dome_lean(up, axes);
        if (smooth) {
            point->mirror =
                (vshi_vec){vshi_dot(face, axes[0]), vshi_dot(face, axes[1]), vshi_dot(face, axes[2])};
        }
    } else if (smooth) {
        point->lean = vshi_dome_lean(face, axes);
    }
}

/* False where there is nothing to shoot: the value is then known. */
static bool prepare(const vshi_ao_piece *b, size_t i, vshi_ao_point *point, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    const vsh_points *points = task->points;
    *point = (vshi_ao_point){.lean = VSHI_WHOLE_DOME,
                             .index = i,
                             .texel = points->texels != NULL ? points->texels[i] : (uint32_t)i};
    if (!vshi_ao_frame_at(task, i, &point->frame, stats)) {
        return false;
    }
    if (b->exact) {
        const vshi_vec normal =
            task->sphere ? point->frame.axes[2] : vshi_unit(vshi_vec_off(points->normals + 3 * i));
        const double offset = vshi_triangles_lift(task->triangles) + task->options->surface_offset;
        const vshi_vec face = vshi_ao_face(task, i, normal);
        vshi_ao_axes(normal, point->world_axes);
        limit_dome(task, point, task->up, face, point->world_axes);
        point->world_origin =
            vshi_add(vshi_vec_of(points->positions + 3 * i), vshi_scale(face, task->sphere ? 0.0 : offset));
    } else {
        point->frame.grown = vshi_shade_grown(task->field, point->frame.origin);
        point->traced = task->options->ao_method == VSH_AO_ADAPTIVE &&
                        vshi_shade_traces(task->field, point->frame.origin);
        ++stats->samples;
        if (!task->sphere) {
            const vshi_vec normal = vshi_unit(vshi_vec_off(points->normals + 3 * i));
            limit_dome(task, point, vshi_direction_to_field(task->field, task->up),
                       vshi_direction_to_field(task->field, vshi_ao_face(task, i, normal)),
                       point->frame.axes);
        }
        find_balls(task, point, stats);
    }
    return true;
}

/* A piece of points, to be looked at for whether they are in solids. */
typedef struct looking {
    const vshi_ao_task *task;
    const vshi_ao_point *points;
    uint32_t of[VSHI_AO_GRAIN]; /* those that are looked at, of the piece */
} looking;

/* A vshi_open_fn. */
static bool is_open(const void *user, size_t i) {
    const looking *l = user;
    const vshi_vec o = l->points[l->of[i]].frame.origin;
    return (double)vshi_field_distance(l->task->field, (float[]){(float)o.x, (float)o.y, (float)o.z}) >= OPEN;
}

/* Points in solids see nothing, also where all triangles around are farther than the AO distance. */
static void find_buried(const vshi_ao_task *task, size_t all, vshi_ao_point *points) {
    looking l = {.task = task, .points = points};
    double positions[3 * VSHI_AO_GRAIN] = {0.0};
    float normals[3 * VSHI_AO_GRAIN] = {0.0f};
    uint8_t where[VSHI_AO_GRAIN];
    size_t count = 0;
    for (size_t k = 0; k < all; ++k) {
        const size_t i = points[k].index;
        if (points[k].next > 0) {
            memcpy(positions + 3 * count, task->points->positions + 3 * i, 3 * sizeof(double));
            if (!task->sphere) {
                memcpy(normals + 3 * count, task->points->normals + 3 * i, 3 * sizeof(float));
            }
            l.of[count++] = (uint32_t)k;
        }
    }
    vshi_inside(task->triangles, count, positions, normals, NULL, is_open, &l, where);
    for (size_t k = 0; k < count; ++k) {
        const size_t i = points[l.of[k]].index;
        if (where[k] == VSHI_OUTSIDE) {
            continue;
        }
        points[l.of[k]].next = 0;
        task->ao[i] = 0.0f;
        if (task->deviation != NULL) {
            task->deviation[i] = 0.0f;
        }
        if (task->bent != NULL) {
            vshi_ao_set_bent(task, i, (vshi_vec){0.0, 0.0, 0.0});
        }
    }
}

/* White noise has the binomial's variance; points that are spread evenly leave c² n^(-11/8) of it, measured
 * on the seeds' floor and the cloister: the error at one edge alone falls as n^-3/4, but a hemisphere shows
 * more edges the finer it is looked at. */
double vshi_ao_spread(int32_t sampler, int32_t rays) {
    static const double SOBOL = 0.9, BLUE = 1.5;
    const double n = rays, root = sqrt(n);
    if (sampler == VSH_SAMPLER_WHITE) {
        return 1.0 / n;
    }
    const double eighth = sqrt(sqrt(root)); /* square roots have the same bits everywhere, powers have not */
    const double c = (sampler == VSH_SAMPLER_BLUE ? BLUE : SOBOL) / (root * eighth * sqrt(eighth));
    return c * c;
}

/* Standard error of `free` rays of `taken`. The share is smoothed (Laplace's rule of succession), for that
 * some rays agree does not mean that all do. */
static double standard_error(int32_t sampler, int32_t taken, double free) {
    const double p = (free + 1.0) / (taken + 2.0);
    return sqrt(p * (1.0 - p) * vshi_ao_spread(sampler, taken));
}

static double spread_of(int32_t sampler, int32_t rays) {
    return standard_error(sampler, rays, 0.5 * rays);
}

int32_t vshi_ao_most_rays(const vsh_shade_options *options) {
    const bool keeps_error = (vsh_ao_method_traits(options->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
    return vshi_shade_most_rays(options, spread_of, keeps_error);
}

/* What comes after a round: more rays up to `most`, or none. */
static void decide(const vshi_ao_task *task, int32_t most, vshi_ao_point *point) {
    const vsh_shade_options *options = task->options;
    bool more = point->taken < most;
    if (options->ao_method == VSH_AO_RAYS) {
        more = more && point->free != 0 && point->free != point->taken;
        point->next = more ? most : 0;
        return;
    }
    more = more && standard_error(options->sampler, point->taken, point->free) > options->max_error;
    const int32_t doubled = 2 * point->taken < most ? 2 * point->taken : most;
    point->next = more ? doubled : 0;
}

void vshi_ao_piece_open(vshi_ao_piece *piece, const vshi_ao_task *task, const size_t *points, size_t count,
                        bool tiled, int32_t first, vsh_shade_stats *stats) {
    piece->task = task;
    piece->exact = task->options->ao_method == VSH_AO_EXACT;
    piece->tiled = tiled;
    piece->count = count;
    piece->traced = 0;
    vshi_chunk_clear(&piece->chunk);
    for (size_t k = 0; k < count; ++k) {
        vshi_ao_point *point = &piece->points[k];
        point->next = prepare(piece, points[k], point, stats) ? first : 0;
    }
    if (piece->exact && !task->outside) {
        find_buried(task, count, piece->points);
    }
}

/* Whether the rays of a point are traced in packets of several points: whole blocks of a sequence of its own,
 * of which only the number of free ones is asked for. */
static bool in_packets(const vshi_ao_piece *b, const vshi_ao_point *point) {
    const vshi_ao_task *task = b->task;
    const vshi_vec o = point->world_origin;
    return b->exact && !task->sphere && task->bent == NULL && task->options->sampler == VSH_SAMPLER_SOBOL &&
           vshi_dot(point->mirror, point->mirror) == 0.0 &&
           vshi_sampler_is_blocks(point->taken, point->next) &&
           vshi_triangles_sees(task->triangles, (double[]){o.x, o.y, o.z});
}

/* The rays of a point and of all after it that are to have as many as it, and have as many. */
static void shoot_packets(vshi_ao_piece *b, size_t first, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    const int32_t taken = b->points[first].taken, next = b->points[first].next;
    vshi_disc discs[VSHI_AO_GRAIN];
    int32_t lit[VSHI_AO_GRAIN] = {0};
    size_t of[VSHI_AO_GRAIN], count = 0;
    for (size_t i = first; i < b->count; ++i) {
        const vshi_ao_point *p = &b->points[i];
        if (p->taken != taken || p->next != next || !in_packets(b, p)) {
            continue;
        }
        vshi_disc *disc = &discs[count];
        *disc = (vshi_disc){.origin = {p->world_origin.x, p->world_origin.y, p->world_origin.z},
                            .axis = p->world_axes[2],
                            .u = p->world_axes[0],
                            .v = p->world_axes[1],
                            .lean = p->lean,
                            .far = task->options->ao_distance};
        vshi_sampler_shift(task->sampler, p->texel, PURPOSE, disc->shift);
        of[count++] = i;
    }
    if (count > 0) { /* as it is: the first point is among them */
        vshi_triangles_discs(task->triangles, task->sampler, true, discs, count, taken, next, lit);
    }
    for (size_t k = 0; k < count; ++k) {
        b->points[of[k]].free += lit[k];
        b->points[of[k]].taken = next;
    }
    stats->rays += count * (uint64_t)(next - taken);
}

void vshi_ao_piece_shoot(vshi_ao_piece *piece, vsh_shade_stats *stats) {
    for (size_t i = 0; i < piece->count; ++i) {
        const vshi_ao_point *point = &piece->points[i];
        if (point->taken < point->next && in_packets(piece, point)) {
            shoot_packets(piece, i, stats);
        } else {
            shoot(piece, (uint32_t)i, stats);
        }
    }
    flush(piece, stats);
}

vshi_vec vshi_ao_piece_bent(const vshi_ao_piece *piece, const vshi_ao_point *point) {
    const vshi_vec *axes = piece->exact ? point->world_axes : point->frame.axes;
    const vshi_vec mean =
        vshi_ao_mean(point->open, vshi_ao_direction(axes, point->all), point->free, point->taken, axes[2]);
    const vshi_vec d = piece->exact ? vshi_unit(mean) : vshi_direction_to_world(piece->task->field, mean);
    return vshi_scale(d, vshi_length(mean));
}

void vshi_ao_by_rays(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const vsh_shade_options *options = task->options;
    const bool fixed = options->ao_method == VSH_AO_RAYS;
    const int32_t most = vshi_ao_most_rays(options);
    int32_t first = fixed ? options->early_rays : FIRST_ROUND;
    first = first == 0 || first > most ? most : first;
    vshi_ao_piece piece;
    size_t of[VSHI_AO_GRAIN];
    for (size_t i = begin; i < end; ++i) {
        of[i - begin] = i;
    }
    vshi_ao_piece_open(&piece, task, of, end - begin, false, first, stats);
    for (bool more = true; more;) {
        more = false;
        vshi_ao_piece_shoot(&piece, stats);
        for (size_t i = 0; i < piece.count; ++i) {
            if (piece.points[i].next > 0) {
                decide(task, most, &piece.points[i]);
                more = more || piece.points[i].next > 0;
            }
        }
    }
    for (size_t i = begin; i < end; ++i) {
        const vshi_ao_point *point = &piece.points[i - begin];
        if (point->taken == 0) {
            continue;
        }
        const double error = standard_error(options->sampler, point->taken, point->free);
        task->ao[i] = (float)((double)point->free / point->taken);
        if (task->deviation != NULL) {
            task->deviation[i] = (float)error;
        }
        if (task->bent != NULL) {
            vshi_ao_set_bent(task, i, vshi_ao_piece_bent(&piece, point));
        }
        stats->square_error += fixed ? 0.0 : error * error;
        stats->ao_square_error += fixed ? 0.0 : error * error;
        stats->worst_error = fmax(stats->worst_error, fixed ? 0.0 : error);
        ++stats->refined;
    }
}
