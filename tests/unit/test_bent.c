/* Bent normals, tinted penumbrae, ambient light: what a bake can give beside shadow and AO. */
#include "previews.h"
#include "shading.h"
#include "testing.h"

enum { SIZE = 32, TEXELS = SIZE * SIZE };

/* The floor y = 0 over [-1, 1]² faces up; u runs along x, v along -z. */
static const float CORNERS[12] = {-1, 0, 1, 1, 0, 1, 1, 0, -1, -1, 0, -1};
static const float UVS[8] = {0, 0, 1, 0, 1, 1, 0, 1};
static const float MIRRORED[8] = {1, 0, 0, 0, 0, 1, 1, 1};
static const uint32_t INDICES[6] = {0, 1, 2, 0, 2, 3};

static const truth_solid SLAB = {.shape = TRUTH_BOX, .center = {0.0, -0.25, 0.0}, .half = {2.0, 0.25, 2.0}};
/* Over x < -0.5, to where it no longer matters. */
static const truth_solid WALL = {.shape = TRUTH_BOX, .center = {-1.25, 3.0, 0.0}, .half = {0.75, 3.5, 12.0}};

static vsh_field *floor_field(bool wall) {
    const truth_solid both[2] = {SLAB, WALL};
    return field_of((truth_scene){both, wall ? 2 : 1}, 0.04, 4.0);
}

typedef struct baked {
    float shadow[TEXELS], ao[TEXELS], bent[3 * TEXELS], irradiance[3 * TEXELS], tint[3 * TEXELS];
} baked;

typedef struct asked {
    const float *uvs;
    int32_t ao_method, bent_space, tangents;
    const vsh_layer *layer;
    bool bent, light;
    vsh_tint tint;
    const double *ambient;
} asked;

static vsh_result bake(const vsh_field *field, const asked *ask, baked *into, vsh_error *error) {
    const vsh_mesh mesh = {.name = "floor",
                           .positions = CORNERS,
                           .uvs = ask->uvs != NULL ? ask->uvs : UVS,
                           .indices = INDICES,
                           .vertex_count = 4,
                           .triangle_count = 2};
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.tangents = ask->tangents;
    OWNED(vsh_charts) *texels = NULL;
    assert_ok(vsh_charts_create(&mesh, 1, &options, NULL, NULL, &texels, &failure));
    vsh_shade_options shade = preview_options();
    shade.ao_method = ask->ao_method;
    shade.ao_cones = 64;
    shade.rays = 256;
    shade.ao_distance = 2.0;
    const double towards[3] = {-1.0, 6.0, 0.2};
    vsh_light light = sun(towards, 0.3);
    light.color[1] = 0.5;
    float *planes[1] = {into->shadow}, *tints[1] = {into->tint};
    const vsh_lightmap lightmap = {.shadow = ask->light ? planes : NULL,
                                   .ao = into->ao,
                                   .irradiance = ask->light ? into->irradiance : NULL,
                                   .bent = ask->bent ? into->bent : NULL,
                                   .bent_space = ask->bent_space,
                                   .tint = ask->tint.type != VSH_TINT_NONE ? tints : NULL,
                                   .tint_by = ask->tint,
                                   .ambient = ask->ambient};
    const vsh_result result =
        vsh_bake_lightmap(occluders_with(field, ask->layer, ask->layer != NULL), texels, &light,
                          ask->light ? 1 : 0, &shade, NULL, &lightmap, NULL, error);
    return result;
}

static void bake_well(const vsh_field *field, const asked *ask, baked *into) {
    assert_ok(bake(field, ask, into, &failure));
}

static double degrees_between(const float *a, const double b[3]) {
    double dot = 0.0, aa = 0.0, bb = 0.0;
    for (int k = 0; k < 3; ++k) {
        dot += (double)a[k] * b[k];
        aa += (double)(a[k] * a[k]);
        bb += b[k] * b[k];
    }
    return acos(fmin(1.0, dot / sqrt(aa * bb))) * 180.0 / PI;
}

static const int32_t METHODS[] = {VSH_AO_CONES, VSH_AO_RAYS, VSH_AO_ADAPTIVE};
enum { METHOD_COUNT = 3 };

/* Under an open sky nothing bends, and every direction is unit. */
TEST(test_open) {
    OWNED(vsh_field) *field = floor_field(false);
    FREED baked *b = malloc(sizeof *b);
    const double up[3] = {0.0, 1.0, 0.0}, out[3] = {0.0, 0.0, 1.0};
    for (int m = 0; m < METHOD_COUNT; ++m) {
        for (int32_t space = VSH_BENT_WORLD; space <= VSH_BENT_TANGENT; ++space) {
            const asked ask = {.ao_method = METHODS[m], .bent = true, .bent_space = space, .tangents = space};
            bake_well(field, &ask, b);
            for (size_t i = 0; i < TEXELS; ++i) {
                assert_true(degrees_between(b->bent + 3 * i, space == VSH_BENT_WORLD ? up : out) < 0.02);
                const float *d = b->bent + 3 * i;
                assert_float_equal(sqrt((double)(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])), 1.0, 1e-6);
            }
        }
    }
}

/* At the foot of a high and long wall half of the sky is open. Of a cosine-weighted hemisphere the half
 * towards +x has the mean (2 / (3 π), 1 / 3) along x and up. */
TEST(test_wall) {
    OWNED(vsh_field) *field = floor_field(true);
    const double position[3] = {-0.42, 0.001, 0.0};
    const float normal[3] = {0.0f, 1.0f, 0.0f};
    const double truth[3] = {2.0 / (3.0 * PI), 1.0 / 3.0, 0.0};
    const vsh_points points = {1, position, normal, NULL};
    for (int m = 0; m < METHOD_COUNT; ++m) {
        vsh_shade_options shade = preview_options();
        shade.ao_method = METHODS[m];
        shade.ao_cones = 64;
        shade.rays = 1024;
        shade.ao_distance = 2.0;
        float ao, deviation, bent[3];
        assert_ok(
            vsh_shade_ao(occluders_of(field), &points, &shade, NULL, &ao, &deviation, bent, NULL, NULL));
        assert_float_equal(ao, 0.5, 0.05);
        assert_true(degrees_between(bent, truth) < 3.0);
        float alone, its_deviation;
        assert_ok(vsh_shade_ao(occluders_of(field), &points, &shade, NULL, &alone, &its_deviation, NULL, NULL,
                               &failure));
        assert_int_equal(bits_of(alone), bits_of(ao));
        assert_int_equal(bits_of(its_deviation), bits_of(deviation));
    }
}

/* The same directions in both spaces; a chart that is mirrored mirrors x, and keeps y along growing v. */
TEST(test_spaces) {
    OWNED(vsh_field) *field = floor_field(true);
    FREED baked *world = malloc(sizeof *world), *tangent = malloc(sizeof *tangent);
    const float *const uvs[2] = {UVS, MIRRORED};
    for (int mirror = 0; mirror < 2; ++mirror) {
        asked ask = {.uvs = uvs[mirror], .ao_method = VSH_AO_CONES, .bent = true};
        bake_well(field, &ask, world);
        ask.bent_space = VSH_BENT_TANGENT;
        ask.tangents = 1;
        bake_well(field, &ask, tangent);
        double most = 0.0, bends = 0.0;
        for (size_t i = 0; i < TEXELS; ++i) {
            const float *w = world->bent + 3 * i, *t = tangent->bent + 3 * i;
            const double as_world[3] = {mirror ? -(double)t[0] : (double)t[0], (double)t[2], -(double)t[1]};
            most = fmax(most, degrees_between(w, as_world));
            bends = fmax(bends, (double)w[0]);
        }
        assert_true(most < 0.05);
        assert_true(bends > 0.4);
    }
}

/* A wall in a layer bends as one in the field does: what it hides is behind nothing else. */
TEST(test_layer) {
    OWNED(vsh_field) *united = floor_field(true), *ground = floor_field(false);
    OWNED(vsh_field) *wall = field_of((truth_scene){&WALL, 1}, 0.04, 4.0);
    vsh_layer layer = vsh_layer_default();
    layer.field = wall;
    FREED baked *a = malloc(sizeof *a), *b = malloc(sizeof *b);
    const asked ask = {.ao_method = VSH_AO_CONES, .bent = true},
                layered = {.ao_method = VSH_AO_CONES, .bent = true, .layer = &layer};
    bake_well(united, &ask, a);
    bake_well(ground, &layered, b);
    for (size_t i = 0; i < TEXELS; ++i) {
        if (i % SIZE > SIZE / 4 + 1) { /* beside the wall; at its very foot both differ by its crease */
            const double d[3] = {(double)a->bent[3 * i], (double)a->bent[3 * i + 1],
                                 (double)a->bent[3 * i + 2]};
            assert_true(degrees_between(b->bent + 3 * i, d) < 4.0);
        }
    }
}

TEST(test_tint_and_ambient) {
    OWNED(vsh_field) *field = floor_field(true);
    FREED baked *plain = malloc(sizeof *plain), *b = malloc(sizeof *b);
    const double ambient[3] = {0.25, 0.5, 1.0};
    asked ask = {.ao_method = VSH_AO_CONES, .light = true};
    bake_well(field, &ask, plain);
    ask.tint.type = VSH_TINT_QUADRATIC;
    ask.ambient = ambient;
    bake_well(field, &ask, b);
    size_t grey = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const double v = (double)plain->shadow[i], open = (double)plain->ao[i];
        const double tinted[3] = {v, 0.5 * v * v + 0.5 * v, v * v};
        assert_int_equal(bits_of(b->shadow[i]), bits_of(plain->shadow[i]));
        /* without ambient light AO darkens the light of the sun, whose blue is as its red; with it only the
         * ambient light is darkened */
        const double direct = open > 0.0 ? (double)plain->irradiance[3 * i] / open : 0.0;
        grey += v > 0.1 && v < 0.9;
        for (size_t c = 0; c < 3; ++c) {
            assert_float_equal(b->tint[3 * i + c], tinted[c], 1e-6);
            const double color = c == 1 ? 0.5 : 1.0, share = v > 0.0 ? tinted[c] / v : 0.0;
            assert_float_equal(b->irradiance[3 * i + c], direct * color * share + ambient[c] * open, 2e-5);
        }
    }
    assert_true(grey > 30);
    const vsh_tint powers = {VSH_TINT_POWER, {1.0, 1.2, 1.5}};
    const float values[3] = {0.0f, 0.5f, 1.0f};
    float rgb[9];
    vsh_shade_tint(3, values, &powers, rgb);
    for (int c = 0; c < 3; ++c) {
        assert_float_equal(rgb[c], 0.0, 0.0);
        assert_float_equal(rgb[3 + c], pow(0.5, powers.power[c]), 1e-6);
        assert_float_equal(rgb[6 + c], 1.0, 0.0);
    }
}

TEST(test_refused) {
    OWNED(vsh_field) *field = floor_field(false);
    FREED baked *b = malloc(sizeof *b);
    const double dark[3] = {0.0, -1.0, 0.0};
    const struct {
        asked ask;
        const char *message;
    } cases[] = {
        {{.ao_method = VSH_AO_TAPS, .bent = true},
         "bent normals: AO by taps knows no directions; use cones or rays"},
        {{.ao_method = VSH_AO_CONES, .bent = true, .bent_space = VSH_BENT_TANGENT},
         "bent_space 1: expected 0, or 1 with charts that have tangents"},
        {{.ao_method = VSH_AO_CONES, .bent = true, .bent_space = 2, .tangents = 1},
         "bent_space 2: expected 0, or 1 with charts that have tangents"},
        {{.ao_method = VSH_AO_CONES, .tint = {3, {1, 1, 1}}}, "tint: type 3 is out of range 0 … 2"},
        {{.ao_method = VSH_AO_CONES, .tint = {VSH_TINT_POWER, {1, NAN, 1}}},
         "tint: power[1] nan is out of range 0.0625 … 16"},
        {{.ao_method = VSH_AO_CONES, .light = true, .ambient = dark},
         "ambient[1] -1: expected a finite number, at least 0"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        assert_int_equal(bake(field, &cases[i].ask, b, &failure), VSH_ERROR_ARGUMENT);
        assert_string_equal(failure.message, cases[i].message);
    }
}
