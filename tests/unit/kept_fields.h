/* Files of fields, for their tests. */
#ifndef TESTS_KEPT_FIELDS_H
#define TESTS_KEPT_FIELDS_H

#include "fields.h"

#include "field/stored.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>
#include <vdbshade/vdbshade.h>

static vsh_error why; /* of the last call that failed */

static const double VOXEL = 0.05; /* of files that are written */

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

static inline vsh_voxels *band_of(const vsh_grid *grid) {
    vsh_voxels *band = NULL;
    assert_int_equal(vsh_voxels_from_grid(grid, 0.0, NULL, &band, &why), VSH_OK);
    return band;
}

/* Of all the levels that there can be. */
static inline void write_kept_file(const char *path, double reach) {
    vsh_kept_field kept = vsh_kept_field_default();
    const vsh_attribute origin = {"voxels", "some"}, told = {"vdbshade_version", vsh_version()};
    vsh_grid *grid = kept_grid(VOXEL);
    vsh_voxels *band = band_of(grid);
    vsh_field *field = field_of_grid(grid, reach);
    kept.name = "casters";
    kept.field = field;
    kept.band = band;
    kept.origin = &origin;
    kept.origin_count = 1;
    kept.grid_bytes = 12345;
    if (vsh_field_file_write(path, &kept, 1, &told, 1, NULL, &why) != VSH_OK) {
        fail_msg("%s", why.message);
    }
    vsh_voxels_free(band);
    vsh_field_free(field);
}

static inline vsh_field_file *open_kept_file(const char *path) {
    vsh_field_file *file = NULL;
    if (vsh_field_file_open(path, NULL, &file, &why) != VSH_OK) {
        fail_msg("%s", why.message);
    }
    return file;
}

static inline vsh_run one_thread(void) { /* thousands of small files are opened */
    vsh_run run = vsh_run_default();
    run.threads = 1;
    return run;
}

#endif
