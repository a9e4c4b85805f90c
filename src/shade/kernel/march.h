/* Marching: many rays against a field, over lanes. */
#pragma once

#include "field/field.h"

#include <stdbool.h>
#include <stddef.h>

enum { VSHI_CHUNK = 1024 }; /* rays: some 75 KB, which stay in the second cache */

/* Rays on their way to the kernel, in field space (lengths: finest voxels). */
typedef struct vshi_chunk {
    size_t count;
    uint32_t owner[VSHI_CHUNK]; /* the caller's number of each ray */
    float origin[3][VSHI_CHUNK];
    float direction[3][VSHI_CHUNK]; /* unit */
    float begin[VSHI_CHUNK];        /* > 0 */
    float end[VSHI_CHUNK];
    float sine[VSHI_CHUNK]; /* of the cone's half angle; 0: a ray */
    float stop[VSHI_CHUNK]; /* a ray ends when its closeness falls to this: -sine, or 0 for rays that end at a
                             * hit */
    /* in: upper bound of the closeness, at least `stop`. out: min of it and of h / t along the ray, h the
     * distance to the surface at t; `stop` or less if the ray ended by it. Proofs and beams do not change it
     */
    float close[VSHI_CHUNK];
    float horizon[VSHI_CHUNK]; /* of proofs: sine of the direction's height over the receiver's plane;
                                * INFINITY without one */
    float wide[VSHI_CHUNK]; /* of beams: radius at t = 0, added to that of the cone; see VSHI_MARCH_GROWN */
    float pace[VSHI_CHUNK]; /* of VSHI_MARCH_JITTERED: 0 … 1 */
    /* of beams whose cones must meet the solid ball that makes the beam full, else 0: how much larger than
     * the beam the ball is, as a share of the cone's radius there, at least of a voxel */
    float deeper[VSHI_CHUNK];
    float clear[VSHI_CHUNK];  /* out, of beams: the beam is free from this t on; past `end` or infinite:
                               * nowhere. For a full beam, the t where it is full */
    int8_t proof[VSHI_CHUNK]; /* out, of proofs and beams */
} vshi_chunk;

/* How a sample gives the closeness. */
enum {
    VSHI_MARCH_PLAIN = 0,        /* h / t */
    VSHI_MARCH_TRIANGULATED = 1, /* the closest miss between two samples (Aaltonen, GDC 2018) */
    VSHI_MARCH_PROOF = 2,        /* none: whether the cone is certainly free or full */
    VSHI_MARCH_BEAM = 3,         /* none: from where on a beam of cones is free, or whether it is full */
    VSHI_MARCH_GROWN = 4,        /* (h - wide) / t: of casters grown by `wide` */
    VSHI_MARCH_JITTERED = 5      /* h / t, after steps shortened to `pace` */
};

enum { VSHI_UNPROVED = 0, VSHI_PROVED_FREE = 1, VSHI_PROVED_FULL = 2 };

typedef struct vshi_march_stats {
    uint64_t samples;
    uint64_t unfinished; /* rays that took max_steps samples */
} vshi_march_stats;

typedef void vshi_march_fn(const vsh_field *field, vshi_chunk *rays, int32_t kind, int32_t max_steps,
                           vshi_march_stats *stats);

/* Whether each ball of `radius` around `count` points of field space is certainly free. The finest level's
 * band holds `radius`. */
typedef void vshi_balls_fn(const vsh_field *field, size_t count, float *const centre[3], float radius,
                           bool *is_free);

/* One source (lanes.inc), built for each instruction set; all give the same bits. */
typedef struct vshi_kernel {
    vshi_march_fn *march;
    vshi_balls_fn *balls;
} vshi_kernel;

extern const vshi_kernel vshi_kernel_base;
/* For at most this many rays, in as many lanes. Other kernels pass such calls on, as empty lanes cost as much
 * as full ones. One build is enough: a lone ray waits for memory, not for arithmetic. */
#define VSHI_KERNEL_FEW 4
extern const vshi_kernel vshi_kernel_few;
#if defined(__x86_64__)
extern const vshi_kernel vshi_kernel_avx2;
extern const vshi_kernel vshi_kernel_avx512;
#endif

/* The kernel of a VSH_ISA_… that this machine has; see base.h. */
const vshi_kernel *vshi_kernel_of(int32_t isa);
