#include "base/try.h"
#include "image/exr.h"

#include <openexr.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What OpenEXR says of a failure: the first message of a call, because it is the most exact. */
typedef struct exr_log {
    char message[400];
} exr_log;

static void note(exr_const_context_t context, exr_result_t code, const char *message) {
    void *user = NULL;
    (void)code;
    if (context == NULL || exr_get_user_data(context, &user) != EXR_ERR_SUCCESS || user == NULL) {
        return;
    }
    exr_log *log = user;
    if (log->message[0] == '\0') {
        snprintf(log->message, sizeof log->message, "%s", message);
    }
}

/* A file being read: its first part. */
typedef struct exr_reader {
    exr_context_t context;
    exr_decode_pipeline_t pipeline;
    bool pipeline_ready;
    exr_attr_box2i_t window; /* the data window: the pixels that the file has */
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

static bool is_going_on(const exr_reader *reader, exr_result_t status, int64_t row) {
    return status == EXR_ERR_SUCCESS && row < reader->image->height && !vshi_job_cancelled(reader->job);
}

static exr_result_t read_lines(exr_reader *reader) {
    int32_t lines = 0;
    exr_result_t status = exr_get_scanlines_per_chunk(reader->context, PART, &lines);
    if (status == EXR_ERR_SUCCESS && lines < 1) {
        status = EXR_ERR_FILE_BAD_HEADER;
    }
    for (int64_t y = 0; is_going_on(reader, status, y); y += lines) {
        exr_chunk_info_t info;
        status = exr_read_scanline_chunk_info(reader->context, PART, (int)(y + reader->window.min.y), &info);
        if (status == EXR_ERR_SUCCESS) {
            status = read_chunk(reader, &info, 0, y);
        }
        vshi_job_advance(reader->job, (size_t)lines);
    }
    return status;
}

static exr_result_t read_tiles(exr_reader *reader) {
    int32_t width = 0;
    int32_t height = 0;
    exr_result_t status = exr_get_tile_sizes(reader->context, PART, 0, 0, &width, &height);
    if (status == EXR_ERR_SUCCESS && (width < 1 || height < 1)) {
        status = EXR_ERR_FILE_BAD_HEADER;
    }
    for (int64_t y = 0; is_going_on(reader, status, y); y += height) {
        for (int64_t x = 0; status == EXR_ERR_SUCCESS && x < reader->image->width; x += width) {
            exr_chunk_info_t info;
            status = exr_read_tile_chunk_info(reader->context, PART, (int)(x / width), (int)(y / height), 0,
                                              0, &info);
            if (status == EXR_ERR_SUCCESS) {
                status = read_chunk(reader, &info, x, y);
            }
        }
        vshi_job_advance(reader->job, (size_t)height);
    }
    return status;
}

/* Makes the image from the header, once that is known to be one we read. */
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
    return vshi_image_job(path, run, height, &reader->job, error);
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

static vsh_result code_of(exr_result_t status) {
    switch (status) {
    case EXR_ERR_OUT_OF_MEMORY:
        return VSH_ERROR_MEMORY;
    case EXR_ERR_FILE_ACCESS:
    case EXR_ERR_READ_IO:
        return VSH_ERROR_READ;
    case EXR_ERR_FEATURE_NOT_IMPLEMENTED: /* DWA compression, in 3.1 */
        return VSH_ERROR_UNSUPPORTED;
    default: /* damaged, or no EXR file */
        return VSH_ERROR_READ;
    }
}

vsh_result vshi_exr_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    exr_log log = {""};
    exr_reader reader = {0};
    exr_context_initializer_t setup = EXR_DEFAULT_CONTEXT_INITIALIZER;
    setup.error_handler_fn = note;
    setup.user_data = &log;
    /* a file whose table of chunks is missing is cut: guessing its chunks would hide that */
    setup.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;

    vsh_result result = VSH_OK;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    const exr_attr_chlist_t *channels = NULL;
    exr_result_t status = exr_start_read(&reader.context, path, &setup);
    if (status == EXR_ERR_SUCCESS) {
        status = exr_get_storage(reader.context, PART, &storage);
    }
    if (status == EXR_ERR_SUCCESS) {
        status = exr_get_channels(reader.context, PART, &channels);
    }
    if (status == EXR_ERR_SUCCESS) {
        status = exr_get_data_window(reader.context, PART, &reader.window);
    }
    if (status != EXR_ERR_SUCCESS) {
        goto done;
    }
    result = read_header(&reader, path, run, storage, channels, error);
    if (result != VSH_OK) {
        goto done;
    }
    status = read_attributes(&reader);
    if (status == EXR_ERR_SUCCESS) {
        status = storage == EXR_STORAGE_TILED ? read_tiles(&reader) : read_lines(&reader);
    }

    if (vshi_job_cancelled(reader.job)) {
        result = vshi_job_fail_cancelled(reader.job, error);
    }

done:
    vshi_job_end(reader.job);
    if (reader.pipeline_ready) {
        exr_decoding_destroy(reader.context, &reader.pipeline);
    }
    if (reader.context != NULL) {
        exr_finish(&reader.context);
    }
    if (result == VSH_OK && status != EXR_ERR_SUCCESS) {
        result = vshi_fail(error, code_of(status), "%s: could not be read: %s", path,
                           log.message[0] != '\0' ? log.message : exr_get_default_error_message(status));
    }
    if (result != VSH_OK) {
        vsh_image_free(reader.image);
        return result;
    }
    *file = reader.image;
    return VSH_OK;
}
