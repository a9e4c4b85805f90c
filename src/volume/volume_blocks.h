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
    const vsh_occluders *occluders; /* NULL: parts are put together */
    vshi_solid solid;               /* of these */
    double caster_voxel_size;       /* of their field */
    bool has_triangles;
    double held; /* bytes of theirs */
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

/* Checks what there is to bake, and takes it; `options` and `run` may be NULL. Errors: VSH_ERROR_ARGUMENT. */
vsh_result vshi_volume_set_up(vshi_volume_bake *bake, const vsh_occluders *occluders,
                              const vsh_voxels *voxels, const vsh_light *lights, size_t light_count,
                              const vsh_volume_options *options, const vsh_run *run, vsh_run *full,
                              vsh_error *error);

/* Describes the volume's grids: channels[channel_count]. */
void vshi_volume_describe(const vshi_volume_bake *bake, const vsh_light *lights, vshi_channel *channels);

/* Begins the volume and its filling. Errors: as vshi_volume_begin(). End it with vshi_fill_end(), and free
 * the volume, also then. */
vsh_result vshi_volume_open(vshi_volume_bake *bake, const vsh_light *lights, const vsh_run *run,
                            vsh_error *error);

/* Shades blocks begin … end - 1, begin a multiple of VSHI_VOLUME_GRAIN. `total` units of the job are theirs.
 * Errors: VSH_ERROR_ARGUMENT as vsh_query_create(), VSH_ERROR_MEMORY, VSH_ERROR_CANCELLED. */
vsh_result vshi_volume_shade(vshi_volume_bake *bake, const vsh_light *lights, size_t begin, size_t end,
                             vshi_job *job, size_t units, vsh_error *error);

/* The same by `fn` over 0 … count - 1, which calls vshi_volume_shade_blocks(). */
vsh_result vshi_volume_shade_by(vshi_volume_bake *bake, const vsh_light *lights, size_t count, size_t grain,
                                vshi_range_fn *fn, void *user, vshi_job *job, size_t units, vsh_error *error);

/* Fills and settles all blocks, and closes the volume. */
vsh_result vshi_volume_finish(vshi_volume_bake *bake, vshi_job *job, size_t units, vsh_error *error);

/* A vshi_range_fn of a vshi_volume_bake: shades blocks begin … end - 1, at most VSHI_VOLUME_GRAIN. */
void vshi_volume_shade_blocks(void *bake, size_t begin, size_t end);

#endif
