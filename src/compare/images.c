/* Images: their channels by name, over the texels that both cover. */
#include "base/memory.h"
#include "base/try.h"
#include "compare/files.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct images {
    vsh_image_file *file[2]; /* golden, new */
    vsh_image image[2];
    vshi_texts texts[2];
    const char *names[2][VSH_MAX_CHANNELS]; /* of the images */
    const float *planes[2][VSH_MAX_CHANNELS];
    uint8_t *mask; /* of the texels to be compared */
} images;

static int32_t find_channel(const vsh_image *image, const char *name) {
    for (int32_t i = 0; i < image->channel_count; ++i) {
        if (strcmp(image->names[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

/* Whether a file says that its R, G and B are made of other channels, which are there as well. */
static bool has_picture(const vsh_image_file *file) {
    size_t count = 0;
    const vsh_attribute *attributes = vsh_image_attributes(file, &count);
    bool says = false;
    for (size_t i = 0; i < count && !says; ++i) {
        says = strcmp(attributes[i].name, VSH_IMAGE_RGB) == 0;
    }
    const vsh_image image = vsh_image_view(file);
    bool others = false;
    for (int32_t c = 0; c < image.channel_count && !others; ++c) {
        others = image.names[c][0] == '\0' || image.names[c][1] != '\0';
    }
    return says && others;
}

/* The channels of a file, each counted once: without a picture that is there for other programs. */
static void view(images *both, int which) {
    const vsh_image all = vsh_image_view(both->file[which]);
    const bool picture = has_picture(both->file[which]);
    vsh_image *image = &both->image[which];
    *image = (vsh_image){all.width, all.height, 0, both->names[which], both->planes[which], NULL};
    for (int32_t c = 0; c < all.channel_count; ++c) {
        const char *name = all.names[c];
        if (!picture || (strcmp(name, "R") != 0 && strcmp(name, "G") != 0 && strcmp(name, "B") != 0)) {
            both->names[which][image->channel_count] = name;
            both->planes[which][image->channel_count++] = all.planes[c];
        }
    }
}

static vsh_result read_both(vshi_compare_work *work, images *both, vsh_error *error) {
    for (int which = 0; which < 2; ++which) {
        VSHI_TRY(vsh_image_read(work->path[which], &work->run, &both->file[which], error));
        const vsh_image all = vsh_image_view(both->file[which]);
        work->run.memory_held +=
            sizeof(float) * (uint64_t)all.width * (uint64_t)all.height * (uint64_t)all.channel_count;
        both->texts[which].list = vsh_image_attributes(both->file[which], &both->texts[which].count);
        view(both, which);
    }
    return VSH_OK;
}

/* Channels that one has and the other has not. */
static vsh_result compare_names(const vshi_compare_work *work, const images *both, vsh_error *error) {
    for (int which = 0; which < 2; ++which) {
        const vsh_image *image = &both->image[which];
        for (int32_t i = 0; i < image->channel_count; ++i) {
            if (find_channel(&both->image[1 - which], image->names[i]) < 0) {
                VSHI_TRY(vshi_compare_problem(work, error, "channel '%s': in %s alone", image->names[i],
                                              which == 0 ? "golden" : "the new image"));
            }
        }
    }
    return VSH_OK;
}

static const float *plane_of(const vsh_image *image, const char *name) {
    const int32_t i = find_channel(image, name);
    return i >= 0 ? image->planes[i] : NULL;
}

/* Coverage is a channel of its own among the results, where one of the two has it. */
static vsh_result compare_coverage(const vshi_compare_work *work, images *both, vsh_error *error) {
    const vsh_image *golden = &both->image[0];
    const char *name = work->options.coverage;
    const size_t count = (size_t)golden->width * (size_t)golden->height;
    void *mask;
    VSHI_TRY(vshi_allocate(&mask, count, 1, work->path[0], error));
    both->mask = mask;
    const float *was = plane_of(golden, name), *is = plane_of(&both->image[1], name);
    vsh_coverage coverage;
    vsh_compare_coverage(count, was, is, both->mask, &coverage);
    if (work->options.padding) {
        memset(both->mask, 1, count);
    }
    if (was == NULL && is == NULL) {
        return VSH_OK;
    }
    vsh_channel_comparison *channel;
    VSHI_TRY(vshi_compare_channel(work, name, both->texts, &channel, error));
    memcpy(channel->size, (const int32_t[]){golden->width, golden->height, 1}, sizeof channel->size);
    channel->is_coverage = 1;
    channel->coverage = coverage;
    channel->coverage_failed = coverage.share > channel->coverage_limit;
    return VSH_OK;
}

static vsh_result compare_channels(const vshi_compare_work *work, const images *both, vsh_error *error) {
    const vsh_image *golden = &both->image[0];
    for (int32_t i = 0; i < golden->channel_count; ++i) {
        const char *name = golden->names[i];
        const float *values = plane_of(&both->image[1], name);
        if (values == NULL || strcmp(name, work->options.coverage) == 0) {
            continue;
        }
        vsh_channel_comparison *channel;
        VSHI_TRY(vshi_compare_channel(work, name, both->texts, &channel, error));
        const vsh_compared compared = {
            {golden->width, golden->height, 1}, golden->planes[i], values, both->mask};
        memcpy(channel->size, compared.size, sizeof channel->size);
        VSHI_TRY(vshi_compare_measure(work, channel, &compared, error));
    }
    return VSH_OK;
}

static vsh_result compare(vshi_compare_work *work, images *both, vsh_error *error) {
    VSHI_TRY(read_both(work, both, error));
    VSHI_TRY(compare_names(work, both, error));
    const vsh_image *golden = &both->image[0], *fresh = &both->image[1];
    if (golden->width != fresh->width || golden->height != fresh->height) {
        return vshi_compare_problem(work, error, "size: golden is %d × %d, new is %d × %d", golden->width,
                                    golden->height, fresh->width, fresh->height);
    }
    VSHI_TRY(compare_coverage(work, both, error));
    return compare_channels(work, both, error);
}

vsh_result vshi_compare_images(vshi_compare_work *work, vsh_error *error) {
    images both = {.mask = NULL};
    const vsh_result result = compare(work, &both, error);
    free(both.mask);
    vsh_image_free(both.file[0]);
    vsh_image_free(both.file[1]);
    return result;
}
