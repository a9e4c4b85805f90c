/* A glTF or GLB, from its bytes to a model. */
#include "model/gltf.h"

#include "base/bytes.h"
#include "base/memory.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- JSON */

vsh_result vshi_gltf_fail(const vshi_gltf *gltf, vsh_error *error, const char *format, ...) {
    char text[768];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s", gltf->path, text);
}

const json_t *vshi_gltf_element(const vshi_gltf *gltf, const char *array, size_t index) {
    return json_array_get(json_object_get(gltf->root, array), index);
}

bool vshi_gltf_count(const json_t *object, const char *key, size_t fallback, size_t *value) {
    static const double most = 9007199254740992.0; /* whole numbers of a double */
    const json_t *given = json_object_get(object, key);
    *value = fallback;
    if (given == NULL) {
        return true;
    }
    const double number = json_number_value(given);
    if (!json_is_number(given) || !(number >= 0.0 && number <= most) || number != floor(number)) {
        return false;
    }
    *value = (size_t)number;
    return true;
}

vsh_result vshi_gltf_index(const vshi_gltf *gltf, const json_t *object, const char *key, const char *array,
                           const char *where, size_t *index, vsh_error *error) {
    if (!vshi_gltf_count(object, key, SIZE_MAX, index)) {
        return vshi_gltf_fail(gltf, error, "%s: '%s' is no index", where, key);
    }
    const size_t count = json_array_size(json_object_get(gltf->root, array));
    if (*index != SIZE_MAX && *index >= count) {
        return vshi_gltf_fail(gltf, error, "%s: '%s' is %zu, but there are only %zu %s", where, key, *index,
                              count, array);
    }
    return VSH_OK;
}

bool vshi_gltf_numbers(const json_t *object, const char *key, size_t count, double *values) {
    const json_t *given = json_object_get(object, key);
    if (given == NULL) {
        return true;
    }
    if (!json_is_array(given)) {
        return false;
    }
    for (size_t i = 0; i < count && i < json_array_size(given); ++i) {
        const json_t *number = json_array_get(given, i);
        if (!json_is_number(number)) {
            return false;
        }
        values[i] = json_number_value(number);
    }
    return true;
}

const json_t *vshi_gltf_extension(const json_t *object, const char *name) {
    return json_object_get(json_object_get(object, "extensions"), name);
}

vsh_result vshi_gltf_hold(vshi_gltf *gltf, double bytes, vsh_error *error) {
    gltf->bytes_held += bytes;
    return vshi_check_limit(gltf->run, gltf->bytes_held, gltf->path, error);
}

vsh_result vshi_gltf_allocate(vshi_gltf *gltf, void **memory, size_t count, size_t size, vsh_error *error) {
    VSHI_TRY(vshi_gltf_hold(gltf, (double)count * (double)size, error));
    return vshi_allocate(memory, count, size, gltf->path, error);
}

/* --- required extensions */

bool vshi_gltf_is_named(const char *name, const char *pattern) {
    const size_t length = strlen(pattern);
    return length > 0 && strncmp(name, pattern, length) == 0 &&
           (pattern[length - 1] == '_' || name[length] == '\0');
}

/* Extensions that are read, or that leave the geometry as it is, as all of materials do. */
static const char *const understood[] = {
    "KHR_mesh_quantization",   "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing", "EXT_meshopt_compression",
    "KHR_meshopt_compression", "KHR_materials_",
    "KHR_texture_transform",   "KHR_texture_basisu",
    "EXT_texture_webp",        "EXT_texture_avif",
    "MSFT_texture_dds",        "KHR_lights_punctual",
    "EXT_lights_image_based",  "EXT_lights_ies",
    "KHR_animation_pointer",   "KHR_xmp",
    "KHR_xmp_json_ld",         "MOZ_lightmap",
    "KHR_audio_emitter",
};

static bool understands(const char *name) {
    bool known = false;
    for (size_t i = 0; i < sizeof understood / sizeof understood[0]; ++i) {
        known = known || vshi_gltf_is_named(name, understood[i]);
    }
    return known;
}

/* Errors: VSH_ERROR_UNSUPPORTED, naming the extension and what could be done. */
static vsh_result check_extensions(const vshi_gltf *gltf, vsh_error *error) {
    size_t i;
    const json_t *item;
    json_array_foreach(json_object_get(gltf->root, "extensionsRequired"), i, item) {
        const char *name = json_string_value(item);
        if (name == NULL) {
            return vshi_gltf_fail(gltf, error, "extensionsRequired[%zu] is no name", i);
        }
        if (understands(name)) {
            continue;
        }
        const char *advice =
            strcmp(name, "KHR_node_visibility") == 0 ? "export it with only those nodes that are to be seen"
            : strcmp(name, "KHR_gaussian_splatting") == 0 ? "it holds no triangles"
                                                          : "export it without that extension";
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: cannot be read without the glTF extension '%s', which is not known here: %s",
                         gltf->path, name, advice);
    }
    return VSH_OK;
}

/* Jansson takes 25 bytes for a byte of a list of nodes, and 1 for buffers in base64 (measured).
 * PEAK_BYTES_A_BYTE in model_file.c allows for that. */
vsh_result vshi_gltf_parse(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    static const char mark[3] = {'\xef', '\xbb', '\xbf'};
    json_error_t where;
    if (size >= sizeof mark && memcmp(text, mark, sizeof mark) == 0) {
        text += sizeof mark;
        size -= sizeof mark;
    }
    while (size > 0 && text[size - 1] == '\0') {
        --size; /* padding of chunks by some exporters */
    }
    errno = 0;
    gltf->root = json_loadb(text, size, JSON_ALLOW_NUL, &where);
    if (errno == ENOMEM) { /* Jansson calls it a syntax error, or cuts numbers and words short */
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", gltf->path);
    }
    const bool early = json_error_code(&where) == json_error_premature_end_of_input || where.position < 0 ||
                       (size_t)where.position >= size;
    return gltf->root != NULL
               ? VSH_OK
               : vshi_fail(error, early ? VSH_ERROR_READ : VSH_ERROR_INPUT, "%s: %s: line %d column %d: %s",
                           gltf->path, early ? "cut short" : "its JSON is damaged", where.line, where.column,
                           where.text);
}

static vsh_result fail_version(const vshi_gltf *gltf, const char *version, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                     "%s: is glTF %s; glTF 2.0 is read: export it again, or convert it (gltf-pipeline)",
                     gltf->path, version);
}

/* The chunks of a GLB (glTF 2.0, 4.4). */
static vsh_result open_binary(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    enum { HEADER = 12, CHUNK = 8 };
    static const char magic[4] = {'g', 'l', 'T', 'F'}, json_type[4] = {'J', 'S', 'O', 'N'},
                      binary_type[4] = {'B', 'I', 'N', '\0'};
    const size_t compared = size < sizeof magic ? size : sizeof magic;
    if (memcmp(text, magic, compared) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is no GLB: it does not begin with 'glTF'", gltf->path);
    }
    if (size >= HEADER && vshi_bytes_number(text + 4, 4, false) == 1) {
        return fail_version(gltf, "1.0", error);
    }
    const uint64_t length = size < HEADER + CHUNK ? HEADER + CHUNK : vshi_bytes_number(text + 8, 4, false);
    if (length > size) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of %llu", gltf->path, size,
                         (unsigned long long)length);
    }
    const size_t json = (size_t)vshi_bytes_number(text + HEADER, 4, false);
    if (json > size - HEADER - CHUNK) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its JSON of %zu bytes passes the file's %zu bytes",
                         gltf->path, json, size);
    }
    if (memcmp(text + HEADER + 4, json_type, sizeof json_type) != 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its first chunk is no JSON", gltf->path);
    }
    const size_t next = HEADER + CHUNK + json;
    if (size - next >= CHUNK && memcmp(text + next + 4, binary_type, sizeof binary_type) == 0) {
        const size_t held = (size_t)vshi_bytes_number(text + next, 4, false), left = size - next - CHUNK;
        if (held > left) {
            return vshi_fail(error, VSH_ERROR_READ, "%s: cut short: %zu bytes of a chunk of %zu", gltf->path,
                             left, held);
        }
        gltf->binary = true;
        gltf->chunk = (vshi_gltf_bytes){(const unsigned char *)text + next + CHUNK, held};
    }
    return vshi_gltf_parse(gltf, text + HEADER + CHUNK, json, error);
}

static vsh_result check_version(const vshi_gltf *gltf, vsh_error *error) {
    const json_t *asset = json_object_get(gltf->root, "asset");
    const char *version = json_string_value(json_object_get(asset, "version"));
    const char *least = json_string_value(json_object_get(asset, "minVersion"));
    if (version == NULL) {
        return vshi_gltf_fail(gltf, error, "is no glTF: its JSON names no version of the asset");
    }
    const bool later = least != NULL && strcmp(least, "2.0") != 0;
    return strncmp(version, "2.", 2) == 0 && !later ? VSH_OK
                                                    : fail_version(gltf, later ? least : version, error);
}

static vsh_result allocate(vshi_gltf *gltf, vsh_error *error) {
    const size_t meshes = json_array_size(json_object_get(gltf->root, "meshes"));
    const size_t nodes = gltf->node_count = json_array_size(json_object_get(gltf->root, "nodes"));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->model, 1, sizeof *gltf->model, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->mesh_shapes, meshes, sizeof *gltf->mesh_shapes, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->node_seen, nodes, sizeof *gltf->node_seen, error));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->node_world, nodes, sizeof *gltf->node_world, error));
    return vshi_gltf_allocate(gltf, (void **)&gltf->visited, nodes, sizeof *gltf->visited, error);
}

vsh_result vshi_gltf_open(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    const bool binary = size >= 4 && memcmp(text, "glTF", 4) == 0;
    const size_t length = strlen(gltf->path);
    const bool expected = length >= 4 && (gltf->path[length - 1] == 'b' || gltf->path[length - 1] == 'B');
    VSHI_TRY(binary || expected ? open_binary(gltf, text, size, error)
                                : vshi_gltf_parse(gltf, text, size, error));
    VSHI_TRY(check_version(gltf, error));
    VSHI_TRY(check_extensions(gltf, error));
    const size_t buffers = json_array_size(json_object_get(gltf->root, "buffers"));
    const size_t views = json_array_size(json_object_get(gltf->root, "bufferViews"));
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->buffers, buffers, sizeof *gltf->buffers, error));
    gltf->buffer_count = buffers;
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)&gltf->views, views, sizeof *gltf->views, error));
    gltf->view_count = views;
    return VSH_OK;
}

vsh_result vshi_gltf_read(const char *path, const char *text, size_t size, const vsh_run *run, vshi_job *job,
                          vsh_model **model, vsh_error *error) {
    vshi_gltf gltf = {.path = path, .run = run, .job = job, .bytes_held = (double)size};
    vsh_result result;
    VSHI_TRY_DONE(vshi_gltf_open(&gltf, text, size, error));
    VSHI_TRY_DONE(allocate(&gltf, error));
    gltf.model->unit = 1.0; /* glTF is in metres */
    VSHI_TRY_DONE(vshi_gltf_read_materials(&gltf, error));
    VSHI_TRY_DONE(vshi_gltf_add_scene(&gltf, error));
    *model = gltf.model;
    gltf.model = NULL;
done:
    vsh_model_free(gltf.model);
    free(gltf.visited);
    free(gltf.node_world);
    free(gltf.node_seen);
    free(gltf.unpackings);
    free(gltf.mesh_shapes);
    vshi_gltf_free_buffers(&gltf);
    json_decref(gltf.root);
    return result;
}
