/* The part of a job that bakes some rows of its lightmaps. */
#ifndef VSHI_PART_JOB_H
#define VSHI_PART_JOB_H

#include "bake_scene/job.h"

/* Bakes the rows of the job's shard and writes its part. */
vsh_result vshi_job_bake_part(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* Takes the rows of a lightmap for the job's part. */
typedef struct vshi_part_sink {
    const vsh_bake_job *job;
    const vsh_job_lightmap *lightmap;
    const vshi_channels *channels; /* whose `known` goes with the rows */
    const vsh_bake_stats *baked;   /* when all are there */
} vshi_part_sink;

/* A sink of `part`, which must outlive it. */
vsh_row_sink vshi_part_sink_of(vshi_part_sink *part);

/* Rows of a lightmap as a piece of a shard. */
vshi_ao_cut vshi_job_cut(const vsh_bake_job *job, size_t index, int32_t first, int32_t end);

/* Takes memory for what a part keeps of what it leaves, of each of a piece's bands, if it leaves any; sets
 * how many bytes that are of one. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_part_open_kept(const vsh_bake_job *job, size_t index, const vshi_bands *bands,
                               vshi_channels *channels, vsh_error *error);
void vshi_part_set_kept(const vsh_bake_job *job, size_t index, const vshi_bands *bands, int32_t first,
                        int32_t rows, vshi_channels *channels);

#endif
