/* Irradiance (visibility × colour × falloff × cosine), bent normals, tinted penumbrae and ambient light,
 * against closed forms. */
#include "shading.h"

static const double ORIGIN[3] = {0.0, 0.0, 0.0};
static const float UP[3] = {0.0f, 1.0f, 0.0f};

/* Of one point at the origin, fully lit. */
static void lit(const vsh_light *light, const float normal[3], float rgb[3]) {
    const vsh_points points = {1, ORIGIN, normal, NULL};
    const float one = 1.0f;
    rgb[0] = rgb[1] = rgb[2] = 0.0f;
    vsh_shade_irradiance(&points, NULL, light, &one, rgb);
}

static float red(const vsh_light *light) {
    float rgb[3];
    lit(light, UP, rgb);
    return rgb[0];
}

TEST(the_cosine_to_the_light_weighs_it) {
    for (int degrees = 0; degrees <= 180; degrees += 5) {
        double towards[3];
        direction_at(RADIANS(degrees - 90), 0.7, towards);
        for (int axis = 0; axis < 3; ++axis) {
            towards[axis] *= 17.0; /* of any length */
        }
        const vsh_light light = sun(towards, 0.1);
        assert_float_equal(red(&light), fmax(0.0, sin(RADIANS(degrees - 90))), 1e-6);
    }
    /* normals of any length */
    const vsh_light light = sun((const double[]){1.0, 1.0, 0.0}, 0.1);
    float rgb[3];
    lit(&light, (const float[]){0.0f, 1e-3f, 0.0f}, rgb);
    assert_float_equal(rgb[0], sqrt(0.5), 1e-6);
}

TEST(shading_normals_stand_in_for_geometric_ones) {
    const vsh_points points = {1, ORIGIN, UP, NULL};
    const float one = 1.0f, sideways[3] = {1.0f, 0.0f, 0.0f};
    const vsh_light light = sun((const double[]){1.0, 0.0, 0.0}, 0.1);
    float rgb[3] = {0.0f, 0.0f, 0.0f};
    vsh_shade_irradiance(&points, NULL, &light, &one, rgb);
    assert_true(rgb[0] == 0.0f);
    vsh_shade_irradiance(&points, sideways, &light, &one, rgb);
    assert_float_equal(rgb[0], 1.0, 1e-6);
}

TEST(falloffs_follow_their_formulas) {
    for (double d = 0.3; d < 20.0; d *= 1.4) {
        vsh_light light = lamp((const double[]){0.0, d, 0.0}, 0.25);
        assert_float_equal(red(&light), 1.0, 1e-6);
        light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
        assert_true(fabs((double)red(&light) * d * d - 1.0) < 1e-6);
        light.falloff = VSH_FALLOFF_QUADRATIC;
        light.reach = 8.0;
        const double left = d < 8.0 ? 1.0 - d / 8.0 : 0.0;
        assert_float_equal(red(&light), left * left, 1e-6);
    }
}

TEST(a_point_at_the_light_gets_no_infinity) {
    const double distances[] = {0.0, 1e-300, 1e-30, 1e-3, 0.2};
    for (size_t i = 0; i < sizeof distances / sizeof distances[0]; ++i) {
        vsh_light light = lamp((const double[]){0.0, distances[i], 0.0}, 0.25);
        light.falloff = VSH_FALLOFF_INVERSE_SQUARE;
        const float value = red(&light);
        assert_true(value >= 0.0f && value <= 16.0f + 1e-4f); /* as on the light's own surface */
    }
}

/* The red irradiance below a spot whose axis leans by `degrees` from the direction to the point. */
static float red_leaning(vsh_light light, double degrees) {
    light.axis[0] = 3.0 * sin(RADIANS(degrees));
    light.axis[1] = -3.0 * cos(RADIANS(degrees));
    light.axis[2] = 0.0;
    return red(&light);
}

TEST(a_spot_fades_smoothly_between_its_angles) {
    vsh_light light = lamp((const double[]){0.0, 2.0, 0.0}, 0.1);
    light.type = VSH_LIGHT_SPOT;
    light.inner_angle = RADIANS(40.0);
    light.outer_angle = RADIANS(80.0);
    float last = 2.0f;
    for (double degrees = 0.0; degrees <= 90.0; degrees += 0.5) {
        const float value = red_leaning(light, degrees);
        const double t = (cos(RADIANS(degrees)) - cos(0.5 * light.outer_angle)) /
                         (cos(0.5 * light.inner_angle) - cos(0.5 * light.outer_angle));
        const double s = fmin(1.0, fmax(0.0, t));
        assert_float_equal(value, s * s * (3.0 - 2.0 * s), 1e-6);
        assert_true(value <= last);
        last = value;
    }
    /* without a soft edge */
    light.inner_angle = light.outer_angle;
    assert_true(red_leaning(light, 39.0) == 1.0f && red_leaning(light, 41.0) == 0.0f);
    /* as wide as can be, it is a sphere */
    light.outer_angle = light.inner_angle = 2.0 * PI;
    assert_true(red_leaning(light, 180.0) == 1.0f);
}

TEST(colour_and_visibility_multiply_and_lights_add) {
    enum { COUNT = 5 };
    const double positions[3 * COUNT] = {0.0};
    float normals[3 * COUNT], rgb[3 * COUNT];
    for (int i = 0; i < 3 * COUNT; ++i) {
        normals[i] = UP[i % 3];
        rgb[i] = 10.0f;
    }
    const float visible[COUNT] = {0.0f, 0.25f, 1.0f, (float)NAN, 0.5f};
    vsh_light light = sun((const double[]){0.0, 1.0, 0.0}, 0.1);
    memcpy(light.color, (const double[]){2.0, 0.5, 0.0}, sizeof light.color);
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_irradiance(&points, NULL, &light, visible, rgb);
    vsh_shade_irradiance(&points, NULL, &light, visible, rgb);
    for (int i = 0; i < COUNT; ++i) {
        const float v = isnan(visible[i]) ? 0.0f : visible[i];
        for (int c = 0; c < 3; ++c) {
            assert_float_equal(rgb[3 * i + c], 10.0 + 2.0 * (double)v * light.color[c], 1e-5);
        }
    }
    assert_true(rgb[9] == 10.0f); /* NaN adds nothing */
}

TEST(points_without_a_place_or_a_normal_add_nothing) {
    const double positions[12] = {(double)NAN, 0.0, 0.0, 0.0, (double)INFINITY, 0.0};
    const float normals[12] = {0, 1, 0, 0, 1, 0, 0, 0, 0, (float)NAN, 1, 0}, visible[4] = {1, 1, 1, 1};
    const vsh_light light = lamp((const double[]){0.0, 1.0, 0.0}, 0.1);
    const vsh_points points = {4, positions, normals, NULL};
    float rgb[12] = {0.0f};
    vsh_shade_irradiance(&points, NULL, &light, visible, rgb);
    assert_all_equal(rgb, 12, 0.0f);
    const vsh_points none = {0, NULL, NULL, NULL};
    vsh_shade_irradiance(&none, NULL, &light, NULL, NULL);
}

/* --- bent normals, tints and ambient light of a lightmap */

enum { SIZE = 32, TEXELS = SIZE * SIZE };

/* The floor y = 0 over [-1, 1]² faces up; u runs along x, v along -z. */
static const float MIRRORED[8] = {1, 0, 0, 0, 0, 1, 1, 1};

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
    const vshi_layer *layer;
    bool bent, light;
    vsh_tint tint;
    const double *ambient;
} asked;

static vsh_result bake(const vsh_field *field, const asked *ask, baked *into) {
    const vsh_mesh mesh = floor_mesh(ask->uvs);
    vsh_lightmap_options options = preview_lightmap_options();
    options.width = options.height = SIZE;
    options.tangents = ask->tangents;
    OWNED(vsh_charts) *texels = charts_from(&mesh, 1, &options);
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
    return vsh_bake_lightmap(occluders_with(field, ask->layer, ask->layer != NULL), texels, &light,
                             ask->light ? 1 : 0, &shade, NULL, &lightmap, NULL, &failure);
}

static double degrees_between(const float *a, const double b[3]) {
    const double v[3] = {a[0], a[1], a[2]};
    return acos(fmin(1.0, dot3(v, b) / (length3(v) * length3(b)))) / RADIANS(1.0);
}

static const int32_t METHODS[] = {VSH_AO_CONES, VSH_AO_RAYS, VSH_AO_ADAPTIVE};
enum { METHOD_COUNT = 3 };

/* Under an open sky nothing bends, and every direction is unit. */
TEST(under_an_open_sky_unit_normals_do_not_bend) {
    OWNED(vsh_field) *field = floor_field(false);
    FREED baked *b = malloc(sizeof *b);
    const double up[3] = {0.0, 1.0, 0.0}, out[3] = {0.0, 0.0, 1.0};
    for (int m = 0; m < METHOD_COUNT; ++m) {
        for (int32_t space = VSH_BENT_WORLD; space <= VSH_BENT_TANGENT; ++space) {
            const asked ask = {.ao_method = METHODS[m], .bent = true, .bent_space = space, .tangents = space};
            assert_ok(bake(field, &ask, b));
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
TEST(at_the_foot_of_a_wall_the_normal_is_the_mean_of_the_open_half) {
    OWNED(vsh_field) *field = floor_field(true);
    const double position[3] = {-0.42, 0.001, 0.0};
    const double truth[3] = {2.0 / (3.0 * PI), 1.0 / 3.0, 0.0};
    const vsh_points points = {1, position, UP, NULL};
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
TEST(world_and_tangent_space_have_the_same_directions) {
    OWNED(vsh_field) *field = floor_field(true);
    FREED baked *world = malloc(sizeof *world), *tangent = malloc(sizeof *tangent);
    const float *const uvs[2] = {NULL, MIRRORED};
    for (int mirror = 0; mirror < 2; ++mirror) {
        asked ask = {.uvs = uvs[mirror], .ao_method = VSH_AO_CONES, .bent = true};
        assert_ok(bake(field, &ask, world));
        ask.bent_space = VSH_BENT_TANGENT;
        ask.tangents = 1;
        assert_ok(bake(field, &ask, tangent));
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
TEST(a_wall_in_a_layer_bends_as_one_in_the_field) {
    OWNED(vsh_field) *united = floor_field(true), *ground = floor_field(false);
    OWNED(vsh_field) *wall = field_of((truth_scene){&WALL, 1}, 0.04, 4.0);
    vshi_layer layer = vshi_layer_default();
    layer.field = wall;
    FREED baked *a = malloc(sizeof *a), *b = malloc(sizeof *b);
    const asked ask = {.ao_method = VSH_AO_CONES, .bent = true},
                layered = {.ao_method = VSH_AO_CONES, .bent = true, .layer = &layer};
    assert_ok(bake(united, &ask, a));
    assert_ok(bake(ground, &layered, b));
    for (size_t i = 0; i < TEXELS; ++i) {
        if (i % SIZE > SIZE / 4 + 1) { /* beside the wall; at its very foot both differ by its crease */
            const double d[3] = {(double)a->bent[3 * i], (double)a->bent[3 * i + 1],
                                 (double)a->bent[3 * i + 2]};
            assert_true(degrees_between(b->bent + 3 * i, d) < 4.0);
        }
    }
}

TEST(tints_and_ambient_light_follow_their_formulas) {
    OWNED(vsh_field) *field = floor_field(true);
    FREED baked *plain = malloc(sizeof *plain), *b = malloc(sizeof *b);
    const double ambient[3] = {0.25, 0.5, 1.0}, cosine = 6.0 / length3((double[]){-1.0, 6.0, 0.2});
    asked ask = {.ao_method = VSH_AO_CONES, .light = true};
    assert_ok(bake(field, &ask, plain));
    ask.tint.type = VSH_TINT_QUADRATIC;
    ask.ambient = ambient;
    assert_ok(bake(field, &ask, b));
    size_t grey = 0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const double v = (double)plain->shadow[i], open = (double)plain->ao[i];
        const double tinted[3] = {v, 0.5 * v * v + 0.5 * v, v * v};
        assert_int_equal(bits_of(b->shadow[i]), bits_of(plain->shadow[i]));
        /* AO darkens the ambient light, or the sun's where there is none */
        grey += v > 0.1 && v < 0.9;
        for (size_t c = 0; c < 3; ++c) {
            assert_float_equal(b->tint[3 * i + c], tinted[c], 1e-6);
            const double direct = cosine * (c == 1 ? 0.5 : 1.0);
            assert_float_equal(plain->irradiance[3 * i + c], direct * v * open, 2e-5);
            assert_float_equal(b->irradiance[3 * i + c], direct * tinted[c] + ambient[c] * open, 2e-5);
        }
    }
    assert_true(grey > 30);
    const vsh_tint powers = {VSH_TINT_POWER, {1.0, 1.2, 1.5}};
    const float values[3] = {0.0f, 0.5f, 1.0f};
    float rgb[9];
    vshi_shade_tint(3, values, &powers, rgb);
    for (int c = 0; c < 3; ++c) {
        assert_float_equal(rgb[c], 0.0, 0.0);
        assert_float_equal(rgb[3 + c], pow(0.5, powers.power[c]), 1e-6);
        assert_float_equal(rgb[6 + c], 1.0, 0.0);
    }
}

TEST(bad_channels_are_refused_with_the_reason) {
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
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        assert_fails(bake(field, &cases[i].ask, b), VSH_ERROR_ARGUMENT, cases[i].message);
    }
}

/* --- the ends of lights */

enum { LENGTH = 64, FINE = 128, FINE_TEXELS = FINE * FINE };

static vsh_light fading_lamp(double x, double height, double z, double reach) {
    vsh_light light = lamp((const double[]){x, height, z}, 0.05);
    light.falloff = VSH_FALLOFF_QUADRATIC;
    light.reach = reach;
    return light;
}

static vsh_light narrow_spot(void) {
    vsh_light light = lamp((const double[]){0.0, 0.5, 0.0}, 0.05);
    light.type = VSH_LIGHT_SPOT;
    memcpy(light.axis, (const double[]){0.0, -2.0, 0.0}, sizeof light.axis);
    light.inner_angle = RADIANS(20.0);
    light.outer_angle = RADIANS(60.0);
    return light;
}

TEST(a_light_shades_the_points_within_its_reach_and_cone_alone) {
    static const int32_t methods[] = {VSH_SHADOW_HARD, VSH_SHADOW_CONE, VSH_SHADOW_RAYS, VSH_SHADOW_ADAPTIVE};
    OWNED(vsh_field) *field = floor_field(false);
    vsh_light panel = fading_lamp(0.0, 0.5, 0.0, 0.8);
    panel.type = VSH_LIGHT_RECTANGLE;
    memcpy(panel.edge_u, (const double[]){0.0, 0.0, 0.1}, sizeof panel.edge_u);
    memcpy(panel.edge_v, (const double[]){0.1, 0.0, 0.0}, sizeof panel.edge_v);
    panel.two_sided = 1;
    const struct {
        vsh_light light;
        double border; /* on the floor */
    } cases[] = {{fading_lamp(0.0, 0.5, 0.0, 0.8), sqrt(0.8 * 0.8 - 0.25)},
                 {panel, sqrt(0.8 * 0.8 - 0.25)},
                 {narrow_spot(), 0.5 * tan(RADIANS(30.0))}};
    for (size_t k = 0; k < COUNT_OF(cases) * COUNT_OF(methods); ++k) {
        const vsh_light *light = &cases[k / COUNT_OF(methods)].light;
        const double border = cases[k / COUNT_OF(methods)].border;
        double positions[LENGTH][3] = {{0.0}};
        float normals[LENGTH][3], visible[LENGTH], deviation[LENGTH];
        for (int i = 0; i < LENGTH; ++i) { /* the last but one and the last pair at the border */
            positions[i][0] =
                i < LENGTH - 2 ? i / 60.0 : border * (i == LENGTH - 2 ? 1.0 - 1e-9 : 1.0 + 1e-9);
            memcpy(normals[i], UP, sizeof UP);
        }
        vsh_shade_options options = preview_options();
        options.method = methods[k % COUNT_OF(methods)];
        const vsh_points points = {LENGTH, positions[0], normals[0], NULL};
        const vsh_shade_stats stats =
            shade_points(occluders_of(field), &points, light, &options, NULL, visible, deviation);
        uint64_t beyond = 0;
        for (int i = 0; i < LENGTH; ++i) {
            const bool lit = positions[i][0] < border;
            float rgb[3] = {0.0f};
            const vsh_points one = {1, positions[i], UP, NULL};
            vsh_shade_irradiance(&one, NULL, light, (const float[]){1.0f}, rgb);
            assert_true(lit ? visible[i] > 0.9f : visible[i] == 0.0f);
            assert_true(lit || rgb[0] == 0.0f);
            beyond += !lit;
        }
        assert_int_equal(stats.skipped, beyond);
        if (options.method == VSH_SHADOW_RAYS) {
            assert_int_equal(stats.rays, options.rays * (int)(LENGTH - beyond));
        }
        const vsh_points last = {1, positions[LENGTH - 1], normals[0], NULL};
        const vsh_shade_stats none =
            shade_points(occluders_of(field), &last, light, &options, NULL, visible, deviation);
        assert_true(none.rays == 0 && none.marches == 0 && none.samples == 0);
    }
}

/* Of four tiles the light reaches a part of one. */
TEST(texels_beyond_the_reach_cost_no_ray_and_do_not_dilute_the_error) {
    const vsh_mesh mesh = floor_mesh(NULL);
    OWNED(vshi_triangles) *triangles = triangles_from(&mesh, 1);
    OWNED(vsh_occluders) *occluders = occluders_from_triangles(triangles);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = FINE;
    options.shade.start_offset = 0.0; /* texels lie on the floor */
    OWNED(vsh_charts) *charts = charts_from(&mesh, 1, &options);
    static float shadow[FINE_TEXELS], irradiance[3 * FINE_TEXELS], coverage[FINE_TEXELS];
    float *planes[1] = {shadow};
    const vsh_lightmap lightmap = {.shadow = planes, .irradiance = irradiance, .coverage = coverage};
    vsh_bake_error errors[2];
    for (int far = 0; far < 2; ++far) {
        const vsh_light light = fading_lamp(-0.5, far ? 0.5 : 0.3, -0.5, 0.45);
        vsh_bake_stats stats = vsh_bake_stats_zero();
        stats.errors = errors;
        memset(errors, 0, sizeof errors);
        assert_ok(vsh_bake_lightmap(occluders, charts, &light, 1, NULL, NULL, &lightmap, &stats, &failure));
        size_t lit = 0;
        for (size_t i = 0; i < FINE_TEXELS; ++i) {
            const double x = (2.0 * (double)(i % FINE) + 1.0) / FINE - 1.0;
            const double z = (2.0 * (double)(i / FINE) + 1.0) / FINE - 1.0;
            const double height = light.position[1];
            const double d = sqrt((x + 0.5) * (x + 0.5) + (z + 0.5) * (z + 0.5) + height * height);
            const double left = fmax(0.0, 1.0 - d / light.reach);
            assert_true(shadow[i] == (d < light.reach ? 1.0f : 0.0f) && coverage[i] == 1.0f);
            assert_float_equal(irradiance[3 * i], left * left * height / d, 1e-5);
            lit += d < light.reach;
        }
        assert_true(far ? lit == 0 : lit > 100);
        assert_true(errors[0].values == (double)lit && errors[0].compared <= (double)lit);
        assert_int_equal(stats.shade.skipped, FINE_TEXELS - lit);
        assert_true(far ? stats.shade.rays == 0 : stats.shade.rays > 0);
    }
}
