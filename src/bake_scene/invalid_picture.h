/* A picture of a lightmap's charts, and of the texels of them that are not valid. */
#ifndef VSHI_INVALID_PICTURE_H
#define VSHI_INVALID_PICTURE_H

#include "bake/padding.h"
#include "bake_scene/bake_scene.h"
#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/image.h>

typedef struct vshi_invalid_picture {
    char *path; /* NULL: none is asked for */
    vsh_image image;
    float *planes[3]; /* R, G, B of as many rows as are baked at a time */
    vsh_image_writer *writer;
} vshi_invalid_picture;

/* Opens the picture of lightmap `index`, of which `rows` come at a time: FILE.png, or where there are several
 * FILE.OUTPUT.png, no two of which are alike. Does nothing where none is asked for. Errors: as
 * vsh_image_writer_create(). Close it also after a failure. */
vsh_result vshi_invalid_picture_open(vshi_invalid_picture *picture, const vshi_scene_bake *bake, size_t index,
                                     int32_t rows, vsh_error *error);

/* Adds rows of texels, each VSHI_TEXEL_…. */
vsh_result vshi_invalid_picture_add(vshi_invalid_picture *picture, int32_t rows, const uint8_t *state,
                                    vsh_error *error);

/* Completes the file where `result` is VSH_OK, else leaves what was there. Returns `result`, or why not. */
vsh_result vshi_invalid_picture_close(vshi_invalid_picture *picture, vsh_result result, vsh_error *error);

#endif
