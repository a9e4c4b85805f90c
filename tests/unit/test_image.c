/* Image files: what is written comes back, what cannot be written is refused by name, and nothing is left
 * half done. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <vdbshade/image.h>

#include "base/file.h"
#include "image/planes.h"

#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[256];

static const char *at(const char *name) {
    static char paths[4][512]; /* a few may be in use at a time */
    static int next = 0;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

/* An image with values of its own at every texel: between 0 and 1, not symmetric in x, y or the channel. */
enum { MOST = 8 };
typedef struct sample {
    vsh_image image;
    const char *names[MOST];
    const float *planes[MOST];
    float *values;
} sample;

static void make(sample *s, int32_t width, int32_t height, int32_t count, const char *const *names) {
    const size_t texels = (size_t)width * (size_t)height;
    s->values = malloc(texels * (size_t)count * sizeof(float));
    assert_non_null(s->values);
    for (int32_t c = 0; c < count; ++c) {
        s->names[c] = names[c];
        s->planes[c] = s->values + (size_t)c * texels;
        for (size_t i = 0; i < texels; ++i) {
            const double x = (double)(i % (size_t)width) / width;
            const double y = (double)(i / (size_t)width) / height;
            s->values[(size_t)c * texels + i] = (float)(0.5 + 0.5 * sin(7.0 * x + 3.1 * y * (c + 1) + c));
        }
    }
    s->image = (vsh_image){width, height, count, s->names, s->planes};
}

static void unmake(sample *s) {
    free(s->values);
}

static const char *const LIGHTMAP[] = {"shadow.sun", "ao", "A"};

static int32_t channel_of(const vsh_image *image, const char *name) {
    for (int32_t c = 0; c < image->channel_count; ++c) {
        if (strcmp(image->names[c], name) == 0) {
            return c;
        }
    }
    fail_msg("no channel '%s'", name);
    return -1;
}

static void assert_ok(vsh_result result, const vsh_error *error) {
    if (result != VSH_OK) {
        fail_msg("%s: %s", vsh_result_name(result), error->message);
    }
}

static size_t read_all(const char *path, unsigned char **bytes) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    const size_t size = (size_t)ftell(file);
    rewind(file);
    *bytes = malloc(size + 1);
    assert_non_null(*bytes);
    assert_int_equal(fread(*bytes, 1, size, file), size);
    fclose(file);
    return size;
}

static void write_all(const char *path, const unsigned char *bytes, size_t size) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static vsh_image_file *write_and_read(const char *path, const vsh_image *image, int32_t bits,
                                      const char *pack) {
    vsh_error error = {0};
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    assert_ok(vsh_image_check(path, image, &options, &error), &error);
    assert_ok(vsh_image_write(path, image, &options, &error), &error);
    vsh_image_file *file = NULL;
    assert_ok(vsh_image_read(path, &file, &error), &error);
    return file;
}

static double worst(const float *a, const float *b, size_t count) {
    double result = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const double difference = fabs((double)a[i] - (double)b[i]);
        result = difference > result || isnan(difference) ? difference : result;
    }
    return result;
}

static int entries_in_folder(void) {
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    int count = 0;
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    }
    closedir(directory);
    return count;
}

static void exr_32_is_bit_exact(void **state) {
    (void)state;
    static const int32_t sizes[][2] = {{37, 23}, {1, 1}, {1, 5000}, {5000, 1}, {16, 16}};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; ++k) {
        sample s;
        make(&s, sizes[k][0], sizes[k][1], 3, LIGHTMAP);
        s.values[0] = NAN;
        vsh_image_file *file = write_and_read(at("exact.exr"), &s.image, 0, NULL);
        const vsh_image view = vsh_image_view(file);
        assert_int_equal(view.width, sizes[k][0]);
        assert_int_equal(view.height, sizes[k][1]);
        assert_int_equal(view.channel_count, 3);
        for (int32_t c = 0; c < 3; ++c) {
            const size_t bytes = (size_t)view.width * (size_t)view.height * sizeof(float);
            assert_memory_equal(view.planes[channel_of(&view, LIGHTMAP[c])], s.planes[c], bytes);
        }
        vsh_image_free(file);
        unmake(&s);
    }
}

static void exr_channels_come_back_sorted_by_name(void **state) {
    (void)state;
    sample s;
    make(&s, 5, 4, 3, LIGHTMAP);
    vsh_image_file *file = write_and_read(at("sorted.exr"), &s.image, 32, NULL);
    const vsh_image view = vsh_image_view(file);
    assert_string_equal(view.names[0], "A");
    assert_string_equal(view.names[1], "ao");
    assert_string_equal(view.names[2], "shadow.sun");
    vsh_image_free(file);
    unmake(&s);
}

static void exr_keeps_names_of_127_bytes(void **state) {
    (void)state;
    char a[128];
    char b[128];
    memset(a, 'n', 127);
    memset(b, 'n', 127);
    a[127] = b[127] = '\0';
    b[126] = 'm';
    const char *const names[] = {a, b};
    sample s;
    make(&s, 9, 40, 2, names);
    vsh_image_file *file = write_and_read(at("long.exr"), &s.image, 32, NULL);
    const vsh_image view = vsh_image_view(file);
    for (int32_t c = 0; c < 2; ++c) {
        assert_memory_equal(view.planes[channel_of(&view, names[c])], s.planes[c], 9 * 40 * sizeof(float));
    }
    vsh_image_free(file);
    unmake(&s);
}

static void exr_16_is_right_to_half_precision(void **state) {
    (void)state;
    sample s;
    make(&s, 61, 50, 3, LIGHTMAP);
    vsh_image_file *file = write_and_read(at("half.exr"), &s.image, 16, NULL);
    const vsh_image view = vsh_image_view(file);
    double most = 0.0;
    for (int32_t c = 0; c < 3; ++c) {
        const double difference = worst(view.planes[channel_of(&view, LIGHTMAP[c])], s.planes[c], 61 * 50);
        most = difference > most ? difference : most;
    }
    assert_true(most <= 0x1p-12); /* half has 11 bits: half a step below 1 is 2^-12 */
    assert_true(most > 0x1p-16);  /* and it was half, not float */
    vsh_image_free(file);
    unmake(&s);
}

static void exr_writes_the_packed_names_when_packed(void **state) {
    (void)state;
    sample s;
    make(&s, 6, 20, 3, LIGHTMAP);
    vsh_image_file *file = write_and_read(at("packed.exr"), &s.image, 32, "G=ao,R=shadow.sun,A=1");
    const vsh_image view = vsh_image_view(file);
    assert_int_equal(view.channel_count, 3);
    assert_memory_equal(view.planes[channel_of(&view, "R")], s.planes[0], 6 * 20 * sizeof(float));
    assert_memory_equal(view.planes[channel_of(&view, "G")], s.planes[1], 6 * 20 * sizeof(float));
    for (int i = 0; i < 6 * 20; ++i) {
        assert_true(view.planes[channel_of(&view, "A")][i] == 1.0f);
    }
    vsh_image_free(file);
    unmake(&s);
}

/* Every format: the file's R, G and B are the channels asked for, also where A is 0. */
static void every_format_keeps_values_to_half_a_step(void **state) {
    (void)state;
    static const struct {
        const char *name;
        int32_t bits;
        double tolerance;
        bool alpha;
    } formats[] = {
        {"f.png", 8, 0.5 / 255, true}, {"f.png", 16, 0.5 / 65535, true},
        {"f.TIF", 8, 0.5 / 255, true}, {"f.tiff", 16, 0.5 / 65535, true},
        {"f.tif", 32, 0.0, true},      {"f.tga", 8, 0.5 / 255, true},
        {"f.bmp", 8, 0.5 / 255, true}, {"f.ppm", 8, 0.5 / 255, false},
        {"f.jp2", 8, 0.5 / 255, true}, {"f.jp2", 16, 0.5 / 65535, true},
        {"f.dpx", 8, 0.5 / 255, true}, {"f.dpx", 16, 0.5 / 65535, true},
        {"f.dpx", 32, 0.0, true},      {"f.hdr", 32, 1.0 / 128, false},
        {"f.jpg", 8, 0.03, false},     {"f.webp", 8, 0.06, false},
        {"f.gif", 8, 0.3, false}, /* 256 colours */
        {"f.sgi", 8, 0.5 / 255, true}, {"f.rgb", 16, 0.5 / 65535, true},
        {"f.rla", 32, 0.0, true},      {"f.ico", 8, 0.5 / 255, true},
        {"f.heic", 8, 0.15, true},     {"f.avif", 8, 0.15, true}, /* colours at half the resolution */
    };
    sample s;
    make(&s, 70, 90, 4, (const char *const[]){"shadow.sun", "ao", "shadow.lamp", "A"});
    for (int i = 0; i < 70 * 90; ++i) {
        s.values[3 * 70 * 90 + i] = (float)(i / 7 % 2); /* coverage */
    }
    for (size_t f = 0; f < sizeof formats / sizeof formats[0]; ++f) {
        vsh_image_file *file = write_and_read(at(formats[f].name), &s.image, formats[f].bits, NULL);
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
        vsh_image_free(file);
    }
    unmake(&s);
}

static uint32_t big_endian(const unsigned char *bytes, int size) {
    uint32_t value = 0;
    for (int i = 0; i < size; ++i) {
        value = value << 8 | bytes[i];
    }
    return value;
}

/* A tile's bytes, plane by plane or packed into runs, to A, B, G, R of each pixel. */
static void unpack_iff_tile(const unsigned char *from, size_t size, size_t pixels, unsigned char *to) {
    if (size == 4 * pixels) {
        memcpy(to, from, size);
        return;
    }
    const unsigned char *end = from + size;
    size_t done = 0;
    while (done < 4 * pixels) {
        assert_true(from + 1 < end);
        const bool run = (*from & 0x80) != 0;
        const size_t count = (size_t)(*from++ & 0x7f) + 1;
        assert_true(done % pixels + count <= pixels); /* runs end with their plane */
        for (size_t i = 0; i < count; ++i, ++done) {
            to[done % pixels * 4 + done / pixels] = *from;
            from += run ? 0 : 1;
        }
        from += run ? 1 : 0;
    }
    assert_true(end - from < 4); /* filled up to whole words */
}

/* Maya's IFF, which the library does not read: FOR4 CIMG { TBHD, FOR4 TBMP { RGBA … } }, tiles from the
 * bottom up, of 8 bits with alpha. */
static vsh_image_file *write_and_read_iff(const char *path, const vsh_image *image, const char *pack) {
    vsh_error error = {0};
    vsh_image_options options = vsh_image_options_default();
    options.pack = pack;
    assert_ok(vsh_image_write(path, image, &options, &error), &error);
    unsigned char *bytes, *tile = malloc(4 * 64 * 64);
    const size_t size = read_all(path, &bytes);
    assert_memory_equal(bytes, "FOR4", 4);
    assert_int_equal(big_endian(bytes + 4, 4), size - 8);
    assert_memory_equal(bytes + 8, "CIMGTBHD", 8);
    vsh_image_file *file;
    assert_ok(
        vshi_image_file_new(path, big_endian(bytes + 20, 4), big_endian(bytes + 24, 4), 4, &file, &error),
        &error);
    const size_t header = 20 + big_endian(bytes + 16, 4), tiles = big_endian(bytes + 38, 2);
    assert_memory_equal(bytes + header, "FOR4", 4);
    assert_memory_equal(bytes + header + 8, "TBMP", 4);
    assert_int_equal(big_endian(bytes + header + 4, 4), size - header - 8);
    const unsigned char *at_tile = bytes + header + 12;
    for (size_t t = 0; t < tiles; ++t) {
        assert_memory_equal(at_tile, "RGBA", 4);
        const uint32_t length = big_endian(at_tile + 4, 4), x = big_endian(at_tile + 8, 2),
                       y = big_endian(at_tile + 10, 2), width = big_endian(at_tile + 12, 2) - x + 1,
                       height = big_endian(at_tile + 14, 2) - y + 1;
        unpack_iff_tile(at_tile + 16, length - 8, (size_t)width * height, tile);
        for (uint32_t i = 0; i < width * height; ++i) {
            const size_t row = (size_t)file->height - 1 - (y + i / width);
            for (size_t c = 0; c < 4; ++c) {
                file->values[(c * (size_t)file->height + row) * (size_t)file->width + x + i % width] =
                    (float)tile[4 * i + 3 - c] / 255.0f;
            }
        }
        at_tile += 8 + (length + 3) / 4 * 4;
    }
    assert_ptr_equal(at_tile, bytes + size);
    free(tile);
    free(bytes);
    return file;
}

/* Sizes at which tiles, rows of whole words and runs of equal values end in every way; values that pack well
 * and values that do not. */
static void formats_of_their_own_writers_keep_every_size(void **state) {
    (void)state;
    static const char *const names[] = {"o.sgi", "o.rla", "o.ico", "o.iff"};
    static const int32_t sizes[][2] = {{1, 1}, {1, 7}, {3, 5}, {8, 1}, {64, 64}, {65, 130}, {255, 254}};
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; ++k) {
        sample s;
        make(&s, sizes[k][0], sizes[k][1], 4, (const char *const[]){"a", "b", "c", "A"});
        const size_t texels = (size_t)sizes[k][0] * (size_t)sizes[k][1];
        for (size_t pass = 0; pass < 3; ++pass) {
            uint32_t seed = 7;
            for (size_t i = 0; i < 4 * texels && pass > 0; ++i) {
                seed = seed * 1664525u + 1013904223u;
                s.values[i] = (float)(seed >> 24) / 255.0f;
                s.values[i] = pass == 1 ? s.values[i] : (float)(i / 5 % 3 == 0);
            }
            for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
                for (int alpha = 0; alpha < 2; ++alpha) {
                    const char *pack = alpha ? NULL : "R=a,G=b,B=c";
                    vsh_image_file *file = strcmp(names[n], "o.iff") == 0
                                               ? write_and_read_iff(at(names[n]), &s.image, pack)
                                               : write_and_read(at(names[n]), &s.image, 0, pack);
                    const vsh_image view = vsh_image_view(file);
                    assert_int_equal(view.width, sizes[k][0]);
                    assert_int_equal(view.height, sizes[k][1]);
                    for (int32_t c = 0; c < 3 + alpha; ++c) {
                        if (!(worst(view.planes[c], s.planes[c], texels) < 0.501 / 255)) {
                            fail_msg("%s, %d × %d, pass %zu, channel %d", names[n], view.width, view.height,
                                     pass, c);
                        }
                    }
                    for (size_t i = 0; i < texels && !alpha && view.channel_count == 4; ++i) {
                        assert_true(view.planes[3][i] == 1.0f);
                    }
                    vsh_image_free(file);
                }
            }
        }
        unmake(&s);
    }
}

static void lossy_formats_keep_grey(void **state) {
    (void)state;
    sample s;
    make(&s, 70, 90, 2, (const char *const[]){"ao", "A"});
    static const char *const names[] = {"g.heic", "g.avif", "g.webp", "g.jpg"};
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        vsh_image_file *file = write_and_read(at(names[n]), &s.image, 0, NULL);
        const vsh_image view = vsh_image_view(file);
        for (int32_t c = 0; c < 3; ++c) {
            const double difference = worst(view.planes[c], s.planes[0], 70 * 90);
            if (!(difference < 0.02)) {
                fail_msg("%s, channel %d: off by %g", names[n], c, difference);
            }
        }
        assert_true(view.channel_count == 3 || worst(view.planes[3], s.planes[1], 70 * 90) < 0.501 / 255);
        vsh_image_free(file);
    }
    unmake(&s);
}

static void icons_of_fewer_bits_are_not_given_to_their_reader(void **state) {
    (void)state;
    sample s;
    make(&s, 5, 5, 3, LIGHTMAP);
    vsh_error error = {0};
    assert_ok(vsh_image_write(at("icon.ico"), &s.image, NULL, &error), &error);
    unsigned char *bytes;
    const size_t size = read_all(at("icon.ico"), &bytes);
    bytes[22 + 14] = 24;
    write_all(at("icon.ico"), bytes, size);
    vsh_image_file *file = NULL;
    assert_int_equal(vsh_image_read(at("icon.ico"), &file, &error), VSH_ERROR_UNSUPPORTED);
    assert_non_null(strstr(error.message, "32 bits"));
    free(bytes);
    unmake(&s);
}

static void pgm_is_grey(void **state) {
    (void)state;
    sample s;
    make(&s, 9, 7, 3, LIGHTMAP);
    static const char *const packs[] = {NULL, "R=shadow.sun", "R=shadow.sun,G=shadow.sun,B=shadow.sun"};
    for (size_t i = 0; i < sizeof packs / sizeof packs[0]; ++i) {
        vsh_image_file *file = write_and_read(at("grey.pgm"), &s.image, 0, packs[i]);
        const vsh_image view = vsh_image_view(file);
        assert_int_equal(view.channel_count, 1);
        assert_true(worst(view.planes[0], s.planes[0], 63) < 0.501 / 255);
        vsh_image_free(file);
    }
    unmake(&s);
}

static void integers_clamp_and_turn_nan_to_0(void **state) {
    (void)state;
    const float values[6] = {NAN, -1.0f, 2.0f, INFINITY, -INFINITY, 0.5f};
    const float expected[6] = {0.0f, 0.0f, 1.0f, 1.0f, 0.0f, 0.5f};
    const char *const name = "ao";
    const float *const plane = values;
    const vsh_image image = {3, 2, 1, &name, &plane};
    vsh_image_file *file = write_and_read(at("clamp.png"), &image, 16, NULL);
    const vsh_image view = vsh_image_view(file);
    assert_int_equal(view.channel_count, 3); /* one channel is grey: the same in R, G and B */
    for (int32_t c = 0; c < 3; ++c) {
        assert_true(worst(view.planes[c], expected, 6) <= 0.5001 / 65535);
    }
    vsh_image_free(file);
}

static void default_bits_are_the_formats_best(void **state) {
    (void)state;
    sample s;
    make(&s, 40, 30, 3, LIGHTMAP);
    vsh_image_file *file = write_and_read(at("bits.png"), &s.image, 0, NULL);
    const double difference = worst(vsh_image_view(file).planes[0], s.planes[0], 40 * 30);
    assert_true(difference <= 0.5001 / 65535);
    vsh_image_free(file);
    file = write_and_read(at("bits.tga"), &s.image, 0, NULL);
    assert_true(worst(vsh_image_view(file).planes[0], s.planes[0], 40 * 30) <= 0.5001 / 255);
    vsh_image_free(file);
    unmake(&s);
}

static void colours_that_are_not_given_are_0(void **state) {
    (void)state;
    sample s;
    make(&s, 4, 4, 3, LIGHTMAP);
    vsh_image_file *file = write_and_read(at("zero.png"), &s.image, 8, "G=ao");
    const vsh_image view = vsh_image_view(file);
    assert_int_equal(view.channel_count, 3);
    for (int i = 0; i < 16; ++i) {
        assert_true(view.planes[0][i] == 0.0f && view.planes[2][i] == 0.0f);
    }
    assert_true(worst(view.planes[1], s.planes[1], 16) <= 0.5001 / 255);
    vsh_image_free(file);
    unmake(&s);
}

static void default_pack_takes_the_first_three_and_coverage(void **state) {
    (void)state;
    static const struct {
        int32_t count;
        const char *names[5];
        const char *text;
    } cases[] = {
        {3, {"shadow.sun", "ao", "A"}, "R=shadow.sun,G=ao,A=A"},
        {2, {"A", "ao"}, "R=ao,G=ao,B=ao,A=A"},
        {1, {"ao"}, "R=ao,G=ao,B=ao"},
        {1, {"A"}, "R=A,G=A,B=A,A=A"},
        {5, {"a", "b", "c", "d", "A"}, "R=a,G=b,B=c,A=A"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        const vsh_image image = {1, 1, cases[i].count, cases[i].names, NULL};
        char text[64];
        vsh_image_default_pack(&image, text, sizeof text);
        assert_string_equal(text, cases[i].text);
        char small[5] = "????";
        vsh_image_default_pack(&image, small, 4);
        assert_int_equal(strlen(small), 3);
        assert_memory_equal(small, cases[i].text, 3);
    }
}

static void channel_names_may_have_commas_and_equals(void **state) {
    (void)state;
    sample s;
    make(&s, 3, 3, 3, (const char *const[]){"shadow.a", "shadow.a,b=c", "1"});
    vsh_image_file *file = write_and_read(at("comma.exr"), &s.image, 32, "R=shadow.a,b=c,G=1,B=shadow.a");
    const vsh_image view = vsh_image_view(file);
    assert_memory_equal(view.planes[channel_of(&view, "R")], s.planes[1], 9 * sizeof(float));
    assert_memory_equal(view.planes[channel_of(&view, "G")], s.planes[2], 9 * sizeof(float));
    assert_memory_equal(view.planes[channel_of(&view, "B")], s.planes[0], 9 * sizeof(float));
    vsh_image_free(file);
    unmake(&s);
}

static void refused(const char *path, const vsh_image *image, int32_t bits, const char *pack, vsh_result code,
                    const char *named) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    for (int write = 0; write < 2; ++write) {
        vsh_error error = {0};
        const vsh_result result = write ? vsh_image_write(path, image, &options, &error)
                                        : vsh_image_check(path, image, &options, &error);
        if (result != code || error.code != code || strstr(error.message, named) == NULL) {
            fail_msg("%s, pack '%s', %d bits: %s '%s', expected %s with '%s'", path, pack != NULL ? pack : "",
                     bits, vsh_result_name(result), error.message, vsh_result_name(code), named);
        }
    }
}

static void bad_packs_are_refused_by_part(void **state) {
    (void)state;
    sample s;
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
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        refused(at("pack.png"), &s.image, 0, cases[i][0], VSH_ERROR_ARGUMENT, cases[i][1]);
        refused(at("pack.exr"), &s.image, 0, cases[i][0], VSH_ERROR_ARGUMENT, cases[i][1]);
    }
    refused(at("pack.jpg"), &s.image, 0, "R=ao,A=A", VSH_ERROR_ARGUMENT, "alpha");
    assert_int_equal(access(at("pack.png"), F_OK), -1);
    unmake(&s);
}

static void what_a_format_lacks_is_refused(void **state) {
    (void)state;
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    refused(at("x.png"), &s.image, 32, NULL, VSH_ERROR_ARGUMENT, "8 16");
    refused(at("x.jpg"), &s.image, 16, NULL, VSH_ERROR_ARGUMENT, "16 bits");
    refused(at("x.exr"), &s.image, 8, NULL, VSH_ERROR_ARGUMENT, "16 32");
    refused(at("x.exr"), &s.image, -1, NULL, VSH_ERROR_ARGUMENT, "-1");
    refused(at("x.tif"), &s.image, 12, NULL, VSH_ERROR_ARGUMENT, "12");
    refused(at("x.xyz"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "xyz");
    static const char *const never[] = {"x.pfm", "x.fits", "x.pbm",  "x.zfile", "x.heics",
                                        "x.sxr", "x.null", "x.term", "x.FITS",  "x.j2c"};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; ++i) {
        refused(at(never[i]), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "is not written: ");
    }
    refused(at("x.rla"), &s.image, 16, NULL, VSH_ERROR_ARGUMENT, "rla has 32");
    refused(at("x.iff"), &s.image, 16, NULL, VSH_ERROR_ARGUMENT, "iff has 8");
    refused(at("x.pgm"), &s.image, 0, "R=ao,G=A", VSH_ERROR_ARGUMENT, "grey");
    refused(at("x.pgm"), &s.image, 0, "G=ao", VSH_ERROR_ARGUMENT, "grey");
    refused(at("x.pgm"), &s.image, 0, "R=ao,A=1", VSH_ERROR_ARGUMENT, "alpha");
    refused(at("noending"), &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "noending");
    refused("", &s.image, 0, NULL, VSH_ERROR_ARGUMENT, "empty");
    vsh_image wide = s.image;
    wide.width = 70000;
    wide.height = 1;
    refused(at("x.jpg"), &wide, 0, NULL, VSH_ERROR_ARGUMENT, "65500");
    refused(at("x.ico"), &wide, 0, NULL, VSH_ERROR_ARGUMENT, "255");
    unmake(&s);
}

static void bad_images_are_refused(void **state) {
    (void)state;
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    vsh_image bad = s.image;
    bad.width = 0;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_ARGUMENT, "0 × 2");
    bad.width = 1 << 20;
    bad.height = 1 << 20;
    refused(at("x.exr"), &bad, 0, NULL, VSH_ERROR_LIMIT, "2^31");
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
    vsh_error error = {0};
    assert_int_equal(vsh_image_write(at("x.exr"), &s.image, NULL, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(strstr(error.message, "'ao'"));
    s.image.planes = NULL; /* enough for a check before the bake */
    assert_int_equal(vsh_image_check(at("x.exr"), &s.image, NULL, &error), VSH_OK);
    unmake(&s);
}

static void places_that_cannot_be_written_are_refused(void **state) {
    (void)state;
    sample s;
    make(&s, 2, 2, 3, LIGHTMAP);
    char path[600];
    snprintf(path, sizeof path, "%s/missing/x.exr", folder);
    refused(path, &s.image, 0, NULL, VSH_ERROR_WRITE, "missing");
    snprintf(path, sizeof path, "%s/folder.exr", folder);
    assert_int_equal(mkdir(path, 0777), 0);
    refused(path, &s.image, 0, NULL, VSH_ERROR_WRITE, "is a folder");
    assert_int_equal(rmdir(path), 0);
    snprintf(path, sizeof path, "%s/fifo.png", folder);
    assert_int_equal(mkfifo(path, 0666), 0);
    refused(path, &s.image, 0, NULL, VSH_ERROR_WRITE, "regular");
    assert_int_equal(unlink(path), 0);
    unmake(&s);
}

/* The limit on a file's size stands for a full disk: at the first byte, in the middle, at the very last one.
 */
static void a_full_disk_leaves_the_old_file_and_nothing_else(void **state) {
    (void)state;
    static const char *const names[] = {"d.exr", "d.png", "d.tif",  "d.jpg",  "d.tga", "d.bmp", "d.hdr",
                                        "d.ppm", "d.pgm", "d.webp", "d.jp2",  "d.dpx", "d.gif", "d.sgi",
                                        "d.iff", "d.rla", "d.ico",  "d.heic", "d.avif"};
    signal(SIGXFSZ, SIG_IGN);
    struct rlimit old_limit;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &old_limit), 0);
    sample s;
    make(&s, 200, 180, 3, LIGHTMAP);
    const unsigned char old[] = "the old content";
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        vsh_error error = {0};
        assert_ok(vsh_image_write(path, &s.image, NULL, &error), &error);
        struct stat status;
        assert_int_equal(stat(path, &status), 0);
        const rlim_t limits[] = {0, 100, (rlim_t)status.st_size / 2, (rlim_t)status.st_size - 1};
        write_all(path, old, sizeof old);
        const int entries = entries_in_folder();
        for (size_t l = 0; l < sizeof limits / sizeof limits[0]; ++l) {
            const struct rlimit limit = {limits[l], old_limit.rlim_max};
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
            const vsh_result result = vsh_image_write(path, &s.image, NULL, &error);
            assert_int_equal(setrlimit(RLIMIT_FSIZE, &old_limit), 0);
            if (result != VSH_ERROR_WRITE) {
                fail_msg("%s at %llu of %llu bytes: %s", names[n], (unsigned long long)limits[l],
                         (unsigned long long)status.st_size, vsh_result_name(result));
            }
            unsigned char *bytes;
            assert_int_equal(read_all(path, &bytes), sizeof old);
            assert_memory_equal(bytes, old, sizeof old);
            free(bytes);
            assert_int_equal(entries_in_folder(), entries);
        }
        unlink(path);
    }
    signal(SIGXFSZ, SIG_DFL);
    unmake(&s);
}

static void the_same_image_is_the_same_bytes_later(void **state) {
    (void)state;
    static const char *const names[] = {"t.exr", "t.png", "t.tif",  "t.jpg",  "t.tga", "t.bmp", "t.hdr",
                                        "t.ppm", "t.pgm", "t.webp", "t.jp2",  "t.dpx", "t.gif", "t.sgi",
                                        "t.iff", "t.rla", "t.ico",  "t.heic", "t.avif"};
    enum { COUNT = sizeof names / sizeof names[0] };
    unsigned char *bytes[COUNT];
    size_t sizes[COUNT];
    sample s;
    make(&s, 64, 50, 3, LIGHTMAP);
    for (int pass = 0; pass < 2; ++pass) {
        for (size_t n = 0; n < COUNT; ++n) {
            vsh_error error = {0};
            assert_ok(vsh_image_write(at(names[n]), &s.image, NULL, &error), &error);
            if (pass == 0) {
                sizes[n] = read_all(at(names[n]), &bytes[n]);
                continue;
            }
            unsigned char *again;
            const size_t size = read_all(at(names[n]), &again);
            if (size != sizes[n] || memcmp(again, bytes[n], size) != 0) {
                fail_msg("%s differs", names[n]);
            }
            free(again);
            free(bytes[n]);
        }
        if (pass == 0) {
            sleep(1); /* what some formats note by the second */
        }
    }
    unmake(&s);
}

static void cut_files_are_errors(void **state) {
    (void)state;
    static const char *const names[] = {"c.exr", "c.png", "c.tif", "c.tga", "c.bmp", "c.hdr",
                                        "c.ppm", "c.dpx", "c.sgi", "c.rla", "c.ico"};
    sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        vsh_error error = {0};
        assert_ok(vsh_image_write(path, &s.image, NULL, &error), &error);
        unsigned char *bytes;
        const size_t size = read_all(path, &bytes);
        /* what stands behind the pixels may be missing: PNG's last chunk, TGA's footer */
        const size_t trailer = strcmp(names[n], "c.exr") == 0 ? 0 : 600;
        size_t errors = 0;
        for (size_t cut = 0; cut < size; cut += cut < 500 ? 1 : 37) {
            write_all(path, bytes, cut);
            vsh_image_file *file = NULL;
            const vsh_result result = vsh_image_read(path, &file, &error);
            if (result == VSH_OK) {
                if (cut + trailer < size) {
                    fail_msg("%s cut to %zu of %zu bytes was read", names[n], cut, size);
                }
                vsh_image_free(file);
            } else {
                ++errors;
                assert_true(result == VSH_ERROR_READ || result == VSH_ERROR_INPUT);
                assert_null(file);
                assert_null(strchr(error.message, '\n'));
                assert_non_null(strstr(error.message, names[n]));
            }
        }
        assert_true(errors > 0);
        free(bytes);
    }
    unmake(&s);
}

static void damaged_files_do_no_harm(void **state) {
    (void)state;
    static const char *const names[] = {"b.exr", "b.png", "b.tif", "b.jpg", "b.tga",
                                        "b.bmp", "b.sgi", "b.rla", "b.ico"};
    sample s;
    make(&s, 33, 40, 3, LIGHTMAP);
    uint32_t seed = 1;
    for (size_t n = 0; n < sizeof names / sizeof names[0]; ++n) {
        const char *path = at(names[n]);
        vsh_error error = {0};
        assert_ok(vsh_image_write(path, &s.image, NULL, &error), &error);
        unsigned char *bytes;
        const size_t size = read_all(path, &bytes);
        for (int trial = 0; trial < 150; ++trial) {
            /* headers get half of the damage */
            seed = seed * 1664525u + 1013904223u;
            const size_t place = (seed >> 8) % (trial % 2 == 0 && size > 400 ? 400 : size);
            const unsigned char old = bytes[place];
            seed = seed * 1664525u + 1013904223u;
            bytes[place] = (unsigned char)(seed >> 24);
            write_all(path, bytes, size);
            bytes[place] = old;
            vsh_image_file *file = NULL;
            const vsh_result result = vsh_image_read(path, &file, &error);
            assert_true((result == VSH_OK) == (file != NULL));
            vsh_image_free(file);
        }
        free(bytes);
    }
    unmake(&s);
}

static void unreadable_paths_are_read_errors(void **state) {
    (void)state;
    vsh_error error = {0};
    vsh_image_file *file = NULL;
    assert_int_equal(vsh_image_read(at("nothing.exr"), &file, &error), VSH_ERROR_READ);
    assert_non_null(strstr(error.message, "nothing.exr"));
    assert_int_equal(vsh_image_read(folder, &file, &error), VSH_ERROR_READ);
    write_all(at("empty.png"), (const unsigned char *)"", 0);
    assert_int_equal(vsh_image_read(at("empty.png"), &file, &error), VSH_ERROR_INPUT);
    static const char *const never[] = {"text.txt", "x.iff", "x.fits"};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; ++i) {
        write_all(at(never[i]), (const unsigned char *)"hello", 5);
        assert_int_equal(vsh_image_read(at(never[i]), &file, &error), VSH_ERROR_INPUT);
        assert_non_null(strstr(error.message, "no image format that is read"));
    }
    assert_null(file);
    vsh_image_free(NULL);
}

static void a_written_file_follows_links_and_keeps_its_mode(void **state) {
    (void)state;
    sample s;
    make(&s, 3, 3, 3, LIGHTMAP);
    const char *target = at("target.exr");
    const char *link = at("link.exr");
    write_all(target, (const unsigned char *)"old", 3);
    assert_int_equal(chmod(target, 0640), 0);
    assert_int_equal(symlink("target.exr", link), 0);
    assert_int_equal(vsh_image_write(link, &s.image, NULL, NULL), VSH_OK);
    struct stat status;
    assert_int_equal(lstat(link, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    assert_int_equal(stat(target, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0640);
    assert_true(status.st_size > 3);
    unmake(&s);
}

static void outputs_are_made_beside_the_target_and_keep_its_ending(void **state) {
    (void)state;
    vshi_output first;
    vshi_output second;
    vsh_error error = {0};
    const char *path = at("grid.v1.vdb");
    assert_ok(vshi_output_begin(&first, path, &error), &error);
    assert_ok(vshi_output_begin(&second, path, &error), &error);
    assert_string_not_equal(first.temporary, second.temporary);
    assert_memory_equal(first.temporary, folder, strlen(folder));
    assert_string_equal(vshi_path_ending(first.temporary), "vdb");
    assert_int_equal(access(path, F_OK), -1);
    vshi_output_abandon(&second);
    assert_null(second.temporary);
    assert_ok(vshi_output_commit(&first, &error), &error);
    assert_int_equal(access(path, F_OK), 0);
    vshi_output_abandon(&first); /* nothing is left to do */
    char name[256];
    memset(name, 'n', 255);
    memcpy(name + 251, ".exr", 5);
    assert_ok(vshi_output_begin(&first, at(name), &error), &error); /* the longest name there is */
    assert_ok(vshi_output_commit(&first, &error), &error);
    assert_string_equal(vshi_path_ending("a.b/c"), "");
    assert_string_equal(vshi_path_ending(".exr"), "");
    assert_string_equal(vshi_path_ending("a/b.c.EXR"), "EXR");
}

static void no_temporary_is_left(void **state) {
    (void)state;
    DIR *directory = opendir(folder);
    assert_non_null(directory);
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        assert_null(strstr(entry->d_name, ".tmp"));
    }
    closedir(directory);
}

static int make_folder(void **state) {
    (void)state;
    const char *place = getenv("TMPDIR");
    snprintf(folder, sizeof folder, "%s/vdbshade-image-XXXXXX", place != NULL ? place : "/tmp");
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state) {
    (void)state;
    if (getenv("VSH_KEEP") != NULL) {
        return 0;
    }
    DIR *directory = opendir(folder);
    if (directory == NULL) {
        return 1;
    }
    for (const struct dirent *entry = readdir(directory); entry != NULL; entry = readdir(directory)) {
        unlink(at(entry->d_name));
    }
    closedir(directory);
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exr_32_is_bit_exact),
        cmocka_unit_test(exr_channels_come_back_sorted_by_name),
        cmocka_unit_test(exr_keeps_names_of_127_bytes),
        cmocka_unit_test(exr_16_is_right_to_half_precision),
        cmocka_unit_test(exr_writes_the_packed_names_when_packed),
        cmocka_unit_test(every_format_keeps_values_to_half_a_step),
        cmocka_unit_test(formats_of_their_own_writers_keep_every_size),
        cmocka_unit_test(lossy_formats_keep_grey),
        cmocka_unit_test(icons_of_fewer_bits_are_not_given_to_their_reader),
        cmocka_unit_test(pgm_is_grey),
        cmocka_unit_test(integers_clamp_and_turn_nan_to_0),
        cmocka_unit_test(default_bits_are_the_formats_best),
        cmocka_unit_test(colours_that_are_not_given_are_0),
        cmocka_unit_test(default_pack_takes_the_first_three_and_coverage),
        cmocka_unit_test(channel_names_may_have_commas_and_equals),
        cmocka_unit_test(bad_packs_are_refused_by_part),
        cmocka_unit_test(what_a_format_lacks_is_refused),
        cmocka_unit_test(bad_images_are_refused),
        cmocka_unit_test(places_that_cannot_be_written_are_refused),
        cmocka_unit_test(a_full_disk_leaves_the_old_file_and_nothing_else),
        cmocka_unit_test(the_same_image_is_the_same_bytes_later),
        cmocka_unit_test(cut_files_are_errors),
        cmocka_unit_test(damaged_files_do_no_harm),
        cmocka_unit_test(unreadable_paths_are_read_errors),
        cmocka_unit_test(a_written_file_follows_links_and_keeps_its_mode),
        cmocka_unit_test(outputs_are_made_beside_the_target_and_keep_its_ending),
        cmocka_unit_test(no_temporary_is_left),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
