/* Marching: many rays against a field, over lanes. */
#ifndef VSHI_MARCH_H
#define VSHI_MARCH_H

#include "field/field.h"

#include <stdbool.h>
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
    /* for VSHI_MARCH_PROOF and VSHI_MARCH_BEAM, which leave `close` alone; else NULL */
    float *horizon; /* of proofs: sine of the direction's height over the receiver's plane; INFINITY without
                     * one */
    int8_t *proof;  /* out */
    float *wide;    /* of beams: radius at t = 0, to which that of the cone is added; see VSHI_MARCH_GROWN */
    float *pace;    /* of VSHI_MARCH_JITTERED: 0 … 1 */
    float *deeper;  /* of beams whose cones are to come to a solid ball where one makes the beam full, else 0:
                     * how much larger than the beam it is, parts of the cone's radius there, or of a voxel
                     * where that is more */
    float *clear;   /* out, of beams: the t from which on it is free, past `end` or infinite: nowhere; of a
                     * full one where it is */
} vshi_rays;

/* How the closeness is taken at a sample. */
enum {
    VSHI_MARCH_PLAIN = 0,        /* h / t */
    VSHI_MARCH_TRIANGULATED = 1, /* the closest miss between two samples (Aaltonen, GDC 2018) */
    VSHI_MARCH_PROOF = 2,        /* not at all: whether the cone is free or full for certain */
    VSHI_MARCH_BEAM = 3,         /* nor here: from where on a beam of them is free, or whether it is full */
    VSHI_MARCH_GROWN = 4,        /* (h - wide) / t: of casters grown by `wide` */
    VSHI_MARCH_JITTERED = 5      /* h / t, after steps of `pace` of what is free */
};

enum { VSHI_UNPROVED = 0, VSHI_PROVED_FREE = 1, VSHI_PROVED_FULL = 2 };

typedef struct vshi_march_stats {
    uint64_t samples;
    uint64_t unfinished; /* rays that took max_steps samples */
} vshi_march_stats;

typedef void vshi_march_fn(const vsh_field *field, const vshi_rays *rays, int32_t kind, int32_t max_steps,
                           vshi_march_stats *stats);

/* Whether each of the balls of `radius` around `count` points of field space is free for certain; `radius` is
 * within the finest level's band. */
typedef void vshi_balls_fn(const vsh_field *field, size_t count, float *const centre[3], float radius,
                           bool *is_free);

/* One source (lanes.inc), built for each instruction set; all give the same bits. */
typedef struct vshi_kernel {
    vshi_march_fn *march;
    vshi_balls_fn *balls;
} vshi_kernel;

extern const vshi_kernel vshi_kernel_base;
/* For so many rays, in as many lanes: what the others hand them to, as empty lanes cost what full ones do. It
 * has one build: a lone ray waits for memory, not for arithmetic. */
#define VSHI_KERNEL_FEW 4
extern const vshi_kernel vshi_kernel_few;
#if defined(__x86_64__)
extern const vshi_kernel vshi_kernel_avx2;
extern const vshi_kernel vshi_kernel_avx512;
#endif

/* That of a VSH_ISA_… which this machine has; base.h says which. */
const vshi_kernel *vshi_kernel_of(int32_t isa);

#endif
