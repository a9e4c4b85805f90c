/* Which texels are to shoot rays of AO, where texels share them and the values of some rows are wanted. */
#ifndef VSHI_BAKE_AO_REACH_H
#define VSHI_BAKE_AO_REACH_H

#include "shade/ao.h"

/* Rows and columns of tiles of 8 texels. */
typedef struct vshi_ao_reach {
    size_t rows, columns;
    uint8_t *wanted;   /* [rows]: 1 where values are */
    uint8_t *lattices; /* [rows][columns]: vshi_ao_share's */
} vshi_ao_reach;

/* Whether a row of texels is estimated: it is wanted, or holds the lower corners of the cells of one that
 * is. */
static inline bool vshi_ao_is_estimated(const vshi_ao_reach *reach, int32_t row) {
    const size_t tile = (size_t)(row / 8);
    return row >= 0 && tile < reach->rows &&
           (reach->wanted[tile] || (row % 8 == 0 && tile > 0 && reach->wanted[tile - 1]));
}

/* Sets the lattices whose tiles shoot whatever comes of it: those that windows over their own lattice reach,
 * which are the fewer rows beside those wanted the finer a lattice is. */
void vshi_ao_reach_first(vshi_ao_reach *reach, int32_t spacing);

/* Adds those whose tiles shoot for rows of tiles begin … end - 1 alone, whatever is beside them: rays and
 * levels of their texels are then those of the whole lightmap. */
void vshi_ao_reach_own(vshi_ao_reach *reach, int32_t spacing, size_t begin, size_t end);

/* Once those have shot: windows over a wide lattice also take in its texels that were left to finer ones.
 * Sets the lattices that are to shoot for these, and no others; false where there are none. */
bool vshi_ao_reach_further(vshi_ao_reach *reach, const vshi_ao_share *share);

#endif
