/* Procedural solids in an Embree scene: one user geometry, whose primitives are the parts of their union.
 * Rays meet them by sphere tracing, at world coordinates in double precision. */
#include "trace/embree_scene.h"

#include "base/floats.h"
#include "trace/solids.h"

/* Rounding of floats moves a box by less than this part of the scene's size. */
static const double MARGIN = 0x1p-20;

static void find_bounds(const struct RTCBoundsFunctionArguments *args) {
    VSHI_FLOATS;
    const vsh_triangles *triangles = args->geometryUserPtr;
    double low[3], high[3];
    float scaled[2][3];
    vshi_solids_part_box(triangles->solids, args->primID, low, high);
    for (int axis = 0; axis < 3; ++axis) {
        scaled[0][axis] = (float)((low[axis] - triangles->centre[axis]) * triangles->scale - MARGIN);
        scaled[1][axis] = (float)((high[axis] - triangles->centre[axis]) * triangles->scale + MARGIN);
    }
    *args->bounds_o = (struct RTCBounds){.lower_x = scaled[0][0],
                                         .lower_y = scaled[0][1],
                                         .lower_z = scaled[0][2],
                                         .upper_x = scaled[1][0],
                                         .upper_y = scaled[1][1],
                                         .upper_z = scaled[1][2]};
}

/* How far lane i's ray goes until it meets a part, the scene's units; infinite where it does not. */
static float meet(const vsh_triangles *triangles, unsigned part, const float *ray, size_t n, size_t i) {
    vshi_segment_ray world = {.far = (double)ray[VSHI_RAY_FAR * n + i] / triangles->scale};
    for (size_t axis = 0; axis < 3; ++axis) {
        world.origin[axis] =
            (double)ray[(VSHI_RAY_ORIGIN + axis) * n + i] / triangles->scale + triangles->centre[axis];
        world.direction[axis] = (double)ray[(VSHI_RAY_DIRECTION + axis) * n + i];
    }
    return (float)(vshi_solids_part_meet(triangles->solids, part, &world) * triangles->scale);
}

static void occlude(const struct RTCOccludedFunctionNArguments *args) {
    VSHI_FLOATS;
    float *ray = (float *)args->ray;
    for (size_t i = 0; i < args->N; ++i) {
        if (args->valid[i] == -1 && meet(args->geometryUserPtr, args->primID, ray, args->N, i) < INFINITY) {
            ray[VSHI_RAY_FAR * args->N + i] = -INFINITY;
        }
    }
}

/* Filters ask triangles what is solid; the solids themselves know what they hold. */
static void intersect(const struct RTCIntersectFunctionNArguments *args) {
    VSHI_FLOATS;
    float *ray = (float *)args->rayhit;
    unsigned *hit = (unsigned *)args->rayhit;
    const size_t n = args->N;
    for (size_t i = 0; args->context->filter == NULL && i < n; ++i) {
        const float met =
            args->valid[i] == -1 ? meet(args->geometryUserPtr, args->primID, ray, n, i) : INFINITY;
        if (met < INFINITY) {
            ray[VSHI_RAY_FAR * n + i] = met;
            hit[(VSHI_RAY_ROWS + VSHI_HIT_TRIANGLE) * n + i] = args->primID;
            hit[(VSHI_RAY_ROWS + VSHI_HIT_MESH) * n + i] = args->geomID;
        }
    }
}

bool vshi_triangles_attach_solids(vsh_triangles *triangles) {
    const unsigned number = triangles->first_terrain + (unsigned)triangles->terrain_count;
    return vshi_triangles_attach_own(triangles, number, vshi_solids_part_count(triangles->solids), triangles,
                                     find_bounds, intersect, occlude);
}
