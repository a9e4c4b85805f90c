/* Lightmaps of a job on their way from charts to files. */
#ifndef VSHI_PAGES_H
#define VSHI_PAGES_H

#include "bake/page.h"
#include "bake_scene/channels.h"
#include "bake_scene/job.h"

/* One lightmap. */
typedef struct vshi_job_page {
    vsh_bake_job *job;
    const vshi_target *target;
    size_t index; /* of it */
    const vsh_charts *charts;
    vsh_job_lightmap *lightmap;
    vshi_channels channels;
    vshi_page page;
    vsh_bake_stats baked;
} vshi_job_page;

/* Takes memory for a lightmap. Close it also after an error. Errors: as vshi_store_take(). */
vsh_result vshi_job_page_open(vsh_bake_job *job, size_t index, vshi_store *store, vshi_job_page *page,
                              vsh_error *error);
void vshi_job_page_close(vshi_job_page *page);

/* A store for lightmap `index`, whose files lie beside its output. `run` must outlive it. Close it with
 * vshi_job_store_close(). Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_job_store_open(const vsh_bake_job *job, size_t index, vsh_run *run, vshi_store *store,
                               vsh_error *error);
void vshi_job_store_close(vshi_store *store);

/* Bytes that the lightmaps held together take, at most. */
double vshi_job_bytes(const vsh_bake_job *job, int32_t threads);

/* What traces the tiles of all lightmaps, once; NULL of jobs that merge. */
vsh_result vshi_job_open_tracer(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* Bakes lightmaps, or takes them from parts, finishes and writes them. Lightmaps whose seams are fixed are
 * held together. Errors: as vsh_bake_job_run(). */
vsh_result vshi_job_bake_all(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* What the library made of arrays names no file: adds it. */
vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error);

#endif
