/* Numbers and texts of a part's head and statistics, written and read by the same functions. */
#ifndef VSHI_PART_CODE_H
#define VSHI_PART_CODE_H

#include "bake_scene/part_file.h"

typedef struct vshi_part_code {
    bool reads;
    bool failed;          /* memory was short, or what is read is not what was written */
    unsigned char *bytes; /* written: owned, grows */
    size_t size, room;    /* bytes; of what is read, `room` is all of it and `size` what was read */
} vshi_part_code;

/* The head, and the statistics of a piece: arrays and texts that are read are allocated, and given to who
 * frees them also where `failed`. */
void vshi_part_code_head(vshi_part_code *code, vshi_part_head *head);
void vshi_part_code_stats(vshi_part_code *code, vsh_bake_stats *stats, uint64_t mesh_count,
                          uint64_t error_count);

/* Bytes of the statistics of a piece; a double, as it cannot overflow. */
double vshi_part_stats_bytes(uint64_t mesh_count, uint64_t error_count);

#endif
