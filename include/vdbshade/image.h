/* Image files: OpenEXR through its C core, every other format through OpenImageIO. */
#ifndef VDBSHADE_IMAGE_H
#define VDBSHADE_IMAGE_H

#include "base.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { VSH_MAX_CHANNELS = 256, VSH_CHANNEL_NAME = 128 };

/* The string attribute of an EXR file that has R, G and B beside the channels that they are made of. Its
 * value says of which: "irradiance", "shadow.sun * ao", "mean of 3 shadows". */
#define VSH_IMAGE_RGB "vdbshade_rgb"

/* What a channel holds, which says how integers hold it. */
enum {
    VSH_CHANNEL_DATA = 0,  /* 0 … 1, as it is */
    VSH_CHANNEL_LIGHT = 1, /* linear light: VSH_COLOR_AUTO is for it */
    VSH_CHANNEL_VECTOR = 2 /* a component from -1 to 1: integers hold (1 + x) / 2 */
};

/* Planes with names: a view. width × height × channel_count is at most 2^31; in
 * an EXR file that is written row by row there is no such limit. */
typedef struct vsh_image {
    int32_t width;              /* pixels, ≥ 1 */
    int32_t height;             /* pixels, ≥ 1 */
    int32_t channel_count;      /* 1 … VSH_MAX_CHANNELS */
    const char *const *names;   /* [channel_count]: "shadow.sun", "ao", "A"; 1 … VSH_CHANNEL_NAME - 1 bytes,
                                   no two alike */
    const float *const *planes; /* [channel_count][height × width], row 0 on top */
    const int32_t *holds;       /* [channel_count]: VSH_CHANNEL_…; NULL: all of them data */
} vsh_image;

/* What R, G and B of integers stand for. Programs take R, G and B of 8 and of 16 bits for sRGB, unless they
 * are told that they are data. */
enum {
    VSH_COLOR_AUTO = 0,   /* sRGB where all of R, G and B are VSH_CHANNEL_LIGHT, else linear */
    VSH_COLOR_LINEAR = 1, /* as they are */
    VSH_COLOR_SRGB = 2,   /* through the curve of IEC 61966-2-1 */
    VSH_COLOR_ENCODED = 3 /* the caller's values have gone through it: the file only says so */
};

/* Takes the sRGB curve off a value of 0 … 1. */
VSH_API double vsh_srgb_to_linear(double encoded);

/* How an image is written. */
typedef struct vsh_image_options {
    size_t struct_size;
    int32_t bits; /* of a value: 8 and 16 are integers (16 in EXR: half float), 32 is float; 0: 32 for EXR,
                     else 16 where the format has it, else 8, else 32 */
    const char *pack; /* for formats that cannot name channels, "R=shadow.sun,G=ao,A=A": R, G, B, A from
                         channels or the numbers 0 and 1. R, G and B that are missing are 0; without A there
                         is no alpha. "rgb": the image's picture as R, G and B, and A: its irradiance.R,
                         .G and .B, or where it has none the mean of its shadow.NAME times `ao`, as far as
                         they are there. NULL: vsh_image_default_pack(). In EXR, NULL writes every channel by
                         name and the picture beside them, as R, G and B, where the image has no such
                         channels itself: programs that look for these open the file. "channels" leaves the
                         picture out, and a pack writes only what it names */
    const vsh_attribute *attributes; /* [attribute_count]: written as string attributes into EXR and as text
                                        into PNG; other formats have no place for them */
    size_t attribute_count;
    int32_t color_space; /* VSH_COLOR_…: of R, G and B in integers. A is linear, and so is all of floats */
} vsh_image_options;

static inline vsh_image_options vsh_image_options_default(void) {
    vsh_image_options options = {sizeof(vsh_image_options), 0, NULL, NULL, 0, VSH_COLOR_AUTO};
    return options;
}

/* Writes an image; the ending of `path`, in any case, chooses the format (docs/formats.md lists them).
 * Integer formats clamp to 0 … 1 and round to nearest, NaN to 0, with the curve that options->color_space
 * says; PNG files tell it in their text "vdbshade_color_space" ("sRGB" or "linear"), and sRGB in PNG's,
 * TIFF's and JPEG's own way too. Atomic: written beside `path` and renamed, so a failure leaves an old file
 * alone. Errors:
 * - VSH_ERROR_ARGUMENT: path NULL or empty, no image, sizes or channels out of range, a plane NULL,
 *   options; attributes other than vsh_attribute says; an unknown ending; bits, a pack or a size that the
 * format does not have;
 * - VSH_ERROR_LIMIT: more than 2^31 values, or than OpenEXR's 2 GiB in 16 rows;
 * - VSH_ERROR_WRITE: no such folder, no permission, a folder or device in the way, disk full;
 * - VSH_ERROR_UNSUPPORTED: this OpenImageIO cannot write the format;
 * - VSH_ERROR_MEMORY. */
VSH_API vsh_result vsh_image_write(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);

/* An image that is written as its rows come, so that it need not be in memory at once. One thread at a time.
 */
typedef struct vsh_image_writer vsh_image_writer;

/* Begins the file that vsh_image_write() would write: the same bytes, for the same values. image->planes is
 * not looked at; names are copied. Same errors, and VSH_ERROR_ARGUMENT for writer NULL. End with
 * vsh_image_writer_finish() or vsh_image_writer_abandon(). */
VSH_API vsh_result vsh_image_writer_create(const char *path, const vsh_image *image,
                                           const vsh_image_options *options, vsh_image_writer **writer,
                                           vsh_error *error);

/* The next `rows` rows from the top, `planes` [channel_count][rows × width]. Errors: VSH_ERROR_ARGUMENT
 * (more rows than are left, or fewer than 1; a plane NULL), VSH_ERROR_WRITE, VSH_ERROR_UNSUPPORTED,
 * VSH_ERROR_MEMORY; after one, nothing but vsh_image_writer_abandon() is of use. */
VSH_API vsh_result vsh_image_writer_add(vsh_image_writer *writer, int32_t rows, const float *const *planes,
                                        vsh_error *error);

/* Light that integers cut, of the rows so far. */
typedef struct vsh_image_clipping {
    uint64_t texels;  /* whose A is above 0, where the image has one; 0 where no light goes into integers */
    uint64_t clipped; /* of them with R, G or B over 1 */
    float largest;    /* value of R, G and B of these texels, 0 … infinite */
} vsh_image_clipping;

/* Errors: VSH_ERROR_ARGUMENT (an argument is NULL). */
VSH_API vsh_result vsh_image_writer_get_clipping(const vsh_image_writer *writer, vsh_image_clipping *clipping,
                                                 vsh_error *error);

/* Puts the file in place and frees the writer, also where it fails; the old file is then as it was. Errors:
 * VSH_ERROR_ARGUMENT (rows are missing), and as vsh_image_writer_add(). */
VSH_API vsh_result vsh_image_writer_finish(vsh_image_writer *writer, vsh_error *error);

/* Frees the writer; the old file is as it was. NULL does nothing. */
VSH_API void vsh_image_writer_abandon(vsh_image_writer *writer);

/* Bytes that writing takes at most, beside the planes: some rows, or in formats that OpenImageIO writes from
 * memory only the whole image. 0 where vsh_image_check() has objections to what is given. */
VSH_API uint64_t vsh_image_writer_bytes(const char *path, const vsh_image *image,
                                        const vsh_image_options *options);

/* Whether vsh_image_writer_create() could take this path, these options and these channel names, without
 * writing: to be asked before a long bake. Tests that the folder can be written to. image->planes may be
 * NULL. Same errors, as far as they show without writing. */
VSH_API vsh_result vsh_image_check(const char *path, const vsh_image *image, const vsh_image_options *options,
                                   vsh_error *error);

/* The packing that is used where none is given, as text: irradiance.R, .G and .B, or else the first three
 * channels that are not "A" to R, G, B (one alone: to R, G and B), "A" to A, which is left out where the
 * format has no alpha. Writes at most `capacity` bytes, NUL included. */
VSH_API void vsh_image_default_pack(const vsh_image *image, char *text, size_t capacity);

/* An image read from a file, as float planes. Free it with vsh_image_free(). */
typedef struct vsh_image_file vsh_image_file;

/* Reads an image file: EXR and PNG by their first bytes, others by the ending of `path`. Integers become 0
 * … 1 as they stand: no transfer curve, no multiplication by alpha. The readers of OpenImageIO can crash on
 * damaged files: those from strangers are for run->reader (base.h). The stage is "load". Errors:
 * - VSH_ERROR_ARGUMENT: path NULL or empty, file NULL, run;
 * - VSH_ERROR_READ: no such file, no permission, a folder; damaged, cut short; the reader crashed;
 * - VSH_ERROR_INPUT: an ending of no format that is read;
 * - VSH_ERROR_UNSUPPORTED: deep, volume and subsampled images, compressions and formats that the installed
 *   OpenEXR and OpenImageIO do not read;
 * - VSH_ERROR_LIMIT: more than 2^31 values or VSH_MAX_CHANNELS channels; run->memory_limit, the reader's
 * time;
 * - VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
VSH_API vsh_result vsh_image_read(const char *path, const vsh_run *run, vsh_image_file **file,
                                  vsh_error *error);

/* The planes and names of a file, which they belong to; names are the file's own in EXR, else R, G, B, A or
 * Y. NULL is an image of 0 × 0. */
VSH_API vsh_image vsh_image_view(const vsh_image_file *file);

/* Lines of text that an EXR (string attributes) or PNG file carries, which belong to `file`; none of NULL and
 * of other formats. */
VSH_API const vsh_attribute *vsh_image_attributes(const vsh_image_file *file, size_t *count);
VSH_API void vsh_image_free(vsh_image_file *file); /* NULL does nothing */

#ifdef __cplusplus
}
#endif
#endif
