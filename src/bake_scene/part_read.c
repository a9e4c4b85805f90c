#include "bake_scene/part_code.h"
#include "bake_scene/part_layout.h"
#include "base/input.h"
#include "base/job.h"
#include "base/memory.h"
#include "base/try.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST_HEAD = 1 << 28, IN_MEMORY = 8, CHUNK = 1 << 20 }; /* bytes; of a head's in memory; read at once */

void vshi_part_head_free(vshi_part_head *head) {
    for (uint64_t i = 0; i < head->word_count && head->words != NULL; ++i) {
        free(head->words[i]);
    }
    for (uint64_t i = 0; i < head->attribute_count && head->attributes != NULL; ++i) {
        free(head->attributes[i].name);
        free(head->attributes[i].value);
    }
    for (uint64_t i = 0; i < head->channel_count && head->channels != NULL; ++i) {
        free(head->channels[i]);
    }
    free(head->pieces);
    free(head->lightmaps);
    free(head->channels);
    free(head->attributes);
    free(head->words);
    free(head->version);
    *head = (vshi_part_head){.version = NULL};
}

void vshi_part_free(vshi_part *part) {
    for (uint64_t i = 0; part->pieces != NULL && i < part->head.piece_count; ++i) {
        free(part->pieces[i].invalid_by_mesh);
        free(part->pieces[i].errors);
    }
    free(part->pieces);
    free(part->offset);
    vshi_part_head_free(&part->head);
    free(part->path);
    *part = (vshi_part){.path = NULL};
}

static vsh_result damaged(const char *path, const char *what, vsh_error *error) {
    return vshi_fail(error, VSH_ERROR_INPUT, "%s: damaged: %s; bake this part again", path, what);
}

/* Whether the front is one of ours, and its sizes are those of the file. */
static vsh_result check_front(const char *path, const vshi_part_front *front, uint64_t size,
                              vsh_error *error) {
    if (memcmp(front->magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) != 0) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", path);
    }
    if (memcmp(front->magic, VSHI_PART_MAGIC, sizeof front->magic) != 0 || front->order != VSHI_PART_ORDER) {
        return vshi_fail(error, VSH_ERROR_INPUT,
                         "%s: is of another version of vdbshade, or of another kind of machine; bake this "
                         "part again",
                         path);
    }
    const uint64_t rest = size - sizeof *front - sizeof(uint64_t);
    if (front->head_bytes > rest || front->tail_bytes > rest - front->head_bytes ||
        front->row_bytes != rest - front->head_bytes - front->tail_bytes) {
        return damaged(path, "it has not the size that it tells", error);
    }
    return front->head_bytes % 4 == 0 && front->tail_bytes % 4 == 0 && front->row_bytes % 4 == 0
               ? VSH_OK
               : damaged(path, "its sizes", error);
}

/* Whether pieces are rows of lightmaps, and as many as the file has room for; sets where each begins. */
static vsh_result check_pieces(vshi_part *part, const vshi_part_front *front, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    uint64_t at = 0;
    double tail = 0.0;
    if (head->channel_count > VSH_MAX_CHANNELS || head->channel_count == 0) {
        return damaged(part->path, "its channels", error);
    }
    for (uint64_t i = 0; i < head->piece_count; ++i) {
        const vshi_part_piece *piece = &head->pieces[i];
        if (piece->lightmap >= head->lightmap_count) {
            return damaged(part->path, "rows of no lightmap", error);
        }
        const vshi_part_lightmap *lightmap = &head->lightmaps[piece->lightmap];
        if (lightmap->width < 1 || lightmap->width > VSH_MAX_LIGHTMAP_SIZE || lightmap->height < 1 ||
            lightmap->height > VSH_MAX_LIGHTMAP_SIZE || piece->first < 0 || piece->rows < 1 ||
            piece->first >= lightmap->height || piece->rows > lightmap->height - piece->first) {
            return damaged(part->path, "rows outside of their lightmap", error);
        }
        part->offset[i] = sizeof *front + front->head_bytes + at;
        /* at most 2^32 × 257 × 4 */
        const uint64_t bytes =
            (uint64_t)lightmap->width * (uint64_t)piece->rows * (head->channel_count + 1) * sizeof(float);
        if (bytes > front->row_bytes - at) {
            return damaged(part->path, "more rows than it holds", error);
        }
        at += bytes;
        tail += vshi_part_stats_bytes(lightmap->mesh_count, head->error_count);
    }
    return at == front->row_bytes && tail == (double)front->tail_bytes
               ? VSH_OK
               : damaged(part->path, "it has not the size that it tells", error);
}

static vsh_result read_all(FILE *file, const char *path, void *bytes, uint64_t size, vsh_error *error) {
    return size == 0 || fread(bytes, (size_t)size, 1, file) == 1
               ? VSH_OK
               : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path,
                           ferror(file) ? strerror(errno) : "it ends early");
}

/* Reads `size` bytes into memory of its own. */
static vsh_result take(FILE *file, const char *path, uint64_t size, const vsh_run *run, uint64_t *sum,
                       vshi_part_code *code, vsh_error *error) {
    *code = (vshi_part_code){.reads = true};
    if (size > MOST_HEAD) {
        return vshi_fail(error, VSH_ERROR_LIMIT, "%s: tells %" PRIu64 " bytes of itself, at most %d", path,
                         size, MOST_HEAD);
    }
    VSHI_TRY(vshi_check_limit(run, IN_MEMORY * (double)size, path, error));
    VSHI_TRY(vshi_allocate((void **)&code->bytes, (size_t)size + 1, 1, path, error));
    code->room = (size_t)size;
    const vsh_result result = read_all(file, path, code->bytes, size, error);
    *sum = result == VSH_OK ? vshi_part_sum(*sum, code->bytes, (size_t)size) : *sum;
    return result;
}

static vsh_result read_head(FILE *file, const vshi_part_front *front, const vsh_run *run, vshi_part *part,
                            uint64_t *sum, vsh_error *error) {
    vshi_part_code code;
    vsh_result result;
    VSHI_TRY_DONE(take(file, part->path, front->head_bytes, run, sum, &code, error));
    vshi_part_code_head(&code, &part->head);
    if (code.failed || code.room - code.size > 7) {
        result = damaged(part->path, "its head", error);
        goto done;
    }
    VSHI_TRY_DONE(vshi_allocate((void **)&part->offset, (size_t)part->head.piece_count + 1,
                                sizeof *part->offset, part->path, error));
    result = check_pieces(part, front, error);
done:
    free(code.bytes);
    return result;
}

static vsh_result read_tail(FILE *file, const vshi_part_front *front, const vsh_run *run, vshi_part *part,
                            uint64_t *sum, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    vshi_part_code code;
    vsh_result result;
    VSHI_TRY_DONE(take(file, part->path, front->tail_bytes, run, sum, &code, error));
    VSHI_TRY_DONE(vshi_allocate((void **)&part->pieces, (size_t)head->piece_count + 1, sizeof *part->pieces,
                                part->path, error));
    for (uint64_t i = 0; i < head->piece_count; ++i) {
        vsh_bake_stats *stats = &part->pieces[i];
        const uint64_t meshes = head->lightmaps[head->pieces[i].lightmap].mesh_count;
        *stats = vsh_bake_stats_zero();
        VSHI_TRY_DONE(vshi_allocate((void **)&stats->invalid_by_mesh, (size_t)meshes + 1, sizeof(uint64_t),
                                    part->path, error));
        VSHI_TRY_DONE(vshi_allocate((void **)&stats->errors, (size_t)head->error_count + 1,
                                    sizeof *stats->errors, part->path, error));
        vshi_part_code_stats(&code, stats, meshes, head->error_count);
    }
    result = code.failed ? damaged(part->path, "its statistics", error) : VSH_OK;
done:
    free(code.bytes);
    return result;
}

/* Over the rows: their sum, or to what is behind them. */
static vsh_result pass_rows(FILE *file, const char *path, uint64_t bytes, bool whole, const vsh_run *run,
                            uint64_t *sum, vsh_error *error) {
    if (!whole) {
        return fseeko(file, (off_t)bytes, SEEK_CUR) == 0
                   ? VSH_OK
                   : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", path, strerror(errno));
    }
    unsigned char *chunk = NULL;
    vshi_job *job = vshi_job_begin(run, "parts", (size_t)(bytes / CHUNK) + 1);
    vsh_result result = job != NULL
                            ? vshi_allocate((void **)&chunk, CHUNK, 1, path, error)
                            : vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    for (uint64_t left = bytes; left > 0 && result == VSH_OK;) {
        const size_t size = left < CHUNK ? (size_t)left : CHUNK;
        result = read_all(file, path, chunk, size, error);
        *sum = vshi_part_sum(*sum, chunk, result == VSH_OK ? size : 0);
        left -= size;
        if (result == VSH_OK && vshi_job_advance(job, 1)) {
            result = vshi_job_fail_cancelled(job, error);
        }
    }
    free(chunk);
    vshi_job_end(job);
    return result;
}

static vsh_result read_part(FILE *file, uint64_t size, bool whole, const vsh_run *run, vshi_part *part,
                            vsh_error *error) {
    vshi_part_front front;
    uint64_t sum = VSHI_PART_SUM, told = 0;
    memset(&front, 0, sizeof front);
    if (size < sizeof front + sizeof sum) {
        return fread(&front, 1, sizeof front.magic, file) == sizeof front.magic &&
                       memcmp(front.magic, VSHI_PART_MAGIC_BEGIN, strlen(VSHI_PART_MAGIC_BEGIN)) == 0
                   ? damaged(part->path, "it ends early", error)
                   : vshi_fail(error, VSH_ERROR_INPUT, "%s: is no part of a bake", part->path);
    }
    VSHI_TRY(read_all(file, part->path, &front, sizeof front, error));
    VSHI_TRY(check_front(part->path, &front, size, error));
    sum = vshi_part_sum(sum, &front, sizeof front);
    VSHI_TRY(read_head(file, &front, run, part, &sum, error));
    if (part->head.shard_count < 1 || part->head.shard < 1 || part->head.shard > part->head.shard_count) {
        return damaged(part->path, "its number", error);
    }
    VSHI_TRY(pass_rows(file, part->path, front.row_bytes, whole, run, &sum, error));
    VSHI_TRY(read_tail(file, &front, run, part, &sum, error));
    VSHI_TRY(read_all(file, part->path, &told, sizeof told, error));
    return !whole || told == sum ? VSH_OK : damaged(part->path, "its checksum does not match", error);
}

vsh_result vshi_part_open(const char *path, bool whole, const vsh_run *run, vshi_part *part,
                          vsh_error *error) {
    *part = (vshi_part){.path = strdup(path)};
    FILE *file = NULL;
    uint64_t size;
    if (part->path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    VSHI_TRY(vshi_input_open(path, path, UINT64_MAX / 2, &file, &size, error));
    const vsh_result result = read_part(file, size, whole, run, part, error);
    fclose(file);
    return result;
}

vsh_result vshi_part_read(const vshi_part *part, size_t piece, int32_t first, int32_t rows, size_t at,
                          float *const *planes, uint32_t *known, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    const size_t width = (size_t)head->lightmaps[head->pieces[piece].lightmap].width;
    const uint64_t row_bytes = (uint64_t)width * (head->channel_count + 1) * sizeof(float);
    const uint64_t begin = part->offset[piece] + (uint64_t)(first - head->pieces[piece].first) * row_bytes;
    FILE *file = NULL;
    uint64_t size;
    VSHI_TRY(vshi_input_open(part->path, part->path, UINT64_MAX / 2, &file, &size, error));
    vsh_result result =
        fseeko(file, (off_t)begin, SEEK_SET) == 0
            ? VSH_OK
            : vshi_fail(error, VSH_ERROR_READ, "%s: cannot be read: %s", part->path, strerror(errno));
    for (size_t row = 0; row < (size_t)rows && result == VSH_OK; ++row, at += width) {
        for (uint64_t c = 0; c < head->channel_count && result == VSH_OK; ++c) {
            result = read_all(file, part->path, planes[c] + at, width * sizeof(float), error);
        }
        result =
            result == VSH_OK ? read_all(file, part->path, known + at, width * sizeof *known, error) : result;
    }
    fclose(file);
    return result;
}
