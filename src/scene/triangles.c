/* A scene's casters as rays meet them. */
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/surface.h"
#include "mesh/mesh_set.h"
#include "scene/assets.h"
#include "scene/occluders.h"
#include "shade/resolution.h"
#include "spheres/spheres.h"
#include "trace/embree.h"

#include <math.h>
#include <stdlib.h>

static bool is_voxelised_in(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer) {
    return vshi_caster_in_layer(caster, layer) && !vshi_caster_is_direct(scene, caster);
}

static bool has_triangles(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_MESH || caster->type == VSH_CASTER_HEIGHTFIELD;
}

static bool has_solids(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SDF || caster->type == VSH_CASTER_SPHERES;
}

/* A level set alone keeps its voxels when it is marched. Several, or one beside other casters, would have to
 * be resampled to the voxels of all. */
int32_t vsh_scene_traceable(const vsh_scene *scene, const vsh_scene_layer *layer) {
    size_t exact = 0, level_sets = 0, outlines = 0;
    for (size_t i = 0; scene != NULL && i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (is_voxelised_in(scene, caster, layer)) {
            exact += has_triangles(caster) || has_solids(caster);
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

/* What rays meet, of casters that are voxelised. */
typedef struct traced {
    vsh_mesh *meshes; /* the casters' own, and those of `surfaces` */
    vshi_surface_mesh *surfaces;
    vsh_sdf *sdfs;
    double (*places)[12]; /* of the sdfs */
    vsh_sdf_node *balls;
    size_t mesh_count, surface_count, sdf_count, ball_count;
} traced;

static void free_traced(traced *t) {
    while (t->surface_count > 0) {
        vshi_surface_mesh_free(&t->surfaces[--t->surface_count]);
    }
    free(t->balls);
    free(t->places);
    free(t->sdfs);
    free(t->surfaces);
    free(t->meshes);
}

static vsh_result allocate_traced(const vsh_scene *scene, const vsh_assets *assets, traced *t,
                                  vsh_error *error) {
    size_t meshes = 1, sdfs = 1, balls = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        size_t own;
        vsh_assets_caster(assets, i, &own);
        meshes += own + 1;
        sdfs += scene->casters[i].type == VSH_CASTER_SDF;
        if (scene->casters[i].type == VSH_CASTER_SPHERES) {
            balls += vshi_assets_spheres(assets, i)->info.count;
        }
    }
    VSHI_TRY(vshi_allocate((void **)&t->meshes, meshes, sizeof *t->meshes, "casters", error));
    VSHI_TRY(vshi_allocate((void **)&t->surfaces, meshes, sizeof *t->surfaces, "casters", error));
    VSHI_TRY(vshi_allocate((void **)&t->sdfs, sdfs + balls, sizeof *t->sdfs, "casters", error));
    VSHI_TRY(vshi_allocate((void **)&t->places, sdfs + balls, sizeof *t->places, "casters", error));
    return vshi_allocate((void **)&t->balls, balls, sizeof *t->balls, "casters", error);
}

static void add_sdf(traced *t, vsh_sdf sdf, const double transform[12]) {
    memcpy(t->places[t->sdf_count], transform, sizeof t->places[0]);
    t->sdfs[t->sdf_count++] = sdf;
}

static void add_balls(traced *t, const vsh_spheres *spheres) {
    static const double identity[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    for (size_t i = 0; i < spheres->info.count; ++i) {
        vsh_sdf_node *ball = &t->balls[t->ball_count++];
        *ball = vsh_sdf_node_default();
        memcpy(ball->translation, spheres->sphere[i], sizeof ball->translation);
        ball->radius = spheres->sphere[i][3];
        add_sdf(t, (vsh_sdf){ball, 1}, identity);
    }
}

/* The surface of a caster's own level set: a file's keeps its voxels; an outline's are those that are named,
 * or suit the error. */
static vsh_result add_surface(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                              size_t caster, const vsh_run *run, traced *t, vsh_error *error) {
    vsh_grid_options grid_options = vshi_scene_grid_options(scene, layer);
    if (scene->casters[caster].type == VSH_CASTER_VDB) {
        grid_options.voxel_size = 0.0;
        grid_options.resolution = 0;
    } else if (!vshi_scene_voxels_named(scene, layer)) {
        grid_options.resolution = vshi_resolution_marched(scene->shade.max_error, scene->light_count == 0);
    }
    vsh_field_options field_options = vsh_field_options_default();
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_scene_caster_grid(scene, assets, caster, &grid_options, run, &grid, error));
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    field_options.reach = info.voxel_size; /* the finest level alone */
    VSHI_TRY_DONE(vsh_field_create(grid, &field_options, run, &field, error));
    vshi_surface_mesh *surface = &t->surfaces[t->surface_count++];
    VSHI_TRY_DONE(vshi_surface_mesh_make(field, run, surface, error));
    t->meshes[t->mesh_count++] = (vsh_mesh){.positions = surface->positions,
                                            .indices = surface->indices,
                                            .vertex_count = surface->vertex_count,
                                            .triangle_count = surface->triangle_count,
                                            .transform = surface->transform,
                                            .solidity = VSH_SOLIDITY_SOLID};
done:
    vsh_field_free(field);
    vsh_grid_free(grid);
    return result;
}

static vsh_result add_caster(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                             size_t i, const vsh_run *run, traced *t, vsh_error *error) {
    const vsh_caster *caster = &scene->casters[i];
    size_t own;
    const vsh_mesh *of_caster = vsh_assets_caster(assets, i, &own);
    for (size_t m = 0; m < own; ++m) {
        t->meshes[t->mesh_count++] = of_caster[m];
    }
    if (caster->type == VSH_CASTER_SDF) {
        add_sdf(t, caster->sdf, caster->transform);
    } else if (caster->type == VSH_CASTER_SPHERES) {
        add_balls(t, vshi_assets_spheres(assets, i));
    } else if (!has_triangles(caster)) {
        return add_surface(scene, assets, layer, i, run, t, error);
    }
    return VSH_OK;
}

static vsh_result make_triangles(const traced *t, const vsh_run *run, vsh_triangles **triangles,
                                 vsh_error *error) {
    vsh_solids *solids = NULL;
    if (t->mesh_count + t->sdf_count == 0) {
        return VSH_OK;
    }
    if (t->sdf_count > 0) {
        VSHI_TRY(vsh_solids_create(t->sdfs, t->places[0], t->sdf_count, &solids, error));
    }
    const vsh_result result =
        vsh_triangles_create_beside(t->meshes, t->mesh_count, solids, run, triangles, error);
    if (result == VSH_OK) {
        vshi_triangles_own_solids(*triangles);
    } else {
        vsh_solids_free(solids);
    }
    return result;
}

vsh_result vsh_scene_triangles(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                               const vsh_run *run, vsh_triangles **triangles, vsh_error *error) {
    VSHI_NEEDS(triangles);
    *triangles = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    traced t = {.mesh_count = 0};
    vsh_run full;
    vsh_result result;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY_DONE(allocate_traced(scene, assets, &t, error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        if (is_voxelised_in(scene, &scene->casters[i], layer)) {
            VSHI_TRY_DONE(add_caster(scene, assets, layer, i, &full, &t, error));
        }
    }
    result = make_triangles(&t, run, triangles, error);
done:
    free_traced(&t);
    return result;
}

vsh_result vshi_scene_caster_triangles(const vsh_scene *scene, const vsh_assets *assets, size_t caster,
                                       const vsh_run *run, vsh_triangles **triangles, vsh_error *error) {
    traced t = {.mesh_count = 0};
    vsh_result result;
    VSHI_TRY_DONE(allocate_traced(scene, assets, &t, error));
    VSHI_TRY_DONE(add_caster(scene, assets, NULL, caster, run, &t, error));
    result = make_triangles(&t, run, triangles, error);
done:
    free_traced(&t);
    return result;
}

/* The casters as estimates measure errors against them. */
vsh_result vsh_scene_truth(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                           vsh_triangles **triangles, vsh_solids **solids, vsh_error *error) {
    VSHI_NEEDS(triangles);
    VSHI_NEEDS(solids);
    *triangles = NULL;
    *solids = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    traced t = {.mesh_count = 0};
    vsh_run full;
    vsh_result result;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY_DONE(allocate_traced(scene, assets, &t, error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        VSHI_TRY_DONE(add_caster(scene, assets, NULL, i, &full, &t, error));
    }
    if (t.mesh_count > 0) {
        VSHI_TRY_DONE(vsh_triangles_create(t.meshes, t.mesh_count, run, triangles, error));
    }
    if (t.sdf_count > 0) {
        result = vsh_solids_create(t.sdfs, t.places[0], t.sdf_count, solids, error);
    }
done:
    if (result != VSH_OK) {
        vsh_triangles_free(*triangles);
        *triangles = NULL;
    }
    free_traced(&t);
    return result;
}

bool vshi_scene_wants_truth(const vsh_scene *scene) {
    bool measured =
        scene->layer_count == 0 && vshi_scene_method_is(scene, NULL, VSH_METHOD_KEEPS_ERROR, true);
    for (size_t i = 0; i < scene->caster_count; ++i) { /* of these voxels are the definition, or as good */
        const vsh_caster *caster = &scene->casters[i];
        measured = measured && (has_triangles(caster) || has_solids(caster)) &&
                   !vshi_caster_is_direct(scene, caster);
    }
    return measured;
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
        for (size_t m = 0; is_voxelised_in(scene, &scene->casters[i], layer) && m < own; ++m) {
            (*meshes)[(*count)++] = of_caster[m];
        }
    }
    return VSH_OK;
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
