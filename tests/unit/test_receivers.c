/* Where receivers can be and what normals they can have: deep inside, far outside, on lattice planes; of any
 * length, zero, not finite. Of every method; docs/accuracy.md has the bounds. */
#include "methods.h"
#include "testing.h"

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double NOWHERE[3] = {0.0, 0.0, 0.0};

TEST(receivers_deep_inside_are_dark_and_far_outside_are_lit) {
    const truth_solid block = {TRUTH_BOX, {0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}, 0.0, 0.0};
    FREED_BY(caster_free) casting c = caster_of((truth_scene){&block, 1}, 0.05, 0.0);
    uint64_t counter = 12;
    for (int i = 0; i < 400; ++i) {
        double d[3], out[3];
        random_direction(&counter, d);
        random_direction(&counter, out);
        const double depth = pow(10.0, between(&counter, -1.0, 0.0));
        const double p[3] = {between(&counter, depth - 2.0, 2.0 - depth),
                             between(&counter, depth - 2.0, 2.0 - depth),
                             between(&counter, depth - 2.0, 2.0 - depth)};
        const double away = pow(10.0, between(&counter, 1.0, 15.0));
        const double q[3] = {away * out[0], away * out[1], away * out[2]};
        const float n[3] = {(float)d[0], (float)d[1], (float)d[2]};
        const vsh_light light = sun(d, i % 2 ? 0.0 : 0.05), from = sun(out, 0.05);
        for (int kind = 0; kind < KINDS; ++kind) {
            const float *facing = is_ao(kind) ? n : NULL;
            const float inside = cast_kind_at(&c, kind, &light, 1.0, p, facing),
                        outside = cast_kind_at(&c, kind, &from, 1.0, q, facing);
            /* taps go up the normal by the AO distance, and may come out of the solid */
            assert_that((kind == SHADOWS + VSH_AO_TAPS ? inside < 1.0f : inside == 0.0f) && outside == 1.0f,
                        "%s: %.9g at (%g, %g, %g) inside, %.9g outside", name_of(kind), (double)inside, p[0],
                        p[1], p[2], (double)outside);
        }
    }
}

/* As far as doubles go, in every direction from the casters, towards them and away, by every method. */
TEST(receivers_at_any_distance_are_lit) {
    const truth_solid block = {TRUTH_BOX, {0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}, 0.0, 0.0};
    const double scales[] = {1e-10, 1e-6, 1.0, 1e10};
    uint64_t counter = 5;
    for (int s = 0; s < 4; ++s) {
        FREED_BY(caster_free)
        casting c = caster_of_moved((truth_scene){&block, 1}, 0.2, scales[s], NOWHERE, 0.0);
        for (double away = 1e6; away < 1e280; away *= away < 1e24 ? 10.0 : 1e16) {
            double out[3], other[3];
            random_direction(&counter, out);
            random_direction(&counter, other);
            const double far = away * scales[s], q[3] = {far * out[0], far * out[1], far * out[2]};
            const double to[3] = {-out[0], -out[1], -out[2]};
            const vsh_light lights[] = {sun(other, 0.05), sun(out, 0.0), sun(to, 0.05), sun(to, 3.0),
                                        lamp(NOWHERE, 4.0 * scales[s])};
            const float n[3] = {(float)to[0], (float)to[1], (float)to[2]};
            for (int l = 0; l < 5; ++l) {
                for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                    const bool one_sided = l == 2 || l == 3 ? method < VSH_SHADOW_CONE : false;
                    const float v = cast_shadow_at(&c, &lights[l], method, q, NULL);
                    assert_that(one_sided || l == 4 ? v >= 0.0f && v <= 1.0f : v == 1.0f,
                                "%g sizes away, light %d, %s: %.9g", away, l, name_of(method), (double)v);
                }
            }
            for (int32_t method = 0; method < AO_METHODS; ++method) {
                assert_true(cast_ao_at(&c, method, scales[s], q, n) == 1.0f);
                const float v = cast_ao_at(&c, method, 2.0 * far, q, n);
                assert_that(v > (method == VSH_AO_TAPS ? -1.0f : 0.9f) && v <= 1.0f,
                            "%g sizes away, %s: %.9g", away, name_of(SHADOWS + method), (double)v);
            }
        }
    }
}

/* Exactly on the planes, edges and corners of cells, bricks and levels, and beside them by less than a float
 * tells: the same to what a float tells; a ray of 64 may come to lie on the other side of an edge. */
TEST(receivers_on_voxel_planes_see_what_their_neighbours_see) {
    enum { PLACES = 4000, SIDES = 6, ALL = PLACES * (SIDES + 1) };
    static double at[3 * ALL];
    static float ns[3 * ALL], values[ALL];
    static uint32_t texels[ALL]; /* neighbours take the same rays */
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.0625, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    uint64_t counter = 8;
    for (uint32_t i = 0; i < PLACES; ++i) {
        double p[3];
        for (uint32_t axis = 0; axis < 3; ++axis) {
            const double step = 0.0625 * (double)(1 << (i % 6));
            p[axis] = axis != 1 && i % 7 == axis ? between(&counter, -2.4, 2.4)
                                                 : step * round(between(&counter, -2.4, 2.4) / step);
        }
        p[1] = fabs(p[1]) + (i % 3 == 0 ? 0.0 : 0.0625);
        for (uint32_t side = 0; side <= SIDES; ++side) {
            const size_t k = (SIDES + 1) * (size_t)i + side;
            memcpy(at + 3 * k, p, sizeof p);
            memcpy(ns + 3 * k, UP, sizeof UP);
            texels[k] = i;
            if (side < SIDES) {
                at[3 * k + side / 2] += side % 2 ? 1e-9 : -1e-9;
            }
        }
    }
    const vsh_points points = {ALL, at, ns, texels};
    for (int kind = 0; kind < KINDS; ++kind) {
        vsh_shade_options options = preview_options();
        options.ao_distance = 0.5;
        shade_kind(&c, kind, &light, options, &points, values);
        double worst = 0.0;
        size_t changed = 0;
        for (size_t i = 0; i < PLACES; ++i) {
            const float v = values[(SIDES + 1) * i + SIDES];
            assert_true(v >= 0.0f && v <= 1.0f);
            for (size_t side = 0; side < SIDES; ++side) {
                const double apart = fabs((double)(values[(SIDES + 1) * i + side] - v));
                worst = fmax(worst, apart);
                changed += apart > 1e-4;
            }
        }
        const bool rays =
            is_ao(kind) ? kind >= SHADOWS + VSH_AO_RAYS : kind >= VSH_SHADOW_RAYS || kind == VSH_SHADOW_HARD;
        assert_true(rays ? changed < PLACES * SIDES / 100 : worst < 1e-4);
    }
}

TEST(normals_of_any_length_are_directions) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.0625, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const int exponents[] = {-149, -126, -60, -1, 1, 60, 127};
    for (int i = 0; i < 60; ++i) {
        const double p[3] = {-2.4 + 0.08 * i, 0.0, 0.3};
        for (size_t e = 0; e < sizeof exponents / sizeof exponents[0]; ++e) {
            const float n[3] = {0.0f, ldexpf(1.0f, exponents[e]), 0.0f};
            for (int kind = 0; kind < KINDS; ++kind) {
                assert_true(bits_of(cast_kind_at(&c, kind, &light, 0.5, p, n)) ==
                            bits_of(cast_kind_at(&c, kind, &light, 0.5, p, UP)));
            }
        }
    }
}

/* NaN and counted, in every method; the points beside them are as they are without them. The last place is a
 * double, but no place in field space. */
TEST(points_that_are_none_are_nan_and_counted) {
    enum { PLACES = 9, BAD = 7 };
    FREED_BY(caster_free) casting c = caster_of_moved(truth_seeds(), 0.0625, 1e-9, NOWHERE, 8e-9);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const float nan = (float)NAN, inf = (float)INFINITY;
    const double at[3 * PLACES] = {
        0.3e-9, 1e-12, 0.2e-9, (double)NAN, 0,    0, 0, (double)INFINITY,  0, 0, 0,
        0,      0,     0,      0,           0,    0, 0, -(double)INFINITY, 0, 0, 1e305,
        0,      0,     1e-9,   1e-12,       -1e-9};
    const float ns[3 * PLACES] = {0, 1, 0,   0, 1, 0, 0, 1, 0, 0, 0, 0, nan, 1,
                                  0, 0, inf, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0};
    float all[PLACES];
    for (int kind = 0; kind < KINDS; ++kind) {
        const vsh_shade_stats stats = cast_kind(&c, kind, &light, 0.5e-9, PLACES, at, ns, all);
        assert_int_equal(stats.invalid, BAD);
        for (int i = 0; i < PLACES; ++i) {
            assert_int_equal(isnan(all[i]) != 0, i > 0 && i <= BAD);
        }
        /* the samplers tell points apart by their numbers: the first keeps its own */
        const float one = cast_kind_at(&c, kind, &light, 0.5e-9, at, ns);
        assert_int_equal(bits_of(one), bits_of(all[0]));
    }
}
