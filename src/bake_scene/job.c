#include "bake_scene/job.h"

#include "bake_scene/bounds.h"
#include "bake_scene/lit_sink.h"
#include "bake_scene/pages.h"
#include "bake_scene/parts.h"
#include "bake_scene/warn.h"
#include "base/clock.h"
#include "base/file.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"
#include "image/write_plan.h"
#include "shade/occluders.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

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
    if (index >= scene->receiver_count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receivers[%zu]: there are %zu", index,
                         scene->receiver_count);
    }
    const vsh_receiver *receiver = &scene->receivers[index];
    const vsh_image_options options = vshi_receiver_image(receiver);
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(scene, receiver->width, receiver->height, &channels, error));
    result = vsh_lit_is_output(receiver->output)
                 ? vshi_lit_sink_check(receiver, &channels.image, error)
                 : check_image(receiver->output, &channels.image, &options, error);
done:
    vshi_channels_free(&channels);
    return result;
}

vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                               size_t mesh_count, int32_t allow_overlap, const vsh_run *run,
                               vsh_charts **charts, vsh_error *error) {
    VSHI_NEEDS(charts);
    *charts = NULL;
    VSHI_NEEDS(scene);
    VSHI_NEEDS_OF(mesh_count, meshes);
    if (index >= scene->receiver_count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "receivers[%zu]: there are %zu", index,
                         scene->receiver_count);
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    const vshi_target target = {
        .receiver = scene->receivers[index], .index = index, .meshes = meshes, .mesh_count = mesh_count};
    return vshi_target_charts(scene, &target, allow_overlap != 0, true, &full, charts, error);
}

/* --- made and freed */

static vsh_result check_sink(const vsh_row_sink *given, vsh_row_sink *sink, vsh_error *error) {
    *sink = vsh_row_sink_default();
    VSHI_TRY(vshi_options_resolve(given, sink, sizeof *sink, "vsh_row_sink", error));
    if (given != NULL && (sink->begin == NULL || sink->add == NULL || sink->end == NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_row_sink: begin, add or end is NULL");
    }
    return VSH_OK;
}

static vsh_result check_lit(const vsh_scene *scene, const vsh_bake_job_options *options, vsh_error *error) {
    size_t assets = 0;
    for (size_t i = 0; i < scene->receiver_count && options->sink == NULL; ++i) {
        assets += (size_t)vsh_lit_is_output(scene->receivers[i].output);
    }
    if (options->lit_exr != NULL && (assets != 1 || scene->receiver_count != 1)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_bake_job_options.lit_exr: is for one output that is a .glb or .gltf");
    }
    if (options->lit_image_place < VSH_LIT_IMAGES_AUTO || options->lit_image_place > VSH_LIT_IMAGES_BESIDE) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_bake_job_options.lit_image_place is %d",
                         options->lit_image_place);
    }
    const bool embeds = options->lit_image_place == VSH_LIT_IMAGES_EMBED && options->sink == NULL;
    for (size_t i = 0; embeds && i < scene->receiver_count; ++i) {
        const char *output = scene->receivers[i].output;
        if (strcasecmp(vshi_path_ending(output), "obj") == 0) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: an OBJ holds no images; they stand beside it",
                             output);
        }
    }
    return VSH_OK;
}

static vsh_result check_shard(const vsh_bake_job_options *options, vsh_error *error) {
    const int32_t count = options->shard_count;
    if (count < 0 || count > VSHI_MOST_SHARDS || options->shard < 0 || options->shard > count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_bake_job_options.shard %d of %d: expected 1 to %d, and no more than there are",
                         options->shard, count, VSHI_MOST_SHARDS);
    }
    if (options->shard > 0 && (options->sink != NULL || options->invalid_picture != NULL)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_bake_job_options.shard: not together with %s",
                         options->sink != NULL ? "a sink" : "invalid_picture");
    }
    VSHI_NEEDS_OF(options->word_count, options->words);
    for (size_t i = 0; i < options->word_count; ++i) {
        VSHI_NEEDS(options->words[i]);
    }
    return VSH_OK;
}

static vsh_result check(const vsh_scene *scene, const vsh_bake_job_options *options, vsh_error *error) {
    if (scene->receiver_count == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: no receivers");
    }
    VSHI_TRY(check_shard(options, error));
    if (options->invalid_picture != NULL && options->forecast == 0) {
        VSHI_TRY(vshi_output_check(options->invalid_picture, error));
    }
    for (size_t i = 0; i < scene->receiver_count && options->sink == NULL; ++i) {
        const vsh_result result = vsh_receiver_check(scene, i, error);
        if (result != VSH_OK && (result != VSH_ERROR_WRITE || options->forecast == 0)) {
            return result;
        }
    }
    return check_lit(scene, options, error);
}

/* The job's own scene: with lightmaps of objects, where all are to have some, and light for assets. */
static vsh_result take_scene(vsh_bake_job *job, const vsh_scene *scene, vsh_error *error) {
    job->scene = *scene;
    if (job->options.per_object != 0) {
        VSHI_TRY(vshi_allocate((void **)&job->receivers_own, scene->receiver_count,
                               sizeof *job->receivers_own, "receivers", error));
        for (size_t i = 0; i < scene->receiver_count; ++i) {
            job->receivers_own[i] = scene->receivers[i];
            job->receivers_own[i].atlas = VSH_ATLAS_OBJECTS;
        }
        job->scene.receivers = job->receivers_own;
    }
    if (job->options.sink == NULL) {
        vshi_lit_sink_scene(&job->scene);
    }
    return VSH_OK;
}

static vsh_result list_lightmaps(vsh_bake_job *job, vsh_error *error) {
    const vshi_targets *targets = &job->targets;
    job->lightmaps = calloc(targets->count + 1, sizeof *job->lightmaps);
    if (job->lightmaps == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "lightmaps: the system refused memory");
    }
    for (size_t i = 0; i < targets->count; ++i) {
        const vshi_target *target = &targets->list[i];
        job->lightmaps[i] = (vsh_job_lightmap){.receiver = target->index,
                                               .path = target->receiver.path,
                                               .output = target->receiver.output,
                                               .meshes = target->meshes,
                                               .mesh_count = target->mesh_count,
                                               .width = target->receiver.width,
                                               .height = target->receiver.height,
                                               .page = target->page};
    }
    return VSH_OK;
}

vsh_result vsh_bake_job_create(const vsh_scene *scene, const vsh_bake_job_options *options,
                               const vsh_run *run, vsh_bake_job **job, vsh_error *error) {
    VSHI_NEEDS(job);
    *job = NULL;
    VSHI_NEEDS(scene);
    const double start = vshi_seconds();
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_bake_job_options own = vsh_bake_job_options_default();
    VSHI_TRY(vshi_options_resolve(options, &own, sizeof own, "vsh_bake_job_options", error));
    vsh_row_sink sink;
    VSHI_TRY(check_sink(own.sink, &sink, error));
    VSHI_TRY(check(scene, &own, error));
    vsh_bake_job *made = calloc(1, sizeof *made);
    if (made == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "bake job: the system refused memory");
    }
    made->options = own;
    made->sink = sink;
    made->report.shade = vsh_shade_stats_zero();
    vsh_result result;
    VSHI_TRY_DONE(take_scene(made, scene, error));
    VSHI_TRY_DONE(vsh_assets_load(&made->scene, &full, &made->assets, error));
    VSHI_TRY_DONE(vshi_targets_make(&made->scene, made->assets, &full, &made->targets, error));
    VSHI_TRY_DONE(list_lightmaps(made, error));
    VSHI_TRY_DONE(vshi_lit_check_uvs(made, &full, error));
    made->report.load_s = vshi_seconds() - start;
    *job = made;
    return VSH_OK;
done:
    vsh_bake_job_free(made);
    return result;
}

void vsh_bake_job_free(vsh_bake_job *job) {
    if (job == NULL) {
        return;
    }
    free(job->errors);
    free(job->lit);
    vshi_lit_pages_free(job);
    vsh_provenance_free(job->provenance);
    vshi_tracer_free(job->tracer);
    vsh_occluders_free(job->occluders);
    for (size_t i = 0; job->charts != NULL && i < job->targets.count; ++i) {
        vsh_charts_free(job->charts[i]);
    }
    free(job->charts);
    free(job->lightmaps);
    vshi_targets_free(&job->targets);
    vsh_assets_free(job->assets);
    free(job->receivers_own);
    free(job);
}

size_t vsh_bake_job_count(const vsh_bake_job *job) {
    return job->targets.count;
}

void vsh_bake_job_lightmap(const vsh_bake_job *job, size_t index, vsh_job_lightmap *lightmap) {
    *lightmap = job->lightmaps[index];
}

const vsh_assets *vsh_bake_job_assets(const vsh_bake_job *job) {
    return job->assets;
}

void vsh_bake_job_get_report(const vsh_bake_job *job, vsh_bake_report *report) {
    *report = job->report;
}

/* --- measured */

enum { STITCHED_PADDING = 2 }; /* texels: what lookups at borders read is guessed from what is near */

vsh_result vshi_target_charts(const vsh_scene *scene, const vshi_target *target, bool allow_overlap,
                              bool warn, const vsh_run *run, vsh_charts **charts, vsh_error *error) {
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
    vsh_uv_report *reports = calloc(target->mesh_count + 1, sizeof *reports);
    if (reports == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", receiver->path);
    }
    vsh_run silent = *run;
    silent.warning = NULL; /* its lines are told here, with the file, and not again for the second pass */
    vsh_result result =
        vsh_charts_create(target->meshes, target->mesh_count, &options, &silent, reports, charts, error);
    if (result != VSH_OK) {
        result = vshi_name_file(receiver->path, result, error);
        goto done;
    }
    vsh_charts_info info;
    vsh_charts_get_info(*charts, &info);
    result = vshi_refuse_uvs(target, reports, info.covered, allow_overlap, error);
    if (result != VSH_OK) {
        vsh_charts_free(*charts);
        *charts = NULL;
        goto done;
    }
    if (warn) {
        vshi_warn_uvs(target, reports, info.covered, run);
    }
done:
    free(reports);
    return result;
}

/* Whether some of its tiles are baked, into a part. */
static bool is_shard(const vsh_bake_job *job) {
    return job->options.shard > 0;
}

static vsh_result measure(vsh_bake_job *job, size_t index, bool bakes, const vsh_run *run, vsh_error *error) {
    vsh_job_lightmap *lightmap = &job->lightmaps[index];
    double low[3], high[3];
    /* the first part's bake tells of UVs */
    const bool tells = bakes && !job->merges && job->options.shard <= 1;
    VSHI_TRY(vshi_target_charts(&job->scene, &job->targets.list[index], job->options.allow_overlap != 0,
                                tells, run, &job->charts[index], error));
    vsh_charts_info counted;
    vsh_charts_get_info(job->charts[index], &counted);
    lightmap->covered = counted.covered;
    lightmap->samples = counted.samples;
    if (job->merges) { /* which asks nothing of what casts */
        return VSH_OK;
    }
    VSHI_TRY(vshi_job_bounds(job, index, run, low, high, error));
    for (int axis = 0; axis < 3 && counted.samples > 0; ++axis) {
        job->receivers[0][axis] = fmin(job->receivers[0][axis], low[axis]);
        job->receivers[1][axis] = fmax(job->receivers[1][axis], high[axis]);
    }
    return VSH_OK;
}

vsh_result vshi_job_measure(vsh_bake_job *job, bool bakes, const vsh_run *run, vsh_error *error) {
    const double start = vshi_seconds();
    for (int axis = 0; axis < 3; ++axis) {
        job->receivers[0][axis] = INFINITY;
        job->receivers[1][axis] = -INFINITY;
    }
    VSHI_TRY(vshi_allocate((void **)&job->charts, job->targets.count + 1, sizeof *job->charts, "lightmaps",
                           error));
    for (size_t i = 0; i < job->targets.count; ++i) {
        VSHI_TRY(measure(job, i, bakes, run, error));
    }
    job->measured = true;
    job->report.bake_s += vshi_seconds() - start;
    return VSH_OK;
}

vsh_result vsh_bake_job_measure(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    VSHI_NEEDS(job);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return job->measured ? VSH_OK : vshi_job_measure(job, true, &full, error);
}

/* --- prepared */

double vshi_job_points(const vsh_bake_job *job) {
    double points = 0.0;
    for (size_t i = 0; i < job->targets.count; ++i) {
        points += (double)job->lightmaps[i].samples;
    }
    return points;
}

vsh_result vshi_job_find_provenance(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    if (job->provenance != NULL) {
        return VSH_OK;
    }
    const double start = vshi_seconds();
    vsh_provenance_source source = vsh_provenance_source_default();
    source.scene = &job->scene;
    source.lightmap = 1;
    source.command = job->options.command;
    source.files = job->options.files;
    source.file_count = job->options.file_count;
    source.voxel_size = job->report.occluders.voxel_size;
    source.has_triangles = job->report.occluders.has_triangles;
    const vsh_result result = vsh_provenance_create(&source, run, &job->provenance, error);
    job->report.load_s += vshi_seconds() - start;
    return result;
}

vsh_result vshi_job_make_errors(vsh_bake_job *job, vsh_error *error) {
    const size_t count = job->scene.light_count + 2;
    free(job->errors);
    free(job->lit);
    job->errors = calloc(count, sizeof *job->errors);
    job->lit = calloc(count, sizeof *job->lit);
    if (job->errors == NULL || job->lit == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "bake job: the system refused memory");
    }
    job->report.errors = job->errors;
    job->report.error_count = count;
    return VSH_OK;
}

vsh_result vsh_bake_job_prepare(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    VSHI_NEEDS(job);
    if (!job->measured) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: vsh_bake_job_measure() comes first", __func__);
    }
    if (job->occluders != NULL) {
        return VSH_OK;
    }
    vsh_scene_occluders_options options = vsh_scene_occluders_options_default();
    options.receivers_min = job->receivers[0];
    options.receivers_max = job->receivers[1];
    options.truth = 1;
    options.points = vshi_job_points(job);
    VSHI_TRY(vsh_scene_occluders(&job->scene, job->assets, &options, run, &job->occluders, error));
    vsh_occluders_get_info(job->occluders, &job->report.occluders);
    for (size_t i = 0; i < job->occluders->layer_count; ++i) {
        job->layered_ao = job->layered_ao || job->occluders->layers[i].ao != 0;
    }
    return vshi_job_make_errors(job, error);
}

/* --- run */

static void add_error(vsh_bake_error *sum, const vsh_bake_error *more) {
    sum->values += more->values;
    sum->square_error += more->square_error;
    sum->held += more->held;
    sum->held_square_error += more->held_square_error;
    sum->worst = fmax(sum->worst, more->worst);
}

void vshi_job_add(vsh_bake_job *job, const vsh_bake_stats *baked) {
    vsh_bake_report *report = &job->report;
    report->texels += baked->texels;
    report->invalid_texels += baked->invalid_texels;
    vshi_shade_stats_add(&report->shade, &baked->shade);
    for (size_t i = 0; i < report->error_count; ++i) {
        add_error(&job->errors[i], &baked->errors[i]);
    }
}

vsh_result vsh_bake_job_run(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    VSHI_NEEDS(job);
    if (job->occluders == NULL || job->errors == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: vsh_bake_job_prepare() comes first", __func__);
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (job->options.sink == NULL) {
        VSHI_TRY(vshi_job_find_provenance(job, &full, error));
    }
    VSHI_TRY(vshi_job_open_tracer(job, &full, error));
    return is_shard(job) ? vshi_job_bake_part(job, &full, error) : vshi_job_bake_all(job, &full, error);
}

vsh_result vsh_bake_scene(const vsh_scene *scene, const vsh_bake_job_options *options, const vsh_run *run,
                          vsh_bake_report *report, vsh_error *error) {
    vsh_bake_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vsh_bake_job_create(scene, options, run, &job, error));
    VSHI_TRY_DONE(vsh_bake_job_measure(job, run, error));
    VSHI_TRY_DONE(vsh_bake_job_prepare(job, run, error));
    VSHI_TRY_DONE(vsh_bake_job_run(job, run, error));
    if (report != NULL) {
        job->report.errors = NULL;
        job->report.error_count = 0;
        vsh_bake_job_get_report(job, report);
    }
done:
    vsh_bake_job_free(job);
    return result;
}
