/* A tile in a part's file. */
#ifndef VSHI_PART_TILE_H
#define VSHI_PART_TILE_H

#include "bake_scene/pages.h"

#include <stdio.h>

/* Begins a tile. Its statistics and the errors of channels follow, then its texels, array by array, then
 * those to compare with the casters. */
typedef struct vshi_part_tile {
    uint32_t lightmap, tile;
    uint32_t held[2]; /* texels of AO, of the sky */
} vshi_part_tile;

/* An array of a page, [height][width] elements of so many bytes. */
typedef struct vshi_part_array {
    unsigned char *values;
    size_t size;
    const char *channel; /* of values that have a range; NULL: it is no channel */
} vshi_part_array;

/* The most arrays of a page. */
enum { VSHI_PART_ARRAYS = VSH_MAX_CHANNELS + 8 };

/* Lists the arrays of a page that its tiles set; returns how many there are. */
size_t vshi_part_list(const vshi_job_page *page, vshi_part_array arrays[VSHI_PART_ARRAYS]);

/* Bytes of a tile's texels in an array, and whether they go into the page or come from it. Up to a multiple
 * of 4. */
enum { VSHI_PART_TILE_MOST = VSHI_TILE * VSHI_TILE * 3 * sizeof(float) };
size_t vshi_part_copy(const vshi_job_page *page, const vshi_part_array *array, size_t tile,
                      unsigned char *bytes, bool in);

/* Checks that a bake can have left what was read of a tile, once it is rasterized. Errors: VSH_ERROR_INPUT.
 */
vsh_result vshi_part_check_tile(const vshi_job_page *page, size_t tile, const char *path, vsh_error *error);

#endif
