/* A coarser level out of the field so far.
 *
 * A lattice point of the new level is every second one of the level below, so where that one's band reaches,
 * values and signs are taken over as they are: signs of thin parts always come from the finest level. Farther
 * out the distance is that to the nearest point of the surface (its foot). Feet spread from voxel to voxel,
 * as in a vector distance transform (Danielsson, "Euclidean distance mapping", 1980), in rounds that read the
 * last round only, so that threads do not show. Then each foot slides along the finest level's surface to
 * where it faces its voxel, which takes away what the lattice's spacing adds. Fast sweeping (Zhao 2005) was
 * worse here: its first-order upwind differences leave distances 0.1 voxel too long, and too long is what
 * makes a marcher step through a wall. */
#include "base/memory.h"
#include "base/parallel.h"
#include "field/level.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 512,
    HALO = 10,       /* a block's edge with one voxel around it */
    MAX_ROUNDS = 16, /* a foot travels one voxel a round; the band is 6 wide */
    SLIDES = 2       /* of a foot along the surface; the second is for curved ones */
};

/* A gradient shorter than this has no direction to follow: a crease of the medial axis. */
static const float MIN_GRADIENT = 0.25f;
/* A foot that ends farther off the finest level's zero, in its voxels, has slid off the surface. */
static const float MAX_RESIDUE = 0.5f;

typedef struct derivation {
    const vsh_field *field;
    const vshi_level *fine;
    vshi_feet fine_feet; /* none where it is the finest */
    vshi_blocks blocks;  /* of the new level */
    int32_t *corners;    /* [count][3], lattice coordinates of each block's first voxel */
    uint8_t *core;       /* [count][512]: value taken from the level below */
    float *feet;         /* [count][512][3], of the last round */
    float *next_feet;
    uint8_t *changed; /* [count], in the last round */
    uint8_t *next_changed;
} derivation;

static int32_t floor_div(int32_t a, int32_t b) {
    return a / b - (a % b < 0);
}

static float distance_to(const float p[3], const float foot[3]) {
    const float x = p[0] - foot[0], y = p[1] - foot[1], z = p[2] - foot[2];
    return sqrtf(x * x + y * y + z * z);
}

/* Value of the level below at one of its lattice points, and where its foot is kept (NULL: nowhere). */
static float fine_value(const derivation *d, const int32_t at[3], const float **foot) {
    const vshi_level *fine = d->fine;
    int32_t v[3];
    for (int axis = 0; axis < 3; ++axis) {
        v[axis] = at[axis] - fine->origin[axis];
        if (v[axis] < 0 || v[axis] >= 8 * fine->size[axis]) {
            return fine->band;
        }
    }
    const size_t block =
        ((size_t)(v[0] >> 3) * (size_t)fine->size[1] + (size_t)(v[1] >> 3)) * (size_t)fine->size[2] +
        (size_t)(v[2] >> 3);
    const int x = v[0] & 7, y = v[1] & 7, z = v[2] & 7;
    if (foot != NULL && d->fine_feet.points != NULL && d->fine_feet.map[block] >= 0) {
        *foot = d->fine_feet.points +
                ((size_t)d->fine_feet.map[block] * BLOCK + (size_t)(x * 64 + y * 8 + z)) * 3;
    }
    const int16_t *brick = d->field->values + d->field->index[fine->first_index + block];
    return fine->quantum * (float)brick[x * VSHI_STRIDE_X + y * VSHI_STRIDE_Y + z];
}

/* Foot of a finest lattice point of value h by one step down the gradient, from central differences. */
static void first_foot(const derivation *d, const float p[3], float h, float foot[3]) {
    float g[3], length = 0.0f;
    for (int axis = 0; axis < 3; ++axis) {
        float a[3] = {p[0], p[1], p[2]}, b[3] = {p[0], p[1], p[2]};
        a[axis] -= 1.0f;
        b[axis] += 1.0f;
        g[axis] = 0.5f * (vshi_level_sample(d->field, 0, b, NULL) - vshi_level_sample(d->field, 0, a, NULL));
        length += g[axis] * g[axis];
    }
    length = sqrtf(length);
    for (int axis = 0; axis < 3; ++axis) {
        foot[axis] = length >= MIN_GRADIENT ? p[axis] - h * g[axis] / length : NAN;
    }
}

/* Slides a foot along the finest level's surface until it faces p; returns its distance to the surface's
 * zero. */
static float slide(const vsh_field *field, const float p[3], float reach, float foot[3]) {
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
        const float shorten = length > reach ? reach / length : 1.0f;
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

static void voxel_position(const derivation *d, size_t block, int voxel, float p[3]) {
    const int32_t *c = d->corners + 3 * block;
    p[0] = (float)(c[0] + voxel / 64) * d->blocks.scale;
    p[1] = (float)(c[1] + voxel / 8 % 8) * d->blocks.scale;
    p[2] = (float)(c[2] + voxel % 8) * d->blocks.scale;
}

/* Takes over what the level below knows. */
static void take_core(void *user, size_t begin, size_t end) {
    derivation *d = user;
    for (size_t block = begin; block < end; ++block) {
        const int32_t *c = d->corners + 3 * block;
        for (int v = 0; v < BLOCK; ++v) {
            const int32_t at[3] = {2 * (c[0] + v / 64), 2 * (c[1] + v / 8 % 8), 2 * (c[2] + v % 8)};
            const size_t i = block * BLOCK + (size_t)v;
            const float *known = NULL;
            const float value = fine_value(d, at, &known);
            float *foot = d->feet + 3 * i;
            foot[0] = foot[1] = foot[2] = NAN;
            d->core[i] = fabsf(value) < d->fine->band;
            d->blocks.values[i] =
                vshi_blocks_value(&d->blocks, d->core[i] ? value : copysignf(d->blocks.band, value));
            if (d->core[i]) {
                float p[3];
                voxel_position(d, block, v, p);
                if (d->fine_feet.points != NULL) {
                    memcpy(foot, known != NULL ? known : foot, 3 * sizeof(float));
                } else {
                    first_foot(d, p, value, foot);
                    if (!isnan(foot[0]) && fabsf(slide(d->field, p, 1.0f, foot)) > MAX_RESIDUE) {
                        foot[0] = foot[1] = foot[2] = NAN;
                    }
                }
            }
        }
        memcpy(d->next_feet + block * BLOCK * 3, d->feet + block * BLOCK * 3, BLOCK * 3 * sizeof(float));
        d->changed[block] = 1;
    }
}

static int32_t neighbour(const derivation *d, size_t block, int dx, int dy, int dz) {
    const vshi_blocks *b = &d->blocks;
    const int32_t *c = d->corners + 3 * block;
    const int32_t x = (c[0] - b->origin[0]) / 8 + dx;
    const int32_t y = (c[1] - b->origin[1]) / 8 + dy;
    const int32_t z = (c[2] - b->origin[2]) / 8 + dz;
    if (x < 0 || y < 0 || z < 0 || x >= b->size[0] || y >= b->size[1] || z >= b->size[2]) {
        return -1;
    }
    return b->map[((size_t)x * (size_t)b->size[1] + (size_t)y) * (size_t)b->size[2] + (size_t)z];
}

/* A block's feet of the last round with one voxel around, by axis. */
typedef struct halo {
    float x[HALO * HALO * HALO], y[HALO * HALO * HALO], z[HALO * HALO * HALO];
} halo;

/* False where nothing in or around the block has changed since. */
static bool gather_halo(const derivation *d, size_t block, halo *h) {
    int32_t around[27];
    bool changed = false;
    for (int n = 0; n < 27; ++n) {
        around[n] = neighbour(d, block, n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
        changed = changed || (around[n] >= 0 && d->changed[around[n]]);
    }
    if (!changed) {
        return false;
    }
    for (int x = 0; x < HALO; ++x) {
        for (int y = 0; y < HALO; ++y) {
            for (int z = 0; z < HALO; ++z) {
                const int32_t from = around[(x + 7) / 8 * 9 + (y + 7) / 8 * 3 + (z + 7) / 8];
                const int v = ((x + 7) & 7) * 64 + ((y + 7) & 7) * 8 + ((z + 7) & 7);
                const float *foot = d->feet + ((size_t)(from >= 0 ? from : 0) * BLOCK + (size_t)v) * 3;
                const int to = (x * HALO + y) * HALO + z;
                h->x[to] = from >= 0 ? foot[0] : NAN;
                h->y[to] = from >= 0 ? foot[1] : NAN;
                h->z[to] = from >= 0 ? foot[2] : NAN;
            }
        }
    }
    return true;
}

/* A plane of a block in the halo: from its first voxel to its last, with the halo's voxels between the rows.
 */
enum { PLANE_FIRST = HALO + 1, PLANE = 7 * HALO + 8 };

/* For the voxels of a plane, the first of which is at `first` of the halo and at p: where in the halo the
 * nearest foot within `reach` is; -1: none. Of equally near ones a voxel's own is kept, so that rounds come
 * to rest. */
static void nearest_feet(const halo *h, const float p[3], float scale, float reach, int first,
                         int32_t from[PLANE]) {
    float best[PLANE], y[PLANE], z[PLANE];
    for (int i = 0; i < PLANE; ++i) {
        best[i] = reach * reach;
        y[i] = p[1] + (float)(i / HALO) * scale;
        z[i] = p[2] + (float)(i % HALO) * scale;
        from[i] = -1;
    }
    for (int n = 0; n < 27; ++n) {
        const int k = (n + 13) % 27; /* the voxel itself first */
        const int at = first + ((k / 9 - 1) * HALO + k / 3 % 3 - 1) * HALO + k % 3 - 1;
        for (int i = 0; i < PLANE; ++i) {
            const float a = p[0] - h->x[at + i], b = y[i] - h->y[at + i], c = z[i] - h->z[at + i];
            const float square = a * a + b * b + c * c;
            /* NaN is not nearer; a mask and not a condition, of which gcc 12 makes a branch */
            const int32_t nearer = -(square < best[i]);
            best[i] = square < best[i] ? square : best[i];
            from[i] = (nearer & (at + i)) | (~nearer & from[i]);
        }
    }
}

/* One round: each voxel outside the core takes the nearest of the feet that it and its neighbours know. */
static void spread(void *user, size_t begin, size_t end) {
    derivation *d = user;
    /* one voxel beyond the band, so that what lies just inside it has all its neighbours */
    const float reach = d->blocks.band + d->blocks.scale;
    for (size_t block = begin; block < end; ++block) {
        halo h;
        d->next_changed[block] = 0;
        if (!gather_halo(d, block, &h)) {
            continue;
        }
        for (int plane = 0; plane < 8; ++plane) {
            const int first = (plane + 1) * HALO * HALO + PLANE_FIRST;
            float p[3];
            int32_t from[PLANE];
            voxel_position(d, block, 64 * plane, p);
            nearest_feet(&h, p, d->blocks.scale, reach, first, from);
            for (int v = 0; v < 64; ++v) {
                const size_t voxel = block * BLOCK + (size_t)(64 * plane + v);
                const int at = v / 8 * HALO + v % 8;
                if (d->core[voxel]) {
                    continue;
                }
                const int32_t taken = from[at] >= 0 ? from[at] : first + at;
                d->next_feet[3 * voxel] = h.x[taken];
                d->next_feet[3 * voxel + 1] = h.y[taken];
                d->next_feet[3 * voxel + 2] = h.z[taken];
                d->next_changed[block] |= taken != first + at;
            }
        }
    }
}

/* Distances from feet. */
static void settle(void *user, size_t begin, size_t end) {
    derivation *d = user;
    for (size_t block = begin; block < end; ++block) {
        for (int v = 0; v < BLOCK; ++v) {
            const size_t i = block * BLOCK + (size_t)v;
            float *foot = d->feet + 3 * i;
            if (d->core[i] || isnan(foot[0])) {
                continue;
            }
            float p[3];
            voxel_position(d, block, v, p);
            const float sign = d->blocks.values[i] < 0 ? -1.0f : 1.0f;
            const float residue = slide(d->field, p, d->blocks.scale, foot);
            /* a foot just outside the surface is nearer to p than the surface by that, for p outside */
            const float distance =
                distance_to(p, foot) + sign * (fabsf(residue) < MAX_RESIDUE ? residue : 0.0f);
            if (distance < d->blocks.band) {
                /* the level below has said that it is at least its band away */
                d->blocks.values[i] = vshi_blocks_value(&d->blocks, sign * fmaxf(distance, d->fine->band));
            }
        }
    }
}

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
    vsh_result result = vshi_allocate((void **)&b->map, total, sizeof(int32_t), "field blocks", error);
    if (result == VSH_OK) {
        result = vshi_allocate((void **)&b->signs, total, sizeof(int8_t), "field signs", error);
    }
    if (result != VSH_OK) {
        return result;
    }
    const int32_t grow = (int32_t)VSHI_COARSE_BAND + 1;
    size_t fine_block = (size_t)fine->first_index;
    for (int32_t x = 0; x < fine->size[0]; ++x) {
        for (int32_t y = 0; y < fine->size[1]; ++y) {
            for (int32_t z = 0; z < fine->size[2]; ++z, ++fine_block) {
                const int16_t *brick = d->field->values + d->field->index[fine_block];
                /* cells of the surface have corners within a cell's diagonal of it */
                const float near = 1.75f * fine->scale / fine->quantum;
                bool surface = false;
                for (int v = 0; v < VSHI_BRICK_VALUES && !surface; ++v) {
                    surface = fabsf((float)brick[v]) < near;
                }
                if (!surface) {
                    continue;
                }
                const int32_t at[3] = {fine->origin[0] + 8 * x, fine->origin[1] + 8 * y,
                                       fine->origin[2] + 8 * z};
                int32_t low[3], high[3];
                for (int axis = 0; axis < 3; ++axis) {
                    low[axis] = floor_div(floor_div(at[axis], 2) - grow - b->origin[axis], 8);
                    high[axis] = floor_div(floor_div(at[axis] + 9, 2) + grow - b->origin[axis], 8);
                    low[axis] = low[axis] > 0 ? low[axis] : 0;
                    high[axis] = high[axis] < b->size[axis] - 1 ? high[axis] : b->size[axis] - 1;
                }
                for (int32_t i = low[0]; i <= high[0]; ++i) {
                    for (int32_t j = low[1]; j <= high[1]; ++j) {
                        for (int32_t k = low[2]; k <= high[2]; ++k) {
                            b->map[((size_t)i * (size_t)b->size[1] + (size_t)j) * (size_t)b->size[2] +
                                   (size_t)k] = 1;
                        }
                    }
                }
            }
        }
    }
    for (size_t i = 0; i < total; ++i) {
        b->count += b->map[i] != 0;
    }
    result = vshi_allocate((void **)&d->corners, b->count, 3 * sizeof(int32_t), "field blocks", error);
    if (result != VSH_OK) {
        return result;
    }
    int32_t number = 0;
    const size_t plane = (size_t)b->size[1] * (size_t)b->size[2];
    for (size_t i = 0; i < total; ++i) {
        const int32_t corner[3] = {b->origin[0] + 8 * (int32_t)(i / plane),
                                   b->origin[1] + 8 * (int32_t)(i % plane / (size_t)b->size[2]),
                                   b->origin[2] + 8 * (int32_t)(i % (size_t)b->size[2])};
        if (b->map[i] != 0) {
            memcpy(d->corners + 3 * number, corner, sizeof corner);
            b->map[i] = number++;
        } else {
            const int32_t at[3] = {2 * corner[0], 2 * corner[1], 2 * corner[2]};
            b->map[i] = -1;
            b->signs[i] = fine_value(d, at, NULL) < 0.0f ? -1 : 1;
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
        {(void **)&d->core, BLOCK},
        {(void **)&d->feet, BLOCK * 3 * sizeof(float)},
        {(void **)&d->next_feet, BLOCK * 3 * sizeof(float)},
        {(void **)&d->changed, 1},
        {(void **)&d->next_changed, 1},
    };
    const size_t wanted_count = sizeof wanted / sizeof wanted[0];
    for (size_t i = 0; i < wanted_count; ++i) {
        budget->held += (double)count * (double)wanted[i].size;
    }
    vsh_result result = vshi_check_limit(budget->run, budget->held, "field", error);
    for (size_t i = 0; i < wanted_count && result == VSH_OK; ++i) {
        result = vshi_allocate(wanted[i].memory, count, wanted[i].size, "field level", error);
    }
    return result;
}

void vshi_feet_free(vshi_feet *feet) {
    free(feet->points);
    free(feet->map);
    *feet = (vshi_feet){0, NULL, NULL};
}

vsh_result vshi_level_derive(vsh_field *field, vshi_feet *feet, vshi_budget budget, vshi_job *job,
                             vsh_error *error) {
    derivation d = {.field = field, .fine = &field->levels[field->level_count - 1], .fine_feet = *feet};
    budget.held += (double)feet->count * BLOCK * 3 * sizeof(float);
    vsh_result result = place_blocks(&d, error);
    if (result == VSH_OK) {
        result = allocate_voxels(&d, &budget, error);
    }
    if (result == VSH_OK) {
        result = vshi_parallel_for(job, d.blocks.count, 16, 0, take_core, &d, error);
    }
    for (int round = 0; round < MAX_ROUNDS && result == VSH_OK; ++round) {
        result = vshi_parallel_for(job, d.blocks.count, 16, 0, spread, &d, error);
        float *swap_feet = d.feet;
        d.feet = d.next_feet;
        d.next_feet = swap_feet;
        uint8_t *swap_changed = d.changed;
        d.changed = d.next_changed;
        d.next_changed = swap_changed;
        if (d.blocks.count == 0 || memchr(d.changed, 1, d.blocks.count) == NULL) {
            break;
        }
    }
    if (result == VSH_OK) {
        result = vshi_parallel_for(job, d.blocks.count, 16, 0, settle, &d, error);
    }
    if (result == VSH_OK) {
        result = vshi_level_append(field, &d.blocks, budget, job, error);
    }
    vshi_feet_free(feet);
    if (result == VSH_OK) {
        *feet = (vshi_feet){d.blocks.count, d.blocks.map, d.feet};
        d.blocks.map = NULL;
        d.feet = NULL;
    }
    free(d.next_changed);
    free(d.changed);
    free(d.next_feet);
    free(d.feet);
    free(d.core);
    free(d.corners);
    vshi_level_blocks_free(&d.blocks);
    return result;
}
