/* What may only go one way: finer voxels and more rays are not farther from the truth, more of a caster hides
 * no less (but for noise), and a lamp that goes away becomes a sun. Of every method; docs/accuracy.md has the
 * bounds. test_shadow.c has balls that grow and lights of size 0. */
#include "methods.h"
#include "testing.h"
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

enum { WIDTHS = 4, VOXELS = 5, CASES = WIDTHS * SHADOWS + VSH_AO_EXACT + 1 };

static const double ws[WIDTHS] = {0.0, 0.05, 0.1, 0.3}, voxels[VOXELS] = {0.16, 0.08, 0.04, 0.02, 0.01};
/* Shadows by each width of light and method, then AO; NAN for methods that are not here. */
static double rmse[CASES][VOXELS];

/* Of the methods that know the whole penumbra; the others' errors are their definition's. */
static int measure_all_voxels(void **state) {
    place_floor();
    for (int v = 0; v < VOXELS; ++v) {
        FREED_BY(caster_free) casting c = caster_of(truth_seeds(), voxels[v], 0.0);
        for (int k = 0; k < CASES; ++k) {
            const bool ao = k >= WIDTHS * SHADOWS;
            const int w = k / SHADOWS, kind = ao ? k - WIDTHS * SHADOWS + SHADOWS : k % SHADOWS;
            rmse[k][v] = (double)NAN;
            if (ao ? k == WIDTHS * SHADOWS : kind == 0) {
                ao ? true_ao() : true_shadows(ws[w]);
            }
            if (!ao && kind < VSH_SHADOW_SMOOTH) {
                continue;
            }
            const vsh_light light = sun(truth_seeds_sun, ao ? 0.0 : 2.0 * atan(ws[w]));
            cast_kind(&c, kind, &light, AO_DISTANCE, COUNT, positions, normals, values);
            rmse[k][v] = truth_compare(COUNT, values, truth, outside).rmse;
            assert_true(isfinite(rmse[k][v]));
        }
    }
    return 0;
}

/* Whether the voxels make all of the error: rays take the rest of it, and one cone what a narrow light sees.
 */
static bool errors_are_of_voxels(int k) {
    if (k >= WIDTHS * SHADOWS) {
        const int32_t method = k - WIDTHS * SHADOWS;
        return method == VSH_AO_RAYS || method == VSH_AO_ADAPTIVE;
    }
    const int32_t method = k % SHADOWS;
    return method == VSH_SHADOW_RAYS || method == VSH_SHADOW_ADAPTIVE ||
           (method != VSH_SHADOW_EXACT && k < (WIDTHS - 1) * SHADOWS);
}

/* Where an error is the method's own, not the voxels', it wanders: by 8 % of itself and 0.002, a fortieth of
 * a penumbra. Exact sees no voxels but by what cones prove. Rays at fine voxels keep the error that was asked
 * for. */
TEST(finer_voxels_are_never_farther_from_the_truth) {
    for (int k = 0; k < CASES; ++k) {
        for (int v = 1; v < VOXELS; ++v) {
            const double coarse = rmse[k][v - 1], fine = rmse[k][v];
            const bool measured = !isnan(fine);
            assert_that(
                !measured || ((!errors_are_of_voxels(k) || fine <= coarse) && fine < 1.08 * coarse + 0.002),
                "case %d: rmse %.5f at voxel %g, %.5f at %g", k, fine, voxels[v], coarse, voxels[v - 1]);
        }
        const bool rays = k >= SHADOWS && k < WIDTHS * SHADOWS && k % SHADOWS >= VSH_SHADOW_RAYS;
        assert_true(!rays || rmse[k][VOXELS - 1] < 0.02);
    }
}

/* Rays, or the error that is asked for: four times the rays, or half of the error. */
TEST(more_rays_are_never_farther_from_the_truth) {
    place_floor();
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(0.1));
    const vsh_points points = {COUNT, positions, normals, NULL};
    true_shadows(0.1);
    for (int kind = VSH_SHADOW_RAYS; kind < KINDS; ++kind) {
        if (kind == SHADOWS) {
            true_ao();
            kind = SHADOWS + VSH_AO_RAYS;
        }
        double last = 1.0;
        for (int step = 0; step < 4; ++step) {
            vsh_shade_options options = preview_options();
            const bool rays = kind == VSH_SHADOW_RAYS || kind == SHADOWS + VSH_AO_RAYS;
            options.ao_distance = AO_DISTANCE;
            options.rays = rays ? 4 << (2 * step) : 1024;
            options.max_error = 0.08 / (1 << step);
            shade_kind(&c, kind, &light, options, &points, values);
            const truth_metrics m = truth_compare(COUNT, values, truth, outside);
            assert_true(m.rmse < last);
            last = m.rmse;
        }
    }
}

/* How far a value may rise while the caster grows. Rays have fixed places, so that one of 64 may come free by
 * the field's error; adaptive and exact stop anywhere within an error of 0.02, so that two of their values
 * may be three of its root-2-folds apart; triangulation takes two samples for one surface; and
 * taps add up five samples, of levels that are good to a part of their own voxels. */
static double rise_of(int kind) {
    return kind == VSH_SHADOW_IMPROVED                                ? 0.05
           : kind == VSH_SHADOW_PRACTICAL                             ? 1.5e-3
           : kind == VSH_SHADOW_RAYS || kind == SHADOWS + VSH_AO_RAYS ? 1.1 / 64.0
           : kind >= SHADOWS + VSH_AO_ADAPTIVE                        ? 3.0 * 1.4143 * 0.02
           : kind >= VSH_SHADOW_ADAPTIVE && !is_ao(kind)              ? 3.0 * 1.4143 * 0.02
           : kind == SHADOWS + VSH_AO_TAPS                            ? 5e-3
           : is_ao(kind)                                              ? 2e-3
                                                                      : 1e-3;
}

/* A slab that grows from a sliver over half of the receivers to all of them, by less than a voxel a time. */
TEST(a_growing_slab_hides_more) {
    enum { PLACES = 16 };
    const double up[3] = {0.0, 1.0, 0.0}, voxel = 0.04;
    const vsh_light light = sun(up, RADIANS(15.0));
    float last[KINDS][PLACES], first[KINDS][PLACES], v[PLACES];
    float fallen[KINDS] = {0.0f}, rise[KINDS] = {0.0f};
    double at[3 * PLACES];
    float ns[3 * PLACES];
    for (int i = 0; i < PLACES; ++i) {
        memcpy(at + 3 * i, (const double[]){0.09 * i, -1.5, 0.05 * i}, sizeof(double[3]));
        memcpy(ns + 3 * i, (const float[]){0.0f, 1.0f, 0.0f}, sizeof(float[3]));
    }
    bool begun = false;
    for (double half = 0.05; half < 1.2; half += 0.3 * voxel) {
        const truth_solid slab = {TRUTH_BOX, {0.0, 0.2, 0.0}, {half, 0.2, half}, 0.0, 0.0};
        FREED_BY(caster_free) casting c = caster_of((truth_scene){&slab, 1}, voxel, 0.0);
        for (int kind = 0; kind < KINDS; ++kind) {
            cast_kind(&c, kind, &light, 4.0, PLACES, at, is_ao(kind) ? ns : NULL, v);
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
    }
    for (int kind = 0; kind < KINDS; ++kind) {
        assert_true((double)rise[kind] <= rise_of(kind));
        /* or nothing was tested; taps sample along the normal only */
        assert_true(fallen[kind] > 0.05f);
    }
}

/* A million units away: what is left of it is the rounding of its direction. */
TEST(a_far_lamp_is_a_sun) {
    static float far[COUNT];
    place_floor();
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
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
    for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
        cast_shadows(&c, &s, method, COUNT, positions, normals, values);
        cast_shadows(&c, &l, method, COUNT, positions, normals, far);
        const truth_metrics m = truth_compare(COUNT, far, values, NULL);
        /* a texel of a quarter of a million is one ray, or one edge, that rounds to the other side */
        assert_true(m.rmse < 1e-3 && (method > VSH_SHADOW_CONE || m.max <= 1e-3));
    }
}

FIXTURE(measure_all_voxels, NULL)
