/* The planes that a bake works on: the caller's, or where a band holds rows beside its own, planes of them
 * all.
 */
#ifndef VSHI_BAKE_WORK_PLANES_H
#define VSHI_BAKE_WORK_PLANES_H

#include "bake/padding.h"
#include "bake/texels.h"

typedef struct vshi_work_planes {
    vsh_lightmap lightmap; /* [held rows][width] each: to be baked into */
    vshi_plane *planes;    /* of it, those that are not NULL */
    vshi_plane *given;     /* the caller's of the same */
    size_t count;
    size_t padded;  /* the first of them are padded: values, not their errors and not the coverage */
    float **lights; /* [kinds of planes][light_count]: the lightmap's lists */
    float *memory;  /* NULL: the planes are the caller's */
} vshi_work_planes;

/* Bytes that the planes take beside the caller's. */
double vshi_work_planes_bytes(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count);

/* Zeroes all planes. Close also after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_work_planes_open(const vsh_texels *texels, const vsh_lightmap *given, size_t light_count,
                                 vshi_work_planes *work, vsh_error *error);

/* Copies the band's own rows into the caller's planes. */
void vshi_work_planes_copy_back(const vsh_texels *texels, const vshi_work_planes *work);
void vshi_work_planes_close(vshi_work_planes *work);

#endif
