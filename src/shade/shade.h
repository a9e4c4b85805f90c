/* What shadow and AO share: checking options, running points in chunks, adding up their work. */
#ifndef VSHI_SHADE_H
#define VSHI_SHADE_H

#include "base/job.h"
#include "shade/occluders.h"
#include "shade/rays.h"
#include "trace/sampler.h"

/* Resolves and checks options. Errors: VSH_ERROR_ARGUMENT, naming field, value and limit. */
vsh_result vshi_shade_options_resolve(const vsh_shade_options *options, vsh_shade_options *full,
                                      vsh_error *error);

/* Errors from here on are kept with few rays, whose estimates of their own error are rough. */
#define VSHI_COARSE 0.02

/* Makes of auto what it comes to with `triangles` (NULL: none), and of blue noise Sobol's sequence where
 * methods are to keep a smaller error than VSHI_COARSE: blue noise is for grain, which then nobody sees, and
 * converges as slowly as white. Layers, which have their own, take theirs from options that are not settled
 * yet. */
void vshi_shade_options_settle(vsh_shade_options *full, const vsh_triangles *triangles);

/* Standard error of a value near a half by so many rays of a VSH_SAMPLER_…. */
typedef double vshi_spread_fn(int32_t sampler, int32_t rays);

/* The most rays that a value takes: what the options say, or what it takes for max_error, or a number for
 * methods that keep none. */
int32_t vshi_shade_most_rays(const vsh_shade_options *options, vshi_spread_fn *spread, bool keeps_error);

/* Squared errors are added up in units of it, so that the order of threads and bands changes no bit. */
#define VSHI_SQUARE_UNIT 0x1p-40

/* Shades points begin … end - 1; adds what it did to *stats. */
typedef void vshi_shade_fn(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* Adds what `more` counts. */
void vshi_shade_stats_add(vsh_shade_stats *stats, const vsh_shade_stats *more);

/* The sampler of methods by rays, of so many at most, for `what`. */
vsh_result vshi_shade_sampler(const vsh_shade_options *options, int32_t rays, const char *what,
                              vshi_sampler **sampler, vsh_error *error);

/* Runs fn over `count` points in pieces of `grain`, as a part of a job whose units are points. */
vsh_result vshi_shade_pieces(vshi_job *job, size_t count, size_t grain, vshi_shade_fn *fn, const void *task,
                             vsh_shade_stats *stats, vsh_error *error);

/* A value's estimated error. */
static inline void vshi_stats_add_error(vsh_shade_stats *stats, double error) {
    stats->square_error += error * error;
    stats->worst_error = error > stats->worst_error ? error : stats->worst_error;
}

/* The same as a job of its own, under progress stage `stage`. `run` is a resolved one. */
vsh_result vshi_shade_run(const vsh_run *run, const char *stage, size_t count, size_t grain,
                          vshi_shade_fn *fn, const void *task, vsh_shade_stats *stats, vsh_error *error);

/* vsh_shade_irradiance() by a tinted visibility; the tint is one that vsh_tint_check() has passed. */
void vshi_shade_irradiance(const vsh_points *points, const float *shading_normals, const vsh_light *light,
                           const float *visibility, const vsh_tint *tint, float *irradiance);

/* How far above a point its rays begin, voxels. */
static inline double vshi_shade_lift(const vsh_field *field, const vsh_shade_options *options) {
    return options->start_offset + options->surface_offset / field->voxel_size;
}

/* Where the rays of point i begin, `lift` voxels above it, and its unit normal, both in field space. False
 * for a point that is not finite or has no normal where normals are given (then *normal is zero). */
bool vshi_shade_origin(const vsh_field *field, const vsh_points *points, size_t i, double lift,
                       vshi_vec *origin, vshi_vec *normal);

/* What casters are grown by for rays that begin at a point of field space, voxels: up to field->grown. */
double vshi_shade_grown(const vsh_field *field, vshi_vec origin);

/* Whether rays on the field from there are traced against its surface: where that is there, is grown by no
 * more than they are to see, and has them outside. */
bool vshi_shade_traces(const vsh_field *field, vshi_vec origin);

#endif
