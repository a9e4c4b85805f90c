/* What every part's file says of itself first: of what it is a part, which one, and of which inputs and
 * options. */
#ifndef VSHI_PART_ABOUT_H
#define VSHI_PART_ABOUT_H

#include "base/error.h"
#include "base/part_code.h"
#include "base/shared.h"

#include <vdbshade/parts.h>

enum { VSHI_MOST_SHARDS = 10000 };

typedef struct vshi_part_attribute {
    char *name, *value;
} vshi_part_attribute;

/* All of it is owned. */
typedef struct vshi_part_about {
    char *kind;    /* "bake", "volume", "trade" */
    char *version; /* of the library */
    int32_t shard, shard_count;
    char **words; /* [word_count], and NULL behind them */
    uint64_t word_count;
    vshi_part_attribute *attributes; /* [attribute_count] */
    uint64_t attribute_count;
} vshi_part_about;

/* Copies the options. Errors: VSH_ERROR_MEMORY; free it also then. */
VSHI_SHARED vsh_result vshi_part_about_make(const char *kind, const vsh_part_options *options,
                                            vshi_part_about *about, vsh_error *error);
VSHI_SHARED void vshi_part_about_code(vshi_part_code *code, vshi_part_about *about);
VSHI_SHARED void vshi_part_about_free(vshi_part_about *about);

/* Whether the part at `path` is number `shard` of the kind that the options are of, by this library, of the
 * same inputs and options. Errors: VSH_ERROR_INPUT, with the first thing that differs. */
VSHI_SHARED vsh_result vshi_part_about_check(const vshi_part_about *about, const char *path, const char *kind,
                                             int32_t shard, const vsh_part_options *options,
                                             vsh_error *error);

/* VSH_ERROR_INPUT: something that tells of inputs or options is not what it is in the other parts, or here.
 */
VSHI_SHARED vsh_result vshi_part_refuse(const char *path, const char *what, const char *theirs,
                                        const char *ours, vsh_error *error);

/* Whether `shard` of `count` is a part. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_part_check_options(const vsh_part_options *options, bool merges, vsh_error *error);

#endif
