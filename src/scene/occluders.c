/* Turns a scene's casters into occluders: chooses methods and voxels, makes fields and triangles. */
#include "scene/assets.h"

#include "base/clock.h"
#include "base/elementary.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/vec.h"
#include "field/field.h"
#include "geometry/mesh_set.h"
#include "light/light.h"
#include "lightmap/planes.h"
#include "shade/shade.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* --- methods. In this file, a layer of NULL stands for the casters that are in no layer. */

static bool is_in_layer(const vsh_caster *caster, const vsh_scene_layer *layer) {
    return caster->layer == NULL ? layer == NULL : layer != NULL && strcmp(caster->layer, layer->name) == 0;
}

/* The caster's layer, or NULL. */
static const vsh_scene_layer *find_layer(const vsh_scene *scene, const vsh_caster *caster) {
    for (size_t i = 0; i < scene->layer_count; ++i) {
        if (is_in_layer(caster, &scene->layers[i])) {
            return &scene->layers[i];
        }
    }
    return NULL;
}

static int32_t find_method(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return layer != NULL && layer->method != VSH_SHADOW_OF_SCENE ? layer->method : scene->shade.method;
}

static bool bakes_ao(const vsh_scene *scene) {
    return scene->ao != 0 || vshi_planes_shaded(&scene->planes) > 0;
}

static bool casts_ao(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return bakes_ao(scene) && (layer == NULL || layer->ao);
}

bool vshi_caster_is_direct(const vsh_scene *scene, const vsh_caster *caster) {
    const bool may = (caster->type == VSH_CASTER_HEIGHTFIELD && caster->direct != 0) ||
                     (caster->type == VSH_CASTER_SPHERES && caster->voxelised == 0);
    if (!may) {
        return false;
    }
    const vsh_scene_layer *layer = find_layer(scene, caster);
    const int32_t method = find_method(scene, layer);
    const bool traced = vshi_ao_method_resolve(scene->shade.ao_method, 1) == VSH_AO_EXACT;
    return scene->light_count > 0 && (method == VSH_SHADOW_HARD || method == VSH_SHADOW_CLASSIC) &&
           (traced || !casts_ao(scene, layer));
}

bool vshi_caster_has_voxels(const vsh_scene *scene, const vsh_caster *caster, const vsh_scene_layer *layer) {
    return is_in_layer(caster, layer) && !vshi_caster_is_direct(scene, caster);
}

/* Numbers of a layer's casters that have voxels, by kinds. */
typedef struct caster_counts {
    size_t meshes;     /* and heightfields */
    size_t solids;     /* procedural ones and spheres */
    size_t level_sets; /* of files */
    size_t outlines;   /* masks and texts */
} caster_counts;

static caster_counts count_casters(const vsh_scene *scene, const vsh_scene_layer *layer) {
    caster_counts n = {0};
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const int32_t type = scene->casters[i].type;
        if (vshi_caster_has_voxels(scene, &scene->casters[i], layer)) {
            n.meshes += type == VSH_CASTER_MESH || type == VSH_CASTER_HEIGHTFIELD;
            n.solids += type == VSH_CASTER_SDF || type == VSH_CASTER_SPHERES;
            n.level_sets += type == VSH_CASTER_VDB;
            n.outlines += type == VSH_CASTER_MASK || type == VSH_CASTER_TEXT;
        }
    }
    return n;
}

/* Whether auto traces the layer's casters. It marches a layer of masks and texts only, and a layer of one
 * level set only, which then keeps its voxels: several, or one beside other casters, would be resampled to
 * common voxels. */
static bool is_traceable(const vsh_scene *scene, const vsh_scene_layer *layer) {
    const caster_counts n = count_casters(scene, layer);
    const bool alone = (n.level_sets == 0) != (n.outlines == 0) && n.level_sets <= 1;
    return !(n.meshes + n.solids == 0 && alone);
}

/* Whether a method that shades the layer's casters has all of these VSH_METHOD_… traits, or (`has` false)
 * lacks one: a shadow method if there are lights, an AO method if AO is baked. */
static bool any_method_is(const vsh_scene *scene, const vsh_scene_layer *layer, uint32_t traits, bool has) {
    const int32_t can = is_traceable(scene, layer);
    const uint32_t shadow =
        vsh_method_traits(VSH_NAMES_SHADOW, vshi_shadow_method_resolve(find_method(scene, layer), can));
    const uint32_t ao = vsh_method_traits(VSH_NAMES_AO, vshi_ao_method_resolve(scene->shade.ao_method, can));
    return (scene->light_count > 0 && ((shadow & traits) == traits) == has) ||
           (casts_ao(scene, layer) && ((ao & traits) == traits) == has);
}

int32_t vshi_scene_marches(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return scene != NULL && any_method_is(scene, layer, VSH_METHOD_TRIANGLES, false);
}

/* Estimates the rays that adaptive casts on the field of the layer's casters, from each shaded point. */
static double estimate_field_rays(const vsh_scene *scene, const vsh_scene_layer *layer) {
    /* rays × max_error, mean of all points; measured on the cloister with AO within 0.6 units and a sun of
     * 5° */
    static const double OF_LIGHT = 0.14, OF_AO = 0.6;
    const int32_t can = is_traceable(scene, layer);
    const int32_t method = vshi_shadow_method_resolve(find_method(scene, layer), can);
    double rays = method == VSH_SHADOW_ADAPTIVE ? OF_LIGHT * (double)scene->light_count : 0.0;
    if (casts_ao(scene, layer) && vshi_ao_method_resolve(scene->shade.ao_method, can) == VSH_AO_ADAPTIVE) {
        rays += OF_AO;
    }
    rays /= scene->shade.max_error;
    return scene->shade.rays > 0 ? fmin(rays, scene->shade.rays) : rays;
}

/* Whether a bake compares its values with rays against the casters themselves. It does not if no method keeps
 * an error, if layers cast, or if rays cannot meet all casters. */
static bool wants_truth(const vsh_scene *scene) {
    bool wants = scene->layer_count == 0 && any_method_is(scene, NULL, VSH_METHOD_KEEPS_ERROR, true);
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const int32_t type = scene->casters[i].type;
        wants = wants && type != VSH_CASTER_VDB && type != VSH_CASTER_MASK && type != VSH_CASTER_TEXT &&
                !vshi_caster_is_direct(scene, &scene->casters[i]);
    }
    return wants;
}

/* --- numbers of voxels */

bool vshi_scene_sets_voxels(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return scene->voxels_named != 0 || scene->grid.voxel_size > 0.0 ||
           scene->grid.resolution != vsh_grid_options_default().resolution ||
           (layer != NULL && (layer->voxel_size > 0.0 || layer->resolution > 0));
}

/* Whether the layer's only caster is a level set. */
static bool is_level_set(const vsh_scene *scene, const vsh_scene_layer *layer) {
    const caster_counts n = count_casters(scene, layer);
    return n.level_sets == 1 && n.meshes + n.solids + n.outlines == 0;
}

bool vshi_scene_keeps_voxels(const vsh_scene *scene, const vsh_scene_layer *layer) {
    return is_level_set(scene, layer) && !vshi_scene_sets_voxels(scene, layer);
}

/* Adds up the area, the triangles and the box of a layer's meshes. */
static vshi_resolution_need measure_meshes(const vsh_scene *scene, const vsh_assets *assets,
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

int32_t vshi_scene_resolution(const vsh_scene *scene, const vsh_assets *assets, const vsh_scene_layer *layer,
                              double points) {
    VSHI_FLOATS;
    if (scene == NULL || assets == NULL || vshi_scene_sets_voxels(scene, layer)) {
        return VSHI_RESOLUTION_NAMED;
    }
    const int32_t otherwise = vsh_grid_options_default().resolution;
    const size_t lights = layer == NULL || layer->lights == NULL ? scene->light_count : layer->light_count;
    if (vshi_scene_marches(scene, layer) != 0) {
        /* voxels can follow all shapes except for meshes, which may be too thin, and level sets, which have
         * their own voxels */
        const caster_counts n = count_casters(scene, layer);
        const bool follow =
            n.meshes + n.level_sets == 0 && !any_method_is(scene, layer, VSH_METHOD_KEEPS_ERROR, false);
        return is_level_set(scene, layer) ? 0
               : follow                   ? vshi_resolution_marched(scene->shade.max_error, lights == 0)
                                          : otherwise;
    }
    if (!any_method_is(scene, layer, VSH_METHOD_TRIANGLES, true)) {
        return otherwise; /* nothing is shaded */
    }
    vshi_resolution_need need = measure_meshes(scene, assets, layer);
    need.values = points * (double)lights;
    return vshi_resolution_traced(&need);
}

/* --- reach */

/* Tangent of 60°: wider half angles are marched as if they were this wide, because a tangent without bound
 * would need a field without bound. */
static const double WIDEST_TANGENT = 1.7320508075688772;

/* Finds the distance from surfaces up to which the field of a level set must be exact. */
static double find_reach(const vsh_scene *scene, const vsh_grid_info *info, const double receivers_min[3],
                         const double receivers_max[3]) {
    double sides[3];
    for (int i = 0; i < 3; ++i) {
        sides[i] = fmax(info->bounds_max[i], receivers_max[i]) - fmin(info->bounds_min[i], receivers_min[i]);
    }
    const double longest = vshi_length(vshi_vec_of(sides)); /* ray from a receiver to a caster */
    double reach = info->half_width * info->voxel_size;     /* that of the finest level */
    for (size_t i = 0; i < scene->light_count; ++i) {
        const vshi_light_place place = vshi_light_in_world(&scene->lights[i]);
        if (place.parallel) {
            const double half_angle = fmin(place.half, vshi_atan(WIDEST_TANGENT));
            reach = fmax(reach, vshi_tan(half_angle) * longest);
        } else {
            /* At t of the distance d to a sphere of radius r, the cone is r t/d wide: never wider than r. */
            reach = fmax(reach, fmin(place.radius, WIDEST_TANGENT * longest));
        }
    }
    if (vshi_planes_shaded(&scene->planes) > 0) { /* rays across the scene, which coarse levels shorten */
        reach = fmax(reach, longest);
    }
    return scene->ao ? fmax(reach, scene->shade.ao_distance) : reach;
}

/* --- warnings and notes about voxels */

/* Smallest share of a mesh's area that is worth a warning: edges sharper than a voxel are lost everywhere. */
static const double LEAST_LOST = 0.005;
/* Size of voxels that hold a part, over the part's thickness. */
static const double HELD = 0.8;

/* Warns of parts of a caster's meshes that its field has lost. If there are any, makes triangles to measure
 * how thick the parts are. */
static vsh_result warn_lost(const vsh_caster *caster, const vsh_mesh *meshes, size_t count,
                            const vsh_field *field, const vsh_run *run, vsh_error *error) {
    vshi_lost *lost = NULL;
    vshi_triangles *triangles = NULL;
    bool any = false;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&lost, count, sizeof *lost, "lost casters", error));
    VSHI_TRY_DONE(vshi_field_find_lost(field, meshes, count, NULL, lost, error));
    for (size_t m = 0; m < count; ++m) {
        any = any || lost[m].share >= LEAST_LOST;
    }
    if (!any) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_triangles_create(meshes, count, NULL, run, &triangles, error));
    VSHI_TRY_DONE(vshi_field_find_lost(field, meshes, count, triangles, lost, error));
    for (size_t m = 0; m < count; ++m) {
        char help[64] = "finer ones may hold it";
        if (lost[m].thickness > 0.0) {
            snprintf(help, sizeof help, "voxels of %.2g hold most of it", HELD * lost[m].thickness);
        }
        if (lost[m].share >= LEAST_LOST) {
            vshi_warn(
                run,
                "%s: mesh '%s': a part of it (%.2g %% of its area) is thinner than 1.25 voxels of %.3g and "
                "casts nothing; %s, and --method exact needs none",
                caster->path, meshes[m].name != NULL ? meshes[m].name : "", 100.0 * lost[m].share,
                field->voxel_size, help);
        }
    }
done:
    vshi_triangles_free(triangles);
    free(lost);
    return result;
}

/* Warns of one-sided and lost meshes of a layer, unless their triangles are traced. */
static vsh_result warn_of_voxels(const vsh_scene *scene, const vsh_assets *assets,
                                 const vsh_scene_layer *layer, const vsh_field *field, const vsh_run *run,
                                 vsh_error *error) {
    if (run->warning == NULL || !vshi_scene_marches(scene, layer)) {
        return VSH_OK;
    }
    for (size_t i = 0; i < scene->caster_count; ++i) {
        const vsh_caster *caster = &scene->casters[i];
        size_t count = 0, one_sided = 0;
        const vsh_mesh *meshes = vsh_assets_caster(assets, i, &count);
        if (count == 0 || caster->type != VSH_CASTER_MESH || !is_in_layer(caster, layer)) {
            continue;
        }
        for (size_t m = 0; m < count; ++m) {
            one_sided += meshes[m].one_sided != 0;
        }
        if (one_sided > 0) {
            vshi_warn(run,
                      "%s: %zu of %zu meshes are one-sided, but voxels cast to both sides; --method exact "
                      "and --ao-method exact let light through their backs",
                      caster->path, one_sided, count);
        }
        VSHI_TRY(warn_lost(caster, meshes, count, field, run, error));
    }
    return VSH_OK;
}

/* --- occluders */

/* Default distance of points from the casters' box, as a multiple of its diagonal. */
static const double WITHIN = 4.0;

typedef struct occluder_build {
    const vsh_scene *scene;
    const vsh_assets *assets;
    vsh_scene_occluders_options options;
    vsh_run run;       /* as given */
    vsh_run voxel_run; /* for voxels: it holds the fields made so far, and may be silent */
    vshi_occluders_own own;
    vshi_layer *layers; /* [parts.layer_count] */
    vshi_occluder_parts parts;
} occluder_build;

/* Chooses the reach for receivers in a box, or for points within a distance of the casters' box. */
static double choose_reach(const occluder_build *m, const vsh_grid_info *info) {
    const vsh_scene_occluders_options *o = &m->options;
    if (o->receivers_min != NULL) {
        return find_reach(m->scene, info, o->receivers_min, o->receivers_max);
    }
    const double diagonal =
        vshi_length(vshi_sub(vshi_vec_of(info->bounds_max), vshi_vec_of(info->bounds_min)));
    const double margin = o->within > 0.0 ? o->within : WITHIN * diagonal;
    double around_min[3], around_max[3];
    for (int axis = 0; axis < 3; ++axis) {
        around_min[axis] = info->bounds_min[axis] - margin;
        around_max[axis] = info->bounds_max[axis] + margin;
    }
    const double reach = find_reach(m->scene, info, around_min, around_max);
    /* the field's own default, if that is enough: a program that uses it gets the same bits */
    return reach > WITHIN * diagonal ? reach : vshi_field_options_default().reach;
}

static vshi_field_options choose_field_options(const occluder_build *m, const vsh_scene_layer *layer,
                                               const vsh_grid_info *voxels) {
    /* making a surface takes as long as the surface saves on this many rays an active voxel */
    static const double RAYS = 2.0;
    vshi_field_options options = vshi_field_options_default();
    options.reach = choose_reach(m, voxels);
    options.surface =
        m->options.points * estimate_field_rays(m->scene, layer) >= RAYS * (double)voxels->active_voxels;
    if (is_level_set(m->scene, layer)) {
        options.grown = 0.0; /* its voxels are the definition */
    }
    if (layer != NULL) {
        options.reach *= fmax(1.0, layer->softness); /* wider lights need more reach */
    }
    return options;
}

/* Makes a field of the layer's casters with so many voxels, or of the given level set. */
static vsh_result create_field(occluder_build *m, const vsh_scene_layer *layer, int32_t resolution,
                               vsh_grid_info *voxels, vsh_field **field, vsh_error *error) {
    const double start = vshi_seconds();
    const vsh_grid *grid = layer == NULL ? m->options.grid : NULL;
    vsh_grid *made = NULL;
    if (grid == NULL) {
        vsh_scene scene = *m->scene;
        scene.grid.resolution = resolution != VSHI_RESOLUTION_NAMED ? resolution : scene.grid.resolution;
        VSHI_TRY(vshi_scene_layer_casters(&scene, m->assets, layer, &m->voxel_run, &made, error));
        grid = made;
    }
    if (grid == NULL) {
        return VSH_OK;
    }
    m->own.voxelize_s += vshi_seconds() - start;
    vsh_grid_get_info(grid, voxels);
    const vshi_field_options options = choose_field_options(m, layer, voxels);
    const vsh_result result = vshi_field_create(grid, &options, &m->voxel_run, field, error);
    vsh_grid_free(made); /* the field does not need it */
    return result;
}

/* Makes a layer's field; *field is NULL if there are no casters. */
static vsh_result make_layer_field(occluder_build *m, const vsh_scene_layer *layer,
                                   const vshi_triangles *triangles, vsh_field **field, vsh_error *error) {
    const double start = vshi_seconds(), voxelized = m->own.voxelize_s;
    const bool given = layer == NULL && m->options.grid != NULL;
    int32_t resolution = VSHI_RESOLUTION_NAMED;
    if (m->options.voxels == 0 && !given) {
        resolution = vshi_scene_resolution(m->scene, m->assets, layer, m->options.points);
    }
    if (resolution == VSHI_RESOLUTION_NAMED && !given && vshi_scene_keeps_voxels(m->scene, layer)) {
        resolution = 0;
    }
    if (resolution == 0 && triangles != NULL && m->options.voxels == 0) {
        VSHI_TRY(vshi_occluders_unknown(triangles, field, error));
        const vshi_mesh_set *set = vshi_assets_set(m->assets);
        if (*field != NULL && layer == NULL && set->count > 0) {
            vshi_mesh_set_note(set, 0.0, 0.0, &m->voxel_run);
        }
        return VSH_OK;
    }
    vsh_grid_info voxels;
    VSHI_TRY(create_field(m, layer, resolution, &voxels, field, error));
    if (*field == NULL) {
        return VSH_OK;
    }
    vsh_field_info info;
    vsh_field_get_info(*field, &info);
    m->own.grid_bytes += voxels.bytes;
    m->voxel_run.memory_held += info.bytes;
    m->own.field_s += vshi_seconds() - start - (m->own.voxelize_s - voxelized);
    vsh_run run = m->run;
    run.warning = m->voxel_run.warning;
    return warn_of_voxels(m->scene, m->assets, layer, *field, &run, error);
}

/* Makes triangles if exact methods trace them. */
static vsh_result make_triangles(occluder_build *m, const vsh_scene_layer *layer, vshi_triangles **triangles,
                                 vsh_error *error) {
    if (m->options.triangles == 0 || !any_method_is(m->scene, layer, VSH_METHOD_TRIANGLES, true)) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_scene_triangles(m->scene, m->assets, layer, &m->run, triangles, error));
    /* the methods need triangles, even empty ones if all casters are in layers */
    return *triangles == NULL && layer == NULL
               ? vshi_triangles_create(NULL, 0, NULL, &m->run, triangles, error)
               : VSH_OK;
}

/* Makes the casters that values are compared with, unless memory is short: baking needs none of it. */
static vsh_result make_truth(occluder_build *m, vsh_error *error) {
    if (m->options.truth == 0 || !wants_truth(m->scene)) {
        return VSH_OK;
    }
    if (m->own.triangles != NULL) { /* all casters have some, or no method would trace them */
        m->parts.true_triangles = m->own.triangles;
        return VSH_OK;
    }
    vsh_error why;
    const vsh_result result =
        vshi_scene_truth(m->scene, m->assets, &m->run, &m->own.true_triangles, &m->own.true_solids, &why);
    m->parts.true_triangles = m->own.true_triangles;
    m->parts.true_solids = m->own.true_solids;
    return result == VSH_ERROR_CANCELLED ? vshi_fail(error, result, "%s", why.message) : VSH_OK;
}

static vshi_layer make_layer(const vsh_scene_layer *layer) {
    return (vshi_layer){.name = layer->name,
                        .method = layer->method,
                        .combine = layer->combine,
                        .softness = layer->softness,
                        .remap = {layer->remap[0], layer->remap[1]},
                        .start_offset = layer->start_offset,
                        .lights = layer->lights,
                        .light_count = layer->light_count,
                        .ao = layer->ao};
}

/* Adds a caster without voxels, shaded as its layer is. `place`: of its triangles and field for AO rays. */
static vsh_result add_direct(occluder_build *m, size_t index, size_t place, vsh_error *error) {
    const vsh_caster *caster = &m->scene->casters[index];
    const vsh_scene_layer *of = find_layer(m->scene, caster);
    vshi_layer *layer = &m->layers[m->parts.layer_count++];
    vshi_triangles **triangles = &m->own.layer_triangles[place];
    vsh_field **field = &m->own.layer_fields[place];
    *layer = of != NULL ? make_layer(of) : vshi_layer_default();
    layer->heights = vshi_assets_caster(m->assets, index)->heights;
    layer->spheres = vshi_assets_caster(m->assets, index)->spheres;
    if (layer->ao != 0 && bakes_ao(m->scene)) {
        VSHI_TRY(vshi_scene_caster_triangles(m->scene, m->assets, index, &m->run, triangles, error));
        VSHI_TRY(vshi_occluders_unknown(*triangles, field, error));
        layer->field = *field;
        layer->triangles = *triangles;
    }
    return VSH_OK;
}

static vsh_result make_layers(occluder_build *m, vsh_error *error) {
    const vsh_scene *scene = m->scene;
    vshi_occluders_own *own = &m->own;
    size_t direct = 0;
    for (size_t i = 0; i < scene->caster_count; ++i) {
        direct += vshi_caster_is_direct(scene, &scene->casters[i]);
    }
    const size_t most = scene->layer_count + direct;
    if (most > VSHI_MAX_LAYERS) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%zu layers and %zu casters that are not voxelised: at most %d together",
                         scene->layer_count, direct, VSHI_MAX_LAYERS);
    }
    const vshi_array arrays[] = {VSHI_ARRAY(m->layers, most), VSHI_ARRAY(own->layer_fields, most),
                                 VSHI_ARRAY(own->layer_triangles, most)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "layers", error));
    own->layer_capacity = most;
    for (size_t i = 0; i < scene->layer_count; ++i) {
        const vsh_scene_layer *of = &scene->layers[i];
        vshi_triangles **triangles = &own->layer_triangles[i];
        vsh_field **field = &own->layer_fields[i];
        VSHI_TRY(make_triangles(m, of, triangles, error));
        vsh_error why;
        const vsh_result result = make_layer_field(m, of, *triangles, field, &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "layer '%s': %s", of->name, why.message);
        }
        if (*field != NULL) {
            vshi_layer *layer = &m->layers[m->parts.layer_count++];
            *layer = make_layer(of);
            layer->field = *field;
            layer->triangles = *triangles;
        }
    }
    for (size_t i = 0, place = scene->layer_count; i < scene->caster_count; ++i) {
        if (vshi_caster_is_direct(scene, &scene->casters[i])) {
            VSHI_TRY(add_direct(m, i, place++, error));
        }
    }
    return VSH_OK;
}

static vsh_result make_all(occluder_build *m, vsh_error *error) {
    const double start = vshi_seconds();
    VSHI_TRY(make_triangles(m, NULL, &m->own.triangles, error));
    VSHI_TRY(make_truth(m, error));
    m->own.triangles_s = vshi_seconds() - start;
    VSHI_TRY(make_layer_field(m, NULL, m->own.triangles, &m->own.field, error));
    VSHI_TRY(make_layers(m, error));
    return m->own.field != NULL || m->parts.layer_count > 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "the scene has no casters");
}

vsh_result vsh_scene_occluders(const vsh_scene *scene, const vsh_assets *assets,
                               const vsh_scene_occluders_options *options, const vsh_run *run,
                               vsh_occluders **occluders, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(occluders);
    VSHI_NEEDS_BOTH(scene, assets);
    occluder_build m = {.scene = scene,
                        .assets = assets,
                        .options = vsh_scene_occluders_options_default(),
                        .parts = {.field = NULL}};
    VSHI_TRY(
        vshi_options_resolve(options, &m.options, sizeof m.options, "vsh_scene_occluders_options", error));
    if ((m.options.receivers_min == NULL) != (m.options.receivers_max == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receivers_min and receivers_max: one of them is NULL");
    }
    VSHI_TRY(vshi_run_resolve(run, &m.run, error));
    m.voxel_run = m.run;
    m.voxel_run.warning = m.options.silent_voxels != 0 ? NULL : m.run.warning;
    vsh_result result = make_all(&m, error);
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
