#define _GNU_SOURCE
#include "model/model.h"

#include "base/file.h"
#include "base/uri.h"
#include "model/gltf.h"
#include "model/obj.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Bytes that Jansson takes for one byte of a text, as when the model is read (PEAK_BYTES_A_BYTE in
 * model_file.c). */
static const double JSON_BYTES = 5.0;

typedef struct telling {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vshi_beside_fn *take;
    void *user;
} telling;

static bool is_there(const char *path) {
    FILE *file;
    uint64_t size;
    vsh_error ignored;
    if (vshi_input_open(path, path, UINT64_MAX, &file, &size, &ignored) != VSH_OK) {
        return false;
    }
    fclose(file);
    return true;
}

static bool is_outside(const telling *t, const char *path) {
    return t->run->allow_outside == 0 && !vshi_input_is_beside(t->path, path);
}

/* Takes `path` over, which is NULL where memory was short; one that is not there only `anyhow`. */
static vsh_result tell(const telling *t, char *path, bool anyhow, vsh_error *error) {
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", t->path);
    }
    if (vshi_job_advance(t->job, 0)) {
        free(path);
        return vshi_job_fail_cancelled(t->job, error);
    }
    if (is_outside(t, path) || (!anyhow && !is_there(path))) {
        free(path);
        return VSH_OK;
    }
    return t->take(t->user, path, error);
}

/* --- glTF */

static vsh_result tell_uri(const telling *t, const char *uri, bool anyhow, vsh_error *error) {
    return uri == NULL || vshi_uri_is_data(uri) || vshi_uri_is_remote(uri)
               ? VSH_OK
               : tell(t, vshi_uri_path(t->path, uri), anyhow, error);
}

static vsh_result tell_texture(const telling *t, const vshi_gltf *gltf, const json_t *material,
                               vsh_error *error) {
    vsh_error ignored;
    size_t image;
    return vshi_gltf_mask_image(gltf, material, &image, &ignored) == VSH_OK && image != SIZE_MAX
               ? tell_uri(t,
                          json_string_value(json_object_get(vshi_gltf_element(gltf, "images", image), "uri")),
                          false, error)
               : VSH_OK;
}

/* A file that cannot be read, or is no glTF, names nothing. */
static vsh_result beside_gltf(const telling *t, vsh_error *error) {
    vshi_gltf gltf = {.path = t->path, .run = t->run, .job = t->job};
    unsigned char *text = NULL;
    size_t size, i;
    json_t *given;
    vsh_error why;
    vsh_result result = vshi_gltf_read_file(&gltf, t->path, t->path, &text, &size, &why);
    if (result == VSH_OK && (result = vshi_gltf_hold(&gltf, JSON_BYTES * (double)size, &why)) == VSH_OK) {
        result = vshi_gltf_open(&gltf, (const char *)text, size, &why);
    }
    if (result != VSH_OK) {
        result = result == VSH_ERROR_LIMIT || result == VSH_ERROR_MEMORY
                     ? vshi_fail(error, result, "%s", why.message)
                     : VSH_OK;
        goto done;
    }
    json_array_foreach(json_object_get(gltf.root, "buffers"), i, given) {
        VSHI_TRY_DONE(tell_uri(t, json_string_value(json_object_get(given, "uri")), !gltf.binary, error));
    }
    json_array_foreach(json_object_get(gltf.root, "materials"), i, given) {
        VSHI_TRY_DONE(tell_texture(t, &gltf, given, error));
    }
done:
    vshi_gltf_free_buffers(&gltf);
    json_decref(gltf.root);
    free(text);
    return result;
}

/* --- OBJ */

/* Tells of what the line at … end names, if it is one. */
typedef vsh_result tell_line_fn(const telling *t, const char *path, const char *at, const char *end,
                                vsh_error *error);

/* All lines of a file that have a word. What cannot be read has none. */
static vsh_result tell_lines(const telling *t, const char *path, const char *word, tell_line_fn *line,
                             vsh_error *error);

/* The texture that a line of an MTL names. */
static vsh_result tell_map(const telling *t, const char *path, const char *at, const char *end,
                           vsh_error *error) {
    const vshi_token keyword = vshi_scan_token(&at, end);
    vshi_mtl_map map;
    return vshi_token_is(keyword, "map_d") && vshi_mtl_map_read(at, end, &map) && map.name.text != NULL
               ? tell(t, vshi_mtl_map_path(path, map.name), false, error)
               : VSH_OK;
}

/* The material library that a line of an OBJ names. */
static vsh_result tell_library(const telling *t, const char *path, const char *at, const char *end,
                               vsh_error *error) {
    const vshi_token keyword = vshi_scan_token(&at, end);
    const vshi_token name = vshi_scan_rest(at, end);
    if (!vshi_token_is(keyword, "mtllib") || name.size == 0) {
        return VSH_OK;
    }
    for (int choice = 0; choice < VSHI_OBJ_LIBRARIES; ++choice) {
        char *library = vshi_obj_library(path, choice, name.text, name.size);
        if (library != NULL && !is_there(library)) {
            free(library);
            continue;
        }
        const vsh_result result = library != NULL && !is_outside(t, library)
                                      ? tell_lines(t, library, "map_d", tell_map, error)
                                      : VSH_OK;
        if (result == VSH_OK) {
            return tell(t, library, false, error);
        }
        free(library);
        return result;
    }
    return VSH_OK;
}

static vsh_result tell_lines(const telling *t, const char *path, const char *word, tell_line_fn *line,
                             vsh_error *error) {
    vshi_budget budget = {.path = path, .run = t->run};
    vshi_text text;
    vsh_error why;
    vsh_result result = vshi_text_read(&text, path, path, &budget, t->job, 0, &why);
    const char *at = text.bytes, *stop = at + text.size, *end;
    for (; result == VSH_OK && (at = memmem(at, (size_t)(stop - at), word, strlen(word))) != NULL; at = end) {
        const char *begin = memrchr(text.bytes, '\n', (size_t)(at - text.bytes));
        end = memchr(at, '\n', (size_t)(stop - at));
        end = end != NULL ? end : stop;
        result = line(t, path, begin != NULL ? begin + 1 : text.bytes, end, &why);
    }
    vshi_text_free(&text);
    return result == VSH_OK || result == VSH_ERROR_READ ? VSH_OK
                                                        : vshi_fail(error, result, "%s", why.message);
}

vsh_result vshi_model_beside(const char *path, const vsh_run *run, vshi_job *job, vshi_beside_fn *take,
                             void *user, vsh_error *error) {
    const telling t = {path, run, job, take, user};
    return vshi_is_gltf(path) ? beside_gltf(&t, error)
           : strcasecmp(vshi_path_ending(path), "obj") == 0
               ? tell_lines(&t, path, "mtllib", tell_library, error)
               : VSH_OK;
}
