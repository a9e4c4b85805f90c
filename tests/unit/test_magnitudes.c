/* The ends of every range: voxels, places, bands, lights, AO distances, angles, normals. What a value is
 * there is either a closed form, or what it is in the middle of the range, or refused by name.
 * docs/numerics.md has the bounds. Ends that other tests have: lights in casters and points in lights
 * (test_shadow.c), bad points (test_shadow_run.c, test_ao.c), reaches (test_field_run.c), ranges of lights
 * (test_light.c). */
#include "shading.h"

#include "field/field.h"
#include "shade/kernel/march.h"
#include "truth/metrics.h"

#include <stdlib.h>

enum { SIDE = 64, COUNT = SIDE * SIDE, SHADOWS = VSH_SHADOW_ADAPTIVE + 1 };

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double NOWHERE[3] = {0.0, 0.0, 0.0};
static double positions[3 * COUNT];
static float normals[3 * COUNT];

static float ao_at(const vsh_field *field, int32_t method, double distance, const double *p,
                   const float *normal) {
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_method = method;
    options.ao_distance = distance;
    const vsh_points points = {1, p, normal, NULL};
    float open = -1.0f;
    assert_int_equal(vsh_shade_ao(field, &points, &options, NULL, &open, NULL, NULL, NULL), VSH_OK);
    return open;
}

static vsh_field *plate(double voxel) {
    const truth_solid solid = {TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0};
    return field_of((truth_scene){&solid, 1}, voxel, 0.0);
}

/* Shadow and AO of the seeds' floor, scaled and then moved. */
static void bake_floor(double scale, const double offset[3], float *visible, float *proved, float *open) {
    static double places[3 * COUNT];
    for (size_t i = 0; i < 3 * COUNT; ++i) {
        places[i] = scale * (positions[i] + offset[i % 3]);
    }
    vsh_field *field = field_of_grid(grid_of_moved(truth_seeds(), 0.04, scale, offset), 8.0 * scale);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const vsh_shade_stats stats = shadows(field, &light, VSH_SHADOW_CONE, COUNT, places, normals, visible);
    assert_int_equal(stats.invalid, 0);
    assert_int_equal(stats.unfinished, 0);
    shadows(field, &light, VSH_SHADOW_ADAPTIVE, COUNT, places, normals, proved);
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_distance = 0.75 * scale;
    const vsh_points points = {COUNT, places, normals, NULL};
    assert_int_equal(vsh_shade_ao(field, &points, &options, NULL, open, NULL, NULL, NULL), VSH_OK);
    vsh_field_free(field);
}

/* Scales that are no powers of two: sums round elsewhere. */
static void voxels_from_1e_12_to_1e12_give_the_same_picture(void **state) {
    (void)state;
    static float visible[2][COUNT], proved[2][COUNT], open[2][COUNT];
    floor_texels(SIDE, positions, normals);
    bake_floor(1.0, NOWHERE, visible[0], proved[0], open[0]);
    const double voxels[] = {1e-12, 1e-9, 1e-6, 1.4e-5, 1.6e-5, 1e-3, 1e3, 1e6, 1e9, 1e12};
    for (size_t v = 0; v < sizeof voxels / sizeof voxels[0]; ++v) {
        bake_floor(voxels[v] / 0.04 * (1.0 + 1e-9 * (v == 0) - 1e-9 * (v == 9)), NOWHERE, visible[1],
                   proved[1], open[1]);
        const truth_metrics s = truth_compare(COUNT, visible[1], visible[0], NULL);
        const truth_metrics r = truth_compare(COUNT, proved[1], proved[0], NULL);
        const truth_metrics a = truth_compare(COUNT, open[1], open[0], NULL);
        print_message("voxel %g: cone rms %.2g, worst %.2g; adaptive rms %.2g; AO rms %.2g, worst %.2g\n",
                      voxels[v], s.rmse, s.max, r.rmse, a.rmse, a.max);
        assert_true(s.rmse < 1e-5 && s.max < 1e-3);
        assert_true(a.rmse < 1e-5 && a.max < 1e-3);
        assert_true(r.rmse < 2e-3);
    }
}

static void voxels_beyond_the_ends_are_refused_by_size(void **state) {
    (void)state;
    const double voxels[] = {0.9e-12, 1e-30, 1.1e12, 1e30};
    for (size_t v = 0; v < sizeof voxels / sizeof voxels[0]; ++v) {
        vsh_sdf_node node = vsh_sdf_node_default();
        node.scale = 20.0 * voxels[v];
        const vsh_sdf sdf = {&node, 1};
        vsh_grid_options options = vsh_grid_options_default();
        options.voxel_size = voxels[v];
        vsh_grid *grid = NULL;
        vsh_error error = {VSH_OK, ""};
        assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &error), VSH_ERROR_LIMIT);
        assert_null(grid);
        assert_non_null(strstr(error.message, "1e-12"));
    }
}

static void far_from_the_origin_the_picture_stays(void **state) {
    (void)state;
    static float visible[2][COUNT], proved[2][COUNT], open[2][COUNT];
    floor_texels(SIDE, positions, normals);
    bake_floor(1.0, NOWHERE, visible[0], proved[0], open[0]);
    const double offsets[][3] = {{1e4, 0.0, 0.0}, {1e7, -1e7, 1e7}, {-1e9, 1e9, 1e9}, {3e10, 0.0, -1e10}};
    for (size_t o = 0; o < 4; ++o) {
        /* of the lattice too, which else lies elsewhere in the scene */
        double whole[3];
        for (int axis = 0; axis < 3; ++axis) {
            whole[axis] = 0.04 * round(offsets[o][axis] / 0.04);
        }
        bake_floor(1.0, whole, visible[1], proved[1], open[1]);
        const truth_metrics s = truth_compare(COUNT, visible[1], visible[0], NULL);
        const truth_metrics r = truth_compare(COUNT, proved[1], proved[0], NULL);
        const truth_metrics a = truth_compare(COUNT, open[1], open[0], NULL);
        print_message("at %g: cone rms %.2g, worst %.2g; adaptive rms %.2g; AO rms %.2g, worst %.2g\n",
                      offsets[o][0], s.rmse, s.max, r.rmse, a.rmse, a.max);
        assert_true(s.rmse < 1e-4 && s.max < 2e-3);
        assert_true(a.rmse < 1e-4 && a.max < 2e-3);
        assert_true(r.rmse < 5e-3);
    }
}

static void half_widths_from_3_to_100_give_the_same_picture(void **state) {
    (void)state;
    static float visible[COUNT], truth[COUNT];
    const double normal[3] = {0.0, 1.0, 0.0};
    floor_texels(SIDE, positions, normals);
    const double half_widths[] = {1.0, 2.0, 2.999, 3.0, 4.0, 6.0, 10.0, 30.0, 100.0, 101.0};
    for (size_t h = 0; h < sizeof half_widths / sizeof half_widths[0]; ++h) {
        vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
        nodes[0].radius = 0.5;
        nodes[0].translation[1] = 0.9;
        nodes[1].shape = VSH_SDF_BOX;
        nodes[1].size[0] = nodes[1].size[2] = 0.3;
        nodes[1].size[1] = 0.5;
        nodes[1].translation[0] = 1.3;
        nodes[1].translation[1] = 0.5;
        nodes[2].shape = VSH_SDF_UNION;
        nodes[2].left = 0;
        nodes[2].right = 1;
        const vsh_sdf sdf = {nodes, 3};
        const truth_solid solids[2] = {{TRUTH_SPHERE, {0.0, 0.9, 0.0}, {0, 0, 0}, 0.5, 0.0},
                                       {TRUTH_BOX, {1.3, 0.5, 0.0}, {0.3, 0.5, 0.3}, 0.0, 0.0}};
        vsh_grid_options options = vsh_grid_options_default();
        options.voxel_size = 0.03;
        options.half_width = half_widths[h];
        vsh_grid *grid = NULL;
        vsh_error error = {VSH_OK, ""};
        const vsh_result result = vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &error);
        if (half_widths[h] < 3.0 || half_widths[h] > 100.0) {
            assert_int_equal(result, VSH_ERROR_ARGUMENT);
            assert_non_null(strstr(error.message, "half_width"));
            continue;
        }
        assert_int_equal(result, VSH_OK);
        vsh_field *field = field_of_grid(grid, 0.0);
        assert_int_equal(truth_lights((truth_scene){solids, 2}, COUNT, positions, normal, truth_seeds_sun,
                                      truth_seeds_w, (double)INFINITY, 256, truth),
                         0);
        const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
        shadows(field, &light, VSH_SHADOW_CONE, COUNT, positions, normals, visible);
        const truth_metrics m = truth_compare(COUNT, visible, truth, NULL);
        print_message("half width %g: rmse %.4f\n", half_widths[h], m.rmse);
        assert_true(m.rmse < 0.032);
        vsh_field_free(field);
    }
}

/* A ball over the receiver, out of the axis: truth by 4096 rays; cones of one edge are right to what a round
 * edge differs from a straight one. */
static void lights_of_0_to_179_degrees_stay_in_range_and_near_the_truth(void **state) {
    (void)state;
    const truth_solid ball = {TRUTH_SPHERE, {0.0, 2.0, 0.0}, {0.0, 0.0, 0.0}, 0.7, 0.0};
    const truth_scene scene = {&ball, 1};
    vsh_field *field = field_of(scene, 0.04, 0.0), *open = plate(0.06);
    const double up[3] = {0.0, 1.0, 0.0},
                 angles[] = {0.0, 1e-6, 1e-3, 0.5, 5, 20, 60, 90, 120, 150, 170, 179};
    for (size_t a = 0; a < sizeof angles / sizeof angles[0]; ++a) {
        const double w = tan(RADIANS(0.5 * angles[a]));
        const vsh_light light = sun(up, RADIANS(angles[a]));
        double worst[SHADOWS] = {0.0};
        for (int i = 0; i < 24; ++i) {
            const double p[3] = {0.13 * i, 0.0, 0.01 * i};
            const double truth = truth_light(scene, p, NULL, up, w, (double)INFINITY, 4096);
            for (int32_t method = 0; method < SHADOWS; ++method) {
                const float v = shadow_at(field, &light, method, p, NULL);
                assert_true(v >= 0.0f && v <= 1.0f);
                worst[method] = fmax(worst[method], fabs((double)v - truth));
            }
            /* the open plate sees all of a light that is over its horizon */
            const double q[3] = {0.1 * i - 1.2, 0.0, 0.03 * i};
            for (int32_t method = 0; method < SHADOWS; ++method) {
                const float v = shadow_at(open, &light, method, q, UP);
                if (v != 1.0f) {
                    fail_msg("%g degrees over an open plate, %s: %.9g", angles[a],
                             vsh_shadow_method_name(method), (double)v);
                }
            }
        }
        print_message("%g degrees past a ball: cone off by %.3f, rays %.3f, adaptive %.3f\n", angles[a],
                      worst[VSH_SHADOW_CONE], worst[VSH_SHADOW_RAYS], worst[VSH_SHADOW_ADAPTIVE]);
        /* a ball smaller than the light is no straight edge */
        assert_true(worst[VSH_SHADOW_CONE] < (angles[a] <= 20.0 ? 0.06 : 0.6));
        assert_true(worst[VSH_SHADOW_RAYS] < 0.05 && worst[VSH_SHADOW_ADAPTIVE] < 0.06);
    }
    vsh_field_free(field);
    vsh_field_free(open);
}

/* A lamp over a plate, with nothing between them, and one under it; radii and distances of 1e-6 … 1e6. */
static void lamps_of_1e_6_to_1e6_units_are_seen_from_above_and_not_through_the_plate(void **state) {
    (void)state;
    vsh_field *field = plate(0.06);
    for (double away = 1e-6; away < 2e6; away *= 10.0) {
        for (double radius = 1e-6; radius < 2e6; radius *= 10.0) {
            const double p[3] = {0.31, 0.0, -0.17}, over[3] = {0.31, away, -0.17};
            const double under[3] = {0.31, -1.0 - away - radius, -0.17};
            for (int32_t method = 0; method < SHADOWS; ++method) {
                vsh_light light = lamp(over, radius);
                const float lit = shadow_at(field, &light, method, p, UP);
                light = lamp(under, radius);
                const float turned = shadow_at(field, &light, method, p, UP);
                const float bare = shadow_at(field, &light, method, p, NULL);
                /* nearer than the start offset it is below where the receiver's rays begin */
                const bool near = away <= 0.25 * 0.06;
                if (!(near ? lit >= 0.0f && lit <= 1.0f : lit == 1.0f) || turned != 0.0f ||
                    !(bare >= 0.0f && bare <= 1.0f)) {
                    fail_msg("%g away, radius %g, %s: %.9g, %.9g, %.9g", away, radius,
                             vsh_shadow_method_name(method), (double)lit, (double)turned, (double)bare);
                }
            }
        }
    }
    vsh_field_free(field);
}

static void lamps_on_a_surface_light_its_own_side(void **state) {
    (void)state;
    const double voxel = 0.05;
    vsh_field *field = plate(voxel);
    uint64_t counter = 6;
    for (int i = 0; i < 300; ++i) {
        const double p[3] = {between(&counter, -2.5, 2.5), i % 2 ? 0.4 : -1.4, between(&counter, -2.5, 2.5)};
        const double x = between(&counter, -2.5, 2.5), z = between(&counter, -2.5, 2.5);
        const double at[3] = {x, 0.0, z}, off[3] = {x, voxel, z}, in[3] = {x, -voxel, z};
        for (int32_t method = 0; method < SHADOWS; ++method) {
            for (int size = 0; size < 2; ++size) {
                const vsh_light on = lamp(at, size * 0.1), above = lamp(off, 0.0), below = lamp(in, 0.0);
                const float v = shadow_at(field, &on, method, p, NULL);
                assert_true(v >= 0.0f && v <= 1.0f); /* to a voxel it is on either side */
                assert_true(shadow_at(field, &above, method, p, NULL) == (i % 2 ? 1.0f : 0.0f));
                assert_true(shadow_at(field, &below, method, p, NULL) == 0.0f);
            }
        }
    }
    vsh_field_free(field);
}

static void ao_distances_below_a_voxel_and_above_the_scene_are_what_they_say(void **state) {
    (void)state;
    const truth_solid solids[2] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {2.0, 0.5, 2.0}, 0.0, 0.0},
                                   {TRUTH_BOX, {-1.5, 1.0, 0.0}, {0.5, 1.0, 2.0}, 0.0, 0.0}};
    vsh_field *field = field_of((truth_scene){solids, 2}, 0.04, 0.0);
    const double distances[] = {1e-300, 1e-12, 1e-3, 0.01, 0.04, 4.0, 40.0, 1e6, 1e12, 1e300};
    float all[2] = {0.0f, 0.0f};
    for (int32_t method = VSH_AO_TAPS; method <= VSH_AO_CONES; ++method) {
        for (size_t d = 0; d < sizeof distances / sizeof distances[0]; ++d) {
            float least = 1.0f, most = 0.0f;
            for (int i = 0; i < 24; ++i) {
                const double p[3] = {-0.9 + 0.1 * i, 0.0, 0.11};
                const float v = ao_at(field, method, distances[d], p, UP);
                assert_true(v >= 0.0f && v <= 1.0f);
                least = fminf(least, v);
                most = fmaxf(most, v);
            }
            print_message("%s within %g: %.4f … %.4f\n", vsh_ao_method_name(method), distances[d],
                          (double)least, (double)most);
            if (distances[d] < 0.05) {
                assert_true(least == 1.0f); /* the wall is farther than that */
            }
            if (method == VSH_AO_CONES && distances[d] > 3.0) {
                /* all that there is */
                all[0] = distances[d] == 4.0 ? least : all[0];
                all[1] = distances[d] == 4.0 ? most : all[1];
                assert_true(least == all[0] && most == all[1]);
            }
        }
    }
    vsh_field_free(field);
}

/* Down to a millionth of a radian over the horizon: what the whole light is above of is lit, whichever way
 * the plate lies on the lattice. */
static void grazing_light_reaches_an_open_plate(void **state) {
    (void)state;
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
        vsh_field *field = field_of_grid(grid, 0.0);
        const double c = cos(2.0 * half), s = sin(2.0 * half);
        double dark = 0.0, least = 1.0;
        size_t count = 0, steps = 0;
        uint64_t counter = 5;
        for (double sine = 1e-6; sine < 0.2; sine *= 3.0) {
            for (int i = 0; i < 60; ++i) {
                double d[3], q[3] = {between(&counter, -1.9, 1.9), 0.5, between(&counter, -1.9, 1.9)};
                direction_at(asin(sine), between(&counter, 0.0, 2.0 * PI), d);
                float n[3] = {0.0f, 1.0f, 0.0f};
                if (turn == 1) { /* about y: nothing of the plate's top changes but its edges */
                    const double x = d[0];
                    d[0] = c * x + s * d[2];
                    d[2] = c * d[2] - s * x;
                    const double px = q[0];
                    q[0] = c * px + s * q[2];
                    q[2] = c * q[2] - s * px;
                } else if (turn == 2) { /* about z */
                    const double x = d[0], px = q[0];
                    d[0] = c * x - s * d[1];
                    d[1] = s * x + c * d[1];
                    q[0] = c * px - s * q[1];
                    q[1] = s * px + c * q[1];
                    n[0] = (float)-s;
                    n[1] = (float)c;
                }
                for (int32_t method = 0; method < SHADOWS; ++method) {
                    const vsh_light light = sun(d, method == VSH_SHADOW_HARD ? 0.0 : sine);
                    float v = -1.0f;
                    const vsh_shade_stats stats = shadows(field, &light, method, 1, q, n, &v);
                    assert_int_equal(stats.unfinished, 0);
                    steps = stats.samples > steps ? stats.samples : steps;
                    assert_true(v >= 0.0f && v <= 1.0f);
                    dark += v < 1.0f;
                    least = fmin(least, (double)v);
                    ++count;
                }
            }
        }
        print_message("turn %d: %g of %zu grazing values below 1, least %.4f, %zu steps at most\n", turn,
                      dark, count, least, steps);
        assert_true(dark == 0.0);
        vsh_field_free(field);
    }
}

static void receivers_deep_inside_are_dark_and_far_outside_are_lit(void **state) {
    (void)state;
    const truth_solid block = {TRUTH_BOX, {0.0, 0.0, 0.0}, {2.0, 2.0, 2.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&block, 1}, 0.05, 0.0);
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
        for (int32_t method = 0; method < SHADOWS; ++method) {
            const vsh_light light = sun(d, i % 2 ? 0.0 : 0.05), from = sun(out, 0.05);
            const float v = shadow_at(field, &light, method, p, NULL);
            if (v != 0.0f) {
                fail_msg("inside at (%g, %g, %g), %s: %.9g", p[0], p[1], p[2], vsh_shadow_method_name(method),
                         (double)v);
            }
            assert_true(shadow_at(field, &from, method, q, NULL) == 1.0f);
        }
        const float n[3] = {(float)d[0], (float)d[1], (float)d[2]};
        assert_true(ao_at(field, VSH_AO_CONES, 1.0, p, n) == 0.0f);
        assert_true(ao_at(field, VSH_AO_CONES, 1.0, q, n) == 1.0f);
    }
    vsh_field_free(field);
}

/* Exactly on the planes, edges and corners of cells, bricks and levels, and beside them by less than a float
 * tells: the same to what a float tells. */
static void receivers_on_voxel_planes_see_what_their_neighbours_see(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.0625, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    uint64_t counter = 8;
    double worst = 0.0, worst_ao = 0.0;
    for (int i = 0; i < 4000; ++i) {
        double p[3];
        for (int axis = 0; axis < 3; ++axis) {
            const double step = 0.0625 * (double)(1 << (i % 6));
            p[axis] = axis != 1 && i % 7 == axis ? between(&counter, -2.4, 2.4)
                                                 : step * round(between(&counter, -2.4, 2.4) / step);
        }
        p[1] = fabs(p[1]) + (i % 3 == 0 ? 0.0 : 0.0625);
        const float v = shadow_at(field, &light, VSH_SHADOW_CONE, p, UP);
        const float a = ao_at(field, VSH_AO_CONES, 0.5, p, UP);
        assert_true(v >= 0.0f && v <= 1.0f);
        for (int side = 0; side < 6; ++side) {
            double q[3] = {p[0], p[1], p[2]};
            q[side / 2] += side % 2 ? 1e-9 : -1e-9;
            worst = fmax(worst, fabs((double)(shadow_at(field, &light, VSH_SHADOW_CONE, q, UP) - v)));
            worst_ao = fmax(worst_ao, fabs((double)(ao_at(field, VSH_AO_CONES, 0.5, q, UP) - a)));
        }
    }
    print_message("beside lattice planes: shadow %.3g, AO %.3g apart at most\n", worst, worst_ao);
    assert_true(worst < 1e-4 && worst_ao < 1e-4);
    vsh_field_free(field);
}

static void normals_of_any_length_are_directions(void **state) {
    (void)state;
    vsh_field *field = field_of(truth_seeds(), 0.0625, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    const int exponents[] = {-149, -126, -60, -1, 1, 60, 127};
    for (int i = 0; i < 60; ++i) {
        const double p[3] = {-2.4 + 0.08 * i, 0.0, 0.3};
        const float shadow = shadow_at(field, &light, VSH_SHADOW_CONE, p, UP);
        const float open = ao_at(field, VSH_AO_CONES, 0.5, p, UP);
        for (size_t e = 0; e < sizeof exponents / sizeof exponents[0]; ++e) {
            const float n[3] = {0.0f, ldexpf(1.0f, exponents[e]), 0.0f};
            assert_int_equal(bits_of(shadow_at(field, &light, VSH_SHADOW_CONE, p, n)), bits_of(shadow));
            assert_int_equal(bits_of(ao_at(field, VSH_AO_CONES, 0.5, p, n)), bits_of(open));
        }
    }
    /* places that a double holds but field space does not */
    vsh_field *tiny = field_of_grid(grid_of_moved(truth_seeds(), 0.0625, 1e-9, NOWHERE), 8e-9);
    const double beyond[3] = {1e305, 0.0, 0.0};
    float v = 0.0f;
    const vsh_shade_stats stats = shadows(tiny, &light, VSH_SHADOW_CONE, 1, beyond, UP, &v);
    assert_true(isnan(v));
    assert_int_equal(stats.invalid, 1);
    vsh_field_free(tiny);
    vsh_field_free(field);
}

/* A bar of 30 000 voxels, and a ray along it so near to its face that each step is the least one, a quarter
 * of a voxel: the distance along the ray is what is sampled at, so nothing adds up. */
static void a_hundred_thousand_least_steps_lose_nothing(void **state) {
    (void)state;
    const double length = 30000.0;
    const truth_solid bar = {TRUTH_BOX, {0.0, -4.0, 0.0}, {0.5 * length, 4.0, 4.0}, 0.0, 0.0};
    vsh_field *field = field_of((truth_scene){&bar, 1}, 1.0, 8.0);
    const double heights[] = {0.01, 0.1, 0.24};
    for (int i = 0; i < 3; ++i) {
        /* the kernel itself: its callers allow 65536 steps */
        const double start[3] = {-0.5 * length + 100.0, heights[i], 0.3};
        const vshi_vec o = vshi_to_field(field, start);
        float lane[11] = {(float)o.x, (float)o.y, (float)o.z, 1.0f,
                          0.0f,       0.0f,       0.0625f,    (float)(length - 200.0),
                          0.0f,       0.0f,       1.0f};
        const vshi_rays rays = {.count = 1,
                                .origin = {&lane[0], &lane[1], &lane[2]},
                                .direction = {&lane[3], &lane[4], &lane[5]},
                                .begin = &lane[6],
                                .end = &lane[7],
                                .sine = &lane[8],
                                .stop = &lane[9],
                                .close = &lane[10]};
        vshi_march_stats stats = {0, 0};
        vshi_kernel_best()->march(field, &rays, VSHI_MARCH_PLAIN, 1 << 20, &stats);
        const double expected = heights[i] / (length - 200.0);
        print_message("height %g: %llu samples, closeness off by %.2g of it\n", heights[i],
                      (unsigned long long)stats.samples, fabs((double)lane[10] / expected - 1.0));
        assert_true(stats.samples > 100000);
        assert_int_equal(stats.unfinished, 0);
        assert_true(fabs((double)lane[10] / expected - 1.0) < 1e-3);
    }
    /* and through the front door, out of steps: lit as far as is known, and counted */
    const double p[3] = {-0.5 * length + 100.0, 0.1, 0.3}, along[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(along, 0.0);
    vsh_shade_options options = vsh_shade_options_default();
    options.method = VSH_SHADOW_HARD;
    options.max_steps = 65536;
    const vsh_points points = {1, p, NULL, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    float v = -1.0f;
    assert_int_equal(vsh_shade_shadow(field, &points, &light, &options, NULL, &v, NULL, &stats, NULL),
                     VSH_OK);
    assert_true(v == 1.0f);
    assert_int_equal(stats.unfinished, 1);
    assert_int_equal(stats.samples, 65536);
    vsh_field_free(field);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(voxels_from_1e_12_to_1e12_give_the_same_picture),
        cmocka_unit_test(voxels_beyond_the_ends_are_refused_by_size),
        cmocka_unit_test(far_from_the_origin_the_picture_stays),
        cmocka_unit_test(half_widths_from_3_to_100_give_the_same_picture),
        cmocka_unit_test(lights_of_0_to_179_degrees_stay_in_range_and_near_the_truth),
        cmocka_unit_test(lamps_of_1e_6_to_1e6_units_are_seen_from_above_and_not_through_the_plate),
        cmocka_unit_test(lamps_on_a_surface_light_its_own_side),
        cmocka_unit_test(ao_distances_below_a_voxel_and_above_the_scene_are_what_they_say),
        cmocka_unit_test(grazing_light_reaches_an_open_plate),
        cmocka_unit_test(receivers_deep_inside_are_dark_and_far_outside_are_lit),
        cmocka_unit_test(receivers_on_voxel_planes_see_what_their_neighbours_see),
        cmocka_unit_test(normals_of_any_length_are_directions),
        cmocka_unit_test(a_hundred_thousand_least_steps_lose_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
