/* PNG through libpng itself: OpenImageIO takes longer to load than a small bake takes, leaves libpng's
 * handler in place, which prints to standard error, and writes into no memory. */
#ifndef VSHI_PNG_H
#define VSHI_PNG_H

#include "image/format.h"
#include "image/planes.h"

/* Values are 0 … 1 as they stand in the file: no gamma, no alpha multiplied in. Channels are Y, Y A, R G B or
 * R G B A. Within run->memory_limit; NULL is none. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_png_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

/* The same of bytes in memory, which messages call `name`. */
vsh_result vshi_png_read_bytes(const char *name, const vshi_image_bytes *bytes, const vsh_run *run,
                               vsh_image_file **file, vsh_error *error);

extern const vshi_format vshi_png_format;

/* A file under way. */
typedef struct vshi_png_writer vshi_png_writer;

/* Begins in the existing file `temporary`; messages name `path`, which is to live as long. Of the planes,
 * size, number and attributes are used: 1 … 4 of them, Y, Y A, R G B or R G B A. `bits` is 8 or 16. Its
 * texts are the program, the attributes, and vdbshade_color_space. End with vshi_png_end(). Errors:
 * VSH_ERROR_WRITE, VSH_ERROR_MEMORY. One thread at a time. */
vsh_result vshi_png_begin(const char *temporary, const char *path, const vshi_planes *planes, int32_t bits,
                          vshi_png_writer **writer, vsh_error *error);

/* The next rows, of the planes given at the beginning, with `values` [rows × width]. Same errors. */
vsh_result vshi_png_add(vshi_png_writer *writer, const vshi_planes *planes, int32_t rows, vsh_error *error);

/* Closes the file and frees the writer; NULL does nothing. Same errors. */
vsh_result vshi_png_end(vshi_png_writer *writer, vsh_error *error);

/* Bytes that a writer takes. */
double vshi_png_writer_bytes(const vshi_planes *planes, int32_t bits);

/* An image that is to be written into memory. */
typedef struct vshi_png_source {
    int32_t width, height;
    int32_t channels; /* 1 or 3 */
    int32_t bits;     /* 8 or 16 */
    /* Fills row y as it stands in the file: [width][channels], of 16 bits the higher byte first. */
    void (*row)(void *user, int32_t y, unsigned char *bytes);
    void *user;
} vshi_png_source;

/* The bytes of a PNG file, *size of them, which free() takes. The same for the same values and the same
 * libpng and zlib. Errors: VSH_ERROR_LIMIT (libpng's), VSH_ERROR_MEMORY, naming `what`. Thread safe. */
vsh_result vshi_png_encode(const vshi_png_source *source, const char *what, unsigned char **bytes,
                           size_t *size, vsh_error *error);

#endif
