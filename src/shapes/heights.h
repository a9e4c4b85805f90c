/* Heightfields: models, images, and the march of casters without triangles. */
#pragma once

#include "base/error.h"
#include "base/vec.h"

#include <stdbool.h>
#include <vdbshade/light.h>
#include <vdbshade/mesh.h>

/* A heightfield for the march of the shadow methods hard and classic (vshi_layer.heights).
 * Immutable; may be shared by threads. */
typedef struct vshi_heights vshi_heights;

/* Copies the heights. Free the result with vshi_heights_free(). Errors:
 * - VSH_ERROR_ARGUMENT: source, values or heights NULL, sizes out of range. A transform that is not
 *   finite, shears, scales unevenly or flattens;
 * - VSH_ERROR_INPUT: a value that is not finite, or not once scaled: the message gives its row and column;
 * - VSH_ERROR_LIMIT: run->memory_limit (4 bytes a sample);
 * - VSH_ERROR_MEMORY. */
vsh_result vshi_heights_create(const vsh_heights_source *source, const vsh_run *run, vshi_heights **heights,
                               vsh_error *error);
void vshi_heights_free(vshi_heights *heights); /* NULL does nothing */

typedef struct vshi_heights_info {
    double bounds_min[3]; /* world box of the solid */
    double bounds_max[3];
    uint64_t bytes; /* in memory */
} vshi_heights_info;

void vshi_heights_get_info(const vshi_heights *heights, vshi_heights_info *info);

/* Marches from points begin … end - 1 to a checked light, and writes its visible share to visibility[end -
 * begin]: 0 or 1 for VSH_SHADOW_HARD, the value of VSH_SHADOW_CLASSIC for any other method. Points first move
 * `offset` world units along their normals. Points in the solid are dark, invalid points NaN. Thread safe. */
void vshi_heights_shadow(const vshi_heights *heights, const vsh_light *light, int32_t method,
                         const vsh_points *points, size_t begin, size_t end, double offset, float *visibility,
                         vsh_shade_stats *stats);

/* World units of a layer's start offset, which is in cells; -1 stands for 0. */
double vshi_heights_offset(const vshi_heights *heights, double start_offset);

/* Whether a world position is within the solid, deeper than receivers may be off. */
bool vshi_heights_hold(const vshi_heights *heights, const double position[3]);

/* vsh_model_from_heights() for a lightmap with `texels` columns and rows of samples, or NULL. A surface
 * leaves out the rows and columns of heights that are next to no sample. A coarse lightmap then takes less
 * memory, with the same values. */
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
