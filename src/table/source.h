/* Bytes of a file or a pipe, in lines or runs. */
#ifndef VSHI_SOURCE_H
#define VSHI_SOURCE_H

#include "base/job.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* Begins as zeros. Functions fail with VSH_ERROR_READ, VSH_ERROR_MEMORY, and as they say. */
typedef struct vshi_source {
    const char *name; /* for messages */
    vshi_job *job; /* takes the bytes that are read as units, and may cancel (VSH_ERROR_CANCELLED); or NULL */
    FILE *file;    /* NULL: standard input */
    bool ended;
    char *buffer;
    size_t begin, end, room;
    uint64_t taken; /* bytes given out */
    uint64_t size;  /* of a regular file; 0: not known */
} vshi_source;

/* Opens a regular file of at most `most` bytes, or (NULL) standard input. Errors: as of vshi_input_open().
 * Close it in any case. */
vsh_result vshi_source_open(const char *path, uint64_t most, vshi_source *source, vsh_error *error);
void vshi_source_close(vshi_source *source);

/* Takes a byte order mark, if the next bytes are one. */
vsh_result vshi_source_pass_mark(vshi_source *source, vsh_error *error);

/* The next line without its end (\n or \r\n), which is taken; *line NULL at the end of the bytes. Holds until
 * the next call. Errors: VSH_ERROR_INPUT (longer than 64 MiB). */
vsh_result vshi_source_line(vshi_source *source, const char **line, size_t *size, vsh_error *error);

/* The next `size` bytes, which are not taken; *available tells how many there are, fewer at the end only.
 * Errors: VSH_ERROR_INPUT (more than 64 MiB). */
vsh_result vshi_source_peek(vshi_source *source, size_t size, const char **bytes, size_t *available,
                            vsh_error *error);
void vshi_source_take(vshi_source *source, size_t size);

/* Gives back the line that was taken last. */
void vshi_source_give_back(vshi_source *source, const char *line);

#endif
