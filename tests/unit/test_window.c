/* Windows over texels: what is known of each by the help of those around it. The truth is the share by which
 * a test draws its own rays. And which neighbouring texels hang together: charts as an atlas may lay them
 * out, whose surfaces are known. */
#include "fields.h"
#include "testing.h"

#include "shade/window.h"

enum { EDGE = 96, TEXELS = EDGE * EDGE };

static const double MAX_ERROR = 0.02;

typedef struct table {
    vshi_windows windows;
    vshi_window_texel texels[TEXELS];
    vshi_window_sums sums[(EDGE + 1) * (EDGE + 1)];
} table;

/* Texels that all hang together, of so many rays and no value. */
static table *make_table(int32_t width, int32_t height, int32_t rays) {
    assert_true(width * height <= TEXELS && (width + 1) * (height + 1) <= (EDGE + 1) * (EDGE + 1));
    table *t = aligned_alloc(_Alignof(table), sizeof *t);
    memset(t, 0, sizeof *t);
    t->windows = (vshi_windows){width, height, t->texels, t->sums, VSH_ISA_BEST};
    for (int32_t y = 0; y < height; ++y) {
        for (int32_t x = 0; x < width; ++x) {
            t->texels[y * width + x] = (vshi_window_texel){
                .rays = rays, .spread = (float)(1.0 / rays), .left = x > 0, .above = y > 0};
        }
    }
    return t;
}

static vshi_window_texel *texel_at(table *t, int32_t x, int32_t y) {
    return &t->texels[y * t->windows.width + x];
}

static vshi_window_estimate estimate_at(const table *t, int32_t x, int32_t y) {
    vshi_window_estimate e;
    vshi_windows_estimate(&t->windows, &(uint16_t){(uint16_t)(y * t->windows.width + x)}, 1, MAX_ERROR, 0,
                          &e);
    return e;
}

/* The share of a texel's rays that are free where each is by the chance p. */
static float draw(uint64_t *counter, int32_t rays, double p) {
    int32_t free = 0;
    for (int32_t i = 0; i < rays; ++i) {
        free += uniform(counter) < p;
    }
    return (float)((double)free / rays);
}

/* Cuts texels apart where `area` differs; area 0 is no texel at all. */
static void cut(table *t, const uint8_t *area) {
    const int32_t width = t->windows.width;
    for (int32_t y = 0; y < t->windows.height; ++y) {
        for (int32_t x = 0; x < width; ++x) {
            vshi_window_texel *e = texel_at(t, x, y);
            const int32_t i = y * width + x;
            e->rays = area[i] == 0 ? 0 : e->rays;
            e->left = x > 0 && area[i] != 0 && area[i] == area[i - 1];
            e->above = y > 0 && area[i] != 0 && area[i] == area[i - width];
        }
    }
}

TEST(planes_without_noise_are_exact_up_to_corners) {
    static const int32_t sizes[][2] = {{40, 30}, {8, 8}, {64, 1}, {1, 64}, {3, 50}, {50, 5}, {2, 2}, {1, 1}};
    static const double slopes[][2] = {{0.0, 0.0}, {0.004, 0.0}, {-0.003, 0.006}, {0.009, 0.005}};
    for (size_t k = 0; k < COUNT_OF(sizes); ++k) {
        for (size_t s = 0; s < COUNT_OF(slopes); ++s) {
            const int32_t width = sizes[k][0], height = sizes[k][1];
            FREED table *t = make_table(width, height, 8);
            for (int32_t i = 0; i < width * height; ++i) {
                t->texels[i].value =
                    (float)(0.25 + slopes[s][0] * (i % width) + slopes[s][1] * (int32_t)(i / width));
            }
            vshi_windows_sum(&t->windows);
            for (int32_t i = 0; i < width * height; ++i) {
                const vshi_window_estimate e = estimate_at(t, i % width, i / width);
                assert_that(fabs(e.value - (double)t->texels[i].value) <= 1e-6,
                            "%d × %d, slopes %g %g, texel %d: %.9f instead of %.9f", width, height,
                            slopes[s][0], slopes[s][1], i, e.value, (double)t->texels[i].value);
            }
            const vshi_window_estimate corner = estimate_at(t, 0, 0),
                                       middle = estimate_at(t, width / 2, height / 2);
            if (k == 0) { /* as large as they come, and all in the table */
                assert_true(corner.x[0] == 0 && corner.x[1] >= 4 && corner.y[0] == 0 && corner.y[1] >= 4);
                assert_true(middle.x[1] - middle.x[0] == 10 && middle.y[1] - middle.y[0] == 10);
                assert_true(middle.x[0] + middle.x[1] == width && middle.y[0] + middle.y[1] == height);
                assert_true(middle.deviation < corner.deviation && middle.centred >= middle.deviation);
                assert_true(corner.centred < corner.deviation);
            }
        }
    }
}

/* p of a texel. */
typedef double share_fn(int32_t x, int32_t y);

static double even(int32_t x, int32_t y) {
    return 0.4;
}

static double ramp(int32_t x, int32_t y) {
    return 0.2 + 0.004 * x + 0.002 * y;
}

static double open(int32_t x, int32_t y) {
    return 0.93;
}

static void fill(table *t, share_fn *share, uint64_t seed) {
    const int32_t width = t->windows.width;
    uint64_t counter = seed;
    for (int32_t i = 0; i < width * t->windows.height; ++i) {
        t->texels[i].value = draw(&counter, t->texels[i].rays, share(i % width, i / width));
    }
    vshi_windows_sum(&t->windows);
}

/* Root mean squares over a table. */
typedef struct errors {
    double is, said, own,
        specks; /* own: of a texel's own rays; specks: share that is off by more than 0.06 */
} errors;

static errors errors_of(const table *t, share_fn *share) {
    const int32_t width = t->windows.width, count = width * t->windows.height;
    errors sum = {0.0, 0.0, 0.0, 0.0};
    for (int32_t i = 0; i < count; ++i) {
        const vshi_window_estimate e = estimate_at(t, i % width, i / width);
        const double p = share(i % width, i / width), off = e.value - p, own = (double)t->texels[i].value - p;
        sum.is += off * off;
        sum.said += e.deviation * e.deviation;
        sum.own += own * own;
        sum.specks += fabs(off) > 0.06;
    }
    return (errors){sqrt(sum.is / count), sqrt(sum.said / count), sqrt(sum.own / count), sum.specks / count};
}

TEST(the_stated_error_is_the_noise_that_is_left) {
    share_fn *const shares[] = {even, ramp, open};
    for (size_t s = 0; s < 3; ++s) {
        for (int32_t rays = 8; rays <= 128; rays *= 4) {
            FREED table *t = make_table(EDGE, EDGE, rays);
            fill(t, shares[s], 11 + s);
            const errors e = errors_of(t, shares[s]);
            assert_true(e.is > 0.9 * e.said && e.is < 1.28 * e.said);
            assert_less(e.is, e.own / 6.2);
            /* half of the texels have eight free rays where the share is 0.93 */
            assert_true(shares[s] != open || rays > 8 || e.specks < 0.005);
        }
    }
}

/* Two halves that hang together, of 0.25 and 0.75; a texel's own error is 0.038. A mean over the edge would
 * be off by up to 0.25. */
TEST(edges_stay_sharp) {
    enum { RAYS = 128, AT = 43, SEEDS = 8, COUNT = 2 * EDGE * SEEDS };
    for (int32_t turned = 0; turned < 2; ++turned) {
        FREED table *t = make_table(EDGE, EDGE, RAYS);
        double square = 0.0, bias = 0.0, blurred = 0.0;
        uint64_t counter = 5;
        for (int32_t seed = 0; seed < SEEDS; ++seed) {
            for (int32_t i = 0; i < TEXELS; ++i) {
                t->texels[i].value = draw(&counter, RAYS, (turned ? i / EDGE : i % EDGE) < AT ? 0.25 : 0.75);
            }
            vshi_windows_sum(&t->windows);
            for (int32_t i = 0; i < 2 * EDGE; ++i) {
                const int32_t along = i / 2, side = i % 2, across = AT - 1 + side;
                const vshi_window_estimate e =
                    estimate_at(t, turned ? along : across, turned ? across : along);
                const double off = side ? 0.75 - e.value : e.value - 0.25; /* to the other side */
                square += off * off / COUNT;
                bias += off / COUNT;
                blurred += (off > 0.1) / (double)COUNT;
            }
        }
        assert_true(sqrt(square) < 0.033 && fabs(bias) < 0.006 && blurred < 0.02);
    }
}

/* Texels whose rays are all free keep their value beside texels that are half hidden. */
TEST(open_texels_beside_an_edge_stay_open) {
    FREED table *t = make_table(EDGE, EDGE, 64);
    uint64_t counter = 4;
    for (int32_t i = 0; i < TEXELS; ++i) {
        t->texels[i].value = i % EDGE < 43 ? 1.0f : draw(&counter, 64, 0.5);
    }
    vshi_windows_sum(&t->windows);
    double most = 0.0;
    for (int32_t i = 0; i < TEXELS; ++i) {
        if (i % EDGE < 43) {
            most = fmax(most, 1.0 - estimate_at(t, i % EDGE, i / EDGE).value);
        }
    }
    assert_true(most < 0.01);
}

/* Slits that windows could go around: all links within a window are whole, and all its texels have rays. */
TEST(windows_hold_no_cut_and_no_hole) {
    FREED table *t = make_table(EDGE, EDGE, 16);
    uint64_t counter = 3;
    static uint8_t area[TEXELS];
    for (int32_t i = 0; i < TEXELS; ++i) {
        area[i] = uniform(&counter) >= 0.004;
    }
    cut(t, area);
    for (int32_t i = 0; i < TEXELS; ++i) {
        t->texels[i].left = t->texels[i].left && uniform(&counter) >= 0.01;
        t->texels[i].above = t->texels[i].above && uniform(&counter) >= 0.01;
    }
    fill(t, even, 6);
    size_t large = 0;
    for (int32_t i = 0; i < TEXELS; ++i) {
        if (area[i] == 0) {
            continue;
        }
        const vshi_window_estimate e = estimate_at(t, i % EDGE, i / EDGE);
        assert_true(e.x[0] <= i % EDGE && i % EDGE <= e.x[1] && e.y[0] <= i / EDGE && i / EDGE <= e.y[1]);
        assert_true(e.x[0] >= 0 && e.x[1] < EDGE && e.y[0] >= 0 && e.y[1] < EDGE);
        for (int32_t y = e.y[0]; y <= e.y[1]; ++y) {
            for (int32_t x = e.x[0]; x <= e.x[1]; ++x) {
                assert_true(abs(x - i % EDGE) <= VSHI_WINDOW_REACH && abs(y - i / EDGE) <= VSHI_WINDOW_REACH);
                assert_true(texel_at(t, x, y)->rays > 0);
                assert_true(x == e.x[0] || texel_at(t, x, y)->left);
                assert_true(y == e.y[0] || texel_at(t, x, y)->above);
            }
        }
        large += (e.x[1] - e.x[0] + 1) * (e.y[1] - e.y[0] + 1) >= 25;
    }
    assert_true(large > TEXELS / 2);
}

/* Eight rays that are all free do not mean that all would be. */
TEST(no_value_is_without_error) {
    table *alone = make_table(1, 1, 8);
    for (int32_t shared = 0; shared < 2; ++shared) {
        alone->texels[0].value = (float)shared;
        vshi_windows_sum(&alone->windows);
        const vshi_window_estimate e = estimate_at(alone, 0, 0);
        assert_true(e.value == shared && e.deviation > 0.08 && e.centred == e.deviation);
    }
    free(alone);
    for (int32_t k = 0; k < 2; ++k) {
        FREED table *t = make_table(EDGE, EDGE, 8);
        for (int32_t i = 0; i < TEXELS; ++i) {
            t->texels[i].value = (float)k;
        }
        vshi_windows_sum(&t->windows);
        for (int32_t i = 0; i < TEXELS; ++i) {
            const vshi_window_estimate e = estimate_at(t, i % EDGE, i / EDGE);
            assert_true(e.value == k && e.deviation > 0.0 && e.deviation < 0.01);
        }
    }
}

/* --- which texels hang together */

enum { WIDTH = 24, HEIGHT = 16, PIXELS = WIDTH * HEIGHT };

/* An image of points; `at` as vshi_links_find() wants it, points in another order than texels. */
typedef struct image {
    double positions[3 * PIXELS]; /* as laid, */
    float scaled[3 * PIXELS];     /* and from the first of them, at a scale */
    float normals[3 * PIXELS];
    uint32_t at[PIXELS];
    vshi_window_texel texels[PIXELS];
} image;

static size_t point_of(int32_t x, int32_t y) {
    return (size_t)(5 * (y * WIDTH + x) + 3) % PIXELS; /* 5 has no factor of the number of texels */
}

static void set_point(image *m, int32_t x, int32_t y, const double position[3], const double normal[3]) {
    const size_t i = point_of(x, y);
    memcpy(m->positions + 3 * i, position, 3 * sizeof(double));
    for (size_t axis = 0; axis < 3; ++axis) {
        m->normals[3 * i + axis] = (float)normal[axis];
    }
    m->at[y * WIDTH + x] = (uint32_t)i + 1;
}

static vshi_texel_map map_of(image *m, double scale) {
    for (size_t i = 0; i < 3 * PIXELS; ++i) {
        m->scaled[i] = (float)(scale * (m->positions[i] - m->positions[i % 3]));
    }
    return (vshi_texel_map){
        .width = WIDTH, .height = HEIGHT, .at = m->at, .position = m->scaled, .normal = m->normals};
}

static void find_links(image *m, double scale) {
    memset(m->texels, 0, sizeof m->texels);
    const vshi_texel_map map = map_of(m, scale);
    const vshi_texel_lattice all = {0, 0, 1, WIDTH, HEIGHT};
    vshi_links_find(&map, &all, m->texels);
}

/* Whether two neighbouring texels should hang together. */
typedef bool expected_fn(int32_t x0, int32_t y0, int32_t x1, int32_t y1);

/* At scales from a millionth to a million: links do not depend on them. */
static void assert_links(image *m, expected_fn *expected) {
    static const double scales[] = {1.0, 1e-6, 1e6, 0.37};
    for (size_t s = 0; s < COUNT_OF(scales); ++s) {
        find_links(m, scales[s]);
        for (int32_t y = 0; y < HEIGHT; ++y) {
            for (int32_t x = 0; x < WIDTH; ++x) {
                const vshi_window_texel *e = &m->texels[y * WIDTH + x];
                const bool left = x > 0 && expected(x - 1, y, x, y),
                           above = y > 0 && expected(x, y - 1, x, y);
                assert_that(e->left == left && e->above == above, "scale %g, texel %d, %d: left %d, above %d",
                            scales[s], x, y, e->left, e->above);
            }
        }
    }
}

static bool always(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return x0 >= 0 && y0 >= 0 && x1 < WIDTH && y1 < HEIGHT;
}

/* Columns before this are one chart, the others another. */
enum { BORDER = 11 };

static bool on_one_side(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return (x0 < BORDER) == (x1 < BORDER);
}

static bool on_one_side_of_rows(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return (y0 < BORDER) == (y1 < BORDER);
}

/* A point of a surface for each texel; `how` is what a layout takes. */
typedef void layout_fn(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]);

static void lay(image *m, layout_fn *layout, double first, double second) {
    for (int32_t i = 0; i < PIXELS; ++i) {
        double position[3] = {0}, normal[3] = {0.0, 1.0, 0.0};
        layout(i % WIDTH, i / WIDTH, (const double[2]){first, second}, position, normal);
        set_point(m, i % WIDTH, i / WIDTH, position, normal);
    }
}

/* A plane that stands askew, its steps how[0] and how[1] long; far from the origin. */
static void plane(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    const double a[3] = {0.6, 0.48, 0.64}, b[3] = {0.8, -0.36, -0.48};
    for (size_t axis = 0; axis < 3; ++axis) {
        position[axis] = 70.0 + how[0] * x * a[axis] + how[1] * y * b[axis];
    }
    memcpy(normal, (const double[3]){0.0, -0.8, 0.6}, 3 * sizeof *normal);
}

/* Of 60 texels around, whose neighbours' normals are 6 degrees apart. */
static void cylinder(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    normal[0] = position[0] = cos(0.1047 * x);
    normal[2] = position[2] = sin(0.1047 * x);
    normal[1] = 0.0;
    position[1] = 0.1 * y;
}

/* A floor whose chart goes on up a wall, in the image as in the world. */
static void floor_and_wall(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    const bool wall = x >= BORDER;
    position[wall ? 1 : 0] = 0.1 * (x - BORDER + 0.5);
    position[2] = 0.1 * y;
    normal[0] = wall ? -1.0 : 0.0;
    normal[1] = wall ? 0.0 : 1.0;
}

/* Two pieces of one floor: neighbours in the image, how[0] texels apart in the world, in rows if how[1]. */
static void pieces(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    const bool rows = how[1] != 0.0;
    position[0] = 0.1 * (x + (!rows && x >= BORDER ? how[0] - 1.0 : 0.0));
    position[2] = 0.1 * (y + (rows && y >= BORDER ? how[0] - 1.0 : 0.0));
}

/* Fine texels beside coarse ones, whose step the one between them is not too long for. */
static void sizes(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    const bool rows = how[1] != 0.0;
    const int32_t off = rows ? y - BORDER : x - BORDER;
    const double step = (off < 0) == (how[0] != 0.0) ? 1.0 : 0.1;
    position[rows ? 2 : 0] = off < 0 ? step * (off + 1) : 2.0 + step * off;
    position[rows ? 0 : 2] = step * (rows ? x : y);
}

/* Two floors, one how[0] over the other. */
static void two_floors(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    position[0] = 0.1 * x;
    position[1] = x < BORDER ? 0.0 : how[0];
    position[2] = 0.1 * y;
}

static void two_sides(int32_t x, int32_t y, const double how[2], double position[3], double normal[3]) {
    position[0] = 0.1 * x;
    position[2] = 0.1 * y;
    normal[1] = x < BORDER ? 1.0 : -1.0;
}

TEST(texels_are_linked_within_a_surface_and_not_between_two) {
    static const struct {
        layout_fn *layout;
        double how[2];
        expected_fn *expected;
    } cases[] = {
        {plane, {0.03, 0.03}, always},
        {plane, {0.09, 0.03}, always}, /* stretched */
        {plane, {0.03, 0.09}, always},
        {cylinder, {0.0, 0.0}, always},
        {floor_and_wall, {0.0, 0.0}, on_one_side},
        {pieces, {1000.0, 0.0}, on_one_side},
        {pieces, {10.0, 0.0}, on_one_side},
        {pieces, {5.0, 0.0}, on_one_side},
        {pieces, {-5.0, 0.0}, on_one_side},
        {pieces, {-300.0, 0.0}, on_one_side},
        {pieces, {1000.0, 1.0}, on_one_side_of_rows},
        {pieces, {10.0, 1.0}, on_one_side_of_rows},
        {pieces, {5.0, 1.0}, on_one_side_of_rows},
        {pieces, {-5.0, 1.0}, on_one_side_of_rows},
        {pieces, {-300.0, 1.0}, on_one_side_of_rows},
        {pieces, {2.0, 0.0}, always}, /* a texel that is left out of one surface makes no border */
        {sizes, {0.0, 0.0}, on_one_side},
        {sizes, {1.0, 0.0}, on_one_side},
        {sizes, {0.0, 1.0}, on_one_side_of_rows},
        {sizes, {1.0, 1.0}, on_one_side_of_rows},
        {two_floors, {0.05, 0.0}, on_one_side},
        {two_floors, {0.1, 0.0}, on_one_side},
        {two_floors, {0.3, 0.0}, on_one_side},
        {two_floors, {-0.05, 0.0}, on_one_side},
        {two_floors, {-2.0, 0.0}, on_one_side},
        {two_sides, {0.0, 0.0}, on_one_side},
    };
    static image m;
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        lay(&m, cases[i].layout, cases[i].how[0], cases[i].how[1]);
        assert_links(&m, cases[i].expected);
    }
}

static bool in_one_row(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return y0 == y1 && y0 % 2 == 0 && on_one_side(x0, y0, x1, y1);
}

static bool in_one_column(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return x0 == x1 && x0 % 2 == 0 && on_one_side_of_rows(x0, y0, x1, y1);
}

static bool in_one_later_row(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return x0 >= BORDER && in_one_row(x0, y0, x1, y1);
}

static bool in_one_lower_column(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return y0 >= BORDER && in_one_column(x0, y0, x1, y1);
}

/* Charts a texel wide, of which each has but one other step that tells how long they are; or of a texel. */
TEST(strips_that_are_apart_on_the_surface_are_not_linked) {
    static image m;
    static expected_fn *const expected[2][2] = {{in_one_row, in_one_later_row},
                                                {in_one_column, in_one_lower_column}};
    for (int32_t turned = 0; turned < 2; ++turned) {
        for (int32_t lone = 0; lone < 2; ++lone) {
            lay(&m, pieces, 50.0, turned);
            for (int32_t i = 0; i < PIXELS; ++i) {
                const int32_t along = turned ? i / WIDTH : i % WIDTH, across = turned ? i % WIDTH : i / WIDTH;
                const bool gone = across % 2 != 0 || (lone && along < BORDER - 1);
                m.at[i] = gone ? 0 : m.at[i];
            }
            assert_links(&m, expected[turned][lone]);
        }
    }
}

static bool is_hole(int32_t x, int32_t y) {
    return (x * 7 + y * 3) % 11 == 0 || x == 5;
}

static bool without_holes(int32_t x0, int32_t y0, int32_t x1, int32_t y1) {
    return !is_hole(x0, y0) && !is_hole(x1, y1);
}

TEST(texels_without_a_point_have_no_links) {
    static image m;
    lay(&m, plane, 0.03, 0.03);
    for (int32_t i = 0; i < PIXELS; ++i) {
        m.at[i] = is_hole(i % WIDTH, i / WIDTH) ? 0 : m.at[i];
    }
    assert_links(&m, without_holes);
}

/* A column of texels without points, as under the wall of a shed, lies between those of a lattice. */
TEST(lattices_are_not_linked_over_a_gap_between_their_texels) {
    enum { SPACING = 4, GAP = 10, COLUMNS = WIDTH / SPACING, ROWS = HEIGHT / SPACING };
    static image m;
    lay(&m, plane, 0.03, 0.03);
    for (int32_t y = 0; y < HEIGHT; ++y) {
        m.at[y * WIDTH + GAP] = 0;
    }
    const vshi_texel_map map = map_of(&m, 1.0);
    const vshi_texel_lattice lattice = {0, 0, SPACING, COLUMNS, ROWS};
    vshi_window_texel texels[COLUMNS * ROWS] = {{0}};
    vshi_links_find(&map, &lattice, texels);
    for (int32_t y = 0; y < ROWS; ++y) {
        for (int32_t x = 0; x < COLUMNS; ++x) {
            const bool over = GAP / SPACING == x - 1;
            assert_int_equal(texels[y * COLUMNS + x].left, x > 0 && !over);
            assert_int_equal(texels[y * COLUMNS + x].above, y > 0);
            if (x + 1 < COLUMNS && y + 1 < ROWS) {
                const int32_t from[2] = {SPACING * x + 1, SPACING * y + 1},
                              to[2] = {SPACING * (x + 1), SPACING * (y + 1)};
                const bool gap = GAP / SPACING == x;
                assert_int_equal(vshi_links_whole(&map, SPACING * x, SPACING * y, SPACING), !gap);
                assert_int_equal(vshi_links_lead(&map, from, to), !gap);
            }
        }
    }
}
