/* The UVs that an asset is lit by, of its file or made, and whether it has room for them. */
#include "bake_scene/channels.h"
#include "bake_scene/lit_sink.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <strings.h>

/* A mesh that is lit by the UVs of its file. */
static vsh_lit_mesh mesh_of_file(const vsh_receiver *receiver, const vsh_model *model, size_t number) {
    vsh_lit_mesh mesh = {.uv_set = receiver->uv_set};
    if (receiver->type != VSH_RECEIVER_MESH) {
        mesh.uv_set = 0;
    } else if (receiver->uv_set < 0) {
        mesh.uv_set = vsh_model_uv_sets(model, number) > 1;
    }
    return mesh;
}

static vsh_lit_mesh mesh_of_atlas(const vsh_atlas *atlas, size_t number) {
    const vsh_atlas_mesh mesh = vsh_atlas_mesh_view(atlas, number);
    return (vsh_lit_mesh){.uvs = mesh.uvs,
                          .sources = mesh.sources,
                          .indices = mesh.indices,
                          .charts = mesh.charts,
                          .vertex_count = mesh.vertex_count,
                          .triangle_count = mesh.triangle_count};
}

vsh_result vshi_lit_list_meshes(const vshi_lit_sink *lit, const vsh_model *model, vsh_lit_mesh **meshes,
                                vsh_error *error) {
    const size_t index = lit->lightmap->receiver;
    const vsh_assets *assets = lit->job->assets;
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
            *mesh = atlas != NULL ? mesh_of_atlas(atlas, of_atlas[i])
                                  : mesh_of_file(&lit->job->scene.receivers[index], model, numbers[i]);
            mesh->page = (uint32_t)page; /* read where it has no charts */
        }
    }
    return VSH_OK;
}

vsh_result vshi_lit_list_chart_pages(const vshi_lit_sink *lit, vsh_lit_options *options, uint32_t **pages,
                                     vsh_error *error) {
    const size_t *of_atlas;
    const vsh_atlas *atlas = vsh_assets_receiver_atlas(lit->job->assets, lit->lightmap->receiver, &of_atlas);
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

/* --- room for them */

/* The images that pages are going to have, as far as they are known before: two purposes at most. */
static size_t expect_images(const vshi_lit_sink *lit, size_t pages, vsh_lit_image *images) {
    const bool ao = lit->source_count[VSHI_LIT_AO] > 0, light = lit->source_count[VSHI_LIT_LIGHT] > 0;
    size_t count = 0;
    for (size_t page = 0; page < pages; ++page) {
        if (vshi_lit_previews(lit)) {
            images[count++] = (vsh_lit_image){.purpose = VSH_LIT_PREVIEW, .page = (uint32_t)page};
            continue;
        }
        if (ao) {
            images[count++] = (vsh_lit_image){.purpose = VSH_LIT_OCCLUSION, .page = (uint32_t)page};
        }
        if (light) {
            images[count++] = (vsh_lit_image){.purpose = VSH_LIT_LIGHTMAP, .page = (uint32_t)page};
        }
    }
    return count;
}

static vsh_result check_uvs(const vshi_lit_sink *lit, const vsh_run *run, vsh_error *error) {
    const vsh_job_lightmap *lightmap = lit->lightmap;
    const size_t pages = vsh_assets_receiver_pages(lit->job->assets, lit->lightmap->receiver);
    const size_t *numbers;
    const vsh_model *model = vsh_assets_receiver_model(lit->job->assets, lightmap->receiver, &numbers);
    const vsh_receiver *receiver = &lit->job->scene.receivers[lightmap->receiver];
    const char *path = receiver->type != VSH_RECEIVER_MESH ? NULL : receiver->path;
    vsh_lit_mesh *meshes = NULL;
    vsh_lit_image *images = NULL;
    uint32_t *chart_pages = NULL;
    vsh_lit_options options = vsh_lit_options_default();
    vsh_run quiet = *run;
    quiet.progress = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&images, 2 * pages, sizeof *images, lightmap->output, error));
    options.images = images;
    options.image_count = expect_images(lit, pages, images);
    VSHI_TRY_DONE(vshi_lit_list_chart_pages(lit, &options, &chart_pages, error));
    VSHI_TRY_DONE(vshi_lit_list_meshes(lit, model, &meshes, error));
    result = vsh_lit_check_uvs(path, model, meshes, &options, &quiet, error);
done:
    free(chart_pages);
    free(images);
    free(meshes);
    return result;
}

static vsh_result check_receiver(vsh_bake_job *job, size_t index, const vsh_run *run, vsh_error *error) {
    const vsh_receiver *receiver = &job->scene.receivers[index];
    const vsh_job_lightmap lightmap = {.receiver = index, .output = receiver->output};
    const size_t *numbers;
    if (vsh_assets_receiver_atlas(job->assets, index, &numbers) == NULL ||
        strcasecmp(vshi_path_ending(receiver->output), "obj") == 0) {
        return VSH_OK; /* no set is made, or (OBJ) there is one alone */
    }
    vshi_channels channels = {.value_count = 0};
    vshi_lit_sink *lit = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&lit, 1, sizeof *lit, lightmap.output, error));
    VSHI_TRY_DONE(vshi_channels_name(&job->scene, receiver->width, receiver->height, &channels, error));
    lit->job = job;
    lit->lightmap = &lightmap;
    vshi_lit_find_sources(lit, &channels.image);
    result = check_uvs(lit, run, error);
done:
    vshi_channels_free(&channels);
    free(lit);
    return result;
}

vsh_result vshi_lit_check_uvs(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    for (size_t i = 0; i < job->scene.receiver_count && job->options.sink == NULL; ++i) {
        if (vsh_lit_is_output(job->scene.receivers[i].output)) {
            VSHI_TRY(check_receiver(job, i, run, error));
        }
    }
    return VSH_OK;
}
