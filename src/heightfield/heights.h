/* Heightfields: checked sources, heights of images, and the march of layers that cast as they are. */
#ifndef VSHI_HEIGHTS_H
#define VSHI_HEIGHTS_H

#include "base/error.h"
#include "base/vec.h"

#include <stdbool.h>
#include <vdbshade/heights.h>
#include <vdbshade/light.h>
#include <vdbshade/method.h>
#include <vdbshade/points.h>

/* --- the march (heights.c) */

/* Marches from points begin … end - 1 to a light that was checked before. Writes its visible share into
 * visibility[end - begin]: for VSH_SHADOW_HARD 0 or 1, for any other method that of VSH_SHADOW_CLASSIC.
 * Points are first moved `lift` world units along their normals. Points within the solid are dark, invalid
 * points NaN. Thread safe. */
void vshi_heights_shadow(const vsh_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double lift, float *visibility,
                         vsh_shade_stats *stats);

/* World units of a layer's start offset, which is in cells; -1 stands for 0. */
double vshi_heights_lift(const vsh_heights *heights, double start_offset);

/* Whether a world position is within the solid, deeper than receivers may be off. */
bool vshi_heights_hold(const vsh_heights *heights, const double position[3]);

/* --- models and images (heights_model.c) */

/* A source whose numbers are in range. */
typedef struct vshi_checked_heights {
    const vsh_heights_source *source;
    const char *name;
    size_t samples;
    double lowest, highest; /* local units */
    double bottom;
} vshi_checked_heights;

/* Checks sizes and values. Errors: VSH_ERROR_ARGUMENT, VSH_ERROR_INPUT. `call` names the public function. */
vsh_result vshi_heights_check(const vsh_heights_source *source, const char *call,
                              vshi_checked_heights *terrain, vsh_error *error);

/* Does what vsh_model_from_heights() does. `texels` are the columns and rows of a lightmap's samples, or
 * NULL. A surface then leaves out the rows and columns of heights that lie beside none of these samples. A
 * coarse lightmap takes less memory, and its values stay the same. */
vsh_result vshi_model_of_heights(const vsh_heights_source *source, int32_t what, const size_t *texels,
                                 const vsh_run *run, vsh_model **model, vsh_error *error);

typedef struct vshi_height_image {
    int32_t columns, rows;
    float *values; /* [rows][columns]; free() */
} vshi_height_image;

/* Reads heights: integers become 0 … 1, floats stay as they are. An image with R, G and B gives its luminance
 * (ITU-R BT.709), any other its first channel. Errors: as vsh_image_read(); VSH_ERROR_INPUT for an image that
 * is less than 2 or more than VSH_MAX_HEIGHTS_SIDE pixels along a side; VSH_ERROR_LIMIT (run->memory_limit),
 * VSH_ERROR_MEMORY. */
vsh_result vshi_height_image_read(const char *path, const vsh_run *run, vshi_height_image *map,
                                  vsh_error *error);

#endif
