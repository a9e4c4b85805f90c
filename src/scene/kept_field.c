#include "scene/kept_field.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/numbers.h"
#include "base/try.h"
#include "scene/assets.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/scene_field.h>

bool vshi_layer_is_voxelised(const vsh_scene *scene, const vsh_scene_layer *layer) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (vshi_caster_in_layer(caster, layer) && !vshi_caster_is_direct(scene, caster)) {
            return true;
        }
    }
    return false;
}

static vsh_result find(const vsh_scene *scene, const vsh_scene_layer *layer, size_t *index,
                       vsh_kept_field *kept, vsh_error *error) {
    const char *name = layer != NULL ? layer->name : "";
    const size_t count = vsh_field_file_count(scene->field);
    for (*index = 0; *index < count; ++*index) {
        vsh_field_file_get(scene->field, *index, kept);
        if (strcmp(kept->name, name) == 0) {
            return VSH_OK;
        }
    }
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: is stale: holds no field of the casters in %s%s: make it anew",
                     vsh_field_file_path(scene->field), layer != NULL ? "layer " : "no layer", name);
}

static vsh_result compare(const vsh_scene *scene, const vshi_caster_prints *prints,
                          const vsh_scene_layer *layer, int32_t resolution, const vsh_kept_field *kept,
                          bool casters, vsh_error *error) {
    vshi_attributes lines = {NULL, NULL, 0, 0};
    vsh_result result;
    VSHI_TRY_DONE(vshi_recipe_make(scene, prints, layer, resolution, &lines, error));
    result = vshi_recipe_compare(scene, vsh_field_file_path(scene->field), kept->origin, kept->origin_count,
                                 &lines, casters, error);
done:
    vshi_attributes_free(&lines);
    return result;
}

vsh_result vshi_kept_field_check(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                                 vshi_caster_prints *prints, vsh_error *error) {
    if (scene->field == NULL) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_caster_prints_make(scene, assets, run, prints, error));
    for (size_t i = 0; i <= scene->layer_count; ++i) {
        const vsh_scene_layer *layer = i > 0 ? &scene->layers[i - 1] : NULL;
        vsh_kept_field kept;
        size_t index;
        if (vshi_layer_is_voxelised(scene, layer)) {
            VSHI_TRY(find(scene, layer, &index, &kept, error));
            VSHI_TRY(compare(scene, prints, layer, VSH_RESOLUTION_NAMED, &kept, true, error));
        }
    }
    return VSH_OK;
}

vsh_result vshi_kept_field_find(const vsh_scene *scene, const vshi_caster_prints *prints,
                                const vsh_scene_layer *layer, int32_t resolution, size_t *index,
                                vsh_grid_info *info, vsh_error *error) {
    vsh_kept_field kept;
    VSHI_TRY(find(scene, layer, index, &kept, error));
    VSHI_TRY(compare(scene, prints, layer, resolution, &kept, false, error));
    vsh_field_info of;
    vsh_field_get_info(kept.field, &of);
    *info = (vsh_grid_info){.voxel_size = of.voxel_size,
                            .half_width = kept.half_width,
                            .shell_thickness = of.shell_thickness,
                            .active_voxels = of.active_voxels};
    memcpy(info->bounds_min, of.bounds_min, sizeof info->bounds_min);
    memcpy(info->bounds_max, of.bounds_max, sizeof info->bounds_max);
    return VSH_OK;
}

static vsh_result find_band(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                            size_t *index, vsh_error *error) {
    if (scene->field == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_scene_field_band: the scene takes no field");
    }
    if (scene->layer_count > 0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: keeps the casters of each layer on their own: a scene with layers has no band "
                         "of all casters there",
                         vsh_field_file_path(scene->field));
    }
    vshi_caster_prints made = {NULL, 0};
    const vshi_caster_prints *prints = vshi_assets_prints(assets);
    vsh_grid_info voxels;
    vsh_result result;
    if (prints->count != scene->caster_count) { /* they were loaded before the scene took a field */
        VSHI_TRY_DONE(vshi_caster_prints_make(scene, assets, run, &made, error));
        prints = &made;
    }
    result = vshi_kept_field_find(scene, prints, NULL, VSH_RESOLUTION_NAMED, index, &voxels, error);
done:
    vshi_caster_prints_free(&made);
    return result;
}

vsh_result vsh_scene_field_band(const vsh_scene *scene, const vsh_assets *assets, double band,
                                const vsh_run *run, vsh_voxels **voxels, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(voxels);
    *voxels = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    vsh_run full;
    size_t index;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(find_band(scene, assets, &full, &index, error));
    return vsh_field_file_band(scene->field, index, band, &full, voxels, error);
}

/* What a file's scene named: "resolution 512", "voxel_size 0.01". */
static const char NAMED[] = "vdbshade_voxels";

vsh_result vshi_kept_field_name_voxels(const vsh_scene *scene, vshi_attributes *attributes,
                                       vsh_error *error) {
    VSHI_NUMBERS;
    char text[64];
    if (!vshi_scene_voxels_named(scene, NULL)) {
        return VSH_OK;
    }
    if (scene->grid.voxel_size > 0.0) {
        snprintf(text, sizeof text, "voxel_size %.17g", scene->grid.voxel_size);
    } else {
        snprintf(text, sizeof text, "resolution %d", scene->grid.resolution);
    }
    return vshi_attributes_add(attributes, NAMED, text)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "field: the system refused memory");
}

static bool read_number(const char *text, const char *what, double most, double *number) {
    const size_t length = strlen(what);
    char *end;
    if (strncmp(text, what, length) != 0) {
        return false;
    }
    *number = strtod(text + length, &end);
    return end != text + length && *end == '\0' && *number >= 0.0 && *number <= most;
}

vsh_result vsh_scene_use_field(vsh_scene *scene, const vsh_field_file *file, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NUMBERS;
    VSHI_NEEDS(scene);
    scene->field = file;
    if (file == NULL || vshi_scene_voxels_named(scene, NULL)) {
        return VSH_OK;
    }
    size_t count;
    const vsh_attribute *attributes = vsh_field_file_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        double number = 0.0;
        if (strcmp(attributes[i].name, NAMED) != 0) {
            continue;
        }
        if (read_number(attributes[i].value, "voxel_size ", 1e12, &number) && number > 0.0) {
            scene->grid.voxel_size = number;
        } else if (read_number(attributes[i].value, "resolution ", 65536.0, &number)) {
            scene->grid.resolution = (int32_t)number;
        } else {
            return vshi_fail(error, VSH_ERROR_READ, "%s: damaged: %s is '%.64s'", vsh_field_file_path(file),
                             NAMED, attributes[i].value);
        }
        scene->voxels_named = 1;
    }
    return VSH_OK;
}
