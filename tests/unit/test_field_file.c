/* Fields in files: the same bits as fields that are made, and nothing but that. */
#include "kept_fields.h"
#include "shading.h"

#include <vdbshade/vdbshade.h>

static const char path[] = "test_field_file.field";

static int remove_file(void **state) {
    (void)state;
    remove(path);
    return 0;
}

/* Values in the band, far away, and as they are lit. */
static void assert_same_bits(const vsh_field *a, const vsh_field *b) {
    enum { POINTS = 400 };
    static double at[3 * POINTS];
    static float normals[3 * POINTS], one[POINTS], other[POINTS];
    uint64_t counter = 3;
    for (int i = 0; i < POINTS; ++i) {
        const double far = i % 4 == 0 ? 40.0 : 1.5;
        double normal[3];
        random_direction(&counter, normal);
        for (int axis = 0; axis < 3; ++axis) {
            at[3 * i + axis] = between(&counter, -far, far);
            normals[3 * i + axis] = (float)normal[axis];
        }
    }
    vsh_field_sample(a, POINTS, at, one);
    vsh_field_sample(b, POINTS, at, other);
    assert_memory_equal(one, other, sizeof one);
    static const double up[3] = {0.3, 0.9, 0.1};
    const vsh_light light = sun(up, RADIANS(8.0));
    for (int32_t method = VSH_SHADOW_HARD; vsh_shadow_method_name(method) != NULL; ++method) {
        const uint32_t traits = vsh_shadow_method_traits(method);
        if (method != VSH_SHADOW_AUTO && (traits & VSH_METHOD_TRIANGLES) == 0) {
            shadows(a, &light, method, POINTS, at, normals, one);
            shadows(b, &light, method, POINTS, at, normals, other);
            assert_memory_equal(one, other, sizeof one);
        }
    }
}

static void a_field_of_a_file_has_the_bits_of_one_that_is_made(void **state) {
    (void)state;
    write_kept_file(path, 1e30);
    vsh_field_file *file = open_kept_file(path);
    static const double reaches[] = {0.0, 0.01, 0.3, 2.0, 100.0, 1e20};
    for (size_t i = 0; i < sizeof reaches / sizeof reaches[0]; ++i) {
        for (int32_t surface = 0; surface < 2; ++surface) {
            vsh_field_options options = vsh_field_options_default();
            options.reach = reaches[i];
            options.surface = surface;
            vsh_field *made = NULL, *kept = NULL;
            vsh_grid *grid = kept_grid(VOXEL);
            assert_int_equal(vsh_field_create(grid, &options, NULL, &made, &why), VSH_OK);
            assert_int_equal(vsh_field_file_field(file, 0, &options, NULL, &kept, &why), VSH_OK);
            vsh_grid_free(grid);
            vsh_field_info a, b;
            memset(&a, 0, sizeof a);
            memset(&b, 0, sizeof b);
            vsh_field_get_info(made, &a);
            vsh_field_get_info(kept, &b);
            if (surface != 0) {
                b.bytes = a.bytes; /* Embree's tree is not the same for each run */
            }
            assert_memory_equal(&a, &b, sizeof a);
            assert_true(surface == 0 || !vsh_triangles_available() || kept->surface != NULL);
            assert_same_bits(made, kept);
            vsh_field_free(kept);
            vsh_field_free(made);
        }
    }
    vsh_field_file_close(file);
}

static size_t size_of(const char *of) {
    size_t size;
    free(read_field_bytes(of, &size));
    return size;
}

static void a_file_tells_what_was_written(void **state) {
    (void)state;
    write_kept_file(path, 1e30);
    vsh_field_file *file = open_kept_file(path);
    assert_string_equal(vsh_field_file_path(file), path);
    assert_int_equal(vsh_field_file_count(file), 1);
    assert_int_equal(vsh_field_file_is(path), 1);
    assert_int_equal(vsh_field_file_is(VSH_ASSETS "/cloister.glb"), 0);
    assert_int_equal(vsh_field_file_is("nowhere.field"), 0);
    size_t count, size;
    const vsh_attribute *attributes = vsh_field_file_attributes(file, &count);
    assert_int_equal(count, 1);
    assert_string_equal(attributes[0].name, "vdbshade_version");
    assert_string_equal(attributes[0].value, vsh_version());
    vsh_kept_field kept;
    vsh_field_file_get(file, 0, &kept);
    assert_string_equal(kept.name, "casters");
    assert_int_equal(kept.origin_count, 1);
    assert_string_equal(kept.origin[0].value, "some");
    assert_int_equal(kept.grid_bytes, 12345);
    assert_true(kept.half_width == 3.0);
    assert_null(kept.band);
    assert_true(kept.band_bytes > 0 && kept.band_bytes < size_of(path) / 10);
    char *bytes = read_field_bytes(path, &size), *again;
    assert_int_equal(size, vsh_field_file_bytes(file));
    vsh_field_file_close(file);
    write_kept_file(path, 1e30);
    again = read_field_bytes(path, &size);
    assert_memory_equal(bytes, again, size); /* the same fields, the same bytes */
    free(again);
    free(bytes);
}

static void a_reach_beyond_what_is_kept_is_refused(void **state) {
    (void)state;
    write_kept_file(path, 0.5);
    vsh_field_file *file = open_kept_file(path);
    vsh_field_options options = vsh_field_options_default();
    vsh_field *field = NULL;
    options.reach = 0.5;
    assert_int_equal(vsh_field_file_field(file, 0, &options, NULL, &field, &why), VSH_OK);
    vsh_field_free(field);
    options.reach = 50.0;
    assert_int_equal(vsh_field_file_field(file, 0, &options, NULL, &field, &why), VSH_ERROR_INPUT);
    assert_null(field);
    assert_non_null(strstr(why.message, "ask for 50"));
    options.reach = -1.0;
    assert_int_equal(vsh_field_file_field(file, 0, &options, NULL, &field, &why), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_field_file_field(file, 1, NULL, NULL, &field, &why), VSH_ERROR_ARGUMENT);
    vsh_field_file_close(file);
}

/* --- what is no such file */

static vsh_result open_bytes(const char *bytes, size_t size) {
    const vsh_run run = one_thread();
    write_field_bytes(path, bytes, size);
    vsh_field_file *file = (vsh_field_file *)&why;
    why.message[0] = '\0';
    const vsh_result result = vsh_field_file_open(path, &run, &file, &why);
    assert_true((result == VSH_OK) == (file != NULL));
    if (result != VSH_OK) {
        assert_true(strncmp(why.message, path, strlen(path)) == 0 && strchr(why.message, '\n') == NULL);
    }
    vsh_field_file_close(file);
    return result;
}

static void a_file_with_any_byte_changed_is_refused(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size;
    char *bytes = read_field_bytes(path, &size);
    const size_t head = field_head_bytes(bytes);
    size_t tried = 0;
    /* each of the head's first bytes and of its record, and some of every part behind */
    for (size_t at = 0; at < size; at += at < 700 ? 1 : at < head ? 37 : 1511) {
        bytes[at] ^= (char)(1 << at % 8);
        assert_int_not_equal(open_bytes(bytes, size), VSH_OK);
        bytes[at] ^= (char)(1 << at % 8);
        ++tried;
    }
    assert_true(tried > 800);
    bytes[size - 1] ^= 1;
    assert_int_equal(open_bytes(bytes, size), VSH_ERROR_READ);
    bytes[size - 1] ^= 1;
    assert_int_equal(open_bytes(bytes, size), VSH_OK);
    free(bytes);
}

static void a_file_that_is_cut_short_or_goes_on_is_refused(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size;
    char *bytes = read_field_bytes(path, &size);
    const size_t head = field_head_bytes(bytes);
    const size_t sizes[] = {0,   1,    7,        8,    100,      119,      120,
                            121, 1000, head - 1, head, head + 1, size / 2, size - 1};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; ++i) {
        assert_int_equal(open_bytes(bytes, sizes[i]), VSH_ERROR_READ);
        assert_non_null(strstr(why.message, sizes[i] >= 8 ? "cut short" : "no file of fields"));
    }
    char *longer = calloc(1, size + 1);
    memcpy(longer, bytes, size);
    assert_int_equal(open_bytes(longer, size + 1), VSH_ERROR_READ);
    assert_non_null(strstr(why.message, "bytes behind its end"));
    free(longer);
    free(bytes);
}

static void another_version_or_format_is_refused_by_name(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size;
    char *bytes = read_field_bytes(path, &size);
    vshi_stored_head *head = (vshi_stored_head *)(void *)bytes;
    strcpy(head->version, "9.8.7");
    forge_sums(bytes, size);
    assert_int_equal(open_bytes(bytes, size), VSH_ERROR_INPUT);
    assert_non_null(strstr(why.message, "is of vdbshade 9.8.7, this is "));
    head->format = VSHI_STORED_FORMAT + 1;
    assert_int_equal(open_bytes(bytes, size), VSH_ERROR_INPUT);
    assert_non_null(strstr(why.message, "is of format 3"));
    memcpy(bytes, "nothing!", 8);
    assert_int_equal(open_bytes(bytes, size), VSH_ERROR_READ);
    assert_non_null(strstr(why.message, "is no file of fields"));
    free(bytes);
}

static void use_field(const vsh_field *field, const vsh_run *run) {
    enum { POINTS = 64 };
    double at[3 * POINTS];
    float normals[3 * POINTS], values[POINTS];
    uint64_t counter = 9;
    for (int i = 0; i < 3 * POINTS; ++i) {
        at[i] = between(&counter, -1.5, 1.5);
        normals[i] = i % 3 == 1 ? 1.0f : 0.1f;
    }
    vsh_field_sample(field, POINTS, at, values);
    static const double up[3] = {0.3, 0.9, 0.1};
    const vsh_light light = sun(up, RADIANS(8.0));
    const vsh_points points = {POINTS, at, normals, NULL};
    vsh_shade_options options = preview_options();
    options.rays = 4;
    static const int32_t methods[] = {VSH_SHADOW_CONE, VSH_SHADOW_SMOOTH, VSH_SHADOW_RAYS};
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; ++i) {
        options.method = methods[i];
        assert_int_equal(
            vsh_shade_shadow(occluders_of(field), &points, &light, &options, run, values, NULL, NULL, &why),
            VSH_OK);
    }
}

static vsh_result band_result; /* of the last file that was used */

/* What opened is used as a bake does: none of it may crash. */
static bool use_forged(const char *bytes, size_t size) {
    const vsh_run run = one_thread();
    write_field_bytes(path, bytes, size);
    vsh_field_file *file = NULL;
    if (vsh_field_file_open(path, &run, &file, &why) != VSH_OK) {
        return false;
    }
    for (size_t i = 0; i < vsh_field_file_count(file); ++i) {
        vsh_field_options options = vsh_field_options_default();
        options.reach = 0.2;
        options.surface = 1;
        vsh_field *field = NULL;
        if (vsh_field_file_field(file, i, &options, &run, &field, &why) == VSH_OK) {
            use_field(field, &run);
        }
        vsh_field_free(field);
        vsh_voxels *band = NULL;
        band_result = vsh_field_file_band(file, i, 0.0, &run, &band, &why);
        assert_true((band_result == VSH_OK) == (band != NULL));
        vsh_voxels_free(band);
    }
    vsh_field_file_close(file);
    return true;
}

/* Members of which no other value can be true. */
static bool counts_or_places(size_t at) {
    const size_t record = sizeof(vshi_stored_head);
    const size_t level = record + offsetof(vshi_stored_field, levels);
    const size_t band = record + offsetof(vshi_stored_field, band);
    return at < offsetof(vshi_stored_head, sum) ||
           (at >= record + offsetof(vshi_stored_field, attribute_count) && at < band) ||
           (at >= band + offsetof(vshi_map, count) && at < band + offsetof(vshi_map, numbers)) ||
           (at >= band + offsetof(vshi_stored_band, block_count) && at < level) ||
           (at >= level + offsetof(vshi_stored_level, value_count) && at < level + sizeof(vshi_stored_level));
}

/* Whoever forges a file makes its sums anew: then each member must be looked at. */
static void a_forged_file_is_refused_or_safe(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size, refused = 0, tried = 0;
    char *bytes = read_field_bytes(path, &size), *forged = malloc(size);
    static const uint64_t hostile[] = {0,
                                       1,
                                       0x7fffffff,
                                       0x80000000u,
                                       0xffffffffu,
                                       UINT64_C(0x7ff0000000000000),
                                       UINT64_C(0x7fffffffffffffff),
                                       UINT64_MAX};
    const size_t records = sizeof(vshi_stored_head) + sizeof(vshi_stored_field);
    for (size_t at = 8; at < records; at += at < 600 ? 4 : 92) {
        for (size_t i = 0; i < sizeof hostile / sizeof hostile[0]; ++i) {
            for (size_t width = 4; width <= 8; width += 4) {
                memcpy(forged, bytes, size);
                memcpy(forged + at, &hostile[i], width);
                if (memcmp(forged, bytes, size) == 0) {
                    continue;
                }
                forge_sums(forged, size);
                const bool used = use_forged(forged, size);
                if (used && counts_or_places(at) && counts_or_places(at + width - 1)) {
                    fail_msg("byte %zu: %zu bytes of %llx are taken", at, width,
                             (unsigned long long)hostile[i]);
                }
                refused += !used;
                ++tried;
            }
        }
    }
    assert_true(tried > 1000 && refused > tried * 7 / 10);
    free(forged);
    free(bytes);
}

static void a_forged_index_is_refused_and_values_do_no_harm(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size;
    char *bytes = read_field_bytes(path, &size), *forged = malloc(size);
    const vshi_stored_field *record =
        (const vshi_stored_field *)(const void *)(bytes + sizeof(vshi_stored_head));
    const int32_t beyond[] = {-1,
                              INT32_MIN,
                              INT32_MAX,
                              (int32_t)record->value_count,
                              (int32_t)record->value_count - VSHI_BRICK_VALUES + 1,
                              (int32_t)record->levels[0].value_count - VSHI_BRICK_VALUES + 1};
    for (size_t i = 0; i < sizeof beyond / sizeof beyond[0]; ++i) {
        memcpy(forged, bytes, size);
        memcpy(forged + record->index_at, &beyond[i], sizeof beyond[i]);
        forge_sums(forged, size);
        assert_false(use_forged(forged, size));
        assert_non_null(strstr(why.message, "a block's brick is none of its level"));
    }
    memcpy(forged, bytes, size);
    forged[record->values_at] ^= 1; /* of the constant brick */
    forge_sums(forged, size);
    assert_false(use_forged(forged, size));
    memcpy(forged, bytes, size);
    uint64_t counter = 5;
    for (uint64_t v = 2 * VSHI_BRICK_VALUES; v < record->levels[0].value_count; ++v) {
        const int16_t noise = (int16_t)between(&counter, -32768.0, 32768.0);
        memcpy(forged + record->values_at + v * sizeof noise, &noise, sizeof noise);
    }
    forge_sums(forged, size);
    assert_true(use_forged(forged, size));
    free(forged);
    free(bytes);
}

/* --- writing */

static void what_cannot_be_kept_is_refused_and_the_old_file_stays(void **state) {
    (void)state;
    write_kept_file(path, 0.3);
    size_t size, same;
    char *bytes = read_field_bytes(path, &size);
    vsh_field *field = field_of_grid(kept_grid(VOXEL), 0.3), *empty = NULL, *unknown = NULL;
    static const double low[3] = {0, 0, 0}, high[3] = {1, 1, 1};
    assert_int_equal(vshi_field_create_empty(1.0, &empty, &why), VSH_OK);
    assert_int_equal(vshi_field_create_unknown(1.0, low, high, &unknown, &why), VSH_OK);
    vsh_kept_field kept[2] = {vsh_kept_field_default(), vsh_kept_field_default()};
    kept[0].field = kept[1].field = field;
    assert_int_equal(vsh_field_file_write(path, kept, 2, NULL, 0, NULL, &why), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(why.message, "fields[1]: '' is the name of fields[0] too"));
    kept[1].name = "a\nb";
    assert_int_equal(vsh_field_file_write(path, kept, 2, NULL, 0, NULL, &why), VSH_ERROR_ARGUMENT);
    kept[1].name = "b";
    const vsh_field *const none[] = {NULL, empty, unknown};
    for (size_t i = 0; i < 3; ++i) {
        kept[1].field = none[i];
        assert_int_equal(vsh_field_file_write(path, kept, 2, NULL, 0, NULL, &why), VSH_ERROR_ARGUMENT);
    }
    assert_int_equal(vsh_field_file_write(path, kept, 0, NULL, 0, NULL, &why), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_field_file_write("", kept, 1, NULL, 0, NULL, &why), VSH_ERROR_ARGUMENT);
    assert_int_equal(vsh_field_file_write("nowhere/a.field", kept, 1, NULL, 0, NULL, &why), VSH_ERROR_WRITE);
    vsh_run run = vsh_run_default();
    run.memory_limit = 1000;
    assert_int_equal(vsh_field_file_write(path, kept, 1, NULL, 0, &run, &why), VSH_ERROR_LIMIT);
    char *now = read_field_bytes(path, &same);
    assert_int_equal(same, size);
    assert_memory_equal(now, bytes, size);
    vsh_field_file *file;
    run.memory_limit = size / 2;
    assert_int_equal(vsh_field_file_open(path, &run, &file, &why), VSH_ERROR_LIMIT);
    kept[1].field = field;
    assert_int_equal(vsh_field_file_write(path, kept, 2, NULL, 0, NULL, &why), VSH_OK);
    file = open_kept_file(path);
    assert_int_equal(vsh_field_file_count(file), 2);
    vsh_field_file_close(file);
    free(now);
    free(bytes);
    vsh_field_free(unknown);
    vsh_field_free(empty);
    vsh_field_free(field);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(a_field_of_a_file_has_the_bits_of_one_that_is_made, remove_file),
        cmocka_unit_test_teardown(a_file_tells_what_was_written, remove_file),
        cmocka_unit_test_teardown(a_reach_beyond_what_is_kept_is_refused, remove_file),
        cmocka_unit_test_teardown(a_file_with_any_byte_changed_is_refused, remove_file),
        cmocka_unit_test_teardown(a_file_that_is_cut_short_or_goes_on_is_refused, remove_file),
        cmocka_unit_test_teardown(another_version_or_format_is_refused_by_name, remove_file),
        cmocka_unit_test_teardown(a_forged_file_is_refused_or_safe, remove_file),
        cmocka_unit_test_teardown(a_forged_index_is_refused_and_values_do_no_harm, remove_file),
        cmocka_unit_test_teardown(what_cannot_be_kept_is_refused_and_the_old_file_stays, remove_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
