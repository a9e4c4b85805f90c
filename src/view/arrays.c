/* A GLB of a model's arrays, for what the page's script cannot read itself. It goes to that script alone, and
 * leaves out what only others want (accessor bounds). */
#include "view/parts.h"

#include "base/try.h"
#include "model/model.h"

#include <string.h>

enum { FLOATS = 5126, INTEGERS = 5125, HEAD = 12, CHUNK_HEAD = 8 };

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

vsh_result vshi_view_put_arrays(vshi_view *view, const char *path, const vsh_model *model, vsh_error *error) {
    static const uint32_t GLB = 0x46546c67, JSON = 0x4e4f534a, BIN = 0x004e4942;
    uint64_t bytes;
    char *text = describe(model, &bytes);
    if (text == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    const size_t length = strlen(text), padding = (4 - length % 4) % 4;
    const uint64_t all = HEAD + 2 * CHUNK_HEAD + length + padding + bytes;
    if (all > VSH_MAX_VIEW_MODEL) {
        free(text);
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: takes %llu bytes in the page, which holds models of %d at most", path,
                         (unsigned long long)all, VSH_MAX_VIEW_MODEL);
    }
    vshi_page *page = view->page;
    vshi_page_data_begin(page, VSHI_VIEW_BLOCK, view->blocks++);
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
done:
    vshi_job_end(job);
    free(text);
    return result;
}
