/* How many voxels a scene's casters get where nobody named any. */
#include "shade/resolution.h"
#include "base/floats.h"
#include "mesh/mesh_set.h"
#include "scene/assets.h"
#include "scene/occluders.h"

#include <math.h>

/* Lights that a layer's casters cast for. */
static size_t lights_of(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return layer == NULL || layer->shade.lights == NULL ? scene->light_count : layer->shade.light_count;
}

static bool is_voxelised_in(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer) {
    return vshi_caster_in_layer(caster, layer) && !vshi_caster_is_direct(scene, caster);
}

/* What a mesh is: area and box from where it was checked. */
static vshi_resolution_need measure(const vsh_scene *scene, const vsh_assets *assets,
                                    const vsh_scene_layer *layer) {
    vshi_resolution_need need = {.max_error = scene->shade.max_error};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        for (size_t m = 0; m < count && is_voxelised_in(scene, &scene->casters[i], layer); ++m) {
            const vsh_mesh_report *report = &vshi_mesh_known(&meshes[m])->report;
            need.triangles += (double)meshes[m].triangle_count;
            need.area += report->area;
            for (int axis = 0; axis < 3; ++axis) {
                low[axis] = fmin(low[axis], report->bounds_min[axis]);
                high[axis] = fmax(high[axis], report->bounds_max[axis]);
            }
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        need.longest = fmax(need.longest, high[axis] - low[axis]);
    }
    return need;
}

/* Whether all values come from voxels by a method that keeps the error, and what they are taken from has a
 * shape of its own that voxels can follow: level sets have theirs, and meshes may be thin. */
static bool are_followed(const vsh_scene *scene, const vsh_scene_layer *layer) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        const bool shaped = caster->type == VSH_CASTER_SDF || caster->type == VSH_CASTER_MASK ||
                            caster->type == VSH_CASTER_TEXT || caster->type == VSH_CASTER_SPHERES;
        if (is_voxelised_in(scene, caster, layer) && !shaped) {
            return false;
        }
    }
    return !vshi_scene_method_is(scene, layer, VSH_METHOD_KEEPS_ERROR, false);
}

bool vshi_scene_voxels_named(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return scene->voxels_named != 0 || scene->grid.voxel_size > 0.0 ||
           scene->grid.resolution != vsh_grid_options_default().resolution ||
           (layer != NULL && (layer->voxel_size > 0.0 || layer->resolution > 0));
}

bool vshi_scene_is_level_set(const vsh_scene *scene, const vsh_scene_layer *layer) {
    size_t level_sets = 0, count = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (vshi_caster_in_layer(caster, layer) && !vshi_caster_is_direct(scene, caster)) {
            ++count;
            level_sets += caster->type == VSH_CASTER_VDB;
        }
    }
    return count == 1 && level_sets == 1;
}

bool vshi_scene_keeps_voxels(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return vshi_scene_is_level_set(scene, layer) && !vshi_scene_voxels_named(scene, layer);
}

int32_t vsh_scene_resolution(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                             double points) {
    VSHI_FLOATS;
    const int32_t otherwise = vsh_grid_options_default().resolution;
    if (scene == NULL || assets == NULL || vshi_scene_voxels_named(scene, layer)) {
        return VSH_RESOLUTION_NAMED;
    }
    if (vsh_scene_marches(scene, layer) != 0 && vshi_scene_is_level_set(scene, layer)) {
        return 0;
    }
    if (vsh_scene_marches(scene, layer) != 0) {
        return are_followed(scene, layer)
                   ? vshi_resolution_marched(scene->shade.max_error, lights_of(scene, layer) == 0)
                   : otherwise;
    }
    if (!vshi_scene_method_is(scene, layer, VSH_METHOD_TRIANGLES, true)) {
        return otherwise; /* nothing is shaded that is known of */
    }
    vshi_resolution_need need = measure(scene, assets, layer);
    need.values = points * (double)lights_of(scene, layer);
    return vshi_resolution_traced(&need);
}
