/* Where the shadow rays of a sample begin. They begin on its triangle, or are lifted towards the smooth
 * surface that the vertex normals describe (smooth_surface.h). Then the facets of a smooth mesh do not hide a
 * light that is above the smooth surface. AO needs no lift: it leaves out the directions below the face. */
#ifndef VSHI_BAKE_LIFT_H
#define VSHI_BAKE_LIFT_H

#include "bake/origins.h"
#include "light/view.h"

/* The sample's position on its triangle. */
static inline vshi_vec vshi_sample_foot(const vsh_texels *texels, size_t sample) {
    return vshi_sub(vshi_vec_of(texels->position + 3 * sample), vshi_vec_off(texels->lift + 3 * sample));
}

/* Samples and the light that they are lifted for. */
typedef struct vshi_lifter {
    const vsh_texels *texels;
    const vsh_occluders *occluders; /* their triangles limit the lift */
    const vsh_light *light;         /* NULL: AO, which lifts nothing */
    vshi_light_place place;         /* of the light, in world space */
} vshi_lifter;

vshi_lifter vshi_lifter_open(const vsh_texels *texels, const vsh_occluders *occluders,
                             const vsh_light *light);

/* Whether a part of the light lies below the plane of the sample's triangle. */
bool vshi_light_is_cut(const vshi_lifter *lifter, size_t sample);

/* Finds the lift of a sample for the light: texels->lift times a share from 0 to 1. */
vshi_vec vshi_lift_find(const vshi_lifter *lifter, size_t sample);

/* Sets origins->start, where the rays to a light begin: on the triangles if `traced`, else at
 * origins->position; plus the lift. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lift_origins(const vshi_lifter *lifter, bool traced, const vsh_run *run,
                             vshi_origins *origins, vsh_error *error);

#endif
