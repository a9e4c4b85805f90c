/* One lightmap's way: its charts, its bands of texels, its values, its rows. */
#include "bake/part.h"
#include "bake_scene/channels.h"
#include "bake_scene/file_sink.h"
#include "bake_scene/invalid_picture.h"
#include "bake_scene/job.h"
#include "bake_scene/lit_sink.h"
#include "bake_scene/merge.h"
#include "bake_scene/part_job.h"
#include "bake_scene/resume.h"
#include "bake_scene/warn.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/rounds.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STITCHED_PADDING = 2 }; /* texels: what lookups at borders read is guessed from what is near */

/* What the library made of arrays names no file. */
static vsh_result name_file(const char *path, vsh_result result, vsh_error *error) {
    if (error == NULL ||
        (result != VSH_ERROR_INPUT && result != VSH_ERROR_LIMIT && result != VSH_ERROR_UNSUPPORTED)) {
        return result;
    }
    const vsh_error of_arrays = *error;
    return vshi_fail(error, result, "%s: %s", path, of_arrays.message);
}

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
        result = name_file(receiver->path, result, error);
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
        vshi_warn_uvs(target, reports, run);
    }
done:
    free(reports);
    return result;
}

vsh_result vshi_job_plan(const vsh_bake_job *job, size_t index, const vsh_charts *charts, uint64_t held,
                         const vsh_run *run, vshi_bands *bands, vsh_error *error) {
    const vsh_job_lightmap *lightmap = &job->lightmaps[index];
    const bool lit = job->options.sink == NULL && vsh_lit_is_output(lightmap->output) != 0;
    const uint64_t pages = vsh_assets_receiver_pages(job->assets, lightmap->receiver);
    const uint64_t kept =
        lit && job->options.shard == 0 ? pages * vshi_lit_sink_bytes(lightmap->width, lightmap->height) : 0;
    const bool shard = job->options.shard > 0;
    int32_t first = 0, end = lightmap->height;
    if (shard) {
        first = job->pieces[job->piece].first;
        end = first + job->pieces[job->piece].rows;
    }
    const vshi_bands_need need = {.part = shard,
                                  .merge = job->merges,
                                  .first = first,
                                  .end = end,
                                  .picture = job->options.invalid_picture != NULL,
                                  .resume = job->options.resume != 0,
                                  .files = job->options.sink == NULL && !lit && !shard,
                                  .rows = job->merges ? 0 : job->options.band_rows,
                                  .held = held + kept,
                                  .limit = run->memory_limit};
    return vshi_bands_plan(&job->scene, &job->targets.list[index], charts, &need, bands, error);
}

/* A lightmap under way. */
typedef struct work {
    vsh_bake_job *job;
    const vsh_run *run;
    const vshi_lightmap_input *input;
    const vshi_target *target;
    size_t index; /* of it */
    vsh_job_lightmap *lightmap;
    vshi_channels channels;
    vsh_bake_stats baked; /* of all bands so far */
    uint64_t *invalid;    /* [mesh_count]: of one band */
    vshi_rounds rounds;   /* where there are several bands */
    vshi_file_sink files;
    vshi_lit_sink lit;
    vshi_part_sink part;
    vsh_row_sink sink;
    bool begun; /* the sink has taken rows */
    vshi_invalid_picture picture;
    vshi_resume resume;
} work;

static vsh_result bake_band(work *w, int32_t first, int32_t rows, const vsh_run *run, vsh_error *error) {
    const vsh_scene *scene = &w->job->scene;
    vsh_texels *own = NULL;
    uint32_t *known = w->channels.known;
    if (w->input->kept == NULL) {
        VSHI_TRY((known != NULL ? vshi_texels_create_part : vsh_texels_create_band)(w->input->charts, first,
                                                                                    rows, run, &own, error));
    }
    const vsh_texels *texels = own != NULL ? own : w->input->kept;
    vsh_bake_stats band = vsh_bake_stats_zero();
    band.invalid_by_mesh = w->invalid;
    band.shade = w->baked.shade;
    band.errors = w->baked.errors;
    const vsh_result result =
        known != NULL ? vshi_bake_part(w->job->occluders, texels, scene->lights, scene->light_count,
                                       &scene->shade, run, &w->channels.lightmap, known, &band, error)
                      : vsh_bake_lightmap(w->job->occluders, texels, scene->lights, scene->light_count,
                                          &scene->shade, run, &w->channels.lightmap, &band, error);
    vsh_texels_free(own);
    if (result != VSH_OK) {
        return name_file(w->target->receiver.path, result, error);
    }
    w->baked.texels += band.texels;
    w->baked.invalid_texels += band.invalid_texels;
    w->baked.seen_texels += band.seen_texels;
    w->baked.shade = band.shade;
    for (size_t m = 0; m < w->target->mesh_count; ++m) {
        w->baked.invalid_by_mesh[m] += band.invalid_by_mesh[m];
    }
    return VSH_OK;
}

static bool fixes_seams(const work *w) {
    return w->target->receiver.seams == VSH_SEAMS_FIX && w->target->receiver.type == VSH_RECEIVER_MESH;
}

/* Whether it is some rows of it that go into a part. */
static bool is_part(const work *w) {
    return w->job->options.shard > 0;
}

/* Bytes that are there beside the charts: what casts, texels that are kept, planes. */
static uint64_t held_bytes(const work *w) {
    const vsh_occluders_info *casters = &w->job->report.occluders;
    const uint64_t texels = (uint64_t)w->lightmap->width * (uint64_t)w->lightmap->height;
    const uint64_t floats = (uint64_t)w->channels.image.channel_count +
                            3 * (uint64_t)w->channels.triple_count + (w->channels.invalid != NULL ? 1 : 0);
    vsh_texels_info kept = {.bytes = 0};
    if (w->input->kept != NULL) {
        vsh_texels_get_info(w->input->kept, &kept);
    }
    const uint64_t cast = w->job->parts != NULL ? 0 : casters->field_bytes + casters->triangles_bytes;
    return cast + kept.bytes + texels * floats * sizeof(float);
}

/* A lightmap that is whole. What is baked stays where there is no memory to make it better. */
static vsh_result stitch(const work *w, vsh_error *error) {
    const vsh_bake_job *job = w->job;
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = job->scene.shade.max_error;
    vsh_run run = *w->run;
    run.memory_held += held_bytes(w);
    const vsh_result result = vsh_lightmap_stitch(w->input->charts, &w->channels.lightmap,
                                                  job->scene.light_count, &options, &run, NULL, error);
    if (result != VSH_ERROR_LIMIT) {
        return name_file(w->target->receiver.path, result, error);
    }
    vshi_warn(w->run,
              "%s: seams are kept: no memory to fix them beside a whole lightmap; raise --memory-limit",
              w->target->receiver.path);
    return VSH_OK;
}

/* Bakes a band, or takes it from parts, or from before. */
static vsh_result make_band(work *w, int32_t first, int32_t rows, const vsh_run *run, vsh_error *error) {
    const size_t meshes = w->target->mesh_count;
    const vshi_parts *parts = w->job->parts;
    if (vshi_resume_take(&w->resume, first, rows, &w->channels, &w->baked, meshes)) {
        w->lightmap->resumed_rows += (uint64_t)rows;
        return VSH_OK;
    }
    if (parts != NULL) {
        VSHI_TRY(vshi_parts_take(parts, &w->job->scene, w->index, w->input->charts, first, rows, run,
                                 &w->channels, error));
    } else {
        VSHI_TRY(bake_band(w, first, rows, run, error));
    }
    if (fixes_seams(w) && w->input->bands.count == 1 && !is_part(w)) {
        VSHI_TRY(stitch(w, error));
    }
    vshi_channels_split(&w->channels, &w->job->scene);
    vshi_resume_keep(&w->resume, first, rows, &w->channels, &w->baked, meshes);
    return VSH_OK;
}

/* Rows of several bands are written as part of the stage that bakes them; those of one as a stage of its own,
 * that far. */
static vsh_result report_writing(const work *w, double fraction, vsh_error *error) {
    const bool several = w->input->bands.count > 1;
    const vsh_run *run = w->run;
    if (run->progress != NULL &&
        run->progress(run->user, several ? "bake" : "write", several ? w->rounds.before : fraction) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "write: cancelled");
    }
    return VSH_OK;
}

static vsh_result write_band(work *w, int32_t rows, vsh_error *error) {
    VSHI_TRY(report_writing(w, 0.0, error));
    if (!w->begun) {
        vsh_image image = w->channels.image;
        image.planes = NULL;
        VSHI_TRY(w->sink.begin(w->sink.user, w->lightmap, &image, error));
        w->begun = true;
    }
    VSHI_TRY(w->sink.add(w->sink.user, rows, w->channels.image.planes, error));
    VSHI_TRY(vshi_invalid_picture_add(&w->picture, rows, w->channels.invalid, w->channels.lightmap.coverage,
                                      error));
    return report_writing(w, 0.5, error);
}

/* What a lightmap goes without that is never whole. */
static void warn_bands(const work *w) {
    const vsh_receiver *receiver = &w->target->receiver;
    const int32_t bands = w->input->bands.count;
    if (bands > 1 && fixes_seams(w)) {
        vshi_warn(
            w->run,
            "%s: seams are kept: it is baked in %d bands of rows, and a border's sides may lie in two; raise "
            "--memory-limit, or bake without --resume",
            receiver->path, bands);
    }
    if (bands > 1 && receiver->padding == VSH_PADDING_AUTO) {
        vshi_warn(
            w->run,
            "%s: padding is of 16 texels, not of all that is empty: it is baked in %d bands of rows; raise "
            "--memory-limit, or bake without --resume",
            receiver->path, bands);
    }
}

static vsh_result bake_bands(work *w, vsh_error *error) {
    const vsh_scene *scene = &w->job->scene;
    const vshi_bands *bands = &w->input->bands;
    const int32_t height = bands->end - bands->first;
    const bool several = bands->count > 1;
    if (!is_part(w)) {
        warn_bands(w);
    }
    if (several) { /* texels, validate, padding, and what is shaded */
        const int shaded = (int)scene->light_count + (scene->ao ? 1 : 0) + vsh_planes_shaded(&scene->planes);
        vshi_rounds_begin(&w->rounds, w->run, "bake", 3 + shaded);
    }
    if (w->job->parts != NULL) {
        vshi_parts_add_stats(w->job->parts, w->index, &w->baked);
    }
    for (int32_t first = bands->first;; first += bands->rows) {
        const int32_t left = bands->end - first, rows = left < bands->rows ? left : bands->rows;
        const bool last = left <= bands->rows;
        const double start = vshi_seconds();
        const vsh_run run = several ? vshi_rounds_run(&w->rounds, (double)rows / (double)height) : *w->run;
        vsh_result result = make_band(w, first, rows, &run, error);
        if (several) {
            vshi_rounds_next(&w->rounds);
        }
        const double baked = vshi_seconds();
        w->job->report.bake_s += baked - start;
        VSHI_TRY(result);
        if (last && !is_part(w)) {
            VSHI_TRY(vshi_refuse_invalid(w->target, &w->baked, error));
            vshi_warn_baked(scene, w->target, &w->baked, w->run);
        }
        result = write_band(w, rows, error);
        w->job->report.write_s += vshi_seconds() - baked;
        if (result != VSH_OK || last) {
            return result;
        }
    }
}

/* Memory, files, and what was kept. */
static vsh_result open_all(work *w, vsh_error *error) {
    const vsh_bake_job *job = w->job;
    const vsh_scene *scene = &job->scene;
    const vsh_receiver *receiver = &w->target->receiver;
    const int32_t rows = w->input->bands.rows;
    const char *picture = job->options.invalid_picture;
    w->invalid = calloc(w->target->mesh_count + 1, sizeof *w->invalid);
    w->baked.invalid_by_mesh = calloc(w->target->mesh_count + 1, sizeof *w->baked.invalid_by_mesh);
    w->baked.errors = calloc(job->report.error_count, sizeof *w->baked.errors);
    if (w->invalid == NULL || w->baked.invalid_by_mesh == NULL || w->baked.errors == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", receiver->path);
    }
    VSHI_TRY(vshi_channels_name(scene, receiver->width, receiver->height, &w->channels, error));
    VSHI_TRY(vshi_channels_allocate(&w->channels, scene, rows, picture != NULL || scene->planes.invalid != 0,
                                    w->run->memory_limit, receiver->output, error));
    if (is_part(w)) {
        const size_t texels = (size_t)receiver->width * (size_t)rows;
        VSHI_TRY(vshi_allocate((void **)&w->channels.known, texels, sizeof *w->channels.known,
                               receiver->output, error));
    }
    VSHI_TRY(vshi_invalid_picture_open(&w->picture, picture, receiver->output, job->targets.count > 1,
                                       receiver->width, receiver->height, rows, error));
    if (job->options.resume) {
        const vshi_bands *bands = &w->input->bands;
        vshi_resume_key key = {.image = &w->channels.image,
                               .band_rows = rows,
                               .part = is_part(w),
                               .first = bands->first,
                               .end = bands->end};
        key.attributes = vsh_provenance_attributes(job->provenance, &key.attribute_count);
        char *kept = vshi_job_kept_name(job, is_part(w) ? job->piece : w->index);
        const vsh_result result =
            kept != NULL
                ? vshi_resume_open(kept, &key, job->report.error_count, w->run, &w->resume, error)
                : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", receiver->path);
        free(kept);
        VSHI_TRY(result);
    }
    return VSH_OK;
}

static vsh_result end_sink(work *w, vsh_result result, vsh_error *error) {
    if (!w->begun) {
        return result;
    }
    const double start = vshi_seconds();
    const vsh_result ended = w->sink.end(w->sink.user, result, error);
    w->job->report.write_s += vshi_seconds() - start;
    if (result != VSH_OK || ended != VSH_OK) {
        return result != VSH_OK ? result : ended;
    }
    report_writing(w, 1.0, NULL); /* all is done: too late to stop */
    return VSH_OK;
}

void vshi_add_shade(vsh_shade_stats *sum, const vsh_shade_stats *baked) {
    sum->marches += baked->marches;
    sum->samples += baked->samples;
    sum->skipped += baked->skipped;
    sum->certified += baked->certified;
    sum->unfinished += baked->unfinished;
    sum->invalid += baked->invalid;
    sum->beyond_reach += baked->beyond_reach;
    sum->rays += baked->rays;
    sum->refined += baked->refined;
    sum->square_error += baked->square_error;
    sum->ao_square_error += baked->ao_square_error;
    sum->worst_error = fmax(sum->worst_error, baked->worst_error);
}

void vshi_add_bake_error(vsh_bake_error *sum, const vsh_bake_error *more) {
    sum->values += more->values;
    sum->square_error += more->square_error;
    sum->held += more->held;
    sum->held_square_error += more->held_square_error;
    sum->worst = fmax(sum->worst, more->worst);
}

static void add_to_report(const work *w) {
    vsh_bake_report *report = &w->job->report;
    report->texels += w->baked.texels;
    report->invalid_texels += w->baked.invalid_texels;
    report->resumed_rows += w->lightmap->resumed_rows;
    report->bands += (uint64_t)w->input->bands.count;
    vshi_add_shade(&report->shade, &w->baked.shade);
    for (size_t i = 0; i < report->error_count; ++i) {
        vshi_add_bake_error(&w->job->errors[i], &w->baked.errors[i]);
    }
}

static vsh_result bake_all(work *w, vsh_error *error) {
    VSHI_TRY(open_all(w, error));
    return bake_bands(w, error);
}

vsh_result vshi_job_bake(vsh_bake_job *job, size_t index, const vshi_lightmap_input *input,
                         const vsh_run *run, vsh_error *error) {
    work w = {.job = job,
              .run = run,
              .input = input,
              .target = &job->targets.list[index],
              .index = index,
              .lightmap = &job->lightmaps[index],
              .baked = vsh_bake_stats_zero(),
              .files = {.job = job, .run = run},
              .lit = {.job = job, .run = run}};
    w.part = (vshi_part_sink){job, w.lightmap, &w.channels, &w.baked};
    w.sink = is_part(&w)                             ? vshi_part_sink_of(&w.part)
             : job->options.sink != NULL             ? job->sink
             : vsh_lit_is_output(w.lightmap->output) ? vshi_lit_sink_of(&w.lit)
                                                     : vshi_file_sink_of(&w.files);
    w.lightmap->bands = input->bands.count;
    w.lightmap->band_rows = input->bands.rows;
    vsh_result result = end_sink(&w, bake_all(&w, error), error);
    result = vshi_invalid_picture_close(&w.picture, result, error);
    w.lightmap->kept_rows = vshi_resume_close(&w.resume);
    w.lightmap->invalid_texels = w.baked.invalid_texels;
    if (result == VSH_OK) {
        add_to_report(&w);
    }
    free(w.baked.errors);
    free(w.baked.invalid_by_mesh);
    free(w.invalid);
    vshi_channels_free(&w.channels);
    return result;
}
