/* A model in a page: the file itself where the page's script reads it, else its arrays. */
#include "view/parts.h"

#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"
#include "base/uri.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Geometry that the script does not decompress. */
static const char *const compressed[] = {"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                         "KHR_meshopt_compression"};

static bool uses(const json_t *root, const char *extension) {
    size_t i;
    const json_t *used;
    json_array_foreach(json_object_get(root, "extensionsUsed"), i, used) {
        const char *name = json_string_value(used);
        if (name != NULL && strcmp(name, extension) == 0) {
            return true;
        }
    }
    return false;
}

/* Of what has been lit, the rest may be compressed: the page then leaves that out, and not the light. */
static bool is_compressed(const json_t *root) {
    for (size_t k = 0; k < sizeof compressed / sizeof compressed[0]; ++k) {
        if (uses(root, compressed[k])) {
            return !uses(root, "MOZ_lightmap");
        }
    }
    return false;
}

static vsh_result fail_to_read(const char *path, FILE *file, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path,
                     ferror(file) ? strerror(errno) : "it became shorter while it was read");
}

/* The bytes of a file, in a data block. */
static vsh_result put_file(vshi_view *view, vshi_job *job, FILE *file, uint64_t size, const char *path,
                           vsh_error *error) {
    enum { PIECE = 3 << 12 };
    char piece[PIECE];
    vshi_page_data_begin(view->page, VSHI_VIEW_BLOCK, view->blocks++);
    for (uint64_t left = size; left > 0;) {
        const size_t now = left < PIECE ? (size_t)left : PIECE;
        if (fread(piece, 1, now, file) != now) {
            return fail_to_read(path, file, error);
        }
        vshi_page_data(view->page, piece, now);
        left -= now;
        VSHI_TRY(vshi_view_advance(view, job, now, error));
    }
    vshi_page_data_end(view->page);
    return VSH_OK;
}

/* A file that a glTF names, put into the page; one that cannot be had is told of in a warning. */
static vsh_result put_named(vshi_view *view, vshi_job *job, const char *model, const char *uri, json_t *files,
                            vsh_error *error) {
    char *path = vshi_uri_path(model, uri);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", model);
    }
    FILE *file = NULL;
    uint64_t size;
    vsh_error why;
    vsh_result result = VSH_OK;
    if (!view->run->allow_outside && !vshi_input_is_beside(model, path)) {
        vshi_warn(view->run,
                  "%s: '%s' is outside of its folder and not in the page; --allow-outside reads it", model,
                  uri);
    } else if (vshi_input_open(path, path, VSH_MAX_VIEW_MODEL, &file, &size, &why) != VSH_OK) {
        vshi_warn(view->run, "%s: is not in the page: %s", model, why.message);
    } else {
        char block[32];
        snprintf(block, sizeof block, VSHI_VIEW_BLOCK "%zu", view->blocks);
        VSHI_TRY_DONE(put_file(view, job, file, size, path, error));
        result = vshi_view_tell(files, NULL,
                                json_pack("{s:o, s:s}", "uri", vshi_view_text(uri), "data", block), error);
    }
done:
    if (file != NULL) {
        fclose(file);
    }
    free(path);
    return result;
}

static vsh_result put_all_named(vshi_view *view, vshi_job *job, const char *model, const json_t *root,
                                json_t *about, vsh_error *error) {
    static const char *const lists[] = {"buffers", "images"};
    json_t *files = json_array();
    vsh_result result = VSH_OK;
    for (size_t k = 0; k < sizeof lists / sizeof lists[0] && result == VSH_OK; ++k) {
        size_t i;
        const json_t *item;
        json_array_foreach(json_object_get(root, lists[k]), i, item) {
            const char *uri = json_string_value(json_object_get(item, "uri"));
            if (uri != NULL && !vshi_uri_is_data(uri) && !vshi_uri_is_remote(uri)) {
                VSHI_TRY_DONE(put_named(view, job, model, uri, files, error));
            }
        }
    }
done:
    return result == VSH_OK ? vshi_view_tell(about, "files", files, error) : (json_decref(files), result);
}

static uint32_t word_at(const uint8_t *bytes) {
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* The JSON of a glTF or GLB of `size` bytes. */
static vsh_result read_json(const vshi_view *view, const char *path, FILE *file, uint64_t size, json_t **root,
                            vsh_error *error) {
    enum { HEAD = 20, GLB = 0x46546c67, TREE = 24 }; /* bytes that a JSON tree takes for one of its text */
    uint8_t head[HEAD];
    uint64_t length = size;
    if (size >= HEAD && fread(head, 1, HEAD, file) == HEAD && word_at(head) == GLB) {
        length = word_at(head + 12);
    } else {
        rewind(file);
    }
    if (length > size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is cut short", path);
    }
    VSHI_TRY(vshi_check_limit(view->run, TREE * (double)length, path, error));
    void *text = NULL;
    VSHI_TRY(vshi_allocate(&text, (size_t)length + 1, 1, path, error));
    vsh_result result = VSH_OK;
    json_error_t why;
    errno = 0;
    if (fread(text, 1, (size_t)length, file) != length) {
        result = fail_to_read(path, file, error);
    } else if ((*root = json_loadb(text, (size_t)length, 0, &why)) == NULL) {
        result = errno == ENOMEM ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path)
                                 : vshi_fail(error, VSH_ERROR_READ, "%s: its JSON, line %d: %s", path,
                                             why.line, why.text);
    }
    free(text);
    rewind(file);
    return result;
}

static vsh_result put_gltf(vshi_view *view, const char *path, const vsh_model *model, json_t *about,
                           vsh_error *error) {
    FILE *file;
    uint64_t size;
    json_t *root = NULL;
    vshi_job *job = NULL;
    VSHI_TRY(vshi_input_open(path, path, VSH_MAX_VIEW_MODEL, &file, &size, error));
    vsh_result result;
    VSHI_TRY_DONE(read_json(view, path, file, size, &root, error));
    if (is_compressed(root)) {
        VSHI_TRY_DONE(vshi_view_put_arrays(view, path, model, error));
    } else {
        VSHI_TRY_DONE(vshi_view_begin(view, (size_t)size, &job, error));
        VSHI_TRY_DONE(put_file(view, job, file, size, path, error));
        VSHI_TRY_DONE(put_all_named(view, job, path, root, about, error));
    }
done:
    vshi_job_end(job);
    json_decref(root);
    fclose(file);
    return result;
}

vsh_result vshi_view_put_model(vshi_view *view, const char *path, json_t *about, vsh_error *error) {
    char block[32];
    snprintf(block, sizeof block, VSHI_VIEW_BLOCK "%zu", view->blocks);
    vsh_model *model = NULL;
    VSHI_TRY(vsh_model_read(path, view->run, &model, error));
    const char *ending = vshi_path_ending(path);
    vsh_result result;
    if (strcasecmp(ending, "glb") == 0 || strcasecmp(ending, "gltf") == 0) {
        VSHI_TRY_DONE(put_gltf(view, path, model, about, error));
    } else {
        VSHI_TRY_DONE(vshi_view_put_arrays(view, path, model, error));
    }
    result = vshi_view_tell(about, "model", json_string(block), error);
done:
    vsh_model_free(model);
    return result;
}
