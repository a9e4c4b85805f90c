/* The head of every part's file: the number of the part, its inputs and its options. */
#ifndef VSHI_PART_ABOUT_H
#define VSHI_PART_ABOUT_H

#include "base/error.h"
#include "base/part_code.h"

#include <vdbshade/parts.h>

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

#endif
