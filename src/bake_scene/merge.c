#include "bake_scene/merge.h"

#include "bake/part.h"
#include "bake_scene/shares.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_TOLD = 6 }; /* parts that are missing */

const char *vshi_parts_name(const vsh_bake_job *job) {
    return job->options.parts != NULL ? job->options.parts : job->lightmaps[0].output;
}

void vshi_parts_free(vshi_parts *parts) {
    for (size_t i = 0; parts->list != NULL && i < parts->count; ++i) {
        vshi_part_free(&parts->list[i]);
    }
    free(parts->places);
    free(parts->list);
    *parts = (vshi_parts){.list = NULL};
}

/* --- which there are */

/* N of "NAME.I-of-N.part"; 0: it is no such name. */
static int32_t count_of_name(const char *entry, const char *name) {
    const size_t length = strlen(name);
    int shard = 0, count = 0, used = 0;
    if (strncmp(entry, name, length) != 0 || entry[length] != '.' ||
        sscanf(entry + length, ".%5d-of-%5d.part%n", &shard, &count, &used) != 2 || used == 0 ||
        entry[length + (size_t)used] != '\0') {
        return 0;
    }
    return shard >= 1 && shard <= count && count <= VSHI_MOST_SHARDS ? count : 0;
}

vsh_result vshi_parts_count(const char *parts, int32_t *count, vsh_error *error) {
    *count = 0;
    const char *slash = strrchr(parts, '/');
    char *folder = slash == NULL ? strdup(".") : strndup(parts, slash == parts ? 1 : (size_t)(slash - parts));
    if (folder == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
    }
    DIR *open = opendir(folder);
    free(folder);
    if (open == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its folder cannot be read: %s", parts, strerror(errno));
    }
    int32_t other = 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        const int32_t found = count_of_name(entry->d_name, slash != NULL ? slash + 1 : parts);
        other = found != 0 && *count != 0 && found != *count ? found : other;
        *count = found != 0 && *count == 0 ? found : *count;
    }
    closedir(open);
    if (other != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: there are parts of %d and of %d shards beside it; say which, by their number",
                         parts, *count < other ? *count : other, *count < other ? other : *count);
    }
    return *count != 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: there are no parts beside it, %s.1-of-N.part and so on", parts, parts);
}

/* Names those that are missing. */
static vsh_result check_there(const char *name, int32_t count, vsh_error *error) {
    char list[256] = "";
    size_t at = 0;
    int32_t missing = 0;
    for (int32_t i = 1; i <= count; ++i) {
        char *path = vshi_part_path(name, i, count);
        if (path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        }
        if (access(path, F_OK) != 0 && ++missing <= MOST_TOLD && at < sizeof list) {
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%d", missing > 1 ? ", " : "", i);
        }
        free(path);
    }
    if (missing == 0) {
        return VSH_OK;
    }
    if (missing > MOST_TOLD && at < sizeof list) {
        snprintf(list + at, sizeof list - at, " and %d more", missing - MOST_TOLD);
    }
    return vshi_fail(error, VSH_ERROR_READ, "%s: %s missing: %s of %d; bake %s by --shard I/%d", name,
                     missing == 1 ? "a part is" : "parts are", list, count, missing == 1 ? "it" : "them",
                     count);
}

/* --- whether they are the job's */

static vsh_result refuse_options(const vshi_part *part, const char *name, const char *theirs,
                                 const char *ours, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: is of other inputs or options: its %s is '%.160s', of the others or here '%.160s'; "
                     "bake this part again",
                     part->path, name, theirs, ours);
}

static vsh_result check_attributes(const vsh_bake_job *job, const vshi_part *part, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    size_t count;
    const vsh_attribute *own = vsh_provenance_attributes(job->provenance, &count);
    for (size_t i = 0; i < count || i < head->attribute_count; ++i) {
        const bool both = i < count && i < head->attribute_count;
        if (both && strcmp(own[i].name, head->attributes[i].name) == 0 &&
            strcmp(own[i].value, head->attributes[i].value) == 0) {
            continue;
        }
        return refuse_options(part, i < count ? own[i].name : head->attributes[i].name,
                              i < head->attribute_count ? head->attributes[i].value : "",
                              i < count ? own[i].value : "", error);
    }
    return VSH_OK;
}

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
            result = refuse_options(part, "channel", same ? head->channels[c] : "another", channels.names[c],
                                    error);
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
    return refuse_options(part, "voxel size", theirs, ours, error);
}

static vsh_result check_number(const vshi_part *part, int32_t shard, int32_t count, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    if (strcmp(head->version, vsh_version()) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is of vdbshade %.32s, this is %s; bake this part again",
                         part->path, head->version, vsh_version());
    }
    if (head->shard != shard || head->shard_count != count) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds part %d of %d; was it renamed?", part->path,
                         head->shard, head->shard_count);
    }
    return VSH_OK;
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
            path != NULL ? vshi_part_open(path, true, run, part, error)
                         : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        free(path);
        VSHI_TRY(result);
        VSHI_TRY(check_number(part, i + 1, count, error));
        if (i == 0) {
            VSHI_TRY(take_casters(job, &part->head, error));
            VSHI_TRY(vshi_job_find_provenance(job, run, error));
        }
        VSHI_TRY(check_attributes(job, part, error));
        VSHI_TRY(check_lightmaps(job, part, error));
        VSHI_TRY(check_casters(part, &parts->list[0], error));
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
    VSHI_TRY(check_there(vshi_parts_name(job), count, error)); /* before what takes a while */
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
    for (size_t i = 0; i < job->targets.count && result == VSH_OK; ++i) {
        result = vshi_job_bake_one(job, i, &full, error);
    }
    job->parts = NULL;
done:
    vshi_parts_free(&parts);
    return result;
}

/* --- words */

/* The part with the lowest number that is there. */
static char *first_path(const char *parts, int32_t count) {
    for (int32_t i = 1; i <= count; ++i) {
        char *path = vshi_part_path(parts, i, count);
        if (path == NULL || i == count || access(path, F_OK) == 0) {
            return path;
        }
        free(path);
    }
    return NULL;
}

vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                          size_t *count, vsh_error *error) {
    VSHI_NEEDS(words);
    VSHI_NEEDS(count);
    *words = NULL;
    *count = 0;
    VSHI_NEEDS(parts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (shard_count == 0) {
        VSHI_TRY(vshi_parts_count(parts, &shard_count, error));
    }
    char *path = first_path(parts, shard_count);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", parts);
    }
    vshi_part part;
    const vsh_result result = vshi_part_open(path, false, &full, &part, error);
    free(path);
    if (result == VSH_OK) { /* each in memory of its own, behind a NULL that ends the list */
        *words = part.head.words;
        *count = (size_t)part.head.word_count;
        part.head.words = NULL;
        part.head.word_count = 0;
    }
    vshi_part_free(&part);
    return result;
}

void vsh_part_words_free(char **words) {
    for (size_t i = 0; words != NULL && words[i] != NULL; ++i) {
        free(words[i]);
    }
    free(words);
}
