#include "volume/volume_part.h"

#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "shade/occluders.h"
#include "shade/rays_expected.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void vshi_volume_head_code(vshi_part_code *code, vshi_volume_head *head) {
    vshi_part_code_i32(code, &head->working);
    vshi_part_code_u64(code, &head->first);
    vshi_part_code_u64(code, &head->end);
    vshi_part_code_u64(code, &head->blocks);
    vshi_part_code_u64(code, &head->count);
    vshi_part_code_u64(code, &head->channels);
    vshi_part_code_f64(code, &head->voxel_size);
    vshi_part_code_u64(code, &head->active_voxels);
    vshi_part_code_u64(code, &head->field_bytes);
    vshi_part_code_i32(code, &head->levels);
    vshi_part_code_i32(code, &head->has_triangles);
    vshi_part_code_f64(code, &head->field_voxel_size);
    vshi_part_code_i32(code, &head->traced);
}

void vshi_volume_stats_code(vshi_part_code *code, vsh_shade_stats *s) {
    uint64_t *const counts[] = {&s->marches, &s->samples,      &s->skipped, &s->certified, &s->unfinished,
                                &s->invalid, &s->beyond_reach, &s->rays,    &s->refined};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; ++i) {
        vshi_part_code_u64(code, counts[i]);
    }
    vshi_part_code_f64(code, &s->square_error);
    vshi_part_code_f64(code, &s->ao_square_error);
    vshi_part_code_f64(code, &s->worst_error);
}

/* --- how many have blocks */

/* Nanoseconds or so of a voxel in a band, half of which are inside: what any takes, a light, and AO; what of
 * these is rays goes by the error. Rather too little: AO is 1600 to 11 000 within 0.3 to all of the cloister.
 */
static const double ANY = 100.0, LIGHT = 150.0, LIGHT_RAYS = 200.0, AO_RAYS = 3000.0;

int32_t vsh_volume_shards(double voxels, size_t light_count, const vsh_volume_options *options, double least,
                          int32_t shard_count) {
    VSHI_FLOATS;
    vsh_volume_options own = vsh_volume_options_default();
    if (vshi_options_resolve(options, &own, sizeof own, "vsh_volume_options", NULL) != VSH_OK ||
        !(least > 0.0) || !(voxels >= 0.0)) {
        return shard_count;
    }
    const double rays = vshi_rays_expected((double)own.shade.max_error);
    const double ns =
        ANY + (double)light_count * (LIGHT + rays * LIGHT_RAYS) + (own.ao != 0 ? rays * AO_RAYS : 0.0);
    const double most = floor(1e-9 * ns * voxels / least);
    return most >= shard_count ? shard_count : most > 1.0 ? (int32_t)most : 1;
}

/* --- which blocks */

/* The first block of a shard, or the end of the one before it: shards have as many voxels as each other, and
 * begin where blocks are worked on together. */
static size_t find_begin(const vshi_volume_bake *bake, double all, int32_t shard, int32_t count) {
    double before = 0.0;
    for (size_t b = 0; b < bake->block_count; b += VSHI_VOLUME_GRAIN) {
        size_t here = 0;
        for (size_t k = b; k < b + VSHI_VOLUME_GRAIN && k < bake->block_count; ++k) {
            here += vshi_mask_count(bake->blocks[k].mask);
        }
        if ((before + 0.5 * (double)here) * (double)count >= all * (double)(shard - 1)) {
            return b;
        }
        before += (double)here;
    }
    return bake->block_count;
}

static void find_range(const vshi_volume_bake *bake, const vsh_part_options *part, size_t *first,
                       size_t *end) {
    vsh_voxels_info info;
    vsh_voxels_get_info(bake->voxels, &info);
    const double all = (double)info.count;
    *first = part->shard == 1 ? 0 : find_begin(bake, all, part->shard, part->working);
    *end = part->shard == part->working ? bake->block_count
                                        : find_begin(bake, all, part->shard + 1, part->working);
}

/* --- its blocks */

typedef struct record {
    uint16_t voxel[VSHI_BLOCK_VOXELS]; /* shaded, in their order */
    size_t count;
    uint8_t reaches[VSHI_BLOCK_VOXELS + 4];
    size_t reach_bytes; /* a multiple of 4 */
} record;

static void make_record(const vshi_volume_bake *bake, size_t block, record *r) {
    const uint64_t *shaded = bake->fill.shaded[block];
    memset(r->reaches, 0, sizeof r->reaches);
    const size_t open = vshi_fill_reaches(&bake->fill, block, r->reaches);
    r->reach_bytes = (open + 3) / 4 * 4;
    r->count = 0;
    for (int v = 0; v < VSHI_BLOCK_VOXELS; ++v) {
        if (shaded[v >> 6] >> (v & 63) & 1) {
            r->voxel[r->count++] = (uint16_t)v;
        }
    }
}

/* The values of a channel's voxels, or the one that all have; returns how many. */
static uint32_t take_values(const vshi_volume_bake *bake, size_t channel, size_t block, const record *r,
                            float values[VSHI_BLOCK_VOXELS]) {
    bool same = true;
    for (size_t i = 0; i < r->count; ++i) {
        values[i] = vshi_volume_value(bake->volume, channel, block, r->voxel[i]);
        same = same && memcmp(&values[i], &values[0], sizeof *values) == 0;
    }
    return same && r->count > 0 ? 1 : (uint32_t)r->count;
}

/* Writes a block, or (NULL) counts its bytes. */
static uint64_t put_block(const vshi_volume_bake *bake, size_t block, vshi_part_output *file) {
    record r;
    float values[VSHI_BLOCK_VOXELS];
    make_record(bake, block, &r);
    uint64_t bytes = sizeof bake->fill.shaded[block] + r.reach_bytes;
    if (file != NULL) {
        vshi_part_output_put(file, bake->fill.shaded[block], sizeof bake->fill.shaded[block]);
        vshi_part_output_put(file, r.reaches, r.reach_bytes);
    }
    for (size_t c = 0; c < bake->channel_count; ++c) {
        const uint32_t count = take_values(bake, c, block, &r, values);
        bytes += sizeof count + count * sizeof *values;
        if (file != NULL) {
            vshi_part_output_put(file, &count, sizeof count);
            vshi_part_output_put(file, values, count * sizeof *values);
        }
    }
    return bytes;
}

/* The file of a part: its head, blocks first … end - 1 of the bake, and its statistics. */
static vsh_result write_part(const vshi_volume_bake *bake, const vsh_part_options *part,
                             vshi_volume_head *head, vsh_error *error) {
    vshi_part_about about;
    vshi_part_code code = {.reads = false}, tail = {.reads = false};
    vshi_part_output file;
    vsh_shade_stats stats = bake->stats;
    uint64_t bytes = 0;
    vsh_result result;
    char *path = vshi_part_path(part->parts, part->shard, part->shard_count);
    VSHI_TRY_DONE(vshi_part_about_make(VSHI_PART_VOLUME, part, &about, error));
    vshi_part_about_code(&code, &about);
    vshi_volume_head_code(&code, head);
    vshi_volume_stats_code(&tail, &stats);
    if (path == NULL || tail.failed) {
        free(code.bytes);
        result = vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
        goto done;
    }
    for (size_t b = head->first; b < head->end; ++b) {
        bytes += put_block(bake, b, NULL);
    }
    VSHI_TRY_DONE(vshi_part_output_begin(&file, path, &code, bytes, tail.size, error));
    for (size_t b = head->first; b < head->end; ++b) {
        put_block(bake, b, &file);
    }
    vshi_part_output_put(&file, tail.bytes, tail.size);
    result = vshi_part_output_finish(&file, error);
done:
    free(tail.bytes);
    free(path);
    vshi_part_about_free(&about);
    return result;
}

static vsh_result write_baked(const vshi_volume_bake *bake, const vsh_part_options *part, size_t first,
                              size_t end, vsh_error *error) {
    vsh_voxels_info info;
    vsh_voxels_get_info(bake->voxels, &info);
    vsh_occluders_info casters;
    vsh_occluders_get_info(bake->occluders, &casters);
    vshi_volume_head head = {.working = part->working,
                             .first = first,
                             .end = end,
                             .blocks = bake->block_count,
                             .count = info.count,
                             .channels = bake->channel_count,
                             .voxel_size = casters.voxel_size,
                             .active_voxels = casters.active_voxels,
                             .field_bytes = casters.field_bytes,
                             .levels = casters.levels,
                             .has_triangles = casters.has_triangles,
                             .field_voxel_size = bake->caster_voxel_size,
                             .traced = bake->has_triangles};
    return write_part(bake, part, &head, error);
}

/* What a part without blocks tells is the same whatever is baked. */
static vsh_result write_idle(vsh_part_options *part, vsh_error *error) {
    const vshi_volume_bake none = {.stats = vsh_shade_stats_zero()};
    vshi_volume_head head = {.working = part->working};
    part->attribute_count = 0;
    return write_part(&none, part, &head, error);
}

static vsh_result bake_part(vshi_volume_bake *bake, const vsh_light *lights, const vsh_part_options *part,
                            const vsh_run *run, vsh_error *error) {
    size_t first, end;
    find_range(bake, part, &first, &end);
    vshi_job *job = vshi_job_begin(run, "volume", end - first);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_volume_open(bake, lights, run, error));
    VSHI_TRY_DONE(vshi_volume_shade(bake, lights, first, end, job, 1, error));
    result = write_baked(bake, part, first, end, error);
done:
    vshi_fill_end(&bake->fill);
    vsh_volume_free(bake->volume);
    vshi_job_end(job);
    return result;
}

vsh_result vsh_bake_volume_part(const vsh_occluders *occluders, const vsh_voxels *voxels,
                                const vsh_light *lights, size_t light_count,
                                const vsh_volume_options *options, const vsh_part_options *part,
                                const vsh_run *run, vsh_shade_stats *stats, vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(part);
    vsh_part_options own = vsh_part_options_default();
    VSHI_TRY(vshi_options_resolve(part, &own, sizeof own, "vsh_part_options", error));
    VSHI_NEEDS(own.parts);
    VSHI_TRY(vshi_part_check_options(&own, false, error));
    own.working = own.working > 0 ? own.working : own.shard_count;
    if (own.shard > own.working) {
        return write_idle(&own, error);
    }
    VSHI_NEEDS(occluders);
    VSHI_NEEDS(voxels);
    VSHI_NEEDS_OF(light_count, lights);
    vsh_run full;
    vshi_volume_bake bake;
    VSHI_TRY(vshi_volume_set_up(&bake, occluders, voxels, lights, light_count, options, run, &full, error));
    const vsh_result result = bake_part(&bake, lights, &own, &full, error);
    if (stats != NULL) {
        vshi_shade_stats_add(stats, &bake.stats);
    }
    return result;
}
