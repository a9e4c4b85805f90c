/* Texels without a value of their own take their nearest neighbour's. */
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

/* Invalid texels of charts that have nothing to give (see bake/nearest_valid.h) are filled at least this far,
 * texels, since filtering reads across them. */
enum { VSHI_LEAST_INVALID_RADIUS = 8 };

/* Fills each texel of kind k from the valid texel whose centre is nearest (Euclidean), where that is at most
 * radius[k] texels away (0 … VSHI_MAX_PADDING; 0: not filled); of equally near ones from the first in the
 * image. State is left as it is. `filled` [height][width] (NULL: not asked for, else zeros) becomes 1 where
 * texels hold a value then. Takes 2 bytes a texel. Errors: as vshi_store_take(); VSH_ERROR_CANCELLED. */
vsh_result vshi_padding_fill(vshi_store *store, const vsh_run *run, int32_t width, int32_t height,
                             const uint8_t *state, const int32_t radius[VSHI_TEXEL_KINDS],
                             const vshi_plane *planes, size_t plane_count, uint8_t *filled, vsh_error *error);

#endif
