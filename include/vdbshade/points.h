/* Receivers as points, and what shading them counts. */
#ifndef VDBSHADE_POINTS_H
#define VDBSHADE_POINTS_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A texel of a lightmap as one number, the same wherever there are texels: column + 65536 row, both 0 …
 * 65535, row 0 at v = 1; its column, its row, and its place in a plane of `width` columns. */
static inline uint32_t vsh_texel(uint32_t column, uint32_t row) {
    return column + 65536u * row;
}
static inline uint32_t vsh_texel_column(uint32_t texel) {
    return texel % 65536u;
}
static inline uint32_t vsh_texel_row(uint32_t texel) {
    return texel / 65536u;
}
static inline size_t vsh_texel_place(uint32_t texel, int32_t width) {
    return (size_t)vsh_texel_row(texel) * (size_t)width + vsh_texel_column(texel);
}

/* Receivers: a view of the caller's arrays. Points that follow each other and lie within a few voxels of each
 * other share proofs, which makes them several times as fast: sort them along a curve that fills space
 * (query.h does so). adaptive and exact also take from them how many rays a point needs, and where `texels`
 * and normals are given they cast rays for a part of the points of a square of 8 × 8 or 4 × 4 texels that
 * follow each other, lie flat and differ little, and interpolate the others (after hierarchical surpluses:
 * Bungartz and Griebel, "Sparse grids", 2004). A value thus depends, within its error, on the points before
 * and after it; never on threads. */
typedef struct vsh_points {
    size_t count;            /* points */
    const double *positions; /* [count][3], world units */
    const float *normals;   /* [count][3], geometric, of any length, pointing away from the solid; may be NULL
                               for shadows: then there is no start offset, no horizon and no back side */
    const uint32_t *texels; /* [count], each vsh_texel(): what the samplers tell points apart by, so that a
                             * lightmap's noise does not depend on the order of its points, and where they lie
                             * in it; NULL: the points' numbers, and no lightmap */
} vsh_points;

/* Work that was done; calls add to it (to worst_error what is larger), cancelled ones too. Begin with
 * vsh_shade_stats_zero(). */
typedef struct vsh_shade_stats {
    size_t struct_size;
    uint64_t marches;    /* cones and rays that were marched */
    uint64_t samples;    /* samples of the field */
    uint64_t skipped;    /* points turned away from the light, not marched */
    uint64_t certified;  /* cones whose light was proved fully seen or fully hidden (to the field's error) */
    uint64_t unfinished; /* marches that ran out of steps; their value is what was known by then */
    uint64_t invalid;    /* points with a position or normal that is not finite, or a zero normal: NaN */
    uint64_t beyond_reach; /* cones wider somewhere than the field's reach by over 3 %, and taps farther off:
                              they may read too dark, which matters where no rays refine them. Make the field
                              with a larger reach */
    uint64_t rays;         /* rays marched or traced to refine what no cone decided, or by the rays methods */
    uint64_t refined;      /* values that took rays */
    double square_error;   /* adaptive, exact: sum over values of the estimated squared error */
    double ao_square_error; /* what of it is AO's */
    double worst_error;     /* adaptive, exact: the largest error that is estimated of a value */
} vsh_shade_stats;

static inline vsh_shade_stats vsh_shade_stats_zero(void) {
    vsh_shade_stats stats = {sizeof(vsh_shade_stats), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0};
    return stats;
}

#ifdef __cplusplus
}
#endif
#endif
