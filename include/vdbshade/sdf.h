/* Procedural signed distance fields: a tree of shapes as a plain array of nodes. */
#ifndef VDBSHADE_SDF_H
#define VDBSHADE_SDF_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Shapes stand at the origin and operations combine earlier nodes; then the node's own scale, rotation and
 * translation are applied, in that order. Sources: I. Quilez, "distance functions" (2008 …) and "exact SDF of
 * a capped cone" (2018) for the shapes, "smooth minimum" (2013) for VSH_SDF_SMOOTH_UNION. */
enum {
    VSH_SDF_SPHERE = 0,       /* radius */
    VSH_SDF_BOX = 1,          /* size: half edges; grown by rounding on every side */
    VSH_SDF_TORUS = 2,        /* around y: radius of the ring, minor_radius of the tube */
    VSH_SDF_PLANE = 3,        /* slab of half edges size[0], size[2], size[1] thick, its top at y = 0 */
    VSH_SDF_CAPSULE = 4,      /* along y: half height size[1] of the core, radius */
    VSH_SDF_CYLINDER = 5,     /* along y: half height size[1], radius */
    VSH_SDF_CONE = 6,         /* along y: half height size[1], radius at -y, minor_radius at +y (0: a tip) */
    VSH_SDF_UNION = 7,        /* left, right */
    VSH_SDF_INTERSECTION = 8, /* left, right */
    VSH_SDF_SUBTRACTION = 9,  /* left without right */
    VSH_SDF_SMOOTH_UNION = 10 /* left, right, blended over a distance of `smoothing` */
};

/* One node. All numbers are finite, lengths in world units before `scale`. What a shape does not name is
 * ignored. */
typedef struct vsh_sdf_node {
    int32_t shape;         /* VSH_SDF_… */
    int32_t left;          /* operations: index of the first operand, smaller than this node's own index */
    int32_t right;         /* operations: index of the second operand, smaller than this node's own index */
    double size[3];        /* > 0 */
    double radius;         /* > 0 */
    double minor_radius;   /* > 0; cone: ≥ 0 */
    double rounding;       /* ≥ 0 */
    double smoothing;      /* > 0 */
    double scale;          /* > 0 */
    double rotation[4];    /* quaternion x, y, z, w; any length but 0 */
    double translation[3]; /* world units, in the space of the operation that uses the node */
} vsh_sdf_node;

/* A unit sphere at the origin, to be changed by the caller: scale 1, no rotation. */
static inline vsh_sdf_node vsh_sdf_node_default(void) {
    vsh_sdf_node node = {
        VSH_SDF_SPHERE, -1, -1, {1.0, 1.0, 1.0}, 1.0, 0.25, 0.0, 0.1, 1.0, {0.0, 0.0, 0.0, 1.0},
        {0.0, 0.0, 0.0}};
    return node;
}

/* A tree: the last node is its root, every other node is the operand of exactly one operation, and no path
 * from the root is longer than 2048 nodes. A view; nothing is owned. */
typedef struct vsh_sdf {
    const vsh_sdf_node *nodes; /* [node_count] */
    size_t node_count;         /* 1 … 65536 */
} vsh_sdf;

/* Checks every node, and the tree. Errors: VSH_ERROR_INPUT, naming node, field, value and limit (sdf NULL is
 * a tree of 0 nodes); VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_sdf_check(const vsh_sdf *sdf, vsh_error *error);

/* Signed distance at a world position, negative inside; NaN for a position that is not finite. The tree must
 * have passed vsh_sdf_check(). Exact for the shapes and outside unions; inside unions, in intersections,
 * subtractions and smooth unions a bound (never farther than the surface). */
VSH_API double vsh_sdf_distance(const vsh_sdf *sdf, const double position[3]);

/* A box around the surface, world units; not always the smallest one. The tree must have passed
 * vsh_sdf_check(). */
VSH_API void vsh_sdf_bounds(const vsh_sdf *sdf, double bounds_min[3], double bounds_max[3]);

#ifdef __cplusplus
}
#endif
#endif
