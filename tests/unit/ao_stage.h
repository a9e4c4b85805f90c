/* What shades what, of the tests of AO that texels share: a stage, and lightmaps of it. */
#ifndef TEST_AO_STAGE_H
#define TEST_AO_STAGE_H

#include "bake/part.h"
#include "texels_of.h"
#include "traced.h"

enum { WIDTH = 96, HEIGHT = 208, TEXELS = WIDTH * HEIGHT, RECEIVERS = 4 };

/* A floor, a wall and a post that stand on it, and a ball over it. */
static const truth_solid SOLIDS[] = {
    {.shape = TRUTH_BOX, .half = {1.5, 0.25, 1.5}, .center = {0.0, -0.25, 0.0}},
    {.shape = TRUTH_BOX, .half = {0.6, 0.3, 0.04}, .center = {-0.2, 0.3, -0.5}},
    {.shape = TRUTH_BOX, .half = {0.05, 0.4, 0.05}, .center = {-0.4, 0.4, 0.4}},
    {.shape = TRUTH_SPHERE, .radius = 0.2, .center = {0.5, 0.35, 0.2}},
};

/* The floor's chart stands askew; the wall's lies beside it, a texel between them, and so does the ball's.
 * Another patch of floor has a chart of its own. */
typedef struct stage {
    quad floor, wall, patch;
    sphere ball;
    vsh_mesh receivers[RECEIVERS];
    caster casters;
} stage;

static inline void set_vertex(quad *q, size_t v, double x, double y, double z, double s, double t) {
    q->positions[3 * v] = (float)x;
    q->positions[3 * v + 1] = (float)y;
    q->positions[3 * v + 2] = (float)z;
    q->uvs[2 * v] = (float)s;
    q->uvs[2 * v + 1] = (float)t;
}

static inline int set_up(void **state) {
    stage *s = calloc(1, sizeof *s);
    assert_non_null(s);
    *state = s;
    make_quad(&s->floor, 0.0f, 0.0f, 1.0f, 1.0f);
    make_quad(&s->wall, 0.0f, 0.0f, 1.0f, 1.0f);
    make_quad(&s->patch, 0.0f, 0.0f, 1.0f, 1.0f);
    for (size_t v = 0; v < 4; ++v) {
        const double x = v == 1 || v == 2 ? 1.0 : 0.0, y = v >= 2 ? 1.0 : 0.0;
        set_vertex(&s->floor, v, 2.0 * x - 1.0, 0.0, 1.0 - 2.0 * y, 0.08 + 0.58 * x - 0.06 * y,
                   0.02 + 0.07 * x + 0.75 * y);
        set_vertex(&s->wall, v, -0.8 + 1.2 * x, 0.01 + 0.58 * y, -0.459, 0.02 + 0.58 * x - 0.001 * y,
                   0.79 + 0.07 * x + 0.135 * y);
        /* its first row is the last of a block of tiles, and its last row the first of one */
        set_vertex(&s->patch, v, 1.05 + 0.4 * x, 0.0, 0.5 - 0.5 * y, 0.7 + 0.28 * x,
                   1.0 - (128.6 - 65.4 * y) / HEIGHT);
    }
    make_sphere(&s->ball, 16, 0.205);
    for (size_t v = 0; v < s->ball.mesh.vertex_count; ++v) {
        for (size_t axis = 0; axis < 3; ++axis) {
            s->ball.positions[3 * v + axis] += (float)SOLIDS[3].center[axis];
        }
        s->ball.uvs[2 * v] = 0.685f + 0.3f * s->ball.uvs[2 * v];
        s->ball.uvs[2 * v + 1] = 0.03f + 0.22f * s->ball.uvs[2 * v + 1];
    }
    s->receivers[0] = s->floor.mesh;
    s->receivers[1] = s->wall.mesh;
    s->receivers[2] = s->ball.mesh;
    s->receivers[3] = s->patch.mesh;
    s->casters = caster_of((truth_scene){SOLIDS, sizeof SOLIDS / sizeof SOLIDS[0]}, 0.02, 4.0);
    return 0;
}

static inline int tear_down(void **state) {
    stage *s = *state;
    caster_free(&s->casters);
    free_sphere(&s->ball);
    free(s);
    return 0;
}

/* Planes beside AO, its error and bent normals, or not with them. */
enum { WITH_SKY = 1, TANGENT_SPACE = 2, WITHOUT_AO = 4, WITHOUT_BENT = 8 };

typedef struct baked {
    float ao[TEXELS], error[TEXELS], bent[3 * TEXELS], sky[TEXELS], coverage[TEXELS];
    vsh_shade_stats stats;
    uint32_t planes;
} baked;

/* Rows from `first` on. */
static inline vsh_lightmap planes_of(baked *b, int32_t first) {
    const size_t at = (size_t)first * WIDTH;
    const bool ao = (b->planes & WITHOUT_AO) == 0, tangent = (b->planes & TANGENT_SPACE) != 0;
    return (vsh_lightmap){.ao = ao ? b->ao + at : NULL,
                          .ao_error = ao ? b->error + at : NULL,
                          .bent = (b->planes & WITHOUT_BENT) == 0 ? b->bent + 3 * at : NULL,
                          .bent_space = tangent ? VSH_BENT_TANGENT : VSH_BENT_WORLD,
                          .sky = (b->planes & WITH_SKY) != 0 ? b->sky + at : NULL,
                          .asked = {.sky = VSH_UP_Y},
                          .coverage = b->coverage + at};
}

typedef struct how {
    int32_t spacing;
    double max_error;
    int32_t padding;
    int32_t rows; /* of a band; 0: whole */
    int32_t threads;
    size_t receivers; /* of the first so many; 0: all */
    bool parts;       /* of so many rows, instead of bands */
    uint32_t planes;
    bool marched; /* by VSH_AO_ADAPTIVE */
} how;

static inline void bake_rows(const stage *s, const vsh_texels *texels, const vsh_shade_options *shade,
                             int32_t first, int32_t threads, bool part, void *kept, baked *b) {
    const vsh_lightmap lightmap = planes_of(b, first);
    vsh_run run = vsh_run_default();
    run.threads = threads;
    vsh_bake_stats stats = vsh_bake_stats_zero();
    stats.shade = b->stats;
    vsh_error error = {0};
    static uint32_t known[TEXELS];
    const vsh_occluders *casters = occluders_of_caster(&s->casters);
    if ((part ? vshi_bake_part(casters, texels, NULL, 0, shade, &run, &lightmap, known, kept, &stats, &error)
              : vsh_bake_lightmap(casters, texels, NULL, 0, shade, &run, &lightmap, &stats, &error)) !=
        VSH_OK) {
        fail_msg("%s", error.message);
    }
    b->stats = stats.shade;
}

static inline baked *begin_baked(uint32_t planes) {
    baked *b = malloc(sizeof *b);
    assert_non_null(b);
    memset(b, 0xff, sizeof *b); /* NaN: whatever is not written shows */
    b->stats = vsh_shade_stats_zero();
    b->planes = planes;
    return b;
}

static inline vsh_lightmap_options options_of(how h) {
    vsh_lightmap_options options = size_of(WIDTH, HEIGHT, 1);
    options.padding = h.padding;
    options.tangents = 1;
    options.ao_spacing = h.spacing;
    options.shade.ao_method = h.marched ? VSH_AO_ADAPTIVE : VSH_AO_EXACT;
    options.shade.ao_distance = 0.8;
    options.shade.rays = 0; /* as many as the error takes */
    options.shade.max_error = h.max_error;
    return options;
}

static inline baked *bake(const stage *s, how h) {
    const vsh_lightmap_options options = options_of(h);
    const size_t receivers = h.receivers == 0 ? RECEIVERS : h.receivers;
    baked *b = begin_baked(h.planes);
    if (h.rows == 0) {
        vsh_texels *texels = create(s->receivers, receivers, options, NULL);
        bake_rows(s, texels, &options.shade, 0, h.threads, false, NULL, b);
        vsh_texels_free(texels);
        return b;
    }
    vsh_charts *charts = NULL;
    assert_int_equal(vsh_charts_create(s->receivers, receivers, &options, NULL, NULL, &charts, NULL), VSH_OK);
    for (int32_t first = 0; first < HEIGHT; first += h.rows) {
        const int32_t rows = HEIGHT - first < h.rows ? HEIGHT - first : h.rows;
        vsh_texels *texels = NULL;
        const vshi_ao_cut cut = {1, HEIGHT, first, first + rows, 0};
        assert_int_equal(h.parts ? vshi_texels_create_part(charts, first, rows, &cut, NULL, &texels, NULL)
                                 : vsh_texels_create_band(charts, first, rows, NULL, &texels, NULL),
                         VSH_OK);
        bake_rows(s, texels, &options.shade, first, h.threads, h.parts, NULL, b);
        vsh_texels_free(texels);
    }
    vsh_charts_free(charts);
    return b;
}

static inline void assert_same_plane(const char *name, const float *a, const float *b, size_t floats) {
    for (size_t i = 0; i < floats * TEXELS; ++i) {
        if (memcmp(&a[i], &b[i], sizeof a[i]) != 0) {
            fail_msg("%s, row %zu, column %zu: %.9g, then %.9g", name, i / floats / WIDTH, i / floats % WIDTH,
                     (double)a[i], (double)b[i]);
        }
    }
}

static inline void assert_same(const baked *a, const baked *b) {
    const uint32_t without = a->planes | b->planes, with = a->planes & b->planes;
    assert_same_plane("coverage", a->coverage, b->coverage, 1);
    if ((without & WITHOUT_AO) == 0) {
        assert_same_plane("ao", a->ao, b->ao, 1);
        assert_same_plane("ao_error", a->error, b->error, 1);
    }
    if ((without & WITHOUT_BENT) == 0) {
        assert_same_plane("bent", a->bent, b->bent, 3);
    }
    if ((with & WITH_SKY) != 0) {
        assert_same_plane("sky", a->sky, b->sky, 1);
    }
    assert_memory_equal(&a->stats, &b->stats, sizeof a->stats);
}

#endif
