/* Rows that go into the materials of the receiver's own file. */
#ifndef VSHI_LIT_SINK_H
#define VSHI_LIT_SINK_H

#include "bake_scene/job.h"

/* Of the planes of a page: light has one or three. */
enum { VSHI_LIT_AO = 0, VSHI_LIT_LIGHT = 1 };

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

/* Whether light is shown alone, as colour: as was asked for, or because materials of an OBJ know nothing
 * else. */
bool vshi_lit_previews(const vshi_lit_sink *lit);

/* Of an image's channels AO, and irradiance or (without it) all shadows, into `sources`. */
void vshi_lit_find_sources(vshi_lit_sink *lit, const vsh_image *image);

/* Which of the model's meshes are lit, and by which UVs; and the page that each chart lies on, NULL where
 * there is no atlas. To be freed. Errors: VSH_ERROR_MEMORY. (lit_uvs.c) */
vsh_result vshi_lit_list_meshes(const vshi_lit_sink *lit, const vsh_model *model, vsh_lit_mesh **meshes,
                                vsh_error *error);
vsh_result vshi_lit_list_chart_pages(const vshi_lit_sink *lit, vsh_lit_options *options, uint32_t **pages,
                                     vsh_error *error);

/* Whether the UVs that were made have room in a job's assets, once these are loaded: to be told before
 * anything is baked. Errors: as vsh_lit_check_uvs(). (lit_uvs.c) */
vsh_result vshi_lit_check_uvs(vsh_bake_job *job, const vsh_run *run, vsh_error *error);

/* Frees the pages that wait for others. */
void vshi_lit_pages_free(vsh_bake_job *job);

#endif
