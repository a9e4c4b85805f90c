/* Makes one level set of a scene's casters, and triangles and solids for rays. */
#include "base/floats.h"
#include "base/similarity.h"
#include "field/surface.h"
#include "scene/assets.h"
#include "shade/resolution.h"
#include "spheres/spheres.h"
#include "trace/embree.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"

#include <stdlib.h>
#include <string.h>

/* --- which casters */

typedef enum choice { ALL, VOXELISED, OF_LAYER, ONE } choice;

/* Casters of a scene: all, all that have voxels, or of these those in `layer`, or (NULL) in none; or one. */
typedef struct chosen {
    const vsh_scene *scene;
    const vsh_assets *assets;
    choice choice;
    const vsh_scene_layer *layer;
    size_t one;
} chosen;

static bool takes(const chosen *of, size_t i) {
    const vsh_caster *caster = &of->scene->casters[i];
    return of->choice == ALL || (of->choice == ONE && i == of->one) ||
           (of->choice == VOXELISED && !vshi_caster_is_direct(of->scene, caster)) ||
           (of->choice == OF_LAYER && vshi_caster_has_voxels(of->scene, caster, of->layer));
}

static size_t count_taken(const chosen *of) {
    size_t count = 0;
    for (size_t i = 0; i < of->scene->caster_count; ++i) {
        count += takes(of, i);
    }
    return count;
}

/* --- one level set */

/* Of a scene and on the way from it: measured with 65,536 of one node, what is left of their text included.
 */
enum { BYTES_PER_CASTER = 1536 };

/* An sdf caster ready for voxels: a tree in world space, or a mirrored one (which no quaternion turns) that
 * its grid's instance mirrors. */
typedef struct placed_sdf {
    vsh_sdf_node *nodes; /* owned; NULL where the caster's own serve */
    vsh_sdf sdf;
    double scale;            /* from the grid's space to the world; 1 for a folded tree */
    const double *transform; /* of the grid's instance; NULL for a folded tree */
} placed_sdf;

/* What is gathered on the way to one grid. */
typedef struct assembly {
    chosen of;
    vsh_mesh *meshes; /* [mesh_count]: those of all casters */
    size_t mesh_count;
    placed_sdf *sdfs; /* [caster_count]; zero for casters that are none */
    vsh_grid_instance *instances;
    size_t instance_count;
    vsh_grid **made; /* grids of ours among the instances */
    size_t made_count;
    vsh_grid_options options;
} assembly;

static vsh_result place_sdf(const vsh_caster *caster, placed_sdf *placed, vsh_error *error) {
    const double *m = caster->transform;
    const double scale = vshi_similarity_scale(m);
    placed->sdf = caster->sdf;
    if (vshi_transform_determinant(m) < 0.0) {
        placed->scale = scale;
        placed->transform = m;
        return VSH_OK;
    }
    void *memory = NULL;
    VSHI_TRY(vshi_allocate(&memory, caster->sdf.node_count, sizeof *placed->nodes, "sdf nodes", error));
    placed->nodes = memory;
    memcpy(placed->nodes, caster->sdf.nodes, caster->sdf.node_count * sizeof *placed->nodes);
    placed->sdf.nodes = placed->nodes;
    placed->scale = 1.0;
    vsh_sdf_node *root = &placed->nodes[caster->sdf.node_count - 1];
    double rotation[4];
    vshi_similarity_rotation(m, scale, rotation);
    vshi_quaternion_multiply(rotation, root->rotation, root->rotation);
    const vshi_vec t = vshi_transform_point(m, vshi_vec_of(root->translation));
    root->translation[0] = t.x;
    root->translation[1] = t.y;
    root->translation[2] = t.z;
    root->scale *= scale;
    return VSH_OK;
}

static vsh_result allocate_assembly(assembly *a, vsh_error *error) {
    const size_t casters = a->of.scene->caster_count, meshes = vshi_assets_mesh_count(a->of.assets);
    VSHI_TRY(vshi_allocate((void **)&a->meshes, meshes, sizeof *a->meshes, "meshes", error));
    VSHI_TRY(vshi_allocate((void **)&a->sdfs, casters, sizeof *a->sdfs, "casters", error));
    VSHI_TRY(vshi_allocate((void **)&a->instances, casters + 1, sizeof *a->instances, "casters", error));
    return vshi_allocate((void **)&a->made, casters + 1, sizeof *a->made, "casters", error);
}

/* Names a caster that must keep its shape; NULL: it may be sheared. */
static const char *name_rigid(const vsh_caster *caster) {
    return caster->type == VSH_CASTER_SDF                                       ? "an sdf"
           : caster->type == VSH_CASTER_VDB                                     ? "a level set"
           : caster->type == VSH_CASTER_MASK || caster->type == VSH_CASTER_TEXT ? "a mask or text"
                                                                                : NULL;
}

static vsh_result gather_caster(assembly *a, size_t i, vsh_error *error) {
    const vsh_caster *caster = &a->of.scene->casters[i];
    const vshi_asset_place *place = vshi_assets_caster(a->of.assets, i);
    const char *rigid = name_rigid(caster);
    const bool vdb = caster->type == VSH_CASTER_VDB;
    if (caster->type == VSH_CASTER_SDF) {
        VSHI_TRY(vsh_sdf_check(&caster->sdf, error));
    }
    if (rigid != NULL && vshi_similarity_scale(caster->transform) <= 0.0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "caster %zu: %s%sthe transform of %s must neither shear nor scale unevenly", i,
                         vdb ? caster->path : "", vdb ? ": " : "", rigid);
    }
    if (vdb && place->grid == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "caster %zu: %s: was not read, as the scene takes its field from a file", i,
                         caster->path);
    }
    if (caster->type == VSH_CASTER_SDF) {
        VSHI_TRY(place_sdf(caster, &a->sdfs[i], error));
    }
    for (size_t k = 0; k < place->count; ++k) {
        a->meshes[a->mesh_count++] = place->meshes[k];
    }
    return VSH_OK;
}

static vsh_result gather(assembly *a, vsh_error *error) {
    for (size_t i = 0; i < a->of.scene->caster_count; ++i) {
        if (takes(&a->of, i)) {
            VSHI_TRY(gather_caster(a, i, error));
        }
    }
    return VSH_OK;
}

typedef struct world_box {
    vshi_vec min;
    vshi_vec max;
} world_box;

/* Grows `all` by a box under a transform (NULL: identity); an empty box grows nothing. */
static void grow_box(world_box *all, const double min[3], const double max[3], const double *transform) {
    if (!(min[0] <= max[0] && min[1] <= max[1] && min[2] <= max[2])) {
        return;
    }
    for (int corner = 0; corner < 8; ++corner) {
        const vshi_vec p = vshi_transform_point(transform, (vshi_vec){corner & 1 ? max[0] : min[0],
                                                                      corner & 2 ? max[1] : min[1],
                                                                      corner & 4 ? max[2] : min[2]});
        all->min = (vshi_vec){fmin(all->min.x, p.x), fmin(all->min.y, p.y), fmin(all->min.z, p.z)};
        all->max = (vshi_vec){fmax(all->max.x, p.x), fmax(all->max.y, p.y), fmax(all->max.z, p.z)};
    }
}

static const world_box empty_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

/* A resolution of 0: the voxels of the finest level set, which stays as it is where there is nothing else. */
static vsh_result take_own_voxels(assembly *a, double finest, vsh_error *error) {
    if (!isfinite(finest)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "resolution 0: no caster is a level set, whose voxel size it stands for");
    }
    a->options.resolution = vsh_grid_options_default().resolution; /* not looked at */
    a->options.voxel_size = count_taken(&a->of) > 1 ? finest : 0.0;
    return VSH_OK;
}

/* The voxel size on which casters of several kinds must agree before the first is voxelised. */
static vsh_result choose_voxel_size(assembly *a, vsh_error *error) {
    world_box all = empty_box;
    double finest = INFINITY; /* of the level sets */
    for (size_t i = 0; i < a->mesh_count; ++i) {
        const vsh_mesh_report *report = &a->meshes[i].checked->report;
        grow_box(&all, report->bounds_min, report->bounds_max, NULL);
    }
    for (size_t i = 0; i < a->of.scene->caster_count; ++i) {
        const vsh_caster *caster = &a->of.scene->casters[i];
        const vshi_asset_place *place = vshi_assets_caster(a->of.assets, i);
        if (!takes(&a->of, i)) {
            continue;
        }
        if (caster->type == VSH_CASTER_SDF) {
            double min[3], max[3];
            vsh_sdf_bounds(&a->sdfs[i].sdf, min, max);
            grow_box(&all, min, max, a->sdfs[i].transform);
        } else if (caster->type == VSH_CASTER_VDB) {
            vsh_grid_info info;
            vsh_grid_get_info(place->grid, &info);
            grow_box(&all, info.bounds_min, info.bounds_max, caster->transform);
            finest = fmin(finest, info.voxel_size * vshi_similarity_scale(caster->transform));
        } else if (place->outline != NULL) {
            vsh_outline_info info;
            vsh_outline_get_info(place->outline, &info);
            const double half = 0.5 * caster->thickness;
            grow_box(&all, (const double[]){info.bounds_min[0], info.bounds_min[1], -half},
                     (const double[]){info.bounds_max[0], info.bounds_max[1], half}, caster->transform);
        } else if (caster->type == VSH_CASTER_SPHERES) {
            vsh_spheres_info info;
            vsh_spheres_get_info(place->spheres, &info);
            grow_box(&all, info.bounds_min, info.bounds_max, NULL);
        }
    }
    if (a->options.resolution == 0) {
        return take_own_voxels(a, finest, error);
    }
    const vshi_vec sides = vshi_sub(all.max, all.min);
    const double longest = fmax(sides.x, fmax(sides.y, sides.z));
    if (!(longest > 0.0) || !isfinite(longest)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "scene: the casters have no extent");
    }
    if (a->options.resolution < 2 || a->options.resolution > 65536) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "resolution %d: expected 2 … 65536",
                         a->options.resolution);
    }
    a->options.voxel_size = longest / a->options.resolution;
    return VSH_OK;
}

/* Warns of level sets whose voxels become others, where values are marched through these. */
static void warn_resampled(const assembly *a, const vsh_run *run) {
    static const double SAME = 1e-4;
    for (size_t i = 0; i < a->of.scene->caster_count && vsh_scene_marches(a->of.scene, a->of.layer); ++i) {
        const vsh_caster *caster = &a->of.scene->casters[i];
        if (!takes(&a->of, i) || caster->type != VSH_CASTER_VDB || a->options.voxel_size == 0.0) {
            continue;
        }
        vsh_grid_info info;
        vsh_grid_get_info(vshi_assets_caster(a->of.assets, i)->grid, &info);
        const double own = info.voxel_size * vshi_similarity_scale(caster->transform);
        if (fabs(own - a->options.voxel_size) > SAME * own) {
            vshi_warn(run, "%s: its voxels of %g are resampled to %g; --resolution 0 keeps them",
                      caster->path, own, a->options.voxel_size);
        }
    }
}

/* The grid that was made last: one of the union, and held until that is there. Small ones are checked here
 * alone, together with all before. */
static vsh_result add_made(assembly *a, const double *transform, vsh_run *run, vsh_error *error) {
    const vsh_grid *grid = a->made[a->made_count++];
    a->instances[a->instance_count++] = (vsh_grid_instance){grid, transform};
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    run->memory_held += info.bytes;
    return vshi_check_limit(run, 0.0, "level sets of the casters", error);
}

static double spheres_distance(void *user, const double position[3]) {
    return vshi_sphere_tree_distance(user, position);
}

/* Distances to a union are true outside of it, and a bound within. */
static vsh_result voxelise_spheres(assembly *a, const vsh_spheres *spheres, vsh_run *run, vsh_error *error) {
    vsh_spheres_info info;
    vsh_spheres_get_info(spheres, &info);
    vsh_distance field = {.distance = spheres_distance,
                          .user = (void *)(uintptr_t)spheres, /* which is only read */
                          .lipschitz = 1.0,
                          .exact = info.count == 1};
    memcpy(field.bounds_min, info.bounds_min, sizeof field.bounds_min);
    memcpy(field.bounds_max, info.bounds_max, sizeof field.bounds_max);
    vsh_grid **made = &a->made[a->made_count];
    VSHI_TRY(vsh_grid_from_distance(&field, &a->options, run, made, error));
    return add_made(a, NULL, run, error);
}

/* The limit of memory is that of all the grids together: run->memory_held grows by each. */
static vsh_result make_grid(assembly *a, size_t i, vsh_run *run, vsh_error *error) {
    const vsh_caster *caster = &a->of.scene->casters[i];
    const vshi_asset_place *place = vshi_assets_caster(a->of.assets, i);
    vsh_grid **made = &a->made[a->made_count];
    if (caster->type == VSH_CASTER_VDB) {
        a->instances[a->instance_count++] = (vsh_grid_instance){place->grid, caster->transform};
    } else if (caster->type == VSH_CASTER_SDF) {
        const placed_sdf *placed = &a->sdfs[i];
        vsh_grid_options options = a->options;
        options.voxel_size /= placed->scale;
        VSHI_TRY(vsh_grid_from_sdf(&placed->sdf, &options, run, made, error));
        return add_made(a, placed->transform, run, error);
    } else if (place->outline != NULL) {
        VSHI_TRY(vsh_grid_from_outline(place->outline, caster->thickness, caster->transform, &a->options, run,
                                       made, error));
        return add_made(a, NULL, run, error);
    } else if (caster->type == VSH_CASTER_SPHERES) {
        return voxelise_spheres(a, place->spheres, run, error);
    }
    return VSH_OK;
}

static vsh_result make_grids(assembly *a, vsh_run *run, vsh_error *error) {
    if (a->mesh_count > 0) {
        vsh_grid **made = &a->made[a->made_count];
        VSHI_TRY(vsh_grid_from_meshes(a->meshes, a->mesh_count, &a->options, run, made, error));
        VSHI_TRY(add_made(a, NULL, run, error));
    }
    for (size_t i = 0; i < a->of.scene->caster_count; ++i) {
        if (takes(&a->of, i)) {
            VSHI_TRY(make_grid(a, i, run, error));
        }
    }
    return VSH_OK;
}

static vsh_result unite(assembly *a, const vsh_run *run, vsh_grid **grid, vsh_error *error) {
    if (a->instance_count == 1 && a->made_count == 1 && a->instances[0].transform == NULL) {
        *grid = a->made[0];
        a->made_count = 0;
        return VSH_OK;
    }
    return vsh_grid_unite(a->instances, a->instance_count, &a->options, run, grid, error);
}

static void free_assembly(assembly *a) {
    while (a->made_count > 0) {
        vsh_grid_free(a->made[--a->made_count]);
    }
    for (size_t i = 0; a->sdfs != NULL && i < a->of.scene->caster_count; ++i) {
        free(a->sdfs[i].nodes);
    }
    free(a->made);
    free(a->instances);
    free(a->sdfs);
    free(a->meshes);
}

/* How a layer's casters, or (NULL) those in none, are voxelised. */
static vsh_grid_options choose_grid_options(const vsh_scene *scene, const vsh_scene_layer *layer) {
    vsh_grid_options options = scene->grid;
    if (vshi_scene_keeps_voxels(scene, layer)) {
        options.resolution = 0;
    }
    if (layer != NULL && (layer->voxel_size != 0.0 || layer->resolution != 0)) {
        options.voxel_size = layer->voxel_size;
        options.resolution = layer->resolution;
    }
    return options;
}

/* The union of the casters that are chosen, with these options over the defaults. */
static vsh_result assemble(const chosen *of, const vsh_grid_options *options, const vsh_run *run,
                           vsh_grid **grid, vsh_error *error) {
    assembly a = {.of = *of, .options = vsh_grid_options_default()};
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY(vshi_options_resolve(options, &a.options, sizeof a.options, "vsh_grid_options", error));
    vsh_result result;
    full.memory_held += of->scene->caster_count * BYTES_PER_CASTER;
    VSHI_TRY_DONE(allocate_assembly(&a, error));
    VSHI_TRY_DONE(gather(&a, error));
    if (a.options.voxel_size == 0.0) {
        VSHI_TRY_DONE(choose_voxel_size(&a, error));
    }
    warn_resampled(&a, &full);
    VSHI_TRY_DONE(make_grids(&a, &full, error));
    VSHI_TRY_DONE(unite(&a, run, grid, error)); /* which counts the instances itself */
done:
    free_assembly(&a);
    return result;
}

vsh_result vsh_scene_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vsh_grid **grid, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(grid);
    *grid = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    if (scene->caster_count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "scene: no casters");
    }
    const chosen of = {.scene = scene, .assets = assets, .choice = VOXELISED};
    if (count_taken(&of) == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "scene: its methods shade all casters without voxels");
    }
    const vsh_grid_options options = scene->layer_count == 0 ? choose_grid_options(scene, NULL) : scene->grid;
    return assemble(&of, &options, run, grid, error);
}

vsh_result vsh_scene_layer_casters(const vsh_scene *scene, const vsh_assets *assets,
                                   const vsh_scene_layer *layer, const vsh_run *run, vsh_grid **grid,
                                   vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(grid);
    *grid = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    const chosen of = {.scene = scene, .assets = assets, .choice = OF_LAYER, .layer = layer};
    const vsh_grid_options options = choose_grid_options(scene, layer);
    return count_taken(&of) > 0 ? assemble(&of, &options, run, grid, error) : VSH_OK;
}

/* --- what rays meet */

/* What rays meet. */
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
static vsh_result add_surface(const chosen *of, size_t caster, const vsh_run *run, traced *t,
                              vsh_error *error) {
    const vsh_scene *scene = of->scene;
    const chosen alone = {.scene = scene, .assets = of->assets, .choice = ONE, .one = caster};
    vsh_grid_options grid_options = choose_grid_options(scene, of->layer);
    if (scene->casters[caster].type == VSH_CASTER_VDB) {
        grid_options.voxel_size = 0.0;
        grid_options.resolution = 0;
    } else if (!vshi_scene_voxels_named(scene, of->layer)) {
        grid_options.resolution = vshi_resolution_marched(scene->shade.max_error, scene->light_count == 0);
    }
    vsh_field_options field_options = vsh_field_options_default();
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_result result;
    VSHI_TRY_DONE(assemble(&alone, &grid_options, run, &grid, error));
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

/* Gathers what rays meet of the casters that are chosen. Free it also after an error. */
static vsh_result gather_traced(const chosen *of, const vsh_run *run, traced *t, vsh_error *error) {
    VSHI_TRY(allocate_traced(of->scene, of->assets, t, error));
    for (size_t i = 0; i < of->scene->caster_count; ++i) {
        const vsh_caster *caster = &of->scene->casters[i];
        const vshi_asset_place *place = vshi_assets_caster(of->assets, i);
        if (!takes(of, i)) {
            continue;
        }
        for (size_t m = 0; m < place->count; ++m) {
            t->meshes[t->mesh_count++] = place->meshes[m];
        }
        if (caster->type == VSH_CASTER_SDF) {
            add_sdf(t, caster->sdf, caster->transform);
        } else if (caster->type == VSH_CASTER_SPHERES) {
            add_balls(t, place->spheres);
        } else if (!vshi_caster_has_triangles(caster)) {
            VSHI_TRY(add_surface(of, i, run, t, error));
        }
    }
    return VSH_OK;
}

/* Makes what rays meet: triangles that own the solids, or where `solids` is not NULL both apart. Procedural
 * solids alone then need no Embree. */
static vsh_result trace_casters(const chosen *of, const vsh_run *run, vsh_triangles **triangles,
                                vsh_solids **solids, vsh_error *error) {
    vsh_solids *made = NULL;
    traced t = {.mesh_count = 0};
    vsh_run full;
    vsh_result result;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    VSHI_TRY_DONE(gather_traced(of, &full, &t, error));
    if (t.sdf_count > 0) {
        VSHI_TRY_DONE(vsh_solids_create(t.sdfs, t.places[0], t.sdf_count, &made, error));
    }
    if (t.mesh_count > 0 || (solids == NULL && made != NULL)) {
        VSHI_TRY_DONE(vsh_triangles_create_beside(t.meshes, t.mesh_count, solids == NULL ? made : NULL, run,
                                                  triangles, error));
    }
    if (solids != NULL) {
        *solids = made;
        made = NULL;
    } else if (*triangles != NULL) {
        vshi_triangles_own_solids(*triangles);
        made = NULL;
    }
done:
    vsh_solids_free(made);
    free_traced(&t);
    return result;
}

vsh_result vsh_scene_triangles(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                               const vsh_run *run, vsh_triangles **triangles, vsh_error *error) {
    VSHI_NEEDS(triangles);
    *triangles = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    const chosen of = {.scene = scene, .assets = assets, .choice = OF_LAYER, .layer = layer};
    return trace_casters(&of, run, triangles, NULL, error);
}

vsh_result vshi_scene_caster_triangles(const vsh_scene *scene, const vsh_assets *assets, size_t caster,
                                       const vsh_run *run, vsh_triangles **triangles, vsh_error *error) {
    const chosen of = {.scene = scene, .assets = assets, .choice = ONE, .one = caster};
    return trace_casters(&of, run, triangles, NULL, error);
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
    const chosen of = {.scene = scene, .assets = assets, .choice = ALL};
    return trace_casters(&of, run, triangles, solids, error);
}
