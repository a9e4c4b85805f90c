/* Parts of a bake that machines share: each file holds every N-th tile, as vshi_trace_tiles() left it. */
#ifndef VSHI_BAKE_PARTS_H
#define VSHI_BAKE_PARTS_H

#include "bake_scene/pages.h"
#include "bake_scene/part_file.h"

/* Begins a tile in a part. Its statistics and the errors of channels follow, then its texels, array by array,
 * then the texels to compare with the casters. */
typedef struct vshi_part_tile {
    uint32_t lightmap, tile;
    uint32_t held[2]; /* texels of AO, of the sky */
} vshi_part_tile;

/* Tiles that have texels are numbered over all lightmaps, in one sequence. Shard I of N traces tiles I, I +
 * N, I + 2 N … of them, and writes them into its part. Errors: as vsh_bake_scene(). */
vsh_result vshi_bake_part(vshi_scene_bake *bake, vsh_error *error);

/* The parts of a merge. */
typedef struct vshi_parts vshi_parts;
void vshi_parts_free(vshi_parts *parts); /* NULL does nothing */

/* Counts the parts of a merge, and checks that none is missing. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_parts_find(const vshi_scene_bake *bake, int32_t *count, vsh_error *error);

/* Opens the parts as bake->parts, once the charts are counted, and checks that they belong to this scene.
 * Sets the report's occluders, and the provenance. Errors: VSH_ERROR_READ (a part is missing),
 * VSH_ERROR_INPUT (a part is damaged, or of other inputs, options or another version), VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_parts_open(vshi_scene_bake *bake, int32_t count, vsh_error *error);

/* Reads the tiles of a lightmap, in place of vshi_trace_tiles(). Lightmaps come in their order. `job` counts
 * tiles. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_parts_read(vshi_parts *parts, vshi_scene_page *page, vshi_job *job, vsh_error *error);

#endif
