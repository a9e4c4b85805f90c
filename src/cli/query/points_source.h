/* Bytes from a file or a pipe, in lines or runs. */
#ifndef CLI_POINTS_SOURCE_H
#define CLI_POINTS_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef struct points_source {
    const char *name; /* for messages */
    FILE *file;       /* NULL: standard input */
    bool ended;
    char *buffer;
    size_t begin, end, room;
    uint64_t taken; /* bytes given out */
    uint64_t size;  /* of a regular file; 0: not known */
} points_source;

/* "-" is standard input. These return CLI_OK or an exit code, having said why. */
int points_source_open(const char *path, points_source *source);
void points_source_close(points_source *source);

/* The next line without its end (\n or \r\n), which is taken; *line NULL at the end of the bytes. Holds until
 * the next call. */
int points_source_line(points_source *source, const char **line, size_t *size);

/* The next `size` bytes, which are not taken; *available tells how many there are, fewer at the end only. */
int points_source_peek(points_source *source, size_t size, const char **bytes, size_t *available);
void points_source_take(points_source *source, size_t size);

#endif
