/* vsh_lit_write(): its checks and its steps. */
#include "io/lit/work.h"

#include "base/file.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* --- checking arguments */

static vsh_result fail_mesh(size_t index, const char *what, size_t place, size_t value, size_t limit,
                            vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_mesh %zu: %s[%zu] is %zu, expected below %zu", index,
                     what, place, value, limit);
}

static vsh_result check_triangles(const vsh_lit_mesh *lit, size_t index, const vsh_mesh *mesh,
                                  vsh_error *error) {
    for (size_t i = 0; i < 3 * lit->triangle_count; ++i) {
        if (lit->indices[i] >= lit->vertex_count) {
            return fail_mesh(index, "indices", i, lit->indices[i], lit->vertex_count, error);
        }
        if (lit->sources[lit->indices[i]] != mesh->indices[i]) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "vsh_lit_mesh %zu: corner %zu is a copy of vertex %u, but the model's is %u",
                             index, i, lit->sources[lit->indices[i]], mesh->indices[i]);
        }
    }
    return VSH_OK;
}

static vsh_result check_charts(const vshi_lit_work *work, const vsh_lit_mesh *lit, size_t index,
                               vsh_error *error) {
    if (lit->charts == NULL && lit->page >= work->page_count) {
        return fail_mesh(index, "page", 0, lit->page, work->page_count, error);
    }
    for (size_t t = 0; lit->charts != NULL && t < lit->triangle_count; ++t) {
        if (lit->charts[t] != VSH_NO_CHART && lit->charts[t] >= work->options->chart_count) {
            return fail_mesh(index, "charts", t, lit->charts[t], work->options->chart_count, error);
        }
    }
    return VSH_OK;
}

/* Checks the caller's arrays for the model's mesh `index`. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result check_mesh(const vshi_lit_work *work, size_t index, vsh_error *error) {
    const vsh_lit_mesh *lit = &work->meshes[index];
    const vsh_mesh mesh = vsh_model_mesh(work->model, index, 0);
    if (lit->uvs == NULL) {
        if (lit->uv_set < -1 || lit->uv_set >= VSH_MAX_UV_SETS || lit->charts != NULL) {
            return vshi_fail(
                error, VSH_ERROR_ARGUMENT,
                "vsh_lit_mesh %zu: without uvs, uv_set is %d and charts are %sgiven, expected -1 "
                "to %d and none",
                index, lit->uv_set, lit->charts != NULL ? "" : "not ", VSH_MAX_UV_SETS - 1);
        }
        return lit->uv_set < 0 ? VSH_OK : check_charts(work, lit, index, error);
    }
    VSHI_NEEDS(lit->sources);
    VSHI_NEEDS(lit->indices);
    if (lit->triangle_count != mesh.triangle_count || lit->vertex_count > UINT32_MAX) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_lit_mesh %zu: %zu triangles of %zu vertices, but the model's mesh has %zu "
                         "triangles",
                         index, lit->triangle_count, lit->vertex_count, mesh.triangle_count);
    }
    for (size_t v = 0; v < lit->vertex_count; ++v) {
        if (lit->sources[v] >= mesh.vertex_count) {
            return fail_mesh(index, "sources", v, lit->sources[v], mesh.vertex_count, error);
        }
        if (!isfinite(lit->uvs[2 * v]) || !isfinite(lit->uvs[2 * v + 1])) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_mesh %zu: uvs[%zu] are (%g, %g)", index, v,
                             (double)lit->uvs[2 * v], (double)lit->uvs[2 * v + 1]);
        }
    }
    VSHI_TRY(check_triangles(lit, index, &mesh, error));
    return check_charts(work, lit, index, error);
}

/* --- images */

static vsh_result check_image(const vsh_lit_image *image, size_t index, vsh_error *error) {
    static const unsigned char magic[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if ((uint32_t)image->purpose >= VSHI_LIT_PURPOSES || image->page >= UINT16_MAX ||
        !(image->intensity >= 0.0 && image->intensity < 1e30)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_image %zu: purpose %d, page %u, intensity %g",
                         index, image->purpose, image->page, image->intensity);
    }
    if (image->png != NULL) {
        return image->png_size > sizeof magic && memcmp(image->png, magic, sizeof magic) == 0
                   ? VSH_OK
                   : vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_image %zu: its bytes are no PNG", index);
    }
    if (image->width < 1 || image->height < 1 || image->width > 65536 || image->height > 65536 ||
        (image->channel_count != 1 && image->channel_count != 3) ||
        (image->bits != 0 && image->bits != 8 && image->bits != 16)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "vsh_lit_image %zu: %d × %d, %d channels of %d bits, expected 1 to 65536, 1 or 3, 8 "
                         "or 16",
                         index, image->width, image->height, image->channel_count, image->bits);
    }
    VSHI_NEEDS(image->channels);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        VSHI_NEEDS(image->channels[c]);
    }
    return VSH_OK;
}

static bool is_file_name(const char *name) {
    const size_t size = strlen(name);
    bool good = size > 0 && size <= VSHI_LIT_NAME_BYTES;
    for (size_t i = 0, length; i < size && good; i += length) {
        length = vshi_utf8_length(name + i);
        good = length > 0 && (unsigned char)name[i] >= ' ' && strchr("/\\\x7f", name[i]) == NULL;
    }
    return good;
}

static vsh_result check_images(const vsh_lit_options *options, vsh_error *error) {
    VSHI_NEEDS_OF(options->image_count, options->images);
    VSHI_NEEDS_OF(options->chart_count, options->chart_pages);
    for (size_t i = 0; i < options->image_count; ++i) {
        VSHI_TRY(check_image(&options->images[i], i, error));
        for (size_t k = 0; k < i; ++k) {
            if (options->images[k].purpose == options->images[i].purpose &&
                options->images[k].page == options->images[i].page) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT,
                                 "vsh_lit_image %zu: page %u has one of purpose %d already", i,
                                 options->images[i].page, options->images[i].purpose);
            }
        }
    }
    VSHI_NEEDS_OF(options->page_count, options->page_names);
    for (size_t i = 0; i < options->page_count; ++i) {
        const char *name = options->page_names[i];
        if (name != NULL && !is_file_name(name)) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "vsh_lit_options.page_names[%zu]: is not UTF-8, has a character that file "
                             "names cannot have, or is empty or longer than %d bytes",
                             i, VSHI_LIT_NAME_BYTES);
        }
    }
    for (size_t c = 0; c < options->chart_count; ++c) {
        if (options->chart_pages[c] >= UINT16_MAX) {
            return fail_mesh(c, "chart_pages", c, options->chart_pages[c], UINT16_MAX, error);
        }
    }
    return VSH_OK;
}

/* Refuses images that an OBJ cannot show. */
static vsh_result check_obj(const vshi_lit_work *work, vsh_error *error) {
    const vsh_lit_options *options = work->options;
    for (size_t i = 0; i < options->image_count; ++i) {
        if (options->images[i].purpose != VSH_LIT_PREVIEW) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT,
                             "%s: image %zu: materials of an OBJ show a preview, and no other image",
                             work->output, i);
        }
    }
    return VSH_OK;
}

/* --- provenance in the extras of the asset */

static const char OURS[] = "vdbshade_";

/* Removes the notes of an earlier bake. */
static void remove_notes(json_t *extras) {
    const char *key;
    json_t *value;
    void *next;
    json_object_foreach_safe(extras, next, key, value) {
        if (strncmp(key, OURS, sizeof OURS - 1) == 0) {
            json_object_del(extras, key);
        }
    }
}

/* Adds the options' attributes to the extras of the asset. */
static vsh_result add_origin(vshi_lit_work *work, vsh_error *error) {
    const vsh_lit_options *options = work->options;
    json_t *asset, *extras;
    if (options->attribute_count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_lit_find_object(work, work->gltf.root, "asset", &asset, error));
    extras = json_object_get(asset, "extras");
    if (extras != NULL && !json_is_object(extras)) {
        return VSH_OK; /* another program's, of another kind */
    }
    VSHI_TRY(vshi_lit_find_object(work, asset, "extras", &extras, error));
    remove_notes(extras);
    for (size_t i = 0; i < options->attribute_count; ++i) {
        const vsh_attribute *one = &options->attributes[i];
        vshi_lit_set(work, extras, one->name, vshi_lit_text(one->value));
    }
    return VSH_OK;
}

int32_t vsh_lit_is_output(const char *path) {
    return path != NULL && (vshi_is_gltf(path) || vshi_lit_is_obj(path)) ? 1 : 0;
}

/* --- resolving options */

/* Lights each mesh by the set that vsh_model_mesh() chooses for -1, on page 0. */
static vsh_result make_default_meshes(const vsh_model *model, vsh_lit_mesh **meshes, vsh_error *error) {
    const size_t count = vsh_model_mesh_count(model);
    VSHI_TRY(vshi_allocate((void **)meshes, count, sizeof **meshes, "a lit model", error));
    for (size_t i = 0; i < count; ++i) {
        const int32_t set = vsh_model_uv_sets(model, i) > 1 ? 1 : 0;
        (*meshes)[i].uv_set = vsh_model_mesh(model, i, set).uvs != NULL ? set : -1;
    }
    return VSH_OK;
}

static vsh_result count_pages(vshi_lit_work *work, vsh_error *error) {
    const vsh_lit_options *options = work->options;
    size_t most = 0;
    for (size_t i = 0; i < options->image_count; ++i) {
        most = options->images[i].page > most ? options->images[i].page : most;
    }
    for (size_t i = 0; i < options->chart_count; ++i) {
        most = options->chart_pages[i] > most ? options->chart_pages[i] : most;
    }
    for (size_t i = 0; i < vsh_model_mesh_count(work->model); ++i) {
        const vsh_lit_mesh *mesh = &work->meshes[i];
        const bool placed = mesh->charts == NULL && (mesh->uvs != NULL || mesh->uv_set >= 0);
        if (placed && mesh->page >= UINT16_MAX) {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_lit_mesh %zu: page is %u, expected below %d", i,
                             mesh->page, UINT16_MAX);
        }
        most = placed && mesh->page > most ? mesh->page : most;
    }
    work->page_count = most + 1;
    return VSH_OK;
}

static vsh_result check_output(const vshi_lit_work *work, vsh_error *error) {
    if (!vsh_lit_is_output(work->output)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: expected a name that ends in .glb, .gltf or .obj",
                         work->output);
    }
    if (vshi_lit_is_obj(work->output)) {
        VSHI_TRY(check_obj(work, error));
    }
    VSHI_TRY(vshi_output_check(work->output, error));
    VSHI_TRY(check_images(work->options, error));
    return vshi_attributes_check(work->output, work->options->attributes, work->options->attribute_count,
                                 error);
}

/* --- making the document */

/* Only meshes with new UVs or colours need Draco's data. */
static bool has_new_values(const vshi_lit_work *work) {
    for (size_t i = 0; i < vsh_model_mesh_count(work->model); ++i) {
        if (work->meshes[i].uvs != NULL || work->meshes[i].colors != NULL) {
            return true;
        }
    }
    return false;
}

static vsh_result make_document(vshi_lit_work *work, vsh_error *error) {
    const char *path = work->model_path;
    const bool obj = vshi_lit_is_obj(work->output);
    if (path != NULL && vshi_lit_is_same_file(path, work->output)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "%s: the output is the input", work->output);
    }
    if (path == NULL || !vshi_is_gltf(path) || obj) {
        VSHI_TRY(vshi_lit_begin(work, error));
        return obj ? VSH_OK : vshi_lit_from_model(work, error);
    }
    VSHI_TRY(vshi_lit_open(work, error));
    if (has_new_values(work)) {
        VSHI_TRY(vshi_lit_read_dracos(work, error));
    }
    VSHI_TRY(vshi_lit_check_materials(work, error));
    return vshi_lit_make_nodes(work, error);
}

static vsh_result write_all(vshi_lit_work *work, vsh_error *error) {
    vshi_lit_besides besides = {NULL, 0};
    const bool glb = strcasecmp(vshi_path_ending(work->output), "glb") == 0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_check_limit(work->gltf.run, (double)(work->page_count + 1) * sizeof *work->pages,
                                   work->output, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&work->pages, work->page_count + 1, sizeof *work->pages, "pages", error));
    work->pages[work->page_count].unlit = work->options->unlit != 0;
    VSHI_TRY_DONE(make_document(work, error));
    VSHI_TRY_DONE(vshi_lit_add_images(work, glb, &besides, error));
    if (!vshi_lit_is_obj(work->output)) {
        VSHI_TRY_DONE(vshi_lit_apply_materials(work, error));
        VSHI_TRY_DONE(vshi_lit_prune(work, error));
        VSHI_TRY_DONE(vshi_lit_bring_images(work, error)); /* fewer, once pruned */
        VSHI_TRY_DONE(add_origin(work, error));
    }
    result = work->refused ? vshi_fail_memory(error, work->gltf.path)
                           : vshi_lit_write_files(work, &besides, error);
done:
    vshi_lit_besides_free(&besides);
    return result;
}

/* --- the call */

vsh_result vsh_lit_write(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                         const vsh_lit_options *options, const char *output, const vsh_run *run,
                         vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS_BOTH(model, output);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_lit_options own = vsh_lit_options_default();
    VSHI_TRY(vshi_options_resolve(options, &own, sizeof own, "vsh_lit_options", error));
    vsh_lit_mesh *made = NULL;
    const size_t count = vsh_model_mesh_count(model);
    if (meshes == NULL) {
        VSHI_TRY(make_default_meshes(model, &made, error));
    }
    vshi_lit_work work = {.model = model,
                          .model_path = path,
                          .meshes = meshes != NULL ? meshes : made,
                          .options = &own,
                          .output = output,
                          .gltf = {.path = path != NULL ? path : output, .run = &full}};
    vsh_result result;
    VSHI_TRY_DONE(check_output(&work, error));
    VSHI_TRY_DONE(count_pages(&work, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(check_mesh(&work, i, error));
    }
    VSHI_TRY_DONE(vshi_job_open(&work.gltf.job, &full, "lit", count + 1, "a lit model", error));
    VSHI_TRY_DONE(write_all(&work, error));
    vshi_job_advance(work.gltf.job, 1); /* all is written: too late to stop */
done:
    vshi_job_end(work.gltf.job);
    vshi_lit_work_free(&work);
    free(made);
    return result;
}
