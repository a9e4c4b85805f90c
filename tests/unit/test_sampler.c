/* Where rays go: uniform over the disc, different from texel to texel and frame to frame, and as good as
 * promised. */
#include "testing.h"

#include "shade/shade.h"
#include "trace/sampler.h"
#include "truth/directions.h"

OWNER(vshi_sampler)

enum { MOST = 256, TEXELS = 2048 };

static const int32_t KINDS[] = {VSH_SAMPLER_SOBOL, VSH_SAMPLER_WHITE, VSH_SAMPLER_BLUE};

static vshi_sampler *make_sampler(int32_t kind, int32_t most, int32_t frame) {
    vshi_sampler *sampler = vshi_sampler_create(kind, most, frame);
    assert_non_null(sampler);
    return sampler;
}

/* Root mean square error of the share of n points on one side of straight edges of all places and directions,
 * over what vshi_rays_deviation() says of it. */
static double error_over_estimate(int32_t kind, int32_t n, double *bias) {
    vshi_sampler *sampler = make_sampler(kind, MOST, 0);
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

TEST(estimates_of_the_error_are_true) {
    for (size_t k = 0; k < 3; ++k) {
        for (int32_t n = 16; n <= MOST; n *= 2) {
            double bias;
            const double ratio = error_over_estimate(KINDS[k], n, &bias);
            assert_true(ratio > 0.5 && ratio < 1.1);
            assert_less(fabs(bias), 0.012);
        }
    }
}

TEST(low_discrepancy_beats_blue_beats_white_noise) {
    double errors[3];
    for (size_t k = 0; k < 3; ++k) {
        double bias;
        errors[k] = error_over_estimate(KINDS[k], 64, &bias) * vshi_rays_deviation(KINDS[k], 32, 64, 0.5);
    }
    assert_true(errors[0] < 0.8 * errors[2]);
    assert_true(errors[2] < 0.8 * errors[1]);
}

TEST(texels_purposes_and_frames_have_sequences_of_their_own) {
    for (size_t k = 0; k < 3; ++k) {
        OWNED(vshi_sampler) *first = make_sampler(KINDS[k], 16, 0), *second = make_sampler(KINDS[k], 16, 1);
        double a[16][2], b[16][2];
        vshi_sampler_disc(first, 5, 1, 0, 16, a);
        vshi_sampler_disc(first, 5, 1, 0, 16, b);
        assert_memory_equal(a, b, sizeof a);
        vshi_sampler_disc(first, 6, 1, 0, 16, b);
        assert_memory_not_equal(a, b, sizeof a);
        vshi_sampler_disc(first, 5, 2, 0, 16, b);
        assert_memory_not_equal(a, b, sizeof a);
        vshi_sampler_disc(second, 5, 1, 0, 16, b);
        assert_memory_not_equal(a, b, sizeof a);
    }
}

/* Blue noise: one ray a texel, at an edge across the disc; the mean over 4 × 4 texels is nearer than white
 * noise's. */
TEST(the_blue_mask_spreads_the_error_over_neighbours) {
    double error[3] = {0.0};
    for (size_t k = 0; k < 3; ++k) {
        OWNED(vshi_sampler) *sampler = make_sampler(KINDS[k], 1, 0);
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
    }
    assert_less(sqrt(error[2]), 0.7 * sqrt(error[1]));
}

TEST(points_asked_for_in_parts_are_the_same) {
    static const int32_t cuts[] = {0, 8, 16, 21, 22, 64, 71, 200, MOST};
    for (size_t k = 0; k < 3; ++k) {
        OWNED(vshi_sampler) *sampler = make_sampler(KINDS[k], MOST, 0);
        static double whole[MOST][2], parts[MOST][2];
        for (uint32_t texel = 0; texel < 64; ++texel) {
            vshi_sampler_disc(sampler, texel, 0xa0, 0, MOST, whole);
            for (size_t c = 0; c + 1 < COUNT_OF(cuts); ++c) {
                vshi_sampler_disc(sampler, texel, 0xa0, cuts[c], cuts[c + 1] - cuts[c], parts + cuts[c]);
            }
            assert_memory_equal(whole, parts, sizeof whole);
        }
    }
}
