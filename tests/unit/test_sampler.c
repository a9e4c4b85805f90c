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
        OWNED(vshi_sampler) *first = vshi_sampler_create(KINDS[k], 16, 0),
                            *second = vshi_sampler_create(KINDS[k], 16, 1);
        assert_true(first != NULL && second != NULL);
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

/* --- nets and their cells */

/* The map that the sampler uses is good to 4e-7. */
static const double ROUNDING = 2e-6;

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
 * Boxes may be empty whose point rounding can put on the other side of an edge. */
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

/* Digits of a net's points, shifted by a texel's, to the unit square. */
static void to_unit(const uint32_t digits[2], const uint32_t shift[2], double square[2]) {
    for (size_t k = 0; k < 2; ++k) {
        square[k] = (double)(digits[k] ^ shift[k]) * 0x1p-32;
    }
}

/* vshi_sampler_cells() makes packets of rays. */
TEST(a_block_has_one_point_in_each_cell_and_a_shift_moves_cells_whole) {
    OWNED(vshi_sampler) *sampler = make_sampler(VSH_SAMPLER_SOBOL, MOST, 2);
    for (uint32_t texel = 0; texel < 64; ++texel) {
        uint32_t shift[2];
        double disc[MOST][2];
        vshi_sampler_shift(sampler, texel * 65539u, 7, shift);
        vshi_sampler_disc(sampler, texel * 65539u, 7, 0, MOST, disc);
        for (uint32_t first = 0; first < MOST; first = first == 0 ? VSHI_SAMPLER_BLOCK : 2 * first) {
            const uint32_t size = first == 0 ? VSHI_SAMPLER_BLOCK : first;
            const uint32_t(*cells)[2] = vshi_sampler_cells(sampler, first);
            bool taken[MOST] = {false};
            for (uint32_t cell = 0; cell < size; ++cell) {
                const uint32_t *point = cells[cell ^ vshi_sampler_cell(size, shift[0], shift[1])];
                double square[2], own[2] = {NAN, NAN};
                assert_int_equal(vshi_sampler_cell(size, point[0] ^ shift[0], point[1] ^ shift[1]), cell);
                to_unit(point, shift, square);
                for (uint32_t i = first; i < first + size;
                     ++i) { /* it is one of the block, which no other cell has */
                    to_square((const double *)disc[i], own);
                    if (fabs(own[0] - square[0]) + fabs(own[1] - square[1]) < 1e-6) {
                        assert_false(taken[i]);
                        taken[i] = true;
                        break;
                    }
                }
            }
            for (uint32_t i = first; i < first + size; ++i) {
                assert_true(taken[i]);
            }
        }
    }
}

TEST(points_of_a_texel_are_nets) {
    OWNED(vshi_sampler) *sampler = make_sampler(VSH_SAMPLER_SOBOL, MOST, 0);
    static double points[MOST][2];
    for (uint32_t texel = 0; texel < 64; ++texel) {
        vshi_sampler_disc(sampler, texel, 0xa0, 0, MOST, points);
        for (int32_t m = 2; 1 << m <= MOST; ++m) {
            assert_true(is_net((const double(*)[2])points, m));
        }
    }
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
