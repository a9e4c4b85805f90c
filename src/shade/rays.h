/* A chunk of cones on their way to the kernel: set up in double precision, marched, read back. */
#ifndef VSHI_RAYS_H
#define VSHI_RAYS_H

#include "base/vec.h"
#include "shade/kernel/march.h"

#include <stdbool.h>
#include <vdbshade/shade.h>

enum {
    VSHI_CHUNK = 1024, /* rays: some 70 KB, which stay in the second cache */
    VSHI_RAY_FLOATS = 15
};

typedef struct vshi_chunk {
    vshi_rays rays;
    uint32_t owner[VSHI_CHUNK]; /* what each ray is for, as the caller numbers it */
    float memory[VSHI_RAY_FLOATS][VSHI_CHUNK];
    int8_t proof[VSHI_CHUNK];
} vshi_chunk;

/* A cone in field space. */
typedef struct vshi_cone {
    vshi_vec origin;
    vshi_vec direction; /* unit */
    double begin;       /* what is before is free; 0 where nothing is known */
    double end;         /* what is after is free; may be infinite, or before `begin` */
    double whole;       /* of shadows: the end before anything was proved; else 0 */
    double sine;        /* of the half angle; 0: a ray */
    double close;       /* what is known of its closeness already: at most `sine`; 1 for rays */
    double stop;
    double horizon; /* of proofs: see vshi_rays */
    double wide;    /* of beams: radius at the origin; else 0 */
    double deeper;  /* of beams: see vshi_rays; else 0 */
} vshi_cone;

/* Empties a chunk. */
void vshi_chunk_clear(vshi_chunk *chunk);

/* Adds a cone as it is. */
void vshi_chunk_push(vshi_chunk *chunk, const vshi_cone *cone, uint32_t owner);

/* Adds a cone where it can meet the casters' bounds, or returns false: its closeness then stays as it is. Of
 * an unknown field none is added. */
bool vshi_chunk_add(vshi_chunk *chunk, const vsh_field *field, const vshi_cone *cone, uint32_t owner,
                    vsh_shade_stats *stats);

/* Marches a chunk's rays, VSHI_MARCH_…, and counts the work. Proofs that are not finished prove nothing, so
 * they do not count as unfinished. */
void vshi_chunk_march(vshi_chunk *chunk, const vshi_kernel *kernel, const vsh_field *field, int32_t kind,
                      int32_t max_steps, vsh_shade_stats *stats);

/* Fraction of a disc light that is seen past a straight edge at x of its radius from the centre, for x in
 * [-1, 1]: the circular segment 1/2 + (x √(1 - x²) + asin x) / π. Its own arithmetic, so that no libm shows
 * in the bits. */
double vshi_segment(double x);

/* Visible fraction of a cone of `sine` and `closeness` (h / t): the closeness is the sine of the angle
 * between the axis and the occluder's edge, and the disc's radius and the edge's offset are the angles'
 * tangents. */
double vshi_cone_visibility(double closeness, double sine);

/* Standard error of the share of `taken` rays of a VSH_SAMPLER_… that an edge across the disc leaves, of
 * which `lit` were where the `expected` share were to be (a half where nothing is): c sqrt(p (1 - p)) n^-3/4,
 * for white noise n^-1/2, measured over edges of all places and directions (test_sampler). */
double vshi_rays_deviation(int32_t sampler, int32_t lit, int32_t taken, double expected);

/* Standard error of the share of `taken` rays, of which `lit` were, where those of the points around have so
 * many of so many. An edge across the disc cuts as many of the rays' cells as its chord is long, and that
 * falls more slowly towards the rim than the part beyond it does: c (p (1 - p))^1/3 n^-3/2 is its variance
 * (test_sampler), or the binomial's p (1 - p) / n where that is less. Where all rays agree the error is what
 * they may have missed. */
double vshi_rays_error(int32_t sampler, int32_t lit, int32_t taken, double lit_around, double taken_around);

/* Where the neighbours' share is taken for a point's, errors come out larger by so much: measured on the
 * seeds' floor, where the estimate is right by it to a tenth. */
#define VSHI_BORROWED 1.2

/* Unit normal and direction in field space. */
static inline vshi_vec vshi_direction_to_field(const vsh_field *field, vshi_vec direction) {
    return vshi_unit(vshi_transform_vector(field->to_field, direction));
}

#endif
