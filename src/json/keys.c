#include "json/keys.h"

#include "base/try.h"
#include "json/suggest.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *type_name(json_type type) {
    static const char *const names[] = {
        [JSON_OBJECT] = "an object",    [JSON_ARRAY] = "an array", [JSON_STRING] = "a string",
        [JSON_INTEGER] = "a number",    [JSON_REAL] = "a number",  [JSON_TRUE] = "true or false",
        [JSON_FALSE] = "true or false", [JSON_NULL] = "null",
    };
    return names[type];
}

vsh_result vshi_expect(const vshi_json *reader, const vshi_value *value, json_type type) {
    const json_type found = json_typeof(value->json);
    if (type_name(found) == type_name(type)) { /* one for both kinds of numbers, and of booleans */
        return VSH_OK;
    }
    return vshi_json_fail(reader, value, "expected %s, found %s", type_name(type), type_name(found));
}

static bool in_range(const vshi_key *key, double number) {
    const bool above = (key->flags & VSHI_ABOVE) != 0 ? number > key->lowest : number >= key->lowest;
    const bool below = (key->flags & VSHI_BELOW) != 0 ? number < key->highest : number <= key->highest;
    return above && below;
}

static vsh_result read_number(const vshi_json *reader, const vshi_value *value, const vshi_key *key,
                              double *number) {
    VSHI_TRY(vshi_expect(reader, value, JSON_REAL));
    *number = json_number_value(value->json);
    if (!in_range(key, *number)) {
        return vshi_json_fail(reader, value, "%.9g is out of range %.9g%s … %.9g%s", *number, key->lowest,
                              (key->flags & VSHI_ABOVE) != 0 ? " (excluded)" : "", key->highest,
                              (key->flags & VSHI_BELOW) != 0 ? " (excluded)" : "");
    }
    return VSH_OK;
}

static vsh_result read_integer(const vshi_json *reader, const vshi_value *value, const vshi_key *key,
                               int32_t *integer) {
    double number;
    VSHI_TRY(read_number(reader, value, key, &number));
    if (number != floor(number)) {
        return vshi_json_fail(reader, value, "%.9g is not a whole number", number);
    }
    *integer = (int32_t)number;
    return VSH_OK;
}

static vsh_result read_vector(const vshi_json *reader, const vshi_value *value, const vshi_key *key,
                              double *vector) {
    vsh_result result = vshi_expect(reader, value, JSON_ARRAY);
    if (result != VSH_OK) {
        return result;
    }
    const size_t size = json_array_size(value->json);
    if (size != (size_t)key->count) {
        return vshi_json_fail(reader, value, "expected %d numbers, found %zu", (int)key->count, size);
    }
    bool zero = true;
    for (size_t i = 0; i < size; ++i) {
        const vshi_value item = vshi_item(value, i);
        result = read_number(reader, &item, key, &vector[i]);
        if (result != VSH_OK) {
            return result;
        }
        zero = zero && vector[i] == 0.0;
    }
    if (zero && (key->flags & VSHI_NONZERO) != 0) {
        return vshi_json_fail(reader, value, "is zero, and so points nowhere");
    }
    return VSH_OK;
}

const char *vshi_key_name(const vshi_key *key, int32_t i) {
    return key->name_of != NULL ? key->name_of(i) : vsh_get_name(key->names, i);
}

static vsh_result read_name(const vshi_json *reader, const vshi_value *value, const vshi_key *key,
                            int32_t *index) {
    VSHI_TRY(vshi_expect(reader, value, JSON_STRING));
    const char *given = json_string_value(value->json);
    char known[256] = "";
    const char *name;
    for (int32_t i = 0; (name = vshi_key_name(key, i)) != NULL; ++i) {
        if (strcmp(name, given) == 0) {
            *index = i;
            return VSH_OK;
        }
        const size_t length = strlen(known);
        snprintf(known + length, sizeof known - length, "%s%s", i == 0 ? "" : ", ", name);
    }
    return vshi_json_fail(reader, value, "\"%.64s\" is none of %s", given, known);
}

static vsh_result read_string(vshi_json *reader, const vshi_value *value, bool path, const char **string) {
    VSHI_TRY(vshi_expect(reader, value, JSON_STRING));
    const char *given = json_string_value(value->json);
    if (given[0] == '\0') {
        return vshi_json_fail(reader, value, "is empty");
    }
    const char *slash = path && given[0] != '/' ? strrchr(reader->path, '/') : NULL;
    return vshi_json_copy(reader, slash == NULL ? 0 : (size_t)(slash - reader->path) + 1, given, string);
}

vsh_result vshi_read_value(vshi_json *reader, const vshi_value *value, const vshi_key *key, void *member) {
    switch (key->kind) {
    case VSHI_NUMBER:
        return read_number(reader, value, key, member);
    case VSHI_DEGREES:
        VSHI_TRY(read_number(reader, value, key, member));
        *(double *)member = *(double *)member / 180.0 * VSHI_PI; /* 180 becomes exactly pi */
        return VSH_OK;
    case VSHI_INTEGER:
        return read_integer(reader, value, key, member);
    case VSHI_BOOL:
        VSHI_TRY(vshi_expect(reader, value, JSON_TRUE));
        *(int32_t *)member = json_is_true(value->json);
        return VSH_OK;
    case VSHI_VECTOR:
        return read_vector(reader, value, key, member);
    case VSHI_NAME:
        return read_name(reader, value, key, member);
    case VSHI_STRING:
    case VSHI_PATH:
        return read_string(reader, value, key->kind == VSHI_PATH, member);
    case VSHI_CUSTOM:
        return key->read(reader, value, member);
    case VSHI_LATER:
        break;
    }
    return VSH_OK;
}

vsh_result vshi_read_choice(vshi_json *reader, const vshi_value *object, const vshi_key *key,
                            int32_t *index) {
    vshi_value value;
    return vshi_member(object, key->name, &value) ? read_name(reader, &value, key, index) : VSH_OK;
}

static bool has_variant(uint32_t variants, uint32_t variant) {
    return variants == 0 || (variants & variant) != 0;
}

static vsh_result fail_unknown(const vshi_json *reader, const vshi_value *member, const vshi_table *table,
                               uint32_t variant, const char *what) {
    const char *nearest = NULL;
    size_t distance = SIZE_MAX;
    for (size_t i = 0; i < table->key_count; ++i) {
        const vshi_key *key = &table->keys[i];
        if (!has_variant(key->variants, variant)) {
            if (strcmp(key->name, member->key) == 0) {
                return vshi_json_fail_key(reader, member, "is no key of %s", what);
            }
            continue;
        }
        const size_t d = vshi_edit_distance(key->name, member->key);
        if (d < distance) {
            distance = d;
            nearest = key->name;
        }
    }
    if (nearest != NULL && vshi_is_near(distance, nearest)) {
        return vshi_json_fail_key(reader, member, "unknown key; did you mean \"%s\"?", nearest);
    }
    return vshi_json_fail_key(reader, member, "unknown key");
}

vsh_result vshi_read_object(vshi_json *reader, const vshi_value *object, const vshi_table *table,
                            uint32_t variant, const char *what, void *target) {
    vsh_result result = vshi_expect(reader, object, JSON_OBJECT);
    if (result != VSH_OK) {
        return result;
    }
    size_t ordinal = 0;
    for (void *i = json_object_iter(object->json); i != NULL; i = json_object_iter_next(object->json, i)) {
        const vshi_value member = {object, json_object_iter_key(i), ordinal++, object->depth + 1,
                                   json_object_iter_value(i)};
        const vshi_key *key = NULL;
        for (size_t k = 0; k < table->key_count && key == NULL; ++k) {
            if (has_variant(table->keys[k].variants, variant) &&
                strcmp(table->keys[k].name, member.key) == 0) {
                key = &table->keys[k];
            }
        }
        if (key == NULL) {
            return fail_unknown(reader, &member, table, variant, what);
        }
        result = vshi_read_value(reader, &member, key, (char *)target + key->offset);
        if (result != VSH_OK) {
            return result;
        }
        if (key->then != NULL) {
            key->then(target);
        }
    }
    for (size_t k = 0; k < table->key_count; ++k) {
        const vshi_key *key = &table->keys[k];
        /* of an object that is no variant yet, only what all need */
        const bool needed = variant == VSHI_ALL ? key->required == VSHI_ALL : (key->required & variant) != 0;
        if (needed && json_object_get(object->json, key->name) == NULL) {
            return vshi_json_fail(reader, object, "key \"%s\" is missing: %s needs it", key->name, what);
        }
    }
    return VSH_OK;
}

vsh_result vshi_read_list(vshi_json *reader, const vshi_value *array, size_t lowest, size_t highest,
                          size_t item_size, vshi_read_fn *read, void **items, size_t *count) {
    VSHI_TRY(vshi_expect(reader, array, JSON_ARRAY));
    const size_t size = json_array_size(array->json);
    if (size < lowest || size > highest) {
        return vshi_json_fail(reader, array, "has %zu items, out of range %zu … %zu", size, lowest, highest);
    }
    VSHI_TRY(vshi_json_allocate(reader, items, size, item_size, array->key));
    for (size_t i = 0; i < size; ++i) {
        const vshi_value item = vshi_item(array, i);
        VSHI_TRY(read(reader, &item, (char *)*items + i * item_size));
    }
    *count = size;
    return VSH_OK;
}
