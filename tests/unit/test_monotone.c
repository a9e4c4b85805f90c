/* What may only go one way: finer voxels and more rays are not farther from the truth, more of a caster hides
 * no less (but for noise), and a lamp that goes away becomes a sun. Of every method; docs/numerics.md has the
 * bounds. test_shadow.c has balls that grow and lights of size 0. */
#include "traced.h"

#include "previews.h"
#include "truth/metrics.h"

enum { SIDE = 64, COUNT = SIDE * SIDE };

static double positions[3 * COUNT];
static float normals[3 * COUNT], outside[COUNT], truth[COUNT], values[COUNT];

static void place_floor(void) {
    floor_texels(SIDE, positions, normals);
    for (size_t i = 0; i < COUNT; ++i) {
        outside[i] = truth_distance(truth_seeds(), positions + 3 * i) > 0.0 ? 1.0f : 0.0f;
    }
}

static void true_shadows(double w) {
    const double up[3] = {0.0, 1.0, 0.0};
    assert_int_equal(truth_lights(truth_seeds(), COUNT, positions, up, truth_seeds_sun, w, (double)INFINITY,
                                  w > 0.0 ? 256 : 1, truth),
                     0);
}

static const double AO_DISTANCE = 0.75;

static void true_ao(void) {
    const double up[3] = {0.0, 1.0, 0.0};
    for (size_t i = 0; i < COUNT; ++i) {
        truth[i] = (float)truth_ao(truth_seeds(), positions + 3 * i, up, AO_DISTANCE, 512);
    }
}

enum { WIDTHS = 4, VOXELS = 5, SHADOWS = VSH_SHADOW_EXACT + 1, KINDS = WIDTHS * SHADOWS + VSH_AO_EXACT + 1 };

static const double ws[WIDTHS] = {0.0, 0.05, 0.1, 0.3}, voxels[VOXELS] = {0.16, 0.08, 0.04, 0.02, 0.01};
static double rmse[KINDS][VOXELS]; /* NAN for methods that are not here */

static int kind_of_shadow(int width, int32_t method) {
    return width * SHADOWS + method;
}

static int kind_of_ao(int32_t method) {
    return WIDTHS * SHADOWS + method;
}

/* Of the methods that know the whole penumbra; the others' errors are their definition's. */
static int measure_all_voxels(void **state) {
    place_floor();
    for (int kind = 0; kind < KINDS; ++kind) {
        for (int v = 0; v < VOXELS; ++v) {
            rmse[kind][v] = (double)NAN;
        }
    }
    for (int v = 0; v < VOXELS; ++v) {
        caster c = caster_of(truth_seeds(), voxels[v], 0.0);
        for (int w = 0; w < WIDTHS; ++w) {
            true_shadows(ws[w]);
            const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(ws[w]));
            for (int32_t method = VSH_SHADOW_SMOOTH; method < shadow_methods(); ++method) {
                cast_shadows(&c, &light, method, COUNT, positions, normals, values);
                const truth_metrics metrics = truth_compare(COUNT, values, truth, outside);
                print_message("voxel %g, w %g, %s: rmse %.4f\n", voxels[v], ws[w],
                              vsh_get_name(VSH_NAMES_SHADOW, method), metrics.rmse);
                assert_true(isfinite(metrics.rmse));
                rmse[kind_of_shadow(w, method)][v] = metrics.rmse;
            }
        }
        true_ao();
        for (int32_t method = 0; method < ao_methods(); ++method) {
            cast_ao(&c, method, AO_DISTANCE, COUNT, positions, normals, values);
            const truth_metrics metrics = truth_compare(COUNT, values, truth, outside);
            print_message("voxel %g, AO %s: rmse %.4f\n", voxels[v], vsh_get_name(VSH_NAMES_AO, method),
                          metrics.rmse);
            assert_true(isfinite(metrics.rmse));
            rmse[kind_of_ao(method)][v] = metrics.rmse;
        }
        caster_free(&c);
    }
    return 0;
}

/* Whether the voxels make all of the error: rays take the rest of it, and one cone what a narrow light sees.
 */
static bool errors_are_of_voxels(int kind) {
    if (kind >= kind_of_ao(0)) {
        const int32_t method = kind - kind_of_ao(0);
        return method == VSH_AO_RAYS || method == VSH_AO_ADAPTIVE;
    }
    const int32_t method = kind % SHADOWS;
    return method == VSH_SHADOW_RAYS || method == VSH_SHADOW_ADAPTIVE ||
           (method != VSH_SHADOW_EXACT && kind < kind_of_shadow(WIDTHS - 1, 0));
}

static void finer_voxels_are_never_farther_from_the_truth(void **state) {
    for (int kind = 0; kind < KINDS; ++kind) {
        for (int v = 1; v < VOXELS && errors_are_of_voxels(kind); ++v) {
            if (rmse[kind][v] > rmse[kind][v - 1]) {
                fail_msg("kind %d: rmse %.5f at voxel %g, %.5f at %g", kind, rmse[kind][v], voxels[v],
                         rmse[kind][v - 1], voxels[v - 1]);
            }
        }
    }
}

/* Where an error is the method's own, not the voxels', it wanders: by 8 % of itself and 0.002, a fortieth of
 * a penumbra. Exact sees no voxels but by what cones prove. */
static void errors_that_are_the_methods_own_change_little_with_voxels(void **state) {
    for (int kind = 0; kind < KINDS; ++kind) {
        for (int v = 1; v < VOXELS; ++v) {
            assert_false(rmse[kind][v] >= 1.08 * rmse[kind][v - 1] + 0.002);
        }
    }
}

static void rays_at_fine_voxels_keep_the_error_that_was_asked_for(void **state) {
    for (int w = 1; w < WIDTHS; ++w) {
        for (int32_t method = VSH_SHADOW_RAYS; method < shadow_methods(); ++method) {
            assert_true(rmse[kind_of_shadow(w, method)][VOXELS - 1] < 0.02);
        }
    }
}

/* Rays, or the error that is asked for: four times the rays, or half of the error. */
static void more_rays_are_never_farther_from_the_truth(void **state) {
    place_floor();
    caster c = caster_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(0.1));
    const vsh_points points = {COUNT, positions, normals, NULL};
    for (int ao = 0; ao < 2; ++ao) {
        if (ao) {
            true_ao();
        } else {
            true_shadows(0.1);
        }
        const int32_t first = ao ? (int32_t)VSH_AO_RAYS : (int32_t)VSH_SHADOW_RAYS;
        const int32_t methods = ao ? ao_methods() : shadow_methods();
        for (int32_t method = first; method < methods; ++method) {
            double last = 1.0;
            for (int step = 0; step < 4; ++step) {
                vsh_shade_options options = preview_options();
                *(ao ? &options.ao_method : &options.method) = method;
                options.ao_distance = AO_DISTANCE;
                options.rays = method == first ? 4 << (2 * step) : 1024;
                options.max_error = 0.08 / (1 << step);
                assert_int_equal(ao ? vsh_shade_ao(occluders_of_caster(&c), &points, &options, NULL, values,
                                                   NULL, NULL, NULL, NULL)
                                    : vsh_shade_shadow(occluders_of_caster(&c), &points, &light, &options,
                                                       NULL, values, NULL, NULL, NULL),
                                 VSH_OK);
                const truth_metrics m = truth_compare(COUNT, values, truth, outside);
                print_message("%s %s, step %d: rmse %.4f\n", ao ? "AO" : "shadow",
                              ao ? vsh_get_name(VSH_NAMES_AO, method)
                                 : vsh_get_name(VSH_NAMES_SHADOW, method),
                              step, m.rmse);
                assert_true(m.rmse < last);
                last = m.rmse;
            }
        }
    }
    caster_free(&c);
}

/* How far a value may rise while the caster grows. Rays have fixed places, so that one of 64 may come free by
 * the field's error; adaptive and exact stop anywhere within an error of 0.02, so that two of their values
 * may be three of its root-2-folds apart; triangulation takes two samples for one surface; and
 * taps add up five samples, of levels that are good to a part of their own voxels. */
static double rise_of_shadow(int32_t method) {
    return method == VSH_SHADOW_IMPROVED    ? 0.05
           : method == VSH_SHADOW_PRACTICAL ? 1.5e-3
           : method == VSH_SHADOW_RAYS      ? 1.1 / 64.0
           : method >= VSH_SHADOW_ADAPTIVE  ? 3.0 * 1.4143 * 0.02
                                            : 1e-3;
}

static double rise_of_ao(int32_t method) {
    return method == VSH_AO_TAPS       ? 5e-3
           : method == VSH_AO_RAYS     ? 1.1 / 64.0
           : method >= VSH_AO_ADAPTIVE ? 3.0 * 1.4143 * 0.02
                                       : 2e-3;
}

/* A slab that grows from a sliver over half of the receivers to all of them, by less than a voxel a time. */
static void a_growing_slab_hides_more(void **state) {
    enum { PLACES = 16, HIDDEN_KINDS = SHADOWS + VSH_AO_EXACT + 1 };
    const double up[3] = {0.0, 1.0, 0.0}, voxel = 0.04;
    const vsh_light light = sun(up, RADIANS(15.0));
    float last[HIDDEN_KINDS][PLACES], first[HIDDEN_KINDS][PLACES], fallen[HIDDEN_KINDS] = {0.0f},
                                                                   rise[HIDDEN_KINDS] = {0.0f}, v[PLACES];
    double at[3 * PLACES];
    float ns[3 * PLACES];
    for (int i = 0; i < PLACES; ++i) {
        const double p[3] = {0.09 * i, -1.5, 0.05 * i};
        memcpy(at + 3 * i, p, sizeof p);
        ns[3 * i] = ns[3 * i + 2] = 0.0f;
        ns[3 * i + 1] = 1.0f;
    }
    bool begun = false;
    for (double half = 0.05; half < 1.2; half += 0.3 * voxel) {
        const truth_solid slab = {TRUTH_BOX, {0.0, 0.2, 0.0}, {half, 0.2, half}, 0.0, 0.0};
        caster c = caster_of((truth_scene){&slab, 1}, voxel, 0.0);
        for (int kind = 0; kind < HIDDEN_KINDS; ++kind) {
            const int32_t method = kind < SHADOWS ? kind : kind - SHADOWS;
            if (method >= (kind < SHADOWS ? shadow_methods() : ao_methods())) {
                continue;
            }
            if (kind < SHADOWS) {
                cast_shadows(&c, &light, method, PLACES, at, NULL, v);
            } else {
                cast_ao(&c, method, 4.0, PLACES, at, ns, v);
            }
            for (int i = 0; i < PLACES; ++i) {
                if (begun) {
                    rise[kind] = fmaxf(rise[kind], v[i] - last[kind][i]);
                    fallen[kind] = fmaxf(fallen[kind], first[kind][i] - v[i]);
                } else {
                    first[kind][i] = v[i];
                }
                last[kind][i] = v[i];
            }
        }
        begun = true;
        caster_free(&c);
    }
    for (int kind = 0; kind < HIDDEN_KINDS; ++kind) {
        const int32_t method = kind < SHADOWS ? kind : kind - SHADOWS;
        if (method >= (kind < SHADOWS ? shadow_methods() : ao_methods())) {
            continue;
        }
        print_message("%s %s rises by %.4f at most, and falls by %.3f\n", kind < SHADOWS ? "shadow" : "AO",
                      kind < SHADOWS ? vsh_get_name(VSH_NAMES_SHADOW, method)
                                     : vsh_get_name(VSH_NAMES_AO, method),
                      (double)rise[kind], (double)fallen[kind]);
        assert_true((double)rise[kind] <= (kind < SHADOWS ? rise_of_shadow(method) : rise_of_ao(method)));
        assert_true(fallen[kind] > 0.05f); /* or nothing was tested; taps sample along the normal only */
    }
}

/* A million units away: what is left of it is the rounding of its direction. */
static void a_far_lamp_is_a_sun(void **state) {
    static float far[COUNT];
    place_floor();
    caster c = caster_of(truth_seeds(), 0.04, 0.0);
    const double half = atan(truth_seeds_w), away = 1e6;
    const double length =
        sqrt(truth_seeds_sun[0] * truth_seeds_sun[0] + truth_seeds_sun[1] * truth_seeds_sun[1] +
             truth_seeds_sun[2] * truth_seeds_sun[2]);
    double place[3];
    for (int axis = 0; axis < 3; ++axis) {
        place[axis] = away * truth_seeds_sun[axis] / length;
    }
    const vsh_light s = sun(truth_seeds_sun, 2.0 * half);
    vsh_light l = lamp(place, away * sin(half));
    strcpy(l.name, s.name); /* by which lights get their own rays */
    for (int32_t method = 0; method < shadow_methods(); ++method) {
        cast_shadows(&c, &s, method, COUNT, positions, normals, values);
        cast_shadows(&c, &l, method, COUNT, positions, normals, far);
        const truth_metrics m = truth_compare(COUNT, far, values, NULL);
        print_message("%s: rms %.2g, worst %.2g\n", vsh_get_name(VSH_NAMES_SHADOW, method), m.rmse, m.max);
        /* a texel of a quarter of a million is one ray, or one edge, that rounds to the other side */
        assert_true(m.rmse < 1e-3);
    }
    caster_free(&c);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(finer_voxels_are_never_farther_from_the_truth, measure_all_voxels),
        cmocka_unit_test(errors_that_are_the_methods_own_change_little_with_voxels),
        cmocka_unit_test(rays_at_fine_voxels_keep_the_error_that_was_asked_for),
        cmocka_unit_test(more_rays_are_never_farther_from_the_truth),
        cmocka_unit_test(a_growing_slab_hides_more),
        cmocka_unit_test(a_far_lamp_is_a_sun),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
