#include "bake_scene/part_job.h"

#include "bake/part.h"
#include "bake_scene/merge.h"
#include "bake_scene/shares.h"
#include "base/memory.h"
#include "base/try.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* --- its head */

/* Pieces and lightmaps of a shard; the lists are the head's. */
static vsh_result list_pieces(const vsh_bake_job *job, vshi_part_head *head, vsh_error *error) {
    const size_t count = job->targets.count;
    VSHI_TRY(vshi_allocate((void **)&head->lightmaps, count + 1, sizeof *head->lightmaps, "part", error));
    head->lightmap_count = count;
    VSHI_TRY(vshi_shares_leave(job, error));
    for (size_t i = 0; i < count; ++i) {
        const vsh_job_lightmap *own = &job->lightmaps[i];
        head->lightmaps[i] = (vshi_part_lightmap){own->width,   own->height,  own->mesh_count,
                                                  own->covered, own->samples, job->shares[i].left};
    }
    return vshi_shares_list(job, &head->pieces, &head->piece_count, error);
}

/* Copies of texts; false where memory is short. */
static bool copy_texts(const char *const *texts, size_t count, char ***copies, uint64_t *copied) {
    *copies = calloc(count + 1, sizeof **copies);
    for (size_t i = 0; *copies != NULL && i < count; ++i, ++*copied) {
        (*copies)[i] = strdup(texts[i]);
        if ((*copies)[i] == NULL) {
            return false;
        }
    }
    return *copies != NULL;
}

static bool copy_channels(const vshi_channels *channels, vshi_part_head *head) {
    return copy_texts(channels->image.names, (size_t)channels->image.channel_count, &head->channels,
                      &head->channel_count);
}

/* Begins the part, whose pieces are the caller's to free also after an error. */
static vsh_result begin_part(vsh_bake_job *job, vshi_part_piece **pieces, size_t *piece_count,
                             vsh_error *error) {
    *pieces = NULL;
    const vsh_occluders_info *casters = &job->report.occluders;
    const vshi_part_options options = vshi_job_part_options(job, job->options.shard_count);
    vshi_part_head head = {.error_count = job->report.error_count,
                           .voxel_size = casters->voxel_size,
                           .active_voxels = casters->active_voxels,
                           .field_bytes = casters->field_bytes,
                           .levels = casters->levels,
                           .has_triangles = casters->has_triangles};
    const vsh_lightmap planes = vshi_channels_shape(&job->scene);
    head.kinds = (int32_t)vshi_part_kinds(&planes);
    vshi_channels channels;
    vsh_result result;
    char *path = vshi_part_path(options.parts, options.shard, options.shard_count);
    VSHI_TRY_DONE(vshi_channels_name(&job->scene, 1, 1, &channels, error));
    VSHI_TRY_DONE(list_pieces(job, &head, error));
    VSHI_TRY_DONE(vshi_part_about_make(&options, &head.about, error));
    if (path == NULL || !copy_channels(&channels, &head)) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
        goto done;
    }
    VSHI_TRY_DONE(vshi_part_writer_create(path, &head, &job->part, error));
    free(job->part_path);
    job->part_path = path;
    path = NULL;
    *pieces = head.pieces;
    *piece_count = (size_t)head.piece_count;
    head.pieces = NULL;
done:
    free(path);
    vshi_part_head_free(&head);
    vshi_channels_free(&channels);
    return result;
}

/* --- what it leaves */

vshi_ao_cut vshi_job_cut(const vsh_bake_job *job, size_t index, int32_t first, int32_t end) {
    const bool shard = job->options.shard > 0;
    const vsh_lightmap planes = vshi_channels_shape(&job->scene);
    return (vshi_ao_cut){.spacing = shard ? job->shares[index].left : 1,
                         .height = job->lightmaps[index].height,
                         .first = first,
                         .end = end,
                         .kinds = vshi_part_kinds(&planes)};
}

void vshi_part_set_kept(const vsh_bake_job *job, size_t index, const vshi_bands *bands, int32_t first,
                        int32_t rows, vshi_channels *channels) {
    const vshi_ao_cut cut = vshi_job_cut(job, index, bands->first, bands->end);
    const int32_t kept = vshi_ao_cut_kept(&cut, first + rows) - vshi_ao_cut_kept(&cut, first);
    channels->kept_bytes = (size_t)kept * (size_t)job->lightmaps[index].width * vshi_ao_kept_bytes(cut.kinds);
}

vsh_result vshi_part_open_kept(const vsh_bake_job *job, size_t index, const vshi_bands *bands,
                               vshi_channels *channels, vsh_error *error) {
    size_t most = 0;
    if (job->shares[index].left <= 1) {
        return VSH_OK;
    }
    for (int32_t first = bands->first, rows; first < bands->end; first += rows) {
        rows = bands->end - first < bands->rows ? bands->end - first : bands->rows;
        vshi_part_set_kept(job, index, bands, first, rows, channels);
        most = channels->kept_bytes > most ? channels->kept_bytes : most;
    }
    return vshi_allocate(&channels->kept, most + 1, 1, job->lightmaps[index].output, error);
}

/* --- its rows */

static vsh_result begin(void *user, const vsh_job_lightmap *lightmap, const vsh_image *image,
                        vsh_error *error) {
    (void)user;
    (void)lightmap;
    (void)image;
    (void)error;
    return VSH_OK;
}

static vsh_result add(void *user, int32_t rows, const float *const *planes, vsh_error *error) {
    const vshi_part_sink *part = user;
    (void)error; /* what could not be written is told at the end */
    vshi_part_writer_add(part->job->part, part->lightmap->width, rows, planes, part->channels->known,
                         part->channels->kept);
    return VSH_OK;
}

static vsh_result end(void *user, vsh_result result, vsh_error *error) {
    const vshi_part_sink *part = user;
    return result == VSH_OK ? vshi_part_writer_piece(part->job->part, part->baked, error) : result;
}

vsh_row_sink vshi_part_sink_of(vshi_part_sink *part) {
    return (vsh_row_sink){sizeof(vsh_row_sink), begin, add, end, part};
}

static vsh_result bake_pieces(vsh_bake_job *job, const vshi_part_piece *pieces, size_t count,
                              const vsh_run *run, vsh_error *error) {
    job->pieces = pieces;
    vsh_result result = VSH_OK;
    for (job->piece = 0; job->piece < count && result == VSH_OK; ++job->piece) {
        result = vshi_job_bake_one(job, (size_t)pieces[job->piece].lightmap, run, error);
    }
    job->pieces = NULL;
    return result;
}

static void tell_writing(const vsh_bake_job *job, const char *path) {
    if (job->options.writing != NULL) {
        job->options.writing(job->options.user, path);
    }
}

vsh_result vshi_job_bake_part(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    vshi_part_piece *pieces;
    size_t count = 0;
    vsh_result result;
    VSHI_TRY_DONE(begin_part(job, &pieces, &count, error));
    tell_writing(job, job->part_path);
    result = bake_pieces(job, pieces, count, run, error);
    vshi_part_writer *part = job->part;
    job->part = NULL;
    if (result == VSH_OK) {
        result = vshi_part_writer_finish(part, error);
    } else {
        vshi_part_writer_abandon(part);
    }
    tell_writing(job, NULL);
done:
    free(pieces);
    return result;
}
