/* A model in a page: the file itself where the page's script reads it, else its arrays. */
#include "view/page.h"

#include "base/memory.h"
#include "base/uri.h"
#include "model/model.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* --- a GLB of a model's arrays, for what the page's script cannot read itself. It goes to that script alone,
 * and leaves out what only others want (accessor bounds) */

enum { FLOATS = 5126, INTEGERS = 5125 };

/* A GLB: its head, and that of each chunk. */
enum { GLB = 0x46546c67, GLB_HEAD = 12, CHUNK_HEAD = 8 };

/* glTF's JSON as it grows, with the accessors' places in the binary chunk. */
typedef struct glb {
    json_t *accessors, *views, *meshes, *nodes;
    uint64_t bytes; /* of the binary chunk so far */
    bool short_of_memory;
} glb;

/* Adds to a list, and takes it over. */
static void append(glb *g, json_t *list, json_t *value) {
    g->short_of_memory |= json_array_append_new(list, value) != 0;
}

static void put(glb *g, json_t *object, const char *key, json_t *value) {
    g->short_of_memory |= json_object_set_new(object, key, value) != 0;
}

/* Adds an array of `count` elements; returns its accessor's number. */
static json_int_t add_array(glb *g, uint64_t count, uint64_t components, int type, const char *kind) {
    const json_int_t number = (json_int_t)json_array_size(g->accessors);
    const uint64_t bytes = 4 * components * count;
    append(g, g->views,
           json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)g->bytes, "byteLength",
                     (json_int_t)bytes));
    append(g, g->accessors,
           json_pack("{s:I, s:i, s:I, s:s}", "bufferView", number, "componentType", type, "count",
                     (json_int_t)count, "type", kind));
    g->bytes += bytes;
    return number;
}

static void add_shape(glb *g, const vshi_model_shape *shape) {
    json_t *attributes = json_object();
    put(g, attributes, "POSITION", json_integer(add_array(g, shape->vertex_count, 3, FLOATS, "VEC3")));
    if (shape->normals != NULL) {
        put(g, attributes, "NORMAL", json_integer(add_array(g, shape->vertex_count, 3, FLOATS, "VEC3")));
    }
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        if (shape->uvs[set] != NULL) {
            char name[32];
            snprintf(name, sizeof name, "TEXCOORD_%d", set);
            put(g, attributes, name, json_integer(add_array(g, shape->vertex_count, 2, FLOATS, "VEC2")));
        }
    }
    const json_int_t indices = add_array(g, 3 * (uint64_t)shape->triangle_count, 1, INTEGERS, "SCALAR");
    append(g, g->meshes,
           json_pack("{s:[{s:o, s:I}]}", "primitives", "attributes", attributes, "indices", indices));
}

static void add_node(glb *g, const vshi_model_entry *entry) {
    json_t *matrix = json_array(); /* columns, of three rows of four */
    for (size_t i = 0; i < 16; ++i) {
        const size_t row = i % 4, column = i / 4;
        append(g, matrix, json_real(row < 3 ? entry->transform[4 * row + column] : column < 3 ? 0.0 : 1.0));
    }
    const char *name = entry->name != NULL ? entry->name : entry->object_name;
    append(g, g->nodes,
           json_pack("{s:I, s:o, s:o}", "mesh", (json_int_t)entry->shape, "matrix", matrix, "name",
                     vshi_view_text(name != NULL ? name : "")));
}

static json_t *numbers_to(glb *g, size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; ++i) {
        append(g, list, json_integer((json_int_t)i));
    }
    return list;
}

/* v points down in glTF. */
static void put_uvs(vshi_page *page, const float *uvs, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const float uv[2] = {uvs[2 * i], 1.0f - uvs[2 * i + 1]};
        vshi_page_data(page, uv, sizeof uv);
    }
}

static void put_shape(vshi_page *page, const vshi_model_shape *shape) {
    const size_t vertices = shape->vertex_count;
    vshi_page_data(page, shape->positions, 3 * sizeof(float) * vertices);
    if (shape->normals != NULL) {
        vshi_page_data(page, shape->normals, 3 * sizeof(float) * vertices);
    }
    for (int set = 0; set < VSH_MAX_UV_SETS; ++set) {
        if (shape->uvs[set] != NULL) {
            put_uvs(page, shape->uvs[set], vertices);
        }
    }
    vshi_page_data(page, shape->indices, 3 * sizeof(uint32_t) * shape->triangle_count);
}

/* The model's JSON as text, to be freed; NULL where memory is short. */
static char *describe(const vsh_model *model, uint64_t *bytes) {
    glb g = {json_array(), json_array(), json_array(), json_array(), 0, false};
    for (size_t i = 0; i < model->shape_count; ++i) {
        add_shape(&g, &model->shapes[i]);
    }
    for (size_t i = 0; i < model->entry_count; ++i) {
        add_node(&g, &model->entries[i]);
    }
    *bytes = g.bytes;
    json_t *root = json_pack("{s:{s:s}, s:i, s:[{s:o}], s:o, s:o, s:o, s:o, s:[{s:I}]}", "asset", "version",
                             "2.0", "scene", 0, "scenes", "nodes", numbers_to(&g, model->entry_count),
                             "nodes", g.nodes, "meshes", g.meshes, "accessors", g.accessors, "bufferViews",
                             g.views, "buffers", "byteLength", (json_int_t)g.bytes);
    char *text = root != NULL && !g.short_of_memory ? vshi_view_dump(root) : NULL;
    json_decref(root);
    return text;
}

static void put_words(vshi_page *page, const uint32_t *words, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        const uint8_t bytes[4] = {(uint8_t)words[i], (uint8_t)(words[i] >> 8), (uint8_t)(words[i] >> 16),
                                  (uint8_t)(words[i] >> 24)};
        vshi_page_data(page, bytes, sizeof bytes);
    }
}

vsh_result vshi_view_put_arrays(vshi_view *view, const char *path, const vsh_model *model, json_t *about,
                                vsh_error *error) {
    static const uint32_t JSON = 0x4e4f534a, BIN = 0x004e4942;
    uint64_t bytes;
    char *text = describe(model, &bytes);
    if (text == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    const size_t length = strlen(text), padding = (4 - length % 4) % 4;
    const uint64_t all = GLB_HEAD + 2 * CHUNK_HEAD + length + padding + bytes;
    if (all > VSH_MAX_VIEW_MODEL) {
        free(text);
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: takes %llu bytes in the page, which holds models of %d at most", path,
                         (unsigned long long)all, VSH_MAX_VIEW_MODEL);
    }
    vshi_page *page = view->page;
    vshi_page_data_begin(page);
    const uint32_t head[] = {GLB, 2, (uint32_t)all, (uint32_t)(length + padding), JSON};
    put_words(page, head, sizeof head / sizeof head[0]);
    vshi_page_data(page, text, length);
    vshi_page_data(page, "   ", padding);
    const uint32_t chunk[] = {(uint32_t)bytes, BIN};
    put_words(page, chunk, sizeof chunk / sizeof chunk[0]);
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_view_begin(view, model->shape_count, &job, error));
    for (size_t i = 0; i < model->shape_count; ++i) {
        put_shape(page, &model->shapes[i]);
        VSHI_TRY_DONE(vshi_view_advance(view, job, 1, error));
    }
    vshi_page_data_end(page);
    result = vshi_view_tell(about, "model", json_string(page->block), error);
done:
    vshi_job_end(job);
    free(text);
    return result;
}

/* --- the file itself */

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
    vshi_page_data_begin(view->page);
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
        VSHI_TRY_DONE(put_file(view, job, file, size, path, error));
        result = vshi_view_tell(
            files, NULL, json_pack("{s:o, s:s}", "uri", vshi_view_text(uri), "data", view->page->block),
            error);
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
    enum { HEAD = GLB_HEAD + CHUNK_HEAD };
    enum { TREE = 24 }; /* bytes that a JSON tree takes for one of its text */
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
        VSHI_TRY_DONE(vshi_view_put_arrays(view, path, model, about, error));
    } else {
        VSHI_TRY_DONE(vshi_view_begin(view, (size_t)size, &job, error));
        VSHI_TRY_DONE(put_file(view, job, file, size, path, error));
        VSHI_TRY_DONE(vshi_view_tell(about, "model", json_string(view->page->block), error));
        VSHI_TRY_DONE(put_all_named(view, job, path, root, about, error));
    }
done:
    vshi_job_end(job);
    json_decref(root);
    fclose(file);
    return result;
}

vsh_result vshi_view_put_model(vshi_view *view, const char *path, json_t *about, vsh_error *error) {
    vsh_model *model = NULL;
    VSHI_TRY(vsh_model_read(path, view->run, &model, error));
    const char *ending = vshi_path_ending(path);
    const vsh_result result = strcasecmp(ending, "glb") == 0 || strcasecmp(ending, "gltf") == 0
                                  ? put_gltf(view, path, model, about, error)
                                  : vshi_view_put_arrays(view, path, model, about, error);
    vsh_model_free(model);
    return result;
}
