#include "bake_scene/bake_scene.h"

#include "bake_scene/parts.h"
#include "base/clock.h"
#include "base/file.h"
#include "base/job.h"
#include "base/memory.h"
#include "image/planes.h"
#include "shade/occluders.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- checks */

static vsh_result check_index(const vsh_scene *scene, size_t index, vsh_error *error) {
    return index < scene->receiver_count
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT, "receivers[%zu]: there are %zu", index,
                           scene->receiver_count);
}

static vsh_result check_image(const char *path, const vsh_image *image, const vsh_image_options *options,
                              vsh_error *error) {
    vsh_error why;
    const vsh_result result = vsh_image_check(path, image, options, &why);
    if (result == VSH_OK) {
        return VSH_OK;
    }
    const char *assets = vshi_image_is_written(path) ? "" : "; or glb, gltf, obj for the mesh with its light";
    return vshi_fail(error, result, "%s%s", why.message, assets);
}

vsh_result vsh_receiver_check(const vsh_scene *scene, size_t index, vsh_error *error) {
    VSHI_NEEDS(scene);
    VSHI_TRY(check_index(scene, index, error));
    const vsh_receiver *receiver = &scene->receivers[index];
    const vsh_image_options options = vshi_receiver_image(receiver);
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(scene, receiver->width, receiver->height, &channels, error));
    result = vsh_lit_is_output(receiver->output)
                 ? vshi_lit_output_check(receiver, &channels.image, error)
                 : check_image(receiver->output, &channels.image, &options, error);
done:
    vshi_channels_free(&channels);
    return result;
}

static vsh_result check_shard(const vsh_bake_options *options, vsh_error *error) {
    const int32_t count = options->shard_count;
    if (count < 0 || count > VSHI_MOST_SHARDS || options->shard < 0 || options->shard > count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_bake_options.shard %d of %d: expected 1 to %d, and no more than there are",
                         options->shard, count, VSHI_MOST_SHARDS);
    }
    if (options->shard > 0 && (options->rows != NULL || options->invalid_picture != NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_bake_options.shard: not together with %s",
                         options->rows != NULL ? "rows" : "invalid_picture");
    }
    for (size_t i = 0; i < options->word_count; ++i) {
        if (options->words == NULL || options->words[i] == NULL) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_bake_options.words[%zu] is NULL", i);
        }
    }
    return VSH_OK;
}

static vsh_result check_outputs(const vsh_scene *scene, const vsh_bake_options *options, bool forecast,
                                vsh_error *error) {
    size_t assets = 0;
    for (size_t i = 0; i < scene->receiver_count && options->rows == NULL; ++i) {
        const vsh_result result = vsh_receiver_check(scene, i, error);
        if (result != VSH_OK && !(forecast && result == VSH_ERROR_WRITE)) { /* the folder is not needed yet */
            return result;
        }
        assets += vsh_lit_is_output(scene->receivers[i].output) != 0;
    }
    if (options->lit_exr != NULL && (assets != 1 || scene->receiver_count != 1)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_bake_options.lit_exr: needs one output that is a .glb, .gltf or .obj");
    }
    return options->invalid_picture != NULL && !forecast ? vshi_output_check(options->invalid_picture, error)
                                                         : VSH_OK;
}

/* --- loading */

/* Takes memory for the results, and lists the lightmaps. */
static vsh_result prepare_results(vshi_scene_bake *bake, vsh_error *error) {
    const vshi_targets *targets = &bake->targets;
    bake->error_count = bake->scene.light_count + 2;
    bake->report.lightmap_count = targets->count;
    VSHI_TRY(vshi_allocate((void **)&bake->errors, bake->error_count, sizeof *bake->errors, "bake", error));
    VSHI_TRY(vshi_allocate((void **)&bake->lit, bake->error_count, sizeof *bake->lit, "bake", error));
    VSHI_TRY(vshi_allocate((void **)&bake->lightmaps, targets->count + 1, sizeof *bake->lightmaps,
                           "lightmaps", error));
    for (size_t i = 0; i < targets->count; ++i) {
        const vshi_target *target = &targets->list[i];
        bake->lightmaps[i] = (vsh_scene_lightmap){.receiver = target->index,
                                                  .page = target->page,
                                                  .path = target->receiver.path,
                                                  .output = target->receiver.output,
                                                  .meshes = target->meshes,
                                                  .mesh_count = target->mesh_count,
                                                  .width = target->receiver.width,
                                                  .height = target->receiver.height};
    }
    return VSH_OK;
}

/* Checks the arguments, reads the scene's files and lists its lightmaps. Free the bake also after an error.
 */
static vsh_result load(vshi_scene_bake *bake, const vsh_scene *scene, const vsh_bake_options *options,
                       const vsh_run *run, bool forecast, vsh_error *error) {
    const double start = vshi_seconds();
    *bake = (vshi_scene_bake){.options = vsh_bake_options_default(), .report.shade = vsh_shade_stats_zero()};
    bake->scene = *scene;
    VSHI_TRY(vshi_run_resolve(run, &bake->run, error));
    VSHI_TRY(vshi_options_resolve(options, &bake->options, sizeof bake->options, "vsh_bake_options", error));
    if (scene->receiver_count == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: no receivers");
    }
    VSHI_TRY(check_shard(&bake->options, error));
    VSHI_TRY(check_outputs(scene, &bake->options, forecast, error));
    if (bake->options.rows == NULL) {
        vshi_lit_output_scene(&bake->scene);
    }
    VSHI_TRY(vsh_assets_load(&bake->scene, &bake->run, &bake->assets, error));
    VSHI_TRY(vshi_targets_make(&bake->scene, bake->assets, &bake->run, &bake->targets, error));
    VSHI_TRY(prepare_results(bake, error));
    VSHI_TRY(vshi_lit_check_uvs(bake, error));
    bake->report.load_s = vshi_seconds() - start;
    return bake->options.loaded != NULL
               ? bake->options.loaded(bake->options.user, bake->lightmaps, bake->targets.count, error)
               : VSH_OK;
}

static void free_bake(vshi_scene_bake *bake) {
    vshi_parts_free(bake->parts);
    free(bake->errors);
    free(bake->lit);
    vshi_lit_pages_free(bake);
    vsh_provenance_free(bake->provenance);
    vshi_tracer_free(bake->tracer);
    vsh_occluders_free(bake->occluders);
    for (size_t i = 0; bake->charts != NULL && i < bake->targets.count; ++i) {
        vsh_charts_free(bake->charts[i]);
    }
    free(bake->charts);
    free(bake->lightmaps);
    vshi_targets_free(&bake->targets);
    vsh_assets_free(bake->assets);
}

/* --- charts */

enum { STITCHED_PADDING = 2 }; /* texels: lookups at borders read values guessed from nearby ones */

/* Sorts and counts a target's charts, and refuses UVs that cannot be baked. */
static vsh_result create_charts(const vsh_scene *scene, const vshi_target *target, bool warns,
                                const vsh_run *run, vsh_charts **charts, vsh_error *error) {
    const vsh_receiver *receiver = &target->receiver;
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width;
    options.height = receiver->height;
    options.supersample = receiver->supersample;
    options.padding = receiver->padding;
    if (receiver->seams == VSH_SEAMS_FIX && options.padding >= 0 && options.padding < STITCHED_PADDING) {
        options.padding = STITCHED_PADDING;
    }
    options.ao_spacing = scene->ao || vsh_planes_shaded(&scene->planes) > 0 ? receiver->ao_spacing : 1;
    options.shade = scene->shade;
    options.tangents = scene->bent == 1 + VSH_BENT_TANGENT;
    vsh_run silent = *run;
    silent.warning = NULL; /* vshi_warn_uvs() names the file, too */
    vsh_charts_info info;
    vsh_uv_report *reports = NULL;
    VSHI_TRY(
        vshi_allocate((void **)&reports, target->mesh_count + 1, sizeof *reports, receiver->path, error));
    vsh_result result;
    VSHI_TRY_DONE(vshi_name_file(
        receiver->path,
        vsh_charts_create(target->meshes, target->mesh_count, &options, &silent, reports, charts, error),
        error));
    vsh_charts_get_info(*charts, &info);
    VSHI_TRY_DONE(vshi_refuse_uvs(target, reports, info.covered, error));
    if (warns) {
        vshi_warn_uvs(target, reports, info.covered, run);
    }
done:
    if (result != VSH_OK) {
        vsh_charts_free(*charts);
        *charts = NULL;
    }
    free(reports);
    return result;
}

vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                               size_t mesh_count, const vsh_run *run, vsh_charts **charts, vsh_error *error) {
    VSHI_NEEDS(charts);
    *charts = NULL;
    VSHI_NEEDS(scene);
    VSHI_TRY(check_index(scene, index, error));
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    const vshi_target target = {
        .receiver = scene->receivers[index], .index = index, .meshes = meshes, .mesh_count = mesh_count};
    return create_charts(scene, &target, true, &full, charts, error);
}

static vsh_result count_lightmap(vshi_scene_bake *bake, size_t index, bool warns, vsh_error *error) {
    vsh_scene_lightmap *lightmap = &bake->lightmaps[index];
    VSHI_TRY(create_charts(&bake->scene, &bake->targets.list[index], warns, &bake->run, &bake->charts[index],
                           error));
    vsh_charts_info info;
    vsh_charts_get_info(bake->charts[index], &info);
    lightmap->covered = info.covered;
    lightmap->samples = info.samples;
    bake->report.samples += info.samples;
    for (int axis = 0; axis < 3 && info.samples > 0; ++axis) {
        bake->receivers[0][axis] = fmin(bake->receivers[0][axis], info.bounds_min[axis]);
        bake->receivers[1][axis] = fmax(bake->receivers[1][axis], info.bounds_max[axis]);
    }
    return VSH_OK;
}

static vsh_result count_lightmaps(vshi_scene_bake *bake, bool warns, vsh_error *error) {
    const double start = vshi_seconds();
    for (int axis = 0; axis < 3; ++axis) {
        bake->receivers[0][axis] = INFINITY;
        bake->receivers[1][axis] = -INFINITY;
    }
    VSHI_TRY(vshi_allocate((void **)&bake->charts, bake->targets.count + 1, sizeof *bake->charts, "lightmaps",
                           error));
    for (size_t i = 0; i < bake->targets.count; ++i) {
        VSHI_TRY(count_lightmap(bake, i, warns, error));
    }
    bake->report.bake_s += vshi_seconds() - start;
    return VSH_OK;
}

/* --- occluders */

static vsh_scene_occluders_options choose_occluders(const vshi_scene_bake *bake) {
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.receivers_min = bake->receivers[0];
    options.receivers_max = bake->receivers[1];
    options.points = (double)bake->report.samples;
    return options;
}

static vsh_result make_occluders(vshi_scene_bake *bake, vsh_error *error) {
    const vsh_scene *scene = &bake->scene;
    const vsh_lightmap planes = vshi_channels_shape(scene);
    vsh_scene_occluders_options options = choose_occluders(bake);
    vsh_shade_options shade;
    options.truth = 1;
    VSHI_TRY(vsh_scene_occluders(scene, bake->assets, &options, &bake->run, &bake->occluders, error));
    vsh_occluders_get_info(bake->occluders, &bake->report.occluders);
    for (size_t i = 0; i < bake->occluders->layer_count; ++i) {
        bake->layered_ao = bake->layered_ao || bake->occluders->layers[i].ao != 0;
    }
    if (bake->options.rows == NULL) {
        VSHI_TRY(vshi_bake_find_provenance(bake, error));
    }
    VSHI_TRY(vshi_shade_options_resolve(&scene->shade, &shade, error));
    return vshi_tracer_create(bake->occluders, scene->lights, scene->light_count, &shade, &planes, true,
                              &bake->run, &bake->tracer, error);
}

vsh_result vshi_bake_find_provenance(vshi_scene_bake *bake, vsh_error *error) {
    const double start = vshi_seconds();
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = &bake->scene;
    source.lightmap = 1;
    source.command = bake->options.command;
    source.files = bake->options.files;
    source.file_count = bake->options.file_count;
    source.voxel_size = bake->report.occluders.voxel_size;
    source.has_triangles = bake->report.occluders.has_triangles;
    const vsh_result result = vsh_provenance_create(&source, &bake->run, &bake->provenance, error);
    bake->report.load_s += vshi_seconds() - start;
    return result;
}

/* --- baking and merging */

void vshi_bake_report_add(vshi_scene_bake *bake, const vsh_bake_stats *baked) {
    vsh_bake_report *report = &bake->report;
    report->texels += baked->texels;
    report->invalid_texels += baked->invalid_texels;
    vshi_shade_stats_add(&report->shade, &baked->shade);
    for (size_t i = 0; i < bake->error_count; ++i) {
        vshi_bake_error_add(&bake->errors[i], &baked->errors[i]);
    }
}

/* Traces the tiles, or reads them from parts. */
static vsh_result bake_or_merge(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                                bool merges, vsh_bake_report *report, vsh_error *error) {
    vshi_scene_bake bake;
    int32_t parts = 0;
    vsh_result result;
    VSHI_TRY_DONE(load(&bake, scene, options, run, false, error));
    const bool shard = bake.options.shard > 0 && !merges;
    if (merges) {
        VSHI_TRY_DONE(vshi_parts_find(&bake, &parts, error)); /* before what takes a while */
    }
    /* one shard warns of UVs */
    VSHI_TRY_DONE(count_lightmaps(&bake, bake.options.shard <= 1 && !merges, error));
    VSHI_TRY_DONE(merges ? vshi_parts_open(&bake, parts, error) : make_occluders(&bake, error));
    VSHI_TRY_DONE(shard ? vshi_bake_part(&bake, error) : vshi_bake_pages(&bake, error));
    if (report != NULL) {
        vsh_bake_error *errors = report->errors;
        *report = bake.report;
        report->errors = errors;
        if (errors != NULL) {
            memcpy(errors, bake.errors, bake.error_count * sizeof *errors);
        }
    }
done:
    free_bake(&bake);
    return result;
}

vsh_result vsh_bake_scene(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                          vsh_bake_report *report, vsh_error *error) {
    VSHI_NEEDS(scene);
    return bake_or_merge(scene, options, run, false, report, error);
}

vsh_result vsh_merge_scene(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                           vsh_bake_report *report, vsh_error *error) {
    VSHI_NEEDS(scene);
    return bake_or_merge(scene, options, run, true, report, error);
}

/* --- forecasts */

enum { TRIAL_RESOLUTION = 96 }; /* voxels along the longest side */
/* Making a level set takes this many times its own memory (the cloister, 96 to 512 voxels: 6 to 4.2). */
static const double MAKING = 4.3;

/* Voxels of the scene over those of the trial, on a side; `resolution`: as vsh_scene_resolution(). */
static double find_ratio(const vsh_scene *scene, int32_t resolution, double trial_voxel) {
    if (resolution != VSH_RESOLUTION_NAMED) {
        return (double)resolution / TRIAL_RESOLUTION;
    }
    return scene->grid.voxel_size > 0.0 ? trial_voxel / scene->grid.voxel_size
                                        : (double)scene->grid.resolution / TRIAL_RESOLUTION;
}

/* Voxels along the longest side of an existing field; 0: there are none. */
static double resolution_of(const vsh_scene *scene, const vsh_occluders *occluders, double voxel_size) {
    vsh_occluder_parts parts;
    vsh_field_info info;
    vsh_occluders_get_parts(occluders, &parts);
    vsh_field_get_info(parts.field, &info);
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        longest = fmax(longest, info.bounds_max[axis] - info.bounds_min[axis]);
    }
    const bool named = scene->grid.voxel_size == 0.0 && scene->grid.resolution > 0;
    return voxel_size == 0.0 ? 0.0 : named ? scene->grid.resolution : longest / voxel_size;
}

/* Makes the occluders with few voxels, and scales up. Surfaces have voxels in proportion to the square. */
static vsh_result try_few_voxels(const vshi_scene_bake *bake, vsh_bake_forecast *f, vsh_error *error) {
    vsh_scene_occluders_options options = choose_occluders(bake);
    options.silent_voxels = 1; /* the scene's voxels may keep what the trial's lose */
    const int32_t resolution = vsh_scene_resolution(&bake->scene, bake->assets, NULL, options.points);
    vsh_scene small = bake->scene;
    if (resolution != 0) { /* else the scene has no voxels, and neither has the trial */
        small.grid.voxel_size = 0.0;
        small.grid.resolution = TRIAL_RESOLUTION;
    }
    vsh_occluders *occluders = NULL;
    vsh_occluders_info made;
    VSHI_TRY(vsh_scene_occluders(&small, bake->assets, &options, &bake->run, &occluders, error));
    vsh_occluders_get_info(occluders, &made);
    const double ratio = resolution != 0 ? find_ratio(&bake->scene, resolution, made.voxel_size) : 1.0;
    f->resolution =
        resolution != 0 ? TRIAL_RESOLUTION * ratio : resolution_of(&bake->scene, occluders, made.voxel_size);
    vsh_occluders_free(occluders);
    f->voxel_size = made.voxel_size / ratio;
    f->voxels = (double)made.active_voxels * ratio * ratio;
    f->grid_bytes = (double)made.grid_bytes * ratio * ratio;
    f->field_bytes = (double)made.field_bytes * ratio * ratio;
    f->has_triangles = made.has_triangles;
    /* the program, its assets and the pages; the trial was part of the peak */
    const double base = fmax(0.0, (double)vshi_peak_bytes() - MAKING * (double)made.grid_bytes);
    const double pages = f->field_bytes + vshi_bake_bytes(bake);
    f->peak_bytes = base + fmax(fmax(MAKING * f->grid_bytes, f->grid_bytes + f->field_bytes), pages);
    if (bake->run.memory_limit > 0) { /* planes over the limit lie in files */
        f->peak_bytes = fmin(f->peak_bytes, (double)bake->run.memory_limit);
    }
    return VSH_OK;
}

vsh_result vsh_forecast_scene(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                              vsh_bake_forecast *forecast, vsh_error *error) {
    VSHI_NEEDS(scene);
    VSHI_NEEDS(forecast);
    vshi_scene_bake bake;
    vsh_bake_forecast f = {.lightmap_count = 0};
    vsh_result result;
    VSHI_TRY_DONE(load(&bake, scene, options, run, true, error));
    VSHI_TRY_DONE(count_lightmaps(&bake, false, error));
    VSHI_TRY_DONE(try_few_voxels(&bake, &f, error));
    f.lightmap_count = bake.targets.count;
    f.samples = bake.report.samples;
    for (size_t i = 0; i < bake.targets.count; ++i) {
        f.texels += bake.lightmaps[i].covered;
    }
    *forecast = f;
done:
    free_bake(&bake);
    return result;
}
