/* Which rows of a job's lightmaps each shard bakes. */
#ifndef VSHI_SHARES_H
#define VSHI_SHARES_H

#include "bake/texels.h"
#include "bake_scene/job.h"
#include "bake_scene/part_rows.h"

typedef struct vshi_share_rows {
    size_t count;    /* rows of tiles */
    size_t *samples; /* [count] */
    int32_t spacing; /* of texels that may share AO rays */
    int32_t left;    /* spacing of texels whose AO is left to merging at the ends of pieces; else 1 */
} vshi_share_rows;

/* Records the rows of a measured lightmap. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, vsh_error *error);

/* Sets `left`, of a prepared job. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_shares_leave(const vsh_bake_job *job, vsh_error *error);

/* Lists the rows that a job's shard bakes. Shards follow each other through all lightmaps with about as many
 * samples each. Rows begin at multiples of VSH_BAND_STEP. Free *pieces, also after an error. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_shares_list(const vsh_bake_job *job, vshi_part_piece **pieces, uint64_t *piece_count,
                            vsh_error *error);

void vshi_shares_free(vsh_bake_job *job);

#endif
