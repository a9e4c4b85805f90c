/* A lightmap of a job on its way from charts to rows. */
#ifndef VSHI_BAKE_LIGHTMAP_H
#define VSHI_BAKE_LIGHTMAP_H

#include "bake_scene/channels.h"
#include "bake_scene/file_sink.h"
#include "bake_scene/invalid_picture.h"
#include "bake_scene/job.h"
#include "bake_scene/lit_sink.h"
#include "bake_scene/merge.h"
#include "bake_scene/part_job.h"
#include "base/rounds.h"

typedef struct vshi_lightmap_work {
    vsh_bake_job *job;
    const vsh_run *run;
    vshi_lightmap_input input;
    const vshi_target *target;
    size_t index; /* of it */
    vsh_job_lightmap *lightmap;
    vshi_channels channels;
    vsh_bake_stats baked; /* of all bands so far */
    uint64_t *invalid;    /* [mesh_count]: of one band */
    vshi_rounds rounds;   /* where there are several bands */
    vshi_file_sink files;
    vshi_lit_sink lit;
    vshi_part_sink part;
    vsh_row_sink sink;
    uint64_t held; /* bytes of others that are kept meanwhile */
    bool begun;    /* the sink has taken rows */
    vshi_invalid_picture picture;
} vshi_lightmap_work;

/* What the library made of arrays names no file: adds it. */
vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error);

/* Lightmap `index` of a job. What these four do of one that is baked whole vshi_job_bake() does of any.
 * End it once, with the result so far, which is returned, or what writing ended with. Errors: as
 * vsh_bake_job_run(). */
void vshi_lightmap_begin(vsh_bake_job *job, size_t index, const vshi_lightmap_input *input,
                         const vsh_run *run, vshi_lightmap_work *work);
vsh_result vshi_lightmap_bake_whole(vshi_lightmap_work *work, vsh_error *error);
vsh_result vshi_lightmap_write_whole(vshi_lightmap_work *work, vsh_error *error);
vsh_result vshi_lightmap_end(vshi_lightmap_work *work, vsh_result result, vsh_error *error);

#endif
