/* The ends of every range that a scene has: voxels, places, bands, AO distances, steps. What a value is there
 * is either a closed form, or what it is in the middle of the range, or refused by name. docs/accuracy.md has
 * the bounds; test_light_ranges.c has lights, test_receivers.c points and normals, test_field_run.c reaches.
 */
#include "methods.h"
#include "testing.h"

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

/* Values that few rays make: they may change by a whole ray where an edge moves by a rounding. */
static bool by_rays(int kind) {
    return is_ao(kind) ? kind >= SHADOWS + VSH_AO_RAYS : kind >= VSH_SHADOW_RAYS;
}

/* Shadow and AO of the seeds' floor, scaled and then moved. */
static void bake_floor(double scale, const double offset[3], picture *p) {
    static double places[3 * COUNT];
    for (size_t i = 0; i < 3 * COUNT; ++i) {
        places[i] = scale * (positions[i] + offset[i % 3]);
    }
    FREED_BY(caster_free) casting c = caster_of_moved(truth_seeds(), 0.04, scale, offset, 8.0 * scale);
    const vsh_light light = sun(truth_seeds_sun, 0.2);
    for (int kind = 0; kind < KINDS; ++kind) {
        const vsh_shade_stats stats =
            cast_kind(&c, kind, &light, 0.75 * scale, COUNT, places, normals, p->v[kind]);
        assert_int_equal(stats.invalid, 0);
        assert_int_equal(stats.unfinished, 0);
    }
}

/* Estimators differ by less than `rms` and `worst`, rays by `rays` rms. Values of `hard` are
 * 0 or 1, so a texel on an edge may change by 1: one of 4096 gives an rms of 0.0156, and one ray of 64 gives
 * 2.4e-4. */
static void assert_alike(const picture *a, const picture *b, double rms, double worst, double rays) {
    for (int kind = 0; kind < KINDS; ++kind) {
        const truth_metrics m = truth_compare(COUNT, a->v[kind], b->v[kind], NULL);
        assert_true(m.rmse < (kind == VSH_SHADOW_HARD ? 0.016 : by_rays(kind) ? rays : rms));
        assert_true(kind == VSH_SHADOW_HARD || by_rays(kind) || m.max < worst);
    }
}

/* Scales that are no powers of two: sums round elsewhere. */
TEST(voxels_from_1e_12_to_1e12_give_the_same_picture) {
    static picture middle, there;
    floor_texels(SIDE, positions, normals);
    bake_floor(1.0, NOWHERE, &middle);
    const double voxels[] = {1e-12, 1e-9, 1e-6, 1.4e-5, 1.6e-5, 1e-3, 1e3, 1e6, 1e9, 1e12};
    for (size_t v = 0; v < sizeof voxels / sizeof voxels[0]; ++v) {
        bake_floor(voxels[v] / 0.04 * (1.0 + 1e-9 * (v == 0) - 1e-9 * (v == 9)), NOWHERE, &there);
        assert_alike(&there, &middle, 1e-5, 1e-3, 2e-3);
    }
}

TEST(voxels_beyond_the_ends_are_refused_by_size) {
    const double voxels[] = {0.9e-12, 1e-30, 1.1e12, 1e30};
    for (size_t v = 0; v < sizeof voxels / sizeof voxels[0]; ++v) {
        vsh_sdf_node node = vsh_sdf_node_default();
        node.scale = 20.0 * voxels[v];
        const vsh_sdf sdf = {&node, 1};
        vsh_grid_options options = vsh_grid_options_default();
        options.voxel_size = voxels[v];
        vsh_grid *grid = NULL;
        assert_fails(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure), VSH_ERROR_LIMIT, "1e-12");
        assert_null(grid);
    }
}

TEST(far_from_the_origin_the_picture_stays) {
    static picture middle, there;
    floor_texels(SIDE, positions, normals);
    bake_floor(1.0, NOWHERE, &middle);
    const double offsets[][3] = {{1e4, 0.0, 0.0}, {1e7, -1e7, 1e7}, {-1e9, 1e9, 1e9}, {3e10, 0.0, -1e10}};
    for (size_t o = 0; o < 4; ++o) {
        /* of the lattice too, which else lies elsewhere in the scene */
        double whole[3];
        for (int axis = 0; axis < 3; ++axis) {
            whole[axis] = 0.04 * round(offsets[o][axis] / 0.04);
        }
        bake_floor(1.0, whole, &there);
        assert_alike(&there, &middle, 1e-4, 2e-3, 5e-3);
    }
}

/* A ball and a box beside it; NULL where the half width is refused. */
static vsh_field *field_of_half_width(double half_width) {
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
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.03;
    options.half_width = half_width;
    vsh_grid *grid = NULL;
    if (half_width < 3.0 || half_width > 100.0) {
        assert_fails(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure), VSH_ERROR_ARGUMENT,
                     "half_width");
        return NULL;
    }
    assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure));
    return field_of_grid(grid, 0.0);
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
    for (size_t h = 0; h < sizeof half_widths / sizeof half_widths[0]; ++h) {
        c.field = field_of_half_width(half_widths[h]);
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
        vsh_field_free(c.field);
    }
    vsh_triangles_free(c.triangles);
}

TEST(ao_distances_below_a_voxel_and_above_the_scene_are_what_they_say) {
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
        const double p[3] = {-0.9 + 0.1 * i, 0.0, 0.11}, up[3] = {0.0, 1.0, 0.0};
        const double lifted[3] = {p[0], 1e-6, p[2]};
        memcpy(at + 3 * i, p, sizeof p);
        memcpy(ns + 3 * i, UP, sizeof UP);
        truth[i] = truth_ao(scene, lifted, up, 100.0, 4096);
    }
    for (int32_t method = 0; method < AO_METHODS; ++method) {
        for (size_t d = 0; d < sizeof distances / sizeof distances[0]; ++d) {
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
            /* 3 of the standard errors that were asked for; cones see a wall as its edges are smoothed */
            assert_true(distances[d] < 1.0 || method == VSH_AO_TAPS ||
                        worst < (method == VSH_AO_CONES ? 0.08 : 0.06));
        }
    }
}

/* A bar of 30 000 voxels, and a ray along it so near to its face that each step is the least one, a quarter
 * of a voxel: the distance along the ray is what is sampled at, so nothing adds up. */
TEST(a_hundred_thousand_least_steps_lose_nothing) {
    const double length = 30000.0;
    const truth_solid bar = {TRUTH_BOX, {0.0, -4.0, 0.0}, {0.5 * length, 4.0, 4.0}, 0.0, 0.0};
    OWNED(vsh_field) *field = field_of((truth_scene){&bar, 1}, 1.0, 8.0);
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
        vshi_kernel_of(VSH_ISA_BEST)->march(field, &rays, VSHI_MARCH_PLAIN, 1 << 20, &stats);
        const double expected = heights[i] / (length - 200.0);
        assert_true(stats.samples > 100000);
        assert_int_equal(stats.unfinished, 0);
        assert_true(fabs((double)lane[10] / expected - 1.0) < 1e-3);
    }
    /* and through the front door, out of steps: lit as far as is known, and counted */
    const double p[3] = {-0.5 * length + 100.0, 0.1, 0.3}, along[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(along, 0.0);
    vsh_shade_options options = preview_options();
    options.method = VSH_SHADOW_HARD;
    options.max_steps = 65536;
    const vsh_points points = {1, p, NULL, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    float v = -1.0f;
    assert_int_equal(
        vsh_shade_shadow(occluders_of(field), &points, &light, &options, NULL, &v, NULL, &stats, NULL),
        VSH_OK);
    assert_true(v == 1.0f);
    assert_int_equal(stats.unfinished, 1);
    assert_int_equal(stats.samples, 65536);
}
