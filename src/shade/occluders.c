/* Occluders made of meshes, level sets or parts, and the choice of a number of voxels. */
#include "shade/occluders.h"

#include "base/clock.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "field/field.h"
#include "geometry/mesh_set.h"
#include "trace/trace.h"

#include <math.h>
#include <stdlib.h>

/* Voxel size of casters without voxels, whose surface is exact, as a share of their size: positions as floats
 * err by a hundredth of it. */
static const double FLOAT_STEPS = 1e-5;

/* Limits of a voxel, world units, and of its distance from the origin, voxels, at which doubles tell voxels
 * apart. */
static const double LEAST_VOXEL = 1e-12, MOST_VOXEL = 1e12, FARTHEST = 1e12;

void vshi_occluders_own_free(vshi_occluders_own *own) {
    for (size_t i = 0; i < own->layer_capacity; ++i) {
        vshi_field_free(own->layer_fields != NULL ? own->layer_fields[i] : NULL);
        vshi_triangles_free(own->layer_triangles != NULL ? own->layer_triangles[i] : NULL);
    }
    free(own->layer_triangles);
    free(own->layer_fields);
    free(own->layers);
    vshi_solids_free(own->true_solids);
    vshi_triangles_free(own->true_triangles);
    vshi_triangles_free(own->triangles);
    vshi_field_free(own->field);
    *own = (vshi_occluders_own){.field = NULL};
}

static double extent(const vshi_layer *layer) {
    vshi_heights_info heights;
    vshi_spheres_info spheres;
    const double *low = heights.bounds_min, *high = heights.bounds_max;
    if (layer->heights != NULL) {
        vshi_heights_get_info(layer->heights, &heights);
    } else {
        vshi_spheres_get_info(layer->spheres, &spheres);
        low = spheres.bounds_min;
        high = spheres.bounds_max;
    }
    return fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
}

/* The voxel size of the finest layer. Without voxels it is as fine as floats tell positions apart. */
static double finest_voxel(const vshi_layer *layers, size_t count) {
    double finest = INFINITY;
    for (size_t i = 0; i < count; ++i) {
        if (layers[i].field != NULL) {
            finest = fmin(finest, layers[i].field->voxel_size);
        }
    }
    return isinf(finest) ? fmin(fmax(FLOAT_STEPS * extent(&layers[0]), LEAST_VOXEL), MOST_VOXEL) : finest;
}

static vsh_result copy_layers(const vshi_occluder_parts *parts, vshi_occluders_own *own, vsh_error *error) {
    void *layers;
    VSHI_TRY(vshi_allocate(&layers, parts->layer_count, sizeof *own->layers, "layers", error));
    own->layers = layers;
    for (size_t i = 0; i < parts->layer_count; ++i) {
        VSHI_TRY(vshi_layer_check(parts->layers, i, error));
        own->layers[i] = parts->layers[i];
    }
    return VSH_OK;
}

/* Checks that the box could have voxels, by its size and distance from the origin. */
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

vsh_result vshi_occluders_unknown(const vshi_triangles *triangles, vsh_field **field, vsh_error *error) {
    double low[3], high[3], longest = 0.0;
    *field = NULL;
    vshi_triangles_bounds(triangles, low, high);
    if (low[0] > high[0]) {
        return VSH_OK;
    }
    for (int axis = 0; axis < 3; ++axis) {
        longest = fmax(longest, high[axis] - low[axis]);
    }
    VSHI_TRY(check_box(low, high, longest, error));
    return vshi_field_create_unknown(longest / VSHI_TRACED_RESOLUTION, low, high, field, error);
}

/* Makes a field without distances: of casters that are only traced, or, if all casters are in layers, of
 * none. */
static vsh_result make_fieldless(const vshi_occluder_parts *parts, vshi_occluders_own *own,
                                 vsh_error *error) {
    if (parts->triangles != NULL) {
        VSHI_TRY(vshi_occluders_unknown(parts->triangles, &own->field, error));
    }
    return own->field != NULL
               ? VSH_OK
               : vshi_field_create_empty(finest_voxel(own->layers, parts->layer_count), &own->field, error);
}

static vsh_result make(const vshi_occluder_parts *parts, vshi_occluders_own *own, vsh_occluders **occluders,
                       vsh_error *error) {
    VSHI_TRY(copy_layers(parts, own, error));
    if (parts->field == NULL) {
        VSHI_TRY(make_fieldless(parts, own, error));
    }
    vsh_occluders *made;
    VSHI_TRY(vshi_allocate((void **)&made, 1, sizeof *made, "occluders", error));
    *made = (vsh_occluders){.field = parts->field != NULL ? parts->field : own->field,
                            .triangles = parts->triangles,
                            .layers = own->layers,
                            .layer_count = parts->layer_count,
                            .true_triangles = parts->true_triangles,
                            .true_solids = parts->true_solids,
                            .own = *own};
    *occluders = made;
    return VSH_OK;
}

vsh_result vshi_occluders_make(const vshi_occluder_parts *parts, vshi_occluders_own *own,
                               vsh_occluders **occluders, vsh_error *error) {
    vshi_occluders_own none = {.field = NULL};
    own = own != NULL ? own : &none;
    *occluders = NULL;
    const vsh_result result = make(parts, own, occluders, error);
    if (result != VSH_OK) {
        vshi_occluders_own_free(own);
    }
    return result;
}

/* --- from a level set, or from arrays of meshes */

static vsh_result make_field(const vsh_grid *grid, const vshi_field_options *options, const vsh_run *run,
                             vshi_occluders_own *own, vsh_error *error) {
    const double start = vshi_seconds();
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    const vsh_result result = vshi_field_create(grid, options, run, &own->field, error);
    own->grid_bytes = info.bytes;
    own->field_s = vshi_seconds() - start;
    return result;
}

vsh_result vsh_occluders_from_grid(const vsh_grid *grid, const vsh_occluders_options *options,
                                   const vsh_run *run, vsh_occluders **occluders, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(occluders);
    VSHI_NEEDS(grid);
    vsh_occluders_options full = vsh_occluders_options_default();
    VSHI_TRY(vshi_options_resolve(options, &full, sizeof full, "vsh_occluders_options", error));
    vshi_occluders_own own = {.field = NULL};
    const vshi_field_options of_field = {.reach = full.reach, .grown = full.grown};
    VSHI_TRY(make_field(grid, &of_field, run, &own, error));
    const vshi_occluder_parts parts = {.field = own.field};
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
    const vshi_field_options of_field = {.reach = options->reach, .grown = options->grown};
    result = make_field(grid, &of_field, run, own, error);
    vsh_grid_free(grid);
    return result;
}

vsh_result vsh_occluders_create(const vsh_mesh *meshes, size_t mesh_count,
                                const vsh_occluders_options *options, const vsh_run *run,
                                vsh_occluders **occluders, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(occluders);
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
        VSHI_TRY_DONE(vshi_triangles_create(set.meshes, mesh_count, NULL, &resolved, &own.triangles, error));
        own.triangles_s = vshi_seconds() - start;
    }
    if (own.field == NULL) {
        VSHI_TRY_DONE(vshi_occluders_unknown(own.triangles, &own.field, error));
        vshi_mesh_set_note(&set, 0.0, 0.0, &resolved);
    }
    const vshi_occluder_parts parts = {
        .field = own.field, .triangles = own.triangles, .true_triangles = own.triangles};
    vshi_mesh_set_free(&set);
    return vshi_occluders_make(&parts, &own, occluders, error);
done:
    vshi_mesh_set_free(&set);
    vshi_occluders_own_free(&own);
    return result;
}

void vsh_occluders_free(vsh_occluders *occluders) {
    if (occluders != NULL) {
        vshi_occluders_own_free(&occluders->own);
        free(occluders);
    }
}

const vsh_field *vsh_occluders_get_field(const vsh_occluders *occluders, const char *layer) {
    if (layer == NULL) {
        return occluders->field;
    }
    for (size_t l = 0; l < occluders->layer_count; ++l) {
        const vshi_layer *at = &occluders->layers[l];
        if (at->field != NULL && at->name != NULL && strcmp(at->name, layer) == 0) {
            return at->field;
        }
    }
    return NULL;
}

/* Adds the sizes of a field. Voxel size and levels are those of the first field. */
static void add_field(const vsh_field *field, vsh_occluders_info *info) {
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
    const vshi_occluders_own *own = &occluders->own;
    vsh_occluders_info made = {.layer_count = occluders->layer_count,
                               .has_triangles = occluders->triangles != NULL,
                               .grid_bytes = own->grid_bytes,
                               .voxelize_s = own->voxelize_s,
                               .field_s = own->field_s,
                               .triangles_s = own->triangles_s};
    add_field(occluders->field, &made);
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        if (occluders->layers[i].field != NULL) {
            add_field(occluders->layers[i].field, &made);
        }
    }
    made.triangles_bytes = occluders->triangles != NULL ? vshi_triangles_bytes(occluders->triangles) : 0;
    if (occluders->true_triangles != NULL && occluders->true_triangles != occluders->triangles) {
        made.triangles_bytes += vshi_triangles_bytes(occluders->true_triangles);
    }
    *info = made;
}

/* Bytes of a layer's field, heights or spheres. */
static double layer_bytes(const vshi_layer *layer) {
    vshi_heights_info heights;
    vshi_spheres_info spheres;
    vsh_field_info field;
    if (layer->heights != NULL) {
        vshi_heights_get_info(layer->heights, &heights);
        return (double)heights.bytes;
    }
    if (layer->spheres != NULL) {
        vshi_spheres_get_info(layer->spheres, &spheres);
        return (double)spheres.bytes;
    }
    vsh_field_get_info(layer->field, &field);
    return (double)field.bytes;
}

double vshi_occluders_bytes(const vsh_occluders *occluders) {
    vsh_field_info info;
    vsh_field_get_info(occluders->field, &info);
    double bytes = (double)info.bytes;
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        bytes += layer_bytes(&occluders->layers[i]);
    }
    return bytes;
}

/* --- the number of voxels that pays
 *
 * Seconds were measured on one core of an AMD EPYC (Zen 3), as whole processes of the cloister, `smooth` and
 * `thin`. They are constants, so that the choice depends on the input alone (docs/accuracy.md). */

/* Seconds to load OpenVDB's module, to sort a triangle, and to measure a voxel of the band and put it into
 * the field. */
static const double MODULE_S = 0.05, TRIANGLE_S = 0.5e-6, VOXEL_S = 0.11e-6;
/* Voxels of a band for each voxel's area of surface: three on each side. */
static const double BAND = 6.5;

/* The share of values that a field proves although rays would have had to find them: MOST (1 - FIRST / N)
 * with N voxels. It is the mean of three assets, which differ by a factor of two (0.28, 0.50, 0.60 and 0.61
 * of `smooth` with 24, 48, 96 and 192; 0 to 0.16 of the cloister). */
static const double MOST = 0.45, FIRST = 12.0;
/* Seconds that a proved value saves at an error of 0.02, less the marches of all values. They grow with the
 * root of the smaller error: measured 1.6 to 2.7 times at 0.005. */
static const double PROVED_S = 0.2e-6, PROVED_ERROR = 0.02;

static const int32_t CHOICES[] = {48, 96, 192, 384};

int32_t vshi_resolution_traced(const vshi_resolution_need *need) {
    const double saves = need->values * PROVED_S * sqrt(PROVED_ERROR / fmax(need->max_error, 1e-4));
    int32_t best = 0;
    double most = 0.0;
    for (size_t i = 0; need->longest > 0.0 && i < sizeof CHOICES / sizeof CHOICES[0]; ++i) {
        const double n = CHOICES[i], voxel = need->longest / n;
        const double building =
            MODULE_S + TRIANGLE_S * need->triangles + VOXEL_S * BAND * need->area / (voxel * voxel);
        const double gain = saves * MOST * (1.0 - FIRST / n) - building;
        if (gain > most) {
            most = gain;
            best = CHOICES[i];
        }
    }
    return best;
}

/* The displacement by voxels, times their number along the longest side: measured 3.1 for the seeds' shadows,
 * 0.9 for their AO within 0.6. */
static const double DISPLACED = 4.0, DISPLACED_AO = 1.2;
/* Fewer voxels lose too many thin parts, more take gigabytes. */
enum { LEAST = 128, LARGEST = 1024 };

int32_t vshi_resolution_marched(double max_error, int32_t ao_only) {
    const double wanted = ceil((ao_only ? DISPLACED_AO : DISPLACED) / fmax(max_error, 1e-4));
    return wanted < LEAST ? LEAST : wanted > LARGEST ? LARGEST : (int32_t)wanted;
}
