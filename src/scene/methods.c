/* How casters are shaded: which methods, with voxels or without, and how many voxels by default. */
#include "base/floats.h"
#include "mesh/mesh_set.h"
#include "scene/assets.h"
#include "shade/resolution.h"

#include <math.h>

bool vshi_caster_has_triangles(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_MESH || caster->type == VSH_CASTER_HEIGHTFIELD;
}

static bool has_solids(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SDF || caster->type == VSH_CASTER_SPHERES;
}

bool vshi_caster_has_voxels(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer) {
    return vshi_caster_in_layer(caster, layer) && !vshi_caster_is_direct(scene, caster);
}

/* --- methods */

/* A level set alone keeps its voxels when it is marched. Several, or one beside other casters, would have to
 * be resampled to the voxels of all. */
int32_t vsh_scene_traceable(const vsh_scene *scene, const vsh_scene_layer *layer) {
    size_t exact = 0, level_sets = 0, outlines = 0;
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (vshi_caster_has_voxels(scene, caster, layer)) {
            exact += vshi_caster_has_triangles(caster) || has_solids(caster);
            level_sets += caster->type == VSH_CASTER_VDB;
            outlines += caster->type == VSH_CASTER_MASK || caster->type == VSH_CASTER_TEXT;
        }
    }
    const bool alone = exact == 0 && (level_sets == 0) != (outlines == 0) && level_sets <= 1;
    return scene != NULL && !alone;
}

static int32_t method_of(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return layer != NULL && layer->shade.method >= 0 ? layer->shade.method : scene->shade.method;
}

static bool casts_ao(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return (scene->ao || vsh_planes_shaded(&scene->planes) > 0) && (layer == NULL || layer->shade.ao);
}

bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster) {
    const bool may = (caster->type == VSH_CASTER_HEIGHTFIELD && caster->direct != 0) ||
                     (caster->type == VSH_CASTER_SPHERES && caster->voxelised == 0);
    if (!may) {
        return false;
    }
    const vsh_scene_layer *layer = NULL;
    for (size_t i = 0; caster->layer != NULL && i < scene->layer_count; ++i) {
        layer = strcmp(scene->layers[i].name, caster->layer) == 0 ? &scene->layers[i] : layer;
    }
    const int32_t method = method_of(scene, layer);
    const bool traced = vsh_ao_method_resolve(scene->shade.ao_method, 1) == VSH_AO_EXACT;
    return scene->light_count > 0 && (method == VSH_SHADOW_HARD || method == VSH_SHADOW_CLASSIC) &&
           (traced || !casts_ao(scene, layer));
}

bool vshi_scene_method_is(const vsh_scene *scene, const vsh_scene_layer *layer, uint32_t traits, bool has) {
    const int32_t can = vsh_scene_traceable(scene, layer);
    const uint32_t shadow = vsh_shadow_method_traits(vsh_shadow_method_resolve(method_of(scene, layer), can));
    const uint32_t ao = vsh_ao_method_traits(vsh_ao_method_resolve(scene->shade.ao_method, can));
    return (scene->light_count > 0 && ((shadow & traits) == traits) == has) ||
           (casts_ao(scene, layer) && ((ao & traits) == traits) == has);
}

double vshi_scene_field_rays(const vsh_scene *scene, const vsh_scene_layer *layer) {
    /* over max_error, of all points; measured on the cloister, 0.6 units of AO and a sun of 5° */
    static const double OF_LIGHT = 0.14, OF_AO = 0.6;
    const int32_t can = vsh_scene_traceable(scene, layer);
    const int32_t method = vsh_shadow_method_resolve(method_of(scene, layer), can);
    double rays = method == VSH_SHADOW_ADAPTIVE ? OF_LIGHT * (double)scene->light_count : 0.0;
    if (casts_ao(scene, layer) && vsh_ao_method_resolve(scene->shade.ao_method, can) == VSH_AO_ADAPTIVE) {
        rays += OF_AO;
    }
    rays /= scene->shade.max_error;
    return scene->shade.rays > 0 ? fmin(rays, scene->shade.rays) : rays;
}

int32_t vsh_scene_marches(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return scene != NULL && vshi_scene_method_is(scene, layer, VSH_METHOD_TRIANGLES, false);
}

bool vshi_scene_wants_truth(const vsh_scene *scene) {
    bool measured =
        scene->layer_count == 0 && vshi_scene_method_is(scene, NULL, VSH_METHOD_KEEPS_ERROR, true);
    for (size_t i = 0; i < scene->caster_count; ++i) { /* of these voxels are the definition, or as good */
        const vsh_caster *caster = &scene->casters[i];
        measured = measured && (vshi_caster_has_triangles(caster) || has_solids(caster)) &&
                   !vshi_caster_is_direct(scene, caster);
    }
    return measured;
}

/* --- voxels */

bool vshi_scene_voxels_named(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return scene->voxels_named != 0 || scene->grid.voxel_size > 0.0 ||
           scene->grid.resolution != vsh_grid_options_default().resolution ||
           (layer != NULL && (layer->voxel_size > 0.0 || layer->resolution > 0));
}

bool vshi_scene_is_level_set(const vsh_scene *scene, const vsh_scene_layer *layer) {
    size_t level_sets = 0, count = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (vshi_caster_has_voxels(scene, caster, layer)) {
            ++count;
            level_sets += caster->type == VSH_CASTER_VDB;
        }
    }
    return count == 1 && level_sets == 1;
}

bool vshi_scene_keeps_voxels(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return vshi_scene_is_level_set(scene, layer) && !vshi_scene_voxels_named(scene, layer);
}

/* Lights that a layer's casters cast for. */
static size_t lights_of(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return layer == NULL || layer->shade.lights == NULL ? scene->light_count : layer->shade.light_count;
}

/* Adds up the area, the triangles and the box of a layer's meshes. */
static vshi_resolution_need measure(const vsh_scene *scene, const vsh_assets *assets,
                                    const vsh_scene_layer *layer) {
    vshi_resolution_need need = {.max_error = scene->shade.max_error};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        for (size_t m = 0; m < count && vshi_caster_has_voxels(scene, &scene->casters[i], layer); ++m) {
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

/* Whether all values come from voxels by methods that keep the error, and voxels can follow the shapes of all
 * casters. Meshes may be too thin for that, and level sets have voxels of their own. */
static bool are_followed(const vsh_scene *scene, const vsh_scene_layer *layer) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        const bool shaped = caster->type == VSH_CASTER_SDF || caster->type == VSH_CASTER_MASK ||
                            caster->type == VSH_CASTER_TEXT || caster->type == VSH_CASTER_SPHERES;
        if (vshi_caster_has_voxels(scene, caster, layer) && !shaped) {
            return false;
        }
    }
    return !vshi_scene_method_is(scene, layer, VSH_METHOD_KEEPS_ERROR, false);
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
