/* The voxels of a volume, shaded in blocks of 8³. */
#ifndef VSHI_BAKE_VOLUME_BLOCKS_H
#define VSHI_BAKE_VOLUME_BLOCKS_H

#include "bake/fill.h"
#include "base/parallel.h"
#include "shade/query.h"
#include "shade/shade.h"

#include <pthread.h>
#include <vdbshade/volume.h>

enum { VSHI_VOLUME_GRAIN = 16 }; /* blocks of a piece of work: as many as march together */

typedef struct vshi_volume_bake {
    const vsh_occluders *occluders;
    vshi_solid solid;         /* of these */
    double caster_voxel_size; /* of their field */
    double held;              /* bytes of theirs */
    const vsh_voxels *voxels;
    const vshi_block *blocks;
    size_t block_count;
    size_t light_count;
    vsh_volume_options options;
    bool normals;           /* the band of a surface */
    double half_axis[3][3]; /* of its voxels, world units */
    bool shadow_error, ao_error;
    size_t channel_count;
    vsh_query *query;
    vsh_run one; /* a piece's: the calling thread, without progress */
    vsh_volume *volume;
    vshi_fill fill;
    atomic_bool out_of_memory;
    pthread_mutex_t lock; /* of what follows */
    vsh_shade_stats stats;
} vshi_volume_bake;

/* A vshi_range_fn of a vshi_volume_bake: shades blocks begin … end - 1, at most VSHI_VOLUME_GRAIN. */
void vshi_volume_shade_blocks(void *bake, size_t begin, size_t end);

#endif
