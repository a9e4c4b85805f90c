/* A file that is read piece by piece: what of it is in memory stays in the processor's cache, and takes no
 * more of it than its longest line or row. */
#ifndef VSHI_STREAM_H
#define VSHI_STREAM_H

#include "base/job.h"
#include "model/growing.h"

#include <stdint.h>
#include <stdio.h>

/* A window over the file; zeros before it is opened. */
typedef struct vshi_stream {
    const char *path;
    vshi_budget *budget;
    vshi_job *job;
    size_t units, units_done; /* of the job: for the whole file; told so far */
    FILE *file;
    uint64_t size, read; /* bytes of the file; of them read */
    char *buffer;
    size_t capacity;
    const char *at, *end; /* what is there, of which the caller moves `at`; line ends stand behind `end` */
} vshi_stream;

enum { VSHI_STREAM_PADDING = 16 }; /* line ends, of which no file tells */

/* `path`, budget and job outlive the stream. Errors: VSH_ERROR_READ (also where it is empty),
 * VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. Close after a failure too. */
vsh_result vshi_stream_open(vshi_stream *stream, const char *path, vshi_budget *budget, vshi_job *job,
                            size_t units, vsh_error *error);
void vshi_stream_close(vshi_stream *stream);

static inline bool vshi_stream_ended(const vshi_stream *stream) {
    return stream->read == stream->size;
}

/* Reads on behind what is there; pointers into the window no longer hold. At the file's end it does nothing.
 * Errors: VSH_ERROR_READ, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_stream_fill(vshi_stream *stream, vsh_error *error);

/* Reads on until at … *stop - 1 is whole lines, that end in no '\' (which goes on in the next), or the rest
 * of the file; at == *stop: it is over. */
vsh_result vshi_stream_lines(vshi_stream *stream, const char **stop, vsh_error *error);

#endif
