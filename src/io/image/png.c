/* PNG files through libpng. Its messages and jumps stay in this file. */
#include "base/file.h"
#include "base/memory.h"
#include "io/image/image.h"

#include <png.h>

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MESSAGE_ROOM = 200 };

static PNG_NORETURN void on_error(png_structp png, png_const_charp message) {
    snprintf(png_get_error_ptr(png), MESSAGE_ROOM, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

/* --- reading */

/* State that survives libpng's longjmp; local variables do not. */
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
    char message[MESSAGE_ROOM];
} png_reader;

static vsh_result read_header(png_reader *reader) {
    static const char *const names[4][4] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
    png_init_io(reader->png, reader->stream);
    png_read_info(reader->png, reader->info);
    png_set_expand(reader->png); /* palettes, fewer than 8 bits and transparent colours to plain channels */
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
    /* calloc() takes pages at the first write, as for the image */
    reader->rows = calloc(reader->passes > 1 ? height : 1, reader->row_bytes);
    return reader->rows == NULL
               ? vshi_fail_memory(reader->error, reader->path)
               : vshi_job_open(&reader->job, reader->run, "load", (size_t)height * (size_t)reader->passes,
                               reader->path, reader->error);
}

static void store_row(const png_reader *reader, const unsigned char *row, int32_t y) {
    const vsh_image_file *image = reader->image;
    const size_t width = (size_t)image->width;
    const size_t count = (size_t)image->channel_count;
    for (size_t c = 0; c < count; ++c) {
        float *plane = image->values + (c * (size_t)image->height + (size_t)y) * width;
        for (size_t x = 0; x < width; ++x) {
            const size_t i = x * count + c;
            plane[x] = reader->bits == 8 ? (float)row[i] / 255.0f
                                         : (float)(row[2 * i] << 8 | row[2 * i + 1]) / 65535.0f;
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
            VSHI_TRY(vshi_job_step(reader->job, 1, reader->error));
        }
    }
    png_read_end(reader->png, NULL);
    return VSH_OK;
}

/* Reads the texts before the image. */
static vsh_result read_texts(png_reader *reader) {
    png_textp texts = NULL;
    const int count = png_get_text(reader->png, reader->info, &texts, NULL);
    for (int i = 0; i < count; ++i) {
        const char *value = texts[i].text != NULL ? texts[i].text : "";
        if (!vshi_attributes_add(&reader->image->attributes, texts[i].key, value)) {
            return vshi_fail_memory(reader->error, reader->path);
        }
    }
    return VSH_OK;
}

static vsh_result read_all(png_reader *reader) {
    reader->png = png_create_read_struct(PNG_LIBPNG_VER_STRING, reader->message, on_error, on_warning);
    reader->info = reader->png != NULL ? png_create_info_struct(reader->png) : NULL;
    if (reader->info == NULL) {
        return vshi_fail_memory(reader->error, reader->path);
    }
    if (setjmp(png_jmpbuf(reader->png)) != 0) {
        return vshi_fail(reader->error, VSH_ERROR_READ, "%s: could not be read as png: %s", reader->path,
                         reader->message);
    }
    VSHI_TRY(read_header(reader));
    VSHI_TRY(read_texts(reader));
    return read_rows(reader);
}

vsh_result vshi_png_read(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                         vsh_image_file **file, vsh_error *error) {
    png_reader reader = {.path = path, .run = run, .error = error};
    uint64_t size;
    *file = NULL;
    if (bytes == NULL) {
        VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &reader.stream, &size, error));
    } else {
        reader.stream = fmemopen((void *)(uintptr_t)bytes->at, bytes->size, "rb"); /* only reads */
        if (reader.stream == NULL) {
            return vshi_fail_memory(error, path);
        }
    }
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

/* --- writing row by row, into a file or memory */

/* Begins as zeros; must not move. */
typedef struct png_writer {
    png_structp png;
    png_infop info;
    bool to_file;
    vshi_sink sink;        /* the file; its errno is more exact than libpng's messages */
    unsigned char *bytes;  /* in memory */
    size_t size, capacity; /* written so far; of `bytes` */
    bool out_of_memory;
    char message[MESSAGE_ROOM];
    const char *path;    /* that messages name */
    int32_t height, row; /* next */
    int32_t bits;
    unsigned char *line; /* [width][channels] */
} png_writer;

typedef struct png_header {
    int32_t width, height;
    int32_t channels;           /* 1: Y, 2: Y A, 3: R G B, 4: R G B A */
    int32_t bits;               /* 8 or 16 */
    bool is_srgb;               /* adds the chunks sRGB, gAMA and cHRM */
    const vsh_attribute *texts; /* [text_count], before the rows */
    size_t text_count;
} png_header;

/* --- callbacks of libpng */

static void on_write(png_structp png, png_bytep bytes, size_t size) {
    png_writer *writer = png_get_io_ptr(png);
    if (writer->to_file) {
        vshi_sink_write(&writer->sink, bytes, size, writer->size);
        writer->size += size;
        return;
    }
    if (size > writer->capacity - writer->size) {
        const size_t capacity = 2 * writer->capacity + size + 4096;
        unsigned char *grown = realloc(writer->bytes, capacity);
        if (grown == NULL) {
            writer->out_of_memory = true;
            png_error(png, "the system refused memory");
        }
        writer->bytes = grown;
        writer->capacity = capacity;
    }
    memcpy(writer->bytes + writer->size, bytes, size);
    writer->size += size;
}

static void on_flush(png_structp png) {
    (void)png;
}

/* Notes failures: without memory, libpng may drop a text and go on. */
static png_voidp on_malloc(png_structp png, png_alloc_size_t size) {
    png_writer *writer = png_get_mem_ptr(png);
    void *memory = malloc(size);
    writer->out_of_memory |= memory == NULL;
    return memory;
}

static void on_free(png_structp png, png_voidp memory) {
    (void)png;
    free(memory);
}

/* --- the parts of a file. They return false after a failure, with `out_of_memory` or a `message`. */

static void write_info(png_writer *writer, const png_header *header) {
    static const int types[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGB_ALPHA};
    png_structp png = writer->png;
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(png, writer, on_write, on_flush);
    png_set_IHDR(png, writer->info, (png_uint_32)header->width, (png_uint_32)header->height, header->bits,
                 types[header->channels - 1], PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    if (header->is_srgb) {
        png_set_sRGB_gAMA_and_cHRM(png, writer->info, PNG_sRGB_INTENT_ABSOLUTE);
    }
    for (size_t i = 0; i < header->text_count; ++i) {
        /* libpng writes to neither, in spite of the types */
        png_text text = {.compression = PNG_TEXT_COMPRESSION_NONE,
                         .key = (char *)(uintptr_t)header->texts[i].name,
                         .text = (char *)(uintptr_t)header->texts[i].value};
        png_set_text(png, writer->info, &text, 1);
    }
    png_write_info(png, writer->info);
}

static bool write_start(png_writer *writer, const png_header *header) {
    writer->png = png_create_write_struct_2(PNG_LIBPNG_VER_STRING, writer->message, on_error, on_warning,
                                            writer, on_malloc, on_free);
    writer->info = writer->png != NULL ? png_create_info_struct(writer->png) : NULL;
    if (writer->info == NULL) {
        writer->out_of_memory = true;
        return false;
    }
    if (setjmp(png_jmpbuf(writer->png)) != 0) {
        return false;
    }
    write_info(writer, header);
    return !writer->out_of_memory;
}

/* `row` is [width][channels], the higher byte of 16 bits first. */
static bool write_row(png_writer *writer, const unsigned char *row) {
    if (setjmp(png_jmpbuf(writer->png)) != 0) {
        return false;
    }
    png_write_row(writer->png, row);
    return !writer->out_of_memory;
}

/* Ends the file after its last row. */
static bool write_end(png_writer *writer) {
    if (setjmp(png_jmpbuf(writer->png)) != 0) {
        return false;
    }
    png_write_end(writer->png, writer->info);
    return !writer->out_of_memory;
}

/* --- into a file */

static vsh_result check_writer(const png_writer *writer, bool done, vsh_error *error) {
    if (writer->out_of_memory) {
        return vshi_fail_memory(error, writer->path);
    }
    if (writer->sink.error != 0 || !done) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", writer->path,
                         writer->sink.error != 0 ? strerror(writer->sink.error) : writer->message);
    }
    return VSH_OK;
}

static vsh_result end_file(void *user, vsh_error *error) {
    png_writer *writer = user;
    if (writer == NULL) {
        return VSH_OK;
    }
    /* libpng would complain about missing rows of an abandoned file */
    const bool done = writer->row < writer->height || write_end(writer);
    vshi_sink_close(&writer->sink);
    const vsh_result result = check_writer(writer, done, error);
    png_destroy_write_struct(&writer->png, &writer->info);
    free(writer->line);
    free(writer);
    return result;
}

/* The texts are Software, the attributes, and vdbshade_color_space. An attribute replaces our Software, but
 * not our vdbshade_color_space. */
static bool write_head(png_writer *writer, const vshi_planes *planes, vsh_attribute *texts) {
    char software[64];
    snprintf(software, sizeof software, "vdbshade %s", vsh_version());
    const vsh_attribute own[] = {{"Software", software},
                                 {"vdbshade_color_space", planes->is_srgb ? "sRGB" : "linear"}};
    size_t count = 1;
    texts[0] = own[0];
    for (size_t i = 0; i < planes->attribute_count; ++i) {
        if (strcmp(planes->attributes[i].name, own[0].name) == 0) {
            --count;
        }
    }
    for (size_t i = 0; i < planes->attribute_count; ++i) {
        if (strcmp(planes->attributes[i].name, own[1].name) != 0) {
            texts[count++] = planes->attributes[i];
        }
    }
    texts[count++] = own[1];
    const png_header header = {.width = planes->width,
                               .height = planes->height,
                               .channels = planes->count,
                               .bits = writer->bits,
                               .is_srgb = planes->is_srgb,
                               .texts = texts,
                               .text_count = count};
    return write_start(writer, &header);
}

static vsh_result begin_file(const char *temporary, const char *path, const vshi_format *format,
                             const vshi_planes *planes, int32_t bits, void **made, vsh_error *error) {
    (void)format;
    png_writer *writer;
    vsh_attribute *texts = NULL;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE(writer, 1, path, error));
    *writer = (png_writer){.to_file = true,
                           .sink = vshi_sink_open(temporary),
                           .path = path,
                           .height = planes->height,
                           .bits = bits};
    VSHI_TRY_DONE(VSHI_ALLOCATE(texts, planes->attribute_count + 2, path, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&writer->line, (size_t)planes->width,
                                (size_t)planes->count * (size_t)(bits / 8), path, error));
    VSHI_TRY_DONE(check_writer(writer, write_head(writer, planes, texts), error));
    *made = writer;
    writer = NULL;
done:
    free(texts);
    end_file(writer, NULL);
    return result;
}

/* Fills the line with row y of the planes, channels side by side, the higher byte first. */
static void fill_row(const png_writer *writer, const vshi_planes *planes, int32_t y) {
    const size_t width = (size_t)planes->width, count = (size_t)planes->count;
    const size_t size = writer->bits == 16 ? 2 : 1;
    for (size_t c = 0; c < count; ++c) {
        unsigned char *to = writer->line + c * size;
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

static vsh_result add_rows(void *user, const vshi_planes *planes, int32_t rows, vsh_error *error) {
    png_writer *writer = user;
    for (int32_t y = 0; y < rows; ++y) {
        fill_row(writer, planes, y);
        VSHI_TRY(check_writer(writer, write_row(writer, writer->line), error));
    }
    writer->row += rows;
    return VSH_OK;
}

static double writer_bytes(const vshi_format *format, const vshi_planes *planes, int32_t bits) {
    (void)format;
    enum { ROWS = 5 /* ours; libpng's: the row, the one before, and two filtered ones */ };
    enum { ZLIB = 512 << 10 /* zlib's window and tables, and libpng's buffer */ };
    return ROWS * (double)planes->width * planes->count * (bits / 8) + ZLIB;
}

const vshi_codec vshi_png_codec = {begin_file, add_rows, end_file, writer_bytes};

/* --- into memory */

static bool encode(png_writer *writer, const vshi_png_source *source) {
    const png_header header = {
        .width = source->width, .height = source->height, .channels = source->channels, .bits = source->bits};
    bool done = write_start(writer, &header);
    for (int32_t y = 0; y < source->height && done; ++y) {
        source->row(source->user, y, writer->line);
        done = write_row(writer, writer->line);
    }
    return done && write_end(writer);
}

vsh_result vshi_png_encode(const vshi_png_source *source, const char *what, unsigned char **bytes,
                           size_t *size, vsh_error *error) {
    png_writer writer = {.to_file = false};
    vsh_result result;
    *bytes = NULL;
    *size = 0;
    VSHI_TRY_DONE(vshi_allocate((void **)&writer.line, (size_t)source->width,
                                (size_t)(source->channels * source->bits / 8), what, error));
    if (encode(&writer, source)) {
        *bytes = writer.bytes;
        *size = writer.size;
        writer.bytes = NULL;
    } else {
        result = writer.out_of_memory ? vshi_fail_memory(error, what)
                                      : vshi_fail(error, VSH_ERROR_LIMIT, "%s: %s", what, writer.message);
    }
done:
    png_destroy_write_struct(&writer.png, &writer.info);
    free(writer.bytes);
    free(writer.line);
    return result;
}
