/* Images: their channels by name, over the texels that both cover. */
#include "cli/message.h"
#include "comparison_parts.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

typedef struct images {
    vsh_image_file *file[2]; /* golden, new */
    vsh_image image[2];
    compare_texts texts[2];
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
    *image = (vsh_image){all.width, all.height, 0, both->names[which], both->planes[which]};
    for (int32_t c = 0; c < all.channel_count; ++c) {
        const char *name = all.names[c];
        if (!picture || (strcmp(name, "R") != 0 && strcmp(name, "G") != 0 && strcmp(name, "B") != 0)) {
            both->names[which][image->channel_count] = name;
            both->planes[which][image->channel_count++] = all.planes[c];
        }
    }
}

static int read_both(compare_work *work, images *both) {
    const char *const paths[2] = {work->comparison->golden, work->comparison->fresh};
    for (int which = 0; which < 2; ++which) {
        vsh_error error;
        if (vsh_image_read(paths[which], &work->run, &both->file[which], &error) != VSH_OK) {
            return cli_fail(&error);
        }
        const vsh_image all = vsh_image_view(both->file[which]);
        work->run.memory_held +=
            sizeof(float) * (uint64_t)all.width * (uint64_t)all.height * (uint64_t)all.channel_count;
        both->texts[which].list = vsh_image_attributes(both->file[which], &both->texts[which].count);
        view(both, which);
    }
    return CLI_OK;
}

/* Channels that one has and the other has not. */
static int compare_names(const compare_work *work, const images *both) {
    cli_comparison *c = work->comparison;
    for (int which = 0; which < 2; ++which) {
        const vsh_image *image = &both->image[which];
        for (int32_t i = 0; i < image->channel_count; ++i) {
            if (find_channel(&both->image[1 - which], image->names[i]) < 0 &&
                !cli_comparison_add_problem(c, "channel '%s': in %s alone", image->names[i],
                                            which == 0 ? "golden" : "the new image")) {
                return cli_out_of_memory(c->golden);
            }
        }
    }
    return CLI_OK;
}

static const float *plane_of(const vsh_image *image, const char *name) {
    const int32_t i = find_channel(image, name);
    return i >= 0 ? image->planes[i] : NULL;
}

/* Coverage is a channel of its own among the results, where one of the two has it. */
static int compare_coverage(const compare_work *work, images *both) {
    const vsh_image *golden = &both->image[0], *fresh = &both->image[1];
    const char *name = work->settings->coverage;
    const size_t count = (size_t)golden->width * (size_t)golden->height;
    both->mask = malloc(count);
    if (both->mask == NULL) {
        return cli_out_of_memory(work->comparison->golden);
    }
    const float *was = plane_of(golden, name), *is = plane_of(fresh, name);
    vsh_coverage coverage;
    vsh_compare_coverage(count, was, is, both->mask, &coverage);
    if (work->settings->padding) {
        memset(both->mask, 1, count);
    }
    if (was == NULL && is == NULL) {
        return CLI_OK;
    }
    cli_channel *channel = cli_comparison_add(work->comparison, name);
    if (channel == NULL) {
        return cli_out_of_memory(work->comparison->golden);
    }
    cli_channel_set_limits(work, both->texts, channel);
    memcpy(channel->size, (const int32_t[]){golden->width, golden->height, 1}, sizeof channel->size);
    channel->is_coverage = true;
    channel->coverage = coverage;
    channel->coverage_failed = coverage.share > channel->coverage_limit;
    return CLI_OK;
}

static int compare_channels(const compare_work *work, const images *both) {
    const vsh_image *golden = &both->image[0], *fresh = &both->image[1];
    int code = CLI_OK;
    for (int32_t i = 0; i < golden->channel_count && code == CLI_OK; ++i) {
        const char *name = golden->names[i];
        const float *values = plane_of(fresh, name);
        if (values == NULL || strcmp(name, work->settings->coverage) == 0) {
            continue;
        }
        cli_channel *channel = cli_comparison_add(work->comparison, name);
        if (channel == NULL) {
            return cli_out_of_memory(work->comparison->golden);
        }
        cli_channel_set_limits(work, both->texts, channel);
        const vsh_compared compared = {
            {golden->width, golden->height, 1}, golden->planes[i], values, both->mask};
        memcpy(channel->size, compared.size, sizeof channel->size);
        code = cli_channel_measure(work, channel, &compared);
    }
    return code;
}

int compare_images(compare_work *work) {
    cli_comparison *c = work->comparison;
    images both = {.mask = NULL};
    int code = read_both(work, &both);
    const vsh_image *golden = &both.image[0], *fresh = &both.image[1];
    code = code == CLI_OK ? compare_names(work, &both) : code;
    if (code == CLI_OK && (golden->width != fresh->width || golden->height != fresh->height)) {
        if (!cli_comparison_add_problem(c, "size: golden is %d × %d, new is %d × %d", golden->width,
                                        golden->height, fresh->width, fresh->height)) {
            code = cli_out_of_memory(c->golden);
        }
    } else if (code == CLI_OK) {
        code = compare_coverage(work, &both);
        code = code == CLI_OK ? compare_channels(work, &both) : code;
    }
    free(both.mask);
    vsh_image_free(both.file[0]);
    vsh_image_free(both.file[1]);
    return code;
}
