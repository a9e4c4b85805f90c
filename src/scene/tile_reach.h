/* What the light of a scene and the open sky around its receivers can meet. */
#ifndef VSHI_SCENE_TILE_REACH_H
#define VSHI_SCENE_TILE_REACH_H

#include "light/view.h"

#include <vdbshade/scene.h>

/* World space; low > high: nothing. */
typedef struct vshi_world_box {
    double low[3], high[3];
} vshi_world_box;

extern const vshi_world_box vshi_empty_box;

bool vshi_box_is_empty(const vshi_world_box *box);
void vshi_box_grow(vshi_world_box *box, const vshi_world_box *by);

/* The box around a box after a transform. */
vshi_world_box vshi_box_moved(const vshi_world_box *box, const double transform[12]);

/* Which way rays go. */
typedef struct vshi_reach {
    vshi_light_place *lights; /* [light_count], as wide as the softest layer sees them */
    size_t light_count;
    double distance; /* of AO; 0: there is none */
    bool open;       /* rays go over the whole sky, however far */
} vshi_reach;

/* Errors: VSH_ERROR_MEMORY. Free with vshi_reach_free(), after an error too. */
vsh_result vshi_reach_make(const vsh_scene *scene, vshi_reach *reach, vsh_error *error);
void vshi_reach_free(vshi_reach *reach);

/* A bound on how much of any light, or of the open sky, something in `caster` hides from any point of
 * `receiver`, 0 … 1; INFINITY where it may touch it. 0: no ray meets it. */
double vshi_reach_share(const vshi_reach *reach, const vshi_world_box *receiver,
                        const vshi_world_box *caster);

/* A box around all within `world` that rays from `receiver` and cones twice as wide around them reach. */
vshi_world_box vshi_reach_region(const vshi_reach *reach, const vshi_world_box *receiver,
                                 const vshi_world_box *world);

#endif
