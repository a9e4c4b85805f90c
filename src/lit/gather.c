#include "lit/gather.h"

#include <stdlib.h>
#include <string.h>

void vshi_lit_gathered_free(vshi_lit_gathered *gathered) {
    free(gathered->from);
    free(gathered->to);
    *gathered = (vshi_lit_gathered){.from = NULL};
}

/* --- where elements lie */

typedef struct elements {
    const unsigned char *at; /* NULL: all are zeros */
    size_t stride, size;     /* bytes; of an element */
    int components, type;
    unsigned char *owned; /* of a sparse one: made dense; may be NULL */
} elements;

static vsh_result make_dense(vshi_lit_document *document, const vshi_gltf_accessor *accessor, elements *made,
                             vsh_error *error) {
    VSHI_TRY(vshi_gltf_allocate(&document->gltf, (void **)&made->owned, accessor->count, made->size, error));
    for (size_t i = 0; i < accessor->count && accessor->at != NULL; ++i) {
        memcpy(made->owned + i * made->size, accessor->at + i * accessor->stride, made->size);
    }
    const size_t index_size = vshi_gltf_component_size(accessor->sparse_type);
    for (size_t i = 0; i < accessor->sparse_count; ++i) {
        const size_t index =
            vshi_gltf_integer_at(accessor->sparse_at + i * index_size, accessor->sparse_type);
        memcpy(made->owned + index * made->size, accessor->sparse_values + i * made->size, made->size);
    }
    made->at = made->owned;
    made->stride = made->size;
    return VSH_OK;
}

static vsh_result find_elements(vshi_lit_document *document, size_t index, size_t element_count,
                                const vshi_lit_draco_attribute *draco, const char *where, elements *found,
                                vsh_error *error) {
    vshi_gltf_accessor accessor;
    *found = (elements){.at = NULL};
    VSHI_TRY(vshi_gltf_accessor_open(&document->gltf, index, &accessor, error));
    if (draco != NULL) {
        const size_t size = (size_t)draco->components * vshi_gltf_component_size(draco->type);
        if (draco->type != accessor.type || draco->components != accessor.components) {
            return vshi_gltf_fail(&document->gltf, error, "%s: accessors[%zu] is not what was decompressed",
                                  where, index);
        }
        *found = (elements){draco->values, size, size, draco->components, draco->type, NULL};
        return VSH_OK;
    }
    if (accessor.count != element_count) {
        return vshi_gltf_fail(&document->gltf, error, "%s: accessors[%zu] has %zu elements for %zu vertices",
                              where, index, accessor.count, element_count);
    }
    const size_t size = (size_t)accessor.components * vshi_gltf_component_size(accessor.type);
    *found = (elements){accessor.at, accessor.stride, size, accessor.components, accessor.type, NULL};
    return accessor.sparse_count > 0 ? make_dense(document, &accessor, found, error) : VSH_OK;
}

/* --- least and largest values, as they stand in the buffer */

static double component_at(const unsigned char *at, int type) {
    int16_t two;
    float number;
    switch (type) {
    case VSHI_GLTF_BYTE:
        return (double)(int8_t)*at;
    case VSHI_GLTF_SHORT:
        memcpy(&two, at, sizeof two);
        return (double)two;
    case VSHI_GLTF_FLOAT:
        memcpy(&number, at, sizeof number);
        return (double)number;
    default:
        return (double)vshi_gltf_integer_at(at, type);
    }
}

static json_t *number(double value, int type) {
    return type == VSHI_GLTF_FLOAT ? json_real(value) : json_integer((json_int_t)value);
}

static vsh_result set_bounds(const vshi_lit_document *document, json_t *accessor, const unsigned char *at,
                             size_t stride, size_t count, const elements *from, vsh_error *error) {
    json_t *low = json_array(), *high = json_array();
    const size_t each = vshi_gltf_component_size(from->type);
    bool good = low != NULL && high != NULL;
    for (int c = 0; good && c < from->components; ++c) {
        const size_t offset = (size_t)c * each;
        double least = component_at(at + offset, from->type), most = least;
        for (size_t i = 1; i < count; ++i) {
            const double value = component_at(at + i * stride + offset, from->type);
            least = value < least ? value : least;
            most = value > most ? value : most;
        }
        good = json_array_append_new(low, number(least, from->type)) == 0 &&
               json_array_append_new(high, number(most, from->type)) == 0;
    }
    const bool first = json_object_set_new(accessor, "min", low) == 0;
    const bool second = json_object_set_new(accessor, "max", high) == 0;
    return good && first && second ? VSH_OK : vshi_lit_no_memory(document, error);
}

/* --- gathering */

static vsh_result describe(vshi_lit_document *document, size_t index, size_t view, size_t count,
                           json_t **made, vsh_error *error) {
    *made = vshi_gltf_copy(vshi_gltf_element(&document->gltf, "accessors", index));
    if (*made == NULL) {
        return vshi_lit_no_memory(document, error);
    }
    json_object_del(*made, "byteOffset");
    json_object_del(*made, "sparse");
    VSHI_TRY(vshi_lit_set(document, *made, "bufferView", json_integer((json_int_t)view), error));
    return vshi_lit_set(document, *made, "count", json_integer((json_int_t)count), error);
}

static vsh_result copy(vshi_lit_document *document, size_t index, const elements *from,
                       const uint32_t *chosen, size_t count, bool bounds, size_t *accessor,
                       vsh_error *error) {
    const size_t stride = (from->size + 3) & ~(size_t)3; /* of vertex attributes: a multiple of 4 */
    size_t bytes, view, offset;
    if (__builtin_mul_overflow(count, stride, &bytes)) {
        return vshi_lit_no_memory(document, error);
    }
    VSHI_TRY(vshi_lit_add_view(document, NULL, bytes, VSHI_LIT_VERTICES, stride != from->size ? stride : 0,
                               &view, &offset, error));
    unsigned char *to = document->added.at + offset;
    for (size_t i = 0; i < count && from->at != NULL; ++i) {
        memcpy(to + i * stride, from->at + chosen[i] * from->stride, from->size);
    }
    json_t *made = NULL;
    vsh_result result = describe(document, index, view, count, &made, error);
    const bool had = json_object_get(made, "min") != NULL || json_object_get(made, "max") != NULL;
    if (result == VSH_OK && (bounds || had) && count > 0) {
        result = set_bounds(document, made, to, stride, count, from, error);
    }
    if (result != VSH_OK) {
        json_decref(made);
        return result;
    }
    return vshi_lit_append(document, "accessors", made, accessor, error);
}

static vsh_result remember(const vshi_lit_document *document, size_t from, size_t to,
                           vshi_lit_gathered *gathered, vsh_error *error) {
    if (gathered->count == gathered->capacity) {
        const size_t capacity = 2 * gathered->capacity + 8;
        size_t *list = realloc(gathered->from, capacity * sizeof *list);
        gathered->from = list != NULL ? list : gathered->from;
        size_t *other = list != NULL ? realloc(gathered->to, capacity * sizeof *other) : NULL;
        if (other == NULL) {
            return vshi_lit_no_memory(document, error);
        }
        gathered->to = other;
        gathered->capacity = capacity;
    }
    gathered->from[gathered->count] = from;
    gathered->to[gathered->count++] = to;
    return VSH_OK;
}

vsh_result vshi_lit_gather(vshi_lit_document *document, size_t index, size_t element_count,
                           const vshi_lit_draco_attribute *draco, const uint32_t *chosen, size_t count,
                           bool bounds, const char *where, vshi_lit_gathered *gathered, size_t *accessor,
                           vsh_error *error) {
    for (size_t i = 0; i < gathered->count; ++i) {
        if (gathered->from[i] == index) {
            *accessor = gathered->to[i];
            return VSH_OK;
        }
    }
    elements from;
    vsh_result result;
    VSHI_TRY_DONE(find_elements(document, index, element_count, draco, where, &from, error));
    VSHI_TRY_DONE(copy(document, index, &from, chosen, count, bounds, accessor, error));
    VSHI_TRY_DONE(remember(document, index, *accessor, gathered, error));
done:
    free(from.owned);
    return result;
}
