/* EXR files in tiles, which this library reads and does not write: they are made by OpenEXR's own calls. */
#include "images.h"

#include <openexr.h>

enum { PART = 0, CHANNELS = 2, LARGEST_TILE = 64 };

static const char *const NAMES[CHANNELS] = {"ao", "shadow"}; /* sorted, as files have them */

static void must(exr_result_t status) {
    if (status != EXR_ERR_SUCCESS) {
        fail_msg("OpenEXR: %s", exr_get_default_error_message(status));
    }
}

typedef struct tiling {
    int32_t width, height, tile_width, tile_height;
    int32_t left, top; /* of the data window */
    exr_tile_level_mode_t levels;
} tiling;

/* A tile as it stands in a file without compression: rows of each channel in turn. Coarser levels are NaN. */
static void write_tile(exr_context_t file, const tiling *t, const sample *s, int32_t level, int32_t column,
                       int32_t row) {
    int32_t width, height;
    must(exr_get_level_sizes(file, PART, level, level, &width, &height));
    static float packed[CHANNELS * LARGEST_TILE * LARGEST_TILE];
    size_t count = 0;
    const int32_t x_begin = column * t->tile_width, y_begin = row * t->tile_height;
    for (int32_t y = y_begin; y < y_begin + t->tile_height && y < height; ++y) {
        for (int32_t c = 0; c < CHANNELS; ++c) {
            for (int32_t x = x_begin; x < x_begin + t->tile_width && x < width; ++x) {
                packed[count++] = level == 0 ? s->planes[c][y * width + x] : NAN;
            }
        }
    }
    must(exr_write_tile_chunk(file, PART, column, row, level, level, packed, count * sizeof *packed));
}

static void write_tiles(const char *path, const tiling *t, const sample *s) {
    exr_context_t file = NULL;
    int part;
    must(exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    must(exr_add_part(file, "tiles", EXR_STORAGE_TILED, &part));
    const exr_attr_box2i_t window = {
        .min.x = t->left, .min.y = t->top, .max.x = t->left + t->width - 1, .max.y = t->top + t->height - 1};
    const exr_attr_v2f_t centre = {.x = 0.0f, .y = 0.0f};
    must(exr_initialize_required_attr(file, part, &window, &window, 1.0f, &centre, 1.0f,
                                      EXR_LINEORDER_INCREASING_Y, EXR_COMPRESSION_NONE));
    for (int32_t c = 0; c < CHANNELS; ++c) {
        must(exr_add_channel(file, part, NAMES[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1));
    }
    must(exr_set_tile_descriptor(file, part, (uint32_t)t->tile_width, (uint32_t)t->tile_height, t->levels,
                                 EXR_TILE_ROUND_DOWN));
    must(exr_write_header(file));
    int32_t levels, levels_down;
    must(exr_get_tile_levels(file, part, &levels, &levels_down));
    for (int32_t level = 0; level < levels; ++level) {
        int32_t width, height;
        must(exr_get_level_sizes(file, part, level, level, &width, &height));
        for (int32_t row = 0; row * t->tile_height < height; ++row) {
            for (int32_t column = 0; column * t->tile_width < width; ++column) {
                write_tile(file, t, s, level, column, row);
            }
        }
    }
    must(exr_finish(&file));
}

static void the_finest_level_is_read_to_the_bit(void **state) {
    (void)state;
    const tiling tilings[] = {
        {37, 23, 16, 8, 0, 0, EXR_TILE_ONE_LEVEL},      {16, 16, 64, 64, 0, 0, EXR_TILE_ONE_LEVEL},
        {1, 40, 8, 8, 0, 0, EXR_TILE_ONE_LEVEL},        {37, 23, 16, 16, -7, 1000, EXR_TILE_ONE_LEVEL},
        {64, 64, 32, 32, 0, 0, EXR_TILE_MIPMAP_LEVELS}, {50, 30, 16, 16, 3, -3, EXR_TILE_MIPMAP_LEVELS},
    };
    for (size_t i = 0; i < sizeof tilings / sizeof tilings[0]; ++i) {
        const tiling *t = &tilings[i];
        sample s;
        make(&s, t->width, t->height, CHANNELS, NAMES);
        write_tiles(at("tiles.exr"), t, &s);
        vsh_image_file *file = NULL;
        vsh_error error = {0};
        assert_ok(vsh_image_read(at("tiles.exr"), NULL, &file, &error), &error);
        const vsh_image view = vsh_image_view(file);
        assert_int_equal(view.width, t->width);
        assert_int_equal(view.height, t->height);
        assert_int_equal(view.channel_count, CHANNELS);
        for (int32_t c = 0; c < CHANNELS; ++c) {
            assert_string_equal(view.names[c], NAMES[c]);
            assert_memory_equal(view.planes[c], s.planes[c],
                                (size_t)t->width * (size_t)t->height * sizeof(float));
        }
        vsh_image_free(file);
        unmake(&s);
    }
}

static int32_t stop_at_half(void *user, const char *stage, double fraction) {
    (void)user;
    assert_string_equal(stage, "load");
    return fraction >= 0.5;
}

static void reading_can_be_cancelled_between_rows_of_tiles(void **state) {
    (void)state;
    const tiling t = {40, 64, 16, 16, 0, 0, EXR_TILE_ONE_LEVEL};
    sample s;
    make(&s, t.width, t.height, CHANNELS, NAMES);
    write_tiles(at("cancelled.exr"), &t, &s);
    vsh_run run = vsh_run_default();
    run.progress = stop_at_half;
    vsh_image_file *file = NULL;
    vsh_error error = {0};
    assert_int_equal(vsh_image_read(at("cancelled.exr"), &run, &file, &error), VSH_ERROR_CANCELLED);
    assert_null(file);
    unmake(&s);
}

static void cut_files_are_refused(void **state) {
    (void)state;
    const tiling t = {37, 23, 16, 8, 0, 0, EXR_TILE_ONE_LEVEL};
    sample s;
    make(&s, t.width, t.height, CHANNELS, NAMES);
    write_tiles(at("whole.exr"), &t, &s);
    unsigned char *bytes = NULL;
    const size_t size = read_all(at("whole.exr"), &bytes);
    const size_t cuts[] = {1, 100, size / 2, size - 400};
    for (size_t i = 0; i < sizeof cuts / sizeof cuts[0]; ++i) {
        write_all(at("cut.exr"), bytes, size - cuts[i]);
        vsh_image_file *file = NULL;
        vsh_error error = {0};
        const vsh_result result = vsh_image_read(at("cut.exr"), NULL, &file, &error);
        assert_true(result == VSH_ERROR_INPUT || result == VSH_ERROR_READ);
        assert_non_null(strstr(error.message, "cut.exr"));
        assert_null(file);
    }
    free(bytes);
    unmake(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_finest_level_is_read_to_the_bit),
        cmocka_unit_test(reading_can_be_cancelled_between_rows_of_tiles),
        cmocka_unit_test(cut_files_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
