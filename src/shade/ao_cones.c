/* Ambient occlusion by cones over the hemisphere, each an equal share of the cosine-weighted sky. */
#include "shade/ao.h"

#include <math.h>
#include <stdlib.h>

struct vshi_ao_cones {
    int32_t count;
    vshi_vec directions[256]; /* around +z, cosine-weighted */
    double sines[256];        /* of the cones' half angles */
};

/* Directions of equal weight: a golden-angle spiral over the disc, lifted to the hemisphere (Malley's
 * method). Each cone has an equal share of the hemisphere's solid angle, but none dips below the receiver's
 * plane, which is the receiver's own and hides nothing of what is counted. */
vshi_ao_cones *vshi_ao_cones_create(int32_t count) {
    static const double GOLDEN_ANGLE = 2.39996322972865332;
    vshi_ao_cones *cones = malloc(sizeof *cones);
    if (cones == NULL) {
        return NULL;
    }
    cones->count = count;
    const double cosine = 1.0 - 1.0 / count;
    const double share = sqrt(1.0 - cosine * cosine);
    for (int32_t i = 0; i < count; ++i) {
        const double square = (i + 0.5) / count; /* of the disc's radius there */
        const double radius = sqrt(square), height = sqrt(1.0 - square);
        cones->directions[i] =
            (vshi_vec){radius * cos(i * GOLDEN_ANGLE), radius * sin(i * GOLDEN_ANGLE), height};
        cones->sines[i] = share < height ? share : height;
    }
    return cones;
}

static void flush(const vshi_ao_task *task, vshi_chunk *chunk, double *open, vsh_shade_stats *stats) {
    vshi_march_stats work = {0, 0};
    task->march(task->field, &chunk->rays, VSHI_MARCH_PLAIN, task->options->max_steps, &work);
    stats->samples += work.samples;
    stats->unfinished += work.unfinished;
    for (size_t r = 0; r < chunk->rays.count; ++r) {
        const double closeness = chunk->rays.close[r], sine = chunk->rays.sine[r];
        open[chunk->owner[r]] += vshi_cone_visibility(closeness, sine);
        stats->certified += closeness >= sine || closeness <= -sine;
    }
    vshi_chunk_clear(chunk);
}

void vshi_ao_by_cones(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const vshi_ao_cones *cones = task->cones;
    vshi_chunk chunk;
    double open[VSHI_AO_GRAIN] = {0.0};
    vshi_chunk_clear(&chunk);
    for (size_t i = begin; i < end; ++i) {
        vshi_ao_frame frame;
        if (!vshi_ao_frame_at(task, i, &frame, stats)) {
            open[i - begin] = NAN;
            continue;
        }
        if (chunk.rays.count + (size_t)cones->count > VSHI_CHUNK) {
            flush(task, &chunk, open, stats);
        }
        for (int32_t c = 0; c < cones->count; ++c) {
            const vshi_cone cone = {
                .origin = frame.origin,
                .direction = vshi_ao_direction(frame.axes, cones->directions[c]),
                .end = task->distance,
                .sine = cones->sines[c],
                .close = cones->sines[c],
                .stop = -cones->sines[c],
            };
            if (!vshi_chunk_add(&chunk, task->field, &cone, (uint32_t)(i - begin), stats)) {
                open[i - begin] += 1.0;
                ++stats->certified;
            }
        }
    }
    flush(task, &chunk, open, stats);
    for (size_t i = begin; i < end; ++i) {
        task->ao[i] = (float)(open[i - begin] / cones->count);
    }
}
