#include "bake_scene/lit_sink.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { AO = VSHI_LIT_AO, LIGHT = VSHI_LIT_LIGHT, PLANES = 4 };

/* What viewers divide the light by that falls on a diffuse surface: light of 1 shows its own colour. */
static const double full_light = 3.14159265358979323846;

bool vshi_lit_previews(const vshi_lit_sink *lit) {
    return lit->job->options.lit_preview != 0 ||
           strcasecmp(vshi_path_ending(lit->lightmap->output), "obj") == 0;
}

/* --- channels */

static size_t page_count(const vshi_lit_sink *lit) {
    return vsh_assets_receiver_pages(lit->job->assets, lit->lightmap->receiver);
}

static void take(vshi_lit_sink *lit, int plane, int32_t channel) {
    lit->sources[plane][lit->source_count[plane]++] = channel;
}

void vshi_lit_find_sources(vshi_lit_sink *lit, const vsh_image *image) {
    static const char *const colors[3] = {"irradiance.R", "irradiance.G", "irradiance.B"};
    memset(lit->source_count, 0, sizeof lit->source_count);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], "ao") == 0) {
            take(lit, AO, c);
        }
        for (int k = 0; k < 3; ++k) {
            if (strcmp(image->names[c], colors[k]) == 0) {
                take(lit, LIGHT + k, c);
            }
        }
    }
    for (int32_t c = 0; c < image->channel_count && lit->source_count[LIGHT + 2] == 0; ++c) {
        if (strncmp(image->names[c], "shadow.", strlen("shadow.")) == 0) {
            take(lit, LIGHT, c);
        }
    }
}

void vshi_lit_sink_scene(vsh_scene *scene) {
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

vsh_result vshi_lit_sink_check(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error) {
    vshi_lit_sink *lit = calloc(1, sizeof *lit);
    if (lit == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", receiver->output);
    }
    vshi_lit_find_sources(lit, image);
    const bool any = lit->source_count[AO] > 0 || lit->source_count[LIGHT] > 0;
    free(lit);
    if (!any) {
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

static void tell_writing(const vsh_bake_job *job, const char *path) {
    if (job->options.writing != NULL) {
        job->options.writing(job->options.user, path);
    }
}

static vsh_result begin_exr(vshi_lit_sink *lit, const vsh_image *image, vsh_error *error) {
    const vsh_bake_job *job = lit->job;
    if (job->options.lit_exr == NULL) {
        return VSH_OK;
    }
    const char *path = lit->exr_path = vshi_target_file(lit->target, page_count(lit), job->options.lit_exr);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", job->options.lit_exr);
    }
    vsh_image_options options = vsh_image_options_default();
    options.attributes = vsh_provenance_attributes(job->provenance, &options.attribute_count);
    tell_writing(job, path);
    return vsh_image_writer_create(path, image, &options, &lit->exr, error);
}

static void free_page(vshi_lit_page *page) {
    for (int p = 0; p < PLANES; ++p) {
        free(page->planes[p]);
        page->planes[p] = NULL;
    }
}

void vshi_lit_pages_free(vsh_bake_job *job) {
    for (size_t i = 0; i < job->lit_page_count; ++i) {
        free_page(&job->lit_pages[i]);
    }
    free(job->lit_pages);
    job->lit_pages = NULL;
    job->lit_page_count = 0;
}

static void free_all(vshi_lit_sink *lit) {
    free_page(&lit->page);
    vsh_image_writer_abandon(lit->exr);
    lit->exr = NULL;
    free(lit->exr_path);
    lit->exr_path = NULL;
    tell_writing(lit->job, NULL);
}

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    vshi_lit_sink *lit = user;
    lit->lightmap = lightmap;
    lit->rows = 0;
    lit->page =
        (vshi_lit_page){.width = image->width, .height = image->height, .object = lit->target->object};
    lit->channel_count = image->channel_count;
    vshi_lit_find_sources(lit, image);
    vsh_result result = begin_exr(lit, image, error);
    for (int p = 0; p < PLANES && result == VSH_OK; ++p) {
        if (lit->source_count[p] > 0) {
            result =
                vshi_allocate((void **)&lit->page.planes[p], (size_t)image->height * (size_t)image->width,
                              sizeof(float), lightmap->output, error);
        }
    }
    if (result != VSH_OK) {
        free_all(lit);
    }
    return result;
}

/* Viewers multiply all light that is baked by the occlusion beside it: light from all around, which AO has
 * dimmed, is given as it was. */
static void open_ambient(vshi_lit_sink *lit, size_t first, size_t count) {
    const vsh_scene *scene = &lit->job->scene;
    const float *ao = lit->page.planes[AO];
    for (int c = 0; c < 3 && ao != NULL && scene->has_ambient && lit->page.planes[LIGHT + c] != NULL; ++c) {
        float *light = lit->page.planes[LIGHT + c];
        for (size_t i = first; i < first + count; ++i) {
            light[i] += (float)scene->ambient[c] * (1.0F - ao[i]);
        }
    }
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    vshi_lit_sink *lit = user;
    const size_t width = (size_t)lit->lightmap->width, count = (size_t)rows * width;
    for (int p = 0; p < PLANES; ++p) {
        if (lit->page.planes[p] == NULL) {
            continue;
        }
        float *to = lit->page.planes[p] + (size_t)lit->rows * width;
        for (size_t i = 0; i < count; ++i) {
            float sum = 0.0F;
            for (int32_t s = 0; s < lit->source_count[p]; ++s) {
                sum += planes[lit->sources[p][s]][i];
            }
            to[i] = sum / (float)lit->source_count[p];
        }
    }
    if (!vshi_lit_previews(lit)) {
        open_ambient(lit, (size_t)lit->rows * width, count);
    }
    lit->rows += rows;
    return lit->exr != NULL ? vsh_image_writer_add(lit->exr, rows, planes, error) : VSH_OK;
}

/* --- the asset */

/* What the image of a lightmap shows: irradiance, or the mean of the shadows times AO. */
static void multiply_by_ao(const vshi_lit_page *page) {
    const size_t count = (size_t)page->height * (size_t)page->width;
    for (size_t i = 0; i < count && page->planes[AO] != NULL && page->planes[LIGHT + 2] == NULL; ++i) {
        page->planes[LIGHT][i] *= page->planes[AO][i];
    }
}

/* Lists the images of a page, at most two. */
static size_t list_images(const vshi_lit_sink *lit, size_t number, vsh_lit_image *images) {
    const vsh_bake_job *job = lit->job;
    const vshi_lit_page *page = &job->lit_pages[number];
    const vsh_receiver *receiver = &job->scene.receivers[lit->lightmap->receiver];
    const bool light = page->planes[LIGHT] != NULL, preview = vshi_lit_previews(lit);
    size_t count = 0;
    if (light && preview) {
        multiply_by_ao(page);
    }
    for (int kind = 0; kind < 2; ++kind) {
        const bool is_light = kind == 1;
        if ((is_light ? !light : page->planes[AO] == NULL) || (preview && is_light != light)) {
            continue;
        }
        images[count++] =
            (vsh_lit_image){.purpose = preview    ? VSH_LIT_PREVIEW
                                       : is_light ? VSH_LIT_LIGHTMAP
                                                  : VSH_LIT_OCCLUSION,
                            .page = (uint32_t)number,
                            .width = page->width,
                            .height = page->height,
                            .channels = (const float *const *)page->planes + (is_light ? LIGHT : AO),
                            .channel_count = is_light && page->planes[LIGHT + 2] != NULL ? 3 : 1,
                            .bits = receiver->bits,
                            .intensity = is_light && !preview ? full_light : 1.0};
    }
    return count;
}

/* Writes the asset, once all pages are there. */
static vsh_result write(const vshi_lit_sink *lit, vsh_error *error) {
    const vsh_bake_job *job = lit->job;
    const vsh_receiver *receiver = &job->scene.receivers[lit->lightmap->receiver];
    const size_t *numbers;
    const vsh_model *model = vsh_assets_receiver_model(job->assets, lit->lightmap->receiver, &numbers);
    vsh_lit_mesh *meshes = NULL;
    vsh_lit_image *images = NULL;
    const char **names = NULL;
    uint32_t *pages = NULL;
    vsh_lit_options options = vsh_lit_options_default();
    vsh_run run = *lit->run;
    run.progress = NULL; /* writing is a stage of the bake's */
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&images, 2 * job->lit_page_count, sizeof *images,
                                lit->lightmap->output, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&names, job->lit_page_count, sizeof *names, lit->lightmap->output, error));
    options.page_names = names;
    options.page_count = job->lit_page_count;
    for (size_t page = 0; page < job->lit_page_count; ++page) {
        names[page] = job->lit_pages[page].object;
        options.image_count += list_images(lit, page, images + options.image_count);
    }
    options.images = images;
    options.image_place = job->options.lit_image_place;
    options.attributes = vsh_provenance_attributes(job->provenance, &options.attribute_count);
    VSHI_TRY_DONE(vshi_lit_list_chart_pages(lit, &options, &pages, error));
    VSHI_TRY_DONE(vshi_lit_list_meshes(lit, model, &meshes, error));
    tell_writing(job, lit->lightmap->output);
    result = vsh_lit_write(receiver->type != VSH_RECEIVER_MESH ? NULL : receiver->path, model, meshes,
                           &options, lit->lightmap->output, &run, error);
done:
    free(pages);
    free(names);
    free(images);
    free(meshes);
    return result;
}

/* Hands a page over to the job, and writes the asset with the last one. */
static vsh_result keep_page(vshi_lit_sink *lit, vsh_error *error) {
    vsh_bake_job *job = lit->job;
    const size_t pages = page_count(lit);
    if (lit->lightmap->page == 0) {
        vshi_lit_pages_free(job);
        VSHI_TRY(vshi_allocate((void **)&job->lit_pages, pages, sizeof *job->lit_pages, lit->lightmap->output,
                               error));
    }
    job->lit_pages[job->lit_page_count++] = lit->page;
    lit->page = (vshi_lit_page){.width = 0};
    if (job->lit_page_count < pages) {
        return VSH_OK;
    }
    const vsh_result result = write(lit, error);
    vshi_lit_pages_free(job);
    return result;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    vshi_lit_sink *lit = user;
    if (result == VSH_OK) {
        result = keep_page(lit, error);
    }
    if (result == VSH_OK && lit->exr != NULL) {
        vsh_image_writer *exr = lit->exr;
        lit->exr = NULL;
        result = vsh_image_writer_finish(exr, error);
    }
    free_all(lit);
    return result;
}

vsh_row_sink vshi_lit_sink_of(vshi_lit_sink *lit) {
    return (vsh_row_sink){sizeof(vsh_row_sink), begin, add, end, lit};
}
