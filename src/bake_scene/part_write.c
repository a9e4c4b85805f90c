#include "bake_scene/part_code.h"
#include "bake_scene/part_layout.h"
#include "base/file.h"
#include "base/try.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

struct vshi_part_writer {
    vshi_output output;
    FILE *file;
    uint64_t sum;
    int32_t channel_count;
    uint64_t error_count;
    vshi_part_piece *pieces;       /* [piece_count] */
    vshi_part_lightmap *lightmaps; /* [lightmap_count] */
    size_t piece_count, done;
    vshi_part_code tail;
    int error; /* errno of the first write that failed; 0: none */
};

char *vshi_part_path(const char *parts, int32_t shard, int32_t count) {
    static const char *const form = "%s.%d-of-%d.part";
    const int length = snprintf(NULL, 0, form, parts, shard, count);
    char *path = length > 0 ? malloc((size_t)length + 1) : NULL;
    if (path != NULL) {
        snprintf(path, (size_t)length + 1, form, parts, shard, count);
    }
    return path;
}

static void put(vshi_part_writer *writer, const void *bytes, size_t size) {
    writer->sum = vshi_part_sum(writer->sum, bytes, size);
    if (size > 0 && fwrite(bytes, size, 1, writer->file) != 1 && writer->error == 0) {
        writer->error = errno != 0 ? errno : EIO;
    }
}

static void *copy_of(const void *list, size_t bytes) {
    void *copy = malloc(bytes + 1);
    return copy != NULL && bytes > 0 ? memcpy(copy, list, bytes) : copy;
}

/* Sizes of what comes behind the head. */
static void measure(const vshi_part_head *head, vshi_part_front *front) {
    for (uint64_t i = 0; i < head->piece_count; ++i) {
        const vshi_part_piece *piece = &head->pieces[i];
        const vshi_part_lightmap *lightmap = &head->lightmaps[piece->lightmap];
        front->row_bytes += (uint64_t)lightmap->width * (uint64_t)piece->rows * (head->channel_count + 1) * 4;
        front->tail_bytes += (uint64_t)vshi_part_stats_bytes(lightmap->mesh_count, head->error_count);
    }
}

static vsh_result write_head(vshi_part_writer *writer, const vshi_part_head *head, vsh_error *error) {
    vshi_part_head same = *head; /* is only read from where it is written */
    vshi_part_code code = {.reads = false};
    static char zeros[8];
    vshi_part_front front = {.magic = VSHI_PART_MAGIC, .order = VSHI_PART_ORDER};
    vshi_part_code_head(&code, &same);
    if (code.failed) {
        free(code.bytes);
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", writer->output.target);
    }
    const size_t more = (8 - code.size % 8) % 8;
    front.head_bytes = code.size + more;
    measure(head, &front);
    put(writer, &front, sizeof front);
    /* as one, for the sum's words */
    unsigned char *bytes = realloc(code.bytes, code.size + more);
    if (bytes == NULL) {
        free(code.bytes);
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", writer->output.target);
    }
    memcpy(bytes + code.size, zeros, more);
    put(writer, bytes, code.size + more);
    free(bytes);
    return VSH_OK;
}

static vsh_result create(const char *path, const vshi_part_head *head, vshi_part_writer *writer,
                         vsh_error *error) {
    VSHI_TRY(vshi_output_begin(&writer->output, path, error));
    writer->file = fopen(writer->output.temporary, "wb");
    if (writer->file == NULL) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: cannot be written: %s", path, strerror(errno));
    }
    writer->channel_count = (int32_t)head->channel_count;
    writer->error_count = head->error_count;
    writer->piece_count = (size_t)head->piece_count;
    writer->pieces = copy_of(head->pieces, writer->piece_count * sizeof *head->pieces);
    writer->lightmaps = copy_of(head->lightmaps, (size_t)head->lightmap_count * sizeof *head->lightmaps);
    if (writer->pieces == NULL || writer->lightmaps == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    return write_head(writer, head, error);
}

vsh_result vshi_part_writer_create(const char *path, const vshi_part_head *head, vshi_part_writer **writer,
                                   vsh_error *error) {
    *writer = NULL;
    vshi_part_writer *made = calloc(1, sizeof *made);
    if (made == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    made->sum = VSHI_PART_SUM;
    const vsh_result result = create(path, head, made, error);
    if (result != VSH_OK) {
        vshi_part_writer_abandon(made);
        return result;
    }
    *writer = made;
    return VSH_OK;
}

void vshi_part_writer_add(vshi_part_writer *writer, int32_t width, int32_t rows, const float *const *planes,
                          const uint32_t *known) {
    const size_t across = (size_t)width;
    for (size_t row = 0; row < (size_t)rows; ++row) {
        for (int32_t c = 0; c < writer->channel_count; ++c) {
            put(writer, planes[c] + row * across, across * sizeof(float));
        }
        put(writer, known + row * across, across * sizeof *known);
    }
}

vsh_result vshi_part_writer_piece(vshi_part_writer *writer, const vsh_bake_stats *stats, vsh_error *error) {
    vsh_bake_stats same = *stats;
    const vshi_part_piece *piece = &writer->pieces[writer->done++];
    vshi_part_code_stats(&writer->tail, &same, writer->lightmaps[piece->lightmap].mesh_count,
                         writer->error_count);
    return writer->tail.failed
               ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", writer->output.target)
               : VSH_OK;
}

static void release(vshi_part_writer *writer) {
    if (writer->file != NULL) {
        fclose(writer->file);
    }
    free(writer->tail.bytes);
    free(writer->lightmaps);
    free(writer->pieces);
    free(writer);
}

vsh_result vshi_part_writer_finish(vshi_part_writer *writer, vsh_error *error) {
    put(writer, writer->tail.bytes, writer->tail.size);
    const uint64_t sum = writer->sum;
    put(writer, &sum, sizeof sum);
    const bool closed = fclose(writer->file) == 0;
    writer->file = NULL;
    if (!closed && writer->error == 0) {
        writer->error = errno;
    }
    vsh_result result;
    if (writer->error != 0) {
        result = vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", writer->output.target,
                           strerror(writer->error));
        vshi_output_abandon(&writer->output);
    } else {
        result = vshi_output_commit(&writer->output, error);
    }
    release(writer);
    return result;
}

void vshi_part_writer_abandon(vshi_part_writer *writer) {
    if (writer != NULL) {
        vshi_output_abandon(&writer->output);
        release(writer);
    }
}
