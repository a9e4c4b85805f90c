/* The casters of a field and of the layers beside it as one solid. */
#ifndef VSHI_BAKE_SOLID_H
#define VSHI_BAKE_SOLID_H

#include <vdbshade/shade.h>

typedef struct vshi_solid {
    const vsh_field *fields[VSH_MAX_LAYERS + 1];
    size_t count;
    double voxel_size; /* the largest, world units */
} vshi_solid;

enum { VSHI_SOLID_MOST = 512 }; /* positions at a time */

/* `options` are resolved ones. Errors: VSH_ERROR_ARGUMENT, of the layers. */
vsh_result vshi_solid_of(const vsh_field *field, const vsh_shade_options *options, vshi_solid *solid,
                         vsh_error *error);

/* vsh_field_sample() of whichever is nearest, at most VSHI_SOLID_MOST positions [count][3]. */
void vshi_solid_sample(const vshi_solid *solid, size_t count, const double *positions, float *distances);

#endif
