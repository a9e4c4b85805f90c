/* The ends of every range that a scene has, by every method: options, voxels, bands, AO distances, steps,
 * receivers, normals and lights. There, values equal a closed form or those of the middle of the range, or
 * the call names what it refuses. docs/accuracy.md has the bounds. test_light.c has lights that are refused.
 */
#include "rays.h"
#include "testing.h"
#include "traced.h"

#include "field/field.h"
#include "shade/kernel/march.h"
#include "truth/metrics.h"

enum { SIDE = 64, COUNT = SIDE * SIDE };

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double NOWHERE[3] = {0.0, 0.0, 0.0};
static double positions[3 * COUNT];
static float normals[3 * COUNT];

typedef struct picture {
    float v[KINDS][COUNT];
} picture;

TEST(shade_options_out_of_range_are_refused_by_name) {
#define MEMBER(name) #name, offsetof(vsh_shade_options, name)
    static const struct {
        const char *name;
        size_t offset;
        bool whole;
        double bad[2];
    } cases[] = {{MEMBER(method), true, {-1, VSH_SHADOW_AUTO + 1}},
                 {MEMBER(ao_method), true, {-1, VSH_AO_AUTO + 1}},
                 {MEMBER(ao_cones), true, {0, 257}},
                 {MEMBER(max_steps), true, {15, 65537}},
                 {MEMBER(rays), true, {-1, 4097}},
                 {MEMBER(sampler), true, {-1, VSH_SAMPLER_BLUE + 1}},
                 {MEMBER(frame), true, {-1, INT32_MIN}},
                 {MEMBER(early_rays), true, {-1, 4097}},
                 {MEMBER(ao_distance), false, {0.0, INFINITY}},
                 {MEMBER(start_offset), false, {-0.1, 17.0}},
                 {MEMBER(surface_offset), false, {-1.0, INFINITY}},
                 {MEMBER(max_error), false, {0.0, 1.1}},
                 {MEMBER(jitter), false, {-0.1, 1.1}},
                 {MEMBER(ao_up[2]), false, {-INFINITY, INFINITY}}};
#undef MEMBER
    OWNED(vsh_field) *field = field_of_nothing(0.1);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const vsh_points none = {0, NULL, NULL, NULL};
    vsh_shade_options options;
    for (size_t i = 0; i < 3 * COUNT_OF(cases); ++i) {
        const double bad = i % 3 < 2 ? cases[i / 3].bad[i % 3] : NAN;
        const int32_t whole = i % 3 < 2 ? (int32_t)bad : INT32_MAX;
        const bool valid = i % 3 == 2 && strcmp(cases[i / 3].name, "frame") == 0;
        char *member = (char *)&options + cases[i / 3].offset;
        options = vsh_shade_options_default();
        memcpy(member, cases[i / 3].whole ? (const void *)&whole : &bad,
               cases[i / 3].whole ? sizeof whole : sizeof bad);
        assert_fails(
            vsh_shade_shadow(occluders_of(field), &none, &light, &options, NULL, NULL, NULL, NULL, &failure),
            valid ? VSH_OK : VSH_ERROR_ARGUMENT, cases[i / 3].name);
    }
    options = vsh_shade_options_default();
    options.struct_size = 3;
    assert_fails(vsh_shade_ao(occluders_of(field), &none, &options, NULL, NULL, NULL, NULL, NULL, &failure),
                 VSH_ERROR_ARGUMENT, "vsh_shade_options");
    assert_ok(vsh_shade_ao(occluders_of(field), &none, NULL, NULL, NULL, NULL, NULL, NULL, &failure));
}

/* test_relations.c shades voxels of all sizes between them. */
TEST(voxels_beyond_the_ends_are_refused_by_size) {
    const double voxels[] = {0.9e-12, 1e-30, 1.1e12, 1e30, 1e-12, 1e12};
    for (size_t v = 0; v < COUNT_OF(voxels); ++v) {
        vsh_sdf_node node = vsh_sdf_node_default();
        node.scale = 20.0 * voxels[v];
        const vsh_sdf sdf = {&node, 1};
        const vsh_grid_options options = with_voxel(voxels[v]);
        OWNED(vsh_grid) *grid = NULL;
        assert_fails(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure),
                     v < 4 ? VSH_ERROR_LIMIT : VSH_OK, "1e-12");
        assert_int_equal(grid != NULL, v >= 4);
    }
}

/* NULL where the half width is refused. */
static vsh_field *field_of_half_width(truth_scene scene, double half_width) {
    vsh_sdf_node nodes[2 * MAX_SOLIDS];
    const vsh_sdf sdf = tree_of_moved(scene, 1.0, NOWHERE, nodes);
    vsh_grid_options options = with_voxel(0.03);
    options.half_width = half_width;
    if (half_width < 3.0 || half_width > 100.0) {
        vsh_grid *grid = NULL;
        assert_fails(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                     "half_width");
        return NULL;
    }
    return field_of_grid(grid_of_tree(nodes, sdf.node_count, options), 0.0);
}

/* Bands wider than 6 voxels are cut: the field makes its levels from them. */
TEST(half_widths_from_6_to_100_give_the_same_picture_and_3_one_as_near_the_truth) {
    static picture at_6, there;
    static float truth[2][COUNT], outside[COUNT];
    const double up[3] = {0.0, 1.0, 0.0};
    const truth_solid solids[2] = {{TRUTH_SPHERE, {0.0, 0.9, 0.0}, {0, 0, 0}, 0.5, 0.0},
                                   {TRUTH_BOX, {1.3, 0.5, 0.0}, {0.3, 0.5, 0.3}, 0.0, 0.0}};
    const truth_scene scene = {solids, 2};
    floor_texels(SIDE, positions, normals);
    assert_int_equal(truth_lights(scene, COUNT, positions, up, truth_seeds_sun, truth_seeds_w,
                                  (double)INFINITY, 256, truth[0]),
                     0);
    for (size_t i = 0; i < COUNT; ++i) {
        truth[1][i] = (float)truth_ao(scene, positions + 3 * i, up, 0.75, 256);
        outside[i] = truth_distance(scene, positions + 3 * i) > 0.0 ? 1.0f : 0.0f;
    }
    casting c = {NULL, triangles_of_moved(scene, 1.0, NOWHERE)};
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    const double half_widths[] = {1.0, 2.0, 2.999, 6.0, 3.0, 4.0, 10.0, 30.0, 100.0, 101.0};
    for (size_t h = 0; h < COUNT_OF(half_widths); ++h) {
        c.field = field_of_half_width(scene, half_widths[h]);
        for (int kind = 0; kind < KINDS && c.field != NULL; ++kind) {
            picture *p = half_widths[h] == 6.0 ? &at_6 : &there;
            cast_kind(&c, kind, &light, 0.75, COUNT, positions, normals, p->v[kind]);
            const truth_metrics m = truth_compare(COUNT, p->v[kind], truth[is_ao(kind)], outside);
            const truth_metrics same = truth_compare(COUNT, at_6.v[kind], truth[is_ao(kind)], outside);
            const truth_metrics apart = truth_compare(COUNT, p->v[kind], at_6.v[kind], outside);
            /* as at 6, or a tenth of a penumbra's step worse at 3 and 4, whose coarse levels hold less */
            assert_true(m.rmse <= same.rmse + 0.004);
            assert_true(kind != VSH_SHADOW_CONE || m.rmse < 0.032);
            /* distances that differ by a float's rounding, 1e-6 voxels, may be rounded to steps of 2.4e-4
             * apart: a 250th of them, an rms of 1.5e-5 */
            assert_true(half_widths[h] < 6.0 || apart.rmse < (kind == VSH_SHADOW_HARD ? 0.016
                                                              : by_rays(kind)         ? 2e-3
                                                                                      : 1.5e-5));
        }
        vshi_field_free(c.field);
    }
    vshi_triangles_free(c.triangles);
}

TEST(ao_distances_below_a_voxel_and_above_the_scene_are_exact) {
    const truth_solid solids[2] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {2.0, 0.5, 2.0}, 0.0, 0.0},
                                   {TRUTH_BOX, {-1.5, 1.0, 0.0}, {0.5, 1.0, 2.0}, 0.0, 0.0}};
    const truth_scene scene = {solids, 2};
    FREED_BY(caster_free) casting c = caster_of(scene, 0.04, 0.0);
    const double distances[] = {0x1p-1000, 1e-300, 1e-12, 1e-3, 0.01,  0.04,
                                4.0,       40.0,   1e6,   1e12, 1e300, 0x1p1000};
    enum { PLACES = 24 };
    float all[PLACES] = {0.0f}, v[PLACES], ns[3 * PLACES];
    double at[3 * PLACES], truth[PLACES];
    for (int i = 0; i < PLACES; ++i) {
        const double lifted[3] = {-0.9 + 0.1 * i, 1e-6, 0.11}, up[3] = {0.0, 1.0, 0.0};
        put_point(at, ns, (size_t)i, lifted[0], 0.0, lifted[2]);
        truth[i] = truth_ao(scene, lifted, up, 100.0, 4096);
    }
    for (int32_t method = 0; method < AO_METHODS; ++method) {
        for (size_t d = 0; d < COUNT_OF(distances); ++d) {
            cast_ao(&c, method, distances[d], PLACES, at, ns, v);
            double worst = 0.0;
            for (int i = 0; i < PLACES; ++i) {
                assert_true(v[i] >= 0.0f && v[i] <= 1.0f);
                worst = fmax(worst, fabs((double)v[i] - truth[i]));
                if (distances[d] < 0.05) {
                    assert_true(v[i] == 1.0f); /* the wall is farther than that */
                }
                if (distances[d] == 4.0) {
                    all[i] = v[i]; /* all that there is */
                } else if (distances[d] > 4.0 && method != VSH_AO_TAPS) {
                    assert_int_equal(bits_of(v[i]), bits_of(all[i]));
                }
            }
            /* 3 times the requested standard error; cones smooth the edges of the wall */
            assert_true(distances[d] < 1.0 || method == VSH_AO_TAPS ||
                        worst < (method == VSH_AO_CONES ? 0.08 : 0.06));
        }
    }
}

/* A bar of 30 000 voxels, and a ray so near to its face that each step is the least one, a quarter of a
 * voxel. Samples lie at distances along the ray, so no error adds up. */
TEST(a_hundred_thousand_least_steps_lose_nothing) {
    const double length = 30000.0;
    const truth_solid bar = {TRUTH_BOX, {0.0, -4.0, 0.0}, {0.5 * length, 4.0, 4.0}, 0.0, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&bar, 1}, 1.0, 8.0);
    const double heights[] = {0.01, 0.1, 0.24};
    for (int i = 0; i < 3; ++i) {
        /* the kernel itself: its callers allow 65536 steps */
        const double start[3] = {-0.5 * length + 100.0, heights[i], 0.3};
        const vshi_vec o = vshi_to_field(field, start);
        static vshi_chunk ray;
        ray.count = 1;
        ray.origin[0][0] = (float)o.x;
        ray.origin[1][0] = (float)o.y;
        ray.origin[2][0] = (float)o.z;
        ray.direction[0][0] = 1.0f;
        ray.begin[0] = 0.0625f;
        ray.end[0] = (float)(length - 200.0);
        ray.close[0] = 1.0f;
        vshi_march_stats stats = {0, 0};
        vshi_kernel_of(VSH_ISA_BEST)->march(field, &ray, VSHI_MARCH_PLAIN, 1 << 20, &stats);
        const double expected = heights[i] / (length - 200.0);
        assert_true(stats.samples > 100000);
        assert_int_equal(stats.unfinished, 0);
        assert_true(fabs((double)ray.close[0] / expected - 1.0) < 1e-3);
    }
}

/* --- receivers: deep inside, far outside, on lattice planes; normals of any length, zero, not finite */

TEST(receivers_deep_inside_are_dark) {
    const truth_solid block = {TRUTH_BOX, {0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}, 0.0, 0.0};
    FREED_BY(caster_free) casting c = caster_of((truth_scene){&block, 1}, 0.05, 0.0);
    uint64_t counter = 12;
    for (int i = 0; i < 400; ++i) {
        double d[3];
        random_direction(&counter, d);
        const double depth = pow(10.0, between(&counter, -1.0, 0.0));
        const double p[3] = {between(&counter, depth - 2.0, 2.0 - depth),
                             between(&counter, depth - 2.0, 2.0 - depth),
                             between(&counter, depth - 2.0, 2.0 - depth)};
        const float n[3] = {(float)d[0], (float)d[1], (float)d[2]};
        const vsh_light light = sun(d, i % 2 ? 0.0 : 0.05);
        for (int kind = 0; kind < KINDS; ++kind) {
            const float inside = cast_kind_at(&c, kind, &light, 1.0, p, is_ao(kind) ? n : NULL);
            /* taps go up the normal by the AO distance, and may come out of the solid */
            assert_that(kind == SHADOW_METHODS + VSH_AO_TAPS ? inside < 1.0f : inside == 0.0f,
                        "%s: %.9g at (%g, %g, %g)", name_of(kind), (double)inside, p[0], p[1], p[2]);
        }
    }
}

/* Distances up to 1e280, in every direction from the casters, with light towards them and away. */
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
                            "%g sizes away, %s: %.9g", away, name_of(SHADOW_METHODS + method), (double)v);
            }
        }
    }
}

/* Receivers lie exactly on planes, edges and corners of cells, bricks and levels. Their neighbours are off by
 * less than a float can hold. A ray of 64 may come to lie on the other side of an edge. */
TEST(receivers_on_voxel_planes_have_their_neighbours_values) {
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
            put_point(at, ns, k, p[0], p[1], p[2]);
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
        const bool rays = by_rays(kind) || kind == VSH_SHADOW_HARD;
        assert_true(rays ? changed < PLACES * SIDES / 100 : worst < 1e-4);
    }
}

TEST(normals_of_any_length_are_directions) {
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.0625, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const int exponents[] = {-149, -126, -60, -1, 1, 60, 127};
    for (int i = 0; i < 60; ++i) {
        const double p[3] = {-2.4 + 0.08 * i, 0.0, 0.3};
        for (size_t e = 0; e < COUNT_OF(exponents); ++e) {
            const float n[3] = {0.0f, ldexpf(1.0f, exponents[e]), 0.0f};
            for (int kind = 0; kind < KINDS; ++kind) {
                assert_true(bits_of(cast_kind_at(&c, kind, &light, 0.5, p, n)) ==
                            bits_of(cast_kind_at(&c, kind, &light, 0.5, p, UP)));
            }
        }
    }
}

/* Such points are NaN and counted, in every method. The others are as without them. The last place is a
 * double, but no place in field space. */
TEST(invalid_points_are_nan_and_counted) {
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

/* --- lights: angles of suns, radii and distances of lamps; lamps in casters, on surfaces and at receivers;
 * light that grazes */

static casting plate(double voxel) {
    const truth_solid solid = {TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0};
    return caster_of((truth_scene){&solid, 1}, voxel, 0.0);
}

/* A ball over the receiver, out of the axis. The truth is 4096 rays. Cones take the edge as straight, so they
 * are off by its curvature. */
TEST(lights_of_0_to_179_degrees_stay_in_range_and_near_the_truth) {
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 2.0, 0.0}, {0.0, 0.0, 0.0}, 0.7, 0.0};
    const truth_scene scene = {&ball, 1};
    FREED_BY(caster_free) casting c = caster_of(scene, 0.04, 0.0), open = plate(0.06);
    const double up[3] = {0.0, 1.0, 0.0},
                 angles[] = {0.0, 1e-6, 1e-3, 0.5, 5, 20, 60, 90, 120, 150, 170, 179};
    for (size_t a = 0; a < COUNT_OF(angles); ++a) {
        const double w = tan(RADIANS(0.5 * angles[a]));
        const vsh_light light = sun(up, RADIANS(angles[a]));
        double worst[VSH_SHADOW_EXACT + 1] = {0.0};
        for (int i = 0; i < 24; ++i) {
            const double p[3] = {0.13 * i, 0.0, 0.01 * i};
            const double truth = truth_light(scene, p, NULL, up, w, (double)INFINITY, 4096);
            for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                const float v = cast_shadow_at(&c, &light, method, p, NULL);
                assert_true(v >= 0.0f && v <= 1.0f);
                worst[method] = fmax(worst[method], fabs((double)v - truth));
            }
            /* the open plate sees all of a light that is over its horizon */
            const double q[3] = {0.1 * i - 1.2, 0.0, 0.03 * i};
            for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                const float v = cast_shadow_at(&open, &light, method, q, UP);
                assert_that(v == 1.0f, "%g degrees over an open plate, %s: %.9g", angles[a], name_of(method),
                            (double)v);
            }
        }
        /* a ball smaller than the light is no straight edge */
        assert_true(worst[VSH_SHADOW_CONE] < (angles[a] <= 20.0 ? 0.06 : 0.6));
        /* three standard errors of 0.02; 64 rays have less */
        assert_true(worst[VSH_SHADOW_RAYS] < 0.05 && worst[VSH_SHADOW_ADAPTIVE] < 0.06);
        assert_true(worst[VSH_SHADOW_EXACT] < 0.06);
    }
}

/* A lamp over a plate, with nothing between them, and one under it; radii and distances of 1e-6 … 1e6. */
TEST(lamps_of_1e_6_to_1e6_units_are_seen_from_above_and_not_through_the_plate) {
    FREED_BY(caster_free) casting c = plate(0.06);
    for (double away = 1e-6; away < 2e6; away *= 10.0) {
        for (double radius = 1e-6; radius < 2e6; radius *= 10.0) {
            const double p[3] = {0.31, 0.0, -0.17}, over[3] = {0.31, away, -0.17};
            const double under[3] = {0.31, -1.0 - away - radius, -0.17};
            for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                vsh_light light = lamp(over, radius);
                const float lit = cast_shadow_at(&c, &light, method, p, UP);
                light = lamp(under, radius);
                const float turned = cast_shadow_at(&c, &light, method, p, UP);
                const float bare = cast_shadow_at(&c, &light, method, p, NULL);
                assert_that(lit == 1.0f && turned == 0.0f && bare >= 0.0f && bare <= 1.0f,
                            "%g away, radius %g, %s: %.9g, %.9g, %.9g", away, radius, name_of(method),
                            (double)lit, (double)turned, (double)bare);
            }
        }
    }
}

TEST(lamps_on_a_surface_light_its_own_side) {
    const double voxel = 0.05;
    FREED_BY(caster_free) casting c = plate(voxel);
    uint64_t counter = 6;
    for (int i = 0; i < 300; ++i) {
        const double p[3] = {between(&counter, -2.5, 2.5), i % 2 ? 0.4 : -1.4, between(&counter, -2.5, 2.5)};
        const double x = between(&counter, -2.5, 2.5), z = between(&counter, -2.5, 2.5);
        const double at[3] = {x, 0.0, z}, off[3] = {x, voxel, z}, in[3] = {x, -voxel, z};
        for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
            for (int size = 0; size < 2; ++size) {
                const vsh_light on = lamp(at, size * 0.1), above = lamp(off, 0.0), below = lamp(in, 0.0);
                const float v = cast_shadow_at(&c, &on, method, p, NULL);
                assert_true(v >= 0.0f && v <= 1.0f); /* to a voxel it is on either side */
                assert_true(cast_shadow_at(&c, &above, method, p, NULL) == (i % 2 ? 1.0f : 0.0f));
                assert_true(cast_shadow_at(&c, &below, method, p, NULL) == 0.0f);
            }
        }
    }
}

/* Balls and boxes with a lamp in them, which may be larger than a voxel: rays to it meet the caster. */
TEST(lamps_in_casters_light_nothing_outside) {
    const truth_solid solids[2] = {{TRUTH_SPHERE, {-1.2, 0.0, 0.0}, {0, 0, 0}, 0.7, 0.0},
                                   {TRUTH_BOX, {1.2, 0.1, 0.0}, {0.6, 0.5, 0.7}, 0.0, 0.0}};
    const truth_scene scene = {solids, 2};
    FREED_BY(caster_free) casting c = caster_of(scene, 0.05, 0.0);
    uint64_t counter = 14;
    for (int i = 0; i < 400;) {
        const double p[3] = {between(&counter, -3.0, 3.0), between(&counter, -2.0, 2.0),
                             between(&counter, -2.0, 2.0)};
        if (truth_distance(scene, p) < 0.1) {
            continue;
        }
        const double radii[] = {0.0, 1e-6, 0.2};
        const double at[3] = {i % 2 ? 1.2 : -1.2, between(&counter, -0.2, 0.2), between(&counter, -0.2, 0.2)};
        const vsh_light light = lamp(at, radii[i % 3]);
        for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
            const float v = cast_shadow_at(&c, &light, method, p, NULL);
            assert_that(v == 0.0f, "%s: %.9g from (%g, %g, %g)", name_of(method), (double)v, p[0], p[1],
                        p[2]);
        }
        ++i;
    }
}

/* Over a floor with nothing near, by its height and its radius: what the receiver sees of it is what its own
 * horizon leaves, however near it is; 0 away is in it. Turned aside, to `elevation` over the floor, it must
 * not sink under the place that rays begin at. */
TEST(lamps_at_the_receiver_are_cut_by_its_horizon_only) {
    const double voxel = 0.06;
    FREED_BY(caster_free) casting c = plate(voxel);
    const double parts[] = {0.0, 1e-6, 0.01, 0.1, 0.2, 0.25, 0.3, 0.5, 1.0, 2.0}; /* of a voxel */
    const double elevations[] = {90.0, 60.0, 30.0};
    for (size_t d = 0; d < COUNT_OF(parts); ++d) {
        for (size_t e = 0; e < 3; ++e) {
            const double p[3] = {0.31, 0.0, -0.17};
            double way[3];
            direction_at(RADIANS(elevations[e]), 0.3, way);
            const double away = parts[d] * voxel;
            const double at[3] = {p[0] + away * way[0], p[1] + away * way[1], p[2] + away * way[2]};
            /* small enough to be over the horizon, or without size */
            const double radii[] = {0.0, 0.4 * away, 0.1 * voxel};
            for (int r = 0; r < 3; ++r) {
                const vsh_light light = lamp(at, radii[r]);
                const double sine = away > 0.0 ? radii[r] / away : 2.0;
                const bool whole = sine >= 1.0 || sine <= way[1];
                for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                    const float v = cast_shadow_at(&c, &light, method, p, UP);
                    assert_that(whole ? v == 1.0f : v >= 0.4f && v <= 1.0f,
                                "%g voxels away at %g degrees, radius %g, %s: %.9g", parts[d], elevations[e],
                                radii[r], name_of(method), (double)v);
                }
            }
        }
    }
}

/* With the triangles there is a truth for it: the one ray. */
TEST(exact_of_a_light_without_size_is_one_traced_ray) {
    static float exact[COUNT], ray[COUNT];
    floor_texels(SIDE, positions, normals);
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const double place[3] = {0.4, 2.5, 0.3};
    const vsh_light lights[2] = {sun(truth_seeds_sun, 0.0), lamp(place, 0.0)};
    for (int l = 0; l < 2; ++l) {
        cast_shadows(&c, &lights[l], VSH_SHADOW_EXACT, COUNT, positions, normals, exact);
        see_light(c.triangles, NULL, COUNT, positions, normals, 1e-5, &lights[l], 1, ray);
        size_t other = 0, dark = 0;
        for (size_t i = 0; i < COUNT; ++i) {
            assert_true(exact[i] == 0.0f || exact[i] == 1.0f);
            other += exact[i] != ray[i];
            dark += ray[i] == 0.0f;
        }
        /* the two begin a hundred-thousandth apart, which an edge may lie in: not one in a thousand */
        assert_true(other <= COUNT / 1000 && dark > COUNT / 20 && dark < COUNT);
    }
}

/* Down to a millionth of a radian over the horizon: what the whole light is above of is lit, whichever way
 * the plate lies on the lattice. */
TEST(grazing_light_reaches_an_open_plate) {
    static const double low[3] = {-2.0, -0.5, -2.0}, high[3] = {2.0, 0.5, 2.0};
    for (int turn = 0; turn < 3; ++turn) {
        const double angle = RADIANS(turn == 0 ? 0.0 : turn == 1 ? 31.0 : 10.0);
        const double axis[3] = {turn == 0, turn == 1, turn == 2};
        vsh_sdf_node node = box_node(high[0], high[1], high[2]);
        node.rotation[turn] = sin(0.5 * angle);
        node.rotation[3] = cos(0.5 * angle);
        float corners[24];
        double transform[12];
        make_turn(axis, angle, NOWHERE, transform);
        vsh_mesh mesh = box_mesh(corners, low, high);
        mesh.transform = transform;
        FREED_BY(caster_free)
        casting c = {field_of_grid(grid_of_tree(&node, 1, with_voxel(0.04)), 0.0), triangles_from(&mesh, 1)};
        uint64_t counter = 5;
        for (double sine = 1e-6; sine < 0.6; sine *= 3.0) {
            for (int i = 0; i < 60; ++i) {
                const double p[3] = {between(&counter, -1.9, 1.9), 0.5, between(&counter, -1.9, 1.9)};
                double towards[3], d[3], q[3], up[3];
                direction_at(asin(sine), between(&counter, 0.0, 2.0 * PI), towards);
                turn_about(axis, angle, towards, d);
                turn_about(axis, angle, p, q);
                turn_about(axis, angle, (const double[]){0.0, 1.0, 0.0}, up);
                const float n[3] = {(float)up[0], (float)up[1], (float)up[2]};
                for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                    const vsh_light light = sun(d, method == VSH_SHADOW_HARD ? 0.0 : 1.9 * asin(sine));
                    float v = -1.0f;
                    const vsh_shade_stats stats = cast_shadows(&c, &light, method, 1, q, n, &v);
                    assert_true(stats.unfinished == 0 && v == 1.0f);
                }
            }
        }
    }
}

/* A light of a type over the seeds' floor: `size` is an angle, a radius or the sides of a square. */
static vsh_light light_of_size(int32_t type, double size) {
    static const double ABOVE[3] = {1.0, 3.0, 1.0};
    vsh_light light = type == VSH_LIGHT_DIRECTIONAL ? sun(truth_seeds_sun, size) : lamp(ABOVE, size);
    light.type = type;
    light.axis[1] = -1.0;
    light.inner_angle = 2.0;
    light.outer_angle = 2.4;
    light.edge_u[0] = light.edge_v[2] = size;
    return light;
}

/* The casters: the seeds as voxels and triangles; a ball as a layer without voxels. */
typedef struct ranges_stage {
    enum { FIELD, BALL, STAGES } kind;
    casting seeds;
    vsh_field *empty;
    vshi_spheres *ball;
} ranges_stage;

enum { FLOOR_SIDE = 32, FLOOR = FLOOR_SIDE * FLOOR_SIDE };

static float hard[FLOOR], values[FLOOR];

static ranges_stage set_up(void) {
    static const double BALL_AT[4] = {0.2, 0.8, 0.1, 0.4};
    ranges_stage s = {.seeds = caster_of(truth_seeds(), 0.04, 0.0), .empty = field_of_nothing(0.04)};
    assert_ok(vshi_spheres_create(BALL_AT, 1, NULL, NULL, &s.ball, &failure));
    floor_texels(FLOOR_SIDE, positions, normals);
    return s;
}

/* Spheres are shaded by `hard` and `classic` alone. */
static int32_t methods_of(const ranges_stage *s) {
    return s->kind == FIELD ? SHADOW_METHODS : VSH_SHADOW_CLASSIC + 1;
}

static void tear_down(ranges_stage *s) {
    caster_free(&s->seeds);
    vshi_field_free(s->empty);
    vshi_spheres_free(s->ball);
}

static void cast_on_stage(const ranges_stage *s, const vsh_light *light, int32_t method, double softness,
                          float *to) {
    vshi_layer layer = vshi_layer_default();
    layer.softness = softness;
    layer.spheres = s->kind == BALL ? s->ball : NULL;
    if (s->kind == FIELD) {
        cast_shadows(&s->seeds, light, method, FLOOR, positions, normals, to);
    } else {
        shadows_by(occluders_with(s->empty, &layer, 1), light, method, FLOOR, positions, normals, to);
    }
    for (size_t i = 0; i < FLOOR; ++i) {
        assert_that(to[i] >= 0.0f && to[i] <= 1.0f, "%s: %g", name_of(method), (double)to[i]);
    }
}

static double mean_difference(const float *a, const float *b) {
    double sum = 0.0;
    for (int i = 0; i < FLOOR; ++i) {
        sum += fabs((double)a[i] - (double)b[i]) / FLOOR;
    }
    return sum;
}

/* Tries every type, size, method and kind of caster. Values of large lights only have to stay in range. */
TEST(tiny_lights_are_hard_lights) {
    static const double SIZES[] = {5e-324, 1e-300, 1e-200, 1e-100, 1e-50, 1e-45, 1e-38, 1e-30,
                                   1e-20,  1e-15,  1e-10,  1e-8,   1e-7,  1e-6,  1e-5,  1e-4,
                                   1.0,    3.14,   1e3,    1e10,   1e15,  1e30,  1e99};
    static const double SOFTNESS[] = {0.0, 5e-324, 1e-300, 1e-50, 1e-9, 1000.0}; /* of layers */
    FREED_BY(tear_down) ranges_stage s = set_up();
    size_t accepted = 0;
    for (int32_t type = 0; type <= VSH_LIGHT_RECTANGLE; ++type) {
        for (s.kind = FIELD; s.kind < STAGES; ++s.kind) {
            for (int32_t method = 0; method < methods_of(&s); ++method) {
                const int32_t point_type = type == VSH_LIGHT_RECTANGLE ? VSH_LIGHT_SPHERE : type;
                const vsh_light point = light_of_size(point_type, 0.0);
                cast_on_stage(&s, &point, method, 1.0, hard);
                assert_true(mean_difference(hard, (const float[FLOOR]){0.0f}) < 0.99);
                for (size_t i = 0; i < COUNT_OF(SIZES); ++i) {
                    const vsh_light light = light_of_size(type, SIZES[i]);
                    if (vsh_light_check(&light, NULL) != VSH_OK) {
                        continue;
                    }
                    ++accepted;
                    cast_on_stage(&s, &light, method, 1.0, values);
                    const double off = mean_difference(values, hard);
                    assert_that(SIZES[i] >= 1e-3 || off < 0.002, "type %d, caster %d, %s, size %g: off by %g",
                                type, (int)s.kind, name_of(method), SIZES[i], off);
                }
            }
            const vsh_light light = light_of_size(type, 0.2);
            for (size_t i = 0; i < COUNT_OF(SOFTNESS) && s.kind == BALL; ++i) {
                cast_on_stage(&s, &light, VSH_SHADOW_HARD, 1.0, hard);
                cast_on_stage(&s, &light, VSH_SHADOW_CLASSIC, SOFTNESS[i], values);
                assert_true(SOFTNESS[i] > 1.0 || mean_difference(values, hard) < 0.002);
            }
        }
    }
    assert_true(accepted > 4 * 12 * (size_t)(VSH_SHADOW_CLASSIC + 1) * STAGES);
}

/* Tries every method and kind of caster, and the last double below 180 degrees. */
TEST(suns_just_below_180_degrees_shade_like_179_99_degrees) {
    const double angles[] = {RADIANS(179.9999), RADIANS(179.999999), RADIANS(179.99999999),
                             RADIANS(179.9999999999), nextafter(PI, 0.0)};
    FREED_BY(tear_down) ranges_stage s = set_up();
    for (s.kind = FIELD; s.kind < STAGES; ++s.kind) {
        for (int32_t method = 0; method < methods_of(&s); ++method) {
            vsh_light light = sun(truth_seeds_sun, RADIANS(179.99));
            cast_on_stage(&s, &light, method, 1.0, hard);
            for (size_t a = 0; a < COUNT_OF(angles); ++a) {
                light.angle = angles[a];
                cast_on_stage(&s, &light, method, 1.0, values);
                const double off = mean_difference(values, hard);
                assert_that(off < 0.02, "caster %d, %s, %.17g: off by %g", (int)s.kind, name_of(method),
                            angles[a], off);
            }
        }
    }
}
