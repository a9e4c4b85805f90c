/* A part's head and statistics, written and read by the same functions. */
#ifndef VSHI_PART_HEAD_H
#define VSHI_PART_HEAD_H

#include "bake_scene/part_rows.h"
#include "base/part_code.h"

/* What is behind the vshi_part_about of a head, and the statistics of a piece: arrays and texts that are read
 * are allocated, and given to who frees them also where `failed`. */
void vshi_part_code_head(vshi_part_code *code, vshi_part_head *head);
void vshi_part_code_stats(vshi_part_code *code, vsh_bake_stats *stats, uint64_t mesh_count,
                          uint64_t error_count);

/* Bytes of the statistics of a piece; a double, as it cannot overflow. */
double vshi_part_stats_bytes(uint64_t mesh_count, uint64_t error_count);

#endif
