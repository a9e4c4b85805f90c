/* AO that texels share, of parts of a lightmap: what they leave and how it is finished. Without Embree there
 * is nothing to test. */
#include "ao_stage.h"
#include "shade/ao.h"

enum { MOST_BYTES = 104, HELD = 64 /* rays that hold a texel against the casters */ };

/* What all pieces keep of their texels. */
static unsigned char rows_kept[TEXELS * MOST_BYTES];
static uint8_t rows_left[HEIGHT / 8];

/* The bands of a piece. */
static void bake_piece(const stage *s, const vsh_charts *charts, const vsh_shade_options *shade, how h,
                       vshi_ao_cut cut, baked *b) {
    static unsigned char kept[TEXELS * MOST_BYTES];
    const size_t bytes = WIDTH * vshi_ao_kept_bytes(cut.kinds);
    assert_true(bytes <= WIDTH * MOST_BYTES);
    for (int32_t first = cut.first; first < cut.end; first += h.rows) {
        const int32_t rows = cut.end - first < h.rows ? cut.end - first : h.rows;
        vsh_texels *texels = NULL;
        assert_int_equal(vshi_texels_create_part(charts, first, rows, &cut, NULL, &texels, NULL), VSH_OK);
        memset(kept, 0xff, sizeof kept);
        bake_rows(s, texels, shade, first, h.threads, true, kept, b);
        vsh_texels_free(texels);
        const unsigned char *next = kept;
        for (int32_t row = first; row < first + rows; ++row) {
            if (vshi_ao_cut_kept(&cut, row + 1) > vshi_ao_cut_kept(&cut, row)) {
                memcpy(rows_kept + (size_t)row * bytes, next, bytes);
                next += bytes;
            }
            rows_left[row / 8] = vshi_ao_cut_leaves(&cut, row / 8);
        }
    }
}

/* Pieces by themselves, before what they left is finished. */
static baked *bake_alone(const stage *s, how h, int32_t pieces, uint32_t *kinds) {
    const vsh_lightmap_options options = options_of(h);
    baked *b = begin_baked(h.planes);
    const vsh_lightmap planes = planes_of(b, 0);
    *kinds = vshi_part_kinds(&planes);
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(s->receivers, RECEIVERS, &options, NULL, NULL, &charts, NULL), VSH_OK);
    memset(rows_kept, 0, sizeof rows_kept);
    for (int32_t first = 0; first < HEIGHT; first += pieces) {
        const int32_t end = HEIGHT - first < pieces ? HEIGHT : first + pieces;
        bake_piece(s, charts, &options.shade, h, (vshi_ao_cut){h.spacing, HEIGHT, first, end, *kinds}, b);
    }
    vsh_charts_free(charts);
    return b;
}

static baked *bake_pieces(const stage *s, how h, int32_t pieces) {
    const vsh_lightmap_options options = options_of(h);
    uint32_t kinds;
    baked *b = bake_alone(s, h, pieces, &kinds);
    for (size_t row = 0; row < HEIGHT; ++row) {
        const vshi_ao_kept kept = vshi_ao_kept_row(kinds, WIDTH, rows_kept, row);
        assert_true(vshi_ao_kept_is_sound(&kept, WIDTH, h.spacing, HELD));
    }
    const vshi_ao_left left = {WIDTH, HEIGHT, h.spacing, kinds, rows_kept, rows_left, 0, HEIGHT / 8};
    const vsh_lightmap planes = planes_of(b, 0);
    vsh_run run = vsh_run_default();
    run.threads = h.threads;
    vsh_bake_error sums[2];
    memset(sums, 0, sizeof sums);
    vsh_error error;
    if (vshi_ao_finish(&left, &options.shade, &run, &planes, &b->stats, sums, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return b;
}

/* Those that shoot for themselves alone, and leave what their ends part. */
static void pieces_put_together_change_no_bit(void **state) {
    static const int32_t spacings[] = {2, 4, 8}, pieces[] = {8, 16, 40, 72, 104}, rows[] = {HEIGHT, 16};
    static const double errors[] = {0.006, 0.03, 0.1};
    for (size_t k = 0; k < 9; ++k) {
        how h = {.spacing = spacings[k / 3], .max_error = errors[k % 3], .threads = 2, .parts = true};
        h.rows = HEIGHT; /* a part of all, which fills no texel */
        h.planes = k % 3 != 1 ? WITHOUT_BENT : 0;
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

/* Of the sky, and of bent normals in either space, with and without AO. */
static void so_do_those_of_what_is_made_of_ao(void **state) {
    static const uint32_t planes[] = {WITH_SKY | TANGENT_SPACE, WITHOUT_AO,
                                      WITH_SKY | WITHOUT_AO | WITHOUT_BENT, WITH_SKY | WITHOUT_BENT};
    static const int32_t pieces[] = {8, 40, 104};
    for (size_t k = 0; k < 4; ++k) {
        how h = {
            .spacing = k == 3 ? 8 : 4, .max_error = 0.03, .threads = 2, .parts = true, .planes = planes[k]};
        h.rows = HEIGHT;
        baked *whole = bake(*state, h);
        for (size_t p = 0; p < 3; ++p) {
            h.rows = p == 1 ? 16 : HEIGHT;
            baked *together = bake_pieces(*state, h, pieces[p]);
            assert_same(whole, together);
            free(together);
        }
        free(whole);
    }
}

/* A piece that is known at once and one that is left take the same values in any bands. */
static void bands_of_a_piece_leave_the_same(void **state) {
    static unsigned char first[sizeof rows_kept];
    how h = {
        .spacing = 2, .max_error = 0.03, .threads = 2, .rows = HEIGHT, .planes = WITH_SKY | TANGENT_SPACE};
    uint32_t kinds;
    baked *whole = bake_alone(*state, h, 104, &kinds);
    size_t known = 0;
    for (size_t row = 0; row < HEIGHT / 8; ++row) {
        known += !rows_left[row];
    }
    assert_true(known > 4);
    memcpy(first, rows_kept, sizeof first);
    for (h.rows = 8; h.rows < 64; h.rows *= 2) {
        baked *banded = bake_alone(*state, h, 104, &kinds);
        assert_same(whole, banded);
        assert_memory_equal(first, rows_kept, sizeof first);
        free(banded);
    }
    free(whole);
}

/* What is kept of rows is what a cut says, whatever it is: as many as are left beside it, and those that
 * windows over them take in. */
static void rows_are_kept_that_windows_over_those_left_take_in(void **state) {
    (void)state;
    enum { ROWS = 50 };
    size_t left = 0, alone = 0;
    for (int32_t n = 0; n < 3 * 400; ++n) {
        const int32_t spacing = 2 << n / 400, first = n % 20, size = 1 + n % 400 / 20;
        const vshi_ao_cut pieces[3] = {{spacing, 8 * ROWS, 0, 8 * first, 0},
                                       {spacing, 8 * ROWS, 8 * first, 8 * (first + size), 0},
                                       {spacing, 8 * ROWS, 8 * (first + size), 8 * ROWS, 0}};
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

/* Whatever is made of AO goes with it: nothing but lights and coverage makes a part shoot for itself alone.
 */
static void what_is_made_of_ao_is_left_too(void **state) {
    const stage *s = *state;
    const vsh_lightmap_options options = options_of((how){.spacing = 4, .max_error = 0.03});
    static const struct {
        uint32_t planes, kinds;
    } cases[] = {
        {WITHOUT_BENT, VSHI_KEEPS_AO},
        {0, VSHI_KEEPS_AO | VSHI_KEEPS_OPEN},
        {WITHOUT_AO, VSHI_KEEPS_AO | VSHI_KEEPS_OPEN},
        {TANGENT_SPACE, VSHI_KEEPS_AO | VSHI_KEEPS_OPEN | VSHI_KEEPS_TANGENT},
        {WITH_SKY | WITHOUT_BENT, VSHI_KEEPS_AO | VSHI_KEEPS_SKY},
        {WITH_SKY | WITHOUT_AO | WITHOUT_BENT, VSHI_KEEPS_SKY},
        {WITH_SKY | TANGENT_SPACE, VSHI_KEEPS_ALL},
        {WITHOUT_AO | WITHOUT_BENT, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        baked *b = begin_baked(cases[i].planes);
        vsh_lightmap planes = planes_of(b, 0);
        static const int32_t methods[] = {VSH_AO_EXACT, VSH_AO_CONES, VSH_AO_RAYS};
        planes.irradiance = b->bent;
        assert_int_equal(vshi_part_kinds(&planes), cases[i].kinds);
        for (size_t m = 0; m < 3; ++m) {
            int32_t left;
            vsh_shade_options shade = options.shade;
            shade.ao_method = methods[m];
            assert_int_equal(
                vshi_part_spacing(occluders_of_caster(&s->casters), &shade, &planes, 4, &left, NULL), VSH_OK);
            assert_int_equal(left, cases[i].kinds != 0 && methods[m] == VSH_AO_EXACT ? 4 : 1);
        }
        free(b);
    }
}

/* A texel's rows are as many bytes as their kinds say, and no two of their arrays share any. */
static void what_is_kept_lies_side_by_side(void **state) {
    (void)state;
    enum { ROW = 5 };
    static unsigned char memory[3 * ROW * MOST_BYTES];
    static const size_t bytes[16] = {[1] = 56, [2] = 56, [3] = 76, [5] = 68, [7] = 88, [13] = 84, [15] = 104};
    for (uint32_t kinds = 0; kinds < 16; ++kinds) {
        const size_t row = ROW * vshi_ao_kept_bytes(kinds);
        const vshi_ao_kept kept = vshi_ao_kept_row(kinds, ROW, memory, 1);
        const struct {
            void *at;
            size_t bytes;
            bool there;
        } arrays[] = {{kept.position, ROW * 3 * sizeof(double), true},
                      {kept.normal, ROW * 3 * sizeof(float), true},
                      {kept.ao, ROW * sizeof *kept.ao, (kinds & VSHI_KEEPS_AO) != 0},
                      {kept.sky, ROW * sizeof *kept.sky, (kinds & VSHI_KEEPS_SKY) != 0},
                      {kept.open, ROW * 3 * sizeof(float), (kinds & VSHI_KEEPS_OPEN) != 0},
                      {kept.tangent, ROW * 4 * sizeof(float), (kinds & VSHI_KEEPS_TANGENT) != 0}};
        assert_true(bytes[kinds] == 0 || bytes[kinds] == vshi_ao_kept_bytes(kinds));
        memset(memory, 0, sizeof memory);
        for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; ++i) {
            assert_int_equal(arrays[i].at != NULL, arrays[i].there);
            for (size_t k = 0; k < (arrays[i].there ? arrays[i].bytes : 0); ++k) {
                ++((unsigned char *)arrays[i].at)[k];
            }
        }
        for (size_t k = 0; k < sizeof memory; ++k) {
            assert_int_equal(memory[k], k >= row && k < 2 * row);
        }
    }
}

/* Numbers of a file of nobody's. */
static void what_no_bake_left_is_not_sound(void **state) {
    (void)state;
    const vshi_ao_shot good = {.shot = 0.5f, .rays = 16, .level = 4};
    const struct {
        float shot;
        int32_t rays;
        uint32_t level;
    } bad[] = {{0.5f, 16, 8},   {0.5f, 16, 3}, {0.5f, 16, 0},  {0.5f, -1, 4},     {0.5f, 1 << 25, 4},
               {0.5f, 16, 255}, {NAN, 16, 4},  {-0.1f, 16, 4}, {INFINITY, 16, 1}, {1.5f, 16, 4}};
    static const uint32_t held[] = {65, 65 << 16, UINT32_C(0x80000000), 64 | 0xffffu << 16};
    static const float directions[] = {NAN, INFINITY, -1e30f, 4.0f};
    float open[6] = {0.1f, -0.5f, 0.6f, 0.0f, 0.0f, 1.0f};
    vshi_ao_shot shots[2][2] = {{good, good}, {good, good}};
    const vshi_ao_kept kept = {.ao = shots[0], .sky = shots[1], .open = open};
    assert_true(vshi_ao_kept_is_sound(&kept, 2, 4, HELD));
    for (size_t i = 0; i < 2 * sizeof bad / sizeof bad[0]; ++i) {
        vshi_ao_shot *shot = &shots[i % 2][i / 2 % 2];
        shot->shot = bad[i / 2].shot;
        shot->rays = bad[i / 2].rays;
        shot->level = bad[i / 2].level;
        assert_false(vshi_ao_kept_is_sound(&kept, 2, 4, HELD));
        *shot = good;
    }
    for (size_t i = 0; i < 4 * 4; ++i) {
        vshi_ao_shot *shot = &shots[i % 2][i / 2 % 2];
        shot->held[0] = 1;
        shot->held[1] = held[i / 4];
        assert_false(vshi_ao_kept_is_sound(&kept, 2, 4, HELD));
        shot->held[1] = 64 | 64 << 16;
    }
    for (size_t i = 0; i < 4 * 6; ++i) {
        const float was = open[i % 6];
        open[i % 6] = directions[i / 6];
        assert_false(vshi_ao_kept_is_sound(&kept, 2, 4, HELD));
        open[i % 6] = was;
    }
    assert_true(vshi_ao_kept_is_sound(&kept, 2, 4, HELD));
}

/* A texel that could be of a strange file. */
static void set_strange(uint32_t seed, size_t column, size_t row, const vshi_ao_kept *kept) {
    static const float places[] = {0.0f, NAN, INFINITY, -1e30f, 1.0f};
    static const uint32_t levels[] = {0, 1, 2, 4, VSHI_AO_KNOWN_LEVEL};
    const double position[3] = {(double)column, (double)row, 0.0};
    memcpy(kept->position + column * sizeof position, position, sizeof position);
    kept->normal[3 * column + 1] = places[(seed >> 24) % 5];
    kept->normal[3 * column + 2] = 1.0f;
    for (uint32_t k = 0; k < 2; ++k) {
        const uint32_t level = levels[((seed >> 8) + 3 * k) % 5];
        const uint32_t rays = level == 0 || level > 4 ? 0 : seed >> 16 & 31;
        (k == 0 ? kept->ao : kept->sky)[column] =
            (vshi_ao_shot){.shot = (float)(seed >> 28) / 15.0f,
                           .rays = (int32_t)rays,
                           .level = level,
                           .held = {seed & 0x4000000f, (seed & 63) | (seed & 63) << 16}};
    }
    kept->open[3 * column + seed % 3] = (float)(seed >> 20 & 255) / 100.0f;
    kept->tangent[4 * column + seed % 4] = places[(seed >> 12) % 5];
}

/* Texels of a file of nobody's, all of which are sound: whatever comes of it, AO and the sky are numbers. */
static void texels_of_strangers_come_to_numbers(void **state) {
    (void)state;
    uint8_t wanted[HEIGHT / 8];
    uint32_t seed = 1;
    baked *b = begin_baked(WITH_SKY | TANGENT_SPACE);
    memset(rows_kept, 0, sizeof rows_kept);
    memset(b->ao, 0, sizeof b->ao);
    memset(b->error, 0, sizeof b->error);
    memset(b->sky, 0, sizeof b->sky);
    memset(wanted, 1, sizeof wanted);
    for (size_t row = 0; row < HEIGHT; ++row) {
        const vshi_ao_kept kept = vshi_ao_kept_row(VSHI_KEEPS_ALL, WIDTH, rows_kept, row);
        for (size_t column = 0; column < WIDTH; ++column) {
            seed = 1664525u * seed + 1013904223u;
            set_strange(seed, column, row, &kept);
        }
        assert_true(vshi_ao_kept_is_sound(&kept, WIDTH, 4, HELD));
    }
    const vshi_ao_left left = {WIDTH, HEIGHT, 4, VSHI_KEEPS_ALL, rows_kept, wanted, 0, HEIGHT / 8};
    const vsh_lightmap planes = planes_of(b, 0);
    const vsh_lightmap_options options = options_of((how){.spacing = 4, .max_error = 0.02});
    vsh_run run = vsh_run_default();
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vsh_bake_error sums[2];
    memset(sums, 0, sizeof sums);
    vsh_error error;
    assert_int_equal(vshi_ao_finish(&left, &options.shade, &run, &planes, &stats, sums, &error), VSH_OK);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(b->ao[i] >= 0.0f && b->ao[i] <= 1.0f && b->error[i] >= 0.0f);
        assert_true(b->sky[i] >= 0.0f && b->sky[i] <= 1.0f);
    }
    assert_true(isfinite(stats.square_error));
    for (size_t k = 0; k < 2; ++k) {
        assert_true(sums[k].held > 0.0 && isfinite(sums[k].held_square_error));
    }
    free(b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_are_kept_that_windows_over_those_left_take_in),
        cmocka_unit_test(what_is_made_of_ao_is_left_too),
        cmocka_unit_test(what_is_kept_lies_side_by_side),
        cmocka_unit_test(what_no_bake_left_is_not_sound),
        cmocka_unit_test(texels_of_strangers_come_to_numbers),
        cmocka_unit_test(pieces_put_together_change_no_bit),
        cmocka_unit_test(so_do_those_of_what_is_made_of_ao),
        cmocka_unit_test(bands_of_a_piece_leave_the_same),
    };
    return vsh_triangles_available() ? cmocka_run_group_tests(tests, set_up, tear_down) : 0;
}
