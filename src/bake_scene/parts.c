#include "bake_scene/parts.h"

#include "bake/planes.h"
#include "base/clock.h"
#include "base/file.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "shade/ao.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* --- the head */

/* Begins the head. The lightmaps follow, then the texts, each with its NUL: the library's version, words,
 * names and values of attributes, channels; then bytes of 0 up to a multiple of 8. */
typedef struct head_numbers {
    uint64_t words, attributes, channels, lightmaps; /* their numbers */
    uint64_t errors;                                 /* as in vsh_bake_report */
    uint64_t active_voxels, field_bytes;             /* of the casters, as in vsh_occluders_info */
    double voxel_size;
    int32_t levels, has_triangles;
    int32_t layered_ao; /* as of the job */
    int32_t shard, shard_count;
    int32_t unused;
} head_numbers;

/* A lightmap of the job that a part is of. */
typedef struct part_lightmap {
    uint64_t mesh_count, covered, samples; /* as in vsh_scene_lightmap */
    int32_t width, height;
} part_lightmap;

enum { ROUND = 8 };

typedef struct part_head {
    head_numbers numbers;
    unsigned char *bytes; /* owned: all of it, a multiple of 8 */
    size_t size;
    const char **texts;                           /* owned; they lie in `bytes` */
    const char **words, **attributes, **channels; /* in `texts` */
    const part_lightmap *lightmaps;               /* in `bytes` */
} part_head;

static void free_head(part_head *head) {
    free(head->texts);
    free(head->bytes);
    *head = (part_head){.bytes = NULL};
}

/* The name of the parts' files: the options' name, or the first lightmap's output. */
static const char *parts_name(const vshi_scene_bake *bake) {
    return bake->options.parts != NULL ? bake->options.parts
           : bake->targets.count > 0   ? bake->lightmaps[0].output
                                       : bake->scene.receivers[0].output;
}

static uint64_t count_texts(const head_numbers *numbers) {
    return 1 + numbers->words + 2 * numbers->attributes + numbers->channels;
}

/* Lists the texts of a head in their order. */
static void list_texts(const vshi_scene_bake *bake, const vshi_channels *channels, const char **texts) {
    size_t attributes;
    const vsh_attribute *attribute = vsh_provenance_attributes(bake->provenance, &attributes);
    *texts++ = VSHI_VERSION;
    for (size_t i = 0; i < bake->options.word_count; ++i) {
        *texts++ = bake->options.words[i];
    }
    for (size_t i = 0; i < attributes; ++i) {
        *texts++ = attribute[i].name;
        *texts++ = attribute[i].value;
    }
    for (int32_t i = 0; i < channels->image.channel_count; ++i) {
        *texts++ = channels->names[i];
    }
}

static unsigned char *append(unsigned char *to, const void *from, size_t size) {
    memcpy(to, from, size);
    return to + size;
}

/* VSH_ERROR_INPUT: `what` of a part cannot be. */
static vsh_result fail_damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: damaged: %s; bake this part again", path, what);
}

/* Finds numbers, lightmaps and texts in the bytes of a head, and checks that they are there. */
static vsh_result parse_head(const char *path, part_head *head, vsh_error *error) {
    head_numbers *n = &head->numbers;
    size_t size = head->size;
    if (size < sizeof *n) {
        return fail_damaged(path, "its head", error);
    }
    memcpy(n, head->bytes, sizeof *n);
    size -= sizeof *n;
    if (n->lightmaps > size / sizeof *head->lightmaps) {
        return fail_damaged(path, "its head", error);
    }
    head->lightmaps = (const part_lightmap *)(const void *)(head->bytes + sizeof *n);
    size -= (size_t)n->lightmaps * sizeof *head->lightmaps;
    const char *text = (const char *)(head->lightmaps + n->lightmaps);
    if (n->words > size || n->attributes > size || n->channels > size || count_texts(n) > size) {
        return fail_damaged(path, "its head", error);
    }
    const size_t count = (size_t)count_texts(n);
    VSHI_TRY(vshi_allocate((void **)&head->texts, count, sizeof *head->texts, path, error));
    for (size_t i = 0; i < count; ++i) {
        const size_t length = strnlen(text, size);
        if (length == size) {
            return fail_damaged(path, "its head", error);
        }
        head->texts[i] = text;
        text += length + 1;
        size -= length + 1;
    }
    head->words = head->texts + 1;
    head->attributes = head->words + n->words;
    head->channels = head->attributes + 2 * n->attributes;
    return size < ROUND ? VSH_OK : fail_damaged(path, "its head", error);
}

/* Makes the head of the job's part, or in a merge what the parts' heads should be. Free it also after an
 * error. */
static vsh_result make_head(const vshi_scene_bake *bake, part_head *head, vsh_error *error) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    size_t attributes;
    vshi_channels channels;
    const char **texts = NULL;
    vsh_result result;
    *head = (part_head){.bytes = NULL};
    VSHI_TRY_DONE(vshi_channels_name(&bake->scene, 1, 1, &channels, error));
    vsh_provenance_attributes(bake->provenance, &attributes);
    const head_numbers numbers = {.words = bake->options.word_count,
                                  .attributes = attributes,
                                  .channels = (uint64_t)channels.image.channel_count,
                                  .lightmaps = bake->targets.count,
                                  .errors = bake->error_count,
                                  .active_voxels = casters->active_voxels,
                                  .field_bytes = casters->field_bytes,
                                  .voxel_size = casters->voxel_size,
                                  .levels = casters->levels,
                                  .has_triangles = casters->has_triangles,
                                  .layered_ao = bake->layered_ao,
                                  .shard = bake->options.shard,
                                  .shard_count = bake->options.shard_count};
    const size_t text_count = (size_t)count_texts(&numbers);
    VSHI_TRY_DONE(vshi_allocate((void **)&texts, text_count, sizeof *texts, "part", error));
    list_texts(bake, &channels, texts);
    size_t size = sizeof numbers + bake->targets.count * sizeof(part_lightmap);
    for (size_t i = 0; i < text_count; ++i) {
        size += strlen(texts[i]) + 1;
    }
    head->size = (size + ROUND - 1) / ROUND * ROUND;
    VSHI_TRY_DONE(vshi_allocate((void **)&head->bytes, head->size, 1, "part", error));
    unsigned char *at = append(head->bytes, &numbers, sizeof numbers);
    for (size_t i = 0; i < bake->targets.count; ++i) {
        const vsh_scene_lightmap *own = &bake->lightmaps[i];
        const part_lightmap lightmap = {own->mesh_count, own->covered, own->samples, own->width, own->height};
        at = append(at, &lightmap, sizeof lightmap);
    }
    for (size_t i = 0; i < text_count; ++i) {
        at = append(at, texts[i], strlen(texts[i]) + 1);
    }
    result = parse_head("part", head, error);
done:
    free(texts);
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

/* Texel `k` of a tile, in rows. */
static size_t texel_of(const vshi_scene_page *page, const place *at, size_t k) {
    return (at->top + k / at->columns) * page->page.width + at->left + k % at->columns;
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

static vshi_held_texels held_of(const vshi_shots *shots, size_t tile) {
    return shots->held != NULL ? shots->held[tile] : (vshi_held_texels){NULL, 0};
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
        const size_t texel = texel_of(page, &at, k);
        for (size_t i = 0; i < count; ++i) {
            VSHI_TRY(arrays[i].channel != NULL ? check_values(page, &arrays[i], texel, path, error) : VSH_OK);
        }
        sound = sound && p->state[texel] <= VSHI_TEXEL_INVALID &&
                (p->state[texel] != VSHI_TEXEL_EMPTY) == (p->mesh[texel] != 0) &&
                is_sound(page, &p->ao, texel) && is_sound(page, &p->sky, texel);
    }
    const vshi_held_texels held[2] = {held_of(&p->ao, tile), held_of(&p->sky, tile)};
    for (size_t s = 0; s < 2; ++s) {
        for (size_t k = 0; k < held[s].count; ++k) {
            sound = sound && is_held_sound(page, &held[s].list[k], tile);
        }
    }
    return sound ? VSH_OK : fail_damaged(path, "its tiles", error);
}

/* --- writing */

typedef struct part_output {
    vshi_output output;
    FILE *file;
    uint64_t sum;
    int error; /* errno of the first write that failed; 0: none */
} part_output;

/* Writes a multiple of 4 bytes. finish_part() reports errors. */
static void put(part_output *part, const void *bytes, size_t size) {
    part->sum = vshi_part_sum(part->sum, bytes, size);
    if (size > 0 && fwrite(bytes, size, 1, part->file) != 1 && part->error == 0) {
        part->error = errno != 0 ? errno : EIO;
    }
}

static vsh_result begin_part(const vshi_scene_bake *bake, const char *path, part_output *part,
                             vsh_error *error) {
    part_head head;
    vsh_result result;
    VSHI_TRY_DONE(make_head(bake, &head, error));
    VSHI_TRY_DONE(vshi_output_begin(&part->output, path, error));
    part->file = fopen(part->output.temporary, "wb");
    if (part->file == NULL) {
        result = vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
        goto done;
    }
    const vshi_part_front front = {VSHI_PART_MAGIC, VSHI_PART_ORDER, head.size};
    put(part, &front, sizeof front);
    put(part, head.bytes, head.size);
done:
    free_head(&head);
    return result;
}

static vsh_result finish_part(part_output *part, vsh_error *error) {
    const uint64_t sum = part->sum;
    put(part, &sum, sizeof sum);
    if (fclose(part->file) != 0 && part->error == 0) {
        part->error = errno;
    }
    part->file = NULL;
    return part->error == 0 ? vshi_output_commit(&part->output, error)
                            : vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s",
                                        part->output.target, strerror(part->error));
}

/* The part that bakes a tile, from 0 on. On pages from 2048 texels on, tiles go out in runs: neighbours
 * share pages of memory, so parts of single tiles would each touch all of every plane. */
static uint64_t find_owner(const vsh_charts *charts, uint64_t tile, uint64_t parts) {
    const uint64_t run = (uint64_t)charts->info.width / 1024;
    return tile / (run > 1 ? run : 1) % parts;
}

/* The tiles of a lightmap that are the shard's; *number is of the first tile that has texels, and moves on to
 * the next lightmap's. */
static vsh_result list_tiles(const vshi_scene_bake *bake, const vsh_charts *charts, uint64_t *number,
                             uint32_t **tiles, size_t *count, vsh_error *error) {
    const size_t all = vshi_charts_tiles(&charts->sorted);
    *count = 0;
    VSHI_TRY(vshi_allocate((void **)tiles, all, sizeof **tiles, "part", error));
    for (size_t tile = 0; tile < all; ++tile) {
        if (charts->samples[tile] > 0 &&
            find_owner(charts, (*number)++, (uint64_t)bake->options.shard_count) + 1 ==
                (uint64_t)bake->options.shard) {
            (*tiles)[(*count)++] = (uint32_t)tile;
        }
    }
    return VSH_OK;
}

static void write_tile(part_output *file, const vshi_scene_page *page, size_t tile, unsigned char *bytes) {
    const vshi_page *p = &page->page;
    const vshi_held_texels ao = held_of(&p->ao, tile), sky = held_of(&p->sky, tile);
    const vshi_part_tile head = {
        (uint32_t)page->index, (uint32_t)tile, {(uint32_t)ao.count, (uint32_t)sky.count}};
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(page, arrays);
    put(file, &head, sizeof head);
    put(file, &p->stats[tile], sizeof *p->stats);
    put(file, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors);
    for (size_t i = 0; i < count; ++i) {
        put(file, bytes, copy_tile(page, &arrays[i], tile, bytes, false));
    }
    put(file, ao.list, ao.count * sizeof *ao.list);
    put(file, sky.list, sky.count * sizeof *sky.list);
}

/* Adds a tile to the report. */
static void add_tile(vshi_scene_bake *bake, const vshi_scene_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const place at = place_of(page, tile);
    for (size_t k = 0; k < at.columns * at.rows; ++k) {
        const uint8_t state = p->state[texel_of(page, &at, k)];
        bake->report.texels += state != VSHI_TEXEL_EMPTY;
        bake->report.invalid_texels += state == VSHI_TEXEL_INVALID;
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

static vsh_result bake_lightmap(vshi_scene_bake *bake, size_t index, uint64_t *number, part_output *file,
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

vsh_result vshi_bake_part(vshi_scene_bake *bake, vsh_error *error) {
    const size_t shards = (size_t)bake->options.shard_count;
    part_output file = {.sum = VSHI_PART_SUM};
    uint64_t number = 0;
    vshi_job *tiles = vshi_job_begin(&bake->run, "bake", (count_tiles(bake) + shards - 1) / shards);
    char *path = vshi_part_path(parts_name(bake), bake->options.shard, bake->options.shard_count);
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
    result = finish_part(&file, error);
    bake->report.write_s += vshi_seconds() - baked;
done:
    if (file.file != NULL) {
        fclose(file.file);
    }
    vshi_output_abandon(&file.output);
    vshi_job_end(tiles);
    free(path);
    return result;
}

/* --- reading */

enum { MOST_HEAD = 1 << 28, CHUNK = 1 << 20 }; /* bytes; read at once */
enum { IN_MEMORY = 1 + sizeof(char *) };       /* bytes of a head's byte, which may be a text */

typedef struct part {
    char *path;
    part_head head;
    uint64_t at, end; /* of the tiles that are left, bytes of the file */
} part;

struct vshi_parts {
    part *list; /* [count] */
    size_t count;
    uint64_t number; /* of the first tile of the lightmap that comes next */
};

static void free_part(part *p) {
    free_head(&p->head);
    free(p->path);
}

void vshi_parts_free(vshi_parts *parts) {
    for (size_t i = 0; parts != NULL && parts->list != NULL && i < parts->count; ++i) {
        free_part(&parts->list[i]);
    }
    if (parts != NULL) {
        free(parts->list);
        free(parts);
    }
}

static vsh_result read_bytes(FILE *file, const char *path, void *bytes, size_t size, vsh_error *error) {
    return size == 0 || fread(bytes, size, 1, file) == 1
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path,
                           ferror(file) ? strerror(errno) : "it ends early");
}

/* Reads the front of a file of `size` bytes: whether it is one of ours, and its sizes are those of the file.
 */
static vsh_result read_front(FILE *file, const char *path, uint64_t size, vshi_part_front *front,
                             vsh_error *error) {
    const bool whole = size >= sizeof *front + sizeof(uint64_t);
    *front = (vshi_part_front){.order = 0};
    VSHI_TRY(read_bytes(file, path, front, whole ? sizeof *front : (size_t)size, error));
    if (memcmp(front->magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", path);
    }
    if (!whole) {
        return fail_damaged(path, "it ends early", error);
    }
    if (memcmp(front->magic, VSHI_PART_MAGIC, sizeof front->magic) != 0 || front->order != VSHI_PART_ORDER) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of another version of vdbshade, or of another kind of machine; bake this "
                         "part again",
                         path);
    }
    const uint64_t rest = size - sizeof *front - sizeof(uint64_t);
    return front->head_bytes <= rest && front->head_bytes % ROUND == 0 && rest % 4 == 0
               ? VSH_OK
               : fail_damaged(path, "it has not the size that it tells", error);
}

/* Opens a part and reads its head, up to the tiles; *sum becomes the checksum so far. Close the file also
 * after an error, unless it is NULL. */
static vsh_result open_part(part *p, const vsh_run *run, FILE **file, uint64_t *sum, vsh_error *error) {
    uint64_t size;
    vshi_part_front front;
    *file = NULL;
    VSHI_TRY(vshi_input_open(p->path, p->path, UINT64_MAX / 2, file, &size, error));
    VSHI_TRY(read_front(*file, p->path, size, &front, error));
    if (front.head_bytes > MOST_HEAD) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: tells %" PRIu64 " bytes of itself, at most %d", p->path,
                         front.head_bytes, MOST_HEAD);
    }
    part_head *head = &p->head;
    head->size = (size_t)front.head_bytes;
    VSHI_TRY(vshi_check_limit(run, IN_MEMORY * (double)head->size, p->path, error));
    VSHI_TRY(vshi_allocate((void **)&head->bytes, head->size, 1, p->path, error));
    VSHI_TRY(read_bytes(*file, p->path, head->bytes, head->size, error));
    *sum = vshi_part_sum(vshi_part_sum(VSHI_PART_SUM, &front, sizeof front), head->bytes, head->size);
    p->at = sizeof front + head->size;
    p->end = size - sizeof(uint64_t);
    VSHI_TRY(parse_head(p->path, head, error));
    return head->numbers.shard >= 1 && head->numbers.shard <= head->numbers.shard_count
               ? VSH_OK
               : fail_damaged(p->path, "its number", error);
}

/* Goes over the tiles, and checks that the file is what was written. */
static vsh_result check_sum(const part *p, FILE *file, uint64_t sum, const vsh_run *run, vsh_error *error) {
    unsigned char *chunk = NULL;
    uint64_t told;
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "parts", (size_t)((p->end - p->at) / CHUNK) + 1);
    if (job == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", p->path);
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&chunk, CHUNK, 1, p->path, error));
    for (uint64_t left = p->end - p->at; left > 0;) {
        const size_t size = left < CHUNK ? (size_t)left : CHUNK;
        VSHI_TRY_DONE(read_bytes(file, p->path, chunk, size, error));
        sum = vshi_part_sum(sum, chunk, size);
        left -= size;
        VSHI_TRY_DONE(vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    VSHI_TRY_DONE(read_bytes(file, p->path, &told, sizeof told, error));
    result = told == sum ? VSH_OK : fail_damaged(p->path, "its checksum does not match", error);
done:
    free(chunk);
    vshi_job_end(job);
    return result;
}

static vsh_result read_part(part *p, const vsh_run *run, vsh_error *error) {
    FILE *file;
    uint64_t sum = 0;
    vsh_result result = open_part(p, run, &file, &sum, error);
    result = result == VSH_OK ? check_sum(p, file, sum, run, error) : result;
    if (file != NULL) {
        fclose(file);
    }
    return result;
}

/* --- parts that belong together */

/* VSH_ERROR_INPUT: something that tells of inputs or options is not as in the other parts, or here. */
static vsh_result refuse(const char *path, const char *what, const char *theirs, const char *ours,
                         vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT,
                     "%s: is of other inputs or options: its %s is '%.160s', of the others or here '%.160s'; "
                     "bake this part again",
                     path, what, theirs, ours);
}

static vsh_result check_attributes(const part *p, const part_head *own, vsh_error *error) {
    const uint64_t count = own->numbers.attributes, theirs = p->head.numbers.attributes;
    for (uint64_t i = 0; i < count || i < theirs; ++i) {
        const char *const *a = i < theirs ? p->head.attributes + 2 * i : NULL;
        const char *const *b = i < count ? own->attributes + 2 * i : NULL;
        if (a == NULL || b == NULL || strcmp(a[0], b[0]) != 0 || strcmp(a[1], b[1]) != 0) {
            return refuse(p->path, b != NULL ? b[0] : a[0], a != NULL ? a[1] : "", b != NULL ? b[1] : "",
                          error);
        }
    }
    return VSH_OK;
}

/* Whether the lightmaps, the channels and the casters are the same. The attributes name every input and
 * option, so these differ only where a part's head was altered. */
static bool is_alike(const part_head *a, const part_head *b) {
    const head_numbers *m = &a->numbers, *n = &b->numbers;
    bool alike = m->lightmaps == n->lightmaps && m->channels == n->channels && m->errors == n->errors &&
                 m->voxel_size == n->voxel_size && m->has_triangles == n->has_triangles &&
                 m->active_voxels == n->active_voxels && m->levels == n->levels &&
                 m->layered_ao == n->layered_ao;
    alike = alike && memcmp(a->lightmaps, b->lightmaps, m->lightmaps * sizeof *a->lightmaps) == 0;
    for (uint64_t c = 0; alike && c < m->channels; ++c) {
        alike = strcmp(a->channels[c], b->channels[c]) == 0;
    }
    return alike;
}

/* Checks that a part is of the job's inputs, and of the first one's casters: `own` is what its head should
 * be. */
static vsh_result check_part(const part *p, const part_head *own, int32_t shard, int32_t count,
                             vsh_error *error) {
    const head_numbers *n = &p->head.numbers;
    if (strcmp(p->head.texts[0], VSHI_VERSION) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is of vdbshade %.32s, this is %s; bake this part again",
                         p->path, p->head.texts[0], VSHI_VERSION);
    }
    if (n->shard != shard || n->shard_count != count) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds part %d of %d; was it renamed?", p->path,
                         n->shard, n->shard_count);
    }
    VSHI_TRY(check_attributes(p, own, error));
    return is_alike(&p->head, own) ? VSH_OK
                                   : vshi_fail(error, VSH_ERROR_INPUT,
                                               "%s: its lightmaps, channels or voxels are not those of the "
                                               "other parts or of the scene; bake this part again",
                                               p->path);
}

/* Reports the casters of the parts, which are not made. */
static vsh_result report_casters(vshi_scene_bake *bake, const head_numbers *n, vsh_error *error) {
    vsh_occluders_info *casters = &bake->report.occluders;
    casters->voxel_size = n->voxel_size;
    casters->has_triangles = n->has_triangles;
    casters->active_voxels = n->active_voxels;
    casters->field_bytes = n->field_bytes;
    casters->levels = n->levels;
    bake->layered_ao = n->layered_ao != 0;
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
    part_head own = {.bytes = NULL};
    vshi_parts *parts = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&parts, 1, sizeof *parts, "parts", error));
    bake->parts = parts;
    parts->count = (size_t)count;
    VSHI_TRY_DONE(vshi_allocate((void **)&parts->list, parts->count, sizeof *parts->list, "parts", error));
    for (int32_t i = 0; i < count; ++i) {
        part *p = &parts->list[i];
        p->path = vshi_part_path(name, i + 1, count);
        if (p->path == NULL) {
            result = vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", name);
            goto done;
        }
        VSHI_TRY_DONE(read_part(p, &bake->run, error));
        if (i == 0) {
            VSHI_TRY_DONE(report_casters(bake, &p->head.numbers, error));
            VSHI_TRY_DONE(make_head(bake, &own, error));
        }
        VSHI_TRY_DONE(check_part(p, &own, i + 1, count, error));
    }
    bake->report.load_s += vshi_seconds() - start;
done:
    free_head(&own);
    return result;
}

/* --- words of a part */

/* Copies the words into one block: their list with a NULL at its end, then the texts. */
static vsh_result copy_words(const part *p, char ***words, vsh_error *error) {
    const size_t count = (size_t)p->head.numbers.words;
    size_t texts = 0;
    for (size_t i = 0; i < count; ++i) {
        texts += strlen(p->head.words[i]) + 1;
    }
    VSHI_TRY(vshi_allocate((void **)words, (count + 1) * sizeof **words + texts, 1, p->path, error));
    char *text = (char *)(*words + count + 1);
    for (size_t i = 0; i < count; ++i) {
        (*words)[i] = text;
        text = stpcpy(text, p->head.words[i]) + 1;
    }
    return VSH_OK;
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
    if (shard_count < 0 || shard_count > VSHI_MOST_SHARDS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "shard_count %d: expected 0 to %d", shard_count,
                         VSHI_MOST_SHARDS);
    }
    part p = {.path = NULL};
    FILE *file;
    uint64_t sum;
    VSHI_TRY(vshi_parts_first(parts, shard_count, &p.path, error));
    vsh_result result = open_part(&p, &full, &file, &sum, error);
    result = result == VSH_OK ? copy_words(&p, words, error) : result;
    *count = result == VSH_OK ? (size_t)p.head.numbers.words : 0;
    if (file != NULL) {
        fclose(file);
    }
    free_part(&p);
    return result;
}

void vsh_part_words_free(char **words) {
    free(words);
}

/* Opens a part at its next tile. */
static vsh_result reopen(const part *p, FILE **file, vsh_error *error) {
    uint64_t size;
    VSHI_TRY(vshi_input_open(p->path, p->path, UINT64_MAX / 2, file, &size, error));
    if (fseeko(*file, (off_t)p->at, SEEK_SET) == 0) {
        return VSH_OK;
    }
    const int why = errno;
    fclose(*file);
    return vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", p->path, strerror(why));
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
        return fail_damaged(t->part->path, "its tiles", error);
    }
    t->part->at += size;
    return read_bytes(t->file, t->part->path, bytes, size, error);
}

static vsh_result take_held(const taking *t, vshi_shots *shots, size_t tile, uint32_t count,
                            vsh_error *error) {
    if (count == 0) {
        return VSH_OK;
    }
    if (shots->held == NULL || shots->held[tile].list != NULL || count > VSHI_TILE * VSHI_TILE) {
        return fail_damaged(t->part->path, "its tiles", error);
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
            return head.lightmap > t->page->index ? VSH_OK : fail_damaged(t->part->path, "its tiles", error);
        }
        if (head.tile >= tiles || owner[head.tile] != shard + 1) {
            return fail_damaged(t->part->path, "its tiles", error);
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
} checking;

static vsh_result check_tile(void *user, size_t tile, vsh_error *error) {
    const checking *c = user;
    if (c->owner[tile] == 0) {
        return VSH_OK;
    }
    VSHI_TRY(vshi_page_rasterize(&c->page->page, tile, error));
    return check_tile_values(c->page, tile, c->parts->list[(c->owner[tile] & ~TAKEN) - 1].path, error);
}

static vsh_result take_all(vshi_parts *parts, vshi_scene_page *page, uint32_t *owner, unsigned char *bytes,
                           vshi_job *job, vsh_error *error) {
    const size_t tiles = vshi_charts_tiles(&page->charts->sorted);
    for (size_t tile = 0; tile < tiles; ++tile) {
        if (page->charts->samples[tile] > 0) {
            owner[tile] = (uint32_t)find_owner(page->charts, parts->number++, parts->count) + 1;
        }
    }
    for (size_t i = 0; i < parts->count; ++i) {
        taking t = {.part = &parts->list[i], .page = page, .bytes = bytes};
        VSHI_TRY(reopen(t.part, &t.file, error));
        const vsh_result result = take_part(&t, owner, (uint32_t)i, job, error);
        fclose(t.file);
        VSHI_TRY(result);
    }
    for (size_t tile = 0; tile < tiles; ++tile) {
        if (owner[tile] != 0 && (owner[tile] & TAKEN) == 0) {
            return fail_damaged(parts->list[owner[tile] - 1].path, "a tile is missing", error);
        }
    }
    checking c = {.parts = parts, .page = page, .owner = owner};
    return vshi_parallel_each(job, tiles, 1, 0, check_tile, &c, error);
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
