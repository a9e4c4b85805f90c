/* A block of 8³ voxels is a leaf of the grids. Its voxels are listed along a curve that fills it, so that
 * those that follow each other share proofs (shade/blocks.c); in free space a beam around all of a block's
 * cones comes first, and where it proves them free or hidden the block is one tile and no voxel is looked at.
 */
#include "volume/volume_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A field's slope is 1, but for where two surfaces are equally near: there it has no direction. */
static const double FLAT = 0.1;

/* Share of a distance that is sure, beyond a finest voxel: a sample is good to 0.87 voxels of its level,
 * which is taken from 2.75 of them on. */
static const double SURE = 0.65;

/* Voxels of a block on their way through the shading. */
typedef struct piece {
    size_t count;
    uint16_t voxel[VSHI_BLOCK_VOXELS];
    double centre[VSHI_BLOCK_VOXELS][3];
    float normal[VSHI_BLOCK_VOXELS][3];
    uint32_t texel[VSHI_BLOCK_VOXELS];
} piece;

/* Every third bit of three, beginning at the lowest. */
static uint16_t every_third(unsigned place) {
    return (uint16_t)((place & 1) | (place >> 2 & 2) | (place >> 4 & 4));
}

/* The block's voxels along Morton's curve (1966): 4, 16 and 64 that follow each other lie close together. */
static void list_voxels(const vshi_block *block, piece *p) {
    p->count = 0;
    for (unsigned place = 0; place < VSHI_BLOCK_VOXELS; ++place) {
        const unsigned x = every_third(place >> 2), y = every_third(place >> 1), z = every_third(place);
        if (block->mask[x] >> (8 * y + z) & 1) {
            p->voxel[p->count++] = (uint16_t)(64 * x + 8 * y + z);
        }
    }
}

/* Keeps the voxels that are outside. */
static void keep_outside(const vshi_volume_bake *bake, piece *p) {
    float distance[VSHI_BLOCK_VOXELS];
    vshi_solid_sample(&bake->solid, p->count, &p->centre[0][0], distance);
    size_t kept = 0;
    for (size_t i = 0; i < p->count; ++i) {
        if (distance[i] >= 0.0f && !vshi_solid_buries(&bake->solid, p->centre[i])) {
            p->voxel[kept] = p->voxel[i];
            memmove(p->centre[kept++], p->centre[i], sizeof p->centre[i]);
        }
    }
    p->count = kept;
}

/* Normals by central differences along the lattice's axes; keeps the voxels that have one. */
static void find_normals(const vshi_volume_bake *bake, piece *p) {
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
            vshi_solid_sample(&bake->solid, p->count, &at[side][0][0], distance[side]);
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
        p->voxel[kept] = p->voxel[i];
        memmove(p->centre[kept++], p->centre[i], sizeof p->centre[i]);
    }
    p->count = kept;
}

/* Samplers tell points apart by two coordinates: the third goes into both, by steps that no plane of voxels
 * repeats soon. */
static void number_voxels(const vshi_block *block, piece *p) {
    static const uint32_t COLUMN_STEP = 47, ROW_STEP = 29;
    for (size_t i = 0; i < p->count; ++i) {
        const uint32_t v = p->voxel[i];
        const uint32_t x = (uint32_t)block->origin[0] + (v >> 6),
                       y = (uint32_t)block->origin[1] + (v >> 3 & 7);
        const uint32_t z = (uint32_t)block->origin[2] + (v & 7);
        p->texel[i] = ((x + COLUMN_STEP * z) & 0xffff) + 65536u * ((y + ROW_STEP * z) & 0xffff);
    }
}

/* What is known of a block before its voxels are looked at: nothing, or that all are inside, or outside and
 * some channels one value. */
typedef struct facts {
    bool inside, outside;
    int8_t *light; /* [lights]: VSHI_PROVED_… */
    bool open;     /* of AO */
} facts;

static inline bool is_full(const uint64_t mask[VSHI_MASK_WORDS]) {
    uint64_t all = ~(uint64_t)0;
    for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
        all &= mask[i];
    }
    return all == ~(uint64_t)0;
}

/* Gives a channel of a block one value. False where memory is short. */
static bool set_all(vshi_volume_bake *bake, size_t channel, size_t block, float value) {
    const uint64_t *mask = bake->blocks[block].mask;
    if (is_full(mask)) {
        vshi_volume_set_tile(bake->volume, channel, block, value);
        return true;
    }
    float *leaf = vshi_volume_values(bake->volume, channel, block);
    for (size_t v = 0; leaf != NULL && v < VSHI_BLOCK_VOXELS; ++v) {
        leaf[v] = mask[v >> 6] >> (v & 63) & 1 ? value : leaf[v];
    }
    return leaf != NULL;
}

/* Where a channel's answers go before they go into leaves. */
typedef struct answers {
    float *values; /* [channels][VSHI_BLOCK_VOXELS] */
    float **to;    /* [lights], then their deviations [lights] */
    vsh_query_output output;
    bool asked;
} answers;

static float *plane(const answers *a, size_t channel) {
    return a->values + channel * VSHI_BLOCK_VOXELS;
}

/* Asks for what is not known; channels that are get their value. False where memory is short. */
static bool choose_answers(vshi_volume_bake *bake, size_t block, const facts *known, answers *a) {
    const size_t lights = bake->light_count, ao = lights;
    const size_t errors = lights + (bake->options.ao != 0);
    bool good = true;
    for (size_t l = 0; l < lights && good; ++l) {
        const int8_t proof = known->light[l];
        const bool open = proof == VSHI_UNPROVED;
        a->to[l] = open ? plane(a, l) : NULL;
        a->to[lights + l] = open && bake->shadow_error ? plane(a, errors + l) : NULL;
        a->asked = a->asked || open;
        good = open || set_all(bake, l, block, proof == VSHI_PROVED_FREE ? 1.0f : 0.0f);
        good = good && (open || !bake->shadow_error || set_all(bake, errors + l, block, 0.0f));
    }
    a->output.visibility = a->to;
    a->output.deviation = a->to + lights;
    if (bake->options.ao != 0 && known->open) {
        good = good && set_all(bake, ao, block, 1.0f) &&
               (!bake->ao_error || set_all(bake, bake->channel_count - 1, block, 0.0f));
    } else if (bake->options.ao != 0) {
        a->output.ao = plane(a, ao);
        a->output.ao_deviation = bake->ao_error ? plane(a, bake->channel_count - 1) : NULL;
        a->asked = true;
    }
    return good;
}

/* Puts a channel's answers into the block's leaf. False where memory is short. */
static bool take_answers(vshi_volume_bake *bake, size_t block, const piece *p, size_t channel,
                         const float *values) {
    float *leaf = values != NULL ? vshi_volume_values(bake->volume, channel, block) : NULL;
    for (size_t i = 0; leaf != NULL && i < p->count; ++i) {
        leaf[p->voxel[i]] = values[i];
    }
    return values == NULL || leaf != NULL;
}

static bool shade_piece(vshi_volume_bake *bake, size_t block, piece *p, const facts *known, answers *a,
                        vsh_shade_stats *stats) {
    const size_t lights = bake->light_count, errors = lights + (bake->options.ao != 0);
    a->output = vsh_query_output_default();
    a->asked = false;
    bool good = choose_answers(bake, block, known, a);
    if (!good || !a->asked) {
        return good;
    }
    number_voxels(&bake->blocks[block], p);
    const vsh_points points = {p->count, &p->centre[0][0], bake->normals ? &p->normal[0][0] : NULL, p->texel};
    /* nothing of it is the caller's, so that memory is all it can fail for */
    good = vsh_query_points(bake->query, &points, NULL, &bake->one, &a->output, stats, NULL) == VSH_OK;
    for (size_t l = 0; l < lights; ++l) {
        good = good && take_answers(bake, block, p, l, a->to[l]) &&
               take_answers(bake, block, p, errors + l, a->to[lights + l]);
    }
    return good && take_answers(bake, block, p, lights, a->output.ao) &&
           take_answers(bake, block, p, bake->channel_count - 1, a->output.ao_deviation);
}

static bool shade_block(vshi_volume_bake *bake, size_t b, const facts *known, answers *a,
                        vsh_shade_stats *stats) {
    const vshi_block *block = &bake->blocks[b];
    uint64_t *shaded = bake->fill.shaded[b];
    piece p;
    if (known->inside) {
        return true;
    }
    list_voxels(block, &p);
    vshi_voxels_centres(bake->voxels, b, p.count, p.voxel, p.centre);
    if (!known->outside) {
        keep_outside(bake, &p);
    }
    if (bake->normals) {
        find_normals(bake, &p);
    }
    for (size_t i = 0; i < p.count; ++i) {
        shaded[p.voxel[i] >> 6] |= (uint64_t)1 << (p.voxel[i] & 63);
    }
    if (p.count > 0 && !shade_piece(bake, b, &p, known, a, stats)) {
        return false;
    }
    if (memcmp(shaded, block->mask, sizeof block->mask) == 0) {
        vshi_volume_settle(bake->volume, b, shaded); /* early: uniform ones give their memory back */
    }
    return true;
}

/* What balls around the blocks tell, in free space. */
static void look_around(const vshi_volume_bake *bake, size_t begin, size_t count, facts *known,
                        vsh_shade_stats *stats) {
    double centre[VSHI_VOLUME_GRAIN][3] = {{0.0}}, radius[VSHI_VOLUME_GRAIN];
    float distance[VSHI_VOLUME_GRAIN];
    int8_t proof[VSHI_VOLUME_GRAIN];
    for (size_t i = 0; i < count; ++i) {
        vshi_voxels_ball(bake->voxels, begin + i, centre[i], &radius[i]);
    }
    vshi_solid_bound(&bake->solid, count, &centre[0][0], distance);
    for (size_t i = 0; i < count; ++i) {
        const double sure = SURE * fabs((double)distance[i]) - bake->solid.voxel_size - radius[i];
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

void vshi_volume_shade_blocks(void *user, size_t begin, size_t end) {
    vshi_volume_bake *bake = user;
    if (atomic_load(&bake->out_of_memory)) {
        return;
    }
    const size_t lights = bake->light_count;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    facts known[VSHI_VOLUME_GRAIN] = {0};
    answers a = {.values = malloc(bake->channel_count * VSHI_BLOCK_VOXELS * sizeof(float)),
                 .to = malloc((2 * lights + 1) * sizeof(float *))};
    int8_t *proofs = calloc(VSHI_VOLUME_GRAIN * lights + 1, 1);
    bool good = a.values != NULL && a.to != NULL && proofs != NULL;
    for (size_t i = 0; i < end - begin; ++i) {
        known[i].light = good ? proofs + i * lights : NULL;
    }
    if (good && !bake->normals) {
        look_around(bake, begin, end - begin, known, &stats);
    }
    for (size_t b = begin; b < end && good; ++b) {
        good = shade_block(bake, b, &known[b - begin], &a, &stats);
    }
    free(proofs);
    free(a.to);
    free(a.values);
    if (!good) {
        atomic_store(&bake->out_of_memory, true);
    }
    /* in units, so that the order of threads changes no bit */
    stats.square_error = floor(stats.square_error / VSHI_SQUARE_UNIT) * VSHI_SQUARE_UNIT;
    stats.ao_square_error = floor(stats.ao_square_error / VSHI_SQUARE_UNIT) * VSHI_SQUARE_UNIT;
    pthread_mutex_lock(&bake->lock);
    vshi_shade_stats_add(&bake->stats, &stats);
    pthread_mutex_unlock(&bake->lock);
}
