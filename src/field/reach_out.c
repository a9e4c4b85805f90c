/* Distances of voxels that the level below does not know.
 *
 * The way to the nearest point of the surface (the foot) leads through the rim of what was taken over from
 * there, whose voxels know theirs: the nearest of those slides along the finest level's surface to where it
 * faces the voxel, which takes away what the lattice's spacing adds (kernel/feet.inc). */
#include "base/parallel.h"
#include "base/try.h"
#include "field/derive.h"

#include <math.h>

enum { EDGE = 8, BLOCK = 512 };

/* Slides by a voxel each bring a foot that is a band away nearer by no more than this with what is left of
 * VSHI_MAX_RESIDUE, voxels of its level: 2² / (2 · 6), and half a finest voxel. */
static const float SLIDE_GAIN = 0.6f;

static float distance_to(const float p[3], const float foot[3]) {
    const float x = p[0] - foot[0], y = p[1] - foot[1], z = p[2] - foot[2];
    return sqrtf(x * x + y * y + z * z);
}

/* Numbers of a block and of the 26 around it; -1: none. */
static void find_around(const vshi_derivation *d, size_t block, int32_t around[27]) {
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
static uint64_t open_row(const vshi_derivation *d, const int32_t around[27], int n, int x) {
    uint64_t open[3];
    for (int i = 0; i < 3; ++i) {
        open[i] = around[n + i] < 0 ? 0 : ~d->core[around[n + i]][x];
    }
    static const uint64_t first_z = 0x0101010101010101u;
    return open[1] | (open[1] << 1 & ~first_z) | (open[1] >> 1 & ~(first_z << 7)) | (open[0] >> 7 & first_z) |
           (open[2] & first_z) << 7;
}

static void find_rim(void *user, size_t begin, size_t end) {
    vshi_derivation *d = user;
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
static void gather(const vshi_derivation *d, const int32_t around[27], bool inside, vshi_feet *points) {
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

/* Lists the voxels of a block that know a foot within the band, and some more. */
static void list_slides(const vshi_derivation *d, size_t block, const vshi_bits open, vshi_slides *slides) {
    const float scale = d->blocks.scale, step = scale / VSHI_FOOT_STEPS;
    const int16_t *feet = d->feet + block * BLOCK * 3;
    const int32_t *c = d->corners + 3 * block;
    slides->count = 0;
    for (int x = 0; x < EDGE; ++x) {
        for (uint64_t left = open[x]; left != 0; left &= left - 1) {
            const int n = __builtin_ctzll(left), v = 64 * x + n;
            if (feet[v] == VSHI_FOOT_UNKNOWN) {
                continue;
            }
            const float p[3] = {(float)(c[0] + x) * scale, (float)(c[1] + (n >> 3)) * scale,
                                (float)(c[2] + (n & 7)) * scale};
            const float foot[3] = {p[0] + (float)feet[v] * step, p[1] + (float)feet[BLOCK + v] * step,
                                   p[2] + (float)feet[2 * BLOCK + v] * step};
            if (distance_to(p, foot) <= d->blocks.band + SLIDE_GAIN * scale) {
                vshi_slide_add(slides, p, foot, v);
            }
        }
    }
}

/* Distances of voxels from their feet. */
static void settle(vshi_derivation *d, size_t block, vshi_slides *slides) {
    d->kernel->slide(d->field, d->blocks.scale, slides);
    for (size_t i = 0; i < slides->count; ++i) {
        int16_t *const value = d->blocks.values + block * BLOCK + slides->voxel[i];
        const float p[3] = {slides->place[0][i], slides->place[1][i], slides->place[2][i]};
        const float foot[3] = {slides->foot[0][i], slides->foot[1][i], slides->foot[2][i]};
        const float sign = *value < 0 ? -1.0f : 1.0f, residue = slides->residue[i];
        /* a foot just outside the surface is nearer to p than the surface by that, for p outside */
        const float distance =
            distance_to(p, foot) + sign * (fabsf(residue) < VSHI_MAX_RESIDUE ? residue : 0.0f);
        if (distance < d->blocks.band) {
            /* the level below has said that it is at least its band away */
            *value = vshi_blocks_value(&d->blocks, sign * fmaxf(distance, d->fine->band));
        }
        vshi_foot_keep(d, block, slides, i);
    }
}

/* Distances of what is not of the core. */
static void reach_out(void *user, size_t begin, size_t end) {
    vshi_derivation *d = user;
    vshi_feet points;
    vshi_slides slides;
    for (size_t block = begin; block < end; ++block) {
        vshi_bits open;
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
                /* what may slide into the band, and a step */
                const float most = (VSHI_COARSE_BAND + SLIDE_GAIN) * VSHI_FOOT_STEPS + 1.0f;
                d->kernel->nearest(&points, open, most, d->feet + block * BLOCK * 3);
            }
        }
        for (int x = 0; x < EDGE; ++x) {
            open[x] = ~d->core[block][x];
        }
        list_slides(d, block, open, &slides);
        settle(d, block, &slides);
    }
}

vsh_result vshi_reach_out(vshi_derivation *d, vshi_job *job, vsh_error *error) {
    VSHI_TRY(vshi_parallel_for(job, d->blocks.count, 64, 0, find_rim, d, error));
    return vshi_parallel_for(job, d->blocks.count, 16, 0, reach_out, d, error);
}
