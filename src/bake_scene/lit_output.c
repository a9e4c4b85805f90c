#include "bake_scene/bake_scene.h"

#include "base/file.h"
#include "base/memory.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Planes of a page: light has one or three. */
enum { AO = 0, LIGHT = 1, PLANES = 4 };

/* Viewers divide the light on a diffuse surface by this, so light of 1 shows the surface's own colour. */
static const double full_light = 3.14159265358979323846;

static bool previews(const vshi_lit_output *lit) {
    return lit->bake->options.lit_preview != 0 ||
           strcasecmp(vshi_path_ending(lit->lightmap->output), "obj") == 0;
}

/* --- channels */

static size_t page_count(const vshi_lit_output *lit) {
    return vsh_assets_receiver_pages(lit->bake->assets, lit->lightmap->receiver);
}

static void add_source(vshi_lit_output *lit, int plane, int32_t channel) {
    lit->first_source[plane] = lit->source_count[plane]++ == 0 ? channel : lit->first_source[plane];
}

/* Finds the channels that make planes: AO, and irradiance or else shadows, which follow each other. */
static void find_sources(vshi_lit_output *lit, const vsh_image *image) {
    static const char *const colors[3] = {"irradiance.R", "irradiance.G", "irradiance.B"};
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], "ao") == 0) {
            add_source(lit, AO, c);
        }
        for (int k = 0; k < 3; ++k) {
            if (strcmp(image->names[c], colors[k]) == 0) {
                add_source(lit, LIGHT + k, c);
            }
        }
    }
    for (int32_t c = 0; c < image->channel_count && lit->source_count[LIGHT + 2] == 0; ++c) {
        if (strncmp(image->names[c], "shadow.", strlen("shadow.")) == 0) {
            add_source(lit, LIGHT, c);
        }
    }
}

void vshi_lit_output_scene(vsh_scene *scene) {
    for (size_t i = 0; i < scene->receiver_count; ++i) {
        if (!vsh_lit_is_output(scene->receivers[i].output)) {
            return;
        }
    }
    if (scene->light_count == 0) {
        return;
    }
    scene->irradiance = 1;
    for (int c = 0; c < 3 && scene->has_ambient == 0; ++c) {
        scene->ambient[c] = VSHI_LIT_AMBIENT;
    }
    scene->has_ambient = 1;
}

vsh_result vshi_lit_output_check(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error) {
    vshi_lit_output lit = {.bake = NULL};
    find_sources(&lit, image);
    if (lit.source_count[AO] == 0 && lit.source_count[LIGHT] == 0) {
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

/* --- rows */

static vsh_result begin_exr(vshi_lit_output *lit, const vsh_image *image, vsh_error *error) {
    const vshi_scene_bake *bake = lit->bake;
    if (bake->options.lit_exr == NULL) {
        return VSH_OK;
    }
    const char *path = lit->exr_path = vshi_target_file(lit->target, page_count(lit), bake->options.lit_exr);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", bake->options.lit_exr);
    }
    vsh_image_options options = vsh_image_options_default();
    options.attributes = vsh_provenance_attributes(bake->provenance, &options.attribute_count);
    return vsh_image_writer_create(path, image, &options, &lit->exr, error);
}

static void free_page(vshi_lit_page *page) {
    for (int p = 0; p < PLANES; ++p) {
        free(page->planes[p]);
        page->planes[p] = NULL;
    }
}

void vshi_lit_pages_free(vshi_scene_bake *bake) {
    for (size_t i = 0; i < bake->lit_page_count; ++i) {
        free_page(&bake->lit_pages[i]);
    }
    free(bake->lit_pages);
    bake->lit_pages = NULL;
    bake->lit_page_count = 0;
}

void vshi_lit_output_close(vshi_lit_output *lit) {
    free_page(&lit->page);
    vsh_image_writer_abandon(lit->exr);
    free(lit->exr_path);
    *lit = (vshi_lit_output){.bake = NULL};
}

vsh_result vshi_lit_output_open(vshi_lit_output *lit, const vshi_scene_page *page, vsh_error *error) {
    const vsh_image *image = &page->channels.image;
    *lit = (vshi_lit_output){.bake = page->bake, .target = page->target, .lightmap = page->lightmap};
    lit->page =
        (vshi_lit_page){.width = image->width, .height = image->height, .object = lit->target->object};
    find_sources(lit, image);
    VSHI_TRY(begin_exr(lit, image, error));
    for (int p = 0; p < PLANES; ++p) {
        if (lit->source_count[p] > 0) {
            VSHI_TRY(vshi_allocate((void **)&lit->page.planes[p],
                                   (size_t)image->height * (size_t)image->width, sizeof(float),
                                   page->lightmap->output, error));
        }
    }
    return VSH_OK;
}

/* Viewers multiply all light that is baked by the occlusion beside it: light from all around, which AO has
 * dimmed, is given as it was. */
static void open_ambient(vshi_lit_output *lit, size_t first, size_t count) {
    const vsh_scene *scene = &lit->bake->scene;
    const float *ao = lit->page.planes[AO];
    for (int c = 0; c < 3 && ao != NULL && scene->has_ambient && lit->page.planes[LIGHT + c] != NULL; ++c) {
        float *light = lit->page.planes[LIGHT + c];
        for (size_t i = first; i < first + count; ++i) {
            light[i] += (float)scene->ambient[c] * (1.0F - ao[i]);
        }
    }
}

vsh_result vshi_lit_output_add(vshi_lit_output *lit, int32_t rows, const float *const *planes,
                               vsh_error *error) {
    const size_t width = (size_t)lit->lightmap->width, count = (size_t)rows * width;
    for (int p = 0; p < PLANES; ++p) {
        if (lit->page.planes[p] == NULL) {
            continue;
        }
        float *to = lit->page.planes[p] + (size_t)lit->rows * width;
        for (size_t i = 0; i < count; ++i) {
            float sum = 0.0F;
            for (int32_t s = 0; s < lit->source_count[p]; ++s) {
                sum += planes[lit->first_source[p] + s][i];
            }
            to[i] = sum / (float)lit->source_count[p];
        }
    }
    if (!previews(lit)) {
        open_ambient(lit, (size_t)lit->rows * width, count);
    }
    lit->rows += rows;
    return lit->exr != NULL ? vsh_image_writer_add(lit->exr, rows, planes, error) : VSH_OK;
}

/* --- UVs */

static vsh_lit_mesh mesh_of_atlas(const vsh_atlas *atlas, size_t number) {
    const vsh_atlas_mesh mesh = vsh_atlas_mesh_view(atlas, number);
    return (vsh_lit_mesh){.uvs = mesh.uvs,
                          .sources = mesh.sources,
                          .indices = mesh.indices,
                          .charts = mesh.charts,
                          .vertex_count = mesh.vertex_count,
                          .triangle_count = mesh.triangle_count};
}

static vsh_result list_meshes(const vshi_lit_output *lit, const vsh_model *model, vsh_lit_mesh **meshes,
                              vsh_error *error) {
    const size_t index = lit->lightmap->receiver;
    const vsh_assets *assets = lit->bake->assets;
    const vsh_receiver *receiver = &lit->bake->scene.receivers[index];
    const size_t *numbers, *of_atlas;
    size_t count;
    vsh_assets_receiver_model(assets, index, &numbers);
    const vsh_atlas *atlas = vsh_assets_receiver_atlas(assets, index, &of_atlas);
    const size_t all = vsh_model_mesh_count(model);
    VSHI_TRY(vshi_allocate((void **)meshes, all, sizeof **meshes, lit->lightmap->output, error));
    for (size_t i = 0; i < all; ++i) {
        (*meshes)[i].uv_set = -1;
    }
    for (size_t page = 0; page < vsh_assets_receiver_pages(assets, index); ++page) {
        size_t first;
        vsh_assets_receiver_page(assets, index, page, &first, &count);
        for (size_t i = first; i < first + count; ++i) {
            vsh_lit_mesh *mesh = &(*meshes)[numbers[i]];
            *mesh = atlas != NULL                         ? mesh_of_atlas(atlas, of_atlas[i])
                    : receiver->type != VSH_RECEIVER_MESH ? (vsh_lit_mesh){.uv_set = 0}
                    : receiver->uv_set >= 0
                        ? (vsh_lit_mesh){.uv_set = receiver->uv_set}
                        : (vsh_lit_mesh){.uv_set = vsh_model_uv_sets(model, numbers[i]) > 1};
            mesh->page = (uint32_t)page; /* read where it has no charts */
        }
    }
    return VSH_OK;
}

static vsh_result list_chart_pages(const vshi_lit_output *lit, vsh_lit_options *options, uint32_t **pages,
                                   vsh_error *error) {
    const size_t *of_atlas;
    const vsh_atlas *atlas = vsh_assets_receiver_atlas(lit->bake->assets, lit->lightmap->receiver, &of_atlas);
    *pages = NULL;
    if (atlas == NULL) {
        return VSH_OK;
    }
    options->chart_count = vsh_atlas_chart_count(atlas);
    VSHI_TRY(
        vshi_allocate((void **)pages, options->chart_count, sizeof **pages, lit->lightmap->output, error));
    for (size_t i = 0; i < options->chart_count; ++i) {
        (*pages)[i] = vsh_atlas_charts(atlas)[i].page;
    }
    options->chart_pages = *pages;
    return VSH_OK;
}

/* --- the asset */

/* Previews show irradiance, or the mean of the shadows times AO. */
static void multiply_by_ao(const vshi_lit_page *page) {
    const size_t count = (size_t)page->height * (size_t)page->width;
    for (size_t i = 0; i < count && page->planes[AO] != NULL && page->planes[LIGHT + 2] == NULL; ++i) {
        page->planes[LIGHT][i] *= page->planes[AO][i];
    }
}

/* Lists the images of a page, at most two. `page` NULL: it is not baked yet. */
static size_t list_images(const vshi_lit_output *lit, size_t number, const vshi_lit_page *page,
                          vsh_lit_image *images) {
    static const vshi_lit_page unknown;
    const bool light = lit->source_count[LIGHT] > 0, preview = previews(lit);
    size_t count = 0;
    page = page != NULL ? page : &unknown;
    if (light && preview) {
        multiply_by_ao(page);
    }
    for (int kind = AO; kind <= LIGHT; ++kind) {
        const bool is_light = kind == LIGHT;
        if (lit->source_count[kind] == 0 || (preview && is_light != light)) {
            continue;
        }
        images[count++] =
            (vsh_lit_image){.purpose = preview    ? VSH_LIT_PREVIEW
                                       : is_light ? VSH_LIT_LIGHTMAP
                                                  : VSH_LIT_OCCLUSION,
                            .page = (uint32_t)number,
                            .width = page->width,
                            .height = page->height,
                            .channels = (const float *const *)page->planes + kind,
                            .channel_count = is_light && page->planes[LIGHT + 2] != NULL ? 3 : 1,
                            .bits = lit->bake->scene.receivers[lit->lightmap->receiver].bits,
                            .intensity = is_light && !preview ? full_light : 1.0};
    }
    return count;
}

/* Writes the asset, once all pages are there; or before, checks that it has room for their UVs. */
static vsh_result write(const vshi_lit_output *lit, bool check, vsh_error *error) {
    const vshi_scene_bake *bake = lit->bake;
    const char *output = lit->lightmap->output;
    const vsh_receiver *receiver = &bake->scene.receivers[lit->lightmap->receiver];
    const char *path = receiver->type != VSH_RECEIVER_MESH ? NULL : receiver->path;
    const size_t count = page_count(lit), *numbers;
    const vsh_model *model = vsh_assets_receiver_model(bake->assets, lit->lightmap->receiver, &numbers);
    vsh_lit_mesh *meshes = NULL;
    vsh_lit_image *images = NULL;
    const char **names = NULL;
    uint32_t *chart_pages = NULL;
    vsh_lit_options options = vsh_lit_options_default();
    vsh_run run = bake->run;
    run.progress = NULL; /* writing is a stage of the bake's */
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&images, 2 * count, sizeof *images, output, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&names, count, sizeof *names, output, error));
    for (size_t i = 0; i < count; ++i) {
        const vshi_lit_page *page = check ? NULL : &bake->lit_pages[i];
        names[i] = check ? NULL : page->object;
        options.image_count += list_images(lit, i, page, images + options.image_count);
    }
    options.images = images;
    VSHI_TRY_DONE(list_chart_pages(lit, &options, &chart_pages, error));
    VSHI_TRY_DONE(list_meshes(lit, model, &meshes, error));
    if (check) {
        result = vsh_lit_check_uvs(path, model, meshes, &options, &run, error);
    } else {
        options.page_names = names;
        options.page_count = count;
        options.attributes = vsh_provenance_attributes(bake->provenance, &options.attribute_count);
        result = vsh_lit_write(path, model, meshes, &options, output, &run, error);
    }
done:
    free(chart_pages);
    free(names);
    free(images);
    free(meshes);
    return result;
}

/* Hands a page over to the bake, and writes the asset with the last one. */
static vsh_result keep_page(vshi_lit_output *lit, vsh_error *error) {
    vshi_scene_bake *bake = lit->bake;
    const size_t pages = page_count(lit);
    if (lit->lightmap->page == 0) {
        vshi_lit_pages_free(bake);
        VSHI_TRY(vshi_allocate((void **)&bake->lit_pages, pages, sizeof *bake->lit_pages,
                               lit->lightmap->output, error));
    }
    bake->lit_pages[bake->lit_page_count++] = lit->page;
    lit->page = (vshi_lit_page){.width = 0};
    if (bake->lit_page_count < pages) {
        return VSH_OK;
    }
    const vsh_result result = write(lit, false, error);
    vshi_lit_pages_free(bake);
    return result;
}

vsh_result vshi_lit_output_finish(vshi_lit_output *lit, vsh_error *error) {
    VSHI_TRY(keep_page(lit, error));
    vsh_image_writer *exr = lit->exr;
    lit->exr = NULL;
    return exr != NULL ? vsh_image_writer_finish(exr, error) : VSH_OK;
}

/* --- room for the UVs */

static vsh_result check_receiver(vshi_scene_bake *bake, size_t index, vsh_error *error) {
    const vsh_receiver *receiver = &bake->scene.receivers[index];
    const vsh_scene_lightmap lightmap = {.receiver = index, .output = receiver->output};
    const size_t *numbers;
    if (vsh_assets_receiver_atlas(bake->assets, index, &numbers) == NULL ||
        strcasecmp(vshi_path_ending(receiver->output), "obj") == 0) {
        return VSH_OK; /* no set is made, or (OBJ) there is one alone */
    }
    vshi_channels channels;
    vshi_lit_output lit = {.bake = bake, .lightmap = &lightmap};
    vsh_result result = vshi_channels_name(&bake->scene, receiver->width, receiver->height, &channels, error);
    if (result == VSH_OK) {
        find_sources(&lit, &channels.image);
        result = write(&lit, true, error);
    }
    vshi_channels_free(&channels);
    return result;
}

vsh_result vshi_lit_check_uvs(vshi_scene_bake *bake, vsh_error *error) {
    for (size_t i = 0; i < bake->scene.receiver_count && bake->options.rows == NULL; ++i) {
        if (vsh_lit_is_output(bake->scene.receivers[i].output)) {
            VSHI_TRY(check_receiver(bake, i, error));
        }
    }
    return VSH_OK;
}
