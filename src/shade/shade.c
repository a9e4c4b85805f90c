#include "shade/shade.h"

#include "base/parallel.h"

#include <math.h>
#include <stdatomic.h>

vsh_result vshi_shade_options_resolve(const vsh_shade_options *options, vsh_shade_options *full,
                                      vsh_error *error) {
    *full = vsh_shade_options_default();
    const vsh_result result = vshi_options_resolve(options, full, sizeof *full, "vsh_shade_options", error);
    if (result != VSH_OK) {
        return result;
    }
    const struct {
        const char *name;
        double value, low, high;
    } fields[] = {
        {"method", full->method, VSH_SHADOW_HARD, VSH_SHADOW_EXACT},
        {"ao_method", full->ao_method, VSH_AO_TAPS, VSH_AO_EXACT},
        {"ao_cones", full->ao_cones, 1, 256},
        {"max_steps", full->max_steps, 16, 65536},
        {"ao_distance", full->ao_distance, 0x1p-1000, 0x1p1000},
        {"start_offset", full->start_offset, 0, 16},
        {"surface_offset", full->surface_offset, 0, 0x1p1000},
        {"rays", full->rays, 1, 4096},
        {"sampler", full->sampler, VSH_SAMPLER_SOBOL, VSH_SAMPLER_BLUE},
        {"frame", full->frame, 0, INT32_MAX},
        {"early_rays", full->early_rays, 0, 4096},
        {"max_error", full->max_error, 1e-4, 1},
    };
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i) {
        if (!(fields[i].value >= fields[i].low && fields[i].value <= fields[i].high)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s %g is out of range %g … %g", fields[i].name,
                             fields[i].value, fields[i].low, fields[i].high);
        }
    }
    return VSH_OK;
}

vsh_result vshi_shade_sampler(const vsh_shade_options *options, const char *what, vshi_sampler **sampler,
                              vsh_error *error) {
    *sampler = vshi_sampler_create(options->sampler, options->rays, options->frame);
    return *sampler != NULL ? VSH_OK
                            : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
}

#define SQUARE_UNIT 0x1p-40

typedef struct shade_run {
    vshi_shade_fn *fn;
    const void *task;
    _Atomic uint64_t marches, samples, skipped, certified, unfinished, invalid, beyond_reach, rays, refined;
    _Atomic uint64_t square_error; /* in units of SQUARE_UNIT, so that the order of threads changes no bit */
} shade_run;

static void run_piece(void *user, size_t begin, size_t end) {
    shade_run *run = user;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    run->fn(run->task, begin, end, &stats);
    atomic_fetch_add(&run->marches, stats.marches);
    atomic_fetch_add(&run->samples, stats.samples);
    atomic_fetch_add(&run->skipped, stats.skipped);
    atomic_fetch_add(&run->certified, stats.certified);
    atomic_fetch_add(&run->unfinished, stats.unfinished);
    atomic_fetch_add(&run->invalid, stats.invalid);
    atomic_fetch_add(&run->beyond_reach, stats.beyond_reach);
    atomic_fetch_add(&run->rays, stats.rays);
    atomic_fetch_add(&run->refined, stats.refined);
    atomic_fetch_add(&run->square_error, (uint64_t)(stats.square_error / SQUARE_UNIT));
}

vsh_result vshi_shade_pieces(vshi_job *job, size_t count, size_t grain, vshi_shade_fn *fn, const void *task,
                             vsh_shade_stats *stats, vsh_error *error) {
    shade_run pieces = {.fn = fn, .task = task};
    const vsh_result result = vshi_parallel_for(job, count, grain, 1, run_piece, &pieces, error);
    if (stats != NULL) {
        stats->marches += pieces.marches;
        stats->samples += pieces.samples;
        stats->skipped += pieces.skipped;
        stats->certified += pieces.certified;
        stats->unfinished += pieces.unfinished;
        stats->invalid += pieces.invalid;
        stats->beyond_reach += pieces.beyond_reach;
        stats->rays += pieces.rays;
        stats->refined += pieces.refined;
        stats->square_error += (double)pieces.square_error * SQUARE_UNIT;
    }
    return result;
}

vsh_result vshi_shade_run(const vsh_run *run, const char *stage, size_t count, size_t grain,
                          vshi_shade_fn *fn, const void *task, vsh_shade_stats *stats, vsh_error *error) {
    vshi_job *job = vshi_job_begin(run, stage, count);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", stage);
    }
    const vsh_result result = vshi_shade_pieces(job, count, grain, fn, task, stats, error);
    vshi_job_end(job);
    return result;
}

bool vshi_shade_origin(const vsh_field *field, const vsh_points *points, size_t i, double lift,
                       vshi_vec *origin, vshi_vec *normal) {
    *origin = vshi_to_field(field, points->positions + 3 * i);
    *normal = (vshi_vec){0.0, 0.0, 0.0};
    if (points->normals != NULL) {
        *normal = vshi_direction_to_field(field, vshi_vec_off(points->normals + 3 * i));
        if (!(vshi_dot(*normal, *normal) > 0.0)) {
            return false;
        }
        *origin = vshi_add(*origin, vshi_scale(*normal, lift));
    }
    return vshi_finite(*origin);
}
