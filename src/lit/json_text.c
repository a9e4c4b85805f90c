#include "lit/json_text.h"

#include "base/decimal.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct writer {
    vshi_lit_bytes *text;
    bool lines, failed;
    int depth;
} writer;

static void put(writer *w, const char *bytes, size_t size) {
    vshi_lit_bytes *text = w->text;
    if (!w->failed && size > text->capacity - text->size) {
        const size_t capacity = 2 * text->capacity + size + 4096;
        unsigned char *grown = realloc(text->at, capacity);
        w->failed = grown == NULL;
        text->at = grown != NULL ? grown : text->at;
        text->capacity = grown != NULL ? capacity : text->capacity;
    }
    if (!w->failed) {
        memcpy(text->at + text->size, bytes, size);
        text->size += size;
    }
}

static void put_string(writer *w, const char *string, size_t size) {
    size_t plain = 0; /* bytes that have not been put yet */
    put(w, "\"", 1);
    for (size_t i = 0; i < size; ++i) {
        const unsigned char byte = (unsigned char)string[i];
        if (byte >= 0x20 && byte != '"' && byte != '\\') {
            continue;
        }
        char escape[8];
        const int length = byte >= 0x20 ? snprintf(escape, sizeof escape, "\\%c", byte)
                                        : snprintf(escape, sizeof escape, "\\u%04x", byte);
        put(w, string + plain, i - plain);
        put(w, escape, (size_t)length);
        plain = i + 1;
    }
    put(w, string + plain, size - plain);
    put(w, "\"", 1);
}

static void put_line(writer *w) {
    put(w, "\n", w->lines ? 1 : 0);
    for (int i = 0; i < w->depth && w->lines; ++i) {
        put(w, "  ", 2);
    }
}

static void put_value(writer *w, const json_t *value);

static void put_object(writer *w, const json_t *object) {
    const char *name;
    json_t *member;
    bool first = true;
    put(w, "{", 1);
    ++w->depth;
    json_object_foreach((json_t *)(uintptr_t)object, name, member) {
        put(w, ",", first ? 0 : 1);
        first = false;
        put_line(w);
        put_string(w, name, strlen(name));
        put(w, ": ", w->lines ? 2 : 1);
        put_value(w, member);
    }
    --w->depth;
    if (!first) {
        put_line(w);
    }
    put(w, "}", 1);
}

/* Lists of numbers stay in one line. */
static void put_array(writer *w, const json_t *array) {
    size_t i;
    const json_t *item;
    const bool short_one =
        !json_is_object(json_array_get(array, 0)) && !json_is_array(json_array_get(array, 0));
    put(w, "[", 1);
    ++w->depth;
    json_array_foreach(array, i, item) {
        put(w, ", ", i == 0 ? 0 : w->lines && short_one ? 2 : 1);
        if (!short_one) {
            put_line(w);
        }
        put_value(w, item);
    }
    --w->depth;
    if (!short_one) {
        put_line(w);
    }
    put(w, "]", 1);
}

static void put_value(writer *w, const json_t *value) {
    char number[VSHI_DECIMAL_ROOM];
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        put_object(w, value);
        break;
    case JSON_ARRAY:
        put_array(w, value);
        break;
    case JSON_STRING:
        put_string(w, json_string_value(value), json_string_length(value));
        break;
    case JSON_INTEGER:
        put(w, number,
            (size_t)snprintf(number, sizeof number, "%" JSON_INTEGER_FORMAT, json_integer_value(value)));
        break;
    case JSON_REAL:
        put(w, number, (size_t)(vshi_decimal_write_double(number, json_real_value(value)) - number));
        break;
    default:
        put(w,
            json_is_true(value)    ? "true"
            : json_is_false(value) ? "false"
                                   : "null",
            json_is_false(value) ? 5 : 4);
        break;
    }
}

vsh_result vshi_lit_json_text(const json_t *value, bool lines, const char *what, vshi_lit_bytes *text,
                              vsh_error *error) {
    writer w = {.text = text, .lines = lines};
    put_value(&w, value);
    return w.failed ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what) : VSH_OK;
}
