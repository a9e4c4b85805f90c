/* Image files in memory, the codecs that read and write them, and the message of a reader process. */
#pragma once

#include "base/job.h"
#include "base/text.h"

#include <vdbshade/image.h>

#include <stdbool.h>

VSH_BEGIN_C

/* An image that is written as its rows come, so that it need not be in memory at once. One thread at a time.
 */
typedef struct vshi_image_writer vshi_image_writer;

/* Begins the file that vsh_image_write() would write: the same bytes, for the same values. Ignores
 * image->planes; image->names must outlive the writer. Errors: the same, and VSH_ERROR_ARGUMENT if `writer`
 * is NULL. End with vshi_image_writer_finish() or vshi_image_writer_abandon(). */
vsh_result vshi_image_writer_create(const char *path, const vsh_image *image,
                                    const vsh_image_options *options, vshi_image_writer **writer,
                                    vsh_error *error);

/* Writes the next `rows` rows from the top, `planes` [channel_count][rows × width]. Errors:
 * VSH_ERROR_ARGUMENT (more rows than are left, or fewer than 1; a plane NULL), VSH_ERROR_WRITE,
 * VSH_ERROR_UNSUPPORTED, VSH_ERROR_MEMORY; after one, only vshi_image_writer_abandon() may be called. */
vsh_result vshi_image_writer_add(vshi_image_writer *writer, int32_t rows, const float *const *planes,
                                 vsh_error *error);

/* Puts the file in place, and frees the writer. If this fails, the old file stays and the writer is freed,
 * too. Errors: VSH_ERROR_ARGUMENT (rows are missing), and as vshi_image_writer_add(). */
vsh_result vshi_image_writer_finish(vshi_image_writer *writer, vsh_error *error);

/* Frees the writer; the old file stays. NULL does nothing. */
void vshi_image_writer_abandon(vshi_image_writer *writer);

/* Returns the most bytes that writing takes beside the planes: some rows, or the whole image if OpenImageIO
 * writes the format from memory only. 0 if vsh_image_check() fails. */
uint64_t vshi_image_writer_bytes(const char *path, const vsh_image *image, const vsh_image_options *options);

/* --- image files in memory */

/* The most values of an image: 8 GiB of floats. */
#define VSHI_MAX_VALUES (UINT64_C(1) << 31)

enum { VSHI_FILE_NAME = 256 }; /* bytes: EXR's longest channel name, and NUL */

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

/* Fails with VSH_ERROR_LIMIT if the product of these positive numbers passes VSHI_MAX_VALUES. */
vsh_result vshi_check_values(const char *path, int64_t width, int64_t height, int64_t channels,
                             vsh_error *error);

/* Makes an image of zeros with empty names, within run->memory_limit; `run` may be NULL. Errors:
 * VSH_ERROR_READ (a number is not positive), VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
VSHI_SHARED vsh_result vshi_image_file_new(const char *path, const vsh_run *run, int64_t width,
                                           int64_t height, int64_t channels, vsh_image_file **file,
                                           vsh_error *error);

/* Sets a channel's name, cut to VSHI_FILE_NAME, without control characters. */
VSHI_SHARED void vshi_image_file_name(vsh_image_file *file, int32_t channel, const char *name);

/* An image file that lies in memory. */
typedef struct vshi_image_bytes {
    const void *at;
    size_t size;
    const char *format; /* its name in OpenImageIO */
} vshi_image_bytes;

/* Reads a PNG, JPEG or WebP in memory like vsh_image_read(). Messages call it `name`. `run` is resolved.
 * Errors: also VSH_ERROR_UNSUPPORTED (another format). */
vsh_result vshi_image_read_bytes(const char *name, const void *bytes, size_t size, const vsh_run *run,
                                 vsh_image_file **file, vsh_error *error);

/* Returns the plane of a channel, or NULL. */
const float *vshi_image_find_plane(const vsh_image *image, const char *name);

/* Whether images with this ending can be written. */
bool vshi_image_is_written(const char *path);

struct vshi_decoder;
struct vshi_encoder;

/* Parses a file in a reader, and encodes the answer. */
vsh_result vshi_serve_image(const char *path, struct vshi_decoder *request, const vsh_run *run,
                            struct vshi_encoder *payload, vsh_error *error);

/* Decodes the answer of a reader, and checks all of it. Errors: VSH_ERROR_READ (a bad answer), and as
 * vshi_image_file_new(). */
vsh_result vshi_image_decode(struct vshi_decoder *decoder, const char *path, vsh_image_file **file,
                             vsh_error *error);

/* --- channels of a file that is written */

typedef struct vshi_image_plane {
    const char *name;
    const float *values; /* [height × width]; NULL: `constant` everywhere */
    float constant;
    bool is_signed;         /* -1 … 1, stored as 0 … 1 in integers */
    bool is_grey;           /* vshi_grey_at() instead of values or constant */
    bool is_color;          /* light: integers cut values over 1 */
    float (*encode)(float); /* a curve for integers; NULL: none */
} vshi_image_plane;

/* A picture of several channels: the mean of the lights' shadows, times AO. */
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
    vshi_grey grey;                  /* of planes with is_grey */
    bool is_srgb;                    /* R, G and B of integers have the sRGB curve */
    char rgb[2 * VSH_CHANNEL_NAME];  /* VSH_IMAGE_RGB: the named channels that R, G and B show; or "" */
    const vsh_attribute *attributes; /* [attribute_count]: for begin() only */
    size_t attribute_count;
} vshi_planes;

static inline float vshi_plane_at(const vshi_planes *planes, const vshi_image_plane *plane, size_t at) {
    const float value = plane->is_grey          ? vshi_grey_at(&planes->grey, at)
                        : plane->values != NULL ? plane->values[at]
                                                : plane->constant;
    return plane->encode != NULL ? plane->encode(value) : value;
}

/* Returns the value as integers store it: 0 … 1, before it is cut. */
static inline float vshi_plane_unit_at(const vshi_planes *planes, const vshi_image_plane *plane, size_t at) {
    const float value = vshi_plane_at(planes, plane, at);
    return plane->is_signed ? 0.5f + 0.5f * value : value;
}

/* Rounds 0 … 1 to 0 … most; NaN becomes 0 because comparisons with it are false. */
static inline uint32_t vshi_quantise(float value, uint32_t most) {
    if (!(value > 0.0f)) {
        return 0;
    }
    return value < 1.0f ? (uint32_t)((double)value * (double)most + 0.5) : most;
}

/* --- formats */

enum { VSHI_BITS_8 = 1, VSHI_BITS_16 = 2, VSHI_BITS_32 = 4 };

typedef struct vshi_format {
    const char *name; /* in OpenImageIO, if that writes it */
    int32_t bits;     /* VSHI_BITS_… that can be written: 8 and 16 are integers, 32 is float */
    bool alpha;       /* keeps A, and R, G and B where A is 0 */
    bool named;       /* EXR: any channels, by their names; 16 bits are half floats */
    int32_t max_size; /* pixels along a side */
    double held;      /* bytes that the writer keeps until the end, for each byte of a value */
} vshi_format;

/* A writer belongs to one thread at a time. */
typedef struct vshi_codec {
    /* Begins a file of planes in the existing file `temporary`; messages name `path`. Both live as long as
     * the writer. The format has `bits`. Names and values of the planes may change. Errors: VSH_ERROR_WRITE,
     * VSH_ERROR_UNSUPPORTED, VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
    vsh_result (*begin)(const char *temporary, const char *path, const vshi_format *format,
                        const vshi_planes *planes, int32_t bits, void **writer, vsh_error *error);

    /* Writes the next rows of these planes, with `values` [rows × width]. Same errors. */
    vsh_result (*add)(void *writer, const vshi_planes *planes, int32_t rows, vsh_error *error);

    /* Closes the file and frees the writer; NULL does nothing. Same errors. */
    vsh_result (*end)(void *writer, vsh_error *error);

    /* Estimates the memory of a writer, in bytes. */
    double (*bytes)(const vshi_format *format, const vshi_planes *planes, int32_t bits);
} vshi_codec;

/* --- OpenEXR, through its C core: scan lines (ZIP) */

extern const vshi_codec vshi_exr_codec;

/* Reads the first part of a file, scan lines or the finest level of tiles; half and integers become float.
 * All readers stay within run->memory_limit; a NULL run has no limit. Errors: VSH_ERROR_READ,
 * VSH_ERROR_INPUT, VSH_ERROR_UNSUPPORTED (deep data, subsampled channels, DWA), VSH_ERROR_LIMIT,
 * VSH_ERROR_MEMORY. Thread safe. */
vsh_result vshi_exr_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error);

/* --- PNG, through libpng itself. Loading OpenImageIO takes longer than a small bake, its PNG errors are
 * printed to standard error, and it cannot write into memory. */

extern const vshi_codec vshi_png_codec;

/* Reads the file at `path`, or `bytes`, which messages call `path`. Values are 0 … 1 as in the file, without
 * gamma, and not multiplied by alpha. Channels are Y, Y A, R G B or R G B A. */
vsh_result vshi_png_read(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                         vsh_image_file **file, vsh_error *error);

/* An image to write into memory. */
typedef struct vshi_png_source {
    int32_t width, height;
    int32_t channels; /* 1 or 3 */
    int32_t bits;     /* 8 or 16 */
    /* Fills row y: [width][channels], the higher byte of 16 bits first. */
    void (*row)(void *user, int32_t y, unsigned char *bytes);
    void *user;
} vshi_png_source;

/* Writes a PNG file into new memory, *size bytes; free with free(). The same values, libpng and zlib give the
 * same bytes. Errors: VSH_ERROR_LIMIT (libpng's), VSH_ERROR_MEMORY, naming `what`. Thread safe. */
vsh_result vshi_png_encode(const vshi_png_source *source, const char *what, unsigned char **bytes,
                           size_t *size, vsh_error *error);

/* --- all other formats, through OpenImageIO, a module */

typedef struct vshi_oiio_table {
    const char *version; /* of the headers that the module was built with */

    /* Finds the format of the path's ending; returns false if it cannot be written. Thread safe. */
    bool (*format)(const char *path, vshi_format *format);

    /* Writes R, G, B and perhaps A. */
    vshi_codec codec;

    /* Reads the file at `path`, whose ending tells the format, or `bytes`, which messages call `path`. */
    vsh_result (*read)(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                       vsh_image_file **file, vsh_error *error);
} vshi_oiio_table;

/* The module's one symbol. */
extern const vshi_oiio_table vshi_oiio_module;

/* Loads the module. Errors: as vshi_module_load(), naming `path`. Thread safe. */
vsh_result vshi_oiio_load(const char *path, vsh_error *error);

/* NULL before vshi_oiio_load(). */
const vshi_oiio_table *vshi_oiio(void);

VSH_END_C
