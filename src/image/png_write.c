#include "image/png.h"

#include "base/memory.h"
#include "base/try.h"

#include <png.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* All that lives across libpng's longjmp: no local variable does. */
typedef struct png_writer {
    const vshi_png_source *source;
    png_structp png;
    png_infop info;
    unsigned char *row;
    unsigned char *bytes; /* written so far */
    size_t size, capacity;
    bool memory; /* was refused */
    char message[200];
} png_writer;

static PNG_NORETURN void on_error(png_structp png, png_const_charp message) {
    png_writer *writer = png_get_error_ptr(png);
    snprintf(writer->message, sizeof writer->message, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static void on_write(png_structp png, png_bytep data, size_t length) {
    png_writer *writer = png_get_io_ptr(png);
    if (length > writer->capacity - writer->size) {
        const size_t capacity = 2 * writer->capacity + length + 4096;
        unsigned char *grown = realloc(writer->bytes, capacity);
        if (grown == NULL) {
            writer->memory = true;
            png_error(png, "the system refused memory");
        }
        writer->bytes = grown;
        writer->capacity = capacity;
    }
    memcpy(writer->bytes + writer->size, data, length);
    writer->size += length;
}

static void on_flush(png_structp png) {
    (void)png;
}

/* False where libpng jumped out of it. */
static bool encode(png_writer *writer) {
    const vshi_png_source *source = writer->source;
    if (setjmp(png_jmpbuf(writer->png)) != 0) {
        return false;
    }
    png_set_user_limits(writer->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(writer->png, writer, on_write, on_flush);
    png_set_IHDR(writer->png, writer->info, (png_uint_32)source->width, (png_uint_32)source->height,
                 source->bits, source->channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(writer->png, writer->info);
    for (int32_t y = 0; y < source->height; ++y) {
        source->row(source->user, y, writer->row);
        png_write_row(writer->png, writer->row);
    }
    png_write_end(writer->png, writer->info);
    return true;
}

vsh_result vshi_png_encode(const vshi_png_source *source, const char *what, unsigned char **bytes,
                           size_t *size, vsh_error *error) {
    png_writer writer = {.source = source};
    vsh_result result;
    *bytes = NULL;
    *size = 0;
    VSHI_TRY_DONE(vshi_allocate((void **)&writer.row, (size_t)source->width,
                                (size_t)(source->channels * source->bits / 8), what, error));
    writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &writer, on_error, on_warning);
    writer.info = writer.png != NULL ? png_create_info_struct(writer.png) : NULL;
    if (writer.info == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
        goto done;
    }
    if (!encode(&writer)) {
        result = vshi_fail(error, writer.memory ? VSH_ERROR_MEMORY : VSH_ERROR_LIMIT, "%s: %s", what,
                           writer.message);
        goto done;
    }
    *bytes = writer.bytes;
    *size = writer.size;
    writer.bytes = NULL;
done:
    png_destroy_write_struct(&writer.png, &writer.info);
    free(writer.bytes);
    free(writer.row);
    return result;
}
