/* Looking things up in the JSON of a glTF. */
#include "model/gltf.h"

#include "base/memory.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

vsh_result vshi_gltf_fail(const vshi_gltf *gltf, vsh_error *error, const char *format, ...) {
    char text[768];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: %s", gltf->path, text);
}

json_t *vshi_gltf_copy(const json_t *json) {
    return vshi_gltf_check_copy(json_deep_copy(json), json);
}

json_t *vshi_gltf_check_copy(json_t *copy, const json_t *json) {
    if (copy != NULL && !json_equal(copy, json)) {
        json_decref(copy);
        return NULL;
    }
    return copy;
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

vsh_result vshi_gltf_take(vshi_gltf *gltf, void **memory, size_t count, size_t size, vsh_error *error) {
    size_t bytes;
    VSHI_TRY(vshi_gltf_hold(gltf, (double)count * (double)size, error));
    *memory = __builtin_mul_overflow(count, size, &bytes) ? NULL : malloc(bytes);
    return *memory != NULL ? VSH_OK
                           : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu × %zu bytes",
                                       gltf->path, count, size);
}
