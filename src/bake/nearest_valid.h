/* Where invalid texels take their values from: the nearest valid texel of their own chart. */
#ifndef VSHI_BAKE_NEAREST_VALID_H
#define VSHI_BAKE_NEAREST_VALID_H

#include "bake/padding.h"
#include "bake/texels.h"

/* How far, texels, and along the chart: six levels of a mip map; bands hold as many rows beside their own. */
enum { VSHI_SPREAD_REACH = 64 };

/* Bytes that finding them takes, each texel that is held. */
enum { VSHI_SPREAD_TEXEL_BYTES = 3 * sizeof(uint32_t) };

typedef struct vshi_spread {
    size_t count;
    uint32_t *texel;  /* [count]: invalid ones, by their places among the texels that are held */
    uint32_t *source; /* [count]: the valid texel that each takes its value from */
} vshi_spread;

/* Finds them: over texels of the same mesh that touch, at edges or corners, at most VSHI_SPREAD_REACH steps.
 * `state` holds VSHI_TEXEL_… of the texels that are held. Free with vshi_spread_free() also after an error.
 * Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_spread_find(const vsh_texels *texels, const uint8_t *state, vshi_spread *spread,
                            vsh_error *error);
void vshi_spread_free(vshi_spread *spread);

/* The same of any texels, [height][width], 2^32 - 3 of them at most: `mesh` is what texels of one chart have
 * in common. */
vsh_result vshi_spread_find_among(size_t width, size_t height, const uint32_t *mesh, const uint8_t *state,
                                  vshi_spread *spread, vsh_error *error);

/* Marks the tile rows held [rows] that the band's own texels take values from. */
void vshi_spread_mark(const vshi_spread *spread, const vsh_texels *texels, uint8_t *rows);

/* Copies the values, and says so in the state, where the source has one. */
void vshi_spread_copy(const vshi_spread *spread, uint8_t *state, const vshi_plane *planes,
                      size_t plane_count);

#endif
