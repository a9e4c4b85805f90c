/* Padding: texels outside the charts take their nearest neighbour's value. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bake/padding.h"

static const float HOLE = -7.0f; /* what an unfilled texel holds; no valid texel does */

static void fill(const vsh_run *run, int32_t width, int32_t height, const uint8_t *state, int32_t padding,
                 int32_t invalid, float *values, size_t channels) {
    const int32_t radius[VSHI_TEXEL_KINDS] = {padding, 0, invalid};
    const vshi_plane plane = {values, channels};
    assert_int_equal(vshi_padding_fill(run, width, height, state, radius, &plane, 1, NULL), VSH_OK);
}

/* The definition, texel by texel: index of the source, or -1. */
static int64_t nearest(int32_t width, int32_t height, const uint8_t *state, int64_t at, int32_t radius) {
    int64_t best = (int64_t)radius * radius + 1, source = -1;
    for (int64_t i = 0; i < (int64_t)width * height; ++i) {
        const int64_t dx = i % width - at % width, dy = i / width - at / width;
        if (state[i] == VSHI_TEXEL_VALID && dx * dx + dy * dy < best) {
            best = dx * dx + dy * dy;
            source = i;
        }
    }
    return source;
}

static void every_texel_takes_the_nearest_value_and_the_first_of_equally_near_ones(void **unused) {
    (void)unused;
    const int32_t sizes[][2] = {{1, 1}, {37, 23}, {130, 70}, {1, 50}, {50, 1}};
    const int32_t radii[][2] = {{0, 8}, {1, 8}, {2, 0}, {5, 8}, {7, 3}, {4096, 4096}};
    uint32_t random = 12345;
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; ++s) {
        const int32_t width = sizes[s][0], height = sizes[s][1];
        const size_t count = (size_t)width * (size_t)height;
        uint8_t *state = malloc(count);
        float *values = malloc(count * sizeof *values);
        for (size_t r = 0; r < sizeof radii / sizeof radii[0]; ++r) {
            for (size_t i = 0; i < count; ++i) {
                random = random * 1664525u + 1013904223u;
                const uint32_t dice = (random >> 16) % 50;
                state[i] = dice == 0 ? VSHI_TEXEL_VALID : dice < 10 ? VSHI_TEXEL_INVALID : VSHI_TEXEL_EMPTY;
                values[i] = state[i] == VSHI_TEXEL_VALID ? (float)i : HOLE;
            }
            fill(NULL, width, height, state, radii[r][0], radii[r][1], values, 1);
            for (size_t i = 0; i < count; ++i) {
                const int32_t radius = state[i] == VSHI_TEXEL_EMPTY ? radii[r][0] : radii[r][1];
                const int64_t source = state[i] == VSHI_TEXEL_VALID ? (int64_t)i
                                       : radius > 0 ? nearest(width, height, state, (int64_t)i, radius)
                                                    : -1;
                assert_true(values[i] == (source < 0 ? HOLE : (float)source));
            }
        }
        free(values);
        free(state);
    }
}

static void a_ring_is_exactly_as_wide_as_asked(void **unused) {
    (void)unused;
    enum { SIZE = 41, PADDING = 5 };
    uint8_t state[SIZE * SIZE] = {0};
    float values[SIZE * SIZE];
    for (int i = 0; i < SIZE * SIZE; ++i) {
        values[i] = HOLE;
    }
    state[20 * SIZE + 20] = VSHI_TEXEL_VALID;
    values[20 * SIZE + 20] = 3.0f;
    fill(NULL, SIZE, SIZE, state, PADDING, 0, values, 1);
    for (int i = 0; i < SIZE * SIZE; ++i) {
        const int dx = i % SIZE - 20, dy = i / SIZE - 20;
        assert_true(values[i] == (dx * dx + dy * dy <= PADDING * PADDING ? 3.0f : HOLE));
    }
}

static void dark_texels_are_no_holes(void **unused) {
    (void)unused;
    uint8_t state[16] = {0};
    float values[16];
    for (int i = 0; i < 16; ++i) {
        values[i] = HOLE;
    }
    state[5] = state[6] = VSHI_TEXEL_VALID;
    values[5] = 0.0f; /* fully dark beside a lit one: keeps its value and hands it on */
    values[6] = 1.0f;
    fill(NULL, 16, 1, state, 3, 0, values, 1);
    for (int i = 0; i < 16; ++i) {
        assert_true(values[i] == (i < 2 || i > 9 ? HOLE : i <= 5 ? 0.0f : 1.0f));
    }
}

static void the_state_is_left_as_it_is_and_all_channels_are_copied(void **unused) {
    (void)unused;
    uint8_t state[9] = {VSHI_TEXEL_VALID, 0, 0, 0, VSHI_TEXEL_INVALID, 0, 0, 0, 0}, before[9];
    float values[27];
    for (int i = 0; i < 27; ++i) {
        values[i] = i < 3 ? (float)(i + 1) : HOLE;
    }
    memcpy(before, state, sizeof state);
    fill(NULL, 3, 3, state, 8, 8, values, 3);
    assert_memory_equal(state, before, sizeof state);
    for (int i = 0; i < 27; ++i) {
        assert_true(values[i] == (float)(i % 3 + 1));
    }
}

static void any_number_of_threads_gives_the_same_bits(void **unused) {
    (void)unused;
    enum { WIDTH = 300, HEIGHT = 211, COUNT = WIDTH * HEIGHT };
    const int32_t threads[] = {1, 2, 5};
    uint8_t *state = calloc(COUNT, 1);
    float *values[3];
    for (int t = 0; t < 3; ++t) {
        values[t] = malloc(COUNT * sizeof(float));
        for (uint32_t i = 0; i < COUNT; ++i) {
            state[i] = i * 2654435761u >> 26 == 0 ? VSHI_TEXEL_VALID : VSHI_TEXEL_EMPTY;
            values[t][i] = (float)i;
        }
        vsh_run run = vsh_run_default();
        run.threads = threads[t];
        fill(&run, WIDTH, HEIGHT, state, 9, 0, values[t], 1);
        assert_memory_equal(values[0], values[t], COUNT * sizeof(float));
    }
    for (int t = 0; t < 3; ++t) {
        free(values[t]);
    }
    free(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_texel_takes_the_nearest_value_and_the_first_of_equally_near_ones),
        cmocka_unit_test(a_ring_is_exactly_as_wide_as_asked),
        cmocka_unit_test(dark_texels_are_no_holes),
        cmocka_unit_test(the_state_is_left_as_it_is_and_all_channels_are_copied),
        cmocka_unit_test(any_number_of_threads_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
