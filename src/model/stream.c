#define _GNU_SOURCE
#include "model/stream.h"

#include "base/input.h"
#include "base/try.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PIECE = 1 << 18 }; /* bytes: half of a second-level cache */

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

static vsh_result tell_job(vshi_stream *stream, vsh_error *error) {
    const double fraction = (double)stream->read / (double)stream->size;
    const size_t reached = (size_t)(fraction * (double)stream->units);
    const size_t more = reached > stream->units_done ? reached - stream->units_done : 0;
    stream->units_done += more;
    return vshi_job_advance(stream->job, more) ? vshi_job_fail_cancelled(stream->job, error) : VSH_OK;
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
    return tell_job(stream, error);
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
