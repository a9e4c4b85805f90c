/* Assembles a scene's casters: into one level set, or into triangles and solids for rays. */
#include "scene/assets.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"
#include "field/field.h"
#include "field/level.h"
#include "geometry/sdf.h"
#include "shade/occluders.h"
#include "shapes/outline.h"
#include "shapes/spheres.h"
#include "trace/trace.h"

#include <math.h>
#include <stdlib.h>

/* --- one level set of several casters */

/* Selects all casters, those with voxels, those with voxels in one layer, or a single one. */
typedef struct selection {
    const vsh_scene *scene;
    const vsh_assets *assets;
    enum { ALL, VOXELISED, OF_LAYER, ONE } choice;
    const vsh_scene_layer *layer;
    size_t one;
} selection;

static bool is_selected(const selection *s, size_t i) {
    const vsh_caster *caster = &s->scene->casters[i];
    return s->choice == ALL || (s->choice == ONE && i == s->one) ||
           (s->choice == VOXELISED && !vshi_caster_is_direct(s->scene, caster)) ||
           (s->choice == OF_LAYER && vshi_caster_has_voxels(s->scene, caster, s->layer));
}

static size_t count_selected(const selection *s) {
    size_t count = 0;
    for (size_t i = 0; i < s->scene->caster_count; ++i) {
        count += is_selected(s, i);
    }
    return count;
}

/* Memory that a caster takes in the scene, its file's text and the assembly, measured with 65,536 casters of
 * one node. */
enum { BYTES_PER_CASTER = 1536 };

/* An sdf caster ready for voxels: a tree in world space. No quaternion can mirror a tree, so a mirrored one
 * keeps its own space, and its grid's instance mirrors it. */
typedef struct placed_sdf {
    vsh_sdf_node *nodes; /* owned; NULL: the caster's own */
    vsh_sdf sdf;
    double scale;            /* from the grid's space to the world; 1 for a folded tree */
    const double *transform; /* of the grid's instance; NULL for a folded tree */
} placed_sdf;

/* A level set under way. */
typedef struct assembly {
    const selection *of;
    vsh_mesh *meshes; /* [mesh_count]: of all selected casters */
    size_t mesh_count;
    placed_sdf *sdfs; /* [caster_count]; zero for other casters */
    vsh_grid_instance *instances;
    size_t instance_count;
    vsh_grid **made; /* new grids among the instances */
    size_t made_count;
    double low[3], high[3]; /* world box of the casters */
    double finest;          /* voxel size of the level sets */
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
    const size_t count = caster->sdf.node_count;
    VSHI_TRY(vshi_allocate((void **)&placed->nodes, count, sizeof *placed->nodes, "sdf nodes", error));
    memcpy(placed->nodes, caster->sdf.nodes, count * sizeof *placed->nodes);
    placed->sdf.nodes = placed->nodes;
    placed->scale = 1.0;
    vsh_sdf_node *root = &placed->nodes[count - 1];
    double rotation[4];
    vshi_similarity_rotation(m, scale, rotation);
    vshi_quaternion_multiply(rotation, root->rotation, root->rotation);
    vshi_vec_to_doubles(vshi_transform_point(m, vshi_vec_of(root->translation)), root->translation);
    root->scale *= scale;
    return VSH_OK;
}

/* Checks a tree, and the transform of a caster that must keep its shape. */
static vsh_result check_caster(const vsh_caster *caster, const vshi_asset_place *place, size_t index,
                               vsh_error *error) {
    const bool vdb = caster->type == VSH_CASTER_VDB, sdf = caster->type == VSH_CASTER_SDF;
    const char *rigid = sdf                      ? "an sdf"
                        : vdb                    ? "a level set"
                        : place->outline != NULL ? "a mask or text"
                                                 : NULL;
    VSHI_TRY(sdf ? vshi_sdf_check(&caster->sdf, error) : VSH_OK);
    if (rigid != NULL && vshi_similarity_scale(caster->transform) <= 0.0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "caster %zu: %s%sthe transform of %s must neither shear nor scale unevenly", index,
                         vdb ? caster->path : "", vdb ? ": " : "", rigid);
    }
    return !vdb || place->grid != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT, "caster %zu: %s: was not read", index, caster->path);
}

/* Grows the casters' box by a box under a transform (NULL: identity); an empty box grows nothing. */
static void grow_box(assembly *a, const double min[3], const double max[3], const double *transform) {
    if (min[0] <= max[0] && min[1] <= max[1] && min[2] <= max[2]) {
        vshi_grow_box_by(a->low, a->high, transform, min, max);
    }
}

/* Grows the box by a caster. `tree` and `transform` are those of a procedural shape. */
static void grow_by_caster(assembly *a, const vsh_caster *caster, const vshi_asset_place *place,
                           const vsh_sdf *tree, const double *transform) {
    for (size_t k = 0; k < place->count; ++k) {
        const vsh_mesh_report *report = &place->meshes[k].checked->report;
        grow_box(a, report->bounds_min, report->bounds_max, NULL);
    }
    if (tree != NULL) {
        double min[3], max[3];
        vshi_sdf_bounds(tree, min, max);
        grow_box(a, min, max, transform);
    } else if (caster->type == VSH_CASTER_VDB) {
        vsh_grid_info info;
        vsh_grid_get_info(place->grid, &info);
        grow_box(a, info.bounds_min, info.bounds_max, caster->transform);
        a->finest = fmin(a->finest, info.voxel_size * vshi_similarity_scale(caster->transform));
    } else if (place->outline != NULL) {
        vshi_outline_info info;
        vshi_outline_get_info(place->outline, &info);
        const double half = 0.5 * caster->thickness;
        grow_box(a, (const double[]){info.bounds_min[0], info.bounds_min[1], -half},
                 (const double[]){info.bounds_max[0], info.bounds_max[1], half}, caster->transform);
    } else if (caster->type == VSH_CASTER_SPHERES) {
        vshi_spheres_info info;
        vshi_spheres_get_info(place->spheres, &info);
        grow_box(a, info.bounds_min, info.bounds_max, NULL);
    }
}

/* Checks a caster, and gathers its meshes, its box and its tree. */
static vsh_result gather_caster(assembly *a, size_t i, vsh_error *error) {
    const vsh_caster *caster = &a->of->scene->casters[i];
    const vshi_asset_place *place = vshi_assets_caster(a->of->assets, i);
    const bool tree = caster->type == VSH_CASTER_SDF;
    VSHI_TRY(check_caster(caster, place, i, error));
    VSHI_TRY(tree ? place_sdf(caster, &a->sdfs[i], error) : VSH_OK);
    grow_by_caster(a, caster, place, tree ? &a->sdfs[i].sdf : NULL, a->sdfs[i].transform);
    for (size_t k = 0; k < place->count; ++k) {
        a->meshes[a->mesh_count++] = place->meshes[k];
    }
    return VSH_OK;
}

vsh_result vshi_scene_measure(const vsh_scene *scene, const vsh_assets *assets, vsh_assets_info *info,
                              vsh_error *error) {
    assembly a = {.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
    double most = 0.0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *c = &scene->casters[i];
        const bool tree = c->type == VSH_CASTER_SDF;
        const vsh_result result = tree ? vshi_sdf_check(&c->sdf, error) : VSH_OK;
        if (result == VSH_ERROR_MEMORY) { /* check_caster() names the other errors */
            return result;
        }
        grow_by_caster(&a, c, vshi_assets_caster(assets, i), tree && result == VSH_OK ? &c->sdf : NULL,
                       c->transform);
    }
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vshi_asset_place *place = vshi_assets_receiver(assets, i);
        double area = 0.0;
        grow_by_caster(&a, &(vsh_caster){.type = VSH_CASTER_MESH}, place, NULL, NULL);
        for (size_t k = 0; k < place->count; ++k) {
            area += place->meshes[k].checked->report.area;
        }
        most = fmax(most, area);
    }
    *info = (vsh_assets_info){{a.low[0], a.low[1], a.low[2]}, {a.high[0], a.high[1], a.high[2]}, most, 0.0};
    info->ao_distance = vshi_auto_ao_distance(info->bounds_min, info->bounds_max);
    return VSH_OK;
}

/* Chooses the voxel size on which casters of several kinds must agree before the first is voxelised. A
 * resolution of 0 stands for the voxels of the finest level set. A level set alone keeps its voxels. */
static vsh_result choose_voxel_size(assembly *a, vsh_error *error) {
    vsh_grid_options *o = &a->options;
    if (o->resolution == 0) {
        if (!isfinite(a->finest)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "resolution 0: it means the voxels of a level set, but no caster is one");
        }
        o->resolution = vsh_grid_options_default().resolution; /* unused */
        o->voxel_size = count_selected(a->of) > 1 ? a->finest : 0.0;
        return VSH_OK;
    }
    const vshi_vec sides = vshi_sub(vshi_vec_of(a->high), vshi_vec_of(a->low));
    const double longest = fmax(sides.x, fmax(sides.y, sides.z));
    if (!(longest > 0.0) || !isfinite(longest)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "scene: the casters have no extent");
    }
    if (o->resolution < 2 || o->resolution > 65536) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "resolution %d: expected 2 … 65536", o->resolution);
    }
    o->voxel_size = longest / o->resolution;
    return VSH_OK;
}

/* Warns of resampled level sets, if values are marched through them. */
static void warn_resampled(const assembly *a, const vsh_run *run) {
    static const double SAME = 1e-4;
    const selection *of = a->of;
    for (size_t i = 0; i < of->scene->caster_count && vshi_scene_marches(of->scene, of->layer); ++i) {
        const vsh_caster *caster = &of->scene->casters[i];
        if (!is_selected(of, i) || caster->type != VSH_CASTER_VDB || a->options.voxel_size == 0.0) {
            continue;
        }
        vsh_grid_info info;
        vsh_grid_get_info(vshi_assets_caster(of->assets, i)->grid, &info);
        const double own = info.voxel_size * vshi_similarity_scale(caster->transform);
        if (fabs(own - a->options.voxel_size) > SAME * own) {
            vshi_warn(run, "%s: its voxels of %g are resampled to %g; --resolution 0 keeps them",
                      caster->path, own, a->options.voxel_size);
        }
    }
}

/* Adds the last grid made to the union, and counts its memory: the limit holds for all grids together. */
static vsh_result add_made(assembly *a, const double *transform, vsh_run *run, vsh_error *error) {
    const vsh_grid *grid = a->made[a->made_count++];
    a->instances[a->instance_count++] = (vsh_grid_instance){grid, transform};
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    run->memory_held += info.bytes;
    return vshi_check_limit(run, 0.0, "level sets of the casters", error);
}

static double find_sphere_distance(void *user, const double position[3]) {
    return vshi_spheres_distance(user, position);
}

/* Distances to a union are true outside of it, and a bound within. */
static vsh_result voxelise_spheres(assembly *a, const vshi_spheres *spheres, vsh_run *run, vsh_grid **made,
                                   vsh_error *error) {
    vshi_spheres_info info;
    vshi_spheres_get_info(spheres, &info);
    vsh_distance field = {.distance = find_sphere_distance,
                          .user = (void *)(uintptr_t)spheres, /* only read */
                          .lipschitz = 1.0,
                          .exact = info.count == 1};
    memcpy(field.bounds_min, info.bounds_min, sizeof field.bounds_min);
    memcpy(field.bounds_max, info.bounds_max, sizeof field.bounds_max);
    return vsh_grid_from_distance(&field, &a->options, run, made, error);
}

static vsh_result add_grid(assembly *a, size_t i, vsh_run *run, vsh_error *error) {
    const vsh_caster *caster = &a->of->scene->casters[i];
    const vshi_asset_place *place = vshi_assets_caster(a->of->assets, i);
    const placed_sdf *placed = &a->sdfs[i];
    vsh_grid **made = &a->made[a->made_count];
    if (caster->type == VSH_CASTER_VDB) {
        a->instances[a->instance_count++] = (vsh_grid_instance){place->grid, caster->transform};
        return VSH_OK;
    }
    if (caster->type == VSH_CASTER_SDF) {
        vsh_grid_options options = a->options;
        options.voxel_size /= placed->scale;
        VSHI_TRY(vsh_grid_from_sdf(&placed->sdf, &options, run, made, error));
    } else if (place->outline != NULL) {
        VSHI_TRY(vsh_grid_from_outline(place->outline, caster->thickness, caster->transform, &a->options, run,
                                       made, error));
    } else if (caster->type == VSH_CASTER_SPHERES) {
        VSHI_TRY(voxelise_spheres(a, place->spheres, run, made, error));
    } else {
        return VSH_OK; /* its meshes are voxelised together with the others' */
    }
    return add_made(a, placed->transform, run, error);
}

/* Makes the grids and their union. */
static vsh_result make_union(assembly *a, vsh_run *held, const vsh_run *run, vsh_grid **grid,
                             vsh_error *error) {
    if (a->mesh_count > 0) {
        VSHI_TRY(vsh_grid_from_meshes(a->meshes, a->mesh_count, &a->options, held, &a->made[a->made_count],
                                      error));
        VSHI_TRY(add_made(a, NULL, held, error));
    }
    for (size_t i = 0; i < a->of->scene->caster_count; ++i) {
        VSHI_TRY(is_selected(a->of, i) ? add_grid(a, i, held, error) : VSH_OK);
    }
    if (a->instance_count == 1 && a->made_count == 1 && a->instances[0].transform == NULL) {
        *grid = a->made[0];
        a->made_count = 0;
        return VSH_OK;
    }
    /* the union counts the instances itself */
    return vsh_grid_unite(a->instances, a->instance_count, &a->options, run, grid, error);
}

/* Chooses how a layer's casters are voxelised. */
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

/* Voxelises the union of the selected casters. */
static vsh_result voxelise(const selection *of, const vsh_grid_options *options, const vsh_run *run,
                           vsh_grid **grid, vsh_error *error) {
    const size_t casters = of->scene->caster_count, meshes = vshi_assets_set(of->assets)->count;
    assembly a = {.of = of,
                  .low = {INFINITY, INFINITY, INFINITY},
                  .high = {-INFINITY, -INFINITY, -INFINITY},
                  .finest = INFINITY,
                  .options = vsh_grid_options_default()};
    const vshi_array arrays[] = {VSHI_ARRAY(a.meshes, meshes), VSHI_ARRAY(a.sdfs, casters),
                                 VSHI_ARRAY(a.instances, casters + 1), VSHI_ARRAY(a.made, casters + 1)};
    vsh_run held;
    vsh_result result;
    VSHI_TRY(vshi_run_resolve(run, &held, error));
    VSHI_TRY(vshi_options_resolve(options, &a.options, sizeof a.options, "vsh_grid_options", error));
    held.memory_held += casters * BYTES_PER_CASTER;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "casters", error));
    for (size_t i = 0; i < casters; ++i) {
        VSHI_TRY_DONE(is_selected(of, i) ? gather_caster(&a, i, error) : VSH_OK);
    }
    if (a.options.voxel_size == 0.0) {
        VSHI_TRY_DONE(choose_voxel_size(&a, error));
    }
    warn_resampled(&a, &held);
    result = make_union(&a, &held, run, grid, error);
done:
    while (a.made_count > 0) {
        vsh_grid_free(a.made[--a.made_count]);
    }
    for (size_t i = 0; i < casters; ++i) {
        free(a.sdfs[i].nodes);
    }
    free(a.meshes);
    return result;
}

vsh_result vsh_scene_casters(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                             vsh_grid **grid, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(grid);
    VSHI_NEEDS_BOTH(scene, assets);
    if (scene->caster_count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "scene: no casters");
    }
    const selection of = {.scene = scene, .assets = assets, .choice = VOXELISED};
    if (count_selected(&of) == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "scene: its methods shade all casters without voxels");
    }
    const vsh_grid_options options = scene->layer_count == 0 ? choose_grid_options(scene, NULL) : scene->grid;
    return voxelise(&of, &options, run, grid, error);
}

vsh_result vshi_scene_layer_casters(const vsh_scene *scene, const vsh_assets *assets,
                                    const vsh_scene_layer *layer, const vsh_run *run, vsh_grid **grid,
                                    vsh_error *error) {
    VSHI_FLOATS;
    *grid = NULL;
    const selection of = {.scene = scene, .assets = assets, .choice = OF_LAYER, .layer = layer};
    const vsh_grid_options options = choose_grid_options(scene, layer);
    return count_selected(&of) > 0 ? voxelise(&of, &options, run, grid, error) : VSH_OK;
}

/* --- triangles and solids for rays */

typedef struct traced {
    vsh_mesh *meshes; /* the casters' own, and those of `surfaces` */
    vshi_surface_mesh *surfaces;
    vsh_sdf *sdfs;
    double (*places)[12]; /* of the sdfs */
    vsh_sdf_node *balls;
    size_t mesh_count, surface_count, sdf_count, ball_count;
} traced;

static void add_sdf(traced *t, vsh_sdf sdf, const double transform[12]) {
    memcpy(t->places[t->sdf_count], transform, sizeof t->places[0]);
    t->sdfs[t->sdf_count++] = sdf;
}

static void add_balls(traced *t, const vshi_spheres *spheres) {
    for (size_t i = 0; i < spheres->info.count; ++i) {
        vsh_sdf_node *ball = &t->balls[t->ball_count++];
        *ball = vsh_sdf_node_default();
        memcpy(ball->translation, spheres->sphere[i], sizeof ball->translation);
        ball->radius = spheres->sphere[i][3];
        add_sdf(t, (vsh_sdf){ball, 1}, vshi_identity);
    }
}

/* Adds the surface of a caster's own level set. A file keeps its voxels; an outline has the scene's voxels,
 * or as many as the error needs. */
static vsh_result add_surface(const selection *of, size_t caster, const vsh_run *run, traced *t,
                              vsh_error *error) {
    const vsh_scene *scene = of->scene;
    const selection alone = {.scene = scene, .assets = of->assets, .choice = ONE, .one = caster};
    vsh_grid_options grid_options = choose_grid_options(scene, of->layer);
    if (scene->casters[caster].type == VSH_CASTER_VDB) {
        grid_options.voxel_size = 0.0;
        grid_options.resolution = 0;
    } else if (!vshi_scene_sets_voxels(scene, of->layer)) {
        grid_options.resolution = vshi_resolution_marched(scene->shade.max_error, scene->light_count == 0);
    }
    vshi_field_options field_options = vshi_field_options_default();
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_grid_info info;
    vsh_result result;
    VSHI_TRY_DONE(voxelise(&alone, &grid_options, run, &grid, error));
    vsh_grid_get_info(grid, &info);
    field_options.reach = info.voxel_size; /* the finest level alone */
    VSHI_TRY_DONE(vshi_field_create(grid, &field_options, run, &field, error));
    vshi_surface_mesh *surface = &t->surfaces[t->surface_count++];
    VSHI_TRY_DONE(vshi_surface_mesh_make(field, run, surface, error));
    t->meshes[t->mesh_count++] = (vsh_mesh){.positions = surface->positions,
                                            .indices = surface->indices,
                                            .vertex_count = surface->vertex_count,
                                            .triangle_count = surface->triangle_count,
                                            .transform = surface->transform,
                                            .solidity = VSH_SOLIDITY_SOLID};
done:
    vshi_field_free(field);
    vsh_grid_free(grid);
    return result;
}

/* Adds the triangles, solids or surface of a caster. */
static vsh_result add_traced(const selection *of, size_t i, const vsh_run *run, traced *t, vsh_error *error) {
    const vsh_caster *caster = &of->scene->casters[i];
    const vshi_asset_place *place = vshi_assets_caster(of->assets, i);
    for (size_t m = 0; m < place->count; ++m) {
        t->meshes[t->mesh_count++] = place->meshes[m];
    }
    if (caster->type == VSH_CASTER_SDF) {
        add_sdf(t, caster->sdf, caster->transform);
    } else if (caster->type == VSH_CASTER_SPHERES) {
        add_balls(t, place->spheres);
    } else if (caster->type != VSH_CASTER_MESH && caster->type != VSH_CASTER_HEIGHTFIELD) {
        return add_surface(of, i, run, t, error);
    }
    return VSH_OK;
}

/* Makes triangles that own the solids. If `solids` is not NULL, makes the two apart, so that procedural
 * solids alone need no Embree. */
static vsh_result trace_casters(const selection *of, const vsh_run *run, vshi_triangles **triangles,
                                vshi_solids **solids, vsh_error *error) {
    vshi_solids *made = NULL;
    traced t = {.mesh_count = 0};
    const size_t casters = of->scene->caster_count, meshes = vshi_assets_set(of->assets)->count + casters + 1;
    size_t balls = 0;
    for (size_t i = 0; i < casters; ++i) {
        const vshi_spheres *spheres = vshi_assets_caster(of->assets, i)->spheres;
        balls += spheres != NULL ? spheres->info.count : 0;
    }
    const size_t sdfs = casters + balls + 1;
    const vshi_array arrays[] = {VSHI_ARRAY(t.meshes, meshes), VSHI_ARRAY(t.surfaces, meshes),
                                 VSHI_ARRAY(t.sdfs, sdfs), VSHI_ARRAY(t.places, sdfs),
                                 VSHI_ARRAY(t.balls, balls)};
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "casters", error));
    for (size_t i = 0; i < casters; ++i) {
        VSHI_TRY_DONE(is_selected(of, i) ? add_traced(of, i, run, &t, error) : VSH_OK);
    }
    if (t.sdf_count > 0) {
        VSHI_TRY_DONE(vshi_solids_create(t.sdfs, t.places[0], t.sdf_count, &made, error));
    }
    if (t.mesh_count > 0 || (solids == NULL && made != NULL)) {
        VSHI_TRY_DONE(vshi_triangles_create(t.meshes, t.mesh_count, solids == NULL ? made : NULL, run,
                                            triangles, error));
    }
    if (solids != NULL) {
        *solids = made;
    }
    made = NULL; /* the triangles' or the caller's now */
done:
    vshi_solids_free(made);
    while (t.surface_count > 0) {
        vshi_surface_mesh_free(&t.surfaces[--t.surface_count]);
    }
    free(t.meshes);
    return result;
}

vsh_result vshi_scene_triangles(const vsh_scene *scene, const vsh_assets *assets,
                                const vsh_scene_layer *layer, const vsh_run *run, vshi_triangles **triangles,
                                vsh_error *error) {
    *triangles = NULL;
    const selection of = {.scene = scene, .assets = assets, .choice = OF_LAYER, .layer = layer};
    return trace_casters(&of, run, triangles, NULL, error);
}

vsh_result vshi_scene_caster_triangles(const vsh_scene *scene, const vsh_assets *assets, size_t caster,
                                       const vsh_run *run, vshi_triangles **triangles, vsh_error *error) {
    const selection alone = {.scene = scene, .assets = assets, .choice = ONE, .one = caster};
    return trace_casters(&alone, run, triangles, NULL, error);
}

vsh_result vshi_scene_truth(const vsh_scene *scene, const vsh_assets *assets, const vsh_run *run,
                            vshi_triangles **triangles, vshi_solids **solids, vsh_error *error) {
    *triangles = NULL;
    *solids = NULL;
    const selection of = {.scene = scene, .assets = assets, .choice = ALL};
    return trace_casters(&of, run, triangles, solids, error);
}
