#include "shade/shade.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "field/surface.h"

#include <math.h>
#include <pthread.h>

vsh_result vshi_shade_options_resolve(const vsh_shade_options *options, vsh_shade_options *full,
                                      vsh_error *error) {
    *full = vsh_shade_options_default();
    VSHI_TRY(vshi_options_resolve(options, full, sizeof *full, "vsh_shade_options", error));
    const struct {
        const char *name;
        double value, low, high;
    } fields[] = {
        {"method", full->method, VSH_SHADOW_HARD, VSH_SHADOW_AUTO},
        {"ao_method", full->ao_method, VSH_AO_TAPS, VSH_AO_AUTO},
        {"ao_cones", full->ao_cones, 1, 256},
        {"max_steps", full->max_steps, 16, 65536},
        {"ao_distance", full->ao_distance, 0x1p-1000, 0x1p1000},
        {"start_offset", full->start_offset, 0, 16},
        {"surface_offset", full->surface_offset, 0, 0x1p1000},
        {"rays", full->rays, 0, 4096},
        {"sampler", full->sampler, VSH_SAMPLER_SOBOL, VSH_SAMPLER_BLUE},
        {"frame", full->frame, 0, INT32_MAX},
        {"early_rays", full->early_rays, 0, 4096},
        {"max_error", full->max_error, 1e-4, 1},
        {"jitter", full->jitter, 0, 1},
        {"ao_up[0]", full->ao_up[0], -0x1p500, 0x1p500},
        {"ao_up[1]", full->ao_up[1], -0x1p500, 0x1p500},
        {"ao_up[2]", full->ao_up[2], -0x1p500, 0x1p500},
    };
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; ++i) {
        if (!(fields[i].value >= fields[i].low && fields[i].value <= fields[i].high)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s %g is out of range %g … %g", fields[i].name,
                             fields[i].value, fields[i].low, fields[i].high);
        }
    }
    return VSH_OK;
}

void vshi_shade_options_settle(vsh_shade_options *full, const vsh_triangles *triangles) {
    const int32_t has_triangles = triangles != NULL;
    full->method = vsh_shadow_method_resolve(full->method, has_triangles);
    full->ao_method = vsh_ao_method_resolve(full->ao_method, has_triangles);
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

vsh_result vshi_shade_sampler(const vsh_shade_options *options, int32_t rays, const char *what,
                              vshi_sampler **sampler, vsh_error *error) {
    *sampler = vshi_sampler_create(options->sampler, rays, options->frame);
    return *sampler != NULL ? VSH_OK
                            : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
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

/* Pieces of points at work. Squared errors are added up in whole units of VSHI_SQUARE_UNIT, so that the order
 * of threads changes no bit. */
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

/* Of the height of the start at most, so that a receiver never hides itself: what is left of a start offset
 * is 0.1 voxels. */
static const double GROWN_SHARE = 0.75;

double vshi_shade_grown(const vsh_field *field, vshi_vec origin) {
    const float at[3] = {(float)origin.x, (float)origin.y, (float)origin.z};
    const double most = GROWN_SHARE * (double)vshi_field_distance(field, at);
    return most > field->grown ? field->grown : most > 0.0 ? most : 0.0;
}

bool vshi_shade_traces(const vsh_field *field, vshi_vec origin) {
    return field->surface != NULL && vshi_shade_grown(field, origin) >= field->grown &&
           vshi_surface_clears(field, origin);
}
