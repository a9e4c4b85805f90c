/* Structural similarity (Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from error visibility
 * to structural similarity", 2004): means, variances and covariance under a Gaussian of 1.5 texels cut to 11
 * × 11, K1 = 0.01, K2 = 0.03, and a dynamic range of 1 after scaling. What is masked out has no weight, and
 * the weights that are left are normalised. A grid of voxels is taken slice by slice along z. */
#include "base/elementary.h"
#include "compare/pair.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RADIUS = 5, TAPS = 2 * RADIUS + 1 };

static const double SIGMA = 1.5, C1 = 0.01 * 0.01, C2 = 0.03 * 0.03;

/* Weighted sums: of nothing, of both values, of their squares and their product. */
enum { WEIGHT, SUM_A, SUM_B, SUM_AA, SUM_BB, SUM_AB, SUMS };

typedef double sums[SUMS];

double vshi_ssim_of_noise(double noise) {
    return C2 / (C2 + noise * noise);
}

static void make_taps(double taps[TAPS]) {
    for (int k = -RADIUS; k <= RADIUS; ++k) {
        taps[k + RADIUS] = vshi_exp(-0.5 * k * k / (SIGMA * SIGMA));
    }
}

static void add(double *to, const double *from, double weight) {
    for (int k = 0; k < SUMS; ++k) {
        to[k] += weight * from[k];
    }
}

/* A row summed along x; `moments` is scratch of its length. */
static void sum_row(const vshi_pair *pair, size_t first, const double taps[TAPS], sums *moments, sums *row) {
    const size_t width = pair->size[0];
    memset(moments, 0, width * sizeof *moments);
    memset(row, 0, width * sizeof *row);
    for (size_t x = 0; x < width; ++x) {
        if (pair->mask[first + x]) {
            const double a = vshi_value_at(pair, VSHI_GOLDEN, first + x);
            const double b = vshi_value_at(pair, VSHI_NEW, first + x);
            const sums all = {1.0, a, b, a * a, b * b, a * b};
            memcpy(moments[x], all, sizeof all);
        }
    }
    for (size_t x = 0; x < width; ++x) {
        const size_t begin = x > RADIUS ? x - RADIUS : 0;
        const size_t end = x + RADIUS + 1 < width ? x + RADIUS + 1 : width;
        for (size_t k = begin; k < end; ++k) {
            add(row[x], moments[k], taps[k + RADIUS - x]);
        }
    }
}

static double similarity(const double *s) {
    const double a = s[SUM_A] / s[WEIGHT], b = s[SUM_B] / s[WEIGHT];
    const double aa = fmax(0.0, s[SUM_AA] / s[WEIGHT] - a * a), bb = fmax(0.0, s[SUM_BB] / s[WEIGHT] - b * b);
    const double ab = s[SUM_AB] / s[WEIGHT] - a * b;
    return (2.0 * a * b + C1) * (2.0 * ab + C2) / ((a * a + b * b + C1) * (aa + bb + C2));
}

/* One slice, its rows' sums going through a ring of as many rows as there are taps. */
static double slice(const vshi_pair *pair, size_t first, const double taps[TAPS], sums *ring, sums *moments) {
    const size_t width = pair->size[0], height = pair->size[1];
    double total = 0.0;
    for (size_t next = 0; next < height + RADIUS; ++next) {
        if (next < height) {
            sum_row(pair, first + next * width, taps, moments, ring + next % TAPS * width);
        }
        if (next < RADIUS) {
            continue;
        }
        const size_t y = next - RADIUS;
        const size_t begin = y > RADIUS ? y - RADIUS : 0;
        const size_t end = y + RADIUS + 1 < height ? y + RADIUS + 1 : height;
        for (size_t x = 0; x < width; ++x) {
            if (!pair->mask[first + y * width + x]) {
                continue;
            }
            sums all = {0.0};
            for (size_t k = begin; k < end; ++k) {
                add(all, ring[k % TAPS * width + x], taps[k + RADIUS - y]);
            }
            total += similarity(all);
        }
    }
    return total;
}

bool vshi_measure_ssim(const vshi_pair *pair, const vsh_compare_options *options, void *scratch,
                       vsh_measures *m) {
    (void)options;
    (void)scratch;
    sums *rows = calloc((TAPS + 1) * pair->size[0], sizeof *rows);
    if (rows == NULL) {
        return false;
    }
    double taps[TAPS], total = 0.0;
    make_taps(taps);
    for (size_t z = 0; z < pair->size[2]; ++z) {
        total += slice(pair, z * pair->stride[2], taps, rows, rows + TAPS * pair->size[0]);
    }
    m->value[VSH_MEASURE_SSIM] = total / (double)m->count;
    free(rows);
    return true;
}
