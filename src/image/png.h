/* PNG through libpng itself: files of strangers are read by it, because OpenImageIO leaves libpng's handler
 * in place, which prints to standard error; and images are written into memory, as OpenImageIO cannot. */
#ifndef VSHI_PNG_H
#define VSHI_PNG_H

#include "image/planes.h"

/* Values are 0 … 1 as they stand in the file: no gamma, no alpha multiplied in. Channels are Y, Y A, R G B or
 * R G B A. Within run->memory_limit; NULL is none. Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_png_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

/* The same of bytes in memory, which messages call `name`. */
vsh_result vshi_png_read_bytes(const char *name, const vshi_image_bytes *bytes, const vsh_run *run,
                               vsh_image_file **file, vsh_error *error);

/* An image that is to be written. */
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
