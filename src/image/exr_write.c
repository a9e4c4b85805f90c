#include "image/exr.h"

#include "base/file.h"
#include "base/memory.h"
#include "base/try.h"

#include <Imath/half.h>
#include <openexr.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* OpenEXR would print its messages; ours come from the sink and from its codes. It may hold its lock on the
 * context here, so the context must not be asked for anything. */
static void say_nothing(exr_const_context_t context, exr_result_t code, const char *message) {
    (void)context;
    (void)code;
    (void)message;
}

/* After a failed write OpenEXR 3.1.5 waits for ever on its own lock, so it is told of none: the sink keeps
 * it, and the caller looks there. */
static int64_t write_bytes(exr_const_context_t context, void *user, const void *data, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t fail) {
    (void)context;
    (void)fail;
    vshi_sink *sink = user;
    vshi_sink_write(sink, data, (size_t)size, offset);
    return (int64_t)size;
}

enum { MAX_CHUNK_LINES = 16 }; /* ZIP's */

struct vshi_exr_writer {
    vshi_sink sink;
    exr_context_t context;
    int part;
    const char *path;
    int32_t width, height, count;
    int32_t order[VSH_MAX_CHANNELS]; /* file's channel → index of planes: by name, as EXR keeps them */
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
};

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

static exr_result_t write_header(vshi_exr_writer *writer, const vshi_planes *planes) {
    exr_result_t status = exr_set_longname_support(writer->context, 1);
    if (status == EXR_ERR_SUCCESS) {
        status = exr_add_part(writer->context, NULL, EXR_STORAGE_SCANLINE, &writer->part);
    }
    if (status == EXR_ERR_SUCCESS) {
        status = exr_initialize_required_attr_simple(writer->context, writer->part, planes->width,
                                                     planes->height, EXR_COMPRESSION_ZIP);
    }
    if (status == EXR_ERR_SUCCESS) {
        char software[64];
        snprintf(software, sizeof software, "vdbshade %s", vsh_version());
        status = exr_attr_set_string(writer->context, writer->part, "software", software);
    }
    for (size_t i = 0; status == EXR_ERR_SUCCESS && i < planes->attribute_count; ++i) {
        status = exr_attr_set_string(writer->context, writer->part, planes->attributes[i].name,
                                     planes->attributes[i].value);
    }
    if (status == EXR_ERR_SUCCESS && planes->rgb[0] != '\0') {
        status = exr_attr_set_string(writer->context, writer->part, VSH_IMAGE_RGB, planes->rgb);
    }
    for (int32_t c = 0; status == EXR_ERR_SUCCESS && c < planes->count; ++c) {
        status = exr_add_channel(writer->context, writer->part, planes->planes[writer->order[c]].name,
                                 writer->type, EXR_PERCEPTUALLY_LINEAR, 1, 1);
    }
    if (status == EXR_ERR_SUCCESS) {
        status = exr_write_header(writer->context);
    }
    if (status == EXR_ERR_SUCCESS) {
        status = exr_get_scanlines_per_chunk(writer->context, writer->part, &writer->lines);
    }
    return status;
}

static void fill_values(const vshi_exr_writer *writer, const vshi_planes *planes,
                        const vshi_image_plane *plane, size_t first, size_t count, unsigned char *to) {
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

/* Readers take a chunk for raw if its size is the raw size. OpenEXR up to 3.4.7 writes compressed data of
 * exactly that size, so such chunks are stored raw here (OpenEXR's issue 2306). */
static exr_result_t compress_chunk(exr_encode_pipeline_t *pipeline) {
    const vshi_exr_writer *writer = pipeline->encoding_user_data;
    const exr_result_t status = writer->compress(pipeline);
    if (status == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes) {
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
    }
    return status;
}

/* Writes the rows that the chunk holds. */
static exr_result_t write_chunk(vshi_exr_writer *writer) {
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

double vshi_exr_writer_bytes(const vshi_planes *planes, int32_t bits) {
    const int32_t bytes = bits / 8;
    const double chunk = (double)planes->count * (double)planes->width * bytes * MAX_CHUNK_LINES;
    return 4.0 * chunk; /* ours, and the encoder's: packed, two steps of compression */
}

static vsh_result result_of(vshi_exr_writer *writer, vsh_error *error) {
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

vsh_result vshi_exr_begin(const char *temporary, const char *path, const vshi_planes *planes, int32_t bits,
                          vshi_exr_writer **made, vsh_error *error) {
    const size_t value_size = bits == 16 ? sizeof(imath_half_bits_t) : sizeof(float);
    const double chunk_bytes =
        (double)planes->count * (double)planes->width * (double)value_size * MAX_CHUNK_LINES;
    if (chunk_bytes > (double)INT32_MAX) {
        return vshi_fail(error, VSH_ERROR_LIMIT,
                         "%s: %d pixels of %d channels in a row are more than OpenEXR's 2 GiB a chunk", path,
                         planes->width, planes->count);
    }
    vshi_exr_writer *writer;
    vsh_result result;
    VSHI_TRY(vshi_allocate((void **)&writer, 1, sizeof *writer, path, error));
    writer->sink = vshi_sink_open(temporary);
    writer->path = path;
    writer->width = planes->width;
    writer->height = planes->height;
    writer->count = planes->count;
    writer->type = bits == 16 ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT;
    writer->value_size = value_size;
    sort_by_name(planes, writer->order);
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = say_nothing;
    setup.user_data = &writer->sink;
    setup.write_fn = write_bytes;
    writer->status = exr_start_write(&writer->context, temporary, EXR_WRITE_FILE_DIRECTLY, &setup);
    if (writer->status == EXR_ERR_SUCCESS) {
        writer->status = write_header(writer, planes);
    }
    VSHI_TRY_DONE(result_of(writer, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&writer->chunk,
                                (size_t)planes->count * (size_t)writer->lines * (size_t)planes->width,
                                value_size, path, error));
    *made = writer;
    writer = NULL;
done:
    vshi_exr_end(writer, NULL);
    return result;
}

vsh_result vshi_exr_add(vshi_exr_writer *writer, const vshi_planes *planes, int32_t rows, vsh_error *error) {
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
    return result_of(writer, error);
}

vsh_result vshi_exr_end(vshi_exr_writer *writer, vsh_error *error) {
    if (writer == NULL) {
        return VSH_OK;
    }
    if (writer->pipeline_ready) {
        exr_encoding_destroy(writer->context, &writer->pipeline);
    }
    if (writer->context != NULL) {
        /* writes the table of chunks, so it can fail as well */
        const exr_result_t finished = exr_finish(&writer->context);
        writer->status = writer->status != EXR_ERR_SUCCESS ? writer->status : finished;
    }
    vshi_sink_close(&writer->sink);
    const vsh_result result = result_of(writer, error);
    free(writer->chunk);
    free(writer);
    return result;
}
