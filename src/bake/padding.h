/* Fills texels that have no value of their own, so that no mip level reads background. Invalid texels copy
 * the nearest valid texel of their chart, texels around charts copy the nearest valid texel, and the rest
 * take means. */
#ifndef VSHI_BAKE_PADDING_H
#define VSHI_BAKE_PADDING_H

#include "base/job.h"
#include "base/store.h"

#include <stddef.h>
#include <stdint.h>

/* What a texel is; kept apart from its value, so that darkness is no hole. */
enum {
    VSHI_TEXEL_EMPTY = 0,   /* no chart */
    VSHI_TEXEL_VALID = 1,   /* has a value; the only ones that are copied from */
    VSHI_TEXEL_INVALID = 2, /* in a chart, but without a value */
    VSHI_TEXEL_FILLED = 3,  /* the same, but it has been given that of a texel of its chart */
    VSHI_TEXEL_KINDS = 4
};

enum { VSHI_MAX_PADDING = 4096 }; /* texels; distances within a column are held in 16 bits */

/* A plane of the image: [height][width][channels]. */
typedef struct vshi_plane {
    float *values;
    size_t channels;
} vshi_plane;

/* Invalid texels of charts that have nothing to give are filled at least this far,
 * texels, since filtering reads across them. */
enum { VSHI_LEAST_INVALID_RADIUS = 8 };

/* Fills each texel of kind k from the valid texel whose centre is nearest (Euclidean), where that is at most
 * radius[k] texels away (0 … VSHI_MAX_PADDING; 0: not filled); of equally near ones from the first in the
 * image. State is left as it is. `filled` [height][width] (NULL: not asked for, else zeros) becomes 1 where
 * texels hold a value then. Takes 2 bytes a texel. Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
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

/* Finds them: over texels of the same mesh that touch, at edges or corners, at most VSHI_SPREAD_REACH steps.
 * `mesh` and `state`, VSHI_TEXEL_…, are [height][width], 2^32 - 3 texels at most. Takes 4 bytes a texel
 * meanwhile. Free with vshi_spread_free(). Errors: as vshi_store_take(), which leave what was taken to the
 * store. */
vsh_result vshi_spread_find(vshi_store *store, size_t width, size_t height, const uint32_t *mesh,
                            const uint8_t *state, vshi_spread *spread, vsh_error *error);
void vshi_spread_free(vshi_store *store, vshi_spread *spread);

/* Copies the values, and says so in the state, where the source has one. */
void vshi_spread_copy(const vshi_spread *spread, uint8_t *state, const vshi_plane *planes,
                      size_t plane_count);

/* Fills every texel whose `filled` is 0 with the mean of the filled texels in the smallest aligned square (2
 * × 2, 4 × 4, 8 × 8 …) around it that has any. Box-filtered mip levels then hold means of baked values only.
 * A plane without filled texels stays as it is. Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_pull_push(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                          uint8_t *filled, const vshi_plane *planes, size_t plane_count, vsh_error *error);

#endif
