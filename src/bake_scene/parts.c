#include "bake_scene/parts.h"

#include "bake/planes.h"
#include "base/clock.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/try.h"
#include "shade/ao.h"

#include <inttypes.h>
#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A lightmap of the job that a part is of. */
typedef struct part_lightmap {
    int32_t width, height;
    uint64_t mesh_count, covered, samples; /* as in vsh_scene_lightmap */
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
static const char *parts_name(const vshi_scene_bake *bake) {
    return bake->options.parts != NULL ? bake->options.parts
           : bake->targets.count > 0   ? bake->lightmaps[0].output
                                       : bake->scene.receivers[0].output;
}

/* What its parts' files say of themselves, of `count` shards. */
static vshi_part_options options_of(const vshi_scene_bake *bake, int32_t count) {
    vshi_part_options options = {.parts = parts_name(bake),
                                 .shard = bake->options.shard,
                                 .shard_count = count,
                                 .words = bake->options.words,
                                 .word_count = bake->options.word_count};
    options.attributes = vsh_provenance_attributes(bake->provenance, &options.attribute_count);
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

static vsh_result make_head(const vshi_scene_bake *bake, part_head *head, vsh_error *error) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    const vshi_part_options options = options_of(bake, bake->options.shard_count);
    const size_t count = bake->targets.count;
    *head = (part_head){.error_count = bake->error_count,
                        .voxel_size = casters->voxel_size,
                        .active_voxels = casters->active_voxels,
                        .field_bytes = casters->field_bytes,
                        .levels = casters->levels,
                        .has_triangles = casters->has_triangles,
                        .layered_ao = bake->layered_ao};
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(&bake->scene, 1, 1, &channels, error));
    VSHI_TRY_DONE(copy_channels(&channels, head, error));
    VSHI_TRY_DONE(vshi_part_about_make(&options, &head->about, error));
    VSHI_TRY_DONE(
        vshi_allocate((void **)&head->lightmaps, count + 1, sizeof *head->lightmaps, "part", error));
    for (; head->lightmap_count < count; ++head->lightmap_count) {
        const vsh_scene_lightmap *own = &bake->lightmaps[head->lightmap_count];
        head->lightmaps[head->lightmap_count] =
            (part_lightmap){own->width, own->height, own->mesh_count, own->covered, own->samples};
    }
done:
    vshi_channels_free(&channels);
    return result;
}

/* --- tiles */

/* An array of a page, [height][width] elements of so many bytes. */
typedef struct tile_array {
    unsigned char *values;
    size_t size;
    const char *channel; /* of values that have a range; NULL: it is no channel */
} tile_array;

/* The most arrays of a page. */
enum { MOST_ARRAYS = VSH_MAX_CHANNELS + 8 };

/* Bytes of a tile's texels in an array, up to a multiple of 4. */
enum { MOST_TILE_BYTES = VSHI_TILE * VSHI_TILE * 3 * sizeof(float) };

/* Whether a plane is set when the page is finished, not by its tiles. */
static bool is_finished_later(const vshi_scene_page *page, const float *plane) {
    const vsh_lightmap *planes = &page->channels.lightmap;
    return plane == planes->coverage || plane == planes->invalid ||
           (page->page.ao.share != NULL &&
            (plane == planes->ao || plane == planes->ao_error || plane == planes->bent)) ||
           (page->page.sky.share != NULL && plane == planes->sky);
}

static size_t add_shots(const vshi_shots *shots, tile_array *arrays) {
    if (shots->share == NULL) {
        return 0;
    }
    arrays[0] = (tile_array){(unsigned char *)shots->share, sizeof *shots->share, NULL};
    arrays[1] = (tile_array){(unsigned char *)shots->rays, sizeof *shots->rays, NULL};
    arrays[2] = (tile_array){shots->level, sizeof *shots->level, NULL};
    arrays[3] = (tile_array){(unsigned char *)shots->open, 3 * sizeof *shots->open, NULL};
    return shots->open != NULL ? 4 : 3;
}

/* Lists the arrays of a page that its tiles set; returns how many there are. */
static size_t list_arrays(const vshi_scene_page *page, tile_array arrays[MOST_ARRAYS]) {
    const vshi_channels *channels = &page->channels;
    size_t count = 0, channel = 0;
    arrays[count++] = (tile_array){page->page.state, 1, NULL};
    for (size_t i = 0; i < channels->value_count; ++i) {
        if (!is_finished_later(page, channels->values[i])) {
            arrays[count++] = (tile_array){(unsigned char *)channels->values[i],
                                           channels->components[i] * sizeof(float), channels->names[channel]};
        }
        channel += channels->components[i];
    }
    count += add_shots(&page->page.ao, arrays + count);
    return count + add_shots(&page->page.sky, arrays + count);
}

/* Texels of a tile: columns and rows from the first on. */
typedef struct place {
    size_t left, top, columns, rows;
} place;

static place place_of(const vshi_scene_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const size_t across = (p->width + VSHI_TILE - 1) / VSHI_TILE;
    place at = {tile % across * VSHI_TILE, tile / across * VSHI_TILE, VSHI_TILE, VSHI_TILE};
    at.columns = p->width - at.left < VSHI_TILE ? p->width - at.left : VSHI_TILE;
    at.rows = p->height - at.top < VSHI_TILE ? p->height - at.top : VSHI_TILE;
    return at;
}

/* Copies the texels of a tile out of an array, or into it. Returns the bytes. */
static size_t copy_tile(const vshi_scene_page *page, const tile_array *array, size_t tile,
                        unsigned char *bytes, bool in) {
    const place at = place_of(page, tile);
    const size_t size = at.columns * array->size;
    size_t next = 0;
    for (size_t y = 0; y < at.rows; ++y, next += size) {
        unsigned char *row = array->values + ((at.top + y) * page->page.width + at.left) * array->size;
        memcpy(in ? row : bytes + next, in ? bytes + next : row, size);
    }
    while (next % 4 != 0) {
        bytes[next] = in ? bytes[next] : 0;
        ++next;
    }
    return next;
}

static vsh_result check_values(const vshi_scene_page *page, const tile_array *array, size_t texel,
                               const char *path, vsh_error *error) {
    float low, high;
    const bool may_be_nan = vshi_channel_range(array->channel, &low, &high);
    const size_t count = array->size / sizeof(float);
    for (size_t k = 0; k < count; ++k) {
        const float value = ((const float *)(const void *)array->values)[count * texel + k];
        if (!(value >= low && value <= high) && !(may_be_nan && isnan(value))) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: damaged: '%s' of texel (%zu, %zu) of lightmap %zu is %g, out of range %g … "
                             "%g; bake this part again",
                             path, array->channel, texel % page->page.width, texel / page->page.width,
                             page->index, (double)value, (double)low, (double)high);
        }
    }
    return VSH_OK;
}

/* Whether a texel's shots can be a bake's. */
static bool is_sound(const vshi_scene_page *page, const vshi_shots *shots, size_t texel) {
    enum { MOST_RAYS = 1 << 24 };
    static const float LONGEST = 3.0f; /* mean of open directions: what they lean by is taken out */
    if (shots->share == NULL) {
        return true;
    }
    const uint32_t level = shots->level[texel], spacing = (uint32_t)page->charts->ao_spacing;
    const float share = shots->share[texel];
    bool sound = level == 0 || page->page.state[texel] != VSHI_TEXEL_EMPTY;
    sound = sound &&
            (level == 0 || level == VSHI_AO_KNOWN_LEVEL || (level <= spacing && (level & (level - 1)) == 0));
    sound = sound && shots->rays[texel] >= 0 && shots->rays[texel] <= MOST_RAYS;
    sound = sound && ((share >= 0.0f && share <= 1.0f) || (isnan(share) && shots->rays[texel] == 0));
    for (size_t k = 0; k < 3 && shots->open != NULL; ++k) {
        const float open = shots->open[3 * texel + k];
        sound = sound && (fabsf(open) <= LONGEST || (isnan(open) && shots->rays[texel] == 0));
    }
    return sound;
}

static bool is_held_sound(const vshi_scene_page *page, const vshi_held_texel *held, size_t tile) {
    const place at = place_of(page, tile);
    const int32_t rays = vshi_field_error_rays(page->page.shade.max_error);
    const size_t x = vsh_texel_column(held->texel), y = vsh_texel_row(held->texel);
    return x >= at.left && x < at.left + at.columns && y >= at.top && y < at.top + at.rows &&
           held->free[0] <= rays && held->free[1] <= rays && held->even >= -1 && held->even <= 1;
}

/* Checks that a bake can have left the values that were read, once the tile is rasterized. */
static vsh_result check_tile_values(const vshi_scene_page *page, size_t tile, const char *path,
                                    vsh_error *error) {
    const place at = place_of(page, tile);
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(page, arrays);
    const vshi_page *p = &page->page;
    bool sound = true;
    for (size_t k = 0; k < at.columns * at.rows; ++k) {
        const size_t texel = (at.top + k / at.columns) * p->width + at.left + k % at.columns;
        for (size_t i = 0; i < count; ++i) {
            VSHI_TRY(arrays[i].channel != NULL ? check_values(page, &arrays[i], texel, path, error) : VSH_OK);
        }
        sound = sound && p->state[texel] <= VSHI_TEXEL_INVALID &&
                (p->state[texel] != VSHI_TEXEL_EMPTY) == (p->mesh[texel] != 0) &&
                is_sound(page, &p->ao, texel) && is_sound(page, &p->sky, texel);
    }
    const vshi_shots *shots[2] = {&p->ao, &p->sky};
    for (size_t s = 0; s < 2; ++s) {
        for (size_t k = 0; shots[s]->held != NULL && k < shots[s]->held[tile].count; ++k) {
            sound = sound && is_held_sound(page, &shots[s]->held[tile].list[k], tile);
        }
    }
    return sound ? VSH_OK : vshi_part_damaged(path, "its tiles", error);
}

/* --- writing */

/* The tiles of a lightmap that are the shard's; *number is of the first tile that has texels, and moves on to
 * the next lightmap's. */
static vsh_result list_tiles(const vshi_scene_bake *bake, const vsh_charts *charts, uint64_t *number,
                             uint32_t **tiles, size_t *count, vsh_error *error) {
    const size_t all = vshi_charts_tiles(&charts->sorted);
    *count = 0;
    VSHI_TRY(vshi_allocate((void **)tiles, all, sizeof **tiles, "part", error));
    for (size_t tile = 0; tile < all; ++tile) {
        const uint64_t shards = (uint64_t)bake->options.shard_count;
        if (charts->samples[tile] > 0 && (*number)++ % shards == (uint64_t)bake->options.shard - 1) {
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

static void write_tile(vshi_part_output *file, const vshi_scene_page *page, size_t tile,
                       unsigned char *bytes) {
    const vshi_page *p = &page->page;
    const vshi_part_tile head = {
        (uint32_t)page->index, (uint32_t)tile, {count_held(&p->ao, tile), count_held(&p->sky, tile)}};
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(page, arrays);
    vshi_part_output_put(file, &head, sizeof head);
    vshi_part_output_put(file, &p->stats[tile], sizeof *p->stats);
    vshi_part_output_put(file, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors);
    for (size_t i = 0; i < count; ++i) {
        vshi_part_output_put(file, bytes, copy_tile(page, &arrays[i], tile, bytes, false));
    }
    write_held(file, &p->ao, tile);
    write_held(file, &p->sky, tile);
}

/* What the report counts of the part. */
static void add_tile(vshi_scene_bake *bake, const vshi_scene_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const size_t left = tile % page->charts->sorted.columns * VSHI_TILE,
                 top = tile / page->charts->sorted.columns * VSHI_TILE;
    for (size_t y = top; y < top + VSHI_TILE && y < p->height; ++y) {
        for (size_t x = left; x < left + VSHI_TILE && x < p->width; ++x) {
            bake->report.texels += p->state[y * p->width + x] != VSHI_TEXEL_EMPTY;
            bake->report.invalid_texels += p->state[y * p->width + x] == VSHI_TEXEL_INVALID;
        }
    }
    vshi_shade_stats_add(&bake->report.shade, &p->stats[tile]);
}

/* Tiles that have texels are numbered over all lightmaps, in one sequence. */
static size_t count_tiles(const vshi_scene_bake *bake) {
    size_t count = 0;
    for (size_t i = 0; i < bake->targets.count; ++i) {
        for (size_t tile = 0; tile < vshi_charts_tiles(&bake->charts[i]->sorted); ++tile) {
            count += bake->charts[i]->samples[tile] > 0;
        }
    }
    return count;
}

static vsh_result bake_lightmap(vshi_scene_bake *bake, size_t index, uint64_t *number, vshi_part_output *file,
                                vshi_job *tiles_done, vsh_error *error) {
    vsh_run held = bake->run;
    vshi_store store = {.folder = NULL};
    vshi_scene_page page = {.bake = bake};
    uint32_t *tiles = NULL;
    unsigned char *bytes = NULL;
    size_t count;
    const double start = vshi_seconds();
    vsh_result result;
    VSHI_TRY_DONE(list_tiles(bake, bake->charts[index], number, &tiles, &count, error));
    if (count == 0) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, MOST_TILE_BYTES, 1, "part", error));
    VSHI_TRY_DONE(vshi_scene_store_open(bake, index, &held, &store, error));
    VSHI_TRY_DONE(vshi_scene_page_open(bake, index, &store, &page, error));
    VSHI_TRY_DONE(vshi_name_file(page.target->receiver.path,
                                 vshi_trace_tiles(bake->tracer, &page.page, tiles, count, tiles_done, error),
                                 error));
    bake->report.bake_s += vshi_seconds() - start;
    for (size_t i = 0; i < count; ++i) {
        write_tile(file, &page, tiles[i], bytes);
        add_tile(bake, &page, tiles[i]);
    }
done:
    vshi_scene_page_close(&page);
    vshi_scene_store_close(&store);
    free(bytes);
    free(tiles);
    return result;
}

static vsh_result begin_part(const vshi_scene_bake *bake, const char *path, vshi_part_output *file,
                             vsh_error *error) {
    part_head head;
    vshi_part_code code = {.reads = false};
    vsh_result result;
    VSHI_TRY_DONE(make_head(bake, &head, error));
    vshi_part_about_code(&code, &head.about);
    code_head(&code, &head);
    result = vshi_part_output_begin(file, path, &code, error);
done:
    free_head(&head);
    return result;
}

vsh_result vshi_bake_part(vshi_scene_bake *bake, vsh_error *error) {
    const int32_t shards = bake->options.shard_count;
    vshi_part_output file = {.file = NULL};
    uint64_t number = 0;
    vshi_job *tiles =
        vshi_job_begin(&bake->run, "bake", (count_tiles(bake) + (size_t)shards - 1) / (size_t)shards);
    char *path = vshi_part_path(parts_name(bake), bake->options.shard, shards);
    vsh_result result;
    if (path == NULL || tiles == NULL) {
        result = vshi_fail(error, VSH_ERROR_MEMORY, "part: the system refused memory");
        goto done;
    }
    VSHI_TRY_DONE(begin_part(bake, path, &file, error));
    for (size_t i = 0; i < bake->targets.count; ++i) {
        VSHI_TRY_DONE(bake_lightmap(bake, i, &number, &file, tiles, error));
    }
    const double baked = vshi_seconds();
    result = vshi_part_output_finish(&file, error);
    bake->report.write_s += vshi_seconds() - baked;
done:
    vshi_part_output_abandon(&file);
    vshi_job_end(tiles);
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
static vsh_result open_part(const vsh_run *run, part *p, vsh_error *error) {
    vshi_part_input input;
    vsh_result result;
    VSHI_TRY_DONE(vshi_part_input_open(p->path, run, &input, &p->head.about, error));
    code_head(&input.head, &p->head);
    VSHI_TRY_DONE(vshi_part_input_end_head(&input, error));
    p->at = sizeof input.front + input.front.head_bytes;
    p->end = p->at + input.body_bytes;
    VSHI_TRY_DONE(vshi_part_input_check_body(&input, run, error));
done:
    vshi_part_input_close(&input);
    return result;
}

static vsh_result check_lightmaps(const vshi_scene_bake *bake, const part *p, vsh_error *error) {
    const part_head *head = &p->head;
    if (head->lightmap_count != bake->targets.count || head->error_count != bake->error_count) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of other inputs or options: of %" PRIu64
                         " lightmaps, not of %zu; bake this part again",
                         p->path, head->lightmap_count, bake->targets.count);
    }
    for (size_t i = 0; i < bake->targets.count; ++i) {
        const vsh_scene_lightmap *own = &bake->lightmaps[i];
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

static vsh_result check_channels(const vshi_scene_bake *bake, const part *p, vsh_error *error) {
    vshi_channels channels;
    vsh_result result;
    VSHI_TRY_DONE(vshi_channels_name(&bake->scene, 1, 1, &channels, error));
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
static vsh_result check_part(const vshi_scene_bake *bake, const part *p, const part *first, int32_t shard,
                             int32_t count, vsh_error *error) {
    const vshi_part_options own = options_of(bake, count);
    VSHI_TRY(vshi_part_about_check(&p->head.about, p->path, shard, &own, error));
    VSHI_TRY(check_lightmaps(bake, p, error));
    VSHI_TRY(check_channels(bake, p, error));
    return check_casters(p, first, error);
}

/* What the report tells of casters, which are not made. */
static vsh_result take_casters(vshi_scene_bake *bake, const part_head *head, vsh_error *error) {
    vsh_occluders_info *casters = &bake->report.occluders;
    casters->voxel_size = head->voxel_size;
    casters->has_triangles = head->has_triangles;
    casters->active_voxels = head->active_voxels;
    casters->field_bytes = head->field_bytes;
    casters->levels = head->levels;
    bake->layered_ao = head->layered_ao != 0;
    return vshi_bake_find_provenance(bake, error);
}

vsh_result vshi_parts_find(const vshi_scene_bake *bake, int32_t *count, vsh_error *error) {
    *count = bake->options.shard_count;
    if (*count == 0) {
        VSHI_TRY(vshi_parts_count(parts_name(bake), count, error));
    }
    return vshi_parts_check_there(parts_name(bake), *count, error);
}

vsh_result vshi_parts_open(vshi_scene_bake *bake, int32_t count, vsh_error *error) {
    const double start = vshi_seconds();
    const char *name = parts_name(bake);
    vshi_parts *parts = NULL;
    VSHI_TRY(vshi_allocate((void **)&parts, 1, sizeof *parts, "parts", error));
    bake->parts = parts;
    parts->count = (size_t)count;
    VSHI_TRY(vshi_allocate((void **)&parts->list, parts->count, sizeof *parts->list, "parts", error));
    for (int32_t i = 0; i < count; ++i) {
        part *p = &parts->list[i];
        p->path = vshi_part_path(name, i + 1, count);
        if (p->path == NULL) {
            return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
        }
        VSHI_TRY(open_part(&bake->run, p, error));
        VSHI_TRY(i == 0 ? take_casters(bake, &p->head, error) : VSH_OK);
        VSHI_TRY(check_part(bake, p, &parts->list[0], i + 1, count, error));
    }
    bake->report.load_s += vshi_seconds() - start;
    return VSH_OK;
}

/* --- reading tiles */

/* A part's tiles of the current lightmap. */
typedef struct taking {
    part *part;
    FILE *file;
    vshi_scene_page *page;
    unsigned char *bytes; /* [MOST_TILE_BYTES] */
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
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(t->page, arrays);
    VSHI_TRY(take_bytes(t, &p->stats[tile], sizeof *p->stats, error));
    VSHI_TRY(take_bytes(t, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(take_bytes(t, t->bytes, copy_tile(t->page, &arrays[i], tile, t->bytes, false), error));
        copy_tile(t->page, &arrays[i], tile, t->bytes, true);
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
    vshi_scene_page *page;
    const uint32_t *owner;
    _Atomic size_t failed; /* the first tile that could not be; SIZE_MAX: none */
} checking;

static vsh_result check_tile(const checking *c, size_t tile, vsh_error *error) {
    VSHI_TRY(vshi_page_rasterize(&c->page->page, tile, error));
    return check_tile_values(c->page, tile, c->parts->list[(c->owner[tile] & ~TAKEN) - 1].path, error);
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

static vsh_result take_all(vshi_parts *parts, vshi_scene_page *page, uint32_t *owner, unsigned char *bytes,
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

vsh_result vshi_parts_read(vshi_parts *parts, vshi_scene_page *page, vshi_job *job, vsh_error *error) {
    uint32_t *owner = NULL;
    unsigned char *bytes = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&owner, vshi_charts_tiles(&page->charts->sorted), sizeof *owner,
                                "parts", error));
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, MOST_TILE_BYTES, 1, "parts", error));
    result = take_all(parts, page, owner, bytes, job, error);
done:
    free(bytes);
    free(owner);
    return result;
}
