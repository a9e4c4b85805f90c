/* Options, statistics, origins and lifts of rays, irradiance, chunks of cones, errors of rays. */
#include "shade/shade.h"

#include "base/elementary.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "field/field.h"
#include "field/level.h"
#include "trace/trace.h"

#include <math.h>
#include <pthread.h>

size_t vshi_find_group(const size_t *first, size_t count, size_t element) {
    size_t low = 0, high = count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (first[middle] <= element) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

vsh_result vshi_run_stage(const vsh_run *run, const char *stage, size_t count, vshi_element_fn *fn,
                          void *user, vsh_error *error) {
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, stage, count, stage, error));
    const vsh_result result = vshi_parallel_each(job, count, 1, 1, fn, user, error);
    vshi_job_end(job);
    return result;
}

/* --- options and statistics */

vsh_result vshi_shade_options_resolve(const vsh_shade_options *options, vsh_shade_options *full,
                                      vsh_error *error) {
    *full = vsh_shade_options_default();
    VSHI_TRY(vshi_options_resolve(options, full, sizeof *full, "vsh_shade_options", error));
    const vshi_range ranges[] = {
        {"method", full->method, VSH_SHADOW_HARD, VSH_SHADOW_AUTO},
        {"ao_method", (int32_t)full->ao_method, VSH_AO_TAPS, VSH_AO_AUTO},
        {"ao_cones", full->ao_cones, 1, 256},
        {"max_steps", full->max_steps, 16, 65536},
        {"ao_distance", full->ao_distance, 0x1p-1000, 0x1p1000},
        {"start_offset", full->start_offset, 0, 16},
        {"surface_offset", full->surface_offset, 0, 0x1p1000},
        {"rays", full->rays, 0, 4096},
        {"sampler", (int32_t)full->sampler, VSH_SAMPLER_SOBOL, VSH_SAMPLER_BLUE},
        {"frame", full->frame, 0, INT32_MAX},
        {"early_rays", full->early_rays, 0, 4096},
        {"max_error", full->max_error, 1e-4, 1},
        {"jitter", full->jitter, 0, 1},
        {"ao_up[0]", full->ao_up[0], -0x1p500, 0x1p500},
        {"ao_up[1]", full->ao_up[1], -0x1p500, 0x1p500},
        {"ao_up[2]", full->ao_up[2], -0x1p500, 0x1p500},
    };
    return vshi_check_ranges(ranges, sizeof ranges / sizeof ranges[0], error);
}

void vshi_shade_options_settle(vsh_shade_options *full, const vshi_triangles *triangles) {
    full->method = vshi_shadow_method_resolve(full->method, triangles != NULL);
    full->ao_method = vshi_ao_method_resolve(full->ao_method, triangles != NULL);
    const bool fixed = full->method == VSH_SHADOW_RAYS || full->ao_method == VSH_AO_RAYS;
    if (full->sampler == VSH_SAMPLER_BLUE && full->max_error < VSHI_COARSE && !fixed) {
        full->sampler = VSH_SAMPLER_SOBOL;
    }
}

int32_t vshi_shade_most_rays(const vsh_shade_options *options, vshi_spread_fn *spread, bool keeps_error) {
    enum { FIXED = 64, FEWEST = 8, MOST = 16384, MOST_BLUE = 4096 };
    if (options->rays > 0) {
        return options->rays;
    }
    if (!keeps_error) {
        return FIXED;
    }
    /* best-candidate points cost the square of their number to place */
    const int32_t most = options->sampler == VSH_SAMPLER_BLUE ? MOST_BLUE : MOST;
    int32_t rays = FEWEST;
    while (rays < most && spread(options->sampler, rays) > options->max_error) {
        rays *= 2;
    }
    return rays;
}

void vshi_shade_stats_add(vsh_shade_stats *stats, const vsh_shade_stats *more) {
    stats->marches += more->marches;
    stats->samples += more->samples;
    stats->skipped += more->skipped;
    stats->certified += more->certified;
    stats->unfinished += more->unfinished;
    stats->invalid += more->invalid;
    stats->beyond_reach += more->beyond_reach;
    stats->rays += more->rays;
    stats->refined += more->refined;
    stats->square_error += more->square_error;
    stats->ao_square_error += more->ao_square_error;
    stats->worst_error = fmax(stats->worst_error, more->worst_error);
}

/* Pieces of points at work. */
typedef struct shade_run {
    vshi_shade_fn *fn;
    const void *task;
    pthread_mutex_t lock; /* of the following */
    vsh_shade_stats stats;
    uint64_t square_error, ao_square_error;
} shade_run;

static void run_piece(void *user, size_t begin, size_t end) {
    shade_run *run = user;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    run->fn(run->task, begin, end, &stats);
    pthread_mutex_lock(&run->lock);
    run->square_error += (uint64_t)(stats.square_error / VSHI_SQUARE_UNIT);
    run->ao_square_error += (uint64_t)(stats.ao_square_error / VSHI_SQUARE_UNIT);
    vshi_shade_stats_add(&run->stats, &stats);
    pthread_mutex_unlock(&run->lock);
}

vsh_result vshi_shade_pieces(vshi_job *job, size_t count, size_t grain, vshi_shade_fn *fn, const void *task,
                             vsh_shade_stats *stats, vsh_error *error) {
    shade_run run = {
        .fn = fn, .task = task, .lock = PTHREAD_MUTEX_INITIALIZER, .stats = vsh_shade_stats_zero()};
    const vsh_result result = vshi_parallel_for(job, count, grain, 1, run_piece, &run, error);
    if (stats != NULL) {
        run.stats.square_error = (double)run.square_error * VSHI_SQUARE_UNIT;
        run.stats.ao_square_error = (double)run.ao_square_error * VSHI_SQUARE_UNIT;
        vshi_shade_stats_add(stats, &run.stats);
    }
    return result;
}

vsh_result vshi_shade_run(const vsh_run *run, const char *stage, size_t count, size_t grain,
                          vshi_shade_fn *fn, const void *task, vsh_shade_stats *stats, vsh_error *error) {
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, stage, count, stage, error));
    const vsh_result result = vshi_shade_pieces(job, count, grain, fn, task, stats, error);
    vshi_job_end(job);
    return result;
}

/* --- where rays begin */

bool vshi_shade_origin(const vsh_field *field, const vsh_points *points, size_t i, double offset,
                       vshi_vec *origin, vshi_vec *normal) {
    *origin = vshi_to_field(field, points->positions + 3 * i);
    *normal = (vshi_vec){0.0, 0.0, 0.0};
    if (points->normals != NULL) {
        *normal = vshi_direction_to_field(field, vshi_vec_off(points->normals + 3 * i));
        if (!(vshi_dot(*normal, *normal) > 0.0)) {
            return false;
        }
        *origin = vshi_add(*origin, vshi_scale(*normal, offset));
    }
    return vshi_finite(*origin);
}

/* Share of the origin's height by which casters may grow, so that a receiver never hides itself. A start
 * offset keeps 0.1 voxels. */
static const double GROWN_SHARE = 0.75;

double vshi_shade_grown(const vsh_field *field, vshi_vec origin) {
    const double most = GROWN_SHARE * vshi_distance_at(field, origin);
    return most > field->grown ? field->grown : most > 0.0 ? most : 0.0;
}

bool vshi_shade_traces(const vsh_field *field, vshi_vec origin) {
    return field->surface != NULL && vshi_shade_grown(field, origin) >= field->grown &&
           vshi_surface_clears(field, origin);
}

/* Rays to neighbours begin this far above the triangle, in units of vshi_triangles_offset(): more than the
 * rounding of floats. */
static const double START = 0.125;

/* A neighbour at this distance or farther leaves the lift as it is; a closer one reduces it in proportion. In
 * units of the lift: with less than 2 a sample may end up inside its neighbour or above a low one. */
static const double ROOM = 4.0;

/* Sine of the elevation of the light's lowest point above the triangle, 3 degrees. From here on a sample is
 * not lifted: a lift also moves all other shadows. Below, the lift fades in. */
static const double WELL_ABOVE = 0.05;

vshi_lifter vshi_lifter_open(const vsh_occluders *occluders, const vsh_light *light) {
    vshi_lifter lifter = {.occluders = occluders, .light = light};
    if (light != NULL) {
        lifter.place = vshi_light_in_world(light);
    }
    return lifter;
}

/* Sines of the elevation of the light's lowest and highest point. */
typedef struct elevation {
    double lowest, highest;
} elevation;

static elevation find_elevation(const vshi_lifter *l, vshi_vec from, vshi_vec normal) {
    const vshi_light_place *place = &l->place;
    double centre = 0.0, half = 1.0; /* in the middle of the light */
    if (place->parallel) {
        centre = vshi_dot(normal, place->towards);
        half = place->sine;
    } else {
        const vshi_vec to = vshi_sub(place->centre, from);
        const double distance = vshi_length(to);
        if (distance > 0.0) {
            centre = vshi_dot(normal, to) / distance;
            half = place->radius / distance;
        }
    }
    return (elevation){centre - half, centre + half};
}

bool vshi_light_is_cut(const vshi_lifter *lifter, const vshi_lift_point *point) {
    return lifter->light != NULL && find_elevation(lifter, point->foot, point->face).lowest < 0.0;
}

/* Distance to the nearest triangle straight up and at 45 degrees to four sides, at most `far`. */
static double find_room(const vshi_triangles *triangles, vshi_vec foot, vshi_vec normal, vshi_vec up,
                        double far) {
    const vshi_vec from = vshi_add(foot, vshi_scale(normal, START * vshi_triangles_offset(triangles)));
    vshi_vec u, v;
    vshi_frame(up, &u, &v);
    const vshi_vec ways[5] = {up, vshi_unit(vshi_add(up, u)), vshi_unit(vshi_sub(up, u)),
                              vshi_unit(vshi_add(up, v)), vshi_unit(vshi_sub(up, v))};
    double room = far;
    for (int k = 0; k < 5; ++k) {
        const vshi_vec d = ways[k];
        const vshi_segment_ray ray = {{from.x, from.y, from.z}, {d.x, d.y, d.z}, room};
        room = fmin(room, vshi_triangles_distance(triangles, &ray));
    }
    return room;
}

vshi_vec vshi_lift_find(const vshi_lifter *l, const vshi_lift_point *point) {
    static const vshi_vec NONE = {0.0, 0.0, 0.0};
    const double length = vshi_length(point->lift);
    if (l->light == NULL || !(length > 0.0)) {
        return NONE;
    }
    if (find_elevation(l, point->foot, point->normal).highest < 0.0) {
        return NONE; /* the smooth surface faces away from all of the light */
    }
    const double lowest = find_elevation(l, point->foot, point->face).lowest;
    double share = lowest <= 0.0 ? 1.0 : fmax(1.0 - lowest / WELL_ABOVE, 0.0);
    const vshi_vec up = vshi_scale(point->lift, 1.0 / length);
    for (size_t k = 0; share > 0.0 && k <= l->occluders->layer_count; ++k) {
        const vshi_triangles *triangles =
            k == 0 ? l->occluders->triangles : l->occluders->layers[k - 1].triangles;
        if (triangles != NULL) {
            share *= find_room(triangles, point->foot, point->face, up, ROOM * length) / (ROOM * length);
        }
    }
    return vshi_scale(point->lift, share);
}

/* --- irradiance: what the shadow value leaves out */

static void tint_one(const vsh_tint *tint, double v, double rgb[3]) {
    rgb[0] = rgb[1] = rgb[2] = v;
    if (tint->type == VSH_TINT_QUADRATIC) {
        rgb[1] = 0.5 * v * (v + 1.0);
        rgb[2] = v * v;
    } else if (tint->type == VSH_TINT_POWER) {
        for (int c = 0; c < 3; ++c) {
            rgb[c] = v > 0.0 ? vshi_pow(v, tint->power[c]) : v;
        }
    }
}

vsh_result vshi_tint_check(const vsh_tint *tint, vsh_error *error) {
    VSHI_NEEDS(tint);
    const vshi_range ranges[] = {
        {"tint: type", (int32_t)tint->type, VSH_TINT_NONE, VSH_TINT_POWER},
        {"tint: power[0]", tint->power[0], 0.0625, 16.0},
        {"tint: power[1]", tint->power[1], 0.0625, 16.0},
        {"tint: power[2]", tint->power[2], 0.0625, 16.0},
    };
    return vshi_check_ranges(ranges, tint->type == VSH_TINT_POWER ? 4 : 1, error);
}

void vshi_shade_tint(size_t count, const float *visibility, const vsh_tint *tint, float *rgb) {
    VSHI_FLOATS;
    for (size_t i = 0; i < count; ++i) {
        double tinted[3];
        tint_one(tint, (double)visibility[i], tinted);
        for (size_t c = 0; c < 3; ++c) {
            rgb[3 * i + c] = (float)tinted[c];
        }
    }
}

void vsh_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                          const float *visibility, float *irradiance) {
    static const vsh_tint none = {VSH_TINT_NONE, {1.0, 1.0, 1.0}};
    vshi_shade_irradiance(points, shading_normals, light, visibility, &none, irradiance);
}

void vshi_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                           const float *visibility, const vsh_tint *tint, float *irradiance) {
    VSHI_FLOATS;
    const float *normals = shading_normals != NULL ? shading_normals : points->normals;
    const vshi_light_place place = vshi_light_in_world(light);
    for (size_t i = 0; i < points->count; ++i) {
        double tinted[3];
        tint_one(tint, (double)visibility[i], tinted);
        vshi_vec to;
        const double distance = vshi_light_towards(&place, vshi_vec_of(points->positions + 3 * i), &to);
        const double gain = vshi_light_gain(light, to, distance) *
                            fmax(0.0, vshi_dot(vshi_unit(vshi_vec_off(normals + 3 * i)), to));
        if (gain * tinted[0] > 0.0) {
            for (size_t c = 0; c < 3; ++c) {
                irradiance[3 * i + c] += (float)(tinted[c] * gain * light->color[c]);
            }
        }
    }
}

/* --- chunks of cones on their way to the kernel */

/* Rays begin a sixteenth of a voxel from their origin. The field is not more accurate, so h / t means nothing
 * before. */
static const double FIRST_STEP = 0.0625;
/* Clipping cones shorter than this, voxels, costs more than it saves. */
static const double SHORT = 32.0;
/* Cones wider than the reach by no more than this part do not count as beyond it. Their closeness reads at
 * least 1 / 1.03, which is 0.997 of the light instead of 1. Their last voxels do not count either. A field
 * reaches the farthest corner of casters and receivers, and marches begin and end a few voxels outside. */
static const double BEYOND = 0.03;
static const double LAST_STRETCH = 4.0;
/* The bounds are those of lattice points next to the surface; half a voxel covers the float rounding. */
static const double BOUNDS_MARGIN = 0.5;

const vshi_kernel *vshi_kernel_of(int32_t isa) {
    return VSHI_KERNEL_OF(vshi_kernel, isa);
}

static void push_cone(vshi_chunk *chunk, const vshi_cone *cone, uint32_t owner) {
    const size_t i = chunk->count++;
    chunk->origin[0][i] = (float)cone->origin.x;
    chunk->origin[1][i] = (float)cone->origin.y;
    chunk->origin[2][i] = (float)cone->origin.z;
    chunk->direction[0][i] = (float)cone->direction.x;
    chunk->direction[1][i] = (float)cone->direction.y;
    chunk->direction[2][i] = (float)cone->direction.z;
    chunk->begin[i] = (float)cone->begin;
    chunk->end[i] = (float)cone->end;
    chunk->sine[i] = (float)cone->sine;
    chunk->stop[i] = (float)cone->stop;
    chunk->close[i] = (float)cone->close;
    chunk->horizon[i] = (float)cone->horizon;
    chunk->wide[i] = (float)cone->wide;
    chunk->deeper[i] = (float)cone->deeper;
    chunk->owner[i] = owner;
}

/* Narrows [begin, end] to where slope × t ≥ bound. */
static inline void clip(double slope, double bound, double *begin, double *end) {
    const double t = bound / slope;
    *begin = slope > 0.0 && t > *begin ? t : *begin;
    *end = slope < 0.0 && t < *end ? t : *end;
    *end = slope == 0.0 && bound > 0.0 ? -1.0 : *end;
}

/* The part of a cone from *begin to *end that can meet the casters' bounds. */
static void clip_to_bounds(const vsh_field *field, const vshi_cone *cone, double *begin, double *end) {
    const double o[3] = {cone->origin.x, cone->origin.y, cone->origin.z};
    const double d[3] = {cone->direction.x, cone->direction.y, cone->direction.z};
    const double margin = BOUNDS_MARGIN + cone->wide;
    /* A point at distance r, at an angle f off the axis, is closest by h / t at t = r / cos f. Later minima
     * are not the cone's. */
    double farthest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double low = fabs(o[axis] - (double)field->bounds_min[axis]);
        const double high = fabs(o[axis] - (double)field->bounds_max[axis]);
        const double side = low > high ? low : high;
        farthest += side * side;
    }
    const double last = sqrt(farthest / (1.0 - cone->sine * cone->sine)) + margin;
    *end = last < *end ? last : *end;
    /* a ball of radius t sin b can meet the box only while its centre is that close to each side */
    for (int axis = 0; axis < 3; ++axis) {
        clip(d[axis] + cone->sine, (double)field->bounds_min[axis] - margin - o[axis], begin, end);
        clip(cone->sine - d[axis], o[axis] - (double)field->bounds_max[axis] - margin, begin, end);
    }
}

/* Whether a cone begins inside the bounds, so that they do not delay its begin. */
static bool within_bounds(const vsh_field *field, const vshi_cone *cone) {
    const double o[3] = {cone->origin.x, cone->origin.y, cone->origin.z};
    const double margin = BOUNDS_MARGIN + cone->wide;
    bool within = true;
    for (int axis = 0; axis < 3; ++axis) {
        within = within && o[axis] >= (double)field->bounds_min[axis] - margin &&
                 o[axis] <= (double)field->bounds_max[axis] + margin;
    }
    return within;
}

bool vshi_chunk_add(vshi_chunk *chunk, const vsh_field *field, const vshi_cone *cone, uint32_t owner,
                    vsh_shade_stats *stats) {
    double begin = cone->begin > FIRST_STEP ? cone->begin : FIRST_STEP, end = cone->end;
    if (!(begin < end)) {
        return false;
    }
    /* A proof must not change where a cone begins. Otherwise values would depend on the neighbours. */
    if (end > SHORT || (cone->whole > SHORT && !within_bounds(field, cone))) {
        clip_to_bounds(field, cone, &begin, &end);
        if (!(begin < end)) {
            return false;
        }
    }
    if (field->unknown) {
        return true; /* a march would prove no more than that it misses the casters' box */
    }
    push_cone(chunk, cone, owner);
    chunk->begin[chunk->count - 1] = (float)begin;
    chunk->end[chunk->count - 1] = (float)end;
    ++stats->marches;
    const double band = field->levels[field->level_count - 1].band;
    /* beams that are wider than their cones say nothing about these */
    if (!(cone->deeper > 0.0) && cone->sine * (end - LAST_STRETCH) > (1.0 + BEYOND) * band) {
        ++stats->beyond_reach;
    }
    return true;
}

void vshi_chunk_march(vshi_chunk *chunk, const vshi_kernel *kernel, const vsh_field *field, int32_t kind,
                      int32_t max_steps, vsh_shade_stats *stats) {
    vshi_march_stats work = {0, 0};
    kernel->march(field, chunk, kind, max_steps, &work);
    stats->samples += work.samples;
    stats->unfinished += kind == VSHI_MARCH_PROOF || kind == VSHI_MARCH_BEAM ? 0 : work.unfinished;
}

/* The series of asin for |z| ≤ 1/2. 14 terms leave 1e-11. */
static double asin_small(double z) {
    const double square = z * z;
    double term = z, sum = z;
    for (int k = 1; k < 14; ++k) {
        term *= square * (2 * k - 1) / (2 * k);
        sum += term / (2 * k + 1);
    }
    return sum;
}

/* Fraction of a disc light that is seen past a straight edge at x of its radius from the centre, for x in
 * [-1, 1]: the circular segment 1/2 + (x √(1 - x²) + asin x) / π. It uses no libm, whose bits differ. */
static double segment_share(double x) {
    static const double PI = 3.14159265358979323846;
    if (!(x > -1.0)) {
        return 0.0;
    }
    if (x >= 1.0) {
        return 1.0;
    }
    const double size = fabs(x);
    const double arc = size <= 0.5 ? asin_small(size) : 0.5 * PI - 2.0 * asin_small(sqrt(0.5 * (1.0 - size)));
    const double share = (size * sqrt(1.0 - x * x) + arc) / PI;
    return x < 0.0 ? 0.5 - share : 0.5 + share;
}

double vshi_cone_visibility(double closeness, double sine) {
    if (closeness >= sine) {
        return 1.0;
    }
    if (closeness <= -sine) {
        return 0.0;
    }
    return segment_share(closeness / sine * sqrt((1.0 - sine * sine) / (1.0 - closeness * closeness)));
}

/* --- errors of a point's rays, by how many were lit and by the rays of the points around it */

/* Variances of an edge through the middle of the disc, in units of n^-3/2 and n^-1: see vshi_rays_error().
 * UNSEEN is the variance of a part that no ray has met, over the square of its expected size. A geometric
 * distribution has 2. */
static const double SOBOL = 0.2, BLUE = 0.12, UNSEEN = 1.5;

double vshi_rays_deviation(int32_t sampler, int32_t lit, int32_t taken, double expected) {
    /* Smoothed by one ray of the expected share (Jeffreys' prior for a half), so that a few agreeing rays
     * prove nothing. */
    const double n = taken, p = (lit + expected) / (n + 1.0);
    const double root = sqrt(n);
    const double white = 1.0 / root, low = 1.0 / (root * sqrt(root));
    const double spread = sampler == VSH_SAMPLER_WHITE ? white
                          : sampler == VSH_SAMPLER_BLUE
                              ? (1.6 * low > 0.56 * white ? 1.6 * low : 0.56 * white)
                              : 1.04 * low;
    return spread * sqrt(p * (1.0 - p));
}

double vshi_rays_error(int32_t sampler, int32_t lit, int32_t taken, double lit_around, double taken_around) {
    const double n = taken;
    const int32_t fewer = lit < taken - lit ? lit : taken - lit;
    const double around = fewer == lit ? lit_around : taken_around - lit_around;
    /* the smaller part, expected as large as around the point, smoothed by Laplace's rule of succession */
    const double p = fmin(0.5, (fewer + 1.0) / (n + (taken_around + 2.0) / (around + 1.0)));
    if (fewer == 0) {
        return sqrt(UNSEEN) * p;
    }
    /* a power a little below a third, by roots, which have the same bits everywhere */
    const double white = p * (1.0 - p) / n, fourth = sqrt(sqrt(4.0 * p * (1.0 - p)));
    const double edge = fourth * sqrt(sqrt(fourth));
    const double even = sampler == VSH_SAMPLER_SOBOL  ? SOBOL * edge / (n * sqrt(n))
                        : sampler == VSH_SAMPLER_BLUE ? BLUE * edge * edge / n
                                                      : white;
    return sqrt(even < white || sampler == VSH_SAMPLER_BLUE ? even : white);
}
