/* What a lattice holds badly or not at all: walls, gaps and needles of a voxel or less, solids that touch,
 * lie in each other or share faces, and values that are no distances. docs/numerics.md has the bounds. */
#include "shading.h"

#include "field/field.h"
#include "truth/metrics.h"

#include <stdlib.h>

enum { SHADOWS = VSH_SHADOW_ADAPTIVE + 1, PHASES = 8, RAYS = 40 };

static const double VOXEL = 0.0625;
static const double THICKNESSES[] = {0.25, 0.5, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0}; /* voxels */
enum { THICKNESS_COUNT = sizeof THICKNESSES / sizeof THICKNESSES[0] };

/* A box among others, about to be turned with them. */
typedef struct block {
    double centre[3], half[3];
} block;

/* The union of boxes, turned about (1, 2, 3) by `turn` radians and then moved. NULL where there is no
 * surface.
 */
static vsh_field *field_of_blocks(const block *blocks, int count, double turn, const double by[3],
                                  double voxel) {
    vsh_sdf_node nodes[16];
    int last = 0;
    for (int i = 0; i < count; ++i) {
        const int at = i == 0 ? 0 : last + 1;
        nodes[at] = vsh_sdf_node_default();
        nodes[at].shape = VSH_SDF_BOX;
        memcpy(nodes[at].size, blocks[i].half, sizeof blocks[i].half);
        memcpy(nodes[at].translation, blocks[i].centre, sizeof blocks[i].centre);
        if (i > 0) {
            nodes[at + 1] = vsh_sdf_node_default();
            nodes[at + 1].shape = VSH_SDF_UNION;
            nodes[at + 1].left = last;
            nodes[at + 1].right = at;
        }
        last = i == 0 ? 0 : at + 1;
    }
    vsh_sdf_node *root = &nodes[last];
    if (count == 1) { /* its own place comes first */
        assert_true(root->translation[0] == 0.0 && root->translation[1] == 0.0 &&
                    root->translation[2] == 0.0);
    }
    const double norm = sqrt(14.0);
    for (int axis = 0; axis < 3; ++axis) {
        root->rotation[axis] = sin(0.5 * turn) * (axis + 1) / norm;
        root->translation[axis] = by[axis];
    }
    root->rotation[3] = cos(0.5 * turn);
    const vsh_sdf sdf = {nodes, (size_t)last + 1};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    vsh_grid *grid = NULL;
    vsh_field *field = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &error) == VSH_OK) {
        vsh_field_options near = vsh_field_options_default();
        near.reach = 8.0 * voxel;
        const vsh_result result = vsh_field_create(grid, &near, NULL, &field, &error);
        assert_true(result == VSH_OK || result == VSH_ERROR_INPUT);
    } else {
        assert_int_equal(error.code, VSH_ERROR_INPUT);
    }
    vsh_grid_free(grid);
    return field;
}

/* Rodrigues' rotation about (1, 2, 3). */
static void turn_by(double turn, const double v[3], double out[3]) {
    const double norm = sqrt(14.0), a[3] = {1.0 / norm, 2.0 / norm, 3.0 / norm};
    const double c = cos(turn), s = sin(turn), along = a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
    for (int axis = 0; axis < 3; ++axis) {
        const int j = (axis + 1) % 3, k = (axis + 2) % 3;
        out[axis] = c * v[axis] + s * (a[j] * v[k] - a[k] * v[j]) + (1.0 - c) * along * a[axis];
    }
}

/* Share of rays (own axes: from `low` … `high`, towards +y) that `hard` lets through, over all phases of the
 * lattice; upright and turned. `unmade` counts fields without a surface. */
typedef struct passage {
    double through[2];
    int unmade;
} passage;

static passage pass(const block *blocks, int count, const double low[3], const double high[3], double tilt,
                    double voxel) {
    passage result = {{0.0, 0.0}, 0};
    for (int t = 0; t < 2; ++t) {
        const double turn = t * 0.6;
        size_t through = 0, all = 0;
        uint64_t counter = 31;
        for (int phase = 0; phase < PHASES; ++phase) {
            const double by[3] = {voxel * phase / PHASES, voxel * (3 * phase % PHASES) / PHASES,
                                  voxel * (5 * phase % PHASES) / PHASES};
            vsh_field *field = field_of_blocks(blocks, count, turn, by, voxel);
            if (field == NULL) {
                ++result.unmade;
                continue;
            }
            for (int ray = 0; ray < RAYS; ++ray) {
                double p[3], q[3], d[3];
                for (int axis = 0; axis < 3; ++axis) {
                    p[axis] = between(&counter, low[axis], high[axis]);
                }
                const double up[3] = {tilt * between(&counter, -1.0, 1.0), 1.0,
                                      tilt * between(&counter, -1.0, 1.0)};
                turn_by(turn, p, q);
                turn_by(turn, up, d);
                for (int axis = 0; axis < 3; ++axis) {
                    q[axis] += by[axis];
                }
                const vsh_light light = sun(d, 0.0);
                through += shadow_at(field, &light, VSH_SHADOW_HARD, q, NULL) == 1.0f;
                ++all;
            }
            vsh_field_free(field);
        }
        result.through[t] = all > 0 ? (double)through / (double)all : 1.0;
    }
    return result;
}

static void walls_over_a_voxel_block_every_ray(void **state) {
    (void)state;
    for (int i = 0; i < THICKNESS_COUNT; ++i) {
        const block wall = {{0, 0, 0}, {1.2, 0.5 * THICKNESSES[i] * VOXEL, 1.2}};
        const double low[3] = {-0.6, -0.6, -0.6}, high[3] = {0.6, -0.4, 0.6};
        const passage p = pass(&wall, 1, low, high, 0.5, VOXEL);
        print_message("wall of %g voxels: %.3f through upright, %.3f turned, %d of %d not there\n",
                      THICKNESSES[i], p.through[0], p.through[1], p.unmade, 2 * PHASES);
        if (THICKNESSES[i] >= 1.25) {
            assert_true(p.through[0] == 0.0 && p.through[1] == 0.0 && p.unmade == 0);
        }
    }
}

static void gaps_over_a_voxel_let_their_middle_through(void **state) {
    (void)state;
    for (int i = 0; i < THICKNESS_COUNT; ++i) {
        const double g = 0.5 * THICKNESSES[i] * VOXEL;
        const block sides[2] = {{{0.6 + g, 0, 0}, {0.6, 0.2, 1.0}}, {{-0.6 - g, 0, 0}, {0.6, 0.2, 1.0}}};
        const double low[3] = {0.0, -0.6, -0.8}, high[3] = {0.0, -0.4, 0.8};
        const passage p = pass(sides, 2, low, high, 0.0, VOXEL);
        print_message("gap of %g voxels: %.3f through upright, %.3f turned\n", THICKNESSES[i], p.through[0],
                      p.through[1]);
        if (THICKNESSES[i] >= 1.25) {
            assert_true(p.through[0] == 1.0 && p.through[1] == 1.0);
        }
    }
}

static void needles_over_a_voxel_block_their_axis(void **state) {
    (void)state;
    for (int i = 0; i < THICKNESS_COUNT; ++i) {
        const double h = 0.5 * THICKNESSES[i] * VOXEL;
        const block needle = {{0, 0, 0}, {h, h, 1.5}};
        const double low[3] = {0.0, -0.6, -1.2}, high[3] = {0.0, -0.4, 1.2};
        const passage p = pass(&needle, 1, low, high, 0.0, VOXEL);
        print_message("needle of %g voxels: %.3f through upright, %.3f turned, %d of %d not there\n",
                      THICKNESSES[i], p.through[0], p.through[1], p.unmade, 2 * PHASES);
        if (THICKNESSES[i] >= 1.5) {
            assert_true(p.through[0] == 0.0 && p.through[1] == 0.0 && p.unmade == 0);
        }
    }
}

/* Along the very plane in which two boxes meet, and beside it. */
static void no_light_comes_through_the_seam_of_boxes_that_touch(void **state) {
    (void)state;
    const block boxes[2] = {{{0.6, 0, 0}, {0.6, 0.5, 1.0}}, {{-0.6, 0, 0}, {0.6, 0.5, 1.0}}};
    const double low[3] = {0.0, -1.1, -0.8}, high[3] = {0.0, -0.9, 0.8};
    const double beside_low[3] = {-0.5 * VOXEL, -1.1, -0.8}, beside_high[3] = {0.5 * VOXEL, -0.9, 0.8};
    const passage on = pass(boxes, 2, low, high, 0.0, VOXEL);
    const passage beside = pass(boxes, 2, beside_low, beside_high, 0.0, VOXEL);
    print_message("seam: %.3f through upright, %.3f turned; beside it %.3f, %.3f\n", on.through[0],
                  on.through[1], beside.through[0], beside.through[1]);
    assert_true(on.through[0] + on.through[1] + beside.through[0] + beside.through[1] == 0.0);
}

/* ---- Meshes ---- */

typedef struct box_mesh {
    float positions[24];
    vsh_mesh mesh;
} box_mesh;

static const uint32_t SIDES[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                      {3, 6, 2}, {3, 7, 6}, {0, 4, 7}, {0, 7, 3}, {1, 2, 6}, {1, 6, 5}};

static void make_box(box_mesh *box, const double low[3], const double high[3]) {
    static const int corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                      {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    for (int i = 0; i < 24; ++i) {
        box->positions[i] = (float)(corners[i / 3][i % 3] ? high[i % 3] : low[i % 3]);
    }
    box->mesh = (vsh_mesh){"box", box->positions, NULL, NULL, &SIDES[0][0], 8, 12, NULL};
}

static vsh_field *field_of_boxes(const double (*corners)[2][3], int count, double voxel) {
    box_mesh boxes[4];
    vsh_mesh meshes[4];
    for (int i = 0; i < count; ++i) {
        make_box(&boxes[i], corners[i][0], corners[i][1]);
        meshes[i] = boxes[i].mesh;
    }
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = voxel;
    vsh_grid *grid = NULL;
    vsh_error error = {VSH_OK, ""};
    if (vsh_grid_from_meshes(meshes, (size_t)count, &options, NULL, &grid, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    return field_of_grid(grid, 0.0);
}

/* Visible parts of a light of `angle` from under the boxes, against truth; largest value where it is 0. */
static double lightest_umbra(const vsh_field *field, double angle, double depth, double x, int32_t method) {
    const double up[3] = {0.0, 1.0, 0.0};
    const vsh_light light = sun(up, angle);
    double most = 0.0;
    for (int i = 0; i <= 40; ++i) {
        const double p[3] = {x * (0.05 * i - 1.0), -depth, 0.013};
        most = fmax(most, (double)shadow_at(field, &light, method, p, NULL));
    }
    return most;
}

static void meshes_that_touch_nest_or_coincide_are_one_solid(void **state) {
    (void)state;
    const struct {
        const char *what;
        int count;
        double corners[3][2][3];
    } cases[] = {
        {"one box", 1, {{{-1, -1, -1}, {1, 1, 1}}}},
        {"two that share a face", 2, {{{-1, -1, -1}, {0, 1, 1}}, {{0, -1, -1}, {1, 1, 1}}}},
        {"two that share a face between lattice planes",
         2,
         {{{-1, -1, -1}, {0.03, 1, 1}}, {{0.03, -1, -1}, {1, 1, 1}}}},
        {"one in the other", 2, {{{-1, -1, -1}, {1, 1, 1}}, {{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}}}},
        {"one in the other, a face in common",
         2,
         {{{-1, -1, -1}, {1, 1, 1}}, {{-0.5, -1, -0.5}, {0.5, 0.5, 0.5}}}},
        {"the same twice", 2, {{{-1, -1, -1}, {1, 1, 1}}, {{-1, -1, -1}, {1, 1, 1}}}},
        {"three in each other",
         3,
         {{{-1, -1, -1}, {1, 1, 1}},
          {{-0.7, -0.7, -0.7}, {0.7, 0.7, 0.7}},
          {{-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4}}}},
    };
    vsh_field *one = NULL;
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; ++c) {
        vsh_field *field = field_of_boxes(cases[c].corners, cases[c].count, VOXEL);
        /* signs are those of the union */
        const truth_solid box = {TRUTH_BOX, {0, 0, 0}, {1, 1, 1}, 0.0, 0.0};
        uint64_t counter = 1;
        size_t wrong = 0;
        for (int i = 0; i < 100000; ++i) {
            const double p[3] = {between(&counter, -1.3, 1.3), between(&counter, -1.3, 1.3),
                                 between(&counter, -1.3, 1.3)};
            float h;
            vsh_field_sample(field, 1, p, &h);
            const double truth = truth_solid_distance(&box, p);
            wrong += fabs(truth) > 0.5 * VOXEL && (h > 0.0f) != (truth > 0.0);
        }
        const double hard = lightest_umbra(field, 0.0, 1.5, 0.9, VSH_SHADOW_HARD);
        const double narrow = lightest_umbra(field, RADIANS(0.5), 1.5, 0.9, VSH_SHADOW_CONE);
        const double wide = lightest_umbra(field, RADIANS(20.0), 1.5, 0.3, VSH_SHADOW_CONE);
        print_message(
            "%s: %zu of 100000 signs wrong; lightest umbra: hard %g, 0.5 degrees %.3f, 20 degrees %.3f\n",
            cases[c].what, wrong, hard, narrow, wide);
        assert_true(wrong == 0 && hard == 0.0 && narrow == 0.0 && wide == 0.0);
        if (c == 0) {
            one = field;
        } else {
            vsh_field_free(field);
        }
    }
    vsh_field_free(one);
}

/* ---- Values that are no distances ---- */

typedef struct stretched {
    double factor;
} stretched;

static double stretched_ball(void *user, const double p[3]) {
    const stretched *s = user;
    return s->factor * (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 0.7);
}

static void fields_that_are_not_1_lipschitz_are_right_where_they_say_so(void **state) {
    (void)state;
    enum { COUNT = 41 };
    const truth_solid ball = {TRUTH_SPHERE, {0, 0, 0}, {0, 0, 0}, 0.7, 0.0};
    const double up[3] = {0.0, 1.0, 0.0}, w = 0.1;
    const vsh_light light = sun(up, 2.0 * atan(w));
    float truth[COUNT], visible[COUNT];
    double positions[3 * COUNT];
    for (int i = 0; i < COUNT; ++i) {
        const double p[3] = {0.03 * i, -2.0, 0.01};
        memcpy(positions + 3 * i, p, sizeof p);
    }
    assert_int_equal(
        truth_lights((truth_scene){&ball, 1}, COUNT, positions, NULL, up, w, (double)INFINITY, 4096, truth),
        0);
    const double factors[] = {1.0, 2.0, 0.5, 20.0, 0.05};
    for (int exact = 0; exact < 2; ++exact) {
        for (int f = 0; f < 5; ++f) {
            stretched s = {factors[f]};
            const vsh_distance field = {stretched_ball, &s, factors[f], exact, {-0.8, -0.8, -0.8},
                                        {0.8, 0.8, 0.8}};
            vsh_grid_options options = vsh_grid_options_default();
            options.voxel_size = 0.04;
            vsh_grid *grid = NULL;
            assert_int_equal(vsh_grid_from_distance(&field, &options, NULL, &grid, NULL), VSH_OK);
            vsh_field *made = field_of_grid(grid, 0.0);
            for (int32_t method = 0; method < SHADOWS; ++method) {
                const vsh_shade_stats stats = shadows(made, &light, method, COUNT, positions, NULL, visible);
                assert_int_equal(stats.unfinished, 0);
                const truth_metrics m = truth_compare(COUNT, visible, truth, NULL);
                if (method == VSH_SHADOW_CONE) {
                    print_message("values times %g, %s: rmse %.4f, worst %.3f\n", factors[f],
                                  exact ? "taken as distances" : "made distances", m.rmse, m.max);
                    assert_true(exact && f > 0 ? m.rmse < 0.45 : m.rmse < 0.015);
                }
                for (int i = 0; i < COUNT; ++i) {
                    assert_true(visible[i] >= 0.0f && visible[i] <= 1.0f);
                }
            }
            vsh_field_free(made);
        }
    }
}

/* Intersections and subtractions are bounds outside of their corners: a box cut out of boxes is a box. */
static void bounds_of_csg_become_distances(void **state) {
    (void)state;
    vsh_sdf_node nodes[3] = {vsh_sdf_node_default(), vsh_sdf_node_default(), vsh_sdf_node_default()};
    for (int i = 0; i < 2; ++i) {
        nodes[i].shape = VSH_SDF_BOX;
        nodes[i].size[0] = nodes[i].size[1] = nodes[i].size[2] = 1.0;
    }
    nodes[0].translation[0] = 0.6;
    nodes[1].translation[0] = -0.6;
    nodes[1].translation[2] = 0.5;
    nodes[2].left = 0;
    nodes[2].right = 1;
    const truth_solid results[2] = {{TRUTH_BOX, {0.0, 0.0, 0.25}, {0.4, 1.0, 0.75}, 0.0, 0.0},
                                    {TRUTH_BOX, {0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}, 0.0, 0.0}};
    nodes[2].shape = VSH_SDF_INTERSECTION;
    const vsh_sdf sdf = {nodes, 3};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.04;
    vsh_grid *grid = NULL;
    assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, NULL), VSH_OK);
    vsh_field *field = field_of_grid(grid, 0.0);
    uint64_t counter = 17;
    double worst = 0.0;
    for (int i = 0; i < 200000; ++i) {
        const double p[3] = {between(&counter, -0.5, 0.5), between(&counter, -1.1, 1.1),
                             between(&counter, -0.6, 1.1)};
        const double truth = truth_solid_distance(&results[0], p);
        float h;
        vsh_field_sample(field, 1, p, &h);
        if (fabs(truth) < 2.0 * 0.04) {
            worst = fmax(worst, fabs((double)h - truth) / 0.04);
        }
    }
    print_message("intersection of boxes: worst %.3f voxels\n", worst);
    /* the mesh between the field and its distances cuts corners: here they are lattice points, the worst case
     */
    assert_true(worst < 1.6);
    vsh_field_free(field);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(walls_over_a_voxel_block_every_ray),
        cmocka_unit_test(gaps_over_a_voxel_let_their_middle_through),
        cmocka_unit_test(needles_over_a_voxel_block_their_axis),
        cmocka_unit_test(no_light_comes_through_the_seam_of_boxes_that_touch),
        cmocka_unit_test(meshes_that_touch_nest_or_coincide_are_one_solid),
        cmocka_unit_test(fields_that_are_not_1_lipschitz_are_right_where_they_say_so),
        cmocka_unit_test(bounds_of_csg_become_distances),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
