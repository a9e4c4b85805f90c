/* Ambient occlusion by cosine-weighted rays, marched against the field or traced against triangles, in
 * rounds. A point takes part until it has its rays, or its error is small enough.
 *
 * No cones go before the rays. Sixteen cones that prove their part of the sky (VSHI_MARCH_PROOF) cost as much
 * as 16 marched or 50 traced rays. They decide a fifth of the rays: near the receiver nothing is proved. At
 * an error of 0.01 on the cloister they saved a fifth of the rays and no time. */
#include "shade/ao.h"
#include "trace/trace.h"

#include <math.h>
#include <string.h>

/* --- rays of a piece of points */

enum { BALLS = 4 };

/* A ball around a place above a point, along its normal, that is free of casters by the field. */
typedef struct free_ball {
    double height, square; /* of its centre above the origin; its squared radius */
} free_ball;

typedef struct point_rays {
    vshi_ao_frame frame;
    bool traced;     /* not exact: its rays meet the field's surface; else they are marched */
    vshi_lean lean;  /* of the plane that limits its directions */
    vshi_vec mirror; /* face at which lower directions are mirrored, along the axes; zero: none are */
    size_t index;    /* of the task's points */
    uint32_t texel;
    int32_t taken, free; /* rays */
    int32_t next;        /* rays after this round; 0: done */
    vshi_vec open;       /* sum of the free directions; exact: in world space, else in the field's */
    vshi_vec all;        /* sum of all directions, along the frame's axes */
    int32_t balls;       /* the smallest first */
    free_ball ball[BALLS];
    vshi_vec world_origin, world_axes[3]; /* exact */
} point_rays;

typedef struct traced_ray {
    vshi_vec direction; /* exact: world space, else the field's */
    double begin;       /* the ray is known to be free up to here */
    uint16_t owner;     /* its point */
    /* its direction among the rays of a tile, so that similar rays are traced together. 0 elsewhere, where
     * the order of a point's rays depends on no other point */
    uint8_t key;
} traced_ray;

/* Points of a piece and their rays. */
typedef struct ray_piece {
    const vshi_ao_task *task;
    bool exact;
    bool tiled; /* the points are texels of one tile */
    size_t count;
    point_rays points[VSHI_AO_GRAIN];
    vshi_chunk chunk;
    size_t traced_count;
    traced_ray traced[VSHI_CHUNK];
} ray_piece;

/* The sequence of the samplers for AO. Lights use other sequences. */
static const uint32_t PURPOSE = 0xa0;
/* Rays of the first round of adaptive and exact. Each round doubles them: a Sobol sequence is best at powers
 * of two. */
static const int32_t FIRST_ROUND = 16;

/* A point this far from all casters, voxels, that the field calls outside, needs no closer test. */
static const double OPEN = 1.0;

enum { AT_ONCE = 64, EDGE = 10, KEYS = EDGE * EDGE + 2 * EDGE };

static void add_free(point_rays *point, vshi_vec direction) {
    ++point->free;
    point->open = vshi_add(point->open, direction);
}

/* Sorts rays by direction, so that successive rays meet the same boxes and triangles. */
static void order(const ray_piece *b, uint16_t of[VSHI_CHUNK]) {
    uint16_t start[KEYS + 1] = {0};
    for (size_t r = 0; r < b->traced_count; ++r) {
        ++start[b->traced[r].key + 1];
    }
    for (size_t k = 0; k < KEYS; ++k) {
        start[k + 1] = (uint16_t)(start[k + 1] + start[k]);
    }
    for (size_t r = 0; r < b->traced_count; ++r) {
        of[start[b->traced[r].key]++] = (uint16_t)r;
    }
}

static void trace(ray_piece *b) {
    const vshi_ao_task *task = b->task;
    const double far = b->exact ? task->options.ao_distance : task->distance;
    uint16_t of[VSHI_CHUNK];
    vshi_segment_ray sorted[VSHI_CHUNK];
    bool blocked[VSHI_CHUNK];
    order(b, of);
    for (size_t r = 0; r < b->traced_count; ++r) {
        const traced_ray *ray = &b->traced[of[r]];
        const point_rays *point = &b->points[ray->owner];
        const vshi_vec d = ray->direction;
        const vshi_vec o =
            vshi_add(b->exact ? point->world_origin : point->frame.origin, vshi_scale(d, ray->begin));
        sorted[r] = (vshi_segment_ray){
            .origin = {o.x, o.y, o.z}, .direction = {d.x, d.y, d.z}, .far = far - ray->begin};
    }
    vshi_triangles_blocked(b->exact ? task->triangles : task->field->surface, sorted, b->traced_count,
                           blocked);
    for (size_t r = 0; r < b->traced_count; ++r) {
        point_rays *point = &b->points[b->traced[of[r]].owner];
        point->free += !blocked[r];
        if (!blocked[r] && task->values.bent != NULL) {
            point->open = vshi_add(point->open, b->traced[of[r]].direction);
        }
    }
}

static void flush(ray_piece *b, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    if (b->traced_count > 0) {
        trace(b);
        stats->rays += b->traced_count;
        b->traced_count = 0;
    }
    if (b->chunk.count == 0) {
        return;
    }
    vshi_chunk_march(&b->chunk, task->kernel, task->field, VSHI_MARCH_GROWN, task->options.max_steps, stats);
    stats->rays += b->chunk.count;
    for (size_t r = 0; r < b->chunk.count; ++r) {
        if (b->chunk.close[r] > 0.0f) {
            const float(*d)[VSHI_CHUNK] = b->chunk.direction;
            add_free(&b->points[b->chunk.owner[r]],
                     (vshi_vec){(double)d[0][r], (double)d[1][r], (double)d[2][r]});
        }
    }
    b->chunk.count = 0;
}

/* Finds free balls up the normal that hold the origin. Rays leave the surface through them, and are free up
 * to their exit. On an open plane the balls cover the AO distance in every direction but the lowest. */
static void find_balls(const vshi_ao_task *task, point_rays *point, vsh_shade_stats *stats) {
    static const double LEAST = 2.0; /* voxels: a smaller ball saves no step */
    point->balls = 0;
    double height = task->distance;
    for (int i = 1; i < BALLS; ++i) {
        height *= 0.5;
    }
    for (int i = 0; i < BALLS; ++i, height *= 2.0) {
        if (height < LEAST) {
            continue;
        }
        const vshi_vec p = vshi_add(point->frame.origin, vshi_scale(point->frame.axes[2], height));
        const double h = vshi_distance_at(task->field, p);
        ++stats->samples;
        if (h >= height) {
            point->ball[point->balls++] = (free_ball){height, h * h};
        }
    }
}

/* The length over which the balls prove a ray free. `z` is the height of its direction over the plane. */
static double free_up_to(const point_rays *point, double z) {
    double end = 0.0;
    for (int32_t i = 0; i < point->balls; ++i) {
        const double middle = point->ball[i].height * z;
        const double out = middle + sqrt(point->ball[i].square -
                                         (point->ball[i].height - middle) * (point->ball[i].height + middle));
        end = out > end ? out : end;
    }
    return end;
}

/* The cell of a direction. Rows alternate their order, so neighbouring keys are neighbouring cells. */
static uint8_t key_of(vshi_vec local) {
    const int x = (int)(0.5 * EDGE * (local.x + 1.0)), y = (int)(0.5 * EDGE * (local.y + 1.0));
    return (uint8_t)(y * EDGE + (y & 1 ? EDGE - 1 - x : x));
}

/* Adds a ray that is traced from `begin` on. */
static void trace_ray(ray_piece *b, uint32_t owner, vshi_vec local, vshi_vec direction, double begin,
                      vsh_shade_stats *stats) {
    if (b->traced_count == VSHI_CHUNK) {
        flush(b, stats);
    }
    const uint8_t key = b->tiled ? key_of(local) : 0;
    b->traced[b->traced_count++] = (traced_ray){direction, begin, (uint16_t)owner, key};
}

/* Adds a ray against the field. It is traced against the field's surface where that exists and fits the
 * point, else marched. */
static void field_ray(ray_piece *b, uint32_t owner, vshi_vec local, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    point_rays *point = &b->points[owner];
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
    if (b->chunk.count == VSHI_CHUNK) {
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
    float *start = &b->chunk.begin[b->chunk.count - 1];
    *start = (float)begin > *start ? (float)begin : *start;
}

/* Maps a place on the disc to a direction: by its cosine over the hemisphere (Malley), or evenly over the
 * sphere (Lambert's azimuthal projection, 1772). */
static vshi_vec direction_of(const vshi_ao_task *task, const vshi_lean *lean, double disc[2]) {
    vshi_dome_place(lean, disc);
    const double x = disc[0], y = disc[1];
    const double square = 1.0 - x * x - y * y;
    const double height = sqrt(square > 0.0 ? square : 0.0);
    return task->sphere ? (vshi_vec){2.0 * height * x, 2.0 * height * y, 2.0 * square - 1.0}
                        : (vshi_vec){x, y, height};
}

static void shoot(ray_piece *b, uint32_t owner, vsh_shade_stats *stats) {
    point_rays *point = &b->points[owner];
    double disc[AT_ONCE][2];
    while (point->taken < point->next) {
        const int32_t left = point->next - point->taken;
        const int32_t count = left < AT_ONCE ? left : AT_ONCE;
        vshi_sampler_disc(b->task->sampler, point->texel, PURPOSE, point->taken, count, disc);
        for (int32_t i = 0; i < count; ++i) {
            const vshi_vec local =
                vshi_dome_mirror(direction_of(b->task, &point->lean, disc[i]), point->mirror);
            if (b->task->values.bent != NULL) {
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
static void limit_dome(const vshi_ao_task *task, point_rays *point, vshi_vec up, vshi_vec face,
                       const vshi_vec axes[3]) {
    const bool smooth = vshi_dot(face, axes[2]) < VSHI_ONE_NORMAL;
    if (vshi_dot(task->up, task->up) > 0.0) {
        point->lean = vshi_dome_lean(up, axes);
        if (smooth) {
            point->mirror =
                (vshi_vec){vshi_dot(face, axes[0]), vshi_dot(face, axes[1]), vshi_dot(face, axes[2])};
        }
    } else if (smooth) {
        point->lean = vshi_dome_lean(face, axes);
    }
}

/* Prepares a point. False if its value is known, so that no rays are needed. */
static bool prepare(const ray_piece *b, size_t i, point_rays *point, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    const vsh_points *points = task->points;
    *point = (point_rays){.lean = VSHI_WHOLE_DOME,
                          .index = i,
                          .texel = points->texels != NULL ? points->texels[i] : (uint32_t)i};
    if (!vshi_ao_frame_at(task, i, &point->frame, stats)) {
        return false;
    }
    if (b->exact) {
        const vshi_vec normal =
            task->sphere ? point->frame.axes[2] : vshi_unit(vshi_vec_off(points->normals + 3 * i));
        const double offset = vshi_triangles_offset(task->triangles) + task->options.surface_offset;
        const vshi_vec face = vshi_ao_face(task, i, normal);
        vshi_ao_axes(normal, point->world_axes);
        limit_dome(task, point, task->up, face, point->world_axes);
        point->world_origin =
            vshi_add(vshi_vec_of(points->positions + 3 * i), vshi_scale(face, task->sphere ? 0.0 : offset));
    } else {
        point->frame.grown = vshi_shade_grown(task->field, point->frame.origin);
        point->traced =
            task->options.ao_method == VSH_AO_ADAPTIVE && vshi_shade_traces(task->field, point->frame.origin);
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

/* Finds points in solids. They see nothing, even if all triangles are farther than the AO distance. */
static void find_buried(const vshi_ao_task *task, size_t all, point_rays *points) {
    vshi_vec at[VSHI_AO_GRAIN];
    uint32_t of[VSHI_AO_GRAIN]; /* numbers of the tested points */
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
            at[count] = points[k].frame.origin;
            of[count++] = (uint32_t)k;
        }
    }
    const vshi_open_field open = {task->field, at, OPEN * task->field->voxel_size};
    vshi_inside(task->triangles, count, positions, normals, NULL, &open, where);
    for (size_t k = 0; k < count; ++k) {
        if (where[k] != VSHI_OUTSIDE) {
            points[of[k]].next = 0;
            vshi_ao_set(&task->values, points[of[k]].index, 0.0f, 0.0f, (vshi_vec){0.0, 0.0, 0.0});
        }
    }
}

/* White noise has the binomial's variance. Evenly spread points leave c² n^(-11/8), measured on the seeds'
 * floor and the cloister. The error at one edge falls as n^-3/4, but finer sets of rays show more edges of a
 * hemisphere. */
double vshi_ao_spread(int32_t sampler, int32_t rays) {
    static const double SOBOL = 0.9, BLUE = 1.5;
    const double n = rays, root = sqrt(n);
    if (sampler == VSH_SAMPLER_WHITE) {
        return 1.0 / n;
    }
    const double eighth = sqrt(sqrt(root)); /* square roots have the same bits everywhere, pow() does not */
    const double c = (sampler == VSH_SAMPLER_BLUE ? BLUE : SOBOL) / (root * eighth * sqrt(eighth));
    return c * c;
}

/* Standard error of `free` rays of `taken`. The share is smoothed (Laplace's rule of succession), because a
 * few agreeing rays do not prove that all agree. */
static double standard_error(int32_t sampler, int32_t taken, double free) {
    const double p = (free + 1.0) / (taken + 2.0);
    return sqrt(p * (1.0 - p) * vshi_ao_spread(sampler, taken));
}

static double spread_of(int32_t sampler, int32_t rays) {
    return standard_error(sampler, rays, 0.5 * rays);
}

int32_t vshi_ao_most_rays(const vsh_shade_options *options) {
    const bool keeps_error =
        (vsh_method_traits(VSH_NAMES_AO, options->ao_method) & VSH_METHOD_KEEPS_ERROR) != 0;
    return vshi_shade_most_rays(options, spread_of, keeps_error);
}

/* Decides how many rays a point has after the next round: at most `most`, or 0 if it is done. */
static void decide(const vshi_ao_task *task, int32_t most, point_rays *point) {
    const vsh_shade_options *options = &task->options;
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

static void open_points(ray_piece *piece, const vshi_ao_task *task, const size_t *points, size_t count,
                        bool tiled, int32_t first, vsh_shade_stats *stats) {
    piece->task = task;
    piece->exact = task->options.ao_method == VSH_AO_EXACT;
    piece->tiled = tiled;
    piece->count = count;
    piece->traced_count = 0;
    piece->chunk.count = 0;
    for (size_t k = 0; k < count; ++k) {
        point_rays *point = &piece->points[k];
        point->next = prepare(piece, points[k], point, stats) ? first : 0;
    }
    if (piece->exact && !task->outside) {
        find_buried(task, count, piece->points);
    }
}

/* Whether a point's rays are traced in packets with other points' rays. The rays must be whole blocks of the
 * point's own sequence, and only the number of free rays is needed. */
static bool in_packets(const ray_piece *b, const point_rays *point) {
    const vshi_ao_task *task = b->task;
    const vshi_vec o = point->world_origin;
    return b->exact && !task->sphere && task->values.bent == NULL &&
           task->options.sampler == VSH_SAMPLER_SOBOL && vshi_dot(point->mirror, point->mirror) == 0.0 &&
           vshi_sampler_is_blocks(point->taken, point->next) &&
           vshi_triangles_sees(task->triangles, (double[]){o.x, o.y, o.z});
}

/* Shoots the rays of a point, and of all later points with the same numbers of rays. */
static void shoot_packets(ray_piece *b, size_t first, vsh_shade_stats *stats) {
    const vshi_ao_task *task = b->task;
    const int32_t taken = b->points[first].taken, next = b->points[first].next;
    vshi_disc discs[VSHI_AO_GRAIN];
    int32_t lit[VSHI_AO_GRAIN] = {0};
    size_t of[VSHI_AO_GRAIN], count = 0;
    for (size_t i = first; i < b->count; ++i) {
        const point_rays *p = &b->points[i];
        if (p->taken != taken || p->next != next || !in_packets(b, p)) {
            continue;
        }
        vshi_disc *disc = &discs[count];
        *disc = (vshi_disc){.origin = {p->world_origin.x, p->world_origin.y, p->world_origin.z},
                            .axis = p->world_axes[2],
                            .u = p->world_axes[0],
                            .v = p->world_axes[1],
                            .lean = p->lean,
                            .far = task->options.ao_distance};
        vshi_sampler_shift(task->sampler, p->texel, PURPOSE, disc->shift);
        of[count++] = i;
    }
    if (count > 0) { /* the first point is always among them */
        vshi_triangles_discs(task->triangles, task->sampler, true, discs, count, taken, next, lit);
    }
    for (size_t k = 0; k < count; ++k) {
        b->points[of[k]].free += lit[k];
        b->points[of[k]].taken = next;
    }
    stats->rays += count * (uint64_t)(next - taken);
}

static void shoot_piece(ray_piece *piece, vsh_shade_stats *stats) {
    for (size_t i = 0; i < piece->count; ++i) {
        const point_rays *point = &piece->points[i];
        if (point->taken < point->next && in_packets(piece, point)) {
            shoot_packets(piece, i, stats);
        } else {
            shoot(piece, (uint32_t)i, stats);
        }
    }
    flush(piece, stats);
}

static vshi_vec bent_of(const ray_piece *piece, const point_rays *point) {
    if (piece->task->values.bent == NULL) {
        return (vshi_vec){0.0, 0.0, 0.0};
    }
    const vshi_vec *axes = piece->exact ? point->world_axes : point->frame.axes;
    const vshi_vec mean =
        vshi_ao_mean(point->open, vshi_ao_direction(axes, point->all), point->free, point->taken, axes[2]);
    const vshi_vec d = piece->exact ? vshi_unit(mean) : vshi_direction_to_world(piece->task->field, mean);
    return vshi_scale(d, vshi_length(mean));
}

void vshi_ao_by_rays(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const vsh_shade_options *options = &task->options;
    const bool fixed = options->ao_method == VSH_AO_RAYS;
    const int32_t most = vshi_ao_most_rays(options);
    int32_t first = fixed ? options->early_rays : FIRST_ROUND;
    first = first == 0 || first > most ? most : first;
    ray_piece piece;
    size_t of[VSHI_AO_GRAIN];
    for (size_t i = begin; i < end; ++i) {
        of[i - begin] = i;
    }
    open_points(&piece, task, of, end - begin, false, first, stats);
    for (bool more = true; more;) {
        more = false;
        shoot_piece(&piece, stats);
        for (size_t i = 0; i < piece.count; ++i) {
            if (piece.points[i].next > 0) {
                decide(task, most, &piece.points[i]);
                more = more || piece.points[i].next > 0;
            }
        }
    }
    for (size_t i = begin; i < end; ++i) {
        const point_rays *point = &piece.points[i - begin];
        if (point->taken == 0) {
            continue;
        }
        const double error = standard_error(options->sampler, point->taken, point->free);
        vshi_ao_set(&task->values, i, (float)((double)point->free / point->taken), (float)error,
                    bent_of(&piece, point));
        stats->square_error += fixed ? 0.0 : error * error;
        stats->ao_square_error += fixed ? 0.0 : error * error;
        stats->worst_error = fmax(stats->worst_error, fixed ? 0.0 : error);
        ++stats->refined;
    }
}

/* --- texels that share rays
 *
 * Texels of a lattice shoot, tile by tile, until each is known well enough with the help of its neighbours
 * (window.h). Where values bend little, the texels between shoot no rays. Elsewhere the lattice is halved. */

/* First rays of a texel, and rays of a texel in the next square. */
enum { TILE = 8, FIRST = 8, BEYOND = 16 };

/* Second rays of all texels of a tile whose first rays differ: a power of two, at least this over max_error.
 * From a few rays it is hard to predict how many more a texel needs. With the first rays alone, the cloister
 * at 0.01 had an RMSE of 0.0061 in a time that gives 0.0053. Lattices wider than CLOSE keep to the first
 * rays: their error is mostly the bend between texels, and the estimate of the bend needs the noise of few
 * rays (test_ao_texels: fine texels). */
static const double SEEN_OVER = 0.4;
static const int32_t MOST_SEEN = 128, CLOSE = 2;

/* The longest step between texels of a lattice, as a share of the task's scale, for an error of 1. The error
 * of a plane grows with the square of the step, so steps go with the square root of the error: 0.05 of the
 * scale for 0.02. WIDEST_ALONE is for texels without neighbours along x or y. */
static const double WIDEST = 0.35, WIDEST_ALONE = 0.2;
/* No lattice for errors below this. Noise is then small, and the bend is most of the error, which small
 * windows show badly (test_claims: a disc that fills 32² texels). Random rays hide the bend in their noise.
 */
static const double FINE = 0.005;
/* A window that spans this many texels of a lattice both ways also covers the texels between. */
static const int32_t SPAN = 3;
/* For smaller windows: limit of the second difference of neighbouring values, as a share of max_error. The
 * texels between are then off a straight line by an eighth of it. */
static const double BEND = 4.0;
/* Standard deviations of noise added to the limit: a texel refined by chance is a speck in the picture. */
static const double SIGMAS = 2.0;

/* The side of a square, texels. Squares shoot independently of each other. */
static int32_t square_side(const vshi_ao_share *share) {
    return TILE * share->spacing;
}

/* A tile of a lattice. */
typedef struct tile {
    vshi_texel_lattice lattice;
    vshi_windows windows;
    vshi_window_texel texels[TILE * TILE];
    vshi_window_sums sums[(TILE + 1) * (TILE + 1)];
    size_t at[TILE * TILE]; /* points + 1 */
    size_t wanted[TILE * TILE];
    size_t count;
    uint8_t place[TILE * TILE]; /* of the wanted */
} tile;

/* Notes the rays so far, and decides which texels get more, up to `most`. False if none does. */
static bool decide_tile(ray_piece *piece, tile *t, int32_t most) {
    const vsh_shade_options *options = &piece->task->options;
    for (size_t i = 0; i < piece->count; ++i) {
        const point_rays *point = &piece->points[i];
        if (point->taken > 0) {
            vshi_window_texel *e = &t->texels[t->place[i]];
            e->rays = point->taken;
            e->value = (float)((double)point->free / point->taken);
            e->spread = (float)vshi_ao_shared_spread(options->sampler, point->taken);
        }
    }
    vshi_windows_sum(&t->windows);
    uint16_t places[TILE * TILE] = {0};
    size_t of[TILE * TILE], count = 0;
    vshi_window_estimate estimates[TILE * TILE];
    for (size_t i = 0; i < piece->count; ++i) {
        point_rays *point = &piece->points[i];
        if (point->next == 0) { /* testing known texels again costs as much time as it saves */
            continue;
        }
        point->next = 0;
        if (point->taken < most) {
            places[count] = t->place[i];
            of[count++] = i;
        }
    }
    vshi_windows_estimate(&t->windows, places, count, options->max_error, 0, estimates);
    bool more = false;
    for (size_t k = 0; k < count; ++k) {
        point_rays *point = &piece->points[of[k]];
        if (estimates[k].centred > VSHI_AO_TILE_ENOUGH * options->max_error) {
            point->next = 2 * point->taken < most ? 2 * point->taken : most;
            more = true;
        }
    }
    return more;
}

/* Whether a lattice is fine enough at one of its texels, by the steps to those around it. */
static bool is_fine(const vshi_ao_task *task, const tile *t, int32_t at) {
    const vshi_window_texel *e = &t->texels[at];
    const float steps[4] = {e->step[0], at % TILE + 1 < TILE ? e[1].step[0] : INFINITY, e->step[1],
                            at / TILE + 1 < TILE ? e[TILE].step[1] : INFINITY};
    float longest = 0.0f;
    bool alone[2] = {true, true};
    for (int k = 0; k < 4; ++k) {
        if (steps[k] < INFINITY) {
            longest = fmaxf(longest, steps[k]);
            alone[k / 2] = false;
        }
    }
    const double widest = alone[0] || alone[1] ? WIDEST_ALONE : WIDEST;
    return !(alone[0] && alone[1]) && (double)longest <= widest * sqrt(task->options.max_error) * task->scale;
}

/* The place of a tile's texel along Morton's curve (1966). Neighbours on the curve are close both ways, and
 * their rays make packets. */
static int32_t in_curve(int32_t n) {
    const int32_t x = (n & 1) | (n >> 1 & 2) | (n >> 2 & 4), y = (n >> 1 & 1) | (n >> 2 & 2) | (n >> 3 & 4);
    return y * TILE + x;
}

/* Lays out a tile, and lists the texels that shoot. */
static void open_tile(const vshi_ao_task *task, const vshi_texel_lattice *lattice, tile *t) {
    const vshi_ao_share *share = task->share;
    t->lattice = *lattice;
    t->windows = (vshi_windows){TILE, TILE, t->texels, t->sums, task->isa};
    t->count = 0;
    bool any = false;
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        t->at[k] = vshi_texel_at(&share->map, lattice->left + k % TILE * lattice->spacing,
                                 lattice->top + k / TILE * lattice->spacing);
        any = any || (t->at[k] > 0 && share->level[t->at[k] - 1] == VSHI_AO_OPEN_LEVEL);
    }
    if (!any) {
        return;
    }
    memset(t->texels, 0, sizeof t->texels);
    vshi_links_find(&share->map, lattice, t->texels);
    uint8_t shoots[TILE * TILE] = {0};
    for (int32_t n = 0; n < TILE * TILE; ++n) {
        const int32_t k = in_curve(n);
        const size_t i = t->at[k] - 1;
        if (t->at[k] == 0) {
            continue;
        }
        if (share->level[i] == VSHI_AO_OPEN_LEVEL && (lattice->spacing == 1 || is_fine(task, t, k))) {
            t->place[t->count] = (uint8_t)k;
            t->wanted[t->count++] = i;
            shoots[k] = 1;
        } else if (share->rays[i] > 0) {
            t->texels[k].rays = share->rays[i];
            t->texels[k].value = task->values.ao[i];
            t->texels[k].spread = (float)vshi_ao_shared_spread(task->options.sampler, share->rays[i]);
            shoots[k] = 1;
        }
    }
    for (int32_t k = 0; k < TILE * TILE; ++k) { /* a texel without rays cuts the links of its neighbours */
        t->texels[k].left = t->texels[k].left && shoots[k] && shoots[k - 1];
        t->texels[k].above = t->texels[k].above && shoots[k] && shoots[k - TILE];
    }
}

/* Opens a piece of a lattice's texels with their first rays. Its sequences are numbered within the lattice.
 */
static void open_piece(const vshi_ao_task *task, int32_t spacing, const size_t *points, size_t count,
                       int32_t first, ray_piece *piece, vsh_shade_stats *stats) {
    const int32_t most = vshi_ao_most_rays(&task->options);
    open_points(piece, task, points, count, true, first < most ? first : most, stats);
    for (size_t i = 0; i < piece->count; ++i) {
        const uint32_t texel = piece->points[i].texel;
        piece->points[i].texel =
            vsh_texel(vsh_texel_column(texel) / (uint32_t)spacing, vsh_texel_row(texel) / (uint32_t)spacing);
    }
}

/* Shoots more rays for all texels, unless the first rays are all free or all hidden. */
static void shoot_second(const vshi_ao_task *task, int32_t most, ray_piece *piece, vsh_shade_stats *stats) {
    const double wanted = SEEN_OVER / task->options.max_error;
    int32_t free = 0, taken = 0, rays = FIRST;
    for (size_t i = 0; i < piece->count; ++i) {
        free += piece->points[i].free;
        taken += piece->points[i].taken;
    }
    if (free == 0 || free == taken) {
        return;
    }
    while (rays < MOST_SEEN && rays < wanted) {
        rays *= 2;
    }
    rays = rays < most ? rays : most;
    for (size_t i = 0; i < piece->count; ++i) {
        point_rays *point = &piece->points[i];
        point->next = point->taken > 0 && point->taken < rays ? rays : point->next;
    }
    shoot_piece(piece, stats);
}

static void shoot_tile(const vshi_ao_task *task, tile *t, vsh_shade_stats *stats) {
    const vshi_ao_share *share = task->share;
    const int32_t most = vshi_ao_most_rays(&task->options);
    const int32_t spacing = t->lattice.spacing;
    ray_piece piece;
    open_piece(task, spacing, t->wanted, t->count, FIRST, &piece, stats);
    shoot_piece(&piece, stats);
    if (spacing <= CLOSE) {
        shoot_second(task, most, &piece, stats);
    }
    while (decide_tile(&piece, t, most)) {
        shoot_piece(&piece, stats);
    }
    for (size_t i = 0; i < piece.count; ++i) {
        const point_rays *point = &piece.points[i];
        share->rays[point->index] = point->taken;
        share->level[point->index] = point->taken > 0 ? (uint8_t)spacing : VSHI_AO_KNOWN_LEVEL;
        if (point->taken > 0) {
            vshi_ao_set(&task->values, point->index, (float)((double)point->free / point->taken), NAN,
                        bent_of(&piece, point));
        }
    }
}

/* Whether a lattice's values run almost straight along x (1) or y (TILE) around a texel, by the linked texels
 * of the tile. */
static bool is_straight(const tile *t, const vshi_window_estimate *e, int32_t at, int32_t along,
                        double most) {
    const int32_t place = along == 1 ? at % TILE : at / TILE;
    int32_t run[2] = {0, 0}; /* texels before and after it, at most two each */
    for (int32_t k = at; run[0] < 2 && run[0] < place; k -= along, ++run[0]) {
        if (!(along == 1 ? t->texels[k].left : t->texels[k].above)) {
            break;
        }
    }
    for (int32_t k = at + along; run[1] < 2 && place + run[1] + 1 < TILE; k += along, ++run[1]) {
        if (!(along == 1 ? t->texels[k].left : t->texels[k].above)) {
            break;
        }
    }
    if (run[0] + run[1] < 2) {
        const int32_t next = run[0] > 0 ? at - along : run[1] > 0 ? at + along : at;
        return fabs(e[next].value - e[at].value) <= 0.25 * most;
    }
    const vshi_window_estimate *middle = e + at + (run[0] == 0 ? along : run[1] == 0 ? -along : 0);
    const double before = middle[-along].deviation, own = 2.0 * middle->deviation,
                 after = middle[along].deviation;
    const double off = middle[-along].value - 2.0 * middle->value + middle[along].value;
    return fabs(off) <= most + SIGMAS * sqrt(before * before + own * own + after * after);
}

/* Refines texels at the end of a square if they predict the next texel, in another square, badly. Shoots a
 * few rays from that texel to find out. */
static void grade_ends(const vshi_ao_task *task, const int32_t square[2], const tile *t,
                       const vshi_window_estimate *e, vsh_shade_stats *stats) {
    const vshi_ao_share *share = task->share;
    const int32_t spacing = t->lattice.spacing, side = square_side(share);
    const double most = BEND * task->options.max_error;
    size_t next[2 * TILE], count = 0;
    int32_t place[2 * TILE], along[2 * TILE];
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        const int32_t at[2] = {t->lattice.left + k % TILE * spacing, t->lattice.top + k / TILE * spacing};
        if (!(t->texels[k].rays > 0) || share->level[t->at[k] - 1] != spacing) {
            continue;
        }
        for (int32_t axis = 0; axis < 2; ++axis) {
            int32_t to[2] = {at[0], at[1]};
            to[axis] += spacing;
            const size_t beyond =
                to[axis] == square[axis] + side ? vshi_texel_at(&share->map, to[0], to[1]) : 0;
            if (beyond > 0 && vshi_links_lead(&share->map, at, to)) {
                place[count] = k;
                along[count] = axis;
                next[count++] = beyond - 1;
            }
        }
    }
    if (count == 0) {
        return;
    }
    ray_piece piece;
    open_piece(task, spacing, next, count, BEYOND, &piece, stats);
    shoot_piece(&piece, stats);
    for (size_t i = 0; i < count; ++i) {
        const point_rays *point = &piece.points[i];
        const vshi_window_estimate *own = &e[place[i]];
        const double said = fmin(fmax(own->value + own->slope[along[i]], 0.0), 1.0);
        const double p = (said * point->taken + 1.0) / (point->taken + 2.0);
        const double noise = vshi_ao_shared_spread(task->options.sampler, point->taken) * p * (1.0 - p);
        const double off = (double)point->free / point->taken - said;
        if (point->taken > 0 && fabs(off) > most + SIGMAS * sqrt(noise)) {
            share->level[t->at[place[i]] - 1] = (uint8_t)(spacing / 2);
        }
    }
}

/* Refines texels whose windows do not cover the texels between. */
static void grade(const vshi_ao_task *task, const int32_t square[2], const tile *t, vsh_shade_stats *stats) {
    const vshi_ao_share *share = task->share;
    const int32_t spacing = t->lattice.spacing;
    const double max_error = task->options.max_error, most = BEND * max_error;
    vshi_window_estimate e[TILE * TILE];
    uint16_t places[TILE * TILE];
    for (uint16_t k = 0; k < TILE * TILE; ++k) { /* nobody reads the estimates of texels without rays */
        places[k] = k;
    }
    vshi_windows_estimate(&t->windows, places, TILE * TILE, max_error, 0, e);
    for (int32_t k = 0; k < TILE * TILE; ++k) {
        if (t->texels[k].rays > 0 && share->level[t->at[k] - 1] == spacing &&
            ((e[k].x[1] - e[k].x[0] + 1 < SPAN && !is_straight(t, e, k, 1, most)) ||
             (e[k].y[1] - e[k].y[0] + 1 < SPAN && !is_straight(t, e, k, TILE, most)))) {
            share->level[t->at[k] - 1] = (uint8_t)(spacing / 2);
        }
    }
    grade_ends(task, square, t, e, stats);
}

uint32_t vshi_ao_corners(const vshi_texel_map *map, const int32_t cell[2], int32_t spacing, bool whole,
                         int32_t column, int32_t row) {
    uint32_t corners = 0;
    for (int32_t k = 0; k < 4; ++k) {
        const int32_t corner[2] = {cell[0] + (k & 1) * spacing, cell[1] + (k >> 1) * spacing};
        if (whole || (vshi_texel_at(map, corner[0], corner[1]) > 0 &&
                      vshi_links_lead(map, (const int32_t[]){column, row}, corner))) {
            corners |= 1u << k;
        }
    }
    return corners;
}

/* Whether a direct neighbour of a texel is missing. Another surface may begin there and hide the sky. */
static bool is_edge(const vshi_texel_map *map, int32_t column, int32_t row) {
    return vshi_texel_at(map, column - 1, row) == 0 || vshi_texel_at(map, column + 1, row) == 0 ||
           vshi_texel_at(map, column, row - 1) == 0 || vshi_texel_at(map, column, row + 1) == 0;
}

/* Assigns the texels of a cell without rays to its lattice if all corners that they are linked to belong to
 * it. Corners in other squares are ignored. */
static void cover(const vshi_ao_task *task, const int32_t square[2], const int32_t cell[2], int32_t spacing) {
    const vshi_ao_share *share = task->share;
    const int32_t side = square_side(share);
    uint32_t present = 0, good = 0;
    for (int32_t k = 0; k < 4; ++k) {
        const int32_t x = cell[0] + (k & 1) * spacing, y = cell[1] + (k >> 1) * spacing;
        const size_t at = x < square[0] + side && y < square[1] + side ? vshi_texel_at(&share->map, x, y) : 0;
        present |= (uint32_t)(at > 0) << k;
        good |= (uint32_t)(at > 0 && share->rays[at - 1] > 0 && share->level[at - 1] >= spacing) << k;
    }
    if (good == 0) {
        return;
    }
    const bool whole = vshi_links_whole(&share->map, cell[0], cell[1], spacing);
    for (int32_t k = 0; k < spacing * spacing; ++k) {
        const int32_t column = cell[0] + k % spacing, row = cell[1] + k / spacing;
        const size_t at = vshi_texel_at(&share->map, column, row);
        if (at == 0 || share->level[at - 1] != VSHI_AO_OPEN_LEVEL || is_edge(&share->map, column, row)) {
            continue;
        }
        const uint32_t corners = present & vshi_ao_corners(&share->map, cell, spacing, whole, column, row);
        if (corners != 0 && (corners & ~good) == 0) {
            share->level[at - 1] = (uint8_t)spacing;
        }
    }
}

static void shade_square(const vshi_ao_task *task, const int32_t square[2], vsh_shade_stats *stats) {
    const int32_t side = square_side(task->share);
    tile t;
    const bool fine = task->options.max_error < FINE || task->options.sampler == VSH_SAMPLER_WHITE;
    for (int32_t spacing = fine ? 1 : task->share->spacing; spacing > 0; spacing /= 2) {
        const int32_t step = TILE * spacing;
        for (int32_t k = 0; k < side / step * (side / step); ++k) {
            const vshi_texel_lattice lattice = {square[0] + k % (side / step) * step,
                                                square[1] + k / (side / step) * step, spacing, TILE, TILE};
            open_tile(task, &lattice, &t);
            if (t.count > 0) {
                shoot_tile(task, &t, stats);
                if (spacing > 1) {
                    grade(task, square, &t, stats);
                }
            }
        }
        for (int32_t k = 0; spacing > 1 && k < side / spacing * (side / spacing); ++k) {
            const int32_t cell[2] = {square[0] + k % (side / spacing) * spacing,
                                     square[1] + k / (side / spacing) * spacing};
            cover(task, square, cell, spacing);
        }
    }
}

void vshi_ao_shoot(const vshi_ao_task *prepared, const vsh_points *points, const float *faces,
                   const vshi_ao_share *share, const vshi_ao_values *values, vsh_shade_stats *stats) {
    vshi_ao_task task = *prepared;
    task.points = points;
    task.faces = faces;
    task.values = *values;
    task.share = share;
    const int32_t side = square_side(share);
    for (int32_t y = share->top; y < share->top + share->side; y += side) {
        for (int32_t x = share->left; x < share->left + share->side; x += side) {
            shade_square(&task, (const int32_t[]){x, y}, stats);
        }
    }
}
