/* A PNG file row by row. Nothing is kept but a row, and what libpng and zlib keep of those before. */
#include "image/png.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/try.h"
#include "image/png_stream.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The size is that to which libpng's own readers go, unless they are told otherwise. */
const vshi_format vshi_png_format = {
    .name = "png", .bits = VSHI_BITS_8 | VSHI_BITS_16, .alpha = VSHI_ALPHA_KEPT, .max_size = 1000000};

struct vshi_png_writer {
    vshi_sink sink;
    uint64_t at; /* bytes written */
    vshi_png_stream stream;
    const char *path;
    int32_t height, row; /* next */
    int32_t bits;
    unsigned char *bytes; /* [width][channels] */
};

/* The sink keeps its failure, which says more than libpng would. */
static bool put(void *user, const unsigned char *bytes, size_t size) {
    vshi_png_writer *writer = user;
    vshi_sink_write(&writer->sink, bytes, size, writer->at);
    writer->at += size;
    return true;
}

/* Ours, and between them the caller's, which take the place of ours of the same name but for the last. */
static bool begin(vshi_png_writer *writer, const vshi_planes *planes, vsh_attribute *texts) {
    char software[64];
    snprintf(software, sizeof software, "vdbshade %s", vsh_version());
    const vsh_attribute own[] = {{"Software", software},
                                 {"vdbshade_color_space", planes->is_srgb ? "sRGB" : "linear"}};
    bool given = false;
    for (size_t i = 0; i < planes->attribute_count; ++i) {
        given |= strcmp(planes->attributes[i].name, own[0].name) == 0;
    }
    size_t count = 0;
    if (!given) {
        texts[count++] = own[0];
    }
    for (size_t i = 0; i < planes->attribute_count; ++i) {
        if (strcmp(planes->attributes[i].name, own[1].name) != 0) {
            texts[count++] = planes->attributes[i];
        }
    }
    texts[count++] = own[1];
    const vshi_png_header header = {.width = planes->width,
                                    .height = planes->height,
                                    .channels = planes->count,
                                    .bits = writer->bits,
                                    .is_srgb = planes->is_srgb,
                                    .texts = texts,
                                    .text_count = count};
    return vshi_png_stream_begin(&writer->stream, &header, put, writer);
}

static vsh_result result_of(const vshi_png_writer *writer, bool done, vsh_error *error) {
    if (writer->stream.memory) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", writer->path);
    }
    if (writer->sink.error != 0 || !done) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", writer->path,
                         writer->sink.error != 0 ? strerror(writer->sink.error) : writer->stream.message);
    }
    return VSH_OK;
}

vsh_result vshi_png_begin(const char *temporary, const char *path, const vshi_planes *planes, int32_t bits,
                          vshi_png_writer **made, vsh_error *error) {
    vshi_png_writer *writer = NULL;
    vsh_attribute *texts = NULL;
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&writer, 1, sizeof *writer, path, error));
    writer->sink = vshi_sink_open(temporary);
    writer->path = path;
    writer->height = planes->height;
    writer->bits = bits;
    VSHI_TRY_DONE(vshi_allocate((void **)&texts, planes->attribute_count + 2, sizeof *texts, path, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&writer->bytes, (size_t)planes->width,
                                (size_t)planes->count * (size_t)(bits / 8), path, error));
    VSHI_TRY_DONE(result_of(writer, begin(writer, planes, texts), error));
    *made = writer;
    writer = NULL;
done:
    free(texts);
    vshi_png_end(writer, NULL);
    return result;
}

/* Row y of the planes, channels side by side, the higher byte first. */
static void fill_row(const vshi_png_writer *writer, const vshi_planes *planes, int32_t y) {
    const size_t width = (size_t)planes->width, count = (size_t)planes->count;
    const size_t size = writer->bits == 16 ? 2 : 1;
    for (size_t c = 0; c < count; ++c) {
        unsigned char *to = writer->bytes + c * size;
        for (size_t x = 0; x < width; ++x, to += count * size) {
            const float value = vshi_plane_unit_at(planes, &planes->planes[c], (size_t)y * width + x);
            if (size == 2) {
                const uint32_t integer = vshi_quantise(value, UINT16_MAX);
                to[0] = (unsigned char)(integer >> 8);
                to[1] = (unsigned char)integer;
            } else {
                to[0] = (unsigned char)vshi_quantise(value, UINT8_MAX);
            }
        }
    }
}

vsh_result vshi_png_add(vshi_png_writer *writer, const vshi_planes *planes, int32_t rows, vsh_error *error) {
    for (int32_t y = 0; y < rows; ++y) {
        fill_row(writer, planes, y);
        VSHI_TRY(result_of(writer, vshi_png_stream_row(&writer->stream, writer->bytes), error));
    }
    writer->row += rows;
    return VSH_OK;
}

vsh_result vshi_png_end(vshi_png_writer *writer, vsh_error *error) {
    if (writer == NULL) {
        return VSH_OK;
    }
    /* of a file that is given up, libpng would miss the rows */
    const bool done = writer->row < writer->height || vshi_png_stream_end(&writer->stream);
    vshi_sink_close(&writer->sink);
    const vsh_result result = result_of(writer, done, error);
    vshi_png_stream_free(&writer->stream);
    free(writer->bytes);
    free(writer);
    return result;
}

double vshi_png_writer_bytes(const vshi_planes *planes, int32_t bits) {
    enum { ROWS = 5 /* ours; libpng's: as it is, the one before, and two tried with filters */ };
    enum { ZLIB = 512 << 10 /* its window and its tables, and libpng's buffer */ };
    return ROWS * (double)planes->width * planes->count * (bits / 8) + ZLIB;
}
