#include "bake_scene/parts.h"

#include "bake_scene/part_tile.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"

#include <inttypes.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A lightmap of the job that a part is of. */
typedef struct part_lightmap {
    int32_t width, height;
    uint64_t mesh_count, covered, samples; /* as in vsh_job_lightmap */
} part_lightmap;

/* All of it is owned. */
typedef struct part_head {
    vshi_part_about about;
    char **channels; /* [channel_count]: names */
    uint64_t channel_count;
    uint64_t error_count; /* as in vsh_bake_report */
    double voxel_size;    /* these of what cast, as in vsh_occluders_info */
    uint64_t active_voxels, field_bytes;
    int32_t levels, has_triangles;
    int32_t layered_ao;       /* as of the job */
    part_lightmap *lightmaps; /* [lightmap_count] */
    uint64_t lightmap_count;
} part_head;

/* --- the head */

static void code_head(vshi_part_code *code, part_head *head) {
    vshi_part_code_texts(code, &head->channels, &head->channel_count);
    vshi_part_code_u64(code, &head->error_count);
    vshi_part_code_f64(code, &head->voxel_size);
    vshi_part_code_u64(code, &head->active_voxels);
    vshi_part_code_u64(code, &head->field_bytes);
    vshi_part_code_i32(code, &head->levels);
    vshi_part_code_i32(code, &head->has_triangles);
    vshi_part_code_i32(code, &head->layered_ao);
    vshi_part_code_count(code, &head->lightmap_count, sizeof(uint64_t), (void **)&head->lightmaps,
                         sizeof *head->lightmaps);
    for (uint64_t i = 0; i < head->lightmap_count && !code->failed; ++i) {
        part_lightmap *lightmap = &head->lightmaps[i];
        vshi_part_code_i32(code, &lightmap->width);
        vshi_part_code_i32(code, &lightmap->height);
        vshi_part_code_u64(code, &lightmap->mesh_count);
        vshi_part_code_u64(code, &lightmap->covered);
        vshi_part_code_u64(code, &lightmap->samples);
    }
}

static void free_head(part_head *head) {
    for (uint64_t i = 0; i < head->channel_count && head->channels != NULL; ++i) {
        free(head->channels[i]);
    }
    free(head->lightmaps);
    free(head->channels);
    vshi_part_about_free(&head->about);
    *head = (part_head){.channel_count = 0};
}

/* What parts' files are named after: the options' name, or the first lightmap's output. */
static const char *parts_name(const vsh_bake_job *job) {
    return job->options.parts != NULL ? job->options.parts
           : job->targets.count > 0   ? job->lightmaps[0].output
                                      : job->scene.receivers[0].output;
}

/* What its parts' files say of themselves, of `count` shards. */
static vshi_part_options options_of(const vsh_bake_job *job, int32_t count) {
    vshi_part_options options = {.parts = parts_name(job),
                                 .shard = job->options.shard,
                                 .shard_count = count,
                                 .words = job->options.words,
                                 .word_count = job->options.word_count};
    options.attributes = vsh_provenance_attributes(job->provenance, &options.attribute_count);
    return options;
}

static vsh_result copy_channels(const vshi_channels *channels, part_head *head, vsh_error *error) {
    const size_t count = (size_t)channels->image.channel_count;
    VSHI_TRY(vshi_allocate((void **)&head->channels, count + 1, sizeof *head->channels, "part", error));
    for (; head->channel_count < count; ++head->channel_count) {
        head->channels[head->channel_count] = strdup(channels->names[head->channel_count]);
        if (head->channels[head->channel_count] == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
        }
    }
    return VSH_OK;
}

static vsh_result make_head(const vsh_bake_job *job, part_head *head, vsh_error *error) {
    const vsh_occluders_info *casters = &job->report.occluders;
    const vshi_part_options options = options_of(job, job->options.shard_count);
    const size_t count = job->targets.count;
    *head = (part_head){.error_count = job->report.error_count,
                        .voxel_size = casters->voxel_size,
                        .active_voxels = casters->active_voxels,
                        .field_bytes = casters->field_bytes,
                        .levels = casters->levels,
                        .has_triangles = casters->has_triangles,
                        .layered_ao = job->layered_ao};
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(&job->scene, 1, 1, &channels, error));
    VSHI_TRY_DONE(copy_channels(&channels, head, error));
    VSHI_TRY_DONE(vshi_part_about_make(&options, &head->about, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&head->lightmaps, count + 1, sizeof *head->lightmaps, "part", error));
    for (; head->lightmap_count < count; ++head->lightmap_count) {
        const vsh_job_lightmap *own = &job->lightmaps[head->lightmap_count];
        head->lightmaps[head->lightmap_count] =
            (part_lightmap){own->width, own->height, own->mesh_count, own->covered, own->samples};
    }
done:
    vshi_channels_free(&channels);
    return result;
}

/* --- writing */

/* The tiles of a lightmap that are the shard's; *number is of the first tile that has texels, and moves on to
 * the next lightmap's. */
static vsh_result list_tiles(const vsh_bake_job *job, const vsh_charts *charts, uint64_t *number,
                             uint32_t **tiles, size_t *count, vsh_error *error) {
    const size_t all = vshi_charts_tiles(&charts->sorted);
    *count = 0;
    VSHI_TRY(vshi_allocate((void **)tiles, all, sizeof **tiles, "part", error));
    for (size_t tile = 0; tile < all; ++tile) {
        const uint64_t shards = (uint64_t)job->options.shard_count;
        if (charts->samples[tile] > 0 && (*number)++ % shards == (uint64_t)job->options.shard - 1) {
            (*tiles)[(*count)++] = (uint32_t)tile;
        }
    }
    return VSH_OK;
}

static void write_held(vshi_part_output *file, const vshi_shots *shots, size_t tile) {
    if (shots->held != NULL && shots->held[tile].count > 0) {
        vshi_part_output_put(file, shots->held[tile].list,
                             shots->held[tile].count * sizeof *shots->held[tile].list);
    }
}

static uint32_t count_held(const vshi_shots *shots, size_t tile) {
    return shots->held != NULL ? (uint32_t)shots->held[tile].count : 0;
}

static void write_tile(vshi_part_output *file, const vshi_job_page *page, size_t tile, unsigned char *bytes) {
    const vshi_page *p = &page->page;
    const vshi_part_tile head = {
        (uint32_t)page->index, (uint32_t)tile, {count_held(&p->ao, tile), count_held(&p->sky, tile)}};
    vshi_part_array arrays[VSHI_PART_ARRAYS];
    const size_t count = vshi_part_list(page, arrays);
    vshi_part_output_put(file, &head, sizeof head);
    vshi_part_output_put(file, &p->stats[tile], sizeof *p->stats);
    vshi_part_output_put(file, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors);
    for (size_t i = 0; i < count; ++i) {
        vshi_part_output_put(file, bytes, vshi_part_copy(page, &arrays[i], tile, bytes, false));
    }
    write_held(file, &p->ao, tile);
    write_held(file, &p->sky, tile);
}

/* What the report counts of the part. */
static void add_tile(vsh_bake_job *job, const vshi_job_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const size_t left = tile % page->charts->sorted.columns * VSHI_TILE,
                 top = tile / page->charts->sorted.columns * VSHI_TILE;
    for (size_t y = top; y < top + VSHI_TILE && y < p->height; ++y) {
        for (size_t x = left; x < left + VSHI_TILE && x < p->width; ++x) {
            job->report.texels += p->state[y * p->width + x] != VSHI_TEXEL_EMPTY;
            job->report.invalid_texels += p->state[y * p->width + x] == VSHI_TEXEL_INVALID;
        }
    }
    vshi_shade_stats_add(&job->report.shade, &p->stats[tile]);
}

static vsh_result bake_lightmap(vsh_bake_job *job, size_t index, uint64_t *number, vshi_part_output *file,
                                const vsh_run *run, vsh_error *error) {
    vsh_run held = *run;
    vshi_store store = {.folder = NULL};
    vshi_job_page page = {.job = job};
    uint32_t *tiles = NULL;
    unsigned char *bytes = NULL;
    size_t count;
    vshi_job *stage = NULL;
    const double start = vshi_seconds();
    vsh_result result;
    VSHI_TRY_DONE(list_tiles(job, job->charts[index], number, &tiles, &count, error));
    if (count == 0) {
        goto done;
    }
    stage = vshi_job_begin(run, "bake", count);
    if (stage == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "lightmaps: the system refused memory");
        goto done;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, VSHI_PART_TILE_MOST, 1, "part", error));
    VSHI_TRY_DONE(vshi_job_store_open(job, index, &held, &store, error));
    VSHI_TRY_DONE(vshi_job_page_open(job, index, &store, &page, error));
    VSHI_TRY_DONE(vshi_name_file(page.target->receiver.path,
                                 vshi_trace_tiles(job->tracer, &page.page, tiles, count, stage, error),
                                 error));
    job->report.bake_s += vshi_seconds() - start;
    for (size_t i = 0; i < count; ++i) {
        write_tile(file, &page, tiles[i], bytes);
        add_tile(job, &page, tiles[i]);
    }
done:
    vshi_job_end(stage);
    vshi_job_page_close(&page);
    vshi_job_store_close(&store);
    free(bytes);
    free(tiles);
    return result;
}

static vsh_result begin_part(const vsh_bake_job *job, const char *path, vshi_part_output *file,
                             vsh_error *error) {
    part_head head;
    vshi_part_code code = {.reads = false};
    vsh_result result;
    VSHI_TRY_DONE(make_head(job, &head, error));
    vshi_part_about_code(&code, &head.about);
    code_head(&code, &head);
    result = vshi_part_output_begin(file, path, &code, error);
done:
    free_head(&head);
    return result;
}

static void tell_writing(const vsh_bake_job *job, const char *path) {
    if (job->options.writing != NULL) {
        job->options.writing(job->options.user, path);
    }
}

vsh_result vshi_job_bake_part(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    vshi_part_output file = {.file = NULL};
    uint64_t number = 0;
    char *path = vshi_part_path(parts_name(job), job->options.shard, job->options.shard_count);
    if (path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
    }
    vsh_result result;
    VSHI_TRY_DONE(begin_part(job, path, &file, error));
    tell_writing(job, path);
    for (size_t i = 0; i < job->targets.count && result == VSH_OK; ++i) {
        result = bake_lightmap(job, i, &number, &file, run, error);
    }
    const double baked = vshi_seconds();
    if (result == VSH_OK) {
        result = vshi_part_output_finish(&file, error);
    } else {
        vshi_part_output_abandon(&file);
    }
    job->report.write_s += vshi_seconds() - baked;
    tell_writing(job, NULL);
done:
    free(path);
    return result;
}

/* --- reading */

typedef struct part {
    char *path;
    part_head head;
    uint64_t at, end; /* of the body that is left, bytes of the file */
} part;

struct vshi_parts {
    part *list; /* [count] */
    size_t count;
    uint64_t number; /* of the first tile of the lightmap that comes next */
};

void vshi_parts_free(vshi_parts *parts) {
    for (size_t i = 0; parts != NULL && parts->list != NULL && i < parts->count; ++i) {
        free_head(&parts->list[i].head);
        free(parts->list[i].path);
    }
    if (parts != NULL) {
        free(parts->list);
        free(parts);
    }
}

/* Reads the head, and checks that the file is what was written. */
static vsh_result open_part(const char *path, const vsh_run *run, part *p, vsh_error *error) {
    vshi_part_input input;
    vsh_result result;
    p->path = strdup(path);
    VSHI_TRY_DONE(vshi_part_input_open(path, run, &input, &p->head.about, error));
    code_head(&input.head, &p->head);
    VSHI_TRY_DONE(vshi_part_input_end_head(&input, error));
    p->at = sizeof input.front + input.front.head_bytes;
    p->end = p->at + input.body_bytes;
    VSHI_TRY_DONE(vshi_part_input_check_body(&input, run, error));
done:
    vshi_part_input_close(&input);
    return result == VSH_OK && p->path == NULL
               ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path)
               : result;
}

static vsh_result check_lightmaps(const vsh_bake_job *job, const part *p, vsh_error *error) {
    const part_head *head = &p->head;
    if (head->lightmap_count != job->targets.count || head->error_count != job->report.error_count) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of other inputs or options: of %" PRIu64
                         " lightmaps, not of %zu; bake this part again",
                         p->path, head->lightmap_count, job->targets.count);
    }
    for (size_t i = 0; i < job->targets.count; ++i) {
        const vsh_job_lightmap *own = &job->lightmaps[i];
        const part_lightmap *lightmap = &head->lightmaps[i];
        if (lightmap->width != own->width || lightmap->height != own->height ||
            lightmap->mesh_count != own->mesh_count || lightmap->covered != own->covered ||
            lightmap->samples != own->samples) {
            return vshi_fail(
                error, VSH_ERROR_INPUT,
                "%s: is of other inputs or options: its lightmap %s is of %d × %d texels, %" PRIu64
                " of them covered, not of %d × %d and %" PRIu64 "; bake this part again",
                p->path, own->output, lightmap->width, lightmap->height, lightmap->covered, own->width,
                own->height, own->covered);
        }
    }
    return VSH_OK;
}

static vsh_result check_channels(const vsh_bake_job *job, const part *p, vsh_error *error) {
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(&job->scene, 1, 1, &channels, error));
    const bool same = (uint64_t)channels.image.channel_count == p->head.channel_count;
    for (int32_t c = 0; c < channels.image.channel_count && result == VSH_OK; ++c) {
        if (!same || strcmp(channels.names[c], p->head.channels[c]) != 0) {
            result = vshi_part_refuse(p->path, "channel", same ? p->head.channels[c] : "another",
                                      channels.names[c], error);
        }
    }
done:
    vshi_channels_free(&channels);
    return result;
}

/* What casts is the same for all of them, and told of by the first. */
static vsh_result check_casters(const part *p, const part *first, vsh_error *error) {
    const part_head *a = &p->head, *b = &first->head;
    if (a->voxel_size == b->voxel_size && a->has_triangles == b->has_triangles &&
        a->active_voxels == b->active_voxels && a->levels == b->levels && a->layered_ao == b->layered_ao) {
        return VSH_OK;
    }
    char theirs[64], ours[64];
    snprintf(theirs, sizeof theirs, "%.9g, %" PRIu64 " of them", a->voxel_size, a->active_voxels);
    snprintf(ours, sizeof ours, "%.9g, %" PRIu64 " of them", b->voxel_size, b->active_voxels);
    return vshi_part_refuse(p->path, "voxel size", theirs, ours, error);
}

/* Checks that a part is of the job's inputs, and of the first one's casters. */
static vsh_result check_part(const vsh_bake_job *job, const part *p, const part *first, int32_t shard,
                             int32_t count, vsh_error *error) {
    const vshi_part_options own = options_of(job, count);
    VSHI_TRY(vshi_part_about_check(&p->head.about, p->path, shard, &own, error));
    VSHI_TRY(check_lightmaps(job, p, error));
    VSHI_TRY(check_channels(job, p, error));
    return check_casters(p, first, error);
}

/* What the report tells of casters, which are not made. */
static vsh_result take_casters(vsh_bake_job *job, const part_head *head, const vsh_run *run,
                               vsh_error *error) {
    vsh_occluders_info *casters = &job->report.occluders;
    casters->voxel_size = head->voxel_size;
    casters->has_triangles = head->has_triangles;
    casters->active_voxels = head->active_voxels;
    casters->field_bytes = head->field_bytes;
    casters->levels = head->levels;
    job->layered_ao = head->layered_ao != 0;
    VSHI_TRY(vshi_job_make_errors(job, error));
    return vshi_job_find_provenance(job, run, error);
}

vsh_result vshi_parts_open(vsh_bake_job *job, int32_t count, const vsh_run *run, vshi_parts **parts,
                           vsh_error *error) {
    const char *name = parts_name(job);
    vshi_parts *made = NULL;
    vsh_result result;
    *parts = NULL;
    VSHI_TRY_DONE(vshi_allocate((void **)&made, 1, sizeof *made, "parts", error));
    made->count = (size_t)count;
    VSHI_TRY_DONE(vshi_allocate((void **)&made->list, made->count, sizeof *made->list, "parts", error));
    for (int32_t i = 0; i < count; ++i) {
        part *p = &made->list[i];
        char *path = vshi_part_path(name, i + 1, count);
        result = path != NULL ? open_part(path, run, p, error)
                              : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        free(path);
        if (result == VSH_OK && i == 0) {
            result = take_casters(job, &p->head, run, error);
        }
        VSHI_TRY_DONE(result == VSH_OK ? check_part(job, p, &made->list[0], i + 1, count, error) : result);
    }
    *parts = made;
    made = NULL;
done:
    vshi_parts_free(made);
    return result;
}

/* --- tiles */

/* A part's tiles of a lightmap under way. */
typedef struct taking {
    part *part;
    FILE *file;
    vshi_job_page *page;
    unsigned char *bytes; /* [VSHI_PART_TILE_MOST] */
} taking;

static vsh_result take_bytes(const taking *t, void *bytes, size_t size, vsh_error *error) {
    if (size > t->part->end - t->part->at) {
        return vshi_part_damaged(t->part->path, "its tiles", error);
    }
    t->part->at += size;
    return vshi_part_read_bytes(t->file, t->part->path, bytes, size, error);
}

static vsh_result take_held(const taking *t, vshi_shots *shots, size_t tile, uint32_t count,
                            vsh_error *error) {
    if (count == 0) {
        return VSH_OK;
    }
    if (shots->held == NULL || shots->held[tile].list != NULL || count > VSHI_TILE * VSHI_TILE) {
        return vshi_part_damaged(t->part->path, "its tiles", error);
    }
    vshi_held_texels *held = &shots->held[tile];
    VSHI_TRY(vshi_allocate((void **)&held->list, count, sizeof *held->list, t->part->path, error));
    held->count = count;
    return take_bytes(t, held->list, count * sizeof *held->list, error);
}

static vsh_result take_tile(const taking *t, const vshi_part_tile *head, vsh_error *error) {
    vshi_page *p = &t->page->page;
    const size_t tile = head->tile;
    vshi_part_array arrays[VSHI_PART_ARRAYS];
    const size_t count = vshi_part_list(t->page, arrays);
    VSHI_TRY(take_bytes(t, &p->stats[tile], sizeof *p->stats, error));
    VSHI_TRY(take_bytes(t, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(take_bytes(t, t->bytes, vshi_part_copy(t->page, &arrays[i], tile, t->bytes, false), error));
        vshi_part_copy(t->page, &arrays[i], tile, t->bytes, true);
    }
    VSHI_TRY(take_held(t, &p->ao, tile, head->held[0], error));
    return take_held(t, &p->sky, tile, head->held[1], error);
}

/* Beside the number of a tile's shard, + 1: it was taken. */
#define TAKEN UINT32_C(0x80000000)

/* Takes the tiles that a part has of a lightmap, whose shards owner[tiles] tells, + 1; 0: no texels. */
static vsh_result take_part(const taking *t, uint32_t *owner, uint32_t shard, vshi_job *job,
                            vsh_error *error) {
    const size_t tiles = vshi_charts_tiles(&t->page->charts->sorted);
    while (t->part->at < t->part->end) {
        vshi_part_tile head;
        VSHI_TRY(take_bytes(t, &head, sizeof head, error));
        if (head.lightmap != t->page->index) {
            t->part->at -= sizeof head;
            return head.lightmap > t->page->index ? VSH_OK
                                                  : vshi_part_damaged(t->part->path, "its tiles", error);
        }
        if (head.tile >= tiles || owner[head.tile] != shard + 1) {
            return vshi_part_damaged(t->part->path, "its tiles", error);
        }
        owner[head.tile] |= TAKEN;
        VSHI_TRY(take_tile(t, &head, error));
        VSHI_TRY(vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    return VSH_OK;
}

/* Tiles that were taken, to be rasterized and checked. */
typedef struct checking {
    const vshi_parts *parts;
    vshi_job_page *page;
    const uint32_t *owner;
    _Atomic size_t failed; /* the first tile that could not be; SIZE_MAX: none */
} checking;

static vsh_result check_tile(const checking *c, size_t tile, vsh_error *error) {
    VSHI_TRY(vshi_page_rasterize(&c->page->page, tile, error));
    return vshi_part_check_tile(c->page, tile, c->parts->list[(c->owner[tile] & ~TAKEN) - 1].path, error);
}

static void check_tiles(void *user, size_t begin, size_t end) {
    checking *c = user;
    for (size_t tile = begin; tile < end; ++tile) {
        if (c->owner[tile] == 0 || check_tile(c, tile, NULL) == VSH_OK) {
            continue;
        }
        size_t first = c->failed;
        while (tile < first && !atomic_compare_exchange_weak(&c->failed, &first, tile)) {
        }
    }
}

static vsh_result take_all(vshi_parts *parts, vshi_job_page *page, uint32_t *owner, unsigned char *bytes,
                           vshi_job *job, vsh_error *error) {
    const size_t tiles = vshi_charts_tiles(&page->charts->sorted);
    for (size_t tile = 0; tile < tiles; ++tile) {
        if (page->charts->samples[tile] > 0) {
            owner[tile] = (uint32_t)(parts->number++ % parts->count) + 1;
        }
    }
    for (size_t i = 0; i < parts->count; ++i) {
        taking t = {.part = &parts->list[i], .page = page, .bytes = bytes};
        VSHI_TRY(vshi_part_reopen(t.part->path, t.part->at, &t.file, error));
        const vsh_result result = take_part(&t, owner, (uint32_t)i, job, error);
        fclose(t.file);
        VSHI_TRY(result);
    }
    for (size_t tile = 0; tile < tiles; ++tile) {
        if (owner[tile] != 0 && (owner[tile] & TAKEN) == 0) {
            return vshi_part_damaged(parts->list[owner[tile] - 1].path, "a tile is missing", error);
        }
    }
    checking c = {.parts = parts, .page = page, .owner = owner, .failed = SIZE_MAX};
    VSHI_TRY(vshi_parallel_for(job, tiles, 1, 0, check_tiles, &c, error));
    return c.failed == SIZE_MAX ? VSH_OK : check_tile(&c, c.failed, error);
}

vsh_result vshi_parts_take(vshi_parts *parts, vshi_job_page *page, vshi_job *job, vsh_error *error) {
    uint32_t *owner = NULL;
    unsigned char *bytes = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&owner, vshi_charts_tiles(&page->charts->sorted), sizeof *owner,
                                "parts", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, VSHI_PART_TILE_MOST, 1, "parts", error));
    result = take_all(parts, page, owner, bytes, job, error);
done:
    free(bytes);
    free(owner);
    return result;
}

vsh_result vsh_bake_job_merge(vsh_bake_job *job, const vsh_run *run, vsh_error *error) {
    VSHI_NEEDS(job);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    int32_t count = job->options.shard_count;
    if (count == 0) {
        VSHI_TRY(vshi_parts_count(parts_name(job), &count, error));
    }
    VSHI_TRY(vshi_parts_check_there(parts_name(job), count, error)); /* before what takes a while */
    job->merges = true;
    if (!job->measured) {
        VSHI_TRY(vshi_job_measure(job, true, &full, error));
    }
    const double start = vshi_seconds();
    VSHI_TRY(vshi_parts_open(job, count, &full, &job->parts, error));
    job->report.load_s += vshi_seconds() - start;
    const vsh_result result = vshi_job_bake_all(job, &full, error);
    vshi_parts_free(job->parts);
    job->parts = NULL;
    return result;
}
