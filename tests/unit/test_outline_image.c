/* Outlines of images against closed forms. */
#include "outlines.h"
#include "testing.h"

#include <unistd.h>

#include <vdbshade/image.h>

static const double at_corner[2] = {3.0, 4.0};

static char image_path[] = "vsh-outline-XXXXXX.exr";

static void write_image(int32_t width, int32_t height, int32_t channels, const char *const *names,
                        const float *const *planes) {
    const vsh_image image = {width, height, channels, names, planes, NULL};
    assert_ok(vsh_image_write(image_path, &image, NULL, &failure));
}

static void write_mask(int32_t width, int32_t height, const float *plane) {
    const char *const names[1] = {"Y"};
    write_image(width, height, 1, names, &plane);
}

static vsh_outline *outline_of_image(const vsh_mask_options *options) {
    vsh_outline *outline = NULL;
    assert_ok(vsh_outline_from_image(image_path, options, NULL, &outline, &failure));
    return outline;
}

TEST(a_solid_image_is_its_rectangle) {
    float white[12];
    for (int i = 0; i < 12; ++i) {
        white[i] = 1.0f;
    }
    write_mask(4, 3, white);
    vsh_mask_options options = vsh_mask_options_default();
    options.width = 8.0;
    vsh_outline *outline = outline_of_image(&options);
    const vsh_outline_info info = info_of(outline);
    assert_true(info.area == 48.0 && info.contours == 1); /* square pixels: 8 × 6 */
    assert_true(info.bounds_min[0] == -4.0 && info.bounds_max[1] == 3.0);
    const double beyond[2] = {-4.0 - at_corner[0], 3.0 + at_corner[1]};
    assert_true(fabs(vsh_outline_distance(outline, beyond) - 5.0) < 1e-14);
    vsh_outline_free(outline);
    options.height = 1.0;
    outline = outline_of_image(&options);
    assert_true(info_of(outline).area == 8.0);
    vsh_outline_free(outline);
}

/* A disc as a painter anti-aliases it: the share of each pixel that it covers, by 16 × 16 samples. */
TEST(an_anti_aliased_disc_is_round) {
    enum { SIZE = 64 };
    static float plane[SIZE * SIZE], hard[SIZE * SIZE];
    const double radius = 20.3, cx = 31.7, cy = 32.4; /* pixels, from the upper left corner */
    for (int i = 0; i < SIZE * SIZE; ++i) {
        int covered = 0;
        for (int s = 0; s < 256; ++s) {
            const double x = i % SIZE + (s % 16 + 0.5) / 16.0,
                         y = (double)(i / SIZE) + ((double)(s / 16) + 0.5) / 16.0;
            covered += hypot(x - cx, y - cy) < radius;
        }
        plane[i] = (float)covered / 256.0f;
        hard[i] = covered >= 128 ? 1.0f : 0.0f;
    }
    vsh_mask_options options = vsh_mask_options_default();
    options.width = SIZE; /* a unit a pixel */
    double worst[2] = {0.0, 0.0};
    for (int pass = 0; pass < 2; ++pass) {
        write_mask(SIZE, SIZE, pass == 0 ? plane : hard);
        vsh_outline *outline = outline_of_image(&options);
        assert_int_equal(info_of(outline).contours, 1);
        for (int i = 0; i < 360; ++i) {
            const double angle = PI * i / 180.0;
            const double p[2] = {cx - 0.5 * SIZE + radius * cos(angle),
                                 0.5 * SIZE - cy + radius * sin(angle)};
            worst[pass] = fmax(worst[pass], fabs(vsh_outline_distance(outline, p)));
        }
        if (pass == 0) {
            assert_true(fabs(info_of(outline).area / (PI * radius * radius) - 1.0) < 0.001);
        }
        vsh_outline_free(outline);
    }
    print_message("a disc's border: within %.3f pixels, without anti-aliasing %.3f\n", worst[0], worst[1]);
    assert_true(worst[0] < 0.09 && worst[1] > 0.3);
}

/* Pixels that touch at corners only: by the middle of the four. */
TEST(corners_join_by_their_middle) {
    float plane[16] = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0};
    vsh_mask_options options = vsh_mask_options_default();
    options.width = 4.0;
    options.threshold = 0.51; /* the middle, 0.5, is below */
    write_mask(4, 4, plane);
    vsh_outline *outline = outline_of_image(&options);
    assert_int_equal(info_of(outline).contours, 2);
    assert_true(vsh_outline_distance(outline, (const double[]){0.0, 0.0}) > 0.0);
    vsh_outline_free(outline);
    options.threshold = 0.49;
    outline = outline_of_image(&options);
    assert_int_equal(info_of(outline).contours, 1);
    assert_true(vsh_outline_distance(outline, (const double[]){0.0, 0.0}) < 0.0);
    vsh_outline_free(outline);
}

TEST(any_image_closes) {
    enum { W = 37, H = 23 };
    float plane[W * H];
    for (int i = 0; i < W * H; ++i) {
        plane[i] = (float)any((uint64_t)i);
    }
    write_mask(W, H, plane);
    vsh_mask_options options = vsh_mask_options_default();
    options.width = W;
    double areas[2];
    for (int invert = 0; invert < 2; ++invert) {
        options.invert = invert;
        vsh_outline *outline = outline_of_image(&options);
        for (int i = 0; i < W * H; ++i) { /* each pixel's centre is where it belongs */
            const double p[2] = {i % W + 0.5 - 0.5 * W, 0.5 * H - (double)(i / W) - 0.5};
            assert_int_equal(vsh_outline_distance(outline, p) < 0.0, (plane[i] >= 0.5f) != invert);
            assert_int_equal(truth_inside(outline, p[0], p[1]), (plane[i] >= 0.5f) != invert);
        }
        areas[invert] = info_of(outline).area;
        vsh_outline_free(outline);
    }
    assert_true(fabs(areas[0] + areas[1] - W * H) < 1e-9); /* what is not solid is the rest */
}

TEST(channels_are_chosen) {
    const float r[4] = {1, 0, 0, 0}, g[4] = {0, 1, 0, 0}, b[4] = {0, 0, 1, 1}, a[4] = {1, 1, 0, 1};
    const float one[4] = {1, 1, 1, 1};
    const char *const names[4] = {"R", "G", "B", "A"};
    const float *planes[4] = {r, g, b, a};
    write_image(4, 1, 4, names, planes);
    const struct {
        const char *channel;
        double area, threshold;
    } cases[] = {{NULL, 3.0, 0.5},    {"alpha", 3.0, 0.5}, {"A", 3.0, 0.5},        {"red", 1.0, 0.5},
                 {"green", 1.0, 0.5}, {"B", 2.0, 0.5},     {"luminance", 1.0, 0.5}};
    vsh_mask_options options = vsh_mask_options_default();
    options.width = 4.0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        options.channel = cases[i].channel;
        vsh_outline *outline = outline_of_image(&options);
        /* borders between pixels of 0 and 1 are half-way, of luminance elsewhere */
        assert_true(fabs(info_of(outline).area - cases[i].area) < 0.35);
        vsh_outline_free(outline);
    }
    planes[3] = one; /* an alpha that says nothing */
    write_image(4, 1, 4, names, planes);
    options.channel = NULL;
    vsh_outline *outline = outline_of_image(&options);
    assert_true(info_of(outline).area < 2.0);
    vsh_outline_free(outline);
}

TEST(bad_images_are_refused) {
    enum { SIZE = 300 };
    static const struct {
        float pixel; /* (0, 1) */
        const char *channel;
        double width, threshold;
        vsh_result code;
        const char *part;
    } cases[] = {{0.0f, NULL, 1.0, 0.5, VSH_ERROR_INPUT, "no outline"},
                 {0.0f, "alpha", 1.0, 0.5, VSH_ERROR_INPUT, "no channel 'alpha'; it has Y"},
                 {0.0f, NULL, 0.0, 0.5, VSH_ERROR_ARGUMENT, "width"},
                 {0.0f, NULL, -1.0, 0.5, VSH_ERROR_ARGUMENT, "width"},
                 {0.0f, NULL, NAN, 0.5, VSH_ERROR_ARGUMENT, "width"},
                 {0.0f, NULL, INFINITY, 0.5, VSH_ERROR_ARGUMENT, "width"},
                 {0.0f, NULL, 1e16, 0.5, VSH_ERROR_ARGUMENT, "width"},
                 {0.0f, NULL, 1.0, NAN, VSH_ERROR_ARGUMENT, "threshold"},
                 {NAN, NULL, 1.0, 0.5, VSH_ERROR_INPUT, "pixel (0, 1)"}};
    vsh_outline *outline = NULL;
    vsh_mask_options options = vsh_mask_options_default();
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        write_mask(2, 2, (const float[4]){0, 0, cases[i].pixel, 0});
        options.channel = cases[i].channel;
        options.width = cases[i].width;
        options.threshold = cases[i].threshold;
        assert_fails(vsh_outline_from_image(image_path, &options, NULL, &outline, &failure), cases[i].code,
                     cases[i].part);
        assert_null(outline);
    }
    assert_fails(vsh_outline_from_image("none.png", &options, NULL, &outline, &failure), VSH_ERROR_READ,
                 "none.png");
    assert_fails(vsh_outline_from_image(".", &options, NULL, &outline, &failure), VSH_ERROR_READ, "folder");
    static float noise[SIZE * SIZE];
    for (int i = 0; i < SIZE * SIZE; ++i) {
        noise[i] = (float)any((uint64_t)i);
    }
    write_mask(SIZE, SIZE, noise);
    vsh_run run = vsh_run_default();
    for (run.memory_limit = 100000; run.memory_limit < 5000000; run.memory_limit *= 3) {
        assert_fails(vsh_outline_from_image(image_path, &options, &run, &outline, &failure), VSH_ERROR_LIMIT,
                     "limit");
        assert_null(outline);
    }
}

static int remove_image(void **state) {
    unlink(image_path);
    return 0;
}

static int name_image(void **state) {
    const int file = mkstemps(image_path, 4);
    return file < 0 || close(file) != 0;
}

int main(void) {
    return run_all_tests(name_image, remove_image);
}
