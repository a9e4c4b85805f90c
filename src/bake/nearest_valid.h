/* Where invalid texels take their values from: the nearest valid texel of their own chart. */
#ifndef VSHI_BAKE_NEAREST_VALID_H
#define VSHI_BAKE_NEAREST_VALID_H

#include "bake/padding.h"

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

#endif
