/* What the image writers are given, and what the readers fill. */
#ifndef VSHI_PLANES_H
#define VSHI_PLANES_H

#include "base/attributes.h"
#include "base/job.h"
#include "base/shared.h"

#include <vdbshade/image.h>

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The most values that one image may have: 8 GiB of floats. */
#define VSHI_MAX_VALUES (UINT64_C(1) << 31)

typedef struct vshi_image_plane {
    const char *name;
    const float *values; /* [height × width]; NULL: `constant` everywhere */
    float constant;
    bool is_signed;         /* -1 … 1, of which integers hold the half, and one half */
    bool is_grey;           /* vshi_grey_at() instead of all of these */
    bool is_color;          /* light: cut where it is over 1 */
    float (*encode)(float); /* into integers; NULL: as it is */
} vshi_image_plane;

/* One picture of several channels: the mean of the lights' shadows, times AO. */
typedef struct vshi_grey {
    int32_t count; /* of lights, ≥ 0 */
    const float *lights[VSH_MAX_CHANNELS];
    const float *ao; /* NULL: none */
} vshi_grey;

static inline float vshi_grey_at(const vshi_grey *grey, size_t at) {
    float sum = 0.0f;
    for (int32_t i = 0; i < grey->count; ++i) {
        sum += grey->lights[i][at];
    }
    const float light = grey->count > 0 ? sum / (float)grey->count : 1.0f;
    return grey->ao != NULL ? light * grey->ao[at] : light;
}

/* The channels of a file, in its order. */
typedef struct vshi_planes {
    int32_t width;
    int32_t height;
    int32_t count;
    vshi_image_plane planes[VSH_MAX_CHANNELS];
    vshi_grey grey;                  /* where a plane is */
    bool is_srgb;                    /* R, G and B of integers have the sRGB curve */
    char rgb[2 * VSH_CHANNEL_NAME];  /* what R, G and B are made of, beside channels by name; or empty */
    const vsh_attribute *attributes; /* [attribute_count]: looked at when the file is begun */
    size_t attribute_count;
} vshi_planes;

static inline float vshi_plane_at(const vshi_planes *planes, const vshi_image_plane *plane, size_t at) {
    const float value = plane->is_grey          ? vshi_grey_at(&planes->grey, at)
                        : plane->values != NULL ? plane->values[at]
                                                : plane->constant;
    return plane->encode != NULL ? plane->encode(value) : value;
}

/* The same as integers hold it: 0 … 1, where it is not cut. */
static inline float vshi_plane_unit_at(const vshi_planes *planes, const vshi_image_plane *plane, size_t at) {
    const float value = vshi_plane_at(planes, plane, at);
    return plane->is_signed ? 0.5f + 0.5f * value : value;
}

/* 0 … 1 to 0 … most, to nearest; NaN becomes 0 because no comparison with it holds. */
static inline uint32_t vshi_quantise(float value, uint32_t most) {
    if (!(value > 0.0f)) {
        return 0;
    }
    return value < 1.0f ? (uint32_t)((double)value * (double)most + 0.5) : most;
}

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

/* An image of zeros with empty names, within run->memory_limit; NULL is none. Errors: VSH_ERROR_INPUT (an
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

/* Has run->reader read the file, or `bytes` that stand for it (NULL: none). Errors: as vsh_image_read(). */
vsh_result vshi_image_from_reader(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                                  vsh_image_file **file, vsh_error *error);

/* As vsh_image_read(), of an image file in memory, PNG, JPEG or WebP by its first bytes, which messages call
 * `name`; `run` is a resolved one. Errors: VSH_ERROR_UNSUPPORTED too, of another kind. */
vsh_result vshi_image_read_bytes(const char *name, const void *bytes, size_t size, const vsh_run *run,
                                 vsh_image_file **file, vsh_error *error);

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
