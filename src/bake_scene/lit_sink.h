/* Rows that go into the materials of the receiver's own file. */
#ifndef VSHI_LIT_SINK_H
#define VSHI_LIT_SINK_H

#include "bake_scene/job.h"

typedef struct vshi_lit_sink {
    vsh_bake_job *job;
    const vsh_run *run;
    const vshi_target *target;
    const vsh_job_lightmap *lightmap;
    vshi_lit_page page;    /* whose rows come; the job's once all are there */
    int32_t rows;          /* there so far */
    vsh_image_writer *exr; /* of all channels; NULL: not asked for */
    char *exr_path;        /* its name; NULL: not asked for */
    int32_t channel_count;
    int32_t sources[4][VSH_MAX_CHANNELS]; /* channels whose mean each plane is */
    int32_t source_count[4];
} vshi_lit_sink;

/* A sink of `lit`, which has job and run, and must outlive it. */
vsh_row_sink vshi_lit_sink_of(vshi_lit_sink *lit);

/* Light from all around of an asset whose scene names none, linear: what is in shadow is not black. */
#define VSHI_LIT_AMBIENT 0.25

/* Has a scene whose outputs are all assets bake the irradiance of its lights, with light from all around. */
void vshi_lit_sink_scene(vsh_scene *scene);

/* Whether an asset can be written with these channels. Errors: as vsh_receiver_check(). */
vsh_result vshi_lit_sink_check(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error);

/* Frees the pages that wait for others. */
void vshi_lit_pages_free(vsh_bake_job *job);

/* Bytes that a page takes until it is written. */
uint64_t vshi_lit_sink_bytes(int32_t width, int32_t height);

#endif
