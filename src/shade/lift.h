/* Where the shadow rays of a point on a mesh begin. They begin on its triangle, or are lifted towards the
 * smooth surface that the vertex normals describe (mesh/mesh.h). Then the facets of a smooth mesh
 * do not hide a light that is above the smooth surface. AO needs no lift: it leaves out the directions below
 * the face. */
#ifndef VSHI_SHADE_LIFT_H
#define VSHI_SHADE_LIFT_H

#include "light/view.h"

#include <vdbshade/occluders.h>

/* A point on a triangle. World space. */
typedef struct vshi_lift_point {
    vshi_vec foot;         /* on the triangle */
    vshi_vec lift;         /* from there to the smooth surface */
    vshi_vec face, normal; /* unit: of the triangle, of the smooth surface */
} vshi_lift_point;

/* A light that points are lifted for. */
typedef struct vshi_lifter {
    const vsh_occluders *occluders; /* their triangles limit the lift */
    const vsh_light *light;         /* NULL: AO, which lifts nothing */
    vshi_light_place place;         /* of the light, in world space */
} vshi_lifter;

vshi_lifter vshi_lifter_open(const vsh_occluders *occluders, const vsh_light *light);

/* Whether a part of the light lies below the plane of the point's triangle. */
bool vshi_light_is_cut(const vshi_lifter *lifter, const vshi_lift_point *point);

/* Finds the lift of a point for the light: point->lift times a share from 0 to 1. */
vshi_vec vshi_lift_find(const vshi_lifter *lifter, const vshi_lift_point *point);

#endif
