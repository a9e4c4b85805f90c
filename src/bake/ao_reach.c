#include "bake/ao_reach.h"

#include <string.h>

enum { TILE = 8, REACH = VSHI_WINDOW_REACH };

/* Tiles of wider lattices reach so much farther that those over a tile, and over the row behind it, are among
 * them. */
void vshi_ao_reach_first(vshi_ao_reach *reach, int32_t spacing) {
    memset(reach->lattices, 0, reach->rows * reach->columns);
    for (size_t row = 0; row < reach->rows; ++row) {
        for (int32_t s = spacing; reach->wanted[row] && s > 0; s /= 2) {
            const size_t side = TILE * (size_t)s, beside = REACH * (size_t)s;
            const size_t top = TILE * row > beside ? TILE * row - beside : 0;
            const size_t first = top / side * (size_t)s;
            const size_t last = ((TILE * (row + 1) + beside) / side + 1) * (size_t)s;
            for (size_t k = first * reach->columns;
                 k < last * reach->columns && k < reach->rows * reach->columns; ++k) {
                reach->lattices[k] |= (uint8_t)s;
            }
        }
    }
}

/* Marks the tile of a lattice that holds a texel of the map. */
static void mark(vshi_ao_reach *reach, int32_t spacing, size_t column, size_t row) {
    const size_t side = (size_t)spacing;
    const size_t left = column / TILE / side * side, top = row / TILE / side * side;
    if (left >= reach->columns || top >= reach->rows ||
        (reach->lattices[top * reach->columns + left] & spacing) != 0) {
        return;
    }
    for (size_t y = top; y < top + side && y < reach->rows; ++y) {
        for (size_t x = left; x < left + side && x < reach->columns; ++x) {
            reach->lattices[y * reach->columns + x] |= (uint8_t)spacing;
        }
    }
}

/* Marks what a texel that windows over a lattice take in, and that nothing was found of, may shoot by. */
static void mark_open(vshi_ao_reach *reach, const vshi_ao_share *share, int32_t spacing, int32_t column,
                      int32_t row) {
    const uint32_t at = vshi_texel_at(&share->map, column, row);
    if (at > 0 && share->level[at - 1] == VSHI_AO_OPEN_LEVEL) {
        for (int32_t s = spacing / 2; s > 0; s /= 2) {
            mark(reach, s, (size_t)column, (size_t)row);
        }
    }
}

/* What the window of an estimated texel takes in of rows that are not wanted. */
static void look_around(vshi_ao_reach *reach, const vshi_ao_share *share, int32_t spacing, int32_t column,
                        int32_t row) {
    for (int32_t y = row - REACH * spacing; y <= row + REACH * spacing; y += spacing) {
        if (y < 0 || y >= share->map.height || reach->wanted[y / TILE]) {
            continue;
        }
        for (int32_t x = column - REACH * spacing; x <= column + REACH * spacing; x += spacing) {
            mark_open(reach, share, spacing, x, y);
        }
    }
}

/* Wider lattices over what is marked, and over the texels behind it in its square. */
static void mark_wider(vshi_ao_reach *reach, int32_t spacing) {
    for (int32_t s = 1; s < spacing; s *= 2) {
        const size_t step = (size_t)s;
        for (size_t row = 0; row < reach->rows; row += step) {
            for (size_t column = 0; column < reach->columns; column += step) {
                if ((reach->lattices[row * reach->columns + column] & s) == 0) {
                    continue;
                }
                for (size_t k = 0; k < 4; ++k) {
                    const size_t x = column + (k & 1) * step, y = row + (k >> 1) * step;
                    if (x / (size_t)spacing == column / (size_t)spacing &&
                        y / (size_t)spacing == row / (size_t)spacing) {
                        mark(reach, 2 * s, TILE * x, TILE * y);
                    }
                }
            }
        }
    }
}

void vshi_ao_reach_own(vshi_ao_reach *reach, int32_t spacing, size_t begin, size_t end) {
    for (size_t row = begin; row < end; ++row) {
        for (size_t column = 0; column < reach->columns; ++column) {
            for (int32_t s = 1; s <= spacing; s *= 2) {
                mark(reach, s, TILE * column, TILE * row);
            }
        }
    }
    mark_wider(reach, spacing);
}

bool vshi_ao_reach_further(vshi_ao_reach *reach, const vshi_ao_share *share) {
    const int32_t most = REACH * share->spacing;
    bool any = false;
    memset(reach->lattices, 0, reach->rows * reach->columns);
    for (int32_t row = 0; row < share->map.height; ++row) {
        const int32_t above = row - most > 0 ? row - most : 0;
        const int32_t below = row + most < share->map.height ? row + most : share->map.height - 1;
        bool near = false; /* rows that are not wanted */
        for (int32_t tile = above / TILE; tile <= below / TILE; ++tile) {
            near = near || !reach->wanted[tile];
        }
        if (!near || !vshi_ao_is_estimated(reach, row)) {
            continue;
        }
        for (int32_t column = 0; column < share->map.width; ++column) {
            const uint32_t at = vshi_texel_at(&share->map, column, row);
            const int32_t level = at > 0 && share->rays[at - 1] > 0 ? share->level[at - 1] : 0;
            if (level > 1 && level <= share->spacing) {
                look_around(reach, share, level, column, row);
            }
        }
    }
    mark_wider(reach, share->spacing);
    for (size_t k = 0; k < reach->rows * reach->columns; ++k) {
        any = any || reach->lattices[k] != 0;
    }
    return any;
}
