#include "bake_scene/part_head.h"

enum { STATS_WORDS = 14, ERROR_WORDS = 5 }; /* of 8 bytes */

void vshi_part_code_head(vshi_part_code *code, vshi_part_head *head) {
    vshi_part_code_texts(code, &head->channels, &head->channel_count);
    vshi_part_code_u64(code, &head->error_count);
    vshi_part_code_f64(code, &head->voxel_size);
    vshi_part_code_u64(code, &head->active_voxels);
    vshi_part_code_u64(code, &head->field_bytes);
    vshi_part_code_i32(code, &head->levels);
    vshi_part_code_i32(code, &head->has_triangles);
    vshi_part_code_i32(code, &head->kinds);
    vshi_part_code_count(code, &head->lightmap_count, sizeof(uint64_t), (void **)&head->lightmaps,
                         sizeof *head->lightmaps);
    for (uint64_t i = 0; i < head->lightmap_count && !code->failed; ++i) {
        vshi_part_lightmap *lightmap = &head->lightmaps[i];
        vshi_part_code_i32(code, &lightmap->width);
        vshi_part_code_i32(code, &lightmap->height);
        vshi_part_code_u64(code, &lightmap->mesh_count);
        vshi_part_code_u64(code, &lightmap->covered);
        vshi_part_code_u64(code, &lightmap->samples);
        vshi_part_code_i32(code, &lightmap->left);
    }
    vshi_part_code_count(code, &head->piece_count, sizeof(uint64_t), (void **)&head->pieces,
                         sizeof *head->pieces);
    for (uint64_t i = 0; i < head->piece_count && !code->failed; ++i) {
        vshi_part_code_u64(code, &head->pieces[i].lightmap);
        vshi_part_code_i32(code, &head->pieces[i].first);
        vshi_part_code_i32(code, &head->pieces[i].rows);
    }
}

vshi_ao_cut vshi_part_cut(const vshi_part_head *head, const vshi_part_piece *piece) {
    const vshi_part_lightmap *lightmap = &head->lightmaps[piece->lightmap];
    return (vshi_ao_cut){.spacing = lightmap->left,
                         .height = lightmap->height,
                         .first = piece->first,
                         .end = piece->first + piece->rows,
                         .kinds = (uint32_t)head->kinds};
}

/* At most 2^32 × (257 × 4 + 104). */
uint64_t vshi_part_rows_bytes(const vshi_part_head *head, const vshi_part_piece *piece, int32_t row) {
    const vshi_ao_cut cut = vshi_part_cut(head, piece);
    const uint64_t width = (uint64_t)head->lightmaps[piece->lightmap].width;
    return width * ((uint64_t)(row - piece->first) * (head->channel_count + 1) * sizeof(float) +
                    (uint64_t)vshi_ao_cut_kept(&cut, row) * vshi_ao_kept_bytes(cut.kinds));
}

double vshi_part_stats_bytes(uint64_t mesh_count, uint64_t error_count) {
    return 8.0 * (STATS_WORDS + (double)mesh_count + ERROR_WORDS * (double)error_count);
}

void vshi_part_code_stats(vshi_part_code *code, vsh_bake_stats *stats, uint64_t mesh_count,
                          uint64_t error_count) {
    vsh_shade_stats *shade = &stats->shade;
    vshi_part_code_u64(code, &stats->texels);
    vshi_part_code_u64(code, &stats->invalid_texels);
    uint64_t *const counts[] = {&shade->marches,      &shade->samples,    &shade->skipped,
                                &shade->certified,    &shade->unfinished, &shade->invalid,
                                &shade->beyond_reach, &shade->rays,       &shade->refined};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; ++i) {
        vshi_part_code_u64(code, counts[i]);
    }
    vshi_part_code_f64(code, &shade->square_error);
    vshi_part_code_f64(code, &shade->ao_square_error);
    vshi_part_code_f64(code, &shade->worst_error);
    for (uint64_t m = 0; m < mesh_count && !code->failed; ++m) {
        vshi_part_code_u64(code, &stats->invalid_by_mesh[m]);
    }
    for (uint64_t i = 0; i < error_count && !code->failed; ++i) {
        vsh_bake_error *e = &stats->errors[i];
        vshi_part_code_f64(code, &e->values);
        vshi_part_code_f64(code, &e->square_error);
        vshi_part_code_f64(code, &e->held);
        vshi_part_code_f64(code, &e->held_square_error);
        vshi_part_code_f64(code, &e->worst);
    }
}
