/* Which rows of a job's lightmaps each of several shards bakes. */
#ifndef VSHI_SHARES_H
#define VSHI_SHARES_H

#include "bake_scene/job.h"
#include "base/part_about.h"

/* Keeps what shares of a measured lightmap are reckoned by. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, vsh_error *error);

/* The rows first … end - 1 of lightmap `index` that shard `shard` of `count` bakes, of a measured job: shards
 * follow each other through all lightmaps, each with as many samples as the others, but that bands begin at
 * multiples of VSH_BAND_STEP and, where texels share AO, at those of its squares. */
void vshi_shares_rows(const vsh_bake_job *job, int32_t shard, int32_t count, size_t index, int32_t *first,
                      int32_t *end);

void vshi_shares_free(vsh_bake_job *job);

#endif
