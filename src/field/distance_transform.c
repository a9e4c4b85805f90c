/* Nearest points of the surface (feet), spread from the voxels that know theirs over a level's band.
 *
 * A vector distance transform (Danielsson, "Euclidean distance mapping", 1980): a voxel takes a neighbour's
 * foot where that is nearer than its own. A block is swept along z, x and y, back and forth, with a voxel of
 * its neighbours around it, so that feet cross it at once. Groups of 4³ blocks, done one after the other
 * while they are in the cache, take turns by the parity of their place, so that none reads what another one
 * writes and threads do not show. That is done until nothing changes.
 * Then voxels look at all of their 26 neighbours, again until nothing changes: what sweeps lose where feet
 * come askew, and whatever shows of their order. */
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "field/derive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    EDGE = 8,
    HALO = 10, /* a block's edge with one voxel around it */
    BLOCK = 512,
    SWEEPS = 2,   /* rounds of them; a foot crosses a block in each, and bands are narrower than one */
    POLISHES = 8, /* rounds of looking at all neighbours, at most */
    CHANGES = VSHI_FOOT_CHANGES,
    TURNS = 8,
    GROUP = 4, /* blocks along an edge */
    GROUP_BLOCKS = GROUP * GROUP * GROUP
};

/* Vectors of the compiler's own: gcc 12 makes a branch of a condition where these are masks. */
enum { WIDTH = 4 };
typedef float floats __attribute__((vector_size(4 * WIDTH), aligned(4), may_alias));
typedef int32_t ints __attribute__((vector_size(4 * WIDTH), aligned(4), may_alias));

/* Planes that sweeps go over: of z, [x][y] with one voxel around, then of x and rows of y, [x][y][z] with one
 * around in x and y. Lanes that fill a plane up to whole vectors are never read. */
enum { PLANE_Z = 104, PLANE_X = HALO * EDGE };

/* From voxels to feet, by axis, in steps, and the squared lengths: of a core voxel -1, which nothing is
 * nearer than. */
typedef struct upright {
    float to[3][HALO * PLANE_Z], square[HALO * PLANE_Z];
} upright;
typedef struct flat {
    float to[3][HALO * PLANE_X], square[HALO * PLANE_X];
} flat;

static int32_t neighbour(const vshi_derivation *d, size_t block, int dx, int dy, int dz) {
    const vshi_blocks *b = &d->blocks;
    const int32_t *c = d->corners + 3 * block;
    const int32_t x = (c[0] - b->origin[0]) / EDGE + dx;
    const int32_t y = (c[1] - b->origin[1]) / EDGE + dy;
    const int32_t z = (c[2] - b->origin[2]) / EDGE + dz;
    if (x < 0 || y < 0 || z < 0 || x >= b->size[0] || y >= b->size[1] || z >= b->size[2]) {
        return -1;
    }
    return b->map[((size_t)x * (size_t)b->size[1] + (size_t)y) * (size_t)b->size[2] + (size_t)z];
}

/* Feet that are nearer by less than this part of the squared distance are not taken: sliding makes good for
 * that, and they would keep blocks at work that have long settled. */
#define NEARER (1.0f - 1.0f / 512.0f)

static inline void take(float *to, floats value, ints where) {
    *(floats *)to = (floats)((where & (ints)value) | (~where & *(ints *)to));
}

/* Gives `count` voxels from `at` on the feet of those that are `offset` further on in memory and (x, y, z)
 * voxels in space, where nearer. */
static inline void relax(float *const to[4], int at, int count, int offset, float x, float y, float z) {
    for (int i = at; i < at + count; i += WIDTH) {
        const floats a = *(const floats *)(to[0] + offset + i) + x * VSHI_FOOT_STEPS;
        const floats b = *(const floats *)(to[1] + offset + i) + y * VSHI_FOOT_STEPS;
        const floats c = *(const floats *)(to[2] + offset + i) + z * VSHI_FOOT_STEPS;
        floats *const square = (floats *)(to[3] + i);
        const floats length = a * a + (b * b + c * c);
        const ints nearer = length < *square * NEARER;
        take(to[0] + i, a, nearer);
        take(to[1] + i, b, nearer);
        take(to[2] + i, c, nearer);
        take(to[3] + i, length, nearer);
    }
}

/* The block's feet with those around it, upright. */
static void gather(const vshi_derivation *d, size_t block, const int32_t around[27], upright *u) {
    static const int16_t unknown[BLOCK * 3] = {[0 ... BLOCK * 3 - 1] = VSHI_FOOT_UNKNOWN};
    const int16_t *feet[27];
    for (int n = 0; n < 27; ++n) {
        feet[n] = around[n] >= 0 ? d->feet + (size_t)around[n] * BLOCK * 3 : unknown;
    }
    for (int axis = 0; axis < 3; ++axis) {
        for (int xy = 0; xy < HALO * HALO; ++xy) {
            const int x = xy / HALO + 7, y = xy % HALO + 7;
            const int16_t *const *const row = feet + x / EDGE * 9 + y / EDGE * 3;
            const int v = axis * BLOCK + (x & 7) * 64 + (y & 7) * EDGE;
            float *const to = u->to[axis] + xy;
            to[0] = row[0][v + 7];
            for (int z = 0; z < EDGE; ++z) {
                to[(z + 1) * PLANE_Z] = row[1][v + z];
            }
            to[(HALO - 1) * PLANE_Z] = row[2][v];
        }
        for (int z = 0; z < HALO; ++z) {
            for (int lane = HALO * HALO; lane < PLANE_Z; ++lane) {
                u->to[axis][z * PLANE_Z + lane] = VSHI_FOOT_UNKNOWN;
            }
        }
    }
    /* one voxel beyond the band, so that what lies just inside it has all its neighbours */
    static const float most = (VSHI_COARSE_BAND + 1.0f) * VSHI_FOOT_STEPS;
    for (int i = 0; i < HALO * PLANE_Z; ++i) {
        const float square =
            u->to[0][i] * u->to[0][i] + (u->to[1][i] * u->to[1][i] + u->to[2][i] * u->to[2][i]);
        u->square[i] = square < most * most ? square : most * most;
    }
    const uint8_t *core = d->core + block * BLOCK;
    for (int v = 0; v < BLOCK; ++v) {
        float *const square = &u->square[(v % 8 + 1) * PLANE_Z + (v / 64 + 1) * HALO + v / 8 % 8 + 1];
        *square = core[v] ? -1.0f : *square;
    }
}

static void lay_flat(const upright *u, flat *f) {
    for (int xy = 0; xy < HALO * HALO; ++xy) {
        for (int z = 0; z < EDGE; ++z) {
            const int to = xy * EDGE + z, from = (z + 1) * PLANE_Z + xy;
            f->to[0][to] = u->to[0][from];
            f->to[1][to] = u->to[1][from];
            f->to[2][to] = u->to[2][from];
            f->square[to] = u->square[from];
        }
    }
}

/* `up` is 1 or -1. */
static void sweep_z(upright *u, int up) {
    float *const to[4] = {u->to[0], u->to[1], u->to[2], u->square};
    const float back = (float)-up;
    for (int n = 0; n < EDGE; ++n) {
        const int plane = (up > 0 ? n + 1 : EDGE - n) * PLANE_Z, from = -up * PLANE_Z;
        relax(to, plane, PLANE_Z, from, 0.0f, 0.0f, back);
    }
}

static void sweep_x(flat *f, int up) {
    float *const to[4] = {f->to[0], f->to[1], f->to[2], f->square};
    const float back = (float)-up;
    for (int n = 0; n < EDGE; ++n) {
        const int plane = (up > 0 ? n + 1 : EDGE - n) * PLANE_X, from = -up * PLANE_X;
        relax(to, plane, PLANE_X, from, back, 0.0f, 0.0f);
    }
}

static void sweep_y(flat *f, int up) {
    float *const to[4] = {f->to[0], f->to[1], f->to[2], f->square};
    for (int n = 0; n < BLOCK / EDGE; ++n) {
        const int x = n / EDGE + 1, y = up > 0 ? n % EDGE + 1 : EDGE - n % EDGE;
        relax(to, x * PLANE_X + y * EDGE, EDGE, -up * EDGE, 0.0f, (float)-up, 0.0f);
    }
}

/* The block's voxels with the nearest of the feet that they and their 26 neighbours have. */
static void polish(const upright *u, flat *f) {
    /* core voxels keep theirs, and beyond the band nothing is asked of any */
    static const float far = (VSHI_COARSE_BAND + 0.5f) * VSHI_FOOT_STEPS;
    for (int row = 0; row < EDGE * EDGE; ++row) {
        const int x = row / EDGE + 1, z = row % EDGE + 1;
        for (int y = 1; y <= EDGE; y += WIDTH) {
            const int at = z * PLANE_Z + x * HALO + y;
            floats square = *(const floats *)(u->square + at);
            const ints open = (square >= 0.0f) & (square < far * far);
            const bool any = (open[0] | open[1] | open[2] | open[3]) != 0;
            ints chosen = {13, 13, 13, 13}; /* of the 27; where nothing is nearer, the voxel's own */
            for (int n = 0; any && n < 27; ++n) {
                const int dx = n / 9 - 1, dy = n / 3 % 3 - 1, dz = n % 3 - 1;
                const int from = at + dz * PLANE_Z + dx * HALO + dy;
                const floats i = *(const floats *)(u->to[0] + from) + (float)dx * VSHI_FOOT_STEPS;
                const floats j = *(const floats *)(u->to[1] + from) + (float)dy * VSHI_FOOT_STEPS;
                const floats k = *(const floats *)(u->to[2] + from) + (float)dz * VSHI_FOOT_STEPS;
                const floats length = i * i + (j * j + k * k);
                const ints nearer = length < square;
                square = (floats)((nearer & (ints)length) | (~nearer & (ints)square));
                chosen = (nearer & n) | (~nearer & chosen);
            }
            for (int lane = 0; lane < WIDTH; ++lane) {
                const int n = chosen[lane], dx = n / 9 - 1, dy = n / 3 % 3 - 1, dz = n % 3 - 1;
                const int from = at + lane + dz * PLANE_Z + dx * HALO + dy;
                const int to = x * PLANE_X + (y + lane) * EDGE + z - 1;
                f->to[0][to] = u->to[0][from] + (float)dx * VSHI_FOOT_STEPS;
                f->to[1][to] = u->to[1][from] + (float)dy * VSHI_FOOT_STEPS;
                f->to[2][to] = u->to[2][from] + (float)dz * VSHI_FOOT_STEPS;
            }
        }
    }
}

/* Writes the block's own feet back. A bit for each face next to which any has changed, and one for all. */
static int32_t scatter(vshi_derivation *d, size_t block, const flat *f) {
    int16_t differ[BLOCK] = {0};
    for (int axis = 0; axis < 3; ++axis) {
        int16_t *const feet = d->feet + (block * 3 + (size_t)axis) * BLOCK;
        for (int row = 0; row < 64; ++row) {
            const float *const from = f->to[axis] + (row / EDGE + 1) * PLANE_X + (row % EDGE + 1) * EDGE;
            for (int z = 0; z < EDGE; ++z) {
                const int16_t now = (int16_t)(int32_t)from[z];
                differ[row * EDGE + z] |= feet[row * EDGE + z] ^ now;
                feet[row * EDGE + z] = now;
            }
        }
    }
    int32_t faces = 0;
    for (int v = 0; v < BLOCK; ++v) {
        const int x = v / 64, y = v / EDGE % EDGE, z = v % EDGE;
        const int32_t next =
            (x == 0) | (x == 7) << 1 | (y == 0) << 2 | (y == 7) << 3 | (z == 0) << 4 | (z == 7) << 5 | 1 << 6;
        faces |= differ[v] != 0 ? next : 0;
    }
    return faces;
}

/* When the feet of a neighbour that touch the block last changed, `n` its place among the 27; no later than
 * what is returned, for edges and corners. */
static int32_t last_change(const vshi_derivation *d, int32_t number, int n) {
    const int towards[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
    int32_t last = n == 13 ? d->changed[CHANGES * number + 6] : INT32_MAX;
    for (int axis = 0; axis < 3; ++axis) {
        if (towards[axis] != 0) {
            /* of what lies above it the block touches the low side */
            const int32_t at = d->changed[CHANGES * number + 2 * axis + (towards[axis] < 0)];
            last = at < last ? at : last;
        }
    }
    return last;
}

/* A block's place in the order of work: by turn, then by group, then by number. */
enum { TURN_SHIFT = 57 };
typedef struct place {
    uint64_t key; /* of the group; its parity on top */
    size_t block;
} place;

static int by_key(const void *a, const void *b) {
    const place *const x = a, *const y = b;
    return x->key != y->key ? (x->key > y->key) - (x->key < y->key)
                            : (x->block > y->block) - (x->block < y->block);
}

static uint64_t place_key(const vshi_derivation *d, size_t block) {
    uint64_t group = 0, parity = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const uint64_t at = (uint64_t)(d->corners[3 * block + (size_t)axis] - d->blocks.origin[axis]) / EDGE;
        group =
            group << (TURN_SHIFT / 3) | at / GROUP; /* at most 2^27 voxels of a coarse level along a side */
        parity = parity << 1 | (at / GROUP & 1);
    }
    return parity << TURN_SHIFT | group;
}

typedef struct turn {
    vshi_derivation *d;
    const place *order;
    const size_t *groups; /* where those of this turn begin in `order`, and the end */
    int32_t number;       /* of the turn, from the start */
    int32_t begun;        /* what was seen before this is looked at again */
    bool all;             /* look at all neighbours, or sweep */
} turn;

static void visit(const turn *t, size_t block, int32_t now) {
    vshi_derivation *d = t->d;
    int32_t around[27];
    bool any = false, news = false;
    for (int n = 0; n < 27; ++n) {
        around[n] = neighbour(d, block, n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1);
        if (around[n] >= 0 && (n != 13 || t->all || d->seen[block] < 0)) {
            const int32_t last = last_change(d, around[n], n);
            any = any || last >= 0;
            news = news || last > d->seen[block];
        }
    }
    if (!news && !(any && d->seen[block] < t->begun)) {
        return;
    }
    upright u;
    flat f;
    gather(d, block, around, &u);
    if (t->all) {
        polish(&u, &f);
    } else {
        sweep_z(&u, 1);
        sweep_z(&u, -1);
        lay_flat(&u, &f);
        sweep_x(&f, 1);
        sweep_x(&f, -1);
        sweep_y(&f, 1);
        sweep_y(&f, -1);
    }
    d->seen[block] = now - 1; /* so that its own change is news */
    const int32_t faces = scatter(d, block, &f);
    for (size_t i = 0; i < CHANGES; ++i) {
        if ((faces >> i & 1) != 0) {
            d->changed[CHANGES * block + i] = now;
        }
    }
}

static void take_turn(void *user, size_t begin, size_t end) {
    const turn *t = user;
    for (size_t group = begin; group < end; ++group) {
        int32_t now = t->number * GROUP_BLOCKS;
        for (size_t i = t->groups[group]; i < t->groups[group + 1]; ++i) {
            visit(t, t->order[i].block, now++);
        }
    }
}

vsh_result vshi_feet_spread(vshi_derivation *d, vshi_job *job, vsh_error *error) {
    const size_t count = d->blocks.count;
    place *order = NULL;
    size_t *groups = NULL, first[TURNS + 1] = {0}, group_count = 0;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&order, count, sizeof *order, "field blocks", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&groups, count + 1, sizeof *groups, "field blocks", error));
    for (size_t block = 0; block < count; ++block) {
        order[block] = (place){place_key(d, block), block};
    }
    if (count > 0) { /* else there is no array */
        qsort(order, count, sizeof *order, by_key);
    }
    for (size_t i = 0; i < count; ++i) {
        if (i == 0 || order[i].key != order[i - 1].key) {
            groups[group_count++] = i;
            ++first[(order[i].key >> TURN_SHIFT) + 1];
        }
    }
    groups[group_count] = count;
    for (int p = 0; p < TURNS; ++p) {
        first[p + 1] += first[p];
    }
    int32_t number = 1, begun = 0;
    for (int all = 0; all < 2; ++all) {
        bool changed = count > 0;
        for (int round = 0; round < (all ? POLISHES : SWEEPS) && changed; ++round) {
            const int32_t start = number * GROUP_BLOCKS;
            begun = round > 0 ? begun : start - 1;
            for (int p = 0; p < TURNS; ++p) {
                turn t = {d, order, groups + first[p], number++, all != 0 ? begun : -1, all != 0};
                VSHI_TRY_DONE(vshi_parallel_for(job, first[p + 1] - first[p], 1, 0, take_turn, &t, error));
            }
            changed = false;
            for (size_t block = 0; block < count; ++block) {
                changed = changed || d->changed[CHANGES * block + 6] >= start;
            }
        }
    }
done:
    free(groups);
    free(order);
    return result;
}
