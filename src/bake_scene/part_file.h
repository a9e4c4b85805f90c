/* Files of parts. A file appears whole or not at all, and holds no time and no name of a machine. Readers
 * check all of it.
 *
 * A file is: magic; numbers that tell the byte order and the size of the head; the head, which begins with a
 * vshi_part_about; the body; a checksum. */
#ifndef VSHI_PART_FILE_H
#define VSHI_PART_FILE_H

#include "base/file.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <vdbshade/bake_scene.h>

/* The format's number is in the magic: another one is another version's. */
#define VSHI_PART_MAGIC "vdbshade part 9\n"
#define VSHI_PART_MAGIC_BEGIN "vdbshade part "
#define VSHI_PART_ORDER UINT64_C(0x0102030405060708)
#define VSHI_PART_SUM UINT64_C(0xcbf29ce484222325) /* of no bytes */

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

/* --- numbers and texts, written and read by the same functions */

typedef struct vshi_part_code {
    bool reads;
    bool failed;          /* memory was short, or what is read is not what was written */
    unsigned char *bytes; /* owned */
    size_t size;          /* bytes: written, or of those that are read the ones that were */
    size_t room;          /* bytes of memory; when reading, all of them */
} vshi_part_code;

void vshi_part_code_bytes(vshi_part_code *code, void *value, size_t size);
void vshi_part_code_u64(vshi_part_code *code, uint64_t *value);
void vshi_part_code_f64(vshi_part_code *code, double *value);
void vshi_part_code_i32(vshi_part_code *code, int32_t *value);

/* The number of elements that follow, each of `least` bytes at least, and where they are read memory for them
 * and one more, zeroed, `size` bytes each. It is the caller's to free also where `failed`; *count is then 0.
 */
void vshi_part_code_count(vshi_part_code *code, uint64_t *count, size_t least, void **list, size_t size);

/* A text, and a list of them; those that are read are the caller's to free. */
void vshi_part_code_text(vshi_part_code *code, char **text);
void vshi_part_code_texts(vshi_part_code *code, char ***texts, uint64_t *count);

/* --- the head: the number of the part, its inputs and its options */

enum { VSHI_MOST_SHARDS = 10000 };

typedef struct vshi_part_attribute {
    char *name, *value;
} vshi_part_attribute;

/* All of it is owned. */
typedef struct vshi_part_about {
    char *version; /* of the library */
    int32_t shard, shard_count;
    char **words; /* [word_count], and NULL behind them */
    uint64_t word_count;
    vshi_part_attribute *attributes; /* [attribute_count] */
    uint64_t attribute_count;
} vshi_part_about;

/* Which part of how many, and what its file keeps. A view. */
typedef struct vshi_part_options {
    const char *parts;               /* prefix of the parts' file names */
    int32_t shard;                   /* 1 … shard_count; of a merge not looked at */
    int32_t shard_count;             /* 1 … VSHI_MOST_SHARDS */
    const vsh_attribute *attributes; /* [attribute_count]: what the output tells of where it comes from: the
                                        same for all parts, and for their merge */
    size_t attribute_count;
    const char *const *words; /* [word_count]: kept as they are, for vsh_part_words() */
    size_t word_count;
} vshi_part_options;

/* Copies the options. Errors: VSH_ERROR_MEMORY; free it also then. */
vsh_result vshi_part_about_make(const vshi_part_options *options, vshi_part_about *about, vsh_error *error);
void vshi_part_about_code(vshi_part_code *code, vshi_part_about *about);
void vshi_part_about_free(vshi_part_about *about);

/* Whether the part at `path` is number `shard`, by this library, of the same inputs and options. Errors:
 * VSH_ERROR_INPUT, with the first thing that differs. */
vsh_result vshi_part_about_check(const vshi_part_about *about, const char *path, int32_t shard,
                                 const vshi_part_options *options, vsh_error *error);

/* VSH_ERROR_INPUT: something that tells of inputs or options is not what it is in the other parts, or here.
 */
vsh_result vshi_part_refuse(const char *path, const char *what, const char *theirs, const char *ours,
                            vsh_error *error);

/* --- names */

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
void vshi_part_output_abandon(vshi_part_output *part); /* zeroed ones too */

/* --- reading, in this order */

typedef struct vshi_part_input {
    const char *path; /* the caller's */
    FILE *file;
    vshi_part_front front;
    uint64_t body_bytes;
    uint64_t sum;
    vshi_part_code head; /* positioned behind the vshi_part_about */
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
