/* The files behind a scene, each read once. */
#ifndef VSHI_ASSET_FILES_H
#define VSHI_ASSET_FILES_H

#include "heightfield/heights.h"
#include "scene/masks.h"

#include <vdbshade/scene.h>

typedef struct vshi_asset_model_entry {
    char *path;
    vsh_model *model;
    vshi_masks *masks;
} vshi_asset_model_entry;

typedef struct vshi_asset_grid_entry {
    char *path;
    char *name; /* NULL: the first of the file */
    vsh_grid *grid;
} vshi_asset_grid_entry;

typedef struct vshi_asset_map_entry {
    char *path;
    vshi_height_image map;
} vshi_asset_map_entry;

typedef struct vshi_asset_files {
    vshi_asset_model_entry *models;
    size_t model_count;
    vshi_asset_grid_entry *grids;
    size_t grid_count;
    vshi_asset_map_entry *maps;
    size_t map_count;
} vshi_asset_files;

/* Makes room for the files of a scene. Free with vshi_asset_files_free() also after an error. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_asset_files_create(const vsh_scene *scene, vshi_asset_files *files, vsh_error *error);
void vshi_asset_files_free(vshi_asset_files *files);

/* Frees the images of heights, once all models are made of them. */
void vshi_asset_maps_free(vshi_asset_files *files);

/* What a file holds, which belongs to `files`: read where it has not been. Errors: those of the readers. */
vsh_result vshi_asset_model(vshi_asset_files *files, const char *path, const vsh_run *run,
                            const vsh_model **model, vsh_error *error);
/* The masks of such a model. */
vshi_masks *vshi_asset_masks(const vshi_asset_files *files, const vsh_model *model);
/* `name` NULL: the file's first. */
vsh_result vshi_asset_grid(vshi_asset_files *files, const char *path, const char *name, const vsh_run *run,
                           const vsh_grid **grid, vsh_error *error);
vsh_result vshi_asset_map(vshi_asset_files *files, const char *path, const vsh_run *run,
                          const vshi_height_image **map, vsh_error *error);

#endif
