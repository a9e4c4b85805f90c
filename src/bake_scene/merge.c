#include "bake_scene/merge.h"

#include "bake/part.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *vshi_parts_name(const vsh_bake_job *job) {
    return job->options.parts != NULL ? job->options.parts
           : job->targets.count > 0   ? job->lightmaps[0].output
                                      : job->scene.receivers[0].output; /* of a shard without rows */
}

vshi_part_options vshi_job_part_options(const vsh_bake_job *job, int32_t count) {
    vshi_part_options options = {.parts = vshi_parts_name(job),
                                 .shard = job->options.shard,
                                 .shard_count = count,
                                 .words = job->options.words,
                                 .word_count = job->options.word_count};
    options.attributes = vsh_provenance_attributes(job->provenance, &options.attribute_count);
    return options;
}

void vshi_parts_free(vshi_parts *parts) {
    for (size_t i = 0; parts->list != NULL && i < parts->count; ++i) {
        vshi_part_free(&parts->list[i]);
    }
    free(parts->places);
    free(parts->list);
    *parts = (vshi_parts){.list = NULL};
}

/* --- whether they are the job's */

static vsh_result check_lightmaps(const vsh_bake_job *job, const vshi_part *part, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    if (head->lightmap_count != job->targets.count || head->error_count != job->report.error_count) {
        return vshi_fail(
            error, VSH_ERROR_INPUT,
            "%s: is of other inputs or options: of %llu lightmaps, not of %zu; bake this part again",
            part->path, (unsigned long long)head->lightmap_count, job->targets.count);
    }
    for (size_t i = 0; i < job->targets.count; ++i) {
        const vsh_job_lightmap *own = &job->lightmaps[i];
        const vshi_part_lightmap *lightmap = &head->lightmaps[i];
        if (lightmap->width != own->width || lightmap->height != own->height ||
            lightmap->mesh_count != own->mesh_count || lightmap->covered != own->covered ||
            lightmap->samples != own->samples) {
            return vshi_fail(
                error, VSH_ERROR_INPUT,
                "%s: is of other inputs or options: its lightmap %s is of %d × %d texels, %llu of "
                "them covered, not of %d × %d and %llu; bake this part again",
                part->path, own->output, lightmap->width, lightmap->height,
                (unsigned long long)lightmap->covered, own->width, own->height,
                (unsigned long long)own->covered);
        }
    }
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(&job->scene, 1, 1, &channels, error));
    const bool same = (uint64_t)channels.image.channel_count == head->channel_count;
    for (int32_t c = 0; c < channels.image.channel_count; ++c) {
        if (!same || strcmp(channels.names[c], head->channels[c]) != 0) {
            result = vshi_part_refuse(part->path, "channel", same ? head->channels[c] : "another",
                                      channels.names[c], error);
            goto done;
        }
    }
done:
    vshi_channels_free(&channels);
    return result;
}

/* What casts is the same for all of them, and told of by the first. */
static vsh_result check_casters(const vshi_part *part, const vshi_part *first, vsh_error *error) {
    const vshi_part_head *a = &part->head, *b = &first->head;
    if (a->voxel_size == b->voxel_size && a->has_triangles == b->has_triangles &&
        a->active_voxels == b->active_voxels && a->levels == b->levels) {
        return VSH_OK;
    }
    char theirs[64], ours[64];
    snprintf(theirs, sizeof theirs, "%.9g, %llu of them", a->voxel_size,
             (unsigned long long)a->active_voxels);
    snprintf(ours, sizeof ours, "%.9g, %llu of them", b->voxel_size, (unsigned long long)b->active_voxels);
    return vshi_part_refuse(part->path, "voxel size", theirs, ours, error);
}

/* AO is left at the ends of all pieces of a lightmap, or at none; what is kept of it finishes these planes.
 */
static vsh_result check_left(const vsh_bake_job *job, const vshi_part *part, const vshi_part *first,
                             vsh_error *error) {
    const vsh_lightmap planes = vshi_channels_shape(&job->scene);
    if (part->head.kinds != (int32_t)vshi_part_kinds(&planes)) {
        return vshi_part_damaged(part->path, "rays of AO of other channels", error);
    }
    for (uint64_t i = 0; i < part->head.lightmap_count; ++i) {
        if (part->head.lightmaps[i].left != first->head.lightmaps[i].left) {
            return vshi_part_damaged(part->path, "AO that other parts know nothing of", error);
        }
    }
    return VSH_OK;
}

/* Parts are of the job's inputs, and of the first one's casters. */
static vsh_result check_part(const vsh_bake_job *job, const vshi_part *part, const vshi_part *first,
                             int32_t shard, int32_t count, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    const vshi_part_options own = vshi_job_part_options(job, count);
    VSHI_TRY(vshi_part_about_check(&head->about, part->path, shard, &own, error));
    VSHI_TRY(check_lightmaps(job, part, error));
    VSHI_TRY(check_casters(part, first, error));
    return check_left(job, part, first, error);
}

/* --- all of them together */

static int compare_places(const void *left, const void *right) {
    const vshi_part_place *a = left, *b = right;
    if (a->lightmap != b->lightmap) {
        return a->lightmap < b->lightmap ? -1 : 1;
    }
    return a->first != b->first ? (a->first < b->first ? -1 : 1) : 0;
}

static vsh_result place_all(const vsh_bake_job *job, vshi_parts *parts, vsh_error *error) {
    size_t count = 0;
    for (size_t p = 0; p < parts->count; ++p) {
        count += (size_t)parts->list[p].head.piece_count;
    }
    VSHI_TRY(vshi_allocate((void **)&parts->places, count + 1, sizeof *parts->places, "parts", error));
    for (size_t p = 0; p < parts->count; ++p) {
        const vshi_part_head *head = &parts->list[p].head;
        for (size_t i = 0; i < head->piece_count; ++i) {
            const vshi_part_piece *piece = &head->pieces[i];
            parts->places[parts->place_count++] =
                (vshi_part_place){p, i, piece->lightmap, piece->first, piece->first + piece->rows};
        }
    }
    qsort(parts->places, parts->place_count, sizeof *parts->places, compare_places);
    size_t at = 0;
    for (size_t i = 0; i < job->targets.count; ++i) {
        int32_t row = 0;
        for (; at < parts->place_count && parts->places[at].lightmap == i; ++at) {
            if (parts->places[at].first != row) {
                return vshi_fail(error, VSH_ERROR_INPUT,
                                 "%s: damaged: its rows of %s begin at %d, and those before end at %d; bake "
                                 "this part again",
                                 parts->list[parts->places[at].part].path, job->lightmaps[i].output,
                                 parts->places[at].first, row);
            }
            row = parts->places[at].end;
        }
        if (row != job->lightmaps[i].height) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: rows %d to %d are in no part of %s",
                             job->lightmaps[i].output, row, job->lightmaps[i].height - 1,
                             vshi_parts_name(job));
        }
    }
    return VSH_OK;
}

/* What the report tells of casters, which are not made. */
static vsh_result take_casters(vsh_bake_job *job, const vshi_part_head *head, vsh_error *error) {
    vsh_occluders_info *casters = &job->report.occluders;
    casters->voxel_size = head->voxel_size;
    casters->has_triangles = head->has_triangles;
    casters->active_voxels = head->active_voxels;
    casters->field_bytes = head->field_bytes;
    casters->levels = head->levels;
    return vshi_job_make_errors(job, error);
}

vsh_result vshi_parts_open(vsh_bake_job *job, int32_t count, const vsh_run *run, vshi_parts *parts,
                           vsh_error *error) {
    const char *name = vshi_parts_name(job);
    *parts = (vshi_parts){.count = (size_t)count};
    VSHI_TRY(vshi_allocate((void **)&parts->list, parts->count, sizeof *parts->list, "parts", error));
    for (int32_t i = 0; i < count; ++i) {
        vshi_part *part = &parts->list[i];
        char *path = vshi_part_path(name, i + 1, count);
        const vsh_result result =
            path != NULL ? vshi_part_open(path, run, part, error)
                         : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        free(path);
        VSHI_TRY(result);
        if (i == 0) {
            VSHI_TRY(take_casters(job, &part->head, error));
            VSHI_TRY(vshi_job_find_provenance(job, run, error));
        }
        VSHI_TRY(check_part(job, part, &parts->list[0], i + 1, count, error));
    }
    return place_all(job, parts, error);
}

vsh_result vsh_bake_job_merge(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    VSHI_NEEDS(job);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    int32_t count = job->options.shard_count;
    if (count == 0) {
        VSHI_TRY(vshi_parts_count(vshi_parts_name(job), &count, error));
    }
    VSHI_TRY(vshi_parts_check_there(vshi_parts_name(job), count, error)); /* before what takes a while */
    job->merges = true;
    if (!job->measured) {
        VSHI_TRY(vshi_job_measure(job, true, &full, error));
    }
    vshi_parts parts;
    const double start = vshi_seconds();
    vsh_result result;
    VSHI_TRY_DONE(vshi_parts_open(job, count, &full, &parts, error));
    job->report.load_s += vshi_seconds() - start;
    job->parts = &parts;
    result = vshi_job_bake_all(job, &full, error);
    job->parts = NULL;
done:
    vshi_parts_free(&parts);
    return result;
}
