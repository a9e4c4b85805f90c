/* Volumes: voxels are shaded block by block, then what is inside solids is filled.
 *
 * A block of 8³ voxels is a leaf of the grids. Its voxels are listed along a curve that fills it, so that
 * those that follow each other share proofs (shade/blocks.c); in free space a beam around all of a block's
 * cones comes first, and where it proves them free or hidden the block is one tile and no voxel is looked at.
 */
#include "bake/fill.h"
#include "base/decimal.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "light/light.h"
#include "shade/layers.h"
#include "shade/query.h"
#include "shade/shade.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vdbshade/volume.h>

enum { GRAIN = 16 }; /* blocks of a piece of work: as many as march together */

typedef struct volume_bake {
    const vsh_occluders *occluders;
    vshi_solid solid;         /* of these */
    double caster_voxel_size; /* of their field */
    double held;              /* bytes of theirs */
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
    vsh_run one; /* a piece's: the calling thread, without progress */
    vsh_volume *volume;
    vshi_fill fill;
    atomic_bool out_of_memory;
    pthread_mutex_t lock; /* of what follows */
    vsh_shade_stats stats;
} volume_bake;

/* --- blocks */

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

/* Keeps voxel i as the next of `kept`. */
static void keep_voxel(piece *p, size_t *kept, size_t i) {
    p->voxel[*kept] = p->voxel[i];
    memmove(p->centre[(*kept)++], p->centre[i], sizeof p->centre[i]);
}

/* Keeps the voxels that are outside. */
static void keep_outside(const volume_bake *bake, piece *p) {
    float distance[VSHI_BLOCK_VOXELS];
    vshi_solid_sample(&bake->solid, p->count, &p->centre[0][0], distance);
    size_t kept = 0;
    for (size_t i = 0; i < p->count; ++i) {
        if (distance[i] >= 0.0f && !vshi_solid_buries(&bake->solid, p->centre[i])) {
            keep_voxel(p, &kept, i);
        }
    }
    p->count = kept;
}

/* Normals by central differences along the lattice's axes; keeps the voxels that have one. */
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
        keep_voxel(p, &kept, i);
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
static bool set_all(volume_bake *bake, size_t channel, size_t block, float value) {
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

/* Channels are the shadows of lights, AO, then the errors of these. Returns whether one is a light's. */
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

/* Where answers go before they go into leaves. */
typedef struct answers {
    float *values; /* [channels][VSHI_BLOCK_VOXELS] */
    float **to;    /* [channels], in `values`; NULL where nothing is asked */
} answers;

/* Asks for what is not known; channels that are get their value. False where memory is short. */
static bool shade_piece(volume_bake *bake, size_t block, piece *p, const facts *known, const answers *a,
                        vsh_shade_stats *stats) {
    bool asked = false;
    for (size_t c = 0; c < bake->channel_count; ++c) {
        float value;
        a->to[c] = a->values + c * VSHI_BLOCK_VOXELS;
        if (is_known(bake, known, c, &value)) {
            a->to[c] = NULL;
            if (!set_all(bake, c, block, value)) {
                return false;
            }
        }
        asked = asked || a->to[c] != NULL;
    }
    if (!asked) {
        return true;
    }
    number_voxels(&bake->blocks[block], p);
    const bool ao = bake->options.ao != 0;
    const vsh_points points = {p->count, &p->centre[0][0], bake->normals ? &p->normal[0][0] : NULL, p->texel};
    vsh_query_output output = vsh_query_output_default();
    output.visibility = a->to;
    output.deviation = bake->shadow_error ? a->to + bake->light_count + ao : NULL;
    output.ao = ao ? a->to[bake->light_count] : NULL;
    output.ao_deviation = bake->ao_error ? a->to[bake->channel_count - 1] : NULL;
    /* nothing of it is the caller's, so that memory is all it can fail for */
    if (vsh_query_points(bake->query, &points, NULL, &bake->one, &output, stats, NULL) != VSH_OK) {
        return false;
    }
    for (size_t c = 0; c < bake->channel_count; ++c) {
        float *leaf = a->to[c] != NULL ? vshi_volume_values(bake->volume, c, block) : NULL;
        for (size_t i = 0; leaf != NULL && i < p->count; ++i) {
            leaf[p->voxel[i]] = a->to[c][i];
        }
        if (a->to[c] != NULL && leaf == NULL) {
            return false;
        }
    }
    return true;
}

static bool shade_block(volume_bake *bake, size_t b, const facts *known, const answers *a,
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
static void look_around(const volume_bake *bake, size_t begin, size_t count, facts *known,
                        vsh_shade_stats *stats) {
    double centre[GRAIN][3] = {{0.0}}, radius[GRAIN];
    float distance[GRAIN];
    int8_t proof[GRAIN];
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

static void shade_blocks(void *user, size_t begin, size_t end) {
    volume_bake *bake = user;
    if (atomic_load(&bake->out_of_memory)) {
        return;
    }
    const size_t lights = bake->light_count;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    facts known[GRAIN] = {0};
    answers a = {.values = malloc(bake->channel_count * VSHI_BLOCK_VOXELS * sizeof(float)),
                 .to = malloc(bake->channel_count * sizeof(float *))};
    int8_t *proofs = calloc(GRAIN * lights + 1, 1);
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

/* --- the whole */

/* Share of the progress: filling what is inside costs little. */
enum { SHADE_UNITS = 15, FILL_UNITS = 1 };

static void fill_blocks(void *user, size_t begin, size_t end) {
    volume_bake *bake = user;
    for (size_t b = begin; b < end && !atomic_load(&bake->out_of_memory); ++b) {
        if (!vshi_fill_block(&bake->fill, b)) {
            atomic_store(&bake->out_of_memory, true);
        }
    }
}

static void settle_blocks(void *user, size_t begin, size_t end) {
    volume_bake *bake = user;
    for (size_t b = begin; b < end; ++b) {
        uint64_t active[VSHI_MASK_WORDS];
        if (vshi_fill_active(&bake->fill, b, active)) {
            vshi_volume_settle(bake->volume, b, active);
        }
    }
}

static vsh_result check_memory(volume_bake *bake, vsh_result result, vsh_error *error) {
    return result == VSH_OK && atomic_load(&bake->out_of_memory)
               ? vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory")
               : result;
}

static vsh_result shade(volume_bake *bake, const vsh_light *lights, vshi_job *job, vsh_error *error) {
    vsh_shade_options options = bake->options.shade;
    if (bake->options.ao == 0) {
        options.ao_method = VSH_AO_CONES; /* not asked for: it may want what is not there */
    }
    const bool around = !bake->normals && bake->options.ao != 0; /* AO over all directions */
    VSHI_TRY(
        vshi_query_create(bake->occluders, lights, bake->light_count, &options, around, &bake->query, error));
    const vsh_result result =
        vshi_parallel_for(job, bake->block_count, GRAIN, SHADE_UNITS, shade_blocks, bake, error);
    vsh_query_free(bake->query);
    bake->query = NULL;
    return check_memory(bake, result, error);
}

/* Fills and settles all blocks, and closes the volume. */
static vsh_result finish(volume_bake *bake, vshi_job *job, vsh_error *error) {
    VSHI_TRY(vshi_parallel_for(job, bake->block_count, GRAIN, FILL_UNITS, fill_blocks, bake, error));
    VSHI_TRY(vshi_parallel_for(job, bake->block_count, GRAIN, 0, settle_blocks, bake, error));
    VSHI_TRY(check_memory(bake, VSH_OK, error));
    const vsh_volume_info counts = vshi_fill_counts(&bake->fill);
    return vshi_volume_close(bake->volume, &counts, error);
}

static void find_half_axes(volume_bake *bake) {
    double centre[3], next[3];
    const int32_t *index = bake->blocks[0].origin;
    vsh_voxels_centre(bake->voxels, index, centre);
    for (int axis = 0; axis < 3; ++axis) {
        int32_t beside[3] = {index[0], index[1], index[2]};
        ++beside[axis];
        vsh_voxels_centre(bake->voxels, beside, next);
        for (int k = 0; k < 3; ++k) {
            bake->half_axis[axis][k] = 0.5 * (next[k] - centre[k]);
        }
    }
}

/* Fills a channel for each grid, in the order of vsh_volume. */
static void describe(const volume_bake *bake, const vsh_light *lights, vshi_channel *channels) {
    VSHI_NUMBERS;
    const vsh_shade_options *shade = &bake->options.shade;
    const bool triangles = bake->occluders->triangles != NULL;
    for (size_t i = 0; i < bake->channel_count; ++i) {
        vshi_channel *c = &channels[i];
        size_t l;
        bool error;
        c->caster_voxel_size = bake->caster_voxel_size;
        if (is_of_light(bake, i, &l, &error)) {
            const char *name = lights[l].name;
            c->method = vsh_get_name(VSH_NAMES_SHADOW, vsh_shadow_method_resolve(shade->method, triangles));
            snprintf(c->name, sizeof c->name, "%s.%s", error ? "error" : "shadow", name);
            snprintf(c->description, sizeof c->description, "%s light '%s', 1 lit, 0 dark",
                     error ? "standard error of the visible fraction of" : "visible fraction of", name);
            vsh_light_text(&lights[l], c->light, sizeof c->light);
        } else {
            c->method = vsh_get_name(VSH_NAMES_AO, vsh_ao_method_resolve(shade->ao_method, triangles));
            snprintf(c->name, sizeof c->name, "%s", error ? "error.ao" : "ao");
            snprintf(c->description, sizeof c->description, "%s within %g, 1 open, 0 closed",
                     error ? "standard error of ambient occlusion" : "ambient occlusion", shade->ao_distance);
        }
    }
}

/* Begins the volume and its filling. Errors: as vshi_volume_begin(). End it with vshi_fill_end(), and free
 * the volume, also then. */
static vsh_result begin(volume_bake *bake, const vsh_light *lights, const vsh_run *run, vsh_error *error) {
    vshi_channel *channels = NULL;
    VSHI_TRY(vshi_allocate((void **)&channels, bake->channel_count, sizeof *channels, "volume", error));
    describe(bake, lights, channels);
    const double held = bake->held + 2.0 * (double)bake->block_count * sizeof *bake->fill.shaded;
    const vsh_result result =
        vshi_volume_begin(bake->voxels, channels, bake->channel_count, run, held, &bake->volume, error);
    free(channels);
    VSHI_TRY(result);
    return vshi_fill_begin(&bake->fill, &bake->solid, bake->voxels, bake->volume, bake->channel_count,
                           bake->options.inside == VSH_INSIDE_NEAREST, error);
}

static vsh_result bake_all(volume_bake *bake, const vsh_light *lights, const vsh_run *run, vsh_error *error) {
    const size_t blocks = bake->block_count;
    vshi_job *job = vshi_job_begin(run, "volume", (SHADE_UNITS + FILL_UNITS) * blocks);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(begin(bake, lights, run, error));
    VSHI_TRY_DONE(shade(bake, lights, job, error));
    result = finish(bake, job, error);
done:
    vshi_fill_end(&bake->fill);
    vshi_job_end(job);
    return result;
}

static vsh_result check(const vsh_light *lights, const volume_bake *bake, vsh_error *error) {
    const vsh_volume_options *options = &bake->options;
    if (vsh_get_name(VSH_NAMES_INSIDE, options->inside) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "inside %d: expected %d … %d", options->inside, 0,
                         VSH_INSIDE_OFF);
    }
    if (bake->light_count == 0 && options->ao == 0) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "volume: nothing to bake: no lights and no AO");
    }
    for (size_t l = 0; l < bake->light_count; ++l) {
        vsh_error why;
        const vsh_result result = vsh_light_check(&lights[l], &why);
        if (result != VSH_OK) {
            return vshi_fail(error, result, "light %zu: %s", l, why.message);
        }
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

static void take_casters(volume_bake *bake, const vsh_occluders *occluders) {
    vsh_field_info info;
    vsh_field_get_info(occluders->field, &info);
    bake->solid = vshi_solid_of(occluders);
    bake->caster_voxel_size = info.voxel_size;
    bake->held = (double)info.bytes +
                 (occluders->triangles != NULL ? (double)vsh_triangles_bytes(occluders->triangles) : 0.0);
    for (size_t i = 0; i < occluders->layer_count; ++i) {
        bake->held += vshi_layer_bytes(&occluders->layers[i]);
    }
}

/* Checks what there is to bake, and takes it; `options` and `run` may be NULL. Errors: VSH_ERROR_ARGUMENT. */
static vsh_result set_up(volume_bake *bake, const vsh_occluders *occluders, const vsh_voxels *voxels,
                         const vsh_light *lights, size_t light_count, const vsh_volume_options *options,
                         const vsh_run *run, vsh_run *full, vsh_error *error) {
    *bake = (volume_bake){.occluders = occluders,
                          .voxels = voxels,
                          .light_count = light_count,
                          .options = vsh_volume_options_default(),
                          .one = vsh_run_default(),
                          .lock = PTHREAD_MUTEX_INITIALIZER,
                          .stats = vsh_shade_stats_zero()};
    take_casters(bake, occluders);
    vsh_shade_options shade;
    VSHI_TRY(
        vshi_options_resolve(options, &bake->options, sizeof bake->options, "vsh_volume_options", error));
    VSHI_TRY(vshi_shade_options_resolve(&bake->options.shade, &shade, error));
    bake->options.shade = shade;
    VSHI_TRY(vshi_run_resolve(run, full, error));
    VSHI_TRY(check(lights, bake, error));
    if (occluders->field->unknown) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT,
                         "volume: the occluders have no voxels, which tell what is inside");
    }
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    bake->normals = info.has_normals != 0;
    bake->blocks = vshi_voxels_blocks(voxels, &bake->block_count);
    bake->shadow_error = bake->options.error != 0 && light_count > 0 && vshi_shadow_has_rays(&shade);
    bake->ao_error = bake->options.error != 0 && bake->options.ao != 0 && vshi_ao_has_rays(&shade);
    bake->channel_count =
        light_count * (bake->shadow_error ? 2 : 1) + (bake->options.ao != 0) + bake->ao_error;
    bake->one.threads = 1;
    bake->one.isa = full->isa;
    find_half_axes(bake);
    return VSH_OK;
}

vsh_result vsh_bake_volume(const vsh_occluders *occluders, const vsh_voxels *voxels, const vsh_light *lights,
                           size_t light_count, const vsh_volume_options *options, const vsh_run *run,
                           vsh_volume **volume, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(volume);
    *volume = NULL;
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(voxels);
    VSHI_NEEDS_OF(light_count, lights);
    vsh_run full;
    volume_bake bake;
    VSHI_TRY(set_up(&bake, occluders, voxels, lights, light_count, options, run, &full, error));
    const vsh_result result = bake_all(&bake, lights, &full, error);
    if (stats != NULL) {
        vshi_shade_stats_add(stats, &bake.stats);
    }
    if (result != VSH_OK) {
        vsh_volume_free(bake.volume);
        return result;
    }
    *volume = bake.volume;
    return VSH_OK;
}
