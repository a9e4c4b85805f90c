/* Reads files of JSON into memory of their own, and finds the place of every error. */
#include "io/json.h"

#include "base/bytes.h"
#include "base/file.h"
#include "base/memory.h"

#include <errno.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    MAX_BYTES = 64 << 20,
    MAX_DEPTH = 256, /* SDF trees, the deepest values, end at 64 levels of two steps each */
    MAX_PATH_TEXT = 320,
    MAX_KEY_TEXT = 48,
    PARSE_FLAGS = JSON_REJECT_DUPLICATES | JSON_DECODE_INT_AS_REAL
};

/* --- places: Jansson tells the position of syntax errors only */

typedef struct place {
    size_t line;   /* from 1 */
    size_t column; /* from 1, in characters of UTF-8, as Jansson counts */
} place;

typedef struct cursor {
    const char *text;
    size_t size;
    size_t at;
} cursor;

static int peek(const cursor *c) {
    return c->at < c->size ? (unsigned char)c->text[c->at] : -1;
}

static void skip_space(cursor *c) {
    while (peek(c) == ' ' || peek(c) == '\t' || peek(c) == '\n' || peek(c) == '\r') {
        ++c->at;
    }
}

/* The text is valid, so Jansson finds the value's end. */
static void skip_value(cursor *c) {
    static const size_t flags = PARSE_FLAGS | JSON_DECODE_ANY | JSON_DISABLE_EOF_CHECK;
    json_error_t end = {.position = 0};
    json_decref(json_loadb(c->text + c->at, c->size - c->at, flags, &end));
    c->at += (size_t)end.position;
}

/* Moves the cursor from an object or array to its child `ordinal`, and *key to the child's key. */
static bool enter(cursor *c, size_t ordinal, size_t *key) {
    const bool object = peek(c) == '{';
    if (!object && peek(c) != '[') {
        return false;
    }
    ++c->at;
    for (size_t i = 0;; ++i) {
        skip_space(c);
        if (peek(c) == -1 || peek(c) == '}' || peek(c) == ']') {
            return false;
        }
        *key = c->at;
        if (object) {
            skip_value(c);
            skip_space(c);
            ++c->at; /* the colon */
            skip_space(c);
        }
        if (i == ordinal) {
            return true;
        }
        skip_value(c);
        skip_space(c);
        if (peek(c) == ',') {
            ++c->at;
        }
    }
}

/* Returns the line and column of byte `at`. */
static place place_of(const vshi_json *reader, size_t at) {
    place found = {1, 1};
    for (size_t i = 0; i < at && i < reader->size; ++i) {
        if (reader->text[i] == '\n') {
            ++found.line;
            found.column = 1;
        } else if (((unsigned char)reader->text[i] & 0xc0) != 0x80) { /* not inside a UTF-8 character */
            ++found.column;
        }
    }
    return found;
}

/* Returns where a value, or its `key`, begins. Counts members instead of comparing names, so that escapes in
 * keys need no decoding: Jansson keeps the order of the text and rejects duplicates. If the text has no such
 * path, returns the last place on it. */
static place locate(const vshi_json *reader, const vshi_value *value, bool key) {
    size_t ordinals[MAX_DEPTH];
    while (value->depth > MAX_DEPTH) {
        value = value->parent;
    }
    const size_t depth = value->depth;
    for (; value->depth > 0; value = value->parent) {
        ordinals[value->depth - 1] = value->ordinal;
    }
    cursor c = {reader->text, reader->size, 0};
    skip_space(&c);
    size_t found = c.at;
    for (size_t i = 0; i < depth; ++i) {
        size_t key_at = c.at;
        if (!enter(&c, ordinals[i], &key_at)) {
            break;
        }
        found = key && i + 1 == depth ? key_at : c.at;
    }
    return place_of(reader, found);
}

/* --- errors */

/* "lights[0].angle_deg" */
static void append_path(char *text, const vshi_value *value) {
    if (value->parent == NULL) {
        return;
    }
    append_path(text, value->parent);
    char *end = text + strlen(text);
    const size_t room = MAX_PATH_TEXT - (size_t)(end - text); /* a longer path is cut */
    if (value->key == NULL) {
        snprintf(end, room, "[%zu]", value->ordinal);
        return;
    }
    int length = (int)strnlen(value->key, MAX_KEY_TEXT + 1);
    const bool cut = length > MAX_KEY_TEXT;
    while (cut && length > 0 && ((unsigned char)value->key[length] & 0xc0) == 0x80) {
        --length; /* not inside a UTF-8 character */
    }
    snprintf(end, room, "%s%.*s%s", text[0] == '\0' ? "" : ".", length, value->key, cut ? "…" : "");
}

__attribute__((format(printf, 4, 0))) static vsh_result
fail(const vshi_json *reader, const vshi_value *value, bool key, const char *format, va_list arguments) {
    const place at = locate(reader, value, key);
    char where[MAX_PATH_TEXT] = "", message[512];
    append_path(where, value);
    if (vsnprintf(message, sizeof message, format, arguments) < 0) {
        message[0] = '\0';
    }
    return vshi_fail(reader->error, VSH_ERROR_INPUT, "%s:%zu:%zu: %s%s%s", reader->path, at.line, at.column,
                     where, where[0] == '\0' ? "" : ": ", message);
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

/* --- values */

bool vshi_next_member(const vshi_value *object, vshi_value *member) {
    const bool first = member->json == NULL;
    void *at = first ? json_object_iter(object->json)
                     : json_object_iter_next(object->json, json_object_iter_at(object->json, member->key));
    if (at != NULL) {
        *member = (vshi_value){object, json_object_iter_key(at), first ? 0 : member->ordinal + 1,
                               object->depth + 1, json_object_iter_value(at)};
    }
    return at != NULL;
}

bool vshi_member(const vshi_value *object, const char *key, vshi_value *member) {
    vshi_value at = {.json = NULL};
    while (vshi_next_member(object, &at)) {
        if (strcmp(at.key, key) == 0) {
            *member = at;
            return true;
        }
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

/* --- memory */

struct vshi_json_block {
    vshi_json_block *next;
    max_align_t contents[];
};

static vsh_result allocate_block(size_t count, size_t size, const char *what, vshi_json_block **block,
                                 vsh_error *error) {
    const bool fits = count <= (SIZE_MAX / 2 - sizeof **block) / size;
    return fits ? vshi_allocate((void **)block, 1, sizeof **block + count * size, what, error)
                : vshi_fail(error, VSH_ERROR_MEMORY,
                            "%s: %zu × %zu bytes are more than this machine can address", what, count, size);
}

static void free_blocks(vshi_json_block *block) {
    while (block != NULL) {
        vshi_json_block *next = block->next;
        free(block);
        block = next;
    }
}

vsh_result vshi_json_allocate(vshi_json *reader, void **memory, size_t count, size_t size, const char *what) {
    *memory = NULL;
    if (count == 0) {
        return VSH_OK;
    }
    vshi_json_block *block = NULL;
    VSHI_TRY(allocate_block(count, size, what, &block, reader->error));
    block->next = reader->blocks;
    reader->blocks = block;
    *memory = block->contents;
    return VSH_OK;
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

void vshi_json_free(void *made) {
    if (made != NULL) {
        free_blocks((vshi_json_block *)(void *)((char *)made - offsetof(vshi_json_block, contents)));
    }
}

/* --- files */

static vsh_result load(vshi_json *reader, json_t **json) {
    static const char byte_order_mark[] = "\xef\xbb\xbf"; /* editors on Windows put it in front of UTF-8 */
    if (reader->size >= 3 && memcmp(reader->text, byte_order_mark, 3) == 0) {
        reader->text += 3;
        reader->size -= 3;
    }
    const char *zero = memchr(reader->text, '\0', reader->size);
    if (zero != NULL) { /* Jansson ignores some zeros */
        const place at = place_of(reader, (size_t)(zero - reader->text));
        return vshi_fail(reader->error, VSH_ERROR_INPUT, "%s:%zu:%zu: a byte of 0, expected text",
                         reader->path, at.line, at.column);
    }
    json_error_t failure;
    errno = 0;
    *json = json_loadb(reader->text, reader->size, PARSE_FLAGS, &failure);
    if (errno == ENOMEM) { /* Jansson reports a syntax error, or cuts numbers and words */
        return vshi_fail_memory(reader->error, reader->path);
    }
    return *json != NULL ? VSH_OK
                         : vshi_fail(reader->error, VSH_ERROR_INPUT, "%s:%d:%d: %s", reader->path,
                                     failure.line > 1 ? failure.line : 1,
                                     failure.column > 1 ? failure.column : 1, failure.text);
}

vsh_result vshi_json_parse(vshi_json *reader, size_t size, vshi_read_fn *read, void **made) {
    json_t *json = NULL;
    vshi_json_block *block = NULL;
    vsh_result result;
    *made = NULL;
    VSHI_TRY_DONE(load(reader, &json));
    VSHI_TRY_DONE(allocate_block(1, size, reader->path, &block, reader->error));
    result = read(reader, &(vshi_value){.json = json}, block->contents);
    block->next = reader->blocks;
    if (result != VSH_OK) {
        free_blocks(block);
        goto done;
    }
    *made = block->contents;
done:
    json_decref(json);
    return result;
}

static vsh_result read_all(const char *path, char **text, size_t *size, vsh_error *error) {
    FILE *file;
    uint64_t bytes;
    VSHI_TRY(vshi_input_open(path, path, MAX_BYTES, &file, &bytes, error));
    *text = malloc((size_t)bytes + 1);
    *size = *text != NULL ? fread(*text, 1, (size_t)bytes, file) : 0;
    const bool failed = ferror(file) != 0;
    fclose(file);
    return *text == NULL ? vshi_fail_memory(error, path)
           : failed      ? vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path)
                         : VSH_OK;
}

vsh_result vshi_json_read(vshi_json *reader, size_t size, vshi_read_fn *read, void **made) {
    vsh_error *error = reader->error;
    char *text = NULL;
    vsh_result result;
    *made = NULL;
    VSHI_TRY_DONE(read_all(reader->path, &text, &reader->size, error));
    VSHI_TRY_DONE(vshi_check_limit(reader->run, vshi_json_bytes(text, reader->size), reader->path, error));
    reader->text = text;
    result = vshi_json_parse(reader, size, read, made);
done:
    free(text);
    return result;
}
