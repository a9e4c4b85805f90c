/* Volumes: voxels are shaded block by block, then voxels inside solids are filled.
 *
 * A block of 8³ voxels is a leaf of the grids. Its voxels are listed along a curve that fills it, so that
 * those that follow each other share proofs (shade/blocks.c). In free space a beam around all of a block's
 * cones comes first. If it proves them free or hidden, the block becomes a tile without a test of its voxels.
 */
#include "base/decimal.h"
#include "base/floats.h"
#include "base/memory.h"
#include "field/field.h"
#include "levelset/access.h"
#include "shade/query.h"
#include "shapes/heights.h"
#include "shapes/spheres.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/volume.h>

enum {
    GRAIN = 16, /* blocks of a piece of work: they march together */
    REACH = 4,  /* voxels: distance from which a voxel inside a solid takes a value */
    STEPS = 256 /* places within REACH */
};

/* Shares of the progress: filling is cheap. */
enum { SHADE_UNITS = 15, FILL_UNITS = 1 };

/* A place within REACH of a voxel. */
typedef struct fill_step {
    int8_t by[3];
    uint8_t square; /* squared length, voxels */
} fill_step;

typedef uint64_t voxel_mask[VSHI_MASK_WORDS];

typedef struct volume_bake {
    const vsh_occluders *occluders;
    const vsh_voxels *voxels;
    const vshi_block *blocks;
    size_t block_count;
    size_t light_count;
    vsh_volume_options options;
    bool normals;           /* the band of a surface */
    double half_axis[3][3]; /* of its voxels, world units */
    bool shadow_error, ao_error;
    size_t channel_count;
    vsh_query *query;
    vsh_run one;              /* for a piece: the calling thread, without progress */
    double caster_voxel_size; /* the largest of all fields, world units */
    vsh_volume *volume;
    voxel_mask *shaded, *filled;       /* [block_count] */
    fill_step steps[STEPS];            /* the nearest first */
    int first_step[REACH * REACH + 1]; /* the first step with at least this squared length */
    vshi_job *job;
    pthread_mutex_t lock; /* of the statistics */
    vsh_shade_stats stats;
} volume_bake;

/* --- the casters of the field and of the layers as one solid */

static void lower(float *distance, float other) {
    *distance = other < *distance ? other : *distance; /* NaN stays */
}

/* The nearest estimate, not the lower bound of vsh_field_sample(), as its differences give normals. */
static float sample_field(const vsh_field *field, const double position[3]) {
    const vshi_vec p = vshi_to_field(field, position);
    const bool known = vshi_finite(p) && !field->unknown;
    return known ? (float)(vshi_distance_at(field, p) * field->voxel_size) : NAN;
}

/* Signed distances, world units, to the nearest field or sphere at positions [count][3]. Heights have none.
 */
static void sample_solid(const volume_bake *bake, size_t count, const double *positions, float *distances) {
    const vsh_occluders *o = bake->occluders;
    for (size_t i = 0; i < count; ++i) {
        distances[i] = sample_field(o->field, positions + 3 * i);
    }
    for (size_t k = 0; k < o->layer_count; ++k) {
        const vshi_layer *layer = &o->layers[k];
        for (size_t i = 0; i < count && layer->heights == NULL; ++i) {
            /* the field of spheres, for rays of AO, may have no distances */
            const double *at = positions + 3 * i;
            lower(&distances[i], layer->spheres != NULL ? (float)vshi_spheres_distance(layer->spheres, at)
                                                        : sample_field(layer->field, at));
        }
    }
}

/* Lower bounds of the distances, which respect the boxes of heights: 0 within them. */
static void bound_solid(const volume_bake *bake, size_t count, const double *positions, float *distances) {
    const vsh_occluders *o = bake->occluders;
    sample_solid(bake, count, positions, distances);
    for (size_t h = 0; h < o->layer_count; ++h) {
        vshi_heights_info info;
        if (o->layers[h].heights == NULL) {
            continue;
        }
        vshi_heights_get_info(o->layers[h].heights, &info);
        for (size_t i = 0; i < count; ++i) {
            double square = 0.0;
            for (int axis = 0; axis < 3; ++axis) {
                const double p = positions[3 * i + (size_t)axis];
                const double off = fmax(info.bounds_min[axis] - p, p - info.bounds_max[axis]);
                square += off > 0.0 ? off * off : 0.0;
            }
            lower(&distances[i], (float)sqrt(square));
        }
    }
}

/* Whether a position is within heights. */
static bool is_buried(const volume_bake *bake, const double position[3]) {
    const vsh_occluders *o = bake->occluders;
    bool buries = false;
    for (size_t h = 0; h < o->layer_count && !buries; ++h) {
        buries = o->layers[h].heights != NULL && vshi_heights_hold(o->layers[h].heights, position);
    }
    return buries;
}

/* --- masks of a block's voxels */

static inline bool is_set(const uint64_t mask[VSHI_MASK_WORDS], size_t voxel) {
    return mask[voxel >> 6] >> (voxel & 63) & 1;
}

static inline void set_voxel(uint64_t mask[VSHI_MASK_WORDS], size_t voxel) {
    mask[voxel >> 6] |= (uint64_t)1 << (voxel & 63);
}

static uint64_t count_bits(const uint64_t mask[VSHI_MASK_WORDS]) {
    uint64_t count = 0;
    for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
        count += (uint64_t)__builtin_popcountll(mask[i]);
    }
    return count;
}

/* --- blocks */

/* A field's slope is 1, except between two equally near surfaces. There it has no direction. */
static const double FLAT = 0.1;

/* A true distance is at least this share of a sampled one, minus a finest voxel. A sample errs by up to 0.87
 * voxels of its level, and a level is used from 2.75 of its voxels on. */
static const double SURE = 0.65;

/* Voxels of a block on their way through the shading. */
typedef struct piece {
    size_t block, count;
    uint16_t voxel[VSHI_BLOCK_VOXELS];
    double centre[VSHI_BLOCK_VOXELS][3];
    float normal[VSHI_BLOCK_VOXELS][3];
    uint32_t texel[VSHI_BLOCK_VOXELS];
    float *values; /* [channels][VSHI_BLOCK_VOXELS] */
    float **to;    /* [channels], in `values`; NULL: known */
} piece;

/* Every third bit of three, beginning at the lowest. */
static uint16_t every_third(unsigned place) {
    return (uint16_t)((place & 1) | (place >> 2 & 2) | (place >> 4 & 4));
}

static void find_centres(const volume_bake *bake, size_t block, size_t count, const uint16_t *voxel,
                         double (*centre)[3]) {
    const int32_t *origin = bake->blocks[block].origin;
    for (size_t i = 0; i < count; ++i) {
        const int32_t at[3] = {origin[0] + (voxel[i] >> 6), origin[1] + (voxel[i] >> 3 & 7),
                               origin[2] + (voxel[i] & 7)};
        vshi_voxels_centre(bake->voxels, at, centre[i]);
    }
}

/* Lists the block's voxels along Morton's curve (1966): 4, 16 and 64 that follow each other lie close
 * together.
 */
static void list_voxels(const volume_bake *bake, piece *p) {
    p->count = 0;
    for (unsigned place = 0; place < VSHI_BLOCK_VOXELS; ++place) {
        const unsigned x = every_third(place >> 2), y = every_third(place >> 1), z = every_third(place);
        if (is_set(bake->blocks[p->block].mask, 64 * x + 8 * y + z)) {
            p->voxel[p->count++] = (uint16_t)(64 * x + 8 * y + z);
        }
    }
    find_centres(bake, p->block, p->count, p->voxel, p->centre);
}

/* Keeps voxel i as the next of `kept`. */
static void keep_voxel(piece *p, size_t *kept, size_t i) {
    p->voxel[*kept] = p->voxel[i];
    memmove(p->centre[(*kept)++], p->centre[i], sizeof p->centre[i]);
}

/* Keeps the voxels that are outside. */
static void keep_outside(const volume_bake *bake, piece *p) {
    float distance[VSHI_BLOCK_VOXELS];
    sample_solid(bake, p->count, &p->centre[0][0], distance);
    size_t kept = 0;
    for (size_t i = 0; i < p->count; ++i) {
        if (distance[i] >= 0.0f && !is_buried(bake, p->centre[i])) {
            keep_voxel(p, &kept, i);
        }
    }
    p->count = kept;
}

/* Finds normals by central differences along the lattice's axes. Keeps the voxels that have one. */
static void find_normals(const volume_bake *bake, piece *p) {
    double at[2][VSHI_BLOCK_VOXELS][3];
    float distance[2][VSHI_BLOCK_VOXELS];
    double slope[VSHI_BLOCK_VOXELS][3];
    for (int axis = 0; axis < 3; ++axis) {
        for (size_t i = 0; i < p->count; ++i) {
            for (int k = 0; k < 3; ++k) {
                at[0][i][k] = p->centre[i][k] - bake->half_axis[axis][k];
                at[1][i][k] = p->centre[i][k] + bake->half_axis[axis][k];
            }
        }
        for (int side = 0; side < 2; ++side) {
            sample_solid(bake, p->count, &at[side][0][0], distance[side]);
        }
        for (size_t i = 0; i < p->count; ++i) {
            slope[i][axis] = (double)distance[1][i] - (double)distance[0][i];
        }
    }
    const double *a = bake->half_axis[0];
    const double voxel = 2.0 * sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    size_t kept = 0;
    for (size_t i = 0; i < p->count; ++i) {
        const double *s = slope[i];
        if (!(sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) > FLAT * voxel)) {
            continue;
        }
        for (int k = 0; k < 3; ++k) {
            p->normal[kept][k] = (float)((s[0] * bake->half_axis[0][k] + s[1] * bake->half_axis[1][k] +
                                          s[2] * bake->half_axis[2][k]) /
                                         (voxel * voxel));
        }
        keep_voxel(p, &kept, i);
    }
    p->count = kept;
}

/* Numbers voxels for samplers by two coordinates. The third is added to both in steps, so that no plane of
 * voxels soon repeats another. */
static void number_voxels(const volume_bake *bake, piece *p) {
    static const uint32_t COLUMN_STEP = 47, ROW_STEP = 29;
    const int32_t *origin = bake->blocks[p->block].origin;
    for (size_t i = 0; i < p->count; ++i) {
        const uint32_t v = p->voxel[i];
        const uint32_t x = (uint32_t)origin[0] + (v >> 6), y = (uint32_t)origin[1] + (v >> 3 & 7);
        const uint32_t z = (uint32_t)origin[2] + (v & 7);
        p->texel[i] = ((x + COLUMN_STEP * z) & 0xffff) + 65536u * ((y + ROW_STEP * z) & 0xffff);
    }
}

/* Facts about a block before its voxels are tested: none, or all voxels are inside, or all are outside and
 * some channels have one value. */
typedef struct facts {
    bool inside, outside;
    int8_t *light; /* [lights]: VSHI_PROVED_… */
    bool open;     /* AO is 1 */
} facts;

/* Gives a channel of a block one value. Errors: VSH_ERROR_MEMORY. */
static vsh_result set_all(const volume_bake *bake, size_t channel, size_t block, float value,
                          vsh_error *error) {
    const uint64_t *mask = bake->blocks[block].mask;
    if (count_bits(mask) == VSHI_BLOCK_VOXELS) {
        vshi_volume_set_tile(bake->volume, channel, block, value);
        return VSH_OK;
    }
    float *leaf = vshi_volume_values(bake->volume, channel, block);
    for (size_t v = 0; leaf != NULL && v < VSHI_BLOCK_VOXELS; ++v) {
        leaf[v] = is_set(mask, v) ? value : leaf[v];
    }
    return leaf != NULL ? VSH_OK : vshi_fail_memory(error, "volume");
}

/* Sets the light of a channel, and whether it holds errors. Channels are the shadows of lights, AO, then
 * their errors. Returns whether the channel is a light's. */
static bool is_of_light(const volume_bake *bake, size_t channel, size_t *light, bool *error) {
    const size_t lights = bake->light_count, errors = lights + (bake->options.ao != 0);
    *error = channel >= errors;
    *light = *error ? channel - errors : channel;
    return *light < lights && (!*error || bake->shadow_error);
}

/* Whether all of a block has one value in a channel. */
static bool is_known(const volume_bake *bake, const facts *known, size_t channel, float *value) {
    size_t light;
    bool error;
    if (is_of_light(bake, channel, &light, &error)) {
        *value = !error && known->light[light] == VSHI_PROVED_FREE ? 1.0f : 0.0f;
        return known->light[light] != VSHI_UNPROVED;
    }
    *value = error ? 0.0f : 1.0f;
    return known->open;
}

/* Shades the unknown channels, and sets the known ones. Errors: VSH_ERROR_MEMORY. */
static vsh_result shade_piece(const volume_bake *bake, piece *p, const facts *known, vsh_shade_stats *stats,
                              vsh_error *error) {
    bool asked = false;
    for (size_t c = 0; c < bake->channel_count; ++c) {
        float value;
        p->to[c] = NULL;
        if (!is_known(bake, known, c, &value)) {
            p->to[c] = p->values + c * VSHI_BLOCK_VOXELS;
            asked = true;
        } else {
            VSHI_TRY(set_all(bake, c, p->block, value, error));
        }
    }
    if (!asked) {
        return VSH_OK;
    }
    number_voxels(bake, p);
    const bool ao = bake->options.ao != 0;
    const vsh_points points = {p->count, &p->centre[0][0], bake->normals ? &p->normal[0][0] : NULL, p->texel};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = p->to;
    output.shadow_error = bake->shadow_error ? p->to + bake->light_count + ao : NULL;
    output.ao = ao ? p->to[bake->light_count] : NULL;
    output.ao_error = bake->ao_error ? p->to[bake->channel_count - 1] : NULL;
    VSHI_TRY(vsh_query_points(bake->query, &points, NULL, &bake->one, &output, stats, error));
    for (size_t c = 0; c < bake->channel_count; ++c) {
        float *leaf = p->to[c] != NULL ? vshi_volume_values(bake->volume, c, p->block) : NULL;
        for (size_t i = 0; leaf != NULL && i < p->count; ++i) {
            leaf[p->voxel[i]] = p->to[c][i];
        }
        if (p->to[c] != NULL && leaf == NULL) {
            return vshi_fail_memory(error, "volume");
        }
    }
    return VSH_OK;
}

static vsh_result shade_block(const volume_bake *bake, piece *p, const facts *known, vsh_shade_stats *stats,
                              vsh_error *error) {
    uint64_t *shaded = bake->shaded[p->block];
    if (known->inside) {
        return VSH_OK;
    }
    list_voxels(bake, p);
    if (!known->outside) {
        keep_outside(bake, p);
    }
    if (bake->normals) {
        find_normals(bake, p);
    }
    for (size_t i = 0; i < p->count; ++i) {
        set_voxel(shaded, p->voxel[i]);
    }
    if (p->count > 0) {
        VSHI_TRY(shade_piece(bake, p, known, stats, error));
    }
    if (memcmp(shaded, bake->blocks[p->block].mask, sizeof *bake->shaded) == 0) {
        vshi_volume_settle(bake->volume, p->block, shaded); /* early: uniform blocks free their memory */
    }
    return VSH_OK;
}

/* A ball that holds the centres of all voxels of a block. */
static void find_ball(const volume_bake *bake, size_t block, double centre[3], double *radius) {
    const int32_t *low = bake->blocks[block].origin;
    const int32_t high[3] = {low[0] + 7, low[1] + 7, low[2] + 7};
    double corner[8][3];
    vshi_vec sum = {0.0, 0.0, 0.0};
    for (int i = 0; i < 8; ++i) {
        const int32_t at[3] = {(i & 1 ? high : low)[0], (i & 2 ? high : low)[1], (i & 4 ? high : low)[2]};
        vshi_voxels_centre(bake->voxels, at, corner[i]);
        sum = vshi_add(sum, vshi_vec_of(corner[i]));
    }
    const vshi_vec middle = vshi_scale(sum, 0.125);
    *radius = 0.0;
    for (int i = 0; i < 8; ++i) {
        *radius = fmax(*radius, vshi_length(vshi_sub(vshi_vec_of(corner[i]), middle)));
    }
    vshi_vec_to_doubles(middle, centre);
}

/* Finds facts by balls around the blocks, in free space. */
static void find_facts(const volume_bake *bake, size_t begin, size_t count, facts *known,
                       vsh_shade_stats *stats) {
    double centre[GRAIN][3] = {{0.0}}, radius[GRAIN];
    float distance[GRAIN];
    int8_t proof[GRAIN];
    for (size_t i = 0; i < count; ++i) {
        find_ball(bake, begin + i, centre[i], &radius[i]);
    }
    bound_solid(bake, count, &centre[0][0], distance);
    for (size_t i = 0; i < count; ++i) {
        const double sure = SURE * fabs((double)distance[i]) - bake->caster_voxel_size - radius[i];
        known[i].inside = sure > 0.0 && distance[i] < 0.0f;
        known[i].outside = sure > 0.0 && distance[i] > 0.0f;
        known[i].open = known[i].outside && sure > 2.0 * bake->options.shade.ao_distance;
    }
    for (size_t l = 0; l < bake->light_count; ++l) {
        vshi_query_prove(bake->query, bake->one.isa, l, count, centre, radius, proof, stats);
        for (size_t i = 0; i < count; ++i) {
            known[i].light[l] = known[i].outside ? proof[i] : VSHI_UNPROVED;
        }
    }
}

/* Shades GRAIN blocks. */
static vsh_result shade_blocks(void *user, size_t number, vsh_error *error) {
    volume_bake *bake = user;
    const size_t lights = bake->light_count, begin = number * GRAIN, left = bake->block_count - begin;
    const size_t count = left < GRAIN ? left : GRAIN;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    facts known[GRAIN] = {0};
    int8_t *proofs;
    piece p;
    const vshi_array arrays[] = {VSHI_ARRAY(p.values, bake->channel_count * VSHI_BLOCK_VOXELS),
                                 VSHI_ARRAY(p.to, bake->channel_count), VSHI_ARRAY(proofs, GRAIN * lights)};
    VSHI_TRY(VSHI_ALLOCATE_BLOCK(arrays, "volume", error));
    for (size_t i = 0; i < count; ++i) {
        known[i].light = proofs + i * lights;
    }
    if (!bake->normals) {
        find_facts(bake, begin, count, known, &stats);
    }
    vsh_result result = VSH_OK;
    for (p.block = begin; p.block < begin + count && result == VSH_OK; ++p.block) {
        result = shade_block(bake, &p, &known[p.block - begin], &stats, error);
    }
    free(p.values);
    /* in units, so that the order of threads changes no bit */
    stats.square_error = floor(stats.square_error / VSHI_SQUARE_UNIT) * VSHI_SQUARE_UNIT;
    stats.ao_square_error = floor(stats.ao_square_error / VSHI_SQUARE_UNIT) * VSHI_SQUARE_UNIT;
    pthread_mutex_lock(&bake->lock);
    vshi_shade_stats_add(&bake->stats, &stats);
    pthread_mutex_unlock(&bake->lock);
    vshi_job_advance(bake->job, SHADE_UNITS * count);
    return result;
}

/* --- filling: voxels inside solids take the value of the nearest shaded voxel */

/* A distance between voxels' corners may be too large by this, voxels of the finest level. */
static const double DISTANCE_ERROR = 0.87;

static int compare_steps(const void *left, const void *right) {
    const fill_step *a = left, *b = right;
    if (a->square != b->square) {
        return a->square < b->square ? -1 : 1;
    }
    for (int axis = 0; axis < 3; ++axis) { /* a fixed order among equal ones */
        if (a->by[axis] != b->by[axis]) {
            return a->by[axis] < b->by[axis] ? -1 : 1;
        }
    }
    return 0;
}

/* Lists the steps, and finds the first one of each length. */
static void list_steps(volume_bake *bake) {
    fill_step *steps = bake->steps;
    size_t count = 0;
    for (int x = -REACH; x <= REACH; ++x) {
        for (int y = -REACH; y <= REACH; ++y) {
            for (int z = -REACH; z <= REACH; ++z) {
                const int square = x * x + y * y + z * z;
                if (square > 0 && square <= REACH * REACH) {
                    steps[count++] = (fill_step){{(int8_t)x, (int8_t)y, (int8_t)z}, (uint8_t)square};
                }
            }
        }
    }
    qsort(steps, count, sizeof *steps, compare_steps);
    for (int square = 0, s = 0; square <= REACH * REACH; ++square) {
        while (s < STEPS && steps[s].square < square) {
            ++s;
        }
        bake->first_step[square] = s;
    }
}

static int compare_origins(const void *a, const void *b) {
    const vshi_block *x = a, *y = b;
    for (int axis = 0; axis < 3; ++axis) {
        if (x->origin[axis] != y->origin[axis]) {
            return x->origin[axis] < y->origin[axis] ? -1 : 1;
        }
    }
    return 0;
}

/* The numbers of the blocks around one, which is in the middle; SIZE_MAX: there is none. */
static void find_around(const volume_bake *bake, size_t block, size_t around[27]) {
    const int32_t *origin = bake->blocks[block].origin;
    for (int i = 0; i < 27; ++i) {
        const vshi_block at = {.origin = {origin[0] + 8 * (i / 9 - 1), origin[1] + 8 * (i / 3 % 3 - 1),
                                          origin[2] + 8 * (i % 3 - 1)}};
        const vshi_block *found = bsearch(&at, bake->blocks, bake->block_count, sizeof at, compare_origins);
        around[i] = found != NULL ? (size_t)(found - bake->blocks) : SIZE_MAX;
    }
}

/* Finds the nearest shaded voxel in reach, at least the root of `least` away: its block and number. */
static bool find_nearest(const volume_bake *bake, const size_t around[27], int voxel, int least,
                         size_t *block, int *nearest) {
    const int at[3] = {8 + (voxel >> 6), 8 + (voxel >> 3 & 7), 8 + (voxel & 7)};
    for (int s = bake->first_step[least]; s < STEPS; ++s) {
        const fill_step *step = &bake->steps[s];
        const int x = at[0] + step->by[0], y = at[1] + step->by[1], z = at[2] + step->by[2];
        *block = around[9 * (x >> 3) + 3 * (y >> 3) + (z >> 3)];
        *nearest = 64 * (x & 7) + 8 * (y & 7) + (z & 7);
        if (*block != SIZE_MAX && is_set(bake->shaded[*block], *nearest)) {
            return true;
        }
    }
    return false;
}

enum { NO_REACH = 255 };

/* Finds for each of these voxels the least squared distance to a shaded voxel, in voxels. The solid's
 * distance bounds it. NO_REACH means that no shaded voxel is close enough. */
static void find_reaches(const volume_bake *bake, size_t block, const uint16_t *voxel, size_t count,
                         uint8_t *reaches) {
    const double *size = bake->voxels->info.voxel_size, longest = fmax(size[0], fmax(size[1], size[2]));
    double centre[VSHI_BLOCK_VOXELS][3];
    float distance[VSHI_BLOCK_VOXELS];
    find_centres(bake, block, count, voxel, centre);
    sample_solid(bake, count, &centre[0][0], distance);
    for (size_t i = 0; i < count; ++i) {
        const double inside = -(double)distance[i] - DISTANCE_ERROR * bake->caster_voxel_size;
        const double least = inside > 0.0 ? inside / longest : 0.0; /* 0 without distances */
        reaches[i] = least <= REACH ? (uint8_t)ceil(least * least) : NO_REACH;
    }
}

static vsh_result fill_block(void *user, size_t block, vsh_error *error) {
    volume_bake *bake = user;
    uint16_t open[VSHI_BLOCK_VOXELS];
    uint8_t reaches[VSHI_BLOCK_VOXELS];
    size_t around[27], count = 0;
    for (size_t v = 0; v < VSHI_BLOCK_VOXELS; ++v) {
        if (is_set(bake->blocks[block].mask, v) && !is_set(bake->shaded[block], v)) {
            open[count++] = (uint16_t)v;
        }
    }
    if (count == 0 || bake->options.inside != VSH_INSIDE_NEAREST) {
        return VSH_OK;
    }
    find_around(bake, block, around);
    find_reaches(bake, block, open, count, reaches);
    for (size_t i = 0; i < count; ++i) {
        size_t from;
        int nearest;
        if (reaches[i] > REACH * REACH || !find_nearest(bake, around, open[i], reaches[i], &from, &nearest)) {
            continue;
        }
        for (size_t c = 0; c < bake->channel_count; ++c) {
            float *values = vshi_volume_values(bake->volume, c, block);
            if (values == NULL) {
                return vshi_fail_memory(error, "volume");
            }
            values[open[i]] = vshi_volume_value(bake->volume, c, from, nearest);
        }
        set_voxel(bake->filled[block], open[i]);
    }
    return VSH_OK;
}

/* --- the whole */

/* Settles the blocks that filling may have changed. */
static void settle_blocks(void *user, size_t begin, size_t end) {
    volume_bake *bake = user;
    for (size_t b = begin; b < end; ++b) {
        voxel_mask active;
        for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
            active[i] = bake->shaded[b][i] | bake->filled[b][i];
        }
        if (memcmp(bake->shaded[b], bake->blocks[b].mask, sizeof active) != 0) {
            vshi_volume_settle(bake->volume, b, active);
        }
    }
}

/* Fills and settles all blocks, and closes the volume. */
static vsh_result finish(volume_bake *bake, vsh_error *error) {
    vsh_volume_info counts = {0};
    VSHI_TRY(vshi_parallel_each(bake->job, bake->block_count, GRAIN, FILL_UNITS, fill_block, bake, error));
    VSHI_TRY(vshi_parallel_for(bake->job, bake->block_count, GRAIN, 0, settle_blocks, bake, error));
    for (size_t b = 0; b < bake->block_count; ++b) {
        const uint64_t shaded = count_bits(bake->shaded[b]), filled = count_bits(bake->filled[b]);
        counts.shaded += shaded;
        counts.filled += filled;
        counts.off += count_bits(bake->blocks[b].mask) - shaded - filled;
    }
    return vshi_volume_close(bake->volume, &counts, error);
}

/* Layers of heights or spheres have no voxels of their own. */
static void find_voxel_size(volume_bake *bake) {
    const vsh_occluders *o = bake->occluders;
    vsh_field_info info;
    vsh_field_get_info(o->field, &info);
    bake->caster_voxel_size = info.voxel_size;
    for (size_t i = 0; i < o->layer_count; ++i) {
        if (o->layers[i].spheres == NULL && o->layers[i].heights == NULL) {
            vsh_field_get_info(o->layers[i].field, &info);
            bake->caster_voxel_size = fmax(bake->caster_voxel_size, info.voxel_size);
        }
    }
}

static void find_half_axes(volume_bake *bake) {
    double centre[3], next[3];
    const int32_t *index = bake->blocks[0].origin;
    vshi_voxels_centre(bake->voxels, index, centre);
    for (int axis = 0; axis < 3; ++axis) {
        int32_t beside[3] = {index[0], index[1], index[2]};
        ++beside[axis];
        vshi_voxels_centre(bake->voxels, beside, next);
        for (int k = 0; k < 3; ++k) {
            bake->half_axis[axis][k] = 0.5 * (next[k] - centre[k]);
        }
    }
}

/* Fills the channel of each grid, in the order of vsh_volume. */
static void describe(const volume_bake *bake, const vsh_light *lights, vshi_channel *channels) {
    VSHI_NUMBERS;
    vsh_field_info casters;
    vsh_field_get_info(bake->occluders->field, &casters);
    const vsh_shade_options *shade = &bake->options.shade;
    const bool triangles = bake->occluders->triangles != NULL;
    for (size_t i = 0; i < bake->channel_count; ++i) {
        vshi_channel *c = &channels[i];
        size_t l;
        bool error;
        c->caster_voxel_size = casters.voxel_size;
        if (is_of_light(bake, i, &l, &error)) {
            const char *name = lights[l].name;
            c->method = vsh_get_name(VSH_NAMES_SHADOW, vshi_shadow_method_resolve(shade->method, triangles));
            snprintf(c->name, sizeof c->name, "%s.%s", error ? "error" : "shadow", name);
            snprintf(c->description, sizeof c->description, "%s light '%s', 1 lit, 0 dark",
                     error ? "standard error of the visible fraction of" : "visible fraction of", name);
            vsh_light_text(&lights[l], c->light, sizeof c->light);
        } else {
            c->method = vsh_get_name(VSH_NAMES_AO, vshi_ao_method_resolve(shade->ao_method, triangles));
            snprintf(c->name, sizeof c->name, "%s", error ? "error.ao" : "ao");
            snprintf(c->description, sizeof c->description, "%s within %g, 1 open, 0 closed",
                     error ? "standard error of ambient occlusion" : "ambient occlusion", shade->ao_distance);
        }
    }
}

/* Begins the volume, and allocates the masks. Errors: as vshi_volume_begin(). Free both even after an
 * error. */
static vsh_result begin(volume_bake *bake, const vsh_light *lights, const vsh_run *run, vsh_error *error) {
    const vshi_triangles *triangles = bake->occluders->triangles;
    const double held = vshi_occluders_bytes(bake->occluders) +
                        (triangles != NULL ? (double)vshi_triangles_bytes(triangles) : 0.0) +
                        2.0 * (double)bake->block_count * sizeof *bake->shaded;
    vshi_channel *channels = NULL;
    VSHI_TRY(vshi_allocate((void **)&channels, bake->channel_count, sizeof *channels, "volume", error));
    describe(bake, lights, channels);
    const vsh_result result =
        vshi_volume_begin(bake->voxels, channels, bake->channel_count, run, held, &bake->volume, error);
    free(channels);
    VSHI_TRY(result);
    list_steps(bake);
    const vshi_array masks[] = {VSHI_ARRAY(bake->shaded, bake->block_count),
                                VSHI_ARRAY(bake->filled, bake->block_count)};
    return VSHI_ALLOCATE_BLOCK(masks, "volume", error);
}

static vsh_result bake_all(volume_bake *bake, const vsh_light *lights, const vsh_run *run, vsh_error *error) {
    const size_t units = (SHADE_UNITS + FILL_UNITS) * bake->block_count;
    const size_t pieces = (bake->block_count + GRAIN - 1) / GRAIN;
    vsh_result result;
    VSHI_TRY(vshi_job_open(&bake->job, run, "volume", units, "volume", error));
    VSHI_TRY_DONE(begin(bake, lights, run, error));
    VSHI_TRY_DONE(vshi_parallel_each(bake->job, pieces, 1, 0, shade_blocks, bake, error));
    result = finish(bake, error);
done:
    free(bake->shaded); /* the block's first array */
    vshi_job_end(bake->job);
    return result;
}

/* Lights name their grids. */
static vsh_result check_names(const vsh_light *lights, size_t count, vsh_error *error) {
    for (size_t l = 0; l < count; ++l) {
        if (lights[l].name[0] == '\0') {
            return vshi_fail(error, VSH_ERROR_ARGUMENT, "light %zu: no name, which its grid is named after",
                             l);
        }
        for (size_t k = 0; k < l; ++k) {
            if (strcmp(lights[k].name, lights[l].name) == 0) {
                return vshi_fail(error, VSH_ERROR_ARGUMENT, "lights %zu and %zu are both named '%s'", k, l,
                                 lights[l].name);
            }
        }
    }
    return VSH_OK;
}

/* Checks options and lights, and makes the query. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result prepare(volume_bake *bake, const vsh_light *lights, vsh_error *error) {
    vsh_volume_options *options = &bake->options;
    vsh_shade_options shade;
    VSHI_TRY(vshi_shade_options_resolve(&options->shade, &shade, error));
    options->shade = shade;
    if (vsh_get_name(VSH_NAMES_INSIDE, options->inside) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "inside %d: expected %d … %d", options->inside, 0,
                         VSH_INSIDE_OFF);
    }
    if (bake->light_count == 0 && options->ao == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "volume: nothing to bake: no lights and no AO");
    }
    if (bake->occluders->field->unknown) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "volume: the occluders have no voxels, which tell what is inside");
    }
    const bool ao = options->ao != 0;
    bake->shadow_error = options->error != 0 && bake->light_count > 0 && vshi_shadow_has_rays(&shade);
    bake->ao_error = options->error != 0 && ao && vshi_ao_has_rays(&shade);
    bake->channel_count = bake->light_count * (bake->shadow_error ? 2 : 1) + ao + bake->ao_error;
    if (!ao) { /* another method may need missing voxels or triangles */
        shade.ao_method = VSH_AO_CONES;
    }
    const bool around = !bake->normals && ao; /* AO over all directions */
    VSHI_TRY(
        vshi_query_create(bake->occluders, lights, bake->light_count, &shade, around, &bake->query, error));
    return check_names(lights, bake->light_count, error);
}

void vsh_voxels_get_info(const vsh_voxels *voxels, vsh_voxels_info *info) {
    *info = voxels->info;
}

vsh_result vsh_bake_volume(const vsh_occluders *occluders, const vsh_voxels *voxels, const vsh_light *lights,
                           size_t light_count, const vsh_volume_options *options, const vsh_run *run,
                           vsh_volume **volume, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_MAKES(volume);
    VSHI_NEEDS_BOTH(occluders, voxels);
    VSHI_NEEDS_OF(light_count, lights);
    vsh_run full;
    volume_bake bake = {.occluders = occluders,
                        .voxels = voxels,
                        .light_count = light_count,
                        .options = vsh_volume_options_default(),
                        .one = vsh_run_default(),
                        .lock = PTHREAD_MUTEX_INITIALIZER,
                        .stats = vsh_shade_stats_zero()};
    vsh_result result;
    VSHI_TRY(vshi_options_resolve(options, &bake.options, sizeof bake.options, "vsh_volume_options", error));
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    bake.one.threads = 1;
    bake.one.isa = full.isa;
    bake.normals = voxels->info.has_normals != 0;
    bake.blocks = voxels->blocks;
    bake.block_count = voxels->info.blocks;
    find_half_axes(&bake);
    find_voxel_size(&bake);
    VSHI_TRY_DONE(prepare(&bake, lights, error));
    result = bake_all(&bake, lights, &full, error);
    if (stats != NULL) {
        vshi_shade_stats_add(stats, &bake.stats);
    }
    if (result == VSH_OK) {
        *volume = bake.volume;
        bake.volume = NULL;
    }
done:
    vsh_volume_free(bake.volume);
    vsh_query_free(bake.query);
    return result;
}
