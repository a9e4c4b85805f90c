/* Ambient occlusion by cones over the hemisphere, each an equal share of the cosine-weighted sky.
 *
 * The visible share of a cone depends on how near the casters come to it, and on how free its neighbours are.
 * Its own closeness is not enough: casters thinner than the cone read as an edge through it, so closed rooms
 * with thin walls were half lit. Next to an edge some cones are free, but not in a room. The table holds mean
 * shares by analytic rays, on scenes of boxes, slats, spheres and rooms. bench/fit_ao.c computes and prints
 * it. */
#include "base/elementary.h"
#include "shade/ao.h"

#include <math.h>
#include <string.h>

/* Half angles, as a share of the half angles of equal solid angles. */
static const double WIDTH = 0.7;

/* Mean visible share of a cone: rows by its closeness over its sine, -1 … 1, columns by how free its
 * neighbours are, 0 … 1. Printed by bench/fit_ao.c. */
static const float TABLE[VSHI_AO_TABLE_EDGE][VSHI_AO_TABLE_EDGE] = {
    {0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f, 0.0000f},
    {0.0000f, 0.1017f, 0.1017f, 0.1220f, 0.1526f, 0.1526f, 0.1614f, 0.2035f, 0.5186f},
    {0.0000f, 0.1080f, 0.1080f, 0.2362f, 0.2700f, 0.2700f, 0.2744f, 0.2744f, 0.5186f},
    {0.0000f, 0.1080f, 0.1080f, 0.2362f, 0.2784f, 0.2910f, 0.3476f, 0.3476f, 0.5633f},
    {0.0000f, 0.3478f, 0.3478f, 0.4453f, 0.5097f, 0.5174f, 0.5588f, 0.5801f, 0.7020f},
    {0.6620f, 0.6620f, 0.6685f, 0.6735f, 0.6735f, 0.7353f, 0.7353f, 0.7353f, 0.7907f},
    {0.7500f, 0.7500f, 0.7500f, 0.7696f, 0.7750f, 0.7750f, 0.7750f, 0.7750f, 0.8432f},
    {0.7500f, 0.7500f, 0.8035f, 0.8166f, 0.8271f, 0.8271f, 0.8387f, 0.8387f, 0.8562f},
    {1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f, 1.0000f},
};

static void find_neighbours(vshi_ao_cones *cones) {
    const int32_t others = cones->count - 1;
    cones->neighbours = others < VSHI_AO_NEIGHBOURS ? others : VSHI_AO_NEIGHBOURS;
    for (int32_t i = 0; i < cones->count; ++i) {
        double cosines[VSHI_AO_NEIGHBOURS];
        int32_t found = 0;
        for (int32_t j = 0; j < cones->count; ++j) {
            const double cosine = vshi_dot(cones->directions[i], cones->directions[j]);
            if (j == i || (found == cones->neighbours && (found == 0 || cosine <= cosines[found - 1]))) {
                continue;
            }
            int32_t at = found < cones->neighbours ? found++ : found - 1;
            for (; at > 0 && cosines[at - 1] < cosine; --at) {
                cosines[at] = cosines[at - 1];
                cones->nearest[i][at] = cones->nearest[i][at - 1];
            }
            cosines[at] = cosine;
            cones->nearest[i][at] = (uint8_t)j;
        }
    }
}

static const double GOLDEN_ANGLE = 2.39996322972865332, WIDEST = 0.95;

/* Directions of equal weight: a golden-angle spiral over the disc, lifted to the hemisphere (Malley's
 * method), or over the sphere. No cone over the hemisphere dips below the receiver's plane, which hides only
 * directions that do not count. */
void vshi_ao_cones_place(vshi_ao_cones *cones, int32_t count, bool sphere) {
    cones->count = count;
    const double cosine = sphere ? fmax(0.0, 1.0 - 2.0 / count) : 1.0 - 1.0 / count;
    const double share = fmin(WIDTH * sqrt(1.0 - cosine * cosine), WIDEST);
    for (int32_t i = 0; i < count; ++i) {
        const double square = (i + 0.5) / count; /* of the disc's radius there */
        const double height = sphere ? 1.0 - (2.0 * i + 1.0) / count : sqrt(1.0 - square);
        const double radius = sqrt(sphere ? 1.0 - height * height : square);
        cones->directions[i] =
            (vshi_vec){radius * vshi_cos(i * GOLDEN_ANGLE), radius * vshi_sin(i * GOLDEN_ANGLE), height};
        cones->sines[i] = sphere || share < height ? share : height;
    }
    find_neighbours(cones);
}

void vshi_ao_cone_evidence(const vshi_ao_cones *cones, const float *close, int32_t c, double evidence[2]) {
    const double own = (double)close[c] / cones->sines[c];
    evidence[0] = own < -1.0 ? -1.0 : own > 1.0 ? 1.0 : own;
    double sum = 0.0;
    for (int32_t k = 0; k < cones->neighbours; ++k) {
        const int32_t n = cones->nearest[c][k];
        const double x = (double)close[n] / cones->sines[n];
        sum += x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
    }
    evidence[1] = cones->neighbours > 0 ? sum / cones->neighbours : fmax(evidence[0], 0.0);
}

int32_t vshi_ao_table_cell(const double evidence[2], double part[2]) {
    const int32_t last = VSHI_AO_TABLE_EDGE - 2;
    const double row = 0.5 * (evidence[0] + 1.0) * (last + 1), column = evidence[1] * (last + 1);
    const int32_t r = (int32_t)row < last ? (int32_t)row : last;
    const int32_t c = (int32_t)column < last ? (int32_t)column : last;
    part[0] = row - r;
    part[1] = column - c;
    return r * VSHI_AO_TABLE_EDGE + c;
}

/* Visible share of cone c of a point. Free and hidden cones do not depend on their neighbours. */
static double cone_share(const vshi_ao_cones *cones, const float *close, int32_t c) {
    const double closeness = (double)close[c], sine = (double)(float)cones->sines[c];
    if (closeness >= sine) {
        return 1.0;
    }
    if (!(closeness > -sine)) {
        return 0.0;
    }
    double evidence[2], part[2];
    vshi_ao_cone_evidence(cones, close, c, evidence);
    const float *t = &TABLE[0][0] + vshi_ao_table_cell(evidence, part);
    const float *u = t + VSHI_AO_TABLE_EDGE;
    const double near = (double)t[0] + ((double)t[1] - (double)t[0]) * part[1];
    const double far = (double)u[0] + ((double)u[1] - (double)u[0]) * part[1];
    return near + (far - near) * part[0];
}

/* The open share of the cones above a point's face, and the mean open direction, both along the frame's axes.
 */
static double open_share(const vshi_ao_cones *cones, const float *close, vshi_vec face, vshi_vec *where) {
    int32_t count = 0;
    double open = 0.0;
    vshi_vec sum = {0.0, 0.0, 0.0}, all = {0.0, 0.0, 0.0};
    for (int32_t c = 0; c < cones->count; ++c) {
        if (vshi_dot(cones->directions[c], face) < 0.0) {
            continue;
        }
        const double share = cone_share(cones, close, c);
        ++count;
        open += share;
        sum = vshi_add(sum, vshi_scale(cones->directions[c], share));
        all = vshi_add(all, cones->directions[c]);
    }
    *where = vshi_ao_mean(sum, all, open, count, (vshi_vec){0.0, 0.0, 1.0});
    return open / count;
}

static void flush(const vshi_ao_task *task, vshi_chunk *chunk, float *close, vsh_shade_stats *stats) {
    vshi_chunk_march(chunk, task->kernel, task->field, VSHI_MARCH_GROWN, task->options.max_steps, stats);
    for (size_t r = 0; r < chunk->count; ++r) {
        const float closeness = chunk->close[r], sine = chunk->sine[r];
        close[chunk->owner[r]] = closeness;
        stats->certified += closeness >= sine || closeness <= -sine;
    }
    chunk->count = 0;
}

void vshi_ao_by_cones(const void *user, size_t begin, size_t end, vsh_shade_stats *stats) {
    const vshi_ao_task *task = user;
    const vshi_ao_cones *cones = task->cones;
    const size_t count = (size_t)cones->count;
    vshi_chunk chunk;
    float close[VSHI_AO_GRAIN * VSHI_AO_MAX_CONES];
    bool valid[VSHI_AO_GRAIN];
    vshi_vec axes[VSHI_AO_GRAIN][3];
    chunk.count = 0;
    for (size_t i = begin; i < end; ++i) {
        vshi_ao_frame frame;
        valid[i - begin] = vshi_ao_frame_at(task, i, &frame, stats);
        if (!valid[i - begin]) {
            continue;
        }
        frame.grown = vshi_shade_grown(task->field, frame.origin);
        memcpy(axes[i - begin], frame.axes, sizeof frame.axes);
        ++stats->samples;
        if (chunk.count + count > VSHI_CHUNK) {
            flush(task, &chunk, close, stats);
        }
        for (size_t c = 0; c < count; ++c) {
            const vshi_cone cone = {
                .origin = frame.origin,
                .direction = vshi_ao_direction(frame.axes, cones->directions[c]),
                .end = task->distance,
                .sine = cones->sines[c],
                .close = cones->sines[c],
                .stop = -cones->sines[c],
                .wide = frame.grown,
            };
            const size_t owner = (i - begin) * count + c;
            if (!vshi_chunk_add(&chunk, task->field, &cone, (uint32_t)owner, stats)) {
                close[owner] = (float)cone.close;
                ++stats->certified;
            }
        }
    }
    flush(task, &chunk, close, stats);
    for (size_t i = begin; i < end; ++i) {
        if (!valid[i - begin]) {
            continue;
        }
        const vshi_vec *axis = axes[i - begin];
        vshi_vec where, face = {0.0, 0.0, 0.0}; /* every cone counts */
        if (task->faces != NULL) {
            const vshi_vec normal = vshi_unit(vshi_vec_off(task->points->normals + 3 * i));
            const vshi_vec f = vshi_direction_to_field(task->field, vshi_ao_face(task, i, normal));
            face = (vshi_vec){vshi_dot(f, axis[0]), vshi_dot(f, axis[1]), vshi_dot(f, axis[2])};
        }
        task->ao[i] = (float)open_share(cones, close + (i - begin) * count, face, &where);
        if (task->bent != NULL) {
            const double length = vshi_length(where);
            const vshi_vec d = vshi_ao_direction(axis, where);
            vshi_vec_to_floats(vshi_scale(vshi_direction_to_world(task->field, d), length),
                               task->bent + 3 * i);
        }
    }
}
