/* Makes the levels of a field: the finest from a grid, each coarser one from the field so far. */
#include "field/level.h"

#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "field/kernel/feet.h"
#include "levelset/access.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* --- bricks of 9³ values from blocks of 8³ */

/* Largest distance from the surface, voxels, of a corner of one of its cells. */
static const float CELL_DIAGONAL = 1.75f;

/* To the nearest integer; `x` is within 16 bits. */
static inline int16_t round_value(float x) {
    return (int16_t)(int32_t)(x + (x < 0.0f ? -0.5f : 0.5f));
}

/* A distance in finest voxels as a value. */
static inline int16_t blocks_value(const vshi_blocks *blocks, float distance) {
    const float most = (float)blocks->most, value = distance / blocks->quantum;
    const float within = value > most ? most : value < -most ? -most : value;
    return round_value(within);
}

static void free_blocks(vshi_blocks *blocks) {
    free(blocks->values);
    free(blocks->signs);
    free(blocks->map);
    *blocks = (vshi_blocks){.map = NULL};
}

static vsh_result allocate_map(vshi_blocks *blocks, vshi_field_budget budget, vsh_error *error) {
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
                blocks_value(r->blocks, (float)(r->leaves[i].values[v] * r->per_voxel));
        }
    }
}

/* Reads the finest level's blocks from a grid. */
static vsh_result read_blocks(const vsh_grid *grid, float band, vshi_field_budget budget, vshi_job *job,
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
    memset(blocks->map, 0xff, sizeof(int32_t) * vshi_block_index(blocks->size, blocks->size[0], 0, 0));
    for (size_t i = 0; i < blocks->count; ++i) {
        const int32_t *o = leaves[i].origin;
        blocks->map[vshi_block_index(blocks->size, (o[0] - blocks->origin[0]) / 8,
                                     (o[1] - blocks->origin[1]) / 8, (o[2] - blocks->origin[2]) / 8)] =
            (int32_t)i;
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
    uint8_t *keep; /* for each block in the map: whether it needs a brick */
} assembly;

/* Values of the block at (x, y, z) of the map; NULL if all are *constant, ± most. */
static const int16_t *values_at(const vshi_blocks *blocks, int32_t x, int32_t y, int32_t z,
                                int16_t *constant) {
    *constant = blocks->most;
    if (x >= blocks->size[0] || y >= blocks->size[1] || z >= blocks->size[2]) {
        return NULL;
    }
    const size_t block = vshi_block_index(blocks->size, x, y, z);
    if (blocks->map[block] < 0) {
        *constant = (int16_t)(blocks->signs[block] * blocks->most);
        return NULL;
    }
    return blocks->values + (size_t)blocks->map[block] * 512;
}

/* Gathers a block's brick from its own values and those of the seven blocks beyond its far faces. Returns
 * false if all eight have no values. */
static bool gather_brick(const vshi_blocks *blocks, size_t block, int16_t *brick) {
    int32_t corner[3];
    vshi_block_corner((const int32_t[3]){0}, blocks->size, block, corner);
    const int32_t at[3] = {corner[0] / 8, corner[1] / 8, corner[2] / 8};
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

/* A block needs a brick if one of its 9³ values lies within the band, or if signs change without that (a .vdb
 * whose band is torn). */
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

/* Finds a brick's box in vshi_below. */
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

/* Appends a level of bricks to the field. *below then has its bricks, and no feet. */
static vsh_result append_level(vsh_field *field, const vshi_blocks *blocks, vshi_field_budget budget,
                               vshi_job *job, vshi_below *below, vsh_error *error) {
    const size_t block_count = vshi_block_index(blocks->size, blocks->size[0], 0, 0);
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
        level->first_index = last->first_index + vshi_block_index(last->size, last->size[0], 0, 0);
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

vsh_result vshi_level_read(vsh_field *field, const vsh_grid *grid, float band, vshi_field_budget budget,
                           vshi_job *job, vshi_below *below, vsh_error *error) {
    vshi_blocks blocks = {.map = NULL};
    vsh_result result;
    VSHI_TRY_DONE(read_blocks(grid, band, budget, job, &blocks, error));
    budget.held += (double)blocks.count * 512.0 * sizeof *blocks.values;
    result = append_level(field, &blocks, budget, job, below, error);
done:
    free_blocks(&blocks);
    return result;
}

/* --- coarser levels
 *
 * The new level has every second lattice point of the level below. Within that one's band it copies values
 * and signs, so signs of thin parts always come from the finest level. Farther out the distance is that to
 * the nearest point of the surface (its foot). Feet that spread from voxel to voxel (Danielsson, "Euclidean
 * distance mapping", 1980) take several times as long and are no nearer. Fast sweeping (Zhao 2005) was worse:
 * its first-order upwind differences leave distances 0.1 voxel too long, which makes a marcher step through a
 * wall. */

enum { EDGE = 8, BLOCK = 512 };

/* One bit a voxel of a block: word x, bit y · 8 + z. */
typedef uint64_t bits[8];

/* A shorter gradient gives no direction: a crease of the medial axis. */
static const float MIN_GRADIENT = 0.25f;
/* A foot farther off the finest level's zero, in its voxels, has slid off the surface. */
static const float MAX_RESIDUE = 0.5f;

/* A coarser level while it is derived. */
typedef struct derivation {
    const vsh_field *field;
    const vshi_level *fine; /* the level below */
    vshi_below below;       /* data of that level */
    vshi_blocks blocks;     /* of the new level */
    int32_t *corners;       /* [count][3], lattice coordinates of each block's first voxel */
    bits *core;             /* [count]: value copied from the level below */
    bits *inside;           /* [count]: negative */
    bits *rim;              /* [count]: core voxels with known feet that touch others */
    int16_t *feet;          /* [count][3][512], as vshi_below.feet */
    vshi_nearest_fn *nearest;
} derivation;

/* Stores the foot of a voxel of a block. */
static void keep_foot(const derivation *d, size_t block, int voxel, const float p[3], const float foot[3]) {
    const float steps = VSHI_FOOT_STEPS / d->blocks.scale;
    for (int axis = 0; axis < 3; ++axis) {
        d->feet[(block * 3 + (size_t)axis) * BLOCK + (size_t)voxel] =
            round_value((foot[axis] - p[axis]) * steps);
    }
}

static float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static float distance_to(const float p[3], const float foot[3]) {
    const float way[3] = {p[0] - foot[0], p[1] - foot[1], p[2] - foot[2]};
    return sqrtf(dot(way, way));
}

/* Slides a foot along the finest level's surface until it faces p, in steps of at most `most`. Returns the
 * finest level's value at the foot. */
static float slide(const vsh_field *field, float most, const float p[3], float foot[3]) {
    enum { SLIDES = 2 }; /* the second is for curved surfaces */
    /* Least gain of a slide, voxels of the level: VSHI_NODE leaves room for 300 such gains. */
    const float LEAST_GAIN = 1.0f / 1024.0f;
    float g[3], residue = vshi_level_sample(field, 0, foot, g);
    for (int i = 0; i < SLIDES; ++i) {
        const float v[3] = {p[0] - foot[0], p[1] - foot[1], p[2] - foot[2]}, square = dot(g, g);
        float lateral[3], moved[3], moved_g[3];
        for (int axis = 0; axis < 3; ++axis) {
            lateral[axis] = v[axis] - dot(v, g) / square * g[axis];
        }
        const float length = sqrtf(dot(lateral, lateral)), before = sqrtf(dot(v, v));
        /* the gain is the difference between a right-angled triangle's hypotenuse and longer leg */
        if (square < MIN_GRADIENT * MIN_GRADIENT || length * length < 2.0f * LEAST_GAIN * most * before) {
            break;
        }
        for (int axis = 0; axis < 3; ++axis) {
            moved[axis] = foot[axis] + (length > most ? most / length : 1.0f) * lateral[axis];
        }
        const float off = vshi_level_sample(field, 0, moved, moved_g), moved_square = dot(moved_g, moved_g);
        for (int axis = 0; axis < 3; ++axis) {
            moved[axis] -= off * moved_g[axis] / moved_square;
        }
        const float moved_residue = vshi_level_sample(field, 0, moved, moved_g);
        if (moved_square < MIN_GRADIENT * MIN_GRADIENT || fabsf(moved_residue) > MAX_RESIDUE ||
            distance_to(p, moved) + fabsf(moved_residue) >= before + fabsf(residue)) {
            break;
        }
        memcpy(foot, moved, sizeof moved);
        memcpy(g, moved_g, sizeof moved_g);
        residue = moved_residue;
    }
    return residue;
}

static int32_t floor_div(int32_t a, int32_t b) {
    return a / b - (a % b < 0);
}

/* A block of the level below: its brick, and its feet [3][512], or NULL. */
typedef struct fine_block {
    const int16_t *brick; /* NULL outside the level: +band */
    const int16_t *feet;
} fine_block;

/* Finds a block by the lattice coordinates of one of its voxels. */
static fine_block fine_block_at(const derivation *d, const int32_t at[3]) {
    const vshi_level *fine = d->fine;
    fine_block found = {NULL, NULL};
    int32_t v[3];
    for (int axis = 0; axis < 3; ++axis) {
        v[axis] = at[axis] - fine->origin[axis];
        if (v[axis] < 0 || v[axis] >= 8 * fine->size[axis]) {
            return found;
        }
    }
    const size_t block = vshi_block_index(fine->size, v[0] >> 3, v[1] >> 3, v[2] >> 3);
    found.brick = d->field->values + d->field->index[fine->first_index + block];
    if (d->below.feet != NULL && d->below.map[block] >= 0) {
        found.feet = d->below.feet + (size_t)d->below.map[block] * BLOCK * 3;
    }
    return found;
}

static float fine_value(const derivation *d, const int32_t at[3]) {
    const int16_t *brick = fine_block_at(d, at).brick;
    return brick == NULL
               ? d->fine->band
               : d->fine->quantum *
                     (float)brick[(at[0] & 7) * VSHI_STRIDE_X + (at[1] & 7) * VSHI_STRIDE_Y + (at[2] & 7)];
}

/* Estimates the foot of a finest lattice point of value h by one step down the gradient (central
 * differences). */
static void first_foot(const derivation *d, const int32_t at[3], float h, float foot[3]) {
    float g[3];
    for (int axis = 0; axis < 3; ++axis) {
        int32_t before[3] = {at[0], at[1], at[2]}, after[3] = {at[0], at[1], at[2]};
        --before[axis];
        ++after[axis];
        g[axis] = 0.5f * (fine_value(d, after) - fine_value(d, before));
    }
    const float length = sqrtf(dot(g, g));
    for (int axis = 0; axis < 3; ++axis) {
        foot[axis] = length >= MIN_GRADIENT ? (float)at[axis] - h * g[axis] / length : NAN;
    }
}

/* Copies one octant of a block: every second voxel of a block of the level below. Before, all feet of the
 * block are unknown and all bits 0. */
static void copy_octant(derivation *d, size_t block, int octant) {
    const int first[3] = {octant & 4, octant << 1 & 4, octant << 2 & 4};
    const int32_t *c = d->corners + 3 * block;
    const int32_t corner[3] = {2 * (c[0] + first[0]), 2 * (c[1] + first[1]), 2 * (c[2] + first[2])};
    const fine_block fine = fine_block_at(d, corner);
    const int16_t *const outside = d->field->values + d->fine->first_value;
    const int16_t *const brick = fine.brick == NULL ? outside : fine.brick;
    const int32_t fine_most = (int32_t)(d->fine->band / d->fine->quantum);
    for (int n = 0; n < 64; ++n) {
        const int x = n >> 4, y = n >> 2 & 3, z = n & 3;
        const int word = first[0] + x, bit = (first[1] + y) * 8 + first[2] + z;
        const size_t v = (size_t)(word * 64 + bit);
        const int16_t given = brick[2 * (x * VSHI_STRIDE_X + y * VSHI_STRIDE_Y + z)];
        int16_t *const to = d->blocks.values + block * BLOCK + v;
        d->inside[block][word] |= (uint64_t)(given < 0) << bit;
        if (abs(given) >= fine_most) {
            *to = (int16_t)(given < 0 ? -d->blocks.most : d->blocks.most);
            continue;
        }
        const float value = d->fine->quantum * (float)given;
        d->core[block][word] |= (uint64_t)1 << bit;
        *to = blocks_value(&d->blocks, value);
        if (fine.feet != NULL) {
            int16_t *const feet = d->feet + block * BLOCK * 3 + v;
            const int16_t *const known = fine.feet + 2 * (x * 64 + y * 8 + z);
            for (int axis = 0; axis < 3 && known[0] != VSHI_FOOT_UNKNOWN; ++axis) {
                feet[axis * BLOCK] = (int16_t)(known[axis * BLOCK] / 2);
            }
        } else if (d->below.feet == NULL) {
            const int32_t at[3] = {corner[0] + 2 * x, corner[1] + 2 * y, corner[2] + 2 * z};
            const float p[3] = {(float)at[0], (float)at[1], (float)at[2]};
            float foot[3];
            first_foot(d, at, value, foot);
            if (!isnan(foot[0]) && fabsf(slide(d->field, 1.0f, p, foot)) <= MAX_RESIDUE) {
                keep_foot(d, block, (int)v, p, foot);
            }
        }
    }
}

/* Copies the values that the level below knows. */
static void copy_core(void *user, size_t begin, size_t end) {
    derivation *d = user;
    for (size_t i = begin * 3 * BLOCK; i < end * 3 * BLOCK; ++i) {
        d->feet[i] = VSHI_FOOT_UNKNOWN;
    }
    for (size_t block = begin; block < end; ++block) {
        for (int octant = 0; octant < 8; ++octant) {
            copy_octant(d, block, octant);
        }
    }
}

/* --- distances of voxels that the level below does not know
 *
 * The line from a voxel to its foot passes the rim of the core, whose voxels know their feet. The nearest of
 * these feet slides along the finest level's surface until it faces the voxel. That removes the error of the
 * lattice's spacing. */

/* Most that slide() shortens the way to a foot at the end of the band, voxels of the level: 2² / (2 · 6) by
 * two slides of a voxel each, and half a finest voxel of residue. */
static const float SLIDE_GAIN = 0.6f;

/* Finds the numbers of a block and of the 26 around it; -1: none. */
static void find_around(const derivation *d, size_t block, int32_t around[27]) {
    const vshi_blocks *b = &d->blocks;
    int32_t at[3];
    for (int axis = 0; axis < 3; ++axis) {
        at[axis] = (d->corners[3 * block + (size_t)axis] - b->origin[axis]) / EDGE;
    }
    for (int n = 0; n < 27; ++n) {
        const int32_t x = at[0] + n / 9 - 1, y = at[1] + n / 3 % 3 - 1, z = at[2] + n % 3 - 1;
        const bool there = x >= 0 && y >= 0 && z >= 0 && x < b->size[0] && y < b->size[1] && z < b->size[2];
        around[n] = there ? b->map[vshi_block_index(b->size, x, y, z)] : -1;
    }
}

/* A plane of voxels outside the core, joined with neighbours along z. `n` is the first of three blocks along
 * z. */
static uint64_t open_row(const derivation *d, const int32_t around[27], int n, int x) {
    uint64_t open[3];
    for (int i = 0; i < 3; ++i) {
        open[i] = around[n + i] < 0 ? 0 : ~d->core[around[n + i]][x];
    }
    static const uint64_t first_z = 0x0101010101010101u;
    return open[1] | (open[1] << 1 & ~first_z) | (open[1] >> 1 & ~(first_z << 7)) | (open[0] >> 7 & first_z) |
           (open[2] & first_z) << 7;
}

static void find_rim(void *user, size_t begin, size_t end) {
    derivation *d = user;
    for (size_t block = begin; block < end; ++block) {
        int32_t around[27];
        find_around(d, block, around);
        uint64_t planes[EDGE + 2];
        for (int i = 0; i < EDGE + 2; ++i) {
            const int n = i == 0 ? 0 : i == EDGE + 1 ? 18 : 9, x = (i + 7) & 7;
            const uint64_t own = open_row(d, around, n + 3, x);
            planes[i] = own | own << 8 | own >> 8 | open_row(d, around, n, x) >> 56 |
                        open_row(d, around, n + 6, x) << 56;
        }
        for (int x = 0; x < EDGE; ++x) {
            uint64_t rim = d->core[block][x] & (planes[x] | planes[x + 1] | planes[x + 2]);
            for (uint64_t left = rim; left != 0; left &= left - 1) {
                const int n = __builtin_ctzll(left);
                const bool unknown = d->feet[block * BLOCK * 3 + (size_t)(64 * x + n)] == VSHI_FOOT_UNKNOWN;
                rim ^= (uint64_t)unknown << n;
            }
            d->rim[block][x] = rim;
        }
    }
}

/* Gathers the feet of the rim within reach of a block's voxels, on one side of the surface. */
static void gather(const derivation *d, const int32_t around[27], bool inside, vshi_feet *points) {
    /* where a voxel's way to its foot enters the core, the rim is at most a cell's diagonal away */
    const float way = VSHI_COARSE_BAND + SLIDE_GAIN - d->fine->band / d->blocks.scale + 1.7321f;
    const int32_t margin = way < VSHI_FEET_MARGIN ? (int32_t)ceilf(way) : VSHI_FEET_MARGIN;
    points->count = 0;
    for (int n = 0; n < 27; ++n) {
        if (around[n] < 0) {
            continue;
        }
        const int step[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
        int low[3], high[3];
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = step[axis] < 0 ? EDGE - margin : 0;
            high[axis] = step[axis] > 0 ? margin - 1 : EDGE - 1;
        }
        const uint64_t along_z = (uint64_t)(0xff << low[2] & 0xff >> (7 - high[2])) * 0x0101010101010101u;
        const uint64_t box = along_z & ~(uint64_t)0 << 8 * low[1] & ~(uint64_t)0 >> (56 - 8 * high[1]);
        const int16_t *feet = d->feet + (size_t)around[n] * BLOCK * 3;
        for (int x = low[0]; x <= high[0]; ++x) {
            const uint64_t in = d->inside[around[n]][x];
            uint64_t left = d->rim[around[n]][x] & box & (inside ? in : ~in);
            for (; left != 0; left &= left - 1) {
                const int bit = __builtin_ctzll(left), v = 64 * x + bit;
                const size_t i = points->count++;
                points->x[i] = (float)(EDGE * step[0] + x) * VSHI_FOOT_STEPS + feet[v];
                points->y[i] = (float)(EDGE * step[1] + (bit >> 3)) * VSHI_FOOT_STEPS + feet[BLOCK + v];
                points->z[i] = (float)(EDGE * step[2] + (bit & 7)) * VSHI_FOOT_STEPS + feet[2 * BLOCK + v];
            }
        }
    }
    for (size_t i = points->count; i % VSHI_FEET_LANES != 0; ++i) {
        points->x[i] = points->y[i] = points->z[i] = 1e9f;
    }
}

/* Sets the distances of a block's voxels with a foot within the band and SLIDE_GAIN. */
static void settle(derivation *d, size_t block, const bits open) {
    const float scale = d->blocks.scale, step = scale / VSHI_FOOT_STEPS;
    const int16_t *feet = d->feet + block * BLOCK * 3;
    const int32_t *c = d->corners + 3 * block;
    for (int x = 0; x < EDGE; ++x) {
        for (uint64_t left = open[x]; left != 0; left &= left - 1) {
            const int n = __builtin_ctzll(left), v = 64 * x + n;
            if (feet[v] == VSHI_FOOT_UNKNOWN) {
                continue;
            }
            const float p[3] = {(float)(c[0] + x) * scale, (float)(c[1] + (n >> 3)) * scale,
                                (float)(c[2] + (n & 7)) * scale};
            float foot[3] = {p[0] + (float)feet[v] * step, p[1] + (float)feet[BLOCK + v] * step,
                             p[2] + (float)feet[2 * BLOCK + v] * step};
            if (distance_to(p, foot) > d->blocks.band + SLIDE_GAIN * scale) {
                continue;
            }
            int16_t *const value = d->blocks.values + block * BLOCK + v;
            const float sign = *value < 0 ? -1.0f : 1.0f, residue = slide(d->field, scale, p, foot);
            /* the foot lies off the surface by its residue, so the distance is wrong by as much */
            const float distance =
                distance_to(p, foot) + sign * (fabsf(residue) < MAX_RESIDUE ? residue : 0.0f);
            if (distance < d->blocks.band) {
                /* by the level below, the distance is at least that level's band */
                *value = blocks_value(&d->blocks, sign * fmaxf(distance, d->fine->band));
            }
            keep_foot(d, block, v, p, foot);
        }
    }
}

/* Finds the distances of voxels outside the core. */
static void reach_out(void *user, size_t begin, size_t end) {
    derivation *d = user;
    vshi_feet points;
    for (size_t block = begin; block < end; ++block) {
        bits open;
        int32_t around[27];
        find_around(d, block, around);
        for (int side = 0; side < 2; ++side) {
            uint64_t any = 0;
            for (int x = 0; x < EDGE; ++x) {
                const uint64_t inside = d->inside[block][x];
                open[x] = ~d->core[block][x] & (side != 0 ? inside : ~inside);
                any |= open[x];
            }
            if (any != 0) {
                gather(d, around, side != 0, &points);
                /* feet that may slide into the band, plus a step */
                const float most = (VSHI_COARSE_BAND + SLIDE_GAIN) * VSHI_FOOT_STEPS + 1.0f;
                d->nearest(&points, open, most, d->feet + block * BLOCK * 3);
            }
        }
        for (int x = 0; x < EDGE; ++x) {
            open[x] = ~d->core[block][x];
        }
        settle(d, block, open);
    }
}

/* --- the level */

/* Places the blocks of the new level that the band can reach from bricks below that hold the surface. */
static vsh_result place_blocks(derivation *d, vsh_error *error) {
    const vshi_level *fine = d->fine;
    vshi_blocks *b = &d->blocks;
    b->scale = 2.0f * fine->scale;
    vshi_blocks_set_band(b, VSHI_COARSE_BAND * b->scale);
    for (int axis = 0; axis < 3; ++axis) {
        const int32_t low = floor_div(fine->origin[axis], 16) * 8 - 8;
        const int32_t high = floor_div(fine->origin[axis] + 8 * fine->size[axis], 16) * 8 + 8;
        b->origin[axis] = low;
        b->size[axis] = (high - low) / 8 + 1;
    }
    const size_t total = vshi_block_index(b->size, b->size[0], 0, 0);
    VSHI_TRY(vshi_allocate((void **)&b->map, total, sizeof(int32_t), "field blocks", error));
    VSHI_TRY(vshi_allocate((void **)&b->signs, total, sizeof(int8_t), "field signs", error));
    const int32_t grow = (int32_t)VSHI_COARSE_BAND + 1;
    for (size_t n = 0; n < d->below.brick_count; ++n) {
        const int8_t *box = d->below.boxes + 6 * n;
        int32_t at[3], low[3], high[3];
        if (box[0] > box[3]) {
            continue;
        }
        vshi_block_corner(fine->origin, fine->size, (size_t)d->below.bricks[n], at);
        for (int axis = 0; axis < 3; ++axis) {
            low[axis] = floor_div(floor_div(at[axis] + box[axis], 2) - grow - b->origin[axis], 8);
            high[axis] = floor_div(floor_div(at[axis] + box[3 + axis] + 1, 2) + grow - b->origin[axis], 8);
            low[axis] = low[axis] > 0 ? low[axis] : 0;
            high[axis] = high[axis] < b->size[axis] - 1 ? high[axis] : b->size[axis] - 1;
        }
        for (int32_t i = low[0]; i <= high[0]; ++i) {
            for (int32_t j = low[1]; j <= high[1]; ++j) {
                for (int32_t k = low[2]; k <= high[2]; ++k) {
                    b->map[vshi_block_index(b->size, i, j, k)] = 1;
                }
            }
        }
    }
    for (size_t i = 0; i < total; ++i) {
        b->count += b->map[i] != 0;
    }
    VSHI_TRY(vshi_allocate((void **)&d->corners, b->count, 3 * sizeof(int32_t), "field blocks", error));
    int32_t number = 0;
    for (size_t i = 0; i < total; ++i) {
        int32_t corner[3];
        vshi_block_corner(b->origin, b->size, i, corner);
        if (b->map[i] != 0) {
            memcpy(d->corners + 3 * number, corner, sizeof corner);
            b->map[i] = number++;
        } else {
            const int32_t at[3] = {2 * corner[0], 2 * corner[1], 2 * corner[2]};
            b->map[i] = -1;
            b->signs[i] = fine_value(d, at) < 0.0f ? -1 : 1;
        }
    }
    return VSH_OK;
}

/* Allocates the voxels' arrays, and adds them to the budget. */
static vsh_result allocate_voxels(derivation *d, vshi_field_budget *budget, vsh_error *error) {
    const size_t count = d->blocks.count;
    const vshi_array arrays[] = {VSHI_ARRAY(d->blocks.values, count * BLOCK), VSHI_ARRAY(d->core, count),
                                 VSHI_ARRAY(d->inside, count), VSHI_ARRAY(d->rim, count),
                                 VSHI_ARRAY(d->feet, count * BLOCK * 3)};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; ++i) {
        budget->held += (double)arrays[i].count * (double)arrays[i].size;
    }
    VSHI_TRY(vshi_check_limit(budget->run, budget->held, "field", error));
    return VSHI_ALLOCATE_ALL(arrays, "field level", error);
}

vsh_result vshi_level_derive(vsh_field *field, vshi_below *below, vshi_field_budget budget, vshi_job *job,
                             vsh_error *error) {
    derivation d = {.field = field,
                    .fine = &field->levels[field->level_count - 1],
                    .below = *below,
                    .nearest = VSHI_KERNEL_OF(vshi_feet, budget.run->isa)};
    budget.held += (double)below->count * BLOCK * 3 * sizeof *below->feet +
                   (double)below->brick_count * (sizeof *below->bricks + 6);
    vshi_below next = {.bricks = NULL};
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(place_blocks(&d, error));
    VSHI_TRY_DONE(allocate_voxels(&d, &budget, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, copy_core, &d, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 64, 0, find_rim, &d, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, reach_out, &d, error));
    VSHI_TRY_DONE(append_level(field, &d.blocks, budget, job, &next, error));
    vshi_below_free(below);
    *below = next;
    below->count = d.blocks.count;
    below->map = d.blocks.map;
    below->feet = d.feet;
    d.blocks.map = NULL;
    d.feet = NULL;
done:
    free(d.feet);
    free(d.rim);
    free(d.inside);
    free(d.core);
    free(d.corners);
    free_blocks(&d.blocks);
    return result;
}
