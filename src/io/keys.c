/* Reads objects through tables of keys. Keys as texts: values from a command line, and descriptions for
 * people. */
#include "base/decimal.h"
#include "base/text.h"
#include "io/json.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* --- values */

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
    if (type_name(found) == type_name(type)) { /* both kinds of numbers, and of booleans, have one name */
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
    VSHI_TRY(vshi_expect(reader, value, JSON_ARRAY));
    const size_t size = json_array_size(value->json);
    if (size != (size_t)key->count) {
        return vshi_json_fail(reader, value, "expected %d numbers, found %zu", (int)key->count, size);
    }
    bool zero = true;
    for (size_t i = 0; i < size; ++i) {
        const vshi_value item = vshi_item(value, i);
        VSHI_TRY(read_number(reader, &item, key, &vector[i]));
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

static void list_names(const vshi_key *key, char *text, size_t size) {
    text[0] = '\0';
    const char *name;
    for (int32_t i = 0; (name = vshi_key_name(key, i)) != NULL; ++i) {
        const size_t length = strlen(text);
        snprintf(text + length, size - length, "%s%s", i == 0 ? "" : ", ", name);
    }
}

static vsh_result read_name(const vshi_json *reader, const vshi_value *value, const vshi_key *key,
                            int32_t *index) {
    VSHI_TRY(vshi_expect(reader, value, JSON_STRING));
    const char *given = json_string_value(value->json);
    const char *name;
    for (int32_t i = 0; (name = vshi_key_name(key, i)) != NULL; ++i) {
        if (strcmp(name, given) == 0) {
            *index = i;
            return VSH_OK;
        }
    }
    char known[256];
    list_names(key, known, sizeof known);
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

static vsh_result read_list(vshi_json *reader, const vshi_value *value, const vshi_key *key, void *member) {
    vshi_list list = {.items = NULL};
    VSHI_TRY(vshi_expect(reader, value, JSON_ARRAY));
    list.count = json_array_size(value->json);
    if ((double)list.count < key->lowest || (double)list.count > key->highest) {
        return vshi_json_fail(reader, value, "has %zu items, out of range %.0f … %.0f", list.count,
                              key->lowest, key->highest);
    }
    const size_t size = (size_t)key->count;
    VSHI_TRY(vshi_json_allocate(reader, &list.items, list.count, size, value->key));
    for (size_t i = 0; i < list.count; ++i) {
        const vshi_value item = vshi_item(value, i);
        VSHI_TRY(key->read(reader, &item, (char *)list.items + i * size));
    }
    memcpy(member, &list, sizeof list);
    return VSH_OK;
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
    case VSHI_LIST:
        return read_list(reader, value, key, member);
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

/* Sets the key's flag, and calls its function. */
static void finish_key(const vshi_key *key, void *target) {
    if (key->flag > 0) {
        *(int32_t *)(void *)((char *)target + key->flag) = 1;
    }
    if (key->then != NULL) {
        key->then(target);
    }
}

vsh_result vshi_read_object(vshi_json *reader, const vshi_value *object, const vshi_table *table,
                            uint32_t variant, const char *what, void *target) {
    VSHI_TRY(vshi_expect(reader, object, JSON_OBJECT));
    vshi_value member = {.json = NULL};
    while (vshi_next_member(object, &member)) {
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
        VSHI_TRY(vshi_read_value(reader, &member, key, (char *)target + key->offset));
        finish_key(key, target);
    }
    for (size_t k = 0; k < table->key_count; ++k) {
        const vshi_key *key = &table->keys[k];
        /* an object without a variant yet needs only keys of all variants */
        const bool needed = variant == VSHI_ALL ? key->required == VSHI_ALL : (key->required & variant) != 0;
        if (needed && json_object_get(object->json, key->name) == NULL) {
            return vshi_json_fail(reader, object, "key \"%s\" is missing: %s needs it", key->name, what);
        }
    }
    return VSH_OK;
}

/* --- keys as texts */

enum { MAX_NUMBERS = 8, MAX_NUMBER_TEXT = 64 };

static bool is_number(const vshi_key *key) {
    return key->kind == VSHI_NUMBER || key->kind == VSHI_DEGREES || key->kind == VSHI_INTEGER;
}

void vshi_key_range(const vshi_key *key, char *text, size_t size) {
    text[0] = '\0';
    if (key->option.range != NULL) {
        snprintf(text, size, "%s", key->option.range);
    } else if (key->kind == VSHI_NAME) {
        list_names(key, text, size);
    } else if (is_number(key) && (key->flags & VSHI_ABOVE) != 0) {
        snprintf(text, size, "more than %.10g", key->lowest);
    } else if (is_number(key)) {
        snprintf(text, size, "%.10g to %.10g", key->lowest, key->highest);
    } else if (key->kind == VSHI_VECTOR) {
        snprintf(text, size, "at least %.10g", key->lowest);
    }
}

/* Describes the texts that vshi_read_text() accepts: "a whole number from 1 to 4096". */
static void describe_expected(const vshi_key *key, char *text, size_t size) {
    const char *what = key->kind == VSHI_INTEGER ? "a whole number" : "a number";
    const size_t used = (size_t)snprintf(text, size, "%s", key->kind == VSHI_NAME ? "one of " : "");
    if (key->option.range != NULL || key->kind == VSHI_NAME) {
        vshi_key_range(key, text + used, size - used);
    } else if (is_number(key) && (key->flags & VSHI_ABOVE) != 0) {
        snprintf(text, size, "%s greater than %.10g, at most %.10g", what, key->lowest, key->highest);
    } else if (is_number(key)) {
        snprintf(text, size, "%s from %.10g to %.10g", what, key->lowest, key->highest);
    } else if (key->kind == VSHI_VECTOR) {
        static const char *const counts[] = {[2] = "two", [3] = "three", [4] = "four"};
        snprintf(text, size, "%s numbers of at least %.10g", counts[key->count], key->lowest);
    } else if (key->kind == VSHI_BOOL) {
        snprintf(text, size, "true or false");
    } else {
        snprintf(text, size, "a text that is not empty");
    }
}

void vshi_key_value(const vshi_key *key, const void *target, char *text, size_t size) {
    const char *member = (const char *)target + key->offset;
    double number;
    int32_t integer;
    memcpy(&integer, member, sizeof integer);
    text[0] = '\0';
    if (key->kind == VSHI_NAME) {
        snprintf(text, size, "%s", vshi_key_name(key, integer));
    } else if (key->kind == VSHI_INTEGER) {
        snprintf(text, size, "%d", integer);
    } else if (key->kind == VSHI_NUMBER) {
        memcpy(&number, member, sizeof number);
        snprintf(text, size, "%.10g", number);
    }
}

static bool is_whole(const char *text) {
    text += *text == '-' || *text == '+';
    return *text != '\0' && text[strspn(text, "0123456789")] == '\0';
}

/* Parses a number, or several as an array; returns NULL for other texts. */
static json_t *parse_numbers(const char *text, char separator, bool array) {
    json_t *all = json_array();
    for (const char *at = text;;) {
        const char *end = strchr(at, separator);
        end = end != NULL ? end : at + strlen(at);
        double number;
        if (json_array_size(all) == MAX_NUMBERS || end - at > MAX_NUMBER_TEXT ||
            !vshi_decimal_read(at, end, &number) || json_array_append_new(all, json_real(number)) != 0) {
            json_decref(all);
            return NULL;
        }
        if (*end == '\0') {
            break;
        }
        at = end + 1;
    }
    if (array || json_array_size(all) > 1) {
        return all;
    }
    json_t *one = json_incref(json_array_get(all, 0));
    json_decref(all);
    return one;
}

/* Converts a text to the JSON of a scene's file; returns NULL if it is no value, or memory is short. */
static json_t *parse_text(const vshi_key *key, const char *text) {
    json_t *json = NULL;
    switch (key->kind) {
    case VSHI_BOOL:
        return text == NULL || strcmp(text, "true") == 0 ? json_true()
               : strcmp(text, "false") == 0              ? json_false()
                                                         : NULL;
    case VSHI_NUMBER:
    case VSHI_DEGREES:
        return parse_numbers(text, '\0', false);
    case VSHI_INTEGER:
        return is_whole(text) ? parse_numbers(text, '\0', false) : NULL;
    case VSHI_VECTOR:
        return parse_numbers(text, ',', true);
    case VSHI_CUSTOM:
        json = parse_numbers(text, key->option.by ? 'x' : ',', false);
        return json != NULL ? json : json_string(text);
    default:
        return json_string(text);
    }
}

/* Reads the text into a member; returns whether it is a value of the key. */
static bool read_text(const vshi_key *key, const char *name, const char *text, char *member) {
    if (key->kind == VSHI_STRING || key->kind == VSHI_PATH) {
        if (text == NULL || text[0] == '\0') {
            return false;
        }
        memcpy(member, &text, sizeof text);
        return true;
    }
    if (text == NULL && key->kind != VSHI_BOOL) {
        return false;
    }
    vsh_error unused; /* it tells a place in a file; these keys allocate no memory of the reader */
    vshi_json reader = {.path = name, .error = &unused, .text = ""};
    const vshi_value value = {.json = parse_text(key, text)};
    const bool good = value.json != NULL && vshi_read_value(&reader, &value, key, member) == VSH_OK;
    json_decref(value.json);
    return good;
}

vsh_result vshi_read_text(const vshi_key *key, const char *name, const char *text, void *target,
                          vsh_error *error) {
    if (!read_text(key, name, text, (char *)target + key->offset)) {
        char expected[256];
        describe_expected(key, expected, sizeof expected);
        return vshi_fail(error, VSH_ERROR_INPUT, "%.64s '%.200s': expected %s", name,
                         text != NULL ? text : "", expected);
    }
    finish_key(key, target);
    return VSH_OK;
}
