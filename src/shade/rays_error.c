/* What the rays of a point leave of its error, by how many of them were lit and what is known of the points
 * around. */
#include "shade/rays.h"

#include <math.h>

/* Variances of what an edge through the middle of the disc leaves, of n^-3/2 and n^-1 (and see
 * vshi_rays_error()); of what no ray has seen, over the square of what it is expected to be: 2 for a
 * geometric distribution. */
static const double SOBOL = 0.2, BLUE = 0.12, UNSEEN = 1.5;

double vshi_rays_deviation(int32_t sampler, int32_t lit, int32_t taken, double expected) {
    /* the share is smoothed by a ray of the expected share (Jeffreys' prior where that is a half), so that a
     * few rays that agree prove nothing */
    const double n = taken, p = (lit + expected) / (n + 1.0);
    const double root = sqrt(n);
    const double white = 1.0 / root, low = 1.0 / (root * sqrt(root));
    const double spread = sampler == VSH_SAMPLER_WHITE ? white
                          : sampler == VSH_SAMPLER_BLUE
                              ? (1.6 * low > 0.56 * white ? 1.6 * low : 0.56 * white)
                              : 1.04 * low;
    return spread * sqrt(p * (1.0 - p));
}

/* A power a little less than a third, by roots, which have the same bits everywhere. */
static double third_of(double x) {
    const double fourth = sqrt(sqrt(x));
    return fourth * sqrt(sqrt(fourth));
}

double vshi_rays_error(int32_t sampler, int32_t lit, int32_t taken, double lit_around, double taken_around) {
    const double n = taken;
    const int32_t fewer = lit < taken - lit ? lit : taken - lit;
    const double around = fewer == lit ? lit_around : taken_around - lit_around;
    /* the lesser part, expected as large as around the point, smoothed by Laplace's rule of succession */
    const double p = fmin(0.5, (fewer + 1.0) / (n + (taken_around + 2.0) / (around + 1.0)));
    if (fewer == 0) {
        return sqrt(UNSEEN) * p;
    }
    const double white = p * (1.0 - p) / n, edge = third_of(4.0 * p * (1.0 - p));
    const double even = sampler == VSH_SAMPLER_SOBOL  ? SOBOL * edge / (n * sqrt(n))
                        : sampler == VSH_SAMPLER_BLUE ? BLUE * edge * edge / n
                                                      : white;
    return sqrt(even < white || sampler == VSH_SAMPLER_BLUE ? even : white);
}
