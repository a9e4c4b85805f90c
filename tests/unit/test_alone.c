/* What a point gets does not depend on the other points of a call, by no bit. */
#include "previews.h"
#include "shading.h"
#include "testing.h"

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

/* In blocks of eight by eight, as a lightmap's texels are shaded. Where they do not lie on the floor they
 * lean across the scene, with normals that turn from side to side, so that suns stand low for some. */
static void place_points(bool leaning) {
    for (size_t i = 0; i < MANY; ++i) {
        const size_t block = i / 64;
        const double x = ((double)(block % (SIDE / 8) * 8 + i % 8) + 0.5) / SIDE;
        const double z = ((double)(block / (SIDE / 8) * 8 + i / 8 % 8) + 0.5) / SIDE;
        positions[3 * i] = 5.0 * x - 2.5;
        positions[3 * i + 1] = leaning ? 0.2 + z : 0.001;
        positions[3 * i + 2] = 5.0 * z - 2.5;
        normals[3 * i] = leaning ? (float)(2.0 * x - 1.0) : 0.0f;
        normals[3 * i + 1] = 1.0f;
        normals[3 * i + 2] = 0.0f;
        texels[i] = (uint32_t)i;
    }
}

/* Points first, first + step … by a handle, `batch` a call. */
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
    OWNED(vsh_query) *query = NULL;
    assert_ok(vsh_query_create(occluders_of(field), light, light != NULL, options, &query, &failure));
    ask(query, light == NULL, count, count, among);
    const size_t batches[] = {1, 1000};
    for (size_t b = 0; b < sizeof batches / sizeof batches[0]; ++b) {
        ask(query, light == NULL, count, batches[b], alone);
        size_t different = 0, most = 0;
        for (size_t i = 0; i < count; ++i) {
            different += bits_of(alone[i]) != bits_of(among[i]);
            most = fabsf(alone[i] - among[i]) > fabsf(alone[most] - among[most]) ? i : most;
        }
        if (different > 0) {
            fail_msg("%s: %zu values of %zu differ in calls for %zu, point %zu by %g",
                     light != NULL ? vsh_get_name(VSH_NAMES_SHADOW, options->method)
                                   : vsh_get_name(VSH_NAMES_AO, options->ao_method),
                     different, count, batches[b], most, (double)fabsf(alone[most] - among[most]));
        }
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

/* Deep in an umbra, where a march may miss the deepest place of what hides the sun. */
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

/* Lamps of which single points saw more, or less, than blocks of them before: by up to 0.2 with `cone`, by
 * all of it with `hard`. */
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
    for (size_t i = 0; i < sizeof CASES / sizeof CASES[0]; ++i) {
        uint64_t counter = CASES[i].scene;
        const bool walls = CASES[i].scene % 2 == 1;
        OWNED(vsh_field) *field = field_of(crowd(&counter, walls), CASES[i].voxel, 0.0);
        place_points(CASES[i].leaning);
        const vsh_light light = lamp(CASES[i].place, CASES[i].radius);
        compare_shadows(field, &light, CASES[i].leaning ? VSH_SHADOW_HARD : VSH_SHADOW_CLASSIC,
                        CASES[i].leaning ? VSH_SHADOW_HARD : VSH_SHADOW_RAYS);
    }
}

TEST(ao_and_steps_of_chance_are_those_of_the_point) {
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
