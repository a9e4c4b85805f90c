/* Triangle strips of a PLY file (the element tristrips of the Stanford scans), which Assimp 5.2 takes for one
 * face each: made into faces before it reads the file. */
#ifndef VSHI_PLY_STRIPS_H
#define VSHI_PLY_STRIPS_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Where the strips are in a file's text, and what their lists are like: lists of indices, -1 begins another
 * strip. */
typedef struct vshi_ply_strips {
    const char *header, *header_end; /* the element's lines; NULL: it has none */
    const char *body, *body_end;
    uint64_t rows, vertices;
    int count_size, index_size; /* bytes, of a list's count and of its indices */
    bool is_signed, ascii, big_endian;
    size_t triangles;
} vshi_ply_strips;

/* Reads the rows from `body` on up to `end` at most: sets body_end and triangles. Errors: VSH_ERROR_READ
 * where they end early, VSH_ERROR_INPUT. */
vsh_result vshi_ply_strips_scan(vshi_ply_strips *strips, const char *path, const char *end, vsh_error *error);

/* Bytes that a file takes whose strips are faces. */
double vshi_ply_strips_bytes(const vshi_ply_strips *strips, size_t size);

/* Makes it, of a text that was scanned, as *made, *made_size, which the caller frees. Errors:
 * VSH_ERROR_MEMORY. */
vsh_result vshi_ply_strips_unroll(const vshi_ply_strips *strips, const char *path, const char *text,
                                  size_t size, char **made, size_t *made_size, vsh_error *error);

#endif
