/* Samples that are lifted off their triangles, for their own facets not to hide light from them (surface.h),
 * and where they are not. */
#ifndef VSHI_BAKE_LIFT_H
#define VSHI_BAKE_LIFT_H

#include "bake/origins.h"
#include "light/view.h"

/* Where a sample stands: on its triangle. */
static inline vshi_vec vshi_lift_foot(const vsh_texels *texels, size_t sample) {
    return vshi_sub(vshi_vec_of(texels->position + 3 * sample), vshi_vec_off(texels->lift + 3 * sample));
}

/* Marks in dropped[all samples] those of first … last - 1, at most VSHI_ORIGIN_BLOCK, whose lift brings them
 * through one of `triangles`, or close to it. */
void vshi_lift_drop(const vsh_texels *texels, const vsh_triangles *triangles, size_t first, size_t last,
                    uint8_t *dropped);

/* A light, or (NULL) AO, that samples are lifted for. */
typedef struct vshi_lift_light {
    const vsh_light *light;
    vshi_light_place place; /* of the light, in world space */
} vshi_lift_light;

vshi_lift_light vshi_lift_light_of(const vsh_light *light);

/* Where a sample's rays to it begin. */
vshi_vec vshi_lift_place(const vsh_texels *texels, const vshi_lift_light *light, size_t sample, bool dropped);

/* Sets where rays to a light begin, origins->surface, or rays of AO where it is NULL. Facets hide light from
 * their neighbours where it comes in over the smooth surface but not over the facet: where all of a light is
 * well above a sample's triangle its rays begin on that, because a lift also moves the shadows of all else.
 * Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_lift_for(const vsh_texels *texels, const vsh_light *light, const vsh_run *run,
                         vshi_origins *origins, vsh_error *error);

#endif
