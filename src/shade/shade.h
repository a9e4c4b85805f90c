/* What shadow and AO share: checking options, running points in chunks, adding up their work. */
#ifndef VSHI_SHADE_H
#define VSHI_SHADE_H

#include "base/job.h"
#include "shade/rays.h"
#include "shade/sampler.h"

/* Resolves and checks options. Errors: VSH_ERROR_ARGUMENT, naming field, value and limit. */
vsh_result vshi_shade_options_resolve(const vsh_shade_options *options, vsh_shade_options *full,
                                      vsh_error *error);

/* Shades points begin … end - 1; adds what it did to *stats. */
typedef void vshi_shade_fn(const void *task, size_t begin, size_t end, vsh_shade_stats *stats);

/* The sampler of methods by rays, for `what`. */
vsh_result vshi_shade_sampler(const vsh_shade_options *options, const char *what, vshi_sampler **sampler,
                              vsh_error *error);

/* Runs fn over `count` points in pieces of `grain`, as a part of a job whose units are points. */
vsh_result vshi_shade_pieces(vshi_job *job, size_t count, size_t grain, vshi_shade_fn *fn, const void *task,
                             vsh_shade_stats *stats, vsh_error *error);

/* The same as a job of its own, under progress stage `stage`. `run` is a resolved one. */
vsh_result vshi_shade_run(const vsh_run *run, const char *stage, size_t count, size_t grain,
                          vshi_shade_fn *fn, const void *task, vsh_shade_stats *stats, vsh_error *error);

/* How far above a point its rays begin, voxels. */
static inline double vshi_shade_lift(const vsh_field *field, const vsh_shade_options *options) {
    return options->start_offset + options->surface_offset / field->voxel_size;
}

/* Where the rays of point i begin, `lift` voxels above it, and its unit normal, both in field space. False
 * for a point that is not finite or has no normal where normals are given (then *normal is zero). */
bool vshi_shade_origin(const vsh_field *field, const vsh_points *points, size_t i, double lift,
                       vshi_vec *origin, vshi_vec *normal);

#endif
