/* Heights read from an image. */
#ifndef VSHI_HEIGHTFIELD_HEIGHT_IMAGE_H
#define VSHI_HEIGHTFIELD_HEIGHT_IMAGE_H

#include "base/error.h"

typedef struct vshi_height_image {
    int32_t columns, rows;
    float *values; /* [rows][columns]; free() */
} vshi_height_image;

/* Integers become 0 … 1, floats stay as they are; of an image with R, G and B their luminance (ITU-R BT.709),
 * of every other the first channel. Errors: as vsh_image_read(); VSH_ERROR_INPUT for an image that is less
 * than 2 or more than VSH_MAX_HEIGHTS_SIDE pixels along a side; VSH_ERROR_LIMIT (run->memory_limit),
 * VSH_ERROR_MEMORY. */
vsh_result vshi_height_image_read(const char *path, const vsh_run *run, vshi_height_image *map,
                                  vsh_error *error);

#endif
