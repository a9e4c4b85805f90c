/* Outlines of polygons, of text and of images against closed forms. */
#include "folder.h"
#include "grids.h"
#include "outlines.h"
#include "testing.h"

TEST(the_tree_finds_the_same_distance_as_a_search_of_all_edges) {
    OWNED(vsh_outline) *letters = lines_of("R&8\nqi%", VSH_ALIGN_CENTER);
    int inside = 0;
    for (int i = 0; i < 2000; ++i) {
        const double p[2] = {5.0 * any(2 * (uint64_t)i) - 2.5, 4.0 * any(2 * (uint64_t)i + 1) - 2.5};
        const double distance = distance_to(letters, p);
        assert_true(fabs(fabs(distance) - sqrt(truth_square(letters, p[0], p[1]))) < 1e-12);
        assert_int_equal(distance < 0.0, truth_inside(letters, p[0], p[1]));
        inside += distance < 0.0;
    }
    assert_true(inside > 100);
}

/* --- the area that contours wind around */

TEST(overlapping_squares_are_one_area) {
    /* The second runs backwards and is moved to 1 … 3. Their overlap, 1 × 1, counts as inside. */
    const double first[8] = {0, 0, 2, 0, 2, 2, 0, 2}, second[8] = {0, 0, 0, 2, 2, 2, 2, 0};
    const double turned_and_moved[6] = {0, -1, 3, 1, 0, 1};
    OWNED(vsh_outline) *a = polygon(first, 4), *b = polygon(second, 4), *both = NULL;
    const vshi_outline_instance instances[2] = {{a, NULL}, {b, turned_and_moved}};
    assert_ok(vshi_outline_unite(instances, 2, NULL, &both, &failure));
    assert_true(fabs(info_of(both).area - 7.0) < 1e-14);
    assert_int_equal(info_of(both).contours, 1);
    assert_int_equal(info_of(both).points, 8);
    /* The lines inside the area are no border. */
    assert_true(fabs(distance_to(both, (const double[]){1.5, 1.5}) + sqrt(0.5)) < 1e-14);
    assert_true(fabs(distance_to(both, (const double[]){2.5, 0.5}) - 0.5) < 1e-14);
}

TEST(contours_that_share_an_edge_are_united_and_reversed_ones_are_holes) {
    static const size_t counts[3] = {4, 4, 4};
    const double beside[16] = {0, 0, 1, 0, 1, 1, 0, 1, 1, 0.25, 2, 0.25, 2, 0.75, 1, 0.75};
    OWNED(vsh_outline) *both = polygons(beside, counts, 2);
    assert_true(fabs(info_of(both).area - 1.5) < 1e-14);
    assert_true(fabs(distance_to(both, (const double[]){1.0, 0.5}) + 0.25) < 1e-14);
    const double points[24] = {0, 0, 4, 0, 4,   4,   0,   4,   1,   1,   1,   3,
                               3, 3, 3, 1, 1.5, 1.5, 2.5, 1.5, 2.5, 2.5, 1.5, 2.5};
    OWNED(vsh_outline) *island = polygons(points, counts, 3);
    assert_true(fabs(info_of(island).area - 13.0) < 1e-14);
    assert_true(distance_to(island, (const double[]){1.2, 2.0}) > 0.0);
    assert_true(distance_to(island, (const double[]){2.0, 2.0}) == -0.5);
    size_t count;
    for (size_t c = 0; c < 3; ++c) { /* the area to the left, everywhere */
        const double *p = contour_of(island, c, &count);
        const double x = 0.5 * (p[0] + p[2]) - 1e-3 * (p[3] - p[1]),
                     y = 0.5 * (p[1] + p[3]) + 1e-3 * (p[2] - p[0]);
        assert_true(distance_to(island, (const double[]){x, y}) < 0.0);
    }
    assert_null(contour_of(island, 3, &count));
    assert_int_equal(count, 0);
    /* a filled disc in it that runs the same way changes nothing */
    const double inner[16] = {0, 0, 4, 0, 4, 4, 0, 4, 1, 1, 3, 1, 3, 3, 1, 3};
    OWNED(vsh_outline) *filled = polygons(inner, counts, 2);
    assert_true(info_of(filled).area == 16.0 && info_of(filled).contours == 1);
}

/* Five lines that cross: wound around twice in the middle. */
TEST(a_pentagram_is_filled) {
    double points[10];
    for (int i = 0; i < 5; ++i) {
        points[2 * i] = cos(4.0 * PI * i / 5.0);
        points[2 * i + 1] = sin(4.0 * PI * i / 5.0);
    }
    OWNED(vsh_outline) *star = polygon(points, 5);
    /* ten triangles between the centre, a tip, and an inner corner at (3 - √5)/2 */
    const double inner = 0.5 * (3.0 - sqrt(5.0));
    assert_true(fabs(info_of(star).area - 5.0 * inner * sin(PI / 5.0)) < 1e-13);
    assert_int_equal(info_of(star).points, 10);
    assert_true(fabs(distance_to(star, (const double[]){0.0, 0.0}) + inner) < 1e-12);
}

TEST(many_overlaps_leave_the_union) {
    enum { COUNT = 40 };
    double points[8 * COUNT];
    size_t counts[COUNT];
    for (size_t i = 0; i < COUNT; ++i) {
        const double x = 2.0 * any(5 * i), y = 2.0 * any(5 * i + 1), w = 0.1 + 0.5 * any(5 * i + 2),
                     turn = any(5 * i + 3);
        for (int k = 0; k < 4; ++k) {
            points[8 * i + 2 * (size_t)k] = x + w * cos(turn + 0.5 * PI * k);
            points[8 * i + 2 * (size_t)k + 1] = y + w * sin(turn + 0.5 * PI * k);
        }
        counts[i] = 4;
    }
    OWNED(vsh_outline) *all = polygons(points, counts, COUNT);
    for (uint64_t i = 0; i < 3000; ++i) {
        const double p[2] = {4.0 * any(900 + 2 * i) - 1.0, 4.0 * any(901 + 2 * i) - 1.0};
        double nearest = INFINITY; /* distance of the union, where that is known: outside */
        for (size_t k = 0; k < COUNT; ++k) {
            OWNED(vsh_outline) *one = polygon(points + 8 * k, 4);
            nearest = fmin(nearest, distance_to(one, p));
        }
        const double distance = distance_to(all, p);
        assert_int_equal(distance < 0.0, nearest < 0.0);
        assert_true(nearest < 0.0 ? distance <= nearest + 1e-12 : fabs(distance - nearest) < 1e-12);
    }
}

/* --- text */

static double width_of(const char *letters) {
    OWNED(vsh_outline) *outline = lines_of(letters, VSH_ALIGN_LEFT);
    const vshi_outline_info info = info_of(outline);
    return info.bounds_max[0] - info.bounds_min[0];
}

/* DejaVu Sans: 2048 units an em; l is a bar from 193 to 377 and to 1556, of exact lines. */
TEST(letters_have_the_font_s_measures) {
    OWNED(vsh_outline) *bar = lines_of("l", VSH_ALIGN_LEFT);
    const vshi_outline_info info = info_of(bar);
    assert_int_equal(info.points, 4);
    assert_true(info.bounds_min[0] == 193.0 / 2048.0 && info.bounds_max[0] == 377.0 / 2048.0);
    assert_true(info.bounds_min[1] == 0.0 && info.bounds_max[1] == 1556.0 / 2048.0);
    OWNED(vsh_outline) *o = lines_of("o", VSH_ALIGN_LEFT); /* a ring, with x-height 1120 */
    assert_int_equal(info_of(o).contours, 2);
    const vshi_outline_info ring = info_of(o);
    assert_true(distance_to(o, (const double[]){0.5 * (ring.bounds_min[0] + ring.bounds_max[0]),
                                                560.0 / 2048.0}) > 0.1);
}

TEST(letters_are_kerned) {
    assert_true(width_of("AVA") < width_of("AHA") - 0.05);
    /* H is 1540 units wide, and pairs of them are not kerned */
    assert_true(fabs(width_of("HH") - width_of("H") - 1540.0 / 2048.0) < 1e-9);
    assert_true(width_of("AV") - width_of("V") < 1401.0 / 2048.0 - 0.02);
}

TEST(lines_are_aligned_and_spaced_by_options) {
    OWNED(vsh_outline) *lines = lines_of("l\r\nlll\n\nl", VSH_ALIGN_LEFT);
    /* three line heights of 2384 units below */
    assert_true(fabs(info_of(lines).bounds_min[1] + 3.0 * 2384.0 / 2048.0) < 1e-12);
    assert_int_equal(info_of(lines).contours, 5);
    const struct {
        int32_t align;
        double x;
    } cases[] = {{VSH_ALIGN_LEFT, 285.0},
                 {VSH_ALIGN_CENTER, 0.5 * (2 * 285.0 - 569.0)},
                 {VSH_ALIGN_RIGHT, 285.0 - 569.0}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) { /* l is 569 wide, its bar's middle at 285 */
        OWNED(vsh_outline) *bar = lines_of("l", cases[i].align);
        const vshi_outline_info info = info_of(bar);
        assert_true(fabs(0.5 * (info.bounds_min[0] + info.bounds_max[0]) - cases[i].x / 2048.0) < 1e-12);
    }
}

TEST(curves_are_followed) {
    /* the outer contour of O: its points lie on the curve, so the polygon's error is in its area */
    OWNED(vsh_outline) *o = lines_of("O", VSH_ALIGN_LEFT);
    const vshi_outline_info info = info_of(o);
    assert_true(info.points > 100 && info.points < 2000);
    double sharpest = 0.0;
    size_t count;
    const double *p = contour_of(o, 0, &count);
    for (size_t i = 0; i < count; ++i) {
        const double *a = p + 2 * i, *b = p + 2 * ((i + 1) % count), *c = p + 2 * ((i + 2) % count);
        const double first = atan2(b[1] - a[1], b[0] - a[0]), second = atan2(c[1] - b[1], c[0] - b[0]);
        const double length = hypot(b[0] - a[0], b[1] - a[1]);
        sharpest = fmax(sharpest, fabs(remainder(second - first, 2.0 * PI)) * length / 8.0); /* sagitta */
    }
    assert_true(sharpest < 3e-5);
}

TEST(bad_text_is_refused) {
    const vsh_text_options good = vsh_text_options_default();
    vsh_text_options no_height = good, no_align = good, no_spacing = good;
    no_height.height = NAN;
    no_align.align = 3;
    no_spacing.line_spacing = 0.0;
    vsh_run run = run_within(1 << 20);
    static char huge[(1 << 20) + 2], large[10001];
    memset(huge, 'o', sizeof huge - 1);
    memset(large, 'o', sizeof large - 1);
    const struct {
        const char *text, *font;
        const vsh_text_options *options;
        const vsh_run *run;
        vsh_result result;
        const char *part;
    } cases[] = {{"", FONT, NULL, NULL, VSH_ERROR_INPUT, "empty"},
                 {"a\tb", FONT, NULL, NULL, VSH_ERROR_INPUT, "U+0009, at byte 1"},
                 {"a\rb", FONT, NULL, NULL, VSH_ERROR_INPUT, "U+000D"},
                 {"\xc3", FONT, NULL, NULL, VSH_ERROR_INPUT, "no UTF-8 at byte 0"},
                 {"ab\xff", FONT, NULL, NULL, VSH_ERROR_INPUT, "no UTF-8 at byte 2"},
                 {"\xed\xa0\x80", FONT, NULL, NULL, VSH_ERROR_INPUT, "no UTF-8"},
                 {"\xc0\xaf", FONT, NULL, NULL, VSH_ERROR_INPUT, "no UTF-8"},
                 {"\xf4\x90\x80\x80", FONT, NULL, NULL, VSH_ERROR_INPUT, "no UTF-8"},
                 {"  \n ", FONT, NULL, NULL, VSH_ERROR_INPUT, "no outline"},
                 {"\xe5\xad\x97", FONT, NULL, NULL, VSH_ERROR_INPUT, "no letter for U+5B57"},
                 {"a", "none.ttf", NULL, NULL, VSH_ERROR_READ, "none.ttf"},
                 {"a", ".", NULL, NULL, VSH_ERROR_READ, "."},
                 {"a", VSH_ASSETS "/seeds.json", NULL, NULL, VSH_ERROR_INPUT, "no font"},
                 {"a", FONT, &no_height, NULL, VSH_ERROR_ARGUMENT, "height"},
                 {"a", FONT, &no_align, NULL, VSH_ERROR_ARGUMENT, "align"},
                 {"a", FONT, &no_spacing, NULL, VSH_ERROR_ARGUMENT, "line_spacing"},
                 {huge, FONT, NULL, NULL, VSH_ERROR_LIMIT, "bytes"},
                 {large, FONT, NULL, &run, VSH_ERROR_LIMIT, "limit"}};
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        vsh_outline *outline = NULL;
        assert_fails(vshi_outline_from_text(cases[i].text, cases[i].font, cases[i].options, cases[i].run,
                                            &outline, &failure),
                     cases[i].result, cases[i].part);
        assert_null(outline);
    }
}

TEST(bad_polygons_are_refused) {
    static const struct {
        double points[8];
        size_t count;
        const char *part;
    } cases[] = {{{0, 0, 1, 0, 2, 0, 3, 0}, 4, "no outline"},
                 {{0, 0, 1, 0, 2, 0, 3, 0}, 2, "no outline"},
                 {{0, 0, 1, NAN, 0, 1}, 3, "nan"},
                 {{0, 0, 1e16, 0, 0, 1}, 3, "1e+16"}};
    vsh_outline *outline = NULL;
    OWNED(vsh_outline) *square = box(0, 0, 1, 1);
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        assert_fails(vsh_outline_from_polygons(cases[i].points, &cases[i].count, 1, NULL, &outline, &failure),
                     VSH_ERROR_INPUT, cases[i].part);
    }
    const vshi_outline_instance instance = {square, (const double[6]){1, 1, 0, 1, 1, 0}};
    assert_fails(vshi_outline_unite(&instance, 1, NULL, &outline, &failure), VSH_ERROR_ARGUMENT, "flattens");
}

/* --- images */

static void write_image(int32_t width, int32_t height, int32_t channels, const char *const *names,
                        const float *const *planes) {
    const vsh_image image = {width, height, channels, names, planes, NULL};
    assert_ok(vsh_image_write(at("mask.exr"), &image, NULL, &failure));
}

static void write_mask(int32_t width, int32_t height, const float *plane) {
    const char *const names[1] = {"Y"};
    write_image(width, height, 1, names, &plane);
}

static vsh_outline *outline_of_image(const vsh_mask_options *options) {
    vsh_outline *outline = NULL;
    assert_ok(vshi_outline_from_image(at("mask.exr"), options, NULL, &outline, &failure));
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
    OWNED(vsh_outline) *outline = outline_of_image(&options);
    const vshi_outline_info info = info_of(outline);
    assert_true(info.area == 48.0 && info.contours == 1); /* square pixels: 8 × 6 */
    assert_true(info.bounds_min[0] == -4.0 && info.bounds_max[1] == 3.0);
    assert_true(fabs(distance_to(outline, (const double[]){-7.0, 7.0}) - 5.0) < 1e-14);
    options.height = 1.0;
    OWNED(vsh_outline) *flat = outline_of_image(&options);
    assert_true(info_of(flat).area == 8.0);
}

/* A disc as a painter anti-aliases it: the share of each pixel that it covers, by 16 × 16 samples. */
TEST(an_anti_aliased_disc_is_round) {
    enum { SIZE = 64 };
    static float plane[SIZE * SIZE];
    const double radius = 20.3, cx = 31.7, cy = 32.4; /* pixels, from the upper left corner */
    for (int i = 0; i < SIZE * SIZE; ++i) {
        int covered = 0;
        for (int s = 0; s < 256; ++s) {
            const double x = i % SIZE + (s % 16 + 0.5) / 16.0,
                         y = (double)(i / SIZE) + ((double)(s / 16) + 0.5) / 16.0;
            covered += hypot(x - cx, y - cy) < radius;
        }
        plane[i] = (float)covered / 256.0f;
    }
    vsh_mask_options options = vsh_mask_options_default();
    options.width = SIZE; /* a unit a pixel */
    write_mask(SIZE, SIZE, plane);
    OWNED(vsh_outline) *outline = outline_of_image(&options);
    assert_int_equal(info_of(outline).contours, 1);
    assert_true(fabs(info_of(outline).area / (PI * radius * radius) - 1.0) < 0.001);
    for (int i = 0; i < 360; ++i) {
        const double angle = PI * i / 180.0;
        const double p[2] = {cx - 0.5 * SIZE + radius * cos(angle), 0.5 * SIZE - cy + radius * sin(angle)};
        assert_true(fabs(distance_to(outline, p)) < 0.09); /* without anti-aliasing 0.3 */
    }
}

/* Pixels that touch only at corners: the middle of the four decides. */
TEST(corners_join_by_their_middle) {
    float plane[16] = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0};
    vsh_mask_options options = vsh_mask_options_default();
    options.width = 4.0;
    write_mask(4, 4, plane);
    for (int joined = 0; joined < 2; ++joined) { /* the middle is 0.5 */
        options.threshold = joined ? 0.49 : 0.51;
        OWNED(vsh_outline) *outline = outline_of_image(&options);
        assert_int_equal(info_of(outline).contours, joined ? 1 : 2);
        assert_int_equal(distance_to(outline, (const double[]){0.0, 0.0}) < 0.0, joined);
    }
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
        OWNED(vsh_outline) *outline = outline_of_image(&options);
        for (int i = 0; i < W * H; ++i) { /* each pixel's centre is where it belongs */
            const double p[2] = {i % W + 0.5 - 0.5 * W, 0.5 * H - (double)(i / W) - 0.5};
            assert_int_equal(distance_to(outline, p) < 0.0, (plane[i] >= 0.5f) != invert);
            assert_int_equal(truth_inside(outline, p[0], p[1]), (plane[i] >= 0.5f) != invert);
        }
        areas[invert] = info_of(outline).area;
    }
    assert_true(fabs(areas[0] + areas[1] - W * H) < 1e-9); /* the rest is solid where the image is inverted */
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
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        options.channel = cases[i].channel;
        OWNED(vsh_outline) *outline = outline_of_image(&options);
        /* borders between pixels of 0 and 1 are half-way, of luminance elsewhere */
        assert_true(fabs(info_of(outline).area - cases[i].area) < 0.35);
    }
    planes[3] = one; /* an alpha that says nothing */
    write_image(4, 1, 4, names, planes);
    options.channel = NULL;
    OWNED(vsh_outline) *outline = outline_of_image(&options);
    assert_true(info_of(outline).area < 2.0);
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
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        write_mask(2, 2, (const float[4]){0, 0, cases[i].pixel, 0});
        options.channel = cases[i].channel;
        options.width = cases[i].width;
        options.threshold = cases[i].threshold;
        assert_fails(vshi_outline_from_image(at("mask.exr"), &options, NULL, &outline, &failure),
                     cases[i].code, cases[i].part);
        assert_null(outline);
    }
    assert_fails(vshi_outline_from_image("none.png", &options, NULL, &outline, &failure), VSH_ERROR_READ,
                 "none.png");
    assert_fails(vshi_outline_from_image(".", &options, NULL, &outline, &failure), VSH_ERROR_READ, "folder");
    static float noise[SIZE * SIZE];
    for (int i = 0; i < SIZE * SIZE; ++i) {
        noise[i] = (float)any((uint64_t)i);
    }
    write_mask(SIZE, SIZE, noise);
    vsh_run run = vsh_run_default();
    for (run.memory_limit = 100000; run.memory_limit < 5000000; run.memory_limit *= 3) {
        assert_fails(vshi_outline_from_image(at("mask.exr"), &options, &run, &outline, &failure),
                     VSH_ERROR_LIMIT, "limit");
        assert_null(outline);
    }
}

/* --- outlines extruded to solids */

static vsh_grid *grid_of(const vsh_outline *outline, double thickness, const double *transform, double voxel,
                         const vsh_run *run) {
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    assert_ok(vsh_grid_from_outline(outline, thickness, transform, &options, run, &grid, &failure));
    return grid;
}

/* A box of half size (1, 0.5, 0.3), in its own space. */
static double box_distance(const double p[3]) {
    const double q[3] = {fabs(p[0]) - 1.0, fabs(p[1]) - 0.5, fabs(p[2]) - 0.3};
    const double outside = hypot(hypot(fmax(q[0], 0.0), fmax(q[1], 0.0)), fmax(q[2], 0.0));
    return outside + fmin(0.0, fmax(q[0], fmax(q[1], q[2])));
}

/* Mirrored in x, scaled by 2, turned by 90° about x and moved. */
static const double placed[12] = {-2, 0, 0, 3, 0, 0, -2, -1, 0, 2, 0, 0.5};

static double placed_distance(const double p[3]) {
    const double local[3] = {-(p[0] - 3.0) / 2.0, (p[2] - 0.5) / 2.0, -(p[1] + 1.0) / 2.0};
    return 2.0 * box_distance(local);
}

TEST(an_extruded_rectangle_has_the_distance_of_a_box_also_where_it_is_moved) {
    OWNED(vsh_outline) *outline = box(-1.0, -0.5, 1.0, 0.5);
    OWNED(vsh_grid) *here = grid_of(outline, 0.6, NULL, 0.02, NULL),
                    *there = grid_of(outline, 0.6, placed, 0.05, NULL);
    assert_less(worst_error(here, box_distance, 2.9, 2.9), 1e-5);
    assert_less(worst_error(there, placed_distance, 2.9, 2.9), 1e-5);
}

static vsh_outline *letters;

static double letters_distance(const double p[3]) {
    const double least = sqrt(truth_square(letters, p[0], p[1]));
    const double flat = truth_inside(letters, p[0], p[1]) ? -least : least, above = fabs(p[2]) - 0.1;
    return flat > 0.0 && above > 0.0 ? hypot(flat, above) : fmax(flat, above);
}

TEST(text_is_extruded_with_its_distance) {
    letters = lines_of("d&", VSH_ALIGN_LEFT);
    const vsh_run one = run_on(1);
    OWNED(vsh_grid) *grid = grid_of(letters, 0.2, NULL, 0.03, NULL),
                    *again = grid_of(letters, 0.2, NULL, 0.03, &one);
    assert_less(worst_error(grid, letters_distance, 2.9, 2.9), 1e-5);
    assert_same_leaves(grid, again, 0.0f);
    vsh_outline_free(letters);
}

TEST(bad_solids_are_refused) {
    OWNED(vsh_outline) *outline = box(-1.0, -0.5, 1.0, 0.5);
    vsh_grid *grid = NULL;
    const vsh_grid_options options = with_voxel(0.02);
    const double thicknesses[] = {0.0, -1.0, NAN, INFINITY, 1e16};
    for (size_t i = 0; i < COUNT_OF(thicknesses); ++i) {
        assert_fails(vsh_grid_from_outline(outline, thicknesses[i], NULL, &options, NULL, &grid, &failure),
                     VSH_ERROR_ARGUMENT, "thickness");
    }
    const double sheared[12] = {1, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    assert_fails(vsh_grid_from_outline(outline, 1.0, sheared, &options, NULL, &grid, &failure),
                 VSH_ERROR_ARGUMENT, "shear");
    vsh_run run = run_within(1 << 20);
    const vsh_grid_options fine = with_voxel(0.0005);
    assert_fails(vsh_grid_from_outline(outline, 1.0, NULL, &fine, &run, &grid, &failure), VSH_ERROR_LIMIT,
                 "");
    assert_null(grid);
}

FIXTURE(make_folder, remove_folder)
