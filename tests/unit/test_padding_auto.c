/* Padding for mip levels: every texel holds a value, and levels hold the means of values alone. */

#include "bake/padding.h"
#include "lightmaps.h"
#include "testing.h"

static const float HOLE = -1000.0f;

/* A level of a mip map: means of 2 × 2, of those that are there; with `mask` of those that it holds. */
static void halve(size_t width, size_t height, size_t channels, const float *values, const uint8_t *mask,
                  float *coarse, uint8_t *coarse_mask) {
    const size_t columns = (width + 1) / 2, rows = (height + 1) / 2;
    for (size_t i = 0; i < columns * rows * channels; ++i) {
        const size_t x = i / channels % columns, y = i / channels / columns;
        float sum = 0.0f;
        int count = 0;
        for (size_t k = 0; k < 4; ++k) {
            const size_t column = 2 * x + k % 2, row = 2 * y + k / 2;
            if (column < width && row < height && (mask == NULL || mask[row * width + column] != 0)) {
                sum += values[(row * width + column) * channels + i % channels];
                ++count;
            }
        }
        coarse[i] = count > 0 ? sum / (float)count : HOLE;
        if (coarse_mask != NULL) {
            coarse_mask[i / channels] = count > 0;
        }
    }
}

TEST(every_level_holds_the_means_of_values_alone) {
    const int32_t sizes[][2] = {{64, 64}, {1, 1}, {37, 90}, {128, 16}, {1, 77}, {255, 3}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; ++s) {
        size_t width = (size_t)sizes[s][0], height = (size_t)sizes[s][1], count = width * height;
        FREED uint8_t *mask = calloc(count, 1), *means_mask = calloc(count, 1), *next_mask = calloc(count, 1);
        FREED float *filled = malloc(3 * count * sizeof *filled), *means = malloc(3 * count * sizeof *means);
        FREED float *next = malloc(3 * count * sizeof *next), *given = malloc(3 * count * sizeof *given);
        uint32_t random = 99;
        for (size_t i = 0; i < 3 * count; ++i) {
            random = random * 1664525u + 1013904223u;
            mask[i / 3] = i == 0 || (i % 3 != 0 ? mask[i / 3] != 0 : random >> 16 < 2500);
            filled[i] = means[i] = given[i] =
                mask[i / 3] != 0 ? 1.0f + (float)(random >> 8) * 0x1p-24f : HOLE;
        }
        memcpy(means_mask, mask, count);
        const vshi_plane plane = {filled, 3};
        vshi_store store = {.run = NULL};
        assert_int_equal(vshi_pull_push(&store, NULL, (int32_t)width, (int32_t)height, mask, &plane, 1, NULL),
                         VSH_OK);
        vshi_store_close(&store);
        for (size_t i = 0; i < 3 * count; ++i) {
            assert_true(filled[i] >= 1.0f && filled[i] < 2.0f);
            assert_true(mask[i / 3] == 0 || filled[i] == given[i]);
        }
        while (width > 1 || height > 1) {
            halve(width, height, 3, means, means_mask, next, next_mask);
            memcpy(means, next, 3 * count * sizeof *means);
            memcpy(means_mask, next_mask, count);
            halve(width, height, 3, filled, NULL, next, NULL);
            memcpy(filled, next, 3 * count * sizeof *filled);
            width = (width + 1) / 2;
            height = (height + 1) / 2;
            for (size_t i = 0; i < 3 * width * height; ++i) {
                assert_true(filled[i] >= 1.0f && filled[i] < 2.0f);
                assert_true(means_mask[i / 3] == 0 || fabsf(filled[i] - means[i]) < 1e-5f);
            }
        }
    }
}

TEST(a_plane_without_values_is_left) {
    uint8_t mask[12] = {0};
    float values[12];
    for (int i = 0; i < 12; ++i) {
        values[i] = HOLE;
    }
    const vshi_plane plane = {values, 1};
    vshi_store store = {.run = NULL};
    assert_int_equal(vshi_pull_push(&store, NULL, 4, 3, mask, &plane, 1, NULL), VSH_OK);
    vshi_store_close(&store);
    for (int i = 0; i < 12; ++i) {
        assert_true(values[i] == HOLE);
    }
}

/* The floor's chart in a corner of the lightmap. */
static vsh_mesh corner_mesh(float uvs[8]) {
    for (int i = 0; i < 8; ++i) {
        uvs[i] = 0.1f + 0.2f * QUAD_UVS[i];
    }
    vsh_mesh mesh = floor_mesh();
    mesh.uvs = uvs;
    return mesh;
}

static vsh_charts *charts_with(const vsh_mesh *mesh, int32_t padding) {
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.padding = padding;
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(mesh, 1, &options, NULL, NULL, &charts, NULL), VSH_OK);
    return charts;
}

TEST(a_lightmap_is_filled_to_its_last_corner) {
    float uvs[8];
    const vsh_mesh mesh = corner_mesh(uvs);
    OWNED(vsh_charts) *charts = charts_with(&mesh, VSH_PADDING_AUTO), *grown = charts_with(&mesh, 16);
    OWNED(vsh_field) *field = floor_field(0);
    const vsh_light light = sun(0.3, 1.0, 0.2, 0.14);
    FREED planes *all = new_planes(), *other = new_planes();
    bake(field, charts, &light, &all->all, NULL, 1);
    bake(field, grown, &light, &other->all, NULL, 1);
    size_t beyond = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(all->coverage[i] == other->coverage[i]);
        if (other->ao[i] != 0.0f) { /* within 16 texels nothing else is done */
            assert_true(all->ao[i] == other->ao[i] && all->shadow[i] == other->shadow[i]);
            assert_memory_equal(all->irradiance + 3 * i, other->irradiance + 3 * i, 3 * sizeof(float));
        } else {
            assert_true(all->ao[i] > 0.0f && all->irradiance[3 * i + 2] > 0.0f);
            ++beyond;
        }
    }
    assert_true(beyond > TEXELS / 4);
}

TEST(no_other_padding_is_below_0) {
    const vsh_mesh mesh = floor_mesh();
    vsh_lightmap_options options = vsh_lightmap_options_default();
    vsh_charts *charts = NULL;
    options.padding = -2;
    assert_fails(vsh_charts_create(&mesh, 1, &options, NULL, NULL, &charts, &failure), VSH_ERROR_ARGUMENT,
                 "padding -2");
}
