/* An image between a reader and its caller. */
#include "base/memory.h"
#include "base/try.h"
#include "image/planes.h"
#include "sandbox/reader.h"

#include <string.h>

vsh_result vshi_serve_image(const char *path, vshi_decoder *request, const vsh_run *run,
                            vshi_encoder *payload, vsh_error *error) {
    vsh_image_file *file = NULL;
    const size_t size = (size_t)vshi_decode_count(request, SIZE_MAX / 2);
    const void *bytes = vshi_decode_array(request, size, 1);
    if (!vshi_decoder_ends(request)) {
        return vshi_fail(error, VSH_ERROR_INTERNAL, "%s: the request to its reader does not hold", path);
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

static vsh_result take_attributes(vshi_decoder *decoder, vshi_attributes *attributes, const char *path,
                                  vsh_error *error) {
    const uint64_t count = vshi_decode_count(decoder, UINT32_MAX);
    for (uint64_t i = 0; i < count; ++i) {
        const char *name = vshi_decode_text(decoder, true), *value = vshi_decode_text(decoder, true);
        if (name == NULL || value == NULL || !vshi_attributes_add(attributes, name, value)) {
            vshi_attributes_free(attributes);
            return name == NULL || value == NULL
                       ? vshi_answer_fail(path, "an attribute", error)
                       : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
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
    vsh_result result = take_attributes(decoder, &attributes, path, error);
    if (result != VSH_OK) {
        return result;
    }
    /* none is above 2^31 and 2^8 */
    const double values = (double)width * (double)height * (double)channels;
    const uint64_t count = values <= (double)VSHI_MAX_VALUES ? width * height * channels : UINT64_MAX;
    const float *from = vshi_decode_array(decoder, count, sizeof *from);
    result =
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

vsh_result vshi_image_from_reader(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                                  vsh_image_file **file, vsh_error *error) {
    enum { UNITS = 1000 };
    vshi_exchange exchange;
    vshi_answer answer;
    vshi_job *job = NULL;
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_image_job(path, run, UNITS, &job, error));
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
