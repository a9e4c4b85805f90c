/* The bands of level sets that files of fields keep: the same voxels, or a refusal. */
#include "kept_fields.h"

static const char path[] = "test_field_band.field";

static int remove_file(void **state) {
    (void)state;
    remove(path);
    return 0;
}

static void assert_same_voxels(const vsh_voxels *a, const vsh_voxels *b) {
    size_t count, same;
    vsh_voxels_info one, other;
    memset(&one, 0, sizeof one);
    memset(&other, 0, sizeof other);
    vsh_voxels_get_info(a, &one);
    vsh_voxels_get_info(b, &other);
    assert_memory_equal(&one, &other, sizeof one);
    const vshi_block *blocks = vshi_voxels_blocks(a, &count), *others = vshi_voxels_blocks(b, &same);
    assert_int_equal(count, same);
    for (size_t i = 0; i < count; ++i) {
        assert_memory_equal(blocks[i].origin, others[i].origin, sizeof blocks->origin);
        assert_memory_equal(blocks[i].mask, others[i].mask, sizeof blocks->mask);
    }
    vshi_map map, its;
    assert_int_equal(vshi_voxels_map(a, &map, &why), VSH_OK);
    assert_int_equal(vshi_voxels_map(b, &its, &why), VSH_OK);
    assert_memory_equal(&map, &its, sizeof map);
}

static void the_band_of_a_file_is_that_of_the_level_set(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    vsh_field_file *file = open_kept_file(path);
    vsh_grid *grid = kept_grid(VOXEL);
    vsh_voxels *of_grid = band_of(grid), *band = NULL;
    static const double whole[] = {0.0, 3.0, 3.0000000001};
    for (size_t i = 0; i < sizeof whole / sizeof whole[0]; ++i) {
        assert_int_equal(vsh_field_file_band(file, 0, whole[i], NULL, &band, &why), VSH_OK);
        assert_same_voxels(band, of_grid);
        vsh_voxels_free(band);
    }
    static const double none[] = {-1.0, 3.1, NAN, INFINITY};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; ++i) {
        assert_int_equal(vsh_field_file_band(file, 0, none[i], NULL, &band, &why), VSH_ERROR_ARGUMENT);
        assert_null(band);
    }
    assert_int_equal(vsh_field_file_band(file, 0, 2.5, NULL, &band, &why), VSH_ERROR_INPUT);
    assert_non_null(strstr(why.message, "band of 3 voxels as a whole, and none of 2.5"));
    assert_int_equal(vsh_field_file_band(file, 1, 0.0, NULL, &band, &why), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_field_file_band(NULL, 0, 0.0, NULL, &band, &why), VSH_ERROR_ARGUMENT);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000;
    assert_int_equal(vsh_field_file_band(file, 0, 0.0, &run, &band, &why), VSH_ERROR_LIMIT);
    vsh_field_file_close(file);
    vsh_voxels_free(of_grid);
    vsh_grid_free(grid);
}

static void a_band_that_is_not_kept_is_told_and_one_of_other_casters_refused(void **state) {
    (void)state;
    double low[3], high[3]; /* on the lattice of the level set, but no band */
    vsh_kept_field kept = vsh_kept_field_default();
    vsh_grid *other = kept_grid(0.9 * VOXEL), *grid = kept_grid(VOXEL);
    vsh_grid_info info;
    vsh_grid_get_info(grid, &info);
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = info.transform[4 * axis + 3] - 0.5 * VOXEL;
        high[axis] = low[axis] + 4.0 * VOXEL;
    }
    vsh_field *field = field_of_grid(grid, 0.3);
    vsh_voxels *box, *finer = band_of(other), *band = NULL;
    assert_int_equal(vsh_voxels_from_box(low, high, VOXEL, NULL, &box, &why), VSH_OK);
    const vsh_voxels *const bands[] = {box, finer};
    kept.field = field;
    for (size_t i = 0; i < 2; ++i) {
        kept.band = bands[i];
        assert_int_equal(vsh_field_file_write(path, &kept, 1, NULL, 0, NULL, &why), VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(why.message, "fields[0]: its band is none of the level set"));
    }
    kept.band = NULL;
    assert_int_equal(vsh_field_file_write(path, &kept, 1, NULL, 0, NULL, &why), VSH_OK);
    vsh_field_file *file = open_kept_file(path);
    vsh_field_file_get(file, 0, &kept);
    assert_int_equal(kept.band_bytes, 0);
    assert_int_equal(vsh_field_file_band(file, 0, 0.0, NULL, &band, &why), VSH_ERROR_INPUT);
    assert_non_null(strstr(why.message, "was not kept"));
    vsh_field_file_close(file);
    vsh_voxels_free(finer);
    vsh_voxels_free(box);
    vsh_field_free(field);
    vsh_grid_free(other);
}

/* --- what is forged, with sums made anew */

/* What comes of the band of a file of these bytes, which opens. */
static vsh_result take_forged(char *bytes, size_t size) {
    const vsh_run run = one_thread();
    vsh_field_file *file = NULL;
    vsh_voxels *band = NULL;
    forge_sums(bytes, size);
    write_field_bytes(path, bytes, size);
    assert_int_equal(vsh_field_file_open(path, &run, &file, &why), VSH_OK);
    const vsh_result result = vsh_field_file_band(file, 0, 0.0, &run, &band, &why);
    assert_true((result == VSH_OK) == (band != NULL));
    assert_true(result == VSH_OK ||
                (strstr(why.message, "damaged: field 0: ") != NULL && strchr(why.message, '\n') == NULL));
    vsh_voxels_free(band);
    vsh_field_file_close(file);
    return result;
}

static void a_forged_band_is_refused(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size;
    char *bytes = read_field_bytes(path, &size), *forged = malloc(size);
    const size_t record_at = sizeof(vshi_stored_head);
    const vshi_stored_band band = ((const vshi_stored_field *)(const void *)(bytes + record_at))->band;
    const vshi_stored_level level = ((const vshi_stored_field *)(const void *)(bytes + record_at))->levels[0];
    assert_int_equal(take_forged(bytes, size), VSH_OK);
    uint32_t numbers[2];
    memcpy(numbers, bytes + band.blocks_at, sizeof numbers);
    const uint32_t blocks = (uint32_t)(level.size[0] * level.size[1] * level.size[2]);
    const uint32_t wrong[][2] = {{numbers[1], numbers[0]}, {numbers[0], numbers[0]}, {numbers[0], blocks},
                                 {UINT32_MAX, numbers[1]}, {blocks, UINT32_MAX},     {0x80000000u, 1}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        memcpy(forged, bytes, size);
        memcpy(forged + band.blocks_at, wrong[i], sizeof wrong[i]);
        assert_int_equal(take_forged(forged, size), VSH_ERROR_READ);
        assert_non_null(strstr(why.message, "a block of its band is none"));
    }
    memcpy(forged, bytes, size);
    memset(forged + band.masks_at, 0, VSHI_MASK_WORDS * sizeof(uint64_t));
    assert_int_equal(take_forged(forged, size), VSH_ERROR_READ);
    free(forged);
    free(bytes);
}

/* Of every kind of map that there is, with all kinds of numbers. */
static void a_forged_map_is_refused(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size;
    char *bytes = read_field_bytes(path, &size), *forged = malloc(size);
    vshi_stored_field *record = (vshi_stored_field *)(void *)(forged + sizeof(vshi_stored_head));
    static const char *const names[] = {"AffineMap",
                                        "UnitaryMap",
                                        "ScaleMap",
                                        "UniformScaleMap",
                                        "TranslationMap",
                                        "ScaleTranslateMap",
                                        "UniformScaleTranslateMap",
                                        "NonlinearFrustumMap",
                                        "NoMap"};
    static const double numbers[] = {0.0, 1.0, VOXEL, -VOXEL, 1e-300, 1e300, 3e-9};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        for (size_t k = 0; k < sizeof numbers / sizeof numbers[0]; ++k) {
            for (uint64_t count = 0; count <= VSHI_MAP_NUMBERS; ++count) {
                memcpy(forged, bytes, size);
                vshi_map *map = &record->band.map;
                memset(map, 0, sizeof *map);
                strcpy(map->name, names[i]);
                map->count = count;
                for (size_t n = 0; n < count; ++n) {
                    map->numbers[n] = numbers[k];
                }
                assert_int_equal(take_forged(forged, size), VSH_ERROR_READ);
            }
        }
    }
    memcpy(forged, bytes, size);
    record->band.map.numbers[0] = NAN;
    forge_sums(forged, size);
    vsh_field_file *file = NULL;
    write_field_bytes(path, forged, size);
    assert_int_equal(vsh_field_file_open(path, NULL, &file, &why), VSH_ERROR_READ);
    assert_non_null(strstr(why.message, "the map of its band is none"));
    free(forged);
    free(bytes);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(the_band_of_a_file_is_that_of_the_level_set, remove_file),
        cmocka_unit_test_teardown(a_band_that_is_not_kept_is_told_and_one_of_other_casters_refused,
                                  remove_file),
        cmocka_unit_test_teardown(a_forged_band_is_refused, remove_file),
        cmocka_unit_test_teardown(a_forged_map_is_refused, remove_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
