/* Which neighbouring texels lie next to each other in the world too. */
#ifndef VSHI_LINKS_H
#define VSHI_LINKS_H

#include "shade/window.h"

#include <vdbshade/shade.h>

/* The points of texels [height][width], numbers + 1; 0: none. */
typedef struct vshi_texel_map {
    const uint32_t *at;
    int32_t width, height;
} vshi_texel_map;

static inline uint32_t vshi_texel_at(const vshi_texel_map *map, int32_t column, int32_t row) {
    const bool inside = column >= 0 && row >= 0 && column < map->width && row < map->height;
    return inside ? map->at[(size_t)row * (size_t)map->width + (size_t)column] : 0;
}

/* A rectangle of every `spacing`th texel of every `spacing`th row, from a texel on. */
typedef struct vshi_texel_lattice {
    int32_t left, top, spacing, width, height;
} vshi_texel_lattice;

/* Sets `left`, `above` and `step` of texels [height][width] of a lattice. Its texels hang together where all
 * between them do. */
void vshi_links_find(const vsh_points *points, const vshi_texel_map *map, const vshi_texel_lattice *lattice,
                     vshi_window_texel *texels);

/* Whether the square of `spacing` + 1 texels from (column, row) on is whole: all are there and in a plane. */
bool vshi_links_whole(const vsh_points *points, const vshi_texel_map *map, int32_t column, int32_t row,
                      int32_t spacing);

/* Whether texels hang together from one to the other, along its row and then the other's column. */
bool vshi_links_lead(const vsh_points *points, const vshi_texel_map *map, const int32_t from[2],
                     const int32_t to[2]);

#endif
