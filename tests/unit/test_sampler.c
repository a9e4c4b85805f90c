/* Where rays go: uniform over the disc, different from texel to texel and frame to frame, and as good as
 * promised. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "shade/rays.h"
#include "trace/sampler.h"
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

/* --- texels of a tile that share their rays */

enum { TILE = 64, EIGHT = 8 };

/* The map that the sampler uses is good to 4e-7. */
static const double ROUNDING = 2e-6;

static uint32_t texel_of_tile(uint32_t column, uint32_t row, uint32_t member) {
    return 8 * column + member % 8 + ((8 * row + member / 8) << 16);
}

/* From the disc back to the unit square (Shirley and Chiu, 1997). */
static void to_square(const double disc[2], double square[2]) {
    const bool wide = fabs(disc[0]) > fabs(disc[1]);
    const double major = wide ? disc[0] : disc[1], minor = wide ? disc[1] : disc[0];
    const double radius = copysign(hypot(major, minor), major);
    const double across = major != 0.0 ? radius * atan(minor / major) * 4.0 / 3.14159265358979323846 : 0.0;
    square[0] = 0.5 + 0.5 * (wide ? radius : across);
    square[1] = 0.5 + 0.5 * (wide ? across : radius);
}

static bool is_near_edge(double at, double cells) {
    const double off = at * cells - floor(at * cells + 0.5);
    return fabs(off) < ROUNDING * cells;
}

static size_t cell_of(double at, size_t cells) {
    const double cell = floor(at * (double)cells);
    return cell < 0.0 ? 0 : cell >= (double)cells ? cells - 1 : (size_t)cell;
}

/* Whether 2^m points on the disc are a (0, m, 2)-net in base 2: one in each of the 2^m boxes of any shape.
 * Those that may be on either side of a box's edge by rounding may be missing. */
static bool is_net(const double (*disc)[2], int32_t m) {
    enum { LARGEST = 1024 };
    static double square[LARGEST][2];
    const size_t count = (size_t)1 << m;
    assert_true(count <= LARGEST);
    for (size_t i = 0; i < count; ++i) {
        to_square(disc[i], square[i]);
    }
    for (int32_t k = 0; k <= m; ++k) {
        const size_t columns = (size_t)1 << k, rows = count >> k;
        uint8_t taken[LARGEST] = {0};
        size_t full = 0, doubtful = 0;
        for (size_t i = 0; i < count; ++i) {
            const size_t box = cell_of(square[i][1], rows) * columns + cell_of(square[i][0], columns);
            full += !taken[box];
            taken[box] = 1;
            doubtful +=
                is_near_edge(square[i][0], (double)columns) || is_near_edge(square[i][1], (double)rows);
        }
        if (full + doubtful < count || doubtful > count / 16 + 1) {
            return false;
        }
    }
    return true;
}

/* The first eight points of all texels of a tile, and of the squares of 2 × 2 and 4 × 4 in it. */
static void first_points_of_a_tile_are_one_net(void **state) {
    (void)state;
    static double points[TILE * EIGHT][2];
    for (int32_t frame = 0; frame < 3; ++frame) {
        vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, frame);
        assert_non_null(sampler);
        for (uint32_t tile = 0; tile < 24; ++tile) {
            for (uint32_t edge = 1; edge <= 8; edge *= 2) {
                for (uint32_t first = 0; first < TILE; ++first) {
                    if (first % 8 % edge != 0 || first / 8 % edge != 0) {
                        continue;
                    }
                    for (uint32_t i = 0; i < edge * edge; ++i) {
                        const uint32_t member = first + i / edge * 8 + i % edge;
                        vshi_sampler_tile(sampler, texel_of_tile(tile % 5 * 37, tile / 5 * 211, member),
                                          0xa0 + tile % 2, 0, EIGHT, points + (size_t)i * EIGHT);
                    }
                    assert_true(is_net((const double(*)[2])points, edge == 1   ? 3
                                                                   : edge == 2 ? 5
                                                                   : edge == 4 ? 7
                                                                               : 9));
                }
            }
        }
        vshi_sampler_free(sampler);
    }
}

/* The first 8 and 16; with further ones, whose eights have shifts of their own, they are not quite one. */
static void points_of_a_texel_are_nets_too(void **state) {
    (void)state;
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 0);
    assert_non_null(sampler);
    static double points[MOST][2];
    for (uint32_t texel = 0; texel < 4 * TILE; ++texel) {
        vshi_sampler_tile(sampler, texel_of_tile(texel / TILE, 3, texel % TILE), 0xa0, 0, MOST, points);
        assert_true(is_net((const double(*)[2])points, 3));
        assert_true(is_net((const double(*)[2])points, 4));
        for (size_t i = 0; i < MOST; ++i) {
            assert_true(hypot(points[i][0], points[i][1]) <= 1.0 + ROUNDING);
        }
    }
    vshi_sampler_free(sampler);
}

/* To share its points with a tile costs a texel little: errors of its own share beside those by
 * vshi_sampler_disc(). */
static void rays_of_a_texel_of_a_tile_err_as_others(void **state) {
    (void)state;
    for (int32_t n = EIGHT; n <= MOST; n *= 2) {
        vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 0);
        assert_non_null(sampler);
        double square[2] = {0.0, 0.0};
        for (uint32_t t = 0; t < TEXELS; ++t) {
            const double x = -0.8 + 1.6 * (double)((t * 7919u) % TEXELS) / TEXELS, angle = 0.37 * t;
            for (int32_t tiled = 0; tiled < 2; ++tiled) {
                static double points[MOST][2];
                (tiled ? vshi_sampler_tile : vshi_sampler_disc)(sampler, t % 64 + ((t / 64) << 16), 3, 0, n,
                                                                points);
                int32_t lit = 0;
                for (int32_t i = 0; i < n; ++i) {
                    lit += points[i][0] * cos(angle) + points[i][1] * sin(angle) < x;
                }
                const double error = (double)lit / n - truth_disc_share(x);
                square[tiled] += error * error;
            }
        }
        print_message("%d rays: %.3f of the error alone\n", n, sqrt(square[1] / square[0]));
        assert_true(square[1] < 1.2 * 1.2 * square[0]);
        vshi_sampler_free(sampler);
    }
}

static int by_x(const void *a, const void *b) {
    const double *p = a, *q = b;
    return p[0] < q[0] ? -1 : p[0] > q[0];
}

static void no_texel_of_a_tile_repeats_anothers_points(void **state) {
    (void)state;
    enum { RAYS = 64, COUNT = TILE * RAYS };
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 0);
    assert_non_null(sampler);
    static double points[COUNT][2];
    for (uint32_t tile = 0; tile < 8; ++tile) {
        for (uint32_t member = 0; member < TILE; ++member) {
            vshi_sampler_tile(sampler, texel_of_tile(tile, 2 * tile, member), 0xa0, 0, RAYS,
                              points + (size_t)member * RAYS);
        }
        qsort(points, COUNT, sizeof points[0], by_x);
        for (size_t i = 0; i < COUNT; ++i) {
            for (size_t j = i + 1; j < COUNT && points[j][0] - points[i][0] < ROUNDING; ++j) {
                assert_true(fabs(points[j][1] - points[i][1]) > ROUNDING);
            }
        }
    }
    vshi_sampler_free(sampler);
}

static void tiles_purposes_and_frames_have_points_of_their_own(void **state) {
    (void)state;
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 0),
                 *later = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 1);
    assert_true(sampler != NULL && later != NULL);
    double a[EIGHT][2], b[EIGHT][2];
    const uint32_t texel = texel_of_tile(4, 4, 19);
    vshi_sampler_tile(sampler, texel, 1, 0, EIGHT, a);
    vshi_sampler_tile(sampler, texel_of_tile(5, 4, 19), 1, 0, EIGHT, b);
    assert_memory_not_equal(a, b, sizeof a);
    vshi_sampler_tile(sampler, texel_of_tile(4, 5, 19), 1, 0, EIGHT, b);
    assert_memory_not_equal(a, b, sizeof a);
    vshi_sampler_tile(sampler, texel, 2, 0, EIGHT, b);
    assert_memory_not_equal(a, b, sizeof a);
    vshi_sampler_tile(later, texel, 1, 0, EIGHT, b);
    assert_memory_not_equal(a, b, sizeof a);
    vshi_sampler_free(later);
    vshi_sampler_free(sampler);
}

static void points_asked_for_in_parts_are_the_same(void **state) {
    (void)state;
    static const int32_t cuts[] = {0, 8, 16, 21, 22, 64, 71, 200, MOST};
    for (size_t k = 0; k < 3; ++k) {
        vshi_sampler *sampler = vshi_sampler_create(KINDS[k], MOST, 0);
        assert_non_null(sampler);
        static double whole[MOST][2], parts[MOST][2], alone[MOST][2];
        for (uint32_t member = 0; member < TILE; ++member) {
            const uint32_t texel = texel_of_tile(9, 2, member);
            vshi_sampler_tile(sampler, texel, 0xa0, 0, MOST, whole);
            for (size_t c = 0; c + 1 < sizeof cuts / sizeof cuts[0]; ++c) {
                vshi_sampler_tile(sampler, texel, 0xa0, cuts[c], cuts[c + 1] - cuts[c], parts + cuts[c]);
            }
            assert_memory_equal(whole, parts, sizeof whole);
            vshi_sampler_disc(sampler, texel, 0xa0, 0, MOST, alone);
            if (KINDS[k] != VSH_SAMPLER_SOBOL) { /* only that knows tiles */
                assert_memory_equal(whole, alone, sizeof whole);
            }
        }
        vshi_sampler_free(sampler);
    }
}

/* Root mean square error of the share of a tile's points on one side of straight edges. */
static double error_of_tiles(bool tiled, int32_t rays) {
    enum { TILES = 512 };
    vshi_sampler *sampler = vshi_sampler_create(VSH_SAMPLER_SOBOL, MOST, 0);
    assert_non_null(sampler);
    double square = 0.0;
    for (uint32_t t = 0; t < TILES; ++t) {
        const double x = -0.8 + 1.6 * (double)((t * 7919u) % TILES) / TILES, angle = 0.37 * t;
        double points[MOST][2];
        int32_t lit = 0;
        for (uint32_t member = 0; member < TILE; ++member) {
            (tiled ? vshi_sampler_tile : vshi_sampler_disc)(sampler, texel_of_tile(t % 16, t / 16, member), 3,
                                                            0, rays, points);
            for (int32_t i = 0; i < rays; ++i) {
                lit += points[i][0] * cos(angle) + points[i][1] * sin(angle) < x;
            }
        }
        const double error = (double)lit / (TILE * rays) - truth_disc_share(x);
        square += error * error / TILES;
    }
    vshi_sampler_free(sampler);
    return sqrt(square);
}

/* With 64 rays a texel nothing is won any more: further eights shift only what digits are left. */
static void a_tiles_mean_of_few_rays_is_nearer_than_that_of_texels_alone(void **state) {
    (void)state;
    static const double most[] = {0.5, 0.6, 0.8, 1.3};
    for (int32_t k = 0; k < 4; ++k) {
        const int32_t rays = EIGHT << k;
        const double tiled = error_of_tiles(true, rays), alone = error_of_tiles(false, rays);
        print_message("mean of 64 texels of %d rays: %.5f, alone %.5f (%.2f)\n", rays, tiled, alone,
                      tiled / alone);
        assert_true(tiled < most[k] * alone);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(estimates_of_the_error_are_true),
        cmocka_unit_test(low_discrepancy_beats_blue_beats_white_noise),
        cmocka_unit_test(texels_purposes_and_frames_have_sequences_of_their_own),
        cmocka_unit_test(the_blue_mask_spreads_the_error_over_neighbours),
        cmocka_unit_test(first_points_of_a_tile_are_one_net),
        cmocka_unit_test(points_of_a_texel_are_nets_too),
        cmocka_unit_test(rays_of_a_texel_of_a_tile_err_as_others),
        cmocka_unit_test(no_texel_of_a_tile_repeats_anothers_points),
        cmocka_unit_test(tiles_purposes_and_frames_have_points_of_their_own),
        cmocka_unit_test(points_asked_for_in_parts_are_the_same),
        cmocka_unit_test(a_tiles_mean_of_few_rays_is_nearer_than_that_of_texels_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
