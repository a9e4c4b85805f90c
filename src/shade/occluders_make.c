/* What casts, from a level set or from arrays of meshes. */
#include "base/clock.h"
#include "base/floats.h"
#include "base/job.h"
#include "mesh/mesh_set.h"
#include "shade/occluders.h"

#include <math.h>

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
