/* Parts of a bake that several machines share: files PARTS.I-of-N.part, of which vsh_bake_job_merge()
 * makes one output. */
#ifndef VDBSHADE_PARTS_H
#define VDBSHADE_PARTS_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

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
