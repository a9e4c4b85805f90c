/* Voxels shaded in blocks of 8³: each is one piece of work, ordered along a curve that fills it, so that
 * neighbours share proofs, and lies in the leaves that its values stay in. */
#include <vdbshade/volume.h>

#include "bake/channels.h"
#include "bake/fill.h"
#include "base/floats.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "shade/query.h"
#include "shade/shade.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Share of the progress: filling what is inside costs little. */
enum { SHADE_UNITS = 15, FILL_UNITS = 1 };

/* A field's slope is 1, but for where two surfaces are equally near: there it has no direction. */
static const double FLAT = 0.1;

static const char *const inside_names[] = {[VSH_INSIDE_NEAREST] = "nearest", [VSH_INSIDE_OFF] = "off"};
enum { INSIDE_COUNT = sizeof inside_names / sizeof inside_names[0] };

int32_t vsh_inside(const char *name) {
    for (int32_t i = 0; name != NULL && i < INSIDE_COUNT; ++i) {
        if (strcmp(inside_names[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

const char *vsh_inside_name(int32_t inside) {
    return inside >= 0 && inside < INSIDE_COUNT ? inside_names[inside] : NULL;
}

typedef struct volume_bake {
    const vsh_field *field;
    const vsh_voxels *voxels;
    const vshi_block *blocks;
    size_t block_count;
    size_t light_count;
    vsh_volume_options options;
    bool normals;            /* the band of a surface */
    double half_axis[3][3];  /* of its voxels, world units */
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

/* --- a block */

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
static void keep_outside(const volume_bake *bake, piece *p) {
    float distance[VSHI_BLOCK_VOXELS];
    vsh_field_sample(bake->field, p->count, &p->centre[0][0], distance);
    size_t kept = 0;
    for (size_t i = 0; i < p->count; ++i) {
        if (distance[i] >= 0.0f) {
            p->voxel[kept] = p->voxel[i];
            memmove(p->centre[kept++], p->centre[i], sizeof p->centre[i]);
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
            vsh_field_sample(bake->field, p->count, &at[side][0][0], distance[side]);
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
        const uint32_t x = (uint32_t)block->origin[0] + (v >> 6), y = (uint32_t)block->origin[1] + (v >> 3 & 7);
        const uint32_t z = (uint32_t)block->origin[2] + (v & 7);
        p->texel[i] = ((x + COLUMN_STEP * z) & 0xffff) + 65536u * ((y + ROW_STEP * z) & 0xffff);
    }
}

/* Asks for everything at a piece's points and puts it into the block's leaves. False where memory is short. */
static bool shade_piece(volume_bake *bake, size_t block, const piece *p) {
    const size_t lights = bake->light_count, channels = bake->channel_count;
    float *values = malloc(channels * VSHI_BLOCK_VOXELS * sizeof *values);
    float **to = malloc((2 * lights + 1) * sizeof *to);
    bool good = values != NULL && to != NULL;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    if (good) {
        const vsh_points points = {p->count, &p->centre[0][0], bake->normals ? &p->normal[0][0] : NULL,
                                   p->texel};
        vsh_query_output output = vsh_query_output_default();
        float *next = values;
        for (size_t l = 0; l < lights; ++l, next += VSHI_BLOCK_VOXELS) {
            to[l] = next;
        }
        if (bake->options.ao != 0) {
            output.ao = next;
            next += VSHI_BLOCK_VOXELS;
        }
        for (size_t l = 0; bake->shadow_error && l < lights; ++l, next += VSHI_BLOCK_VOXELS) {
            to[lights + l] = next;
        }
        output.visibility = to;
        output.deviation = bake->shadow_error ? to + lights : NULL;
        output.ao_deviation = bake->ao_error ? next : NULL;
        /* nothing of it is the caller's, so that memory is all it can fail for */
        good = vsh_query_points(bake->query, &points, &bake->one, &output, &stats, NULL) == VSH_OK;
    }
    for (size_t c = 0; good && c < channels; ++c) {
        float *leaf = vshi_volume_values(bake->volume, c, block);
        good = leaf != NULL;
        for (size_t i = 0; good && i < p->count; ++i) {
            leaf[p->voxel[i]] = values[c * VSHI_BLOCK_VOXELS + i];
        }
    }
    free(to);
    free(values);
    pthread_mutex_lock(&bake->lock);
    vshi_shade_stats_add(&bake->stats, &stats);
    pthread_mutex_unlock(&bake->lock);
    return good;
}

static void shade_blocks(void *user, size_t begin, size_t end) {
    volume_bake *bake = user;
    for (size_t b = begin; b < end && !atomic_load(&bake->out_of_memory); ++b) {
        const vshi_block *block = &bake->blocks[b];
        piece p;
        list_voxels(block, &p);
        vshi_voxels_centres(bake->voxels, b, p.count, p.voxel, p.centre);
        keep_outside(bake, &p);
        if (bake->normals) {
            find_normals(bake, &p);
        }
        number_voxels(block, &p);
        uint64_t *shaded = bake->fill.shaded[b];
        for (size_t i = 0; i < p.count; ++i) {
            shaded[p.voxel[i] >> 6] |= (uint64_t)1 << (p.voxel[i] & 63);
        }
        if (p.count > 0 && !shade_piece(bake, b, &p)) {
            atomic_store(&bake->out_of_memory, true);
        } else if (memcmp(shaded, block->mask, sizeof block->mask) == 0) {
            vshi_volume_settle(bake->volume, b, shaded); /* early: uniform ones give their memory back */
        }
    }
}

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

/* --- the whole */

static vsh_result run_passes(volume_bake *bake, const vsh_run *run, vsh_error *error) {
    static vshi_range_fn *const passes[] = {shade_blocks, fill_blocks, settle_blocks};
    static const size_t units[] = {SHADE_UNITS, FILL_UNITS, 0};
    vshi_job *job = vshi_job_begin(run, "volume", (SHADE_UNITS + FILL_UNITS) * bake->block_count);
    vsh_result result = VSH_OK;
    if (job == NULL) {
        atomic_store(&bake->out_of_memory, true);
    }
    for (size_t i = 0; i < sizeof units / sizeof units[0] && result == VSH_OK && job != NULL; ++i) {
        result = vshi_parallel_for(job, bake->block_count, 1, units[i], passes[i], bake, error);
    }
    vshi_job_end(job);
    if (result == VSH_OK && atomic_load(&bake->out_of_memory)) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    return result;
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

static vsh_result begin_volume(volume_bake *bake, const vsh_light *lights, const vsh_run *run,
                               vsh_error *error) {
    vshi_channel *channels = NULL;
    vsh_result result =
        vshi_allocate((void **)&channels, bake->channel_count, sizeof *channels, "volume", error);
    if (result != VSH_OK) {
        return result;
    }
    vsh_field_info info;
    vsh_field_get_info(bake->field, &info);
    const vshi_channels what = {lights, bake->light_count, &bake->options, bake->shadow_error, bake->ao_error,
                                info.voxel_size};
    vshi_channels_describe(&what, channels);
    const double held = (double)info.bytes + (double)bake->block_count * sizeof *bake->fill.shaded +
                        (bake->options.shade.triangles != NULL
                             ? (double)vsh_triangles_bytes(bake->options.shade.triangles)
                             : 0.0);
    result = vshi_volume_begin(bake->voxels, channels, bake->channel_count, run, held, &bake->volume, error);
    free(channels);
    return result;
}

static vsh_result bake_all(volume_bake *bake, const vsh_light *lights, const vsh_run *run, vsh_error *error) {
    vsh_shade_options shade = bake->options.shade;
    if (bake->options.ao == 0) {
        shade.ao_method = VSH_AO_CONES; /* not asked for: it may want what is not there */
    }
    vsh_result result = vshi_query_create(bake->field, lights, bake->light_count, &shade, !bake->normals,
                                          &bake->query, error);
    if (result == VSH_OK) {
        result = begin_volume(bake, lights, run, error);
    }
    if (result == VSH_OK) {
        result = vshi_fill_begin(&bake->fill, bake->field, bake->voxels, bake->volume, bake->channel_count,
                                 bake->options.inside == VSH_INSIDE_NEAREST, error);
    }
    if (result == VSH_OK) {
        result = run_passes(bake, run, error);
    }
    if (result == VSH_OK) {
        const vsh_volume_info counts = vshi_fill_counts(&bake->fill);
        result = vshi_volume_close(bake->volume, &counts, error);
    }
    vshi_fill_end(&bake->fill);
    vsh_query_free(bake->query);
    return result;
}

static vsh_result check(const vsh_light *lights, const volume_bake *bake, vsh_error *error) {
    const vsh_volume_options *options = &bake->options;
    if (vsh_inside_name(options->inside) == NULL) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "inside %d: expected %d … %d", options->inside, 0,
                         INSIDE_COUNT - 1);
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

vsh_result vsh_bake_volume(const vsh_field *field, const vsh_voxels *voxels, const vsh_light *lights,
                           size_t light_count, const vsh_volume_options *options, const vsh_run *run,
                           vsh_volume **volume, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    *volume = NULL;
    if (field == NULL || voxels == NULL || (lights == NULL && light_count > 0)) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "vsh_bake_volume: %s is NULL",
                         field == NULL    ? "field"
                         : voxels == NULL ? "voxels"
                                          : "lights");
    }
    vsh_run full;
    volume_bake bake = {.field = field,
                        .voxels = voxels,
                        .light_count = light_count,
                        .options = vsh_volume_options_default(),
                        .one = vsh_run_default(),
                        .lock = PTHREAD_MUTEX_INITIALIZER,
                        .stats = vsh_shade_stats_zero()};
    vsh_result result = vshi_options_resolve(options, &bake.options, sizeof bake.options,
                                             "vsh_volume_options", error);
    if (result == VSH_OK) {
        vsh_shade_options shade;
        result = vshi_shade_options_resolve(&bake.options.shade, &shade, error);
        bake.options.shade = shade;
    }
    if (result == VSH_OK) {
        result = vshi_run_resolve(run, &full, error);
    }
    if (result == VSH_OK) {
        result = check(lights, &bake, error);
    }
    if (result != VSH_OK) {
        return result;
    }
    vsh_voxels_info info;
    vsh_voxels_get_info(voxels, &info);
    const vsh_shade_options *shade = &bake.options.shade;
    bake.normals = info.has_normals != 0;
    bake.blocks = vshi_voxels_blocks(voxels, &bake.block_count);
    bake.shadow_error = bake.options.error != 0 && light_count > 0 && shade->method >= VSH_SHADOW_RAYS;
    bake.ao_error = bake.options.error != 0 && bake.options.ao != 0 && shade->ao_method >= VSH_AO_RAYS;
    bake.channel_count = light_count * (bake.shadow_error ? 2 : 1) + (bake.options.ao != 0) + bake.ao_error;
    bake.one.threads = 1;
    bake.one.isa = full.isa;
    find_half_axes(&bake);
    result = bake_all(&bake, lights, &full, error);
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
