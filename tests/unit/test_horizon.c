/* AO of what is over a horizon: the share of those directions that is free. */
#include "testing.h"
#include "traced.h"

#include "truth/directions.h"

#include <stdlib.h>
#include <vdbshade/trace.h>

enum { SOLIDS = 3, POINTS = 240, RAYS = 8192 };

static const truth_solid SCENE[SOLIDS] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0},
                                          {TRUTH_BOX, {-1.5, 0.8, 0.0}, {0.2, 0.8, 2.0}, 0.0, 0.0},
                                          {TRUTH_BOX, {1.4, 1.1, -0.6}, {0.6, 0.3, 0.5}, 0.0, 0.0}};
static const double FAR = 20.0;

typedef struct stage {
    casting c;
    double positions[3 * POINTS];
    float normals[3 * POINTS];
    float values[POINTS], truth[POINTS];
} stage;

/* Points a little off everything, their normals to all sides. */
static stage *set_up(void) {
    stage *s = calloc(1, sizeof *s);
    const truth_scene scene = {SCENE, SOLIDS};
    s->c = caster_of(scene, 0.04, 4.0);
    uint64_t counter = 5;
    for (size_t i = 0; i < POINTS;) {
        double *p = s->positions + 3 * i, normal[3];
        p[0] = between(&counter, -2.5, 2.5);
        p[1] = between(&counter, 0.05, 2.0);
        p[2] = between(&counter, -2.5, 2.5);
        random_direction(&counter, normal);
        for (int k = 0; k < 3; ++k) {
            s->normals[3 * i + k] = (float)normal[k];
        }
        i += truth_distance(scene, p) > 0.05;
    }
    return s;
}

static void tear_down(stage *s) {
    caster_free(&s->c);
    free(s);
}

static double whole(const float *normal, const double up[3]) {
    return 0.5 * (1.0 + (double)normal[0] * up[0] + (double)normal[1] * up[1] + (double)normal[2] * up[2]);
}

static vsh_result shade(const stage *s, int32_t method, const double up[3], float *values) {
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_method = method;
    options.ao_distance = FAR;
    options.max_error = 0.02;
    options.rays = method == VSH_AO_RAYS ? 512 : 0;
    for (int k = 0; k < 3; ++k) {
        options.ao_up[k] = 3.0 * up[k]; /* of any length */
    }
    const vsh_points points = {POINTS, s->positions, s->normals, NULL};
    return vsh_shade_ao(occluders_of_caster(&s->c), &points, &options, NULL, values, NULL, NULL, NULL,
                        &failure);
}

static void find_truth(stage *s, const double up[3]) {
    const truth_scene scene = {SCENE, SOLIDS};
    for (size_t i = 0; i < POINTS; ++i) {
        const float *n = s->normals + 3 * i;
        const truth_frame frame = truth_frame_around((double[]){n[0], n[1], n[2]});
        size_t over = 0, open = 0;
        for (size_t ray = 0; ray < RAYS; ++ray) {
            double d[3];
            truth_cosine_direction(&frame, ray, RAYS, d);
            if (d[0] * up[0] + d[1] * up[1] + d[2] * up[2] > 0.0) {
                ++over;
                open += !truth_hit(scene, s->positions + 3 * i, d, FAR);
            }
        }
        s->truth[i] = over > 0 ? (float)open / (float)over : 1.0f;
    }
}

TEST(shares_of_what_is_over_a_horizon_are_the_rays) {
    static const double ups[2][3] = {{0.0, 1.0, 0.0}, {0.48, -0.6, 0.64}};
    static const int32_t methods[] = {VSH_AO_RAYS, VSH_AO_ADAPTIVE, VSH_AO_EXACT};
    stage *s = set_up();
    for (int u = 0; u < 2; ++u) {
        find_truth(s, ups[u]);
        for (int m = 0; m < (s->c.triangles != NULL ? 3 : 2); ++m) {
            assert_ok(shade(s, methods[m], ups[u], s->values));
            double square = 0.0, mean = 0.0;
            for (size_t i = 0; i < POINTS; ++i) {
                const double off =
                    whole(s->normals + 3 * i, ups[u]) * ((double)s->values[i] - (double)s->truth[i]);
                square += off * off / POINTS;
                mean += off / POINTS;
            }
            assert_less(sqrt(square), 0.02);
            assert_less(fabs(mean), 0.004);
        }
    }
    tear_down(s);
}

TEST(what_knows_no_horizon_says_so) {
    static const double up[3] = {0.0, 1.0, 0.0};
    stage *s = set_up();
    static const int32_t methods[] = {VSH_AO_TAPS, VSH_AO_CONES};
    for (int m = 0; m < 2; ++m) {
        assert_fails(shade(s, methods[m], up, s->values), VSH_ERROR_ARGUMENT, "over a horizon");
    }
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_method = VSH_AO_ADAPTIVE;
    options.ao_up[2] = NAN;
    const vsh_points points = {POINTS, s->positions, s->normals, NULL};
    assert_int_equal(
        vsh_shade_ao(occluders_of_caster(&s->c), &points, &options, NULL, s->values, NULL, NULL, NULL, NULL),
        VSH_ERROR_ARGUMENT);
    options.ao_up[2] = 1.0;
    static float bent[3 * POINTS];
    assert_int_equal(
        vsh_shade_ao(occluders_of_caster(&s->c), &points, &options, NULL, s->values, NULL, bent, NULL, NULL),
        VSH_ERROR_ARGUMENT);
    tear_down(s);
}
