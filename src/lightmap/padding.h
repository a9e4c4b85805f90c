/* Fills texels without a value, so that no mip level reads background. Invalid texels copy the nearest valid
 * texel of their chart, texels around charts the nearest valid texel, and the rest get means. */
#pragma once

#include "base/job.h"
#include "base/memory.h"

#include <stddef.h>
#include <stdint.h>

/* The kind of a texel. Its value cannot tell: a dark texel is no hole. */
enum {
    VSHI_TEXEL_EMPTY = 0,   /* no chart */
    VSHI_TEXEL_VALID = 1,   /* has a value; others copy only from these */
    VSHI_TEXEL_INVALID = 2, /* in a chart, but without a value */
    VSHI_TEXEL_FILLED = 3,  /* in a chart, with the value of another texel of it */
    VSHI_TEXEL_KINDS = 4
};

enum { VSHI_MAX_PADDING = 4096 }; /* texels; 16 bits hold distances within a column */

/* A plane of the image: [height][width][channels]. */
typedef struct vshi_plane {
    float *values;
    size_t channels;
} vshi_plane;

/* Charts without values are filled at least this far, texels, since filtering reads across them. */
enum { VSHI_LEAST_INVALID_RADIUS = 8 };

/* Fills each texel of kind k from the nearest valid texel (Euclidean), at most radius[k] texels away (0 …
 * VSHI_MAX_PADDING; 0: not filled). Of equally near ones the first in the image counts. State stays as it is.
 * `filled` [height][width] (NULL, else zeros) becomes 1 for texels with a value. Uses 2 bytes a texel.
 * Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_padding_fill(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                             const uint8_t *state, const int32_t radius[VSHI_TEXEL_KINDS],
                             const vshi_plane *planes, size_t plane_count, uint8_t *filled, vsh_error *error);

/* Reach in texels along the chart: six levels of a mip map. */
enum { VSHI_SPREAD_REACH = 64 };

typedef struct vshi_spread {
    size_t count;
    uint32_t *texel;  /* [count]: places of invalid texels */
    uint32_t *source; /* [count]: the valid texel that each takes its value from */
} vshi_spread;

/* Finds sources over texels of the same mesh that touch, at edges or corners, at most VSHI_SPREAD_REACH
 * steps. `mesh` and `state`, VSHI_TEXEL_…, are [height][width], at most 2^32 - 3 texels. Uses 4 bytes a texel
 * while it runs. Free with vshi_spread_free(). Errors: as vshi_store_take(); the store then keeps the arrays.
 */
vsh_result vshi_spread_find(vshi_store *store, size_t width, size_t height, const uint32_t *mesh,
                            const uint8_t *state, vshi_spread *spread, vsh_error *error);
void vshi_spread_free(vshi_store *store, vshi_spread *spread);

/* Copies the values of valid sources, and sets the state of these texels to VSHI_TEXEL_FILLED. */
void vshi_spread_copy(const vshi_spread *spread, uint8_t *state, const vshi_plane *planes,
                      size_t plane_count);

/* Fills every texel whose `filled` is 0 with the mean of the filled texels in the smallest aligned square (2
 * × 2, 4 × 4, 8 × 8 …) around it that holds one. Box-filtered mip levels then hold means of baked values
 * only. A plane without filled texels stays as it is. Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_pull_push(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                          uint8_t *filled, const vshi_plane *planes, size_t plane_count, vsh_error *error);
