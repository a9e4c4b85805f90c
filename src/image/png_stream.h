/* libpng as a writer of rows: what it says and its jumps stay within, and its bytes go where they are sent.
 */
#ifndef VSHI_PNG_STREAM_H
#define VSHI_PNG_STREAM_H

#include "base/attributes.h"

#include <png.h>

/* Where the bytes go. False: memory was refused. */
typedef bool vshi_png_put(void *user, const unsigned char *bytes, size_t size);

typedef struct vshi_png_header {
    int32_t width, height;
    int32_t channels;           /* 1: Y, 2: Y A, 3: R G B, 4: R G B A */
    int32_t bits;               /* 8 or 16 */
    bool is_srgb;               /* says so: with chunks sRGB, gAMA and cHRM */
    const vsh_attribute *texts; /* [text_count], ahead of the rows */
    size_t text_count;
} vshi_png_header;

/* Begins as zeros; its address is to stay. */
typedef struct vshi_png_stream {
    png_structp png;
    png_infop info;
    vshi_png_put *put;
    void *user;
    bool memory; /* was refused */
    char message[200];
} vshi_png_stream;

/* Writes what stands before the rows. Of all three: false where it failed, with `memory` or a `message`. */
bool vshi_png_stream_begin(vshi_png_stream *stream, const vshi_png_header *header, vshi_png_put *put,
                           void *user);

/* The next row as it stands in the file: [width][channels], of 16 bits the higher byte first. */
bool vshi_png_stream_row(vshi_png_stream *stream, const unsigned char *row);

/* What stands behind the rows, all of which were given. */
bool vshi_png_stream_end(vshi_png_stream *stream);

void vshi_png_stream_free(vshi_png_stream *stream);

#endif
