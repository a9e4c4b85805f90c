/* Which rows of a job's lightmaps each of several shards bakes. */
#ifndef VSHI_SHARES_H
#define VSHI_SHARES_H

#include "bake/texels.h"
#include "bake_scene/job.h"
#include "bake_scene/part_rows.h"

/* What is counted of a row of tiles. */
typedef struct vshi_share_row {
    uint32_t samples, edges; /* as in vshi_tile_row */
    uint32_t triangles;      /* that reach it */
} vshi_share_row;

/* What shares of a lightmap are reckoned by. */
typedef struct vshi_share_rows {
    size_t count;        /* rows of tiles */
    int32_t spacing;     /* of texels whose AO is not all shaded; 1: all is */
    int32_t left;        /* the same, where AO is left at the ends of pieces (bake/ao_cut.h); else 1 */
    vshi_share_row *row; /* [count] */
    vsh_texels *few;     /* of it, of every `few_step`th row and column; NULL: none */
    int32_t few_step;
    uint64_t *work; /* [count]: expected, in ns or so; zeros before vshi_shares_weigh() */
    uint64_t all;   /* their sum */
} vshi_share_rows;

/* Shards that have `least` seconds of work each, as far as the scene tells before a file is read, and whose
 * borders take a tenth of it at most, and what parts do by themselves little more; INFINITY where UVs that
 * are made tell how large lightmaps are. */
double vshi_shares_most(const vsh_scene *scene, double least);

/* Keeps what shares of a measured lightmap are reckoned by. Errors: VSH_ERROR_MEMORY, VSH_ERROR_LIMIT,
 * VSH_ERROR_CANCELLED. */
vsh_result vshi_shares_note(vsh_bake_job *job, size_t index, const vsh_charts *charts, const vsh_run *run,
                            vsh_error *error);

/* What each row of a lightmap is expected to take, of a prepared job: by its samples and what some of them
 * come to, shaded coarsely. The same in every part, whatever it runs on: nothing is timed. Errors: as
 * vsh_bake_lightmap(). */
vsh_result vshi_shares_weigh(const vsh_bake_job *job, vshi_share_rows *share, const vsh_run *run,
                             vsh_error *error);

/* Settles how AO is shaded, of a prepared job: spacing and left. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_shares_leave(const vsh_bake_job *job, vsh_error *error);

/* The rows that shard `shard` of the `count` that have some bakes, of a prepared job, in the order of
 * lightmaps and rows; *pieces is to be freed, also after an error. Shards follow each other through all
 * lightmaps, each with as much work as the others, several times there and back where borders cost little;
 * rows begin at multiples of VSH_BAND_STEP. Errors: as vshi_shares_weigh(). */
vsh_result vshi_shares_list(const vsh_bake_job *job, int32_t shard, int32_t count, const vsh_run *run,
                            vshi_part_piece **pieces, uint64_t *piece_count, vsh_error *error);

void vshi_shares_free(vsh_bake_job *job);

#endif
