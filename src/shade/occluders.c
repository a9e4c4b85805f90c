#include "shade/occluders.h"

#include "base/clock.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "field/field.h"
#include "mesh/mesh_set.h"
#include "shade/layers.h"
#include "trace/embree.h"

#include <math.h>
#include <stdlib.h>

/* Of casters without voxels, whose surface is exact: positions of floats are off by a hundredth of it. */
static const double FLOAT_STEPS = 1e-5;

/* Of a voxel, world units, and of one from the origin, voxels: a double must tell voxels apart there. */
static const double LEAST_VOXEL = 1e-12, MOST_VOXEL = 1e12, FARTHEST = 1e12;

void vshi_occluders_own_free(vshi_occluders_own *own) {
    for (size_t i = 0; i < own->layer_capacity; ++i) {
        vsh_field_free(own->layer_fields != NULL ? own->layer_fields[i] : NULL);
        vsh_triangles_free(own->layer_triangles != NULL ? own->layer_triangles[i] : NULL);
    }
    free(own->layer_triangles);
    free(own->layer_fields);
    free(own->layers);
    vsh_solids_free(own->true_solids);
    vsh_triangles_free(own->true_triangles);
    vsh_triangles_free(own->triangles);
    vsh_field_free(own->field);
    *own = (vshi_occluders_own){.field = NULL};
}

static double extent(const vsh_layer *layer) {
    vsh_heights_info heights;
    vsh_spheres_info spheres;
    const double *low = heights.bounds_min, *high = heights.bounds_max;
    if (layer->heights != NULL) {
        vsh_heights_get_info(layer->heights, &heights);
    } else {
        vsh_spheres_get_info(layer->spheres, &spheres);
        low = spheres.bounds_min;
        high = spheres.bounds_max;
    }
    return fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
}

/* Of the finest layer; beside casters without voxels alone as fine as a float tells positions apart. */
static double finest_voxel(const vsh_layer *layers, size_t count) {
    double finest = INFINITY;
    for (size_t i = 0; i < count; ++i) {
        if (layers[i].field != NULL) {
            finest = fmin(finest, layers[i].field->voxel_size);
        }
    }
    return isinf(finest) ? fmin(fmax(FLOAT_STEPS * extent(&layers[0]), LEAST_VOXEL), MOST_VOXEL) : finest;
}

static vsh_result copy_layers(const vsh_occluder_parts *parts, vshi_occluders_own *own, vsh_error *error) {
    if (parts->layer_count > VSH_MAX_LAYERS || (parts->layer_count > 0 && parts->layers == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%zu layers%s: expected at most %d", parts->layer_count,
                         parts->layers == NULL ? " at NULL" : "", VSH_MAX_LAYERS);
    }
    void *layers;
    VSHI_TRY(vshi_allocate(&layers, parts->layer_count, sizeof *own->layers, "layers", error));
    own->layers = layers;
    for (size_t i = 0; i < parts->layer_count; ++i) {
        VSHI_TRY(vshi_layer_resolve(parts->layers, i, &own->layers[i], error));
    }
    return VSH_OK;
}

/* A box as large, and as near the origin, as one that has voxels may be. */
static vsh_result check_box(const double low[3], const double high[3], double longest, vsh_error *error) {
    const double least = LEAST_VOXEL * VSHI_TRACED_RESOLUTION, most = MOST_VOXEL * VSHI_TRACED_RESOLUTION;
    if (!(longest >= least && longest <= most)) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "the casters' box is %g across, expected %g … %g; scale the scene", longest, least,
                         most);
    }
    const double farthest = FARTHEST / VSHI_TRACED_RESOLUTION;
    for (int axis = 0; axis < 3; ++axis) {
        const double away = fabs(low[axis] + 0.5 * (high[axis] - low[axis]));
        if (!(away <= farthest * longest)) {
            return vshi_fail(error, VSH_ERROR_LIMIT,
                             "the casters' box lies %g from the origin, %g at most where it is %g across; "
                             "move the scene",
                             away, farthest * longest, longest);
        }
    }
    return VSH_OK;
}

vsh_result vshi_occluders_unknown(const vsh_triangles *triangles, double voxel_size, vsh_field **field,
                                  vsh_error *error) {
    double low[3], high[3], longest = 0.0;
    *field = NULL;
    vshi_triangles_bounds(triangles, low, high);
    if (low[0] > high[0]) {
        return VSH_OK;
    }
    for (int axis = 0; axis < 3; ++axis) {
        longest = fmax(longest, high[axis] - low[axis]);
    }
    if (voxel_size == 0.0) {
        VSHI_TRY(check_box(low, high, longest, error));
        voxel_size = longest / VSHI_TRACED_RESOLUTION;
    }
    return vshi_field_create_unknown(voxel_size, low, high, field, error);
}

/* What stands in place of a field: casters that are traced only, or none beside the layers. */
static vsh_result make_fieldless(const vsh_occluder_parts *parts, vshi_occluders_own *own, vsh_error *error) {
    if (parts->triangles != NULL) {
        VSHI_TRY(vshi_occluders_unknown(parts->triangles, parts->voxel_size, &own->field, error));
    }
    if (own->field != NULL) {
        return VSH_OK;
    }
    if (parts->layer_count == 0 && parts->voxel_size == 0.0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "occluders: neither a field nor triangles nor layers");
    }
    const double voxel_size =
        parts->voxel_size != 0.0 ? parts->voxel_size : finest_voxel(own->layers, parts->layer_count);
    return vshi_field_create_empty(voxel_size, &own->field, error);
}

/* Takes what is owned along. */
static vsh_result make(const vsh_occluder_parts *parts, vshi_occluders_own *own, vsh_occluders **occluders,
                       vsh_error *error) {
    VSHI_TRY(copy_layers(parts, own, error));
    if (parts->field == NULL) {
        VSHI_TRY(make_fieldless(parts, own, error));
    }
    vsh_occluders *made;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "occluders", error));
    const vsh_result result = vshi_allocate((void **)&made->own, 1, sizeof *own, "occluders", error);
    if (result != VSH_OK) {
        free(made);
        return result;
    }
    *made->own = *own;
    made->field = parts->field != NULL ? parts->field : own->field;
    made->triangles = parts->triangles;
    made->layers = own->layers;
    made->layer_count = parts->layer_count;
    made->true_triangles = parts->true_triangles;
    made->true_solids = parts->true_solids;
    *occluders = made;
    return VSH_OK;
}

vsh_result vshi_occluders_make(const vsh_occluder_parts *parts, vshi_occluders_own *own,
                               vsh_occluders **occluders, vsh_error *error) {
    const vsh_result result = make(parts, own, occluders, error);
    if (result != VSH_OK) {
        vshi_occluders_own_free(own);
    }
    return result;
}

vsh_result vsh_occluders_from_parts(const vsh_occluder_parts *parts, vsh_occluders **occluders,
                                    vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    *occluders = NULL;
    VSHI_NEEDS(parts);
    vsh_occluder_parts full = vsh_occluder_parts_default();
    vshi_occluders_own own = {.field = NULL};
    VSHI_TRY(vshi_options_resolve(parts, &full, sizeof full, "vsh_occluder_parts", error));
    return vshi_occluders_make(&full, &own, occluders, error);
}

/* --- from a level set, or from arrays of meshes */

static vsh_result make_field(const vsh_grid *grid, const vsh_field_options *options, const vsh_run *run,
                             vshi_occluders_own *own, vsh_error *error) {
    const double start = vshi_seconds();
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    const vsh_result result = vsh_field_create(grid, options, run, &own->field, error);
    own->grid_bytes = info.bytes;
    own->field_s = vshi_seconds() - start;
    return result;
}

vsh_result vsh_occluders_from_grid(const vsh_grid *grid, const vsh_field_options *options, const vsh_run *run,
                                   vsh_occluders **occluders, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    *occluders = NULL;
    VSHI_NEEDS(grid);
    vshi_occluders_own own = {.field = NULL};
    VSHI_TRY(make_field(grid, options, run, &own, error));
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    parts.field = own.field;
    return vshi_occluders_make(&parts, &own, occluders, error);
}

static vsh_result make_field_of_meshes(const vsh_mesh *meshes, size_t count,
                                       const vsh_occluders_options *options, const vsh_run *run,
                                       vshi_occluders_own *own, vsh_error *error) {
    vsh_grid *grid = NULL;
    const double start = vshi_seconds();
    vsh_result result = vsh_grid_from_meshes(meshes, count, &options->grid, run, &grid, error);
    if (result != VSH_OK) {
        return result;
    }
    own->voxelize_s = vshi_seconds() - start;
    vsh_field_options reach = vsh_field_options_default();
    reach.reach = options->reach;
    result = make_field(grid, &reach, run, own, error);
    vsh_grid_free(grid);
    return result;
}

vsh_result vsh_occluders_create(const vsh_mesh *meshes, size_t mesh_count,
                                const vsh_occluders_options *options, const vsh_run *run,
                                vsh_occluders **occluders, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(occluders);
    *occluders = NULL;
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_occluders_options full = vsh_occluders_options_default();
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_occluders_options", error));
    vsh_run resolved;
    VSHI_TRY(vshi_run_resolve(run, &resolved, error));
    vshi_occluders_own own = {.field = NULL};
    vshi_mesh_set set;
    vsh_result result;
    VSHI_TRY_DONE(vshi_mesh_set_create(meshes, mesh_count, &set, error));
    VSHI_TRY_DONE(vshi_mesh_set_solve(&set, &resolved, error));
    if (mesh_count == 0) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_ARGUMENT, "occluders: no meshes"));
    }
    if (!(full.reach >= 0.0) || isinf(full.reach)) {
        VSHI_TRY_DONE(
            vshi_fail(error, VSH_ERROR_ARGUMENT, "reach %g: expected a length, 0 or more", full.reach));
    }
    size_t triangles = 0;
    for (size_t m = 0; m < mesh_count; ++m) {
        triangles += set.meshes[m].triangle_count - set.checked[m].report.degenerate_triangles;
    }
    if (triangles == 0) {
        VSHI_TRY_DONE(vshi_fail(error, VSH_ERROR_INPUT, "occluders: no triangle of any area"));
    }
    const bool voxels = full.grid.resolution != 0 || full.grid.voxel_size != 0.0;
    const bool traced = full.triangles != 0;
    if (!voxels) {
        full.grid.resolution = vsh_grid_options_default().resolution;
    }
    if (voxels || !traced) {
        VSHI_TRY_DONE(make_field_of_meshes(set.meshes, mesh_count, &full, run, &own, error));
    }
    if (traced) {
        const double start = vshi_seconds();
        VSHI_TRY_DONE(vsh_triangles_create(set.meshes, mesh_count, run, &own.triangles, error));
        own.triangles_s = vshi_seconds() - start;
    }
    if (own.field == NULL) {
        VSHI_TRY_DONE(vshi_occluders_unknown(own.triangles, 0.0, &own.field, error));
        vshi_mesh_set_note(&set, 0.0, 0.0, &resolved);
    }
    vsh_occluder_parts parts = vsh_occluder_parts_default();
    parts.field = own.field;
    parts.triangles = parts.true_triangles = own.triangles;
    vshi_mesh_set_free(&set);
    return vshi_occluders_make(&parts, &own, occluders, error);
done:
    vshi_mesh_set_free(&set);
    vshi_occluders_own_free(&own);
    return result;
}

void vsh_occluders_free(vsh_occluders *occluders) {
    if (occluders != NULL) {
        vshi_occluders_own_free(occluders->own);
        free(occluders->own);
        free(occluders);
    }
}

void vsh_occluders_get_parts(const vsh_occluders *occluders, vsh_occluder_parts *parts) {
    const vsh_occluder_parts made = {.struct_size = sizeof made,
                                     .field = occluders->field,
                                     .triangles = occluders->triangles,
                                     .layers = occluders->layers,
                                     .layer_count = occluders->layer_count,
                                     .true_triangles = occluders->true_triangles,
                                     .true_solids = occluders->true_solids};
    *parts = made;
}

/* Adds up what fields take; sizes are those of the first. */
static void count(const vsh_field *field, vsh_occluders_info *info) {
    if (field->unknown || vshi_field_is_empty(field)) {
        return;
    }
    vsh_field_info own;
    vsh_field_get_info(field, &own);
    if (info->field_bytes == 0) {
        info->voxel_size = own.voxel_size;
        info->levels = own.levels;
    }
    info->active_voxels += own.active_voxels;
    info->bricks += own.bricks;
    info->field_bytes += own.bytes;
}

void vsh_occluders_get_info(const vsh_occluders *occluders, vsh_occluders_info *info) {
    const vshi_occluders_own *own = occluders->own;
    vsh_occluders_info made = {.layer_count = occluders->layer_count,
                               .has_triangles = occluders->triangles != NULL,
                               .grid_bytes = own->grid_bytes,
                               .voxelize_s = own->voxelize_s,
                               .field_s = own->field_s,
                               .triangles_s = own->triangles_s};
    count(occluders->field, &made);
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        if (occluders->layers[i].field != NULL) {
            count(occluders->layers[i].field, &made);
        }
    }
    made.triangles_bytes = occluders->triangles != NULL ? vsh_triangles_bytes(occluders->triangles) : 0;
    if (occluders->true_triangles != NULL && occluders->true_triangles != occluders->triangles) {
        made.triangles_bytes += vsh_triangles_bytes(occluders->true_triangles);
    }
    *info = made;
}
