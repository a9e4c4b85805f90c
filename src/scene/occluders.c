/* From a scene's casters to what is marched and traced. */
#include "scene/assets.h"

#include "base/clock.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"
#include "light/view.h"
#include "mesh/mesh_set.h"
#include "shade/occluders.h"
#include "shade/resolution.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* --- how casters are shaded: which methods, with voxels or without, and how many voxels by default. */

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

/* The layer that a caster is in; NULL: none. */
static const vsh_scene_layer *find_layer(const vsh_scene *scene, const vsh_caster *caster) {
    for (size_t i = 0; caster->layer != NULL && i < scene->layer_count; ++i) {
        if (strcmp(scene->layers[i].name, caster->layer) == 0) {
            return &scene->layers[i];
        }
    }
    return NULL;
}

bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster) {
    const bool may = (caster->type == VSH_CASTER_HEIGHTFIELD && caster->direct != 0) ||
                     (caster->type == VSH_CASTER_SPHERES && caster->voxelised == 0);
    if (!may) {
        return false;
    }
    const vsh_scene_layer *layer = find_layer(scene, caster);
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

/* --- reach */

/* Tangent of 60°: wider half angles are marched as if they were this wide, as a tangent without
 * bound would ask for a field without bound. */
static const double widest_tangent = 1.7320508075688772;

/* Finds the distance from surfaces up to which the field of a level set must be exact. */
static double find_reach(const vsh_scene *scene, const vsh_grid_info *info, const double receivers_min[3],
                         const double receivers_max[3]) {
    vshi_vec sides;
    double *side[3] = {&sides.x, &sides.y, &sides.z};
    for (int i = 0; i < 3; ++i) {
        *side[i] = fmax(info->bounds_max[i], receivers_max[i]) - fmin(info->bounds_min[i], receivers_min[i]);
    }
    const double longest = vshi_length(sides);          /* ray from a receiver to a caster */
    double reach = info->half_width * info->voxel_size; /* that of the finest level */
    for (size_t i = 0; i < scene->light_count; ++i) {
        const vshi_light_place place = vshi_light_in_world(&scene->lights[i]);
        if (place.parallel) {
            const double half_angle = fmin(place.half, vshi_atan(widest_tangent));
            reach = fmax(reach, vshi_tan(half_angle) * longest);
        } else {
            /* At t of the distance d to a sphere of radius r, the cone is r t/d wide: never wider than r. */
            reach = fmax(reach, fmin(place.radius, widest_tangent * longest));
        }
    }
    if (vsh_planes_shaded(&scene->planes) > 0) { /* rays across the scene, which coarse levels shorten */
        reach = fmax(reach, longest);
    }
    return scene->ao ? fmax(reach, scene->shade.ao_distance) : reach;
}

double vsh_scene_reach(const vsh_scene *scene, const vsh_grid *grid, const double receivers_min[3],
                       const double receivers_max[3]) {
    VSHI_FLOATS;
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    return find_reach(scene, &info, receivers_min, receivers_max);
}

/* --- casters that are thinner than voxels, where what is baked depends on them */

/* The least share of a mesh's area that is worth a warning. Edges sharper than a voxel are lost everywhere.
 */
static const double TOLD = 0.005;
/* Voxels that hold a part are so much smaller than it is thick. */
static const double HELD = 0.8;

static void warn_lost(const vsh_caster *caster, const vsh_mesh *mesh, const vsh_lost *lost, double voxel_size,
                      const vsh_run *run) {
    char share[32], help[64] = "finer ones may hold it";
    snprintf(share, sizeof share, "%.2g %%", 100.0 * lost->share);
    if (lost->thickness > 0.0) {
        snprintf(help, sizeof help, "voxels of %.2g hold most of it", HELD * lost->thickness);
    }
    vshi_warn(run,
              "%s: mesh '%s': %s of its area is thinner than 1.25 voxels of %.3g and casts nothing; "
              "%s, and --method exact needs none",
              caster->path, mesh->name != NULL ? mesh->name : "", share, voxel_size, help);
}

/* Finds what is lost of one caster's meshes, a second time with triangles where something is. */
static vsh_result find_lost(const vsh_mesh *meshes, size_t count, const vsh_field *field, const vsh_run *run,
                            vsh_lost *lost, vsh_error *error) {
    VSHI_TRY(vsh_field_find_lost(field, meshes, count, NULL, lost, error));
    bool any = false;
    for (size_t m = 0; m < count; ++m) {
        any = any || lost[m].share >= TOLD;
    }
    if (!any) {
        return VSH_OK;
    }
    vsh_triangles *triangles = NULL;
    VSHI_TRY(vsh_triangles_create(meshes, count, run, &triangles, error));
    const vsh_result result = vsh_field_find_lost(field, meshes, count, triangles, lost, error);
    vsh_triangles_free(triangles);
    return result;
}

static vsh_result check_lost(const vsh_caster *caster, const vsh_mesh *meshes, size_t count,
                             const vsh_field *field, const vsh_run *run, vsh_error *error) {
    vsh_lost *lost;
    vsh_field_info info;
    vsh_field_get_info(field, &info);
    VSHI_TRY(vshi_allocate((void **)&lost, count, sizeof *lost, "lost casters", error));
    const vsh_result result = find_lost(meshes, count, field, run, lost, error);
    for (size_t m = 0; m < count && result == VSH_OK; ++m) {
        if (lost[m].share >= TOLD) {
            warn_lost(caster, &meshes[m], &lost[m], info.voxel_size, run);
        }
    }
    free(lost);
    return result;
}

static void warn_one_sided(const vsh_caster *caster, const vsh_mesh *meshes, size_t count,
                           const vsh_run *run) {
    size_t one_sided = 0;
    for (size_t m = 0; m < count; ++m) {
        one_sided += meshes[m].one_sided != 0;
    }
    if (one_sided > 0) {
        vshi_warn(run,
                  "%s: %zu of %zu meshes are one-sided, but voxels cast to both sides; --method exact and "
                  "--ao-method exact let light through their backs",
                  caster->path, one_sided, count);
    }
}

/* Warns of parts of a layer's meshes, or (NULL) of those in no layer, that their field has lost, unless their
 * triangles are traced. */
static vsh_result warn_of_lost(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                               const vsh_field *field, const vsh_run *run, vsh_error *error) {
    if (run->warning == NULL || !vsh_scene_marches(scene, layer)) {
        return VSH_OK;
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        size_t count = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        if (count == 0 || caster->type != VSH_CASTER_MESH || !vshi_caster_in_layer(caster, layer)) {
            continue;
        }
        warn_one_sided(caster, meshes, count, run);
        VSHI_TRY(check_lost(caster, meshes, count, field, run, error));
    }
    return VSH_OK;
}

/* Sends notes on the solids and sheets of a layer's casters, or (NULL) of those in none, that have no voxels.
 */
static vsh_result note_solidity(const vsh_scene *scene, const vsh_assets *assets,
                                const vsh_scene_layer *layer, const vsh_run *run, vsh_error *error) {
    if (!vshi_wants_notes(run)) {
        return VSH_OK;
    }
    vshi_mesh_set set = {.count = 0};
    vsh_mesh *meshes;
    size_t count = 0;
    vsh_result result;
    VSHI_TRY_DONE(
        vshi_allocate((void **)&meshes, vshi_assets_mesh_count(assets), sizeof *meshes, "triangles", error));
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vshi_asset_place *place = vshi_assets_caster(assets, i);
        for (size_t m = 0; vshi_caster_has_voxels(scene, &scene->casters[i], layer) && m < place->count;
             ++m) {
            meshes[count++] = place->meshes[m];
        }
    }
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, count, &set, error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(&set, run, error));
    vshi_mesh_set_note(&set, 0.0, 0.0, run);
done:
    vshi_mesh_set_free(&set);
    free(meshes);
    return result;
}

/* --- fields */

/* Diagonals of the casters' box that points are within, where nothing else is said. */
static const double WITHIN = 4.0;

typedef struct making {
    const vsh_scene *scene;
    const vsh_assets *assets;
    vsh_scene_occluders_options options;
    vsh_run run;   /* as given */
    vsh_run voxel; /* of what makes voxels: it holds the fields that are made */
    vshi_occluders_own own;
    vsh_layer *layers; /* those that were made: copied in the end */
    vsh_occluder_parts parts;
} making;

/* Reach for receivers in a box, or for points within a distance of the casters' box. */
static double reach_of(const making *m, const vsh_grid_info *info) {
    const vsh_scene_occluders_options *o = &m->options;
    if (o->receivers_min != NULL) {
        return find_reach(m->scene, info, o->receivers_min, o->receivers_max);
    }
    double diagonal = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double side = info->bounds_max[axis] - info->bounds_min[axis];
        diagonal += side * side;
    }
    diagonal = sqrt(diagonal);
    const double margin = o->within > 0.0 ? o->within : WITHIN * diagonal;
    double around_min[3], around_max[3];
    for (int axis = 0; axis < 3; ++axis) {
        around_min[axis] = info->bounds_min[axis] - margin;
        around_max[axis] = info->bounds_max[axis] + margin;
    }
    const double reach = find_reach(m->scene, info, around_min, around_max);
    /* the field's own default, where that is enough: a program that takes it gets the same bits */
    return reach > WITHIN * diagonal ? reach : vsh_field_options_default().reach;
}

/* The field of a layer's casters, or (NULL) of those in none, whose level set is known; surfaces where rays
 * pay for them. */
static vsh_field_options options_of(const making *m, const vsh_scene_layer *layer,
                                    const vsh_grid_info *voxels) {
    /* to make a surface takes as long as two rays an active voxel are faster by it */
    static const double RAYS = 2.0;
    vsh_field_options options = vsh_field_options_default();
    options.reach = reach_of(m, voxels);
    options.surface =
        m->options.points * vshi_scene_field_rays(m->scene, layer) >= RAYS * (double)voxels->active_voxels;
    if (vshi_scene_is_level_set(m->scene, layer)) {
        options.grown = 0.0; /* its voxels are the definition */
    }
    if (layer != NULL) {
        options.reach *= fmax(1.0, layer->shade.softness); /* lights are as much wider */
    }
    return options;
}

/* Makes a field of the level set of a layer's casters, of so many voxels, or of the one that is given. */
static vsh_result create_field(making *m, const vsh_scene_layer *layer, int32_t resolution,
                               vsh_grid_info *voxels, vsh_field **field, vsh_error *error) {
    const double start = vshi_seconds();
    const vsh_grid *grid = layer == NULL ? m->options.grid : NULL;
    vsh_grid *made = NULL;
    if (grid == NULL) {
        vsh_scene scene = *m->scene;
        scene.grid.resolution = resolution != VSH_RESOLUTION_NAMED ? resolution : scene.grid.resolution;
        VSHI_TRY(vsh_scene_layer_casters(&scene, m->assets, layer, &m->voxel, &made, error));
        grid = made;
    }
    if (grid == NULL) {
        return VSH_OK;
    }
    m->own.voxelize_s += vshi_seconds() - start;
    vsh_grid_get_info(grid, voxels);
    const vsh_field_options options = options_of(m, layer, voxels);
    const vsh_result result = vsh_field_create(grid, &options, &m->voxel, field, error);
    vsh_grid_free(made); /* the field does not need it */
    return result;
}

/* *field is NULL where there are no casters. */
static vsh_result make_field(making *m, const vsh_scene_layer *layer, const vsh_triangles *triangles,
                             vsh_field **field, vsh_error *error) {
    const double start = vshi_seconds(), voxelized = m->own.voxelize_s;
    const bool given = layer == NULL && m->options.grid != NULL;
    int32_t resolution = VSH_RESOLUTION_NAMED;
    if (m->options.voxels == 0 && !given) {
        resolution = vsh_scene_resolution(m->scene, m->assets, layer, m->options.points);
    }
    if (resolution == VSH_RESOLUTION_NAMED && !given && vshi_scene_keeps_voxels(m->scene, layer)) {
        resolution = 0; /* its own voxels */
    }
    if (resolution == 0 && triangles != NULL && m->options.voxels == 0) {
        VSHI_TRY(vshi_occluders_unknown(triangles, 0.0, field, error));
        return *field == NULL ? VSH_OK : note_solidity(m->scene, m->assets, layer, &m->voxel, error);
    }
    vsh_grid_info voxels;
    VSHI_TRY(create_field(m, layer, resolution, &voxels, field, error));
    if (*field == NULL) {
        return VSH_OK;
    }
    vsh_field_info info;
    vsh_field_get_info(*field, &info);
    m->own.grid_bytes += voxels.bytes;
    m->voxel.memory_held += info.bytes;
    m->own.field_s += vshi_seconds() - start - (m->own.voxelize_s - voxelized);
    vsh_run run = m->run;
    run.warning = m->voxel.warning;
    return warn_of_lost(m->scene, m->assets, layer, *field, &run, error);
}

static vsh_result make_field_of(making *m, const vsh_scene_layer *layer, const vsh_triangles *triangles,
                                vsh_field **field, vsh_error *error) {
    vsh_error why;
    const vsh_result result = make_field(m, layer, triangles, field, &why);
    return result == VSH_OK ? VSH_OK
           : layer != NULL  ? vshi_fail(error, result, "layer '%s': %s", layer->name, why.message)
                            : vshi_fail(error, result, "%s", why.message);
}

/* Triangles where exact methods trace them, else NULL. */
static vsh_result make_triangles(making *m, const vsh_scene_layer *layer, vsh_triangles **triangles,
                                 vsh_error *error) {
    if (m->options.triangles == 0 || !vshi_scene_method_is(m->scene, layer, VSH_METHOD_TRIANGLES, true)) {
        return VSH_OK;
    }
    VSHI_TRY(vsh_scene_triangles(m->scene, m->assets, layer, &m->run, triangles, error));
    /* no caster outside of layers: none, where methods want to be given those that there are */
    if (*triangles == NULL && layer == NULL) {
        VSHI_TRY(vsh_triangles_create(NULL, 0, &m->run, triangles, error));
    }
    return VSH_OK;
}

/* What values are held against: nothing where memory is short, as baking needs none of it. */
static vsh_result make_truth(making *m, vsh_error *error) {
    if (m->options.truth == 0 || !vshi_scene_wants_truth(m->scene)) {
        return VSH_OK;
    }
    if (m->own.triangles != NULL) { /* all casters have some, or no method would trace them */
        m->parts.true_triangles = m->own.triangles;
        return VSH_OK;
    }
    vsh_error why;
    const vsh_result result =
        vsh_scene_truth(m->scene, m->assets, &m->run, &m->own.true_triangles, &m->own.true_solids, &why);
    m->parts.true_triangles = m->own.true_triangles;
    m->parts.true_solids = m->own.true_solids;
    return result == VSH_ERROR_CANCELLED ? vshi_fail(error, result, "%s", why.message) : VSH_OK;
}

/* Makes what rays of AO meet of a direct heightfield or spheres. */
static vsh_result trace_ao(making *m, size_t caster, size_t place, vsh_layer *layer, vsh_error *error) {
    vsh_triangles **triangles = &m->own.layer_triangles[place];
    VSHI_TRY(vshi_scene_caster_triangles(m->scene, m->assets, caster, &m->run, triangles, error));
    VSHI_TRY(vshi_occluders_unknown(*triangles, 0.0, &m->own.layer_fields[place], error));
    layer->field = m->own.layer_fields[place];
    layer->triangles = *triangles;
    return VSH_OK;
}

/* Casters without voxels, each shaded as its layer is. `place` is the first that no layer's field takes. */
static vsh_result add_direct(making *m, size_t place, vsh_error *error) {
    const vsh_scene *scene = m->scene;
    const bool ao = scene->ao != 0 || vsh_planes_shaded(&scene->planes) > 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        if (!vshi_caster_is_direct(scene, caster)) {
            continue;
        }
        vsh_layer *layer = &m->layers[m->parts.layer_count++];
        const vsh_scene_layer *of = find_layer(scene, caster);
        *layer = of != NULL ? of->shade : vsh_layer_default();
        layer->name = caster->layer;
        layer->heights = vsh_assets_heights(m->assets, i);
        layer->spheres = vsh_assets_spheres(m->assets, i);
        if (layer->ao != 0 && ao) {
            VSHI_TRY(trace_ao(m, i, place, layer, error));
        }
        ++place;
    }
    return VSH_OK;
}

static vsh_result make_layers(making *m, vsh_error *error) {
    const vsh_scene *scene = m->scene;
    size_t direct = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        direct += vshi_caster_is_direct(scene, &scene->casters[i]);
    }
    const size_t most = scene->layer_count + direct;
    if (most > VSH_MAX_LAYERS) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%zu layers and %zu casters that are not voxelised: at most %d together",
                         scene->layer_count, direct, VSH_MAX_LAYERS);
    }
    vshi_occluders_own *own = &m->own;
    VSHI_TRY(vshi_allocate((void **)&m->layers, most, sizeof *m->layers, "layers", error));
    VSHI_TRY(vshi_allocate((void **)&own->layer_fields, most, sizeof *own->layer_fields, "layers", error));
    VSHI_TRY(
        vshi_allocate((void **)&own->layer_triangles, most, sizeof *own->layer_triangles, "layers", error));
    own->layer_capacity = most;
    for (size_t i = 0; i < scene->layer_count; ++i) {
        const vsh_scene_layer *of_scene = &scene->layers[i];
        vsh_field **field = &m->own.layer_fields[i];
        vsh_triangles **triangles = &m->own.layer_triangles[i];
        VSHI_TRY(make_triangles(m, of_scene, triangles, error));
        VSHI_TRY(make_field_of(m, of_scene, *triangles, field, error));
        if (*field != NULL) {
            vsh_layer *layer = &m->layers[m->parts.layer_count++];
            *layer = of_scene->shade;
            layer->name = of_scene->name;
            layer->field = *field;
            layer->triangles = *triangles;
        }
    }
    return add_direct(m, scene->layer_count, error);
}

static vsh_result make(making *m, vsh_error *error) {
    const double start = vshi_seconds();
    VSHI_TRY(make_triangles(m, NULL, &m->own.triangles, error));
    VSHI_TRY(make_truth(m, error));
    m->own.triangles_s = vshi_seconds() - start;
    VSHI_TRY(make_field_of(m, NULL, m->own.triangles, &m->own.field, error));
    VSHI_TRY(make_layers(m, error));
    if (m->own.field == NULL && m->parts.layer_count == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "the scene has no casters");
    }
    return VSH_OK;
}

vsh_result vsh_scene_occluders(const vsh_scene *scene, const vsh_assets *assets,
                               const vsh_scene_occluders_options *options, const vsh_run *run,
                               vsh_occluders **occluders, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    *occluders = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS(assets);
    making m = {.scene = scene,
                .assets = assets,
                .options = vsh_scene_occluders_options_default(),
                .parts = vsh_occluder_parts_default()};
    VSHI_TRY(
        vshi_options_resolve(options, &m.options, sizeof m.options, "vsh_scene_occluders_options", error));
    if ((m.options.receivers_min == NULL) != (m.options.receivers_max == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receivers_min and receivers_max: one of them is NULL");
    }
    VSHI_TRY(vshi_run_resolve(run, &m.run, error));
    m.voxel = m.run;
    m.voxel.warning = m.options.silent_voxels != 0 ? NULL : m.run.warning;
    vsh_result result = make(&m, error);
    m.parts.field = m.own.field;
    m.parts.triangles = m.own.triangles;
    m.parts.layers = m.layers;
    if (result == VSH_OK) {
        result = vshi_occluders_make(&m.parts, &m.own, occluders, error);
    } else {
        vshi_occluders_own_free(&m.own);
    }
    free(m.layers);
    return result;
}
