/* Rays against the triangles of a vsh_triangles: whether they meet any. */
#include "trace/embree_scene.h"

#include <float.h>
#include <string.h>

static const double COHERENT = 0.9; /* cosine between a packet's rays, at least */

bool vshi_rays_together(const vshi_segment_ray *rays, int count) {
    for (int i = 1; i < count; ++i) {
        const double *a = rays[0].direction, *b = rays[i].direction;
        if (!(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > COHERENT)) {
            return false;
        }
    }
    return true;
}

/* Moves a ray that begins far away up to the scene; false where it passes it by, or ends before it. Rounding
 * leaves each move as far off as a double is at that distance, so that the next one begins from there. */
static bool approach(double origin[3], const double direction[3], double *far) {
    enum { MOVES = 24 };                /* 1e308 by 1e15 a move */
    static const double MOVED = 0x1p-6; /* what is left of a move that needs no other */
    for (int move = 0; move < MOVES; ++move) {
        double distance = 0.0, along = 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            distance += origin[axis] * origin[axis];
            along -= origin[axis] * direction[axis];
        }
        if (distance <= VSHI_FAR_ORIGIN * VSHI_FAR_ORIGIN) {
            return true;
        }
        const double skip = along - VSHI_FAR_ORIGIN;
        if (!(skip < *far)) { /* not finite either */
            return false;
        }
        if (!(skip > (move == 0 ? 0.0 : MOVED))) {
            /* the scene is in the ball of √3 around 0: what is this far beside or behind it does not meet it
             */
            return distance <= 2.0 * VSHI_FAR_ORIGIN * VSHI_FAR_ORIGIN;
        }
        for (int axis = 0; axis < 3; ++axis) {
            origin[axis] += skip * direction[axis];
        }
        *far -= skip;
    }
    return false;
}

bool vshi_triangles_aim(const vsh_triangles *triangles, const vshi_segment_ray *ray, struct RTCRay16 *packet,
                        int lane) {
    double origin[3], far = ray->far * triangles->scale;
    for (int axis = 0; axis < 3; ++axis) {
        origin[axis] = (ray->origin[axis] - triangles->centre[axis]) * triangles->scale;
    }
    if (!approach(origin, ray->direction, &far)) {
        return false;
    }
    packet->org_x[lane] = (float)origin[0];
    packet->org_y[lane] = (float)origin[1];
    packet->org_z[lane] = (float)origin[2];
    packet->dir_x[lane] = (float)ray->direction[0];
    packet->dir_y[lane] = (float)ray->direction[1];
    packet->dir_z[lane] = (float)ray->direction[2];
    packet->tnear[lane] = 0.0f;
    packet->time[lane] = 0.0f;
    packet->tfar[lane] = far < (double)FLT_MAX ? (float)far : INFINITY;
    packet->mask[lane] = 0xffffffffu;
    packet->flags[lane] = 0;
    return true;
}

/* Half of a packet, a row of VSHI_PACKET values after the other. */
static void copy_half(int half, const struct RTCRay16 *whole, struct RTCRay8 *part) {
    const float *from = whole->org_x;
    float *to = part->org_x;
    for (size_t row = 0; row < sizeof *part / (8 * sizeof *to); ++row) {
        memcpy(to + 8 * row, from + 16 * row + 8 * half, 8 * sizeof *to);
    }
}

void vshi_triangles_occlude(const vsh_triangles *triangles, const int *valid,
                            struct RTCIntersectContext *context, struct RTCRay16 *packet) {
    if (triangles->wide) {
        triangles->embree->rtcOccluded16(valid, triangles->scene, context, packet);
        return;
    }
    for (int half = 0; half < 2; ++half) {
        struct RTCRay8 part;
        copy_half(half, packet, &part);
        triangles->embree->rtcOccluded8(valid + 8 * half, triangles->scene, context, &part);
        memcpy(packet->tfar + 8 * half, part.tfar, sizeof part.tfar);
    }
}

/* A context of Embree's, and what a filter is to know. */
typedef struct blocking {
    struct RTCIntersectContext context; /* first: the filter is given this */
    const vsh_triangles *triangles;
} blocking;

static void find_blocked(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                         RTCFilterFunctionN filter, bool *blocked) {
    blocking look = {.triangles = triangles};
    rtcInitIntersectContext(&look.context);
    look.context.filter = filter;
    for (size_t begin = 0; begin < count; begin += VSHI_PACKET) {
        struct RTCRay16 packet = {0};
        _Alignas(64) int valid[VSHI_PACKET] = {0};
        const int lanes = count - begin < VSHI_PACKET ? (int)(count - begin) : VSHI_PACKET;
        for (int lane = 0; lane < lanes; ++lane) {
            valid[lane] = vshi_triangles_aim(triangles, &rays[begin + (size_t)lane], &packet, lane) ? -1 : 0;
        }
        look.context.flags = vshi_triangles_flags(triangles, vshi_rays_together(rays + begin, lanes));
        vshi_triangles_occlude(triangles, valid, &look.context, &packet);
        for (int lane = 0; lane < lanes; ++lane) {
            blocked[begin + (size_t)lane] = valid[lane] != 0 && packet.tfar[lane] < 0.0f;
        }
    }
}

void vshi_triangles_blocked(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                            bool *blocked) {
    find_blocked(triangles, rays, count, NULL, blocked);
}

/* An Embree filter: lets rays pass the fronts of triangles. A solid's faces look away from it, also where a
 * transform mirrors them; those of sheets look as their corners turn. */
static void pass_fronts(const struct RTCFilterFunctionNArguments *args) {
    const vsh_triangles *triangles = ((const blocking *)args->context)->triangles;
    const size_t n = args->N;
    const float *ray = (const float *)args->ray, *hit = (const float *)args->hit;
    const unsigned *of = (const unsigned *)args->hit;
    for (size_t i = 0; i < n; ++i) {
        if (args->valid[i] != -1) {
            continue;
        }
        float along = 0.0f;
        for (size_t axis = 0; axis < 3; ++axis) {
            along += ray[(VSHI_RAY_DIRECTION + axis) * n + i] * hit[(VSHI_HIT_NORMAL + axis) * n + i];
        }
        const uint8_t solid =
            vshi_triangles_solid(triangles, of[VSHI_HIT_MESH * n + i], of[VSHI_HIT_TRIANGLE * n + i]) &
            VSHI_SOLID_SIDE;
        if (!(solid == VSHI_SOLID_BEFORE ? along < 0.0f : along > 0.0f)) {
            args->valid[i] = 0;
        }
    }
}

void vshi_triangles_meet_backs(const vsh_triangles *triangles, const vshi_segment_ray *rays, size_t count,
                               bool *met) {
    find_blocked(triangles, rays, count, pass_fronts, met);
}
