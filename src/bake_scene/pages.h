/* The lightmaps of a scene, from charts to files. */
#ifndef VSHI_PAGES_H
#define VSHI_PAGES_H

#include "bake/page.h"
#include "bake_scene/bake_scene.h"
#include "bake_scene/channels.h"

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

#endif
