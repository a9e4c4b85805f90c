/* A scene's fields in a file: made once, and taken from there by whoever bakes the same casters
 * (docs/field.md). */
#ifndef VDBSHADE_SCENE_FIELD_H
#define VDBSHADE_SCENE_FIELD_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How a scene's fields are kept. */
typedef struct vsh_scene_field_options {
    size_t struct_size;
    const vsh_attribute *attributes; /* [attribute_count]: for people, such as vsh_provenance_attributes();
                                        may be NULL where that is 0 */
    size_t attribute_count;
} vsh_scene_field_options;

static inline vsh_scene_field_options vsh_scene_field_options_default(void) {
    vsh_scene_field_options options = {sizeof(vsh_scene_field_options), NULL, 0};
    return options;
}

/* What fields took, or will take. */
typedef struct vsh_scene_field_report {
    size_t fields;          /* 1, and one for each layer that has casters with voxels */
    uint64_t active_voxels; /* these three of all */
    uint64_t grid_bytes;    /* of their level sets, in memory while they are made */
    uint64_t field_bytes;   /* in memory; a file is as large */
    double finest;          /* voxel of all, world units */
    double voxelize_s;      /* seconds */
    double field_s;         /* seconds that the fields took */
    double write_s;         /* and the file */
} vsh_scene_field_report;

/* Makes the fields of a scene's casters, as vsh_scene_occluders() does, with levels for any reach, and writes
 * them to a file (vsh_field_file_write()) with all that shaped them: vsh_scene.grid and the layers' voxels,
 * and what the casters are. Lights, receivers and accuracy shape nothing, but where the scene names no
 * voxels and those that vsh_scene_resolution() finds depend on them. Warns of what voxels make of casters.
 * Written whole or not at all. Errors:
 * - VSH_ERROR_ARGUMENT: scene, assets or path NULL, options, run;
 * - VSH_ERROR_INPUT: no casters that are voxelised; casters whose triangles would be traced alone, so that
 *   there is nothing to keep: name voxels, or a method that marches; as vsh_scene_casters() and
 * vsh_field_create();
 * - VSH_ERROR_LIMIT, VSH_ERROR_WRITE, VSH_ERROR_UNSUPPORTED: as these and vsh_field_file_write();
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_scene_save_field_sized(const vsh_scene *scene, const vsh_assets *assets,
                                              const char *path, const vsh_scene_field_options *options,
                                              const vsh_run *run, vsh_scene_field_report *report,
                                              size_t report_size, vsh_error *error);
static inline vsh_result vsh_scene_save_field(const vsh_scene *scene, const vsh_assets *assets,
                                              const char *path, const vsh_scene_field_options *options,
                                              const vsh_run *run, vsh_scene_field_report *report,
                                              vsh_error *error) {
    return vsh_scene_save_field_sized(scene, assets, path, options, run, report, sizeof *report, error);
}

/* The voxels of the band of the scene's casters, bit by bit those of vsh_voxels_from_grid() with `band` and
 * the level set that vsh_scene_casters() makes, out of scene->field: no voxel is made. `assets` are those
 * loaded for this scene. Free with vsh_voxels_free(). Errors:
 * - VSH_ERROR_ARGUMENT: scene, assets or voxels NULL, a scene that takes no field, a band that is none, run;
 * - VSH_ERROR_INPUT: a scene with layers, each of which has a field of its own; a scene->field that is stale;
 *   a band narrower than the level set's, and one that was not kept;
 * - VSH_ERROR_READ, VSH_ERROR_LIMIT, VSH_ERROR_UNSUPPORTED, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED: as
 *   vsh_field_file_band(). */
VSH_API vsh_result vsh_scene_field_band(const vsh_scene *scene, const vsh_assets *assets, double band,
                                        const vsh_run *run, vsh_voxels **voxels, vsh_error *error);

/* What vsh_scene_save_field() will take, found out by fields of 96 voxels, or where the casters' own voxels
 * are taken by those themselves; nothing is written. Times may be half or twice as much. Errors: as there. */
VSH_API vsh_result vsh_scene_field_forecast_sized(const vsh_scene *scene, const vsh_assets *assets,
                                                  const vsh_run *run, vsh_scene_field_report *report,
                                                  size_t report_size, vsh_error *error);
static inline vsh_result vsh_scene_field_forecast(const vsh_scene *scene, const vsh_assets *assets,
                                                  const vsh_run *run, vsh_scene_field_report *report,
                                                  vsh_error *error) {
    return vsh_scene_field_forecast_sized(scene, assets, run, report, sizeof *report, error);
}

/* Has a scene take its fields from a file, which must outlive the scene and all that is made of it: call it
 * before vsh_assets_load(), which then reads no .vdb that casts, and vsh_scene_occluders(), which makes no
 * voxels. Where the scene names no voxels and that of the file did, it takes those. `file` NULL: they are
 * made again. Values are those that are baked without, bit by bit: whether the fields are those of the
 * scene's casters is looked at by vsh_scene_occluders(). Not safe against other threads that use the scene.
 * Errors: VSH_ERROR_ARGUMENT (scene NULL), VSH_ERROR_READ (a file that names voxels out of range).
 */
VSH_API vsh_result vsh_scene_use_field(vsh_scene *scene, const vsh_field_file *file, vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
