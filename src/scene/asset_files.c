#include "scene/asset_files.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

static vsh_result copy_text(const char *text, char **copy, vsh_error *error) {
    const size_t size = strlen(text) + 1;
    void *memory = NULL;
    VSHI_TRY(vshi_allocate(&memory, size, 1, "file name", error));
    *copy = memcpy(memory, text, size);
    return VSH_OK;
}

vsh_result vshi_asset_model(vshi_asset_files *files, const char *path, const vsh_run *run,
                            const vsh_model **model, vsh_error *error) {
    for (size_t i = 0; i < files->model_count; ++i) {
        if (strcmp(files->models[i].path, path) == 0) {
            *model = files->models[i].model;
            return VSH_OK;
        }
    }
    vshi_asset_model_entry *entry = &files->models[files->model_count++];
    VSHI_TRY(copy_text(path, &entry->path, error));
    VSHI_TRY(vsh_model_read(path, run, &entry->model, error));
    VSHI_TRY(vshi_masks_create(entry->model, entry->path, &entry->masks, error));
    *model = entry->model;
    return VSH_OK;
}

vshi_masks *vshi_asset_masks(const vshi_asset_files *files, const vsh_model *model) {
    size_t i = 0;
    while (files->models[i].model != model) {
        ++i;
    }
    return files->models[i].masks;
}

static bool same_text(const char *a, const char *b) {
    return a == NULL || b == NULL ? a == b : strcmp(a, b) == 0;
}

vsh_result vshi_asset_grid(vshi_asset_files *files, const char *path, const char *name, const vsh_run *run,
                           const vsh_grid **grid, vsh_error *error) {
    for (size_t i = 0; i < files->grid_count; ++i) {
        const vshi_asset_grid_entry *entry = &files->grids[i];
        if (same_text(entry->path, path) && same_text(entry->name, name)) {
            *grid = entry->grid;
            return VSH_OK;
        }
    }
    vshi_asset_grid_entry *entry = &files->grids[files->grid_count++];
    VSHI_TRY(copy_text(path, &entry->path, error));
    if (name != NULL) {
        VSHI_TRY(copy_text(name, &entry->name, error));
    }
    VSHI_TRY(vsh_grid_read(path, name, run, &entry->grid, error));
    *grid = entry->grid;
    return VSH_OK;
}

vsh_result vshi_asset_map(vshi_asset_files *files, const char *path, const vsh_run *run,
                          const vshi_height_image **map, vsh_error *error) {
    for (size_t i = 0; i < files->map_count; ++i) {
        if (strcmp(files->maps[i].path, path) == 0) {
            *map = &files->maps[i].map;
            return VSH_OK;
        }
    }
    vshi_asset_map_entry *entry = &files->maps[files->map_count++];
    VSHI_TRY(copy_text(path, &entry->path, error));
    VSHI_TRY(vshi_height_image_read(path, run, &entry->map, error));
    *map = &entry->map;
    return VSH_OK;
}

vsh_result vshi_asset_files_create(const vsh_scene *scene, vshi_asset_files *files, vsh_error *error) {
    const size_t count = scene->caster_count + scene->receiver_count;
    *files = (vshi_asset_files){.models = NULL};
    VSHI_TRY(vshi_allocate((void **)&files->models, count, sizeof *files->models, "models", error));
    VSHI_TRY(
        vshi_allocate((void **)&files->grids, scene->caster_count, sizeof *files->grids, "grids", error));
    return vshi_allocate((void **)&files->maps, count, sizeof *files->maps, "heightfields", error);
}

void vshi_asset_maps_free(vshi_asset_files *files) {
    for (size_t i = 0; i < files->map_count; ++i) {
        free(files->maps[i].map.values);
        free(files->maps[i].path);
    }
    files->map_count = 0;
}

void vshi_asset_files_free(vshi_asset_files *files) {
    vshi_asset_maps_free(files);
    free(files->maps);
    for (size_t i = 0; i < files->grid_count; ++i) {
        vsh_grid_free(files->grids[i].grid);
        free(files->grids[i].name);
        free(files->grids[i].path);
    }
    free(files->grids);
    for (size_t i = 0; i < files->model_count; ++i) {
        vshi_masks_free(files->models[i].masks);
        vsh_model_free(files->models[i].model);
        free(files->models[i].path);
    }
    free(files->models);
}
