/* A glTF or GLB, from its bytes to a model. */
#include "model/gltf.h"

#include "base/bytes.h"
#include "base/memory.h"
#include "model/scan.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

/* Memory that Jansson takes for a byte of JSON: 25 measured on a list of nodes, 1 on buffers in base64. It is
 * part of what a file's size is taken for beforehand (PEAK_BYTES_A_BYTE); this is what passes that. */
json_t *vshi_gltf_parse_json(const char *text, size_t size, json_error_t *where, bool *early) {
    static const char mark[3] = {'\xef', '\xbb', '\xbf'};
    if (size >= sizeof mark && memcmp(text, mark, sizeof mark) == 0) {
        text += sizeof mark;
        size -= sizeof mark;
    }
    while (size > 0 && text[size - 1] == '\0') {
        --size; /* padding of chunks by some exporters */
    }
    errno = 0;
    json_t *root = json_loadb(text, size, JSON_ALLOW_NUL, where);
    if (errno == ENOMEM) { /* Jansson calls it a syntax error, or cuts numbers and words short */
        json_decref(root);
        root = NULL;
    }
    *early = root == NULL && (json_error_code(where) == json_error_premature_end_of_input ||
                              where->position < 0 || (size_t)where->position >= size);
    return root;
}

static vsh_result parse(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    json_error_t where;
    bool early;
    gltf->root = vshi_gltf_parse_json(text, size, &where, &early);
    if (gltf->root == NULL && errno == ENOMEM) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", gltf->path);
    }
    if (gltf->root == NULL) {
        return vshi_fail(error, early ? VSH_ERROR_READ : VSH_ERROR_INPUT, "%s: %s: line %d column %d: %s",
                         gltf->path, early ? "cut short" : "its JSON is damaged", where.line, where.column,
                         where.text);
    }
    return VSH_OK;
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
    return parse(gltf, text + HEADER + CHUNK, json, error);
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
    gltf->buffer_count = json_array_size(json_object_get(gltf->root, "buffers"));
    gltf->view_count = json_array_size(json_object_get(gltf->root, "bufferViews"));
    gltf->node_count = json_array_size(json_object_get(gltf->root, "nodes"));
    const struct {
        void *memory;
        size_t count, size;
    } wanted[] = {
        {&gltf->buffers, gltf->buffer_count, sizeof *gltf->buffers},
        {&gltf->views, gltf->view_count, sizeof *gltf->views},
        {&gltf->mesh_shapes, meshes, sizeof *gltf->mesh_shapes},
        {&gltf->node_seen, gltf->node_count, sizeof *gltf->node_seen},
        {&gltf->node_world, gltf->node_count, sizeof *gltf->node_world},
        {&gltf->model, 1, sizeof *gltf->model},
    };
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0]; ++i) {
        VSHI_TRY(vshi_gltf_allocate(gltf, (void **)wanted[i].memory, wanted[i].count, wanted[i].size, error));
    }
    return VSH_OK;
}

vsh_result vshi_gltf_open(vshi_gltf *gltf, const char *text, size_t size, vsh_error *error) {
    const bool binary = size >= 4 && memcmp(text, "glTF", 4) == 0;
    const size_t length = strlen(gltf->path);
    const bool expected = length >= 4 && (gltf->path[length - 1] == 'b' || gltf->path[length - 1] == 'B');
    VSHI_TRY(binary || expected ? open_binary(gltf, text, size, error) : parse(gltf, text, size, error));
    VSHI_TRY(check_version(gltf, error));
    return vshi_gltf_check_extensions(gltf, error);
}

vsh_result vshi_gltf_read(const char *path, const char *text, size_t size, bool mapped, const vsh_run *run,
                          vshi_job *job, vsh_model **model, vsh_error *error) {
    vshi_gltf gltf = {.path = path, .run = run, .job = job, .bytes_held = (double)size};
    if (mapped) {
        gltf.mapped = (vshi_gltf_bytes){(const unsigned char *)text, size};
    }
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
    free(gltf.node_world);
    free(gltf.node_seen);
    free(gltf.unpackings);
    free(gltf.mesh_shapes);
    vshi_gltf_free_buffers(&gltf);
    json_decref(gltf.root);
    return result;
}
