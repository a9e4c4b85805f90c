/* Points that follow each other share proofs: that saves work, shows in no value, and proves nothing wrong.
 */
#include "testing.h"
#include "traced.h"

#include "previews.h"
#include "truth/metrics.h"

enum { SIDE = 128, POINTS = SIDE * SIDE };

static double morton[3 * POINTS], scattered[3 * POINTS];
static float normals[3 * POINTS], of_morton[POINTS], of_scattered[POINTS], deviation[POINTS], truth[POINTS];
static float outside[POINTS]; /* of what stands on the floor */

/* Where point i of the order of blocks is among the scattered ones. */
static size_t place_of(size_t i) {
    return i * 7919 % POINTS;
}

/* The seeds' floor, in the order of Morton's curve and in one without neighbours. */
static void place_points(void) {
    for (size_t i = 0; i < POINTS; ++i) {
        size_t x = 0, y = 0;
        for (size_t bit = 0; bit < 7; ++bit) {
            x |= (i >> (2 * bit) & 1) << bit;
            y |= (i >> (2 * bit + 1) & 1) << bit;
        }
        double *p = morton + 3 * i;
        p[0] = -2.5 + 5.0 * ((double)x + 0.5) / SIDE;
        p[1] = 0.001;
        p[2] = -2.5 + 5.0 * ((double)y + 0.5) / SIDE;
        memcpy(scattered + 3 * place_of(i), p, 3 * sizeof *p);
        normals[3 * i + 1] = 1.0f;
        const double above[3] = {p[0], 0.04, p[2]};
        outside[i] = truth_distance(truth_seeds(), above) > 0.03 ? 1.0f : 0.0f;
    }
}

static vsh_shade_stats shade(const casting *made, const vsh_light *light, int32_t method,
                             const double *positions, float *values) {
    vsh_shade_options options = preview_options();
    options.method = method;
    options.rays = 8;
    options.max_error = 1.0; /* only what is proved has no error left */
    const vsh_points points = {POINTS, positions, normals, NULL};
    vsh_shade_stats stats = vsh_shade_stats_zero();
    assert_ok(vsh_shade_shadow(occluders_of_caster(made), &points, light, &options, NULL, values, deviation,
                               &stats, &failure));
    return stats;
}

static int lights_of(vsh_light lights[4]) {
    const double place[3] = {0.9, 2.4, -0.8}, low[3] = {-0.9, 0.35, 0.2};
    lights[0] = sun(truth_seeds_sun, 2.0 * atan(0.05));
    lights[1] = lamp(place, 0.1);
    lights[2] = sun(low, RADIANS(2.0));
    lights[3] = lamp(place, 0.6);
    return 4;
}

TEST(blocks_save_samples_and_change_no_value) {
    place_points();
    FREED_BY(caster_free) casting made = caster_of(truth_seeds(), 0.02, 0.0);
    vsh_light lights[4];
    const int light_count = lights_of(lights);
    for (int l = 0; l < light_count; ++l) {
        for (int32_t method = VSH_SHADOW_HARD; method <= VSH_SHADOW_CONE; ++method) {
            const vsh_shade_stats few = shade(&made, &lights[l], method, morton, of_morton);
            const vsh_shade_stats many = shade(&made, &lights[l], method, scattered, of_scattered);
            size_t different = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                different += of_morton[i] != of_scattered[place_of(i)];
            }
            const double samples = (double)few.samples / (double)many.samples;
            assert_less(samples, 0.85);
            assert_int_equal(different, 0);
        }
    }
}

TEST(no_block_is_proved_wrong) {
    place_points();
    FREED_BY(caster_free) casting made = caster_of(truth_seeds(), 0.02, 0.0);
    vsh_light lights[4];
    const int light_count = lights_of(lights);
    const double up[3] = {0.0, 1.0, 0.0};
    for (int l = 0; l < light_count; ++l) {
        const vsh_light *light = &lights[l];
        for (size_t i = 0; i < POINTS; ++i) {
            double towards[3], square = 0.0;
            for (int k = 0; k < 3; ++k) {
                towards[k] = light->position[k] - morton[3 * i + (size_t)k];
                square += towards[k] * towards[k];
            }
            const bool far = light->type == VSH_LIGHT_DIRECTIONAL;
            const double w =
                far ? tan(0.5 * light->angle) : light->radius / sqrt(square - light->radius * light->radius);
            truth[i] = (float)truth_light(truth_seeds(), morton + 3 * i, up, far ? light->direction : towards,
                                          w, far ? (double)INFINITY : sqrt(square) - light->radius, 64);
        }
        for (int32_t method = VSH_SHADOW_ADAPTIVE; method < SHADOW_METHODS; ++method) {
            shade(&made, light, method, morton, of_morton);
            size_t proved = 0, decided = 0;
            for (size_t i = 0; i < POINTS; ++i) {
                if (outside[i] > 0.0f) {
                    decided += truth[i] == 0.0f || truth[i] == 1.0f;
                    proved += deviation[i] == 0.0f;
                    assert_true(deviation[i] > 0.0f || of_morton[i] == truth[i]);
                }
            }
            assert_true((double)proved > 0.7 * (double)decided);
        }
    }
}
