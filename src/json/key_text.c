/* Keys as texts: a value from a command line, and what is said of a key to people. */
#include "base/decimal.h"
#include "json/keys.h"

#include <stdio.h>
#include <string.h>

enum { MAX_NUMBERS = 8, MAX_NUMBER_TEXT = 64 };

/* --- words */

static void names(const vshi_key *key, char *text, size_t size) {
    text[0] = '\0';
    const char *name;
    for (int32_t i = 0; (name = vshi_key_name(key, i)) != NULL; ++i) {
        const size_t length = strlen(text);
        snprintf(text + length, size - length, "%s%s", i == 0 ? "" : ", ", name);
    }
}

static bool is_number(const vshi_key *key) {
    return key->kind == VSHI_NUMBER || key->kind == VSHI_DEGREES || key->kind == VSHI_INTEGER;
}

void vshi_key_range(const vshi_key *key, char *text, size_t size) {
    text[0] = '\0';
    if (key->option.range != NULL) {
        snprintf(text, size, "%s", key->option.range);
    } else if (key->kind == VSHI_NAME) {
        names(key, text, size);
    } else if (is_number(key) && (key->flags & VSHI_ABOVE) != 0) {
        snprintf(text, size, "more than %.10g", key->lowest);
    } else if (is_number(key)) {
        snprintf(text, size, "%.10g to %.10g", key->lowest, key->highest);
    } else if (key->kind == VSHI_VECTOR) {
        snprintf(text, size, "at least %.10g", key->lowest);
    }
}

void vshi_key_expected(const vshi_key *key, char *text, size_t size) {
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

/* --- values */

static bool is_whole(const char *text) {
    text += *text == '-' || *text == '+';
    return *text != '\0' && text[strspn(text, "0123456789")] == '\0';
}

/* One number, or several as an array; NULL: it is none. */
static json_t *numbers_of(const char *text, char separator, bool array) {
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

/* What a scene's file would have in its place; NULL: there is no such value, or no memory. */
static json_t *json_of(const vshi_key *key, const char *text) {
    json_t *json = NULL;
    switch (key->kind) {
    case VSHI_BOOL:
        return text == NULL || strcmp(text, "true") == 0 ? json_true()
               : strcmp(text, "false") == 0              ? json_false()
                                                         : NULL;
    case VSHI_NUMBER:
    case VSHI_DEGREES:
        return numbers_of(text, '\0', false);
    case VSHI_INTEGER:
        return is_whole(text) ? numbers_of(text, '\0', false) : NULL;
    case VSHI_VECTOR:
        return numbers_of(text, ',', true);
    case VSHI_CUSTOM:
        json = numbers_of(text, key->option.by ? 'x' : ',', false);
        return json != NULL ? json : json_string(text);
    default:
        return json_string(text);
    }
}

/* Whether the text is a value of the key. */
static bool take_text(const vshi_key *key, const char *name, const char *text, char *member) {
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
    vsh_error unused; /* it tells of places in a file */
    vshi_json reader = {name, "", 0, NULL, &unused};
    const vshi_value value = {NULL, NULL, 0, 0, json_of(key, text)};
    const bool good = value.json != NULL && vshi_read_value(&reader, &value, key, member) == VSH_OK;
    json_decref(value.json);
    vshi_blocks_free(reader.blocks);
    return good;
}

vsh_result vshi_read_text(const vshi_key *key, const char *name, const char *text, void *target,
                          vsh_error *error) {
    if (!take_text(key, name, text, (char *)target + key->offset)) {
        char expected[256];
        vshi_key_expected(key, expected, sizeof expected);
        return vshi_fail(error, VSH_ERROR_INPUT, "%.64s '%.200s': expected %s", name,
                         text != NULL ? text : "", expected);
    }
    if (key->then != NULL) {
        key->then(target);
    }
    return VSH_OK;
}
