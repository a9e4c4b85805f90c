/* Images: what formats keep, what is refused, damaged files, files that are put in place together, and images
 * in pieces. test_image_others.cpp reads them by other programs' code. */
#include "images.h"
#include "truth/metrics.h"

#include <fcntl.h>

static vsh_image_file *write_and_read(const char *path, const vsh_image *image, int32_t bits,
                                      const char *pack) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    assert_ok(vsh_image_check(path, image, &options, &failure));
    assert_ok(vsh_image_write(path, image, &options, &failure));
    return image_from(path);
}

/* A sample that was written and read again. */
typedef struct trip {
    sample s;
    size_t texels;
    vsh_image_file *file;
    vsh_image view;
} trip;

static void send(trip *t, const char *name, int32_t bits, const char *pack) {
    t->texels = (size_t)t->s.image.width * (size_t)t->s.image.height;
    t->file = write_and_read(at(name), &t->s.image, bits, pack);
    t->view = vsh_image_view(t->file);
    assert_int_equal(t->view.width, t->s.image.width);
    assert_int_equal(t->view.height, t->s.image.height);
}

static void end(trip *t) {
    vsh_image_free(t->file);
    unmake(&t->s);
}

static void assert_exact(const trip *t, const char *name, int32_t channel) {
    assert_memory_equal(plane_of(&t->view, name), t->s.planes[channel], t->texels * sizeof(float));
}

/* The largest difference; INFINITY if a value is not finite. */
static double worst(const float *a, const float *b, size_t count) {
    return truth_compare(count, a, b, NULL).max;
}

TEST(exr_32_is_bit_exact) {
    static const int32_t sizes[][2] = {{37, 23}, {1, 1}, {1, 5000}, {5000, 1}, {16, 16}};
    for (size_t k = 0; k < COUNT_OF(sizes); ++k) {
        FREED_BY(end) trip t;
        make(&t.s, sizes[k][0], sizes[k][1], 3, LIGHTMAP);
        t.s.values[0] = NAN;
        send(&t, "exact.exr", 0, "channels");
        assert_int_equal(t.view.channel_count, 3);
        for (int32_t c = 0; c < 3; ++c) {
            assert_exact(&t, LIGHTMAP[c], c);
        }
    }
}

/* The writer stores a chunk raw if its compressed data are as long as the raw data. Small images with few
 * values have such chunks. */
TEST(exr_keeps_every_small_size) {
    static const char *const names[] = {"a", "b", "c", "d", "e", "f", "g"};
    static const float levels[] = {0.0f, 1.0f, 0.5f, 0.25f, 1.0f / 3.0f, 0.7f, 0.9f};
    enum { LARGEST = 12, KINDS = 4 };
    for (int32_t at_size = 0; at_size < LARGEST * LARGEST * KINDS * 7; ++at_size) {
        const int32_t kind = at_size % KINDS, channels = at_size / KINDS % 7 + 1,
                      width = at_size / KINDS / 7 % LARGEST + 1, height = at_size / KINDS / 7 / LARGEST + 1;
        const int32_t bits = kind < 2 ? 32 : 16, variety = kind % 2 == 0 ? 2 : 7;
        FREED_BY(end) trip t;
        make(&t.s, width, height, channels, names);
        uint32_t seed = 7;
        for (int32_t i = 0; i < width * height * channels; ++i) {
            seed = seed * 1664525u + 1013904223u;
            t.s.values[i] = levels[(seed >> 24) % (uint32_t)variety];
        }
        send(&t, "small.exr", bits, "channels");
        for (int32_t c = 0; c < channels; ++c) {
            const double difference = worst(plane_of(&t.view, names[c]), t.s.planes[c], t.texels);
            assert_that(difference <= (bits == 16 ? 0x1p-12 : 0.0),
                        "%d × %d, %d channels of %d bits: off by %g", width, height, channels, bits,
                        difference);
        }
    }
}

TEST(exr_channels_come_back_sorted_by_names_of_up_to_127_bytes) {
    trip t;
    make(&t.s, 5, 4, 3, LIGHTMAP);
    send(&t, "sorted.exr", 32, NULL);
    static const char *const sorted[] = {"A", "B", "G", "R", "ao", "shadow.sun"};
    assert_int_equal(t.view.channel_count, 6);
    for (int c = 0; c < 6; ++c) {
        assert_string_equal(t.view.names[c], sorted[c]);
    }
    end(&t);
    char names[2][128] = {{0}};
    memset(names[0], 'n', 127);
    memset(names[1], 'n', 126);
    names[1][126] = 'm';
    make(&t.s, 9, 40, 2, (const char *const[]){names[0], names[1]});
    send(&t, "long.exr", 32, NULL);
    assert_exact(&t, names[0], 0);
    assert_exact(&t, names[1], 1);
    end(&t);
}

TEST(packs_name_the_channels_of_exr_whose_names_may_have_commas_and_equals) {
    trip t;
    make(&t.s, 6, 20, 3, LIGHTMAP);
    send(&t, "packed.exr", 32, "G=ao,R=shadow.sun,A=1");
    assert_int_equal(t.view.channel_count, 3);
    assert_exact(&t, "R", 0);
    assert_exact(&t, "G", 1);
    for (size_t i = 0; i < t.texels; ++i) {
        assert_true(plane_of(&t.view, "A")[i] == 1.0f);
    }
    end(&t);
    make(&t.s, 3, 3, 3, (const char *const[]){"shadow.a", "shadow.a,b=c", "1"});
    send(&t, "comma.exr", 32, "R=shadow.a,b=c,G=1,B=shadow.a");
    assert_exact(&t, "R", 1);
    assert_exact(&t, "G", 2);
    assert_exact(&t, "B", 0);
    end(&t);
}

/* Every format: the file's R, G and B are the channels asked for, also where A is 0. */
TEST(every_format_keeps_values_to_half_a_step) {
    static const struct {
        const char *name;
        int32_t bits;
        double tolerance;
        bool alpha;
    } formats[] = {
        {"f.png", 8, 0.5 / 255, true},     {"f.png", 16, 0.5 / 65535, true}, {"f.TIF", 8, 0.5 / 255, true},
        {"f.tiff", 16, 0.5 / 65535, true}, {"f.tif", 32, 0.0, true},         {"f.tga", 8, 0.5 / 255, true},
        {"f.bmp", 8, 0.5 / 255, true},     {"f.ppm", 8, 0.5 / 255, false},   {"f.hdr", 32, 1.0 / 128, false},
        {"f.jpg", 8, 0.03, false},         {"f.webp", 8, 0.06, false},
    };
    FREED_BY(unmake) sample s;
    make(&s, 70, 90, 4, (const char *const[]){"shadow.sun", "ao", "shadow.lamp", "A"});
    for (int i = 0; i < 70 * 90; ++i) {
        s.values[3 * 70 * 90 + i] = (float)(i / 7 % 2); /* coverage */
    }
    for (size_t f = 0; f < COUNT_OF(formats); ++f) {
        OWNED(vsh_image_file) *file = write_and_read(at(formats[f].name), &s.image, formats[f].bits, NULL);
        const vsh_image view = vsh_image_view(file);
        assert_int_equal(view.width, 70);
        assert_int_equal(view.height, 90);
        assert_true(view.channel_count >= (formats[f].alpha ? 4 : 3));
        for (int32_t c = 0; c < (formats[f].alpha ? 4 : 3); ++c) {
            const double difference = worst(view.planes[c], s.planes[c], 70 * 90);
            assert_that(
                difference <= formats[f].tolerance * (1.0 + 1e-4) + (formats[f].tolerance > 0.0 ? 1e-7 : 0.0),
                "%s at %d bits, channel %d: off by %g", formats[f].name, formats[f].bits, c, difference);
        }
    }
}

TEST(lossy_formats_keep_grey) {
    FREED_BY(unmake) sample s;
    make(&s, 70, 90, 2, (const char *const[]){"ao", "A"});
    static const char *const names[] = {"g.webp", "g.jpg"};
    for (size_t n = 0; n < COUNT_OF(names); ++n) {
        OWNED(vsh_image_file) *file = write_and_read(at(names[n]), &s.image, 0, NULL);
        const vsh_image view = vsh_image_view(file);
        for (int32_t c = 0; c < 3; ++c) {
            const double difference = worst(view.planes[c], s.planes[0], 70 * 90);
            assert_that(difference < 0.02, "%s, channel %d: off by %g", names[n], c, difference);
        }
    }
}

/* Without a pack R, G and B are the irradiance or the first three channels but A, one alone is grey, and A is
 * coverage. */
TEST(packs_and_formats_choose_the_file_s_channels_and_bits) {
    static const struct {
        const char *name, *pack, *names[5];
        int32_t count, channels, from[4]; /* which plane each channel is, -1: zeros */
        double steps;
    } cases[] = {
        {"best.png", "R=a,G=b,B=A", {"a", "b", "A"}, 3, 3, {0, 1, 2}, 65535},
        {"best.tga", "R=a,G=b,B=A", {"a", "b", "A"}, 3, 3, {0, 1, 2}, 255},
        {"zero.png", "G=b", {"a", "b", "A"}, 3, 3, {-1, 1, -1}, 65535},
        {"own.png", NULL, {"a", "b", "A"}, 3, 4, {0, 1, -1, 2}, 65535},
        {"own.png", NULL, {"A", "a"}, 2, 4, {1, 1, 1, 0}, 65535},
        {"own.png", NULL, {"a"}, 1, 3, {0, 0, 0}, 65535},
        {"own.png", NULL, {"A"}, 1, 4, {0, 0, 0, 0}, 65535},
        {"own.png", NULL, {"a", "b", "c", "d", "A"}, 5, 4, {0, 1, 2, 4}, 65535},
        {"own.png",
         NULL,
         {"ao", "irradiance.R", "irradiance.G", "irradiance.B", "A"},
         5,
         4,
         {1, 2, 3, 4},
         65535},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        static const float zeros[40 * 30];
        FREED_BY(end) trip t;
        make(&t.s, 40, 30, cases[i].count, cases[i].names);
        send(&t, cases[i].name, 0, cases[i].pack);
        assert_int_equal(t.view.channel_count, cases[i].channels);
        for (int32_t c = 0; c < cases[i].channels; ++c) {
            const int32_t from = cases[i].from[c];
            const double off = worst(t.view.planes[c], from < 0 ? zeros : t.s.planes[from], t.texels);
            assert_that(off <= (from < 0 ? 0.0 : 0.5001 / cases[i].steps), "case %zu, channel %d: off by %g",
                        i, c, off);
        }
    }
}

/* --- color spaces: which values go through the sRGB curve, what the file says, what is cut */

static const char *const IRRADIANCE[] = {"shadow.sun", "irradiance.R", "irradiance.G", "irradiance.B", "A"};
static const vsh_channel_kind HOLDS[] = {VSH_CHANNEL_DATA, VSH_CHANNEL_LIGHT, VSH_CHANNEL_LIGHT,
                                         VSH_CHANNEL_LIGHT, VSH_CHANNEL_DATA};

TEST(floats_are_linear_and_bad_spaces_are_refused) {
    static const vsh_channel_kind none[] = {0, 0, 3, 0, 0};
    FREED_BY(unmake) sample s;
    make(&s, 30, 20, 5, IRRADIANCE);
    s.image.holds = HOLDS;
    OWNED(vsh_image_file) *file = write_and_read(at("float.tif"), &s.image, 32, NULL);
    assert_memory_equal(vsh_image_view(file).planes[0], s.planes[1], 600 * sizeof(float));
    vsh_image_options options = vsh_image_options_default();
    options.color_space = VSH_COLOR_SRGB;
    assert_fails(vsh_image_check(at("x.exr"), &s.image, &options, &failure), VSH_ERROR_ARGUMENT,
                 "floats are linear");
    options.color_space = 7;
    assert_fails(vsh_image_check(at("x.png"), &s.image, &options, &failure), VSH_ERROR_ARGUMENT,
                 "color_space 7");
    s.image.holds = none;
    assert_fails(vsh_image_check(at("n.png"), &s.image, NULL, &failure), VSH_ERROR_ARGUMENT,
                 "channel 'irradiance.G' holds 3, expected 0 … 2");
}

static vsh_image_clipping clipping_of(const char *path, const vsh_image *image, const char *pack) {
    vsh_image_clipping clipping;
    vsh_image_options options = vsh_image_options_default();
    options.pack = pack;
    options.clipping = &clipping;
    assert_ok(vsh_image_write(path, image, &options, &failure));
    return clipping;
}

TEST(light_over_1_is_counted_if_it_is_cut) {
    FREED_BY(unmake) sample s;
    make(&s, 10, 10, 5, IRRADIANCE);
    s.image.holds = HOLDS;
    for (size_t i = 0; i < 100; ++i) {
        s.values[400 + i] = i < 50 ? 1.0f : 0.0f; /* A */
    }
    s.values[100 + 3] = 1.5f;    /* R */
    s.values[300 + 7] = 4.0f;    /* B */
    s.values[300 + 3] = 1.25f;   /* the same texel as R's */
    s.values[100 + 60] = 100.0f; /* where A is 0 */
    s.values[5] = 9.0f;          /* a shadow is no light */
    const vsh_image_clipping cut = clipping_of(at("cut.png"), &s.image, NULL);
    assert_int_equal(cut.texels, 50);
    assert_int_equal(cut.clipped, 2);
    assert_true(cut.largest == 4.0f);
    assert_int_equal(clipping_of(at("cut.exr"), &s.image, NULL).clipped, 0);
    assert_int_equal(clipping_of(at("cut.hdr"), &s.image, NULL).clipped, 0);
    assert_int_equal(clipping_of(at("cut.png"), &s.image, "R=shadow.sun,A=A").clipped, 0);
}

TEST(options_of_an_older_header_have_no_member_behind_their_size) {
    FREED_BY(unmake) sample s;
    make(&s, 10, 10, 5, IRRADIANCE);
    vsh_image_options options = vsh_image_options_default();
    options.struct_size = offsetof(vsh_image_options, clipping);
    options.clipping = (vsh_image_clipping *)(uintptr_t)1; /* not to be used */
    assert_ok(vsh_image_write(at("old.png"), &s.image, &options, &failure));
}

/* --- images in pieces: rows that are written as they come, tiles that are read */

/* The first are written in long rows, too. */
static const char *const ENDINGS[] = {"exr", "png", "tif", "tga", "jpg", "bmp", "hdr", "ppm", "webp"};
enum { LONG_COUNT = 5, ENDING_COUNT = COUNT_OF(ENDINGS) };

/* The sample's rows before `end`, in pieces of 1, 2, 3 … rows, or of `step`. */
static vsh_result add_rows(vshi_image_writer *writer, const sample *s, int32_t step, int32_t end) {
    vsh_result result = VSH_OK;
    int32_t next = 1, rows;
    for (int32_t first = 0; first < end && result == VSH_OK; first += rows) {
        const int32_t wanted = step > 0 ? step : next++;
        rows = end - first < wanted ? end - first : wanted;
        const float *planes[MOST];
        for (int32_t c = 0; c < s->image.channel_count; ++c) {
            planes[c] = s->planes[c] + (size_t)first * (size_t)s->image.width;
        }
        result = vshi_image_writer_add(writer, rows, planes, &failure);
    }
    return result;
}

static vshi_image_writer *begin_writer(const char *path, const sample *s) {
    vshi_image_writer *writer = NULL;
    vsh_image shape = s->image;
    shape.planes = NULL;
    assert_ok(vshi_image_writer_create(path, &shape, NULL, &writer, &failure));
    return writer;
}

static vsh_result write_in_pieces(vshi_image_writer *writer, const sample *s, int32_t step) {
    const vsh_result result = add_rows(writer, s, step, s->image.height);
    if (result == VSH_OK) {
        return vshi_image_writer_finish(writer, &failure);
    }
    vshi_image_writer_abandon(writer);
    return result;
}

static void assert_same_file(const char *path, const char *other) {
    FREED unsigned char *bytes = NULL, *more = NULL;
    const size_t size = read_all(path, &bytes);
    assert_int_equal(read_all(other, &more), size);
    assert_that(memcmp(bytes, more, size) == 0, "%s is not %s", path, other);
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
            assert_ok(write_in_pieces(begin_writer(at(pieces), &s), &s, cases[k].step));
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

TEST(a_writer_that_is_abandoned_or_short_of_rows_leaves_the_old_file) {
    FREED_BY(unmake) sample s;
    make(&s, 200, 150, 3, LIGHTMAP);
    for (size_t e = 0; e < ENDING_COUNT; ++e) {
        char name[16];
        snprintf(name, sizeof name, "old.%s", ENDINGS[e]);
        write_all(at(name), old_content, sizeof old_content);
        const int entries = entries_in_folder();
        vshi_image_writer *writer = begin_writer(at(name), &s);
        assert_ok(add_rows(writer, &s, 150, 50));
        assert_int_equal(entries_in_folder(), entries + 1);
        vshi_image_writer_abandon(writer);
        assert_untouched(at(name), entries);
        writer = begin_writer(at(name), &s);
        assert_ok(add_rows(writer, &s, 150, 149));
        assert_fails(vshi_image_writer_finish(writer, &failure), VSH_ERROR_ARGUMENT, "149 of 150");
        assert_untouched(at(name), entries);
    }
}

TEST(rows_too_few_too_many_or_missing_are_refused) {
    FREED_BY(unmake) sample s;
    make(&s, 20, 10, 3, LIGHTMAP);
    vshi_image_writer *writer = begin_writer(at("refused.exr"), &s);
    assert_fails(vshi_image_writer_add(writer, 0, s.planes, &failure), VSH_ERROR_ARGUMENT, "");
    assert_fails(vshi_image_writer_add(writer, 11, s.planes, &failure), VSH_ERROR_ARGUMENT, "");
    s.planes[1] = NULL;
    assert_fails(vshi_image_writer_add(writer, 10, s.planes, &failure), VSH_ERROR_ARGUMENT, "'ao'");
    vshi_image_writer_abandon(writer);
    vshi_image_writer_abandon(NULL);
    assert_fails(vshi_image_writer_add(NULL, 1, s.planes, &failure), VSH_ERROR_ARGUMENT, "writer is NULL");
    assert_fails(vshi_image_writer_finish(NULL, &failure), VSH_ERROR_ARGUMENT, "writer is NULL");
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
        for (size_t l = 0; l < COUNT_OF(limits); ++l) {
            const struct rlimit limit = {limits[l], old_limit.rlim_max};
            vshi_image_writer *writer = l == 0 ? begin_writer(at(name), &s) : NULL;
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
            const vsh_result result = l == 0 ? write_in_pieces(writer, &s, 50)
                                             : vsh_image_write(at(name), &s.image, NULL, &failure);
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &old_limit), 0);
            assert_that(result == VSH_ERROR_WRITE, "%s at %llu bytes: %s", name,
                        (unsigned long long)limits[l], vsh_result_name(result));
            assert_untouched(at(name), entries);
        }
    }
    signal(SIGXFSZ, SIG_DFL);
}

/* --- images that cannot be written or read */

static void refused(const char *path, const vsh_image *image, int32_t bits, const char *pack, vsh_result code,
                    const char *named) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    assert_fails(vsh_image_check(path, image, &options, &failure), code, named);
    assert_fails(vsh_image_write(path, image, &options, &failure), code, named);
    assert_int_equal(failure.code, code);
}

TEST(bad_packs_are_refused_by_part) {
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    static const char *const cases[][2] = {
        {"R=shadow.moon", "shadow.moon"},
        {"R=ao,R=shadow.sun", "'R=shadow.sun'"},
        {"", "empty"},
        {"R=", "'R='"},
        {"R=ao,", "''"},
        {",R=ao", "''"},
        {"X=ao", "'X=ao'"},
        {"ao", "'ao'"},
        {"R", "'R'"},
        {"R=ao,G=2", "'G=2'"},
        {"R=ao,G=AO", "AO"},
        {"R=ao, G=A", "' G=A'"},
        {"R=10", "'R=10'"},
        {"r=ao", "'r=ao'"},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        refused(at("pack.png"), &s.image, 0, cases[i][0], VSH_ERROR_ARGUMENT, cases[i][1]);
        refused(at("pack.exr"), &s.image, 0, cases[i][0], VSH_ERROR_ARGUMENT, cases[i][1]);
    }

    assert_int_equal(access(at("pack.png"), F_OK), -1);
}

TEST(bits_and_channels_that_a_format_lacks_are_refused) {
    static const struct {
        const char *name;
        int32_t bits;
        const char *pack, *part;
    } cases[] = {
        {"x.png", 32, NULL, "8 16"},       {"x.jpg", 16, NULL, "16 bits"}, {"x.exr", 8, NULL, "16 32"},
        {"x.exr", -1, NULL, "-1"},         {"x.tif", 12, NULL, "12"},      {"x.xyz", 0, NULL, "xyz"},
        {"x.hdr", 16, NULL, "hdr has 32"}, {"x.pgm", 0, NULL, "pgm"},      {"x.jpg", 0, "R=ao,A=A", "alpha"},
        {"noending", 0, NULL, "noending"}, {"x.FITS", 0, NULL, "FITS"},
    };
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        refused(at(cases[i].name), &s.image, cases[i].bits, cases[i].pack, VSH_ERROR_ARGUMENT, cases[i].part);
    }
    refused("", &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "empty");
    s.image.width = 70000;
    s.image.height = 1;
    refused(at("x.jpg"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "65500");
}

TEST(bad_images_are_refused) {
    FREED_BY(unmake) sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    vsh_image bad = s.image;
    bad.width = 0;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "0 × 2");
    bad.width = 1 << 20;
    bad.height = 1 << 20;
    refused(at("x.tif"), &bad, 0, NULL, VSH_ERROR_LIMIT, "2^31");
    assert_fails(vsh_image_write(at("x.exr"), &bad, NULL, &failure), VSH_ERROR_LIMIT, "2^31"); /* whole */
    bad = s.image;
    bad.channel_count = 0;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "0 channels");
    bad.channel_count = VSH_MAX_CHANNELS + 1;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "257");
    refused(at("x.exr"), NULL, 0, NULL, VSH_ERROR_ARGUMENT, "no image");
    s.names[1] = "A";
    refused(at("x.exr"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "'A' is given twice");
    s.names[1] = "";
    refused(at("x.exr"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "no name");
    char name[129];
    memset(name, 'n', 128);
    name[128] = '\0';
    s.names[1] = name;
    refused(at("x.exr"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "127");
    s.names[1] = "ao";
    s.planes[1] = NULL;
    assert_fails(vsh_image_write(at("x.exr"), &s.image, NULL, &failure), VSH_ERROR_ARGUMENT, "'ao'");
    s.image.planes = NULL; /* enough for a check before the bake */
    assert_ok(vsh_image_check(at("x.exr"), &s.image, NULL, &failure));
}

TEST(cut_files_are_errors) {
    static const char *const names[] = {"c.exr", "c.png", "c.tif", "c.tga", "c.bmp", "c.hdr", "c.ppm"};
    FREED_BY(unmake) sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < COUNT_OF(names); ++n) {
        const char *path = at(names[n]);
        assert_ok(vsh_image_write(path, &s.image, NULL, &failure));
        FREED unsigned char *bytes = NULL;
        const size_t size = read_all(path, &bytes);
        /* what stands behind the pixels may be missing: PNG's last chunk, TGA's footer */
        const size_t trailer = strcmp(names[n], "c.exr") == 0 ? 0 : 600;
        for (size_t cut = 0; cut < size; cut += cut < 500 ? 1 : 37) {
            write_all(path, bytes, cut);
            vsh_image_file *file = NULL;
            const vsh_result result = vsh_image_read(path, NULL, &file, &failure);
            if (result == VSH_OK) {
                assert_that(cut + trailer >= size, "%s cut to %zu of %zu bytes was read", names[n], cut,
                            size);
                vsh_image_free(file);
                continue;
            }
            assert_true(result == VSH_ERROR_READ || result == VSH_ERROR_INPUT);
            assert_null(file);
            assert_null(strchr(failure.message, '\n'));
            assert_non_null(strstr(failure.message, names[n]));
        }
    }
}

TEST(unreadable_paths_are_read_errors) {
    static const struct {
        const char *name, *text;
        vsh_result code;
        const char *part;
    } cases[] = {{"nothing.exr", NULL, VSH_ERROR_READ, "nothing.exr"},
                 {".", NULL, VSH_ERROR_READ, ""},
                 {"empty.png", "", VSH_ERROR_READ, ""},
                 {"text.txt", "hello", VSH_ERROR_INPUT, "no image format that is read"},
                 {"x.iff", "hello", VSH_ERROR_INPUT, "no image format that is read"},
                 {"x.fits", "hello", VSH_ERROR_INPUT, "no image format that is read"}};
    vsh_image_file *file = NULL;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        if (cases[i].text != NULL) {
            write_string(at(cases[i].name), cases[i].text);
        }
        assert_fails(vsh_image_read(at(cases[i].name), NULL, &file, &failure), cases[i].code, cases[i].part);
        assert_null(file);
    }
    vsh_image_free(NULL);
}

TEST(the_memory_limit_holds_without_a_reader) {
    static const char *const names[] = {"m.exr", "m.png", "m.tif"};
    FREED_BY(unmake) sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < COUNT_OF(names); ++n) {
        assert_ok(vsh_image_write(at(names[n]), &s.image, NULL, &failure));
        OWNED(vsh_image_file) *file = image_from(at(names[n])), *again = NULL, *none = NULL;
        const vsh_image image = vsh_image_view(file);
        vsh_run run =
            run_within((uint64_t)(image.width * image.height * image.channel_count) * sizeof(float));
        assert_ok(vsh_image_read(at(names[n]), &run, &again, &failure));
        --run.memory_limit;
        assert_fails(vsh_image_read(at(names[n]), &run, &none, &failure), VSH_ERROR_LIMIT, names[n]);
        assert_null(none);
    }
}

TEST(a_written_file_follows_links_and_keeps_its_mode) {
    FREED_BY(unmake) sample s;
    make(&s, 3, 3, 3, LIGHTMAP);
    const char *target = at("target.exr");
    const char *link = at("link.exr");
    write_string(target, "old");
    assert_int_equal(chmod(target, 0640), 0);
    assert_int_equal(symlink("target.exr", link), 0);
    assert_int_equal(vsh_image_write(link, &s.image, NULL, NULL), VSH_OK);
    struct stat status;
    assert_int_equal(lstat(link, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    assert_int_equal(stat(target, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0640);
    assert_true(status.st_size > 3);
}

TEST(outputs_are_made_beside_the_target_and_keep_its_ending) {
    vshi_output first, second;
    const char *path = at("grid.v1.vdb");
    assert_ok(vshi_output_begin(&first, path, &failure));
    assert_ok(vshi_output_begin(&second, path, &failure));
    assert_string_not_equal(first.temporary, second.temporary);
    assert_memory_equal(first.temporary, folder, strlen(folder));
    assert_string_equal(vshi_path_ending(first.temporary), "vdb");
    vshi_output_abandon(&second);
    assert_int_equal(access(path, F_OK), -1);
    assert_ok(vshi_output_commit(&first, &failure));
    assert_int_equal(access(path, F_OK), 0);
    char longest[256]; /* name */
    memset(longest, 'n', 255);
    memcpy(longest + 251, ".exr", 5);
    assert_ok(vshi_output_begin(&first, at(longest), &failure));
    assert_ok(vshi_output_commit(&first, &failure));
    assert_string_equal(vshi_path_ending("a.b/c"), "");
    assert_string_equal(vshi_path_ending(".exr"), "");
    assert_string_equal(vshi_path_ending("a/b.c.EXR"), "EXR");
}

/* --- files that belong together */

enum { TOGETHER = 3 };

static const char *const together[TOGETHER] = {"one.bin", "two.png", "three.gltf"};

/* A folder appears in the place of each in turn. Nothing but a file can be replaced. */
TEST(one_that_fails_leaves_all_as_they_were) {
    const int before = entries_in_folder();
    for (size_t failing = 0; failing < TOGETHER; ++failing) {
        vshi_output outputs[TOGETHER], *list[TOGETHER];
        write_string(at(together[1]), "old");
        if (failing == 1) {
            unlink(at(together[1]));
        }
        for (size_t i = 0; i < TOGETHER; ++i) {
            assert_ok(vshi_output_begin(&outputs[i], at(together[i]), &failure));
            write_string(outputs[i].temporary, "new");
            list[i] = &outputs[i];
        }
        assert_int_equal(mkdir(at(together[failing]), 0777), 0);
        assert_fails(vshi_outputs_commit(list, TOGETHER, &failure), VSH_ERROR_WRITE, together[failing]);
        assert_non_null(strstr(failure.message, "could not be put in place"));
        assert_int_equal(rmdir(at(together[failing])), 0);
        for (size_t i = 0; i < TOGETHER; ++i) {
            if (i == 1 && failing != 1) {
                FREED unsigned char *found = NULL;
                read_all(at(together[i]), &found);
                assert_string_equal((char *)found, "old");
            } else {
                assert_int_equal(access(at(together[i]), F_OK), -1);
            }
        }
        unlink(at(together[1]));
        assert_int_equal(entries_in_folder(), before);
    }
}

static int remove_all(void **state) {
    char command[300];
    snprintf(command, sizeof command, "test -z \"$(find '%s' -name '*.tmp*')\"", folder);
    const int left = system(command); /* no temporary file may be left */
    return remove_folder(state) != 0 || left != 0;
}

FIXTURE(make_folder, remove_all)
