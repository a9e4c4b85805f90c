/* Images of known values, for tests that write and read them. */
#pragma once

#include "folder.h"
#include "handles.h"

#include "base/file.h"
#include "io/image/image.h"
#include "testing.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

/* An image whose values differ from texel to texel: between 0 and 1, not symmetric in x, y or the channel. */
enum { MOST = 8 };

typedef struct sample {
    vsh_image image;
    const char *names[MOST];
    const float *planes[MOST];
    float *values;
} sample;

static inline void make(sample *s, int32_t width, int32_t height, int32_t count, const char *const *names) {
    const size_t texels = (size_t)width * (size_t)height;
    s->values = malloc(texels * (size_t)count * sizeof(float));
    assert_non_null(s->values);
    for (int32_t c = 0; c < count; ++c) {
        s->names[c] = names[c];
        s->planes[c] = s->values + (size_t)c * texels;
        for (size_t i = 0; i < texels; ++i) {
            const double x = (double)(i % (size_t)width) / width;
            const double y = (double)(i / (size_t)width) / height;
            s->values[(size_t)c * texels + i] = (float)(0.5 + 0.5 * sin(7.0 * x + 3.1 * y * (c + 1) + c));
        }
    }
    s->image = (vsh_image){width, height, count, s->names, s->planes, NULL};
}

static inline void unmake(sample *s) {
    free(s->values);
}

static const char *const LIGHTMAP[] = {"shadow.sun", "ao", "A"};

/* The plane of a channel; the test fails if the image has none of that name. */
static inline const float *plane_of(const vsh_image *image, const char *name) {
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], name) == 0) {
            return image->planes[c];
        }
    }
    fail_msg("no channel '%s'", name);
    return NULL;
}
