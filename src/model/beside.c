#define _GNU_SOURCE
#include "model/model.h"

#include "base/bytes.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/uri.h"
#include "model/gltf.h"
#include "model/obj.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Bytes that Jansson takes for one byte of a text, as when the model is read (PEAK_BYTES_A_BYTE in
 * model_file.c). */
static const double JSON_BYTES = 6.0;

enum { MOST_JSON = 1 << 30 }; /* bytes */

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

/* The JSON of a glTF or GLB, and which of the two; root NULL: it has none that can be read. */
static vsh_result load_json(const telling *t, FILE *file, uint64_t size, vshi_gltf *gltf, vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8 };
    char head[HEADER + CHUNK];
    char *text = NULL;
    if (fread(head, 1, sizeof head, file) == sizeof head && memcmp(head, "glTF", 4) == 0) {
        const uint64_t chunk = vshi_bytes_number(head + HEADER, 4, false);
        gltf->binary = true;
        size = chunk <= size - sizeof head ? chunk : 0;
    } else {
        rewind(file);
    }
    if (size == 0 || size > MOST_JSON) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_check_limit(t->run, JSON_BYTES * (double)size, t->path, error));
    VSHI_TRY(vshi_allocate((void **)&text, (size_t)size, 1, t->path, error));
    vsh_error ignored;
    if (fread(text, 1, (size_t)size, file) == size) {
        vshi_gltf_parse(gltf, text, (size_t)size, &ignored);
    }
    free(text);
    return VSH_OK;
}

/* A file that cannot be read, or is no glTF, names nothing. */
static vsh_result beside_gltf(const telling *t, vsh_error *error) {
    vshi_gltf gltf = {.path = t->path, .run = t->run};
    FILE *file;
    uint64_t size;
    vsh_error ignored;
    if (vshi_input_open(t->path, t->path, UINT64_MAX, &file, &size, &ignored) != VSH_OK) {
        return VSH_OK;
    }
    vsh_result result = load_json(t, file, size, &gltf, error);
    fclose(file);
    size_t i;
    json_t *given;
    json_array_foreach(json_object_get(gltf.root, "buffers"), i, given) {
        VSHI_TRY_DONE(tell_uri(t, json_string_value(json_object_get(given, "uri")), !gltf.binary, error));
    }
    json_array_foreach(json_object_get(gltf.root, "materials"), i, given) {
        VSHI_TRY_DONE(tell_texture(t, &gltf, given, error));
    }
done:
    json_decref(gltf.root);
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
