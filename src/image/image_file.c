#include "image/planes.h"

#include "base/memory.h"

#include <stdio.h>
#include <stdlib.h>

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
    vsh_result result = vshi_check_values(path, width, height, channels, error);
    if (result != VSH_OK) {
        return result;
    }
    if (channels > VSH_MAX_CHANNELS) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: %lld channels, expected at most %d", path,
                         (long long)channels, VSH_MAX_CHANNELS);
    }
    const double bytes = (double)width * (double)height * (double)channels * sizeof(float);
    result = vshi_check_limit(run, bytes, path, error);
    if (result != VSH_OK) {
        return result;
    }
    void *memory;
    result = vshi_allocate(&memory, 1, sizeof **file, path, error);
    if (result != VSH_OK) {
        return result;
    }
    vsh_image_file *image = memory;
    image->width = (int32_t)width;
    image->height = (int32_t)height;
    image->channel_count = (int32_t)channels;
    const size_t texels = (size_t)width * (size_t)height;
    /* calloc, because its pages are taken when they are first written: a short file that claims to be huge
     * fails before it costs memory */
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

vsh_result vshi_image_job(const char *path, const vsh_run *run, int64_t units, vshi_job **job,
                          vsh_error *error) {
    *job = vshi_job_begin(run, "load", (size_t)units);
    return *job != NULL ? VSH_OK : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
}

void vshi_image_file_name(vsh_image_file *file, int32_t channel, const char *name) {
    snprintf(file->text[channel], sizeof file->text[channel], "%s", name);
    vshi_one_line(file->text[channel]);
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
