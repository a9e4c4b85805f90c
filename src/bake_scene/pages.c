#include "bake_scene/bake_scene.h"

#include "bake_scene/parts.h"
#include "base/bytes.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

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

static const char *name_of(const vshi_scene_page *page) {
    const vsh_receiver *receiver = &page->target->receiver;
    return receiver->output != NULL ? receiver->output : receiver->path;
}

/* Some formats are put together in memory. */
static vsh_result check_writer(const vshi_scene_page *page, const vsh_run *run, vsh_error *error) {
    const vsh_receiver *receiver = &page->target->receiver;
    if (page->bake->options.rows != NULL || run->memory_limit == 0) {
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

vsh_result vshi_scene_page_open(vshi_scene_bake *bake, size_t index, vshi_store *store, vshi_scene_page *page,
                                vsh_error *error) {
    const vsh_scene *scene = &bake->scene;
    const vshi_target *target = &bake->targets.list[index];
    const vsh_receiver *receiver = &target->receiver;
    *page = (vshi_scene_page){.bake = bake,
                              .target = target,
                              .index = index,
                              .charts = bake->charts[index],
                              .lightmap = &bake->lightmaps[index],
                              .baked = vsh_bake_stats_zero()};
    vsh_shade_options shade;
    VSHI_TRY(vshi_shade_options_resolve(&scene->shade, &shade, error));
    VSHI_TRY(vshi_allocate((void **)&page->baked.invalid_by_mesh, target->mesh_count + 1, sizeof(uint64_t),
                           name_of(page), error));
    VSHI_TRY(vshi_allocate((void **)&page->baked.errors, bake->error_count, sizeof *page->baked.errors,
                           name_of(page), error));
    VSHI_TRY(vshi_channels_name(scene, receiver->width, receiver->height, &page->channels, error));
    VSHI_TRY(check_writer(page, store->run, error));
    VSHI_TRY(vshi_channels_allocate(&page->channels, scene, store, name_of(page), error));
    VSHI_TRY(vshi_lightmap_check(&page->channels.lightmap, page->charts, scene->lights, scene->light_count,
                                 error));
    return vshi_page_open(page->charts, &page->channels.lightmap, scene->light_count, &shade,
                          vshi_ao_is_shared(&shade, page->charts->ao_spacing, bake->layered_ao), store,
                          &page->page, error);
}

void vshi_scene_page_close(vshi_scene_page *page) {
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
static uint64_t held_bytes(const vshi_scene_bake *bake) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    uint64_t bytes = bake->parts != NULL ? 0 : casters->field_bytes + casters->triangles_bytes;
    for (size_t i = 0; i < bake->targets.count; ++i) {
        vsh_charts_info info;
        vsh_charts_get_info(bake->charts[i], &info);
        bytes += info.bytes;
    }
    return bytes;
}

vsh_result vshi_scene_store_open(const vshi_scene_bake *bake, size_t index, vsh_run *run, vshi_store *store,
                                 vsh_error *error) {
    const char *output = bake->targets.list[index].receiver.output;
    run->memory_held += held_bytes(bake);
    *store = (vshi_store){.run = run};
    if (bake->options.scratch != NULL || output != NULL) {
        char *folder = bake->options.scratch != NULL ? strdup(bake->options.scratch) : folder_of(output);
        if (folder == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", output);
        }
        store->folder = folder;
    }
    return VSH_OK;
}

void vshi_scene_store_close(vshi_store *store) {
    free(store->folder);
    store->folder = NULL;
    vshi_store_close(store);
}

/* --- several, held together */

typedef struct group {
    vshi_scene_bake *bake;
    vsh_run held; /* the bake's run, minus memory used beside the pages */
    vshi_store store;
    vshi_scene_page *pages; /* [count], of which so many are open */
    size_t count, open;
} group;

/* Traces the tiles of a page, or reads them from parts. */
static vsh_result make_tiles(vshi_scene_page *page, vshi_job *tiles, vsh_error *error) {
    vshi_scene_bake *bake = page->bake;
    if (bake->parts != NULL) {
        return vshi_parts_read(bake->parts, page, tiles, error);
    }
    return vshi_name_file(page->target->receiver.path,
                          vshi_trace_tiles(bake->tracer, &page->page, NULL,
                                           vshi_charts_tiles(&page->charts->sorted), tiles, error),
                          error);
}

/* Seams and hidden charts stay as they are baked where there is no memory to make them better. */
static vsh_result keep_without_memory(const vshi_scene_page *page, vsh_result result, const char *kept,
                                      vsh_error *error) {
    if (result != VSH_ERROR_LIMIT) {
        return vshi_name_file(page->target->receiver.path, result, error);
    }
    vshi_warn(&page->bake->run, "%s: %s are not fixed for lack of memory; raise --memory-limit",
              page->target->receiver.path, kept);
    return VSH_OK;
}

static bool fixes_seams(const vsh_receiver *receiver) {
    return receiver->seams == VSH_SEAMS_FIX && receiver->type == VSH_RECEIVER_MESH;
}

static vsh_result finish_page(group *g, vshi_scene_page *page, vsh_error *error) {
    const vsh_receiver *receiver = &page->target->receiver;
    vsh_result result = vshi_page_finish(&page->page, &g->held, &page->baked, error);
    VSHI_TRY(vshi_name_file(receiver->path, result, error));
    vshi_note_lit(page);
    vshi_page_close_shots(&page->page);
    if (fixes_seams(receiver)) {
        result = vshi_lightmap_fill_hidden(page->charts, &page->channels.lightmap, page->page.light_count,
                                           &g->store, &g->held, NULL, error);
        VSHI_TRY(keep_without_memory(page, result, "hidden charts", error));
    }
    VSHI_TRY(vshi_refuse_invalid(page->target, &page->baked, error));
    vshi_warn_baked(&g->bake->scene, page->target, &page->baked, &g->bake->run);
    page->lightmap->invalid_texels = page->baked.invalid_texels;
    return VSH_OK;
}

static vsh_result stitch(group *g, vsh_error *error) {
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = g->bake->scene.shade.max_error;
    vsh_stitch_page *pages = NULL;
    vsh_run run = g->held;
    run.memory_held += g->store.held;
    VSHI_TRY(vshi_allocate((void **)&pages, g->count, sizeof *pages, "seams", error));
    for (size_t i = 0; i < g->count; ++i) {
        pages[i] = (vsh_stitch_page){g->pages[i].charts, &g->pages[i].channels.lightmap};
    }
    const vsh_result result =
        vsh_lightmaps_stitch(pages, g->count, g->bake->scene.light_count, &options, &run, NULL, error);
    free(pages);
    return keep_without_memory(&g->pages[0], result, "seams", error);
}

/* --- a picture of a lightmap's charts, and of the texels of them that are not valid */

/* Colours of texels outside charts, of valid and of invalid texels. */
static const float COLOURS[3][3] = {{0.05f, 0.05f, 0.06f}, {0.5f, 0.5f, 0.5f}, {0.7f, 0.05f, 0.05f}};
static const char *const NAMES[3] = {"R", "G", "B"};

/* "floor" of "out/floor.exr". */
typedef struct stem {
    const char *at;
    size_t size;
} stem;

static stem stem_of(const vshi_target *target) {
    const char *output = target->output != NULL ? target->output : "";
    const char *slash = strrchr(output, '/');
    const char *name = slash != NULL ? slash + 1 : output, *dot = strrchr(name, '.');
    return (stem){name, dot != NULL ? (size_t)(dot - name) : strlen(name)};
}

/* Names that differ in case only are one file to some systems. */
static bool are_alike(stem a, stem b) {
    return a.size == b.size && strncasecmp(a.at, b.at, a.size) == 0;
}

static bool is_taken(const vshi_targets *targets, const char *name) {
    for (size_t i = 0; i < targets->count; ++i) {
        if (are_alike(stem_of(&targets->list[i]), (stem){name, strlen(name)})) {
            return true;
        }
    }
    return false;
}

/* FILE.png for one lightmap, else "where.floor.png" for the first "floor", "where.floor-2.png" for the
 * second; numbers that another output has by itself are left out. To be freed; NULL where memory is short. */
static char *name_picture(const char *path, const vshi_targets *targets, size_t index) {
    if (targets->count == 1) {
        return strdup(path);
    }
    const stem own = stem_of(&targets->list[index]);
    const int before = (int)(strlen(path) - strlen(".png"));
    const size_t size = strlen(path) + own.size + 32;
    char *made = malloc(size), *name = malloc(own.size + 32);
    size_t alike = 0, number = 1;
    for (size_t i = 0; i < index; ++i) {
        alike += are_alike(stem_of(&targets->list[i]), own);
    }
    if (made != NULL && name != NULL) {
        snprintf(name, own.size + 32, "%.*s", (int)own.size, own.at);
        while (alike > 0) {
            snprintf(name, own.size + 32, "%.*s-%zu", (int)own.size, own.at, ++number);
            alike -= !is_taken(targets, name);
        }
        snprintf(made, size, "%.*s.%s.png", before, path, name);
    } else {
        free(made);
        made = NULL;
    }
    free(name);
    return made;
}

/* Writes a picture of a page's texels, a few rows at a time, if the caller wants one. */
static vsh_result write_invalid_picture(const vshi_scene_page *page, vsh_error *error) {
    const char *file = page->bake->options.invalid_picture;
    const int32_t width = page->lightmap->width, height = page->lightmap->height;
    const size_t room = (size_t)width * ROWS;
    char *path = NULL;
    float *colours = NULL;
    vsh_image_writer *writer = NULL;
    vsh_result result;
    if (file == NULL) {
        return VSH_OK;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&colours, 3 * room, sizeof *colours, file, error));
    path = name_picture(file, &page->bake->targets, page->index);
    if (path == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", file);
        goto done;
    }
    const float *const planes[3] = {colours, colours + room, colours + 2 * room};
    const vsh_image image = {width, height, 3, NAMES, planes, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = 8;
    VSHI_TRY_DONE(vsh_image_writer_create(path, &image, &options, &writer, error));
    for (int32_t first = 0; first < height; first += ROWS) {
        const int32_t rows = height - first < ROWS ? height - first : ROWS;
        const uint8_t *state = page->page.state + (size_t)first * page->page.width;
        for (size_t i = 0; i < (size_t)rows * page->page.width; ++i) {
            const int kind = state[i] == VSHI_TEXEL_EMPTY ? 0 : state[i] == VSHI_TEXEL_VALID ? 1 : 2;
            for (size_t c = 0; c < 3; ++c) {
                colours[c * room + i] = COLOURS[kind][c];
            }
        }
        VSHI_TRY_DONE(vsh_image_writer_add(writer, rows, planes, error));
    }
    result = vsh_image_writer_finish(writer, error);
    writer = NULL;
done:
    vsh_image_writer_abandon(writer);
    free(path);
    free(colours);
    return result;
}

/* --- writing */

/* Where the rows of a page go. */
typedef struct output {
    vsh_image_writer *writer; /* of an image; NULL: there is none */
    vshi_lit_output lit;      /* of an asset */
    bool is_lit;
} output;

static vsh_result open_output(const vshi_scene_page *page, output *out, vsh_error *error) {
    vshi_scene_bake *bake = page->bake;
    *out = (output){.is_lit = vsh_lit_is_output(page->lightmap->output) != 0 && bake->options.rows == NULL};
    if (out->is_lit) {
        return vshi_lit_output_open(&out->lit, page, error);
    }
    if (bake->options.rows != NULL) {
        return VSH_OK;
    }
    vsh_image_options options = vshi_receiver_image(&page->target->receiver);
    options.attributes = vsh_provenance_attributes(bake->provenance, &options.attribute_count);
    return vsh_image_writer_create(page->lightmap->output, &page->channels.image, &options, &out->writer,
                                   error);
}

static vsh_result add_rows(const vshi_scene_page *page, output *out, int32_t first, int32_t count,
                           const float *const *planes, vsh_error *error) {
    const vsh_bake_options *options = &page->bake->options;
    if (options->rows != NULL) {
        return options->rows(options->user, page->lightmap, &page->channels.image, first, count, planes,
                             error);
    }
    return out->is_lit ? vshi_lit_output_add(&out->lit, count, planes, error)
                       : vsh_image_writer_add(out->writer, count, planes, error);
}

static vsh_result close_output(const vshi_scene_page *page, output *out, vsh_result result,
                               vsh_error *error) {
    if (result == VSH_OK && out->writer != NULL) {
        vsh_image_clipping cut;
        result = vsh_image_writer_get_clipping(out->writer, &cut, error);
        if (result == VSH_OK) {
            result = vsh_image_writer_finish(out->writer, error);
            out->writer = NULL;
        }
        if (result == VSH_OK) {
            vshi_warn_clipping(page->lightmap->output, &cut, &page->bake->run);
        }
    }
    if (result == VSH_OK && out->is_lit) {
        result = vshi_lit_output_finish(&out->lit, error);
    }
    vsh_image_writer_abandon(out->writer);
    vshi_lit_output_close(&out->lit);
    return result;
}

static vsh_result report_writing(const vsh_run *run, double fraction, vsh_error *error) {
    if (run->progress != NULL && run->progress(run->user, "write", fraction) != 0) {
        return vshi_fail(error, VSH_ERROR_CANCELLED, "write: cancelled");
    }
    return VSH_OK;
}

static vsh_result add_all_rows(const vshi_scene_page *page, output *out, vsh_error *error) {
    const int32_t height = page->lightmap->height;
    const float *planes[VSH_MAX_CHANNELS];
    float *rows = NULL;
    vsh_result result;
    VSHI_TRY_DONE(report_writing(&page->bake->run, 0.0, error));
    VSHI_TRY_DONE(vshi_channels_allocate_rows(&page->channels, ROWS, &rows, error));
    for (int32_t first = 0; first < height; first += ROWS) {
        const int32_t count = height - first < ROWS ? height - first : ROWS;
        vshi_channels_rows(&page->channels, first, count, rows, planes);
        VSHI_TRY_DONE(add_rows(page, out, first, count, planes, error));
        VSHI_TRY_DONE(report_writing(&page->bake->run, (double)(first + count) / (double)height, error));
    }
done:
    free(rows);
    return result;
}

static vsh_result write_page(vshi_scene_page *page, vsh_error *error) {
    output out = {.writer = NULL};
    vsh_result result = open_output(page, &out, error);
    result = result == VSH_OK ? add_all_rows(page, &out, error) : result;
    VSHI_TRY(close_output(page, &out, result, error));
    return write_invalid_picture(page, error);
}

static vsh_result write_pages(group *g, vsh_error *error) {
    vshi_scene_bake *bake = g->bake;
    const double start = vshi_seconds();
    for (size_t i = 0; i < g->count; ++i) {
        VSHI_TRY(write_page(&g->pages[i], error));
        vshi_bake_report_add(bake, &g->pages[i].baked);
        if (bake->options.done != NULL) {
            bake->options.done(bake->options.user, g->pages[i].lightmap);
        }
    }
    bake->report.write_s += vshi_seconds() - start;
    return VSH_OK;
}

/* --- all of it */

static vsh_result open_pages(group *g, size_t first, vsh_error *error) {
    VSHI_TRY(vshi_scene_store_open(g->bake, first, &g->held, &g->store, error));
    VSHI_TRY(vshi_allocate((void **)&g->pages, g->count, sizeof *g->pages, "lightmaps", error));
    while (g->open < g->count) {
        const size_t index = first + g->open;
        const vsh_result result =
            vshi_scene_page_open(g->bake, index, &g->store, &g->pages[g->open++], error);
        VSHI_TRY(vshi_name_file(g->bake->targets.list[index].receiver.path, result, error));
    }
    return VSH_OK;
}

static vsh_result bake_group(group *g, size_t first, vshi_job *tiles, vsh_error *error) {
    const double start = vshi_seconds();
    VSHI_TRY(open_pages(g, first, error));
    for (size_t i = 0; i < g->count; ++i) {
        VSHI_TRY(make_tiles(&g->pages[i], tiles, error));
    }
    for (size_t i = 0; i < g->count; ++i) {
        VSHI_TRY(finish_page(g, &g->pages[i], error));
    }
    if (fixes_seams(&g->pages[0].target->receiver)) {
        VSHI_TRY(stitch(g, error));
    }
    g->bake->report.bake_s += vshi_seconds() - start;
    return write_pages(g, error);
}

/* Counts lightmaps in a row that are stitched together. */
static size_t count_together(const vshi_scene_bake *bake, size_t first) {
    size_t end = first + 1;
    while (end < bake->targets.count && fixes_seams(&bake->targets.list[first].receiver) &&
           fixes_seams(&bake->targets.list[end].receiver)) {
        ++end;
    }
    return end - first;
}

double vshi_bake_bytes(const vshi_scene_bake *bake) {
    const vsh_lightmap planes = vshi_channels_shape(&bake->scene);
    const vsh_shade_options *shade = &bake->scene.shade;
    double most = 0.0, tracing = 0.0, charts = 0.0;
    for (size_t first = 0, count; first < bake->targets.count; first += count) {
        count = count_together(bake, first);
        double bytes = 0.0;
        for (size_t i = first; i < first + count; ++i) {
            const bool shared = vshi_ao_is_shared(shade, bake->charts[i]->ao_spacing, bake->layered_ao);
            bytes += vshi_lightmap_bytes(bake->charts[i], &planes, bake->scene.light_count, shared);
            tracing = fmax(tracing, vshi_trace_bytes(bake->charts[i], bake->run.threads));
            charts += (double)bake->charts[i]->info.bytes;
        }
        most = fmax(most, bytes);
    }
    return charts + tracing + most;
}

vsh_result vshi_bake_pages(vshi_scene_bake *bake, vsh_error *error) {
    size_t total = 0;
    for (size_t i = 0; i < bake->targets.count; ++i) {
        total += vshi_charts_tiles(&bake->charts[i]->sorted);
    }
    vshi_job *tiles = vshi_job_begin(&bake->run, "bake", total);
    if (tiles == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "lightmaps: the system refused memory");
    }
    vsh_result result = VSH_OK;
    for (size_t first = 0, count; first < bake->targets.count && result == VSH_OK; first += count) {
        count = count_together(bake, first);
        group g = {.bake = bake, .held = bake->run, .count = count};
        result = bake_group(&g, first, tiles, error);
        for (size_t i = 0; i < g.open; ++i) {
            vshi_scene_page_close(&g.pages[i]);
        }
        free(g.pages);
        vshi_scene_store_close(&g.store);
    }
    vshi_job_end(tiles);
    VSHI_TRY(result);
    vshi_warn_hidden_lights(bake, &bake->run);
    return VSH_OK;
}
