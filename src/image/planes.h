/* Image files in memory: what the readers fill, and how a reader process hands it over. */
#ifndef VSHI_PLANES_H
#define VSHI_PLANES_H

#include "base/attributes.h"
#include "base/job.h"

#include <vdbshade/image.h>

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The most values that one image may have: 8 GiB of floats. */
#define VSHI_MAX_VALUES (UINT64_C(1) << 31)

enum { VSHI_FILE_NAME = 256 }; /* EXR's longest channel name is 255 bytes */

struct vsh_image_file {
    int32_t width;
    int32_t height;
    int32_t channel_count;
    float *values; /* the planes, one after the other */
    char (*text)[VSHI_FILE_NAME];
    const char *names[VSH_MAX_CHANNELS];
    const float *planes[VSH_MAX_CHANNELS];
    vshi_attributes attributes;
};

/* VSH_ERROR_LIMIT where the product passes VSHI_MAX_VALUES; all three are positive. */
vsh_result vshi_check_values(const char *path, int64_t width, int64_t height, int64_t channels,
                             vsh_error *error);

/* An image of zeros with empty names, within run->memory_limit; NULL is none. Errors: VSH_ERROR_READ (an
 * extent that is not positive), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_image_file_new(const char *path, const vsh_run *run, int64_t width,
                                           int64_t height, int64_t channels, vsh_image_file **file,
                                           vsh_error *error);

/* The stage "load" of so many units. Errors: VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_image_job(const char *path, const vsh_run *run, int64_t units, vshi_job **job,
                                      vsh_error *error);

/* Cut to VSHI_FILE_NAME, without control characters. */
VSHI_SHARED void vshi_image_file_name(vsh_image_file *file, int32_t channel, const char *name);

/* An image file that lies in memory. */
typedef struct vshi_image_bytes {
    const void *at;
    size_t size;
    const char *format; /* OpenImageIO's name of it */
} vshi_image_bytes;

/* As vsh_image_read(), of an image file in memory, PNG, JPEG or WebP by its first bytes, which messages call
 * `name`; `run` is a resolved one. Errors: VSH_ERROR_UNSUPPORTED too, of another kind. */
vsh_result vshi_image_read_bytes(const char *name, const void *bytes, size_t size, const vsh_run *run,
                                 vsh_image_file **file, vsh_error *error);

/* The plane of a channel, or NULL. */
const float *vshi_image_find_plane(const vsh_image *image, const char *name);

/* Whether images of this ending are written. */
bool vshi_image_is_written(const char *path);

struct vshi_decoder;
struct vshi_encoder;

/* Parses in a reader, and puts what is handed over. */
vsh_result vshi_serve_image(const char *path, struct vshi_decoder *request, const vsh_run *run,
                            struct vshi_encoder *payload, vsh_error *error);

/* What a reader has handed over; everything in it is checked. Errors: VSH_ERROR_READ where it does not hold,
 * and as for what was made in this process. */
vsh_result vshi_image_decode(struct vshi_decoder *decoder, const char *path, vsh_image_file **file,
                             vsh_error *error);

#ifdef __cplusplus
}
#endif
#endif
