/* Images in pieces: written as their rows come they are those that are written whole; tiles are read. */
#include "images.h"
#include "testing.h"

#include <fcntl.h>
#include <openexr.h>

/* The first are written in long rows, too. */
static const char *const ENDINGS[] = {"exr", "png", "tif",  "tga", "jpg", "bmp", "hdr",
                                      "ppm", "pgm", "webp", "jp2", "dpx", "gif"};
enum { LONG_COUNT = 5, ENDING_COUNT = sizeof ENDINGS / sizeof ENDINGS[0] };

/* The sample's rows before `end`, in pieces of 1, 2, 3 … rows, or of `step`. */
static vsh_result add_rows(vsh_image_writer *writer, const sample *s, int32_t step, int32_t end) {
    vsh_result result = VSH_OK;
    int32_t next = 1, rows;
    for (int32_t first = 0; first < end && result == VSH_OK; first += rows) {
        const int32_t wanted = step > 0 ? step : next++;
        rows = end - first < wanted ? end - first : wanted;
        const float *planes[MOST];
        for (int32_t c = 0; c < s->image.channel_count; ++c) {
            planes[c] = s->planes[c] + (size_t)first * (size_t)s->image.width;
        }
        result = vsh_image_writer_add(writer, rows, planes, &failure);
    }
    return result;
}

static vsh_image_writer *begin(const char *path, const sample *s) {
    vsh_image_writer *writer = NULL;
    vsh_image shape = s->image;
    shape.planes = NULL;
    assert_ok(vsh_image_writer_create(path, &shape, NULL, &writer, &failure));
    return writer;
}

static vsh_result write_in_pieces(vsh_image_writer *writer, const sample *s, int32_t step) {
    const vsh_result result = add_rows(writer, s, step, s->image.height);
    if (result == VSH_OK) {
        return vsh_image_writer_finish(writer, &failure);
    }
    vsh_image_writer_abandon(writer);
    return result;
}

static void assert_same_file(const char *path, const char *other) {
    FREED unsigned char *bytes = NULL, *more = NULL;
    const size_t size = read_all(path, &bytes);
    assert_int_equal(read_all(other, &more), size);
    if (memcmp(bytes, more, size) != 0) {
        fail_msg("%s is not %s", path, other);
    }
}

/* Neither the time nor the file's name: and no path so long that a header had no room for its end. */
TEST(the_same_image_is_the_same_bytes_later_elsewhere) {
    FREED_BY(unmake) sample s;
    make(&s, 64, 50, 3, LIGHTMAP);
    const int back = open(".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    assert_true(back >= 0 && chdir(at("")) == 0);
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t e = 0; e < ENDING_COUNT; ++e) {
            char names[2][16];
            snprintf(names[0], sizeof names[0], "t.%s", ENDINGS[e]);
            snprintf(names[1], sizeof names[1], "other.%s", ENDINGS[e]);
            assert_ok(vsh_image_write(names[pass], &s.image, NULL, &failure));
            if (pass == 1) {
                assert_same_file(names[0], names[1]);
            }
        }
        sleep(pass == 0); /* some formats note the second */
    }
    assert_int_equal(fchdir(back), 0);
    close(back);
}

/* Pieces of the last size are wide enough that OpenImageIO is handed several lots of rows. */
TEST(rows_make_the_bytes_of_the_whole_image) {
    static const struct {
        int32_t width, height, step;
        size_t endings;
    } cases[] = {{200, 150, 0, ENDING_COUNT}, {200, 150, 64, ENDING_COUNT}, {8192, 100, 24, LONG_COUNT}};
    for (size_t k = 0; k < 3; ++k) {
        FREED_BY(unmake) sample s;
        make(&s, cases[k].width, cases[k].height, k == 2 ? 4 : 3,
             (const char *const[]){"shadow.sun", "ao", "A", "shadow.lamp"});
        for (size_t e = 0; e < cases[k].endings; ++e) {
            char whole[16], pieces[16];
            snprintf(whole, sizeof whole, "whole.%s", ENDINGS[e]);
            snprintf(pieces, sizeof pieces, "pieces.%s", ENDINGS[e]);
            assert_ok(vsh_image_write(at(whole), &s.image, NULL, &failure));
            assert_ok(write_in_pieces(begin(at(pieces), &s), &s, cases[k].step));
            assert_same_file(at(whole), at(pieces));
            unlink(at(whole));
            unlink(at(pieces));
        }
    }
}

static const unsigned char old_content[] = "the old content";

static void assert_untouched(const char *path, int entries) {
    FREED unsigned char *bytes = NULL;
    assert_int_equal(read_all(path, &bytes), sizeof old_content);
    assert_memory_equal(bytes, old_content, sizeof old_content);
    assert_int_equal(entries_in_folder(), entries);
}

TEST(what_is_given_up_or_short_of_rows_leaves_the_old_file) {
    FREED_BY(unmake) sample s;
    make(&s, 200, 150, 3, LIGHTMAP);
    for (size_t e = 0; e < ENDING_COUNT; ++e) {
        char name[16];
        snprintf(name, sizeof name, "old.%s", ENDINGS[e]);
        write_all(at(name), old_content, sizeof old_content);
        const int entries = entries_in_folder();
        for (int32_t rows = 0; rows <= 150; rows += 50) {
            vsh_image_writer *writer = begin(at(name), &s);
            assert_ok(add_rows(writer, &s, 150, rows));
            assert_int_equal(entries_in_folder(), entries + 1);
            vsh_image_writer_abandon(writer);
            assert_untouched(at(name), entries);
        }
        vsh_image_writer *writer = begin(at(name), &s);
        assert_ok(add_rows(writer, &s, 150, 149));
        assert_fails(vsh_image_writer_finish(writer, &failure), VSH_ERROR_ARGUMENT, "149 of 150");
        assert_untouched(at(name), entries);
    }
}

TEST(rows_that_are_none_of_it_are_refused) {
    FREED_BY(unmake) sample s;
    make(&s, 20, 10, 3, LIGHTMAP);
    vsh_image_writer *writer = begin(at("refused.exr"), &s);
    assert_fails(vsh_image_writer_add(writer, 0, s.planes, &failure), VSH_ERROR_ARGUMENT, "");
    assert_fails(vsh_image_writer_add(writer, 11, s.planes, &failure), VSH_ERROR_ARGUMENT, "");
    s.planes[1] = NULL;
    assert_fails(vsh_image_writer_add(writer, 10, s.planes, &failure), VSH_ERROR_ARGUMENT, "'ao'");
    vsh_image_writer_abandon(writer);
    vsh_image_writer_abandon(NULL);
    assert_fails(vsh_image_writer_add(NULL, 1, s.planes, &failure), VSH_ERROR_ARGUMENT, "writer is NULL");
    assert_fails(vsh_image_writer_finish(NULL, &failure), VSH_ERROR_ARGUMENT, "writer is NULL");
}

/* The limit on a file's size stands for a full disk: at the first byte, in the middle, at the very last one.
 */
TEST(a_full_disk_leaves_the_old_file_and_nothing_else) {
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit old_limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
    FREED_BY(unmake) sample s;
    make(&s, 200, 180, 3, LIGHTMAP);
    for (size_t e = 0; e < ENDING_COUNT; ++e) {
        char name[16];
        snprintf(name, sizeof name, "full.%s", ENDINGS[e]);
        assert_ok(vsh_image_write(at(name), &s.image, NULL, &failure));
        struct stat status;
        assert_int_equal(stat(at(name), &status), 0);
        const rlim_t half = (rlim_t)status.st_size / 2,
                     limits[] = {half, 0, 100, half, (rlim_t)status.st_size - 1};
        write_all(at(name), old_content, sizeof old_content);
        const int entries = entries_in_folder();
        for (size_t l = 0; l < sizeof limits / sizeof limits[0]; ++l) {
            const struct rlimit limit = {limits[l], old_limit.rlim_max};
            vsh_image_writer *writer = l == 0 ? begin(at(name), &s) : NULL;
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
            const vsh_result result = l == 0 ? write_in_pieces(writer, &s, 50)
                                             : vsh_image_write(at(name), &s.image, NULL, &failure);
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &old_limit), 0);
            if (result != VSH_ERROR_WRITE) {
                fail_msg("%s at %llu bytes: %s", name, (unsigned long long)limits[l],
                         vsh_result_name(result));
            }
            assert_untouched(at(name), entries);
        }
    }
    signal(SIGXFSZ, SIG_DFL);
}

/* --- EXR files in tiles, which this library reads and does not write: they are made by OpenEXR's own calls
 */

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

TEST(the_finest_level_is_read_to_the_bit) {
    const tiling tilings[] = {
        {37, 23, 16, 8, 0, 0, EXR_TILE_ONE_LEVEL},      {16, 16, 64, 64, 0, 0, EXR_TILE_ONE_LEVEL},
        {1, 40, 8, 8, 0, 0, EXR_TILE_ONE_LEVEL},        {37, 23, 16, 16, -7, 1000, EXR_TILE_ONE_LEVEL},
        {64, 64, 32, 32, 0, 0, EXR_TILE_MIPMAP_LEVELS}, {50, 30, 16, 16, 3, -3, EXR_TILE_MIPMAP_LEVELS},
    };
    for (size_t i = 0; i < sizeof tilings / sizeof tilings[0]; ++i) {
        const tiling *t = &tilings[i];
        FREED_BY(unmake) sample s;
        make(&s, t->width, t->height, CHANNELS, NAMES);
        write_tiles(at("tiles.exr"), t, &s);
        OWNED(vsh_image_file) *file = NULL;
        assert_ok(vsh_image_read(at("tiles.exr"), NULL, &file, &failure));
        const vsh_image view = vsh_image_view(file);
        assert_int_equal(view.width, t->width);
        assert_int_equal(view.height, t->height);
        assert_int_equal(view.channel_count, CHANNELS);
        for (int32_t c = 0; c < CHANNELS; ++c) {
            assert_string_equal(view.names[c], NAMES[c]);
            assert_memory_equal(view.planes[c], s.planes[c],
                                (size_t)t->width * (size_t)t->height * sizeof(float));
        }
    }
}

static int32_t stop_at_half(void *user, const char *stage, double fraction) {
    assert_string_equal(stage, "load");
    return fraction >= 0.5;
}

TEST(reading_can_be_cancelled_between_rows_of_tiles) {
    const tiling t = {40, 64, 16, 16, 0, 0, EXR_TILE_ONE_LEVEL};
    FREED_BY(unmake) sample s;
    make(&s, t.width, t.height, CHANNELS, NAMES);
    write_tiles(at("cancelled.exr"), &t, &s);
    vsh_run run = vsh_run_default();
    run.progress = stop_at_half;
    vsh_image_file *file = NULL;
    assert_fails(vsh_image_read(at("cancelled.exr"), &run, &file, &failure), VSH_ERROR_CANCELLED, "");
    assert_null(file);
}

TEST(cut_files_are_refused) {
    const tiling t = {37, 23, 16, 8, 0, 0, EXR_TILE_ONE_LEVEL};
    FREED_BY(unmake) sample s;
    make(&s, t.width, t.height, CHANNELS, NAMES);
    write_tiles(at("whole.exr"), &t, &s);
    FREED unsigned char *bytes = NULL;
    const size_t size = read_all(at("whole.exr"), &bytes);
    const size_t cuts[] = {1, 100, size / 2, size - 400};
    for (size_t i = 0; i < sizeof cuts / sizeof cuts[0]; ++i) {
        write_all(at("cut.exr"), bytes, size - cuts[i]);
        vsh_image_file *file = NULL;
        const vsh_result result = vsh_image_read(at("cut.exr"), NULL, &file, &failure);
        assert_true(result == VSH_ERROR_INPUT || result == VSH_ERROR_READ);
        assert_non_null(strstr(failure.message, "cut.exr"));
        assert_null(file);
    }
}

FIXTURE(make_folder, remove_folder)
