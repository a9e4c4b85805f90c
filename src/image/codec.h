/* Codecs: what writes and reads the rows of an image file, and what each format can hold. */
#ifndef VSHI_CODEC_H
#define VSHI_CODEC_H

#include "image/planes.h"

#ifdef __cplusplus
extern "C" {
#endif

/* --- channels on their way into a file */

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
    char rgb[2 * VSH_CHANNEL_NAME];  /* VSH_IMAGE_RGB: the named channels that R, G and B show; or empty */
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

/* --- formats */

enum { VSHI_BITS_8 = 1, VSHI_BITS_16 = 2, VSHI_BITS_32 = 4 };

typedef struct vshi_format {
    const char *name; /* OpenImageIO's, where that writes it */
    int32_t bits;     /* VSHI_BITS_… that it can be written with: 8 and 16 are integers, 32 is float */
    bool alpha;       /* keeps A, and R, G and B where A is 0 */
    bool grey;        /* one channel, R */
    bool named;       /* EXR: any channels, by their names; 16 bits are half floats */
    int32_t max_size; /* pixels along a side */
    double held;      /* bytes a value that the writer keeps until the end, over those of the value itself */
} vshi_format;

/* A writer belongs to one thread at a time. */
typedef struct vshi_codec {
    /* Begins a file of planes in the existing file `temporary`; messages name `path`. Both are to live as
     * long as the writer. `bits` is one that the format has; names and values of the planes may change.
     * Errors: VSH_ERROR_WRITE, VSH_ERROR_UNSUPPORTED, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
    vsh_result (*begin)(const char *temporary, const char *path, const vshi_format *format,
                        const vshi_planes *planes, int32_t bits, void **writer, vsh_error *error);

    /* The next rows, of the planes given at the beginning, with `values` [rows × width]. Same errors. */
    vsh_result (*add)(void *writer, const vshi_planes *planes, int32_t rows, vsh_error *error);

    /* Closes the file and frees the writer; NULL does nothing. Same errors. */
    vsh_result (*end)(void *writer, vsh_error *error);

    /* Bytes that a writer takes at most. */
    double (*bytes)(const vshi_format *format, const vshi_planes *planes, int32_t bits);
} vshi_codec;

/* --- OpenEXR, through its C core: scan lines (ZIP) */

extern const vshi_codec vshi_exr_codec;

/* Reads the first part of a file, scan lines or the finest level of tiles; half and integers become float.
 * All readers stay within run->memory_limit; a NULL run has no limit. Errors: VSH_ERROR_READ,
 * VSH_ERROR_INPUT, VSH_ERROR_UNSUPPORTED (deep data, subsampled channels, DWA), VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_exr_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

/* --- PNG, through libpng itself: OpenImageIO takes longer to load than a small bake takes, leaves libpng's
 * handler in place, which prints to standard error, and writes into no memory */

extern const vshi_codec vshi_png_codec;

/* Reads the file at `path`, or `bytes`, which messages call `path`. Values are 0 … 1 as they stand in the
 * file: no gamma, no alpha multiplied in. Channels are Y, Y A, R G B or R G B A. */
vsh_result vshi_png_read(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                         vsh_image_file **file, vsh_error *error);

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

/* --- all others, through OpenImageIO, a module */

typedef struct vshi_oiio_table {
    const char *version; /* of the header that it was built with */

    /* The format that the path's ending stands for, if it can be written. Thread safe. */
    bool (*format)(const char *path, vshi_format *format);

    /* Why an ending that OpenImageIO knows is not written; NULL for others. A static string. Thread safe. */
    const char *(*refusal)(const char *path);

    /* Writes R, G, B and perhaps A, or R alone where the format is grey. */
    vshi_codec codec;

    /* Reads the file at `path`, of the format that its ending says, or `bytes`, which messages call `path`.
     */
    vsh_result (*read)(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                       vsh_image_file **file, vsh_error *error);
} vshi_oiio_table;

/* The module's one symbol. */
extern const vshi_oiio_table vshi_oiio_module;

/* Loads the module. Errors: as of vshi_module_load(), which name `path`. Thread safe. */
vsh_result vshi_oiio_load(const char *path, vsh_error *error);

/* NULL before vshi_oiio_load(). */
const vshi_oiio_table *vshi_oiio(void);

#ifdef __cplusplus
}
#endif
#endif
