/* Accessors: typed elements of a buffer view, with those that a sparse accessor replaces (glTF 2.0, 3.6.2),
 * and integers as the numbers that they stand for (3.11, KHR_mesh_quantization). */
#include "model/gltf.h"

#include <stdio.h>
#include <string.h>

size_t vshi_gltf_component_size(int type) {
    switch (type) {
    case VSHI_GLTF_BYTE:
    case VSHI_GLTF_UBYTE:
        return 1;
    case VSHI_GLTF_SHORT:
    case VSHI_GLTF_USHORT:
        return 2;
    case VSHI_GLTF_UINT:
    case VSHI_GLTF_FLOAT:
        return 4;
    default:
        return 0;
    }
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

/* `count` elements of `size` bytes from `offset` on in a view. */
static vsh_result place(vshi_gltf *gltf, const char *where, size_t view, size_t offset, size_t count,
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

size_t vshi_gltf_integer_at(const unsigned char *at, int type) {
    uint16_t two;
    uint32_t four;
    switch (type) {
    case VSHI_GLTF_UBYTE:
        return *at;
    case VSHI_GLTF_USHORT:
        memcpy(&two, at, sizeof two);
        return two;
    default:
        memcpy(&four, at, sizeof four);
        return four;
    }
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
    VSHI_TRY(place(gltf, where, index_view, index_offset, count, index_size, &accessor->sparse_at, &stride,
                   error));
    VSHI_TRY(place(gltf, where, value_view, value_offset, count, value_size, &accessor->sparse_values,
                   &stride, error));
    for (size_t i = 0; i < count; ++i) {
        const size_t index = vshi_gltf_integer_at(accessor->sparse_at + i * index_size, (int)type);
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
        VSHI_TRY(
            place(gltf, where, view, offset, accessor->count, size, &accessor->at, &accessor->stride, error));
    }
    const json_t *sparse = json_object_get(given, "sparse");
    return sparse != NULL ? open_sparse(gltf, sparse, where, accessor, error) : VSH_OK;
}

static float signed_unit(int value, float most, bool normalized) {
    const float given = (float)value;
    return normalized ? (given / most < -1.0F ? -1.0F : given / most) : given;
}

static float component(const unsigned char *at, int type, bool normalized) {
    float number;
    int16_t two;
    uint16_t pair;
    uint32_t four;
    switch (type) {
    case VSHI_GLTF_BYTE:
        return signed_unit((int8_t)*at, 127.0F, normalized);
    case VSHI_GLTF_UBYTE:
        return normalized ? (float)*at / 255.0F : (float)*at;
    case VSHI_GLTF_SHORT:
        memcpy(&two, at, sizeof two);
        return signed_unit(two, 32767.0F, normalized);
    case VSHI_GLTF_USHORT:
        memcpy(&pair, at, sizeof pair);
        return normalized ? (float)pair / 65535.0F : (float)pair;
    case VSHI_GLTF_UINT:
        memcpy(&four, at, sizeof four);
        return (float)four;
    default:
        memcpy(&number, at, sizeof number);
        return number;
    }
}

static void element(const vshi_gltf_accessor *a, const unsigned char *at, float *to) {
    if (a->type == VSHI_GLTF_FLOAT) {
        memcpy(to, at, (size_t)a->components * sizeof *to);
        return;
    }
    const size_t size = vshi_gltf_component_size(a->type);
    for (int k = 0; k < a->components; ++k) {
        to[k] = component(at + (size_t)k * size, a->type, a->normalized);
    }
}

bool vshi_gltf_accessor_plain(const vshi_gltf_accessor *a, int components, int type) {
    return a->at != NULL && a->sparse_count == 0 && a->type == type && a->components == components &&
           a->stride == (size_t)components * 4;
}

void vshi_gltf_accessor_floats(const vshi_gltf_accessor *a, float *values) {
    const size_t n = (size_t)a->components;
    const bool plain = a->at != NULL && a->type == VSHI_GLTF_FLOAT && a->stride == n * sizeof *values;
    if (plain) {
        memcpy(values, a->at, a->count * a->stride);
    }
    for (size_t i = 0; !plain && i < a->count && a->at != NULL; ++i) {
        element(a, a->at + i * a->stride, values + n * i);
    }
    if (a->at == NULL) {
        memset(values, 0, a->count * n * sizeof *values);
    }
    const size_t index_size = vshi_gltf_component_size(a->sparse_type);
    const size_t value_size = n * vshi_gltf_component_size(a->type);
    for (size_t i = 0; i < a->sparse_count; ++i) {
        const size_t index = vshi_gltf_integer_at(a->sparse_at + i * index_size, a->sparse_type);
        element(a, a->sparse_values + i * value_size, values + n * index);
    }
}

void vshi_gltf_accessor_integers(const vshi_gltf_accessor *a, uint32_t *values) {
    const size_t n = (size_t)a->components, size = vshi_gltf_component_size(a->type);
    const bool plain = a->at != NULL && a->type == VSHI_GLTF_UINT && a->stride == n * size;
    if (plain) {
        memcpy(values, a->at, a->count * a->stride);
    }
    for (size_t i = 0; !plain && i < a->count; ++i) {
        for (size_t k = 0; k < n; ++k) {
            values[n * i + k] =
                a->at != NULL ? (uint32_t)vshi_gltf_integer_at(a->at + i * a->stride + k * size, a->type) : 0;
        }
    }
    const size_t index_size = vshi_gltf_component_size(a->sparse_type);
    for (size_t i = 0; i < a->sparse_count; ++i) {
        const size_t index = vshi_gltf_integer_at(a->sparse_at + i * index_size, a->sparse_type);
        for (size_t k = 0; k < n; ++k) {
            values[n * index + k] =
                (uint32_t)vshi_gltf_integer_at(a->sparse_values + (n * i + k) * size, a->type);
        }
    }
}
