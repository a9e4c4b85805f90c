/* Parts of a bake that machines share: each file holds every N-th tile, as vshi_trace_tiles() left it.
 *
 * A file is: vshi_part_front; the head (inputs, options, texts); the tiles; a checksum. It appears whole or
 * not at all, and holds no time and no name of a machine. Readers check all of it. */
#ifndef VSHI_BAKE_PARTS_H
#define VSHI_BAKE_PARTS_H

#include "bake_scene/bake_scene.h"

#include <string.h>

/* The format's number is in the magic, in base 36: another one is another version's. */
#define VSHI_PART_MAGIC "vdbshade part A\n"
#define VSHI_PART_MAGIC_BEGIN "vdbshade part "
#define VSHI_PART_ORDER UINT64_C(0x0102030405060708)
#define VSHI_PART_SUM UINT64_C(0xcbf29ce484222325) /* of no bytes */

enum { VSHI_MOST_SHARDS = 10000 };

/* Before the head. Numbers are in the byte order of the machine that wrote them, which `order` tells. */
typedef struct vshi_part_front {
    char magic[16];
    uint64_t order;
    uint64_t head_bytes; /* a multiple of 8; the tiles follow, then the checksum's 8 bytes */
} vshi_part_front;

/* Begins a tile. Its statistics and the errors of channels follow, then its texels, array by array, then the
 * texels to compare with the casters. */
typedef struct vshi_part_tile {
    uint32_t lightmap, tile;
    uint32_t held[2]; /* texels of AO, of the sky */
} vshi_part_tile;

/* FNV-1a (Fowler, Noll and Vo, 1991), a word of four bytes at a time. */
static inline uint64_t vshi_part_sum(uint64_t sum, const void *bytes, size_t size) {
    const unsigned char *at = bytes;
    for (size_t i = 0; i + 4 <= size; i += 4) {
        uint32_t word;
        memcpy(&word, at + i, 4);
        sum = (sum ^ word) * UINT64_C(0x100000001b3);
    }
    return sum;
}

/* "PARTS.I-of-N.part", to be freed; NULL where memory is short. */
char *vshi_part_path(const char *parts, int32_t shard, int32_t count);
/* The path of the part with the lowest number that is there, to be freed; shard_count 0: of however many. */
vsh_result vshi_parts_first(const char *parts, int32_t shard_count, char **path, vsh_error *error);
/* Counts the shards of the parts beside a name, of which there may be some missing. */
vsh_result vshi_parts_count(const char *parts, int32_t *count, vsh_error *error);
/* Fails if a part is missing, with the numbers of those that are. */
vsh_result vshi_parts_check_there(const char *parts, int32_t count, vsh_error *error);

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
