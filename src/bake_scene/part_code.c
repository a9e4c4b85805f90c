#include "bake_scene/part_code.h"

#include <stdlib.h>
#include <string.h>

enum { STATS_WORDS = 15, ERROR_WORDS = 5 }; /* of 8 bytes */

static void code_bytes(vshi_part_code *code, void *value, size_t size) {
    if (code->failed || size == 0) {
        return;
    }
    if (code->reads) {
        if (size > code->room - code->size) {
            code->failed = true;
            return;
        }
        memcpy(value, code->bytes + code->size, size);
        code->size += size;
        return;
    }
    if (size > code->room - code->size) {
        const size_t room = 2 * (code->size + size) + 4096;
        unsigned char *larger = realloc(code->bytes, room);
        if (larger == NULL) {
            code->failed = true;
            return;
        }
        code->bytes = larger;
        code->room = room;
    }
    memcpy(code->bytes + code->size, value, size);
    code->size += size;
}

static void code_u64(vshi_part_code *code, uint64_t *value) {
    code_bytes(code, value, sizeof *value);
}

static void code_f64(vshi_part_code *code, double *value) {
    code_bytes(code, value, sizeof *value);
}

static void code_i32(vshi_part_code *code, int32_t *value) {
    code_bytes(code, value, sizeof *value);
}

/* The number of elements that follow, each of `least` bytes in the file and `size` in memory, and where they
 * are read their memory. */
static void code_count(vshi_part_code *code, uint64_t *count, size_t least, void **list, size_t size) {
    code_u64(code, count);
    if (!code->reads) {
        return;
    }
    *list = NULL;
    if (code->failed || *count > (code->room - code->size) / least) {
        code->failed = true;
        *count = 0;
        return;
    }
    *list = calloc((size_t)*count + 1, size);
    if (*list == NULL) {
        code->failed = true;
        *count = 0;
    }
}

/* With its NUL, which no other is before. */
static void code_text(vshi_part_code *code, char **text) {
    uint64_t size = code->reads ? 0 : strlen(*text) + 1;
    if (code->reads) {
        *text = NULL;
    }
    code_count(code, &size, 1, (void **)text, 1);
    if (!code->failed) {
        code_bytes(code, *text, (size_t)size);
    }
    if (code->reads && !code->failed && strlen(*text) + 1 != size) { /* calloc() put a NUL behind all */
        code->failed = true;
    }
}

static void code_texts(vshi_part_code *code, char ***texts, uint64_t *count) {
    code_count(code, count, sizeof(uint64_t), (void **)texts, sizeof **texts);
    for (uint64_t i = 0; i < *count && !code->failed; ++i) {
        code_text(code, &(*texts)[i]);
    }
}

void vshi_part_code_head(vshi_part_code *code, vshi_part_head *head) {
    code_text(code, &head->version);
    code_i32(code, &head->shard);
    code_i32(code, &head->shard_count);
    code_texts(code, &head->words, &head->word_count);
    code_count(code, &head->attribute_count, 2 * sizeof(uint64_t), (void **)&head->attributes,
               sizeof *head->attributes);
    for (uint64_t i = 0; i < head->attribute_count && !code->failed; ++i) {
        code_text(code, &head->attributes[i].name);
        code_text(code, &head->attributes[i].value);
    }
    code_texts(code, &head->channels, &head->channel_count);
    code_u64(code, &head->error_count);
    code_f64(code, &head->voxel_size);
    code_u64(code, &head->active_voxels);
    code_u64(code, &head->field_bytes);
    code_i32(code, &head->levels);
    code_i32(code, &head->has_triangles);
    code_count(code, &head->lightmap_count, sizeof(uint64_t), (void **)&head->lightmaps,
               sizeof *head->lightmaps);
    for (uint64_t i = 0; i < head->lightmap_count && !code->failed; ++i) {
        vshi_part_lightmap *lightmap = &head->lightmaps[i];
        code_i32(code, &lightmap->width);
        code_i32(code, &lightmap->height);
        code_u64(code, &lightmap->mesh_count);
        code_u64(code, &lightmap->covered);
        code_u64(code, &lightmap->samples);
    }
    code_count(code, &head->piece_count, sizeof(uint64_t), (void **)&head->pieces, sizeof *head->pieces);
    for (uint64_t i = 0; i < head->piece_count && !code->failed; ++i) {
        code_u64(code, &head->pieces[i].lightmap);
        code_i32(code, &head->pieces[i].first);
        code_i32(code, &head->pieces[i].rows);
    }
}

double vshi_part_stats_bytes(uint64_t mesh_count, uint64_t error_count) {
    return 8.0 * (STATS_WORDS + (double)mesh_count + ERROR_WORDS * (double)error_count);
}

void vshi_part_code_stats(vshi_part_code *code, vsh_bake_stats *stats, uint64_t mesh_count,
                          uint64_t error_count) {
    vsh_shade_stats *shade = &stats->shade;
    code_u64(code, &stats->texels);
    code_u64(code, &stats->invalid_texels);
    code_u64(code, &stats->seen_texels);
    uint64_t *const counts[] = {&shade->marches,      &shade->samples,    &shade->skipped,
                                &shade->certified,    &shade->unfinished, &shade->invalid,
                                &shade->beyond_reach, &shade->rays,       &shade->refined};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; ++i) {
        code_u64(code, counts[i]);
    }
    code_f64(code, &shade->square_error);
    code_f64(code, &shade->ao_square_error);
    code_f64(code, &shade->worst_error);
    for (uint64_t m = 0; m < mesh_count && !code->failed; ++m) {
        code_u64(code, &stats->invalid_by_mesh[m]);
    }
    for (uint64_t i = 0; i < error_count && !code->failed; ++i) {
        vsh_bake_error *e = &stats->errors[i];
        code_f64(code, &e->values);
        code_f64(code, &e->square_error);
        code_f64(code, &e->held);
        code_f64(code, &e->held_square_error);
        code_f64(code, &e->worst);
    }
}
