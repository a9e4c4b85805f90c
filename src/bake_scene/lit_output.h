/* A receiver's own file, written with its light in the materials. */
#ifndef VSHI_LIT_OUTPUT_H
#define VSHI_LIT_OUTPUT_H

#include "bake_scene/pages.h"

typedef struct vshi_lit_output {
    vshi_scene_bake *bake;
    const vshi_target *target;
    const vsh_scene_lightmap *lightmap;
    vshi_lit_page page;    /* the current one; the bake keeps it when it is complete */
    int32_t rows;          /* received so far */
    vsh_image_writer *exr; /* an EXR of all channels; NULL: not asked for */
    char *exr_path;
    int32_t sources[4][VSH_MAX_CHANNELS]; /* each plane is the mean of these channels */
    int32_t source_count[4];
} vshi_lit_output;

/* Ambient light, linear, of an asset whose scene names none: shadows are not black. */
#define VSHI_LIT_AMBIENT 0.25

/* Adds irradiance and ambient light to a scene whose outputs are all assets. */
void vshi_lit_output_scene(vsh_scene *scene);

/* Whether an asset can be written with these channels. Errors: as vsh_receiver_check(). */
vsh_result vshi_lit_output_check(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error);

/* Whether the receivers' files have room for the UVs of their new atlases; before anything is baked. Errors:
 * as vsh_lit_check_uvs(). */
vsh_result vshi_lit_check_uvs(vshi_scene_bake *bake, const vsh_run *run, vsh_error *error);

/* Takes memory for a page. Close it also after an error. */
vsh_result vshi_lit_output_open(vshi_lit_output *lit, const vshi_scene_page *page, vsh_error *error);

/* Adds the next rows of all channels. */
vsh_result vshi_lit_output_add(vshi_lit_output *lit, int32_t rows, const float *const *planes,
                               vsh_error *error);

/* Keeps the page, and writes the asset with the receiver's last one. */
vsh_result vshi_lit_output_finish(vshi_lit_output *lit, vsh_error *error);
void vshi_lit_output_close(vshi_lit_output *lit); /* zeroed ones too */

/* Frees the pages that wait for others. */
void vshi_lit_pages_free(vshi_scene_bake *bake);

#endif
