/* Which rows of a job's lightmaps each of several shards bakes. */
#ifndef VSHI_SHARES_H
#define VSHI_SHARES_H

#include "bake_scene/job.h"
#include "bake_scene/part_rows.h"

/* Keeps what shares of a measured lightmap are reckoned by. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, vsh_error *error);

/* The rows that shard `shard` of `count` bakes, of a measured job, in the order of lightmaps and rows;
 * *pieces is to be freed, also after an error. Shards follow each other through all lightmaps, each with as
 * many samples as the others, but that rows begin at multiples of VSH_BAND_STEP and, where texels share AO,
 * at those of its squares. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_shares_list(const vsh_bake_job *job, int32_t shard, int32_t count, vshi_part_piece **pieces,
                            uint64_t *piece_count, vsh_error *error);

void vshi_shares_free(vsh_bake_job *job);

#endif
