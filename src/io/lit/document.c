/* The JSON and the bytes of an asset's document. */
#include "io/lit/work.h"

#include "base/bytes.h"
#include "base/memory.h"
#include "base/text.h"

#include <stdlib.h>
#include <string.h>

/* Estimates the memory for the JSON. vshi_gltf_open() checks the header of a GLB later. */
static double estimate_json_bytes(const char *text, size_t size) {
    enum { HEADER = 20, LENGTH = 12 };
    if (size < HEADER || memcmp(text, "glTF", 4) != 0) {
        return vshi_json_bytes(text, size);
    }
    const size_t length = (size_t)vshi_bytes_number(text + LENGTH, 4, false);
    return vshi_json_bytes(text + HEADER, length < size - HEADER ? length : size - HEADER);
}

/* Checks the lists that are appended to or searched. */
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

vsh_result vshi_lit_read(vshi_lit_work *work, size_t *size, vsh_error *error) {
    vshi_gltf *gltf = &work->gltf;
    VSHI_TRY(vshi_gltf_read_file(gltf, gltf->path, gltf->path, (unsigned char **)&work->text, size, error));
    VSHI_TRY(vshi_gltf_hold(gltf, estimate_json_bytes(work->text, *size), error));
    return vshi_gltf_open(gltf, work->text, *size, error);
}

vsh_result vshi_lit_open(vshi_lit_work *work, vsh_error *error) {
    size_t size;
    VSHI_TRY(vshi_lit_read(work, &size, error));
    VSHI_TRY(check_lists(&work->gltf, error));
    json_t *images = json_object_get(work->gltf.root, "images");
    work->own_images = json_copy(images);
    return images != NULL && json_array_size(work->own_images) != json_array_size(images)
               ? vshi_fail_memory(error, work->gltf.path)
               : VSH_OK;
}

vsh_result vshi_lit_begin(vshi_lit_work *work, vsh_error *error) {
    work->gltf.root = json_pack("{s:{s:s}}", "asset", "version", "2.0");
    return work->gltf.root != NULL ? VSH_OK : vshi_fail_memory(error, work->gltf.path);
}

void vshi_lit_work_free(vshi_lit_work *work) {
    for (size_t i = 0; i < work->uvs.count; ++i) {
        free(work->uvs.list[i].set);
    }
    for (size_t i = 0; i < work->looks.count; ++i) {
        json_decref(work->looks.list[i].transform);
    }
    free(work->copies.list);
    free(work->splits.list);
    free(work->uvs.list);
    free(work->looks.list);
    free(work->added.list);
    vshi_lit_dracos_free(&work->dracos);
    free(work->pages);
    json_decref(work->own_images);
    vshi_gltf_free_buffers(&work->gltf);
    json_decref(work->gltf.root);
    free(work->text);
}

vsh_result vshi_lit_allocate(vshi_lit_work *work, const vshi_array *arrays, size_t count, vsh_error *error) {
    double bytes = 0.0;
    for (size_t i = 0; i < count; ++i) {
        bytes += (double)arrays[i].count * (double)arrays[i].size;
    }
    VSHI_TRY(vshi_gltf_hold(&work->gltf, bytes, error));
    return vshi_allocate_block(arrays, count, work->gltf.path, error);
}

/* --- JSON. Jansson frees values that it does not store, and ignores NULL in place of objects and lists. */

void vshi_lit_set(vshi_lit_work *work, json_t *object, const char *key, json_t *value) {
    work->refused |= json_object_set_new(object, key, value) != 0;
}

void vshi_lit_set_number(vshi_lit_work *work, json_t *object, const char *key, size_t number) {
    vshi_lit_set(work, object, key, json_integer((json_int_t)number));
}

void vshi_lit_push(vshi_lit_work *work, json_t *list, json_t *value) {
    work->refused |= json_array_append_new(list, value) != 0;
}

json_t *vshi_lit_list_numbers(vshi_lit_work *work, const double *values, size_t count) {
    json_t *list = json_array();
    for (size_t i = 0; i < count; ++i) {
        vshi_lit_push(work, list, json_real(values[i]));
    }
    return list;
}

json_t *vshi_lit_copy_json(vshi_lit_work *work, const json_t *json) {
    json_t *copy = json_deep_copy(json);
    work->refused |= json != NULL && (copy == NULL || !json_equal(copy, json));
    return copy;
}

json_t *vshi_lit_text(const char *text) {
    char *clean = malloc(3 * strlen(text) + 1);
    if (clean == NULL) {
        return NULL;
    }
    vshi_utf8_clean(text, clean);
    json_t *made = json_string(clean);
    free(clean);
    return made;
}

vsh_result vshi_lit_find_object(vshi_lit_work *work, json_t *object, const char *key, json_t **member,
                                vsh_error *error) {
    *member = json_object_get(object, key);
    if (*member == NULL) {
        *member = json_object();
        vshi_lit_set(work, object, key, *member);
    }
    return *member == NULL || work->refused ? vshi_fail_memory(error, work->gltf.path)
           : json_is_object(*member)        ? VSH_OK
                                            : vshi_gltf_fail(&work->gltf, error, "a '%s' is no object", key);
}

size_t vshi_lit_append(vshi_lit_work *work, const char *array, json_t *value) {
    json_t *list = json_object_get(work->gltf.root, array);
    if (list == NULL) {
        list = json_array();
        vshi_lit_set(work, work->gltf.root, array, list);
        list = json_object_get(work->gltf.root, array);
    }
    vshi_lit_push(work, list, value);
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

void vshi_lit_use_extension(vshi_lit_work *work, const char *name) {
    if (find_name(json_object_get(work->gltf.root, "extensionsUsed"), name) == SIZE_MAX) {
        vshi_lit_append(work, "extensionsUsed", json_string(name));
    }
}

void vshi_lit_remove_extension(json_t *object, const char *name) {
    json_t *extensions = json_object_get(object, "extensions");
    json_object_del(extensions, name);
    if (extensions != NULL && json_object_size(extensions) == 0) {
        json_object_del(object, "extensions");
    }
}

/* Whether `value`, or something in it, has the extension. */
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

void vshi_lit_drop_extension(vshi_lit_work *work, const char *name) {
    static const char *const lists[] = {"extensionsUsed", "extensionsRequired"};
    for (size_t i = 0; i < 2 && !has_extension(work->gltf.root, name); ++i) {
        json_t *list = json_object_get(work->gltf.root, lists[i]);
        for (size_t at = find_name(list, name); at != SIZE_MAX; at = find_name(list, name)) {
            json_array_remove(list, at);
        }
        if (list != NULL && json_array_size(list) == 0) {
            json_object_del(work->gltf.root, lists[i]);
        }
    }
}

/* --- bytes */

/* Appends `more` zeros to the added bytes. */
static vsh_result grow_added(vshi_lit_work *work, size_t more, vsh_error *error) {
    size_t size;
    if (__builtin_add_overflow(work->added.count, more, &size) || size > SIZE_MAX / 4) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: more bytes than there are addresses", work->gltf.path);
    }
    if (size > work->added.room) {
        const size_t room = size + size / 2 + 4096;
        VSHI_TRY(vshi_gltf_hold(&work->gltf, (double)(room - work->added.room), error));
        unsigned char *grown = realloc(work->added.list, room);
        if (grown == NULL) {
            return vshi_fail_memory(error, work->gltf.path);
        }
        work->added.list = grown;
        work->added.room = room;
    }
    memset(work->added.list + work->added.count, 0, more);
    work->added.count = size;
    return VSH_OK;
}

vsh_result vshi_lit_add_view(vshi_lit_work *work, const void *bytes, size_t size, int target, size_t stride,
                             size_t *view, vsh_error *error) {
    enum { ALIGNMENT = 8 }; /* glTF needs 4; buffers that follow keep their alignment by 8 */
    size_t padded;
    if (__builtin_add_overflow(size, ALIGNMENT - 1, &padded)) {
        return vshi_fail_memory(error, work->gltf.path);
    }
    const size_t at = work->added.count;
    VSHI_TRY(grow_added(work, padded / ALIGNMENT * ALIGNMENT, error));
    if (bytes != NULL) {
        memcpy(work->added.list + at, bytes, size);
    }
    json_t *made = json_pack("{s:I,s:I,s:I}", "buffer", (json_int_t)work->gltf.buffer_count, "byteOffset",
                             (json_int_t)at, "byteLength", (json_int_t)size);
    *view = vshi_lit_append(work, "bufferViews", made);
    if (stride != 0) {
        vshi_lit_set_number(work, made, "byteStride", stride);
    }
    if (target != 0) {
        vshi_lit_set_number(work, made, "target", (size_t)target);
    }
    return work->refused ? vshi_fail_memory(error, work->gltf.path) : VSH_OK;
}

static json_t *make_number(double value, int type) {
    return type == VSHI_GLTF_FLOAT ? json_real(value) : json_integer((json_int_t)value);
}

void vshi_lit_set_bounds(vshi_lit_work *work, json_t *accessor, const vshi_gltf_accessor *values) {
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
        vshi_lit_push(work, low, make_number(least, values->type));
        vshi_lit_push(work, high, make_number(most, values->type));
    }
    vshi_lit_set(work, accessor, "min", low);
    vshi_lit_set(work, accessor, "max", high);
}

static json_t *append_accessor(vshi_lit_work *work, size_t view, int type, size_t count, int components,
                               size_t *accessor) {
    static const char *const kinds[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    json_t *made = json_pack("{s:I,s:i,s:I,s:s}", "bufferView", (json_int_t)view, "componentType", type,
                             "count", (json_int_t)count, "type", kinds[components - 1]);
    *accessor = vshi_lit_append(work, "accessors", made);
    return made;
}

vsh_result vshi_lit_add_floats(vshi_lit_work *work, const float *values, size_t count, int components,
                               bool bounds, size_t *accessor, vsh_error *error) {
    const size_t stride = (size_t)components * sizeof *values;
    size_t size, view = 0;
    if (__builtin_mul_overflow(count, stride, &size)) {
        return vshi_fail_memory(error, work->gltf.path);
    }
    VSHI_TRY(vshi_lit_add_view(work, values, size, VSHI_LIT_VERTICES, 0, &view, error));
    json_t *made = append_accessor(work, view, VSHI_GLTF_FLOAT, count, components, accessor);
    if (bounds && count > 0) {
        const vshi_gltf_accessor added = {.count = count,
                                          .components = components,
                                          .type = VSHI_GLTF_FLOAT,
                                          .at = (const unsigned char *)values,
                                          .stride = stride};
        vshi_lit_set_bounds(work, made, &added);
    }
    return VSH_OK;
}

vsh_result vshi_lit_add_colors(vshi_lit_work *work, const void *values, size_t count, size_t *accessor,
                               vsh_error *error) {
    size_t size, view = 0;
    if (__builtin_mul_overflow(count, (size_t)VSHI_LIT_COLOR_BYTES, &size)) {
        return vshi_fail_memory(error, work->gltf.path);
    }
    VSHI_TRY(vshi_lit_add_view(work, values, size, VSHI_LIT_VERTICES, 0, &view, error));
    json_t *made = append_accessor(work, view, VSHI_GLTF_USHORT, count, 4, accessor);
    vshi_lit_set(work, made, "normalized", json_true());
    vshi_lit_set(work, made, "name", json_string(VSHI_LIT_COLORS));
    return VSH_OK;
}

vsh_result vshi_lit_add_indices(vshi_lit_work *work, const uint32_t *indices, size_t count,
                                size_t vertex_count, size_t *accessor, vsh_error *error) {
    /* some interfaces restart strips at 65535 (glTF 2.0, 3.7.2.1) */
    const bool shorts = vertex_count <= UINT16_MAX;
    const size_t offset = work->added.count;
    size_t size, view = 0;
    if (__builtin_mul_overflow(count, shorts ? sizeof(uint16_t) : sizeof(uint32_t), &size)) {
        return vshi_fail_memory(error, work->gltf.path);
    }
    VSHI_TRY(vshi_lit_add_view(work, shorts ? NULL : indices, size, VSHI_LIT_INDICES, 0, &view, error));
    for (size_t i = 0; shorts && i < count; ++i) {
        const uint16_t index = (uint16_t)indices[i];
        memcpy(work->added.list + offset + i * sizeof index, &index, sizeof index);
    }
    append_accessor(work, view, shorts ? VSHI_GLTF_USHORT : VSHI_GLTF_UINT, count, 1, accessor);
    return VSH_OK;
}
