#include "heightfield/heights.h"

#include "base/memory.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>
#include <vdbshade/heights.h>
#include <vdbshade/image.h>

static const float *channel(const vsh_image *image, const char *name) {
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], name) == 0) {
            return image->planes[c];
        }
    }
    return NULL;
}

static void take_values(const vsh_image *image, size_t count, float *values) {
    const float *r = channel(image, "R"), *g = channel(image, "G"), *b = channel(image, "B");
    if (r == NULL || g == NULL || b == NULL) {
        memcpy(values, image->planes[0], count * sizeof *values);
        return;
    }
    for (size_t i = 0; i < count; ++i) {
        /* in this form grey stays what it is, to the bit */
        values[i] = g[i] + 0.2126f * (r[i] - g[i]) + 0.0722f * (b[i] - g[i]);
    }
}

vsh_result vshi_height_image_read(const char *path, const vsh_run *run, vshi_height_image *map,
                                  vsh_error *error) {
    *map = (vshi_height_image){0, 0, NULL};
    vsh_image_file *file = NULL;
    VSHI_TRY(vsh_image_read(path, run, &file, error));
    const vsh_image image = vsh_image_view(file);
    const size_t count = (size_t)image.width * (size_t)image.height;
    void *values = NULL;
    vsh_result result;
    if (image.width < 2 || image.height < 2 || image.width > VSH_MAX_HEIGHTS_SIDE ||
        image.height > VSH_MAX_HEIGHTS_SIDE) {
        result = vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: %d × %d pixels are no heightfield: expected 2 … %d along each side", path,
                           image.width, image.height, VSH_MAX_HEIGHTS_SIDE);
        goto done;
    }
    VSHI_TRY_DONE(vshi_check_limit(run, (double)count * 4.0 * (1.0 + image.channel_count), path, error));
    VSHI_TRY_DONE(vshi_allocate(&values, count, sizeof(float), path, error));
    take_values(&image, count, values);
    *map = (vshi_height_image){image.width, image.height, values};
done:
    vsh_image_free(file);
    return result;
}
