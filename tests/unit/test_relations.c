/* Relations between bakes, by every method. Scaled, moved, turned and mirrored scenes have the same
 * values. Finer voxels and more rays are not farther from the truth, a caster that grows hides no less, and a
 * lamp that goes away becomes a sun. docs/accuracy.md has the bounds. test_bits.c has threads. */
#include "testing.h"
#include "traced.h"

#include "field/field.h"
#include "levelset/access.h"
#include "truth/metrics.h"

enum { SIDE = 64, COUNT = SIDE * SIDE, VALUES = SHADOW_METHODS + KINDS };

static const double NOWHERE[3] = {0.0, 0.0, 0.0};
static double positions[3 * COUNT];
static float normals[3 * COUNT];

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
    return k < SHADOW_METHODS ? k : k - SHADOW_METHODS;
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
        cast_kind(c, kind_of(k), &lights[k >= SHADOW_METHODS], 0.75 * m->scale, COUNT, places, ns, all->v[k]);
    }
}

/* Differences of two sets of values. */
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
    scattered_texels(SIDE, 21, positions, normals);
    FREED_BY(caster_free) casting c = caster_of_moved(truth_seeds(), 0.03125, 1.0, NOWHERE, 8.0);
    shade_all(&c, &STILL, &still);
    const int exponents[] = {-34, -20, -10, 3, 20, 40, 44};
    for (size_t e = 0; e < COUNT_OF(exponents); ++e) {
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
    static const float roof[15] = {-0.7f, 1.3f,  -0.8f, 0.9f, 1.4f, -0.6f, 0.8f, 1.3f,
                                   0.7f,  -0.9f, 1.2f,  0.6f, 0.1f, 2,     0.05f};
    static const uint32_t slopes[4][3] = {{0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}};
    float p[24], q[15];
    for (int i = 0; i < 15; ++i) {
        q[i] = (float)scale * roof[i];
    }
    const double low[3] = {-scale, -scale, -scale}, high[3] = {scale, scale, scale};
    const vsh_mesh meshes[2] = {box_mesh(p, low, high), mesh_of_arrays("roof", q, NULL, 5, slopes[0], 4)};
    vsh_grid_options options = with_voxel(0.0625 * scale);
    options.half_width = half_width;
    vsh_grid *grid = NULL;
    assert_that(vsh_grid_from_meshes(meshes, open ? 2 : 1, &options, NULL, &grid, &failure) == VSH_OK,
                "scale %g: %s", scale, failure.message);
    return grid;
}

/* A ball taken as it is, and a box on another lattice, turned and measured anew. */
static vsh_grid *grid_of_union(double scale) {
    vsh_sdf_node nodes[2] = {vsh_sdf_node_default(), vsh_sdf_node_default()};
    vsh_grid *parts[2], *both = NULL;
    nodes[1].shape = VSH_SDF_BOX;
    for (int i = 0; i < 2; ++i) {
        nodes[i].scale = scale;
        parts[i] = grid_of_tree(&nodes[i], 1, with_voxel(ldexp(scale, i == 0 ? -4 : -3)));
    }
    const double place[12] = {0.6, -0.8, 0, 1.3 * scale, 0.8, 0.6, 0, 0.2 * scale, 0, 0, 1, -0.1 * scale};
    const vsh_grid_instance instances[2] = {{parts[0], NULL}, {parts[1], place}};
    assert_ok(vsh_grid_unite(instances, 2, NULL, NULL, &both, &failure));
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
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
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
                vshi_field_free(scaled);
            }
        }
    }
}

/* Compares the scene with the same scene moved. Voxels are of 2^-5 and places of few digits, so that moving
 * rounds no place. */
static void move(const double voxels[3], apart all[VALUES]) {
    static values still, there;
    scattered_texels(SIDE, 21, positions, normals);
    for (size_t i = 0; i < 3 * COUNT; ++i) {
        positions[i] = ldexp(round(ldexp(positions[i], 16)), -16);
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
    for (int k = 0; k < VALUES; ++k) {
        all[k] = compare(still.v[k], there.v[k]);
    }
}

/* Farther away, doubles round the solids' places to 1e-4 voxels. A value of `hard` is 0 or 1: one of 4096
 * gives an rms of 0.0156. */
TEST(moved_by_whole_voxels_every_bit_stays_and_far_away_the_picture) {
    const double voxels[][3] = {{1, 0, 0},           {-3, 5, 7},         {8, 16, -24},
                                {1001, -2003, 4007}, {32e6, -16e6, 8e6}, {9.6e11, 0.0, -3.2e11}};
    apart all[VALUES];
    for (size_t s = 0; s < COUNT_OF(voxels); ++s) {
        const bool far = s + 1 == COUNT_OF(voxels);
        move(voxels[s], all);
        for (int k = 0; k < VALUES; ++k) {
            const int kind = kind_of(k);
            const bool whole = kind == VSH_SHADOW_HARD || by_rays(kind);
            if (far && k == SHADOW_METHODS + VSH_SHADOW_IMPROVED) {
                continue; /* under a lamp, it sometimes takes two samples for one surface */
            }
            assert_true(all[k].rms <= (!far ? 0.0 : kind == VSH_SHADOW_HARD ? 0.016 : whole ? 5e-3 : 1e-4));
            assert_true(whole || all[k].worst <= (far ? 2e-3 : 0.0));
        }
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
    scattered_texels(SIDE, 21, positions, normals);
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
        if (is_ao(kind) ? kind > SHADOW_METHODS + VSH_AO_TAPS : kind >= VSH_SHADOW_RAYS) {
            /* where rays and cones lie in the disc or hemisphere does not turn with the scene */
            assert_true(worst[k].rms < 0.03);
        } else {
            assert_true(worst[k].rms < 1e-4 && worst[k].worst < 2e-3 && worst[k].beyond == 0);
        }
    }
}

/* --- changes that go one way only */

static float outside[COUNT], truth[COUNT], shaded[COUNT];

static void place_floor(void) {
    floor_texels(SIDE, positions, normals);
    for (size_t i = 0; i < COUNT; ++i) {
        outside[i] = truth_distance(truth_seeds(), positions + 3 * i) > 0.0 ? 1.0f : 0.0f;
    }
}

static void true_shadows(double w) {
    const double up[3] = {0.0, 1.0, 0.0};
    assert_int_equal(truth_lights(truth_seeds(), COUNT, positions, up, truth_seeds_sun, w, (double)INFINITY,
                                  w > 0.0 ? 256 : 1, truth),
                     0);
}

static const double AO_DISTANCE = 0.75;

static void true_ao(void) {
    const double up[3] = {0.0, 1.0, 0.0};
    for (size_t i = 0; i < COUNT; ++i) {
        truth[i] = (float)truth_ao(truth_seeds(), positions + 3 * i, up, AO_DISTANCE, 512);
    }
}

enum { WIDTHS = 4, VOXELS = 5, CASES = WIDTHS * SHADOW_METHODS + VSH_AO_EXACT + 1 };

static const double ws[WIDTHS] = {0.0, 0.05, 0.1, 0.3}, voxels[VOXELS] = {0.16, 0.08, 0.04, 0.02, 0.01};
/* Shadows by each width of light and method, then AO; NAN for methods that are not here. */
static double rmse[CASES][VOXELS];

/* Measures methods that know the whole penumbra. Errors of the others come from their definitions. */
static void measure_all_voxels(void) {
    place_floor();
    for (int v = 0; v < VOXELS; ++v) {
        FREED_BY(caster_free) casting c = caster_of(truth_seeds(), voxels[v], 0.0);
        for (int k = 0; k < CASES; ++k) {
            const bool ao = k >= WIDTHS * SHADOW_METHODS;
            const int w = k / SHADOW_METHODS,
                      kind = ao ? k - WIDTHS * SHADOW_METHODS + SHADOW_METHODS : k % SHADOW_METHODS;
            rmse[k][v] = (double)NAN;
            if (ao ? k == WIDTHS * SHADOW_METHODS : kind == 0) {
                ao ? true_ao() : true_shadows(ws[w]);
            }
            if (!ao && kind < VSH_SHADOW_SMOOTH) {
                continue;
            }
            const vsh_light light = sun(truth_seeds_sun, ao ? 0.0 : 2.0 * atan(ws[w]));
            cast_kind(&c, kind, &light, AO_DISTANCE, COUNT, positions, normals, shaded);
            rmse[k][v] = truth_compare(COUNT, shaded, truth, outside).rmse;
            assert_true(isfinite(rmse[k][v]));
        }
    }
}

/* Whether the voxels make all of the error: rays take the rest of it, and one cone what a narrow light sees.
 */
static bool errors_are_of_voxels(int k) {
    if (k >= WIDTHS * SHADOW_METHODS) {
        const int32_t method = k - WIDTHS * SHADOW_METHODS;
        return method == VSH_AO_RAYS || method == VSH_AO_ADAPTIVE;
    }
    const int32_t method = k % SHADOW_METHODS;
    return method == VSH_SHADOW_RAYS || method == VSH_SHADOW_ADAPTIVE ||
           (method != VSH_SHADOW_EXACT && k < (WIDTHS - 1) * SHADOW_METHODS);
}

/* An error of the method itself, not of the voxels, wanders by 8 % of itself and 0.002, a fortieth of a
 * penumbra. Exact depends on voxels only where cones prove something. Rays at fine voxels keep the requested
 * error. */
TEST(finer_voxels_are_never_farther_from_the_truth) {
    measure_all_voxels();
    for (int k = 0; k < CASES; ++k) {
        for (int v = 1; v < VOXELS; ++v) {
            const double coarse = rmse[k][v - 1], fine = rmse[k][v];
            const bool measured = !isnan(fine);
            assert_that(
                !measured || ((!errors_are_of_voxels(k) || fine <= coarse) && fine < 1.08 * coarse + 0.002),
                "case %d: rmse %.5f at voxel %g, %.5f at %g", k, fine, voxels[v], coarse, voxels[v - 1]);
        }
        const bool rays =
            k >= SHADOW_METHODS && k < WIDTHS * SHADOW_METHODS && k % SHADOW_METHODS >= VSH_SHADOW_RAYS;
        assert_true(!rays || rmse[k][VOXELS - 1] < 0.02);
    }
}

/* Each step has four times the rays, or half of the requested error. */
TEST(more_rays_are_never_farther_from_the_truth) {
    place_floor();
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.02, 0.0);
    const vsh_light light = sun(truth_seeds_sun, 2.0 * atan(0.1));
    const vsh_points points = {COUNT, positions, normals, NULL};
    true_shadows(0.1);
    for (int kind = VSH_SHADOW_RAYS; kind < KINDS; ++kind) {
        if (kind == SHADOW_METHODS) {
            true_ao();
            kind = SHADOW_METHODS + VSH_AO_RAYS;
        }
        double last = 1.0;
        for (int step = 0; step < 4; ++step) {
            vsh_shade_options options = preview_options();
            const bool rays = kind == VSH_SHADOW_RAYS || kind == SHADOW_METHODS + VSH_AO_RAYS;
            options.ao_distance = AO_DISTANCE;
            options.rays = rays ? 4 << (2 * step) : 1024;
            options.max_error = 0.08 / (1 << step);
            shade_kind(&c, kind, &light, options, &points, shaded);
            const truth_metrics m = truth_compare(COUNT, shaded, truth, outside);
            assert_true(m.rmse < last);
            last = m.rmse;
        }
    }
}

/* The largest rise of a value while the caster grows. Rays have fixed places: one of 64 may come free by the
 * field's error. Adaptive and exact stop anywhere within an error of 0.02: two of their values may be three
 * times √2 of it apart. Triangulation takes two samples for one surface. Taps add up five samples, whose
 * levels are right to a part of their own voxels. */
static double rise_of(int kind) {
    return kind == VSH_SHADOW_IMPROVED                                       ? 0.05
           : kind == VSH_SHADOW_PRACTICAL                                    ? 1.5e-3
           : kind == VSH_SHADOW_RAYS || kind == SHADOW_METHODS + VSH_AO_RAYS ? 1.1 / 64.0
           : kind >= SHADOW_METHODS + VSH_AO_ADAPTIVE                        ? 3.0 * 1.4143 * 0.02
           : kind >= VSH_SHADOW_ADAPTIVE && !is_ao(kind)                     ? 3.0 * 1.4143 * 0.02
           : kind == SHADOW_METHODS + VSH_AO_TAPS                            ? 5e-3
           : is_ao(kind)                                                     ? 2e-3
                                                                             : 1e-3;
}

/* A slab that grows from a sliver over half of the receivers to all of them, by less than a voxel a time. */
TEST(a_growing_slab_hides_more) {
    enum { PLACES = 16 };
    const double up[3] = {0.0, 1.0, 0.0}, voxel = 0.04;
    const vsh_light light = sun(up, RADIANS(15.0));
    float last[KINDS][PLACES], first[KINDS][PLACES], v[PLACES];
    float fallen[KINDS] = {0.0f}, rise[KINDS] = {0.0f};
    double at[3 * PLACES];
    float ns[3 * PLACES];
    for (int i = 0; i < PLACES; ++i) {
        put_point(at, ns, (size_t)i, 0.09 * i, -1.5, 0.05 * i);
    }
    bool begun = false;
    for (double half = 0.05; half < 1.2; half += 0.3 * voxel) {
        const truth_solid slab = {TRUTH_BOX, {0.0, 0.2, 0.0}, {half, 0.2, half}, 0.0, 0.0};
        FREED_BY(caster_free) casting c = caster_of((truth_scene){&slab, 1}, voxel, 0.0);
        for (int kind = 0; kind < KINDS; ++kind) {
            cast_kind(&c, kind, &light, 4.0, PLACES, at, is_ao(kind) ? ns : NULL, v);
            for (int i = 0; i < PLACES; ++i) {
                if (begun) {
                    rise[kind] = fmaxf(rise[kind], v[i] - last[kind][i]);
                    fallen[kind] = fmaxf(fallen[kind], first[kind][i] - v[i]);
                } else {
                    first[kind][i] = v[i];
                }
                last[kind][i] = v[i];
            }
        }
        begun = true;
    }
    for (int kind = 0; kind < KINDS; ++kind) {
        assert_true((double)rise[kind] <= rise_of(kind));
        /* or nothing was tested; taps sample along the normal only */
        assert_true(fallen[kind] > 0.05f);
    }
}

/* A million units away: what is left of it is the rounding of its direction. */
TEST(a_far_lamp_shades_like_a_sun) {
    static float far[COUNT];
    place_floor();
    FREED_BY(caster_free) casting c = caster_of(truth_seeds(), 0.04, 0.0);
    const double half = atan(truth_seeds_w), away = 1e6;
    double place[3];
    go_along(NOWHERE, away / length3(truth_seeds_sun), truth_seeds_sun, place);
    const vsh_light s = sun(truth_seeds_sun, 2.0 * half);
    vsh_light l = lamp(place, away * sin(half));
    strcpy(l.name, s.name); /* the name chooses the rays of a light */
    for (int32_t method = 0; method < SHADOW_METHODS; ++method) {
        cast_shadows(&c, &s, method, COUNT, positions, normals, shaded);
        cast_shadows(&c, &l, method, COUNT, positions, normals, far);
        const truth_metrics m = truth_compare(COUNT, far, shaded, NULL);
        /* a texel of a quarter of a million is one ray, or one edge, that rounds to the other side */
        assert_true(m.rmse < 1e-3 && (method > VSH_SHADOW_CONE || m.max <= 1e-3));
    }
}
