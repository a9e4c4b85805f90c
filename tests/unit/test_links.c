/* Which neighbouring texels hang together: charts as an atlas may lay them out, whose surfaces are known. */
#include "shade/links.h"
#include "testing.h"

enum { WIDTH = 24, HEIGHT = 16, TEXELS = WIDTH * HEIGHT };

/* An image of points; `at` as vshi_links_find() wants it, points in another order than texels. */
typedef struct image {
    double positions[3 * TEXELS]; /* as laid, */
    float scaled[3 * TEXELS];     /* and from the first of them, at a scale */
    float normals[3 * TEXELS];
    uint32_t at[TEXELS];
    vshi_window_texel texels[TEXELS];
} image;

static size_t point_of(int32_t x, int32_t y) {
    return (size_t)(5 * (y * WIDTH + x) + 3) % TEXELS; /* 5 has no factor of the number of texels */
}

static void set(image *m, int32_t x, int32_t y, const double position[3], const double normal[3]) {
    const size_t i = point_of(x, y);
    memcpy(m->positions + 3 * i, position, 3 * sizeof(double));
    for (size_t axis = 0; axis < 3; ++axis) {
        m->normals[3 * i + axis] = (float)normal[axis];
    }
    m->at[y * WIDTH + x] = (uint32_t)i + 1;
}

static vshi_texel_map map_of(image *m, double scale) {
    for (size_t i = 0; i < 3 * TEXELS; ++i) {
        m->scaled[i] = (float)(scale * (m->positions[i] - m->positions[i % 3]));
    }
    return (vshi_texel_map){
        .width = WIDTH, .height = HEIGHT, .at = m->at, .position = m->scaled, .normal = m->normals};
}

static void find(image *m, double scale) {
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
    for (size_t s = 0; s < sizeof scales / sizeof scales[0]; ++s) {
        find(m, scales[s]);
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
    for (int32_t i = 0; i < TEXELS; ++i) {
        double position[3] = {0}, normal[3] = {0.0, 1.0, 0.0};
        layout(i % WIDTH, i / WIDTH, (const double[2]){first, second}, position, normal);
        set(m, i % WIDTH, i / WIDTH, position, normal);
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

TEST(texels_of_one_surface_hang_together_and_those_of_two_do_not) {
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
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
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
TEST(strips_that_touch_but_lie_apart_do_not) {
    static image m;
    static expected_fn *const expected[2][2] = {{in_one_row, in_one_later_row},
                                                {in_one_column, in_one_lower_column}};
    for (int32_t turned = 0; turned < 2; ++turned) {
        for (int32_t lone = 0; lone < 2; ++lone) {
            lay(&m, pieces, 50.0, turned);
            for (int32_t i = 0; i < TEXELS; ++i) {
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

TEST(texels_without_a_point_hang_together_with_none) {
    static image m;
    lay(&m, plane, 0.03, 0.03);
    for (int32_t i = 0; i < TEXELS; ++i) {
        m.at[i] = is_hole(i % WIDTH, i / WIDTH) ? 0 : m.at[i];
    }
    assert_links(&m, without_holes);
}

/* A column of texels without points, as under the wall of a shed, lies between those of a lattice. */
TEST(lattices_do_not_hang_together_over_a_gap_between_their_texels) {
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
