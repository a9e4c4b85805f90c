/* Parts of a lightmap whose texels share rays of AO. A part shoots the rays of its own texels. Those that are
 * so near its ends that windows over them take in rows of other parts are left: what they shot is kept, and
 * they are estimated once all parts are there. */
#ifndef VSHI_BAKE_AO_CUT_H
#define VSHI_BAKE_AO_CUT_H

#include <stdbool.h>
#include <stdint.h>

/* Rows that are shot by themselves. */
typedef struct vshi_ao_cut {
    int32_t spacing;    /* of texels that share AO; 1: nothing is left */
    int32_t height;     /* of the lightmap, texels */
    int32_t first, end; /* rows of texels */
    uint32_t kinds;     /* what is kept of texels: VSHI_KEEPS_… (bake/ao_kept.h) */
} vshi_ao_cut;

enum { VSHI_AO_CUT_TILE = 8 };

static inline int32_t vshi_ao_cut_begin(const vshi_ao_cut *cut) {
    return cut->first / VSHI_AO_CUT_TILE;
}

static inline int32_t vshi_ao_cut_end(const vshi_ao_cut *cut) {
    return (cut->end + VSHI_AO_CUT_TILE - 1) / VSHI_AO_CUT_TILE;
}

/* Whether a row of tiles is left. Windows reach as many rows of tiles as the widest lattice's spacing up, and
 * from the lower corners of its cells down. */
static inline bool vshi_ao_cut_leaves(const vshi_ao_cut *cut, int32_t row) {
    const int32_t reach = cut->spacing;
    return reach > 1 && ((cut->first > 0 && row < vshi_ao_cut_begin(cut) + reach) ||
                         (cut->end < cut->height && row + 1 + reach >= vshi_ao_cut_end(cut)));
}

/* Rows of texels before `row` that are kept: those that are left on either side of an end, and those that
 * windows over them take in. */
static inline int32_t vshi_ao_cut_kept(const vshi_ao_cut *cut, int32_t row) {
    const int32_t reach = 2 * cut->spacing + 1;
    if (cut->spacing <= 1) {
        return 0;
    }
    int32_t top = cut->first, bottom = cut->end; /* between them none is */
    if (cut->first > 0) {
        top = VSHI_AO_CUT_TILE * (vshi_ao_cut_begin(cut) + reach);
    }
    if (cut->end < cut->height) {
        bottom = VSHI_AO_CUT_TILE * (vshi_ao_cut_end(cut) - reach);
    }
    if (top >= bottom || row <= top) {
        return row - cut->first;
    }
    return top - cut->first + (row > bottom ? row - bottom : 0);
}

#endif
