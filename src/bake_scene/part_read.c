#include "bake/part.h"
#include "bake/planes.h"
#include "bake_scene/part_head.h"
#include "base/memory.h"
#include "base/try.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

void vshi_part_head_free(vshi_part_head *head) {
    for (uint64_t i = 0; i < head->channel_count && head->channels != NULL; ++i) {
        free(head->channels[i]);
    }
    free(head->pieces);
    free(head->lightmaps);
    free(head->channels);
    vshi_part_about_free(&head->about);
    *head = (vshi_part_head){.channel_count = 0};
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

/* Whether pieces are rows of lightmaps, and as many as the file has room for; sets where each begins. */
static vsh_result check_pieces(vshi_part *part, const vshi_part_front *front, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    uint64_t at = 0;
    double tail = 0.0;
    if (head->channel_count > VSH_MAX_CHANNELS || head->channel_count == 0) {
        return vshi_part_damaged(part->path, "its channels", error);
    }
    if (head->kinds < 0 || head->kinds > VSHI_KEEPS_ALL) {
        return vshi_part_damaged(part->path, "what no bake keeps", error);
    }
    for (uint64_t i = 0; i < head->piece_count; ++i) {
        const vshi_part_piece *piece = &head->pieces[i];
        if (piece->lightmap >= head->lightmap_count) {
            return vshi_part_damaged(part->path, "rows of no lightmap", error);
        }
        const vshi_part_lightmap *lightmap = &head->lightmaps[piece->lightmap];
        if (lightmap->width < 1 || lightmap->width > VSH_MAX_LIGHTMAP_SIZE || lightmap->height < 1 ||
            lightmap->height > VSH_MAX_LIGHTMAP_SIZE || piece->first < 0 || piece->rows < 1 ||
            piece->first >= lightmap->height || piece->rows > lightmap->height - piece->first) {
            return vshi_part_damaged(part->path, "rows outside of their lightmap", error);
        }
        const int32_t left = lightmap->left;
        if ((left != 1 && left != 2 && left != 4 && left != 8) || piece->first % VSH_BAND_STEP != 0 ||
            (piece->rows % VSH_BAND_STEP != 0 && piece->rows != lightmap->height - piece->first)) {
            return vshi_part_damaged(part->path, "rows that no bake cuts", error);
        }
        part->offset[i] = sizeof *front + front->head_bytes + at;
        const uint64_t bytes = vshi_part_rows_bytes(head, piece, piece->first + piece->rows);
        if (bytes > front->body_bytes - at) {
            return vshi_part_damaged(part->path, "more rows than it holds", error);
        }
        at += bytes;
        tail += vshi_part_stats_bytes(lightmap->mesh_count, head->error_count);
    }
    return at == front->body_bytes && tail == (double)front->tail_bytes
               ? VSH_OK
               : vshi_part_damaged(part->path, "it has not the size that it tells", error);
}

static vsh_result read_stats(vshi_part *part, vshi_part_code *code, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    VSHI_TRY(vshi_allocate((void **)&part->pieces, (size_t)head->piece_count + 1, sizeof *part->pieces,
                           part->path, error));
    for (uint64_t i = 0; i < head->piece_count; ++i) {
        vsh_bake_stats *stats = &part->pieces[i];
        const uint64_t meshes = head->lightmaps[head->pieces[i].lightmap].mesh_count;
        *stats = vsh_bake_stats_zero();
        VSHI_TRY(vshi_allocate((void **)&stats->invalid_by_mesh, (size_t)meshes + 1, sizeof(uint64_t),
                               part->path, error));
        VSHI_TRY(vshi_allocate((void **)&stats->errors, (size_t)head->error_count + 1, sizeof *stats->errors,
                               part->path, error));
        vshi_part_code_stats(code, stats, meshes, head->error_count);
    }
    return code->failed ? vshi_part_damaged(part->path, "its statistics", error) : VSH_OK;
}

static vsh_result read_part(vshi_part_input *input, const vsh_run *run, vshi_part *part, vsh_error *error) {
    vshi_part_head *head = &part->head;
    vshi_part_code_head(&input->head, head);
    VSHI_TRY(vshi_part_input_end_head(input, error));
    VSHI_TRY(vshi_allocate((void **)&part->offset, (size_t)head->piece_count + 1, sizeof *part->offset,
                           part->path, error));
    VSHI_TRY(check_pieces(part, &input->front, error));
    VSHI_TRY(vshi_part_input_pass_body(input, true, run, error));
    vshi_part_code tail;
    vsh_result result;
    VSHI_TRY_DONE(vshi_part_input_tail(input, run, &tail, error));
    result = read_stats(part, &tail, error);
done:
    free(tail.bytes);
    return result == VSH_OK ? vshi_part_input_check_sum(input, error) : result;
}

vsh_result vshi_part_open(const char *path, const vsh_run *run, vshi_part *part, vsh_error *error) {
    *part = (vshi_part){.path = strdup(path)};
    if (part->path == NULL) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", path);
    }
    vshi_part_input input;
    vsh_result result = vshi_part_input_open(path, run, &input, &part->head.about, error);
    result = result == VSH_OK ? read_part(&input, run, part, error) : result;
    vshi_part_input_close(&input);
    return result;
}

/* Checks that a bake can produce the values of a row. */
static vsh_result check_values(const vshi_part *part, uint64_t lightmap, uint64_t channel, int32_t row,
                               size_t width, const float *values, vsh_error *error) {
    for (size_t i = 0; i < width; ++i) {
        float low, high;
        if (!vshi_channel_can_hold(part->head.channels[channel], values[i], &low, &high)) {
            return vshi_fail(error, VSH_ERROR_INPUT,
                             "%s: damaged: '%s' of texel (%zu, %d) of lightmap %" PRIu64
                             " is %g, out of range %g … %g; bake this part again",
                             part->path, part->head.channels[channel], i, row, lightmap, (double)values[i],
                             (double)low, (double)high);
        }
    }
    return VSH_OK;
}

vsh_result vshi_part_read(const vshi_part *part, size_t piece, int32_t first, int32_t rows, size_t at,
                          float *const *planes, uint32_t *known, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    const vshi_part_piece *of = &head->pieces[piece];
    const vshi_ao_cut cut = vshi_part_cut(head, of);
    const size_t width = (size_t)head->lightmaps[of->lightmap].width;
    FILE *file;
    VSHI_TRY(vshi_part_reopen(part->path, part->offset[piece] + vshi_part_rows_bytes(head, of, first), &file,
                              error));
    vsh_result result = VSH_OK;
    for (int32_t row = first; row < first + rows && result == VSH_OK; ++row, at += width) {
        for (uint64_t c = 0; c < head->channel_count && result == VSH_OK; ++c) {
            result = vshi_part_read_bytes(file, part->path, planes[c] + at, width * sizeof(float), error);
            result = result == VSH_OK ? check_values(part, of->lightmap, c, row, width, planes[c] + at, error)
                                      : result;
        }
        if (result == VSH_OK) {
            result = vshi_part_read_bytes(file, part->path, known + at, width * sizeof *known, error);
        }
        const bool kept = vshi_ao_cut_kept(&cut, row + 1) > vshi_ao_cut_kept(&cut, row);
        if (result == VSH_OK && kept) {
            result = vshi_part_skip(file, part->path, width * vshi_ao_kept_bytes(cut.kinds), error);
        }
    }
    fclose(file);
    return result;
}

/* The next row of a file, if it is kept. */
static vsh_result read_kept(const vshi_part *part, const vshi_ao_cut *cut, int32_t row, size_t width,
                            FILE *file, void *kept, vsh_error *error) {
    const size_t before = width * (part->head.channel_count + 1) * sizeof(float);
    VSHI_TRY(vshi_part_skip(file, part->path, before, error));
    return vshi_ao_cut_kept(cut, row + 1) > vshi_ao_cut_kept(cut, row)
               ? vshi_part_read_bytes(file, part->path, kept, width * vshi_ao_kept_bytes(cut->kinds), error)
               : VSH_OK;
}

vsh_result vshi_part_read_kept(const vshi_part *part, size_t piece, int32_t first, int32_t rows,
                               int32_t held_rays, void *kept, vsh_error *error) {
    const vshi_part_head *head = &part->head;
    const vshi_part_piece *of = &head->pieces[piece];
    const vshi_ao_cut cut = vshi_part_cut(head, of);
    const size_t width = (size_t)head->lightmaps[of->lightmap].width;
    FILE *file;
    VSHI_TRY(vshi_part_reopen(part->path, part->offset[piece] + vshi_part_rows_bytes(head, of, first), &file,
                              error));
    vsh_result result = VSH_OK;
    for (int32_t row = 0; row < rows && result == VSH_OK; ++row) {
        unsigned char *at = (unsigned char *)kept + (size_t)row * width * vshi_ao_kept_bytes(cut.kinds);
        const vshi_ao_kept texels = vshi_ao_kept_row(cut.kinds, width, at, 0);
        result = read_kept(part, &cut, first + row, width, file, at, error);
        if (result == VSH_OK && !vshi_ao_kept_is_sound(&texels, width, cut.spacing, held_rays)) {
            result = vshi_part_damaged(part->path, "its rays of AO", error);
        }
    }
    fclose(file);
    return result;
}
