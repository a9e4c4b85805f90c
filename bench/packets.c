#include "packets.h"

const char *truth_packing_name(int packing) {
    static const char *const names[TRUTH_PACKINGS] = {[TRUTH_LONE_RAYS] = "occluded1",
                                                      [TRUTH_POINT_8] = "occluded8 of a point",
                                                      [TRUTH_POINT_16] = "occluded16 of a point",
                                                      [TRUTH_NEIGHBOURS_8] = "occluded8 of neighbours",
                                                      [TRUTH_NEIGHBOURS_16] = "occluded16 of neighbours"};
    return names[packing];
}

#include "directions.h"
#include "embree_scene.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { WIDEST = 16 };

typedef struct work {
    const truth_mesh *truth;
    const truth_question *question;
    int packing;
    int width;     /* rays of a packet */
    float *locals; /* [rays][3]: in the world for a light, in the axes of a point's frame for AO */
    float *values;
} work;

typedef struct axes {
    float m[9]; /* columns u, v, n */
} axes;

static axes axes_of(const float *normal) {
    const truth_frame f = truth_frame_around((double[]){normal[0], normal[1], normal[2]});
    axes a;
    for (int i = 0; i < 3; i++) {
        a.m[3 * i] = (float)f.u[i];
        a.m[3 * i + 1] = (float)f.v[i];
        a.m[3 * i + 2] = (float)f.n[i];
    }
    return a;
}

/* Direction of ray i at a point; AO needs its frame. Returns false below the point's horizon. */
static inline bool direct(const work *job, const axes *frame, size_t point, size_t i, float d[3]) {
    const float *l = &job->locals[3 * i];
    if (job->question->towards == NULL) {
        for (int k = 0; k < 3; k++) {
            d[k] = frame->m[3 * k] * l[0] + frame->m[3 * k + 1] * l[1] + frame->m[3 * k + 2] * l[2];
        }
        return true;
    }
    d[0] = l[0], d[1] = l[1], d[2] = l[2];
    const float *n = job->question->normals;
    return n == NULL || d[0] * n[3 * point] + d[1] * n[3 * point + 1] + d[2] * n[3 * point + 2] > 0.0F;
}

typedef struct packet {
    struct RTCRay16 ray;
    int valid[WIDEST];
    size_t point[WIDEST];
    int used;
} packet;

/* Traces the added rays and counts free ones. */
static void flush(const work *job, packet *p, size_t first, size_t free_rays[TRUTH_AT_ONCE]) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = job->question->towards != NULL ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                                                   : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    const int used = p->used;
    for (int l = 0; l < job->width; l++) {
        p->valid[l] = l < used ? -1 : 0;
    }
    if (job->width == 16) {
        rtcOccluded16(p->valid, job->truth->scene, &context, &p->ray);
        for (int l = 0; l < used; l++) {
            free_rays[p->point[l] - first] += p->ray.tfar[l] >= 0.0F; /* a hit sets it to -∞ */
        }
    } else {
        struct RTCRay8 ray;
        for (int l = 0; l < 8; l++) {
            ray.org_x[l] = p->ray.org_x[l], ray.org_y[l] = p->ray.org_y[l], ray.org_z[l] = p->ray.org_z[l];
            ray.dir_x[l] = p->ray.dir_x[l], ray.dir_y[l] = p->ray.dir_y[l], ray.dir_z[l] = p->ray.dir_z[l];
            ray.tnear[l] = 0.0F, ray.tfar[l] = p->ray.tfar[l], ray.time[l] = 0.0F, ray.mask[l] = 0xffffffffU;
            ray.flags[l] = 0, ray.id[l] = 0;
        }
        rtcOccluded8(p->valid, job->truth->scene, &context, &ray);
        for (int l = 0; l < used; l++) {
            free_rays[p->point[l] - first] += ray.tfar[l] >= 0.0F;
        }
    }
    p->used = 0;
}

static inline void add(const work *job, packet *p, const float origin[3], const float d[3], size_t point,
                       size_t first, size_t free_rays[TRUTH_AT_ONCE]) {
    const int l = p->used++;
    p->ray.org_x[l] = origin[0], p->ray.org_y[l] = origin[1], p->ray.org_z[l] = origin[2];
    p->ray.dir_x[l] = d[0], p->ray.dir_y[l] = d[1], p->ray.dir_z[l] = d[2];
    p->ray.tnear[l] = 0.0F, p->ray.time[l] = 0.0F;
    p->ray.tfar[l] = job->question->towards != NULL ? INFINITY : (float)job->question->distance;
    p->ray.mask[l] = 0xffffffffU, p->ray.flags[l] = 0, p->ray.id[l] = 0;
    p->point[l] = point;
    if (p->used == job->width) {
        flush(job, p, first, free_rays);
    }
}

static void trace_alone(const work *job, const float origin[3], const float d[3], size_t *free_rays) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRay ray = {.org_x = origin[0],
                         .org_y = origin[1],
                         .org_z = origin[2],
                         .dir_x = d[0],
                         .dir_y = d[1],
                         .dir_z = d[2],
                         .tfar = job->question->towards != NULL ? INFINITY : (float)job->question->distance,
                         .mask = 0xffffffffU};
    rtcOccluded1(job->truth->scene, &context, &ray);
    *free_rays += ray.tfar >= 0.0F;
}

static void answer(void *user, size_t begin, size_t end) {
    const work *job = user;
    const truth_question *q = job->question;
    size_t free_rays[TRUTH_AT_ONCE] = {0};
    float origins[TRUTH_AT_ONCE][3];
    axes frames[TRUTH_AT_ONCE];
    for (size_t point = begin; point < end; point++) {
        for (int k = 0; k < 3; k++) {
            origins[point - begin][k] = (float)(q->origins[3 * point + (size_t)k] - job->truth->center[k]);
        }
        if (q->towards == NULL) {
            frames[point - begin] = axes_of(&q->normals[3 * point]);
        }
    }
    const bool across = job->packing == TRUTH_NEIGHBOURS_8 || job->packing == TRUTH_NEIGHBOURS_16;
    const size_t slow = across ? q->rays : end - begin, fast = across ? end - begin : q->rays;
    packet p;
    p.used = 0;
    for (size_t a = 0; a < slow; a++) {
        for (size_t b = 0; b < fast; b++) {
            const size_t at = across ? b : a, i = across ? a : b;
            float d[3];
            if (!direct(job, &frames[at], begin + at, i, d)) {
                continue;
            }
            if (job->packing == TRUTH_LONE_RAYS) {
                trace_alone(job, origins[at], d, &free_rays[at]);
            } else {
                add(job, &p, origins[at], d, begin + at, begin, free_rays);
            }
        }
    }
    if (p.used > 0) {
        flush(job, &p, begin, free_rays);
    }
    for (size_t point = begin; point < end; point++) {
        job->values[point] = (float)((double)free_rays[point - begin] / (double)q->rays);
    }
}

int truth_mesh_packets(const truth_mesh *truth, int packing, const truth_question *question, int threads,
                       float *values) {
    static const truth_frame world = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    work job = {.truth = truth,
                .question = question,
                .packing = packing,
                .width = packing == TRUTH_POINT_8 || packing == TRUTH_NEIGHBOURS_8 ? 8 : 16,
                .values = values};
    job.locals = calloc(question->rays, 3 * sizeof *job.locals);
    if (job.locals == NULL) {
        return -1;
    }
    const truth_frame frame = question->towards != NULL ? truth_frame_around(question->towards) : world;
    for (size_t i = 0; i < question->rays; i++) {
        double d[3];
        if (question->towards != NULL) {
            truth_light_direction(&frame, question->w, i, question->rays, d);
        } else {
            truth_cosine_direction(&frame, i, question->rays, d);
        }
        for (size_t k = 0; k < 3; k++) {
            job.locals[3 * i + k] = (float)d[k];
        }
    }
    const int result = truth_in_pieces(question->count, threads, answer, &job);
    free(job.locals);
    return result;
}
