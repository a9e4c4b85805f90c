/* Heightfields that are marched as they are: the methods hard and classic. */
#include "terrain.h"
#include "testing.h"

#include "heightfield/heights.h"

#include <vdbshade/trace.h>

enum { SIDE = 129, POINTS = 3000 };

typedef struct stage {
    float *values;
    vsh_heights_source source;
    vsh_heights *heights;
    vsh_model *model;
    vsh_mesh mesh;
    truth_mesh *truth;
    double positions[3 * POINTS];
    float normals[3 * POINTS];
} stage;

/* Points on triangles of the top, which the first are. */
static void put_points(stage *s) {
    uint64_t counter = 1;
    const size_t faces = 2 * (size_t)(s->source.columns - 1) * (size_t)(s->source.rows - 1);
    for (size_t i = 0; i < POINTS; ++i) {
        const size_t face = (size_t)between(&counter, 0.0, (double)faces - 0.001);
        const double b = uniform(&counter), c = uniform(&counter);
        const bool over = b + c > 1.0;
        stand_on(&s->mesh, face, over ? 1.0 - b : b, over ? 1.0 - c : c, i, s->positions, s->normals);
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
    put_points(&s);
    return s;
}

static void tear_down(stage *s) {
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

TEST(a_hard_march_is_the_ray_but_for_ridges_narrower_than_its_step) {
    /* turned, mirrored, three times as large */
    static const double transform[12] = {0, 0, -3, 100, 0, 3, 0, -40, -3, 0, 0, 7};
    static const double directions[][3] = {
        {-0.9, 0.2, 0.35}, {0.3, 0.6, -0.7}, {0.05, 1.0, 0.02}, {-0.9, -0.05, 0.35}};
    for (int turned = 0; turned < 2; ++turned) {
        FREED_BY(tear_down) stage s = set_up(SIDE, SIDE, 2.0, turned ? transform : NULL);
        for (size_t d = 0; d < sizeof directions / sizeof directions[0]; ++d) {
            const vsh_light light = sun(directions[d], RADIANS(3.0));
            static float values[POINTS], truth[POINTS];
            shadow(&s, &light, VSH_SHADOW_HARD, values);
            truth_mesh_light(s.truth, POINTS, s.positions, NULL, directions[d], 0.0, 1, 0, truth);
            size_t differ = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                differ += values[i] != truth[i];
            }
            assert_at_most(differ, POINTS / 50);
        }
    }
}

/* A plateau of height 4 from x = 0 on, seen from the ground before it: h / (w t) is least at its edge, or
 * where the ray leaves the terrain's height. */
TEST(a_classic_march_is_the_least_height_over_the_cone_s_width) {
    float plateau[65 * 9];
    for (int i = 0; i < 65 * 9; ++i) {
        plateau[i] = i % 65 >= 32 ? 1.0f : 0.0f;
    }
    const vsh_heights_source source = {
        .columns = 65, .rows = 9, .values = plateau, .size = {64, 8}, .height = 4, .base = 1};
    OWNED(vsh_heights) *heights = heights_of(&source);
    static const double towards[3] = {1.0, 0.5, 0.0};
    const double w = 0.2;
    const vsh_light light = sun(towards, 2.0 * atan(w));
    for (int i = 0; i < 29; ++i) {
        const double x = -30.0 + i, position[3] = {x, 0.0, 0.0}, unit = sqrt(1.25);
        /* how high the ray is at the edge, and how far that is along it */
        const double gap = -0.5 * x - 4.0, far = -x * unit, expected = fmin(fmax(gap / (w * far), 0.0), 1.0);
        const vsh_points points = {1, position, NULL, NULL};
        vsh_shade_stats stats = vsh_shade_stats_zero();
        float value[2];
        vshi_heights_shadow(heights, &light, VSH_SHADOW_CLASSIC, &points, 0, 1, 0.0, &value[0], &stats);
        vshi_heights_shadow(heights, &light, VSH_SHADOW_HARD, &points, 0, 1, 0.0, &value[1], &stats);
        if (fabs(gap) > 0.01) {
            assert_float_equal(value[1], gap > 0.0 ? 1.0 : 0.0, 1e-6);
        }
        assert_float_equal(value[0], expected, 0.1); /* it steps over the edge */
    }
}

TEST(points_that_are_no_points_are_nan_and_buried_ones_dark) {
    FREED_BY(tear_down) stage s = set_up(SIDE, SIDE, 2.0, NULL);
    const double positions[12] = {NAN, 0, 0, 0, 5, 0, 0, -0.3, 0, 0, 5, 0};
    const float normals[12] = {0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0};
    static const double up[3] = {0, 1, 0};
    const vsh_light light = sun(up, 0.1);
    const vsh_points points = {4, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    float values[3];
    for (size_t begin = 0; begin < 2; ++begin) { /* results begin at 0 whatever the first point */
        vshi_heights_shadow(s.heights, &light, VSH_SHADOW_CLASSIC, &points, begin, begin + 3, 0.0, values,
                            &stats);
        assert_true(isnan(values[1 - begin]));
        assert_true(values[2 - begin] == 0.0f);
        assert_true(begin == 0 ? isnan(values[0]) : values[2] == 1.0f);
    }
}
