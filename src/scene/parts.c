/* Parts of a bake: files of tiles, written by shards and put together by a merge. */
#define _GNU_SOURCE /* asprintf */
#include "scene/bake_scene.h"

#include "base/clock.h"
#include "base/file.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "lightmap/planes.h"
#include "shade/ao.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Fails because a part's content is impossible. */
static vsh_result fail_damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: damaged: %s; bake this part again", path, what);
}

static vsh_result refuse_memory(const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
}

/* --- names of parts */

enum { MOST_NAMED = 6 }; /* missing parts in a message */

/* The name of the parts' files: the options' name, or the first lightmap's output. */
static const char *find_parts_name(const vshi_scene_bake *bake) {
    return bake->options.parts != NULL ? bake->options.parts
           : bake->target_count > 0    ? bake->lightmaps[0].output
                                       : bake->scene.receivers[0].output;
}

/* "NAME.I-of-N.part", to be freed. */
static vsh_result name_part(const char *name, int32_t shard, int32_t count, char **path, vsh_error *error) {
    if (asprintf(path, "%s.%d-of-%d.part", name, shard, count) >= 0) {
        return VSH_OK;
    }
    *path = NULL;
    return refuse_memory(name, error);
}

/* N of "NAME.I-of-N.part"; 0: another name. */
static int32_t parse_count(const char *entry, const char *name) {
    const size_t length = strlen(name);
    int shard = 0, count = 0, used = 0;
    if (strncmp(entry, name, length) != 0 || entry[length] != '.' ||
        sscanf(entry + length, ".%5d-of-%5d.part%n", &shard, &count, &used) != 2 || used == 0 ||
        entry[length + (size_t)used] != '\0') {
        return 0;
    }
    return shard >= 1 && shard <= count && count <= VSHI_MOST_SHARDS ? count : 0;
}

/* Finds the number of shards by the names of existing parts. */
static vsh_result count_shards(const char *parts, int32_t *count, vsh_error *error) {
    const char *slash = strrchr(parts, '/');
    char *folder = vshi_copy_folder(parts);
    if (folder == NULL) {
        return refuse_memory(parts, error);
    }
    DIR *open = opendir(folder);
    free(folder);
    if (open == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its folder cannot be read: %s", parts, strerror(errno));
    }
    int32_t least = INT32_MAX, most = 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        const int32_t found = parse_count(entry->d_name, slash != NULL ? slash + 1 : parts);
        least = found != 0 && found < least ? found : least;
        most = found > most ? found : most;
    }
    closedir(open);
    *count = most;
    if (most == 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: there are no parts beside it, %s.1-of-N.part and so on",
                         parts, parts);
    }
    return least == most
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: there are parts of %d and of %d shards beside it; give their number", parts,
                           least, most);
}

/* Fails if a part is missing, with the numbers of the missing ones. */
static vsh_result check_all_there(const char *name, int32_t count, vsh_error *error) {
    char list[256] = "";
    size_t at = 0;
    int32_t missing = 0;
    for (int32_t i = 1; i <= count; ++i) {
        char *path;
        VSHI_TRY(name_part(name, i, count, &path, error));
        if (access(path, F_OK) != 0 && ++missing <= MOST_NAMED && at < sizeof list) {
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%d", missing > 1 ? ", " : "", i);
        }
        free(path);
    }
    if (missing == 0) {
        return VSH_OK;
    }
    if (missing > MOST_NAMED && at < sizeof list) {
        snprintf(list + at, sizeof list - at, " and %d more", missing - MOST_NAMED);
    }
    return vshi_fail(error, VSH_ERROR_READ, "%s: %s missing: %s of %d; bake %s by --shard I/%d", name,
                     missing == 1 ? "a part is" : "parts are", list, count, missing == 1 ? "it" : "them",
                     count);
}

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

/* A lightmap of the job. */
typedef struct part_lightmap {
    uint64_t mesh_count, covered, samples; /* as in vsh_scene_lightmap */
    int32_t width, height;
} part_lightmap;

enum { ROUND = 8 };

typedef struct part_head {
    head_numbers numbers;
    char *bytes; /* owned: all of it, a multiple of 8 */
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
    const uint64_t count = 1 + n->words + 2 * n->attributes + n->channels;
    if (n->words > size || n->attributes > size || n->channels > size || count > size) {
        return fail_damaged(path, "its head", error);
    }
    VSHI_TRY(vshi_allocate((void **)&head->texts, (size_t)count, sizeof *head->texts, path, error));
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

static void put_text(FILE *out, const char *text) {
    fwrite(text, strlen(text) + 1, 1, out);
}

/* Makes the head of the job's part, or in a merge the head that parts should have. Free it also after an
 * error. */
static vsh_result make_head(const vshi_scene_bake *bake, part_head *head, vsh_error *error) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    size_t attribute_count;
    const vsh_attribute *attributes = vsh_provenance_attributes(bake->provenance, &attribute_count);
    vshi_channels channels;
    vsh_result result;
    *head = (part_head){.bytes = NULL};
    VSHI_TRY_DONE(vshi_channels_name(&bake->scene, 1, 1, &channels, error));
    const head_numbers numbers = {.words = bake->options.word_count,
                                  .attributes = attribute_count,
                                  .channels = (uint64_t)channels.image.channel_count,
                                  .lightmaps = bake->target_count,
                                  .errors = bake->error_count,
                                  .active_voxels = casters->active_voxels,
                                  .field_bytes = casters->field_bytes,
                                  .voxel_size = casters->voxel_size,
                                  .levels = casters->levels,
                                  .has_triangles = casters->has_triangles,
                                  .layered_ao = bake->layered_ao,
                                  .shard = bake->options.shard,
                                  .shard_count = bake->options.shard_count};
    FILE *out = open_memstream(&head->bytes, &head->size);
    VSHI_TRY_DONE(out != NULL ? VSH_OK : refuse_memory("part", error));
    fwrite(&numbers, sizeof numbers, 1, out);
    for (size_t i = 0; i < bake->target_count; ++i) {
        const vsh_scene_lightmap *own = &bake->lightmaps[i];
        const part_lightmap lightmap = {own->mesh_count, own->covered, own->samples, own->width, own->height};
        fwrite(&lightmap, sizeof lightmap, 1, out);
    }
    put_text(out, VSHI_VERSION);
    for (size_t i = 0; i < bake->options.word_count; ++i) {
        put_text(out, bake->options.words[i]);
    }
    for (size_t i = 0; i < attribute_count; ++i) {
        put_text(out, attributes[i].name);
        put_text(out, attributes[i].value);
    }
    for (int32_t i = 0; i < channels.image.channel_count; ++i) {
        put_text(out, channels.names[i]);
    }
    while (ftello(out) % ROUND != 0) {
        fputc('\0', out);
    }
    VSHI_TRY_DONE(fclose(out) == 0 ? VSH_OK : refuse_memory("part", error));
    result = parse_head("part", head, error);
done:
    vshi_channels_free(&channels);
    return result;
}

/* --- tiles */

/* An array of a page, [height][width] elements of so many bytes. */
typedef struct tile_array {
    unsigned char *values;
    size_t size;
    const char *channel; /* of values that have a range; NULL: no channel */
} tile_array;

/* The most arrays of a page, and the most bytes of a tile in one. */
enum { MOST_ARRAYS = VSH_MAX_CHANNELS + 8, MOST_TILE_BYTES = VSHI_TILE * VSHI_TILE * 3 * sizeof(float) };

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

static place find_place(const vshi_scene_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const size_t across = (p->width + VSHI_TILE - 1) / VSHI_TILE;
    place at = {tile % across * VSHI_TILE, tile / across * VSHI_TILE, VSHI_TILE, VSHI_TILE};
    at.columns = p->width - at.left < VSHI_TILE ? p->width - at.left : VSHI_TILE;
    at.rows = p->height - at.top < VSHI_TILE ? p->height - at.top : VSHI_TILE;
    return at;
}

/* Texel `k` of a tile, in rows. */
static size_t find_texel(const vshi_scene_page *page, const place *at, size_t k) {
    return (at->top + k / at->columns) * page->page.width + at->left + k % at->columns;
}

/* Bytes of a tile's texels in an array, rounded up to a multiple of 4. */
static size_t count_bytes(const tile_array *array, const place *at) {
    return (at->columns * at->rows * array->size + 3) / 4 * 4;
}

/* Copies the texels of a tile out of an array, or into it. */
static void copy_tile(const vshi_scene_page *page, const tile_array *array, const place *at,
                      unsigned char *bytes, bool in) {
    const size_t size = at->columns * array->size;
    for (size_t y = 0; y < at->rows; ++y, bytes += size) {
        unsigned char *row = array->values + ((at->top + y) * page->page.width + at->left) * array->size;
        memcpy(in ? row : bytes, in ? bytes : row, size);
    }
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
                             page->target->index, (double)value, (double)low, (double)high);
        }
    }
    return VSH_OK;
}

/* Whether a texel's shots can be a bake's. */
static bool is_sound(const vshi_scene_page *page, const vshi_shots *shots, size_t texel) {
    enum { MOST_RAYS = 1 << 24 };
    static const float LONGEST = 3.0f; /* mean of open directions, minus its lean */
    if (shots->share == NULL) {
        return true;
    }
    const uint32_t level = shots->level[texel], spacing = (uint32_t)page->target->charts->ao_spacing;
    const int32_t rays = shots->rays[texel];
    const float share = shots->share[texel];
    bool sound = level == 0 || page->page.state[texel] != VSHI_TEXEL_EMPTY;
    sound = sound &&
            (level == 0 || level == VSHI_AO_KNOWN_LEVEL || (level <= spacing && (level & (level - 1)) == 0));
    sound = sound && rays >= 0 && rays <= MOST_RAYS;
    sound = sound && ((share >= 0.0f && share <= 1.0f) || (isnan(share) && rays == 0));
    for (size_t k = 0; k < 3 && shots->open != NULL; ++k) {
        const float open = shots->open[3 * texel + k];
        sound = sound && (fabsf(open) <= LONGEST || (isnan(open) && rays == 0));
    }
    return sound;
}

/* The tile's texels to compare with the casters. */
static vshi_held_texels find_held(const vshi_shots *shots, size_t tile) {
    return shots->held != NULL ? shots->held[tile] : (vshi_held_texels){NULL, 0};
}

static bool are_held_sound(const vshi_scene_page *page, const vshi_shots *shots, size_t tile) {
    const vshi_held_texels held = find_held(shots, tile);
    const place at = find_place(page, tile);
    const int32_t rays = vshi_field_error_rays(page->page.shade.max_error);
    bool sound = true;
    for (size_t k = 0; k < held.count; ++k) {
        const vshi_held_texel *h = &held.list[k];
        const size_t x = vsh_texel_column(h->texel), y = vsh_texel_row(h->texel);
        sound = sound && x >= at.left && x < at.left + at.columns && y >= at.top && y < at.top + at.rows &&
                h->free[0] <= rays && h->free[1] <= rays && h->even >= -1 && h->even <= 1;
    }
    return sound;
}

/* Checks that a bake can have left the values of a tile, once the tile is rasterized. */
static vsh_result check_tile_values(const vshi_scene_page *page, size_t tile, const char *path,
                                    vsh_error *error) {
    const place at = find_place(page, tile);
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(page, arrays);
    const vshi_page *p = &page->page;
    bool sound = are_held_sound(page, &p->ao, tile) && are_held_sound(page, &p->sky, tile);
    for (size_t k = 0; k < at.columns * at.rows; ++k) {
        const size_t texel = find_texel(page, &at, k);
        for (size_t i = 0; i < count; ++i) {
            VSHI_TRY(arrays[i].channel != NULL ? check_values(page, &arrays[i], texel, path, error) : VSH_OK);
        }
        sound = sound && p->state[texel] <= VSHI_TEXEL_INVALID &&
                (p->state[texel] != VSHI_TEXEL_EMPTY) == (p->mesh[texel] != 0) &&
                is_sound(page, &p->ao, texel) && is_sound(page, &p->sky, texel);
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
static void write_bytes(part_output *part, const void *bytes, size_t size) {
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
    write_bytes(part, &front, sizeof front);
    write_bytes(part, head.bytes, head.size);
done:
    free_head(&head);
    return result;
}

static vsh_result finish_part(part_output *part, vsh_error *error) {
    const uint64_t sum = part->sum;
    write_bytes(part, &sum, sizeof sum);
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

/* Lists the shard's tiles of a lightmap. *number is that of its first tile with texels, and moves on to the
 * next lightmap's. */
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
    const place at = find_place(page, tile);
    const vshi_held_texels ao = find_held(&p->ao, tile), sky = find_held(&p->sky, tile);
    const vshi_part_tile head = {
        (uint32_t)page->target->index, (uint32_t)tile, {(uint32_t)ao.count, (uint32_t)sky.count}};
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(page, arrays);
    write_bytes(file, &head, sizeof head);
    write_bytes(file, &p->stats[tile], sizeof *p->stats);
    write_bytes(file, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors);
    for (size_t i = 0; i < count; ++i) {
        const size_t size = count_bytes(&arrays[i], &at);
        memset(bytes + size - 4, 0, 4); /* up to a multiple of 4 */
        copy_tile(page, &arrays[i], &at, bytes, false);
        write_bytes(file, bytes, size);
    }
    write_bytes(file, ao.list, ao.count * sizeof *ao.list);
    write_bytes(file, sky.list, sky.count * sizeof *sky.list);
}

static void add_to_report(vshi_scene_bake *bake, const vshi_scene_page *page, size_t tile) {
    const vshi_page *p = &page->page;
    const place at = find_place(page, tile);
    for (size_t k = 0; k < at.columns * at.rows; ++k) {
        const uint8_t state = p->state[find_texel(page, &at, k)];
        bake->report.texels += state != VSHI_TEXEL_EMPTY;
        bake->report.invalid_texels += state == VSHI_TEXEL_INVALID;
    }
    vshi_shade_stats_add(&bake->report.shade, &p->stats[tile]);
}

/* Counts the tiles with texels of all lightmaps. */
static size_t count_tiles(const vshi_scene_bake *bake) {
    size_t count = 0;
    for (size_t i = 0; i < bake->target_count; ++i) {
        const vsh_charts *charts = bake->targets[i].charts;
        for (size_t tile = 0; tile < vshi_charts_tiles(&charts->sorted); ++tile) {
            count += charts->samples[tile] > 0;
        }
    }
    return count;
}

static vsh_result bake_lightmap(vshi_scene_bake *bake, size_t index, uint64_t *number, part_output *file,
                                vshi_job *tiles_done, vsh_error *error) {
    vshi_page_group group = {.bake = NULL};
    uint32_t *tiles = NULL;
    unsigned char *bytes = NULL;
    size_t count;
    const double start = vshi_seconds();
    vsh_result result;
    VSHI_TRY_DONE(list_tiles(bake, bake->targets[index].charts, number, &tiles, &count, error));
    if (count == 0) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&bytes, MOST_TILE_BYTES, 1, "part", error));
    VSHI_TRY_DONE(vshi_page_group_open(bake, index, 1, &group, error));
    vshi_scene_page *page = group.pages;
    result = vshi_trace_tiles(bake->tracer, &page->page, tiles, count, tiles_done, error);
    VSHI_TRY_DONE(vshi_name_file(page->target->receiver.path, result, error));
    bake->report.bake_s += vshi_seconds() - start;
    for (size_t i = 0; i < count; ++i) {
        write_tile(file, page, tiles[i], bytes);
        add_to_report(bake, page, tiles[i]);
    }
done:
    vshi_page_group_close(&group);
    free(bytes);
    free(tiles);
    return result;
}

vsh_result vshi_bake_part(vshi_scene_bake *bake, vsh_error *error) {
    const size_t shards = (size_t)bake->options.shard_count;
    part_output file = {.sum = VSHI_PART_SUM};
    uint64_t number = 0;
    char *path = NULL;
    vsh_result result;
    vshi_job *tiles = vshi_job_begin(&bake->run, "bake", (count_tiles(bake) + shards - 1) / shards);
    VSHI_TRY_DONE(tiles != NULL ? VSH_OK : refuse_memory("part", error));
    VSHI_TRY_DONE(
        name_part(find_parts_name(bake), bake->options.shard, bake->options.shard_count, &path, error));
    VSHI_TRY_DONE(begin_part(bake, path, &file, error));
    for (size_t i = 0; i < bake->target_count; ++i) {
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
    FILE *file; /* NULL: closed */
    part_head head;
    uint64_t at, end; /* of the remaining tiles, bytes of the file */
} part;

struct vshi_parts {
    part *list; /* [count] */
    size_t count;
    uint64_t number; /* of the next lightmap's first tile */
};

static void close_part(part *p) {
    if (p->file != NULL) {
        fclose(p->file);
        p->file = NULL;
    }
}

static void free_part(part *p) {
    close_part(p);
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

static vsh_result read_bytes(const part *p, void *bytes, size_t size, vsh_error *error) {
    return size == 0 || fread(bytes, size, 1, p->file) == 1
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", p->path,
                           ferror(p->file) ? strerror(errno) : "it ends early");
}

/* Reads the front of a file of `size` bytes. Checks that it is a part, and has the size that it claims. */
static vsh_result read_front(const part *p, uint64_t size, vshi_part_front *front, vsh_error *error) {
    const bool whole = size >= sizeof *front + sizeof(uint64_t);
    *front = (vshi_part_front){.order = 0};
    VSHI_TRY(read_bytes(p, front, whole ? sizeof *front : (size_t)size, error));
    if (memcmp(front->magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is not a part of a bake", p->path);
    }
    if (!whole) {
        return fail_damaged(p->path, "it ends early", error);
    }
    if (memcmp(front->magic, VSHI_PART_MAGIC, sizeof front->magic) != 0 || front->order != VSHI_PART_ORDER) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of another version of vdbshade, or of another kind of machine; bake this "
                         "part again",
                         p->path);
    }
    const uint64_t rest = size - sizeof *front - sizeof(uint64_t);
    return front->head_bytes <= rest && front->head_bytes % ROUND == 0 && rest % 4 == 0
               ? VSH_OK
               : fail_damaged(p->path, "its size does not fit its head", error);
}

/* Opens a part and reads its head, up to the tiles; *sum becomes the checksum so far. */
static vsh_result open_part(part *p, const vsh_run *run, uint64_t *sum, vsh_error *error) {
    uint64_t size;
    vshi_part_front front;
    part_head *head = &p->head;
    VSHI_TRY(vshi_input_open(p->path, p->path, UINT64_MAX / 2, &p->file, &size, error));
    VSHI_TRY(read_front(p, size, &front, error));
    if (front.head_bytes > MOST_HEAD) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: its head has %" PRIu64 " bytes, at most %d", p->path,
                         front.head_bytes, MOST_HEAD);
    }
    head->size = (size_t)front.head_bytes;
    VSHI_TRY(vshi_check_limit(run, IN_MEMORY * (double)head->size, p->path, error));
    VSHI_TRY(vshi_allocate((void **)&head->bytes, head->size, 1, p->path, error));
    VSHI_TRY(read_bytes(p, head->bytes, head->size, error));
    *sum = vshi_part_sum(vshi_part_sum(VSHI_PART_SUM, &front, sizeof front), head->bytes, head->size);
    p->at = sizeof front + head->size;
    p->end = size - sizeof(uint64_t);
    VSHI_TRY(parse_head(p->path, head, error));
    return head->numbers.shard >= 1 && head->numbers.shard <= head->numbers.shard_count
               ? VSH_OK
               : fail_damaged(p->path, "its number", error);
}

/* Reads over the tiles and checks the sum of all bytes. */
static vsh_result check_sum(const part *p, uint64_t sum, const vsh_run *run, vsh_error *error) {
    unsigned char *chunk = NULL;
    uint64_t written;
    vsh_result result;
    vshi_job *job = vshi_job_begin(run, "parts", (size_t)((p->end - p->at) / CHUNK) + 1);
    VSHI_TRY_DONE(job != NULL ? VSH_OK : refuse_memory(p->path, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&chunk, CHUNK, 1, p->path, error));
    for (uint64_t left = p->end - p->at; left > 0;) {
        const size_t size = left < CHUNK ? (size_t)left : CHUNK;
        VSHI_TRY_DONE(read_bytes(p, chunk, size, error));
        sum = vshi_part_sum(sum, chunk, size);
        left -= size;
        VSHI_TRY_DONE(vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    VSHI_TRY_DONE(read_bytes(p, &written, sizeof written, error));
    result = written == sum ? VSH_OK : fail_damaged(p->path, "its checksum does not match", error);
done:
    free(chunk);
    vshi_job_end(job);
    return result;
}

/* --- parts that belong together */

static vsh_result check_attributes(const part *p, const part_head *own, vsh_error *error) {
    const uint64_t count = own->numbers.attributes, theirs = p->head.numbers.attributes;
    for (uint64_t i = 0; i < count || i < theirs; ++i) {
        const char *const *a = i < theirs ? p->head.attributes + 2 * i : NULL;
        const char *const *b = i < count ? own->attributes + 2 * i : NULL;
        if (a == NULL || b == NULL || strcmp(a[0], b[0]) != 0 || strcmp(a[1], b[1]) != 0) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: is of other inputs or options: its %s is '%.160s', of the others or here "
                             "'%.160s'; bake this part again",
                             p->path, b != NULL ? b[0] : a[0], a != NULL ? a[1] : "", b != NULL ? b[1] : "");
        }
    }
    return VSH_OK;
}

/* Whether the lightmaps, the channels and the casters are the same. The attributes name every input and
 * option, so these differ only if a part's head was altered. */
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

/* Checks that a part has the head `own`, which is made of the job's inputs and the first part's casters. */
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

/* Reports the casters of the parts, which a merge does not make. */
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
        VSHI_TRY(count_shards(find_parts_name(bake), count, error));
    }
    return check_all_there(find_parts_name(bake), *count, error);
}

vsh_result vshi_parts_open(vshi_scene_bake *bake, int32_t count, vsh_error *error) {
    const double start = vshi_seconds();
    part_head own = {.bytes = NULL};
    vshi_parts *parts = NULL;
    vsh_result result;
    VSHI_TRY_DONE(vshi_allocate((void **)&parts, 1, sizeof *parts, "parts", error));
    bake->parts = parts;
    parts->count = (size_t)count;
    VSHI_TRY_DONE(vshi_allocate((void **)&parts->list, parts->count, sizeof *parts->list, "parts", error));
    for (int32_t i = 0; i < count; ++i) {
        part *p = &parts->list[i];
        uint64_t sum = 0;
        VSHI_TRY_DONE(name_part(find_parts_name(bake), i + 1, count, &p->path, error));
        VSHI_TRY_DONE(open_part(p, &bake->run, &sum, error));
        VSHI_TRY_DONE(check_sum(p, sum, &bake->run, error));
        close_part(p);
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

/* Names the existing part with the lowest number, else the last one. */
static vsh_result find_first_part(const char *parts, int32_t count, char **path, vsh_error *error) {
    for (int32_t i = 1; i < count; ++i) {
        VSHI_TRY(name_part(parts, i, count, path, error));
        if (access(*path, F_OK) == 0) {
            return VSH_OK;
        }
        free(*path);
    }
    return name_part(parts, count, count, path, error);
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
    if (shard_count == 0) {
        VSHI_TRY(count_shards(parts, &shard_count, error));
    }
    part p = {.path = NULL};
    uint64_t sum;
    VSHI_TRY(find_first_part(parts, shard_count, &p.path, error));
    vsh_result result = open_part(&p, &full, &sum, error);
    result = result == VSH_OK ? copy_words(&p, words, error) : result;
    *count = result == VSH_OK ? (size_t)p.head.numbers.words : 0;
    free_part(&p);
    return result;
}

void vsh_part_words_free(char **words) {
    free(words);
}

/* --- reading tiles */

/* Reads a part's tiles of the current lightmap. */
typedef struct tile_reader {
    part *part;
    vshi_scene_page *page;
    unsigned char *bytes; /* [MOST_TILE_BYTES] */
} tile_reader;

/* Opens a part at its next tile. */
static vsh_result reopen_part(part *p, vsh_error *error) {
    uint64_t size;
    VSHI_TRY(vshi_input_open(p->path, p->path, UINT64_MAX / 2, &p->file, &size, error));
    return fseeko(p->file, (off_t)p->at, SEEK_SET) == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", p->path, strerror(errno));
}

static vsh_result read_next(const tile_reader *r, void *bytes, size_t size, vsh_error *error) {
    if (size > r->part->end - r->part->at) {
        return fail_damaged(r->part->path, "its tiles", error);
    }
    r->part->at += size;
    return read_bytes(r->part, bytes, size, error);
}

static vsh_result read_held(const tile_reader *r, vshi_shots *shots, size_t tile, uint32_t count,
                            vsh_error *error) {
    if (count == 0) {
        return VSH_OK;
    }
    if (shots->held == NULL || shots->held[tile].list != NULL || count > VSHI_TILE * VSHI_TILE) {
        return fail_damaged(r->part->path, "its tiles", error);
    }
    vshi_held_texels *held = &shots->held[tile];
    VSHI_TRY(vshi_allocate((void **)&held->list, count, sizeof *held->list, r->part->path, error));
    held->count = count;
    return read_next(r, held->list, count * sizeof *held->list, error);
}

static vsh_result read_tile(const tile_reader *r, const vshi_part_tile *head, vsh_error *error) {
    vshi_page *p = &r->page->page;
    const size_t tile = head->tile;
    const place at = find_place(r->page, tile);
    tile_array arrays[MOST_ARRAYS];
    const size_t count = list_arrays(r->page, arrays);
    VSHI_TRY(read_next(r, &p->stats[tile], sizeof *p->stats, error));
    VSHI_TRY(read_next(r, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors, error));
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY(read_next(r, r->bytes, count_bytes(&arrays[i], &at), error));
        copy_tile(r->page, &arrays[i], &at, r->bytes, true);
    }
    VSHI_TRY(read_held(r, &p->ao, tile, head->held[0], error));
    return read_held(r, &p->sky, tile, head->held[1], error);
}

/* owner[tile] is 1 + the tile's part, 0 without texels. This bit marks tiles that were read. */
#define WAS_READ UINT32_C(0x80000000)

/* Reads the tiles that a part has of the lightmap. */
static vsh_result read_part_tiles(const tile_reader *r, uint32_t *owner, uint32_t number, vshi_job *job,
                                  vsh_error *error) {
    const vshi_target *target = r->page->target;
    const size_t tiles = vshi_charts_tiles(&target->charts->sorted);
    while (r->part->at < r->part->end) {
        vshi_part_tile head;
        VSHI_TRY(read_next(r, &head, sizeof head, error));
        if (head.lightmap > target->index) {
            r->part->at -= sizeof head;
            return VSH_OK;
        }
        if (head.lightmap < target->index || head.tile >= tiles || owner[head.tile] != number + 1) {
            return fail_damaged(r->part->path, "its tiles", error);
        }
        owner[head.tile] |= WAS_READ;
        VSHI_TRY(read_tile(r, &head, error));
        VSHI_TRY(vshi_job_advance(job, 1) ? vshi_job_fail_cancelled(job, error) : VSH_OK);
    }
    return VSH_OK;
}

/* Tiles that were read, to be rasterized and checked. */
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
    return check_tile_values(c->page, tile, c->parts->list[(c->owner[tile] & ~WAS_READ) - 1].path, error);
}

vsh_result vshi_parts_read(vshi_parts *parts, vshi_scene_page *page, vshi_job *job, vsh_error *error) {
    const vsh_charts *charts = page->target->charts;
    const size_t tiles = vshi_charts_tiles(&charts->sorted);
    uint32_t *owner = NULL;
    unsigned char *bytes = NULL;
    const vshi_array arrays[] = {VSHI_ARRAY(owner, tiles), VSHI_ARRAY(bytes, MOST_TILE_BYTES)};
    vsh_result result;
    VSHI_TRY_DONE(VSHI_ALLOCATE_ALL(arrays, "parts", error));
    for (size_t tile = 0; tile < tiles; ++tile) {
        if (charts->samples[tile] > 0) {
            owner[tile] = (uint32_t)find_owner(charts, parts->number++, parts->count) + 1;
        }
    }
    for (size_t i = 0; i < parts->count; ++i) {
        const tile_reader reader = {.part = &parts->list[i], .page = page, .bytes = bytes};
        result = reopen_part(reader.part, error);
        result = result == VSH_OK ? read_part_tiles(&reader, owner, (uint32_t)i, job, error) : result;
        close_part(reader.part);
        VSHI_TRY_DONE(result);
    }
    for (size_t tile = 0; tile < tiles; ++tile) {
        if (owner[tile] != 0 && (owner[tile] & WAS_READ) == 0) {
            VSHI_TRY_DONE(fail_damaged(parts->list[owner[tile] - 1].path, "a tile is missing", error));
        }
    }
    checking c = {.parts = parts, .page = page, .owner = owner};
    result = vshi_parallel_each(job, tiles, 1, 0, check_tile, &c, error);
done:
    free(bytes);
    free(owner);
    return result;
}
