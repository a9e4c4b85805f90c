/* Meshes with smooth normals: where shadow rays begin, and which directions count for AO. The truth is that
 * of the facets. */
#include "casts.h"
#include "lightmap/page.h"
#include "lightmap/texels.h"
#include "rays.h"
#include "shading.h"
#include "testing.h"
#include "texels_of.h"

enum { ROWS = 8, WIDTH = 256, HEIGHT = 128, TEXELS = WIDTH * HEIGHT };

static const double HAIR = 1e-5; /* above the facets, for truth */

/* A smooth sphere of radius 1 that is baked, and what casts on it. */
typedef struct scene {
    sphere ball;
    vsh_field *field;
    vshi_triangles *triangles;
    vsh_charts *charts;
    texel_list *texels, *facets; /* the same samples, of the sphere without normals */
    texel_samples lifted, flat;
} scene;

static void open_scene(scene *s, const vsh_mesh *other) {
    make_sphere(&s->ball, ROWS, 1.0);
    const vsh_mesh casters[2] = {s->ball.mesh, other != NULL ? *other : (vsh_mesh){0}};
    const size_t count = other != NULL ? 2 : 1;
    vsh_grid_options grid_options = vsh_grid_options_default();
    grid_options.resolution = 64;
    OWNED(vsh_grid) *grid = NULL;
    assert_ok(vsh_grid_from_meshes(casters, count, &grid_options, NULL, &grid, &failure));
    assert_ok(vshi_field_create(grid, NULL, NULL, &s->field, &failure));
    s->triangles = triangles_from(casters, count);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = WIDTH;
    options.height = HEIGHT;
    options.ao_spacing = 1;
    options.shade.method = VSH_SHADOW_EXACT;
    options.shade.ao_method = VSH_AO_EXACT;
    options.shade.ao_distance = 0.1;
    options.shade.rays = 64;
    vsh_mesh faceted = s->ball.mesh;
    faceted.normals = NULL;
    s->charts = charts_from(&s->ball.mesh, 1, &options);
    s->texels = texels_from(s->charts);
    OWNED(vsh_charts) *facets = charts_from(&faceted, 1, &options);
    s->facets = texels_from(facets);
    s->lifted = samples_of(s->texels);
    s->flat = samples_of(s->facets);
    assert_int_equal(s->lifted.count, s->flat.count);
}

/* Opens the scene with a wall beyond x = face. */
static void open_beside_wall(scene *s, double face) {
    float corners[24];
    const vsh_mesh wall = box_mesh(corners, (double[]){face, -2.0, -2.0}, (double[]){3.0, 2.0, 2.0});
    open_scene(s, &wall);
}

/* The value that was baked at a sample. */
static float value_at(const scene *s, const float *plane, size_t sample) {
    return plane[vsh_texel_place(s->lifted.texels[sample], WIDTH)];
}

static void close_scene(scene *s) {
    texel_list_free(s->facets);
    texel_list_free(s->texels);
    vsh_charts_free(s->charts);
    vshi_triangles_free(s->triangles);
    vshi_field_free(s->field);
    free_sphere(&s->ball);
}

static void bake(const scene *s, const vsh_light *lights, size_t light_count, const vsh_lightmap *planes) {
    assert_ok(vsh_bake_lightmap(occluders_traced(s->field, s->triangles), s->charts, lights, light_count,
                                NULL, NULL, planes, NULL, &failure));
}

static double dot(const float *a, const double *b) {
    return (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
}

/* A sun half a degree wide. */
static vsh_light sun_towards(double x, double y, double z) {
    const double length = length3((double[]){x, y, z});
    return sun((double[]){x / length, y / length, z / length}, vsh_light_default().angle);
}

/* The direction to a light, and how far it is. */
static double towards(const vsh_light *light, const double *from, double to[3]) {
    for (int k = 0; k < 3; ++k) {
        to[k] = light->type == VSH_LIGHT_DIRECTIONAL ? light->direction[k] : light->position[k] - from[k];
    }
    const double length = length3(to);
    for (int k = 0; k < 3; ++k) {
        to[k] /= length;
    }
    return length;
}

/* A bar over the sphere: its shadow is narrower than two of the lifts that would move it. */
TEST(rays_to_a_light_well_above_a_facet_begin_on_it) {
    static float shadow[TEXELS], truth[TEXELS], *const planes[1] = {shadow};
    float corners[24];
    const vsh_mesh bar = box_mesh(corners, (double[]){-0.03, 1.05, -1.0}, (double[]){0.0, 1.08, 1.0});
    FREED_BY(close_scene) scene s;
    open_scene(&s, &bar);
    vsh_light lights[2] = {sun_towards(1.0, 1.0, 0.1), sun_towards(0.0, 0.0, 1.0)};
    lights[1].type = VSH_LIGHT_SPHERE;
    lights[1].position[0] = 1.5;
    lights[1].position[1] = 2.5;
    lights[1].radius = 0.02;
    for (int l = 0; l < 2; ++l) {
        bake(&s, &lights[l], 1, &(vsh_lightmap){.shadow = planes});
        see_light(s.triangles, NULL, s.flat.count, s.flat.positions, s.flat.geometric_normals, HAIR,
                  &lights[l], 64, truth);
        size_t hidden = 0, off = 0;
        for (size_t i = 0; i < s.flat.count; ++i) {
            double to[3];
            towards(&lights[l], s.flat.positions + 3 * i, to);
            if (dot(s.flat.geometric_normals + 3 * i, to) >= 0.35) {
                hidden += truth[i] < 0.5f;
                off += fabsf(value_at(&s, shadow, i) - truth[i]) > 0.5f;
            }
        }
        assert_true(hidden > 100);
        assert_int_equal(off, 0);
    }
}

/* A light of 11.5° each way, near and far. */
TEST(facets_do_not_hide_a_light_that_is_over_the_smooth_sphere) {
    static const double SINE = 0.2;
    static float shadow[TEXELS], *const planes[1] = {shadow};
    FREED_BY(close_scene) scene s;
    open_scene(&s, NULL);
    vsh_light lights[2] = {sun_towards(1.0, 0.3, 0.2), sun_towards(1.0, 0.3, 0.2)};
    lights[0].angle = 2.0 * asin(SINE);
    lights[1].type = VSH_LIGHT_SPHERE;
    lights[1].position[0] = 5.0;
    lights[1].position[1] = 1.0;
    lights[1].radius = SINE * 4.5;
    for (int l = 0; l < 2; ++l) {
        bake(&s, &lights[l], 1, &(vsh_lightmap){.shadow = planes});
        size_t cut = 0, dark = 0;
        for (size_t i = 0; i < s.flat.count; ++i) {
            double to[3];
            const double length = towards(&lights[l], s.flat.positions + 3 * i, to);
            const double sine = l == 0 ? SINE : lights[l].radius / length;
            if (dot(s.flat.geometric_normals + 3 * i, to) < sine &&
                dot(s.lifted.normals + 3 * i, to) > sine + 0.02) {
                ++cut;
                dark += value_at(&s, shadow, i) < 0.95f;
            }
        }
        assert_true(cut > 200);
        assert_int_equal(dark, 0);
    }
}

/* Its light is the cosine of the smooth normal, from where the light stands over the horizon. */
TEST(pictures_show_no_facets_where_light_grazes_a_smooth_sphere) {
    enum { SIZE = 64 };
    static float color[3 * SIZE * SIZE], alpha[SIZE * SIZE], depth[SIZE * SIZE], normal[3 * SIZE * SIZE];
    FREED_BY(close_scene) scene s;
    open_scene(&s, NULL);
    const vsh_light light = sun_towards(1.0, 0.4, 0.2);
    const vsh_lit_meshes lit = {&s.ball.mesh, 1, NULL, {1.0, 1.0, 1.0}, 0};
    vsh_render_options options = vsh_render_options_default();
    options.width = options.height = SIZE;
    memcpy(options.camera.position, (double[]){0.0, 0.0, 4.0}, sizeof options.camera.position);
    memset(options.camera.target, 0, sizeof options.camera.target);
    memset(options.sky, 0, sizeof options.sky);
    options.samples = 1;
    options.shade.method = VSH_SHADOW_EXACT;
    options.lit = &lit;
    options.lit_count = 1;
    assert_ok(vsh_render(NULL, 0, occluders_traced(s.field, s.triangles), &light, 1, &options, NULL,
                         &(vsh_picture){color, alpha, depth, normal}, NULL, &failure));
    size_t near = 0, dark = 0;
    for (size_t i = 0; i < SIZE * SIZE; ++i) {
        const float cosine = (float)dot(normal + 3 * i, light.direction);
        if (alpha[i] == 1.0f && cosine > 0.02f && cosine < 0.3f) {
            ++near;
            dark += color[3 * i] < 0.9f * cosine;
        }
    }
    assert_true(near > 100);
    assert_int_equal(dark, 0);
}

/* A box whose face cuts the sphere: between the facets and the smooth sphere, near the cut. */
TEST(samples_are_valid_by_where_their_facets_are) {
    static const double FACE = 0.953, CLEAR = 1e-4;
    static float ao[TEXELS], coverage[TEXELS];
    FREED_BY(close_scene) scene s;
    open_beside_wall(&s, FACE);
    bake(&s, NULL, 0, &(vsh_lightmap){.ao = ao, .coverage = coverage});
    size_t between = 0, wrong = 0;
    for (size_t i = 0; i < s.flat.count; ++i) {
        const double x = s.flat.positions[3 * i];
        const bool valid = value_at(&s, coverage, i) == 1.0f;
        between += x < FACE && s.lifted.positions[3 * i] > FACE;
        wrong += fabs(x - FACE) > CLEAR && valid != (x < FACE);
    }
    assert_true(between > 50);
    assert_int_equal(wrong, 0);
}

/* A box just beyond the smooth sphere. */
TEST(ao_close_to_a_wall_is_that_of_the_facets) {
    static const double FACE = 1.018;
    static float ao[TEXELS], truth[TEXELS];
    FREED_BY(close_scene) scene s;
    open_beside_wall(&s, FACE);
    bake(&s, NULL, 0, &(vsh_lightmap){.ao = ao});
    see_sky(s.triangles, NULL, s.flat.count, s.flat.positions, s.lifted.normals, HAIR, 0.1, 256, truth);
    size_t under = 0;
    for (size_t i = 0; i < s.flat.count; ++i) {
        if (FACE - s.flat.positions[3 * i] < 0.045) {
            ++under;
            assert_true(fabs((double)(value_at(&s, ao, i) - truth[i])) < 0.1);
        }
    }
    assert_true(under > 50);
}

TEST(ao_of_a_smooth_convex_body_in_the_open_is_1) {
    static float ao[TEXELS];
    FREED_BY(close_scene) scene s;
    open_scene(&s, NULL);
    bake(&s, NULL, 0, &(vsh_lightmap){.ao = ao});
    for (size_t i = 0; i < s.flat.count; ++i) {
        assert_true(value_at(&s, ao, i) == 1.0f);
    }
}

TEST(queries_take_the_normals_of_faces_for_ao) {
    FREED_BY(close_scene) scene s;
    open_scene(&s, NULL);
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_method = VSH_AO_EXACT;
    options.ao_distance = 0.1;
    OWNED(vsh_query) *query = query_of(occluders_traced(s.field, s.triangles), NULL, 0, &options);
    FREED float *ao = calloc(s.flat.count, sizeof *ao);
    vsh_query_output output = vsh_query_output_default();
    output.ao = ao;
    vsh_point_layout layout = vsh_point_layout_default();
    const size_t counts[] = {1, 64, s.flat.count};
    for (size_t k = 0; k < 3; ++k) {
        size_t dark[2] = {0, 0};
        for (int faces = 0; faces < 2; ++faces) {
            const vsh_points points = {counts[k], s.flat.positions, s.lifted.normals, NULL};
            layout.face_normals = faces ? s.flat.geometric_normals : NULL;
            assert_ok(vsh_query_points(query, &points, &layout, NULL, &output, NULL, &failure));
            for (size_t i = 0; i < counts[k]; ++i) {
                dark[faces] += ao[i] < 1.0f;
            }
        }
        assert_int_equal(dark[1], 0);
        assert_true(k < 2 || dark[0] > 100);
    }
}

/* A strip of 0.2 × 3 between walls half as high as it is wide. */
static double mean_ao_between_walls(const float *normals) {
    quad strip;
    make_quad(&strip, 0.0f, 0.0f, 0.1f, 1.0f);
    strip.mesh.normals = normals;
    float corners[2][24];
    const vsh_mesh casters[3] = {strip.mesh,
                                 box_mesh(corners[0], (double[]){-0.1, 0.0, -0.1}, (double[]){0.0, 3.0, 0.1}),
                                 box_mesh(corners[1], (double[]){0.2, 0.0, -0.1}, (double[]){0.3, 3.0, 0.1})};
    OWNED(vshi_triangles) *triangles = triangles_from(casters, 3);
    OWNED(vsh_occluders) *occluders = occluders_from_triangles(triangles);
    vsh_lightmap_options options = vsh_lightmap_options_default();
    options.width = options.height = 128;
    options.padding = 0;
    options.shade.ao_method = VSH_AO_EXACT;
    options.shade.ao_distance = 50.0;
    options.shade.max_error = 0.01;
    OWNED(vsh_charts) *charts = charts_from(&strip.mesh, 1, &options);
    static float ao[128 * 128], coverage[128 * 128];
    const vsh_lightmap planes = {.ao = ao, .coverage = coverage};
    assert_ok(vsh_bake_lightmap(occluders, charts, NULL, 0, NULL, NULL, &planes, NULL, &failure));
    double sum = 0.0, count = 0.0;
    for (size_t i = 0; i < 128 * 128; ++i) {
        sum += coverage[i] > 0.0f ? (double)ao[i] : 0.0;
        count += coverage[i] > 0.0f;
    }
    assert_true(count > 1000.0);
    return sum / count;
}

/* Normals that lean by 10 degrees at both ends turn the hemisphere by as much; they open no view over the
 * walls.
 */
TEST(leaning_normals_do_not_lift_ao_over_low_walls) {
    static const float SIN = 0.17364818f, COS = 0.98480775f;
    const float leaning[12] = {0.0f, -SIN, COS, 0.0f, -SIN, COS, 0.0f, SIN, COS, 0.0f, SIN, COS};
    const double flat = mean_ao_between_walls(NULL), bent = mean_ao_between_walls(leaning);
    assert_true(flat > 0.4 && flat < 0.8);
    assert_true(fabs(bent - flat) < 0.02);
}

/* A wall at growing distances from the sphere, under a wide sun that the facets' planes cut. */
TEST(a_lift_fades_near_other_triangles) {
    enum { WALLS = 40 };
    static const double FIRST = 1.0, STEP = 0.002;
    vsh_light light = sun_towards(0.0, 1.0, 0.0);
    light.angle = 1.0;
    size_t lifted = 0, faded = 0;
    static double before[TEXELS];
    for (int w = 0; w < WALLS; ++w) {
        const double face = FIRST + STEP * w;
        FREED_BY(close_scene) scene s;
        open_beside_wall(&s, face);
        const vshi_lifter lifter = vshi_lifter_open(occluders_traced(s.field, s.triangles), &light);
        for (size_t i = 0; i < s.flat.count; ++i) {
            const vshi_lift_point point = vshi_sample_lift_point(&s.texels->all, i);
            const double length = vshi_length(vshi_lift_find(&lifter, &point));
            const double room = face - s.flat.positions[3 * i];
            const double x = (double)s.texels->all.lift[3 * i],
                         whole = vshi_length(vshi_vec_off(s.texels->all.lift + 3 * i));
            assert_true(length <= whole * (1.0 + 1e-6));
            if (x > 0.9 * whole && whole > 0.0) {
                /* up to a quarter of the distance along the lift, which leans by 26 degrees at most */
                assert_true(length <= 0.25 * room / 0.9 + 1e-6);
                assert_true(w == 0 || fabs(length - before[i]) < 0.3 * STEP);
                lifted += length > 0.99 * whole;
                faded += length > 0.01 * whole && length < 0.9 * whole;
            }
            before[i] = length;
        }
    }
    assert_true(lifted > 100 && faded > 100);
}

TEST(a_light_changes_nothing_for_other_lights_and_ao) {
    static float values[5][TEXELS];
    float *const planes[5] = {values[0], values[1], values[2], values[3], values[4]};
    FREED_BY(close_scene) scene s;
    open_scene(&s, NULL);
    const vsh_light lights[2] = {sun_towards(0.0, 1.0, 0.0), sun_towards(1.0, 0.0, 0.0)};
    bake(&s, lights, 2, &(vsh_lightmap){.shadow = planes, .ao = planes[2]});
    bake(&s, lights + 1, 1, &(vsh_lightmap){.shadow = planes + 3});
    bake(&s, NULL, 0, &(vsh_lightmap){.ao = planes[4]});
    assert_memory_equal(planes[1], planes[3], sizeof values[1]);
    assert_memory_equal(planes[2], planes[4], sizeof values[2]);
}
