/* Images: what formats keep. test_image_errors.c has what is refused, and damaged files. */
#include "images.h"
#include "testing.h"

static int32_t channel_of(const vsh_image *image, const char *name) {
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], name) == 0) {
            return c;
        }
    }
    fail_msg("no channel '%s'", name);
    return -1;
}

static vsh_image_file *write_as(const char *path, const vsh_image *image, int32_t bits, int32_t space,
                                const char *pack) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    options.color_space = space;
    assert_ok(vsh_image_check(path, image, &options, &failure));
    assert_ok(vsh_image_write(path, image, &options, &failure));
    vsh_image_file *file = NULL;
    assert_ok(vsh_image_read(path, NULL, &file, &failure));
    return file;
}

static vsh_image_file *write_and_read(const char *path, const vsh_image *image, int32_t bits,
                                      const char *pack) {
    return write_as(path, image, bits, VSH_COLOR_AUTO, pack);
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
    assert_memory_equal(t->view.planes[channel_of(&t->view, name)], t->s.planes[channel],
                        t->texels * sizeof(float));
}

static double worst(const float *a, const float *b, size_t count) {
    double result = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const double difference = fabs((double)a[i] - (double)b[i]);
        result = difference > result || isnan(difference) ? difference : result;
    }
    return result;
}

TEST(exr_32_is_bit_exact) {
    static const int32_t sizes[][2] = {{37, 23}, {1, 1}, {1, 5000}, {5000, 1}, {16, 16}};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; ++k) {
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
            const double difference =
                worst(t.view.planes[channel_of(&t.view, names[c])], t.s.planes[c], t.texels);
            if (!(difference <= (bits == 16 ? 0x1p-12 : 0.0))) {
                fail_msg("%d × %d, %d channels of %d bits: off by %g", width, height, channels, bits,
                         difference);
            }
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

TEST(packs_name_the_channels_of_exr_which_may_have_commas_and_equals) {
    trip t;
    make(&t.s, 6, 20, 3, LIGHTMAP);
    send(&t, "packed.exr", 32, "G=ao,R=shadow.sun,A=1");
    assert_int_equal(t.view.channel_count, 3);
    assert_exact(&t, "R", 0);
    assert_exact(&t, "G", 1);
    for (size_t i = 0; i < t.texels; ++i) {
        assert_true(t.view.planes[channel_of(&t.view, "A")][i] == 1.0f);
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
        {"f.bmp", 8, 0.5 / 255, true},     {"f.ppm", 8, 0.5 / 255, false},   {"f.jp2", 8, 0.5 / 255, true},
        {"f.jp2", 16, 0.5 / 65535, true},  {"f.dpx", 8, 0.5 / 255, true},    {"f.dpx", 16, 0.5 / 65535, true},
        {"f.dpx", 32, 0.0, true},          {"f.hdr", 32, 1.0 / 128, false},  {"f.jpg", 8, 0.03, false},
        {"f.webp", 8, 0.06, false},        {"f.gif", 8, 0.3, false}, /* 256 colours */
    };
    FREED_BY(unmake) sample s;
    make(&s, 70, 90, 4, (const char *const[]){"shadow.sun", "ao", "shadow.lamp", "A"});
    for (int i = 0; i < 70 * 90; ++i) {
        s.values[3 * 70 * 90 + i] = (float)(i / 7 % 2); /* coverage */
    }
    for (size_t f = 0; f < sizeof formats / sizeof formats[0]; ++f) {
        OWNED(vsh_image_file) *file = write_and_read(at(formats[f].name), &s.image, formats[f].bits, NULL);
        const vsh_image view = vsh_image_view(file);
        assert_int_equal(view.width, 70);
        assert_int_equal(view.height, 90);
        assert_true(view.channel_count >= (formats[f].alpha ? 4 : 3));
        for (int32_t c = 0; c < (formats[f].alpha ? 4 : 3); ++c) {
            const double difference = worst(view.planes[c], s.planes[c], 70 * 90);
            if (!(difference <=
                  formats[f].tolerance * (1.0 + 1e-4) + (formats[f].tolerance > 0.0 ? 1e-7 : 0.0))) {
                fail_msg("%s at %d bits, channel %d: off by %g", formats[f].name, formats[f].bits, c,
                         difference);
            }
        }
    }
}

TEST(lossy_formats_keep_grey) {
    FREED_BY(unmake) sample s;
    make(&s, 70, 90, 2, (const char *const[]){"ao", "A"});
    static const char *const names[] = {"g.webp", "g.jpg"};
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        OWNED(vsh_image_file) *file = write_and_read(at(names[n]), &s.image, 0, NULL);
        const vsh_image view = vsh_image_view(file);
        for (int32_t c = 0; c < 3; ++c) {
            const double difference = worst(view.planes[c], s.planes[0], 70 * 90);
            if (!(difference < 0.02)) {
                fail_msg("%s, channel %d: off by %g", names[n], c, difference);
            }
        }
    }
}

TEST(packs_and_formats_choose_the_file_s_channels_and_bits) {
    static const struct {
        const char *name, *pack;
        int32_t bits, channels, from[3]; /* which plane each channel is, -1: zeros */
        double steps;
    } cases[] = {
        {"grey.pgm", NULL, 0, 1, {0}, 255},
        {"grey.pgm", "R=shadow.sun", 0, 1, {0}, 255},
        {"grey.pgm", "R=shadow.sun,G=shadow.sun,B=shadow.sun", 0, 1, {0}, 255},
        {"best.png", "R=shadow.sun,G=ao,B=A", 0, 3, {0, 1, 2}, 65535},
        {"best.tga", "R=shadow.sun,G=ao,B=A", 0, 3, {0, 1, 2}, 255},
        {"zero.png", "G=ao", 8, 3, {-1, 1, -1}, 255},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        FREED_BY(end) trip t;
        make(&t.s, 40, 30, 3, LIGHTMAP);
        float *const zeros = calloc(t.s.image.width * t.s.image.height, sizeof *zeros);
        send(&t, cases[i].name, cases[i].bits, cases[i].pack);
        assert_int_equal(t.view.channel_count, cases[i].channels);
        for (int32_t c = 0; c < cases[i].channels; ++c) {
            const int32_t from = cases[i].from[c];
            const double off = worst(t.view.planes[c], from < 0 ? zeros : t.s.planes[from], t.texels);
            assert_true(off <= (from < 0 ? 0.0 : 0.5001 / cases[i].steps));
        }
        free(zeros);
    }
}

TEST(default_pack_takes_the_first_three_and_coverage) {
    static const struct {
        int32_t count;
        const char *names[5];
        const char *text;
    } cases[] = {
        {3, {"shadow.sun", "ao", "A"}, "R=shadow.sun,G=ao,A=A"},
        {2, {"A", "ao"}, "R=ao,G=ao,B=ao,A=A"},
        {1, {"ao"}, "R=ao,G=ao,B=ao"},
        {1, {"A"}, "R=A,G=A,B=A,A=A"},
        {2, {NULL, "ao"}, "R=ao,G=ao,B=ao"},
        {5, {"a", "b", "c", "d", "A"}, "R=a,G=b,B=c,A=A"},
        {5,
         {"ao", "irradiance.R", "irradiance.G", "irradiance.B", "A"},
         "R=irradiance.R,G=irradiance.G,B=irradiance.B,A=A"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        const vsh_image image = {1, 1, cases[i].count, cases[i].names, NULL, NULL};
        char text[64];
        vsh_image_default_pack(&image, text, sizeof text);
        assert_string_equal(text, cases[i].text);
        char small[5] = "????";
        vsh_image_default_pack(&image, small, 4);
        assert_int_equal(strlen(small), 3);
        assert_memory_equal(small, cases[i].text, 3);
    }
}

/* --- color spaces: which values go through the sRGB curve, what the file says, what is cut */

static const char *const IRRADIANCE[] = {"shadow.sun", "irradiance.R", "irradiance.G", "irradiance.B", "A"};
static const int32_t HOLDS[] = {VSH_CHANNEL_DATA, VSH_CHANNEL_LIGHT, VSH_CHANNEL_LIGHT, VSH_CHANNEL_LIGHT,
                                VSH_CHANNEL_DATA};

TEST(floats_are_linear_and_bad_spaces_are_refused) {
    static const int32_t none[] = {0, 0, 3, 0, 0};
    FREED_BY(unmake) sample s;
    make(&s, 30, 20, 5, IRRADIANCE);
    s.image.holds = HOLDS;
    vsh_image_file *file = write_as(at("float.tif"), &s.image, 32, VSH_COLOR_AUTO, NULL);
    assert_memory_equal(vsh_image_view(file).planes[0], s.planes[1], 600 * sizeof(float));
    vsh_image_free(file);
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
    vsh_image_options options = vsh_image_options_default();
    options.pack = pack;
    vsh_image_writer *writer = NULL;
    assert_ok(vsh_image_writer_create(path, image, &options, &writer, &failure));
    assert_ok(vsh_image_writer_add(writer, image->height, image->planes, &failure));
    vsh_image_clipping clipping;
    assert_ok(vsh_image_writer_get_clipping(writer, &clipping, &failure));
    assert_ok(vsh_image_writer_finish(writer, &failure));
    return clipping;
}

TEST(light_over_1_is_counted_where_it_is_cut) {
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

FIXTURE(make_folder, remove_folder)
