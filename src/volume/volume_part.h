/* A part of a volume: blocks that follow each other, shaded and not filled (base/part_file.h). The body is,
 * of each block, a bit for each voxel that was shaded; vshi_fill_reaches() of the others, in bytes, up to a
 * multiple of four; then of each channel the number of values that follow (one for all, or one for each voxel
 * that was shaded) and the values. The tail is the statistics. */
#ifndef VSHI_VOLUME_PART_H
#define VSHI_VOLUME_PART_H

#include "base/part_file.h"
#include "volume/volume_blocks.h"

#define VSHI_PART_VOLUME "volume" /* the kind of part */

/* What is behind the vshi_part_about of a head. */
typedef struct vshi_volume_head {
    int32_t working;        /* parts that have blocks: the first ones. Of the others nothing else is told */
    uint64_t first, end;    /* blocks */
    uint64_t blocks, count; /* of all parts: blocks, voxels */
    uint64_t channels;
    double voxel_size; /* these of what cast, as in vsh_occluders_info */
    uint64_t active_voxels, field_bytes;
    int32_t levels, has_triangles;
    double field_voxel_size; /* these two as grids tell of them (volume/channels.h) */
    int32_t traced;
} vshi_volume_head;

void vshi_volume_head_code(vshi_part_code *code, vshi_volume_head *head);
void vshi_volume_stats_code(vshi_part_code *code, vsh_shade_stats *stats);
enum { VSHI_VOLUME_STATS_BYTES = 12 * 8 };

/* Bits of a mask. */
static inline size_t vshi_mask_count(const uint64_t mask[VSHI_MASK_WORDS]) {
    size_t count = 0;
    for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
        count += (size_t)__builtin_popcountll(mask[i]);
    }
    return count;
}

#endif
