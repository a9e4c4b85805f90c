/* The silhouettes that hide parts of cones. */
#ifndef VSHI_SILHOUETTE_H
#define VSHI_SILHOUETTE_H

#include "field/field.h"

#include <stddef.h>

enum { VSHI_SILHOUETTES = 512 }; /* at most at once */

/* Cones that a march found neither free nor full, in field space, as arrays of `count`. */
typedef struct vshi_silhouettes {
    size_t count;
    float *origin[3];
    float *direction[3]; /* unit */
    float *sine;         /* of the half angle, > 0 */
    float *end;          /* nothing casts beyond */
    float *close, *at;   /* the least h / t, and the t > 0 where a march read it */
    float *x;    /* out: where an edge crosses the disc, parts of its radius from the axis: 1 and more, all
                  * is seen, -1 and less, nothing */
    float *more; /* out: fraction of the disc that is seen beside what a straight edge there leaves */
} vshi_silhouettes;

typedef void vshi_silhouettes_fn(const vsh_field *field, const vshi_silhouettes *cones);

/* The kernels' own: vshi_kernel has them. */
vshi_silhouettes_fn vshi_silhouettes_base, vshi_silhouettes_few, vshi_silhouettes_avx2,
    vshi_silhouettes_avx512;

#endif
