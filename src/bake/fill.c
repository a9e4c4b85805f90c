#include "bake/fill.h"

#include "base/memory.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* By how much a distance between voxels' corners may be too large, voxels of the finest level. */
static const double DISTANCE_ERROR = 0.87;

static int compare_steps(const void *left, const void *right) {
    const vshi_fill_step *a = left, *b = right;
    if (a->square != b->square) {
        return a->square < b->square ? -1 : 1;
    }
    for (int axis = 0; axis < 3; ++axis) { /* of equal ones always the same is taken */
        if (a->by[axis] != b->by[axis]) {
            return a->by[axis] < b->by[axis] ? -1 : 1;
        }
    }
    return 0;
}

static void list_steps(vshi_fill_step *steps) {
    enum { REACH = VSHI_FILL_REACH };
    size_t count = 0;
    for (int x = -REACH; x <= REACH; ++x) {
        for (int y = -REACH; y <= REACH; ++y) {
            for (int z = -REACH; z <= REACH; ++z) {
                const int square = x * x + y * y + z * z;
                if (square > 0 && square <= REACH * REACH) {
                    steps[count++] = (vshi_fill_step){{(int8_t)x, (int8_t)y, (int8_t)z}, (uint8_t)square};
                }
            }
        }
    }
    qsort(steps, count, sizeof *steps, compare_steps);
}

vsh_result vshi_fill_begin(vshi_fill *fill, const vshi_solid *solid, const vsh_voxels *voxels,
                           vsh_volume *volume, size_t channel_count, bool fills, vsh_error *error) {
    *fill = (vshi_fill){.solid = solid,
                        .voxels = voxels,
                        .volume = volume,
                        .channel_count = channel_count,
                        .fills = fills,
                        .longest = vshi_voxels_longest_axis(voxels)};
    fill->blocks = vshi_voxels_blocks(voxels, &fill->block_count);
    list_steps(fill->steps);
    for (int square = 0, s = 0; square <= VSHI_FILL_REACH * VSHI_FILL_REACH; ++square) {
        while (s < VSHI_FILL_STEPS && fill->steps[s].square < square) {
            ++s;
        }
        fill->first_step[square] = s;
    }
    fill->distance_error = DISTANCE_ERROR * solid->voxel_size;
    VSHI_TRY(vshi_allocate((void **)&fill->shaded, fill->block_count, sizeof *fill->shaded, "volume", error));
    return vshi_allocate((void **)&fill->filled, fill->block_count, sizeof *fill->filled, "volume", error);
}

void vshi_fill_end(vshi_fill *fill) {
    free(fill->filled);
    free(fill->shaded);
    fill->filled = fill->shaded = NULL;
}

static inline bool is_set(const uint64_t mask[VSHI_MASK_WORDS], int voxel) {
    return mask[voxel >> 6] >> (voxel & 63) & 1;
}

/* The blocks around one, themselves in the middle: numbers, or SIZE_MAX. */
static void find_around(const vshi_fill *fill, size_t block, size_t around[27]) {
    const int32_t *origin = fill->blocks[block].origin;
    for (int i = 0; i < 27; ++i) {
        const int32_t at[3] = {origin[0] + 8 * (i / 9 - 1), origin[1] + 8 * (i / 3 % 3 - 1),
                               origin[2] + 8 * (i % 3 - 1)};
        around[i] = vshi_voxels_find(fill->voxels, at);
    }
}

/* Voxels in reach of a block's voxel, whose distance's square is `least` at least: the block and number of
 * the nearest that was shaded. */
static bool find_nearest(const vshi_fill *fill, const size_t around[27], int voxel, int least, size_t *block,
                         int *nearest) {
    const int at[3] = {8 + (voxel >> 6), 8 + (voxel >> 3 & 7), 8 + (voxel & 7)};
    for (int s = fill->first_step[least]; s < VSHI_FILL_STEPS; ++s) {
        const vshi_fill_step *step = &fill->steps[s];
        const int x = at[0] + step->by[0], y = at[1] + step->by[1], z = at[2] + step->by[2];
        *block = around[9 * (x >> 3) + 3 * (y >> 3) + (z >> 3)];
        *nearest = 64 * (x & 7) + 8 * (y & 7) + (z & 7);
        if (*block != SIZE_MAX && is_set(fill->shaded[*block], *nearest)) {
            return true;
        }
    }
    return false;
}

/* The voxels of a block that were not shaded. */
static size_t list_open(const vshi_fill *fill, size_t block, uint16_t voxel[VSHI_BLOCK_VOXELS + 1]) {
    const uint64_t *mask = fill->blocks[block].mask, *shaded = fill->shaded[block];
    size_t count = 0;
    for (int v = 0; v < VSHI_BLOCK_VOXELS; ++v) {
        voxel[count] = (uint16_t)v;
        count += is_set(mask, v) && !is_set(shaded, v);
    }
    return count;
}

enum { NO_REACH = 255 };

/* Finds for each of these voxels the least square of its distance to a shaded voxel, in voxels. The solid's
 * distance bounds it; NO_REACH means that no shaded voxel is close enough. */
static void find_reaches(const vshi_fill *fill, size_t block, const uint16_t *voxel, size_t count,
                         uint8_t *reaches) {
    double centre[VSHI_BLOCK_VOXELS][3];
    float distance[VSHI_BLOCK_VOXELS];
    vshi_voxels_centres(fill->voxels, block, count, voxel, centre);
    vshi_solid_sample(fill->solid, count, &centre[0][0], distance);
    for (size_t i = 0; i < count; ++i) {
        const double inside = -(double)distance[i] - fill->distance_error;
        const double least = inside > 0.0 ? inside / fill->longest : 0.0; /* 0 where nothing is known */
        reaches[i] = least <= VSHI_FILL_REACH ? (uint8_t)ceil(least * least) : NO_REACH;
    }
}

static bool copy_value(const vshi_fill *fill, size_t block, int voxel, size_t from, int nearest) {
    for (size_t c = 0; c < fill->channel_count; ++c) {
        float *values = vshi_volume_values(fill->volume, c, block);
        if (values == NULL) {
            return false;
        }
        values[voxel] = vshi_volume_value(fill->volume, c, from, nearest);
    }
    return true;
}

static uint64_t count_bits(const uint64_t mask[VSHI_MASK_WORDS]) {
    uint64_t count = 0;
    for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
        count += (uint64_t)__builtin_popcountll(mask[i]);
    }
    return count;
}

bool vshi_fill_block(vshi_fill *fill, size_t block) {
    const uint64_t *mask = fill->blocks[block].mask, *shaded = fill->shaded[block];
    const uint64_t all = count_bits(mask), own = count_bits(shaded);
    atomic_fetch_add(&fill->shaded_count, own);
    if (!fill->fills || own == all) {
        atomic_fetch_add(&fill->off_count, all - own);
        return true;
    }
    size_t around[27];
    find_around(fill, block, around);
    uint16_t open[VSHI_BLOCK_VOXELS + 1];
    uint8_t reaches[VSHI_BLOCK_VOXELS];
    const size_t count = list_open(fill, block, open);
    find_reaches(fill, block, open, count, reaches);
    for (size_t i = 0; i < count; ++i) {
        const int voxel = open[i];
        size_t from;
        int nearest;
        if (reaches[i] <= VSHI_FILL_REACH * VSHI_FILL_REACH &&
            find_nearest(fill, around, voxel, reaches[i], &from, &nearest)) {
            if (!copy_value(fill, block, voxel, from, nearest)) {
                return false;
            }
            fill->filled[block][voxel >> 6] |= (uint64_t)1 << (voxel & 63);
        }
    }
    const uint64_t filled = count_bits(fill->filled[block]);
    atomic_fetch_add(&fill->filled_count, filled);
    atomic_fetch_add(&fill->off_count, all - own - filled);
    return true;
}

bool vshi_fill_active(const vshi_fill *fill, size_t block, uint64_t active[VSHI_MASK_WORDS]) {
    for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
        active[i] = fill->shaded[block][i] | fill->filled[block][i];
    }
    return memcmp(fill->shaded[block], fill->blocks[block].mask, sizeof fill->blocks[block].mask) != 0;
}

vsh_volume_info vshi_fill_counts(const vshi_fill *fill) {
    return (vsh_volume_info){
        .shaded = fill->shaded_count, .filled = fill->filled_count, .off = fill->off_count};
}
