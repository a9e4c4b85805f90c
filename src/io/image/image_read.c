/* Reads images: chooses the codec, and talks to reader processes. */
#include "base/file.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/module.h"
#include "base/threads.h"
#include "io/image/image.h"
#include "io/reader/reader.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* --- an image file in memory */

vsh_result vshi_check_values(const char *path, int64_t width, int64_t height, int64_t channels,
                             vsh_error *error) {
    const double values = (double)width * (double)height * (double)channels;
    if (values <= (double)VSHI_MAX_VALUES) {
        return VSH_OK;
    }
    return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %lld × %lld pixels of %lld channels: more than 2^31 values",
                     path, (long long)width, (long long)height, (long long)channels);
}

vsh_result vshi_image_file_new(const char *path, const vsh_run *run, int64_t width, int64_t height,
                               int64_t channels, vsh_image_file **file, vsh_error *error) {
    *file = NULL;
    if (width < 1 || width > INT32_MAX || height < 1 || height > INT32_MAX || channels < 1) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: %lld × %lld pixels of %lld channels: damaged or empty",
                         path, (long long)width, (long long)height, (long long)channels);
    }
    VSHI_TRY(vshi_check_values(path, width, height, channels, error));
    if (channels > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %lld channels, expected at most %d", path,
                         (long long)channels, VSH_MAX_CHANNELS);
    }
    const double bytes = (double)width * (double)height * (double)channels * sizeof(float);
    vsh_image_file *image;
    VSHI_TRY(vshi_check_limit(run, bytes, path, error));
    VSHI_TRY(VSHI_ALLOCATE(image, 1, path, error));
    image->width = (int32_t)width;
    image->height = (int32_t)height;
    image->channel_count = (int32_t)channels;
    const size_t texels = (size_t)width * (size_t)height;
    /* calloc() takes pages at the first write: a short file that claims to be huge fails before it costs
     * memory */
    image->values = calloc(texels * (size_t)channels, sizeof *image->values);
    image->text = calloc((size_t)channels, sizeof *image->text);
    if (image->values == NULL || image->text == NULL) {
        vsh_image_free(image);
        return vshi_fail(error, VSH_ERROR_MEMORY,
                         "%s: the system refused memory for %lld × %lld × %lld values", path,
                         (long long)width, (long long)height, (long long)channels);
    }
    for (int32_t c = 0; c < image->channel_count; ++c) {
        image->names[c] = image->text[c];
        image->planes[c] = image->values + (size_t)c * texels;
    }
    *file = image;
    return VSH_OK;
}

void vshi_image_file_name(vsh_image_file *file, int32_t channel, const char *name) {
    snprintf(file->text[channel], sizeof file->text[channel], "%s", name);
    vshi_one_line(file->text[channel]);
}

const float *vshi_image_find_plane(const vsh_image *image, const char *name) {
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], name) == 0) {
            return image->planes[c];
        }
    }
    return NULL;
}

vsh_image vsh_image_view(const vsh_image_file *file) {
    if (file == NULL) {
        return (vsh_image){0, 0, 0, NULL, NULL, NULL};
    }
    return (vsh_image){file->width, file->height, file->channel_count, file->names, file->planes, NULL};
}

const vsh_attribute *vsh_image_attributes(const vsh_image_file *file, size_t *count) {
    *count = file != NULL ? file->attributes.count : 0;
    return file != NULL ? file->attributes.list : NULL;
}

void vsh_image_free(vsh_image_file *file) {
    if (file == NULL) {
        return;
    }
    vshi_attributes_free(&file->attributes);
    free(file->text);
    free(file->values);
    free(file);
}

/* --- OpenImageIO is loaded when the first file needs it. It brings 240 libraries of formats; loading them
 * takes longer (0.2 s) than a small bake, and most runs use only EXR and PNG. */

static vshi_module module =
    VSHI_MODULE("images of this kind", "OpenImageIO", "oiio", 128 << 20, VSHI_OPENVDB_THREADS);

vsh_result vshi_oiio_load(const char *path, vsh_error *error) {
    vsh_error why;
    const vsh_result result = vshi_module_load(&module, &why);
    return result == VSH_OK ? VSH_OK : vshi_fail(error, result, "%s: %s", path, why.message);
}

const vshi_oiio_table *vshi_oiio(void) {
    return vshi_module_table(&module);
}

/* --- in a reader process */

vsh_result vshi_serve_image(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error) {
    vsh_image_file *file = NULL;
    const size_t size = (size_t)vshi_decode_count(request, SIZE_MAX / 2);
    const void *bytes = vshi_decode_array(request, size, 1);
    if (!vshi_decoder_ends(request)) {
        return vshi_fail(error, VSH_ERROR_INTERNAL, "%s: the request to its reader is bad", path);
    }
    VSHI_TRY(size > 0 ? vshi_image_read_bytes(path, bytes, size, run, &file, error)
                      : vsh_image_read(path, run, &file, error));
    vshi_encode_count(payload, (uint64_t)file->width);
    vshi_encode_count(payload, (uint64_t)file->height);
    vshi_encode_count(payload, (uint64_t)file->channel_count);
    for (int32_t c = 0; c < file->channel_count; ++c) {
        vshi_encode_text(payload, file->text[c]);
    }
    vshi_encode_count(payload, file->attributes.count);
    for (size_t i = 0; i < file->attributes.count; ++i) {
        vshi_encode_text(payload, file->attributes.list[i].name);
        vshi_encode_text(payload, file->attributes.list[i].value);
    }
    const size_t texels = (size_t)file->width * (size_t)file->height;
    vshi_encode_array(payload, file->values, texels * (size_t)file->channel_count, sizeof(float));
    vsh_image_free(file);
    return VSH_OK;
}

static vsh_result decode_attributes(vshi_decoder *decoder, vshi_attributes *attributes, const char *path,
                                    vsh_error *error) {
    const uint64_t count = vshi_decode_count(decoder, UINT32_MAX);
    for (uint64_t i = 0; i < count; ++i) {
        const char *name = vshi_decode_text(decoder, true), *value = vshi_decode_text(decoder, true);
        if (name == NULL || value == NULL || !vshi_attributes_add(attributes, name, value)) {
            vshi_attributes_free(attributes);
            return name == NULL || value == NULL ? vshi_answer_fail(path, "an attribute", error)
                                                 : vshi_fail_memory(error, path);
        }
    }
    return VSH_OK;
}

vsh_result vshi_image_decode(vshi_decoder *decoder, const char *path, vsh_image_file **file,
                             vsh_error *error) {
    const uint64_t width = vshi_decode_count(decoder, INT32_MAX),
                   height = vshi_decode_count(decoder, INT32_MAX);
    const uint64_t channels = vshi_decode_count(decoder, VSH_MAX_CHANNELS);
    const char *names[VSH_MAX_CHANNELS];
    for (uint64_t c = 0; c < channels; ++c) {
        names[c] = vshi_decode_text(decoder, true);
        if (names[c] == NULL || strlen(names[c]) >= VSHI_FILE_NAME) {
            return vshi_answer_fail(path, "a channel's name", error);
        }
    }
    vshi_attributes attributes = {0};
    VSHI_TRY(decode_attributes(decoder, &attributes, path, error));
    /* at most 2^31 × 2^31 × 2^8 */
    const double values = (double)width * (double)height * (double)channels;
    const uint64_t count = values <= (double)VSHI_MAX_VALUES ? width * height * channels : UINT64_MAX;
    const float *from = vshi_decode_array(decoder, count, sizeof *from);
    const vsh_result result =
        from != NULL && vshi_decoder_ends(decoder)
            ? vshi_image_file_new(path, NULL, (int64_t)width, (int64_t)height, (int64_t)channels, file, error)
            : vshi_answer_fail(path, "the image's size", error);
    if (result != VSH_OK) {
        vshi_attributes_free(&attributes);
    } else {
        (*file)->attributes = attributes;
        for (uint64_t c = 0; c < channels; ++c) {
            vshi_image_file_name(*file, (int32_t)c, names[c]);
        }
        memcpy((*file)->values, from, (size_t)count * sizeof *from);
    }
    return result;
}

/* Lets run->reader read the file, or `bytes` (may be NULL). */
static vsh_result read_in_reader(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                                 vsh_image_file **file, vsh_error *error) {
    enum { UNITS = 1000 };
    vshi_exchange exchange;
    vshi_answer answer;
    vshi_job *job = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_job_open(&job, run, "load", UNITS, path, error));
    VSHI_TRY_DONE(vshi_exchange_begin(&exchange, VSHI_READ_IMAGE, path, run, error));
    vshi_encode_count(&exchange.encoder, bytes != NULL ? bytes->size : 0);
    if (bytes != NULL) {
        vshi_encode_array(&exchange.encoder, bytes->at, bytes->size, 1);
    }
    VSHI_TRY_DONE(vshi_exchange_send_job(&exchange, job, UNITS, &answer, error));
    result = vshi_image_decode(&answer.payload, path, file, error);
    vshi_answer_free(&answer);
done:
    vshi_job_end(job);
    return result;
}

/* --- choosing the codec */

/* The first bytes decide: an EXR file may have any ending. */
static vsh_result read_file(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    static const unsigned char exr[] = {0x76, 0x2f, 0x31, 0x01}, png[] = {0x89, 'P', 'N', 'G'};
    unsigned char start[4] = {0};
    FILE *stream;
    uint64_t size;
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX, &stream, &size, error));
    const size_t count = fread(start, 1, sizeof start, stream);
    const bool failed = ferror(stream) != 0;
    fclose(stream);
    if (failed) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read", path);
    }
    const char *ending = vshi_path_ending(path);
    if (count == sizeof start && memcmp(start, exr, sizeof start) == 0) {
        return vshi_exr_read(path, run, file, error);
    }
    if (memcmp(start, png, sizeof start) == 0 || strcasecmp(ending, "png") == 0) {
        return vshi_png_read(path, NULL, run, file, error);
    }
    if (strcasecmp(ending, "exr") == 0) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: is no EXR file, or cut short", path);
    }
    VSHI_TRY(vshi_oiio_load(path, error));
    return vshi_oiio()->read(path, NULL, run, file, error);
}

vsh_result vsh_image_read(const char *path, const vsh_run *run, vsh_image_file **file, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(file);
    VSHI_NEEDS(path);
    if (path[0] == '\0') {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_image_read: no path was given");
    }
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    return full.reader != NULL ? read_in_reader(path, NULL, &full, file, error)
                               : read_file(path, &full, file, error);
}

static const char *find_format(const unsigned char *bytes, size_t size) {
    static const struct {
        const char *format, *magic;
        size_t length, at;
    } formats[] = {{"png", "\x89PNG", 4, 0}, {"jpeg", "\xff\xd8\xff", 3, 0}, {"webp", "WEBP", 4, 8}};
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; ++i) {
        if (size >= formats[i].at + formats[i].length &&
            memcmp(bytes + formats[i].at, formats[i].magic, formats[i].length) == 0) {
            return formats[i].format;
        }
    }
    return NULL;
}

vsh_result vshi_image_read_bytes(const char *name, const void *at, size_t size, const vsh_run *run,
                                 vsh_image_file **file, vsh_error *error) {
    const vshi_image_bytes bytes = {at, size, find_format(at, size)};
    *file = NULL;
    if (bytes.format == NULL) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: is neither PNG nor JPEG nor WebP", name);
    }
    if (run->reader != NULL) {
        return read_in_reader(name, &bytes, run, file, error);
    }
    if (strcmp(bytes.format, "png") == 0) {
        return vshi_png_read(name, &bytes, run, file, error);
    }
    VSHI_TRY(vshi_oiio_load(name, error));
    return vshi_oiio()->read(name, &bytes, run, file, error);
}
