/* Ambient occlusion by every method, against closed forms and ray-traced truth. test_claims.c has the error
 * that `exact` keeps, test_ranges.c bad options. */
#include "traced.h"
#include "truth/directions.h"
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
    return shade_ao_points(casters, &points, options, NULL, ao, deviation);
}

/* AO of a point by `cones` cones; 0: by taps. */
static double ao_at(const vsh_field *field, int32_t cones, double distance, const double position[3]) {
    vsh_shade_options options = options_of(cones > 0 ? VSH_AO_CONES : VSH_AO_TAPS, 64, distance);
    options.ao_cones = cones > 0 ? cones : 1;
    float ao = -1.0f;
    shade(occluders_of(field), &options, 1, position, UP, &ao, NULL);
    return (double)ao;
}

/* Points on the floor of the seeds' scene, at least a voxel from the casters. The cones' table was not fitted
 * to this scene. */
static const struct stage {
    double positions[3 * TEXELS];
    float normals[3 * TEXELS], truth[TEXELS];
    vsh_field *field;
} * seeds(void) {
    static struct stage s;
    uint64_t counter = 11;
    for (size_t i = 0; s.field == NULL && i < TEXELS;) {
        const double x = between(&counter, -2.4, 2.4), z = between(&counter, -2.4, 2.4);
        const double at[3] = {x, 0.001, z}, above[3] = {x, 0.02, z};
        if (truth_distance(truth_seeds(), above) >= 0.018) {
            memcpy(s.positions + 3 * i, at, sizeof at);
            memcpy(s.normals + 3 * i, UP, sizeof UP);
            s.truth[i++] = (float)truth_ao(truth_seeds(), at, NORMAL, 1.0, 2048);
        }
    }
    s.field = s.field != NULL ? s.field : field_of(truth_seeds(), 0.02, 0.0);
    return &s;
}

static vsh_shade_stats shade_seeds(const vsh_shade_options *options, float *ao, float *deviation) {
    const struct stage *s = seeds();
    return shade(occluders_of(s->field), options, TEXELS, s->positions, s->normals, ao, deviation);
}

static truth_metrics compare_seeds(const float *ao) {
    return truth_compare(TEXELS, ao, seeds()->truth, NULL);
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
        const double x = between(&counter, -4.0, 4.0), z = between(&counter, -4.0, 4.0);
        put_point(positions, normals, (size_t)i, x, i % 2 ? 0.0 : 1e-3, z);
    }
    for (double distance = 0.1; distance < 30.0; distance *= 3.0) {
        for (int32_t method = 0; method < AO_METHODS; ++method) {
            for (int32_t kind = 1; kind <= 64; kind += kind < 16 ? 1 : 16) {
                vsh_shade_options options = options_of(method, 64, distance);
                options.ao_cones = kind;
                options.sampler = kind % (VSH_SAMPLER_BLUE + 1);
                shade(occluders_of_caster(&c), &options, COUNT, positions, normals, ao, NULL);
                for (int i = 0; i < COUNT; ++i) {
                    assert_that(ao[i] == 1.0f, "method %d, %d, distance %g, point %d: %.9g", method, kind,
                                distance, i, (double)ao[i]);
                }
            }
        }
    }
}

/* --- cones and taps */

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
TEST(casters_beyond_the_distance_hide_nothing) {
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
    for (size_t i = 0; i < COUNT_OF(cases); ++i) {
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
        const truth_metrics m = compare_seeds(ao);
        assert_true(m.rmse < bounds[n][0] && fabs(m.bias) < bounds[n][1]);
    }
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
            const truth_metrics m = compare_seeds(ao);
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
            single += 0.25 * compare_seeds(ao).rmse;
            for (size_t i = 0; i < TEXELS; ++i) {
                mean[i] += 0.25f * ao[i];
            }
        }
        const double averaged = compare_seeds(mean).rmse;
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

/* Against many rays on the same field: the true error is at most the reported one, which is at most the one
 * asked for. */
TEST(adaptive_keeps_the_requested_error_and_reports_it) {
    static const double errors[] = {0.05, 0.02, 0.01};
    static float truth[TEXELS], ao[TEXELS], deviation[TEXELS];
    const vsh_shade_options many = options_of(VSH_AO_RAYS, 4096, 1.0);
    shade_seeds(&many, truth, NULL);
    for (int32_t sampler = VSH_SAMPLER_SOBOL; sampler <= VSH_SAMPLER_BLUE; ++sampler) {
        uint64_t last = 0;
        for (int e = 0; e < 3; ++e) {
            vsh_shade_options options = options_of(VSH_AO_ADAPTIVE, 4096, 1.0);
            options.max_error = errors[e];
            options.sampler = sampler;
            const vsh_shade_stats stats = shade_seeds(&options, ao, deviation);
            double sum = 0.0;
            for (size_t i = 0; i < TEXELS; ++i) {
                assert_true(deviation[i] >= 0.0f && (double)deviation[i] <= errors[e] * 1.000001);
                sum += (double)deviation[i] * (double)deviation[i];
            }
            const truth_metrics m = truth_compare(TEXELS, ao, truth, NULL);
            assert_true(m.rmse <= 1.1 * sqrt(sum / TEXELS) && sqrt(sum / TEXELS) <= errors[e]);
            assert_true(fabs(m.bias) < (sampler == VSH_SAMPLER_BLUE ? 0.5 : 0.25) * errors[e]);
            assert_less(fabs(stats.square_error - sum), 1e-4 * sum + 1e-9);
            assert_true(stats.marches > last);
            last = stats.marches;
        }
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

/* --- AO over a horizon: the share of the directions over it that is free */

enum { POINTS = 240, RAYS = 8192 };

static const truth_solid WALLS[] = {{TRUTH_BOX, {0.0, -0.5, 0.0}, {3.0, 0.5, 3.0}, 0.0, 0.0},
                                    {TRUTH_BOX, {-1.5, 0.8, 0.0}, {0.2, 0.8, 2.0}, 0.0, 0.0},
                                    {TRUTH_BOX, {1.4, 1.1, -0.6}, {0.6, 0.3, 0.5}, 0.0, 0.0}};
static const truth_scene SCENE = {WALLS, 3};
static const double FAR = 20.0;

static float over_truth(const double position[3], const float *n, const double up[3]) {
    const truth_frame frame = truth_frame_around((double[]){n[0], n[1], n[2]});
    size_t over = 0, open = 0;
    for (size_t ray = 0; ray < RAYS; ++ray) {
        double d[3];
        truth_cosine_direction(&frame, ray, RAYS, d);
        if (d[0] * up[0] + d[1] * up[1] + d[2] * up[2] > 0.0) {
            ++over;
            open += !truth_hit(SCENE, position, d, FAR);
        }
    }
    return over > 0 ? (float)open / (float)over : 1.0f;
}

TEST(ao_over_a_horizon_is_the_free_share_of_the_directions_over_it) {
    static const double ups[2][3] = {{0.0, 1.0, 0.0}, {0.48, -0.6, 0.64}};
    static const int32_t methods[] = {VSH_AO_RAYS, VSH_AO_ADAPTIVE, VSH_AO_EXACT, VSH_AO_TAPS, VSH_AO_CONES};
    static double positions[3 * POINTS];
    static float facing[3 * POINTS], values[POINTS], truth[POINTS], bent[3 * POINTS];
    FREED_BY(caster_free) casting c = caster_of(SCENE, 0.04, 4.0);
    uint64_t counter = 5;
    for (size_t i = 0; i < POINTS;) { /* a little off everything, their normals to all sides */
        double *p = positions + 3 * i, normal[3];
        p[0] = between(&counter, -2.5, 2.5);
        p[1] = between(&counter, 0.05, 2.0);
        p[2] = between(&counter, -2.5, 2.5);
        random_direction(&counter, normal);
        for (size_t k = 0; k < 3; ++k) {
            facing[3 * i + k] = (float)normal[k];
        }
        i += truth_distance(SCENE, p) > 0.05;
    }
    const vsh_points points = {POINTS, positions, facing, NULL};
    vsh_shade_options options = vsh_shade_options_default();
    options.ao_distance = FAR;
    options.max_error = 0.02;
    for (int u = 0; u < 2; ++u) {
        for (size_t i = 0; i < POINTS; ++i) {
            truth[i] = over_truth(positions + 3 * i, facing + 3 * i, ups[u]);
        }
        for (int k = 0; k < 3; ++k) {
            options.ao_up[k] = 3.0 * ups[u][k]; /* of any length */
        }
        for (size_t m = 0; m < COUNT_OF(methods); ++m) {
            options.ao_method = methods[m];
            options.rays = methods[m] == VSH_AO_RAYS ? 512 : 0;
            assert_fails(vsh_shade_ao(occluders_of_caster(&c), &points, &options, NULL, values, NULL, NULL,
                                      NULL, &failure),
                         m < 3 ? VSH_OK : VSH_ERROR_ARGUMENT, "over a horizon");
            double square = 0.0, mean = 0.0;
            for (size_t i = 0; m < 3 && i < POINTS; ++i) {
                const float *n = facing + 3 * i;
                const double over = 0.5 * (1.0 + (double)n[0] * ups[u][0] + (double)n[1] * ups[u][1] +
                                           (double)n[2] * ups[u][2]);
                const double off = over * ((double)values[i] - (double)truth[i]);
                square += off * off / POINTS;
                mean += off / POINTS;
            }
            assert_true(sqrt(square) < 0.02 && fabs(mean) < 0.004);
        }
    }
    options.ao_method = VSH_AO_ADAPTIVE; /* bent normals know no horizon */
    assert_fails(
        vsh_shade_ao(occluders_of_caster(&c), &points, &options, NULL, values, NULL, bent, NULL, &failure),
        VSH_ERROR_ARGUMENT, "");
}
