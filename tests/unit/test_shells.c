/* Solids that touch, lie in each other or share faces, and values that are no distances. docs/accuracy.md has
 * the bounds; test_csg.c has bounds that become distances. */
#include "testing.h"
#include "traced.h"

#include "field/field.h"
#include "truth/metrics.h"

static const double VOXEL = 0.0625;

static casting caster_of_boxes(const double (*corners)[2][3], int count, double voxel) {
    float places[4][24];
    vsh_mesh meshes[4];
    for (int i = 0; i < count; ++i) {
        meshes[i] = box_mesh(places[i], corners[i][0], corners[i][1]);
    }
    const vsh_grid_options options = with_voxel(voxel);
    vsh_grid *grid = NULL;
    vsh_triangles *triangles = NULL;
    assert_that(vsh_grid_from_meshes(meshes, (size_t)count, &options, NULL, &grid, &failure) == VSH_OK &&
                    vsh_triangles_create(meshes, (size_t)count, NULL, &triangles, &failure) == VSH_OK,
                "%s", failure.message);
    return (casting){field_of_grid(grid, 0.0), triangles};
}

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
enum { ACROSS = 64, SHADOWS = SHADOW_METHODS, KINDS = SHADOWS + AO_METHODS };

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
        if (kind < SHADOWS) {
            cast_shadows(c, &light, kind, ACROSS, at, ns, r->v[kind]);
        } else
            cast_ao(c, kind - SHADOWS, 2.0, ACROSS, at, ns, r->v[kind]);
    }
}

TEST(meshes_that_touch_nest_or_coincide_are_one_solid) {
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
    static row one, other;
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; ++c) {
        FREED_BY(caster_free) casting made = caster_of_boxes(cases[c].corners, cases[c].count, VOXEL);
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

static double stretched_ball(void *user, const double p[3]) {
    const double *factor = user;
    return *factor * (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - 0.7);
}

TEST(fields_that_are_not_1_lipschitz_are_right_where_they_say_so) {
    enum { COUNT = 41 };
    const truth_solid ball = {TRUTH_SPHERE, {0, 0, 0}, {0, 0, 0}, 0.7, 0.0};
    const double up[3] = {0.0, 1.0, 0.0}, w = 0.1;
    const vsh_light light = sun(up, 2.0 * atan(w));
    float truth[COUNT], visible[COUNT], truth_open[COUNT], open[COUNT], normals[3 * COUNT];
    double positions[3 * COUNT];
    for (int i = 0; i < COUNT; ++i) {
        const double p[3] = {0.03 * i, -2.0, 0.01};
        const float n[3] = {0.0f, 1.0f, 0.0f};
        memcpy(positions + 3 * i, p, sizeof p);
        memcpy(normals + 3 * i, n, sizeof n);
        truth_open[i] = (float)truth_ao((truth_scene){&ball, 1}, p, up, 3.0, 4096);
    }
    const double nowhere[3] = {0.0, 0.0, 0.0};
    OWNED(vsh_triangles) *triangles = triangles_of_moved((truth_scene){&ball, 1}, 1.0, nowhere);
    assert_int_equal(
        truth_lights((truth_scene){&ball, 1}, COUNT, positions, NULL, up, w, (double)INFINITY, 4096, truth),
        0);
    double factors[] = {1.0, 2.0, 0.5, 20.0, 0.05};
    for (int exact = 0; exact < 2; ++exact) {
        for (int f = 0; f < 5; ++f) {
            const vsh_distance field = {stretched_ball, &factors[f],        factors[f],
                                        exact,          {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}};
            const vsh_grid_options options = with_voxel(0.04);
            vsh_grid *grid = NULL;
            assert_ok(vsh_grid_from_distance(&field, &options, NULL, &grid, &failure));
            const casting made = {field_of_grid(grid, 0.0), triangles};
            for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
                const vsh_shade_stats stats =
                    cast_shadows(&made, &light, method, COUNT, positions, NULL, visible);
                assert_int_equal(stats.unfinished, 0);
                const truth_metrics m = truth_compare(COUNT, visible, truth, NULL);
                if (method == VSH_SHADOW_CONE) {
                    /* who says that values are distances, and they are not, is only kept from a crash */
                    assert_true((exact && f > 0) || m.rmse < 0.015);
                }
                for (int i = 0; i < COUNT; ++i) {
                    assert_true(visible[i] >= 0.0f && visible[i] <= 1.0f);
                }
            }
            for (int32_t method = 0; method < AO_METHODS; ++method) {
                cast_ao(&made, method, 3.0, COUNT, positions, normals, open);
                const truth_metrics m = truth_compare(COUNT, open, truth_open, NULL);
                /* cones' own bias, and the error that rays keep, twice */
                assert_true(exact || method == VSH_AO_TAPS || m.rmse < 0.04);
                for (int i = 0; i < COUNT; ++i) {
                    assert_true(open[i] >= 0.0f && open[i] <= 1.0f);
                }
            }
            vsh_field_free(made.field);
        }
    }
}
