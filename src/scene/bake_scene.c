/* A scene's bake, from its files to finished lightmaps; forecasts of bakes. */
#include "scene/bake_scene.h"

#include "base/bytes.h"
#include "base/clock.h"
#include "base/file.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "io/image/image.h"
#include "lightmap/planes.h"
#include "scene/assets.h"
#include "shade/occluders.h"
#include "shade/shade.h"

#include <math.h>
#include <stdlib.h>
#include <vdbshade/scene.h>

vsh_result vshi_name_file(const char *path, vsh_result result, vsh_error *error) {
    if (error == NULL ||
        (result != VSH_ERROR_INPUT && result != VSH_ERROR_LIMIT && result != VSH_ERROR_UNSUPPORTED)) {
        return result;
    }
    const vsh_error of_arrays = *error;
    return vshi_fail(error, result, "%s: %s", path, of_arrays.message);
}

/* --- checks */

static vsh_result check_index(const vsh_scene *scene, size_t index, vsh_error *error) {
    return index < scene->receiver_count
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT, "receivers[%zu]: there are %zu", index,
                           scene->receiver_count);
}

static vsh_result check_asset(const vsh_scene *scene, const vsh_receiver *receiver, vsh_error *error) {
    if (!scene->ao && !scene->irradiance && scene->light_count == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "%s: an asset is lit by AO, irradiance or shadows, and there are none",
                         receiver->output);
    }
    if (receiver->pack != NULL || receiver->bits == 32) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: %s: the images of an asset are PNG of 8 or 16 bits",
                         receiver->output, receiver->pack != NULL ? "pack" : "32 bits");
    }
    return vshi_output_check(receiver->output, error);
}

static vsh_result check_vertex_colors(const vsh_scene *scene, const vsh_receiver *receiver,
                                      vsh_error *error) {
    const char *what = receiver->vertex_colors;
    bool known =
        (scene->ao && strcmp(what, "ao") == 0) || (scene->light_count > 0 && strcmp(what, "irradiance") == 0);
    for (size_t i = 0; i < scene->light_count && !known; ++i) {
        known = strncmp(what, "shadow.", 7) == 0 && strcmp(what + 7, scene->lights[i].name) == 0;
    }
    return known && scene->bent != VSH_BENT_TANGENT && vsh_lit_is_output(receiver->output)
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_ARGUMENT,
                           "%s: vertex colours '%.64s': expected ao (with --ao), irradiance (with lights) or "
                           "a light's shadow.%s, into a .glb, .gltf or .obj, without tangent space",
                           receiver->output != NULL ? receiver->output : receiver->path, what,
                           scene->light_count > 0 ? scene->lights[0].name : "NAME");
}

static vsh_result check_image(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error) {
    const vsh_image_options options = vshi_receiver_image(receiver);
    vsh_error why;
    const vsh_result result = vsh_image_check(receiver->output, image, &options, &why);
    if (result == VSH_OK) {
        return VSH_OK;
    }
    return vshi_fail(error, result, "%s%s", why.message,
                     receiver->output == NULL || vshi_image_is_written(receiver->output)
                         ? ""
                         : "; or glb, gltf, obj for the mesh with its light");
}

vsh_result vsh_receiver_check(const vsh_scene *scene, size_t index, vsh_error *error) {
    VSHI_NEEDS(scene);
    VSHI_TRY(check_index(scene, index, error));
    const vsh_receiver *receiver = &scene->receivers[index];
    vshi_channels channels;
    VSHI_TRY(receiver->vertex_colors != NULL ? check_vertex_colors(scene, receiver, error) : VSH_OK);
    vsh_result result = vshi_channels_name(scene, receiver->width, receiver->height, &channels, error);
    if (result == VSH_OK) {
        result = vsh_lit_is_output(receiver->output) ? check_asset(scene, receiver, error)
                                                     : check_image(receiver, &channels.image, error);
    }
    vshi_channels_free(&channels);
    return result;
}

static vsh_result check_shard(const vsh_bake_options *options, vsh_error *error) {
    const int32_t count = options->shard_count;
    if (count < 0 || count > VSHI_MOST_SHARDS || options->shard < 0 || options->shard > count) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_bake_options.shard %d of %d: expected 1 to %d, and at most their count",
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
        if (result != VSH_OK && !(forecast && result == VSH_ERROR_WRITE)) { /* forecasts need no folder */
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

/* Adds irradiance to a scene for vertex colours, and with ambient light if all outputs are assets. */
static void light_assets(vsh_scene *scene, bool writes) {
    static const double AMBIENT = 0.25; /* linear, if the scene names none: shadows are not black */
    bool assets = writes && scene->light_count > 0;
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        const vsh_receiver *receiver = &scene->receivers[i];
        assets = assets && vsh_lit_is_output(receiver->output);
        scene->irradiance |=
            receiver->vertex_colors != NULL && strcmp(receiver->vertex_colors, "irradiance") == 0;
    }
    if (!assets) {
        return;
    }
    scene->irradiance = 1;
    for (int c = 0; c < 3 && scene->has_ambient == 0; ++c) {
        scene->ambient[c] = AMBIENT;
    }
    scene->has_ambient = 1;
}

/* Checks the arguments, reads the scene's files and lists its lightmaps. Free the bake even after an error.
 */
static vsh_result load(vshi_scene_bake *bake, const vsh_scene *scene, const vsh_bake_options *options,
                       const vsh_run *run, bool forecast, vsh_error *error) {
    const double start = vshi_seconds();
    *bake = (vshi_scene_bake){.scene = *scene,
                              .options = vsh_bake_options_default(),
                              .error_count = scene->light_count + 2,
                              .report.shade = vsh_shade_stats_zero()};
    VSHI_TRY(vshi_run_resolve(run, &bake->run, error));
    VSHI_TRY(vshi_options_resolve(options, &bake->options, sizeof bake->options, "vsh_bake_options", error));
    if (scene->receiver_count == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "scene: no receivers");
    }
    VSHI_TRY(check_shard(&bake->options, error));
    VSHI_TRY(check_outputs(scene, &bake->options, forecast, error));
    light_assets(&bake->scene, bake->options.rows == NULL);
    VSHI_TRY(vsh_assets_load(&bake->scene, &bake->run, &bake->assets, error));
    bake->report.ao_distance = bake->scene.ao != 0 ? bake->scene.shade.ao_distance : 0.0;
    VSHI_TRY(vshi_list_lightmaps(bake, error));
    const vshi_array arrays[] = {VSHI_ARRAY(bake->errors, bake->error_count),
                                 VSHI_ARRAY(bake->lit, bake->error_count)};
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, "bake", error));
    bake->report.lightmap_count = bake->target_count;
    bake->report.load_s = vshi_seconds() - start;
    return bake->options.loaded != NULL
               ? bake->options.loaded(bake->options.user, bake->lightmaps, bake->target_count, error)
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
    for (size_t i = 0; i < bake->target_count; ++i) {
        vsh_charts_free(bake->targets[i].charts);
        free(bake->targets[i].output);
        free(bake->targets[i].object);
    }
    free(bake->targets);
    free(bake->lightmaps);
    vsh_assets_free(bake->assets);
}

/* --- charts */

enum { STITCHED_PADDING = 2 }; /* texels: lookups at borders read values guessed from nearby ones */

/* Sorts and counts a target's charts, and refuses UVs that cannot be baked. */
static vsh_result create_charts(const vsh_scene *scene, vshi_target *target, bool warns, const vsh_run *run,
                                vsh_error *error) {
    const vsh_receiver *receiver = &target->receiver;
    vsh_scene_lightmap *lightmap = target->lightmap;
    const bool points = receiver->vertex_colors != NULL;
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = receiver->width;
    options.height = receiver->height;
    options.supersample = receiver->supersample;
    options.padding = receiver->padding;
    if (receiver->seams == VSH_SEAMS_FIX && options.padding >= 0 && options.padding < STITCHED_PADDING) {
        options.padding = STITCHED_PADDING;
    }
    options.ao_spacing = scene->ao || vshi_planes_shaded(&scene->planes) > 0 ? receiver->ao_spacing : 1;
    options.shade = scene->shade;
    options.tangents = scene->bent == VSH_BENT_TANGENT;
    if (points) {
        options.width = options.padding = options.tangents = 0;
        options.supersample = options.ao_spacing = 1;
    }
    vsh_run silent = *run;
    silent.warning = NULL; /* vshi_warn_uvs() names the file, too */
    vsh_charts_info info;
    vsh_uv_report *reports = NULL;
    VSHI_TRY(
        vshi_allocate((void **)&reports, lightmap->mesh_count + 1, sizeof *reports, receiver->path, error));
    vsh_result result = (points ? vshi_charts_create : vsh_charts_create)(
        lightmap->meshes, lightmap->mesh_count, &options, &silent, reports, &target->charts, error);
    VSHI_TRY_DONE(vshi_name_file(receiver->path, result, error));
    vsh_charts_get_info(target->charts, &info);
    lightmap->covered = info.covered;
    lightmap->samples = info.samples;
    VSHI_TRY_DONE(vshi_refuse_uvs(target, reports, info.covered, error));
    if (points) {
        lightmap->width = target->receiver.width = info.width;
        lightmap->height = target->receiver.height = info.height;
    } else if (warns) {
        vshi_warn_uvs(target, reports, info.covered, run);
    }
done:
    free(reports);
    return result;
}

vsh_result vsh_receiver_charts(const vsh_scene *scene, size_t index, const vsh_mesh *meshes,
                               size_t mesh_count, const vsh_run *run, vsh_charts **charts, vsh_error *error) {
    VSHI_MAKES(charts);
    VSHI_NEEDS(scene);
    VSHI_TRY(check_index(scene, index, error));
    VSHI_NEEDS_OF(mesh_count, meshes);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_scene_lightmap lightmap = {.receiver = index, .meshes = meshes, .mesh_count = mesh_count};
    vshi_target target = {.lightmap = &lightmap, .receiver = scene->receivers[index]};
    const vsh_result result = create_charts(scene, &target, true, &full, error);
    if (result == VSH_OK) {
        *charts = target.charts;
    } else {
        vsh_charts_free(target.charts);
    }
    return result;
}

static vsh_result count_lightmaps(vshi_scene_bake *bake, bool warns, vsh_error *error) {
    const double start = vshi_seconds();
    vshi_empty_box(bake->receivers[0], bake->receivers[1]);
    for (size_t i = 0; i < bake->target_count; ++i) {
        vshi_target *target = &bake->targets[i];
        vsh_charts_info info;
        VSHI_TRY(create_charts(&bake->scene, target, warns, &bake->run, error));
        vsh_charts_get_info(target->charts, &info);
        bake->report.samples += info.samples;
        if (info.samples > 0) {
            vshi_grow_box_by(bake->receivers[0], bake->receivers[1], NULL, info.bounds_min, info.bounds_max);
        }
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

/* --- pages in memory */

/* Some formats are put together in memory. */
static vsh_result check_writer(const vshi_scene_page *page, const vsh_run *run, vsh_error *error) {
    const vsh_receiver *receiver = &page->target->receiver;
    if (page->bake->options.rows != NULL || run->memory_limit == 0) {
        return VSH_OK;
    }
    const vsh_image_options options = vshi_receiver_image(receiver);
    const uint64_t bytes = vshi_image_writer_bytes(receiver->output, &page->channels.image, &options);
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

static vsh_result open_page(vshi_scene_bake *bake, const vshi_target *target, vshi_store *store,
                            vshi_scene_page *page, vsh_error *error) {
    const vsh_scene *scene = &bake->scene;
    const vsh_receiver *receiver = &target->receiver;
    const char *name = receiver->output != NULL ? receiver->output : receiver->path;
    vsh_shade_options shade;
    *page = (vshi_scene_page){.bake = bake, .target = target, .baked = vsh_bake_stats_zero()};
    const vshi_array arrays[] = {VSHI_ARRAY(page->baked.invalid_by_mesh, target->lightmap->mesh_count + 1),
                                 VSHI_ARRAY(page->baked.errors, bake->error_count)};
    VSHI_TRY(vshi_shade_options_resolve(&scene->shade, &shade, error));
    VSHI_TRY(VSHI_ALLOCATE_ALL(arrays, name, error));
    VSHI_TRY(vshi_channels_name(scene, receiver->width, receiver->height, &page->channels, error));
    VSHI_TRY(check_writer(page, store->run, error));
    VSHI_TRY(vshi_channels_allocate(&page->channels, scene, store, name, error));
    VSHI_TRY(vshi_lightmap_check(&page->channels.lightmap, target->charts, scene->lights, scene->light_count,
                                 error));
    return vshi_page_open(target->charts, &page->channels.lightmap, scene->light_count, &shade,
                          vshi_ao_is_shared(&shade, target->charts->ao_spacing, bake->layered_ao), store,
                          &page->page, error);
}

vsh_result vshi_page_group_open(vshi_scene_bake *bake, size_t first, size_t count, vshi_page_group *g,
                                vsh_error *error) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    const char *scratch = bake->options.scratch, *output = bake->targets[first].receiver.output;
    *g = (vshi_page_group){.bake = bake, .held = bake->run, .store.run = &g->held, .count = count};
    g->held.memory_held += bake->parts != NULL ? 0 : casters->field_bytes + casters->triangles_bytes;
    for (size_t i = 0; i < bake->target_count; ++i) {
        g->held.memory_held += bake->targets[i].charts->info.bytes;
    }
    char folder[PATH_MAX];
    if (scratch == NULL && output != NULL) {
        vshi_path_folder(output, folder);
        scratch = folder;
    }
    if (scratch != NULL) {
        g->store.folder = strdup(scratch);
        if (g->store.folder == NULL) {
            return vshi_fail_memory(error, "lightmaps");
        }
    }
    VSHI_TRY(vshi_allocate((void **)&g->pages, count, sizeof *g->pages, "lightmaps", error));
    while (g->open < count) {
        const vshi_target *target = &bake->targets[first + g->open];
        const vsh_result result = open_page(bake, target, &g->store, &g->pages[g->open++], error);
        VSHI_TRY(vshi_name_file(target->receiver.path, result, error));
    }
    return VSH_OK;
}

void vshi_page_group_close(vshi_page_group *g) {
    for (size_t i = 0; i < g->open; ++i) {
        vshi_scene_page *page = &g->pages[i];
        vshi_page_close(&page->page);
        free(page->baked.errors);
        free(page->baked.invalid_by_mesh);
        vshi_channels_free(&page->channels);
    }
    free(g->pages);
    free(g->store.folder);
    vshi_store_close(&g->store);
}

/* --- finishing pages */

/* Traces the tiles of a page, or reads them from parts. */
static vsh_result make_tiles(vshi_scene_page *page, vshi_job *tiles, vsh_error *error) {
    vshi_scene_bake *bake = page->bake;
    if (bake->parts != NULL) {
        return vshi_parts_read(bake->parts, page, tiles, error);
    }
    const size_t count = vshi_charts_tiles(&page->target->charts->sorted);
    const vsh_result result = vshi_trace_tiles(bake->tracer, &page->page, NULL, count, tiles, error);
    return vshi_name_file(page->target->receiver.path, result, error);
}

/* Keeps seams and hidden charts as they are if memory is too short to improve them. */
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
    return receiver->seams == VSH_SEAMS_FIX && receiver->type == VSH_RECEIVER_MESH &&
           receiver->vertex_colors == NULL;
}

static vsh_result finish_page(vshi_page_group *g, vshi_scene_page *page, vsh_error *error) {
    const vshi_target *target = page->target;
    vsh_result result = vshi_page_finish(&page->page, &g->held, &page->baked, error);
    VSHI_TRY(vshi_name_file(target->receiver.path, result, error));
    vshi_find_lit_objects(page);
    vshi_page_close_shots(&page->page);
    if (fixes_seams(&target->receiver)) {
        result = vshi_lightmap_fill_hidden(target->charts, &page->channels.lightmap, page->page.light_count,
                                           &g->store, &g->held, NULL, error);
        VSHI_TRY(keep_without_memory(page, result, "hidden charts", error));
    }
    VSHI_TRY(vshi_refuse_invalid(target, &page->baked, error));
    vshi_warn_baked(&g->bake->scene, target, &page->baked, &g->bake->run);
    target->lightmap->invalid_texels = page->baked.invalid_texels;
    return VSH_OK;
}

static vsh_result stitch(vshi_page_group *g, vsh_error *error) {
    vsh_stitch_options options = vsh_stitch_options_default();
    options.max_change = g->bake->scene.shade.max_error;
    vsh_stitch_page *pages = NULL;
    vsh_run run = g->held;
    run.memory_held += g->store.held;
    VSHI_TRY(vshi_allocate((void **)&pages, g->count, sizeof *pages, "seams", error));
    for (size_t i = 0; i < g->count; ++i) {
        pages[i] = (vsh_stitch_page){g->pages[i].target->charts, &g->pages[i].channels.lightmap};
    }
    const vsh_result result =
        vsh_lightmaps_stitch(pages, g->count, g->bake->scene.light_count, &options, &run, NULL, error);
    free(pages);
    return keep_without_memory(&g->pages[0], result, "seams", error);
}

static void add_to_report(vshi_scene_bake *bake, const vsh_bake_stats *baked) {
    vsh_bake_report *report = &bake->report;
    report->texels += baked->texels;
    report->invalid_texels += baked->invalid_texels;
    vshi_shade_stats_add(&report->shade, &baked->shade);
    for (size_t i = 0; i < bake->error_count; ++i) {
        vshi_bake_error_add(&bake->errors[i], &baked->errors[i]);
    }
}

/* Bakes lightmaps that are in memory together. */
static vsh_result bake_group(vshi_scene_bake *bake, size_t first, size_t count, vshi_job *tiles,
                             vsh_error *error) {
    double start = vshi_seconds();
    vshi_page_group g;
    vsh_result result;
    VSHI_TRY_DONE(vshi_page_group_open(bake, first, count, &g, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(make_tiles(&g.pages[i], tiles, error));
    }
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(finish_page(&g, &g.pages[i], error));
    }
    if (fixes_seams(&bake->targets[first].receiver)) {
        VSHI_TRY_DONE(stitch(&g, error));
    }
    bake->report.bake_s += vshi_seconds() - start;
    start = vshi_seconds();
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(vshi_write_page(&g.pages[i], error));
        add_to_report(bake, &g.pages[i].baked);
        if (bake->options.done != NULL) {
            bake->options.done(bake->options.user, g.pages[i].target->lightmap);
        }
    }
    bake->report.write_s += vshi_seconds() - start;
done:
    vshi_page_group_close(&g);
    return result;
}

/* Counts lightmaps in a row that are stitched together. */
static size_t count_together(const vshi_scene_bake *bake, size_t first) {
    size_t end = first + 1;
    while (end < bake->target_count && fixes_seams(&bake->targets[first].receiver) &&
           fixes_seams(&bake->targets[end].receiver)) {
        ++end;
    }
    return end - first;
}

/* Bakes lightmaps, or reads them from parts, then finishes and writes them. */
static vsh_result bake_pages(vshi_scene_bake *bake, vsh_error *error) {
    size_t total = 0;
    for (size_t i = 0; i < bake->target_count; ++i) {
        total += vshi_charts_tiles(&bake->targets[i].charts->sorted);
    }
    vshi_job *tiles;
    VSHI_TRY(vshi_job_open(&tiles, &bake->run, "bake", total, "lightmaps", error));
    vsh_result result = VSH_OK;
    for (size_t first = 0, count; first < bake->target_count && result == VSH_OK; first += count) {
        count = count_together(bake, first);
        result = bake_group(bake, first, count, tiles, error);
    }
    vshi_job_end(tiles);
    VSHI_TRY(result);
    vshi_warn_lights(bake, &bake->run);
    return VSH_OK;
}

/* Traces the tiles, or reads them from parts. */
static vsh_result bake_or_merge(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                                bool merges, vsh_bake_report *report, vsh_error *error) {
    VSHI_FLOATS;
    vshi_scene_bake bake;
    int32_t parts = 0;
    vsh_result result;
    VSHI_TRY_DONE(load(&bake, scene, options, run, false, error));
    const bool shard = bake.options.shard > 0 && !merges;
    if (merges) {
        VSHI_TRY_DONE(vshi_parts_find(&bake, &parts, error)); /* early: the rest takes long */
    }
    /* one shard warns of UVs */
    VSHI_TRY_DONE(count_lightmaps(&bake, bake.options.shard <= 1 && !merges, error));
    VSHI_TRY_DONE(merges ? vshi_parts_open(&bake, parts, error) : make_occluders(&bake, error));
    VSHI_TRY_DONE(shard ? vshi_bake_part(&bake, error) : bake_pages(&bake, error));
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

/* The most bytes that lightmaps in memory take, with their charts and tiles at work. */
static double estimate_bytes(const vshi_scene_bake *bake) {
    const vsh_lightmap planes = vshi_channels_shape(&bake->scene);
    double most = 0.0, tracing = 0.0, charts = 0.0;
    for (size_t first = 0, count; first < bake->target_count; first += count) {
        count = count_together(bake, first);
        double bytes = 0.0;
        for (size_t i = first; i < first + count; ++i) {
            const vsh_charts *own = bake->targets[i].charts;
            const bool shared = vshi_ao_is_shared(&bake->scene.shade, own->ao_spacing, bake->layered_ao);
            bytes += vshi_lightmap_bytes(own, &planes, bake->scene.light_count, shared);
            tracing = fmax(tracing, vshi_trace_bytes(own, bake->run.threads));
            charts += (double)own->info.bytes;
        }
        most = fmax(most, bytes);
    }
    return charts + tracing + most;
}

/* Voxels of the scene over those of the trial, on a side; `resolution`: as vshi_scene_resolution(). */
static double find_ratio(const vsh_scene *scene, int32_t resolution, double trial_voxel) {
    if (resolution != VSHI_RESOLUTION_NAMED) {
        return (double)resolution / TRIAL_RESOLUTION;
    }
    return scene->grid.voxel_size > 0.0 ? trial_voxel / scene->grid.voxel_size
                                        : (double)scene->grid.resolution / TRIAL_RESOLUTION;
}

/* Voxels along the longest side of an existing field; 0: there are none. */
static double find_resolution(const vsh_scene *scene, const vsh_occluders *occluders, double voxel_size) {
    vsh_field_info info;
    vsh_field_get_info(occluders->field, &info);
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
    const int32_t resolution = vshi_scene_resolution(&bake->scene, bake->assets, NULL, options.points);
    vsh_scene small = bake->scene;
    if (resolution != 0) { /* else neither the scene nor the trial has voxels */
        small.grid.voxel_size = 0.0;
        small.grid.resolution = TRIAL_RESOLUTION;
    }
    vsh_occluders *occluders = NULL;
    vsh_occluders_info made;
    VSHI_TRY(vsh_scene_occluders(&small, bake->assets, &options, &bake->run, &occluders, error));
    vsh_occluders_get_info(occluders, &made);
    const double ratio = resolution != 0 ? find_ratio(&bake->scene, resolution, made.voxel_size) : 1.0;
    f->resolution = resolution != 0 ? TRIAL_RESOLUTION * ratio
                                    : find_resolution(&bake->scene, occluders, made.voxel_size);
    vsh_occluders_free(occluders);
    f->voxel_size = made.voxel_size / ratio;
    f->voxels = (double)made.active_voxels * ratio * ratio;
    f->grid_bytes = (double)made.grid_bytes * ratio * ratio;
    f->field_bytes = (double)made.field_bytes * ratio * ratio;
    f->has_triangles = made.has_triangles;
    /* the program, its assets and the pages; the trial was part of the peak */
    const double base = fmax(0.0, (double)vshi_peak_bytes() - MAKING * (double)made.grid_bytes);
    const double pages = f->field_bytes + estimate_bytes(bake);
    f->peak_bytes = base + fmax(fmax(MAKING * f->grid_bytes, f->grid_bytes + f->field_bytes), pages);
    if (bake->run.memory_limit > 0) { /* planes over the limit lie in files */
        f->peak_bytes = fmin(f->peak_bytes, (double)bake->run.memory_limit);
    }
    return VSH_OK;
}

vsh_result vsh_forecast_scene(const vsh_scene *scene, const vsh_bake_options *options, const vsh_run *run,
                              vsh_bake_forecast *forecast, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(scene, forecast);
    vshi_scene_bake bake;
    vsh_bake_forecast f = {.lightmap_count = 0};
    vsh_result result;
    VSHI_TRY_DONE(load(&bake, scene, options, run, true, error));
    VSHI_TRY_DONE(count_lightmaps(&bake, false, error));
    VSHI_TRY_DONE(try_few_voxels(&bake, &f, error));
    f.lightmap_count = bake.target_count;
    f.samples = bake.report.samples;
    f.ao_distance = bake.report.ao_distance;
    for (size_t i = 0; i < bake.target_count; ++i) {
        f.texels += bake.lightmaps[i].covered;
    }
    *forecast = f;
done:
    free_bake(&bake);
    return result;
}
