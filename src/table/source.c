#include "table/source.h"

#include "base/input.h"
#include "base/try.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { ROOM = 1 << 18, MOST = 1 << 26 /* bytes of a line or run */ };

static vsh_result open_standard(vshi_source *source, vsh_error *error) {
    struct stat status;
    if (fstat(STDIN_FILENO, &status) != 0 || S_ISDIR(status.st_mode)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: it is a folder", source->name);
    }
    source->size = S_ISREG(status.st_mode) ? (uint64_t)status.st_size : 0;
    return VSH_OK;
}

vsh_result vshi_source_open(const char *path, uint64_t most, vshi_source *source, vsh_error *error) {
    *source = (vshi_source){.name = path != NULL ? path : "standard input", .room = ROOM};
    VSHI_TRY(path != NULL ? vshi_input_open(path, path, most, &source->file, &source->size, error)
                          : open_standard(source, error));
    source->buffer = malloc(source->room);
    return source->buffer != NULL
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", source->name);
}

void vshi_source_close(vshi_source *source) {
    if (source->file != NULL) {
        fclose(source->file);
    }
    free(source->buffer);
    source->buffer = NULL;
    source->file = NULL;
}

/* Some more bytes behind those that there are, which may move. */
static vsh_result fill(vshi_source *s, vsh_error *error) {
    if (s->begin > 0 && s->end == s->room) {
        memmove(s->buffer, s->buffer + s->begin, s->end - s->begin);
        s->end -= s->begin;
        s->begin = 0;
    }
    if (s->end == s->room) {
        char *more = s->room < MOST ? realloc(s->buffer, 2 * s->room) : NULL;
        if (more == NULL) {
            return vshi_fail(error, s->room < MOST ? VSH_ERROR_MEMORY : VSH_ERROR_INPUT,
                             "%s: a row of more than %zu bytes", s->name, s->room);
        }
        s->buffer = more;
        s->room *= 2;
    }
    ssize_t got;
    do {
        got = read(s->file != NULL ? fileno(s->file) : STDIN_FILENO, s->buffer + s->end, s->room - s->end);
    } while (got < 0 && errno == EINTR);
    if (got < 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", s->name, strerror(errno));
    }
    s->ended = got == 0;
    s->end += (size_t)got;
    return s->job != NULL && vshi_job_advance(s->job, (size_t)got) ? vshi_job_fail_cancelled(s->job, error)
                                                                   : VSH_OK;
}

vsh_result vshi_source_line(vshi_source *s, const char **line, size_t *size, vsh_error *error) {
    *line = NULL;
    for (size_t looked = 0;;) {
        char *start = s->buffer + s->begin;
        const size_t held = s->end - s->begin;
        const char *stop = memchr(start + looked, '\n', held - looked);
        if (stop != NULL || (s->ended && held > 0)) {
            const size_t length = stop != NULL ? (size_t)(stop - start) : held;
            vshi_source_take(s, length + (stop != NULL));
            *line = start;
            *size = length - (length > 0 && start[length - 1] == '\r');
            return VSH_OK;
        }
        if (s->ended) {
            return VSH_OK;
        }
        looked = held;
        VSHI_TRY(fill(s, error));
    }
}

vsh_result vshi_source_peek(vshi_source *s, size_t size, const char **bytes, size_t *available,
                            vsh_error *error) {
    while (s->end - s->begin < size && !s->ended) {
        VSHI_TRY(fill(s, error));
    }
    *bytes = s->buffer + s->begin;
    *available = s->end - s->begin < size ? s->end - s->begin : size;
    return VSH_OK;
}

void vshi_source_take(vshi_source *s, size_t size) {
    s->begin += size;
    s->taken += size;
}

void vshi_source_give_back(vshi_source *s, const char *line) {
    const size_t size = (size_t)(s->buffer + s->begin - line);
    s->begin -= size;
    s->taken -= size;
}

vsh_result vshi_source_pass_mark(vshi_source *s, vsh_error *error) {
    static const char mark[] = {'\xef', '\xbb', '\xbf'};
    const char *bytes;
    size_t available;
    VSHI_TRY(vshi_source_peek(s, sizeof mark, &bytes, &available, error));
    if (available == sizeof mark && memcmp(bytes, mark, sizeof mark) == 0) {
        vshi_source_take(s, sizeof mark);
    }
    return VSH_OK;
}
