/* Rays against triangles and against procedural solids: closed forms, moved and far scenes, bad input.
 * test_relations.c scales scenes. */
#include "rays.h"
#include "shading.h"
#include "testing.h"
#include "texels_of.h"

#include "trace/trace.h"
#include "truth/directions.h"

#include <pthread.h>

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double ORIGIN[3] = {0.0, 0.0, 0.0}, OVERHEAD[3] = {0.0, 1.0, 0.0};

/* Triangles, solids or both: NULL where there are none. */
typedef struct casters {
    vshi_triangles *triangles;
    vshi_solids *solids;
} casters;

static void free_casters(casters *c) {
    vshi_triangles_free(c->triangles);
    vshi_solids_free(c->solids);
}

static casters casters_of_mesh(const vsh_mesh *meshes, size_t count) {
    return (casters){triangles_from(meshes, count), NULL};
}

/* Solids of one tree under a transform (NULL: none). */
static casters casters_of_tree(const vsh_sdf_node *nodes, size_t count, const double *transform) {
    const vsh_sdf sdf = {nodes, count};
    casters c = {NULL, NULL};
    assert_ok(
        vshi_solids_create(&sdf, transform != NULL ? transform : vshi_identity, 1, &c.solids, &failure));
    return c;
}

/* A point that sees a light; without a normal, it faces the light. */
static double seen(casters c, const double *position, const float *normal, const vsh_light *light,
                   int32_t rays) {
    float value = -1.0f, up[3];
    if (normal == NULL) {
        vshi_vec to;
        const vshi_light_place place = vshi_light_in_world(light);
        vshi_light_towards(&place, vshi_vec_of(position), &to);
        memcpy(up, (const float[]){(float)to.x, (float)to.y, (float)to.z}, sizeof up);
        normal = up;
    }
    see_light(c.triangles, c.solids, 1, position, normal, 0.0, light, rays, &value);
    return (double)value;
}

static double open_at(casters c, const double *position, double distance, int32_t rays) {
    float value = -1.0f;
    see_sky(c.triangles, c.solids, 1, position, UP, 0.0, distance, rays, &value);
    return (double)value;
}

/* A plate of x from `edge` to 1000, `height` above the origin. */
static casters plate(float edge, float height) {
    const float positions[12] = {edge,    height, -1000.0f, 1000.0f, height, -1000.0f,
                                 1000.0f, height, 1000.0f,  edge,    height, 1000.0f};
    const vsh_mesh mesh = quad_mesh("plate", positions, NULL);
    return casters_of_mesh(&mesh, 1);
}

/* A ball of radius 1. */
static casters casters_of_ball(double x, double y, double z) {
    FREED_BY(free_sphere) sphere ball;
    make_sphere(&ball, 128, 1.0);
    ball.mesh.transform = (const double[12]){1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z};
    return casters_of_mesh(&ball.mesh, 1);
}

static vsh_sdf_node shape_at(int32_t shape, double x, double y, double z) {
    vsh_sdf_node node = vsh_sdf_node_default();
    node.shape = shape;
    memcpy(node.translation, (const double[]){x, y, z}, sizeof node.translation);
    return node;
}

static vsh_sdf_node box_at(double x, double y, double z, double a, double b, double c) {
    vsh_sdf_node node = shape_at(VSH_SDF_BOX, x, y, z);
    memcpy(node.size, (const double[]){a, b, c}, sizeof node.size);
    return node;
}

/* --- closed forms */

TEST(a_straight_edge_leaves_the_circular_segment) {
    const double x[] = {-1.01, -0.7, -0.3, 0.0, 0.25, 0.8, 1.01}, half = 0.2;
    const double place[3] = {0.0, 20.0, 0.0};
    vsh_light lights[3] = {sun(OVERHEAD, 2.0 * half), lamp(place, 20.0 * sin(half)),
                           lamp(place, 20.0 * sin(half))};
    lights[2].type = VSH_LIGHT_SPOT;
    lights[2].axis[0] = 1.0; /* where it shines to does not matter */
    for (size_t i = 0; i < COUNT_OF(x); ++i) {
        const double edge = x[i] * tan(half) * 5.0;
        /* a sheet of a millionth whose lower edge decides */
        const vsh_sdf_node sheet = box_at(edge + 50.0, 5.0, 0.0, 50.0, 1e-6, 50.0);
        casters both[2] = {plate((float)edge, 5.0f), casters_of_tree(&sheet, 1, NULL)};
        for (int k = 0; k < 6; ++k) {
            assert_near(seen(both[k / 3], ORIGIN, UP, &lights[k % 3], 8192), truth_disc_share(x[i]), 0.003);
        }
        free_casters(&both[0]);
        free_casters(&both[1]);
    }
}

TEST(the_receivers_own_horizon_is_an_edge) {
    FREED_BY(free_casters) casters none = casters_of_mesh(NULL, 0);
    const double low[3] = {1.0, 0.0, 0.0};
    const vsh_light light = sun(low, 0.5);
    assert_near(seen(none, ORIGIN, UP, &light, 4096), 0.5, 0.002);
    assert_near(seen(none, ORIGIN, NULL, &light, 4096), 1.0, 0.0);
}

TEST(a_hole_in_a_slab_lets_its_share_of_the_disc_through) {
    vsh_sdf_node nodes[3] = {box_at(0.0, 3.0, 0.0, 20.0, 0.5, 20.0),
                             shape_at(VSH_SDF_CYLINDER, 0.0, 3.0, 0.0),
                             operation_node(VSH_SDF_SUBTRACTION, 0, 1)};
    nodes[1].size[1] = 2.0;
    nodes[1].radius = 0.35;
    FREED_BY(free_casters) casters c = casters_of_tree(nodes, 3, NULL);
    /* the hole's upper rim is the narrower one: 0.35 at a height of 3.5, a tangent of 0.1 */
    const double tangents[] = {0.05, 0.099, 0.15, 0.2, 0.4};
    for (size_t i = 0; i < COUNT_OF(tangents); ++i) {
        const double w = tangents[i];
        const vsh_light light = sun(OVERHEAD, 2.0 * atan(w));
        assert_near(seen(c, ORIGIN, UP, &light, 8192), fmin(1.0, 0.01 / (w * w)), 0.002);
    }
}

TEST(ambient_occlusion_of_a_sphere_is_its_share_of_the_cosine) {
    const vsh_sdf_node node = shape_at(VSH_SDF_SPHERE, 0.0, 2.0, 0.0);
    casters both[2] = {casters_of_ball(0.0, 2.0, 0.0), casters_of_tree(&node, 1, NULL)};
    for (int k = 0; k < 2; ++k) {
        /* a cap of half angle 30° around the normal holds sin² of it */
        assert_near(open_at(both[k], ORIGIN, 10.0, 8192), 0.75, 0.003);
        /* rays of 1.2 meet the ball where 2 cos a - √(4 cos² a - 3) ≤ 1.2, that is cos a ≥ 4.44 / 4.8 */
        assert_near(open_at(both[k], ORIGIN, 1.2, 8192), 4.44 / 4.8 * 4.44 / 4.8, 0.003);
        assert_near(open_at(both[k], ORIGIN, 0.9, 1024), 1.0, 0.0);
        free_casters(&both[k]);
    }
}

enum { SIZE = 64, COUNT = SIZE * SIZE };
static double positions[3 * COUNT];
static float normals[3 * COUNT], first[COUNT];

TEST(every_floor_texel_matches_analytic_rays) {
    enum { RAYS = 128 };
    static float truth[COUNT];
    floor_texels(SIZE, positions, normals);
    vsh_sdf_node nodes[2 * MAX_SOLIDS];
    const vsh_sdf tree = tree_of_moved(truth_seeds(), 1.0, ORIGIN, nodes);
    FREED_BY(free_casters) casters c = casters_of_tree(nodes, tree.node_count, NULL);
    vsh_light light = sun(truth_seeds_sun, 2.0 * atan(truth_seeds_w));
    see_light(NULL, c.solids, COUNT, positions, normals, 0.0, &light, RAYS, first);
    truth_lights(truth_seeds(), COUNT, positions, NULL, truth_seeds_sun, truth_seeds_w, INFINITY, RAYS,
                 truth);
    int penumbra = 0, dark = 0;
    for (int i = 0; i < COUNT; ++i) {
        /* the spiral may be turned: a ray or two on the edge */
        const bool whole = truth[i] == 0.0f || truth[i] == 1.0f;
        assert_near((double)first[i], (double)truth[i], whole ? 2.0 / RAYS : 0.05);
        penumbra += truth[i] > 0.02f && truth[i] < 0.98f;
        dark += truth[i] == 0.0f;
    }
    assert_in_range(penumbra, 200, COUNT);
    assert_in_range(dark, 100, COUNT);
    /* and a lamp among them, its rays ending at its near side */
    const double place[3] = {0.6, 2.0, 0.4};
    light = lamp(place, 0.3);
    for (int i = 0; i < COUNT; i += 7) {
        const double *p = positions + 3 * (size_t)i;
        double to[3];
        go_along(place, -1.0, p, to);
        const double far = length3(to), w = tan(asin(0.3 / far));
        const double expected = truth_light(truth_seeds(), p, NULL, to, w, far - 0.3, RAYS);
        assert_near(seen(c, p, NULL, &light, RAYS), expected, 0.05);
    }
}

TEST(rays_stop_at_the_light_and_both_sides_block) {
    const vsh_sdf_node slab = box_at(0.0, 6.0, 0.0, 20.0, 1.0, 20.0);
    FREED_BY(free_casters) casters thin = plate(-1000.0f, 5.0f), solid = casters_of_tree(&slab, 1, NULL);
    const double below[3] = {0.0, 4.0, 0.0}, within[3] = {0.0, 5.5, 0.0}, above[3] = {0.0, 7.0, 0.0},
                 over[3] = {0.0, 10.0, 0.0};
    const vsh_light near = lamp(below, 0.9), inside = lamp(within, 0.3), far = lamp(above, 0.5);
    const float down[3] = {0.0f, -1.0f, 0.0f};
    assert_near(seen(thin, ORIGIN, UP, &near, 256), 1.0, 0.0);
    assert_near(seen(thin, ORIGIN, UP, &far, 256), 0.0, 0.0);
    assert_near(seen(thin, over, down, &near, 256), 0.0, 0.0);
    assert_near(seen(thin, below, UP, &near, 256), 1.0, 0.0); /* within the light */
    assert_near(seen(solid, ORIGIN, UP, &near, 256), 1.0, 0.0);
    assert_near(seen(solid, ORIGIN, UP, &inside, 256), 0.0, 0.0);
    assert_near(seen(solid, within, UP, &near, 256), 0.0, 0.0); /* from inside nothing is seen */
}

/* A triangle plate over x > 0.1, a solid one over x < -0.1: a slit of the light is left. */
TEST(a_ray_is_hidden_that_meets_either_solids_or_triangles) {
    const vsh_sdf_node sheet = box_at(-50.1, 5.0, 0.0, 50.0, 1e-6, 50.0);
    casters one = plate(0.1f, 5.0f), both = {one.triangles, casters_of_tree(&sheet, 1, NULL).solids};
    const double half = 0.1, share = truth_disc_share(0.1 / (5.0 * tan(half)));
    const vsh_light light = sun(OVERHEAD, 2.0 * half);
    assert_near(seen(one, ORIGIN, UP, &light, 8192), share, 0.003);
    assert_near(seen(both, ORIGIN, UP, &light, 8192), 2.0 * share - 1.0, 0.003);
    free_casters(&both);
}

/* --- the same elsewhere, and from far away */

static casters box_and_torus(const double *transform) {
    vsh_sdf_node nodes[3] = {box_at(0.3, 2.0, 0.1, 0.5, 0.2, 0.4), shape_at(VSH_SDF_TORUS, -0.5, 2.5, 0.3),
                             operation_node(VSH_SDF_SMOOTH_UNION, 0, 1)};
    nodes[2].smoothing = 0.3;
    return casters_of_tree(nodes, 3, transform);
}

TEST(transforms_move_solids) {
    /* mirrored in x, turned by a right angle about y, four times as large, and far away */
    const double m[12] = {0.0, 0.0, 4.0, 1000.0, 0.0, 4.0, 0.0, -200.0, 4.0, 0.0, 0.0, 30.0};
    FREED_BY(free_casters) casters plain = box_and_torus(NULL);
    FREED_BY(free_casters) casters moved = box_and_torus(m);
    const double towards[3] = {0.2, 1.0, 0.1}, turned[3] = {0.1, 1.0, 0.2};
    const vsh_light here = sun(towards, 0.3), there = sun(turned, 0.3);
    int between_both = 0;
    for (int i = 0; i < 200; ++i) {
        const double p[3] = {-2.0 + 0.2 * (i % 20), 0.0, -1.0 + 0.2 * (i / 20)};
        const double q[3] = {4.0 * p[2] + 1000.0, 4.0 * p[1] - 200.0, 4.0 * p[0] + 30.0};
        const double value = seen(plain, p, UP, &here, 1024);
        assert_near(seen(moved, q, UP, &there, 1024), value, 0.01);
        assert_near(vshi_solids_distance(moved.solids, q), 4.0 * vshi_solids_distance(plain.solids, p), 1e-9);
        between_both += value > 0.02 && value < 0.98;
    }
    assert_in_range(between_both, 20, 200);
}

/* A box of half side 1, scaled, seen from `distance` half sides away: straight below it, beside that, and
 * from a slant; also from where its own shadow is thrown away from. */
static void see_from_afar(double scale, double distance) {
    float corners[24];
    const double transform[12] = {scale, 0.0, 0.0, 0.0, 0.0, scale, 0.0, 0.0, 0.0, 0.0, scale, 0.0};
    vsh_mesh mesh = box_mesh(corners, (const double[]){-1, -1, -1}, (const double[]){1, 1, 1});
    mesh.transform = transform;
    FREED_BY(free_casters) casters c = casters_of_mesh(&mesh, 1);
    const double far = scale * distance, slanted[3] = {0.6, 0.48, 0.64};
    const double from[4][3] = {{0.25 * scale, -far, 0.25 * scale}, /* below */
                               {0.25 * scale, far, 0.0},           /* above */
                               {far, -far, 0.25 * scale},          /* beside */
                               {-far, -far, far}};                 /* all of that */
    const vsh_light hard = sun(OVERHEAD, 0.0), soft = sun(slanted, 0.1), near = lamp(ORIGIN, 0.5 * scale),
                    behind = lamp(from[1], 0.0);
    for (int i = 0; i < 4; ++i) {
        assert_near(seen(c, from[i], UP, &hard, 1), i == 0 ? 0.0 : 1.0, 0.0);
        assert_near(open_at(c, from[i], 2.0 * far, 64), 1.0, distance < 1e3 ? 0.25 : 0.0);
    }
    assert_near(seen(c, from[0], UP, &behind, 1), 0.0, 0.0);
    for (int i = 0; i < 4; i += 3) {
        assert_near(seen(c, from[i], NULL, &soft, 64), 1.0, 0.0);
        /* beyond 1e6, doubles do not tell which ray meets it */
        assert_in_range(64.0 * seen(c, from[i], NULL, &near, 64), 0, distance < 1e6 ? 0 : 64);
    }
}

/* Embree itself ends the process at a coordinate beyond 1.8e18 of its own. */
TEST(no_distance_is_too_far_for_rays) {
    for (double scale = 1e-30; scale < 1e31; scale *= 1e5) {
        for (double distance = 10.0; distance < 1e61; distance *= distance < 1e5 ? 10.0 : 1e3) {
            see_from_afar(scale, distance);
        }
        see_from_afar(scale, 1.7e18);
        see_from_afar(scale, 1e19);
        see_from_afar(scale, 1e250);
    }
}

/* --- threads and packets */

typedef struct witness {
    pthread_t thread;
    size_t calls, others;
} witness;

static int32_t note_thread(void *user, const char *stage, double fraction) {
    witness *w = user;
    ++w->calls;
    w->others += !pthread_equal(w->thread, pthread_self());
    return 0;
}

/* A tree is made by many threads, or by the caller's alone. */
TEST(trees_are_built_on_the_requested_threads_only) {
    FREED_BY(free_sphere) sphere ball;
    make_sphere(&ball, 128, 1.0);
    for (int i = 0; i < 5; ++i) {
        witness w = {pthread_self(), 0, 0};
        vsh_run run = run_watched(note_thread, &w);
        run.threads = 1;
        vshi_triangles *triangles = NULL;
        assert_ok(vshi_triangles_create(&ball.mesh, 1, NULL, &run, &triangles, &failure));
        vshi_triangles_free(triangles);
        assert_true(w.calls > 2); /* from within the making too */
        assert_int_equal(w.others, 0);
    }
}

TEST(packets_change_no_bit) {
    enum { RAYS = 100 };
    FREED_BY(free_casters) casters c = casters_of_ball(0.3, 1.2, 0.1);
    vshi_segment_ray rays[RAYS] = {0};
    bool together[RAYS], alone;
    uint64_t counter = 5;
    for (int i = 0; i < RAYS; ++i) {
        rays[i].far = 10.0;
        random_direction(&counter, rays[i].direction);
    }
    vshi_triangles_blocked(c.triangles, rays, RAYS, together);
    int hits = 0;
    for (int i = 0; i < RAYS; ++i) {
        vshi_triangles_blocked(c.triangles, &rays[i], 1, &alone);
        assert_int_equal(alone, together[i]);
        hits += alone;
    }
    assert_in_range(hits, 10, 90);
}

/* --- bad input */

TEST(invalid_points_are_nan_and_no_casters_hide_nothing) {
    casters none[2] = {casters_of_mesh(NULL, 0), {NULL, NULL}};
    assert_ok(vshi_solids_create(NULL, NULL, 0, &none[1].solids, &failure));
    const double nowhere[3] = {NAN, 0.0, 0.0};
    const float no_normal[3] = {0.0f, 0.0f, 0.0f};
    const vsh_light light = sun(OVERHEAD, 0.5);
    for (int k = 0; k < 2; ++k) {
        assert_true(isnan(seen(none[k], nowhere, UP, &light, 4)));
        assert_true(isnan(seen(none[k], ORIGIN, no_normal, &light, 4)));
        assert_near(seen(none[k], ORIGIN, UP, &light, 64), 1.0, 0.0);
    }
    assert_true(isinf(vshi_solids_distance(none[1].solids, ORIGIN)));
    assert_true(isnan(vshi_solids_distance(none[1].solids, nowhere)));
    free_casters(&none[0]);
    free_casters(&none[1]);
}

TEST(bad_triangles_are_refused) {
    FREED_BY(free_sphere) sphere ball;
    make_sphere(&ball, 128, 1.0);
    vshi_triangles *triangles = NULL;
    const vsh_run small = run_within(1 << 20);
    assert_fails(vshi_triangles_create(&ball.mesh, 1, NULL, &small, &triangles, &failure), VSH_ERROR_LIMIT,
                 "");
    const uint32_t wrong[3] = {0, 1, 99};
    const float corners[9] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    const vsh_mesh bad = mesh_of_arrays(NULL, corners, NULL, 3, wrong, 1);
    assert_fails(vshi_triangles_create(&bad, 1, NULL, &small, &triangles, &failure), VSH_ERROR_INPUT, "");
    assert_null(triangles);
}

TEST(bad_solids_are_refused) {
    const double uneven[12] = {1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0};
    vsh_sdf_node node = vsh_sdf_node_default();
    const vsh_sdf sdf = {&node, 1};
    vshi_solids *solids = NULL;
    assert_fails(vshi_solids_create(&sdf, uneven, 1, &solids, &failure), VSH_ERROR_INPUT, "unevenly");
    node.radius = -1.0;
    assert_fails(vshi_solids_create(&sdf, uneven, 1, &solids, &failure), VSH_ERROR_INPUT, "radius");
}
