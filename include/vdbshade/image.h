/* Image files: OpenEXR through its C core, every other format through OpenImageIO. */
#ifndef VDBSHADE_IMAGE_H
#define VDBSHADE_IMAGE_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_CHANNELS = 256, VSH_CHANNEL_NAME = 128 };

/* Planes with names: a view. */
typedef struct vsh_image {
    int32_t width;
    int32_t height;
    int32_t channel_count;      /* 1 … VSH_MAX_CHANNELS */
    const char *const *names;   /* [channel_count]: "shadow.sun", "ao", "A" */
    const float *const *planes; /* [channel_count][height × width], row 0 on top */
} vsh_image;

typedef struct vsh_image_options {
    size_t struct_size;
    int32_t bits; /* 8, 16, 32; 0: 32 for EXR, else 16 where the format has it, else 8. 16 is half float in
                   * EXR and TIFF takes 16-bit integers */
    const char *
        pack; /* for formats that cannot name channels: "R=shadow.sun,G=ao,A=A"; values may be channels or the
               * numbers 0 and 1. NULL: vsh_image_default_pack(). In EXR, NULL writes every channel by name */
} vsh_image_options;

static inline vsh_image_options vsh_image_options_default(void) {
    vsh_image_options options = {sizeof(vsh_image_options), 0, NULL};
    return options;
}

/* Writes an image; the ending of `path` chooses the format. Integer formats clamp to 0 … 1 and round to
 * nearest, with no transfer curve. Atomic: written beside `path` and renamed, so a failure leaves an old file
 * alone. Errors: VSH_ERROR_ARGUMENT (bits or pack not possible in this format, unknown ending),
 * VSH_ERROR_WRITE. Thread safe. */
VSH_API vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);

/* Whether vsh_image_write() could take this path, these options and these channel names, without writing: to
 * be asked before a long bake. Tests that the folder can be written to. Same errors. */
VSH_API vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);

/* The packing that is used where none is given, as text: the first three channels that are not "A" to R, G, B
 * (one alone: to R, G and B), "A" to A where the format has alpha. Writes at most `capacity` bytes. */
VSH_API void vsh_image_default_pack(const vsh_image *image, char *text, size_t capacity);

/* An image read from a file, as float planes. Free it with vsh_image_free(). */
typedef struct vsh_image_file vsh_image_file;

/* Errors: VSH_ERROR_READ, VSH_ERROR_INPUT, VSH_ERROR_LIMIT (more than 2^31 values). */
VSH_API vsh_result vsh_image_read(const char *path, vsh_image_file **file, vsh_error *error);
VSH_API vsh_image vsh_image_view(const vsh_image_file *file); /* belongs to the file */
VSH_API void vsh_image_free(vsh_image_file *file);            /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
