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

/* What bands of target (of a part: piece) `index` are kept beside (bake_scene/resume.h), to be freed: its
 * output, with the page's number for further pages of an asset, or the part with the piece's. NULL where
 * memory is short. */
char *vshi_job_kept_name(const vsh_bake_job *job, size_t index);

/* Takes them away. */
vsh_result vshi_job_forget(const vsh_bake_job *job, size_t index, vsh_error *error);

#endif
