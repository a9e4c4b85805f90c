/* Where rays go: uniform over the disc, different from texel to texel and frame to frame, and as good as
 * promised. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "shade/rays.h"
#include "shade/sampler.h"
#include "truth/directions.h"

enum { MOST = 256, TEXELS = 2048 };

static const int32_t KINDS[] = {VSH_SAMPLER_SOBOL, VSH_SAMPLER_WHITE, VSH_SAMPLER_BLUE};

/* Root mean square error of the share of n points on one side of straight edges of all places and directions,
 * over what vshi_rays_deviation() says of it. */
static double error_over_estimate(int32_t kind, int32_t n, double *bias) {
    vshi_sampler *sampler = vshi_sampler_create(kind, MOST, 0);
    assert_non_null(sampler);
    static double points[MOST][2];
    double square = 0.0, estimate = 0.0;
    *bias = 0.0;
    for (uint32_t t = 0; t < TEXELS; ++t) {
        vshi_sampler_disc(sampler, t % 64 + ((t / 64) << 16), 3, 0, n, points);
        const double x = -0.8 + 1.6 * (double)((t * 7919u) % TEXELS) / TEXELS, angle = 0.37 * t;
        int32_t lit = 0;
        for (int32_t i = 0; i < n; ++i) {
            assert_true(points[i][0] * points[i][0] + points[i][1] * points[i][1] <= 1.0 + 1e-9);
            lit += points[i][0] * cos(angle) + points[i][1] * sin(angle) < x;
        }
        const double error = (double)lit / n - truth_disc_share(x);
        const double deviation = vshi_rays_deviation(kind, lit, n, 0.5);
        square += error * error;
        estimate += deviation * deviation;
        *bias += error / TEXELS;
    }
    vshi_sampler_free(sampler);
    return sqrt(square / estimate);
}

static void estimates_of_the_error_are_true(void **state) {
    (void)state;
    for (size_t k = 0; k < 3; ++k) {
        for (int32_t n = 16; n <= MOST; n *= 2) {
            double bias;
            const double ratio = error_over_estimate(KINDS[k], n, &bias);
            print_message("%s %d: error over estimate %.2f, bias %.5f\n", vsh_sampler_name(KINDS[k]), n,
                          ratio, bias);
            assert_true(ratio > 0.5 && ratio < 1.1);
            assert_true(fabs(bias) < 0.012);
        }
    }
}

static void low_discrepancy_beats_blue_beats_white_noise(void **state) {
    (void)state;
    double errors[3];
    for (size_t k = 0; k < 3; ++k) {
        double bias;
        errors[k] = error_over_estimate(KINDS[k], 64, &bias) * vshi_rays_deviation(KINDS[k], 32, 64, 0.5);
    }
    assert_true(errors[0] < 0.8 * errors[2]);
    assert_true(errors[2] < 0.8 * errors[1]);
}

static void texels_purposes_and_frames_have_sequences_of_their_own(void **state) {
    (void)state;
    for (size_t k = 0; k < 3; ++k) {
        vshi_sampler *first = vshi_sampler_create(KINDS[k], 16, 0),
                     *second = vshi_sampler_create(KINDS[k], 16, 1);
        assert_true(first != NULL && second != NULL);
        double a[16][2], b[16][2];
        vshi_sampler_disc(first, 5, 1, 0, 16, a);
        vshi_sampler_disc(first, 5, 1, 0, 16, b);
        assert_memory_equal(a, b, sizeof a);
        vshi_sampler_disc(first, 5, 1, 8, 8, b); /* asked for in parts */
        assert_memory_equal(a + 8, b, sizeof a / 2);
        vshi_sampler_disc(first, 6, 1, 0, 16, b);
        assert_memory_not_equal(a, b, sizeof a);
        vshi_sampler_disc(first, 5, 2, 0, 16, b);
        assert_memory_not_equal(a, b, sizeof a);
        vshi_sampler_disc(second, 5, 1, 0, 16, b);
        assert_memory_not_equal(a, b, sizeof a);
        vshi_sampler_free(first);
        vshi_sampler_free(second);
    }
}

/* Blue noise: one ray a texel, at an edge across the disc; the mean over 4 × 4 texels is nearer than white
 * noise's. */
static void the_blue_mask_spreads_the_error_over_neighbours(void **state) {
    (void)state;
    double error[3] = {0.0};
    for (size_t k = 0; k < 3; ++k) {
        vshi_sampler *sampler = vshi_sampler_create(KINDS[k], 1, 0);
        assert_non_null(sampler);
        for (uint32_t block = 0; block < 256; ++block) {
            int32_t lit = 0;
            for (uint32_t i = 0; i < 16; ++i) {
                double point[1][2];
                const uint32_t column = block % 16 * 4 + i % 4, row = block / 16 * 4 + i / 4;
                vshi_sampler_disc(sampler, column + (row << 16), 0, 0, 1, point);
                lit += point[0][0] < 0.0;
            }
            error[k] += (lit / 16.0 - 0.5) * (lit / 16.0 - 0.5) / 256.0;
        }
        vshi_sampler_free(sampler);
    }
    print_message("mean of 16 texels: sobol %.3f, white %.3f, blue %.3f\n", sqrt(error[0]), sqrt(error[1]),
                  sqrt(error[2]));
    assert_true(sqrt(error[2]) < 0.7 * sqrt(error[1]));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(estimates_of_the_error_are_true),
        cmocka_unit_test(low_discrepancy_beats_blue_beats_white_noise),
        cmocka_unit_test(texels_purposes_and_frames_have_sequences_of_their_own),
        cmocka_unit_test(the_blue_mask_spreads_the_error_over_neighbours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
