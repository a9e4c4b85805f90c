/* The ends of what a light can be: angles of suns, radii and distances of lamps, lamps in casters, on their
 * surfaces and at receivers, light that grazes. Of every method; docs/accuracy.md has the bounds,
 * test_light.c what is refused. */
#include "field/field.h"
#include "methods.h"
#include "terrain.h"
#include "testing.h"

static const float UP[3] = {0.0f, 1.0f, 0.0f};

static casting plate(double voxel) {
    const truth_solid solid = {TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0};
    return caster_of((truth_scene){&solid, 1}, voxel, 0.0);
}

/* A ball over the receiver, out of the axis: truth by 4096 rays; cones of one edge are right to what a round
 * edge differs from a straight one. */
TEST(lights_of_0_to_179_degrees_stay_in_range_and_near_the_truth) {
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 2.0, 0.0}, {0.0, 0.0, 0.0}, 0.7, 0.0};
    const truth_scene scene = {&ball, 1};
    FREED_BY(caster_free) casting c = caster_of(scene, 0.04, 0.0), open = plate(0.06);
    const double up[3] = {0.0, 1.0, 0.0},
                 angles[] = {0.0, 1e-6, 1e-3, 0.5, 5, 20, 60, 90, 120, 150, 170, 179};
    for (size_t a = 0; a < sizeof angles / sizeof angles[0]; ++a) {
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
    for (size_t d = 0; d < sizeof parts / sizeof parts[0]; ++d) {
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
    enum { SIDE = 64, COUNT = SIDE * SIDE };
    static double positions[3 * COUNT];
    static float normals[3 * COUNT], exact[COUNT], ray[COUNT];
    floor_texels(SIDE, positions, normals);
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const double place[3] = {0.4, 2.5, 0.3};
    const vsh_light lights[2] = {sun(truth_seeds_sun, 0.0), lamp(place, 0.0)};
    for (int l = 0; l < 2; ++l) {
        cast_shadows(&c, &lights[l], VSH_SHADOW_EXACT, COUNT, positions, normals, exact);
        assert_int_equal(vsh_trace_shadow(c.triangles, NULL, COUNT, positions, normals, 1e-5, &lights[l], 1,
                                          NULL, ray, NULL),
                         VSH_OK);
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

static void turn_about(int axis, double angle, double v[3]) {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    const double a = v[i], b = v[j];
    v[i] = cos(angle) * a - sin(angle) * b;
    v[j] = sin(angle) * a + cos(angle) * b;
}

/* The plate of grazing_light_reaches_an_open_plate() as triangles. */
static vsh_triangles *triangles_of_turned(const vsh_sdf_node *node, int axis, double angle) {
    float corners[24];
    const double low[3] = {-node->size[0], -node->size[1], -node->size[2]};
    vsh_mesh mesh = box_mesh(corners, low, node->size);
    double transform[12] = {0};
    for (int column = 0; column < 3; ++column) {
        double v[3] = {column == 0, column == 1, column == 2};
        turn_about(axis, angle, v);
        for (int row = 0; row < 3; ++row) {
            transform[4 * row + column] = v[row];
        }
    }
    mesh.transform = transform;
    vsh_triangles *triangles = NULL;
    assert_int_equal(vsh_triangles_create(&mesh, 1, NULL, &triangles, NULL), VSH_OK);
    return triangles;
}

/* Down to a millionth of a radian over the horizon: what the whole light is above of is lit, whichever way
 * the plate lies on the lattice. */
TEST(grazing_light_reaches_an_open_plate) {
    for (int turn = 0; turn < 3; ++turn) {
        const double half = RADIANS(0.5 * (turn == 0 ? 0.0 : turn == 1 ? 31.0 : 10.0));
        vsh_sdf_node node = vsh_sdf_node_default();
        node.shape = VSH_SDF_BOX;
        node.size[0] = node.size[2] = 2.0;
        node.size[1] = 0.5;
        node.rotation[turn] = sin(half);
        node.rotation[3] = cos(half);
        const vsh_sdf sdf = {&node, 1};
        vsh_grid_options options = vsh_grid_options_default();
        options.voxel_size = 0.04;
        vsh_grid *grid = NULL;
        assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, NULL), VSH_OK);
        FREED_BY(caster_free)
        casting c = {field_of_grid(grid, 0.0), triangles_of_turned(&node, turn, 2.0 * half)};
        double dark = 0.0, least = 1.0;
        size_t count = 0, steps = 0;
        uint64_t counter = 5;
        for (double sine = 1e-6; sine < 0.2; sine *= 3.0) {
            for (int i = 0; i < 60; ++i) {
                double d[3], q[3] = {between(&counter, -1.9, 1.9), 0.5, between(&counter, -1.9, 1.9)};
                direction_at(asin(sine), between(&counter, 0.0, 2.0 * PI), d);
                turn_about(turn, 2.0 * half, d);
                turn_about(turn, 2.0 * half, q);
                double up[3] = {0.0, 1.0, 0.0};
                turn_about(turn, 2.0 * half, up);
                const float n[3] = {(float)up[0], (float)up[1], (float)up[2]};
                for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                    const vsh_light light = sun(d, method == VSH_SHADOW_HARD ? 0.0 : sine);
                    float v = -1.0f;
                    const vsh_shade_stats stats = cast_shadows(&c, &light, method, 1, q, n, &v);
                    assert_int_equal(stats.unfinished, 0);
                    steps = stats.samples > steps ? stats.samples : steps;
                    assert_true(v >= 0.0f && v <= 1.0f);
                    dark += v < 1.0f;
                    least = fmin(least, (double)v);
                    ++count;
                }
            }
        }
        assert_true(dark == 0.0);
    }
}

/* A light of a type over the seeds' floor: `size` is an angle, a radius or the sides of a square. */
static vsh_light light_of_size(int32_t type, double size) {
    static const double ABOVE[3] = {1.0, 3.0, 1.0};
    vsh_light light = type == VSH_LIGHT_DIRECTIONAL ? sun(truth_seeds_sun, size) : lamp(ABOVE, size);
    light.type = type;
    light.axis[1] = -1.0;
    light.inner_angle = 1.0;
    light.outer_angle = 1.2;
    light.edge_u[0] = light.edge_v[2] = size;
    return light;
}

/* The casters: the seeds as voxels and triangles; a ball as a layer without voxels. */
typedef struct ranges_stage {
    enum { FIELD, BALL, STAGES } kind;
    casting seeds;
    vsh_field *empty;
    vsh_spheres *ball;
} ranges_stage;

enum { FLOOR_SIDE = 32, FLOOR = FLOOR_SIDE * FLOOR_SIDE };

static double positions[3 * FLOOR];
static float normals[3 * FLOOR], hard[FLOOR], values[FLOOR];

static ranges_stage set_up(void) {
    static const double BALL_AT[4] = {0.2, 0.8, 0.1, 0.4};
    ranges_stage s = {.seeds = caster_of(truth_seeds(), 0.04, 0.0)};
    assert_int_equal(vshi_field_create_empty(0.04, &s.empty, NULL), VSH_OK);
    assert_int_equal(vsh_spheres_create(BALL_AT, 1, NULL, NULL, &s.ball, NULL), VSH_OK);
    floor_texels(FLOOR_SIDE, positions, normals);
    return s;
}

/* Spheres are shaded by `hard` and `classic` alone. */
static int32_t methods_of(const ranges_stage *s) {
    return s->kind == FIELD ? SHADOW_METHODS : VSH_SHADOW_CLASSIC + 1;
}

static void tear_down(ranges_stage *s) {
    caster_free(&s->seeds);
    vsh_field_free(s->empty);
    vsh_spheres_free(s->ball);
}

static void cast_on_stage(const ranges_stage *s, const vsh_light *light, int32_t method, double softness,
                          float *to) {
    vsh_layer layer = vsh_layer_default();
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
                for (size_t i = 0; i < sizeof SIZES / sizeof SIZES[0]; ++i) {
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
            for (size_t i = 0; i < sizeof SOFTNESS / sizeof SOFTNESS[0] && s.kind == BALL; ++i) {
                cast_on_stage(&s, &light, VSH_SHADOW_HARD, 1.0, hard);
                cast_on_stage(&s, &light, VSH_SHADOW_CLASSIC, SOFTNESS[i], values);
                assert_true(SOFTNESS[i] > 1.0 || mean_difference(values, hard) < 0.002);
            }
        }
    }
    assert_true(accepted > 4 * 12 * (size_t)(VSH_SHADOW_CLASSIC + 1) * STAGES);
}

/* Tries every method and kind of caster, and the last double below 180 degrees. */
TEST(suns_just_below_180_degrees_are_as_those_of_179_99) {
    const double angles[] = {RADIANS(179.9999), RADIANS(179.999999), RADIANS(179.99999999),
                             RADIANS(179.9999999999), nextafter(PI, 0.0)};
    FREED_BY(tear_down) ranges_stage s = set_up();
    for (s.kind = FIELD; s.kind < STAGES; ++s.kind) {
        for (int32_t method = 0; method < methods_of(&s); ++method) {
            vsh_light light = sun(truth_seeds_sun, RADIANS(179.99));
            cast_on_stage(&s, &light, method, 1.0, hard);
            for (size_t a = 0; a < sizeof angles / sizeof angles[0]; ++a) {
                light.angle = angles[a];
                cast_on_stage(&s, &light, method, 1.0, values);
                const double off = mean_difference(values, hard);
                assert_that(off < 0.02, "caster %d, %s, %.17g: off by %g", (int)s.kind, name_of(method),
                            angles[a], off);
            }
        }
    }
}
