/* Ambient occlusion: taps along the normal, or cones over the hemisphere. */
#include "shade/shade.h"

#include <math.h>

typedef struct ao_task {
    const vsh_field *field;
    const vsh_points *points;
    const vsh_shade_options *options;
    vshi_march_fn *march;
    float *ao;
    double distance;          /* finest voxels */
    vshi_vec directions[256]; /* around +z, cosine-weighted */
    double sines[256];        /* of the cones' half angles */
} ao_task;

/* A right-handed frame around a unit vector (Duff and others, "Building an orthonormal basis, revisited",
 * 2017). */
static void frame(vshi_vec n, vshi_vec *tangent, vshi_vec *bitangent) {
    const double sign = n.z < 0.0 ? -1.0 : 1.0;
    const double a = -1.0 / (sign + n.z);
    const double b = n.x * n.y * a;
    *tangent = (vshi_vec){1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
    *bitangent = (vshi_vec){b, sign + n.y * n.y * a, -n.y};
}

/* Directions of equal weight: a golden-angle spiral over the disc, lifted to the hemisphere (Malley's
 * method). Each cone has an equal share of the hemisphere's solid angle, but none dips below the receiver's
 * plane, which is the receiver's own and hides nothing of what is counted. */
static void place_cones(ao_task *task) {
    static const double GOLDEN_ANGLE = 2.39996322972865332;
    const int32_t count = task->options->ao_cones;
    const double cosine = 1.0 - 1.0 / count;
    const double share = sqrt(1.0 - cosine * cosine);
    for (int32_t i = 0; i < count; ++i) {
        const double square = (i + 0.5) / count; /* of the disc's radius there */
        const double radius = sqrt(square), height = sqrt(1.0 - square);
        task->directions[i] =
            (vshi_vec){radius * cos(i * GOLDEN_ANGLE), radius * sin(i * GOLDEN_ANGLE), height};
        task->sines[i] = share < height ? share : height;
    }
}

static void flush(const ao_task *task, vshi_chunk *chunk, double *open, vsh_shade_stats *stats) {
    vshi_march_stats work = {0, 0};
    task->march(task->field, &chunk->rays, VSHI_MARCH_PLAIN, task->options->max_steps, &work);
    stats->samples += work.samples;
    stats->unfinished += work.unfinished;
    for (size_t r = 0; r < chunk->rays.count; ++r) {
        const double closeness = chunk->rays.close[r], sine = chunk->rays.sine[r];
        open[chunk->owner[r]] += vshi_cone_visibility(closeness, sine);
        stats->certified += closeness >= sine || closeness <= -sine;
    }
    vshi_chunk_clear(chunk, false);
}

enum { AO_GRAIN = 64 }; /* points a piece */

static void shade_cones(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const ao_task *task = user;
    const int32_t count = task->options->ao_cones;
    vshi_chunk chunk;
    double open[AO_GRAIN] = {0.0};
    vshi_chunk_clear(&chunk, false);
    for (size_t i = begin; i < end; ++i) {
        vshi_vec origin, normal, tangent, bitangent;
        if (!vshi_shade_origin(task->field, task->points, i, task->options->start_offset,
                               task->options->surface_offset, &origin, &normal)) {
            open[i - begin] = NAN;
            ++stats->invalid;
            continue;
        }
        frame(normal, &tangent, &bitangent);
        if (chunk.rays.count + (size_t)count > VSHI_CHUNK) {
            flush(task, &chunk, open, stats);
        }
        for (int32_t c = 0; c < count; ++c) {
            const vshi_vec d = task->directions[c];
            const vshi_cone cone = {
                .origin = origin,
                .direction = vshi_add(vshi_add(vshi_scale(tangent, d.x), vshi_scale(bitangent, d.y)),
                                      vshi_scale(normal, d.z)),
                .end = task->distance,
                .sine = task->sines[c],
                .close = task->sines[c],
                .stop = -task->sines[c],
            };
            if (!vshi_chunk_add(&chunk, task->field, &cone, (uint32_t)(i - begin), stats)) {
                open[i - begin] += 1.0;
                ++stats->certified;
            }
        }
    }
    flush(task, &chunk, open, stats);
    for (size_t i = begin; i < end; ++i) {
        task->ao[i] = (float)(open[i - begin] / count);
    }
}

/* Five samples along the normal: what the surface comes nearer than an open plane would (Quilez). His scene's
 * distances 0.01 … 0.13 stand for the AO distance. */
static void shade_taps(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const ao_task *task = user;
    static const double FIRST = 0.01, LAST = 0.13, FADE = 0.95, STRENGTH = 3.0;
    const double unit = task->distance / LAST;
    for (size_t i = begin; i < end; ++i) {
        vshi_vec origin, normal;
        if (!vshi_shade_origin(task->field, task->points, i, task->options->start_offset,
                               task->options->surface_offset, &origin, &normal)) {
            task->ao[i] = NAN;
            ++stats->invalid;
            continue;
        }
        double occlusion = 0.0, weight = 1.0;
        for (int tap = 0; tap < 5; ++tap) {
            const double h = FIRST + (LAST - FIRST) * tap / 4.0;
            const vshi_vec p = vshi_add(origin, vshi_scale(normal, h * unit));
            const float at[3] = {(float)p.x, (float)p.y, (float)p.z};
            /* beyond the coarsest band only the band is known, and it is more than the distance */
            occlusion += weight * (h - fmin(h, (double)vshi_field_distance(task->field, at) / unit));
            weight *= FADE;
        }
        stats->samples += 5;
        const double open = 1.0 - STRENGTH * occlusion;
        task->ao[i] = (float)(open < 0.0 ? 0.0 : open);
    }
}

vsh_result vsh_shade_ao(const vsh_field *field, const vsh_points *points, const vsh_shade_options *options,
                        const vsh_run *run, float *ao, float *deviation, vsh_shade_stats *stats,
                        vsh_error *error) {
    vsh_shade_options full;
    const vsh_result result = vshi_shade_options_resolve(options, &full, error);
    if (result != VSH_OK) {
        return result;
    }
    if (points->normals == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "AO needs normals: vsh_points.normals is NULL");
    }
    if (full.ao_method == VSH_AO_EXACT && full.triangles == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "AO method exact: triangles is NULL");
    }
    for (size_t i = 0; deviation != NULL && i < points->count; ++i) {
        deviation[i] = NAN;
    }
    ao_task task = {.field = field,
                    .points = points,
                    .options = &full,
                    .march = vshi_march_best(),
                    .ao = ao,
                    .distance = full.ao_distance / field->voxel_size};
    if (full.ao_method == VSH_AO_TAPS) {
        return vshi_shade_run(run, "ao", points->count, VSHI_CHUNK, shade_taps, &task, stats, error);
    }
    place_cones(&task);
    return vshi_shade_run(run, "ao", points->count, AO_GRAIN, shade_cones, &task, stats, error);
}
