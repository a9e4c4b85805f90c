/* Image files: OpenEXR and PNG by our code, every other format by OpenImageIO.
 *
 *     const char *names[] = {"shadow.sun"};
 *     const float *planes[] = {shadow};
 *     vsh_image image = {256, 256, 1, names, planes, NULL};
 *     vsh_image_write("shadow.exr", &image, NULL, &error);
 *     vsh_image_file *file;
 *     vsh_image_read("shadow.exr", &run, &file, &error);
 *     vsh_image back = vsh_image_view(file);
 *     vsh_image_free(file);
 */
#pragma once

#include "base.h"

VSH_BEGIN_C

enum { VSH_MAX_CHANNELS = 256, VSH_CHANNEL_NAME = 128 };

/* String attribute of EXR files whose R, G and B are a picture of their channels. Its value says which ones:
 * "irradiance", "shadow.sun * ao", "mean of 3 shadows". */
#define VSH_IMAGE_RGB "vdbshade_rgb"

/* The kind of a channel, which decides how integers store it. */
typedef enum vsh_channel_kind {
    VSH_CHANNEL_DATA = 0,  /* 0 … 1, as it is */
    VSH_CHANNEL_LIGHT = 1, /* linear light, which VSH_COLOR_AUTO encodes */
    VSH_CHANNEL_VECTOR = 2 /* a component from -1 to 1: integers store (1 + x) / 2 */
} vsh_channel_kind;

/* Named planes. A view. width × height × channel_count is at most 2^31. */
typedef struct vsh_image {
    int32_t width;         /* pixels, ≥ 1 */
    int32_t height;        /* pixels, ≥ 1 */
    int32_t channel_count; /* 1 … VSH_MAX_CHANNELS */
    /* [channel_count], unique: "shadow.sun", "ao", "A"; 1 … VSH_CHANNEL_NAME - 1 bytes */
    const char *const *names;
    const float *const *planes;    /* [channel_count][height × width], row 0 on top */
    const vsh_channel_kind *holds; /* [channel_count]; NULL: all are data */
} vsh_image;

/* How R, G and B are stored in integers. Programs read R, G and B of 8 and 16 bits as sRGB unless told
 * otherwise. */
typedef enum vsh_color_space {
    VSH_COLOR_AUTO = 0,   /* sRGB if R, G and B are all VSH_CHANNEL_LIGHT, else linear */
    VSH_COLOR_LINEAR = 1, /* as they are */
    VSH_COLOR_SRGB = 2,   /* through the curve of IEC 61966-2-1 */
    VSH_COLOR_ENCODED = 3 /* already encoded: the file only says sRGB */
} vsh_color_space;

/* Light that the integers of a file cut off. */
typedef struct vsh_image_clipping {
    uint64_t texels;  /* with A above 0, if the image has A; 0 if no light is stored as integers */
    uint64_t clipped; /* of them with R, G or B over 1 */
    float largest;    /* value of R, G and B of these texels, 0 … infinite */
} vsh_image_clipping;

/* How an image is written. */
typedef struct vsh_image_options {
    size_t struct_size;
    int32_t bits; /* 8 and 16: integers (16 in EXR: half float), 32: float; 0: 32 for EXR, else the first of
                     16, 8 and 32 that the format has */
    /* "R=shadow.sun,G=ao,A=A": sources of R, G, B and A, as channels or the numbers 0 and 1. Missing R, G and
     * B are 0; without A there is no alpha. "rgb": the picture, that is irradiance, else the mean of the
     * shadows times AO. "channels": every channel by name, without the picture. NULL: in EXR every channel by
     * name, and the picture as R, G and B; in other formats irradiance, else the first three channels but A
     * (a single one as grey), and A */
    const char *pack;
    /* [attribute_count]: attributes of EXR and text of PNG; other formats lack them */
    const vsh_attribute *attributes;
    size_t attribute_count;
    vsh_color_space color_space;  /* of R, G and B in integers. A and floats are linear */
    vsh_image_clipping *clipping; /* filled by vsh_image_write(); may be NULL */
} vsh_image_options;

static inline vsh_image_options vsh_image_options_default(void) {
    vsh_image_options options = {sizeof(vsh_image_options), 0, NULL, NULL, 0, VSH_COLOR_AUTO, NULL};
    return options;
}

/* Writes an image; the ending of `path`, in any case, gives the format (docs/formats.md). Integers are
 * clamped to 0 … 1 and rounded to nearest, NaN is 0. PNG stores its colour space as text
 * "vdbshade_color_space" ("sRGB" or "linear"); PNG, TIFF and JPEG also mark sRGB in their own way. Atomic:
 * the file is renamed into place when it is complete. Errors:
 * - VSH_ERROR_ARGUMENT: path NULL or empty, no image, sizes or channels out of range, a plane NULL, options,
 *   bad attributes, an unknown ending; bits, a pack or a size that the format lacks;
 * - VSH_ERROR_LIMIT: more than 2^31 values, or 2 GiB in 16 rows of EXR;
 * - VSH_ERROR_WRITE: no such folder, no permission, a folder or device in the way, disk full;
 * - VSH_ERROR_UNSUPPORTED: this OpenImageIO cannot write the format;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);

/* Checks whether vsh_image_write() could take this path, these options and these channel names, before a long
 * bake. Writes nothing, but tests that the folder is writable. image->planes may be NULL. Errors: as
 * vsh_image_write(). */
VSH_API vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);

/* An image read from a file. Free it with vsh_image_free(). */
typedef struct vsh_image_file vsh_image_file;

/* Reads an image as float planes: EXR and PNG by their first bytes, others by the ending of `path`. Integers
 * become 0 … 1 without a transfer curve or multiplication by alpha. Use run->reader for files from strangers.
 * Stage: "load". Errors:
 * - VSH_ERROR_ARGUMENT: path NULL or empty, file NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, a folder; damaged, cut short; the reader crashed;
 * - VSH_ERROR_INPUT: an ending of no known format;
 * - VSH_ERROR_UNSUPPORTED: deep, volume and subsampled images; compressions and formats that the installed
 *   libraries lack;
 * - VSH_ERROR_LIMIT: more than 2^31 values or VSH_MAX_CHANNELS channels; run->memory_limit; the reader's
 *   time;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_image_read(const char *path, const vsh_run *run, vsh_image_file **file,
                                  vsh_error *error);

/* Returns the planes and names, which belong to the file. Names are those of EXR, else R, G, B, A or Y. NULL
 * gives an image of 0 × 0. */
VSH_API vsh_image vsh_image_view(const vsh_image_file *file);

/* Returns the text of an EXR (string attributes) or PNG file, which belongs to the file, and its count; none
 * for NULL and other formats. */
VSH_API const vsh_attribute *vsh_image_attributes(const vsh_image_file *file, size_t *count);
VSH_API void vsh_image_free(vsh_image_file *file); /* NULL does nothing */

VSH_END_C
