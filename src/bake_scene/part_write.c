#include "bake_scene/part_head.h"
#include "base/try.h"

#include <stdlib.h>
#include <string.h>

struct vshi_part_writer {
    vshi_part_output file;
    int32_t channel_count;
    uint64_t error_count;
    uint64_t *meshes;  /* [piece_count]: of each piece's lightmap */
    vshi_ao_cut *cuts; /* [piece_count] */
    size_t done;       /* pieces */
    int32_t row;       /* of the piece that is under way, that comes next; -1: its first */
    vshi_part_code tail;
};

static vsh_result create(const char *path, const vshi_part_head *head, vshi_part_writer *writer,
                         vsh_error *error) {
    vshi_part_head same = *head; /* is only read where it is written */
    vshi_part_code code = {.reads = false};
    uint64_t rows = 0, tail = 0;
    writer->channel_count = (int32_t)head->channel_count;
    writer->error_count = head->error_count;
    writer->meshes = calloc((size_t)head->piece_count + 1, sizeof *writer->meshes);
    writer->cuts = calloc((size_t)head->piece_count + 1, sizeof *writer->cuts);
    writer->row = -1;
    if (writer->meshes == NULL || writer->cuts == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    for (uint64_t i = 0; i < head->piece_count; ++i) {
        const vshi_part_piece *piece = &head->pieces[i];
        const vshi_part_lightmap *lightmap = &head->lightmaps[piece->lightmap];
        rows += vshi_part_rows_bytes(head, piece, piece->first + piece->rows);
        tail += (uint64_t)vshi_part_stats_bytes(lightmap->mesh_count, head->error_count);
        writer->meshes[i] = lightmap->mesh_count;
        writer->cuts[i] = vshi_part_cut(head, piece);
    }
    vshi_part_about_code(&code, &same.about);
    vshi_part_code_head(&code, &same);
    return vshi_part_output_begin(&writer->file, path, &code, rows, tail, error);
}

static void release(vshi_part_writer *writer) {
    free(writer->tail.bytes);
    free(writer->cuts);
    free(writer->meshes);
    free(writer);
}

vsh_result vshi_part_writer_create(const char *path, const vshi_part_head *head, vshi_part_writer **writer,
                                   vsh_error *error) {
    *writer = NULL;
    vshi_part_writer *made = calloc(1, sizeof *made);
    if (made == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    const vsh_result result = create(path, head, made, error);
    if (result != VSH_OK) {
        release(made);
        return result;
    }
    *writer = made;
    return VSH_OK;
}

void vshi_part_writer_add(vshi_part_writer *writer, int32_t width, int32_t rows, const float *const *planes,
                          const uint32_t *known, const void *kept) {
    const size_t across = (size_t)width;
    const vshi_ao_cut *cut = &writer->cuts[writer->done];
    writer->row = writer->row < 0 ? cut->first : writer->row;
    const unsigned char *next = kept;
    const size_t kept_bytes = across * vshi_ao_kept_bytes(cut->kinds);
    for (size_t row = 0; row < (size_t)rows; ++row) {
        for (int32_t c = 0; c < writer->channel_count; ++c) {
            vshi_part_output_put(&writer->file, planes[c] + row * across, across * sizeof(float));
        }
        vshi_part_output_put(&writer->file, known + row * across, across * sizeof *known);
        const int32_t before = vshi_ao_cut_kept(cut, writer->row);
        if (vshi_ao_cut_kept(cut, ++writer->row) > before) {
            vshi_part_output_put(&writer->file, next, kept_bytes);
            next += kept_bytes;
        }
    }
}

vsh_result vshi_part_writer_piece(vshi_part_writer *writer, const vsh_bake_stats *stats, vsh_error *error) {
    vsh_bake_stats same = *stats;
    writer->row = -1;
    vshi_part_code_stats(&writer->tail, &same, writer->meshes[writer->done++], writer->error_count);
    return writer->tail.failed ? vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory",
                                           writer->file.output.target)
                               : VSH_OK;
}

vsh_result vshi_part_writer_finish(vshi_part_writer *writer, vsh_error *error) {
    vshi_part_output_put(&writer->file, writer->tail.bytes, writer->tail.size);
    const vsh_result result = vshi_part_output_finish(&writer->file, error);
    release(writer);
    return result;
}

void vshi_part_writer_abandon(vshi_part_writer *writer) {
    if (writer != NULL) {
        vshi_part_output_abandon(&writer->file);
        release(writer);
    }
}
