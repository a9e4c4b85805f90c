/* Lists the files that are read with a glTF or OBJ, without reading the model. */
#define _GNU_SOURCE
#include "io/model/model.h"

#include "base/bytes.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "io/model/gltf.h"
#include "io/model/obj.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Bytes of Jansson for each byte of a text, as in vshi_text_read_whole(). */
static const double JSON_BYTES = 6.0;

enum { MOST_JSON = 1 << 30 }; /* bytes */

typedef struct listing {
    const char *path;
    const vsh_run *run;
    vshi_job *job;
    vshi_beside_fn *add;
    void *user;
} listing;

static bool is_readable(const char *path) {
    FILE *file;
    uint64_t size;
    vsh_error ignored;
    if (vshi_input_open(path, path, UINT64_MAX, &file, &size, &ignored) != VSH_OK) {
        return false;
    }
    fclose(file);
    return true;
}

static bool is_outside(const listing *l, const char *path) {
    return l->run->allow_outside == 0 && !vshi_input_is_beside(l->path, path);
}

/* Adds `path`, which is NULL if memory was short, and frees it. Adds missing files only if `missing`. */
static vsh_result add_file(const listing *l, char *path, bool missing, vsh_error *error) {
    if (path == NULL) {
        return vshi_fail_memory(error, l->path);
    }
    const vsh_result result = vshi_job_step(l->job, 0, error);
    if (result != VSH_OK || is_outside(l, path) || (!missing && !is_readable(path))) {
        free(path);
        return result;
    }
    return l->add(l->user, path, error);
}

/* --- glTF */

static vsh_result add_uri(const listing *l, const char *uri, bool missing, vsh_error *error) {
    return uri == NULL || vshi_uri_is_data(uri) || vshi_uri_is_remote(uri)
               ? VSH_OK
               : add_file(l, vshi_uri_path(l->path, uri), missing, error);
}

static vsh_result add_texture(const listing *l, const vshi_gltf *gltf, const json_t *material,
                              vsh_error *error) {
    vsh_error ignored;
    size_t image;
    return vshi_gltf_mask_image(gltf, material, &image, &ignored) == VSH_OK && image != SIZE_MAX
               ? add_uri(l,
                         json_string_value(json_object_get(vshi_gltf_element(gltf, "images", image), "uri")),
                         false, error)
               : VSH_OK;
}

/* Parses the JSON of a glTF or GLB, and sets gltf->binary. Keeps root NULL if it is damaged. */
static vsh_result load_json(const listing *l, FILE *file, uint64_t size, vshi_gltf *gltf, vsh_error *error) {
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
    VSHI_TRY(vshi_check_limit(l->run, JSON_BYTES * (double)size, l->path, error));
    VSHI_TRY(vshi_allocate((void **)&text, (size_t)size, 1, l->path, error));
    vsh_error ignored;
    if (fread(text, 1, (size_t)size, file) == size) {
        vshi_gltf_parse(gltf, text, (size_t)size, &ignored);
    }
    free(text);
    return VSH_OK;
}

/* A file that cannot be read, or is no glTF, has no other files. */
static vsh_result beside_gltf(const listing *l, vsh_error *error) {
    vshi_gltf gltf = {.path = l->path, .run = l->run};
    FILE *file;
    uint64_t size;
    vsh_error ignored;
    if (vshi_input_open(l->path, l->path, UINT64_MAX, &file, &size, &ignored) != VSH_OK) {
        return VSH_OK;
    }
    vsh_result result = load_json(l, file, size, &gltf, error);
    fclose(file);
    size_t i;
    json_t *given;
    json_array_foreach(json_object_get(gltf.root, "buffers"), i, given) {
        VSHI_TRY_DONE(add_uri(l, json_string_value(json_object_get(given, "uri")), !gltf.binary, error));
    }
    json_array_foreach(json_object_get(gltf.root, "materials"), i, given) {
        VSHI_TRY_DONE(add_texture(l, &gltf, given, error));
    }
done:
    json_decref(gltf.root);
    return result;
}

/* --- OBJ */

/* Adds the files that the line at … end names. */
typedef vsh_result add_line_fn(const listing *l, const char *path, const char *at, const char *end,
                               vsh_error *error);

/* Calls `line` for all lines of a file with a word. A file that cannot be read has none. */
static vsh_result add_lines(const listing *l, const char *path, const char *word, add_line_fn *line,
                            vsh_error *error);

/* Adds the texture of a line of an MTL. */
static vsh_result add_map(const listing *l, const char *path, const char *at, const char *end,
                          vsh_error *error) {
    const vshi_token keyword = vshi_scan_token(&at, end);
    vshi_mtl_map map;
    return vshi_token_is(keyword, "map_d") && vshi_mtl_map_read(at, end, &map) && map.name.text != NULL
               ? add_file(l, vshi_mtl_map_path(path, map.name), false, error)
               : VSH_OK;
}

/* Adds the material library of a line of an OBJ, and its textures. */
static vsh_result add_library(const listing *l, const char *path, const char *at, const char *end,
                              vsh_error *error) {
    const vshi_token keyword = vshi_scan_token(&at, end);
    const vshi_token name = vshi_scan_rest(at, end);
    if (!vshi_token_is(keyword, "mtllib") || name.size == 0) {
        return VSH_OK;
    }
    for (int choice = 0; choice < VSHI_OBJ_LIBRARIES; ++choice) {
        char *library = vshi_obj_library(path, choice, name.text, name.size);
        if (library != NULL && !is_readable(library)) {
            free(library);
            continue;
        }
        const vsh_result result = library != NULL && !is_outside(l, library)
                                      ? add_lines(l, library, "map_d", add_map, error)
                                      : VSH_OK;
        if (result == VSH_OK) {
            return add_file(l, library, false, error);
        }
        free(library);
        return result;
    }
    return VSH_OK;
}

static vsh_result add_lines(const listing *l, const char *path, const char *word, add_line_fn *line,
                            vsh_error *error) {
    vshi_budget budget = {.path = path, .run = l->run};
    vshi_text text;
    vsh_error why;
    vsh_result result = vshi_text_read(&text, path, path, &budget, l->job, 0, &why);
    const char *at = text.bytes, *stop = at + text.size, *end;
    for (; result == VSH_OK && (at = memmem(at, (size_t)(stop - at), word, strlen(word))) != NULL; at = end) {
        const char *begin = memrchr(text.bytes, '\n', (size_t)(at - text.bytes));
        end = memchr(at, '\n', (size_t)(stop - at));
        end = end != NULL ? end : stop;
        result = line(l, path, begin != NULL ? begin + 1 : text.bytes, end, &why);
    }
    vshi_text_free(&text);
    return result == VSH_OK || result == VSH_ERROR_READ ? VSH_OK
                                                        : vshi_fail(error, result, "%s", why.message);
}

vsh_result vshi_model_beside(const char *path, const vsh_run *run, vshi_job *job, vshi_beside_fn *add,
                             void *user, vsh_error *error) {
    const listing l = {path, run, job, add, user};
    return vshi_is_gltf(path) ? beside_gltf(&l, error)
           : strcasecmp(vshi_path_ending(path), "obj") == 0
               ? add_lines(&l, path, "mtllib", add_library, error)
               : VSH_OK;
}
