#define _GNU_SOURCE
#include "io/model/text.h"

#include "base/decimal.h"
#include "base/file.h"
#include "base/memory.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

vsh_result vshi_reserve(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                        vsh_error *error) {
    void *array;
    size_t bytes;
    if (needed <= *capacity) {
        return VSH_OK;
    }
    if (__builtin_mul_overflow(needed, size, &bytes)) {
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "%s: %zu × %zu bytes are more than this machine can address", budget->path, needed,
                         size);
    }
    /* realloc() may keep the old array while it copies */
    VSHI_TRY(vshi_check_limit(budget->run, budget->bytes + (double)bytes, budget->path, error));
    memcpy(&array, memory, sizeof array);
    array = realloc(array, bytes);
    if (array == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused %zu bytes", budget->path, bytes);
    }
    memcpy(memory, &array, sizeof array);
    budget->bytes += (double)(needed - *capacity) * (double)size;
    *capacity = needed;
    return VSH_OK;
}

vsh_result vshi_grow(vshi_budget *budget, void *memory, size_t *capacity, size_t needed, size_t size,
                     vsh_error *error) {
    enum { LEAST = 16 };
    return needed <= *capacity
               ? VSH_OK
               : vshi_reserve(budget, memory, capacity, needed + needed / 2 + LEAST, size, error);
}

vsh_result vshi_words_number(vshi_words *words, vshi_budget *budget, const char *name, size_t size,
                             size_t *number, bool *is_new, vsh_error *error) {
    enum { LONGEST = 1023, NODE = 192 /* bytes of a member and its number in Jansson, at most */ };
    char text[LONGEST + 1];
    size = size > 0 ? strnlen(name, size < LONGEST ? size : LONGEST) : 0;
    memcpy(text, size > 0 ? name : "", size);
    text[size] = '\0';
    const json_t *known = json_object_get(words->numbers, text);
    *number = known != NULL ? (size_t)json_integer_value(known) : words->count;
    *is_new = known == NULL;
    if (known != NULL) {
        return VSH_OK;
    }
    words->used += size + 1;
    budget->bytes += (double)(size + NODE);
    VSHI_TRY(vshi_check_limit(budget->run, budget->bytes, budget->path, error));
    VSHI_TRY(VSHI_GROW(budget, words->names, words->capacity, words->count + 1, error));
    words->numbers = words->numbers != NULL ? words->numbers : json_object();
    if (json_object_set_new_nocheck(words->numbers, text, json_integer((json_int_t)words->count)) != 0) {
        return vshi_fail_memory(error, budget->path);
    }
    words->names[words->count++] = json_object_iter_key(json_object_iter_at(words->numbers, text));
    return VSH_OK;
}

void vshi_words_free(vshi_words *words) {
    json_decref(words->numbers);
    free(words->names);
    *words = (vshi_words){0};
}

vsh_result vshi_text_read(vshi_text *text, const char *path, const char *name, vshi_budget *budget,
                          vshi_job *job, size_t units, vsh_error *error) {
    enum { PADDING = 16 };
    FILE *file;
    uint64_t bytes;
    vsh_result result;
    *text = (vshi_text){.path = path, .budget = budget, .job = job, .units = units};
    VSHI_TRY(vshi_input_open(path, name, SIZE_MAX / 4, &file, &bytes, error));
    VSHI_TRY_DONE(bytes > 0
                      ? vshi_reserve(budget, &text->bytes, &text->capacity, (size_t)bytes + PADDING, 1, error)
                      : vshi_fail(error, VSH_ERROR_READ, "%s: is empty", name));
    text->size = (size_t)bytes;
    if (fread(text->bytes, 1, text->size, file) != text->size) {
        result = vshi_fail(error, VSH_ERROR_READ, "%s: %s", name,
                           ferror(file) ? strerror(errno) : "became shorter while it was read");
    }
    memset(text->bytes + text->size, '\n', PADDING);
    text->next_poll = text->bytes;
done:
    fclose(file);
    return result;
}

vsh_result vshi_text_read_whole(vshi_text *text, vshi_budget *budget, vshi_job *job, size_t units,
                                vsh_error *error) {
    /* Peak bytes for a byte of the file: text, structures of Assimp or Jansson, and our arrays. Measured on a
     * million triangles: GLB 4.2, STL 3.4. Some files unfold further (compressed FBX, many faces of few
     * vertices), so assimp.c checks the scene's size again before it copies it. */
    static const double peak = 6.0;
    VSHI_TRY(vshi_text_read(text, budget->path, budget->path, budget, job, units, error));
    return vshi_check_limit(budget->run, peak * (double)text->size, budget->path, error);
}

void vshi_text_free(vshi_text *text) {
    free(text->bytes);
    if (text->budget != NULL) {
        text->budget->bytes -= (double)text->capacity;
    }
    *text = (vshi_text){0};
}

vsh_result vshi_text_poll(vshi_text *text, const char *at, vsh_error *error) {
    enum { PIECE = 1 << 18 };
    if (at < text->next_poll && at < text->bytes + text->size) {
        return VSH_OK;
    }
    const double fraction = (double)(at - text->bytes) / (double)text->size;
    const size_t reached = (size_t)(fraction * (double)text->units);
    const size_t more = reached > text->units_done ? reached - text->units_done : 0;
    text->next_poll = at + PIECE;
    text->units_done += more;
    return vshi_job_step(text->job, more, error);
}

/* --- tokens */

static bool is_space(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

vshi_token vshi_scan_token(const char **at, const char *end) {
    const char *c = *at;
    while (c < end && is_space(*c)) {
        ++c;
    }
    vshi_token token = {c < end ? c : NULL, 0};
    while (c < end && !is_space(*c)) {
        ++c;
    }
    token.size = token.text != NULL ? (size_t)(c - token.text) : 0;
    *at = c;
    return token;
}

vshi_token vshi_scan_rest(const char *at, const char *end) {
    while (at < end && is_space(*at)) {
        ++at;
    }
    while (end > at && is_space(end[-1])) {
        --end;
    }
    return (vshi_token){at, (size_t)(end - at)};
}

bool vshi_token_is(vshi_token token, const char *text) {
    return token.size == strlen(text) && token.size > 0 && memcmp(token.text, text, token.size) == 0;
}

vshi_number vshi_token_number(vshi_token token) {
    if (token.size == 0) {
        return VSHI_NUMBER_NONE;
    }
    const char *c = token.text, *end = c + token.size;
    double ignored;
    c += *c == '-' || *c == '+';
    if (end - c >= 3 && (strncasecmp(c, "nan", 3) == 0 || strncasecmp(c, "inf", 3) == 0)) {
        return VSHI_NUMBER_NOT_FINITE; /* also "-nan(ind)" */
    }
    return vshi_decimal_read(token.text, end, &ignored) ? VSHI_NUMBER_FINITE : VSHI_NUMBER_NONE;
}

bool vshi_token_integer(vshi_token token, int64_t *value) {
    enum { DIGITS = 18 }; /* always fit int64_t */
    const size_t sign = token.size > 0 && (*token.text == '-' || *token.text == '+') ? 1 : 0;
    *value = 0;
    for (size_t i = sign; i < token.size; ++i) {
        if (i - sign >= DIGITS || token.text[i] < '0' || token.text[i] > '9') {
            return false;
        }
        *value = 10 * *value + (token.text[i] - '0');
    }
    *value = sign > 0 && *token.text == '-' ? -*value : *value;
    return token.size > sign;
}
