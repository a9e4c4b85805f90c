/* Which neighbouring texels lie next to each other in the world too. */
#ifndef VSHI_LINKS_H
#define VSHI_LINKS_H

#include "shade/window.h"

/* Texels [height][width], where each of them is and which way it faces. */
typedef struct vshi_texel_map {
    int32_t width, height;
    const uint32_t *at;    /* [height][width]: number of the texel's point, + 1; 0: none. NULL: points are
                              numbered as texels */
    const uint8_t *level;  /* without `at`, [height][width]: 0 where there is no point */
    const float *position; /* [points][3], from any one place, world units */
    const float *normal;   /* [points][3], unit */
} vshi_texel_map;

/* The number of a texel's point, + 1; 0: there is none. */
static inline size_t vshi_texel_at(const vshi_texel_map *map, int32_t column, int32_t row) {
    if (column < 0 || row < 0 || column >= map->width || row >= map->height) {
        return 0;
    }
    const size_t place = (size_t)row * (size_t)map->width + (size_t)column;
    return map->at != NULL ? map->at[place] : map->level[place] != 0 ? place + 1 : 0;
}

/* A rectangle of every `spacing`th texel of every `spacing`th row, from a texel on. */
typedef struct vshi_texel_lattice {
    int32_t left, top, spacing, width, height;
} vshi_texel_lattice;

/* Sets `left`, `above` and `step` of texels [height][width] of a lattice. Its texels hang together where all
 * between them do. */
void vshi_links_find(const vshi_texel_map *map, const vshi_texel_lattice *lattice, vshi_window_texel *texels);

/* Whether the square of `spacing` + 1 texels from (column, row) on is whole: all are there and in a plane. */
bool vshi_links_whole(const vshi_texel_map *map, int32_t column, int32_t row, int32_t spacing);

/* Whether texels hang together from one to the other, along its row and then the other's column. */
bool vshi_links_lead(const vshi_texel_map *map, const int32_t from[2], const int32_t to[2]);

#endif
