/* The checks of a file of fields, member by member. */
#include "field/stored.h"

#include "field/level.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* How far a stored turn may be off one: that of the level set's transform. */
static const double TURN = 1e-3;

static uint64_t turned(uint64_t x, int by) {
    return x << by | x >> (64 - by);
}

/* Four sums side by side, of every fourth word, as multiplications take their time; each step can be undone,
 * so that no single word that is another goes unseen. */
uint64_t vshi_stored_sum(const void *bytes, size_t count) {
    static const uint64_t FACTOR = UINT64_C(0x9e3779b97f4a7c15); /* 2^64 over the golden ratio, odd */
    const char *at = bytes;
    uint64_t sums[4] = {1, 2, 3, 4}, words[4];
    const uint64_t all = count;
    for (; count >= sizeof words; count -= sizeof words, at += sizeof words) {
        memcpy(words, at, sizeof words);
        for (int i = 0; i < 4; ++i) {
            sums[i] = turned((sums[i] ^ words[i]) * FACTOR, 29);
        }
    }
    memset(words, 0, sizeof words);
    memcpy(words, at, count);
    uint64_t sum = all;
    for (int i = 0; i < 4; ++i) {
        sums[i] = turned((sums[i] ^ words[i]) * FACTOR, 29);
        sum = turned((sum ^ sums[i]) * FACTOR, 31);
    }
    return sum ^ sum >> 32;
}

typedef struct checking {
    const char *path;
    size_t number;
    vsh_error *error;
} checking;

static vsh_result refuse(const checking *c, const char *what) {
    return vshi_fail(c->error, VSH_ERROR_READ, "%s: damaged: field %zu: %s", c->path, c->number, what);
}

static bool within(double value, double least, double most) {
    return value >= least && value <= most; /* false of NaN */
}

/* A turn over the voxel size, and boxes. */
static vsh_result check_space(const checking *c, const vshi_stored_field *r) {
    if (!within(r->voxel_size, 1e-12, 1e12) || !within(r->shell_thickness, 0.0, 1e15) ||
        !within(r->half_width, 1.0, 1e6)) {
        return refuse(c, "voxel size, thickness or half width out of range");
    }
    for (int row = 0; row < 3; ++row) {
        const double *m = r->to_field + 4 * row;
        if (!within(fabs(m[3]), 0.0, 1e30)) {
            return refuse(c, "its transform is out of range");
        }
        for (int other = 0; other <= row; ++other) {
            const double *n = r->to_field + 4 * other;
            const double dot = (m[0] * n[0] + m[1] * n[1] + m[2] * n[2]) * r->voxel_size * r->voxel_size;
            if (!(fabs(dot - (row == other ? 1.0 : 0.0)) <= TURN)) {
                return refuse(c, "its transform is none of its voxel size");
            }
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (!within(r->world_min[axis], -1e30, 1e30) ||
            !within(r->world_max[axis], r->world_min[axis], 1e30)) {
            return refuse(c, "its bounds are out of range");
        }
    }
    return VSH_OK;
}

/* One level, placed behind those before it in the field. */
static vsh_result check_level(const checking *c, const vshi_stored_field *r, vsh_field *field) {
    const int32_t l = field->level_count;
    const vshi_stored_level *from = &r->levels[l];
    vshi_level *level = &field->levels[l];
    vshi_blocks blocks = {.scale = ldexpf(1.0f, l)};
    vshi_blocks_set_band(&blocks, l == 0 ? (float)fmin(r->half_width, VSHI_COARSE_BAND)
                                         : VSHI_COARSE_BAND * blocks.scale);
    if (from->band != blocks.band || from->quantum != blocks.quantum) {
        return refuse(c, "a level's band is none of its half width");
    }
    uint64_t count = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const int64_t low = from->origin[axis], size = from->size[axis];
        const int64_t high = low + VSHI_BRICK_CELLS * size;
        if (low % VSHI_BRICK_CELLS != 0 || size < 1 || low < -(1 << 30) || high > 1 << 30) {
            return refuse(c, "a level's blocks are out of range");
        }
        count *= (uint64_t)size; /* each at most 2^28: the product of two fits, and is looked at */
        if (count > INT32_MAX) {
            return refuse(c, "a level has more than 2^31 blocks");
        }
        level->origin[axis] = from->origin[axis];
        level->size[axis] = from->size[axis];
    }
    const uint64_t bricks = from->brick_count;
    const uint64_t shared = (uint64_t)VSHI_BRICK_VALUES - VSHI_STRIDE_X; /* a brick behind another */
    if (bricks < 2 || bricks - 2 > count || from->value_count > bricks * VSHI_BRICK_VALUES ||
        from->value_count <
            2 * VSHI_BRICK_VALUES + (bricks - 2) * shared + (bricks > 2 ? VSHI_STRIDE_X : 0)) {
        return refuse(c, "a level's bricks are not as many as its blocks and values");
    }
    level->first_value = field->value_count;
    level->brick_count = bricks;
    level->scale = blocks.scale;
    level->band = blocks.band;
    level->quantum = blocks.quantum;
    level->rounding = 0.5f * blocks.quantum + (l > 0 ? level[-1].rounding : 0.0f);
    level->first_index = l > 0 ? level[-1].first_index + (uint64_t)level[-1].size[0] *
                                                             (uint64_t)level[-1].size[1] *
                                                             (uint64_t)level[-1].size[2]
                               : 0;
    field->value_count += from->value_count;
    ++field->level_count;
    return field->value_count <= INT32_MAX && level->first_index + count <= INT32_MAX
               ? VSH_OK
               : refuse(c, "more than 2^31 values or blocks");
}

/* Whether `bytes` bytes lie where they may. */
static bool lies_within(uint64_t at, uint64_t bytes, uint64_t head_bytes, uint64_t file_bytes) {
    return at % VSHI_STORED_APART == 0 && at >= head_bytes && at <= file_bytes && bytes <= file_bytes - at;
}

static uint64_t block_count(const vsh_field *field) {
    const vshi_level *top = &field->levels[field->level_count - 1];
    return top->first_index + (uint64_t)top->size[0] * (uint64_t)top->size[1] * (uint64_t)top->size[2];
}

/* Its place and its map, as far as there is one; blocks are looked at when they are copied. */
static vsh_result check_band(const checking *c, const vshi_stored_band *band, const vsh_field *field,
                             uint64_t head_bytes, uint64_t file_bytes) {
    static const vshi_stored_band none;
    if (band->block_count == 0) {
        return memcmp(band, &none, sizeof none) == 0 ? VSH_OK : refuse(c, "a band without blocks");
    }
    const int32_t *size = field->levels[0].size;
    if (band->block_count > (uint64_t)size[0] * (uint64_t)size[1] * (uint64_t)size[2]) {
        return refuse(c, "its band has more blocks than it");
    }
    if (band->masks_at !=
        vshi_stored_align(band->blocks_at + band->block_count * sizeof(uint32_t), VSHI_STORED_APART)) {
        return refuse(c, "the blocks and masks of its band are not as many");
    }
    if (!lies_within(band->blocks_at, band->block_count * sizeof(uint32_t), head_bytes, file_bytes) ||
        !lies_within(band->masks_at, band->block_count * VSHI_MASK_WORDS * sizeof(uint64_t), head_bytes,
                     file_bytes)) {
        return refuse(c, "its band lies beyond the file");
    }
    const vshi_map *map = &band->map;
    const size_t length = strnlen(map->name, sizeof map->name);
    bool sound = length < sizeof map->name && map->count <= VSHI_MAP_NUMBERS;
    for (size_t i = 0; i < sizeof map->name; ++i) {
        sound = sound && (i < length ? map->name[i] > ' ' && map->name[i] <= '~' : map->name[i] == '\0');
    }
    for (size_t i = 0; i < VSHI_MAP_NUMBERS; ++i) {
        sound = sound && (i < map->count ? (bool)isfinite(map->numbers[i]) : map->numbers[i] == 0.0);
    }
    return sound ? VSH_OK : refuse(c, "the map of its band is none");
}

vsh_result vshi_stored_field_check(const char *path, size_t number, const vshi_stored_field *record,
                                   uint64_t head_bytes, uint64_t file_bytes, vsh_field *field,
                                   vsh_error *error) {
    const checking c = {path, number, error};
    vsh_result result = check_space(&c, record);
    if (result != VSH_OK) {
        return result;
    }
    if (record->level_count < 1 || record->level_count > VSHI_MAX_LEVELS || record->reserved != 0) {
        return refuse(&c, "a number of levels out of range");
    }
    memset(field, 0, sizeof *field);
    while (field->level_count < (int32_t)record->level_count) {
        result = check_level(&c, record, field);
        if (result != VSH_OK) {
            return result;
        }
    }
    static const vshi_stored_level none;
    for (size_t l = record->level_count; l < VSHI_MAX_LEVELS; ++l) {
        if (memcmp(&record->levels[l], &none, sizeof none) != 0) {
            return refuse(&c, "a level beyond its last");
        }
    }
    if (field->value_count != record->value_count || block_count(field) != record->index_count) {
        return refuse(&c, "its values or blocks are not as many as its levels'");
    }
    if (!lies_within(record->values_at, record->value_count * sizeof(int16_t), head_bytes, file_bytes) ||
        !lies_within(record->index_at, record->index_count * sizeof(int32_t), head_bytes, file_bytes)) {
        return refuse(&c, "its values or blocks lie beyond the file");
    }
    result = check_band(&c, &record->band, field, head_bytes, file_bytes);
    if (result != VSH_OK) {
        return result;
    }
    const vshi_level *finest = &field->levels[0];
    for (int axis = 0; axis < 3; ++axis) {
        const double low = finest->origin[axis], high = low + VSHI_BRICK_CELLS * (double)finest->size[axis];
        if (!within(record->bounds_min[axis], low, high) ||
            !within(record->bounds_max[axis], record->bounds_min[axis], high)) {
            return refuse(&c, "its surface is not among its voxels");
        }
    }
    memcpy(field->to_field, record->to_field, sizeof field->to_field);
    memcpy(field->bounds_min, record->bounds_min, sizeof field->bounds_min);
    memcpy(field->bounds_max, record->bounds_max, sizeof field->bounds_max);
    memcpy(field->world_min, record->world_min, sizeof field->world_min);
    memcpy(field->world_max, record->world_max, sizeof field->world_max);
    field->voxel_size = record->voxel_size;
    field->shell_thickness = record->shell_thickness;
    field->active_voxels = record->active_voxels;
    return VSH_OK;
}

vsh_result vshi_stored_index_check(const char *path, size_t number, const vsh_field *field,
                                   vsh_error *error) {
    const checking c = {path, number, error};
    for (int32_t l = 0; l < field->level_count; ++l) {
        const vshi_level *level = &field->levels[l];
        const bool last = l + 1 == field->level_count;
        const uint64_t end = last ? field->value_count : level[1].first_value;
        const uint64_t index_end = last ? block_count(field) : level[1].first_index;
        const int32_t least = (int32_t)level->first_value, most = (int32_t)(end - VSHI_BRICK_VALUES);
        const int32_t *index = field->index;
        int beyond = 0;
        for (uint64_t i = level->first_index; i < index_end; ++i) {
            beyond |= (index[i] < least) | (index[i] > most);
        }
        if (beyond != 0) {
            return refuse(&c, "a block's brick is none of its level");
        }
        const int16_t *outside = field->values + level->first_value, *inside = outside + VSHI_BRICK_VALUES;
        const int16_t band = (int16_t)lrintf(level->band / level->quantum);
        for (int v = 0; v < VSHI_BRICK_VALUES; ++v) {
            if (outside[v] != band || inside[v] != -band) {
                return refuse(&c, "a level's constant bricks are not so");
            }
        }
    }
    return VSH_OK;
}
