#include "image/png_stream.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static PNG_NORETURN void on_error(png_structp png, png_const_charp message) {
    vshi_png_stream *stream = png_get_error_ptr(png);
    snprintf(stream->message, sizeof stream->message, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static void on_write(png_structp png, png_bytep bytes, size_t size) {
    vshi_png_stream *stream = png_get_io_ptr(png);
    if (!stream->put(stream->user, bytes, size)) {
        stream->memory = true;
        png_error(png, "the system refused memory");
    }
}

static void on_flush(png_structp png) {
    (void)png;
}

/* libpng goes on without some of what it gets no memory for: a text would be missing. */
static png_voidp on_malloc(png_structp png, png_alloc_size_t size) {
    vshi_png_stream *stream = png_get_mem_ptr(png);
    void *memory = malloc(size);
    stream->memory |= memory == NULL;
    return memory;
}

static void on_free(png_structp png, png_voidp memory) {
    (void)png;
    free(memory);
}

static void write_info(vshi_png_stream *stream, const vshi_png_header *header) {
    static const int types[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGB_ALPHA};
    png_structp png = stream->png;
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(png, stream, on_write, on_flush);
    png_set_IHDR(png, stream->info, (png_uint_32)header->width, (png_uint_32)header->height, header->bits,
                 types[header->channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    if (header->is_srgb) {
        png_set_sRGB_gAMA_and_cHRM(png, stream->info, PNG_sRGB_INTENT_ABSOLUTE);
    }
    for (size_t i = 0; i < header->text_count; ++i) {
        /* neither is written to, whatever the types say */
        png_text text = {.compression = PNG_TEXT_COMPRESSION_NONE,
                         .key = (char *)(uintptr_t)header->texts[i].name,
                         .text = (char *)(uintptr_t)header->texts[i].value};
        png_set_text(png, stream->info, &text, 1);
    }
    png_write_info(png, stream->info);
}

bool vshi_png_stream_begin(vshi_png_stream *stream, const vshi_png_header *header, vshi_png_put *put,
                           void *user) {
    stream->put = put;
    stream->user = user;
    stream->png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, stream, on_error, on_warning, stream,
                                            on_malloc, on_free);
    stream->info = stream->png != NULL ? png_create_info_struct(stream->png) : NULL;
    if (stream->info == NULL) {
        stream->memory = true;
        return false;
    }
    if (setjmp(png_jmpbuf(stream->png)) != 0) {
        return false;
    }
    write_info(stream, header);
    return !stream->memory;
}

bool vshi_png_stream_row(vshi_png_stream *stream, const unsigned char *row) {
    if (setjmp(png_jmpbuf(stream->png)) != 0) {
        return false;
    }
    png_write_row(stream->png, row);
    return !stream->memory;
}

bool vshi_png_stream_end(vshi_png_stream *stream) {
    if (setjmp(png_jmpbuf(stream->png)) != 0) {
        return false;
    }
    png_write_end(stream->png, stream->info);
    return !stream->memory;
}

void vshi_png_stream_free(vshi_png_stream *stream) {
    png_destroy_write_struct(&stream->png, &stream->info);
}
