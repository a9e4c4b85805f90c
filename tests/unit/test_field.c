/* The pyramid: distances of the seeds' scene against closed forms, level by level; levels, limits, bad
 * options. */
#include "fields.h"

#include "field/field.h"
#include "levelset/access.h"

#define VOXEL 0.04

/* The solids touch at the foot of the post: below it the nearest surface is the edge around the foot, not the
 * plate's top, and the distance to a union's nearest solid is no distance. */
static bool under_the_post(const double p[3]) {
    return fabs(p[0] - 0.3) < 0.05 && fabs(p[2] - 1.5) < 0.05 && p[1] > -0.5 && p[1] < 0.05;
}

static const truth_solid BALL = {.shape = TRUTH_SPHERE, .radius = 1.0};

static vsh_field *seeds_field(double reach) {
    return field_of(truth_seeds(), VOXEL, reach);
}

static void random_point(uint64_t *counter, double margin, double p[3]) {
    p[0] = between(counter, -3.0 - margin, 3.0 + margin);
    p[1] = between(counter, -0.5 - margin, 2.0 + margin);
    p[2] = between(counter, -3.0 - margin, 3.0 + margin);
}

static float level_value(const vsh_field *field, int32_t level, const double p[3]) {
    const vshi_vec at = vshi_to_field(field, p);
    const float f[3] = {(float)at.x, (float)at.y, (float)at.z};
    return vshi_level_sample(field, level, f, NULL);
}

/* Errors of one level, in its voxels. */
typedef struct level_errors {
    size_t count, wrong_signs; /* in the band; at all */
    double worst, rms;         /* in the band */
    double too_long;           /* by how much a value beyond it claims more than the truth */
} level_errors;

static level_errors measure(const vsh_field *field, int32_t level, truth_scene scene, const double center[3],
                            double radius, size_t tries) {
    const vshi_level *l = &field->levels[level];
    const double voxel = (double)l->scale * field->voxel_size;
    level_errors e = {0};
    uint64_t counter = (uint64_t)level;
    for (size_t i = 0; i < tries; ++i) {
        double p[3];
        for (int axis = 0; axis < 3; ++axis) {
            p[axis] = center[axis] + between(&counter, -radius, radius);
        }
        if (under_the_post(p)) {
            continue;
        }
        const double truth = truth_distance(scene, p) / voxel;
        const double value = (double)level_value(field, level, p) / (double)l->scale;
        const double band = (double)l->band / (double)l->scale;
        if (fabs(truth) >= band) {
            e.too_long = fmax(e.too_long, value > 0.0 ? value - truth : truth - value);
        } else {
            ++e.count;
            e.worst = fmax(e.worst, fabs(value - truth));
            e.rms += (value - truth) * (value - truth);
        }
        e.wrong_signs += fabs(truth) > 0.87 && (value < 0.0) != (truth < 0.0);
    }
    e.rms = sqrt(e.rms / (double)(e.count > 0 ? e.count : 1));
    return e;
}

TEST(each_level_is_within_a_cell_of_the_truth_in_its_band_and_at_thin_parts) {
    OWNED(vsh_field) *field = seeds_field(5.0);
    static const struct {
        double center[3], radius, rms;
        size_t tries, least;
        int32_t levels;
    } parts[] = {{{0.0, 0.75, 0.0}, 3.2, 0.1, 2000000, 50000, 6},
                 {{1.2, 0.6, -0.3}, 0.6, 0.15, 300000, 10000, 3},
                 {{0.3, 1.4, 1.5}, 0.6, 0.15, 300000, 10000, 3}};
    assert_int_equal(field->level_count, 6);
    for (size_t part = 0; part < COUNT_OF(parts); ++part) {
        for (int32_t l = 0; l < parts[part].levels; ++l) {
            const double radius =
                parts[part].radius + (part == 0 ? (double)field->levels[l].band * VOXEL : 0.0);
            const level_errors e =
                measure(field, l, truth_seeds(), parts[part].center, radius, parts[part].tries);
            assert_true(e.count > parts[part].least && e.rms < parts[part].rms);
            assert_true(e.worst <= 0.87 && e.too_long <= 0.87);
            assert_int_equal(e.wrong_signs, 0);
        }
    }
}

/* World size of a voxel of the level that a sampled distance comes from. */
static double resolving_voxel(const vsh_field *field, double distance) {
    int32_t l = 0;
    while (l + 1 < field->level_count &&
           fabs(distance) >= (double)(field->levels[l].band - VSHI_BAND_EDGE * field->levels[l].scale) *
                                 field->voxel_size) {
        ++l;
    }
    return (double)field->levels[l].scale * field->voxel_size;
}

static double resolved_distance(const vsh_field *field, const double p[3]) {
    const vshi_vec at = vshi_to_field(field, p);
    const float f[3] = {(float)at.x, (float)at.y, (float)at.z};
    return (double)vshi_field_distance(field, f) * field->voxel_size;
}

TEST(sampled_distances_are_within_a_voxel_of_the_level_that_resolves_them) {
    const truth_scene scene = truth_seeds();
    OWNED(vsh_field) *field = seeds_field(5.0);
    uint64_t counter = 7;
    double worst = 0.0;
    for (int i = 0; i < 1000000; ++i) {
        double p[3];
        random_point(&counter, i % 2 ? 0.2 : 2.0, p);
        if (under_the_post(p)) {
            continue;
        }
        const double h = resolved_distance(field, p);
        const double truth = truth_distance(scene, p);
        const double voxel = resolving_voxel(field, h);
        worst = fmax(worst, fabs(h - truth) / voxel);
        /* only the finest voxels are wider than the distance that they measure */
        assert_true(voxel <= VOXEL || voxel <= fabs(h));
    }
    assert_at_most(worst, 0.87);
}

/* Callers march by these distances. */
TEST(beyond_the_finest_band_distances_are_lower_bounds) {
    const truth_solid solids[] = {{TRUTH_SPHERE, {0.01, 0.02, 0.03}, {0.0, 0.0, 0.0}, 1.0, 0.0},
                                  {TRUTH_TORUS, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 1.0, 0.4},
                                  {TRUTH_BOX, {0.0, 0.0, 0.0}, {0.7, 0.4, 1.1}, 0.0, 0.0}};
    for (int n = 0; n < 3; ++n) {
        const truth_scene scene = {&solids[n], 1};
        OWNED(vsh_field) *field = field_of(scene, VOXEL, 1000.0 * VOXEL);
        uint64_t counter = 7;
        double beyond = -INFINITY, within = -INFINITY, least = 1.0;
        for (int i = 0; i < 100000; ++i) {
            const double most = i % 2 ? 1000.0 * VOXEL / sqrt(3.0) : 3.0;
            double p[3];
            for (int axis = 0; axis < 3; ++axis) {
                p[axis] = between(&counter, -most, most);
            }
            const float h = distance_at(field, p);
            const double truth = truth_distance(scene, p);
            const double excess = (truth < 0.0 ? truth - (double)h : (double)h - truth) / VOXEL;
            if (fabs(truth) > 3.0 * VOXEL) {
                beyond = fmax(beyond, excess);
                least = truth > 0.0 ? fmin(least, (double)h / truth) : least;
            } else {
                within = fmax(within, excess);
            }
        }
        assert_at_most(beyond, 0.0);
        assert_true(n == 2 || within <= 0.1); /* a trilinear sample cuts a box's edges off */
        assert_true(least >= 0.6);
    }
}

TEST(beyond_the_reach_distances_are_lower_bounds) {
    const truth_scene scene = truth_seeds();
    OWNED(vsh_field) *field = seeds_field(0.5);
    const vshi_level *top = &field->levels[field->level_count - 1];
    const double band = (double)top->band * VOXEL;
    assert_true(band >= 0.5 && band < 1.0);
    uint64_t counter = 11;
    size_t beyond = 0;
    for (int i = 0; i < 300000; ++i) {
        double p[3];
        random_point(&counter, i % 2 ? 3.0 : 100.0, p);
        const float h = distance_at(field, p);
        const double truth = truth_distance(scene, p);
        if (truth > band + sqrt(3.0) * (double)top->scale * VOXEL) { /* no corner of the cell is nearer */
            assert_true((double)h <= band && (double)h > band - (double)top->scale * VOXEL);
            ++beyond;
        }
    }
    assert_true(beyond > 100000);
}

TEST(a_field_has_only_the_levels_that_the_reach_needs) {
    /* bands: 3 voxels of the grid, then 6 of each coarser level */
    const struct {
        double voxels; /* reach */
        int32_t levels;
    } cases[] = {
        {1e-9, 1},  {3.0, 1},  {3.01, 2}, {12.0, 2},  {12.01, 3},  {24.0, 3},
        {24.01, 4}, {48.0, 4}, {96.0, 5}, {192.0, 6}, {192.01, 7},
    };
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
        OWNED(vsh_field) *field = seeds_field(cases[i].voxels * VOXEL);
        const vsh_field_info info = field_info(field);
        assert_int_equal(info.levels, cases[i].levels);
        assert_true(info.reach >= cases[i].voxels * VOXEL - 1e-6);
    }
    /* the default is four diagonals */
    OWNED(vsh_field) *field = field_of((truth_scene){&BALL, 1}, 0.1, 0.0);
    const double diagonals = 4.0 * sqrt(12.0), reach = field_info(field).reach;
    assert_true(reach >= diagonals && reach < 2.5 * diagonals);
}

TEST(signs_hold_deep_inside_big_solids_and_far_outside) {
    const truth_solid solids[] = {{TRUTH_SPHERE, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 2.0, 0.0},
                                  {TRUTH_BOX, {6.0, 0.0, 0.0}, {1.5, 2.5, 3.5}, 0.0, 0.0},
                                  {TRUTH_BOX, {0.0, -4.0, 0.0}, {4.0, 0.04, 4.0}, 0.0, 0.0}};
    const truth_scene scene = {solids, 3};
    for (int reach = 0; reach < 3; ++reach) {
        OWNED(vsh_field) *field = field_of(scene, VOXEL, reach == 0 ? 0.01 : reach == 1 ? 0.3 : 0.0);
        uint64_t counter = 3;
        size_t inside = 0;
        for (int i = 0; i < 400000; ++i) {
            const double p[3] = {between(&counter, -5.0, 9.0), between(&counter, -6.0, 5.0),
                                 between(&counter, -5.0, 5.0)};
            const double truth = truth_distance(scene, p);
            const float h = distance_at(field, p);
            if (fabs(truth) > 0.5 * VOXEL) {
                assert_int_equal(h < 0.0f, truth < 0.0);
            }
            inside += truth < -0.5;
            for (int32_t l = 0; l < field->level_count; ++l) {
                if (fabs(truth) > 0.87 * (double)field->levels[l].scale * VOXEL) {
                    assert_int_equal(level_value(field, l, p) < 0.0f, truth < 0.0);
                }
            }
        }
        assert_true(inside > 10000);
    }
}

TEST(positions_that_are_not_finite_give_nan_and_far_ones_do_not) {
    OWNED(vsh_field) *field = seeds_field(1.0);
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY},
                 far[] = {1e6, -1e9, 1e15, 1e30, -1e60, 1e300};
    const double reach = field_info(field).reach;
    for (int axis = 0; axis < 3; ++axis) {
        for (int i = 0; i < 3; ++i) {
            double p[6] = {0.0, 0.5, 0.0, 0.0, 2.0, 0.0};
            p[axis] = bad[i];
            float h[2] = {0.0f, 0.0f};
            vsh_field_sample(field, 2, p, h);
            assert_true(isnan(h[0]) && h[1] > 0.5f); /* which does not touch the other points of the call */
        }
        for (int i = 0; i < 6; ++i) {
            double p[3] = {0.0, 0.5, 0.0};
            p[axis] = far[i];
            const double h = (double)distance_at(field, p);
            assert_true(h <= reach && h > 0.8 * reach);
        }
    }
    vsh_field_sample(field, 0, NULL, NULL);
}

TEST(a_fields_info_has_the_solids_box_and_voxel) {
    OWNED(vsh_field) *field = seeds_field(1.0);
    const vsh_field_info info = field_info(field);
    const double low[3] = {-3.0, -0.5, -3.0}, high[3] = {3.0, 2.0, 3.0};
    assert_near(info.voxel_size, VOXEL, 1e-12);
    for (int axis = 0; axis < 3; ++axis) {
        assert_near(info.bounds_min[axis], low[axis], 2.0 * VOXEL);
        assert_near(info.bounds_max[axis], high[axis], 2.0 * VOXEL);
    }
    assert_true(info.shell_thickness == 0.0);
}

/* Against the grid's own floats, which it was made from. */
TEST(values_are_rounded_by_no_more_than_half_a_quantum) {
    const double half_widths[] = {3.0, 4.7, 6.0, 20.0};
    for (int h = 0; h < 4; ++h) {
        vsh_sdf_node node = vsh_sdf_node_default();
        node.radius = 1.0;
        const vsh_sdf sdf = {&node, 1};
        vsh_grid_options options = with_voxel(VOXEL);
        options.half_width = half_widths[h];
        OWNED(vsh_grid) *grid = NULL;
        OWNED(vsh_field) *field = NULL;
        assert_ok(vsh_grid_from_sdf(&sdf, &options, NULL, &grid, &failure));
        assert_ok(vshi_field_create(grid, NULL, NULL, &field, &failure));
        const size_t count = vshi_grid_leaves(grid, NULL, 0);
        FREED vshi_leaf *leaves = malloc(count * sizeof *leaves);
        vshi_grid_leaves(grid, leaves, count);
        const vshi_level *finest = &field->levels[0];
        double worst = 0.0;
        for (size_t i = 0; i < count * 512; ++i) {
            const int v = (int)(i % 512);
            const int32_t *o = leaves[i / 512].origin;
            const float p[3] = {(float)(o[0] + v / 64), (float)(o[1] + v / 8 % 8), (float)(o[2] + v % 8)};
            const double exact = (double)leaves[i / 512].values[v] / VOXEL;
            const double stored = (double)vshi_level_sample(field, 0, p, NULL);
            if (fabs(exact) < (double)finest->band) {
                worst = fmax(worst, fabs(stored - exact));
            } else {
                assert_true(fabs(stored) == (double)finest->band && (stored < 0.0) == (exact < 0.0));
            }
        }
        assert_true(worst <= (double)finest->rounding + 1e-6); /* of the float to voxels */
        assert_true(worst > 0.9 * (double)finest->rounding);
        for (int32_t l = 0; l < field->level_count; ++l) {
            assert_true(field->levels[l].rounding < 2.5e-4f * field->levels[l].scale);
        }
    }
}

TEST(a_voxel_takes_no_more_than_eighteen_bytes) {
    const double voxels[] = {0.04, 0.02, 0.01};
    for (int i = 0; i < 3; ++i) {
        OWNED(vsh_field) *field = field_of(truth_seeds(), voxels[i], 0.0);
        const vsh_field_info info = field_info(field);
        const double each = (double)info.bytes / (double)info.active_voxels;
        assert_true(each > 2.0 && each <= 18.0);
    }
}

/* --- making */

TEST(the_memory_limit_covers_every_level) {
    OWNED(vsh_grid) *grid = grid_of(truth_seeds(), VOXEL);
    OWNED(vsh_field) *made = seeds_field(0.0), *field = NULL;
    const uint64_t need = grid_info(grid).bytes + field_info(made).bytes,
                   limits[] = {1000, need - 1, 1u << 30};
    for (int i = 0; i < 3; ++i) {
        const vsh_run run = run_within(limits[i]);
        assert_fails(vshi_field_create(grid, NULL, &run, &field, &failure), i < 2 ? VSH_ERROR_LIMIT : VSH_OK,
                     "memory limit");
        assert_true((field == NULL) == (i < 2));
    }
}

TEST(options_and_runs_are_checked) {
    OWNED(vsh_grid) *grid = grid_of((truth_scene){&BALL, 1}, 0.1);
    vsh_field *field = NULL;
    const double reaches[] = {-1.0, (double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 4; ++i) {
        vshi_field_options options = vshi_field_options_default();
        options.reach = reaches[i];
        assert_fails(vshi_field_create(grid, &options, NULL, &field, &failure), VSH_ERROR_ARGUMENT, "reach");
        assert_null(field);
    }
    /* the last ends within a member: half a pointer would be called */
    const size_t sizes[] = {0, sizeof(size_t), sizeof(vsh_run) + 8, SIZE_MAX,
                            offsetof(vsh_run, progress) + 2};
    for (int i = 0; i < 5; ++i) {
        vsh_run run = vsh_run_default();
        run.struct_size = sizes[i];
        assert_fails(vshi_field_create(grid, NULL, &run, &field, &failure), VSH_ERROR_ARGUMENT, "vsh_run");
    }
    for (int i = 0; i < 2; ++i) {
        const vsh_run run = run_on(i == 0 ? -1 : 1025);
        assert_fails(vshi_field_create(grid, NULL, &run, &field, &failure), VSH_ERROR_ARGUMENT, "");
    }
}

/* A reach beyond anything must not make levels without end. */
TEST(a_huge_reach_is_refused_or_met) {
    OWNED(vsh_grid) *grid = grid_of((truth_scene){&BALL, 1}, 0.1);
    const double reaches[] = {1e3, 1e6, 1e12, 1e300};
    for (int i = 0; i < 4; ++i) {
        vshi_field_options options = vshi_field_options_default();
        options.reach = reaches[i];
        OWNED(vsh_field) *field = NULL;
        const vsh_result result = vshi_field_create(grid, &options, NULL, &field, NULL);
        assert_true(result == VSH_OK || result == VSH_ERROR_LIMIT || result == VSH_ERROR_ARGUMENT);
        if (result == VSH_OK) {
            const vsh_field_info info = field_info(field);
            assert_at_most(info.levels, VSHI_MAX_LEVELS);
            assert_true(info.reach >= reaches[i] || info.levels == VSHI_MAX_LEVELS);
            const double far[3] = {0.5 * fmin(reaches[i], 1e12), 0.0, 0.0}, centre[3] = {0.0, 0.0, 0.0};
            assert_near((double)distance_at(field, far), far[0] - 1.0, 0.2 * far[0]);
            assert_less(distance_at(field, centre), -0.8f);
        }
    }
}
