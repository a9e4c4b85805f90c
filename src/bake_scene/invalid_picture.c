#include "bake_scene/pages.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Colours of texels outside charts, of valid and of invalid texels. */
static const float COLOURS[3][3] = {{0.05f, 0.05f, 0.06f}, {0.5f, 0.5f, 0.5f}, {0.7f, 0.05f, 0.05f}};
static const char *const NAMES[3] = {"R", "G", "B"};

/* --- names */

/* "floor" of "out/floor.exr". */
typedef struct stem {
    const char *at;
    size_t size;
} stem;

static stem stem_of(const char *output) {
    const char *slash = strrchr(output, '/');
    const char *name = slash != NULL ? slash + 1 : output, *dot = strrchr(name, '.');
    return (stem){name, dot != NULL ? (size_t)(dot - name) : strlen(name)};
}

/* Names that differ in case only are one file to some systems. */
static bool are_alike(stem a, stem b) {
    return a.size == b.size && strncasecmp(a.at, b.at, a.size) == 0;
}

static bool is_taken(char *const *outputs, size_t count, const char *name) {
    for (size_t i = 0; i < count; ++i) {
        if (are_alike(stem_of(outputs[i]), (stem){name, strlen(name)})) {
            return true;
        }
    }
    return false;
}

/* "where.floor.png" for the first "floor", "where.floor-2.png" for the second; numbers that another output
 * has by itself are left out. */
static char *name_for(const char *path, char *const *outputs, size_t count, size_t index) {
    const stem own = stem_of(outputs[index]);
    const int before = (int)(strlen(path) - strlen(".png"));
    const size_t size = strlen(path) + own.size + 32;
    char *made = malloc(size), *name = malloc(own.size + 32);
    size_t alike = 0, number = 1;
    for (size_t i = 0; i < index; ++i) {
        alike += are_alike(stem_of(outputs[i]), own);
    }
    if (made != NULL && name != NULL) {
        snprintf(name, own.size + 32, "%.*s", (int)own.size, own.at);
        while (alike > 0) {
            snprintf(name, own.size + 32, "%.*s-%zu", (int)own.size, own.at, ++number);
            alike -= !is_taken(outputs, count, name);
        }
        snprintf(made, size, "%.*s.%s.png", before, path, name);
    } else {
        free(made);
        made = NULL;
    }
    free(name);
    return made;
}

/* Images have names of their own, pages of an asset do not. */
static char *output_of(const vshi_scene_bake *bake, const vshi_target *target) {
    const char *output = target->receiver.output;
    return vsh_lit_is_output(output)
               ? vshi_target_file(target, vsh_assets_receiver_pages(bake->assets, target->index), output)
               : strdup(output != NULL ? output : "");
}

static char *picture_name(const vshi_scene_bake *bake, size_t index) {
    const char *path = bake->options.invalid_picture;
    const size_t count = bake->targets.count;
    if (count == 1) {
        return strdup(path);
    }
    char **outputs = calloc(count, sizeof *outputs), *made = NULL;
    bool all = outputs != NULL;
    for (size_t i = 0; i < count && all; ++i) {
        outputs[i] = output_of(bake, &bake->targets.list[i]);
        all = outputs[i] != NULL;
    }
    if (all) {
        made = name_for(path, outputs, count, index);
    }
    for (size_t i = 0; i < count && outputs != NULL; ++i) {
        free(outputs[i]);
    }
    free(outputs);
    return made;
}

/* --- rows */

vsh_result vshi_invalid_picture_open(vshi_invalid_picture *picture, const vshi_scene_bake *bake, size_t index,
                                     int32_t rows, vsh_error *error) {
    const char *path = bake->options.invalid_picture;
    const vsh_receiver *receiver = &bake->targets.list[index].receiver;
    const int32_t width = receiver->width, height = receiver->height;
    memset(picture, 0, sizeof *picture);
    if (path == NULL) {
        return VSH_OK;
    }
    picture->path = picture_name(bake, index);
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

vsh_result vshi_invalid_picture_add(vshi_invalid_picture *picture, int32_t rows, const uint8_t *state,
                                    vsh_error *error) {
    if (picture->writer == NULL) {
        return VSH_OK;
    }
    const size_t texels = (size_t)picture->image.width * (size_t)rows;
    for (size_t i = 0; i < texels; ++i) {
        const int kind = state[i] == VSHI_TEXEL_EMPTY ? 0 : state[i] == VSHI_TEXEL_VALID ? 1 : 2;
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
