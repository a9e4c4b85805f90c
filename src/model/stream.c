#define _GNU_SOURCE
#include "model/stream.h"

#include "base/decimal.h"
#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

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
    /* while it moves there are two of it */
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
    enum { LONGEST = 1023, NODE = 192 /* bytes that Jansson takes for a member and its number, at most */ };
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
    VSHI_TRY(
        vshi_grow(budget, &words->names, &words->capacity, words->count + 1, sizeof *words->names, error));
    words->numbers = words->numbers != NULL ? words->numbers : json_object();
    if (json_object_set_new_nocheck(words->numbers, text, json_integer((json_int_t)words->count)) != 0) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", budget->path);
    }
    words->names[words->count++] = json_object_iter_key(json_object_iter_at(words->numbers, text));
    return VSH_OK;
}

void vshi_words_free(vshi_words *words) {
    json_decref(words->numbers);
    free(words->names);
    *words = (vshi_words){0};
}

enum { PIECE = 1 << 18 }; /* bytes: half of a second-level cache */

bool vshi_advance_to(vshi_job *job, double fraction, size_t units, size_t *units_done) {
    const size_t reached = (size_t)(fraction * (double)units);
    const size_t more = reached > *units_done ? reached - *units_done : 0;
    *units_done += more;
    return vshi_job_advance(job, more);
}

vsh_result vshi_stream_open(vshi_stream *stream, const char *path, vshi_budget *budget, vshi_job *job,
                            size_t units, vsh_error *error) {
    *stream = (vshi_stream){.path = path, .budget = budget, .job = job, .units = units};
    VSHI_TRY(vshi_input_open(path, path, SIZE_MAX / 4, &stream->file, &stream->size, error));
    if (stream->size == 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is empty", path);
    }
    const size_t bytes = stream->size < PIECE ? (size_t)stream->size : PIECE;
    VSHI_TRY(vshi_reserve(budget, &stream->buffer, &stream->capacity, bytes + VSHI_STREAM_PADDING, 1, error));
    stream->at = stream->end = stream->buffer;
    return VSH_OK;
}

void vshi_stream_close(vshi_stream *stream) {
    if (stream->file != NULL) {
        fclose(stream->file);
    }
    free(stream->buffer);
    if (stream->budget != NULL) {
        stream->budget->bytes -= (double)stream->capacity;
    }
    *stream = (vshi_stream){0};
}

/* Moves what is there to the front, and makes room behind it. */
static vsh_result make_room(vshi_stream *stream, vsh_error *error) {
    const size_t left = (size_t)(stream->end - stream->at), offset = (size_t)(stream->at - stream->buffer);
    if (offset == 0 && stream->end != stream->buffer) { /* one line or row: it is longer than the window */
        VSHI_TRY(
            vshi_reserve(stream->budget, &stream->buffer, &stream->capacity, 2 * stream->capacity, 1, error));
    }
    memmove(stream->buffer, stream->buffer + offset, left);
    stream->at = stream->buffer;
    stream->end = stream->buffer + left;
    return VSH_OK;
}

vsh_result vshi_stream_fill(vshi_stream *stream, vsh_error *error) {
    if (vshi_stream_ended(stream)) {
        return VSH_OK;
    }
    VSHI_TRY(make_room(stream, error));
    const size_t used = (size_t)(stream->end - stream->buffer);
    const size_t room = stream->capacity - VSHI_STREAM_PADDING - used;
    const uint64_t rest = stream->size - stream->read;
    ssize_t got;
    do {
        got = read(fileno(stream->file), stream->buffer + used, rest < room ? (size_t)rest : room);
    } while (got < 0 && errno == EINTR);
    if (got <= 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: %s", stream->path,
                         got < 0 ? strerror(errno) : "became shorter while it was read");
    }
    stream->read += (uint64_t)got;
    stream->end += got;
    memset(stream->buffer + used + got, '\n', VSHI_STREAM_PADDING);
    return vshi_advance_to(stream->job, (double)stream->read / (double)stream->size, stream->units,
                           &stream->units_done)
               ? vshi_job_fail_cancelled(stream->job, error)
               : VSH_OK;
}

/* Behind the last line that does not go on in the next; NULL: there is none. */
static const char *last_line(const char *begin, const char *end) {
    while (end > begin) {
        const char *stop = memrchr(begin, '\n', (size_t)(end - begin));
        if (stop == NULL) {
            return NULL;
        }
        const char *last = stop > begin && stop[-1] == '\r' ? stop - 1 : stop;
        if (last == begin || last[-1] != '\\') {
            return stop + 1;
        }
        end = stop;
    }
    return NULL;
}

vsh_result vshi_stream_lines(vshi_stream *stream, const char **stop, vsh_error *error) {
    for (;;) {
        *stop = vshi_stream_ended(stream) ? stream->end : last_line(stream->at, stream->end);
        if (*stop != NULL) {
            return VSH_OK;
        }
        VSHI_TRY(vshi_stream_fill(stream, error));
    }
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
        return VSHI_NUMBER_NOT_FINITE; /* "-nan(ind)", too */
    }
    return vshi_decimal_read(token.text, end, &ignored) ? VSHI_NUMBER_FINITE : VSHI_NUMBER_NONE;
}

bool vshi_token_integer(vshi_token token, int64_t *value) {
    enum { DIGITS = 18 }; /* any so many digits fit int64_t */
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
