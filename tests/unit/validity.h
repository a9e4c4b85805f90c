/* Boxes and other quads that are baked, for tests of which texels are valid. */
#ifndef TESTS_VALIDITY_H
#define TESTS_VALIDITY_H

#include "casts.h"
#include "testing.h"

enum { MOST_QUADS = 4096, MOST_BOXES = 64, SIZE = 256 };

typedef struct box {
    double low[3], high[3];
} box;

/* Quads in one mesh, each with a square of its own in a grid of charts. */
typedef struct shape {
    float positions[12 * MOST_QUADS], uvs[8 * MOST_QUADS];
    uint32_t indices[6 * MOST_QUADS];
    size_t quads;
    box boxes[MOST_BOXES]; /* the solids among them */
    size_t box_count;
} shape;

static inline void add_quad(shape *s, const double corners[4][3]) {
    static const uint32_t order[6] = {0, 1, 2, 0, 2, 3};
    assert_true(s->quads < MOST_QUADS);
    for (size_t k = 0; k < 4; ++k) {
        for (size_t axis = 0; axis < 3; ++axis) {
            s->positions[12 * s->quads + 3 * k + axis] = (float)corners[k][axis];
        }
    }
    for (size_t k = 0; k < 6; ++k) {
        s->indices[6 * s->quads + k] = (uint32_t)(4 * s->quads) + order[k];
    }
    ++s->quads;
}

/* `inwards` turns its faces: a room. */
static inline void add_faces(shape *s, box b, bool inwards) {
    for (int axis = 0; axis < 3; ++axis) {
        for (int side = 0; side < 2; ++side) {
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            double corners[4][3];
            for (int k = 0; k < 4; ++k) {
                const bool along = k == 1 || k == 2, across = k >= 2;
                const bool turned = (side == 0) != inwards;
                corners[k][axis] = side != 0 ? b.high[axis] : b.low[axis];
                corners[k][u] = (turned ? across : along) ? b.high[u] : b.low[u];
                corners[k][v] = (turned ? along : across) ? b.high[v] : b.low[v];
            }
            add_quad(s, (const double(*)[3])corners);
        }
    }
}

static inline void add_box(shape *s, box b) {
    assert_true(s->box_count < MOST_BOXES);
    s->boxes[s->box_count++] = b;
    add_faces(s, b, false);
}

/* A strip of charts has gaps of a fifth. */
static inline vsh_mesh mesh_of(shape *s) {
    const size_t across = (size_t)ceil(sqrt((double)s->quads));
    for (size_t q = 0; q < s->quads; ++q) {
        static const float corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
        for (size_t k = 0; k < 4; ++k) {
            s->uvs[8 * q + 2 * k] = ((float)(q % across) + 0.1f + 0.8f * corner[k][0]) / (float)across;
            s->uvs[8 * q + 2 * k + 1] = ((float)(q / across) + 0.1f + 0.8f * corner[k][1]) / (float)across;
        }
    }
    return (vsh_mesh){.name = "shape",
                      .positions = s->positions,
                      .uvs = s->uvs,
                      .indices = s->indices,
                      .vertex_count = 4 * s->quads,
                      .triangle_count = 2 * s->quads};
}

/* A lightmap of AO, and what is behind it. */
typedef struct baked {
    vsh_charts *charts;
    vsh_texels *texels;
    vsh_texel_samples samples; /* one a texel */
    float *ao, *coverage;
    vsh_bake_stats stats;
    uint64_t invalid;
} baked;

static inline baked bake(const vsh_mesh *mesh, int32_t resolution, int32_t threads, double distance) {
    baked b = {.stats = vsh_bake_stats_zero()};
    vsh_run run = run_on(threads);
    vsh_grid_options grid_options = vsh_grid_options_default();
    grid_options.resolution = resolution;
    OWNED(vsh_grid) *grid = NULL;
    OWNED(vsh_field) *field = NULL;
    OWNED(vsh_triangles) *triangles = NULL;
    assert_ok(vsh_grid_from_meshes(mesh, 1, &grid_options, &run, &grid, &failure));
    assert_ok(vsh_field_create(grid, NULL, &run, &field, &failure));
    assert_ok(vsh_triangles_create(mesh, 1, &run, &triangles, &failure));
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = SIZE;
    options.ao_spacing = 1;
    options.shade.method = VSH_SHADOW_EXACT;
    options.shade.ao_method = VSH_AO_EXACT;
    options.shade.ao_distance = distance;
    options.shade.rays = 16;
    assert_ok(vsh_charts_create(mesh, 1, &options, &run, NULL, &b.charts, &failure));
    assert_ok(vsh_texels_create(b.charts, &run, &b.texels, &failure));
    b.samples = vsh_texels_samples(b.texels);
    b.ao = calloc(SIZE * SIZE, sizeof *b.ao);
    b.coverage = calloc(SIZE * SIZE, sizeof *b.coverage);
    b.stats.invalid_by_mesh = &b.invalid;
    const vsh_lightmap lightmap = {.ao = b.ao, .coverage = b.coverage};
    assert_ok(vsh_bake_lightmap(occluders_traced(field, triangles), b.charts, NULL, 0, NULL, &run, &lightmap,
                                &b.stats, &failure));
    return b;
}

static inline void free_baked(baked *b) {
    vsh_texels_free(b->texels);
    vsh_charts_free(b->charts);
    free(b->ao);
    free(b->coverage);
}

static inline bool is_valid(const baked *b, size_t i) {
    return b->coverage[vsh_texel_place(b->samples.texels[i], SIZE)] == 1.0f;
}

#endif
