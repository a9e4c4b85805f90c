#include "bake_scene/lit_sink.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

enum { AO = 0, LIGHT = 1, PLANES = 4 };

/* What viewers divide the light by that falls on a diffuse surface: light of 1 shows its own colour. */
static const double full_light = 3.14159265358979323846;

/* --- channels */

static void take(vshi_lit_sink *lit, int plane, int32_t channel) {
    lit->sources[plane][lit->source_count[plane]++] = channel;
}

/* AO, and irradiance or (without it) all shadows. */
static void find_sources(vshi_lit_sink *lit, const vsh_image *image) {
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

vsh_result vshi_lit_sink_check(const vsh_receiver *receiver, const vsh_image *image, vsh_error *error) {
    vshi_lit_sink *lit = calloc(1, sizeof *lit);
    if (lit == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", receiver->output);
    }
    find_sources(lit, image);
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

uint64_t vshi_lit_sink_bytes(int32_t width, int32_t height) {
    const uint64_t texels = (uint64_t)width * (uint64_t)height;
    return texels * (PLANES * sizeof(float) + 8); /* and the images, in the file and before */
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
    vsh_image_options options = vsh_image_options_default();
    options.attributes = vsh_provenance_attributes(job->provenance, &options.attribute_count);
    tell_writing(job, job->options.lit_exr);
    return vsh_image_writer_create(job->options.lit_exr, image, &options, &lit->exr, error);
}

static void free_all(vshi_lit_sink *lit) {
    for (int p = 0; p < PLANES; ++p) {
        free(lit->planes[p]);
        lit->planes[p] = NULL;
    }
    vsh_image_writer_abandon(lit->exr);
    lit->exr = NULL;
    tell_writing(lit->job, NULL);
}

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    vshi_lit_sink *lit = user;
    lit->lightmap = lightmap;
    lit->rows = 0;
    lit->channel_count = image->channel_count;
    find_sources(lit, image);
    vsh_result result = begin_exr(lit, image, error);
    for (int p = 0; p < PLANES && result == VSH_OK; ++p) {
        if (lit->source_count[p] > 0) {
            result = vshi_allocate((void **)&lit->planes[p], (size_t)image->height * (size_t)image->width,
                                   sizeof(float), lightmap->output, error);
        }
    }
    if (result != VSH_OK) {
        free_all(lit);
    }
    return result;
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    vshi_lit_sink *lit = user;
    const size_t width = (size_t)lit->lightmap->width, count = (size_t)rows * width;
    for (int p = 0; p < PLANES; ++p) {
        float *to = lit->planes[p] + (lit->planes[p] != NULL ? (size_t)lit->rows * width : 0);
        for (size_t i = 0; i < count && lit->planes[p] != NULL; ++i) {
            float sum = 0.0F;
            for (int32_t s = 0; s < lit->source_count[p]; ++s) {
                sum += planes[lit->sources[p][s]][i];
            }
            to[i] = sum / (float)lit->source_count[p];
        }
    }
    lit->rows += rows;
    return lit->exr != NULL ? vsh_image_writer_add(lit->exr, rows, planes, error) : VSH_OK;
}

/* --- the asset */

/* What the image of a lightmap shows: irradiance, or the mean of the shadows times AO. */
static void multiply_by_ao(vshi_lit_sink *lit) {
    const size_t count = (size_t)lit->lightmap->height * (size_t)lit->lightmap->width;
    for (size_t i = 0; i < count && lit->planes[AO] != NULL && lit->planes[LIGHT + 2] == NULL; ++i) {
        lit->planes[LIGHT][i] *= lit->planes[AO][i];
    }
}

static size_t list_images(vshi_lit_sink *lit, vsh_lit_image images[2]) {
    const vsh_bake_job *job = lit->job;
    const vsh_receiver *receiver = &job->scene.receivers[lit->lightmap->receiver];
    const bool light = lit->planes[LIGHT] != NULL, preview = job->options.lit_preview != 0;
    size_t count = 0;
    if (light && preview) {
        multiply_by_ao(lit);
    }
    for (int kind = 0; kind < 2; ++kind) {
        const bool is_light = kind == 1;
        if ((is_light ? !light : lit->planes[AO] == NULL) || (preview && is_light != light)) {
            continue;
        }
        images[count++] =
            (vsh_lit_image){.purpose = preview    ? VSH_LIT_PREVIEW
                                       : is_light ? VSH_LIT_LIGHTMAP
                                                  : VSH_LIT_OCCLUSION,
                            .width = lit->lightmap->width,
                            .height = lit->lightmap->height,
                            .channels = (const float *const *)lit->planes + (is_light ? LIGHT : AO),
                            .channel_count = is_light && lit->planes[LIGHT + 2] != NULL ? 3 : 1,
                            .bits = receiver->bits,
                            .intensity = is_light && !preview ? full_light : 1.0};
    }
    return count;
}

/* Which of the model's meshes are lit, in which set. */
static vsh_result list_meshes(const vshi_lit_sink *lit, const vsh_model *model, const size_t *numbers,
                              vsh_lit_mesh **meshes, vsh_error *error) {
    const vsh_receiver *receiver = &lit->job->scene.receivers[lit->lightmap->receiver];
    const size_t count = vsh_model_mesh_count(model);
    VSHI_TRY(vshi_allocate((void **)meshes, count, sizeof **meshes, lit->lightmap->output, error));
    for (size_t i = 0; i < count; ++i) {
        (*meshes)[i].uv_set = -1;
    }
    for (size_t i = 0; i < lit->lightmap->mesh_count; ++i) {
        const int32_t sets = vsh_model_uv_sets(model, numbers[i]);
        const int32_t set = receiver->type == VSH_RECEIVER_HEIGHTFIELD ? 0
                            : receiver->uv_set >= 0                    ? receiver->uv_set
                                                                       : sets > 1;
        (*meshes)[numbers[i]].uv_set = set;
    }
    return VSH_OK;
}

static vsh_result write(vshi_lit_sink *lit, vsh_error *error) {
    const vsh_bake_job *job = lit->job;
    const vsh_receiver *receiver = &job->scene.receivers[lit->lightmap->receiver];
    const size_t *numbers;
    const vsh_model *model = vsh_assets_receiver_model(job->assets, lit->lightmap->receiver, &numbers);
    vsh_lit_mesh *meshes = NULL;
    vsh_lit_image images[2];
    vsh_lit_options options = vsh_lit_options_default();
    options.images = images;
    options.image_count = list_images(lit, images);
    options.image_place = job->options.lit_image_place;
    vsh_run run = *lit->run;
    run.progress = NULL; /* writing is a stage of the bake's */
    vsh_result result = list_meshes(lit, model, numbers, &meshes, error);
    if (result == VSH_OK) {
        tell_writing(job, lit->lightmap->output);
        result = vsh_lit_write(receiver->type == VSH_RECEIVER_HEIGHTFIELD ? NULL : receiver->path, model,
                               meshes, &options, lit->lightmap->output, &run, error);
    }
    free(meshes);
    return result;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    vshi_lit_sink *lit = user;
    if (result == VSH_OK) {
        result = write(lit, error);
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
