#include "truth.h"

#include "clock.h"
#include "meshes.h"
#include "message.h"

#include <stdlib.h>
#include <string.h>

typedef struct views {
    vsh_mesh *meshes;
    vsh_sdf *solids;
    double *places; /* [solids][12] */
    size_t mesh_count, solid_count;
} views;

static void collect(const vsh_scene *scene, const vsh_assets *assets, views *v) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        size_t own;
        const vsh_mesh *of_caster = vsh_assets_caster(assets, i, &own);
        for (size_t m = 0; m < own; ++m) {
            v->meshes[v->mesh_count++] = of_caster[m];
        }
        if (caster->type == VSH_CASTER_SDF) {
            memcpy(v->places + 12 * v->solid_count, caster->transform, sizeof caster->transform);
            v->solids[v->solid_count++] = caster->sdf;
        }
    }
}

vsh_result cli_truth_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vsh_triangles **triangles, vsh_solids **solids, double *seconds,
                             vsh_error *error) {
    size_t meshes = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t own;
        vsh_assets_caster(assets, i, &own);
        meshes += own;
    }
    views v = {.meshes = calloc(meshes + 1, sizeof *v.meshes),
               .solids = calloc(scene->caster_count + 1, sizeof *v.solids),
               .places = calloc(scene->caster_count + 1, 12 * sizeof *v.places)};
    vsh_result result = VSH_OK;
    if (v.meshes == NULL || v.solids == NULL || v.places == NULL) {
        *error = (vsh_error){VSH_ERROR_MEMORY, "casters: the system refused memory"};
        result = error->code;
    }
    if (result == VSH_OK) {
        collect(scene, assets, &v);
    }
    if (result == VSH_OK && v.solid_count > 0) {
        result = vsh_solids_create(v.solids, v.places, v.solid_count, solids, error);
    }
    if (result == VSH_OK && v.mesh_count > 0 && vsh_triangles_available()) {
        const double start = cli_seconds();
        result = vsh_triangles_create(v.meshes, v.mesh_count, run, triangles, error);
        if (seconds != NULL) {
            *seconds = cli_seconds() - start;
        }
    }
    free(v.places);
    free(v.solids);
    free(v.meshes);
    return result;
}

bool cli_truth_traceable(const vsh_scene *scene) {
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if ((caster->type != VSH_CASTER_SDF && !cli_caster_has_triangles(caster)) ||
            (cli_caster_has_triangles(caster) && !vsh_triangles_available())) {
            return false;
        }
    }
    return true;
}

static bool estimates(uint32_t traits) {
    return (traits & VSH_METHOD_KEEPS_ERROR) != 0;
}

static bool is_wanted(const vsh_scene *scene) {
    const int32_t can = vsh_scene_traceable(scene, NULL) && vsh_triangles_available();
    const int32_t method = vsh_shadow_method_resolve(scene->shade.method, can);
    const int32_t ao_method = vsh_ao_method_resolve(scene->shade.ao_method, can);
    bool layered = scene->layer_count > 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        layered = layered || cli_caster_is_direct(&scene->casters[i]);
    }
    return !layered && cli_truth_traceable(scene) &&
           ((scene->light_count > 0 && estimates(vsh_shadow_method_traits(method))) ||
            (scene->ao && estimates(vsh_ao_method_traits(ao_method))));
}

int cli_truth_make(const vsh_scene *scene, const vsh_assets *assets, const vsh_triangles *triangles,
                   const vsh_run *run, cli_truth *truth) {
    *truth = (cli_truth){NULL, NULL, NULL};
    if (!is_wanted(scene)) {
        return CLI_OK;
    }
    if (triangles != NULL) { /* all casters have some, or no method would trace them */
        truth->triangles = triangles;
        return CLI_OK;
    }
    vsh_error error;
    const vsh_result result =
        cli_truth_casters(scene, assets, run, &truth->own, &truth->solids, NULL, &error);
    if (result == VSH_ERROR_CANCELLED) {
        return cli_fail_of(NULL, &error);
    }
    if (result != VSH_OK) { /* the bake itself needs none of it */
        cli_truth_free(truth);
    }
    truth->triangles = truth->own;
    return CLI_OK;
}

void cli_truth_free(cli_truth *truth) {
    vsh_solids_free(truth->solids);
    vsh_triangles_free(truth->own);
    *truth = (cli_truth){NULL, NULL, NULL};
}
