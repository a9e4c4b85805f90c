/* A scene's casters as rays meet them. */
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "field/surface.h"
#include "scene/occluders.h"
#include "shade/resolution.h"
#include "spheres/spheres.h"
#include "trace/embree.h"

#include <stdlib.h>

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
    size_t sdfs = 1, balls = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_spheres *spheres = vshi_assets_caster(assets, i)->spheres;
        balls += spheres != NULL ? spheres->info.count : 0;
        sdfs += scene->casters[i].type == VSH_CASTER_SDF;
    }
    const size_t meshes = vshi_assets_mesh_count(assets) + scene->caster_count + 1;
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
    const vshi_asset_place *place = vshi_assets_caster(assets, i);
    for (size_t m = 0; m < place->count; ++m) {
        t->meshes[t->mesh_count++] = place->meshes[m];
    }
    if (caster->type == VSH_CASTER_SDF) {
        add_sdf(t, caster->sdf, caster->transform);
    } else if (caster->type == VSH_CASTER_SPHERES) {
        add_balls(t, place->spheres);
    } else if (!vshi_caster_has_triangles(caster)) {
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
        if (vshi_caster_has_voxels(scene, &scene->casters[i], layer)) {
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
