/* OpenEXR files, through OpenEXR's C core. */
#include "base/file.h"
#include "base/memory.h"
#include "io/image/image.h"

#include <Imath/half.h>
#include <openexr.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void keep_first(exr_result_t *status, exr_result_t next) {
    *status = *status != EXR_ERR_SUCCESS ? *status : next;
}

/* --- reading */

enum { MESSAGE_ROOM = 400 };

/* Keeps the first message about a failure, the most exact one, in the context's char[MESSAGE_ROOM]. */
static void keep_message(exr_const_context_t context, exr_result_t code, const char *message) {
    void *kept = NULL;
    (void)code;
    if (context != NULL && exr_get_user_data(context, &kept) == EXR_ERR_SUCCESS && kept != NULL &&
        *(char *)kept == '\0') {
        snprintf(kept, MESSAGE_ROOM, "%s", message);
    }
}

/* A file being read: its first part. */
typedef struct exr_reader {
    exr_context_t context;
    exr_decode_pipeline_t pipeline;
    bool pipeline_ready;
    exr_attr_box2i_t window; /* the data window: the pixels of the file */
    vsh_image_file *image;
    vshi_job *job; /* in rows */
} exr_reader;

enum { PART = 0 };

/* Decodes a chunk whose first pixel is (x, y) of the image. */
static exr_result_t read_chunk(exr_reader *reader, const exr_chunk_info_t *info, int64_t x, int64_t y) {
    const vsh_image_file *image = reader->image;
    if (info->width < 1 || info->height < 1 || x + info->width > image->width ||
        y + info->height > image->height) {
        return EXR_ERR_CORRUPT_CHUNK;
    }
    exr_decode_pipeline_t *pipeline = &reader->pipeline;
    const bool first = !reader->pipeline_ready;
    exr_result_t status = first ? exr_decoding_initialize(reader->context, PART, info, pipeline)
                                : exr_decoding_update(reader->context, PART, info, pipeline);
    if (status != EXR_ERR_SUCCESS) {
        return status;
    }
    reader->pipeline_ready = true;
    const size_t texels = (size_t)image->width * (size_t)image->height;
    const size_t start = (size_t)y * (size_t)image->width + (size_t)x;
    for (int32_t c = 0; c < image->channel_count; ++c) {
        exr_coding_channel_info_t *channel = &pipeline->channels[c];
        channel->decode_to_ptr = (uint8_t *)(image->values + (size_t)c * texels + start);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = (int16_t)sizeof(float);
        channel->user_pixel_stride = (int32_t)sizeof(float);
        channel->user_line_stride = (int32_t)(image->width * (int32_t)sizeof(float));
    }
    if (first) {
        status = exr_decoding_choose_default_routines(reader->context, PART, pipeline);
    }
    return status == EXR_ERR_SUCCESS ? exr_decoding_run(reader->context, PART, pipeline) : status;
}

/* Reads all chunks: tiles, or scan lines as tiles of the full width. */
static exr_result_t read_chunks(exr_reader *reader, bool tiled) {
    int32_t width = reader->image->width, height = 0;
    exr_result_t status = tiled ? exr_get_tile_sizes(reader->context, PART, 0, 0, &width, &height)
                                : exr_get_scanlines_per_chunk(reader->context, PART, &height);
    if (status == EXR_ERR_SUCCESS && (width < 1 || height < 1)) {
        status = EXR_ERR_FILE_BAD_HEADER;
    }
    for (int64_t y = 0; status == EXR_ERR_SUCCESS && y < reader->image->height; y += height) {
        for (int64_t x = 0; status == EXR_ERR_SUCCESS && x < reader->image->width; x += width) {
            exr_chunk_info_t info;
            status = tiled ? exr_read_tile_chunk_info(reader->context, PART, (int)(x / width),
                                                      (int)(y / height), 0, 0, &info)
                           : exr_read_scanline_chunk_info(reader->context, PART,
                                                          (int)(y + reader->window.min.y), &info);
            if (status == EXR_ERR_SUCCESS) {
                status = read_chunk(reader, &info, x, y);
            }
        }
        if (vshi_job_advance(reader->job, (size_t)height)) {
            break;
        }
    }
    return status;
}

/* Checks the header, and makes the image. */
static vsh_result read_header(exr_reader *reader, const char *path, const vsh_run *run, exr_storage_t storage,
                              const exr_attr_chlist_t *channels, vsh_error *error) {
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: deep images are not read", path);
    }
    for (int32_t c = 0; c < channels->num_channels; ++c) {
        const exr_attr_chlist_entry_t *entry = &channels->entries[c];
        if (entry->x_sampling != 1 || entry->y_sampling != 1) {
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                             "%s: channel '%s' is subsampled (%d × %d), expected 1 × 1", path,
                             entry->name.str, entry->x_sampling, entry->y_sampling);
        }
    }
    const exr_attr_box2i_t *window = &reader->window;
    const int64_t width = (int64_t)window->max.x - window->min.x + 1;
    const int64_t height = (int64_t)window->max.y - window->min.y + 1;
    if (width > INT32_MAX / (int32_t)sizeof(float)) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %lld pixels wide, expected at most %d", path,
                         (long long)width, INT32_MAX / (int32_t)sizeof(float));
    }
    VSHI_TRY(vshi_image_file_new(path, run, width, height, channels->num_channels, &reader->image, error));
    for (int32_t c = 0; c < channels->num_channels; ++c) {
        vshi_image_file_name(reader->image, c, channels->entries[c].name.str);
    }
    return vshi_job_open(&reader->job, run, "load", (size_t)height, path, error);
}

/* String attributes, in the file's order. */
static exr_result_t read_attributes(exr_reader *reader) {
    int32_t count = 0;
    exr_result_t status = exr_get_attribute_count(reader->context, PART, &count);
    for (int32_t i = 0; i < count && status == EXR_ERR_SUCCESS; ++i) {
        const exr_attribute_t *attribute = NULL;
        status = exr_get_attribute_by_index(reader->context, PART, EXR_ATTR_LIST_FILE_ORDER, i, &attribute);
        if (status == EXR_ERR_SUCCESS && attribute->type == EXR_ATTR_STRING &&
            strcmp(attribute->name, "type") != 0 /* of storage */ &&
            !vshi_attributes_add(&reader->image->attributes, attribute->name, attribute->string->str)) {
            status = EXR_ERR_OUT_OF_MEMORY;
        }
    }
    return status;
}

static vsh_result convert_status(exr_result_t status) {
    switch (status) {
    case EXR_ERR_OUT_OF_MEMORY:
        return VSH_ERROR_MEMORY;
    case EXR_ERR_FEATURE_NOT_IMPLEMENTED: /* DWA compression, in 3.1 */
        return VSH_ERROR_UNSUPPORTED;
    default: /* missing, damaged, or no EXR file */
        return VSH_ERROR_READ;
    }
}

vsh_result vshi_exr_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    char message[MESSAGE_ROOM] = "";
    exr_reader reader = {0};
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = keep_message;
    setup.user_data = message;
    /* a file without its table of chunks is cut short; guessing the chunks would hide that */
    setup.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;

    vsh_result result = VSH_OK;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    const exr_attr_chlist_t *channels = NULL;
    exr_result_t status = exr_start_read(&reader.context, path, &setup);
    keep_first(&status, exr_get_storage(reader.context, PART, &storage));
    keep_first(&status, exr_get_channels(reader.context, PART, &channels));
    keep_first(&status, exr_get_data_window(reader.context, PART, &reader.window));
    if (status != EXR_ERR_SUCCESS) {
        goto done;
    }
    VSHI_TRY_DONE(read_header(&reader, path, run, storage, channels, error));
    status = read_attributes(&reader);
    if (status == EXR_ERR_SUCCESS) {
        status = read_chunks(&reader, storage == EXR_STORAGE_TILED);
    }
    result = vshi_job_check(reader.job, error);

done:
    vshi_job_end(reader.job);
    if (reader.pipeline_ready) {
        exr_decoding_destroy(reader.context, &reader.pipeline);
    }
    if (reader.context != NULL) {
        exr_finish(&reader.context);
    }
    if (result == VSH_OK && status != EXR_ERR_SUCCESS) {
        result = vshi_fail(error, convert_status(status), "%s: could not be read: %s", path,
                           message[0] != '\0' ? message : exr_get_default_error_message(status));
    }
    if (result != VSH_OK) {
        vsh_image_free(reader.image);
        return result;
    }
    *file = reader.image;
    return VSH_OK;
}

/* --- writing */

/* Keeps OpenEXR from printing: our messages come from the sink and from result codes. OpenEXR may hold the
 * context's lock here, so this must not call it. */
static void ignore_message(exr_const_context_t context, exr_result_t code, const char *message) {
    (void)context;
    (void)code;
    (void)message;
}

/* Always reports success: after a failed write OpenEXR 3.1.5 deadlocks on its own lock. The sink keeps the
 * error, and the caller checks it. */
static int64_t write_bytes(exr_const_context_t context, void *user, const void *data, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t fail) {
    (void)context;
    (void)fail;
    vshi_sink *sink = user;
    vshi_sink_write(sink, data, (size_t)size, offset);
    return (int64_t)size;
}

enum {
    MAX_CHUNK_LINES = 16, /* ZIP's */
    ZIP_LEVEL = 3         /* half the time of OpenEXR's default, 4, for 6 % more bytes */
};

typedef struct exr_writer {
    vshi_sink sink;
    exr_context_t context;
    int part;
    const char *path;
    int32_t width, height, count;
    int32_t order[VSH_MAX_CHANNELS]; /* planes by name, as EXR sorts its channels */
    exr_pixel_type_t type;
    size_t value_size;    /* bytes */
    int32_t lines;        /* scan lines in a chunk */
    int32_t row;          /* first of the chunk */
    int32_t filled;       /* rows in it */
    unsigned char *chunk; /* [count][lines][width] values */
    exr_encode_pipeline_t pipeline;
    bool pipeline_ready;
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline); /* OpenEXR's own */
    exr_result_t status;                                       /* the first failure */
} exr_writer;

static void sort_by_name(const vshi_planes *planes, int32_t *order) {
    for (int32_t i = 0; i < planes->count; ++i) {
        int32_t at = i;
        while (at > 0 && strcmp(planes->planes[order[at - 1]].name, planes->planes[i].name) > 0) {
            order[at] = order[at - 1];
            --at;
        }
        order[at] = i;
    }
}

/* Makes all calls even after a failure: the caller then deletes the file. */
static exr_result_t write_header(exr_writer *writer, const vshi_planes *planes) {
    const exr_context_t file = writer->context;
    char software[64];
    snprintf(software, sizeof software, "vdbshade %s", vsh_version());
    exr_result_t status = exr_set_longname_support(file, 1);
    keep_first(&status, exr_add_part(file, NULL, EXR_STORAGE_SCANLINE, &writer->part));
    keep_first(&status, exr_initialize_required_attr_simple(file, writer->part, planes->width, planes->height,
                                                            EXR_COMPRESSION_ZIP));
    keep_first(&status, exr_set_zip_compression_level(file, writer->part, ZIP_LEVEL));
    keep_first(&status, exr_attr_set_string(file, writer->part, "software", software));
    for (size_t i = 0; i < planes->attribute_count; ++i) {
        keep_first(&status, exr_attr_set_string(file, writer->part, planes->attributes[i].name,
                                                planes->attributes[i].value));
    }
    if (planes->rgb[0] != '\0') {
        keep_first(&status, exr_attr_set_string(file, writer->part, VSH_IMAGE_RGB, planes->rgb));
    }
    for (int32_t c = 0; c < planes->count; ++c) {
        keep_first(&status, exr_add_channel(file, writer->part, planes->planes[writer->order[c]].name,
                                            writer->type, EXR_PERCEPTUALLY_LINEAR, 1, 1));
    }
    keep_first(&status, exr_write_header(file));
    keep_first(&status, exr_get_scanlines_per_chunk(file, writer->part, &writer->lines));
    return status;
}

static void fill_values(const exr_writer *writer, const vshi_planes *planes, const vshi_image_plane *plane,
                        size_t first, size_t count, unsigned char *to) {
    if (writer->type == EXR_PIXEL_FLOAT && plane->values != NULL) {
        memcpy(to, plane->values + first, count * sizeof(float));
        return;
    }
    for (size_t i = 0; i < count; ++i) {
        const float value = vshi_plane_at(planes, plane, first + i);
        if (writer->type == EXR_PIXEL_FLOAT) {
            memcpy(to + i * sizeof value, &value, sizeof value);
        } else {
            const imath_half_bits_t half_value = imath_float_to_half(value);
            memcpy(to + i * sizeof half_value, &half_value, sizeof half_value);
        }
    }
}

/* Stores a chunk raw if its compressed size is the raw size: readers expect raw data of that size, but
 * OpenEXR up to 3.4.7 writes compressed data (OpenEXR's issue 2306). */
static exr_result_t compress_chunk(exr_encode_pipeline_t *pipeline) {
    const exr_writer *writer = pipeline->encoding_user_data;
    const exr_result_t status = writer->compress(pipeline);
    if (status == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes) {
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
    }
    return status;
}

/* Writes the rows that the chunk holds. */
static exr_result_t write_chunk(exr_writer *writer) {
    exr_encode_pipeline_t *pipeline = &writer->pipeline;
    exr_chunk_info_t info;
    exr_result_t status = exr_write_scanline_chunk_info(writer->context, writer->part, writer->row, &info);
    if (status != EXR_ERR_SUCCESS) {
        return status;
    }
    const bool first = !writer->pipeline_ready;
    status = first ? exr_encoding_initialize(writer->context, writer->part, &info, pipeline)
                   : exr_encoding_update(writer->context, writer->part, &info, pipeline);
    if (status != EXR_ERR_SUCCESS) {
        return status;
    }
    writer->pipeline_ready = true;
    const size_t line = (size_t)writer->width * writer->value_size;
    for (int32_t c = 0; c < writer->count; ++c) {
        exr_coding_channel_info_t *channel = &pipeline->channels[c];
        channel->encode_from_ptr = writer->chunk + (size_t)c * (size_t)writer->lines * line;
        channel->user_pixel_stride = (int32_t)writer->value_size;
        channel->user_line_stride = (int32_t)line;
    }
    if (first) {
        status = exr_encoding_choose_default_routines(writer->context, writer->part, pipeline);
        writer->compress = pipeline->compress_fn;
        pipeline->compress_fn = compress_chunk;
        pipeline->encoding_user_data = writer;
    }
    writer->row += writer->filled;
    writer->filled = 0;
    return status == EXR_ERR_SUCCESS ? exr_encoding_run(writer->context, writer->part, pipeline) : status;
}

static double chunk_bytes(const vshi_planes *planes, int32_t bits) {
    return (double)planes->count * (double)planes->width * (bits / 8) * MAX_CHUNK_LINES;
}

static double writer_bytes(const vshi_format *format, const vshi_planes *planes, int32_t bits) {
    (void)format;
    return 4.0 *
           chunk_bytes(planes, bits); /* our chunk, and the encoder's: packed, and two steps of compression */
}

static vsh_result check_writer(exr_writer *writer, vsh_error *error) {
    const int number = writer->sink.error;
    if (number != 0) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", writer->path,
                         strerror(number));
    }
    return writer->status == EXR_ERR_SUCCESS
               ? VSH_OK
               : vshi_fail(error,
                           writer->status == EXR_ERR_OUT_OF_MEMORY ? VSH_ERROR_MEMORY : VSH_ERROR_WRITE,
                           "%s: could not be written: %s", writer->path,
                           exr_get_default_error_message(writer->status));
}

static vsh_result end_file(void *user, vsh_error *error) {
    exr_writer *writer = user;
    if (writer == NULL) {
        return VSH_OK;
    }
    if (writer->pipeline_ready) {
        exr_encoding_destroy(writer->context, &writer->pipeline);
    }
    if (writer->context != NULL) {
        /* writes the table of chunks, so it can fail as well */
        keep_first(&writer->status, exr_finish(&writer->context));
    }
    vshi_sink_close(&writer->sink);
    const vsh_result result = check_writer(writer, error);
    free(writer->chunk);
    free(writer);
    return result;
}

static vsh_result begin_file(const char *temporary, const char *path, const vshi_format *format,
                             const vshi_planes *planes, int32_t bits, void **made, vsh_error *error) {
    (void)format;
    const size_t value_size = bits == 16 ? sizeof(imath_half_bits_t) : sizeof(float);
    if (chunk_bytes(planes, bits) > (double)INT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: %d pixels of %d channels in a row are more than OpenEXR's 2 GiB a chunk", path,
                         planes->width, planes->count);
    }
    exr_writer *writer;
    vsh_result result;
    VSHI_TRY(VSHI_ALLOCATE(writer, 1, path, error));
    writer->sink = vshi_sink_open(temporary);
    writer->path = path;
    writer->width = planes->width;
    writer->height = planes->height;
    writer->count = planes->count;
    writer->type = bits == 16 ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    writer->value_size = value_size;
    sort_by_name(planes, writer->order);
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = ignore_message;
    setup.user_data = &writer->sink;
    setup.write_fn = write_bytes;
    writer->status = exr_start_write(&writer->context, temporary, EXR_WRITE_FILE_DIRECTLY, &setup);
    if (writer->status == EXR_ERR_SUCCESS) {
        writer->status = write_header(writer, planes);
    }
    VSHI_TRY_DONE(check_writer(writer, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&writer->chunk,
                                (size_t)planes->count * (size_t)writer->lines * (size_t)planes->width,
                                value_size, path, error));
    *made = writer;
    writer = NULL;
done:
    end_file(writer, NULL);
    return result;
}

static vsh_result add_rows(void *user, const vshi_planes *planes, int32_t rows, vsh_error *error) {
    exr_writer *writer = user;
    const size_t width = (size_t)writer->width;
    for (int32_t y = 0; y < rows && writer->status == EXR_ERR_SUCCESS && writer->sink.error == 0;) {
        const int32_t room = writer->lines - writer->filled;
        const int32_t count = rows - y < room ? rows - y : room;
        for (int32_t c = 0; c < writer->count; ++c) {
            const size_t line = (size_t)c * (size_t)writer->lines + (size_t)writer->filled;
            fill_values(writer, planes, &planes->planes[writer->order[c]], (size_t)y * width,
                        (size_t)count * width, writer->chunk + line * width * writer->value_size);
        }
        y += count;
        writer->filled += count;
        if (writer->filled == writer->lines || writer->row + writer->filled == writer->height) {
            writer->status = write_chunk(writer);
        }
    }
    return check_writer(writer, error);
}

const vshi_codec vshi_exr_codec = {begin_file, add_rows, end_file, writer_bytes};
