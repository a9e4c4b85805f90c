/* Assets that tests write, and the content of assets that the library writes. */
#pragma once

#include "handles.h"
#include "models.h"

#include "base/text.h"
#include "io/model/model.h"

#include <jansson.h>
#include <sys/stat.h>

/* A document with its only buffer. */
typedef struct asset {
    json_t *root;
    unsigned char *bytes;
    size_t size;
} asset;

static inline void free_asset(asset *a) {
    json_decref(a->root);
    free(a->bytes);
    *a = (asset){NULL, NULL, 0};
}

/* Finds a value by a path such as "buffers/0/uri"; NULL if there is none. */
static inline json_t *json_at(json_t *value, const char *path) {
    char part[64];
    while (value != NULL && *path != '\0') {
        const size_t length = strcspn(path, "/");
        snprintf(part, sizeof part, "%.*s", (int)length, path);
        value =
            json_is_array(value) ? json_array_get(value, (size_t)atoi(part)) : json_object_get(value, part);
        path += length + (path[length] == '/');
    }
    return value;
}

static inline const char *text_at(const asset *a, const char *path) {
    return json_string_value(json_at(a->root, path));
}

static inline void set_at(const asset *a, const char *path, const char *key, json_t *value) {
    assert_int_equal(json_object_set_new(json_at(a->root, path), key, value), 0);
}

/* --- making */

static inline json_t *list_of(const asset *a, const char *name) {
    json_t *list = json_object_get(a->root, name);
    if (list == NULL) {
        list = json_array();
        assert_int_equal(json_object_set_new(a->root, name, list), 0);
    }
    return list;
}

static inline int put_item(asset *a, const char *name, json_t *item) {
    assert_non_null(item);
    json_array_append_new(list_of(a, name), item);
    return (int)json_array_size(list_of(a, name)) - 1;
}

static inline json_t *parsed(const char *text) {
    json_error_t error;
    json_t *value = json_loads(text, JSON_DECODE_ANY, &error);
    assert_that(value != NULL, "%s: %s", text, error.text);
    return value;
}

static inline int put_view(asset *a, const void *bytes, size_t size, int stride, int target) {
    const size_t at = (a->size + 3) & ~(size_t)3;
    a->bytes = realloc(a->bytes, at + size + 16);
    assert_non_null(a->bytes);
    memset(a->bytes + a->size, 0, at - a->size);
    memcpy(a->bytes + at, bytes, size);
    a->size = at + size;
    json_t *view =
        json_pack("{s:i,s:I,s:I}", "buffer", 0, "byteOffset", (json_int_t)at, "byteLength", (json_int_t)size);
    if (stride > 0) {
        json_object_set_new(view, "byteStride", json_integer(stride));
    }
    if (target > 0) {
        json_object_set_new(view, "target", json_integer(target));
    }
    return put_item(a, "bufferViews", view);
}

static inline int put_accessor(asset *a, int view, int offset, int type, int count, const char *shape,
                               const char *more) {
    char text[512];
    snprintf(text, sizeof text,
             "{\"bufferView\":%d,\"byteOffset\":%d,\"componentType\":%d,\"count\":%d,\"type\":\"%s\"%s}",
             view, offset, type, count, shape, more);
    return put_item(a, "accessors", parsed(text));
}

static inline void write_glb(const asset *a, const char *name) {
    FREED char *text = json_dumps(a->root, JSON_COMPACT);
    const uint32_t length = ((uint32_t)strlen(text) + 3) & ~3U, size = ((uint32_t)a->size + 3) & ~3U;
    const uint32_t head[5] = {0x46546c67, 2, 12 + 8 + length + 8 + size, length, 0x4e4f534a};
    const uint32_t chunk[2] = {size, 0x004e4942};
    FREED unsigned char *all = calloc(1, head[2]);
    memcpy(all, head, sizeof head);
    memset(all + 20, ' ', length);
    memcpy(all + 20, text, strlen(text));
    memcpy(all + 20 + length, chunk, sizeof chunk);
    memcpy(all + 28 + length, a->bytes, a->size);
    write_all(at(name), all, head[2]);
}

/* --- reading */

/* A GLB, or a glTF with its one buffer beside it; others' buffers in data URIs are not read. */
static inline asset load_asset(const char *path) {
    unsigned char *bytes;
    const size_t size = read_all(path, &bytes);
    asset a = {NULL, NULL, 0};
    json_error_t error;
    if (size > 20 && memcmp(bytes, "glTF", 4) == 0) {
        uint32_t head[5], chunk[2] = {0, 0};
        memcpy(head, bytes, sizeof head);
        assert_int_equal(head[2], size);
        a.root = json_loadb((char *)bytes + 20, head[3], 0, &error);
        if (20 + head[3] + 8 <= size) {
            memcpy(chunk, bytes + 20 + head[3], sizeof chunk);
            a.size = chunk[0];
            a.bytes = malloc(a.size + 1);
            memcpy(a.bytes, bytes + 28 + head[3], a.size);
        }
    } else {
        a.root = json_loadb((char *)bytes, size, 0, &error);
        assert_non_null(text_at(&a, "buffers/0/uri"));
        FREED char *beside = vshi_uri_path(path, text_at(&a, "buffers/0/uri"));
        a.size = read_all(beside, &a.bytes);
    }
    free(bytes);
    assert_that(a.root != NULL, "%s: %s", path, error.text);
    return a;
}

static inline const json_t *item_of(const asset *a, const char *name, size_t index) {
    const json_t *item = json_array_get(json_object_get(a->root, name), index);
    assert_that(item != NULL, "%s[%zu] is not there", name, index);
    return item;
}

static inline size_t count_of(const asset *a, const char *name) {
    return json_array_size(json_object_get(a->root, name));
}

static inline size_t number_of(const json_t *object, const char *key) {
    const json_t *value = json_object_get(object, key);
    assert_that(json_is_integer(value), "no '%s' in %s", key, json_dumps(object, 0));
    return (size_t)json_integer_value(value);
}

static inline const unsigned char *bytes_of_view(const asset *a, size_t view) {
    const json_t *given = item_of(a, "bufferViews", view);
    const json_t *offset = json_object_get(given, "byteOffset");
    const size_t at = offset != NULL ? (size_t)json_integer_value(offset) : 0;
    assert_int_equal(number_of(given, "buffer"), 0);
    assert_true(at + number_of(given, "byteLength") <= a->size);
    return a->bytes + at;
}

/* The bytes of element i of an accessor that is not sparse. */
static inline const unsigned char *element_of(const asset *a, size_t accessor, size_t i, size_t size) {
    const json_t *given = item_of(a, "accessors", accessor);
    const size_t view = number_of(given, "bufferView");
    const json_t *stride = json_object_get(item_of(a, "bufferViews", view), "byteStride");
    const json_t *offset = json_object_get(given, "byteOffset");
    assert_null(json_object_get(given, "sparse"));
    assert_true(i < number_of(given, "count"));
    return bytes_of_view(a, view) + (offset != NULL ? json_integer_value(offset) : 0) +
           i * (stride != NULL ? (size_t)json_integer_value(stride) : size);
}

static inline const json_t *primitive_of(const asset *a, size_t mesh, size_t primitive) {
    const json_t *found =
        json_array_get(json_object_get(item_of(a, "meshes", mesh), "primitives"), primitive);
    assert_non_null(found);
    return found;
}

static inline size_t attribute_of(const json_t *primitive, const char *name) {
    return number_of(json_object_get(primitive, "attributes"), name);
}

static inline void assert_json_equal(const json_t *a, const json_t *b, const char *what) {
    assert_that(json_equal(a, b), "%s: %s, expected %s", what, json_dumps(b, JSON_ENCODE_ANY),
                json_dumps(a, JSON_ENCODE_ANY));
}

static inline void assert_same_asset(const asset *a, const asset *b) {
    assert_json_equal(a->root, b->root, "the root");
    assert_int_equal(a->size, b->size);
    assert_memory_equal(a->bytes, b->bytes, a->size);
}

/* --- content that must stay */

/* `keys`: names with blanks between them. */
static inline json_t *without(const json_t *object, const char *keys) {
    json_t *copy = json_deep_copy(object);
    char key[64];
    for (int used; sscanf(keys, " %63s%n", key, &used) == 1; keys += used) {
        json_object_del(copy, key);
    }
    return copy;
}

static inline void assert_alike_but(const json_t *a, const json_t *b, const char *keys, const char *what) {
    json_t *one = without(a, keys), *other = without(b, keys);
    assert_json_equal(one, other, what);
    json_decref(one);
    json_decref(other);
}

static inline void assert_list_kept(const asset *in, const asset *out, const char *name, const char *but) {
    for (size_t i = 0; i < count_of(in, name); ++i) {
        char what[64];
        snprintf(what, sizeof what, "%s[%zu]", name, i);
        assert_alike_but(item_of(in, name, i), item_of(out, name, i), but, what);
    }
}

static inline void assert_views_kept(const asset *in, const asset *out) {
    for (size_t v = 0; v < count_of(in, "bufferViews"); ++v) {
        const size_t size = number_of(item_of(in, "bufferViews", v), "byteLength");
        assert_memory_equal(bytes_of_view(in, v), bytes_of_view(out, v), size);
    }
}

/* Checks that all of the input is in the output, in the same place, byte by byte. The keys `…_but` may
 * differ. */
static inline void assert_kept(const asset *in, const asset *out, const char *node_but,
                               const char *material_but) {
    static const char changing[] = "buffers bufferViews accessors nodes meshes materials images textures "
                                   "samplers extensionsUsed extensionsRequired";
    assert_alike_but(in->root, out->root, changing, "the root");
    assert_list_kept(in, out, "bufferViews", "buffer byteOffset");
    assert_views_kept(in, out);
    static const char *const kept[] = {"accessors", "images", "textures", "samplers"};
    for (size_t i = 0; i < 4; ++i) {
        assert_list_kept(in, out, kept[i], "");
    }
    assert_list_kept(in, out, "meshes", "primitives");
    assert_list_kept(in, out, "nodes", node_but);
    assert_list_kept(in, out, "materials", material_but);
}

/* --- the call */

/* One white pixel. */
static const unsigned char white_png[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52, 0x00,
    0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x00, 0x00, 0x00, 0x00, 0x3a, 0x7e, 0x9b, 0x55, 0x00,
    0x00, 0x00, 0x0a, 0x49, 0x44, 0x41, 0x54, 0x78, 0x9c, 0x63, 0xf8, 0x0f, 0x00, 0x01, 0x01, 0x01, 0x00,
    0xb1, 0x38, 0xf6, 0x14, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

static inline vsh_lit_image white_image(int32_t purpose, uint32_t page) {
    return (vsh_lit_image){.purpose = purpose, .page = page, .png = white_png, .png_size = sizeof white_png};
}

static inline void write_lit(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                             const vsh_lit_options *options, const char *output) {
    assert_ok(vsh_lit_write(path, model, meshes, options, output, NULL, &failure));
}

static inline vsh_lit_options options_of(const vsh_lit_image *images, size_t count) {
    vsh_lit_options options = vsh_lit_options_default();
    options.images = images;
    options.image_count = count;
    return options;
}

/* --- atlases */

/* A place in the atlas that is different for each mesh, triangle and corner. */
static inline void place_of(size_t mesh, size_t number, float uv[2]) {
    uv[0] = (float)((double)(number % 97) / 128.0 + 0.001 * (double)(mesh % 50));
    uv[1] = (float)((double)(number / 97) / 512.0);
}

/* `split`: every corner gets its own vertex. */
static inline vsh_lit_mesh make_lit(const vsh_model *model, size_t mesh, bool split) {
    const vsh_mesh view = vsh_model_mesh(model, mesh, 0);
    const size_t corners_count = 3 * view.triangle_count;
    const size_t count = split ? corners_count : view.vertex_count;
    float *uvs = malloc((2 * count + 1) * sizeof *uvs);
    uint32_t *sources = malloc((count + 1) * sizeof *sources),
             *indices = malloc(corners_count * sizeof *indices);
    for (size_t i = 0; i < corners_count; ++i) {
        indices[i] = split ? (uint32_t)i : view.indices[i];
    }
    for (size_t v = 0; v < count; ++v) {
        sources[v] = split ? view.indices[v] : (uint32_t)v;
        place_of(mesh, v, uvs + 2 * v);
    }
    return (vsh_lit_mesh){.uvs = uvs,
                          .sources = sources,
                          .indices = indices,
                          .vertex_count = count,
                          .triangle_count = view.triangle_count,
                          .uv_set = -1};
}

static inline vsh_lit_mesh *make_all_lit(const vsh_model *model, bool split) {
    const size_t count = vsh_model_mesh_count(model);
    vsh_lit_mesh *meshes = calloc(count, sizeof *meshes);
    for (size_t i = 0; i < count; ++i) {
        meshes[i] = make_lit(model, i, split);
    }
    return meshes;
}

static inline void free_lit(vsh_lit_mesh *meshes, size_t count) {
    for (size_t i = 0; i < count; ++i) {
        free((void *)(uintptr_t)meshes[i].uvs);
        free((void *)(uintptr_t)meshes[i].sources);
        free((void *)(uintptr_t)meshes[i].indices);
        free((void *)(uintptr_t)meshes[i].charts);
    }
    free(meshes);
}

static inline void remove_file(const char *name) {
    assert_int_equal(unlink(at(name)), 0);
}

/* Lights a file of tests/models as "out.glb", without an atlas by its own UVs, and reads the result. */
static inline asset light_model(const char *path, const vsh_model *model, const vsh_lit_mesh *meshes,
                                const vsh_lit_options *options) {
    write_lit(path, model, meshes, options, at("out.glb"));
    asset out = load_asset(at("out.glb"));
    remove_file("out.glb");
    return out;
}
