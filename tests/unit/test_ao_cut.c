/* AO that texels share, of parts of a lightmap: what they leave and how it is finished. Without Embree there
 * is nothing to test. */
#include "ao_stage.h"
#include "shade/ao.h"

/* What all pieces keep of their texels. */
static vshi_ao_shot shots_kept[TEXELS];
static uint8_t rows_left[HEIGHT / 8];

/* The bands of a piece. */
static void bake_piece(const stage *s, const vsh_charts *charts, const vsh_shade_options *shade, how h,
                       vshi_ao_cut cut, baked *b) {
    static vshi_ao_shot shots[TEXELS];
    for (int32_t first = cut.first; first < cut.end; first += h.rows) {
        const int32_t rows = cut.end - first < h.rows ? cut.end - first : h.rows;
        vsh_texels *texels = NULL;
        assert_int_equal(vshi_texels_create_part(charts, first, rows, &cut, NULL, &texels, NULL), VSH_OK);
        memset(shots, 0xff, sizeof shots);
        bake_rows(s, texels, shade, first, h.threads, true, shots, b);
        vsh_texels_free(texels);
        const vshi_ao_shot *next = shots;
        for (int32_t row = first; row < first + rows; ++row) {
            if (vshi_ao_cut_kept(&cut, row + 1) > vshi_ao_cut_kept(&cut, row)) {
                memcpy(shots_kept + row * WIDTH, next, WIDTH * sizeof *next);
                next += WIDTH;
            }
            rows_left[row / 8] = vshi_ao_cut_leaves(&cut, row / 8);
        }
    }
}

/* Pieces by themselves, then what they left. */
static baked *bake_pieces(const stage *s, how h, int32_t pieces) {
    const vsh_lightmap_options options = options_of(h);
    baked *b = begin_baked(false);
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(s->receivers, RECEIVERS, &options, NULL, NULL, &charts, NULL), VSH_OK);
    memset(shots_kept, 0, sizeof shots_kept);
    for (int32_t first = 0; first < HEIGHT; first += pieces) {
        const int32_t end = HEIGHT - first < pieces ? HEIGHT : first + pieces;
        bake_piece(s, charts, &options.shade, h, (vshi_ao_cut){h.spacing, HEIGHT, first, end}, b);
    }
    assert_true(vshi_ao_shots_are_sound(shots_kept, TEXELS, h.spacing));
    const vshi_ao_left left = {WIDTH, HEIGHT, h.spacing, shots_kept, rows_left, 0, HEIGHT / 8};
    vsh_run run = vsh_run_default();
    run.threads = h.threads;
    vsh_bake_error sum = {0};
    vsh_error error;
    if (vshi_ao_finish(&left, &options.shade, &run, b->ao, b->error, &b->stats, &sum, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_charts_free(charts);
    return b;
}

/* Those that shoot for themselves alone, and leave what their ends part. */
static void pieces_put_together_change_no_bit(void **state) {
    static const int32_t spacings[] = {2, 4, 8}, pieces[] = {8, 16, 40, 72, 104}, rows[] = {HEIGHT, 16};
    static const double errors[] = {0.006, 0.03, 0.1};
    for (size_t k = 0; k < 9; ++k) {
        how h = {.spacing = spacings[k / 3], .max_error = errors[k % 3], .threads = 2, .parts = true};
        h.rows = HEIGHT; /* a part of all, which fills no texel */
        baked *whole = bake(*state, h);
        for (size_t p = 0; p < 10; ++p) {
            h.rows = rows[p % 2];
            baked *together = bake_pieces(*state, h, pieces[p / 2]);
            assert_same(whole, together);
            free(together);
        }
        free(whole);
    }
}

/* What is kept of rows is what a cut says, whatever it is: as many as are left beside it, and those that
 * windows over them take in. */
static void rows_are_kept_that_windows_over_those_left_take_in(void **state) {
    (void)state;
    enum { ROWS = 50 };
    size_t left = 0, alone = 0;
    for (int32_t n = 0; n < 3 * 400; ++n) {
        const int32_t spacing = 2 << n / 400, first = n % 20, size = 1 + n % 400 / 20;
        const vshi_ao_cut pieces[3] = {{spacing, 8 * ROWS, 0, 8 * first},
                                       {spacing, 8 * ROWS, 8 * first, 8 * (first + size)},
                                       {spacing, 8 * ROWS, 8 * (first + size), 8 * ROWS}};
        bool kept[ROWS + 1] = {false}, leaves[ROWS] = {false};
        for (size_t p = first > 0 ? 0 : 1; p < 3; ++p) {
            const vshi_ao_cut *cut = &pieces[p];
            for (int32_t row = cut->first / 8; row < cut->end / 8; ++row) {
                leaves[row] = vshi_ao_cut_leaves(cut, row);
                kept[row] = vshi_ao_cut_kept(cut, 8 * row + 8) == vshi_ao_cut_kept(cut, 8 * row) + 8;
                assert_true(kept[row] ||
                            vshi_ao_cut_kept(cut, 8 * row + 8) == vshi_ao_cut_kept(cut, 8 * row));
            }
        }
        for (int32_t row = 0; row < ROWS; ++row) {
            const int32_t low = row > spacing ? row - spacing : 0;
            const int32_t high = row + spacing + 1 < ROWS ? row + spacing + 1 : ROWS - 1;
            const bool parted =
                (first > low && first <= high) || (first + size > low && first + size <= high);
            assert_int_equal(leaves[row], parted);
            for (int32_t beside = low; beside <= high && parted; ++beside) {
                assert_true(kept[beside]);
            }
            left += parted;
            alone += !parted;
        }
    }
    assert_true(left > 1000 && alone > 1000);
}

/* Numbers of a file of nobody's. */
static void what_no_bake_left_is_not_sound(void **state) {
    (void)state;
    const vshi_ao_shot good = {.normal = {0, 0, 1}, .shot = 0.5f, .rays = 16, .level = 4};
    const struct {
        float shot;
        int32_t rays;
        uint32_t level;
    } bad[] = {{0.5f, 16, 8},   {0.5f, 16, 3}, {0.5f, 16, 0},  {0.5f, -1, 4},     {0.5f, 1 << 25, 4},
               {0.5f, 16, 255}, {NAN, 16, 4},  {-0.1f, 16, 4}, {INFINITY, 16, 1}, {1.5f, 16, 4}};
    assert_true(vshi_ao_shots_are_sound(&good, 1, 4));
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        vshi_ao_shot shots[2] = {good, good};
        shots[i % 2].shot = bad[i].shot;
        shots[i % 2].rays = bad[i].rays;
        shots[i % 2].level = bad[i].level;
        assert_false(vshi_ao_shots_are_sound(shots, 2, 4));
    }
}

/* Texels of a file of nobody's, all of which are sound: whatever comes of it, it is a number. */
static void shots_of_strangers_come_to_numbers(void **state) {
    (void)state;
    static const float places[] = {0.0f, NAN, INFINITY, -1e30f, 1.0f};
    static const uint32_t levels[] = {0, 1, 2, 4, VSHI_AO_KNOWN_LEVEL};
    static vshi_ao_shot shots[TEXELS];
    static float ao[TEXELS], deviation[TEXELS];
    uint8_t wanted[HEIGHT / 8];
    uint32_t seed = 1;
    memset(wanted, 1, sizeof wanted);
    for (size_t i = 0; i < TEXELS; ++i) {
        seed = 1664525u * seed + 1013904223u;
        const uint32_t level = levels[(seed >> 8) % 5], rays = level == 0 || level > 4 ? 0 : seed >> 16 & 31;
        shots[i] = (vshi_ao_shot){.position = {(double)(i % WIDTH), (double)(i / WIDTH), 0.0},
                                  .normal = {0.0f, places[(seed >> 24) % 5], 1.0f},
                                  .shot = (float)(seed >> 28) / 15.0f,
                                  .rays = (int32_t)rays,
                                  .level = level,
                                  .held = {seed & 0x4000000f, (seed & 63) | (seed & 63) << 16}};
    }
    assert_true(vshi_ao_shots_are_sound(shots, TEXELS, 4));
    const vshi_ao_left left = {WIDTH, HEIGHT, 4, shots, wanted, 0, HEIGHT / 8};
    const vsh_lightmap_options options = options_of((how){.spacing = 4, .max_error = 0.02});
    vsh_run run = vsh_run_default();
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vsh_bake_error sum = {0};
    vsh_error error;
    assert_int_equal(vshi_ao_finish(&left, &options.shade, &run, ao, deviation, &stats, &sum, &error),
                     VSH_OK);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(ao[i] >= 0.0f && ao[i] <= 1.0f && deviation[i] >= 0.0f);
    }
    assert_true(sum.held > 0.0 && isfinite(sum.held_square_error) && isfinite(stats.square_error));
    shots[0] = (vshi_ao_shot){.rays = 8, .level = 1, .held = {1, 65}}; /* of 64 rays */
    assert_int_equal(vshi_ao_finish(&left, &options.shade, &run, ao, deviation, &stats, &sum, &error),
                     VSH_ERROR_INPUT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_are_kept_that_windows_over_those_left_take_in),
        cmocka_unit_test(what_no_bake_left_is_not_sound),
        cmocka_unit_test(shots_of_strangers_come_to_numbers),
        cmocka_unit_test(pieces_put_together_change_no_bit),
    };
    return vsh_triangles_available() ? cmocka_run_group_tests(tests, set_up, tear_down) : 0;
}
