/* Values of AO of texels that share rays: each is the best estimate that its own rays and those of the texels
 * around it allow. */
#ifndef VSHI_BAKE_AO_ESTIMATE_H
#define VSHI_BAKE_AO_ESTIMATE_H

#include "bake/ao_reach.h"
#include "base/parallel.h"

#include <stdatomic.h>

/* What a window says of its texel: the plane, a texel of the map on, and how well it is known. */
typedef struct vshi_ao_plane {
    float slope[2], deviation, curved;
} vshi_ao_plane;

/* Texels of some rows, what they shot, and what follows from it. */
typedef struct vshi_ao_estimates {
    const vsh_points *points;
    const vsh_shade_options *options; /* sampler and max_error */
    const vshi_point_rows *rows;      /* of tiles, those of the map */
    vshi_ao_share share;              /* its lattices are not looked at */
    float *shot;                      /* [points]: shares of each texel's own rays */
    float *open;                      /* [points][3]: bent normals by them; NULL: not asked for */
    float *values, *deviation,
        *bent;           /* [points], the last [points][3]: to be set; values alone need be there */
    vshi_ao_reach reach; /* which rows are wanted */
    /* of its own: */
    uint32_t *at;           /* [height][width]: the share's map */
    vshi_ao_plane *planes;  /* [points] */
    int32_t spacing;        /* of the lattice at work */
    _Atomic size_t refused; /* blocks whose memory was */
    /* of the errors of rows of tiles, in VSHI_SQUARE_UNIT: their squares, and vshi_window_estimate's curved
     */
    uint64_t *square;
    int64_t *curved;
    _Atomic double worst; /* of the rows that are counted, the largest */
    _Atomic uint64_t rays, refined, invalid;
} vshi_ao_estimates;

/* Memory for so many points, in a map of the share's width and height, and for reach->rows, which are set.
 * Close it also after an error. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_ao_estimates_open(vshi_ao_estimates *estimates, size_t count, vsh_error *error);
void vshi_ao_estimates_close(vshi_ao_estimates *estimates);

/* Bytes that it takes at most, where so many threads work on it (0: all). */
double vshi_ao_estimates_bytes(double samples, int32_t width, int32_t rows, int32_t threads);

/* Sets the values of rows that are wanted, once all that their windows take in have shot; of others that are
 * counted those that were known without rays. Errors: VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_ao_estimate(vshi_ao_estimates *estimates, vshi_job *job, vsh_error *error);

/* Adds what is known of them, of the rows that are counted. */
void vshi_ao_estimate_add(const vshi_ao_estimates *estimates, vsh_shade_stats *stats);

#endif
