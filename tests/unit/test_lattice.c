/* AO that is interpolated between texels, against the same AO at every texel. */
#include "bake/part.h"
#include "casts.h"
#include "fields.h"
#include "previews.h"

#include <stdlib.h>

#include <vdbshade/bake.h>

enum { SIZE = 256, TEXELS = SIZE * SIZE };

/* The floor y = 0 over [-1, 1]²; a post of 0.1 stands on it, and a ball floats beside. */
static const float POSITIONS[12] = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1};
static const float UVS[8] = {0, 0, 1, 0, 1, 1, 0, 1};
static const uint32_t INDICES[6] = {0, 1, 2, 0, 2, 3};

static vsh_field *make_field(void) {
    static const truth_solid solids[] = {
        {.shape = TRUTH_BOX, .half = {1.5, 0.25, 1.5}, .center = {0.0, -0.25, 0.0}},
        {.shape = TRUTH_BOX, .half = {0.05, 0.4, 0.05}, .center = {0.0, 0.4, 0.0}},
        {.shape = TRUTH_SPHERE, .radius = 0.2, .center = {0.5, 0.4, 0.0}},
    };
    return field_of((truth_scene){solids, 3}, 0.02, 4.0);
}

typedef struct baked {
    float ao[TEXELS], error[TEXELS], coverage[TEXELS];
    vsh_bake_stats stats;
} baked;

static baked *bake(const vsh_field *field, int32_t spacing, const vsh_shade_options *shade, int32_t threads) {
    const vsh_mesh mesh = {.name = "floor",
                           .positions = POSITIONS,
                           .uvs = UVS,
                           .indices = INDICES,
                           .vertex_count = 4,
                           .triangle_count = 2};
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.padding = 0;
    options.ao_spacing = spacing;
    vsh_run run = vsh_run_default();
    run.threads = threads;
    vsh_texels *texels;
    vsh_error error = {0};
    baked *b = calloc(1, sizeof *b);
    assert_non_null(b);
    b->stats = vsh_bake_stats_zero();
    const vsh_lightmap lightmap = {.ao = b->ao, .ao_error = b->error, .coverage = b->coverage};
    if (vsh_texels_create(&mesh, 1, &options, NULL, NULL, &texels, &error) != VSH_OK ||
        vsh_bake_lightmap(occluders_of(field), texels, NULL, 0, shade, &run, &lightmap, &b->stats, &error) !=
            VSH_OK) {
        fail_msg("%s", error.message);
    }
    vsh_texels_free(texels);
    return b;
}

static vsh_shade_options options_of(int32_t method) {
    vsh_shade_options shade = preview_options();
    shade.ao_method = method;
    shade.ao_distance = 0.8;
    shade.rays = 1024;
    return shade;
}

static void little_is_lost_and_much_is_saved(void **state) {
    const vsh_field *field = *state;
    const vsh_shade_options shade = options_of(VSH_AO_CONES);
    baked *all = bake(field, 1, &shade, 0);
    for (int32_t spacing = 2; spacing <= 8; spacing *= 2) {
        baked *few = bake(field, spacing, &shade, 0);
        double square = 0.0, most = 0.0;
        for (size_t i = 0; i < TEXELS; ++i) {
            assert_true(few->coverage[i] == all->coverage[i]);
            const double off = fabs((double)few->ao[i] - (double)all->ao[i]) * (double)all->coverage[i];
            square += off * off;
            most = fmax(most, off);
        }
        const double share = (double)few->stats.shade.marches / (double)all->stats.shade.marches;
        print_message("spacing %d: RMSE %.5f, most %.4f, %.2f of the marches\n", spacing,
                      sqrt(square / TEXELS), most, share);
        assert_true(sqrt(square / TEXELS) < 0.004);
        assert_true(most < 0.04);
        assert_true(share < (spacing == 2 ? 0.35 : 0.25));
        free(few);
    }
    free(all);
}

static void threads_change_no_bit(void **state) {
    const vsh_shade_options shade = options_of(VSH_AO_ADAPTIVE);
    baked *one = bake(*state, 4, &shade, 1), *three = bake(*state, 4, &shade, 3);
    assert_memory_equal(one->ao, three->ao, sizeof one->ao);
    assert_memory_equal(one->error, three->error, sizeof one->error);
    free(one);
    free(three);
}

/* What adaptive says of its error holds for what lies between, too. */
static void errors_are_as_said(void **state) {
    vsh_shade_options shade = options_of(VSH_AO_ADAPTIVE);
    baked *few = bake(*state, 4, &shade, 0);
    shade.ao_method = VSH_AO_RAYS;
    shade.rays = 1024;
    baked *truth = bake(*state, 1, &shade, 0);
    double square = 0.0, said = 0.0;
    size_t count = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        if (truth->coverage[i] > 0.0f) {
            const double off = (double)few->ao[i] - (double)truth->ao[i];
            square += off * off;
            said += (double)few->error[i] * (double)few->error[i];
            ++count;
        }
    }
    print_message("RMSE %.5f, said %.5f\n", sqrt(square / (double)count), sqrt(said / (double)count));
    assert_true(square <= 1.25 * 1.25 * said);
    assert_true(sqrt(square / (double)count) < shade.max_error);
    free(few);
    free(truth);
}

/* A chart that ends two rows beyond a tile's edge: the band above copies its padding from texels whose
 * corners' corners lie two tiles on. */
static void bands_are_interpolated_as_the_whole(void **state) {
    enum { ROWS = 8 };
    const vsh_mesh mesh = {
        .positions = POSITIONS, .uvs = UVS, .indices = INDICES, .vertex_count = 4, .triangle_count = 2};
    const vsh_shade_options shade = options_of(VSH_AO_CONES);
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.padding = 0;
    options.ao_spacing = 8;
    float *whole = calloc(TEXELS, sizeof *whole), *banded = calloc(TEXELS, sizeof *banded);
    vsh_bake_stats stats = vsh_bake_stats_zero(), sum = vsh_bake_stats_zero();
    vsh_lightmap lightmap = {.ao = whole};
    vsh_texels *texels;
    vsh_charts *charts;
    assert_int_equal(vsh_texels_create(&mesh, 1, &options, NULL, NULL, &texels, NULL), VSH_OK);
    assert_int_equal(
        vsh_bake_lightmap(occluders_of(*state), texels, NULL, 0, &shade, NULL, &lightmap, &stats, NULL),
        VSH_OK);
    vsh_texels_free(texels);
    assert_int_equal(vsh_charts_create(&mesh, 1, &options, NULL, NULL, &charts, NULL), VSH_OK);
    for (int32_t row = 0; row < SIZE; row += ROWS) {
        lightmap.ao = banded + (size_t)row * SIZE;
        assert_int_equal(vsh_texels_create_band(charts, row, ROWS, NULL, &texels, NULL), VSH_OK);
        assert_int_equal(
            vsh_bake_lightmap(occluders_of(*state), texels, NULL, 0, &shade, NULL, &lightmap, &sum, NULL),
            VSH_OK);
        vsh_texels_free(texels);
    }
    vsh_charts_free(charts);
    for (size_t i = 0; i < TEXELS; ++i) {
        if (whole[i] != banded[i]) {
            fail_msg("row %zu, column %zu: %.9g whole, %.9g in bands", i / SIZE, i % SIZE, (double)whole[i],
                     (double)banded[i]);
        }
    }
    assert_memory_equal(&stats.shade, &sum.shade, sizeof stats.shade);
    free(whole);
    free(banded);
}

/* Parts have the values of the whole, and shade little for them beyond their own rows: of the wider lattices
 * in the rows of tiles behind, and nothing above. */
static void parts_shade_little_beside_them(void **state) {
    enum { ROWS = 32 };
    static uint32_t known[TEXELS];
    static vshi_row_work work[2 * SIZE / VSHI_TILE];
    const vsh_mesh mesh = {
        .positions = POSITIONS, .uvs = UVS, .indices = INDICES, .vertex_count = 4, .triangle_count = 2};
    const vsh_shade_options shade = options_of(VSH_AO_CONES);
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.padding = 0;
    for (int32_t spacing = 2; spacing <= 8; spacing *= 2) {
        options.ao_spacing = spacing;
        baked *whole = bake(*state, spacing, &shade, 0), *parts = calloc(1, sizeof *parts);
        assert_non_null(parts);
        uint64_t own = 0, above = 0, behind = 0;
        vsh_charts *charts;
        assert_int_equal(vsh_charts_create(&mesh, 1, &options, NULL, NULL, &charts, NULL), VSH_OK);
        for (int32_t row = 0; row < SIZE; row += ROWS) {
            const vshi_ao_cut cut = {
                .spacing = 1, .height = SIZE, .first = row, .end = row + ROWS, .between = spacing};
            const vsh_lightmap lightmap = {.ao = parts->ao + (size_t)row * SIZE};
            vsh_texels *texels;
            memset(work, 0, sizeof work);
            assert_int_equal(vshi_texels_create_part(charts, row, ROWS, &cut, NULL, &texels, NULL), VSH_OK);
            assert_int_equal(vshi_bake_part(occluders_of(*state), texels, NULL, 0, &shade, NULL, &lightmap,
                                            known + (size_t)row * SIZE, NULL, work, NULL, NULL),
                             VSH_OK);
            const vshi_band *band = &texels->band;
            const size_t held = band->held_end - band->held_begin;
            for (size_t k = 0; k < held; ++k) {
                const size_t at = band->held_begin + k;
                *(at < band->own_begin ? &above
                  : at < band->own_end ? &own
                                       : &behind) += work[held + k].marches;
                assert_int_equal(work[k].marches, 0); /* there are no lights */
            }
            vsh_texels_free(texels);
        }
        vsh_charts_free(charts);
        for (size_t i = 0; i < TEXELS; ++i) { /* others are filled once all parts are there */
            if ((known[i] & VSHI_PART_SHADEABLE) != 0 && whole->ao[i] != parts->ao[i]) {
                fail_msg("spacing %d, row %zu, column %zu: %.9g whole, %.9g in parts", spacing, i / SIZE,
                         i % SIZE, (double)whole->ao[i], (double)parts->ao[i]);
            }
        }
        print_message("spacing %d: %.3f of the marches behind\n", spacing, (double)behind / (double)own);
        assert_int_equal(own, whole->stats.shade.marches);
        assert_int_equal(above, 0);
        /* a row of tiles for each lattice wider than the finest, of which that is left out */
        const uint64_t lattices = spacing == 8 ? 3 : spacing == 4 ? 2 : 1;
        assert_true(behind > 0 && behind * (ROWS / VSHI_TILE) < own * lattices);
        free(parts);
        free(whole);
    }
}

static void other_spacings_are_refused(void **state) {
    (void)state;
    static const int32_t bad[] = {0, -4, 3, 5, 6, 16, INT32_MAX};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; ++i) {
        const vsh_mesh mesh = {
            .positions = POSITIONS, .uvs = UVS, .indices = INDICES, .vertex_count = 4, .triangle_count = 2};
        vsh_lightmap_options options = preview_lightmap_options();
        options.ao_spacing = bad[i];
        vsh_texels *texels;
        vsh_error error = {0};
        assert_int_equal(vsh_texels_create(&mesh, 1, &options, NULL, NULL, &texels, &error),
                         VSH_ERROR_ARGUMENT);
        assert_non_null(strstr(error.message, "ao_spacing"));
    }
}

static int set_up(void **state) {
    *state = make_field();
    return 0;
}

static int tear_down(void **state) {
    vsh_field_free(*state);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(little_is_lost_and_much_is_saved),    cmocka_unit_test(threads_change_no_bit),
        cmocka_unit_test(bands_are_interpolated_as_the_whole), cmocka_unit_test(errors_are_as_said),
        cmocka_unit_test(parts_shade_little_beside_them),      cmocka_unit_test(other_spacings_are_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
