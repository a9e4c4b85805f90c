/* Heights read from an image. */
#ifndef VSHI_HEIGHTMAP_H
#define VSHI_HEIGHTMAP_H

#include "base/error.h"

typedef struct vshi_heightmap {
    int32_t columns, rows;
    float *values; /* [rows][columns]; free() */
} vshi_heightmap;

/* Integers become 0 … 1, floats stay as they are; of an image with R, G and B their luminance (ITU-R BT.709),
 * of every other the first channel. Errors: as vsh_image_read(); VSH_ERROR_INPUT for an image that is less
 * than 2 or more than VSH_MAX_HEIGHTS_SIDE pixels along a side; VSH_ERROR_LIMIT (run->memory_limit),
 * VSH_ERROR_MEMORY. */
vsh_result vshi_heightmap_read(const char *path, const vsh_run *run, vshi_heightmap *map, vsh_error *error);

#endif
