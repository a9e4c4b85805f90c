/* Files of fields, for their tests. */
#ifndef TESTS_KEPT_FIELDS_H
#define TESTS_KEPT_FIELDS_H

#include "fields.h"

#include "field/stored.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static inline size_t field_head_bytes(const char *bytes) {
    return (size_t)((const vshi_stored_head *)(const void *)bytes)->head_bytes;
}

/* All bytes of a file; to be freed. */
static inline char *read_field_bytes(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    *size = (size_t)ftell(file);
    rewind(file);
    char *bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static inline void write_field_bytes(const char *path, const char *bytes, size_t size) {
    remove(path); /* file systems flush what is cut and written again */
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

/* Makes the sums those of what is there, as who forges a file does. Where the head's own counts reach beyond
 * the file its sum alone. */
static inline void forge_sums(char *bytes, size_t size) {
    vshi_stored_head *head = (vshi_stored_head *)(void *)bytes;
    const uint64_t needs =
        sizeof *head + (uint64_t)head->field_count * sizeof(vshi_stored_field) + head->text_bytes;
    const uint64_t sums_at = vshi_stored_align(needs, 8);
    const uint64_t head_bytes = head->head_bytes;
    if (head_bytes > size || head_bytes < sizeof *head) {
        return;
    }
    for (uint64_t i = 0; i < head->chunk_count && head->text_bytes < size; ++i) {
        const uint64_t at = head_bytes + i * VSHI_STORED_CHUNK;
        if (at >= size || sums_at + 8 * (i + 1) > head_bytes) {
            break;
        }
        const uint64_t left = size - at;
        const uint64_t sum = vshi_stored_sum(bytes + at, left < VSHI_STORED_CHUNK ? left : VSHI_STORED_CHUNK);
        memcpy(bytes + sums_at + 8 * i, &sum, sizeof sum);
    }
    head->sum = 0;
    head->sum = vshi_stored_sum(bytes, (size_t)head_bytes);
}

/* A ball and a box that stand apart. */
static inline vsh_grid *kept_grid(double voxel) {
    static const truth_solid solids[] = {
        {.shape = TRUTH_SPHERE, .center = {-0.6, 0.3, 0.0}, .radius = 0.5},
        {.shape = TRUTH_BOX, .center = {0.7, 0.0, 0.2}, .half = {0.3, 0.4, 0.2}, .radius = 0.05}};
    return grid_of((truth_scene){solids, 2}, voxel);
}

#endif
