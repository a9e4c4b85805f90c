/* Padding: texels outside the charts take their nearest neighbour's value. */

#include "bake/padding.h"
#include "testing.h"

static const float HOLE = -7.0f; /* what an unfilled texel holds; no valid texel does */

static void fill(const vsh_run *run, int32_t width, int32_t height, const uint8_t *states, int32_t padding,
                 int32_t invalid, float *values, size_t channels) {
    const int32_t radius[VSHI_TEXEL_KINDS] = {padding, 0, invalid};
    const vshi_plane plane = {values, channels};
    vshi_store store = {.run = run};
    assert_int_equal(vshi_padding_fill(&store, run, width, height, states, radius, &plane, 1, NULL, NULL),
                     VSH_OK);
    vshi_store_close(&store);
}

/* The definition, texel by texel: index of the source, or -1. */
static int64_t nearest(int32_t width, int32_t height, const uint8_t *states, int64_t at, int32_t radius) {
    int64_t best = (int64_t)radius * radius + 1, source = -1;
    for (int64_t i = 0; i < (int64_t)width * height; ++i) {
        const int64_t dx = i % width - at % width, dy = i / width - at / width;
        if (states[i] == VSHI_TEXEL_VALID && dx * dx + dy * dy < best) {
            best = dx * dx + dy * dy;
            source = i;
        }
    }
    return source;
}

TEST(every_texel_takes_the_nearest_value_and_the_first_of_equally_near_ones) {
    const int32_t sizes[][2] = {{1, 1}, {37, 23}, {130, 70}, {1, 50}, {50, 1}};
    const int32_t radii[][2] = {{0, 8}, {1, 8}, {2, 0}, {5, 8}, {7, 3}, {4096, 4096}};
    uint32_t random = 12345;
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; ++s) {
        const int32_t width = sizes[s][0], height = sizes[s][1];
        const size_t count = (size_t)width * (size_t)height;
        FREED uint8_t *states = malloc(count);
        FREED float *values = malloc(count * sizeof *values);
        for (size_t r = 0; r < sizeof radii / sizeof radii[0]; ++r) {
            for (size_t i = 0; i < count; ++i) {
                random = random * 1664525u + 1013904223u;
                const uint32_t dice = (random >> 16) % 50;
                states[i] = dice == 0 ? VSHI_TEXEL_VALID : dice < 10 ? VSHI_TEXEL_INVALID : VSHI_TEXEL_EMPTY;
                values[i] = states[i] == VSHI_TEXEL_VALID ? (float)i : HOLE;
            }
            fill(NULL, width, height, states, radii[r][0], radii[r][1], values, 1);
            for (size_t i = 0; i < count; ++i) {
                const int32_t radius = states[i] == VSHI_TEXEL_EMPTY ? radii[r][0] : radii[r][1];
                const int64_t source = states[i] == VSHI_TEXEL_VALID ? (int64_t)i
                                       : radius > 0 ? nearest(width, height, states, (int64_t)i, radius)
                                                    : -1;
                assert_true(values[i] == (source < 0 ? HOLE : (float)source));
            }
        }
    }
}

/* A dark texel beside a lit one keeps its value and hands it on, of all channels; the states stays. */
TEST(dark_texels_are_no_holes_and_all_channels_are_copied) {
    uint8_t states[16] = {0}, before[16];
    float values[3 * 16];
    states[5] = states[6] = VSHI_TEXEL_VALID;
    states[8] = VSHI_TEXEL_INVALID;
    memcpy(before, states, sizeof states);
    for (int i = 0; i < 3 * 16; ++i) {
        values[i] = i / 3 == 5 ? 0.0f : i / 3 == 6 ? 1.0f + (float)(i % 3) : HOLE;
    }
    fill(NULL, 16, 1, states, 3, 8, values, 3);
    assert_memory_equal(states, before, sizeof states);
    for (int i = 0; i < 3 * 16; ++i) {
        const int texel = i / 3;
        assert_true(values[i] == (texel < 2 || texel > 9 ? HOLE : texel <= 5 ? 0.0f : 1.0f + (float)(i % 3)));
    }
}

/* --- Where invalid texels take their values from: within their chart, and how far. */

enum { MOST = 4096, NOWHERE = -1 };

/* A lightmap. A letter is a texel of the mesh of that letter, valid in upper case, invalid in lower case. A
 * blank is empty. */
typedef struct map {
    uint32_t mesh[MOST];
    uint8_t state[MOST];
    int from[MOST]; /* the texel that each takes its value from */
} map;

static map spread_over(size_t width, const char *letters) {
    static map m;
    const size_t count = strlen(letters);
    assert_true(count <= MOST);
    memset(&m, 0, sizeof m);
    for (size_t i = 0; i < count; ++i) {
        const bool empty = letters[i] == ' ', valid = letters[i] < 'a';
        m.from[i] = NOWHERE;
        m.state[i] = empty ? VSHI_TEXEL_EMPTY : valid ? VSHI_TEXEL_VALID : VSHI_TEXEL_INVALID;
        m.mesh[i] = empty ? 0 : 1 + (uint32_t)(letters[i] - (valid ? 'A' : 'a'));
    }
    vshi_spread spread;
    vshi_store store = {.run = NULL};
    assert_ok(vshi_spread_find(&store, width, count / width, m.mesh, m.state, &spread, &failure));
    for (size_t i = 0; i < spread.count; ++i) {
        assert_int_equal(m.state[spread.texel[i]], VSHI_TEXEL_INVALID);
        assert_int_equal(m.from[spread.texel[i]], NOWHERE);
        m.from[spread.texel[i]] = (int)spread.source[i];
    }
    vshi_spread_free(&store, &spread);
    vshi_store_close(&store);
    return m;
}

TEST(an_invalid_texel_is_filled_from_at_most_64_texels_away) {
    char letters[201] = "A";
    memset(letters + 1, 'a', 199);
    const map across = spread_over(200, letters), down = spread_over(1, letters);
    for (int i = 1; i < 200; ++i) {
        assert_int_equal(across.from[i], i <= 64 ? 0 : NOWHERE);
        assert_int_equal(down.from[i], i <= 64 ? 0 : NOWHERE);
    }
}

TEST(texels_of_other_charts_are_never_taken_from) {
    /* another mesh touches; another chart of the same mesh does not */
    const map m = spread_over(10, "Aaaaaa    "
                                  "BBBBBB AAA"
                                  "          "
                                  "aaaaaaa   ");
    for (int i = 1; i <= 36; ++i) {
        assert_true((i > 5 && i < 30) || m.from[i] == (i <= 5 ? 0 : NOWHERE));
    }
    /* over two arms of one chart the way goes around, not across */
    const map arms = spread_over(9, "AAAAAAAA "
                                    "        A"
                                    "aaaaaaaa ");
    assert_int_equal(arms.from[25], 17);
    assert_int_equal(arms.from[18], 17);
}

TEST(the_nearest_valid_texel_of_a_chart_is_taken_and_the_first_of_equals) {
    static const int FROM[21] = {NOWHERE, 0,  0,  0,  6,  6,  NOWHERE, /* */
                                 0,       0,  0,  0,  6,  6,  6,       /* */
                                 NOWHERE, 14, 14, 14, 20, 20, NOWHERE};
    const map m = spread_over(7, "AaaaaaA"
                                 "aaaaaaa"
                                 "AaaaaaA");
    assert_memory_equal(m.from, FROM, sizeof FROM);
}

TEST(values_are_copied_from_texels_that_have_one) {
    uint8_t states[4] = {VSHI_TEXEL_VALID, VSHI_TEXEL_INVALID, VSHI_TEXEL_INVALID, VSHI_TEXEL_INVALID};
    float values[8] = {1.0f, 2.0f, 0.0f, 0.0f, 0.0f, 0.0f, 5.0f, 6.0f};
    uint32_t texels[2] = {1, 2}, sources[2] = {0, 3}; /* the second one lost its value to a method */
    const vshi_spread spread = {2, texels, sources};
    const vshi_plane plane = {values, 2};
    vshi_spread_copy(&spread, states, &plane, 1);
    static const float AFTER[8] = {1.0f, 2.0f, 1.0f, 2.0f, 0.0f, 0.0f, 5.0f, 6.0f};
    assert_memory_equal(values, AFTER, sizeof values);
    assert_int_equal(states[1], VSHI_TEXEL_FILLED);
    assert_int_equal(states[2], VSHI_TEXEL_INVALID);
}
