#include "image/png.h"

#include "base/input.h"
#include "base/memory.h"
#include "base/try.h"

#include <png.h>

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* All that lives across libpng's longjmp: no local variable does. */
typedef struct png_reader {
    const char *path;
    const vsh_run *run;
    vsh_error *error;
    FILE *stream;
    png_structp png;
    png_infop info;
    vsh_image_file *image;
    vshi_job *job;       /* in rows of all passes */
    unsigned char *rows; /* one, or all of an interlaced image */
    size_t row_bytes;
    int bits;
    int passes;
    char message[200];
} png_reader;

static PNG_NORETURN void on_error(png_structp png, png_const_charp message) {
    png_reader *reader = png_get_error_ptr(png);
    snprintf(reader->message, sizeof reader->message, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static vsh_result read_header(png_reader *reader) {
    static const char *const names[4][4] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
    png_init_io(reader->png, reader->stream);
    png_read_info(reader->png, reader->info);
    png_set_expand(reader->png); /* palettes, fewer than 8 bits and transparent colours to plain channels */
    if (png_get_bit_depth(reader->png, reader->info) == 16 && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__) {
        png_set_swap(reader->png);
    }
    reader->passes = png_set_interlace_handling(reader->png);
    png_read_update_info(reader->png, reader->info);
    reader->bits = png_get_bit_depth(reader->png, reader->info);
    reader->row_bytes = png_get_rowbytes(reader->png, reader->info);
    const int channels = png_get_channels(reader->png, reader->info);
    if (channels < 1 || channels > 4 || (reader->bits != 8 && reader->bits != 16)) {
        return vshi_fail(reader->error, VSH_ERROR_READ, "%s: %d channels of %d bits: damaged", reader->path,
                         channels, reader->bits);
    }
    const png_uint_32 height = png_get_image_height(reader->png, reader->info);
    VSHI_TRY(vshi_image_file_new(reader->path, reader->run, png_get_image_width(reader->png, reader->info),
                                 height, channels, &reader->image, reader->error));
    for (int c = 0; c < channels; ++c) {
        vshi_image_file_name(reader->image, c, names[channels - 1][c]);
    }
    /* its pages are taken when they are first written, as those of the image */
    reader->rows = calloc(reader->passes > 1 ? height : 1, reader->row_bytes);
    return reader->rows != NULL ? vshi_image_job(reader->path, reader->run, (int64_t)height * reader->passes,
                                                 &reader->job, reader->error)
                                : vshi_fail(reader->error, VSH_ERROR_MEMORY,
                                            "%s: the system refused memory for rows of %zu bytes",
                                            reader->path, reader->row_bytes);
}

static void store_row(const png_reader *reader, const unsigned char *row, int32_t y) {
    const vsh_image_file *image = reader->image;
    const size_t width = (size_t)image->width;
    const size_t count = (size_t)image->channel_count;
    for (size_t c = 0; c < count; ++c) {
        float *plane = image->values + (c * (size_t)image->height + (size_t)y) * width;
        for (size_t x = 0; x < width; ++x) {
            if (reader->bits == 8) {
                plane[x] = (float)row[x * count + c] / 255.0f;
            } else {
                uint16_t value;
                memcpy(&value, row + (x * count + c) * sizeof value, sizeof value);
                plane[x] = (float)value / 65535.0f;
            }
        }
    }
}

static vsh_result read_rows(png_reader *reader) {
    const size_t step = reader->passes > 1 ? reader->row_bytes : 0;
    for (int pass = 0; pass < reader->passes; ++pass) {
        for (int32_t y = 0; y < reader->image->height; ++y) {
            unsigned char *row = reader->rows + (size_t)y * step;
            png_read_row(reader->png, row, NULL);
            if (pass == reader->passes - 1) {
                store_row(reader, row, y);
            }
            if (vshi_job_advance(reader->job, 1)) {
                return vshi_job_fail_cancelled(reader->job, reader->error);
            }
        }
    }
    png_read_end(reader->png, NULL);
    return VSH_OK;
}

/* The text that stands before the image. */
static vsh_result read_texts(png_reader *reader) {
    png_textp texts = NULL;
    const int count = png_get_text(reader->png, reader->info, &texts, NULL);
    for (int i = 0; i < count; ++i) {
        const char *value = texts[i].text != NULL ? texts[i].text : "";
        if (!vshi_attributes_add(&reader->image->attributes, texts[i].key, value)) {
            return vshi_fail(reader->error, VSH_ERROR_MEMORY, "%s: the system refused memory", reader->path);
        }
    }
    return VSH_OK;
}

static vsh_result read_all(png_reader *reader) {
    reader->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, reader, on_error, on_warning);
    reader->info = reader->png != NULL ? png_create_info_struct(reader->png) : NULL;
    if (reader->info == NULL) {
        return vshi_fail(reader->error, VSH_ERROR_MEMORY, "%s: the system refused memory", reader->path);
    }
    if (setjmp(png_jmpbuf(reader->png)) != 0) {
        return vshi_fail(reader->error, VSH_ERROR_READ, "%s: could not be read as png: %s", reader->path,
                         reader->message);
    }
    VSHI_TRY(read_header(reader));
    VSHI_TRY(read_texts(reader));
    return read_rows(reader);
}

/* Closes the stream. */
static vsh_result read_stream(const char *path, FILE *stream, const vsh_run *run, vsh_image_file **file,
                              vsh_error *error) {
    png_reader reader = {.path = path, .run = run, .error = error, .stream = stream};
    const vsh_result result = read_all(&reader);
    vshi_job_end(reader.job);
    png_destroy_read_struct(&reader.png, &reader.info, NULL);
    free(reader.rows);
    fclose(reader.stream);
    if (result != VSH_OK) {
        vsh_image_free(reader.image);
        return result;
    }
    *file = reader.image;
    return VSH_OK;
}

vsh_result vshi_png_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    FILE *stream;
    uint64_t size;
    *file = NULL;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &stream, &size, error));
    return read_stream(path, stream, run, file, error);
}

vsh_result vshi_png_read_bytes(const char *name, const vshi_image_bytes *bytes, const vsh_run *run,
                               vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    FILE *stream = fmemopen((void *)(uintptr_t)bytes->at, bytes->size, "rb"); /* which only reads */
    return stream != NULL ? read_stream(name, stream, run, file, error)
                          : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
}
