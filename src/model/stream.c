#define _GNU_SOURCE
#include "model/stream.h"

#include "base/hash.h"
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

enum { LONGEST = 1023 };

static uint64_t hash_of(const char *name, size_t size) {
    uint64_t hash = size;
    for (size_t i = 0; i < size; ++i) {
        hash = vshi_mix(hash ^ (unsigned char)name[i]);
    }
    return hash;
}

/* The slot of a name, or the empty one where it would be. There is always an empty one. */
static uint32_t *slot_of(const vshi_words *words, const char *name, size_t size) {
    const size_t mask = words->slot_count - 1;
    size_t at = hash_of(name, size) & mask;
    for (; words->slots[at] != 0; at = (at + 1) & mask) {
        const char *known = vshi_words_at(words, words->slots[at] - 1);
        if (strncmp(known, name, size) == 0 && known[size] == '\0') {
            break;
        }
    }
    return &words->slots[at];
}

static vsh_result grow_slots(vshi_words *words, vshi_budget *budget, vsh_error *error) {
    enum { FIRST = 64 };
    if (words->count < words->slot_count / 2) {
        return VSH_OK;
    }
    const size_t slots = words->slot_count > 0 ? 2 * words->slot_count : FIRST;
    VSHI_TRY(vshi_reserve(budget, &words->slots, &words->slot_capacity, slots, sizeof *words->slots, error));
    words->slot_count = slots;
    memset(words->slots, 0, slots * sizeof *words->slots);
    for (size_t i = 0; i < words->count; ++i) {
        const char *name = vshi_words_at(words, i);
        *slot_of(words, name, strlen(name)) = (uint32_t)i + 1;
    }
    return VSH_OK;
}

vsh_result vshi_words_number(vshi_words *words, vshi_budget *budget, const char *name, size_t size,
                             size_t *number, bool *is_new, vsh_error *error) {
    size = size > 0 ? strnlen(name, size < LONGEST ? size : LONGEST) : 0;
    VSHI_TRY(grow_slots(words, budget, error));
    uint32_t *slot = slot_of(words, name, size);
    *is_new = *slot == 0;
    if (*is_new) {
        VSHI_TRY(vshi_grow(budget, &words->text, &words->text_capacity, words->used + size + 1, 1, error));
        VSHI_TRY(vshi_grow(budget, &words->begins, &words->capacity, words->count + 1, sizeof *words->begins,
                           error));
        memcpy(words->text + words->used, name, size);
        words->text[words->used + size] = '\0';
        words->begins[words->count++] = words->used;
        words->used += size + 1;
        *slot = (uint32_t)words->count;
    }
    *number = *slot - 1;
    return VSH_OK;
}

void vshi_words_free(vshi_words *words) {
    free(words->slots);
    free(words->begins);
    free(words->text);
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

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
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

static const char *skip_digits(const char *c, const char *end) {
    while (c < end && is_digit(*c)) {
        ++c;
    }
    return c;
}

vshi_number vshi_token_number(vshi_token token) {
    if (token.size == 0) {
        return VSHI_NUMBER_NONE;
    }
    const char *c = token.text, *end = c + token.size;
    c += *c == '-' || *c == '+';
    if (end - c >= 3 && (strncasecmp(c, "nan", 3) == 0 || strncasecmp(c, "inf", 3) == 0)) {
        return VSHI_NUMBER_NOT_FINITE;
    }
    const char *digits = c;
    c = skip_digits(c, end);
    ptrdiff_t count = c - digits;
    if (c < end && *c == '.') {
        const char *fraction = ++c;
        c = skip_digits(c, end);
        count += c - fraction;
    }
    if (count == 0) {
        return VSHI_NUMBER_NONE;
    }
    if (c < end && (*c == 'e' || *c == 'E')) {
        ++c;
        c += c < end && (*c == '-' || *c == '+');
        const char *exponent = c;
        c = skip_digits(c, end);
        if (c == exponent) {
            return VSHI_NUMBER_NONE;
        }
    }
    return c == end ? VSHI_NUMBER_FINITE : VSHI_NUMBER_NONE;
}

bool vshi_token_integer(vshi_token token, int64_t *value) {
    enum { DIGITS = 18 }; /* what fits int64_t whatever the digits */
    if (token.size == 0) {
        return false;
    }
    const char *c = token.text, *end = c + token.size;
    const bool negative = *c == '-';
    c += *c == '-' || *c == '+';
    if (c == end || end - c > DIGITS || skip_digits(c, end) != end) {
        return false;
    }
    *value = 0;
    for (; c < end; ++c) {
        *value = 10 * *value + (*c - '0');
    }
    *value = negative ? -*value : *value;
    return true;
}
