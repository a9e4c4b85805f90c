/* The channels of a scene's lightmaps: which there are, in which order, and the planes that a bake fills. */
#ifndef VSHI_CHANNELS_H
#define VSHI_CHANNELS_H

#include "base/error.h"
#include "base/store.h"

#include <vdbshade/image.h>
#include <vdbshade/scene.h>

typedef struct vshi_channels {
    vsh_image image;       /* their names, in the order of bake/planes.c; A is the last. No planes */
    vsh_lightmap lightmap; /* the values, as the bake takes them */
    char (*names)[VSH_CHANNEL_NAME];
    const char **name_list;
    int32_t *holds;
    float **values;     /* [value_count][height][width][components]: of the store */
    size_t *components; /* [value_count]: 1 or 3 channels each */
    size_t value_count;
    vshi_store *store; /* NULL: there is no memory for values */
} vshi_channels;

/* Names the channels of a scene at a size, without memory for values: enough for vsh_image_check(). Errors:
 * VSH_ERROR_ARGUMENT (more than VSH_MAX_CHANNELS), VSH_ERROR_MEMORY. Free them also after a failure. */
vsh_result vshi_channels_name(const vsh_scene *scene, int32_t width, int32_t height, vshi_channels *channels,
                              vsh_error *error);

/* Takes the memory for the values, zeroed. `output` is for messages. Errors: as vshi_store_take(). */
vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, vshi_store *store,
                                  const char *output, vsh_error *error);

/* Which planes a scene's bake fills, and how: those that are not NULL, which are none to be written to. */
vsh_lightmap vshi_channels_shape(const vsh_scene *scene);

/* Memory that vshi_channels_rows() takes for so many rows, to be freed. Errors: VSH_ERROR_MEMORY. */
vsh_result vshi_channels_allocate_rows(const vshi_channels *channels, int32_t rows, float **memory,
                                       vsh_error *error);

/* Rows of all channels, planes[image.channel_count][rows][width]. */
void vshi_channels_rows(const vshi_channels *channels, int32_t first, int32_t rows, float *memory,
                        const float **planes);

void vshi_channels_free(vshi_channels *channels); /* zeroed ones too */

#endif
