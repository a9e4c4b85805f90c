/* Heightfields that are marched as they are, against Embree's rays on their triangles. */
#include "terrain.h"

#include "base/vec.h"
#include "heightfield/heights.h"
#include "heightfield/place.h"
#include "heightfield/slices.h"

#include <vdbshade/trace.h>

enum { SIDE = 129, POINTS = 3000 };

typedef struct stage {
    float *values;
    vsh_heights_source source;
    vsh_heights *heights;
    vsh_model *model;
    vsh_mesh mesh;
    truth_mesh *truth; /* NULL without Embree */
    double *positions;
    float *normals;
} stage;

/* Points on triangles of the top, which the first are, lifted by a little; their facets' normals. */
static void put_points(stage *s, double lift) {
    uint64_t counter = 1;
    const size_t faces = 2 * (size_t)(s->source.columns - 1) * (size_t)(s->source.rows - 1);
    for (size_t i = 0; i < POINTS; ++i) {
        const size_t face = (size_t)between(&counter, 0.0, (double)faces - 0.001);
        double b = between(&counter, 0.0, 1.0), c = between(&counter, 0.0, 1.0);
        if (b + c > 1.0) {
            b = 1.0 - b;
            c = 1.0 - c;
        }
        vshi_vec corner[3];
        for (int k = 0; k < 3; ++k) {
            corner[k] = vshi_transform_point(
                s->mesh.transform,
                vshi_vec_off(s->mesh.positions + 3 * s->mesh.indices[3 * face + (size_t)k]));
        }
        const vshi_vec ab = vshi_sub(corner[1], corner[0]), ac = vshi_sub(corner[2], corner[0]);
        vshi_vec n = vshi_unit(vshi_cross(ab, ac));
        if (vshi_transform_determinant(s->mesh.transform) < 0.0) {
            n = vshi_scale(n, -1.0);
        }
        const vshi_vec p = vshi_add(corner[0], vshi_add(vshi_scale(ab, b), vshi_scale(ac, c)));
        const vshi_vec q = vshi_add(p, vshi_scale(n, lift));
        const double at[3] = {q.x, q.y, q.z};
        const float normal[3] = {(float)n.x, (float)n.y, (float)n.z};
        memcpy(s->positions + 3 * i, at, sizeof at);
        memcpy(s->normals + 3 * i, normal, sizeof normal);
    }
}

static stage set_up(int columns, int rows, double height, const double *transform) {
    stage s = {.values = hills(columns, rows)};
    s.source = source_of(s.values, columns, rows, 10.0, height);
    s.source.transform = transform;
    s.heights = heights_of(&s.source);
    s.model = model_of(&s.source, VSH_HEIGHTS_SOLID);
    s.mesh = vsh_model_mesh(s.model, 0, -1);
    s.truth = truth_mesh_create(&s.mesh, 1);
    s.positions = malloc(POINTS * 3 * sizeof *s.positions);
    s.normals = malloc(POINTS * 3 * sizeof *s.normals);
    assert_non_null(s.positions);
    assert_non_null(s.normals);
    put_points(&s, 1e-4);
    return s;
}

static void tear_down(stage *s) {
    free(s->normals);
    free(s->positions);
    truth_mesh_free(s->truth);
    vsh_model_free(s->model);
    vsh_heights_free(s->heights);
    free(s->values);
}

static void shadow(const stage *s, const vsh_light *light, int32_t method, float *values) {
    const vsh_points points = {POINTS, s->positions, NULL, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vshi_heights_shadow(s->heights, light, method, &points, 0, POINTS, 0.0, values, &stats);
    assert_true(stats.samples > 0);
}

static double check_sun(const stage *s, const double towards[3], double angle, double most,
                        const char *what) {
    const vsh_light light = sun(towards, angle);
    float values[POINTS], truth[POINTS];
    shadow(s, &light, VSH_SHADOW_CONE, values);
    if (s->truth == NULL) {
        return 0.0;
    }
    assert_int_equal(
        truth_mesh_light(s->truth, POINTS, s->positions, NULL, towards, tan(0.5 * angle), 1024, 0, truth), 0);
    const truth_metrics m = truth_compare(POINTS, values, truth, NULL);
    truth_metrics_print(what, &m);
    assert_true(m.rmse <= most);
    return m.rmse;
}

static void soft_shadows_of_a_low_and_a_high_sun_are_the_rays(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    static const double low[3] = {-0.9, 0.2, 0.35}, middle[3] = {0.3, 0.6, -0.7}, high[3] = {0.05, 1.0, 0.02},
                        along[3] = {1.0, 0.3, 0.0}, below[3] = {-0.9, -0.05, 0.35};
    check_sun(&s, low, RADIANS(12.0), 0.01, "low");
    check_sun(&s, middle, RADIANS(12.0), 0.01, "middle");
    check_sun(&s, middle, RADIANS(0.53), 0.01, "middle, the sun's size");
    check_sun(&s, middle, RADIANS(80.0), 0.01, "middle, wide");
    check_sun(&s, high, RADIANS(20.0), 0.01, "zenith within");
    check_sun(&s, along, RADIANS(12.0), 0.01, "along x");
    check_sun(&s, below, RADIANS(30.0), 0.01, "centre below the horizon");
    tear_down(&s);
}

/* Random normals, so that planes cut discs at all angles: of what is above them the terrain leaves a share.
 */
static void of_a_disc_that_the_horizon_cuts_the_rest_counts(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    uint64_t counter = 9;
    for (size_t i = 0; i < POINTS; ++i) {
        double n[3];
        random_direction(&counter, n);
        for (size_t axis = 0; axis < 3; ++axis) {
            s.normals[3 * i + axis] = (float)n[axis];
        }
        s.positions[3 * i + 1] += 0.02;
    }
    static const double towards[3] = {0.3, 0.3, -0.7};
    const double angle = RADIANS(60.0);
    const vsh_light light = sun(towards, angle);
    float values[POINTS], truth[POINTS], above[POINTS];
    const vsh_points points = {POINTS, s.positions, s.normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    vshi_heights_shadow(s.heights, &light, VSH_SHADOW_CONE, &points, 0, POINTS, 0.0, values, &stats);
    if (s.truth != NULL) {
        static const double far_up[3] = {0.0, 1e6, 0.0};
        static double sky[3 * POINTS];
        for (size_t i = 0; i < POINTS; ++i) {
            memcpy(sky + 3 * i, far_up, sizeof far_up);
        }
        const double w = tan(0.5 * angle);
        truth_mesh_light(s.truth, POINTS, s.positions, s.normals, towards, w, 1024, 0, truth);
        truth_mesh_light(s.truth, POINTS, sky, s.normals, towards, w, 1024, 0, above);
        for (size_t i = 0; i < POINTS; ++i) {
            values[i] *= above[i];
        }
        const truth_metrics m = truth_compare(POINTS, values, truth, NULL);
        truth_metrics_print("cut", &m);
        assert_true(m.rmse <= 0.01);
        assert_true(m.penumbra > POINTS / 4);
    }
    tear_down(&s);
}

static void lamps_are_the_rays(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    static const double places[3][3] = {{1.0, 3.0, 0.5}, {6.5, 1.6, 0.0}, {0.0, 12.0, 0.0}};
    static const double radii[3] = {0.3, 0.4, 4.0};
    vsh_triangles *triangles = NULL;
    if (vsh_triangles_available()) {
        assert_int_equal(vsh_triangles_create(&s.mesh, 1, NULL, &triangles, NULL), VSH_OK);
    }
    for (size_t l = 0; l < 3; ++l) {
        const vsh_light light = lamp(places[l], radii[l]);
        float values[POINTS], truth[POINTS];
        shadow(&s, &light, VSH_SHADOW_CONE, values);
        if (triangles != NULL) {
            assert_int_equal(vsh_trace_shadow(triangles, NULL, POINTS, s.positions, NULL, 0.0, &light, 1024,
                                              NULL, truth, NULL),
                             VSH_OK);
            const truth_metrics m = truth_compare(POINTS, values, truth, NULL);
            truth_metrics_print("lamp", &m);
            assert_true(m.rmse <= 0.01);
        }
    }
    vsh_triangles_free(triangles);
    tear_down(&s);
}

static void points_that_are_no_points_are_nan_and_buried_ones_dark(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    const double positions[12] = {NAN, 0, 0, 0, 5, 0, 0, -0.3, 0, 0, 5, 0};
    const float normals[12] = {0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0};
    static const double up[3] = {0, 1, 0};
    const vsh_light light = sun(up, 0.1);
    const vsh_points points = {4, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    float values[3], ao[3];
    for (size_t begin = 0; begin < 2; ++begin) { /* results begin at 0 whatever the first point */
        vshi_heights_shadow(s.heights, &light, VSH_SHADOW_CONE, &points, begin, begin + 3, 0.0, values,
                            &stats);
        vshi_heights_ao(s.heights, 1.0, NULL, &points, begin, begin + 3, 0.0, ao, NULL, &stats);
        assert_true(isnan(values[1 - begin]) && isnan(ao[1 - begin]));
        assert_true(values[2 - begin] == 0.0f && ao[2 - begin] == 0.0f);
        assert_true(begin == 0 ? isnan(values[0]) && isnan(ao[0]) : values[2] == 1.0f && ao[2] == 1.0f);
    }
    tear_down(&s);
}

static void every_instruction_set_finds_the_same_bits(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    vshi_walk_fn *const walks[] = {
        vshi_walk_base,
#if defined(__x86_64__)
        vsh_isa_available(VSH_ISA_AVX2) ? vshi_walk_avx2 : NULL,
        vsh_isa_available(VSH_ISA_AVX512) ? vshi_walk_avx512 : NULL
#endif
    };
    vshi_slices slices;
    vshi_slices_make(vshi_unit((vshi_vec){0.8, 0.3, 0.2}), 0.3, INFINITY, &slices);
    for (size_t i = 0; i < POINTS; ++i) {
        const vsh_points points = {POINTS, s.positions, NULL, NULL};
        double at[3];
        vshi_vec normal;
        vshi_heights_stand(s.heights, &points, i, 0.0, at, &normal);
        vshi_fan first = slices.fan, ranged = slices.fan;
        ranged.range = 12.0f;
        vshi_fan expected = ranged;
        const uint64_t looked = walks[0](&s.heights->relief, at, &first);
        walks[0](&s.heights->relief, at, &expected);
        for (size_t w = 1; w < sizeof walks / sizeof walks[0]; ++w) {
            vshi_fan again = slices.fan, near = ranged;
            if (walks[w] != NULL) {
                assert_int_equal(walks[w](&s.heights->relief, at, &again), looked);
                assert_memory_equal(again.slope, first.slope, sizeof again.slope);
                walks[w](&s.heights->relief, at, &near);
                assert_memory_equal(near.slope, expected.slope, sizeof near.slope);
            }
        }
    }
    tear_down(&s);
}

static void a_turned_and_mirrored_terrain_casts_as_its_triangles_do(void **state) {
    (void)state;
    static const double turned[12] = {0, -2, 0, 5, -1.2, 0, 1.6, 6, 1.6, 0, 1.2, 7};
    stage s = set_up(SIDE, 90, 2.0, turned);
    static const double towards[3] = {-0.9, 0.3, 0.3};
    check_sun(&s, towards, RADIANS(12.0), 0.01, "turned");
    tear_down(&s);
}

static void hard_shadows_are_the_rays(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    static const double towards[3] = {-0.7, 0.4, 0.35};
    const vsh_light light = sun(towards, RADIANS(10.0));
    float values[POINTS], soft[POINTS], truth[POINTS];
    shadow(&s, &light, VSH_SHADOW_HARD, values);
    const vsh_light point = sun(towards, 0.0);
    shadow(&s, &point, VSH_SHADOW_CONE, soft);
    assert_memory_equal(values, soft, sizeof values);
    if (s.truth != NULL) {
        truth_mesh_light(s.truth, POINTS, s.positions, NULL, towards, 0.0, 1, 0, truth);
        size_t differ = 0;
        for (size_t i = 0; i < POINTS; ++i) {
            differ += values[i] != truth[i];
        }
        print_message("%zu of %d differ\n", differ, POINTS);
        assert_true(differ <= POINTS / 1000);
    }
    tear_down(&s);
}

static void points_beside_and_beneath_the_solid_see_past_it(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    uint64_t counter = 5;
    for (size_t i = 0; i < POINTS; ++i) {
        double *p = s.positions + 3 * i;
        p[0] = between(&counter, -15.0, 15.0);
        p[1] = between(&counter, -8.0, 6.0);
        p[2] = between(&counter, -15.0, 15.0);
    }
    static const double up[3] = {0.5, 0.4, 0.3}, level[3] = {0.5, 0.0, 0.3}, down[3] = {-0.5, -0.3, 0.1};
    check_sun(&s, up, RADIANS(20.0), 0.012, "up");
    check_sun(&s, level, RADIANS(20.0), 0.012, "level");
    check_sun(&s, down, RADIANS(20.0), 0.012, "down");
    tear_down(&s);
}

static void ambient_occlusion_is_the_rays(void **state) {
    (void)state;
    stage s = set_up(SIDE, SIDE, 2.0, NULL);
    static const double distances[] = {0.2, 1.0, 30.0};
    float values[POINTS], truth[POINTS];
    for (size_t d = 0; d < 3; ++d) {
        const vsh_points points = {POINTS, s.positions, s.normals, NULL};
        vsh_shade_stats stats = vsh_shade_stats_zero();
        vshi_heights_ao(s.heights, distances[d], NULL, &points, 0, POINTS, 0.0, values, NULL, &stats);
        if (s.truth != NULL) {
            truth_mesh_ao(s.truth, POINTS, s.positions, s.normals, distances[d], 1024, 0, truth);
            const truth_metrics m = truth_compare(POINTS, values, truth, NULL);
            truth_metrics_print("ao", &m);
            assert_true(m.rmse <= 0.01);
        }
    }
    tear_down(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(soft_shadows_of_a_low_and_a_high_sun_are_the_rays),
        cmocka_unit_test(of_a_disc_that_the_horizon_cuts_the_rest_counts),
        cmocka_unit_test(lamps_are_the_rays),
        cmocka_unit_test(points_that_are_no_points_are_nan_and_buried_ones_dark),
        cmocka_unit_test(every_instruction_set_finds_the_same_bits),
        cmocka_unit_test(a_turned_and_mirrored_terrain_casts_as_its_triangles_do),
        cmocka_unit_test(hard_shadows_are_the_rays),
        cmocka_unit_test(points_beside_and_beneath_the_solid_see_past_it),
        cmocka_unit_test(ambient_occlusion_is_the_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
