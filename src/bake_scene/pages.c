#include "bake_scene/pages.h"

#include "bake_scene/file_sink.h"
#include "bake_scene/invalid_picture.h"
#include "bake_scene/lit_sink.h"
#include "bake_scene/parts.h"
#include "bake_scene/warn.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 64 }; /* that are handed over at a time */

vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error) {
    if (error == NULL ||
        (result != VSH_ERROR_INPUT && result != VSH_ERROR_LIMIT && result != VSH_ERROR_UNSUPPORTED)) {
        return result;
    }
    const vsh_error of_arrays = *error;
    return vshi_fail(error, result, "%s: %s", path, of_arrays.message);
}

/* --- one */

static const char *name_of(const vshi_job_page *page) {
    const vsh_receiver *receiver = &page->target->receiver;
    return receiver->output != NULL ? receiver->output : receiver->path;
}

/* Some formats are put together in memory. */
static vsh_result check_writer(const vshi_job_page *page, const vsh_run *run, vsh_error *error) {
    const vsh_receiver *receiver = &page->target->receiver;
    if (page->job->options.sink != NULL || run->memory_limit == 0) {
        return VSH_OK;
    }
    const vsh_image_options options = vshi_receiver_image(receiver);
    const uint64_t bytes = vsh_image_writer_bytes(receiver->output, &page->channels.image, &options);
    char needed[VSHI_BYTES_ROOM], limit[VSHI_BYTES_ROOM];
    if (bytes <= vshi_memory_left(run)) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_LIMIT,
                     "%s: writing %d × %d texels takes %s, over the memory limit of %s; write .exr, or raise "
                     "--memory-limit",
                     receiver->output, receiver->width, receiver->height,
                     vshi_bytes_text(bytes, needed, sizeof needed),
                     vshi_bytes_text(run->memory_limit, limit, sizeof limit));
}

vsh_result vshi_job_page_open(vsh_bake_job *job, size_t index, vshi_store *store, vshi_job_page *page,
                              vsh_error *error) {
    const vsh_scene *scene = &job->scene;
    const vshi_target *target = &job->targets.list[index];
    const vsh_receiver *receiver = &target->receiver;
    *page = (vshi_job_page){.job = job,
                            .target = target,
                            .index = index,
                            .charts = job->charts[index],
                            .lightmap = &job->lightmaps[index],
                            .baked = vsh_bake_stats_zero()};
    vsh_shade_options shade;
    VSHI_TRY(vshi_shade_options_resolve(&scene->shade, &shade, error));
    VSHI_TRY(vshi_allocate((void **)&page->baked.invalid_by_mesh, target->mesh_count + 1, sizeof(uint64_t),
                           name_of(page), error));
    VSHI_TRY(vshi_allocate((void **)&page->baked.errors, job->report.error_count + 1,
                           sizeof *page->baked.errors, name_of(page), error));
    VSHI_TRY(vshi_channels_name(scene, receiver->width, receiver->height, &page->channels, error));
    VSHI_TRY(check_writer(page, store->run, error));
    VSHI_TRY(vshi_channels_allocate(&page->channels, scene, store, name_of(page), error));
    VSHI_TRY(vshi_lightmap_check(&page->channels.lightmap, page->charts, scene->lights, scene->light_count,
                                 error));
    return vshi_page_open(page->charts, &page->channels.lightmap, scene->light_count, &shade,
                          vshi_ao_is_shared(&shade, page->charts->ao_spacing, job->layered_ao), store,
                          &page->page, error);
}

void vshi_job_page_close(vshi_job_page *page) {
    vshi_page_close(&page->page);
    free(page->baked.errors);
    free(page->baked.invalid_by_mesh);
    vshi_channels_free(&page->channels);
}

static char *folder_of(const char *path) {
    const char *slash = path != NULL ? strrchr(path, '/') : NULL;
    return slash == NULL ? strdup(".") : slash == path ? strdup("/") : strndup(path, (size_t)(slash - path));
}

/* Bytes that are held beside the lightmaps. */
static uint64_t held_bytes(const vsh_bake_job *job) {
    const vsh_occluders_info *casters = &job->report.occluders;
    uint64_t bytes = job->parts != NULL ? 0 : casters->field_bytes + casters->triangles_bytes;
    for (size_t i = 0; i < job->targets.count; ++i) {
        vsh_charts_info info;
        vsh_charts_get_info(job->charts[i], &info);
        bytes += info.bytes;
    }
    return bytes;
}

vsh_result vshi_job_store_open(const vsh_bake_job *job, size_t index, vsh_run *run, vshi_store *store,
                               vsh_error *error) {
    const char *output = job->targets.list[index].receiver.output;
    run->memory_held += held_bytes(job);
    *store = (vshi_store){.run = run};
    if (job->options.scratch != NULL || output != NULL) {
        char *folder = job->options.scratch != NULL ? strdup(job->options.scratch) : folder_of(output);
        if (folder == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", output);
        }
        store->folder = folder;
    }
    return VSH_OK;
}

void vshi_job_store_close(vshi_store *store) {
    free(store->folder);
    store->folder = NULL;
    vshi_store_close(store);
}

vsh_result vshi_job_open_tracer(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    const vsh_scene *scene = &job->scene;
    const vsh_lightmap planes = vshi_channels_shape(scene);
    vsh_shade_options shade;
    if (job->tracer != NULL || job->occluders == NULL) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_shade_options_resolve(&scene->shade, &shade, error));
    return vshi_tracer_create(job->occluders, scene->lights, scene->light_count, &shade, &planes, true, run,
                              &job->tracer, error);
}

/* --- several, held together */

typedef struct group {
    vsh_bake_job *job;
    const vsh_run *run; /* the job's */
    vsh_run held;       /* the same, with memory that the group holds */
    vshi_store store;
    vshi_job_page *pages; /* [count], of which so many are open */
    size_t count, open;
} group;

/* Fills tiles of a page: traced, or out of parts. */
static vsh_result make_tiles(const group *g, vshi_job_page *page, vshi_job *job, vsh_error *error) {
    vsh_bake_job *of = g->job;
    if (of->parts != NULL) {
        return vshi_parts_take(of->parts, page, job, error);
    }
    const vsh_result result =
        vshi_trace_tiles(of->tracer, &page->page, NULL, vshi_charts_tiles(&page->charts->sorted), job, error);
    return vshi_name_file(page->target->receiver.path, result, error);
}

static vsh_result trace_pages(group *g, vsh_error *error) {
    size_t tiles = 0;
    for (size_t i = 0; i < g->count; ++i) {
        tiles += vshi_charts_tiles(&g->pages[i].charts->sorted);
    }
    vshi_job *job = vshi_job_begin(g->run, "bake", tiles);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "lightmaps: the system refused memory");
    }
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < g->count && result == VSH_OK; ++i) {
        result = make_tiles(g, &g->pages[i], job, error);
    }
    vshi_job_end(job);
    return result;
}

/* Seams and hidden charts stay as they are baked where there is no memory to make them better. */
static vsh_result keep_without_memory(const vshi_job_page *page, const vsh_run *run, vsh_result result,
                                      const char *kept, vsh_error *error) {
    if (result != VSH_ERROR_LIMIT) {
        return vshi_name_file(page->target->receiver.path, result, error);
    }
    vshi_warn(run, "%s: %s are not fixed for lack of memory; raise --memory-limit",
              page->target->receiver.path, kept);
    return VSH_OK;
}

static bool fixes_seams(const vsh_receiver *receiver) {
    return receiver->seams == VSH_SEAMS_FIX && receiver->type == VSH_RECEIVER_MESH;
}

static vsh_result finish_page(group *g, vshi_job_page *page, vsh_error *error) {
    const vsh_receiver *receiver = &page->target->receiver;
    vsh_result result = vshi_page_finish(&page->page, &g->held, &page->baked, error);
    VSHI_TRY(vshi_name_file(receiver->path, result, error));
    vshi_note_lit(page);
    vshi_page_close_shots(&page->page);
    if (fixes_seams(receiver)) {
        result = vshi_lightmap_fill_hidden(page->charts, &page->channels.lightmap, page->page.light_count,
                                           &g->store, &g->held, NULL, error);
        VSHI_TRY(keep_without_memory(page, g->run, result, "hidden charts", error));
    }
    VSHI_TRY(vshi_refuse_invalid(page->target, &page->baked, error));
    vshi_warn_baked(&g->job->scene, page->target, &page->baked, g->run);
    return VSH_OK;
}

static vsh_result stitch(group *g, vsh_error *error) {
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = g->job->scene.shade.max_error;
    vsh_stitch_page *pages = NULL;
    vsh_run run = g->held;
    run.memory_held += g->store.held;
    VSHI_TRY(vshi_allocate((void **)&pages, g->count, sizeof *pages, "seams", error));
    for (size_t i = 0; i < g->count; ++i) {
        pages[i] = (vsh_stitch_page){g->pages[i].charts, &g->pages[i].channels.lightmap};
    }
    const vsh_result result =
        vsh_lightmaps_stitch(pages, g->count, g->job->scene.light_count, &options, &run, NULL, error);
    free(pages);
    return keep_without_memory(&g->pages[0], g->run, result, "seams", error);
}

/* --- written */

static vsh_result report_writing(const vsh_run *run, double fraction, vsh_error *error) {
    if (run->progress != NULL && run->progress(run->user, "write", fraction) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "write: cancelled");
    }
    return VSH_OK;
}

static vsh_result add_rows(const vshi_job_page *page, const vsh_row_sink *sink, vshi_invalid_picture *picture,
                           const vsh_run *run, vsh_error *error) {
    const int32_t height = page->lightmap->height;
    const float *planes[VSH_MAX_CHANNELS];
    float *rows = NULL;
    vsh_result result = VSH_OK;
    VSHI_TRY(vshi_channels_allocate_rows(&page->channels, ROWS, &rows, error));
    for (int32_t first = 0; first < height && result == VSH_OK; first += ROWS) {
        const int32_t count = height - first < ROWS ? height - first : ROWS;
        vshi_channels_rows(&page->channels, first, count, rows, planes);
        result = sink->add(sink->user, count, planes, error);
        if (result == VSH_OK) {
            result = vshi_invalid_picture_add(picture, count,
                                              page->page.state + (size_t)first * page->page.width, error);
        }
        if (result == VSH_OK) {
            result = report_writing(run, (double)(first + count) / (double)height, error);
        }
    }
    free(rows);
    return result;
}

static vsh_result write_rows(vshi_job_page *page, const vsh_row_sink *sink, vshi_invalid_picture *picture,
                             const vsh_run *run, vsh_error *error) {
    vsh_image image = page->channels.image;
    image.planes = NULL;
    VSHI_TRY(report_writing(run, 0.0, error));
    VSHI_TRY(sink->begin(sink->user, page->lightmap, &image, error));
    const vsh_result result = add_rows(page, sink, picture, run, error);
    const vsh_result ended = sink->end(sink->user, result, error);
    VSHI_TRY(result != VSH_OK ? result : ended);
    report_writing(run, 1.0, NULL); /* all is done: too late to stop */
    return VSH_OK;
}

static vsh_result write_page(vshi_job_page *page, const vsh_run *run, vsh_error *error) {
    vsh_bake_job *job = page->job;
    vshi_file_sink files = {.job = job, .run = run};
    vshi_lit_sink lit = {.job = job, .run = run, .target = page->target};
    const vsh_row_sink sink = job->options.sink != NULL                   ? job->sink
                              : vsh_lit_is_output(page->lightmap->output) ? vshi_lit_sink_of(&lit)
                                                                          : vshi_file_sink_of(&files);
    vshi_invalid_picture picture;
    vsh_result result = vshi_invalid_picture_open(&picture, job, page->index, ROWS, error);
    if (result == VSH_OK) {
        result = write_rows(page, &sink, &picture, run, error);
    }
    return vshi_invalid_picture_close(&picture, result, error);
}

static vsh_result bake_group(group *g, size_t first, vsh_error *error) {
    vsh_bake_job *job = g->job;
    const double start = vshi_seconds();
    VSHI_TRY(vshi_job_store_open(job, first, &g->held, &g->store, error));
    VSHI_TRY(vshi_allocate((void **)&g->pages, g->count, sizeof *g->pages, "lightmaps", error));
    for (; g->open < g->count; ++g->open) {
        const vsh_result result =
            vshi_job_page_open(job, first + g->open, &g->store, &g->pages[g->open], error);
        if (result != VSH_OK) {
            vshi_job_page_close(&g->pages[g->open]);
            return vshi_name_file(job->targets.list[first + g->open].receiver.path, result, error);
        }
    }
    VSHI_TRY(trace_pages(g, error));
    for (size_t i = 0; i < g->count; ++i) {
        VSHI_TRY(finish_page(g, &g->pages[i], error));
    }
    if (fixes_seams(&g->pages[0].target->receiver)) {
        VSHI_TRY(stitch(g, error));
    }
    const double baked = vshi_seconds();
    job->report.bake_s += baked - start;
    vsh_result result = VSH_OK;
    for (size_t i = 0; i < g->count && result == VSH_OK; ++i) {
        vshi_job_page *page = &g->pages[i];
        page->lightmap->invalid_texels = page->baked.invalid_texels;
        result = write_page(page, g->run, error);
        if (result == VSH_OK) {
            vshi_job_add(job, &page->baked);
            if (job->options.done != NULL) {
                job->options.done(job->options.user, page->lightmap, VSH_OK);
            }
        }
    }
    job->report.write_s += vshi_seconds() - baked;
    return result;
}

/* Lightmaps in a row that are stitched together. */
static size_t count_together(const vsh_bake_job *job, size_t first) {
    size_t end = first + 1;
    while (end < job->targets.count && fixes_seams(&job->targets.list[first].receiver) &&
           fixes_seams(&job->targets.list[end].receiver)) {
        ++end;
    }
    return end - first;
}

double vshi_job_bytes(const vsh_bake_job *job, int32_t threads) {
    const vsh_lightmap planes = vshi_channels_shape(&job->scene);
    vsh_shade_options shade = job->scene.shade;
    double most = 0.0, tracing = 0.0, charts = 0.0;
    for (size_t first = 0, count; first < job->targets.count; first += count) {
        count = count_together(job, first);
        double bytes = 0.0;
        for (size_t i = first; i < first + count; ++i) {
            const bool shared = vshi_ao_is_shared(&shade, job->charts[i]->ao_spacing, job->layered_ao);
            bytes += vshi_lightmap_bytes(job->charts[i], &planes, job->scene.light_count, shared);
            tracing = fmax(tracing, vshi_trace_bytes(job->charts[i], threads));
            charts += (double)job->charts[i]->info.bytes;
        }
        most = fmax(most, bytes);
    }
    return charts + tracing + most;
}

vsh_result vshi_job_bake_all(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    for (size_t first = 0, count; first < job->targets.count; first += count) {
        count = count_together(job, first);
        group g = {.job = job, .run = run, .held = *run, .count = count};
        const vsh_result result = bake_group(&g, first, error);
        for (size_t i = 0; i < g.open; ++i) {
            vshi_job_page_close(&g.pages[i]);
        }
        free(g.pages);
        vshi_job_store_close(&g.store);
        if (result != VSH_OK && job->options.done != NULL) {
            job->options.done(job->options.user, &job->lightmaps[first], result);
        }
        VSHI_TRY(result);
    }
    vshi_warn_hidden_lights(job, run);
    return VSH_OK;
}
