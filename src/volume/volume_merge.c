/* Parts of a volume, put together. */
#include "bake/planes.h"
#include "base/floats.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "volume/volume_part.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SET_UNITS = 1, FILL_UNITS = 1 };

typedef struct merging {
    vshi_volume_bake *bake;
    const vsh_part_options *parts;
    const vsh_run *run;
    vshi_channel *channels; /* [channel_count] */
    uint8_t **reaches;      /* [block_count]: of the fill */
    uint64_t next;          /* block that is to be read */
    vshi_volume_head first; /* of the first part: the others say the same of casters */
    vshi_job *job;
} merging;

/* A part without blocks tells of nothing but that it has none. */
static vsh_result check_idle(const vshi_volume_head *head, const char *path, vsh_error *error) {
    return head->first == 0 && head->end == 0 ? VSH_OK
                                              : vshi_part_damaged(path, "blocks that are not its", error);
}

static vsh_result check_working(const merging *m, const vshi_volume_head *head, const char *path,
                                vsh_error *error) {
    if (head->working < 1 || head->working > m->parts->shard_count) {
        return vshi_part_damaged(path, "the number of parts with voxels", error);
    }
    if (head->working == m->first.working) {
        return VSH_OK;
    }
    char theirs[24], ours[24];
    snprintf(theirs, sizeof theirs, "%d", head->working);
    snprintf(ours, sizeof ours, "%d", m->first.working);
    return vshi_part_refuse(path, "number of parts with voxels", theirs, ours, error);
}

static vsh_result check_head(const merging *m, const vshi_volume_head *head, const char *path,
                             vsh_error *error) {
    const vshi_volume_bake *bake = m->bake;
    vsh_voxels_info info;
    vsh_voxels_get_info(bake->voxels, &info);
    if (head->blocks != bake->block_count || head->count != info.count ||
        head->channels != bake->channel_count || head->voxel_size != m->first.voxel_size ||
        head->has_triangles != m->first.has_triangles || head->active_voxels != m->first.active_voxels ||
        head->field_voxel_size != m->first.field_voxel_size || head->traced != m->first.traced) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of other inputs or options: of %" PRIu64 " voxels in %" PRIu64
                         " grids, casters of voxels of %.9g, of the others or here %" PRIu64
                         ", %zu and %.9g; "
                         "bake this part again",
                         path, head->count, head->channels, head->voxel_size, info.count, bake->channel_count,
                         m->first.voxel_size);
    }
    if (head->first != m->next || head->end < head->first || head->end > head->blocks) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: damaged: its blocks begin at %" PRIu64 ", and those before end at %" PRIu64
                         "; bake this part again",
                         path, head->first, m->next);
    }
    return VSH_OK;
}

/* Bytes of a file that are left to be read. */
typedef struct body {
    FILE *file;
    const char *path;
    uint64_t left;
} body;

static vsh_result read(body *from, void *bytes, size_t size, vsh_error *error) {
    if (size > from->left) {
        return vshi_part_damaged(from->path, "it ends early", error);
    }
    from->left -= size;
    return vshi_part_read_bytes(from->file, from->path, bytes, size, error);
}

/* Checks that a bake can produce a value. */
static vsh_result check_value(const merging *m, const char *path, size_t channel, size_t block, int voxel,
                              float value, vsh_error *error) {
    float low, high;
    const char *name = m->channels[channel].name;
    if (vshi_channel_can_hold(name, value, &low, &high)) {
        return VSH_OK;
    }
    const int32_t *origin = m->bake->blocks[block].origin;
    return vshi_fail(
        error, VSH_ERROR_INPUT,
        "%s: damaged: '%s' of voxel (%d, %d, %d) is %g, out of range %g … %g; bake this part again", path,
        name, origin[0] + (voxel >> 6), origin[1] + (voxel >> 3 & 7), origin[2] + (voxel & 7), (double)value,
        (double)low, (double)high);
}

static vsh_result read_channel(merging *m, body *from, size_t channel, size_t block, size_t shaded,
                               vsh_error *error) {
    const uint64_t *mask = m->bake->fill.shaded[block];
    float values[VSHI_BLOCK_VOXELS];
    uint32_t count;
    VSHI_TRY(read(from, &count, sizeof count, error));
    if (count != shaded && (count != 1 || shaded == 0)) {
        return vshi_part_damaged(from->path, "values of no voxel", error);
    }
    VSHI_TRY(read(from, values, count * sizeof *values, error));
    float *leaf = shaded > 0 ? vshi_volume_values(m->bake->volume, channel, block) : NULL;
    if (shaded > 0 && leaf == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    size_t at = 0;
    for (int v = 0; v < VSHI_BLOCK_VOXELS && shaded > 0; ++v) {
        if (mask[v >> 6] >> (v & 63) & 1) {
            leaf[v] = values[count == 1 ? 0 : at];
            VSHI_TRY(check_value(m, from->path, channel, block, v, leaf[v], error));
            ++at;
        }
    }
    return VSH_OK;
}

static vsh_result read_block(merging *m, body *from, size_t block, vsh_error *error) {
    vshi_volume_bake *bake = m->bake;
    uint64_t *shaded = bake->fill.shaded[block];
    const uint64_t *mask = bake->blocks[block].mask;
    VSHI_TRY(read(from, shaded, sizeof bake->fill.shaded[block], error));
    for (int i = 0; i < VSHI_MASK_WORDS; ++i) {
        if ((shaded[i] & ~mask[i]) != 0) {
            return vshi_part_damaged(from->path, "voxels that there are none of", error);
        }
    }
    const size_t count = vshi_mask_count(shaded), open = vshi_mask_count(mask) - count;
    if (open > 0) {
        const size_t bytes = (open + 3) / 4 * 4;
        VSHI_TRY(vshi_allocate((void **)&m->reaches[block], bytes, 1, "volume", error));
        VSHI_TRY(read(from, m->reaches[block], bytes, error));
    }
    for (size_t c = 0; c < bake->channel_count; ++c) {
        VSHI_TRY(read_channel(m, from, c, block, count, error));
    }
    if (open == 0) {
        vshi_volume_settle(bake->volume, block, shaded); /* uniform ones give their memory back */
    }
    return vshi_job_advance(m->job, SET_UNITS) ? vshi_job_fail_cancelled(m->job, error) : VSH_OK;
}

/* Over all of a part: whether it is whole, and its statistics. */
static vsh_result look_over(vshi_part_input *input, const vsh_run *run, vsh_shade_stats *stats,
                            vsh_error *error) {
    vshi_part_code tail;
    vsh_result result;
    VSHI_TRY(vshi_part_input_pass_body(input, true, run, error));
    VSHI_TRY_DONE(vshi_part_input_tail(input, run, &tail, error));
    vshi_volume_stats_code(&tail, stats);
    result = tail.failed || tail.size != tail.room ? vshi_part_damaged(input->path, "its statistics", error)
                                                   : vshi_part_input_check_sum(input, error);
done:
    free(tail.bytes);
    return result;
}

static vsh_result read_blocks(merging *m, const vshi_part_input *input, const vshi_volume_head *head,
                              vsh_error *error) {
    body from = {.path = input->path, .left = input->front.body_bytes};
    VSHI_TRY(vshi_part_reopen(from.path, sizeof input->front + input->front.head_bytes, &from.file, error));
    vsh_result result = VSH_OK;
    for (; m->next < head->end && result == VSH_OK; ++m->next) {
        result = read_block(m, &from, (size_t)m->next, error);
    }
    if (result == VSH_OK && from.left > 0) {
        result = vshi_part_damaged(from.path, "more than its blocks", error);
    }
    fclose(from.file);
    return result;
}

static vsh_result take_part(merging *m, const char *path, int32_t shard, vsh_error *error) {
    vshi_part_input input;
    vshi_part_about about;
    vshi_volume_head head;
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vsh_part_options own = *m->parts;
    bool idle = false;
    vsh_result result;
    VSHI_TRY_DONE(vshi_part_input_open(path, m->run, &input, &about, error));
    vshi_volume_head_code(&input.head, &head);
    idle = shard > head.working;
    own.attribute_count = idle ? 0 : own.attribute_count;
    VSHI_TRY_DONE(vshi_part_about_check(&about, path, VSHI_PART_VOLUME, shard, &own, error));
    VSHI_TRY_DONE(vshi_part_input_end_head(&input, error));
    VSHI_TRY_DONE(check_working(m, &head, path, error));
    VSHI_TRY_DONE(idle ? check_idle(&head, path, error) : check_head(m, &head, path, error));
    VSHI_TRY_DONE(look_over(&input, m->run, &stats, error));
    VSHI_TRY_DONE(read_blocks(m, &input, &head, error));
    vshi_shade_stats_add(&m->bake->stats, &stats);
done:
    vshi_part_about_free(&about);
    vshi_part_input_close(&input);
    return result;
}

static vsh_result take_parts(merging *m, vsh_error *error) {
    for (int32_t i = 1; i <= m->parts->shard_count; ++i) {
        char *path = vshi_part_path(m->parts->parts, i, m->parts->shard_count);
        if (path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
        }
        const vsh_result result = take_part(m, path, i, error);
        free(path);
        VSHI_TRY(result);
    }
    return m->next == m->bake->block_count
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT, "%s: blocks from %" PRIu64 " on are in none of its parts",
                           m->parts->parts, m->next);
}

static vsh_result merge(merging *m, const vsh_light *lights, vsh_error *error) {
    vshi_volume_bake *bake = m->bake;
    const size_t blocks = bake->block_count;
    m->job = vshi_job_begin(m->run, "merge", (SET_UNITS + FILL_UNITS) * blocks);
    if (m->job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "volume: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(vshi_volume_open(bake, lights, m->run, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&m->reaches, blocks, sizeof *m->reaches, "volume", error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&m->channels, bake->channel_count, sizeof *m->channels, "volume", error));
    vshi_volume_describe(bake, lights, m->channels);
    bake->fill.given = m->reaches;
    VSHI_TRY_DONE(take_parts(m, error));
    result = vshi_volume_finish(bake, m->job, FILL_UNITS, error);
done:
    for (size_t b = 0; m->reaches != NULL && b < blocks; ++b) {
        free(m->reaches[b]);
    }
    free(m->reaches);
    free(m->channels);
    vshi_fill_end(&bake->fill);
    vshi_job_end(m->job);
    return result;
}

/* What the first part that is there says of itself. */
static vsh_result read_first(const char *parts, int32_t shard_count, const vsh_run *run,
                             vshi_volume_head *head, vsh_error *error) {
    char *path;
    VSHI_TRY(vshi_parts_first(parts, shard_count, &path, error));
    vshi_part_input input;
    vshi_part_about about;
    vsh_result result;
    VSHI_TRY_DONE(vshi_part_input_open(path, run, &input, &about, error));
    if (strcmp(about.kind, VSHI_PART_VOLUME) != 0) {
        result =
            vshi_fail(error, VSH_ERROR_INPUT, "%s: is a part of a %.32s, not of a volume", path, about.kind);
        goto done;
    }
    vshi_volume_head_code(&input.head, head);
    result = vshi_part_input_end_head(&input, error);
done:
    vshi_part_about_free(&about);
    vshi_part_input_close(&input);
    free(path);
    return result;
}

vsh_result vsh_volume_part_casters_sized(const char *parts, int32_t shard_count, const vsh_run *run,
                                         vsh_occluders_info *casters, size_t casters_size, vsh_error *error) {
    VSHI_NEEDS(parts);
    VSHI_NEEDS(casters);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    vsh_part_options options = vsh_part_options_default();
    options.shard_count = shard_count;
    VSHI_TRY(vshi_part_check_options(&options, true, error));
    vshi_volume_head head;
    VSHI_TRY(read_first(parts, shard_count, &full, &head, error));
    const vsh_occluders_info info = {.voxel_size = head.voxel_size,
                                     .levels = head.levels,
                                     .active_voxels = head.active_voxels,
                                     .field_bytes = head.field_bytes,
                                     .has_triangles = head.has_triangles};
    vshi_give(casters, casters_size, &info, sizeof info);
    return VSH_OK;
}

vsh_result vsh_volume_merge(const vsh_voxels *voxels, const vsh_light *lights, size_t light_count,
                            const vsh_volume_options *options, const vsh_part_options *parts,
                            const vsh_run *run, vsh_volume **volume, vsh_shade_stats *stats,
                            vsh_error *error) {
    VSHI_FLOATS;
    VSHI_NEEDS(volume);
    *volume = NULL;
    VSHI_NEEDS(voxels);
    VSHI_NEEDS_OF(light_count, lights);
    VSHI_NEEDS(parts);
    vsh_part_options own = vsh_part_options_default();
    VSHI_TRY(vshi_options_resolve(parts, &own, sizeof own, "vsh_part_options", error));
    VSHI_NEEDS(own.parts);
    VSHI_TRY(vshi_part_check_options(&own, true, error));
    if (own.shard_count == 0) {
        VSHI_TRY(vshi_parts_count(own.parts, &own.shard_count, error));
    }
    VSHI_TRY(vshi_parts_check_there(own.parts, own.shard_count, error));
    vsh_run full;
    vshi_volume_bake bake;
    VSHI_TRY(vshi_volume_set_up(&bake, NULL, voxels, lights, light_count, options, run, &full, error));
    merging m = {.bake = &bake, .parts = &own, .run = &full};
    VSHI_TRY(read_first(own.parts, own.shard_count, &full, &m.first, error));
    bake.caster_voxel_size = m.first.field_voxel_size;
    bake.has_triangles = m.first.traced != 0;
    const vsh_result result = merge(&m, lights, error);
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
