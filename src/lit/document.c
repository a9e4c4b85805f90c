#include "lit/document.h"

#include "base/bytes.h"
#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Bytes that the JSON takes in memory, as far as the header of a GLB can be believed: vshi_gltf_open() checks
 * it. */
static double estimate_json_bytes(const char *text, size_t size) {
    enum { HEADER = 20, LENGTH = 12 };
    if (size < HEADER || memcmp(text, "glTF", 4) != 0) {
        return vshi_json_bytes(text, size);
    }
    const size_t told = (size_t)vshi_bytes_number(text + LENGTH, 4, false);
    return vshi_json_bytes(text + HEADER, told < size - HEADER ? told : size - HEADER);
}

/* Lists that are appended to, or looked through, are lists. */
static vsh_result check_lists(const vshi_gltf *gltf, vsh_error *error) {
    static const char *const lists[] = {"buffers",  "bufferViews", "accessors",      "images",
                                        "samplers", "textures",    "materials",      "meshes",
                                        "nodes",    "scenes",      "extensionsUsed", "extensionsRequired"};
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; ++i) {
        const json_t *list = json_object_get(gltf->root, lists[i]);
        if (list != NULL && !json_is_array(list)) {
            return vshi_gltf_fail(gltf, error, "its '%s' is no list", lists[i]);
        }
        size_t k;
        const json_t *item;
        json_array_foreach(list, k, item) {
            if (!json_is_object(item) && !json_is_string(item)) {
                return vshi_gltf_fail(gltf, error, "%s[%zu] is no object", lists[i], k);
            }
        }
    }
    return VSH_OK;
}

vsh_result vshi_lit_open(vshi_lit_document *document, const char *path, const vsh_run *run, vshi_job *job,
                         vsh_error *error) {
    *document = (vshi_lit_document){.gltf = {.path = path, .run = run, .job = job}};
    vshi_gltf *gltf = &document->gltf;
    size_t size;
    VSHI_TRY(vshi_gltf_read_file(gltf, path, path, (unsigned char **)&document->text, &size, error));
    VSHI_TRY(vshi_gltf_hold(gltf, estimate_json_bytes(document->text, size), error));
    VSHI_TRY(vshi_gltf_open(gltf, document->text, size, error));
    VSHI_TRY(check_lists(gltf, error));
    document->first_view = json_array_size(json_object_get(gltf->root, "bufferViews"));
    const json_t *images = json_object_get(gltf->root, "images");
    document->own_images = images != NULL ? json_array() : NULL;
    if (images != NULL && json_array_extend(document->own_images, (json_t *)(uintptr_t)images) != 0) {
        return vshi_lit_no_memory(document, error);
    }
    return VSH_OK;
}

vsh_result vshi_lit_begin(vshi_lit_document *document, const char *path, const vsh_run *run, vshi_job *job,
                          vsh_error *error) {
    *document = (vshi_lit_document){.gltf = {.path = path, .run = run, .job = job}};
    document->gltf.root = json_pack("{s:{s:s}}", "asset", "version", "2.0");
    return document->gltf.root != NULL ? VSH_OK : vshi_lit_no_memory(document, error);
}

void vshi_lit_close(vshi_lit_document *document) {
    vshi_gltf_free_buffers(&document->gltf);
    json_decref(document->own_images);
    json_decref(document->gltf.root);
    free(document->dropped);
    free(document->replaced);
    free(document->added.at);
    free(document->text);
}

vsh_result vshi_lit_no_memory(const vshi_lit_document *document, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", document->gltf.path);
}

/* --- JSON */

/* Jansson frees values that it does not take, and does nothing where what it is given is NULL. */

void vshi_lit_set(vshi_lit_document *document, json_t *object, const char *key, json_t *value) {
    document->refused |= json_object_set_new(object, key, value) != 0;
}

void vshi_lit_set_number(vshi_lit_document *document, json_t *object, const char *key, size_t number) {
    vshi_lit_set(document, object, key, json_integer((json_int_t)number));
}

void vshi_lit_push(vshi_lit_document *document, json_t *list, json_t *value) {
    document->refused |= json_array_append_new(list, value) != 0;
}

json_t *vshi_lit_numbers(vshi_lit_document *document, const double *values, size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; ++i) {
        vshi_lit_push(document, list, json_real(values[i]));
    }
    return list;
}

json_t *vshi_lit_copy_json(vshi_lit_document *document, const json_t *json) {
    json_t *copy = json_deep_copy(json);
    document->refused |= json != NULL && (copy == NULL || !json_equal(copy, json));
    return copy;
}

vsh_result vshi_lit_object(vshi_lit_document *document, json_t *object, const char *key, json_t **member,
                           vsh_error *error) {
    *member = json_object_get(object, key);
    if (*member == NULL) {
        *member = json_object();
        vshi_lit_set(document, object, key, *member);
    }
    return *member == NULL || document->refused ? vshi_lit_no_memory(document, error)
           : json_is_object(*member)            ? VSH_OK
                                     : vshi_gltf_fail(&document->gltf, error, "a '%s' is no object", key);
}

size_t vshi_lit_append(vshi_lit_document *document, const char *array, json_t *value) {
    json_t *list = json_object_get(document->gltf.root, array);
    if (list == NULL) {
        list = json_array();
        vshi_lit_set(document, document->gltf.root, array, list);
        list = json_object_get(document->gltf.root, array);
    }
    vshi_lit_push(document, list, value);
    return json_array_size(list) - 1;
}

static size_t find_name(const json_t *list, const char *name) {
    size_t i;
    const json_t *item;
    json_array_foreach(list, i, item) {
        if (json_is_string(item) && strcmp(json_string_value(item), name) == 0) {
            return i;
        }
    }
    return SIZE_MAX;
}

void vshi_lit_use_extension(vshi_lit_document *document, const char *name) {
    if (find_name(json_object_get(document->gltf.root, "extensionsUsed"), name) == SIZE_MAX) {
        vshi_lit_append(document, "extensionsUsed", json_string(name));
    }
}

void vshi_lit_remove_extension(json_t *object, const char *name) {
    json_t *extensions = json_object_get(object, "extensions");
    json_object_del(extensions, name);
    if (extensions != NULL && json_object_size(extensions) == 0) {
        json_object_del(object, "extensions");
    }
}

/* Whether something at or below `value` has the extension. */
static bool has_extension(json_t *value, const char *name) {
    size_t i;
    const char *key;
    json_t *item;
    bool has = vshi_gltf_extension(value, name) != NULL;
    json_array_foreach(value, i, item) {
        has = has || has_extension(item, name);
    }
    json_object_foreach(value, key, item) {
        has = has || has_extension(item, name);
    }
    return has;
}

void vshi_lit_drop_extension(vshi_lit_document *document, const char *name) {
    static const char *const lists[] = {"extensionsUsed", "extensionsRequired"};
    for (size_t i = 0; i < 2 && !has_extension(document->gltf.root, name); ++i) {
        json_t *list = json_object_get(document->gltf.root, lists[i]);
        for (size_t at = find_name(list, name); at != SIZE_MAX; at = find_name(list, name)) {
            json_array_remove(list, at);
        }
        if (list != NULL && json_array_size(list) == 0) {
            json_object_del(document->gltf.root, lists[i]);
        }
    }
}

/* --- bytes */

/* Room for `more` bytes behind the others; those are zeros. */
static vsh_result grow(vshi_lit_document *document, size_t more, vsh_error *error) {
    vshi_lit_bytes *bytes = &document->added;
    size_t size;
    if (__builtin_add_overflow(bytes->size, more, &size) || size > SIZE_MAX / 4) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: more bytes than there are addresses",
                         document->gltf.path);
    }
    if (size > bytes->capacity) {
        const size_t capacity = size + size / 2 + 4096;
        VSHI_TRY(vshi_gltf_hold(&document->gltf, (double)(capacity - bytes->capacity), error));
        unsigned char *grown = realloc(bytes->at, capacity);
        if (grown == NULL) {
            return vshi_lit_no_memory(document, error);
        }
        bytes->at = grown;
        bytes->capacity = capacity;
    }
    memset(bytes->at + bytes->size, 0, more);
    bytes->size = size;
    return VSH_OK;
}

vsh_result vshi_lit_add_view(vshi_lit_document *document, const void *bytes, size_t size, int target,
                             size_t stride, size_t *view, size_t *offset, vsh_error *error) {
    enum { ALIGNMENT = 8 }; /* 4 would do for glTF; 8 for what is in front of what follows */
    size_t padded;
    if (__builtin_add_overflow(size, ALIGNMENT - 1, &padded)) {
        return vshi_lit_no_memory(document, error);
    }
    const size_t at = document->added.size;
    VSHI_TRY(grow(document, padded / ALIGNMENT * ALIGNMENT, error));
    if (bytes != NULL) {
        memcpy(document->added.at + at, bytes, size);
    }
    json_t *made =
        json_pack("{s:i,s:I,s:I}", "buffer", 0, "byteOffset", (json_int_t)at, "byteLength", (json_int_t)size);
    *view = vshi_lit_append(document, "bufferViews", made);
    if (offset != NULL) {
        *offset = at;
    }
    if (stride != 0) {
        vshi_lit_set_number(document, made, "byteStride", stride);
    }
    if (target != 0) {
        vshi_lit_set_number(document, made, "target", (size_t)target);
    }
    return document->refused ? vshi_lit_no_memory(document, error) : VSH_OK;
}

static const char *type_name(int components) {
    static const char *const names[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    return components >= 1 && components <= 4 ? names[components - 1] : "MAT4";
}

static json_t *number(double value, int type) {
    return type == VSHI_GLTF_FLOAT ? json_real(value) : json_integer((json_int_t)value);
}

void vshi_lit_set_bounds(vshi_lit_document *document, json_t *accessor, const vshi_gltf_accessor *values) {
    json_t *low = json_array(), *high = json_array();
    const size_t each = vshi_gltf_component_size(values->type);
    for (int c = 0; c < values->components; ++c) {
        const unsigned char *at = values->at + (size_t)c * each;
        double least = vshi_gltf_component(at, values->type), most = least;
        for (size_t i = 1; i < values->count; ++i) {
            const double value = vshi_gltf_component(at + i * values->stride, values->type);
            least = value < least ? value : least;
            most = value > most ? value : most;
        }
        vshi_lit_push(document, low, number(least, values->type));
        vshi_lit_push(document, high, number(most, values->type));
    }
    vshi_lit_set(document, accessor, "min", low);
    vshi_lit_set(document, accessor, "max", high);
}

vsh_result vshi_lit_add_floats(vshi_lit_document *document, const float *values, size_t count, int components,
                               bool bounds, size_t *accessor, size_t *offset, vsh_error *error) {
    size_t size, view;
    if (__builtin_mul_overflow(count, (size_t)components * sizeof *values, &size)) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_add_view(document, values, size, VSHI_LIT_VERTICES, 0, &view, offset, error));
    json_t *made = json_pack("{s:I,s:i,s:I,s:s}", "bufferView", (json_int_t)view, "componentType",
                             VSHI_GLTF_FLOAT, "count", (json_int_t)count, "type", type_name(components));
    *accessor = vshi_lit_append(document, "accessors", made);
    const vshi_gltf_accessor added = {.count = count,
                                      .components = components,
                                      .type = VSHI_GLTF_FLOAT,
                                      .at = (const unsigned char *)values,
                                      .stride = (size_t)components * sizeof *values};
    if (bounds && count > 0) {
        vshi_lit_set_bounds(document, made, &added);
    }
    return VSH_OK;
}

vsh_result vshi_lit_add_indices(vshi_lit_document *document, const uint32_t *indices, size_t count,
                                size_t vertex_count, size_t *accessor, vsh_error *error) {
    /* 65535 is what some interfaces restart strips by (glTF 2.0, 3.7.2.1) */
    const bool shorts = vertex_count <= UINT16_MAX;
    const size_t each = shorts ? sizeof(uint16_t) : sizeof(uint32_t);
    size_t size, view, offset;
    if (__builtin_mul_overflow(count, each, &size)) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_add_view(document, shorts ? NULL : indices, size, VSHI_LIT_INDICES, 0, &view, &offset,
                               error));
    for (size_t i = 0; shorts && i < count; ++i) {
        const uint16_t index = (uint16_t)indices[i];
        memcpy(document->added.at + offset + i * sizeof index, &index, sizeof index);
    }
    json_t *made =
        json_pack("{s:I,s:i,s:I,s:s}", "bufferView", (json_int_t)view, "componentType",
                  shorts ? VSHI_GLTF_USHORT : VSHI_GLTF_UINT, "count", (json_int_t)count, "type", "SCALAR");
    *accessor = vshi_lit_append(document, "accessors", made);
    return VSH_OK;
}
