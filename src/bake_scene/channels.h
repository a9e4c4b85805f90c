/* The channels of a scene's lightmaps: which there are, in which order, and the planes that a bake fills. */
#ifndef VSHI_CHANNELS_H
#define VSHI_CHANNELS_H

#include "bake/ao_kept.h"
#include "bake/padding.h"
#include "base/error.h"

#include <stdbool.h>
#include <vdbshade/image.h>
#include <vdbshade/scene.h>

typedef struct vshi_channels {
    vsh_image image;       /* their names and planes, in the order of bake/planes.c; A is the last */
    vsh_lightmap lightmap; /* the same memory, as the bake takes it */
    char (*names)[VSH_CHANNEL_NAME];
    const char **name_list;
    int32_t *holds;
    float **planes;    /* [image.channel_count][rows][width] */
    float **triples;   /* [triple_count][rows][width][3]: what is baked interleaved, and then split */
    float *invalid;    /* [rows][width] as the bake tells it (vsh_lightmap); NULL: not asked for */
    uint32_t *known;   /* [rows][width]: VSHI_PART_…, of a part; NULL: it is none */
    void *kept;        /* of a part that leaves AO, what is kept (bake/ao_kept.h); NULL: none is */
    size_t kept_bytes; /* of the rows that are there */
    size_t triple_count;
    int32_t rows; /* that there is memory for */
} vshi_channels;

/* Names the channels of a scene at a size, without memory for values: enough for vsh_image_check(). Errors:
 * VSH_ERROR_ARGUMENT (more than VSH_MAX_CHANNELS), VSH_ERROR_MEMORY. Free them also after a failure. */
vsh_result vshi_channels_name(const vsh_scene *scene, int32_t width, int32_t height, vshi_channels *channels,
                              vsh_error *error);

/* Takes the memory for the values of `rows` rows. `invalid`: where texels are invalid is wanted, whether or
 * not there is a channel of it. `output` is for messages. Errors: VSH_ERROR_LIMIT, VSH_ERROR_MEMORY. */
vsh_result vshi_channels_allocate(vshi_channels *channels, const vsh_scene *scene, int32_t rows, bool invalid,
                                  uint64_t limit, const char *output, vsh_error *error);

/* Which planes a scene's bake fills, and how: those that are not NULL, which are none to be written to. */
vsh_lightmap vshi_channels_shape(const vsh_scene *scene);

/* After the bake: what is interleaved, and what is invalid, into its planes. */
void vshi_channels_split(vshi_channels *channels, const vsh_scene *scene);

/* Before a bake goes on with what was split: back into what is interleaved. */
void vshi_channels_join(vshi_channels *channels, const vsh_scene *scene);

/* Those of `planes`, one a channel, that are padded, into padded[VSH_MAX_CHANNELS]; returns how many. */
size_t vshi_channels_padded(const vsh_scene *scene, float *const *planes, vshi_plane *padded);

void vshi_channels_free(vshi_channels *channels); /* zeroed ones too */

#endif
