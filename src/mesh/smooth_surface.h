/* Where a point of a triangle lies in the world and which way it faces. */
#ifndef VSHI_MESH_SMOOTH_SURFACE_H
#define VSHI_MESH_SMOOTH_SURFACE_H

#include "base/vec.h"

#include <vdbshade/mesh.h>

/* One triangle, ready to be evaluated. Corners are anticlockwise from outside. */
typedef struct vshi_surface {
    vshi_vec corner[3];
    vshi_vec normal[3]; /* of the corners, unit; the geometric one where the mesh has none that serves */
    vshi_vec geometric; /* unit */
    bool lifts[3];      /* whether the tangent plane at the corner lifts samples */
    bool smooth;
    bool mirrored; /* corners 1 and 2 have changed places */
} vshi_surface;

/* False where the triangle has no area. */
bool vshi_surface_set(const vsh_mesh *mesh, size_t triangle, vshi_surface *surface);

/* Position and normal at barycentric weights of the triangle's corners as the mesh's indices give them, and
 * how far the position is off the triangle. */
void vshi_surface_at(const vshi_surface *surface, const double weight[3], vshi_vec *position,
                     vshi_vec *normal, vshi_vec *lift);

/* The direction in which a triangle's u grows, unit, and 1 or -1: the side of normal × tangent on which v
 * grows. A zero vector where the UVs have no area. */
vshi_vec vshi_surface_tangent(const vsh_mesh *mesh, size_t triangle, double *handedness);

#endif
