/* What must hold between two bakes where no truth is needed: scaled, moved, turned and mirrored scenes, of
 * every method. docs/accuracy.md has the bounds. test_monotone.c has more of the voxels, of the rays and of
 * the casters; test_bits.c and test_field_run.c: threads do not show. */
#include "methods.h"
#include "testing.h"

#include "field/field.h"
#include "levelset/access.h"

enum { SIDE = 64, COUNT = SIDE * SIDE, VALUES = SHADOWS + KINDS };

static const double NOWHERE[3] = {0.0, 0.0, 0.0};
static double positions[3 * COUNT];
static float normals[3 * COUNT];

/* Floor texels, and every third point in the air or inside a solid with any normal. */
static void fill_points(void) {
    uint64_t counter = 21;
    floor_texels(SIDE, positions, normals);
    for (size_t i = 0; i < COUNT; i += 3) {
        double n[3];
        random_direction(&counter, n);
        for (size_t axis = 0; axis < 3; ++axis) {
            positions[3 * i + axis] = axis == 1 ? between(&counter, -1.0, 3.0) : between(&counter, -4.0, 4.0);
            normals[3 * i + axis] = (float)n[axis];
        }
    }
}

/* Every kind of value at the points: shadows of a sun and of a lamp by each method, and AO. `scale` is that
 * of all lengths; the lights are given in the scene's own axes through `turn` (rows) and moved by `by`. */

typedef struct values {
    float v[VALUES][COUNT];
} values;

typedef struct motion {
    double scale;
    double turn[9];
    double by[3]; /* after the turn, before the scale */
} motion;

static const motion STILL = {1.0, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};

static void turned(const motion *m, const double v[3], double out[3]) {
    for (int row = 0; row < 3; ++row) {
        out[row] = m->turn[3 * row] * v[0] + m->turn[3 * row + 1] * v[1] + m->turn[3 * row + 2] * v[2];
    }
}

static void moved(const motion *m, const double p[3], double out[3]) {
    turned(m, p, out);
    for (int axis = 0; axis < 3; ++axis) {
        out[axis] = m->scale * (out[axis] + m->by[axis]);
    }
}

/* Of value k: every shadow of the sun, then every kind of that of the lamp and AO. */
static int kind_of(int k) {
    return k < SHADOWS ? k : k - SHADOWS;
}

static void shade_all(const casting *c, const motion *m, values *all) {
    static double places[3 * COUNT];
    static float ns[3 * COUNT];
    for (size_t i = 0; i < COUNT; ++i) {
        double n[3] = {(double)normals[3 * i], (double)normals[3 * i + 1], (double)normals[3 * i + 2]}, t[3];
        moved(m, positions + 3 * i, places + 3 * i);
        turned(m, n, t);
        for (size_t axis = 0; axis < 3; ++axis) {
            ns[3 * i + axis] = (float)t[axis];
        }
    }
    const double over[3] = {1.0, 1.5, 1.0};
    double towards[3], place[3];
    turned(m, truth_seeds_sun, towards);
    moved(m, over, place);
    const vsh_light lights[2] = {sun(towards, 0.2), lamp(place, 0.25 * m->scale)};
    memset(all, 0, sizeof *all);
    for (int k = 0; k < VALUES; ++k) {
        cast_kind(c, kind_of(k), &lights[k >= SHADOWS], 0.75 * m->scale, COUNT, places, ns, all->v[k]);
    }
}

/* How far two sets of values are apart. */
typedef struct apart {
    double rms, worst;
    size_t beyond; /* values more than 0.01 apart */
} apart;

static apart compare(const float *a, const float *b) {
    apart result = {0.0, 0.0, 0};
    for (size_t i = 0; i < COUNT; ++i) {
        assert_int_equal(isnan(a[i]) != 0, isnan(b[i]) != 0);
        const double d = isnan(a[i]) ? 0.0 : fabs((double)a[i] - (double)b[i]);
        result.rms += d * d;
        result.worst = fmax(result.worst, d);
        result.beyond += d > 0.01;
    }
    result.rms = sqrt(result.rms / COUNT);
    return result;
}

static void assert_same_field(const vsh_field *a, const vsh_field *b) {
    assert_int_equal(a->level_count, b->level_count);
    assert_memory_equal(a->levels, b->levels, sizeof a->levels[0] * (size_t)a->level_count);
    const vshi_level *top = &a->levels[a->level_count - 1];
    const size_t blocks =
        (size_t)top->first_index + (size_t)top->size[0] * (size_t)top->size[1] * (size_t)top->size[2];
    assert_memory_equal(a->index, b->index, blocks * sizeof a->index[0]);
    assert_int_equal(a->value_count, b->value_count);
    assert_memory_equal(a->values, b->values, (size_t)a->value_count * sizeof *a->values);
}

/* From 1e-10 to 1e10 of the voxel: the field's values are voxels, and only they are shaded. */
TEST(scaled_by_a_power_of_two_every_bit_stays) {
    static values still, scaled;
    fill_points();
    FREED_BY(caster_free) casting c = caster_of_moved(truth_seeds(), 0.03125, 1.0, NOWHERE, 8.0);
    shade_all(&c, &STILL, &still);
    const int exponents[] = {-34, -20, -10, 3, 20, 40, 44};
    for (size_t e = 0; e < sizeof exponents / sizeof exponents[0]; ++e) {
        motion m = STILL;
        m.scale = ldexp(1.0, exponents[e]);
        if (0.03125 * m.scale > 1e12) {
            continue;
        }
        FREED_BY(caster_free)
        casting other = caster_of_moved(truth_seeds(), 0.03125, m.scale, NOWHERE, 8.0 * m.scale);
        assert_same_field(c.field, other.field);
        shade_all(&other, &m, &scaled);
        for (int k = 0; k < VALUES; ++k) {
            assert_that(memcmp(still.v[k], scaled.v[k], sizeof still.v[k]) == 0,
                        "scaled by 2^%d: other bits of %s", exponents[e], name_of(kind_of(k)));
        }
    }
}

/* A box and a pyramid without its base, of floats that any power of two scales exactly. */
static vsh_grid *grid_of_meshes(double scale, double half_width, bool open) {
    static const float box[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                    {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    static const uint32_t sides[12][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                          {3, 6, 2}, {3, 7, 6}, {0, 4, 7}, {0, 7, 3}, {1, 2, 6}, {1, 6, 5}};
    static const float roof[5][3] = {
        {-0.7f, 1.3f, -0.8f}, {0.9f, 1.4f, -0.6f}, {0.8f, 1.3f, 0.7f}, {-0.9f, 1.2f, 0.6f}, {0.1f, 2, 0.05f}};
    static const uint32_t slopes[4][3] = {{0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}};
    float p[8][3], q[5][3];
    for (int i = 0; i < 24; ++i) {
        (&p[0][0])[i] = (float)scale * (&box[0][0])[i];
        (&q[0][0])[i % 15] = (float)scale * (&roof[0][0])[i % 15];
    }
    const vsh_mesh meshes[2] = {{.name = "box",
                                 .positions = &p[0][0],
                                 .indices = &sides[0][0],
                                 .vertex_count = 8,
                                 .triangle_count = 12},
                                {.name = "roof",
                                 .positions = &q[0][0],
                                 .indices = &slopes[0][0],
                                 .vertex_count = 5,
                                 .triangle_count = 4}};
    vsh_grid_options options = vsh_grid_options_default();
    options.voxel_size = 0.0625 * scale;
    options.half_width = half_width;
    vsh_grid *grid = NULL;
    assert_that(vsh_grid_from_meshes(meshes, open ? 2 : 1, &options, NULL, &grid, &failure) == VSH_OK,
                "scale %g: %s", scale, failure.message);
    return grid;
}

/* A ball taken as it is, and a box on another lattice, turned and measured anew. */
static vsh_grid *grid_of_union(double scale) {
    vsh_sdf_node nodes[2] = {vsh_sdf_node_default(), vsh_sdf_node_default()};
    vsh_grid *parts[2] = {NULL, NULL}, *both = NULL;
    nodes[1].shape = VSH_SDF_BOX;
    for (int i = 0; i < 2; ++i) {
        const vsh_sdf sdf = {&nodes[i], 1};
        vsh_grid_options options = vsh_grid_options_default();
        nodes[i].scale = scale;
        options.voxel_size = ldexp(scale, i == 0 ? -4 : -3);
        assert_int_equal(vsh_grid_from_sdf(&sdf, &options, NULL, &parts[i], NULL), VSH_OK);
    }
    const double place[12] = {0.6, -0.8, 0, 1.3 * scale, 0.8, 0.6, 0, 0.2 * scale, 0, 0, 1, -0.1 * scale};
    const vsh_grid_instance instances[2] = {{parts[0], NULL}, {parts[1], place}};
    assert_int_equal(vsh_grid_unite(instances, 2, NULL, NULL, &both, NULL), VSH_OK);
    vsh_grid_free(parts[0]);
    vsh_grid_free(parts[1]);
    return both;
}

TEST(meshes_and_unions_scaled_by_a_power_of_two_keep_every_bit) {
    static const struct {
        double half_width; /* of meshes; 0: a union */
        bool open;
        int exponents[6];
    } cases[] = {{3.0, false, {-35, -20, -12, 5, 20, 43}},
                 {9.0, false, {-35, -20, -12, 5, 20, 43}},
                 {3.0, true, {-35, -20, -12, 5, 20, 43}},
                 {9.0, true, {-35, -20, -12, 5, 20, 43}},
                 {0.0, false, {-35, -20, 20, 42}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        OWNED(vsh_field) *field = NULL;
        for (int e = -1; e < 6; ++e) {
            const double scale = e < 0 ? 1.0 : ldexp(1.0, cases[i].exponents[e]);
            vsh_field *scaled = field_of_grid(cases[i].half_width > 0.0
                                                  ? grid_of_meshes(scale, cases[i].half_width, cases[i].open)
                                                  : grid_of_union(scale),
                                              4.0 * scale);
            field = field != NULL ? field : scaled;
            assert_same_field(field, scaled);
            if (e >= 0) {
                vsh_field_free(scaled);
            }
        }
    }
}

/* Of all kinds, between the scene where it is and the same moved. Voxels are of 2^-5 and places of few
 * digits, so that moving itself rounds nothing. */
static apart apart_when_moved(const double voxels[3]) {
    static values still, there;
    fill_points();
    for (size_t i = 0; i < 3 * COUNT; ++i) {
        positions[i] = ldexp(round(ldexp(positions[i], 20)), -20);
    }
    casting c = caster_of_moved(truth_seeds(), 0.03125, 1.0, NOWHERE, 8.0);
    shade_all(&c, &STILL, &still);
    caster_free(&c);
    motion m = STILL;
    for (int axis = 0; axis < 3; ++axis) {
        m.by[axis] = 0.03125 * voxels[axis];
    }
    c = caster_of_moved(truth_seeds(), 0.03125, 1.0, m.by, 8.0);
    shade_all(&c, &m, &there);
    caster_free(&c);
    apart all = {0.0, 0.0, 0};
    for (int k = 0; k < VALUES; ++k) {
        const apart a = compare(still.v[k], there.v[k]);
        all.worst = fmax(all.worst, a.worst);
        all.rms = fmax(all.rms, a.rms);
        all.beyond += a.beyond;
    }
    return all;
}

TEST(moved_by_whole_voxels_every_bit_stays) {
    const double voxels[][3] = {{1, 0, 0}, {-3, 5, 7}, {8, 16, -24}, {1001, -2003, 4007}, {32e6, -16e6, 8e6}};
    for (size_t s = 0; s < sizeof voxels / sizeof voxels[0]; ++s) {
        assert_true(apart_when_moved(voxels[s]).worst == 0.0);
    }
}

/* The seeds' solids turned by a signed permutation of the axes: their boxes go along, their torus around y
 * only where y stays y, so the ring is a ball here. */
static casting caster_of_turned(const motion *m, double voxel) {
    truth_solid solids[MAX_SOLIDS];
    const truth_scene scene = truth_seeds();
    for (size_t i = 0; i < scene.count; ++i) {
        double half[3];
        solids[i] = scene.solids[i];
        if (solids[i].shape == TRUTH_TORUS) {
            solids[i].shape = TRUTH_SPHERE;
        }
        turned(m, scene.solids[i].center, solids[i].center);
        turned(m, scene.solids[i].half, half);
        for (int axis = 0; axis < 3; ++axis) {
            solids[i].half[axis] = fabs(half[axis]);
        }
    }
    return caster_of((truth_scene){solids, scene.count}, voxel, 8.0);
}

TEST(turned_by_right_angles_and_mirrored_values_stay_within_a_bound) {
    static values still, there;
    static const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    fill_points();
    FREED_BY(caster_free) casting c = caster_of_turned(&STILL, 0.04);
    shade_all(&c, &STILL, &still);
    apart worst[VALUES] = {{0.0, 0.0, 0}};
    for (int turn = 1; turn < 48; turn += 2 + turn % 3) {
        motion m = STILL;
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                m.turn[3 * row + column] =
                    orders[turn / 8][row] == column ? ((turn >> row & 1) ? -1.0 : 1.0) : 0.0;
            }
        }
        casting other = caster_of_turned(&m, 0.04);
        shade_all(&other, &m, &there);
        caster_free(&other);
        for (int k = 0; k < VALUES; ++k) {
            const apart a = compare(still.v[k], there.v[k]);
            worst[k].rms = fmax(worst[k].rms, a.rms);
            worst[k].worst = fmax(worst[k].worst, a.worst);
            worst[k].beyond = a.beyond > worst[k].beyond ? a.beyond : worst[k].beyond;
        }
    }
    for (int k = 0; k < VALUES; ++k) {
        const int kind = kind_of(k);
        if (is_ao(kind) ? kind > SHADOWS + VSH_AO_TAPS : kind >= VSH_SHADOW_RAYS) {
            /* where rays and cones lie in the disc or hemisphere does not turn with the scene */
            assert_true(worst[k].rms < 0.03);
        } else {
            assert_true(worst[k].rms < 1e-4 && worst[k].worst < 2e-3 && worst[k].beyond == 0);
        }
    }
}
