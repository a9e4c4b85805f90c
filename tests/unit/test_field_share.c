/* The error that a bake reports, the field's own share included, against rays to the casters. */
#include "rays.h"
#include "shading.h"
#include "texels_of.h"
#include "truth/metrics.h"

enum { WIDTH = 96, HEIGHT = 88, TEXELS = WIDTH * HEIGHT, BARS = 8, CHANNELS = 2 };

/* Bars over a floor: half as wide as a voxel, so that most of them are lost in the field, and one that is
 * thick, whose penumbra is right. */
typedef struct stage {
    quad floor;
    float positions[BARS][24];
    vsh_mesh bars[BARS];
    vsh_field *field;
    vshi_triangles *triangles;
} stage;

static const double VOXEL = 0.08;

static const double SUN[3] = {0.4, 0.8, 0.3};

static void cast_bars(stage *s, size_t count, double voxel) {
    s->field = field_of_grid(grid_from_meshes(s->bars, count, voxel), 0.0);
    s->triangles = triangles_from(s->bars, count);
}

static int set_up(void **state) {
    stage *s = calloc(1, sizeof *s);
    *state = s;
    make_quad(&s->floor, 0.0f, 0.0f, 1.0f, 1.0f);
    for (size_t v = 0; v < 4; ++v) {
        s->floor.positions[3 * v] = 3.0f * s->floor.uvs[2 * v] - 1.5f;
        s->floor.positions[3 * v + 1] = 0.0f;
        s->floor.positions[3 * v + 2] = 1.5f - 3.0f * s->floor.uvs[2 * v + 1];
    }
    for (int i = 0; i < BARS; ++i) {
        const double x = -0.9 + 0.24 * i, half = i == 0 ? 0.2 : 0.02;
        s->bars[i] = box_mesh(s->positions[i], (double[]){x - half, 0.5 - half, -0.7},
                              (double[]){x + half, 0.5 + half, 0.7});
    }
    cast_bars(s, BARS, VOXEL);
    return 0;
}

static int tear_down(void **state) {
    FREED stage *s = *state;
    vshi_triangles_free(s->triangles);
    vshi_field_free(s->field);
    return 0;
}

typedef struct baked {
    float shadow[TEXELS], ao[TEXELS], coverage[TEXELS];
    vsh_bake_error errors[CHANNELS];
} baked;

static vsh_lightmap_options options_of(int32_t method, int32_t ao_method) {
    vsh_lightmap_options options = size_of(WIDTH, HEIGHT, 1);
    options.shade.method = method;
    options.shade.ao_method = ao_method;
    options.shade.ao_distance = 1.0;
    options.ao_spacing = 1;
    return options;
}

static baked *bake(const stage *s, vsh_lightmap_options options, const vshi_triangles *truth) {
    baked *b = calloc(1, sizeof *b);
    OWNED(vsh_charts) *charts = charts_from(&s->floor.mesh, 1, &options);
    const vsh_light light = sun(SUN, 0.04);
    float *const shadow = b->shadow;
    const vsh_lightmap lightmap = {.shadow = &shadow, .ao = b->ao, .coverage = b->coverage};
    vsh_bake_stats stats = vsh_bake_stats_zero();
    stats.errors = b->errors;
    const int exact = options.shade.method == VSH_SHADOW_EXACT;
    const vsh_occluders casters = {
        .field = s->field, .triangles = exact ? s->triangles : NULL, .true_triangles = truth};
    assert_ok(vsh_bake_lightmap(&casters, charts, &light, 1, NULL, NULL, &lightmap, &stats, &failure));
    return b;
}

/* Root mean square errors of valid texels, against rays of the library's tracer. */
static void measure(const stage *s, const baked *b, double rmse[CHANNELS]) {
    enum { RAYS = 256 };
    static float truth[CHANNELS][TEXELS], values[CHANNELS][TEXELS], valid[TEXELS];
    const vsh_light light = sun(SUN, 0.04);
    const vsh_lightmap_options options = options_of(VSH_SHADOW_CONE, VSH_AO_CONES);
    OWNED(vsh_charts) *charts = charts_from(&s->floor.mesh, 1, &options);
    OWNED(texel_list) *texels = texels_from(charts);
    const texel_samples all = samples_of(texels);
    see_light(s->triangles, NULL, all.count, all.positions, all.normals, 1e-5, &light, RAYS, truth[0]);
    see_sky(s->triangles, NULL, all.count, all.positions, all.normals, 1e-5, 1.0, RAYS, truth[1]);
    for (size_t i = 0; i < all.count; ++i) {
        const size_t place = vsh_texel_place(all.texels[i], WIDTH);
        values[0][i] = b->shadow[place];
        values[1][i] = b->ao[place];
        valid[i] = b->coverage[place];
    }
    for (int c = 0; c < CHANNELS; ++c) {
        rmse[c] = truth_compare(all.count, values[c], truth[c], valid).rmse;
    }
}

TEST(the_estimate_includes_parts_that_voxels_lose) {
    const stage *s = *state;
    FREED baked *b = bake(s, options_of(VSH_SHADOW_ADAPTIVE, VSH_AO_ADAPTIVE), s->triangles);
    double measured[CHANNELS];
    measure(s, b, measured);
    for (int c = 0; c < CHANNELS; ++c) {
        const vsh_bake_error *known = &b->errors[c];
        const double said = vsh_bake_error_rmse(known), field = vsh_bake_error_field(known);
        assert_true(measured[c] > 0.02);
        assert_true(said > 0.9 * measured[c] && said < 1.1 * measured[c]);
        assert_true(fabs(field * field + known->square_error / known->values - said * said) < 1e-9);
        assert_true(known->compared == TEXELS && known->values == TEXELS);
    }
}

TEST(exact_values_are_compared_with_rays_too) {
    const stage *s = *state;
    FREED baked *b = bake(s, options_of(VSH_SHADOW_EXACT, VSH_AO_EXACT), s->triangles);
    double measured[CHANNELS];
    measure(s, b, measured);
    for (int c = 0; c < CHANNELS; ++c) {
        const double said = vsh_bake_error_rmse(&b->errors[c]);
        assert_true(said < 0.03 && said > 0.9 * measured[c]);
    }
}

TEST(without_the_casters_only_the_error_of_rays_is_known) {
    const stage *s = *state;
    FREED baked *b = bake(s, options_of(VSH_SHADOW_ADAPTIVE, VSH_AO_CONES), NULL);
    assert_true(b->errors[0].compared == 0.0 && isnan(vsh_bake_error_field(&b->errors[0])));
    assert_true(vsh_bake_error_rmse(&b->errors[0]) == sqrt(b->errors[0].square_error / TEXELS));
    assert_true(isnan(vsh_bake_error_rmse(&b->errors[1]))); /* a preview knows nothing of its error */
}

TEST(measuring_changes_no_value) {
    const stage *s = *state;
    const vsh_lightmap_options options = options_of(VSH_SHADOW_ADAPTIVE, VSH_AO_ADAPTIVE);
    FREED baked *plain = bake(s, options, NULL), *held = bake(s, options, s->triangles);
    assert_memory_equal(plain->shadow, held->shadow, sizeof plain->shadow);
    assert_memory_equal(plain->ao, held->ao, sizeof plain->ao);
}

/* A box just over the floor: large voxels make the texels under it invalid. They are filled from lit texels
 * beside them, and the estimate leaves them out. */
TEST(filled_texels_are_not_in_the_estimate) {
    const stage *s = *state;
    stage low = *s;
    low.bars[0] = box_mesh(low.positions[0], (double[]){-0.7, 0.05, -0.7}, (double[]){0.7, 0.85, 0.7});
    cast_bars(&low, 1, 0.2);
    FREED baked *b = bake(&low, options_of(VSH_SHADOW_ADAPTIVE, VSH_AO_ADAPTIVE), low.triangles);
    double measured[CHANNELS];
    measure(&low, b, measured);
    for (int c = 0; c < CHANNELS; ++c) {
        const double said = vsh_bake_error_rmse(&b->errors[c]);
        const double compared = sqrt(b->errors[c].compared_square_error / b->errors[c].compared);
        /* one sample stands for several, of which some may be invalid */
        assert_true(b->errors[c].values < 0.9 * TEXELS);
        assert_true(fabs(b->errors[c].compared - b->errors[c].values) < 0.01 * b->errors[c].values);
        assert_true(compared > 0.9 * measured[c] && compared < 1.1 * measured[c]);
        assert_true(said > 0.9 * measured[c]); /* the noise of AO rays may be larger */
    }
    vshi_triangles_free(low.triangles);
    vshi_field_free(low.field);
}

FIXTURE(set_up, tear_down)
