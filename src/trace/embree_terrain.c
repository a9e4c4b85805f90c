/* Terrains among Embree's geometries: a primitive of our own for all of the top, whose rays
 * src/trace/terrain.h follows. On a map of 4096², triangles take 40 times the memory, and Embree's grids four
 * times the time. */
#include "trace/embree_scene.h"

#include <float.h>

enum { LANES = VSHI_TERRAIN_LANES };

/* The search for the next crossing begins so many cells beyond one. */
static const double PAST = 1e-4;

/* Room around the box for the rounding of floats, of its size. */
static const float ROOM = 1e-5f;

static void find_bounds(const struct RTCBoundsFunctionArguments *args) {
    const vshi_terrain_part *part = args->geometryUserPtr;
    struct RTCBounds *box = args->bounds_o;
    float low[3] = {FLT_MAX, FLT_MAX, FLT_MAX}, high[3] = {-FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (int corner = 0; corner < 8; ++corner) {
        for (int axis = 0; axis < 3; ++axis) {
            const float at = part->corners[corner][axis];
            low[axis] = at < low[axis] ? at : low[axis];
            high[axis] = at > high[axis] ? at : high[axis];
        }
    }
    box->lower_x = low[0] - ROOM;
    box->lower_y = low[1] - ROOM;
    box->lower_z = low[2] - ROOM;
    box->upper_x = high[0] + ROOM;
    box->upper_y = high[1] + ROOM;
    box->upper_z = high[2] + ROOM;
}

static void aim(const vshi_relief *relief, const float *ray, size_t n, size_t i, double from,
                vshi_terrain_rays *rays, size_t lane) {
    float origin[3], direction[3];
    for (size_t axis = 0; axis < 3; ++axis) {
        origin[axis] = ray[(VSHI_RAY_ORIGIN + axis) * n + i];
        direction[axis] = ray[(VSHI_RAY_DIRECTION + axis) * n + i];
    }
    vshi_terrain_aim(relief, origin, direction, from, (double)ray[VSHI_RAY_FAR * n + i], (int)lane, rays);
}

/* Aims the rays of a packet that are valid. */
static void aim_all(const vshi_relief *relief, const int *valid, const float *ray, size_t n,
                    vshi_terrain_rays *rays) {
    for (size_t i = 0; i < LANES; ++i) {
        if (i < n && valid[i] == -1) {
            aim(relief, ray, n, i, (double)ray[VSHI_RAY_NEAR * n + i], rays, i);
        } else {
            vshi_terrain_leave(rays, (int)i);
        }
    }
}

static double length_of(const vshi_terrain_rays *rays, size_t lane) {
    return (rays->begin[lane] + (double)rays->hit[lane]) / rays->speed[lane];
}

/* Whether the context's filter, where it has one, lets a hit of ray i be. *length is that of the hit. */
static bool is_taken(const vshi_terrain_part *part, struct RTCIntersectContext *context, const float *ray,
                     size_t n, size_t i, unsigned mesh, double length, vshi_vec normal) {
    if (context->filter == NULL) {
        return true;
    }
    float one[VSHI_RAY_ROWS];
    for (size_t row = 0; row < VSHI_RAY_ROWS; ++row) {
        one[row] = ray[row * n + i];
    }
    one[VSHI_RAY_FAR] = (float)length;
    struct RTCHit hit = {.Ng_x = (float)normal.x,
                         .Ng_y = (float)normal.y,
                         .Ng_z = (float)normal.z,
                         .geomID = mesh,
                         .instID = {RTC_INVALID_GEOMETRY_ID}};
    int valid = -1;
    const struct RTCFilterFunctionNArguments args = {.valid = &valid,
                                                     .geometryUserPtr = (void *)(uintptr_t)part,
                                                     .context = context,
                                                     .ray = (struct RTCRayN *)one,
                                                     .hit = (struct RTCHitN *)&hit,
                                                     .N = 1};
    context->filter(&args);
    return valid == -1;
}

/* The first hit of ray i that is taken; `rays` has its first one. False where there is none. */
static bool find_taken(const vshi_terrain_part *part, struct RTCIntersectContext *context, const float *ray,
                       size_t n, size_t i, unsigned mesh, const vshi_terrain_rays *rays, double *length,
                       vshi_vec *normal) {
    if (!(rays->hit[i] < INFINITY)) {
        return false;
    }
    *length = length_of(rays, i);
    *normal = vshi_terrain_normal(&part->relief, rays, (int)i, rays->hit[i]);
    if (is_taken(part, context, ray, n, i, mesh, *length, *normal)) {
        return true;
    }
    vshi_terrain_rays next;
    for (size_t lane = 1; lane < LANES; ++lane) {
        vshi_terrain_leave(&next, (int)lane);
    }
    for (;;) {
        aim(&part->relief, ray, n, i, *length + PAST / rays->speed[i], &next, 0);
        vshi_terrain_trace(&part->relief, &next);
        if (!(next.hit[0] < INFINITY)) {
            return false;
        }
        *length = length_of(&next, 0);
        *normal = vshi_terrain_normal(&part->relief, &next, 0, next.hit[0]);
        if (is_taken(part, context, ray, n, i, mesh, *length, *normal)) {
            return true;
        }
    }
}

static void occlude(const struct RTCOccludedFunctionNArguments *args) {
    const vshi_terrain_part *part = args->geometryUserPtr;
    const size_t n = args->N;
    float *ray = (float *)args->ray;
    vshi_terrain_rays rays;
    aim_all(&part->relief, args->valid, ray, n, &rays);
    vshi_terrain_trace(&part->relief, &rays);
    for (size_t i = 0; i < n; ++i) {
        double length;
        vshi_vec normal;
        if (args->valid[i] == -1 && rays.hit[i] < INFINITY &&
            (args->context->filter == NULL ||
             find_taken(part, args->context, ray, n, i, args->geomID, &rays, &length, &normal))) {
            ray[VSHI_RAY_FAR * n + i] = -INFINITY;
        }
    }
}

static void intersect(const struct RTCIntersectFunctionNArguments *args) {
    const vshi_terrain_part *part = args->geometryUserPtr;
    const size_t n = args->N;
    float *ray = (float *)args->rayhit, *hit = ray + VSHI_RAY_ROWS * n;
    vshi_terrain_rays rays;
    aim_all(&part->relief, args->valid, ray, n, &rays);
    vshi_terrain_trace(&part->relief, &rays);
    for (size_t i = 0; i < n; ++i) {
        double length;
        vshi_vec normal;
        if (args->valid[i] != -1 ||
            !find_taken(part, args->context, ray, n, i, args->geomID, &rays, &length, &normal)) {
            continue;
        }
        ray[VSHI_RAY_FAR * n + i] = (float)length;
        hit[VSHI_HIT_NORMAL * n + i] = (float)normal.x;
        hit[(VSHI_HIT_NORMAL + 1) * n + i] = (float)normal.y;
        hit[(VSHI_HIT_NORMAL + 2) * n + i] = (float)normal.z;
        hit[VSHI_HIT_U * n + i] = hit[VSHI_HIT_V * n + i] = 0.0f;
        ((unsigned *)hit)[VSHI_HIT_TRIANGLE * n + i] = 0;
        ((unsigned *)hit)[VSHI_HIT_MESH * n + i] = args->geomID;
    }
}

bool vshi_terrain_attach(const vsh_triangles *triangles, size_t number) {
    return vshi_triangles_attach_own(triangles, triangles->first_terrain + (unsigned)number, 1,
                                     &triangles->terrains[number], find_bounds, intersect, occlude);
}
