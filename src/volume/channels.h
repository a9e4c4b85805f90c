/* What the grids of a volume are called, and what their metadata say. */
#ifndef VSHI_BAKE_CHANNELS_H
#define VSHI_BAKE_CHANNELS_H

#include "levelset/volume.h"

#include <stdbool.h>
#include <vdbshade/volume.h>

typedef struct vshi_channels {
    const vsh_light *lights;
    size_t light_count;
    const vsh_volume_options *options;
    bool shadow_error, ao_error;
    double caster_voxel_size;
    bool has_triangles; /* of the casters */
} vshi_channels;

/* Fills a channel for each grid, in the order of vsh_volume. */
void vshi_channels_describe(const vshi_channels *what, vshi_channel *channels);

#endif
