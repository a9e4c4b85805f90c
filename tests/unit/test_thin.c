/* A lattice holds walls, gaps and needles of a voxel or less badly or not at all, and so seams of boxes that
 * touch. Tests ask the field by one ray and by rays and cones of a narrow light, and triangles of any
 * thickness. docs/accuracy.md has the bounds. */
#include "field/field.h"
#include "testing.h"
#include "traced.h"
#include "truth/metrics.h"

enum { PHASES = 8, RAYS = 40 };

/* The light for the methods other than `hard`. At the receivers, 0.6 units away, it is a tenth of a voxel
 * wide, so no gap or wall of a voxel is smaller than it. */
static const double NARROW = 0.02;

static const double VOXEL = 0.0625;
static const double THICKNESSES[] = {0.25, 0.5, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0}; /* voxels */
enum { THICKNESS_COUNT = COUNT_OF(THICKNESSES) };

/* A box among others, about to be turned with them. */
typedef struct block {
    double centre[3], half[3];
} block;

static const double AXIS[3] = {1.0, 2.0, 3.0};

/* The same as triangles. */
static vshi_triangles *triangles_of_blocks(const block *blocks, int count, double turn, const double by[3]) {
    vsh_mesh meshes[8];
    float corners[8][24];
    double transforms[8][12];
    for (int i = 0; i < count; ++i) {
        const double *h = blocks[i].half, low[3] = {-h[0], -h[1], -h[2]};
        double centre[3];
        meshes[i] = box_mesh(corners[i], low, h);
        turn_about(AXIS, turn, blocks[i].centre, centre);
        go_along(centre, 1.0, by, centre);
        make_turn(AXIS, turn, centre, transforms[i]);
        meshes[i].transform = transforms[i];
    }
    return triangles_from(meshes, (size_t)count);
}

/* The union of boxes, turned about (1, 2, 3) by `turn` radians and then moved. No field where there is
 * no surface. */
static casting caster_of_blocks(const block *blocks, int count, double turn, const double by[3]) {
    vsh_sdf_node nodes[16];
    int last = 0;
    for (int i = 0; i < count; ++i) {
        const int at = i == 0 ? 0 : last + 1;
        nodes[at] = box_node(blocks[i].half[0], blocks[i].half[1], blocks[i].half[2]);
        memcpy(nodes[at].translation, blocks[i].centre, sizeof blocks[i].centre);
        if (i > 0) {
            nodes[at + 1] = operation_node(VSH_SDF_UNION, last, at);
        }
        last = i == 0 ? 0 : at + 1;
    }
    vsh_sdf_node *root = &nodes[last];
    assert_true(count > 1 || length3(root->translation) == 0.0); /* a lone box is moved by `by` only */
    for (int axis = 0; axis < 3; ++axis) {
        root->rotation[axis] = sin(0.5 * turn) * AXIS[axis] / length3(AXIS);
        root->translation[axis] = by[axis];
    }
    root->rotation[3] = cos(0.5 * turn);
    const vsh_sdf sdf = {nodes, (size_t)last + 1};
    const vsh_grid_options options = with_voxel(VOXEL);
    OWNED(vsh_grid) *grid = NULL;
    casting made = {NULL, triangles_of_blocks(blocks, count, turn, by)};
    if (vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure) == VSH_OK) {
        vshi_field_options near = vshi_field_options_default();
        near.reach = 8.0 * VOXEL;
        const vsh_result result = vshi_field_create(grid, &near, NULL, &made.field, &failure);
        assert_true(result == VSH_OK || result == VSH_ERROR_INPUT);
    } else {
        assert_int_equal(failure.code, VSH_ERROR_INPUT);
    }
    return made;
}

enum { BLOCKED, FREE };

/* Casts rays over all phases of the lattice, upright and turned: from `low` … `high`, towards +y, `tilt`
 * aside. Counts the share that `hard` lets through, and the values by a narrow light that are not `expected`.
 * `unmade` counts fields without a surface. */
typedef struct passage {
    double through[2];
    size_t other[VSH_SHADOW_EXACT + 1];
    int unmade;
} passage;

static passage pass(const block *blocks, int count, const double low[3], const double high[3], double tilt,
                    int expected) {
    passage result = {{0.0, 0.0}, {0}, 0};
    for (int t = 0; t < 2; ++t) {
        const double turn = t * 0.6;
        size_t through = 0, all = 0;
        uint64_t counter = 31;
        for (int phase = 0; phase < PHASES; ++phase) {
            const double by[3] = {VOXEL * phase / PHASES, VOXEL * (3 * phase % PHASES) / PHASES,
                                  VOXEL * (5 * phase % PHASES) / PHASES};
            FREED_BY(caster_free) casting c = caster_of_blocks(blocks, count, turn, by);
            if (c.field == NULL) {
                ++result.unmade;
                vshi_triangles_free(c.triangles);
                continue;
            }
            for (int ray = 0; ray < RAYS; ++ray) {
                double p[3], q[3], d[3];
                for (int axis = 0; axis < 3; ++axis) {
                    p[axis] = between(&counter, low[axis], high[axis]);
                }
                const double up[3] = {tilt * between(&counter, -1.0, 1.0), 1.0,
                                      tilt * between(&counter, -1.0, 1.0)};
                turn_about(AXIS, turn, p, q);
                turn_about(AXIS, turn, up, d);
                go_along(q, 1.0, by, q);
                const vsh_light point = sun(d, 0.0), narrow = sun(d, NARROW * VOXEL);
                through += cast_shadow_at(&c, &point, VSH_SHADOW_HARD, q, NULL) == 1.0f;
                for (int32_t method = VSH_SHADOW_SMOOTH; method < SHADOW_METHODS; ++method) {
                    result.other[method] +=
                        cast_shadow_at(&c, &narrow, method, q, NULL) != (expected == FREE ? 1.0f : 0.0f);
                }
                ++all;
            }
        }
        result.through[t] = all > 0 ? (double)through / (double)all : 1.0;
    }
    return result;
}

/* On the field from `least` voxels on, by methods from `first` on; on the triangles always. */
static void assert_passage(const passage *p, double voxels, double least, int32_t first, int expected) {
    assert_int_equal(p->other[VSH_SHADOW_EXACT], 0);
    if (voxels >= least) {
        const double share = expected == FREE ? 1.0 : 0.0;
        assert_true(p->through[0] == share && p->through[1] == share && p->unmade == 0);
        for (int32_t method = first; method <= VSH_SHADOW_ADAPTIVE; ++method) {
            assert_int_equal(p->other[method], 0);
        }
    }
}

TEST(walls_gaps_and_needles_over_a_voxel_are_exact) {
    const double low[3][3] = {{-0.6, -0.6, -0.6}, {0.0, -0.6, -0.8}, {0.0, -0.6, -1.2}};
    const double high[3][3] = {{0.6, -0.4, 0.6}, {0.0, -0.4, 0.8}, {0.0, -0.4, 1.2}};
    for (int i = 0; i < THICKNESS_COUNT; ++i) {
        const double voxels = THICKNESSES[i], h = 0.5 * voxels * VOXEL;
        const block wall = {{0, 0, 0}, {1.2, h, 1.2}}, needle = {{0, 0, 0}, {h, h, 1.5}};
        const block sides[2] = {{{0.6 + h, 0, 0}, {0.6, 0.2, 1.0}}, {{-0.6 - h, 0, 0}, {0.6, 0.2, 1.0}}};
        const passage all[3] = {pass(&wall, 1, low[0], high[0], 0.5, BLOCKED),
                                pass(sides, 2, low[1], high[1], 0.0, FREE),       /* through the middle */
                                pass(&needle, 1, low[2], high[2], 0.0, BLOCKED)}; /* along the axis */
        assert_passage(&all[0], voxels, 1.25, VSH_SHADOW_SMOOTH, BLOCKED);
        assert_passage(&all[1], voxels, 1.25, VSH_SHADOW_SMOOTH, FREE);
        assert_passage(&all[2], voxels, 1.5, VSH_SHADOW_SMOOTH, BLOCKED);
    }
}

/* Along the very plane in which two boxes meet, and beside it. By rays: a union is as deep there as its boxes
 * are, not at all, so that cones along it read an edge. */
TEST(boxes_that_touch_let_no_light_through) {
    const block boxes[2] = {{{0.6, 0, 0}, {0.6, 0.5, 1.0}}, {{-0.6, 0, 0}, {0.6, 0.5, 1.0}}};
    const double low[3] = {0.0, -1.1, -0.8}, high[3] = {0.0, -0.9, 0.8};
    const double beside_low[3] = {-0.5 * VOXEL, -1.1, -0.8}, beside_high[3] = {0.5 * VOXEL, -0.9, 0.8};
    const passage on = pass(boxes, 2, low, high, 0.0, BLOCKED);
    const passage beside = pass(boxes, 2, beside_low, beside_high, 0.0, BLOCKED);
    assert_passage(&on, 8.0, 0.0, VSH_SHADOW_RAYS, BLOCKED);
    assert_passage(&beside, 8.0, 0.0, VSH_SHADOW_RAYS, BLOCKED);
}

/* Six boxes around a room: by rays nothing is seen from its floor, by walls from 1.25 voxels on, or however
 * thin where they are triangles. */
TEST(rooms_are_dark) {
    const float up[3] = {0.0f, 1.0f, 0.0f};
    const double nowhere[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < THICKNESS_COUNT; ++i) {
        const double h = 0.5 * THICKNESSES[i] * VOXEL, out = 1.0 + h, wide = 1.0 + 2.0 * h;
        const block walls[6] = {{{out, 0, 0}, {h, wide, wide}}, {{-out, 0, 0}, {h, wide, wide}},
                                {{0, out, 0}, {wide, h, wide}}, {{0, -out, 0}, {wide, h, wide}},
                                {{0, 0, out}, {wide, wide, h}}, {{0, 0, -out}, {wide, wide, h}}};
        FREED_BY(caster_free) casting c = caster_of_blocks(walls, 6, 0.0, nowhere);
        uint64_t counter = 2;
        double lightest[VSH_AO_EXACT + 1] = {0.0};
        for (int k = 0; c.field != NULL && k < 40; ++k) {
            const double p[3] = {between(&counter, -0.9, 0.9), -0.999, between(&counter, -0.9, 0.9)};
            for (int32_t method = VSH_AO_CONES; method < AO_METHODS; ++method) {
                lightest[method] = fmax(lightest[method], (double)cast_ao_at(&c, method, 10.0, p, up));
            }
        }
        assert_true(lightest[VSH_AO_EXACT] == 0.0);
        if (THICKNESSES[i] >= 1.25) {
            assert_true(c.field != NULL && lightest[VSH_AO_RAYS] == 0.0 && lightest[VSH_AO_ADAPTIVE] == 0.0);
        }
    }
}

/* A wall stands on a floor, less than half a voxel from the receivers, between them and a low sun. To a cone,
 * a thin wall looks like the floor's own height. The cone must not certify its passage. */
TEST(walls_beside_a_receiver_shade_it) {
    const float up[3] = {0.0f, 1.0f, 0.0f};
    for (int i = 0; i < 4; ++i) {
        for (int phase = 0; phase < PHASES; ++phase) {
            const double by[3] = {VOXEL * phase / PHASES, VOXEL * (3 * phase % PHASES) / PHASES,
                                  VOXEL * (5 * phase % PHASES) / PHASES};
            const double h = 0.5 * THICKNESSES[i] * VOXEL;
            const block blocks[2] = {{{0.0, -0.3, 0.0}, {1.0, 0.3, 1.0}}, {{h, 0.2, 0.0}, {h, 0.2, 0.9}}};
            FREED_BY(caster_free) casting c = caster_of_blocks(blocks, 2, 0.0, by);
            assert_non_null(c.field);
            uint64_t counter = 3;
            for (int k = 0; k < 60; ++k) {
                double d[3];
                const double p[3] = {by[0] - VOXEL * between(&counter, 0.2, 0.5), by[1],
                                     by[2] + between(&counter, -0.4, 0.4)};
                direction_at(RADIANS(between(&counter, 7.0, 40.0)), RADIANS(between(&counter, -40.0, 40.0)),
                             d);
                const vsh_light light = sun(d, RADIANS(0.5));
                assert_true(cast_shadow_at(&c, &light, VSH_SHADOW_EXACT, p, up) == 0.0f);
            }
        }
    }
}

/* --- solids that touch, lie in each other or share faces */

/* The lightest value in the umbra of the boxes, straight under them. */
static double lightest_umbra(const casting *c, double angle, double depth, double x, int32_t method) {
    const double up[3] = {0.0, 1.0, 0.0};
    const vsh_light light = sun(up, angle);
    double most = 0.0;
    for (int i = 0; i <= 40; ++i) {
        const double p[3] = {x * (0.05 * i - 1.0), -depth, 0.013};
        most = fmax(most, (double)cast_shadow_at(c, &light, method, p, NULL));
    }
    return most;
}

/* Shadow and AO by every method, across the penumbra and up to a side. */
enum { ACROSS = 64 };

typedef struct row {
    float v[KINDS][ACROSS];
} row;

static void shade_row(const casting *c, row *r) {
    const double towards[3] = {0.2, 1.0, 0.1};
    const vsh_light light = sun(towards, RADIANS(8.0));
    double at[3 * ACROSS];
    float ns[3 * ACROSS];
    for (int i = 0; i < ACROSS; ++i) {
        const double p[3] = {-2.5 + 5.0 * i / ACROSS, -1.4, 0.07};
        const float n[3] = {0.1f, 1.0f, -0.2f};
        memcpy(at + 3 * i, p, sizeof p);
        memcpy(ns + 3 * i, n, sizeof n);
    }
    for (int kind = 0; kind < KINDS; ++kind) {
        cast_kind(c, kind, &light, 2.0, ACROSS, at, ns, r->v[kind]);
    }
}

TEST(meshes_that_touch_nest_or_coincide_are_one_solid) {
    const struct {
        const char *what;
        size_t count;
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
    static row one, other;
    for (size_t c = 0; c < COUNT_OF(cases); ++c) {
        float places[3][24];
        vsh_mesh meshes[3];
        for (size_t i = 0; i < cases[c].count; ++i) {
            meshes[i] = box_mesh(places[i], cases[c].corners[i][0], cases[c].corners[i][1]);
        }
        FREED_BY(caster_free) casting made = caster_of_meshes(meshes, cases[c].count, VOXEL, 0.0);
        /* signs are those of the union */
        const truth_solid box = {TRUTH_BOX, {0, 0, 0}, {1, 1, 1}, 0.0, 0.0};
        uint64_t counter = 1;
        size_t wrong = 0;
        for (int i = 0; i < 100000; ++i) {
            const double p[3] = {between(&counter, -1.3, 1.3), between(&counter, -1.3, 1.3),
                                 between(&counter, -1.3, 1.3)};
            float h;
            vsh_field_sample(made.field, 1, p, &h);
            const double truth = truth_solid_distance(&box, p);
            wrong += fabs(truth) > 0.5 * VOXEL && (h > 0.0f) != (truth > 0.0);
        }
        assert_int_equal(wrong, 0);
        for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
            const double hard = lightest_umbra(&made, 0.0, 1.5, 0.9, method);
            const double narrow = lightest_umbra(&made, RADIANS(0.5), 1.5, 0.9, method);
            const double wide = lightest_umbra(&made, RADIANS(20.0), 1.5, 0.3, method);
            assert_that(hard == 0.0 && narrow == 0.0 && wide == 0.0,
                        "%s, %s: lightest umbra: hard %g, 0.5 degrees %g, 20 degrees %g", cases[c].what,
                        vsh_get_name(VSH_NAMES_SHADOW, method), hard, narrow, wide);
        }
        /* and beside the umbra as of the one box: its field's values differ by roundings of the mesh's */
        shade_row(&made, c == 0 ? &one : &other);
        for (int kind = 0; c > 0 && kind < KINDS; ++kind) {
            const truth_metrics m = truth_compare(ACROSS, other.v[kind], one.v[kind], NULL);
            assert_less(m.rmse, 0.01);
        }
    }
}
