/* Points of one call: no bit of a value depends on the other points. Neighbours share proofs, which saves
 * samples and proves nothing wrong. */
#include "traced.h"

enum { SIDE = 448, MANY = SIDE * SIDE, SOME = 1 << 14, SOLIDS = 14 };

static double positions[3 * MANY];
static float normals[3 * MANY], among[MANY], alone[MANY];
static uint32_t texels[MANY];

/* A floor with walls of all sizes over it, or with solids of all kinds. */
static truth_scene crowd(uint64_t *counter, bool walls) {
    static truth_solid solids[SOLIDS];
    memset(solids, 0, sizeof solids);
    solids[0] = (truth_solid){.shape = TRUTH_BOX, .center = {0.0, -0.1, 0.0}, .half = {2.5, 0.1, 2.5}};
    for (size_t i = 1; i < SOLIDS; ++i) {
        truth_solid *s = &solids[i];
        const double kind = uniform(counter);
        s->shape = walls || kind < 0.4 ? TRUTH_BOX : kind < 0.8 ? TRUTH_SPHERE : TRUTH_TORUS;
        for (int axis = 0; axis < 3; ++axis) {
            s->center[axis] = axis == 1 ? between(counter, 0.0, 2.0) : between(counter, -2.0, 2.0);
            s->half[axis] = between(counter, 0.03, 0.5);
        }
        if (walls) {
            s->half[uniform(counter) < 0.5 ? 0 : 2] = between(counter, 0.5, 1.5);
            s->center[1] = s->half[1] = between(counter, 0.2, 0.6);
        } else if (s->shape != TRUTH_BOX) {
            s->radius = between(counter, 0.2, 0.6);
            s->minor_radius = between(counter, 0.03, 0.2);
        }
    }
    return (truth_scene){solids, SOLIDS};
}

/* In blocks of eight by eight, as a lightmap's texels are shaded. With `leaning`, they lie on a plane that
 * leans across the scene, and their normals turn from side to side, so that suns stand low for some. */
static void place_points(bool leaning) {
    for (size_t i = 0; i < MANY; ++i) {
        const size_t block = i / 64;
        const double x = ((double)(block % (SIDE / 8) * 8 + i % 8) + 0.5) / SIDE;
        const double z = ((double)(block / (SIDE / 8) * 8 + i / 8 % 8) + 0.5) / SIDE;
        put_point(positions, normals, i, 5.0 * x - 2.5, leaning ? 0.2 + z : 0.001, 5.0 * z - 2.5);
        normals[3 * i] = leaning ? (float)(2.0 * x - 1.0) : 0.0f;
        texels[i] = (uint32_t)i;
    }
}

/* Shades `count` points by a handle, `batch` points a call. */
static void ask(const vsh_query *query, bool ao, size_t count, size_t batch, float *values) {
    for (size_t i = 0; i < count; i += batch) {
        const vsh_points points = {count - i < batch ? count - i : batch, positions + 3 * i, normals + 3 * i,
                                   texels + i};
        float *const visibility[1] = {values + i};
        vsh_query_output output = vsh_query_output_default();
        output.visibility = ao ? NULL : visibility;
        output.ao = ao ? values + i : NULL;
        assert_ok(vsh_query_points(query, &points, NULL, NULL, &output, NULL, &failure));
    }
}

static void compare(const vsh_field *field, const vsh_light *light, const vsh_shade_options *options,
                    size_t count) {
    OWNED(vsh_query) *query = query_of(occluders_of(field), light, light != NULL, options);
    ask(query, light == NULL, count, count, among);
    const size_t batches[] = {1, 1000};
    for (size_t b = 0; b < COUNT_OF(batches); ++b) {
        ask(query, light == NULL, count, batches[b], alone);
        size_t different = 0, most = 0;
        for (size_t i = 0; i < count; ++i) {
            different += bits_of(alone[i]) != bits_of(among[i]);
            most = fabsf(alone[i] - among[i]) > fabsf(alone[most] - among[most]) ? i : most;
        }
        assert_that(different == 0, "%s: %zu values of %zu differ in calls for %zu, point %zu by %g",
                    light != NULL ? vsh_get_name(VSH_NAMES_SHADOW, options->method)
                                  : vsh_get_name(VSH_NAMES_AO, options->ao_method),
                    different, count, batches[b], most, (double)fabsf(alone[most] - among[most]));
    }
}

static void compare_shadows(const vsh_field *field, const vsh_light *light, int32_t first, int32_t last) {
    for (int32_t method = first; method <= last; ++method) {
        vsh_shade_options options = preview_options();
        options.method = method;
        options.rays = 4;
        compare(field, light, &options, MANY);
    }
}

TEST(a_sun_that_the_horizon_cuts_is_as_bright_for_one_point_as_for_many) {
    uint64_t counter = 7919;
    OWNED(vsh_field) *field = field_of(crowd(&counter, true), 0.04, 0.0);
    place_points(true);
    const double low[3] = {0.5, 0.3, 0.6};
    const vsh_light light = sun(low, RADIANS(40.0));
    compare_shadows(field, &light, VSH_SHADOW_HARD, VSH_SHADOW_CONE);
}

/* Deep in an umbra, a march may miss the deepest place of the wall. */
TEST(a_sun_behind_walls_is_as_dark_for_one_point_as_for_many) {
    static truth_solid walls[] = {
        {.shape = TRUTH_BOX, .center = {0.0, -0.1, 0.0}, .half = {2.5, 0.1, 2.5}},
        {.shape = TRUTH_BOX,
         .center = {1.5411177945872052, 0.59764290648119966, 0.27266979878175368},
         .half = {1.3018215130764967, 0.69764290648119964, 0.26579448993333649}},
        {.shape = TRUTH_BOX,
         .center = {0.47038660696662404, 0.43101701363371292, 1.7101867740542955},
         .half = {0.25218165854970054, 0.5310170136337129, 1.2231131133201103}},
    };
    const double towards[3] = {0.6976726109006347, 0.71458854441526731, 0.051148217853225181};
    const vsh_light light = sun(towards, 0.20943951023931953);
    OWNED(vsh_field) *field = field_of((truth_scene){walls, 3}, 0.02, 0.0);
    place_points(false);
    compare_shadows(field, &light, VSH_SHADOW_SMOOTH, VSH_SHADOW_CONE);
}

/* Lamps for which single points and blocks of points once had different values: by up to 0.2 with `cone`, by
 * 1 with `hard`. */
TEST(lamps_among_solids_are_as_bright_for_one_point_as_for_many) {
    static const struct {
        uint64_t scene;
        double voxel, place[3], radius;
        bool leaning;
    } CASES[] = {
        {13,
         0.02,
         {-1.3738321827485618, 0.62200459446656109, -1.1374783800628196},
         0.20395537850946086,
         false},
        {34, 0.04, {0.89122105210774416, 1.1567599392902033, 0.509279919720103}, 0.5736579392094896, false},
        {27, 0.04, {1.1623453706828704, 0.54178089647683247, -1.8226544497300869}, 0.44643929618643236, true},
    };
    for (size_t i = 0; i < COUNT_OF(CASES); ++i) {
        uint64_t counter = CASES[i].scene;
        const bool walls = CASES[i].scene % 2 == 1;
        OWNED(vsh_field) *field = field_of(crowd(&counter, walls), CASES[i].voxel, 0.0);
        place_points(CASES[i].leaning);
        const vsh_light light = lamp(CASES[i].place, CASES[i].radius);
        compare_shadows(field, &light, CASES[i].leaning ? VSH_SHADOW_HARD : VSH_SHADOW_CLASSIC,
                        CASES[i].leaning ? VSH_SHADOW_HARD : VSH_SHADOW_RAYS);
    }
}

TEST(ao_and_jittered_steps_are_those_of_the_point) {
    uint64_t counter = 5;
    OWNED(vsh_field) *field = field_of(crowd(&counter, false), 0.05, 0.0);
    place_points(true);
    vsh_shade_options options = preview_options();
    options.rays = 8;
    options.ao_distance = 0.5;
    for (options.ao_method = VSH_AO_TAPS; options.ao_method < VSH_AO_EXACT; ++options.ao_method) {
        for (options.sampler = VSH_SAMPLER_SOBOL; options.sampler <= VSH_SAMPLER_BLUE; ++options.sampler) {
            compare(field, NULL, &options, SOME);
        }
    }
    options.sampler = VSH_SAMPLER_SOBOL;
    options.ao_method = VSH_AO_CONES;
    options.jitter = 0.5;
    const double high[3] = {0.4, 0.8, 0.3};
    const vsh_light light = sun(high, RADIANS(10.0));
    compare(field, &light, &options, SOME);
}

/* --- proofs that neighbours share */

enum { EDGE = 128, POINTS = EDGE * EDGE, LIGHTS = 6 };

static double scattered[3 * POINTS];
static float deviation[POINTS];

/* Where point i of the order of blocks is among the scattered ones. */
static size_t place_of(size_t i) {
    return i * 7919 % POINTS;
}

/* The seeds' floor: `positions` in the order of Morton's curve, `scattered` in one without neighbours. */
static casting seeds_in_blocks(double voxel, vsh_light lights[LIGHTS]) {
    const double place[3] = {0.9, 2.4, -0.8}, low[3] = {-0.9, 0.35, 0.2};
    for (size_t i = 0; i < POINTS; ++i) {
        size_t x = 0, y = 0;
        for (size_t bit = 0; bit < 7; ++bit) {
            x |= (i >> (2 * bit) & 1) << bit;
            y |= (i >> (2 * bit + 1) & 1) << bit;
        }
        put_point(positions, normals, i, -2.5 + 5.0 * ((double)x + 0.5) / EDGE, 0.001,
                  -2.5 + 5.0 * ((double)y + 0.5) / EDGE);
        memcpy(scattered + 3 * place_of(i), positions + 3 * i, sizeof(double[3]));
    }
    lights[0] = sun(truth_seeds_sun, 2.0 * atan(0.05));
    lights[1] = lamp(place, 0.1);
    lights[2] = sun(low, RADIANS(2.0));
    lights[3] = lamp(place, 0.6);
    lights[4] = sun(truth_seeds_sun, 2.0 * atan(0.01));
    lights[5] = sun(truth_seeds_sun, 2.0 * atan(0.4));
    return caster_of(truth_seeds(), voxel, 0.0);
}

static vsh_shade_stats shade(const casting *made, const vsh_light *light, int32_t method,
                             const double *places, float *values) {
    vsh_shade_options options = preview_options();
    options.method = method;
    options.rays = 8;
    options.max_error = 1.0; /* only proved points have no error left */
    const vsh_points points = {POINTS, places, normals, NULL};
    return shade_points(occluders_of_caster(made), &points, light, &options, NULL, values, deviation);
}

TEST(blocks_save_samples_and_change_no_value) {
    vsh_light lights[LIGHTS];
    FREED_BY(caster_free) casting made = seeds_in_blocks(0.02, lights);
    for (int l = 0; l < 4; ++l) {
        for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
            const vsh_shade_stats few = shade(&made, &lights[l], method, positions, among);
            const vsh_shade_stats many = shade(&made, &lights[l], method, scattered, alone);
            assert_less((double)few.samples, 0.85 * (double)many.samples);
            for (size_t i = 0; i < POINTS; ++i) {
                assert_true(among[i] == alone[place_of(i)]);
            }
        }
    }
}

/* Cones prove facts about the casters themselves, not only about the field. */
TEST(no_block_is_proved_wrong) {
    vsh_light lights[LIGHTS];
    FREED_BY(caster_free)
    casting fine = seeds_in_blocks(0.02, lights), coarse = seeds_in_blocks(0.05, lights);
    const double up[3] = {0.0, 1.0, 0.0};
    float *const truth = alone;
    for (int l = 0; l < LIGHTS; ++l) {
        const vsh_light *light = &lights[l];
        for (size_t i = 0; i < POINTS; ++i) {
            double towards[3];
            go_along(light->position, -1.0, positions + 3 * i, towards);
            const double square = dot3(towards, towards);
            const bool far = light->type == VSH_LIGHT_DIRECTIONAL;
            const double w =
                far ? tan(0.5 * light->angle) : light->radius / sqrt(square - light->radius * light->radius);
            truth[i] =
                (float)truth_light(truth_seeds(), positions + 3 * i, up, far ? light->direction : towards, w,
                                   far ? (double)INFINITY : sqrt(square) - light->radius, 512);
        }
        for (int k = 0; k < 2 * (SHADOW_METHODS - VSH_SHADOW_ADAPTIVE); ++k) {
            shade(k % 2 ? &coarse : &fine, light, VSH_SHADOW_ADAPTIVE + k / 2, positions, among);
            size_t proved = 0, decided = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                if (truth_distance(truth_seeds(), positions + 3 * i) > 0.0) {
                    decided += truth[i] == 0.0f || truth[i] == 1.0f;
                    proved += deviation[i] == 0.0f;
                    assert_true(deviation[i] > 0.0f || among[i] == truth[i]);
                }
            }
            assert_true((double)proved > (k > 0 ? 0.7 : 0.85) * (double)decided);
        }
    }
}
