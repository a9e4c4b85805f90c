/* Marching: many rays against a field, over lanes. */
#ifndef VSHI_MARCH_H
#define VSHI_MARCH_H

#include "field/field.h"

#include <stddef.h>

/* Rays in field space (lengths: finest voxels), as arrays of `count`. */
typedef struct vshi_rays {
    size_t count;
    float *origin[3];
    float *direction[3]; /* unit */
    float *begin;        /* > 0 */
    float *end;
    float *sine;  /* of the cone's half angle; 0: a ray */
    float *stop;  /* a ray ends when its closeness falls to this: -sine, or 0 for what ends at a hit */
    float *close; /* in: upper bound of the closeness, at least `stop`. out: min of it and of h / t along the
                   * ray, h the distance to the surface at t; `stop` or less where the ray ended by it */
    /* for VSHI_MARCH_PROOF, which leaves `close` alone; else NULL */
    float *horizon; /* sine of the direction's height over the receiver's plane; INFINITY without one */
    int8_t *proof;  /* out */
} vshi_rays;

/* How the closeness is taken at a sample. */
enum {
    VSHI_MARCH_PLAIN = 0,        /* h / t */
    VSHI_MARCH_TRIANGULATED = 1, /* the closest miss between two samples (Aaltonen, GDC 2018) */
    VSHI_MARCH_PROOF = 2         /* not at all: whether the cone is free or full for certain */
};

enum { VSHI_UNPROVED = 0, VSHI_PROVED_FREE = 1, VSHI_PROVED_FULL = 2 };

typedef struct vshi_march_stats {
    uint64_t samples;
    uint64_t unfinished; /* rays that took max_steps samples */
} vshi_march_stats;

typedef void vshi_march_fn(const vsh_field *field, const vshi_rays *rays, int32_t kind, int32_t max_steps,
                           vshi_march_stats *stats);

/* One source (lanes.inc), built for each instruction set; all give the same bits. */
vshi_march_fn vshi_march_base;
#if defined(__x86_64__)
vshi_march_fn vshi_march_avx2;
vshi_march_fn vshi_march_avx512;
#endif

/* The fastest of them that this machine runs. */
vshi_march_fn *vshi_march_best(void);

#endif
