/* Shadow values against closed forms and ray-traced truth. */
#include "shading.h"

#include "previews.h"
#include "truth/directions.h"
#include "truth/metrics.h"

#include <stdio.h>
#include <stdlib.h>

static const float UP[3] = {0.0f, 1.0f, 0.0f};

/* The whole floor, and a picture of each method in the folder of VSH_PICTURES, where that is set; else every
 * second texel in each direction. */
static void the_seeds_floor_is_as_near_to_the_truth_as_promised(void **state) {
    (void)state;
    const char *folder = getenv("VSH_PICTURES");
    const size_t size = folder != NULL ? 512 : 256, count = size * size;
    double *positions = malloc(count * 3 * sizeof *positions);
    float *normals = malloc(count * 3 * sizeof *normals);
    float *truth = malloc(count * sizeof *truth), *visible = malloc(count * sizeof *visible);
    assert_true(positions != NULL && normals != NULL && truth != NULL && visible != NULL);
    floor_texels(size, positions, normals);
    const double normal[3] = {0.0, 1.0, 0.0};
    assert_int_equal(truth_lights(truth_seeds(), count, positions, normal, truth_seeds_sun, truth_seeds_w,
                                  (double)INFINITY, 256, truth),
                     0);
    vsh_field *field = field_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const struct {
        int32_t method;
        double rmse;
    } cases[] = {{VSH_SHADOW_CONE, 0.022},
                 {VSH_SHADOW_SMOOTH, 0.022},
                 {VSH_SHADOW_CLASSIC, 0.16},
                 {VSH_SHADOW_PRACTICAL, 0.16},
                 {VSH_SHADOW_IMPROVED, 0.16}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        const vsh_shade_stats stats =
            shadows(field, &light, cases[i].method, count, positions, normals, visible);
        const truth_metrics m = truth_compare(count, visible, truth, NULL);
        const char *name = vsh_get_name(VSH_NAMES_SHADOW, cases[i].method);
        truth_metrics_print(name, &m);
        print_message("%.2f samples a texel\n", (double)stats.samples / (double)count);
        assert_true(m.rmse <= cases[i].rmse);
        assert_int_equal(stats.unfinished, 0);
        assert_int_equal(stats.invalid, 0);
        assert_int_equal(stats.beyond_reach, 0);
        for (int picture = 0; folder != NULL && picture < 2; ++picture) {
            char path[1024];
            snprintf(path, sizeof path, "%s/%s.pgm", folder, picture ? "truth" : name);
            FILE *file = fopen(path, "wb");
            assert_non_null(file);
            fprintf(file, "P5 %zu %zu 255\n", size, size);
            for (size_t t = 0; t < count; ++t) {
                fputc((int)((picture ? truth[t] : visible[t]) * 255.0f + 0.5f), file);
            }
            assert_int_equal(fclose(file), 0);
        }
    }
    vsh_field_free(field);
    free(visible);
    free(truth);
    free(normals);
    free(positions);
}

static const double ANGLES[] = {0.0, 0.5, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0};
enum { ANGLE_COUNT = sizeof ANGLES / sizeof ANGLES[0] };

static void open_sky_is_exactly_1_at_any_distance_and_size_of_light(void **state) {
    (void)state;
    const truth_solid solids[] = {{TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.0},
                                  {TRUTH_BOX, {0.0, 0.0, 0.0}, {0.9, 0.02, 0.05}, 0.0, 0.0}};
    const double sizes[] = {1.0, 0.90161}; /* radii of the balls around them */
    for (int shape = 0; shape < 2; ++shape) {
        vsh_field *field = field_of((truth_scene){&solids[shape], 1}, 0.05 / (shape == 1 ? 2.5 : 1.0), 0.0);
        uint64_t counter = 1;
        for (double away = 1e-3; away < 2e4; away *= 3.1) {
            for (int a = 0; a < ANGLE_COUNT; ++a) {
                for (int sample = 0; sample < 40; ++sample) {
                    double out[3], side[3], towards[3], position[3];
                    random_direction(&counter, out);
                    const double distance = sizes[shape] + away;
                    for (int axis = 0; axis < 3; ++axis) {
                        position[axis] = distance * out[axis];
                    }
                    /* beside the caster by a cone's width and a tenth more, or away from it */
                    const double half = RADIANS(0.5 * ANGLES[a]);
                    const double least = asin(sizes[shape] / distance) + half * 1.1 + 0.02;
                    if (least > PI) {
                        continue;
                    }
                    const double apart = sample % 2 ? least : between(&counter, least, PI);
                    const truth_frame frame = truth_frame_around(out);
                    const double turn = between(&counter, 0.0, 2.0 * PI);
                    for (int axis = 0; axis < 3; ++axis) {
                        side[axis] = cos(turn) * frame.u[axis] + sin(turn) * frame.v[axis];
                        towards[axis] = -cos(apart) * out[axis] + sin(apart) * side[axis];
                    }
                    const vsh_light light = sun(towards, 2.0 * half);
                    for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
                        const float v = shadow_at(field, &light, method, position, NULL);
                        if (v != 1.0f) {
                            fail_msg("shape %d, %g away, %g degrees, %g apart (least %g), %s: %.9g", shape,
                                     away, ANGLES[a], apart, least, vsh_get_name(VSH_NAMES_SHADOW, method),
                                     (double)v);
                        }
                    }
                }
            }
        }
        vsh_field_free(field);
    }
}

static void a_plane_is_fully_lit_while_the_whole_light_is_over_its_horizon(void **state) {
    (void)state;
    const truth_solid plate = {TRUTH_BOX, {0.0, -0.517, 0.0}, {4.0, 0.517, 4.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&plate, 1}, 0.04, 0.0);
    uint64_t counter = 2;
    for (int a = 0; a < ANGLE_COUNT; ++a) {
        const double half = RADIANS(0.5 * ANGLES[a]);
        for (double over = RADIANS(0.1); half + over < RADIANS(90.0); over *= 1.7) {
            double towards[3];
            direction_at(half + over, between(&counter, 0.0, 2.0 * PI), towards);
            const vsh_light light = sun(towards, 2.0 * half);
            for (int sample = 0; sample < 20; ++sample) {
                const double p[3] = {between(&counter, -4.0, 4.0), sample % 2 ? 0.0 : 1e-3,
                                     between(&counter, -4.0, 4.0)};
                for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
                    const float v = shadow_at(field, &light, method, p, UP);
                    if (v != 1.0f) {
                        fail_msg("(%g, %g, %g), %g degrees, %g over the horizon, %s: %.9g", p[0], p[1], p[2],
                                 ANGLES[a], over * 180.0 / PI, vsh_get_name(VSH_NAMES_SHADOW, method),
                                 (double)v);
                    }
                }
            }
        }
    }
    vsh_field_free(field);
}

static void the_middle_of_a_wide_umbra_is_exactly_0_at_any_depth(void **state) {
    (void)state;
    const double half = 2.0, voxel = 0.05;
    const truth_solid block = {TRUTH_BOX, {0.0, 0.0, 0.0}, {half, half, half}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&block, 1}, voxel, 0.0);
    const double lights[] = {0.0, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0};
    uint64_t counter = 3;
    size_t deepest = 0;
    for (size_t l = 0; l < sizeof lights / sizeof lights[0]; ++l) {
        const double sine = sin(RADIANS(0.5 * lights[l]));
        for (double depth = 0.1; depth < 20000.0; depth *= 1.5) { /* voxels under the block */
            for (int sample = 0; sample < 10; ++sample) {
                /* the cone's ball at the block's centre fills at most 7/10 of it */
                const double distance = half + depth * voxel;
                if (distance * sine > 0.7 * half) {
                    break;
                }
                const double up[3] = {0.0, 1.0, 0.0};
                const vsh_light light = sun(up, RADIANS(lights[l]));
                const double room = 0.1 * half;
                const double p[3] = {between(&counter, -room, room), -distance,
                                     between(&counter, -room, room)};
                for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
                    for (int normal = 0; normal < 2; ++normal) {
                        const float v = shadow_at(field, &light, method, p, normal ? UP : NULL);
                        if (v != 0.0f) {
                            fail_msg("%g voxels deep, %g degrees, %s: %.9g", depth, lights[l],
                                     vsh_get_name(VSH_NAMES_SHADOW, method), (double)v);
                        }
                    }
                }
                deepest = depth > (double)deepest ? (size_t)depth : deepest;
            }
        }
    }
    print_message("deepest: %zu voxels\n", deepest);
    assert_true(deepest > 5000);
    vsh_field_free(field);
}

/* A slab's straight side at x = 0, of `thick` units over y = 0, lit from straight above: what is seen of the
 * disc from (x, -depth) ends at the slab's lower edge in the umbra's half, at its upper edge in the other. */
static void a_straight_edge_casts_the_penumbra_of_a_disc(void **state) {
    (void)state;
    const double thick = 2.0;
    const truth_solid slab = {TRUTH_BOX, {-4.0, 0.5 * thick, 0.0}, {4.0, 0.5 * thick, 6.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&slab, 1}, 0.04, 0.0);
    const double ws[] = {0.02, 0.05}, depths[] = {1.0, 2.0, 5.0, 10.0, 30.0};
    const double up[3] = {0.0, 1.0, 0.0};
    for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 5; ++j) {
            if (ws[i] * depths[j] > 0.5 * thick) {
                continue; /* a cone wider than the slab is deep */
            }
            const vsh_light light = sun(up, 2.0 * atan(ws[i]));
            double worst = 0.0;
            for (int k = -120; k <= 120; ++k) {
                const double x = 0.01 * k * ws[i] * depths[j];
                if (k == 0) {
                    continue; /* along the very face */
                }
                const double p[3] = {x, -depths[j], 0.013};
                const double expected =
                    truth_disc_share(x / (ws[i] * (x > 0.0 ? depths[j] + thick : depths[j])));
                worst =
                    fmax(worst, fabs((double)shadow_at(field, &light, VSH_SHADOW_CONE, p, NULL) - expected));
            }
            print_message("w %g, depth %g (penumbra %.1f voxels): worst %.4f\n", ws[i], depths[j],
                          ws[i] * depths[j] / 0.04, worst);
            /* a depth h shows h behind the edge, which makes x of the umbra's half x / (1 + w x): 0.011 for
             * the wider light; the rest is the lattice, which rounds the edge */
            assert_true(worst <= (i == 0 ? 0.02 : 0.03));
        }
    }
    vsh_field_free(field);
}

/* Values along a line across the penumbra of a box's edge under a sun of w 0.1, from the umbra to the open,
 * at steps of a hundredth of its half width; expected: the closed form. The box is on the left of the edge
 * and above it, and the sun `tilt` radians to the right of straight above: rays of the inner half go in
 * through its bottom and out through its side. */
enum { LINE = 47 };

static void across_an_edge(int32_t method, double tilt, double *values, double *expected) {
    const double w = 0.1, depth = 2.0;
    const truth_solid box = {TRUTH_BOX, {-2.0, 2.0, 0.0}, {2.0, 2.0, 4.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&box, 1}, 0.04, 0.0);
    const double towards[3] = {sin(tilt), cos(tilt), 0.0};
    const vsh_light light = sun(towards, 2.0 * atan(w));
    for (int i = 0; i < LINE; ++i) {
        const double x = 0.05 * (i - LINE / 2), angle = tilt - atan(x * w);
        const double p[3] = {-depth * tan(angle), -depth, 0.013};
        values[i] = (double)shadow_at(field, &light, method, p, NULL);
        expected[i] = truth_disc_share(x);
    }
    vsh_field_free(field);
}

static double second_differences(const double *v) {
    double squares = 0.0;
    for (int i = 1; i + 1 < LINE; ++i) {
        const double second = v[i - 1] - 2.0 * v[i] + v[i + 1];
        squares += second * second;
    }
    return sqrt(squares / (LINE - 2));
}

typedef struct edge_errors {
    double rmse, bands; /* bands: second differences over those of the truth */
} edge_errors;

static edge_errors errors_across_an_edge(int32_t method, double tilt) {
    double values[LINE], expected[LINE], squares = 0.0;
    across_an_edge(method, tilt, values, expected);
    for (int i = 0; i < LINE; ++i) {
        squares += (values[i] - expected[i]) * (values[i] - expected[i]) / LINE;
        assert_true(i == 0 || values[i - 1] - values[i] < 1e-4);
    }
    const edge_errors errors = {sqrt(squares), second_differences(values) / second_differences(expected)};
    print_message("%s, tilt %g: rmse %.4f, second differences %.2f of the truth's\n",
                  vsh_get_name(VSH_NAMES_SHADOW, method), tilt, errors.rmse, errors.bands);
    return errors;
}

/* Both methods read a caster's depth for the distance to its edge. The segment of `cone` is steeper there. */
static void cone_has_no_more_bands_than_smooth_and_a_third_more_error(void **state) {
    (void)state;
    const double tilts[] = {0.25, 0.5, 0.7854, 1.1};
    for (size_t t = 0; t < sizeof tilts / sizeof tilts[0]; ++t) {
        const edge_errors smooth = errors_across_an_edge(VSH_SHADOW_SMOOTH, tilts[t]);
        const edge_errors cone = errors_across_an_edge(VSH_SHADOW_CONE, tilts[t]);
        assert_true(smooth.rmse < 0.07);
        assert_true(cone.rmse < 1.33 * smooth.rmse && cone.bands <= smooth.bands);
    }
}

static void a_point_near_the_shadow_sees_less_of_larger_lights(void **state) {
    (void)state;
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0};
    vsh_field *field = field_of((truth_scene){&ball, 1}, 0.02, 0.0);
    const double up[3] = {0.0, 1.0, 0.0};
    for (int32_t method = VSH_SHADOW_CLASSIC; method <= VSH_SHADOW_CONE; ++method) {
        float rise = 0.0f;
        for (double x = 0.51; x < 1.2; x += 0.06) {
            const double p[3] = {x, -2.0, 0.0};
            float last = 1.0f;
            for (double angle = 0.0; angle <= 60.0; angle += 0.5) {
                const vsh_light light = sun(up, RADIANS(angle));
                const float v = shadow_at(field, &light, method, p, NULL);
                rise = fmaxf(rise, v - last);
                last = v;
            }
            assert_true(last < 1.0f);
        }
        print_message("%s: rises by %.4f at most\n", vsh_get_name(VSH_NAMES_SHADOW, method), (double)rise);
        /* samples of a ray lie h apart, so how near they come to the least h / t changes with the angle */
        assert_true(rise <=
                    (method == VSH_SHADOW_IMPROVED || method == VSH_SHADOW_PRACTICAL ? 0.025f : 0.015f));
    }
    vsh_field_free(field);
}

static void a_larger_occluder_hides_more(void **state) {
    (void)state;
    const double up[3] = {0.0, 1.0, 0.0};
    const vsh_light light = sun(up, RADIANS(20.0));
    float last[VSH_SHADOW_CONE + 1][8];
    for (int32_t method = 0; method <= VSH_SHADOW_CONE; ++method) {
        for (int i = 0; i < 8; ++i) {
            last[method][i] = 1.0f;
        }
    }
    for (double radius = 0.1; radius < 1.2; radius += 0.05) {
        const truth_solid ball = {TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, radius, 0.0};
        vsh_field *field = field_of((truth_scene){&ball, 1}, 0.03, 0.0);
        for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
            for (int i = 0; i < 8; ++i) {
                const double p[3] = {0.15 * i, -2.0, 0.02 * i};
                const float v = shadow_at(field, &light, method, p, NULL);
                assert_true(v <= last[method][i] + 1e-3f);
                last[method][i] = v;
            }
        }
        vsh_field_free(field);
    }
    assert_true(last[VSH_SHADOW_CONE][0] == 0.0f);
}

/* practical is classic through a smoothstep, but for what its march no longer looks at. */
static void practical_is_classic_smoothed(void **state) {
    (void)state;
    enum { COUNT = 64 * 64 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], classic[COUNT], practical[COUNT];
    floor_texels(64, positions, normals);
    vsh_field *field = field_of(truth_seeds(), 0.04, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const vsh_shade_stats a = shadows(field, &light, VSH_SHADOW_CLASSIC, COUNT, positions, normals, classic);
    const vsh_shade_stats b =
        shadows(field, &light, VSH_SHADOW_PRACTICAL, COUNT, positions, normals, practical);
    size_t between_ends = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        const double x = (double)classic[i];
        assert_float_equal(practical[i], x < 0.004 ? 0.0 : x * x * (3.0 - 2.0 * x), 1e-5);
        between_ends += x > 0.1 && x < 0.9;
    }
    assert_true(between_ends > 20);
    assert_true(b.samples <= a.samples);
    vsh_field_free(field);
}

/* Shorter steps find what lies between the samples of whole ones: values change from texel to texel, by a
 * part that another frame changes again, and never for a worse error. */
static void jittered_steps_leave_grain(void **state) {
    (void)state;
    enum { COUNT = 128 * 128 };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], truth[COUNT], plain[COUNT], jittered[COUNT], again[COUNT], other[COUNT];
    floor_texels(128, positions, normals);
    const double normal[3] = {0.0, 1.0, 0.0};
    assert_int_equal(truth_lights(truth_seeds(), COUNT, positions, normal, truth_seeds_sun, truth_seeds_w,
                                  (double)INFINITY, 64, truth),
                     0);
    vsh_field *field = field_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_SMOOTH; /* `cone` looks again where the steps came closest */
    const vsh_points points = {COUNT, positions, normals, NULL};
    vsh_shade_stats whole = vsh_shade_stats_zero(), shorter = vsh_shade_stats_zero();
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, plain, NULL, &whole, NULL),
        VSH_OK);
    options.jitter = 0.5;
    assert_int_equal(vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, jittered, NULL,
                                      &shorter, NULL),
                     VSH_OK);
    vsh_run one = vsh_run_default();
    one.threads = 1;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, &one, again, NULL, NULL, NULL),
        VSH_OK);
    assert_memory_equal(jittered, again, sizeof again);
    options.frame = 1;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, other, NULL, NULL, NULL),
        VSH_OK);
    size_t changed = 0, moved = 0, grey = 0;
    for (size_t i = 0; i < COUNT; ++i) {
        grey += plain[i] > 0.05f && plain[i] < 0.95f;
        changed += jittered[i] != plain[i];
        moved += jittered[i] != other[i];
        assert_true(fabsf(jittered[i] - plain[i]) < 0.1f);
    }
    assert_true(changed > grey / 2 && moved > grey / 2);
    assert_true(shorter.samples > whole.samples);
    const truth_metrics before = truth_compare(COUNT, plain, truth, NULL);
    const truth_metrics after = truth_compare(COUNT, jittered, truth, NULL);
    print_message("rmse %.6f, jittered %.6f\n", before.rmse, after.rmse);
    assert_true(after.rmse <= before.rmse);
    vsh_field_free(field);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_seeds_floor_is_as_near_to_the_truth_as_promised),
        cmocka_unit_test(open_sky_is_exactly_1_at_any_distance_and_size_of_light),
        cmocka_unit_test(a_plane_is_fully_lit_while_the_whole_light_is_over_its_horizon),
        cmocka_unit_test(the_middle_of_a_wide_umbra_is_exactly_0_at_any_depth),
        cmocka_unit_test(a_straight_edge_casts_the_penumbra_of_a_disc),
        cmocka_unit_test(cone_has_no_more_bands_than_smooth_and_a_third_more_error),
        cmocka_unit_test(a_point_near_the_shadow_sees_less_of_larger_lights),
        cmocka_unit_test(a_larger_occluder_hides_more),
        cmocka_unit_test(practical_is_classic_smoothed),
        cmocka_unit_test(jittered_steps_leave_grain),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
