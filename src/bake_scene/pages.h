/* The lightmaps of a scene, from charts to files. */
#ifndef VSHI_PAGES_H
#define VSHI_PAGES_H

#include "bake/padding.h"
#include "bake/page.h"
#include "bake_scene/bake_scene.h"
#include "bake_scene/channels.h"
#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/image.h>

/* One lightmap. */
typedef struct vshi_scene_page {
    vshi_scene_bake *bake;
    const vshi_target *target;
    size_t index; /* of the target */
    const vsh_charts *charts;
    vsh_scene_lightmap *lightmap;
    vshi_channels channels;
    vshi_page page;
    vsh_bake_stats baked;
} vshi_scene_page;

/* Takes memory for a lightmap. Close it also after an error. Errors: as vshi_store_take(). */
vsh_result vshi_scene_page_open(vshi_scene_bake *bake, size_t index, vshi_store *store, vshi_scene_page *page,
                                vsh_error *error);
void vshi_scene_page_close(vshi_scene_page *page);

/* A store for lightmap `index`, whose files lie beside its output. `run` must outlive it. Close it with
 * vshi_scene_store_close(). Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_scene_store_open(const vshi_scene_bake *bake, size_t index, vsh_run *run, vshi_store *store,
                                 vsh_error *error);
void vshi_scene_store_close(vshi_store *store);

/* Bytes that the lightmaps held together take, at most. */
double vshi_bake_bytes(const vshi_scene_bake *bake);

/* Bakes lightmaps, or reads them from parts, finishes and writes them. Lightmaps whose seams are fixed
 * stay in memory together. Errors: as vsh_bake_scene(). */
vsh_result vshi_bake_pages(vshi_scene_bake *bake, vsh_error *error);

/* Adds the file's name to an error of a function that knows arrays only. Returns `result`. */
vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error);

/* --- a picture of a lightmap's charts, and of the texels of them that are not valid */

typedef struct vshi_invalid_picture {
    char *path; /* NULL: nobody wants one */
    vsh_image image;
    float *planes[3]; /* R, G, B of as many rows as are baked at a time */
    vsh_image_writer *writer;
} vshi_invalid_picture;

/* Opens the picture of lightmap `index`, of which `rows` come at a time: FILE.png, or where there are several
 * FILE.OUTPUT.png, no two of which are alike. Does nothing if nobody wants it. Errors: as
 * vsh_image_writer_create(). Close it also after a failure. */
vsh_result vshi_invalid_picture_open(vshi_invalid_picture *picture, const vshi_scene_bake *bake, size_t index,
                                     int32_t rows, vsh_error *error);

/* Adds rows of texels, each VSHI_TEXEL_…. */
vsh_result vshi_invalid_picture_add(vshi_invalid_picture *picture, int32_t rows, const uint8_t *state,
                                    vsh_error *error);

/* Completes the file where `result` is VSH_OK, else leaves what was there. Returns `result`, or why not. */
vsh_result vshi_invalid_picture_close(vshi_invalid_picture *picture, vsh_result result, vsh_error *error);

/* --- warnings and errors about a lightmap's UVs, texels and file */

/* Warns of faults in the target's UVs, one line for each mesh and kind. Warns of charts that lie too close
 * for the size, and of charts that cover few texels. */
void vshi_warn_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                   const vsh_run *run);

/* Charts that cover no texel's centre, or objects that lie over each other on more than VSH_LARGEST_OVERLAP
 * of the texels: VSH_ERROR_INPUT, with why. */
vsh_result vshi_refuse_uvs(const vshi_target *target, const vsh_uv_report *reports, uint64_t covered,
                           vsh_error *error);

/* A lightmap without one valid texel is no lightmap: VSH_ERROR_INPUT. */
vsh_result vshi_refuse_invalid(const vshi_target *target, const vsh_bake_stats *baked, vsh_error *error);

/* Notes texels that are not valid, and warns of marches that did not end or widened too far. */
void vshi_warn_baked(const vsh_scene *scene, const vshi_target *target, const vsh_bake_stats *baked,
                     const vsh_run *run);

/* Notes which lights, and whether the sky, reach the meshes of a baked page. */
void vshi_note_lit(const vshi_scene_page *page);

/* Warns of lights, and of the sky, that one object hides from all other objects of a bake. */
void vshi_warn_hidden_lights(const vshi_scene_bake *bake, const vsh_run *run);

/* Warns of light that the file's integers cut. */
void vshi_warn_clipping(const char *output, const vsh_image_clipping *cut, const vsh_run *run);

#endif
