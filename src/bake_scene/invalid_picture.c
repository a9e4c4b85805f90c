#include "bake_scene/invalid_picture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of no chart, valid, invalid, and invalid in plain sight. */
static const float COLOURS[4][3] = {
    {0.05f, 0.05f, 0.06f}, {0.5f, 0.5f, 0.5f}, {0.7f, 0.05f, 0.05f}, {1.0f, 0.85f, 0.1f}};
static const char *const NAMES[3] = {"R", "G", "B"};

/* "where.png" for "out/floor.exr", one of several: "where.floor.png". */
static char *name_for(const char *path, const char *output, bool several) {
    const char *slash = strrchr(output, '/');
    const char *name = slash != NULL ? slash + 1 : output, *dot = strrchr(name, '.');
    const int length = dot != NULL ? (int)(dot - name) : (int)strlen(name);
    const int stem = (int)(strlen(path) - strlen(".png"));
    const size_t size = strlen(path) + (size_t)length + 2;
    char *made = malloc(size);
    if (made != NULL && several) {
        snprintf(made, size, "%.*s.%.*s.png", stem, path, length, name);
    } else if (made != NULL) {
        snprintf(made, size, "%s", path);
    }
    return made;
}

vsh_result vshi_invalid_picture_open(vshi_invalid_picture *picture, const char *path, const char *output,
                                     bool several, int32_t width, int32_t height, int32_t rows,
                                     vsh_error *error) {
    memset(picture, 0, sizeof *picture);
    if (path == NULL) {
        return VSH_OK;
    }
    picture->path = name_for(path, output, several);
    for (int c = 0; c < 3; ++c) {
        picture->planes[c] = calloc((size_t)width * (size_t)rows, sizeof(float));
        if (picture->planes[c] == NULL || picture->path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
        }
    }
    picture->image = (vsh_image){
        width, height, 3, (const char *const *)NAMES, (const float *const *)picture->planes, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.bits = 8;
    return vsh_image_writer_create(picture->path, &picture->image, &options, &picture->writer, error);
}

vsh_result vshi_invalid_picture_add(vshi_invalid_picture *picture, int32_t rows, const float *invalid,
                                    const float *coverage, vsh_error *error) {
    if (picture->writer == NULL) {
        return VSH_OK;
    }
    const size_t texels = (size_t)picture->image.width * (size_t)rows;
    for (size_t i = 0; i < texels; ++i) {
        const int kind = invalid[i] > 1.0f ? 3 : invalid[i] > 0.0f ? 2 : coverage[i] > 0.0f ? 1 : 0;
        for (int c = 0; c < 3; ++c) {
            picture->planes[c][i] = COLOURS[kind][c];
        }
    }
    return vsh_image_writer_add(picture->writer, rows, picture->image.planes, error);
}

vsh_result vshi_invalid_picture_close(vshi_invalid_picture *picture, vsh_result result, vsh_error *error) {
    if (picture->writer != NULL && result != VSH_OK) {
        vsh_image_writer_abandon(picture->writer);
    } else if (picture->writer != NULL) {
        result = vsh_image_writer_finish(picture->writer, error);
    }
    for (int c = 0; c < 3; ++c) {
        free(picture->planes[c]);
    }
    free(picture->path);
    memset(picture, 0, sizeof *picture);
    return result;
}
