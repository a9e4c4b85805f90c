/* The triangles of a scene's casters. */
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "mesh/mesh_set.h"
#include "scene/assets.h"
#include "scene/occluders.h"

#include <math.h>
#include <stdlib.h>

static const char *const type_names[] = {"a mesh",  "an sdf", "a vdb", "a heightfield",
                                         "spheres", "a mask", "a text"};

static bool is_voxelised_in(const vsh_caster *caster, const vsh_scene_layer *layer) {
    return vshi_caster_in_layer(caster, layer) && !vshi_caster_is_direct(caster);
}

static bool has_triangles(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_MESH || caster->type == VSH_CASTER_HEIGHTFIELD;
}

int32_t vsh_scene_traceable(const vsh_scene *scene, const vsh_scene_layer *layer) {
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        if (is_voxelised_in(&scene->casters[i], layer) && !has_triangles(&scene->casters[i])) {
            return 0;
        }
    }
    return scene != NULL;
}

static int32_t method_of(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return layer != NULL && layer->shade.method >= 0 ? layer->shade.method : scene->shade.method;
}

static bool casts_ao(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return (scene->ao || vsh_planes_shaded(&scene->planes) > 0) && (layer == NULL || layer->shade.ao);
}

bool vshi_scene_method_is(const vsh_scene *scene, const vsh_scene_layer *layer, uint32_t traits, bool has) {
    const int32_t can = vsh_scene_traceable(scene, layer) && vsh_triangles_available();
    const uint32_t shadow = vsh_shadow_method_traits(vsh_shadow_method_resolve(method_of(scene, layer), can));
    const uint32_t ao = vsh_ao_method_traits(vsh_ao_method_resolve(scene->shade.ao_method, can));
    return (scene->light_count > 0 && ((shadow & traits) == traits) == has) ||
           (casts_ao(scene, layer) && ((ao & traits) == traits) == has);
}

double vshi_scene_field_rays(const vsh_scene *scene, const vsh_scene_layer *layer) {
    /* over max_error, of all points; measured on the cloister, 0.6 units of AO and a sun of 5° */
    static const double OF_LIGHT = 0.14, OF_AO = 0.6;
    const int32_t can = vsh_scene_traceable(scene, layer) && vsh_triangles_available();
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

/* The meshes of a layer's casters, which stay those of the assets; the list is the caller's to free. */
static vsh_result list_meshes(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                              vsh_mesh **meshes, size_t *count, vsh_error *error) {
    size_t most = 0;
    *count = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t own;
        vsh_assets_caster(assets, i, &own);
        most += own;
    }
    VSHI_TRY(vshi_allocate((void **)meshes, most, sizeof **meshes, "triangles", error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t own;
        const vsh_mesh *of_caster = vsh_assets_caster(assets, i, &own);
        for (size_t m = 0; is_voxelised_in(&scene->casters[i], layer) && m < own; ++m) {
            (*meshes)[(*count)++] = of_caster[m];
        }
    }
    return VSH_OK;
}

vsh_result vsh_scene_triangles(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                               const vsh_run *run, vsh_triangles **triangles, vsh_error *error) {
    VSHI_NEEDS(triangles);
    *triangles = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (is_voxelised_in(caster, layer) && !has_triangles(caster)) {
            const bool known = caster->type > VSH_CASTER_MESH && caster->type <= VSH_CASTER_TEXT;
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "casters[%zu] is %s: exact methods trace triangles, and need casters that are "
                             "all meshes or heightfields",
                             i, known ? type_names[caster->type] : "of no type");
        }
    }
    vsh_mesh *meshes;
    size_t count;
    VSHI_TRY(list_meshes(scene, assets, layer, &meshes, &count, error));
    const vsh_result result = count > 0 ? vsh_triangles_create(meshes, count, run, triangles, error) : VSH_OK;
    free(meshes);
    return result;
}

vsh_result vshi_scene_note_solidity(const vsh_scene *scene, const vsh_assets *assets,
                                    const vsh_scene_layer *layer, const vsh_run *run, vsh_error *error) {
    if (!vshi_wants_notes(run)) {
        return VSH_OK;
    }
    vshi_mesh_set set = {.count = 0};
    vsh_mesh *meshes;
    size_t count;
    vsh_result result;
    VSHI_TRY_DONE(list_meshes(scene, assets, layer, &meshes, &count, error));
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, count, &set, error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(&set, run, error));
    vshi_mesh_set_note(&set, 0.0, 0.0, run);
done:
    vshi_mesh_set_free(&set);
    free(meshes);
    return result;
}
