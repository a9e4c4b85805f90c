/* Colour spaces of files: which values go through the sRGB curve, what the file says, what is cut. */
#include "images.h"
#include "testing.h"

static const char *const IRRADIANCE[] = {"shadow.sun", "irradiance.R", "irradiance.G", "irradiance.B", "A"};
static const int32_t HOLDS[] = {VSH_CHANNEL_DATA, VSH_CHANNEL_LIGHT, VSH_CHANNEL_LIGHT, VSH_CHANNEL_LIGHT,
                                VSH_CHANNEL_DATA};

static vsh_image_file *write_as(const char *path, const vsh_image *image, int32_t bits, int32_t space,
                                const char *pack) {
    vsh_image_options options = vsh_image_options_default();
    options.bits = bits;
    options.pack = pack;
    options.color_space = space;
    assert_ok(vsh_image_write(path, image, &options, &failure));
    vsh_image_file *file = NULL;
    assert_ok(vsh_image_read(path, NULL, &file, &failure));
    return file;
}

static const char *said(const vsh_image_file *file) {
    size_t count = 0;
    const vsh_attribute *list = vsh_image_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        if (strcmp(list[i].name, "vdbshade_color_space") == 0) {
            return list[i].value;
        }
    }
    return "";
}

static bool has_chunk(const char *path, const char *type) {
    unsigned char *bytes = NULL;
    const size_t size = read_all(path, &bytes);
    bool found = false;
    for (size_t at = 8; at + 12 <= size && !found;) {
        found = memcmp(bytes + at + 4, type, 4) == 0;
        at += 12 + ((size_t)bytes[at] << 24 | (size_t)bytes[at + 1] << 16 | (size_t)bytes[at + 2] << 8 |
                    bytes[at + 3]);
    }
    free(bytes);
    return found;
}

/* IEC 61966-2-1, by libm. */
static double srgb(double x) {
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

static double linear(double x) {
    return x;
}

static double half_and_half(double x) { /* vectors */
    return 0.5 + 0.5 * x;
}

/* The kind of a channel, not its name, decides how integers are coded; alpha is linear. */
TEST(light_is_srgb_and_all_else_linear_unless_a_space_is_named) {
    static const int32_t vectors[] = {2, 2, 2, 2, 0};
    static const struct {
        const int32_t *holds;
        const char *pack;
        int32_t bits, space;
        size_t from; /* the plane in R; A is the last one */
        double (*curve)(double);
        const char *said;
    } cases[] = {
        {HOLDS, NULL, 8, VSH_COLOR_AUTO, 1, srgb, "sRGB"},
        {HOLDS, NULL, 16, VSH_COLOR_AUTO, 1, srgb, "sRGB"},
        {HOLDS, "R=shadow.sun,A=A", 8, VSH_COLOR_AUTO, 0, linear, "linear"},
        {HOLDS, "R=shadow.sun,G=irradiance.G,A=A", 8, VSH_COLOR_AUTO, 0, linear, "linear"},
        {HOLDS, "rgb", 8, VSH_COLOR_AUTO, 1, srgb, "sRGB"}, /* the picture is the irradiance */
        {HOLDS, NULL, 16, VSH_COLOR_LINEAR, 1, linear, "linear"},
        {HOLDS, "R=shadow.sun,A=A", 16, VSH_COLOR_SRGB, 0, srgb, "sRGB"},
        {HOLDS, "R=shadow.sun,A=A", 16, VSH_COLOR_ENCODED, 0, linear, "sRGB"}, /* said, not done */
        {NULL, NULL, 16, VSH_COLOR_AUTO, 1, linear, "linear"},
        {vectors, NULL, 16, VSH_COLOR_AUTO, 1, half_and_half, NULL},
    };
    sample s;
    make(&s, 30, 20, 5, IRRADIANCE);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; ++k) {
        s.image.holds = cases[k].holds;
        vsh_image_file *file =
            write_as(at("color.png"), &s.image, cases[k].bits, cases[k].space, cases[k].pack);
        const vsh_image view = vsh_image_view(file);
        const double step = cases[k].bits == 8 ? 255.0 : 65535.0;
        assert_int_equal(view.channel_count, 4);
        for (size_t i = 0; i < 600; ++i) {
            const double is = view.planes[0][i], value = s.planes[cases[k].from][i];
            assert_true(fabs(is - cases[k].curve(value)) <= 0.501 / step);
            assert_true(cases[k].curve != srgb || fabs(vsh_srgb_to_linear(is) - value) <= 1.2 / step);
            assert_true(fabs((double)(view.planes[3][i] - s.planes[4][i])) <= 0.501 / step);
        }
        if (cases[k].said != NULL) {
            const bool light = strcmp(cases[k].said, "sRGB") == 0;
            assert_string_equal(said(file), cases[k].said);
            assert_true(has_chunk(at("color.png"), "sRGB") == light);
            assert_false(!light && has_chunk(at("color.png"), "gAMA"));
        }
        vsh_image_free(file);
    }
    unmake(&s);
}

TEST(floats_are_linear_and_bad_spaces_are_refused) {
    static const int32_t none[] = {0, 0, 3, 0, 0};
    sample s;
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
    unmake(&s);
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
    sample s;
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
    unmake(&s);
}

int main(void) {
    return run_all_tests(make_folder, remove_folder);
}
