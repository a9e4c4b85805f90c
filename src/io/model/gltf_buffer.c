/* The bytes of a glTF (the binary chunk of a GLB, data URIs, files), its buffer views and accessors. */
#include "io/model/gltf.h"

#include "base/bytes.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/text.h"
#include "io/model/text.h"

#include <math.h>
#include <meshoptimizer.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

vsh_result vshi_gltf_read_data(vshi_gltf *gltf, const char *where, const char *uri, unsigned char **bytes,
                               size_t *size, vsh_error *error) {
    VSHI_TRY(vshi_gltf_hold(gltf, 0.75 * (double)strlen(uri), error));
    if (vshi_uri_data(uri, bytes, size)) {
        return VSH_OK;
    }
    const bool damaged = *size == 0;
    *size = 0;
    return damaged ? vshi_gltf_fail(gltf, error, "%s: its data URI is no base64", where)
                   : vshi_fail_memory(error, gltf->path);
}

vsh_result vshi_gltf_read_file(vshi_gltf *gltf, const char *path, const char *name, unsigned char **bytes,
                               size_t *size, vsh_error *error) {
    vshi_budget budget = {gltf->path, gltf->run, gltf->bytes_held};
    vshi_text text;
    const vsh_result result = vshi_text_read(&text, path, name, &budget, gltf->job, 0, error);
    *bytes = (unsigned char *)text.bytes;
    *size = text.size;
    gltf->bytes_held = budget.bytes;
    return result;
}

static vsh_result load_beside(vshi_gltf *gltf, size_t index, const char *uri, vshi_gltf_buffer *buffer,
                              vsh_error *error) {
    if (vshi_uri_is_remote(uri)) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: buffers[%zu] is '%s': only files beside it are read", gltf->path, index, uri);
    }
    char *path = vshi_uri_path(gltf->path, uri), name[1024];
    vsh_result result;
    if (path == NULL) {
        return vshi_fail_memory(error, gltf->path);
    }
    if (gltf->run->allow_outside || vshi_input_is_beside(gltf->path, path)) {
        snprintf(name, sizeof name, "%.400s: buffers[%zu], which holds its vertices, is the file '%.400s'",
                 gltf->path, index, path);
        result = vshi_gltf_read_file(gltf, path, name, &buffer->owned, &buffer->bytes.size, error);
    } else {
        result =
            vshi_fail(error, VSH_ERROR_INPUT,
                      "%s: buffers[%zu], which holds its vertices, is '%s', outside of its folder, where "
                      "nothing is read of a model; --allow-outside (vsh_run.allow_outside) reads it",
                      gltf->path, index, path);
    }
    free(path);
    return result;
}

vsh_result vshi_gltf_load(vshi_gltf *gltf, size_t index, vsh_error *error) {
    const json_t *given = vshi_gltf_element(gltf, "buffers", index);
    const json_t *uri = json_object_get(given, "uri");
    vshi_gltf_buffer *buffer = &gltf->buffers[index];
    size_t length;
    if (buffer->loaded) {
        return VSH_OK;
    }
    if (!vshi_gltf_count(given, "byteLength", SIZE_MAX, &length) || length == SIZE_MAX) {
        return vshi_gltf_fail(gltf, error, "buffers[%zu]: has no byteLength", index);
    }
    if (uri == NULL && index == 0 && gltf->binary) {
        buffer->bytes = gltf->chunk;
    } else if (!json_is_string(uri)) {
        return vshi_gltf_fail(gltf, error, "buffers[%zu]: has no data: neither a URI nor a binary chunk",
                              index);
    } else if (vshi_uri_is_data(json_string_value(uri))) {
        char where[32];
        snprintf(where, sizeof where, "buffers[%zu]", index);
        VSHI_TRY(vshi_gltf_read_data(gltf, where, json_string_value(uri), &buffer->owned, &buffer->bytes.size,
                                     error));
    } else {
        VSHI_TRY(load_beside(gltf, index, json_string_value(uri), buffer, error));
    }
    if (buffer->bytes.size < length) {
        free(buffer->owned); /* a warning may follow, and another texture ask for the buffer again */
        buffer->owned = NULL;
        return vshi_fail(error, VSH_ERROR_READ, "%s: buffers[%zu] is cut short: %zu bytes of %zu", gltf->path,
                         index, buffer->bytes.size, length);
    }
    buffer->bytes.at = buffer->owned != NULL ? buffer->owned : buffer->bytes.at;
    buffer->bytes.size = length;
    buffer->loaded = true;
    return VSH_OK;
}

/* Finds the bytes at `buffer`, `byteOffset` and `byteLength` of an object. */
static vsh_result find_part(vshi_gltf *gltf, const json_t *object, const char *where, vshi_gltf_bytes *bytes,
                            vsh_error *error) {
    size_t buffer, offset, length;
    VSHI_TRY(vshi_gltf_index(gltf, object, "buffer", "buffers", where, &buffer, error));
    if (buffer == SIZE_MAX || !vshi_gltf_count(object, "byteOffset", 0, &offset) ||
        !vshi_gltf_count(object, "byteLength", SIZE_MAX, &length) || length == SIZE_MAX) {
        return vshi_gltf_fail(gltf, error, "%s: its buffer, byteOffset or byteLength is wrong", where);
    }
    VSHI_TRY(vshi_gltf_load(gltf, buffer, error));
    const vshi_gltf_bytes all = gltf->buffers[buffer].bytes;
    if (offset > all.size || length > all.size - offset) {
        return vshi_gltf_fail(gltf, error, "%s: %zu bytes from %zu on pass the %zu bytes of buffers[%zu]",
                              where, length, offset, all.size, buffer);
    }
    *bytes = (vshi_gltf_bytes){all.at + offset, length};
    return VSH_OK;
}

/* --- compressed buffer views: EXT_meshopt_compression (Khronos, 2021), and KHR_meshopt_compression of the
 * same version. meshoptimizer unpacks them. The filters are ours, because the library's use approximate
 * reciprocals of roots, which differ between processors. */

enum { ATTRIBUTES, TRIANGLES, INDICES, MODES };

/* The first byte of the data has their version in its lower half. */
static const struct {
    const char *name;
    unsigned char header, version; /* upper half of the first byte; highest version that is read */
} modes[MODES] = {{"ATTRIBUTES", 0xa0, 0}, {"TRIANGLES", 0xe0, 1}, {"INDICES", 0xd0, 1}};

typedef struct packed {
    vshi_gltf_bytes bytes;
    size_t count, stride;
    int mode, filter;
    const char *where;
} packed;

/* --- filters */

static float rounded_to(float value, float most) {
    const float whole = (float)(int32_t)(value >= 0.0F ? value + 0.5F : value - 0.5F);
    return whole > most ? most : whole < -most ? -most : whole;
}

/* Converts a place on an octahedron, whose corners are given[2] away, to a direction; zeros if that is not
 * positive. */
static void unfold_octahedron(const float given[3], float most, float made[3]) {
    memset(made, 0, sizeof(float[3]));
    if (!(given[2] > 0.0F)) {
        return;
    }
    float x = given[0] / given[2], y = given[1] / given[2];
    const float z = 1.0F - fabsf(x) - fabsf(y), over = z < 0.0F ? -z : 0.0F;
    x -= x >= 0.0F ? over : -over;
    y -= y >= 0.0F ? over : -over;
    const float scale = most / sqrtf(x * x + y * y + z * z);
    made[0] = rounded_to(x * scale, most);
    made[1] = rounded_to(y * scale, most);
    made[2] = rounded_to(z * scale, most);
}

static void decode_octahedral(unsigned char *at, size_t stride) {
    float given[3], made[3];
    for (int k = 0; k < 3; ++k) {
        int16_t two = (int8_t)at[k];
        if (stride == 8) {
            memcpy(&two, at + 2 * k, sizeof two);
        }
        given[k] = (float)two;
    }
    unfold_octahedron(given, stride == 4 ? 127.0F : 32767.0F, made);
    for (int k = 0; k < 3; ++k) {
        const int16_t two = (int16_t)made[k];
        if (stride == 4) {
            at[k] = (unsigned char)(int8_t)two;
        } else {
            memcpy(at + 2 * k, &two, sizeof two);
        }
    }
}

/* The data are three components of a unit quaternion, and the index of the largest one. */
static void decode_quaternion(unsigned char *at, size_t stride) {
    static const float range = 0.70710678118654752F, most = 32767.0F;
    int16_t given[4], made[4];
    (void)stride;
    memcpy(given, at, sizeof given);
    const int largest = given[3] & 3;
    const float one = (float)(given[3] | 3);
    float square = 1.0F;
    for (int k = 0; k < 3; ++k) {
        const float value = (float)given[k] / one * range;
        square -= value * value;
        made[(largest + 1 + k) % 4] = (int16_t)rounded_to(value * most, most);
    }
    made[largest] = (int16_t)rounded_to(square > 0.0F ? sqrtf(square) * most : 0.0F, most);
    memcpy(at, made, sizeof made);
}

/* The data are floats with 8 bits of exponent and 24 of mantissa, both signed. */
static void decode_exponential(unsigned char *at, size_t stride) {
    for (size_t k = 0; k < stride; k += 4) {
        uint32_t bits;
        memcpy(&bits, at + k, sizeof bits);
        const int exponent = (int8_t)(bits >> 24);
        const int32_t mantissa = (int32_t)(bits << 8) >> 8;
        const float value = (float)ldexp((double)mantissa, exponent);
        memcpy(at + k, &value, sizeof value);
    }
}

static const struct {
    const char *name;
    size_t least, most; /* bytes of an element */
    void (*decode)(unsigned char *at, size_t stride);
} filters[] = {{"NONE", 1, 256, NULL},
               {"OCTAHEDRAL", 4, 8, decode_octahedral},
               {"QUATERNION", 8, 8, decode_quaternion},
               {"EXPONENTIAL", 4, 256, decode_exponential}};

enum { FILTERS = sizeof filters / sizeof filters[0] };

/* --- properties of a compressed view */

static bool stride_holds(const packed *p) {
    if (p->mode != ATTRIBUTES) {
        return (p->stride == 2 || p->stride == 4) && filters[p->filter].decode == NULL &&
               (p->mode == INDICES || p->count % 3 == 0);
    }
    return p->stride % 4 == 0 && p->stride >= filters[p->filter].least &&
           p->stride <= filters[p->filter].most;
}

/* Whether the bytes can hold so many elements: at least 2 bits for 16 bytes of attributes, and a byte for a
 * triangle or an index. */
static bool may_hold(const packed *p) {
    enum { DENSEST = 64, TAIL = 256 * 256 /* bytes of a last, partial block */ };
    const size_t size = p->bytes.size;
    return p->mode == ATTRIBUTES ? (double)p->count * (double)p->stride <= DENSEST * (double)size + TAIL
                                 : (p->mode == TRIANGLES ? p->count / 3 : p->count) <= size;
}

static vsh_result read_packed(vshi_gltf *gltf, const json_t *extension, packed *p, vsh_error *error) {
    const char *mode = json_string_value(json_object_get(extension, "mode"));
    const char *filter = json_string_value(json_object_get(extension, "filter"));
    p->mode = p->filter = 0;
    while (p->mode < MODES && (mode == NULL || strcmp(mode, modes[p->mode].name) != 0)) {
        ++p->mode;
    }
    while (p->filter < FILTERS && filter != NULL && strcmp(filter, filters[p->filter].name) != 0) {
        ++p->filter;
    }
    if (p->mode == MODES || p->filter == FILTERS) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: %s: its compression has the unknown mode '%.40s' or filter '%.40s'", gltf->path,
                         p->where, mode != NULL ? mode : "", filter != NULL ? filter : "NONE");
    }
    if (!vshi_gltf_count(extension, "count", 0, &p->count) || p->count == 0 || p->count > UINT32_MAX ||
        !vshi_gltf_count(extension, "byteStride", 0, &p->stride) || !stride_holds(p)) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its compression has count %zu and byteStride %zu, which %s with filter %s "
                              "cannot have",
                              p->where, p->count, p->stride, modes[p->mode].name, filters[p->filter].name);
    }
    VSHI_TRY(find_part(gltf, extension, p->where, &p->bytes, error));
    const unsigned char first = p->bytes.size > 0 ? p->bytes.at[0] : 0;
    if ((first & 0xf0) == modes[p->mode].header && (first & 0x0f) > modes[p->mode].version) {
        return vshi_fail(
            error, VSH_ERROR_UNSUPPORTED,
            "%s: %s: its compressed %s are of version %d; up to version %d is read: 'gltfpack -i "
            "IN.glb -o OUT.glb' without -c writes them as they are",
            gltf->path, p->where, modes[p->mode].name, first & 0x0f, modes[p->mode].version);
    }
    return may_hold(p) ? VSH_OK
                       : vshi_gltf_fail(gltf, error,
                                        "%s: its %zu compressed bytes cannot hold %zu elements of %zu bytes",
                                        p->where, p->bytes.size, p->count, p->stride);
}

/* --- unpacking */

static int decode_packed(const packed *p, unsigned char *to) {
    const unsigned char *from = p->bytes.at;
    const size_t size = p->bytes.size;
    return p->mode == ATTRIBUTES  ? meshopt_decodeVertexBuffer(to, p->count, p->stride, from, size)
           : p->mode == TRIANGLES ? meshopt_decodeIndexBuffer(to, p->count, p->stride, from, size)
                                  : meshopt_decodeIndexSequence(to, p->count, p->stride, from, size);
}

/* Unpacks data of EXT_meshopt_compression into new memory. */
static vsh_result read_meshopt(vshi_gltf *gltf, const json_t *extension, const char *where,
                               unsigned char **made, size_t *size, vsh_error *error) {
    packed p = {.where = where};
    VSHI_TRY(read_packed(gltf, extension, &p, error));
    *size = p.count * p.stride; /* may_hold() limits it */
    VSHI_TRY(vshi_gltf_allocate(gltf, (void **)made, p.count, p.stride, error));
    VSHI_TRY(vshi_job_check(gltf->job, error));
    if (decode_packed(&p, *made) != 0) {
        return vshi_gltf_fail(gltf, error,
                              "%s: its compressed %s are damaged: %zu bytes for %zu elements of %zu bytes",
                              where, modes[p.mode].name, p.bytes.size, p.count, p.stride);
    }
    for (size_t i = 0; filters[p.filter].decode != NULL && i < p.count; ++i) {
        filters[p.filter].decode(*made + i * p.stride, p.stride);
    }
    return VSH_OK;
}

/* Unpacks a compressed view, once. The view's own buffer may have no data. */
static vsh_result unpack(vshi_gltf *gltf, size_t index, const json_t *extension, const char *where,
                         size_t length, vshi_gltf_bytes *bytes, vsh_error *error) {
    vshi_gltf_buffer *view = &gltf->views[index];
    if (!view->loaded) {
        VSHI_TRY(read_meshopt(gltf, extension, where, &view->owned, &view->bytes.size, error));
        view->bytes.at = view->owned;
        view->loaded = true;
    }
    if (length != view->bytes.size) {
        return vshi_gltf_fail(gltf, error, "%s: its byteLength is %zu, but it unpacks to %zu bytes", where,
                              length, view->bytes.size);
    }
    *bytes = view->bytes;
    return VSH_OK;
}

vsh_result vshi_gltf_view(vshi_gltf *gltf, size_t index, vshi_gltf_bytes *bytes, size_t *stride,
                          vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "bufferViews[%zu]", index);
    const json_t *view = vshi_gltf_element(gltf, "bufferViews", index);
    const json_t *compressed = vshi_gltf_extension(view, "EXT_meshopt_compression");
    compressed = compressed != NULL ? compressed : vshi_gltf_extension(view, "KHR_meshopt_compression");
    size_t length;
    if (!vshi_gltf_count(view, "byteStride", 0, stride) ||
        !vshi_gltf_count(view, "byteLength", SIZE_MAX, &length)) {
        return vshi_gltf_fail(gltf, error, "%s: its byteLength or byteStride is wrong", where);
    }
    return compressed != NULL ? unpack(gltf, index, compressed, where, length, bytes, error)
                              : find_part(gltf, view, where, bytes, error);
}

void vshi_gltf_free_buffers(vshi_gltf *gltf) {
    for (size_t i = 0; gltf->buffers != NULL && i < gltf->buffer_count; ++i) {
        free(gltf->buffers[i].owned);
    }
    free(gltf->buffers);
    for (size_t i = 0; gltf->views != NULL && i < gltf->view_count; ++i) {
        free(gltf->views[i].owned);
    }
    free(gltf->views);
}

/* --- accessors: typed elements of a buffer view, some replaced by a sparse accessor (glTF 2.0, 3.6.2).
 * Integers may be normalized (3.11, KHR_mesh_quantization). */

static const struct {
    size_t size; /* bytes; 0: no type */
    float one;   /* the value of 1 if normalized; 0: not normalized */
} component_types[] = {{1, 127.0F}, {1, 255.0F}, {2, 32767.0F}, {2, 65535.0F},
                       {0, 0.0F},   {4, 0.0F},   {4, 0.0F}};

size_t vshi_gltf_component_size(int type) {
    return type >= VSHI_GLTF_BYTE && type <= VSHI_GLTF_FLOAT ? component_types[type - VSHI_GLTF_BYTE].size
                                                             : 0;
}

static int component_count(const char *type) {
    static const struct {
        const char *name;
        int count;
    } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    for (size_t i = 0; type != NULL && i < sizeof types / sizeof types[0]; ++i) {
        if (strcmp(type, types[i].name) == 0) {
            return types[i].count;
        }
    }
    return 0;
}

/* Finds `count` elements of `size` bytes from `offset` on in a view. */
static vsh_result find_elements(vshi_gltf *gltf, const char *where, size_t view, size_t offset, size_t count,
                                size_t size, const unsigned char **at, size_t *stride, vsh_error *error) {
    vshi_gltf_bytes bytes;
    size_t given;
    VSHI_TRY(vshi_gltf_view(gltf, view, &bytes, &given, error));
    *stride = given > 0 ? given : size;
    size_t span, end;
    if (*stride < size || __builtin_mul_overflow(count - 1, *stride, &span) ||
        __builtin_add_overflow(span, size, &span) || __builtin_add_overflow(span, offset, &end) ||
        end > bytes.size) {
        return vshi_gltf_fail(gltf, error,
                              "%s: %zu elements of %zu bytes, %zu apart, from %zu on pass the %zu bytes of "
                              "bufferViews[%zu]",
                              where, count, size, *stride, offset, bytes.size, view);
    }
    *at = bytes.at + offset;
    return VSH_OK;
}

double vshi_gltf_component(const unsigned char *at, int type) {
    if (type == VSHI_GLTF_FLOAT) {
        float number;
        memcpy(&number, at, sizeof number);
        return (double)number;
    }
    const bool is_signed = type == VSHI_GLTF_BYTE || type == VSHI_GLTF_SHORT;
    return (double)vshi_bytes_integer((const char *)at, (int)vshi_gltf_component_size(type), is_signed,
                                      false);
}

static bool is_unsigned(size_t type) {
    return type == VSHI_GLTF_UBYTE || type == VSHI_GLTF_USHORT || type == VSHI_GLTF_UINT;
}

static vsh_result open_sparse(vshi_gltf *gltf, const json_t *sparse, const char *where,
                              vshi_gltf_accessor *accessor, vsh_error *error) {
    const json_t *indices = json_object_get(sparse, "indices"), *values = json_object_get(sparse, "values");
    size_t count, type, index_view, index_offset, value_view, value_offset, stride;
    if (!vshi_gltf_count(sparse, "count", 0, &count) || count > accessor->count ||
        !vshi_gltf_count(indices, "componentType", 0, &type) || !is_unsigned(type) ||
        !vshi_gltf_count(indices, "byteOffset", 0, &index_offset) ||
        !vshi_gltf_count(values, "byteOffset", 0, &value_offset)) {
        return vshi_gltf_fail(gltf, error, "%s: its sparse part is wrong", where);
    }
    if (count == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_gltf_index(gltf, indices, "bufferView", "bufferViews", where, &index_view, error));
    VSHI_TRY(vshi_gltf_index(gltf, values, "bufferView", "bufferViews", where, &value_view, error));
    if (index_view == SIZE_MAX || value_view == SIZE_MAX) {
        return vshi_gltf_fail(gltf, error, "%s: its sparse part has no buffer view", where);
    }
    const size_t index_size = vshi_gltf_component_size((int)type);
    const size_t value_size = (size_t)accessor->components * vshi_gltf_component_size(accessor->type);
    VSHI_TRY(find_elements(gltf, where, index_view, index_offset, count, index_size, &accessor->sparse_at,
                           &stride, error));
    VSHI_TRY(find_elements(gltf, where, value_view, value_offset, count, value_size, &accessor->sparse_values,
                           &stride, error));
    for (size_t i = 0; i < count; ++i) {
        const size_t index = (size_t)vshi_gltf_component(accessor->sparse_at + i * index_size, (int)type);
        if (index >= accessor->count) {
            return vshi_gltf_fail(gltf, error, "%s: sparse index %zu of %zu is %zu, but it has %zu elements",
                                  where, i, count, index, accessor->count);
        }
    }
    accessor->sparse_count = count;
    accessor->sparse_type = (int)type;
    return VSH_OK;
}

vsh_result vshi_gltf_accessor_open(vshi_gltf *gltf, size_t index, vshi_gltf_accessor *accessor,
                                   vsh_error *error) {
    char where[64];
    snprintf(where, sizeof where, "accessors[%zu]", index);
    const json_t *given = vshi_gltf_element(gltf, "accessors", index);
    size_t type, view, offset;
    *accessor = (vshi_gltf_accessor){.normalized = json_is_true(json_object_get(given, "normalized"))};
    accessor->components = component_count(json_string_value(json_object_get(given, "type")));
    if (!vshi_gltf_count(given, "componentType", 0, &type) || type > VSHI_GLTF_FLOAT ||
        vshi_gltf_component_size((int)type) == 0 || accessor->components == 0) {
        return vshi_gltf_fail(gltf, error, "%s: its type or componentType is wrong", where);
    }
    accessor->type = (int)type;
    if (!vshi_gltf_count(given, "count", 0, &accessor->count) || accessor->count == 0 ||
        accessor->count > UINT32_MAX || !vshi_gltf_count(given, "byteOffset", 0, &offset)) {
        return vshi_gltf_fail(gltf, error, "%s: its count or byteOffset is wrong", where);
    }
    VSHI_TRY(vshi_gltf_index(gltf, given, "bufferView", "bufferViews", where, &view, error));
    if (view != SIZE_MAX) {
        const size_t size = (size_t)accessor->components * vshi_gltf_component_size(accessor->type);
        VSHI_TRY(find_elements(gltf, where, view, offset, accessor->count, size, &accessor->at,
                               &accessor->stride, error));
    }
    const json_t *sparse = json_object_get(given, "sparse");
    return sparse != NULL ? open_sparse(gltf, sparse, where, accessor, error) : VSH_OK;
}

vsh_result vshi_gltf_accessor_find(vshi_gltf *gltf, const json_t *object, const char *key, const char *where,
                                   vshi_gltf_accessor *accessor, vsh_error *error) {
    size_t index;
    *accessor = (vshi_gltf_accessor){.count = 0};
    VSHI_TRY(vshi_gltf_index(gltf, object, key, "accessors", where, &index, error));
    return index != SIZE_MAX ? vshi_gltf_accessor_open(gltf, index, accessor, error) : VSH_OK;
}

/* Turns a normalized integer into 0 … 1 or -1 … 1. */
static float normalize(float given, int type) {
    const float one = component_types[type - VSHI_GLTF_BYTE].one;
    return one > 0.0F ? fmaxf(given / one, -1.0F) : given;
}

/* Copies the element at `at` to element i of `to`. */
typedef void copy_fn(const vshi_gltf_accessor *a, const unsigned char *at, size_t i, void *to);

/* Copies all elements, `size` bytes each in `to`: zeros or those of the view, then the sparse ones. */
static inline void copy_elements(const vshi_gltf_accessor *a, copy_fn *copy, void *to, size_t size) {
    const size_t index_size = vshi_gltf_component_size(a->sparse_type);
    const size_t value_size = (size_t)a->components * vshi_gltf_component_size(a->type);
    if (a->at == NULL) {
        memset(to, 0, a->count * size);
    }
    for (size_t i = 0; i < a->count && a->at != NULL; ++i) {
        copy(a, a->at + i * a->stride, i, to);
    }
    for (size_t i = 0; i < a->sparse_count; ++i) {
        const size_t index = (size_t)vshi_gltf_component(a->sparse_at + i * index_size, a->sparse_type);
        copy(a, a->sparse_values + i * value_size, index, to);
    }
}

static void copy_floats(const vshi_gltf_accessor *a, const unsigned char *at, size_t i, void *to) {
    const size_t n = (size_t)a->components, size = vshi_gltf_component_size(a->type);
    for (size_t k = 0; k < n; ++k) {
        const float given = (float)vshi_gltf_component(at + k * size, a->type);
        ((float *)to)[n * i + k] = a->normalized ? normalize(given, a->type) : given;
    }
}

void vshi_gltf_accessor_floats(const vshi_gltf_accessor *a, float *values) {
    copy_elements(a, copy_floats, values, (size_t)a->components * sizeof *values);
}

static void copy_integers(const vshi_gltf_accessor *a, const unsigned char *at, size_t i, void *to) {
    const size_t n = (size_t)a->components, size = vshi_gltf_component_size(a->type);
    for (size_t k = 0; k < n; ++k) {
        ((uint32_t *)to)[n * i + k] = (uint32_t)vshi_gltf_component(at + k * size, a->type);
    }
}

void vshi_gltf_accessor_integers(const vshi_gltf_accessor *a, uint32_t *values) {
    copy_elements(a, copy_integers, values, (size_t)a->components * sizeof *values);
}

static void copy_bytes(const vshi_gltf_accessor *a, const unsigned char *at, size_t i, void *to) {
    const size_t size = (size_t)a->components * vshi_gltf_component_size(a->type);
    memcpy((unsigned char *)to + i * size, at, size);
}

void vshi_gltf_accessor_bytes(const vshi_gltf_accessor *a, unsigned char *bytes) {
    copy_elements(a, copy_bytes, bytes, (size_t)a->components * vshi_gltf_component_size(a->type));
}
