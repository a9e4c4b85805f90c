/* Parts of a bake: files of tiles, written by shards and put together by a merge. */
#define _GNU_SOURCE /* asprintf */
#include "scene/bake_scene.h"

#include "base/clock.h"
#include "base/file.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "lightmap/planes.h"

#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

/* Fails because a part's content is impossible. */
static vsh_result fail_damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: damaged: %s; bake this part again", path, what);
}

/* --- names of parts */

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
    return vshi_fail_memory(error, name);
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
    char folder[PATH_MAX];
    vshi_path_folder(parts, folder);
    DIR *open = opendir(folder);
    if (open == NULL) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its folder cannot be read: %s", parts, strerror(errno));
    }
    int32_t least = INT32_MAX, most = 0;
    for (const struct dirent *entry; (entry = readdir(open)) != NULL;) {
        const int32_t found = parse_count(entry->d_name, vshi_path_name(parts));
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

/* Finds the number of parts if *count is 0. Fails if one is missing, with the numbers of the missing ones. */
static vsh_result find_parts(const char *name, int32_t *count, vsh_error *error) {
    enum { MOST_NAMED = 6 };
    char list[128] = "";
    size_t at = 0;
    int32_t missing = 0;
    VSHI_TRY(*count == 0 ? count_shards(name, count, error) : VSH_OK);
    for (int32_t i = 1; i <= *count; ++i) {
        char *path;
        VSHI_TRY(name_part(name, i, *count, &path, error));
        if (access(path, F_OK) != 0 && ++missing <= MOST_NAMED) {
            at += (size_t)snprintf(list + at, sizeof list - at, "%s%d", missing > 1 ? ", " : "", i);
        }
        free(path);
    }
    if (missing > MOST_NAMED) {
        snprintf(list + at, sizeof list - at, " and %d more", missing - MOST_NAMED);
    }
    return missing == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: missing parts: %s of %d; bake them by --shard I/%d",
                           name, list, *count, *count);
}

/* --- bytes of a part, read or written alike */

typedef struct part_file {
    FILE *file; /* NULL: closed */
    const char *path;
    bool reads;
    uint64_t sum; /* of the bytes that were written */
} part_file;

static void close_file(part_file *f) {
    if (f->file != NULL) {
        fclose(f->file);
        f->file = NULL;
    }
}

/* Reads bytes from the file, or writes them. */
static vsh_result move_bytes(part_file *f, void *bytes, size_t size, vsh_error *error) {
    const size_t moved = f->reads ? fread(bytes, 1, size, f->file) : fwrite(bytes, 1, size, f->file);
    f->sum = f->reads ? f->sum : vshi_part_sum(f->sum, bytes, size);
    if (moved == size) {
        return VSH_OK;
    }
    const char *why = f->reads && feof(f->file) ? "it ends early" : strerror(errno);
    return f->reads ? vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", f->path, why)
                    : vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", f->path, why);
}

/* Whether planes of a kind are set when the page is finished, not by its tiles. */
static bool is_finished_later(const vshi_page *page, const vshi_plane_kind *kind) {
    return kind->needs == 0 || (kind->needs == VSHI_NEEDS_AO && page->ao.own.ao != NULL) ||
           (kind->needs == VSHI_NEEDS_OPEN && page->sky.own.ao != NULL);
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

/* Moves a tile's texels of an array of the page, whose elements have `size` bytes. */
static vsh_result move_array(part_file *f, const vshi_scene_page *page, const place *at, void *array,
                             size_t size, vsh_error *error) {
    for (size_t y = at->top; y < at->top + at->rows; ++y) {
        unsigned char *row = (unsigned char *)array + (y * page->page.width + at->left) * size;
        VSHI_TRY(move_bytes(f, row, at->columns * size, error));
    }
    return VSH_OK;
}

/* Moves a tile's texels to compare with the casters. The texels that it reads must lie in the tile. */
static vsh_result move_compared(part_file *f, const place *at, vshi_compared_texels *compared,
                                vsh_error *error) {
    uint64_t count = compared->count;
    VSHI_TRY(move_bytes(f, &count, sizeof count, error));
    if (count > VSHI_TILE * VSHI_TILE) {
        return fail_damaged(f->path, "its tiles", error);
    }
    if (f->reads) {
        VSHI_TRY(
            vshi_allocate((void **)&compared->list, (size_t)count, sizeof *compared->list, f->path, error));
    }
    VSHI_TRY(move_bytes(f, compared->list, (size_t)count * sizeof *compared->list, error));
    for (compared->count = 0; compared->count < count; ++compared->count) {
        const uint32_t texel = compared->list[compared->count].texel;
        const size_t x = vsh_texel_column(texel), y = vsh_texel_row(texel);
        if (x < at->left || x >= at->left + at->columns || y < at->top || y >= at->top + at->rows) {
            return fail_damaged(f->path, "its tiles", error);
        }
    }
    return VSH_OK;
}

static vsh_result move_shots(part_file *f, const vshi_scene_page *page, const place *at, size_t tile,
                             const vshi_shots *shots, vsh_error *error) {
    vshi_shots of = *shots;
    vshi_array arrays[VSHI_SHOT_ARRAYS];
    vshi_shots_list(&of, arrays);
    for (size_t i = 0; i < VSHI_SHOT_ARRAYS; ++i) {
        if (*arrays[i].memory != NULL) {
            VSHI_TRY(move_array(f, page, at, *arrays[i].memory, arrays[i].size, error));
        }
    }
    return of.compared != NULL ? move_compared(f, at, &of.compared[tile], error) : VSH_OK;
}

/* Reads or writes what vshi_trace_tiles() leaves of a tile. */
static vsh_result move_tile(part_file *f, const vshi_scene_page *page, size_t tile, vsh_error *error) {
    const vshi_page *p = &page->page;
    const place at = find_place(page, tile);
    VSHI_TRY(move_bytes(f, &p->stats[tile], sizeof *p->stats, error));
    VSHI_TRY(move_bytes(f, &p->errors[tile * p->error_count], p->error_count * sizeof *p->errors, error));
    VSHI_TRY(move_array(f, page, &at, p->state, sizeof *p->state, error));
    for (size_t k = 0; k < at.columns * at.rows; ++k) { /* states index tables */
        if (p->state[find_texel(page, &at, k)] > VSHI_TEXEL_INVALID) {
            return fail_damaged(f->path, "its tiles", error);
        }
    }
    for (vshi_plane_cursor c = {.kind = NULL}; vshi_plane_next(&p->lightmap, p->light_count, &c);) {
        if (!is_finished_later(p, c.kind)) {
            VSHI_TRY(
                move_array(f, page, &at, c.values, vshi_plane_components(c.kind) * sizeof(float), error));
        }
    }
    VSHI_TRY(move_shots(f, page, &at, tile, &p->ao, error));
    return move_shots(f, page, &at, tile, &p->sky, error);
}

/* --- which tiles a part has */

/* The part that bakes a tile, from 0 on. On pages from 2048 texels on, tiles go out in runs: neighbours
 * share pages of memory, so parts of single tiles would each touch all of every plane. */
static uint64_t find_owner(const vsh_charts *charts, uint64_t tile, uint64_t parts) {
    const uint64_t run = (uint64_t)charts->info.width / 1024;
    return tile / (run > 1 ? run : 1) % parts;
}

/* Lists the tiles of a lightmap that part `shard` of `shards` has, in their order; to be freed. *number is
 * that of its first tile with texels, and becomes that of the next lightmap's. */
static vsh_result list_tiles(const vsh_charts *charts, uint64_t shard, uint64_t shards, uint64_t *number,
                             uint32_t **tiles, size_t *count, vsh_error *error) {
    const size_t all = vshi_charts_tiles(&charts->sorted);
    *count = 0;
    VSHI_TRY(vshi_allocate((void **)tiles, all, sizeof **tiles, "part", error));
    for (size_t tile = 0; tile < all; ++tile) {
        if (charts->samples[tile] > 0 && find_owner(charts, (*number)++, shards) + 1 == shard) {
            (*tiles)[(*count)++] = (uint32_t)tile;
        }
    }
    return VSH_OK;
}

/* Hashes the lightmaps, the channels and the casters. The attributes name the files and options, but programs
 * can change a scene beside them. */
static vsh_result hash_layout(const vshi_scene_bake *bake, uint64_t *layout, vsh_error *error) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    const double numbers[] = {casters->voxel_size,      (double)casters->active_voxels,
                              casters->levels,          casters->has_triangles,
                              (double)bake->layered_ao, (double)bake->error_count};
    vshi_channels channels;
    const vsh_result result = vshi_channels_name(&bake->scene, 1, 1, &channels, error);
    *layout = vshi_part_sum(VSHI_PART_SUM, numbers, sizeof numbers);
    for (size_t i = 0; i < bake->target_count; ++i) {
        const vsh_scene_lightmap *l = &bake->lightmaps[i];
        const uint64_t sizes[] = {(uint64_t)l->width, (uint64_t)l->height, l->mesh_count, l->covered,
                                  l->samples};
        *layout = vshi_part_sum(*layout, sizes, sizeof sizes);
    }
    for (int32_t c = 0; result == VSH_OK && c < channels.image.channel_count; ++c) {
        *layout = vshi_part_sum(*layout, channels.names[c], strlen(channels.names[c]) + 1);
    }
    vshi_channels_free(&channels);
    return result;
}

/* --- writing */

static void write_text(FILE *out, const char *text) {
    fwrite(text, strlen(text) + 1, 1, out);
}

/* Joins the texts of the job's part, to be freed: words, then names and values of attributes. */
static vsh_result join_texts(const vshi_scene_bake *bake, char **texts, size_t *size, vsh_error *error) {
    size_t count;
    const vsh_attribute *attributes = vsh_provenance_attributes(bake->provenance, &count);
    FILE *out = open_memstream(texts, size);
    if (out == NULL) {
        return vshi_fail_memory(error, "part");
    }
    for (size_t i = 0; i < bake->options.word_count; ++i) {
        write_text(out, bake->options.words[i]);
    }
    for (size_t i = 0; i < count; ++i) {
        write_text(out, attributes[i].name);
        write_text(out, attributes[i].value);
    }
    return fclose(out) == 0 ? VSH_OK : vshi_fail_memory(error, "part");
}

/* Writes what is before the tiles. */
static vsh_result write_head(const vshi_scene_bake *bake, part_file *f, vsh_error *error) {
    const vsh_occluders_info *casters = &bake->report.occluders;
    vshi_part_front front = {.magic = VSHI_PART_MAGIC,
                             .order = VSHI_PART_ORDER,
                             .words = bake->options.word_count,
                             .active_voxels = casters->active_voxels,
                             .field_bytes = casters->field_bytes,
                             .voxel_size = casters->voxel_size,
                             .levels = casters->levels,
                             .has_triangles = casters->has_triangles,
                             .layered_ao = bake->layered_ao,
                             .shard = bake->options.shard,
                             .shard_count = bake->options.shard_count};
    char *texts = NULL;
    size_t size = 0;
    vsh_result result;
    VSHI_TRY_DONE(hash_layout(bake, &front.layout, error));
    VSHI_TRY_DONE(join_texts(bake, &texts, &size, error));
    front.head_bytes = size;
    VSHI_TRY_DONE(move_bytes(f, &front, sizeof front, error));
    result = move_bytes(f, texts, size, error);
done:
    free(texts);
    return result;
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

static vsh_result bake_lightmap(vshi_scene_bake *bake, size_t index, uint64_t *number, part_file *file,
                                vshi_job *tiles_done, vsh_error *error) {
    vshi_page_group group = {.bake = NULL};
    uint32_t *tiles = NULL;
    size_t count;
    const double start = vshi_seconds();
    vsh_result result;
    VSHI_TRY_DONE(list_tiles(bake->targets[index].charts, (uint64_t)bake->options.shard,
                             (uint64_t)bake->options.shard_count, number, &tiles, &count, error));
    if (count == 0) {
        goto done;
    }
    VSHI_TRY_DONE(vshi_page_group_open(bake, index, 1, &group, error));
    vshi_scene_page *page = group.pages;
    result = vshi_trace_tiles(bake->tracer, &page->page, tiles, count, tiles_done, error);
    VSHI_TRY_DONE(vshi_name_file(page->target->receiver.path, result, error));
    bake->report.bake_s += vshi_seconds() - start;
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(move_tile(file, page, tiles[i], error));
        add_to_report(bake, page, tiles[i]);
    }
done:
    vshi_page_group_close(&group);
    free(tiles);
    return result;
}

static vsh_result write_part(vshi_scene_bake *bake, part_file *f, vshi_job *tiles, vsh_error *error) {
    uint64_t number = 0;
    VSHI_TRY(write_head(bake, f, error));
    for (size_t i = 0; i < bake->target_count; ++i) {
        VSHI_TRY(bake_lightmap(bake, i, &number, f, tiles, error));
    }
    uint64_t sum = f->sum;
    VSHI_TRY(move_bytes(f, &sum, sizeof sum, error));
    FILE *file = f->file;
    f->file = NULL;
    return fclose(file) == 0
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", f->path, strerror(errno));
}

vsh_result vshi_bake_part(vshi_scene_bake *bake, vsh_error *error) {
    const size_t shards = (size_t)bake->options.shard_count;
    vshi_output output = {.target = NULL};
    part_file f = {.sum = VSHI_PART_SUM};
    char *path = NULL;
    vsh_result result;
    vshi_job *tiles;
    VSHI_TRY(
        vshi_job_open(&tiles, &bake->run, "bake", (count_tiles(bake) + shards - 1) / shards, "part", error));
    VSHI_TRY_DONE(
        name_part(find_parts_name(bake), bake->options.shard, bake->options.shard_count, &path, error));
    VSHI_TRY_DONE(vshi_output_begin(&output, path, error));
    f.path = path;
    f.file = fopen(output.temporary, "wb");
    if (f.file == NULL) {
        result = vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
        goto done;
    }
    VSHI_TRY_DONE(write_part(bake, &f, tiles, error));
    result = vshi_output_commit(&output, error);
done:
    close_file(&f);
    vshi_output_abandon(&output);
    vshi_job_end(tiles);
    free(path);
    return result;
}

/* --- reading */

enum { MOST_HEAD = 1 << 28, CHUNK = 1 << 20 }; /* bytes; read at once */

/* Opens a part and reads what is before its texts. Checks that it is a part, and has room for the texts. */
static vsh_result open_part(const char *path, part_file *f, vshi_part_front *front, uint64_t *size,
                            vsh_error *error) {
    const size_t least = sizeof *front + sizeof(uint64_t);
    *f = (part_file){.path = path, .reads = true};
    *front = (vshi_part_front){.order = 0};
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX / 2, &f->file, size, error));
    VSHI_TRY(move_bytes(f, front, *size < least ? (size_t)*size : sizeof *front, error));
    if (memcmp(front->magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is not a part of a bake", path);
    }
    if (*size >= least && (memcmp(front->magic, VSHI_PART_MAGIC, sizeof front->magic) != 0 ||
                           front->order != VSHI_PART_ORDER)) {
        return vshi_fail(
            error, VSH_ERROR_INPUT,
            "%s: was written by another version of vdbshade, or on another kind of machine; bake "
            "this part again",
            path);
    }
    if (*size < least || front->head_bytes > *size - least) {
        return fail_damaged(path, "it ends early", error);
    }
    return front->head_bytes <= MOST_HEAD
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_LIMIT, "%s: its head has %" PRIu64 " bytes, at most %d", path,
                           front->head_bytes, MOST_HEAD);
}

/* Reads over the tiles and checks the sum of all bytes. */
static vsh_result check_sum(part_file *f, const vshi_part_front *front, const char *texts, uint64_t size,
                            const vsh_run *run, vsh_error *error) {
    uint64_t left = size - sizeof *front - front->head_bytes - sizeof(uint64_t), written;
    uint64_t sum = vshi_part_sum(VSHI_PART_SUM, front, sizeof *front);
    unsigned char *chunk = NULL;
    vsh_result result;
    vshi_job *job;
    VSHI_TRY(vshi_job_open(&job, run, "parts", (size_t)(left / CHUNK) + 1, f->path, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&chunk, CHUNK, 1, f->path, error));
    sum = vshi_part_sum(sum, texts, (size_t)front->head_bytes);
    while (left > 0) {
        const size_t count = left < CHUNK ? (size_t)left : CHUNK;
        VSHI_TRY_DONE(move_bytes(f, chunk, count, error));
        sum = vshi_part_sum(sum, chunk, count);
        left -= count;
        VSHI_TRY_DONE(vshi_job_step(job, 1, error));
    }
    VSHI_TRY_DONE(move_bytes(f, &written, sizeof written, error));
    result = written == sum ? VSH_OK : fail_damaged(f->path, "its checksum does not match", error);
done:
    free(chunk);
    vshi_job_end(job);
    return result;
}

/* Returns the next of the texts before `end`, which a NUL ends; NULL: there is none. */
static const char *next_text(const char **at, const char *end) {
    const char *text = *at;
    *at = text < end ? text + strlen(text) + 1 : end;
    return text < end ? text : NULL;
}

/* Fails if attributes differ from the job's. `at` are the part's names and values. */
static vsh_result check_attributes(const char *path, const char *at, const char *end,
                                   const vshi_scene_bake *bake, vsh_error *error) {
    size_t count;
    const vsh_attribute *own = vsh_provenance_attributes(bake->provenance, &count);
    const char *name = "", *value;
    for (size_t i = 0; i < count || name != NULL; ++i) {
        name = next_text(&at, end);
        value = next_text(&at, end);
        if (i < count ? name == NULL || value == NULL || strcmp(name, own[i].name) != 0 ||
                            strcmp(value, own[i].value) != 0
                      : name != NULL) {
            return vshi_fail(
                error, VSH_ERROR_INPUT,
                "%s: was baked from other inputs or options: its %s is '%.160s', expected '%.160s'; "
                "bake this part again",
                path, i < count ? own[i].name : name, value != NULL ? value : "",
                i < count ? own[i].value : "");
        }
    }
    return VSH_OK;
}

/* Reports the casters of the parts, which a merge does not make. */
static vsh_result report_casters(vshi_scene_bake *bake, const vshi_part_front *n, vsh_error *error) {
    vsh_occluders_info *casters = &bake->report.occluders;
    casters->voxel_size = n->voxel_size;
    casters->has_triangles = n->has_triangles;
    casters->active_voxels = n->active_voxels;
    casters->field_bytes = n->field_bytes;
    casters->levels = n->levels;
    bake->layered_ao = n->layered_ao != 0;
    return vshi_bake_find_provenance(bake, error);
}

/* Checks the head of a part, with its texts, and that it is part `shard` of the job. */
static vsh_result check_head(vshi_scene_bake *bake, const char *path, const vshi_part_front *front,
                             const char *texts, int32_t shard, int32_t count, vsh_error *error) {
    const char *end = texts + front->head_bytes, *at = texts;
    uint64_t layout;
    if (front->shard != shard || front->shard_count != count) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: holds part %d of %d; was it renamed?", path,
                         front->shard, front->shard_count);
    }
    if (shard == 1) {
        VSHI_TRY(report_casters(bake, front, error));
    }
    for (uint64_t i = 0; i < front->words && at < end; ++i) {
        next_text(&at, end);
    }
    VSHI_TRY(check_attributes(path, at, end, bake, error));
    VSHI_TRY(hash_layout(bake, &layout, error));
    return front->layout == layout
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_INPUT,
                           "%s: its lightmaps, channels or voxels are not those of the other parts or of the "
                           "scene; bake this part again",
                           path);
}

/* The part of a merge. */
typedef struct part {
    char *path;
    off_t at; /* of the next tile */
} part;

struct vshi_parts {
    part *list; /* [count] */
    size_t count;
    uint64_t number; /* of the next lightmap's first tile */
};

void vshi_parts_free(vshi_parts *parts) {
    for (size_t i = 0; parts != NULL && parts->list != NULL && i < parts->count; ++i) {
        free(parts->list[i].path);
    }
    if (parts != NULL) {
        free(parts->list);
        free(parts);
    }
}

vsh_result vshi_parts_find(const vshi_scene_bake *bake, int32_t *count, vsh_error *error) {
    *count = bake->options.shard_count;
    return find_parts(find_parts_name(bake), count, error);
}

static vsh_result check_part(vshi_scene_bake *bake, part *p, int32_t shard, int32_t count, vsh_error *error) {
    part_file f;
    vshi_part_front front;
    uint64_t size;
    char *texts = NULL;
    vsh_result result;
    VSHI_TRY_DONE(open_part(p->path, &f, &front, &size, error));
    VSHI_TRY_DONE(vshi_check_limit(&bake->run, (double)front.head_bytes, p->path, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&texts, (size_t)front.head_bytes + 1, 1, p->path, error));
    VSHI_TRY_DONE(move_bytes(&f, texts, (size_t)front.head_bytes, error));
    p->at = ftello(f.file);
    VSHI_TRY_DONE(check_sum(&f, &front, texts, size, &bake->run, error));
    result = check_head(bake, p->path, &front, texts, shard, count, error);
done:
    close_file(&f);
    free(texts);
    return result;
}

vsh_result vshi_parts_open(vshi_scene_bake *bake, int32_t count, vsh_error *error) {
    const double start = vshi_seconds();
    VSHI_TRY(vshi_allocate((void **)&bake->parts, 1, sizeof *bake->parts, "parts", error));
    vshi_parts *parts = bake->parts;
    parts->count = (size_t)count;
    VSHI_TRY(vshi_allocate((void **)&parts->list, parts->count, sizeof *parts->list, "parts", error));
    for (int32_t i = 0; i < count; ++i) {
        part *p = &parts->list[i];
        VSHI_TRY(name_part(find_parts_name(bake), i + 1, count, &p->path, error));
        VSHI_TRY(check_part(bake, p, i + 1, count, error));
    }
    bake->report.load_s += vshi_seconds() - start;
    return VSH_OK;
}

/* --- words of a part */

/* Reads the words into one block: their list, with a NULL at its end, and the texts. */
static vsh_result read_words(const char *path, const vsh_run *run, char ***words, size_t *count,
                             vsh_error *error) {
    part_file f;
    vshi_part_front front;
    uint64_t size;
    vsh_result result;
    VSHI_TRY_DONE(open_part(path, &f, &front, &size, error));
    const double bytes = (double)front.words * sizeof **words + (double)front.head_bytes;
    VSHI_TRY_DONE(front.words <= front.head_bytes ? VSH_OK : fail_damaged(path, "its head", error));
    VSHI_TRY_DONE(vshi_check_limit(run, bytes, path, error));
    const size_t list = ((size_t)front.words + 1) * sizeof **words, texts = (size_t)front.head_bytes;
    VSHI_TRY_DONE(vshi_allocate((void **)words, list + texts + 1, 1, path, error));
    char *const first = (char *)*words + list;
    const char *at = first;
    VSHI_TRY_DONE(move_bytes(&f, first, texts, error));
    for (; *count < front.words; ++*count) {
        const char *text = next_text(&at, first + texts);
        VSHI_TRY_DONE(text != NULL ? VSH_OK : fail_damaged(path, "its head", error));
        (*words)[*count] = first + (text - first);
    }
done:
    close_file(&f);
    return result;
}

vsh_result vsh_part_words(const char *parts, int32_t shard_count, const vsh_run *run, char ***words,
                          size_t *count, vsh_error *error) {
    VSHI_NEEDS_BOTH(words, count);
    *words = NULL;
    *count = 0;
    VSHI_NEEDS(parts);
    vsh_run full;
    VSHI_TRY(vshi_run_resolve(run, &full, error));
    if (shard_count < 0 || shard_count > VSHI_MOST_SHARDS) {
        return vshi_fail(error, VSH_ERROR_ARGUMENT, "shard_count %d: expected 0 to %d", shard_count,
                         VSHI_MOST_SHARDS);
    }
    char *path;
    VSHI_TRY(find_parts(parts, &shard_count, error));
    VSHI_TRY(name_part(parts, 1, shard_count, &path, error));
    const vsh_result result = read_words(path, &full, words, count, error);
    if (result != VSH_OK) {
        vsh_part_words_free(*words);
        *words = NULL;
        *count = 0;
    }
    free(path);
    return result;
}

void vsh_part_words_free(char **words) {
    free(words);
}

/* --- tiles of a merge */

/* Reads the tiles that part `index` has of the lightmap. */
static vsh_result read_tiles(vshi_parts *parts, size_t index, const vshi_scene_page *page, vshi_job *job,
                             vsh_error *error) {
    part *p = &parts->list[index];
    part_file f = {.path = p->path, .reads = true};
    uint64_t number = parts->number, size;
    uint32_t *tiles = NULL;
    size_t count;
    vsh_result result;
    VSHI_TRY_DONE(list_tiles(page->target->charts, index + 1, parts->count, &number, &tiles, &count, error));
    VSHI_TRY_DONE(vshi_input_open(p->path, p->path, UINT64_MAX / 2, &f.file, &size, error));
    if (fseeko(f.file, p->at, SEEK_SET) != 0) {
        result = vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", p->path, strerror(errno));
        goto done;
    }
    for (size_t i = 0; i < count; ++i) {
        VSHI_TRY_DONE(move_tile(&f, page, tiles[i], error));
        VSHI_TRY_DONE(vshi_job_step(job, 1, error));
    }
    p->at = ftello(f.file);
    parts->number = index + 1 == parts->count ? number : parts->number;
done:
    close_file(&f);
    free(tiles);
    return result;
}

static vsh_result rasterize_tile(void *user, size_t tile, vsh_error *error) {
    vshi_scene_page *page = user;
    return page->target->charts->samples[tile] > 0 ? vshi_page_rasterize(&page->page, tile, error) : VSH_OK;
}

vsh_result vshi_parts_read(vshi_parts *parts, vshi_scene_page *page, vshi_job *job, vsh_error *error) {
    for (size_t i = 0; i < parts->count; ++i) {
        VSHI_TRY(read_tiles(parts, i, page, job, error));
    }
    const size_t tiles = vshi_charts_tiles(&page->target->charts->sorted);
    return vshi_parallel_each(job, tiles, 1, 0, rasterize_tile, page, error);
}
