/* A coarser level out of the field so far.
 *
 * A lattice point of the new level is every second one of the level below, so where that one's band reaches,
 * values and signs are taken over as they are: signs of thin parts always come from the finest level. Farther
 * out the distance is that to the nearest point of the surface (its foot, reach_out.c). Feet that spread from
 * voxel to voxel (Danielsson, "Euclidean distance mapping", 1980) take several times as long and are no
 * nearer. Fast sweeping (Zhao 2005) was worse here: its first-order upwind differences leave distances 0.1
 * voxel too long, and too long is what makes a marcher step through a wall.
 */
#include "field/derive.h"

#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BLOCK = 512 };

static int32_t floor_div(int32_t a, int32_t b) {
    return a / b - (a % b < 0);
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

/* Foot of a finest lattice point in a brick, of value h, by one step down the gradient, from central
 * differences. Coordinates are even, so that the next point lies in the brick. */
static void first_foot(const vshi_derivation *d, const int32_t at[3], const int16_t *brick, float h,
                       float foot[3]) {
    static const int stride[3] = {VSHI_STRIDE_X, VSHI_STRIDE_Y, 1};
    const int16_t *const here =
        brick + (at[0] & 7) * VSHI_STRIDE_X + (at[1] & 7) * VSHI_STRIDE_Y + (at[2] & 7);
    float g[3], length = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        int32_t before[3] = {at[0], at[1], at[2]};
        --before[axis];
        const float low =
            (at[axis] & 7) != 0 ? d->fine->quantum * (float)here[-stride[axis]] : fine_value(d, before);
        g[axis] = 0.5f * (d->fine->quantum * (float)here[stride[axis]] - low);
        length += g[axis] * g[axis];
    }
    length = sqrtf(length);
    for (int axis = 0; axis < 3; ++axis) {
        foot[axis] = length >= VSHI_MIN_GRADIENT ? (float)at[axis] - h * g[axis] / length : NAN;
    }
}

/* One octant of a block: a block of the level below, every second voxel of it. Of a block all of whose feet
 * are unknown and whose bits are 0. */
static void take_octant(vshi_derivation *d, size_t block, int octant, vshi_slides *slides) {
    const int first[3] = {octant & 4, octant << 1 & 4, octant << 2 & 4};
    const int32_t *c = d->corners + 3 * block;
    const int32_t corner[3] = {2 * (c[0] + first[0]), 2 * (c[1] + first[1]), 2 * (c[2] + first[2])};
    const fine_block fine = fine_block_at(d, corner);
    const int16_t *const outside = d->field->values + d->fine->first_value;
    const int16_t *const brick = fine.brick == NULL ? outside : fine.brick;
    if (brick == outside || brick == outside + VSHI_BRICK_VALUES) { /* far away on one side */
        const bool inside = brick != outside;
        for (int row = 0; row < 16; ++row) {
            const int word = first[0] + row / 4, bit = (first[1] + row % 4) * 8 + first[2];
            int16_t *const values = d->blocks.values + block * BLOCK + (size_t)(word * 64 + bit);
            for (int z = 0; z < 4; ++z) {
                values[z] = (int16_t)(inside ? -d->blocks.most : d->blocks.most);
            }
            d->inside[block][word] |= (uint64_t)(inside ? 0xf : 0) << bit;
        }
        return;
    }
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
            first_foot(d, at, brick, value, foot);
            if (!isnan(foot[0])) {
                vshi_slide_add(slides, p, foot, (int)v);
            }
        }
    }
}

/* Takes over what the level below knows. */
static void take_core(void *user, size_t begin, size_t end) {
    vshi_derivation *d = user;
    vshi_slides slides;
    for (size_t block = begin; block < end; ++block) {
        slides.count = 0;
        for (size_t i = 0; i < 3 * BLOCK; ++i) {
            d->feet[block * 3 * BLOCK + i] = VSHI_FOOT_UNKNOWN;
        }
        for (int octant = 0; octant < 8; ++octant) {
            take_octant(d, block, octant, &slides);
        }
        d->kernel->slide(d->field, 1.0f, &slides);
        for (size_t i = 0; i < slides.count; ++i) {
            if (fabsf(slides.residue[i]) <= VSHI_MAX_RESIDUE) {
                vshi_foot_keep(d, block, &slides, i);
            }
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
    vshi_derivation d = {.field = field,
                         .fine = &field->levels[field->level_count - 1],
                         .below = *below,
                         .kernel = vshi_feet_kernel_of(budget.run->isa)};
    budget.held += (double)below->count * BLOCK * 3 * sizeof *below->feet +
                   (double)below->brick_count * (sizeof *below->bricks + 6);
    vshi_below next = {.bricks = NULL};
    vsh_result result = VSH_OK;
    VSHI_TRY_DONE(place_blocks(&d, error));
    VSHI_TRY_DONE(allocate_voxels(&d, &budget, error));
    VSHI_TRY_DONE(vshi_parallel_for(job, d.blocks.count, 16, 0, take_core, &d, error));
    VSHI_TRY_DONE(vshi_reach_out(&d, job, error));
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
