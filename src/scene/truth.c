/* The casters themselves, as rays meet them: what errors are measured against. */
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "scene/occluders.h"

#include <stdlib.h>

typedef struct views {
    vsh_mesh *meshes;
    vsh_sdf *solids;
    double (*places)[12]; /* of the solids */
    size_t mesh_count, solid_count;
} views;

static bool has_triangles(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_MESH || caster->type == VSH_CASTER_HEIGHTFIELD;
}

static vsh_result allocate(const vsh_scene *scene, const vsh_assets *assets, views *v, vsh_error *error) {
    size_t meshes = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t own;
        vsh_assets_caster(assets, i, &own);
        meshes += own;
    }
    VSHI_TRY(vshi_allocate((void **)&v->meshes, meshes + 1, sizeof *v->meshes, "casters", error));
    const size_t most = scene->caster_count + 1;
    VSHI_TRY(vshi_allocate((void **)&v->solids, most, sizeof *v->solids, "casters", error));
    return vshi_allocate((void **)&v->places, most, sizeof *v->places, "casters", error);
}

static void collect(const vsh_scene *scene, const vsh_assets *assets, views *v) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        size_t own;
        const vsh_mesh *of_caster = vsh_assets_caster(assets, i, &own);
        for (size_t m = 0; m < own; ++m) {
            v->meshes[v->mesh_count++] = of_caster[m];
        }
        if (caster->type == VSH_CASTER_SDF) {
            memcpy(v->places[v->solid_count], caster->transform, sizeof caster->transform);
            v->solids[v->solid_count++] = caster->sdf;
        }
    }
}

static vsh_result make(const views *v, const vsh_run *run, vsh_triangles **triangles, vsh_solids **solids,
                       vsh_error *error) {
    if (v->solid_count > 0) {
        VSHI_TRY(vsh_solids_create(v->solids, v->places[0], v->solid_count, solids, error));
    }
    return v->mesh_count > 0 && vsh_triangles_available()
               ? vsh_triangles_create(v->meshes, v->mesh_count, run, triangles, error)
               : VSH_OK;
}

vsh_result vsh_scene_truth(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                           vsh_triangles **triangles, vsh_solids **solids, vsh_error *error) {
    VSHI_NEEDS(triangles);
    VSHI_NEEDS(solids);
    *triangles = NULL;
    *solids = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    views v = {.mesh_count = 0};
    vsh_result result;
    VSHI_TRY_DONE(allocate(scene, assets, &v, error));
    collect(scene, assets, &v);
    result = make(&v, run, triangles, solids, error);
    if (result != VSH_OK) {
        vsh_solids_free(*solids);
        *solids = NULL;
    }
done:
    free(v.places);
    free(v.solids);
    free(v.meshes);
    return result;
}

int32_t vsh_scene_has_truth(const vsh_scene *scene) {
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if ((caster->type != VSH_CASTER_SDF && !has_triangles(caster)) ||
            (has_triangles(caster) && !vsh_triangles_available())) {
            return 0;
        }
    }
    return scene != NULL;
}

bool vshi_scene_wants_truth(const vsh_scene *scene) {
    bool layered = scene->layer_count > 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        layered = layered || vshi_caster_is_direct(&scene->casters[i]);
    }
    return !layered && vsh_scene_has_truth(scene) &&
           vshi_scene_method_is(scene, NULL, VSH_METHOD_KEEPS_ERROR, true);
}
