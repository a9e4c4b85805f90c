/* A coarser level out of the field so far.
 *
 * A lattice point of the new level is every second one of the level below, so where that one's band reaches,
 * values and signs are taken over as they are: signs of thin parts always come from the finest level. Farther
 * out the distance is that to the nearest point of the surface (its foot). Feet spread from voxel to voxel
 * (spread.c); then each slides along the finest level's surface to where it faces its voxel, which takes away
 * what the lattice's spacing adds. Fast sweeping (Zhao 2005) was worse here: its first-order upwind
 * differences leave distances 0.1 voxel too long, and too long is what makes a marcher step through a wall.
 */
#include "field/derive.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 512,
    SLIDES = 2 /* of a foot along the surface; the second is for curved ones */
};

/* A gradient shorter than this has no direction to follow: a crease of the medial axis. */
static const float MIN_GRADIENT = 0.25f;
/* A foot that ends farther off the finest level's zero, in its voxels, has slid off the surface. */
static const float MAX_RESIDUE = 0.5f;
/* A slide that would bring a foot nearer by less than this, in voxels of its level, is not worth its samples:
 * NODE of the kernels leaves room for 300 of them. */
static const float LEAST_GAIN = 1.0f / 1024.0f;
/* Slides by a voxel each bring a foot that is a band away nearer by no more than this with what is left of
 * MAX_RESIDUE, voxels of its level: 2² / (2 · 6), and half a finest voxel. */
static const float SLIDE_GAIN = 0.6f;

static int32_t floor_div(int32_t a, int32_t b) {
    return a / b - (a % b < 0);
}

static float distance_to(const float p[3], const float foot[3]) {
    const float x = p[0] - foot[0], y = p[1] - foot[1], z = p[2] - foot[2];
    return sqrtf(x * x + y * y + z * z);
}

/* A block of the level below: its brick, and its feet [3][512] where any are kept. */
typedef struct fine_block {
    const int16_t *brick; /* NULL outside the level: +band */
    const int16_t *feet;
} fine_block;

/* By the lattice coordinates of one of its voxels. */
static fine_block fine_block_at(const vshi_derivation *d, const int32_t at[3]) {
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

static float fine_value(const vshi_derivation *d, const int32_t at[3]) {
    const int16_t *brick = fine_block_at(d, at).brick;
    return brick == NULL
               ? d->fine->band
               : d->fine->quantum *
                     (float)brick[(at[0] & 7) * VSHI_STRIDE_X + (at[1] & 7) * VSHI_STRIDE_Y + (at[2] & 7)];
}

/* Foot of a finest lattice point of value h by one step down the gradient, from central differences. */
static void first_foot(const vshi_derivation *d, const int32_t at[3], float h, float foot[3]) {
    float g[3], length = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        int32_t a[3] = {at[0], at[1], at[2]}, b[3] = {at[0], at[1], at[2]};
        --a[axis];
        ++b[axis];
        g[axis] = 0.5f * (fine_value(d, b) - fine_value(d, a));
        length += g[axis] * g[axis];
    }
    length = sqrtf(length);
    for (int axis = 0; axis < 3; ++axis) {
        foot[axis] = length >= MIN_GRADIENT ? (float)at[axis] - h * g[axis] / length : NAN;
    }
}

/* Slides a foot along the finest level's surface until it faces p, by no more than a voxel of the level of
 * `scale` at a time; returns its distance to the surface's zero. */
static float slide(const vsh_field *field, const float p[3], float scale, float foot[3]) {
    float g[3];
    float residue = vshi_level_sample(field, 0, foot, g);
    for (int i = 0; i < SLIDES; ++i) {
        const float square = g[0] * g[0] + g[1] * g[1] + g[2] * g[2];
        if (square < MIN_GRADIENT * MIN_GRADIENT) {
            break;
        }
        const float v[3] = {p[0] - foot[0], p[1] - foot[1], p[2] - foot[2]};
        const float along = (v[0] * g[0] + v[1] * g[1] + v[2] * g[2]) / square;
        float lateral[3] = {v[0] - along * g[0], v[1] - along * g[1], v[2] - along * g[2]};
        const float length =
            sqrtf(lateral[0] * lateral[0] + lateral[1] * lateral[1] + lateral[2] * lateral[2]);
        /* what a right-angled triangle's longer leg is shorter than its hypotenuse */
        if (length * length < 2.0f * LEAST_GAIN * scale * distance_to(p, foot)) {
            break;
        }
        const float shorten = length > scale ? scale / length : 1.0f;
        float moved[3], moved_g[3];
        for (int axis = 0; axis < 3; ++axis) {
            moved[axis] = foot[axis] + shorten * lateral[axis];
        }
        const float off = vshi_level_sample(field, 0, moved, moved_g);
        const float moved_square =
            moved_g[0] * moved_g[0] + moved_g[1] * moved_g[1] + moved_g[2] * moved_g[2];
        if (moved_square < MIN_GRADIENT * MIN_GRADIENT) {
            break;
        }
        for (int axis = 0; axis < 3; ++axis) {
            moved[axis] -= off * moved_g[axis] / moved_square;
        }
        const float moved_residue = vshi_level_sample(field, 0, moved, moved_g);
        if (fabsf(moved_residue) > MAX_RESIDUE ||
            distance_to(p, moved) + fabsf(moved_residue) >= distance_to(p, foot) + fabsf(residue)) {
            break;
        }
        memcpy(foot, moved, sizeof moved);
        memcpy(g, moved_g, sizeof moved_g);
        residue = moved_residue;
    }
    return residue;
}

/* Keeps a foot of the voxel at p. Feet of core voxels, too, are within a band and a step of theirs. */
static void keep_foot(const vshi_derivation *d, const float p[3], const float foot[3], int16_t *feet) {
    const float steps = VSHI_FOOT_STEPS / d->blocks.scale;
    for (int axis = 0; axis < 3; ++axis) {
        feet[axis * BLOCK] = vshi_round((foot[axis] - p[axis]) * steps);
    }
}

/* One octant of a block: a block of the level below, every second voxel of it. Whether any foot is known. */
static bool take_octant(vshi_derivation *d, size_t block, int octant) {
    const int first[3] = {octant & 4, octant << 1 & 4, octant << 2 & 4};
    const int32_t *c = d->corners + 3 * block;
    const int32_t corner[3] = {2 * (c[0] + first[0]), 2 * (c[1] + first[1]), 2 * (c[2] + first[2])};
    const fine_block fine = fine_block_at(d, corner);
    bool any = false;
    for (int n = 0; n < 64; ++n) {
        const int x = n >> 4, y = n >> 2 & 3, z = n & 3;
        const size_t v = (size_t)((first[0] + x) * 64 + (first[1] + y) * 8 + first[2] + z);
        const float value =
            fine.brick == NULL
                ? d->fine->band
                : d->fine->quantum * (float)fine.brick[2 * (x * VSHI_STRIDE_X + y * VSHI_STRIDE_Y + z)];
        const bool core = fabsf(value) < d->fine->band;
        int16_t *const feet = d->feet + block * BLOCK * 3 + v;
        feet[0] = feet[BLOCK] = feet[2 * BLOCK] = VSHI_FOOT_UNKNOWN;
        d->core[block * BLOCK + v] = core;
        d->blocks.values[block * BLOCK + v] =
            core ? vshi_blocks_value(&d->blocks, value)
                 : (int16_t)(value < 0.0f ? -d->blocks.most : d->blocks.most);
        if (core && fine.feet != NULL) {
            const int16_t *const known = fine.feet + 2 * (x * 64 + y * 8 + z);
            if (known[0] != VSHI_FOOT_UNKNOWN) {
                for (int axis = 0; axis < 3; ++axis) {
                    feet[axis * BLOCK] = (int16_t)(known[axis * BLOCK] / 2);
                }
                any = true;
            }
        } else if (core && d->below.feet == NULL) {
            const int32_t at[3] = {corner[0] + 2 * x, corner[1] + 2 * y, corner[2] + 2 * z};
            const float p[3] = {(float)at[0], (float)at[1], (float)at[2]};
            float foot[3];
            first_foot(d, at, value, foot);
            if (!isnan(foot[0]) && fabsf(slide(d->field, p, 1.0f, foot)) <= MAX_RESIDUE) {
                keep_foot(d, p, foot, feet);
                any = true;
            }
        }
    }
    return any;
}

/* Takes over what the level below knows. */
static void take_core(void *user, size_t begin, size_t end) {
    vshi_derivation *d = user;
    for (size_t block = begin; block < end; ++block) {
        bool any = false;
        for (int octant = 0; octant < 8; ++octant) {
            any = take_octant(d, block, octant) || any;
        }
        d->seen[block] = -1;
        for (size_t i = 0; i < VSHI_FOOT_CHANGES; ++i) {
            d->changed[VSHI_FOOT_CHANGES * block + i] = any ? 0 : -1;
        }
    }
}

/* Distances from feet. */
static void settle(void *user, size_t begin, size_t end) {
    vshi_derivation *d = user;
    const float scale = d->blocks.scale, step = scale / VSHI_FOOT_STEPS;
    for (size_t block = begin; block < end; ++block) {
        const int32_t *c = d->corners + 3 * block;
        for (int v = 0; v < BLOCK; ++v) {
            int16_t *const feet = d->feet + block * BLOCK * 3 + v;
            int16_t *const value = d->blocks.values + block * BLOCK + v;
            if (d->core[block * BLOCK + (size_t)v] || feet[0] == VSHI_FOOT_UNKNOWN) {
                continue;
            }
            const float p[3] = {(float)(c[0] + v / 64) * scale, (float)(c[1] + v / 8 % 8) * scale,
                                (float)(c[2] + v % 8) * scale};
            float foot[3];
            for (int axis = 0; axis < 3; ++axis) {
                foot[axis] = p[axis] + (float)feet[axis * BLOCK] * step;
            }
            if (distance_to(p, foot) > d->blocks.band + SLIDE_GAIN * scale) {
                continue;
            }
            const float sign = *value < 0 ? -1.0f : 1.0f;
            const float residue = slide(d->field, p, scale, foot);
            /* a foot just outside the surface is nearer to p than the surface by that, for p outside */
            const float distance =
                distance_to(p, foot) + sign * (fabsf(residue) < MAX_RESIDUE ? residue : 0.0f);
            if (distance < d->blocks.band) {
                /* the level below has said that it is at least its band away */
                *value = vshi_blocks_value(&d->blocks, sign * fmaxf(distance, d->fine->band));
            }
            keep_foot(d, p, foot, feet);
        }
    }
}

/* Blocks of the new level that the band can reach: it grows by no more than its width from bricks below that
 * hold the surface itself. */
static vsh_result place_blocks(vshi_derivation *d, vsh_error *error) {
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
static vsh_result allocate_voxels(vshi_derivation *d, vshi_budget *budget, vsh_error *error) {
    const size_t count = d->blocks.count;
    const struct {
        void **memory;
        size_t size;
    } wanted[] = {
        {(void **)&d->blocks.values, BLOCK * sizeof *d->blocks.values},
        {(void **)&d->core, BLOCK},
        {(void **)&d->feet, BLOCK * 3 * sizeof *d->feet},
        {(void **)&d->changed, VSHI_FOOT_CHANGES * sizeof *d->changed},
        {(void **)&d->seen, sizeof *d->seen},
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
    vshi_derivation d = {.field = field, .fine = &field->levels[field->level_count - 1], .below = *below};
    budget.held += (double)below->count * BLOCK * 3 * sizeof *below->feet +
                   (double)below->brick_count * (sizeof *below->bricks + 6);
    vshi_below next = {.bricks = NULL};
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(place_blocks(&d, error));
    VSHI_TRY_DONE(allocate_voxels(&d, &budget, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, take_core, &d, error));
    VSHI_TRY_DONE(vshi_feet_spread(&d, job, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, settle, &d, error));
    VSHI_TRY_DONE(vshi_level_append(field, &d.blocks, budget, job, &next, error));
    vshi_below_free(below);
    *below = next;
    below->count = d.blocks.count;
    below->map = d.blocks.map;
    below->feet = d.feet;
    d.blocks.map = NULL;
    d.feet = NULL;
done:
    free(d.seen);
    free(d.changed);
    free(d.feet);
    free(d.core);
    free(d.corners);
    vshi_level_blocks_free(&d.blocks);
    return result;
}
