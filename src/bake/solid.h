/* The casters of a field and of the layers beside it as one solid. */
#ifndef VSHI_BAKE_SOLID_H
#define VSHI_BAKE_SOLID_H

#include <stdbool.h>
#include <vdbshade/occluders.h>

typedef struct vshi_solid {
    const vsh_field *fields[VSH_MAX_LAYERS + 1];
    const vsh_spheres *spheres[VSH_MAX_LAYERS];
    const vsh_heights *heights[VSH_MAX_LAYERS];
    size_t field_count, spheres_count, heights_count;
    double voxel_size; /* the largest, world units */
} vshi_solid;

enum { VSHI_SOLID_MOST = 512 }; /* positions at a time */

vshi_solid vshi_solid_of(const vsh_occluders *occluders);

/* Signed distance, world units, to whichever field or sphere is nearest; at most
 * VSHI_SOLID_MOST positions [count][3]. Heights have none. */
void vshi_solid_sample(const vshi_solid *solid, size_t count, const double *positions, float *distances);

/* The same, or less: no more than the distance to the box of any heights, 0 within it. */
void vshi_solid_bound(const vshi_solid *solid, size_t count, const double *positions, float *distances);

/* Whether a position is within heights. */
bool vshi_solid_buries(const vshi_solid *solid, const double position[3]);

#endif
