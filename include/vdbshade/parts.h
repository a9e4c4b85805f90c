/* Parts of a bake that several machines share: files PARTS.I-of-N.part, of which vsh_bake_job_merge() and
 * vsh_volume_merge() make one output. */
#ifndef VDBSHADE_PARTS_H
#define VDBSHADE_PARTS_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Which part of how many, and what its file keeps. A view. */
typedef struct vsh_part_options {
    size_t struct_size;
    const char *parts;               /* what the names of the parts' files begin with */
    int32_t shard;                   /* 1 … shard_count; of a merge not looked at */
    int32_t shard_count;             /* 1 … 10000; of a merge also 0: as many as there are beside `parts` */
    const vsh_attribute *attributes; /* [attribute_count]: what the output will tell of where it comes from
                                        (vsh_provenance): the same for all parts, and for their merge */
    size_t attribute_count;
    const char *const *words; /* [word_count]: kept as they are, for vsh_part_words() */
    size_t word_count;
    int32_t working; /* of a volume: how many of the shards, the first ones, have voxels
                        (vsh_volume_shards()); the same for all parts; of a merge not looked at. 0: all */
} vsh_part_options;

static inline vsh_part_options vsh_part_options_default(void) {
    vsh_part_options options = {sizeof(vsh_part_options), NULL, 0, 0, NULL, 0, NULL, 0, 0};
    return options;
}

/* The words that were kept in the first part that is there of those whose names begin with `parts`, of
 * `shard_count` shards, or (0) of however many there are beside it: (*words)[*count], and NULL behind them,
 * to be freed with vsh_part_words_free(). A part is whatever somebody has put there: words are text that its
 * writer chose. Errors: VSH_ERROR_ARGUMENT (NULL, run), VSH_ERROR_READ, VSH_ERROR_INPUT (there are no parts,
 * or of several numbers of shards, or it is none), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                                  size_t *count, vsh_error *error);
VSH_API void vsh_part_words_free(char **words); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
