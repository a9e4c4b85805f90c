/* Ambient occlusion by every method, against closed forms and ray-traced truth. */
#include "testing.h"
#include "traced.h"
#include "truth/metrics.h"

enum { TEXELS = 1500 };

static const float UP[3] = {0.0f, 1.0f, 0.0f};
static const double NORMAL[3] = {0.0, 1.0, 0.0};

static vsh_shade_options options_of(int32_t method, int32_t rays, double distance) {
    vsh_shade_options options = preview_options();
    options.ao_method = method;
    options.rays = rays;
    options.ao_distance = distance;
    return options;
}

static vsh_shade_stats shade(const vsh_occluders *casters, const vsh_shade_options *options, size_t count,
                             const double *positions, const float *normals, float *ao, float *deviation) {
    const vsh_points points = {count, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_ao(casters, &points, options, NULL, ao, deviation, NULL, &stats, &failure));
    return stats;
}

/* By so many cones; 0: by taps. */
static double ao_at(const vsh_field *field, int32_t cones, double distance, const double position[3]) {
    vsh_shade_options options = options_of(cones > 0 ? VSH_AO_CONES : VSH_AO_TAPS, 64, distance);
    options.ao_cones = cones > 0 ? cones : 1;
    float ao = -1.0f;
    shade(occluders_of(field), &options, 1, position, UP, &ao, NULL);
    return (double)ao;
}

/* Points of a floor that look up, and what they see. */
typedef struct places {
    double positions[3 * TEXELS];
    float normals[3 * TEXELS], truth[TEXELS];
} places;

/* Only where nothing stands on the floor, `clear` around. */
static void place_on_floor(places *p, truth_scene scene, double y, double clear, size_t rays) {
    uint64_t counter = 11;
    for (size_t i = 0; i < TEXELS;) {
        const double x = between(&counter, -2.4, 2.4), z = between(&counter, -2.4, 2.4);
        const double at[3] = {x, y, z}, over[3] = {x, fmax(y, 1e-5), z}, above[3] = {x, clear, z};
        if (truth_distance(scene, above) >= 0.9 * clear) {
            memcpy(p->positions + 3 * i, at, sizeof at);
            memcpy(p->normals + 3 * i, UP, sizeof UP);
            p->truth[i++] = (float)truth_ao(scene, over, NORMAL, 1.0, rays);
        }
    }
}

typedef struct stage {
    places p;
    vsh_field *field;
} stage;

/* The floor of the seeds' scene, at least a voxel from the casters. The cones' table was not fitted to this
 * scene. */
static const stage *seeds(void) {
    static stage s;
    if (s.field == NULL) {
        s.field = field_of(truth_seeds(), 0.02, 0.0);
        place_on_floor(&s.p, truth_seeds(), 0.001, 0.02, 2048);
    }
    return &s;
}

static vsh_shade_stats shade_seeds(const vsh_shade_options *options, float *ao, float *deviation) {
    const stage *s = seeds();
    return shade(occluders_of(s->field), options, TEXELS, s->p.positions, s->p.normals, ao, deviation);
}

/* --- every method */

TEST(an_open_plate_is_exactly_1) {
    enum { COUNT = 100 };
    const truth_solid plate = {TRUTH_BOX, {0.0, -0.517, 0.0}, {4.0, 0.517, 4.0}, 0.0, 0.0};
    FREED_BY(caster_free) casting c = caster_of((truth_scene){&plate, 1}, 0.04, 0.0);
    double positions[3 * COUNT];
    float normals[3 * COUNT], ao[COUNT];
    uint64_t counter = 1;
    for (int i = 0; i < COUNT; ++i) {
        const double p[3] = {between(&counter, -4.0, 4.0), i % 2 ? 0.0 : 1e-3, between(&counter, -4.0, 4.0)};
        memcpy(positions + 3 * i, p, sizeof p);
        memcpy(normals + 3 * i, UP, sizeof UP);
    }
    for (double distance = 0.1; distance < 30.0; distance *= 3.0) {
        for (int32_t method = 0; method < AO_METHODS; ++method) {
            for (int32_t kind = 1; kind <= 64; kind += kind < 16 ? 1 : 16) {
                vsh_shade_options options = options_of(method, 64, distance);
                options.ao_cones = kind;
                options.sampler = kind % (VSH_SAMPLER_BLUE + 1);
                shade(occluders_of_caster(&c), &options, COUNT, positions, normals, ao, NULL);
                for (int i = 0; i < COUNT; ++i) {
                    if (ao[i] != 1.0f) {
                        fail_msg("method %d, %d, distance %g, (%g, %g, %g): %.9g", method, kind, distance,
                                 positions[3 * i], positions[3 * i + 1], positions[3 * i + 2], (double)ao[i]);
                    }
                }
            }
        }
    }
}

TEST(bad_points_are_nan_and_counted_and_others_are_not_touched) {
    enum { COUNT = 7 };
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.1, 0.0);
    const float nan = (float)NAN, inf = INFINITY;
    const double positions[3 * COUNT] = {0, 0.001, 2,     NAN, 0, 0,     0, INFINITY, 0,     0, 0.001,
                                         2, 0,     0.001, 2,   0, 0.001, 2, 0,        0.001, 2};
    const float normals[3 * COUNT] = {0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, nan, 0, 2, inf, 0, 2.5f, 0};
    for (int32_t method = VSH_AO_TAPS; method <= VSH_AO_ADAPTIVE; ++method) {
        const vsh_shade_options options = options_of(method, 16, 1.0);
        float ao[COUNT], deviation[COUNT];
        const vsh_shade_stats stats =
            shade(occluders_of(field), &options, COUNT, positions, normals, ao, deviation);
        assert_int_equal(stats.invalid, 5);
        for (int i = 0; i < COUNT; ++i) {
            const bool bad = i != 0 && i != 6;
            assert_int_equal(isnan(ao[i]) != 0, bad);
            assert_int_equal(isnan(deviation[i]) != 0, bad || method < VSH_AO_RAYS);
        }
        /* normals of any length; other points have other rays */
        assert_true(method >= VSH_AO_RAYS || bits_of(ao[0]) == bits_of(ao[6]));
    }
}

TEST(options_out_of_range_are_named_and_no_points_need_no_normals) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.2, 1.0);
    const double p[3] = {0.0, 0.001, 2.0};
    const struct {
        int32_t cones;
        double distance;
        int32_t method;
        const char *part;
    } cases[] = {{0, 1.0, VSH_AO_CONES, "ao_cones"},         {-1, 1.0, VSH_AO_CONES, "ao_cones"},
                 {257, 1.0, VSH_AO_CONES, "ao_cones"},       {1, 0.0, VSH_AO_CONES, "ao_distance"},
                 {1, -1.0, VSH_AO_CONES, "ao_distance"},     {1, NAN, VSH_AO_CONES, "ao_distance"},
                 {1, INFINITY, VSH_AO_CONES, "ao_distance"}, {1, 1.0, VSH_AO_AUTO + 1, "ao_method"},
                 {1, 1.0, VSH_AO_EXACT, "triangles"}};
    float ao = -1.0f, bent[3];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        vsh_shade_options options = options_of(cases[i].method, 64, cases[i].distance);
        options.ao_cones = cases[i].cones;
        const vsh_points points = {1, p, UP, NULL};
        assert_fails(
            vsh_shade_ao(occluders_of(field), &points, &options, NULL, &ao, NULL, NULL, NULL, &failure),
            VSH_ERROR_ARGUMENT, cases[i].part);
    }
    for (int i = 0; i < 4; ++i) {
        const vsh_points bare = {i / 2, i < 2 ? NULL : p, NULL, NULL};
        float *const direction = i % 2 ? bent : NULL;
        assert_fails(
            vsh_shade_ao(occluders_of(field), &bare, NULL, NULL, &ao, NULL, direction, NULL, &failure),
            i < 2 ? VSH_OK : VSH_ERROR_ARGUMENT, "normals");
    }
    assert_true(ao == -1.0f);
}

/* --- cones and taps */

TEST(a_wall_hides_half_of_the_sky_from_its_foot) {
    const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0},
                                  {TRUTH_BOX, {-1.0, 1.0, 0.0}, {1.0, 2.0, 3.0}, 0.0, 0.0}};
    OWNED(vsh_field) *field = field_of((truth_scene){solids, 2}, 0.02, 0.0);
    for (double away = 0.01; away < 0.05; away += 0.01) {
        for (int32_t cones = 8; cones <= 64; cones *= 2) {
            assert_near(ao_at(field, cones, 1.0, (const double[]){away, 0.001, 0.1}), 0.5, 0.06);
        }
    }
}

/* Over points around a sphere that rests on a plate, or hovers over it; nearer to the foot of the resting one
 * the cleft is lower than a voxel. */
TEST(under_a_sphere_ao_is_near_the_truth) {
    const double heights[] = {0.5, 0.8, 1.2};
    for (int i = 0; i < 3; ++i) {
        const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.25, 0.0}, {3.0, 0.25, 3.0}, 0.0, 0.0},
                                      {TRUTH_SPHERE, {0.0, heights[i], 0.0}, {0.0, 0.0, 0.0}, 0.5, 0.0}};
        const truth_scene scene = {solids, 2};
        OWNED(vsh_field) *field = field_of(scene, 0.02, 0.0);
        double worst[2] = {0.0};
        for (double x = 0.18; x < 2.0; x += 0.06) {
            for (double distance = 0.5; distance < 3.0; distance *= 2.0) {
                const double p[3] = {x * 0.8, 0.001, x * 0.6};
                const double truth = truth_ao(scene, p, NORMAL, distance, 4096);
                for (int fine = 0; fine < 2; ++fine) {
                    worst[fine] = fmax(worst[fine], fabs(ao_at(field, fine ? 64 : 16, distance, p) - truth));
                }
            }
        }
        assert_true(worst[0] < 0.06 && worst[1] < 0.06);
    }
}

/* A cone's ball at its end reaches farther than its centre by the sine of its half angle; the taps ask for
 * twice the distance along the normal. */
TEST(what_is_beyond_the_distance_hides_nothing) {
    const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.25, 0.0}, {3.0, 0.25, 3.0}, 0.0, 0.0},
                                  {TRUTH_BOX, {0.0, 1.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0}};
    OWNED(vsh_field) *field = field_of((truth_scene){solids, 2}, 0.04, 0.0); /* a ceiling, 1 over the floor */
    const double p[3] = {0.1, 0.0, 0.2};
    for (int32_t cones = 1; cones <= 64; cones *= 2) {
        const double sine = fmin(sqrt(0.5), sqrt(1.0 - (1.0 - 1.0 / cones) * (1.0 - 1.0 / cones)));
        assert_true(ao_at(field, cones, 0.95 / (1.0 + sine), p) == 1.0);
        assert_less(ao_at(field, cones, 3.0, p), 0.5);
    }
    assert_true(ao_at(field, 0, 0.4, p) == 1.0);
    assert_less(ao_at(field, 0, 1.0, p), 1.0);
}

/* Means over the floor of the room of hollow_box(), and the brightest point of it. No cone finds a wall deep
 * that is thinner than it is wide, but none finds it open either. */
TEST(a_closed_room_is_dark) {
    static const struct {
        double wall, mean[2], brightest[2]; /* by 16 cones, and by 64 */
    } cases[] = {{0.1, {0.12, 0.03}, {1.0, 1.0}},
                 {0.2, {0.02, 0.001}, {1.0, 1.0}},
                 {0.5, {0.001, 0.001}, {1.0, 1.0}},
                 {2.0, {0.001, 0.001}, {0.05, 0.01}}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
        OWNED(vsh_field) *field = hollow_box(0.04, cases[i].wall);
        for (int fine = 0; fine < 2; ++fine) {
            uint64_t counter = 2;
            double mean = 0.0, brightest = 0.0;
            for (int k = 0; k < 200; ++k) {
                const double x = between(&counter, -0.95, 0.95), z = between(&counter, -0.95, 0.95);
                const double ao = ao_at(field, fine ? 64 : 16, 10.0, (const double[]){x, -0.999, z});
                mean += 0.005 * ao;
                brightest = fmax(brightest, ao);
            }
            assert_true(mean < cases[i].mean[fine] && brightest < cases[i].brightest[fine]);
        }
    }
}

TEST(on_the_seeds_floor_cones_are_near_the_truth) {
    static const int32_t cones[] = {4, 8, 16, 64};
    static const double bounds[][2] = {{0.042, 0.011}, {0.027, 0.008}, {0.018, 0.005}, {0.007, 0.003}};
    static float ao[TEXELS];
    for (int n = 0; n < 4; ++n) {
        vsh_shade_options options = options_of(VSH_AO_CONES, 64, 1.0);
        options.ao_cones = cones[n];
        shade_seeds(&options, ao, NULL);
        const truth_metrics m = truth_compare(TEXELS, ao, seeds()->p.truth, NULL);
        assert_true(m.rmse < bounds[n][0] && fabs(m.bias) < bounds[n][1]);
    }
}

TEST(farther_distances_hide_more) {
    OWNED(vsh_field) *field = field_of(truth_seeds(), 0.04, 0.0);
    uint64_t counter = 3;
    double rise = 0.0;
    for (int i = 0; i < 200; ++i) {
        const double p[3] = {between(&counter, -2.5, 2.5), 0.001, between(&counter, -2.5, 2.5)};
        double last = 1.0;
        for (double distance = 0.1; distance < 10.0; distance *= 1.3) {
            const double ao = ao_at(field, 16, distance, p);
            rise = fmax(rise, ao - last);
            last = ao;
        }
    }
    assert_at_most(rise, 3e-3); /* samples of a longer cone fall elsewhere */
}

/* --- rays */

TEST(more_rays_come_nearer_to_the_truth) {
    static const double bounds[3][3] = {{0.045, 0.018, 0.0085}, {0.066, 0.033, 0.017}, {0.052, 0.022, 0.011}};
    static float ao[TEXELS];
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        for (int step = 0; step < 3; ++step) {
            vsh_shade_options options = options_of(VSH_AO_RAYS, 16 << (2 * step), 1.0);
            options.sampler = sampler;
            shade_seeds(&options, ao, NULL);
            const truth_metrics m = truth_compare(TEXELS, ao, seeds()->p.truth, NULL);
            assert_less(m.rmse, bounds[sampler][step]);
            /* best candidates crowd the disc's rim */
            assert_true(fabs(m.bias) < (sampler == VSH_SAMPLER_BLUE ? 0.025 : 0.004));
        }
    }
}

/* Frames are independent: the mean of four of them is nearer than each. */
TEST(frames_may_be_averaged) {
    static float ao[TEXELS], mean[TEXELS];
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        double single = 0.0;
        memset(mean, 0, sizeof mean);
        for (int32_t f = 0; f < 4; ++f) {
            vsh_shade_options options = options_of(VSH_AO_RAYS, 16, 1.0);
            options.sampler = sampler;
            options.frame = f;
            shade_seeds(&options, ao, NULL);
            single += 0.25 * truth_compare(TEXELS, ao, seeds()->p.truth, NULL).rmse;
            for (size_t i = 0; i < TEXELS; ++i) {
                mean[i] += 0.25f * ao[i];
            }
        }
        const double averaged = truth_compare(TEXELS, mean, seeds()->p.truth, NULL).rmse;
        /* a turned copy of the same points is less than another set */
        assert_true(averaged < (sampler == VSH_SAMPLER_BLUE ? 0.9 : 0.6) * single);
    }
}

TEST(rays_that_agree_early_end_a_point) {
    static float all[TEXELS], early[TEXELS];
    vsh_shade_options options = options_of(VSH_AO_RAYS, 64, 1.0);
    const vsh_shade_stats full = shade_seeds(&options, all, NULL);
    options.early_rays = 16;
    const vsh_shade_stats less = shade_seeds(&options, early, NULL);
    assert_less(less.marches, full.marches);
    assert_less(fabs(truth_compare(TEXELS, early, all, NULL).bias), 0.006);
    for (size_t i = 0; i < TEXELS; ++i) {
        /* the other points take all rays, the same ones */
        assert_true(early[i] == all[i] || early[i] == 0.0f || early[i] == 1.0f);
    }
}

/* A slatted roof over a floor: nothing but convex edges, which trilinear samples cut. Rays must see
 * through it to a hundredth. */
TEST(edges_hide_as_much_as_their_casters) {
    enum { SLATS = 7, COUNT = 40 };
    truth_solid slats[SLATS];
    for (int i = 0; i < SLATS; ++i) {
        slats[i] = (truth_solid){TRUTH_BOX, {0.4 * (i - 3), 0.6, 0.0}, {0.1, 0.1, 1.5}, 0.0, 0.0};
    }
    const truth_scene scene = {slats, SLATS};
    double positions[3 * COUNT] = {0.0};
    float normals[3 * COUNT], open[COUNT], expected[COUNT];
    for (int i = 0; i < COUNT; ++i) {
        positions[3 * i] = -0.8 + 0.04 * i;
        positions[3 * i + 2] = 0.013 * i - 0.2;
        memcpy(normals + 3 * i, UP, sizeof UP);
        expected[i] = (float)truth_ao(scene, positions + 3 * i, NORMAL, 1.0, 4096);
    }
    OWNED(vsh_field) *field = field_of(scene, 0.06, 0.0);
    const vsh_shade_options options = options_of(VSH_AO_RAYS, 1024, 1.0);
    shade(occluders_of(field), &options, COUNT, positions, normals, open, NULL);
    const truth_metrics m = truth_compare(COUNT, open, expected, NULL);
    assert_less(fabs(m.bias), 0.01);
}

/* --- rays until an error is reached */

/* Shades until the error asked for is reached. Checks that the true error is at most the estimate, and the
 * estimate at most the error asked for. */
static vsh_shade_stats shade_until(const vsh_occluders *casters, const places *p, const float *truth,
                                   const vsh_shade_options *options) {
    static float ao[TEXELS], deviation[TEXELS];
    const vsh_shade_stats stats = shade(casters, options, TEXELS, p->positions, p->normals, ao, deviation);
    const truth_metrics m = truth_compare(TEXELS, ao, truth, NULL);
    double said = 0.0;
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true(deviation[i] >= 0.0f);
        assert_true(options->ao_method == VSH_AO_EXACT ||
                    (double)deviation[i] <= options->max_error * 1.000001);
        said += (double)deviation[i] * (double)deviation[i];
    }
    assert_true(m.rmse <= 1.1 * sqrt(said / TEXELS) && sqrt(said / TEXELS) <= options->max_error);
    assert_true(fabs(m.bias) < (options->sampler == VSH_SAMPLER_BLUE ? 0.5 : 0.25) * options->max_error);
    assert_less(fabs(stats.square_error - said), 1e-4 * said + 1e-9);
    return stats;
}

static const double ERRORS[] = {0.05, 0.02, 0.01};

/* Against many rays on the same field. */
TEST(adaptive_leaves_the_error_that_was_asked_for_and_said) {
    const stage *s = seeds();
    static float truth[TEXELS];
    const vsh_shade_options many = options_of(VSH_AO_RAYS, 4096, 1.0);
    shade_seeds(&many, truth, NULL);
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        uint64_t last = 0;
        for (int e = 0; e < 3; ++e) {
            vsh_shade_options options = options_of(VSH_AO_ADAPTIVE, 4096, 1.0);
            options.max_error = ERRORS[e];
            options.sampler = sampler;
            const vsh_shade_stats stats = shade_until(occluders_of(s->field), &s->p, truth, &options);
            assert_true(stats.marches > last);
            last = stats.marches;
        }
    }
}

/* A floor, a wall, a slat an eighth of a voxel thick, a post and a box. */
TEST(exact_leaves_the_error_that_was_asked_for_and_said) {
    static const truth_solid solids[] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0},
                                         {TRUTH_BOX, {-1.5, 0.8, 0.0}, {0.2, 0.8, 2.0}, 0.0, 0.0},
                                         {TRUTH_BOX, {0.0, 0.6, 0.0}, {0.5, 0.0025, 2.0}, 0.0, 0.0},
                                         {TRUTH_BOX, {0.5, 1.0, 1.0}, {0.04, 1.0, 0.04}, 0.0, 0.0},
                                         {TRUTH_BOX, {1.4, 0.3, -0.6}, {0.3, 0.3, 0.5}, 0.0, 0.0}};
    static places p;
    const truth_scene scene = {solids, sizeof solids / sizeof solids[0]};
    FREED_BY(caster_free) casting c = caster_of(scene, 0.04, 0.0);
    place_on_floor(&p, scene, 0.0, 1e-3, 4096);
    for (int e = 0; e < 3; ++e) {
        vsh_shade_options options = options_of(VSH_AO_EXACT, 4096, 1.0);
        options.max_error = ERRORS[e];
        assert_int_equal(shade_until(occluders_of_caster(&c), &p, p.truth, &options).marches, 0);
    }
}

TEST(rays_end_the_refinement_where_the_error_does_not) {
    static float ao[TEXELS], same[TEXELS], deviation[TEXELS];
    vsh_shade_options options = options_of(VSH_AO_ADAPTIVE, 24, 1.0);
    options.max_error = 1e-4;
    assert_int_equal(shade_seeds(&options, ao, deviation).refined, TEXELS);
    options.ao_method = VSH_AO_RAYS;
    shade_seeds(&options, same, NULL);
    assert_memory_equal(ao, same, sizeof ao);
    for (size_t i = 0; i < TEXELS; ++i) {
        assert_true((double)deviation[i] > 1e-4);
    }
}
