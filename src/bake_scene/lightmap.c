/* One lightmap's way: its charts, its bands of texels, its values, its rows. */
#include "bake_scene/lightmap.h"
#include "bake/part.h"
#include "bake_scene/seams.h"
#include "bake_scene/warn.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STITCHED_PADDING = 2 }; /* texels: what lookups at borders read is guessed from what is near */

vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error) {
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

vsh_result vshi_job_plan(const vsh_bake_job *job, size_t index, const vsh_charts *charts, uint64_t held,
                         const vsh_run *run, vshi_bands *bands, vsh_error *error) {
    const vsh_job_lightmap *lightmap = &job->lightmaps[index];
    const bool lit = job->options.sink == NULL && vsh_lit_is_output(lightmap->output) != 0;
    const bool shard = job->options.shard > 0;
    uint64_t kept = 0;
    for (size_t i = 0; i < job->targets.count && lit && !shard; ++i) {
        const vsh_job_lightmap *page = &job->lightmaps[i];
        kept += page->receiver == lightmap->receiver ? vshi_lit_sink_bytes(page->width, page->height) : 0;
    }
    int32_t first = 0, end = lightmap->height;
    if (shard) {
        first = job->pieces[job->piece].first;
        end = first + job->pieces[job->piece].rows;
    }
    const vshi_ao_cut cut = vshi_job_cut(job, index, first, end);
    const vshi_bands_need need = {.cut = shard ? &cut : NULL,
                                  .threads = run->threads,
                                  .merge = job->merges,
                                  .first = first,
                                  .end = end,
                                  .picture = job->options.invalid_picture != NULL,
                                  .files = job->options.sink == NULL && !lit && !shard,
                                  .rows = job->merges ? 0 : job->options.band_rows,
                                  .held = held + kept,
                                  .limit = run->memory_limit};
    return vshi_bands_plan(&job->scene, &job->targets.list[index], charts, &need, bands, error);
}

/* Whether it is some rows of it that go into a part. */
static bool is_part(const vshi_lightmap_work *w) {
    return w->job->options.shard > 0;
}

static vsh_result make_texels(const vshi_lightmap_work *w, int32_t first, int32_t rows, const vsh_run *run,
                              vsh_texels **texels, vsh_error *error) {
    if (!is_part(w)) {
        return vsh_texels_create_band(w->input.charts, first, rows, run, texels, error);
    }
    const vshi_ao_cut cut = vshi_job_cut(w->job, w->index, w->input.bands.first, w->input.bands.end);
    return vshi_texels_create_part(w->input.charts, first, rows, &cut, run, texels, error);
}

/* Notes what lights reach in `rows` rows from `first` on. */
static void note_lit(const vshi_lightmap_work *w, const vsh_texels *texels, int32_t first, int32_t rows) {
    const size_t width = (size_t)w->lightmap->width, begin = (size_t)first * width;
    for (size_t i = 0; i < texels->count; ++i) {
        const size_t texel = vshi_sample_place(texels, i);
        if (texel >= begin && texel - begin < (size_t)rows * width) {
            vshi_note_lit(w, texel - begin, vshi_sample_mesh(texels, i));
        }
    }
}

static vsh_result bake_band(vshi_lightmap_work *w, int32_t first, int32_t rows, const vsh_run *run,
                            vsh_error *error) {
    const vsh_scene *scene = &w->job->scene;
    vsh_texels *own = NULL;
    uint32_t *known = w->channels.known;
    if (w->input.kept == NULL) {
        VSHI_TRY(make_texels(w, first, rows, run, &own, error));
    }
    const vsh_texels *texels = own != NULL ? own : w->input.kept;
    vsh_bake_stats band = vsh_bake_stats_zero();
    band.invalid_by_mesh = w->invalid;
    band.shade = w->baked.shade;
    band.errors = w->baked.errors;
    vsh_result result =
        known != NULL
            ? vshi_bake_part(w->job->occluders, texels, scene->lights, scene->light_count, &scene->shade, run,
                             &w->channels.lightmap, known, w->channels.kept, &band, error)
            : vsh_bake_lightmap(w->job->occluders, texels, scene->lights, scene->light_count, &scene->shade,
                                run, &w->channels.lightmap, &band, error);
    if (result == VSH_OK) {
        note_lit(w, texels, first, rows);
    }
    if (result == VSH_OK && vshi_is_fixed_whole(w)) {
        result = vshi_fill_hidden(w, texels, error);
    }
    vsh_texels_free(own);
    if (result != VSH_OK) {
        return vshi_name_file(w->target->receiver.path, result, error);
    }
    w->baked.texels += band.texels;
    w->baked.invalid_texels += band.invalid_texels;
    w->baked.shade = band.shade;
    for (size_t m = 0; m < w->target->mesh_count; ++m) {
        w->baked.invalid_by_mesh[m] += band.invalid_by_mesh[m];
    }
    return VSH_OK;
}

/* Takes a band from parts, as bake_band() makes it. */
static vsh_result take_band(vshi_lightmap_work *w, int32_t first, int32_t rows, const vsh_run *run,
                            vsh_error *error) {
    VSHI_TRY(vshi_parts_take(w, first, rows, run, error));
    if (!vshi_is_fixed_whole(w)) {
        return VSH_OK;
    }
    vsh_texels *texels = NULL;
    VSHI_TRY(vsh_texels_create_band(w->input.charts, first, rows, run, &texels, error));
    const vsh_result result = vshi_fill_hidden(w, texels, error);
    vsh_texels_free(texels);
    return result;
}

/* Bakes a band, or takes it from parts. */
static vsh_result make_band(vshi_lightmap_work *w, int32_t first, int32_t rows, const vsh_run *run,
                            vsh_error *error) {
    if (is_part(w)) {
        vshi_part_set_kept(w->job, w->index, &w->input.bands, first, rows, &w->channels);
    }
    VSHI_TRY((w->job->parts != NULL ? take_band : bake_band)(w, first, rows, run, error));
    if (vshi_is_fixed_whole(w)) {
        VSHI_TRY(vshi_stitch_alone(w, error));
    }
    vshi_channels_split(&w->channels, &w->job->scene);
    return VSH_OK;
}

/* Rows of several bands are written as part of the stage that bakes them; those of one as a stage of its own,
 * that far. */
static vsh_result report_writing(const vshi_lightmap_work *w, double fraction, vsh_error *error) {
    const bool several = w->input.bands.count > 1;
    const vsh_run *run = w->run;
    if (run->progress != NULL &&
        run->progress(run->user, several ? "bake" : "write", several ? w->rounds.before : fraction) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "write: cancelled");
    }
    return VSH_OK;
}

static vsh_result write_band(vshi_lightmap_work *w, int32_t rows, vsh_error *error) {
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
static void warn_bands(const vshi_lightmap_work *w) {
    const vsh_receiver *receiver = &w->target->receiver;
    const int32_t bands = w->input.bands.count;
    if (bands > 1 && vshi_fixes_seams(&w->target->receiver)) {
        vshi_warn(w->run,
                  "%s: seams are not fixed, because it is baked in %d bands of rows; raise --memory-limit",
                  receiver->path, bands);
    }
    if (bands > 1 && receiver->padding == VSH_PADDING_AUTO) {
        vshi_warn(w->run,
                  "%s: padding is limited to 16 texels, because it is baked in %d bands of rows; raise "
                  "--memory-limit",
                  receiver->path, bands);
    }
}

/* Warns of what a lightmap is, or refuses it. */
static vsh_result tell_baked(const vshi_lightmap_work *w, vsh_error *error) {
    VSHI_TRY(vshi_refuse_invalid(w->target, &w->baked, error));
    vshi_warn_baked(&w->job->scene, w->target, &w->baked, w->run);
    return VSH_OK;
}

static vsh_result bake_bands(vshi_lightmap_work *w, vsh_error *error) {
    const vsh_scene *scene = &w->job->scene;
    const vshi_bands *bands = &w->input.bands;
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
            VSHI_TRY(tell_baked(w, error));
        }
        result = write_band(w, rows, error);
        w->job->report.write_s += vshi_seconds() - baked;
        if (result != VSH_OK || last) {
            return result;
        }
    }
}

/* Memory and files. */
static vsh_result open_all(vshi_lightmap_work *w, vsh_error *error) {
    const vsh_bake_job *job = w->job;
    const vsh_scene *scene = &job->scene;
    const vsh_receiver *receiver = &w->target->receiver;
    const int32_t rows = w->input.bands.rows;
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
        VSHI_TRY(vshi_part_open_kept(job, w->index, &w->input.bands, &w->channels, error));
    }
    return vshi_invalid_picture_open(&w->picture, job, (size_t)(w->target - job->targets.list), rows, error);
}

static vsh_result end_sink(vshi_lightmap_work *w, vsh_result result, vsh_error *error) {
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

static void add_to_report(const vshi_lightmap_work *w) {
    vsh_bake_report *report = &w->job->report;
    report->texels += w->baked.texels;
    report->invalid_texels += w->baked.invalid_texels;
    report->bands += (uint64_t)w->input.bands.count;
    vshi_add_shade(&report->shade, &w->baked.shade);
    for (size_t i = 0; i < report->error_count; ++i) {
        vshi_add_bake_error(&w->job->errors[i], &w->baked.errors[i]);
    }
}

void vshi_lightmap_begin(vsh_bake_job *job, size_t index, const vshi_lightmap_input *input,
                         const vsh_run *run, vshi_lightmap_work *w) {
    *w = (vshi_lightmap_work){.job = job,
                              .run = run,
                              .input = *input,
                              .target = &job->targets.list[index],
                              .index = index,
                              .lightmap = &job->lightmaps[index],
                              .baked = vsh_bake_stats_zero(),
                              .files = {.job = job, .run = run},
                              .lit = {.job = job, .run = run, .target = &job->targets.list[index]}};
    w->part = (vshi_part_sink){job, w->lightmap, &w->channels, &w->baked};
    w->sink = is_part(w)                               ? vshi_part_sink_of(&w->part)
              : job->options.sink != NULL              ? job->sink
              : vsh_lit_is_output(w->lightmap->output) ? vshi_lit_sink_of(&w->lit)
                                                       : vshi_file_sink_of(&w->files);
    w->lightmap->bands = input->bands.count;
    w->lightmap->band_rows = input->bands.rows;
}

vsh_result vshi_lightmap_bake_whole(vshi_lightmap_work *w, vsh_error *error) {
    const double start = vshi_seconds();
    vsh_run run = *w->run;
    run.memory_held += w->held;
    VSHI_TRY(open_all(w, error));
    if (w->job->parts != NULL) {
        vshi_parts_add_stats(w->job->parts, w->index, &w->baked);
    }
    const vsh_result result =
        (w->job->parts != NULL ? take_band : bake_band)(w, 0, w->input.bands.rows, &run, error);
    w->job->report.bake_s += vshi_seconds() - start;
    return result == VSH_OK ? tell_baked(w, error) : result;
}

vsh_result vshi_lightmap_write_whole(vshi_lightmap_work *w, vsh_error *error) {
    const double start = vshi_seconds();
    vshi_channels_split(&w->channels, &w->job->scene);
    const vsh_result result = write_band(w, w->input.bands.rows, error);
    w->job->report.write_s += vshi_seconds() - start;
    return result;
}

vsh_result vshi_lightmap_end(vshi_lightmap_work *w, vsh_result result, vsh_error *error) {
    result = end_sink(w, result, error);
    result = vshi_invalid_picture_close(&w->picture, result, error);
    w->lightmap->invalid_texels = w->baked.invalid_texels;
    if (result == VSH_OK) {
        add_to_report(w);
    }
    free(w->baked.errors);
    free(w->baked.invalid_by_mesh);
    free(w->invalid);
    vshi_channels_free(&w->channels);
    return result;
}

vsh_result vshi_job_bake(vsh_bake_job *job, size_t index, const vshi_lightmap_input *input,
                         const vsh_run *run, vsh_error *error) {
    vshi_lightmap_work w;
    vshi_lightmap_begin(job, index, input, run, &w);
    vsh_result result = open_all(&w, error);
    if (result == VSH_OK) {
        result = bake_bands(&w, error);
    }
    return vshi_lightmap_end(&w, result, error);
}
