#include "json/json.h"

#include "base/memory.h"
#include "base/try.h"
#include "json/locate.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Deeper than any value that a table can name: SDF trees end at 64 levels of two steps each. */
enum { MAX_DEPTH = 256, MAX_PATH_TEXT = 320, MAX_KEY_TEXT = 48 };

/* Appends to a text of fixed size; what does not fit is left out. */
static void append(char *text, size_t capacity, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static void append(char *text, size_t capacity, const char *format, ...) {
    const size_t length = strlen(text);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + length, capacity - length, format, arguments);
    va_end(arguments);
}

/* "lights[0].angle_deg" */
static void append_path(char *text, const vshi_value *value) {
    if (value->parent == NULL) {
        return;
    }
    append_path(text, value->parent);
    if (value->key == NULL) {
        append(text, MAX_PATH_TEXT, "[%zu]", value->ordinal);
        return;
    }
    int length = (int)strnlen(value->key, MAX_KEY_TEXT + 1);
    const bool cut = length > MAX_KEY_TEXT;
    while (cut && length > 0 && ((unsigned char)value->key[length] & 0xc0) == 0x80) {
        --length; /* not inside a UTF-8 character */
    }
    append(text, MAX_PATH_TEXT, "%s%.*s%s", text[0] == '\0' ? "" : ".", length, value->key, cut ? "…" : "");
}

static vsh_result fail(const vshi_json *reader, const vshi_value *value, bool key, const char *format,
                       va_list arguments) __attribute__((format(printf, 4, 0)));
static vsh_result fail(const vshi_json *reader, const vshi_value *value, bool key, const char *format,
                       va_list arguments) {
    size_t ordinals[MAX_DEPTH];
    const vshi_value *step = value;
    while (step->depth > MAX_DEPTH) {
        step = step->parent;
    }
    const size_t depth = step->depth;
    for (; step->depth > 0; step = step->parent) {
        ordinals[step->depth - 1] = step->ordinal;
    }
    const vshi_place place = vshi_locate(reader->text, reader->size, ordinals, depth, key);
    char where[MAX_PATH_TEXT] = "";
    append_path(where, value);
    char message[512];
    if (vsnprintf(message, sizeof message, format, arguments) < 0) {
        message[0] = '\0';
    }
    return vshi_fail(reader->error, VSH_ERROR_INPUT, "%s:%zu:%zu: %s%s%s", reader->path, place.line,
                     place.column, where, where[0] == '\0' ? "" : ": ", message);
}

vsh_result vshi_json_fail(const vshi_json *reader, const vshi_value *value, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const vsh_result result = fail(reader, value, false, format, arguments);
    va_end(arguments);
    return result;
}

vsh_result vshi_json_fail_key(const vshi_json *reader, const vshi_value *value, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    const vsh_result result = fail(reader, value, true, format, arguments);
    va_end(arguments);
    return result;
}

bool vshi_member(const vshi_value *object, const char *key, vshi_value *member) {
    size_t ordinal = 0;
    for (void *i = json_object_iter(object->json); i != NULL; i = json_object_iter_next(object->json, i)) {
        if (strcmp(json_object_iter_key(i), key) == 0) {
            *member = (vshi_value){object, json_object_iter_key(i), ordinal, object->depth + 1,
                                   json_object_iter_value(i)};
            return true;
        }
        ++ordinal;
    }
    return false;
}

vshi_value vshi_item(const vshi_value *array, size_t index) {
    return (vshi_value){array, NULL, index, array->depth + 1, json_array_get(array->json, index)};
}

vsh_result vshi_reject_both(const vshi_json *reader, const vshi_value *object, const char *one,
                            const char *other) {
    vshi_value a, b;
    if (!vshi_member(object, one, &a) || !vshi_member(object, other, &b)) {
        return VSH_OK;
    }
    const vshi_value *later = a.ordinal > b.ordinal ? &a : &b;
    const vshi_value *earlier = later == &a ? &b : &a;
    return vshi_json_fail_key(reader, later, "cannot stand beside \"%s\"", earlier->key);
}

vsh_result vshi_json_allocate(vshi_json *reader, void **memory, size_t count, size_t size, const char *what) {
    *memory = NULL;
    if (count == 0) {
        return VSH_OK;
    }
    vshi_json_block *block = malloc(sizeof *block);
    if (block == NULL) {
        return vshi_fail(reader->error, VSH_ERROR_MEMORY, "%s: %s: the system refused %zu bytes",
                         reader->path, what, sizeof *block);
    }
    const vsh_result result = vshi_allocate(&block->memory, count, size, what, reader->error);
    if (result != VSH_OK) {
        free(block);
        return result;
    }
    block->next = reader->blocks;
    reader->blocks = block;
    *memory = block->memory;
    return VSH_OK;
}

void vshi_blocks_free(vshi_json_block *blocks) {
    while (blocks != NULL) {
        vshi_json_block *next = blocks->next;
        free(blocks->memory);
        free(blocks);
        blocks = next;
    }
}

vsh_result vshi_json_copy(vshi_json *reader, size_t prefix, const char *string, const char **copy) {
    const size_t length = strlen(string);
    void *memory;
    VSHI_TRY(vshi_json_allocate(reader, &memory, prefix + length + 1, 1, "scene"));
    memcpy(memory, reader->path, prefix);
    memcpy((char *)memory + prefix, string, length + 1);
    *copy = memory;
    return VSH_OK;
}

vsh_result vshi_json_load(vshi_json *reader, json_t **json) {
    static const char byte_order_mark[] = "\xef\xbb\xbf"; /* editors on Windows put it in front of UTF-8 */
    if (reader->size >= 3 && memcmp(reader->text, byte_order_mark, 3) == 0) {
        reader->text += 3;
        reader->size -= 3;
    }
    const char *zero = memchr(reader->text, '\0', reader->size);
    if (zero != NULL) { /* Jansson passes over some */
        const vshi_place place = vshi_place_of(reader->text, reader->size, (size_t)(zero - reader->text));
        return vshi_fail(reader->error, VSH_ERROR_INPUT, "%s:%zu:%zu: a byte of 0, expected text",
                         reader->path, place.line, place.column);
    }
    json_error_t failure;
    errno = 0;
    *json =
        json_loadb(reader->text, reader->size, JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL, &failure);
    if (errno == ENOMEM) { /* Jansson calls it a syntax error, or cuts numbers and words short */
        json_decref(*json);
        *json = NULL;
        return vshi_fail(reader->error, VSH_ERROR_MEMORY, "%s: the system refused memory", reader->path);
    }
    if (*json != NULL) {
        return VSH_OK;
    }
    return vshi_fail(reader->error, VSH_ERROR_INPUT, "%s:%d:%d: %s", reader->path,
                     failure.line > 1 ? failure.line : 1, failure.column > 1 ? failure.column : 1,
                     failure.text);
}
