/* A coarser level out of the field so far.
 *
 * A lattice point of the new level is every second one of the level below, so where that one's band reaches,
 * values and signs are taken over as they are: signs of thin parts always come from the finest level. Farther
 * out the distance is that to the nearest point of the surface (its foot). Feet that spread from
 * voxel to voxel (Danielsson, "Euclidean distance mapping", 1980) take several times as long and are no
 * nearer. Fast sweeping (Zhao 2005) was worse here: its first-order upwind differences leave distances 0.1
 * voxel too long, and too long is what makes a marcher step through a wall.
 */
#include "field/kernel/feet.h"
#include "field/level.h"

#include "base/isa.h"
#include "base/memory.h"
#include "base/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { EDGE = 8, BLOCK = 512 };

/* One bit a voxel of a block: word x, bit y · 8 + z. */
typedef uint64_t bits[8];

/* A gradient shorter than this has no direction to follow: a crease of the medial axis. */
static const float MIN_GRADIENT = 0.25f;
/* A foot that ends farther off the finest level's zero, in its voxels, has slid off the surface. */
static const float MAX_RESIDUE = 0.5f;

/* A coarser level while it is derived. */
typedef struct derivation {
    const vsh_field *field;
    const vshi_level *fine; /* the level below */
    vshi_below below;       /* and what is kept of it */
    vshi_blocks blocks;     /* of the new level */
    int32_t *corners;       /* [count][3], lattice coordinates of each block's first voxel */
    bits *core;             /* [count]: value taken from the level below */
    bits *inside;           /* [count]: negative */
    bits *rim;              /* [count]: core voxels that know their feet and touch others */
    int16_t *feet;          /* [count][3][512], as vshi_below.feet */
    vshi_nearest_fn *nearest;
} derivation;

/* Keeps the foot of a voxel of a block. Feet of core voxels, too, are within a band and a step of theirs. */
static void keep_foot(const derivation *d, size_t block, int voxel, const float p[3], const float foot[3]) {
    const float steps = VSHI_FOOT_STEPS / d->blocks.scale;
    for (int axis = 0; axis < 3; ++axis) {
        d->feet[(block * 3 + (size_t)axis) * BLOCK + (size_t)voxel] =
            vshi_round((foot[axis] - p[axis]) * steps);
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
    /* A slide that would bring a foot nearer by less than this, in voxels of its level, is not worth its
     * samples: VSHI_NODE leaves room for 300 of them. */
    const float LEAST_GAIN = 1.0f / 1024.0f;
    float g[3], residue = vshi_level_sample(field, 0, foot, g);
    for (int i = 0; i < SLIDES; ++i) {
        const float v[3] = {p[0] - foot[0], p[1] - foot[1], p[2] - foot[2]}, square = dot(g, g);
        float lateral[3], moved[3], moved_g[3];
        for (int axis = 0; axis < 3; ++axis) {
            lateral[axis] = v[axis] - dot(v, g) / square * g[axis];
        }
        const float length = sqrtf(dot(lateral, lateral)), before = sqrtf(dot(v, v));
        /* a right-angled triangle's longer leg is about this much shorter than its hypotenuse */
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

/* A block of the level below: its brick, and its feet [3][512] where any are kept. */
typedef struct fine_block {
    const int16_t *brick; /* NULL outside the level: +band */
    const int16_t *feet;
} fine_block;

/* By the lattice coordinates of one of its voxels. */
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
    const size_t block =
        ((size_t)(v[0] >> 3) * (size_t)fine->size[1] + (size_t)(v[1] >> 3)) * (size_t)fine->size[2] +
        (size_t)(v[2] >> 3);
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

/* Foot of a finest lattice point of value h, by one step down the gradient, from central differences. */
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

/* One octant of a block: a block of the level below, every second voxel of it. Of a block all of whose feet
 * are unknown and whose bits are 0. */
static void take_octant(derivation *d, size_t block, int octant) {
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
        *to = vshi_blocks_value(&d->blocks, value);
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

/* Takes over what the level below knows. */
static void take_core(void *user, size_t begin, size_t end) {
    derivation *d = user;
    for (size_t i = begin * 3 * BLOCK; i < end * 3 * BLOCK; ++i) {
        d->feet[i] = VSHI_FOOT_UNKNOWN;
    }
    for (size_t block = begin; block < end; ++block) {
        for (int octant = 0; octant < 8; ++octant) {
            take_octant(d, block, octant);
        }
    }
}

/* --- distances of voxels that the level below does not know */

/* The line from a voxel to its foot passes the rim of the core, whose voxels know their feet. The nearest of
 * these slides along the finest level's surface until it faces the voxel. That removes the error of the
 * lattice's spacing. */

/* The most that two slides of a voxel each bring a foot nearer that is a band away, voxels of its level: 2² /
 * (2 · 6), and half a finest voxel of residue. */
static const float SLIDE_GAIN = 0.6f;

/* Numbers of a block and of the 26 around it; -1: none. */
static void find_around(const derivation *d, size_t block, int32_t around[27]) {
    const vshi_blocks *b = &d->blocks;
    int32_t at[3];
    for (int axis = 0; axis < 3; ++axis) {
        at[axis] = (d->corners[3 * block + (size_t)axis] - b->origin[axis]) / EDGE;
    }
    for (int n = 0; n < 27; ++n) {
        const int32_t x = at[0] + n / 9 - 1, y = at[1] + n / 3 % 3 - 1, z = at[2] + n % 3 - 1;
        const bool there = x >= 0 && y >= 0 && z >= 0 && x < b->size[0] && y < b->size[1] && z < b->size[2];
        around[n] =
            there ? b->map[((size_t)x * (size_t)b->size[1] + (size_t)y) * (size_t)b->size[2] + (size_t)z]
                  : -1;
    }
}

/* A plane of voxels that are not of the core, with what touches them along z; `n` the first of three blocks
 * along z. */
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

/* The feet of the rim within reach of a block's voxels, on their side of the surface. */
static void gather(const derivation *d, const int32_t around[27], bool inside, vshi_feet *points) {
    /* a voxel's way to its foot enters the core where that ends: there the rim is a cell's diagonal away */
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

/* Distances of a block's voxels that know a foot within the band, and some more. */
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
            /* a foot just outside the surface is nearer to p than the surface by that, for p outside */
            const float distance =
                distance_to(p, foot) + sign * (fabsf(residue) < MAX_RESIDUE ? residue : 0.0f);
            if (distance < d->blocks.band) {
                /* the level below has said that it is at least its band away */
                *value = vshi_blocks_value(&d->blocks, sign * fmaxf(distance, d->fine->band));
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
                /* feet that may slide into the band, and a step */
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

/* Blocks of the new level that the band can reach: it grows by no more than its width from bricks below that
 * hold the surface itself. */
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
    const size_t total = (size_t)b->size[0] * (size_t)b->size[1] * (size_t)b->size[2];
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
                    b->map[((size_t)i * (size_t)b->size[1] + (size_t)j) * (size_t)b->size[2] + (size_t)k] = 1;
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

/* Adds what it takes to the budget. */
static vsh_result allocate_voxels(derivation *d, vshi_budget *budget, vsh_error *error) {
    const size_t count = d->blocks.count;
    const struct {
        void **memory;
        size_t size;
    } wanted[] = {
        {(void **)&d->blocks.values, BLOCK * sizeof *d->blocks.values},
        {(void **)&d->core, sizeof *d->core},
        {(void **)&d->inside, sizeof *d->inside},
        {(void **)&d->rim, sizeof *d->rim},
        {(void **)&d->feet, BLOCK * 3 * sizeof *d->feet},
    };
    const size_t wanted_count = sizeof wanted / sizeof wanted[0];
    for (size_t i = 0; i < wanted_count; ++i) {
        budget->held += (double)count * (double)wanted[i].size;
    }
    VSHI_TRY(vshi_check_limit(budget->run, budget->held, "field", error));
    for (size_t i = 0; i < wanted_count; ++i) {
        VSHI_TRY(vshi_allocate(wanted[i].memory, count, wanted[i].size, "field level", error));
    }
    return VSH_OK;
}

vsh_result vshi_level_derive(vsh_field *field, vshi_below *below, vshi_budget budget, vshi_job *job,
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
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, take_core, &d, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 64, 0, find_rim, &d, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, reach_out, &d, error));
    VSHI_TRY_DONE(vshi_level_append(field, &d.blocks, budget, job, &next, error));
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
    vshi_level_blocks_free(&d.blocks);
    return result;
}
