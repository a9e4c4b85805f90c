/* Blocks of 8³ values to bricks of 9³. */
#include "field/level.h"

#include "base/memory.h"
#include "base/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A lattice point within this of the surface may be a corner of a cell that holds some of it, voxels. */
static const float CELL_DIAGONAL = 1.75f;

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
    VSHI_TRY(vshi_check_limit(budget.run,
                              budget.held + (double)count * (sizeof *blocks->map + sizeof *blocks->signs),
                              "field", error));
    VSHI_TRY(vshi_allocate((void **)&blocks->map, count, sizeof(int32_t), "field blocks", error));
    return vshi_allocate((void **)&blocks->signs, count, sizeof(int8_t), "field signs", error);
}

static size_t block_at(const vshi_blocks *blocks, int32_t x, int32_t y, int32_t z) {
    return ((size_t)x * (size_t)blocks->size[1] + (size_t)y) * (size_t)blocks->size[2] + (size_t)z;
}

void vshi_below_free(vshi_below *below) {
    free(below->feet);
    free(below->map);
    free(below->boxes);
    free(below->bricks);
    *below = (vshi_below){.bricks = NULL};
}

typedef struct leaf_reading {
    const vshi_leaf *leaves;
    vshi_blocks *blocks;
    double per_voxel;
} leaf_reading;

static void read_leaves(void *user, size_t begin, size_t end) {
    const leaf_reading *r = user;
    for (size_t i = begin; i < end; ++i) {
        for (size_t v = 0; v < 512; ++v) {
            r->blocks->values[i * 512 + v] =
                vshi_blocks_value(r->blocks, (float)(r->leaves[i].values[v] * r->per_voxel));
        }
    }
}

vsh_result vshi_level_blocks_read(const vsh_grid *grid, float band, vshi_budget budget, vshi_job *job,
                                  vshi_blocks *blocks, vsh_error *error) {
    vshi_leaf *leaves = NULL;
    *blocks = (vshi_blocks){.scale = 1.0f};
    vshi_blocks_set_band(blocks, band);
    blocks->count = vshi_grid_leaves(grid, NULL, 0);
    budget.held += (double)blocks->count * (double)(sizeof *leaves + 512 * sizeof *blocks->values);
    VSHI_TRY(vshi_check_limit(budget.run, budget.held, "field", error));
    VSHI_TRY(vshi_allocate((void **)&leaves, blocks->count, sizeof *leaves, "leaves", error));
    vsh_result result = VSH_OK;
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
    VSHI_TRY_DONE(allocate_map(blocks, budget, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&blocks->values, blocks->count, 512 * sizeof *blocks->values,
                                "field values", error));
    vshi_grid_block_signs(grid, blocks->origin, blocks->size, blocks->signs);
    memset(blocks->map, 0xff, sizeof(int32_t) * block_at(blocks, blocks->size[0], 0, 0));
    for (size_t i = 0; i < blocks->count; ++i) {
        const int32_t *o = leaves[i].origin;
        blocks->map[block_at(blocks, (o[0] - blocks->origin[0]) / 8, (o[1] - blocks->origin[1]) / 8,
                             (o[2] - blocks->origin[2]) / 8)] = (int32_t)i;
    }
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    leaf_reading r = {leaves, blocks, 1.0 / info.voxel_size};
    result = vshi_parallel_for(job, blocks->count, 64, 0, read_leaves, &r, error);
done:
    free(leaves);
    return result;
}

typedef struct assembly {
    const vshi_blocks *blocks;
    const int32_t *slots; /* each brick's block in the map */
    int16_t *bricks;
    int8_t *boxes; /* as in vshi_below */
    uint8_t *keep; /* of each block in the map: whether it needs a brick */
} assembly;

/* Values of the block at (x, y, z) of the map, or, where it has none, the one that stands for all: ± most. */
static const int16_t *values_at(const vshi_blocks *blocks, int32_t x, int32_t y, int32_t z,
                                int16_t *constant) {
    *constant = blocks->most;
    if (x >= blocks->size[0] || y >= blocks->size[1] || z >= blocks->size[2]) {
        return NULL;
    }
    const size_t block = block_at(blocks, x, y, z);
    if (blocks->map[block] < 0) {
        *constant = (int16_t)(blocks->signs[block] * blocks->most);
        return NULL;
    }
    return blocks->values + (size_t)blocks->map[block] * 512;
}

/* A block's brick: its own values and those of the seven blocks beyond its far faces, row by row. False where
 * all eight have no values. */
static bool gather_brick(const vshi_blocks *blocks, size_t block, int16_t *brick) {
    const size_t plane = (size_t)blocks->size[1] * (size_t)blocks->size[2];
    const int32_t at[3] = {(int32_t)(block / plane), (int32_t)(block % plane / (size_t)blocks->size[2]),
                           (int32_t)(block % (size_t)blocks->size[2])};
    const int16_t *from[8];
    int16_t constant[8];
    bool any = false;
    for (int n = 0; n < 8; ++n) {
        from[n] = values_at(blocks, at[0] + (n >> 2), at[1] + (n >> 1 & 1), at[2] + (n & 1), &constant[n]);
        any = any || from[n] != NULL;
    }
    for (int row = 0; any && row < VSHI_STRIDE_X; ++row, brick += 9) {
        const int x = row / 9, y = row % 9, n = (x >> 3) * 4 + (y >> 3) * 2;
        const int first = (x & 7) * 64 + (y & 7) * 8;
        if (from[n] != NULL) {
            memcpy(brick, from[n] + first, 8 * sizeof *brick);
        } else {
            for (int z = 0; z < 8; ++z) {
                brick[z] = constant[n];
            }
        }
        brick[8] = from[n + 1] != NULL ? from[n + 1][first] : constant[n + 1];
    }
    return any;
}

/* A block needs a brick where one of its 9³ values lies within the band, or where signs change without that
 * (a .vdb whose band is torn). */
static void mark_bricks(void *user, size_t begin, size_t end) {
    const assembly *a = user;
    for (size_t block = begin; block < end; ++block) {
        int16_t brick[VSHI_BRICK_VALUES];
        int others = 0;
        if (gather_brick(a->blocks, block, brick)) {
            others = abs(brick[0]) != a->blocks->most;
            for (int v = 0; v < VSHI_BRICK_VALUES; ++v) {
                others |= brick[v] ^ brick[0];
            }
        }
        a->keep[block] = others != 0;
    }
}

/* The box of vshi_below of a brick. */
static void find_box(const vshi_blocks *blocks, const int16_t *brick, int8_t box[6]) {
    const int32_t near = (int32_t)(CELL_DIAGONAL * blocks->scale / blocks->quantum);
    int32_t planes = 0, across = 0, columns = 0;
    for (int x = 0; x < VSHI_BRICK_EDGE; ++x) {
        int32_t any = 0;
        for (int v = 0; v < VSHI_STRIDE_X; ++v) {
            any |= abs(brick[x * VSHI_STRIDE_X + v]) <= near;
        }
        planes |= any << x;
    }
    memset(box, 0, 6);
    box[0] = (int8_t)(planes == 0);
    for (int x = 0; x < VSHI_BRICK_EDGE; ++x) {
        for (int y = 0; y < 9 && (planes >> x & 1) != 0; ++y) {
            for (int z = 0; z < 9; ++z) {
                const int32_t hit = abs(brick[x * VSHI_STRIDE_X + y * VSHI_STRIDE_Y + z]) <= near;
                across |= hit << y;
                columns |= hit << z;
            }
        }
    }
    const int32_t masks[3] = {planes, across, columns};
    for (int axis = 0; axis < 3 && planes != 0; ++axis) {
        box[axis] = (int8_t)__builtin_ctz((unsigned)masks[axis]);
        box[3 + axis] = (int8_t)(31 - __builtin_clz((unsigned)masks[axis]));
    }
}

static void write_bricks(void *user, size_t begin, size_t end) {
    const assembly *a = user;
    for (size_t i = begin; i < end; ++i) {
        int16_t *const brick = a->bricks + i * VSHI_BRICK_VALUES;
        gather_brick(a->blocks, (size_t)a->slots[i], brick);
        find_box(a->blocks, brick, a->boxes + 6 * i);
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

vsh_result vshi_level_append(vsh_field *field, const vshi_blocks *blocks, vshi_budget budget, vshi_job *job,
                             vshi_below *below, vsh_error *error) {
    const size_t block_count = block_at(blocks, blocks->size[0], 0, 0);
    int32_t *slots = NULL;
    *below = (vshi_below){.bricks = NULL};
    assembly a = {.blocks = blocks};
    VSHI_TRY(vshi_allocate((void **)&a.keep, block_count, 1, "field blocks", error));
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(vshi_parallel_for(job, block_count, 1024, 0, mark_bricks, &a, error));
    size_t brick_count = 0;
    for (size_t i = 0; i < block_count; ++i) {
        brick_count += a.keep[i];
    }

    vshi_level *level = &field->levels[field->level_count];
    const vshi_level *last = field->level_count > 0 ? level - 1 : NULL;
    *level = (vshi_level){.scale = blocks->scale,
                          .band = blocks->band,
                          .quantum = blocks->quantum,
                          .rounding = 0.5f * blocks->quantum + (last != NULL ? last->rounding : 0.0f),
                          .first_value = field->value_count,
                          .brick_count = brick_count + 2};
    memcpy(level->origin, blocks->origin, sizeof level->origin);
    memcpy(level->size, blocks->size, sizeof level->size);
    if (last != NULL) {
        level->first_index =
            last->first_index + (uint64_t)last->size[0] * (uint64_t)last->size[1] * (uint64_t)last->size[2];
    }
    const uint64_t most = level->first_value + level->brick_count * VSHI_BRICK_VALUES;
    if (most > INT32_MAX || level->first_index + block_count > INT32_MAX) {
        result =
            vshi_fail(error, VSH_ERROR_LIMIT, "field: %llu bricks pass the limit of %d; use larger voxels",
                      (unsigned long long)(most / VSHI_BRICK_VALUES), INT32_MAX / VSHI_BRICK_VALUES);
        goto done;
    }
    budget.held += (double)level->brick_count * (VSHI_BRICK_VALUES * sizeof(int16_t) + sizeof *slots + 6);
    budget.held += (double)block_count * (double)(sizeof(int32_t) + 1);
    VSHI_TRY_DONE(vshi_check_limit(budget.run, budget.held, "field", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&slots, brick_count, sizeof *slots, "field bricks", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&a.boxes, brick_count, 6, "field bricks", error));
    VSHI_TRY_DONE(grow((void **)&field->values, most, sizeof *field->values, error));
    VSHI_TRY_DONE(grow((void **)&field->index, level->first_index + block_count, sizeof(int32_t), error));

    const int32_t outside = (int32_t)level->first_value, inside = outside + VSHI_BRICK_VALUES;
    for (int v = 0; v < VSHI_BRICK_VALUES; ++v) {
        field->values[outside + v] = blocks->most;
        field->values[inside + v] = (int16_t)-blocks->most;
    }
    int32_t *index = field->index + level->first_index;
    const int32_t first = inside + VSHI_BRICK_VALUES;
    size_t next = 0;
    for (size_t block = 0; block < block_count; ++block) {
        const int32_t number = blocks->map[block];
        /* without a brick all of a block is background of one sign */
        const bool solid = number >= 0 ? blocks->values[(size_t)number * 512] < 0 : blocks->signs[block] < 0;
        index[block] = solid ? inside : outside;
        if (a.keep[block]) {
            index[block] = first + (int32_t)next * VSHI_BRICK_VALUES;
            slots[next++] = (int32_t)block;
        }
    }
    a.slots = slots;
    a.bricks = field->values + first;
    VSHI_TRY_DONE(vshi_parallel_for(job, brick_count, 64, 0, write_bricks, &a, error));
    field->value_count = most;
    ++field->level_count;
    *below = (vshi_below){.brick_count = brick_count, .bricks = slots, .boxes = a.boxes};
    slots = NULL;
    a.boxes = NULL;
done:
    free(a.boxes);
    free(slots);
    free(a.keep);
    return result;
}
