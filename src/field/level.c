/* Blocks of 8³ values to bricks of 9³. */
#include "field/level.h"

#include "base/memory.h"
#include "base/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void vshi_level_blocks_free(vshi_blocks *blocks) {
    free(blocks->values);
    free(blocks->signs);
    free(blocks->map);
    *blocks = (vshi_blocks){.map = NULL};
}

static vsh_result allocate_map(vshi_blocks *blocks, vshi_budget budget, vsh_error *error) {
    size_t count = 1;
    for (int axis = 0; axis < 3; ++axis) {
        if (blocks->size[axis] <= 0 || __builtin_mul_overflow(count, (size_t)blocks->size[axis], &count) ||
            count > INT32_MAX) {
            return vshi_fail(
                error, VSH_ERROR_LIMIT,
                "field: %d × %d × %d blocks of 8³ voxels pass the limit of 2^31; use larger voxels",
                blocks->size[0], blocks->size[1], blocks->size[2]);
        }
    }
    vsh_result result = vshi_check_limit(
        budget.run, budget.held + (double)count * (sizeof *blocks->map + sizeof *blocks->signs), "field",
        error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&blocks->map, count, sizeof(int32_t), "field blocks", error);
    }
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&blocks->signs, count, sizeof(int8_t), "field signs", error);
    }
    return result;
}

static size_t block_at(const vshi_blocks *blocks, int32_t x, int32_t y, int32_t z) {
    return ((size_t)x * (size_t)blocks->size[1] + (size_t)y) * (size_t)blocks->size[2] + (size_t)z;
}

static float clamp(float value, float band) {
    return value > band ? band : value < -band ? -band : value;
}

vsh_result vshi_level_blocks_read(const vsh_grid *grid, float band, vshi_budget budget, vshi_blocks *blocks,
                                  vsh_error *error) {
    vshi_leaf *leaves = NULL;
    *blocks = (vshi_blocks){.scale = 1.0f, .band = band};
    blocks->count = vshi_grid_leaves(grid, NULL, 0);
    budget.held += (double)blocks->count * (double)(sizeof *leaves + 512 * sizeof(float));
    vsh_result result = vshi_check_limit(budget.run, budget.held, "field", error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&leaves, blocks->count, sizeof *leaves, "leaves", error);
    }
    if (result != VSH_OK) {
        goto done;
    }
    vshi_grid_leaves(grid, leaves, blocks->count);
    int32_t low[3] = {INT32_MAX, INT32_MAX, INT32_MAX}, high[3] = {INT32_MIN, INT32_MIN, INT32_MIN};
    for (size_t i = 0; i < blocks->count; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t o = leaves[i].origin[axis];
            low[axis] = o < low[axis] ? o : low[axis];
            high[axis] = o > high[axis] ? o : high[axis];
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        blocks->origin[axis] =
            low[axis] - 8; /* room for cells between a block without values and one with them */
        blocks->size[axis] = (high[axis] - low[axis]) / 8 + 2;
    }
    result = allocate_map(blocks, budget, error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&blocks->values, blocks->count, 512 * sizeof(float), "field values",
                               error);
    }
    if (result != VSH_OK) {
        goto done;
    }
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    const double per_voxel = 1.0 / info.voxel_size;
    vshi_grid_block_signs(grid, blocks->origin, blocks->size, blocks->signs);
    memset(blocks->map, 0xff, sizeof(int32_t) * block_at(blocks, blocks->size[0], 0, 0));
    for (size_t i = 0; i < blocks->count; ++i) {
        const int32_t *o = leaves[i].origin;
        blocks->map[block_at(blocks, (o[0] - blocks->origin[0]) / 8, (o[1] - blocks->origin[1]) / 8,
                             (o[2] - blocks->origin[2]) / 8)] = (int32_t)i;
        for (int v = 0; v < 512; ++v) {
            blocks->values[i * 512 + (size_t)v] = clamp((float)(leaves[i].values[v] * per_voxel), band);
        }
    }
done:
    free(leaves);
    return result;
}

typedef struct assembly {
    const vshi_blocks *blocks;
    const int32_t *slots; /* block in the map of each brick to write */
    float *bricks;
    uint8_t *keep; /* first pass: whether the block needs a brick */
} assembly;

/* Value of a voxel given in voxels from the blocks' origin; background where there is no block. */
static float block_value(const vshi_blocks *blocks, int32_t x, int32_t y, int32_t z) {
    if (x >= 8 * blocks->size[0] || y >= 8 * blocks->size[1] || z >= 8 * blocks->size[2]) {
        return blocks->band;
    }
    const size_t block = block_at(blocks, x >> 3, y >> 3, z >> 3);
    const int32_t number = blocks->map[block];
    if (number < 0) {
        return (float)blocks->signs[block] * blocks->band;
    }
    return blocks->values[(size_t)number * 512 + (size_t)((x & 7) * 64 + (y & 7) * 8 + (z & 7))];
}

static void block_corner(const vshi_blocks *blocks, size_t block, int32_t corner[3]) {
    const size_t plane = (size_t)blocks->size[1] * (size_t)blocks->size[2];
    corner[0] = (int32_t)(block / plane) * 8;
    corner[1] = (int32_t)(block % plane / (size_t)blocks->size[2]) * 8;
    corner[2] = (int32_t)(block % (size_t)blocks->size[2]) * 8;
}

/* A block needs a brick where one of its 9³ values lies within the band, or where signs change without that
 * (a .vdb whose band is torn). */
static void mark_bricks(void *user, size_t begin, size_t end) {
    const assembly *a = user;
    const vshi_blocks *blocks = a->blocks;
    for (size_t block = begin; block < end; ++block) {
        int32_t c[3];
        block_corner(blocks, block, c);
        bool near = false;
        for (int n = 0; n < 8 && !near; ++n) {
            const int32_t x = (c[0] >> 3) + (n >> 2), y = (c[1] >> 3) + (n >> 1 & 1),
                          z = (c[2] >> 3) + (n & 1);
            near = x < blocks->size[0] && y < blocks->size[1] && z < blocks->size[2] &&
                   blocks->map[block_at(blocks, x, y, z)] >= 0;
        }
        if (!near) {
            continue;
        }
        const float first = block_value(blocks, c[0], c[1], c[2]);
        bool keep = false;
        for (int v = 0; v < VSHI_BRICK_VALUES && !keep; ++v) {
            const float value = block_value(blocks, c[0] + v / 81, c[1] + v / 9 % 9, c[2] + v % 9);
            keep = fabsf(value) < blocks->band || (value < 0.0f) != (first < 0.0f);
        }
        a->keep[block] = keep;
    }
}

static void write_bricks(void *user, size_t begin, size_t end) {
    const assembly *a = user;
    for (size_t i = begin; i < end; ++i) {
        int32_t c[3];
        block_corner(a->blocks, (size_t)a->slots[i], c);
        float *brick = a->bricks + i * VSHI_BRICK_VALUES;
        for (int x = 0; x < 9; ++x) {
            for (int y = 0; y < 9; ++y) {
                for (int z = 0; z < 9; ++z) {
                    *brick++ = block_value(a->blocks, c[0] + x, c[1] + y, c[2] + z);
                }
            }
        }
    }
}

/* Grows *memory to hold `count` elements of `size` bytes. */
static vsh_result grow(void **memory, uint64_t count, size_t size, vsh_error *error) {
    void *larger = count <= SIZE_MAX / size ? realloc(*memory, (size_t)count * size) : NULL;
    if (larger == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "field: the system refused %llu × %zu bytes",
                         (unsigned long long)count, size);
    }
    *memory = larger;
    return VSH_OK;
}

vsh_result vshi_level_append(vsh_field *field, const vshi_blocks *blocks, const float *block_feet,
                             vshi_budget budget, vshi_job *job, vshi_feet *feet, vsh_error *error) {
    const size_t block_count = block_at(blocks, blocks->size[0], 0, 0);
    int32_t *slots = NULL;
    assembly a = {.blocks = blocks};
    feet->points = NULL;
    vsh_result result = vshi_allocate((void **)&a.keep, block_count, 1, "field blocks", error);
    if (result != VSH_OK) {
        return result;
    }
    result = vshi_parallel_for(job, block_count, 4096, 0, mark_bricks, &a, error);
    if (result != VSH_OK) {
        goto done;
    }
    size_t brick_count = 0;
    for (size_t i = 0; i < block_count; ++i) {
        brick_count += a.keep[i];
    }

    vshi_level *level = &field->levels[field->level_count];
    const vshi_level *below = field->level_count > 0 ? level - 1 : NULL;
    *level = (vshi_level){.scale = blocks->scale, .band = blocks->band, .brick_count = brick_count + 2};
    memcpy(level->origin, blocks->origin, sizeof level->origin);
    memcpy(level->size, blocks->size, sizeof level->size);
    if (below != NULL) {
        level->first_brick = below->first_brick + below->brick_count;
        level->first_index = below->first_index +
                             (uint64_t)below->size[0] * (uint64_t)below->size[1] * (uint64_t)below->size[2];
    }
    const uint64_t bricks = level->first_brick + level->brick_count;
    if (bricks > INT32_MAX / VSHI_BRICK_VALUES || level->first_index + block_count > INT32_MAX) {
        result =
            vshi_fail(error, VSH_ERROR_LIMIT, "field: %llu bricks pass the limit of %d; use larger voxels",
                      (unsigned long long)bricks, INT32_MAX / VSHI_BRICK_VALUES);
        goto done;
    }
    const size_t per_brick = VSHI_BRICK_VALUES * sizeof(float) + sizeof *slots +
                             (block_feet != NULL ? 512 * 3 * sizeof(float) : 0);
    budget.held += (double)level->brick_count * (double)per_brick;
    budget.held += (double)block_count * (double)(sizeof(int32_t) + 1);
    result = vshi_check_limit(budget.run, budget.held, "field", error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&slots, brick_count, sizeof *slots, "field bricks", error);
    }
    if (result == VSH_OK) {
        result = grow((void **)&field->values, bricks * VSHI_BRICK_VALUES, sizeof(float), error);
    }
    if (result == VSH_OK) {
        result = grow((void **)&field->index, level->first_index + block_count, sizeof(int32_t), error);
    }
    if (result == VSH_OK && block_feet != NULL) {
        result = vshi_allocate((void **)&feet->points, level->brick_count, 512 * 3 * sizeof(float),
                               "field feet", error);
    }
    if (result != VSH_OK) {
        goto done;
    }

    float *constant = field->values + level->first_brick * VSHI_BRICK_VALUES;
    for (int v = 0; v < VSHI_BRICK_VALUES; ++v) {
        constant[VSHI_BRICK_OUTSIDE * VSHI_BRICK_VALUES + v] = level->band;
        constant[VSHI_BRICK_INSIDE * VSHI_BRICK_VALUES + v] = -level->band;
    }
    size_t slot = 0;
    for (size_t block = 0; block < block_count; ++block) {
        uint64_t brick = blocks->signs[block] < 0 ? VSHI_BRICK_INSIDE : VSHI_BRICK_OUTSIDE;
        const int32_t number = blocks->map[block];
        if (a.keep[block]) {
            brick = slot + 2;
            slots[slot++] = (int32_t)block;
            if (block_feet != NULL) {
                float *to = feet->points + brick * 512 * 3;
                if (number >= 0) {
                    memcpy(to, block_feet + (size_t)number * 512 * 3, 512 * 3 * sizeof(float));
                } else {
                    for (int v = 0; v < 512 * 3; ++v) {
                        to[v] = NAN;
                    }
                }
            }
        } else if (number >= 0) { /* all of it is background of one sign */
            brick = blocks->values[(size_t)number * 512] < 0.0f ? VSHI_BRICK_INSIDE : VSHI_BRICK_OUTSIDE;
        }
        field->index[level->first_index + block] =
            (int32_t)((level->first_brick + brick) * VSHI_BRICK_VALUES);
    }
    a.slots = slots;
    a.bricks = constant + 2 * VSHI_BRICK_VALUES;
    result = vshi_parallel_for(job, brick_count, 64, 0, write_bricks, &a, error);
    if (result == VSH_OK) {
        ++field->level_count;
    }
done:
    if (result != VSH_OK) {
        free(feet->points);
        feet->points = NULL;
    }
    free(slots);
    free(a.keep);
    return result;
}
