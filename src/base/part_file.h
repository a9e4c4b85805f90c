/* Parts' files. They appear whole or not at all, hold nothing that tells of time or machine (but those of
 * what measures time), and whoever reads one checks all of it.
 *
 * A file is: magic; numbers that tell the byte order and the size of the head; the head, which begins with a
 * vshi_part_about; the body; a checksum. */
#ifndef VSHI_PART_FILE_H
#define VSHI_PART_FILE_H

#include "base/file.h"
#include "base/part_about.h"

#include <stdio.h>

/* "PARTS.I-of-N.part", to be freed; NULL where memory is short. */
char *vshi_part_path(const char *parts, int32_t shard, int32_t count);

/* The number of shards of the parts beside a name, of which there may be some missing. Errors:
 * VSH_ERROR_INPUT (there are none, or of several numbers), VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_parts_count(const char *parts, int32_t *count, vsh_error *error);

/* Whether all parts are there. Errors: VSH_ERROR_READ, with those that are missing; VSH_ERROR_MEMORY. */
vsh_result vshi_parts_check_there(const char *parts, int32_t count, vsh_error *error);

/* The path of the part with the lowest number that is there, to be freed; shard_count 0: of however many. */
vsh_result vshi_parts_first(const char *parts, int32_t shard_count, char **path, vsh_error *error);

/* Before the head. Numbers are in the byte order of the machine that wrote them, which `order` tells. */
typedef struct vshi_part_front {
    char magic[16];
    uint64_t order;
    uint64_t head_bytes; /* a multiple of 8; the body follows, then the checksum's 8 bytes */
} vshi_part_front;

/* --- writing */

typedef struct vshi_part_output {
    vshi_output output;
    FILE *file;
    uint64_t sum;
    int error; /* errno of the first write that failed; 0: none */
} vshi_part_output;

/* Begins a part with its head, whose memory is freed. Errors, and then nothing is under way: VSH_ERROR_WRITE,
 * VSH_ERROR_MEMORY. */
vsh_result vshi_part_output_begin(vshi_part_output *part, const char *path, vshi_part_code *head,
                                  vsh_error *error);

/* The next bytes of the body, a multiple of 4. Write errors are reported by _finish(). */
void vshi_part_output_put(vshi_part_output *part, const void *bytes, size_t size);

/* Puts the file in its place. Errors: VSH_ERROR_WRITE. */
vsh_result vshi_part_output_finish(vshi_part_output *part, vsh_error *error);
void vshi_part_output_abandon(vshi_part_output *part); /* what is not under way, too */

/* --- reading, in this order */

typedef struct vshi_part_input {
    const char *path; /* the caller's */
    FILE *file;
    vshi_part_front front;
    uint64_t body_bytes;
    uint64_t sum;
    vshi_part_code head; /* what is behind the vshi_part_about follows */
} vshi_part_input;

/* Opens a part and reads its head. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT (no part, damaged, another
 * version's), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Close it, and free `about`, also after an error. */
vsh_result vshi_part_input_open(const char *path, const vsh_run *run, vshi_part_input *part,
                                vshi_part_about *about, vsh_error *error);

/* Whether all of the head was read. */
vsh_result vshi_part_input_end_head(const vshi_part_input *part, vsh_error *error);

/* Goes over the body, and checks that the file is what was written. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT,
 * VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_part_input_check_body(vshi_part_input *part, const vsh_run *run, vsh_error *error);
void vshi_part_input_close(vshi_part_input *part);

/* --- reading again */

/* Opens a part at a place in its body. Errors: VSH_ERROR_READ, VSH_ERROR_MEMORY. */
vsh_result vshi_part_reopen(const char *path, uint64_t at, FILE **file, vsh_error *error);
vsh_result vshi_part_read_bytes(FILE *file, const char *path, void *bytes, size_t size, vsh_error *error);

/* VSH_ERROR_INPUT: `what` of it cannot be. */
vsh_result vshi_part_damaged(const char *path, const char *what, vsh_error *error);

#endif
